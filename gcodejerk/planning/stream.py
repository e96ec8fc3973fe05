"""Streams: planned moves as the points that are written, and what these leave in the modes.

This module owns the step from profiles to written numbers: sampling at the interval, rounding to
whole steps, and the residual of exactly what was rounded, as the control plays it (`lines.Play`).
It works on batches, so that a program
with a hundred thousand rapids needs no more memory than one with a thousand.

Rule: a report speaks of the stream as written, and as written it has to be better: where a stream
leaves more than the control's own rapid does, at the worst frequencies within the band, its move is
taken out of the plan.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import (
    Grid,
    Objective,
    Profiles,
    grouped,
    knots_response,
    residual_displacement,
    round_positions,
    sample_profiles,
    sampled_response,
    whole_intervals,
)
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.planning.lines import (
    Play,
    block_times,
    missing_times,
    played_positions,
    smoothed,
    undecayed,
    worst_of_lines,
)
from gcodejerk.planning.plans import Plans
from gcodejerk.reasons import REASONS, Reason

BATCH_SAMPLES = 400_000
"""Samples of a batch, about; each needs some 100 bytes while it is worked on."""
FINE_DECIMALS = 3
"""Decimals more than the resolution's for an axis that moves a few steps only."""
FEW_STEPS = 8.0
"""An axis that moves less than this many steps is written finer."""
NO_LENGTH = 1e-5
"""A block in which no axis moves this share of a step has no length. [steps]"""


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
    residual, conventional_residual : ndarray, shape (b, m)
        Displacement envelope of each mode at arrival, of the stream as written and of the
        controller's own rapid sampled at the interval. [mm]
    worst_in_band : ndarray, shape (b,)
        The largest that any mode keeps with every frequency anywhere within `design.band`: of the
        straight lines as they are written, or, where the control follows the profile between the
        points, of the profile with what rounding may add. NaN where the plans do not say. [mm]
    profiles : Profiles
        The profiles that are written, one for each of the plans' profiles of these moves.
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

    def __len__(self) -> int:
        return len(self.moves)

    def __repr__(self) -> str:
        return f"<Batch: {len(self)} streams of up to {self.grid.knots.shape[1]} points>"

    def positions(self, row: int) -> tuple[Array, Array]:
        """Moments [s] and positions [mm], shape (k, 9), of one move as written; ends exact."""
        knots = self.grid.knots[row]
        begin = len(knots) - 1 - int(np.count_nonzero(knots))
        out = np.tile(self.number_format.start[row], (len(knots) - begin, 1))
        for axis, written in self.written.items():
            if self.plans.displacement[self.moves[row], axis]:
                out[:, axis] = written[row, begin:]
        return knots[begin:] * self.grid.interval, out


