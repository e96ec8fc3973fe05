r"""Amplitude maps: what is left of vibration over T1 and T_SUM, for every profile of a condition.

Rule: no exponential is taken on the grid. Those of T1 and of T_SUM/2 are taken once each along the
two axes, and :math:`e^{\lambda T_2} = e^{\lambda T_{SUM}/2}\, e^{-\lambda T_1}` makes the rest of
them; so a map costs a few multiplications a point, damping included.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion.amplitudes import condition_amplitude, ramp_response
from gcodejerk.motion.profiles.conditions import Condition, feasible
from gcodejerk.motion.residual import mode_poles

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

BLOCK = 1 << 13
"""Points worked on at a time, so that what is between input and output stays in the cache."""
NARROW = 1e-2
"""Below this part of the move, as a phase, T2 takes digits away and is treated on its own."""
STEEPEST = 600.0
"""Exponents beyond are cut off; what they are multiplied with is then below 1e-300."""


def amplitude_map(
    length: float,
    T1: ArrayLike,
    T_SUM: ArrayLike,
    frequency: float,
    damping: float = 0.0,
    condition: str = "III",
) -> Array:
    r"""Acceleration amplitude that a mode keeps, over T1 and T_SUM: the map of the paper's Fig. 8.

    Parameters
    ----------
    length : float
        Of the move. [mm]
    T1 : array_like, shape (n,)
        Durations of the first segment. [s]
    T_SUM : array_like, shape (k,)
        Durations of the move. [s]
    frequency, damping : float
        Undamped natural frequency [Hz] and damping ratio [-] of the mode.
    condition : str, optional
        I, II or III.

    Returns
    -------
    ndarray, shape (k, n)
        Envelope at the end of the move for participation 1, a row for each T_SUM; NaN where no
        profile exists, outside 0 < T1 < T_SUM/2. [mm/s^2]

    Raises
    ------
    PlanError
        The length is not finite, the condition is none, or the mode does not vibrate.

    Notes
    -----
    With :math:`h = e^{\lambda T_{SUM}/2}`, :math:`u = e^{\lambda T_1}`, :math:`w = 1/u`,
    :math:`\alpha = (1 - w)/T_1`, :math:`\beta = (u - 1)/T_1`, :math:`g = h (\alpha T_2 - w)` and
    the peaks A1 and V of the profile, `condition_amplitude` becomes, up to the factor
    :math:`\omega/\omega_d`,

    .. math::

        A_{I} = \frac{V}{\omega T_2^2} \left| (g + 1) (h (\alpha T_2 + w) - 1) \right|, \quad
        A_{II} = \frac{A_1}{\omega T_2} \left| (h - 1) (g + 1) \right|, \quad
        A_{III} = \frac{A_1}{\omega T_2} \left| h g + \beta T_2 + u \right|

    where T2 is T_SUM/2 - T1.

    Examples
    --------
    The paper's design and the conventional profile, then a time that is too short for the latter:

    >>> amplitude_map(1.0, [0.001, 0.010], [0.040, 0.018], 30.0).round(1)
    array([[ 5696.8, 13209.3],
           [27184.4,     nan]])
    """
    first, total = _axis(T1), _axis(T_SUM)
    kind, pole = Condition.of(condition), mode_poles(frequency, damping).item()
    L = abs(float(length))
    if not np.isfinite(L):
        raise PlanError(f"the length is {length}, expected a number [mm]", "for example 1.0")
    out = np.full((len(total), len(first)), np.nan)
    columns = np.flatnonzero((first > 0.0) & np.isfinite(first))
    rows = np.flatnonzero((total > 0.0) & np.isfinite(total))
    grid = _Grid(kind, L, first[columns], pole)
    step = max(1, BLOCK // max(1, len(columns)))
    for begin in range(0, len(rows), step):
        some = rows[begin : begin + step]
        out[np.ix_(some, columns)] = grid.rows(total[some])
    return out


def displacement_map(
    length: float,
    T1: ArrayLike,
    T_SUM: ArrayLike,
    frequency: ArrayLike,
    damping: ArrayLike,
    participation: ArrayLike,
    condition: str = "III",
) -> Array:
    r"""The worst displacement that any of several modes keeps, over T1 and T_SUM.

    Parameters
    ----------
    length, T1, T_SUM, condition
        As for `amplitude_map`.
    frequency, damping, participation : array_like, shape (m,)
        Of each mode. [Hz], [-], [-]

    Returns
    -------
    ndarray, shape (k, n)
        The largest :math:`|p| A/\omega^2`; NaN outside 0 < T1 < T_SUM/2. [mm]

    Raises
    ------
    PlanError
        There is no mode, or as for `amplitude_map`.

    Examples
    --------
    >>> displacement_map(1.0, [0.010], [0.040], [30.0, 90.0], [0.0, 0.0], [1.0, 0.3]).round(5)
    array([[0.37177]])
    """
    modes = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(x, dtype=float)) for x in (frequency, damping, participation))
    )
    if not modes[0].size:
        raise PlanError("there is no mode to draw a map for", "give at least one frequency")
    worst: Array | None = None
    for f, zeta, p in zip(*modes, strict=True):
        kept = amplitude_map(length, T1, T_SUM, float(f), float(zeta), condition)
        kept *= abs(p) / (2.0 * np.pi * f) ** 2
        worst = kept if worst is None else np.maximum(worst, kept, out=worst)
    assert worst is not None
    return worst


class _Grid:
    """What the columns of a map have in common, and its rows from that."""

    def __init__(self, condition: Condition, length: float, T1: Array, pole: complex) -> None:
        self.condition, self.length, self.T1, self.pole = condition, length, T1, pole
        x = np.asarray(pole * T1, dtype=np.complex128)
        cut = np.minimum(-x.real, STEEPEST) - 1j * x.imag
        self.u, self.w = np.exp(x), np.exp(cut)
        self.beta: Complex = pole * ramp_response(x)
        self.alpha: Complex = self.beta * self.w

    def rows(self, total: Array) -> Array:
        """Amplitudes of some T_SUM."""
        T, T1 = total[:, np.newaxis], self.T1
        half = np.exp(0.5 * self.pole * T)
        T2 = 0.5 * T - T1
        omega = abs(self.pole)
        narrow = (1.0 / omega + 0.5 * T) * NARROW > T2
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            amplitude = self._wide(T, T2, half)
        amplitude *= 1.0 / self.pole.imag
        if narrow.any():
            amplitude[narrow] = np.nan
            row, column = np.nonzero(narrow & feasible(T1, T))
            amplitude[row, column] = condition_amplitude(
                self.condition, self.length, T1[column], total[row],
                omega / (2.0 * np.pi), -self.pole.real / omega,
            )  # fmt: skip
        return amplitude

    def _wide(self, T: Array, T2: Array, half: Complex) -> Array:
        """The formulas of `amplitude_map`, without 1/omega_d."""
        g = self.alpha * T2
        if self.condition is Condition.I:
            other = g + self.w
            other *= half
            other -= 1.0
            g -= self.w
            g *= half
            g += 1.0
            g *= other
            return _modulus(g) * (2.0 * self.length / T) / (T2 * T2)
        g -= self.w
        g *= half
        if self.condition is Condition.II:
            g += 1.0
            g *= half - 1.0
            return _modulus(g) * (8.0 * self.length / T**2) / T2
        g *= half
        g += self.beta * T2
        g += self.u
        return _modulus(g) * (6.0 * self.length / T) / (T2 * (T - self.T1))


def _modulus(z: Complex) -> Array:
    """|z|: numpy's own guards against overflow, which takes more time than all the rest."""
    return np.sqrt(z.real**2 + z.imag**2)


def _axis(values: ArrayLike) -> Array:
    """One axis of a map."""
    axis = np.atleast_1d(np.asarray(values, dtype=float))
    if axis.ndim != 1:
        raise PlanError(
            f"T1 and T_SUM are axes of a map, but one has the shape {axis.shape}",
            "give one-dimensional arrays; the map has a row for each T_SUM",
        )
    return axis
