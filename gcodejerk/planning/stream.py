"""Streams: planned moves as the points that are written, and what these leave in the modes.

This module owns the step from profiles to written numbers: sampling at the interval, rounding to
whole steps, and the residual of exactly what was rounded, as the control plays it (`lines.Play`;
LinuxCNC's own way is `aligned`). It works on batches, so that a program with a hundred thousand
rapids needs no more memory than one with a thousand.

Rule: a report speaks of the stream as written, and as written it has to be better: where a stream
leaves more than the control's own rapid does, at the worst frequencies within the band, its move is
taken out of the plan. So is one that the control would play otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Grid, Profiles, has_step, round_positions, sample_profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.aligned import aligned_batch
from gcodejerk.planning.batch import Batch, NumberFormat, Sampler
from gcodejerk.planning.lines import (
    Play,
    block_times,
    left_by_lines,
    missing_times,
    played_positions,
    smoothed,
)
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.records import without_pauses
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.storage import column, gathered, kept

WINDOW_SAMPLES = 400_000
"""Samples of a window, about."""
BATCH_SAMPLES, BATCH_MOVES = 1 << 18, 2048
"""Samples of a batch at most, some 100 bytes each while it is worked on; and its moves."""
FINE_DECIMALS = 3
"""Decimals more than the resolution's for an axis that moves a few steps only."""
FEW_STEPS = 8.0
"""An axis that moves less than this many steps is written finer."""
NO_LENGTH = 1e-5
"""A block in which no axis moves this share of a step has no length. [steps]"""


