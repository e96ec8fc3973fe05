"""What the lines of a file refer to, found before it is read: jumps, subprograms behind the end.

Rule: the pass over the file is cheap; only lines that can hold such a word are looked at. What
cannot be told is told conservatively: a jump that is computed may lead to every numbered line.
"""

from __future__ import annotations

import re
import shutil
import tempfile
from bisect import bisect_right
from dataclasses import dataclass, field
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.jumps import EVERYWHERE, jumps_of
from gcodejerk.nc.interpreter.left_on import NOTHING, LeftOn, code_of, left_on
from gcodejerk.nc.text.block import Line, Name
from gcodejerk.nc.text.chunks import Chunk, read_chunks
from gcodejerk.nc.text.tokenizer import parse_line

MOST_LINES = 20_000
MOST_BYTES = 1_000_000
"""Of one subprogram."""
MOST_NUMBERS = 100_000
"""Numbered places that are kept."""
_SPOOLED = 1 << 23
_CANDIDATES = re.compile(rb"GOTO|M[ \t]*0*(?:9[6-9]|4[67]|2|30)(?![0-9])|REPEAT|CASE")
_REFERS = re.compile(rb"GOTO|REPEAT|CASE|M[ \t]*0*(?:46|9[69])")
_TO_START = re.compile(rb"(?<![A-Z0-9_])GOTOS(?![A-Z0-9_])")
_FLOW = re.compile(
    rb"(?<![A-Z0-9_])(?:GOTO|IF|WHILE|REPEAT|RPT|LOOP|FOR|CASE|UNTIL|GOSUB|CALL)(?![A-Z_])", re.I
)
_REMARK = re.compile(rb";[^\n]*")
_COMMENT = re.compile(rb"\([^)\n]*(?:\)|$)|;[^\n]*", re.MULTILINE)
_G_CODE = re.compile(rb"[gG][ \t]*([0-9]+(?:\.[0-9]*)?)")
_O_LINE = re.compile(
    rb"^[ \t]*(?:/[0-9]?[ \t]*)?(?:N[ \t]*[0-9]+[ \t]*)?[O:][ \t]*([0-9]+)", re.MULTILINE | re.I
)
_N_LINE = re.compile(rb"^[ \t]*(?:/[0-9]?[ \t]*)?N[ \t]*([0-9]+)", re.MULTILINE | re.I)


@dataclass(frozen=True, slots=True)
class Mark:
    """Where a line begins: offset in the file, number."""

    begin: int
    line: int


@dataclass(slots=True)
class Outline:
    """What the lines of a file refer to."""

    known: bool = False
    """The file was looked through; otherwise nothing here says anything."""
    targets: frozenset[int] | None = None
    """Numbers N that jumps lead to; None where there are no jumps."""
    programs: dict[int, Mark | None] = field(default_factory=dict)
    """O number -> its line; None where it stands twice."""
    numbers: dict[int, Mark | None] = field(default_factory=dict)
    """N number -> its line, where subprograms are called by it."""
    repeats: bool = False
    """The program goes back to its beginning (M99 in the main program, M47, GOTOS)."""
    calls: bool = False
    """Subprograms are called."""
    groups: frozenset[str] | None = None
    """Modal groups of the codes in a file that repeats and runs nothing else; None unknown."""
    left_on: LeftOn = NOTHING
    """What else a file that repeats may have left on."""

    @property
    def plain(self) -> bool:
        """Whether every line follows the one in front of it."""
        return self.targets is None and not self.calls


def refers(dialect: Dialect) -> bool:
    """Whether programs of a dialect can refer to lines elsewhere in the file."""
    return dialect.text.o_word == "program" or "GOTOF" in dialect.names


def seekable(file: BinaryIO) -> BinaryIO:
    """Give a file that can be read twice: the same, or a copy of the rest of it."""
    if file.seekable():
        return file
    copy = tempfile.SpooledTemporaryFile(max_size=_SPOOLED)  # noqa: SIM115 - closed with its last user
    shutil.copyfileobj(file, copy)
    copy.seek(0)
    return copy  # type: ignore[return-value]


def may_go_back(file: BinaryIO, dialect: Dialect, name: str) -> bool:
    """Whether a program in a language that is known in part may come to a line twice.

    Its words of flow are not known, so any that some control has counts; comments are left out.
    """
    text = dialect.text
    if not (dialect.unknown_lasts and text.names and not dialect.one_command):
        return False
    begin = file.tell()
    found = False
    for chunk in read_chunks(file, name):
        data = _REMARK.sub(b" ", chunk.data) if text.parentheses == "code" else chunk.data
        data = data if text.parentheses == "code" else _COMMENT.sub(b" ", data)
        if found := _FLOW.search(data) is not None:
            break
    file.seek(begin)
    return found


