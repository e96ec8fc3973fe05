r"""Streams as LinuxCNC plays them as planned: blocks that end on its servo periods.

LinuxCNC 2.9 in ramp mode changes the speed of a block linearly, exactly, from one period to the
next, if blocks end a hair before a period and are straight on; what the drives get is that behind
a filter. Measured and read in its source, this gives plain G1 blocks that are played as planned to
micrometres (`docs/linuxcnc.md`). This module owns what a batch of such streams is made of:

- the moves (`straight`) and their knots (`motion.servo.knots`), as long as look-ahead and a slow
  start need them;
- the speeds at the knots (`motion.servo.speed_fit`): behind the filter they follow the profile, and
  leave in the modes what the profile leaves;
- the written numbers, and what is played of them (`written`), which is what a report speaks of.

Rule: what the model does not show to be played within `TOLERANCE` of the profile is not written.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import Grid, profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.servo.knots import (
    CREEP,
    LONGEST,
    aligned_knots,
    block_kinds,
    early_shift,
)
from gcodejerk.motion.servo.speed_fit import Wanted, fit_speeds
from gcodejerk.motion.servo.spline_filter import unfiltered
from gcodejerk.planning.batch import Batch, Sampler
from gcodejerk.planning.lines import left_by_lines
from gcodejerk.planning.straight import LINEAR, USED, StraightMoves
from gcodejerk.planning.written import TAIL, Written

LOOK_AHEAD = 0.9
"""Share of the planner's look-ahead (ARC_BLEND_OPTIMIZATION_DEPTH) that is relied on."""
SLACK = 2e-5
"""Share of the velocity limit that is left to rounding."""
SEEN = 0.8
"""Modes up to this share of half the rate of knots are fitted; no speeds have higher ones."""
WEIGHTS = np.array([1e5, 1e4, 1e4])
"""Of the responses at the modes, and at the ends of the band, against 1 of an interval's speed."""
EMPHASES = ((1.0, 25.0), (1.0, 1.0), (10.0, 0.0), (0.1, 0.0), (1e-2, 0.0), (1e-4, 0.0), (1e-7, 0.0))
"""By which these are multiplied, and the stiffness, until a stream is near its profile."""
SHIFT = 1e-3
"""By which blocks that end before their periods may shift a stream, about. [mm]"""
NEAR = 0.8
"""Share of `TOLERANCE`."""
MOST_MODES = 24
"""Oscillators whose responses are fitted: of a spectrum the strongest."""
TOLERANCE = 0.01
"""How far a stream may be played from its profile. [mm]"""


def aligned_batch(sampler: Sampler, stride: int) -> Batch:
    """Streams of a batch of moves.

    Parameters
    ----------
    sampler : Sampler
        The b moves. Their number format says the step, one for all axes.
    stride : int
        Periods of a block, at least.

    Returns
    -------
    Batch
        Its grid has one knot more than the profile: the end of the tail. What the filter adds to
        the time is in none of its times. `unplayable` says which moves the control would not play
        as planned.
    """
    conventional = sampler.conventional_residual()  # first: it needs much room for a moment
    moves = StraightMoves.of(sampler)
    first, like = moves.alike()
    knots, speeds, enough = _followed(moves.take(first), stride)
    knots, speeds, enough = knots[like], speeds[like], enough[like]
    written = Written.of(moves, knots, speeds)
    played, grid = written.played()
    positions = {
        axis: played * moves.direction[:, axis, np.newaxis]
        for axis in sampler.axes
        if axis < len(LINEAR)
    }
    plans = sampler.plans
    # The filter ends one period late, behind the tail.
    arrival = written.grid.counts - moves.count + 1
    residual, worst = left_by_lines(plans, sampler.moves, positions, grid, arrival)
    off = _deviation(moves, played, grid)
    start = np.stack([sampler.start(axis) for axis in range(len(LINEAR))], axis=1)
    return Batch(
        moves=sampler.moves,
        plans=plans,
        grid=written.grid,
        whole={a: written.whole[:, :, a] for a in positions},
        exact={a: start[:, [a]] + written.way * moves.direction[:, [a]] for a in positions},
        written={a: start[:, [a]] + written.moved[:, :, a] for a in positions},
        times=np.diff(written.grid.knots, axis=1, prepend=0),
        number_format=sampler.number_format,
        fine=np.zeros((len(moves.count), len(AXES)), dtype=np.bool_),
        velocity={a: written.speed * moves.direction[:, [a]] for a in positions},
        residual=residual,
        conventional_residual=conventional,
        worst_in_band=worst,
        profiles=sampler.profiles,
        unplayable=~(moves.possible & enough & _within(moves, knots, written.speed[:, :-1]))
        | (off > TOLERANCE)
        | ~written.punctual(),
        path_speed=written.speed,
        played=(grid, positions),
    )


