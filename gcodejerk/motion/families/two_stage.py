"""Two accelerations, one below a change-over speed and one above it: TwinCAT's linear slope.

TwinCAT CNC and the ISG kernel without jerk limit (P-AXIS-00270 = 0) take rapids in two stages:
P-AXIS-00005 up to the speed P-AXIS-00211, and P-AXIS-00006 above it, near the speed at which a
drive has less torque. Braking has stages of its own, 00281 and 00280, with the same change-over
speed. That the first stage is the slower one while braking too is taken from the order in which the
manual names them; it does not say so.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.families.family import VELOCITY, Family, Kind, Quantity
from gcodejerk.motion.profiles.profile import Array, Profiles

STAGES = (
    Quantity("acceleration", "mm/s^2", Kind.LIMIT, "acceleration below the change-over speed"),
    Quantity("upper_acceleration", "mm/s^2", Kind.LIMIT, "acceleration above it"),
    Quantity("deceleration", "mm/s^2", Kind.LIMIT, "deceleration below the change-over speed"),
    Quantity("upper_deceleration", "mm/s^2", Kind.LIMIT, "deceleration above it"),
    Quantity("changeover", "mm/s", Kind.LIMIT, "change-over speed"),
)


def two_stage_profiles(
    velocity: Array,
    acceleration: Array,
    upper_acceleration: Array,
    deceleration: Array,
    upper_deceleration: Array,
    changeover: Array,
) -> Profiles:
    """The fastest profiles within a speed and the accelerations of two stages.

    Parameters
    ----------
    velocity, changeover : ndarray, shape (n,)
        Speed limit of the unit profile, and the speed between the stages. [1/s]
    acceleration, upper_acceleration, deceleration, upper_deceleration : ndarray, shape (n,)
        Below and above the change-over. [1/s^2]

    Returns
    -------
    Profiles
        Up to five segments, none of them of any jerk.

    Examples
    --------
    8 1/s^2 up to 1 1/s, then 4 1/s^2 up to 1.5 1/s:

    >>> columns = (np.array([x]) for x in (1.5, 8.0, 4.0, 8.0, 4.0, 1.0))
    >>> two_stage_profiles(*columns).duration.tolist()
    [0.125, 0.125, 0.375, 0.125, 0.125]
    """
    # Way of both ramps per square of the speed, below and above the change-over.
    below = 0.5 / acceleration + 0.5 / deceleration
    above = 0.5 / upper_acceleration + 0.5 / upper_deceleration
    left = 1.0 - below * changeover**2
    reached = np.where(
        left > 0.0, np.sqrt(changeover**2 + np.maximum(left, 0.0) / above), np.sqrt(1.0 / below)
    )
    v = np.minimum(velocity, reached)
    lower = np.minimum(v, changeover)
    upper = v - lower
    way = below * lower**2 + above * (v**2 - lower**2)
    cruise = np.where(reached > velocity, (1.0 - way) / v, 0.0)
    zero = np.zeros_like(v)
    duration = np.stack(
        [
            lower / acceleration, upper / upper_acceleration, cruise,
            upper / upper_deceleration, lower / deceleration,
        ],
        axis=1,
    )  # fmt: skip
    held = np.stack(
        [acceleration, upper_acceleration, zero, -upper_deceleration, -deceleration], axis=1
    )
    used = duration > 1e-12
    first = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return Profiles.of(first, duration[used], held[used], np.zeros(int(used.sum())))


TWO_STAGE = Family(
    "two-stage", "two constant accelerations, with a change-over speed", (VELOCITY, *STAGES),
    two_stage_profiles,
    "TwinCAT CNC, infosys tf5200 248714123, P-AXIS-00005, 00006, 00211, 00280, 00281",
)  # fmt: skip
