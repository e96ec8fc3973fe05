"""What Fanuc and Haas mills read alike: for programs with a number (O1234) that could be of either.

Haas speaks Fanuc's language with codes of its own. This table holds what the two tables have in
common, and is no control's own; where they differ, it has what is the more cautious: a code of one
of them is not understood, but for Haas's mirrors and their kin, which would go unseen so; T may
call a program of the builder's (Fanuc), E may select a work system (Fadal, whose programs look
alike), G28 may cancel the tool length (Haas), ``M98 P31000`` is not followed unless there is an
O31000.

`tests/unit/test_nc_common.py` draws programs of both and holds this reading to each of theirs.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects.dialect import code_names
from gcodejerk.nc.dialects.fanuc import FANUC
from gcodejerk.nc.dialects.haas import HAAS

MEMBERS = (FANUC, HAAS)
_HAAS = {
    code: group
    for code, group in HAAS.groups.items()
    if code not in FANUC.groups and (code in HAAS.transforms or code in HAAS.bars)
}
_ALIKE = {code: group for code, group in FANUC.groups.items() if HAAS.groups.get(code) == group}

ISO_MILL = replace(
    FANUC,
    name="iso-mill",
    title="what Fanuc and Haas mills read alike",
    sources=tuple(dict.fromkeys((*FANUC.sources, *HAAS.sources))),
    groups={**_ALIKE, **_HAAS},
    # M96 and M97 go on elsewhere, whatever they are called
    m_groups={
        **{m: group for m, group in FANUC.m_groups.items() if m in HAAS.m_groups},
        46: HAAS.m_groups[46],
    },
    effects={
        **{code: effect for code, effect in FANUC.effects.items() if code in _ALIKE},
        **{code: effect for code, effect in HAAS.effects.items() if code in _HAAS},
    },
    transforms=HAAS.transforms,
    bars=HAAS.bars,
    drilling=replace(FANUC.drilling, repeats="", maybe_repeats="KL"),
    packed_repeats=False,
    tool_word_moves=True,
    shift_may_end=True,
    tool_frame=FANUC.tool_frame | {"E"},
    tool_cancelled_by_return="all",
    # centres of arcs that count from their start are the only ones that Fanuc has
    left_at_start=code_names("G91.1"),
    harmless=FANUC.harmless & HAAS.harmless,
)
