"""Haas mills (NGC and before): Fanuc's language with Haas's own codes and exceptions.

Sources: Haas, "Help with the decimal points" (setting 162; ``X5`` is 0.0005 inch without it);
gcodes.net, G28 (without axes it moves all of them; it cancels the tool length); VF 96-8000 p. 182
(positions between holes are rapids). Whether G0 goes straight is a setting: `positioning`. G100 to
G103, G112, G113, G253 to G255, G268 and G269 are general knowledge that was not looked up; they are
used to leave rapids alone, as is M46 Q P, which jumps where a pallet is loaded. G141, compensation
in space, is of the group of G40 (NGC mill operator's manual).

Setting 33 (VF 96-8000 p. 146): under YASNAC a work system that is selected ends what G92 has
shifted, and G52 is a work system itself; under FANUC and HAAS neither.

M codes that move no axis, by the lists of M codes of the mill manuals 96-8000 and 96-8200: chip
conveyor (M31, M33), coolant spigot (M34, M35), gear (M41, M42; p. 215), air blast and air gun (M73,
M74, M83, M84), coolant through the spindle (M88, M89). Relays (M21 to M28, M51 to M66) may start
anything, M16 and M39 move: they are not here.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects.dialect import COMPENSATION, grouped
from gcodejerk.nc.dialects.fanuc import FANUC

_EXTRA_SYSTEMS = tuple(range(1100, 1300, 10))
_STANDING_M = (31, 33, 34, 35, 41, 42, 73, 74, 83, 84, 88, 89)
_PATTERNS = (120, 130, 470, 700, 710, 720, 1500)
"""Pockets, engraving, bolt circles: they move, and end where the manual of the version says."""

HAAS = replace(
    FANUC,
    name="haas",
    title="Haas mills",
    sources=(
        "Haas: Help with the decimal points",
        "gcodes.net: Haas G28",
        "Haas VF operator's manual 96-8000 pp. 182, 215",
    ),
    groups={
        **{code: group for code, group in FANUC.groups.items() if code not in (120, 130)},
        **grouped(
            {
                "non-modal patterns": _PATTERNS,
                "system": (*_EXTRA_SYSTEMS, 1540),
                "cylinder": (1070,),
                "probe": (310, 350, 360, 370, 1360),
                "smoothness": (1030, 1870),
                "mirror": (1000, 1010),
                "polar interpolation": (1120, 1130),
                "work offset": (2540, 2550),
                "feature": (2680, 2690),
                "compensation": (1410,),  # in space
                "tool length": (1430, 2340),
            }
        ),
    },
    effects={
        **FANUC.effects,
        **dict.fromkeys(_PATTERNS, "cycle"),
        **dict.fromkeys(_EXTRA_SYSTEMS, "system"),
        1540: "numbered system",
        310: "home",
        520: "frames",
        # Measuring: a tool's diameter or length, the work offset at an edge or a centre, written
        # where the control keeps them.
        **dict.fromkeys((350, 360, 370, 1360), "measure"),
        **dict.fromkeys((1410, 1430, 2340), "frames"),
        **dict.fromkeys((1000, 1010), "words"),  # which axes are mirrored
    },
    transforms={
        **FANUC.transforms,
        1070: ("cylinder", True),
        **{1010: ("mirror", True), 1000: ("mirror", False)},
        **{1120: ("polar interpolation", True), 1130: ("polar interpolation", False)},
        **{2540: ("dynamic work offset", True), 2550: ("dynamic work offset", False)},
        **{2680: ("feature", True), 2690: ("feature", False)},
        1410: (COMPENSATION, True),
        **dict.fromkeys((1430, 2340), ("tool centre point", True)),
    },
    m_groups={
        **FANUC.m_groups,
        **dict.fromkeys((46, 96, 97), "stop"),
        **dict.fromkeys(_STANDING_M, "auxiliary"),
    },
    # G103 P1 lets the control look only one block ahead, so that no stream is blended.
    bars={**FANUC.bars, 1030: ("look-ahead", "P")},
    # L repeats; K is the least depth of a peck (G73 and G83, 96-8000 pp. 185, 191).
    drilling=replace(FANUC.drilling, repeats="L"),
    packed_repeats=False,
    m_bars={},  # M21 to M28 are relays
    tool_word_moves=False,
    shift_may_end=True,
    tool_cancelled_by_return="all",
    bare_return=True,
    harmless=FANUC.harmless | {1030, 1870},
)
