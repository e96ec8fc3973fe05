r"""Streams for LinuxCNC, judged by what it plays of them.

LinuxCNC 2.9 ends a block with the smaller of its own F and the next one's, and changes the speed
linearly within it: so the speeds at the points follow from F words, the times from speeds and
lengths, and the positions in every servo period from both. What the drives get is
:math:`(x_{i-1} + 4 x_i + x_{i+1}) / 6` of these. This module owns what follows:

- F of a block is the larger of the speeds at its ends;
- every block ends a hair in front of a servo period, and has two periods at least, the first and
  the last before the tail three: what the control makes of others is not what was planned;
- no two successive F are equal, so that the control joins no blocks;
- speeds and accelerations within the limits; the accelerations of blocks within what
  MAX_ACCELERATION has to be;
- the whole lasts as long as the rapid;
- what is played leaves no more than the controller's own rapid;
- and is nowhere farther than `TOLERANCE` from the profile that was reported, where one was.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.units import MM_PER_INCH, SECONDS_PER_MINUTE
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.own_rapids import conventional_counts, limits_of, rapid_limits
from gcodejerk.verification.physics.points import Array, Index, Paths
from gcodejerk.verification.physics.residual import leaves_more

Rows = NDArray[np.bool_]
Reported = Mapping[int, Array]
"""Line of a rapid to rows of duration [s] and jerk [mm/s^3] of its profile."""

LEAST_EARLY, EARLY, SLOWLY = 1e-12, 2.1e-6, 1e-4
"""By how much a block has to end in front of a period: at least, at most, and where it is slower
than `SLOW`, since the rest of the period is run at most at the speed of the next one. [s]"""
SLOW = 1.0
"""[mm/s]"""
SHORTEST, ENDS = 2, 3
"""Periods of a block, and of the first and the last one, at least."""
LONGEST, FEWEST = 0.01, 5
"""A longer block is no longer blended as the others: in seconds, or in periods if that is more."""
OVER = 1.05
"""MAX_ACCELERATION over limit.acceleration."""
STEP = 1e-6
"""Of the positions, in the program's unit of mm; in inches they have one decimal more."""
LEAD, LEAD_TIME = 1e-5, (0.009, 0.011)
"""How far what leads in may move, and how long its slow block may last. [mm], [s]"""
NOTHING = 1.02e-8 * MM_PER_INCH
"""A motion that is no longer than 1e-8 machine units, inches perhaps, is none: where a G0 is left
out so, the control rounds the corner at an end of the stream, and the queue runs dry. [mm]"""
CREEP = 0.02
"""Speed at the last period, at most. [mm/s]"""
TOLERANCE = 0.01
"""[mm]"""
RELATIVE = 1e-6
FEED_DIGIT = 1e-9
"""More than the digits of F that keep successive ones apart. [units/min]"""


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """What the F words of streams make of their points; rows are those of the paths.

    Attributes
    ----------
    paths : Paths
        The streams.
    point, first, tail : ndarray of bool, shape (rows,)
        A block ends here; it is the first of its stream, or its tail.
    length, feed : ndarray, shape (rows,)
        Of the block, and its F. [mm], [mm/s]
    before, after : ndarray, shape (rows,)
        Speed at its two ends. [mm/s]
    time : ndarray, shape (rows,)
        When it ends, since the first block began. [s]
    """

    paths: Paths
    point: Rows
    first: Rows
    tail: Rows
    length: Array
    feed: Array
    before: Array
    after: Array
    time: Array

    @classmethod
    def of(cls, paths: Paths) -> _Motion:
        """Run the blocks."""
        owner, rows = paths.owner, len(paths.position)
        row = np.arange(rows)
        begin = paths.begin + 1 + paths.lead
        end = paths.end - 2
        point = (row >= begin[owner]) & (row <= end[owner])
        first, tail = np.zeros(rows, dtype=np.bool_), np.zeros(rows, dtype=np.bool_)
        first[begin], tail[end] = True, True
        delta = np.diff(paths.position, axis=0, prepend=paths.position[:1])
        length = np.where(point, np.sqrt((delta**2).sum(axis=1)), 0.0)
        feed = np.where(point, np.nan_to_num(paths.feed), 0.0)
        feed = feed * paths.unit[owner] / SECONDS_PER_MINUTE
        after = np.where(point & ~tail, np.minimum(feed, np.roll(feed, -1)), 0.0)
        after = np.where(tail, feed, after)
        before = np.where(first, 0.0, np.roll(after, 1))
        before = np.where(tail, feed, before)
        with np.errstate(divide="ignore", invalid="ignore"):
            lasts = np.where(point, 2.0 * length / (before + after), 0.0)
        # What has no speed never ends.
        lasts = np.where(np.isfinite(lasts), lasts, 1e9)
        # Stream by stream: a hair would be lost in the sum of all.
        time = np.zeros(rows)
        for a, b in zip(begin.tolist(), paths.end.tolist(), strict=True):
            time[a:b] = np.cumsum(lasts[a:b])
        return cls(paths, point, first, tail, length, feed, before, after, time)


