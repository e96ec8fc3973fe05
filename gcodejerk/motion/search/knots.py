"""Ends of the blocks of constant jerk that an optimum is made of, in whole intervals.

Short moves have a jerk of their own in every interval. In long ones most of the optimal jerk is
zero, in cruise and at constant acceleration: a first programme with long blocks shows where it is
not, and only there are the blocks cut. This module owns where knots are at first, and where no
programme by planes says what they are worth (`prices`).
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.guard import split_at_peak
from gcodejerk.motion.search.unit_move import Index, Move

FEWEST_INTERVALS = 3
"""Two cannot begin and end at rest."""
FULL_INTERVALS = 128
"""Moves of at most so many intervals have a jerk in each of them."""
BLOCK = 4
"""Intervals of a block in the first programme of a longer move, at least."""
MOST_BLOCKS = 120
"""Blocks of a half of a move, or of a ramp, in a first programme at most."""
CRUISE_BLOCKS = 16
"""Blocks of a cruise at most, where acceleration and braking are not taken alike."""
MOST_REFINED, MOST_GUARDED = 1000, 110
"""Blocks of a refined programme at most, and of one with guarded frequencies, which are many: those
of longer moves stay long."""
FEW_BLOCKS = 40
"""The same in the first programme of several."""
MOST_FINE = 500
"""Moves with a cruise of at most so many intervals have a jerk in each, without a guard."""
RAMP = 2.0
"""Time that a move with a cruise may take to accelerate, times what it does today."""
ACTIVE = 0.02
"""A block counts where its jerk is above this share of the largest."""


def ramp_intervals(move: Move) -> int:
    """Intervals in which a move with a long cruise accelerates; 0 for others."""
    if move.today is None or move.count <= FULL_INTERVALS:
        return 0
    today = float(split_at_peak(move.today)[0].total[0])
    ramp = int(np.ceil(RAMP * today / move.interval))
    return ramp if 3 * ramp <= move.count else 0


def ramp_knots(ramp: int) -> Index:
    """Ends of the blocks of a ramp of so many intervals."""
    block = -(-ramp // MOST_BLOCKS)
    return np.union1d(np.arange(0, ramp, block), ramp)


def first_knots(count: int, ramp: int, guarded: bool) -> Index:
    """Ends of the blocks of the first programme, of a move of `count` intervals.

    In long blocks a cruise does nothing, though it may have to slow down for a low mode: what they
    leave is then no bound of what a profile can leave.
    """
    if count <= (MOST_FINE if ramp and not guarded else FULL_INTERVALS):
        return np.arange(count + 1)
    half = ramp or count // 2
    block = max(BLOCK, -(-half // MOST_BLOCKS))
    first = np.arange(0, half + 1, block)
    cruise = np.zeros(0, dtype=np.int64)
    if ramp:
        cruise = np.linspace(half, count // 2, CRUISE_BLOCKS // 2 + 1).astype(np.int64)
    first = np.union1d(first, cruise)
    return np.union1d(first, count - first)


def coarse_knots(move: Move, ramp: int) -> Index:
    """Ends of the blocks of the first programme of several: few, and those of today's rapid.

    With them, what today's rapid does is nearly one of the profiles: one is within the limits.
    """
    count = move.count
    if count <= FULL_INTERVALS:
        return np.arange(count + 1)
    half = ramp or count // 2
    block = max(BLOCK, -(-half // FEW_BLOCKS))
    cruise = np.linspace(half, count // 2, CRUISE_BLOCKS // 2 + 1).astype(np.int64)
    knots = np.concatenate([np.arange(0, half + 1, block), cruise])
    if move.today is not None:
        knots = np.concatenate([knots, _todays(move, count)])
    return np.union1d(knots, count - knots)


def coarse_ramp(move: Move, ramp: int) -> Index:
    """The same for a ramp of so many intervals."""
    block = max(BLOCK, -(-ramp // FEW_BLOCKS))
    knots = np.append(np.arange(0, ramp, block), ramp)
    if move.today is not None:
        todays = _todays(move, move.count)
        knots = np.union1d(knots, todays[todays < ramp])
    return knots


def _todays(move: Move, count: int) -> Index:
    """Ends of intervals around the moments at which the jerk of today's rapid changes."""
    assert move.today is not None
    moments = move.today.step_times() / float(move.today.total[0]) * count
    before = np.floor(moments + 1e-9).astype(np.int64)
    todays: Index = np.clip(np.concatenate([before, before + 1]), 0, count)
    return todays


def most_blocks(move: Move) -> int:
    """Blocks of a refined programme at most."""
    return MOST_GUARDED if move.guard else MOST_REFINED


def refined_knots(knots: Index, jerk: Array, mirrored: bool, most: int) -> Index:
    """Blocks cut into intervals where the jerk acts, and beside these.

    Parameters
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks. [intervals]
    jerk : ndarray, shape (k,)
        What was found for them. [-]
    mirrored : bool
        The acceleration is odd about the middle.
    most : int
        Blocks at most.

    Returns
    -------
    ndarray of int
        [intervals]
    """
    size = np.abs(jerk)
    least = ACTIVE * size.max(initial=0.0)
    if mirrored:
        size = np.maximum(size, size[::-1])
    beside = np.pad(size, 1)
    size = np.maximum(size, np.maximum(beside[:-2], beside[2:]))
    size[[0, -1]] = np.inf
    # The largest first, as many as there may be.
    order = np.argsort(-size, kind="stable")
    order = order[size[order] > least]
    gained = np.cumsum(np.diff(knots)[order] - 1)
    cut = order[gained + len(size) <= most]
    if mirrored:
        # A block and its image are cut both, or none.
        cut = np.intersect1d(cut, len(size) - 1 - cut)
    return np.unique(np.concatenate([knots, *(np.arange(knots[k], knots[k + 1]) for k in cut)]))
