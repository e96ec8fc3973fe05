"""Expressions and variables: what is computed, and what stays unknown."""

import io
import math

import pytest

from gcodejerk.nc import DIALECTS, Start, read_program, trace
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.reasons import CERTAIN
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

HEADS = {
    "linuxcnc": b"G21 G90 G94 G17 G40 G0 X0 Y0 Z0\n",
    "mach": b"G21 G90 G94 G17 G40 G0 X0. Y0. Z0.\n",
    "fanuc": b"G21 G90 G94 G17 G40 G0 X0. Y0. Z0.\n",
    "siemens": b"G71 G90 G94 G17 G40 G0 X0 Y0 Z0\n",
}


def end(text, dialect="linuxcnc"):
    """Positions X, Y, Z behind a plain head and the text."""
    *_, (_, positions, _) = trace(io.BytesIO(HEADS[dialect] + text), dialect=dialect, start=Start())
    return [None if math.isnan(p) else round(p, 9) for p in positions[:3]]


def value(text, dialect="linuxcnc", **variables):
    known = {name.lstrip("_"): number for name, number in variables.items()}
    result = evaluate(text, known, DIALECTS[dialect].arithmetic)
    return None if math.isnan(result) else result


# Each as rs274 2.9 answers.
@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"[2**3**2]", 64.0),
        (b"[-2**2]", 4.0),
        (b"[10-3-2]", 5.0),
        (b"[8/2/2]", 2.0),
        (b"[1+2*3 MOD 4]", 3.0),
        (b"[-7 MOD 3]", 2.0),
        (b"[7 MOD -3]", 1.0),
        (b"[-7 MOD -3]", 2.0),
        (b"[1 AND 2]", 1.0),
        (b"[1 XOR 2]", 0.0),
        (b"[1 OR 0 AND 0]", 0.0),
        (b"[2+3 EQ 5]", 1.0),
        (b"[1 EQ 1.00005]", 1.0),
        (b"[1 GE 1.00005]", 0.0),
        (b"[FIX[-1.5]]", -2.0),
        (b"[FUP[-1.5]]", -1.0),
        (b"[ROUND[-2.5]]", -3.0),
        (b"[ATAN[1]/[-1]]", 135.0),
        (b"-[1+[2*3]]", -7.0),
    ],
)
def test_linuxcnc_computes_as_its_interpreter_does(text, expected):
    assert value(text) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        *(b"[1/0]", b"[SQRT[-1]]", b"[LN[0]]", b"[ASIN[2]]", b"[-8 ** 0.5]", b"[10**400]"),
        *(b"#7", b"[1+#7]", b"##7", b"#[1.5]", b"[#7 EQ #7]", b"[0 AND #7]", b"[1 2]", b"[]"),
        *(b"[1+]", b"[+]", b"[FOO[1]]", b"[EXISTS[#<a>]]", b"[--1]", b"", b"[1", b"ATAN[1]"),
        # Rounding decides these: the last digit of the angle is many turns.
        *(b"[COS[3.5 ** 90]]", b"[SIN[2000000]]", b"[TAN[-3000000]]"),
    ],
)
def test_what_cannot_be_computed_is_unknown(text):
    assert value(text) is None


def test_variables_are_looked_up_by_number_name_and_value():
    assert value(b"[#1+#002]", _1=1.0, _2=2.0) == 3.0
    assert value(b"##1", _1=2.0, _2=5.0) == 5.0
    assert value(b"#[#1+1]", _1=1.0, _2=5.0) == 5.0
    known = {"<MYDEPTH>": 4.0}
    assert evaluate(b"#< My Depth >", known, DIALECTS["linuxcnc"].arithmetic) == 4.0
    assert evaluate(b"[EXISTS[#<mydepth>]]", known, DIALECTS["linuxcnc"].arithmetic) == 1.0


def test_macro_b_binds_or_like_plus_and_truncates():
    assert value(b"FIX[-1.5]", "fanuc") == -1.0
    assert value(b"FUP[-1.2]", "fanuc") == -2.0
    assert value(b"#1+2*#2", "fanuc", _1=1.0, _2=3.0) == 7.0
    assert value(b"5 AND 3", "fanuc") is None
    assert value(b"ATAN[-1]/[1]", "fanuc") is None, "0 to 360 or -180 to 180: a parameter says"


def test_siemens_has_round_brackets_and_r():
    assert value(b"R1+5*(R2-1)", "siemens", R1=1.0, R2=3.0) == 11.0
    assert value(b"SIN(30)*2", "siemens") == pytest.approx(1.0)
    assert value(b"R1[2]", "siemens", R1=1.0) is None


@pytest.mark.parametrize("unit", [b"[", b"-", b"#", b"SIN[", b"[1+", b"##[", b"**", b"1"])
def test_hostile_expressions_are_unknown(unit):
    for text in (unit * 20000, unit * 20000 + b"1" + b"]" * 20000):
        assert value(text) is None


def test_long_sums_are_computed():
    assert value(b"+".join([b"1"] * 10000)) == 10000.0


def test_end_of_a_rapid_with_an_expression_is_known():
    assert end(b"#1=5 #<a>=[2*3]\nG0 X#1 Y-#<a> Z[#1+1]\n") == [5, -6, 6]
    rapids = read_program(io.BytesIO(HEADS["linuxcnc"] + b"#1=5\nG0 X#1\nX7\n")).rapids
    assert rapids.reason.tolist()[-1] == 255
    assert rapids.start[-1, 0] == 5.0


