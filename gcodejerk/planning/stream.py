"""Streams: planned moves as the points that are written, and what these leave in the modes.

This module owns the step from profiles to written numbers: sampling at the interval, rounding to
whole steps, and the residual of exactly what was rounded. It works on batches, so that a program
with a hundred thousand rapids needs no more memory than one with a thousand.

Rule: a report speaks of the stream as written. Where rounding has made a design worse than the
conventional profile, the conventional profile is written instead.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import (
    Grid,
    Profiles,
    knots_response,
    residual_displacement,
    round_positions,
    sample_profiles,
    sampled_response,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.planning.plans import Plans

BATCH_SAMPLES = 400_000
"""Samples of a batch, about; each needs some 100 bytes while it is worked on."""
FINE_DECIMALS = 3
"""Decimals more than the resolution's for an axis that moves a few steps only."""
FEW_STEPS = 8.0
"""An axis that moves less than this many steps is written finer."""


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
    number_format : NumberFormat
        The steps and origins of these moves.
    fine : ndarray of bool, shape (b, 9)
        The step is FINE_DECIMALS finer than asked for, since the axis moves a few steps only.
    velocity : dict of int to ndarray, shape (b, k)
        Velocity of each axis. [mm/s] or [deg/s]
    residual, conventional_residual : ndarray, shape (b, m)
        Displacement envelope of each mode at arrival, of the stream as written and of the
        controller's own rapid sampled at the interval. [mm]
    stays_conventional : ndarray of bool, shape (b,)
        The stream is the conventional profile.
    profiles : Profiles
        The profiles that are written, one for each of the plans' profiles of these moves.
    """

    moves: NDArray[np.int64]
    plans: Plans
    grid: Grid
    whole: dict[int, NDArray[np.int64]]
    exact: dict[int, Array]
    number_format: NumberFormat
    fine: NDArray[np.bool_]
    velocity: dict[int, Array]
    residual: Array
    conventional_residual: Array
    stays_conventional: NDArray[np.bool_]
    profiles: Profiles

    def __len__(self) -> int:
        return len(self.moves)

    def __repr__(self) -> str:
        return f"<Batch: {len(self)} streams of up to {self.grid.knots.shape[1]} points>"

    def positions(self, row: int) -> tuple[Array, Array]:
        """Moments [s] and positions [mm], shape (k, 9), of one move as written; ends exact."""
        knots = self.grid.knots[row]
        begin = len(knots) - 1 - int(np.count_nonzero(knots))
        start = self.number_format.start[row]
        out = np.tile(start, (len(knots) - begin, 1))
        for axis, whole in self.whole.items():
            written = (
                self.number_format.origin[row, axis]
                + whole[row, begin:] * self.number_format.step[row, axis]
            )
            displacement = self.plans.displacement[self.moves[row], axis]
            if displacement:
                out[:, axis] = written
                out[0, axis], out[-1, axis] = start[axis], start[axis] + displacement
        return knots[begin:] * self.grid.interval, out


def make_streams(plans: Plans, number_format: NumberFormat, stride: int) -> Iterator[list[Batch]]:
    """Streams of all planned moves, window by window.

    Parameters
    ----------
    plans : Plans
        n moves.
    number_format : NumberFormat
        Columns of the same n moves.
    stride : int
        Intervals from one written point to the next.

    Yields
    ------
    list of Batch
        The moves of a window, each once; windows come in the order of the moves. A batch is a
        matrix as wide as its longest move, so those of a window hold moves of like duration.
    """
    planned = np.nonzero(plans.planned)[0]
    samples = np.cumsum(plans.counts[planned])
    begin = 0
    while begin < len(planned):
        before = samples[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(samples, before + BATCH_SAMPLES, side="right")))
        window = planned[begin:end]
        # Of like duration: within a factor of two.
        octave = np.frexp(plans.counts[window].astype(float))[1]
        yield [
            _make_batch(plans, moves, number_format.take(moves), stride)
            for moves in (window[octave == k] for k in np.unique(octave))
        ]
        begin = end


def _make_batch(
    plans: Plans, moves: NDArray[np.int64], number_format: NumberFormat, stride: int
) -> Batch:
    """One batch; a move that rounding made worse than the conventional profile gets that one."""
    rows = np.concatenate([np.arange(*_bounds(plans, move)) for move in moves]).astype(np.int64)
    row_of = np.searchsorted(moves, plans.move[rows])
    # Of axes that run on their own, some may keep the conventional profile: the move has not kept
    # it.
    stays_conventional = np.ones(len(moves), dtype=bool)
    np.logical_and.at(stays_conventional, row_of, plans.stays_conventional[rows])
    made = _Maker(plans, moves, rows, row_of, number_format, stride)
    conventional = made.conventional_residual()
    batch = made.batch(plans.profiles.take(rows), stays_conventional, conventional)
    worst = plans.modes.grouped(batch.residual).max(axis=1, initial=0.0)
    reference = plans.modes.grouped(conventional).max(axis=1, initial=0.0)
    worse = (worst > reference) & made.writable(plans.conventional.take(rows)) & ~stays_conventional
    if worse.any():
        profiles = plans.profiles.take(rows)
        again = worse[row_of]
        profiles = profiles.replaced(again, plans.conventional.take(rows[again]))
        batch = made.batch(profiles, stays_conventional | worse, conventional)
    # What is written as the conventional profile is the conventional profile, rounding included.
    same = batch.stays_conventional[:, np.newaxis]
    return replace(batch, conventional_residual=np.where(same, batch.residual, conventional))


def _bounds(plans: Plans, move: int) -> tuple[int, int]:
    """First profile of a move, and the one behind its last."""
    profiles = plans.profiles_of(int(move))
    return profiles.start, profiles.stop


class _Maker:
    """The parts of a batch that do not depend on which profile is written."""

    def __init__(
        self,
        plans: Plans,
        moves: NDArray[np.int64],
        rows: NDArray[np.int64],
        row_of: NDArray[np.int64],
        number_format: NumberFormat,
        stride: int,
    ) -> None:
        self.plans, self.moves, self.rows, self.row_of = plans, moves, rows, row_of
        self.share = plans.share[rows]
        self.axes = [a for a in range(len(AXES)) if self.share[:, a].any()]
        self.modes = plans.modes
        self.interval = plans.machine.interval
        self.grid = Grid.every(plans.counts[moves], stride, self.interval)
        size = np.abs(plans.displacement[moves])
        fine = (size > 0.0) & (size < FEW_STEPS * number_format.step) & number_format.finer
        self.fine = fine
        self.number_format = NumberFormat(
            number_format.start,
            np.where(fine, number_format.step / 10.0**FINE_DECIMALS, number_format.step),
            number_format.origin,
            number_format.finer,
        )

    def writable(self, profiles: Profiles) -> NDArray[np.bool_]:
        """Whether the moves' profiles, all of them, fit the time and keep the limits of jerk."""
        out = np.ones(len(self.moves), dtype=bool)
        room = self.grid.counts[self.row_of] * self.interval * (1.0 + 1e-9)
        np.logical_and.at(out, self.row_of, profiles.total <= room)
        jerk = profiles.peak_jerk
        finite = np.isfinite(jerk)
        np.logical_and.at(out, self.row_of, finite)
        jerk = np.where(finite, jerk, 0.0)
        for axis in self.plans.machine.axes:
            size = np.abs(self.share[:, AXES.index(axis.name)])
            np.logical_and.at(out, self.row_of, jerk * size <= axis.limit.jerk * (1.0 + 1e-9))
        return out

    def conventional_residual(self) -> Array:
        """Of the controller's own rapid, sampled at the interval, shape (b, m) [mm]."""
        profiles = self.plans.conventional.take(self.rows)
        counts = whole_intervals(profiles.total, self.interval)
        longest = np.zeros(len(self.moves), dtype=np.int64)
        np.maximum.at(longest, self.row_of, counts)
        return residual_displacement(self._response(profiles, longest), self.modes.poles)

    def batch(
        self, profiles: Profiles, stays_conventional: NDArray[np.bool_], conventional: Array
    ) -> Batch:
        """Sample, round, and see what is left in the modes."""
        moments = self.grid.knots[self.row_of]
        unit, speed = sample_profiles(profiles, moments, self.interval)
        exact: dict[int, Array] = {}
        whole: dict[int, NDArray[np.int64]] = {}
        velocity: dict[int, Array] = {}
        response = self._response(profiles, self.grid.counts)
        for axis in self.axes:
            # Where an axis stands still its position may be unknown, and nothing is written of it.
            moving = self.plans.displacement[self.moves, axis] != 0.0
            start = np.where(moving, self.number_format.start[:, axis], 0.0)
            exact[axis] = start[:, np.newaxis] + self._displaced(unit, axis)
            velocity[axis] = self._displaced(speed, axis)
            active = np.abs(self.modes.participation[:, axis]) > 0.0
            step = self.number_format.step[:, axis]
            origin = np.where(moving, self.number_format.origin[:, axis], 0.0)
            whole[axis] = round_positions(
                exact[axis], self.grid, step, origin,
                self.modes.poles[active], self.modes.participation[active, axis],
            )  # fmt: skip
            error = origin[:, np.newaxis] + whole[axis] * step[:, np.newaxis] - exact[axis]
            begun = self.grid.knots > 0
            error = np.where(
                begun & (self.grid.knots < self.grid.counts[:, np.newaxis]), error, 0.0
            )
            noise = knots_response(error * moving[:, np.newaxis], self.grid, self.modes.poles)
            response = response + noise * self.modes.participation[:, axis]
        return Batch(
            moves=self.moves,
            plans=self.plans,
            grid=self.grid,
            whole=whole,
            exact=exact,
            number_format=self.number_format,
            fine=self.fine,
            velocity=velocity,
            residual=residual_displacement(response, self.modes.poles),
            conventional_residual=conventional,
            stays_conventional=stays_conventional,
            profiles=profiles,
        )

    def _displaced(self, unit: Array, axis: int) -> Array:
        """Sum of an axis's profiles times its share of each, shape (b, k)."""
        out = np.zeros((len(self.moves), unit.shape[1]))
        used = self.share[:, axis] != 0.0
        np.add.at(out, self.row_of[used], unit[used] * self.share[used, axis, np.newaxis])
        return out

    def _response(self, profiles: Profiles, counts: NDArray[np.int64]) -> Complex:
        """Response of the modes to moves sampled at every interval, not rounded, shape (b, m)."""
        every = Grid.every(counts, 1, self.interval)
        unit, _ = sample_profiles(profiles, every.knots[self.row_of], self.interval)
        each = sampled_response(unit, self.interval, self.modes.poles)
        weights = self.share @ self.modes.participation.T
        response = np.zeros((len(self.moves), len(self.modes.poles)), dtype=np.complex128)
        np.add.at(response, self.row_of, each * weights)
        return response


class Residuals:
    """Collects from batches what a report needs."""

    def __init__(self, plans: Plans) -> None:
        shape = (len(plans), len(plans.modes.poles))
        self.residual = np.full(shape, np.nan)
        self.conventional = np.full(shape, np.nan)
        self.stays_conventional = np.zeros(len(plans), dtype=bool)

    def add(self, batch: Batch) -> None:
        """Note one batch."""
        self.residual[batch.moves] = batch.residual
        self.conventional[batch.moves] = batch.conventional_residual
        self.stays_conventional[batch.moves] = batch.stays_conventional
