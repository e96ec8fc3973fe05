r"""Design of symmetric profiles: T1, Ta and T2 of the ramps, and the cruise that is left between.

This module owns the global search in the family that Condition III and its generalisation belong
to. T_SUM is given, so three numbers are free; the limits of velocity and acceleration bound Ta by a
closed form of the other two, so that a candidate is T1, T2 and a share of Ta's range. What a mode
keeps has many valleys over these three: a grid finds them, the best of each stretch of T1 are
descended at once, and those that lead go on to the bottom.

Rule 1: no segment is shorter than one command interval; a segment may be absent.
Rule 2: what is compared is the objective, the largest residual displacement of the tool.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles, conventional_profiles
from gcodejerk.motion.search.candidates import FEW_POLES, symmetric_worst
from gcodejerk.motion.search.condition3 import four_segment_range
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, parts

LINE = 17
"""Values of T1 of the four-segment profiles that are looked at."""
BISECTIONS = 24
"""For the longest T1 and T2 that the limits leave."""


class _Effort(NamedTuple):
    """How thoroughly a search looks: fewer frequencies to look at leave time for more profiles."""

    ramps: int
    """Values of T1 and of T2 on the grid."""
    shares: int
    """Of Ta's range."""
    descents: int
    rounds: int
    leaders: int
    final: int
    """Rounds of the leaders' descent."""


EFFORTS = (_Effort(20, 6, 22, 14, 8, 40), _Effort(12, 5, 12, 8, 4, 24))
"""For at most `FEW_POLES` frequencies, and for more."""
SPREAD = 1.6
"""Power by which the grid is denser at short ramps."""
EVERY = 5
"""Of the grid, one in so many is looked at first: it bounds the others of its stretch."""
GROWS, SHRINKS = 1.3, 0.7
"""What a descent's step is multiplied by where it has found something better, and where not."""


def _directions(rounds: int) -> list[Array]:
    """Orthogonal steps, turned from round to round.

    The worst of several modes has edges, along which the same few directions would find nothing.
    """
    random = np.random.default_rng(2021)
    # Rounded: the same steps whatever library has solved this.
    turned = (np.linalg.qr(random.normal(size=(3, 3)))[0].round(6) for _ in range(rounds))
    return [np.concatenate([matrix, -matrix]) for matrix in turned]


DIRECTIONS = _directions(max(effort.rounds + effort.final for effort in EFFORTS))


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
    effort = EFFORTS[len(objective.poles) > FEW_POLES]
    columns, feasible = [np.ones(n) for _ in range(4)], np.zeros(n, dtype=bool)
    fastest = conventional_profiles(velocity, acceleration, jerk, interval)
    for part in parts(n, effort.ramps**2 * effort.shares):
        search = _Search(
            total[part], velocity[part], acceleration[part], jerk[part], objective.take(part),
            interval, effort,
        )  # fmt: skip
        starts = [profiles.take(part) for profiles in (*known, fastest)]
        profiles, feasible[part] = search.run(starts)
        for column, new in zip(columns, profiles.columns(), strict=True):
            column[part] = new
    return SymmetricProfiles(*columns), feasible


