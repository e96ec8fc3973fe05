"""Words that are spelled as nobody spells them, and that a control reads all the same.

What it makes of them, LinuxCNC's interpreter says (tests/clients/test_interpreter_spelling.py).
"""

import io
from dataclasses import replace

import pytest

from gcodejerk.axes import AXES
from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.verification.second_reading.agreement import observations

AT_ZERO = Start(
    positions=dict.fromkeys(AXES, 0.0),
    offsets={"G54": dict.fromkeys(AXES, 0.0)},
    startup="G17 G21 G40 G49 G54 G64 G90 G94 G97",
)


def last_rapid(data, dialect="linuxcnc", startup=AT_ZERO.startup):
    """Start and end of the rapid in the last line but one, by both readings; None if not sure."""
    line, start = data.count(b"\n"), replace(AT_ZERO, startup=startup)
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    first = [
        (tuple(rapids.start[i, :3]), tuple(rapids.target[i, :3]))
        for i in range(len(rapids))
        if rapids.line[i] == line and rapids.reason[i] == CERTAIN
    ]
    ((_, seen),) = observations(io.BytesIO(data), find_dialect(dialect), start, [line])
    second = (tuple(seen.start[:3]), tuple(seen.end[:3])) if seen.sure else None
    if second and not (second[0][0] == second[0][0] and second[1][0] == second[1][0]):
        second = None  # where X goes, it does not know
    return (first or [None])[0], second


BEHIND_AN_ASSIGNMENT = {
    "a move": (b"#1=5 X7", (7, 0, 0)),
    "a name": (b"# < x y >=12.5Y7", (0, 7, 0)),
    "a mode": (b"#1=-[#2+1] G91\nG0 X1\nX1\nG90", (2, 0, 0)),
    "two signs": (b"#1=-#2Z2 #3=4", (0, 0, 2)),
    "a feed move": (b"#1=SIN[30] G1 Y3 F100", (0, 3, 0)),
    "a comment": (b"#1=5 (c) X7", (7, 0, 0)),
    "a function of two": (b"#1=ATAN[1]/[2] X7", (7, 0, 0)),
}


@pytest.mark.parametrize("case", BEHIND_AN_ASSIGNMENT)
def test_words_behind_an_assignment_are_words(case):
    text, where = BEHIND_AN_ASSIGNMENT[case]
    first, second = last_rapid(b"#2=1\nG0 X0 Y0 Z0\n" + text + b"\nG0 X4 Y4 Z4\nM2")
    assert first == second == (where, (4, 4, 4))


@pytest.mark.parametrize("code", [b"G92.1", b"G92.2"])
def test_words_beside_a_code_that_takes_a_shift_back_move(code):
    first, second = last_rapid(b"G0 X8 Y0 Z0\n" + code + b" Z-1\nG0 X8 Y6 Z7\nM2")
    assert first == second == ((8, 0, -1), (8, 6, 7))


@pytest.mark.parametrize("text", [b"#2=3 4\nG0 X0 Y1 Z2\nG0 X#2", b"G0 X0 Y1 Z2\nG0 X[3 0+4]"])
def test_blanks_count_nowhere_within_what_is_computed(text):
    first, second = last_rapid(text + b"\nM2")
    assert second == ((0, 1, 2), (34, 1, 2))
    assert first in (None, second)


def test_blanks_count_nowhere_within_the_number_of_a_variable():
    data = b"#1=1\n#12=7\nG0 X#1 2 Y1 Z2\nG0 X5\nM2"
    first, second = last_rapid(data)
    assert second == ((7, 1, 2), (5, 1, 2))
    assert first in (None, second)


STARTS = {"linuxcnc": AT_ZERO.startup}
HEADS = {
    "marlin": b"G21\nG90\nG54\nG0 F3000 X0 Y0 Z0\n",
    "klipper": b"G21\nG90\nG0 F3000 X0 Y0 Z0\n",
}
HEAD = b"G21 G90 G94 G17 G54 G40 G49\nG0 X0. Y0. Z0.\n"
BEHIND = b"\nG0 F3000. X4.\nG0 X5.\n"


def known(dialect, odd):
    """Whether either reading is sure of a rapid behind a line."""
    data = HEADS.get(dialect, HEAD) + odd + BEHIND
    return [found is not None for found in last_rapid(data, dialect, STARTS.get(dialect, ""))]


@pytest.mark.parametrize("dialect", ["grbl", "marlin", "klipper", "fanuc", "rs274"])
def test_a_carriage_return_may_end_a_comment(dialect):
    """Marlin and grbl end a line at it (queue.cpp, protocol.c), and senders in Python may."""
    comment = b"(c%sG91)" if dialect == "fanuc" else b";c%sG91"
    assert known(dialect, comment % b" ") == [True, True]
    assert known(dialect, comment % b"\r") == [False, False]


def test_what_runs_behind_a_carriage_return_may_be_anything():
    assert known("grbl", b"; \rF50") == [False, False]


def test_a_carriage_return_within_a_line_is_nothing_for_linuxcnc():
    assert known("linuxcnc", b";c\rG91") == known("linuxcnc", b"(c\rG91\r)") == [True, True]


