"""Seven segments with one jerk, and trapezoids of velocity: limits that a planner keeps.

Siemens SOFT (MD32300, MD32431), Heidenhain (MP1061, MP1090), LinuxCNC 2.10 with PLANNER_TYPE 1
(MAX_LINEAR_JERK) and KFLOP's G0 (third order): the fastest rapid within velocity, acceleration and
jerk. Without a jerk limit it is the trapezoid of grbl, Klipper, Marlin and LinuxCNC 2.9, and of
KFLOP's G1 (second order).

grblHAL with ENABLE_JERK_ACCELERATION only comes near it: its acceleration goes in steps of one
segment of the step generator, its planner counts with an effective mean acceleration, and the last
segment of a ramp takes what is missing (core f80fc34, stepper.c).
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.families.family import ACCELERATION, JERK, VELOCITY, Family
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.profiles.symmetric import conventional_profiles


def seven_segment_profiles(velocity: Array, acceleration: Array, jerk: Array) -> Profiles:
    """The fastest profiles within three limits, shape (n,) each [1/s], [1/s^2], [1/s^3]."""
    return conventional_profiles(velocity, acceleration, jerk).general()


def trapezoid_profiles(velocity: Array, acceleration: Array) -> Profiles:
    """The fastest profiles within two limits, shape (n,) each [1/s], [1/s^2]."""
    return seven_segment_profiles(velocity, acceleration, np.full_like(velocity, np.inf))


def seven_segment_duration(velocity: Array, acceleration: Array, jerk: Array) -> Array:
    """How long they take, shape (n,) [s]."""
    return conventional_profiles(velocity, acceleration, jerk).total


def trapezoid_duration(velocity: Array, acceleration: Array) -> Array:
    """How long trapezoids take, shape (n,) [s]."""
    v = np.minimum(velocity, np.sqrt(acceleration))
    return np.asarray(1.0 / v + v / acceleration)


SEVEN_SEGMENT = Family(
    "jerk-limited", "seven segments with one jerk", (VELOCITY, ACCELERATION, JERK),
    seven_segment_profiles,
    "for example SINUMERIK 828D function manual B2 4.2.12 (SOFT)", duration=seven_segment_duration,
)  # fmt: skip
TRAPEZOID = Family(
    "trapezoidal", "a trapezoid of velocity", (VELOCITY, ACCELERATION), trapezoid_profiles,
    "for example grbl 1.1, doc/markdown/settings.md", duration=trapezoid_duration,
)  # fmt: skip
