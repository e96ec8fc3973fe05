"""The grammars of expressions: brackets, operators, functions, variables.

Rule: a reader stops where it does not understand (`NotComputableError`) and guesses nothing; work
grows with the length of the text, and brackets deeper than `DEEPEST` are not followed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import cache

from gcodejerk.nc.dialects.dialect import Arithmetic
from gcodejerk.nc.interpreter.operations import (
    COMPARISONS,
    NAN,
    VACANT,
    apply,
    arc_tangent,
    call,
)

DEEPEST = 40
"""Brackets within brackets."""
WHOLE = 0.0001
"""How far a computed index of a variable may be from a whole number."""

_NUMBER = re.compile(rb"[0-9]+(?:\.[0-9]*)?|\.[0-9]+")
_LETTERS = re.compile(rb"[A-Z]+[0-9]?")
_INDEX = re.compile(rb"[0-9]+")
_NAME = re.compile(rb"<[^<>\[\]#]+>")
_BLANKS = re.compile(rb"[ \t]*")
_WITH_EXPONENT = re.compile(
    rb"((?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))(?:EX([-+]?[0-9]{1,3}))?(?![A-Z0-9_.])"
)
_IDENTIFIER = re.compile(rb"\$?[A-Z_][A-Z0-9_]*")
_R = re.compile(rb"(R)([0-9]+)")
_Q = re.compile(rb"(Q[LR]?)([0-9]+)")


class NotComputableError(Exception):
    """What stands here is no expression."""


class Reader:
    """A cursor over an expression without blanks, in upper case."""

    __slots__ = ("at", "depth", "rules", "text", "variables")

    def __init__(self, text: bytes, variables: Mapping[str, float], rules: Arithmetic) -> None:
        self.text, self.variables, self.rules = text, variables, rules
        self.at = self.depth = 0

    def next(self) -> bytes:
        """Look at the next byte; empty at the end."""
        return self.text[self.at : self.at + 1]

    def operator(self) -> tuple[str, int]:
        """Look at the operator that stands here and how it binds; an empty one where none does."""
        pattern, binds = _operators(self.rules.levels)
        match = pattern.match(self.text, self.at)
        return (match[0].decode(), binds[match[0]]) if match else ("", -1)

    def expression(self, least: int) -> float:
        """Read operands whose operators bind at least so much."""
        left = self.operand()
        compared = False
        while True:
            operator, binds = self.operator()
            if not operator or binds < least:
                return left
            if operator in COMPARISONS:
                if compared and not self.rules.chained:
                    raise NotComputableError
                compared = True
            self.at += len(operator)
            left = apply(operator, left, self.expression(binds + 1), self.rules)

    def operand(self) -> float:
        """Read one operand with its sign."""
        if (sign := self.next()) in (b"+", b"-") and sign:
            self.at += 1
            if self.next() in (b"+", b"-"):
                raise NotComputableError
            value = self.operand()
            return -value if sign == b"-" else value
        return self.unsigned(sign)

    def unsigned(self, sign: bytes) -> float:
        """Read an operand that begins with this letter or mark."""
        if match := _NUMBER.match(self.text, self.at):
            self.at = match.end()
            return _finite(float(match[0]))
        if sign == b"#":
            self.at += 1
            name = self.variable()
            return VACANT if name == "0" and self.rules.vacant else self.variables.get(name, NAN)
        if sign == self.rules.brackets[0].encode():
            return self.bracket()
        return self.function()

    def bracket(self) -> float:
        """Read an expression in brackets."""
        opens, closes = self.rules.brackets
        if self.next() != opens.encode() or self.depth >= DEEPEST:
            raise NotComputableError
        self.at += 1
        self.depth += 1
        value = self.expression(0)
        if self.next() != closes.encode():
            raise NotComputableError
        self.at += 1
        self.depth -= 1
        return value

    def variable(self) -> str:
        """Read which variable is meant; an empty name where that is not known."""
        if match := _NAME.match(self.text, self.at):
            self.at = match.end()
            return match[0].decode("latin-1")
        if match := _INDEX.match(self.text, self.at):
            self.at = match.end()
            return str(int(match[0]))
        if self.next() == b"#":
            self.at += 1
            self.depth += 1
            if self.depth > DEEPEST:
                raise NotComputableError
            value = self.variables.get(self.variable(), NAN)
            self.depth -= 1
        else:
            value = self.bracket()
        whole = abs(value - round(value)) < WHOLE if math.isfinite(value) else False
        return str(round(value)) if whole else ""

    def function(self) -> float:
        """Read a function with its argument."""
        match = _LETTERS.match(self.text, self.at)
        if not match or (name := match[0].decode()) not in self.rules.functions:
            raise NotComputableError
        self.at = match.end()
        if name == "EXISTS":
            return self.exists()
        value = self.bracket()
        if name == "ATAN":
            if self.next() != b"/":
                raise NotComputableError
            self.at += 1
            other = self.bracket()
            angle = arc_tangent(value, other)
            return angle if self.rules.angles or angle >= 0.0 else NAN
        if math.isnan(value):
            return NAN
        return call(name, value, self.rules)

    def exists(self) -> float:
        """Read ``EXISTS[#<name>]``; that a variable is not known does not say that it is not."""
        if self.text[self.at : self.at + 2] != b"[#":
            raise NotComputableError
        self.at += 2
        known = self.variable() in self.variables
        if self.next() != b"]":
            raise NotComputableError
        self.at += 1
        return 1.0 if known else NAN


class NamedReader(Reader):
    """A cursor over an expression with round brackets, in upper case: ``(R1+DEPTH[2]) DIV 3``.

    Blanks separate words here.
    """

    __slots__ = ()

    def next(self) -> bytes:
        """Pass over blanks, and look at the next byte."""
        self.at = _BLANKS.match(self.text, self.at).end()  # type: ignore[union-attr]
        return super().next()

    def operator(self) -> tuple[str, int]:
        """Look at the operator that stands here; a word is not glued to what follows."""
        self.next()
        operator, binds = super().operator()
        behind = self.text[self.at + len(operator) : self.at + len(operator) + 1]
        if operator[:1].isalpha() and (behind.isalnum() or behind == b"_"):
            raise NotComputableError
        return operator, binds

    def unsigned(self, sign: bytes) -> float:
        """Read an operand that begins with this letter or mark."""
        if match := _WITH_EXPONENT.match(self.text, self.at):
            self.at = match.end()
            return _finite(float(match[1] + b"E" + (match[2] or b"0")))
        if sign == b"(":
            return self.bracket()
        return self.word()

    def word(self) -> float:
        """Read a name: a constant, a function, or a variable."""
        match = _IDENTIFIER.match(self.text, self.at)
        if not match:
            raise NotComputableError
        self.at = match.end()
        name = match[0].decode()
        if name == "NOT":
            value = self.operand()
            return NAN if math.isnan(value) else float(value == 0.0)
        if name in ("TRUE", "FALSE"):
            return float(name == "TRUE")
        if name in self.rules.functions:
            return self.called(name)
        pattern = _Q if self.rules.q_parameters else _R
        if parameter := pattern.fullmatch(match[0]):
            name = f"{parameter[1].decode()}{int(parameter[2])}"
        if self.next() == b"[":
            name = self.indexed(name)
        if self.next() == b"(":
            raise NotComputableError  # a function of the user's
        return NAN if name.startswith("$") else self.variables.get(name, NAN)

    def indexed(self, name: str) -> str:
        """Read an index; the name of the element, empty where that is not known."""
        self.at += 1
        self.depth += 1
        if self.depth > DEEPEST:
            raise NotComputableError
        indices = [self.expression(0)]
        while self.next() == b",":
            self.at += 1
            indices.append(self.expression(0))
        if self.next() != b"]":
            raise NotComputableError
        self.at += 1
        self.depth -= 1
        if not all(i == i and i.is_integer() and i >= 0 for i in indices):
            return ""
        if name == "R":
            return f"R{int(indices[0])}" if len(indices) == 1 else ""
        return f"{name}[{','.join(str(int(i)) for i in indices)}]"

    def called(self, name: str) -> float:
        """Read a function with its arguments."""
        if self.next() != b"(" or self.depth >= DEEPEST:
            raise NotComputableError
        self.at += 1
        self.depth += 1
        values = [self.expression(0)]
        while self.next() == b",":
            self.at += 1
            values.append(self.expression(0))
        if self.next() != b")":
            raise NotComputableError
        self.at += 1
        self.depth -= 1
        if name == "ATAN2":
            return arc_tangent(*values) if len(values) == 2 else NAN
        if len(values) != 1 or math.isnan(values[0]):
            return NAN
        return call(name, values[0], self.rules)


def _finite(number: float) -> float:
    """Refuse a number that is too large to be one."""
    return number if math.isfinite(number) else NAN


@cache
def _operators(levels: tuple[tuple[str, ...], ...]) -> tuple[re.Pattern[bytes], dict[bytes, int]]:
    """A pattern of all operators, the longest first, and how each binds."""
    binds: dict[bytes, int] = {}
    for level, names in enumerate(levels):
        for name in names:
            binds.setdefault(name.encode(), len(levels) - level)
    longest = sorted(binds, key=len, reverse=True)
    return re.compile(b"|".join(map(re.escape, longest)) or rb"(?!)"), binds
