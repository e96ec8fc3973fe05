"""Reading a program: one pass over the file that follows the modal state and collects the rapids.

Rule: runs of plain lines are computed as arrays (`lexer`, `runs`), everything else goes line by
line through the careful tokenizer and `execute`. Which way a line took shows nowhere in the result.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from gcodejerk.errors import Place, ProgramError
from gcodejerk.nc.dialects import AUTO, find_dialect, lathe_dialects
from gcodejerk.nc.dialects.any_mill import written_for
from gcodejerk.nc.dialects.at_start import codes_at_start
from gcodejerk.nc.dialects.detect import detect_dialect, refuse_klartext
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.again import begins_again
from gcodejerk.nc.flow.elsewhere import Elsewhere, find_elsewhere
from gcodejerk.nc.flow.outline import find_outline, may_go_back, read_body, refers, seekable
from gcodejerk.nc.flow.subprograms import Calls
from gcodejerk.nc.following_reader import MOST_BYTES, FollowingReader, worth_following
from gcodejerk.nc.interpreter.left_on import left_on
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.neighbours import with_neighbours
from gcodejerk.nc.interpreter.rapids import Rapids
from gcodejerk.nc.interpreter.runner import Finding, Runner
from gcodejerk.nc.reader import SHORT_RUN, Reader
from gcodejerk.nc.text.block import Block, Line
from gcodejerk.nc.text.chunks import BYTE_ORDER_MARK, Chunk, read_chunks
from gcodejerk.nc.text.lexer import read_lines
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.nc.text.words import Lines
from gcodejerk.spread import ahead
from gcodejerk.start import NOTHING_KNOWN, Start

STAMP_LINES = 50
"""A stamp comment is looked for in this many lines at the top."""
_STAMP = re.compile(rb"[(;][ \t]*gcodejerk stamp", re.IGNORECASE)


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """What one pass over a program found."""

    name: str
    dialect: str
    language: Dialect
    """That dialect, as the machine's owner says that his control runs it."""
    size: int
    """Of the file, in bytes."""
    digest: bytes
    """BLAKE2b of all bytes, 16 bytes."""
    lines: int
    blocks: int
    """Lines that hold at least one word."""
    steps: int
    """Blocks that were run one by one, every pass of a loop counted: what reading costs."""
    newline: bytes
    """The first line end, b"\\n" where there is none."""
    stamp: int | None
    """Line of a stamp comment of ours."""
    insert_at: int
    """Byte offset where a comment line may be inserted first."""
    findings: tuple[Finding, ...]
    rapids: Rapids
    subprograms: tuple[str, ...] = ()
    """Files, of `Start.subprograms`, in which the program goes on."""

    def written_for(self, controller: str) -> Program:
        """The same, with streams spelled as a control has them where the dialect is of several."""
        return replace(self, language=written_for(self.language, controller))


