r"""Symmetric time profiles: four numbers, from which everything else follows.

This module owns the family that Condition III of Sato and Shirase and its generalisation belong to,
and with them the conventional profile of a controller::

    acceleration
      A |    ______
        |   /|    |\
        |  / |    | \
        | /  |    |  \          deceleration: the mirror image
      --+----+----+---+-------+---+----+----+-->  t
        | T1 | Ta | T2|  Tv   | \ |    |   /
        |                     |  \|    |  /
     -A |                     |   ------ /
                              |T2 | Ta |T1

Rising acceleration takes T1, falling acceleration T2; Ta at constant acceleration and Tv at
constant velocity are zero in a four-segment profile. In the paper's count of segments T3 = T2 and
T4 = T1. The profile is odd about its middle: what accelerates in the order T1, Ta, T2 brakes in the
order T2, Ta, T1, and the velocity is even.

Rule: profiles are unit profiles, from 0 to 1 in rest-to-rest motion; all quantities scale with the
length.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles


@dataclass(frozen=True, slots=True, eq=False)
class SymmetricProfiles:
    """Unit profiles as columns; entry i of every array is profile i.

    Attributes
    ----------
    T1, Ta, T2, Tv : ndarray, shape (n,)
        Durations of rising, constant and falling acceleration, and of constant velocity. [s]
        T1 = T2 = 0 is a trapezoid of velocity: acceleration steps, no finite jerk.
    """

    T1: Array
    Ta: Array
    T2: Array
    Tv: Array

    def __len__(self) -> int:
        return len(self.T1)

    @property
    def ramp(self) -> Array:
        """Duration of the acceleration, T1 + Ta + T2 [s]."""
        return self.T1 + self.Ta + self.T2

    @property
    def total(self) -> Array:
        """Duration of the move, T_SUM [s]."""
        return 2.0 * self.ramp + self.Tv

    @property
    def area(self) -> Array:
        """Velocity gained per unit of peak acceleration [s]."""
        return self.Ta + 0.5 * (self.T1 + self.T2)

    @property
    def centroid(self) -> Array:
        """Moment at which the acceleration's area is balanced [s].

        The length of a profile is V (T_SUM - 2 centroid): the acceleration acts as if it all
        happened at its centroid, and so, by symmetry, does the deceleration.
        """
        T1, Ta, T2 = self.T1, self.Ta, self.T2
        moment = T1 * T1 / 3.0 + Ta * (T1 + 0.5 * Ta) + 0.5 * T2 * (T1 + Ta + T2 / 3.0)
        return moment / self.area

    @property
    def velocity(self) -> Array:
        """Peak velocity of the unit profile [1/s]."""
        return 1.0 / (self.total - 2.0 * self.centroid)

    @property
    def acceleration(self) -> Array:
        """Peak acceleration of the unit profile [1/s^2]."""
        return self.velocity / self.area

    @property
    def jerk(self) -> Array:
        """Peak jerk of the unit profile; infinite where T1 or T2 is zero [1/s^3]."""
        with np.errstate(divide="ignore"):
            return self.acceleration / np.minimum(self.T1, self.T2)

    def take(self, index: NDArray[np.intp] | NDArray[np.bool_] | slice) -> SymmetricProfiles:
        """Some of the profiles."""
        return SymmetricProfiles(self.T1[index], self.Ta[index], self.T2[index], self.Tv[index])

    def replaced(
        self, index: NDArray[np.intp] | NDArray[np.bool_], other: SymmetricProfiles
    ) -> SymmetricProfiles:
        """These profiles with those at `index` taken from `other` (of the index's shape)."""
        columns = []
        for own, new in zip(self.columns(), other.columns(), strict=True):
            column = own.copy()
            column[index] = new
            columns.append(column)
        return SymmetricProfiles(*columns)

    def columns(self) -> tuple[Array, Array, Array, Array]:
        """T1, Ta, T2, Tv."""
        return self.T1, self.Ta, self.T2, self.Tv

    def general(self) -> Profiles:
        """The same profiles as segments: T1, Ta, T2, Tv, T2, Ta, T1, empty ones left out."""
        T1, Ta, T2, Tv = self.columns()
        A, zero = self.acceleration, np.zeros(len(self))
        with np.errstate(divide="ignore", invalid="ignore"):
            rising = np.where(T1 > 0.0, A / T1, 0.0)
            falling = np.where(T2 > 0.0, -A / T2, 0.0)
        duration = np.stack([T1, Ta, T2, Tv, T2, Ta, T1], axis=1)
        acceleration = np.stack([zero, A, A, zero, zero, -A, -A], axis=1)
        jerk = np.stack([rising, zero, falling, zero, falling, zero, rising], axis=1)
        used = duration > 0.0
        first = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
        return Profiles.of(first, duration[used], acceleration[used], jerk[used])


def conventional_profiles(
    velocity: ArrayLike, acceleration: ArrayLike, jerk: ArrayLike, shortest_ramp: float = 0.0
) -> SymmetricProfiles:
    r"""The fastest symmetric profile within limits: what controllers do today.

    Parameters
    ----------
    velocity, acceleration, jerk : array_like, shape (n,)
        Limits of the unit profile; the limits of an axis divided by its displacement. Jerk may be
        infinite: the velocity is then a trapezoid. [1/s], [1/s^2], [1/s^3]
    shortest_ramp : float, optional
        Least duration of T1 = T2, for the fastest profile that a command interval allows. [s]

    Returns
    -------
    SymmetricProfiles
        Four segments where neither velocity nor acceleration is reached, up to seven otherwise.

    Notes
    -----
    With :math:`t_j` the duration of a jerk phase and :math:`t_a` that of constant acceleration the
    unit length is :math:`V (2 t_j + t_a + t_v)`, :math:`V = A (t_j + t_a)`. The phases are
    filled in this order: jerk alone, :math:`2 J t_j^3 = 1`; then constant acceleration,
    :math:`A (t_j + t_a)(2 t_j + t_a) = 1`; then cruise.

    Examples
    --------
    1 mm with 600 mm/s, 5000 mm/s^2 and 5e5 mm/s^3 takes four times 10 ms:

    >>> profile = conventional_profiles([600.0], [5000.0], [5e5])
    >>> [round(float(t[0]), 6) for t in profile.columns()]
    [0.01, 0.0, 0.01, 0.0]
    """
    V, A, J = np.broadcast_arrays(
        *(np.asarray(x, dtype=float) for x in (velocity, acceleration, jerk))
    )
    with np.errstate(divide="ignore"):
        # Jerk alone: the ramp ends where the length, the velocity or the acceleration is reached.
        by_length, by_velocity, by_acceleration = np.cbrt(0.5 / J), np.sqrt(V / J), A / J
    tj = np.minimum(np.minimum(by_length, by_velocity), by_acceleration)
    tj = np.maximum(tj, shortest_ramp)
    # Constant acceleration, where the ramp reached A: as long as length and velocity need it.
    to_length = 0.5 * (np.sqrt(tj * tj + 4.0 / A) - 3.0 * tj)
    to_velocity = V / A - tj
    reaches = by_acceleration <= np.maximum(np.minimum(by_length, by_velocity), shortest_ramp)
    ta = np.where(reaches, np.maximum(np.minimum(to_length, to_velocity), 0.0), 0.0)
    # A rounding error must not make a segment of 1e-17 s.
    ta = np.where(ta < 1e-12, 0.0, ta)
    tv = 1.0 / V - (2.0 * tj + ta)
    tv = np.where(tv < 1e-12, 0.0, tv)
    return SymmetricProfiles(tj, ta, tj.copy(), tv)
