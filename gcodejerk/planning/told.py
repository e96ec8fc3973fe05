"""Plans as a motion controller can be told them: ends in its steps, times in its ticks.

This module owns what a controller of rows can be told (`RowFormat`), and the step from plans to
plans in its units: ends in whole steps, counted from the program's zero, so that nothing drifts;
segments in whole ticks (`ticks`), long enough that rounded positions cost little of the limits.

Rule: a move that cannot be told is taken out of the plan, with its reason.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.nc import Rapids
from gcodejerk.planning.conventional import unit_limits
from gcodejerk.planning.plans import STANDSTILL, Plans, path_length
from gcodejerk.planning.ticks import ON_TICK, Ticks, TickTask, in_ticks
from gcodejerk.reasons import CERTAIN, REASONS, Reason

SHARE_OF_LIMIT = 0.05
"""Share of the acceleration limit that rounded positions may cost in the shortest segment."""
MORE_TICKS = 2
"""Ticks more than the planned time that a move may take in any case."""


@dataclass(frozen=True, slots=True, eq=False)
class RowFormat:
    """What a controller can be told.

    Attributes
    ----------
    tick : float
        Of segment times. [s]
    step : ndarray, shape (9,)
        Of positions. [mm] or [deg]
    speed_step : ndarray, shape (9,)
        Of velocities. [mm/s] or [deg/s]
    longest : int or None
        Longest segment; longer ones are split. [ticks]
    most : int or None
        Segments of a move.
    """

    tick: float
    step: Array
    speed_step: Array
    longest: int | None = None
    most: int | None = None


def told_in(plans: Plans, rapids: Rapids, form: RowFormat) -> tuple[Plans, Array]:
    """Plans as a controller can be told them: ends in its steps, times in its ticks.

    Parameters
    ----------
    plans : Plans
        n moves; the reasons of those that cannot be told are noted here.
    rapids : Rapids
        The program's; row i of the plans is rapid i.
    form : RowFormat
        What can be told.

    Returns
    -------
    plans : Plans
        Of the same moves, those left that can be told.
    peaks : ndarray, shape (3, n)
        Largest velocity, acceleration and jerk as planned, along the way; of axes that run on
        their own, the largest of any. [mm/s], [mm/s^2], [mm/s^3]
    """
    peaks = _peaks(plans)
    plans = in_steps(plans, rapids, form.step)
    machine, share, move = plans.machine, plans.share, plans.move
    V, A, J = unit_limits(machine, share)
    speed = rapids.speed[move] / path_length(plans.displacement, machine)[move]
    limits = (np.fmin(V, speed), A, J)
    total = plans.profiles.total
    usual = np.maximum(total, plans.conventional.total * (1.0 + machine.design.max_extension))
    least = _least(machine, form, share)
    coarser = _common_ticks(plans, form, least)
    tick = form.tick * coarser
    ticks = np.ceil(total / form.tick - ON_TICK).astype(np.int64) + MORE_TICKS
    most = np.maximum(ticks, np.floor(usual / form.tick + ON_TICK)).astype(np.int64) // coarser
    least = -(-least // coarser)
    poles, weights = _compared(plans, share)
    task = TickTask(plans.profiles, limits, least, most, poles, weights, tick)
    profiles, found = in_ticks(task)
    take_out(plans, np.unique(move[~found]), Reason.NOT_PLAYED)
    lasting = np.zeros(len(plans))
    np.maximum.at(lasting, move, profiles.total)
    good = np.flatnonzero(plans.reason[move] == CERTAIN)
    told = replace(_taken(plans, good), profiles=profiles.take(good), lasting=lasting)
    return told, peaks


def _peaks(plans: Plans) -> Array:
    """Of the profiles as they are, shape (3, n)."""
    linear = plans.machine.positioning == "linear"
    length = plans.length[plans.move] if linear else np.abs(plans.share).max(axis=1, initial=0.0)
    profiles, out = plans.profiles, np.zeros((3, len(plans)))
    each = (profiles.peak_velocity, profiles.peak_acceleration, profiles.greatest_jerk)
    for k, peak in enumerate(each):
        np.maximum.at(out[k], plans.move, peak * length)
    return out


def in_steps(plans: Plans, rapids: Rapids, step: Array) -> Plans:
    """The same plans with ends in whole steps, counted from the program's zero.

    Parameters
    ----------
    plans : Plans
        n moves; those that are shorter than a step are ruled out here.
    rapids : Rapids
        The program's; row i of the plans is rapid i.
    step : ndarray, shape (9,)
        [mm] or [deg]

    Returns
    -------
    Plans
    """
    begin, end = (np.rint(np.nan_to_num(p) / step) for p in (rapids.start, rapids.target))
    moved = np.where(plans.displacement != 0.0, (end - begin) * step, 0.0)
    moved = np.where(np.abs(moved) > STANDSTILL, moved, 0.0)
    take_out(plans, np.flatnonzero(plans.planned & ~moved.any(axis=1)), Reason.TOO_SHORT)
    share = np.where(plans.share != 0.0, moved[plans.move], 0.0)
    kept = np.flatnonzero((plans.reason[plans.move] == CERTAIN) & share.any(axis=1))
    displacement = np.where(plans.planned[:, np.newaxis], moved, plans.displacement)
    return replace(_taken(plans, kept), displacement=displacement, share=share[kept])


def _taken(plans: Plans, kept: NDArray[np.intp]) -> Plans:
    """The same with some of the profiles."""
    return replace(
        plans,
        move=plans.move[kept],
        share=plans.share[kept],
        profiles=plans.profiles.take(kept),
        conventional=plans.conventional.take(kept),
        profile_counts=plans.profile_counts[kept],
    )


def take_out(plans: Plans, moves: NDArray[np.intp], why: Reason) -> None:
    """Note why moves cannot be told."""
    plans.reason[moves] = REASONS.index(why)


def _compared(plans: Plans, share: Array) -> tuple[Complex, Array]:
    """What roundings of times are compared by: the modes amid their band and at its ends."""
    band = plans.machine.design.band
    factors = np.array([1.0 - band, 1.0, 1.0 + band]) if band else np.ones(1)
    weights = np.abs(share @ plans.modes.participation.T)
    poles: Complex = (plans.modes.poles * factors[:, np.newaxis]).ravel()
    return poles, np.tile(weights, len(factors))


def _least(machine: Machine, form: RowFormat, share: Array) -> Ticks:
    """The shortest segment in which rounding costs next to nothing of the limits [ticks]."""
    limit = np.array(
        [machine.axis(a).limit.acceleration if a in machine.axis_names else np.inf for a in AXES]
    )
    each = np.sqrt(12.0 * 0.5 * form.step / (SHARE_OF_LIMIT * limit))
    time = np.where(share != 0.0, each, 0.0).max(axis=1, initial=0.0)
    least: Ticks = np.maximum(np.ceil(time / form.tick), 1.0).astype(np.int64)
    return least


def _common_ticks(plans: Plans, form: RowFormat, least: Ticks) -> int:
    """Ticks that are told as one, so that boundaries of axes that run on their own are apart.

    Two of them a tick apart would be a segment that rounding makes nonsense of. Where they can,
    they divide the interval.
    """
    several = np.diff(plans.move, prepend=-1) == 0
    if not several.any():
        return 1
    shortest = int(least.max(initial=1))
    interval = plans.machine.interval / form.tick
    for ticks in range(shortest, 2 * shortest):
        if abs(interval / ticks - round(interval / ticks)) < ON_TICK and round(interval) >= ticks:
            return ticks
    return shortest
