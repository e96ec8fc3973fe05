"""The JSON report of a comparison: section 4 of the contract, `compare --json`.

Rule: as in `records`, what is unknown or infinite is None. A time is infinite where a mode without
damping rings for ever; a jerk where the acceleration steps.
"""

from __future__ import annotations

import numpy as np

from gcodejerk._version import __version__
from gcodejerk.axes import AXES
from gcodejerk.planning.arrival import BANDS
from gcodejerk.report.records import Record, number
from gcodejerk.studies.comparison import CONTENDERS, QUANTITIES, Candidate, Comparison

MOST_SEGMENTS = 400
"""More segments than these say nothing to anyone."""
AVERAGE = "fir"
"""A moving average: what it makes of segments of constant jerk are none."""


def compare_record(comparison: Comparison) -> Record:
    """A comparison as dictionaries and lists.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_move`.

    Returns
    -------
    dict
        It keeps `compare.schema.json`.
    """
    usual = comparison["conventional"]
    present = {
        candidate.name: _profile(comparison, candidate, usual)
        for candidate in comparison.candidates
    }
    return {
        "gcodejerk": __version__,
        "machine": comparison.machine.source,
        "move": {axis: number(length) for axis, length in comparison.displacement.items()},
        "positioning": comparison.machine.positioning,
        "interval": comparison.machine.interval,
        "time": number(comparison.time),
        "conventional_time": number(comparison.conventional_time),
        "tolerance": comparison.machine.design.tolerance,
        "shapers": [
            {"frequency": number(frequency), "damping": number(damping)}
            for frequency, damping in comparison.shaped
        ],
        "profiles": [
            present[name] if name in present else _absent(name, comparison.absent[name])
            for name in CONTENDERS
        ],
        "families": [
            *(_profile(comparison, candidate, usual) for candidate in comparison.families),
            *(_absent(name, why) for name, why in comparison.families_absent.items()),
        ],
    }


def _profile(comparison: Comparison, candidate: Candidate, usual: Candidate) -> Record:
    """One candidate."""
    return {
        "profile": candidate.name,
        "time": number(candidate.time),
        "segments": _segments(comparison, candidate),
        "peak": axis_peaks(comparison, candidate),
        "residual": _residual(comparison, candidate, usual),
        "worst_band": _bands(candidate.worst_band),
        "worst_band_acceleration": _bands(candidate.worst_band_acceleration),
        "settling": None if candidate.settling is None else number(candidate.settling),
        "limit": None if candidate.limit is None else number(candidate.limit),
        "within_limits": candidate.within_limits,
        "note": candidate.note or None,
    }


def _absent(name: str, why: str) -> Record:
    """A candidate that does not exist: nothing is known but the reason."""
    keys = ("time", "segments", "peak", "residual", "worst_band", "worst_band_acceleration")
    more = ("settling", "limit", "within_limits")
    return {"profile": name} | dict.fromkeys((*keys, *more)) | {"note": why}


def axis_peaks(comparison: Comparison, candidate: Candidate) -> dict[str, Record]:
    """Peak velocity, acceleration and jerk of each moving axis.

    Parameters
    ----------
    comparison : Comparison
        Tells what each profile carries.
    candidate : Candidate
        Whose peaks.

    Returns
    -------
    dict of str to dict
        By axis: `velocity`, `acceleration`, `jerk`, the last one None where the acceleration
        steps. [mm/s], [mm/s^2], [mm/s^3] or of degrees
    """
    profiles = candidate.profiles
    peaks = (profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk)
    out = {}
    for k, share in enumerate(comparison.share):
        for axis in np.flatnonzero(share):
            size = abs(float(share[axis]))
            out[AXES[axis]] = {
                name: number(float(peak[k]) * size)
                for name, peak in zip(QUANTITIES, peaks, strict=True)
            }
    return out


def _segments(comparison: Comparison, candidate: Candidate) -> list[Record] | Record | None:
    """Segments of constant jerk, of the common profile or of each axis's."""
    profiles = candidate.profiles
    stepped = bool(np.isinf(profiles.peak_jerk).any())
    if candidate.name == AVERAGE or stepped or len(profiles.begin) > MOST_SEGMENTS * len(profiles):
        return None
    if comparison.machine.positioning == "linear":
        lengths = np.abs(comparison.share[0])
        linear = [not comparison.machine.axis(AXES[k]).rotary for k in np.flatnonzero(lengths)]
        moving = lengths[lengths > 0.0]
        path = moving[linear] if any(linear) else moving
        return _scaled(profiles.segments(0), float(np.sqrt((path**2).sum())))
    return {
        AXES[int(np.argmax(share != 0.0))]: _scaled(
            profiles.segments(k), float(np.abs(share).sum())
        )
        for k, share in enumerate(comparison.share)
    }


def _scaled(segments: list[tuple[float, float]], length: float) -> list[Record]:
    """Segments of a unit profile, scaled to a length."""
    return [{"duration": number(d), "jerk": number(j * length)} for d, j in segments]


def _residual(comparison: Comparison, candidate: Candidate, usual: Candidate) -> list[Record]:
    """What each mode keeps, beside what the controller's own G0 leaves."""
    modes = comparison.modes
    return [
        {
            "axis": modes.labels[g],
            "mode": modes.modes[g].name,
            "frequency": number(modes.modes[g].frequency),
            "damping": number(modes.modes[g].damping),
            "acceleration": number(float(candidate.acceleration[g])),
            "displacement": number(float(candidate.displacement[g])),
            "conventional_acceleration": number(float(usual.acceleration[g])),
            "conventional_displacement": number(float(usual.displacement[g])),
        }
        for g in comparison.excited
    ]


def _bands(values: tuple[float, ...]) -> Record:
    """Figures by band: the contract's keys."""
    return {f"{band:.2f}": number(value) for band, value in zip(BANDS, values, strict=True)}
