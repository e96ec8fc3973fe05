"""Proof that a program with its drilling cycles written out makes the moves that they call for.

Both files are walked side by side, each block of the original against what stands in its place.
What a cycle means, `holes` says; nothing is shared with the room that writes cycles out
(`gcodejerk.cycles`) but the reading of the original: its words, and what is in force there.

Rule: a series is written out whole or not at all; everything else is kept byte for byte.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import BinaryIO

from gcodejerk.axes import AXES
from gcodejerk.nc import Block, Dialect, Start, find_dialect, parse_block
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import G17, G91
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.program import plain_lines, read_chunk, split_lines
from gcodejerk.nc.reader import Reader
from gcodejerk.nc.text.chunks import Chunk, read_chunks
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.cycles.called import check_calls, has_calls
from gcodejerk.verification.cycles.controls import comes_from_elsewhere, control_of, cycle_of
from gcodejerk.verification.cycles.holes import (
    CLOSE,
    QUIET_G,
    STOPS,
    Doubt,
    Event,
    Height,
    Series,
    begin_series,
    calls_for,
    doubt_of,
    number_of,
    read_event,
    same,
    stays,
    told,
    with_rests,
)
from gcodejerk.verification.cycles.lines import OriginalLine, WrittenLines, squeezed
from gcodejerk.verification.findings import Findings, Kind, Verification
from gcodejerk.verification.second_reading.agreement import Context, confirm_contexts

_CANDIDATE = re.compile(rb"[gG][0+ \t]*[678]|[mMoO#\[%]")
_PATH = re.compile(rb"G64((?: [PQ]\d*(?:\.\d*)?)*)")


def check_expansion(
    original: BinaryIO,
    expanded: BinaryIO,
    *,
    dialect: str | Dialect = "linuxcnc",
    start: Start | None = None,
    names: tuple[str, str] = ("<original>", "<expanded>"),
    most: int = 100,
) -> Verification:
    r"""Compare a program with the same program after its cycles were written out.

    Parameters
    ----------
    original, expanded : BinaryIO
        Opened for reading bytes, at their beginning; the original seekable, since it is read twice.
    dialect : str or Dialect, optional
        How the original is written.
    start : Start, optional
        What it may assume.
    names : tuple of str, optional
        For messages.
    most : int, optional
        Violations after which it stops; the walk ends at the first one that it cannot pass.

    Returns
    -------
    Verification
        `rapids` are the blocks of cycles, `rewritten` those that are written out.

    Examples
    --------
    >>> import io
    >>> program = b"G21 G90 G61 G98 F100\nG0 X0 Y0 Z10\nG81 X5 Z-3 R2\nG80\nM2\n"
    >>> moves = b"G0 X5\nG0 Z2\nG1 Z-3\nG0 Z10\n"
    >>> written = program.replace(b"G81 X5 Z-3 R2\n", moves)
    >>> check_expansion(io.BytesIO(program), io.BytesIO(written)).ok
    True
    >>> damaged = written.replace(b"Z-3", b"Z-3.1")
    >>> found = check_expansion(io.BytesIO(program), io.BytesIO(damaged)).violations
    >>> str(found[0].kind), found[0].line, found[0].original_line
    ('moves of a cycle', 5, 3)
    """
    begin = original.tell()
    chosen, start = find_dialect(dialect), Start() if start is None else start
    if has_calls(chosen):
        return check_calls(original, expanded, chosen, start, names, most)
    proof = _Proof(Window(expanded), chosen, start, most)
    if proof.control.beside:
        proof.jumps = comes_from_elsewhere(original)
        original.seek(begin)
    for chunk in read_chunks(original, names[0]):
        if not proof.take(chunk):
            break
    else:
        proof.end()
    # Where the tool stands in front of a hole, and in which modes, has so far one reader's word.
    original.seek(begin)
    confirmed = confirm_contexts(original, dialect, start, proof.contexts, proof.found)
    return Verification(
        proof.holes, proof.written, proof.kept, proof.found.sorted(), names, confirmed
    )


class _Proof:
    """Side by side through both files."""

    def __init__(self, theirs: Window, dialect: Dialect, start: Start, most: int) -> None:
        self.theirs, self.dialect = theirs, dialect
        self.control = control_of(dialect, start)
        self.reader = Reader("<original>", dialect, start)
        self.found = Findings(most)
        self.jumps = False
        """A hole may be reached from elsewhere than the block in front of it."""
        self.holes = self.written = self.kept = 0
        self.series: Series | None = None
        self.turning = 0
        self.lent = False
        """The P stated last is one that the controller does not read any more."""
        self.path: dict[str, Fraction] | None = None
        """P and Q of the G64 in force [mm]; None where they are not known."""
        self.newline = b""
        self.contexts: list[Context] = []
        if start.startup:
            self._remember(
                parse_block(start.startup.encode("latin-1", "replace"), dialect), sure=True
            )

    def take(self, chunk: Chunk) -> bool:
        """Walk over a chunk of the original; whether the walk can go on."""
        if not self.newline:
            head = chunk.data.split(b"\n", 1)[0]
            self.newline = b"\r\n" if head.endswith(b"\r") else b"\n"
        plain = self.series is None and not _CANDIDATE.search(chunk.data)
        if plain and self.theirs.peek(len(chunk.data)) == chunk.data:
            self.theirs.skip(len(chunk.data))
            read_chunk(self.reader, chunk, plain_lines(chunk, self.reader.dialect))
            self.kept += chunk.feeds
            return True
        return all(self._line(*line) for line in split_lines(chunk))

    def end(self) -> None:
        """Behind the last line of the original."""
        if not self.theirs.ended:
            rest = self.theirs.peek_line()[:60].decode("latin-1").strip()
            self.found.add(
                Kind.ADDED, self.theirs.line, None, f"the original ends, here follows '{rest}'"
            )

    def _line(self, text: bytes, begin: int, number: int, terminator: int) -> bool:
        """Take one line of the original; whether the walk can go on."""
        cycle = cycle_of(self.reader.state, self.dialect)
        line = self._read(text, begin, number, terminator)
        if not line.ended:
            self._remember(line.block, sure=line.sure)
            self._begin_series(line, cycle)
        if not self._is_kept(line.whole):
            if line.hole:
                modes = _modes(self.reader.state, motion=self.control.beside)
                self.contexts.append(Context(number, line.here, modes))
            return self._written(line)
        self.theirs.skip(len(line.whole))
        self.kept += 1
        if line.ended:
            return True
        if self.lent and self._borrows(line):
            return self._complain(Kind.SERIES, number, "the dwell of a later cycle gets lost")
        return self.series is None or self._kept_in(self.series, line)

    def _read(self, text: bytes, begin: int, number: int, terminator: int) -> OriginalLine:
        """Let the first reading take a line, and ask what it was."""
        reader = self.reader
        here, ended = list(reader.state.position), reader.state.ended
        problems, inside = reader.problem_count, reader.inside
        reader.read_line(text, begin, number, terminator)
        bare = text.removesuffix(b"\r")
        block = parse_block(bare, self.dialect)
        sure = problems == reader.problem_count and not (inside or reader.inside)
        sure = sure and not (block.block_delete or block.assigns or block.o_word is not None)
        sure = sure and all(word.value is not None for word in block.words)
        drills = cycle_of(reader.state, self.dialect) is not None
        hole = sure and drills and any(word.letter in AXES for word in block.words)
        return OriginalLine(bare, text + b"\n" * terminator, number, block, here, ended, sure, hole)

    def _begin_series(self, line: OriginalLine, cycle: int | None) -> None:
        """Note where a series begins; `cycle` was in force in front of the line."""
        state = self.reader.state
        if self.series is None and cycle_of(state, self.dialect) is not None:
            self.series = begin_series(line.here, state, self.control)
            if cycle is not None:
                self.series.doubt = "it began before the program"

    def _kept_in(self, series: Series, line: OriginalLine) -> bool:
        """A line of a series that is kept; whether the walk can go on."""
        state, number = self.reader.state, line.number
        in_cycle = cycle_of(state, self.dialect) is not None
        if line.hole and not self._takes_axes(line):
            self.holes += 1
            series.dwelt |= line.dwells
            if series.written:
                return self._complain(Kind.CYCLE, number, "a hole of the series is not written out")
            series.written = False
            self.lent = self.lent and not line.dwells
        elif not line.sure:
            series.doubt = series.doubt or f"line {number} is not certain"
            if series.written:
                return self._complain(Kind.SERIES, number, "it may make a hole, or end the series")
        elif in_cycle and not self._quiet(line.block):
            series.doubt = series.doubt or f"line {number} stands between its holes"
            if series.written and not self.control.watched:
                return self._complain(Kind.SERIES, number, "it may run a program that drills")
        if not in_cycle or state.ended:
            # The end of a series must be one beyond doubt, or a later block may be a hole.
            closes = state.ended or not {"motion", "cycle"}.isdisjoint(self._groups(line))
            self.series = None
            if series.written and not closes:
                return self._complain(Kind.SERIES, number, "its end is not certain")
        return True

    def _is_kept(self, line: bytes) -> bool:
        """Whether the other file goes on with this very line."""
        if self.theirs.peek(len(line)) != line:
            return False
        return line.endswith(b"\n") or len(self.theirs.peek(len(line) + 1)) == len(line)

    def _groups(self, line: OriginalLine) -> set[str | None]:
        """Modal groups of the codes of a line."""
        return {self.dialect.groups.get(round((code or 0.0) * 10)) for code in line.codes}

    def _takes_axes(self, line: OriginalLine) -> bool:
        """Whether the axis words of a line belong to another code than the cycle in force."""
        if self.control.beside:
            return "non-modal" in self._groups(line)
        return any(code in (10, 28, 30, 52, 92) for code in line.codes)

    def _borrows(self, line: OriginalLine) -> bool:
        """Whether a block may drill with the P of an earlier cycle, or call what does."""
        if any(code in self.control.lent for code in line.codes):
            return not line.dwells
        return line.block.o_word == "call" or any(
            word.letter == "M" and word.value == 98 for word in line.block.words
        )

    def _quiet(self, block: Block) -> bool:
        """Whether a block may stand between two holes."""
        return all(
            (w.letter == "G" and w.value in QUIET_G | {4})
            or (w.letter == "M" and w.value in self.control.switches - {2, 30} | {0, 1, 60})
            or w.letter in self.control.letters + ("" if self.control.beside else "P")
            for w in block.words
        )

    def _written(self, line: OriginalLine) -> bool:
        """A line that is not kept: the moves of a hole, or a violation."""
        theirs = self.theirs.peek_line()[:60].decode("latin-1").rstrip()
        series, number = self.series, line.number
        if series is None or not line.hole:
            mine = line.whole[:60].decode("latin-1").rstrip()
            problem = f"expected '{mine}' as in the original, found '{theirs}'"
            if not self.theirs.peek(1):
                return self._complain(Kind.MISSING, number, f"file ends where '{mine}' follows")
            return self._complain(Kind.CHANGED, number, problem)
        self.holes += 1
        code = cycle_of(self.reader.state, self.dialect)
        doubt = series.doubt or doubt_of(series, self.reader.state, code, line.here)
        doubt = "the program jumps" if self.jumps else doubt
        if series.written is False:
            doubt = "an earlier hole of the series is not written out"
        if doubt is not None:
            return self._uncertain(number, doubt)
        series.written = True
        self.written += 1
        self.lent = self.lent or (line.dwells and bool(self.control.lent))
        series.dwelt |= line.dwells
        wanted = calls_for(series, line.block, self.reader.state, code or 0, self.turning)
        if isinstance(wanted, Doubt):
            return self._uncertain(number, wanted.reason)
        return self._moves(series, wanted, line)

    def _moves(self, series: Series, wanted: list[list[Event]], line: OriginalLine) -> bool:
        """Compare what stands in the place of a hole's block with what the block calls for."""
        state, number, lines = self.reader.state, line.number, WrittenLines(self.theirs)
        if lines.peek().startswith(b"(gcodejerk: "):
            comment = lines.next()
            if not (comment.endswith(b")") and comment.count(b"(") == comment.count(b")") == 1):
                return self._complain(Kind.COMMENT, number, "not one closed comment")
        plane = PLANES[state.plane or G17]
        head, stops = self._head(
            line.text, line.block, {*plane, "R", self.control.repeats, "P", "Q"}
        )
        if head and squeezed(lines.peek()) != head:
            return self._complain(Kind.HEAD, number, f"expected '{head.decode('latin-1')}'")
        if head:
            lines.next()
        if not self._in_exact_path(series, wanted, lines, number):
            return False
        if stops and lines.next().split() != stops:
            return self._complain(Kind.STOP, number, "its stop is lost")
        last = line.whole[len(line.text) :]
        if lines.ends and not lines.well_ended(last if b"\n" in last else self.newline, last):
            return self._complain(Kind.LINE_END, number, "lines do not end as the block did")
        return True

    def _in_exact_path(
        self, series: Series, wanted: list[list[Event]], lines: WrittenLines, number: int
    ) -> bool:
        """Compare the moves, and how they come to exact path mode and back."""
        state = self.reader.state
        if self.control.beside:
            return self._compare(series, wanted, lines, number) and self._motion_restored(
                wanted[0], lines, number
            )
        if state.path in (61, 62):
            return self._compare(series, wanted, lines, number)
        if state.path != 64 or self.path is None:
            # Where the path mode is not known, a rest behind every move does what G61 would.
            rests = [[*with_rests(events)] for events in wanted]
            return self._compare(series, rests, lines, number)
        if lines.next() != b"G61":
            return self._complain(Kind.MODE, number, "cycles run in exact path mode: no G61")
        if not self._compare(series, wanted, lines, number):
            return False
        if not self._path_restored(lines.next(), state):
            return self._complain(Kind.PATH, number, "the path mode of the program does not return")
        return True

    def _motion_restored(self, events: list[Event], lines: WrittenLines, number: int) -> bool:
        """Whether G0 or G1 is in force again where the moves have left the other one."""
        moves = [kind for kind, _ in events if kind in ("rapid", "feed")]
        motion = self.reader.state.motion
        if not moves or (moves[-1] == "feed") == (motion == 10):
            return True
        wanted = b"G1" if motion == 10 else b"G0"
        if lines.peek() != wanted:
            told = f"{wanted.decode()} of the program does not return"
            return self._complain(Kind.MODE, number, told)
        lines.next()
        return True

    def _compare(
        self, series: Series, wanted: list[list[Event]], lines: WrittenLines, number: int
    ) -> bool:
        """Compare moves one by one; a second list is another count of pecks that is as good."""
        at = dict(series.at)
        incremental = self.reader.state.distance == G91
        plane = PLANES[self.reader.state.plane or G17]
        candidates = wanted

        def read() -> tuple[Event, dict[str, Height]] | None:
            unit = self.reader.state.unit
            return read_event(lines.peek(), at, incremental, plane, self.control, unit)

        for k in range(max(map(len, wanted))):
            open_ = [events for events in candidates if len(events) > k]
            if not open_:
                break
            ending = [events for events in candidates if len(events) == k]
            got = read()
            if got is not None and stays(got[1], at):
                lines.next()
                got = read()
            fits = [events for events in open_ if got is not None and same(events[k], got[0])]
            if not fits and ending:
                candidates = ending
                break
            if not fits or got is None:
                found = lines.peek()[:60].decode("latin-1")
                problem = f"expected {told(open_[0][k], plane)}, found '{found}'"
                return self._complain(Kind.CYCLE, number, problem)
            lines.next()
            at, candidates = got[1], fits
        for event, place in candidates[0]:
            if event in ("rapid", "feed") and isinstance(place, tuple):
                series.at.update(zip(plane, place, strict=True))
        return True

    def _head(self, text: bytes, block: Block, taken: set[str]) -> tuple[bytes, list[bytes]]:
        """What a block says besides its cycle, without blanks; and its stops."""
        rest, stops = bytearray(text), []
        for word in block.words:
            number = word.value or 0.0
            cycle = word.letter == "G" and round(number * 10) in self.control.heights
            stop = word.letter == "M" and number in STOPS
            if word.letter in taken or cycle or stop:
                rest[word.begin : word.end] = b" " * (word.end - word.begin)
            if stop:
                stops.append(b"".join(word.text.split()))
        return squeezed(bytes(rest)), stops

    def _path_restored(self, line: bytes, state: State) -> bool:
        """Whether a line states the G64 that was in force."""
        match = _PATH.fullmatch(line)
        if match is None or self.path is None:
            return False
        unit = Fraction(str(state.unit))
        got = {word[:1].decode(): number_of(word[1:]) * unit for word in match[1].split()}
        return got.keys() == self.path.keys() and all(
            abs(got[letter] - value) <= abs(value) * CLOSE for letter, value in self.path.items()
        )

    def _remember(self, block: Block, *, sure: bool) -> None:
        """Note which way the spindle turns and which G64 is in force."""
        codes = [word.value for word in block.words if word.letter == "G"]
        for word in block.words:
            if word.letter == "M" and word.value not in (0, 1, 7, 8, 9, 48, 49):
                self.turning = int(word.value) if sure and word.value in (3, 4) else 0
        if block.o_word is not None:
            self.turning = 0
        if any(code in (61, 61.1, 64) for code in codes):
            self.path = None
            if sure and self.reader.state.unit is not None:
                unit = Fraction(str(self.reader.state.unit))
                words = [word for word in block.words if word.letter in "PQ"]
                if all((word.value or 0.0) >= 0.0 for word in words):
                    self.path = {word.letter: number_of(word.text[1:]) * unit for word in words}

    def _uncertain(self, number: int, doubt: str) -> bool:
        """Note that a series was written out that had to be left alone."""
        return self._complain(Kind.SERIES, number, f"its series is not certain: {doubt}")

    def _complain(self, kind: Kind, number: int, problem: str) -> bool:
        """Note a violation, with which the walk ends."""
        self.found.add(kind, self.theirs.line, number, problem)
        return False


def _modes(state: State, *, motion: bool) -> dict[str, float | None]:
    """What a cycle's moves depend on, as the second reading names it; `motion`: G0 or G1, too."""
    beside = {"motion": None if state.motion is None else state.motion // 10} if motion else {}
    return beside | {
        "unit": state.unit,
        "incremental": None if state.distance is None else state.distance == G91,
        "feed mode": state.feed_mode,
        "F": state.feed,
        "plane": state.plane,
        "retract": state.retract,
        "path": state.path,
    }
