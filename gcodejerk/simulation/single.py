"""One move on a simulated machine, looked at from all sides: in time, pole by pole, in spectra.

This module owns `MoveSimulation`, which tables, files and figures are made of; it draws nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.planning.move import Plan
from gcodejerk.simulation.equations import Row, equations_of
from gcodejerk.simulation.moves import Outcome, Watch
from gcodejerk.simulation.programs import planned_steps, today_steps, written_steps
from gcodejerk.simulation.response import Steps

WAYS = ("today", "planned")
LEAST = 1e-9
"""Of a pole that is told: what it keeps, at least. [mm]"""
SHOWN = 5.0
"""Periods of the slowest pole that are seen behind the move."""
POINTS = 4000


@dataclass(frozen=True, slots=True)
class Pole:
    """One way in which the machine vibrates when the move has ended.

    Attributes
    ----------
    frequency, damping : float
        [Hz], [-]
    left : dict of str to float
        Way of moving -> amplitude at the tool when the command ends. [mm]
    """

    frequency: float
    damping: float
    left: dict[str, float]


class MoveSimulation:
    """A move as the control makes it today, and as planned, on the simulated machine.

    Parameters
    ----------
    plan : Plan
        The move.
    written : bool
        Simulate the stream as it is written in place of the profile.

    Attributes
    ----------
    plan : Plan
    watch : Watch
        The machine.
    steps : dict of str to Steps
    outcomes : dict of str to Outcome
        For each of `WAYS`.

    Raises
    ------
    PlanError
        As `equations_of`.
    """

    def __init__(self, plan: Plan, *, written: bool = False) -> None:
        self.plan, self.machine = plan, plan.machine
        self.watch = Watch(equations_of(self.machine), self.machine.design.tolerance)
        own = written_steps(plan.batch, 0) if written else planned_steps(plan.plans, 0)
        self.steps: dict[str, Steps] = {"today": today_steps(plan.plans, 0), "planned": own}
        self.outcomes: dict[str, Outcome] = {
            way: self.watch.outcome(steps) for way, steps in self.steps.items()
        }

    def __repr__(self) -> str:
        return f"<MoveSimulation of {self.plan!r}>"

    @property
    def moving(self) -> list[str]:
        """Axes that the move moves."""
        return [a for a in self.watch.equations.axes if self.plan.displacement.get(a, 0.0)]

    def poles(self) -> list[Pole]:
        """What the lightly damped poles keep, the lowest frequency first."""
        poles = self.watch.response.poles
        left = {way: self.watch.left(steps) for way, steps in self.steps.items()}
        told = self.watch.light & (np.max(list(left.values()), axis=0) >= LEAST)
        size = np.abs(poles)
        return [
            Pole(
                float(size[k]) / (2.0 * np.pi),
                max(0.0, -float(poles[k].real) / float(size[k])),
                {way: float(x[k]) for way, x in left.items()},
            )
            for k in np.argsort(size)
            if told[k]
        ]

    def times(self) -> Array:
        """Moments at which to look: the move, and a few slow periods behind it, shape (k,) [s]."""
        slow = [pole.frequency for pole in self.poles()]
        end = max(steps.end for steps in self.steps.values())
        behind = SHOWN / min(slow, default=SHOWN / end)
        return np.linspace(0.0, end + min(behind, 3.0), POINTS + 1)

    def command(self, way: str, times: Array) -> Array:
        """Position, velocity, acceleration and jerk of the command, shape (4, k, a)."""
        return self.steps[way].command(times)

    def lag(self, way: str, times: Array) -> Array:
        """How far each axis's table is behind its command, shape (a, k) [mm]."""
        return self.watch.record(self.steps[way], times, self.watch.lag)

    def deviation(self, way: str, times: Array) -> Array:
        """How far the tool is from where it should be along each axis, shape (a, k) [mm].

        Modes that several axes excite together and that have no direction come last, if any.
        """
        return self.watch.record(self.steps[way], times, self.watch.places)

    def command_spectrum(self, way: str, frequency: Array, axis: str) -> Array:
        """Amplitude density of the command's acceleration, exact, shape (f,) [mm/s^2/Hz]."""
        steps = self.steps[way]
        s = 2j * np.pi * frequency
        size = steps.size[:, :, self.watch.equations.axes.index(axis)]
        orders = np.stack([np.ones_like(s), 1.0 / s, 1.0 / s**2])
        waves = np.exp(-np.outer(steps.time, s))
        spectrum: Array = np.abs(np.einsum("nj,jf,nf->f", size, orders, waves))
        return spectrum

    def table_spectrum(self, way: str, frequency: Array, axis: str) -> Array:
        """Amplitude density of the table's acceleration, motion and all, shape (f,) [mm/s^2/Hz]."""
        gain = self._told_to(self.watch.equations.table[axis], frequency, axis)
        spectrum: Array = np.abs(gain) * self.command_spectrum(way, frequency, axis)
        return spectrum

    def tool_spectrum(self, way: str, frequency: Array) -> Array:
        """Amplitude density of the tool's motion behind the move, shape (f,) [mm/Hz].

        Of the free vibration from the command's end on, over the axis in which it is largest.
        """
        response = self.watch.response
        left = response.left(self.steps[way], self.steps[way].end)
        s = 2j * np.pi * frequency
        rows = [response.seen(row) for row in self.watch.places]
        # Of a real part of c e^(lambda t): half of c and half of its conjugate.
        poles = response.poles[:, np.newaxis]
        with np.errstate(divide="ignore", invalid="ignore"):  # at a mode without damping
            density = [
                np.abs(
                    (
                        0.5 * (row * left)[:, np.newaxis] / (s - poles)
                        + 0.5 * np.conj(row * left)[:, np.newaxis] / (s - np.conj(poles))
                    ).sum(axis=0)
                )
                for row in rows
            ]
        largest: Array = np.max(density, axis=0)
        return largest

    def frequency_response(self, frequency: Array, axis: str) -> Complex:
        """From a force between tool and workpiece to how they move, along an axis: receptance.

        Parameters
        ----------
        frequency : ndarray, shape (f,)
            [Hz]
        axis : str

        Returns
        -------
        ndarray of complex, shape (f,)
            [mm/N]; of a machine without structure, from the axis's command of acceleration to how
            the tool then is from where it should be. [mm s^2/mm]
        """
        equations = self.watch.equations
        s = 2j * np.pi * frequency
        if not equations.pushed:
            return self._told_to(equations.deviation(axis), frequency, axis) / s**2
        seen = (equations.table[axis] + equations.vibration[axis]).state
        eye, pushed = np.eye(len(equations.A)), equations.pushed[axis]
        return np.array([seen @ _solved(one * eye - equations.A, pushed) for one in s])

    def _told_to(self, row: Row, frequency: Array, axis: str) -> Complex:
        """From where an axis is told to be to what a row sees, shape (f,)."""
        equations = self.watch.equations
        u, eye = equations.axes.index(axis), np.eye(len(equations.A))
        out = []
        for s in 2j * np.pi * frequency:
            told = np.array([1.0, s, s * s])
            forced = np.einsum("j,js->s", told, equations.B[:, :, u])
            state = _solved(s * eye - equations.A, forced)
            out.append(row.state @ state + row.command[:, u] @ told)
        return np.array(out)


def _solved(matrix: Complex, right: Array | Complex) -> Complex:
    """The solution; NaN at the very frequency of a mode without damping, where there is none."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.complex128)
    except np.linalg.LinAlgError:
        return np.full(right.shape, np.nan, dtype=np.complex128)
