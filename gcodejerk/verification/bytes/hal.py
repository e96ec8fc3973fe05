"""Programs that ask for rapids by number, read back: controller `linuxcnc-hal`.

In front of everything that moves stand the lines that name the file of samples by its sum, and in
the place of a rapid the few lines that its form has, exactly those and no others.

Rule: as in `form`, what a line would do is judged before how it is spelled.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import BinaryIO

from gcodejerk.axes import AXES
from gcodejerk.units import MM_PER_INCH
from gcodejerk.verification.bytes.alignment import Alignment
from gcodejerk.verification.bytes.form import Stream, StreamReader
from gcodejerk.verification.bytes.modes import read_words
from gcodejerk.verification.findings import Kind

CONTROLLER = "linuxcnc-hal"
ADAPTIVE, POSITION = "adaptive-feed", "position"
FORMS = (ADAPTIVE, POSITION)
PIECE = 1 << 20
REST = 5
"""Periods for which LinuxCNC's filter is given to come to rest."""
_HEAD = re.compile(rb"gcodejerk streams 1 ([a-z-]{1,20}) ([0-9.e-]{1,25})\n")
_PLACES = re.compile(rb"\+ABS\[#(542[0-2])([+-][0-9]{1,9}(?:\.[0-9]{1,9})?)?\]")
_TINY = (0, 1, None, 0, 1, 0)
"""Motion codes of the lines of the form `adaptive-feed`; None: the line that asks."""


@dataclass(frozen=True, slots=True)
class Beside:
    """What a file of samples says of itself, and its sum."""

    form: str
    interval: float
    sums: tuple[int, int]

    @classmethod
    def of(cls, file: BinaryIO) -> Beside | None:
        """Read all of a file, then go to its first rapid; None where it is no file of samples."""
        file.seek(0)
        digest = hashlib.blake2b(digest_size=6)
        while data := file.read(PIECE):
            digest.update(data)
        file.seek(0)
        match = _HEAD.fullmatch(file.readline(200))
        if match is None or match[1].decode() not in FORMS:
            return None
        sums = digest.digest()
        parts = int.from_bytes(sums[:3], "big"), int.from_bytes(sums[3:], "big")
        try:
            return cls(match[1].decode(), float(match[2]), parts)
        except ValueError:
            return None


def beginning(file: BinaryIO) -> str:
    """How a file begins that is no file of samples, for people."""
    file.seek(0)
    line = file.readline(200)
    if not line:
        return "it is empty"
    if _HEAD.fullmatch(line.removesuffix(b"\r\n") + b"\n"):
        return "its lines end with CR LF, as behind a copy that was made as text"
    return f"it begins with {line[:40].rstrip()!r}"


class HalAlignment(Alignment):
    """The walk through both programs, for one that asks for rapids by number."""

    remembers = False
    beside: Beside
    opened = False
    """The lines that name the file of samples were read."""

    def check_opening(self) -> None:
        """See that a program that asks for rapids names its file of samples."""
        if self.rewritten and not self.opened:
            self.found.add(
                Kind.SAMPLES, None, None, "no line in front of all names the file of samples"
            )

    def _stamp(self) -> None:
        """Pass the stamp, and the lines below it."""
        before = self._stamp_line
        super()._stamp()
        if self._stamp_line == before:
            return
        self.opened = True
        wanted = [b"M68 E3 Q0", b"M152 P%08d Q%08d" % self.beside.sums]
        wanted += [b"M52 P1"] if self.beside.form == ADAPTIVE else []
        for line in wanted:
            found = self.processed.peek_line()
            if found != line + self.program.newline:
                shown = found[:60].rstrip(b"\r\n").decode("latin-1")
                problem = f"expected '{line.decode()}' in front of all, found '{shown}'"
                if found.startswith(b"M152"):
                    other = "the file of samples is not the one that was written with this program"
                    self._complain(Kind.SAMPLES, f"{other}, or was changed since: {problem}")
                else:
                    self._complain(Kind.FORM, problem)
            self.processed.skip(len(found))

    def _reader(self, i: int, text: bytes) -> StreamReader:
        reader = HalReader(*self._of_reader(i, text))
        reader.adaptive = self.beside.form == ADAPTIVE
        reader.interval = self.beside.interval
        return reader


