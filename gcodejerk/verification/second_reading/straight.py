"""Many plain lines at once, for the second reading: rapids and feed moves to absolute places.

Most of a program is G0 and G1 with X, Y, Z and F. While nothing else stands in the lines and no
mode makes them mean more, each axis stands where its last word says, and F is the last F. Such
lines are one match and some columns; whatever is odd about one is left to `tracking`, line by line.

Rule: what is taken here is what `Tracker.follow` would make of it, and nothing that it would say
anything against but that a line moves with feed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.gcodes import G1, G40
from gcodejerk.verification.second_reading.circling import NO_FEED
from gcodejerk.verification.second_reading.lengths import is_one_number
from gcodejerk.verification.second_reading.tracking import Tracker

Column = NDArray[np.float64]
PLAIN_AXES = "XYZ"
MOST_LINES = 4096
"""Groups of lines in one match, about."""
FEWEST = 8
"""Lines below which columns are not worth it."""
_NUMBER = rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?![0-9.])"
_POINTED = rb"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?![0-9.])"
_BLANK = rb"[ \t]*"
_FEED_LINES = 15
"""Lines without a G0 behind one that has it; more of them are a run (`Text.take_run`)."""
_NUMBERS_ONLY = bytes(32 if chr(c) in "GNXYZF\r\n\t" else c for c in range(256))
_FRONT = re.compile(rb"^[ \t]*(?:[0-9]+[ \t]+)?L", re.MULTILINE)
"""What stands in front of the words of a line in Klartext."""


@dataclass(frozen=True, slots=True, eq=False)
class Straight:
    """Plain lines, one behind the other; columns of n lines, and of the axes `PLAIN_AXES`."""

    axes: NDArray[np.int64]
    """Bit k: a word for axis k."""
    rapid: NDArray[np.bool_]
    """G0 is in force; G1 in the others."""
    start: Column
    """In front of each line, shape (n, 3); NaN where it is not known. [mm]"""
    end: Column
    """Behind it."""
    feed: Column
    """F behind it."""
    whole: NDArray[np.bool_]
    """That F was written without a decimal point."""
    feeds: bool
    """Any of the lines has an F."""

    def __len__(self) -> int:
        return len(self.axes)


class PlainLines:
    """Takes plain lines of one dialect."""

    def __init__(self, dialect: Dialect, decimals_matter: bool) -> None:
        """Begin.

        Parameters
        ----------
        dialect : Dialect
            Its table.
        decimals_matter : bool
            A number without a decimal point is not what it says.
        """
        self.dialect = dialect
        number = _POINTED if decimals_matter else _NUMBER
        if dialect.text.digits:
            number = number.replace(b"[0-9]+", b"[0-9]{1,4}", 1)
        if dialect.text.loose:
            number = _BLANK + number
        group = _statement(number) if dialect.text.klartext else _blocks(number)
        self.pattern = re.compile(group + rb"{2,%d}" % MOST_LINES)
        self.possible = self._possible()

    def _possible(self) -> bool:
        """Whether the dialect's table gives plain lines no other meaning."""
        dialect = self.dialect
        rules = dialect.text
        letters = {*PLAIN_AXES, "F"}
        taken = {*dialect.increments, *dialect.calls, *dialect.tool_frame, dialect.length_word}
        return (
            (dialect.modal_motion or rules.klartext)
            and not dialect.one_command
            and not dialect.lengths_only
            and not dialect.apart
            and dialect.rapid == 0
            and letters <= set(dialect.letters)
            and not letters & taken
            and all(dialect.groups.get(code) == "motion" for code in (0, G1))
            and all(dialect.effect(code) == "none" for code in (0, G1))
            and not {0, G1}
            & {*dialect.cycles, *dialect.redrawn, *dialect.transforms, *dialect.bars}
            and not {"G0", "G1"} & set(dialect.refused)
        )

    def ready(self, tracker: Tracker) -> bool:
        """Whether what is in force gives them none."""
        return (
            self.possible
            and tracker.may_run
            and tracker.begun
            and not tracker.lacks_feed()
            and not tracker.depth
            and not tracker.doubt
            and (not tracker.dark or tracker.spindle == 5)
            and tracker.g.get("compensation") == G40
            and not tracker.may_stop()
            and all(on is False for on in tracker.bars.values())
            and not tracker.slow
        )

    def take(self, data: bytes, at: int, tracker: Tracker) -> tuple[Straight, int] | None:
        """Take plain lines, if some begin here; the first states G0.

        Parameters
        ----------
        data : bytes
            Whole lines.
        at : int
            Begin of one of them.
        tracker : Tracker
            What is known in front of it; stays as it is.

        Returns
        -------
        Straight
            The lines.
        end : int
            Begin of the line behind them.
        """
        match = self.pattern.match(data, at)
        if match is None:
            return None
        text, rules = match[0], self.dialect.text
        if is_one_number(text, self.dialect):
            return None
        characters = np.frombuffer(text, dtype=np.uint8)
        ends = np.flatnonzero(characters == 10)
        if len(ends) < FEWEST or int(np.diff(ends, prepend=-1).max()) > rules.shortest:
            return None
        if self.dialect.feed_needed and NO_FEED.search(text):
            return None
        if rules.klartext:
            text = _FRONT.sub(b"", text).replace(b"R0", b"").replace(b"FMAX", b"G0")
            characters = np.frombuffer(text, dtype=np.uint8)
            ends = np.flatnonzero(characters == 10)
        begins = np.flatnonzero(characters >= ord("A"))
        # The words of a line are some of N, G, X, Y, Z, F; each has one number.
        numbers = np.fromstring(text.translate(_NUMBERS_ONLY).decode("ascii"), sep=" ")
        assert len(numbers) == len(begins)
        letters, line = characters[begins], np.searchsorted(ends, begins)
        lines = _Lines(len(ends), letters, line, numbers)
        if rules.klartext:
            g = np.where(lines.named("G"), 0.0, 1.0)  # FMAX is for its own line
        else:
            g = lines.last("G", 0.0 if tracker.g.get("motion") == 0 else 1.0)
        feed_words = np.flatnonzero(letters == ord("F"))
        points = np.searchsorted(
            np.flatnonzero(characters == ord(".")), np.append(begins, len(text))
        )
        whole = (points[feed_words + 1] == points[feed_words]) & (
            self.dialect.whole_numbers == "machine"
        )
        before = float(bool(tracker.feed_whole))
        each = [
            lines.last(axis, tracker.at[k], tracker.scale(axis))
            for k, axis in enumerate(PLAIN_AXES)
        ]
        end = np.stack(each, axis=1)
        named = [lines.named(axis).astype(np.int64) for axis in PLAIN_AXES]
        run = Straight(
            axes=named[0] | named[1] << 1 | named[2] << 2,
            rapid=g == 0.0,
            start=np.vstack([tracker.at[: len(PLAIN_AXES)], end[:-1]]),
            end=end,
            feed=lines.last("F", tracker.feed),
            whole=lines.filled(line[feed_words], whole.astype(np.float64), before) != 0.0,
            feeds=bool(len(feed_words)),
        )
        return run, match.end()


