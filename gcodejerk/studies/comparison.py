"""A comparison: one move, made by every profile and every shaper that this package knows.

This module owns the list of candidates for one move of a machine, and how they are judged: their
time, their peaks, what every mode keeps at its own frequency and within a band around it, and when
the machine has come to rest. It knows no file and draws nothing; `report.compare_record`,
`report.compare_table` and `report.compare_figure` do.

Rule 1: profiles are judged, not streams. What a mode keeps is exact for the profile itself, before
it is sampled and rounded; so a shaper's delays need no grid, and nothing is lost for anyone.

Rule 2: Conditions I and II compete at their best T1 whatever the limits say, as the paper has them;
shapers act on the controller's own profile, made for the mode that it shakes most. Everyone else
keeps the limits, as the planner sees to. Who breaks a limit says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import Profiles, joined, whole_intervals
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.socp import require_solver
from gcodejerk.motion.shapers import SHAPERS, shaped_profile
from gcodejerk.planning.arrival import arrival_response, worst_in_bands
from gcodejerk.planning.bounds import known_limits
from gcodejerk.planning.conventional import least_time
from gcodejerk.planning.designs import condition1, condition2
from gcodejerk.planning.move import check_time, displacement_row, not_planned
from gcodejerk.planning.plan import MOST_INTERVALS, plan_moves
from gcodejerk.planning.plans import STANDSTILL, Modes, Plans, path_length
from gcodejerk.planning.task import Task
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.studies.families import family_profiles
from gcodejerk.studies.steps import Progress, Steps

DESIGNED = ("condition3", "symmetric", "cascade", "optimal", "shortest")
"""Profiles that the planner makes, within the limits."""
CONTENDERS = ("conventional", "condition1", "condition2", *DESIGNED, *SHAPERS)
"""Everyone, in that order."""
STEPS = {
    **dict.fromkeys(("conventional", "condition1", "condition2", *DESIGNED, "limits"), 1),
    **{"optimal": 8, "shortest": 20, "judging": 10},
}
"""What is done, and about how long it takes where a move is long and modes are many."""
SOLVED = ("optimal", "shortest")
"""Profiles that need the solver."""
NEEDS_SOLVER = "needs gcodejerk[science]"
HELD = 1e-6
"""A limit that is passed by less than this share is kept."""
STAYS = {
    Reason.NOT_BETTER: "no better profile within the limits: the rapid stays as it is",
    Reason.LATER: "gains little and would settle later: the rapid stays as it is",
}
"""Reasons for which the rapid is today's, and what is said of it."""
QUANTITIES = ("velocity", "acceleration", "jerk")


