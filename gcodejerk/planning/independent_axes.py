"""Rapids under independent positioning: when each axis arrives, and where the path runs.

Under `positioning: independent` every axis runs on its own, so a rapid of several axes is a dogleg.
A designed profile keeps each axis's ends and time but not its place at every moment in between, so
the path differs a little from the one that the control itself takes. This module owns how much.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import Grid, sample_profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.batch import Batch
from gcodejerk.planning.plans import Plans

WINDOW = 24
"""The control's path is searched this many points before and after the same moment."""


def arrivals(plans: Plans, move: int) -> dict[str, tuple[float, float]]:
    """When each axis of a move arrives: planned, and conventionally [s].

    Parameters
    ----------
    plans : Plans
        Planned for a machine with independent positioning.
    move : int
        One that is planned.

    Returns
    -------
    dict of str to (float, float)
        Axis -> time after the start.
    """
    out = {}
    for profile in plans.profiles_of(move):
        axis = int(np.argmax(plans.share[profile] != 0.0))
        planned = float(plans.profile_times[profile])
        out[AXES[axis]] = (planned, float(plans.conventional.total[profile]))
    return out


def path_deviation(batch: Batch) -> Array:
    """How far the paths of a batch leave those that the control itself takes.

    Parameters
    ----------
    batch : Batch
        b moves.

    Returns
    -------
    ndarray, shape (b,)
        Largest distance, over the points written, from the control's own path; an upper bound,
        since only the part of that path is searched that is near in time. 0 where not more than
        one linear axis moves. [mm]
    """
    moves, start = batch.moves, batch.number_format.start
    return deviation_of(batch.plans, moves, batch.grid, batch.exact, start)


def deviation_of(
    plans: Plans, moves: NDArray[np.int64], grid: Grid, exact: Mapping[int, Array], begin: Array
) -> Array:
    """The same of moves whose positions are known at the knots of a grid; starts (b, 9) [mm]."""
    rows = np.concatenate([np.array(plans.profiles_of(int(move))) for move in moves])
    row_of = np.searchsorted(moves, plans.move[rows])
    linear = [a for a in exact if not _rotary(plans, a)]
    out = np.zeros(len(moves))
    if plans.machine.positioning == "linear" or len(linear) < 2:
        return out
    unit, _ = sample_profiles(
        plans.conventional.take(rows), grid.knots[row_of], plans.machine.interval
    )
    planned, own = (np.zeros((len(moves), unit.shape[1], len(linear))) for _ in range(2))
    for column, axis in enumerate(linear):
        share = plans.share[rows, axis]
        used = share != 0.0
        np.add.at(own[..., column], row_of[used], unit[used] * share[used, np.newaxis])
        start = np.where(plans.displacement[moves, axis] != 0.0, begin[:, axis], 0.0)
        planned[..., column] = exact[axis] - start[:, np.newaxis]
    result: Array = _distances(planned, own).max(axis=1, initial=0.0)
    return result


def dogleg_notes(plans: Plans, deviation: Array) -> list[str]:
    """What a user has to know of a program's rapids under independent positioning.

    Parameters
    ----------
    plans : Plans
        n moves.
    deviation : ndarray, shape (n,)
        Of each. [mm]

    Returns
    -------
    list of str
        Empty where all axes move together, or nothing is planned.
    """
    if plans.machine.positioning == "linear" or not plans.planned.any():
        return []
    text = "positioning: independent: each axis moves and arrives on its own, as the control's does"
    worst = float(deviation.max(initial=0.0))
    if worst > 0.0:
        text += f"; no path leaves the control's own by more than {worst:.3g} mm"
    return [text]


def _rotary(plans: Plans, axis: int) -> bool:
    return plans.machine.axis(AXES[axis]).rotary


def _distances(points: Array, path: Array) -> NDArray[np.float64]:
    """Distance of each point from the pieces of a path near the same place, (b, k, d) -> (b, k)."""
    count = points.shape[1]
    least: NDArray[np.float64] = np.linalg.norm(points - path, axis=2)
    for shift in range(-min(WINDOW, count - 1), min(WINDOW, count - 1)):
        here = np.clip(np.arange(count) + shift, 0, count - 1)
        begin, end = path[:, here], path[:, np.minimum(here + 1, count - 1)]
        along = end - begin
        square = np.maximum((along**2).sum(axis=2), 1e-300)
        at = np.clip(((points - begin) * along).sum(axis=2) / square, 0.0, 1.0)
        least = np.minimum(
            least, np.linalg.norm(begin + at[..., np.newaxis] * along - points, axis=2)
        )
    return least
