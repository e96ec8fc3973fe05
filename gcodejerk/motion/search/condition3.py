r"""Design of Condition III: the profile of given duration that leaves the modes most still.

This module owns the search on the amplitude map. Every profile in it has the given T_SUM and length
and keeps the limits; among them the one is taken whose largest residual displacement over all modes
is least. The search has two parts:

* four segments (the paper's Condition III): one free number, T1, whose feasible range has a closed
  form. It is used wherever the conventional profile has four segments itself, so that the
  conventional profile is a member and the result cannot be worse;
* the generalisation with constant acceleration and cruise, where a limit binds: T1, T2 and Ta are
  free, and Ta's feasible range is a closed form of the other two.

Rule 1: no segment is shorter than one command interval; a segment may be absent.
Rule 2: what is compared is the objective, the largest residual displacement of the tool.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles, conventional_profiles
from gcodejerk.motion.residual import Complex, symmetric_response
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, best_in_rows, parts, pick_in_rows

MAP_COLUMNS = 257
"""Values of T1 on the map of four-segment profiles, T_SUM/4 among them."""
RAMP_GRID = 6
"""Values of T1 and of T2 each on the map of general profiles."""
REFINEMENTS = 10
"""Halvings of the step in the search around the best general profile of the map."""
TIE = 1e-7
"""Residuals that differ by less than this are equal, and the lower jerk decides [mm]."""


def four_segment_range(
    total: Array, velocity: Array, acceleration: Array, jerk: Array, interval: float
) -> tuple[Array, Array]:
    r"""Least and greatest T1 of a four-segment profile within limits.

    Parameters
    ----------
    total : ndarray, shape (n,)
        T_SUM. [s]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile. [1/s], [1/s^2], [1/s^3]
    interval : float
        Command interval, the least duration of a segment. [s]

    Returns
    -------
    tuple of ndarray, shape (n,)
        (least, greatest) T1 [s]; no profile is feasible where least > greatest.

    Notes
    -----
    With T2 = T_SUM/2 - T1 the unit profile has V = 1.5/(T_SUM - T1), A = 6/(T_SUM (T_SUM - T1)),
    J1 = A/T1 and J2 = A/T2, each monotone in T1, so each limit is one bound.

    Examples
    --------
    1 mm in 40 ms with 5e6 mm/s^3: the interval of 1 ms binds, the jerk would allow 0.765 ms.

    >>> low, high = four_segment_range(*(np.array([x]) for x in (0.04, 600.0, 5000.0, 5e6)), 1e-3)
    >>> float(low[0]), float(high[0].round(6))
    (0.001, 0.01)
    """
    T = total
    slack = 1.0 + ROUNDING
    V, A, J = velocity * slack, acceleration * slack, jerk * slack
    with np.errstate(invalid="ignore"):
        # J1: T1 (T - T1) >= 6/(T J); J2, with x = T2: x (T/2 + x) >= 6/(T J).
        need = 6.0 / (T * J)
        by_J1 = 0.5 * (T - np.sqrt(T * T - 4.0 * need))
        by_J2 = 0.75 * T - np.sqrt(0.0625 * T * T + need)
    low = np.where(np.isnan(by_J1), np.inf, np.maximum(by_J1, interval))
    high = np.minimum(
        np.minimum(T - 1.5 / V, T - 6.0 / (T * A)), np.minimum(by_J2, 0.5 * T - interval)
    )
    # The ends may cross by rounding where only one profile is left.
    high = np.where((high < low) & (high > low * (1.0 - 1e-7)), low, high)
    return low, high


def design_four_segments(
    total: Array, low: Array, high: Array, objective: Objective
) -> tuple[SymmetricProfiles, Array]:
    """The four-segment profile with the least worst residual, T1 within a range.

    Parameters
    ----------
    total, low, high : ndarray, shape (n,)
        T_SUM and the range of T1. [s]
    objective : Objective
        Of n moves.

    Returns
    -------
    profiles : SymmetricProfiles
        n profiles.
    worst : ndarray, shape (n,)
        Largest residual displacement. [mm]
    """
    poles = objective.poles
    # The map depends on T_SUM alone: rapids that take equally long share its row.
    durations, row = np.unique(total, return_inverse=True)
    fractions = np.linspace(0.0, 1.0, MAP_COLUMNS)[1:-1]
    T1 = 0.5 * durations[:, np.newaxis] * fractions
    amplitude = _displacement(_four(T1, durations[:, np.newaxis]), poles)
    best = np.empty(len(total))
    worst = np.empty(len(total))
    step = 0.5 * total / (MAP_COLUMNS - 1)
    for part in parts(len(total), T1.shape[1] * max(len(poles), 1)):
        columns = T1[row[part]]
        value = objective.take(part).worst(amplitude[row[part]])
        inside = (columns >= low[part, np.newaxis]) & (columns <= high[part, np.newaxis])
        value = np.where(inside, value, np.inf)
        quarter = 0.25 * total[part]
        best[part] = np.where(
            (low[part] <= quarter) & (quarter <= high[part]),
            quarter,
            0.5 * (low[part] + high[part]),
        )
        chosen = _least(value, np.abs(columns - quarter[:, np.newaxis]))
        found, least = pick_in_rows(chosen, columns, value)
        best[part] = np.where(np.isfinite(least), found, best[part])
        # The ends of the range are seldom on the map; T1 of one interval is such an end.
        every = np.stack([best[part], low[part], high[part]], axis=1)
        own = objective.take(part)
        value = own.worst(_displacement(_four(every, total[part, np.newaxis]), poles))
        chosen = _least(value, np.abs(every - quarter[:, np.newaxis]))
        (best[part],) = pick_in_rows(chosen, every)
        best[part], worst[part] = _refine_T1(
            best[part], step[part], low[part], high[part], total[part], own
        )
    return _four(best, total), worst


def _refine_T1(
    T1: Array, step: Array, low: Array, high: Array, total: Array, objective: Objective
) -> tuple[Array, Array]:
    """Zoom in on the best T1 of the map, keeping what is not better by more than a tie."""
    poles = objective.poles
    worst = objective.of(_four(T1, total))
    around = np.array([-1.0, -0.5, 0.5, 1.0])
    for _ in range(8):
        every = np.clip(
            T1[:, np.newaxis] + step[:, np.newaxis] * around,
            low[:, np.newaxis],
            high[:, np.newaxis],
        )
        value = objective.worst(_displacement(_four(every, total[:, np.newaxis]), poles))
        found, least = best_in_rows(value, every, value)
        better = least < worst - 0.01 * TIE
        T1, worst = np.where(better, found, T1), np.where(better, least, worst)
        step = 0.25 * step
    return T1, worst


def design_condition3(
    total: Array,
    velocity: Array,
    acceleration: Array,
    jerk: Array,
    objective: Objective,
    interval: float,
    conventional: SymmetricProfiles,
) -> tuple[SymmetricProfiles, Array, NDArray[np.bool_]]:
    """The general profile of given duration with the least worst residual within limits.

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
    conventional : SymmetricProfiles
        The profiles to improve on; stretched to T_SUM they are candidates, where they are within
        limits.

    Returns
    -------
    profiles : SymmetricProfiles
        n profiles; meaningless where `feasible` is False.
    worst : ndarray, shape (n,)
        Largest residual displacement, infinite where no profile is feasible. [mm]
    feasible : ndarray of bool, shape (n,)
        Whether the search found a profile within the limits.
    """
    n = len(total)
    columns = [np.empty(n) for _ in range(4)]
    worst = np.empty(n)
    fastest = conventional_profiles(velocity, acceleration, jerk, interval)
    for part in parts(n, RAMP_GRID * RAMP_GRID * 2):
        search = _GeneralSearch(
            total[part],
            velocity[part],
            acceleration[part],
            jerk[part],
            objective.take(part),
            interval,
        )
        profiles, worst[part] = search.run([conventional.take(part), fastest.take(part)])
        for column, new in zip(columns, profiles.columns(), strict=True):
            column[part] = new
    feasible = np.isfinite(worst)
    if not len(objective.poles):
        # The search went by the jerk; nothing vibrates.
        worst = np.where(feasible, 0.0, np.inf)
    return SymmetricProfiles(*columns), worst, feasible


COMPASS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
"""Steps of the refinement, in T1, T2 and the share of Ta's range."""