def in_own_steps(paths: Paths) -> Paths:
    """The same, judged by the last decimal of what is written, whatever the resolutions say."""
    step = STEP * np.where(paths.unit == 1.0, 1.0, 0.1 * paths.unit)
    return replace(paths, step=np.repeat(step[:, np.newaxis], len(AXES), axis=1))


def check_aligned(paths: Paths, machine: Machine, found: Findings, reported: Reported) -> None:
    """Judge streams.

    Parameters
    ----------
    paths : Paths
        The streams, with what leads in as rows, the block's own end as the last, in their own
        steps.
    machine : Machine
        Its limits, modes, interval and controller options.
    found : Findings
        Takes what is wrong.
    reported : mapping
        Profiles that were reported, by the lines of the rapids.
    """
    motion = _Motion.of(paths)
    bad = np.zeros(len(paths.begin), dtype=np.bool_)
    for kind, rows, problem in _blocks(motion, machine):
        _complain(found, paths, kind, rows & ~bad[paths.owner], problem)
        bad[paths.owner[rows]] = True
    # What is not played as it is meant cannot be judged by what is played.
    good = np.flatnonzero(~bad)
    if len(good):
        _judge_played(_Motion.of(paths.take(good)), machine, found, reported)


def _blocks(motion: _Motion, machine: Machine) -> list[tuple[Kind, Rows, str]]:
    """Every block by itself, and beside its neighbours."""
    paths, interval = motion.paths, machine.interval
    point, first, tail = motion.point, motion.first, motion.tail
    inner = point & ~tail
    count = np.rint(motion.time / interval)
    early = count * interval - motion.time
    most_early = np.where(motion.after < SLOW, SLOWLY, EARLY)
    off = inner & ((early < LEAST_EARLY) | (early > most_early))
    lasts = np.where(first, count, count - np.roll(count, 1))
    last = np.roll(tail, -1)
    short = inner & (lasts < np.where(first | last, ENDS, SHORTEST))
    most_long = max(LONGEST, FEWEST * interval)
    long = inner & (lasts * interval > most_long * (1.0 + RELATIVE))
    larger = np.maximum(motion.before, motion.after)
    digit = FEED_DIGIT * paths.unit[paths.owner] / SECONDS_PER_MINUTE
    other = inner & (np.abs(motion.feed - larger) > digit)
    equal = point & ~first & (motion.feed == np.roll(motion.feed, 1))
    moved = np.sqrt((np.diff(paths.position, axis=0, prepend=paths.position[:1]) ** 2).sum(axis=1))
    moved[paths.begin] = np.inf
    lead = paths.position[np.where(first, np.arange(len(first)) - 1, 0)] - paths.start[paths.owner]
    far = first & (np.abs(lead).max(axis=1) > LEAD)
    with np.errstate(divide="ignore", invalid="ignore"):
        slow = np.abs(np.diff(paths.position, axis=0, prepend=0.0)).max(axis=1) / (
            paths.feed * paths.unit[paths.owner] / SECONDS_PER_MINUTE
        )
    leads = ~point & np.isfinite(paths.feed)
    hasty = leads & ~((slow >= LEAD_TIME[0]) & (slow <= LEAD_TIME[1]))
    creeps = np.where(tail, motion.length / np.maximum(motion.feed, 1e-9), 0.0)
    usual, most = conventional_counts(paths, machine)
    lasting = np.zeros(len(first))
    lasting[last] = count[last]
    wrong = last & (lasting > most[paths.owner])
    if machine.design.profile != "shortest":
        wrong |= last & (lasting < usual[paths.owner])
    return [
        (Kind.FEED, point & ~(motion.feed > 0.0), "F must be above zero"),
        (Kind.FEED, other, "F is not the larger of the speeds at the ends of its block"),
        (Kind.FEED, equal, "two successive F are equal: the control may join the blocks"),
        (Kind.FEED, last & (motion.after > CREEP), "the tail is too fast to end in one period"),
        (Kind.FEED, hasty, "what leads into the points does not last its ten milliseconds"),
        (Kind.FORM, moved <= NOTHING, "a motion so short is none where the INI is in inches"),
        (Kind.FORM, far, "what leads into the points moves the axis too far"),
        (Kind.FEED, off, "with these F words the block does not end on a servo period"),
        (Kind.TIME, short, "block is too short for the control"),
        (Kind.TIME, long, "block is too long to be blended"),
        (Kind.TIME, tail & (creeps > LONGEST), "the tail takes too long"),
        (Kind.TIME, wrong, "stream does not last as long as the rapid may"),
        *_accelerations(motion, machine, lasts * interval),
    ]


