"""Designs: for each profile, how the profiles of many moves are found in the time that they have.

This module owns the table from a profile's name to its design. A design gets moves as columns
(their time, their limits, what they excite) and gives a profile for each, with what it leaves. When
a design is used, and what happens where it finds nothing, the planner decides.

Rule: a design changes no move's time; what does, as `shortest_time` and the planner, asks designs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import (
    Objective,
    Profiles,
    design_four_segments,
    four_segment_range,
    joined,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.cascade import design_cascade, leading_periods
from gcodejerk.motion.search.conditions import design_condition
from gcodejerk.motion.search.guard import keeps_guard
from gcodejerk.motion.search.ramps import design_symmetric
from gcodejerk.motion.search.unit_move import Move, Optimum, optimum_profiles
from gcodejerk.planning.optima import Question, answers
from gcodejerk.planning.task import Task, worst_in_band
from gcodejerk.spread import here

SEARCHED, FEWEST = 1.6, 1
"""What a search looks at of a band: the distance of frequencies, times T_SUM/2, at most [rad], and
so many on each side at least."""
MOST_REMEMBERED = 50_000
"""Profiles that a search remembers, a few hundred bytes each."""
NEXT_TO_NOTHING, SETTLED = 0.01, 0.1
"""A residual does not matter below this share of what today's rapid leaves, or below this one of
the tolerance, whichever is more; but what can be settled on arrival, is."""
AT_ONCE = 512
"""Moves that are searched together, by whoever has time."""
COARSE = 24
"""Moves of so few intervals may gain from segments that end between them."""


Design = Callable[[Task], tuple[Profiles, Array]]
"""Profiles of the moves, and the largest residual of each over the band [mm], infinite where there
is none."""

Search = Callable[[Task, Objective], tuple[Profiles, NDArray[np.bool_]]]
"""Profiles that leave the least of an objective, and whether there is one within the limits."""


def condition3(task: Task) -> tuple[Profiles, Array]:
    """Condition III, or its generalisation where a limit binds.

    Where the conventional profile has four segments, it is the paper's: T1 alone is free.
    """
    # The conventional profile is then a member of the family.
    four = (task.symmetric.Ta == 0.0) & (task.symmetric.Tv == 0.0)
    low, high = four_segment_range(task.total, *task.limits, task.interval)
    four &= low <= high
    profiles, worst = task.conventional, np.full(len(task), np.inf)
    for search, where in ((_four_segments, four), (_symmetric, ~four)):
        index = np.nonzero(where)[0]
        found, worst[index] = _searched(task.take(index), search)
        profiles = profiles.replaced(index, found)
    return profiles, worst


def symmetric(task: Task) -> tuple[Profiles, Array]:
    """The generalised Condition III for every move: T1, T2, Ta and Tv are all free."""
    return _searched(task, _symmetric)


def condition1(task: Task) -> tuple[Profiles, Array]:
    """Condition I at its best T1."""
    return _searched(task, _condition1)


def condition2(task: Task) -> tuple[Profiles, Array]:
    """Condition II at its best T1."""
    return _searched(task, _condition2)


def cascade(task: Task) -> tuple[Profiles, Array]:
    """Moving averages as wide as the modes' periods, in the unchanged time."""
    return _searched(task, _cascade)


def _four_segments(task: Task, objective: Objective) -> tuple[Profiles, NDArray[np.bool_]]:
    low, high = four_segment_range(task.total, *task.limits, task.interval)
    profiles = design_four_segments(task.total, low, high, objective).general()
    return profiles, np.ones(len(task), dtype=bool)


def _symmetric(task: Task, objective: Objective) -> tuple[Profiles, NDArray[np.bool_]]:
    found, feasible = design_symmetric(
        task.total, *task.limits, objective, task.interval, [task.symmetric]
    )
    return task.symmetric.replaced(feasible, found.take(feasible)).general(), feasible


def _condition(name: str, task: Task, objective: Objective) -> tuple[Profiles, NDArray[np.bool_]]:
    profiles, worst = design_condition(name, task.total, *task.limits, objective, task.interval)
    return profiles, np.isfinite(worst)


_condition1, _condition2 = partial(_condition, "I"), partial(_condition, "II")


def _cascade(task: Task, objective: Objective) -> tuple[Profiles, NDArray[np.bool_]]:
    periods = leading_periods(task.objective)
    return design_cascade(task.total, *task.limits, objective, task.interval, periods)


