"""What expressions say to compute, for the second reading, and what they are worth.

This module owns their grammar. An expression is scanned into operands and operators, once; these
are put down in the order in which they act, and worked off on a stack, as often as it stands in a
program. Numbers that are typed in it may be left open: then it is one for all lines that differ in
them alone.

Rule: a number is known to the last digit that counts or not at all (NaN). What is not listed here
is not known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.verification.second_reading.operating import VACANT, angle_of, binary, computed
from gcodejerk.verification.second_reading.reading import NAN

OPEN = b"\1"
"""In the place of a typed number that is left open."""
BLANK = re.compile(rb"[ \t]*")
_MOST, _DEEPEST = 400, 100
"""Operands and operators of an expression, and what may stand within each other."""
_NUMBER = re.compile(rb"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:EX[-+]?[0-9]{1,3})?")
_NAME = re.compile(rb"[$A-Z_][A-Z0-9_]*")
_SIGN = re.compile(rb"[-+]")
_HASH_NAME = re.compile(rb"<[^<>]*>")
_PLAIN = (b"+", b"-", b"*", b"/")
"""All that is computed where no control rounds: the rest has rules of its own there."""
_SMOOTH = frozenset(("ABS", "ACOS", "ASIN", "ATAN", "COS", "EXP", "LN", "SIN", "SQRT", "TAN"))
"""What no last digit decides: all that is computed where no control rounds."""

Steps = list[tuple[str, Any]]
"""What happens on the stack, and with what: a number is put on it, or a variable, or what is on top
of it goes into an operation."""


class UnknownError(Exception):
    """What stands here is no expression that is known."""


class Expressions:
    """Reads expressions of one dialect."""

    def __init__(self, rules: Arithmetic) -> None:
        self.rules = rules
        self.named = rules.brackets == "()"
        self._functions = rules.functions & _SMOOTH if rules.exact else rules.functions
        self._opens, self._closes = (mark.encode() for mark in rules.brackets)
        self._depth = 0

    def read(self, text: bytes, at: int) -> tuple[Steps, int]:
        """Read what begins here, and say where it ends.

        Raises
        ------
        UnknownError
            It is no expression that is known.
        """
        self._depth = 0
        return self._expression(text, at)

    def _expression(self, text: bytes, at: int) -> tuple[Steps, int]:
        """Operands and operators, in the order in which they act."""
        steps: Steps = []
        waiting: list[bytes] = []
        ranks, pattern = _ranks(self.rules.levels), _operators(self.rules.levels)
        for _ in range(_MOST):
            at = self._operand(text, at, steps)
            match = pattern.match(text, _behind_blanks(text, at))
            if match is None:
                steps += [("work", operator.decode()) for operator in reversed(waiting)]
                return steps, at
            operator = match[0]
            if self.rules.exact and operator not in _PLAIN:
                raise UnknownError
            while waiting and ranks[waiting[-1]] >= ranks[operator]:
                if ranks[operator] == 0 and ranks[waiting[-1]] == 0 and _is_comparison(operator):
                    raise UnknownError
                steps.append(("work", waiting.pop().decode()))
            waiting.append(operator)
            at = match.end()
        raise UnknownError

    def closed(self, text: bytes, at: int, closes: bytes) -> int:
        """Pass over what closes an expression."""
        at = _behind_blanks(text, at)
        if text[at : at + 1] != closes:
            raise UnknownError
        return at + 1

    def _operand(self, text: bytes, at: int, steps: Steps) -> int:
        """One operand with its sign."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise UnknownError
        at = _behind_blanks(text, at)
        sign = _SIGN.match(text, at)
        if sign is None:
            at = self._unsigned(text, at, steps)
        else:
            at = self._operand(text, sign.end(), steps)
            steps += [("negative", None)] if sign[0] == b"-" else []
        self._depth -= 1
        return at

    def _unsigned(self, text: bytes, at: int, steps: Steps) -> int:
        """One operand that begins here."""
        if match := _NUMBER.match(text, at):
            spelled = match[0].replace(b"EX", b"E")
            if b"E" in spelled and not self.named:
                raise UnknownError
            steps.append(("number", float(spelled)))
            return match.end()
        here = text[at : at + 1]
        if here == OPEN:
            steps.append(("open", text.count(OPEN, 0, at)))
            return at + 1
        if here == self._opens:
            return self._bracket(text, at, steps)
        if here == b"#" and not self.named:
            return self._hash(text, at + 1, steps)
        match = _NAME.match(text, at)
        if match is None:
            raise UnknownError
        name = match[0].decode()
        if name == "NOT" and self.named:
            at = self._operand(text, match.end(), steps)
            steps.append(("not", None))
            return at
        if name in self._functions:
            return self._function(name, text, match.end(), steps)
        if not self.named:
            raise UnknownError
        return self._variable(name, text, match.end(), steps)

    def _bracket(self, text: bytes, at: int, steps: Steps) -> int:
        """An expression in brackets."""
        at = self.closed(text, at, self._opens)
        inner, at = self._expression(text, at)
        steps += inner
        return self.closed(text, at, self._closes)

    def _hash(self, text: bytes, at: int, steps: Steps) -> int:
        """``#5``, ``##5``, ``#[#1+2]``."""
        at = _behind_blanks(text, at)
        if name := _HASH_NAME.match(text, at) if self.rules.exact else None:
            steps.append(("variable", name_of(name[0])))
            return name.end()
        begin = len(steps)
        at = self._operand(text, at, steps)
        what, number = steps[-1]
        if (
            len(steps) == begin + 1
            and what == "number"
            and 0.0 < number < 1e6
            and number % 1.0 == 0.0
        ):
            steps[begin] = "variable", str(int(number))
        else:
            steps.append(("numbered", None))
        return at

    def _variable(self, name: str, text: bytes, at: int, steps: Steps) -> int:
        """``R5``, ``R[5]``, ``DEPTH``, ``DEPTH[2]``."""
        if name in ("TRUE", "FALSE"):
            steps.append(("number", float(name == "TRUE")))
            return at
        if name[:1] == "R" and name[1:].isdigit():
            name = f"R{int(name[1:])}"
        behind = _behind_blanks(text, at)
        if text[behind : behind + 1] == b"[":
            inner, at = self._expression(text, behind + 1)
            steps += [*inner, ("element", name)]
            return self.closed(text, at, b"]")
        if text[behind : behind + 1] == b"(":
            raise UnknownError
        steps.append(("variable", name))
        return at

    def _function(self, name: str, text: bytes, at: int, steps: Steps) -> int:
        """A function with what it is of."""
        if name == "ATAN2":
            first, at = self._expression(text, self.closed(text, at, self._opens))
            second, at = self._expression(text, self.closed(text, at, b","))
            steps += [*first, *second, ("angle", False)]
            return self.closed(text, at, self._closes)
        at = self._bracket(text, at, steps)
        if name == "ATAN":
            at = self._operand(text, self.closed(text, at, b"/"), steps)
            steps.append(("angle", True))
        else:
            steps.append(("function", name))
        return at

    def worth(
        self, steps: Steps, variables: Mapping[str, float], typed: Sequence[float] = ()
    ) -> float:
        """What an expression is worth.

        Parameters
        ----------
        steps : list of tuple
            As they were read.
        variables : mapping of str to float
            Those that are known.
        typed : sequence of float, optional
            Numbers in the places that were left open.
        """
        stack: list[float] = []
        push, pop = stack.append, stack.pop
        try:
            for what, own in steps:
                if what == "open":
                    push(typed[own])
                elif what == "work":
                    b, a = pop(), pop()
                    push(NAN if a != a or b != b else binary(own, a, b))
                elif what == "variable":
                    push(variables.get(own, NAN))
                elif what == "number":
                    push(own)
                elif what == "numbered":
                    push(self._numbered(pop(), variables))
                elif what == "negative":
                    push(-pop())
                elif what == "function":
                    x = pop()
                    push(computed(own, 0.0 if x == VACANT else x, self.rules.floor))
                elif what == "not":
                    x = pop()
                    push(float(x == 0.0) if x == x else NAN)
                elif what == "element":
                    push(variables.get(_element(own, pop()), NAN))
                else:
                    x, y = pop(), pop()
                    angle = angle_of(y, x)
                    push(angle if angle >= 0.0 or not own else NAN)
        except (ArithmeticError, ValueError):
            return NAN
        return stack[0]

    def _numbered(self, number: float, variables: Mapping[str, float]) -> float:
        """What the variable of a number holds."""
        if not (number == number and abs(number) < 1e6 and number.is_integer()):
            return NAN
        if number == 0.0 and self.rules.vacant:
            return VACANT
        return variables.get(str(int(number)), NAN)


