r"""Streams as LinuxCNC plays them as planned: blocks that end on its servo periods.

LinuxCNC 2.9 in ramp mode changes the speed of a block linearly, exactly, from one period to the
next, if blocks end a hair before a period and are straight on; what the drives get is that behind
the filter of `motion.spline_filter`. Measured and read in its source, this gives plain G1 blocks
that are played as planned to micrometres (`docs/linuxcnc.md`). This module owns

- the knots: whole periods, the first and the last block of three periods at least (`TP_MIN_SEGMENT`
  holds one that begins or ends at rest to 0.98 of its speed otherwise), as long as the planner's
  look-ahead needs them on a slow machine;
- the speeds at the knots (`motion.speed_fit`): behind the filter they follow the profile, and leave
  in the modes what the profile leaves;
- the written positions, and the speeds that follow from exactly these;
- what is played of them, which is what a report speaks of.

Rule 1: a stream runs from one step behind its start, where the tiny G0 in front of it ends, to one
step before its end, which the block's own G0 reaches. In front of that it creeps for a moment
(`TAIL`), so that the speed at the last period is known and low.
Rule 2: what the model does not show to be played within `TOLERANCE` of the profile is not written.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import Grid, Profiles, profiles_response, sample_profiles
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.sampling import Counts
from gcodejerk.motion.speed_fit import EVEN, FASTER, SLOWER, Wanted, fit_speeds
from gcodejerk.motion.spline_filter import filtered, unfiltered
from gcodejerk.planning.batch import Batch, Sampler
from gcodejerk.planning.lines import left_by_lines

LONGEST = 0.0095
"""Of a block: from 10 ms on the planner no longer blends it as the others. [s]"""
END_PERIODS = 3
"""Of the first and the last block, at least. [intervals]"""
LOOK_AHEAD = 0.9
"""Share of the planner's look-ahead (ARC_BLEND_OPTIMIZATION_DEPTH) that is relied on."""
HAIR = 2e-10
"""By how much blocks end before a period. [s]"""
TAIL, CREEP = 2e-5, 0.01
"""Way at the end that is crept, and its speed, which is the least of all speeds. [mm], [mm/s]"""
HEADROOM, USED = 1.05, 0.99
"""MAX_ACCELERATION over what profiles use at least, and the share of it that speeds may use."""
FEEDBACK = 0.2
"""Share of the way by which rounding is behind that each block makes good."""
DIP = 0.005
"""A speed that falls and rises by less than this share of the peak goes on rising or falling."""
SEEN = 0.8
"""Modes up to this share of half the rate of knots are fitted; no speeds have higher ones."""
MOST_MODES = 24
"""Oscillators whose responses are fitted: of a spectrum the strongest."""
TOLERANCE = 0.01
"""How far a stream may be played from its profile. [mm]"""
LINEAR = "XYZ"
"""Axes that are played so: the planner blends no others."""


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
    moves = _Moves.of(sampler, stride)
    knots = aligned_knots(moves.count, moves.stride)
    speeds = _fitted(moves, knots)
    written = _Written.of(moves, knots, speeds)
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
        conventional_residual=sampler.conventional_residual(),
        worst_in_band=worst,
        profiles=sampler.profiles,
        unplayable=~moves.possible | (off > TOLERANCE),
        path_speed=written.speed,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Moves:
    """Columns of b moves along straight lines.

    Attributes
    ----------
    sampler : Sampler
        What they are.
    profiles : Profiles
        Unit profile of each.
    possible : ndarray of bool, shape (b,)
        Nothing stands against playing it. What is impossible is computed as if it were not.
    count, stride : ndarray of int, shape (b,)
        T_SUM, and periods of a block. [intervals]
    length : ndarray, shape (b,)
        [mm]
    direction : ndarray, shape (b, 3)
        [-]
    velocity, acceleration : ndarray, shape (b,)
        What a stream may use along the path. [mm/s], [mm/s^2]
    """

    sampler: Sampler
    profiles: Profiles
    possible: NDArray[np.bool_]
    count: Counts
    stride: Counts
    length: Array
    direction: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def of(cls, sampler: Sampler, stride: int) -> _Moves:
        """Look at what the machine and the control allow."""
        plans = sampler.plans
        way = plans.displacement[sampler.moves][:, : len(LINEAR)]
        length = np.sqrt((way**2).sum(axis=1))
        count = plans.counts[sampler.moves]
        # One profile for each move, along X, Y and Z alone, and room for two blocks.
        possible = np.bincount(sampler.row_of, minlength=len(count)) == 1
        possible &= (plans.displacement[sampler.moves][:, len(LINEAR) :] == 0.0).all(axis=1)
        possible &= count >= 2 * END_PERIODS
        length = np.where(possible, length, 1.0)
        count = np.maximum(count, 2 * END_PERIODS)
        direction = way / length[:, np.newaxis]
        first = np.searchsorted(sampler.row_of, np.arange(len(count)))
        profiles = plans.profiles.take(sampler.rows[first])
        options = plans.machine.controller_options
        most, limit, velocity = (np.full(len(LINEAR), np.inf) for _ in range(3))
        for axis in plans.machine.axes:
            if axis.name in LINEAR:
                k = LINEAR.index(axis.name)
                limit[k], velocity[k] = axis.limit.acceleration, axis.limit.velocity
                most[k] = options.max_acceleration.get(axis.name, HEADROOM * limit[k])
        peak = profiles.peak_acceleration * length
        possible &= HEADROOM * peak <= _along(most, direction) * (1.0 + 1e-6)
        strides, enough = _strides(
            profiles, count, length, _along(limit, direction), stride, sampler.interval,
            int(LOOK_AHEAD * options.optimization_depth),
        )  # fmt: skip
        return cls(
            sampler=sampler,
            profiles=profiles,
            possible=possible & enough,
            count=count,
            stride=strides,
            length=length,
            direction=direction,
            velocity=_along(velocity, direction),
            acceleration=USED * _along(np.minimum(most, HEADROOM * limit), direction),
        )


