r"""Ramps whose jerk follows the change of speed, so that one frequency is in their null: Kalico.

Its unified planner (a pull request, #939, not in a release) sets the jerk of every ramp to
:math:`J = \Delta v f^2`: the acceleration is a triangle of two sides 1/f, however long the move is.
Where it would exceed the limit A, the sides stay 1/f with J = A f, and a plateau stands between
them. Either way the ramp is a step of the speed behind an average of 1/f and one of the larger of
1/f and v/A.

Kalico plays it in slices of constant acceleration, of 1 ms by default, which are left out here; so
are its ramps for two frequencies.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.families.family import ACCELERATION, VELOCITY, Family, Kind, Quantity
from gcodejerk.motion.profiles.boxes import box_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles

NOTCH = Quantity("notch", "Hz", Kind.SHARED, "frequency that ramps leave alone")


def notch_ramp_profiles(velocity: Array, acceleration: Array, notch: Array) -> Profiles:
    """The fastest profiles of such ramps within two limits.

    Parameters
    ----------
    velocity, acceleration : ndarray, shape (n,)
        [1/s], [1/s^2]
    notch : ndarray, shape (n,)
        [Hz]

    Returns
    -------
    Profiles

    Examples
    --------
    200 mm/s at 55 Hz, far from the limit of the acceleration (11000 mm/s^2): ramps of 36.4 ms.

    >>> limits = (np.array([x]) for x in (200.0 / 400.0, 20000.0 / 400.0, 55.0))
    >>> profile = notch_ramp_profiles(*limits)
    >>> profile.duration[:2].round(6).tolist(), float(400.0 * profile.peak_acceleration[0].round(6))
    ([0.018182, 0.018182], 11000.0)
    """
    side = 1.0 / notch
    v = np.minimum(velocity, 0.5 * notch)
    # With a plateau: v (v/A + side) = 1.
    flat = 2.0 / (side + np.sqrt(side**2 + 4.0 / acceleration))
    v = np.where(v > acceleration * side, np.minimum(velocity, flat), v)
    return box_profiles(1.0 / v, np.maximum(side, v / acceleration), side)


NOTCH_RAMP = Family(
    "notch-ramp", "ramps with a null at one frequency",
    (VELOCITY, ACCELERATION, NOTCH), notch_ramp_profiles,
    "Kalico, docs/Jerk_Limiting.md of pull request 939",
)  # fmt: skip
