"""Programs played by LinuxCNC, and what became of each rapid.

What the drives would get is recorded in every servo period. A rapid is found by the lines of its
stream (or its own, played as it is), laid over its plan at the shift that fits best, and judged by
straight lines between the recorded positions, at the plan's arrival.
"""

import shutil
import sys
from bisect import bisect_right
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.motion import sample_profiles

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "linuxcnc"))
import lcnc  # noqa: E402

AHEAD = 2
"""Periods from the moment at which a line begins to the first motion of the drives."""
ARRIVED = 2e-6
"""Left of the way when a motion counts as over. [mm]"""
MARKS = [
    pytest.mark.linuxcnc,
    pytest.mark.playback,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC (linuxcnc-uspace) is absent"
    ),
]


@dataclass
class Played:
    """One rapid: what it took [periods], how far it was off [mm], what its modes keep [mm]."""

    row: int
    taken: int
    """From the moment at which its lines begin to that at which they end, more than T_SUM."""
    late: int
    """From the first motion to the last, more than T_SUM."""
    deviation: float
    residual: np.ndarray
    way: np.ndarray
    """Along the line, in every period of the recording. [mm]"""
    begin: float
    """Where in it the plan begins. [periods]"""


MODES = (30, 50, 90, 110)
"""Of a fast mill whose three axes excite them all alike. [Hz]"""


def mill(period=0.001, more=""):
    """The text of its machine file."""
    text = f"name: mill\ninterval: {period:g}\npositioning: linear\naxes:\n"
    for axis in "XYZ":
        text += f"  {axis}:\n    rapid: {{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}\n"
        text += "    limit: {velocity: 600, acceleration: 5000, jerk: 5.0e+6}\n    modes:\n"
        for f in MODES:
            text += f"      - {{frequency: {f}, damping: 0.02}}\n"
    return text + more


MIXED = """G21 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G4 P0.2
G0 Z0.5
G1 X1 F600
G0 Z1.5
G1 X2 F600
G0 Z4
M3 S100
G0 Z9
G0 X12 Y10
X40 Y30 Z20
G4 P0.1
G0 X140
G2 X150 Y40 I10 J0 F3000
G0 X10 Y0
G20
G0 Z0.2
G1 X0.5 F40
G91
G0 X1 Y0.5
G0 Z-0.01
G21
G1 X2 F600
G0 X3.3 Z-1.1
G90
G43 H0
G0 X5 Y6 Z7
G1 X6 F1000
G0 X6.2
G1 X8 F600
G0 X250 Y40 Z0
G92 X0
G0 X-20
G92.1
T1 M6
G0 X200 Y20 Z5 (behind a tool change)
G0 X[500/3] Y[50*COS[70]] Z[20/7]
G61
G0 X100 Y20
G64
G0 Z6 M8
G3 X110 Y30 I0 J10 F2000
G0 X0 Y0 Z0 M9
G1 Z1 F600
G0 Z0.8
G1 Z1 F600
G0 X30 Y-20 Z4
G1 Z5 F600
G0 Z4.7
G4 P0.2
M2
"""
"""Rapids of 0.2 to 300 mm, one to three axes, G20, G91, chained, computed; behind M3, M6, G4, G92,
arcs."""


def settings_of(machine, factor=1.0, **others):
    """INI values of a machine: its limits, and as much acceleration more."""
    path = {"ACCELERATION": 1e5, "VELOCITY": 1e4}
    out = {"TRAJ": {f"{k}_LINEAR_{q}": v for k in ("MAX", "DEFAULT") for q, v in path.items()}}
    for number, name in enumerate("XYZ"):
        if name not in machine.axis_names:
            continue
        limit = machine.axis(name).limit
        own = {"MAX_ACCELERATION": factor * limit.acceleration, "MAX_VELOCITY": limit.velocity}
        out |= {f"JOINT_{number}": dict(own), f"AXIS_{name}": dict(own)}
    for section, values in others.items():
        out.setdefault(section, {}).update(values)
    return out


