"""How fast the points of a stream follow each other: time, limits, feeds.

The time between two points is not written; it follows from the machine's interval: every block
lasts `stride` intervals, and the remainder of the division lengthens one block in the middle. Where
the control holds F over a block, its F says so too (`held`).

Velocity, acceleration and jerk are divided differences of the points. Times a factorial, such a
difference is a weighted mean of the derivative, so exact points of a motion within its limits
never exceed them, however short or long the blocks are; only the rounding of the points needs a
tolerance. Where the points set the speed, that of a velocity is one step for each block: the points
are rounded so that none has more. Where F bounds it (LinuxCNC), it is one step at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, Machine
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.conventional import rapid_time
from gcodejerk.verification.physics.feeds import NOT_OWN, check_feeds, rapid_limits
from gcodejerk.verification.physics.held import MIRRORED, Blocks, check_held, check_mirror
from gcodejerk.verification.physics.independent import check_axes
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.points import Array, Index, Paths
from gcodejerk.verification.physics.residual import leaves_more

BLOCK_TIME = 0.002
"""Of a G-code block. [s]"""
ON_GRID = 1e-6
"""A time this little off a whole number of intervals is that number. [intervals]"""
RELATIVE = 1e-9


def stride_of(machine: Machine) -> int:
    """Intervals of a block in G-code."""
    return max(1, round(BLOCK_TIME / machine.interval))


def limits_of(machine: Machine) -> Array:
    """Velocity, acceleration and jerk that a design may use, shape (3, 9); infinite without axis.

    An axis without a jerk limit stands any jerk; from one interval to the next its acceleration can
    then go from one limit to the other.
    """
    out = np.full((3, len(AXES)), np.inf)
    for axis in machine.axes:
        limit = axis.limit
        jerk = (
            limit.jerk if np.isfinite(limit.jerk) else 2.0 * limit.acceleration / machine.interval
        )
        out[:, AXES.index(axis.name)] = limit.velocity, limit.acceleration, jerk
    return out


def conventional_counts(paths: Paths, machine: Machine) -> tuple[Index, Index]:
    """Whole intervals that rapids take conventionally, and those that they may take at most."""
    displacement = paths.displacement
    total = _move_time(rapid_limits(paths, machine), displacement, machine, machine.planner == BELL)
    usual = np.maximum(np.ceil(total / machine.interval - ON_GRID), 1.0)
    longest = np.floor(total * (1.0 + machine.design.max_extension) / machine.interval + ON_GRID)
    if machine.design.profile == "shortest":
        longest = _longest(total, displacement, machine)
    most = np.maximum(usual, longest)
    return usual.astype(np.int64), most.astype(np.int64)


def _move_time(limits: Array, displacement: Array, machine: Machine, bell: bool = False) -> Array:
    """Duration [s] of the fastest symmetric moves within limits, shape (3, moves, 9)."""
    if machine.positioning == "linear":
        return rapid_time(*limits.min(axis=2), bell=bell)
    total: Array = _axis_times(limits, displacement, bell).max(axis=1, initial=0.0)
    return total


def _axis_times(limits: Array, displacement: Array, bell: bool = False) -> Array:
    """The same for each axis by itself, shape (moves, 9)."""
    moving = displacement != 0.0
    each = np.zeros(displacement.shape)
    each[moving] = rapid_time(*limits[:, moving], bell=bell)
    return each


def _own_times(paths: Paths, machine: Machine) -> tuple[Array, Array]:
    """What each axis takes by itself [s], shape (moves, 9): conventionally, and at most."""
    dt, displacement = machine.interval, paths.displacement
    each = _axis_times(rapid_limits(paths, machine), displacement, machine.planner == BELL)
    usual = np.ceil(each / dt - ON_GRID)
    if machine.design.profile == "shortest":
        alone = _axis_times(_own_limits(displacement, machine), displacement)
        longest = np.ceil((np.maximum(each, alone) + 2.0 * _periods(machine)) / dt)
    else:
        longest = np.floor(each * (1.0 + machine.design.max_extension) / dt + ON_GRID)
    return usual * dt, np.maximum(usual, longest) * dt


def _own_limits(displacement: Array, machine: Machine) -> Array:
    """Limits of designs over the displacement, shape (3, moves, 9)."""
    with np.errstate(divide="ignore"):
        V, A, J = limits_of(machine)[:, np.newaxis, :] / np.abs(displacement)
    # A design's acceleration rises for an interval at least.
    return np.stack([V, A, np.minimum(J, A / machine.interval)])


def _periods(machine: Machine) -> float:
    """One period of every mode, one behind the other, in s."""
    return float((2.0 * np.pi / Oscillators.of(machine).poles.imag).sum())


def _longest(total: Array, displacement: Array, machine: Machine) -> Array:
    """Intervals after which a rapid of the profile `shortest` is settled in any case.

    Two periods of every mode are enough to leave it at rest, whatever it does before; the time
    itself is that of the controller, or the least that the limits allow where that is longer.
    """
    fastest = _move_time(_own_limits(displacement, machine), displacement, machine)
    time = np.maximum(total, fastest) + 2.0 * _periods(machine)
    longest: Array = np.ceil(time / machine.interval)
    return longest


@dataclass(frozen=True, slots=True, eq=False)
class Clock:
    """A guess of when each row's point is reached: whole intervals since the start."""

    moment: Index

    @classmethod
    def of(cls, paths: Paths, count: Index, stride: int, late: Index) -> Clock:
        """Blocks of `stride` intervals, the remainder of `count` in block number `late` from 0."""
        block = np.arange(len(paths.position)) - paths.begin[paths.owner]
        rest = count - paths.count * stride
        moment = block * stride + np.where(block > late[paths.owner], rest[paths.owner], 0)
        return cls(moment.astype(np.int64))


