"""Centroid, Duet, and controls that are known in part: what is different from their relatives.

Each difference is one that a machine would show: the tool somewhere else, or on another path.
"""

import io
import math
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk import Machine, process
from gcodejerk.machine import find_machine
from gcodejerk.nc import DIALECTS, Start, read_program, trace
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

IN_PART = (
    *("uccnc", "edingcnc", "planetcnc", "masso", "mitsubishi", "mazatrol-eia", "syntec"),
    *("okuma", "fagor"),
)
ZERO = dict.fromkeys("XYZ", 0.0)
START = Start(positions=ZERO, decimal_point="calculator", spindle="mill")
NOT_UNDERSTOOD, START_UNKNOWN = "block not understood", "start unknown"
HEADS = {
    **dict.fromkeys(IN_PART, b"G21 G90 G94 G17 G40\nG1 F100.\n"),
    "fagor": b"G71 G90 G94 G17 G40\nG1 F100.\n",
    "centroid": b"G21 G90 G94 G17 G40\nG1 F100.\n",
    "duet": b"M453\nG21\nG90 G94 G17\n",
}


def reasons(program, dialect, start=START, head=True):
    """What each rapid is left alone for; None where it is certain, and the second reader agrees."""
    data = (HEADS[dialect] if head else b"") + program + b"M2\n"
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    found = Findings(9)
    confirm(
        io.BytesIO(data), dialect, start, rapids, np.flatnonzero(rapids.reason == CERTAIN), found
    )
    assert not found.violations
    return [None if r == CERTAIN else str(REASONS[r]) for r in rapids.reason.tolist()]


def end(program, dialect, start=START):
    """X, Y and Z behind a program."""
    *_, last = trace(io.BytesIO(HEADS[dialect] + program), dialect=dialect, start=start)
    return last[1][:3]


@pytest.mark.parametrize("dialect", IN_PART)
def test_what_is_known_in_part_says_so(dialect):
    read = read_program(io.BytesIO(HEADS[dialect] + b"G0 X5.\n"), dialect=dialect, start=START)
    (note,) = [f.message for f in read.findings if "unverified" in f.message]
    assert note.startswith(f"dialect {dialect}: ")
    assert "unverified" in DIALECTS[dialect].title
    assert DIALECTS[dialect].unknown_lasts


def test_the_note_reaches_the_user():
    machine = Machine.load(find_machine("vmc"))
    made = process(HEADS["uccnc"] + b"G0 X5\nM30\n", machine, dialect="uccnc", controller="mach")
    assert any("UCCNC were not verified" in note for note in made.notes)


@pytest.mark.parametrize("dialect", [*IN_PART, "centroid"])
@pytest.mark.parametrize("unknown", [b"G68.9", b"M777", b"G0 X1. ? Y2."])
def test_nothing_is_rewritten_behind_a_code_that_may_last(dialect, unknown):
    program = b"G0 Z9.\n%s\nG21 G71 G90 G94 G17 G40\nG0 X5.\nG0 X7.\n"
    program = program.replace(b"G21 G71", b"G71" if dialect in ("syntec", "fagor") else b"G21")
    first, *behind = reasons(program % unknown, dialect)
    assert first is None
    assert set(behind) == {NOT_UNDERSTOOD}
    assert reasons(program % b"M5", dialect)[-1] is None


def test_an_owner_declares_what_is_harmless():
    start = Start(positions=ZERO, harmless=frozenset({"M777", "G68.9"}), spindle="mill")
    assert reasons(b"M777\nG68.9\nG0 X7\n", "uccnc", start) == [None]


@pytest.mark.parametrize("dialect", [*IN_PART, "centroid"])
@pytest.mark.parametrize("line", [b"G28 Z0.", b"G53 X1.", b"G92 X0.", b"G30 Z0.", b"T1 M6"])
def test_what_leads_to_an_unknown_place_leaves_no_position(dialect, line):
    has = dialect not in ("fagor", "okuma") or line[:3] not in (b"G28", b"G30")
    at = end(b"G0 X5. Y5. Z5.\n%s\n" % line, dialect)
    assert all(map(math.isnan, at)) or not has


@pytest.mark.parametrize("dialect", [*IN_PART, "centroid"])
def test_cycles_move_somewhere_and_change_no_mode(dialect):
    program = b"G0 X5. Z5.\nG81 X1. Y1. Z-5. R2. F90.\nX2.\nG80\nG0 X9.\nG0 X10.\n"
    found = reasons(program, dialect)
    assert found[1:] == [*["rapid inside a canned cycle"] * 2, START_UNKNOWN, None]


