"""The points of many streams as columns, and where they lie.

This module owns positions: text to numbers, the exact ends, the straight line, the way forwards.

Rule: numbers that must be exact are compared as decimals, as written; everything else as float64
in mm, with the written step as the only tolerance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Rapids, parse_block
from gcodejerk.units import MM_PER_INCH
from gcodejerk.verification.bytes.form import Stream
from gcodejerk.verification.findings import Findings, Kind

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STANDSTILL = 1e-9
"""An axis that moves less does not move. [mm] or [deg]"""
TINY = 1e-9
"""Rounding of float64 in positions. [mm] or [deg]"""
FINEST = 1e-3
"""An axis that moves a few steps may be written this much finer. [steps]"""
SUM_SCALE = 1e12
"""Increments are summed in units of their twelfth decimal: none is written with more."""
LARGEST_SUM = 4e18
"""In these units: an increment of 4 km is as wrong as any longer one."""
SUMMED = 2e-11
"""What sums of float64 are certain to. [mm] or [deg]"""
_NUMBERS_ONLY = bytes(c if c in b"0123456789.+-" else 32 for c in range(256))
LINEAR = np.array([axis not in "ABC" for axis in AXES])


@dataclass(frozen=True, slots=True, eq=False)
class Paths:
    """Streams as points; row begin[k] is the start of stream k, row end[k] - 1 its last point."""

    rapid: Index
    """Index into the rapids, of each stream."""
    original_line: Index
    line: Index
    """Line of each stream's first point, or of what leads into it."""
    begin: Index
    end: Index
    position: Array
    """Shape (rows, 9). [mm] or [deg]; 0 where an axis is not named"""
    feed: Array
    """F of the block that ends in the row, NaN at starts. [program units/min]"""
    start: Array
    displacement: Array
    """Shape (k, 9); 0 for an axis that does not move."""
    unit: Array
    """mm per unit of length."""
    speed: Array
    """What the controller's own rapid keeps to; NaN where only the axes limit it. [mm/s]"""
    step: Array
    """Smallest step that is written of each axis, shape (k, 9). [mm] or [deg]"""
    lone: NDArray[np.bool_]
    """As in `nc.Rapids`."""
    lead: Index
    """Rows behind the start that come before the first point, of each stream."""
    digits: int = 15
    """Most digits of F that the control reads."""

    @property
    def count(self) -> Index:
        """Blocks of each stream."""
        return self.end - self.begin - 1

    def rows_of(self, streams: Index) -> Index:
        """Rows of some of the streams, one stream behind the other."""
        size = self.end[streams] - self.begin[streams]
        out: Index = np.repeat(self.begin[streams] - np.cumsum(size) + size, size)
        return out + np.arange(len(out))

    def take(self, streams: Index) -> Paths:
        """Some of the streams."""
        rows = self.rows_of(streams)
        size = self.end[streams] - self.begin[streams]
        end = np.cumsum(size)
        return Paths(
            rapid=self.rapid[streams],
            original_line=self.original_line[streams],
            line=self.line[streams],
            begin=end - size,
            end=end,
            position=self.position[rows],
            feed=self.feed[rows],
            start=self.start[streams],
            displacement=self.displacement[streams],
            unit=self.unit[streams],
            speed=self.speed[streams],
            step=self.step[streams],
            lone=self.lone[streams],
            lead=self.lead[streams],
            digits=self.digits,
        )

    @property
    def owner(self) -> Index:
        """Stream of each row."""
        return np.repeat(np.arange(len(self.begin)), self.end - self.begin)


