r"""How long the controller's own rapid takes.

The fastest symmetric move from rest to rest within velocity V, acceleration A and jerk J over
the length 1. With peak velocity v the ramp lasts

.. math:: r(v) = v/A + A/J \quad (v \ge A^2/J), \qquad r(v) = 2\sqrt{v/J} \quad (v < A^2/J),

and both ramps together cover v r(v), since each is odd about its middle. Where V r(V) <= 1 the
rest is cruise; otherwise v solves v r(v) = 1, found by bisection: no closed form that could be
mistaken.

A control with bell-shaped acceleration (`bell`) is judged by what its filter does: the trapezoid of
velocity within V and A, and from its position the mean over the last A/J.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.verification.physics.oscillators import Oscillators

Array = NDArray[np.float64]

HALVINGS = 64
FEW = 16
"""Moves that are sooner looked at one by one."""


def peak_velocity(
    velocity: Array, acceleration: Array, jerk: Array, *, bell: bool = False
) -> Array:
    """Highest velocity [1/s] of a move of length 1 within limits, as for `rapid_time`.

    A bell's is that of the trapezoid in front of the filter.
    """
    if bell:
        return np.minimum(velocity, np.sqrt(acceleration))
    if np.size(velocity) <= FEW and np.all(acceleration) and np.all(jerk):
        limits = np.broadcast_arrays(velocity, acceleration, jerk)
        peaks = map(_peak, *(np.ravel(limit).tolist() for limit in limits))
        return np.array(list(peaks), dtype=np.float64).reshape(limits[0].shape)
    low, high = np.zeros_like(velocity), velocity.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        short = middle * _ramp(middle, acceleration, jerk) <= 1.0
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return high


def _peak(velocity: float, acceleration: float, jerk: float) -> float:
    """The same of one move, by the same steps: arrays of one number take ten times as long."""
    low, high, ramp_up, square = 0.0, velocity, acceleration / jerk, acceleration * acceleration
    for _ in range(HALVINGS):
        v = 0.5 * (low + high)
        full = v * jerk >= square
        ramp = v / acceleration + ramp_up if full else 2.0 * math.sqrt(v / jerk)
        if v * ramp <= 1.0:
            if v == low:
                break
            low = v
        elif v == high:
            break
        else:
            high = v
    return high


def _integrated_trapezoid(t: Array, peak: Array, acceleration: Array) -> Array:
    """Integral of the position of a trapezoid of velocity over the length 1."""
    rise, wide = peak / acceleration, 1.0 / peak
    parts = [np.maximum(t - at, 0.0) ** 3 for at in (0.0, rise, wide, wide + rise)]
    out: Array = (parts[0] - parts[1] - parts[2] + parts[3]) * acceleration / 6.0
    return out


def box_widths(
    velocity: Array, acceleration: Array, jerk: Array, *, bell: bool = False
) -> tuple[Array, Array, Array]:
    """Widths [s] of the boxes that such a move's velocity is folded of, as for `rapid_time`.

    Examples
    --------
    The paper's case has no cruise and no constant acceleration:

    >>> [float(w[0].round(9)) for w in box_widths(*np.array([[600.0], [5000.0], [5e5]]))]
    [0.02, 0.01, 0.01]
    """
    peak = peak_velocity(velocity, acceleration, jerk, bell=bell)
    if bell:
        return 1.0 / peak, peak / acceleration, acceleration / jerk
    ramp = _ramp(peak, acceleration, jerk)
    rise = np.minimum(acceleration, np.sqrt(peak * jerk)) / jerk
    cruise = np.maximum(1.0 - peak * ramp, 0.0) / peak
    return ramp + cruise, ramp - rise, rise


def rapid_position(
    t: Array,
    velocity: Array,
    acceleration: Array,
    jerk: Array,
    *,
    bell: bool = False,
    owner: NDArray[np.int64],
) -> Array:
    """Position [-] of such moves at moments t since their start; `owner` is the move of each."""
    peak = peak_velocity(velocity, acceleration, jerk, bell=bell)
    if bell:
        peak, acceleration, width = peak[owner], acceleration[owner], (acceleration / jerk)[owner]
        total = 1.0 / peak + peak / acceleration + width
        before, now = (_integrated_trapezoid(at, peak, acceleration) for at in (t - width, t))
        return np.where(t >= total, 1.0, (now - before) / width)
    widths = box_widths(velocity, acceleration, jerk)
    peak, wide, narrow, rise = (column[owner] for column in (peak, *widths))
    ramp, total = narrow + rise, wide + narrow + rise
    u = np.clip(np.minimum(t, total - t), 0.0, None)
    full = peak / narrow
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = full / rise * u**3 / 6.0
        falling = peak * (u - 0.5 * ramp) + full / rise * (ramp - u) ** 3 / 6.0
    straight = full * (0.5 * (u - 0.5 * rise) ** 2 + rise**2 / 24.0)
    half = np.where(u < rise, rising, np.where(u > ramp - rise, falling, straight))
    half = np.where(u >= ramp, peak * (u - 0.5 * ramp), half)
    return np.where(t >= total, 1.0, np.where(t > 0.5 * total, 1.0 - half, half))


def _ramp(v: Array, acceleration: Array, jerk: Array) -> Array:
    """Time [s] from rest to a velocity."""
    full: Array = v / acceleration + acceleration / jerk
    return np.where(v * jerk >= acceleration**2, full, 2.0 * np.sqrt(v / jerk))


def rapid_time(velocity: Array, acceleration: Array, jerk: Array, *, bell: bool = False) -> Array:
    """Duration [s] of a move of length 1 within limits.

    Parameters
    ----------
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of axes divided by their displacement; jerk may be infinite. [1/s], ...
    bell : bool, optional
        The acceleration is bell-shaped.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    The paper's case, 1 mm in 40 ms, and a trapezoid:

    >>> V, A, J = np.array([[600.0, 1.0], [5000.0, 2.0], [5e5, np.inf]])
    >>> rapid_time(V, A, J).round(9)
    array([0.04, 1.5 ])
    """
    if bell:
        return np.asarray(np.sum(box_widths(velocity, acceleration, jerk, bell=bell), axis=0))
    peak = peak_velocity(velocity, acceleration, jerk)
    ramp = _ramp(peak, acceleration, jerk)
    cruise = np.maximum(1.0 - peak * ramp, 0.0) / peak
    return 2.0 * ramp + cruise


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Rapids as three averages of a step, one behind the other, each axis with its own.

    Attributes
    ----------
    displacement : ndarray, shape (n, 9)
        [mm] or [deg]
    widths : ndarray, shape (3, n, 9)
        Over how long each average goes. [s]
    rest : ndarray, shape (n, 9)
        How long an axis that has arrived waits for the last one. [s]
    """

    displacement: Array
    widths: Array
    rest: Array

    @classmethod
    def of(cls, displacement: Array, limits: Array, *, bell: bool = False) -> Boxes:
        """Of rapids within limits over the displacement, (3, n, 9), as `box_widths` has them."""
        moves = displacement != 0.0
        V, A, J = (np.where(moves, limit, 1.0) for limit in limits)
        widths = np.where(moves, box_widths(V, A, J, bell=bell), 0.0)
        ends = widths.sum(axis=0)
        return cls(displacement, widths, ends.max(axis=1, initial=0.0)[:, np.newaxis] - ends)

    def response(self, modes: Oscillators) -> NDArray[np.complex128]:
        """Vibration that they leave, shape (n, m) [mm]."""
        out = np.zeros((len(self.displacement), len(modes.poles)), dtype=np.complex128)
        for a in np.flatnonzero(self.displacement.any(axis=0)).tolist():
            felt = np.flatnonzero(modes.participation[:, a])
            pole = modes.poles[felt]
            factor = pole * np.exp(pole * self.rest[:, a, np.newaxis])
            for width in self.widths[:, :, a]:
                factor = factor * _phi(pole * width[:, np.newaxis])
            amount = modes.participation[felt, a] * self.displacement[:, a, np.newaxis]
            out[:, felt] += amount * factor / pole.imag
        return out


def _phi(x: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """(exp(x) - 1)/x, 1 at 0."""
    small = np.abs(x) < 1e-6
    safe = np.where(small, 1.0, x)
    out: NDArray[np.complex128] = np.where(small, 1.0 + 0.5 * x, (np.exp(safe) - 1.0) / safe)
    return out
