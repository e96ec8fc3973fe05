r"""When blocks end, for a planner that changes the speed of a block linearly, period by period.

This module owns the knots of a stream: whole servo periods, a hair early; which blocks get faster
or slower; and what becomes of ends that are not where they should be.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.speed_fit import EVEN, FASTER, SLOWER

CREEP = 0.01
"""The least of all speeds. [mm/s]"""
LONGEST = 0.0085
"""Of a block, and a period more: from 10 ms on the planner no longer blends it. [s]"""
END_PERIODS = 3
"""Of the first and the last block, at least. [intervals]"""
HAIR = 4e-12
"""By how much blocks end before a period: more than what LinuxCNC takes for nothing (1e-12). [s]"""
DIP = 0.005
"""A speed that falls and rises by less than this share of the peak goes on rising or falling."""


def aligned_knots(
    count: Counts,
    stride: Counts | int,
    ahead: int,
    way: Array,
    speed: Array,
    brake: Array,
    interval: float,
) -> tuple[Counts, NDArray[np.bool_]]:
    """Ends of the blocks of moves, whole periods, aligned at the last.

    A block has `stride` periods where the planner looks far enough ahead: it enters no block faster
    than it could stop within the blocks that it looks at. Where that needs longer blocks they are
    longer, from the end backwards.

    Parameters
    ----------
    count : ndarray of int, shape (b,)
        Duration of each move. [intervals]
    stride : ndarray of int, shape (b,), or int
        Periods of a block, at least 2.
    ahead : int
        Blocks that the planner looks ahead.
    way, speed : ndarray, shape (b, longest + 1)
        Of each move at every period, aligned at the end. [mm], [mm/s]
    brake : ndarray, shape (b,)
        Acceleration with which it can stop. [mm/s^2]
    interval : float
        [s]

    Returns
    -------
    knots : ndarray of int, shape (b, k)
        [intervals]
    enough : ndarray of bool, shape (b,)
        The planner looks far enough ahead everywhere.

    Examples
    --------
    The first and the last block have three periods at least, one in the middle what is left over:

    >>> slow = np.zeros((2, 13))
    >>> aligned_knots(np.array([11, 12]), 2, 45, slow, slow, np.ones(2), 0.001)[0]
    array([[ 0,  0,  3,  6,  8, 11],
           [ 0,  3,  5,  7,  9, 12]])
    """
    rows = np.arange(len(count))
    longest = np.maximum(stride, int(LONGEST / interval))
    end = np.maximum(END_PERIODS, stride)
    last = way.shape[1] - 1
    over = np.maximum(count - 2 * end, 0) % stride
    enough = np.ones(len(count), dtype=np.bool_)
    left = np.where(count < end + END_PERIODS, count // 2, end)
    columns = [np.zeros_like(count), left]
    needed = 0.5 * speed**2 / brake[:, np.newaxis]
    while (left < count).any():
        to = way[rows, last - columns[max(len(columns) - ahead, 0)]]
        size = np.broadcast_to(longest, count.shape).copy()
        short = np.ones(len(count), dtype=np.bool_)
        for more in range(int((longest - stride).max(initial=0)) + 1):
            periods = np.minimum(stride + more, longest)
            at = last - np.minimum(left + periods, count)
            reached = needed[rows, at] <= (to - way[rows, at]) * (1.0 + 1e-6) + CREEP * interval
            size = np.where(short & reached, periods, size)
            short &= ~reached
            if not short.any():
                break
        enough &= ~short | (left >= count)
        # What the division leaves over: a longer block in the middle, or one of its own.
        middle = (over > 0) & (left + size >= count / 2)
        size = np.where(middle, np.where(over > 1, over, size + 1), size)
        over = np.where(middle, 0, over)
        rest = count - left
        # The first block has three periods at least, too.
        size = np.where(rest < size + END_PERIODS, rest, size)
        size = np.where((size > longest + 1) & (size > END_PERIODS + 1), rest - END_PERIODS, size)
        left = left + size
        columns.append(left)
    knots: Counts = count[:, np.newaxis] - np.stack(columns[::-1], axis=1)
    return knots, enough


def early_shift(knots: Counts, speed: Array, acceleration: Array, interval: float) -> Array:
    """How far blocks that end before their periods shift a motion, about.

    The rest of a period is run in the next block at full acceleration A, before its ramp begins:
    what a block ended too early by, the next one does by 1 + h (A - a)/(v_k + v_(k+1)) as much,
    so that `HAIR` grows where a motion is slow.

    Parameters
    ----------
    knots : ndarray of int, shape (b, k)
        [intervals]
    speed : ndarray, shape (b, k)
        [mm/s]
    acceleration : ndarray, shape (b,)
        [mm/s^2]
    interval : float
        [s]

    Returns
    -------
    ndarray, shape (b,)
        The largest: by the time at the speed, and at the speed that A gives in a period. [mm]
    """
    h, both = np.diff(knots, axis=1) * interval, speed[:, 1:] + speed[:, :-1]
    rise = np.diff(speed, axis=1)
    growth = 1.0 + (acceleration[:, np.newaxis] * h - rise) / np.maximum(both, CREEP)
    # No faster than F, which the speed at the end of the block is.
    bound = np.maximum(np.abs(rise), CREEP) / acceleration[:, np.newaxis]
    per_time = speed + acceleration[:, np.newaxis] * interval
    now = np.zeros(len(knots))
    most = np.zeros(len(knots))
    for k in range(h.shape[1]):
        begun = h[:, k] > 0.0
        now = np.where(begun, np.minimum(now, bound[:, k]) * growth[:, k] + HAIR, now)
        now = np.minimum(now, interval)
        most = np.maximum(most, now * per_time[:, k])
    return most


def block_kinds(speed: Array) -> NDArray[np.int64]:
    """Which blocks get faster, and which slower, for a control that ends at the lower of two F.

    At a knot between two blocks the speed is the smaller of their F, each of which is the larger of
    the speeds at its ends: a knot that is slower than both its neighbours would be passed too fast,
    unless one of the blocks beside it is even.

    Parameters
    ----------
    speed : ndarray, shape (b, k)
        Of the profile at the knots, 0 at the first and the last.

    Returns
    -------
    ndarray of int, shape (b, k - 1)
        FASTER, SLOWER or EVEN.

    Examples
    --------
    >>> block_kinds(np.array([[0.0, 5.0, 9.0, 6.0, 7.0, 3.0, 0.0]]))
    array([[ 1,  1, -1,  0, -1, -1]])
    """
    rows, columns = speed.shape
    ripple = DIP * speed.max(axis=1, initial=0.0)
    rising = np.ones(rows, dtype=np.bool_)
    extreme, at = np.array(speed[:, 0]), np.zeros(rows, dtype=np.int64)
    turns = np.zeros(speed.shape, dtype=np.int64)
    for k in range(1, columns):
        v = speed[:, k]
        ahead = np.where(rising, v > extreme, v < extreme)
        back = np.where(rising, extreme - v, v - extreme)
        turned = np.flatnonzero(~ahead & (back > ripple))
        turns[turned, at[turned]] = 1
        rising[turned] = ~rising[turned]
        moved = ahead.copy()
        moved[turned] = True
        extreme, at = np.where(moved, v, extreme), np.where(moved, k, at)
    passed = np.cumsum(turns, axis=1)
    kinds = np.where(passed[:, :-1] % 2 == 0, FASTER, SLOWER)
    # Every second turn is a minimum.
    row, knot = np.nonzero((turns == 1) & (passed % 2 == 0))
    before = np.abs(speed[row, knot] - speed[row, knot - 1])
    behind = np.abs(speed[row, np.minimum(knot + 1, columns - 1)] - speed[row, knot])
    kinds[row, np.where(before < behind, knot - 1, knot)] = EVEN
    return kinds


def passed(before: Array, first: Array, second: Array, both: Array) -> tuple[Array, Array, Array]:
    """Speeds at the knot between two blocks, and behind them, where the knot would be a minimum.

    The control passes it at the smaller of the speeds around it, so that one of the blocks is even.

    Parameters
    ----------
    before : ndarray, shape (n,)
        Speed in front of both blocks. [mm/s]
    first, second : ndarray, shape (n,)
        Their lengths. [mm]
    both : ndarray, shape (n,)
        How long they last together. [s]

    Returns
    -------
    between, behind : ndarray, shape (n,)
        Speeds. [mm/s]
    lasts : ndarray, shape (n,)
        How long the first block lasts. [s]
    """
    even = first / before
    behind = 2.0 * second / (both - even) - before
    # The second block even: s with 2 L_1/(b + s) + L_2/s = T.
    b = both * before - 2.0 * first - second
    slow = (np.sqrt(b * b + 4.0 * both * second * before) - b) / (2.0 * both)
    faster = behind >= before
    between = np.where(faster, before, slow)
    lasts = np.where(faster, even, 2.0 * first / (before + slow))
    return between, np.where(faster, behind, slow), lasts
