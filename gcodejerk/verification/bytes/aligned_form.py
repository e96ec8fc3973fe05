"""The text of a stream for LinuxCNC, whose blocks end on servo periods, read back.

This module owns what is different in this form: tiny G0 in front of the points, with a slow block
between them where nothing stands in the queue of motions; the block's own words as a G0 behind the
points; and F and feed mode in a line of their own.
"""

from __future__ import annotations

import re
from decimal import Decimal

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.gcodes import G1
from gcodejerk.verification.bytes.form import Stream, StreamReader, run_of
from gcodejerk.verification.bytes.modes import read_words
from gcodejerk.verification.findings import Kind

DECIMALS, INCH_DECIMALS, FEED_DECIMALS = 6, 8, 12
"""Of positions in mm and in inches, and of F, at most."""
Words = list[tuple[str, Decimal]]


class AlignedReader(StreamReader):
    """Reads one replacement in this form."""

    def _setup(self) -> bool:
        """Pass the line of modes in front of the points, if there is one."""
        line = self.peek()
        words = read_words(line)
        if words is not None and not any(letter in AXES for letter, _ in words):
            problem = self._apply(words) or self.allowed.setup_problem(words)
            if problem:
                self.complain(Kind.FORM, f"{problem}: '{line[:60].decode('latin-1')}'")
                return False
            self.next()
        self._modes_of_points()
        return True

    def _points(self) -> Stream | None:
        """Read what leads in, the points, and the block's own words."""
        stream = Stream(self.i, self.original_line, self.window.line, "", b"")
        for code in self._lead():
            numbers = self._one_axis(code)
            if numbers is None:
                self.complain(Kind.FORM, "what leads into the points is missing")
                return None
            stream.lead.append(numbers)
            self.next()
        words = read_words(self.peek())
        if words is None or not words or words[0] != ("G", Decimal(1)) or words[-1][0] != "F":
            self.complain(Kind.FORM, "points of a stream are missing")
            return None
        stream.letters = "".join(letter for letter, _ in words[1:-1])
        if not set(stream.letters) <= {*AXES} or len(set(stream.letters)) < len(stream.letters):
            self.complain(Kind.FORM, "a point holds axis words and F, nothing else")
            return None
        stream.text = self._take_alike(stream.letters)
        self._points_in(stream.text)
        if not stream.text or set(stream.letters) != self.allowed.axes:
            self.complain(Kind.AXES, "points name other axes than those that move")
        self._measure(max(map(len, stream.text.splitlines()), default=0))
        return stream if self._end(stream) else None

    def _lead(self) -> tuple[int, ...]:
        """Motion codes of what leads into the points."""
        return (0,) if self.rapids.queued[self.i] else (0, 1, 0)

    def run(self, letters: str) -> re.Pattern[bytes]:
        """Points with these axes, as many decimals as this form has."""
        decimals = INCH_DECIMALS if self.rapids.inch[self.i] else DECIMALS
        # LinuxCNC computes in doubles, in whatever dialect the program was written.
        words = b"".join(
            rb" %c-?(?:0|[1-9][0-9]{0,8})\.[0-9]{1,%d}" % (ord(a), decimals) for a in letters
        )
        feed = rb" F(?:0|[1-9][0-9]{0,8})\.[0-9]{1,%d}" % FEED_DECIMALS
        return run_of(b"G1" + words + feed, self.line_end)

    def _one_axis(self, code: int) -> dict[str, Decimal] | None:
        """The words of a line that moves one axis; None where it is none."""
        words = read_words(self.peek()) or []
        letters = [letter for letter, _ in words]
        wanted = ["G", *(letters[1:2]), *(["F"] if code == 1 else [])]
        if letters != wanted or words[0][1] != code or letters[1] not in self.allowed.axes:
            return None
        return dict(words[1:])

    def _end(self, stream: Stream) -> bool:
        """Pass the G0 with the block's own words."""
        line = self.peek()
        words, ending = read_words(line) or [], None
        if words[1:2] and words[1][0] == "G":
            ending = int(words.pop(1)[1] * 10)
        numbers = dict(words[1:])
        plain = words[:1] == [("G", Decimal(0))] and len(numbers) == len(words) - 1
        if not plain or not numbers or not set(numbers) <= {*AXES}:
            shown = line[:60].decode("latin-1")
            self.complain(Kind.FORM, f"behind the points stands no G0 to the end: '{shown}'")
            return False
        stream.rest.append(numbers)
        self.modes.motion, self.modes.feed = 0, None
        self._points_in(line)
        self._end_of_points(ending)
        self.last(more=bool(self._restored() or self.allowed.behind))
        return True

    def _restored(self) -> bool:
        """Whether F or the feed mode stand behind the end."""
        return self.allowed.feed or self.allowed.tail != {0}

    def _tail(self) -> bool:
        """Pass the words that restore F and the feed mode, and what runs behind it all."""
        wanted = self._restored()
        line = self.peek() if wanted else b""
        words = read_words(line) if wanted else []
        problem = "the modes are not restored" if words is None else self._apply(words)
        if problem:
            self.complain(Kind.FORM, f"{problem}: '{line[:60].decode('latin-1')}'")
            return False
        before = len(self.found.violations)
        self._compare(type(self.modes).after(self.rapids, self.i))
        if wanted:
            self._same_scale(line)
            before_it: Words = [] if G1 in self.allowed.tail else [("G", Decimal(0))]
            problem = self.allowed.tail_problem([*before_it, *(words or [])])
            if problem and len(self.found.violations) == before:
                self.complain(Kind.FORM, f"{problem}: '{line[:60].decode('latin-1')}'")
            self.last(more=bool(self.allowed.behind))
        return self._stops()
