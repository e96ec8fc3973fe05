r"""Cubics between rows as written: what rounded positions and velocities make of a motion.

This module owns what a controller makes of rows of position and velocity: in each piece of length
T, from p0, v0 to p1, v1, the one cubic with

.. math:: j = 6 (2 (p_0 - p_1) + T (v_0 + v_1)) / T^3, \qquad
          a_0 = 2 (3 (p_1 - p_0) - T (2 v_0 + v_1)) / T^2 ,

and what such cubics leave in the modes: with the steps of acceleration and of jerk at the rows,
:math:`\sum_k (\Delta a_k/\lambda + \Delta j_k/\lambda^2)\, e^{\lambda (T - t_k)}`, exactly.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import FREE
from gcodejerk.motion import Objective, grouped
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.sampling import CELLS
from gcodejerk.motion.search.objective import JUDGED, JUDGED_FEWEST
from gcodejerk.planning.conventional import path_direction
from gcodejerk.planning.plans import Plans, path_length

MOST_PASSED = 0.05
"""By what share rounding may make rows pass a limit of velocity or acceleration."""


class Cubics:
    """The cubics between rows as written."""

    def __init__(
        self,
        plans: Plans,
        moves: NDArray[np.int64],
        first: NDArray[np.int64],
        t: Array,
        position: Mapping[int, Array],
        velocity: Mapping[int, Array],
    ) -> None:
        """Collect the pieces.

        Parameters
        ----------
        plans : Plans
            All of them.
        moves : ndarray of int, shape (b,)
            Those that the rows are of.
        first : ndarray of int, shape (b + 1,)
            Move i has the rows ``first[i]`` to ``first[i + 1]``.
        t : ndarray, shape (r,)
            Since the move's start. [s]
        position, velocity : mapping of int to ndarray, shape (r,)
            Of each axis (index in `AXES`). [mm], [mm/s]
        """
        self.plans, self.moves, self.first, self.t = plans, moves, first, t
        self.axes = list(position)
        self.of_row = np.repeat(np.arange(len(moves)), np.diff(first))
        self.piece = np.ones(len(t), dtype=np.bool_)
        """A row from which a cubic leads to the next."""
        self.piece[first[1:] - 1] = False
        T = np.where(self.piece, np.append(np.diff(self.t), 1.0), 1.0)
        self.T = T
        self.velocity = velocity
        self.begin: dict[int, Array] = {}
        self.end: dict[int, Array] = {}
        self.jerk: dict[int, Array] = {}
        """Acceleration at the ends of each cubic, and its jerk; 0 behind a move."""
        for axis, p in position.items():
            v = velocity[axis]
            moved, after = np.append(np.diff(p), 0.0), np.append(v[1:], 0.0)
            jerk = 6.0 * (T * (v + after) - 2.0 * moved) / T**3
            begin = 2.0 * (3.0 * moved - T * (2.0 * v + after)) / T**2
            self.jerk[axis] = np.where(self.piece, jerk, 0.0)
            self.begin[axis] = np.where(self.piece, begin, 0.0)
            self.end[axis] = np.where(self.piece, begin + jerk * T, 0.0)

    def steps(self, axis: int) -> tuple[Array, Array]:
        """Changes of acceleration and jerk of an axis at each row."""
        before = np.append(0.0, self.end[axis][:-1])
        jerk_before = np.append(0.0, self.jerk[axis][:-1])
        return self.begin[axis] - before, self.jerk[axis] - jerk_before

    def response(self, poles: Complex, participation: Array) -> Complex:
        """Of oscillators to the moves, (b, m), from participation (m, 9) [mm/s]."""
        left = self.t[self.first[1:] - 1][self.of_row] - self.t
        steps = {axis: self.steps(axis) for axis in self.begin}
        out = np.zeros((len(self.moves), len(poles)), dtype=np.complex128)
        width = max(1, CELLS // max(len(left), 1))
        for at in range(0, len(poles), width):
            some = slice(at, at + width)
            pole = poles[some]
            driven = np.zeros((len(left), len(pole)), dtype=np.complex128)
            for axis, (a, j) in steps.items():
                if participation[some, axis].any():
                    each = a[:, np.newaxis] + j[:, np.newaxis] / pole
                    driven += each * participation[some, axis]
            driven *= np.exp(pole * left[:, np.newaxis]) / pole
            out[:, some] = np.add.reduceat(driven, self.first[:-1], axis=0)
        return out

    def left(self) -> tuple[Complex, Array]:
        """Response of the modes, and the worst displacement over the band (b,) [mm]."""
        plans, moves = self.plans, self.moves
        modes = plans.modes
        response = self.response(modes.poles, modes.participation)
        worst = np.where(np.isfinite(plans.most_in_band[moves]), 0.0, np.nan)
        if not np.isfinite(worst).any() or not len(modes.poles):
            return response, worst
        every = Objective(modes.poles, modes.participation.T, modes.group)
        felt = every.take(np.array(self.axes, dtype=np.int64)).excited()
        if not len(felt.poles):
            return response, worst
        # The frequencies are those of the class of durations, whatever stands beside a move.
        longest = 2.0 ** float(np.frexp(float(self.t.max()))[1])
        around = felt.in_band(plans.machine.design.band, longest, JUDGED, JUDGED_FEWEST)
        participation = np.zeros((len(around.poles), len(AXES)))
        participation[:, self.axes] = around.weights.T
        displacement = np.abs(self.response(around.poles, participation)) / around.poles.imag
        worst = worst + grouped(displacement, around.group).max(axis=1, initial=0.0)
        return response, worst

    def _largest(self, value: Array) -> Array:
        """Largest of a column of rows within each move."""
        largest: Array = np.maximum.reduceat(value, self.first[:-1])
        return largest

    def _peaks(self, axis: int) -> tuple[Array, Array, Array]:
        """Largest velocity, acceleration and jerk of an axis in each move."""
        return self._peaks_of(
            self.velocity[axis], self.begin[axis], self.end[axis], self.jerk[axis]
        )

    def _peaks_along(self, direction: Array) -> tuple[Array, Array, Array]:
        """The same along a unit vector of each move, (b, 9)."""
        part = direction[self.of_row]

        def along(column: Mapping[int, Array]) -> Array:
            return np.asarray(sum(part[:, axis] * column[axis] for axis in self.axes))

        columns = (self.velocity, self.begin, self.end, self.jerk)
        return self._peaks_of(*map(along, columns))

    def _peaks_of(self, v: Array, a: Array, end: Array, j: Array) -> tuple[Array, Array, Array]:
        """The same of velocities at rows, accelerations at both ends of each cubic, and jerks."""
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(j != 0.0, -a / j, 0.0)
        turn = np.where((turn > 0.0) & (turn < self.T), turn, 0.0)
        speed = np.maximum(np.abs(v), np.abs(v + 0.5 * a * turn))
        size = np.maximum(np.abs(a), np.abs(end))
        return self._largest(speed), self._largest(size), self._largest(np.abs(j))

    def peaks(self) -> Array:
        """Of each move along its way, by the axis that moves farthest, shape (3, b)."""
        moved = np.abs(self.plans.displacement[self.moves])
        farthest = np.argmax(moved, axis=1)
        linear = self.plans.machine.positioning == "linear"
        scale = (
            path_length(self.plans.displacement[self.moves], self.plans.machine) / moved.max(axis=1)
            if linear
            else np.ones(len(moved))
        )
        out = np.zeros((3, len(moved)))
        for axis in self.begin:
            each = np.stack(self._peaks(axis)) * scale
            # Of axes that run on their own, the fastest counts.
            used = (farthest == axis) | (not linear)
            out = np.where(used, np.maximum(out, each), out)
        return out

    def passes(self) -> NDArray[np.bool_]:
        """Which moves pass a limit by more than rounding may."""
        machine = self.plans.machine
        out = np.zeros(len(self.moves), dtype=np.bool_)
        for axis in self.begin:
            limit = machine.axis(AXES[axis]).limit
            velocity, acceleration, _ = self._peaks(axis)
            out |= velocity > (1.0 + MOST_PASSED) * limit.velocity
            out |= acceleration > (1.0 + MOST_PASSED) * limit.acceleration
        if machine.path != FREE:
            path = machine.path.limit
            direction = path_direction(machine, self.plans.displacement[self.moves])
            velocity, acceleration, _ = self._peaks_along(direction)
            out |= velocity > (1.0 + MOST_PASSED) * path.velocity
            out |= acceleration > (1.0 + MOST_PASSED) * path.acceleration
        return out
