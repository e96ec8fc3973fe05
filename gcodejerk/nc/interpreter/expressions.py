"""Numbers that a program computes: ``[#1 + 2 * SIN[30]]``, ``R1+5*(R2-1)``.

Rule 1: NaN is a number that is not known. It comes out wherever a variable is unknown, where the
control would stop (a division by zero, the root of a negative number) or where two controls of the
dialect could differ; nothing here raises.

Rule 2: the grammar is the dialect's table (`Arithmetic`); work grows with the length of the text,
and brackets deeper than `DEEPEST` are not followed.
"""

from __future__ import annotations

import math
import operator as operators
import re
from collections.abc import Callable, Mapping
from functools import cache

from gcodejerk.nc.dialects.dialect import Arithmetic

NAN = math.nan
DEEPEST = 40
"""Brackets within brackets."""
EQUAL = 0.0001
"""LinuxCNC's tolerance of EQ and NE (TOLERANCE_EQUAL)."""
WHOLE = 0.0001
"""How far a computed index of a variable may be from a whole number."""
LARGEST_TANGENT = 1e9
"""Beyond it the last digit of pi decides, at 90 degrees even the sign."""
LARGEST_ANGLE = 1e6
"""Degrees beyond which the last digits of an angle, which rounding decides, are too many turns."""
NEARLY_ZERO = 1e-9
"""What a zero may be after errors of rounding, on one side or the other."""
LARGEST_DIVIDED = 1e8
"""The rest that MOD leaves of more is made of errors of rounding."""
LARGEST_ROUNDED = 2.0**31
"""ROUND goes through an integer of the control."""

_NUMBER = re.compile(rb"[0-9]+\.?[0-9]*|\.[0-9]+")
_SPLIT = re.compile(rb"[0-9.][ \t]+[0-9.]")
_LETTERS = re.compile(rb"[A-Z]+[0-9]?")
_INDEX = re.compile(rb"[0-9]+")
_NAME = re.compile(rb"<[^<>\[\]#]+>")
_R = re.compile(rb"R([0-9]+)(?![0-9.])")


class _NotComputableError(Exception):
    """What stands here is no expression."""


def variable_name(text: bytes) -> str:
    """Name of a variable as the state holds it: blanks and case make no difference.

    Examples
    --------
    >>> variable_name(b"< My depth >"), variable_name(b"0012"), variable_name(b"R5")
    ('<MYDEPTH>', '12', 'R5')
    """
    name = text.translate(None, b" \t").decode("latin-1").upper()
    return str(int(name)) if name.isdigit() else name


def evaluate(text: bytes, variables: Mapping[str, float], rules: Arithmetic) -> float:
    r"""Compute an expression.

    Parameters
    ----------
    text : bytes
        As written: a number, a variable, brackets with an expression in them.
    variables : mapping of str to float
        Those that are known, by `variable_name`.
    rules : Arithmetic
        The dialect's.

    Returns
    -------
    float
        NaN where it is not known.

    Examples
    --------
    >>> from gcodejerk.nc.dialects.linuxcnc import LINUXCNC
    >>> evaluate(b"[#1 + 2 ** 3]", {"1": 4.0}, LINUXCNC.arithmetic)
    12.0
    """
    if _SPLIT.search(text):
        return NAN  # one number with a blank in it, or two: dialects differ
    reader = _Reader(text.translate(None, b" \t").upper(), variables, rules)
    try:
        value = reader.expression(0)
    except (_NotComputableError, ArithmeticError, ValueError):
        return NAN
    return value if reader.at == len(reader.text) and math.isfinite(value) else NAN


