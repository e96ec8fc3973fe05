r"""How long a machine shakes after its rapids, and what the rapids leave that stay as they are.

A mode that a rapid leaves with the envelope D decays as :math:`D e^{-\zeta\omega t}`, so that it is
within the tolerance d after :math:`t = \ln(D/d) / (\zeta\omega)`; the tool is settled when the last
mode is. That is what a careful program dwells for, and what the surface shows where none does. The
lines of a measured spectrum count together: the root of the sum of their squares, by bisection.

Rule: what a rapid leaves that is left alone is known only where its start, its end and its path
are; what is not known is counted, never taken for zero.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import Profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.rows import parts
from gcodejerk.nc import Rapids
from gcodejerk.planning.arrival import arrivals, each_at_arrival, summed
from gcodejerk.planning.plans import STANDSTILL, Modes, Plans, path_length, same_rows
from gcodejerk.planning.task import AT_ONCE, Task
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.storage import Growing, column, windows

KNOWN = tuple(
    REASONS.index(reason)
    for reason in (
        Reason.BLOCK_DELETE, Reason.MIXED_AXES, Reason.OTHER_WORDS, Reason.FEED_UNKNOWN,
        Reason.TOO_SHORT, Reason.TOO_LONG, Reason.LIMITS, Reason.NOT_BETTER, Reason.LATER,
        Reason.NO_MODE, Reason.NO_BLENDING, Reason.CONTROL_SET, Reason.NOT_PLAYED,
    )
)  # fmt: skip
"""Reasons of rapids that run once, on a straight line from their start to their end."""
NOTHING = tuple(REASONS.index(reason) for reason in (Reason.NO_MOTION, Reason.AFTER_END))
"""Reasons of blocks that do not move."""
HALVINGS = 60
WITHIN = 21
"""Frequencies of a band, its ends included, of which a mean is taken."""


@dataclass(frozen=True, slots=True, eq=False)
class Left:
    """What rapids leave today that are left alone; entry i of every array is rapid i.

    Attributes
    ----------
    residual : ndarray, shape (n, m)
        Displacement envelopes, NaN where planned or not known. [mm]
    time : ndarray, shape (n,)
        Conventional time, 0 where planned or not known. [s]
    unknown : ndarray of bool, shape (n,)
        Left alone, and what it leaves cannot be computed.
    length : ndarray, shape (n,)
        Of the way, 0 where planned or not known. [mm] or [deg]
    """

    residual: Array
    time: Array
    unknown: NDArray[np.bool_]
    length: Array

    def take(self, rows: NDArray[np.int64]) -> Left:
        """Some of the rapids."""
        return Left(*(getattr(self, field.name)[rows] for field in fields(self)))


def left_alone(rapids: Rapids, plans: Plans) -> Left:
    """What is left by the rapids that are left alone.

    Parameters
    ----------
    rapids : Rapids
        Of the program.
    plans : Plans
        Row i is rapid i.

    Returns
    -------
    Left
    """
    modes = plans.modes
    residual: Array = np.broadcast_to(np.nan, (len(plans), len(modes.poles)))
    time: Array = np.broadcast_to(0.0, len(plans))
    length = time
    unknown = np.zeros(len(plans), dtype=np.bool_)
    rows_, moved_ = Growing(np.int64), Growing(np.float64, width=len(AXES))
    for part in windows(len(plans)):
        others = part.start + np.flatnonzero(~plans.planned[part])
        ways = known_moves(rapids, plans, others)
        certain = np.isfinite(ways).all(axis=1)
        unknown[others] = ~np.isin(plans.reason[others], NOTHING) & ~certain
        rows_.extend(others[certain])
        moved_.extend(ways[certain])
    rows, moved = rows_.finish(), moved_.finish()
    if len(rows):
        residual = column(residual.shape, np.nan)
        time, length = column(len(plans), 0.0), column(len(plans), 0.0)
        first, like = same_rows(moved, rapids.lone[rows])
        left, lasts = column((len(first), len(modes.poles)), 0.0), column(len(first), 0.0)
        for part in windows(len(first)):
            some = first[part]
            left[part], lasts[part] = _today(plans, moved[some], rapids.lone[rows[some]])
        for part in windows(len(rows)):
            residual[rows[part]], time[rows[part]] = left[like[part]], lasts[like[part]]
            length[rows[part]] = path_length(moved[part], plans.machine)
    return Left(residual, time, unknown, length)


def known_moves(rapids: Rapids, plans: Plans, rows: NDArray[np.int64]) -> Array:
    """What each axis moves in the rapids that are left alone, as far as all of it is known.

    Parameters
    ----------
    rapids : Rapids
        Of the program.
    plans : Plans
        Row i is rapid i.
    rows : ndarray of int, shape (r,)
        Which rapids.

    Returns
    -------
    ndarray, shape (r, 9)
        NaN in every column of a rapid of which not all is known, or that does not move. [mm], [deg]
    """
    moved = rapids.target[rows] - rapids.start[rows]
    named = (rapids.words[rows, np.newaxis] >> np.arange(len(AXES)) & 1).astype(bool)
    has = np.array([axis in plans.machine.axis_names for axis in AXES])
    moved = np.where(named, moved, 0.0)
    moved = np.where(np.abs(moved) > STANDSTILL, moved, 0.0 * moved)
    certain = np.isfinite(moved).all(axis=1) & ~(named & ~has).any(axis=1)
    certain &= np.isin(plans.reason[rows], KNOWN) & (moved != 0.0).any(axis=1)
    out: Array = np.where(certain[:, np.newaxis], moved, np.nan)
    return out


def todays_rapids(
    plans: Plans, moved: Array, lone: NDArray[np.bool_]
) -> tuple[Profiles, NDArray[np.int64], Array]:
    """The controller's own rapids.

    Parameters
    ----------
    plans : Plans
        Their machine and its modes.
    moved : ndarray, shape (r, 9)
        What each axis moves. [mm] or [deg]
    lone : ndarray of bool, shape (r,)
        As `Rapids.lone`.

    Returns
    -------
    profiles : Profiles
        l unit profiles: one a move, or under independent positioning one for each of its axes.
    move : ndarray of int, shape (l,)
        The move of each, rising.
    share : ndarray, shape (l, 9)
        What each carries. [mm] or [deg]
    """
    move = np.arange(len(moved))
    share = moved
    if plans.machine.positioning != "linear":
        move, axis = np.nonzero(moved)
        share = np.zeros((len(move), len(AXES)))
        share[np.arange(len(move)), axis] = moved[move, axis]
    task = Task.of(plans.machine, plans.modes, share, lone=lone[move])
    return task.conventional, move, share


def _today(plans: Plans, moved: Array, lone: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Residual and time of the controller's own rapids."""
    modes = plans.modes
    profiles, move, share = todays_rapids(plans, moved, lone)
    residual, time = np.zeros((len(moved), len(modes.poles))), np.zeros(len(moved))
    for part, rows in _parts(move, len(modes.poles)):
        own, each = profiles.take(rows), move[rows] - part.start
        weights = share[rows] @ modes.participation.T
        response = summed(each_at_arrival(own, each, modes.poles) * weights, each)
        residual[part] = np.abs(response) / modes.poles.imag
        time[part] = arrivals(own, each)
    return residual, time


