"""Streams as G1 blocks in the place of the rapid's block, spelled in the program's own dialect.

Blocks of 2 ms in per-minute feed and continuous path, F their mean speed (`feeds`), so that a
control that holds F over a block takes the time that it was planned for. How controls follow such
blocks was not measured: their emitters say so (`controls`). LinuxCNC has a form of its own
(`linuxcnc`).

A replaced block becomes, each line only where it is needed::

    (gcodejerk: G0 X10. Y5.)     names the original
    N120 G0 M8 (go)              what else the block says, byte for byte
    G94 G64                      modes of the stream that are not in force, or not stated
    G4 P0                        the feed before ends here: a stream begins at rest
    G1 X0.0012 Y0.0006 F38.4     the points
    G1 G61 X10. Y5. F1.2         the last with the block's own words, and the exact stop
    G0 F600.                     the modal values that the program relies on; of a G1 that
                                 counts as a rapid (`Rapids.fed`) F alone, for G1 is in force
    M0                           what the control runs after the motion

Rule: G94 stands in front of G4, which counts turns of the spindle in G95 on some controls, and ends
nowhere where it stands (Fanuc, parameter 3405#1; general knowledge that was not looked up).

Rule: the last point repeats the block's own words, so the end is exactly the programmed one,
whatever was rounded before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Controller, Options, axis_steps, step_sizes
from gcodejerk.emit.feeds import Feeds, mean_feeds
from gcodejerk.emit.frame import Spelled, frame_of, plain, writing_of
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.emit.raised import has_to_rise
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import FINE_DECIMALS
from gcodejerk.storage import made, windows
from gcodejerk.units import MM_PER_INCH, per_minute

BLOCK_TIME = 0.002
"""Duration of a block, measured as the best; whole intervals, at least one [s]."""
LINE_ENDS = (b"", b"\n", b"\r\n", b"\r")
"""By `Rapids.terminator`."""


class GcodeController(Controller):
    """Writes G1 blocks of 2 ms, F their mean speed; a control adds its name and its facts."""

    play = Play.HELD
    planner_limits: tuple[str, str] = ("", "")
    path_limits: str = ""
    """What bounds velocity and acceleration of G1 and G0 alike, of an axis and of the path, by
    their names; empty where nobody knows."""
    highest_feed: str = ""
    """What bounds G1 and not G0, by its name; empty where nothing does, or nobody knows."""

    @property
    def repeats(self) -> bool:  # type: ignore[override]
        """Unless somebody else's text says more, such as the line."""
        return type(self).render is GcodeController.render

    def stride(self, interval: float) -> int:
        """About 2 ms."""
        return max(1, round(BLOCK_TIME / interval))

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Steps in the program's own unit; increments are counted from the start."""
        doubles = writing_of(dialect).doubles
        mm, inch = (step_sizes(machine, unit, doubles) for unit in (False, True))
        step = np.broadcast_to(mm, rapids.start.shape)
        if rapids.inch.any():
            step = made(
                lambda part: np.where(rapids.inch[part, np.newaxis], inch, mm), rapids.start.shape
            )
        return NumberFormat(rapids.start, step, origins(rapids), finer=doubles)

    def feeds(self, batch: Batch, rapids: Rapids, digits: int) -> Feeds:
        """F of every block of a batch, of no more digits than the control reads."""
        return mean_feeds(batch, rapids, digits)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """What a user of these streams has to know."""
        if not plans.planned.any():
            return []
        unmeasured = [
            f"streams in this form were not measured on {self.name}: {form.note}"
            for form in self.forms
            if (form.name, form.confidence) == ("stream", "unverified")
        ]
        if self.highest_feed:
            unmeasured.append(_fastest(self.highest_feed, rapids, plans))
        return unmeasured + has_to_rise(plans, self.planner_limits, self.path_limits, self.name)

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """Text of each move."""
        moves = batch.moves
        line_ends, last_ends = line_ends_of(rapids, moves, newline)
        dialect = options.dialect
        writing = writing_of(dialect)
        feeds = self.feeds(batch, rapids, writing.digits)
        points = self._points(batch, rapids, line_ends, feeds, writing.doubles)
        spelled, out = Spelled(rapids, dialect), []
        for row, move in enumerate(moves):
            frame = frame_of(spelled, int(move), blocks[row])
            last = frame.last_point(points[row].before_end) + b" F" + plain(feeds.of_end(row))
            follows = follows_stream(batch.plans, rapids, int(move))
            lines = [
                *frame.head(options.comments),
                *frame.modes(),
                *frame.standstill(follows),
                points[row].text,
                last,
                b" ".join([*([] if frame.fed else [b"G0"]), *frame.restored()]),
                *frame.after(),
            ]
            out.append(line_ends[row].join(line for line in lines if line) + last_ends[row])
        return out

    def _points(
        self,
        batch: Batch,
        rapids: Rapids,
        line_ends: Sequence[bytes],
        feeds: Feeds,
        doubles: bool,
    ) -> list[_Points]:
        """The points of every move but its last, formatted for all moves of one kind together."""
        moving = batch.plans.displacement[batch.moves] != 0.0
        kinds: dict[_Kind, list[int]] = {}
        for row, move in enumerate(batch.moves):
            kind = _Kind(
                axes=tuple(np.nonzero(moving[row])[0].tolist()),
                fine=tuple(np.nonzero(batch.fine[row])[0].tolist()),
                feed_decimals=int(feeds.decimals[row]),
                inch=bool(rapids.inch[move]),
                incremental=bool(rapids.incremental[move]),
                diameter=bool(rapids.diameter[move]),
                line_end=line_ends[row],
            )
            kinds.setdefault(kind, []).append(row)
        out: list[_Points] = [_Points(b"", {})] * len(batch)
        for kind, rows in kinds.items():
            made = _format_kind(batch, np.array(rows), kind, feeds, doubles)
            for row, points in zip(rows, made, strict=True):
                out[row] = points
        return out


