"""Designs: for each profile, how the profiles of many moves are found in the time that they have.

This module owns the table from a profile's name to its design. A design gets moves as columns
(their time, their limits, what they excite) and gives a profile for each, with what it leaves. When
a design is used, and what happens where it finds nothing, the planner decides.

Rule: a design changes no move's time, but for `shortest`, whose result the time is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import (
    Objective,
    Profiles,
    SymmetricProfiles,
    design_condition3,
    design_four_segments,
    four_segment_range,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.cascade import design_cascade
from gcodejerk.motion.search.conditions import design_condition
from gcodejerk.motion.search.optimal import Move, Optimum, optimum_profiles
from gcodejerk.motion.search.socp import require_solver
from gcodejerk.planning.conventional import conventional_limits, todays_profiles, unit_limits
from gcodejerk.planning.optima import Progress, Question, answers
from gcodejerk.planning.plans import Modes, Plans

ALLOWED = 0.97
"""Share of the tolerance that a profile may use; rounding to the resolution needs some, too."""
COARSE = 24
"""Moves of so few intervals may gain from segments that end between them."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Moves to be designed, columns of n.

    Attributes
    ----------
    counts : ndarray of int, shape (n,)
        T_SUM. [intervals]
    limits : tuple of ndarray, shape (n,)
        Velocity, acceleration and jerk of the unit profiles. [1/s], [1/s^2], [1/s^3]
    conventional : Profiles
        What the controller does today.
    symmetric : SymmetricProfiles
        The fastest symmetric profiles within the same limits: what the controller does, but for a
        bell.
    objective : Objective
        What they are judged by.
    interval, band, tolerance : float
        Of the machine. [s], [-], [mm]
    progress : callable or None
        For designs that take long.
    """

    counts: NDArray[np.int64]
    limits: tuple[Array, Array, Array]
    conventional: Profiles
    symmetric: SymmetricProfiles
    objective: Objective
    interval: float
    band: float
    tolerance: float
    progress: Progress | None = None

    @classmethod
    def of(
        cls, machine: Machine, modes: Modes, share: Array, counts: NDArray[np.int64] | None = None,
        progress: Progress | None = None, speed: Array | None = None,
        lone: NDArray[np.bool_] | None = None,
    ) -> Task:  # fmt: skip
        """Moves on a machine.

        Parameters
        ----------
        machine : Machine
            Its limits and what it says of designs.
        modes : Modes
            Those that count, of that machine.
        share : ndarray, shape (n, 9)
            Displacement of each axis. [mm] or [deg]
        counts : ndarray of int, shape (n,), optional
            T_SUM; the conventional time rounded up by default. [intervals]
        progress : callable, optional
            See `Progress`.
        speed : ndarray, shape (n,), optional
            Speed that the program states, which no unit profile exceeds; NaN for none. [1/s]
        lone : ndarray of bool, shape (n,), optional
            No other motion follows directly (`Axis.conventional`); all of them by default.

        Returns
        -------
        Task
        """
        rapid, limits = conventional_limits(machine, share, lone), unit_limits(machine, share)
        if speed is not None:
            rapid, limits = ((np.fmin(V, speed), A, J) for V, A, J in (rapid, limits))
        symmetric, conventional = todays_profiles(machine, rapid)
        if counts is None:
            counts = np.maximum(whole_intervals(conventional.total, machine.interval), 1)
        weights = np.abs(share @ modes.participation.T)
        return cls(
            counts=counts,
            limits=limits,
            conventional=conventional,
            symmetric=symmetric,
            objective=Objective(modes.poles, weights, modes.group),
            interval=machine.interval,
            band=machine.design.band,
            tolerance=machine.design.tolerance,
            progress=progress,
        )

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def total(self) -> Array:
        """T_SUM, shape (n,) [s]."""
        return np.asarray(self.counts * self.interval, dtype=np.float64)

    def take(self, index: NDArray[np.intp] | NDArray[np.bool_]) -> Task:
        """Some of the moves."""
        return replace(
            self,
            counts=self.counts[index],
            limits=(self.limits[0][index], self.limits[1][index], self.limits[2][index]),
            conventional=self.conventional.take(index),
            symmetric=self.symmetric.take(index),
            objective=self.objective.take(index),
        )

    def after(self, counts: NDArray[np.int64]) -> Task:
        """The same moves in other times."""
        return replace(self, counts=counts)


Design = Callable[[Task], tuple[Profiles, Array]]
"""Profiles of the moves, and the largest residual of each [mm], infinite where there is none."""


def condition3(task: Task) -> tuple[Profiles, Array]:
    """Condition III, or its generalisation where a limit binds."""
    V, A, J = task.limits
    conventional, total = task.symmetric, task.total
    # Four segments where the conventional profile has them: it is then a member of the family.
    four = (conventional.Ta == 0.0) & (conventional.Tv == 0.0)
    low, high = four_segment_range(total, V, A, J, task.interval)
    four &= low <= high
    profiles, worst = conventional, np.full(len(task), np.inf)
    index = np.nonzero(four)[0]
    found, worst[index] = design_four_segments(
        total[index], low[index], high[index], task.objective.take(index)
    )
    profiles = profiles.replaced(index, found)
    index = np.nonzero(~four)[0]
    found, worst[index], _ = design_condition3(
        total[index], V[index], A[index], J[index], task.objective.take(index),
        task.interval, conventional.take(index),
    )  # fmt: skip
    # A profile that is not feasible may have no shape at all.
    feasible = index[np.isfinite(worst[index])]
    profiles = profiles.replaced(feasible, found.take(np.isfinite(worst[index])))
    return profiles.general(), worst


def condition1(task: Task) -> tuple[Profiles, Array]:
    """Condition I at its best T1."""
    return design_condition("I", task.total, *task.limits, task.objective, task.interval)


def condition2(task: Task) -> tuple[Profiles, Array]:
    """Condition II at its best T1."""
    return design_condition("II", task.total, *task.limits, task.objective, task.interval)


def cascade(task: Task) -> tuple[Profiles, Array]:
    """Moving averages as wide as the modes' periods, in the unchanged time."""
    profiles, worst = design_cascade(task.total, *task.limits, task.objective, task.interval)
    return _with(task.conventional, np.isfinite(worst), profiles), worst


