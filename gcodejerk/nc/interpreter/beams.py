"""Beams: lasers and plasma torches, which burn in G1 and are dark in G0.

Rule: a rapid that is written as G1 while a beam may be on burns the work. Whether M3 turns on a
spindle or a beam no program says for certain, so the machine file does (`Start.spindle`); a program
that behaves like one for a laser is not believed to be for a mill all the same.
"""

from __future__ import annotations

from typing import Literal

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import State

BEAMS = ("laser", "plasma")
Dark = Literal["", "on", "always"]
"""When rapids have to stay G0: never, while M3 or M4 is on, always."""
_OUTPUTS = frozenset({*range(62, 69), *range(100, 200)})
"""M codes that set outputs, or run programs of the user's, either of which may fire a beam."""


def shows_habits(codes: Codes, state: State, feeds: bool, dialect: Dialect) -> bool:
    """Whether a block does what programs for lasers do and programs for mills do not.

    Parameters
    ----------
    codes : Codes
        Its words.
    state : State
        Behind it.
    feeds : bool
        It moves at feed.
    dialect : Dialect
        Of the program.
    """
    if not dialect.beam_codes.isdisjoint(codes.m):
        return True
    if inline_power(codes, b"I" if "I" in codes.values else b""):
        return True
    return feeds and "S" in codes.values and state.spindle != 5


def inline_power(codes: Codes, rest: bytes) -> bool:
    """Whether a block is Marlin's ``M3 I``: the power follows S within moves."""
    return not {3, 4}.isdisjoint(codes.m) and rest[:1] in (b"I", b"i")


def uses_outputs(codes: Codes) -> bool:
    """Whether a block sets an output that may be the beam's."""
    return not _OUTPUTS.isdisjoint(codes.m)


def darkness(dialect: Dialect, spindle: str | None, habits: bool, outputs: bool) -> Dark:
    """When rapids of a program have to stay G0.

    Parameters
    ----------
    dialect : Dialect
        Of the program.
    spindle : str or None
        As `Start.spindle`.
    habits, outputs : bool
        Some block `shows_habits`, or `uses_outputs`.
    """
    if spindle in BEAMS:
        return "always" if outputs else "on"
    if dialect.dark_rapids and (spindle is None or habits):
        return "on"
    return ""
