"""Streams of increments in which no interval is without motion: where nothing moved, one would end.

A control that reads increments may take a record of zeros for the end of the motion. In front of
the motion and behind it such records can be left out: it begins later, and arrives earlier. This
module owns what is done within: on the axis that moves farthest, positions near the start wait for
the first count and those near the end arrive sooner, so that every interval between has a count.

Rule: what is left in the modes is judged of the positions as they are then.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.planning.batch import Batch
from gcodejerk.planning.lines import left_by_lines

Whole = NDArray[np.int64]


def without_pauses(batch: Batch) -> Batch:
    """The same streams, with a count in every interval between the first and the last.

    Parameters
    ----------
    batch : Batch
        One written point an interval; ends in whole steps.

    Returns
    -------
    Batch
        `unplayable` where even that leaves a pause.
    """
    whole = {axis: column.copy() for axis, column in batch.whole.items()}
    plans = batch.plans
    early = np.zeros(len(batch), dtype=np.int64)
    unplayable = batch.unplayable.copy()
    for row in range(len(batch)):
        displacement = plans.displacement[batch.moves[row]]
        axes = [axis for axis in whole if displacement[axis]]
        begin = whole[axes[0]].shape[1] - 1 - int(batch.grid.counts[row])
        if _pauses([whole[axis][row, begin:] for axis in axes]):
            main = max(axes, key=lambda axis: abs(displacement[axis]))
            whole[main][row, begin:] = advancing(whole[main][row, begin:])
        columns = [whole[axis][row, begin:] for axis in axes]
        unplayable[row] |= _pauses(columns)
        moved = np.flatnonzero(np.any([np.diff(column) for column in columns], axis=0))
        early[row] = int(batch.grid.counts[row]) - 1 - int(moved[-1]) if len(moved) else 0
    step, origin = batch.number_format.step, batch.number_format.origin
    written = {}
    for axis, column in whole.items():
        moves = (plans.displacement[batch.moves, axis] != 0.0)[:, np.newaxis]
        own = np.nan_to_num(origin[:, axis, np.newaxis]) + column * step[:, axis, np.newaxis]
        written[axis] = np.where(moves, own, batch.written[axis])
    residual, worst = left_by_lines(plans, batch.moves, written, batch.grid, early)
    return replace(
        batch,
        whole=whole,
        written=written,
        residual=residual,
        worst_in_band=worst,
        unplayable=unplayable,
    )


def _pauses(columns: list[Whole]) -> bool:
    """Whether an interval within the motion has no count."""
    moved = np.any([np.diff(column) != 0 for column in columns], axis=0)
    inner = np.flatnonzero(moved)
    return len(inner) == 0 or not moved[inner[0] : inner[-1] + 1].all()


def advancing(counts: Whole) -> Whole:
    """Counts that advance in every interval from the first to the last that has any.

    Parameters
    ----------
    counts : ndarray of int, shape (k,)
        Monotone.

    Returns
    -------
    ndarray of int, shape (k,)
        From the middle outwards at least one count an interval, until an end is reached.

    Examples
    --------
    >>> advancing(np.array([0, 0, 1, 1, 2, 4, 6, 7, 8, 8, 9])).tolist()
    [0, 0, 0, 1, 2, 4, 6, 7, 8, 9, 9]
    """
    sign = 1 if counts[-1] >= counts[0] else -1
    ahead = sign * (counts - counts[0])
    last = int(ahead[-1])
    place = np.arange(len(ahead))
    middle = int(np.searchsorted(ahead, last / 2.0))
    early = place[: middle + 1] + np.minimum.accumulate((ahead - place)[: middle + 1][::-1])[::-1]
    late = place[middle:] + np.maximum.accumulate((ahead - place)[middle:])
    both = np.concatenate([early[:-1], late])
    return np.asarray(counts[0] + sign * np.clip(both, 0, last), dtype=np.int64)
