r"""Design of symmetric profiles: T1, Ta and T2 of the ramps, and the cruise that is left between.

This module owns the global search in the family that Condition III and its generalisation belong
to. T_SUM is given, so three numbers are free; the limits of velocity and acceleration bound Ta by a
closed form of the other two, so that a candidate is T1, T2 and a share of Ta's range. What a mode
keeps has many valleys over these three: a grid of switching times finds them, and some profiles at
the limits, where the grid has none; the best are descended at once, and those that lead go on to
the bottom.

Rule 1: no segment is shorter than one command interval; a segment may be absent.
Rule 2: what is compared is the objective, the largest residual displacement of the tool.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles, conventional_profiles
from gcodejerk.motion.search.candidates import symmetric_worst
from gcodejerk.motion.search.combinations import best_combinations
from gcodejerk.motion.search.condition3 import four_segment_range
from gcodejerk.motion.search.newton import LAST_POWERS, POWERS, Powers, proposed_steps, slopes
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, parts

TIMES, SPREAD = 36, 1.6
"""Times of the grid of combinations, and the power by which they are closer where ramps are short.
"""
EDGES, LINE = 5, 9
"""Values of T1 and of T2 that are looked at at both ends of Ta's range, and of T1 of the
four-segment profiles."""
BISECTIONS = 24
"""For the longest T1 and T2 that the limits leave."""
PROMISING = 4.0
"""What leaves so many times the least of the grid is not evaluated to its end."""
FEW = 8
"""So few frequencies can be perfectly still: nulls are narrow, and worth a longer search."""
STARTS, ROUNDS = 16, 1
"""Profiles that are descended from, and in how many steps."""
LEADERS, LAST = (8, 5), (16, 4)
"""Those that go on, and in how many steps: of `FEW` frequencies, and of more."""
FINAL = (2, 6)
"""Of more, the best that go on to the bottom, where the largest residuals have edges."""
REACH = (0.3, 0.3, 0.25)
"""The longest first step: parts of T1 and of T2, and of Ta's range."""
GROWS, SHRINKS = 1.5, 0.3
"""What the longest step is multiplied by after one that led downhill, and after one that did not.
"""
NUDGE = 1e-4
"""Relative change of T1 and T2 by which the slope of Ta's range is found."""
WIDE = 256
"""Candidates of a move that are looked at at a time, about: so many moves are searched at once."""
SHORTEST = 1e-12
"""Segments that are shorter are not there, and times that differ by less are equal. [s]"""
TINY = 1e-12
"""A step that is none."""


def design_symmetric(
    total: Array, velocity: Array, acceleration: Array, jerk: Array, objective: Objective,
    interval: float, known: list[SymmetricProfiles],
) -> tuple[SymmetricProfiles, NDArray[np.bool_]]:  # fmt: skip
    """The symmetric profile of given duration with the least worst residual within limits.

    Parameters
    ----------
    total : ndarray, shape (n,)
        T_SUM. [s]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile; jerk may be infinite. [1/s], [1/s^2], [1/s^3]
    objective : Objective
        Of n moves.
    interval : float
        Command interval, the least duration of a segment. [s]
    known : list of SymmetricProfiles
        n profiles each; stretched to T_SUM they are candidates, where they are within limits.

    Returns
    -------
    profiles : SymmetricProfiles
        n profiles; meaningless where `feasible` is False.
    feasible : ndarray of bool, shape (n,)
        Whether any profile within the limits was found.
    """
    n = len(total)
    columns, feasible = [np.ones(n) for _ in range(4)], np.zeros(n, dtype=bool)
    fastest = conventional_profiles(velocity, acceleration, jerk, interval)
    for part in parts(n, WIDE):
        search = _Search(
            total[part], velocity[part], acceleration[part], jerk[part], objective.take(part),
            interval,
        )  # fmt: skip
        starts = [profiles.take(part) for profiles in (*known, fastest)]
        profiles, feasible[part] = search.run(starts)
        for column, new in zip(columns, profiles.columns(), strict=True):
            column[part] = new
    return SymmetricProfiles(*columns), feasible


