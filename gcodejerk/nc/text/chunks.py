"""Reading a file in pieces that end at a line end, in memory that does not grow with the file.

Rule: what cannot be an NC program is refused here, before anything looks at its words: an empty
file, binary data, UTF-16, a line or a number that never ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from gcodejerk.errors import Place, ProgramError

CHUNK = 512 * 1024
"""Bytes per piece; larger ones leave the processor's cache and read no faster."""

LONGEST_LINE = 64 * 1024
"""A line of more bytes is refused. Controllers read 80 to 512."""

MOST_DIGITS = 4000
"""A longer row of digits is refused: Python makes no number of it, and nobody wrote one."""
_ENDLESS = re.compile(rb"(?<![0-9])[0-9]{%d}" % MOST_DIGITS)

# Tab, LF, VT, FF and CR occur in text; 0x1A ended DOS files, DC1 and DC3 ran paper tapes.
_BINARY = bytes(sorted(set(range(32)) - {9, 10, 11, 12, 13, 0x11, 0x13, 0x1A}))
_CONTROL = re.compile(b"[" + re.escape(_BINARY) + b"]")
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
"""Of UTF-8: Windows editors write it; it is kept, and belongs to no line."""
_MARKS = {
    b"\xff\xfe": "UTF-16",
    b"\xfe\xff": "UTF-16",
}


@dataclass(frozen=True, slots=True)
class Chunk:
    """Whole lines of a file; the last line of the file may lack its end."""

    data: bytes
    offset: int
    """Of the first byte, in the file."""
    line: int
    """Of the first line, counted from 1."""
    feeds: int
    """How many of its lines end."""


def _text(data: bytes) -> str:
    return data.decode("latin-1")


def _check_start(data: bytes, name: str) -> None:
    """Refuse what shows in the first bytes that it is no program."""
    for mark, what in _MARKS.items():
        if data.startswith(mark):
            raise ProgramError(
                f"file is {what}, which controllers refuse",
                "save it as plain ASCII text, without a byte order mark",
                Place(name, 1, 1),
            )
    head = data[:512]
    # The high bytes of UTF-16 stand at every other place; elsewhere zeros are padding.
    zeros = sorted(head[half::2].count(0) for half in (0, 1))
    if zeros[1] * 5 > len(head) * 2 and zeros[0] * 10 < len(head):
        raise ProgramError(
            "file seems to be UTF-16 without a byte order mark",
            "save it as plain ASCII text",
            Place(name, 1, head.index(b"\0") + 1),
        )


def _check_bytes(data: bytes, line: int, name: str) -> int:
    """Refuse control characters that no text holds; how many line feeds there are."""
    source = np.frombuffer(data, dtype=np.uint8)
    feeds = int(np.count_nonzero(source == ord("\n")))
    # Hardly a program has any others, but for those of CR LF.
    others = np.count_nonzero(source < ord(" ")) - feeds
    if others == 0 or others == np.count_nonzero(source == ord("\r")):
        return feeds
    if len(data.translate(None, _BINARY)) == len(data):
        return feeds
    found = _CONTROL.search(data)
    assert found is not None
    begin = data.rfind(b"\n", 0, found.start()) + 1
    raise ProgramError(
        f"file holds the byte 0x{found[0][0]:02X}: it is binary or damaged",
        "give the NC program itself, as text",
        Place(name, line + data.count(b"\n", 0, begin), found.start() - begin + 1),
    )


def _check_line(data: bytes, line: int, name: str) -> None:
    """Refuse an endless line."""
    if len(data) > LONGEST_LINE:
        raise ProgramError(
            f"line has more than {LONGEST_LINE} bytes",
            "give an NC program with line ends; no controller reads such a line",
            Place(name, line, LONGEST_LINE + 1, _text(data[:60]) + " ..."),
        )


def read_chunks(file: BinaryIO, name: str) -> Iterator[Chunk]:
    """Read a file from where it stands to its end.

    Parameters
    ----------
    file : BinaryIO
        Opened for reading bytes; it need not be seekable.
    name : str
        For messages.

    Yields
    ------
    Chunk
        About 512 KiB of whole lines each.

    Raises
    ------
    ProgramError
        The file is empty, binary or UTF-16, or a line or a number of it is longer than any.
    """
    kept, offset, line = b"", 0, 1
    while piece := file.read(CHUNK):
        if not offset and not kept:
            _check_start(piece, name)
        cut = piece.rfind(b"\n") + 1
        if not cut:
            kept += piece
            _check_bytes(piece, line, name)
            _check_line(kept, line, name)
            continue
        data, kept = kept + piece[:cut], piece[cut:]
        feeds = _check_bytes(data, line, name)
        first = data.find(b"\n")
        _check_line(data[:first], line, name)
        _check_lines(data, line, name)
        yield Chunk(data, offset, line, feeds)
        offset += len(data)
        line += feeds
        _check_line(kept, line, name)
    if kept:
        _check_bytes(kept, line, name)
        _check_lines(kept, line, name)
        yield Chunk(kept, offset, line, 0)
    elif not offset:
        raise ProgramError("file is empty", "give an NC program", Place(name))


def _check_lines(data: bytes, line: int, name: str) -> None:
    """Refuse an endless line, and an endless number, which only a long line can hold."""
    at = 0
    while len(data) - at >= MOST_DIGITS:
        end = data.rfind(b"\n", at, at + MOST_DIGITS)
        if end < 0:
            end = data.find(b"\n", at)
            end = len(data) if end < 0 else end
            if end - at > LONGEST_LINE:
                _check_line(data[at:end], line + data.count(b"\n", 0, at), name)
            if found := _ENDLESS.search(data, at, end):
                raise ProgramError(
                    f"a number has {MOST_DIGITS} digits or more",
                    "give an NC program; no controller reads such a number",
                    Place(name, line + data.count(b"\n", 0, at), found.start() - at + 1),
                )
        at = end + 1