def _words(number: bytes, blank: bytes) -> bytes:
    """Words of axes in their order, each as `blank` lets it stand."""
    return b"".join(blank % (b"%c" % letter + number) for letter in PLAIN_AXES.encode())


def _blocks(number: bytes) -> bytes:
    """A line that states G0, and feed moves behind it."""
    block = rb"(?=[XYZ])" + _words(number, rb"(?:%s" + _BLANK + rb")?")
    block += rb"(?:F" + _NUMBER + _BLANK + rb")?\r?\n"
    begin = _BLANK + rb"(?:N[0-9]{1,7}" + _BLANK + rb")?"
    rapid = begin + rb"G0?0(?![0-9.])" + _BLANK + block
    other = begin + rb"(?:G0?1(?![0-9.])" + _BLANK + rb")?" + block
    return rb"(?:%s(?:%s){0,%d})" % (rapid, other, _FEED_LINES)


def _statement(number: bytes) -> bytes:
    """A line of Klartext: ``12 L X+5 Y+2 R0 FMAX``; R0 says nothing where it is in force."""
    begin = _BLANK + rb"(?:[0-9]{1,9}[ \t]+)?L(?=[ \t]+[XYZ])"
    words = _words(number, rb"(?:[ \t]+%s(?=[ \t\r\n]))?")
    feed = rb"(?:[ \t]+F(?:MAX|[0-9]{1,6}(?:\.[0-9]{0,6})?)(?=[ \t\r\n]))?"
    return rb"(?:" + begin + words + rb"(?:[ \t]+R0(?=[ \t\r\n]))?" + feed + _BLANK + rb"\r?\n)"


def follow(tracker: Tracker, run: Straight) -> None:
    """Stand where plain lines end."""
    tracker.begun = tracker.started = True
    tracker.at[: len(PLAIN_AXES)] = run.end[-1].tolist()
    named = int(np.bitwise_or.reduce(run.axes))
    for k, axis in enumerate(PLAIN_AXES):
        if named >> k & 1:
            tracker.untold.pop(axis, None)
    tracker.g["motion"] = 0 if run.rapid[-1] else G1
    if run.feeds:
        tracker.feed, tracker.feed_whole = float(run.feed[-1]), bool(run.whole[-1])


class _Lines:
    """Words of lines, by their letters."""

    def __init__(
        self,
        count: int,
        letters: NDArray[np.uint8],
        line: NDArray[np.int64],
        numbers: Column,
    ) -> None:
        self.count, self.letters, self.line, self.numbers = count, letters, line, numbers

    def named(self, letter: str) -> NDArray[np.bool_]:
        """Which lines have a word."""
        out = np.zeros(self.count, dtype=np.bool_)
        out[self.line[self.letters == ord(letter)]] = True
        return out

    def last(self, letter: str, before: float, scale: float = 1.0) -> Column:
        """The last number of a letter, up to and with each line."""
        own = self.letters == ord(letter)
        return self.filled(self.line[own], self.numbers[own] * scale, before)

    def filled(self, line: NDArray[np.int64], values: Column, before: float) -> Column:
        """Values of some lines, each in force until the next."""
        column = np.full(self.count + 1, before)
        column[line + 1] = values
        at = np.zeros(self.count + 1, dtype=np.int64)
        at[line + 1] = line + 1
        filled: Column = column[np.maximum.accumulate(at)][1:]
        return filled
