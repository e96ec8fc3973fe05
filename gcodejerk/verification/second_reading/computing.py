"""Numbers that a program computes, for the second reading: written into its lines, then read.

A line is scanned into operands and operators; these are put into the order in which they act, and
worked off on a stack. What comes out stands in the place of the expression, so that the reading of
words knows nothing of variables.

Rule: a number is known to the last digit that counts or not at all (NaN). What is not listed here
is not known.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal
from functools import cache

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.operating import (
    VACANT,
    angle_of,
    binary,
    computed,
    typed,
)
from gcodejerk.verification.second_reading.reading import NAN

_MOST = 400
"""Operands and operators of an expression."""
_BLANK = re.compile(rb"[ \t]*")
_NUMBER = re.compile(rb"(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:EX[-+]?[0-9]{1,3})?")
_NAME = re.compile(rb"[$A-Z_][A-Z0-9_]*")
_SIGN = re.compile(rb"[-+]")
_HASH_WORD = re.compile(rb"(?<![A-Z])([A-FH-LP-Z])[ \t]*(?=[-+]?[ \t]*[#\[])")
_NAMED_WORD = re.compile(rb"(?<![A-Z0-9_$])([A-FH-LP-Z])[ \t]*=[ \t]*(?:(IC|AC)[ \t]*\()?")
_HASH_SET = re.compile(rb"#[ \t]*([0-9]+|<[^<>]*>)[ \t]*=")
_HASH_NAME = re.compile(rb"<[^<>]*>")
_PLAIN = (b"+", b"-", b"*", b"/")
"""All that is computed where no control rounds: the rest has rules of its own there."""
_SMOOTH = frozenset(("ABS", "ACOS", "ASIN", "ATAN", "COS", "EXP", "LN", "SIN", "SQRT", "TAN"))
"""What no last digit decides: all that is computed where no control rounds."""
_NAMED_SET = re.compile(
    rb"(?<![A-Z0-9_$\]])(R[0-9]+|(?:R|[A-Z_][A-Z_][A-Z0-9_]*)[ \t]*\[[ \t]*[0-9]+[ \t]*\]"
    rb"|[A-Z_][A-Z_][A-Z0-9_]*)"
    rb"[ \t]*=(?!=)[ \t]*"
)
_DEF = re.compile(rb"(?:N[0-9]+[ \t]*)?DEF[ \t]+(REAL|INT|BOOL)[ \t]+(.*)")
_ITEM = re.compile(rb"[ \t]*([A-Z_][A-Z_][A-Z0-9_]*)[ \t]*(\[[^\]]*\])?[ \t]*(=[ \t]*)?")
_RADIUS = re.compile(rb"(?<![A-Z0-9_])CR[ \t]*=[ \t]*[-+]?[0-9.]+")
_TURN = re.compile(rb"(?<![A-Z0-9_])RPL[ \t]*=[ \t]*[-+]?[0-9.]+")
_LISTS = re.compile(rb"=[ \t]*(?:SET|REP)[ \t]*\(")
_COMPUTED = re.compile(
    rb"(?<![A-Z0-9_$])(?:R|[A-Z_][A-Z_][A-Z0-9_]*)[ \t]*\[[^\]]*[^0-9 \t\]][^\]]*\][ \t]*=(?!=)"
)
_FINE = re.compile(rb"[XYZABCUVWIJKR]")
_EDGE = 1e-9


class _UnknownError(Exception):
    """What stands here is no expression that is known."""


class Computer:
    """Computes for one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect, self.rules = dialect, dialect.arithmetic
        self.named = self.rules.brackets == "()"
        functions = self.rules.functions
        self.functions = functions & _SMOOTH if self.rules.exact else functions
        self.kinds: dict[str, str] = {}
        """Types of the variables that have names."""

    @property
    def computes(self) -> bool:
        """Whether this dialect's variables are followed here."""
        return self.dialect.text.variables in ("#", "R")

    # --- expressions ---

    def value(self, text: bytes, variables: Mapping[str, float]) -> float:
        """Compute a whole text."""
        try:
            number, end = self.scan(text, 0, variables)
        except (_UnknownError, ArithmeticError, ValueError):
            return NAN
        return number if _BLANK.match(text, end).end() == len(text) else NAN  # type: ignore[union-attr]

    def scan(self, text: bytes, at: int, variables: Mapping[str, float]) -> tuple[float, int]:
        """Compute what begins here, and say where it ends."""
        numbers: list[float] = []
        waiting: list[bytes] = []
        ranks = _ranks(self.rules.levels)
        pattern = _operators(self.rules.levels)
        for _ in range(_MOST):
            number, at = self._operand(text, at, variables)
            numbers.append(number)
            start = _BLANK.match(text, at).end()  # type: ignore[union-attr]
            match = pattern.match(text, start)
            if match is None:
                while waiting:
                    self._work(waiting.pop(), numbers)
                return numbers[0], at
            operator = match[0]
            if self.rules.exact and operator not in _PLAIN:
                raise _UnknownError
            while waiting and ranks[waiting[-1]] >= ranks[operator]:
                if ranks[operator] == 0 and ranks[waiting[-1]] == 0 and _is_comparison(operator):
                    raise _UnknownError
                self._work(waiting.pop(), numbers)
            waiting.append(operator)
            at = match.end()
        raise _UnknownError

    def _operand(self, text: bytes, at: int, variables: Mapping[str, float]) -> tuple[float, int]:
        """One operand with its sign."""
        at = _BLANK.match(text, at).end()  # type: ignore[union-attr]
        if match := _SIGN.match(text, at):
            number, at = self._operand(text, match.end(), variables)
            return (-number if match[0] == b"-" else number), at
        if match := _NUMBER.match(text, at):
            spelled = match[0].replace(b"EX", b"E")
            if b"E" in spelled and not self.named:
                raise _UnknownError
            return float(spelled), match.end()
        opens, closes = self.rules.brackets.encode()[:1], self.rules.brackets.encode()[1:]
        if text[at : at + 1] == opens:
            number, at = self.scan(text, at + 1, variables)
            return number, self._closed(text, at, closes)
        if text[at : at + 1] == b"#" and not self.named:
            return self._hash(text, at + 1, variables)
        match = _NAME.match(text, at)
        if match is None:
            raise _UnknownError
        name = match[0].decode()
        if name == "NOT" and self.named:
            number, at = self._operand(text, match.end(), variables)
            return float(number == 0.0) if number == number else NAN, at
        if name in self.functions:
            return self._function(name, text, match.end(), variables)
        if not self.named:
            raise _UnknownError
        return self._variable(name, text, match.end(), variables)

    def _closed(self, text: bytes, at: int, closes: bytes) -> int:
        at = _BLANK.match(text, at).end()  # type: ignore[union-attr]
        if text[at : at + 1] != closes:
            raise _UnknownError
        return at + 1

    def _hash(self, text: bytes, at: int, variables: Mapping[str, float]) -> tuple[float, int]:
        """``#5``, ``##5``, ``#[#1+2]``."""
        at = _BLANK.match(text, at).end()  # type: ignore[union-attr]
        if name := _HASH_NAME.match(text, at) if self.rules.exact else None:
            return variables.get(_key(name[0]), NAN), name.end()
        number, at = self._operand(text, at, variables)
        if not (number == number and abs(number) < 1e6 and number.is_integer()):
            return NAN, at
        if number == 0.0 and self.rules.vacant:
            return VACANT, at
        return variables.get(str(int(number)), NAN), at

    def _variable(
        self, name: str, text: bytes, at: int, variables: Mapping[str, float]
    ) -> tuple[float, int]:
        """``R5``, ``R[5]``, ``DEPTH``, ``DEPTH[2]``."""
        if name in ("TRUE", "FALSE"):
            return float(name == "TRUE"), at
        if name[:1] == "R" and name[1:].isdigit():
            name = f"R{int(name[1:])}"
        behind = _BLANK.match(text, at).end()  # type: ignore[union-attr]
        if text[behind : behind + 1] == b"[":
            index, at = self.scan(text, behind + 1, variables)
            at = self._closed(text, at, b"]")
            whole = index == index and index >= 0.0 and index.is_integer()
            name = (f"R{int(index)}" if name == "R" else f"{name}[{int(index)}]") if whole else ""
        elif text[behind : behind + 1] == b"(":
            raise _UnknownError
        return variables.get(name, NAN), at

    def _function(
        self, name: str, text: bytes, at: int, variables: Mapping[str, float]
    ) -> tuple[float, int]:
        opens, closes = self.rules.brackets.encode()[:1], self.rules.brackets.encode()[1:]
        at = _BLANK.match(text, at).end()  # type: ignore[union-attr]
        if text[at : at + 1] != opens:
            raise _UnknownError
        first, at = self.scan(text, at + 1, variables)
        if name == "ATAN2":
            at = self._closed(text, at, b",")
            second, at = self.scan(text, at, variables)
            return angle_of(first, second), self._closed(text, at, closes)
        at = self._closed(text, at, closes)
        if name == "ATAN":
            at = self._closed(text, at, b"/")
            second, at = self._operand(text, at, variables)
            angle = angle_of(first, second)
            return (angle if angle >= 0.0 else NAN), at
        return computed(name, 0.0 if first == VACANT else first), at

    def _work(self, operator: bytes, numbers: list[float]) -> None:
        """Work one operator off."""
        b, a = numbers.pop(), numbers.pop()
        numbers.append(NAN if a != a or b != b else binary(operator.decode(), a, b))

    # --- lines ---

    def spelled(
        self, text: bytes, variables: Mapping[str, float], inch: bool
    ) -> tuple[bytes, dict[str, str]]:
        """Write numbers into the place of what is computed.

        Parameters
        ----------
        text : bytes
            A line in upper case, without its comments.
        variables : mapping of str to float
            Those that are known.
        inch : bool
            Lengths are inches.

        Returns
        -------
        text : bytes
            With ``#`` for what is not known.
        relative : dict of str to str
            Address -> ``IC`` or ``AC``, where ``X=IC(5)`` stood.
        """
        relative: dict[str, str] = {}
        word = _NAMED_WORD if self.named else _HASH_WORD
        if self.named and _DEF.fullmatch(text.strip()):
            return text, relative
        text = self._packed(text)
        variables = self._before(text, variables)
        if self.named:
            text = self._without_settings(_TURN.sub(b"RPL ", _RADIUS.sub(b" ", text)))
        out, at = [], 0
        while match := word.search(text, at):
            how = match[2] if self.named else None
            try:
                number, end = self.scan(text, match.end(), variables)
                if how:
                    end = self._closed(text, end, b")")
            except (_UnknownError, ArithmeticError, ValueError):
                out.append(text[at : match.end()])
                at = match.end()
                continue
            letter = match[1]
            if how:
                relative[letter.decode()] = how.decode()
            raw = text[match.end() : end]
            plain = self.named and how is None and re.fullmatch(rb"[-+]?[0-9.]+", raw)
            rounds = b"ROUND" in raw and not self.named
            number = raw if plain else self._number(letter, NAN if rounds else number, inch)  # type: ignore[assignment]
            centre = how and letter in (b"I", b"J", b"K")
            ends = b" " if self.named else b"\0"
            out.append(text[at : match.start()] + (b" " if centre else letter + number + ends))  # type: ignore[operator]
            at = end
        return b"".join(out) + text[at:], relative

    def _packed(self, text: bytes) -> bytes:
        """A line without its blanks, where these may stand within numbers."""
        anywhere = self.dialect.text.blanks == "anywhere"
        return text.translate(None, b" \t") if anywhere else text

    def _is_variable(self, key: str) -> bool:
        """Whether it is a parameter, or a variable that was declared, or an element of one."""
        parameter = key[:1] == "R" and key[1:].isdigit()
        return parameter or key.partition("[")[0] in self.kinds

    def _without_settings(self, text: bytes) -> bytes:
        """Take out what sets variables."""
        out, at = [], 0
        while match := _NAMED_SET.search(text, at):
            key = _key(match[1])
            known = self._is_variable(key)
            try:
                end = self.scan(text, match.end(), {})[1] if known else match.end()
            except (_UnknownError, ArithmeticError, ValueError):
                known, end = False, match.end()
            out.append(text[at : match.start() if known else end])
            at = end
        return b" ".join([*out, text[at:]]) if out else text

    def _number(self, letter: bytes, number: float, inch: bool) -> bytes:
        """Spell a number, if it is certain to the last digit that counts."""
        if not abs(number) < 1e9:
            return b"#"
        if self.rules.exact:
            return format(Decimal(repr(number)), "f").encode()
        decimals = 6
        if _FINE.match(letter):
            decimals = 4 if inch and letter not in b"ABC" else 3
        short = round(number, decimals)
        return b"%.*f" % (decimals, short) if abs(number - short) < _EDGE else b"#"

    def _before(self, text: bytes, variables: Mapping[str, float]) -> Mapping[str, float]:
        """What is known for certain within a line that sets variables too."""
        pattern = _NAMED_SET if self.named else _HASH_SET
        if self.rules.together or b"=" not in text:
            return variables
        targets = {_key(name) for name in pattern.findall(text)}
        return {name: v for name, v in variables.items() if name not in targets}

    def settings(self, text: bytes, variables: Mapping[str, float]) -> dict[str, float] | None:
        """What a line sets; None where it may set any variable.

        Parameters
        ----------
        text : bytes
            A line in upper case, without its comments.
        variables : mapping of str to float
            Those that are known.
        """
        if self.named and (match := _DEF.fullmatch(text.strip())):
            return self._defined(match[1].decode(), match[2], variables)
        if b"=" not in text:
            return {}
        text = self._packed(text)
        pattern = _NAMED_SET if self.named else _HASH_SET
        found: dict[str, float] = {}
        known = dict(variables)
        for match in pattern.finditer(text):
            key = _key(match[1])
            if self.named and not self._is_variable(key):
                continue
            try:
                number, _ = self.scan(text, match.end(), known)
            except (_UnknownError, ArithmeticError, ValueError):
                number = NAN
            number = typed(self.kinds.get(key.partition("[")[0], "REAL"), number)
            system = self.rules.system and key.isdigit() and int(key) >= self.rules.system
            again = key in found
            found[key] = NAN if again or system or key == "0" else number
            if not self.rules.together:
                known.pop(key, None)
        if not self.named and re.search(rb"#[ \t]*[#\[].*=", text):
            return None
        if self.named and (_COMPUTED.search(text) or _LISTS.search(text)):
            return None
        return found

    def _defined(self, kind: str, text: bytes, variables: Mapping[str, float]) -> dict[str, float]:
        """DEF REAL DEPTH, WIDTH=5."""
        found: dict[str, float] = {}
        at = 0
        while match := _ITEM.match(text, at):
            key, at, number = match[1].decode(), match.end(), 0.0
            self.kinds[key] = kind
            if match[3]:
                try:
                    number, at = self.scan(text, at, variables)
                except (_UnknownError, ArithmeticError, ValueError):
                    found[key] = NAN
                    break
            found[key] = NAN if match[2] else typed(kind, number)
            at = _BLANK.match(text, at).end()  # type: ignore[union-attr]
            if text[at : at + 1] != b",":
                break
            at += 1
        return found

    def is_local(self, name: str) -> bool:
        """Whether a variable belongs to one program alone."""
        return is_local(name, self.rules)


def is_local(name: str, rules: Arithmetic) -> bool:
    """Whether a variable belongs to one program alone."""
    if name.isdigit():
        return int(name) <= rules.local
    if rules.q_parameters:
        return name.startswith("QL")
    return rules.brackets == "()" and not (name[:1] == "R" and name[1:].isdigit())


def _key(text: bytes) -> str:
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
