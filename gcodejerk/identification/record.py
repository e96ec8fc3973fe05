"""A record of vibration: channels over time, and what is odd about it.

This module owns the form that every file is read into, and the checks that need no file: the unit
held against gravity, uneven steps, clipping, gaps.

Rule: what is odd is said, and what cannot be used is refused; nothing is repaired in silence.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import GcodejerkError
from gcodejerk.motion.profiles.profile import Array

GRAVITY = 9806.65
"""[mm/s^2]"""
UNITS = {"g": GRAVITY, "m/s^2": 1000.0, "mm/s^2": 1.0}
"""mm/s^2 of one."""
TOLERANT = 0.15
"""Part by which a sensor may miss gravity."""
UNEVEN = 0.10
"""Standard deviation of the steps, of their mean, beyond which a record is refused."""
GAP = 3.0
"""A step so many times the usual one is a gap."""
CLIPPED = 3
"""Samples at the extreme of which a channel has so many are clipped."""
MOST_FELT = 50.0
"""What sensors of machines hardly feel: a slip of the unit. [g]"""
STILL = 1e-9
LEAST_SAMPLES = 32


class RecordError(GcodejerkError):
    """A record that cannot be used."""


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Accelerations of c channels at k evenly spaced moments.

    Attributes
    ----------
    name : str
        What messages call it.
    rate : float
        [Hz]
    begin : float
        Of the first sample. [s]
    channels : tuple of str, length c
    values : ndarray, shape (c, k)
        Without their mean. [mm/s^2]
    broken : ndarray of bool, shape (k,)
        Samples that are clipped, or that fill a gap.
    notes : tuple of str
        What was odd.
    """

    name: str
    rate: float
    begin: float
    channels: tuple[str, ...]
    values: Array
    broken: NDArray[np.bool_]
    notes: tuple[str, ...] = ()

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return float(self.values.shape[1] / self.rate)

    def __repr__(self) -> str:
        return f"<Record {self.name}: {', '.join(self.channels)}, {self.duration:.3g} s>"


