"""What each control makes of a drilling cycle, told a second time: its heights and its habits.

From the manuals alone: LinuxCNC's ("Canned cycles"), Fanuc's (30i user's manual B-63944EN-2, pp. 53
and 62) and Haas's (VF operator's manual 96-8000, pp. 182 to 192). What a setting of the control
decides comes from the machine file, or is None: then nobody knows.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import BinaryIO

from gcodejerk.nc import Dialect, Start
from gcodejerk.nc.dialects.gcodes import G17, G18, G19
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.verification.second_reading.reading import pieces

INCH = Fraction(254, 10)
_ELSEWHERE = re.compile(
    rb"(?:GOTO|DO)[ \t]*[0-9#\[]|WHILE[ \t]*\[|M[ \t]*0*9[67](?![0-9])|M[ \t]*0*99[^\n(]*P",
    re.IGNORECASE,
)
NEAR = Fraction(1, 10**8)


@dataclass(frozen=True, slots=True)
class Control:
    """One control's drilling cycles."""

    heights: Mapping[int, str]
    """Code -> what the tool does over a hole, once it is at R: z feed to the bottom, r feed to R, t
    feed to the top, T rapid to the top (R in G99, else where the series began if that is higher), P
    dwell, S stop the spindle, M start it again, b pecks that break the chip, c pecks that clear it.
    """
    repeats: str = "L"
    back: Mapping[str, Fraction | None] = field(default_factory=dict)
    """Of b and c: how far a peck goes back, or stays above where it was. [mm]"""
    lift: Fraction | None = Fraction(0)
    """How far above R chips are cleared. [mm]"""
    planes: frozenset[int] = frozenset({G17, G18, G19})
    beside: bool = False
    """Cycles do not replace G0 or G1: Fanuc's group 09."""
    watched: bool = True
    """It was run beside its interpreter; otherwise nothing is believed that the manuals leave open:
    an R above the tool, G90 and G91 in one series, a tool that somebody may have moved."""
    levels: bool = True
    """G98 and G91 behind G99, and a G85 that goes beyond R, are told in one way only."""
    point: bool | None = None
    """A dwell counts as in G4 with a decimal point, without one; None: either way."""
    xy: bool = False
    """Only a block that names X or Y drills for certain."""
    stated: bool = False
    """One that states its cycle, too."""
    carries: bool = False
    """A dwell holds for whatever cycle follows it in a series."""
    leaves: frozenset[str] = frozenset()
    """Heights that this machine has not told enough of."""
    lent: frozenset[float] = frozenset({74.0, 84.0})
    """Cycles that take the dwell of an earlier one, G80 or not."""
    letters: str = "NFST"
    """What may stand beside a cycle's own words, and between two holes."""
    switches: frozenset[int] = frozenset({3, 4, 5, 7, 8, 9, 48, 49, 0, 1, 2, 30, 60})
    """M codes that may stand in a block of a cycle."""
    whole: str | None = "calculator"
    """What a length without a decimal point is; None: nobody knows."""

    def number(self, letter: str, text: bytes, unit: float | None) -> Fraction | None:
        """What a word says; None where that is not known."""
        text = b"".join(text.split())
        value = Fraction(text.decode() or "0")
        if not self.beside or b"." in text or not value or letter not in "XYZRQ":
            return value
        if self.whole == "calculator":
            return None if letter == "Q" else value
        if self.whole != "standard":
            return None
        return value / (1000 if unit == 1.0 else 10000)

    def distance(self, mm: Fraction | None, unit: float | None) -> Fraction | None:
        """A distance of the control in the program's unit."""
        if mm is None:
            return None
        length = mm if unit == 1.0 else mm / INCH
        steps = length * (1000 if unit == 1.0 else 10000)
        return length if not self.beside or abs(steps - round(steps)) < NEAR else None


_TENTH = {"b": Fraction(254, 1000), "c": Fraction(254, 1000)}
"""LinuxCNC: 0.010 inch."""
_LINUXCNC = Control(
    {730: "bzT", 810: "zT", 820: "zPT", 830: "czT", 850: "zrT", 860: "zPSTM", 890: "zPt"},
    back=_TENTH,
)
_MACH = Control(
    {810: "zT", 850: "zrT"},
    planes=frozenset({G17}),
    watched=False,
    levels=False,
    lent=frozenset(),
    switches=frozenset({3, 4, 5, 7, 8, 9}),
)
"""NIST RS274/NGC, without what Mach's settings decide."""
_ISO = {730: "bzT", 810: "zT", 820: "zPT", 830: "czT", 850: "zrT", 890: "zPrT"}


def control_of(dialect: Dialect, start: Start) -> Control:
    """What is known of the cycles of a control.

    Parameters
    ----------
    dialect : Dialect
        Of the program.
    start : Start
        What the machine file says of the control.

    Returns
    -------
    Control
        One without heights where nobody knows any.
    """
    if dialect.name == "linuxcnc":
        return _LINUXCNC
    if dialect.name == "mach":
        return _MACH
    if dialect.name not in ("fanuc", "haas"):
        return Control({})
    haas, said = dialect.name == "haas", start.cycles
    return Control(
        _ISO,
        repeats="L" if haas else "K",
        back={"b": _exactly(said.chip_retract), "c": _exactly(said.peck_clearance)},
        lift=_exactly(said.clear_above_r) if haas else Fraction(0),
        planes=frozenset({G17}),
        beside=True,
        watched=False,
        point=haas,
        xy=haas,
        stated=said.without_xy == "drills",
        carries=haas,
        leaves=frozenset() if said.boring_out == "feed" else frozenset("r"),
        lent=frozenset(),
        letters="NFS",
        switches=frozenset({3, 4, 5, 7, 8, 9}),
        whole=start.decimal_point,
    )


def _exactly(mm: float | None) -> Fraction | None:
    return None if mm is None else Fraction(repr(mm))


def cycle_of(state: State, dialect: Dialect) -> int | None:
    """The cycle that is in force."""
    if not dialect.drilling.own_group:
        return state.motion if state.motion in dialect.cycles else None
    return state.cycle[0] if state.cycle is not None else None


def comes_from_elsewhere(original: BinaryIO) -> bool:
    """Whether a block of a program may be reached otherwise than from the one in front of it."""
    return any(_ELSEWHERE.search(piece) for piece in pieces(original))
