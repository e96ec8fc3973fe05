"""What a machine file may say, and hardly ever means: slips of a unit, limits that do not fit.

Rule: nothing here is refused. A planing machine is slow and a stage of a microscope is quick; but
whoever wrote mm/min where mm/s belongs is told so at the place of the number.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from gcodejerk.errors import MachineError
from gcodejerk.machine.file.checker import Checker, KeyPath, dotted
from gcodejerk.machine.parts import STREAM_HEADROOM

LONGEST_BUILD_UP = 0.5
"""Time in which the jerk builds the acceleration up, at most [s]."""
FREQUENCIES = (3.0, 500.0)
"""Modes of machines that a rapid shakes [Hz]."""
MOST_DAMPING = 0.3
COARSEST_RESOLUTION, COARSE_RESOLUTION = 0.1, 0.01
"""Above the first, the loader refuses a file; points are whole multiples of the resolution, and a
coarse one makes a stream of a few steps, each a jump for the axis. [mm] or [deg]"""
MM_PER_M = 1000.0
SECONDS_PER_MINUTE = 60.0


@dataclass(frozen=True, slots=True)
class Range:
    """Where a quantity usually lies, and which slip leads out of it at either end."""

    least: float
    most: float
    unit: str
    too_small: str
    too_large: str


LINEAR = {
    "velocity": Range(
        1.0, 3000.0, "mm/s",
        "m/min or m/s? 30 m/min is 500 mm/s",
        "mm/min? 30000 mm/min is 500 mm/s",
    ),
    "acceleration": Range(
        10.0, 50000.0, "mm/s^2",
        "m/s^2 or g? 5 m/s^2 is 5000 mm/s^2, 0.5 g is 4903 mm/s^2",
        "mm/min^2, or um/s^2? 5 m/s^2 is 5000 mm/s^2",
    ),
}  # fmt: skip
ROTARY = {
    "velocity": Range(
        1.0, 30000.0, "deg/s",
        "turns per second? 1 turn/s is 360 deg/s",
        "deg/min? 36000 deg/min is 600 deg/s",
    ),
    "acceleration": Range(
        10.0, 300000.0, "deg/s^2",
        "rad/s^2, or turns/s^2? 10 rad/s^2 is 573 deg/s^2",
        "deg/min^2? 3.6e6 deg/min^2 is 1000 deg/s^2",
    ),
}  # fmt: skip


def plausibility_warnings(values: dict[str, Any], checker: Checker) -> list[MachineError]:
    """What is hardly meant.

    Parameters
    ----------
    values : dict
        Of the whole file, all of it right.
    checker : Checker
        Knows the places.

    Returns
    -------
    list of MachineError
        In the order of the axes.
    """
    slips = _Slips(checker, values["interval"])
    # Streams for LinuxCNC need that much room below MAX_ACCELERATION, which `rapid` is.
    share = 1.0 / STREAM_HEADROOM if values.get("controller", "linuxcnc") == "linuxcnc" else 1.0
    for name, axis in values["axes"].items():
        rotary = name in checker.rotary
        for which in ("rapid", "limit"):
            slips.limits(("axes", name, which), axis.get(which, {}), axis["rapid"], rotary)
        slips.below(("axes", name, "limit"), axis.get("limit", {}), axis["rapid"], share)
        if not rotary:
            slips.above(("axes", name, "rapid"), axis["rapid"], values.get("path", {}))
        slips.resolution(("axes", name, "resolution"), axis["resolution"], rotary)
        for k, mode in axis.get("modes", {}).items():
            slips.mode(("axes", name, "modes", k), mode)
    path = values.get("path", {})
    for which, given in path.items():
        slips.limits(("path", which), given, given, rotary=False)
    slips.below(("path", "limit"), path.get("limit", {}), path.get("rapid", {}), share)
    for k, mode in values.get("modes", {}).items():
        slips.mode(("modes", k), mode)
    return slips.found


class _Slips:
    """Collects warnings, each at its key."""

    def __init__(self, checker: Checker, interval: float) -> None:
        self.checker, self.interval = checker, interval
        self.found: list[MachineError] = []

    def _warn(self, path: KeyPath, problem: str, remedy: str) -> None:
        self.found.append(
            MachineError(f"{dotted(path)} is {problem}", remedy, self.checker.place(path))
        )

    def limits(
        self, path: KeyPath, given: dict[str, Any], rapid: dict[str, Any], rotary: bool
    ) -> None:
        """Velocity and acceleration in their usual range; a jerk that builds it up in time."""
        for quantity, usual in (ROTARY if rotary else LINEAR).items():
            value = given.get(quantity)
            if value is None or usual.least <= value <= usual.most:
                continue
            small = value < usual.least
            self._warn(
                (*path, quantity),
                f"{value:g} {usual.unit}, {'below' if small else 'above'} "
                f"{usual.least if small else usual.most:g}: is the unit right?",
                usual.too_small if small else usual.too_large,
            )
        if "jerk" not in given:
            return
        # `rapid` falls back on nothing; `limit` falls back on rapid.
        acceleration = given.get("acceleration", rapid["acceleration"])
        unit, build_up = "deg" if rotary else "mm", acceleration / given["jerk"]
        if build_up > LONGEST_BUILD_UP * (1.0 + 1e-9):
            in_m = given["jerk"] * MM_PER_M
            self._warn(
                (*path, "jerk"),
                f"{given['jerk']:g} {unit}/s^3, which takes {build_up:.3g} s to build "
                f"{acceleration:g} {unit}/s^2 up",
                f"m/s^3? {given['jerk']:g} m/s^3 is {in_m:g} mm/s^3; 5e5 mm/s^3 builds "
                "5000 mm/s^2 up in 0.01 s",
            )
        elif build_up < self.interval * (1.0 - 1e-9):
            self._warn(
                (*path, "jerk"),
                f"{given['jerk']:g} {unit}/s^3, which builds {acceleration:g} {unit}/s^2 up in "
                f"{build_up:.3g} s, less than one interval of {self.interval:g} s",
                "mm/min^3, or um/s^3? 5e5 mm/s^3 builds 5000 mm/s^2 up in 0.01 s"
                if path[-1] == "rapid"
                else "no segment is shorter than an interval: such a limit limits nothing",
            )

    def resolution(self, path: KeyPath, resolution: float, rotary: bool) -> None:
        """A step as fine as controls have it."""
        if resolution > COARSE_RESOLUTION * (1.0 + 1e-9):
            self._warn(
                path,
                f"{resolution:g} {'deg' if rotary else 'mm'}: all points are whole multiples of it",
                "least increments of controls are 0.001 or finer",
            )

    def below(
        self, path: KeyPath, limit: dict[str, Any], rapid: dict[str, Any], share: float
    ) -> None:
        """A designed rapid that may do less than today's (of its acceleration, than a share)."""
        for quantity in ("velocity", "acceleration", "jerk"):
            if quantity not in limit or quantity not in rapid:
                continue
            least = (share if quantity == "acceleration" else 1.0) * rapid[quantity]
            if limit[quantity] < least * (1.0 - 1e-6):
                self._warn(
                    (*path, quantity),
                    f"{limit[quantity]:g}, below rapid.{quantity} {rapid[quantity]:g}",
                    "a designed rapid then takes longer than today's, or is left alone; leave the "
                    "entry out to allow what rapids do today",
                )

    def above(self, at: KeyPath, rapid: dict[str, Any], path: dict[str, Any]) -> None:
        """A rapid of one axis that is faster than the path may be."""
        most = path.get("rapid", {})
        for quantity in ("velocity", "acceleration"):
            if quantity in most and rapid[quantity] > most[quantity] * (1.0 + 1e-6):
                self._warn(
                    (*at, quantity),
                    f"{rapid[quantity]:g}, above path.rapid.{quantity} {most[quantity]:g}, which "
                    "counts: an axis alone is a path, too",
                    "lower it, or raise path.rapid if the control bounds the path less",
                )

    def mode(self, path: KeyPath, mode: dict[str, Any]) -> None:
        """A frequency and a damping ratio as machines have them."""
        frequency, damping = mode["frequency"], mode["damping"]
        low, high = FREQUENCIES
        if frequency < low:
            self._warn(
                (*path, "frequency"), f"{frequency:g} Hz, below {low:g}",
                f"kHz, or a period? A period of {frequency:g} s is {1.0 / frequency:g} Hz",
            )  # fmt: skip
        elif frequency > high:
            hertz = frequency / (2.0 * 3.141592653589793)
            self._warn(
                (*path, "frequency"), f"{frequency:g} Hz, above {high:g}",
                f"rad/s, or per minute? {frequency:g} rad/s is {hertz:.4g} Hz, "
                f"{frequency:g} per minute {frequency / SECONDS_PER_MINUTE:.4g} Hz",
            )  # fmt: skip
        at = (*path, "damping") if self.checker.given((*path, "damping")) else path
        if damping == 0.0:
            self.found.append(
                MachineError(
                    f"{dotted((*path, 'damping'))} is 0: such a mode rings for ever",
                    "machine tools have 0.01 to 0.1; a tap test gives it",
                    self.checker.place(at),
                )
            )
        elif damping > MOST_DAMPING:
            self._warn(
                at, f"{damping:g}, above {MOST_DAMPING:g}",
                f"per cent? {damping:g} % is {damping / 100.0:g}; or the quality factor?",
            )  # fmt: skip