def _fastest(bound: str, rapids: Rapids, plans: Plans) -> str:
    """How fast the blocks become, about, in the unit of the fastest."""
    most, inch, turns = 0.0, False, 0.0
    peak = plans.profiles.peak_velocity
    linear = [k for k, axis in enumerate(AXES) if axis not in "ABC"]
    for part in windows(len(plans.move)):
        square = (plans.share[part][:, linear] ** 2).sum(axis=1) * peak[part] ** 2
        first = int(plans.move[part][0])
        # Axes that run on their own add up to their path at most so.
        speed = np.sqrt(np.bincount(plans.move[part] - first, square))
        at = int(np.argmax(speed))
        if speed[at] > most:
            most, inch = float(speed[at]), bool(rapids.inch[first + at])
        turned = np.where(square == 0.0, np.linalg.norm(plans.share[part], axis=1), 0.0)
        turns = max(turns, float((turned * peak[part]).max()))
    unit, name = (MM_PER_INCH, "in/min") if inch else (1.0, "mm/min")
    if not most:
        most, unit, name = turns, 1.0, "deg/min"
    return (
        f"blocks of the streams reach F{per_minute(most) / unit:.0f} ({name}): {bound} "
        "has to allow that for G1, or the control slows them down or stops; where it is lower, "
        "state it as limit.velocity of the axes"
    )


def origins(rapids: Rapids) -> NDArray[np.float64]:
    """Where points are counted from: 0, or where increments begin, shape (n, 9) [mm] or [deg]."""
    if not rapids.incremental.any():
        return np.broadcast_to(0.0, rapids.start.shape)

    def origin(part: slice) -> NDArray[np.float64]:
        return np.where(rapids.incremental[part, np.newaxis], rapids.start[part], 0.0)

    return made(origin, rapids.start.shape)


def line_ends_of(
    rapids: Rapids, moves: NDArray[np.int64], newline: bytes
) -> tuple[list[bytes], list[bytes]]:
    """What the lines of each stream end with, and its last line."""
    last = [LINE_ENDS[t] for t in rapids.terminator[moves]]
    # A lone CR ends no line for LinuxCNC; it can stand at the end of the file.
    return [newline if end in (b"", b"\r") else end for end in last], last


@dataclass(frozen=True, slots=True)
class _Kind:
    """What moves have in common whose points can be formatted together."""

    axes: tuple[int, ...]
    fine: tuple[int, ...]
    feed_decimals: int
    inch: bool
    incremental: bool
    diameter: bool
    line_end: bytes


def _format_kind(
    batch: Batch, rows: NDArray[np.int64], kind: _Kind, feeds: Feeds, doubles: bool
) -> list[_Points]:
    """Points of rows of one kind; the last point of each is left to its block's own words."""
    whole_step, decimals = axis_steps(batch.plans.machine, kind.inch, doubles)
    knots = batch.grid.knots[rows]
    inner = (knots > 0) & (knots < batch.grid.counts[rows, np.newaxis])
    counts = np.count_nonzero(inner, axis=1)
    columns: list[Column] = []
    reached: dict[int, tuple[NDArray[np.int64], int]] = {}
    for axis in kind.axes:
        scale = int(whole_step[axis]) * (2 if kind.diameter and AXES[axis] == "X" else 1)
        places = int(decimals[axis]) + (FINE_DECIMALS if axis in kind.fine else 0)
        if not places:  # a decimal point, always: X100 is 0.1 mm for some controls
            scale, places = scale * 10, 1
        values = batch.whole[axis][rows] * scale
        reached[axis] = (values[:, -2], places)
        if kind.incremental:
            values = np.diff(np.where(knots > 0, values, 0), axis=1, prepend=0)
        prefix = b" " if columns else b"G1 "
        columns.append(Column(prefix + AXES[axis].encode(), values[inner], places))
    columns.append(Column(b" F", feeds.whole[rows][inner], kind.feed_decimals, feeds.digits))
    text, ends = format_lines(columns, kind.line_end)
    at = np.concatenate([[0], ends])[np.concatenate([[0], np.cumsum(counts)])]
    return [
        _Points(
            text[at[k] : at[k + 1]].removesuffix(kind.line_end),
            {
                axis: Decimal(int(value[k])).scaleb(-places) if counts[k] else Decimal(0)
                for axis, (value, places) in reached.items()
            },
        )
        for k in range(len(rows))
    ]


@dataclass(frozen=True, slots=True)
class _Points:
    """The text of a move's points but the last, and how far each axis is then from the origin."""

    text: bytes
    before_end: dict[int, Decimal]


def follows_stream(plans: Plans, rapids: Rapids, move: int) -> bool:
    """Whether the block directly before is a stream too: the machine then rests."""
    before = move - 1
    return bool(
        before >= 0
        and plans.planned[before]
        and rapids.line[before] + 1 == rapids.line[move]
        and not rapids.entered[move]
    )