class _Search:
    """One batch of moves; the last axis of points is T1, T2 and the share of Ta's range."""

    def __init__(
        self, total: Array, V: Array, A: Array, J: Array, objective: Objective, interval: float
    ) -> None:
        slack = 1.0 + ROUNDING
        self.total, self.V, self.A, self.J = total, V * slack, A * slack, J * slack
        self.objective, self.interval = objective, interval
        # V = 1/(T_SUM - 2 centroid): the velocity limit is a limit of the centroid.
        self.centroid = 0.5 * (total - 1.0 / self.V)

    def run(self, known: list[SymmetricProfiles]) -> tuple[SymmetricProfiles, NDArray[np.bool_]]:
        """The best of what is looked at first are descended from, and the leaders to the end."""
        points, value = _best(STARTS, *self._first(known))
        reach = np.ones(value.shape)
        points, value, reach = self._descend(points, value, reach, ROUNDS)
        many = len(self.objective.poles) > FEW
        points, value, reach = _best(LEADERS[many], points, value, reach)
        points, value, reach = self._descend(points, value, reach, LAST[many])
        if many:
            points, value, reach = _best(FINAL[0], points, value, reach)
            points, value, _ = self._descend(points, value, reach, FINAL[1], LAST_POWERS)
        points, value = (x[:, 0] for x in _best(1, points, value))
        return self._profiles(points), np.isfinite(value)

    def _first(self, known: list[SymmetricProfiles]) -> tuple[Array, Array]:
        """Points of the grid, one for each T1, and what is looked at besides; their values."""
        spread = (np.linspace(0.0, 1.0, TIMES) ** SPREAD).round(12)
        # As far as the shortest T1 and Ta leave the velocity within its limit.
        longest = np.clip(
            3.0 * self.centroid - self.interval, 2.0 * self.interval, 0.5 * self.total
        )
        times = self.interval + (longest - self.interval)[:, np.newaxis] * spread
        T1, Ta, T2 = best_combinations(
            times, self.total, (self.V, self.A, self.J), self.objective.rough(), self.interval
        )
        points = self._points(T1, Ta, T2)
        value = self._value(points)
        more = self._candidates(known)
        bound = np.repeat(PROMISING * value.min(axis=1, keepdims=True), more.shape[1], axis=1)
        return (
            np.concatenate([points, more], axis=1),
            np.concatenate([value, self._value(more, bound)], axis=1),
        )

    def _candidates(self, known: list[SymmetricProfiles]) -> Array:
        """Points at the ends of Ta's range, of four segments and of known profiles."""
        n, dt = len(self.total), self.interval
        spread = (np.linspace(0.0, 1.0, EDGES) ** SPREAD).round(12)
        T1, T2 = (dt + (self._longest(which) - dt)[:, np.newaxis] * spread for which in (0, 1))
        shape = (n, EDGES, EDGES, 2)
        edges = np.stack(
            [
                np.broadcast_to(T1[:, :, np.newaxis, np.newaxis], shape),
                np.broadcast_to(T2[:, np.newaxis, :, np.newaxis], shape),
                np.broadcast_to([0.0, 1.0], shape),
            ],
            axis=-1,
        ).reshape(n, -1, 3)
        low, high = four_segment_range(self.total, self.V, self.A, self.J, dt)
        low, high = np.where(low <= high, low, dt), np.where(low <= high, high, dt)
        first = low[:, np.newaxis] + (high - low)[:, np.newaxis] * np.linspace(0.0, 1.0, LINE)
        line = np.stack(
            [first, 0.5 * self.total[:, np.newaxis] - first, np.zeros(first.shape)], axis=-1
        )
        own = np.stack([self._stretched(profiles) for profiles in known], axis=1)
        return np.concatenate([edges, line, own], axis=1)

    def _longest(self, which: int) -> Array:
        """The longest T1 (0) or T2 (1) that V and A leave, with one interval for the other."""
        low, high = np.full(len(self.total), self.interval), 0.5 * self.total
        ramps = [low.copy(), low.copy()]
        for _ in range(BISECTIONS):
            ramps[which] = 0.5 * (low + high)
            least, most = self._range_of_Ta(ramps[0], ramps[1])
            fits = least <= most
            low, high = np.where(fits, ramps[which], low), np.where(fits, high, ramps[which])
        return low

    def _stretched(self, profiles: SymmetricProfiles) -> Array:
        """Profiles stretched to T_SUM, as points of the search."""
        stretch = self.total / profiles.total
        return self._points(*(x * stretch for x in (profiles.T1, profiles.Ta, profiles.T2)))

    def _points(self, T1: Array, Ta: Array, T2: Array) -> Array:
        """Ramps as points of the search."""
        T1, T2 = np.maximum(T1, self.interval), np.maximum(T2, self.interval)
        low, high = self._range_of_Ta(T1, T2)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip((Ta - low) / (high - low), 0.0, 1.0)
        return np.stack([T1, T2, np.where(np.isfinite(share), share, 0.0)], axis=-1)

    def _descend(
        self, points: Array, value: Array, reach: Array, rounds: int, powers: Powers = POWERS
    ) -> tuple[Array, Array, Array]:
        """Steps downhill from k points of each move, shape (n, k, 3), with their values.

        `reach`: the longest step of each, as parts of `REACH`.
        """
        for _ in range(rounds):
            step = self._steps(points, powers)
            longest = np.abs(step).max(axis=-1, keepdims=True)
            step *= np.minimum(1.0, reach[..., np.newaxis, np.newaxis] / np.maximum(longest, TINY))
            near = self._within(points[:, :, np.newaxis] + step * _unit(points)[:, :, np.newaxis])
            bound = np.repeat(value, near.shape[2], axis=1)
            found = self._value(near.reshape(len(near), -1, 3), bound).reshape(near.shape[:3])
            chosen = found.argmin(axis=2)[..., np.newaxis]
            least = np.take_along_axis(found, chosen, axis=2)[..., 0]
            better = least < value
            there = np.take_along_axis(near, chosen[..., np.newaxis], axis=2)[:, :, 0]
            points = np.where(better[..., np.newaxis], there, points)
            value = np.where(better, least, value)
            reach = reach * np.where(better, GROWS, SHRINKS)
        return points, value, reach

    def _within(self, points: Array) -> Array:
        """Points moved back to the limits that they are beyond; nearly, where it is the jerk's."""
        np.clip(points[..., 2], 0.0, 1.0, out=points[..., 2])
        np.maximum(points[..., :2], self.interval, out=points[..., :2])
        J = self._beside(points, self.J)
        acceleration = self._ramps(points)[1]
        with np.errstate(invalid="ignore", divide="ignore"):
            shortest = acceleration[..., np.newaxis] / J * (1.0 + ROUNDING)
        np.fmax(points[..., :2], np.where(shortest > 0.0, shortest, 0.0), out=points[..., :2])
        return points

    def _steps(self, points: Array, powers: Powers) -> Array:
        """Proposed steps from points, in parts of `REACH`, shape (n, k, proposals, 3)."""
        T1, T2, share = points[..., 0], points[..., 1], points[..., 2]
        Ta, _, legal = self._ramps(points)
        quarter = 0.25 * self.total[:, np.newaxis]
        ramp = [np.where(legal, x, quarter) for x in (T1, Ta, T2)]
        left, by = slopes(ramp[0], ramp[1], ramp[2], self.total, self.objective)
        low, high, slope = self._slopes_of_Ta(T1, T2, share)
        width = np.where(np.isfinite(high - low), high - low, 0.0)
        unit = _unit(points)
        by_T1, by_T2, by_Ta = (
            x.ravel().astype(np.float32) for x in (slope[0], slope[1], width * unit[..., 2])
        )
        first, second = (unit[..., k].ravel().astype(np.float32) for k in (0, 1))
        by = np.stack(
            [(by[0] + by[1] * by_T1) * first, (by[2] + by[1] * by_T2) * second, by[1] * by_Ta]
        )
        shortest = self.interval * (1.0 + NUDGE)
        fixed = np.zeros((2, 3, share.size), dtype=bool)
        fixed[0] = [(shortest >= T1).ravel(), (shortest >= T2).ravel(), (share <= 0.0).ravel()]
        fixed[1, 2] = (share >= 1.0).ravel()
        steps = proposed_steps(left, by, self.objective, fixed, powers)
        return np.moveaxis(steps.reshape(len(steps), *share.shape, 3), 0, 2)

    def _value(self, points: Array, bound: Array | None = None) -> Array:
        """Worst residual of candidates, shape (n, k); infinite where one is not legal.

        It may be infinite, too, where it is above its bound, of the same shape.
        """
        T1, T2 = points[..., 0], points[..., 1]
        Ta, acceleration, legal = self._ramps(points)
        # What is not legal is evaluated as something harmless.
        with np.errstate(divide="ignore", invalid="ignore"):
            jerk = acceleration / np.minimum(T1, T2)
        T1, Ta, T2 = (
            np.where(legal, own, harmless) for own, harmless in ((T1, 1.0), (Ta, 0.0), (T2, 1.0))
        )
        total = np.where(legal.any(axis=1), self.total, 4.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bound = np.where(legal, np.inf if bound is None else bound, -1.0)
            worst = symmetric_worst(T1, Ta, T2, total, self.objective, bound)
        # Where nothing vibrates the lowest jerk is the best.
        still = ~self.objective.weights.any(axis=1, keepdims=True)
        return np.where(legal, np.where(still, jerk, worst), np.inf)

    def _range_of_Ta(self, T1: Array, T2: Array) -> tuple[Array, Array]:
        """Least and greatest Ta for given T1 and T2: from A and from V and T_SUM."""
        (p, lower), (b, upper), room = self._roots_of_Ta(T1, T2)
        return np.maximum(p - lower, 0.0), np.minimum(upper - b, room)

    def _roots_of_Ta(
        self, T1: Array, T2: Array
    ) -> tuple[tuple[Array, Array], tuple[Array, Array], Array]:
        """What Ta's range follows from: A asks for Ta >= p - root, V for Ta <= root - b.

        Both limits are quadratic in Ta, since the ramp's moment is. Last: what T_SUM leaves to Ta.
        """
        T, centroid, A = (self._beside(T1, x) for x in (self.total, self.centroid, self.A))
        half = 0.5 * (T1 + T2)
        moment = T1 * T1 / 3.0 + 0.5 * T1 * T2 + T2 * T2 / 6.0
        b, p = T1 + 0.5 * T2 - centroid, 0.5 * T - T1 - 0.5 * T2
        with np.errstate(invalid="ignore"):
            upper = np.sqrt(b * b - 2.0 * (moment - centroid * half))
            lower = np.sqrt(p * p + half * T - 2.0 * moment - 1.0 / A)
        return (p, lower), (b, upper), 0.5 * T - T1 - T2

    def _slopes_of_Ta(self, T1: Array, T2: Array, share: Array) -> tuple[Array, Array, list[Array]]:
        """Ta's range, and how a share of it changes with T1 and T2; 0 where there is no range."""
        (p, lower), (b, upper), room = self._roots_of_Ta(T1, T2)
        T, centroid = (self._beside(T1, x) for x in (self.total, self.centroid))
        low, high = p - lower, upper - b
        slope = []
        with np.errstate(invalid="ignore", divide="ignore"):
            for own, part in ((1.0, 2.0 * T1 / 3.0 + 0.5 * T2), (0.5, 0.5 * T1 + T2 / 3.0)):
                rises = (own * b - part + 0.5 * centroid) / upper - own
                falls = -own - (0.25 * T - own * p - part) / lower
                change = np.where(low > 0.0, falls, 0.0) * (1.0 - share)
                change += np.where(high < room, rises, -1.0) * share
                slope.append(np.where(np.isfinite(change), change, 0.0))
        return np.maximum(low, 0.0), np.minimum(high, room), slope

    @staticmethod
    def _beside(points: Array, column: Array) -> Array:
        """A number of each move, shaped to stand beside numbers of its points."""
        return column.reshape(-1, *(1,) * (points.ndim - 1))

    def _profiles(self, points: Array) -> SymmetricProfiles:
        """The profiles of points, shape (n, 3)."""
        T1, T2 = points[:, 0], points[:, 1]
        Ta = self._ramps(points)[0]
        Tv = self.total - 2.0 * (T1 + Ta + T2)
        return SymmetricProfiles(T1, Ta, T2, np.where(np.abs(Tv) < SHORTEST, 0.0, Tv))

    def _ramps(self, points: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Ta and the acceleration of points; whether each keeps limits and segment durations."""
        T1, T2, share = points[..., 0], points[..., 1], points[..., 2]
        T, J = (self._beside(T1, x) for x in (self.total, self.J))
        low, high = self._range_of_Ta(T1, T2)
        dt = self.interval * (1.0 - ROUNDING)
        Ta = low + share * (high - low)
        # A segment that would be shorter than the interval vanishes or grows to it.
        Ta = np.where(Ta < dt, (low > 0.0) * self.interval, Ta)
        half = 0.5 * (T1 + T2)
        room = 0.5 * T - 2.0 * half
        Tv = 2.0 * (room - Ta)
        closed = np.where(Tv < 0.5 * self.interval, room, room - 0.5 * self.interval)
        Ta = np.where(Tv < dt, closed, Ta)
        Ta = np.where(np.abs(Ta) < SHORTEST, 0.0, Ta)
        Tv = 2.0 * (room - Ta)
        moment = T1 * T1 / 3.0 + Ta * (T1 + 0.5 * Ta) + T2 * (half + 0.5 * Ta - T2 / 3.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            acceleration = 1.0 / ((Ta + half) * T - 2.0 * moment)
            shortest = np.minimum(T1, T2)
            legal = (
                (low <= high + SHORTEST)
                & (Ta >= low - SHORTEST)
                & (Ta <= high + SHORTEST)
                & ((Ta == 0.0) | (Ta >= dt))
                & ((np.abs(Tv) < SHORTEST) | (Tv >= dt))
                & (shortest >= dt)
                & (acceleration <= J * shortest)
            )
        return Ta, acceleration, legal


def _unit(points: Array) -> Array:
    """The units of steps from points."""
    return np.concatenate(
        [REACH[:2] * points[..., :2], np.full((*points.shape[:-1], 1), REACH[2])], axis=-1
    )


def _best(k: int, points: Array, value: Array, *more: Array) -> tuple[Array, ...]:
    """The k best points of each row, the first among equals, and what belongs to them."""
    index = np.argsort(value, axis=1, kind="stable")[:, :k]
    row = np.arange(len(index))[:, np.newaxis]
    return tuple(column[row, index] for column in (points, value, *more))
