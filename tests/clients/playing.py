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
    late: int
    deviation: float
    residual: np.ndarray


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


def record(program, tmp_path, settings, period=0.001, timeout=120.0):
    """Rows of (t, X, Y, Z, line) of a program, one each servo period."""
    path = tmp_path / "played.ngc"
    path.write_bytes(program)
    try:
        run = lcnc.run(path, settings=settings, period=period, timeout=timeout)
    except lcnc.Unavailable as reason:
        pytest.skip(f"LinuxCNC cannot run here: {reason}")
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
    return Played(row, late, deviation, np.abs(response) / modes.poles.imag * share)


def _off(way, shift, moments, planned):
    """Largest difference from the plan, begun so many periods into the recording."""
    k = np.arange(len(way)) - shift
    return np.abs(way - np.interp(k, moments, planned)).max()
