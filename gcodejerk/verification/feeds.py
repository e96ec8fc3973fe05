"""Whether the F words of a stream belong to its points.

F of a block is the larger of the speeds at its two ends; between rest and rest these rise and
fall once. So the speed at each point is the smaller of the F words on its two sides, known to the
last decimal written, far better than from rounded points. That gives these tests, each with what
it notices:

- the F words rise, then fall, and the highest stands on both sides of its point: notices any
  change at the peak and at constant velocity;
- acceleration and jerk of these speeds keep the limits: notices gross changes anywhere;
- the way of each block is what the speeds at its ends give (the trapezoid with its correction for
  acceleration): notices changes beyond two steps per block time, that is 0.1 mm/s for steps of
  1e-4 mm and 2 ms, away from the moments at which the jerk jumps;
- a stream whose F words are their own mirror image, or those of the controller's own rapid, but
  for a few blocks is damaged in these: notices any change of a single F beyond its rounding.

For independent axes the speeds are those of no single law: F is held between the bounds that the
points and the axes' jerk give, which notices gross changes only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Machine
from gcodejerk.nc import AXES
from gcodejerk.units import SECONDS_PER_MINUTE
from gcodejerk.verification.conventional import peak_velocity, rapid_speed, rapid_time
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.points import Array, Paths, feed_speed, resolutions

FEED_STEP = 1e-3
"""Rounding of F that is allowed for. [units/min]"""
RELATIVE = 1e-6
JUMP = 0.3
"""Share of h^2 times the local range of jerk that a block's correction may be wrong by."""
ALIKE = 0.7
"""Share of blocks from which on a stream counts as symmetric, or as the conventional law."""

Rows = NDArray[np.bool_]
Verdicts = list[tuple[Kind, Rows, str]]


def judge_feeds(paths: Paths, machine: Machine, t: Array, limits: Array) -> Verdicts:
    """Judge the F words of streams; nothing where there are none.

    Parameters
    ----------
    paths : Paths
        The streams.
    machine : Machine
        Its resolution and positioning.
    t : ndarray, shape (rows,)
        When each point is reached. [s]
    limits : ndarray, shape (3, 9)
        Velocity, acceleration and jerk of each axis.
    """
    speed, length = feed_speed(paths)
    inner = np.ones(len(t), dtype=np.bool_)
    inner[paths.begin] = False
    if not np.isfinite(speed[inner]).any():
        return []
    judge = _Judge(paths, machine, t, limits, speed, length)
    out = [
        (Kind.FEED, inner & ~(paths.feed > 0.0), "F must be above zero"),
        judge.mean(),
        judge.most(),
    ]
    if machine.positioning == "linear":
        out += [judge.shape(), judge.limits(), judge.way()]
        out += [judge.mirror(), judge.conventional()]
    else:
        out.append(judge.bounds())
    return out


def rapid_limits(displacement: Array, machine: Machine) -> Array:
    """Limits of the controller's own rapid over the displacement, shape (3, moves, 9)."""
    rapid = np.full((3, len(AXES)), np.inf)
    for axis in machine.axes:
        own = axis.rapid
        rapid[:, AXES.index(axis.name)] = own.velocity, own.acceleration, own.jerk
    with np.errstate(divide="ignore"):
        out: Array = rapid[:, np.newaxis, :] / np.abs(displacement)
    return out


