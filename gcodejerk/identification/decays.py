"""Where a record rings freely: behind each arrival, until the next motion or until it is still.

This module owns the search for such stretches. An arrival leaves no mark of its own, so it is found
by what follows: a stretch is free where the modes that are found in it explain it down to the noise;
of all begins the earliest is taken that does.

Rule: a stretch with a clipped or lost sample, or in which the next motion begins, is none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.identification.record import Record
from gcodejerk.identification.ringing import Taken, take_apart
from gcodejerk.motion.profiles.profile import Array

WINDOW = 0.015
"""Over which the strength of vibration is taken. [s]"""
QUIET_SHARE = 20.0
"""Percent of the windows that are taken for rest."""
ACTIVE = 5.0
"""Over the noise, from which on something happens. [-]"""
JOINED = 0.03
"""Stretches nearer than this are one. [s]"""
SHORTEST = 0.06
"""Of a stretch that is taken apart. [s]"""
LONGEST = 2.0
"""What is taken apart of one. [s]"""
STEP = 0.004
"""Between begins that are tried. [s]"""
EXPLAINED = 0.02
"""Share of the energy that the modes may leave, where noise is less."""
OVER_NOISE = 1.6
"""Energy that they may leave, over that of the noise."""
HIGHEST_RATE = 1200.0
"""Records are thinned out to about this. [Hz]"""


@dataclass(frozen=True, slots=True, eq=False)
class Decay:
    """A stretch of free vibration.

    Attributes
    ----------
    motion : int
        Which of the record's motions is in front of it.
    moved : float
        When that began. [s]
    begin, end : float
        [s]
    taken : Taken
        Its modes.
    """

    motion: int
    moved: float
    begin: float
    end: float
    taken: Taken


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """What a record holds.

    Attributes
    ----------
    decays : tuple of Decay
        In their order.
    motions : int
        How often something happened.
    noise : ndarray, shape (c,)
        Standard deviation at rest. [mm/s^2]
    notes : tuple of str
        Why motions gave no decay.
    """

    decays: tuple[Decay, ...]
    motions: int
    noise: Array
    notes: tuple[str, ...]


def find_decays(record: Record, band: tuple[float, float]) -> Search:
    """Find the stretches of free vibration of a record, and take them apart.

    Parameters
    ----------
    record : Record
    band : (float, float)
        Frequencies to look for. [Hz]

    Returns
    -------
    Search
    """
    record = _thinned(record, band[1])
    strength = _strength(record)
    still = strength <= np.percentile(strength, QUIET_SHARE)
    noise = record.values[:, still & ~record.broken].std(axis=1)
    floor = float(np.sqrt((noise**2).sum()))
    stretches = _stretches(strength > ACTIVE * max(floor, 1e-12), record.rate)
    decays, notes = [], []
    for k, (first, last) in enumerate(stretches):
        # A decay goes on below the threshold, until the next motion.
        limit = stretches[k + 1][0] if k + 1 < len(stretches) else record.values.shape[1]
        behind = min(limit - int(0.02 * record.rate), last + int(0.15 * record.rate))
        found, why = _decay(record, k, first, max(behind, last), noise, band)
        if found is None:
            at = record.begin + first / record.rate
            notes.append(f"motion at {at:.2f} s: {why}")
        else:
            decays.append(found)
    return Search(tuple(decays), len(stretches), noise, tuple(notes))


def _thinned(record: Record, highest: float) -> Record:
    """Fewer samples where the sensor is much quicker than anything that is looked for."""
    by = int(record.rate // max(HIGHEST_RATE, 5.0 * highest))
    if by < 2:
        return record
    # A box over as many samples: exact enough below a fifth of the new rate, see `band`.
    count = record.values.shape[1] // by
    values = record.values[:, : count * by].reshape(len(record.values), count, by).mean(axis=2)
    broken = record.broken[: count * by].reshape(count, by).any(axis=1)
    shift = 0.5 * (by - 1) / record.rate
    return replace(
        record, rate=record.rate / by, values=values, broken=broken, begin=record.begin + shift
    )


def _strength(record: Record) -> Array:
    """How strongly it shakes around each sample, all channels together, shape (k,) [mm/s^2]."""
    width = max(3, int(WINDOW * record.rate))
    kernel = np.ones(width) / width
    slow = max(width, int(0.25 * record.rate))
    out = np.zeros(record.values.shape[1])
    for row in record.values:
        drift = np.convolve(np.pad(row, slow // 2, mode="edge"), np.ones(slow) / slow, "same")
        drift = drift[slow // 2 : slow // 2 + len(row)]
        out += np.convolve((row - drift) ** 2, kernel, "same")
    strength: Array = np.sqrt(out)
    return strength


def _stretches(active: NDArray[np.bool_], rate: float) -> list[tuple[int, int]]:
    """First and last sample of every stretch in which something happens."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], active.astype(np.int8), [0]])))
    pairs = [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[tuple[int, int]] = []
    for first, last in pairs:
        if joined and first - joined[-1][1] < JOINED * rate:
            joined[-1] = (joined[-1][0], last)
        else:
            joined.append((first, last))
    least = 0.5 * SHORTEST * rate
    return [(first, last) for first, last in joined if last - first >= least]


def _decay(
    record: Record, motion: int, first: int, end: int, noise: Array, band: tuple[float, float]
) -> tuple[Decay | None, str]:
    """The free stretch behind a motion, or why there is none."""
    rate = record.rate
    shortest = max(int(SHORTEST * rate), int(2.5 * rate / band[1]), 24)
    if end - first < shortest:
        return None, f"it rings for {1e3 * (end - first) / rate:.0f} ms only"
    step = max(1, int(STEP * rate))
    best: tuple[int, Taken] | None = None
    for begin in range(first + step, end - shortest, step):
        part = record.values[:, begin : min(end, begin + int(LONGEST * rate))]
        if record.broken[begin : begin + part.shape[1]].any():
            continue
        taken = take_apart(part, rate, noise, band)
        if not taken.rings:
            continue
        energy = float(((part / noise[:, np.newaxis]) ** 2).mean())
        allowed = max(EXPLAINED, OVER_NOISE / max(energy, 1e-12))
        if taken.unexplained <= allowed:
            best = (begin, taken)
            break
    if best is None:
        if record.broken[first:end].any():
            return None, "samples are clipped or missing"
        return None, "no few modes explain what follows: it is no free vibration"
    begin, taken = best
    at = record.begin
    return Decay(motion, at + first / rate, at + begin / rate, at + end / rate, taken), ""
