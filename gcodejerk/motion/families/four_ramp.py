r"""Four ramps of the acceleration, each of its own time: TwinCAT CNC and ISG on feed blocks.

Acceleration builds up within P-AXIS-00196 and is released within 00195; deceleration builds up
within 00198 and is released within 00197. In the order of the profile these are T1, T2, T3 and T4
of Sato and Shirase; each is a jerk, acceleration over time, that stays where the acceleration
(00001) or deceleration (00002) is not reached. With T1 = T4 and T2 = T3 it is Condition III.

Rule: a jerk enters as its inverse, time per acceleration, so that a time of 0 is a step of the
acceleration and needs no case of its own.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gcodejerk.motion.families.family import ACCELERATION, VELOCITY, Family, Kind, Quantity
from gcodejerk.motion.profiles.profile import Array, Profiles

DECELERATION = Quantity("deceleration", "mm/s^2", Kind.LIMIT, "deceleration of the rapid")
RAMPS = (
    Quantity("rise", "s", Kind.TIME, "acceleration builds up (T1)"),
    Quantity("fall", "s", Kind.TIME, "acceleration is released (T2)"),
    Quantity("braking_rise", "s", Kind.TIME, "deceleration builds up (T3)"),
    Quantity("braking_fall", "s", Kind.TIME, "deceleration is released (T4)"),
)
HALVINGS = 90
"""Of the interval in which a short move's peak speed lies: more than the digits of a number."""


class Ramp(NamedTuple):
    """From rest to a speed: the acceleration rises, stays and falls, shape (n,) each."""

    peak: Array
    """Acceleration reached [1/s^2]."""
    rise: Array
    stay: Array
    fall: Array
    """[s]"""

    @property
    def total(self) -> Array:
        """Its duration [s]."""
        return self.rise + self.stay + self.fall

    @property
    def centroid(self) -> Array:
        """Moment at which the area below the acceleration is balanced, from the begin [s]."""
        a, b, c = self.rise, self.stay, self.fall
        moment = a * a / 3.0 + b * (a + 0.5 * b) + 0.5 * c * (a + b + c / 3.0)
        centroid: Array = moment / (b + 0.5 * (a + c))
        return centroid


def ramp_to(velocity: Array, acceleration: Array, rising: Array, falling: Array) -> Ramp:
    """The fastest ramp from rest to a speed.

    Parameters
    ----------
    velocity, acceleration : ndarray, shape (n,)
        Speed to reach, and the most that the acceleration may be. [1/s], [1/s^2]
    rising, falling : ndarray, shape (n,)
        Inverse jerks, at least 0. [s^3]
    """
    both = rising + falling
    with np.errstate(divide="ignore"):
        peak = np.minimum(acceleration, np.sqrt(2.0 * velocity / both))
    stay = velocity / peak - 0.5 * peak * both
    return Ramp(peak, peak * rising, np.where(stay < 1e-12, 0.0, stay), peak * falling)


def four_ramp_profiles(
    velocity: Array,
    acceleration: Array,
    deceleration: Array,
    rise: Array,
    fall: Array,
    braking_rise: Array,
    braking_fall: Array,
) -> Profiles:
    """The fastest profiles within speed, acceleration and deceleration, of four jerks.

    Parameters
    ----------
    velocity, acceleration, deceleration : ndarray, shape (n,)
        Limits of the unit profile. [1/s], [1/s^2], [1/s^2]
    rise, fall, braking_rise, braking_fall : ndarray, shape (n,)
        How long the acceleration takes from 0 to its limit and back, and the deceleration, at
        least 0. [s]

    Returns
    -------
    Profiles
        Up to seven segments.

    Examples
    --------
    The paper's design, 1 mm in 40 ms with T1 = 1 ms, reaches 3846 mm/s^2:

    >>> times = (np.array([x]) for x in (0.001, 0.019, 0.019, 0.001))
    >>> A = np.array([6.0 / (0.040 * 0.039)])
    >>> profile = four_ramp_profiles(np.array([600.0]), A, A, *times)
    >>> round(float(profile.total[0]), 6), len(profile.begin)
    (0.04, 4)
    """
    jerks = (
        (acceleration, rise / acceleration, fall / acceleration),
        (deceleration, braking_fall / deceleration, braking_rise / deceleration),
    )

    def ramps(v: Array) -> tuple[Ramp, Ramp]:
        """Speeding up, and slowing down seen backwards: it is a ramp from rest too."""
        return ramp_to(v, *jerks[0]), ramp_to(v, *jerks[1])

    def way(v: Array) -> Array:
        return sum(((r.total - r.centroid) * v for r in ramps(v)), np.zeros_like(v))

    least, most = 1e-12 * velocity, velocity.copy()
    short = way(velocity) > 1.0
    for _ in range(HALVINGS if short.any() else 0):
        middle = np.sqrt(least * most)
        far = way(middle) > 1.0
        least, most = np.where(far, least, middle), np.where(far, middle, most)
    v = np.where(short, most, velocity)
    up, down = ramps(v)
    cruise = np.where(short, 0.0, (1.0 - way(v)) / v)
    zero = np.zeros_like(v)
    duration = np.stack([*up[1:], cruise, down.fall, down.stay, down.rise], axis=1)
    begin = np.stack([zero, up.peak, up.peak, zero, zero, -down.peak, -down.peak], axis=1)
    end = np.stack([up.peak, up.peak, zero, zero, -down.peak, -down.peak, zero], axis=1)
    used = duration > 1e-12
    jerk = (end - begin)[used] / duration[used]
    first = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return Profiles.of(first, duration[used], begin[used], jerk)


FOUR_RAMP = Family(
    "four-ramp", "four jerks, two of the acceleration and two of the deceleration",
    (VELOCITY, ACCELERATION, DECELERATION, *RAMPS), four_ramp_profiles,
    "ISG kernel and TwinCAT CNC, P-AXIS-00196, 00195, 00198, 00197 on G1 blocks",
)  # fmt: skip
