"""Whole programs with their whole output, compared as bytes.

A case is a folder with `in.ngc`, `machine.yaml` and `out.ngc` (`out.csv` where the machine's
controller is `csv`; and `out.ngc.streams` where it writes a file beside); a new folder is a new
test, one whose name begins with `cycles_` writes drilling cycles out, one with `settings_` sets the
control. `pytest --update-golden`
writes the outputs anew.
The intervals are long, so that a move is a dozen points that a reader can follow by eye.
"""

import re
from pathlib import Path

import pytest

from gcodejerk import Machine, ProgramError, process
from tests.unit.test_alike import hold_golden

HERE = Path(__file__).parent
CASES = sorted(path.parent.name for path in HERE.glob("*/in.ngc"))


def form_of(case):
    """The form that a case is written in."""
    if case.startswith("settings_"):
        return "parameters"
    return "position" if case == "hal_position" else "stream"


def made(case):
    """The machine, the program and what becomes of it."""
    machine = Machine.load(HERE / case / "machine.yaml")
    program = (HERE / case / "in.ngc").read_bytes()
    return (
        machine,
        program,
        process(
            program,
            machine,
            form=form_of(case),
            name=f"{case}/in.ngc",
            expand_cycles=case.startswith("cycles_"),
            unroll=case.startswith("unroll_"),
        ),
    )


@pytest.mark.parametrize("case", CASES)
def test_output_is_the_golden_one(case, request):
    machine, _, result = made(case)
    golden = HERE / case / ("out.csv" if machine.controller == "csv" else "out.ngc")
    hold_golden(result.output, golden, request)
    assert result.verification.ok
    if result.beside is not None:
        hold_golden(result.beside, HERE / case / "out.ngc.streams", request)


# A case whose rapids are all left alone has no stamp, and a table is no program.
STAMPED = [
    case
    for case in CASES
    if (HERE / case / "out.ngc").exists()
    and b"gcodejerk stamp" in (HERE / case / "out.ngc").read_bytes()
]


def test_most_cases_carry_a_stamp():
    assert len(STAMPED) >= 8


@pytest.mark.parametrize("case", STAMPED)
def test_golden_outputs_are_not_processed_again(case):
    golden = HERE / case / "out.ngc"
    machine = Machine.load(HERE / case / "machine.yaml")
    with pytest.raises(ProgramError, match="processed by gcodejerk before"):
        process(golden.read_bytes(), machine, form=form_of(case))


@pytest.mark.parametrize("case", CASES)
def test_golden_programs_say_what_they_are_about(case):
    program = (HERE / case / "in.ngc").read_bytes()
    said = rb"(%\S*\r?\n)?(O\d+ ?|;\$.*\n)?(\([^)]{10,}\)|; .{10,})"
    assert re.match(said, program), "begin in.ngc with a comment that says so"


def test_there_are_cases():
    assert len(CASES) >= 10
