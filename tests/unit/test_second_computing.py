"""What lines set and compute, by the second reading: variables of Siemens, declared or not."""

import io
import math

import numpy as np
import pytest

from gcodejerk.nc import CERTAIN, DIALECTS, Start, read_program
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading import agreement
from gcodejerk.verification.second_reading.computing import Computer

KNOWN = {"R1": 5.0, "DEPTH": 1.5}
HEAD = "G710 G90 G94 G17 G40 G64\nG0 X0 Y0 Z0\nG1 X1 F100\n"


@pytest.fixture
def computer():
    computer = Computer(DIALECTS["siemens"].set_up(Start()))
    computer.settings(b"DEF REAL DEPTH, WIDTH", {})
    return computer


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (b"DEF REAL LONG=5, HIGH , WIDE = -2.5", {"LONG": 5.0, "HIGH": 0.0, "WIDE": -2.5}),
        (b"DEF INT COUNT=2.6, OTHER", {"COUNT": 3.0, "OTHER": 0.0}),
        (b"DEF BOOL GOES=3, STAYS", {"GOES": 1.0, "STAYS": 0.0}),
        (b"DEF REAL LONG=R9", {"LONG": math.nan}),
        (b"R2=R1*2 DEPTH=R1+1", {"R2": 10.0, "DEPTH": 6.0}),
        (b"R02=4", {"R2": 4.0}),
        (b"R2=1 R2=4", {"R2": math.nan}),
        (b"RAD=5", {}),  # none was declared
        (b"X1=5", {}),
        (b"R=5", {}),
    ],
)
def test_what_a_line_sets(computer, line, wanted):
    assert computer.settings(line, KNOWN) == pytest.approx(wanted, nan_ok=True)


@pytest.mark.parametrize(
    ("line", "wanted"),
    [
        (b"G0 R3=6 X=R1", b"G0 X5.000"),
        (b"R3=R1*2+1 G0 X=R1", b"G0 X5.000"),
        (b"G0 X=R1 DEPTH=7", b"G0 X5.000"),
        (b"G0 X=DEPTH DEPTH=7", b"G0 X#"),  # the control says when it is set
        (b"G0 X=RAD Y=R1", b"G0 X# Y5.000"),
        (b"G0 X=IC(R1) Y=R1+DEPTH", b"G0 X5.000 Y6.500"),
        (b"G0 X=DEPTH(2)", b"G0 X=DEPTH(2)"),
        (b"G0 X1=5 X=R1", b"G0 X1=5 X5.000"),
        (b"G0 RAD=5 X=R1", b"G0 RAD= 5 X5.000"),
    ],
)
def test_what_a_line_is_with_its_numbers(computer, line, wanted):
    text, relative = computer.spelled(line, KNOWN, inch=False)
    assert text.split() == wanted.split()
    assert relative == ({"X": "IC"} if b"IC" in line else {})


@pytest.mark.parametrize(
    ("body", "ends"),
    [
        ("DEF REAL DEPTH=5, WIDTH=7.5\nG0 X=DEPTH Y=WIDTH", [(5.0, 7.5, 0.0)]),
        ("DEF REAL AA, BB=2, CC\nAA=3\nCC=BB*2\nG0 X=AA\nG0 Z=CC", [(3, 0, 0), (3, 0, 4)]),
        ("DEF REAL LIST[3]\nLIST[0]=5\nLIST[2]=LIST[0]+1\nG0 X=LIST[2] Y=LIST[0]", [(6, 5, 0)]),
        ("R[1]=5\nG0 X=R1\nG0 X=R[1]+1", [(5, 0, 0), (6, 0, 0)]),
        ("DEF BOOL ON1=TRUE, OFF1\nOFF1=NOT ON1\nG0 X=ON1*5 Y=OFF1+2", [(5, 2, 0)]),
        ("DEF INT NUM=2.6\nNUM=NUM+0.5\nG0 X=NUM Y=-NUM", [(4, -4, 0)]),
    ],
)
def test_both_readings_follow_declared_variables(body, ends):
    source = f"{HEAD}{body}\nM30\n".encode()
    rapids = read_program(io.BytesIO(source), dialect="siemens").rapids
    index = np.flatnonzero(rapids.reason == CERTAIN)
    assert rapids.target[index, :3].tolist() == [list(end) for end in ends]
    found = Findings(100)
    confirmed = agreement.confirm(io.BytesIO(source), "siemens", Start(), rapids, index, found)
    assert (confirmed, found.violations) == (len(ends), [])