class _Reader:
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
        while True:
            operator, binds = self.operator()
            if not operator or binds < least:
                return left
            self.at += len(operator)
            left = _apply(operator, left, self.expression(binds + 1), self.rules)

    def operand(self) -> float:
        """Read one operand with its sign."""
        if (sign := self.next()) in (b"+", b"-") and sign:
            self.at += 1
            if self.next() in (b"+", b"-"):
                raise _NotComputableError
            value = self.operand()
            return -value if sign == b"-" else value
        if match := _NUMBER.match(self.text, self.at):
            self.at = match.end()
            return float(match[0])
        if sign == b"#":
            self.at += 1
            return self.variables.get(self.variable(), NAN)
        if sign == self.rules.brackets[0].encode():
            return self.bracket()
        if self.rules.brackets == "()" and (match := _R.match(self.text, self.at)):
            self.at = match.end()
            return self.variables.get(f"R{int(match[1])}", NAN)
        return self.function()

    def bracket(self) -> float:
        """Read an expression in brackets."""
        opens, closes = self.rules.brackets
        if self.next() != opens.encode() or self.depth >= DEEPEST:
            raise _NotComputableError
        self.at += 1
        self.depth += 1
        value = self.expression(0)
        if self.next() != closes.encode():
            raise _NotComputableError
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
                raise _NotComputableError
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
            raise _NotComputableError
        self.at = match.end()
        if name == "EXISTS":
            return self.exists()
        value = self.bracket()
        if name == "ATAN":
            if self.next() != b"/":
                raise _NotComputableError
            self.at += 1
            other = self.bracket()
            if abs(value) <= NEARLY_ZERO * max(1.0, abs(other)) and other <= NEARLY_ZERO:
                return NAN  # 180 or -180: the sign of a zero decides
            angle = math.degrees(math.atan2(value, other))
            return angle if self.rules.angles or angle >= 0.0 else NAN
        if math.isnan(value):
            return NAN
        return _call(name, value, self.rules)

    def exists(self) -> float:
        """Read ``EXISTS[#<name>]``; that a variable is not known does not say that it is not."""
        if self.text[self.at : self.at + 2] != b"[#":
            raise _NotComputableError
        self.at += 2
        known = self.variable() in self.variables
        if self.next() != b"]":
            raise _NotComputableError
        self.at += 1
        return 1.0 if known else NAN


@cache
def _operators(levels: tuple[tuple[str, ...], ...]) -> tuple[re.Pattern[bytes], dict[bytes, int]]:
    """A pattern of all operators, the longest first, and how each binds."""
    binds: dict[bytes, int] = {}
    for level, names in enumerate(levels):
        for name in names:
            binds.setdefault(name.encode(), len(levels) - level)
    longest = sorted(binds, key=len, reverse=True)
    return re.compile(b"|".join(map(re.escape, longest)) or rb"(?!)"), binds


def _apply(operator: str, a: float, b: float, rules: Arithmetic) -> float:
    """Compute a binary operation."""
    if math.isnan(a) or math.isnan(b):
        return NAN
    if operator in ("AND", "OR", "XOR"):
        return NAN if rules.bits else float(_LOGIC[operator](a != 0.0, b != 0.0))
    if operator == "MOD":
        if abs(a) >= LARGEST_DIVIDED:
            return NAN
        left = math.fmod(a, b)
        if left < 0.0 and not rules.floor:
            return NAN
        return left if left >= 0.0 else abs(left + abs(b))
    return float(_OPERATIONS[operator](a, b))


def _call(name: str, x: float, rules: Arithmetic) -> float:
    """Compute a function of one argument."""
    value = _FUNCTIONS[name](x)
    if name == "ASIN" and value < 0.0 and not rules.angles:
        return NAN
    if name in ("FIX", "FUP") and rules.floor:
        value = math.floor(x) if name == "FIX" else math.ceil(x)
    return float(value)


def _round(x: float) -> float:
    """Round to the nearest whole number, a half away from zero."""
    return math.copysign(math.floor(abs(x) + 0.5), x) if abs(x) < LARGEST_ROUNDED else NAN


def _turned(function: Callable[[float], float], x: float) -> float:
    """Apply a function of an angle in degrees, but not to thousands of turns."""
    return function(math.radians(x)) if abs(x) < LARGEST_ANGLE else NAN


def _tangent(x: float) -> float:
    """Compute the tangent, but not at its poles."""
    value = _turned(math.tan, x)
    return value if abs(value) < LARGEST_TANGENT else NAN


_LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b,
    "OR": lambda a, b: a or b,
    "XOR": operators.ne,
}
_OPERATIONS: dict[str, Callable[[float, float], float]] = {
    "**": math.pow,
    "*": operators.mul,
    "/": operators.truediv,
    "+": operators.add,
    "-": operators.sub,
    "EQ": lambda a, b: abs(a - b) < EQUAL,
    "NE": lambda a, b: abs(a - b) >= EQUAL,
    "GT": operators.gt,
    "GE": operators.ge,
    "LT": operators.lt,
    "LE": operators.le,
}
# Angles are degrees everywhere.
_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "ABS": abs,
    "ACOS": lambda x: math.degrees(math.acos(x)),
    "ASIN": lambda x: math.degrees(math.asin(x)),
    "COS": lambda x: _turned(math.cos, x),
    "EXP": math.exp,
    "FIX": math.trunc,
    "FUP": lambda x: math.copysign(math.ceil(abs(x)), x),
    "LN": math.log,
    "POT": lambda x: x * x,
    "ROUND": _round,
    "SIN": lambda x: _turned(math.sin, x),
    "SQRT": math.sqrt,
    "TAN": _tangent,
    "TRUNC": math.trunc,
}
