"""The controller `csv`: a table of points, judged like the streams in a program.

One row per interval: line of the rapid, time since its start, position of every axis in mm. Rows
of a rapid stand together, rapids in the order of the program.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import CERTAIN, Rapids
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.points import STANDSTILL, Array, Paths, resolutions

HEAD = 64
"""Bytes that hold the head of a table."""
PIECE = 1 << 20
ROWS = 512
"""Rows in one match: a repeat remembers every turn that it could still take back."""
EXACT = 1e-11
"""A position in mm written in full. [mm]"""
_NUMBER = rb"-?(?:[0-9]{1,9}(?:\.[0-9]{0,250})?|\.[0-9]{1,250})"
_HEADER = re.compile(rb"block,t(?:,[A-Z])+\r?\n")


def is_table(file: BinaryIO) -> bool:
    r"""Whether a file begins as a table of points does. The file is left where it was.

    Examples
    --------
    >>> import io
    >>> is_table(io.BytesIO(b"block,t,X,Z\n")), is_table(io.BytesIO(b"G0 X1\n"))
    (True, False)
    """
    at = file.tell()
    head = file.read(HEAD)
    file.seek(at)
    return _HEADER.match(head) is not None


class TableReader:
    """Reads the table rapid by rapid."""

    def __init__(self, table: BinaryIO, rapids: Rapids, machine: Machine, found: Findings) -> None:
        self.table, self.rapids, self.machine, self.found = table, rapids, machine, found
        self.columns = [AXES.index(axis) for axis in machine.axis_names]
        self.known = sum(1 << column for column in self.columns)
        value = rb",(?:" + _NUMBER + rb"|nan)"
        self.row = re.compile(
            rb"(?:[0-9]{1,12}," + _NUMBER + value * len(self.columns) + rb"\r?\n){1,%d}" % ROWS
        )
        self.line = 1
        """Of the next row, in the table."""
        self.at = 0
        """Rapids before this one are done."""
        self.replaced: list[int] = []
        """Indices of the rapids that have rows."""

    def paths(self) -> Iterator[Paths]:
        """Read the table, many rapids at a time."""
        header = self.table.readline()
        wanted = ",".join(["block", "t", *self.machine.axis_names]).encode()
        if header.rstrip(b"\r\n") != wanted:
            self.found.add(Kind.TABLE, 1, None, f"header is not '{wanted.decode()}'")
            return
        self.line = 2
        kept = np.zeros((0, 2 + len(self.columns)))
        while text := self._piece():
            end = 0
            while match := self.row.match(text, end):
                end = match.end()
            if end < len(text):
                line = self.line + len(kept) + text.count(b"\n", 0, end)
                self.found.add(Kind.TABLE, line, None, "this is no row of a table")
                return
            numbers = np.fromstring(text.replace(b"\n", b",").decode("ascii"), sep=",")
            rows = np.concatenate([kept, numbers.reshape(-1, kept.shape[1])])
            last = np.flatnonzero(rows[:, 0] != rows[-1, 0])
            cut = int(last[-1]) + 1 if len(last) else 0
            yield from self._check_points(rows[:cut])
            kept = rows[cut:]
        yield from self._check_points(kept)

    def _piece(self) -> bytes:
        """Whole rows, about PIECE bytes of them."""
        text = self.table.read(PIECE)
        return text + self.table.readline() if text and not text.endswith(b"\n") else text

    def _check_points(self, rows: Array) -> Iterator[Paths]:
        """Match rows with rapids, then make them paths."""
        if not len(rows) or self.found.full:
            return
        begin = np.flatnonzero(np.diff(rows[:, 0], prepend=-1.0))
        end = np.append(begin[1:], len(rows))
        first = self.line + begin
        self.line += len(rows)
        index = np.searchsorted(self.rapids.line, rows[begin, 0])
        good = np.zeros(len(begin), dtype=np.bool_)
        for k, i in enumerate(index.tolist()):
            problem = self._mismatch(i, int(rows[begin[k], 0]))
            if problem:
                self.found.add(Kind.TABLE, int(first[k]), None, problem)
                continue
            self.at = i + 1
            good[k] = self._frame(rows[begin[k] : end[k]], i, int(first[k]))
        self.replaced += index[good].tolist()
        if not good.any():
            return
        keep = np.repeat(good, end - begin)
        size = (end - begin)[good]
        yield self._make(rows[keep], index[good], np.cumsum(size), size, first[good])

    def _mismatch(self, i: int, line: int) -> str:
        """Say why these rows belong to no rapid that may be replaced; empty if they do."""
        if i >= len(self.rapids) or self.rapids.line[i] != line:
            return f"line {line} of the program is no rapid"
        if i < self.at:
            return f"rapid of line {line} is out of order"
        if self.rapids.reason[i] != CERTAIN:
            return f"rapid of line {line} had to be left alone"
        if int(self.rapids.words[i]) & ~self.known:
            return f"rapid of line {line} moves an axis that the machine does not have"
        return ""

    def _frame(self, rows: Array, i: int, line: int) -> bool:
        """Check times, start and end of one rapid's rows; whether the points can be judged."""
        original = int(self.rapids.line[i])
        dt = self.machine.interval
        if len(rows) < 2:
            self.found.add(Kind.TABLE, line, original, "a stream has at least two rows")
            return False
        off = np.abs(rows[:, 1] - np.arange(len(rows)) * dt) > 1e-6 * dt
        if off.any():
            at = int(np.flatnonzero(off)[0])
            problem = f"t is {rows[at, 1]:g}, expected {at * dt:g}"
            self.found.add(Kind.TIME, line + at, original, problem)
            return False
        unknown = np.isnan(self.rapids.start[i, self.columns])
        other = (np.isnan(rows[:, 2:]) != unknown).any(axis=1)
        if other.any():
            at = int(np.flatnonzero(other)[0])
            problem = "nan stands for what the program does not tell, and only for that"
            self.found.add(Kind.TABLE, line + at, original, problem)
            return False
        for where, row, kind in (("start", 0, Kind.START), ("target", -1, Kind.END)):
            wanted = getattr(self.rapids, where)[i, self.columns]
            is_off = ~(np.abs(rows[row, 2:] - wanted) <= EXACT * np.maximum(1.0, np.abs(wanted)))
            is_off &= ~(np.isnan(wanted) & np.isnan(rows[row, 2:]))
            if is_off.any():
                at = int(np.flatnonzero(is_off)[0])
                name = AXES[self.columns[at]]
                problem = f"{name} is {rows[row, 2 + at]:.12g}, the program says {wanted[at]:.12g}"
                self.found.add(kind, line + row % len(rows), original, problem)
        return True

    def _make(
        self, rows: Array, index: NDArray[np.int64], end: NDArray[np.int64],
        size: NDArray[np.int64], first: NDArray[np.int64],
    ) -> Paths:  # fmt: skip
        """Make paths of the rows."""
        start = np.nan_to_num(self.rapids.start[index])
        displacement = self.rapids.target[index] - self.rapids.start[index]
        displacement = np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0)
        position = np.repeat(start, size, axis=0)
        given = np.nan_to_num(rows[:, 2:], nan=0.0)
        known = ~np.isnan(np.repeat(self.rapids.start[index][:, self.columns], size, axis=0))
        columns = np.array(self.columns)
        position[:, columns] = np.where(known, given, position[:, columns])
        return Paths(
            rapid=index,
            original_line=self.rapids.line[index],
            line=first + 1,
            begin=end - size,
            end=end,
            position=position,
            feed=np.full(len(rows), np.nan),
            start=start,
            displacement=displacement,
            unit=np.ones(len(index)),
            speed=self.rapids.speed[index],
            step=np.tile(resolutions(self.machine), (len(index), 1)),
            lone=self.rapids.lone[index],
            lead=np.zeros(len(index), dtype=np.int64),
        )
