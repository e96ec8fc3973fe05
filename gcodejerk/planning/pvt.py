r"""Rows of position, velocity and time: planned moves at the boundaries of their segments.

A segment of constant jerk is a cubic in time, and the cubic through the positions and velocities at
its two ends is that cubic: one row for each boundary tells a controller the whole profile. This
module owns the step from plans to rows as written: times in whole ticks of the controller
(`told`), the boundaries of all axes that run on their own merged, absolute positions rounded to
its steps, velocities rounded last; and what exactly these rows leave in the modes (`cubics`).

Rule: a report speaks of the rows as written: of the cubics between rounded numbers, whose
acceleration steps a little at every row. A position that is off by e costs up to 12 e/T^2 of
acceleration over a segment of T. Where that is more than a few percent of a limit, or where the
rows leave more than today's rapid does over the band, the move is taken out of the plan.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import (
    Grid,
    profiles_response,
    residual_displacement,
    sample_profiles,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Rapids
from gcodejerk.planning.cubics import Cubics
from gcodejerk.planning.independent_axes import deviation_of
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.ticks import Ticks
from gcodejerk.planning.told import RowFormat, take_out
from gcodejerk.reasons import Reason

BATCH_ROWS = 200_000
"""Rows of a batch, about."""
_MOVE = 1 << 40
"""Ticks of the longest move; moves times this are keys of rows."""


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Rows of some planned moves: b moves, and the r rows of all of them in their order.

    Attributes
    ----------
    moves : ndarray of int, shape (b,)
        Which moves of the plans.
    plans : Plans
        As they are told: in whole ticks and steps.
    form : RowFormat
        The units of what follows.
    first : ndarray of int, shape (b + 1,)
        Move i has the rows ``first[i]`` to ``first[i + 1]``, the first at its start.
    time : ndarray of int, shape (r,)
        Since the move's start. [ticks]
    position, velocity : dict of int to ndarray of int, shape (r,)
        For each axis (index in `AXES`) that any of the moves uses, in steps from the program's
        zero; 0 in moves in which it stands still. [steps]
    residual, conventional_residual : ndarray, shape (b, m)
        Displacement that each mode keeps, of the rows and of the controller's own rapid. [mm]
    worst_in_band : ndarray, shape (b,)
        As in `Plans`, of the rows. [mm]
    peaks : ndarray, shape (2, 3, b)
        Largest velocity, acceleration and jerk along the way, as planned and as written.
    passes : ndarray of bool, shape (b,)
        Rounding makes it pass a limit.
    """

    moves: NDArray[np.int64]
    plans: Plans
    form: RowFormat
    first: NDArray[np.int64]
    time: Ticks
    position: dict[int, Ticks]
    velocity: dict[int, Ticks]
    residual: Array
    conventional_residual: Array
    worst_in_band: Array
    peaks: Array
    passes: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.moves)

    def __repr__(self) -> str:
        return f"<Rows: {len(self)} moves of {len(self.time)} rows>"

    def rows_of(self, index: int) -> slice:
        """The rows of one move."""
        return slice(int(self.first[index]), int(self.first[index + 1]))

    def axes_of(self, index: int) -> list[int]:
        """The axes that one move moves."""
        return [a for a in self.position if self.plans.displacement[self.moves[index], a] != 0.0]

    def take(self, index: NDArray[np.int64]) -> Rows:
        """Some of the moves."""
        count = np.diff(self.first)[index]
        first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        row = np.arange(first[-1]) + np.repeat(self.first[index] - first[:-1], count)
        return replace(
            self,
            moves=self.moves[index],
            first=first,
            time=self.time[row],
            position={axis: column[row] for axis, column in self.position.items()},
            velocity={axis: column[row] for axis, column in self.velocity.items()},
            residual=self.residual[index],
            conventional_residual=self.conventional_residual[index],
            worst_in_band=self.worst_in_band[index],
            peaks=self.peaks[:, :, index],
            passes=self.passes[index],
        )

    def deviation(self) -> Array:
        """How far the paths leave the control's own, as `independent_axes.path_deviation` [mm]."""
        plans, moves = self.plans, self.moves
        if plans.machine.positioning == "linear":
            return np.zeros(len(self))
        interval = plans.machine.interval
        rows = np.concatenate([np.array(plans.profiles_of(int(move))) for move in moves])
        row_of = np.searchsorted(moves, plans.move[rows])
        grid = Grid.every(np.maximum(whole_intervals(plans.times[moves], interval), 1), 1, interval)
        unit, _ = sample_profiles(plans.profiles.take(rows), grid.knots[row_of], interval)
        exact: dict[int, Array] = {}
        for axis in self.position:
            exact[axis] = np.zeros(grid.knots.shape)
            np.add.at(exact[axis], row_of, unit * plans.share[rows, axis, np.newaxis])
        return deviation_of(plans, moves, grid, exact, np.zeros((len(moves), len(AXES))))


