r"""Profiles of rapids: rest-to-rest motions from 0 to 1, as segments of constant jerk.

This module owns the one form in which a profile leaves the planner, whatever designed it: Condition
III, a shaper, or an optimum with a jerk of its own in every interval. It is sampled, judged, drawn
and reported in this form alone. The acceleration is linear in each segment; between segments it
may step, so that a trapezoid of velocity is a profile too.

Rule: profiles are unit profiles; all quantities scale with the length, and limits divided by the
length are the limits of the profile.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Profiles:
    """Unit profiles as columns: n profiles, and the s segments of all of them in their order.

    Attributes
    ----------
    first : ndarray of int, shape (n + 1,)
        Profile i has the segments ``first[i]`` to ``first[i + 1]``, at least one.
    begin : ndarray, shape (s,)
        When each segment begins, since the profile's start. [s]
    duration : ndarray, shape (s,)
        Its length, above zero. [s]
    position, velocity, acceleration : ndarray, shape (s,)
        At its begin. [-], [1/s], [1/s^2]
    jerk : ndarray, shape (s,)
        Throughout it. [1/s^3]
    """

    first: Index
    begin: Array
    duration: Array
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array

    @classmethod
    def of(cls, first: Index, duration: Array, acceleration: Array, jerk: Array) -> Profiles:
        """Profiles from their segments; what they add up to is integrated here.

        Parameters
        ----------
        first : ndarray of int, shape (n + 1,)
            As in `Profiles`.
        duration, acceleration, jerk : ndarray, shape (s,)
            Of the segments; the acceleration is that at a segment's begin. [s], [1/s^2], [1/s^3]

        Returns
        -------
        Profiles

        Examples
        --------
        One second of acceleration 1 and one of -1:

        >>> columns = ([0, 2], [1.0, 1.0], [1.0, -1.0], [0.0, 0.0])
        >>> profile = Profiles.of(*(np.array(x) for x in columns))
        >>> profile.position.tolist(), profile.peak_velocity.tolist()
        ([0.0, 0.5], [1.0])
        """
        first = np.asarray(first, dtype=np.int64)
        begin, position, velocity = (np.zeros(len(duration)) for _ in range(3))
        count = np.diff(first)
        d = duration
        gained = (acceleration + 0.5 * jerk * d) * d
        passed = (0.5 * acceleration + jerk * d / 6.0) * d * d
        # Segment k of every profile that has one: few steps where profiles are short, and no sum
        # over profiles.
        for k in range(1, int(count.max(initial=1))):
            here = first[:-1][count > k] + k
            before = here - 1
            begin[here] = begin[before] + d[before]
            velocity[here] = velocity[before] + gained[before]
            position[here] = position[before] + velocity[before] * d[before] + passed[before]
        return cls(first, begin, duration, position, velocity, acceleration, jerk)

    def __len__(self) -> int:
        return len(self.first) - 1

    def __repr__(self) -> str:
        return f"<Profiles: {len(self)} of {len(self.begin)} segments>"

    @property
    def total(self) -> Array:
        """Duration of each profile, T_SUM, shape (n,) [s]."""
        last = self.first[1:] - 1
        total: Array = self.begin[last] + self.duration[last]
        return total

    @property
    def owner(self) -> Index:
        """The profile of each segment, shape (s,)."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    @property
    def end_acceleration(self) -> Array:
        """Acceleration at each segment's end, shape (s,) [1/s^2]."""
        return self.acceleration + self.jerk * self.duration

    @property
    def turning_velocity(self) -> Array:
        """Velocity where the acceleration is zero inside a segment, or at its begin, shape (s,)."""
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.where(self.jerk != 0.0, -self.acceleration / self.jerk, 0.0)
        t = np.where((t > 0.0) & (t < self.duration), t, 0.0)
        turning: Array = self.velocity + 0.5 * self.acceleration * t
        return turning

    @property
    def mean_moment(self) -> Array:
        """When the motion is made, on average: the integral of what is left, shape (n,) [s].

        Half the duration, where a profile is its own mirror image.

        Examples
        --------
        >>> columns = ([0, 2], [1.0, 1.0], [1.0, -1.0], [0.0, 0.0])
        >>> Profiles.of(*(np.array(x) for x in columns)).mean_moment.tolist()
        [1.0]
        """
        d = self.duration
        further = (self.velocity + (self.acceleration / 3.0 + self.jerk * d / 12.0) * d) * d
        passed = (self.position + 0.5 * further) * d
        return self.total - np.bincount(self.owner, passed, len(self))

    @property
    def peak_velocity(self) -> Array:
        """Largest velocity of each profile, shape (n,) [1/s]."""
        return self._largest(np.maximum(self.velocity, self.turning_velocity))

    @property
    def least_velocity(self) -> Array:
        """Least velocity of each profile, shape (n,); below zero it would go backwards [1/s]."""
        return -self._largest(-np.minimum(self.velocity, self.turning_velocity))

    @property
    def peak_acceleration(self) -> Array:
        """Largest modulus of the acceleration of each profile, shape (n,) [1/s^2]."""
        return self._largest(np.maximum(np.abs(self.acceleration), np.abs(self.end_acceleration)))

    @property
    def greatest_jerk(self) -> Array:
        """Largest modulus of the jerk within the segments, shape (n,) [1/s^3]."""
        return self._largest(np.abs(self.jerk))

    @property
    def peak_jerk(self) -> Array:
        """Largest modulus of the jerk, infinite where the acceleration steps, shape (n,)."""
        stepped = (
            np.abs(self.acceleration_steps()) > 1e-6 * self.peak_acceleration[self._of_steps()]
        )
        peak = self.greatest_jerk
        return np.where(np.isin(np.arange(len(self)), self._of_steps()[stepped]), np.inf, peak)

    def _largest(self, value: Array) -> Array:
        """Largest of a column within each profile."""
        if not len(self):
            return np.zeros(0)
        largest: Array = np.maximum.reduceat(value, self.first[:-1])
        return largest

    def _of_steps(self) -> Index:
        """The profile of each step: one at every segment's begin and one at the profile's end."""
        return np.repeat(np.arange(len(self)), np.diff(self.first) + 1)

    def step_times(self) -> Array:
        """Moments of the steps, shape (s + n,): every segment's begin, the profile's end [s]."""
        return self._with_ends(self.begin, self.total)

    def acceleration_steps(self) -> Array:
        """Jumps of the acceleration at these moments; all zero but for trapezoids [1/s^2]."""
        before = np.concatenate([[0.0], self.end_acceleration])
        step = self.acceleration - before[:-1]
        step[self.first[:-1]] = self.acceleration[self.first[:-1]]
        return self._with_ends(step, -before[self.first[1:]])

    def jerk_steps(self) -> Array:
        """Changes of the jerk at these moments [1/s^3]."""
        step = np.diff(self.jerk, prepend=0.0)
        step[self.first[:-1]] = self.jerk[self.first[:-1]]
        return self._with_ends(step, -self.jerk[self.first[1:] - 1])

    def _with_ends(self, at_begins: Array, at_ends: Array) -> Array:
        """A column of the steps, from those at the segments' begins and at the profiles' ends."""
        return np.insert(at_begins, self.first[1:], at_ends)

    def take(self, index: NDArray[np.integer] | NDArray[np.bool_] | slice) -> Profiles:
        """Some of the profiles."""
        rows = np.arange(len(self))[index]
        count = np.diff(self.first)[rows]
        first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        segment = np.arange(first[-1]) + np.repeat(self.first[rows] - first[:-1], count)
        return Profiles(first, *(column[segment] for column in self._columns()))

    def replaced(self, index: NDArray[np.integer] | NDArray[np.bool_], other: Profiles) -> Profiles:
        """These profiles with those at `index` taken from `other` (of the index's shape)."""
        order = np.arange(len(self))
        order[index] = len(self) + np.arange(len(other))
        return joined([self, other]).take(order)

    def stretched(self, factor: Array) -> Profiles:
        """The same profiles slower by a factor each, shape (n,)."""
        by = factor[self.owner]
        return Profiles.of(
            self.first, self.duration * by, self.acceleration / by**2, self.jerk / by**3
        )

    def _columns(self) -> tuple[Array, ...]:
        """The columns of segments, in the order of the attributes."""
        return (
            self.begin, self.duration, self.position, self.velocity, self.acceleration, self.jerk,
        )  # fmt: skip

    def segments(self, index: int) -> list[tuple[float, float]]:
        """(duration [s], unit jerk [1/s^3]) of each segment of one profile.

        A trapezoid of velocity has jerk 0 throughout: its acceleration steps are no segments.
        """
        part = slice(self.first[index], self.first[index + 1])
        return list(zip(self.duration[part].tolist(), self.jerk[part].tolist(), strict=True))


def joined(parts: list[Profiles]) -> Profiles:
    """All profiles of several `Profiles`, in their order."""
    offsets = np.cumsum([0, *(len(part.begin) for part in parts)])
    firsts = [part.first[:-1] + offset for part, offset in zip(parts, offsets[:-1], strict=True)]
    first = np.concatenate([*firsts, offsets[-1:]]).astype(np.int64)
    columns = zip(*(part._columns() for part in parts), strict=True)
    return Profiles(first, *(np.concatenate(column) for column in columns))
