r"""Pieces of constant jerk that stand for a law whose acceleration is curved.

A law such as a polynomial of the fifth degree has no pieces of constant jerk. Here every interval
of it becomes three: their acceleration is that of the law at both ends of the interval, and they
gain the same speed and the same way. So position, speed and acceleration are those of the law at
the end of every interval, the acceleration does not step, and where the law is of constant jerk the
three are one.

Within an interval of duration D, acceleration :math:`a + b t + c t^2`, the acceleration is off by
at most :math:`c D^2/36`.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.profiles.profile import Array, Profiles

POINTS = np.linspace(0.0, 1.0, 5)
"""Where an interval's acceleration is looked at, as parts of it."""
BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
"""Weights of these points: exact for polynomials of the fifth degree."""


def sampled_profiles(duration: Array, acceleration: Array) -> Profiles:
    """Profiles whose acceleration is known at points of every interval.

    Parameters
    ----------
    duration : ndarray, shape (n, k)
        Of the k intervals of every profile; those shorter than 1e-12 s are left out. [s]
    acceleration : ndarray, shape (n, k, 5)
        At `POINTS` of each; a polynomial of at most the fourth degree within it. [1/s^2]

    Returns
    -------
    Profiles
        n, of up to 3 k segments.
    """
    gained = duration * (acceleration @ BOOLE)
    passed = duration**2 * (acceleration @ (BOOLE * (1.0 - POINTS)))
    return curved_profiles(duration, acceleration[..., 0], acceleration[..., -1], gained, passed)


def curved_profiles(
    duration: Array, start: Array, end: Array, gained: Array, passed: Array
) -> Profiles:
    """Profiles of any acceleration, of which every interval's ends and two integrals are known.

    Parameters
    ----------
    duration : ndarray, shape (n, k)
        As for `sampled_profiles`. [s]
    start, end : ndarray, shape (n, k)
        Acceleration at an interval's begin and end. [1/s^2]
    gained : ndarray, shape (n, k)
        Speed gained within each interval. [1/s]
    passed : ndarray, shape (n, k)
        Way passed within it, less that at the speed of its begin. [-]

    Returns
    -------
    Profiles
        n, of up to 3 k segments.
    """
    used = duration > 1e-12
    h = np.where(used, duration, 1.0) / 3.0
    both = gained / h - 0.5 * (start + end)
    second = passed / h**2 - 4.0 / 3.0 * start - end / 6.0 - both
    knots = np.stack([start, second, both - second, end], axis=-1)
    jerk = np.diff(knots, axis=-1) / h[..., np.newaxis]
    count = 3 * used.sum(axis=1)
    first = np.concatenate([[0], np.cumsum(count)])
    lengths = np.repeat(h[used], 3)
    return Profiles.of(first, lengths, knots[used][:, :3].ravel(), jerk[used].ravel())
