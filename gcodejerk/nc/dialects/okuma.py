"""Okuma OSP, mills: read only, and in part.

No manual was at hand (that of the OSP-P200M is 5228-E); posts that write ``G15 H1`` for a work
system are the only source that was seen. The rest is general knowledge, and what of it a program
needs to be followed between its tool changes, no more; behind every other code nothing is rewritten
(`Dialect.unknown_lasts`). What is different from Fanuc, and why such a program must not be read so:

- G15 H and G16 H select a work system; G54 to G59 are tool lengths along X, Y, Z and others, G53
  cancels them. All of them leave no position known.
- G10 and G11 shift and turn the frame, G62 mirrors it: they are not here.
- M52, M53 and M54 say how far drilling cycles go back. ``G4 F2`` is a dwell. Variables and jumps
  have names (``VC1=5``, ``CALL O100``, ``IF [..] NLAB``).
- Whether ``X100`` is 100 mm, a parameter decides; G20 and G21 are inch and mm on mills (on lathes
  they are moves to the home position).
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect, Drilling, Effect, grouped
from gcodejerk.nc.dialects.spelling import Text

CYCLES = frozenset({730, 740, 760, 810, 820, 830, 840, 850, 860, 870, 890})
_EFFECTS: dict[int, Effect] = {
    40: "words",
    300: "home",
    **dict.fromkeys((150, 160, 530, 540, 550, 560, 570, 580, 590, 920), "frames"),
}

OKUMA = Dialect(
    name="okuma",
    title="Okuma OSP mills (in part, unverified)",
    sources=("posts that write G15 H1", "general knowledge, not looked up"),
    text=Text(
        parentheses="comment",
        semicolon="error",
        delete="numbered",
        o_word="program",
        percent="lone",
        leader=True,  # $PART.MIN% in front of a program
        names=True,
        variables="none",
        blanks="between",
        line_limit=158,
    ),
    groups=grouped(
        {
            "motion": (0, 10, 20, 30),
            "plane": (170, 180, 190),
            "distance": (900, 910),
            "feed mode": (940, 950),
            "units": (200, 210),
            "compensation": (400, 410, 420),
            "path": (610, 640),
            "cycle": (800, *sorted(CYCLES)),
            "non-modal": tuple(_EFFECTS),
        }
    ),
    m_groups=grouped(
        {
            "stop": (0, 1, 2, 30),
            "tool": (6,),
            "spindle": (3, 4, 5, 19),
            "coolant": (7, 8, 9),
            "level": (52, 53, 54),
        }
    ),
    defaults={"compensation": 400},
    effects=_EFFECTS,
    feed_modes={940: 94, 950: 95},
    whole_numbers="machine",
    tool_frame=frozenset("TH"),
    macro_change=True,
    unknown_lasts=True,
    drilling=Drilling(CYCLES, CYCLES, own_group=True, repeats="", missing="unknown"),
    harmless=frozenset({0, 170, 180, 190, 200, 210, 400, 610, 640, 800, 900, 910, 940, 950}),
    before_m=frozenset(),
    note="the codes of Okuma's OSP were not verified: what is known of them is read, unverified, "
    "and nothing is rewritten behind a code that is not among that; streams go to a CSV table",
)
