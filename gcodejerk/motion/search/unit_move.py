"""One unit move as the search for its optimum gets it, and the optimum as it is returned.

This module owns the two, and the way from optima to profiles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex

Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """One unit move, and what it must not shake.

    Attributes
    ----------
    count : int
        T_SUM. [intervals]
    velocity, acceleration, jerk : float
        Limits of the unit profile; the jerk may be infinite. [1/s], [1/s^2], [1/s^3]
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]
    weights : ndarray, shape (m,)
        Participation times displacement. [mm]
    group : ndarray of int, shape (m,)
        Poles of one group, side by side, count together: the root of their squares' sum.
    band : float
        Relative error of the frequencies of single modes; groups have no band. [-]
    interval : float
        [s]
    today : Profiles or None
        The controller's own unit profile, one; None where nothing is known of it.
    guard : float
        What guarded frequencies may keep, times the envelope of today's; 0: anything. [-]
    """

    count: int
    velocity: float
    acceleration: float
    jerk: float
    poles: Complex
    weights: Array
    group: Index
    band: float
    interval: float
    today: Profiles | None = None
    guard: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Optimum:
    """An optimal unit profile: a jerk for each block of whole intervals.

    Attributes
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks. [intervals]
    jerk : ndarray, shape (k,)
        [1/intervals^3]
    worst : float
        Largest residual displacement over all groups and the band. [mm]
    """

    knots: Index
    jerk: Array
    worst: float


def optimum_profiles(optima: list[Optimum], interval: float) -> Profiles:
    """The profiles of optima, a segment for each block.

    Parameters
    ----------
    optima : list of Optimum
        n of them.
    interval : float
        [s]

    Returns
    -------
    Profiles
        n profiles.
    """
    first = np.concatenate([[0], np.cumsum([len(optimum.jerk) for optimum in optima])])
    none = np.zeros(0)
    jerk = np.concatenate([none, *(optimum.jerk for optimum in optima)]) / interval**3
    duration = np.concatenate([none, *(np.diff(optimum.knots) for optimum in optima)]) * interval
    gained = np.insert(np.cumsum(jerk * duration), 0, 0.0)
    # Every profile begins at rest: what rounding has left of the profiles before it is not its own.
    acceleration = gained[:-1] - np.repeat(gained[first[:-1]], np.diff(first))
    return Profiles.of(first, duration, acceleration, jerk)
