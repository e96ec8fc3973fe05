"""Conversion between the units of files and controllers and those used inside the package.

Inside, every number is in mm (or degrees), seconds and Hz, and their products. These functions are
called at the edges only: where a program or a machine file is read, and where text is written.
"""

from __future__ import annotations

MM_PER_INCH = 25.4
SECONDS_PER_MINUTE = 60.0


def mm_from_inch(length_inch: float) -> float:
    """Length in mm of a length in inches."""
    return length_inch * MM_PER_INCH


def per_minute(speed: float) -> float:
    """Speed in units/min of a speed in units/s."""
    return speed * SECONDS_PER_MINUTE


def percent(share: float) -> str:
    """A share of a whole for a sentence: two digits, or all in front of the point.

    Examples
    --------
    >>> [percent(share) for share in (0.0661, 0.00012, 1.372, 0.0)]
    ['6.6 %', '0.012 %', '137 %', '0 %']
    """
    return f"{100.0 * share:.0f} %" if share >= 0.995 else f"{100.0 * share:.2g} %"
