"""One line of a program as the careful tokenizer sees it: words, comments, what is wrong with it.

Rule: a block is what is written, not what it means. Meaning needs the modal state (`modal`).

They are tuples with names: one is made for every word that is read with care, and a frozen
dataclass takes four times as long to make.
"""

from __future__ import annotations

from typing import NamedTuple


class Word(NamedTuple):
    """A letter with its number, for example ``X-1.5``."""

    letter: str
    """Address, upper case."""
    value: float | None
    """None where the number is an expression or a variable."""
    begin: int
    """The word is ``line[begin:end]``."""
    end: int
    text: bytes
    whole: bool = False
    """The number has no decimal point."""
    function: str = ""
    """``IC`` and its kin, in ``X=IC(5)``."""


class Name(NamedTuple):
    """A word that has a name, for example ``CYCLE81(..)``, ``TRANS`` or ``GOTO 100``."""

    name: str
    """Upper case."""
    arguments: bytes
    """What belongs to it, brackets included."""


class Block(NamedTuple):
    """A line: its words in the order written, and what else stands on it."""

    words: tuple[Word, ...] = ()
    comments: tuple[tuple[int, int], ...] = ()
    """Spans of the comments, brackets or semicolon included."""
    block_delete: bool = False
    o_word: str | None = None
    """What follows an O number or name, for example ``endif``; empty after a bare one."""
    o_name: str = ""
    percent: bool = False
    """The line holds a ``%``, alone or with a name."""
    assigns: tuple[str, ...] = ()
    """Targets of assignments, for example ``1`` or ``<depth>``; empty text where computed."""
    assigned: tuple[bytes, ...] = ()
    """What each of them is set to, as written."""
    o_arguments: tuple[bytes, ...] = ()
    """Expressions behind the keyword of an O-word, brackets included."""
    rest: bytes = b""
    """The rest of the line from the word that has the problem."""
    problem: str | None = None
    column: int | None = None
    """Where the problem is, counted from 1."""
    names: tuple[Name, ...] = ()


ELSEWHERE = 1_000_000_000
"""Numbers of lines in other files begin here: they run with the program, and are not its own."""


class Line(NamedTuple):
    """A line with its place in the file, kept where it may run more than once."""

    text: bytes
    """Without its end."""
    begin: int
    """Byte offset."""
    number: int
    """Counted from 1."""
    terminator: int
    """As `Rapids.terminator`."""
    block: Block

    @property
    def end(self) -> int:
        """Offset behind the line's end."""
        return self.begin + len(self.text) + (self.terminator and (self.terminator % 2 or 2))