def _accelerations(motion: _Motion, machine: Machine, lasts: Array) -> list[tuple[Kind, Rows, str]]:
    """Accelerations of the blocks, axis by axis, within what MAX_ACCELERATION has to be."""
    paths, inner = motion.paths, motion.point & ~motion.tail
    delta = np.diff(paths.position, axis=0, prepend=paths.position[:1])
    options = machine.controller_options
    out = []
    h = np.where(inner & (lasts > 0.0), lasts, 1.0)
    rise = np.where(inner, (motion.after - motion.before) / h, 0.0)
    step = 2.0 * paths.step[paths.owner, 0] / h**2
    limits = limits_of(paths.displacement, machine)
    for axis in machine.axes:
        a = AXES.index(axis.name)
        share = np.abs(delta[:, a]) / np.where(motion.length > 0.0, motion.length, 1.0)
        most = options.max_acceleration.get(axis.name, OVER * axis.limit.acceleration)
        each = np.minimum(most, OVER * limits[1, paths.owner, a])
        fast = inner & (np.abs(rise) * share > each * (1.0 + RELATIVE) + step)
        least = each[fast].min(initial=most)
        problem = f"{axis.name} passes {least:g} mm/s^2, the least that MAX_ACCELERATION may be"
        out.append((Kind.ACCELERATION, fast, problem))
    return out


def _judge_played(motion: _Motion, machine: Machine, found: Findings, reported: Reported) -> None:
    """Judge what the drives get."""
    paths = motion.paths
    played, moment = _played(motion, machine.interval)
    limits = limits_of(paths.displacement, machine)
    for axis in machine.axes:
        a = AXES.index(axis.name)
        if not (paths.displacement[:, a] != 0.0).any():
            continue
        speed = np.abs(np.diff(played.position[:, a], prepend=0.0)) / machine.interval
        speed[played.begin] = 0.0
        step = 2.0 * paths.step[played.owner, a] / machine.interval
        most = limits[0, played.owner, a]
        fast = speed > most * (1.0 + RELATIVE) + step
        least = most[fast].min(initial=axis.limit.velocity)
        problem = f"{axis.name} passes its limit of {least:g} mm/s"
        _complain(found, played, Kind.VELOCITY, fast, problem, of_points=False)
    off = _off_profile(played, moment, machine.interval, reported)
    problem = f"played more than {TOLERANCE:g} mm off the profile that was reported"
    _complain(found, played, Kind.PROFILE, off, problem, of_points=False)
    excess = leaves_more(played, machine, moment, rapid_limits(paths, machine))
    for k, left, allowed in zip(*excess.columns(), strict=True):
        # A copy of today's rapid, asked for by its name: its blocks end on servo periods, where
        # the rapid's own segments do not, so that it is as good as that only where both settle.
        if machine.design.profile == "conventional" and left <= machine.design.tolerance:
            continue
        problem = (
            f"leaves {1e3 * left:.3g} um of vibration, at most {1e3 * allowed:.3g} um are "
            "left by the controller's own rapid"
        )
        found.add(Kind.RESIDUAL, int(paths.line[k]), int(paths.original_line[k]), problem)