class Reader:
    """Turns streams into paths, and says which do not end where they must."""

    def __init__(self, rapids: Rapids, machine: Machine, found: Findings, dialect: Dialect) -> None:
        self.rapids, self.machine, self.found = rapids, machine, found
        self.dialect = dialect
        self.known = sum(1 << AXES.index(name) for name in machine.axis_names)
        doubles = dialect.writing is None or dialect.writing.doubles
        self.step = resolutions(machine) if doubles else written_steps(machine, inch=False)
        self.inch_step = resolutions(machine) if doubles else written_steps(machine, inch=True)

    def check_end(self, stream: Stream, block: bytes) -> bool:
        """Compare axes and end with the words of the block, exactly; whether the axes are right."""
        if stream.own_end and not int(self.rapids.words[stream.rapid]) & ~self.known:
            return True
        incremental = bool(self.rapids.incremental[stream.rapid])
        reached = stream.sums() if incremental else stream.ends
        wanted = self._wanted(stream.rapid, block, reached)
        line = stream.line + len(stream.lead) + stream.text.count(b"\n") + len(stream.rest) - 1
        used = set(stream.letters).union(*stream.rest, *stream.lead) - {"F"}
        if not used <= set(wanted):
            axis = min(used - set(wanted))
            self._complain(
                Kind.AXES, stream, line, f"axis {axis} moves, which the block does not name"
            )
            return False
        if int(self.rapids.words[stream.rapid]) & ~self.known:
            self._complain(Kind.AXES, stream, line, "an axis that the machine does not have")
            return False
        for axis, number in wanted.items():
            if axis not in reached and self._stands(stream.rapid, axis):
                continue
            if reached.get(axis) != number:
                what = f"the increments of {axis} add up to" if incremental else f"{axis} ends at"
                problem = f"{what} {reached.get(axis, 'nothing')}, the block says {number}"
                self._complain(Kind.END, stream, line, problem)
        return True

    def _wanted(self, i: int, block: bytes, reached: Mapping[str, Decimal]) -> dict[str, Decimal]:
        """What the words of the block say of each axis, as written."""
        increments = bool(self.rapids.incremental[i])
        exact = self.dialect.arithmetic.exact
        wanted = {}
        for word in parse_block(block, self.dialect).words:
            axis = self.dialect.increments.get(word.letter)
            scaled = word.whole and word.value and self.dialect.whole_numbers == "machine"
            if axis is not None:
                wanted[axis] = self._programmed(i, axis, incremental=False)
            elif word.letter in AXES and word.value is None and exact:
                wanted[word.letter] = self._computed(i, word.letter, reached.get(word.letter))
            elif word.letter in AXES and (scaled or word.value is None or word.function):
                wanted[word.letter] = self._programmed(i, word.letter, increments)
            elif word.letter in AXES:
                text = b"".join(word.text[1:].split()).removeprefix(b"=")
                wanted[word.letter] = Decimal(text.decode())
        return wanted

    def _programmed(self, i: int, axis: str, incremental: bool) -> Decimal:
        """Where an axis ends, or how far it goes, in the program's unit, to six decimals."""
        value = self._way(i, axis, incremental) / self._unit(i, axis)
        return Decimal(repr(round(value, 6)))

    def _computed(self, i: int, axis: str, reached: Decimal | None) -> Decimal:
        """The same of a control that rounds no number: what is written, if it says just that."""
        incremental, unit = bool(self.rapids.incremental[i]), self._unit(i, axis)
        value = self._way(i, axis, incremental)
        if reached is not None:
            way = float(reached) * unit
            if way == value or (incremental and abs(way - value) < SUMMED):
                return reached
        return Decimal(repr(value / unit))

    def _way(self, i: int, axis: str, incremental: bool) -> float:
        """Where an axis ends, or how far it goes. [mm] or [deg]."""
        k = AXES.index(axis)
        return float(self.rapids.target[i, k] - (self.rapids.start[i, k] if incremental else 0.0))

    def _unit(self, i: int, axis: str) -> float:
        """What 1 means of an axis in the program. [mm] or [deg]."""
        unit = MM_PER_INCH if self.rapids.inch[i] and LINEAR[AXES.index(axis)] else 1.0
        return 0.5 * unit if self.rapids.diameter[i] and axis == "X" else unit

    def _stands(self, i: int, axis: str) -> bool:
        k = AXES.index(axis)
        return bool(self.rapids.start[i, k] == self.rapids.target[i, k])

    def _complain(self, kind: Kind, stream: Stream, line: int, problem: str) -> None:
        self.found.add(kind, line, stream.original_line, problem)

    def paths(self, streams: Sequence[Stream]) -> Paths:
        """Points of streams as columns."""
        rapids = self.rapids
        index = np.array([stream.rapid for stream in streams], dtype=np.int64)
        points = np.array([s.text.count(b"\n") for s in streams], dtype=np.int64)
        lead = np.array([len(s.lead) for s in streams], dtype=np.int64)
        counts = lead + points + np.array([len(s.rest) for s in streams], dtype=np.int64)
        end = np.cumsum(counts + 1)
        begin = end - counts - 1
        raw = np.full((int(end[-1]), len(AXES) + 1), np.nan)
        _put_points(raw, streams, begin + 1 + lead, points)
        _put_others(raw, streams, begin.tolist(), points.tolist())
        start = np.nan_to_num(rapids.start[index])
        displacement = rapids.target[index] - rapids.start[index]
        displacement = np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0)
        unit = np.where(rapids.inch[index], MM_PER_INCH, 1.0)
        scale = np.where(LINEAR, unit[:, np.newaxis], 1.0)
        scale[:, 0] *= np.where(rapids.diameter[index], 0.5, 1.0)
        owner = np.repeat(np.arange(len(index)), counts + 1)
        incremental = rapids.incremental[index]
        position = np.where(
            incremental[owner][:, np.newaxis],
            sum_up(raw[:, :-1], begin, end) * scale[owner] + start[owner],
            _carry_on(raw[:, :-1] * scale[owner], begin, start),
        )
        return Paths(
            rapid=index,
            original_line=np.array([s.original_line for s in streams], dtype=np.int64),
            line=np.array([s.line for s in streams], dtype=np.int64),
            begin=begin,
            end=end,
            position=position,
            feed=raw[:, -1],
            start=start,
            displacement=displacement,
            unit=unit,
            speed=rapids.speed[index],
            step=np.where(rapids.inch[index, np.newaxis], self.inch_step, self.step),
            lone=rapids.lone[index],
            lead=lead,
            digits=15 if self.dialect.writing is None else self.dialect.writing.digits,
        )


