r"""Conditions I, II and III of Sato and Shirase: four-segment profiles in closed form.

A rest-to-rest move of length L within T_SUM has four segments of constant jerk J1 to J4, which last
T1 to T4::

    acceleration
     A1 |    /\                       segment  duration  acceleration
        |   /   \                        1        T1       0 -> A1
        |  /      \                      2        T2      A1 -> 0
      --+-/---------\---------/--> t     3        T3       0 -> A2
        | T1 |  T2  |\ T3 |T4/           4        T4      A2 -> 0
     A2 |               \  /
        |                 \

Two of the durations are free once T_SUM and the end at rest are given; each condition binds one of
them more, so that T1 alone is left: I: T1 = T2 and T3 = T4; II: T1 = T3 and T2 = T4; III: T1 = T4
and T2 = T3. In all of them T1 and the other duration make T_SUM/2. With all four equal, each is the
conventional profile.

Rule: every function takes arrays, and is right for every 0 < T1 < T_SUM/2. What a profile leaves of
vibration stands in `amplitudes`.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array, Profiles


class Condition(StrEnum):
    """Which durations of the four segments are equal; I, II or III of the paper."""

    I = "I"  # noqa: E741
    II = "II"
    III = "III"

    @classmethod
    def of(cls, name: str) -> Condition:
        """The condition of that name.

        Raises
        ------
        PlanError
            There is none.

        Examples
        --------
        >>> Condition.of("III")
        <Condition.III: 'III'>
        """
        try:
            return cls(name)
        except ValueError:
            raise PlanError(f"there is no condition {name!r}", "choose I, II or III") from None


class Peaks(NamedTuple):
    """The largest moduli within a profile."""

    velocity: Array
    """[mm/s]"""
    acceleration: Array
    """[mm/s^2]"""
    jerk: Array
    """[mm/s^3]"""


def condition_durations(condition: str, T1: ArrayLike, T_SUM: ArrayLike) -> Array:
    """Durations of the four segments.

    Parameters
    ----------
    condition : str
        I, II or III.
    T1, T_SUM : array_like
        Duration of the first segment and of the move; they broadcast. [s]

    Returns
    -------
    ndarray, shape (..., 4)
        T1, T2, T3, T4. [s]

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.

    Examples
    --------
    >>> condition_durations("III", 0.001, 0.040).tolist()
    [0.001, 0.019, 0.019, 0.001]
    """
    first, total = checked_times(T1, T_SUM)
    other = 0.5 * total - first
    columns = {
        Condition.I: (first, first, other, other),
        Condition.II: (first, other, first, other),
        Condition.III: (first, other, other, first),
    }
    return np.stack(columns[Condition.of(condition)], axis=-1)


def condition_accelerations(
    condition: str, length: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike
) -> tuple[Array, Array]:
    r"""Peak accelerations A1 of the speeding up and A2 of the slowing down.

    Parameters
    ----------
    condition, length, T1, T_SUM
        As for `condition_segments`.

    Returns
    -------
    A1, A2 : ndarray
        A2 has the opposite sign. [mm/s^2]

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.

    Notes
    -----
    The displacements of the paper's Table 1 (see `condition_displacement`), solved for A1:
    I: :math:`A_1 = 2L/(T_1 T_{SUM})` and :math:`A_2 = -A_1 T_1/T_3`;
    II: :math:`A_1 = -A_2 = 8L/T_{SUM}^2`;
    III: :math:`A_1 = -A_2 = 6L/(T_{SUM}(T_{SUM} - T_1))`.

    Examples
    --------
    1 mm in 40 ms with T1 = 1 ms: a steep beginning, or a flat one.

    >>> [round(float(A1), 1) for A1, _ in (condition_accelerations(c, 1.0, 0.001, 0.040) for c
    ...  in ("I", "II", "III"))]
    [50000.0, 5000.0, 3846.2]
    """
    first, total = checked_times(T1, T_SUM)
    L = np.asarray(length, dtype=float)
    kind = Condition.of(condition)
    if kind is Condition.I:
        return 2.0 * L / (first * total), -2.0 * L / ((0.5 * total - first) * total)
    if kind is Condition.II:
        A = np.broadcast_arrays(8.0 * L / total**2, first)[0].copy()
        return A, -A
    A = 6.0 * L / (total * (total - first))
    return A, -A


def condition_displacement(condition: str, A1: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike) -> Array:
    r"""Length of the move that reaches the peak acceleration A1.

    Parameters
    ----------
    condition : str
        I, II or III.
    A1 : array_like
        Peak acceleration of the speeding up. [mm/s^2]
    T1, T_SUM : array_like
        Duration of the first segment and of the move. [s]

    Returns
    -------
    ndarray
        [mm]

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.

    Notes
    -----
    Table 1 of the paper. I: :math:`L = A_1 T_1 T_{SUM}/2`;
    II: :math:`L = A_1 T_1^2 (1/2 + R + R^2/2)`; III: :math:`L = A_1 T_1 T_{SUM} (2R + 1)/6`, where
    R is T2/T1.
    """
    first, total = checked_times(T1, T_SUM)
    A = np.asarray(A1, dtype=float)
    kind = Condition.of(condition)
    if kind is Condition.I:
        return np.asarray(A * first * total / 2.0)
    R = (0.5 * total - first) / first
    if kind is Condition.II:
        return np.asarray(A * first**2 * (0.5 + R + 0.5 * R**2))
    return np.asarray(A * first * total * (2.0 * R + 1.0) / 6.0)


def condition_segments(
    condition: str, length: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike
) -> tuple[Array, Array]:
    r"""Durations and jerks of the four segments.

    Parameters
    ----------
    condition : str
        I, II or III.
    length : array_like
        Of the move; it broadcasts with the times. [mm]
    T1, T_SUM : array_like
        Duration of the first segment and of the move. [s]

    Returns
    -------
    durations : ndarray, shape (..., 4)
        T1, T2, T3, T4. [s]
    jerks : ndarray, shape (..., 4)
        J1, J2, J3, J4. [mm/s^3]

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.

    Examples
    --------
    The paper's design, 1 mm in 40 ms with T1 = 1 ms:

    >>> durations, jerks = condition_segments("III", 1.0, 0.001, 0.040)
    >>> jerks.round(1).tolist()
    [3846153.8, -202429.1, -202429.1, 3846153.8]
    """
    A1, A2 = condition_accelerations(condition, length, T1, T_SUM)
    durations = condition_durations(condition, T1, T_SUM)
    A = np.stack([A1, -A1, A2, -A2], axis=-1)
    durations = np.broadcast_to(durations, A.shape).copy()
    return durations, A / durations


def condition_peaks(condition: str, length: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike) -> Peaks:
    r"""The largest velocity, acceleration and jerk of a profile.

    Parameters
    ----------
    condition, length, T1, T_SUM
        As for `condition_segments`.

    Returns
    -------
    Peaks
        Moduli; the velocity is reached between T2 and T3, :math:`A_1 (T_1 + T_2)/2`.

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.

    Examples
    --------
    >>> [round(float(x)) for x in condition_peaks("III", 1.0, 0.010, 0.040)]
    [50, 5000, 500000]
    """
    A1, A2 = condition_accelerations(condition, length, T1, T_SUM)
    durations, jerks = condition_segments(condition, length, T1, T_SUM)
    velocity = 0.5 * np.abs(A1) * (durations[..., 0] + durations[..., 1])
    acceleration = np.maximum(np.abs(A1), np.abs(A2))
    return Peaks(velocity, acceleration, np.abs(jerks).max(axis=-1))


def limit_use(
    condition: str, length: ArrayLike, T1: ArrayLike, T_SUM: ArrayLike, limit: Peaks
) -> Peaks:
    """How much of each limit a profile uses: above 1 it is broken.

    Parameters
    ----------
    condition, length, T1, T_SUM
        As for `condition_segments`.
    limit : Peaks
        The most that each may be; infinite where there is no limit.

    Returns
    -------
    Peaks
        Each peak as a part of its limit. [-]

    Raises
    ------
    PlanError
        The condition is none, or a T1 lies outside 0 < T1 < T_SUM/2.
    """
    peaks = condition_peaks(condition, length, T1, T_SUM)
    return Peaks(*(peak / most for peak, most in zip(peaks, limit, strict=True)))


def feasible(T1: ArrayLike, T_SUM: ArrayLike) -> NDArray[np.bool_]:
    """Whether a four-segment profile exists: 0 < T1 < T_SUM/2.

    Parameters
    ----------
    T1, T_SUM : array_like
        Duration of the first segment and of the move; they broadcast. [s]

    Returns
    -------
    ndarray of bool
    """
    first, total = np.asarray(T1, dtype=float), np.asarray(T_SUM, dtype=float)
    return np.asarray((first > 0.0) & (first < 0.5 * total) & np.isfinite(total))


def checked_times(T1: ArrayLike, T_SUM: ArrayLike) -> tuple[Array, Array]:
    """Both times as arrays; a PlanError names the first T1 that is outside its range."""
    first, total = np.asarray(T1, dtype=float), np.asarray(T_SUM, dtype=float)
    good = feasible(first, total)
    if not good.all():
        wide = np.broadcast_arrays(first, total, good)
        T, whole = (float(x[~wide[2]].flat[0]) for x in wide[:2])
        raise PlanError(
            f"T1 is {T:g} s, outside 0 < T1 < T_SUM/2 = {0.5 * whole:g} s",
            "allow more time, or choose a shorter T1",
        )
    return first, total


def condition_profiles(condition: str, T1: Array, total: Array) -> Profiles:
    """Unit profiles of a condition, for n values of T1 and T_SUM [s]."""
    duration = condition_durations(condition, T1, total)
    A1, A2 = condition_accelerations(condition, 1.0, T1, total)
    zero = np.zeros(len(T1))
    acceleration = np.stack([zero, A1 + zero, zero, A2 + zero], axis=1)
    end = np.stack([A1 + zero, zero, A2 + zero, zero], axis=1)
    jerk = (end - acceleration) / duration
    return Profiles.of(
        4 * np.arange(len(T1) + 1), duration.ravel(), acceleration.ravel(), jerk.ravel()
    )
