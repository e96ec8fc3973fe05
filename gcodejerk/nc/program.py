"""Reading a program: one pass over the file that follows the modal state and collects the rapids.

Rule: runs of plain lines are computed as arrays (`lexer`, `runs`), everything else goes line by
line through the careful tokenizer and `execute`. Which way a line took shows nowhere in the result.
"""

from __future__ import annotations

import hashlib
import itertools
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from gcodejerk.errors import Place
from gcodejerk.nc.block import Block
from gcodejerk.nc.chunks import Chunk, read_chunks
from gcodejerk.nc.detect import detect_dialect
from gcodejerk.nc.dialect import Dialect
from gcodejerk.nc.dialects import AUTO, find_dialect
from gcodejerk.nc.execute import Executor
from gcodejerk.nc.flow import Flow
from gcodejerk.nc.judge import Step
from gcodejerk.nc.lexer import read_lines
from gcodejerk.nc.modal import NAN, State, join
from gcodejerk.nc.rapids import (
    GIVES_FEED,
    USES_FEED,
    RapidLog,
    Rapids,
    common_columns,
)
from gcodejerk.nc.runs import can_run, run_plain
from gcodejerk.nc.start import NOTHING_KNOWN, Start, initial_state
from gcodejerk.nc.tokenizer import parse_line
from gcodejerk.nc.words import Lines
from gcodejerk.reasons import Reason
from gcodejerk.units import SECONDS_PER_MINUTE

STAMP_LINES = 50
"""A stamp comment is looked for in this many lines at the top."""
_STAMP = re.compile(rb"[(;][ \t]*gcodejerk stamp", re.IGNORECASE)
_FILE_NAME = re.compile(rb"[ \t]*[A-Za-z_][\w-]*\.[A-Za-z]{1,5}[ \t]*(?:\([^()]*\)[ \t]*)?")
SHORT_RUN = 24
"""Fewer plain lines than this between odd ones go the careful way; arrays would not pay."""
_SHOWN = 20
"""Lines not understood that get a finding of their own."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something in a program that the user can live with."""

    line: int | None
    message: str
    place: Place | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """What one pass over a program found."""

    name: str
    dialect: str
    size: int
    """Of the file, in bytes."""
    digest: bytes
    """BLAKE2b of all bytes, 16 bytes."""
    lines: int
    blocks: int
    """Lines that hold at least one word."""
    newline: bytes
    """The first line end, b"\\n" where there is none."""
    stamp: int | None
    """Line of a stamp comment of ours."""
    insert_at: int
    """Byte offset where a comment line may be inserted first."""
    findings: tuple[Finding, ...]
    rapids: Rapids


def parse_block(text: bytes, dialect: str | Dialect = "linuxcnc") -> Block:
    """Read one line, without its line end, the careful way."""
    return parse_line(text, find_dialect(dialect))