_COLUMN = {letter: column for column, letter in enumerate(AXES + "F")}


def _put_points(raw: Array, streams: Sequence[Stream], first: Index, count: Index) -> None:
    """Numbers of the points that are written alike, into the rows of each stream."""
    groups: dict[str, list[int]] = {}
    for k, stream in enumerate(streams):
        if stream.text:
            groups.setdefault(stream.letters, []).append(k)
    for letters, members in groups.items():
        # The code goes out first: "G1" holds a digit.
        text = b"".join([streams[k].text for k in members])
        text = text.replace(b"G01", b"").replace(b"G1", b"").translate(_NUMBERS_ONLY)
        numbers = np.fromstring(text.decode("ascii"), sep=" ").reshape(-1, len(letters) + 1)
        lines = count[members]
        rows = np.repeat(first[members] - np.cumsum(lines) + lines, lines) + np.arange(lines.sum())
        raw[rows[:, np.newaxis], [_COLUMN[letter] for letter in letters + "F"]] = numbers


def _put_others(
    raw: Array, streams: Sequence[Stream], begin: Sequence[int], count: Sequence[int]
) -> None:
    """The same of the points in front of these, and behind."""
    rows: list[int] = []
    columns: list[int] = []
    values: list[float] = []
    for stream, row, lines in zip(streams, begin, count, strict=True):
        for words in stream.lead:
            row += 1
            for letter, value in words.items():
                rows.append(row)
                columns.append(_COLUMN[letter])
                values.append(float(value))
        row += lines
        for words in stream.rest:
            row += 1
            for letter, value in words.items():
                rows.append(row)
                columns.append(_COLUMN[letter])
                values.append(float(value))
    raw[rows, columns] = values


def sum_up(increments: Array, begin: Index, end: Index) -> Array:
    """Distance from each stream's start, row by row.

    Summed as whole numbers of the tenth decimal: rounding must not grow with the number of points.
    """
    scaled = np.nan_to_num(increments) * SUM_SCALE
    whole = np.rint(np.clip(scaled, -LARGEST_SUM, LARGEST_SUM)).astype(np.int64)
    total = np.cumsum(whole, axis=0)
    return (total - np.repeat(total[begin], end - begin, axis=0)) / SUM_SCALE


def _carry_on(position: Array, begin: Index, start: Array) -> Array:
    """Keep an axis that a point does not name where it was."""
    position = position.copy()
    position[begin] = start
    rows = np.arange(len(position))[:, np.newaxis]
    known = np.maximum.accumulate(np.where(np.isnan(position), 0, rows), axis=0)
    out: Array = np.take_along_axis(position, known, axis=0)
    return out


def resolutions(machine: Machine) -> Array:
    """Smallest step [mm] or [deg] of each axis of `AXES`."""
    steps = {axis.name: axis.resolution for axis in machine.axes}
    return np.array([steps.get(axis, 0.0) for axis in AXES])


