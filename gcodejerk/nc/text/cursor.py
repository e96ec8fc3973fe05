"""A cursor over one line, and the numbers and expressions that it passes over.

Rule: an expression is passed over, not computed (`expressions` does that when the block runs); here
only its end is found.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.spelling import Text
from gcodejerk.nc.text.block import Word
from gcodejerk.nc.text.q_parameters import VALUE

LARGEST = 1e9
"""Numbers beyond this are not understood: no machine has such an axis."""

BLANKS = re.compile(rb"[ \t]*")
SHAPE = re.compile(rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
CLOSED_NUMBER = re.compile(rb"[-+]?[ \t]*[0-9.]*")
_UNSIGNED = re.compile(rb"[0-9]+(?:\.[0-9]*)?")
_OPERATOR_TEXT = re.compile(rb"[ \t]*([A-Za-z][A-Za-z \t]*?)[ \t]*(?=\[)")
_OPERATOR = re.compile(rb"[ \t]*(?:[*/]|[-+]|MOD|AND|OR|XOR)(?=[-+#\[0-9. \tA-Z])", re.IGNORECASE)
_FUNCTIONS = frozenset(
    b"abs acos asin atan cos exists exp fix fup ln round sin sqrt tan".upper().split()
)
_NUMBER = re.compile(rb"[-+]?[0-9. \t]*")


_NAMED_OPERAND = re.compile(
    rb"[ \t]*(?:NOT[ \t]+|NOT(?=[ \t]*\())?[-+]?[ \t]*"
    rb"(?:(?P<open>\()|\"[^\"]*\"|(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:EX[-+]?[0-9]+)?"
    rb"|(?P<name>\$?[A-Z_][A-Z0-9_]*))",
    re.IGNORECASE,
)
_NAMED_OPERATOR = re.compile(
    rb"[ \t]*(?:<<|==|<>|>=|<=|[-+*/<>]|(?:DIV|MOD|AND|OR|XOR|B_AND|B_OR|B_XOR)(?![A-Z0-9_]))",
    re.IGNORECASE,
)
_BEHIND_NAME = re.compile(rb"[ \t]*([\[(])")
_PAIRS = {0x28: 0x29, 0x5B: 0x5D}


class SyntaxProblem(Exception):  # noqa: N818 - not an error of ours: a place in the line
    """A problem and where it is, from 0."""

    def __init__(self, problem: str, at: int) -> None:
        super().__init__(problem)
        self.problem = problem
        self.at = at


class Cursor:
    """A place in a line."""

    __slots__ = ("assigned", "assigns", "at", "rules", "text")

    def __init__(self, text: bytes, rules: Text) -> None:
        self.text = text
        self.rules = rules
        self.at = 0
        self.assigns: list[str] = []
        self.assigned: list[bytes] = []

    def skip(self) -> bytes:
        """Pass over blanks; the next byte, empty at the end."""
        self.at = BLANKS.match(self.text, self.at).end()  # type: ignore[union-attr]
        return self.text[self.at : self.at + 1]

    def unread(self, words: list[Word], mark: int) -> bytes:
        """What is not understood; the last word, too, where its number may go on behind a blank."""
        if words and self.text[mark : mark + 1].strip(b"0123456789.") != self.text[mark : mark + 1]:
            mark = words.pop().begin
        return self.text[mark:]

    def number(self) -> float | None:
        """Read the number that begins here; None for an expression."""
        begin = self.at
        byte = self.skip()
        if byte in (b"+", b"-"):
            after = BLANKS.match(self.text, self.at + 1).end()  # type: ignore[union-attr]
            if self.text[after : after + 1] in (b"#", b"["):
                self.at = after
                byte = self.text[after : after + 1]
        if self.rules.variables == "Q" and (parameter := VALUE.match(self.text, self.at)):
            self.at = parameter.end()
            return None
        if byte in (b"#", b"[") or byte.isalpha():
            if self.rules.variables != "#":
                raise SyntaxProblem("a number is missing", begin)
            self.operand()
            return None
        pattern = _NUMBER if self.rules.blanks == "anywhere" else CLOSED_NUMBER
        match = pattern.match(self.text, self.at)
        assert match is not None
        digits = match[0].replace(b" ", b"").replace(b"\t", b"")
        if not SHAPE.fullmatch(digits):
            shown = digits.decode("latin-1")
            what = f"'{shown}' is not a number" if shown else "a number is missing"
            raise SyntaxProblem(what, begin)
        if pattern is CLOSED_NUMBER and not match[0].startswith(digits):
            raise SyntaxProblem("a blank behind the sign", begin)
        value = float(digits)
        if not abs(value) <= LARGEST:
            raise SyntaxProblem(f"'{digits.decode()}' is beyond any machine", begin)
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
                raise SyntaxProblem("name is not closed", self.at)
            self.at = end + 1
        elif byte.isdigit():
            match = _UNSIGNED.match(self.text, self.at)
            assert match is not None
            self.at = match.end()
        elif match := _OPERATOR_TEXT.match(self.text, self.at):
            name = match[1].replace(b" ", b"").replace(b"\t", b"").upper()
            if name not in _FUNCTIONS:
                raise SyntaxProblem("function is not known", self.at)
            self.at = match.end()
            self.bracket()
            if name == b"ATAN" and self.skip() == b"/":
                self.at += 1
                self.skip()
                self.bracket()
        else:
            raise SyntaxProblem("a number is missing", self.at)

    def bracket(self) -> None:
        """Pass over an expression in square brackets."""
        text, begin = self.text, self.at
        if text[begin : begin + 1] != b"[":
            raise SyntaxProblem("expression expected", begin)
        depth = 0
        for at in range(begin, len(text)):
            byte = text[at]
            depth += (byte == 0x5B) - (byte == 0x5D)
            if byte in b"(;":
                break
            if depth == 0:
                self.at = at + 1
                return
        raise SyntaxProblem("expression is not closed", begin)

    def named_expression(self) -> None:
        """Pass over an expression of names and round brackets: ``(R1+DEPTH[2]) DIV 3``."""
        text = self.text
        while True:
            match = _NAMED_OPERAND.match(text, self.at)
            if not match:
                raise SyntaxProblem("a value is missing", self.at)
            self.at = match.end()
            if match["open"]:
                self.at -= 1
                self.pair()
            elif match["name"]:
                while behind := _BEHIND_NAME.match(text, self.at):
                    self.at = behind.start(1)
                    self.pair()
            operator = _NAMED_OPERATOR.match(text, self.at)
            if not operator:
                return
            self.at = operator.end()

    def pair(self) -> None:
        """Pass over brackets, round or square, and all in them; quoted text counts as such."""
        text, begin = self.text, self.at
        closing: list[int] = []
        quoted = False
        for at in range(begin, len(text)):
            byte = text[at]
            if byte == 0x22:
                quoted = not quoted
            elif quoted:
                continue
            elif byte in _PAIRS:
                closing.append(_PAIRS[byte])
            elif closing and byte == closing[-1]:
                closing.pop()
                if not closing:
                    self.at = at + 1
                    return
            elif byte in b")];":
                break
        raise SyntaxProblem("parenthesis is not closed", begin)

    def assignment(self) -> None:
        """Pass over ``#target = value``."""
        self.at += 1
        begin = self.at
        self.operand()
        name = self.text[begin : self.at].strip(b" \t")
        known = name.isdigit() or (name.startswith(b"<") and name.endswith(b">"))
        self.assigns.append(name.decode("latin-1") if known else "")
        self.assigned.append(b"")
        if self.skip() != b"=":
            raise SyntaxProblem("assignment without =", self.at)
        self.at += 1
        begin = self.at
        self.number()
        if self.rules.open_expressions:
            while match := _OPERATOR.match(self.text, self.at):
                self.at = match.end()
                self.number()
        self.assigned[-1] = self.text[begin : self.at]


def shown(byte: bytes) -> str:
    """A byte in a message: itself, or its number where it would not be seen."""
    return f"'{byte.decode()}'" if 0x20 < byte[0] < 0x7F else f"byte 0x{byte[0]:02x}"
