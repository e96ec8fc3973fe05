"""Heidenhain iTNC 530, DIN/ISO (files ``.I``); Klartext is another language (dialect `klartext`).

Sources: iTNC 530 ISO manual p. 211, and p. 183 (selecting a program, and calling one, cancel radius
compensation). Much of the table is general knowledge that no source here confirmed; it is used to
leave rapids alone, not to rewrite them: cycles, datum shifts, polar moves and machine coordinates
make everything behind them unknown. In the program's head G71 means mm.

TNC 360 ISO manual, list of G and M functions (p. 2): G38 stops the program, G43 and G44 lengthen
and shorten a way along an axis; M91 and M92 make the words of their block machine coordinates, M99
calls a cycle, M89 calls it at every position from there on. What an M function does that is not
here may last as well (M128), and nothing is rewritten behind one (`unknown_lasts`). ``L1,2`` calls
a label; D09 to D12 jump to one. What a G91 behind axis words means for those was not looked up.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import CYCLE_CALL, MACHINE_WORDS, Dialect, grouped
from gcodejerk.nc.dialects.spelling import Text

_CYCLES = (
    *(740, 750, 760, 770, 780, 830, 840, 850, 860, 1200, 1210, 1220, 1230, 1240, 1250, 1270),
    *range(2000, 2200, 10),
    *(2300, 2310, 2320, 2400, 2500, 2510, 2520, 2530, 2560, 2570, 2620, 2640, 2650, 2670),
)
_FRAMES = (70, 280, 360, 530, 540, 720, 730, 800, 2470)

Q_PARAMETERS = Arithmetic(
    # iTNC 530 ISO p. 526: multiplication and division before addition and subtraction. The
    # comparisons are those of the jumps, and no formula of a program holds one.
    levels=(("*", "/"), ("+", "-"), ("==", "<>", ">", "<")),
    functions=frozenset(("SQRT", "SIN", "COS", "TAN", "ABS")),
    brackets="()",
    compared="digits",
    chained=False,
    q_parameters=True,
    feed=frozenset({"FN 18"}),  # SYSREAD Q1 = ID20 NR9
)
HEIDENHAIN_ISO = Dialect(
    name="heidenhain-iso",
    title="Heidenhain iTNC 530, DIN/ISO",
    sources=("iTNC 530 ISO manual p. 211", "TNC 360 ISO manual p. 2"),
    text=Text(
        parentheses="code",
        semicolon="comment",
        delete="first",
        o_word="error",
        percent="named",
        names=False,
        equals=True,
        variables="Q",
        blanks="between",
        end=b"*",
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30, 50, 60, 70, 100, 110, 120, 130, 150, 160),
            "plane": (170, 180, 190, 200),
            "distance": (900, 910),
            "units": (700, 710),
            "compensation": (400, 410, 420, 430, 440),
            "non-modal": (40, 90, 290, 300, 310, 380, 790, 980, 990, *_CYCLES),
            "frame": tuple(code for code in _FRAMES if code != 70),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "tool": (6,),
            "spindle": (3, 4, 5, 13, 14, 19),
            "coolant": (7, 8, 9),
            MACHINE_WORDS: (91, 92),
            CYCLE_CALL: (99,),
        }
    ),
    defaults={"feed mode": 940, "compensation": 400, "path": 640},
    names=dict.fromkeys(("D9", "D10", "D11", "D12"), "label"),
    arithmetic=Q_PARAMETERS,
    effects={
        **dict.fromkeys((40, 300, 310, 990), "words"),
        **dict.fromkeys(_CYCLES, "words"),
        790: "cycle",
        980: "label",
        **dict.fromkeys((90, 290), "none"),
        380: "home",  # somebody may move the axes meanwhile
        **dict.fromkeys((code for code in _FRAMES if code != 70), "transform"),
    },
    letters="FSTXYZABCUVWHIJKLPQR",
    calls="L",
    distance_first=True,
    transforms={
        **dict.fromkeys((430, 440), ("compensation along an axis", True)),
        400: ("compensation along an axis", False),
    },
    units={700: True, 710: False},
    feed_modes={},
    paths={640: 64},
    redrawn=frozenset({50, 60, 70, 100, 110, 120, 130, 150, 160}),
    tool_frame=frozenset("T"),
    length_turns=True,
    macro_change=True,
    unknown_lasts=True,
    harmless=frozenset({0, 170, 180, 190, 400, 900, 910}),
    # TNC 155 manual, list of M functions: M3, M4, M8, M13 and M14 act at the beginning of their
    # block, M0, M2, M5, M9 and M30 at its end.
    before_m=frozenset({3, 4, 8, 13, 14}),
    after_m=frozenset({0, 1, 2, 30, 5, 9}),
)
