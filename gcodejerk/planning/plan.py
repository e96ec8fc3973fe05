"""The planner: moves on a machine become time profiles, all moves of a program at once.

This module owns the decisions between the program and the physics: how long a move takes (its
conventional time, rounded up to whole intervals), which profiles compete, when the conventional one
stays, and why a move cannot be planned. Numbers are columns: one row a move, one row a profile.
"""

from __future__ import annotations

from dataclasses import InitVar, dataclass, field

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import (
    GRID_TOLERANCE,
    Profiles,
    SymmetricProfiles,
    conventional_profiles,
    four_segment_range,
    joined,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.condition3 import TIE
from gcodejerk.motion.shapers import SHAPERS, shaped_profile
from gcodejerk.planning.conventional import least_time
from gcodejerk.planning.designs import DESIGNS
from gcodejerk.planning.independent_axes import in_the_middle
from gcodejerk.planning.optima import Progress
from gcodejerk.planning.plans import STANDSTILL, Modes, Plans, path_length
from gcodejerk.planning.refusals import limit_error, time_error
from gcodejerk.planning.settling import settled
from gcodejerk.planning.sharing import joint_optima
from gcodejerk.planning.shortest_time import shortest
from gcodejerk.planning.task import Task, worst_at_arrival, worst_in_band
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.spread import Spread, here

PROFILES = ("conventional", *DESIGNS, "shortest", *SHAPERS)
"""All profiles that can be planned; those of `SHAPERS` add time and are for comparison."""
LEAST_GAIN = 0.02
"""Share of today's residual that a profile has to win: less is not worth the blocks."""
SMALL_GAIN = 0.1
"""The same where the machine settles later by a larger share, as a mean over the band."""
ROUNDED = 1.1
"""What rounding may make of the tolerance that `shortest` promises."""
MOST_INTERVALS = 100_000
"""Of one stream. A number without its decimal point would ask for more than fits into memory."""
GIVEN_T1 = "condition3"
"""The profile whose T1 may be given."""


def plan_moves(
    displacement: Array,
    machine: Machine,
    profile: str | None = None,
    *,
    reason: NDArray[np.uint8] | None = None,
    time: float | None = None,
    T1: float | None = None,
    progress: Progress | None = None,
    speed: Array | None = None,
    lone: NDArray[np.bool_] | None = None,
    as_today: bool = False,
    spread: Spread = here,
) -> Plans:
    """Plan moves, all of them together.

    Parameters
    ----------
    displacement : ndarray, shape (n, 9)
        Of each axis of `AXES`; not looked at where `reason` rules a move out. [mm] or [deg]
    machine : Machine
        Limits, modes and interval.
    profile : str, optional
        One of `PROFILES`; the machine's own by default.
    reason : ndarray of uint8, shape (n,), optional
        CERTAIN, or why a move must not be planned (an index in `REASONS`).
    time : float, optional
        T_SUM for all moves, in place of the conventional time rounded up. [s]
    T1 : float, optional
        T1 of a four-segment profile for all moves, in place of the best. [s]
    progress : callable, optional
        Called while optima are computed.
    speed : ndarray, shape (n,), optional
        What the controller's own rapid keeps to along the path, NaN where only the axes limit it.
        [mm/s]
    lone : ndarray of bool, shape (n,), optional
        No other motion follows directly (`Axis.conventional`); all of them by default.
    as_today : bool, optional
        Profile `conventional` as the controller has it, also where a stream could not be written
        within the limits: to look at, not to emit.
    spread : Spread, optional
        Who searches.

    Returns
    -------
    Plans
        With the reasons of this module added.

    Raises
    ------
    PlanError
        The profile is unknown, or `time` or `T1` is not possible within the limits.
    """
    if T1 is not None and profile not in (None, GIVEN_T1):
        raise PlanError(
            f"a T1 makes a profile of four segments, {GIVEN_T1}, and no {profile}",
            "leave out T1, or the profile",
        )
    profile = profile or (machine.design.profile if T1 is None else GIVEN_T1)
    if profile not in PROFILES:
        raise PlanError(
            f"there is no profile {profile!r}",
            f"choose one of {', '.join(PROFILES)} (--profile, or the machine's design.profile)",
        )
    reason = np.full(len(displacement), CERTAIN, np.uint8) if reason is None else reason.copy()
    out = reason != CERTAIN
    displacement = np.where(out[:, np.newaxis], 0.0, displacement)
    displacement = np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0)
    length = path_length(displacement, machine)
    known = np.array([axis in machine.axis_names for axis in AXES])
    rule_out(reason, (length == 0.0), Reason.NO_MOTION)
    rule_out(reason, (displacement[:, ~known] != 0.0).any(axis=1), Reason.AXIS_UNKNOWN)
    longest = MOST_INTERVALS * machine.interval
    rule_out(reason, least_time(displacement, machine) > longest, Reason.TOO_LONG)
    if time is not None and time > longest:
        raise PlanError(
            f"the time is {time:g} s, more than {MOST_INTERVALS} intervals ({longest:g} s)",
            "give a shorter one",
        )
    return _Planner(
        machine=machine,
        profile=profile,
        displacement=displacement,
        length=length,
        reason=reason,
        time=time,
        T1=T1,
        as_today=as_today,
        progress=progress,
        speed=speed,
        lone=lone,
        spread=spread,
    ).run()


