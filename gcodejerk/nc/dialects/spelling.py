"""How lines of a dialect are spelled: those that are read, and those that are written.

It is a part of `gcodejerk.nc.dialects.dialect`, and holds to its rules.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

_MESSAGE = re.compile(rb"[ \t]*(?:N[0-9]+[ \t]*)?M11[78](?![0-9.])")


@dataclass(frozen=True, slots=True)
class Text:
    """How a line is written."""

    klartext: bool = False
    """Lines are statements of Heidenhain Klartext; of the rest here only `line_limit` holds."""
    parentheses: Literal["comment", "open comment", "lone comment", "code"] = "comment"
    """A comment that has to close on its line; one that the line's end closes too; one that is
    none beside words, since what it holds may be read as words; no comment."""
    capitals: bool = False
    """Small letters outside of comments may be read as nothing."""
    tight: bool = False
    """A tab, a blank behind a sign or a sign in front of a code makes another word of it, or none.
    """
    adjoining: bool = False
    """A blank behind G, M or T, or behind a comment in front of them, leaves no command: ``G 0``,
    ``(rapid) G0 X5``."""
    numbered: bool = True
    """N in front of a block is passed over; otherwise it may make no command of it: who sends the
    program puts another N in front."""
    returns: bool = False
    """A carriage return within a line counts nowhere; otherwise it may end the line."""
    padded: bool = True
    """``G01`` is G1; otherwise it is a code that nobody has."""
    semicolon: Literal["comment", "end", "error"] = "comment"
    """A comment; the end of the block, behind which only text may stand that is no block of its
    own; neither."""
    slashes: bool = False
    """``//`` begins a comment."""
    python: bool = False
    """A comment may run a program: ``(py, ...)``."""
    messages: bool = False
    """Behind M117 and M118 the rest of the line is text."""
    live_comments: bool = False
    """One that begins with a word and a comma may do something: ``(expr, ...)``, but for texts."""
    inner_semicolon: bool = False
    """A ``;`` within parentheses may end the line."""
    instant: bytes = b""
    """Bytes that are commands of the control when they arrive, wherever they stand."""
    delete: Literal["first", "numbered", "none"] = "first"
    """A ``/`` skips the block where the operator says so: in front of everything; there or behind
    N, also with a level ``/1`` to ``/9``; an error."""
    o_word: Literal["flow", "program", "error"] = "error"
    """``o100 while [..]``; ``O1234`` names a program (and so does ``:1234``); neither."""
    percent: Literal["lone", "leader", "named", "error"] = "lone"
    """A ``%`` stands alone; the number of a program and comments may stand on its line, which is
    not read; a name may follow it; it is an error."""
    leader: bool = False
    """What stands in front of the first ``%`` is not read, and the first line may be the name of
    the file."""
    names: bool = False
    """Words may have names, and arguments in parentheses: ``CYCLE81(..)``."""
    equals: bool = False
    """A value may follow an equals sign: ``X=IC(5)``, ``T1=5``."""
    variables: Literal["#", "R", "Q", "none"] = "none"
    """What a variable begins with."""
    open_expressions: bool = False
    """An assignment takes an expression without brackets: ``#1=#2+1``."""
    keywords: tuple[str, ...] = ()
    """Words of program flow that hold no number: ``GOTO``."""
    blanks: Literal["anywhere", "between"] = "between"
    """Blanks count nowhere, also within numbers; or they stand between words only."""
    checksum: bool = False
    """``*123`` may end a line."""
    strings: bool = False
    """A word may hold a name: ``T="DRILL 8.5"``."""
    hexadecimal: bool = False
    """A zero in front of an X begins a hexadecimal number: ``Y0X10`` is Y16."""
    exponents: bool = False
    """An E behind a digit or a point begins an exponent: ``X1E3`` is X1000."""
    end: bytes = b""
    """What ends every block."""
    line_limit: int = 512
    """Longest line that the controller reads, in bytes."""
    long_comments: bool = False
    """A line of comments alone does nothing, however long it is."""
    characters: int = 0
    """Most of a line without its comments and blanks; 0: what `line_limit` says."""
    digits: int = 0
    """Digits of a number that count, leading zeros among them, and the rest is lost; 0: all."""
    number_digits: int = 0
    """Digits of N up to which no number is too large; 0: none is."""

    @property
    def shortest(self) -> int:
        """Length of a line up to which none is too long."""
        return self.characters or self.line_limit

    @property
    def loose(self) -> bool:
        """Blanks may stand between a letter and its number, whatever letter it is."""
        odd = self.klartext or self.tight or self.adjoining or not self.padded
        return self.blanks == "anywhere" or not odd

    def unsaid(self, text: bytes) -> bytes:
        """Cut a line where its message begins."""
        message = _MESSAGE.match(text) if self.messages else None
        return text if message is None else message[0]


@dataclass(frozen=True, slots=True)
class Writing:
    """How a stream is spelled in the dialect, and what its control keeps of a number."""

    comment: tuple[bytes, bytes] = (b"(", b")")
    standstill: bytes = b"G4 P0"
    """A block that waits until the machine stands."""
    line_limit: int = 0
    """Longest line that is written, in bytes; 0: the longest that the control reads."""
    digits: int = 15
    """Most digits of a number of a point, F too, leading zeros left out."""
    doubles: bool = False
    """The control computes with the decimals of a double: steps finer than an axis's resolution are
    kept, and not rounded one by one."""