class Reader:
    """Follows a program line by line."""

    def __init__(self, name: str, dialect: Dialect, start: Start) -> None:
        self.name = name
        self.dialect = dialect
        self.log = RapidLog()
        self.flow = Flow()
        state = initial_state(dialect, start)
        self.executor = Executor(dialect, state, dict(start.tool_lengths), start.decimal_point)
        self.blocks = 0
        self.percent: int | None = None
        """The line of the opening ``%``."""
        self.insert_at = 0
        self.started = False
        """A line that is not blank has been read."""
        self.odd_lines: list[Finding] = []
        self.odd_count = 0
        self.asked_unit: int | None = None
        """The first rapid before any G20 or G21."""
        self.asked_distance: int | None = None
        self.after_end: int | None = None

    @property
    def state(self) -> State:
        """The state in force."""
        return self.executor.state

    def read_line(self, text: bytes, begin: int, number: int, terminator: int) -> None:
        """Take one line the careful way; text without its LF."""
        if text.endswith(b"\r"):
            text = text[:-1]
            terminator = 2 if terminator else 3
        block = parse_line(text, self.dialect)
        if block.percent:
            self._percent(number, begin + len(text) + (terminator and (terminator % 2 or 2)))
            if not any(word.letter == "G" for word in block.words):
                return
        says = block.words or block.assigns or block.names or block.problem
        if not says and block.o_word is None:
            if text.startswith(b";$") and not self.blocks and terminator:
                # ;$PATH= belongs to the head of a Siemens program
                self.insert_at = begin + len(text) + (terminator % 2 or 2)
            self.started = self.started or bool(block.comments)
            return
        first = not self.blocks
        self.started = True
        if block.problem is not None and self._is_name(text):
            return
        line_end = begin + len(text) + (terminator and (terminator % 2 or 2))
        if first and block.o_word == "" and terminator:
            self.insert_at = line_end  # the number of a program goes first
        self.blocks += bool(block.words or block.names or block.o_word is not None)
        if block.problem is not None:
            self._odd(number, block.problem, block.column, text)
        if block.o_word is not None and block.problem is None:
            self._o_word(block, first)
            return
        self._run(block, text, begin, number, terminator)

    def _is_name(self, text: bytes) -> bool:
        """Whether the first line is the name of the file."""
        leader = self.dialect.text.leader and not self.blocks
        return leader and _FILE_NAME.fullmatch(text) is not None

    def can_run(self) -> bool:
        """Whether the lines that follow may be taken as a run."""
        return self.dialect.quick and self.started and not self.flow.inside and can_run(self.state)

    def read_run(self, lines: Lines, first: int, last: int, place: tuple[int, int]) -> int:
        """Take plain lines of a chunk as arrays; the first that was not taken."""
        stop, certain = run_plain(self.state, self.log, lines, first, last, place, self.dialect)
        self.blocks += int(np.count_nonzero(lines.letters[first:stop]))
        if certain is not None:
            self._ask(certain)
        return stop

    def _run(self, block: Block, text: bytes, begin: int, number: int, terminator: int) -> None:
        """Execute a block and enter what it did."""
        executor = self.executor
        before = executor.state.copy() if block.block_delete else None
        step = executor.run(block)
        state = executor.state
        if step.fault and block.problem is None:
            self._odd(number, "the controller would refuse this combination of words", None, text)
        elif step.unknown:
            self._odd(number, "a code that the dialect does not know", None, text)
        uncertain = before is not None or self.flow.inside
        if not (uncertain and step.feed_event == GIVES_FEED):
            self.log.feed_event(step.feed_event)
        if step.rapid:
            self._rapid(step, (number, begin, begin + len(text), terminator))
        if step.ends:
            executor.end()
        if state.ended:
            self.flow.end_of_subprogram()
            if before is not None:
                executor.state = before  # had it run, nothing that follows would matter
                return
        if before is not None:
            executor.state = join(before, state)

    def _rapid(self, step: Step, place: tuple[int, int, int, int]) -> None:
        """Enter a rapid."""
        state, reason = self.state, step.reason
        number = place[0]
        outer = (Reason.AFTER_END, Reason.BLOCK_DELETE)
        if self.flow.inside and reason not in outer:
            reason = Reason.SUBPROGRAM
        speed = NAN
        if self.dialect.feed_on_rapids:
            speed = state.feed * (state.unit or NAN) / SECONDS_PER_MINUTE
            if reason is None and not speed > 0.0:
                reason = Reason.FEED_UNKNOWN
        if reason is None:
            self._ask(number)
        row = common_columns(state)
        row.update(
            zip(("line", "begin", "end", "terminator"), place, strict=True),
            start=step.start,
            target=state.position.copy(),
            words=step.words,
            feed=state.feed,
            speed=speed,
        )
        self.log.add(reason, row)

    def _ask(self, number: int) -> None:
        """Note the first certain rapid that rests on an assumed unit or distance mode."""
        if not self.state.unit_stated and self.asked_unit is None:
            self.asked_unit = number
        fixed = "distance" in self.state.fixed
        if not (fixed or self.state.distance_stated) and self.asked_distance is None:
            self.asked_distance = number

    def _percent(self, number: int, end: int) -> None:
        """Take a lone %: the first one opens the program, the second one ends it."""
        if not self.started or (self.dialect.text.leader and not self.blocks):
            self.started = True
            self.percent = number
            self.insert_at = end
        elif self.percent is not None:
            self.executor.end()
        else:
            self._odd(number, "% in the middle of a program that did not begin with one", 1, b"%")
            self.state.forget()
            self.log.feed_event(USES_FEED)

    def _o_word(self, block: Block, first: bool) -> None:
        """Take a line of program flow."""
        assert block.o_word is not None
        self.log.feed_event(USES_FEED)
        for target in block.assigns:
            if not target or target.isdigit():
                self.state.offsets = {}
        after = self.flow.apply(self.state, block.o_word, block.o_name, first)
        self.executor.state = after

    def _odd(self, number: int, problem: str, column: int | None, text: bytes) -> None:
        """Note a line that is not understood."""
        self.odd_count += 1
        if len(self.odd_lines) < _SHOWN:
            place = Place(self.name, number, column, text[:200].decode("latin-1"))
            self.odd_lines.append(Finding(number, f"block not understood: {problem}", place))

    def findings(self) -> tuple[Finding, ...]:
        """Collect what the user should know."""
        found = list(self.odd_lines)
        if self.odd_count > len(found):
            found.append(Finding(None, f"{self.odd_count - len(found)} more lines not understood"))
        if self.asked_unit is not None:
            found.append(
                Finding(self.asked_unit, "no G20 or G21 before the first rapid: unit is assumed")
            )
        if self.asked_distance is not None:
            found.append(
                Finding(self.asked_distance, "no G90 or G91 before the first rapid: G90 is assumed")
            )
        if not self.state.ended:
            found.append(Finding(None, "program ends without M2, M30 or a closing %"))
        return tuple(found)


