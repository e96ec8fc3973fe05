r"""What Conditions I, II and III leave of vibration, in closed form, and where it is nothing.

Rule: amplitudes are written in :math:`\varphi(x) = (e^x - 1)/x`, what a ramp of the acceleration
does to a mode, and not in jerks: a jerk grows without bound as its segment shrinks, and takes the
digits of a sum of jerks with it. Damping is exact.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gcodejerk.motion.profiles.conditions import Condition, checked_times, condition_accelerations
from gcodejerk.motion.residual import mode_poles, residual_acceleration

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def condition_amplitude(
    condition: str,
    length: ArrayLike,
    T1: ArrayLike,
    T_SUM: ArrayLike,
    frequency: ArrayLike,
    damping: ArrayLike = 0.0,
) -> Array:
    r"""Acceleration amplitude that a mode keeps after the move, damping exact.

    Parameters
    ----------
    condition, length, T1, T_SUM
        As for `gcodejerk.motion.profiles.conditions.condition_segments`.
    frequency, damping : array_like
        Undamped natural frequency [Hz] and damping ratio [-] of the mode.

    Returns
    -------
    ndarray
        Envelope at the end of the move, for participation 1. [mm/s^2]

    Raises
    ------
    PlanError
        The condition is none, a T1 lies outside 0 < T1 < T_SUM/2, or a mode does not vibrate.

    Notes
    -----
    The general rule (`residual_acceleration`) with the four ramps of the acceleration gathered.
    With :math:`\varphi_i = \varphi(\lambda T_i)`, :math:`h = e^{\lambda T_{SUM}/2}` and the peak
    velocity of Condition I, :math:`V = 2L/T_{SUM}`,

    .. math::

        A_{I} &= \frac{\omega}{\omega_d}\, \omega V
            \left| \varphi_1^2 e^{2 \lambda T_3} - \varphi_3^2 \right| \\
        A_{II} &= \frac{\omega}{\omega_d}\, A_1
            \left| (h - 1) (\varphi_1 e^{\lambda T_2} - \varphi_2) \right| \\
        A_{III} &= \frac{\omega}{\omega_d}\, A_1 \left| \varphi_1 (e^{\lambda (T_{SUM} - T_1)} + 1)
            - \varphi_2 (h + e^{\lambda T_1}) \right|

    Examples
    --------
    >>> T1 = [0.001, 0.010]
    >>> condition_amplitude("III", 1.0, T1, 0.040, 30.0).round(1).tolist()
    [5696.8, 13209.3]
    >>> condition_amplitude("III", 1.0, T1, 0.040, 30.0, damping=0.02).round(1).tolist()
    [5313.6, 12266.9]
    """
    first, total = checked_times(T1, T_SUM)
    L, poles = np.abs(np.asarray(length, dtype=float)), mode_poles(frequency, damping)
    omega = np.abs(poles)
    other = 0.5 * total - first
    phi_first, phi_other = ramp_response(poles * first), ramp_response(poles * other)
    kind = Condition.of(condition)
    if kind is Condition.I:
        scale = omega * 2.0 * L / total
        vibration = phi_first**2 * np.exp(2.0 * poles * other) - phi_other**2
    elif kind is Condition.II:
        scale = 8.0 * L / total**2
        halves = _expm1(0.5 * poles * total)
        vibration = halves * (phi_first * np.exp(poles * other) - phi_other)
    else:
        scale = 6.0 * L / (total * (total - first))
        vibration = phi_first * (np.exp(poles * (total - first)) + 1.0)
        vibration = vibration - phi_other * (np.exp(0.5 * poles * total) + np.exp(poles * first))
    return np.asarray(scale * np.abs(vibration) * omega / poles.imag)


def undamped_amplitude(
    condition: str, length: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike, frequency: ArrayLike
) -> Array:
    r"""The amplitude without damping, in the jerks and sines of the paper (Table 1, Eq. 28).

    Parameters
    ----------
    condition, length, T1, T_SUM
        As for `gcodejerk.motion.profiles.conditions.condition_segments`.
    frequency : array_like
        Natural frequency of the mode. [Hz]

    Returns
    -------
    ndarray
        [mm/s^2]

    Raises
    ------
    PlanError
        The condition is none, a T1 lies outside 0 < T1 < T_SUM/2, or a frequency is not positive.

    Notes
    -----
    With :math:`s_i = \sin(\omega T_i/2)` and R as in the paper (T3/T1 for I, T2/T1 for II and III)

    .. math::

        A_{I} &= \frac{4 J_1}{\omega} \sqrt{s_1^4 + \frac{s_3^4}{R^4}
            - 2 \frac{s_1^2 s_3^2}{R^2} \cos\frac{\omega T_{SUM}}{2}} \\
        A_{II} &= \frac{4 J_1}{\omega} \left| \sin\frac{\omega T_{SUM}}{4} \right|
            \sqrt{s_1^2 + \frac{s_2^2}{R^2} - 2 \frac{s_1 s_2}{R} \cos\frac{\omega T_{SUM}}{4}} \\
        A_{III} &= \frac{2 J_1}{\omega} \left| \left(1 + \frac1R\right) \sin \omega T_2
            - \sin\frac{\omega T_{SUM}}{2} \right|

    III is Eq. 28; I and II are rows of Table 1 in a form of our own, found from the general rule.
    Digits go where T1 is much shorter than the period; `condition_amplitude` keeps them.

    Examples
    --------
    >>> float(undamped_amplitude("III", 1.0, 0.001, 0.040, 30.0).round(1))
    5696.8
    """
    first, total = checked_times(T1, T_SUM)
    omega = np.abs(mode_poles(frequency, 0.0))
    J1 = np.abs(condition_accelerations(condition, length, first, total)[0]) / first  # noqa: N806
    other = 0.5 * total - first
    R = other / first
    kind = Condition.of(condition)
    if kind is Condition.III:
        sines = (1.0 + 1.0 / R) * np.sin(omega * other) - np.sin(0.5 * omega * total)
        return np.asarray(2.0 * J1 / omega * np.abs(sines))
    s1, s2 = np.sin(0.5 * omega * first), np.sin(0.5 * omega * other) / R
    if kind is Condition.I:
        square = s1**4 + s2**4 - 2.0 * (s1 * s2) ** 2 * np.cos(0.5 * omega * total)
        return np.asarray(4.0 * J1 / omega * np.sqrt(np.maximum(square, 0.0)))
    square = s1**2 + s2**2 - 2.0 * s1 * s2 * np.cos(0.25 * omega * total)
    halves = np.abs(np.sin(0.25 * omega * total))
    return np.asarray(4.0 * J1 / omega * halves * np.sqrt(np.maximum(square, 0.0)))


def residual(
    switch_times: ArrayLike, jerk_steps: ArrayLike, frequency: ArrayLike, damping: float = 0.0
) -> Array:
    """Acceleration amplitude that a mode keeps after any rest-to-rest move: the general rule.

    Parameters
    ----------
    switch_times, jerk_steps : array_like, shape (n,)
        Moments at which the jerk changes, the last one the end of the move [s], and its change
        at each of them [mm/s^3].
    frequency : array_like, shape (...)
        Undamped natural frequency of the mode. [Hz]
    damping : float, optional
        Damping ratio of the mode, at least 0 and below 1. [-]

    Returns
    -------
    ndarray, shape (...)
        As of `residual_acceleration`, whose short name this is. [mm/s^2]

    Raises
    ------
    PlanError
        The mode is not one that vibrates, or times and steps are those of no move.

    Examples
    --------
    The paper's design, 1 mm in 40 ms with T1 = 1 ms:

    >>> from gcodejerk.motion.profiles.conditions import condition_segments
    >>> durations, jerks = condition_segments("III", 1.0, 0.001, 0.040)
    >>> times = np.concatenate([[0.0], np.cumsum(durations)])
    >>> steps = np.diff(jerks, prepend=0.0, append=0.0)
    >>> float(residual(times, steps, 30.0).round(1))
    5696.8
    """
    return residual_acceleration(switch_times, jerk_steps, frequency, damping)


def shortest_null_time(frequency: ArrayLike) -> Array:
    r"""The shortest T_SUM in which Condition III can leave a mode without damping at rest.

    Parameters
    ----------
    frequency : array_like
        Natural frequency of the mode. [Hz]

    Returns
    -------
    ndarray
        :math:`2 x_1/\omega = 1.4303/f`, where :math:`x_1 = 4.4934` is the first minimum of
        :math:`\sin x/x`. At that time T1 is 0, later it grows. [s]

    Raises
    ------
    PlanError
        A frequency is not above zero.

    Examples
    --------
    >>> float(shortest_null_time(30.0).round(5))
    0.04768
    """
    omega = np.abs(mode_poles(frequency, 0.0))
    return np.asarray(2.0 * _extrema(2)[1] / omega)


def null_curve(T_SUM: ArrayLike, frequency: float) -> Array:
    r"""Every T1 with which Condition III leaves a mode without damping at rest.

    Parameters
    ----------
    T_SUM : array_like, shape (n,)
        Duration of the move. [s]
    frequency : float
        Natural frequency of the mode. [Hz]

    Returns
    -------
    ndarray, shape (branches, n)
        T1, the largest first; NaN where a branch has none. A branch is continuous in T_SUM. [s]

    Raises
    ------
    PlanError
        The frequency is not above zero.

    Notes
    -----
    Eq. 28 is zero where :math:`\operatorname{sinc}(\omega T_2) = \operatorname{sinc}(\omega
    T_{SUM}/2)`. Between two neighbouring extrema of :math:`\sin x/x` (where :math:`\tan x = x`) it
    falls or rises throughout, so each such range holds at most one root, which is bisected. The
    root T2 = T_SUM/2, T1 = 0, is no profile and left out.

    Examples
    --------
    >>> (1e3 * null_curve([0.050, 0.060, 0.090], 30.0)).round(3).tolist()
    [[2.287, 11.349, 29.802], [nan, nan, 7.777]]
    """
    total = np.atleast_1d(np.asarray(T_SUM, dtype=float))
    total = np.where(np.isfinite(total), total, np.nan)
    half = 0.5 * np.abs(mode_poles(frequency, 0.0)) * total
    longest = float(np.max(half, initial=0.0, where=np.isfinite(half)))
    ends = _extrema(max(2, int(longest / np.pi) + 2))[:, np.newaxis]
    at_ends, target = _sinc(ends), _sinc(half)
    exists = (ends[1:] < half) & ((at_ends[:-1] - target) * (at_ends[1:] - target) < 0.0)
    # Of thousands of ranges only those that hold a root: long moves have few in each column.
    branch, column = np.nonzero(exists)
    low, high, sought = ends[branch, 0], ends[branch + 1, 0], target[column]
    rising = at_ends[branch, 0] < sought
    for _ in range(60):
        middle = 0.5 * (low + high)
        before = (_sinc(middle) < sought) == rising
        low, high = np.where(before, middle, low), np.where(before, high, middle)
    T1 = np.full(exists.shape, np.nan)
    T1[branch, column] = (1.0 - low / half[column]) * 0.5 * total[column]
    return np.asarray(T1[exists.any(axis=1)])


def _sinc(x: Array) -> Array:
    """sin(x)/x, without the factor pi of numpy's."""
    return np.divide(np.sin(x), x, out=np.ones_like(x), where=x != 0.0)


def _extrema(count: int) -> Array:
    """The first extrema of sin(x)/x: 0, 4.4934, 7.7253 and so on."""
    k = np.arange(count, dtype=float)
    x = k * np.pi
    for _ in range(30):
        # tan x = x in the k-th turn; the error falls twentyfold and more at each step.
        x = k * np.pi + np.arctan(x)
    return x


def _expm1(x: Complex) -> Complex:
    """exp(x) - 1 with all its digits near zero, which numpy 1 has for real x only."""
    real = np.expm1(x.real) * np.cos(x.imag) - 2.0 * np.sin(0.5 * x.imag) ** 2
    out: Complex = real + 1j * np.exp(x.real) * np.sin(x.imag)
    return out


def ramp_response(x: Complex) -> Complex:
    """What a ramp of the acceleration does, seen from its beginning: (exp(x) - 1)/x; x is not 0."""
    out: Complex = _expm1(x) / x
    return out
