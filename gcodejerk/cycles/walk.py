"""The walk through a file whose cycles are judged, or written out.

Rule: what is not replaced is copied byte for byte.
"""

from __future__ import annotations

import hashlib
from array import array
from dataclasses import dataclass
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.program import plain_lines, read_chunk
from gcodejerk.nc.reader import Reader
from gcodejerk.nc.text.chunks import Chunk, read_chunks
from gcodejerk.start import Start


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the first walk found about one series."""

    line: int
    reason: str | None
    at: int
    """The line that the reason is about."""


@dataclass(frozen=True, slots=True)
class Place:
    """Where a block stands in the file."""

    begin: int
    end: int
    """It is the bytes begin:end, without its line end."""
    number: int
    returns: int
    """CRs and LFs of its line end, 0 or 1 each."""
    terminator: int


class Walker(Reader):
    """Reads a program, and judges or writes its series on the way."""

    def __init__(
        self,
        name: str,
        dialect: Dialect,
        start: Start,
        comments: bool,
        target: BinaryIO | None,
        verdicts: list[Verdict] | None,
    ) -> None:
        super().__init__(name, dialect, start)
        self.comments = comments
        self.target = target
        self.known = verdicts
        """The verdicts of the first walk; None during it."""
        self.verdicts: list[Verdict] = []
        self.jumps = False
        """A block may be reached in another way than from the one in front of it."""
        self.reason_at = 0
        self.holes = self.written = 0
        """Blocks that make holes, and those of them that were replaced."""
        self.places = array("q")
        """The columns of the map, row by row."""
        self.newline = b"\n"
        self._chunk = Chunk(b"", 0, 1, 0)
        self._at = 0
        self._out = 0
        self._added = 0
        """Lines of the result beyond those of the original."""

    def finish_series(self) -> None:
        """The program ends: so does a series."""

    def walk(self, source: BinaryIO) -> bytes:
        """Take a whole file; the digest of its bytes."""
        digest = hashlib.blake2b(digest_size=16)
        for chunk in read_chunks(source, self.name):
            digest.update(chunk.data)
            if not chunk.offset:
                first = chunk.data.find(b"\n")
                crlf = first > 0 and chunk.data[first - 1 : first] == b"\r"
                self.newline = b"\r\n" if crlf else b"\n"
            self._chunk = chunk
            read_chunk(self, chunk, plain_lines(chunk, self.dialect))
            self._copy(chunk.offset + len(chunk.data))
        self.finish_series()
        return digest.digest()

    def replace(self, place: Place, lines: list[bytes], *, hole: bool = True) -> None:
        """Write lines in the place of a block, which makes a hole or belongs to those that do."""
        number = place.number
        self.written += hole
        self._copy(place.begin)
        last = b"\r" * place.returns + b"\n" * place.terminator
        line_end = last if place.terminator else self.newline
        new = line_end.join(lines) + last if lines else b""
        kind = (0, 1, 3, 2)[2 * place.returns + place.terminator]
        self.places.extend((number + self._added, len(lines), self._out, self._out + len(new)))
        self.places.extend((number, place.begin, place.end, kind))
        self._put(new)
        self._added += len(lines) - 1
        self._at = place.end + len(last)

    def _copy(self, end: int) -> None:
        """Copy the original up to an offset within the chunk."""
        if self.target is not None:
            data = self._chunk.data[self._at - self._chunk.offset : end - self._chunk.offset]
            self._put(data)
        self._at = end

    def _put(self, data: bytes) -> None:
        """Write."""
        assert self.target is not None
        self.target.write(data)
        self._out += len(data)