def optimal(task: Task) -> tuple[Profiles, Array]:
    """The least worst residual over the band, of all profiles there are.

    The programme knows jerks that change at whole intervals only. Where a profile of another
    design, whose segments need not end there, is better still, that one is taken.
    """
    profiles, worst = task.conventional, np.full(len(task), np.inf)
    rows = np.nonzero(task.objective.weights.any(axis=1))[0]
    reference = task.objective.of(task.conventional)
    found = answers([_question(task, k, float(reference[k])) for k in rows], task.progress)
    profiles, worst = _answered(task, rows, found, profiles, worst)
    everything = np.ones(len(task), dtype=bool)
    for rival, where in (
        (condition3, everything),
        (cascade, everything),
        (condition1, task.counts <= COARSE),
        (condition2, task.counts <= COARSE),
    ):
        index = np.nonzero(where)[0]
        others, nominal = rival(task.take(index))
        residual = np.full(len(task), np.inf)
        # The band is looked at only where the modes' own frequencies leave a hope.
        hope = np.isfinite(nominal) & (nominal < worst[index])
        residual[index[hope]] = worst_in_band(task.take(index[hope]), others.take(hope))
        better = residual < worst
        profiles = profiles.replaced(better, others.take(better[index]))
        worst = np.where(better, residual, worst)
    return profiles, worst


def shortest(task: Task, longest: NDArray[np.int64]) -> tuple[Profiles, Array, NDArray[np.int64]]:
    """The least time in which no mode is left with more than the tolerance, over the band.

    Parameters
    ----------
    task : Task
        Its counts are the least that the limits allow.
    longest : ndarray of int, shape (n,)
        The most that is tried. [intervals]

    Returns
    -------
    profiles, worst : Profiles and ndarray, shape (n,)
        As of a `Design`.
    counts : ndarray of int, shape (n,)
        T_SUM of each. [intervals]

    Notes
    -----
    A move that can rest for an interval and then begin can do in n + 1 intervals what it can in n:
    so the time is found by bisection.
    """
    task = replace(task, tolerance=ALLOWED * task.tolerance)
    low, high = task.counts - 1, longest.copy()
    reference = task.objective.of(task.conventional)
    possible = np.isfinite(_quiet(task.after(high), reference)[1])
    while True:
        rows = np.nonzero(possible & (high - low > 1))[0]
        if not len(rows):
            break
        middle = (low[rows] + high[rows]) // 2
        quiet = np.isfinite(_quiet(task.take(rows).after(middle), reference[rows])[1])
        high[rows[quiet]] = middle[quiet]
        low[rows[~quiet]] = middle[~quiet]
    final = task.after(high)
    profiles, worst = _quiet(final, reference)
    # Within the tolerance all are equal: the smoothest is taken.
    rows = np.nonzero(possible & task.objective.weights.any(axis=1))[0]
    questions = [
        _question(final, k, float(reference[k]), task.tolerance, smooth=True) for k in rows
    ]
    return *_answered(final, rows, answers(questions, task.progress), profiles, worst), high


