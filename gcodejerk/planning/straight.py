"""Moves along straight lines of X, Y and Z, as LinuxCNC's planner sees them.

This module owns what the machine and the control allow such a move: one profile, one direction, and
limits along it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import STREAM_HEADROOM
from gcodejerk.motion import Grid, Profiles, sample_profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.knots import END_PERIODS
from gcodejerk.planning.batch import Sampler

USED = 0.99
"""Share of `STREAM_HEADROOM` times what profiles use that speeds may use."""
FULLEST = 1.5
"""The same at most, where the machine file does not say it."""
FEWEST = 2.0
"""Steps that an axis moves at least."""
OUTER = 1e-6
"""Of the way, in front of the first point and behind the last, at least. A motion of 1e-8 machine
units is none to the control, inches perhaps (posemath's CART_FUZZ), and this one is three of them.
[mm]"""
BITS = 36
"""Of length, direction and profile in which moves that are alike agree."""
ALIKE = 1.0 - 1e-9
"""Share of the farthest axis's way from which on another one goes as far."""
LINEAR = "XYZ"
"""Axes that are played so: the planner blends no others."""


@dataclass(frozen=True, slots=True, eq=False)
class StraightMoves:
    """Columns of b moves along straight lines.

    Attributes
    ----------
    sampler : Sampler
        What they are.
    profiles : Profiles
        Unit profile of each.
    possible : ndarray of bool, shape (b,)
        Nothing stands against playing it. What is impossible is computed as if it were not.
    count : ndarray of int, shape (b,)
        T_SUM. [intervals]
    way, speed : ndarray, shape (b, longest + 1)
        Of the profile at every interval, aligned at the end. [mm], [mm/s]
    length : ndarray, shape (b,)
        [mm]
    direction : ndarray, shape (b, 3)
        [-]
    velocity : ndarray, shape (b,)
        What profiles may use along the path. [mm/s]
    most, full : ndarray, shape (b,)
        What speeds between knots may use, and what the control may be set to. [mm/s^2]
    step : ndarray, shape (b,)
        Of the numbers that are written. [mm]
    """

    sampler: Sampler
    profiles: Profiles
    possible: NDArray[np.bool_]
    count: Counts
    way: Array
    speed: Array
    length: Array
    direction: Array
    velocity: Array
    most: Array
    full: Array
    step: Array

    @classmethod
    def of(cls, sampler: Sampler) -> StraightMoves:
        """Look at what the machine and the control allow."""
        plans = sampler.plans
        displacement = plans.displacement[sampler.moves]
        way = displacement[:, : len(LINEAR)]
        length = np.sqrt((way**2).sum(axis=1))
        count = plans.counts[sampler.moves]
        # One profile for each move, along X, Y and Z alone, and room for two blocks.
        possible = np.bincount(sampler.row_of, minlength=len(count)) == 1
        possible &= (displacement[:, len(LINEAR) :] == 0.0).all(axis=1)
        possible &= count >= 2 * END_PERIODS
        # An axis that moves by a step or two has no point in between.
        step = sampler.number_format.step[:, 0]
        possible &= ((way == 0.0) | (np.abs(way) > FEWEST * step[:, np.newaxis])).all(axis=1)
        length = np.where(possible, length, 1.0)
        # Of an axis that stands still the position may be unknown; of one on its own, too.
        way = np.where(possible[:, np.newaxis], way, np.eye(len(LINEAR))[0])
        count = np.maximum(count, 2 * END_PERIODS)
        direction = way / length[:, np.newaxis]
        first = np.searchsorted(sampler.row_of, np.arange(len(count)))
        profiles = plans.profiles.take(sampler.rows[first])
        options = plans.machine.controller_options
        most, full, limit, velocity = (np.full(len(LINEAR), np.inf) for _ in range(4))
        for axis in plans.machine.axes:
            if axis.name in LINEAR:
                k = LINEAR.index(axis.name)
                limit[k], velocity[k] = axis.limit.acceleration, axis.limit.velocity
                most[k] = options.max_acceleration.get(axis.name, STREAM_HEADROOM * limit[k])
                full[k] = options.max_acceleration.get(axis.name, FULLEST * limit[k])
        path = plans.machine.path.limit
        every = Grid.every(count, 1, sampler.interval)
        unit, speed = sample_profiles(profiles, every.knots, sampler.interval)
        peak = profiles.peak_acceleration * length
        possible &= STREAM_HEADROOM * peak <= _along(most, direction) * (1.0 + 1e-6)
        return cls(
            sampler=sampler,
            profiles=profiles,
            possible=possible,
            count=count,
            way=unit * length[:, np.newaxis],
            speed=speed * length[:, np.newaxis],
            length=length,
            direction=direction,
            velocity=np.minimum(_along(velocity, direction), path.velocity),
            most=USED
            * np.minimum(
                _along(np.minimum(most, STREAM_HEADROOM * limit), direction),
                STREAM_HEADROOM * path.acceleration,
            ),
            full=_along(full, direction),
            step=step,
        )

    @property
    def outer(self) -> NDArray[np.int64]:
        """Steps in front of the first point, and behind the last."""
        return outer_steps(self.step)

    def at(self, values: Array, knots: Counts) -> Array:
        """What `way` or `speed` is at knots, shape (b, k) aligned at the end."""
        last = values.shape[1] - 1
        out: Array = np.take_along_axis(values, last - self.count[:, np.newaxis] + knots, axis=1)
        return out

    def alike(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Moves that stand for all, and for each move which of these it is like.

        Where a move begins changes what is written, and nothing of the speeds that are fitted.
        """
        shape = self.profiles.peak_velocity, self.profiles.peak_acceleration, self.profiles.total
        columns = (self.direction.T, self.length, self.count, self.step, *shape)
        # What differs in the last bits of a position alone is alike.
        digits, exponent = np.frexp(np.vstack(columns).T)
        key = np.ldexp(np.rint(digits * 2.0**BITS), exponent)
        _, first, of = np.unique(key, axis=0, return_index=True, return_inverse=True)
        return first, np.reshape(of, -1)

    def take(self, rows: NDArray[np.int64]) -> StraightMoves:
        """Some of them."""
        columns = (f.name for f in fields(self) if f.name not in ("sampler", "profiles"))
        return replace(
            self,
            profiles=self.profiles.take(rows),
            **{name: getattr(self, name)[rows] for name in columns},
        )


def _along(limits: Array, direction: Array) -> Array:
    """Limits of the axes, shape (3,), along each path, shape (b,)."""
    with np.errstate(divide="ignore"):
        out: Array = np.where(direction != 0.0, limits / np.abs(direction), np.inf).min(axis=1)
    return np.where(np.isfinite(out), out, 1.0)


def outer_steps(step: Array) -> NDArray[np.int64]:
    """Whole steps that are `OUTER` at least.

    Parameters
    ----------
    step : ndarray, shape (n,)
        [mm]

    Returns
    -------
    ndarray of int, shape (n,)
    """
    return np.ceil(OUTER / step * (1.0 - 1e-9)).astype(np.int64)


def leading_axis(way: Array) -> NDArray[np.int64]:
    """The axis that goes farthest, which has the begin and the end of a stream to itself.

    Parameters
    ----------
    way : ndarray, shape (n, 3)
        Displacements or directions along X, Y and Z.

    Returns
    -------
    ndarray of int, shape (n,)
        The first of those that are alike but for last bits: who asks with displacements and who
        asks with directions are told the same.
    """
    far = np.abs(way)
    leading: NDArray[np.int64] = (far >= ALIKE * far.max(axis=1, keepdims=True)).argmax(axis=1)
    return leading