def _searched(task: Task, search: Search) -> tuple[Profiles, Array]:
    """What a search finds over the band, judged more finely than it looks."""
    keys, first, same = task.distinct()
    remembered = _remembered(search)
    if len(remembered) + len(keys) > MOST_REMEMBERED:
        remembered.clear()
    new = np.array([k for k, key in enumerate(keys) if key not in remembered], dtype=np.intp)
    few = task.take(first[new])
    pieces = [
        (index[begin : begin + AT_ONCE], longest)
        for index, longest in few.alike()
        for begin in range(0, len(index), AT_ONCE)
    ]
    alone = replace(few, progress=None, spread=here)
    answers = task.spread(
        partial(_found, search), ((alone.take(index), longest) for index, longest in pieces)
    )
    for (index, _), (found, feasible) in zip(pieces, answers, strict=True):
        for row, k in enumerate(new[index]):
            own_profile = found.take(slice(row, row + 1))
            remembered[keys[k]] = own_profile if feasible[row] else None
    known = [remembered[key] for key in keys]
    there = np.array([profile is not None for profile in known], dtype=bool)
    profiles, worst = task.conventional, np.full(len(task), np.inf)
    if there.any():
        place = np.cumsum(there) - 1
        judged = there[same]
        chosen = joined([p for p in known if p is not None]).take(place[same[judged]])
        profiles = profiles.replaced(judged, chosen)
        worst[judged] = worst_in_band(task.take(judged), chosen)
    return profiles, worst


def _found(search: Search, piece: tuple[Task, float]) -> tuple[Profiles, NDArray[np.bool_]]:
    """What a search finds for moves that excite the same modes and take no longer than a time."""
    task, longest = piece
    own = replace(task, objective=task.objective.excited())
    return search(own, own.objective.in_band(task.band, longest, SEARCHED, FEWEST))


@cache
def _remembered(search: Search) -> dict[bytes, Profiles | None]:
    """What a search has found in this process: the rapids of a shop's programs are often the same.

    None where there is nothing within the limits.
    """
    return {}


def optimal(task: Task) -> tuple[Profiles, Array]:
    """The least worst residual over the band, of all profiles that keep the guard.

    Of those that leave next to no more, it is the smoothest. The programme knows jerks that change
    at whole intervals only: where a profile of another design, whose segments need not end there,
    leaves less still, that one is taken.
    """
    profiles, worst = task.conventional, np.full(len(task), np.inf)
    rows = np.nonzero(task.objective.weights.any(axis=1))[0]
    today = worst_in_band(task, task.conventional)
    slack = slack_of(task, today)
    questions = [question_of(task, k, float(today[k]), slack=float(slack[k])) for k in rows]
    profiles, worst = answered(task, rows, answers(questions, task.progress), profiles, worst)
    found = np.isfinite(worst)
    worst[found] = worst_in_band(task.take(found), profiles.take(found))
    # Who leaves no more than the slack cannot be beaten by more than that.
    beatable = worst > slack
    for rival, where in (
        (symmetric, beatable),
        (cascade, beatable),
        (condition1, beatable & (task.counts <= COARSE)),
        (condition2, beatable & (task.counts <= COARSE)),
    ):
        index = np.nonzero(where)[0]
        others, residual = rival(task.take(index))
        better = np.nonzero(residual + slack[index] < worst[index])[0]
        better = better[_guarding(task.take(index[better]), others.take(better))]
        profiles = profiles.replaced(index[better], others.take(better))
        worst[index[better]] = residual[better]
    return profiles, worst


def slack_of(task: Task, today: Array) -> Array:
    """What may be left above the least, for less jerk, beside what today's rapid leaves [mm]."""
    slack: Array = np.maximum(NEXT_TO_NOTHING * today, SETTLED * task.tolerance)
    return slack


def _guarding(task: Task, profiles: Profiles) -> NDArray[np.bool_]:
    """Whether profiles keep the guard of their moves."""
    if not task.guard:
        return np.ones(len(task), dtype=bool)
    poles = [task.objective.poles[weights > 0.0] for weights in task.objective.weights]
    return keeps_guard(profiles, task.conventional, poles, task.band, task.interval, task.guard)


def question_of(
    task: Task, row: np.intp, reference: float, allowed: float = 0.0, slack: float = 0.0
) -> Question:
    """What is asked about one of the moves; only where there is slack does it have a guard."""
    move = move_of(task, row, task.guard if slack else 0.0)
    return Question(move, reference, allowed, slack, task.tolerance if slack else 0.0)


def move_of(task: Task, row: np.intp, guard: float = 0.0) -> Move:
    """One of the moves as the search for its optimum gets it."""
    V, A, J = (float(limit[row]) for limit in task.limits)
    objective = task.objective
    today = task.conventional.take(slice(row, row + 1))
    return Move(
        int(task.counts[row]), V, A, J, objective.poles, objective.weights[row], objective.group,
        task.band, task.interval, today, guard,
    )  # fmt: skip


def answered(
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


DESIGNS: dict[str, Design] = {
    "condition1": condition1,
    "condition2": condition2,
    "condition3": condition3,
    "symmetric": symmetric,
    "cascade": cascade,
    "optimal": optimal,
}
"""The profiles that keep a move's time."""
