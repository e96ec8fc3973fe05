r"""Streams for LinuxCNC as numbers: positions of some decimals, and speeds that follow from them.

The length of a block and its speeds say how long it lasts; so where positions are rounded, speeds
are not what was fitted any more. This module owns the way from fitted speeds to written numbers
from which every block ends where it should, and what is played of these.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Grid
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.knots import CREEP, HAIR, passed
from gcodejerk.motion.servo.spline_filter import filtered
from gcodejerk.planning.straight import LINEAR, StraightMoves, leading_axis

TAIL = 2e-5
"""Way at the end that is crept, so that the speed at the last period is known and low. [mm]"""
FEEDBACK = 0.2
"""Share of the way by which rounding is behind that each block makes good."""
AT_ONCE = 2048
"""Moves whose every period is looked at together: what is made of one does not depend on others."""
LONGEST_TAIL = 0.0099
"""Of the tail. [s]"""
ON_STEP = 1e-4
"""A position this little off a step is on it. [steps]"""
BITS = 8.0
"""Last bits of a position that the rounding of a length, in mm or inches, may be off by."""
EARLIEST, SLOWLY, SLOW = 2e-6, 5e-5, 1.0
"""A block may end so much before its period, and one slower than this so much: until then the
control runs the next one at full acceleration, but no faster than it ends. [s], [s], [mm/s]"""


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """Positions in whole steps, and the speeds that follow from exactly these.

    Attributes
    ----------
    moves : StraightMoves
        b moves.
    grid : Grid
        The knots and the end of the tail, k columns.
    whole : ndarray of int, shape (b, k, 3)
        Positions of the axes, counted from the origin. [steps]
    moved : ndarray, shape (b, k, 3)
        The same from the start. [mm]
    way : ndarray, shape (b, k)
        Along the path from the beginning of the stream. [mm]
    speed : ndarray, shape (b, k)
        Along the path; that of the last column is the tail's. [mm/s]
    """

    moves: StraightMoves
    grid: Grid
    whole: NDArray[np.int64]
    moved: Array
    way: Array
    speed: Array

    @classmethod
    def of(cls, moves: StraightMoves, knots: Counts, speeds: Array) -> Written:
        """Round, from knot to knot.

        With v_k = 2 L_k/h - v_(k-1) an error would come back with the other sign in every block: so
        each position is where the speed that was reached, and the one that is wanted, lead to.
        Where rounding makes a knot slower than both its neighbours, the control passes it as fast
        as the slower of these: the block behind it makes up for that.
        """
        sampler, interval, step = moves.sampler, moves.sampler.interval, moves.step
        axes = range(len(LINEAR))
        start = np.stack([sampler.start(axis) for axis in axes], axis=1)
        origin = np.stack([sampler.number_format.origin[:, axis] for axis in axes], axis=1)
        moving = moves.direction != 0.0
        from_origin = start - np.where(moving, origin, 0.0)
        size = step[:, np.newaxis]
        rows = np.arange(len(step))
        leading = leading_axis(moves.direction)
        sign = np.sign(moves.direction[rows, leading]).astype(np.int64)

        # No point before the start or behind the end, wherever these lie between two steps.
        limits = from_origin, from_origin + moves.direction * moves.length[:, np.newaxis]
        lowest = np.ceil(np.minimum(*limits) / size - ON_STEP)
        highest = np.floor(np.maximum(*limits) / size + ON_STEP)

        def whole_of(way: Array) -> NDArray[np.int64]:
            exact = np.rint((from_origin + moves.direction * way[:, np.newaxis]) / size)
            return np.clip(exact, lowest, np.maximum(highest, lowest)).astype(np.int64)

        count = knots.shape[1]
        whole = np.zeros((len(step), count + 1, len(LINEAR)), dtype=np.int64)
        at_rest = np.where(moving, from_origin, 0.0)
        here = whole_of(np.zeros(len(step)))
        here[rows, leading] += sign * moves.outer
        position = np.array(at_rest)
        position[rows, leading] = here[rows, leading] * step
        whole[:, 0] = here
        way, speed = np.zeros((len(step), count + 1)), np.zeros((len(step), count + 1))
        ideal, begin = np.zeros(len(step)), moves.outer * step
        lasts, length = np.zeros(len(step)), np.zeros(len(step))
        # A length far from zero is known to some last bits only, which a slow block feels.
        far = np.abs(np.stack(limits)) * moving
        both = np.where(np.diff(knots, axis=1) > 0, speeds[:, 1:] + speeds[:, :-1], np.inf)
        slowest = np.clip(both.min(axis=1, initial=np.inf), CREEP, 1e3)
        known = BITS * np.finfo(float).eps * (1.0 + far.max(axis=(0, 2)))
        hair = HAIR + 2.0 * known / slowest
        for k in range(1, count):
            whole_h = (knots[:, k] - knots[:, k - 1]) * interval
            runs = whole_h > 0.0
            first = knots[:, k - 1] == 0
            whole_h = np.where(runs, whole_h - np.where(first, hair, 0.0), 1.0)
            behind = ideal - way[:, k - 1]
            aim = speed[:, k - 1] + speeds[:, k]
            ideal = np.where(runs, ideal + 0.5 * whole_h * (speeds[:, k - 1] + speeds[:, k]), ideal)
            to = way[:, k - 1] + 0.5 * whole_h * aim + FEEDBACK * behind
            here = np.where(runs[:, np.newaxis], whole_of(begin + to), whole[:, k - 1])
            there = np.where(moving, here * size, 0.0)
            before, length = length, np.sqrt(((there - position) ** 2).sum(axis=1))
            way[:, k] = way[:, k - 1] + np.where(runs, length, 0.0)
            speed[:, k] = np.where(runs, 2.0 * length / whole_h - speed[:, k - 1], 0.0)
            dip = runs & ~first & (speed[:, k - 1] < speed[:, k - 2])
            dip &= speed[:, k] > speed[:, k - 1]
            early = np.zeros(len(step))
            if dip.any():
                at = np.flatnonzero(dip)
                ends = passed(speed[at, k - 2], before[at], length[at], lasts[at] + whole_h[at])
                speed[at, k - 1], speed[at, k], early[at] = ends
                early[at] = lasts[at] - early[at]
            lasts = whole_h + early
            whole[:, k] = here
            position = np.where(runs[:, np.newaxis], there, position)
        end = whole_of(moves.length)
        end[rows, leading] -= sign * moves.outer
        there = np.where(moving, end * size, 0.0)
        whole[:, count] = end
        way[:, count] = way[:, count - 1] + np.sqrt(((there - position) ** 2).sum(axis=1))
        speed[:, count] = speed[:, count - 1]
        tail = max(2, round(TAIL / CREEP / interval))
        grid = Grid(
            moves.count + tail, np.concatenate([knots, knots[:, -1:] + tail], axis=1), interval
        )
        moved = np.where(moving[:, np.newaxis], whole * step[:, np.newaxis, np.newaxis], 0.0)
        moved -= at_rest[:, np.newaxis]
        return cls(moves, grid, whole, moved, way, speed)

    def punctual(self) -> NDArray[np.bool_]:
        """Whether every block ends before its period and not too early, as the control runs it."""
        knots, interval = self.grid.knots[:, :-1], self.grid.interval
        speed, way = self.speed[:, :-1], self.way[:, :-1]
        runs = np.diff(knots, axis=1) > 0
        feed = np.maximum(speed[:, 1:], speed[:, :-1])
        ends = np.minimum(feed, np.concatenate([feed[:, 1:], self.speed[:, -1:]], axis=1))
        begins = np.concatenate([np.zeros_like(ends[:, :1]), ends[:, :-1]], axis=1)
        begins = np.where(knots[:, :-1] == 0, 0.0, begins)
        with np.errstate(divide="ignore", invalid="ignore"):
            lasts = np.where(runs, 2.0 * np.diff(way, axis=1) / (begins + ends), 0.0)
        early = knots[:, 1:] * interval - np.cumsum(lasts, axis=1)
        late = early < 0.5 * HAIR
        soon = early > np.where(ends > SLOW, EARLIEST, SLOWLY)
        tail = np.diff(self.way[:, -2:], axis=1)[:, 0]
        crept = (tail > 0.0) & (tail < LONGEST_TAIL * self.speed[:, -1])
        crept &= self.speed[:, -1] < 2.0 * CREEP
        out: NDArray[np.bool_] = ~((late | soon) & runs).any(axis=1) & crept
        return out

    def played(self) -> tuple[Array, Grid]:
        """Way along the path behind the filter, from one period early to one late [mm]."""
        knots, interval = self.grid.knots, self.grid.interval
        h = np.diff(knots, axis=1)
        total = self.grid.counts
        width = int(total.max(initial=1))
        before, behind = self.speed[:, :-1].copy(), self.speed[:, 1:].copy()
        # The tail takes its whole periods at one speed.
        before[:, -1] = behind[:, -1] = np.diff(self.way[:, -2:], axis=1)[:, 0] / (
            h[:, -1] * interval
        )
        rise = 0.5 * (behind - before) / (np.maximum(h, 1) * interval)
        every = np.zeros((len(total), width + 4))
        for row in range(0, len(total), AT_ONCE):
            part = slice(row, row + AT_ONCE)
            lasts = h[part].ravel()
            block = np.repeat(np.arange(len(lasts)), lasts)
            begin = np.cumsum(lasts) - lasts
            tau = (np.arange(len(block)) - begin[block] + 1.0) * interval
            x = self.way[part, :-1].ravel()[block]
            x = x + (before[part].ravel()[block] + rise[part].ravel()[block] * tau) * tau
            inside = np.arange(width) >= (width - total[part])[:, np.newaxis]
            every[part, 2:-2][inside] = x
        every[:, -2:] = self.way[:, -1:]
        return filtered(every)[:, :-1], Grid.every(total + 2, 1, interval)