@dataclass(frozen=True, slots=True, eq=False)
class Candidate:
    """One profile or shaper on the move.

    Attributes
    ----------
    name : str
        One of `CONTENDERS`.
    profiles : Profiles
        The unit profile, or one for each moving axis under independent positioning.
    displacement, acceleration : ndarray, shape (g,)
        What each entry of the machine's `Modes` keeps when the last axis has arrived. [mm],
        [mm/s^2]
    worst_band, worst_band_acceleration : tuple of float
        The largest of these over all entries, for any error of a frequency within each of
        `arrival.BANDS`. [mm], [mm/s^2]
    settling : float or None
        Time from the start until no mode's envelope is above the tolerance; None: never. [s]
    limit : float or None
        The least residual displacement of any profile that takes as many intervals and keeps the
        limits; None where it is not known. [mm]
    broken : tuple of (str, float)
        The limits that are broken, and how many times over. [-]
    note : str
        What else there is to say; may be empty.
    """

    name: str
    profiles: Profiles
    displacement: Array
    acceleration: Array
    worst_band: tuple[float, ...]
    worst_band_acceleration: tuple[float, ...]
    settling: float | None
    limit: float | None
    broken: tuple[tuple[str, float], ...]
    note: str

    @property
    def time(self) -> float:
        """When the last axis arrives [s]; of a shaper or today's G0 no whole intervals."""
        return float(self.profiles.total.max())

    @property
    def worst(self) -> float:
        """Largest residual displacement over the modes, at their own frequencies [mm]."""
        return float(self.displacement.max(initial=0.0))

    @property
    def within_limits(self) -> bool:
        """Whether every axis stays within its `limit`."""
        return not self.broken


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """All candidates on one move.

    Attributes
    ----------
    machine : Machine
        The machine that moves.
    displacement : dict of str to float
        What each axis moves. [mm] or [deg]
    modes : Modes
        The machine's modes.
    share : ndarray, shape (l, 9)
        Displacement of each axis that each profile carries. [mm] or [deg]
    candidates : tuple of Candidate
        Those that exist, in the order of `CONTENDERS`.
    absent : dict of str to str
        The others, and why.
    time : float
        T_SUM of the profiles that keep it. [s]
    shaped : tuple of (float, float)
        Frequency [Hz] and damping ratio that shapers were made for, one for each profile that has a
        shaper.
    families : tuple of Candidate
        The laws of controls at this machine's limits (`studies.families`); of none a limit.
    families_absent : dict of str to str
        The other laws, and why.
    """

    machine: Machine
    displacement: dict[str, float]
    modes: Modes
    share: Array
    candidates: tuple[Candidate, ...]
    absent: dict[str, str]
    time: float
    shaped: tuple[tuple[float, float], ...]
    families: tuple[Candidate, ...] = ()
    families_absent: dict[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Candidate:
        """The candidate of that name; KeyError where it is absent."""
        for candidate in self.candidates:
            if candidate.name == name:
                return candidate
        raise KeyError(name)

    @property
    def conventional_time(self) -> float:
        """What the controller's own G0 takes [s]."""
        return self["conventional"].time

    @property
    def excited(self) -> list[int]:
        """The entries of the modes that the move excites."""
        moving = (self.share != 0.0).any(axis=0)
        used = ((self.modes.participation != 0.0) & moving).any(axis=1)
        return sorted(set(self.modes.group[used].tolist()))

    @property
    def longest(self) -> str:
        """The axis that moves farthest."""
        return AXES[int(np.argmax(np.abs(self.share).max(axis=0)))]


def compare_move(
    displacement: Mapping[str, float],
    machine: Machine,
    *,
    time: float | None = None,
    shaper_damping: float | None = 0.0,
    progress: Progress | None = None,
) -> Comparison:
    """Make one move with every profile and every shaper.

    Parameters
    ----------
    displacement, machine
        As for `plan_move`.
    time : float, optional
        T_SUM of the profiles that keep it; the conventional time by default. [s]
    shaper_damping : float or None, optional
        Damping ratio that shapers are made for; None: that of the mode. [-]
    progress : callable, optional
        Called with what is being done, how much of the work is, and how much there is.

    Returns
    -------
    Comparison

    Raises
    ------
    MachineError
        The machine has no such axis.
    PlanError
        Nothing moves or shakes, a number is not possible, or no profile within the limits is fast
        enough for the time.

    Examples
    --------
    The case of the paper: Condition I at its best, which breaks limits, and a shaper:

    >>> from gcodejerk.machine import find_machine
    >>> paper = compare_move({"Z": 1.0}, Machine.load(find_machine("paper")))
    >>> [round(float(paper[name].acceleration[0]), 1) for name in ("conventional", "condition1")]
    [13209.3, 11777.1]
    >>> paper["condition1"].within_limits, round(paper["zv"].time, 5)
    (False, 0.05667)
    """
    row = displacement_row(displacement, machine)
    check_time(time, row, machine)
    row = np.where(np.abs(row) > STANDSTILL, row, 0.0)
    if not row.any():
        raise PlanError("no axis moves: nothing to compare", "for example Z=1")
    if least_time(row, machine)[0] > MOST_INTERVALS * machine.interval:
        raise not_planned(Reason.TOO_LONG)
    one = _Field(machine, row, time, shaper_damping, progress)
    if not one.task.objective.weights.any():
        moving = ", ".join(AXES[k] for k in np.flatnonzero(row[0]))
        raise PlanError(
            f"{moving} of {machine.source} excites no mode: nothing to compare",
            "describe modes in the machine file (axes.?.modes, or modes of the structure)",
        )
    one.enter()
    return one.judged({a.upper(): float(x) for a, x in displacement.items()})


class _Field:
    """The candidates of one move, as they enter, and how they are judged."""

    def __init__(
        self, machine: Machine, row: Array, time: float | None, damping: float | None,
        progress: Progress | None,
    ) -> None:  # fmt: skip
        self.machine, self.row, self.time, self.damping = machine, row, time, damping
        self.told = Steps(progress, STEPS)
        self.told("conventional")
        self.modes = Modes.of(machine)
        self.share = row if machine.positioning == "linear" else np.diag(row[0])[row[0] != 0.0]
        task = Task.of(machine, self.modes, self.share)
        counts = task.counts
        if time is not None:
            given = np.full(len(self.share), time)
            counts = np.maximum(whole_intervals(given, machine.interval), 1)
        self.task = task.after(counts)
        self.conventional = task.conventional
        self.weights = self.share @ self.modes.participation.T
        self.profiles: dict[str, Profiles] = {}
        self.notes: dict[str, str] = {}
        self.absent: dict[str, str] = {}
        self.shaped: list[tuple[float, float]] = []

    def enter(self) -> None:
        """Find the profiles of everyone."""
        self.profiles["conventional"] = self.conventional
        free = np.full(len(self.share), np.inf)
        unlimited = replace(self.task, limits=(free, free, free))
        for name, design in (("condition1", condition1), ("condition2", condition2)):
            self.told(name)
            found, worst = design(unlimited)
            if np.isfinite(worst).all():
                self.profiles[name] = found
            else:
                self.absent[name] = "four segments are shorter than the interval"
        self._enter_designs()
        targets = self._targets()
        for name in SHAPERS:
            self.profiles[name] = joined(
                [
                    self.conventional.take(slice(k, k + 1))
                    if target is None
                    else shaped_profile(self.conventional.take(slice(k, k + 1)), name, *target)
                    for k, target in enumerate(targets)
                ]
            )
        self.shaped = [target for target in targets if target is not None]
        frequency = [None if target is None else target[0] for target in targets]
        laws, notes, self.families_absent = family_profiles(self.machine, self.share, frequency)
        self.families = tuple(laws)
        self.profiles |= laws
        self.notes |= notes

    def _enter_designs(self) -> None:
        """What the planner makes, as it would make it."""
        refused: list[PlanError] = []
        solver = True
        try:
            require_solver()
        except PlanError:
            solver = False
        for name in DESIGNED:
            if name in SOLVED and not solver:
                self.absent[name] = NEEDS_SOLVER
                continue
            self.told(name)
            time = None if name == "shortest" else self.time
            try:
                plans = plan_moves(self.row, self.machine, name, time=time)
            except PlanError as error:
                refused.append(error)
                self.absent[name] = error.problem
                continue
            why = None if plans.reason[0] == CERTAIN else REASONS[plans.reason[0]]
            if why in STAYS:
                self.profiles[name] = self.conventional
                self.notes[name] = STAYS[why]
                continue
            if why is not None:
                self.absent[name] = str(why)
                continue
            self.profiles[name] = plans.profiles
            self.notes[name] = self._note(plans, name)
        # With a time of the user's choice: if nobody makes it, the time is what is wrong.
        if refused and not any(
            name in self.profiles for name in ("condition3", "symmetric", "cascade", "optimal")
        ):
            raise refused[0]

    def _note(self, plans: Plans, name: str) -> str:
        """What the planner had to do about it."""
        extra = int(plans.counts[0] - self.task.counts.max())
        if name != "shortest" and extra > 0:
            return f"{1e3 * extra * self.machine.interval:g} ms longer to keep the limits"
        return ""

    def _targets(self) -> list[tuple[float, float] | None]:
        """Frequency [Hz] and damping that the shaper of each profile is made for."""
        dominant = self.task.objective.dominant(self.conventional)
        out: list[tuple[float, float] | None] = []
        for k, mode in enumerate(dominant):
            pole = complex(self.modes.poles[mode])
            own = -pole.real / abs(pole)
            damping = own if self.damping is None else self.damping
            # An axis on its own that excites no mode needs no shaper.
            shakes = self.weights[k].any()
            out.append((abs(pole) / (2.0 * np.pi), damping) if shakes else None)
        return out

    def judged(self, displacement: dict[str, float]) -> Comparison:
        """Everyone's figures."""
        names = [name for name in CONTENDERS if name in self.profiles]
        self.told("limits")
        limits = known_limits(self._plans(names), None)
        bounds = {} if limits is None else dict(zip(names, limits.tolist(), strict=True))
        found = {}
        for done, name in enumerate((*names, *self.families)):
            self.told("judging", done / (len(names) + len(self.families)))
            found[name] = self._candidate(name, bounds.get(name, np.nan))
        absent = {name: self.absent[name] for name in CONTENDERS if name in self.absent}
        return Comparison(
            self.machine, displacement, self.modes, self.share,
            tuple(found[name] for name in names), absent,
            float(self.task.total.max()), tuple(self.shaped),
            tuple(found[name] for name in self.families), self.families_absent,
        )  # fmt: skip

    def _plans(self, names: list[str]) -> Plans:
        """The candidates as moves, side by side."""
        n, each = len(names), len(self.share)
        profiles = joined([self.profiles[name] for name in names])
        counts = np.maximum(whole_intervals(profiles.total, self.machine.interval), 1)
        displacement = np.tile(self.row, (n, 1))
        return Plans(
            machine=self.machine,
            modes=self.modes,
            reason=np.full(n, CERTAIN, np.uint8),
            displacement=displacement,
            length=path_length(displacement, self.machine),
            conventional_time=np.full(n, self.conventional.total.max()),
            counts=counts.reshape(n, each).max(axis=1),
            move=np.repeat(np.arange(n, dtype=np.int64), each),
            share=np.tile(self.share, (n, 1)),
            profiles=profiles,
            conventional=joined([self.conventional] * n),
            profile_counts=counts,
            designed=self.machine.design.profile,
            worst_in_band=np.full(n, np.nan),
            most_in_band=np.full(n, np.nan),
            has_to_gain=False,
        )

    def _candidate(self, name: str, limit: float) -> Candidate:
        """One candidate's figures."""
        profiles, modes = self.profiles[name], self.modes
        response = np.abs(arrival_response(profiles, self.weights, modes.poles))
        each = response / modes.poles.imag
        displacement = modes.grouped(each)
        broken = self._broken(profiles)
        if not broken and name in CONTENDERS:
            # Segments that end between intervals may be a little better than the bound on these.
            limit = min(limit, float(displacement.max()))
        bands = worst_in_bands(profiles, self.weights, modes)
        return Candidate(
            name=name,
            profiles=profiles,
            displacement=displacement,
            acceleration=modes.accelerations(each),
            worst_band=bands[0],
            worst_band_acceleration=bands[1],
            settling=self._settling(float(profiles.total.max()), displacement),
            limit=limit if np.isfinite(limit) else None,
            broken=broken,
            note=self.notes.get(name, ""),
        )

    def _broken(self, profiles: Profiles) -> tuple[tuple[str, float], ...]:
        """Limits that profiles break, with the largest share of any axis."""
        peaks = (profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk)
        out = []
        for quantity, peak, limit in zip(QUANTITIES, peaks, self.task.limits, strict=True):
            with np.errstate(invalid="ignore"):
                use = float(np.where(np.isinf(limit), 0.0, peak / limit).max())
            if use > 1.0 + HELD:
                out.append((quantity, use))
        return tuple(out)

    def _settling(self, arrival: float, displacement: Array) -> float | None:
        """When the last envelope has decayed to the tolerance [s]; None where one never does."""
        tolerance = self.machine.design.tolerance
        settled = arrival
        for mode, D in zip(self.modes.modes, displacement.tolist(), strict=True):
            if tolerance >= D:
                continue
            if mode.damping == 0.0:
                return None
            rate = mode.damping * 2.0 * np.pi * mode.frequency
            settled = max(settled, arrival + float(np.log(D / tolerance)) / rate)
        return settled
