"""Limits of speed, acceleration and jerk that programs set, by the control's own words.

Only what bounds a straight move without extrusion stands here, as streams and rapids are. Marlin
takes travel acceleration for every block without extrusion, G1 too (MarlinFirmware/Marlin,
Marlin/src/module/planner.cpp, _populate_block; M204 P is that of the others). What acts at corners
alone does not: M205 X and J, M566, Klipper's square_corner_velocity and grbl's $11 compare
directions at one speed, and the points of a stream lie on a line.

Sources: Marlin/src/gcode/config/M200-M205.cpp; Duet3D/RepRapFirmware, src/GCodes/GCodes2.cpp (M203
in mm/min); Klipper3d/klipper, docs/G-Codes.md and klippy/toolhead.py (M204 P and T: the lower of
both, for every move); gnea/grbl, doc/markdown/settings.md (settings are refused while it moves);
grblHAL's $800 is its jerk; SINUMERIK ONE NC programming, ACC, VELOLIM and JERKLIM: percent of
machine data.

Siemens has acceleration and jerk for each dynamic mode, DYNNORM being the first (SINUMERIK ONE,
01/2023, p. 209, MD32300; mold making, p. 162), and bounds the jerk under SOFT (MD32431; 828D, B2
4.2.12). That BRISK does not, that DRIVE accelerates less at high speed, and that CYCLE832 selects a
dynamic mode, is general knowledge that was not looked up. The machine file's numbers count as those
of DYNNORM; a jerk in it, as that of SOFT.

Inches count as mm here, which is the lower limit of the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Quantity = Literal["velocity", "acceleration", "jerk"]
Table = Mapping[str, Mapping[str, "Limit"]]
SETTING = "$"
"""Name in a table of what stands for itself: ``$120=500``."""
PERCENT = "%"
"""Word in a table of what an axis in brackets and percent stand behind: ``ACC[X]=50``."""


@dataclass(frozen=True, slots=True)
class Limit:
    """What a word sets."""

    quantity: Quantity
    axis: str = ""
    """Whose it is; none: of the move, whichever axes it has."""
    scale: float = 1.0
    """Of 1 in the program. [mm/s, mm/s^2, mm/s^3; deg]"""


@dataclass(frozen=True, slots=True)
class Mode:
    """What a name alone selects."""

    thing: str
    """What it is a kind of: one of them is in force at a time."""
    keeps: Literal["stated", "lower", "jerk"]
    """What the machine file states; what may be lower; a jerk limit, which that may not have."""


def _axes(quantity: Quantity, scale: float = 1.0) -> dict[str, Limit]:
    """One for each axis, under its letter."""
    return {axis: Limit(quantity, axis, scale) for axis in "XYZABCUVW"}


_TRAVEL = {"S": Limit("acceleration"), "T": Limit("acceleration")}
PER_MINUTE = 1.0 / 60.0

MARLIN: Table = {"M201": _axes("acceleration"), "M203": _axes("velocity"), "M204": _TRAVEL}
DUET: Table = {**MARLIN, "M203": _axes("velocity", PER_MINUTE)}
KLIPPER: Table = {
    "M204": {**_TRAVEL, "P": Limit("acceleration")},
    "SET_VELOCITY_LIMIT": {"VELOCITY": Limit("velocity"), "ACCEL": Limit("acceleration")},
}
GRBL: Table = {
    SETTING: {
        **{f"{110 + k}": Limit("velocity", axis, PER_MINUTE) for k, axis in enumerate("XYZABC")},
        **{f"{120 + k}": Limit("acceleration", axis) for k, axis in enumerate("XYZABC")},
        **{f"{800 + k}": Limit("jerk", axis) for k, axis in enumerate("XYZABC")},
    }
}
SIEMENS: Table = {
    "ACC": {PERCENT: Limit("acceleration")},
    "VELOLIM": {PERCENT: Limit("velocity")},
    "JERKLIM": {PERCENT: Limit("jerk")},
}
SIEMENS_MODES: Mapping[str, Mode] = {
    "DYNNORM": Mode("dynamic mode", "stated"),
    **dict.fromkeys(
        ("DYNPOS", "DYNROUGH", "DYNSEMIFIN", "DYNFINISH", "CYCLE832"),
        Mode("dynamic mode", "lower"),
    ),
    "BRISK": Mode("profile of the path", "stated"),
    "SOFT": Mode("profile of the path", "jerk"),
    "DRIVE": Mode("profile of the path", "lower"),
}
