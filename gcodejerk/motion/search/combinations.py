r"""Every combination of switching times on a grid: where a search for ramps begins.

This module owns the first look at a move's symmetric profiles, thousands of them. The ramp of a
profile ends its parts at three times. What the ends of a ramp leave of a mode is computed once for
every time of the grid and every frequency. All that combinations need of it are products of what
two of the times leave, summed over the frequencies: a square of a sum is made of them, in a few
operations a combination, however many frequencies there are.

Rule 1: combinations are compared by the sum of all squares. It is near enough to the largest to
find the valleys; which of these is deepest, the search looks at.
Rule 2: no move knows another. Moves stand side by side in memory, so that all are computed alike.
"""

from __future__ import annotations

from dataclasses import dataclass

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
MOVES = 128
"""Moves at a time: of what ends at one time, some arrays stay in the processor's cache."""
NUMBERED = 1 << 10
"""Pairs of ends have numbers below this. They take the place of the last digits of what a pair
leaves, of which 13 binary ones remain: so the least of them tells which it was."""
LARGEST = int(np.iinfo(np.int32).max)
"""No sign: what is not a number is larger than any."""


def best_combinations(
    times: Array, total: Array, limits: tuple[Array, Array, Array], objective: Objective,
    interval: float,
) -> tuple[Array, Array, Array]:  # fmt: skip
    r"""For each T1, the ramp whose other parts end at times of a grid and that leaves the least.

    Parameters
    ----------
    times : ndarray, shape (k, n)
        For each of n moves, ascending; none is below the interval or above T_SUM/2. Of k times,
        the pairs are fewer than `NUMBERED`. [s]
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
    T1, Ta, T2 : ndarray, shape (k - 1, n)
        T1 is one of the times, all but the last. Where no combination keeps the limits, one that
        does not; to single precision all of them are kept. [s]

    Notes
    -----
    With the ends :math:`t_1 \le t_2 < t_3` of the parts, a ramp's area is :math:`(t_2 + t_3 -
    t_1)/2` and its moment :math:`(t_2^2 + t_2 t_3 + t_3^2 - t_1^2)/6`: so all that limits ask for
    is a number of the pair of ends beside a number of T1.
    """
    k, n = times.shape
    chosen = np.empty((k - 1, n), dtype=np.int32)
    for begin in range(0, n, MOVES):
        part = slice(begin, begin + MOVES)
        own = times[:, part], total[part], [limit[part] for limit in limits]
        ends = _Ends.of(own[0], own[1], objective.take(part))
        chosen[:, part] = _best(*own, ends, interval)
    second, third = np.triu_indices(k, 1)
    T1, t2 = times[:-1], np.take_along_axis(times, second[chosen], axis=0)
    return T1, np.maximum(t2 - T1, 0.0), np.take_along_axis(times, third[chosen], axis=0) - t2


@dataclass(frozen=True, slots=True, eq=False)
class _Ends:
    r"""What the ends of parts leave, all modes together, for a peak acceleration of 1.

    With :math:`u_i` what a unit step of the jerk at time i leaves, one number or two for each
    frequency, a part between i and j leaves :math:`(u_i - u_j)/(t_j - t_i)`.

    Attributes
    ----------
    first : ndarray, shape (k - 1, n)
        Square of what the part leaves that begins with the move and ends at a time: T1.
    last : ndarray, shape (k, k, n)
        Square of what the part between two times leaves: T2.
    both : ndarray, shape (k - 1, k, n)
        The first part by what a step at a time leaves, twice.
    fall : ndarray, shape (k, k, n)
        One over the time between two times; 0 for the same, which are no pair. [1/s]
    still : ndarray of bool, shape (n,)
        Moves that excite nothing.
    """

    first: Single
    last: Single
    both: Single
    fall: Single
    still: NDArray[np.bool_]

    @classmethod
    def of(cls, times: Array, total: Array, objective: Objective) -> _Ends:
        """Of the times of moves, shape (k, n)."""
        sigma, omega = (x.astype(np.float32) for x in (-objective.poles.real, objective.poles.imag))
        x = np.ascontiguousarray(times.T)
        every = np.insert(x, 0, 0.0, axis=1)[..., np.newaxis]
        rest = (total[:, np.newaxis, np.newaxis] - every).astype(np.float32)
        # Whatever a move weighs: squares stay far from the least that single precision knows.
        weight = step_weights(objective).T[:, np.newaxis].copy()
        most = weight.max(axis=2, keepdims=True, initial=0.0)
        weight /= np.where(most > 0.0, most, np.float32(1.0))
        damped = sigma if sigma.any() else None
        parts = from_middle(every.astype(np.float32), rest, damped, omega)
        step = np.concatenate([part * weight for part in parts if part is not None], axis=2)
        # In double precision: what follows are differences of nearly equal products.
        step = step.astype(np.float64)
        products = step @ step.swapaxes(1, 2)
        own = np.einsum("nii->ni", products)
        first = own[:, :1] + own[:, 1:-1] - 2.0 * products[:, 0, 1:-1]
        last = products[:, 1:, 1:] * -2.0
        last += own[:, 1:, np.newaxis]
        last += own[:, np.newaxis, 1:]
        rise, between = 1.0 / x[:, :-1], x[:, np.newaxis] - x[..., np.newaxis]
        fall = np.divide(1.0, between, out=np.zeros_like(between), where=between != 0.0)
        first *= rise * rise
        last *= fall
        last *= fall
        both = products[:, :1, 1:] - products[:, 1:-1, 1:]
        both *= 2.0 * rise[..., np.newaxis]
        first, last, both, fall = (
            np.moveaxis(column.astype(np.float32), 0, -1).copy()
            for column in (first, last, both, fall)
        )
        return cls(first, last, both, fall, np.logical_not(objective.weights.any(axis=1)))


