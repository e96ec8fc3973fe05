"""What a stream is: how its numbers are rounded, and the streams of a batch of moves as columns.

This module owns the shape of what is written, and what every way of writing needs to know of the
planned profiles: where they are, and what they and today's rapids leave in the modes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import (
    Grid,
    Profiles,
    residual_displacement,
    sample_profiles,
    sampled_response,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.planning.plans import Plans

SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")


@dataclass(frozen=True, slots=True, eq=False)
class NumberFormat:
    """How positions are to be rounded: columns of n moves.

    Attributes
    ----------
    start : ndarray, shape (n, 9)
        Position before the move. [mm] or [deg]
    step : ndarray, shape (n, 9)
        Smallest step that is written. [mm] or [deg]
    origin : ndarray, shape (n, 9)
        Where the steps are counted from: 0, or the start for increments. [mm] or [deg]
    finer : bool
        The control keeps steps finer than these, so that an axis that moves a few of them only may
        be written in finer ones.
    """

    start: Array
    step: Array
    origin: Array
    finer: bool = True

    def take(self, index: NDArray[np.int64]) -> NumberFormat:
        """Some of the moves."""
        return NumberFormat(self.start[index], self.step[index], self.origin[index], self.finer)


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """The streams of some planned moves, columns of b moves, aligned at the end like `Grid`.

    Attributes
    ----------
    moves : ndarray of int, shape (b,)
        Which moves of the plans.
    plans : Plans
        The plans that they belong to.
    grid : Grid
        The moments that are written, k columns.
    whole : dict of int to ndarray of int, shape (b, k)
        For each axis (index in `AXES`) that any of the moves uses: position in whole steps from
        the origin. The first and the last column stand for the exact start and end.
    exact : dict of int to ndarray, shape (b, k)
        The positions before rounding. [mm] or [deg]
    written : dict of int to ndarray, shape (b, k)
        The positions as written, the ends exact; 0 where an axis stands still. [mm] or [deg]
    times : ndarray of int, shape (b, k)
        How long a control that holds F takes for the block that ends at each moment; 0 for one
        without length (`lines.block_times`). [intervals]
    number_format : NumberFormat
        The steps and origins of these moves.
    fine : ndarray of bool, shape (b, 9)
        The step is FINE_DECIMALS finer than asked for, since the axis moves a few steps only.
    velocity : dict of int to ndarray, shape (b, k)
        Velocity of each axis. [mm/s] or [deg/s]
    path_speed : ndarray, shape (b, k), optional
        Speed along the path at each moment, where the control is told it (`aligned`). [mm/s]
    residual, conventional_residual : ndarray, shape (b, m)
        Displacement envelope of each mode at arrival, of the stream as written and of the
        controller's own rapid sampled at the interval. [mm]
    worst_in_band : ndarray, shape (b,)
        The largest that any mode keeps with every frequency anywhere within `design.band`: of the
        straight lines as they are written, or, where the control follows the profile between the
        points, of the profile with what rounding may add. NaN where the plans do not say. [mm]
    profiles : Profiles
        The profiles that are written, one for each of the plans' profiles of these moves.
    played : (Grid, dict of int to ndarray), optional
        Where the control has the axes go, by its own way of following the points, and when; as
        `grid` and `written` where it is left out. [mm] or [deg]
    """

    moves: NDArray[np.int64]
    plans: Plans
    grid: Grid
    whole: dict[int, NDArray[np.int64]]
    exact: dict[int, Array]
    written: dict[int, Array]
    times: NDArray[np.int64]
    number_format: NumberFormat
    fine: NDArray[np.bool_]
    velocity: dict[int, Array]
    residual: Array
    conventional_residual: Array
    worst_in_band: Array
    profiles: Profiles
    unplayable: NDArray[np.bool_]
    path_speed: Array | None = None
    played: tuple[Grid, dict[int, Array]] | None = None

    def __len__(self) -> int:
        return len(self.moves)

    def __repr__(self) -> str:
        return f"<Batch: {len(self)} streams of up to {self.grid.knots.shape[1]} points>"

    def take(self, rows: NDArray[np.int64]) -> Batch:
        """Some of the streams."""
        begin, end = (np.searchsorted(self.plans.move, self.moves, side=side) for side in SIDES)
        owner = np.repeat(np.arange(len(self)), end - begin)
        columns: dict[str, Any] = {
            name: {axis: values[rows] for axis, values in getattr(self, name).items()}
            for name in ("whole", "exact", "written", "velocity")
        }
        plain: dict[str, Any] = {
            name: getattr(self, name)[rows]
            for name in (
                *("moves", "times", "fine", "residual", "conventional_residual"),
                *("worst_in_band", "unplayable"),
            )
        }
        played = self.played
        if played is not None:
            played = played[0].take(rows), {axis: x[rows] for axis, x in played[1].items()}
        return replace(
            self,
            grid=self.grid.take(rows),
            played=played,
            number_format=self.number_format.take(rows),
            profiles=self.profiles.take(np.flatnonzero(np.isin(owner, rows))),
            path_speed=None if self.path_speed is None else self.path_speed[rows],
            **columns,
            **plain,
        )

    def positions(self, row: int) -> tuple[Array, Array]:
        """Moments [s] and positions [mm], shape (k, 9), of one move as written; ends exact."""
        out = np.tile(self.number_format.start[row], (self.grid.blocks[row] + 1, 1))
        return self._moved(row, self.grid, self.written, out)

    def drives(self, row: int) -> tuple[Array, Array]:
        """Moments [s] and ways [mm] that the drives are given, shape (k, 9), from 0."""
        grid, ways = self.played or (self.grid, self.written)
        times, out = self._moved(row, grid, ways, np.zeros((grid.blocks[row] + 1, len(AXES))))
        return times, out - out[0]

    def _moved(
        self, row: int, grid: Grid, ways: dict[int, Array], out: Array
    ) -> tuple[Array, Array]:
        """Moments of a move, and places of the axes that it moves put into `out`."""
        knots = grid.knots[row]
        begin = len(knots) - len(out)
        for axis, way in ways.items():
            if self.plans.displacement[self.moves[row], axis]:
                out[:, axis] = way[row, begin:]
        return knots[begin:] * grid.interval, out


class Sampler:
    """The planned profiles of the moves of a batch, sampled, and what they leave.

    Attributes
    ----------
    rows : ndarray of int, shape (r,)
        Profiles of the moves.
    row_of : ndarray of int, shape (r,)
        The move of each, counted within the batch.
    share : ndarray, shape (r, 9)
        What each carries. [mm] or [deg]
    axes : list of int
        Axes that any of the moves uses.
    """

    def __init__(self, plans: Plans, moves: NDArray[np.int64], number_format: NumberFormat) -> None:
        """Collect it.

        Parameters
        ----------
        plans : Plans
            All of them.
        moves : ndarray of int, shape (b,)
            Those of the batch, rising.
        number_format : NumberFormat
            Of these moves.
        """
        self.plans, self.moves, self.number_format = plans, moves, number_format
        first, last = (np.searchsorted(plans.move, moves, side=side) for side in SIDES)
        profiles = [np.arange(a, b) for a, b in zip(first, last, strict=True)]
        self.rows = np.concatenate([np.zeros(0, np.int64), *profiles]).astype(np.int64)
        self.row_of = np.searchsorted(moves, plans.move[self.rows])
        self.share = plans.share[self.rows]
        self.axes = [a for a in range(len(AXES)) if self.share[:, a].any()]
        self.modes = plans.modes
        self.interval = plans.machine.interval
        self.profiles = plans.profiles.take(self.rows)

    def moving(self, axis: int) -> NDArray[np.bool_]:
        """Which moves move an axis."""
        moving: NDArray[np.bool_] = self.plans.displacement[self.moves, axis] != 0.0
        return moving

    def start(self, axis: int) -> Array:
        """Where each move begins; 0 where the axis stands still, and may be anywhere."""
        return np.where(self.moving(axis), self.number_format.start[:, axis], 0.0)

    def displaced(self, unit: Array, axis: int) -> Array:
        """Sum of an axis's profiles times its share of each, shape (b, k)."""
        out = np.zeros((len(self.moves), unit.shape[1]))
        used = self.share[:, axis] != 0.0
        np.add.at(out, self.row_of[used], unit[used] * self.share[used, axis, np.newaxis])
        return out

    def conventional_residual(self) -> Array:
        """Of the controller's own rapid, sampled at the interval, shape (b, m) [mm]."""
        profiles = self.plans.conventional.take(self.rows)
        counts = whole_intervals(profiles.total, self.interval)
        longest = np.zeros(len(self.moves), dtype=np.int64)
        np.maximum.at(longest, self.row_of, counts)
        return residual_displacement(self._response(profiles, longest), self.modes.poles)

    def _response(self, profiles: Profiles, counts: NDArray[np.int64]) -> Complex:
        """Response of the modes to moves sampled at every interval, not rounded, shape (b, m)."""
        every = Grid.every(counts, 1, self.interval)
        unit, _ = sample_profiles(profiles, every.knots[self.row_of], self.interval)
        each = sampled_response(unit, self.interval, self.modes.poles)
        weights = self.share @ self.modes.participation.T
        response = np.zeros((len(self.moves), len(self.modes.poles)), dtype=np.complex128)
        np.add.at(response, self.row_of, each * weights)
        return response
