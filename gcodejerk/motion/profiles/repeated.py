"""Profiles of which each different one is kept once, however many moves follow it.

Rule: whoever asks for columns of segments gets them written out, and they are not kept; what is
known of each different profile is looked up.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Index, Profiles


class RepeatedProfiles(Profiles):
    """Profiles in any order, each as often as wanted.

    Attributes
    ----------
    distinct : Profiles
        The different ones.
    like : ndarray of int, shape (n,)
        Profile i is ``distinct[like[i]]``.

    Examples
    --------
    >>> columns = ([0, 1, 2], [1.0, 2.0], [2.0, 0.5], [0.0, 0.0])
    >>> both = Profiles.of(*(np.array(x) for x in columns))
    >>> repeated = RepeatedProfiles(both, np.array([1, 0, 1]))
    >>> len(repeated), repeated.total.tolist(), repeated.duration.tolist()
    (3, [2.0, 1.0, 2.0], [2.0, 1.0, 2.0])
    """

    __slots__ = ("distinct", "like")

    distinct: Profiles
    like: Index

    def __init__(self, distinct: Profiles, like: NDArray[np.integer]) -> None:
        if isinstance(distinct, RepeatedProfiles):
            like = distinct.like[like]
            distinct = distinct.distinct
        object.__setattr__(self, "distinct", distinct)
        object.__setattr__(self, "like", np.asarray(like, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.like)

    def take(self, index: NDArray[np.integer] | NDArray[np.bool_] | slice) -> Profiles:
        """Some of the profiles, written out."""
        return self.distinct.take(self.like[index])

    def repeated(self, index: NDArray[np.integer]) -> RepeatedProfiles:
        """Some of the profiles, each different one still kept once."""
        return RepeatedProfiles(self.distinct, self.like[index])

    def segments(self, index: int) -> list[tuple[float, float]]:
        """(duration [s], unit jerk [1/s^3]) of each segment of one profile."""
        return self.distinct.segments(int(self.like[index]))

    def _written_out(self) -> Profiles:
        """All of them as columns."""
        return self.distinct.take(self.like)

    @property
    def total(self) -> Array:
        """Duration of each profile, T_SUM, shape (n,) [s]."""
        return self.distinct.total[self.like]

    @property
    def peak_velocity(self) -> Array:
        """Largest velocity of each profile, shape (n,) [1/s]."""
        return self.distinct.peak_velocity[self.like]

    @property
    def least_velocity(self) -> Array:
        """Least velocity of each profile, shape (n,) [1/s]."""
        return self.distinct.least_velocity[self.like]

    @property
    def peak_acceleration(self) -> Array:
        """Largest modulus of the acceleration of each profile, shape (n,) [1/s^2]."""
        return self.distinct.peak_acceleration[self.like]

    @property
    def greatest_jerk(self) -> Array:
        """Largest modulus of the jerk within the segments, shape (n,) [1/s^3]."""
        return self.distinct.greatest_jerk[self.like]

    @property
    def peak_jerk(self) -> Array:
        """Largest modulus of the jerk, infinite where the acceleration steps, shape (n,)."""
        return self.distinct.peak_jerk[self.like]


def _column(name: str) -> property:
    """A column of segments, written out when it is asked for."""

    def column(self: RepeatedProfiles) -> NDArray[np.generic]:
        values: NDArray[np.generic] = getattr(self._written_out(), name)
        return values

    return property(column, doc=f"`Profiles.{name}`, written out.")


for _name in ("first", "begin", "duration", "position", "velocity", "acceleration", "jerk"):
    setattr(RepeatedProfiles, _name, _column(_name))
