r"""The filter that LinuxCNC runs its positions through, and its inverse.

Motion's cubic interpolation, at one point a servo period, is the weighted mean

.. math:: p_i = (x_{i-1} + 4 x_i + x_{i+1}) / 6

of the planner's positions (cubic.c of LinuxCNC 2.9; what it says is given out two periods later).
It is the filter of a cubic B-spline, so its inverse is the prefilter of one (M. Unser, IEEE Signal
Processing Magazine 16(6), 1999): a tridiagonal system with one constant matrix.

This module owns both, and what the filter does to a decaying mode.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex


def filtered(values: Array) -> Array:
    """Values behind the filter; the first and the last column go on beyond the ends.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        At every servo period.

    Returns
    -------
    ndarray, shape (n, k)

    Examples
    --------
    >>> filtered(np.array([[0.0, 0.0, 6.0, 0.0, 0.0]]))
    array([[0., 1., 4., 1., 0.]])
    """
    before = np.concatenate([values[:, :1], values[:, :-1]], axis=1)
    behind = np.concatenate([values[:, 1:], values[:, -1:]], axis=1)
    out: Array = (before + 4.0 * values + behind) / 6.0
    return out


def unfiltered(values: Array) -> Array:
    """The values that the filter turns into these, where there is nothing beyond the ends.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        At every servo period, 0 in front of and behind these.

    Returns
    -------
    ndarray, shape (n, k)

    Examples
    --------
    >>> unfiltered(np.array([[0.0, 1.0, 4.0, 1.0, 0.0]])).round(12) + 0.0
    array([[0., 0., 6., 0., 0.]])
    """
    out = 6.0 * np.asarray(values, dtype=np.float64)
    count = out.shape[1]
    upper = np.empty(count)
    upper[0] = 0.25
    out[:, 0] *= 0.25
    for k in range(1, count):
        upper[k] = 1.0 / (4.0 - upper[k - 1])
        out[:, k] = (out[:, k] - out[:, k - 1]) * upper[k]
    for k in range(count - 2, -1, -1):
        out[:, k] -= upper[k] * out[:, k + 1]
    return out


def filter_gain(poles: Complex, interval: float) -> Complex:
    """By how much the filter changes the response of modes.

    Parameters
    ----------
    poles : ndarray of complex, shape (m,)
        [rad/s]
    interval : float
        Servo period. [s]

    Returns
    -------
    ndarray of complex, shape (m,)
        [-]
    """
    turn: Complex = np.exp(poles * interval)
    return np.asarray((turn + 4.0 + 1.0 / turn) / 6.0, dtype=np.complex128)
