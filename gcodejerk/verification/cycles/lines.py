"""Lines that the proof of an expansion compares: one of the original, and those in its place."""

from __future__ import annotations

from dataclasses import dataclass

from gcodejerk.nc import Block
from gcodejerk.verification.bytes.source import Window


@dataclass(frozen=True, slots=True)
class OriginalLine:
    """A line of the original, and what the first reading made of it."""

    text: bytes
    """Without its line end."""
    whole: bytes
    number: int
    block: Block
    here: list[float]
    """Positions in front of it. [mm, deg]"""
    ended: bool
    """The program ended in front of it."""
    sure: bool
    """It is understood, and certain to run once."""
    hole: bool
    """It names axes while a cycle is in force."""

    @property
    def codes(self) -> list[float | None]:
        """The numbers of its G words."""
        return [word.value for word in self.block.words if word.letter == "G"]

    @property
    def dwells(self) -> bool:
        """Whether it states a P."""
        return any(word.letter == "P" for word in self.block.words)


class WrittenLines:
    """The lines that stand in the place of one block."""

    def __init__(self, theirs: Window) -> None:
        self.theirs = theirs
        self.ends: list[bytes] = []

    def peek(self) -> bytes:
        """The next line without its end."""
        return self.theirs.peek_line().removesuffix(b"\n").removesuffix(b"\r")

    def next(self) -> bytes:
        """Take it."""
        whole, bare = self.theirs.peek_line(), self.peek()
        self.ends.append(whole[len(bare) :])
        self.theirs.skip(len(whole))
        return bare

    def well_ended(self, end: bytes, last: bytes) -> bool:
        """Whether every line taken ends in one way, and the last one as the block did."""
        return self.ends[-1:] == [last] and all(got == end for got in self.ends[:-1])


def squeezed(text: bytes) -> bytes:
    """Without blanks."""
    return b"".join(text.split())
