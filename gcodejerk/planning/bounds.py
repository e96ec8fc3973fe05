"""Bounds: how still the tool could be at best after a planned move, whatever its profile.

This module owns what reports call the limit: the optimum of the problem that the designs try to
solve, without their families and without a guard.

Rule: a bound is judged when the move is: under `positioning: independent` at the last arrival, and
together for axes that excite the same modes, since what one of them leaves may cancel the others'.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion import profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.nulls import easily_still
from gcodejerk.motion.search.socp import require_solver
from gcodejerk.planning.designs import question_of
from gcodejerk.planning.optima import Progress, answers, joint_answers
from gcodejerk.planning.plans import Plans, same_rows
from gcodejerk.planning.sharing import joint_question, sharing
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
    least = np.where(_still(task), 0.0, np.nan)
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
    # An axis that arrives early is judged later, too, where its vibration decays until then.
    damped = (plans.modes.excited(plans.share) & (plans.modes.poles.real < 0.0)).any(axis=1)
    waits = damped & (plans.profile_counts < plans.counts[plans.move])
    sets = [
        rows
        for rows in sharing(plans.modes, plans.move, plans.share)
        if len(rows) > 1 or waits[rows[0]]
    ]
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


def _still(task: Task) -> NDArray[np.bool_]:
    """Moves that excite nothing; and without a band, most of those that can leave nothing."""
    still = np.logical_not(task.objective.weights.any(axis=1))
    if task.band == 0.0:
        for index, _ in task.alike():
            own = task.take(index)
            poles = own.objective.excited().poles
            if len(poles):
                still[index] = easily_still(own.counts, *own.limits, poles, own.interval)
    return still


def _joint_bounds(plans: Plans, task: Task, sets: list[list[int]]) -> Array:
    """The least that profiles which begin together leave at the last arrival, for each set [mm]."""
    modes, nothing = plans.modes, NOTHING if task.band else NULL
    until, weights = plans.counts[plans.move], plans.share @ modes.participation.T
    members = np.fromiter(itertools.chain.from_iterable(sets), dtype=np.intp)
    still, questions = np.zeros(len(task), dtype=bool), []
    still[members] = _still(task.take(members))
    asked = [k for k, rows in enumerate(sets) if not still[rows].all()]
    for rows in (sets[k] for k in asked):
        # The measure of what is small: what today's profiles leave in the worst phase.
        own, last = task.take(np.array(rows)), int(until[rows[0]])
        decay = np.exp(np.multiply.outer((last - own.counts) * task.interval, modes.poles.real))
        response = profiles_response(own.conventional, modes.poles) / modes.poles.imag
        each = np.abs(response * weights[rows]) * decay
        today = max(float(modes.grouped(each.sum(axis=0)).max()), float(np.finfo(float).tiny))
        questions.append(joint_question(task, rows, weights[rows], last, today, nothing * today))
    least = np.zeros(len(sets))
    found = joint_answers(questions, task.progress)
    for k, question, optima in zip(asked, questions, found, strict=True):
        if optima is None:
            least[k] = np.nan
        elif optima[0].worst > question.allowed:
            least[k] = optima[0].worst
    return least
