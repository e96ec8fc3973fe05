"""Moving averages over the commanded velocity: time constants, as Fanuc and others set them.

The velocity steps to its value, passes an average of the length FT1 (linear acceleration), and one
of FT2 (bell). Where FT1 is a time, short moves accelerate less; where the acceleration is constant,
FT1 is the time to the speed that the move reaches, velocity over acceleration.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.families.family import ACCELERATION, VELOCITY, Family, Kind, Quantity
from gcodejerk.motion.families.seven_segment import trapezoid_duration
from gcodejerk.motion.profiles.boxes import box_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles

FT1 = Quantity("first_average", "s", Kind.TIME, "first moving average, of linear acceleration")
FT2 = Quantity("second_average", "s", Kind.TIME, "second moving average, of the bell")
SHORTEST = 1e-9
"""An average shorter than this is none [s]: the box is there, and changes nothing."""


def time_constant_profiles(
    velocity: Array, first_average: Array, second_average: Array
) -> Profiles:
    """Velocity steps behind two averages of fixed lengths, shape (n,) each [1/s], [s], [s]."""
    return box_profiles(
        1.0 / velocity, np.maximum(first_average, SHORTEST), np.maximum(second_average, SHORTEST)
    )


def averaged_trapezoid_profiles(
    velocity: Array, acceleration: Array, second_average: Array
) -> Profiles:
    """Trapezoids of velocity behind one average, shape (n,) each [1/s], [1/s^2], [s]."""
    v = np.minimum(velocity, np.sqrt(acceleration))
    return box_profiles(1.0 / v, v / acceleration, np.maximum(second_average, SHORTEST))


def time_constant_duration(velocity: Array, first_average: Array, second_average: Array) -> Array:
    """How long they take, shape (n,) [s]."""
    return np.asarray(1.0 / velocity + first_average + second_average)


def averaged_trapezoid_duration(
    velocity: Array, acceleration: Array, second_average: Array
) -> Array:
    """How long trapezoids behind an average take, shape (n,) [s]."""
    return trapezoid_duration(velocity, acceleration) + second_average


TIME_CONSTANTS = Family(
    "time-constants", "two moving averages of fixed times", (VELOCITY, FT1, FT2),
    time_constant_profiles,
    "Fanuc B-64124EN p. 389", duration=time_constant_duration,
)  # fmt: skip
AVERAGED_TRAPEZOID = Family(
    "averaged-trapezoid", "constant acceleration behind one moving average",
    (VELOCITY, ACCELERATION, FT2), averaged_trapezoid_profiles,
    "Fanuc A-78962EN p. 16 (time to speed F/A + T)", duration=averaged_trapezoid_duration,
)  # fmt: skip
