"""The grammars of expressions: brackets, operators, functions, variables.

A text is read once, into a function of the variables: in a loop it is computed a thousand times.

Rule: a reader stops where it does not understand (`NotComputableError`) and guesses nothing; work
grows with the length of the text, and brackets deeper than `DEEPEST` are not followed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.interpreter.operations import (
    COMPARISONS,
    NAN,
    VACANT,
    apply,
    arc_tangent,
    call,
)

Variables = Mapping[str, float]
Formula = Callable[[Variables], float]
"""What an expression is worth."""
Naming = Callable[[Variables], str]
"""Which variable is meant; an empty name where that is not known."""

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

    __slots__ = ("at", "depth", "rules", "text")

    def __init__(self, text: bytes, rules: Arithmetic) -> None:
        self.text, self.rules = text, rules
        self.at = self.depth = 0

    def next(self) -> bytes:
        """Look at the next byte; empty at the end."""
        return self.text[self.at : self.at + 1]

    def operator(self) -> tuple[str, int]:
        """Look at the operator that stands here and how it binds; an empty one where none does."""
        pattern, binds = _operators(self.rules.levels)
        match = pattern.match(self.text, self.at)
        return (match[0].decode(), binds[match[0]]) if match else ("", -1)

    def expression(self, least: int) -> Formula:
        """Read operands whose operators bind at least so much."""
        first = self.operand()
        more: list[tuple[str, Formula]] = []
        compared = False
        while True:
            operator, binds = self.operator()
            if not operator or binds < least:
                return _applied(first, more, self.rules) if more else first
            if operator in COMPARISONS:
                if compared and not self.rules.chained:
                    raise NotComputableError
                compared = True
            self.at += len(operator)
            more.append((operator, self.expression(binds + 1)))

    def operand(self) -> Formula:
        """Read one operand with its sign."""
        if (sign := self.next()) in (b"+", b"-") and sign:
            self.at += 1
            if self.next() in (b"+", b"-"):
                raise NotComputableError
            value = self.operand()
            return (lambda known: -value(known)) if sign == b"-" else value
        return self.unsigned(sign)

    def unsigned(self, sign: bytes) -> Formula:
        """Read an operand that begins with this letter or mark."""
        if match := _NUMBER.match(self.text, self.at):
            self.at = match.end()
            return _constant(_finite(float(match[0])))
        if sign == b"#":
            self.at += 1
            return _variable(self.variable(), self.rules.vacant)
        if sign == self.rules.brackets[0].encode():
            return self.bracket()
        return self.function()

    def bracket(self) -> Formula:
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

    def variable(self) -> Naming:
        """Read which variable is meant."""
        if match := _NAME.match(self.text, self.at):
            self.at = match.end()
            return _constant(match[0].decode("latin-1"))
        if match := _INDEX.match(self.text, self.at):
            self.at = match.end()
            return _constant(str(int(match[0])))
        if self.next() == b"#":
            self.at += 1
            self.depth += 1
            if self.depth > DEEPEST:
                raise NotComputableError
            value = _variable(self.variable(), vacant=False)
            self.depth -= 1
        else:
            value = self.bracket()
        return lambda known: _whole_number(value(known))

    def function(self) -> Formula:
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
            other, any_angle = self.bracket(), self.rules.angles

            def of_two(known: Variables) -> float:
                angle = arc_tangent(value(known), other(known))
                return angle if any_angle or angle >= 0.0 else NAN

            return of_two
        return _called(name, value, self.rules)

    def exists(self) -> Formula:
        """Read ``EXISTS[#<name>]``; that a variable is not known does not say that it is not."""
        if self.text[self.at : self.at + 2] != b"[#":
            raise NotComputableError
        self.at += 2
        name = self.variable()
        if self.next() != b"]":
            raise NotComputableError
        self.at += 1
        return lambda known: 1.0 if name(known) in known else NAN


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

    def unsigned(self, sign: bytes) -> Formula:
        """Read an operand that begins with this letter or mark."""
        if match := _WITH_EXPONENT.match(self.text, self.at):
            self.at = match.end()
            return _constant(_finite(float(match[1] + b"E" + (match[2] or b"0"))))
        if sign == b"(":
            return self.bracket()
        return self.word()

    def word(self) -> Formula:
        """Read a name: a constant, a function, or a variable."""
        match = _IDENTIFIER.match(self.text, self.at)
        if not match:
            raise NotComputableError
        self.at = match.end()
        name = match[0].decode()
        if name == "NOT":
            value = self.operand()
            return lambda known: NAN if math.isnan(x := value(known)) else float(x == 0.0)
        if name in ("TRUE", "FALSE"):
            return _constant(float(name == "TRUE"))
        if name in self.rules.functions:
            return self.called(name)
        pattern = _Q if self.rules.q_parameters else _R
        if parameter := pattern.fullmatch(match[0]):
            name = f"{parameter[1].decode()}{int(parameter[2])}"
        naming = self.indexed(name) if self.next() == b"[" else _constant(name)
        if self.next() == b"(":
            raise NotComputableError  # a function of the user's
        return _constant(NAN) if name.startswith("$") else _variable(naming, vacant=False)

    def indexed(self, name: str) -> Naming:
        """Read an index, of which the name of the element follows."""
        self.at += 1
        self.depth += 1
        if self.depth > DEEPEST:
            raise NotComputableError
        values = [self.expression(0)]
        while self.next() == b",":
            self.at += 1
            values.append(self.expression(0))
        if self.next() != b"]":
            raise NotComputableError
        self.at += 1
        self.depth -= 1

        def element(known: Variables) -> str:
            indices = [value(known) for value in values]
            if not all(i == i and i.is_integer() and i >= 0 for i in indices):
                return ""
            if name == "R":
                return f"R{int(indices[0])}" if len(indices) == 1 else ""
            return f"{name}[{','.join(str(int(i)) for i in indices)}]"

        return element

    def called(self, name: str) -> Formula:
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
            if len(values) != 2:
                return _constant(NAN)
            y, x = values
            return lambda known: arc_tangent(y(known), x(known))
        return _called(name, values[0], self.rules) if len(values) == 1 else _constant(NAN)


def _constant(value: Any) -> Callable[[Variables], Any]:
    """The same whatever the variables are."""
    return lambda known: value


def _variable(name: Naming, vacant: bool) -> Formula:
    """What a variable holds; `vacant`: #0 holds nothing."""

    def held(known: Variables) -> float:
        named = name(known)
        return VACANT if vacant and named == "0" else known.get(named, NAN)

    return held


def _applied(first: Formula, more: list[tuple[str, Formula]], rules: Arithmetic) -> Formula:
    """Binary operations, one after another."""

    def result(known: Variables) -> float:
        value = first(known)
        for operator, operand in more:
            value = apply(operator, value, operand(known), rules)
        return value

    return result


def _called(name: str, argument: Formula, rules: Arithmetic) -> Formula:
    """A function of one argument."""
    return lambda known: NAN if math.isnan(x := argument(known)) else call(name, x, rules)


def _whole_number(value: float) -> str:
    """The index that is computed; empty where that is not one."""
    whole = abs(value - round(value)) < WHOLE if math.isfinite(value) else False
    return str(round(value)) if whole else ""


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
