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
