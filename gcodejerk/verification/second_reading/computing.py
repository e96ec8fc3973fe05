"""Numbers that a program computes, for the second reading: written into its lines, then read.

What an expression is worth (`worth`) stands in its place, so that the reading of words knows
nothing of variables. This module owns where expressions stand in a line, what variables it sets,
and how a number is spelled. Lines that differ in typed numbers alone are taken apart once.

Rule: a number is known to the last digit that counts or not at all (NaN).
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.operating import typed
from gcodejerk.verification.second_reading.reading import NAN
from gcodejerk.verification.second_reading.worth import (
    BLANK,
    OPEN,
    Expressions,
    Steps,
    UnknownError,
    name_of,
)

_HASH_WORD = re.compile(rb"(?<![A-Z])([A-FH-LP-Z])[ \t]*(?=[-+]?[ \t]*[#\[])")
_NAMED_WORD = re.compile(rb"(?<![A-Z0-9_$])([A-FH-LP-Z])[ \t]*=[ \t]*(?:(IC|AC)[ \t]*\()?")
_HASH_SET = re.compile(rb"#[ \t]*([0-9]+|<[^<>]*>)[ \t]*=")
_TYPED = re.compile(rb"((?<=[\[+\-*/])(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)|(?<=^N)[0-9]+)")
"""Numbers that are typed, in expressions and behind signs: none says which variable is meant."""
_REMEMBERED = 1 << 10
"""Lines that are remembered taken apart, without their typed numbers."""
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
_LITERAL = re.compile(rb"[-+]?[0-9.]+")
_FINE = re.compile(rb"[XYZABCUVWIJKR]")
_EDGE = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class _Word:
    """A word with an expression, and the text in front of it."""

    front: bytes
    letter: bytes
    steps: Steps
    how: bytes | None
    """``IC`` or ``AC``."""
    raw: bytes
    """The expression as it is written."""


@dataclass(frozen=True, slots=True, eq=False)
class _Apart:
    """A line taken apart."""

    words: list[_Word]
    rest: bytes
    kept: list[int]
    """Typed numbers, left open, that belong to no expression."""


class Computer:
    """Computes for one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect, self.rules = dialect, dialect.arithmetic
        self.named = self.rules.brackets == "()"
        self.expressions = Expressions(self.rules)
        self._lines: dict[bytes, _Apart] = {}
        self.kinds: dict[str, str] = {}
        """Types of the variables that have names."""

    @property
    def computes(self) -> bool:
        """Whether this dialect's variables are followed here."""
        return self.dialect.text.variables in ("#", "R")

    # --- expressions ---

    def value(self, text: bytes, variables: Mapping[str, float]) -> float:
        """Compute a whole text."""
        number, end = self._computed(text, 0, variables)
        return number if BLANK.match(text, end).end() == len(text) else NAN  # type: ignore[union-attr]

    def _computed(self, text: bytes, at: int, variables: Mapping[str, float]) -> tuple[float, int]:
        """Compute what begins here, and say where it ends; here, and NaN, where it is not known."""
        try:
            steps, end = self.expressions.read(text, at)
        except UnknownError:
            return NAN, at
        return self.expressions.worth(steps, variables), end

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
        if self.named and _DEF.fullmatch(text.strip()):
            return text, {}
        text = self._packed(text)
        variables = self._before(text, variables)
        if self.named:
            text = self._without_settings(_TURN.sub(b"RPL ", _RADIUS.sub(b" ", text)))
            return self._filled(self._apart(text), variables, inch, [])
        numbers: list[bytes] = []
        if not any(mark in text for mark in (b"<", b"=", OPEN)):
            parts = _TYPED.split(text)
            text, numbers = OPEN.join(parts[::2]), parts[1::2]
        apart = self._lines.get(text)
        if apart is None:
            if len(self._lines) >= _REMEMBERED:
                self._lines.clear()
            apart = self._lines[text] = self._apart(text)
        return self._filled(apart, variables, inch, numbers)

    def _apart(self, text: bytes) -> _Apart:
        """Take a line apart."""
        pattern = _NAMED_WORD if self.named else _HASH_WORD
        words: list[_Word] = []
        at = behind = 0
        while match := pattern.search(text, behind):
            how = match[2] if self.named else None
            behind = match.end()
            try:
                steps, end = self.expressions.read(text, behind)
                if how:
                    end = self.expressions.closed(text, end, b")")
            except UnknownError:
                continue
            words.append(_Word(text[at : match.start()], match[1], steps, how, text[behind:end]))
            at = behind = end
        rest, kept, count = text[at:], list[int](), 0
        for word in words:
            kept += range(count, count + word.front.count(OPEN))
            count += word.front.count(OPEN) + word.raw.count(OPEN)
        return _Apart(words, rest, [*kept, *range(count, count + rest.count(OPEN))])

    def _filled(
        self, apart: _Apart, variables: Mapping[str, float], inch: bool, numbers: Sequence[bytes]
    ) -> tuple[bytes, dict[str, str]]:
        """A line put together again, with numbers in the place of what is computed."""
        relative: dict[str, str] = {}
        values = [float(number) for number in numbers]
        out: list[bytes] = []
        ends = b" " if self.named else b"\0"
        for word in apart.words:
            letter, how, raw = word.letter, word.how, word.raw
            if how:
                relative[letter.decode()] = how.decode()
            if how and letter in (b"I", b"J", b"K"):
                out += [word.front, b" "]
                continue
            if self.named and how is None and _LITERAL.fullmatch(raw):
                number = raw
            elif b"ROUND" in raw and not self.named:
                number = b"#"
            else:
                worth = self.expressions.worth(word.steps, variables, values)
                number = self._number(letter, worth, inch)
            out += [word.front, letter, number, ends]
        text = b"".join([*out, apart.rest])
        if apart.kept:
            parts = text.split(OPEN)
            typed = [numbers[k] for k in apart.kept]
            text = b"".join(itertools.chain.from_iterable(zip(parts, [*typed, b""], strict=True)))
        return text, relative

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
            key = name_of(match[1])
            known = self._is_variable(key)
            end = self._computed(text, match.end(), {})[1] if known else match.end()
            known = end > match.end()
            out.append(text[at : match.start() if known else end])
            at = end
        return b" ".join([*out, text[at:]]) if out else text

    def _number(self, letter: bytes, number: float, inch: bool) -> bytes:
        """Spell a number, if it is certain to the last digit that counts."""
        if not abs(number) < 1e9:
            return b"#"
        if self.rules.exact:
            text = repr(number)
            return (format(Decimal(text), "f") if "e" in text else text).encode()
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
        targets = {name_of(name) for name in pattern.findall(text)}
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
            key = name_of(match[1])
            if self.named and not self._is_variable(key):
                continue
            number, _ = self._computed(text, match.end(), known)
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
                begin = at
                number, at = self._computed(text, at, variables)
                if at == begin:
                    found[key] = NAN
                    break
            found[key] = NAN if match[2] else typed(kind, number)
            at = BLANK.match(text, at).end()  # type: ignore[union-attr]
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
