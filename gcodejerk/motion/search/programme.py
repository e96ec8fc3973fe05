r"""A move as unknowns and rows: what every programme that looks for its optimum consists of.

This module owns the columns of a programme and what has to hold of them. Sought are jerks
:math:`j_i`, constant within blocks of whole intervals, with

* rest at both ends and the given length (linear equations),
* :math:`|j| \le J`, :math:`|a| \le A` and :math:`0 \le v \le V` (linear inequalities; v is a
  parabola within a block, so its control point is held in the bounds besides its ends).

What is to be least, and who solves it, `socp` and `cutting` decide.

Rule: times are in units of the move's duration and residuals in units of one that matters, such as
today's, so that the solver sees numbers near 1 and equal problems are equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import grouped

if TYPE_CHECKING:
    from scipy import sparse

Index = NDArray[np.int64]

AT_ONCE = 128
"""Rows that are computed together."""
MARGIN = 2e-6
"""Share of each limit that is left unused, so that the solver's rounding stays within it."""


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """One move, its duration taken as the unit of time.

    Attributes
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks of constant jerk, from 0 to T_SUM. [intervals]
    velocity, acceleration, jerk : float
        Limits, times T_SUM, T_SUM^2 and T_SUM^3 over the length. [-]
    rows : ndarray, shape (n, k)
        What a unit jerk in each block leaves: displacements, real and imaginary part or what else
        squares add up of, each over a measure that is common to all. [-]
    group : ndarray of int, shape (r,)
        Rows of the same group, side by side, count together: the root of their squares' sum.
    cap : ndarray, shape (g,)
        What a group may leave; NaN: it is of those whose largest is made least. [-]
    near, share : ndarray of int and of float, shape (r, 4), optional
        What counts are sums of four `rows` each, times these; without them, the rows themselves.
    mirrored : bool
        The acceleration is odd about the middle; so must the knots be.
    cruise : bool
        The block in the middle has no acceleration.
    """

    knots: Index
    velocity: float
    acceleration: float
    jerk: float
    rows: Array
    group: Index
    cap: Array
    near: Index | None = None
    share: Array | None = None
    mirrored: bool = False
    cruise: bool = False

    def seen(self, rows: Array) -> Array:
        """What counts of what `rows` say, shape (n, ...), for each row of a group, (r, ...)."""
        if self.near is None or self.share is None:
            return rows
        if rows.ndim == 1:
            seen: Array = np.einsum("rk,rk->r", self.share, rows.take(self.near))
            return seen
        seen = self.share[:, :1] * rows[self.near[:, 0]]
        for k in range(1, self.near.shape[1]):
            seen += self.share[:, k, np.newaxis] * rows[self.near[:, k]]
        return seen

    @property
    def fast(self) -> bool:
        """Whether the velocity can be in the way.

        Half of the time at full acceleration reaches no more than half of it.
        """
        return self.velocity < 0.5 * self.acceleration


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What the solver found for a move.

    Attributes
    ----------
    jerk : ndarray, shape (k,)
        Of each block, for the unit length in the unit of time. [-]
    worst : float
        Largest residual over the groups without a cap; of moves that go together, of all. [-]
    peak : float
        Largest jerk as a share of its limit. [-]
    curved : bool
        The velocity had to be held between the knots, too.
    """

    jerk: Array
    worst: float
    peak: float
    curved: bool


class Rows:
    """Rows of ``matrix x + s = bound`` as they are added, s being in the cone of each row."""

    def __init__(self) -> None:
        self.count = 0
        self.entries: list[tuple[Index, Index, Array]] = []
        self.bounds: list[Array] = []

    def add(self, terms: list[tuple[Any, Any]], bound: Any) -> None:
        """As many rows as the terms' columns (a number is one) have entries; maybe none."""
        if any(np.size(column) == 0 for column, _ in terms):
            return
        count = max([1, *(np.size(column) for column, _ in terms)])
        row = self.count + np.arange(count)
        for column, value in terms:
            columns = np.broadcast_to(np.asarray(column, dtype=np.int64), count)
            self.entries.append((row, columns, np.broadcast_to(np.asarray(value, float), count)))
        self.bounds.append(np.broadcast_to(np.asarray(bound, float), count))
        self.count += count

    def dense(self, values: Array, columns: Index) -> None:
        """Rows of values, shape (r, c), in all of these columns; the bound is 0."""
        count = len(values)
        row = np.repeat(self.count + np.arange(count), len(columns))
        self.entries.append((row, np.tile(columns, count), values.ravel()))
        self.bounds.append(np.zeros(count))
        self.count += count

    def assembled(self, width: int) -> tuple[sparse.csc_matrix, Array]:
        """The matrix and the bounds; entries of column -1, which stands for zero, fall away."""
        from scipy import sparse

        row, column, value = (np.concatenate(part) for part in zip(*self.entries, strict=True))
        used = column >= 0
        shape = (self.count, width)
        matrix = sparse.csc_matrix((value[used], (row[used], column[used])), shape=shape)
        return matrix, np.concatenate(self.bounds)


