"""Words that are spelled as nobody spells them, and that a control reads all the same.

What it makes of them, LinuxCNC's interpreter says (tests/clients/test_interpreter_spelling.py).
"""

import io

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


def last_rapid(data, dialect="linuxcnc"):
    """Start and end of the rapid in the last line but one, by both readings; None if not sure."""
    line = data.count(b"\n")
    rapids = read_program(io.BytesIO(data), dialect=dialect, start=AT_ZERO).rapids
    first = [
        (tuple(rapids.start[i, :3]), tuple(rapids.target[i, :3]))
        for i in range(len(rapids))
        if rapids.line[i] == line and rapids.reason[i] == CERTAIN
    ]
    ((_, seen),) = observations(io.BytesIO(data), find_dialect(dialect), AT_ZERO, [line])
    second = (tuple(seen.start[:3]), tuple(seen.end[:3])) if seen.sure else None
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
