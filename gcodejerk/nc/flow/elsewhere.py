"""Subprograms in other files: which of them a program calls, and their lines behind its own.

Rule: a name that the program itself defines is its own; one that two files define differently is
not followed, nor is a subprogram with flow that cannot be: then a call of it is one of a program
that nobody knows.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.macro_b import NotFollowedError, macro_script
from gcodejerk.nc.flow.named import named_script
from gcodejerk.nc.flow.structures import Collector, Node, plain_name
from gcodejerk.nc.text.block import ELSEWHERE, Line
from gcodejerk.nc.text.chunks import BYTE_ORDER_MARK
from gcodejerk.nc.text.tokenizer import parse_line

MOST_LINES = 200_000
"""Of all subprograms of one program."""
_HEADER = re.compile(rb"[ \t]*%_N_([A-Z0-9_]+)_([A-Z]+)[ \t]*", re.IGNORECASE)
_NUMBER = re.compile(rb"[ \t]*[O:][ \t]*([0-9]{1,8})(?![0-9.])", re.IGNORECASE)
_STEM = re.compile(r"[OP]?0*([1-9][0-9]{0,7})", re.IGNORECASE)
_COMMENT = re.compile(rb"\([^()\n]*\)|;[^\n]*")
_REMARK = re.compile(rb";[^\n]*")
_CALLING = re.compile(rb"(?:M[ \t]*0*98|G[ \t]*0*65)(?![0-9.])", re.IGNORECASE)
_P = re.compile(rb"P[ \t]*0*([1-9][0-9]{0,7})", re.IGNORECASE)
_WORD = re.compile(rb"[A-Z_][A-Z0-9_]*")
_PACKED = 10_000


@dataclass(slots=True)
class Part:
    """A subprogram of another file."""

    name: str
    file: str
    first: int
    """Its first line there, counted from 1."""
    lines: list[bytes]


@dataclass(slots=True)
class Elsewhere:
    """What a program calls in other files."""

    lines: list[Line] = field(default_factory=list)
    """Numbered from `ELSEWHERE`."""
    files: dict[str, None] = field(default_factory=dict)
    """In which they stand."""
    places: list[tuple[int, str, int]] = field(default_factory=list)
    """Number of the first line of each, its file, its number there."""


def find_elsewhere(text: bytes, files: Mapping[str, bytes], dialect: Dialect) -> Elsewhere:
    """Collect what a program calls in other files, and what that calls.

    Parameters
    ----------
    text : bytes
        The program.
    files : mapping of str to bytes
        Name -> text.
    dialect : Dialect
        Of all of them.
    """
    found = Elsewhere()
    rules = dialect.text
    named = rules.names and rules.variables == "R"
    if not files or not (named or (rules.keywords and rules.o_word == "program")):
        return found
    own = {part.name for part in _parts(text, "", named)}
    defined: dict[str, Part | None] = {}
    for file, other in files.items():
        for part in _parts(other, file, named) if other != text else ():
            there = defined.get(part.name, part)
            same = there is not None and there.lines == part.lines
            defined[part.name] = part if same else None
    waiting, seen = _called(text, named), set(own)
    while waiting:
        name = min(waiting)
        waiting.discard(name)
        called = defined.get(name)
        if name in seen or called is None or (named and name in dialect.names):
            continue
        seen.add(name)
        if len(found.lines) + len(called.lines) <= MOST_LINES and _take(called, found, dialect):
            waiting |= _called(b"\n".join(called.lines), named)
    return found


def _take(part: Part, found: Elsewhere, dialect: Dialect) -> bool:
    """Put a subprogram behind the others; whether it can be followed by itself."""
    named = dialect.text.names
    head = f"%_N_{part.name}_SPF" if named else f"O{part.name}"
    first = ELSEWHERE if not found.lines else found.lines[-1].number + 1
    lines = [Line(head.encode(), 0, first, 1, parse_line(head.encode(), dialect))]
    for k, text in enumerate(part.lines, first + 1):
        block = parse_line(text, dialect)
        says = block.words or block.assigns or block.names or block.problem
        if says or (block.o_word is not None and not (k == first + 1 and block.o_word == "")):
            lines.append(Line(text, 0, k, 1, block))
    try:
        if named:
            named_script(lines)
        else:
            macro_script(lines, dialect)
    except NotFollowedError:
        return False
    found.lines += lines
    found.files[part.file] = None
    found.places.append((first, part.file, part.first - 1))
    return True


def _parts(text: bytes, file: str, named: bool) -> Iterator[Part]:
    """The subprograms of a file."""
    lines = [line.rstrip(b"\r") for line in text.removeprefix(BYTE_ORDER_MARK).split(b"\n")]
    yield from _named_parts(lines, file) if named else _numbered_parts(lines, file)


def _named_parts(lines: list[bytes], file: str) -> Iterator[Part]:
    """Of Siemens: under their headers, or the whole file under its own name."""
    heads = [(k, match) for k, line in enumerate(lines) if (match := _HEADER.fullmatch(line))]
    stem, _, ending = file.rpartition("/")[2].rpartition(".")
    if not heads and ending.upper() == "SPF":
        yield Part(stem.upper(), file, 1, lines)
    for (at, match), end in zip(heads, [*(k for k, _ in heads[1:]), len(lines)], strict=False):
        if match[2].upper() == b"SPF":
            yield Part(match[1].decode().upper(), file, at + 2, lines[at + 1 : end])


def _numbered_parts(lines: list[bytes], file: str) -> Iterator[Part]:
    """Of macro B: behind their numbers up to a closing ``%``, or the file by its name."""
    marks = [k for k, line in enumerate(lines) if line.lstrip(b" \t").startswith(b"%")]
    heads = [(k, match) for k, line in enumerate(lines) if (match := _NUMBER.match(line))]
    end = len(lines)
    if heads:
        end = next((k for k in marks if k > heads[0][0]), end)
        heads = [head for head in heads if head[0] < end]
    for (at, match), last in zip(heads, [*(k for k, _ in heads[1:]), end], strict=False):
        yield Part(str(int(match[1])), file, at + 1, lines[at:last])
    stem = _STEM.fullmatch(file.rpartition("/")[2].split(".")[0])
    if not heads and stem is not None:
        begin = marks[0] + 1 if marks else 0
        last = marks[1] if len(marks) > 1 else end
        yield Part(stem[1], file, begin + 1, lines[begin:last])


def _called(text: bytes, named: bool) -> set[str]:
    """Names that a text may call; more than it calls do no harm."""
    if named:
        return {word.decode() for word in _WORD.findall(_REMARK.sub(b"", text).upper())}
    found = set()
    for line in _COMMENT.sub(b"", text).split(b"\n"):
        if _CALLING.search(line):
            for number in map(int, _P.findall(line)):
                found |= {str(number), str(number % _PACKED)}
    return found


def find_o_word(
    name: str, files: Mapping[str, bytes], dialect: Dialect, first: int, comments: bool = False
) -> tuple[str, Node] | None:
    """The subprogram of LinuxCNC that ``o<name> call`` finds in a file of its name.

    Parameters
    ----------
    name : str
        As `structures.plain_name` has it.
    files : mapping of str to bytes
        Name -> text.
    dialect : Dialect
        LinuxCNC's.
    first : int
        Number of the first line of the file.
    comments : bool, optional
        Lines with nothing else are kept, too.

    Returns
    -------
    tuple of str and Node, or None
        The file, and what it defines there; None where there is no such file, or more than one.
    """
    wanted = f"{name.strip('<>')}.ngc"
    found = [file for file in files if file.rpartition("/")[2] == wanted]
    if not found or any(files[file] != files[found[0]] for file in found):
        return None
    collector, text = Collector(comments), files[found[0]].removeprefix(BYTE_ORDER_MARK)
    for k, row in enumerate(text.split(b"\n"), first):
        line = Line(row.rstrip(b"\r"), 0, k, 1, parse_line(row.rstrip(b"\r"), dialect))
        begins = line.block.o_word == "sub" and plain_name(line.block.o_name) == name
        if not collector and not begins:
            continue
        try:
            node = collector.add(line)
        except ValueError:
            return None
        if node is not None:
            return found[0], node
    return None