@dataclass(frozen=True, slots=True, eq=False)
class Responses:
    """What unknown accelerations do to the rows of a problem.

    The acceleration of a knot is a jerk in the block before it, and its contrary behind. As one
    matrix this would be as large as the rows once more; what is asked of it is next to nothing.

    Attributes
    ----------
    rows : ndarray, shape (n, k + 1)
        What a unit jerk does in each of the blocks that count.
    per_time : ndarray, shape (k + 1,)
        The jerk in each for a unit of the acceleration at its end.
    count : int
        Unknowns.
    folds : bool
        The knots behind the middle have them, too, with the other sign.
    """

    rows: Array
    per_time: Array
    count: int
    folds: bool

    def of(self, a: Array) -> Array:
        """What these accelerations do, shape (n,)."""
        if self.folds:
            between = np.zeros(len(self.per_time) - 1 - 2 * self.count)
            a = np.concatenate([a, between, -a[::-1]])
        seen: Array = self.rows @ (self.per_time * np.diff(a, prepend=0.0, append=0.0))
        return seen

    def to(self, rows: Array | None = None) -> Array:
        """Rows of the blocks, all of them unless given, as rows of the unknowns, (r, count)."""
        rows = self.rows if rows is None else rows
        seen: Array = rows[:, :-1] * self.per_time[:-1]
        # Some rows at a time: all of them are new memory once more, which costs more than the sum.
        for first in range(0, len(seen), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            seen[some] -= rows[some, 1:] * self.per_time[1:]
        if self.folds:
            seen = (seen - seen[:, ::-1])[:, : self.count]
        return seen


class Unknowns:
    """Acceleration and velocity at every knot, and the peak jerk as a share of its limit.

    Columns of the matrix, from `begin` to `end`, behind which that of the residual follows, or the
    next move's; -1 stands for what is zero: rest at both ends. Of a mirrored profile (braking is
    the acceleration in reverse) the second half of the knots are images of the first.
    """

    def __init__(self, problem: Problem, begin: int = 0) -> None:
        self.problem = problem
        knots, blocks = problem.knots, len(problem.knots) - 1
        self.h = np.diff(knots) / knots[-1]
        self.odd = problem.mirrored
        k = np.arange(blocks + 1)
        image = np.minimum(k, blocks - k) if self.odd else k
        self.sign = np.sign(blocks - 2 * k) if self.odd else np.ones(blocks + 1, dtype=np.int64)
        self.speeds = blocks // 2 if self.odd else blocks - 1
        slopes = (blocks - 1) // 2 - problem.cruise if self.odd else blocks - 1
        zero = (k == 0) | (k == blocks)
        self.v = begin + np.arange(self.speeds)
        self.a = begin + self.speeds + np.arange(slopes)
        self.at_v = np.where(zero, -1, begin + image - 1)
        zero |= (self.sign == 0) | (image > slopes)
        self.at_a = np.where(zero, -1, begin + self.speeds + image - 1)
        # The blocks that are not images of others.
        self.own = slice(0, (blocks + 1) // 2 if self.odd else blocks)
        self.peak = begin + self.speeds + slopes
        self.end = self.peak + 1

    def motion(self, rows: Rows) -> None:
        """The velocity is the acceleration's integral, and its own is the length."""
        h, a, v = self.h, self.at_a, self.at_v
        own = slice(0, len(h) // 2 if self.odd else len(h))
        half = 0.5 * h[own]
        end, begin = (a[1:][own], -half), (a[:-1][own], -half)
        rows.add([(v[1:][own], 1.0), (v[:-1][own], -1.0), end, begin], 0.0)
        before, after = np.append(h, 0.0), np.insert(h, 0, 0.0)
        # Over a block: v h + (2 a + a') h^2 / 6, a' being the acceleration at its end.
        columns = np.concatenate([v, a])
        values = np.concatenate([before, self.sign * (before**2 / 3.0 + after**2 / 6.0)])
        used = columns >= 0
        rows.dense(values[np.newaxis, used], columns[used])
        rows.bounds[-1] = np.ones(1)

    def limits(self, rows: Rows, curved: bool) -> None:
        """Jerk, acceleration and velocity within their limits, at every knot.

        `curved`: and between them, where the velocity is a parabola.
        """
        problem, h, a, sign, own = self.problem, self.h, self.at_a, self.sign, self.own
        usable = 1.0 - MARGIN
        for side in (1.0, -1.0):
            share = side / (h[own] * problem.jerk)
            end, begin = (a[1:][own], share * sign[1:][own]), (a[:-1][own], -share)
            rows.add([end, begin, (self.peak, -1.0)], 0.0)
            if np.isfinite(problem.acceleration):
                rows.add([(self.a, side)], problem.acceleration * usable)
        rows.add([(self.peak, 1.0)], usable)
        # v and the control point of the parabola, v + a h / 2, which lies above or below it.
        every = [[(self.v, 1.0)]]
        if curved:
            behind = 0.5 * h[1 : self.speeds + 1]
            every.append([(self.v, 1.0), (a[1 : self.speeds + 1], behind)])
        for terms in every:
            rows.add([(column, -np.asarray(value)) for column, value in terms], 0.0)
            if problem.fast:
                rows.add(terms, problem.velocity * usable)

    def keeps_velocity(self, jerk: Array) -> bool:
        """Whether the velocity of a solution stays within its bounds between the knots, too."""
        gained = np.cumsum(jerk * self.h)
        a = np.concatenate([[0.0], gained[:-1]])
        v = np.cumsum(a * self.h + 0.5 * jerk * self.h**2)
        control = np.concatenate([[0.0], v[:-1]]) + 0.5 * a * self.h
        small = MARGIN * np.abs(v).max(initial=0.0)
        return bool(control.min() >= -small and control.max() <= self.problem.velocity + small)

    def responses(self, unit: float = 1.0) -> Responses:
        """What accelerations in this unit do to the rows of the problem."""
        per_time, rows = unit / self.h, self.problem.rows
        folds = self.odd and self.problem.cruise
        if self.odd and not folds:
            # Blocks and their images say the same: the folded sum is twice that of the first half.
            per_time, rows = 2.0 * per_time[: len(self.a) + 1], rows[:, : len(self.a) + 1]
        return Responses(rows, per_time, len(self.a), folds)

    def accelerations(self, x: Array) -> Array:
        """The acceleration at every knot."""
        a: Array = self.sign * np.append(x, 0.0)[np.where(self.at_a < 0, len(x), self.at_a)]
        return a

    def mended(self, x: Array, null: bool) -> Array:
        """The jerk in each block, mended to the last digit where it must be exact."""
        problem = self.problem
        jerk = np.diff(self.accelerations(x)) / self.h
        # Rest and length: what a jerk does to acceleration, velocity and position at the end.
        ends = np.stack(_moments(self.h))
        exact = np.concatenate([ends, problem.seen(problem.rows)]) if null else ends
        correction = self._correction(jerk, exact)
        if np.abs(correction).max() > MARGIN * problem.jerk:
            # Nulls at frequencies side by side are nearly the same equation: not to the last digit.
            correction = self._correction(jerk, ends)
        mended: Array = jerk + correction
        return mended

    def _correction(self, jerk: Array, exact: Array) -> Array:
        """The least change of the jerk that makes rows exact: 0, but for the third, the length."""
        missing: Array = -(exact @ jerk)
        missing[2] += 1.0
        if self.odd:
            # Seen in reverse they say the same, and keep the correction even.
            exact, missing = np.concatenate([exact, exact[:, ::-1]]), np.tile(missing, 2)
        correction = np.linalg.lstsq(exact, missing, rcond=None)[0]
        return np.asarray(correction, dtype=np.float64)


def solutions(moves: Sequence[Unknowns], x: Array, curved: bool, null: bool) -> list[Solution]:
    """The solver's answer for each move, and what they leave together."""
    jerks = [move.mended(x, null) for move in moves]
    left = np.zeros(len(moves[0].problem.group))
    for move, jerk in zip(moves, jerks, strict=True):
        left += move.problem.seen(move.problem.rows @ jerk)
    problem = moves[0].problem
    each = grouped(np.abs(left), problem.group)
    worst = float(each[np.isnan(problem.cap)].max(initial=0.0))
    return [
        Solution(jerk, worst, float(x[move.peak]), curved)
        for move, jerk in zip(moves, jerks, strict=True)
    ]


def _moments(h: Array) -> tuple[Array, Array, Array]:
    """What a unit jerk in each block adds to acceleration, velocity and position at the end."""
    left = 1.0 - np.cumsum(h)
    return h, h * (left + 0.5 * h), h * (0.5 * left**2 + 0.5 * left * h + h**2 / 6.0)
