"""Tuning: a control's settings for a shop's own rapids, beside what they are today.

This module owns the whole study of one control on one machine: what today's rapids take and leave,
the settings that leave least in no more time, what more or less time would buy, and how either
holds where the frequencies are not as written. It knows no control and writes nothing.

Rule: today is what the machine file says (`rapid`), whatever control is asked for; no setting may
take more time for all rapids together than that, unless the user says so.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion.families import filters
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.parameters.groups import Groups, concerned
from gcodejerk.parameters.judge import DAMPING, FILTER, MADE_FOR, Judge, Rows
from gcodejerk.parameters.moves import Moves
from gcodejerk.parameters.search import (
    WORST,
    Progress,
    goal_value,
    representatives,
)
from gcodejerk.parameters.settings import ALL, PATH, TODAY, Scheme
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task

SHARES = (0.9, 0.95, 1.05, 1.1, 1.25, 1.5)
"""Times that the curve looks at besides today's. [of today's]"""
SPREAD = np.linspace(-0.2, 0.2, 41)
"""Relative errors of all frequencies that robustness is drawn over."""
SWEPT = 61
"""Numbers of a setting that `Tuning.sweep` goes through at most."""
SLOWER, LONGEST_PERIODS, SHORTEST_RAMP = 6.0, 3.0, 1e-3
"""How much less acceleration than today's, how many periods of the lowest mode for a time, and how
short a ramp of the acceleration are looked at. [-], [-], [s]"""
RAMPS = 0.4
"""What both ramps of a move take at most, for the frequencies that a band is looked at [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What one way of moving takes and leaves.

    Attributes
    ----------
    times, worst : ndarray, shape (n,)
        Of each move; the residual is the largest within the band. [s], [mm]
    total : float
        Time of all moves, each as often as it occurs. [s]
    value : float
        The goal: worst or mean residual of the moves that need it. [mm]
    """

    times: Array
    worst: Array
    total: float
    value: float


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """One point of what time buys.

    Attributes
    ----------
    share : float
        Time that was allowed, of today's. [-]
    total, value : float
        Time that is used, and what it leaves. [s], [mm]
    written : ndarray, shape (s,)
        The settings.
    """

    share: float
    total: float
    value: float
    written: Array


@dataclass(frozen=True, slots=True, eq=False)
class Tuning:
    """The study of one control.

    Attributes
    ----------
    machine : Machine
    scheme : Scheme
        What can be set.
    moves : Moves
        n distinct rapids.
    goal : str
        One of `search.GOALS`.
    today : Outcome
        What the machine file says of its control's own rapids.
    before : ndarray, shape (s,)
        The settings nearest to today's rapids; NaN where today's has none of it.
    written : ndarray, shape (s,)
        The settings that were chosen.
    as_set, chosen : Outcome
        What the control's law does with either.
    curve : tuple of Point
        By rising time; the choice is among them, and no other leaves more in more time.
    spread : ndarray, shape (3, r)
        The goal with all frequencies off by `SPREAD`: today, as set, chosen. [mm]
    fits : bool
        A setting takes no more time than it may; otherwise the numbers are today's.
    proven : bool
        No candidate leaves less.
    judged : int
        Settings that were judged on all moves.
    judge : Judge
        By which the choice was made.
    """

    machine: Machine
    scheme: Scheme
    moves: Moves
    goal: str
    today: Outcome
    before: Array
    written: Array
    as_set: Outcome
    chosen: Outcome
    curve: tuple[Point, ...]
    spread: Array
    fits: bool
    proven: bool
    judged: int
    judge: Judge

    @property
    def gains(self) -> bool:
        """Whether the choice leaves less than today, in the time that it may take."""
        return self.fits and self.chosen.value < self.today.value

    def outcome(self, numbers: Mapping[str, float]) -> Outcome:
        """What numbers of the user's take and leave, the others as today; as `Scheme.checked`."""
        start = np.where(np.isnan(self.before), self.written, self.before)
        row = self.scheme.checked(numbers)
        return _at(self.judge, np.where(np.isnan(row), start, row), self.goal)

    def sweep(self, setting: int) -> tuple[Array, Array, Array]:
        """What one setting does, all others as chosen.

        Parameters
        ----------
        setting : int
            Its position.

        Returns
        -------
        numbers, totals, values : ndarray, shape (k,)
            Of the setting; time of all rapids [s]; the goal of the rapids that it acts on [mm]. Of
            many of these, some stand for all, and the worst is among them.
        """
        own = self.scheme.settings[setting]
        low, high = _ranges(self.scheme, self.machine)[setting].tolist()
        numbers = np.unique(np.append(own.choices(low, high, SWEPT), self.written[setting]))
        rows = np.tile(self.written, (len(numbers), 1))
        rows[:, setting] = numbers
        own_moves = concerned(self.scheme, self.moves, (setting,))
        index = own_moves[representatives(self.moves.take(own_moves))[0]]
        worst = [own_moves[one.worst[own_moves].argmax()] for one in (self.today, self.chosen)]
        some = self.judge.take(np.union1d(index, worst))
        totals = np.array([self.judge.times(row[np.newaxis])[0] @ self.moves.count for row in rows])
        return numbers, totals, goal_value(some.worst(rows), some.moves, self.goal)


def tune(
    scheme: Scheme,
    moves: Moves,
    machine: Machine,
    *,
    goal: str = WORST,
    time: float = 1.0,
    curve: bool = True,
    progress: Progress | None = None,
) -> Tuning:
    """Choose a control's settings for rapids.

    Parameters
    ----------
    scheme : Scheme
        What can be set.
    moves : Moves
        The rapids.
    machine : Machine
        Its modes, limits and today's rapids.
    goal : str
        One of `search.GOALS`.
    time : float
        How much time all rapids together may take, of today's. [-]
    curve : bool
        Also what more and less time would buy.
    progress : callable, optional
        Called with how much is done, and of how much.

    Returns
    -------
    Tuning

    Raises
    ------
    PlanError
        No rapid excites a mode.
    """
    rows = Rows.of(moves, machine)
    if not (np.abs(moves.displacement) @ np.abs(rows.objective.weights)).any():
        raise PlanError(
            f"no rapid moves an axis that excites a mode of {machine.source}: nothing to tune",
            "give programs that move such an axis, or describe its modes",
        )
    today, today_off = _today(machine, moves, goal)
    judge = Judge(scheme, rows.in_band(machine.design.band, RAMPS))
    before = scheme.today()
    ranges = _ranges(scheme, machine)
    # What today's rapid has none of is as gentle as it may be.
    start = np.where(np.isnan(before), ranges[:, 1], before)
    work = Groups(judge, machine, start, ranges, today.times, goal)
    shares = sorted({time, *(SHARES if curve else ())})
    found: dict[float, tuple[Array, bool] | None] = {}
    for done, share in enumerate(sorted(shares, key=lambda s: s != time)):
        if progress is not None:
            progress(done, len(shares))
        found[share] = work.best(share)
    best = found[time]
    written = start if best is None else _tidy(scheme, best[0], before)
    points = []
    for share, way in sorted(found.items(), key=lambda item: item[0]):
        if way is not None:
            one = _at(judge, way[0], goal)
            tidy = _tidy(scheme, way[0], before)
            shown = np.where(np.isnan(tidy), way[0], tidy)
            points.append(Point(share, one.total, one.value, shown))
    points = [
        point
        for point in points
        if point.share == time
        or not any(
            o.total <= point.total and o.value <= point.value for o in points if o is not point
        )
    ]
    off = [Judge(scheme, rows.off_by(r)) for r in SPREAD.tolist()]
    spread = [
        goal_value(np.array([one.worst(row[np.newaxis])[0] for one in off]), moves, goal)
        for row in (start, written)
    ]
    return Tuning(
        machine=machine,
        scheme=scheme,
        moves=moves,
        goal=goal,
        today=today,
        before=before,
        written=written,
        as_set=_at(judge, start, goal),
        chosen=_at(judge, written, goal),
        curve=tuple(points),
        spread=np.stack([today_off, *spread]),
        fits=best is not None,
        proven=best is not None and best[1],
        judged=work.judged,
        judge=judge,
    )


def _today(machine: Machine, moves: Moves, goal: str) -> tuple[Outcome, Array]:
    """What the machine file says of the control's own rapids, and with frequencies that are off."""
    rows = Rows.of(moves, machine)
    task = Task.of(machine, Modes.of(machine), rows.share, speed=rows.stated)
    own = task.conventional
    times = rows.last(own.total[np.newaxis])[0]
    judged = rows.in_band(machine.design.band, RAMPS)
    worst = judged.residuals(own)[0].max(axis=-1, initial=0.0)
    spread = [rows.off_by(r).residuals(own)[0].max(axis=-1, initial=0.0) for r in SPREAD.tolist()]
    return _outcome(times, worst, moves, goal), goal_value(np.array(spread), moves, goal)


def _outcome(times: Array, worst: Array, moves: Moves, goal: str) -> Outcome:
    """Times and residuals with what they come to."""
    value = float(goal_value(worst[np.newaxis], moves, goal)[0])
    return Outcome(times, worst, float(times @ moves.count), value)


def _at(judge: Judge, written: Array, goal: str) -> Outcome:
    """What the control's law does with settings."""
    row = written[np.newaxis]
    return _outcome(judge.times(row)[0], judge.worst(row)[0], judge.moves, goal)


def _tidy(scheme: Scheme, written: Array, before: Array) -> Array:
    """The numbers with those as before that a filter which is off has no use for."""
    out = written.copy()
    off = {
        s.axis
        for s, number in zip(scheme.settings, written.tolist(), strict=True)
        if s.relation.quantity == FILTER and number == 0.0
    }
    for k, setting in enumerate(scheme.settings):
        if setting.axis in off and setting.relation.quantity in (MADE_FOR, DAMPING):
            out[k] = before[k]
    return out


def _ranges(scheme: Scheme, machine: Machine) -> Array:
    """Between which numbers each setting is looked for, shape (s, 2).

    From much less acceleration than today's to the machine's limit; times up to some periods of the
    lowest mode; jerks that build the acceleration up within the same; frequencies around the modes.
    """
    modes = Modes.of(machine)
    frequency = np.array([mode.frequency for mode in modes.modes])
    longest = LONGEST_PERIODS / frequency.min()
    # Averages are made for a time, shapers for a frequency.
    made_for = (0.5 * frequency.min(), 1.5 * frequency.max())
    if set(scheme.shaped) <= {filters.AVERAGE, filters.TRIANGLE}:
        made_for = (SHORTEST_RAMP, longest)
    axes, path = scheme.values(np.full((1, len(scheme.settings)), np.nan))
    limits = {axis.name: axis.limit for axis in machine.axes}
    out = []
    for setting in scheme.settings:
        if setting.axis == PATH:
            quantities = {name: value for name, value in path.items()}
            most = {
                "acceleration": machine.path.limit.acceleration
                if np.isfinite(machine.path.limit.acceleration)
                else max(limit.acceleration for limit in limits.values()),
                "jerk": max(limit.jerk for limit in limits.values()),
            }
        else:
            at = scheme.column(setting)
            quantities = {name: value[:, at] for name, value in axes.items()}
            own = limits[AXES[at]]
            most = {
                "acceleration": own.acceleration,
                "deceleration": own.acceleration,
                "jerk": own.jerk,
            }
            if setting.axis == ALL and TODAY + "acceleration" in scheme.fixed:
                # A share of every axis's own, those too that are too slow ever to reach it.
                spare = min(
                    max(a.limit.acceleration / a.rapid.acceleration, 1.0) for a in machine.axes
                )
                most["acceleration"] = spare * float(scheme.fixed[TODAY + "acceleration"][at])
        name = setting.relation.quantity
        now = float(quantities[name][0]) if name in quantities else np.nan
        acceleration = float(quantities.get("acceleration", np.array([np.nan]))[0])
        bounds = {
            "acceleration": (now / SLOWER, most.get("acceleration", now)),
            "deceleration": (now / SLOWER, most.get("deceleration", now)),
            "jerk": (acceleration / longest, min(most["jerk"], acceleration / SHORTEST_RAMP)),
            MADE_FOR: made_for,
            "notch": (0.3 * frequency.min(), 3.0 * frequency.max()),
            FILTER: (0.0, float(len(scheme.shaped))),
            DAMPING: (0.0, 0.3),
        }.get(name, (0.0, longest))
        ends = [
            float(setting.relation.written(quantities | {name: np.array([b])})[0]) for b in bounds
        ]
        numbers = [float(setting.rounded(np.array(x))) for x in ends]
        out.append(sorted(numbers))
    return np.array(out).reshape(-1, 2)
