"""Programmes with cones: the profile whose largest residual is least, or of least peak jerk.

This module owns what is made least, and the solver. Which blocks and which frequencies it is asked
for, `optimal` and `together` decide. To what holds of every profile (`programme`) comes

* a largest residual displacement t over all modes and frequencies asked for: one second-order cone
  for each, exact where a linear programme needs a polygon in place of the modulus.

Frequencies that only must not be worse than today's have cones of a fixed size instead of t.
Minimised is what t has above a residual that costs nothing, with a small part of the peak jerk: of
the profiles that are as good, the smoothest is taken. Or the peak jerk alone where the modes shall
be perfectly still.

Rule: scipy and clarabel (an interior-point solver for cones) are imported inside functions; where
they are missing, the error names the remedy.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.programme import (
    Index,
    Problem,
    Rows,
    Solution,
    Unknowns,
    solutions,
)

ACCURACY, GAP = 1e-6, 1e-7
"""Accuracies asked of the solver: of what has to hold, and of what is made least; where the
residual costs nothing, that is a thousandth of the jerk's share."""
MANY = 24
"""More rows of one cone than this are condensed."""
CONDENSED = 1e-5
"""Relative size of what is left out of them."""


def require_solver() -> None:
    """Refuse with the remedy where scipy, clarabel or daqp is missing."""
    try:
        import clarabel
        import daqp
        import scipy.sparse  # noqa: F401
        import threadpoolctl  # noqa: F401
    except ImportError as error:
        raise PlanError(
            f"optimal profiles and their bound need solvers: {error.name} is missing",
            "install them with: pip install 'gcodejerk[science]'",
        ) from None
    del clarabel, daqp


def solve(
    problem: Problem, allowed: float, jerk_cost: float, curved: bool = False
) -> Solution | None:
    """The profile that has the least sum of residual above what is allowed and cost of its jerk.

    Parameters
    ----------
    problem : Problem
        The move; residuals near 1 are those that matter.
    allowed : float
        Residual that costs nothing. [-]
    jerk_cost : float
        What the full jerk costs: it decides among profiles that leave the same. [-]
    curved : bool, optional
        Hold the velocity between the knots from the beginning; else only where it is beyond its
        bounds there, which costs a second call of the solver.

    Returns
    -------
    Solution or None
        None where no profile keeps the limits, and the caps of groups.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    found = _solve([problem], allowed, jerk_cost, curved)
    return None if found is None else found[0]


def solve_together(
    problems: Sequence[Problem], allowed: float, jerk_cost: float, curved: bool = False
) -> list[Solution] | None:
    """The same for moves whose residuals add up, of other axes for instance.

    Parameters
    ----------
    problems : sequence of Problem
        A move each. Their rows say what adds up, so there are as many of each, in the same groups
        with the same caps.
    allowed, jerk_cost, curved
        As of `solve`; every move has a peak jerk of its own, and it costs as much.

    Returns
    -------
    list of Solution or None
        One for each move.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    return _solve(problems, allowed, jerk_cost, curved)


def smoothest_null(problem: Problem) -> Solution | None:
    """The profile of least peak jerk that leaves exactly nothing in any group.

    Parameters
    ----------
    problem : Problem
        The move; none of its groups has a cap.

    Returns
    -------
    Solution or None
        None where no profile within the limits does that.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    found = _solve([problem], None, 1.0, False)
    return None if found is None else found[0]


def _solve(
    problems: Sequence[Problem], allowed: float | None, jerk_cost: float, curved: bool
) -> list[Solution] | None:
    """Residual and jerk are minimised, or where nothing is allowed the jerk of a null."""
    found = _solve_once(problems, allowed, jerk_cost, curved)
    if curved or found is None:
        return found
    moves = zip(problems, found, strict=True)
    if all(Unknowns(problem).keeps_velocity(solution.jerk) for problem, solution in moves):
        return found
    return _solve_once(problems, allowed, jerk_cost, True)


def _solve_once(
    problems: Sequence[Problem], allowed: float | None, jerk_cost: float, curved: bool
) -> list[Solution] | None:
    """One call of the solver."""
    require_solver()
    import clarabel
    from scipy import sparse

    moves: list[Unknowns] = []
    for problem in problems:
        moves.append(Unknowns(problem, moves[-1].end if moves else 0))
    above, group, caps = moves[-1].end, problems[0].group, problems[0].cap
    columns = np.concatenate([move.a for move in moves])
    response = np.hstack([move.problem.seen(move.responses().to()) for move in moves])
    rows = Rows()
    for move in moves:
        move.motion(rows)
    if allowed is None:
        rows.dense(_condensed(response), columns)
    equalities = rows.count
    for move in moves:
        move.limits(rows, curved)
    if allowed is not None:
        rows.add([(above, -1.0)], 0.0)
    cones: list[Any] = [
        clarabel.ZeroConeT(equalities),
        clarabel.NonnegativeConeT(rows.count - equalities),
    ]
    if allowed is not None:
        for part, cap in zip(_groups(group), caps, strict=True):
            if np.isnan(cap):
                rows.add([(above, -1.0)], allowed)
            else:
                rows.add([], cap)
            own = _condensed(response[part])
            # A guarded frequency is one of one move: the others' columns are empty.
            used = own.any(axis=0)
            rows.dense(own[:, used], columns[used])
            cones.append(clarabel.SecondOrderConeT(1 + len(own)))
    width = above + (allowed is not None)
    matrix, bound = rows.assembled(width)
    cost = np.zeros(width)
    cost[[move.peak for move in moves]] = jerk_cost
    if allowed is not None:
        cost[above] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.direct_solve_method = "qdldl"
    settings.tol_feas, settings.tol_gap_abs, settings.tol_gap_rel = ACCURACY, GAP, GAP
    none = sparse.csc_matrix((width, width))
    status = clarabel.SolverStatus
    # The equations of every step are nearly always solved well enough at the first go, in three
    # quarters of the time; where the programme is not, they are refined.
    for refined in (False, True):
        settings.iterative_refinement_enable = refined
        found = clarabel.DefaultSolver(none, cost, matrix, bound, cones, settings).solve()
        if found.status in (status.Solved, status.PrimalInfeasible):
            break
    if found.status not in (status.Solved, status.AlmostSolved):
        return None
    return solutions(moves, np.array(found.x), curved, null=allowed is None)


def _condensed(rows: Array) -> Array:
    """Fewer rows with the same norm of ``rows @ x``, where there are many nearly alike."""
    if len(rows) <= MANY:
        return rows
    _, sizes, directions = np.linalg.svd(rows, full_matrices=False)
    kept = sizes > CONDENSED * sizes.max(initial=0.0)
    condensed: Array = sizes[kept, np.newaxis] * directions[kept]
    return condensed


def _groups(group: Index) -> list[slice]:
    """Rows of each group, which stand side by side."""
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    ends = np.append(starts[1:], len(group))
    return [slice(int(begin), int(end)) for begin, end in zip(starts, ends, strict=True)]