def written_steps(machine: Machine, inch: bool) -> Array:
    """The same where a control rounds each number to its least increment, a power of ten.

    It is the resolution where some decimals write that in the program's unit.
    """
    out = resolutions(machine)
    for k in np.flatnonzero(out):
        unit = MM_PER_INCH if inch and LINEAR[k] else 1.0
        written = Decimal(repr(round(float(out[k]), 9)))
        if unit != 1.0 or abs(float(written) - out[k]) > 1e-6 * out[k]:
            out[k] = unit * 10.0 ** np.ceil(np.log10(out[k] / unit) - 1e-9)
    return out


def check_rapids(paths: Paths, rapids: Rapids, machine: Machine, found: Findings) -> None:
    """Length and travel: whether these rapids may be replaced at all."""
    D = paths.displacement
    rotary = np.array(
        [machine.axis(a).rotary if a in machine.axis_names else a in "ABC" for a in AXES]
    )
    linear = np.sqrt((D[:, ~rotary] ** 2).sum(axis=1))
    length = np.where(linear > STANDSTILL, linear, np.sqrt((D[:, rotary] ** 2).sum(axis=1)))
    least = machine.design.minimum_length
    for k in np.flatnonzero(length < least * (1.0 - 1e-9)).tolist():
        _complain(found, Kind.LENGTH, paths, k, 0, f"rapid of {length[k]:g} mm, below {least:g} mm")
    for axis in machine.axes:
        if axis.travel is None:
            continue
        a = AXES.index(axis.name)
        low, high = axis.travel[0] - axis.resolution, axis.travel[1] + axis.resolution
        named = (rapids.words[paths.rapid] >> a & 1) != 0
        for column in (rapids.start, rapids.target):
            where = column[paths.rapid, a] + rapids.offset[paths.rapid, a]
            for k in np.flatnonzero(named & ((where < low) | (where > high))).tolist():
                problem = (
                    f"{axis.name} {where[k]:g} is outside {axis.travel[0]:g} to {axis.travel[1]:g}"
                )
                _complain(found, Kind.TRAVEL, paths, k, 0, problem)


def check_line(paths: Paths, machine: Machine, found: Findings) -> None:
    """Every point lies on the way from start to end, in order, within a step of the line."""
    owner = paths.owner
    step = paths.step[owner]
    D = paths.displacement[owner]
    moved = paths.position - paths.start[owner]
    still = (D == 0.0) & (np.abs(moved) > TINY)
    _report(found, Kind.AXES, paths, still.any(axis=1), "an axis moves that must stand still")
    direction = np.sign(D)
    slack = TINY + np.where(np.abs(D) < 2.0 * FINEST * step, FINEST * step, 0.0)
    back = np.zeros(len(D), dtype=np.bool_)
    forward = np.diff(moved, axis=0) * direction[1:]
    back[1:] = (forward < -slack[1:]).any(axis=1)
    back[paths.begin] = False
    ahead = moved * direction
    past = ((ahead > np.abs(D) + slack) | (ahead < -slack)).any(axis=1)
    _report(found, Kind.BACKWARDS, paths, back | past, "the point goes backwards or past the end")
    if machine.positioning != "linear":
        return
    with np.errstate(divide="ignore", invalid="ignore"):
        low = np.where(D != 0.0, (ahead - step - TINY) / np.abs(D), -np.inf).max(axis=1)
        high = np.where(D != 0.0, (ahead + step + TINY) / np.abs(D), np.inf).min(axis=1)
    _report(
        found, Kind.LINE, paths, low > high, "the point is more than a step off the straight line"
    )


def _complain(found: Findings, kind: Kind, paths: Paths, k: int, block: int, problem: str) -> None:
    """Note a violation in a block of stream k."""
    found.add(kind, int(paths.line[k]) + block, int(paths.original_line[k]), problem)


def _report(
    found: Findings, kind: Kind, paths: Paths, rows: NDArray[np.bool_], problem: str
) -> None:
    """Note a violation for every stream that has one, at the first row that does."""
    bad = np.flatnonzero(rows)
    owner = paths.owner[bad]
    for at in np.unique(owner, return_index=True)[1].tolist():
        k = int(owner[at])
        block = max(int(bad[at] - paths.begin[k]) - 1, 0)
        _complain(found, kind, paths, k, block, problem)
