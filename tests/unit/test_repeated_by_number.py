"""Blocks that a program of Siemens repeats by their numbers: a stream is more than one block."""

import io
import re

import pytest

from gcodejerk.errors import VerifyError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import following_reader, read_program
from gcodejerk.reasons import CERTAIN
from gcodejerk.rewrite.pipeline import process

VMC = Machine.load(find_machine("vmc"))
PROGRAM = """G710 G90 G17 G40 G94 G54 G64 F100
G0 X0 Y0 Z10
G0 X50
N10 G0 X60
G0 X20
N20 G0 X50
{}
G1 Y1
M30
"""


@pytest.mark.parametrize(
    "line", ["REPEATB N10", "REPEATB N20 P=2", "REPEAT N10 N20", "REPEAT AAA N20", "repeat n10 P2"]
)
def test_nothing_is_rewritten_where_blocks_are_repeated_by_their_numbers(line, monkeypatch):
    data = PROGRAM.format(line).encode()
    program = read_program(io.BytesIO(data), dialect="siemens")
    assert (program.rapids.reason != CERTAIN).all()
    assert any("by their numbers" in finding.message for finding in program.findings)
    # The second reading says so by itself.
    monkeypatch.setattr(following_reader, "_BY_NUMBER", re.compile(rb"(?!)"))
    with pytest.raises(VerifyError, match="repeats blocks by their numbers"):
        process(data, VMC, controller="siemens", dialect="siemens")


@pytest.mark.parametrize("line", ["REPEAT AAA P=2", "REPEATB AAA P = 2", "; REPEATB N10"])
def test_labels_are_another_matter(line):
    program = read_program(io.BytesIO(PROGRAM.format(line).encode()), dialect="siemens")
    assert (program.rapids.reason == CERTAIN).any()
