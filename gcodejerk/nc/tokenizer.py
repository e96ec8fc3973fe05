"""The careful reading of one line: every byte is accounted for, and what cannot be is named.

Rule: it never raises. A line that the controller would refuse becomes a block with a `problem`,
its column, and the words in front of it.

The grammar is that of RS274/NGC as LinuxCNC reads it: case does not matter, blanks and tabs count
nowhere outside comments (``g0x +0. 12 34y 7`` is X0.1234 Y7), numbers have no exponent, ``( )``
comments end on their line and do not nest, ``;`` comments run to its end.
"""

from __future__ import annotations

import re

from gcodejerk.nc.block import Block, Word
from gcodejerk.nc.dialect import Dialect

LARGEST = 1e9
"""Numbers beyond this are not understood: no machine has such an axis."""

_BLANKS = re.compile(rb"[ \t]*")
_WORD = re.compile(rb"([A-Za-z])[ \t]*([-+]?[0-9.]+)[ \t]*(?![-+0-9. \t#\[])")
_NUMBER = re.compile(rb"[-+]?[0-9. \t]*")
_SHAPE = re.compile(rb"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_UNSIGNED = re.compile(rb"[0-9]+(?:\.[0-9]*)?")
_OPERATOR_TEXT = re.compile(rb"[ \t]*([A-Za-z][A-Za-z \t]*?)[ \t]*(?=\[)")
_KEYWORD = re.compile(rb"[A-Za-z]*")
_ACTIVE = re.compile(rb"[ \t]*py[ \t]*,", re.IGNORECASE)
_FUNCTIONS = frozenset(
    b"abs acos asin atan cos exists exp fix fup ln round sin sqrt tan".upper().split()
)


class _Odd(Exception):  # noqa: N818 - not an error of ours: a place in the line
    """A problem and where it is, from 0."""

    def __init__(self, problem: str, at: int) -> None:
        super().__init__(problem)
        self.problem = problem
        self.at = at


class _Line:
    """A cursor over one line."""

    __slots__ = ("assigns", "at", "comments", "o_name", "o_word", "text", "words")

    def __init__(self, text: bytes) -> None:
        self.text = text
        self.at = 0
        self.words: list[Word] = []
        self.comments: list[tuple[int, int]] = []
        self.assigns: list[str] = []
        self.o_word: str | None = None
        self.o_name = ""

    def skip(self) -> bytes:
        """Pass over blanks; the next byte, empty at the end."""
        self.at = _BLANKS.match(self.text, self.at).end()  # type: ignore[union-attr]
        return self.text[self.at : self.at + 1]

    def comment(self) -> None:
        """Pass over the comment that begins here."""
        begin, text = self.at, self.text
        if text[begin] == 0x3B:  # ;
            self.at = len(text)
        else:
            end = text.find(b")", begin)
            if end < 0:
                raise _Odd("comment is not closed", begin)
            if text.find(b"(", begin + 1, end) >= 0:
                raise _Odd("comment within a comment", text.find(b"(", begin + 1))
            self.at = end + 1
        if _ACTIVE.match(text, begin + 1):
            raise _Odd("comment runs Python", begin)
        self.comments.append((begin, self.at))

    def number(self) -> float | None:
        """Read the number that begins here; None for an expression."""
        begin = self.at
        byte = self.skip()
        if byte in (b"+", b"-"):
            after = _BLANKS.match(self.text, self.at + 1).end()  # type: ignore[union-attr]
            if self.text[after : after + 1] in (b"#", b"["):
                self.at = after
                byte = self.text[after : after + 1]
        if byte in (b"#", b"[") or byte.isalpha():
            self.operand()
            return None
        match = _NUMBER.match(self.text, self.at)
        assert match is not None
        digits = match[0].replace(b" ", b"").replace(b"\t", b"")
        if not _SHAPE.fullmatch(digits):
            shown = digits.decode("latin-1")
            what = f"'{shown}' is not a number" if shown else "a number is missing"
            raise _Odd(what, begin)
        value = float(digits)
        if not abs(value) <= LARGEST:
            raise _Odd(f"'{digits.decode()}' is beyond any machine", begin)
        self.at = match.start() + len(match[0].rstrip(b" \t"))
        return value

    def operand(self) -> None:
        """Pass over ``#...``, ``[...]`` or ``function[...]``."""
        while (byte := self.skip()) == b"#":
            self.at += 1
        if byte == b"[":
            self.bracket()
        elif byte == b"<":
            end = self.text.find(b">", self.at)
            if end < 0:
                raise _Odd("name is not closed", self.at)
            self.at = end + 1
        elif byte.isdigit():
            match = _UNSIGNED.match(self.text, self.at)
            assert match is not None
            self.at = match.end()
        elif match := _OPERATOR_TEXT.match(self.text, self.at):
            name = match[1].replace(b" ", b"").replace(b"\t", b"").upper()
            if name not in _FUNCTIONS:
                raise _Odd("function is not known", self.at)
            self.at = match.end()
            self.bracket()
            if name == b"ATAN" and self.skip() == b"/":
                self.at += 1
                self.skip()
                self.bracket()
        else:
            raise _Odd("a number is missing", self.at)

    def bracket(self) -> None:
        """Pass over an expression in square brackets."""
        text, begin = self.text, self.at
        if text[begin : begin + 1] != b"[":
            raise _Odd("expression expected", begin)
        depth = 0
        for at in range(begin, len(text)):
            byte = text[at]
            depth += (byte == 0x5B) - (byte == 0x5D)
            if byte in b"(;":
                break
            if depth == 0:
                self.at = at + 1
                return
        raise _Odd("expression is not closed", begin)

    def assignment(self) -> None:
        """Pass over ``#target = value``."""
        self.at += 1
        begin = self.at
        self.operand()
        name = self.text[begin : self.at].strip(b" \t")
        known = name.isdigit() or (name.startswith(b"<") and name.endswith(b">"))
        self.assigns.append(name.decode("latin-1") if known else "")
        if self.skip() != b"=":
            raise _Odd("assignment without =", self.at)
        self.at += 1
        self.number()

    def flow(self) -> None:
        """Pass over an O-word: its name, its keyword, and whatever belongs to that."""
        self.at += 1
        begin = self.at
        self.skip()
        self.operand()
        self.o_name = self.text[begin : self.at].replace(b" ", b"").decode("latin-1").lower()
        self.skip()
        match = _KEYWORD.match(self.text, self.at)
        assert match is not None
        self.o_word = match[0].decode().lower()
        self.at = match.end()
        while byte := self.skip():
            if byte in b"(;":
                self.comment()
            elif byte == b"[":
                self.bracket()
            else:
                raise _Odd("text after an O-word", self.at)

    def word(self) -> None:
        """Take one word."""
        begin = self.at
        letter = self.text[begin : begin + 1].decode().upper()
        if letter == "N" and (self.words or self.comments):
            raise _Odd("N stands behind something else", begin)
        match = _WORD.match(self.text, begin)
        if match and _SHAPE.fullmatch(match[2]):  # the usual case, made quick
            self.at = match.end(2)
            value: float | None = float(match[2])
            if not -LARGEST <= value <= LARGEST:  # type: ignore[operator]
                raise _Odd(f"'{match[2].decode()}' is beyond any machine", begin + 1)
        else:
            self.at = begin + 1
            value = self.number()
        if letter == "N" and (value is None or not self.text[begin + 1 :].lstrip()[:1].isdigit()):
            raise _Odd("N without a plain number", begin)
        text = self.text[begin : self.at]
        self.words.append(Word(letter, value, begin, self.at, text))


def parse_line(text: bytes, dialect: Dialect) -> Block:
    """Read one line without its line end.

    Parameters
    ----------
    text : bytes
        The line.
    dialect : Dialect
        How it is written.

    Returns
    -------
    Block
        With a `problem` where the controller would refuse the line.
    """
    line = _Line(text)
    delete = False
    problem, column, rest, mark = None, None, b"", 0
    try:
        if line.skip() == b"%":
            if text.strip(b" \t") != b"%":
                raise _Odd("text on the line of %", line.at + 1)
            return Block(percent=True)
        if len(text) > dialect.line_limit:
            raise _Odd(f"line is longer than {dialect.line_limit} bytes", dialect.line_limit)
        if text[line.at : line.at + 1] == b"/":
            delete = True
            line.at += 1
        while byte := line.skip():
            mark = line.at
            if byte.isalpha():
                if byte in b"Oo" and all(word.letter == "N" for word in line.words):
                    line.flow()
                else:
                    line.word()
            elif byte in b"(;":
                line.comment()
            elif byte == b"#":
                line.assignment()
            else:
                raise _Odd(f"'{byte.decode('latin-1')}' has no meaning here", line.at)
    except _Odd as odd:
        problem, column, rest = odd.problem, odd.at + 1, text[mark:]
    return Block(
        tuple(line.words),
        tuple(line.comments),
        delete,
        line.o_word,
        line.o_name,
        False,
        tuple(line.assigns),
        rest,
        problem,
        column,
    )