def _played(motion: _Motion, interval: float) -> tuple[Paths, Index]:
    """Positions in every servo period behind the filter, as paths, and their moments."""
    paths = motion.paths
    ends = paths.end - 2
    periods = np.ceil(motion.time[ends] / interval - RELATIVE).astype(np.int64)
    # One more in front and two behind: there the filter looks beyond the motion.
    size = periods + 4
    end = np.cumsum(size)
    begin = end - size
    owner = np.repeat(np.arange(len(size)), size)
    moment = np.arange(len(owner)) - begin[owner] - 1
    t = moment * interval
    # All streams on one clock, on which none meets another.
    span = float(motion.time[ends].max(initial=0.0)) + 10.0 * interval
    known = np.flatnonzero(motion.point)
    clock = paths.owner[known] * 2.0 * span + motion.time[known]
    at = np.searchsorted(clock, owner * 2.0 * span + t, side="left")
    over = (at >= len(known)) | (paths.owner[known[np.minimum(at, len(known) - 1)]] != owner)
    row = known[np.minimum(at, len(known) - 1)]
    lasts = 2.0 * motion.length / np.maximum(motion.before + motion.after, 1e-300)
    tau = np.clip(t - (motion.time[row] - lasts[row]), 0.0, lasts[row])
    rise = (motion.after[row] - motion.before[row]) / lasts[row]
    way = (motion.before[row] + 0.5 * rise * tau) * tau
    share = way / np.maximum(motion.length[row], 1e-300)
    x = paths.position[row - 1]
    x = x + share[:, np.newaxis] * (paths.position[row] - x)
    x[over] = paths.position[paths.end - 1][owner[over]]
    before, behind = np.roll(x, 1, axis=0), np.roll(x, -1, axis=0)
    inner = np.ones(len(x), dtype=np.bool_)
    inner[begin], inner[end - 1] = False, False
    x = np.where(inner[:, np.newaxis], (before + 4.0 * x + behind) / 6.0, x)
    x[begin] = paths.start
    x[end - 1] = paths.position[paths.end - 1]
    played = replace(
        paths,
        begin=begin,
        end=end,
        position=x,
        feed=np.full(len(x), np.nan),
        lead=np.zeros(len(begin), dtype=np.int64),
    )
    return played, moment + 1


def _off_profile(played: Paths, moment: Index, interval: float, reported: Reported) -> Rows:
    """Periods in which a stream is too far from the profile that was reported."""
    wanted = np.full(len(played.position), np.nan)
    alike: dict[int, tuple[Array, list[int]]] = {}
    for k, line in enumerate(played.original_line.tolist()):
        segments = reported.get(line)
        if segments is not None:
            alike.setdefault(id(segments), (segments, []))[1].append(k)
    t = np.asarray((moment - 1) * interval, dtype=np.float64)
    for segments, streams in alike.values():
        rows = played.rows_of(np.array(streams))
        wanted[rows] = _way(t[rows], segments)
    owner = played.owner
    length = np.sqrt((played.displacement**2).sum(axis=1))
    moved = np.sqrt(((played.position - played.start[owner]) ** 2).sum(axis=1))
    off: Rows = np.abs(moved - np.minimum(wanted, length[owner])) > TOLERANCE
    return off


def _way(t: Array, segments: Array) -> Array:
    """Way along the path at some moments, of segments of constant jerk [mm]."""
    begins, states = [0.0], [(0.0, 0.0, 0.0)]
    for duration, jerk in segments.tolist():
        x, v, a = states[-1]
        x += (v + (a / 2.0 + jerk * duration / 6.0) * duration) * duration
        v += (a + jerk * duration / 2.0) * duration
        states.append((x, v, a + jerk * duration))
        begins.append(begins[-1] + duration)
    at = np.searchsorted(begins[:-1], t, side="right") - 1
    x, v, a = np.array(states)[at].T
    duration, jerk = segments[at].T
    tau = np.clip(t - np.array(begins)[at], 0.0, duration)
    way: Array = (x + (v + (a / 2.0 + jerk * tau / 6.0) * tau) * tau) * (at >= 0)
    return way


def _complain(
    found: Findings,
    paths: Paths,
    kind: Kind,
    rows: Rows,
    problem: str,
    *,
    of_points: bool = True,
) -> None:
    """Note a violation for every stream that has one, at the first row that does."""
    bad = np.flatnonzero(rows)
    owner = paths.owner[bad]
    for at in np.unique(owner, return_index=True)[1].tolist():
        k = int(owner[at])
        block = max(int(bad[at] - paths.begin[k]) - 1, 0) if of_points else 0
        found.add(kind, int(paths.line[k]) + block, int(paths.original_line[k]), problem)
