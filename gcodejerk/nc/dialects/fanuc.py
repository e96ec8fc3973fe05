"""Fanuc 0i, 16i, 30i: mills, and lathes with the G-code systems A and B.

Sources: the modal groups of the 30i list at cncschool.pl; B-63944EN/02 p. 48 (path of G0); the
sample programs of NC-PB/gEdit (comments that do not close, ``N120/G0``). What a parameter decides
is unknown until the machine file says it: whether ``X100`` is 100 mm (3401), the modes after
power-on that 3402 chooses (G0 or G1, plane, G90 or G91, G94 or G95), the path of G0 (1401,
`positioning`), and whether G43 alone moves (5006#6).
Parameters by number without a page, the order of M codes and the check of the position behind G0
are general knowledge that was not looked up: they are used to leave rapids alone, and to stop.
What stands between the first % and the end of its line is skipped (B-63524EN/01 p. 649; leader
section, B-64014EN/03 p. 21).
G20 and G21 must not be switched during a program (B-63944EN/02 p. 192): what becomes of offsets is
not known. G53, G28 and G30 cancel the vector of a tool length (B-63844EN/02 p. 204). The axis words
beside G51.1 and G50.1 are those that are mirrored and no longer mirrored (ISO dialect of Siemens,
3-65). Whether cycles drill along Z in G18 and G19, too (5101#0), whether G60 is modal (5431#0) and
which codes of the list of the 30i turn or shift for good, is general knowledge, used to leave
rapids alone. So is that M21 to M23 mirror the axes of older controls, and that C, or on a
lathe any rotary axis, is what M3 turns.
G5.1 Q2 X0 Y0 Z0 makes curves of short lines of the axes that it names, until Q0 (15i-MA manual,
4.16); that Q3 is nano smoothing, a curve too, is general knowledge that was not looked up. Nor was
it that G5 may run stored moves, used to leave rapids alone.
G63, tapping mode, takes feed override and feed hold away until G61, G62 or G64 (0i, B-64154EN/01 p.
53 has the group; what G63 does: cnc.wiki, "G62 and G63", and general knowledge); #3004 does until
it is 0 (zappettiniconsulting.com, "Feed hold").
A thread (G32, G33) ends at its words and stays there: Haas lathes, G32 ("no automatic position
return is performed at the end"); ADT-CNC4620 programming manual p. 27 (X, Z: end of the thread).
Of threads of changing lead (G34) no page was found.
A machine builder adds M codes of his own, which may be macros that move. FreeCAD's post writes the
name of the file as the first line.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import (
    COMPENSATION,
    LEFT_OVER,
    OVERRIDES,
    Dialect,
    Drilling,
    Effect,
    grouped,
)
from gcodejerk.nc.dialects.spelling import Text, Writing

CYCLES = frozenset({730, 740, 760, 810, 820, 830, 840, 850, 860, 870, 880, 890})
SYSTEMS = (540, 550, 560, 570, 580, 590)
_FUNCTIONS = "ABS ACOS ASIN ATAN COS EXP FIX FUP LN ROUND SIN SQRT TAN"
_JUMPS = ("GOTO", "IF", "THEN", "WHILE", "DO", "END", "SETVN", "POPEN", "PCLOS", "DPRNT", "BPRNT")

_TOOL_CENTRE = (431, 433, 434, 435)
"""Tool lengths along an axis that turns, until G49."""
_TURNS = (683, 684)
"""Tilted planes, besides G68.2, until G69."""
_SPACE = (412, 413, 414, 415, 416, 422, 424, 425, 426)
"""Cutter compensation in space, until G40."""
_LASTING = (
    *(70, 411, 421, 542, 543, 544),
    *(106, 124, 437, 438, 439, 512, 514, 515, 516, 811, 814, 815, 1610),
)
"""An axis that does not move, one that turns with the path, offsets that follow rotary axes; axes
that turn, follow or swing with others (G51.2 to G51.6, G81.1, G81.4), and other lengths (G43.7)."""

_EFFECTS: dict[int, Effect] = {
    40: "words",  # G4 X1.5 is a dwell of 1.5 s
    **dict.fromkeys((270, 280, 300), "return"),
    290: "home",
    310: "home",  # skip: ends where a probe answers
    600: "cycle",  # single-direction positioning overshoots, and may be modal (5431#0)
    **dict.fromkeys(SYSTEMS, "system"),
    541: "numbered system",
    **dict.fromkeys((430, 440, 490), "length"),
    **dict.fromkeys((*_TOOL_CENTRE, *_TURNS, *_SPACE, *_LASTING), "frames"),
    **dict.fromkeys((501, 511), "words"),  # which axes are mirrored
    **dict.fromkeys((721, 722), "flow"),  # copies of a subprogram, turned or shifted
    100: "data",
    520: "frames",
    530: "machine",
    920: "set",
    921: "frames",
    220: "words",  # limits of travel
    **dict.fromkeys((51, 80), "words"),  # G5.1 Q2 X0 Y0 Z0: the axes that are smoothed
    50: "home",  # P10001 runs what is stored
    650: "flow",
    **dict.fromkeys((660, 661), "modal cycle"),
}

FANUC = Dialect(
    name="fanuc",
    title="Fanuc 0i, 16i, 30i mills",
    sources=(
        "30i G-code list, cncschool.pl",
        "B-63944EN/02 p. 48",
        "B-63524EN/01 p. 649",
        "B-64014EN/03 p. 21",
        "sample programs, github.com/NC-PB/gEdit",
    ),
    text=Text(
        parentheses="open comment",
        semicolon="end",
        delete="numbered",
        o_word="program",
        leader=True,
        percent="leader",
        variables="#",
        open_expressions=True,
        keywords=_JUMPS,
        blanks="between",
        line_limit=512,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 330),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "feed mode": (930, 940, 950),
            "units": (200, 210),
            "compensation": (400, 410, 420, *_SPACE),
            "tool length": (430, 440, 490, *_TOOL_CENTRE),
            "cycle": (800, *sorted(CYCLES)),
            "retract": (980, 990),
            "system": (*SYSTEMS, 541),
            "path": (610, 620, 630, 640),
            "spindle mode": (960, 970),
            "stroke limit": (220, 230),
            "scaling": (500, 510),
            "mirror": (501, 511),
            "rotation": (680, 682, *_TURNS, 690),
            "polar": (150, 160),
            "polar interpolation": (121, 131),
            "cylinder": (71,),
            "lasting": _LASTING,
            "look-ahead": (51, 80),
            "modal macro": (660, 661, 670),
            "diameter switch": (109,),
            "non-modal": (
                *(721, 722),
                *(40, 50, 90, 100, 110, 270, 280, 290, 300, 310, 520, 530, 600, 650),
                *(920, 921),
            ),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30, 98, 99, 198),
            "interrupt": (96, 97),
            "tool": (6,),
            "spindle": (3, 4, 5, 19, 29),
            "coolant": (7, 8, 9),
        }
    ),
    # Marked as the state after power-on in the list of G codes; what 3402 chooses is not here.
    defaults={
        "compensation": 400,
        "system": 540,
        "path": 640,
    },
    effects=_EFFECTS,
    letters="FSTXYZABCUVWDEHIJKLPQR",
    paths={610: 61, 640: 64},
    # 5001 chooses between Z, the axis across the plane, and the axis that the block names.
    length_axes="Z",
    length_moves=True,  # 5006#6
    length_word="H",
    tool_word_moves=True,  # 6001#5: T calls O9000
    spindle_turns="C",  # Cs contour control
    m_bars=dict.fromkeys((21, 22, 23), "mirror by M code"),
    p_selects=frozenset(SYSTEMS),
    transforms={
        **dict.fromkeys((680, 682, *_TURNS), ("rotation", True)),
        690: ("rotation", False),
        **dict.fromkeys(_SPACE, (COMPENSATION, True)),
        400: (COMPENSATION, False),
        **dict.fromkeys(_LASTING, ("a frame for good", True)),
        **{510: ("scaling", True), 500: ("scaling", False)},
        **{511: ("mirror", True), 501: ("mirror", False)},
        **{160: ("polar", True), 150: ("polar", False)},
        **{121: ("polar interpolation", True), 131: ("polar interpolation", False)},
        71: ("cylinder", True),
        109: ("diameter switch", True),
        **dict.fromkeys(_TOOL_CENTRE, ("tool centre point", True)),
        490: ("tool centre point", False),
        670: ("modal macro", False),
    },
    units_once=True,
    bars={
        **{400: (LEFT_OVER, True), 51: ("compressor", "Q"), 630: (OVERRIDES, True)},
        **dict.fromkeys((610, 620, 640), (OVERRIDES, False)),
    },
    tool_cancelled_by_return="named",
    whole_numbers="machine",
    packed_repeats=True,
    other_m="positions",
    drilling=Drilling(
        CYCLES,
        frozenset({760, 870, 880}),
        only_in_xy=CYCLES,  # 5101#0
        own_group=True,
        repeats="KL",
        missing="unknown",
    ),
    # Custom macro B: AND binds like *, OR and XOR like +. Local #1 to #33, common #100 to #999.
    # <Vacant> equals no number (M700V manual p. 314, as Fanuc's), EQ is for whole numbers there.
    arithmetic=Arithmetic(
        levels=(
            ("*", "/", "MOD", "AND"),
            ("+", "-", "OR", "XOR"),
            ("EQ", "NE", "GT", "GE", "LT", "LE"),
        ),
        compared="digits",
        chained=False,
        vacant=True,
        # "Argument specification I": A is #1, B #2, C #3, I #4, J #5, K #6, D #7 and so on.
        parameters="ABCIJKDEF H M   QRSTUVWXYZ",
        functions=frozenset(_FUNCTIONS.split()),
        bits=True,
        local=33,
        system=1000,
        offsets=1000,
        timers=frozenset({3000, 3001, 3002}),
        overrides="3004",
        # Modal data of the block in front (4001 to 4130), of the one that runs (4201 to 4330), of
        # the one that was interrupted (4401 to 4530): F is number 109 of each.
        feed=frozenset({"4109", "4309", "4509"}),
    ),
    harmless=frozenset(
        {0, 90, 170, 180, 190, 200, 210, 400, 610, 640, 900, 910, 930, 940, 950, 960, 970}
        | {980, 990, 800, 150, 500, 501, 690, 131, 670, 220, 230, 51, 80}
    ),
    # Whether M3, M5, M8 and the like run with the motion of their block or behind it, the builder
    # chooses; M0, M1, M2, M30 act when the block is done.
    before_m=frozenset(),
    after_m=frozenset({0, 1, 2, 30}),
    exact_stop=90,
    # Behind G0 the next block begins once the axes are in position, unless 1601 says otherwise.
    stops_after_rapid=True,
    # Eight digits of the least increment.
    writing=Writing((b"(", b")"), b"G4 P1", digits=8),
)

# A lathe: X is a diameter (`diameter: true` on the axis). T selects offsets, so it changes the
# frame. G71 to G73 run the blocks from N(P) to N(Q) by themselves. Behind them the axes stand where
# nobody knows: that they are back at the start say guides of other builders (ROBUR F1, p. 48, of
# G71; ADT-CNC4620, p. 48, of G73), of G70 no page was found. An A word is an angle of direct
# drawing there, from which the control computes the end: not a letter here.
_LATHE_CYCLES = (700, 710, 720, 730, 740, 750, 760)
_LATHE_EFFECTS: dict[int, Effect] = {
    40: "words",
    **dict.fromkeys((270, 280, 300), "return"),
    **dict.fromkeys((290, 310), "home"),
    **dict.fromkeys(SYSTEMS, "system"),
    100: "data",
    520: "frames",
    530: "machine",
    220: "words",
    650: "flow",
    660: "modal cycle",
    **dict.fromkeys(_LATHE_CYCLES, "cycle"),
    **dict.fromkeys((830, 840, 850, 870, 880, 890), "cycle"),
    **dict.fromkeys((680, 681), "transform"),
}
_LATHE_GROUPS = {
    "plane": (170, 180, 190),
    "units": (200, 210),
    "compensation": (400, 410, 420),
    "system": SYSTEMS,
    "spindle mode": (960, 970),
    "stroke limit": (220, 230),
    "path": (610, 620, 630, 640),
    "polar interpolation": (121, 131, 1120, 1130),
    "cylinder": (71,),
    "balance": (680, 681, 690),
    "modal macro": (660, 670),
    "speed check": (250, 260),
    "drilling": (800, 830, 840, 850, 870, 880, 890),
    "diameter switch": (109,),
}
_LATHE = replace(
    FANUC,
    effects=_LATHE_EFFECTS,
    letters="FSTXYZCDEHIJKLPQRUVW",
    transforms={
        **dict.fromkeys((121, 1120), ("polar interpolation", True)),
        **dict.fromkeys((131, 1130), ("polar interpolation", False)),
        71: ("cylinder", True),
        109: ("diameter switch", True),
        670: ("modal macro", False),
    },
    diameter_fixed=True,  # parameter 1006#3, which G10.9 alone changes
    tool_frame=frozenset("T"),
    contours=frozenset({710, 720, 730}),
    finishing=frozenset({700}),
    drilling=Drilling(),
    length_moves=False,
    spindle_turns="ABC",
    m_bars={},
    tool_word_moves=False,
    tool_cancelled_by_return="no",
    length_word="",
    lathe="yes",
)

FANUC_LATHE_A = replace(
    _LATHE,
    name="fanuc-lathe-a",
    title="Fanuc lathes, G-code system A",
    # U, V, W and H are increments; G90, G92 and G94 are turning cycles, G98 and G99 feed modes.
    groups=grouped(
        {
            **_LATHE_GROUPS,
            "motion": (0, 10, 20, 30, 320, 340, 900, 920, 940),
            "feed mode": (980, 990),
            "non-modal": (
                *(40, 100, 110, 270, 280, 290, 300, 310, 500, 520, 530, 650),
                *_LATHE_CYCLES,
            ),
        }
    ),
    effects={**_LATHE_EFFECTS, 500: "set"},
    defaults={
        "plane": 180,
        "distance": 900,
        "compensation": 400,
        "system": 540,
        "path": 640,
    },
    feed_modes={980: 94, 990: 95},
    increments={"U": "X", "V": "Y", "W": "Z", "H": "C"},
    redrawn=frozenset({340, 900, 920, 940}),
    harmless=frozenset(
        {0, 180, 200, 210, 400, 610, 640, 960, 970, 980, 990, 131, 1130, 670, 220, 230, 250, 260}
    ),
)

FANUC_LATHE_B = replace(
    _LATHE,
    name="fanuc-lathe-b",
    title="Fanuc lathes, G-code system B",
    groups=grouped(
        {
            **_LATHE_GROUPS,
            "motion": (0, 10, 20, 30, 330, 340, 770, 780, 790),
            "distance": (900, 910),
            "feed mode": (940, 950),
            "retract": (980, 990),
            "non-modal": (
                *(40, 100, 110, 270, 280, 290, 300, 310, 520, 530, 650, 920),
                *_LATHE_CYCLES,
            ),
        }
    ),
    effects={**_LATHE_EFFECTS, 920: "set"},
    defaults={"plane": 180, "compensation": 400, "system": 540, "path": 640},
    feed_modes={940: 94, 950: 95},
    letters="FSTXYZCDEHIJKLPQR",
    redrawn=frozenset({340, 770, 780, 790}),
    harmless=frozenset(
        {0, 180, 200, 210, 400, 610, 640, 900, 910, 940, 950, 960, 970, 980, 990}
        | {131, 1130, 670, 220, 230, 250, 260}
    ),
)