@pytest.mark.parametrize("dialect", ["uccnc", "edingcnc", "planetcnc", "masso", "centroid"])
def test_a_dwell_beside_axis_words_is_not_guessed_at(dialect):
    assert None not in reasons(b"G0 X5\nG4 X2\nG0 X7\n", dialect)[1:]
    assert reasons(b"G0 X5\nG4 P2\nG0 X7\n", dialect) == [None, None]


def test_a_branch_without_an_o_word_may_not_run():
    program = b"G0 X5\nif [#1 > 0]\nG91\nendif\nG0 X9\nG0 X10\n"
    assert None not in reasons(program, "edingcnc")


@pytest.mark.parametrize(
    "dialect", ["centroid", "uccnc", "edingcnc", "planetcnc", "masso", "okuma"]
)
def test_a_jump_may_lead_back_to_lines_in_front_of_it(dialect):
    program = b"G0 X5.\nN10 G0 X7.\nG1 X9. F90.\nG91\n%s\n"
    assert None not in reasons(program % b"IF [#1 LT 5] GOTO 10", dialect)
    assert None not in reasons(program % b"GOTO 10", dialect)
    assert reasons(program % b"(GOTO 10, for ever)", dialect) == [None, None]


@pytest.mark.parametrize("dialect", ["uccnc", "edingcnc", "planetcnc", "masso"])
@pytest.mark.parametrize(
    ("comment", "acts"),
    [("(expr, a=5)", True), ("( Cut_2 ,)", False), ("(_do ,1)", True), ("(print, a, b)", False),
     ("(1, 2)", False), ("; (expr, 1)", False)],
)  # fmt: skip
def test_runs_of_plain_lines_see_comments_that_may_be_commands(dialect, comment, acts):
    lines = b"".join(b"G1 X%d.\nG0 Z%d.\n" % (k, k) for k in range(1, 60))
    data = b"G21 G90 G94 G17 G40\nG0 X1. Z90.\nG1 X2. F90.\nG0 Z80.\n" + lines
    data += comment.encode() + b"\nG0 Z70.\n" + lines
    one, other = (
        read_program(io.BytesIO(data), dialect=dialect, start=START, fast=fast)
        for fast in (True, False)
    )
    assert one.rapids.reason.tolist() == other.rapids.reason.tolist()
    assert [str(f) for f in one.findings] == [str(f) for f in other.findings]
    behind = one.rapids.reason[one.rapids.line > 123]
    assert bool((behind == CERTAIN).any()) is not acts


def test_a_comment_of_planetcnc_may_be_a_command():
    assert reasons(b"(print, G0 X5)\nG0 X9\n", "planetcnc") == [None]
    assert reasons(b"(expr, a=5)\nG0 X9\n", "planetcnc") == [NOT_UNDERSTOOD]


@pytest.mark.parametrize(
    ("dialect", "together"), [("centroid", "axes of the rapid move one after another"),
                              ("masso", "axes of the rapid move one after another"),
                              ("rs274", "axes of the rapid move one after another"),
                              ("mach", None), ("uccnc", None)],
)  # fmt: skip
def test_centroid_moves_z_before_the_other_axes_or_behind_them(dialect, together):
    head = HEADS.get(dialect, HEADS["uccnc"])
    program = head + b"G0 X5 Y5\nG0 X9 Z9\nG0 Z5\nG0 X9 Y3 Z5\nX1 Z9\n"
    found = reasons(program, dialect, head=False)
    # the fourth names Z, which stands there
    assert found == [None, together, None, None, together]


def test_runs_of_plain_lines_see_what_moves_apart():
    """The arrays of long runs give the same reasons as line by line."""
    apart = replace(DIALECTS["mach"], apart=frozenset("Z"))
    lines = [b"X%d Y%d%s" % (k, k % 3, b" Z%d" % (k % 7) if k % 2 else b"") for k in range(80)]
    data = b"G21 G90 G94 G17 G40 G64\nG1 F90\nG0 X0 Y0 Z0\n" + b"\n".join(lines) + b"\n"
    one, other = (
        read_program(io.BytesIO(data), dialect=apart, start=START, fast=fast).rapids.reason.tolist()
        for fast in (True, False)
    )
    assert one == other
    assert len(set(one)) > 1


def test_g53_of_centroid_moves_at_once_and_leaves_the_frame():
    at = end(b"G0 X5 Y5 Z5\nG53 X1 Z0\n", "centroid")
    assert all(map(math.isnan, at))
    assert reasons(b"G0 X5\nG53 X1\nG0 X7\nG0 X8\n", "centroid")[-1] is None


def test_numbers_of_the_relatives_of_fanuc_may_be_increments():
    start = Start(positions=ZERO, spindle="mill")
    for dialect in ("mitsubishi", "mazatrol-eia", "syntec", "okuma"):
        why = "number without a decimal point"
        assert reasons(b"G0 X5\nG0 X7.\n", dialect, start) == [why, START_UNKNOWN]
    assert reasons(b"G0 X5\nG0 X7\n", "fagor", start) == [None, None]


