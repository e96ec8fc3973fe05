r"""Ramps of speed that are polynomials of time: g2core's quintic, Marlin's POLY5 and POLY6.

All three take a ramp from rest to the speed v within a time T, on the mean of the two speeds, so
that it passes v T/2; they differ in T and in the shape of the acceleration, with u = t/T,

.. math:: a = \frac{v}{T}\left(6 u (1 - u) + \frac{o - 1.5}{-0.375} (6 u - 36 u^2 + 60 u^3 - 30 u^4)
          \right) .

* Marlin (M494) has T = v/A, the time of its trapezoid: POLY5 is o = 1.5, so that the acceleration
  peaks at 1.5 A; POLY6 takes the peak o A from `M494 O`, 1.25 to 1.875
  (Marlin/src/module/ft_motion/trajectory_poly5.h and trajectory_poly6.cpp at 0263b1d).
* TinyG and g2core have o = 1.875, a quintic speed 10 u^3 - 15 u^4 + 6 u^5, whose jerk peaks at
  10/sqrt(3) v/T^2. So T = q sqrt(v/J) with q = sqrt(10/sqrt 3) = 2.40281: twice the constant
  1.201405707 of mp_get_target_length (g2core/plan_zoid.cpp at 12c2138; there is no limit of the
  acceleration). g2core then steps the law in segments of 0.75 to 1.5 ms, which are left out here.

The law has no pieces of constant jerk: three stand for every one of `INTERVALS` parts of a ramp
(`pieces`). Position, speed and acceleration are exact at the ends of the parts. What they leave of
vibration is farthest off near the frequency INTERVALS/T, beyond that of most modes.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.families.family import ACCELERATION, JERK, VELOCITY, Family, Kind, Quantity
from gcodejerk.motion.families.pieces import POINTS, sampled_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles

INTERVALS = 32
"""Parts of a ramp: what they leave of vibration is right to 1e-4 of the peak speed."""
QUINTIC = 1.875
"""Peak of the acceleration of a quintic ramp, over its mean."""
JERK_PEAK = 10.0 / np.sqrt(3.0)
"""Peak of a quintic ramp's jerk, over v/T^2."""
OVERSHOOT = Quantity(
    "overshoot", "-", Kind.SHARED, "peak of the acceleration over the set one, 1.25 to 1.875"
)


def _ramps(velocity: Array, time: Array, overshoot: Array) -> Profiles:
    """Profiles of two mirrored ramps of a time each, and what is left between them at speed."""
    n = len(velocity)
    u = (np.arange(INTERVALS)[:, np.newaxis] + POINTS) / INTERVALS
    bump = (6.0 * u - 36.0 * u**2 + 60.0 * u**3 - 30.0 * u**4) / -0.375
    shape = 6.0 * u * (1.0 - u) + (overshoot[:, np.newaxis, np.newaxis] - 1.5) * bump
    up = (velocity / time)[:, np.newaxis, np.newaxis] * shape
    cruise = 1.0 / velocity - time
    cruise = np.where(cruise < 1e-12, 0.0, cruise)
    part = np.repeat((time / INTERVALS)[:, np.newaxis], INTERVALS, axis=1)
    duration = np.concatenate([part, cruise[:, np.newaxis], part], axis=1)
    acceleration = np.concatenate([up, np.zeros((n, 1, len(POINTS))), -up], axis=1)
    return sampled_profiles(duration, acceleration)


def quintic_profiles(velocity: Array, jerk: Array) -> Profiles:
    """Profiles of quintic ramps within two limits, shape (n,) each [1/s], [1/s^3].

    Examples
    --------
    A unit move within a jerk of 1000 1/s^3, one ramp up and one down:

    >>> profile = quintic_profiles(np.array([99.0]), np.array([1000.0]))
    >>> round(float(profile.total[0]), 6), round(float(profile.peak_velocity[0]), 6)
    (0.358792, 5.574256)
    """
    v = np.minimum(velocity, np.cbrt(jerk / JERK_PEAK))
    return _ramps(v, np.sqrt(JERK_PEAK * v / jerk), np.full_like(v, QUINTIC))


def poly6_profiles(velocity: Array, acceleration: Array, overshoot: Array) -> Profiles:
    """Profiles of sextic ramps that last as long as those of a trapezoid.

    Parameters
    ----------
    velocity, acceleration : ndarray, shape (n,)
        Of the trapezoid. [1/s], [1/s^2]
    overshoot : ndarray, shape (n,)
        Peak of the acceleration over that of the trapezoid. [-]

    Returns
    -------
    Profiles
    """
    v = np.minimum(velocity, np.sqrt(acceleration))
    return _ramps(v, v / acceleration, overshoot)


def poly5_profiles(velocity: Array, acceleration: Array) -> Profiles:
    """Profiles of quintic position: `poly6_profiles` with an overshoot of 1.5."""
    return poly6_profiles(velocity, acceleration, np.full_like(velocity, 1.5))


def quintic_duration(velocity: Array, jerk: Array) -> Array:
    """How long quintic ramps and what is between them take, shape (n,) [s]."""
    v = np.minimum(velocity, np.cbrt(jerk / JERK_PEAK))
    return np.asarray(1.0 / v + np.sqrt(JERK_PEAK * v / jerk))


QUINTIC_RAMPS = Family(
    "quintic", "ramps of quintic speed", (VELOCITY, JERK), quintic_profiles,
    "g2core, g2core/plan_zoid.cpp at 12c2138", exact=False, duration=quintic_duration,
)  # fmt: skip
POLY5 = Family(
    "poly5", "ramps of quintic position, as long as a trapezoid's", (VELOCITY, ACCELERATION),
    poly5_profiles,
    "Marlin, ft_motion/trajectory_poly5.h at 0263b1d (M494 T1)", exact=False,
)  # fmt: skip
POLY6 = Family(
    "poly6", "the same with a peak of the acceleration that is set",
    (VELOCITY, ACCELERATION, OVERSHOOT), poly6_profiles,
    "Marlin, ft_motion/trajectory_poly6.cpp at 0263b1d (M494 T2 O)", exact=False,
)  # fmt: skip
