"""One move: the library's way to plan without a program.

This module owns `Plan`, a view of one row of `plans.Plans` with its stream, in the words of a user.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import profiles_response
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.conventional import least_time
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.plans import Modes, Plans
from gcodejerk.planning.stream import make_streams
from gcodejerk.reasons import CERTAIN, REASONS, Reason

MEANT_IN_MS = 100.0
"""A time in s that is so many times what today's rapid takes was meant in ms."""


@dataclass(frozen=True, slots=True, eq=False)
class Plan:
    """One planned move from rest to rest.

    Attributes
    ----------
    machine : Machine
        What it was planned for.
    displacement : dict of str to float
        What each axis moves. [mm] or [deg]
    plans : Plans
        The plan as columns of one row.
    batch : Batch
        Its stream.
    planned : bool
        A stream would be written. Otherwise the controller makes the move by itself, as it does
        today, and this is what it does, though a stream of it would break the machine's limits.
    reason : str or None
        Why the conventional profile stays where another was asked for.
    """

    machine: Machine
    displacement: dict[str, float]
    plans: Plans
    batch: Batch
    planned: bool = True
    reason: str | None = None

    def __repr__(self) -> str:
        moved = " ".join(f"{axis}{length:g}" for axis, length in self.displacement.items())
        why = f" ({self.reason})" if self.reason else ""
        return f"<Plan {moved}: {self.profile}{why}, {self.time:g} s on {self.machine.name!r}>"

    @property
    def time(self) -> float:
        """T_SUM, a whole number of intervals [s]."""
        return float(self.plans.counts[0]) * self.machine.interval

    @property
    def conventional_time(self) -> float:
        """What the controller's own G0 takes [s]."""
        return float(self.plans.conventional_time[0])

    @property
    def length(self) -> float:
        """Along the path [mm], or [deg] where only rotary axes move."""
        return float(self.plans.length[0])

    @property
    def profile(self) -> str:
        """Name of the profile that is written, or of what the controller does by itself."""
        return self.plans.designed

    @property
    def profiles(self) -> Profiles:
        """The unit profile that is written, or one for each axis under independent positioning."""
        return self.batch.profiles

    @property
    def t(self) -> Array:
        """Moments of the stream, shape (n,) [s]."""
        return self.batch.positions(0)[0]

    @property
    def positions(self) -> dict[str, Array]:
        """Position of each axis of the machine, as written, shape (n,) each [mm] or [deg]."""
        rows = self.batch.positions(0)[1]
        return {axis: rows[:, AXES.index(axis)] for axis in self.machine.axis_names}

    @property
    def residual(self) -> Array:
        """Displacement envelope of each mode, of the stream as it is played, shape (1, m) [mm]."""
        return self.batch.residual

    @property
    def conventional_residual(self) -> Array:
        """The same of the controller's own G0, sampled at the interval, shape (1, m) [mm]."""
        return self.batch.conventional_residual

    def unsampled(self) -> list[tuple[float, float]]:
        """Acceleration amplitudes of the profiles themselves, before sampling and rounding.

        Returns
        -------
        list of (float, float)
            The designed and the conventional profile's, for each mode that the move excites.
            [mm/s^2]
        """
        modes, share = self.plans.modes, self.plans.share
        weights = share @ modes.participation.T
        columns = []
        for profiles in (self.batch.profiles, self.plans.conventional):
            # Profiles of one move end at different times; each rings on until the last has ended.
            left = (profiles.total.max() - profiles.total)[:, np.newaxis]
            response = (
                profiles_response(profiles, modes.poles) * np.exp(modes.poles * left) * weights
            )
            displacement = np.abs(response.sum(axis=0)) / modes.poles.imag
            columns.append(modes.accelerations(displacement))
        return [(float(columns[0][m]), float(columns[1][m])) for m in self.plans.excited(0)]


