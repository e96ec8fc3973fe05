"""Expressions and words of LinuxCNC, for the proof that flow was written out rightly.

A line is reduced from its innermost brackets outwards, each replaced by the number of its value,
until nothing but words and assignments is left. Of `nc` it knows the dialect's table.

Rule: what is not known, or not understood, is NaN, and it spreads.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from gcodejerk.nc import Dialect

NAN = math.nan
_COMMENT = re.compile(rb"\([^()]*\)|;.*")
_INNERMOST = re.compile(rb"\[([^\[\]]*)\]")
_EXISTS = re.compile(rb"EXISTS\[#(<[^<>]*>)\]")
_REF = rb"#+(?:[0-9]+|<[^<>]*>|\{[0-9]+\})"
_OPERAND = (
    rb"[-+]?(?:\{[0-9]+\}|" + _REF + rb"|ATAN\{[0-9]+\}/\{[0-9]+\}|[A-Z]{2,6}\{[0-9]+\}"
    rb"|[0-9]+(?:\.[0-9]*)?|\.[0-9]+)"
)
_WORD = re.compile(rb"([A-Z$])(" + _OPERAND + rb")")
_SETS = re.compile(rb"(" + _REF + rb")=(" + _OPERAND + rb")")
_PIECE = re.compile(_OPERAND)
_PLACE = re.compile(rb"\{([0-9]+)\}")
_OPERATOR = re.compile(rb"\*\*|[-+*/]|MOD|EQ|NE|GT|GE|LT|LE|AND|OR|XOR")
_OWN = re.compile(rb"#(?:([0-9]+)|(<[^<>]*>)|[#\[{])")
CLOSE = 1e-12
"""Relative difference of two spellings of one number."""
_ORDERS = (b"LT", b"LE", b"GT", b"GE")
_ROUNDS = (b"FIX", b"FUP", b"ROUND")
_EQUAL = 1e-4
"""How far two numbers may be apart for EQ."""


@dataclass(frozen=True, slots=True)
class Said:
    """A word, or what sets a variable."""

    name: str
    """The letter, or the variable; empty where it may be any variable."""
    value: float
    text: bytes
    """As written, without blanks."""

    def same(self, other: Said) -> bool:
        """Whether another one says the same: with these words, or with another spelling of them."""
        if self.name != other.name:
            return False
        off = abs(self.value - other.value)
        return self.text == other.text or off <= CLOSE * max(1.0, abs(self.value))


@dataclass(slots=True)
class Parts:
    """What a line says."""

    words: list[Said] = field(default_factory=list)
    sets: list[Said] = field(default_factory=list)
    deleted: bool = False
    understood: bool = True


def code_of(text: bytes) -> bytes:
    """A line without comments and blanks, in upper case."""
    return _COMMENT.sub(b"", text).translate(None, b" \t\r").upper()


def comments_of(text: bytes) -> list[bytes]:
    """The comments of a line."""
    return _COMMENT.findall(text.rstrip(b"\r"))


class _Held:
    """Values that stand for brackets."""

    def __init__(self) -> None:
        self.numbers: list[float] = []
        self._texts: list[bytes] = []

    def hold(self, number: float, text: bytes) -> bytes:
        """Keep a value; what stands in its place."""
        self.numbers.append(number)
        self._texts.append(self.written(text))
        return b"{%d}" % (len(self.numbers) - 1)

    def written(self, text: bytes) -> bytes:
        """What was written where values stand now."""
        return _PLACE.sub(lambda match: self._texts[int(match[1])], text)


class Values:
    """Computes from variables: numbered ones by their number, named ones with their brackets."""

    def __init__(self, dialect: Dialect) -> None:
        rules = dialect.arithmetic
        self.local_count, self.system = rules.local, rules.system
        self.careful = False
        """Last digits decide nothing: they come from functions of another library."""
        self._levels = [tuple(name.encode() for name in level) for level in rules.levels]

    def is_local(self, name: str) -> bool:
        """Whether a variable is a subprogram's own."""
        if name.isdigit():
            return 1 <= int(name) <= self.local_count
        return not name.startswith("<_")

    def reads_local(self, code: bytes) -> bool:
        """Whether a line names a variable of the subprogram's own, or one that is computed."""
        return any(
            not (number or name) or self.is_local(str(int(number)) if number else name.decode())
            for number, name in _OWN.findall(code)
        )

    def value(self, text: bytes, variables: Mapping[str, float]) -> float:
        """What an expression is worth; blanks taken out, in upper case."""
        held = _Held()
        text = self._reduced(text, variables, held)
        return self._flat(text, variables, held)

    def parts(self, code: bytes, variables: Mapping[str, float]) -> Parts:
        """Take a line apart, its values computed.

        Parameters
        ----------
        code : bytes
            As `code_of` gives it.
        variables : mapping of str to float
            Those that are known in front of it.
        """
        parts, held = Parts(deleted=code.startswith(b"/")), _Held()
        text = self._reduced(code.removeprefix(b"/"), variables, held)
        at = 0
        while at < len(text):
            if match := _SETS.match(text, at):
                name = self._name(match[1][1:], variables, held)
                value = self._flat(match[2], variables, held)
                parts.sets.append(Said(name, value, held.written(match[0])))
            elif match := _WORD.match(text, at):
                value = self._flat(match[2], variables, held)
                parts.words.append(Said(match[1].decode(), value, held.written(match[0])))
            else:
                parts.understood = False
                return parts
            at = match.end()
        return parts

    def _reduced(self, text: bytes, variables: Mapping[str, float], held: _Held) -> bytes:
        """Put numbers of values in the place of brackets."""
        if b"{" in text:
            return b"?"

        def exists(match: re.Match[bytes]) -> bytes:
            return held.hold(1.0 if match[1].decode("latin-1") in variables else NAN, match[0])

        def bracket(match: re.Match[bytes]) -> bytes:
            return held.hold(self._flat(match[1], variables, held), match[0])

        text = _EXISTS.sub(exists, text)
        while b"[" in text:
            text, count = _INNERMOST.subn(bracket, text)
            if not count:
                return b"?"
        return text

    def _name(self, text: bytes, variables: Mapping[str, float], held: _Held) -> str:
        """Which variable is meant behind a ``#``; empty where nobody knows."""
        if text[:1] == b"<":
            return text.decode("latin-1")
        if text.isdigit():
            return str(int(text))
        number = (
            held.numbers[int(text[1:-1])]
            if text[:1] == b"{"
            else variables.get(self._name(text[1:], variables, held), NAN)
        )
        whole = abs(number) < 1e6 and abs(number - round(number)) < 1e-4
        return str(round(number)) if whole else ""

    def _flat(self, text: bytes, variables: Mapping[str, float], held: _Held) -> float:
        """The value of what has no brackets left."""
        numbers, operators, at = list[float](), list[bytes](), 0
        while match := _PIECE.match(text, at):
            numbers.append(self._operand(match[0], variables, held))
            at = match.end()
            if at == len(text):
                return self._worked_off(numbers, operators)
            sign = _OPERATOR.match(text, at)
            if sign is None:
                return NAN
            operators.append(sign[0])
            at = sign.end()
        return NAN

    def _worked_off(self, numbers: list[float], operators: list[bytes]) -> float:
        """Work the operators off, those that bind most first, from the left."""
        for level in self._levels:
            k = 0
            while k < len(operators):
                if operators[k] in level:
                    numbers[k : k + 2] = [self._binary(operators.pop(k), *numbers[k : k + 2])]
                else:
                    k += 1
        return numbers[0]

    def _binary(self, operator: bytes, a: float, b: float) -> float:
        apart = abs(a - b)
        if self.careful and operator in _ORDERS and 0.0 < apart < 1e-12 * max(abs(a), abs(b)):
            return NAN
        return _binary(operator, a, b)

    def _function(self, name: bytes, given: list[float]) -> float:
        if self.careful and name in _ROUNDS and len(given) == 1 and given[0] == given[0]:
            twice = 2.0 * given[0]
            if 0.0 < abs(twice - round(twice)) < 1e-12 * max(1.0, abs(twice)):
                return NAN
        return _function(name, given)

    def _operand(self, text: bytes, variables: Mapping[str, float], held: _Held) -> float:
        sign = -1.0 if text[:1] == b"-" else 1.0
        text = text.lstrip(b"+-")
        if text[:1] == b"{":
            number = held.numbers[int(text[1:-1])]
        elif text[:1] == b"#":
            number = variables.get(self._name(text[1:], variables, held), NAN)
        elif text[:1].isalpha():
            name, _, rest = text.partition(b"{")
            given = [held.numbers[int(k)] for k in re.findall(rb"[0-9]+", rest)]
            number = self._function(name, given)
        else:
            number = float(text)
        return sign * number


