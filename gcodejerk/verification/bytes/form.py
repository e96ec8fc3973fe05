"""The text that stands in the place of a rapid, read back.

This module owns the form: which lines may follow each other, and a small machine for the modal
words that may stand in them (motion, distance, feed, path). What a line would do is judged first,
so that a message says what would happen; then the line has to hold exactly the words that may stand
there (`allowed`).

Rule: what it cannot read it does not guess. `read_stream` then returns None, and the walk ends.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from decimal import Context, Decimal
from functools import lru_cache

from gcodejerk.axes import AXES
from gcodejerk.nc import Block, Dialect, Rapids, parse_block
from gcodejerk.verification.bytes.allowed import Allowed, point_pattern, point_problem, too_long
from gcodejerk.verification.bytes.modes import WORD, Modes, read_words
from gcodejerk.verification.bytes.source import PIECE, Window
from gcodejerk.verification.findings import Findings, Kind

LINE_ENDS = (b"", b"\n", b"\r\n", b"\r")
"""By `Rapids.terminator`."""
COMMENT_LENGTH = 69
LINES_AT_ONCE = 512
LONGEST_STREAM = 1 << 26
"""Bytes of one stream; more is not read."""

_IS_POINT = re.compile(rb"[ \t]*G0?1(?![0-9.])")
_COMMENT = re.compile(rb"(?:\(gcodejerk: ([ -'*-~]*)\)|; gcodejerk: ([ -'*-~]*))")
# Zero is zero with a decimal point and without.
_WHOLE = re.compile(rb"[A-FH-Z][ \t]*[-+]?0*[1-9][0-9]*(?![0-9.])")
_EXACT = Context(prec=200)
_G1 = [("G", Decimal(1))]


@dataclass(slots=True)
class Stream:
    """What stands in the place of one rapid."""

    rapid: int
    """Index into the original's rapids."""
    original_line: int
    line: int
    """Of the first point, or of what leads into it, in the processed file."""
    letters: str
    """Axes of the points in `text`, in the order written."""
    text: bytes
    """The points that are written alike."""
    rest: list[dict[str, Decimal]] = field(default_factory=list)
    """The points after these, by letter, F included."""
    lead: list[dict[str, Decimal]] = field(default_factory=list)
    """What stands in front of the points and moves an axis a little, by letter."""
    own_end: bool = False
    """The last point has the very words of the block, and the points name no other axes."""

    @property
    def ends(self) -> dict[str, Decimal]:
        """Where the stream ends, or, in increments, how far it goes, exactly."""
        ends: dict[str, Decimal] = {}
        if self.letters and not self.rest:
            last = self.text.rstrip().rpartition(b"\n")[2]
            ends.update(dict(read_words(last) or ()))
        for words in self.rest:
            ends.update(words)
        return ends

    def sums(self) -> dict[str, Decimal]:
        """Sum of the numbers of each axis, exactly."""
        sums = dict.fromkeys(self.letters, Decimal(0))
        for letter, number in WORD.findall(self.text):
            axis = letter.decode()
            if axis in sums:
                sums[axis] = _EXACT.add(sums[axis], Decimal(number.decode()))
        for words in (*self.lead, *self.rest):
            for axis, number in words.items():
                sums[axis] = _EXACT.add(sums.get(axis, Decimal(0)), number)
        return sums


def head_of(
    block: Block, text: bytes, dialect: Dialect, *, fed: bool = False
) -> tuple[bytes, bool]:
    """Take out of a block what stands elsewhere; what is left, and whether it says anything."""
    axes = AXES + "".join(dialect.increments)
    exact = None if dialect.exact_stop is None else dialect.exact_stop / 10
    out = [
        w
        for w in block.words
        if w.letter in axes
        or (w.letter == "M" and w.value in dialect.after_m)
        or (w.letter == "G" and w.value == exact)
        or (w.letter == "G" and w.value == 1.0 and fed)
    ]
    kept, at = [], 0
    for word in sorted(out, key=lambda w: w.begin):
        kept.append(text[at : word.begin])
        at = word.end
    kept.append(text[at:])
    left = [w for w in block.words if w not in out and not (w.letter == "G" and w.value == 0.0)]
    return b"".join(kept), bool(left or block.comments)


@lru_cache(maxsize=256)
def run_of(point: bytes, line_end: bytes) -> re.Pattern[bytes]:
    """Points of one pattern, one after another, at most LINES_AT_ONCE of them.

    A repeat remembers every turn that it could still take back; so it is bounded, and repeated.
    """
    line = rb"(?:" + point + re.escape(line_end) + rb")"
    return re.compile(line + rb"{1,%d}" % LINES_AT_ONCE)


