"""grbl 1.1, and what follows its language (grblHAL, FluidNC).

Source: gnea/grbl, grbl/gcode.c and grbl/protocol.c. Blanks and control characters are thrown away,
a parenthesis that does not close ends with its line, and ``%``, O and M6 are errors. A ``/`` in
front is thrown away (the block runs), skips the block where that is on (grblHAL), or is an error
(FluidNC). FluidNC (collapseGCode) lets a ``;`` within parentheses end the line, too. M2 leaves G1,
power-on G0: which of the two is in force at the start is not known.

What plain grbl refuses and grblHAL (gcode.c) or FluidNC (GCode.cpp) run stands in `refused`: a
block that holds such a code is executed or changes nothing at all (gc_execute_line returns before
gc_state is written), and both are reckoned with. grblHAL's cutter compensation, scaling, diameters
and macros are named so that nothing is taken for certain behind them. M7 needs ENABLE_M7.
"""

from __future__ import annotations

from gcodejerk.nc.dialects import limits
from gcodejerk.nc.dialects.dialect import COMPENSATION, Dialect, code_names, grouped
from gcodejerk.nc.dialects.refusals import Refusals
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590)

GRBL = Dialect(
    name="grbl",
    title="grbl 1.1, grblHAL, FluidNC",
    sources=("gnea/grbl: grbl/gcode.c, grbl/protocol.c",),
    text=Text(
        parentheses="open comment",
        semicolon="comment",
        inner_semicolon=True,
        delete="first",
        o_word="error",
        percent="error",
        variables="none",
        blanks="anywhere",
        # FluidNC refuses longer lines, comments and all (gc_execute_line); plain grbl those that
        # have more than LINE_BUFFER_SIZE - 1 characters without them (protocol.c).
        line_limit=127,
        long_comments=True,
        characters=79,
        digits=8,  # MAX_INT_DIGITS: 00000012.5 is 12, and 0000000012 is 0 (nuts_bolts.c)
        number_digits=7,  # MAX_LINE_NUMBER 10000000
        # Feed hold, resume, door, cancel, overrides, coolant (grbl's config.h, serial.c); grblHAL's
        # own (grbl.h), macros among them.
        instant=bytes(
            (
                *(*b"!~", *range(0x80, 0x8D), *range(0x90, 0x98), *range(0x99, 0x9F)),
                *(*range(0xA0, 0xA5), *range(0xB0, 0xB8)),
            )
        ),
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 382, 383, 384, 385, 800),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "arc distance": (911,),
            "feed mode": (930, 940),
            "units": (200, 210),
            "compensation": (400,),
            "tool length": (430, 431, 432, 490),
            "system": SYSTEMS,
            "path": (610,),
            "path tolerance": (640,),  # grblHAL may be built with it; lines stay lines
            "non-modal": (40, 100, 280, 281, 300, 301, 530, 920, 921),
            "retract": (980, 990),
            "grblHAL's compensation": (410, 411, 420, 421),
            "scaling": (500, 510),
            "diameter": (70, 80),
            "macro": (650, 660, 661, 670),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "spindle": (3, 4, 5),
            "coolant": (7, 8, 9),
            "override": (48, 49, 50, 51, 53, 56),
            "tool": (6,),
            "output": (62, 63, 64, 65, 66, 67, 68),
        }
    ),
    defaults={
        "plane": 170,
        "distance": 900,
        "arc distance": 911,
        "feed mode": 940,
        "compensation": 400,
        "system": 540,
        # G61 is the only path mode, and is no exact stop: blocks blend as far as $11 allows.
        "path": 610,
    },
    bare_return=True,
    effects={
        **dict.fromkeys((280, 300), "return"),
        **dict.fromkeys((281, 301), "store"),
        **dict.fromkeys(SYSTEMS, "system"),
        **dict.fromkeys((430, 431, 432, 490), "length"),
        70: "diameter",
        80: "radius",
        650: "flow",
        **dict.fromkeys((660, 661), "modal cycle"),
        100: "table",
        530: "machine",
        920: "set",
        921: "clear",
    },
    transforms={
        **dict.fromkeys((410, 411, 420, 421), (COMPENSATION, True)),
        400: (COMPENSATION, False),
        **{510: ("scaling", True), 500: ("scaling", False)},
        670: ("modal macro", False),
    },
    refused=code_names(
        *("G43", "G43.2", "G64", "G98", "G99", "G41", "G41.1", "G42", "G42.1", "G50", "G51"),
        *("G7", "G8", "M6", "M7", "M48", "M49", "M50", "M51", "M53", "M56"),
        *(f"M{n}" for n in range(62, 69)),
    ),
    refuses=Refusals(
        axes=frozenset("ABC"),
        tool=255,  # MAX_TOOL_NUMBER
        lengths=frozenset({490}),
        bare_dwell=True,
        bare_inverse=True,
        bare_table=True,
        bare_centre=True,
        end_beside=True,
        still_words=True,
        length_axis="Z",
    ),
    letters="FSTXYZABCDEHIJKLPQR",
    uses={
        "I": code_names("G2", "G3"),
        "J": code_names("G2", "G3"),
        "K": code_names("G2", "G3"),
        "D": code_names("G41", "G41.1", "G42", "G42.1"),
        "E": code_names("M66", "M67", "M68"),
        "H": code_names("G43", "G43.2"),
        "L": code_names("G10", "M66"),
        "P": code_names("G4", "G10", "G64", "G51", *(f"M{n}" for n in range(50, 69))),
        "Q": code_names("G64", "M66", "M67", "M68"),
        "R": code_names("G2", "G3"),
    },
    strict=True,
    paths={610: 64},
    arcs_refused=True,
    feed_needed=True,
    limits=limits.GRBL,
    dark_rapids=True,
    beam_codes=frozenset({4}),
    incremental_set=True,
    # grblHAL (gcode.c): all axes that $376 does not name.
    inches_turn=True,
    redrawn=frozenset({382, 383, 384, 385}),
    harmless=frozenset({0, 40, 170, 180, 190, 200, 210, 400, 610, 900, 910, 911, 930, 940}),
    # gcode.c, step 4 of gc_execute_line: spindle, coolant, overrides, motion, then program flow.
    before_m=frozenset({3, 4, 5, 7, 8, 9}),
    after_m=frozenset({0, 1, 2, 30}),
    # LINE_BUFFER_SIZE 80 with its end (protocol.c); nuts_bolts.c, MAX_INT_DIGITS 8.
    writing=Writing((b"(", b")"), b"G4 P0", line_limit=79, digits=8),
)