@dataclass(frozen=True, slots=True, eq=False)
class Spectrum:
    """A power spectral density, as Klipper writes it: f lines of c channels."""

    name: str
    frequency: Array
    channels: tuple[str, ...]
    values: Array
    """Shape (c, f)."""
    notes: tuple[str, ...] = field(default=())
    normalized: bool = False
    """Klipper's table of a calibration: scaled, no spectrum to judge by."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """What a file holds before it is checked: times [s] or None, and values in its own unit."""

    name: str
    times: Array | None
    rate: float | None
    channels: tuple[str, ...]
    values: Array
    """Shape (c, k)."""
    unit: str | None
    breaks: tuple[int, ...] = ()
    """Samples in front of which some were lost."""
    notes: tuple[str, ...] = ()


def make_record(samples: Samples, unit: str | None = None) -> Record:
    """Check what a file holds.

    Parameters
    ----------
    samples : Samples
    unit : str, optional
        One of `UNITS`, in place of what the file says.

    Returns
    -------
    Record

    Raises
    ------
    RecordError
        It is too short, constant, not a number, too uneven, or its unit is not known.
    """
    name, values = samples.name, samples.values
    count = values.shape[1]
    if count < LEAST_SAMPLES:
        raise RecordError(
            f"{name} has {count} samples, expected at least {LEAST_SAMPLES}", "record for longer"
        )
    if not np.isfinite(values).all():
        c, k = np.argwhere(~np.isfinite(values))[0]
        raise RecordError(
            f"{name}: sample {k + 1} of {samples.channels[c]} is no number",
            "cut the record before it, or leave the channel out",
        )
    moving = np.ptp(values, axis=1) > STILL * np.abs(values).max(initial=STILL)
    if not moving.any():
        raise RecordError(
            f"{name} is constant: the sensor saw nothing", "check its cable and range"
        )
    notes = list(samples.notes)
    scale, said = _scale(samples, unit)
    notes += said
    clipped = _clipped(values)
    for c in np.flatnonzero(clipped.sum(axis=1)):
        count_c = int(clipped[c].sum())
        notes.append(
            f"{samples.channels[c]} is clipped at {values[c][clipped[c]][0]:.4g} in {count_c} "
            "samples: these are not used"
        )
    times, rate, uneven = _timing(samples)
    notes += uneven
    broken: NDArray[np.bool_] = np.any(clipped, axis=0)
    begin = 0.0
    if times is not None:
        begin = float(times[0])
        even = begin + np.arange(round((times[-1] - begin) * rate) + 1) / rate
        gaps = np.diff(times) > GAP / rate
        for k in np.flatnonzero(gaps):
            notes.append(f"samples are missing behind {times[k]:.3f} s: what is there is not used")
        holes = np.zeros(len(even), dtype=np.bool_)
        for k in np.flatnonzero(gaps):
            holes |= (even > times[k]) & (even < times[k + 1])
        broken = np.asarray(holes | (np.interp(even, times, broken.astype(float)) > 0.0), np.bool_)
        values = np.array([np.interp(even, times, row) for row in values])
    for k in samples.breaks:
        broken[max(0, k - 1) : k + 1] = True
    values = scale * (values - np.median(values, axis=1, keepdims=True))
    most = float(np.abs(values).max(initial=0.0)) / GRAVITY
    if most > MOST_FELT:
        notes.append(
            f"{name} reaches {most:.3g} g, above {MOST_FELT:g}: is the unit right? --unit states "
            f"another, one of {', '.join(UNITS)}"
        )
    return Record(name, rate, begin, samples.channels, values, broken, tuple(notes))


def _scale(samples: Samples, unit: str | None) -> tuple[float, list[str]]:
    """mm/s^2 of one, held against gravity where a sensor of three axes feels it."""
    name = unit or samples.unit
    felt = None
    if len(samples.values) == 3:
        felt = float(np.linalg.norm(np.median(samples.values, axis=1)))
    by_gravity = None
    if felt is not None:
        by_gravity = next(
            (u for u, s in UNITS.items() if abs(felt * s / GRAVITY - 1.0) < TOLERANT), None
        )
    if unit is None and by_gravity is not None and by_gravity != samples.unit:
        told = f"says {samples.unit}" if samples.unit else "does not say its unit"
        return UNITS[by_gravity], [
            f"the file {told}, but gravity reads {felt:.4g}: taken as {by_gravity} (--unit decides)"
        ]
    if name is None:
        raise RecordError(
            f"{samples.name} does not say its unit, and gravity is not in it",
            f"state --unit, one of {', '.join(UNITS)}",
        )
    return UNITS[name], []


def _clipped(values: Array) -> NDArray[np.bool_]:
    """Samples at the extreme of their channel, where it has several."""
    out = np.zeros(values.shape, dtype=np.bool_)
    for c, row in enumerate(values):
        for extreme in (row.min(), row.max()):
            at = row == extreme
            # A quiet sensor of few bits stands at its extreme often, but not far out.
            far = abs(extreme - np.median(row)) > 6.0 * np.median(np.abs(row - np.median(row)))
            if at.sum() >= CLIPPED and far:
                out[c] |= at
    return out


def _timing(samples: Samples) -> tuple[Array | None, float, list[str]]:
    """Times, or None where they are even; the rate; what is odd."""
    if samples.times is None:
        if not samples.rate or samples.rate <= 0.0:
            raise RecordError(f"{samples.name} has no times", "state --rate HZ")
        return None, samples.rate, []
    steps = np.diff(samples.times)
    if (steps <= 0.0).any():
        k = int(np.argmax(steps <= 0.0))
        raise RecordError(
            f"{samples.name}: time goes back from {samples.times[k]:.6g} to "
            f"{samples.times[k + 1]:.6g} s",
            "join records of one run only",
        )
    usual = float(np.median(steps))
    inner = steps[steps < GAP * usual]
    uneven = float(inner.std() / inner.mean())
    rate = 1.0 / float(inner.mean())
    if uneven > UNEVEN:
        raise RecordError(
            f"{samples.name}: the steps of time scatter by {uneven:.0%}, expected at most "
            f"{UNEVEN:.0%}",
            "record with a sensor that keeps its rate",
        )
    notes = []
    if uneven > 0.01:
        notes.append(f"the steps of time scatter by {uneven:.1%}: taken to {rate:.5g} Hz")
    return samples.times, rate, notes


def unit_of(text: str) -> str | None:
    """The unit that a column's name holds, if any: ``accel_x_g``, ``ax (m/s^2)``."""
    plain = text.lower().replace("²", "^2").replace("**", "^").replace("s2", "s^2")
    for unit in ("mm/s^2", "m/s^2"):
        if unit in plain:
            return unit
    return "g" if re.search(r"(?:[_(\[ ])g\W*$", plain) else None
