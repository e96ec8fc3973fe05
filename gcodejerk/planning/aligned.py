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

from dataclasses import dataclass, fields, replace

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

LONGEST = 0.0085
"""Of a block, and a period more: from 10 ms on the planner no longer blends it. [s]"""
END_PERIODS = 3
"""Of the first and the last block, at least. [intervals]"""
LOOK_AHEAD = 0.9
"""Share of the planner's look-ahead (ARC_BLEND_OPTIMIZATION_DEPTH) that is relied on."""
HAIR = 4e-12
"""By how much blocks end before a period: more than what LinuxCNC takes for nothing (1e-12). [s]"""
TAIL, CREEP = 2e-5, 0.01
"""Way at the end that is crept, and its speed, which is the least of all speeds. [mm], [mm/s]"""
HEADROOM, USED = 1.05, 0.99
"""MAX_ACCELERATION over what profiles use at least, and the share of it that speeds may use."""
SLACK = 2e-5
"""Share of the velocity limit that is left to rounding."""
FULLEST = 1.5
"""The same at most, where the machine file does not say it."""
FEEDBACK = 0.2
"""Share of the way by which rounding is behind that each block makes good."""
DIP = 0.005
"""A speed that falls and rises by less than this share of the peak goes on rising or falling."""
SEEN = 0.8
"""Modes up to this share of half the rate of knots are fitted; no speeds have higher ones."""
WEIGHTS = np.array([1e6, 1e6, 1e6])
"""Of the responses at the modes, and at the ends of the band, against 1 of an interval's speed."""
EMPHASES = (1.0, 0.03, 1e-3, 1e-5, 1e-8)
"""By which these are multiplied, one after the other, until a stream is near its profile."""
LAST = 3
"""Blocks at the end of which no early end matters."""
KICK = 0.1
"""What the end of a block in front of its period may do to the speed, about. [mm/s]"""
NEAR = 0.8
"""Share of `TOLERANCE`."""
MOST_MODES = 24
"""Oscillators whose responses are fitted: of a spectrum the strongest."""
ROUNDS = 6
"""Of an iteration whose steps shrink by the rounding of a position."""
EARLIEST, SLOW = 2e-6, 1.0
"""A block that is faster than this may end so much before its period: until then the control runs
the next one at full acceleration, which changes its speed by some 0.01 mm/s. [s], [mm/s]"""
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
    moves = _Moves.of(sampler)
    knots, enough = _knots(moves, stride)
    speeds = _followed(moves, knots)
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
        unplayable=~(moves.possible & enough & _within(moves, knots, written.speed[:, :-1]))
        | (off > TOLERANCE)
        | (written.early > EARLIEST),
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
    count : ndarray of int, shape (b,)
        T_SUM. [intervals]
    length : ndarray, shape (b,)
        [mm]
    direction : ndarray, shape (b, 3)
        [-]
    velocity, acceleration : ndarray, shape (b,)
        What profiles may use along the path. [mm/s], [mm/s^2]
    most, full : ndarray, shape (b,)
        What speeds between knots may use, and what the control may be set to. [mm/s^2]
    step : ndarray, shape (b,)
        Of the numbers that are written. [mm]
    """

    sampler: Sampler
    profiles: Profiles
    possible: NDArray[np.bool_]
    count: Counts
    length: Array
    direction: Array
    velocity: Array
    acceleration: Array
    most: Array
    full: Array
    step: Array

    @classmethod
    def of(cls, sampler: Sampler) -> _Moves:
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
        most, full, limit, velocity = (np.full(len(LINEAR), np.inf) for _ in range(4))
        for axis in plans.machine.axes:
            if axis.name in LINEAR:
                k = LINEAR.index(axis.name)
                limit[k], velocity[k] = axis.limit.acceleration, axis.limit.velocity
                most[k] = options.max_acceleration.get(axis.name, HEADROOM * limit[k])
                full[k] = options.max_acceleration.get(axis.name, FULLEST * limit[k])
        peak = profiles.peak_acceleration * length
        possible &= HEADROOM * peak <= _along(most, direction) * (1.0 + 1e-6)
        return cls(
            sampler=sampler,
            profiles=profiles,
            possible=possible,
            count=count,
            length=length,
            direction=direction,
            velocity=_along(velocity, direction),
            acceleration=_along(limit, direction),
            most=USED * _along(np.minimum(most, HEADROOM * limit), direction),
            full=_along(full, direction),
            step=sampler.number_format.step[:, 0],
        )

    def take(self, rows: NDArray[np.int64]) -> _Moves:
        """Some of them."""
        columns = (f.name for f in fields(self) if f.name not in ("sampler", "profiles"))
        return replace(
            self,
            profiles=self.profiles.take(rows),
            **{name: getattr(self, name)[rows] for name in columns},
        )


def _along(limits: Array, direction: Array) -> Array:
    """Limits of the axes, shape (3,), along each path, shape (b,)."""
    with np.errstate(divide="ignore"):
        out: Array = np.where(direction != 0.0, limits / np.abs(direction), np.inf).min(axis=1)
    return np.where(np.isfinite(out), out, 1.0)


def aligned_knots(
    count: Counts, stride: int, ahead: int, way: Array, speed: Array, brake: Array, interval: float
) -> tuple[Counts, NDArray[np.bool_]]:
    """Ends of the blocks of moves, whole periods, aligned at the last.

    A block has `stride` periods where the planner looks far enough ahead: it enters no block faster
    than it could stop within the blocks that it looks at. Where that needs longer blocks they are
    longer, from the end backwards.

    Parameters
    ----------
    count : ndarray of int, shape (b,)
        Duration of each move. [intervals]
    stride : int
        Periods of a block, at least 2.
    ahead : int
        Blocks that the planner looks ahead.
    way, speed : ndarray, shape (b, longest + 1)
        Of each move at every period, aligned at the end. [mm], [mm/s]
    brake : ndarray, shape (b,)
        Acceleration with which it can stop. [mm/s^2]
    interval : float
        [s]

    Returns
    -------
    knots : ndarray of int, shape (b, k)
        [intervals]
    enough : ndarray of bool, shape (b,)
        The planner looks far enough ahead everywhere.

    Examples
    --------
    The first and the last block have three periods at least, one in the middle what is left over:

    >>> slow = np.zeros((2, 13))
    >>> aligned_knots(np.array([11, 12]), 2, 45, slow, slow, np.ones(2), 0.001)[0]
    array([[ 0,  0,  3,  6,  8, 11],
           [ 0,  3,  5,  7,  9, 12]])
    """
    rows = np.arange(len(count))
    longest = max(stride, int(LONGEST / interval))
    end = max(END_PERIODS, stride)
    last = way.shape[1] - 1
    over = np.maximum(count - 2 * end, 0) % stride
    enough = np.ones(len(count), dtype=np.bool_)
    left = np.where(count < end + END_PERIODS, count // 2, end)
    columns = [np.zeros_like(count), left]
    needed = 0.5 * speed**2 / brake[:, np.newaxis]
    while (left < count).any():
        to = way[rows, last - columns[max(len(columns) - ahead, 0)]]
        size = np.full(len(count), longest)
        short = np.ones(len(count), dtype=np.bool_)
        for periods in range(stride, longest + 1):
            at = last - np.minimum(left + periods, count)
            reached = needed[rows, at] <= (to - way[rows, at]) * (1.0 + 1e-6) + CREEP * interval
            size[short & reached] = periods
            short &= ~reached
            if not short.any():
                break
        enough &= ~short | (left >= count)
        # What the division leaves over: a longer block in the middle, or one of its own.
        middle = (over > 0) & (left + size >= count / 2)
        size = np.where(middle, np.where(over > 1, over, size + 1), size)
        over = np.where(middle, 0, over)
        rest = count - left
        # The first block has three periods at least, too.
        size = np.where(rest < size + END_PERIODS, rest, size)
        size = np.where(size > longest + 1, rest - END_PERIODS, size)
        left = left + size
        columns.append(left)
    knots: Counts = count[:, np.newaxis] - np.stack(columns[::-1], axis=1)
    return knots, enough


def _knots(moves: _Moves, stride: int) -> tuple[Counts, NDArray[np.bool_]]:
    """Knots of all moves, and whether the planner looks far enough ahead for each."""
    interval, machine = moves.sampler.interval, moves.sampler.plans.machine
    every = Grid.every(moves.count, 1, interval)
    unit, speed = sample_profiles(moves.profiles, every.knots, interval)
    way, speed = (each * moves.length[:, np.newaxis] for each in (unit, speed))
    brake, full = moves.most / USED, moves.full
    ahead = int(LOOK_AHEAD * machine.controller_options.optimization_depth)
    rows = np.arange(len(moves.count))
    knots = np.zeros((len(rows), 1), dtype=np.int64)
    enough = np.zeros(len(rows), dtype=np.bool_)
    steady = np.zeros(len(rows), dtype=np.bool_)
    for periods in range(stride, max(stride, int(LONGEST / interval)) + 1):
        left = np.flatnonzero(~(enough & steady))
        if not len(left):
            break
        part, far = aligned_knots(
            moves.count[left], periods, ahead, way[left], speed[left], brake[left], interval
        )
        at = np.take_along_axis(
            speed[left], speed.shape[1] - 1 - moves.count[left, np.newaxis] + part, axis=1
        )
        kick = full[left] * early_ends(part, at, full[left], interval)
        calm = kick < KICK
        # Longer blocks make a slow start less delicate: taken until they no longer need to be.
        taken = left[(far & calm) | ~enough[left]]
        chosen = np.isin(left, taken)
        width = max(knots.shape[1], part.shape[1])
        knots = np.pad(knots, ((0, 0), (width - knots.shape[1], 0)))
        knots[taken] = 0
        knots[taken, width - part.shape[1] :] = part[chosen]
        enough[taken], steady[taken] = far[chosen], calm[chosen]
    return knots, enough


def early_ends(knots: Counts, speed: Array, acceleration: Array, interval: float) -> Array:
    """By how much blocks end before their periods at most, all but the last ones.

    The rest of a period is run in the next block at full acceleration A, before its ramp begins:
    what a block ended too early by, the next one does by 1 + h (A - a)/(v_k + v_(k+1)) as much,
    so that `HAIR` grows.

    Parameters
    ----------
    knots : ndarray of int, shape (b, k)
        [intervals]
    speed : ndarray, shape (b, k)
        [mm/s]
    acceleration : ndarray, shape (b,)
        [mm/s^2]
    interval : float
        [s]

    Returns
    -------
    ndarray, shape (b,)
        [s]
    """
    h, both = np.diff(knots, axis=1) * interval, speed[:, 1:] + speed[:, :-1]
    rise = np.diff(speed, axis=1)
    growth = 1.0 + (acceleration[:, np.newaxis] * h - rise) / np.maximum(both, CREEP)
    # No faster than F, which the speed at the end of the block is.
    bound = np.maximum(np.abs(rise), CREEP) / acceleration[:, np.newaxis]
    now = np.zeros(len(knots))
    most = np.zeros(len(knots))
    # In the last blocks hardly any speed is left that could change.
    for k in range(h.shape[1] - LAST):
        begun = h[:, k] > 0.0
        now = np.where(begun, np.minimum(now, bound[:, k]) * growth[:, k], now)
        now += np.where(begun, HAIR, 0.0)
        most = np.maximum(most, now)
    return most


def _followed(moves: _Moves, knots: Counts) -> Array:
    """Speeds at the knots that stay near the profile, shape (b, k) [mm/s].

    Where limits are near, no speeds leave just what the profile does: then they follow it, and what
    they leave is said as it is.
    """
    out = np.zeros(knots.shape)
    left = np.arange(len(knots))
    unit, _ = sample_profiles(moves.profiles, knots, moves.sampler.interval)
    exact = unit * moves.length[:, np.newaxis]
    for emphasis in EMPHASES:
        speeds = _fitted(moves.take(left), knots[left], emphasis)
        out[left] = speeds
        h = np.diff(knots[left], axis=1) * moves.sampler.interval
        way = np.cumsum(0.5 * h * (speeds[:, 1:] + speeds[:, :-1]), axis=1)
        off = np.abs(way - exact[left, 1:]).max(axis=1, initial=0.0)
        keeps = _within(moves.take(left), knots[left], speeds)
        left = left[(off > NEAR * TOLERANCE) | ~keeps]
        if not len(left):
            break
    return out


def _within(moves: _Moves, knots: Counts, speeds: Array) -> NDArray[np.bool_]:
    """Whether speeds at knots keep the limits, up to what rounding adds."""
    h = np.diff(knots, axis=1) * moves.sampler.interval
    runs = h > 0.0
    rise = np.abs(np.diff(speeds, axis=1)) / np.where(runs, h, 1.0)
    most = (moves.most / USED)[:, np.newaxis] * (1.0 + 1e-6)
    rounding = 2.0 * moves.step[:, np.newaxis] / np.where(runs, h, 1.0) ** 2
    fast = (speeds > moves.velocity[:, np.newaxis] * (1.0 + 1e-6)).any(axis=1)
    out: NDArray[np.bool_] = ~((rise > most + rounding) & runs).any(axis=1) & ~fast
    return out


def _fitted(moves: _Moves, knots: Counts, emphasis: float) -> Array:
    """Speeds at the knots, shape (b, k) [mm/s]; `emphasis` is that of the responses."""
    sampler, interval = moves.sampler, moves.sampler.interval
    every = Grid.every(moves.count, 1, interval)
    unit, _ = sample_profiles(moves.profiles, every.knots, interval)
    _, speed = sample_profiles(moves.profiles, knots, interval)
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
        speeds=unfiltered(np.diff(unit, axis=1) * total[:, np.newaxis]),
        length=1.0 - (TAIL + 2.0 * moves.step) / moves.length,
        end_speed=CREEP * share,
        acceleration=moves.most * interval * share,
        least=CREEP * share,
        most=(1.0 - SLACK) * moves.velocity * share,
        kind=block_kinds(speed),
        poles=poles,
        response=response,
        weight=felt * weight,
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
    early : ndarray, shape (b,)
        By how much a block that is not slow ends before its period, besides `HAIR`. [s]
    """

    moves: _Moves
    grid: Grid
    whole: NDArray[np.int64]
    moved: Array
    way: Array
    speed: Array
    early: Array

    @classmethod
    def of(cls, moves: _Moves, knots: Counts, speeds: Array) -> _Written:
        """Round, from knot to knot.

        With v_k = 2 L_k/h - v_(k-1) an error would come back with the other sign in every block: so
        each position is where the speed that was reached, and the one that is wanted, lead to.
        Where rounding makes a knot slower than both its neighbours, the control passes it as fast
        as the slower of these: the block behind it makes up for that.
        """
        sampler, interval, step = moves.sampler, moves.sampler.interval, moves.step
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
        lasts, length = np.zeros(len(step)), np.zeros(len(step))
        most = np.zeros(len(step))
        for k in range(1, count):
            whole_h = (knots[:, k] - knots[:, k - 1]) * interval
            runs = whole_h > 0.0
            first = knots[:, k - 1] == 0
            whole_h = np.where(runs, whole_h - np.where(first, HAIR, 0.0), 1.0)
            behind = ideal - way[:, k - 1]
            aim = speed[:, k - 1] + speeds[:, k]
            ideal = np.where(runs, ideal + 0.5 * whole_h * (speeds[:, k - 1] + speeds[:, k]), ideal)
            to = way[:, k - 1] + 0.5 * whole_h * aim + FEEDBACK * behind
            here = np.where(runs[:, np.newaxis], whole_of(begin + to), whole[:, k - 1])
            there = np.where(moving, here * size, 0.0)
            before, length = length, np.sqrt(((there - position) ** 2).sum(axis=1))
            way[:, k] = way[:, k - 1] + np.where(runs, length, 0.0)
            speed[:, k] = np.where(runs, 2.0 * length / whole_h - speed[:, k - 1], 0.0)
            dip = runs & ~first & (speed[:, k - 1] < speed[:, k - 2])
            dip &= speed[:, k] > speed[:, k - 1]
            early = np.zeros(len(step))
            if dip.any():
                at = np.flatnonzero(dip)
                ends = _passed(
                    speed[at, k - 2], before[at], length[at], lasts[at] + whole_h[at], speed[at, k]
                )
                speed[at, k - 1], speed[at, k], early[at] = ends
                early[at] = lasts[at] - early[at]
                most = np.maximum(most, np.where(speed[:, k - 1] > SLOW, early, 0.0))
            lasts = whole_h + early
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
        return cls(moves, grid, whole, moved, way, speed, most)

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