class HalReader(StreamReader):
    """Reads the lines in the place of one rapid."""

    adaptive = True
    interval = 0.001

    def read(self) -> Stream | None:
        """Read all of it; None where that is not possible."""
        self._comment()
        for m in self.allowed.unknown_m:
            self.complain(Kind.NOT_CERTAIN, f"nobody knows when M{m:g} runs beside this rapid")
        if not self._head():
            return None
        first = self.window.line
        points = self._adaptive() if self.adaptive else self._position()
        if points is None:
            return None
        return Stream(self.i, self.original_line, first, "", b"", points)

    def _motion(self, code: int, more: bool = True) -> dict[str, Decimal] | None:
        """Pass a block of one motion; its numbers."""
        line = self.peek()
        words = read_words(line)
        ending = None
        if words and code == 0 and words[1:2] and words[1][0] == "G":
            ending = int(words.pop(1)[1] * 10)
        numbers = dict(words[1:]) if words else {}
        feeds = "F" in numbers
        if (
            not words
            or words[0] != ("G", Decimal(code))
            or len(numbers) != len(words) - 1
            or feeds != (code == 1)
            or not set(numbers) <= {*"XYZF"}
            or not set(numbers) - {"F"}
        ):
            shown = line[:60].decode("latin-1")
            self.complain(Kind.FORM, f"expected a block with G{code}, found '{shown}'")
            return None
        self.ending = ending
        self.last(more)
        return numbers

    def _adaptive(self) -> list[dict[str, Decimal]] | None:
        """The tiny blocks, the rapid, its own words."""
        words = read_words(self.peek()) or []
        codes = [value * 10 for letter, value in words if letter == "G"]
        if words and not any(letter in "XYZ" for letter, _ in words):
            problem = self._apply(words) or self.allowed.setup_problem(words)
            if problem or len(codes) != len(words):
                self.complain(Kind.FORM, f"{problem or 'more than modes'} in front of the points")
                return None
            self.next()
        self._modes_of_points()
        points: list[dict[str, Decimal]] = []
        for code in _TINY:
            if code is None:
                if not self.exactly(b"M67 E3 Q%d" % (self.i + 1)):
                    return None
                continue
            numbers = self._motion(code)
            if numbers is None:
                return None
            if self.ending is not None and len(points) < 4:
                self.complain(Kind.FORM, "a G code stands beside the G0 of a tiny block")
            if len(points) < 4 and set(numbers) - {"F"} != self.allowed.axes:
                self.complain(Kind.AXES, "points name other axes than those that move")
            points.append(numbers)
        self._end_of_points(self.ending)
        self.modes.motion, self.modes.feed = 0, None
        return points if self._tail() else None

    def _asks(self) -> bool:
        """Pass the request for the samples, which are ways of X, Y and Z from where they begin.

        It has to miss the rapid's number where a turned coordinate system would turn them (R of the
        nine: #5230, #5250 to #5390), and where the machine stands elsewhere by half of 1e-6.
        """
        line, rapids, i = self.peek(), self.rapids, self.i
        begin = b"M68 E3 Q[%d+1000000*[ABS[#[5210+20*#5220]]" % (i + 1)
        unit = MM_PER_INCH if rapids.inch[i] else 1.0
        axes = [] if rapids.incremental[i] else sorted(self.allowed.axes & {*"XYZ"})
        places = _PLACES.findall(line[len(begin) :])
        starts = {letter: float(rapids.start[i, AXES.index(letter)]) / unit for letter in axes}
        wanted = [(b"%d" % (5420 + "XYZ".index(letter)), at) for letter, at in starts.items()]
        good = (
            line == begin + b"".join(b"+ABS[#%b%b]" % place for place in places) + b"]]"
            and [axis for axis, _ in places] == [axis for axis, _ in wanted]
            and all(
                abs(float(less or b"0") + at) <= 1e-9 + 1e-12 * abs(at)
                for (_, less), (_, at) in zip(places, wanted, strict=True)
            )
        )
        if not good:
            signed = [(axis.decode(), f"{-at:+.10g}" if at else "") for axis, at in wanted]
            where = "".join(f"+ABS[#{axis}{less}]" for axis, less in signed)
            shown = line[:120].decode("latin-1")
            self.complain(Kind.FORM, f"expected '{begin.decode()}{where}]]', found '{shown}'")
            return False
        self.last(more=True)
        return True

    def _position(self) -> list[dict[str, Decimal]] | None:
        """LinuxCNC's own rapid, between asking and waiting."""
        rest = b"G4 P%g" % (REST * self.interval)
        if not self.exactly(rest) or not self._asks():
            return None
        numbers = self._motion(0)
        if numbers is None:
            return None
        if self.ending != self.allowed.ending:
            self.complain(Kind.PATH, "the rapid has another G code beside its G0")
        stops: Sequence[tuple[str, float]] = self.allowed.behind
        if not self.exactly(b"M66 P3 L3 Q3600", more=bool(stops)):
            return None
        if stops:
            written = read_words(self.peek()) or []
            if [(letter, float(value)) for letter, value in written] != list(stops):
                wanted = " ".join(f"{letter}{value:g}" for letter, value in stops)
                self.complain(Kind.STOP, f"expected {wanted}, which the block holds")
                return None
            self.last(more=False)
        return [numbers]