def _quiet(task: Task, reference: Array) -> tuple[Profiles, Array]:
    """Profiles within the tolerance over the band, of Condition III or optimal; else infinite."""
    profiles, nominal = condition3(task)
    worst = np.full(len(task), np.inf)
    hope = nominal <= task.tolerance
    worst[hope] = worst_in_band(task.take(hope), profiles.take(hope))
    worst = np.where(worst <= task.tolerance, worst, np.inf)
    rows = np.nonzero(~np.isfinite(worst))[0]
    questions = [_question(task, k, float(reference[k]), task.tolerance) for k in rows]
    return _answered(task, rows, answers(questions, task.progress), profiles, worst)


def bounds(task: Task) -> Array:
    """The least residual that any profile within the limits leaves, at the modes' own frequencies.

    Parameters
    ----------
    task : Task
        The moves.

    Returns
    -------
    ndarray, shape (n,)
        NaN where no profile on the grid keeps the limits. [mm]

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    nominal = replace(task, band=0.0)
    least = np.where(task.objective.weights.any(axis=1), np.nan, 0.0)
    rows = np.nonzero(np.isnan(least))[0]
    reference = task.objective.of(task.conventional)
    found = answers([_question(nominal, k, float(reference[k])) for k in rows], task.progress)
    for k, optimum in zip(rows, found, strict=True):
        least[k] = np.nan if optimum is None else optimum.worst
    return least


def least_residuals(plans: Plans, progress: Progress | None = None) -> Array:
    """How still the tool could be at best after each planned move, in the time that it has.

    Parameters
    ----------
    plans : Plans
        n moves.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    ndarray, shape (n,)
        Largest residual displacement over the modes, at their own frequencies; NaN where a move is
        not planned or no profile on the grid keeps the limits. Of axes that move each on its own, a
        mode that several of them excite is left out: they might cancel each other. [mm]

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    task = Task.of(plans.machine, plans.modes, plans.share, plans.profile_counts, progress)
    excited = np.zeros((len(plans), len(plans.modes.poles)), dtype=np.int64)
    np.add.at(excited, plans.move, task.objective.weights > 0.0)
    weights = np.where(excited[plans.move] > 1, 0.0, task.objective.weights)
    task = replace(task, objective=replace(task.objective, weights=weights))
    least = np.where(plans.planned, 0.0, np.nan)
    with np.errstate(invalid="ignore"):
        np.maximum.at(least, plans.move, bounds(task))
    return least


def known_limits(plans: Plans, progress: Progress | None = None) -> Array | None:
    """The same for reports: None where the solver is not installed, since all else is known."""
    try:
        require_solver()
    except PlanError:
        return None
    return least_residuals(plans, progress)


def worst_in_band(task: Task, profiles: Profiles) -> Array:
    """Largest residual displacement of profiles with every frequency anywhere within the band.

    Parameters
    ----------
    task : Task
        The moves.
    profiles : Profiles
        One for each.

    Returns
    -------
    ndarray, shape (n,)
        [mm]
    """
    worst = np.zeros(len(task))
    total = profiles.total
    # A longer move needs more frequencies: moves of like duration together.
    octave = np.frexp(total)[1]
    for k in np.unique(octave):
        index = np.nonzero(octave == k)[0]
        objective = task.objective.take(index).in_band(task.band, float(total[index].max()))
        worst[index] = objective.of(profiles.take(index))
    return worst


def _question(
    task: Task, row: np.intp, reference: float, allowed: float = 0.0, smooth: bool = False
) -> Question:
    """What is asked about one of the moves."""
    V, A, J = (float(limit[row]) for limit in task.limits)
    objective = task.objective
    move = Move(
        int(task.counts[row]), V, A, J, objective.poles, objective.weights[row], objective.group,
        task.band, task.interval,
    )  # fmt: skip
    return Question(move, reference, allowed, smooth)


def _answered(
    task: Task,
    rows: NDArray[np.intp],
    found: list[Optimum | None],
    profiles: Profiles,
    worst: Array,
) -> tuple[Profiles, Array]:
    """Profiles and residuals with those of the answers in the place of what they answer."""
    solved = [(row, optimum) for row, optimum in zip(rows, found, strict=True) if optimum]
    if not solved:
        return profiles, worst
    index = np.array([row for row, _ in solved])
    worst = worst.copy()
    worst[index] = [optimum.worst for _, optimum in solved]
    optima = [optimum for _, optimum in solved]
    return profiles.replaced(index, optimum_profiles(optima, task.interval)), worst


def _with(profiles: Profiles, where: NDArray[np.bool_], others: Profiles) -> Profiles:
    """These profiles with others in some places; both have a profile for each move."""
    return profiles.replaced(where, others.take(where))


DESIGNS: dict[str, Design] = {
    "condition1": condition1,
    "condition2": condition2,
    "condition3": condition3,
    "cascade": cascade,
    "optimal": optimal,
}
"""The profiles that keep a move's time."""
