"""Q parameters of Heidenhain, for the second reading: what a line sets, and numbers in their place.

Both languages are read here: ``FN 1: Q5 = +Q1 + +4``, ``D01 Q5 P01 +Q1 P02 +4``, ``Q5 = Q1 + 4``.

Rule: what is not listed here leaves its parameter unknown; what does not say which one it sets
leaves all of them so.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from gcodejerk.verification.second_reading.computing import Computer
from gcodejerk.verification.second_reading.reading import NAN

_LEAD = re.compile(rb"[ \t]*(?:/[ \t]*)?(?:N?[0-9]+(?:[ \t]+|(?=[A-Z/]|$)))?(?:/[ \t]*)?")
_ONE = rb"[-+]?(?:Q[LR]?[0-9]+|[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)"
_PLAIN = re.compile(rb"(Q[LR]?[0-9]+)[ \t]*=(.*)")
_SPOKEN = re.compile(rb"FN[ \t]*([0-9]+)[ \t]*:[ \t]*(?:(Q[LR]?[0-9]+)[ \t]*=)?(.*)")
_CODED = re.compile(rb"D[ \t]*([0-9]{1,2})(?![0-9.])[ \t]*(Q[LR]?[0-9]+)?(.*)")
_OF_CYCLE = re.compile(rb"(?<![A-Z0-9])(Q[LR]?[0-9]+)[ \t]*=[ \t]*" + _ONE + rb"(?=[ \t]|$)")
_TWO = re.compile(rb"[ \t]*(" + _ONE + rb")[ \t]*(\+|-|\*|DIV)[ \t]*(" + _ONE + rb")[ \t]*")
_OF_ONE = re.compile(rb"[ \t]*(SQRT|SIN|COS)[ \t]*(" + _ONE + rb")[ \t]*")
_ALONE = re.compile(rb"[ \t]*(" + _ONE + rb")[ \t]*")
_GIVEN = re.compile(rb"[ \t]*P0?1[ \t]*(" + _ONE + rb")(?:[ \t]+P0?2[ \t]*(" + _ONE + rb"))?[ \t]*")
_SIGNS = {1: b"+", 2: b"-", 3: b"*", 4: b"/"}
_NAMED = {5: b"SQRT", 6: b"SIN", 7: b"COS"}
_FORMULA = re.compile(rb"(?:Q[LR]?[0-9]|SQRT|SIN|COS|TAN|ABS|[-+*/().,0-9 \t])*")
_SETS = frozenset((*range(9), 13, 18))
_LASTING = re.compile(r"Q[0-9]{1,2}|QL[0-9]+")
"""Parameters that nobody but the program sets."""
_IN_WORD = re.compile(
    rb"(?<![A-Z0-9])(I?)([A-CF-KR-UV-Z])[ \t]*([-+]?)(Q[LR]?[0-9]{1,4})(?![0-9.])"
)


class Parameters(Computer):
    """Computes what lines set, and spells what they use."""

    def setting(
        self, said: bytes, variables: Mapping[str, float]
    ) -> tuple[bytes, dict[str, float] | None] | None:
        """What a line sets.

        Parameters
        ----------
        said : bytes
            A line in upper case, without its comments.
        variables : mapping of str to float
            Those that are known.

        Returns
        -------
        tuple or None
            What is left of the line, and the values (NaN: not known; None in place of all: any
            parameter may be set); None for a line that sets nothing.
        """
        lead = _LEAD.match(said)
        assert lead is not None
        rest = said[lead.end() :].strip()
        if plain := _PLAIN.fullmatch(rest):
            if b"=" not in plain[2]:
                known = _FORMULA.fullmatch(plain[2]) is not None
                value = self.value(plain[2], variables) if known else NAN
                return lead[0], {_key(plain[1]): value}
        else:
            spoken = _SPOKEN.fullmatch(rest) if self.dialect.text.klartext else None
            function = spoken or (None if self.dialect.text.klartext else _CODED.fullmatch(rest))
            if function and int(function[1]) in _SETS:
                if function[2] is None or (spoken and int(function[1]) == 18):
                    return lead[0], None
                formula = _function(int(function[1]), function[3], spoken=spoken is not None)
                return lead[0], {_key(function[2]): self.value(formula, variables)}
        names = [] if self.dialect.text.klartext else _OF_CYCLE.findall(rest)
        return (_OF_CYCLE.sub(b" ", said), dict.fromkeys(map(_key, names), NAN)) if names else None

    def in_words(self, said: bytes, variables: Mapping[str, float], *, inch: bool) -> bytes:
        """Write numbers into the place of parameters, where they are known."""

        def number(match: re.Match[bytes]) -> bytes:
            value = variables.get(_key(match[4]), NAN)
            spelled = self._number(match[2], -value if match[3] == b"-" else value, inch)
            if spelled == b"#" and self.dialect.text.klartext:
                return match[0]
            return match[1] + match[2] + spelled

        return _IN_WORD.sub(number, said)

    def lasting(self, name: str) -> bool:
        """Whether a parameter holds what the program has set until it sets it again."""
        return _LASTING.fullmatch(name) is not None

    def value(self, text: bytes, variables: Mapping[str, float]) -> float:
        """Compute a whole text, in which ``Q05`` is Q5 and ``1,5`` is 1.5."""
        text = re.sub(rb"(Q[LR]?)0*([0-9])", rb"\1\2", text.replace(b",", b"."))
        return super().value(text, variables)


def _function(number: int, text: bytes, *, spoken: bool) -> bytes:
    """The formula of a function of one or two numbers; empty for any other."""
    if not spoken:
        given = _GIVEN.fullmatch(text)
        if given is None or (given[2] is None) != (number not in _SIGNS):
            return b""
        parts = (given[1], given[2])
    elif number in _SIGNS:
        two = _TWO.fullmatch(text)
        if two is None or two[2].replace(b"DIV", b"/") != _SIGNS[number]:
            return b""
        parts = (two[1], two[3])
    elif number in _NAMED:
        one = _OF_ONE.fullmatch(text)
        if one is None or one[1] != _NAMED[number]:
            return b""
        parts = (one[2], b"")
    else:
        alone = _ALONE.fullmatch(text)
        parts = (alone[1], b"") if alone else (b"", b"")
    if number in _SIGNS:
        return b"(%s)%s(%s)" % (parts[0], _SIGNS[number], parts[1])
    if number in _NAMED:
        return b"%s(%s)" % (_NAMED[number], parts[0])
    return parts[0] if number == 0 else b""


def _key(text: bytes) -> str:
    """A parameter by its own number."""
    letters = text.rstrip(b"0123456789")
    return f"{letters.decode()}{int(text[len(letters) :])}"
