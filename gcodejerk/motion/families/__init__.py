"""Families of rapids: the laws by which controls move, each a file and a pure function.

What is here is what the controls' own rapids do: all that a design is compared with, and all that a
control's time constants can be tuned within. Every function takes unit quantities as columns and
gives `Profiles`, exact where the law is made of pieces of constant jerk.
"""

from gcodejerk.motion.families.averages import AVERAGED_TRAPEZOID, TIME_CONSTANTS
from gcodejerk.motion.families.family import Family, Kind, Quantity, unit_quantities
from gcodejerk.motion.families.four_ramp import FOUR_RAMP
from gcodejerk.motion.families.notch_ramp import NOTCH_RAMP
from gcodejerk.motion.families.seven_segment import SEVEN_SEGMENT, TRAPEZOID
from gcodejerk.motion.families.smooth_ramps import POLY5, POLY6, QUINTIC_RAMPS
from gcodejerk.motion.families.two_stage import TWO_STAGE

FAMILIES = {
    family.name: family
    for family in (
        *(TRAPEZOID, SEVEN_SEGMENT, AVERAGED_TRAPEZOID, TIME_CONSTANTS, FOUR_RAMP, TWO_STAGE),
        *(QUINTIC_RAMPS, POLY5, POLY6, NOTCH_RAMP),
    )
}
"""Every family by its name."""

__all__ = ["FAMILIES", "Family", "Kind", "Quantity", "unit_quantities"]
