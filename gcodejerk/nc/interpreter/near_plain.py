"""What stands around rapids among plain lines: all rapids of a chunk at once.

This is `neighbours` for the lines that need no second look, by the letters that stand on them; what
is asked, and why, is said there. Where a careful line, or the end of the chunk, comes into it, the
answer is `UNSAID`, and `neighbours` looks for itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.text.words import BIT, Lines, read_words

Answers = NDArray[np.int8]
NO, YES, UNSAID = 0, 1, -1
_MOVING = np.uint32(sum(BIT[letter] for letter in AXES + "IJK"))
_TIMED = np.uint32(BIT["G"] | BIT["F"])
_WAITING = np.uint32(BIT["S"])
_MOST = 8
"""Lines in front of a rapid that are looked at here."""


def _held(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
    """The last line with the flag, up to and including each line; -1 in front of the first."""
    last: NDArray[np.int64] = np.where(flags, np.arange(len(flags)), -1)
    return np.maximum.accumulate(last, out=last)


def are_followed(lines: Lines, rows: NDArray[np.int64], farthest: int) -> Answers:
    """Whether a motion follows directly behind each of some lines.

    Parameters
    ----------
    lines : Lines
        Of the chunk.
    rows : ndarray, shape (n,)
        Lines that make rapids.
    farthest : int
        How far the answer may stand behind the line. [bytes]

    Returns
    -------
    ndarray, shape (n,)
        `YES`, `NO`, or `UNSAID` where no plain line of the chunk says it.
    """
    letters = lines.letters
    says = lines.careful | (letters & (_MOVING | _WAITING) != 0)
    # The first line behind each that says something, by going through them from the end.
    behind = len(lines) - 1 - _held(says[::-1])[::-1]
    following = np.append(behind, len(lines))[rows + 1]
    at = np.minimum(following, len(lines) - 1)
    unsaid = (following == len(lines)) | lines.careful[at] | lines.careful[rows]
    unsaid |= lines.end[at] - lines.end[rows] > farthest
    moves = letters[at] & _WAITING == 0
    return np.where(unsaid, UNSAID, np.where(moves, YES, NO)).astype(np.int8)


@dataclass(frozen=True, slots=True, eq=False)
class Fast:
    """What makes a motion a long one, of each of n rapids."""

    incremental: NDArray[np.bool_]
    unit: NDArray[np.float64]
    """Millimetres in one of the program's unit."""
    feed: NDArray[np.float64]
    """F in force behind the rapid; NaN where it is no speed. [mm/min]"""
    rapid_way: float
    """Way of a rapid that is long. [mm]"""
    feed_time: float
    """The same of a feed move, which need be no longer than a rapid. [s]"""


def are_queued(lines: Lines, rows: NDArray[np.int64], first: int, how: Fast, far: int) -> Answers:
    """Whether a motion of some length stands in front of each of some lines.

    Parameters
    ----------
    lines : Lines
        Of the chunk.
    rows : ndarray, shape (n,)
        Lines that make rapids.
    first : int
        Where the chunk begins in the file. [bytes]
    how : Fast
        Of each of them.
    far : int
        How far in front the first line may begin that is looked at. [bytes]

    Returns
    -------
    ndarray, shape (n,)
        `YES`, `NO`, or `UNSAID`.
    """
    letters = lines.letters
    begin = lines.begin[rows] - far
    oldest = np.searchsorted(lines.begin, begin, side="right")
    careful = np.concatenate([[0], np.cumsum(lines.careful)])
    plain = (careful[rows + 1] == careful[oldest]) & ((begin >= 0) | (first == 0))
    answer = np.full(len(rows), UNSAID, dtype=np.int8)
    going = np.flatnonzero(plain)
    answer[going[letters[rows[going]] & _WAITING != 0]] = NO
    going = going[answer[going] == UNSAID]
    ways = _Ways.of(lines)
    at, feed = rows[going] - 1, how.feed[going]
    for _ in range(_MOST):
        there = at >= oldest[going]
        answer[going[~there]] = NO
        going, at, feed = going[there], at[there], feed[there]
        waits = letters[at] & _WAITING != 0
        fed = ~ways.is_rapid[at] & (feed > 0.0)
        timed = np.fmin(how.rapid_way, feed * how.feed_time / 60.0)
        way = ways.largest(at, oldest[going], how.incremental[going]) * how.unit[going]
        long = ~waits & (way >= np.where(fed, timed, how.rapid_way))
        answer[going[waits]], answer[going[long]] = NO, YES
        open_ = ~waits & ~long
        feed[letters[at] & BIT["F"] != 0] = np.nan  # another one holds in front of that line
        going, at, feed = going[open_], at[open_] - 1, feed[open_]
    return answer


@dataclass(frozen=True, slots=True, eq=False)
class _Ways:
    """How far the lines of a chunk go, by the numbers of X, Y and Z."""

    is_rapid: NDArray[np.bool_]
    """G0 stands on the line."""
    values: NDArray[np.float64]
    """Shape (3, lines); NaN where the axis is not on the line."""
    before: NDArray[np.int64]
    """The last line in front that names the axis; -1: none."""

    @classmethod
    def of(cls, lines: Lines) -> _Ways:
        """Of all lines."""
        codes = lines.words("G", 0, len(lines))
        is_rapid = np.zeros(len(lines), dtype=np.bool_)
        is_rapid[codes.line[codes.codes() == 0]] = True
        words = [lines.words(axis, 0, len(lines)) for axis in "XYZ"]
        values = np.full((len(words), len(lines)), np.nan)
        before = np.full((len(words), len(lines)), -1)
        numbers = read_words([(each, slice(None)) for each in words])
        for k, (each, number) in enumerate(zip(words, numbers, strict=True)):
            values[k, each.line] = number
            before[k, 1:] = _held(~np.isnan(values[k]))[:-1]
        return cls(is_rapid, values, before)

    def largest(
        self, at: NDArray[np.int64], oldest: NDArray[np.int64], incremental: NDArray[np.bool_]
    ) -> NDArray[np.float64]:
        """The longest way of an axis on some lines, by what is said from the oldest on; or 0."""
        before = self.before[:, at]
        from_ = np.take_along_axis(self.values, before, axis=1)
        from_[before < oldest] = np.nan
        from_[:, incremental] = 0.0
        way: NDArray[np.float64] = np.fmax.reduce(np.abs(self.values[:, at] - from_), initial=0.0)
        return way
