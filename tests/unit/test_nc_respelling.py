"""Plain lines of Klartext that are read at once are read as one by one, whatever stands around."""

import io

import pytest
from hypothesis import given, note, settings
from hypothesis import strategies as st

from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.text.respelling import ODD, respelled
from gcodejerk.testing.programs import differences

START = Start(spindle="mill")
HEAD = [b"0 BEGIN PGM PART MM", b"1 L X+0 Y+0 Z+50 R0 F900"]
RUN = [b"%d L X+%d Y-%d.5 FMAX" % (k, k, k) for k in range(2, 28)]
ODD_LINES = (
    *(b"L", b"L ", b"5 L", b"L FMAX", b"L R0", b"L F500", b"L F0 X+1", b"L M30", b"L X+1 M8"),
    *(b"LX+1", b"L X+1 F300 FMAX", b"L X+1 FMAX F300", b"L X+1 FMAX FMAX", b"L X+1 R0 R0"),
    *(b"L X+1 RL FMAX", b"L X+1 RR", b"L X+1 R0", b"L X+1 R05", b"L X+1 R", b"L X+1 FMAXX+2"),
    *(b"L X+1 FMAX5", b"L FMAX X+1", b"L X+1Y+2", b"L X+1 Y+2FMAX", b"L X +1", b"L X+ 1"),
    *(b"L X+1 X+2", b"L IX+1", b"L X+Q1", b"L X1,5", b"L X+1.", b"L X+.5", b"L X-,5"),
    *(b"L X--1", b"L X+1.2.3", b"L X+1 F+5", b"L X+1 FAUTO", b"L X+1 F MAX", b"l x+1 fmax"),
    *(b"L x+1", b"L\tX+1\tFMAX", b" 12  L   X+1  ", b"12L X+1", b"1 2 L X+1", b"/ L X+1"),
    *(b"5 / L X+1", b"/5 L X+1", b"5L", b"N5 L X+1", b"G1 X5", b"L G1 X5", b"L X+1 N5"),
    *(b"L X+1 S5", b"L S5", b"L X+1 ;FMAX", b"L X+1 ; R0 FMAX L X+2", b"L X+1 FMAX;x"),
    *(b"L X+1 ~", b"L X+1 ;~", b";L X+1", b"5 ;L X+1", b"* - L X+1", b"5", b"", b" ", b"?"),
    *(b"?L X+1", b"LBL 1", b"CALL LBL 1", b"CC X+1 Y+2", b"C X+1 Y+2 DR+", b"L A+90"),
    *(b"L C-720.5 FMAX", b"L X+1 A+5 FMAX", b"L U+1", b"L E5", b"L X+1 E5", b"L X+1 I5"),
    *(b"TOOL CALL 5 Z", b"L X+123456789 FMAX", b"L X+12345678901234567890"),
    *(b"L X+0.12345678901234567", b"L X+1\r", b"\r", b"L X+1 \r", b"123456789012 L X+1"),
    *(b"12345678 L X+1", b"L X+1 \xfcL", b"L  Y", b"END PGM PART MM", b"L X+1" + b" " * 300),
    *(b"L LX+1", b"L L X+1", b"L X+1 L", b"X+5 FMAX", b"L X+1 M99", b"L X+1 FMAX M91"),
    *(b"L M140 MB MAX", b"M30"),
)  # fmt: skip


def lines(*said, newline=b"\n"):
    """A program of lines."""
    return newline.join([*HEAD, *RUN, *said, *RUN, *RUN]) + newline


@pytest.mark.parametrize("odd", ODD_LINES)
def test_an_odd_line_in_a_run_is_read_as_by_itself(odd):
    newline = b"\r\n" if len(odd) % 3 == 1 else b"\n"
    data = lines(odd, newline=newline) + odd
    assert differences(data, START, "klartext") == []
    assert differences(lines(b"L IX+1 RL", odd, newline=newline), START, "klartext") == []


PIECES = st.sampled_from(
    [
        *(
            b"L",
            b"L ",
            b"X+1",
            b" X+1",
            b"  Y-2.5",
            b" Z+",
            b"5",
            b" FMAX",
            b"FMAX",
            b" F90",
            b" R0",
        ),
        *(
            b" RL",
            b"12 ",
            b" ",
            b"\t",
            b";",
            b"~",
            b"/",
            b"I",
            b" IX+1",
            b" M8",
            b" M",
            b",5",
            b"Q1",
        ),
        *(
            b" Q1 = 5",
            b"C",
            b"BL",
            b"*",
            b"\r",
            b" A+5",
            b"+",
            b".",
            b"N",
            b"G",
            b"0",
            b"R0",
            b" MAX",
        ),
    ]
)
MESSY = st.lists(st.lists(PIECES, max_size=7).map(b"".join), min_size=1, max_size=9)


@settings(max_examples=120)
@given(MESSY)
def test_messy_lines_are_read_as_by_themselves(said):
    data = lines(*said)
    note(repr(said))
    assert differences(data, START, "klartext") == []


@given(st.lists(st.binary(max_size=12), max_size=6))
def test_every_byte_keeps_its_place(said):
    data = b"\n".join([*RUN[:2], *said])
    spelled = respelled(data)
    assert len(spelled) == len(data)
    assert [c == 10 for c in spelled] == [c == 10 for c in data]
    for line, new in zip(data.split(b"\n"), spelled.split(b"\n"), strict=True):
        assert (
            new[:1] in (bytes([ODD]), b"", b"\r")
            or line.split(b";")[0].split()[0].isdigit()
            or line.strip()[:1] == b"L"
        )


def test_a_program_of_plain_lines_is_read_as_it_says():
    data = lines(b"L Z-5.25 F90", b"L Y+1 FMAX", b"L F10")
    rapids = read_program(io.BytesIO(data), dialect="klartext", start=START).rapids
    assert len(rapids) == 3 * len(RUN) + 1
    assert (rapids.reason[: len(RUN)] == CERTAIN).all()
    at = len(RUN)
    assert rapids.line[at] == len(HEAD) + len(RUN) + 2
    assert rapids.start[at][:3].tolist() == [27.0, -27.5, -5.25]
    assert rapids.target[at][:3].tolist() == [27.0, 1.0, -5.25]
    assert rapids.feed[at] == 90.0
