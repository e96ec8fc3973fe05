"""LinuxCNC itself plays cycles and what is written in their place: the same holes, as deep."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "linuxcnc"))
from playing import run_or_skip  # noqa: E402

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.playback,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC (linuxcnc-uspace) is absent"
    ),
]

ACCELERATION = 5250
"""LinuxCNC's MAX_ACCELERATION [mm/s^2], 1.05 times the profile's limit."""
SAME = 0.004
"""Between two samples of the servo period LinuxCNC may turn this much further [mm]."""
HOLES = {10: -4.0, 20: -4.0, 30: -3.0, 40: -2.5}
CYCLES = b"""\
G0 X0 Y0 Z10
G98 G83 X10 Y5 Z-4 R2 Q2
G99 X20
G85 X30 Z-3 R2
G82 X40 Z-2.5 R2 P.1
G80
G0 Z10
G4 P0.2
M2
"""


def played(program, folder):
    """Rows of t, X, Y, Z as LinuxCNC moved, one for each servo period."""
    path = folder / "played.ngc"
    path.write_bytes(program)
    run = run_or_skip(path, acceleration=ACCELERATION, velocity=1000, timeout=90)
    return np.array([row[:4] for row in run.rows])


def turns(rows, x):
    """Heights at which the tool turned over a hole."""
    heights = rows[np.abs(rows[:, 1] - x) < 0.005, 3]
    found, peak, way = [heights[0]], heights[0], 0
    for height in heights:
        if (height - peak) * way >= 0.0 and height != peak:
            way, peak = way or int(np.sign(height - peak)), height
        elif abs(height - peak) > 0.1:
            found.append(peak)
            way, peak = int(np.sign(height - peak)), height
    return np.array([*found, heights[-1]])


@pytest.mark.parametrize("path_mode", [b"G64 P0.05 ", b""], ids=["known", "unknown"])
def test_holes_are_as_deep_and_ways_as_high_as_in_the_controllers_own_cycles(path_mode, tmp_path):
    program = b"G21 G90 G94 " + path_mode + b"F600\n" + CYCLES
    result = process(program, Machine.load(find_machine("vmc")), expand_cycles=True)
    assert result.planned >= 17
    before, after = (played(data, tmp_path) for data in (program, result.output))
    for x, bottom in HOLES.items():
        mine, theirs = turns(after, x), turns(before, x)
        assert len(mine) == len(theirs), (x, mine, theirs)
        assert np.abs(mine - theirs).max() < SAME, (x, mine, theirs)
        assert mine.min() == pytest.approx(bottom, abs=SAME)
    between = np.abs(after[:, 1:2] - np.array([*HOLES, 0])).min(axis=1) > 0.01
    assert after[between, 3].min() > 2.0 - SAME
