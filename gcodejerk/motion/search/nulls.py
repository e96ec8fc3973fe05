r"""Which moves can be perfectly still, where that is easily shown, many moves at once.

This module owns the quick answer to a question that `optimal` answers for one move by a programme:
whether a profile within the limits leaves nothing at the modes' own frequencies. A smooth profile
of the move's time is corrected by the least change of its acceleration that makes it arrive and
leaves every mode still, and keeps the acceleration's limit: a few equations, nearly linear. Where
the corrected one keeps the other limits, too, there is such a profile; where it does not, nothing
is known.

Rule: accelerations are given at the command's intervals and linear between them, as all jerk
sequences on that grid are. With :math:`a_k` where k intervals h are left, the move arrives at rest
where :math:`\sum a_k = 0` and :math:`h^2 \sum k a_k = 1`; and since each :math:`a_k` counts in the
same form, a mode with the pole p is still where :math:`\sum a_k e^{p k h} = 0`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles, conventional_profiles
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.search.rows import ROUNDING, parts

MOST = 8
"""Of more modes at once no such profile is sought: hardly any move has room for it."""
CRUISE = 0.99
"""Of the velocity limit: what the gentlest profile may use, so that some is left to correct it."""
BISECTIONS = 24
"""For the least acceleration that the time allows."""
ROUNDS = 10
"""Of Newton's method; most moves that have such a profile need four to eight."""
CELLS = 1 << 16
"""Accelerations that are looked at at a time."""
EXACT = 1e-9
"""What is left of a condition, of the sum of the sizes of all that it adds up: nothing."""


def easily_still(
    counts: NDArray[np.int64], velocity: Array, acceleration: Array, jerk: Array, poles: Complex,
    interval: float,
) -> NDArray[np.bool_]:  # fmt: skip
    """Moves of which a profile is found that keeps the limits and leaves no mode moving.

    Parameters
    ----------
    counts : ndarray of int, shape (n,)
        T_SUM. [intervals]
    velocity, acceleration, jerk : ndarray, shape (n,)
        Limits of the unit profile; jerk may be infinite. [1/s], [1/s^2], [1/s^3]
    poles : ndarray of complex, shape (m,)
        Of all modes that any of the moves excites. [rad/s]
    interval : float
        Command interval. [s]

    Returns
    -------
    ndarray of bool, shape (n,)
        False where nothing was found: there may be such a profile all the same.
    """
    still = np.zeros(len(counts), dtype=bool)
    if len(poles) > MOST:
        return still
    order = np.argsort(counts, kind="stable")
    for part in parts(len(order), int(counts.max(initial=0)) + 1, CELLS):
        rows = order[part]
        limits = velocity[rows], acceleration[rows], jerk[rows]
        still[rows] = _still(counts[rows], limits, poles, interval)
    return still


