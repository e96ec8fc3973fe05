"""Mitsubishi, Mazak and Syntec mills: Fanuc's language, with codes of their own.

They are read as what Fanuc and Haas read alike (the table `iso-mill`) as far as the control has
that too, and no more, and every program that is read so says so. Every other code forbids to
rewrite what stands behind it (`Dialect.unknown_lasts`): G12.1, G68.2, G61.1, G05.1, the mirrors
that Mazak has as M codes (M90 to M92), and whatever a builder added; `program.harmless` declares
those that the owner knows. G28, G30, G53, G52, G92 and G10 leave no position known, cycles move
somewhere, and positions that are computed are not rewritten.

Mitsubishi M70, M80: M700V/M70V programming manual IB-1500922 pp. 28-29 (a number without a decimal
point counts the least increment, or does not, by a parameter), p. 314 (vacant variables), p. 508
(G53 is a rapid or a feed by the mode, and in G91 incremental).

Mazak, EIA/ISO programs of Mazatrol controls: the post of Keycult for HCN machines, which derives
from Autodesk's (G61.1, G5 P2, G43.4, G54.1; ``M98 P``; programs with names). The rest is general
knowledge that was not looked up; it is what every relative of Fanuc has.

Syntec: derek1ee/fusion-syil-22ma: syil_syntec.cps, and SYNTEC-40101720/syntec-macro:
src/codeDocs.js. G70 and G71 are inch and mm (G10 L1000 there; the post writes G71), G20 and G21 the
same; whether X100 is 100 mm is parameter 3241; ``M98 P H L`` begins at the line that H names; G54 P
selects another system.
"""

from __future__ import annotations

from dataclasses import replace

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.dialects.dialect import Dialect, Drilling, Effect, code_names, grouped
from gcodejerk.nc.dialects.fanuc import CYCLES, SYSTEMS
from gcodejerk.nc.dialects.iso_mill import ISO_MILL

_EFFECTS: dict[int, Effect] = {
    40: "words",
    **dict.fromkeys((270, 280, 290, 300, 310), "home"),
    **dict.fromkeys(SYSTEMS, "system"),
    541: "numbered system",
    **dict.fromkeys((430, 440, 490), "length"),
    100: "data",
    **dict.fromkeys((520, 530, 920), "frames"),
    **dict.fromkeys((501, 511), "words"),
    650: "flow",
}
_GROUPS = {
    "motion": (0, 10, 20, 30),
    "plane": (170, 180, 190),
    "distance": (900, 910),
    "feed mode": (940, 950),
    "compensation": (400, 410, 420),
    "tool length": (430, 440, 490),
    "cycle": (800, *sorted(CYCLES)),
    "retract": (980, 990),
    "system": (*SYSTEMS, 541),
    "path": (610, 640),
    "scaling": (500, 510),
    "mirror": (501, 511),
    "rotation": (680, 690),
    "polar": (150, 160),
    "non-modal": (40, 90, 100, 270, 280, 290, 300, 310, 520, 530, 650, 920),
}
_OWN = {code for codes in _GROUPS.values() for code in codes}


def _read_in_part(
    name: str, title: str, *sources: str, units: tuple[tuple[int, bool], ...] = ()
) -> Dialect:
    """A control of which only what its relatives share is taken as known."""
    inches = {200: True, 210: False, **dict(units)}
    return replace(
        ISO_MILL,
        name=name,
        title=f"{title} (as iso-mill, unverified)",
        sources=(*sources, *ISO_MILL.sources),
        groups=grouped({**_GROUPS, "units": tuple(inches)}),
        m_groups=grouped(
            {
                "stop": (0, 1, 2, 30, 98, 99),
                "tool": (6,),
                "spindle": (3, 4, 5, 19),
                "coolant": (7, 8, 9),
            }
        ),
        defaults={"compensation": 400},
        effects=_EFFECTS,
        # A may be the angle of a line, from which the control computes an axis that is not named
        letters=ISO_MILL.letters.replace("A", ""),
        units=inches,
        feed_modes={940: 94, 950: 95},
        transforms={code: ISO_MILL.transforms[code] for code in _OWN & set(ISO_MILL.transforms)},
        bars={code: bar for code, bar in ISO_MILL.bars.items() if code in _OWN},
        other_m="unknown",
        macro_change=True,
        unknown_lasts=True,
        drilling=Drilling(CYCLES, CYCLES, own_group=True, repeats="KL", missing="unknown"),
        # A variable may be one of the control's, and what it holds is not computed.
        arithmetic=Arithmetic(system=1, offsets=1, feed=ISO_MILL.arithmetic.feed),
        harmless=(ISO_MILL.harmless & _OWN) | set(inches),
        stops_after_rapid=False,
        # a macro that is called no more, the spindle's speed, overrides that are let
        left_at_start=ISO_MILL.left_at_start | code_names("G67", "G97", "M48"),
        note=f"the codes of {title} were not verified: it is read as what Fanuc and Haas mills "
        "read alike, unverified, and nothing is rewritten behind a code that is not among that",
    )


MITSUBISHI = _read_in_part(
    "mitsubishi", "Mitsubishi M70, M80", "M700V/M70V programming manual pp. 28-29, 314, 508"
)
MAZATROL_EIA = _read_in_part(
    "mazatrol-eia", "Mazatrol, EIA/ISO programs of mills", "Keycult's post for Mazak HCN"
)
SYNTEC = _read_in_part(
    "syntec",
    "Syntec mills",
    "derek1ee/fusion-syil-22ma: syil_syntec.cps",
    "SYNTEC-40101720/syntec-macro: src/codeDocs.js",
    units=((700, True), (710, False)),
)
