"""A survey: one move of one axis, over every T1 and T_SUM that four segments can have.

This module joins a machine with the amplitude maps of `motion`: which modes the axis shakes, what
the controller's own G0 leaves, where the limits bind, and the point that would be chosen. It knows
no file and draws nothing; `report.map_figure` and `report.map_csv` do.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Axis, Machine, Mode, Spectrum
from gcodejerk.motion import (
    Profiles,
    mode_poles,
    profiles_response,
    residual_displacement,
    whole_intervals,
)
from gcodejerk.motion.amplitudes import null_curve
from gcodejerk.motion.maps import amplitude_map, displacement_map
from gcodejerk.motion.profiles.conditions import (
    Condition,
    Peaks,
    condition_peaks,
    feasible,
    limit_use,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task

Number = TypeVar("Number", float, Array)
ALL = "all"
"""In place of a mode: the worst displacement over all of them."""
SEARCH = 2001
"""Points of a search for the best T1; it is repeated around the best of them."""
WITHIN = 1.0 + 1e-9
"""A limit that is just reached is kept."""
MOST_POINTS = 1000
"""Rows of a table on the command interval; a longer one takes every second, third and so on."""
MOST_INTERVALS = 1 << 22
"""No search for a feasible time goes beyond this number of intervals."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A point of the map."""

    T1: float
    """[s]"""
    T_SUM: float
    """[s]"""
    value: float
    """What the map says there. [mm/s^2], or [mm] where it is of all modes"""


