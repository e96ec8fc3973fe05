"""A file read forwards through a window, so that memory does not grow with it.

Rule: bytes are handed out exactly as they are; a line is what ends with LF.
"""

from __future__ import annotations

import hashlib
import re
from typing import BinaryIO

PIECE = 1 << 18
"""Bytes read and compared at a time."""
LONGEST_LINE = 1 << 16
"""What is longer is not a line of a program."""
_SUM = re.compile(rb"gcodejerk stamp [ -~]{1,40}? sum:([0-9a-f]{16})")
"""A sum in a stamp; it counts as zeros in itself, and stands in the first piece of the file."""


class Window:
    """A place in a file, with what follows it."""

    __slots__ = (
        "_begun",
        "_counted",
        "_digest",
        "_ended",
        "_line",
        "at",
        "claimed",
        "data",
        "file",
        "passed",
        "passes",
    )

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.data = b""
        """What is in memory; the place itself is ``data[at]``."""
        self.at = 0
        self._line, self._counted = 1, 0
        """Number of a line, and the place in it up to which lines were counted."""
        self.passes = 0
        """Bytes that were passed."""
        self._ended = False
        self._digest = hashlib.blake2b(digest_size=8)
        self._begun = False
        self.passed: list[bytes] | None = None
        """Takes what is passed, where somebody wants to know."""
        self.claimed: str | None = None
        """The sum of the whole file, as its stamp states it."""

    @property
    def line(self) -> int:
        """Number of the line that the place is in; lines are counted when somebody asks."""
        self._line += self.data.count(b"\n", self._counted, self.at)
        self._counted = self.at
        return self._line

    def begin_line(self, line: int) -> None:
        """Say which line the place is in."""
        self._line, self._counted = line, self.at

    @property
    def sum(self) -> str:
        """The sum of what has been read."""
        return self._digest.hexdigest()

    def _add(self, piece: bytes) -> None:
        """Add a piece to the sum."""
        match = None if self._begun else _SUM.search(piece)
        self._begun = True
        if match:
            self.claimed = match[1].decode()
            piece = piece[: match.start(1)] + b"0" * len(match[1]) + piece[match.end(1) :]
        self._digest.update(piece)

    def fill(self, size: int) -> int:
        """Have this many bytes in memory behind the place, or all there are; how many they are."""
        have = len(self.data) - self.at
        if have >= size:
            return size
        if not self._ended:
            line = self.line
            parts = [self.data[self.at :]]
            while have < size:
                piece = self.file.read(max(PIECE, size - have))
                if not piece:
                    self._ended = True
                    break
                self._add(piece)
                parts.append(piece)
                have += len(piece)
            self.data, self.at = b"".join(parts), 0
            self.begin_line(line)
        return min(size, have)

    def peek(self, size: int) -> bytes:
        """Look at the next bytes, fewer at the end of the file."""
        if self.at + size > len(self.data):
            self.fill(size)
        return self.data[self.at : self.at + size]

    def follows(self, text: bytes) -> bool:
        """Whether these are the next bytes."""
        if self.at + len(text) > len(self.data):
            self.fill(len(text))
        return self.data.startswith(text, self.at)

    def skip(self, size: int) -> None:
        """Go on by bytes that are in memory."""
        if self.passed is not None:
            self.passed.append(self.data[self.at : self.at + size])
        self.at += size
        self.passes += size

    def take(self, size: int) -> bytes:
        """Take the next bytes."""
        taken = self.peek(size)
        self.skip(len(taken))
        return taken

    def peek_line(self) -> bytes:
        """Look at the rest of the line, its end included; empty at the end of the file."""
        have = self.fill(LONGEST_LINE)
        end = self.data.find(b"\n", self.at, self.at + have)
        return self.data[self.at : self.at + have if end < 0 else end + 1]

    @property
    def ended(self) -> bool:
        """Whether nothing follows."""
        return self.fill(1) == 0


def skip_common(one: Window, other: Window, size: int | None) -> int | None:
    """Go on in both files as long as they agree.

    Parameters
    ----------
    one, other : Window
        The files.
    size : int, optional
        Bytes of `one` to pass; to its end where left out.

    Returns
    -------
    int or None
        Lines passed; None where they differ: both then stand at the first line that does.
    """
    lines = 0
    if size is not None and size <= PIECE:  # the most usual: a few lines between two streams
        text = one.peek(size)
        if len(text) == size and other.follows(text):
            one.skip(size)
            other.skip(size)
            return text.count(b"\n")
    while size is None or size > 0:
        want = PIECE if size is None else min(PIECE, size)
        have = one.fill(want)
        if not have:
            break
        if other.fill(have) < have or one.peek(have) != other.peek(have):
            while (line := one.peek_line()[:have]) and line == other.peek(len(line)):
                one.skip(len(line))
                other.skip(len(line))
                have -= len(line)
            return None
        before = one.line
        one.skip(have)
        other.skip(have)
        lines += one.line - before
        size = None if size is None else size - have
    return lines
