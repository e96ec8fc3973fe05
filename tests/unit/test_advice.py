"""What the operator is told: in the stamp, by `process`, in the report and on the page."""

import re
from pathlib import Path

import pytest

from gcodejerk.advice import (
    ABSOLUTE,
    MEASURED,
    NO_MODES,
    PAGE,
    STAMP_NOTES,
    UNTESTED,
    at_the_machine,
)
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import DIALECTS
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import verify

ROOT = Path(__file__).parents[2]
VMC = Machine.load(find_machine("vmc"))
PROGRAM = b"G21 G90 G94 G17 G64 P0.01\nG0 Z0\nG0 Z12.5\nG1 Z12 F200\nM2\n"
CONTROLS = ("linuxcnc", "fanuc", "haas", "siemens", "grbl", "mach", "marlin", "klipper")


@pytest.mark.parametrize("control", CONTROLS)
def test_the_first_note_says_which_override_acts_and_what_was_measured(control):
    result = process(PROGRAM, VMC, controller=control)
    assert result.notes[0] == at_the_machine(control)
    assert "rapid override does nothing" in result.notes[0]
    assert "feed override does" in result.notes[0]
    assert PAGE in result.notes[0]
    measured = "not measured" not in result.notes[0]
    assert measured == (control == "linuxcnc")
    assert ABSOLUTE in result.notes


@pytest.mark.parametrize("control", CONTROLS)
def test_a_line_below_the_stamp_says_it_in_the_program(control):
    lines = process(PROGRAM, VMC, controller=control).output.decode().splitlines()
    assert lines[0].startswith("(gcodejerk stamp ")
    assert lines[1] == f"({MEASURED if control == 'linuxcnc' else UNTESTED})"
    assert all(len(line) < 70 for line in lines[:2])


def test_the_line_fits_every_dialects_comments():
    for dialect in DIALECTS.values():
        if dialect.writing is None:
            continue
        opens, closes = dialect.writing.comment
        for note in STAMP_NOTES:
            assert len(opens) + len(note) + len(closes) < 70
            assert not set(note) & set("()%;")


def test_a_table_of_streams_has_no_override():
    result = process(PROGRAM, VMC, controller="csv")
    assert not any("override" in note for note in result.notes)


def test_verify_takes_exactly_that_line_once():
    output = process(PROGRAM, VMC).output
    first, note, rest = output.split(b"\n", 2)
    # Without the sum, so that nothing but the line itself can be wrong.
    first = re.sub(rb" sum:[0-9a-f]+", b"", first)
    for head, good in (
        ([first, note], True),
        ([first, f"({UNTESTED})".encode()], True),
        ([first], True),
        ([first, note, note], False),
        ([note, first], False),
        ([note], False),
        ([first, note.replace(b"nothing", b"a lot")], False),
        ([first, note + b" "], False),
        ([first, b"(hello)"], False),
    ):
        changed = b"\n".join([*head, rest])
        assert verify(PROGRAM, changed, VMC).ok == good, head


def test_the_page_says_what_was_measured_of_every_controller_and_is_linked():
    page = (ROOT / PAGE).read_text(encoding="utf-8")
    for control in CONTROLS:
        assert control in page.lower()
    for matter in ("rapid override", "above 100 %", "feed hold", "single block", "restart"):
        assert matter in page.lower()
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"]({PAGE})" in readme
    assert "rapid override first" not in readme
    assert "rapid override does nothing" in readme.split("## What it does")[0]


def test_a_machine_without_modes_gains_nothing_and_says_so():
    text = "interval: 0.001\npositioning: linear\naxes:\n  Z:\n    limit: {jerk: 5.0e+6}\n"
    bare = Machine.loads(text + "    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}\n")
    result = process(PROGRAM, bare)
    assert result.output == PROGRAM
    assert result.planned == 0
    assert REASONS[result.plans.reason[1]] is Reason.NO_MODE
    assert NO_MODES in result.notes
    # Time can be gained without modes, and the control's own profile is a wish.
    assert process(PROGRAM, bare, profile="conventional").planned == 1
    assert process(PROGRAM, bare, profile="shortest").planned == 1


@pytest.mark.parametrize("axis", ["A", "B", "C", "U", "V", "W"])
def test_axes_that_linuxcnc_does_not_blend_are_left_alone_there_only(axis):
    text = VMC_WITH.replace("AXIS", axis)
    program = PROGRAM.replace(b"G0 Z0\n", f"G0 Z0 {axis}0\n".encode())
    program = program.replace(b"G1 Z12", f"G0 {axis}20\nG1 Z12".encode())
    machine = Machine.loads(text)
    result = process(program, machine)
    line = result.program.rapids.line.tolist()
    assert result.plans.planned[line.index(3)]
    assert REASONS[result.plans.reason[line.index(4)]] is Reason.NO_BLENDING
    # which way it turns matters where the rapid is rewritten
    if axis in "ABC":
        machine = Machine.loads(text.replace(f"  {axis}:", f"  {axis}:\n    wrap: none"))
    for other in ("csv", "fanuc"):
        assert process(program, machine, controller=other).plans.planned[line.index(4)]


VMC_WITH = """interval: 0.001
positioning: linear
controller: linuxcnc
axes:
  Z:
    rapid: {velocity: 600, acceleration: 5000}
    limit: {acceleration: 6000, jerk: 5.0e+6}
    modes: [{frequency: 30, damping: 0.02}]
  AXIS:
    rapid: {velocity: 600, acceleration: 5000}
    limit: {acceleration: 6000, jerk: 5.0e+6}
    modes: [{frequency: 40, damping: 0.02, participation: 1}]
"""


def test_linuxcnc_is_told_what_its_ini_file_has_to_allow():
    (note,) = [note for note in process(PROGRAM, VMC).notes if "MAX_ACCELERATION of" in note]
    assert "Z from 5000 to 6300" in note
    enough = Machine.loads(VMC_WITH.replace("  AXIS", "  X").replace("6000", "4700"))
    assert not any("MAX_ACCELERATION of" in note for note in process(PROGRAM, enough).notes)
