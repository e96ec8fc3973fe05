"""What some controls of a dialect refuse and others run, beside whole codes (`Dialect.refused`).

Whoever sends a program to a control that refuses a block may go on with the next one, so that such
a block is executed or changes nothing, and both are reckoned with.

Source: gnea/grbl, grbl/gcode.c, gc_execute_line; grblHAL/core, gcode.c; bdring/FluidNC, GCode.cpp.
The rules were found by running drawn programs through the first two of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Refusals:
    """Words and combinations that are refused by some; by default none are."""

    axes: frozenset[str] = frozenset()
    """Axes of which a word is refused where the machine does not have them."""
    tool: float = math.inf
    """The largest T; one that is no whole number, too, where there is a largest."""
    bare_dwell: bool = False
    """G4 without P."""
    bare_inverse: bool = False
    """A feed motion in G93 that is stated without F, whether an axis moves or not."""
    lengths: frozenset[int] = frozenset()
    """Codes of the tool length that take axis words for themselves, though they have no use for
    them, and stand beside nothing else that takes some: grbl's ``G49 X5`` moves nothing."""
    bare_table: bool = False
    """G10 without an axis word."""
    bare_centre: bool = False
    """I, J, K or R of an arc without an axis word."""
    end_beside: bool = False
    """G80 beside another code of its group."""
    still_words: bool = False
    """Axis words, those of G28, G92 and their kin, too, while G80 is in force or may be."""
    length_axis: str = ""
    """The axis of G43.1, which has to stand there alone; empty where any may."""
