"""Q parameters of Heidenhain, as both of its languages write them: what sets one, and with what.

``Q5 = Q1 * (2 + Q7)`` is a formula; ``FN 3: Q5 = +Q1 * +4`` of Klartext and ``D03 Q05 P01 +Q1 P02
+4`` of DIN/ISO are functions of one or two operands, which become formulas here.

Sources: TNC 360 ISO manual p. 7-5 (D00 to D05, their operands and signs); iTNC 530 ISO manual
(340 49x-03) p. 526 (formulas); drunsinn/language-klartext: grammars/klartext.cson (FN 0 to FN 13).

Rule: what is not written exactly so leaves its parameter unknown, which an empty formula says.
"""

from __future__ import annotations

import re
from typing import NamedTuple

NAME = rb"Q[LR]?[0-9]{1,4}"
"""Of a parameter that holds a number."""
OPERAND = rb"[-+]?(?:" + NAME + rb"|(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+))"
VALUE = re.compile(rb"[-+]?" + NAME + rb"(?![0-9.])", re.IGNORECASE)
"""What may stand for the number of a word."""
PARAMETER = re.compile(
    rb"(" + NAME + rb")[ \t]*=[ \t]*" + OPERAND + rb"(?=[ \t;*]|$)", re.IGNORECASE
)
"""Of a cycle, among others: ``Q200=2``."""
_FORMULA = re.compile(rb"(" + NAME + rb")[ \t]*=([^=]*)", re.IGNORECASE)
_SIGNS = {1: b"+", 2: b"-", 3: b"*", 4: b"/"}
_SPOKEN = {0: b"", 1: rb"\+", 2: b"-", 3: rb"\*", 4: b"DIV", 5: b"SQRT", 6: b"SIN", 7: b"COS"}
_ALONE = {5: b"SQRT", 6: b"SIN", 7: b"COS"}
_SETTING = frozenset((*range(9), 13))
"""Functions that set the parameter that they name first, and do nothing else."""
_COMPUTED = re.compile(rb"(?:[-+*/()., \t0-9]|Q[LR]?[0-9]|SQRT|SIN|COS|TAN|ABS)+", re.IGNORECASE)
"""Formulas that are computed; others have operators and functions whose rules were not found."""
_D = re.compile(rb"D[ \t]*([0-9]{1,2})(?![0-9.])", re.IGNORECASE)
_CALL = re.compile(rb"L[ \t]*([0-9]{1,5}),([0-9]{1,5})(?![0-9.,])", re.IGNORECASE)


class Called(NamedTuple):
    """``L1,2`` of DIN/ISO."""

    length: int
    """Of the text."""
    label: float


class Said(NamedTuple):
    """What sets a parameter in DIN/ISO, or a function that sets none that is known."""

    length: int
    """Of the text."""
    function: str | None
    """``D9``; None for what sets a parameter."""
    name: str
    """The parameter."""
    text: bytes
    """Its formula, or what stands behind the function."""


def name_of(text: bytes) -> str:
    """A parameter by its own number: ``Q05`` is Q5."""
    letters = text.upper().rstrip(b"0123456789").decode()
    return f"{letters}{int(text[len(letters) :])}"


def formula(text: bytes) -> tuple[str, bytes] | None:
    """Take ``Q5 = ...`` apart; None for anything else."""
    match = _FORMULA.fullmatch(text.strip(b" \t"))
    if match is None:
        return None
    return name_of(match[1]), _pointed(match[2]) if _COMPUTED.fullmatch(match[2]) else b""


def klartext_function(number: int, text: bytes) -> tuple[str, bytes] | None:
    """Take what stands behind ``FN 1:`` apart, ``Q1 = -Q2 + -5``; None for another function."""
    match = _FORMULA.fullmatch(text.strip(b" \t"))
    if number not in _SETTING or match is None:
        return None
    return name_of(match[1]), _of_operands(number, *_spoken_operands(number, match[2]))


def iso_function(number: int, text: bytes) -> tuple[str, bytes] | None:
    """Take what stands behind ``D01`` apart, ``Q1 P01 -Q2 P02 -5``; None for another function."""
    match = re.match(rb"[ \t]*(" + NAME + rb")(?![0-9])", text, re.IGNORECASE)
    if number not in _SETTING or match is None:
        return None
    rest = text[match.end() :].strip(b" \t")
    return name_of(match[1]), _of_operands(number, *(p_operands(rest) or ()))


def iso_statement(text: bytes, *, beside: bool) -> Called | Said | None:
    """Take what stands at the beginning of a text, if it is no word.

    Parameters
    ----------
    text : bytes
        Up to the end of the block.
    beside : bool
        Something stands in front of it: then ``Q200=2`` is a cycle's, and no formula.
    """
    if call := _CALL.match(text):
        return Called(call.end(), float(call[1]))
    function = _D.match(text)
    if function is not None:
        rest = text[function.end() :]
        found = iso_function(int(function[1]), rest)
        if found is None:
            return Said(len(text), f"D{int(function[1])}", "", rest)
        return Said(len(text), None, *found)
    if not beside and (found := formula(text)):
        return Said(len(text), None, *found)
    given = PARAMETER.match(text)
    return None if given is None else Said(given.end(), None, name_of(given[1]), b"")


def p_operands(text: bytes) -> list[bytes] | None:
    """The operands of ``P01 +Q1 P02 -5``, in their order; None where that is not all of it."""
    operands: list[bytes] = []
    at = 0
    while at < len(text):
        pattern = rb"[ \t]*P0?%d[ \t]*(" % (len(operands) + 1) + OPERAND + rb")(?![0-9.,])[ \t]*"
        match = re.compile(pattern, re.IGNORECASE).match(text, at)
        if match is None:
            return None
        operands.append(match[1].upper())
        at = match.end()
    return operands


def _spoken_operands(number: int, text: bytes) -> tuple[bytes, ...]:
    """The operands of ``+Q1 DIV +4``, or of ``SIN -Q5``; none where they are not plain."""
    if number not in _SPOKEN:
        return ()
    before = rb"(" + OPERAND + rb")[ \t]*" if number in _SIGNS else b""
    pattern = before + _SPOKEN[number] + rb"[ \t]*(" + OPERAND + rb")"
    match = re.fullmatch(pattern, text.strip(b" \t").upper())
    return () if match is None else match.groups()


def _of_operands(number: int, *operands: bytes) -> bytes:
    """The formula of a function; empty for one that is not computed here."""
    each = [bracketed(operand) for operand in operands]
    if number == 0 and len(each) == 1:
        return each[0]
    if number in _SIGNS and len(each) == 2:
        return _SIGNS[number].join(each)
    return _ALONE[number] + each[0] if number in _ALONE and len(each) == 1 else b""


def bracketed(operand: bytes) -> bytes:
    """An operand as a formula has it."""
    return b"(" + _pointed(operand) + b")"


def _pointed(text: bytes) -> bytes:
    """Decimal points in the place of commas."""
    return text.replace(b",", b".").strip(b" \t")
