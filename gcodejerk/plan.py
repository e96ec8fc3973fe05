"""The planner: moves on a machine become time laws, all moves of a program at once.

This module owns the decisions between the program and the physics: how long a move takes (its
conventional time, rounded up to whole intervals), which laws compete, when the conventional one
stays, and why a move cannot be planned. Numbers are columns: one row a move, one row a law.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import PlanError
from gcodejerk.machine import AXES, Machine
from gcodejerk.motion import (
    GRID_TOLERANCE,
    SymmetricLaws,
    conventional_laws,
    design_condition3,
    design_four_segments,
    four_segment_range,
    symmetric_response,
    whole_intervals,
)
from gcodejerk.motion.laws import Array
from gcodejerk.nc import Rapids
from gcodejerk.plans import Modes, Plans
from gcodejerk.reasons import CERTAIN, REASONS, Reason

PROFILES = ("condition3", "conventional")
"""The profiles that this version designs."""
STANDSTILL = 1e-9
"""An axis that moves less than this does not move [mm] or [deg]."""


def path_length(displacement: Array, machine: Machine) -> Array:
    """Length of straight moves: of the linear axes, or of the rotary ones where only they move.

    Parameters
    ----------
    displacement : ndarray, shape (n, 9)
        Of each axis. [mm] or [deg]
    machine : Machine
        Tells which axes are rotary.

    Returns
    -------
    ndarray, shape (n,)
        [mm] or [deg]
    """
    rotary = np.array([_is_rotary(machine, axis) for axis in AXES])
    linear = np.sqrt((displacement[:, ~rotary] ** 2).sum(axis=1))
    turning = np.sqrt((displacement[:, rotary] ** 2).sum(axis=1))
    length: Array = np.where(linear > STANDSTILL, linear, turning)
    return length


def plan_moves(
    displacement: Array,
    machine: Machine,
    profile: str | None = None,
    reason: NDArray[np.uint8] | None = None,
    time: float | None = None,
    T1: float | None = None,
) -> Plans:
    """Plan moves, all of them together.

    Parameters
    ----------
    displacement : ndarray, shape (n, 9)
        Of each axis of `AXES`; not looked at where `reason` rules a move out. [mm] or [deg]
    machine : Machine
        Limits, modes and interval.
    profile : str, optional
        `condition3` or `conventional`; the machine's own by default.
    reason : ndarray of uint8, shape (n,), optional
        CERTAIN, or why a move must not be planned (an index in `REASONS`).
    time : float, optional
        T_SUM for all moves, in place of the conventional time rounded up. [s]
    T1 : float, optional
        T1 of a four-segment law for all moves, in place of the best. [s]

    Returns
    -------
    Plans
        With the reasons of this module added.

    Raises
    ------
    PlanError
        The profile is unknown, or `time` or `T1` is not possible within the limits.
    """
    profile = profile or machine.design.profile
    if profile not in PROFILES:
        raise PlanError(
            f"profile {profile!r} is not available in this version",
            f"choose one of {', '.join(PROFILES)} (--profile, or the machine's design.profile)",
        )
    reason = np.full(len(displacement), CERTAIN, np.uint8) if reason is None else reason.copy()
    out = reason != CERTAIN
    displacement = np.where(out[:, np.newaxis], 0.0, displacement)
    displacement = np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0)
    length = path_length(displacement, machine)
    known = np.array([axis in machine.axis_names for axis in AXES])
    _rule_out(reason, (length == 0.0), Reason.NO_MOTION)
    _rule_out(reason, (displacement[:, ~known] != 0.0).any(axis=1), Reason.AXIS_UNKNOWN)
    return _Planner(machine, profile, displacement, length, reason, time, T1).run()


def plan_rapids(rapids: Rapids, machine: Machine, profile: str | None = None) -> Plans:
    """Plan the rapids of a program, all of them together.

    Parameters
    ----------
    rapids : Rapids
        As `nc.read_program` finds them.
    machine : Machine
        Limits, modes, travel and interval.
    profile : str, optional
        The machine's own by default.

    Returns
    -------
    Plans
        Row i is rapid i.

    Raises
    ------
    PlanError
        The profile is unknown.
    """
    reason = rapids.reason.copy()
    known = sum(1 << AXES.index(name) for name in machine.axis_names)
    foreign = (rapids.words & ~np.uint16(known)) != 0
    # The machine file is what the user can mend, whatever the program leaves open besides.
    reason[foreign & (reason == REASONS.index(Reason.START_UNKNOWN))] = CERTAIN
    _rule_out(reason, foreign, Reason.AXIS_UNKNOWN)
    for axis in machine.axes:
        if axis.travel is None:
            continue
        k = AXES.index(axis.name)
        low, high = axis.travel[0] - axis.resolution, axis.travel[1] + axis.resolution
        # Unknown offsets give NaN, and NaN is beyond nothing.
        for position in (rapids.start[:, k], rapids.target[:, k]):
            where = position + rapids.offset[:, k]
            named = (rapids.words >> k & 1) != 0
            _rule_out(reason, named & ((where < low) | (where > high)), Reason.BEYOND_TRAVEL)
    displacement = np.where((reason == CERTAIN)[:, np.newaxis], rapids.target - rapids.start, 0.0)
    length = path_length(np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0), machine)
    _rule_out(reason, length == 0.0, Reason.NO_MOTION)
    _rule_out(reason, length < machine.design.minimum_length * (1.0 - 1e-9), Reason.TOO_SHORT)
    return plan_moves(displacement, machine, profile, reason)


def _is_rotary(machine: Machine, axis: str) -> bool:
    """Whether an axis turns; one that the machine lacks is what its letter says."""
    if axis in machine.axis_names:
        return machine.axis(axis).rotary
    return axis in "ABC"


def _squeezed(fastest: SymmetricLaws, total: float, interval: float) -> SymmetricLaws:
    """One law squeezed into a shorter time, its segments no shorter than the interval."""
    stretch = total / fastest.total
    ramp = np.clip(fastest.T1 * stretch, interval, 0.25 * total)
    Ta = np.clip(fastest.Ta * stretch, 0.0, 0.5 * total - 2.0 * ramp)
    return SymmetricLaws(ramp, Ta, ramp, total - 4.0 * ramp - 2.0 * Ta)


def _rule_out(reason: NDArray[np.uint8], where: NDArray[np.bool_], why: Reason) -> None:
    """Give a reason to the moves that have none yet."""
    reason[where & (reason == CERTAIN)] = REASONS.index(why)


class _Planner:
    """One call of `plan_moves`: its laws, from limits to designs."""

    def __init__(
        self,
        machine: Machine,
        profile: str,
        displacement: Array,
        length: Array,
        reason: NDArray[np.uint8],
        time: float | None,
        T1: float | None,
    ) -> None:
        self.machine, self.profile, self.time, self.T1 = machine, profile, time, T1
        self.displacement, self.length, self.reason = displacement, length, reason
        self.modes = Modes.of(machine)
        self.interval = machine.interval
        rows = np.nonzero(reason == CERTAIN)[0]
        if machine.positioning == "linear":
            self.move, self.share = rows, displacement[rows]
        else:
            index, axis = np.nonzero(displacement[rows] != 0.0)
            self.move = rows[index]
            self.share = np.zeros((len(index), len(AXES)))
            self.share[np.arange(len(index)), axis] = displacement[self.move, axis]
        self.move = self.move.astype(np.int64)
        self.limits = self._unit_limits("limit")
        rapid = self._unit_limits("rapid")
        self.conventional = conventional_laws(*rapid)
        self.weights: Array = np.abs(self.share @ self.modes.participation.T)

    def run(self) -> Plans:
        """Design every law, then gather the moves."""
        total = (
            self.conventional.total if self.time is None else np.full(len(self.share), self.time)
        )
        counts = whole_intervals(total, self.interval)
        counts = np.maximum(counts, 1)
        if self.profile == "conventional":
            laws, feasible = self._conventional(counts)
            kept = np.ones(len(counts), dtype=bool)
        elif self.T1 is not None:
            laws, feasible = self._given_T1(counts)
            kept = np.zeros(len(counts), dtype=bool)
        else:
            laws, counts, feasible, kept = self._designed(counts)
        self._rule_out_laws(~feasible, Reason.LIMITS)
        return self._plans(laws, counts, kept)

    def _unit_limits(self, which: str) -> tuple[Array, Array, Array]:
        """Limits of the unit laws: each axis's, divided by its displacement."""
        limits = {axis.name: getattr(axis, which) for axis in self.machine.axes}
        columns = []
        for quantity in ("velocity", "acceleration", "jerk"):
            axes = np.array([getattr(limits[a], quantity) if a in limits else np.inf for a in AXES])
            with np.errstate(divide="ignore"):
                columns.append((axes / np.abs(self.share)).min(axis=1, initial=np.inf))
        return columns[0], columns[1], columns[2]

    def _conventional(self, counts: NDArray[np.int64]) -> tuple[SymmetricLaws, NDArray[np.bool_]]:
        """The controller's own laws; a trapezoid cannot be written with finite jerk."""
        laws = self.conventional
        if self.time is not None:
            stretch = counts * self.interval / laws.total
            laws = SymmetricLaws(*(column * stretch for column in laws.columns()))
        return laws, self._within_limits(laws)

    def _within_limits(self, laws: SymmetricLaws) -> NDArray[np.bool_]:
        """Whether laws keep the limits of a designed profile."""
        V, A, J = (limit * (1.0 + 1e-9) for limit in self.limits)
        jerk = laws.jerk
        return (laws.velocity <= V) & (laws.acceleration <= A) & (jerk <= J) & np.isfinite(jerk)

    def _given_T1(self, counts: NDArray[np.int64]) -> tuple[SymmetricLaws, NDArray[np.bool_]]:
        """Four segments with the T1 that the user asked for."""
        assert self.T1 is not None
        total: Array = np.asarray(counts * self.interval, dtype=float)
        if not np.all((self.T1 > 0.0) & (0.5 * total > self.T1)):
            shortest = 0.5 * float(total.min(initial=np.inf))
            raise PlanError(
                f"T1 is {self.T1:g} s, outside 0 < T1 < T_SUM/2 = {shortest:g} s",
                "give a T1 between these, for example --T1 0.001",
            )
        low, high = four_segment_range(total, *self.limits, self.interval)
        T1 = np.full(len(total), self.T1)
        zero = np.zeros(len(total))
        laws = SymmetricLaws(T1, zero, 0.5 * total - T1, zero)
        tolerance = 1e-9 * self.interval
        bad = ~((low - tolerance <= T1) & (high + tolerance >= T1))
        if bad.any():
            row = int(np.nonzero(bad)[0][0])
            raise self._limit_error(laws, row, f"with T1 = {self.T1:g} s ")
        return laws, ~bad

    def _designed(
        self, counts: NDArray[np.int64]
    ) -> tuple[SymmetricLaws, NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Condition III of unchanged time; longer only where the limits leave no room."""
        laws, worst = self._search(counts, np.arange(len(counts)))
        kept = np.zeros(len(counts), dtype=bool)
        fits = self._within_limits(self.conventional)
        if self.time is None:
            reference = self._worst(self.conventional)
            keep = fits & (worst >= reference - self._noise())
            laws = laws.replaced(keep, self.conventional.take(keep))
            worst = np.where(keep, reference, worst)
            kept |= keep
            laws, counts, worst = self._extend(laws, counts, worst)
            # A trapezoid cannot be written: where the design shakes more, it is left alone.
            worse = ~fits & np.isfinite(worst) & (worst > reference)
            self._rule_out_laws(worse, Reason.NOT_BETTER)
        elif not np.isfinite(worst).all():
            row = int(np.nonzero(~np.isfinite(worst))[0][0])
            raise self._time_error(row, counts[row] * self.interval)
        return laws, counts, np.isfinite(worst), kept

    def _search(
        self, counts: NDArray[np.int64], rows: NDArray[np.intp]
    ) -> tuple[SymmetricLaws, Array]:
        """The best laws for these rows; the worst residual is infinite where there is none."""
        total: Array = np.asarray(counts[rows] * self.interval, dtype=float)
        V, A, J = (limit[rows] for limit in self.limits)
        weights, conventional = self.weights[rows], self.conventional.take(rows)
        # Four segments where the conventional law has them: it is then a member of the family.
        four = (conventional.Ta == 0.0) & (conventional.Tv == 0.0)
        low, high = four_segment_range(total, V, A, J, self.interval)
        four &= low <= high
        poles = self.modes.poles
        zero = np.zeros(len(rows))
        laws, worst = SymmetricLaws(zero, zero, zero, zero), np.full(len(rows), np.inf)
        for chosen, part in ((four, "four"), (~four, "general")):
            index = np.nonzero(chosen)[0]
            if part == "four":
                found, value = design_four_segments(
                    total[index], low[index], high[index], poles, weights[index]
                )
            else:
                found, value, _ = design_condition3(
                    total[index], V[index], A[index], J[index], poles, weights[index],
                    self.interval, conventional.take(index),
                )  # fmt: skip
            laws = laws.replaced(index, found)
            worst[index] = value
        return laws, worst

    def _extend(
        self, laws: SymmetricLaws, counts: NDArray[np.int64], worst: Array
    ) -> tuple[SymmetricLaws, NDArray[np.int64], Array]:
        """The least feasible time, at most `max_extension` longer, where T_SUM is impossible."""
        rows = np.nonzero(~np.isfinite(worst))[0]
        if not len(rows):
            return laws, counts, worst
        counts = counts.copy()
        longest = (1.0 + self.machine.design.max_extension) * self.conventional.total
        most = np.floor(longest / self.interval + GRID_TOLERANCE).astype(np.int64)
        fastest = conventional_laws(*self.limits, self.interval).total
        least = whole_intervals(fastest, self.interval)
        counts[rows] = np.maximum(counts[rows] + 1, least[rows])
        for _ in range(8):
            rows = rows[counts[rows] <= most[rows]]
            if not len(rows):
                break
            found, value = self._search(counts, rows)
            done = np.isfinite(value)
            laws = laws.replaced(rows[done], found.take(done))
            worst[rows[done]] = value[done]
            rows = rows[~done]
            counts[rows] += 1
        return laws, counts, worst

    def _worst(self, laws: SymmetricLaws) -> Array:
        """Largest residual displacement of laws over the modes [mm]."""
        poles = self.modes.poles
        amplitude = np.abs(symmetric_response(laws, poles)) / poles.imag * self.weights
        worst: Array = amplitude.max(axis=1, initial=0.0)
        return worst

    def _noise(self) -> Array:
        """What rounding may add to a residual: below this a design has gained nothing [mm]."""
        resolution = np.array(
            [self.machine.axis(a).resolution if a in self.machine.axis_names else 0.0 for a in AXES]
        )
        excited = np.abs(self.modes.participation) * np.abs(self.modes.poles)[:, np.newaxis]
        each = np.where(self.share != 0.0, 1.0, 0.0) @ (excited * resolution).T * self.interval
        noise: Array = np.minimum(each, 1.0).max(axis=1, initial=0.0)
        return noise

    def _rule_out_laws(self, where: NDArray[np.bool_], why: Reason) -> None:
        """Give a reason to the moves of these laws."""
        moves = np.zeros(len(self.reason), dtype=bool)
        moves[self.move[where]] = True
        _rule_out(self.reason, moves, why)

    def _plans(
        self, laws: SymmetricLaws, counts: NDArray[np.int64], kept: NDArray[np.bool_]
    ) -> Plans:
        """The laws of planned moves, and the moves' own columns."""
        conventional_time = np.zeros(len(self.reason))
        np.maximum.at(conventional_time, self.move, self.conventional.total)
        keep = np.nonzero(self.reason[self.move] == CERTAIN)[0]
        move_counts = np.zeros(len(self.reason), dtype=np.int64)
        np.maximum.at(move_counts, self.move[keep], counts[keep])
        return Plans(
            machine=self.machine,
            modes=self.modes,
            reason=self.reason,
            displacement=self.displacement,
            length=self.length,
            conventional_time=conventional_time,
            counts=move_counts,
            move=self.move[keep],
            share=self.share[keep],
            laws=laws.take(keep).general(),
            conventional=self.conventional.take(keep).general(),
            law_counts=counts[keep],
            kept=kept[keep],
        )

    def _limit_error(self, laws: SymmetricLaws, row: int, how: str) -> PlanError:
        """Which axis passes which limit, in the words of its unit."""
        law = laws.take(slice(row, row + 1))
        total = float(law.total[0])
        if float(np.minimum(law.T1, law.T2)[0]) < self.interval * (1.0 - 1e-9):
            return PlanError(
                f"T1 = {float(law.T1[0]):g} s leaves a segment shorter than the interval "
                f"of {self.interval:g} s",
                f"give a T1 from {self.interval:g} to {0.5 * total - self.interval:g} s",
            )
        units = {"velocity": "/s", "acceleration": "/s^2", "jerk": "/s^3"}
        for quantity in ("velocity", "acceleration", "jerk"):
            for axis in self.machine.axes:
                peak = float(
                    getattr(law, quantity)[0] * abs(self.share[row, AXES.index(axis.name)])
                )
                limit = getattr(axis.limit, quantity)
                if peak > limit * (1.0 + 1e-9):
                    unit = ("deg" if axis.rotary else "mm") + units[quantity]
                    return PlanError(
                        f"{how}axis {axis.name} reaches {peak:.6g} {unit} of {quantity} "
                        f"in {total:.3f} s, above its limit of {limit:.6g} {unit}",
                        f"allow more time (--time), or raise axes.{axis.name}.limit.{quantity}",
                    )
        raise AssertionError("a law outside its range keeps every limit")

    def _time_error(self, row: int, total: float) -> PlanError:
        """A time too short for the limits, with the least that would do."""
        V, A, J = (limit[row : row + 1] for limit in self.limits)
        fastest = conventional_laws(V, A, J, self.interval)
        least = float(whole_intervals(fastest.total, self.interval)[0] * self.interval)
        if total >= 4.0 * self.interval:
            law = _squeezed(fastest, total, self.interval)
            if bool((law.velocity > V) | (law.acceleration > A) | (law.jerk > J)):
                error = self._limit_error(law, row, "")
                return PlanError(
                    error.problem, f"allow at least {least:.6g} s (--time {least:.6g})"
                )
        return PlanError(
            f"no profile of {total:g} s keeps the limits and has segments of at least "
            f"{self.interval:g} s",
            f"allow at least {least:.6g} s (--time {least:.6g})",
        )
