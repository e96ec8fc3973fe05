"""Controller `linuxcnc`: streams in the form that LinuxCNC plays as planned.

What the form has to be, and why, is said where its numbers are made (`planning.aligned`); this
module writes it. A replaced block becomes, each line only where it is needed::

    (gcodejerk: G0 X10. Y5.)     names the original
    N120 G0 M8 (go)              what else the block says, byte for byte
    G94 G64                      modes of the stream that are not in force, or not stated
    G0 X0.0000003                where something was waited for: ten milliseconds in which
    G1 X0.0000006 F0.0018        the queue of motions fills
    G0 X0.000001                 a change from G0 to G1 ends the motion before, and keeps the queue
    G1 X0.000102 Y0.000051 F38.40000001
    G0 G61 X10. Y5.              the block's own words, which are a step away; and the exact stop
    F600.                        the modal values that the program relies on
    M0                           what the control runs after the motion

Rule 1: F of a block is the larger of the speeds at its ends, since LinuxCNC ends a block with the
smaller of its own F and the next one's.
Rule 2: no two successive F are equal: under G64 P the naive CAM detector joins such blocks.

With `override_guard` all this stands in a branch of its own (`guard`).
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Controller, Form, Options
from gcodejerk.emit.frame import Frame, Spelled, frame_of
from gcodejerk.emit.gcode import line_ends_of, origins
from gcodejerk.emit.guard import guarded, in_structures
from gcodejerk.emit.linuxcnc_settings import LinuxcncSettings
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.emit.raised import NEAR, moving_axes
from gcodejerk.errors import EmitError
from gcodejerk.machine import LINUXCNC, STREAM_HEADROOM, Machine
from gcodejerk.nc import Dialect, Program, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.straight import LINEAR, leading_axis, outer_steps
from gcodejerk.units import MM_PER_INCH, per_minute

BLOCK_TIME = 0.002
"""Of a block where the machine is not slow; two servo periods at least. [s]"""
DECIMALS, INCH_DECIMALS = 6, 8
"""Of positions, whatever the resolution: LinuxCNC computes in doubles, and speeds follow from
lengths of blocks. Played: 6 decimals of mm are enough, 4 are not; of inches 7 are not always: the
tail of 2e-5 mm then turned off the line by 7 degrees, and LinuxCNC stopped in front of it."""
FEED_DECIMALS, INCH_FEED_DECIMALS = 11, 12
"""Of F."""
LEAD_TIME = 0.01
"""In which the queue of motions fills. [s]"""


class LinuxcncController(LinuxcncSettings, Controller):
    """Writes G1 blocks that end on servo periods, with fitted speeds."""

    name = "linuxcnc"
    play = Play.ALIGNED
    joins = False
    unblended = "ABCUVW"
    forms = (
        Form(
            "stream",
            "measured",
            "LinuxCNC 2.9: played within 0.01 mm, what is left within a hundredth of today's; "
            "needs ARC_BLEND_ENABLE = 1 and MAX_ACCELERATION 1.05 times the axis's "
            "limit.acceleration (more: state it in controller_options)",
        ),
        Form("parameters", "documented", "MAX_JERK of 2.10, MAX_ACCELERATION of 2.9: the INI file"),
    )

    @property
    def repeats(self) -> bool:  # type: ignore[override]
        """Unless somebody else's text says more, such as the line."""
        return type(self).render is LinuxcncController.render

    def stride(self, interval: float) -> int:
        """About 2 ms, and two periods at least."""
        return max(2, round(BLOCK_TIME / interval))

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Steps of the last decimal, in mm; increments are counted from the start."""
        _check_settings(machine)
        inch = MM_PER_INCH * 10.0**-INCH_DECIMALS
        shape = rapids.start.shape
        step = np.broadcast_to(10.0**-DECIMALS, shape)
        if rapids.inch.any():
            steps = np.where(rapids.inch, inch, 10.0**-DECIMALS)
            step = np.broadcast_to(steps[:, np.newaxis], shape)
        return NumberFormat(rapids.start, step, origins(rapids))

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """Text of each move."""
        ends, last_ends = line_ends_of(rapids, batch.moves, newline)
        feed = _feeds(batch, rapids)
        guard = batch.plans.machine.controller_options.override_guard
        out = []
        way = batch.plans.displacement[batch.moves]
        leading = leading_axis(way[:, : len(LINEAR)]).tolist()
        # Every row begins with zeros, the last of which is the start.
        starts = ((batch.grid.knots > 0).argmax(axis=1) - 1).tolist()
        outer = outer_steps(batch.number_format.step[:, 0]).tolist()
        every = [
            _Points(batch, rapids, row, feed[row], *more)
            for row, more in enumerate(zip(way, leading, starts, outer, strict=True))
        ]
        texts, spelled = _texts(every, ends), Spelled(rapids, options.dialect)
        for row, move in enumerate(batch.moves.tolist()):
            frame = frame_of(spelled, move, blocks[row])
            points = every[row]
            lines = [
                *frame.modes(),
                *points.lead(filled=bool(rapids.queued[move]) and not guard),
                texts[row],
                frame.last_point(points.reached(), b"G0"),
                *([b" ".join(words)] if (words := restored(frame)) else []),
            ]
            if guard:
                lines = guarded(int(rapids.line[move]), lines, frame.own_motion())
            lines = [*frame.head(options.comments), *lines, *frame.after()]
            out.append(ends[row].join(line for line in lines if line) + last_ends[row])
        return out

    def unguardable(
        self, program: Program, source: BinaryIO, machine: Machine, dialect: Dialect
    ) -> NDArray[np.bool_]:
        """Rapids within O-word structures, where the machine file wants a guard (`guard`)."""
        return in_structures(program, source, machine, dialect)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """Where the machine file contradicts how LinuxCNC moves; what the program leaves open."""
        notes = []
        if plans.machine.positioning != "linear":
            notes.append(
                "LinuxCNC itself moves G0 in a straight line, but the machine file says "
                "positioning: independent; rapids of several axes are left alone"
            )
        notes += _too_slow(plans)
        options = plans.machine.controller_options
        if options.version == "2.10" and options.planner_type is None:
            notes.append(
                "LinuxCNC 2.10 plays streams as planned with [TRAJ] PLANNER_TYPE = 0, its default, "
                "only; nobody has played them on that version"
            )
        open_mode = plans.planned & (rapids.path == 0)
        if open_mode.any():
            line = int(rapids.line[np.argmax(open_mode)])
            notes.append(
                f"line {line}: no G61 or G64 before this rapid: streams rely on G64, in which "
                "LinuxCNC usually starts; state it in the program, or in the machine file's "
                "program.startup"
            )
        return notes


def restored(frame: Frame) -> list[bytes]:
    """What restores the modes behind the G0 to the end; a G1 of no length moves nothing."""
    return [*([b"G1"] if frame.fed else []), *frame.restored()]


def _too_slow(plans: Plans) -> list[str]:
    """What the INI file has to allow before streams run, where today's rapids have less."""
    raised = []
    for axis in moving_axes(plans):
        stated = plans.machine.controller_options.max_acceleration
        today, needed = axis.rapid.acceleration, STREAM_HEADROOM * axis.limit.acceleration
        today = stated.get(axis.name, today)
        if axis.planner == LINUXCNC and today < needed * NEAR:
            raised.append(f"{axis.name} from {today:g} to {needed:g}")
    if not raised:
        return []
    return [
        f"before this program runs, raise MAX_ACCELERATION of {', '.join(raised)} (1.05 times "
        "limit.acceleration), or LinuxCNC plays the streams slower; rapids that were left alone "
        "then use it, too"
    ]


