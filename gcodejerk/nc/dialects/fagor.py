"""Fagor 8055, 8060, 8065, 8070, mills: read only, and in part.

Source: the list of commands of the CNC 8065 manual (easymanua.ls, fagor cnc-8065, p. 45): ``/``
skips a block, ``#`` and ``$`` begin instructions, ``%`` a program, ``;`` a comment, ``XvalueI`` is
an increment. The rest is general knowledge, and what of it a program needs to be followed between
its tool changes, no more; behind every other code nothing is rewritten (`Dialect.unknown_lasts`).

- ``( )`` is a comment of the 8065 and a statement of the 8055, ``(IF P1 EQ 5 GOTO N10)``: a line
  that holds one is not understood.
- G70 and G71 are inch and mm, G5, G7 and G50 how corners are passed. G53 ends the zero offset for
  good, G58 and G59 are different among the models (not here), as G10 to G14 (mirrors), G20, G72
  (scaling), G73 (rotation), G74 (home) and G93 are not.
- R and Q are polar coordinates, ``G0 R50 Q30`` (8055-M p. 48, 8070 p. 68); R of an arc that names
  axes is its radius.
- A tool's length lies across the plane in force, so that another plane renames every place.
- T and D change the tool's offset.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect, Drilling, Effect, grouped
from gcodejerk.nc.dialects.spelling import Text

CYCLES = frozenset(range(810, 900, 10))
_EFFECTS: dict[int, Effect] = {
    **dict.fromkeys((530, 540, 550, 560, 570, 920), "frames"),
    **dict.fromkeys((430, 440), "length"),
}

FAGOR = Dialect(
    name="fagor",
    title="Fagor 8055, 8065, 8070 mills (in part, unverified)",
    sources=("Fagor CNC 8065 manual p. 45", "general knowledge, not looked up"),
    text=Text(
        parentheses="code",
        semicolon="comment",
        delete="numbered",
        o_word="error",
        percent="named",
        names=True,
        variables="none",
        blanks="between",
        line_limit=160,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "feed mode": (940, 950),
            "units": (700, 710),
            "compensation": (400, 410, 420),
            "tool length": (430, 440),
            "retract": (980, 990),
            "path": (50, 70, 500),
            "cycle": (800, *sorted(CYCLES)),
            "harmless dwell": (40,),
            "non-modal": (530, 540, 550, 560, 570, 920),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "tool": (6,),
            "spindle": (3, 4, 5, 19),
            "coolant": (7, 8, 9),
        }
    ),
    defaults={"compensation": 400},
    polar="QR",
    effects=_EFFECTS,
    units={700: True, 710: False},
    feed_modes={940: 94, 950: 95},
    paths={50: 64, 70: 61, 500: 64},
    tool_frame=frozenset("TD"),
    length_turns=True,
    macro_change=True,
    unknown_lasts=True,
    drilling=Drilling(CYCLES, CYCLES, own_group=True, repeats="", missing="unknown"),
    harmless=frozenset({0, 50, 70, 170, 180, 190, 400, 500, 700, 710, 800, 900, 910, 940, 950}),
    before_m=frozenset(),
    note="the codes of Fagor were not verified: what is known of them is read, unverified, and "
    "nothing is rewritten behind a code that is not among that; streams go to a CSV table",
)
