"""What LinuxCNC, grbl, Mach, Fanuc and Haas read alike: for programs that could be of any mill.

A program without a number, a comment or a code that tells its control is still read alike by all
of them where it says ``G0 X1.5`` in a mode that it states. This table holds what the tables `rs274`
and `iso-mill` have in common, and is no control's own. Where they differ, it has what is the more
cautious: X100 is 100 mm or 0.1 mm; T, M6 and a tool length may move the machine, G28 may cancel
that length; cycles leave the tool nowhere that is known, and G80 leaves no motion in force; behind
a code that one of them lacks nothing is rewritten.

Streams are spelled as the control that runs them has it (`written_for`): how a point ends in a
standstill is what these controls do not have in common.

`tests/unit/test_nc_common.py` draws programs of all five and holds this reading to each of theirs.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects import iso_mill, rs274
from gcodejerk.nc.dialects.dialect import Dialect, Drilling
from gcodejerk.nc.dialects.iso_mill import ISO_MILL
from gcodejerk.nc.dialects.pc_controls import EFFECTS
from gcodejerk.nc.dialects.rs274 import RS274
from gcodejerk.nc.dialects.spelling import Text

MEMBERS = (*rs274.MEMBERS, *iso_mill.MEMBERS)

_CYCLES = frozenset().union(*(member.drilling.codes for member in MEMBERS))
_BARS = {**ISO_MILL.bars, **RS274.bars}
_TRANSFORMS = {**ISO_MILL.transforms, **RS274.transforms}
_ALIKE = {
    code: group
    for code, group in RS274.groups.items()
    if ISO_MILL.groups.get(code) == group and code not in (*_BARS, *_TRANSFORMS)
}
_LASTING = {
    code: group
    for code, group in {**ISO_MILL.groups, **RS274.groups}.items()
    if code in _BARS or code in _TRANSFORMS
}
_GROUPS = {**_ALIKE, **_LASTING, **dict.fromkeys((800, *sorted(_CYCLES)), "motion")}
_EFFECTS = {**ISO_MILL.effects, **RS274.effects, **EFFECTS}

ANY_MILL = replace(
    RS274,
    name="any-mill",
    title="what LinuxCNC, grbl, Mach, Fanuc and Haas mills read alike",
    sources=tuple(dict.fromkeys((*RS274.sources, *ISO_MILL.sources))),
    text=Text(
        parentheses="comment",
        semicolon="end",
        delete="first",
        o_word="error",
        percent="lone",
        variables="none",
        blanks="between",
        line_limit=RS274.text.line_limit,
    ),
    groups=_GROUPS,
    m_groups={m: g for m, g in RS274.m_groups.items() if ISO_MILL.m_groups.get(m) == g},
    defaults={"compensation": 400, "system": 540},
    effects={code: effect for code, effect in _EFFECTS.items() if code in _GROUPS},
    transforms=_TRANSFORMS,
    bars=_BARS,
    drilling=Drilling(_CYCLES, _CYCLES, missing="unknown"),
    redrawn=frozenset({800}),
    # Siemens is no member, and a program of it may have nothing that says so: D is a length there,
    # which a plane turns, an increment behind another work system may travel more, M3 may turn C.
    tool_frame=frozenset({"D"}),
    length_turns=True,
    shifts_travel=True,
    spindle_turns="ABC",
    units_once=True,
    uses={},
    strict=False,
    whole_numbers="machine",
    length_moves=True,
    tool_word_moves=True,
    tool_cancelled_by_return="all",
    macro_change=True,
    unknown_lasts=True,
    harmless=RS274.harmless & ISO_MILL.harmless,
    before_m=frozenset(),
    left_at_start=RS274.left_at_start | ISO_MILL.left_at_start,
    writing=None,
)


def written_for(dialect: Dialect, controller: str) -> Dialect:
    """The dialect with the streams of the control that runs them.

    Parameters
    ----------
    dialect : Dialect
        In which a program is read.
    controller : str
        What the streams are for.

    Returns
    -------
    Dialect
        The same, but for this table and a controller that is among `MEMBERS`.
    """
    own = next((member for member in MEMBERS if member.name == controller), None)
    if dialect.name != ANY_MILL.name or own is None:
        return dialect
    return replace(
        dialect,
        writing=own.writing,
        exact_stop=own.exact_stop,
        stops_after_rapid=own.stops_after_rapid,
    )