def _run_end(pattern: re.Pattern[bytes], data: bytes, begin: int, end: int) -> int:
    """Where the lines end that a pattern of `run_of` matches one behind the other."""
    while match := pattern.match(data, begin, end):
        begin = match.end()
    return begin


class StreamReader:
    """Reads one replacement; what is wrong with its form goes to the findings."""

    def __init__(
        self,
        window: Window,
        rapids: Rapids,
        i: int,
        text: bytes,
        newline: bytes,
        found: Findings,
        dialect: Dialect,
        decimals: Mapping[str, int],
        follows: bool,
    ) -> None:
        self.dialect, self.decimals = dialect, decimals
        self.window, self.rapids, self.i, self.text, self.found = window, rapids, i, text, found
        self.original_line = int(rapids.line[i])
        last = LINE_ENDS[int(rapids.terminator[i])]
        self.last_end = last
        self.line_end = last if last.endswith(b"\n") else newline
        self.block = parse_block(text, dialect)
        self.modes = Modes.after(rapids, i)
        self.allowed = Allowed.of(rapids, i, self.block, dialect, follows)

    def complain(self, kind: Kind, problem: str, line: int | None = None) -> None:
        """Note what is wrong."""
        self.found.add(kind, line or self.window.line, self.original_line, problem)

    def peek(self) -> bytes:
        """Look at the next line without its end."""
        return self.window.peek_line().rstrip(b"\r\n")

    def _measure(self, length: int) -> None:
        """What is written fits into the lines that the control reads."""
        if length > self.allowed.limit:
            limit = f"{self.allowed.limit} characters"
            self.complain(Kind.FORM, f"line of {length} characters, the control reads {limit}")

    def next(self) -> None:
        """Go to the next line; the end of this one must be the block's."""
        line = self.window.peek_line()
        self._measure(len(line.rstrip(b"\r\n")))
        if not line.endswith(self.line_end) or line.endswith(b"\r" + self.line_end):
            self.complain(Kind.LINE_END, f"line end is not {self.line_end!r} as in the original")
        self.window.skip(len(line))

    def exactly(self, wanted: bytes, more: bool = True) -> bool:
        """Pass a line that can only be this one."""
        line = self.peek()
        if line != wanted:
            shown = line[:60].decode("latin-1")
            self.complain(Kind.FORM, f"expected '{wanted.decode()}', found '{shown}'")
            return False
        self.last(more)
        return True

    def last(self, more: bool) -> None:
        """Pass the end of a line that may be the last one, whose end is the block's own."""
        if more:
            self.next()
            return
        line = self.window.peek_line()
        if self.last_end.endswith(b"\n"):
            self.next()
            return
        self._measure(len(line.rstrip(b"\r\n")))
        if line.rstrip(b"\r\n") + self.last_end != line:
            self.complain(Kind.LINE_END, "the file's last line does not end as it did")
        self.window.skip(len(line))

    def read(self) -> Stream | None:
        """Read all of it; None where that is not possible."""
        self._comment()
        for m in self.allowed.unknown_m:
            self.complain(Kind.NOT_CERTAIN, f"nobody knows when M{m:g} runs beside this rapid")
        if not self._head() or not self._setup():
            return None
        stream = self._points()
        if stream is None or not self._tail():
            return None
        return stream

    def _comment(self) -> None:
        line = self.peek()
        if not line.startswith((b"(gcodejerk:", b"; gcodejerk:")):
            return
        match = _COMMENT.fullmatch(line)
        words = b"".join(b"".join(w.text.split()) for w in self.block.words)
        named = bytes(c if 32 <= c < 127 and c not in b"()" else ord("?") for c in words)
        writing = self.dialect.writing
        spelled = writing is not None and line.startswith(writing.comment[0] + b"gcodejerk:")
        if match is None or len(line) > COMMENT_LENGTH or not spelled:
            self.complain(Kind.COMMENT, "comment is not one of ours, or too long")
        else:
            shown = match[1] or match[2] or b""
            body = shown.replace(b" ", b"")
            cut = body.endswith(b"...") and len(body) > 3
            if not (named.startswith(body[:-3]) if cut else named == body):
                self.complain(Kind.COMMENT, f"comment names {shown!r}, not the replaced block")
        self.next()

    def _head(self) -> bool:
        fed = bool(self.rapids.fed[self.i])
        head, needed = head_of(self.block, self.text, self.dialect, fed=fed)
        line = self.peek()
        if line in (head, head.rstrip(b" \t")) and line.strip():
            self.next()
            return True
        if needed:
            shown = head.decode("latin-1").strip()
            self.complain(
                Kind.HEAD, f"expected the block's other words, '{shown}', and nothing else"
            )
        return not needed

    def _apply(self, words: list[tuple[str, Decimal]]) -> str | None:
        """Execute a line of modal words; what is wrong with it."""
        return self.modes.apply(words, self.dialect)

    def _setup(self) -> bool:
        """Pass the lines in front of the points."""
        writing, lines = self.dialect.writing, []
        for _ in range(4):
            line = self.peek()
            if _IS_POINT.match(line):
                break
            words = read_words(line)
            problem = "this is no line of a stream" if words is None else self._apply(words)
            if problem:
                shown = line[:60].decode("latin-1")
                self.complain(Kind.FORM, f"{problem}: '{shown}'")
                return False
            lines.append(line)
            self.next()
        before = len(self.found.violations)
        self._modes_of_points()
        if len(self.found.violations) == before and writing is not None:
            self._exact_setup(lines, writing.standstill)
        return True

    def _exact_setup(self, lines: list[bytes], standstill: bytes) -> None:
        """The lines in front of the points hold what they have to, and nothing else."""
        stands = bool(lines) and lines[-1] == standstill
        rest = lines[:-1] if stands else lines
        if stands != self.allowed.standstill:
            how = "missing" if self.allowed.standstill else "not needed"
            self.complain(Kind.FORM, f"'{standstill.decode()}' in front of the points is {how}")
        elif len(rest) > 1:
            self.complain(Kind.FORM, "modes of a stream stand in one line")
        elif rest and (problem := self.allowed.setup_problem(read_words(rest[0]) or [])):
            self.complain(Kind.FORM, f"{problem}: '{rest[0][:60].decode('latin-1')}'")

    def _modes_of_points(self) -> None:
        """What is in force is what a stream needs."""
        modes = self.modes
        if modes.feed_mode != 94:
            self.complain(Kind.MODE, f"feed mode is G{modes.feed_mode or '?'}, a stream needs G94")
        if modes.path in (61, 62):
            self.complain(Kind.MODE, "exact stop or exact path is in force, a stream needs G64")
        if (modes.distance == 91) != bool(self.rapids.incremental[self.i]):
            self.complain(Kind.MODE, "distance mode is not that of the original")

    def _points(self) -> Stream | None:
        """Read the points: those written alike in one go, the others one by one."""
        first = self.window.line
        words = read_words(self.peek())
        if words is None or not words or words[0] != ("G", Decimal(1)):
            self.complain(Kind.FORM, "points of a stream are missing")
            return None
        letters = "".join(letter for letter, _ in words[1:-1])
        stream = Stream(self.i, self.original_line, first, "", b"")
        if words[-1][0] == "F" and set(letters) <= {*AXES} and len(set(letters)) == len(letters):
            stream.letters = letters
            stream.text = self._take_alike(letters)
        ending, early = None, False
        while _IS_POINT.match(line := self.peek()):
            early |= ending is not None
            point = self._point(line)
            if point is None:
                return None
            ending, by_letter = point
            stream.rest.append(by_letter)
            if len(stream.rest) > PIECE:
                self.complain(Kind.FORM, "stream is endless")
                return None
            self._points_in(line)
            if problem := point_problem(line, self.text, self.dialect):
                self.complain(Kind.FORM, problem)
            self.next()
        self._points_in(stream.text)
        if len(stream.rest) > 1 or early:
            self.complain(Kind.FORM, "points before the last are not written alike", first)
        if stream.text and stream.rest and set(stream.letters) != self.allowed.axes:
            self.complain(Kind.AXES, "points name other axes than those that move", first)
        self._measure(max(map(len, stream.text.splitlines()), default=0))
        self._end_of_points(ending)
        self.modes.motion, self.modes.feed = 1, None
        return stream

    def _take_alike(self, letters: str) -> bytes:
        """Pass the points that are written alike, however many; their text."""
        window, size = self.window, 1 << 13
        while True:
            have = window.fill(size)
            pattern = self.run(letters)
            end = _run_end(pattern, window.data, window.at, window.at + have)
            if have < size or end < window.at + have - 512 or size > LONGEST_STREAM:
                break
            size *= 4
        text = window.data[window.at : end]
        window.skip(len(text))
        return text

    def _point(self, line: bytes) -> tuple[int | None, dict[str, Decimal]] | None:
        """The G code beside the G1 of a point, and its numbers; None where it is no point."""
        words, ending = read_words(line), None
        if words and words[1:2] and words[1][0] == "G":
            ending = int(words.pop(1)[1] * 10)
        by_letter = dict(words[1:]) if words else {}
        if not words or words[0] != ("G", Decimal(1)) or len(by_letter) != len(words) - 1:
            self.complain(Kind.FORM, f"this is no point: '{line[:60].decode('latin-1')}'")
            return None
        if "F" not in by_letter or not set(by_letter) <= {*AXES, "F"}:
            self.complain(Kind.FORM, "a point holds axis words and F, nothing else")
            return None
        return ending, by_letter

    def run(self, letters: str) -> re.Pattern[bytes]:
        """Points with these axes, spelled as they may be."""
        inch = bool(self.rapids.inch[self.i])
        return run_of(point_pattern(letters, self.decimals, self.dialect, inch), self.line_end)

    def _end_of_points(self, ending: int | None) -> None:
        """The last point ends in a standstill where the rapid did."""
        wanted = self.allowed.ending
        if ending != wanted:
            name = "no G code" if wanted is None else f"G{wanted / 10:g}"
            line = self.window.line - 1
            self.complain(Kind.PATH, f"the last point has {name} beside its G1", line)
        elif wanted is not None and wanted in self.dialect.paths:
            self.modes.path = self.dialect.paths[wanted]

    def _points_in(self, text: bytes) -> None:
        """Where X12 may be 12 steps of the control, every length has its decimal point."""
        if self.dialect.whole_numbers == "machine" and (match := _WHOLE.search(text)):
            shown = match[0].decode("latin-1")
            self.complain(Kind.FORM, f"{shown} has no decimal point: the control may scale it")

    def _tail(self) -> bool:
        line = self.window.peek_line().rstrip(b"\r\n")
        words = read_words(line)
        problem = "the modes are not restored" if words is None else self._apply(words)
        if problem:
            self.complain(Kind.FORM, f"{problem}: '{line[:60].decode('latin-1')}'")
            return False
        before = len(self.found.violations)
        wanted = Modes.after(self.rapids, self.i)
        self._compare(wanted)
        self._same_scale(line)
        # Points are G1: where that stays in force, nothing restores it.
        problem = self.allowed.tail_problem(_G1[: wanted.motion] + (words or []))
        if problem and len(self.found.violations) == before:
            self.complain(Kind.FORM, f"{problem}: '{line[:60].decode('latin-1')}'")
        if problem := too_long(line, b""):
            self.complain(Kind.FORM, problem)
        self.last(more=bool(self.allowed.behind))
        return self._stops()

    def _stops(self) -> bool:
        """Pass what the control runs when the motion has ended."""
        stops = list(self.allowed.behind)
        if stops:
            line = self.window.peek_line().rstrip(b"\r\n")
            written = read_words(line) or []
            if [(letter, float(value)) for letter, value in written] != stops:
                wanted = " ".join(f"{letter}{value:g}" for letter, value in stops)
                self.complain(Kind.STOP, f"expected {wanted}, which the block holds")
                return False
            self.last(more=False)
        return True

    def _same_scale(self, line: bytes) -> None:
        """F is restored as it was written: with a decimal point or without."""
        whole = _WHOLE.search(line) is not None
        wanted = bool(self.rapids.feed_whole[self.i] and self.rapids.feed[self.i])
        if self.dialect.whole_numbers == "machine" and b"F" in line and whole != wanted:
            how = "without" if whole else "with"
            self.complain(Kind.FEED_RESTORED, f"F is restored {how} a decimal point")

    def _compare(self, wanted: Modes) -> None:
        """Compare what is in force after the stream with what was after the block."""
        modes = self.modes
        if modes.motion != wanted.motion:
            wrong = f"G{modes.motion} stays in force, the original has G{wanted.motion} here"
            self.complain(Kind.MOTION, wrong)
        if modes.distance != wanted.distance:
            self.complain(
                Kind.DISTANCE,
                f"G{modes.distance} stays in force, the original has G{wanted.distance}",
            )
        if modes.feed_mode != wanted.feed_mode:
            self.complain(
                Kind.FEED_MODE, f"G{modes.feed_mode} stays in force, not G{wanted.feed_mode or '?'}"
            )
        if wanted.feed_mode != 93 and (wanted.feed is not None or self.rapids.feed_needed[self.i]):
            if wanted.feed is None:
                self.complain(
                    Kind.FEED_RESTORED, "F is needed later and not known, so not restorable"
                )
            elif modes.feed != wanted.feed:
                is_now = "that of the stream" if modes.feed is None else f"F{modes.feed}"
                self.complain(
                    Kind.FEED_RESTORED, f"F is {is_now}, the original has F{wanted.feed} in force"
                )
        path, original = (modes.path, modes.p, modes.q), (wanted.path, wanted.p, wanted.q)
        if not all(a == b or (a != a and b != b) for a, b in zip(path, original, strict=True)):
            self.complain(
                Kind.PATH, f"path mode is {_path(path)}, the original has {_path(original)}"
            )


def _path(path: tuple[int, float, float]) -> str:
    code, p, q = path
    name = {0: "unknown", 61: "G61", 62: "G61.1", 64: "G64"}.get(code, f"G{code}")
    return name + (f" P{p:g}" if p == p else "") + (f" Q{q:g}" if q == q else "")
