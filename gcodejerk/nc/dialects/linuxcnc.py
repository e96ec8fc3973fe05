"""LinuxCNC 2.9.

Sources: its manual ("G-code overview" with the modal groups and the order of execution, "G-codes",
"O-codes"); each entry that matters here was checked against its stand-alone interpreter
(tests/clients). NIST RS274/NGC is the origin of the language.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import PLANES, Dialect, Drilling, code_names, grouped
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590, 591, 592, 593)
CYCLES = frozenset({730, 740, 760, *range(810, 900, 10)})
CYCLE_NAMES = code_names(*(f"G{code // 10}" for code in CYCLES))
_FUNCTIONS = "ABS ACOS ASIN ATAN COS EXP FIX FUP LN ROUND SIN SQRT TAN"
FUNCTIONS = frozenset(_FUNCTIONS.split())

LINUXCNC = Dialect(
    name="linuxcnc",
    title="LinuxCNC 2.9",
    sources=("LinuxCNC manual: G-code overview, G-codes, O-codes", "rs274, its interpreter"),
    text=Text(
        parentheses="comment",
        semicolon="comment",
        python=True,
        delete="first",
        o_word="flow",
        percent="lone",
        variables="#",
        blanks="anywhere",
        returns=True,
        line_limit=254,
    ),
    groups=grouped(
        {
            "motion": (
                *(0, 10, 20, 30, 50, 51, 52, 53, 330, 331, 382, 383, 384, 385, 800),
                *sorted(CYCLES),
            ),
            "plane": tuple(PLANES),
            "distance": (900, 910),
            "arc distance": (901, 911),
            "feed mode": (930, 940, 950),
            "units": (200, 210),
            "compensation": (400, 410, 411, 420, 421),
            "tool length": (430, 431, 432, 490),
            "retract": (980, 990),
            "system": SYSTEMS,
            "path": (610, 611, 640),
            "spindle mode": (960, 970),
            "diameter": (70, 80),
            "non-modal": (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30, 60, 98, 99),
            "tool": (6, 61),
            "spindle": (3, 4, 5, 19),
            "coolant": (7, 8, 9),
            "override": (48, 49, 50, 51, 52, 53),
            "output": (62, 63, 64, 65, 66, 67, 68),
            "state": (70, 71, 72, 73),
            "user": tuple(range(100, 200)),
        }
    ),
    # What M2 leaves behind and the interpreter starts with. Path mode, feed and units are a matter
    # of the configuration, and nothing resets G98/G99 (mmount.ngc starts in G99): not here.
    defaults={
        "motion": 10,
        "plane": 170,
        "distance": 900,
        "arc distance": 911,
        "feed mode": 940,
        "compensation": 400,
        "system": 540,
    },
    bare_return=True,
    effects={
        **dict.fromkeys((280, 300), "return"),
        **dict.fromkeys((281, 301), "store"),
        **dict.fromkeys(SYSTEMS, "system"),
        **dict.fromkeys((430, 431, 432, 490), "length"),
        100: "table",
        520: "local",
        530: "machine",
        920: "set",
        **dict.fromkeys((921, 922), "clear"),
        923: "restore",
        70: "diameter",
        80: "radius",
    },
    letters="FSTXYZABCUVWDEHIJKLPQR$",  # $0: a spindle
    uses={
        "$": code_names(
            *("M3", "M4", "M5", "M19", "M51", "G33", "G33.1", "G76", "G95", "G96", "G97"),
        ),
        "D": code_names("G41", "G41.1", "G42", "G42.1", "G96"),
        "E": code_names("M66", "M67", "M68", "G76"),
        "H": code_names("G43", "G43.2", "G76"),
        "I": code_names("G2", "G3", "G5", "G5.1", "G10", "G33.1", "G43.1", "G76", "G87"),
        "J": code_names("G2", "G3", "G5", "G5.1", "G10", "G43.1", "G76", "G87"),
        "K": code_names("G2", "G3", "G33", "G33.1", "G43.1", "G76", "G87"),
        "L": CYCLE_NAMES | code_names("G10", "G5.2", "M66", "M98", "G76"),
        "P": code_names(
            *("G2", "G3", "G4", "G5", "G5.2", "G10", "G64", "G74", "G76", "G82", "G84"),
            *("G86", "G88", "G89", "M19", "M50", "M51", "M52", "M53", "M98"),
            *(f"M{n}" for n in range(62, 69)),
            *(f"M{n}" for n in range(100, 200)),
        ),
        "Q": code_names(
            *("G5", "G10", "G64", "G73", "G76", "G83", "M19", "M61", "M66", "M67", "M68"),
            *(f"M{n}" for n in range(100, 200)),
        ),
        "R": CYCLE_NAMES | code_names("G2", "G3", "G10", "G76", "M19"),
    },
    strict=True,
    centres_of_plane=True,
    feed_of_mixed=True,
    paths={610: 61, 611: 62, 640: 64},
    diameter_codes=True,
    lathe="either",
    same_after_stop=True,
    m_bars={52: "feed override"},  # adaptive feed acts on G1, not on G0
    feed_before_units=True,
    incremental_set=True,
    redrawn=frozenset({331, 382, 383, 384, 385, 52, 53}),
    # G88 leaves the tool at the bottom, for the operator to retract; G74 and G84 go to swapped
    # coordinates in G18 and G19 (2.9; tests/clients/test_interpreter_cycles.py).
    drilling=Drilling(
        CYCLES,
        frozenset({760, 880}),
        only_in_xy=frozenset({740, 840}),
        own_group=False,
        repeats="L",
        missing="error",
    ),
    # "Expressions" and "Binary operators" of the manual; measured where it is silent: AND and OR
    # bind alike, MOD is never negative, EQ and NE allow 0.0001.
    arithmetic=Arithmetic(
        levels=(
            ("**",),
            ("*", "/", "MOD"),
            ("+", "-"),
            ("EQ", "NE", "GT", "GE", "LT", "LE"),
            ("AND", "OR", "XOR"),
        ),
        functions=FUNCTIONS | {"EXISTS"},
        floor=True,
        angles=True,
        together=True,
        exact=True,
        local=30,
        system=5000,
        offsets=5161,
        at_selection=True,
        feed=frozenset({"<_feed>"}),
        own_line="#<_line>",
    ),
    harmless=frozenset(
        {0, 40, 70, 80, 170, 171, 180, 181, 190, 191, 200, 210, 400, 610, 611, 640}
        | {900, 910, 901, 911, 930, 940, 950, 960, 970, 980, 990}
    ),
    # "Order of execution" of the manual: spindle, coolant and overrides, then motion, then stops.
    before_m=frozenset({3, 4, 5, 7, 8, 9, 48, 49, 50, 51, 52, 53}),
    after_m=frozenset({0, 1, 2, 30, 60}),
    # Numbers are doubles all the way to the motion (emcmotion's EmcPose).
    writing=Writing((b"(", b")"), b"G4 P0", doubles=True),
)
