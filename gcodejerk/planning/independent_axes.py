"""Rapids under independent positioning: when each axis arrives, and where the path runs.

Under `positioning: independent` every axis runs on its own, so a rapid of several axes is a dogleg.
A designed profile keeps each axis's ends and time but not its place at every moment in between, so
the path differs a little from the one that the control itself takes. This module owns how much,
and how much it may.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import Grid, Profiles, sample_profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.batch import Batch
from gcodejerk.planning.plans import Plans

WINDOW = 24
"""So many pieces of the control's path are looked at on both sides of the place as far on its way.
"""
MARKS = 64
"""At most so many places of the control's path are tried for the nearest."""
MIDDLE = (0.25, 0.75)
"""Share of its time in which the mean moment of an axis's motion lies."""
LEAST = 1e-9
"""Less is what rounding leaves. [mm]"""
AT_ONCE = 64
"""Points of a path that are looked at together."""


def in_the_middle(profiles: Profiles, usual: Array) -> NDArray[np.bool_]:
    """Whether axes that run on their own move when the control's own rapids do, by and large.

    One that waits and then hurries, or the other way round, takes the tool along another path.

    Parameters
    ----------
    profiles : Profiles
        n of them.
    usual : ndarray, shape (n,)
        What the control's own rapid takes. [s]

    Returns
    -------
    ndarray of bool, shape (n,)
        Where the mean moment of the motion is within the middle half of its time.
    """
    early, late = MIDDLE
    mean = profiles.mean_moment
    middle: NDArray[np.bool_] = (mean >= early * usual) & (mean <= late * profiles.total)
    return middle


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
        Largest distance, over the points written, from the control's own path, whatever the
        moment that it is there; an upper bound, since of that path only what is likely to be the
        nearest is looked at. 0 where not more than one linear axis moves. [mm]
    """
    moves, start = batch.moves, batch.number_format.start
    return deviation_of(batch.plans, moves, batch.grid, batch.exact, start)


def deviation_of(
    plans: Plans, moves: NDArray[np.int64], grid: Grid, exact: Mapping[int, Array], begin: Array
) -> Array:
    """The same of moves whose positions are known at the knots of a grid; starts (b, 9) [mm]."""
    out = np.zeros(len(moves))
    linear = [a for a in exact if not _rotary(plans, a)]
    several = np.flatnonzero((plans.displacement[moves][:, linear] != 0.0).sum(axis=1) > 1)
    if plans.machine.positioning == "linear" or not len(several):
        return out
    moves, begin = moves[several], begin[several]
    rows = np.concatenate([np.array(plans.profiles_of(int(move))) for move in moves])
    row_of = np.searchsorted(moves, plans.move[rows])
    unit, _ = sample_profiles(
        plans.conventional.take(rows), grid.knots[several[row_of]], plans.machine.interval
    )
    planned, own = (np.zeros((len(moves), unit.shape[1], len(linear))) for _ in range(2))
    for column, axis in enumerate(linear):
        share = plans.share[rows, axis]
        used = share != 0.0
        np.add.at(own[..., column], row_of[used], unit[used] * share[used, np.newaxis])
        start = np.where(plans.displacement[moves, axis] != 0.0, begin[:, axis], 0.0)
        planned[..., column] = exact[axis][several] - start[:, np.newaxis]
    worst = np.array([_farthest(*pair) for pair in zip(planned, own, strict=True)])
    out[several] = np.where(worst < LEAST, 0.0, worst)
    return out


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


def _farthest(points: Array, path: Array) -> float:
    """Largest distance of points from the path through others, shapes (k, d) and (m, d).

    A piece of the path is looked for near two of its places: the one that is as far on its way,
    for each coordinate goes one way, and the nearest of some. The distance from these is a bound,
    so that few points have to be looked at.
    """
    stride = max(1, math.isqrt(len(path) // 2), len(path) // MARKS)
    ways, passed = (np.abs(places).sum(axis=1) for places in (points, path))
    as_far = np.minimum(np.searchsorted(passed, ways), len(path) - 1)
    columns = zip(points.T, path[::stride].T, strict=True)
    squares = sum((own[:, np.newaxis] - some) ** 2 for own, some in columns)
    nearest = stride * squares.argmin(axis=1)
    bound = np.sqrt(np.minimum(squares.min(axis=1), ((points - path[as_far]) ** 2).sum(axis=1)))
    farthest_first = np.argsort(-bound)
    worst = 0.0
    for begin in range(0, len(points), AT_ONCE):
        these = farthest_first[begin : begin + AT_ONCE]
        if bound[these[0]] <= worst:
            break
        around = [
            place[these, np.newaxis] + np.arange(-reach, reach)
            for place, reach in ((as_far, WINDOW), (nearest, stride))
        ]
        first = np.clip(np.concatenate(around, axis=1), 0, len(path) - 2)
        worst = max(worst, float(_distances(points[these], path, first).max()))
    return worst


def _distances(points: Array, path: Array, first: NDArray[np.int64]) -> Array:
    """Distance of each point from the nearest of its pieces, which begin at places of a path."""
    begin = path[first]
    along, off = path[first + 1] - begin, points[:, np.newaxis] - begin
    square = np.maximum((along**2).sum(axis=2), np.finfo(float).tiny)
    share = np.clip((off * along).sum(axis=2) / square, 0.0, 1.0)
    distances: Array = np.linalg.norm(off - share[..., np.newaxis] * along, axis=2).min(axis=1)
    return distances