def plan_move(
    displacement: Mapping[str, float],
    machine: Machine,
    profile: str | None = None,
    *,
    time: float | None = None,
    T1: float | None = None,
    stride: int = 1,
    play: Play = Play.TABLE,
    as_played: bool = False,
) -> Plan:
    """Plan one move from rest to rest.

    Parameters
    ----------
    displacement : mapping of str to float
        What each axis moves, for example ``{"Z": 1.0}``. [mm] or [deg]
    machine : Machine
        Limits, modes and interval.
    profile : str, optional
        One of `plan.PROFILES`; the machine's own by default.
    time : float, optional
        T_SUM, rounded up to whole intervals; the conventional time by default. [s]
    T1 : float, optional
        T1 of a four-segment profile; the best by default. [s]
    stride : int, optional
        Intervals from one point to the next as the move is judged, `Controller.stride`; the plan's
        own points are those of every interval.
    play : Play, optional
        What the control makes of the points that it is judged by, `Controller.play`.
    as_played : bool
        The plan's own points are those that it is judged by, not those of every interval.

    Returns
    -------
    Plan
        Of the conventional profile, with the reason, where nothing better exists.

    Raises
    ------
    PlanError
        An axis is unknown, nothing moves, or no profile keeps the limits in the time or with the T1
        that was asked for.

    Examples
    --------
    The case of the paper, with the paper's T1:

    >>> from gcodejerk.machine import find_machine
    >>> vmc = Machine.load(find_machine("vmc"))
    >>> plan = plan_move({"Z": 1.0}, vmc, time=0.040, T1=0.001)
    >>> plan.time, round(float(plan.positions["Z"][1]), 4), plan.profile
    (0.04, 0.0006, 'condition3')
    """
    row = displacement_row(displacement, machine)
    check_time(time, row, machine)
    plans = plan_moves(row, machine, profile, time=time, T1=T1)
    batches = _streams(plans, stride, play)
    if batches and (stride, play) != (1, Play.TABLE) and not as_played:
        judged = batches[0]
        points = _streams(replace(plans, most_in_band=np.full(len(plans), np.nan)))
        batches = [
            replace(batch, residual=judged.residual, worst_in_band=judged.worst_in_band)
            for batch in points
        ]
    why = None if plans.reason[0] == CERTAIN else REASONS[plans.reason[0]]
    if why is Reason.NOT_BETTER and not Modes.of(machine).modes:
        why = Reason.NO_MODE
    if why in (Reason.LIMITS, Reason.NOT_BETTER, Reason.LATER, Reason.NO_MODE):
        plans = plan_moves(row, machine, "conventional", as_today=True)
        # No stream is written: what is left is what the controller leaves.
        batches = [replace(b, residual=b.conventional_residual) for b in _streams(plans)]
    elif why is not None:
        raise not_planned(why)
    named = {a.upper(): float(x) for a, x in displacement.items()}
    return Plan(machine, named, plans, batches[0], why is None, None if why is None else str(why))


def _streams(plans: Plans, stride: int = 1, play: Play = Play.TABLE) -> list[Batch]:
    """The stream of one move, to the axes' resolutions; none where the move is not planned."""
    step = np.ones((1, len(AXES)))
    for described in plans.machine.axes:
        step[0, AXES.index(described.name)] = described.resolution
    zero = np.zeros((1, len(AXES)))
    return [
        batch
        for window in make_streams(plans, NumberFormat(zero, step, zero), stride, play)
        for batch in window
    ]


def not_planned(reason: str) -> PlanError:
    """The refusal of a move that a controller makes better by itself, or that is none."""
    return PlanError(
        f"the move is not planned: {reason}",
        "the control's own move is left as it is; docs/reasons.md says what helps",
    )


def displacement_row(displacement: Mapping[str, float], machine: Machine) -> Array:
    """One move as a row of columns.

    Parameters
    ----------
    displacement : mapping of str to float
        What each axis moves, for example ``{"Z": 1.0}``. [mm] or [deg]
    machine : Machine
        The machine that has these axes.

    Returns
    -------
    ndarray, shape (1, 9)
        [mm] or [deg]

    Raises
    ------
    MachineError
        The machine has no such axis.
    PlanError
        A length is not a number.
    """
    row = np.zeros((1, len(AXES)))
    for axis, length in displacement.items():
        name = axis.upper()
        machine.axis(name)
        if not np.isfinite(length):
            raise PlanError(f"{name} moves by {length}, expected a length", "for example Z=1.5")
        row[0, AXES.index(name)] = length
    return row


def check_time(time: float | None, row: Array, machine: Machine) -> None:
    """Refuse a T_SUM [s] that is none, or that is likely to be meant in ms."""
    if time is not None and not (np.isfinite(time) and time > 0.0):
        raise PlanError(
            f"the time is {time:g} s, expected more than zero", "for example --time 0.040"
        )
    least = float(least_time(row, machine)[0])
    if time is not None and time >= 1.0 and 0.0 < MEANT_IN_MS * least < time:
        raise PlanError(
            f"the time is {time:g} s, and a rapid of this length takes {least:.3g} s",
            f"did you mean {time:g} ms? Times are in seconds: --time {time * 1e-3:.6g}",
        )