class _Points(NamedTuple):
    """A point of the search for each row: T1, T2, the share of Ta's range, the worst residual."""

    T1: Array
    T2: Array
    share: Array
    worst: Array


class _GeneralSearch:
    """One batch of the general search: the feasible range of Ta, the map, and the refinement."""

    def __init__(
        self,
        total: Array,
        V: Array,
        A: Array,
        J: Array,
        objective: Objective,
        interval: float,
    ) -> None:
        slack = 1.0 + ROUNDING
        self.total, self.V, self.A, self.J = total, V * slack, A * slack, J * slack
        self.objective, self.interval = objective, interval
        # V = 1/(T_SUM - 2 centroid): the velocity limit is a limit of the centroid.
        self.centroid = 0.5 * (total - 1.0 / self.V)

    def run(self, known: list[SymmetricProfiles]) -> tuple[SymmetricProfiles, Array]:
        """Known profiles stretched to T_SUM, the map, and the refinement of the best of them."""
        n = len(self.total)
        best = _Points(np.ones(n), np.ones(n), np.zeros(n), np.full(n, np.inf))
        for profiles in known:
            best = self._better(best, self._stretched(profiles))
        best = self._better(best, self._map())
        step = np.maximum(0.25 * np.maximum(best.T1, best.T2), self.interval)
        step_share = np.full(n, 0.5)
        for _ in range(REFINEMENTS):
            T1 = best.T1[:, np.newaxis] + step[:, np.newaxis] * COMPASS[:, 0]
            T2 = best.T2[:, np.newaxis] + step[:, np.newaxis] * COMPASS[:, 1]
            share = best.share[:, np.newaxis] + step_share[:, np.newaxis] * COMPASS[:, 2]
            worst = best.worst
            T1, T2 = np.maximum(T1, self.interval), np.maximum(T2, self.interval)
            best = self._better(best, self._least(T1, T2, np.clip(share, 0.0, 1.0)))
            moved = best.worst < worst
            step, step_share = (np.where(moved, x, 0.5 * x) for x in (step, step_share))
        profiles, _ = self._profiles(best.T1, best.T2, best.share)
        return profiles, best.worst

    def _better(self, best: _Points, other: _Points) -> _Points:
        """The better of two points in each row; the first unless the second gains something."""
        better = other.worst < best.worst - 0.01 * TIE
        return _Points(*(np.where(better, new, old) for old, new in zip(best, other, strict=True)))

    def _least(self, T1: Array, T2: Array, share: Array) -> _Points:
        """The best of the candidates of each row, arrays of shape (n, k)."""
        value = self._value(T1, T2, share)
        return _Points(*best_in_rows(value, T1, T2, share, value))

    def _stretched(self, profiles: SymmetricProfiles) -> _Points:
        """SymmetricProfiles stretched to T_SUM, as points of the search."""
        stretch = self.total / profiles.total
        T1 = np.maximum(profiles.T1 * stretch, self.interval)
        T2 = np.maximum(profiles.T2 * stretch, self.interval)
        low, high = self._range_of_Ta(T1, T2)
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.clip((profiles.Ta * stretch - low) / (high - low), 0.0, 1.0)
        share = np.where(np.isfinite(share), share, 0.0)
        return self._least(T1[:, np.newaxis], T2[:, np.newaxis], share[:, np.newaxis])

    def _map(self) -> _Points:
        """The best of a grid over T1 and T2, Ta at both ends of its range."""
        n, k, least = len(self.total), RAMP_GRID, self.interval
        fractions = np.linspace(0.0, 1.0, k)
        # With Ta = 0 the centroid is (2 T1 + T2)/3: its limit bounds both.
        longest = np.maximum(np.array([[1.5], [3.0]]) * self.centroid, least) / least
        T1, T2 = least * longest[..., np.newaxis] ** fractions
        shape = (n, k, k, 2)
        every_T1 = np.broadcast_to(T1[:, :, np.newaxis, np.newaxis], shape).reshape(n, -1)
        every_T2 = np.broadcast_to(T2[:, np.newaxis, :, np.newaxis], shape).reshape(n, -1)
        every_share = np.broadcast_to(np.array([0.0, 1.0]), shape).reshape(n, -1)
        return self._least(every_T1, every_T2, every_share)

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

    def _profiles(
        self, T1: Array, T2: Array, share: Array
    ) -> tuple[SymmetricProfiles, NDArray[np.bool_]]:
        """The profiles of these coordinates; whether each keeps limits and segment durations."""
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

    def _value(self, T1: Array, T2: Array, share: Array) -> Array:
        """Worst residual of candidates, shape (n, k); infinite where one is not legal."""
        profiles, legal = self._profiles(T1, T2, share)
        value = np.full(T1.shape, np.inf)
        rows = np.nonzero(legal)[0]
        flat = SymmetricProfiles(*(column[legal] for column in profiles.columns()))
        if len(self.objective.poles):
            value[legal] = self.objective.take(rows).of(flat)
        else:
            # Nothing vibrates: the lowest jerk is the best, far below any tie with a residual.
            value[legal] = flat.jerk
        return value


def _four(T1: Array, total: Array) -> SymmetricProfiles:
    """Four-segment profiles of these T1 and T_SUM."""
    T1, T = np.broadcast_arrays(T1, total)
    zero = np.zeros(T1.shape)
    return SymmetricProfiles(np.array(T1), zero, 0.5 * T - T1, zero)


def _displacement(profiles: SymmetricProfiles, poles: Complex) -> Array:
    """Displacement envelopes of unit profiles for weight 1, shape (..., m) [-]."""
    shape = profiles.T1.shape
    flat = SymmetricProfiles(*(column.ravel() for column in profiles.columns()))
    amplitude: Array = np.abs(symmetric_response(flat, poles)) / poles.imag
    return amplitude.reshape(*shape, len(poles))


def _least(value: Array, tie_break: Array) -> NDArray[np.intp]:
    """Column of the least value in each row; among ties the one with the least tie_break."""
    least = value.min(axis=1, keepdims=True)
    tied = value <= least + TIE
    column: NDArray[np.intp] = np.argmin(np.where(tied, tie_break, np.inf), axis=1)
    return column