def _best(
    times: Array, total: Array, limits: list[Array], ends: _Ends, interval: float
) -> NDArray[np.int32]:
    """The number of the best pair for each T1, shape (k - 1, n); times are over T_SUM."""
    x, least = times / total, interval * (1.0 - ROUNDING) / total
    V, A, J = (limit * total**power for power, limit in enumerate(limits, 1))
    v, a, j = (V * MORE).astype(np.float32), A.astype(np.float32), J.astype(np.float32)
    second, third = np.triu_indices(len(x), 1)
    single, lasts, cruise = x.astype(np.float32), x[third] - x[second], 1.0 - 2.0 * x[third]
    t1, t2, t3, T2 = single[:-1], single[second], single[third], lasts.astype(np.float32)
    numbers = np.arange(len(third), dtype=np.int32)[:, np.newaxis]
    best = np.full(t1.shape, LARGEST, dtype=np.int32)
    still = ends.still if ends.still.any() else None
    # A part of no length is impossible, whatever comes of it where nothing limits the jerk.
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        # One over the acceleration is the length of a pair less that of T1.
        length = (HALF - t1 * THIRD) * t1
        rises, faster = FEWER / (j * t1), v * length - t1 * HALF
        sums = (t2 + t3) * HALF
        lengths = sums - (t2 * t2 + t3 * (t2 + t3)) * THIRD
        falls, fast = FEWER / np.minimum(a, j * T2), v * lengths - sums
        falls[(least > lasts) | ((cruise >= NONE) & (cruise < least))] = np.inf
        behind = 0
        for end in range(len(x) - 1):
            # The constant part ends here, the falling one at each later time.
            first, last = slice(0, end + 1), slice(end + 1, None)
            pairs = slice(behind, behind + len(x) - 1 - end)
            behind = pairs.stop
            # Where the first part ends there is no constant one.
            own = np.where(x[end] < x[:end] + least, np.float32(np.inf), rises[:end])
            own = np.concatenate([own, rises[end : end + 1]])
            longer = lengths[pairs] - length[first, np.newaxis]
            keeps = longer >= np.maximum(falls[pairs], own[:, np.newaxis])
            keeps &= fast[pairs] >= faster[first, np.newaxis]
            left = ends.both[first, last] - ends.both[first, end, np.newaxis]
            left *= ends.fall[end, last]
            left += ends.last[end, last]
            left += ends.first[first, np.newaxis]
            np.maximum(left, TINY, out=left)
            if still is not None:
                # Where nothing vibrates the lowest jerk is the best.
                jerk = np.maximum(longer, TINY) / np.minimum(t1[first, np.newaxis], T2[pairs])
                left = np.where(still, jerk, left)
            longer *= keeps
            longer *= longer
            left /= longer
            code = left.view(np.int32)
            code &= LARGEST - (NUMBERED - 1)
            code |= numbers[pairs]
            np.minimum(best[first], code.min(axis=1), out=best[first])
    best &= NUMBERED - 1
    return best
