"""Loops, branches, subprograms and variables against LinuxCNC's own interpreter.

For every rapid that we are certain of, start and end agree with the interpreter on every pass, and
so does every position that we claim to know behind a line. Variables of which we know nothing are
set in the file of parameters that the interpreter alone reads.
"""

import io
import math
import shutil
import subprocess
from bisect import bisect_right
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from interpreter import run_oracle

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import CERTAIN, Start, read_program, trace
from gcodejerk.rewrite.pipeline import process

HERE = Path(__file__).resolve().parent
STARTUP = "G17 G21 G40 G49 G54 G64 G90 G94 G97"
AT_ZERO = Start(
    positions=dict.fromkeys(AXES, 0.0), offsets={"G54": dict.fromkeys(AXES, 0.0)}, startup=STARTUP
)
TOLERANCE = 1e-6
VMC = Machine.load(find_machine("vmc"))

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC's interpreter (linuxcnc-uspace) is absent"
    ),
]


def interpret(path):
    """Moves: (line, what, X Y Z), and the refusal."""
    table = path.with_suffix(".tbl")
    table.write_text("T1 P1 Z0 D5\n")
    try:
        done = run_oracle(path, "--startup", STARTUP, "--tool-table", table, timeout=2)
    except subprocess.TimeoutExpired:
        return [], "endless"
    moves = []
    for row in done.stdout.splitlines():
        line, what, *values = row.split()
        if what in ("TRAVERSE", "FEED"):
            moves.append((int(line), what, tuple(map(float, values[:3]))))
    return moves, done.stderr.strip()


def disagreements(data, moves, refused, start):
    """What we claim and the interpreter does not do; how many rapids we are certain of."""
    wrong = []
    after = {line: positions for line, positions, _ in trace(io.BytesIO(data), start=start)}
    rapids = read_program(io.BytesIO(data), start=start).rapids
    assert list(rapids.line) == sorted(set(rapids.line)), "one row per rapid, in the file's order"
    certain = {int(rapids.line[i]): i for i in range(len(rapids)) if rapids.reason[i] == CERTAIN}
    at = (0.0, 0.0, 0.0)
    for line, what, to in moves:
        for axis, name in enumerate("XYZ"):
            known = after[line][axis]
            if not math.isnan(known) and abs(known - to[axis]) > TOLERANCE:
                wrong.append(f"line {line} ends at {name}{to[axis]}, read as {known}")
        if line in certain:
            i = certain[line]
            if what != "TRAVERSE":
                wrong.append(f"line {line} is {what}, read as a rapid")
            for axis, name in enumerate("XYZ"):
                for claim, real in ((rapids.start[i, axis], at), (rapids.target[i, axis], to)):
                    if not math.isnan(claim) and abs(claim - real[axis]) > TOLERANCE:
                        wrong.append(f"line {line}: {name}{real[axis]}, read as {claim}")
        at = to
    return wrong, len(certain)


numbers = st.integers(-5, 9).map(str)
variables = st.sampled_from(["#1", "#2", "#<a>", "#<_glob>", "#40"])
operands = st.one_of(numbers, numbers, variables, variables)
operators = st.sampled_from(["+", "-", "*"])
values = st.one_of(
    operands, st.builds(lambda a, o, b: f"[{a} {o} {b}]", operands, operators, operands)
)
comparisons = st.sampled_from(["LT", "GT", "EQ", "NE", "LE", "GE"])


