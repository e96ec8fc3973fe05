"""Moves along straight lines of X, Y and Z, as LinuxCNC's planner sees them.

This module owns what the machine and the control allow such a move: one profile, one direction, and
limits along it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.knots import END_PERIODS
from gcodejerk.planning.batch import Sampler

HEADROOM, USED = 1.05, 0.99
"""MAX_ACCELERATION over what profiles use at least, and the share of it that speeds may use."""
FULLEST = 1.5
"""The same at most, where the machine file does not say it."""
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
    length : ndarray, shape (b,)
        [mm]
    direction : ndarray, shape (b, 3)
        [-]
    velocity, acceleration : ndarray, shape (b,)
        What profiles may use along the path. [mm/s], [mm/s^2]
    most, full : ndarray, shape (b,)
        What speeds between knots may use, and what the control may be set to. [mm/s^2]
    step : ndarray, shape (b,)
        Of the numbers that are written. [mm]
    """

    sampler: Sampler
    profiles: Profiles
    possible: NDArray[np.bool_]
    count: Counts
    length: Array
    direction: Array
    velocity: Array
    acceleration: Array
    most: Array
    full: Array
    step: Array

    @classmethod
    def of(cls, sampler: Sampler) -> StraightMoves:
        """Look at what the machine and the control allow."""
        plans = sampler.plans
        way = plans.displacement[sampler.moves][:, : len(LINEAR)]
        length = np.sqrt((way**2).sum(axis=1))
        count = plans.counts[sampler.moves]
        # One profile for each move, along X, Y and Z alone, and room for two blocks.
        possible = np.bincount(sampler.row_of, minlength=len(count)) == 1
        possible &= (plans.displacement[sampler.moves][:, len(LINEAR) :] == 0.0).all(axis=1)
        possible &= count >= 2 * END_PERIODS
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
                most[k] = options.max_acceleration.get(axis.name, HEADROOM * limit[k])
                full[k] = options.max_acceleration.get(axis.name, FULLEST * limit[k])
        peak = profiles.peak_acceleration * length
        possible &= HEADROOM * peak <= _along(most, direction) * (1.0 + 1e-6)
        return cls(
            sampler=sampler,
            profiles=profiles,
            possible=possible,
            count=count,
            length=length,
            direction=direction,
            velocity=_along(velocity, direction),
            acceleration=_along(limit, direction),
            most=USED * _along(np.minimum(most, HEADROOM * limit), direction),
            full=_along(full, direction),
            step=sampler.number_format.step[:, 0],
        )

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
