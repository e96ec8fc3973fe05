r"""Conditions I and II as designs: the paper's other two families, at their best T1.

This module owns the search for T1 in the families of four segments that are not symmetric. Their
closed forms stand in `motion.profiles.conditions`; here they are profiles like all others, so that
they compete under the same limits and the same objective.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.motion.profiles.conditions import condition_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.search.objective import Objective
from gcodejerk.motion.search.rows import ROUNDING, best_in_rows, parts

CANDIDATES = 65
"""Values of T1 that are looked at first."""
REFINEMENTS = 5
"""Times that the grid is drawn closer around the best."""


def design_condition(
    condition: str, total: Array, velocity: Array, acceleration: Array, jerk: Array,
    objective: Objective, interval: float,
) -> tuple[Profiles, Array]:  # fmt: skip
    """The profile of Condition I or II in the given time with the least worst residual.

    Parameters
    ----------
    condition : str
        I, II or III.
    total : ndarray, shape (n,)
        T_SUM, more than four intervals where anything is feasible. [s]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile; infinite ones bind nothing. [1/s], [1/s^2], [1/s^3]
    objective : Objective
        Of n moves.
    interval : float
        The least duration of a segment. [s]

    Returns
    -------
    profiles : Profiles
        n profiles; meaningless where none is feasible.
    worst : ndarray, shape (n,)
        Largest residual displacement, infinite where no T1 keeps the limits. [mm]
    """
    T1, worst = 0.25 * total, np.empty(len(total))
    for part in parts(len(total), CANDIDATES):
        limits = [limit[part] for limit in (velocity, acceleration, jerk)]
        T1[part], worst[part] = _best_T1(
            condition, total[part], limits, objective.take(part), interval
        )
    return condition_profiles(condition, T1, total), worst


def _best_T1(
    condition: str, total: Array, limits: list[Array], objective: Objective, interval: float
) -> tuple[Array, Array]:
    """A grid over T1, the conventional T_SUM/4 on it, drawn closer around its best."""
    n = len(total)
    low, high = np.full(n, interval), np.maximum(0.5 * total - interval, interval)
    share = np.linspace(0.0, 1.0, CANDIDATES)
    T1, worst = 0.25 * total, np.full(n, np.inf)
    for _ in range(REFINEMENTS):
        every = low[:, np.newaxis] + share * (high - low)[:, np.newaxis]
        value = _value(condition, every, total, limits, objective, interval)
        found, least = best_in_rows(value, every, value)
        better = least < worst
        T1, worst = np.where(better, found, T1), np.where(better, least, worst)
        step = (high - low) / (CANDIDATES - 1)
        low, high = np.maximum(low, T1 - step), np.minimum(high, T1 + step)
    return T1, worst


def _value(
    condition: str, T1: Array, total: Array, limits: list[Array], objective: Objective,
    interval: float,
) -> Array:  # fmt: skip
    """Worst residual of candidates, shape (n, k); infinite where limits are broken."""
    value = np.full(T1.shape, np.inf)
    every = np.broadcast_to(total[:, np.newaxis], T1.shape)
    edge = interval * (1.0 - ROUNDING)
    legal = (edge <= T1) & (edge <= 0.5 * every - T1)
    profiles = condition_profiles(condition, T1[legal], every[legal])
    rows = np.nonzero(legal)[0]
    peaks = (profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk)
    kept = np.ones(len(rows), dtype=bool)
    for peak, limit in zip(peaks, limits, strict=True):
        kept &= peak <= limit[rows] * (1.0 + ROUNDING)
    found = np.full(len(rows), np.inf)
    found[kept] = objective.take(rows[kept]).of(profiles.take(kept))
    value[legal] = found
    return value
