r"""Every combination of switching times on a grid: where a search for ramps begins.

This module owns the first look at a move's symmetric profiles, thousands of them. The ramp of a
profile ends its parts at three times. What T1 does to a mode is computed once for every T1 of the
grid and every frequency, and so is what a pair of the other two does; a combination leaves their
difference. What all frequencies together keep is then a product of two matrices: two operations a
combination and frequency, where a profile by itself costs fifty.

Rule 1: combinations are compared by the sum of all squares. It is near enough to the largest to
find the valleys; which of these is deepest, the search looks at.
Rule 2: no row knows another, and none is multiplied together with another.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.candidates import Single, from_middle, step_weights
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING

FEWER, MORE = np.float32(1.0 - 1e-6), np.float32(1.0 + 1e-6)
"""Tolerances on limits, for the rounding of single precision."""
HALF, THIRD = np.float32(0.5), np.float32(1.0 / 3.0)
NONE = 1e-12
"""What is shorter, times T_SUM, is not there at all."""
TINY = np.float32(1e-30)
"""Less than any square that counts: the rest divided by it is no number beside a length of zero."""
PRODUCT = 250_000
"""Multiplications of a product of matrices at most: larger ones are shared out to threads, which
costs more than it gains."""
ROWS = 32
"""Moves at a time."""
SHRUNK = 0.4
"""Values of T1 are taken together as long as the last has this share of the pairs of the first."""


@cache
def _pairs(count: int) -> tuple[NDArray[np.intp], NDArray[np.intp], list[tuple[int, int, int]]]:
    """Ends of constant and of falling acceleration; and which values of T1 are taken together.

    Of these: the first, behind the last, and the first pair that does not end before the first.
    """
    second, third = np.triu_indices(count, 1)
    begin = np.searchsorted(second, np.arange(count))
    left = len(second) - begin
    together, first = [], 0
    while first < count - 1:
        behind = first + 1
        while behind < count - 1 and left[behind] >= SHRUNK * left[first]:
            behind += 1
        together.append((first, behind, int(begin[first])))
        first = behind
    return second, third, together


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
        T1 is one of the times, all but the last. Where no combination keeps the limits, one that
        does not; to single precision all of them are kept. [s]

    Notes
    -----
    With the ends :math:`t_1 \le t_2 < t_3` of the parts, a ramp's area is :math:`(t_2 + t_3 -
    t_1)/2` and its moment :math:`(t_2^2 + t_2 t_3 + t_3^2 - t_1^2)/6`: so all that limits ask for
    is a number of the pair of ends beside a number of T1.
    """
    n, k = times.shape
    second, third, _ = _pairs(k)
    chosen = np.empty((n, k - 1), dtype=np.intp)
    for begin in range(0, n, ROWS):
        part = slice(begin, begin + ROWS)
        own = _Combinations(
            times[part], total[part], tuple(limit[part] for limit in limits),
            objective.take(part), interval,
        )  # fmt: skip
        chosen[part] = own.best()
    row = np.arange(n)[:, np.newaxis]
    T1, t2 = times[:, :-1], times[row, second[chosen]]
    return T1, np.maximum(t2 - T1, 0.0), times[row, third[chosen]] - t2


