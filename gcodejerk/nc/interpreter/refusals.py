"""Blocks that some of a dialect's controls refuse, and others run.

Rule: such a block is executed or changes nothing; whoever executes it reckons with both.
"""

from __future__ import annotations

import math

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.gcodes import G4, G43_1, G80
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.rules import AXIS_USERS, takes_axes


def refused_by_some(codes: Codes, state: State, dialect: Dialect) -> str:
    """Name what some of the dialect's controls refuse in a block; empty without anything.

    Parameters
    ----------
    codes : Codes
        Of the block, which the others accept (`rules.is_complete`).
    state : State
        In front of it.
    dialect : Dialect
        Of the program.
    """
    names = [f"G{code / 10:g}" for code in codes.g.values()] + [f"M{m}" for m in codes.m]
    if code := next((name for name in names if name in dialect.refused), ""):
        return code
    rules, axes = dialect.refuses, codes.moved()
    tool = codes.values.get("T", 0.0)
    if rules.tool < math.inf and (tool > rules.tool or tool % 1.0):
        return f"T{tool:g}"
    if rules.bare_dwell and G4 in codes.g.values() and "P" not in codes.values:
        return "G4 without P"
    if rules.bare_inverse and _lacks_time(codes, state, dialect):
        return "a feed motion without F in G93"
    effect = dialect.effect(codes.g.get("non-modal"))
    if rules.bare_table and effect == "table" and not axes:
        return "G10 without an axis"
    if rules.bare_centre and not axes and not codes.values.keys().isdisjoint("IJKR"):
        return "the centre or radius of an arc without an axis"
    return _axes_taken(codes, state, dialect, effect in AXIS_USERS)


def _lacks_time(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether a feed motion is stated without F in G93, or in a mode that may be that.

    Who refuses it begins in G94.
    """
    mode = dialect.feed_modes.get(codes.g.get("feed mode", -1), state.feed_mode)
    feeds = codes.g.get("motion", G80) not in (dialect.rapid, G80)
    inverse = mode == 93 or (mode is None and state.inverse is not False)
    return inverse and feeds and "F" not in codes.values


def _axes_taken(codes: Codes, state: State, dialect: Dialect, takes: bool) -> str:
    """The same of axis words that no motion takes; `takes`: a code like G28 stands in the block."""
    rules, axes = dialect.refuses, codes.moved()
    length, motion = codes.g.get("tool length"), codes.g.get("motion")
    if length in rules.lengths and (axes or takes or motion not in (None, G80)):
        return f"G{length / 10:g} beside axis words or what takes some"
    if rules.length_axis and length == G43_1 and axes != {rules.length_axis}:
        return f"G43.1 with other axes than {rules.length_axis}"
    in_force = state.motion if motion is None else motion
    if rules.still_words and axes and in_force is None:
        return "axis words while G80 may be in force"
    if rules.still_words and axes and in_force == G80 and (takes or takes_axes(codes)):
        return "axis words while G80 is in force"
    return ""
