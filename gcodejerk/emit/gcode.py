"""Streams as G1 blocks in the place of the rapid's block, spelled in the program's own dialect.

Blocks of 2 ms in per-minute feed and continuous path. What F means is the control's (`feeds`): for
one that holds F over a block its mean speed, so that it takes the time that it was planned for; for
LinuxCNC the larger of the speeds at its two ends (`linuxcnc`). How controls other than LinuxCNC
follow such blocks was not measured: their emitters say so (`controls`).

A replaced block becomes, each line only where it is needed, here in LinuxCNC's words::

    (gcodejerk: G0 X10. Y5.)     names the original
    N120 G0 M8 (go)              what else the block says, byte for byte
    G4 P0                        the feed before ends here: a stream begins at rest
    G94 G64                      modes of the stream that are not in force, or not stated
    G1 X0.0012 Y0.0006 F38.4     the points
    G1 G61 X10. Y5. F1.2         the last with the block's own words, and the exact stop
    G0 F600.                     the modal values that the program relies on
    M0                           what the control runs after the motion

Rule: the last point repeats the block's own words, so the end is exactly the programmed one,
whatever was rounded before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Controller, Options, axis_steps, step_sizes
from gcodejerk.emit.feeds import Feeds, mean_feeds
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Block, Dialect, Rapids, Word, parse_block
from gcodejerk.nc.dialects.dialect import Writing, code_name
from gcodejerk.nc.dialects.gcodes import G90
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import FINE_DECIMALS, Batch, NumberFormat
from gcodejerk.units import MM_PER_INCH

BLOCK_TIME = 0.002
"""Duration of a block, measured as the best; whole intervals, at least one [s]."""
COMMENT_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""
LINE_ENDS = (b"", b"\n", b"\r\n", b"\r")
"""By `Rapids.terminator`."""


class GcodeController(Controller):
    """Writes G1 blocks of 2 ms, F their mean speed; a control adds its name and its facts."""

    play = Play.HELD

    def stride(self, interval: float) -> int:
        """About 2 ms."""
        return max(1, round(BLOCK_TIME / interval))

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Steps in the program's own unit; increments are counted from the start."""
        doubles = writing_of(dialect).doubles
        mm, inch = (step_sizes(machine, unit, doubles) for unit in (False, True))
        step = np.where(rapids.inch[:, np.newaxis], inch, mm)
        origin = np.where(rapids.incremental[:, np.newaxis], rapids.start, 0.0)
        return NumberFormat(rapids.start, step, origin, finer=doubles)

    def feeds(self, batch: Batch, rapids: Rapids) -> Feeds:
        """F of every block of a batch."""
        return mean_feeds(batch, rapids)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """What a user of these streams has to know."""
        return [
            f"streams in this form were not measured on {self.name}: {form.note}"
            for form in self.forms
            if form.confidence == "unverified" and plans.planned.any()
        ]

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
        last_ends = [LINE_ENDS[t] for t in rapids.terminator[moves]]
        # A lone CR ends no line for LinuxCNC; it can stand at the end of the file.
        line_ends = [newline if end in (b"", b"\r") else end for end in last_ends]
        dialect = options.dialect
        parsed = [parse_block(block, dialect) for block in blocks]
        feeds = self.feeds(batch, rapids)
        points = self._points(batch, rapids, line_ends, feeds, writing_of(dialect).doubles)
        out = []
        for row, move in enumerate(moves):
            frame = Frame(rapids, int(move), parsed[row], blocks[row], dialect)
            last = frame.last_point(points[row].before_end, feeds.of_end(row))
            follows = _follows_stream(batch.plans, rapids, int(move))
            lines = [
                *frame.head(options.comments),
                *frame.setup(follows),
                points[row].text,
                last,
                *frame.tail(),
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
            made = _format_kind(batch, np.array(rows), kind, feeds.whole, doubles)
            for row, points in zip(rows, made, strict=True):
                out[row] = points
        return out


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
    batch: Batch, rows: NDArray[np.int64], kind: _Kind, feed: NDArray[np.int64], doubles: bool
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
    columns.append(Column(b" F", feed[rows][inner], kind.feed_decimals))
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


class Frame:
    """The lines around a move's points: what its block says besides, and what it relies on."""

    def __init__(
        self, rapids: Rapids, move: int, block: Block, text: bytes, dialect: Dialect
    ) -> None:
        self.rapids, self.move, self.block, self.text = rapids, move, block, text
        self.dialect, self.writing = dialect, writing_of(dialect)
        self.axis_words = [w for w in block.words if w.letter in AXES or w.letter in self.turned]
        after = dialect.after_m
        self.behind = [w for w in block.words if w.letter == "M" and w.value in after]
        """What the control runs when the motion has ended."""
        exact = None if dialect.exact_stop is None else dialect.exact_stop / 10
        self.exact = [w for w in block.words if w.letter == "G" and w.value == exact]
        """G9, which is about the end of the motion of its own block."""

    @property
    def turned(self) -> Mapping[str, str]:
        """Addresses of increments, with their axes."""
        return self.dialect.increments

    def head(self, comments: bool) -> list[bytes]:
        """A comment that names the block, and the block without its axis words."""
        out = [self._comment()] if comments else []
        rest, at = [], 0
        moved = [*self.axis_words, *self.behind, *self.exact]
        for word in sorted(moved, key=lambda w: w.begin):
            rest.append(self.text[at : word.begin])
            at = word.end
        rest.append(self.text[at:])
        others = [w for w in self.block.words if w not in moved]
        if self.block.comments or any(not (w.letter == "G" and w.value == 0.0) for w in others):
            out.append(b"".join(rest).rstrip(b" \t\r"))
        return out

    def _comment(self) -> bytes:
        """`(gcodejerk: ...)` with the words of the block, in at most COMMENT_LENGTH characters."""
        opens, closes = self.writing.comment
        words = b" ".join(b"".join(w.text.split()) for w in self.block.words)
        plain = bytes(c if 32 <= c < 127 and c not in b"()" else ord("?") for c in words)
        room = COMMENT_LENGTH - len(opens + b"gcodejerk: " + closes)
        if len(plain) > room:
            plain = plain[: room - 3] + b"..."
        return opens + b"gcodejerk: " + plain + closes

    def setup(self, follows: bool) -> list[bytes]:
        """An exact stop, unless the machine rests already, and the modes of the stream."""
        rapids, move, dialect = self.rapids, self.move, self.dialect
        stands = follows or rapids.path[move] in (61, 62)
        codes: list[int | None] = []
        if not rapids.distance_stated[move] and dialect.groups.get(G90) == "distance":
            codes.append(G90)
        if rapids.feed_mode[move] != 94 or not rapids.feed_mode_stated[move]:
            codes.append(dialect.feed_code(94))
        if rapids.path[move] in (61, 62):
            codes.append(dialect.path_code(64))
        words = b" ".join(code_name(code) for code in codes if code is not None)
        return ([] if stands else [self.writing.standstill]) + ([words] if words else [])

    def last_point(self, before_end: dict[int, Decimal], feed: Decimal) -> bytes:
        """The last point: the block's own words, or what is left of its increments."""
        words = [self._last_word(word, before_end) for word in self.axis_words]
        words.append(b"F" + _plain(feed))
        return b" ".join([b"G1", *self._ending(), *words])

    def rapid_end(self, before_end: dict[int, Decimal]) -> bytes:
        """The block's own axis words as a rapid, or what is left of its increments."""
        words = [self._last_word(word, before_end) for word in self.axis_words]
        return b" ".join([b"G0", *self._ending(), *words])

    def _ending(self) -> list[bytes]:
        """What lets the last point end in a standstill where the rapid did."""
        path, dialect = int(self.rapids.path[self.move]), self.dialect
        code = dialect.path_code(path) if path in (61, 62) else None
        if code is None and (self.exact or dialect.stops_after_rapid):
            code = dialect.exact_stop
        return [] if code is None else [code_name(code)]

    def _last_word(self, word: Word, before_end: dict[int, Decimal]) -> bytes:
        axis = self.turned.get(word.letter)
        if axis is not None:
            # The points are absolute: so is the end of an increment.
            return axis.encode() + _plain(programmed_end(self.rapids, self.move, axis, False))
        incremental = bool(self.rapids.incremental[self.move])
        # X=3 of Siemens is X3.
        text = b"".join(word.text[1:].split()).removeprefix(b"=")
        number = Decimal(text.decode())
        if word.whole and number and self.dialect.whole_numbers == "machine":
            number = programmed_end(self.rapids, self.move, word.letter, incremental)
            if not incremental:
                return word.letter.encode() + _plain(number)
        if not incremental:
            return word.letter.encode() + text.upper()
        left = number - before_end.get(AXES.index(word.letter), Decimal(0))
        return word.letter.encode() + _plain(left)

    def tail(self) -> list[bytes]:
        """Restore the modal values, then say what the block says when its motion has ended."""
        rapids, move, dialect = self.rapids, self.move, self.dialect
        words = [b"G0"]
        mode = int(rapids.feed_mode[move])
        code = dialect.feed_code(mode)
        if mode != 94 and code is not None:
            words.append(code_name(code))
        if mode != 93 and not np.isnan(rapids.feed[move]):
            feed = _plain(Decimal(repr(float(rapids.feed[move]))))
            words.append(b"F" + (feed.rstrip(b"0").rstrip(b".") if self._whole() else feed))
        behind = [b" ".join(b"".join(w.text.split()) for w in self.behind)] if self.behind else []
        return [b" ".join(words), *behind]

    def _whole(self) -> bool:
        """Whether F has to go without a decimal point, as it was written."""
        return bool(self.rapids.feed_whole[self.move])


def writing_of(dialect: Dialect) -> Writing:
    """How streams are spelled in a dialect.

    Raises
    ------
    EmitError
        No form is known.
    """
    if dialect.writing is None:
        raise EmitError(
            f"no form of a stream is known for the dialect {dialect.name}",
            "use --controller csv, which writes the streams as a table",
        )
    return dialect.writing


def programmed_end(rapids: Rapids, move: int, axis: str, incremental: bool) -> Decimal:
    """Where an axis ends, or how far it goes, as it is programmed, to six decimals.

    Parameters
    ----------
    rapids : Rapids
        The program's.
    move : int
        Which of them.
    axis : str
        Its letter.
    incremental : bool
        How far, instead of where.

    Returns
    -------
    Decimal
        In the program's unit; a diameter where the program has diameters.
    """
    k = AXES.index(axis)
    end = float(rapids.target[move, k]) - (float(rapids.start[move, k]) if incremental else 0.0)
    if rapids.inch[move] and axis not in "ABC":
        end /= MM_PER_INCH
    if rapids.diameter[move] and axis == "X":
        end *= 2.0
    return Decimal(repr(round(end, 6)))


def _plain(number: Decimal) -> bytes:
    """A number without exponent, with a decimal point, and never minus zero."""
    text = format(number if number else abs(number), "f")
    return (text if "." in text else text + ".").encode()


def _follows_stream(plans: Plans, rapids: Rapids, move: int) -> bool:
    """Whether the block directly before is a stream too: the machine then rests."""
    before = move - 1
    return bool(
        before >= 0 and plans.planned[before] and rapids.line[before] + 1 == rapids.line[move]
    )
