"""The words of a chunk as columns over the bytes that were read.

Rule: nothing is decoded or copied out; a word is a letter, a number and a span of the source. Only
plain lines have their words here, a plain line being one of numbers behind letters that need no
second look (`lexer` says which). All other lines are marked `careful`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES

PLAIN_LETTERS = AXES + "NGFSIJKR"
"""Letters that a plain line may hold; letter k has bit k in `Lines.letters`."""

Column = tuple[NDArray[np.int64], NDArray[np.float64]]
"""Lines and values of words."""
BIT = {letter: 1 << k for k, letter in enumerate(PLAIN_LETTERS)}


@dataclass(frozen=True, slots=True, eq=False)
class Words:
    """The words of one chunk, in the order written; entry i of every array is word i."""

    source: bytes
    """The chunk exactly as read, line endings included."""
    letter: NDArray[np.uint8]
    """Address, upper case."""
    value: NDArray[np.float64]
    start: NDArray[np.int64]
    """The word is source[start:end]."""
    end: NDArray[np.int64]
    line: NDArray[np.int64]
    """In the chunk, counted from 0."""


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """The lines of one chunk; entry i of every array is line i, counted from 0."""

    begin: NDArray[np.int64]
    """The line without its end is source[begin:end]."""
    end: NDArray[np.int64]
    terminator: NDArray[np.uint8]
    """0 none, 1 LF, 2 CR LF."""
    careful: NDArray[np.bool_]
    """The line needs the careful tokenizer; it has no words here."""
    letters: NDArray[np.uint32]
    """Which of PLAIN_LETTERS stand on the line; 0 on those."""
    words: Words
    _columns: dict[str, Column] = field(default_factory=dict)

    def column(self, letter: str) -> Column:
        """Lines and values of the words of one letter."""
        if letter not in self._columns:
            at = np.flatnonzero(self.words.letter == ord(letter))
            self._columns[letter] = self.words.line[at], self.words.value[at]
        return self._columns[letter]

    def cut(self, letter: str, first: int, last: int) -> Column:
        """The same within the lines first:last, which are counted from the first."""
        at, value = self.column(letter)
        lower, upper = np.searchsorted(at, (first, last))
        return at[lower:upper] - first, value[lower:upper]

    def __len__(self) -> int:
        return len(self.begin)
