"""Independent positioning: every axis is held to its own start, arrival and profile."""

import re
from dataclasses import replace

import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import Kind, verify

CENTRE = Machine.load(find_machine("centre"))
MACHINE = replace(
    CENTRE,
    controller="mach",
    dialect="linuxcnc",
    positioning="independent",
    axes=tuple(replace(a, travel=None) for a in CENTRE.axes),
)
PROGRAM = b"G21 G90 G94 G64\nF600\nG0 X0 Y0 Z0\nG0 X150. Y20. Z6.\nM2\n"
POINT = re.compile(rb"G1 X(\S+) Y(\S+) Z(\S+) F\S+")


def shifted(output, axis, blocks):
    """A stream in which one axis is late by so many blocks, or early; F as it should then be."""
    lines = output.replace(re.search(rb" sum:\w{16}", output)[0], b"").split(b"\n")
    rows = [k for k, line in enumerate(lines) if POINT.fullmatch(line)]
    values = [[float(x) for x in POINT.fullmatch(lines[k]).groups()] for k in rows]
    column = "XYZ".index(axis)
    own = [0.0] * max(blocks, 0) + [v[column] for v in values][max(-blocks, 0) :]
    own += [own[-1]] * len(values)
    for place, k in enumerate(rows[:-1]):
        old = re.search(rb"%s\S+" % axis.encode(), lines[k])[0]
        lines[k] = lines[k].replace(old, b"%s%.4f" % (axis.encode(), own[place]))
    return b"\n".join(lines)


@pytest.mark.parametrize("profile", ["condition3", "conventional", "cascade", "shortest"])
def test_what_is_written_is_accepted(profile):
    made = process(PROGRAM, MACHINE, profile=profile)
    assert made.planned == 1
    assert verify(
        PROGRAM,
        shifted(made.output, "Z", 0),
        replace(MACHINE, design=replace(MACHINE.design, profile=profile)),
    ).ok


@pytest.mark.parametrize("axis", ["Y", "Z"])
@pytest.mark.parametrize("blocks", [38, 10, 5, -1])
def test_an_axis_that_is_late_or_early_takes_another_path(axis, blocks):
    output = process(PROGRAM, MACHINE).output
    found = verify(PROGRAM, shifted(output, axis, blocks), MACHINE)
    assert not found.ok
    if blocks > 0:
        assert Kind.TIME in {v.kind for v in found.violations}, found.violations


@pytest.mark.parametrize("end", [0.6, 0.604, -0.2549, 1.2049])
def test_what_an_end_between_two_steps_leaves_for_the_last_block_is_no_delay(end):
    axes = tuple(replace(a, resolution=0.01 if a.name == "Z" else 0.001) for a in MACHINE.axes)
    coarse = replace(MACHINE, axes=axes)
    program = PROGRAM.replace(b"X150. Y20. Z6.", b"X800. Y20. Z%g" % end)
    made = process(program, coarse, verify=False, profile="conventional")
    assert made.planned == 1
    assert verify(program, made.output, coarse).violations == ()
