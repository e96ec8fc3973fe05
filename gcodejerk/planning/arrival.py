"""What moves leave when the last of their profiles has ended, at their modes and around them.

This module owns the exact residual of profiles that are no streams: of those that begin together
and may end at different times, as axes that position on their own do.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Profiles, grouped, profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.search.objective import DENSE
from gcodejerk.planning.plans import Modes

Kind = TypeVar("Kind", np.float64, np.complex128)
BANDS = (0.05, 0.10)
"""Relative errors of the frequencies for which the worst is looked for. [-]"""


def each_at_arrival(profiles: Profiles, move: NDArray[np.int64], poles: Complex) -> Complex:
    """Response of modes to each profile, when the last one of its move has ended.

    Parameters
    ----------
    profiles : Profiles
        l unit profiles; those of a move begin together, and the modes ring on after those that end
        early.
    move : ndarray of int, shape (l,)
        The move of each: all from 0 on, rising.
    poles : ndarray of complex, shape (m,)
        [rad/s]

    Returns
    -------
    ndarray of complex, shape (l, m)
        Of a unit participation. [1/s]
    """
    left = (arrivals(profiles, move)[move] - profiles.total)[:, np.newaxis]
    response: Complex = profiles_response(profiles, poles) * np.exp(poles * left)
    return response


def arrivals(profiles: Profiles, move: NDArray[np.int64]) -> Array:
    """When the last profile of each move has ended [s]; moves as in `each_at_arrival`."""
    total = profiles.total
    return np.maximum.reduceat(total, _first(move)) if len(move) else total


def summed(each: NDArray[Kind], move: NDArray[np.int64]) -> NDArray[Kind]:
    """Sums over the profiles of each move, which are counted as in `each_at_arrival`."""
    return np.add.reduceat(each, _first(move), axis=0) if len(move) else each


def _first(move: NDArray[np.int64]) -> NDArray[np.int64]:
    """The first profile of each move."""
    return np.flatnonzero(np.diff(move, prepend=-1))


def arrival_response(profiles: Profiles, weights: Array, poles: Complex) -> Complex:
    """Response of modes to one move, when the last of its profiles has ended.

    Parameters
    ----------
    profiles : Profiles
        l unit profiles that begin together.
    weights : ndarray, shape (l, m)
        Participation times displacement, with its sign. [mm]
    poles : ndarray of complex, shape (m,)
        [rad/s]

    Returns
    -------
    ndarray of complex, shape (m,)
        [mm/s]
    """
    move = np.zeros(len(weights), dtype=np.int64)
    response: Complex = summed(each_at_arrival(profiles, move, poles) * weights, move)[0]
    return response


def worst_in_bands(
    profiles: Profiles, weights: Array, modes: Modes
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The worst that any mode keeps where its frequency is off by any share within `BANDS`.

    Parameters
    ----------
    profiles, weights
        As in `arrival_response`.
    modes : Modes
        The modes; the lines of a spectrum are off by the same share.

    Returns
    -------
    displacement, acceleration : tuple of float
        One of each for each band. [mm], [mm/s^2]
    """
    worst = np.zeros((2, len(BANDS)))
    for entry in range(len(modes.modes)):
        index = np.flatnonzero(modes.group == entry)
        if not weights[:, index].any():
            continue
        relative = _relative(profiles, modes.poles[index])
        poles = np.outer(relative, modes.poles[index]).ravel()
        every = np.tile(index, len(relative))
        D = np.abs(arrival_response(profiles, weights[:, every], poles)) / poles.imag
        displacement = grouped(D, np.repeat(np.arange(len(relative)), len(index)))
        # As `Modes.accelerations` states them, at a frequency that is off by the share.
        omega = 2.0 * np.pi * modes.modes[entry].frequency * relative
        for quantity, values in enumerate((displacement, displacement * omega**2)):
            square = values**2
            for k, band in enumerate(BANDS):
                worst[quantity, k] = max(worst[quantity, k], _peak(square, band))
    return tuple(worst[0].tolist()), tuple(worst[1].tolist())


def _relative(profiles: Profiles, poles: Complex) -> Array:
    """Relative frequencies at which a band is looked at; the bands' ends are among them.

    The square of a residual, as a function of omega T, has no faster part than cos(omega T): a
    parabola through three points `DENSE` apart in omega T/2 is right to 1e-4.
    """
    phase = 0.5 * max(BANDS) * float(np.abs(poles).max()) * float(profiles.total.max())
    half = 2 * max(int(np.ceil(0.5 * phase / DENSE)), 1)
    return np.linspace(1.0 - max(BANDS), 1.0 + max(BANDS), 2 * half + 1)


def _peak(square: Array, band: float) -> float:
    """Root of the largest value within a band, between the points by parabolas."""
    half = len(square) // 2
    inner = round(half * band / max(BANDS))
    low, high = half - inner, half + inner
    best = float(square[low : high + 1].max())
    k = np.arange(max(low, 1), min(high, 2 * half - 1) + 1)
    k = k[(square[k] >= square[k - 1]) & (square[k] >= square[k + 1])]
    left, here, right = square[k - 1], square[k], square[k + 1]
    slope, curvature = 0.5 * (right - left), left - 2.0 * here + right
    # Level ground has its points for a peak; the parabola of an end's point is left outside.
    offset = np.divide(-slope, curvature, out=np.zeros_like(slope), where=curvature < 0.0)
    offset = np.clip(offset, np.where(k == low, 0.0, -0.5), np.where(k == high, 0.0, 0.5))
    tops = here + slope * offset + 0.5 * curvature * offset**2
    return float(np.sqrt(np.max(tops, initial=best)))