def _parts(move: NDArray[np.int64], width: int) -> Iterator[tuple[slice, NDArray[np.int64]]]:
    """Moves of which so many modes are looked at at once, and the profiles that they have."""
    for part in parts(int(move.max(initial=-1)) + 1, width, AT_ONCE):
        begin, end = np.searchsorted(move, (part.start, part.stop)).tolist()
        yield part, np.arange(begin, end)


def settling_times(residual: Array, modes: Modes, tolerance: float) -> Array:
    """How long it takes until every mode's envelope stays within the tolerance.

    Parameters
    ----------
    residual : ndarray, shape (n, m)
        Envelopes at arrival. [mm]
    modes : Modes
        Their damping.
    tolerance : float
        [mm]

    Returns
    -------
    ndarray, shape (n,)
        After arrival; infinite where a mode without damping keeps more, NaN where a residual is
        not known. [s]

    Examples
    --------
    30 Hz with damping 0.02 decay from 0.3 mm to 0.001 mm in ln(300)/3.77:

    >>> from gcodejerk.machine import Machine, find_machine
    >>> modes = Modes.of(Machine.load(find_machine("vmc")))
    >>> D = np.zeros((1, len(modes.poles)))
    >>> D[0, 2] = 0.3
    >>> float(settling_times(D, modes, 0.001)[0].round(3))
    1.513
    """
    out = np.zeros(len(residual))
    rate = np.abs(modes.poles.real)
    for entry in range(len(modes.modes)):
        index = np.flatnonzero(modes.group == entry)
        D = residual[:, index]
        with np.errstate(divide="ignore", invalid="ignore"):
            if len(index) == 1:
                need = np.log(D[:, 0] / tolerance) / rate[index[0]]
                time = np.where(D[:, 0] > tolerance, need, 0.0)
            else:
                time = _together(D, rate[index], tolerance)
        out = np.maximum(out, np.where(np.isnan(D).any(axis=1), np.nan, time))
    return out


def settled(
    modes: Modes, machine: Machine, move: NDArray[np.int64], share: Array, profiles: Profiles
) -> Array:
    """When moves have settled, as a mean over the band, in which all frequencies are off alike.

    Parameters
    ----------
    modes : Modes
        The machine's.
    machine : Machine
        It says how wide the band is, and what counts as settled.
    move, share, profiles
        As `planning.task.worst_at_arrival` takes them; l profiles of n moves.

    Returns
    -------
    ndarray, shape (n,)
        Counted from the beginning of the move; infinite where it never settles. [s]
    """
    band, tolerance = machine.design.band, machine.design.tolerance
    relative = np.linspace(1.0 - band, 1.0 + band, WITHIN if band else 1)
    out = np.zeros(int(move.max(initial=-1)) + 1)
    for part, rows in _parts(move, len(modes.poles)):
        own, each = profiles.take(rows), move[rows] - part.start
        weights = share[rows] @ modes.participation.T
        waiting = np.zeros(part.stop - part.start)
        for factor in relative.tolist():
            off = replace(modes, poles=modes.poles * factor)
            response = summed(each_at_arrival(own, each, off.poles) * weights, each)
            residual = np.abs(response) / off.poles.imag
            waiting += settling_times(residual, off, tolerance)
        out[part] = arrivals(own, each) + waiting / len(relative)
    return out


def _together(D: Array, rate: Array, tolerance: float) -> Array:
    """The same of oscillators that count together."""
    largest = np.sqrt((D**2).sum(axis=1))
    slowest = float(rate.min())
    high = np.log(np.maximum(largest / tolerance, 1.0)) / slowest
    low = np.zeros(len(D))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        left = np.sqrt(((D * np.exp(-rate * middle[:, np.newaxis])) ** 2).sum(axis=1))
        low, high = (
            np.where(left > tolerance, middle, low),
            np.where(left > tolerance, high, middle),
        )
    return np.where(largest > tolerance, high, 0.0)
