"""Tasks: moves as a design gets them, whatever the design is.

This module owns what a move is to a design: its time, its limits, what it excites, what the control
does today; and the one measure that all designs are judged by, the largest residual over the band.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import LAWS, Machine
from gcodejerk.motion import (
    Objective,
    Profiles,
    SymmetricProfiles,
    grouped,
    profiles_response,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.objective import JUDGED, JUDGED_FEWEST
from gcodejerk.motion.search.rows import parts
from gcodejerk.motion.search.together import mixed_signs
from gcodejerk.planning.arrival import each_at_arrival, summed
from gcodejerk.planning.conventional import conventional_limits, todays_profiles, unit_limits
from gcodejerk.planning.optima import Progress
from gcodejerk.planning.plans import Modes
from gcodejerk.spread import Spread, here

AT_ONCE = 1 << 18
"""Residuals, of moves at frequencies, that are judged at a time: some 12 MB."""


@dataclass(frozen=True, slots=True, eq=False)
class Task:
    """Moves to be designed, columns of n.

    Attributes
    ----------
    counts : ndarray of int, shape (n,)
        T_SUM. [intervals]
    limits : tuple of ndarray, shape (n,)
        Velocity, acceleration and jerk of the unit profiles. [1/s], [1/s^2], [1/s^3]
    conventional : Profiles
        What the controller does today.
    symmetric : SymmetricProfiles
        The fastest symmetric profiles within the same limits: what the controller does, unless it
        has a law or a filter of its own.
    objective : Objective
        What they are judged by.
    interval, band, guard, tolerance : float
        Of the machine. [s], [-], [-], [mm]
    progress : callable or None
        For designs that take long.
    own_law : bool
        What the controller does today does not follow from the limits alone.
    spread : Spread
        Who computes what takes long.
    """

    counts: NDArray[np.int64]
    limits: tuple[Array, Array, Array]
    conventional: Profiles
    symmetric: SymmetricProfiles
    objective: Objective
    interval: float
    band: float
    guard: float
    tolerance: float
    progress: Progress | None = None
    own_law: bool = False
    spread: Spread = here

    @classmethod
    def of(
        cls, machine: Machine, modes: Modes, share: Array, counts: NDArray[np.int64] | None = None,
        progress: Progress | None = None, speed: Array | None = None,
        lone: NDArray[np.bool_] | None = None, spread: Spread = here,
    ) -> Task:  # fmt: skip
        """Moves on a machine.

        Parameters
        ----------
        machine : Machine
            Its limits and what it says of designs.
        modes : Modes
            Those that count, of that machine.
        share : ndarray, shape (n, 9)
            Displacement of each axis. [mm] or [deg]
        counts : ndarray of int, shape (n,), optional
            T_SUM; the conventional time rounded up by default. [intervals]
        progress : callable, optional
            See `Progress`.
        speed : ndarray, shape (n,), optional
            Speed that the program states, which no unit profile exceeds; NaN for none. [1/s]
        lone : ndarray of bool, shape (n,), optional
            No other motion follows directly (`Axis.conventional`); all of them by default.
        spread : Spread, optional
            Who computes what takes long.

        Returns
        -------
        Task
        """
        rapid, limits = conventional_limits(machine, share, lone), unit_limits(machine, share)
        if speed is not None:
            rapid, limits = ((np.fmin(V, speed), A, J) for V, A, J in (rapid, limits))
        symmetric, conventional = todays_profiles(machine, rapid, share, speed)
        if counts is None:
            counts = np.maximum(whole_intervals(conventional.total, machine.interval), 1)
        weights = np.abs(share @ modes.participation.T)
        return cls(
            counts=counts,
            limits=limits,
            conventional=conventional,
            symmetric=symmetric,
            objective=Objective(modes.poles, weights, modes.group),
            interval=machine.interval,
            band=machine.design.band,
            guard=machine.design.guard,
            tolerance=machine.design.tolerance,
            progress=progress,
            own_law=machine.planner in LAWS or any(axis.filter for axis in machine.axes),
            spread=spread,
        )

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def total(self) -> Array:
        """T_SUM, shape (n,) [s]."""
        return np.asarray(self.counts * self.interval, dtype=np.float64)

    def take(self, index: NDArray[np.intp] | NDArray[np.bool_]) -> Task:
        """Some of the moves."""
        return replace(
            self,
            counts=self.counts[index],
            limits=(self.limits[0][index], self.limits[1][index], self.limits[2][index]),
            conventional=self.conventional.take(index),
            symmetric=self.symmetric.take(index),
            objective=self.objective.take(index),
        )

    def distinct(self) -> tuple[list[bytes], NDArray[np.intp], NDArray[np.intp]]:
        """Kinds of moves: those of a kind have the same best profile, though not the same residual.

        Returns
        -------
        keys : list of bytes, length k
            Of each kind, the same for the same kind in any task.
        first : ndarray of int, shape (k,)
            A move of each kind.
        same : ndarray of int, shape (n,)
            The kind of each move.
        """
        total = self.total
        V, A, J = self.limits
        scale = self.objective.weights.max(axis=1, initial=0.0)
        weights = self.objective.weights / np.where(scale > 0.0, scale, 1.0)[:, np.newaxis]
        today = [column / total for column in self.symmetric.columns()]
        if self.own_law:
            today += self._outline()
        numbers = np.column_stack(
            [self.counts, V * total, A * total**2, J * total**3, *today, weights]
        )
        rows, first, same = _kinds(numbers)
        objective = self.objective
        common = hashlib.blake2b(objective.poles.tobytes() + objective.group.tobytes())
        common.update(np.array([self.band, self.interval]).tobytes())
        return [common.digest() + row.tobytes() for row in rows], first, same

    def _outline(self) -> list[Array]:
        """What tells one profile of today from another, in units of T_SUM: its response."""
        at = [2j * np.pi * k for k in (0.7, 1.9, 3.3, 5.1)]
        scaled = self.conventional.stretched(1.0 / self.total)
        response = profiles_response(scaled, np.array(at))
        return [*response.real.T, *response.imag.T, self.conventional.total / self.total]

    def alike(self) -> Iterator[tuple[NDArray[np.intp], float]]:
        """Moves that excite the same modes and take about as long, and a time that none exceeds.

        A longer move has to be looked at more frequencies. The time [s] is that of the class, a
        factor of 1.4 wide, so that no move is designed otherwise because of what stands beside it.
        """
        duration = np.floor(2.0 * np.log2(self.counts)).astype(np.int64)
        kinds = np.column_stack([duration, self.objective.weights != 0.0])
        _, kind = np.unique(kinds, axis=0, return_inverse=True)
        order = np.argsort(kind.reshape(-1), kind="stable")
        bounds = np.flatnonzero(np.diff(kind.reshape(-1)[order], prepend=-1))
        for index in np.split(order, bounds[1:]) if len(order) else ():
            yield index, self.interval * 2.0 ** (0.5 * float(duration[index[0]] + 1))

    def proportional(self) -> tuple[NDArray[np.intp], Array]:
        """Moves that differ in their length alone: of one axis, for instance.

        Returns
        -------
        kind : ndarray of int, shape (n,)
            The same for those that do.
        length : ndarray, shape (n,)
            Of each, in units that are the same within a kind.
        """
        V, A, J = self.limits
        length = 1.0 / V
        weights = self.objective.weights / length[:, np.newaxis]
        _, _, kind = _kinds(np.column_stack([A * length, J * length, weights]))
        return kind, length

    def after(self, counts: NDArray[np.int64]) -> Task:
        """The same moves in other times."""
        return replace(self, counts=counts)


def _kinds(numbers: Array) -> tuple[Array, NDArray[np.intp], NDArray[np.intp]]:
    """Rows that differ, one row of each, and which of them each row is.

    They are rounded: the same move computed in another order is of the same kind.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        digits = 10.0 ** (9.0 - np.ceil(np.log10(np.abs(numbers))))
        rounded = np.where(np.isfinite(digits), np.rint(numbers * digits) / digits, numbers)
    rounded += 0.0  # no -0
    rows, first, same = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    return rows, first, same.reshape(-1)


