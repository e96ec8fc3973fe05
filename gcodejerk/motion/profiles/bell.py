r"""Rapids with bell-shaped acceleration: a trapezoid of velocity behind a moving average.

What Fanuc calls bell-shaped acceleration after linear acceleration (B-64124EN p. 389: time to
speed F/A + T, jerk A/T), and what other controls' axis filters make: a trapezoid of velocity within
V and A, averaged over the fixed time T = A/J. With :math:`v = \min(V, \sqrt{L A})` the peak of
the trapezoid, the position is a step of height L through boxes of the widths L/v, v/A and A/J,
and the move lasts their sum.

Where v/A and A/J together are no wider than L/v this is the jerk-limited profile of seven segments.
A shorter move differs: the filter's time stays, so that it takes longer and peaks lower.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.profiles.boxes import box_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles


def bell_profiles(velocity: Array, acceleration: Array, jerk: Array) -> Profiles:
    """The profile of a control with bell-shaped acceleration.

    Parameters
    ----------
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile, the jerk finite. [1/s], [1/s^2], [1/s^3]

    Returns
    -------
    Profiles

    Examples
    --------
    1 mm with 600 mm/s, 5000 mm/s^2 and 5e5 mm/s^3: the trapezoid takes 28.3 ms, the filter 10 ms:

    >>> profile = bell_profiles(*(np.array([x]) for x in (600.0, 5000.0, 5e5)))
    >>> float(profile.total[0].round(6))
    0.038284
    """
    v = np.minimum(velocity, np.sqrt(acceleration))
    return box_profiles(1.0 / v, v / acceleration, acceleration / jerk)
