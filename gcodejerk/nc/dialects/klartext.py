"""Heidenhain Klartext (files ``.H``), whose lines are statements: ``12 L X+10 Z+100 R0 FMAX M3``.

This table has statements by name, each with what it does; the grammar of a line stands in
`gcodejerk.nc.text.klartext`, and a second time in the second reading. ``L`` is G1, with FMAX it is
G0 (in its own block alone; the F before stays in force), R0, RL and RR are G40, G41 and G42, an I
in front of an axis makes its word an increment, MM and INCH of BEGIN PGM are G71 and G70.

Sources: the programs and the grammar of drunsinn/language-klartext (testprogramme; grammars/
klartext.cson), which has the statements and how numbers, Q parameters and ``~`` are written; the
sample of NC-PB/gEdit; iTNC 530 manual, conversational, p. 491 (numbers with a comma), p. 814 (FMAX
goes straight, indirectly); iTNC 530 ISO manual p. 183 (selecting a program, and calling one, cancel
radius compensation); TNC 407 manual p. 5-68 (a block with R0 FMAX and an M function); TNC 155
manual, list of M functions (M3, M4, M8, M13 and M14 act at the beginning of their block, M0, M2,
M5, M9 and M30 at its end; M99 calls a cycle); TNC 306 technical manual p. 4-99 (M89). What cycles
are mere definitions is general knowledge: nothing but the modes is known behind one that moves.

- CALL LBL, its REP and jumps are followed (`gcodejerk.nc.flow.labels`). In a file in which they
  cannot be, LBL may be come to from elsewhere, so nothing is known behind it, and nothing is
  rewritten behind CALL LBL.
- Behind CALL PGM, PLANE, FUNCTION, TRANS, cycles that turn, mirror or scale, and every M function
  that is not here (M128; M89, which calls a cycle behind every move from there on), nothing is
  rewritten (`unknown_lasts`).
- ``L M140 MB MAX`` retreats along the tool's axis: no place is known behind it. That it lasts for
  its block alone is general knowledge; programs in public (of posts that write it at every tool
  change) cut behind it without another word. With words of axes beside it, it bars what follows, as
  an M function that is not here.
- A TOOL CALL changes the frame, and may move. M91 and M92 make the words of their block machine
  coordinates.
- It is read only: streams go to a CSV table.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect, Effect, grouped
from gcodejerk.nc.dialects.heidenhain_iso import Q_PARAMETERS
from gcodejerk.nc.dialects.spelling import Text

_DEFINITIONS = (
    *(1, 2, 3, 4, 5, 6, 9, 13, 14, 15, 16, 17, 18, 20, 21, 22, 23, 24, 25, 27, 32),
    *(*range(200, 216), 240, 241, *range(251, 258)),
)
"""Numbers of cycles that do nothing until they are called; 9 is a dwell, 13 turns the spindle, 32
is a tolerance."""
_DATUMS = (7, 247)
NAMES: dict[str, Effect] = {
    **dict.fromkeys(("BLK FORM", "TOOL DEF", "CC", "Q", "BEGIN PGM"), "none"),
    **dict.fromkeys((f"FN {n}" for n in (0, 1, 2, 3, 4, 5, 6, 7, 8, 13, 18)), "none"),
    **dict.fromkeys((f"CYCL DEF {n}" for n in _DEFINITIONS), "none"),
    **dict.fromkeys((f"CYCL DEF {n}" for n in _DATUMS), "frames"),
    **dict.fromkeys(("C", "CP", "CR", "CT", "CTP", "LP"), "home"),
    # F of a corner is its own, and which one is in force behind a cycle was not looked up
    **dict.fromkeys(("TOOL CALL", "CYCL CALL", "M140", "RND", "CHF"), "cycle"),
    "M91": "machine",
    # approaches and free contours begin and end cutter compensation by themselves
    **dict.fromkeys(("LBL", "APPR", "DEP", "FL", "FLT", "FC", "FCT", "FPOL"), "label"),
    **dict.fromkeys((f"FN {n}" for n in (9, 10, 11, 12)), "label"),
}
KLARTEXT = Dialect(
    name="klartext",
    title="Heidenhain Klartext",
    sources=(
        "drunsinn/language-klartext: grammars/klartext.cson, testprogramme",
        "github.com/NC-PB/gEdit: h01-3tools.h",
        "iTNC 530 conversational pp. 491, 814; TNC 407 p. 5-68; TNC 155, list of M functions",
    ),
    text=Text(
        klartext=True,
        parentheses="code",
        semicolon="comment",
        delete="first",
        o_word="error",
        percent="error",
        variables="Q",
        blanks="between",
    ),
    groups=grouped(
        {
            "motion": (0, 10),
            "distance": (900,),
            "compensation": (400, 410, 420),
            "units": (700, 710),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "tool": (6,),
            "spindle": (3, 4, 5, 13, 14),
            "coolant": (7, 8, 9),
        }
    ),
    # An I in front of the axis says that a word is an increment; no code does.
    defaults={"distance": 900, "feed mode": 940, "compensation": 400, "path": 640},
    names=NAMES,
    arithmetic=Q_PARAMETERS,
    letters="FSTXYZABCUVW",
    units={700: True, 710: False},
    feed_modes={},
    paths={640: 64},
    modal_motion=False,
    tool_frame=frozenset("T"),
    macro_change=True,
    unknown_lasts=True,
    harmless=frozenset({0, 400}),
    before_m=frozenset({3, 4, 8, 13, 14}),
    after_m=frozenset({0, 1, 2, 30, 5, 9}),
)