def _knots(moves: StraightMoves, stride: int, *, calm: bool) -> tuple[Counts, NDArray[np.bool_]]:
    """Knots of all moves, and whether the planner looks far enough ahead for each.

    With `calm` blocks are longer where a slow start is delicate.
    """
    interval, machine = moves.sampler.interval, moves.sampler.plans.machine
    ahead = int(LOOK_AHEAD * machine.controller_options.optimization_depth)
    knots = np.zeros((len(moves.count), 1), dtype=np.int64)
    enough = np.zeros(len(knots), dtype=np.bool_)
    worst = np.full(len(knots), np.inf)
    strides = np.arange(stride, max(stride, int(LONGEST / interval)) + 1)
    # The first will do for most moves; for those left all others are looked at at once.
    for periods in (strides[:1], strides[1:]):
        left = np.flatnonzero(~enough | (worst > 0.0))
        some = moves.take(np.tile(left, len(periods)))
        if not len(some.count):
            break
        brake = some.most / USED
        each = np.repeat(periods, len(left))
        part, far = aligned_knots(some.count, each, ahead, some.way, some.speed, brake, interval)
        bad = np.zeros(len(each))
        if calm:
            # Longer blocks make a slow start less delicate: calm with all that the control may be
            # set to, or with what it has to be, or as calm as may be.
            at = some.at(some.speed, part)
            shift, least = (early_shift(part, at, a, interval) for a in (some.full, brake))
            bad = np.where(shift < SHIFT, 0.0, np.where(least < SHIFT, 1.0, 2.0 + least))
        width = max(knots.shape[1], part.shape[1])
        knots = np.pad(knots, ((0, 0), (width - knots.shape[1], 0)))
        part = np.pad(part, ((0, 0), (width - part.shape[1], 0)))
        for rows in np.arange(len(each)).reshape(len(periods), -1):
            better = (far[rows] & (bad[rows] < worst[left])) | ~enough[left]
            taken, chosen = left[better], rows[better]
            knots[taken], enough[taken], worst[taken] = part[chosen], far[chosen], bad[chosen]
    return knots, enough


def _followed(moves: StraightMoves, stride: int) -> tuple[Counts, Array, NDArray[np.bool_]]:
    """Knots, speeds at them [mm/s], and whether the planner looks far enough ahead for each move.

    Longer blocks for the sake of a slow start are given up where they lead away from the profile.
    """
    knots, enough = _knots(moves, stride, calm=True)
    speeds, near = _speeds(moves, knots)
    rows = np.flatnonzero(~near)
    if len(rows):
        part, far = _knots(moves.take(rows), stride, calm=False)
        other, better = _speeds(moves.take(rows), part)
        better &= far
        taken = rows[better]
        width = max(knots.shape[1], part.shape[1])
        front = ((0, 0), (width - knots.shape[1], 0))
        knots, speeds = np.pad(knots, front), np.pad(speeds, front)
        knots[taken], speeds[taken] = 0, 0.0
        knots[taken, width - part.shape[1] :] = part[better]
        speeds[taken, width - part.shape[1] :] = other[better]
        enough[taken] = True
    return knots, speeds, enough


