"""LinuxCNC itself plays our output: what the drives get is what was planned and reported.

LinuxCNC runs here without a real-time kernel, so that single blocks may come late; each program is
therefore played up to three times, and a rapid counts as played well if it once was.
"""

import numpy as np
import pytest
from playing import MARKS, MIXED, in_inches, mill, rapids, record, settings_of, streams

from gcodejerk.machine import Machine, find_machine
from gcodejerk.rewrite.pipeline import process

pytestmark = MARKS

DEVIATION = 0.02
"""How far a stream may be off its profile. [mm]"""
QUEUED, DRAINED = 15, 30
"""What a stream may take more than T_SUM, and behind a queue that was drained. [ms]"""
OF_PLAN, OF_TODAY = 0.10, 0.03
"""Shares of the plan's and of today's residual that what is played may differ by."""
NO_GUARD = "design: {guard: 0}\n"
"""For optimal profiles in seconds."""


def machine_of(name, period):
    """A machine at some servo period."""
    if name == "mill":
        return Machine.loads(mill(period, NO_GUARD), name)
    text = find_machine(name).read_text()
    return Machine.loads(text.replace("interval: 0.001", f"interval: {period:g}"), name)


def worth(result, played, period):
    """How far each rapid is from what it has to be, 1 the most that is allowed."""
    row, ms = played.row, 1e3 * period
    tolerance = np.maximum(
        OF_PLAN * result.residual[row], OF_TODAY * result.conventional_residual[row]
    )
    off = np.abs(played.residual - result.residual[row])
    felt = tolerance > 0.0
    most = QUEUED if result.program.rapids.queued[row] else DRAINED
    return max(
        float((off[felt] / tolerance[felt]).max(initial=0.0)),
        played.deviation / DEVIATION,
        played.taken * ms / most,
    )


@pytest.mark.parametrize(
    ("name", "profile", "factor", "period"),
    [
        ("mill", "condition3", 1.05, 0.001),
        ("mill", "cascade", 4.0, 0.001),
        ("mill", "optimal", 2.0, 0.001),
        ("mill", "condition3", 1.5, 0.0005),
        ("vmc", "condition3", 1.05, 0.001),
        ("router", "condition3", 1.05, 0.001),
    ],
)
def test_what_is_played_is_what_was_reported(name, profile, factor, period, tmp_path):
    machine = machine_of(name, period)
    result = process(MIXED.encode(), machine, controller="linuxcnc", profile=profile)
    assert result.planned >= 14
    best = {}
    for _ in range(3):
        rows = record(result.output, tmp_path, settings_of(machine, factor), period)
        for played in streams(result, rows, period):
            now = worth(result, played, period)
            best[played.row] = min(best.get(played.row, np.inf), now)
        if max(best.values()) <= 1.0:
            break
    lines = result.program.rapids.line
    assert len(best) == result.planned
    assert max(best.values()) <= 1.0, {int(lines[row]): value for row, value in best.items()}


INCHES = b"""G20 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G4 P0.2
G1 X2 F150
G0 Z0.5
G1 X4 F150
G0 Y1.5 Z1
G1 X5 F150
G0 X1 Y0 Z0
G21
G1 X30 F3600
G0 X80 Y20
G1 X81 F3600
G20
G91
G1 X0.2 F150
G0 X-1
M2
"""
"""Every stream stands behind a feed move at right angles, and in front of another."""


@pytest.mark.parametrize("unit", ["inch", "mm"])
def test_an_ini_in_inches_stops_at_the_ends_of_every_stream(unit, tmp_path):
    """A motion of 1e-8 machine units is none: of inches, the tiny ones of a stream once were."""
    machine = machine_of("mill", 0.001)
    result = process(INCHES, machine, controller="linuxcnc", profile="condition3")
    assert result.planned == 5
    settings = settings_of(machine, 1.05)
    if unit == "inch":
        settings = in_inches(settings)
    best = {}
    for _ in range(3):
        rows = record(result.output, tmp_path, settings)
        rows[:, 1:4] *= 25.4 if unit == "inch" else 1.0
        for played in streams(result, rows, 0.001):
            now = worth(result, played, 0.001)
            best[played.row] = min(best.get(played.row, np.inf), now)
        if max(best.values()) <= 1.0:
            break
    assert max(best.values()) <= 1.0, best
    path, stops = rows[:, 1:4], result.program.rapids
    for row in np.flatnonzero(result.plans.planned):
        for corner in (stops.start[row, :3], stops.target[row, :3]):
            assert np.linalg.norm(path - corner, axis=1).min() < 2e-6, (row, corner)


def test_the_drives_shake_less_than_behind_plain_rapids(tmp_path):
    machine = machine_of("vmc", 0.001)
    result = process(MIXED.encode(), machine, controller="linuxcnc")
    today = record(MIXED.encode(), tmp_path, settings_of(machine, 1.0 / 1.2))
    ours = record(result.output, tmp_path, settings_of(machine, 1.05))
    before = {p.row: p.residual.max() for p in rapids(result, today, 0.001)}
    after = {p.row: p.residual.max() for p in streams(result, ours, 0.001)}
    shares = np.array([after[row] / before[row] for row in after])
    assert np.median(shares) < 0.5
    assert sum(after.values()) < 0.6 * sum(before.values())


BOUNDED = b"""G21 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G4 P0.3
G0 X60 Y80
G4 P0.3
G0 X0 Y0 Z50
G4 P0.3
G0 X100
G4 P0.3
M2
"""


def test_max_linear_velocity_bounds_the_path_of_rapids_and_streams(tmp_path):
    """`path.rapid.velocity` is what LinuxCNC does with MAX_LINEAR_VELOCITY, on diagonals, too."""
    text = mill(more=f"{NO_GUARD}path: {{rapid: {{velocity: 250}}}}\n")
    text = text.replace(", jerk: 5.0e+5", ", planner: linuxcnc-2.9").replace(
        "acceleration: 5000, jerk: 5.0e+6", "acceleration: 6000, jerk: 5.0e+6"
    )
    machine = Machine.loads(text, "mill")
    result = process(BOUNDED, machine)
    assert result.planned == 3
    late, best = {}, {}
    for _ in range(3):
        bound = {"MAX_LINEAR_VELOCITY": 250.0}
        today = settings_of(machine, 5000.0 / 6000.0, TRAJ=bound)
        for played in rapids(result, record(BOUNDED, tmp_path, today), 0.001):
            late[played.row] = min(late.get(played.row, np.inf), abs(played.late))
        raised = settings_of(machine, 1.05, TRAJ=bound)
        for played in streams(result, record(result.output, tmp_path, raised), 0.001):
            best[played.row] = min(best.get(played.row, np.inf), worth(result, played, 0.001))
        if max(late.values()) <= 3 and max(best.values()) <= 1.0:
            break
    assert (len(late), len(best)) == (3, 3)
    assert max(late.values()) <= 3, late
    assert max(best.values()) <= 1.0, best
