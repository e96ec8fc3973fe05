"""Numbers of a program as decimals, and back: nothing is rounded on the way."""

from __future__ import annotations

from decimal import Decimal

from gcodejerk.cycles.drilling import DrillingRules
from gcodejerk.nc.text.block import Word

_LENGTHS = frozenset("XYZR")


def decimal(word: Word) -> Decimal:
    """The number of a word, exactly."""
    return Decimal(b"".join(word.text[1:].split()).decode())


def length(word: Word, rules: DrillingRules, *, inch: bool) -> Decimal | None:
    """The number of a word, as the control reads it without a decimal point; None unknown.

    Parameters
    ----------
    word : Word
        Of a block of a cycle; what is no length has only one reading.
    rules : DrillingRules
        The control's.
    inch : bool
        The program's unit.
    """
    number = decimal(word)
    lengths = _LENGTHS | {rules.peck}
    if rules.whole == "any" or not word.whole or not number or word.letter not in lengths:
        return number
    if rules.whole == "standard":
        return number.scaleb(-4 if inch else -3)
    # Whether Q goes with X, Y and Z where those are calculator's numbers, nobody has told.
    return number if rules.whole == "calculator" and word.letter != rules.peck else None


def plain(number: Decimal) -> bytes:
    """A number without exponent, with a decimal point, and never minus zero."""
    text = format(number if number else abs(number), "f")
    return (text.rstrip("0") if "." in text else text + ".").encode()


def whole(number: Decimal) -> bytes:
    """A whole number without a decimal point."""
    return str(int(number)).encode()