def test_a_computed_position_is_not_rewritten_where_macros_are_not_verified():
    found = reasons(b"G0 X5.\n#1=7.\nG0 X#1\nG0 X9.\n", "mitsubishi")
    assert found[0] is None
    assert None not in found[1:]


def test_an_angle_of_a_line_moves_axes_that_it_does_not_name():
    for dialect in ("mitsubishi", "mazatrol-eia", "syntec"):
        at = end(b"G0 X5. Y5. Z5.\nG1 X9. A45. F90.\n", dialect)
        assert all(map(math.isnan, at))


def test_units_of_syntec_have_two_names():
    for inch, mm in ((b"G70", b"G71"), (b"G20", b"G21")):
        assert end(inch + b"\nG0 X1.\n", "syntec")[0] == 25.4
        assert end(mm + b"\nG0 X1.\n", "syntec")[0] == 1.0


def test_work_systems_of_okuma_are_no_tool_lengths_of_others():
    program = b"G0 X5. Z5.\nG15 H2\nG0 X7.\nG0 X8.\nG56 H1\nG0 X9.\n"
    assert reasons(program, "okuma") == [None, START_UNKNOWN, None, START_UNKNOWN]
    for line in (b"VC1=5", b"G62 X1", b"G11 X5.", b"MODIN O100"):
        first, *behind = reasons(b"G0 X5.\n%s\nG40 G21 G90 G0 X7.\nX8.\n" % line, "okuma")
        assert first is None
        assert None not in behind, line


def test_the_file_name_of_okuma_is_no_block():
    program = b"$PART.MIN%\nO1000\n" + HEADS["okuma"] + b"G0 X5.\nG0 X7.\n"
    assert reasons(program, "okuma", head=False) == [None, None]


def test_statements_of_fagor_in_parentheses_are_no_comments():
    assert None not in reasons(b"G0 X5\n(GOTO N10)\nG0 X7\n", "fagor")
    assert reasons(b"G0 X5\n(P1 = 5)\nG0 X7\n", "fagor") == [None, NOT_UNDERSTOOD]
    assert reasons(b"G0 X5\n;GOTO N10\nG0 X7\n", "fagor") == [None, None]
    assert reasons(b"G0 X5\nG0 X7I\nG0 X9\n", "fagor") == [None, NOT_UNDERSTOOD, NOT_UNDERSTOOD]


def test_commands_of_a_line_of_duet_run_in_turn():
    assert end(b"G0 X5\nG91 G0 X2\n", "duet")[0] == 7.0
    assert math.isnan(end(b"G0 X5\nG0 X9 G91\n", "duet")[0])
    found = reasons(b"G0 X5\nG0 X9 G91\nG90\nG0 X7\nG0 X8\n", "duet")
    assert found[1:] == [NOT_UNDERSTOOD, START_UNKNOWN, None]


def test_axis_words_alone_are_no_certain_move_of_duet():
    assert reasons(b"G0 X5\nM3 S900\nX7\nG0 X8\nG0 X9\n", "duet") == [None, START_UNKNOWN, None]


def test_f_beside_g0_is_ignored_by_duet_and_cannot_be_restored():
    assert reasons(b"G0 X5 F600\nG0 X6\nG0 X7\n", "duet") == [NOT_UNDERSTOOD, START_UNKNOWN, None]
    lost = "feed to restore unknown"
    assert reasons(b"G1 F600\nG0 X5\nG1 X6\n", "duet") == [lost]
    assert reasons(b"G1 F600\nG0 X5\nG1 X6 F600\n", "duet") == [None]


@pytest.mark.parametrize(
    "line", [b"G1 H2 X3", b"G1 R1 X3", b"G28 X", b"G53 G0 X3", b"T1", b"M6 T1"]
)
def test_what_moves_otherwise_leaves_no_position_on_duet(line):
    assert math.isnan(end(b"G0 X5\n%s\n" % line, "duet")[0])


def test_behind_a_command_in_small_letters_nothing_is_rewritten():
    for line in (b"while iterations < 3\n  G91", b"if var.a > 1\n  G0 X3"):
        found = reasons(b"G0 X5\n%s\nG90\nG0 X7\nG0 X8\n" % line, "duet")
        assert found[0] is None
        assert None not in found[1:]
    assert reasons(b'G0 X5\necho "G0 X9"\nG0 X7\n', "duet") == [None, None]
    assert reasons(b'G0 X5\nG94 echo "a" G91\nG0 X7\n', "duet")[-1] is not None
