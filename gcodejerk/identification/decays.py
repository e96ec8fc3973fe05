"""Where a record rings freely: behind each arrival, until the next motion or until it is still.

This module owns the search for such stretches. An arrival leaves no mark of its own, so it is found
by what follows: a stretch is free where few oscillations explain it down to the noise, also where
it begins. The begin is looked for backwards from the end, in small, and the modes once it is known.

Rule: a stretch with a clipped or lost sample, or in which the next motion begins, is none.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gcodejerk.identification.record import Record
from gcodejerk.identification.ringing import Taken, fitted, quick_poles, take_apart
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.threads import one_thread

WINDOW = 0.015
"""Over which the strength of vibration is taken. [s]"""
REST = 0.2
"""Of the windows from which the noise is taken, [s], and the percentage of them that is rest."""
QUIET_SHARE = 25.0
ACTIVE = 5.0
"""Over the noise, from which on something happens. [-]"""
JOINED = 0.3
"""Stretches nearer than this are one motion: its ramps, and a beat of what follows. [s]"""
ONSET = 0.1
"""In front of a motion, what is taken for rest. [s]"""
SHORTEST = 0.06
"""Of a stretch that is taken apart. [s]"""
LONGEST = 2.0
"""What is taken apart of one. [s]"""
COARSE, FINE = 0.02, 0.004
"""Between begins that are tried. [s]"""
LATER = 0.01
"""Behind the earliest begin that holds, the stretch is taken: the last of a ramp looks free. [s]"""
TRIES = 5
"""Begins for which the modes are looked for in earnest, `COARSE` apart."""
BLOCK, BLOCKS = 0.025, 4
"""Its begin is judged in blocks, for there the motion would be. [s]"""
EXPLAINED = 0.02
"""Share of the energy that the modes may leave, where noise is less."""
OVER_NOISE = 1.6
"""Energy that they may leave, over that of the noise."""
RATE = 4.0
"""To which records are thinned out: over the highest frequency of the band. A matrix of so many
rows then spans more of a decay, which is what the uncertainty hangs on."""
ENOUGH = 4.0
"""Energy over that of the noise, that a stretch has in its begin: less is taken for noise."""
QUICK_ORDER, QUICK_ROWS = 16, 50
"""For the search of the begin: poles, and rows."""


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
    with one_thread():
        return _find(record, band)


def _find(record: Record, band: tuple[float, float]) -> Search:
    """As `find_decays`."""
    whole, record = record, thinned(record, RATE * band[1])
    strength = _strength(record)
    noise = _noise(record, strength)
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
            decays.append(replace(found, moved=_onset(whole, found.moved, noise)))
    return Search(tuple(decays), len(stretches), noise, tuple(notes))


def thinned(record: Record, rate: float) -> Record:
    """Fewer samples where the sensor is much quicker than anything that is looked for.

    Parameters
    ----------
    record : Record
    rate : float
        That has to stay at least. [Hz]

    Returns
    -------
    Record
        Whatever would be folded into a fifth of its rate is filtered away.
    """
    by = int(record.rate // rate)
    if by < 2:
        return record
    # A windowed sinc: flat below a quarter of the new rate, and symmetric, so nothing is shifted.
    half = 6 * by
    taps = np.sinc(np.arange(-half, half + 1) / by * 0.9) * np.kaiser(2 * half + 1, 6.0)
    taps /= taps.sum()
    smooth = [np.convolve(np.pad(row, half, mode="edge"), taps, "valid") for row in record.values]
    marks = np.convolve(record.broken.astype(float), np.ones(2 * by + 1), "same") > 0.5
    return replace(
        record, rate=record.rate / by, values=np.array(smooth)[:, ::by], broken=marks[::by]
    )


def _noise(record: Record, strength: Array) -> Array:
    """Standard deviation of each channel where the record is quietest, shape (c,) [mm/s^2]."""
    width = max(16, int(REST * record.rate))
    count = max(1, len(strength) // width)
    parts = [slice(k * width, (k + 1) * width) for k in range(count)]
    whole = [part for part in parts if not record.broken[part].any()] or parts
    loud = np.array([float(strength[part].max()) for part in whole])
    still = np.flatnonzero(loud <= np.percentile(loud, QUIET_SHARE))
    values = np.array([record.values[:, whole[int(k)]].std(axis=1) for k in still])
    # Sensors without noise there are none; records of few bits there are.
    least = 1e-6 * np.abs(record.values).max(axis=1)
    noise: Array = np.maximum(np.median(values, axis=0), np.maximum(least, 1e-12))
    return noise


def _strength(record: Record) -> Array:
    """How strongly it shakes around each sample, all channels together, shape (k,) [mm/s^2]."""
    count = record.values.shape[1]
    width = min(max(3, int(WINDOW * record.rate)), count)
    slow = min(max(width, int(0.25 * record.rate)), count)
    out = np.zeros(count)
    for row in record.values:
        out += _mean_around((row - _mean_around(row, slow)) ** 2, width)
    strength: Array = np.sqrt(out)
    return strength


def _mean_around(row: Array, width: int) -> Array:
    sums = np.concatenate([[0.0], np.cumsum(np.pad(row, width // 2, mode="edge"))])
    out: Array = (sums[width:] - sums[:-width])[: len(row)] / width
    return np.pad(np.maximum(out, out.min()), (0, len(row) - len(out)), mode="edge")


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
    record: Record, motion: int, first: int, end: int, noise: Array,
    band: tuple[float, float],
) -> tuple[Decay | None, str]:  # fmt: skip
    """The free stretch behind a motion, or why there is none."""
    rate = record.rate
    shortest = max(int(SHORTEST * rate), int(2.5 * rate / band[1]), 24)
    if end - first < shortest:
        return None, f"it rings for {1e3 * (end - first) / rate:.0f} ms only"
    # What a clipped or lost sample stands in is no stretch; the last whole one is behind arrival.
    edges = [first - 1, *(first + np.flatnonzero(record.broken[first:end])).tolist(), end]
    whole = [(a + 1, b) for a, b in pairwise(edges) if b - a - 1 >= shortest]
    why = "no few modes explain what follows: it is no free vibration"
    for low, high in reversed(whole):
        high = min(high, low + int(3.0 * LONGEST * rate))
        begin = _begin(record, low / rate, high / rate, shortest / rate, noise)
        if begin is None:
            continue
        for late in range(TRIES):
            at = int((begin + LATER + late * COARSE) * rate)
            part = record.values[:, at : min(high, at + int(LONGEST * rate))]
            if part.shape[1] < shortest:
                break
            early = part[:, : int(BLOCK * BLOCKS * rate)].std(axis=1) / noise
            if float((early**2).mean()) < ENOUGH:
                why = "what follows is too faint"
                break
            taken = take_apart(part, rate, noise, band)
            if not taken.rings and taken.unexplained < EXPLAINED:
                why = f"what rings is not from {band[0]:g} to {band[1]:g} Hz, or too faint"
            if taken.rings and _explained(part - taken.fit, part, noise, rate):
                when = [record.begin + k / rate for k in (first, at, at + part.shape[1])]
                return Decay(motion, when[0], when[1], when[2], taken), ""
    if len(whole) < 1 or record.broken[first:end].any():
        return None, "samples are clipped or missing, and what is left is no free vibration"
    return None, why


def _onset(record: Record, about: float, noise: Array) -> float:
    """When a motion begins [s]: what is taken for drift makes `about` early."""
    first = max(0, int((about - record.begin) * record.rate))
    early = slice(max(0, first - int(ONSET * record.rate)), max(1, first))
    rest = np.median(record.values[:, early], axis=1, keepdims=True)
    ahead = record.values[:, first : first + int(0.3 * record.rate)]
    # Two samples in a row: one is noise now and then.
    size = np.sqrt((((ahead - rest) / noise[:, np.newaxis]) ** 2).mean(axis=0))
    seen = np.flatnonzero(np.minimum(size[:-1], size[1:]) > ACTIVE)
    return float(record.begin + (first + (int(seen[0]) if len(seen) else 0)) / record.rate)


def _begin(record: Record, low: float, high: float, shortest: float, noise: Array) -> float | None:
    """Since when, reckoned back from its end, a stretch is free [s from the record's begin]."""

    def free(begin: float) -> bool:
        part = record.values[:, int(begin * record.rate) : int(high * record.rate)]
        part = part[:, : int(LONGEST * record.rate)]
        return _explained(_left(part, record.rate, noise), part, noise, record.rate)

    begin = high - shortest
    good: float | None = None
    missed = 0
    bad = low
    while begin > low and missed < 2:
        if free(begin):
            good, missed = begin, 0
        else:
            missed += 1
            if missed == 1:
                bad = begin
        begin -= max(COARSE, 0.1 * (high - begin))
    if good is None:
        return None
    if missed == 0:
        bad = low
    while good - bad > FINE:
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if free(middle) else (good, middle)
    return good


def _left(part: Array, rate: float, noise: Array) -> Array:
    """What oscillations of one small order leave of a stretch, shape as it [mm/s^2]."""
    y = part / noise[:, np.newaxis]
    poles = quick_poles(y, rate, QUICK_ORDER, QUICK_ROWS)
    return part - fitted(part, rate, poles)[1]


def _explained(left: Array, part: Array, noise: Array, rate: float) -> bool:
    """Whether what is left of a stretch is noise or little, on the whole and at its begin."""
    unit = noise[:, np.newaxis]
    rest, whole = (left / unit) ** 2, (part / unit) ** 2
    if rest.mean() > max(OVER_NOISE, EXPLAINED * whole.mean()):
        return False
    size = max(4, int(BLOCK * rate))
    energy = float(whole[:, : BLOCKS * size].mean())
    # Five standard deviations of the energy of that many samples of noise.
    allowed = max(1.0 + 5.0 * np.sqrt(2.0 / (size * len(part))), EXPLAINED * energy)
    blocks = [rest[:, k * size : (k + 1) * size] for k in range(BLOCKS)]
    return all(float(block.mean()) <= allowed for block in blocks if block.shape[1] == size)
