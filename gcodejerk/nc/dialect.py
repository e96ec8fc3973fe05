"""What differs between controllers when a program is read, as tables.

Rule: code asks the table and never the name of a dialect. A G code is written as ten times its
number (G92.1 is 921), so that codes are integers and compare exactly.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

AXES = "XYZABCUVW"
"""Column order of every position array."""

LINEAR = frozenset("XYZUVW")

PLANES: dict[int, tuple[str, str, str]] = {
    # G code: first and second axis of the plane, and the axis across it along which cycles drill
    170: ("X", "Y", "Z"),
    180: ("Z", "X", "Y"),
    190: ("Y", "Z", "X"),
    171: ("U", "V", "W"),
    181: ("W", "U", "V"),
    191: ("V", "W", "U"),
}

ARC_CENTRES: dict[int, tuple[str, str]] = {170: ("I", "J"), 180: ("I", "K"), 190: ("J", "K")}
"""The centre words that an arc may carry in each plane; the remaining one is an error."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """One way of writing and reading programs."""

    name: str
    groups: Mapping[int, str]
    """G code -> modal group; two codes of one group in a block are an error."""
    defaults: Mapping[str, int]
    """Modal group -> code in force when a program starts; a group not named is unknown."""
    m_groups: Mapping[int, str]
    """M code -> group; a code not named here is not known to the dialect."""
    uses: Mapping[str, frozenset[str]]
    """Letter -> codes ("G43", "M66") one of which has to stand in the block or be in force."""
    line_limit: int
    """Longest line that the controller reads, in bytes."""
    rapid: int = 0
    cycles: frozenset[int] = field(default_factory=frozenset)
    frame_changes: frozenset[int] = field(default_factory=frozenset)
    """Codes that, in the block of a rapid, move the origin that its numbers refer to."""
    harmless: frozenset[int] = field(default_factory=frozenset)
    """G codes whose effect does not depend on when, within its block, a rapid runs."""
    harmless_m: frozenset[int] = field(default_factory=frozenset)


def _groups(table: Mapping[str, tuple[int, ...]]) -> dict[int, str]:
    """Turn the table round: code -> group."""
    return {code: group for group, codes in table.items() for code in codes}


_SYSTEMS = (540, 550, 560, 570, 580, 590, 591, 592, 593)
_CYCLES = frozenset({730, 740, 760, *range(810, 900, 10)})

# LinuxCNC 2.9, G-code overview, "Modal groups"; each entry that matters here was checked against
# its stand-alone interpreter (tests/clients).
_LINUXCNC_GROUPS = _groups(
    {
        "motion": (
            *(0, 10, 20, 30, 50, 51, 52, 53, 330, 331, 382, 383, 384, 385, 800),
            *sorted(_CYCLES),
        ),
        "plane": tuple(PLANES),
        "distance": (900, 910),
        "arc distance": (901, 911),
        "feed mode": (930, 940, 950),
        "units": (200, 210),
        "compensation": (400, 410, 411, 420, 421),
        "tool length": (430, 431, 432, 490),
        "retract": (980, 990),
        "system": _SYSTEMS,
        "path": (610, 611, 640),
        "spindle mode": (960, 970),
        "diameter": (70, 80),
        "non-modal": (40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923),
    }
)

_LINUXCNC_M = _groups(
    {
        "stop": (0, 1, 2, 30, 60, 98, 99),
        "tool": (6, 61),
        "spindle": (3, 4, 5, 19),
        "coolant": (7, 8, 9),
        "override": (48, 49, 50, 51, 52, 53),
        "output": (62, 63, 64, 65, 66, 67, 68),
        "state": (70, 71, 72, 73),
        "user": tuple(range(100, 200)),
    }
)


def _codes(*names: str) -> frozenset[str]:
    return frozenset(names)


_CYCLE_NAMES = _codes(*(f"G{code // 10}" for code in _CYCLES))

_LINUXCNC_USES = {
    "D": _codes("G41", "G41.1", "G42", "G42.1", "G96"),
    "E": _codes("M66", "M67", "M68", "G76"),
    "H": _codes("G43", "G43.2", "G76"),
    "I": _codes("G2", "G3", "G5", "G5.1", "G10", "G33.1", "G43.1", "G76", "G87"),
    "J": _codes("G2", "G3", "G5", "G5.1", "G10", "G43.1", "G76", "G87"),
    "K": _codes("G2", "G3", "G33", "G33.1", "G43.1", "G76", "G87"),
    "L": _CYCLE_NAMES | _codes("G10", "G5.2", "M66", "M98", "G76"),
    "P": _codes(
        *("G2", "G3", "G4", "G5", "G5.2", "G10", "G64", "G74", "G76", "G82", "G84"),
        *("G86", "G88", "G89", "M19", "M50", "M51", "M52", "M53", "M98"),
        *(f"M{n}" for n in range(62, 69)),
        *(f"M{n}" for n in range(100, 200)),
    ),
    "Q": _codes(
        *("G5", "G10", "G64", "G73", "G76", "G83", "M19", "M61", "M66", "M67", "M68"),
        *(f"M{n}" for n in range(100, 200)),
    ),
    "R": _CYCLE_NAMES | _codes("G2", "G3", "G10", "G76", "M19"),
}

LINUXCNC = Dialect(
    name="linuxcnc",
    groups=_LINUXCNC_GROUPS,
    # What M2 leaves behind and the interpreter starts with. Path mode, feed and units are a matter
    # of the configuration, and nothing resets G98/G99 (mmount.ngc starts in G99): not here.
    defaults={
        "motion": 10,
        "plane": 170,
        "distance": 900,
        "arc distance": 911,
        "feed mode": 940,
        "compensation": 400,
        "system": 540,
    },
    m_groups=_LINUXCNC_M,
    uses=_LINUXCNC_USES,
    line_limit=254,
    cycles=_CYCLES,
    frame_changes=frozenset(
        {280, 281, 300, 301, 530, 430, 431, 432, 490, *_SYSTEMS, 920, 921, 922, 923, 520, 100}
    ),
    harmless=frozenset(
        {0, 40, 70, 80, 170, 171, 180, 181, 190, 191, 200, 210, 400, 610, 611, 640}
        | {900, 910, 901, 911, 930, 940, 950, 960, 970, 980, 990}
    ),
    harmless_m=frozenset({0, 1, 2, 30, 60, 3, 4, 5, 7, 8, 9, 48, 49, 50, 51, 52, 53}),
)

DIALECTS: dict[str, Dialect] = {LINUXCNC.name: LINUXCNC}
