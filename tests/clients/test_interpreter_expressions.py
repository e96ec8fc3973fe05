"""Expressions against LinuxCNC's own interpreter: what we compute is what it computes."""

import math
import re
import shutil

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from interpreter import run_oracle

from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.rewrite.pipeline import process

RULES = DIALECTS["linuxcnc"].arithmetic
KNOWN = {"1": 3.5, "2": -2.0, "3": 0.0, "4": 1.0, "<A>": 7.25}
HEAD = "#1=3.5 #2=-2 #3=0 #4=1 #<a>=7.25\nG21 G90 G0\n"
OPERATORS = [
    *("**", "*", "/", "MOD", "+", "-"),
    *("EQ", "NE", "GT", "GE", "LT", "LE", "AND", "OR", "XOR"),
]
FUNCTIONS = sorted(RULES.functions - {"ATAN", "EXISTS"})
PER_FILE = 60

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]

numbers = st.one_of(
    st.integers(0, 9).map(str),
    st.floats(0, 99, allow_nan=False).map(lambda v: f"{v:.3f}"),
    st.sampled_from(
        ["0.5", "-1.5", "2.5", "-3", "+4", ".25", "1.", "#1", "#2", "#3", "#<a>", "##4"]
    ),
)


def bracketed(inner):
    chain = st.lists(st.tuples(st.sampled_from(OPERATORS), inner), min_size=1, max_size=4)
    sums = st.builds(
        lambda first, rest: f"[{first}" + "".join(f" {op} {x}" for op, x in rest) + "]",
        inner,
        chain,
    )
    calls = st.builds(
        lambda name, x: f"{name}{x if x.startswith('[') else f'[{x}]'}",
        st.sampled_from(FUNCTIONS),
        inner,
    )
    turns = st.builds(lambda a, b: f"ATAN[{a}]/[{b}]", inner, inner)
    return st.one_of(sums, sums, calls, turns, sums.map(lambda text: "-" + text))


expressions = st.recursive(numbers, bracketed, max_leaves=12).map(lambda text: f"[{text}]")


def interpret(path):
    """X after every line that moves, and the refusal."""
    table = path.with_name("tools.tbl")
    table.write_text("T1 P1 Z0 D5\n")
    done = run_oracle(path, "--tool-table", table)
    rows = [row.split() for row in done.stdout.splitlines() if " TRAVERSE " in row]
    return {int(row[0]): float(row[2]) for row in rows}, done.stderr.strip()


def computed(text):
    return evaluate(text.encode(), KNOWN, RULES)


# without shrinking: each try costs a run of the interpreter
@settings(
    max_examples=25,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(st.lists(expressions, min_size=PER_FILE, max_size=PER_FILE))
def test_drawn_expressions_have_the_interpreters_value(tmp_path_factory, drawn):
    drawn = [text for text in drawn if len(text) < 200]
    ours = [(text, computed(text)) for text in drawn]
    # A line that the interpreter refuses ends the program: those that we take for unknown stay out.
    known = [(text, value) for text, value in ours if abs(value) < 1e6]
    folder = tmp_path_factory.mktemp("expressions")
    path = folder / "part.ngc"
    path.write_text(HEAD + "".join(f"X{text}\n" for text, _ in known) + "M2\n")
    ends, refusal = interpret(path)
    assert not refusal, (refusal, known)
    assert len(known) > len(drawn) // 4
    for line, (text, value) in enumerate(known, HEAD.count("\n") + 1):
        assert ends[line] == pytest.approx(value, abs=1e-6, rel=1e-9), text


@pytest.mark.parametrize("text", ["[1/0]", "SQRT[-1]", "LN[0]", "ASIN[2]", "[-8 ** .5]", "[1+]"])
def test_what_the_interpreter_refuses_is_unknown(tmp_path, text):
    path = tmp_path / "part.ngc"
    path.write_text(f"{HEAD}X{text}\nM2\n")
    _, refusal = interpret(path)
    assert refusal
    assert math.isnan(computed(text))


@pytest.mark.parametrize("text", ["TAN[90]", "TAN[-270]", "ATAN[TAN[ACOS[0]]]/[FUP[+4]]"])
def test_at_the_poles_of_the_tangent_nothing_is_known(tmp_path, text):
    """The interpreter finds a number, but its sign is that of an error of rounding."""
    path = tmp_path / "part.ngc"
    path.write_text(f"{HEAD}X[ATAN[{text}]/[1]]\nM2\n")
    ends, refusal = interpret(path)
    assert not refusal
    assert abs(ends[max(ends)]) == pytest.approx(90.0, abs=1.0)
    assert math.isnan(computed(f"[{text}]"))


@pytest.mark.parametrize("text", ["[ATAN[FIX[-[3 LT 2]]]/[-1]]", "[ATAN[0]/[-1]]", "[ATAN[0]/[0]]"])
def test_where_the_sign_of_a_zero_decides_nothing_is_known(text):
    """The interpreter's zero of the first has a sign: it turns to -180."""
    assert math.isnan(computed(text))


numbers_of_places = st.one_of(
    st.integers(1, 90).map(str), st.floats(0.5, 90.0, allow_nan=False).map(lambda v: f"{v:.6f}")
)
places = st.one_of(
    st.builds("[{}/{}]".format, numbers_of_places, st.integers(1, 9)),
    st.builds("[{}*0.375-{}*[1/7]]".format, numbers_of_places, numbers_of_places),
    st.builds("[#1*{}[{}]+{}]".format, st.sampled_from(["SIN", "COS"]), numbers_of_places, numbers),
    st.builds("[0-SQRT[{}]]".format, numbers_of_places),
)
MODES = ["G90 G21", "G91 G21", "G90 G20", "G91 G20"]
EXACT = 2e-9
"""What nine decimals of mm leave open, as the oracle prints them."""


@settings(
    max_examples=6,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
@given(st.lists(st.tuples(st.sampled_from(MODES), places, places), min_size=20, max_size=20))
def test_rapids_to_drawn_places_end_where_the_interpreter_takes_them(tmp_path_factory, drawn):
    text = re.sub(r"travel: \[.*\]", "travel: [-1.0e+5, 1.0e+5]", find_machine("vmc").read_text())
    machine = Machine.loads(text, "vmc, long")
    long = ("G90 G21", "[0-[77/3]]", "[22/7]")  # one that is rewritten at any rate
    lines = [f"{modes}\nG0 X{x} Y{y}\n" for modes, x, y in (*drawn, long)]
    data = f"{HEAD}G17 G40 G49 G64 G94 F100\nG0 X0 Y0 Z0\n{''.join(lines)}M2\n".encode()
    result = process(data, machine, controller="linuxcnc", name="part.ngc")
    assert result.planned
    ends = []
    for name, program in (("before.ngc", data), ("after.ngc", result.output)):
        path = tmp_path_factory.mktemp("places") / name
        path.write_bytes(program)
        table = path.with_name("tools.tbl")
        table.write_text("T1 P1 Z0 D5\n")
        done = run_oracle(path, "--tool-table", table)
        assert done.returncode == 0, done.stderr
        rows = [row.split() for row in done.stdout.splitlines() if " TRAVERSE " in row]
        ends.append([[float(word) for word in row[2:5]] for row in rows])
    after = iter(ends[1])
    for place in ends[0]:
        assert any(reached == pytest.approx(place, abs=EXACT) for reached in after), place
