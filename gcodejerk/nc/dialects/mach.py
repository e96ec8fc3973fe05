"""Mach3 and Mach4.

Sources: NIST RS274NGC (Smithy manual p. 7), from which the language comes; programs that the posts
of FreeCAD for Mach3/4 write (UCCNC and Centroid have tables of their own). Mach accepts more than
RS274/NGC does: G53 without axes, ``;`` comments. What its cycles, scalings and subprograms do in
detail was not verified, so nothing is taken as known behind them.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import Dialect, Drilling, grouped
from gcodejerk.nc.dialects.linuxcnc import FUNCTIONS
from gcodejerk.nc.dialects.spelling import Text, Writing

SYSTEMS = (540, 550, 560, 570, 580, 590)
CYCLES = frozenset({730, *range(810, 900, 10)})

MACH = Dialect(
    name="mach",
    title="Mach3, Mach4",
    sources=("NIST RS274NGC", "FreeCAD's post mach3_mach4"),
    text=Text(
        parentheses="open comment",
        semicolon="comment",
        slashes=True,
        delete="first",
        o_word="program",
        leader=True,
        percent="named",
        variables="#",
        blanks="anywhere",
        line_limit=256,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 310, 320, 330, 760, 800, *sorted(CYCLES)),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "arc distance": (901, 911),
            "feed mode": (930, 940, 950),
            "units": (200, 210),
            "compensation": (400, 410, 420),
            "tool length": (430, 490),
            "retract": (980, 990),
            "system": SYSTEMS,
            "path": (610, 640),
            "spindle mode": (960, 970),
            "scaling": (500, 510),
            "rotation": (680, 690),
            "polar": (150, 160),
            "pocket": (120, 130),
            "non-modal": (40, 100, 280, 281, 300, 520, 530, 920, 921, 922, 923),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30, 47, 98, 99),
            "tool": (6,),
            "spindle": (3, 4, 5),
            "coolant": (7, 8, 9),
            "override": (48, 49),
        }
    ),
    # Mach's start-up state is a configuration: G90 or G91, constant velocity or exact stop.
    defaults={"plane": 170, "feed mode": 940, "compensation": 400, "system": 540},
    effects={
        **dict.fromkeys((280, 300), "return"),
        281: "home",
        **dict.fromkeys(SYSTEMS, "system"),
        **dict.fromkeys((430, 490), "length"),
        100: "data",
        520: "frames",
        530: "machine",
        920: "set",
        **dict.fromkeys((921, 922, 923), "frames"),
        **dict.fromkeys((120, 130), "cycle"),
    },
    letters="FSTXYZABCUVWDEHIJKLPQR",
    length_axes="Z",
    length_word="H",
    p_selects=frozenset(SYSTEMS),
    dark_rapids=True,
    lathe="either",
    transforms={
        **{510: ("scaling", True), 500: ("scaling", False)},
        **{680: ("rotation", True), 690: ("rotation", False)},
        **{160: ("polar", True), 150: ("polar", False)},
    },
    redrawn=frozenset({310, 320, 330, 760}),
    other_m="positions",
    drilling=Drilling(
        CYCLES,
        frozenset({870, 880}),
        only_in_xy=CYCLES,
        own_group=False,
        repeats="L",
        missing="unknown",
    ),
    # NIST RS274/NGC, which has no comparisons.
    arithmetic=Arithmetic(
        levels=(("**",), ("*", "/", "MOD"), ("+", "-", "AND", "OR", "XOR")),
        functions=FUNCTIONS,
        floor=True,
        angles=True,
        together=True,
        system=1000,
        offsets=1000,
    ),
    harmless=frozenset(
        {0, 40, 170, 180, 190, 200, 210, 400, 610, 640, 900, 910, 901, 911, 930, 940, 950}
        | {980, 990, 500, 690, 150}
    ),
    # NIST RS274/NGC, table of the order of execution, which Mach's manual repeats.
    before_m=frozenset({3, 4, 5, 7, 8, 9, 48, 49}),
    after_m=frozenset({0, 1, 2, 30}),
    writing=Writing((b"(", b")"), b"G4 P0"),
)
