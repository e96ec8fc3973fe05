"""The words of a block, sorted: codes by modal group, numbers by letter.

Rule: sorting changes no state. What stands twice, or cannot be together, is marked here; whether
the controller accepts the whole is asked of `rules`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.modal import NAN
from gcodejerk.nc.interpreter.variables import before_block, word_value
from gcodejerk.nc.text.block import Block, Name

_LENGTHS = frozenset("XYZABCUVWR")
"""Addresses whose numbers say where a block ends, and may need a decimal point."""
_INCREMENT = 0.001
"""Least input increment of the IS-B system: 0.001 mm, 0.001 deg, or 0.0001 inch."""
_GROUPED_M = frozenset({"stop", "spindle", "coolant", "tool"})


@dataclass(slots=True)
class Codes:
    """The words of a block, sorted."""

    g: dict[str, int] = field(default_factory=dict)
    """Modal group -> G code."""
    names: list[Name] = field(default_factory=list)
    m: list[int] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)
    """Letter -> number, NaN for one that is not known; G, M and N left out."""
    unknown: bool = False
    """A code that is computed or that the dialect does not know."""
    unknown_code: str = ""
    """The first of these, as written."""
    fault: bool = False
    """The controller refuses the block."""
    expression: bool = False
    feed_whole: bool = False
    """F has no decimal point, where that may matter."""
    decimal: bool = False
    """A number without a decimal point, whose meaning the machine has not told."""
    functions: dict[str, str] = field(default_factory=dict)
    """Letter -> IC, AC and their kin."""
    increments: dict[str, float] = field(default_factory=dict)
    """Axis -> number of an address that is always an increment."""

    def reject(self, text: bytes) -> None:
        """Note a code that is not known."""
        self.unknown = True
        self.unknown_code = self.unknown_code or text.decode("latin-1")

    def moved(self) -> set[str]:
        """List the axes that words of the block name."""
        return {axis for axis in AXES if axis in self.values} | set(self.increments)


def sort_words(
    block: Block,
    dialect: Dialect,
    inch: bool,
    decimal_point: str | None,
    variables: Mapping[str, float],
) -> Codes:
    """Sort the words of a block into codes and values.

    Parameters
    ----------
    block : Block
        As written.
    dialect : Dialect
        How codes are grouped.
    inch : bool
        Lengths are inches, unless the block itself says what they are.
    decimal_point : str or None
        See `gcodejerk.start.Start`.
    variables : mapping of str to float
        Those that are known.

    Returns
    -------
    Codes
    """
    codes = Codes()
    values = codes.values
    whole: list[str] = []
    for word in block.words:
        value = word.value
        letter = word.letter
        if value is None:
            codes.expression = True
            if letter in "GM" or letter in dialect.calls:
                codes.reject(word.text)
                continue
            rules = dialect.arithmetic
            known = before_block(block, variables, rules)
            value = word_value(word, known, rules, inch and not _states_units(block, dialect))
        if letter == "G":
            code = round(value * 10.0)
            group = dialect.groups.get(code) if abs(value * 10.0 - code) < 1e-3 else None
            if group is None:
                codes.reject(word.text)
            elif group not in codes.g:
                codes.g[group] = code
            elif 800 in (code, codes.g[group]):
                codes.g[group] = max(codes.g[group], code) if code != 800 else codes.g[group]
                if codes.g[group] == 800:
                    codes.g[group] = code
            else:
                codes.fault = True
                codes.g[group] = code
        elif letter == "M":
            number = round(value)
            m_group = dialect.m_groups.get(number) if number == value else None
            if m_group is None:
                if dialect.other_m == "unknown" or number != value:
                    codes.reject(word.text)
            elif m_group in _GROUPED_M and any(dialect.m_groups.get(m) == m_group for m in codes.m):
                codes.fault = True
            codes.m.append(number)
        elif letter in dialect.calls:
            codes.reject(word.text)
        elif letter in dialect.increments:
            axis = dialect.increments[letter]
            if axis in codes.increments or axis in values:
                codes.fault = True
            codes.increments[axis] = value
            if word.whole and value:
                whole.append(letter)
        elif letter != "N":
            if letter in values or letter in codes.increments:
                codes.fault = True
                value = NAN
            values[letter] = value
            if word.whole and value and letter in _LENGTHS:
                whole.append(letter)
            if letter == "F":
                codes.feed_whole = word.whole and dialect.whole_numbers == "machine"
            if word.function:
                codes.functions[letter] = word.function
    if block.assigns:
        codes.expression = True
    codes.names = list(block.names)
    if dialect.one_command and codes.g and (codes.m or len(codes.g) > 1):
        codes.fault = True
    if whole and dialect.whole_numbers == "machine":
        _whole_numbers(codes, whole, dialect, inch, decimal_point)
    return codes


def _states_units(block: Block, dialect: Dialect) -> bool:
    """Whether a code for inch or mm stands in the block."""
    codes = {round(w.value * 10.0) for w in block.words if w.letter == "G" and w.value is not None}
    return not codes.isdisjoint(dialect.units)


def _whole_numbers(
    codes: Codes, letters: list[str], dialect: Dialect, inch: bool, decimal_point: str | None
) -> None:
    """Give numbers without a decimal point the meaning that the machine file states."""
    if decimal_point == "calculator" or dialect.effect(codes.g.get("non-modal")) == "words":
        return
    units = codes.g.get("units")
    inch = inch if units is None else dialect.units[units]
    for letter in letters:
        axis = dialect.increments.get(letter)
        where = codes.values if axis is None else codes.increments
        key = letter if axis is None else axis
        if decimal_point is None:
            codes.decimal = True
            where[key] = NAN
        else:
            turns = key in "ABC"
            where[key] *= _INCREMENT / 10.0 if inch and not turns else _INCREMENT