def split_lines(chunk: Chunk) -> Iterator[tuple[bytes, int, int, int]]:
    """Split a chunk into lines: text without LF, offset, number, terminator (0 or 1)."""
    offset, number = chunk.offset, chunk.line
    lines = chunk.data.split(b"\n")
    last = lines.pop()
    for text in lines:
        yield text, offset, number, 1
        offset += len(text) + 1
        number += 1
    if last:
        yield last, offset, number, 0


def find_stamp(chunk: Chunk, dialect: Dialect) -> int | None:
    """Find the line of our stamp comment near the top of the file."""
    for text, _, number, _ in split_lines(chunk):
        if number > STAMP_LINES:
            break
        if _STAMP.search(text):
            block = parse_line(text.rstrip(b"\r"), dialect)
            if any(_STAMP.match(text, begin) for begin, _ in block.comments):
                return number
    return None


def read_program(
    file: BinaryIO,
    *,
    name: str = "<program>",
    dialect: str | Dialect = "linuxcnc",
    start: Start = NOTHING_KNOWN,
    progress: Callable[[int], None] | None = None,
    fast: bool = True,
) -> Program:
    r"""Read a program and find its rapids.

    Parameters
    ----------
    file : BinaryIO
        Opened for reading bytes; read once, from where it stands to its end.
    name : str, optional
        For messages.
    dialect : str or Dialect, optional
        How the program is written; ``auto`` finds it from the text.
    start : Start, optional
        What may be assumed when the program starts.
    progress : callable, optional
        Called with the number of bytes read so far.
    fast : bool, optional
        False sends every line the careful way; the result is the same.

    Returns
    -------
    Program
        With one entry of `rapids` for every block that makes a rapid motion.

    Raises
    ------
    ProgramError
        The file is empty or cannot be an NC program; the dialect is not known, or cannot be told
        from the text.

    Examples
    --------
    >>> import io
    >>> program = read_program(io.BytesIO(b"G21 G90 G0 X1 Y2\nX3\nM2\n"))
    >>> program.rapids.line
    array([1, 2])
    >>> program.rapids.reason == 255
    array([False,  True])
    """
    chunks = read_chunks(file, name)
    why = ""
    if dialect == AUTO:
        first = next(chunks)
        dialect, why = detect_dialect(first.data, name)
        chunks = itertools.chain([first], chunks)
    reader = Reader(name, find_dialect(dialect), start)
    if why:
        reader.odd_lines.append(Finding(None, f"read as {reader.dialect.name}: {why}"))
    return follow(chunks, reader, progress, fast)


