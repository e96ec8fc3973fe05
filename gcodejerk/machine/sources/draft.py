"""A machine file in the making: values with where they come from.

Rule: inside a draft everything is in mm (or deg), s and Hz, like everywhere in the package; the
readers of configurations convert, and the comment keeps the number as it was found.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError

DEFAULT_INTERVAL = 0.001
LINEAR_RESOLUTION, ROTARY_RESOLUTION = 0.001, 0.001
NEEDED = ("velocity", "acceleration")
TODAYS_LIMITS = (
    "designed rapids may accelerate no more than today's (limit), which leaves little to gain in "
    "unchanged time: where the drives have more to give, say so with --headroom 1.5, or raise "
    "limit.acceleration{}; with design.max_extension they may take longer instead"
)


@dataclass(frozen=True, slots=True)
class Fact:
    """A value and its origin."""

    value: float
    """[mm or deg, s, Hz]"""
    origin: str
    """For the comment behind it: `MAX_VELOCITY = 100 (mill.ini:34)`."""
    assumed: bool = False
    """Nobody said so; usual for such machines."""

    @property
    def comment(self) -> str:
        """Its origin, an assumption with the word that the user has to look for."""
        return f"ASSUMED: {self.origin}" if self.assumed else self.origin


@dataclass(slots=True)
class DraftAxis:
    """What is known of an axis."""

    name: str
    velocity: Fact | None = None
    acceleration: Fact | None = None
    jerk: Fact | None = None
    resolution: Fact | None = None
    travel: tuple[float, float] | None = None
    travel_origin: str = ""
    wrap: str | None = None
    diameter: bool = False
    law: dict[str, Fact] = field(default_factory=dict)
    """Further quantities of the planner, by their keys in `rapid`."""
    limit_acceleration: Fact | None = None
    filter: tuple[Mapping[str, str | float], str] | None = None
    """What acts behind the planner, and its origin."""
    spectrum: str | None = None
    """File of a measured spectrum."""
    modes: list[tuple[str, float, float, float, str]] = field(default_factory=list)
    """Name, frequency, damping ratio, participation, origin."""

    @property
    def rotary(self) -> bool:
        """A, B and C turn."""
        return self.name in "ABC"

    @property
    def known(self) -> bool:
        """Whether anything says how it vibrates."""
        return bool(self.modes or self.spectrum)


@dataclass(slots=True)
class Draft:
    """What is known of a machine."""

    kind: str
    """Whose configuration it was read from: `LinuxCNC INI`."""
    sources: list[str] = field(default_factory=list)
    name: str = ""
    controller: str = "linuxcnc"
    dialect: str | None = None
    interval: Fact | None = None
    positioning: tuple[str, str] | None = None
    """`linear` or `independent`, and why."""
    spindle: tuple[str, str] | None = None
    planner: tuple[str, str] | None = None
    startup: tuple[str, str] | None = None
    path: dict[str, Fact] = field(default_factory=dict)
    """Velocity and acceleration that the control bounds along the path, of all linear axes."""
    path_limit: dict[str, Fact] = field(default_factory=dict)
    """The same of designed profiles, where it is more."""
    options: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Of `controller_options`: text and origin."""
    axes: dict[str, DraftAxis] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    """What the user has to know or to do, one sentence each."""

    def axis(self, name: str) -> DraftAxis:
        """The axis of that letter, new where there was none."""
        return self.axes.setdefault(name, DraftAxis(name))

    def missing(self) -> list[str]:
        """What a machine file cannot be without, and nobody said."""
        return [
            f"{quantity} of {axis.name}"
            for axis in self.ordered()
            for quantity in NEEDED
            if getattr(axis, quantity) is None
        ]

    def ordered(self) -> list[DraftAxis]:
        """The axes, in the order of `AXES`."""
        return sorted(self.axes.values(), key=lambda axis: AXES.index(axis.name))

    def settle(self, headroom: float | None = None) -> None:
        """Fill in what may be assumed.

        Parameters
        ----------
        headroom : float, optional
            What the drives can accelerate, times what rapids do today; None: nobody said. [-]

        Raises
        ------
        MachineError
            Something that must not be assumed is missing.
        """
        if not self.axes:
            raise MachineError(
                "nothing says which axes the machine has",
                "state them: --axis 'X velocity=36m/min acceleration=0.4g travel=0:500'",
            )
        if missing := self.missing():
            first = self.axes[missing[0].split()[-1]]
            example = (
                "velocity=3600deg/min acceleration=200deg/s^2"
                if first.rotary
                else "velocity=24m/min acceleration=0.3g"
            )
            raise MachineError(
                f"nothing says the rapid's {', '.join(missing)}",
                f"state it, for example --axis '{first.name} {example}'; what the control is set "
                "to is never guessed",
            )
        if self.interval is None:
            usual = "the usual interval of commands; ask the control's manual"
            self.interval = Fact(DEFAULT_INTERVAL, usual, assumed=True)
        if self.positioning is None:
            self.positioning = "linear", "ASSUMED: G0 goes straight; independent if it bends"
        if headroom is None:
            more = " (that of the path, too)" if "acceleration" in self.path else ""
            self.notes.append(TODAYS_LIMITS.format(more))
        if headroom is not None and "acceleration" in self.path:
            self.path_limit["acceleration"] = Fact(
                headroom * self.path["acceleration"].value, f"{headroom:g} times rapid's, as stated"
            )
        for axis in self.axes.values():
            if headroom is not None and axis.acceleration is not None:
                axis.limit_acceleration = Fact(
                    headroom * axis.acceleration.value, f"{headroom:g} times rapid's, as stated"
                )
            if axis.resolution is None:
                step = ROTARY_RESOLUTION if axis.rotary else LINEAR_RESOLUTION
                axis.resolution = Fact(step, "the least increment of most controls", assumed=True)

    @property
    def known(self) -> bool:
        """Whether anything says how the machine vibrates."""
        return any(axis.known for axis in self.axes.values())