def keep_limits(
    found: Array, limits: tuple[Array, Array, Array], interval: float
) -> NDArray[np.bool_]:
    """Whether moves keep their limits and never go back, from rest on.

    Parameters
    ----------
    found : ndarray, shape (n, k)
        Accelerations at the command's intervals, linear between them, the first of them 0. [1/s^2]
    limits : tuple of ndarray, shape (n,)
        As of `easily_still`.
    interval : float
        Command interval. [s]

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    # Whole columns: as profiles of a segment an interval they would be integrated step by step.
    V, A, J = limits
    steps = np.diff(found, axis=1)
    before, behind = found[:, :-1], found[:, 1:]
    velocity = np.cumsum(0.5 * interval * (before + behind), axis=1)
    # Between two intervals the velocity turns where the acceleration goes through zero.
    crosses = before * behind < 0.0
    turn = velocity - 0.5 * interval * (before + behind)
    turn -= np.where(crosses, 0.5 * interval * before**2, 0.0) / np.where(crosses, steps, 1.0)
    highest = np.maximum(velocity.max(axis=1), turn.max(axis=1))
    lowest = np.minimum(velocity.min(axis=1), turn.min(axis=1))
    slack = 1.0 + ROUNDING
    return np.asarray(
        (np.abs(found).max(axis=1) <= A * slack)
        & (np.abs(steps).max(axis=1) <= J * interval * slack)
        & (highest <= V * slack)
        & (lowest >= -ROUNDING * highest)
    )


def _still(
    counts: NDArray[np.int64], limits: tuple[Array, Array, Array], poles: Complex, interval: float
) -> NDArray[np.bool_]:
    """The same for moves that take about as long, few enough to be looked at together."""
    left = _left(counts)
    waves = np.exp(np.multiply.outer(poles, left * interval))
    conditions = np.vstack([np.ones(len(left)), left / left[0], waves.real, waves.imag])
    goal = np.zeros(len(conditions))
    goal[1] = 1.0 / (interval**2 * left[0])
    _, A, J = (limit[:, np.newaxis] for limit in limits)
    ends = np.clip(counts[:, np.newaxis] - left, 0, left)
    most = np.fmin(A, np.where(ends, J, 0.0) * interval * np.maximum(ends, 1))
    still = np.zeros(len(counts), dtype=bool)
    for start, where in _starts(counts, limits, interval):
        rows = np.flatnonzero(~still)
        found, met = _corrected(start[rows], where[rows], most[rows], conditions, goal)
        V, A, J = (limit[rows] for limit in limits)
        still[rows] = met & keep_limits(found, (V, A, J), interval)
    return still


def _starts(
    counts: NDArray[np.int64], limits: tuple[Array, Array, Array], interval: float
) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """Accelerations to begin with [1/s^2], and where they may change, shape (n, k).

    The fastest profile, slowed down to the move's time, leaves something of every limit, and may
    change anywhere. The gentlest cruises longest, and keeps the velocity if its ramps alone change.
    """
    V, A, J = limits
    total = counts * interval
    fastest, inside, _ = _sampled(conventional_profiles(V, A, J, interval), counts, interval)
    yield fastest, inside
    low, high = np.zeros(len(counts)), np.ones(len(counts))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        enough = conventional_profiles(CRUISE * V, middle * A, J, interval).total <= total
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    profiles = conventional_profiles(CRUISE * V, high * A, J, interval)
    gentlest, _, ramps = _sampled(profiles, counts, interval)
    yield gentlest, ramps


def _sampled(
    profiles: SymmetricProfiles, counts: NDArray[np.int64], interval: float
) -> tuple[Array, NDArray[np.bool_], NDArray[np.bool_]]:
    """Accelerations of profiles stretched to their move's time; the move, and its ramps."""
    total = counts * interval
    stretch = total / profiles.total
    T1, Ta, T2 = ((x * stretch)[:, np.newaxis] for x in (profiles.T1, profiles.Ta, profiles.T2))
    peak = (profiles.acceleration / stretch**2)[:, np.newaxis]
    left = _left(counts)
    since = counts[:, np.newaxis] - left
    nearer = np.minimum(since, left) * interval
    shape = np.clip(np.minimum(nearer / T1, (T1 + Ta + T2 - nearer) / T2), 0.0, 1.0)
    inside = (since > 0) & (left > 0)
    sampled = np.where(inside, np.where(since < left, shape, -shape) * peak, 0.0)
    return sampled, inside, inside & (nearer < T1 + Ta + T2 + interval)


def _left(counts: NDArray[np.int64]) -> NDArray[np.int64]:
    """Intervals until arrival of each column: moves are aligned at their ends, as in `sampling`."""
    return np.arange(int(counts.max()), -1, -1)


def _corrected(
    start: Array, where: NDArray[np.bool_], most: Array, conditions: Array, goal: Array
) -> tuple[Array, NDArray[np.bool_]]:
    r"""The least change of accelerations that meets the conditions; and whether it meets them.

    Of a quadratic programme: each acceleration is what it was, plus the conditions' coefficients
    :math:`c_k` times multipliers :math:`\lambda`, or the most there may be. Newton's method finds
    the multipliers; an acceleration that is at its most does not answer to them.
    """
    found, met = start.copy(), np.zeros(len(start), dtype=bool)
    multipliers = np.zeros((len(start), len(conditions)))
    going = np.arange(len(start))
    for _ in range(ROUNDS):
        wanted = start[going] + np.where(where[going], multipliers[going] @ conditions, 0.0)
        found[going] = own = np.clip(wanted, -most[going], most[going])
        missing = goal - own @ conditions.T
        nothing = EXACT * (np.abs(own) @ np.abs(conditions).T)
        met[going] = (np.abs(missing) <= nothing).all(axis=1)
        answers = where[going] & (np.abs(wanted) < most[going])
        on = ~met[going]
        going, missing, answers = going[on], missing[on], answers[on]
        if not len(going):
            break
        slopes = (answers[:, np.newaxis] * conditions) @ conditions.T
        inverse = np.linalg.pinv(slopes, hermitian=True)
        multipliers[going] += np.einsum("nij,nj->ni", inverse, missing)
    return found, met
