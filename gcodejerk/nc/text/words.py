"""The words of a chunk over the bytes that were read, and the lines that they stand on.

Rule: nothing is decoded or copied out, and a number is read when somebody asks for it: of the
thousand moves of a finishing pass only the last place matters to the rapid behind it. Only plain
lines have their words here, a plain line being one of numbers behind letters that need no second
look (`lexer` says which). All other lines are marked `careful`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.text.numbers import parse_numbers

PLAIN_LETTERS = AXES + "NGFSIJKRE"
"""Letters that a plain line may hold; letter k has bit k in `Lines.letters`."""

BIT = {letter: 1 << k for k, letter in enumerate(PLAIN_LETTERS)}
COMMENT, DOT, SIGN = range(3)
"""Classes of the joints that may stand in front of digits without being letters (`joints`); the
first is 0, which is what a class multiplied by False becomes."""


@dataclass(frozen=True, slots=True, eq=False)
class Joints:
    """Where the numbers of a chunk begin and end."""

    text: NDArray[np.uint8]
    """The bytes, with what `parse_numbers` needs around them."""
    place: NDArray[np.int64]
    """Of each byte of the text that is no digit."""
    kind: NDArray[np.uint8]
    """Their classes; a letter is its upper-case code."""

    def numbers(self, word: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Where the numbers behind these joints begin, and end."""
        after = word + 1
        after += self.kind.take(after) == SIGN
        after += self.kind.take(after) == DOT
        return self.place.take(word) + 1, self.place.take(after)

    def pointless(self, word: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether the numbers behind these joints have no decimal point."""
        after = word + 1
        after += self.kind.take(after) == SIGN
        whole: NDArray[np.bool_] = self.kind.take(after) != DOT
        return whole


@dataclass(frozen=True, slots=True, eq=False)
class Words:
    """The words of one letter in a run of lines; entry i of every array is word i."""

    line: NDArray[np.int64]
    """Counted from the first of the run; no two are on the same one."""
    joint: NDArray[np.int64]
    """Which of the chunk's joints is the letter."""
    joints: Joints

    def values(self) -> NDArray[np.float64]:
        """Read the numbers of all of them, in the program's own unit."""
        return read_words([(self, slice(None))])[0]

    def whole(self) -> NDArray[np.bool_]:
        """Whether they are written without a decimal point."""
        return self.joints.pointless(self.joint)

    def codes(self) -> NDArray[np.uint8]:
        """The codes of G words, which on plain lines are 0 to 3, without a point."""
        behind = self.joints.place.take(self.joint + 1)
        return self.joints.text.take(behind - 1) - np.uint8(ord("0"))


def read_words(
    chosen: Sequence[tuple[Words, slice | NDArray[np.int64]]],
) -> list[NDArray[np.float64]]:
    """Read numbers of several letters of a chunk at once.

    Parameters
    ----------
    chosen : sequence of tuple
        Words of one letter, at least one such, and which of them are to be read.

    Returns
    -------
    list of ndarray
        The numbers of each letter, in the program's own unit.
    """
    joints = chosen[0][0].joints
    word = [words.joint[which] for words, which in chosen]
    value = parse_numbers(joints.text, *joints.numbers(np.concatenate(word)))
    return np.split(value, np.cumsum([len(part) for part in word[:-1]]))


@dataclass(frozen=True, slots=True, eq=False)
class Lines:
    """The lines of one chunk; entry i of every array is line i, counted from 0."""

    begin: NDArray[np.int64]
    """The line without its end is the chunk's bytes begin:end."""
    end: NDArray[np.int64]
    terminator: NDArray[np.uint8]
    """0 none, 1 LF, 2 CR LF."""
    careful: NDArray[np.bool_]
    """The line needs the careful tokenizer; it has no words here."""
    letters: NDArray[np.uint32]
    """Which of PLAIN_LETTERS stand on the line; 0 on those."""
    joints: Joints
    """Letters of careful lines are not among them."""
    _found: dict[str, tuple[NDArray[np.int64], NDArray[np.int64]]] = field(default_factory=dict)

    def words(self, letter: str, first: int, last: int) -> Words:
        """The words of a letter within the lines first:last."""
        if letter not in self._found:
            # A letter stands on a plain line at most once.
            lines = np.flatnonzero(self.letters & BIT[letter] != 0)
            self._found[letter] = lines, np.flatnonzero(self.joints.kind == ord(letter))
        line, joint = self._found[letter]
        lower, upper = np.searchsorted(line, (first, last))
        return Words(line[lower:upper] - first, joint[lower:upper], self.joints)

    def __len__(self) -> int:
        return len(self.begin)