def test_the_quick_reading_stops_at_a_carriage_return_too():
    data = (
        HEAD
        + b"G1 X0 F100\n"
        + b"G0 X1\nG0 X2\n" * 20
        + b"(c\rG91\r)\n;c\rG91\n"
        + b"G0 X2\nG0 X3\n" * 40
    )
    for fast in (True, False):
        start = replace(AT_ZERO, startup="")
        rapids = read_program(io.BytesIO(data), dialect="grbl", start=start, fast=fast).rapids
        assert (rapids.reason[(rapids.line > 3) & (rapids.line < 43)] == CERTAIN).all()
        assert (rapids.reason[rapids.line > 45] != CERTAIN).all()


MARLIN = {
    "a tab in front": b"\tG91",
    "a tab in a code": b"G\t91",
    "a tab in front of a number": b"G0 X\t5",
    "N of its own, which a sender's stands in front of": b"N10 G91",
    "a tab behind N": b"N10\tG91",
    "a blank in front of it": b" N 10 G91",
    "a sign in front of a code": b"G+91",
    "a blank behind a sign": b"G0 X- 5",
    "a line of 96 characters": b"G0 X1" + b" " * 86 + b"Y1000",
}


@pytest.mark.parametrize("case", MARLIN)
def test_marlin_may_read_another_word_or_none(case):
    """Its parser passes over blanks alone, and its queue cuts a line (parser.cpp, queue.cpp)."""
    assert known("marlin", MARLIN[case]) == [False, False]


def test_klipper_may_take_a_number_for_the_command():
    """Of two N, the second is it (klippy/gcode.py, _process_commands)."""
    assert known("klipper", b"N10 G91") == [False, False]


@pytest.mark.parametrize(
    "line",
    [
        b"\t; text",
        b"G 91\t",
        b"G0 X5\tY6",
        b"G0 X1" + b" " * 86 + b"Y100",
        b"(Adaptive - depth: G -2,\tN 10)",
        b"G0 X5 ; 16 - 4\tof N 10",
    ],
)
def test_marlin_reads_these_as_they_stand(line):
    assert known("marlin", line) == [True, True]


LONG = b"N1 G0 G17 G21 G54 G90 G94 G40 X1.5 Y2.5 F100. Z3."
LONG += b"0" * (79 - len(LONG.replace(b" ", b"")))
GRBL = {
    "zeros in front": b"G0 X0000000012.5",
    "a digit too many": b"G0 X00000012.5",
    "a digit too many behind a sign": b"G0 X-00000012.5",
    "a blank in it": b"G0 X000 000 12.5",
    "a feed move": b"G1 X00000012.5 F100",
    "80 characters": LONG + b"0",
}


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("case", GRBL)
def test_grbl_reads_eight_digits_and_79_characters(case, dialect):
    """Digits behind the eighth are lost (nuts_bolts.c), longer lines refused (protocol.c)."""
    for odd in (GRBL[case], GRBL[case] + b" (c)"):
        first, second = last_rapid(HEAD + odd + b"\nG0 X5.\nM2", dialect, "")
        assert first is None
        assert second is None


@pytest.mark.parametrize("line", [b"G0 X12.345678901", b"G0 X-0000012.5", b"N1234567 G0 X1", LONG])
def test_grbl_loses_no_digits_that_matter(line):
    first, second = last_rapid(HEAD + line + b"\nG0 X5.\nM2", "grbl", "")
    assert first is not None
    assert first == second


def test_many_digits_are_seen_in_a_run_of_plain_lines_too():
    run = b"".join(b"G0 X%d.5 Y%d\nG1 X%d.25 F100\n" % (n, n, n) for n in range(30))
    for odd in (b"G0 X00000012.5\n", b"G1 X00000012.5\n"):
        line = (HEAD + run + odd).count(b"\n") + 1
        data = HEAD + run + odd + b"G0 X5 Y2\n" + run + b"M2\n"
        start = replace(AT_ZERO, startup="")
        for fast in (True, False):
            rapids = read_program(io.BytesIO(data), dialect="grbl", start=start, fast=fast).rapids
            assert (
                rapids.reason[(rapids.line > line - 2) & (rapids.line <= line)] != CERTAIN
            ).all()
        ((_, seen),) = observations(io.BytesIO(data), find_dialect("grbl"), start, [line])
        assert not (seen.sure and seen.start[0] == seen.start[0])


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "okuma", "any-mill"])
@pytest.mark.parametrize("odd", [b"G9 1", b"G9 .1", b"X1. M9 8"])
def test_a_code_that_may_go_on_behind_a_blank_may_be_another(odd, dialect):
    """Blanks count nowhere on many controls: G9 1 is G91 there."""
    if find_dialect(dialect).text.blanks == "between":
        data = HEAD + odd + b"\nG0 X5. Y5. Z5.\nG0 X6.\nM2"
        assert last_rapid(data, dialect, "")[0] is None


def test_a_feed_that_may_go_on_behind_a_blank_is_not_known():
    data = HEAD + b"G1 X1. F100.\nG0 X2.\nF1 00.\nG0 X5. Y5. Z5.\nG0 X6.\nG1 X7."
    assert last_rapid(data, "fanuc", "")[0] is None