def find_outline(file: BinaryIO, dialect: Dialect, name: str) -> Outline:
    """Look a file through, and go back to where it stood.

    Parameters
    ----------
    file : BinaryIO
        Seekable.
    dialect : Dialect
        How it is written.
    name : str
        For messages.

    Returns
    -------
    Outline
    """
    outline = Outline(known=True)
    if not refers(dialect):
        return outline
    begin = file.tell()
    scan = _Scan(outline, dialect)
    for chunk in read_chunks(file, name):
        scan.take(chunk)
    file.seek(begin)
    if outline.calls:
        marks = [(outline.programs, _O_LINE)]
        marks += [(outline.numbers, _N_LINE)] if scan.by_number else []
        for found, pattern in marks:
            for chunk in read_chunks(file, name):
                if not _mark(found, pattern, chunk):
                    found.clear()  # too many to tell which stand twice
                    break
            file.seek(begin)
    if outline.repeats:
        outline.left_on = left_on(file, dialect, name)
    if outline.repeats and outline.plain and not dialect.text.names:
        outline.groups = _groups(file, dialect, name)
        file.seek(begin)
    return outline


def _groups(file: BinaryIO, dialect: Dialect, name: str) -> frozenset[str] | None:
    """Modal groups of all G codes in a file, comments included; None where macros are called."""
    found: set[str] = set()
    for chunk in read_chunks(file, name):
        if b"#" in chunk.data:
            return None
        for number in set(_G_CODE.findall(chunk.data)):
            code = code_of(number)
            if dialect.effect(code) in ("flow", "modal cycle"):
                return None
            found.add(dialect.groups.get(code, ""))
    return frozenset(found)


class _Scan:
    """The first look at a file: where it jumps and calls."""

    def __init__(self, outline: Outline, dialect: Dialect) -> None:
        self.outline, self.dialect = outline, dialect
        self.by_number = False
        self._ended = False
        self._programs = 0

    def take(self, chunk: Chunk) -> None:
        """Look at the lines that may refer to another."""
        upper = chunk.data.upper()
        behind = 0
        begins = [match.start() for match in _O_LINE.finditer(upper)]
        for match in _CANDIDATES.finditer(upper):
            at = match.start()
            if at < behind:
                continue
            behind = upper.find(b"\n", at)
            behind = len(upper) if behind < 0 else behind
            text = chunk.data[upper.rfind(b"\n", 0, at) + 1 : behind].rstrip(b"\r")
            main = self._programs + bisect_right(begins, at) <= 1 and not self._ended
            self._line(text, main)
        self._programs += len(begins)

    def _line(self, text: bytes, main: bool) -> None:
        """Take a line that may refer to another."""
        outline = self.outline
        block = parse_line(text, self.dialect)
        targets = jumps_of(block, self.dialect)
        if block.problem is not None and _REFERS.search(block.rest.upper()):
            targets = EVERYWHERE
        if targets is not None:
            outline.targets = targets | (outline.targets or frozenset())
        codes = {word.value for word in block.words if word.letter == "M"}
        outline.calls |= bool(codes & {97.0, 98.0})
        self.by_number |= 97.0 in codes
        outline.repeats |= bool(codes & {99.0, 47.0}) and (main or outline.targets is not None)
        outline.repeats |= any(_TO_START.search(_spelled(name)) for name in block.names)
        self._ended |= main and not block.block_delete and bool(codes & {2.0, 30.0})


def _spelled(name: Name) -> bytes:
    """A word with a name, and what belongs to it."""
    return name.name.encode() + b" " + name.arguments.upper()


def _mark(marks: dict[int, Mark | None], pattern: re.Pattern[bytes], chunk: Chunk) -> bool:
    """Note where the lines with numbers begin; False where there are too many."""
    line, counted = chunk.line, 0
    for match in pattern.finditer(chunk.data):
        if len(marks) >= MOST_NUMBERS:
            return False
        line += chunk.data.count(b"\n", counted, match.start())
        counted = match.start()
        number = int(match[1]) if len(match[1]) < 10 else -1
        marks[number] = None if number in marks else Mark(chunk.offset + match.start(), line)
    return True


def read_body(file: BinaryIO, origin: int, mark: Mark, dialect: Dialect) -> list[Line] | None:
    """Read a subprogram: its lines up to the next one; None where it is too long.

    Parameters
    ----------
    file : BinaryIO
        Seekable; it stands where it stood afterwards.
    origin : int
        Where the program begins in it.
    mark : Mark
        The first line.
    dialect : Dialect
        How it is written.

    Returns
    -------
    list of Line or None
    """
    stood = file.tell()
    file.seek(origin + mark.begin)
    data = file.read(MOST_BYTES + 1)
    file.seek(stood)
    lines: list[Line] = []
    begin, number = mark.begin, mark.line
    at = 0
    while at < len(data):
        end = data.find(b"\n", at)
        complete = end >= 0
        if not complete:
            if len(data) > MOST_BYTES:
                return None
            end = len(data)
        text = data[at:end]
        cr = text.endswith(b"\r")
        text = text[:-1] if cr else text
        block = parse_line(text, dialect)
        if block.percent or (block.o_word is not None and lines):
            return lines
        if len(lines) >= MOST_LINES:
            return None
        terminator = (2 if complete else 3) if cr else int(complete)
        lines.append(Line(text, begin + at, number, terminator, block))
        number += 1
        at = end + 1
    return lines
