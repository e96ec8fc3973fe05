"""Whether the F words of a stream belong to its points, where F is the speed at a block's end.

So it is for LinuxCNC (others hold F: `held`): F of a block is the larger of the speeds at its two
ends, known to the last decimal written, far better than from rounded points. That gives these
tests:

- F is not below the mean speed of its block, nor above the velocity limits;
- on a straight line, the tests of `speeds`: the F words are those of one motion within the limits;
- a stream whose F words are their own mirror image, or those of the controller's own rapid, but
  for one block that is not in the middle is damaged in it: notices nearly any change of one F.

For independent axes the speeds are those of no single profile: F is held between the bounds that
the points and the axes' jerk give, which notices gross changes only.

What is promised (README, "How results are checked"): an F in the middle of a stream that is not
above zero, doubled, halved or of another unit is noticed, one that is off by 1 % where the rounding
of the points leaves no other motion open; and no right output is refused. `FEED_STEP` is the
rounding of F, ten times its last decimal. The others are chosen so that every profile on drawn
machines is accepted: `SOLVED` for optima that are symmetric up to what their solver leaves,
`FREE_BLOCKS` and `DRIVEN` to tell profiles apart that agree in their ramps only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, LINUXCNC, LONE_SHARE, Machine
from gcodejerk.units import SECONDS_PER_MINUTE
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.physics.conventional import peak_velocity, rapid_speed, rapid_time
from gcodejerk.verification.physics.points import LINEAR, Array, Paths, feed_speed
from gcodejerk.verification.physics.speeds import RELATIVE, Blocks, Speeds

FEED_STEP = 1e-3
"""Rounding of F that is allowed for. [units/min]"""
FREE_BLOCKS = 8
"""At corners of a profile that the limits drive, fewer blocks than these are within the limits."""
DRIVEN = 0.9
"""Share of a limit from which on a profile counts as driven by it."""
SOLVED = 1e-3
"""Share of F that a stream may differ by where it is nearly symmetric."""
NOT_OWN = "F differs from that of the controller's own rapid"

Rows = NDArray[np.bool_]
Verdicts = list[tuple[Kind, Rows, str]]


def check_feeds(paths: Paths, machine: Machine, t: Array, limits: Array) -> Verdicts:
    """Judge the F words of streams; nothing where there are none.

    Parameters
    ----------
    paths : Paths
        The streams.
    machine : Machine
        Its resolution and positioning.
    t : ndarray, shape (rows,)
        When each point is reached. [s]
    limits : ndarray, shape (3, 9)
        Velocity, acceleration and jerk of each axis.
    """
    speed, length = feed_speed(paths)
    inner = np.ones(len(t), dtype=np.bool_)
    inner[paths.begin] = False
    if not np.isfinite(speed[inner]).any():
        return []
    check = _FeedCheck(paths, machine, t, limits, speed, length)
    out = [
        (Kind.FEED, inner & ~(paths.feed > 0.0), "F must be above zero"),
        check.mean(),
        check.most(),
    ]
    if machine.positioning == "linear":
        # Symmetry first: it says more than that some motion or other would be possible.
        out += [check.conventional(), check.mirror(), *check.motion()]
    else:
        out.append(check.bounds())
    return out


def rapid_limits(paths: Paths, machine: Machine) -> Array:
    """Limits of the controller's own rapid over the displacement, shape (3, moves, 9)."""
    rapid = np.full((3, len(AXES)), np.inf)
    for axis in machine.axes:
        own = axis.conventional(lone=False)
        rapid[:, AXES.index(axis.name)] = own.velocity, own.acceleration, own.jerk
    with np.errstate(divide="ignore"):
        out: Array = rapid[:, np.newaxis, :] / np.abs(paths.displacement)
        if machine.planner == LINUXCNC:
            out[1] *= np.where(paths.lone, LONE_SHARE, 1.0)[:, np.newaxis]
        # A rapid that runs at F does so along its path, in which all axes share.
        length = np.sqrt((paths.displacement[:, LINEAR] ** 2).sum(axis=1))
        out[0] = np.fmin(out[0], (paths.speed / length)[:, np.newaxis])
    return out