def rule_out(reason: NDArray[np.uint8], where: NDArray[np.bool_], why: Reason) -> None:
    """Give a reason to the moves that have none yet."""
    reason[where & (reason == CERTAIN)] = REASONS.index(why)


@dataclass(kw_only=True, slots=True, eq=False)
class _Planner:
    """One call of `plan_moves`: its profiles, from limits to designs."""

    machine: Machine
    profile: str
    displacement: Array
    length: Array
    reason: NDArray[np.uint8]
    time: float | None
    T1: float | None
    as_today: bool
    progress: InitVar[Progress | None]
    speed: InitVar[Array | None]
    lone: InitVar[NDArray[np.bool_] | None]
    spread: InitVar[Spread]
    modes: Modes = field(init=False)
    interval: float = field(init=False)
    move: NDArray[np.int64] = field(init=False)
    share: Array = field(init=False)
    task: Task = field(init=False)
    limits: tuple[Array, Array, Array] = field(init=False)
    conventional: Profiles = field(init=False)
    judged: tuple[Array, Array] | None = field(init=False, default=None)
    """What the profiles' moves leave at worst over the band, and what today's do [mm]."""

    def __post_init__(
        self,
        progress: Progress | None,
        speed: Array | None,
        lone: NDArray[np.bool_] | None,
        spread: Spread,
    ) -> None:
        self.modes, self.interval = Modes.of(self.machine), self.machine.interval
        rows = np.nonzero(self.reason == CERTAIN)[0]
        if self.machine.positioning == "linear":
            self.move, self.share = rows.astype(np.int64), self.displacement[rows]
        else:
            index, axis = np.nonzero(self.displacement[rows] != 0.0)
            self.move = rows[index].astype(np.int64)
            self.share = np.zeros((len(index), len(AXES)))
            self.share[np.arange(len(index)), axis] = self.displacement[self.move, axis]
        cap = None if speed is None else speed[self.move] / self.length[self.move]
        alone = None if lone is None else lone[self.move]
        self.task = Task.of(
            self.machine, self.modes, self.share,
            progress=progress, speed=cap, lone=alone, spread=spread,
        )  # fmt: skip
        self.limits, self.conventional = self.task.limits, self.task.conventional

    def run(self) -> Plans:
        """Design every profile, then gather the moves."""
        total = (
            self.conventional.total if self.time is None else np.full(len(self.share), self.time)
        )
        counts = np.maximum(whole_intervals(total, self.interval), 1)
        if self.profile == "conventional":
            profiles, feasible = self._conventional(counts)
        elif self.profile in SHAPERS:
            profiles, counts, feasible = self._shaped()
        elif self.T1 is not None:
            profiles, feasible = self._given_T1(counts)
        elif self.profile == "shortest":
            profiles, counts, feasible = self._shortest(counts)
        else:
            profiles, counts, feasible = self._designed(counts)
        self._rule_out_profiles(~feasible, Reason.LIMITS)
        return self._plans(profiles, counts)

    def _conventional(self, counts: NDArray[np.int64]) -> tuple[Profiles, NDArray[np.bool_]]:
        """The controller's own profiles; a trapezoid cannot be written with finite jerk."""
        profiles = self.conventional
        if self.as_today:
            return profiles, np.ones(len(profiles), dtype=bool)
        if self.time is not None:
            profiles = profiles.stretched(counts * self.interval / profiles.total)
        return profiles, self._within_limits(profiles)

    def _within_limits(self, profiles: Profiles) -> NDArray[np.bool_]:
        """Whether profiles keep the limits of a designed profile."""
        V, A, J = (limit * (1.0 + 1e-9) for limit in self.limits)
        jerk = profiles.peak_jerk
        fits: NDArray[np.bool_] = (profiles.peak_velocity <= V) & (profiles.peak_acceleration <= A)
        return fits & (jerk <= J) & np.isfinite(jerk)

    def _shaped(self) -> tuple[Profiles, NDArray[np.int64], NDArray[np.bool_]]:
        """The conventional profiles behind an input shaper, for the mode that shakes most."""
        if self.time is not None:
            raise PlanError(
                f"the time of profile {self.profile} follows from its shaper",
                "leave out --time, or choose another profile",
            )
        profiles, modes = self.conventional, self.modes
        if len(modes.poles):
            frequency = np.abs(modes.poles[self.task.objective.dominant(profiles)]) / (2.0 * np.pi)
            profiles = joined(
                [
                    shaped_profile(
                        profiles.take(np.array([row])), self.profile, float(frequency[row])
                    )
                    for row in range(len(profiles))
                ]
            )
        fits = self._within_limits(self.conventional)
        return profiles, whole_intervals(profiles.total, self.interval), fits

    def _given_T1(self, counts: NDArray[np.int64]) -> tuple[Profiles, NDArray[np.bool_]]:
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
        profiles = SymmetricProfiles(T1, zero, 0.5 * total - T1, zero)
        tolerance = 1e-9 * self.interval
        bad = ~((low - tolerance <= T1) & (high + tolerance >= T1))
        if bad.any():
            row = int(np.nonzero(bad)[0][0])
            raise limit_error(
                self.machine, self.share[row], profiles.take(slice(row, row + 1)),
                f"with T1 = {self.T1:g} s ",
            )  # fmt: skip
        return profiles.general(), ~bad

    def _shortest(
        self, least: NDArray[np.int64]
    ) -> tuple[Profiles, NDArray[np.int64], NDArray[np.bool_]]:
        """The least time in which the vibration stays within the tolerance."""
        if self.time is not None:
            raise PlanError(
                "the time of profile shortest is what it looks for",
                "leave out --time, or choose profile optimal",
            )
        profiles, worst, counts = shortest(self.task)
        left = worst
        if self.machine.positioning != "linear":
            # Each axis is quiet enough by itself: together they may not be.
            left, today = self._at_arrival(profiles, worst)
            loud = np.isfinite(left) & (left > np.maximum(today, self.machine.design.tolerance))
            self._rule_out_profiles(loud, Reason.NOT_BETTER)
        self.judged = left, np.full(len(left), ROUNDED * self.machine.design.tolerance)
        return profiles, counts, np.isfinite(worst)

    def _designed(
        self, counts: NDArray[np.int64]
    ) -> tuple[Profiles, NDArray[np.int64], NDArray[np.bool_]]:
        """A profile of unchanged time; longer only where the limits leave no room."""
        profiles, worst = DESIGNS[self.profile](self.task.after(counts))
        if self.time is None:
            reference = worst_in_band(self.task, self.conventional)
            fits = self._within_limits(self.conventional)
            # Where only today's rapid is within the limits, nothing is better, and none is longer.
            alone = fits & ~np.isfinite(worst)
            worst = np.where(alone, reference, worst)
            profiles, counts, worst = self._extend(profiles, counts, worst)
            useless = np.isfinite(worst) & ~self._worthwhile(worst, reference)
            if self.machine.positioning != "linear":
                # Axes that run on their own: one may keep what it has while another gains.
                off = np.isfinite(worst) & ~in_the_middle(profiles, self.conventional.total)
                useless |= off
                in_time = self.conventional.total <= counts * self.interval * (1.0 + 1e-9)
                keeps = useless & fits & (alone | in_time)
                self._rule_out_profiles(off & ~keeps, Reason.NOT_BETTER)
                profiles = profiles.replaced(keeps, self.conventional.take(keeps))
                worst, reference = self._at_arrival(profiles, worst)
                if self.profile == "optimal":
                    profiles, worst = joint_optima(
                        self.task.after(counts), self.modes, self.move, self.share, profiles,
                        worst, reference,
                    )  # fmt: skip
                useless = np.isfinite(worst) & ~self._worthwhile(worst, reference)
            self._rule_out_profiles(useless, Reason.NOT_BETTER)
            kept = np.divide(worst, reference, out=np.ones(len(worst)), where=reference > 0.0)
            little = np.isfinite(worst) & ~useless & (kept > 1.0 - SMALL_GAIN)
            self._rule_out_profiles(self._later(profiles, little, kept), Reason.LATER)
            self.judged = worst, reference
        elif not np.isfinite(worst).all():
            row = int(np.nonzero(~np.isfinite(worst))[0][0])
            limits = tuple(limit[row : row + 1] for limit in self.limits)
            total = float(counts[row] * self.interval)
            raise time_error(self.machine, self.share[row], limits, total, self.profile)
        return profiles, counts, np.isfinite(worst)

    def _at_arrival(self, profiles: Profiles, worst: Array) -> tuple[Array, Array]:
        """What the profiles of a move leave together, and today's; of each profile [mm]."""
        _, move = np.unique(self.move, return_inverse=True)
        fits = np.ones(len(self.reason), dtype=bool)
        fits[self.move[~np.isfinite(worst)]] = False
        band = self.machine.design.band
        left, today = (
            worst_at_arrival(self.modes, band, move, self.share, own)[move]
            for own in (profiles, self.conventional)
        )
        return np.where(fits[self.move], left, np.inf), today

    def _extend(
        self, profiles: Profiles, counts: NDArray[np.int64], worst: Array
    ) -> tuple[Profiles, NDArray[np.int64], Array]:
        """The least feasible time, at most `max_extension` longer, where T_SUM is impossible.

        What is possible in a time is so in any longer one: steps grow until it is, and the last of
        them is halved.
        """
        rows = np.nonzero(~np.isfinite(worst))[0]
        if not len(rows):
            return profiles, counts, worst
        counts = counts.copy()
        longest = (1.0 + self.machine.design.max_extension) * self.conventional.total
        most = np.floor(longest / self.interval + GRID_TOLERANCE).astype(np.int64)
        fastest = conventional_profiles(*self.limits, self.interval).total
        # Impossible, and possible: beyond what is allowed, as long as nothing is.
        low = np.maximum(counts, whole_intervals(fastest, self.interval) - 1)
        high, step = most + 1, 1
        while len(rows := rows[high[rows] - low[rows] > 1]):
            begin, end = low[rows], high[rows]
            leap = np.minimum(begin + step, most[rows])
            counts[rows] = np.where(end <= most[rows], (begin + end) // 2, leap)
            found, value = DESIGNS[self.profile](self.task.after(counts).take(rows))
            done = np.isfinite(value)
            profiles = profiles.replaced(rows[done], found.take(done))
            worst[rows[done]] = value[done]
            high[rows[done]], low[rows[~done]] = counts[rows[done]], counts[rows[~done]]
            step *= 2
        return profiles, np.where(high <= most, high, counts), worst

    def _worthwhile(self, worst: Array, reference: Array) -> NDArray[np.bool_]:
        """Whether a gain is more than what judging at single frequencies and rounding may hide."""
        resolution = np.array(
            [self.machine.axis(a).resolution if a in self.machine.axis_names else 0.0 for a in AXES]
        )
        excited = np.abs(self.modes.participation) * np.abs(self.modes.poles)[:, np.newaxis]
        each = np.where(self.share != 0.0, 1.0, 0.0) @ (excited * resolution).T * self.interval
        noise: Array = np.minimum(each, 1.0).max(axis=1, initial=0.0)
        # The optimum promises the least there is; what rounding spoils of it, its stream tells.
        noise = np.full(len(noise), TIE) if self.profile == "optimal" else noise
        better: NDArray[np.bool_] = worst < (1.0 - LEAST_GAIN) * reference - noise
        return better

    def _later(self, profiles: Profiles, some: NDArray[np.bool_], kept: Array) -> NDArray[np.bool_]:
        """Which of some settle later than today by a larger share than the one that they gain."""
        later = np.zeros(len(some), dtype=bool)
        if some.any():
            move = np.unique(self.move[some], return_inverse=True)[1].astype(np.int64)
            what = (self.modes, self.machine, move, self.share[some])
            today, planned = (settled(*what, p.take(some)) for p in (self.conventional, profiles))
            later[some] = planned[move] * kept[some] > today[move]
        return later

    def _rule_out_profiles(self, where: NDArray[np.bool_], why: Reason) -> None:
        """Give a reason to the moves of these profiles."""
        moves = np.zeros(len(self.reason), dtype=bool)
        moves[self.move[where]] = True
        rule_out(self.reason, moves, why)

    def _plans(self, profiles: Profiles, counts: NDArray[np.int64]) -> Plans:
        """The profiles of planned moves, and the moves' own columns."""
        conventional_time = np.zeros(len(self.reason))
        np.maximum.at(conventional_time, self.move, self.conventional.total)
        in_band = np.full((2, len(self.reason)), np.nan)
        if self.judged is not None:
            in_band[:, self.move] = self.judged
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
            profiles=profiles.take(keep),
            conventional=self.conventional.take(keep),
            profile_counts=counts[keep],
            designed=self.profile,
            worst_in_band=in_band[0],
            most_in_band=in_band[1],
            has_to_gain=self.profile in DESIGNS and self.time is None and self.T1 is None,
        )