def _passed(
    before: Array, first: Array, second: Array, both: Array, after: Array
) -> tuple[Array, Array, Array]:
    """Speeds at the knot between two blocks, and behind them, where the knot would be a minimum.

    The control passes it at the smaller of the speeds around it, so that one of the blocks is even.

    Parameters
    ----------
    before : ndarray, shape (n,)
        Speed in front of both blocks. [mm/s]
    first, second : ndarray, shape (n,)
        Their lengths. [mm]
    both : ndarray, shape (n,)
        How long they last together. [s]
    after : ndarray, shape (n,)
        Speed behind them, about. [mm/s]

    Returns
    -------
    between, behind : ndarray, shape (n,)
        Speeds. [mm/s]
    lasts : ndarray, shape (n,)
        How long the first block lasts. [s]
    """
    even = first / before
    behind = 2.0 * second / (both - even) - before
    slow = np.array(after)
    for _ in range(ROUNDS):
        slow = second / (both - 2.0 * first / (before + slow))
    faster = behind >= before
    between = np.where(faster, before, slow)
    lasts = np.where(faster, even, 2.0 * first / (before + slow))
    return between, np.where(faster, behind, slow), lasts


def _deviation(moves: _Moves, played: Array, grid: Grid) -> Array:
    """How far each stream is played from its profile at most, shape (b,) [mm]."""
    moments = np.maximum(grid.knots - 1, 0)
    unit, _ = sample_profiles(moves.profiles, moments, grid.interval)
    off: Array = np.abs(played - unit * moves.length[:, np.newaxis]).max(axis=1, initial=0.0)
    return off