def worst_in_band(task: Task, profiles: Profiles) -> Array:
    """Largest residual displacement of profiles with every frequency anywhere within the band.

    Parameters
    ----------
    task : Task
        The moves.
    profiles : Profiles
        One for each.

    Returns
    -------
    ndarray, shape (n,)
        [mm]
    """
    worst = np.zeros(len(task))
    # A longer move needs more frequencies: moves of like duration together.
    octave = np.frexp(profiles.total)[1]
    for k in np.unique(octave):
        index = np.nonzero(octave == k)[0]
        own = profiles.take(index)
        objective = task.objective.take(index).excited()
        width = len(objective.in_band(task.band, 2.0 ** float(k), JUDGED, JUDGED_FEWEST).poles)
        for part in parts(len(index), width, AT_ONCE):
            around = objective.take(part).in_band(task.band, 2.0 ** float(k), JUDGED, JUDGED_FEWEST)
            worst[index[part]] = around.of(own.take(np.arange(len(index))[part]))
    return worst


def worst_at_arrival(
    modes: Modes, band: float, move: NDArray[np.int64], share: Array, profiles: Profiles,
    off: float = 0.0,
) -> Array:  # fmt: skip
    """The same for moves of several profiles: what is left when the last of them has ended.

    Parameters
    ----------
    modes : Modes
        The machine's modes.
    band : float
        Relative error of their frequencies. [-]
    move : ndarray of int, shape (l,)
        The move of each profile, counted from 0, ascending.
    share : ndarray, shape (l, 9)
        Displacement of each axis that the profile carries. [mm] or [deg]
    profiles : Profiles
        l unit profiles; those of a move begin together.
    off : float, optional
        How much some of them may excite a mode more, and others less, than stated: what they
        leave together is the largest of all that. [-]

    Returns
    -------
    ndarray, shape (n,)
        [mm]
    """
    arrival = np.zeros(int(move.max(initial=-1)) + 1)
    np.maximum.at(arrival, move, profiles.total)
    worst = np.zeros(len(arrival))
    every = Objective(modes.poles, modes.participation.T, modes.group)
    moves = np.flatnonzero(arrival)  # others have no profile
    octave = np.frexp(arrival[moves])[1]
    for k in np.unique(octave):
        around = every.in_band(band, 2.0 ** float(k), JUDGED, JUDGED_FEWEST)
        alike = moves[octave == k]
        for part in parts(len(alike), len(around.poles), AT_ONCE):
            chosen = alike[part]
            index = np.nonzero(np.isin(move, chosen))[0]
            row = np.searchsorted(chosen, move[index])
            each = each_at_arrival(profiles.take(index), row, around.poles)
            each *= share[index] @ around.weights
            largest = np.abs(summed(each, row))
            if off:
                excites = 1.0 * (each != 0.0)
                several = summed(excites, row)
                place = np.arange(len(row)) - np.searchsorted(row, row)
                for signs in mixed_signs(int(place.max(initial=0)) + 1):
                    sign = np.array(signs)[place, np.newaxis]
                    scaled = np.abs(summed(each * (1.0 + off * sign), row))
                    mixed = np.abs(summed(excites * sign, row)) < several
                    largest = np.where(mixed, np.maximum(largest, scaled), largest)
            displacement = largest / around.poles.imag
            worst[chosen] = grouped(displacement, around.group).max(axis=1, initial=0.0)
    return worst
