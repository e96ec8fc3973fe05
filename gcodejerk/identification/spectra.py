r"""Peaks of a measured spectrum: frequencies, and the little that their widths say of damping.

A window of a spectrum is no infinitely long look: with Klipper's (0.5 s, Kaiser) a mode of no
damping shows a half-power width of 1.41 lines, so a width W means a damping ratio of *at most*
:math:`W / 2f`, and about as much less as the window alone would show. Excitation that grows with
the frequency, and several modes under one peak, change it further: so no damping ratio is ever
identified here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.identification.record import RecordError, Spectrum
from gcodejerk.motion.profiles.profile import Array

FAINT = 0.05
"""Of the highest line, below which nothing is called a peak."""
WINDOW_LINES = 1.41
"""Half-power width of a line of Klipper's spectra: 2.20 Hz at 1.5625 Hz. [lines]"""
LEAST_LINES = 8


@dataclass(frozen=True, slots=True)
class Peak:
    """A peak of the sum of all directions.

    Attributes
    ----------
    frequency, uncertain : float
        And half a line. [Hz]
    share : float
        Of the highest line. [-]
    most_damping : float or None
        As its half-power width reads; None where it does not fall to half on both sides. [-]
    without_window : float or None
        The same less what the window alone shows, at least 0. [-]
    """

    frequency: float
    uncertain: float
    share: float
    most_damping: float | None
    without_window: float | None


@dataclass(frozen=True, slots=True, eq=False)
class Peaks:
    """What a spectrum shows.

    Attributes
    ----------
    spectrum : Spectrum
    total : ndarray, shape (f,)
        All directions together.
    peaks : tuple of Peak
        The lowest first.
    """

    spectrum: Spectrum
    total: Array
    peaks: tuple[Peak, ...]


def find_peaks(spectrum: Spectrum, band: tuple[float, float]) -> Peaks:
    """Find the peaks of a spectrum.

    Parameters
    ----------
    spectrum : Spectrum
    band : (float, float)
        Frequencies to look for. [Hz]

    Returns
    -------
    Peaks

    Raises
    ------
    RecordError
        It is scaled, not a spectrum, or shows nothing in the band.
    """
    if spectrum.normalized:
        raise RecordError(
            f"{spectrum.name} is Klipper's table of a calibration: scaled, no spectrum to judge by",
            "give resonances_*.csv (TEST_RESONANCES AXIS=X OUTPUT=resonances), or better raw_data",
        )
    f, total = spectrum.frequency, spectrum.values.sum(axis=0)
    if len(f) < LEAST_LINES or not (np.diff(f) > 0.0).all():
        raise RecordError(
            f"{spectrum.name} has {len(f)} lines, and they have to rise in frequency",
            "record again",
        )
    if not np.isfinite(total).all() or (spectrum.values < 0.0).any():
        raise RecordError(f"{spectrum.name} has values that are no power", "record again")
    inside = np.flatnonzero((f >= band[0]) & (f <= band[1]))
    if not len(inside) or total[inside].max() <= 0.0:
        raise RecordError(
            f"{spectrum.name} has nothing from {band[0]:g} to {band[1]:g} Hz", "see --band"
        )
    line = float(np.median(np.diff(f)))
    highest = float(total[inside].max())
    peaks = []
    for k in inside[(inside > 0) & (inside < len(f) - 1)].tolist():
        here = total[k - 1] < total[k] >= total[k + 1]
        if not here or total[k] < FAINT * highest:
            continue
        left, right = _half(f, total, k, -1), _half(f, total, k, 1)
        if left is None and right is None:
            continue
        most = less = None
        if left is not None and right is not None:
            most = (right - left) / (2.0 * float(f[k]))
            less = max(0.0, most - WINDOW_LINES * line / (2.0 * float(f[k])))
        peaks.append(Peak(float(f[k]), 0.5 * line, float(total[k]) / highest, most, less))
    return Peaks(spectrum, total, tuple(peaks))


def _half(f: Array, total: Array, k: int, way: int) -> float | None:
    """Where a peak has fallen to half of its power; None where it rises above itself before."""
    half = 0.5 * total[k]
    j = k
    while 0 <= j + way < len(f):
        j += way
        if total[j] > total[k]:
            return None
        if total[j] <= half:
            near = j - way
            part = (total[near] - half) / (total[near] - total[j])
            return float(f[near] + part * (f[j] - f[near]))
    return None
