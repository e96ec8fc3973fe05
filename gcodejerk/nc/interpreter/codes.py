"""The words of a block, sorted: codes by modal group, numbers by letter.

Rule: sorting changes no state. What stands twice, or cannot be together, is marked here; whether
the controller accepts the whole is asked of `rules`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import HARMLESS, Dialect
from gcodejerk.nc.dialects.gcodes import G80
from gcodejerk.nc.interpreter.modal import NAN
from gcodejerk.nc.interpreter.variables import before_block, word_value
from gcodejerk.nc.text.block import Block, Name, Word

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
    calls: list[Name] = field(default_factory=list)
    """Words that call a subprogram by themselves: L123."""
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

    def switched(self, begins: bool | str) -> bool | None:
        """Whether what P or Q of the block switches is on; None where that is not known."""
        if begins == "Q":
            number = self.values.get("Q", NAN)
            return None if number != number else number not in (0.0, 1.0)
        return switched(self.values.get("P", 0.0)) if begins == "P" else bool(begins)


def switched(number: float) -> bool | None:
    """Whether a P that switches something turns it on; None where P is not known."""
    return None if number != number else number != 0.0


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
    sorter = _Sorter(block, dialect, inch=inch, variables=variables)
    codes = sorter.codes
    for word in block.words:
        value = sorter.computed(word) if word.value is None else word.value
        if word.letter in sorter.calls:
            codes.calls.append(Name(word.text.decode("latin-1").upper(), b""))
        elif value is None:
            codes.reject(word.text)
        elif word.letter == "G":
            sorter.g_code(word, value)
        elif word.letter == "M":
            sorter.m_code(word, value)
        elif word.letter in dialect.increments:
            sorter.increment(word, value)
        elif word.letter != "N":
            sorter.number(word, value)
    if codes.moved() and any(group.startswith(HARMLESS) for group in codes.g):
        codes.reject(b"axis words beside a harmless code")
    codes.expression = codes.expression or bool(block.assigns)
    codes.names = [*block.names, *codes.calls]
    if dialect.one_command and (codes.g or codes.m) and not _in_turn(block, dialect):
        codes.fault = True
    if sorter.whole and dialect.whole_numbers == "machine":
        _whole_numbers(codes, sorter.whole, dialect, inch, decimal_point)
    return codes


class _Sorter:
    """Puts the words of a block where they belong, one by one."""

    def __init__(
        self, block: Block, dialect: Dialect, *, inch: bool, variables: Mapping[str, float]
    ) -> None:
        self.codes = Codes()
        self.whole: list[str] = []
        """Letters whose number has no decimal point, where it may need one."""
        self._block, self._dialect = block, dialect
        self._inch, self._variables = inch, variables
        self.calls = "" if dialect.calls and _is_label(block, dialect) else dialect.calls
        """Letters that call a subprogram."""

    def computed(self, word: Word) -> float | None:
        """The number of a word that is an expression; None where it is that of a code."""
        codes, rules = self.codes, self._dialect.arithmetic
        if word.letter in "GM" or word.letter in self._dialect.calls:
            codes.expression = True
            return None
        known = before_block(self._block, self._variables, rules)
        inch = self._inch and not _states_units(self._block, self._dialect)
        value = word_value(word, known, rules, inch)
        codes.expression = codes.expression or value != value
        return value

    def g_code(self, word: Word, value: float) -> None:
        """A G word; beside G80, another code of its group is the one that counts."""
        g, code = self.codes.g, round(value * 10.0)
        group = self._dialect.groups.get(code) if abs(value * 10.0 - code) < 1e-3 else None
        if group is None:
            self.codes.reject(word.text)
        elif group not in g or g[group] == G80:
            self.codes.fault |= group in g and self._dialect.refuses.end_beside
            g[group] = code
            late = group == "distance" and self._dialect.distance_first and self.codes.moved()
            self.codes.fault = self.codes.fault or bool(late)
        elif code != G80:
            self.codes.fault = True
            g[group] = code
        else:
            self.codes.fault |= self._dialect.refuses.end_beside

    def m_code(self, word: Word, value: float) -> None:
        """An M word."""
        codes, groups, number = self.codes, self._dialect.m_groups, round(value)
        group = groups.get(number) if number == value else None
        if group is None:
            if self._dialect.other_m == "unknown" or number != value:
                codes.reject(word.text)
        elif group in _GROUPED_M and any(groups.get(m) == group for m in codes.m):
            codes.fault = True
        codes.m.append(number)

    def increment(self, word: Word, value: float) -> None:
        """A word that is always an increment of an axis: U, V, W, H of a lathe."""
        codes, axis = self.codes, self._dialect.increments[word.letter]
        if axis in codes.increments or axis in codes.values:
            codes.fault = True
        codes.increments[axis] = value
        if word.whole and value:
            self.whole.append(word.letter)

    def number(self, word: Word, value: float) -> None:
        """Any other word."""
        codes, letter = self.codes, word.letter
        if letter in codes.values or letter in codes.increments:
            codes.fault = True
            value = NAN
        codes.values[letter] = value
        if word.whole and value and letter in _LENGTHS:
            self.whole.append(letter)
        if letter == "F":
            codes.feed_whole = word.whole and self._dialect.whole_numbers == "machine"
        if word.function:
            codes.functions[letter] = word.function


def _in_turn(block: Block, dialect: Dialect) -> bool:
    """Whether the commands of a block do the same in turn as together: modes, then one more.

    What stands in front of the first, an axis or a T, makes something else of the line.
    """
    words = [word for word in block.words if word.letter != "N"]
    last = max(k for k, word in enumerate(words) if word.letter in "GM")
    return all(
        word.letter == "G"
        and word.value is not None
        and round(word.value * 10.0) in dialect.in_turn
        for word in words[:last]
    )


def _is_label(block: Block, dialect: Dialect) -> bool:
    """Whether the block is a place that calls lead to: ``G98 L1``."""
    codes = [round(w.value * 10.0) for w in block.words if w.letter == "G" and w.value is not None]
    return any(dialect.effect(code) == "label" for code in codes)


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
