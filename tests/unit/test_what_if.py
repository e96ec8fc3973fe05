"""What the notes say of entries of the machine file that would help."""

import io

import pytest

from gcodejerk import Machine, process
from gcodejerk.nc import Start, read_program
from gcodejerk.rewrite.what_if import BEGINNING, LONGEST, MOST_STEPS, entry_notes

MACHINE = """
interval: 0.001
positioning: linear
controller: {controller}
axes:
  X: &axis
    rapid: {{velocity: 500, acceleration: 3000, jerk: 100000}}
    modes: [{{name: bed, frequency: 30, damping: 0.02, participation: 1.0}}]
  Y: *axis
  Z: *axis
{more}
"""


def note(text, controller, more=""):
    """The note of a whole run, and how many rapids were certain."""
    result = process(text, Machine.loads(MACHINE.format(controller=controller, more=more)))
    said = [n for n in result.notes if n.startswith("stated in the machine file")]
    assert len(said) <= 1
    return (said[0] if said else ""), result.planned


@pytest.mark.parametrize(
    ("text", "controller", "entry", "more"),
    [
        (
            b"G0 X1 Y1\nX30 Y20\nX60\nM2\n",
            "linuxcnc",
            "program.startup",
            'program: {startup: "G21"}',
        ),
        (
            b"G21 G90\nG0 X30 Y20\nM2\n",
            "linuxcnc",
            "program.start",
            "program: {start: {X: 0, Y: 0}}",
        ),
        (b"G21 G90\nM3\nG0 X1 Y1\nX30 Y20\nX60\nM2\n", "grbl", "spindle: mill", "spindle: mill"),
        (
            b"G21 G90 G17 G94 G40\nG0 X1 Y1\nX30 Y20\nM6 T1\nG0 X60\nM30\n",
            "linuxcnc",
            "program.tool_change",
            "program: {tool_change: {}}",
        ),
        (
            b"G21 G90 G17 G94 G40\nG0 X1. Y1.\nX30. Y20. M8\nM30\n",
            "haas",
            "program.m_before and program.m_after",
            "program: {m_before: [M8]}",
        ),
    ],
)
def test_an_entry_does_what_the_note_says(text, controller, entry, more):
    said, before = note(text, controller)
    assert entry in said
    _, after = note(text, controller, more)
    assert after > before
    if said.count(",") == 1:
        assert f"make {after - before} more" in said


def test_entries_that_only_help_together_are_named_together():
    text = b"G28\nM6 T1\nG55\nG0 X1. Y2.\nM30\n"
    said, _ = note(text, "haas", 'program: {startup: "G21 G90 G17 G94 G40"}')
    for entry in ("program.offsets of G54 and G55", "program.home", "program.tool_change"):
        assert entry in said
    assert "1 more rapid certain" in said
    assert "startup" not in said
    assert "decimal_point" not in said


def test_nothing_is_said_where_nothing_helps():
    text = b"G21 G90 G17 G94 G40\nG0 X0 Y0 Z0\n/G0 X30\nG53 G0 Z0\nM2\n"
    assert note(text, "linuxcnc", "program: {start: {X: 0, Y: 0, Z: 0}}")[0] == ""


LINES = b"G0 X1 Y1\nX2\nG1 Z-1 F100\n"


@pytest.mark.parametrize(
    ("first", "lines"),
    [
        # Much is written, or much is run line by line: what M6 does to modes nobody knows.
        (b"G21\n", LINES * (LONGEST // len(LINES) + 1)),
        (b"T1 M6\nG21\n", LINES * MOST_STEPS),
    ],
)
def test_of_long_programs_the_beginning_is_read(first, lines):
    def notes(text):
        program = read_program(io.BytesIO(text), dialect="fanuc")
        return program, entry_notes(io.BytesIO(text), program, Start())

    text = first + lines
    program, (said,) = notes(text)
    assert program.size > LONGEST or program.steps > MOST_STEPS
    beginning = b"\n".join(text.split(b"\n")[:BEGINNING]) + b"\n"
    short, (alone,) = notes(beginning)
    assert max(short.size / LONGEST, short.steps / MOST_STEPS) <= 1
    assert said == alone.replace("more rapids", "more rapids of the first 1000 lines", 1)
    assert 600 < int(said.split("would make ")[1].split()[0]) < 700


def test_programs_with_long_loops_are_not_read_again():
    text = b"#1=0\no1 while [#1 LT 3000]\n#1=[#1+1]\no1 endwhile\nG90 G21\nG0 X1 Y1\nX2\nM2\n"
    source = io.BytesIO(text)
    program = read_program(source, dialect="linuxcnc")
    assert program.steps > MOST_STEPS
    assert entry_notes(source, program, Start()) == []
