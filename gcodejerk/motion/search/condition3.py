"""Design of Condition III: the paper's profile of four segments, with the T1 that leaves least.

This module owns the search along T1, the one number that is free once T_SUM and the length are
given. Its feasible range has a closed form. The conventional profile of four segments has
T1 = T_SUM/4 and is looked at too, so that the result cannot be worse.

Rule 1: no segment is shorter than one command interval.
Rule 2: what is compared is the objective, the largest residual displacement of the tool.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles
from gcodejerk.motion.residual import symmetric_response
from gcodejerk.motion.search.candidates import symmetric_worst
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, best_in_rows, parts, pick_in_rows

FEW_POLES = 12
"""So many poles can be evaluated in double precision, or for many more candidates."""
AT_ONCE = 1 << 13
"""Candidates of the map evaluated at a time: arrays in double precision, in the cache."""
MAP_COLUMNS = 257
"""Values of T1 that are looked at first."""
ZOOMS = 8
"""Times that the map is drawn closer around the best T1."""
TIE = 1e-7
"""Residuals that differ by less than this are equal, and the lower jerk decides [mm]."""


def four_segment_range(
    total: Array, velocity: Array, acceleration: Array, jerk: Array, interval: float
) -> tuple[Array, Array]:
    r"""Least and greatest T1 of a four-segment profile within limits.

    Parameters
    ----------
    total : ndarray, shape (n,)
        T_SUM. [s]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile. [1/s], [1/s^2], [1/s^3]
    interval : float
        Command interval, the least duration of a segment. [s]

    Returns
    -------
    tuple of ndarray, shape (n,)
        (least, greatest) T1 [s]; no profile is feasible where least > greatest.

    Notes
    -----
    With T2 = T_SUM/2 - T1 the unit profile has V = 1.5/(T_SUM - T1), A = 6/(T_SUM (T_SUM - T1)),
    J1 = A/T1 and J2 = A/T2, each monotone in T1, so each limit is one bound.

    Examples
    --------
    1 mm in 40 ms with 5e6 mm/s^3: the interval of 1 ms binds, the jerk would allow 0.765 ms.

    >>> low, high = four_segment_range(*(np.array([x]) for x in (0.04, 600.0, 5000.0, 5e6)), 1e-3)
    >>> float(low[0]), float(high[0].round(6))
    (0.001, 0.01)
    """
    T = total
    slack = 1.0 + ROUNDING
    V, A, J = velocity * slack, acceleration * slack, jerk * slack
    with np.errstate(invalid="ignore"):
        # J1: T1 (T - T1) >= 6/(T J); J2, with x = T2: x (T/2 + x) >= 6/(T J).
        need = 6.0 / (T * J)
        by_J1 = 0.5 * (T - np.sqrt(T * T - 4.0 * need))
        by_J2 = 0.75 * T - np.sqrt(0.0625 * T * T + need)
    low = np.where(np.isnan(by_J1), np.inf, np.maximum(by_J1, interval))
    high = np.minimum(
        np.minimum(T - 1.5 / V, T - 6.0 / (T * A)), np.minimum(by_J2, 0.5 * T - interval)
    )
    # The ends may cross by rounding where only one profile is left.
    high = np.where((high < low) & (high > low * (1.0 - 1e-7)), low, high)
    return low, high


def design_four_segments(
    total: Array, low: Array, high: Array, objective: Objective
) -> SymmetricProfiles:
    """The four-segment profile with the least worst residual, T1 within a range.

    Parameters
    ----------
    total, low, high : ndarray, shape (n,)
        T_SUM and the range of T1, of which `low` is not the greater. [s]
    objective : Objective
        Of n moves.

    Returns
    -------
    SymmetricProfiles
        n profiles. Among equals it is the one whose T1 is nearest to T_SUM/4.
    """
    T1 = np.empty(len(total))
    for part in parts(len(total), MAP_COLUMNS):
        T1[part] = _best_T1(total[part], low[part], high[part], objective.take(part))
    return _four(T1, total)


def _best_T1(total: Array, low: Array, high: Array, objective: Objective) -> Array:
    """A map over T1 with the ends of its range, then a zoom that keeps what is not bettered."""
    low, high, whole = low[:, np.newaxis], high[:, np.newaxis], total[:, np.newaxis]
    quarter = np.clip(0.25 * whole, low, high)
    every = np.column_stack([quarter, low + (high - low) * np.linspace(0.0, 1.0, MAP_COLUMNS)])
    value = np.empty(every.shape)
    value[:, :1] = _worst(quarter, total, objective)
    for part in parts(len(total), MAP_COLUMNS, AT_ONCE):
        value[part, 1:] = _evenly(every[part, 1:], total[part], objective.take(part))
    T1, worst = pick_in_rows(_least(value, np.abs(every - quarter)), every, value)
    step = (high - low) / (MAP_COLUMNS - 1)
    for _ in range(ZOOMS):
        every = np.clip(T1[:, np.newaxis] + step * np.array([-1.0, -0.5, 0.5, 1.0]), low, high)
        value = _worst(every, total, objective)
        found, least = best_in_rows(value, every, value)
        better = least < worst - 0.01 * TIE
        T1, worst = np.where(better, found, T1), np.where(better, least, worst)
        step = 0.25 * step
    return T1


def _evenly(T1: Array, total: Array, objective: Objective) -> Array:
    r"""The same for values of T1 side by side that are evenly spaced, shape (n, k).

    With :math:`T_1 + T_2 = T/2` the response of `symmetric_response` is, but for
    :math:`A/\lambda^2`, :math:`(e^{\lambda T_1} - 1)/T_1 \cdot (1 + h e^{\lambda T_2}) -
    (e^{\lambda T_2} - 1)/T_2 \cdot (h + e^{\lambda T_1})` with :math:`h = e^{\lambda T/2}`, and the
    exponentials of T1 and T2 are those of the first, times powers of those of a step.
    """
    n, k = T1.shape
    T2 = 0.5 * total[:, np.newaxis] - T1
    step = ((T1[:, -1] - T1[:, 0]) / (k - 1))[:, np.newaxis]
    A = 6.0 / (total[:, np.newaxis] * (total[:, np.newaxis] - T1))
    rise, fall = A / T1, A / T2
    squares = np.zeros((len(objective.poles), n, k))
    first, second, part = (np.empty((n, k), dtype=np.complex128) for _ in range(3))
    for m, pole in enumerate(objective.poles):
        half = np.exp(0.5 * pole * total)[:, np.newaxis]
        for power, begin, way in ((first, T1, pole), (second, T2, -pole)):
            power[:, :1] = np.exp(pole * begin[:, :1])
            ratio, done = np.exp(way * step), 1
            while done < k:
                more = min(done, k - done)
                np.multiply(power[:, :more], ratio, out=power[:, done : done + more])
                ratio, done = ratio * ratio, done + more
        np.multiply(second, half, out=part)
        part += 1.0
        part *= (first - 1.0) * rise
        first += half
        first *= (second - 1.0) * fall
        part -= first
        squares[m] = part.real**2 + part.imag**2
    scale = np.abs(objective.poles) ** 2 * objective.poles.imag
    displacement = np.sqrt(squares) / scale[:, np.newaxis, np.newaxis]
    return objective.worst(np.moveaxis(displacement, 0, -1))


def _worst(T1: Array, total: Array, objective: Objective) -> Array:
    """Largest residual of four-segment profiles, T1 of shape (n, k); exact for a few poles."""
    T = total[:, np.newaxis]
    if len(objective.poles) > FEW_POLES:
        ramps = (T1.T, np.zeros(T1.T.shape), (0.5 * T - T1).T)
        return symmetric_worst(*ramps, total, objective).T.astype(np.float64)
    profiles = _four(T1, T)
    flat = SymmetricProfiles(*(column.ravel() for column in profiles.columns()))
    response = symmetric_response(flat, objective.poles).reshape(*T1.shape, -1)
    return objective.worst(np.abs(response) / objective.poles.imag)


def _four(T1: Array, total: Array) -> SymmetricProfiles:
    """Four-segment profiles of these T1 and T_SUM."""
    T1, T = np.broadcast_arrays(T1, total)
    zero = np.zeros(T1.shape)
    return SymmetricProfiles(np.array(T1), zero, 0.5 * T - T1, zero)


def _least(value: Array, tie_break: Array) -> NDArray[np.intp]:
    """Column of the least value in each row; among ties the one with the least tie_break."""
    least = value.min(axis=1, keepdims=True)
    tied = value <= least + TIE
    column: NDArray[np.intp] = np.argmin(np.where(tied, tie_break, np.inf), axis=1)
    return column
