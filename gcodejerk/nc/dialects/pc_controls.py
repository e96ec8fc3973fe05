"""Controls on a PC whose languages descend from NIST RS274/NGC, and were not verified one by one.

UCCNC, EdingCNC, PlanetCNC and MASSO are read as what they share with LinuxCNC, grbl and Mach (the
table `rs274`), and no more, and every program that is read so says so. In detail:

- What is here is plain motion, planes, units, G90 and G91, G40, work systems, and what turns or
  scales, so that it is seen. Every other code forbids to rewrite what stands behind it
  (`Dialect.unknown_lasts`); `program.harmless` declares those that the owner knows.
- Drilling cycles move somewhere; G28, G30, G53, G52, G92 and G10 leave no position known.
- A word with a name (``gosub``, ``if``, ``while`` of EdingCNC and PlanetCNC) may do anything, and
  so may a comment that begins with a word and a comma, which PlanetCNC runs: ``(expr,...)``.

Sources: the posts for UCCNC of FreeCAD and of pacmansydney/uccnc-fusion-post (44182/uccnc.cps: G61
and G64, G43 H, M6, ``G53 G0``, M10 Q for a beam), for MASSO of the same (44182/masso.cps: cycles
G73, G81 to G83 with G98, M98 P, dwells in G4 P); macros of EdingCNC (GameOEver/EdingCNC_Macro:
macro.cnc, whose flow has words without O) and of PlanetCNC (styletronix/planetcnc-expression). What
their manuals say was not at hand: that lines with a number alone are real units and that G0 of
several axes is one move is general knowledge, and for MASSO not even that.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects.dialect import Dialect, Drilling, Effect, grouped
from gcodejerk.nc.dialects.grbl import SYSTEMS
from gcodejerk.nc.dialects.rs274 import RS274
from gcodejerk.nc.dialects.spelling import Text

CYCLES = frozenset({730, *range(810, 900, 10)})
EFFECTS: dict[int, Effect] = {
    **dict.fromkeys((280, 300), "home"),
    **dict.fromkeys(SYSTEMS, "system"),
    **dict.fromkeys((430, 490), "length"),
    **dict.fromkeys((70, 80), "either"),
    100: "data",
    **dict.fromkeys((520, 530, 920, 921), "frames"),
}
"""Codes of which it is known what they change, and not where they lead."""


def _read_in_part(name: str, title: str, *sources: str, apart: str = "") -> Dialect:
    """A control of which only what its relatives share is taken as known."""
    own = f"the codes of {title} were not verified"
    return replace(
        RS274,
        name=name,
        title=f"{title} (as rs274, unverified)",
        sources=(*sources, *RS274.sources),
        text=Text(
            parentheses="comment",
            semicolon="comment",
            live_comments=True,
            delete="first",
            o_word="error",
            percent="named",
            names=True,
            variables="none",
            blanks="between",
            line_limit=RS274.text.line_limit,
        ),
        groups=grouped(
            {
                "motion": (0, 10, 20, 30, 800, *sorted(CYCLES)),
                "plane": (170, 180, 190),
                "distance": (900, 910),
                "arc distance": (911,),
                "feed mode": (940,),
                "units": (200, 210),
                "compensation": (400, 410, 420),
                "tool length": (430, 490),
                "system": SYSTEMS,
                "path": (610, 611, 640),
                "retract": (980, 990),
                "scaling": (500, 510),
                "rotation": (680, 690),
                "polar": (150, 160),
                "diameter": (70, 80),
                # beside axis words a dwell may take them for itself
                "harmless dwell": (40,),
                "non-modal": (100, 280, 300, 520, 530, 920, 921),
            }
        ),
        uses={},
        defaults={"plane": 170, "feed mode": 940, "compensation": 400, "system": 540},
        effects=EFFECTS,
        feed_modes={940: 94},
        drilling=Drilling(CYCLES, CYCLES, missing="unknown"),
        redrawn=frozenset({800}),
        strict=False,
        refused=frozenset(),
        arcs_refused=False,
        feed_needed=False,  # they run their files themselves, and stop
        macro_change=True,
        unknown_lasts=True,
        apart=frozenset(apart),
        harmless=RS274.harmless - {930},
        before_m=frozenset(),
        note=f"{own}: it is read as what LinuxCNC, grbl and Mach read alike, unverified, and "
        "nothing is rewritten behind a code that is not among that",
    )


UCCNC = _read_in_part(
    "uccnc",
    "UCCNC",
    "FreeCAD's post uccnc",
    "pacmansydney/uccnc-fusion-post: 44182/uccnc.cps",
)
EDINGCNC = _read_in_part("edingcnc", "EdingCNC", "GameOEver/EdingCNC_Macro: macro.cnc")
PLANETCNC = _read_in_part("planetcnc", "PlanetCNC", "styletronix/planetcnc-expression")
MASSO = _read_in_part(
    "masso", "MASSO", "pacmansydney/uccnc-fusion-post: 44182/masso.cps", apart="Z"
)
