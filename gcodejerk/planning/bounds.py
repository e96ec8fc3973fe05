"""Bounds: how still the tool could be at best after a planned move, whatever its profile.

This module owns what reports call the limit: the optimum of the problem that the designs try to
solve, without their families and without a guard.

Rule: a bound is judged when the move is: under `positioning: independent` at the last arrival, and
together for axes that excite the same modes, since what one of them leaves may cancel the others'.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion import grouped, profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.socp import require_solver
from gcodejerk.planning.designs import move_of, question_of
from gcodejerk.planning.optima import Progress, Question, answers
from gcodejerk.planning.plans import Plans, same_rows
from gcodejerk.planning.task import Task
from gcodejerk.storage import gathered

NOTHING, NULL = 1e-3, 1e-6
"""A bound is 0 where no more than this share of today's residual can be left: over a band, and at
the modes' own frequencies."""


def bounds(task: Task) -> Array:
    """The least residual that any profile within the limits leaves over the task's band.

    Parameters
    ----------
    task : Task
        The moves; with a band of 0, at the modes' own frequencies.

    Returns
    -------
    ndarray, shape (n,)
        NaN where no profile on the grid keeps the limits. [mm]

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    least = np.where(task.objective.weights.any(axis=1), np.nan, 0.0)
    rows = np.nonzero(np.isnan(least))[0]
    reference = task.objective.of(task.conventional)
    if task.band:
        # Over a band there is no null, but where next to nothing can be left it is soon found.
        rows = rows[reference[rows] > 0.0]
        nothing = [question_of(task, k, float(reference[k]), NOTHING * reference[k]) for k in rows]
        possible = np.array([x is not None for x in answers(nothing, task.progress)], dtype=bool)
        least[rows[possible]] = 0.0
        rows = np.nonzero(np.isnan(least))[0]
    found = answers([question_of(task, k, float(reference[k])) for k in rows], task.progress)
    for k, optimum in zip(rows, found, strict=True):
        least[k] = np.nan if optimum is None else optimum.worst
    return least


def least_residuals(plans: Plans, progress: Progress | None = None, band: float = 0.0) -> Array:
    """How still the tool could be at best after each planned move, in the time that it has.

    Parameters
    ----------
    plans : Plans
        n moves.
    progress : callable, optional
        See `Progress`.
    band : float, optional
        Relative error of the modes' frequencies; their own by default. [-]

    Returns
    -------
    ndarray, shape (n,)
        Largest residual displacement over the modes, and over the band; NaN where a move is
        not planned or no profile on the grid keeps the limits. [mm]

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    task = Task.of(plans.machine, plans.modes, plans.share, plans.profile_counts, progress)
    task = replace(task, band=band)
    sets = list(_not_alone(plans))
    alone = np.ones(len(task), dtype=bool)
    alone[list(itertools.chain.from_iterable(sets))] = False
    least = np.where(plans.planned, 0.0, np.nan)
    with np.errstate(invalid="ignore"):
        np.maximum.at(least, plans.move[alone], bounds(task.take(alone)))
        first = np.array([rows[0] for rows in sets], dtype=np.intp)
        np.maximum.at(least, plans.move[first], _joint_bounds(plans, task, sets))
    return least


def known_limits(plans: Plans, progress: Progress | None = None, band: float = 0.0) -> Array | None:
    """The same for reports: None where the solver is not installed, since all else is known."""
    try:
        require_solver()
    except PlanError:
        return None
    counts = plans.counts
    if plans.machine.positioning != "linear":
        counts = np.zeros(plans.displacement.shape, dtype=np.int64)
        counts[plans.move, np.argmax(plans.share != 0.0, axis=1)] = plans.profile_counts
    first, like = same_rows(plans.displacement, counts, plans.reason)
    return gathered(least_residuals(plans.repeated(first), progress, band), like)


def _not_alone(plans: Plans) -> Iterator[list[int]]:
    """Profiles, as rows, that excite modes of each other, or whose vibration decays for a while."""
    excited = np.abs(plans.share) @ np.abs(plans.modes.participation).T > 0.0
    damped = (excited & (plans.modes.poles.real < 0.0)).any(axis=1)
    waits = damped & (plans.profile_counts < plans.counts[plans.move])
    ends = np.searchsorted(plans.move, np.arange(len(plans) + 1))
    for move in np.flatnonzero(np.diff(ends) > 1):
        sets: list[tuple[list[int], NDArray[np.bool_]]] = []
        for row in range(ends[move], ends[move + 1]):
            rows, modes = [row], excited[row]
            for other in [other for other in sets if (other[1] & modes).any()]:
                sets.remove(other)
                rows, modes = other[0] + rows, other[1] | modes
            sets.append((rows, modes))
        yield from (rows for rows, _ in sets if len(rows) > 1 or waits[rows[0]])


def _joint_bounds(plans: Plans, task: Task, sets: list[list[int]]) -> Array:
    """The least that profiles which begin together leave at the last arrival, for each set [mm]."""
    questions = [_joint_question(plans, task, rows) for rows in sets]
    least = np.full(len(sets), np.nan)
    for k, optimum in enumerate(answers(questions, task.progress)):
        if optimum is not None:
            least[k] = optimum.worst if optimum.worst > questions[k].allowed else 0.0
    return least


def _joint_question(plans: Plans, task: Task, rows: list[int]) -> Question:
    """What is asked about profiles that begin together."""
    modes, own = plans.modes, task.take(np.array(rows))
    weights = plans.share[rows] @ modes.participation.T
    until = plans.counts[plans.move[rows[0]]]
    # The measure of what is small: what today's profiles leave in the worst phase.
    decay = np.exp(np.multiply.outer((until - own.counts) * task.interval, modes.poles.real))
    each = np.abs(profiles_response(own.conventional, modes.poles) / modes.poles.imag * weights)
    today = float(grouped((each * decay).sum(axis=0), modes.group).max())
    reference = max(today, float(np.finfo(float).tiny))
    first, *beside = (
        replace(move_of(task, np.intp(row)), weights=signed)
        for row, signed in zip(rows, weights, strict=True)
    )
    allowed = (NOTHING if task.band else NULL) * reference
    return Question(first, reference, allowed, beside=tuple(beside), until=int(until))