def follow(
    chunks: Iterator[Chunk], reader: Reader, progress: Callable[[int], None] | None, fast: bool
) -> Program:
    """Take all chunks; the reader keeps the state that the program ends in."""
    name, chosen = reader.name, reader.dialect
    digest = hashlib.blake2b(digest_size=16)
    size = lines = 0
    newline, stamp = b"\n", None
    for chunk in chunks:
        digest.update(chunk.data)
        if not size:
            stamp = find_stamp(chunk, chosen)
            first = chunk.data.find(b"\n")
            if first > 0 and chunk.data[first - 1 : first] == b"\r":
                newline = b"\r\n"
        read_chunk(reader, chunk, fast)
        size += len(chunk.data)
        lines += chunk.data.count(b"\n") + (not chunk.data.endswith(b"\n"))
        if progress is not None:
            progress(size)
    return Program(
        name=name,
        dialect=chosen.name,
        size=size,
        digest=digest.digest(),
        lines=lines,
        blocks=reader.blocks,
        newline=newline,
        stamp=stamp,
        insert_at=reader.insert_at,
        findings=reader.findings(),
        rapids=reader.log.finish(),
    )


def read_chunk(reader: Reader, chunk: Chunk, fast: bool) -> None:
    """Take the lines of one chunk."""
    if not fast or not reader.dialect.quick:
        for line in split_lines(chunk):
            reader.read_line(*line)
        return
    lines = read_lines(chunk.data, reader.dialect)
    complete = chunk.data.endswith(b"\n")
    begins = lines.begin.tolist()
    ends = [begin - 1 for begin in begins[1:]] + [len(chunk.data) - complete]
    odd = [*np.flatnonzero(lines.odd).tolist(), len(lines)]
    place = (chunk.line, chunk.offset)
    at = following = by_hand = 0
    patience = SHORT_RUN
    while at < len(lines):
        while odd[following] < at:
            following += 1
        stop = odd[following]
        if stop - at >= SHORT_RUN and at >= by_hand and reader.can_run():
            at = reader.read_run(lines, at, stop, place)
            if at < stop:
                # A line that is not sure. Were every other line so, looking at the whole rest of
                # the run each time would take quadratic time: double the distance instead.
                by_hand = at + patience
                patience *= 2
        else:
            text = chunk.data[begins[at] : ends[at]]
            ended = at + 1 < len(lines) or complete
            reader.read_line(text, chunk.offset + begins[at], chunk.line + at, int(ended))
            at += 1


def trace(
    file: BinaryIO,
    *,
    dialect: str | Dialect = "linuxcnc",
    start: Start = NOTHING_KNOWN,
) -> Iterator[tuple[int, tuple[float, ...], int | None]]:
    """Follow a program line by line.

    Yields
    ------
    line : int
        Its number.
    positions : tuple of float
        Of the axes after it, in program coordinates [mm, deg]; NaN where unknown.
    motion : int or None
        The motion code in force after it, times ten; None where unknown.
    """
    reader = Reader("<program>", find_dialect(dialect), start)
    for chunk in read_chunks(file, reader.name):
        for line in split_lines(chunk):
            reader.read_line(*line)
            yield line[2], tuple(reader.state.position), reader.state.motion
