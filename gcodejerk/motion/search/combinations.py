r"""Every combination of switching times on a grid: where a search for ramps begins.

This module owns the first look at a move's symmetric profiles, thousands of them. The ramp of a
profile ends its parts at three times; what each of them does to a mode is computed once for every
time of the grid and every frequency, and a combination of three is a sum. So a combination costs
half a dozen operations a frequency where a profile by itself costs fifty.

Rule: as in `candidates`, magnitudes only, squared, in single precision.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.candidates import Single, from_middle, step_weights
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING


@cache
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Ends of constant and of falling acceleration, and where those begin that are not before k."""
    second, third = np.triu_indices(count, 1)
    return second, third, np.searchsorted(second, np.arange(count - 1))


def best_combinations(
    times: Array, total: Array, limits: tuple[Array, Array, Array], objective: Objective,
    interval: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    r"""For each T1, the ramp whose other parts end at times of a grid and that leaves the least.

    Parameters
    ----------
    times : ndarray, shape (n, k)
        For each of n moves, ascending; none is below the interval or above T_SUM/2. [s]
    total : ndarray, shape (n,)
        T_SUM. [s]
    limits : tuple of ndarray, shape (n,)
        Velocity, acceleration and jerk of the unit profile. [1/s], [1/s^2], [1/s^3]
    objective : Objective
        Of n moves.
    interval : float
        Command interval, the least duration of a segment. [s]

    Returns
    -------
    T1, Ta, T2 : ndarray, shape (n, k - 1)
        T1 is one of the times, all but the last. Meaningless where no combination keeps the
        limits. [s]

    Notes
    -----
    With the ends :math:`t_1 \le t_2 < t_3` of the parts, a ramp's area is :math:`(t_2 + t_3 -
    t_1)/2` and its moment :math:`(t_2^2 + t_2 t_3 + t_3^2 - t_1^2)/6`.
    """
    n, k = times.shape
    second, third, begin = _pairs(k)
    T, (V, A, J) = total[:, np.newaxis], (limit[:, np.newaxis] for limit in limits)
    least = interval * (1.0 - ROUNDING)
    t2, t3 = times[:, second], times[:, third]
    T2, Tv = t3 - t2, T - 2.0 * t3
    sums, squares = t2 + t3, t2 * t2 + t2 * t3 + t3 * t3
    most = np.where((least <= T2) & (_none(Tv, T) | (Tv >= least)), np.minimum(A, J * T2), 0.0)
    ends = _Ends(times, total, objective)
    still = ~objective.weights.any(axis=1, keepdims=True)
    chosen = np.empty((n, k - 1), dtype=np.intp)
    for first, start in enumerate(begin):
        t1 = times[:, first, np.newaxis]
        area = 0.5 * (sums[:, start:] - t1)
        # One over the acceleration.
        length = area * T - (squares[:, start:] - t1 * t1) / 3.0
        Ta = t2[:, start:] - t1
        keeps = (length * np.minimum(most[:, start:], J * t1) >= 1.0) & (area <= V * length)
        keeps &= _none(Ta, T) | (Ta >= least)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            left = ends.squared(first, start) / (length * length)
            # Where nothing vibrates the lowest jerk is the best.
            left = np.where(still, 1.0 / (length * np.minimum(t1, T2[:, start:])), left)
        left = np.where(keeps, left, np.inf)
        chosen[:, first] = start + left.argmin(axis=1)
    row = np.arange(n)[:, np.newaxis]
    T1 = times[:, :-1]
    return T1, np.maximum(t2[row, chosen] - T1, 0.0), T2[row, chosen]


def _none(duration: Array, total: Array) -> NDArray[np.bool_]:
    """Whether a segment is not there at all."""
    there: NDArray[np.bool_] = duration < 1e-12 * total
    return there


class _Ends:
    """What ramps leave whose parts end at times of a grid, for a peak acceleration of 1."""

    def __init__(self, times: Array, total: Array, objective: Objective) -> None:
        second, third, _ = _pairs(times.shape[1])
        poles = objective.poles[:, np.newaxis, np.newaxis]
        sigma, omega = (x.astype(np.float32) for x in (-poles.real, poles.imag))
        every = np.insert(times, 0, 0.0, axis=1)
        rest = (total[:, np.newaxis] - every).astype(np.float32)
        weight = step_weights(objective)[..., np.newaxis]
        rise = (1.0 / times).astype(np.float32)
        with np.errstate(divide="ignore"):
            fall = (1.0 / (times[:, third] - times[:, second])).astype(np.float32)
        # Two ends at the same time are no pair: what they leave does not count.
        fall = np.where(np.isfinite(fall), fall, np.float32(0.0))
        self.rising, self.falling = [], []
        for part in from_middle(every.astype(np.float32), rest, sigma, omega):
            if part is None:
                continue
            at = part[..., 1:] * weight
            self.rising.append((part[..., :1] * weight - at) * rise)
            self.falling.append((at[..., second] - at[..., third]) * fall)
        starts = np.flatnonzero(np.diff(objective.group, prepend=-1))
        self.starts = starts if len(starts) < len(objective.group) else None

    def squared(self, first: int, start: int) -> Single:
        """The largest square, of T1 at one of the times and all pairs of ends from `start` on."""
        parts = [
            falling[..., start:] - rising[..., first, np.newaxis]
            for rising, falling in zip(self.rising, self.falling, strict=True)
        ]
        together = parts[0] * parts[0]
        for part in parts[1:]:
            together += part * part
        if self.starts is not None:
            together = np.add.reduceat(together, self.starts, axis=0)
        largest: Single = together.max(axis=0, initial=0.0)
        return largest
