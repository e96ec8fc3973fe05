"""Klipper.

Sources: Klipper's docs, G-Codes.md; Klipper3d/klipper issue 3911 (``( )`` is no comment). Macros
have names and may do anything; what they leave behind is unknown. F is one for all moves. A code is
compared as it is written: ``G00`` is unknown (klippy/gcode.py, _process_commands), and what is not
known is passed over. Behind a sender's N, the program's own is taken for the command.
So are G2 and G3 without the section [gcode_arcs]. What stands between EXCLUDE_OBJECT_START and
EXCLUDE_OBJECT_END is left out where the operator says so.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects import limits
from gcodejerk.nc.dialects.marlin import MARLIN
from gcodejerk.nc.dialects.spelling import Text

KLIPPER = replace(
    MARLIN,
    name="klipper",
    title="Klipper",
    sources=("Klipper3d/klipper: docs/G-Codes.md", "Klipper3d/klipper issue 3911"),
    text=Text(
        parentheses="code",
        padded=False,
        numbered=False,
        semicolon="comment",
        delete="none",
        o_word="error",
        percent="error",
        names=True,
        variables="none",
        blanks="between",
        checksum=True,
        line_limit=1024,
    ),
    # G20 is refused, and a G92 without any of its letters sets each of their positions to 0
    # (klippy/extras/gcode_move.py).
    groups={code: group for code, group in MARLIN.groups.items() if code != 200},
    defaults={**MARLIN.defaults, "units": 210},
    note="",
    bare_set="zero",
    set_letters="XYZE",
    refused=frozenset(),
    redrawn=frozenset({20, 30, 50}),
    arcs_refused=False,
    other_m="unknown",  # a macro of the owner's, perhaps
    dark_rapids=False,  # M3 is a macro there, if anything; a laser is declared
    limits=limits.KLIPPER,
    names={
        "SET_VELOCITY_LIMIT": "limit",
        **dict.fromkeys(
            (
                *("SET_PRESSURE_ADVANCE", "SET_INPUT_SHAPER", "M117"),
                *("SET_HEATER_TEMPERATURE", "TEMPERATURE_WAIT", "SET_FAN_SPEED", "SET_PIN"),
                *("SET_PRINT_STATS_INFO", "SET_DISPLAY_TEXT", "RESPOND", "EXCLUDE_OBJECT_DEFINE"),
            ),
            "none",
        ),
        **dict.fromkeys(("EXCLUDE_OBJECT", "EXCLUDE_OBJECT_START", "EXCLUDE_OBJECT_END"), "home"),
    },
)
