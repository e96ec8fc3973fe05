"""One command on a machine: how it is followed, and how long the tool then shakes.

This module owns `Outcome`, what is told of a command: lag, vibration, settling. Commands come from
profiles or from streams (`response.Steps`); both start and end at rest.

Rule: moves are looked at one by one, each from rest. What a move before has left is not in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.simulation.equations import Equations, Row
from gcodejerk.simulation.friction import follow
from gcodejerk.simulation.response import Response, Steps

LIGHT = 0.3
"""Poles below this damping ratio vibrate; the others are gone before they have turned twice."""
MOVING = 400
"""Moments at which a motion is looked at, at least."""
OF_A_PERIOD = 24.0
"""Moments in a period of the quickest pole that still matters."""
QUIET = 0.02
"""Part of the tolerance that a pole may keep to be left out behind the move."""
LONGEST = 120.0
"""Settling is looked for so long. [s]"""
MOST_MOMENTS = 100_000
"""In one of the parts."""
PARTS = 40
FINER = 60
"""Moments between two, where the last one above the tolerance is looked for."""
TINY = 1e-6
"""Of the whole, what may be left out where no tolerance says it. [-]"""
FRICTION_SPACING = 1e-3
"""Between moments that are seen, with friction. [s]"""
FRICTION_LONGEST = 3.0
"""Looked at behind a move, with friction. [s]"""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """What one command does to a machine of a axes.

    Attributes
    ----------
    time : float
        When the command ends. [s]
    lag : ndarray, shape (a,)
        The farthest that each table is behind or before its command. [mm]
    lag_at_end : ndarray, shape (a,)
        Where it is when the command ends. [mm]
    lag_rms : ndarray, shape (a,)
        Root of the mean square until then. [mm]
    deviation_at_end : ndarray, shape (a,)
        How far the tool then is from its place. [mm]
    residual : float
        The largest amplitude that any lightly damped pole keeps at the tool. [mm]
    vibration : float
        The farthest that the tool is from its place when the command has ended. [mm]
    settling : float or None
        From the command's begin until the tool stays within the tolerance; None: not within
        `LONGEST`. [s]
    """

    time: float
    lag: Array
    lag_at_end: Array
    lag_rms: Array
    deviation_at_end: Array
    residual: float
    vibration: float
    settling: float | None

    @property
    def waiting(self) -> float | None:
        """From the command's end until the tool stays within the tolerance. [s]."""
        return None if self.settling is None else max(0.0, self.settling - self.time)


class Watch:
    """A machine that is looked at while it moves.

    Parameters
    ----------
    equations : Equations
        The machine.
    tolerance : float
        What counts as settled. [mm]
    """

    def __init__(self, equations: Equations, tolerance: float) -> None:
        self.equations, self.tolerance = equations, tolerance
        self.response = Response(equations)
        self.lag = [equations.lag(axis) for axis in equations.axes]
        self.places: list[Row] = [equations.deviation(axis) for axis in equations.axes]
        if equations.structure is not None:
            self.places.append(equations.structure)
        self._seen = np.array([self.response.seen(row) for row in self.places])

    def __repr__(self) -> str:
        return f"<Watch of {self.equations!r}>"

    def outcome(self, steps: Steps) -> Outcome:
        """What a command does.

        Parameters
        ----------
        steps : Steps

        Returns
        -------
        Outcome

        Raises
        ------
        PlanError
            As `friction.follow`.
        """
        if self.equations.rubs:
            return self._rubbed(steps)
        count = len(self.lag)
        moving = np.unique(np.concatenate([np.linspace(0.0, steps.end, MOVING), steps.time]))
        seen = self.response.watch(steps, moving, [*self.lag, *self.places])
        ringing = self._ringing(steps)
        behind = ringing.last_above(self.tolerance)
        lag = seen[:count]
        # The lag may still grow when the command has ended.
        late = self._late(steps)
        return Outcome(
            time=steps.end,
            lag=np.maximum(np.abs(lag).max(axis=1, initial=0.0), late),
            # Copies: a program's outcomes are kept, all that was seen of each is not.
            lag_at_end=lag[:, -1].copy(),
            lag_rms=_rms(lag, moving),
            deviation_at_end=seen[count : 2 * count, -1].copy(),
            residual=self._residual(steps),
            vibration=ringing.peak(),
            settling=None if behind is None else steps.end + behind,
        )

    def left(self, steps: Steps) -> Array:
        """What each pole keeps at the tool when the command ends, shape (m,) [mm]."""
        kept = np.abs(self._seen * self.response.left(steps, steps.end))
        left: Array = np.sqrt((kept**2).sum(axis=0))
        return left

    @property
    def light(self) -> NDArray[np.bool_]:
        """Which poles are lightly damped modes; the others are the servos' own, shape (m,)."""
        poles = self.response.poles
        light: NDArray[np.bool_] = (poles.imag > 0.0) & (-poles.real < LIGHT * np.abs(poles))
        return light

    def _residual(self, steps: Steps) -> float:
        return float(self.left(steps)[self.light].max(initial=0.0))

    def _ringing(self, steps: Steps) -> _Ringing:
        """What goes on behind the command."""
        return _Ringing(
            self.response.poles,
            self._seen * self.response.left(steps, steps.end),
            QUIET * self.tolerance,
        )

    def _late(self, steps: Steps) -> Array:
        """The largest lag behind the command, shape (a,) [mm]."""
        seen = np.array([self.response.seen(row) for row in self.lag])
        left = seen * self.response.left(steps, steps.end)
        return np.array(
            [_Ringing(self.response.poles, row[np.newaxis], 0.0).peak() for row in left]
        )

    def _rubbed(self, steps: Steps) -> Outcome:
        """The same with dry friction: in fine steps, until it moves no more."""
        count = len(self.lag)
        moments = int(np.ceil((steps.end + FRICTION_LONGEST) / FRICTION_SPACING)) + 1
        times: Array = np.arange(moments, dtype=np.float64) * FRICTION_SPACING
        rows = [*self.lag, *self.places]
        seen, _ = follow(self.response, steps, times, rows, 0.1 * self.tolerance)
        last = int(np.searchsorted(times, steps.end - 1e-9))
        off = np.abs(seen[count:]).max(axis=0)
        out = np.flatnonzero(off[last:] > self.tolerance)
        settled = not len(out) or last + out[-1] + 1 < len(times)
        settling = steps.end if not len(out) else float(times[last + out[-1]])
        lag = seen[:count]
        return Outcome(
            time=steps.end,
            lag=np.abs(lag).max(axis=1),
            lag_at_end=lag[:, last].copy(),
            lag_rms=np.sqrt((lag[:, : last + 1] ** 2).mean(axis=1)),
            deviation_at_end=seen[count : 2 * count, last].copy(),
            residual=self._residual(steps),
            vibration=float(off[last:].max()),
            settling=settling if settled else None,
        )

    def record(self, steps: Steps, times: Array, rows: Sequence[Row]) -> Array:
        """What some rows see, with friction if there is any, shape (r, k)."""
        if not self.equations.rubs:
            return self.response.watch(steps, times, rows)
        return follow(self.response, steps, times, rows, 0.1 * self.tolerance)[0]