def _check_settings(machine: Machine) -> None:
    """Refuse settings of the control under which streams are not played as planned.

    Raises
    ------
    EmitError
        The planner stops in every block, or the motion runs at another interval.
    """
    options = machine.controller_options
    if options.planner_type == 1:
        raise EmitError(
            "controller_options.planner_type is 1, expected 0: LinuxCNC's S-curve planner ends "
            "every block of a stream at acceleration 0, up to a second late",
            "set [TRAJ] PLANNER_TYPE = 0 in the INI file while streams run",
        )
    period = options.servo_period
    if period is not None and abs(period - machine.interval) > 1e-6 * machine.interval:
        raise EmitError(
            f"interval is {machine.interval:g} s, but controller_options.servo_period is "
            f"{period:g}: blocks have to end on the servo periods",
            f"say interval: {period:g}",
        )


def _feeds(batch: Batch, rapids: Rapids) -> NDArray[np.int64]:
    """F of the block that ends at each knot, in whole units of its last decimal, shape (b, k)."""
    assert batch.path_speed is not None
    speed, knots = batch.path_speed, batch.grid.knots
    inch = rapids.inch[batch.moves]
    unit = np.where(inch, MM_PER_INCH, 1.0)
    decimals = np.where(inch, INCH_FEED_DECIMALS, FEED_DECIMALS)
    ends = np.maximum(speed, np.concatenate([speed[:, :1], speed[:, :-1]], axis=1))
    scale = per_minute(1.0) * 10.0**decimals / unit
    feed: NDArray[np.int64] = np.rint(ends * scale[:, np.newaxis]).astype(np.int64)
    # Above 1 m/s the last decimal is less than a double's last bit, once F is a speed.
    bit = np.spacing(ends) * scale[:, np.newaxis]
    apart = np.where(bit > 1.0, np.ceil(3.0 * bit), 1.0).astype(np.int64)
    for k in range(1, feed.shape[1]):
        near = np.abs(feed[:, k] - feed[:, k - 1]) < apart[:, k]
        equal = (knots[:, k - 1] > 0) & near
        feed[:, k] = np.where(equal, feed[:, k - 1] + apart[:, k], feed[:, k])
    return feed


