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

from dataclasses import dataclass

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

TIMES, SPREAD = 44, 1.6
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
STARTS, ROUNDS = 20, 1
"""Profiles that are descended from, and in how many steps."""
LEADERS, LAST = (8, 6), (16, 4)
"""Those that go on, and in how many steps: of `FEW` frequencies, and of more."""
FINAL = (2, 6)
"""Of more, the best that go on to the bottom, where the largest residuals have edges."""
REACH = (0.3, 0.25, 0.3)
"""The longest first step: parts of T1, of Ta's range and of T2."""
GROWS, SHRINKS = 1.5, 0.3
"""What the longest step is multiplied by after one that led downhill, and after one that did not.
"""
ARRIVED, TOGETHER = 0.1, 2
"""A point whose longest step is a shorter part of `REACH` goes no further; points that go on are
never fewer than this."""
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
    search = _Search.of(total, velocity, acceleration, jerk, objective, interval)
    starts = (*known, conventional_profiles(velocity, acceleration, jerk, interval))
    found = _Points(np.empty((3, STARTS, n)), np.empty((STARTS, n)), np.ones((STARTS, n)))
    for part in parts(n, WIDE):
        found.put(part, search.take(part).first([profiles.take(part) for profiles in starts]))
    width = len(objective.poles)
    for count, rounds, powers in _descents(width):
        found = found.best(count)
        for part in parts(n, count * width):
            found.put(part, search.take(part).descended(found.take(part), rounds, powers))
    found = found.best(1)
    return search.profiles(found.at[:, 0]), np.isfinite(found.value[0])


def _descents(poles: int) -> list[tuple[int, int, Powers]]:
    """How many of the best go on, in how many steps, and by which powers."""
    many = poles > FEW
    descents = [(STARTS, ROUNDS, POWERS), (LEADERS[many], LAST[many], POWERS)]
    return [*descents, (*FINAL, LAST_POWERS)] if many else descents


@dataclass(frozen=True, slots=True, eq=False)
class _Points:
    """Candidates of n moves, k of each, side by side.

    Attributes
    ----------
    at : ndarray, shape (3, k, n)
        T1, the share of Ta's range, and T2.
    value : ndarray, shape (k, n)
        What each leaves. [mm]
    reach : ndarray, shape (k, n)
        The longest step from each, as a part of `REACH`.
    """

    at: Array
    value: Array
    reach: Array

    def take(self, part: slice | NDArray[np.intp]) -> _Points:
        """Those of some of the moves."""
        return _Points(self.at[..., part], self.value[:, part], self.reach[:, part])

    def put(self, part: slice | NDArray[np.intp], some: _Points) -> None:
        """Others in the place of those of some of the moves."""
        self.at[..., part], self.value[:, part] = some.at, some.value
        self.reach[:, part] = some.reach

    def best(self, k: int) -> _Points:
        """The k best of each move, the first among equals."""
        index = np.argsort(self.value, axis=0, kind="stable")[:k]
        move = np.arange(self.value.shape[1])
        return _Points(self.at[:, index, move], self.value[index, move], self.reach[index, move])

    def shaped(self, k: int, n: int) -> _Points:
        """The same as k candidates of n moves; those of a move are n columns apart."""
        shape = (k, n)
        at = self.at.reshape(3, *shape)
        return _Points(at, self.value.reshape(shape), self.reach.reshape(shape))


