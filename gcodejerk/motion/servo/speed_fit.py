r"""Speeds at the knots of moves, straight lines between them, that follow given speeds best.

A control that changes its speed linearly within each block is told speeds at knots. This module
owns the choice of these speeds, for many moves at once: least squares on the speed of every
interval, with the length exact, the complex responses of the modes as wanted, and

- accelerations within a limit, speeds between a floor and a limit;
- each block only faster, only slower, or even, as wanted.

What is minimised is a sum of squares with linear rows and one-sided limits. Limits count as
penalties of their violation, far stiffer than the rest, so that the sum is convex and piecewise
quadratic: which limits hold is found by Newton's method (O. Mangasarian, Optimization Methods and
Software 17, 2002), one solution a step, all moves at once. Each is a symmetric tridiagonal system
for each move, as speeds touch their neighbours only, and a small dense one for the rows.
`scipy.optimize.lsq_linear` gives the same one move at a time (`tests/unit/test_servo.py`).

Speeds are in units of each move's mean speed, times in intervals.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.spline_filter import filter_gain

PENALTY = 1e7
"""Stiffness of a limit, against 1 of the speed of an interval."""
LENGTH_WEIGHT = 1e10
"""The same of the length."""
CELLS = 1 << 21
"""Numbers of right sides that are worked on at a time: 16 MB."""
ALIKE, FEW = 0.8, 32
"""Moves are worked on together whose knots are so many of the most there, and so many moves at
least."""
STEPS, HALVINGS = 40, 10
"""Of Newton's method, at most; nearly all moves need less than ten, and whole steps."""
SETTLED = 1e-9
"""Share of the sum that a shortened step has to gain for another one."""
NOTHING = 1e-13
"""The same of a whole step: what is just at its limit is held by one step and not by the next."""

FASTER, SLOWER, EVEN, ANY = 1, -1, 0, 2
"""What a block may be."""


@dataclass(frozen=True, slots=True, eq=False)
class Wanted:
    """What speeds have to do: columns of n moves, knots aligned at their end as in `Grid`.

    Attributes
    ----------
    knots : ndarray of int, shape (n, k)
        Since each move's start; zeros in front of it. [intervals]
    speeds : ndarray, shape (n, longest)
        Mean speed of each interval, aligned at the end. [of the mean]
    rise : ndarray, shape (n, k - 1)
        Change of speed over each block. [of the mean]
    length : ndarray, shape (n,)
        [of the mean speed times the duration]
    end_speed : ndarray, shape (n,)
        At the last knot; at the first it is 0. [of the mean]
    acceleration : ndarray, shape (n,)
        Limit. [of the mean, per interval]
    least, most : ndarray, shape (n,)
        Limits of the speed at all knots but the first and the last. [of the mean]
    kind : ndarray of int, shape (n, k - 1)
        FASTER, SLOWER, EVEN or ANY: of the block behind each knot but the last.
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]
    response : ndarray of complex, shape (n, m)
        Displacement that each is to keep behind the control's filter, of a move of length 1. [-]
    weight : ndarray, shape (n, m)
        Of each response; 0 where it may be anything. [-]
    stiffness : float
        Of a change of speed over a block, against 1 of the speed of an interval: so that responses
        are met by a slow correction, and not by one that goes to and fro from knot to knot. [-]
    interval : float
        [s]
    """

    knots: Counts
    speeds: Array
    rise: Array
    length: Array
    end_speed: Array
    acceleration: Array
    least: Array
    most: Array
    kind: NDArray[np.int64]
    poles: Complex
    response: Complex
    weight: Array
    stiffness: float
    interval: float

    def take(self, rows: NDArray[np.int64]) -> Wanted:
        """Some of the moves, without columns that are empty for all of them."""
        whole = ("poles", "stiffness", "interval")
        columns = (field.name for field in fields(self) if field.name not in whole)
        part = replace(self, **{name: getattr(self, name)[rows] for name in columns})
        blocks = int(np.count_nonzero(part.knots, axis=1).max(initial=0))
        # A row may begin with knots at 0: the last of these is the move's start.
        known, longest = self.knots.shape[1], self.speeds.shape[1]
        first, early = known - 1 - blocks, longest - int(part.knots[:, -1].max(initial=0))
        return replace(
            part,
            knots=part.knots[:, first:], rise=part.rise[:, first:], kind=part.kind[:, first:],
            speeds=part.speeds[:, early:],
        )  # fmt: skip