def name_of(text: bytes) -> str:
    """Name of a variable as it is written."""
    name = text.translate(None, b" \t").decode("latin-1")
    if name.startswith("R["):
        name = name.translate({0x5B: None, 0x5D: None})
    elif name.endswith("]"):
        base, _, index = name.partition("[")
        return f"{base}[{int(index[:-1])}]"
    if name.isdigit():
        return str(int(name))
    return f"R{int(name[1:])}" if name[:1] == "R" and name[1:].isdigit() else name


def _element(name: str, index: float) -> str:
    """Name of an element of an array; empty where its number is none."""
    if not (index == index and index >= 0.0 and index.is_integer()):
        return ""
    return f"R{int(index)}" if name == "R" else f"{name}[{int(index)}]"


def _behind_blanks(text: bytes, at: int) -> int:
    """Where the blanks end that begin here."""
    return BLANK.match(text, at).end()  # type: ignore[union-attr]


@cache
def _ranks(levels: tuple[tuple[str, ...], ...]) -> dict[bytes, int]:
    """How each operator binds; 0 least."""
    return {
        name.encode(): len(levels) - 1 - level
        for level, names in enumerate(levels)
        for name in names
    }


@cache
def _operators(levels: tuple[tuple[str, ...], ...]) -> re.Pattern[bytes]:
    """Any operator; one that is a word ends where the next word begins."""
    names = sorted(_ranks(levels), key=len, reverse=True)
    # where blanks separate words, one that is glued to a letter is another word
    parts = [
        re.escape(n) + (rb"(?![A-Z_])" if n.isalpha() and b"==" in names else b"") for n in names
    ]
    return re.compile(b"|".join(parts) or rb"(?!)")


def _is_comparison(operator: bytes) -> bool:
    return operator in (b"EQ", b"NE", b"GT", b"GE", b"LT", b"LE") or operator[:1] in b"=<>"
