"""Drawn programs before and after, run by firmwares' own interpreters: the same ends, feeds, modes.

`firmware.py` says which checkouts this needs; what is drawn is that of `test_firmware_reading`.
"""

from dataclasses import replace

import numpy as np
import pytest
from firmware import run_fluidnc, run_grbl, run_grblhal, run_klipper, run_marlin
from hypothesis import given, settings
from hypothesis import strategies as st
from test_firmware_reading import GRBL, KLIPPER, MARLIN

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process

MANY = settings(max_examples=300)
NEAR = 1e-2
"""Of positions, which firmwares add up in 24 bits, in inches too. [mm]"""
VMC = Machine.load(find_machine("vmc"))
FREE = replace(VMC, axes=tuple(replace(axis, travel=None) for axis in VMC.axes))


def written_from(lines, controller, startup=""):
    """What becomes of a program that starts at zero; the stream of each line of the output."""
    program = replace(
        FREE.program, start=dict.fromkeys("XYZ", 0.0), decimal_point="calculator", startup=startup
    )
    data = "".join(f"{line}\n" for line in lines).encode("latin-1")
    machine = replace(FREE, program=program, dialect=controller)
    result = process(data, machine, controller=controller, dialect=controller)
    out = result.output.decode("latin-1").splitlines()
    ends = np.cumsum([len(text) + 1 for text in out])
    own = np.full(len(out), -2)  # -1 is the stamp
    for begin, end, row in result.edits.tolist():
        own[np.searchsorted(ends, begin, "right") : np.searchsorted(ends, end, "left") + 1] = row
    return out, own, result.program.rapids.line.tolist()


def changed(lines, controller, run, startup=""):
    """What the firmware does otherwise with the output than with the program."""
    out, own, rapids = written_from(lines, controller, startup)
    if out == list(lines):
        return []
    before, after = run(lines), run(out)
    wrong, source = [], 0
    for k, row in enumerate(own.tolist()):
        last = k + 1 == len(own) or own[k + 1] != row
        if row >= 0 and after[k].refused:
            wrong.append(f"{out[k]!r} of a stream is refused")
        if row == -1 or (row >= 0 and not last):
            continue
        # A line that was kept, or the last one of a stream: what the block did is done.
        source = source + 1 if row < 0 else rapids[row]
        old, new, what = before[source - 1], after[k], f"line {source} {lines[source - 1]!r}"
        ends = [abs(old.end[axis] - new.end[axis]) for axis in "XYZ"]
        ends += [abs(old.offset[axis] - new.offset[axis]) for axis in "XYZ"]
        if max(ends) > NEAR:
            wrong.append(f"{what} ends at {new.end}, not {old.end}")
        if (old.incremental, old.inch) != (new.incremental, new.inch):
            wrong.append(f"{what}: another mode")
        if row >= 0:
            continue
        # A G1 that leads nowhere is refused until somebody has said F, which streams do.
        same = old.refused == new.refused or (old.refused and not old.feed)
        if not same or (old.motions, old.rapids) != (new.motions, new.rapids):
            wrong.append(f"{what}: {new}, not {old}")
        # Before a program says F, and at a rapid of grbl, no F counts.
        counts = old.motions and old.rapids != old.motions and old.feed > 0.0
        if counts and abs(old.feed - new.feed) > 1e-4 * old.feed:
            wrong.append(f"{what}: F is {new.feed:g}, not {old.feed:g}")
    return wrong


@pytest.mark.parametrize("run", [run_grbl, run_grblhal, run_fluidnc])
@MANY
@given(GRBL)
def test_streams_for_grbl_do_what_their_rapids_did(run, lines):
    assert not changed(lines, "grbl", run, "G21")


@MANY
@given(KLIPPER, st.booleans())
def test_streams_for_klipper_do_what_their_rapids_did(lines, arcs):
    assert not changed(lines, "klipper", lambda program: run_klipper(program, arcs))


@pytest.mark.parametrize("extras", [False, True])
@MANY
@given(MARLIN, st.sampled_from(["file", "bare", "sent"]))
def test_streams_for_marlin_do_what_their_rapids_did(extras, lines, way):
    assert not changed(lines, "marlin", lambda program: run_marlin(program, extras, way))


def test_a_feed_that_is_lost_behind_a_stream_is_found():
    lines = ["G90", "G0 F3000 X7 Y2 Z5", "G1 X8 F600", "G0 X1", "G1 X2"]

    def forgetful(program):
        return run_klipper([";" if line == "G0 F600.0" else line for line in program], arcs=False)

    assert any("F is 135" in said for said in changed(lines, "klipper", forgetful))
