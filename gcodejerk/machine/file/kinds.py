"""What a key of a machine file may hold: a number within bounds, a choice, a mapping and so on.

This module owns the kinds of values. Which key holds what is said in `table`, what follows from it
in `checker` and `schema`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Number:
    """A number within bounds; `above` and `below` are themselves excluded."""

    unit: str
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    smallest: float = 1e-9
    """Nothing on a machine is smaller, where zero is excluded: a slip in the exponent."""
    at_most: float = 1e15
    """Nothing on a machine is larger."""

    def holds(self, value: float) -> bool:
        """Whether a number lies within the bounds."""
        return (
            (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
        )

    def plausible(self, value: float) -> str | None:
        """Words for the end that a number is beyond though it is within the bounds, if any."""
        if abs(value) > self.at_most:
            return f"at most {self.at_most:g}"
        if self.above == 0.0 and 0.0 < value < self.smallest:
            return f"at least {self.smallest:g}"
        return None

    def expected(self, unit: str) -> str:
        """Words of a message for what should stand there."""
        bounds = []
        if self.above is not None:
            bounds.append("above zero" if self.above == 0.0 else f"above {self.above:g}")
        if self.at_least is not None:
            bounds.append(f"of at least {self.at_least:g}")
        if self.below is not None:
            bounds.append(f"below {self.below:g}")
        return " ".join(filter(None, ["a number", " and ".join(bounds), f"[{unit}]"]))


@dataclass(frozen=True, slots=True)
class Text:
    """One line of text, taken as written."""

    pattern: str
    expected: str


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few words."""

    words: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Flag:
    """True or false."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A low and a high end, as a list of two numbers."""

    of: Number


@dataclass(frozen=True, slots=True)
class ListOf:
    """A list."""

    of: Section | Choice | Text | Number | ListOf
    at_most: int
    """More make no sense on a machine, and aliases could stand for very many."""
    exactly: bool = False
    """Fewer make no sense either: the coordinates of a point."""


@dataclass(frozen=True, slots=True)
class Table:
    """A mapping whose keys are names from a set, such as axes."""

    entries: tuple[tuple[str, Kind], ...]
    """Pattern of the name, and what stands under such a name."""
    expected: str
    known: tuple[str, ...]
    """Names, or examples of names, that a misspelt one is compared with."""
    at_least: int = 0

    def kind_of(self, name: str) -> Kind | None:
        """Give what stands under a name; None for a name that is not one of these."""
        for pattern, kind in self.entries:
            if re.fullmatch(pattern, name):
                return kind
        return None


@dataclass(frozen=True, slots=True)
class OrMapping:
    """Something plain, or a mapping that says it at more length or otherwise."""

    plain: Text | ListOf
    mapping: Section


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a section."""

    name: str
    kind: Kind
    doc: str
    required: bool = False
    default: float | str | bool | None = None
    """What a missing key counts as; None where that depends on other keys or means `unknown`."""
    example: str | None = None


@dataclass(frozen=True, slots=True)
class Section:
    """A mapping with fixed keys."""

    keys: tuple[Key, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its keys."""
        return tuple(key.name for key in self.keys)


Kind = Number | Text | Choice | Flag | Pair | ListOf | Table | Section | OrMapping
