r"""Steps downhill for the largest of many residuals: Newton's method for symmetric profiles.

This module owns how what profiles leave of every mode changes with T1, Ta and T2, and the steps
that follow from it. The largest of many residuals has edges, where its slope changes all at once;
a sum of high powers has none, and the higher the power, the nearer it is to the largest. Residuals
are taken to change in proportion to a step, as in the method of Gauss and Newton.

Rule: this proposes. What a step leaves, and whether it keeps the limits, the search looks at.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.candidates import Single, step_weights
from gcodejerk.motion.search.objective import Objective

Powers = tuple[tuple[int, bool], ...]

POWERS: Powers = ((2, False), (14, True))
"""Powers for which steps are proposed, and whether with what the power itself bends: without, a
step leads to where all would be left still, and far; with it, to the edge."""
LAST_POWERS: Powers = ((2, False), (8, True), (30, True))
"""The same where the best are brought to the bottom."""
LEAST = np.float32(1e-36)
"""Squares of less are none: what is divided by them would be no number in single precision."""
DAMPED, SINGULAR = 1e-2, 1e-6
"""Added to the second derivatives, times each of them and times the largest."""
UPPER = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
"""Rows and columns of what stands of a symmetric matrix."""


def slopes(
    T1: Array, Ta: Array, T2: Array, total: Array, objective: Objective
) -> tuple[Single, Single]:
    r"""What symmetric profiles leave of each mode, and how that changes with their durations.

    Parameters
    ----------
    T1, Ta, T2 : ndarray, shape (k, n)
        Of the ramps of k profiles for each of n moves; T1 and T2 above zero. T_SUM stays. [s]
    total : ndarray, shape (n,)
        T_SUM. [s]
    objective : Objective
        Of the n moves, with p poles.

    Returns
    -------
    left : ndarray of float32, shape (2, p, k n)
        Displacement of each mode as two parts, of which squares add up. [mm]
    slope : ndarray of float32, shape (3, 2, p, k n)
        Of these by T1, Ta and T2. [mm/s]

    Notes
    -----
    Pairs of steps of the jerk as in `symmetric_worst`; a pair at t changes by
    :math:`-\lambda (q e^{j\omega_d y} + p e^{-j\omega_d y})` with t, times its step.
    """
    k = len(T1)
    whole = np.tile(total, k)
    T1, Ta, T2 = (x.ravel() for x in (T1, Ta, T2))
    area = Ta + 0.5 * (T1 + T2)
    moment = T1 * T1 / 3.0 + Ta * (T1 + 0.5 * Ta) + 0.5 * T2 * (T1 + Ta + T2 / 3.0)
    acceleration = 1.0 / (area * whole - 2.0 * moment)
    # Relative change of the acceleration.
    relative = (
        0.5 * whole - 4.0 * T1 / 3.0 - 2.0 * Ta - T2,
        whole - 2.0 * (T1 + Ta) - T2,
        0.5 * whole - T1 - Ta - 2.0 * T2 / 3.0,
    )
    scaling = [(-acceleration * x).astype(np.float32) for x in relative]
    up, down, rise, fall = (
        x.astype(np.float32) for x in (acceleration / T1, acceleration / T2, 1.0 / T1, 1.0 / T2)
    )
    weight = np.tile(step_weights(objective), k)
    at = [
        _moved(t.astype(np.float32), whole.astype(np.float32), objective)
        for t in (np.zeros_like(T1), T1, T1 + Ta, T1 + Ta + T2)
    ]
    left = np.empty((2, *weight.shape), dtype=np.float32)
    slope = np.empty((3, *left.shape), dtype=np.float32)
    for part in (0, 1):
        (begin, _), (first, by_first), (second, by_second), (third, by_third) = (
            (value[part], by_time[part]) for value, by_time in at
        )
        rising, falling = up * (begin - first), down * (second - third)
        both = rising - falling
        by_T2 = down * by_third + fall * falling
        by_Ta = by_T2 - down * by_second - fall * falling
        by_T1 = by_Ta - up * by_first - rise * rising
        left[part] = both * weight
        for which, own in enumerate((by_T1, by_Ta, by_T2)):
            slope[which, part] = (own + both * scaling[which]) * weight
    return left, slope


def _moved(
    t: Single, whole: Single, objective: Objective
) -> tuple[tuple[Single, Single], tuple[Single, Single]]:
    """A pair of steps at t and at T - t, seen from the middle, and its change with t."""
    poles = objective.poles[:, np.newaxis]
    sigma, omega = (x.astype(np.float32) for x in (-poles.real, poles.imag))
    phase = (np.float32(0.5) * whole - t) * omega
    cosine, sine = np.cos(phase), np.sin(phase)
    early, late = np.exp(-sigma * t), np.exp(-sigma * (whole - t))
    even, odd = late + early, late - early
    value = odd * cosine, even * sine
    across = even * cosine, odd * sine
    return value, (sigma * across[0] + omega * across[1], sigma * across[1] - omega * across[0])


def proposed_steps(
    left: Single,
    slope: Single,
    objective: Objective,
    fixed: NDArray[np.bool_],
    powers: Powers = POWERS,
) -> Array:
    """Steps that lower the largest residual, as far as slopes tell.

    Parameters
    ----------
    left, slope : ndarray of float32, shapes (2, p, m) and (3, 2, p, m)
        Of m profiles, as from `slopes`, by any three numbers.
    objective : Objective
        Its groups.
    fixed : ndarray of bool, shape (2, 3, m)
        Which of the three may not fall, and which may not rise.
    powers : tuple, optional
        As `POWERS`.

    Returns
    -------
    ndarray, shape (3, len(powers), m)
        In the units of the three numbers.
    """
    squares = _summed(left * left)
    radial = _summed(np.moveaxis(slope * left, 1, 0))
    products = np.concatenate([_summed(np.moveaxis(slope[k] * slope[k:], 1, 0)) for k in range(3)])
    starts = np.flatnonzero(np.diff(objective.group, prepend=-1))
    if len(starts) < len(objective.group):
        squares, radial, products = (
            np.add.reduceat(x, starts, axis=-2) for x in (squares, radial, products)
        )
    largest: Single = squares.max(axis=0, initial=0.0)
    share: Single = np.divide(squares, np.where(largest > 0.0, largest, np.float32(1.0)))
    inverse = np.float32(1.0) / np.maximum(squares, LEAST)
    bends = np.concatenate([(inverse * radial[k]) * radial[k:] for k in range(3)])
    gradients, matrices = [], []
    for power, bent in powers:
        weight = _power(share, power // 2 - 1)
        gradients.append((weight * radial).sum(axis=1))
        second = products + np.float32(power - 2.0) * bends if bent else products
        matrices.append((weight * second).sum(axis=1))
    gradient, matrix = (
        np.stack(every, axis=1).astype(np.float64) for every in (gradients, matrices)
    )
    outward = fixed[:, :, np.newaxis]
    held = (outward[0] & (gradient > 0.0)) | (outward[1] & (gradient < 0.0))
    return _solved(matrix, np.where(held, 0.0, -gradient), held)


def _summed(parts: Single) -> Single:
    """The sum of both parts, which come first."""
    both: Single = parts[0] + parts[1]
    return both


def _power(base: Single, exponent: int) -> Single:
    """A power by multiplications: of the same bits on every machine."""
    power, square = np.ones_like(base), base
    while exponent:
        if exponent % 2:
            power = power * square
        square, exponent = square * square, exponent // 2
    return power


def _solved(matrix: Array, right: Array, held: NDArray[np.bool_]) -> Array:
    """Solutions of symmetric equations in three unknowns, some of which are held; shape (3, ...).

    Of the matrices the upper triangles stand row by row, shape (6, ...). By elimination, written
    out: the same to the last bit wherever it runs.
    """
    most = np.maximum(np.maximum(matrix[0], matrix[3]), matrix[5])
    free = ~held
    m = {
        (i, j): np.where(free[i] & free[j], x, 0.0) if i != j
        else np.where(free[i], x * (1.0 + DAMPED) + SINGULAR * most, 1.0) + (most == 0.0)
        for (i, j), x in zip(UPPER, matrix, strict=True)
    }  # fmt: skip
    a, b = m[0, 1] / m[0, 0], m[0, 2] / m[0, 0]
    m11, m12, m22 = m[1, 1] - a * m[0, 1], m[1, 2] - a * m[0, 2], m[2, 2] - b * m[0, 2]
    r1, r2 = right[1] - a * right[0], right[2] - b * right[0]
    c = m12 / m11
    z = (r2 - c * r1) / (m22 - c * m12)
    y = (r1 - m12 * z) / m11
    x = (right[0] - m[0, 1] * y - m[0, 2] * z) / m[0, 0]
    return np.stack([x, y, z])