def _binary(operator: bytes, a: float, b: float) -> float:
    """An operation of two numbers."""
    if a != a or b != b:
        return NAN
    try:
        found = float(_BINARY[operator](a, b))
    except (ArithmeticError, ValueError):
        return NAN
    return found if math.isfinite(found) else NAN


def _rest(a: float, b: float) -> float:
    """What a division leaves; never negative."""
    left = math.fmod(a, b)
    return left + abs(b) if left < 0.0 else left


_BINARY: dict[bytes, Callable[[float, float], float]] = {
    b"**": lambda a, b: a**b if not (a < 0.0 and b != int(b)) else NAN,
    b"*": lambda a, b: a * b,
    b"/": lambda a, b: a / b,
    b"MOD": _rest,
    b"+": lambda a, b: a + b,
    b"-": lambda a, b: a - b,
    b"EQ": lambda a, b: abs(a - b) < _EQUAL,
    b"NE": lambda a, b: not abs(a - b) < _EQUAL,
    b"GT": lambda a, b: a > b,
    b"GE": lambda a, b: a >= b,
    b"LT": lambda a, b: a < b,
    b"LE": lambda a, b: a <= b,
    b"AND": lambda a, b: a != 0.0 and b != 0.0,
    b"OR": lambda a, b: a != 0.0 or b != 0.0,
    b"XOR": lambda a, b: (a != 0.0) is not (b != 0.0),
}


def _function(name: bytes, given: list[float]) -> float:
    """A function; angles in degrees."""
    if any(x != x for x in given) or name not in _FUNCTIONS:
        return NAN
    try:
        return float(_FUNCTIONS[name](*given))
    except (ArithmeticError, ValueError, TypeError):
        return NAN


_FUNCTIONS: dict[bytes, Callable[..., float]] = {
    b"ABS": abs,
    b"ACOS": lambda x: math.degrees(math.acos(x)),
    b"ASIN": lambda x: math.degrees(math.asin(x)),
    b"ATAN": lambda y, x: math.degrees(math.atan2(y, x)),
    b"COS": lambda x: math.cos(math.radians(x)),
    b"EXP": math.exp,
    b"FIX": math.floor,
    b"FUP": math.ceil,
    b"LN": math.log,
    b"ROUND": lambda x: math.floor(x + 0.5) if x >= 0.0 else math.ceil(x - 0.5),
    b"SIN": lambda x: math.sin(math.radians(x)),
    b"SQRT": math.sqrt,
    b"TAN": lambda x: math.tan(math.radians(x)),
}
