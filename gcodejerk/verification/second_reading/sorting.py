"""The words of a line by what they are, for the second reading.

Rule: a line with a word that stands twice, two codes of one group, or anything without a meaning in
the dialect's table is not understood as a whole.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.reading import NAN, Line

LEAST = 0.001
"""Increment that a number without a decimal point counts, where it does: mm or deg."""
_SINGLE = ("stop", "spindle", "coolant", "tool")


class Sorted:
    """The words of a line, by what they are."""

    __slots__ = ("axes", "feed_whole", "g", "increments", "m", "values")

    def __init__(self) -> None:
        self.g: dict[str, int] = {}
        self.m: list[int] = []
        self.values: dict[str, float] = {}
        self.increments: dict[str, float] = {}
        self.axes = 0
        self.feed_whole = False

    def sort(self, line: Line, dialect: Dialect, inch: bool, decimals: str | None) -> bool:
        """Sort; whether every word has a meaning that is known, and none stands twice."""
        plain: list[tuple[str, float, bool]] = []
        for letter, number, whole in line.words:
            if letter == "G":
                code = round(number * 10.0) if number == number else -1
                group = dialect.groups.get(code)
                if group is None or abs(number * 10.0 - code) > 1e-3 or group in self.g:
                    return False
                self.g[group] = code
            elif letter == "M":
                if number != number or number != int(number):
                    return False
                self.m.append(int(number))
            elif letter != "N":
                plain.append((letter, number, whole))
        groups = [dialect.m_groups.get(m) for m in self.m]
        if any(groups.count(group) > 1 for group in _SINGLE):
            return False
        if dialect.one_command and len(self.g) + len(self.m) > 1:
            return False
        dwells = any(dialect.effect(code) == "words" for code in self.g.values())
        inch = dialect.units[self.g["units"]] if "units" in self.g else inch
        for letter, number, whole in plain:
            if not self._value(letter, number, whole, dialect, None if dwells else decimals, inch):
                return False
        return True

    def _value(
        self,
        letter: str,
        number: float,
        whole: bool,
        dialect: Dialect,
        decimals: str | None,
        inch: bool,
    ) -> bool:
        """Sort a word that is no code."""
        axis = dialect.increments.get(letter)
        known = letter in dialect.letters or axis is not None
        if letter in dialect.calls or letter in self.values or (axis or letter) in self.increments:
            return False
        if not known and not dialect.one_command:
            return False
        if axis in self.values:
            return False
        if letter == "F":
            self.feed_whole = whole
        elif (
            (axis or letter in AXES or letter == "R")
            and (whole and number)
            and (dialect.whole_numbers == "machine" and decimals != "calculator")
        ):
            small = LEAST / 10.0 if inch and (axis or letter) not in "ABC" else LEAST
            number = number * small if decimals == "standard" else NAN
        if axis is not None:
            self.increments[axis] = number
            self.axes |= 1 << AXES.index(axis)
        else:
            self.values[letter] = number
            if letter in AXES:
                self.axes |= 1 << AXES.index(letter)
        return True