def make_streams(
    plans: Plans,
    number_format: NumberFormat,
    stride: int,
    play: Play = Play.TABLE,
    like: NDArray[np.int64] | None = None,
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
    like : ndarray of int, shape (n,), optional
        The first move that has the very stream of each. The streams of the others are not made,
        and what is found of it is noted for all of them.

    Yields
    ------
    list of Batch
        The moves of a window, each once; windows come in the order of the moves. A batch is a
        matrix as wide as its longest move, so those of a window hold moves of like duration. Moves
        whose stream is not better than today's rapid are in none, and `plans.reason` says so.
    """
    for window in stream_windows(plans, number_format, stride, play, like):
        if batches := list(window):
            yield batches


def stream_windows(
    plans: Plans,
    number_format: NumberFormat,
    stride: int,
    play: Play = Play.TABLE,
    like: NDArray[np.int64] | None = None,
) -> Iterator[Iterator[Batch]]:
    """The same, each batch made when it is asked for, so that few of them are in memory at a time.

    Batches have to be taken before the next window is; a window may have none.
    """
    for window in moves_of_windows(plans, like):
        made = (make_batch(plans, moves, number_format, stride, play, like) for moves in window)
        yield (batch for batch in made if len(batch))


def moves_of_windows(
    plans: Plans, like: NDArray[np.int64] | None = None
) -> Iterator[list[NDArray[np.int64]]]:
    """The moves of the batches of each window; parameters as for `make_streams`."""
    planned = np.nonzero(plans.planned)[0]
    if like is not None:
        planned = planned[like[planned] == planned]
    planned, samples = kept(planned), kept(np.cumsum(plans.counts[planned]))
    begin = 0
    while begin < len(planned):
        before = samples[begin - 1] if begin else 0
        end = max(begin + 1, int(np.searchsorted(samples, before + WINDOW_SAMPLES, side="right")))
        window = planned[begin:end]
        # Of like duration: within a factor of two.
        octave = np.frexp(plans.counts[window].astype(float))[1]
        batches: list[NDArray[np.int64]] = []
        for k in np.unique(octave):
            moves = window[octave == k]
            most = min(max(BATCH_SAMPLES >> int(k), 1), BATCH_MOVES)
            batches += (moves[at : at + most] for at in range(0, len(moves), most))
        yield batches
        begin = end


def make_batch(
    plans: Plans,
    moves: NDArray[np.int64],
    number_format: NumberFormat,
    stride: int,
    play: Play = Play.TABLE,
    like: NDArray[np.int64] | None = None,
) -> Batch:
    """One batch, without moves that would be worse or played otherwise; these are ruled out."""
    sampler = Sampler(plans, moves, number_format.take(moves))
    if play is Play.ALIGNED:
        batch = aligned_batch(sampler, stride)
    else:
        batch = _Maker(sampler, stride, play).batch()
        batch = without_pauses(batch) if play is Play.INCREMENTS else batch
    worse = batch.worst_in_band > plans.most_in_band[moves]
    for which, why in ((worse, Reason.NOT_BETTER), (batch.unplayable, Reason.NOT_PLAYED)):
        if which.any():
            same = moves[which] if like is None else np.isin(like, moves[which])
            plans.reason[same] = REASONS.index(why)
    out = worse | batch.unplayable
    return batch.take(np.flatnonzero(~out)) if out.any() else batch


class _Maker:
    """What is needed to make a batch for a control that moves in straight lines."""

    def __init__(self, sampler: Sampler, stride: int, play: Play) -> None:
        self.sampler, self.play = sampler, play
        plans, moves, number_format = sampler.plans, sampler.moves, sampler.number_format
        self.plans, self.moves, self.modes = plans, moves, sampler.modes
        self.interval = sampler.interval
        self.grid = Grid.every(plans.counts[moves], stride, self.interval)
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
        sampler, profiles = self.sampler, self.sampler.profiles
        knots = self.grid.knots[sampler.row_of]
        unit, speed = sample_profiles(profiles, knots, self.interval)
        exact: dict[int, Array] = {}
        whole: dict[int, NDArray[np.int64]] = {}
        velocity: dict[int, Array] = {}
        written: dict[int, Array] = {}
        unplayable = np.zeros(len(self.moves), dtype=np.bool_)
        for axis in sampler.axes:
            # Where an axis stands still its position may be unknown, and nothing is written of it.
            moving, start = sampler.moving(axis), sampler.start(axis)
            exact[axis] = start[:, np.newaxis] + sampler.displaced(unit, axis)
            velocity[axis] = sampler.displaced(speed, axis)
            active = np.abs(self.modes.participation[:, axis]) > 0.0
            step = self.number_format.step[:, axis]
            origin = np.where(moving, self.number_format.origin[:, axis], 0.0)
            whole[axis] = round_positions(
                exact[axis], self.grid, step, origin,
                self.modes.poles[active], self.modes.participation[active, axis],
                self._highest(profiles, axis),
            )  # fmt: skip
            rounded = origin[:, np.newaxis] + whole[axis] * step[:, np.newaxis]
            end = start + np.where(moving, self.plans.displacement[self.moves, axis], 0.0)
            written[axis] = self._with_ends(rounded, start, end, self.no_length[:, axis])
            unplayable |= moving & ~has_step(start - origin, end - origin, step)
        times = block_times(self._moved(written), self.grid)
        residual, worst = self._left(written, times)
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
            conventional_residual=sampler.conventional_residual(),
            worst_in_band=worst,
            profiles=profiles,
            unplayable=unplayable,
            played=self._held(written, times) if self.play is Play.HELD else None,
        )

    def _held(
        self, written: dict[int, Array], times: NDArray[np.int64]
    ) -> tuple[Grid, dict[int, Array]]:
        """Where a control that holds F is, at the knots."""
        return self.grid, {a: played_positions(q, times, self.grid) for a, q in written.items()}

    def _with_ends(self, positions: Array, start: Array, end: Array, no_length: Array) -> Array:
        """Positions between exact ends, from which those that are as good as there do not differ.

        A sum of steps may differ from the same number in its last bit: that is no motion.
        """
        knots, counts = self.grid.knots, self.grid.counts[:, np.newaxis]
        start, end, no_length = (x[:, np.newaxis] for x in (start, end, no_length))
        left = np.where((knots > 0) & (np.abs(positions - start) > no_length), positions, start)
        return np.where((knots < counts) & (np.abs(left - end) > no_length), left, end)

    def _highest(self, profiles: Profiles, axis: int) -> Array:
        """The highest speed of an axis on each move, shape (b,) [mm/s]."""
        out = np.zeros(len(self.moves))
        each = profiles.peak_velocity * np.abs(self.sampler.share[:, axis])
        np.maximum.at(out, self.sampler.row_of, each)
        return out

    def _moved(self, written: dict[int, Array]) -> NDArray[np.bool_]:
        """Whether any axis moves in the block that ends at each moment, shape (b, k)."""
        moved = np.zeros(self.grid.knots.shape, dtype=np.bool_)
        for axis, positions in written.items():
            step = np.abs(np.diff(positions, axis=1, prepend=positions[:, :1]))
            moved |= step > self.no_length[:, axis, np.newaxis]
        return moved

    def _left(self, written: dict[int, Array], times: NDArray[np.int64]) -> tuple[Array, Array]:
        """Residual of straight lines between the points, and the worst within the band [mm]."""
        early = np.zeros(len(self.moves), dtype=np.int64)
        if self.play is Play.HELD:
            early = missing_times(times, self.grid)
            written = self._held(written, times)[1]
        residual, worst = left_by_lines(self.plans, self.moves, written, self.grid, early)
        if self.play is Play.SCALED:
            residual *= smoothed(self.modes.poles * self.interval)
        return residual, worst


class Residuals:
    """Collects from batches what a report needs."""

    def __init__(self, plans: Plans) -> None:
        shape = (len(plans), len(plans.modes.poles))
        self.residual = column(shape, np.nan)
        self.conventional = column(shape, np.nan)

    def note(self, moves: NDArray[np.int64], residual: Array, conventional: Array) -> None:
        """Note some moves."""
        self.residual[moves], self.conventional[moves] = residual, conventional

    def repeat(self, like: NDArray[np.int64]) -> None:
        """Note of all moves what was found of those that have the very streams."""
        self.residual = gathered(self.residual, like)
        self.conventional = gathered(self.conventional, like)
