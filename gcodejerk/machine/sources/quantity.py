"""Numbers with units as people write them: `36 m/min`, `0.4g`, `5000 mm/s^2`, `-500:50`.

Rule: a number without a unit is refused where units differ between trades (a speed in mm/min or
mm/s is a factor of 60): it is not ours to guess.
"""

from __future__ import annotations

import math
import re

from gcodejerk.errors import MachineError
from gcodejerk.units import MM_PER_INCH, SECONDS_PER_MINUTE

STANDARD_GRAVITY = 9806.65
"""[mm/s^2]"""
_M, _IN, _MIN, _TURN = 1000.0, MM_PER_INCH, SECONDS_PER_MINUTE, 360.0

UNITS: dict[str, dict[str, float]] = {
    "velocity": {
        "mm/s": 1.0, "m/s": _M, "mm/min": 1.0 / _MIN, "m/min": _M / _MIN, "in/min": _IN / _MIN,
        "ipm": _IN / _MIN, "in/s": _IN, "ips": _IN,
    },
    "acceleration": {
        "mm/s^2": 1.0, "m/s^2": _M, "in/s^2": _IN, "g": STANDARD_GRAVITY,
    },
    "jerk": {"mm/s^3": 1.0, "m/s^3": _M, "in/s^3": _IN},
    "length": {"mm": 1.0, "in": _IN, "inch": _IN, "m": _M, "um": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "frequency": {"hz": 1.0},
}  # fmt: skip
"""Quantity -> unit -> mm, s and Hz in one."""
ROTARY_UNITS: dict[str, dict[str, float]] = {
    "velocity": {"deg/s": 1.0, "deg/min": 1.0 / _MIN, "rpm": _TURN / _MIN},
    "acceleration": {"deg/s^2": 1.0},
    "jerk": {"deg/s^3": 1.0},
    "length": {"deg": 1.0},
}
WITHOUT = {"length", "frequency"}
"""Quantities of which a bare number is clear: mm (deg), Hz."""
_NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*$", re.ASCII)


def quantity(text: str, kind: str, what: str, rotary: bool = False) -> float:
    """A number of mm (or deg), s or Hz.

    Parameters
    ----------
    text : str
        As written.
    kind : str
        A key of `UNITS`.
    what : str
        What messages call it.
    rotary : bool
        It belongs to an axis that turns.

    Returns
    -------
    float
        The value.

    Raises
    ------
    MachineError
        It is no number, or its unit is missing or unknown.

    Examples
    --------
    >>> quantity("36 m/min", "velocity", "the rapid")
    600.0
    >>> round(quantity("0.4g", "acceleration", "the rapid"), 2)
    3922.66
    """
    units = ROTARY_UNITS.get(kind, UNITS[kind]) if rotary else UNITS[kind]
    expected = f"expected a number with one of the units {', '.join(units)}"
    match = _NUMBER.match(text)
    if match is None:
        raise MachineError(f"{what} is {text!r}, {expected}", "as in 36 m/min, 0.4 g, 5000 mm/s^2")
    unit = re.sub(r"(?<=s)(?=[23]$)", "^", match[2].lower().replace("²", "^2").replace("³", "^3"))
    if not unit and kind in WITHOUT:
        unit = next(iter(units))
    if unit not in units:
        found = f"has the unit {match[2]!r}" if unit else "has no unit"
        raise MachineError(
            f"{what} is {text!r} and {found}, {expected}", "write the unit behind it"
        )
    value = float(match[1]) * units[unit]
    if not math.isfinite(value):
        raise MachineError(f"{what} is {text!r}, {expected}", "write a finite number")
    return value