@st.composite
def flows(draw):
    """Draw a program: subprograms, then a main program that calls them, in loops and branches."""
    labels = iter(range(100, 10000))
    lines = ["#<_glob>=3 #40=2 #1=1 #2=2 #<a>=4"]
    subs = []

    def condition():
        if draw(st.integers(0, 3)) == 0:
            # Read as unknown: nothing in the file sets it for certain.
            return f"[#33 {draw(comparisons)} {draw(numbers)}]"
        return f"[{draw(operands)} {draw(comparisons)} {draw(operands)}]"

    def body(depth, loop=None, inside=False):
        out = []
        for _ in range(draw(st.integers(1, 4))):
            out += statement(depth, loop, inside)
        return out

    def statement(depth, loop, inside):
        kind = draw(st.integers(0, 17 if depth < 3 else 9))
        if kind <= 4:
            axes = draw(st.lists(st.sampled_from("XYZ"), min_size=1, max_size=2, unique=True))
            code = draw(st.sampled_from(["G0 ", "G0 ", "G0 ", "", "G1 "]))
            number = numbers if draw(st.integers(0, 2)) else values
            return [code + " ".join(axis + draw(number) for axis in axes)]
        if kind == 5:
            return [draw(st.sampled_from(["G90", "G91", "G90", "G0", "G1", "F200", "G0 X0 Y0 Z0"]))]
        if kind <= 7:
            return [f"{draw(variables)}={draw(values)}"]
        if kind == 8 and subs:
            arguments = "".join(f" [{draw(operands)}]" for _ in range(draw(st.integers(0, 2))))
            return [f"o{draw(st.sampled_from(subs))} call{arguments}"]
        if kind <= 9:
            if loop and draw(st.booleans()):
                word = draw(st.sampled_from(["break", "continue"]))
                return wrapped(f"o{loop} {word}")
            if inside and draw(st.booleans()):
                return wrapped(f"o{inside} return")
            return ["/G0 X3"] if draw(st.booleans()) else ["G90 G0 X1 Y1"]
        label = next(labels)
        if kind <= 12:
            out = [f"o{label} if {condition()}", *body(depth + 1, loop, inside)]
            if draw(st.booleans()):
                out += [f"o{label} elseif {condition()}", *body(depth + 1, loop, inside)]
            if draw(st.booleans()):
                out += [f"o{label} else", *body(depth + 1, loop, inside)]
            return [*out, f"o{label} endif"]
        if kind <= 14:
            count = draw(st.sampled_from(["[0]", "[1]", "[2]", "[3]", "[#<_glob>]", "[#34]"]))
            return [
                f"o{label} repeat {count}",
                *body(depth + 1, None, inside),  # LinuxCNC has no break out of repeat
                f"o{label} endrepeat",
            ]
        # A loop ends for certain: a counter of its own.
        counter = f"#{200 + label}" if draw(st.booleans()) else f"#<n{label}>"
        first = f"{counter}=0" if draw(st.integers(0, 2)) else f"{counter}=[#35 * 0]"
        test = f"[{counter} LT {draw(st.integers(1, 3))}]"
        step = f"{counter}=[{counter} + 1]"
        if kind == 15:
            return [
                first,
                f"o{label} do",
                step,
                *body(depth + 1, label, inside),
                f"o{label} while {test}",
            ]
        return [
            first,
            f"o{label} while {test}",
            step,
            *body(depth + 1, label, inside),
            f"o{label} endwhile",
        ]

    def wrapped(jump):
        label = next(labels)
        return [f"o{label} if {condition()}", jump, f"o{label} endif"]

    for _ in range(draw(st.integers(0, 3))):
        label = next(labels)
        lines += [f"o{label} sub", "#<a>=#1", *body(1, None, label), f"o{label} endsub"]
        subs.append(label)
    lines += ["G0 F100", *body(0), *body(0), *body(0), "G0 X1", "M2"]
    return lines


def write(folder, k, lines):
    """Two files: with the unknown variables set to values, as the interpreter runs them."""
    path = folder / f"{k}.ngc"
    path.write_text("\n".join(lines) + "\n")
    return path


LEFTOVERS = {
    "a continue of a do begins a later repeat again": """
#1=0
o102 do
#1=[#1+1]
o104 if [#1 LE 7]
o102 continue
o104 endif
o102 while [#1 LT 2]
o107 repeat [1]
G91 G0 X8
o107 endrepeat
""",
    "and the repeat around it": """
#2=0
o100 repeat [3]
G91 G0 X8
#2=[#2+1]
#1=0
o102 do
#1=[#1+1]
o104 if [#2 EQ 2]
o102 continue
o104 endif
o102 while [#1 LT 2]
o100 endrepeat
""",
    "and a while that is left by a break": """
#1=0
o102 do
#1=[#1+1]
o104 if [#1 LE 7]
o102 continue
o104 endif
o102 while [#1 LT 2]
o103 while [#1 LT 4]
#1=[#1+1]
G91 G0 X8
o105 if [#1 EQ 3]
o103 break
o105 endif
o103 endwhile
""",
    "on the second pass of the loop around": """
#1=0
#2=0
o100 while [#2 LT 2]
G90 G0 X0
o101 repeat [1]
G91 G0 X8
o101 endrepeat
G90 G0 X0
o102 do
#1=[#1+1]
o104 if [#1 LE 7]
o102 continue
o104 endif
o102 while [#1 LT 2]
#1=0
#2=[#2+#3]
#3=1
o100 endwhile
""",
    "a break that a while passes over ends a later do": """
#1=0
o100 while [#1 LT 2]
#1=[#1+1]
o101 if [#1 EQ 9]
o100 break
o101 endif
o100 endwhile
o102 do
G91 G0 X8
#1=[#1+1]
o102 while [#1 LT 5]
""",
    "a break ends a do of the second pass of the loop around": """
#1=0
o100 repeat [2]
o101 do
#1=[#1+1]
G91 G0 X8
o101 while [#1 LT 3]
G90 G0 X0
#1=0
o102 while [#1 LT 1]
o104 if [#1 LE 7]
o102 break
o104 endif
o102 endwhile
o100 endrepeat
""",
}


