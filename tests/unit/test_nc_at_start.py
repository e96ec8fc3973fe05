"""Codes that a control starts with, where a program is read as what several controls read alike."""

import io
import math
from dataclasses import replace

import pytest

from gcodejerk import Machine, find_machine, process
from gcodejerk.errors import ProgramError
from gcodejerk.nc import Start, find_dialect, read_program
from gcodejerk.nc.dialects.at_start import codes_at_start
from gcodejerk.reasons import CERTAIN

COMMON = ("rs274", "iso-mill", "any-mill")
TYPICAL = {
    "LinuxCNC": "G17 G21 G40 G49 G54 G64 P0.01 G80 G90 G91.1 G94 G97 G98",
    "grbl": "G0 G17 G21 G54 G90 G94 M5 M9",
    "Mach": "G0 G15 G17 G21 G40 G49 G50 G54 G64 G69 G80 G90 G91.1 G94 G97 G98",
    "Fanuc": "G0 G17 G21 G40 G49 G80 G90 G94 G97 G98",
}
PROGRAM = b"G0 X1. Y2.\nG1 Z-1. F100.\nG0 Z5.\nG0 X30. Y4.\nG1 Z-1.\nG0 Z5.\nM30\n"


def at_start(startup):
    """A control that starts so, at a known place."""
    place = dict.fromkeys("XYZ", 0.0)
    return Start(positions=place, startup=startup, spindle="mill", decimal_point="calculator")


@pytest.mark.parametrize("control", TYPICAL)
@pytest.mark.parametrize("dialect", COMMON)
def test_what_controls_usually_start_with_is_taken(dialect, control):
    start = at_start(TYPICAL[control])
    program = read_program(io.BytesIO(PROGRAM), dialect=dialect, start=start)
    assert (program.rapids.reason == CERTAIN).all()
    assert len(program.rapids) == 4


@pytest.mark.parametrize("control", TYPICAL)
@pytest.mark.parametrize("dialect", COMMON)
def test_both_readings_take_it_alike(dialect, control):
    machine = Machine.load(find_machine("vmc"))
    machine = replace(machine, program=replace(machine.program, startup=TYPICAL[control]))
    result = process(b"G0 X0. Y0. Z0.\n" + PROGRAM, machine, dialect=dialect, controller="csv")
    proof = result.verification
    assert proof.ok
    assert proof.rewritten == proof.confirmed == 4


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "mach", "syntec", "iso-mill", "auto"])
@pytest.mark.parametrize(("stated", "tolerance"), [(b"", 0.01), (b"G64\n", math.nan)])
def test_a_program_that_begins_again_keeps_the_tolerance_of_g64(dialect, stated, tolerance):
    machine = Machine.load(find_machine("vmc"))
    startup = "G17 G21 G40 G49 G54 G64 P0.01 G80 G90 G94"
    machine = replace(machine, program=replace(machine.program, startup=startup))
    program = b"%%\nO1234\n%sG0 X1. Y1. Z5.\nG1 Z1. F90.\nG0 Z6.\nX10.\nM99\n%%\n" % stated
    result = process(program, machine, dialect=dialect, controller="csv")
    assert result.verification.rewritten == result.verification.confirmed == 2
    assert result.program.rapids.path_p[-2:] == pytest.approx([tolerance] * 2, nan_ok=True)


def test_what_is_left_out_is_told():
    start = at_start(TYPICAL["LinuxCNC"])
    program = read_program(io.BytesIO(PROGRAM), dialect="any-mill", start=start)
    assert any(
        "of program.startup, G80 G91.1 G97 is left out" in finding.message
        for finding in program.findings
    )
    program = read_program(io.BytesIO(PROGRAM), dialect="linuxcnc", start=start)
    assert not any("program.startup" in finding.message for finding in program.findings)


@pytest.mark.parametrize("codes", ["G95", "G90.1"])
@pytest.mark.parametrize("dialect", ["rs274", "any-mill"])
def test_what_would_hold_something_else_is_refused(dialect, codes):
    with pytest.raises(ProgramError) as caught:
        read_program(io.BytesIO(PROGRAM), dialect=dialect, start=at_start(f"G21 G90 {codes}"))
    assert codes in str(caught.value)
    assert "state the dialect" in caught.value.remedy


def test_a_refusal_names_the_place_in_the_machine_file():
    text = find_machine("vmc").read_text() + "program:\n  startup: G21 G90 G95\n"
    line = text.splitlines().index("  startup: G21 G90 G95") + 1
    machine = Machine.loads(text, "mill.yaml")
    with pytest.raises(ProgramError) as caught:
        process(PROGRAM, machine, dialect="rs274")
    assert str(caught.value).startswith(f"mill.yaml:{line}:12: program.startup: ")


@pytest.mark.parametrize("dialect", ["linuxcnc", "grbl", "fanuc", "uccnc", "syntec"])
def test_codes_that_no_such_control_has_are_refused(dialect):
    startup = "G21 G77.7 G90 M377.5"
    with pytest.raises(ProgramError, match=f"{dialect} refuses G77.7, M377.5 of '{startup}'"):
        read_program(io.BytesIO(PROGRAM), dialect=dialect, start=at_start(startup))


def test_codes_that_cannot_stand_together_are_refused_as_a_whole():
    with pytest.raises(ProgramError, match="linuxcnc refuses 'G90 G91'"):
        read_program(io.BytesIO(PROGRAM), dialect="linuxcnc", start=at_start("G90 G91"))


@pytest.mark.parametrize(
    "dialect",
    ["centroid", "uccnc", "edingcnc", "planetcnc", "masso", "mitsubishi", "mazatrol-eia", "syntec"],
)
def test_controls_that_are_read_in_part_start_as_they_do(dialect):
    codes = "G0 G17 G21 G40 G49 G54 G80 G90 G94 G97"
    program = read_program(io.BytesIO(PROGRAM), dialect=dialect, start=at_start(codes))
    assert (program.rapids.reason == CERTAIN).sum() >= 2


def test_words_are_told_apart_by_what_they_say():
    any_mill = find_dialect("any-mill")
    assert codes_at_start("g080G21 G1.0G90", any_mill) == ("G21 G1.0 G90", "G080")
    assert codes_at_start("G80 G21", find_dialect("haas")) == ("G80 G21", "")
