"""The rapids of a program on a simulated machine: as the control moves today, and as planned.

This module owns the columns of that, and which command belongs to which rapid. Rapids whose
commands are alike are simulated once.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.threads import one_thread
from gcodejerk.planning.batch import Batch
from gcodejerk.planning.plans import Plans
from gcodejerk.simulation.moves import Outcome, Watch
from gcodejerk.simulation.response import Steps, polyline_steps, profile_steps

NEVER = np.inf
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, eq=False)
class Rapids:
    """What the rapids of a program do to a machine, one way of moving them: n of them, a axes.

    Attributes
    ----------
    time : ndarray, shape (n,)
        [s]
    lag, lag_at_end, lag_rms : ndarray, shape (n,)
        The largest of any axis. [mm]
    residual, vibration : ndarray, shape (n,)
        As in `Outcome`. [mm]
    settling : ndarray, shape (n,)
        Infinite where it was not seen. [s]
    """

    time: Array
    lag: Array
    lag_at_end: Array
    lag_rms: Array
    residual: Array
    vibration: Array
    settling: Array

    @property
    def waiting(self) -> Array:
        """From each command's end until the tool stays within the tolerance, shape (n,) [s]."""
        waiting: Array = np.maximum(self.settling - self.time, 0.0)
        return waiting


@dataclass(frozen=True, slots=True, eq=False)
class Simulation:
    """A program's planned rapids, today's way and the planned one.

    Attributes
    ----------
    move : ndarray of int, shape (n,)
        Which of the program's rapids.
    today, planned : Rapids
    distinct : int
        How many of them are unlike.
    """

    move: NDArray[np.int64]
    today: Rapids
    planned: Rapids
    distinct: int

    def __len__(self) -> int:
        return len(self.move)

    @property
    def saved(self) -> float:
        """Time until everything has settled, today's less the planned one. [s]."""
        before, after = self.today.settling, self.planned.settling
        both = np.isfinite(before) & np.isfinite(after)
        return float((before - after)[both].sum())


def machine_axes(machine: Machine) -> list[int]:
    """The machine's axes as columns of `AXES`."""
    return [AXES.index(axis) for axis in machine.axis_names]


def today_steps(plans: Plans, move: int) -> Steps:
    """The command of the control's own rapid."""
    rows = np.array(plans.profiles_of(move))
    axes = machine_axes(plans.machine)
    return profile_steps(plans.conventional.take(rows), plans.share[rows], axes)


def planned_steps(plans: Plans, move: int) -> Steps:
    """The command of the planned profile."""
    rows = np.array(plans.profiles_of(move))
    return profile_steps(plans.profiles.take(rows), plans.share[rows], machine_axes(plans.machine))


def written_steps(batch: Batch, row: int) -> Steps:
    """The command of a stream as it was written, and as the control follows its points."""
    times, ways = batch.drives(row)
    return polyline_steps(times, ways[:, machine_axes(batch.plans.machine)])


def simulate_rapids(
    plans: Plans,
    watch: Watch,
    batches: Iterable[Batch] | None = None,
    progress: Progress | None = None,
) -> Simulation:
    """Simulate all rapids of a program that are planned.

    Parameters
    ----------
    plans : Plans
        Of the program's rapids.
    watch : Watch
        The machine.
    batches : iterable of Batch, optional
        The streams as they are written; the profiles by default.
    progress : callable, optional
        Called with how many are done, and of how many.

    Returns
    -------
    Simulation

    Raises
    ------
    PlanError
        Nothing is planned.
    """
    moves = np.flatnonzero(plans.planned)
    if not len(moves):
        raise PlanError(
            "no rapid of this program is planned, so there is nothing to simulate",
            "gcodejerk inspect shows why each is left alone",
        )
    known: dict[bytes, Outcome] = {}

    def outcome(steps: Steps) -> Outcome:
        # There and back are alike: a machine answers to either in the same way.
        first = steps.size.ravel()[np.argmax(steps.size.ravel() != 0.0)]
        size = np.sign(first) * steps.size + 0.0
        key = hashlib.blake2b(steps.time.tobytes() + size.tobytes(), digest_size=16).digest()
        if key not in known:
            known[key] = watch.outcome(steps)
        return known[key]

    with one_thread():
        return _simulated(plans, moves, batches, outcome, progress)


def _simulated(
    plans: Plans,
    moves: NDArray[np.int64],
    batches: Iterable[Batch] | None,
    outcome: Callable[[Steps], Outcome],
    progress: Progress | None,
) -> Simulation:
    """The same, by what tells a command's outcome."""
    planned: dict[int, Outcome] = {}
    if batches is None:
        commands = ((int(k), planned_steps(plans, int(k))) for k in moves)
    else:
        commands = (
            (int(batch.moves[row]), written_steps(batch, row))
            for batch in batches
            for row in range(len(batch))
        )
    for k, steps in commands:
        planned[k] = outcome(steps)
        if progress is not None:
            progress(len(planned), 2 * len(moves))
    today: dict[int, Outcome] = {}
    for k in planned:
        today[k] = outcome(today_steps(plans, k))
        if progress is not None:
            progress(len(planned) + len(today), 2 * len(moves))
    order = sorted(planned)
    return Simulation(
        np.array(order, dtype=np.int64),
        _columns([today[k] for k in order]),
        _columns([planned[k] for k in order]),
        len({(id(today[k]), id(planned[k])) for k in order}),
    )


def _columns(outcomes: list[Outcome]) -> Rapids:
    return Rapids(
        np.array([one.time for one in outcomes]),
        np.array([one.lag.max() for one in outcomes]),
        np.array([np.abs(one.lag_at_end).max() for one in outcomes]),
        np.array([one.lag_rms.max() for one in outcomes]),
        np.array([one.residual for one in outcomes]),
        np.array([one.vibration for one in outcomes]),
        np.array([NEVER if one.settling is None else one.settling for one in outcomes]),
    )
