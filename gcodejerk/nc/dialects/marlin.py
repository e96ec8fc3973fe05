"""Marlin, also as mills use it.

Sources: the Marlin documentation (gcode pages); MarlinFirmware/Marlin issues 7165 (no code is
modal: every line states its own) and 24625 (``G0Y0X10`` is read as a hexadecimal number). F is one
for all moves: G0 runs at it like G1.

What a build has to switch on, and many do not (src/gcode/parser.cpp, src/gcode/gcode.h; config/
extras.h): comments in parentheses, without which ``G0 X5 (Z9)`` goes to Z9; small letters, without
which ``G0 x5`` names no axis; G20, without which lengths stay mm. A tab is no blank: a line that
begins with one is no command, and ``X<tab>5`` has no number. ``G+0`` is no command. One N in front
of a command is passed over, and has to be followed by a checksum where it does not come from a file
of the control's own (src/gcode/queue.cpp); a sender adds both, and then the program's own N is the
command, which nobody has. An arc whose ends lie on one ray from its centre is passed over with all
beside it (src/gcode/motion/G2_G3.cpp). Of a longer line the first MAX_CMD_SIZE - 1 = 95 characters
are read (src/gcode/queue.cpp). M501 and M502 load settings, the home offsets among them; M23, M24
and M26 go on in another file, or elsewhere in this one; M220 scales F until it is set to 100. With
GCODE_MOTION_MODES a line may begin with an axis or F, for the motion before; with G0_FEEDRATE, G0
runs at a speed of its own, and its F may be for G0 alone (src/gcode/parser.cpp,
src/gcode/motion/G0_G1.cpp).
"""

from __future__ import annotations

from gcodejerk.nc.dialects import limits
from gcodejerk.nc.dialects.dialect import Dialect, Effect, grouped
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590)
SILENT = (
    *(7, 8, 9, 17, 20, 21, 22, 27, 31, 42, 73, 75, 76, 77, 78),
    *(82, 83, 85, 92, 104, 105, 106, 107, 108, 109, 110, 111, 112, 113, 114, 115, 117, 118),
    *(119, 140, 141, 145, 149, 150, 155, 190, 191, 201, 203, 204, 205, 220, 221, 226, 250),
    *(256, 280, 300, 301, 302, 303, 304, 305, 355, 400, 500, 503, 504, 572, 593, 900),
    *(906, 907, 908, 909, 910, 911, 912, 913, 914),
)
"""M codes that move nothing and change no frame."""
MACROS = (28, 29, 32, 808, *range(810, 820))
"""What is written to a file instead of run, another file, a loop, macros (src/gcode/gcode.cpp)."""
EFFECTS: dict[int, Effect] = {
    40: "words",
    100: "words",  # firmware retract: E, and Z where it hops, which G11 takes back
    110: "words",
    **dict.fromkeys((120, 270, 280, 290, 300, 330, 340, 350, 380, 420, 600, 610, 760), "home"),
    **dict.fromkeys((382, 383, 384, 385), "home"),
    **dict.fromkeys(SYSTEMS, "frames"),
    530: "frames",
    920: "set",
}

MARLIN = Dialect(
    name="marlin",
    title="Marlin 2",
    sources=("marlinfw.org: gcode pages", "MarlinFirmware/Marlin issues 7165, 24625"),
    text=Text(
        messages=True,  # src/gcode/parser.cpp: string_arg
        parentheses="lone comment",
        capitals=True,
        tight=True,
        numbered=False,
        semicolon="comment",
        delete="none",
        o_word="error",
        percent="error",
        variables="none",
        blanks="between",
        checksum=True,
        hexadecimal=True,
        line_limit=95,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 50),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "units": (200, 210),
            "system": SYSTEMS,
            "non-modal": tuple(sorted(set(EFFECTS) - set(SYSTEMS) | {800})),
        }
    ),
    m_groups=grouped(
        {"stop": (0, 1, 2, 30), "spindle": (3, 4, 5), "silent": SILENT, "macro": MACROS}
    ),
    # No code changes these.
    defaults={"plane": 170, "feed mode": 940, "compensation": 400, "path": 640},
    effects=EFFECTS,
    letters="FSTXYZABCUVWDEHIJKLPQR",
    feed_modes={},
    paths={640: 64},
    modal_motion=False,
    extrudes=True,
    one_command=True,
    dark_rapids=True,
    incremental_set=True,
    feed_on_rapids=True,
    arcs_refused=True,
    feed_of_moves=True,
    refused=frozenset({"G20"}),
    m_scales=frozenset({220}),
    limits=limits.MARLIN,
    tool_frame=frozenset("T"),
    other_m="positions",
    redrawn=frozenset({50}),
    harmless=frozenset({0}),
    before_m=frozenset(),
    after_m=frozenset(),
    # Positions are single-precision floats, good for seven digits (not looked up).
    writing=Writing((b"; ", b""), b"M400", digits=7),
    note="G0 is read as running at the F in force, as Marlin does unless it is built with "
    "G0_FEEDRATE: with that, leave programs as they are",
)
