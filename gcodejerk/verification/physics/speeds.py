r"""The speeds that a stream's F words give its points, and whether a motion has them.

F of a block is the larger of the speeds at its two ends. So F on both sides bounds the speed of a
point from above, and *pins* it where it can stand at no other end: where F rises, the end of the
faster block has F; where F falls, the beginning of the faster block has it. At a point between two
equal F and at a local minimum only the upper bound is known, and the points tell the rest.

This module owns what follows for a motion of bounded jerk J through points known to a step, with
blocks of duration h:

- the ends of a block have its F: a single block whose neighbours are both slower is none;
- the mean speed of a block is the mean of its ends' speeds, up to :math:`J h^2/12` (the integral
  of :math:`\tau(h - \tau)/2` times the jerk);
- the acceleration at a point follows from the block before it and from the block behind it,
  :math:`(4 v_k + 2 v_{k-1} - 6 m_k)/h` and :math:`(6 m_{k+1} - 4 v_k - 2 v_{k+1})/h`, each up to
  :math:`8 J h/27`: one motion has one acceleration;
- differences of the speeds keep the limits of acceleration and jerk;
- a motion whose jerk is smooth has the mean speeds that its neighbours give (the trapezoid with its
  correction for acceleration). A motion whose jerk is not may have a jerk of its own in every
  interval, but none inside it: the trapezoids of all blocks of one or two intervals then add up to
  the way *exactly*, since what is neglected in each, :math:`h^2/12` times the change of the
  acceleration, adds up to nothing from rest to rest. Either the one or the other must hold.

No test here stands for another: without any one of them some damage passes. What they notice of a
single F changed by 1 % is measured in `tests/property/test_verify_profiles`.

Where the numbers come from. The trapezoid of a block is wrong by the integral of the jerk times
:math:`h^3 B_3(\tau)/6`, with the Bernoulli polynomial :math:`B_3` of at most :math:`\sqrt 3/36`;
`END`, `FEW_ENDS` and `SPREAD` are that, for a jerk that changes once, at the eight ends of seven
segments, or in every interval. `RELATIVE` is the rounding of limits as float64. Only `JUMP` is
measured: smooth blocks of all profiles stay below it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.verification.physics.points import Array, Index

Rows = NDArray[np.bool_]

RELATIVE = 1e-6
"""Rounding of the limits."""
END = 3.0**0.5 / 216.0
"""What one change of the jerk leaves of a block's trapezoid, of the change and h^3, at most."""
FEW_ENDS = 8 * 2.0 * END
"""What the eight ends of seven segments leave, each from one limit of jerk to the other."""
SPREAD = (0.0, 0.0, 4.0 / 162.0, 4.0 * END)
"""What a jerk per interval leaves of the sum of trapezoids, of the limit of jerk and h^3, for a
block of one, two, three, and four intervals or more."""
JUMP = 0.3
"""What a smooth block's correction may be wrong by, of the range of the jerk near it and h^2."""


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks of many streams; a row is a point and the block that ends in it.

    Attributes
    ----------
    begin, end : ndarray of int, shape (streams,)
        Rows of each stream; the first is its start.
    owner : ndarray of int, shape (rows,)
        Stream of each row.
    F : ndarray, shape (rows,)
        Speed that F asks for, 0 in first rows. [mm/s]
    rounding : ndarray, shape (rows,)
        What the last decimal of F leaves open. [mm/s]
    h : ndarray, shape (rows,)
        Duration of the block. [s]
    intervals : ndarray of int, shape (rows,)
        The same in command intervals.
    way, error : ndarray, shape (rows,)
        Its way, and what the rounding of its ends may add. [mm]
    total, step : ndarray, shape (streams,)
        Exact way of each stream, and what the rounding of one point may add to a way. [mm]
    A, J : ndarray, shape (streams,)
        Limits along the path. [mm/s^2], [mm/s^3]
    """

    begin: Index
    end: Index
    owner: Index
    F: Array
    rounding: Array
    h: Array
    intervals: Index
    way: Array
    error: Array
    total: Array
    step: Array
    A: Array
    J: Array

    @property
    def first(self) -> Rows:
        """Rows of starts."""
        out = np.zeros(len(self.owner), dtype=np.bool_)
        out[self.begin] = True
        return out

    @property
    def last(self) -> Rows:
        """Rows of ends."""
        out = np.zeros(len(self.owner), dtype=np.bool_)
        out[self.end - 1] = True
        return out


class Speeds:
    """Speeds at the points of streams of several blocks, between bounds."""

    def __init__(self, blocks: Blocks) -> None:
        b = self.blocks = blocks
        self.first, self.last = b.first, b.last
        self.single = (b.end - b.begin == 2)[b.owner]
        self.mean = np.where(self.first, 0.0, b.way / b.h)
        self.error = np.where(self.first, 0.0, b.error / b.h)
        self.J = b.J[b.owner]
        ends = self.first | self.last
        after = np.roll(b.F, -1)
        self.high: Array = np.where(ends, 0.0, np.minimum(b.F, after))
        """Of the speed at each point: the smaller F of its two sides. [mm/s]"""
        rises = np.where(self.first, 0.0, np.roll(b.F, 1)) + 2.0 * b.rounding < b.F
        later = np.where(np.roll(self.last, -1), 0.0, np.roll(b.F, -2))
        falls = after > later + 2.0 * b.rounding
        self.pinned: Rows = ends | (rises & ~self.first) | falls
        self.low: Array = np.where(self.pinned, self.high, self._least())
        """Of the speed at each point. [mm/s]"""

    def _least(self) -> Array:
        """What the mean speeds of the blocks on both sides leave for a point."""
        margin = self.error + self.J * self.blocks.h**2 / 12.0
        before = 2.0 * (self.mean - margin) - np.roll(self.high, 1)
        behind = np.roll(2.0 * (self.mean - margin), -1) - np.roll(self.high, -1)
        return np.clip(np.maximum(before, behind), 0.0, self.high)

    def peaks(self) -> Rows:
        """Blocks whose F stands at neither end."""
        b = self.blocks
        before = np.where(self.first, 0.0, np.roll(self.high, 1))
        out: Rows = ~self.first & ~self.single
        out &= np.maximum(before, self.high) + b.rounding < b.F
        return out

    def limits(self) -> Rows:
        """Blocks where the speeds break the limits of acceleration or jerk."""
        b, v, h, first = self.blocks, self.high, self.blocks.h, self.first
        sure = self.pinned & ~first & np.roll(self.pinned, 1)
        slope = np.where(first, 0.0, (v - np.roll(v, 1)) / h)
        A, J = b.A[b.owner], self.J
        bad = sure & (np.abs(slope) > A * (1.0 + RELATIVE) + 2.0 * b.rounding / h)
        # At a start the acceleration before is 0, and so it is after the last point.
        second = np.roll(first, 1)
        span = np.where(second, h, 0.5 * (h + np.roll(h, 1)))
        before = np.where(second, 0.0, np.roll(slope, 1))
        jerk = np.where(first, 0.0, (slope - before) / span)
        ending = np.where(self.last, -slope / h, 0.0)
        margin = J * (1.0 + RELATIVE) + 4.0 * b.rounding / np.minimum(h, span) ** 2
        bad |= sure & (second | np.roll(sure, 1)) & (np.abs(jerk) > margin)
        bad |= sure & (np.abs(ending) > margin)
        out: Rows = bad & ~self.single
        return out

    def ways(self) -> Rows:
        """Blocks whose way no motion within the jerk limit covers with these speeds."""
        b, h, first = self.blocks, self.blocks.h, self.first
        margin = self.J * (1.0 + RELATIVE) * h**2 / 12.0 + self.error + b.rounding
        least = 0.5 * (np.roll(self.low, 1) + self.low)
        most = 0.5 * (np.roll(self.high, 1) + self.high)
        bad = (self.mean < least - margin) | (self.mean > most + margin)
        # The acceleration at a point, from the block before it and from the one behind it.
        v, sure = self.high, self.pinned & np.roll(self.pinned, 1) & ~first
        slack = (8.0 / 27.0) * self.J * (1.0 + RELATIVE) * h
        slack += (6.0 * self.error + 6.0 * b.rounding) / h
        at_end = np.where(first, 0.0, (4.0 * v + 2.0 * np.roll(v, 1) - 6.0 * self.mean) / h)
        at_begin = np.roll((6.0 * self.mean - 4.0 * np.roll(v, 1) - 2.0 * v) / h, -1)
        known = np.roll(sure, -1)
        slack_end = np.where(first, 0.0, slack)
        slack_begin = np.where(self.last, 0.0, np.roll(slack, -1))
        at_begin = np.where(self.last, 0.0, at_begin)
        both = (sure | first) & (known | self.last)
        bad |= both & (np.abs(at_end - at_begin) > slack_end + slack_begin)
        out: Rows = ~first & ~self.single & (bad | np.roll(bad & first, 1))
        return out

    def rough(self) -> Rows:
        """Blocks whose way does not follow from speeds of smooth jerk around them."""
        b, v, h, first = self.blocks, self.high, self.blocks.h, self.first
        ends = first | self.last
        slope = np.where(first, 0.0, (v - np.roll(v, 1)) / h)
        after, h_after = np.roll(slope, -1), np.roll(h, -1)
        at = np.where(ends, 0.0, (slope * h_after + after * h) / (h + h_after))
        jerk = np.where(ends, 0.0, 2.0 * (after - slope) / (h + h_after))
        jerk = np.where(first, 2.0 * after / h_after, jerk)
        jerk = np.where(self.last, -2.0 * slope / h, jerk)
        expected = 0.5 * (np.roll(v, 1) + v) - h / 12.0 * (at - np.roll(at, 1))
        high = low = jerk
        for shift in (-1, 1, 2):
            near = np.where(b.owner == np.roll(b.owner, shift), np.roll(jerk, shift), 0.0)
            high, low = np.maximum(high, near), np.minimum(low, near)
        allowed = JUMP * h**2 * (high - low) + self.error + b.rounding
        out: Rows = ~first & ~self.single & (np.abs(self.mean - expected) > allowed)
        return out

    def unfit(self, mirrored: Rows) -> Rows:
        """Blocks that no profile explains, of few segments or with a jerk for every interval.

        Parameters
        ----------
        mirrored : ndarray of bool, shape (streams,)
            Streams whose F words are their own mirror image: none of them alone was changed.
        """
        b = self.blocks
        bad = self.rough() & ~(mirrored | self.closed(0.0))[b.owner]
        # Whatever the profile, it is one of few segments or one of a jerk per interval.
        h = np.maximum.reduceat(np.where(self.first, 0.0, b.h), b.begin)
        whole = self.closed(FEW_ENDS * b.J * h**3)
        out: Rows = bad | (self.last & ~self.single & ~whole[b.owner])
        return out

    def closed(self, extra: Array | float) -> Rows:
        """Streams, by stream, whose trapezoids add up to their way, up to what is known of it."""
        b, first = self.blocks, self.first
        trapezoid = np.where(first, 0.0, 0.5 * (np.roll(self.high, 1) + self.high) * b.h)
        excess = self._sum(trapezoid) - b.total
        spread = np.array(SPREAD)[np.clip(b.intervals, 1, 4) - 1]
        slack = np.where(first, 0.0, b.rounding * b.h + spread * self.J * b.h**3)
        allowed = extra + self._sum(slack)
        after = np.roll(np.where(first, 0.0, b.h), -1)
        open_ = np.where(self.pinned, 0.0, (self.high - self.low) * 0.5 * (b.h + after))
        free = np.minimum(self._sum(open_), self._plateaus())
        closed: Rows = (excess <= allowed + free) & (excess >= -allowed)
        return closed

    def _plateaus(self) -> Array:
        """What speeds below F between equal F may miss of the way, infinite at a minimum."""
        b = self.blocks
        flat = np.abs(np.roll(b.F, -1) - b.F) <= 2.0 * b.rounding
        dips = self._sum((~self.pinned & ~flat).astype(np.float64))
        level = ~self.first & (~self.pinned | np.roll(~self.pinned, 1))
        missing = self._sum(np.where(level, b.F * b.h - b.way, 0.0))
        runs = self._sum((level & ~np.roll(level, 1)).astype(np.float64))
        most = 3.0 * (np.maximum(missing, 0.0) + 2.0 * runs * b.step)
        out: Array = np.where(dips > 0.0, np.inf, most)
        return out

    def _sum(self, values: Array) -> Array:
        """Sum over each stream."""
        out: Array = np.add.reduceat(values, self.blocks.begin)
        return out
