"""From the lines of a program with blocks written out to those of the original.

Rule: whatever stands in front of the eight steps and writes blocks out (drilling cycles, loops and
calls) leaves such a map, and everybody who names lines of its result goes through it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.interpreter.rapids import Rapids


@dataclass(frozen=True, slots=True, eq=False)
class LineMap:
    """Where the blocks that were written out stand, in the result and in the original.

    Entry i of every array is block i, in the order of the file.
    """

    line: NDArray[np.int64]
    """First line of the moves written for the block; counted from 1, like all lines."""
    lines: NDArray[np.int64]
    begin: NDArray[np.int64]
    """It is the result's bytes begin:end, line ends included."""
    end: NDArray[np.int64]
    original_line: NDArray[np.int64]
    original_begin: NDArray[np.int64]
    """The block is the original's bytes begin:end, without its line end."""
    original_end: NDArray[np.int64]
    original_terminator: NDArray[np.int64]
    """As `Rapids.terminator`."""
    whole: LineMap | None = None
    """What was replaced as one, where several blocks of the original were; None: each by itself."""

    @property
    def replaced(self) -> LineMap:
        """What was replaced, piece by piece, in the order of both files."""
        return self if self.whole is None else self.whole

    def __len__(self) -> int:
        return len(self.line)

    def lines_of(self, lines: NDArray[np.int64]) -> NDArray[np.int64]:
        """Lines of the original that lines of the result come from."""
        if not len(self):
            return lines
        k = np.searchsorted(self.line, lines, side="right") - 1
        behind = lines - (self.line[k] + self.lines[k]) + 1
        mapped = self.original_line[k] + np.maximum(behind, 0)
        return np.where(k < 0, lines, mapped).astype(np.int64)

    def line_of(self, line: int | None) -> int | None:
        """The same for one line; None stays None."""
        return None if line is None else int(self.lines_of(np.array([line]))[0])

    def rapids_of(self, rapids: Rapids) -> Rapids:
        """The rapids with the places of their blocks in the original; several may share one."""
        if not len(self) or not len(rapids):
            return rapids
        k = np.searchsorted(self.begin, rapids.begin, side="right") - 1
        inside = (k >= 0) & (rapids.begin < self.end[k])
        ends = np.array([0, 1, 2, 1])[self.original_terminator]
        shift = np.where(k < 0, 0, self.original_end[k] + ends[k] - self.end[k])
        return replace(
            rapids,
            line=self.lines_of(rapids.line),
            begin=np.where(inside, self.original_begin[k], rapids.begin + shift),
            end=np.where(inside, self.original_end[k], rapids.end + shift),
            terminator=np.where(inside, self.original_terminator[k], rapids.terminator).astype(
                np.uint8
            ),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Chain:
    """Two maps, one behind the other: a program written out twice."""

    first: LineMap
    """From the program between to the original."""
    second: LineMap
    """From the result to the program between; of blocks that stand in one line each."""

    def __len__(self) -> int:
        return len(self.first) + len(self.second)

    def lines_of(self, lines: NDArray[np.int64]) -> NDArray[np.int64]:
        """Lines of the original that lines of the result come from."""
        return self.first.lines_of(self.second.lines_of(lines))

    def line_of(self, line: int | None) -> int | None:
        """The same for one line; None stays None."""
        return self.first.line_of(self.second.line_of(line))

    def rapids_of(self, rapids: Rapids) -> Rapids:
        """The rapids with the places of their blocks in the original; several may share one."""
        return self.first.rapids_of(self.second.rapids_of(rapids))

    @property
    def replaced(self) -> LineMap:
        """What was replaced, piece by piece, in the order of both files."""
        outer, inner = self.first.replaced, self.second.replaced
        if not len(outer) or not len(inner):
            return outer if len(outer) else inner
        ends = np.array([0, 1, 2, 1])
        stood = inner.original_end + ends[inner.original_terminator]
        outer = replace(
            outer,
            begin=_shifted(outer.begin, stood, inner.end - inner.begin, inner.original_begin),
            end=_shifted(outer.end, stood, inner.end - inner.begin, inner.original_begin),
        )
        k = np.searchsorted(self.first.replaced.begin, inner.original_begin, side="right") - 1
        within = (k >= 0) & (inner.original_begin < self.first.replaced.end[k])
        behind = self.first.replaced
        back = behind.original_end + ends[behind.original_terminator]
        size = back - behind.original_begin

        def places(at: NDArray[np.int64]) -> NDArray[np.int64]:
            return _shifted(at, behind.end, size, behind.begin)

        inner = replace(
            inner,
            original_line=self.first.lines_of(inner.original_line),
            original_begin=places(inner.original_begin),
            original_end=places(inner.original_end),
        )
        rows = np.stack(
            [
                np.concatenate([getattr(outer, name), getattr(inner, name)[~within]])
                for name in _COLUMNS
            ]
        )
        order = np.argsort(rows[_COLUMNS.index("begin")], kind="stable")
        return LineMap(*rows[:, order].astype(np.int64))


Lines = LineMap | Chain
_COLUMNS = (
    *("line", "lines", "begin", "end", "original_line", "original_begin", "original_end"),
    "original_terminator",
)


def _shifted(
    at: NDArray[np.int64],
    ends: NDArray[np.int64],
    sizes: NDArray[np.int64],
    begins: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Offsets behind pieces that have other sizes: piece k is begins:ends, sizes there."""
    grown = np.concatenate([[0], np.cumsum(sizes - (ends - begins))])
    moved: NDArray[np.int64] = at + grown[np.searchsorted(ends, at, side="right")].astype(np.int64)
    return moved