def _along(limits: Array, direction: Array) -> Array:
    """Limits of the axes, shape (3,), along each path, shape (b,)."""
    with np.errstate(divide="ignore"):
        out: Array = np.where(direction != 0.0, limits / np.abs(direction), np.inf).min(axis=1)
    return np.where(np.isfinite(out), out, 1.0)


def aligned_knots(count: Counts, stride: Counts) -> Counts:
    """Ends of the blocks of moves, whole periods, aligned at the last.

    Parameters
    ----------
    count, stride : ndarray of int, shape (b,)
        Duration of each move, and of its blocks. [intervals]

    Returns
    -------
    ndarray of int, shape (b, k)
        [intervals]

    Examples
    --------
    The first and the last block have three periods at least, one in the middle what is left over:

    >>> aligned_knots(np.array([11, 12, 40]), np.array([2, 2, 10]))
    array([[ 0,  3,  5,  8, 11],
           [ 0,  3,  5,  9, 12],
           [ 0, 10, 20, 30, 40]])
    """
    end = np.maximum(stride, END_PERIODS)
    inner = np.maximum((count - 2 * end) // stride, 0)
    # A block of one period would be slowed down: where there is no inner one, the last is longer.
    rest = count - (2 * end + inner * stride)
    short = np.minimum(rest, 0)
    rest = np.maximum(rest, 0)
    blocks = inner + 2
    width = int(blocks.max(initial=1))
    number = np.arange(width) - (width - blocks[:, np.newaxis])
    last = blocks[:, np.newaxis] - 1
    middle = np.where(inner > 0, blocks // 2, blocks - 1)[:, np.newaxis]
    h = np.where(number >= 0, stride[:, np.newaxis], 0)
    h = np.where((number == 0) | (number == last), end[:, np.newaxis], h)
    h += np.where(number == middle, rest[:, np.newaxis], 0)
    # Less than two whole end blocks: halves.
    h += np.where(number == 0, -((-short[:, np.newaxis]) // 2), 0)
    h += np.where(number == last, -((1 - short[:, np.newaxis]) // 2), 0)
    knots: Counts = np.concatenate([np.zeros_like(count)[:, np.newaxis], np.cumsum(h, 1)], axis=1)
    return knots


def _strides(
    profiles: Profiles,
    count: Counts,
    length: Array,
    acceleration: Array,
    least: int,
    interval: float,
    ahead: int,
) -> tuple[Counts, NDArray[np.bool_]]:
    """Periods of a block of each move, and whether they are enough.

    The planner enters no block faster than it could stop within the blocks that it looks at.
    """
    out = np.full(len(count), least, dtype=np.int64)
    left = np.arange(len(count))
    for stride in range(least, max(least, int(LONGEST / interval)) + 1):
        knots = aligned_knots(count[left], np.full(len(left), stride))
        unit, speed = sample_profiles(profiles.take(left), knots, interval)
        beyond = np.minimum(np.arange(knots.shape[1]) + ahead, knots.shape[1] - 1)
        way = (unit[:, beyond] - unit) * length[left, np.newaxis]
        needed = 0.5 * (speed * length[left, np.newaxis]) ** 2
        out[left] = stride
        short = (needed > acceleration[left, np.newaxis] * way + CREEP**2).any(axis=1)
        left = left[short]
        if not len(left):
            break
    enough = np.ones(len(count), dtype=np.bool_)
    enough[left] = False
    return out, enough


def _fitted(moves: _Moves, knots: Counts) -> Array:
    """Speeds at the knots, shape (b, k) [mm/s]."""
    sampler, interval = moves.sampler, moves.sampler.interval
    every = Grid.every(moves.count, 1, interval)
    unit, _ = sample_profiles(moves.profiles, every.knots, interval)
    _, speed = sample_profiles(moves.profiles, knots, interval)
    total = moves.count.astype(np.float64)
    share = total * interval / moves.length
    poles, participation = sampler.modes.poles, sampler.modes.participation[:, : len(LINEAR)]
    chosen = np.sort(np.argsort(-np.abs(participation).max(axis=1), kind="stable")[:MOST_MODES])
    poles = poles[chosen]
    response = profiles_response(moves.profiles, poles) / poles.imag
    late = total * interval - moves.profiles.total
    response *= np.exp(poles * late[:, np.newaxis])
    felt = np.abs(moves.direction @ participation[chosen].T) > 0.0
    felt &= poles.imag * moves.stride[:, np.newaxis] * interval < SEEN * np.pi
    step = sampler.number_format.step[:, 0]
    wanted = Wanted(
        knots=knots,
        speeds=unfiltered(np.diff(unit, axis=1) * total[:, np.newaxis]),
        length=1.0 - (TAIL + 2.0 * step) / moves.length,
        end_speed=CREEP * share,
        acceleration=moves.acceleration * interval * share,
        least=CREEP * share,
        most=moves.velocity * share,
        kind=block_kinds(speed),
        poles=poles,
        response=response,
        felt=felt,
        interval=interval,
    )
    return fit_speeds(wanted) / share[:, np.newaxis]


def block_kinds(speed: Array) -> NDArray[np.int64]:
    """Which blocks get faster, and which slower, for a control that ends at the lower of two F.

    At a knot between two blocks the speed is the smaller of their F, each of which is the larger of
    the speeds at its ends: a knot that is slower than both its neighbours would be passed too fast,
    unless one of the blocks beside it is even.

    Parameters
    ----------
    speed : ndarray, shape (b, k)
        Of the profile at the knots, 0 at the first and the last.

    Returns
    -------
    ndarray of int, shape (b, k - 1)
        FASTER, SLOWER or EVEN.

    Examples
    --------
    >>> block_kinds(np.array([[0.0, 5.0, 9.0, 6.0, 7.0, 3.0, 0.0]]))
    array([[ 1,  1, -1,  0, -1, -1]])
    """
    rows, columns = speed.shape
    ripple = DIP * speed.max(axis=1, initial=0.0)
    rising = np.ones(rows, dtype=np.bool_)
    extreme, at = np.array(speed[:, 0]), np.zeros(rows, dtype=np.int64)
    turns = np.zeros(speed.shape, dtype=np.int64)
    for k in range(1, columns):
        v = speed[:, k]
        ahead = np.where(rising, v > extreme, v < extreme)
        back = np.where(rising, extreme - v, v - extreme)
        turned = np.flatnonzero(~ahead & (back > ripple))
        turns[turned, at[turned]] = 1
        rising[turned] = ~rising[turned]
        moved = ahead.copy()
        moved[turned] = True
        extreme, at = np.where(moved, v, extreme), np.where(moved, k, at)
    passed = np.cumsum(turns, axis=1)
    kinds = np.where(passed[:, :-1] % 2 == 0, FASTER, SLOWER)
    # Every second turn is a minimum.
    row, knot = np.nonzero((turns == 1) & (passed % 2 == 0))
    before = np.abs(speed[row, knot] - speed[row, knot - 1])
    behind = np.abs(speed[row, np.minimum(knot + 1, columns - 1)] - speed[row, knot])
    kinds[row, np.where(before < behind, knot - 1, knot)] = EVEN
    return kinds


@dataclass(frozen=True, slots=True, eq=False)
class _Written:
    """Positions in whole steps, and the speeds that follow from exactly these.

    Attributes
    ----------
    moves : _Moves
        b moves.
    grid : Grid
        The knots and the end of the tail, k columns.
    whole : ndarray of int, shape (b, k, 3)
        Positions of the axes, counted from the origin. [steps]
    moved : ndarray, shape (b, k, 3)
        The same from the start. [mm]
    way : ndarray, shape (b, k)
        Along the path from the beginning of the stream. [mm]
    speed : ndarray, shape (b, k)
        Along the path; that of the last column is the tail's. [mm/s]
    """

    moves: _Moves
    grid: Grid
    whole: NDArray[np.int64]
    moved: Array
    way: Array
    speed: Array

    @classmethod
    def of(cls, moves: _Moves, knots: Counts, speeds: Array) -> _Written:
        """Round, from knot to knot.

        With v_k = 2 L_k/h - v_(k-1) an error would come back with the other sign in every block: so
        each position is where the speed that was reached, and the one that is wanted, lead to.
        """
        sampler, interval = moves.sampler, moves.sampler.interval
        step = sampler.number_format.step[:, 0]
        axes = range(len(LINEAR))
        start = np.stack([sampler.start(axis) for axis in axes], axis=1)
        origin = np.stack([sampler.number_format.origin[:, axis] for axis in axes], axis=1)
        moving = moves.direction != 0.0
        from_origin = start - np.where(moving, origin, 0.0)
        size = step[:, np.newaxis]
        rows = np.arange(len(step))
        leading = np.abs(moves.direction).argmax(axis=1)
        sign = np.sign(moves.direction[rows, leading]).astype(np.int64)

        def whole_of(way: Array) -> NDArray[np.int64]:
            exact = from_origin + moves.direction * way[:, np.newaxis]
            return np.rint(exact / size).astype(np.int64)

        count = knots.shape[1]
        whole = np.zeros((len(step), count + 1, len(LINEAR)), dtype=np.int64)
        at_rest = np.where(moving, from_origin, 0.0)
        here = whole_of(np.zeros(len(step)))
        here[rows, leading] += sign
        position = np.array(at_rest)
        position[rows, leading] = here[rows, leading] * step
        whole[:, 0] = here
        way, speed = np.zeros((len(step), count + 1)), np.zeros((len(step), count + 1))
        ideal, begin = np.zeros(len(step)), step
        for k in range(1, count):
            h = (knots[:, k] - knots[:, k - 1]) * interval
            runs = h > 0.0
            h = np.where(runs, h - np.where(knots[:, k - 1] == 0, HAIR, 0.0), 1.0)
            behind = ideal - way[:, k - 1]
            ideal = np.where(runs, ideal + 0.5 * h * (speeds[:, k - 1] + speeds[:, k]), ideal)
            to = way[:, k - 1] + 0.5 * h * (speed[:, k - 1] + speeds[:, k]) + FEEDBACK * behind
            here = np.where(runs[:, np.newaxis], whole_of(begin + to), whole[:, k - 1])
            there = np.where(moving, here * size, 0.0)
            length = np.sqrt(((there - position) ** 2).sum(axis=1))
            way[:, k] = way[:, k - 1] + np.where(runs, length, 0.0)
            speed[:, k] = np.where(runs, 2.0 * length / h - speed[:, k - 1], 0.0)
            whole[:, k] = here
            position = np.where(runs[:, np.newaxis], there, position)
        end = whole_of(moves.length)
        end[rows, leading] -= sign
        there = np.where(moving, end * size, 0.0)
        whole[:, count] = end
        way[:, count] = way[:, count - 1] + np.sqrt(((there - position) ** 2).sum(axis=1))
        speed[:, count] = speed[:, count - 1]
        tail = max(2, round(TAIL / CREEP / interval))
        grid = Grid(
            moves.count + tail, np.concatenate([knots, knots[:, -1:] + tail], axis=1), interval
        )
        moved = np.where(moving[:, np.newaxis], whole * step[:, np.newaxis, np.newaxis], 0.0)
        moved -= at_rest[:, np.newaxis]
        return cls(moves, grid, whole, moved, way, speed)

    def played(self) -> tuple[Array, Grid]:
        """Way along the path behind the filter, from one period early to one late [mm]."""
        knots, interval = self.grid.knots, self.grid.interval
        h = np.diff(knots, axis=1)
        total = self.grid.counts
        width = int(total.max(initial=1))
        block = np.repeat(np.arange(h.size), h.ravel())
        begin = np.cumsum(h.ravel()) - h.ravel()
        tau = (np.arange(len(block)) - begin[block] + 1.0) * interval
        before, behind = self.speed[:, :-1].copy(), self.speed[:, 1:].copy()
        # The tail takes its whole periods at one speed.
        before[:, -1] = behind[:, -1] = np.diff(self.way[:, -2:], axis=1)[:, 0] / (
            h[:, -1] * interval
        )
        rise = 0.5 * (behind - before) / (np.maximum(h, 1) * interval)
        x = self.way[:, :-1].ravel()[block]
        x = x + (before.ravel()[block] + rise.ravel()[block] * tau) * tau
        every = np.zeros((len(total), width + 4))
        inside = np.arange(width) >= (width - total)[:, np.newaxis]
        every[:, 2:-2][inside] = x
        every[:, -2:] = self.way[:, -1:]
        return filtered(every)[:, :-1], Grid.every(total + 2, 1, interval)


def _deviation(moves: _Moves, played: Array, grid: Grid) -> Array:
    """How far each stream is played from its profile at most, shape (b,) [mm]."""
    moments = np.maximum(grid.knots - 1, 0)
    unit, _ = sample_profiles(moves.profiles, moments, grid.interval)
    off: Array = np.abs(played - unit * moves.length[:, np.newaxis]).max(axis=1, initial=0.0)
    return off
