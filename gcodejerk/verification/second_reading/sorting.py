"""The words of a line by what they are, for the second reading.

Rule: a line with a word that stands twice, two codes of one group, or anything without a meaning in
the dialect's table is not understood as a whole.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import HARMLESS, Dialect
from gcodejerk.nc.dialects.gcodes import G80
from gcodejerk.verification.second_reading.reading import NAN, Line

LEAST = 0.001
"""Increment that a number without a decimal point counts, where it does: mm or deg."""
_SINGLE = ("stop", "spindle", "coolant", "tool")


class Sorted:
    """The words of a line, by what they are."""

    __slots__ = ("axes", "feed_whole", "g", "increments", "m", "relative", "values")

    def __init__(self) -> None:
        self.g: dict[str, int] = {}
        self.m: list[int] = []
        self.values: dict[str, float] = {}
        self.increments: dict[str, float] = {}
        self.relative: dict[str, str] = {}
        self.axes = 0
        self.feed_whole = False

    def sort(
        self,
        line: Line,
        dialect: Dialect,
        inch: bool,
        decimals: str | None,
        motion: int | None = None,
    ) -> bool:
        """Sort; whether every word has a meaning that is known, and none stands twice.

        The motion that is in force matters where words may be polar.
        """
        if not self._codes(line, dialect):
            return False
        self.relative = line.relative
        dwells = any(dialect.effect(code) == "words" for code in self.g.values())
        inch = dialect.units[self.g["units"]] if "units" in self.g else inch
        for letter, number, whole in line.words:
            if letter in "GMN":
                continue
            if not self._may_stand(letter, dialect):
                return False
            axis = dialect.increments.get(letter)
            if letter == "F":
                self.feed_whole = whole
            elif whole and number and (axis or letter in AXES or letter == "R"):
                read = None if dwells else decimals
                number = _without_point(number, axis or letter, dialect, read, inch=inch)
            self._put(letter, axis, number)
        if dialect.polar and "cycle" not in self.g and not self._cartesian(dialect, motion):
            return False
        # axis words beside a code of the builder's may be its own
        return not (self.axes and any(group.startswith(HARMLESS) for group in self.g))

    def _codes(self, line: Line, dialect: Dialect) -> bool:
        """Sort the codes; whether they are known and may stand together."""
        for letter, number, _ in line.words:
            if letter == "G" and not self._g_code(number, dialect):
                return False
            if letter == "M":
                if number != number or number != int(number):
                    return False
                self.m.append(int(number))
        groups = [dialect.m_groups.get(m) for m in self.m]
        if any(groups.count(group) > 1 for group in _SINGLE):
            return False
        if dialect.distance_first and _distance_late(line, dialect):
            return False
        commands = dialect.one_command and (self.g or self.m)
        return not commands or _modes_first(line, dialect)

    def _g_code(self, number: float, dialect: Dialect) -> bool:
        """Sort a code; whether it is known, and the only one of its group."""
        code = round(number * 10.0) if number == number else -1
        group = dialect.groups.get(code)
        if group is None or abs(number * 10.0 - code) > 1e-3:
            return False
        there = self.g.get(group)
        if there not in (None, G80) and code != G80:
            return False
        if there is not None and dialect.refuses.end_beside:
            return False
        if there in (None, G80):
            self.g[group] = code  # beside G80, another code of its group is the one that counts
        return there != code

    def _may_stand(self, letter: str, dialect: Dialect) -> bool:
        """Whether a letter is known, and neither it nor its axis stood in the line before."""
        axis = dialect.increments.get(letter)
        if letter in self.values or (axis or letter) in self.increments:
            return False
        if letter in dialect.calls and "label" not in self._effects(dialect):
            return False
        taken = dialect.set_letters
        if taken and letter not in taken and "set" in self._effects(dialect):
            return False
        if letter not in dialect.letters and axis is None and not dialect.one_command:
            return False
        return axis not in self.values

    def _effects(self, dialect: Dialect) -> set[str]:
        """What the codes do besides."""
        return {dialect.effect(code) for code in self.g.values()}

    def _cartesian(self, dialect: Dialect, motion: int | None) -> bool:
        """Whether no radius and no angle says where the block leads; an arc has a radius."""
        arc = self.g.get("motion", motion) in dialect.arcs and self.axes != 0
        return set(dialect.polar[: -1 if arc else None]).isdisjoint(self.values)

    def _put(self, letter: str, axis: str | None, number: float) -> None:
        """Enter a word that is no code; `axis` where it is always an increment of one."""
        if axis is not None:
            self.increments[axis] = number
        else:
            self.values[letter] = number
        name = axis or letter
        if name in AXES:
            self.axes |= 1 << AXES.index(name)


def _modes_first(line: Line, dialect: Dialect) -> bool:
    """Whether nothing but modes that do the same anywhere stands in front of the last command."""
    letters = "".join(letter for letter, _, _ in line.words)
    last = max(letters.rfind("G"), letters.rfind("M"))
    front = [(letter, number) for letter, number, _ in line.words[:last] if letter != "N"]
    return all(a == "G" and round(number * 10.0) in dialect.in_turn for a, number in front)


def _distance_late(line: Line, dialect: Dialect) -> bool:
    """Whether G90 or G91 stands behind an axis word."""
    moved = False
    for letter, number, _ in line.words:
        group = dialect.groups.get(round(number * 10.0)) if letter == "G" else None
        if moved and group == "distance":
            return True
        moved = moved or letter in AXES
    return False


def _without_point(
    number: float, name: str, dialect: Dialect, decimals: str | None, *, inch: bool
) -> float:
    """What a number without a decimal point says; NaN where the machine has not told."""
    if dialect.whole_numbers != "machine" or decimals == "calculator":
        return number
    small = LEAST / 10.0 if inch and name not in "ABC" else LEAST
    return number * small if decimals == "standard" else NAN