def _speeds(moves: StraightMoves, knots: Counts) -> tuple[Array, NDArray[np.bool_]]:
    """Speeds at the knots that stay near the profile, shape (b, k) [mm/s]; and which of them do.

    Where limits are near, no speeds leave just what the profile does: then they follow it, and what
    they leave is said as it is.
    """
    out = np.zeros(knots.shape)
    left = np.arange(len(knots))
    exact = moves.at(moves.way, knots)
    for emphasis, stiffness in EMPHASES:
        speeds = _fitted(moves.take(left), knots[left], emphasis, stiffness)
        out[left] = speeds
        h = np.diff(knots[left], axis=1) * moves.sampler.interval
        way = np.cumsum(0.5 * h * (speeds[:, 1:] + speeds[:, :-1]), axis=1)
        off = np.abs(way - exact[left, 1:]).max(axis=1, initial=0.0)
        keeps = _within(moves.take(left), knots[left], speeds)
        left = left[(off > NEAR * TOLERANCE) | ~keeps]
        if not len(left):
            break
    near = np.ones(len(knots), dtype=np.bool_)
    near[left] = False
    return out, near


def _within(moves: StraightMoves, knots: Counts, speeds: Array) -> NDArray[np.bool_]:
    """Whether speeds at knots keep the limits, up to what rounding adds."""
    h = np.diff(knots, axis=1) * moves.sampler.interval
    runs = h > 0.0
    rise = np.abs(np.diff(speeds, axis=1)) / np.where(runs, h, 1.0)
    most = (moves.most / USED)[:, np.newaxis] * (1.0 + 1e-6)
    rounding = 2.0 * moves.step[:, np.newaxis] / np.where(runs, h, 1.0) ** 2
    fast = (speeds > moves.velocity[:, np.newaxis] * (1.0 + 1e-6)).any(axis=1)
    out: NDArray[np.bool_] = ~((rise > most + rounding) & runs).any(axis=1) & ~fast
    return out


def _fitted(moves: StraightMoves, knots: Counts, emphasis: float, stiffness: float) -> Array:
    """Speeds at the knots, shape (b, k) [mm/s]; `emphasis` is that of the responses."""
    sampler, interval = moves.sampler, moves.sampler.interval
    speed = moves.at(moves.speed, knots)
    total = moves.count.astype(np.float64)
    share = total * interval / moves.length
    poles, participation = sampler.modes.poles, sampler.modes.participation[:, : len(LINEAR)]
    chosen = np.sort(np.argsort(-np.abs(participation).max(axis=1), kind="stable")[:MOST_MODES])
    band = sampler.plans.machine.design.band
    around = np.array([1.0, 1.0 - band, 1.0 + band]) if band else np.ones(1)
    poles = (poles[chosen] * around[:, np.newaxis]).ravel()
    chosen = np.tile(chosen, len(around))
    response = profiles_response(moves.profiles, poles) / poles.imag
    late = total * interval - moves.profiles.total
    response *= np.exp(poles * late[:, np.newaxis])
    felt = np.abs(moves.direction @ participation[chosen].T) > 0.0
    block = moves.count / np.count_nonzero(knots, axis=1)
    felt &= poles.imag * block[:, np.newaxis] * interval < SEEN * np.pi
    weight = emphasis * np.repeat(WEIGHTS[: len(around)], len(chosen) // len(around))
    wanted = Wanted(
        knots=knots,
        speeds=unfiltered(np.diff(moves.way, axis=1) * (share / interval)[:, np.newaxis]),
        rise=np.diff(speed, axis=1) * share[:, np.newaxis],
        length=1.0 - (TAIL + 2.0 * moves.outer * moves.step) / moves.length,
        end_speed=CREEP * share,
        acceleration=moves.most * interval * share,
        least=CREEP * share,
        most=(1.0 - SLACK) * moves.velocity * share,
        kind=block_kinds(speed),
        poles=poles,
        response=response,
        weight=felt * weight,
        stiffness=stiffness,
        interval=interval,
    )
    return fit_speeds(wanted) / share[:, np.newaxis]


def _deviation(moves: StraightMoves, played: Array, grid: Grid) -> Array:
    """How far each stream is played from its profile at most, shape (b,) [mm]."""
    # The filter begins a period early.
    moments = np.clip(grid.knots - 1, 0, moves.count[:, np.newaxis])
    off: Array = np.abs(played - moves.at(moves.way, moments)).max(axis=1, initial=0.0)
    return off
