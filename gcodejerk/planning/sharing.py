"""Axes that run each on its own and excite the same modes: what is asked of them together.

This module owns which profiles of a move go together under `positioning: independent`, the joint
questions about them, and the joint optima: what one axis leaves of a mode may cancel what another
does, which no axis by itself can make use of.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.together import OFF
from gcodejerk.motion.search.unit_move import optimum_profiles
from gcodejerk.planning.designs import move_of, slack_of
from gcodejerk.planning.independent_axes import in_the_middle
from gcodejerk.planning.optima import Question, joint_answers
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task, worst_at_arrival

LONGEST = 400
"""Intervals of all axes that are designed together, at most: longer ones would take seconds each,
and have time enough for each axis by itself."""


def sharing(modes: Modes, move: NDArray[np.int64], share: Array) -> list[list[int]]:
    """Profiles of moves of several axes, those together that excite the same modes.

    Parameters
    ----------
    modes : Modes
        The machine's modes.
    move : ndarray of int, shape (l,)
        The move of each profile, ascending.
    share : ndarray, shape (l, 9)
        Displacement of each axis that the profile carries. [mm] or [deg]

    Returns
    -------
    list of list of int
        Rows; every profile of such a move is in one of them.
    """
    excited = modes.excited(share)
    begins = np.flatnonzero(np.diff(move, prepend=-1))
    ends = np.append(begins[1:], len(move))
    several = ends - begins > 1
    out: list[list[int]] = []
    for begin, end in zip(begins[several].tolist(), ends[several].tolist(), strict=True):
        sets: list[tuple[list[int], NDArray[np.bool_]]] = []
        for row in range(begin, end):
            rows, own = [row], excited[row]
            for other in [other for other in sets if (other[1] & own).any()]:
                sets.remove(other)
                rows, own = other[0] + rows, other[1] | own
            sets.append((rows, own))
        out += [rows for rows, _ in sets]
    return out


def joint_question(
    task: Task, rows: list[int], weights: Array, until: int, reference: float, allowed: float,
    slack: float = 0.0,
) -> Question:  # fmt: skip
    """What is asked about profiles that begin together; only where there is slack, with a guard.

    Parameters
    ----------
    task : Task
        The profiles' moves.
    rows : list of int
        Those of them that go together.
    weights : ndarray, shape (r, m)
        Of each of these, with their signs. [mm]
    until : int
        When it is judged. [intervals]
    reference, allowed, slack : float
        As of a `Question`. [mm]

    Returns
    -------
    Question
    """
    guard = task.guard if slack else 0.0
    first, *beside = (
        replace(move_of(task, np.intp(row), guard), weights=signed)
        for row, signed in zip(rows, weights, strict=True)
    )
    settled = task.tolerance if slack else 0.0
    return Question(first, reference, allowed, slack, settled, tuple(beside), until)


def joint_optima(
    task: Task, modes: Modes, move: NDArray[np.int64], share: Array, profiles: Profiles,
    left: Array, today: Array,
) -> tuple[Profiles, Array]:  # fmt: skip
    """Profiles, those that share modes designed together where that leaves less.

    Parameters
    ----------
    task : Task
        l profiles' moves.
    modes, move, share
        As of `sharing`.
    profiles : Profiles
        l profiles, each made for its own axis.
    left, today : ndarray, shape (l,)
        What the moves of these profiles leave, and the controller's own, at the last arrival over
        the band; infinite where there are none. [mm]

    Returns
    -------
    profiles : Profiles
    left : ndarray, shape (l,)
        What their moves leave.
    """
    slack = slack_of(task, today)
    last = np.zeros(int(move.max(initial=-1)) + 1, dtype=np.int64)
    np.maximum.at(last, move, task.counts)
    worth = np.isfinite(left) & (left > slack)
    sets = [
        rows
        for rows in sharing(modes, move, share)
        if len(rows) > 1 and worth[rows].all() and task.counts[rows].sum() <= LONGEST
    ]
    weights = share @ modes.participation.T
    questions = []
    for rows in sets:
        given = float(slack[rows[0]])
        most = max(float(today[rows[0]]), given)  # the measure: never 0
        allowed, until = min(given, 0.5 * task.tolerance), int(last[move[rows[0]]])
        questions.append(joint_question(task, rows, weights[rows], until, most, allowed, given))
    found = joint_answers(questions, task.progress)
    solved = [(rows, optima) for rows, optima in zip(sets, found, strict=True) if optima]
    if not solved:
        return profiles, left
    index = np.array([row for rows, _ in solved for row in rows])
    optima = [optimum for _, every in solved for optimum in every]
    joint = profiles.replaced(index, optimum_profiles(optima, task.interval))
    concerned = np.isin(move, move[index])
    _, own = np.unique(move[concerned], return_inverse=True)
    # What cancels has to be worth it where the modes are not excited as the file says, too.
    less, before, now = (
        worst_at_arrival(modes, task.band, own, share[concerned], of.take(concerned), off)[own]
        for of, off in ((joint, OFF), (profiles, OFF), (joint, 0.0))
    )
    better, after = concerned.copy(), left.copy()
    better[concerned] = (less < before) & (now < left[concerned])
    better &= ~np.isin(move, move[~in_the_middle(joint, task.conventional.total)])
    after[better] = now[better[concerned]]
    return profiles.replaced(better, joint.take(better)), after