class _Points:
    """The points of one move as text."""

    def __init__(
        self,
        batch: Batch,
        rapids: Rapids,
        row: int,
        feed: NDArray[np.int64],
        way: NDArray[np.float64],
        leading: int,
        first: int,
        outer: int,
    ) -> None:
        move = batch.moves[row]
        self.inch = bool(rapids.inch[move])
        self.incremental = bool(rapids.incremental[move])
        self.decimals = INCH_DECIMALS if self.inch else DECIMALS
        self.axes = way.nonzero()[0].tolist()
        self.leading = leading
        self.outer = outer
        self.sign = 1 if way[leading] > 0.0 else -1
        diameter = bool(rapids.diameter[move])
        scale = {a: 2 if diameter and AXES[a] == "X" else 1 for a in self.axes}
        self.whole = {a: batch.whole[a][row, first:] * scale[a] for a in self.axes}
        self.begin = outer * scale[self.leading]
        """How far the first point is from the start, in steps."""
        self.feed = feed[first + 1 :]

    def lead(self, filled: bool) -> list[bytes]:
        """The tiny G0 in front of the points; a slow block in front of it where nothing queues."""
        finer = self.decimals + 1
        end = int(self.whole[self.leading][0]) * 10
        way = 10 * self.sign * self.begin
        if self.incremental:
            # Increments are counted from the start, which the first of them leaves.
            end = way
        at = [end] if filled else [end - 7 * way // 10, end - 4 * way // 10, end]
        if self.incremental:
            at = np.diff([0, *at]).tolist()
        # F is about the way of the axis, also where the program gives diameters.
        feed = per_minute(0.3 * self.outer * 10.0**-self.decimals / LEAD_TIME)
        words = [
            AXES[self.leading].encode() + format(Decimal(value).scaleb(-finer), "f").encode()
            for value in at
        ]
        if filled:
            return [b"G0 " + words[0]]
        return [b"G0 " + words[0], b"G1 " + words[1] + b" F%.9f" % feed, b"G0 " + words[2]]

    def columns(self) -> list[NDArray[np.int64]]:
        """The numbers of the G1 blocks: each axis, and F."""
        numbers = [self.whole[axis] for axis in self.axes]
        ways = [np.diff(each) if self.incremental else each[1:] for each in numbers]
        return [*ways, self.feed]

    def reached(self) -> dict[int, Decimal]:
        """How far the increments of all points lead, in the program's unit."""
        return {a: Decimal(int(v[-1])).scaleb(-self.decimals) for a, v in self.whole.items()}


def _texts(points: Sequence[_Points], ends: Sequence[bytes]) -> list[bytes]:
    """The G1 blocks of many moves; those that are spelled alike are made together."""
    alike: dict[tuple[tuple[int, ...], bool, bytes], list[int]] = {}
    for row, (one, end) in enumerate(zip(points, ends, strict=True)):
        alike.setdefault((tuple(one.axes), one.inch, end), []).append(row)
    out = [b""] * len(points)
    for (axes, inch, end), rows in alike.items():
        places = [INCH_DECIMALS if inch else DECIMALS] * len(axes)
        places.append(INCH_FEED_DECIMALS if inch else FEED_DECIMALS)
        prefixes = [b"G1 " + AXES[axes[0]].encode(), *(b" " + AXES[a].encode() for a in axes[1:])]
        each = [points[row].columns() for row in rows]
        words = zip([*prefixes, b" F"], zip(*each, strict=True), places, strict=True)
        columns = [Column(prefix, np.concatenate(parts), n) for prefix, parts, n in words]
        text, last = format_lines(columns, end)
        count = np.cumsum([len(columns[-1]) for columns in each])
        at = [0, *last[count - 1].tolist()]
        for row, begin, behind in zip(rows, at, at[1:], strict=False):
            out[row] = text[begin:behind].removesuffix(end)
    return out
