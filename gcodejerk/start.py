"""What may be assumed when a program starts.

Rule: without a word from the user only the dialect's documented modes are assumed, and no position.
It stands on the ground because `machine` states it and `nc` starts from it, and neither knows the
other: so everyone who reads a program for a machine reads it from the same start.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import Place

Number = float | NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class RapidFeed:
    """Feed moves that the user has said to be rapids: some CAM systems write no others."""

    feed: float
    """Their F, exactly. [program's unit/min]"""
    clearance: float
    """Z that both of their ends are at, or above, in program coordinates. [program's unit]"""

    @property
    def text(self) -> str:
        """As the settings of an output say it."""
        return f"rapid-feed {self.feed!r} {self.clearance!r}"

    def covers(self, feed: Number, start: Number, end: Number, unit: float) -> Any:
        """Whether straight feed moves are some of them.

        Parameters
        ----------
        feed : float or ndarray
            F in force, in feed per minute. [program's unit/min]
        start, end : float or ndarray
            Z in front of each and behind it; NaN where unknown. [mm]
        unit : float
            Millimetres of the program's unit. [mm]

        Returns
        -------
        bool or ndarray of bool

        Examples
        --------
        >>> RapidFeed(5000.0, 5.0).covers(5000.0, 15.0, 5.0, 1.0)
        True
        >>> RapidFeed(5000.0, 5.0).covers(5000.0, 15.0, float("nan"), 1.0)
        False
        """
        least = self.clearance * unit - _NEAR
        return (feed == self.feed) & (start >= least) & (end >= least)


_NEAR = 1e-6
"""Sums of increments differ in their last digits. [mm]"""


@dataclass(frozen=True, slots=True)
class CycleSettings:
    """What a control's settings decide about its drilling cycles; None: nobody has said."""

    chip_retract: float | None = None
    """How far G73 goes back to break the chip: Fanuc 5114, Haas setting 22. [mm]"""
    peck_clearance: float | None = None
    """How far above its last depth G83 comes down again: Fanuc 5115, Haas setting 22. [mm]"""
    clear_above_r: float | None = None
    """How far above R G83 clears the chips: Haas setting 52. [mm]"""
    boring_out: str | None = None
    """``feed``: G85 and G89 come out to R with the feed in force, at 100 %."""
    without_xy: str | None = None
    """``drills``: a block that states a cycle and names neither X nor Y (Haas setting 28)."""


@dataclass(frozen=True, slots=True)
class Start:
    """What may be assumed when the program starts; by default nothing but the dialect's modes."""

    positions: Mapping[str, float] = field(default_factory=dict)
    """Axis -> program coordinate [mm, deg]."""
    offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """System, for example ``G54`` -> axis -> machine minus program coordinate [mm, deg]."""
    tool_lengths: Mapping[int, float] = field(default_factory=dict)
    """H number -> length along Z [mm]."""
    startup: str = ""
    """Codes in force when a program starts, for example LinuxCNC's RS274NGC_STARTUP_CODE."""
    startup_at: Place | None = field(default=None, compare=False)
    """Where the machine file states them."""
    diameter: bool = False
    """X is a diameter where the program does not say whether it is."""
    decimal_point: str | None = None
    """What X100 means where the dialect leaves it to the machine: ``calculator`` 100 mm,
    ``standard`` 100 least increments of 0.001 mm; None unknown."""
    wraps: Mapping[str, str] = field(default_factory=dict)
    """Rotary axis -> how it goes to an absolute position: ``none``, through all angles, like a
    linear axis; ``shortest``, the shorter way round; ``sign``, forwards to a positive number and
    backwards to a negative one. Of an axis that is not listed, nobody knows."""
    linear: Mapping[str, bool] = field(default_factory=dict)
    """Of A, B and C those that slide -> whether 1 is a millimetre in a program in mm. In one in
    inches nobody knows: LinuxCNC takes their words as they stand, other controls convert them."""
    resume: str | None = None
    """Where the axes stand behind M0 and M1: ``same`` place, ``unknown``; None: as the dialect's
    controls do it."""
    spindle: str | None = None
    """What M3 turns on: a ``mill``, or a beam: ``laser``, ``plasma``; None: unknown where the
    dialect's controls drive beams too, a mill elsewhere."""
    home: Mapping[str, float] = field(default_factory=dict)
    """Axis -> where G28 leads it, in machine coordinates [mm, deg]."""
    tool_change: Mapping[str, float] | None = None
    """Axis -> where it stands behind M6, in machine coordinates [mm, deg]; the others do not move.
    None: nobody knows where the axes stand."""
    m_before: frozenset[int] = frozenset()
    m_after: frozenset[int] = frozenset()
    """M codes that the control runs before the motion of their block, and behind it."""
    harmless: frozenset[str] = frozenset()
    """Codes, for example ``M150``, of which the owner says that they move nothing and change no
    mode and no frame; one that the dialect's table knows means what it says there."""
    rapid_feed: RapidFeed | None = None
    """Feed moves that count as rapids; None, as a rule: none do."""
    cycles: CycleSettings = field(default_factory=CycleSettings)
    unrolled_lines: int | None = None
    """Lines that loops and calls may be written out as, at most; None: the program's own bound."""
    limits: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """Axis -> largest velocity, acceleration and jerk that its rapids and streams may have [mm/s,
    mm/s^2, mm/s^3; deg]; one that a program sets lower is in their way."""
    along: tuple[float, float, float] = (math.inf, math.inf, math.inf)
    """The same of the path of all linear axes together."""
    straight: bool = True
    """Rapids are straight lines, all axes together; else every axis runs on its own."""
    control: str = ""
    """Dialect that the machine's own control reads; empty: nobody says."""
    subprograms: Mapping[str, bytes] = field(default_factory=dict)
    """Files in which the control finds what a program calls: name -> text."""
    restores: bool = True
    """F and its mode have to be restored behind a stream; False: it stands in a file of its own,
    and the program's F stays as it is."""


NOTHING_KNOWN = Start()