@dataclass(frozen=True, slots=True, eq=False)
class Survey:
    """One move of one axis, and the modes by which its profiles are judged.

    Attributes
    ----------
    machine : Machine
        Its limits, modes and interval.
    axis : Axis
        The axis that moves.
    length : float
        How far, without sign. [mm] or [deg]
    condition : Condition
        The family of profiles.
    modes : tuple of Mode
        Every mode that the axis excites.
    mode : Mode or None
        The one whose amplitude is mapped; None: the worst displacement over all.
    spectrum : Spectrum or None
        What was measured in place of modes; the one mode is then its peak, and amplitudes are the
        weighted mean of its lines.
    """

    machine: Machine
    axis: Axis
    length: float
    condition: Condition
    modes: tuple[Mode, ...]
    mode: Mode | None
    spectrum: Spectrum | None = None

    @classmethod
    def of(
        cls, machine: Machine, axis: str, length: float, condition: str = "III", mode: str = ALL
    ) -> Survey:
        """Survey a move.

        Parameters
        ----------
        machine : Machine
            The machine that moves.
        axis : str
            Letter of the axis.
        length : float
            How far it moves. [mm] or [deg]
        condition : str, optional
            I, II or III.
        mode : str, optional
            Name or number (from 1) of a mode that the axis excites, or `all`.

        Returns
        -------
        Survey

        Raises
        ------
        MachineError
            The machine has no such axis.
        PlanError
            The length is no length, the axis excites no mode, or there is no such mode.
        """
        described = machine.axis(axis.upper())
        if not (np.isfinite(length) and length != 0.0):
            raise PlanError(
                f"{described.name} moves by {length:g}, expected a length other than zero",
                "for example --length 1",
            )
        modes = tuple(m for _, m in machine.all_modes() if m.participation_of(described.name))
        spectrum = described.spectrum
        if spectrum is not None and not modes:
            modes = (_peak_of(described.name, spectrum),)
        elif spectrum is not None:
            raise PlanError(
                f"axis {described.name} has a spectrum and drives modes of the structure, too",
                "a map is of modes, or of a spectrum: take one of them out of a copy of the file",
            )
        if not modes:
            raise PlanError(
                f"axis {described.name} of {machine.source} excites no mode: nothing to map",
                f"describe its modes in the machine file (axes.{described.name}.modes)",
            )
        found = None if mode == ALL else _find_mode(modes, mode, described.name)
        return cls(machine, described, abs(length), Condition.of(condition), modes, found, spectrum)

    @property
    def unit(self) -> str:
        """Unit of lengths."""
        return "deg" if self.axis.rotary else "mm"

    @property
    def counted_modes(self) -> tuple[Mode, ...]:
        """The modes that the map is of."""
        return self.modes if self.mode is None else (self.mode,)

    @property
    def conventional_time(self) -> float:
        """What the controller's own G0 takes [s]."""
        return float(self._conventional().total[0])

    @property
    def time(self) -> float:
        """T_SUM: the conventional time, rounded up to whole intervals [s]."""
        return self._whole(self.conventional_time)

    @property
    def limit(self) -> Peaks:
        """What a designed profile may use."""
        limit = self.axis.limit
        return Peaks(*(np.array(x) for x in (limit.velocity, limit.acceleration, limit.jerk)))

    @property
    def conventional_peaks(self) -> Peaks:
        """What the controller's own G0 reaches; the jerk of a trapezoid is infinite."""
        profile = self._conventional()
        return Peaks(
            *(
                self.length * peak[0]
                for peak in (profile.peak_velocity, profile.peak_acceleration, profile.peak_jerk)
            )
        )

    def values(self, T1: Array, T_SUM: Array) -> Array:
        """The map over two axes [s]: amplitude of the mode [mm/s^2], or displacement [mm]."""
        if self.mode is not None:
            return self._amplitudes(self.mode, T1, T_SUM)
        if self.spectrum is not None:
            return self.displacement(self.modes[0], self._amplitudes(self.modes[0], T1, T_SUM))
        return displacement_map(
            self.length,
            T1,
            T_SUM,
            [m.frequency for m in self.modes],
            [m.damping for m in self.modes],
            [self._weight(m) for m in self.modes],
            self.condition,
        )

    def use(self, T1: Array, T_SUM: Array) -> Peaks:
        """How much of each limit every point uses, shapes (k, n); NaN where there is no profile."""
        column, row = np.meshgrid(T1, T_SUM)
        there = feasible(column, row)
        parts = limit_use(self.condition, self.length, column[there], row[there], self.limit)
        grids = [np.full(there.shape, np.nan) for _ in parts]
        for grid, part in zip(grids, parts, strict=True):
            grid[there] = part
        return Peaks(*grids)

    def amplitude(self, mode: Mode, T1: float, T_SUM: float) -> float:
        """What one mode keeps of a profile, for participation 1 [mm/s^2]."""
        return float(self._amplitudes(mode, T1, T_SUM).item())

    def _amplitudes(self, mode: Mode, T1: float | Array, T_SUM: float | Array) -> Array:
        """Amplitudes over T1 and T_SUM, for participation 1 [mm/s^2]: of the mode, or measured."""
        if self.spectrum is None:
            return amplitude_map(
                self.length, T1, T_SUM, mode.frequency, mode.damping, self.condition
            )
        square: Array = np.zeros(())
        for frequency, damping, weight in self.spectrum.oscillators():
            one = amplitude_map(self.length, T1, T_SUM, frequency, damping, self.condition)
            square = square + weight * one**2
        return np.sqrt(square)

    def displacement(self, mode: Mode, amplitude: Number) -> Number:
        """What an amplitude [mm/s^2] of a mode is at the tool, participation included [mm]."""
        return self._weight(mode) * amplitude / (2.0 * np.pi * mode.frequency) ** 2

    def conventional_amplitude(self, mode: Mode) -> float:
        """What one mode keeps of the controller's own G0, for participation 1 [mm/s^2]."""
        one = [(mode.frequency, mode.damping, 1.0)]
        parts = np.array(one if self.spectrum is None else self.spectrum.oscillators())
        frequency, damping, weight = parts.T
        poles = mode_poles(frequency, damping)
        unit = residual_displacement(profiles_response(self._conventional(), poles), poles)[0]
        amplitude = unit * self.length * (2.0 * np.pi * frequency) ** 2
        return float(np.sqrt((weight * amplitude**2).sum()))

    @property
    def conventional_value(self) -> float:
        """What the map would say of the controller's own G0 [mm/s^2] or [mm]."""
        if self.mode is not None:
            return self.conventional_amplitude(self.mode)
        return max(self.displacement(m, self.conventional_amplitude(m)) for m in self.modes)

    @property
    def dominant(self) -> Mode:
        """The mode of those judged that the controller's own G0 moves most."""
        return max(
            self.counted_modes, key=lambda m: self.displacement(m, self.conventional_amplitude(m))
        )

    def peaks(self, chosen: Chosen) -> Peaks:
        """Largest velocity, acceleration and jerk of a point's profile."""
        return condition_peaks(self.condition, self.length, chosen.T1, chosen.T_SUM)

    def choose(self) -> Chosen | None:
        """The best profile within the limits, in the conventional time if one fits into it.

        Returns
        -------
        Chosen or None
            At T_SUM, or at the least number of intervals above it into which a profile within the
            limits fits; T1 and T_SUM/2 - T1 are at least one interval. None where no time is long
            enough.
        """
        count = least = int(whole_intervals(np.array(self.time), self.machine.interval))
        while not self._fits(count):
            least, count = count + 1, 2 * count
            if count > MOST_INTERVALS:
                return None
        while least < count:
            middle = (least + count) // 2
            if self._fits(middle):
                count = middle
            else:
                least = middle + 1
        return self._best(count * self.machine.interval, within=True)

    def choose_freely(self) -> Chosen | None:
        """The best profile in the conventional time whatever the limits, as the paper has it.

        Returns
        -------
        Chosen or None
            T1 and T_SUM/2 - T1 are at least one interval; None where there are not four of them.
        """
        if self.time < 3.999 * self.machine.interval:
            return None
        return self._best(self.time, within=False)

    def _best(self, T: float, *, within: bool) -> Chosen:
        """The best T1 in a time, of those within the limits or of all."""
        low, high = self.machine.interval, 0.5 * T - self.machine.interval
        for _ in range(3):
            T1 = np.linspace(low, high, SEARCH)
            value = self.values(T1, np.array([T]))[0]
            if within:
                value[~self._within(T1, T)] = np.inf
            # Conditions I and II leave as much with T1 and T_SUM/2 - T1 exchanged: the shorter one.
            best = int(np.flatnonzero(value <= value.min() * WITHIN)[0])
            low, high = T1[max(best - 1, 0)], T1[min(best + 1, len(T1) - 1)]
        return Chosen(float(T1[best]), T, float(value[best]))

    def _conventional(self) -> Profiles:
        """The unit profile of the controller's own G0."""
        share = np.zeros((1, len(AXES)))
        share[0, AXES.index(self.axis.name)] = self.length
        return Task.of(self.machine, Modes.of(self.machine), share).conventional

    def nulls(self, T_SUM: Array, mode: Mode | None = None) -> Array:
        """T1 at which a mode without damping keeps nothing; see `null_curve`.

        Parameters
        ----------
        T_SUM : ndarray, shape (n,)
            [s]
        mode : Mode, optional
            The dominant one by default.

        Returns
        -------
        ndarray, shape (m, n)
            One row for each curve [s]; none but for Condition III.
        """
        if self.condition is not Condition.III:
            return np.empty((0, len(T_SUM)))
        return null_curve(T_SUM, (mode or self.dominant).frequency)

    def null_times(self, longest: float, mode: Mode) -> Array:
        """T_SUM up to a longest at which a mode without damping keeps nothing, whatever T1 [s].

        Only Condition II has such times, 2 n/f: its halves are alike, and cancel.
        """
        if self.condition is not Condition.II:
            return np.empty(0)
        count = int(0.5 * longest * mode.frequency * WITHIN)
        return np.asarray(2.0 * np.arange(1, count + 1) / mode.frequency, dtype=np.float64)

    def nearest_null(self, mode: Mode, T_SUM: float) -> tuple[float, float] | None:
        """T1 and T_SUM of the first exact null of a mode (without damping) from a time on [s].

        T_SUM is a whole number of intervals and T1 at least one; where a time has several, T1 is
        the longest, which asks for the least jerk.
        """
        if self.condition is not Condition.III:
            return None
        interval = self.machine.interval
        # A null exists in every time from 1.43 periods on, T1 at least one interval soon after.
        last = max(T_SUM, 2.0 / mode.frequency) + 16.0 * interval
        T = np.arange(round(T_SUM / interval), round(last / interval) + 1) * interval
        curve = null_curve(T, mode.frequency)
        there = np.flatnonzero((np.nan_to_num(curve) >= interval).any(axis=0))
        if not there.size:
            return None
        return float(np.nanmax(curve[:, there[0]])), float(T[there[0]])

    def axes(self, points: int, longest: float | None = None) -> tuple[Array, Array]:
        """T1 and T_SUM for a picture, evenly spaced.

        Parameters
        ----------
        points : int
            Of each axis.
        longest : float, optional
            End of T_SUM; by default the conventional time stands well inside. [s]

        Returns
        -------
        T1, T_SUM : ndarray, shape (points,)
            [s]

        Raises
        ------
        PlanError
            The longest time leaves no room.
        """
        low, high = self._range(longest)
        T = np.linspace(low, high, points)
        # Half a step off zero, so that the first column is the limit of short T1.
        first = 0.25 * high / points
        return np.linspace(first, 0.5 * high - first, points), T

    def interval_axes(self, longest: float | None = None) -> tuple[Array, Array]:
        """T1 and T_SUM on the command interval, for a table; as `axes` otherwise."""
        low, high = self._range(longest)
        first, last = (round(t / self.machine.interval) for t in (low, high))
        step = -(-(last - first) // MOST_POINTS) or 1
        T, T1 = np.arange(first, last + 1, step), np.arange(1, (last + 1) // 2, step)
        interval = np.float64(self.machine.interval)
        return np.multiply(T1, interval), np.multiply(T, interval)

    def _range(self, longest: float | None) -> tuple[float, float]:
        """Shortest and longest T_SUM of the map."""
        T, interval = self.time, self.machine.interval
        least = max(0.4 * T, 4.0 * interval)
        if longest is None:
            period = 1.0 / self.dominant.frequency
            return self._whole(least), self._whole(max(2.2 * T, min(3.0 * period, 4.0 * T)))
        if not (np.isfinite(longest) and longest >= least + interval):
            raise PlanError(
                f"the map would end at T_SUM = {longest:g} s, before it begins at {least:g} s",
                f"the conventional time is {T:g} s; for example --longest {2.0 * T:g}",
            )
        return self._whole(least), self._whole(longest)

    def _weight(self, mode: Mode) -> float:
        return abs(mode.participation_of(self.axis.name))

    def _whole(self, time: float) -> float:
        """A time rounded up to whole intervals."""
        interval = self.machine.interval
        return int(whole_intervals(np.array(time), interval)) * interval

    def _within(self, T1: Array, T: float) -> NDArray[np.bool_]:
        """Which T1 keep the limits."""
        use = np.stack(self.use(T1, np.array([T])))[:, 0]
        return np.asarray((use <= WITHIN).all(axis=0))

    def _fits(self, count: int) -> bool:
        """Whether a time of so many intervals has a profile within the limits."""
        interval = self.machine.interval
        if count < 4:
            return False
        T1 = np.linspace(interval, 0.5 * count * interval - interval, SEARCH)
        return bool(self._within(T1, count * interval).any())


def _peak_of(axis: str, spectrum: Spectrum) -> Mode:
    """The peak of a spectrum as a mode: its frequency, and the damping of the line there."""
    _, zeta, _ = min(spectrum.oscillators(), key=lambda one: abs(one[0] - spectrum.peak))
    participation = ((axis, spectrum.participation),)
    return Mode(f"peak of {PurePath(spectrum.source).name}", spectrum.peak, zeta, participation)


def _find_mode(modes: tuple[Mode, ...], wanted: str, axis: str) -> Mode:
    """The mode of that name, or of that number."""
    for k, mode in enumerate(modes, start=1):
        if wanted in (mode.name, str(k)):
            return mode
    listed = ", ".join(f"{k} ({mode.name})" for k, mode in enumerate(modes, start=1))
    raise PlanError(
        f"axis {axis} excites no mode {wanted!r}", f"choose a number or a name: {listed}; or all"
    )