class _Judge:
    """The tests; rows are those of the paths, a block belongs to the row in which it ends."""

    def __init__(
        self, paths: Paths, machine: Machine, t: Array, limits: Array, speed: Array, length: Array
    ) -> None:
        self.paths, self.t, self.limits_, self.length = paths, t, limits, length
        self.machine = machine
        owner = self.owner = paths.owner
        self.first = np.zeros(len(t), dtype=np.bool_)
        self.first[paths.begin] = True
        self.last = np.zeros(len(t), dtype=np.bool_)
        self.last[paths.end - 1] = True
        self.F = np.where(self.first, 0.0, speed)
        self.rounding = (FEED_STEP / SECONDS_PER_MINUTE) * paths.unit[owner]
        D = np.abs(paths.displacement)
        self.step = np.where(D > 0.0, resolutions(machine), 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            unit = np.where(D > 0.0, limits[:, np.newaxis, :] * length[:, np.newaxis] / D, np.inf)
        self.path_limits: Array = unit.min(axis=2)
        """Of the speed along the path, shape (3, streams)."""
        self.h = np.where(self.first, 1.0, np.diff(t, prepend=0.0))
        self.way_, self.error = self._ways(D)
        self.mean_ = self.way_ / self.h
        self.error_mean = self.error / self.h

    def _ways(self, D: Array) -> tuple[Array, Array]:
        """Way of each block along what F refers to, and what rounding of its ends may add."""
        group = np.zeros((len(D), len(AXES)), dtype=np.bool_)
        left = np.ones(len(D), dtype=np.bool_)
        for axes in (slice(0, 3), slice(6, 9), slice(3, 6)):
            moves = left & (D[:, axes] > 0.0).any(axis=1)
            group[moves, axes] = True
            left &= ~moves
        delta = np.diff(self.paths.position, axis=0, prepend=self.paths.position[:1])
        delta = np.where(self.first[:, np.newaxis] | ~group[self.owner], 0.0, delta)
        way = np.sqrt((delta**2).sum(axis=1))
        error = np.sqrt(((self.step * group) ** 2).sum(axis=1))[self.owner]
        ends = self.last.astype(int) + np.roll(self.first, 1)
        return way, error * (2 - ends)

    def mean(self) -> tuple[Kind, Rows, str]:
        """F is not below the mean speed of its block."""
        sag = self._largest(2) * self.h**2 / 8.0
        least = self.mean_ - sag - self.error_mean - self.rounding
        bad = ~self.first & (least > self.F)
        return Kind.FEED, bad, "F is below the mean speed of its block"

    def most(self) -> tuple[Kind, Rows, str]:
        """F is not above what the axes can do along the path."""
        V = self._largest(0)
        most = V * (1.0 + RELATIVE) + self.rounding
        return Kind.VELOCITY, most < self.F, "F is above the velocity limits"

    def _largest(self, quantity: int) -> Array:
        """Limit along the path, row by row; of axes on their own, the limits of all together."""
        if self.machine.positioning == "linear":
            row: Array = self.path_limits[quantity]
            return row[self.owner]
        refers = np.array([self._refers_to(axis) for axis in range(len(AXES))]).T
        used = refers & (self.paths.displacement != 0.0)
        parts = np.where(used, self.limits_[quantity], 0.0)
        together: Array = np.sqrt((parts**2).sum(axis=1))
        return np.asarray(together[self.owner], dtype=np.float64)

    def speeds(self) -> Array:
        """Speed at each point: the smaller of the F words on both sides."""
        after = np.roll(self.F, -1)
        return np.where(self.first | self.last, 0.0, np.minimum(self.F, after))

    def shape(self) -> tuple[Kind, Rows, str]:
        """Rise, then fall; the highest F twice."""
        v = self.speeds()
        before = np.where(self.first, 0.0, np.roll(v, 1))
        single = (self.paths.count == 1)[self.owner]
        bad = ~self.first & ~single & (np.maximum(before, v) + self.rounding < self.F)
        change = np.where(self.first | np.roll(self.first, 1), 0.0, self.F - np.roll(self.F, 1))
        falls = np.cumsum(change < -self.rounding)
        falls = falls - falls[self.paths.begin][self.owner]
        bad |= (change > self.rounding) & (falls > 0)
        return Kind.FEED, bad, "F is not the larger of the speeds at the ends of its block"

    def limits(self) -> tuple[Kind, Rows, str]:
        """Acceleration and jerk of the speeds at the points."""
        v = self.speeds()
        A, J = self.path_limits[1][self.owner], self.path_limits[2][self.owner]
        slope = np.where(self.first, 0.0, (v - np.roll(v, 1)) / self.h)
        several = (self.paths.count > 1)[self.owner]
        bad = several & (np.abs(slope) > A * (1.0 + RELATIVE) + 2.0 * self.rounding / self.h)
        # At a start the acceleration before is 0, and so it is after the last point.
        span = 0.5 * (self.h + np.roll(self.h, 1))
        span = np.where(np.roll(self.first, 1), self.h, span)
        before = np.where(np.roll(self.first, 1), 0.0, np.roll(slope, 1))
        jerk = np.where(self.first, 0.0, (slope - before) / span)
        ending = np.where(self.last, -slope / self.h, 0.0)
        margin = J * (1.0 + RELATIVE) + 4.0 * self.rounding / np.minimum(self.h, span) ** 2
        bad |= several & ((np.abs(jerk) > margin) | (np.abs(ending) > margin))
        return Kind.FEED, bad, "F words break the acceleration or jerk limits"

    def way(self) -> tuple[Kind, Rows, str]:
        """Compare the way of each block with what follows from the speeds at its ends."""
        v, h, first = self.speeds(), self.h, self.first
        slope = np.where(first, 0.0, (v - np.roll(v, 1)) / h)
        after, h_after = np.roll(slope, -1), np.roll(h, -1)
        at = np.where(first | self.last, 0.0, (slope * h_after + after * h) / (h + h_after))
        jerk = np.where(first | self.last, 0.0, 2.0 * (after - slope) / (h + h_after))
        jerk = np.where(first, 2.0 * after / h_after, jerk)
        jerk = np.where(self.last, -2.0 * slope / h, jerk)
        before = np.roll(v, 1)
        expected = 0.5 * (before + v) - h / 12.0 * (at - np.roll(at, 1))
        high = low = jerk
        for shift in (-1, 1, 2):
            near = np.where(self.owner == np.roll(self.owner, shift), np.roll(jerk, shift), 0.0)
            high, low = np.maximum(high, near), np.minimum(low, near)
        allowed = JUMP * h**2 * (high - low) + self.error_mean + self.rounding
        several = (self.paths.count > 1)[self.owner]
        bad = ~first & several & (np.abs(self.mean_ - expected) > allowed)
        return Kind.FEED, bad, "F does not fit the way of its block"

    def mirror(self) -> tuple[Kind, Rows, str]:
        """Hold a nearly symmetric stream to its symmetry."""
        begin, end, rows = self.paths.begin, self.paths.end, np.arange(len(self.owner))
        other = np.where(self.first, rows, begin[self.owner] + end[self.owner] - rows)
        bad = self._odd_ones(self.F[other], few=2)
        return Kind.FEED, bad, "F differs from that of the mirrored block"

    def conventional(self) -> tuple[Kind, Rows, str]:
        """Hold what is nearly the controller's own rapid to it."""
        V, A, J = rapid_limits(self.paths.displacement, self.machine).min(axis=2)
        law = np.isfinite(J)
        J = np.where(law, J, 1.0)
        total, peak = rapid_time(V, A, J), peak_velocity(V, A, J)
        t = self.t - self.t[self.paths.begin][self.owner]
        columns = (column[self.owner] for column in (total, peak, A, J))
        v = rapid_speed(t, *columns) * self.length[self.owner]
        expected = np.where(self.first, 0.0, np.maximum(v, np.roll(v, 1)))
        bad = self._odd_ones(expected, few=1) & law[self.owner]
        return Kind.FEED, bad, "F differs from that of the controller's own rapid"

    def _odd_ones(self, expected: Array, few: int) -> Rows:
        """Find the few F words that differ where nearly all are as expected."""
        equal = np.abs(self.F - expected) <= 2.0 * self.rounding
        # At constant velocity all laws are alike.
        highest = np.maximum.reduceat(self.F, self.paths.begin)[self.owner]
        telling = ~self.first & (highest - self.F > self.rounding)
        count = np.add.reduceat(telling.astype(float), self.paths.begin)
        alike = np.add.reduceat((telling & equal).astype(float), self.paths.begin)
        nearly = (alike >= ALIKE * count) | (count - alike <= few)
        odd: Rows = ~self.first & ~equal & (nearly & (count >= 2 + few))[self.owner]
        return odd

    def bounds(self) -> tuple[Kind, Rows, str]:
        """F between bounds of the speed at the ends of its block, axis by axis."""
        h_after = np.roll(self.h, -1)
        low, high = np.zeros(len(self.t)), np.zeros(len(self.t))
        for a in np.flatnonzero((self.paths.displacement != 0.0).any(axis=0)).tolist():
            used = self._refers_to(a)[self.owner]
            x = self.paths.position[:, a]
            slope = np.where(self.first, 0.0, (x - np.roll(x, 1)) / self.h)
            after = np.roll(slope, -1)
            inner = ~(self.first | self.last)
            v = np.abs(slope * h_after + after * self.h) / (self.h + h_after)
            slack = self.limits_[2, a] * self.h * h_after / 4.0
            slack = slack + 2.0 * self.step[self.owner, a] / np.minimum(self.h, h_after)
            v, slack = np.where(inner & used, v, 0.0), np.where(inner & used, slack, 0.0)
            low += np.maximum(v - slack, 0.0) ** 2
            high += (v + slack) ** 2
        low, high = np.sqrt(low), np.sqrt(high)
        least = np.maximum(low, np.roll(low, 1)) - self.rounding
        most = np.maximum(high, np.roll(high, 1)) + self.rounding
        several = (self.paths.count > 1)[self.owner]
        bad = ~self.first & several & ((least > self.F) | (most < self.F))
        return Kind.FEED, bad, "F is not a speed that the axes have at the ends of its block"

    def _refers_to(self, axis: int) -> Rows:
        """For which streams F refers to this axis."""
        D = self.paths.displacement
        groups = [slice(0, 3), slice(6, 9), slice(3, 6)]
        moving = [(D[:, g] != 0.0).any(axis=1) for g in groups]
        at = next(n for n, g in enumerate(groups) if g.start <= axis < g.stop)
        out: Rows = moving[at] & ~np.logical_or.reduce([*moving[:at], np.zeros(len(D), bool)])
        return out