class _FeedCheck:
    """The tests; rows are those of the paths, a block belongs to the row in which it ends."""

    def __init__(
        self, paths: Paths, machine: Machine, t: Array, limits: Array, speed: Array, length: Array
    ) -> None:
        self.paths, self.t, self.limits_, self.length = paths, t, limits, length
        self.machine = machine
        owner = self.owner = paths.owner
        self.first = np.zeros(len(t), dtype=np.bool_)
        self.first[paths.begin] = True
        self.last = np.zeros(len(t), dtype=np.bool_)
        self.last[paths.end - 1] = True
        self.F = np.where(self.first, 0.0, speed)
        self.rounding = (FEED_STEP / SECONDS_PER_MINUTE) * paths.unit[owner]
        D = np.abs(paths.displacement)
        self.step = np.where(D > 0.0, paths.step, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            unit = np.where(D > 0.0, limits[:, np.newaxis, :] * length[:, np.newaxis] / D, np.inf)
        self.path_limits: Array = unit.min(axis=2)
        """Of the speed along the path, shape (3, streams)."""
        self.h = np.where(self.first, 1.0, np.diff(t, prepend=0.0))
        self.way_, self.error = self._ways(D)
        self.mean_ = self.way_ / self.h
        self.error_mean = self.error / self.h

    def _ways(self, D: Array) -> tuple[Array, Array]:
        """Way of each block along what F refers to, and what rounding of its ends may add."""
        group = self._group(D)
        delta = np.diff(self.paths.position, axis=0, prepend=self.paths.position[:1])
        delta = np.where(self.first[:, np.newaxis] | ~group[self.owner], 0.0, delta)
        way = np.sqrt((delta**2).sum(axis=1))
        error = np.sqrt(((self.step * group) ** 2).sum(axis=1))[self.owner]
        ends = self.last.astype(int) + np.roll(self.first, 1)
        return way, error * (2 - ends)

    def _group(self, D: Array) -> Rows:
        """Which axes F refers to, for each stream."""
        group = np.zeros((len(D), len(AXES)), dtype=np.bool_)
        left = np.ones(len(D), dtype=np.bool_)
        for axes in (slice(0, 3), slice(6, 9), slice(3, 6)):
            moves = left & (D[:, axes] > 0.0).any(axis=1)
            group[moves, axes] = True
            left &= ~moves
        return group

    def mean(self) -> tuple[Kind, Rows, str]:
        """F is not below the mean speed of its block."""
        sag = self._largest(2) * self.h**2 / 8.0
        least = self.mean_ - sag - self.error_mean - self.rounding
        bad = ~self.first & (least > self.F)
        return Kind.FEED, bad, "F is below the mean speed of its block"

    def most(self) -> tuple[Kind, Rows, str]:
        """F is not above what the axes can do along the path."""
        V = self._largest(0)
        most = V * (1.0 + RELATIVE) + self.rounding
        return Kind.VELOCITY, most < self.F, "F is above the velocity limits"

    def _largest(self, quantity: int) -> Array:
        """Limit along the path, row by row; of axes on their own, the limits of all together."""
        if self.machine.positioning == "linear":
            row: Array = self.path_limits[quantity]
            return row[self.owner]
        displacement = self.paths.displacement
        used = self._group(np.abs(displacement)) & (displacement != 0.0)
        parts = np.where(used, self.limits_[quantity], 0.0)
        together: Array = np.sqrt((parts**2).sum(axis=1))
        return np.asarray(together[self.owner], dtype=np.float64)

    def motion(self) -> Verdicts:
        """Whether one motion within the limits has these speeds."""
        paths = self.paths
        used = self.step * self._group(np.abs(paths.displacement))
        speeds = Speeds(
            Blocks(
                begin=paths.begin,
                end=paths.end,
                owner=self.owner,
                F=self.F,
                rounding=self.rounding,
                h=self.h,
                intervals=np.rint(self.h / self.machine.interval).astype(np.int64),
                way=self.way_,
                error=self.error,
                total=self.length,
                step=np.sqrt((used**2).sum(axis=1)),
                A=self.path_limits[1],
                J=self.path_limits[2],
            )
        )
        differs = np.abs(self.F - self.F[self._mirrored_rows()]) > 2.0 * self.rounding
        mirrored = ~np.logical_or.reduceat(differs, paths.begin)
        return [
            (
                Kind.FEED,
                speeds.peaks(),
                "F is not the larger of the speeds at the ends of its block",
            ),
            (Kind.FEED, speeds.limits(), "F words break the acceleration or jerk limits"),
            (
                Kind.FEED,
                speeds.ways() | speeds.unfit(mirrored),
                "F does not fit the way of its block",
            ),
        ]

    def _mirrored_rows(self) -> NDArray[np.int64]:
        """Row of the block that each block's mirror image is."""
        begin, end, rows = self.paths.begin, self.paths.end, np.arange(len(self.owner))
        return np.where(self.first, rows, begin[self.owner] + end[self.owner] - rows)

    def mirror(self) -> tuple[Kind, Rows, str]:
        """Hold a nearly symmetric stream to its symmetry."""
        bad = self._odd_ones(self.F[self._mirrored_rows()], few=2)
        return Kind.FEED, bad, "F differs from that of the mirrored block"

    def conventional(self) -> tuple[Kind, Rows, str]:
        """Hold what is nearly the controller's own rapid to it."""
        V, A, J = rapid_limits(self.paths, self.machine).min(axis=2)
        profile = np.isfinite(J)
        J = np.where(profile, J, 1.0)
        bell = self.machine.planner == BELL
        total, peak = rapid_time(V, A, J, bell=bell), peak_velocity(V, A, J, bell=bell)
        t = self.t - self.t[self.paths.begin][self.owner]
        columns = (column[self.owner] for column in (total, peak, A, J))
        v = rapid_speed(t, *columns, bell=bell) * self.length[self.owner]
        expected = np.where(self.first, 0.0, np.maximum(v, np.roll(v, 1)))
        bad = self._odd_ones(expected, few=1) & profile[self.owner]
        return Kind.FEED, bad, NOT_OWN

    def _odd_ones(self, expected: Array, few: int) -> Rows:
        """Find the few F words that differ where all others are as expected.

        Of two profiles that the limits drive, the ramps can agree in every F and only the middle
        differ. So what differs counts as odd only where F words nearer to the middle agree, or
        many that no limit forces.
        """
        begin, end, owner = self.paths.begin, self.paths.end, self.owner
        equal = np.abs(self.F - expected) <= 2.0 * self.rounding
        # At constant velocity all profiles are alike.
        highest = np.maximum.reduceat(self.F, begin)[owner]
        telling = ~self.first & (highest - self.F > self.rounding)
        off = np.abs(2.0 * np.arange(len(owner)) - (begin + end)[owner])
        wrong = ~self.first & ~equal
        count = np.add.reduceat(wrong.astype(np.float64), begin)
        nearest = np.minimum.reduceat(np.where(wrong, off, np.inf), begin)[owner]
        inner = np.add.reduceat((telling & equal & (off < nearest)).astype(np.float64), begin)
        agree = np.add.reduceat((telling & equal).astype(np.float64), begin)
        free = np.add.reduceat((telling & equal & self._free()).astype(np.float64), begin)
        freely = (free >= FREE_BLOCKS) & (2.0 * free >= agree)
        nearly = (count <= few) & ((inner >= 2 * few) | freely)
        # An optimum that is symmetric is so up to the solver's accuracy.
        slack = 2.0 * self.rounding + SOLVED * (expected + 0.01 * highest)
        odd: Rows = wrong & (np.abs(self.F - expected) > slack) & nearly[owner]
        return odd

    def _free(self) -> Rows:
        """Blocks whose speeds are at no limit of acceleration or jerk."""
        ends = self.first | self.last
        v = np.where(ends, 0.0, np.minimum(self.F, np.roll(self.F, -1)))
        slope = np.where(self.first, 0.0, (v - np.roll(v, 1)) / self.h)
        bend = np.abs(np.roll(slope, -1) - slope) / self.h
        bend = np.where(self.last, 0.0, bend)
        A, J = self.path_limits[1][self.owner], self.path_limits[2][self.owner]
        before = np.where(self.first, 0.0, np.roll(bend, 1))
        free: Rows = (np.abs(slope) < DRIVEN * A) & (np.maximum(bend, before) < DRIVEN * J)
        return free

    def bounds(self) -> tuple[Kind, Rows, str]:
        """F between bounds of the speed at the ends of its block, axis by axis."""
        h_after = np.roll(self.h, -1)
        low, high = np.zeros(len(self.t)), np.zeros(len(self.t))
        group = self._group(np.abs(self.paths.displacement))
        for a in np.flatnonzero((self.paths.displacement != 0.0).any(axis=0)).tolist():
            used = group[self.owner, a]
            x = self.paths.position[:, a]
            slope = np.where(self.first, 0.0, (x - np.roll(x, 1)) / self.h)
            after = np.roll(slope, -1)
            inner = ~(self.first | self.last)
            v = np.abs(slope * h_after + after * self.h) / (self.h + h_after)
            slack = self.limits_[2, a] * self.h * h_after / 4.0
            slack = slack + 2.0 * self.step[self.owner, a] / np.minimum(self.h, h_after)
            v, slack = np.where(inner & used, v, 0.0), np.where(inner & used, slack, 0.0)
            low += np.maximum(v - slack, 0.0) ** 2
            high += (v + slack) ** 2
        low, high = np.sqrt(low), np.sqrt(high)
        least = np.maximum(low, np.roll(low, 1)) - self.rounding
        most = np.maximum(high, np.roll(high, 1)) + self.rounding
        several = (self.paths.count > 1)[self.owner]
        bad = ~self.first & several & ((least > self.F) | (most < self.F))
        return Kind.FEED, bad, "F is not a speed that the axes have at the ends of its block"
