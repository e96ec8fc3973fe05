"""How a dialect computes numbers: what its table says of variables, operators and functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Arithmetic:
    """How numbers are computed from variables."""

    levels: tuple[tuple[str, ...], ...] = ()
    """Operators, those that bind most first; within a level they apply from left to right."""
    functions: frozenset[str] = frozenset()
    brackets: Literal["[]", "()"] = "[]"
    floor: bool = False
    """FIX and FUP round down and up; otherwise towards zero and away from it."""
    angles: bool = False
    """ASIN and ATAN give what mathematics says; otherwise a parameter chooses among the angles."""
    bits: bool = False
    """AND, OR and XOR work on bits, and are left alone here; otherwise on true and false."""
    together: bool = False
    """All numbers of a line are read before any variable of it is set."""
    exact: bool = False
    """A computed position is taken as it is; otherwise it is rounded to the least increment."""
    careful: bool = False
    """What the last digits of a function decide is not known."""
    local: int = 0
    """Variables up to this number belong to the program alone: no tool change sets them."""
    system: int = 0
    """From this number on variables belong to the control."""
    offsets: int = 0
    """From this number on a variable may hold data that rename where the axes stand; 0: none."""
    timers: frozenset[int] = frozenset()
    """Those of them that hold no such thing."""
    overrides: str = ""
    """That which switches overrides and feed hold off, by anything but 0."""
    at_selection: bool = False
    """What such a variable holds takes effect where a work system is selected, not before."""
    compared: Literal["near", "digits", "relative"] = "near"
    """Numbers are equal within LinuxCNC's tolerance; in some eight digits, where what is nearly
    equal is not certain; within a relative 1e-12."""
    chained: bool = True
    """A comparison of what a comparison gave is computed; it is left alone otherwise."""
    vacant: bool = False
    """A variable may be vacant, which equals no number: ``#0``, or what G65 was not given."""
    parameters: str = ""
    """Letters of the arguments of a macro, #1 first; a blank for one that has no letter."""
    feed: frozenset[str] = frozenset()
    """What reads the F in force: variables (``4109``, ``<_feed>``), any of the control's where
    they begin with ``$``, or a function (``FN 18``)."""
    own_line: str = ""
    """Variable that holds the number of the line it is read in."""
    q_parameters: bool = False
    """Variables are Heidenhain's: Q1, QL1, QR1."""