class _Combinations:
    """Some moves, shape (n, pairs) or (n, T1); times and what follows from them are over T_SUM."""

    def __init__(
        self, times: Array, total: Array, limits: tuple[Array, ...], objective: Objective,
        interval: float,
    ) -> None:  # fmt: skip
        self.count = times.shape[1]
        second, third, _ = _pairs(self.count)
        T = total[:, np.newaxis]
        V, A, J = (limit[:, np.newaxis] * T**k for k, limit in enumerate(limits, 1))
        x, least = times / T, interval * (1.0 - ROUNDING) / T
        begin, end = np.take(x, second, axis=1), np.take(x, third, axis=1)
        cruise = 1.0 - 2.0 * end
        impossible = (least > end - begin) | ((cruise >= NONE) & (cruise < least))
        t1 = x[:, :-1].astype(np.float32)
        t2, t3, T2 = (numbers.astype(np.float32) for numbers in (begin, end, end - begin))
        v, a, j, later = (numbers.astype(np.float32) for numbers in (V, A, J, least))
        sums = (t2 + t3) * HALF
        # One over the acceleration is the difference of the two.
        self.length = sums - (t2 * t2 + t3 * (t2 + t3)) * THIRD, (HALF - t1 * THIRD) * t1
        # A part of no length is impossible, whatever comes of it where nothing limits the jerk.
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            shortest = FEWER / np.minimum(a, j * T2)
            self.shortest = shortest, FEWER / (j * t1)
        shortest[impossible] = np.inf
        # Area and velocity, which must be no more than V.
        v *= MORE
        self.faster = v * self.length[0] - sums, v * self.length[1] - t1 * HALF
        self.later = t2, t1 + later
        self.still = np.logical_not(objective.weights.any(axis=1, keepdims=True))[:, 0]
        self.jerk = t1, T2
        self._ends(times, total, objective)

    def _ends(self, times: Array, total: Array, objective: Objective) -> None:
        """What each end of a part leaves of every mode, for a peak acceleration of 1."""
        second, third, _ = _pairs(self.count)
        poles = objective.poles
        sigma, omega = (x.astype(np.float32) for x in (-poles.real, poles.imag))
        every = np.insert(times, 0, 0.0, axis=1)[..., np.newaxis]
        rest = (total[:, np.newaxis, np.newaxis] - every).astype(np.float32)
        # Whatever a move weighs: squares stay far from the least that single precision knows.
        weight = step_weights(objective).T[:, np.newaxis].copy()
        most = weight.max(axis=2, keepdims=True, initial=0.0)
        weight /= np.where(most > 0.0, most, np.float32(1.0))
        both = from_middle(every.astype(np.float32), rest, sigma, omega)
        at = np.concatenate([part * weight for part in both if part is not None], axis=2)
        n, width = len(times), at.shape[2]
        first = np.empty((n, self.count - 1, width + 2), dtype=np.float32)
        pair = np.empty((n, len(second), width + 2), dtype=np.float32)
        with np.errstate(divide="ignore"):
            rise = (1.0 / times[:, :-1]).astype(np.float32)
            fall = (1.0 / (times[:, third] - times[:, second])).astype(np.float32)
        # Two ends at the same time are no pair: what they leave does not count.
        fall = np.where(np.isfinite(fall), fall, np.float32(0.0))
        rising, falling = first[..., :width], pair[..., :width]
        np.subtract(at[:, :1], at[:, 1:-1], out=rising)
        rising *= rise[..., np.newaxis]
        begin = 0
        for end in range(1, self.count):
            behind = begin + self.count - end
            np.subtract(at[:, end, np.newaxis], at[:, end + 1 :], out=falling[:, begin:behind])
            begin = behind
        falling *= fall[..., np.newaxis]
        # The square of a difference, summed over all: -2 first pair + first^2 + pair^2.
        first[..., width], pair[..., width] = (rising * rising).sum(axis=2), 1.0
        first[..., width + 1], pair[..., width + 1] = 1.0, (falling * falling).sum(axis=2)
        rising *= np.float32(-2.0)
        self.first, self.pair = first, pair.swapaxes(1, 2)

    def best(self) -> NDArray[np.intp]:
        """The best pair for each T1, shape (n, T1)."""
        n, k = len(self.still), self.count
        chosen = np.empty((n, k - 1), dtype=np.intp)
        for first, behind, start in _pairs(k)[2]:
            own = slice(first, behind)
            length = _beside(np.subtract, self.length, own, start)
            keeps = length >= _beside(np.maximum, self.shortest, own, start)
            keeps &= _beside(np.greater_equal, self.faster, own, start)
            later = _beside(np.greater_equal, self.later, own, start)
            for row, t1 in enumerate(range(first, behind)):
                # Pairs that begin where T1 ends have no constant acceleration.
                before = (t1 - first) * (2 * k - 1 - t1 - first) // 2
                later[:, row, before : before + k - 1 - t1] = True
                later[:, row, :before] = False
            keeps &= later
            left = self._sum(own, start)
            length *= keeps
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                if self.still.any():
                    # Where nothing vibrates the lowest jerk is the best.
                    shorter = _beside(np.minimum, self.jerk[::-1], own, start)
                    left[self.still] = (np.maximum(length, TINY) / shorter)[self.still]
                length *= length
                left /= length
            chosen[:, own] = start + left.argmin(axis=2)
        return chosen

    def _sum(self, own: slice, start: int) -> Single:
        """The sum of all squares, and next to nothing, shape (n, T1, pairs)."""
        first, pair = self.first[:, own], self.pair[:, :, start:]
        together = np.empty((len(first), first.shape[1], pair.shape[2]), dtype=np.float32)
        width = max(1, PRODUCT // (first.shape[1] * first.shape[2]))
        for begin in range(0, pair.shape[2], width):
            part = slice(begin, begin + width)
            np.matmul(first, pair[:, :, part], out=together[:, :, part])
        np.maximum(together, TINY, out=together)
        return together


def _beside(function: np.ufunc, of: tuple[Any, Any], own: slice, start: int) -> Any:
    """A function of numbers of the pairs from `start` on, and of numbers of some values of T1."""
    pairs, first = of
    return function(pairs[:, np.newaxis, start:], first[:, own, np.newaxis])