def make_rows(plans: Plans, rapids: Rapids, form: RowFormat, peaks: Array) -> Iterator[list[Rows]]:
    """Rows of all planned moves, window by window.

    Parameters
    ----------
    plans : Plans
        As `told_in` gives them.
    rapids : Rapids
        The program's.
    form : RowFormat
        The same.
    peaks : ndarray, shape (3, n)
        As `told_in` gives them.

    Yields
    ------
    list of Rows
        The moves of a window, each once; windows come in the order of the moves. Moves whose rows
        are not better than today's rapid, or too many, are in none, and `plans.reason` says so.
    """
    planned = np.flatnonzero(plans.planned)
    count = np.bincount(plans.move, np.diff(plans.profiles.first), minlength=len(plans))[planned]
    window = (np.cumsum(count + 1) // BATCH_ROWS).astype(np.int64)
    for k in np.unique(window):
        moves = planned[window == k]
        octave = np.frexp(plans.times[moves])[1]
        made = (_make(plans, rapids, form, moves[octave == o], peaks) for o in np.unique(octave))
        if batches := [rows for rows in made if len(rows)]:
            yield batches


def _make(
    plans: Plans, rapids: Rapids, form: RowFormat, moves: NDArray[np.int64], peaks: Array
) -> Rows:
    """The rows of moves of like duration, without those that are ruled out."""
    rows = _Maker(plans, rapids, form, moves).rows(peaks[:, moves])
    many = np.diff(rows.first) - 1 > (form.most or np.inf)
    worse = rows.worst_in_band > plans.most_in_band[moves]
    take_out(plans, moves[worse], Reason.NOT_BETTER)
    take_out(plans, moves[rows.passes], Reason.NOT_PLAYED)
    take_out(plans, moves[many], Reason.TOO_LONG)
    out = worse | rows.passes | many
    return rows.take(np.flatnonzero(~out)) if out.any() else rows


class _Maker:
    """What is needed to make the rows of some moves."""

    def __init__(
        self, plans: Plans, rapids: Rapids, form: RowFormat, moves: NDArray[np.int64]
    ) -> None:
        self.plans, self.form, self.moves = plans, form, moves
        used = np.flatnonzero(np.isin(plans.move, moves))
        self.profiles = plans.profiles.take(used)
        self.own = np.searchsorted(moves, plans.move[used])
        """The move of each profile, counted within these."""
        self.share = plans.share[used]
        self.conventional = plans.conventional.take(used)
        self.axes = [a for a in range(len(AXES)) if self.share[:, a].any()]
        start = np.nan_to_num(rapids.start[moves])
        self.start = np.rint(start / form.step).astype(np.int64)
        self.begin = np.rint(self.profiles.begin / form.tick).astype(np.int64)
        self.end = np.rint(self.profiles.total / form.tick).astype(np.int64)

    def rows(self, peaks: Array) -> Rows:
        """Collect, round and judge."""
        first, time = self._boundaries()
        of_row = np.repeat(np.arange(len(self.moves)), np.diff(first))
        positions, velocities = self._motion(first, time)
        step, speed_step = self.form.step, self.form.speed_step
        position: dict[int, Ticks] = {}
        velocity: dict[int, Ticks] = {}
        for axis in self.axes:
            moves = (self.plans.displacement[self.moves, axis] != 0.0)[of_row]
            steps = np.rint(positions[axis] / step[axis]).astype(np.int64)
            position[axis] = np.where(moves, self.start[of_row, axis] + steps, 0)
            rounded = np.rint(velocities[axis] / speed_step[axis])
            velocity[axis] = np.where(moves, rounded, 0.0).astype(np.int64)
        written = Cubics(
            self.plans,
            self.moves,
            first,
            np.asarray(time * self.form.tick, dtype=np.float64),
            {axis: whole * step[axis] for axis, whole in position.items()},
            {axis: whole * speed_step[axis] for axis, whole in velocity.items()},
        )
        response, worst = written.left()
        modes = self.plans.modes
        return Rows(
            moves=self.moves,
            plans=self.plans,
            form=self.form,
            first=first,
            time=time,
            position=position,
            velocity=velocity,
            residual=residual_displacement(response, modes.poles),
            conventional_residual=self._conventional(),
            worst_in_band=worst,
            peaks=np.stack([peaks, written.peaks()]),
            passes=written.passes(),
        )

    def _boundaries(self) -> tuple[NDArray[np.int64], Ticks]:
        """When the rows of every move stand: where any axis's segment begins or ends."""
        owner = self.own[self.profiles.owner]
        keys = np.concatenate([owner * _MOVE + self.begin, self.own * _MOVE + self.end])
        keys = np.unique(keys)
        if self.form.longest is not None:
            keys = self._split(keys)
        first = np.searchsorted(keys, np.arange(len(self.moves) + 1) * _MOVE)
        return first.astype(np.int64), keys % _MOVE

    def _split(self, keys: Ticks) -> Ticks:
        """More rows within segments that are too long for one."""
        assert self.form.longest is not None
        length = np.append(np.diff(keys), 0)
        inside = np.append(keys[1:] // _MOVE == keys[:-1] // _MOVE, False)
        parts = np.where(inside, -(-length // self.form.longest), 1)
        place = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
        whole = np.repeat(np.where(inside, length, 0), parts)
        out: Ticks = np.repeat(keys, parts) + place * whole // np.repeat(parts, parts)
        return out

    def _motion(
        self, first: NDArray[np.int64], time: Ticks
    ) -> tuple[dict[int, Array], dict[int, Array]]:
        """Displacement and velocity of each axis at the rows, not rounded."""
        count = np.diff(first)[self.own]
        of_pair = np.repeat(np.arange(len(self.own)), count)
        row = np.arange(len(of_pair)) + np.repeat(
            first[:-1][self.own] - (np.cumsum(count) - count), count
        )
        profiles = self.profiles
        keys = profiles.owner * _MOVE + self.begin
        segment = np.searchsorted(keys, of_pair * _MOVE + time[row], side="right") - 1
        dt = (time[row] - self.begin[segment]) * self.form.tick
        arrived = time[row] >= self.end[of_pair]
        a, j = profiles.acceleration[segment], profiles.jerk[segment]
        v = profiles.velocity[segment] + (a + 0.5 * j * dt) * dt
        p = profiles.position[segment] + (
            (profiles.velocity[segment] + (0.5 * a + j * dt / 6.0) * dt) * dt
        )
        p, v = np.where(arrived, 1.0, p), np.where(arrived | (time[row] == 0), 0.0, v)
        positions: dict[int, Array] = {}
        velocities: dict[int, Array] = {}
        for axis in self.axes:
            share = self.share[of_pair, axis]
            positions[axis] = np.bincount(row, p * share, len(time)).astype(float)
            velocities[axis] = np.bincount(row, v * share, len(time)).astype(float)
        return positions, velocities

    def _conventional(self) -> Array:
        """What the controller's own rapids leave, exactly, shape (b, m) [mm]."""
        modes, profiles = self.plans.modes, self.conventional
        longest = np.zeros(len(self.moves))
        np.maximum.at(longest, self.own, profiles.total)
        left = (longest[self.own] - profiles.total)[:, np.newaxis]
        each = profiles_response(profiles, modes.poles) * np.exp(modes.poles * left)
        response = np.zeros((len(self.moves), len(modes.poles)), dtype=np.complex128)
        np.add.at(response, self.own, each * (self.share @ modes.participation.T))
        return residual_displacement(response, modes.poles)
