"""What the words of a run of plain lines say: where its rapids begin and end, and at what F.

This module owns the numbers of a run; `runs` owns which lines are one. Of the thousand moves of a
finishing pass only the last place matters to the rapid behind it, so no more numbers are read.

Rule: what `moves` does with a word, happens here to all words of its letter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LINEAR
from gcodejerk.nc.dialects.gcodes import G40, G90, G91
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.moves import plane_axes, turn_by_turn
from gcodejerk.nc.text.words import BIT, Lines, Words, read_words
from gcodejerk.start import RapidFeed


def turning(state: State, *, unstated: bool = False) -> int:
    """The bits of rotary axes whose absolute words do not say by themselves where they lead.

    `unstated`: of those alone that nobody says the way of.
    """
    if state.distance != G90:
        return 0
    plain = ("none", "shortest", "sign") if unstated else ("none",)
    wraps = enumerate(state.wraps)
    return sum(1 << k for k, wrap in wraps if AXES[k] not in LINEAR and wrap not in plain)


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """The words of one letter in a run, and how many stand in front of some lines, and behind."""

    words: Words
    before: NDArray[np.intp]
    behind: NDArray[np.intp]

    def which(self, summed: bool) -> NDArray[np.intp]:
        """Words whose numbers matter: all where they are summed, else the last ones somewhere.

        Where the places are about as many as the words, picking takes longer than it saves.
        """
        count = len(self.words.line)
        if summed or count < 2 * len(self.before):
            return np.arange(count)
        matters = np.zeros(count + 1, dtype=np.bool_)
        matters[self.before] = matters[self.behind] = matters[-1] = True
        return np.flatnonzero(matters[1:])

    def held(
        self, before: float, which: NDArray[np.intp], values: NDArray[np.float64], summed: bool
    ) -> NDArray[np.float64]:
        """What holds behind each word, and in front of all, where that was `before`."""
        held = np.empty(len(self.words.line) + 1)
        held[0] = before
        held[which + 1] = values
        return np.add.accumulate(held) if summed else held


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """A run of plain lines, and what is in force in front of it."""

    state: State
    lines: Lines
    letters: NDArray[np.uint32]
    """Of the lines of the run."""
    first: int
    """The first of these in the chunk."""
    moving: NDArray[np.intp]
    """Those that move, or may."""

    @property
    def displaced(self) -> list[int]:
        """Axes of which cutter compensation leaves nobody knows what behind each move."""
        return [] if self.state.compensation == G40 else plane_axes(self.state)

    def scale(self, axis: int) -> float:
        """Mm (or deg) per unit of an axis word; NaN where nobody knows what it says."""
        return NAN if self.state.distance is None else self.state.scale(axis)

    def history(self, letter: str, rows: NDArray[np.intp]) -> History:
        """The words of a letter, as some lines see them."""
        words = self.lines.words(letter, self.first, self.first + len(self.letters))
        if not len(words.line):
            none = np.zeros(len(rows), dtype=np.intp)
            return History(words, none, none)
        stands = self.letters & BIT[letter] != 0
        behind = np.cumsum(stands, dtype=np.intp).take(rows)
        return History(words, behind - stands.take(rows), behind)

    def counted(self, feeding: NDArray[np.bool_], rapid_feed: RapidFeed | None) -> NDArray[np.intp]:
        """Which of the feed moves count as rapids; the state stays where it is."""
        state = self.state
        rows = np.flatnonzero(feeding)
        if rapid_feed is None or state.unit is None or state.feed_mode != 94:
            return rows[:0]
        feeds, summed = self.history("F", rows), False
        which = feeds.which(summed)
        (values,) = read_words([(feeds.words, which)])
        feed = feeds.held(state.feed, which, values, summed).take(feeds.behind)
        rows = rows[feed == rapid_feed.feed]
        z, summed = AXES.index("Z"), state.distance == G91
        if z in self.displaced:
            rows = rows[np.isin(rows, self.moving[:1])]
        heights = self.history("Z", rows)
        which = heights.which(summed)
        (values,) = read_words([(heights.words, which)])
        held = heights.held(state.position[z], which, values * self.scale(z), summed)
        begin, end = held.take(heights.before), held.take(heights.behind)
        counted: NDArray[np.intp] = rows[rapid_feed.covers(rapid_feed.feed, begin, end, state.unit)]
        return counted

    def told(
        self, feeds: History, rapid: NDArray[np.intp]
    ) -> tuple[
        NDArray[np.float64], NDArray[np.float64], NDArray[np.uint16], NDArray[np.float64] | float
    ]:
        """Where each rapid starts and ends, which axes turn, and its F.

        The state is moved to the run's end.
        """
        state = self.state
        start = np.empty((len(rapid), len(AXES)))
        start[:] = state.position
        target, feed = start.copy(), state.feed
        turned = np.zeros(len(rapid), dtype=np.uint16)
        named = axes_of(int(np.bitwise_or.reduce(self.letters)))
        axes = [axis for axis in named if axis not in self.displaced]
        summed, turns = state.distance == G91, turning(state)
        histories = [self.history(AXES[axis], rapid) for axis in axes]
        every = [summed or bool(turns >> axis & 1) for axis in axes]
        which = [history.which(each) for history, each in zip(histories, every, strict=True)]
        given = feeds.which(summed=False)
        words = (history.words for history in histories)
        *numbers, fed = read_words([*zip(words, which, strict=True), (feeds.words, given)])
        for axis, history, index, values in zip(axes, histories, which, numbers, strict=True):
            here, values = state.position[axis], values * self.scale(axis)
            if turns >> axis & 1:
                values, turned_by = turn_by_turn(here, values, state.wraps[axis])
                says = history.behind > history.before
                turned[says] |= turned_by.take(history.before[says]) * np.uint16(1 << axis)
            held = history.held(here, index, values, summed)
            start[:, axis], target[:, axis] = held.take(history.before), held.take(history.behind)
            state.position[axis] = float(held[-1])
        self._displace(rapid, start, target)
        if not len(given):
            return start, target, turned, feed
        held = feeds.held(feed, given, fed, summed=False)
        state.feed = float(held[-1])
        return start, target, turned, held.take(feeds.behind)

    def _displace(
        self, rapid: NDArray[np.intp], start: NDArray[np.float64], target: NDArray[np.float64]
    ) -> None:
        """Forget where moves leave displaced axes, and keep where the program says they stand."""
        state = self.state
        if not (self.displaced and len(self.moving)):
            return
        begins = self.moving[0]
        meant = list(state.meant)
        for axis in self.displaced:
            words = self.lines.words(AXES[axis], self.first, self.first + len(self.letters))
            if len(words.line):
                (values,) = read_words([(words, np.array([-1]))])
                meant[axis] = float(values[0]) * self.scale(axis)
                if state.distance == G91:
                    alone = words.line[0] == words.line[-1] == begins
                    meant[axis] += state.position[axis] if alone else NAN
            start[rapid != begins, axis] = NAN
            target[:, axis] = NAN
        state.meant = meant
        state.forget_positions(self.displaced)


def axes_of(bits: int) -> list[int]:
    """The axes of which a bit is set."""
    return [axis for axis in range(len(AXES)) if bits >> axis & 1]