def in_inches(settings):
    """The same machine, with an INI in inches."""
    lengths = {"MAX_VELOCITY", "MAX_ACCELERATION", "MIN_LIMIT", "MAX_LIMIT"}
    lengths |= {f"{k}_LINEAR_{q}" for k in ("MAX", "DEFAULT") for q in ("VELOCITY", "ACCELERATION")}
    out = {
        section: {key: n / 25.4 if key in lengths else n for key, n in values.items()}
        for section, values in settings.items()
    }
    out["TRAJ"]["LINEAR_UNITS"] = "inch"
    return out


def run_or_skip(path, **how):
    """Play a program on LinuxCNC; where there is none, the test is skipped, and says so."""
    try:
        return lcnc.run(path, **how)
    except lcnc.Unavailable as reason:
        pytest.skip(f"LinuxCNC cannot run here: {reason}")


def record(program, tmp_path, settings, period=0.001, timeout=120.0):
    """Rows of (t, X, Y, Z, line) of a program, one each servo period."""
    path = tmp_path / "played.ngc"
    path.write_bytes(program)
    run = run_or_skip(path, settings=settings, period=period, timeout=timeout)
    return np.array([row[:5] for row in run.rows])


def streams(result, rows, period):
    """Every stream of a recorded output."""
    starts = [0]
    for text in result.output.splitlines(keepends=True):
        starts.append(starts[-1] + len(text))
    return [
        judged(result, row, rows, bisect_right(starts, a), bisect_right(starts, b - 1), period)
        for a, b, row in result.edits.tolist()
        if row >= 0
    ]


def rapids(result, rows, period):
    """The same rapids in a recording of the original."""
    planned = np.flatnonzero(result.plans.planned)
    lines = result.program.rapids.line
    return [judged(result, int(i), rows, lines[i], lines[i], period, plain=True) for i in planned]


def judged(result, row, recorded, first, last, period, plain=False):
    """Compare one rapid with its plan."""
    plans, modes = result.plans, result.plans.modes
    here = np.nonzero((recorded[:, 4] >= first) & (recorded[:, 4] <= last))[0]
    window = slice(max(here[0] - 6, 0), here[-1] + 10)
    moved = plans.displacement[row, :3]
    length = np.linalg.norm(moved)
    start = result.program.rapids.start[row, :3]
    # What is recorded is where the machine is, which the program may call otherwise (G92).
    found = recorded[here[0], 1:4]
    start = np.where(np.abs(found - start) > 5.0, found, start)
    axes = moved != 0.0
    way = (recorded[window, 1:4] - start)[:, axes] @ moved[axes] / length
    way = np.clip(way, 0.0, length)
    # The motions before and behind may cross the same line.
    way[: here[0] + AHEAD - window.start] = 0.0
    arrived = np.flatnonzero(way >= length - ARRIVED)
    way[arrived[0] if len(arrived) else len(way) :] = length
    count = int(plans.counts[row])
    profile = plans.profiles.take([plans.profiles_of(row).start])
    moments = np.arange(count + 1)
    planned = sample_profiles(profile, moments[np.newaxis, :], period)[0][0] * length
    moving = np.nonzero((way > 1e-5) & (way < length - 4e-5))[0]
    late = int(moving[-1] - moving[0]) + 2 - count
    if plain:
        arrival, deviation = float(moving[-1] + 1), np.nan
    else:
        rough = min(np.arange(-8.0, 60.0, 1.0), key=lambda s: _off(way, s, moments, planned))
        fine = rough + np.arange(-1.0, 1.0, 0.02)
        shift = min(fine, key=lambda s: _off(way, s, moments, planned))
        arrival, deviation = shift + count, _off(way, shift, moments, planned)
    kicks = np.diff(np.diff(way, prepend=0.0, append=length)) / period
    left = (arrival - np.arange(len(kicks))) * period
    response = (kicks[:, np.newaxis] * np.exp(modes.poles * left[:, np.newaxis])).sum(axis=0)
    share = np.abs(modes.participation[:, :3] @ moved) / length
    taken = int(here[-1] - here[0]) + 1 - count
    residual = np.abs(response) / modes.poles.imag * share
    return Played(row, taken, late, deviation, residual, way, arrival - count)


def _off(way, shift, moments, planned):
    """Largest difference from the plan, begun so many periods into the recording."""
    k = np.arange(len(way)) - shift
    return np.abs(way - np.interp(k, moments, planned)).max()