def fit_speeds(wanted: Wanted) -> Array:
    """Speeds at the knots.

    Parameters
    ----------
    wanted : Wanted
        n moves with k knots.

    Returns
    -------
    ndarray, shape (n, k)
        [of the mean]
    """
    out = np.zeros(wanted.knots.shape)
    count = np.count_nonzero(wanted.knots, axis=1)
    order, end = np.argsort(-count, kind="stable"), 0
    while end < len(order):
        most = int(count[order[end]]) + 1
        alike = int(np.count_nonzero(count[order] >= ALIKE * (most - 1)))
        size = max(1, CELLS // (most * (2 * len(wanted.poles) + 2)))
        # A few more knots cost less than another pass for a few moves.
        begin, end = end, min(max(alike, end + FEW), end + size, len(order))
        rows = order[begin:end]
        out[rows, -most:] = _Fit(wanted.take(rows)).solve()
    return out


class _Fit:
    """The sums of squares of many moves."""

    def __init__(self, wanted: Wanted) -> None:
        self.wanted = wanted
        knots = wanted.knots
        self.h = np.diff(knots, axis=1)
        self.on = self.h > 0
        self.fixed = knots == 0
        self.fixed[:, -1] = True
        self.ends = np.zeros(knots.shape)
        self.ends[:, -1] = wanted.end_speed
        self._squares()
        self._rows()
        self._limits()

    def _squares(self) -> None:
        """The sum of squares of all intervals as a tridiagonal matrix and a vector."""
        h = np.maximum(self.h, 1).astype(np.float64)
        # Sums over the middles of a block's intervals, tau = (i - 1/2) / h.
        own = np.where(self.on, h / 3.0 - 1.0 / (12.0 * h), 0.0)
        mixed = np.where(self.on, h / 2.0, 0.0) - own
        self.diagonal = np.zeros(self.fixed.shape)
        self.diagonal[:, 1:] += own
        self.diagonal[:, :-1] += own
        self.beside = mixed
        late, early = _block_sums(self.wanted.speeds, self.wanted.knots)
        self.vector = np.zeros(self.fixed.shape)
        self.vector[:, 1:] += late
        self.vector[:, :-1] += early
        # The changes of speed are to be those of the profile: no wave between knots.
        stiff = np.where(self.on, self.wanted.stiffness, 0.0)
        self.diagonal[:, 1:] += stiff
        self.diagonal[:, :-1] += stiff
        self.beside -= stiff
        self.vector[:, 1:] += stiff * self.wanted.rise
        self.vector[:, :-1] -= stiff * self.wanted.rise

    def _rows(self) -> None:
        """The length, and real and imaginary part of each response, as rows."""
        wanted, h = self.wanted, self.h
        total = wanted.knots[:, -1:].astype(np.float64)
        length = np.zeros(self.fixed.shape)
        length[:, 1:] += h / 2.0
        length[:, :-1] += h / 2.0
        rows = response_rows(wanted.knots, wanted.poles, wanted.interval)
        felt = wanted.weight > 0.0
        rows *= felt[:, np.newaxis, :]
        response = wanted.response * felt
        self.rows = np.concatenate(
            [(length / total)[:, :, np.newaxis], rows.real, rows.imag], axis=2
        )
        self.goal = np.concatenate(
            [wanted.length[:, np.newaxis], response.real, response.imag], axis=1
        )
        self.goal = self.goal - np.einsum("bkr,bk->br", self.rows, self.ends)
        self.rows[self.fixed] = 0.0
        softness = 1.0 / np.where(felt, wanted.weight, 1.0)
        length = np.full((len(softness), 1), 1.0 / LENGTH_WEIGHT)
        self.softness = np.concatenate([length, softness, softness], axis=1)
        # What the fixed ends do to their neighbours goes to the right side.
        self.vector[:, 1:] -= self.beside * self.ends[:, :-1]
        self.vector[:, :-1] -= self.beside * self.ends[:, 1:]
        self.vector = np.where(self.fixed, self.ends, self.vector)
        self.diagonal = np.where(self.fixed, 1.0, self.diagonal)
        self.beside = np.where(self.fixed[:, 1:] | self.fixed[:, :-1], 0.0, self.beside)

    def _limits(self) -> None:
        """Bounds of the change of speed over each block."""
        kind, most = self.wanted.kind, self.wanted.acceleration[:, np.newaxis] * self.h
        self.lowest = np.where((kind == FASTER) | (kind == EVEN), 0.0, -most)
        self.highest = np.where((kind == SLOWER) | (kind == EVEN), 0.0, most)
        self.lowest[~self.on], self.highest[~self.on] = -np.inf, np.inf
        self.even = (kind == EVEN) & self.on

    def solve(self) -> Array:
        """Newton's method on the moves whose limits are still looked for."""
        out = np.where(self.fixed, self.ends, 1.0)
        left = np.arange(len(out))
        value = self._value(left, out)
        for _ in range(STEPS):
            blocks, points = self._active(left, out[left])
            there = self._step(left, blocks, points)
            share = np.ones(len(left))
            reached = self._value(left, there)
            for _ in range(HALVINGS):
                longer = np.flatnonzero(reached > value[left])
                if not len(longer):
                    break
                share[longer] *= 0.5
                rows, part = left[longer], share[longer, np.newaxis]
                reached[longer] = self._value(rows, out[rows] + part * (there - out[left])[longer])
            out[left] += share[:, np.newaxis] * (there - out[left])
            same = self._same(left, out[left], blocks, points) & (share == 1.0)
            least = np.where(share == 1.0, NOTHING, SETTLED) * np.abs(value[left])
            gained = value[left] - reached > least
            value[left] = reached
            left = left[~same & gained]
            if not len(left):
                break
        return out

    def _active(
        self, rows: NDArray[np.int64], speeds: Array
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Which limits of blocks and points hold: 1 the upper, -1 the lower, 0 none."""
        change = np.diff(speeds, axis=1)
        blocks = (change > self.highest[rows]) * 1 - (change < self.lowest[rows])
        blocks = np.where(self.even[rows], 1, blocks)
        least, most = self.wanted.least[rows, np.newaxis], self.wanted.most[rows, np.newaxis]
        points = np.where(self.fixed[rows], 0, (speeds > most) * 1 - (speeds < least))
        return blocks, points

    def _same(
        self,
        rows: NDArray[np.int64],
        speeds: Array,
        blocks: NDArray[np.int64],
        points: NDArray[np.int64],
    ) -> NDArray[np.bool_]:
        """Whether the limits that were taken to hold are those that do."""
        now, then = self._active(rows, speeds)
        same: NDArray[np.bool_] = (now == blocks).all(axis=1) & (then == points).all(axis=1)
        return same

    def _value(self, rows: NDArray[np.int64], speeds: Array) -> Array:
        """What is minimised, but for a constant, shape (rows,)."""
        change = np.diff(speeds, axis=1)
        wanted = self.wanted
        over = np.maximum(change - self.highest[rows], 0.0) + np.maximum(
            self.lowest[rows] - change, 0.0
        )
        least, most = wanted.least[rows, np.newaxis], wanted.most[rows, np.newaxis]
        beyond = np.maximum(speeds - most, 0.0) + np.maximum(least - speeds, 0.0)
        beyond[self.fixed[rows]] = 0.0
        miss = self.goal[rows] - np.einsum("bkr,bk->br", self.rows[rows], speeds)
        own = 0.5 * self.diagonal[rows] * speeds - self.vector[rows]
        beside = self.beside[rows] * speeds[:, 1:] * speeds[:, :-1]
        value: Array = (own * speeds).sum(axis=1) + beside.sum(axis=1)
        value += 0.5 * PENALTY * ((over**2).sum(axis=1) + (beyond**2).sum(axis=1))
        value += 0.5 * (miss**2 / self.softness[rows]).sum(axis=1)
        return value

    def _step(
        self, rows: NDArray[np.int64], blocks: NDArray[np.int64], points: NDArray[np.int64]
    ) -> Array:
        """The least sum for limits that hold: 1 the upper, -1 the lower, of blocks and points."""
        fixed, ends = self.fixed[rows], self.ends[rows]
        diagonal, vector = self.diagonal[rows], self.vector[rows]
        stiff = np.where(blocks != 0, PENALTY, 0.0)
        bound = np.where(blocks == 1, self.highest[rows], self.lowest[rows])
        bound = np.where(blocks != 0, bound, 0.0)
        late, early = ~fixed[:, 1:], ~fixed[:, :-1]
        diagonal[:, 1:] += np.where(late, stiff, 0.0)
        diagonal[:, :-1] += np.where(early, stiff, 0.0)
        beside = self.beside[rows] - np.where(late & early, stiff, 0.0)
        vector[:, 1:] += np.where(late, stiff * (bound + ends[:, :-1]), 0.0)
        vector[:, :-1] += np.where(early, stiff * (ends[:, 1:] - bound), 0.0)
        held = np.where(points != 0, PENALTY, 0.0)
        wanted = self.wanted
        to = np.where(points == 1, wanted.most[rows, np.newaxis], wanted.least[rows, np.newaxis])
        diagonal += held
        vector += np.where(points != 0, held * to, 0.0)
        matrix = self.rows[rows]
        right = np.concatenate([vector[:, :, np.newaxis], matrix], axis=2)
        solved = solve_tridiagonal(diagonal, beside, right)
        free, moved = solved[:, :, 0], solved[:, :, 1:]
        miss = self.goal[rows] - np.einsum("bkr,bk->br", matrix, free)
        dense = matrix.transpose(0, 2, 1) @ moved
        diagonal = np.arange(dense.shape[1])
        dense[:, diagonal, diagonal] += self.softness[rows]
        force = np.linalg.solve(dense, miss[:, :, np.newaxis])[:, :, 0]
        out: Array = free + np.einsum("bkr,br->bk", moved, force)
        return out


def _block_sums(speeds: Array, knots: Counts) -> tuple[Array, Array]:
    """Sums of the intervals' speeds over each block, weighted towards its end and its begin."""
    total, width = knots[:, -1], speeds.shape[1]
    h = np.diff(knots, axis=1).ravel()
    used = speeds[np.arange(width) >= (width - total)[:, np.newaxis]]
    block = np.repeat(np.arange(len(h)), h)
    begin = np.cumsum(h) - h
    tau = (np.arange(len(block)) - begin[block] + 0.5) / h[block]
    shape = (len(knots), knots.shape[1] - 1)
    late = np.bincount(block, used * tau, len(h)).reshape(shape)
    early = np.bincount(block, used * (1.0 - tau), len(h)).reshape(shape)
    return late, early


def response_rows(knots: Counts, poles: Complex, interval: float) -> Complex:
    r"""What a speed of 1 at each knot leaves behind the filter, as displacement at the last knot.

    A mode keeps :math:`\sum_i w_i (e^{\lambda h} - 1) e^{\lambda (T - t_i)} / \omega_d` of the mean
    speeds :math:`w_i` of the intervals h that end at :math:`t_i`; with speeds that are straight
    lines between knots the sum over a block is one over its own intervals.

    Parameters
    ----------
    knots : ndarray of int, shape (n, k)
        As in `Wanted`. [intervals]
    poles : ndarray of complex, shape (m,)
        [rad/s]
    interval : float
        [s]

    Returns
    -------
    ndarray of complex, shape (n, k, m)
        For speeds of the mean and moves of length 1. [-]
    """
    h = np.diff(knots, axis=1)
    turn = poles * interval
    late = np.zeros((int(h.max(initial=0)) + 1, len(poles)), dtype=np.complex128)
    early = np.zeros_like(late)
    for size in range(1, len(late)):
        tau = ((np.arange(size) + 0.5) / size)[:, np.newaxis]
        decay = np.exp(turn * np.arange(size - 1, -1, -1)[:, np.newaxis])
        late[size], early[size] = (tau * decay).sum(axis=0), ((1.0 - tau) * decay).sum(axis=0)
    total = knots[:, -1:]
    left = np.exp(turn * (total - knots)[:, 1:, np.newaxis])
    out = np.zeros((*knots.shape, len(poles)), dtype=np.complex128)
    out[:, 1:] += left * late[h]
    out[:, :-1] += left * early[h]
    out *= (np.exp(turn) - 1.0) * filter_gain(poles, interval) / (poles.imag * interval)
    return np.asarray(out / total[:, :, np.newaxis], dtype=np.complex128)


def solve_tridiagonal(diagonal: Array, beside: Array, right: Array) -> Array:
    """Solve n symmetric, positive definite tridiagonal systems (Thomas).

    Parameters
    ----------
    diagonal : ndarray, shape (n, k)
        The matrices' diagonals.
    beside : ndarray, shape (n, k - 1)
        What stands above them, and below.
    right : ndarray, shape (n, k, r)
        r right sides of each.

    Returns
    -------
    ndarray, shape (n, k, r)

    Examples
    --------
    >>> right = np.array([[[1.0], [0.0], [1.0]]])
    >>> solve_tridiagonal(np.full((1, 3), 2.0), np.full((1, 2), -1.0), right)[0, :, 0]
    array([1., 1., 1.])
    """
    # Knot by knot, so that what belongs to one knot lies together.
    out = np.array(right.transpose(1, 0, 2), order="C")
    below, pivot = np.ascontiguousarray(beside.T), np.array(diagonal.T, order="C")
    for k in range(1, len(out)):
        share = below[k - 1] / pivot[k - 1]
        pivot[k] -= below[k - 1] * share
        out[k] -= share[:, np.newaxis] * out[k - 1]
    out /= pivot[:, :, np.newaxis]
    below /= pivot[:-1]
    for k in range(len(out) - 2, -1, -1):
        out[k] -= below[k, :, np.newaxis] * out[k + 1]
    return np.ascontiguousarray(out.transpose(1, 0, 2))