def parse_block(text: bytes, dialect: str | Dialect = "linuxcnc") -> Block:
    """Read one line, without its line end, the careful way."""
    return parse_line(text, find_dialect(dialect))


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
            text = text.removeprefix(BYTE_ORDER_MARK)
            block = parse_line(text, dialect)
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
    neighbours: bool = False,
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
    neighbours : bool, optional
        Look at what follows each rapid, for `Rapids.lone`; the file is seekable.

    Returns
    -------
    Program
        With one entry of `rapids` for every block that makes a rapid motion.

    Raises
    ------
    ProgramError
        The file is empty or cannot be an NC program; the dialect is not known, or cannot be told
        from the text, or is one of mills though X is a diameter.

    Examples
    --------
    >>> import io
    >>> program = read_program(io.BytesIO(b"G21 G90 G0 X1 Y2\nX3\nM2\n"))
    >>> program.rapids.line
    array([1, 2])
    >>> program.rapids.reason == 255
    array([False,  True])
    """
    reader, file = open_reader(file, name, dialect, start)
    origin = file.tell() if neighbours else 0
    program = follow(read_chunks(file, name), reader, progress, fast)
    if neighbours:
        rapids = with_neighbours(file, origin, program.rapids, reader.dialect, name)
        program = replace(program, rapids=rapids)
    return program


def told_dialect(
    file: BinaryIO, name: str, dialect: str | Dialect, start: Start
) -> tuple[Dialect, str]:
    """Which dialect a program is read in, and how its text tells.

    Parameters
    ----------
    file : BinaryIO
        Seekable where the text has to tell (``auto``); left where it stands.
    name : str
        For messages.
    dialect : str or Dialect
        As `read_program` takes it.
    start : Start
        What is known of the machine.

    Returns
    -------
    dialect : Dialect
    why : str
        Empty where the text did not have to tell.

    Raises
    ------
    ProgramError
        There is no such dialect, or the text does not tell.
    """
    if dialect != AUTO:
        return find_dialect(dialect), ""
    begin = file.tell()
    head = next(read_chunks(file, name)).data.removeprefix(BYTE_ORDER_MARK)
    file.seek(begin)
    return detect_dialect(head, name, lathe=start.diameter, control=start.control)


def read_as(dialect: Dialect, why: str) -> Finding:
    """Says how the text told its dialect."""
    return Finding(None, f"read as {dialect.name}: {why}")


def open_reader(
    file: BinaryIO, name: str, dialect: str | Dialect, start: Start
) -> tuple[Reader, BinaryIO]:
    """Make the reader of a file, and what it has to be read from: a copy if it cannot go back."""
    if dialect == AUTO:
        file = seekable(file)
    chosen, why = told_dialect(file, name, dialect, start)
    if start.diameter and chosen.lathe == "no":
        raise ProgramError(
            f"the machine's X is a diameter, so it is a lathe, and the dialect {chosen.name} is "
            "that of mills",
            f"choose the dialect of the lathe's control: {', '.join(lathe_dialects())}",
            Place(name),
        )
    returns = False
    if chosen.unknown_lasts:
        file = seekable(file)
        returns = may_go_back(file, chosen, name)
    labels = chosen.text.variables == "Q"
    if labels:
        file = seekable(file)
    reader: Reader
    if labels and worth_following(file, chosen):
        reader = FollowingReader(name, chosen, start, None, Elsewhere())
    elif not refers(chosen):
        reader = Reader(name, chosen, start)
        if chosen.text.o_word == "flow":
            file = _with_its_start(reader, file, bool(start.positions or start.startup))
    else:
        file = source = seekable(file)
        origin = source.tell()
        outline = find_outline(source, chosen, name)

        def calls(runner: Runner) -> Calls:
            return Calls(runner, outline, lambda mark: read_body(source, origin, mark, chosen))

        elsewhere = Elsewhere()
        if start.subprograms and len(text := source.read(MOST_BYTES + 1)) <= MOST_BYTES:
            elsewhere = find_elsewhere(text, start.subprograms, chosen)
        source.seek(origin)
        if elsewhere.lines or worth_following(source, chosen):
            reader = FollowingReader(name, chosen, start, calls, elsewhere)
        else:
            reader = Reader(name, chosen, start)
            reader.refer(calls(reader.runner))
    if returns:
        state = reader.runner.state
        state.put("bars", {**state.bars, "unknown code": True})
        message = (
            "it has words of flow (GOTO, IF and their kin): not followed, nothing is rewritten"
        )
        reader.runner.syntax_problems.append(Finding(None, message))
    if why:
        reader.runner.syntax_problems.append(read_as(chosen, why))
    if left_out := codes_at_start(start.startup, chosen)[1]:
        message = (
            f"of program.startup, {left_out} is left out where programs are read as {chosen.name}: "
            "no rapid hangs on that"
        )
        reader.runner.syntax_problems.append(Finding(None, message))
    if chosen.note:
        reader.runner.syntax_problems.append(Finding(None, f"dialect {chosen.name}: {chosen.note}"))
    return reader, file


def _with_its_start(reader: Reader, file: BinaryIO, assumes: bool) -> BinaryIO:
    """Forget what the last line may leave to the first one, where O words are of flow.

    A stream that may have no end is not kept, unless something is assumed of its start: what is
    rewritten is a file.
    """
    if not assumes and not file.seekable():
        return file
    file = seekable(file)
    if begins_again(file, reader.name, reader.dialect):
        reader.forget_start(None, left_on(file, reader.dialect, reader.name))
    return file


def follow(
    chunks: Iterator[Chunk], reader: Reader, progress: Callable[[int], None] | None, fast: bool
) -> Program:
    """Take all chunks; the reader keeps the state that the program ends in."""
    name, chosen = reader.name, reader.dialect
    digest = hashlib.blake2b(digest_size=16)
    size = lines = 0
    newline, stamp = b"\n", None

    def cut(chunk: Chunk) -> tuple[Chunk, Lines | None]:
        digest.update(chunk.data)
        return chunk, plain_lines(chunk, chosen) if fast else None

    for chunk, plain in ahead(cut, chunks):
        if not size:
            refuse_klartext(chunk.data, chosen, name)
            stamp = find_stamp(chunk, chosen)
            first = chunk.data.find(b"\n")
            if first > 0 and chunk.data[first - 1 : first] == b"\r":
                newline = b"\r\n"
        reader.runner.look_for_instant(chunk)
        read_chunk(reader, chunk, plain)
        size += len(chunk.data)
        lines += chunk.feeds + (not chunk.data.endswith(b"\n"))
        if progress is not None:
            progress(size)
    reader.finish()
    rapids = reader.log.finish()
    return Program(
        name=name,
        dialect=chosen.name,
        language=chosen,
        size=size,
        digest=digest.digest(),
        lines=lines,
        blocks=reader.blocks,
        steps=reader.runner.steps,
        newline=newline,
        stamp=stamp,
        insert_at=reader.insert_at,
        findings=reader.findings(rapids),
        rapids=rapids,
        subprograms=reader.used,
    )


def plain_lines(chunk: Chunk, dialect: Dialect) -> Lines | None:
    """Cut a chunk into lines, the plain ones with their words, where the dialect has such."""
    return read_lines(chunk.data, dialect) if dialect.quick else None


def read_chunk(reader: Reader, chunk: Chunk, lines: Lines | None) -> None:
    """Take the lines of one chunk; where nobody has cut it, all of them with care."""
    if lines is None:
        for line in split_lines(chunk):
            reader.read_line(*line)
        return
    careful = [*np.flatnonzero(lines.careful).tolist(), len(lines)]
    place = (chunk.line, chunk.offset)
    at = following = by_hand = 0
    patience = SHORT_RUN
    while at < len(lines):
        while careful[following] < at:
            following += 1
        stop = careful[following]
        if stop - at >= SHORT_RUN and at >= by_hand and reader.can_run():
            at = reader.read_run(lines, at, stop, place)
            if at < stop:
                # A line that is not sure. Were every other line so, looking at the whole rest of
                # the run each time would take quadratic time: double the distance instead.
                by_hand = at + patience
                patience *= 2
            continue
        behind = reader.read_computed(chunk.data, lines, at, place)
        if behind > at:
            at = behind
            continue
        begin, ended = int(lines.begin[at]), int(lines.terminator[at] != 0)
        last = at + 1 == len(lines)
        end = len(chunk.data) - ended if last else int(lines.begin[at + 1]) - 1
        reader.read_line(chunk.data[begin:end], chunk.offset + begin, chunk.line + at, ended)
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
    reader, file = open_reader(file, "<program>", dialect, start)
    passed: dict[int, _Trace] = {}
    lines: list[_Trace] = []

    def observe(line: Line, state: State) -> None:
        now = (line.number, tuple(state.position), state.motion)
        passed[line.number] = _joined(passed.get(line.number, now), now)

    reader.runner.observe = observe
    for chunk in read_chunks(file, reader.name):
        for text in split_lines(chunk):
            reader.read_line(*text)
            inside = reader.collecting or reader.flow.inside
            state = _UNKNOWN if inside else reader.state
            lines.append((text[2], tuple(state.position), state.motion))
    reader.finish()
    for line in lines:
        yield passed.get(line[0], line)


_Trace = tuple[int, tuple[float, ...], int | None]
_UNKNOWN = State()


def _joined(a: _Trace, b: _Trace) -> _Trace:
    """Keep what two passes over a line have in common."""
    positions = tuple(x if x == y else NAN for x, y in zip(a[1], b[1], strict=True))
    return a[0], positions, a[2] if a[2] == b[2] else None
