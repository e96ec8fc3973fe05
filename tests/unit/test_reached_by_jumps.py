"""A stream in which the line above ends at rest, and that a jump leads to from a feed move."""

import io
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.errors import VerifyError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import Start, read_program
from gcodejerk.nc.flow import following
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import verify
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

HEAD = "G21 G90 G94 G17 G40 G49 G80 G54 G64\nG0 X0. Y0. Z50.\nG1 X30. F500.\n"
JUMPED = {
    "fanuc": HEAD + "IF [#500 EQ 1] GOTO 20\nG1 X5.\nG0 X30.\nN20 G0 X80.\nM30\n",
    "siemens": HEAD.replace("G21", "G710").replace("G49 G80 ", "")
    + "IF R500==1 GOTOF N20\nG1 X5.\nG0 X30.\nN20 G0 X80.\nM30\n",
}


def streams(text, dialect):
    """Streams of a program, each with what stands in front of its points."""
    machine = Machine.load(find_machine("vmc"))
    made = process(text.encode(), replace(machine, controller=dialect, dialect=dialect))
    assert made.verification.confirmed == made.planned
    lines = made.output.decode().splitlines()
    return [lines[k + 1] + lines[k + 2] for k, line in enumerate(lines) if "gcodejerk: " in line]


@pytest.mark.parametrize("dialect", JUMPED)
def test_a_stream_that_a_jump_leads_to_begins_at_a_standstill(dialect):
    stands = {"fanuc": "G4 P1", "siemens": "G4 F0.001"}[dialect]
    text = JUMPED[dialect]
    found = streams(text, dialect)
    assert len(found) == 2
    assert all(stands in line for line in found)
    straight = "\n".join(line for line in text.split("\n") if not line.startswith("IF"))
    assert [stands in line for line in streams(straight, dialect)] == [True, False]


CALLED = {
    "fanuc": HEAD + "G1 X5.\nG0 X30.\nG0 X31.\nM98 P2\nM30\nO2\nG0 X60.\nG0 X31.\nM99\n",
    "siemens": HEAD.replace("G21", "G710").replace("G49 G80 ", "")
    + "G1 X5.\nG0 X30.\nPART: G0 X80.\nG0 X30.\nREPEAT PART P=2\nM30\n",
}


@pytest.mark.parametrize("dialect", JUMPED)
def test_the_second_reading_knows_by_itself_where_jumps_lead(dialect):
    """Even where the first reading forgets that something leads there."""
    start = Start()
    for text in (JUMPED[dialect], CALLED[dialect]):
        rapids = read_program(io.BytesIO(text.encode()), dialect=dialect, start=start).rapids
        for forgets in (False, True):
            told = replace(rapids, entered=np.zeros_like(rapids.entered)) if forgets else rapids
            certain = np.flatnonzero(rapids.reason == 255)
            found = Findings(100)
            confirm(io.BytesIO(text.encode()), dialect, start, told, certain, found)
            wrong = forgets and text is JUMPED[dialect]
            assert [violation.original_line for violation in found.violations] == [7] * wrong
            assert all("standstill" in str(violation) for violation in found.violations)


@pytest.mark.parametrize("dialect", JUMPED)
def test_a_stream_that_lacks_the_standstill_is_refused(dialect, monkeypatch):
    machine = Machine.load(find_machine("vmc"))
    machine = replace(machine, controller=dialect, dialect=dialect)
    text = JUMPED[dialect].encode()
    whole = process(text, machine).output
    stands = b"G4 P1\n" if dialect == "fanuc" else b"G4 F0.001\n"
    at = whole.rindex(stands)
    short = whole[:at] + whole[at + len(stands) :]
    assert any(found.line is not None for found in verify(text, short, machine).violations)
    monkeypatch.setattr(following, "_entered", lambda script: frozenset())
    with pytest.raises(VerifyError, match="standstill"):
        process(text, machine)