class _Search:
    """One batch of moves; the last axis of points is T1, T2 and the share of Ta's range."""

    def __init__(
        self, total: Array, V: Array, A: Array, J: Array, objective: Objective, interval: float,
        effort: _Effort,
    ) -> None:  # fmt: skip
        slack = 1.0 + ROUNDING
        self.total, self.V, self.A, self.J = total, V * slack, A * slack, J * slack
        self.objective, self.interval, self.effort = objective, interval, effort
        # V = 1/(T_SUM - 2 centroid): the velocity limit is a limit of the centroid.
        self.centroid = 0.5 * (total - 1.0 / self.V)

    def run(self, known: list[SymmetricProfiles]) -> tuple[SymmetricProfiles, NDArray[np.bool_]]:
        """The grid, a descent from the best of each stretch of T1, and the leaders' to the end."""
        effort = self.effort
        points, stretch = self._candidates(known)
        value = self._best_of_stretches(points, stretch)
        each = [
            np.where(stretch == k, value, np.inf).argmin(axis=1) for k in range(stretch[-1] + 1)
        ]
        points, value = _picked(np.stack(each, axis=1), points, value)
        points, value = _best(effort.descents, points, value)
        step = np.concatenate([0.3 * points[..., :2], np.full((*value.shape, 1), 0.25)], axis=-1)
        points, value, step = self._descend(points, value, step, DIRECTIONS[: effort.rounds])
        points, value, step = _best(effort.leaders, points, value, step)
        last = DIRECTIONS[effort.rounds : effort.rounds + effort.final]
        points, value, _ = self._descend(points, value, step, last)
        points, value = (x[:, 0] for x in _best(1, points, value))
        return self._profiles(points)[0], np.isfinite(value)

    def _best_of_stretches(self, points: Array, stretch: NDArray[np.intp]) -> Array:
        """Values of candidates; those may be infinite that are not the best of their stretch."""
        some = np.arange(0, len(stretch), EVERY)
        first = self._value(points[:, some])
        least = np.full((len(points), int(stretch[-1]) + 1), np.inf)
        for k in range(least.shape[1]):
            here = stretch[some] == k
            if here.any():
                least[:, k] = first[:, here].min(axis=1)
        return self._value(points, least[:, stretch])

    def _candidates(self, known: list[SymmetricProfiles]) -> tuple[Array, NDArray[np.intp]]:
        """Points of the grid, of four segments and of known profiles; each one's stretch of T1."""
        n, effort, dt = len(self.total), self.effort, self.interval
        spread = (np.linspace(0.0, 1.0, effort.ramps) ** SPREAD).round(12)
        T1, T2 = (dt + (self._longest(which) - dt)[:, np.newaxis] * spread for which in (0, 1))
        share = np.linspace(0.0, 1.0, effort.shares)
        shape = (n, effort.ramps, effort.ramps, effort.shares)
        grid = np.stack(
            [
                np.broadcast_to(T1[:, :, np.newaxis, np.newaxis], shape),
                np.broadcast_to(T2[:, np.newaxis, :, np.newaxis], shape),
                np.broadcast_to(share, shape),
            ],
            axis=-1,
        ).reshape(n, -1, 3)
        stretch = np.repeat(np.arange(effort.ramps), effort.ramps * effort.shares)
        low, high = four_segment_range(self.total, self.V, self.A, self.J, dt)
        low, high = np.where(low <= high, low, dt), np.where(low <= high, high, dt)
        first = low[:, np.newaxis] + (high - low)[:, np.newaxis] * np.linspace(0.0, 1.0, LINE)
        line = np.stack(
            [first, 0.5 * self.total[:, np.newaxis] - first, np.zeros(first.shape)], axis=-1
        )
        own = np.stack([self._stretched(profiles) for profiles in known], axis=1)
        behind = np.repeat([effort.ramps, effort.ramps + 1], [LINE, len(known)])
        return np.concatenate([grid, line, own], axis=1), np.concatenate([stretch, behind])

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
        T1 = np.maximum(profiles.T1 * stretch, self.interval)
        T2 = np.maximum(profiles.T2 * stretch, self.interval)
        low, high = self._range_of_Ta(T1, T2)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip((profiles.Ta * stretch - low) / (high - low), 0.0, 1.0)
        return np.stack([T1, T2, np.where(np.isfinite(share), share, 0.0)], axis=-1)

    def _descend(
        self, points: Array, value: Array, step: Array, directions: list[Array]
    ) -> tuple[Array, Array, Array]:
        """Steps downhill from k points of each move, shapes (n, k, 3), (n, k) and (n, k, 3)."""
        for turned in directions:
            near = points[:, :, np.newaxis] + step[:, :, np.newaxis] * turned
            np.maximum(near[..., :2], self.interval, out=near[..., :2])
            np.clip(near[..., 2], 0.0, 1.0, out=near[..., 2])
            bound = np.repeat(value, near.shape[2], axis=1)
            found = self._value(near.reshape(len(near), -1, 3), bound).reshape(near.shape[:3])
            chosen = found.argmin(axis=2)[..., np.newaxis]
            least = np.take_along_axis(found, chosen, axis=2)[..., 0]
            better = least < value
            there = np.take_along_axis(near, chosen[..., np.newaxis], axis=2)[:, :, 0]
            points = np.where(better[..., np.newaxis], there, points)
            value = np.where(better, least, value)
            step = step * np.where(better, GROWS, SHRINKS)[..., np.newaxis]
        return points, value, step

    def _value(self, points: Array, bound: Array | None = None) -> Array:
        """Worst residual of candidates, shape (n, k); infinite where one is not legal.

        It may be infinite, too, where it is above its bound, of the same shape.
        """
        profiles, legal = self._profiles(points)
        # What is not legal is evaluated as something harmless.
        T1, Ta, T2 = (
            np.where(legal, own, harmless)
            for own, harmless in ((profiles.T1, 1.0), (profiles.Ta, 0.0), (profiles.T2, 1.0))
        )
        total = np.where(legal.any(axis=1), self.total, 4.0)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            bound = np.where(legal, np.inf if bound is None else bound, -1.0)
            worst = symmetric_worst(T1, Ta, T2, total, self.objective, bound)
            jerk = profiles.jerk
        # Where nothing vibrates the lowest jerk is the best.
        still = ~self.objective.weights.any(axis=1, keepdims=True)
        return np.where(legal, np.where(still, jerk, worst), np.inf)

    def _range_of_Ta(self, T1: Array, T2: Array) -> tuple[Array, Array]:
        """Least and greatest Ta for given T1 and T2: from A and from V and T_SUM.

        Both limits are quadratic in Ta, since the ramp's moment is.
        """
        shape = (len(self.total),) + (1,) * (T1.ndim - 1)
        T, centroid, A = (x.reshape(shape) for x in (self.total, self.centroid, self.A))
        half = 0.5 * (T1 + T2)
        moment = T1 * T1 / 3.0 + 0.5 * T1 * T2 + T2 * T2 / 6.0
        b = T1 + 0.5 * T2 - centroid
        p = 0.5 * T - T1 - 0.5 * T2
        with np.errstate(invalid="ignore"):
            high = np.minimum(
                -b + np.sqrt(b * b - 2.0 * (moment - centroid * half)), 0.5 * T - T1 - T2
            )
            low = p - np.sqrt(p * p + half * T - 2.0 * moment - 1.0 / A)
        return np.maximum(low, 0.0), high

    def _profiles(self, points: Array) -> tuple[SymmetricProfiles, NDArray[np.bool_]]:
        """The profiles of points; whether each keeps limits and segment durations."""
        T1, T2, share = points[..., 0], points[..., 1], points[..., 2]
        T = self.total.reshape((len(self.total),) + (1,) * (T1.ndim - 1))
        J = self.J.reshape(T.shape)
        low, high = self._range_of_Ta(T1, T2)
        dt = self.interval * (1.0 - ROUNDING)
        Ta = low + share * (high - low)
        # A segment that would be shorter than the interval vanishes or grows to it.
        grown = np.where(low <= 0.0, 0.0, self.interval)
        Ta = np.where(Ta < dt, grown, Ta)
        room = 0.5 * T - T1 - T2
        Tv = 2.0 * (room - Ta)
        closed = np.where(Tv < 0.5 * self.interval, room, room - 0.5 * self.interval)
        Ta = np.where(Tv < dt, closed, Ta)
        Ta = np.where(np.abs(Ta) < 1e-12, 0.0, Ta)
        Tv = 2.0 * (room - Ta)
        Tv = np.where(np.abs(Tv) < 1e-12, 0.0, Tv)
        with np.errstate(invalid="ignore", divide="ignore"):
            profiles = SymmetricProfiles(T1, Ta, T2, Tv)
            tolerance = 1e-12
            legal = (
                (low <= high + tolerance)
                & (Ta >= low - tolerance)
                & (Ta <= high + tolerance)
                & ((Ta == 0.0) | (Ta >= dt))
                & ((Tv == 0.0) | (Tv >= dt))
                & (np.minimum(T1, T2) >= dt)
                & (profiles.acceleration <= J * np.minimum(T1, T2))
            )
        return profiles, legal


def _best(k: int, points: Array, value: Array, *more: Array) -> tuple[Array, ...]:
    """The k best points of each row, the first among equals, and what belongs to them."""
    return _picked(np.argsort(value, axis=1, kind="stable")[:, :k], points, value, *more)


def _picked(index: NDArray[np.intp], *columns: Array) -> tuple[Array, ...]:
    """Some entries of each row, of columns of shape (n, k) or (n, k, 3)."""
    row = np.arange(len(index))[:, np.newaxis]
    return tuple(column[row, index] for column in columns)