@dataclass(frozen=True, slots=True, eq=False)
class _Search:
    """Moves and their limits; points are T1, the share of Ta's range, and T2, shape (3, ..., n).

    `centroid`: V = 1/(T_SUM - 2 centroid), so the velocity limit is a limit of the centroid.
    """

    total: Array
    V: Array
    A: Array
    J: Array
    centroid: Array
    objective: Objective
    interval: float

    @classmethod
    def of(
        cls, total: Array, V: Array, A: Array, J: Array, objective: Objective, interval: float
    ) -> _Search:
        """With the limits as they are."""
        slack = 1.0 + ROUNDING
        centroid = 0.5 * (total - 1.0 / (V * slack))
        return cls(total, V * slack, A * slack, J * slack, centroid, objective, interval)

    def take(self, part: slice | NDArray[np.intp]) -> _Search:
        """Some of the moves."""
        total, V, A, J, centroid = (
            column[part] for column in (self.total, self.V, self.A, self.J, self.centroid)
        )
        return _Search(total, V, A, J, centroid, self.objective.take(part), self.interval)

    def first(self, known: list[SymmetricProfiles]) -> _Points:
        """The best of the grid, one for each T1, and of what is looked at besides."""
        spread = (np.linspace(0.0, 1.0, TIMES) ** SPREAD).round(12)
        # As far as the shortest T1 and Ta leave the velocity within its limit.
        longest = np.clip(
            3.0 * self.centroid - self.interval, 2.0 * self.interval, 0.5 * self.total
        )
        times = self.interval + (longest - self.interval) * spread[:, np.newaxis]
        T1, Ta, T2 = best_combinations(
            times, self.total, (self.V, self.A, self.J), self.objective.rough(), self.interval
        )
        points = self._points(T1, Ta, T2)
        value = self._value(points)
        more = self._candidates(known)
        bound = np.broadcast_to(PROMISING * value.min(axis=0), more.shape[1:])
        value = np.concatenate([value, self._value(more, bound)])
        points = np.concatenate([points, more], axis=1)
        return _Points(points, value, np.ones(value.shape)).best(STARTS)

    def _candidates(self, known: list[SymmetricProfiles]) -> Array:
        """Points at the ends of Ta's range, of four segments and of known profiles."""
        n, dt = len(self.total), self.interval
        spread = (np.linspace(0.0, 1.0, EDGES) ** SPREAD).round(12)
        T1, T2 = (dt + (longest - dt) * spread[:, np.newaxis] for longest in self._longest())
        edges = np.empty((3, EDGES, EDGES, 2, n))
        edges[0], edges[2] = T1[:, np.newaxis, np.newaxis], T2[:, np.newaxis]
        edges[1] = np.array([0.0, 1.0])[:, np.newaxis]
        low, high = four_segment_range(self.total, self.V, self.A, self.J, dt)
        low, high = np.where(low <= high, low, dt), np.where(low <= high, high, dt)
        first = low + (high - low) * np.linspace(0.0, 1.0, LINE)[:, np.newaxis]
        line = np.stack([first, np.zeros(first.shape), 0.5 * self.total - first])
        own = np.stack([self._stretched(profiles) for profiles in known], axis=1)
        return np.concatenate([edges.reshape(3, -1, n), line, own], axis=1)

    def _longest(self) -> Array:
        """The longest T1 and T2 that V and A leave beside one interval of the other, (2, n)."""
        dt = np.full(len(self.total), self.interval)
        low, high = np.stack([dt, dt]), np.stack([0.5 * self.total] * 2)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            least, most = self._range_of_Ta(np.stack([middle[0], dt]), np.stack([dt, middle[1]]))
            fits = least <= most
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
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
        return np.stack([T1, np.where(np.isfinite(share), share, 0.0), T2])

    def descended(self, points: _Points, rounds: int, powers: Powers) -> _Points:
        """Points that went downhill, until the longest step of each is short."""
        k, n = points.value.shape
        every = points.shaped(1, k * n)
        for _ in range(rounds):
            going = np.flatnonzero(every.reach >= ARRIVED)
            if not len(going):
                break
            # Never one alone: numpy adds up a single column in another order than many.
            going = np.resize(going, max(len(going), TOGETHER))
            every.put(going, self.take(going % n)._stepped(every.take(going), powers))
        return every.shaped(k, n)

    def _stepped(self, points: _Points, powers: Powers) -> _Points:
        """A step from each point to the best that is proposed, if it is better."""
        step = self._steps(points.at, powers)
        longest = np.abs(step).max(axis=0)
        step *= np.minimum(1.0, points.reach / np.maximum(longest, TINY))
        near = self._within(points.at[:, np.newaxis] + step * _unit(points.at)[:, np.newaxis])
        found = self._value(near, np.broadcast_to(points.value, near.shape[1:]))
        at, value = points.at, points.value
        for there, least in zip(np.moveaxis(near, 1, 0), found, strict=True):
            at, value = np.where(least < value, there, at), np.minimum(least, value)
        return _Points(at, value, points.reach * np.where(value < points.value, GROWS, SHRINKS))

    def _within(self, points: Array) -> Array:
        """Points moved back to the limits that they are beyond; nearly, where it is the jerk's."""
        np.clip(points[1], 0.0, 1.0, out=points[1])
        ramps = points[::2]
        np.maximum(ramps, self.interval, out=ramps)
        acceleration = self._ramps(points)[1]
        with np.errstate(invalid="ignore", divide="ignore"):
            shortest = acceleration / self.J * (1.0 + ROUNDING)
        np.fmax(ramps, np.where(shortest > 0.0, shortest, 0.0), out=ramps)
        return points

    def _steps(self, points: Array, powers: Powers) -> Array:
        """Proposed steps from points, in parts of `REACH`, shape (3, proposals, k, n)."""
        T1, share, T2 = points
        Ta, _, legal = self._ramps(points)
        first, second, third = (np.where(legal, x, 0.25 * self.total) for x in (T1, Ta, T2))
        left, by = slopes(first, second, third, self.total, self.objective)
        low, high, slope = self._slopes_of_Ta(T1, T2, share)
        width = np.where(np.isfinite(high - low), high - low, 0.0)
        unit = _unit(points)
        unit_T1, unit_T2, by_T1, by_Ta, by_T2 = (
            x.ravel().astype(np.float32)
            for x in (unit[0], unit[2], slope[0], width * unit[1], slope[1])
        )
        by[0] = (by[0] + by[1] * by_T1) * unit_T1
        by[2] = (by[2] + by[1] * by_T2) * unit_T2
        by[1] *= by_Ta
        shortest = self.interval * (1.0 + NUDGE)
        fixed = np.zeros((2, 3, share.size), dtype=bool)
        fixed[0] = [(shortest >= T1).ravel(), (share <= 0.0).ravel(), (shortest >= T2).ravel()]
        fixed[1, 1] = (share >= 1.0).ravel()
        steps = proposed_steps(left, by, self.objective, fixed, powers)
        return steps.reshape(3, -1, *share.shape)

    def _value(self, points: Array, bound: Array | None = None) -> Array:
        """Worst residual of candidates, shape (..., n); infinite where one is not legal.

        It may be infinite, too, where it is above its bound, of the same shape.
        """
        T1, _, T2 = points
        Ta, acceleration, legal = self._ramps(points)
        # What is not legal is evaluated as something harmless.
        with np.errstate(divide="ignore", invalid="ignore"):
            jerk = acceleration / np.minimum(T1, T2)
        T1, Ta, T2 = (
            np.where(legal, own, harmless) for own, harmless in ((T1, 1.0), (Ta, 0.0), (T2, 1.0))
        )
        total = np.where(legal.reshape(-1, len(self.total)).any(axis=0), self.total, 4.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bound = np.where(legal, np.inf if bound is None else bound, -1.0)
            worst = symmetric_worst(T1, Ta, T2, total, self.objective, bound)
        # Where nothing vibrates the lowest jerk is the best.
        still = ~self.objective.weights.any(axis=1)
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
        T, centroid, A = self.total, self.centroid, self.A
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
        T, centroid = self.total, self.centroid
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

    def profiles(self, points: Array) -> SymmetricProfiles:
        """The profiles of points, shape (3, n)."""
        T1, _, T2 = points
        Ta = self._ramps(points)[0]
        Tv = self.total - 2.0 * (T1 + Ta + T2)
        return SymmetricProfiles(T1, Ta, T2, np.where(np.abs(Tv) < SHORTEST, 0.0, Tv))

    def _ramps(self, points: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Ta and the acceleration of points; whether each keeps limits and segment durations."""
        T1, share, T2 = points
        T, J = self.total, self.J
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
    T1, share, T2 = points
    return np.stack([REACH[0] * T1, np.full(share.shape, REACH[1]), REACH[2] * T2])