def test_numbers_of_a_line_are_read_before_its_variables_are_set():
    assert end(b"#1=5\n#1=6 #2=#1\nG0 X#1 Y#2\n") == [6, 5, 0]
    assert end(b"#1=5\n#1=6 G0 X#1\n") == [5, 0, 0]
    assert end(b"#1=5.\n#1=6. G0 X#1\n", "fanuc")[0] is None


def test_variables_of_the_control_are_never_known():
    assert end(b"#5221=3 #5000=4 #<_x>=5\nG0 X#5221 Y#5000 Z#<_x>\n") == [None] * 3
    assert end(b"#<_mine>=3 #4999=2\nG0 X#<_mine> Y#4999\n") == [3, 2, 0]
    # ... and who sets one of Fanuc's may rename where the axes stand
    assert end(b"#100=1.\n#1000=2.\nG0 X#100 Y#1000\n", "fanuc") == [1, None, None]
    assert end(b"#100=1.\nG0 X#100 Y#1000\n", "fanuc") == [1, None, 0]


def test_tool_change_forgets_what_its_program_may_have_set():
    text = b"#1=1. \n#150=2.\nT1 M6\nG0 X#1 Y#150\n"
    assert end(text) == [1, None, None]
    assert end(text, "fanuc") == [1, None, None]


def test_target_that_is_computed_may_be_any_variable():
    assert end(b"#1=1\n#[#9]=2\nG0 X#1\n")[0] is None


def test_block_that_is_refused_leaves_its_variables_unknown():
    assert end(b"#1=1\n#1=2 G0 G1 Y5\nG0 X#1\n")[0] is None


def test_variable_set_twice_in_a_line_is_unknown():
    assert end(b"#1=1 #1=2\nG0 X#1\n")[0] is None


def test_skipped_assignment_may_or_may_not_have_been():
    assert end(b"#1=1 #2=2\n/#1=3 #2=2\nG0 X#1 Y#2\n") == [None, 2, 0]


def test_macro_b_assigns_expressions_without_brackets():
    assert end(b"#1=2.\n#2=#1*3.+[#1-1.]\nG0 X#2 Y-#1\n", "fanuc") == [7, -2, 0]


def test_computed_position_has_to_be_a_whole_number_of_increments():
    assert end(b"#1=10./3.\nG0 X#1\n", "fanuc")[0] is None
    assert end(b"#1=10.5/3.\nG0 X#1\n", "fanuc")[0] == 3.5
    assert end(b"G0 X[10/3]\n")[0] == pytest.approx(10 / 3)


def test_siemens_variables_give_positions():
    text = b"R1=10 R2=20\nG0 X=R1 Y=R1+R2*(3-1) Z=SIN(90)\n"
    assert end(text, "siemens") == [10, 50, 1]
    assert end(b"R1=10\nR1=11 R2=R1\nG0 X=R1 Y=R2\n", "siemens") == [11, None, 0]


def test_computed_codes_are_not_understood():
    assert end(b"#1=1\nG#1 X5 F100\n") == [None] * 3


def test_computed_feed_can_be_restored_where_it_is_short():
    head = HEADS["linuxcnc"] + b"#1=100\n"
    for feed, known in ((b"#1", True), (b"[#1/3]", False)):
        program = read_program(io.BytesIO(head + b"F" + feed + b"\nG0 X5\nG1 X6\nM2\n"))
        assert (int(program.rapids.reason[-1]) == 255) is known


# --- rapids of LinuxCNC to computed positions ---

COMPUTED = b"""G21 G90 G17 G40 G64 F100
#1=5 #<safe>=7.5
#2=[#1*2-#<safe>] #<a b>=[-#1]
G0 X0 Y0 Z0
G0 Z#<safe>
G0 X[#1 * 2] Y[#<Safe>/2]
G0 X#2 Y[#<ab>+0.25]
G0 X[1/3]
G0 X[0.1+0.2] Y[50*COS[90]]
G0 X#3
G0 Z1
M2
"""


def test_a_computed_number_is_certain_for_both_readers():
    places = dict.fromkeys("XYZ", 1.0)
    start = Start(positions=places)
    rapids = read_program(io.BytesIO(COMPUTED), start=start).rapids
    certain = [i for i, reason in enumerate(rapids.reason.tolist()) if reason == CERTAIN]
    assert rapids.line[certain].tolist() == [4, 5, 6, 7, 8, 9, 11]
    assert rapids.target[certain, :3].tolist() == [
        [0.0, 0.0, 0.0], [0.0, 0.0, 7.5], [10.0, 3.75, 7.5], [2.5, -4.75, 7.5],
        [1 / 3, -4.75, 7.5], [0.1 + 0.2, 50.0 * math.cos(math.pi / 2.0), 7.5],
        pytest.approx([math.nan, 50.0 * math.cos(math.pi / 2.0), 1.0], nan_ok=True),
    ]  # fmt: skip
    found = Findings(9)
    confirmed = confirm(io.BytesIO(COMPUTED), "linuxcnc", start, rapids, certain, found)
    assert (confirmed, found.violations) == (7, [])
    # a variable that one of the readers takes for another is noticed
    for row in certain[1:6]:
        rapids.target[row] += 0.0001
    confirm(io.BytesIO(COMPUTED), "linuxcnc", start, rapids, certain, found)
    assert len(found.violations) == 5
