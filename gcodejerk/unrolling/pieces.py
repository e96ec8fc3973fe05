"""A file with pieces of it replaced, and the way back from its lines.

Rule: what no piece covers is copied byte for byte; pieces do not overlap and come in the order of
the file.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import BinaryIO

import numpy as np

from gcodejerk.nc.line_map import LineMap
from gcodejerk.nc.text.block import Line

_COPIED = 1 << 20
COMMENT_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""


class LeftAloneError(Exception):
    """Something cannot be written out."""

    def __init__(self, reason: str, line: int) -> None:
        super().__init__(reason)
        self.reason, self.line = reason, line


@dataclass(frozen=True, slots=True)
class Written:
    """A line of the result, and the line of the original that it comes from."""

    text: bytes
    """Without its end."""
    line: Line


@dataclass(slots=True)
class Piece:
    """What stands in the place of some lines."""

    first: Line
    last: Line
    """Of the original."""
    lines: list[Written] = field(default_factory=list)


def named(text: bytes, marks: tuple[bytes, bytes]) -> bytes:
    """``(gcodejerk: ...)`` with a line of flow, in at most COMMENT_LENGTH characters.

    Parameters
    ----------
    text : bytes
        The line.
    marks : tuple of bytes
        What begins a comment, and what ends it.
    """
    opens, closes = marks
    shown = bytes(c if 32 <= c < 127 and c not in b"();" else 32 for c in text)
    shown = b" ".join(shown.split())
    room = COMMENT_LENGTH - len(opens + b"gcodejerk: " + closes)
    if len(shown) > room:
        shown = shown[: room - 3] + b"..."
    return opens + b"gcodejerk: " + shown + closes


def _ends(line: Line) -> bytes:
    """The line's end in the file."""
    return (b"", b"\n", b"\r\n", b"\r")[line.terminator]


def put_together(
    source: BinaryIO, target: BinaryIO | None, pieces: Sequence[Piece], newline: bytes
) -> LineMap:
    """Copy a file with its pieces replaced.

    Parameters
    ----------
    source : BinaryIO
        Seekable, at its beginning.
    target : BinaryIO or None
        Takes the result.
    pieces : sequence of Piece
        In the order of the file.
    newline : bytes
        The file's line end.

    Returns
    -------
    LineMap
        From the result to the original.
    """
    rows, spans = [], []
    at = out = added = 0
    for piece in pieces:
        first, last = piece.first, piece.last
        out += _copy(source, target, first.begin - at)
        source.seek(last.end)
        begin, line, ends = out, first.number + added, _ends(last)
        spans.append((line, len(piece.lines), out, 0, first.number, first.begin, last.end, 0))
        for k, written in enumerate(piece.lines):
            # Of a file that ends in a carriage return, the last line keeps that.
            end = newline if k < len(piece.lines) - 1 or ends.endswith(b"\n") else ends
            if target is not None:
                target.write(written.text + end)
            size, own = len(written.text) + len(end), written.line
            place = (own.number, own.begin, own.begin + len(own.text), own.terminator)
            rows.append((line + k, 1, out, out + size, *place))
            out += size
        spans[-1] = (*spans[-1][:3], out, *spans[-1][4:])
        assert out >= begin
        added += len(piece.lines) - (last.number - first.number + 1)
        at = last.end
        # Whatever follows is the original's, line by line.
        rows.append((line + len(piece.lines), 1, out, out, last.number + 1, at, at, 0))
    _copy(source, target, None)
    return _map(rows, _map(spans, None))


def _map(rows: Iterable[tuple[int, ...]], whole: LineMap | None) -> LineMap:
    columns = np.array([*rows], dtype=np.int64).reshape(-1, 8).T
    return replace(LineMap(*columns), whole=whole)


def _copy(source: BinaryIO, target: BinaryIO | None, size: int | None) -> int:
    """Copy so many bytes, or all that are left; how many."""
    done = 0
    while size is None or done < size:
        data = source.read(_COPIED if size is None else min(_COPIED, size - done))
        if not data:
            break
        if target is not None:
            target.write(data)
        done += len(data)
    return done