def check_dynamics(
    paths: Paths, machine: Machine, stride: int, found: Findings, *, end_speeds: bool
) -> None:
    """Duration, limits and feeds of streams; feeds only where the streams have them.

    With `end_speeds` F of a block is the larger of the speeds at its ends (LinuxCNC), and the
    motion between the points is the profile's; without, the control moves in straight lines.
    """
    usual, most = conventional_counts(paths, machine)
    blocks = paths.count
    fewest = np.where(blocks > 1, blocks * stride, 1)
    for k in np.flatnonzero(fewest > most).tolist():
        ms = 1e3 * machine.interval
        problem = f"stream lasts {fewest[k] * ms:g} ms, the rapid may last {most[k] * ms:g} ms"
        found.add(Kind.TIME, int(paths.line[k]), int(paths.original_line[k]), problem)
    highest = np.maximum(np.minimum(blocks * stride + stride - 1, most), fewest)
    count = np.clip(usual, fewest, highest)
    clock = Clock.of(paths, count, stride, blocks // 2)
    best: list[Complaint | None] = _check_points(paths, machine, clock, end_speeds)
    # Another duration may fit where the usual one does not: nothing says which was meant.
    for other in range(stride if stride > 1 else 0):
        for late in (blocks // 2, (blocks - 1) // 2):
            # What is nearly the controller's own rapid at its own times is that one, damaged.
            open_ = [k for k, c in enumerate(best) if c is not None and c.problem != NOT_OWN]
            bad = np.array(open_, dtype=np.int64)
            guess = np.where(blocks > 1, blocks * stride + other, 1 + other)
            bad = bad[(guess[bad] >= fewest[bad]) & (guess[bad] <= highest[bad])]
            if not len(bad):
                continue
            part = _take(paths, bad)
            clock = Clock.of(part, guess[bad], stride, late[bad])
            judged = _check_points(part, machine, clock, end_speeds)
            for k, complaint in zip(bad.tolist(), judged, strict=True):
                if complaint is None:
                    best[k] = None
    for k, complaint in enumerate(best):
        if complaint is not None:
            line = int(paths.line[k]) + max(complaint.block, 0)
            found.add(complaint.kind, line, int(paths.original_line[k]), complaint.problem)


@dataclass(frozen=True, slots=True)
class Complaint:
    """The first thing that is wrong with a stream, in block `block` from 0."""

    kind: Kind
    block: int
    problem: str


def _check_points(
    paths: Paths, machine: Machine, clock: Clock, end_speeds: bool
) -> list[Complaint | None]:
    """Look at each stream under one guess of its times."""
    out: list[Complaint | None] = [None] * len(paths.begin)
    t: Array = np.asarray(clock.moment * machine.interval, dtype=np.float64)
    independent = machine.positioning != "linear"
    has_feeds = bool(np.isfinite(paths.feed).any())
    if end_speeds:
        feeds = check_feeds(paths, machine, t, limits_of(machine))
    else:
        feeds = check_held(paths, machine.interval, clock.moment) if has_feeds else []
        if has_feeds and not independent and machine.design.profile in MIRRORED:
            feeds.append(check_mirror(paths, clock.moment))
    for kind, rows, problem in (
        *(check_axes(paths, machine, t, *_own_times(paths, machine)) if independent else ()),
        *_limits(paths, machine, t, end_speeds),
        *feeds,
    ):
        bad = np.flatnonzero(rows)
        owner = paths.owner[bad]
        for at in np.unique(owner, return_index=True)[1].tolist():
            k = int(owner[at])
            if out[k] is None:
                out[k] = Complaint(kind, int(bad[at] - paths.begin[k]) - 1, problem)
    own = rapid_limits(paths, machine)
    played, moment = paths, clock.moment
    if has_feeds and not end_speeds:
        blocks = Blocks(paths, moment)
        played, moment = blocks.played(), blocks.arrivals()
    excess = leaves_more(played, machine, moment, own, straight=not end_speeds)
    for k, left, allowed in zip(*excess.columns(), strict=True):
        if out[k] is None:
            problem = (
                f"leaves {1e3 * left:.3g} um of vibration, at most {1e3 * allowed:.3g} um are "
                "left by the controller's own rapid"
            )
            out[k] = Complaint(Kind.RESIDUAL, 0, problem)
    return out


def _take(paths: Paths, streams: Index) -> Paths:
    """Take some of the streams."""
    rows = np.concatenate([np.arange(paths.begin[k], paths.end[k]) for k in streams.tolist()])
    size = paths.end[streams] - paths.begin[streams]
    end = np.cumsum(size)
    return Paths(
        rapid=paths.rapid[streams],
        original_line=paths.original_line[streams],
        line=paths.line[streams],
        begin=end - size,
        end=end,
        position=paths.position[rows],
        feed=paths.feed[rows],
        start=paths.start[streams],
        displacement=paths.displacement[streams],
        unit=paths.unit[streams],
        speed=paths.speed[streams],
        step=paths.step[streams],
        lone=paths.lone[streams],
    )


PAD = 2
"""Moments of rest in front of and behind a stream that differences reach into."""


@dataclass(frozen=True, slots=True, eq=False)
class Padded:
    """Rows of all streams with rest in front and behind."""

    row: Index
    """Row of the paths that each padded row repeats."""
    owner: Index
    t: Array

    @classmethod
    def of(cls, paths: Paths, t: Array) -> Padded:
        """Pad every stream; rest is as far apart as the first and the last block are long."""
        size = paths.end - paths.begin + 2 * PAD
        owner = np.repeat(np.arange(len(size)), size)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(size) - size, size) - PAD
        inner = np.clip(place, 0, (paths.end - paths.begin - 1)[owner])
        row = paths.begin[owner] + inner
        h = t[paths.begin + 1] - t[paths.begin]
        beyond = (place - inner) * h[owner]
        return cls(row, owner, t[row] + beyond)

    def differences(self, values: Array, order: int) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Divided differences times the factorial of their order.

        Returns
        -------
        tuple of ndarray, shape (rows - order,)
            The differences; what an error of 1 in every value may add to each; and whether each
            lies within one stream.
        """
        out, error, t = values, np.ones(len(values)), self.t
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(1, order + 1):
                span = (t[k:] - t[:-k]) / k
                out = np.diff(out) / span
                error = (error[1:] + error[:-1]) / span
        return out, error, self.owner[order:] == self.owner[:-order]

    def rows_of(self, order: int, bad: NDArray[np.bool_], rows: int) -> NDArray[np.bool_]:
        """Mark the last row that takes part in each bad difference."""
        marked = np.zeros(rows, dtype=np.bool_)
        marked[self.row[order // 2 + 1 :][: len(bad)][bad]] = True
        return marked


_ORDERS = ((1, Kind.VELOCITY, "s"), (2, Kind.ACCELERATION, "s^2"), (3, Kind.JERK, "s^3"))


def _limits(
    paths: Paths, machine: Machine, t: Array, end_speeds: bool
) -> list[tuple[Kind, NDArray[np.bool_], str]]:
    """Compare every moving axis with what designs may use."""
    padded = Padded.of(paths, t)
    limits = limits_of(machine)
    out = []
    for a in np.flatnonzero((paths.displacement != 0.0).any(axis=0)).tolist():
        x = (paths.position[:, a] - paths.start[paths.owner, a])[padded.row]
        for order, kind, unit in _ORDERS:
            limit = limits[order - 1, a]
            value, error, inside = padded.differences(x, order)
            step = paths.step[padded.owner[: len(value)], a]
            if order == 1 and not end_speeds:
                step = 0.5 * step
            bad = inside & (np.abs(value) > limit * (1.0 + RELATIVE) + error * step)
            if bad.any():
                problem = f"{AXES[a]} passes its limit of {limit:g} mm/{unit}"
                out.append((kind, padded.rows_of(order, bad, len(t)), problem))
    return out