class _Ringing:
    """Free vibration behind a command, looked at no finer than what is still alive in it.

    Parameters
    ----------
    poles : ndarray of complex, shape (m,)
        [rad/s]
    amount : ndarray of complex, shape (r, m)
        What each of r places sees of each pole at the beginning. [mm]
    quiet : float
        What may be left out, of all poles together. [mm]
    """

    def __init__(self, poles: Complex, amount: Complex, quiet: float) -> None:
        left = np.abs(amount).max(axis=0, initial=0.0)
        alive = left > max(quiet, TINY * left.max(initial=0.0)) / max(len(left), 1)
        self.poles, self.amount, self.left = poles[alive], amount[:, alive], left[alive]
        # An undamped mode rings for ever, whatever rounding made of its pole.
        self.decay = np.maximum(-self.poles.real, 1e-12 * np.abs(self.poles))
        least = max(quiet, TINY * left.max(initial=0.0)) / max(len(left), 1)
        self.least = least
        until = (np.log(self.left / least) / self.decay).max(initial=0.0)
        self.until = min(LONGEST, float(until))
        self.edges = self.until * np.linspace(0.0, 1.0, PARTS + 1) ** 2

    def envelope(self, time: float) -> float:
        """What the vibration cannot be above from a moment on. [mm]."""
        return float((self.left * np.exp(-self.decay * time)).sum())

    def _part(self, k: int) -> tuple[Array, Array]:
        """Moments of one part, and the largest of all places at each [mm]."""
        begin, end = self.edges[k], self.edges[k + 1]
        alive = self.left * np.exp(-self.decay * begin) > self.least
        if not alive.any():
            return np.array([begin]), np.zeros(1)
        quickest = np.abs(self.poles[alive]).max()
        count = int(min(MOST_MOMENTS, 2 + (end - begin) * quickest * OF_A_PERIOD / (2.0 * np.pi)))
        times = np.linspace(begin, end, count)
        return times, self._at(times, alive)

    def _at(self, times: Array, alive: NDArray[np.bool_] | slice = slice(None)) -> Array:
        """The largest of all places at some moments, shape (k,) [mm]."""
        swings = np.exp(np.outer(self.poles[alive], times))
        size: Array = np.abs((self.amount[:, alive] @ swings).real).max(axis=0)
        return size

    def peak(self) -> float:
        """The largest of all. [mm]."""
        peak = 0.0
        for k in range(PARTS):
            if self.envelope(self.edges[k]) <= peak:
                break
            peak = max(peak, float(self._part(k)[1].max(initial=0.0)))
        return peak

    def last_above(self, tolerance: float) -> float | None:
        """When it is above a tolerance for the last time; None: still at `LONGEST`. [s]."""
        if self.until >= LONGEST and self.envelope(LONGEST) > tolerance:
            return None
        for k in reversed(range(PARTS)):
            if self.envelope(self.edges[k]) <= tolerance:
                continue
            times, size = self._part(k)
            above = np.flatnonzero(size > tolerance)
            if not len(above):
                continue
            # Between the last moment above and the next: finer.
            last = int(above[-1])
            fine = np.linspace(times[last], times[min(last + 1, len(times) - 1)], FINER)
            # The moment itself may be above by what this part leaves out.
            inside = np.flatnonzero(self._at(fine) > tolerance)
            return float(fine[inside[-1]] if len(inside) else times[last])
        return 0.0


def _rms(values: Array, times: Array) -> Array:
    """Root of the mean square over a time, shape (r, k) -> (r,)."""
    gap = np.diff(times)
    square = 0.5 * (values[:, 1:] ** 2 + values[:, :-1] ** 2)
    mean: Array = np.sqrt((square * gap).sum(axis=1) / max(float(gap.sum()), 1e-12))
    return mean