def make_streams(
    plans: Plans, number_format: NumberFormat, stride: int, play: Play = Play.TABLE
) -> Iterator[list[Batch]]:
    """Streams of all planned moves, window by window.

    Parameters
    ----------
    plans : Plans
        n moves.
    number_format : NumberFormat
        Columns of the same n moves.
    stride : int
        Intervals from one written point to the next.
    play : Play
        What the control makes of the points.

    Yields
    ------
    list of Batch
        The moves of a window, each once; windows come in the order of the moves. A batch is a
        matrix as wide as its longest move, so those of a window hold moves of like duration. Moves
        whose stream is not better than today's rapid are in none, and `plans.reason` says so.
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
        made = (
            _make_batch(plans, moves, number_format, stride, play)
            for moves in (window[octave == k] for k in np.unique(octave))
        )
        if batches := [batch for batch in made if len(batch)]:
            yield batches
        begin = end


def _make_batch(
    plans: Plans,
    moves: NDArray[np.int64],
    number_format: NumberFormat,
    stride: int,
    play: Play = Play.TABLE,
) -> Batch:
    """One batch, without the moves that it would make worse; these are ruled out."""
    batch = _Maker(plans, moves, number_format.take(moves), stride, play).batch()
    worse = batch.worst_in_band > plans.most_in_band[moves]
    if not worse.any():
        return batch
    plans.reason[moves[worse]] = REASONS.index(Reason.NOT_BETTER)
    return _make_batch(plans, moves[~worse], number_format, stride, play)


def _bounds(plans: Plans, move: int) -> tuple[int, int]:
    """First profile of a move, and the one behind its last."""
    profiles = plans.profiles_of(int(move))
    return profiles.start, profiles.stop


class _Maker:
    """What is needed to make a batch."""

    def __init__(
        self,
        plans: Plans,
        moves: NDArray[np.int64],
        number_format: NumberFormat,
        stride: int,
        play: Play,
    ) -> None:
        self.plans, self.moves, self.play = plans, moves, play
        bounds = [np.arange(*_bounds(plans, move)) for move in moves]
        self.rows = np.concatenate([np.zeros(0, np.int64), *bounds]).astype(np.int64)
        self.row_of = np.searchsorted(moves, plans.move[self.rows])
        self.share = plans.share[self.rows]
        self.axes = [a for a in range(len(AXES)) if self.share[:, a].any()]
        self.modes = plans.modes
        self.interval = plans.machine.interval
        self.grid = Grid.every(plans.counts[moves], stride, self.interval)
        # Rounding is kept away from the modes' own frequencies: it is loudest at the band's ends.
        self.every = Objective(self.modes.poles, self.modes.participation.T, self.modes.group)
        self.around = self.every.in_band(plans.machine.design.band, 0.0, fewest=1)
        size = np.abs(plans.displacement[moves])
        fine = (size > 0.0) & (size < FEW_STEPS * number_format.step) & number_format.finer
        self.fine = fine
        self.no_length = NO_LENGTH * number_format.step
        self.number_format = NumberFormat(
            number_format.start,
            np.where(fine, number_format.step / 10.0**FINE_DECIMALS, number_format.step),
            number_format.origin,
            number_format.finer,
        )

    def batch(self) -> Batch:
        """Sample, round, and see what is left in the modes."""
        profiles = self.plans.profiles.take(self.rows)
        unit, speed = sample_profiles(profiles, self.grid.knots[self.row_of], self.interval)
        exact: dict[int, Array] = {}
        whole: dict[int, NDArray[np.int64]] = {}
        velocity: dict[int, Array] = {}
        written: dict[int, Array] = {}
        for axis in self.axes:
            # Where an axis stands still its position may be unknown, and nothing is written of it.
            moving = self._moving(axis)
            start = np.where(moving, self.number_format.start[:, axis], 0.0)
            exact[axis] = start[:, np.newaxis] + self._displaced(unit, axis)
            velocity[axis] = self._displaced(speed, axis)
            active = np.abs(self.modes.participation[:, axis]) > 0.0
            step = self.number_format.step[:, axis]
            origin = np.where(moving, self.number_format.origin[:, axis], 0.0)
            whole[axis] = round_positions(
                exact[axis], self.grid, step, origin,
                self.modes.poles[active], self.modes.participation[active, axis],
                None if self.play is Play.PROFILE else self._highest(profiles, axis),
            )  # fmt: skip
            rounded = origin[:, np.newaxis] + whole[axis] * step[:, np.newaxis]
            end = start + np.where(moving, self.plans.displacement[self.moves, axis], 0.0)
            written[axis] = self._with_ends(rounded, start, end)
        times = block_times(self._moved(written), self.grid)
        if self.play is Play.PROFILE:
            residual, worst = self._left_by_profile(profiles, exact, written)
        else:
            residual, worst = self._left_by_lines(written, times)
        return Batch(
            moves=self.moves,
            plans=self.plans,
            grid=self.grid,
            whole=whole,
            exact=exact,
            written=written,
            times=times,
            number_format=self.number_format,
            fine=self.fine,
            velocity=velocity,
            residual=residual,
            conventional_residual=self._conventional_residual(),
            worst_in_band=worst,
            profiles=profiles,
        )

    def _moving(self, axis: int) -> NDArray[np.bool_]:
        """Which moves move an axis."""
        moving: NDArray[np.bool_] = self.plans.displacement[self.moves, axis] != 0.0
        return moving

    def _with_ends(self, positions: Array, start: Array, end: Array) -> Array:
        """Positions between exact ends."""
        knots, counts = self.grid.knots, self.grid.counts[:, np.newaxis]
        inner = np.where(knots < counts, positions, end[:, np.newaxis])
        return np.where(knots > 0, inner, start[:, np.newaxis])

    def _highest(self, profiles: Profiles, axis: int) -> Array:
        """The highest speed of an axis on each move, shape (b,) [mm/s]."""
        out = np.zeros(len(self.moves))
        np.maximum.at(out, self.row_of, profiles.peak_velocity * np.abs(self.share[:, axis]))
        return out

    def _moved(self, written: dict[int, Array]) -> NDArray[np.bool_]:
        """Whether any axis moves in the block that ends at each moment, shape (b, k)."""
        moved = np.zeros(self.grid.knots.shape, dtype=np.bool_)
        for axis, positions in written.items():
            step = np.abs(np.diff(positions, axis=1, prepend=positions[:, :1]))
            moved |= step > self.no_length[:, axis, np.newaxis]
        return moved

    def _left_by_lines(
        self, written: dict[int, Array], times: NDArray[np.int64]
    ) -> tuple[Array, Array]:
        """Residual of straight lines between the points, and the worst within the band [mm]."""
        early = np.zeros(len(self.moves), dtype=np.int64)
        if self.play is Play.HELD:
            early = missing_times(times, self.grid)
            written = {a: played_positions(q, times, self.grid) for a, q in written.items()}
        response = np.zeros((len(self.moves), len(self.modes.poles)), dtype=np.complex128)
        for axis, positions in written.items():
            participation = self.modes.participation[:, axis]
            felt = participation != 0.0
            found = knots_response(positions, self.grid, self.modes.poles[felt])
            response[:, felt] += found * participation[felt]
        residual = residual_displacement(response, self.modes.poles)
        residual *= undecayed(early, self.modes.poles * self.interval)
        if self.play is Play.SCALED:
            residual *= smoothed(self.modes.poles * self.interval)
        worst = self.plans.worst_in_band[self.moves]
        if np.isfinite(worst).any():
            band = self.plans.machine.design.band
            worst = worst_of_lines(written, self.grid, self.every, band, early)
        return residual, worst

    def _left_by_profile(
        self, profiles: Profiles, exact: dict[int, Array], written: dict[int, Array]
    ) -> tuple[Array, Array]:
        """Residual of the profile at every interval and of the rounding of its points [mm]."""
        response = self._response(profiles, self.grid.counts)
        noise = np.zeros((len(self.moves), len(self.around.poles)), dtype=np.complex128)
        for axis, positions in written.items():
            between = (self.grid.knots > 0) & (self.grid.knots < self.grid.counts[:, np.newaxis])
            error = np.where(between, positions - exact[axis], 0.0)
            error = error * self._moving(axis)[:, np.newaxis]
            for felt_by, poles, participation in (
                (response, self.modes.poles, self.modes.participation[:, axis]),
                (noise, self.around.poles, self.around.weights[axis]),
            ):
                felt = participation != 0.0
                found = knots_response(error, self.grid, poles[felt])
                felt_by[:, felt] += found * participation[felt]
        noise_in_band = grouped(residual_displacement(noise, self.around.poles), self.around.group)
        worst = self.plans.worst_in_band[self.moves] + noise_in_band.max(axis=1, initial=0.0)
        return residual_displacement(response, self.modes.poles), worst

    def _conventional_residual(self) -> Array:
        """Of the controller's own rapid, sampled at the interval, shape (b, m) [mm]."""
        profiles = self.plans.conventional.take(self.rows)
        counts = whole_intervals(profiles.total, self.interval)
        longest = np.zeros(len(self.moves), dtype=np.int64)
        np.maximum.at(longest, self.row_of, counts)
        return residual_displacement(self._response(profiles, longest), self.modes.poles)

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

    def add(self, batch: Batch) -> None:
        """Note one batch."""
        self.residual[batch.moves] = batch.residual
        self.conventional[batch.moves] = batch.conventional_residual