@pytest.mark.parametrize("name", LEFTOVERS)
def test_what_the_interpreter_keeps_of_a_jump(tmp_path, name):
    lines = ["F100", *LEFTOVERS[name].split("\n"), "G0 Y1", "M2"]
    moves, refusal = interpret(write(tmp_path, 0, lines))
    assert moves, refusal
    assert not refusal
    wrong, _ = disagreements("\n".join([*lines, ""]).encode(), moves, refusal, AT_ZERO)
    assert not wrong


# One program is one example: of several drawn at once, most draws would be too long for hypothesis,
# and thrown away. Without shrinking: each try costs a run of the interpreter.
FLOW = settings(
    deadline=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)  # fmt: skip


@pytest.fixture
def accepted():
    """Whether the interpreter ran each program to its end; of others it says little."""
    ran = []
    yield ran
    assert sum(ran) > len(ran) // 3


@pytest.mark.parametrize("part", range(2))  # for as many cores
@settings(FLOW, max_examples=20)
@given(lines=flows(), hidden=st.tuples(*[st.integers(-2, 4)] * 3))
def test_drawn_flow_is_read_as_the_interpreter_runs_it(tmp_path, accepted, part, lines, hidden):
    settings_line = " ".join(f"#{33 + n}={value}" for n, value in enumerate(hidden))
    moves, refusal = interpret(write(tmp_path, len(accepted), [settings_line, *lines]))
    accepted.append(bool(moves) and not refusal)
    # We read the same program without that line: for us the variables are unknown.
    data = ("(unknown)\n" + "\n".join(lines) + "\n").encode()
    for start in (Start(startup=STARTUP), AT_ZERO):
        wrong, _ = disagreements(data, moves, refusal, start)
        assert not wrong, f"{data.decode()}\n{wrong}\n{refusal}"


def ends(moves, spans):
    """Where each move ends, the points of a stream taken together."""
    found, before = [], None
    for line, _, to in moves:
        row = next((row for first, last, row in spans if first <= line <= last), None)
        if row is not None and row == before:
            found[-1] = to
        else:
            found.append(to)
        before = row
    return found


@pytest.fixture
def planned():
    """How many rapids of each program were rewritten."""
    counts = []
    yield counts
    assert sum(counts) > 10


@settings(FLOW, max_examples=16)
@given(lines=flows())
def test_drawn_flow_moves_alike_before_and_after(tmp_path, planned, lines):
    k = len(planned)
    path = write(tmp_path, k, ["#33=1 #34=2 #35=3", "G21 G90 G94 G64 F100", *lines])
    planned.append(0)
    moves, refusal = interpret(path)
    if refusal or not moves:
        return
    result = process(path.read_bytes(), VMC, controller="linuxcnc")
    planned[k] = result.planned
    after = tmp_path / f"{k}.after.ngc"
    after.write_bytes(result.output)
    starts = [0]
    for text in result.output.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))
    spans = [
        (bisect_right(starts, begin), bisect_right(starts, end - 1), row)
        for begin, end, row in result.edits.tolist()
        if row >= 0
    ]
    again, refusal = interpret(after)
    assert not refusal, (refusal, result.output.decode())
    reached, wanted = ends(again, spans), ends(moves, [])
    assert reached == [pytest.approx(to, abs=TOLERANCE) for to in wanted], path.read_text()
