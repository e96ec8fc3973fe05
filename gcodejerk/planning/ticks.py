r"""Profiles in whole ticks: the times rounded first, then solved again.

This module owns the step from a designed profile to one that a controller can be told segment by
segment: every segment lasts whole ticks of the controller, and distance, rest and continuity are
exact all the same. Rounding times alone would leave accelerations that jump; so afterwards all
accelerating values of the acceleration are scaled by one factor and all braking ones by another:
two factors for the two conditions that the velocity ends at 0 and the position at 1,

.. math:: \alpha P_0 + \beta N_0 = 0, \qquad \alpha P_1 + \beta N_1 = 1 ,

with the areas P_0, N_0 of the positive and the negative part and their moments about the end. A
motion that stands still on its way (short ones behind an input shaper) has such factors for each of
its strokes, with the stroke's share of the way for 1: or it would creep where it has to stand.
Phases of constant acceleration and of constant velocity stay that, symmetric profiles symmetric,
steps of a trapezoid steps.

Rule: what comes out is within the limits, and goes forwards. Where no rounding does, the whole
lasts a tick longer, and is rounded again.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Profiles, joined, profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex

Ticks = NDArray[np.int64]

ON_TICK = 1e-6
"""A time this little off a whole number of ticks is that number. [ticks]"""
FINE = 1e-5
"""Of ticks so short, every rounding leaves nearly the same vibration. [s]"""
WITHIN = 1e-9
"""By what share a limit may be passed: the rounding of float64."""
CHOICES = 4
"""Boundaries that are tried both rounded down and rounded up: two to the power of it."""
SMALL = 1e-9
"""What the rounding of float64 may leave of a 0, beside the greatest velocity or acceleration."""
TRIES = 40
"""Durations that are tried for a profile."""


@dataclass(frozen=True, slots=True, eq=False)
class TickTask:
    """Profiles to be told in ticks, columns of n.

    Attributes
    ----------
    profiles : Profiles
        As designed.
    limits : tuple of ndarray, shape (n,)
        Velocity, acceleration and jerk of the unit profiles. [1/s], [1/s^2], [1/s^3]
    least : ndarray of int, shape (n,)
        Shortest segment that is worth a row. [ticks]
    most : ndarray of int, shape (n,)
        Longest duration. [ticks]
    poles : ndarray of complex, shape (m,)
        What roundings are compared by. [rad/s]
    weights : ndarray, shape (n, m)
        Of each of them. [mm]
    tick : float
        [s]
    """

    profiles: Profiles
    limits: tuple[Array, Array, Array]
    least: Ticks
    most: Ticks
    poles: Complex
    weights: Array
    tick: float

    def take(self, index: NDArray[np.intp]) -> TickTask:
        """Some of the profiles."""
        V, A, J = (limit[index] for limit in self.limits)
        return TickTask(
            self.profiles.take(index), (V, A, J), self.least[index], self.most[index],
            self.poles, self.weights[index], self.tick,
        )  # fmt: skip


def in_ticks(task: TickTask) -> tuple[Profiles, NDArray[np.bool_]]:
    """The same profiles with every segment in whole ticks.

    Parameters
    ----------
    task : TickTask
        n profiles.

    Returns
    -------
    profiles : Profiles
        n profiles within the limits; as they were where there is none.
    found : ndarray of bool, shape (n,)
        Where there is one.

    Examples
    --------
    300 mm at 500 mm/s, 5000 mm/s^2 and 150,000 mm/s^3 in ticks of 1 ms: 33.3 ms become 34, 66.7
    become 66, and the jerk a little less:

    >>> jerk, none = 150_000.0 / 300.0, np.zeros(1)
    >>> d = np.array([1 / 30, 2 / 30, 1 / 30, 14 / 30, 1 / 30, 2 / 30, 1 / 30])
    >>> a = np.array([0.0, jerk / 30, jerk / 30, 0.0, 0.0, -jerk / 30, -jerk / 30])
    >>> j = np.array([jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk])
    >>> limits = tuple(np.array([x / 300.0]) for x in (500.0, 5000.0, 150_000.0))
    >>> task = TickTask(
    ...     Profiles.of(np.array([0, 7]), d, a, j), limits, np.array([1]), np.array([1000]),
    ...     np.zeros(0, complex), np.zeros((1, 0)), 0.001)
    >>> profiles, found = in_ticks(task)
    >>> (profiles.duration * 1000).round(9).astype(int).tolist()
    [34, 66, 34, 466, 34, 66, 34]
    >>> round(float(profiles.peak_jerk[0] * 300.0), 1), bool(found[0])
    (147058.8, True)
    """
    profiles = task.profiles
    count = np.diff(profiles.first)
    order: list[NDArray[np.intp]] = []
    parts: list[Profiles] = []
    found = np.zeros(len(profiles), dtype=np.bool_)
    for k in np.unique(count).tolist():
        index = np.flatnonzero(count == k)
        for few in np.array_split(index, max(1, len(index) * k // 200_000)):
            own, done = _alike(task.take(few), k)
            found[few] = done
            order.append(few)
            parts.append(own)
    if not parts:
        return profiles, found
    back = np.argsort(np.concatenate(order), kind="stable")
    return joined(parts).take(back), found


def _alike(task: TickTask, k: int) -> tuple[Profiles, NDArray[np.bool_]]:
    """Profiles of k segments each."""
    out = task.profiles
    found = np.zeros(len(out), dtype=np.bool_)
    shape = _Shape.of(out, k)
    mirrored = shape.mirrored()
    for same in (True, False):
        rows = np.flatnonzero(mirrored == same)
        free = (k - 1) // 2 if same else k - 1
        if not len(rows) or (free > CHOICES and task.tick > FINE):
            continue
        own, done = _by_moving(task.take(rows), shape.take(rows), same, free)
        found[rows[done]] = True
        out = out.replaced(rows[done], own)
    for row in np.flatnonzero(~found).tolist():
        one = _by_sampling(task.take(np.array([row])), shape.take(np.array([row])))
        if one is not None:
            found[row] = True
            out = out.replaced(np.array([row]), one)
    return out, found


@dataclass(frozen=True, slots=True, eq=False)
class _Shape:
    """Profiles of k segments each as matrices (n, k)."""

    duration: Array
    begin: Array
    """Acceleration at the segments' begins."""
    end: Array
    """And at their ends."""
    stroke: NDArray[np.int64]
    """Which stroke a segment belongs to, from one standstill to the next; rests to that before."""
    share: Array
    """Of the way, of each stroke, shape (n, most strokes of any); 0 where there are fewer."""

    @classmethod
    def of(cls, profiles: Profiles, k: int) -> _Shape:
        """Read them."""
        columns = (
            profiles.duration, profiles.acceleration, profiles.end_acceleration,
            profiles.velocity, profiles.position,
        )  # fmt: skip
        duration, begin, end, velocity, position = (column.reshape(-1, k) for column in columns)
        # What the designs' own rounding left of a zero has to have no sign.
        small = SMALL * np.maximum(np.abs(begin), np.abs(end)).max(axis=1, initial=0.0)
        begin, end = (np.where(np.abs(a) > small[:, np.newaxis], a, 0.0) for a in (begin, end))
        still = np.abs(velocity) <= SMALL * np.abs(velocity).max(axis=1, keepdims=True, initial=0.0)
        starts = still & ((begin != 0.0) | (end != 0.0))
        # A stroke has moved before the next one starts, segments of no duration or not.
        moving = np.where(starts, np.cumsum(~still, axis=1), 0)
        before = np.maximum.accumulate(np.insert(moving, 0, 0, axis=1)[:, :-1], axis=1)
        stroke = np.cumsum(moving > before, axis=1).astype(np.int64)
        moved = np.diff(position, axis=1, append=1.0)
        return cls(duration, begin, end, stroke, _shares(stroke, moved))

    def take(self, index: NDArray[np.intp]) -> _Shape:
        """Some of the profiles."""
        return _Shape(
            self.duration[index], self.begin[index], self.end[index], self.stroke[index],
            self.share[index],
        )  # fmt: skip

    def without_nothing(self) -> _Shape:
        """One profile without its segments of no duration."""
        keep = self.duration[0] > 0.0
        return _Shape(
            self.duration[:, keep], self.begin[:, keep], self.end[:, keep], self.stroke[:, keep],
            self.share,
        )  # fmt: skip

    def mirrored(self) -> NDArray[np.bool_]:
        """Which are odd about their middle."""
        time = np.abs(self.duration - self.duration[:, ::-1]).max(axis=1)
        size = np.abs(self.begin).max(axis=1, initial=0.0)
        off = np.abs(self.begin + self.end[:, ::-1]).max(axis=1)
        out: NDArray[np.bool_] = (time <= 1e-9 * self.duration.sum(axis=1)) & (off <= 1e-7 * size)
        return out

    def without_middle(self) -> _Shape:
        """Without the boundary in the middle, where the acceleration runs straight through 0."""
        half = self.duration.shape[1] // 2
        both = self.duration[:, half - 1] + self.duration[:, half]
        duration = np.delete(self.duration, half, axis=1)
        duration[:, half - 1] = both
        # There is no standstill any more where two strokes met.
        closed = self.stroke[:, half] != self.stroke[:, half - 1]
        stroke = np.where(closed[:, np.newaxis], 0, np.delete(self.stroke, half, axis=1))
        share = np.where(closed[:, np.newaxis], np.eye(1, self.share.shape[1]), self.share)
        return _Shape(
            duration, np.delete(self.begin, half, axis=1), np.delete(self.end, half - 1, axis=1),
            stroke, share,
        )  # fmt: skip

    def solved(self, ticks: Ticks, tick: float) -> tuple[Profiles, NDArray[np.bool_]]:
        """Scaled for these durations; and whether it goes forwards all the way."""
        d: Array = np.asarray(ticks * tick, dtype=np.float64)
        a, b = self.begin, self.end
        good = np.ones(len(d), dtype=np.bool_)
        for s in range(self.share.shape[1]):
            own = self.stroke == s
            up, down = _factors(np.where(own, d, 0.0), self.begin, self.end, self.share[:, s])
            fit = np.isfinite(up) & np.isfinite(down) & (up > 0.0) & (down > 0.0)
            good &= fit | ~own.any(axis=1)
            up, down = (np.where(fit, x, 1.0)[:, np.newaxis] for x in (up, down))
            a, b = (np.where(own, np.where(x > 0.0, up, down) * x, x) for x in (a, b))
        first = np.arange(len(d) + 1) * d.shape[1]
        jerk = (b - a) / d
        made = Profiles.of(first, d.ravel(), a.ravel(), jerk.ravel())
        good &= made.least_velocity >= -SMALL * made.peak_velocity
        return made, good


def _shares(stroke: NDArray[np.int64], moved: Array) -> Array:
    """What each stroke moves of all, shape (n, strokes), from what each segment does."""
    strokes = range(int(stroke.max(initial=0)) + 1)
    sums = np.stack([np.where(stroke == s, moved, 0.0).sum(axis=1) for s in strokes], axis=1)
    return np.asarray(sums / sums.sum(axis=1, keepdims=True))


def _factors(d: Array, begin: Array, end: Array, share: Array) -> tuple[Array, Array]:
    """What accelerating and braking are multiplied by, so that a stroke of such times is right."""
    after = np.cumsum(d[:, ::-1], axis=1)[:, ::-1] - d
    both = []
    for part in (np.maximum, np.minimum):
        a, b = part(begin, 0.0), part(end, 0.0)
        area = (0.5 * d * (a + b)).sum(axis=1)
        moment = (0.5 * d * (a + b) * after + d * d * (2.0 * a + b) / 6.0).sum(axis=1)
        both.append((area, moment))
    (up_area, up_moment), (down_area, down_moment) = both
    with np.errstate(divide="ignore", invalid="ignore"):
        up = share / (up_moment - up_area * down_moment / down_area)
        return up, -up * up_area / down_area


def _excess(profiles: Profiles, limits: tuple[Array, Array, Array]) -> Array:
    """By which factor profiles have to be slower to keep the limits, shape (n,); 1: they do."""
    V, A, J = limits
    out = np.maximum(profiles.peak_velocity / V, np.sqrt(profiles.peak_acceleration / A))
    # Steps of the acceleration are those of a trapezoid, which has no jerk.
    return np.maximum(out, np.cbrt(profiles.greatest_jerk / J))


def _by_moving(
    task: TickTask, shape: _Shape, mirrored: bool, free: int
) -> tuple[Profiles, NDArray[np.bool_]]:
    """Each boundary at one of the two ticks beside it; the best of these profiles."""
    n, k = shape.duration.shape
    total = shape.duration.sum(axis=1)
    length = np.maximum(np.ceil(total / task.tick - ON_TICK), 1.0).astype(np.int64)
    out = task.profiles
    found = np.zeros(n, dtype=np.bool_)
    chosen: list[tuple[NDArray[np.intp], Profiles]] = []
    open_ = np.flatnonzero(length <= task.most)
    for _ in range(TRIES):
        if not len(open_):
            break
        # An odd number of ticks has no middle: nothing is told where the acceleration is 0 there.
        splits = mirrored and k % 2 == 0
        uneven = splits & (length[open_] % 2 == 1)
        for odd in (False, True):
            rows = open_[uneven == odd]
            if not len(rows):
                continue
            own = shape.take(rows).without_middle() if odd else shape.take(rows)
            made, good, slower = _best(task.take(rows), own, length[rows], mirrored, free)
            found[rows[good]] = True
            chosen.append((rows[good], made))
            length[rows] = np.maximum(length[rows] + 1, np.ceil(length[rows] * slower - ON_TICK))
        open_ = open_[~found[open_]]
        open_ = open_[length[open_] <= task.most[open_]]
    if not chosen:
        return out.take(found), found
    order = np.argsort(np.concatenate([rows for rows, _ in chosen]), kind="stable")
    return joined([made for _, made in chosen]).take(order), found


def _best(
    task: TickTask, shape: _Shape, length: Ticks, mirrored: bool, free: int
) -> tuple[Profiles, NDArray[np.bool_], Array]:
    """The best rounding of profiles of given lengths: of those that have one; which; and a factor.

    The factor says by how much the others have to be slower at least.
    """
    n, k = shape.duration.shape
    total = shape.duration.sum(axis=1, keepdims=True)
    exact = np.cumsum(shape.duration, axis=1)[:, :-1] / total * length[:, np.newaxis]
    half = min(free, (k - 1) // 2) if mirrored else k - 1
    low, nearest = np.floor(exact + ON_TICK), np.rint(exact)
    if half > CHOICES:
        variants = [nearest[:, :half]]
    else:
        steps = [np.array(up, dtype=float) for up in product((0.0, 1.0), repeat=half)]
        high = np.ceil(exact - ON_TICK)
        variants = [np.where(up > 0.0, high[:, :half], low[:, :half]) for up in steps]
    merit = np.full(n, np.inf)
    slower = np.full(n, np.inf)
    best = np.zeros((n, k), dtype=np.int64)
    for bounds in variants:
        if mirrored:
            ahead = length[:, np.newaxis] - bounds[:, ::-1]
            middle = [0.5 * length[:, np.newaxis]] if k % 2 == 0 else []
            bounds = np.concatenate([bounds, *middle, ahead], axis=1)
        ticks = np.diff(bounds, axis=1, prepend=0.0, append=length[:, np.newaxis])
        ticks = ticks.astype(np.int64)
        fits = (ticks >= np.minimum(task.least, length)[:, np.newaxis]).all(axis=1)
        if not fits.any():
            continue
        rows = np.flatnonzero(fits)
        made, good = shape.take(rows).solved(ticks[rows], task.tick)
        V, A, J = (limit[rows] for limit in task.limits)
        excess = np.where(good, _excess(made, (V, A, J)), np.inf)
        slower[rows] = np.minimum(slower[rows], excess)
        value = np.square(bounds[rows] - exact[rows]).sum(axis=1)
        if task.tick > FINE and len(task.poles):
            left = np.abs(profiles_response(made, task.poles)) / task.poles.imag
            value = (left * task.weights[rows]).max(axis=1) * (1.0 + 1e-9 * value)
        better = (excess <= 1.0 + WITHIN) & (value < merit[rows])
        merit[rows[better]] = value[better]
        best[rows[better]] = ticks[rows[better]]
    good = np.isfinite(merit)
    made, _ = shape.take(np.flatnonzero(good)).solved(best[good], task.tick)
    return made, good, np.where(np.isfinite(slower), slower, 1.0)


def _by_sampling(task: TickTask, shape: _Shape) -> Profiles | None:
    """One profile whose acceleration runs straight between ticks beside its boundaries.

    A boundary between two ticks becomes one at each of them: the acceleration there is that of the
    profile, so that what changes is of second order in the tick.
    """
    shape = shape.without_nothing()
    begin, end = shape.begin[0], shape.end[0]
    if np.abs(begin[1:] - end[:-1]).max(initial=0.0) > 1e-6 * np.abs(begin).max(initial=0.0):
        return None  # a trapezoid: its steps can only be moved
    at = np.concatenate([[0.0], np.cumsum(shape.duration[0])])
    a = np.concatenate([begin, end[-1:]])
    length = max(int(np.ceil(at[-1] / task.tick - ON_TICK)), 2)
    q = int(task.least[0])
    for _ in range(TRIES):
        if length > task.most[0]:
            return None
        scaled = at * (length / at[-1])
        cells = max(length // q, 2)
        grid = np.unique(np.rint(np.arange(cells + 1) * (length / cells)).astype(np.int64))
        place = np.interp(scaled, grid, np.arange(len(grid)))
        near = np.concatenate([np.floor(place + ON_TICK), np.ceil(place - ON_TICK)])
        cell = np.unique(near.astype(np.int64))
        knots = grid[cell]
        value = np.interp(knots, scaled, a)
        value[np.abs(value) < 1e-12 * np.abs(value).max(initial=0.0)] = 0.0
        ticks = np.diff(knots)[np.newaxis, :]
        starts, share = _apart(shape, place)
        sampled = _Shape(
            ticks * task.tick, value[np.newaxis, :-1], value[np.newaxis, 1:],
            np.searchsorted(starts[1:], cell[np.newaxis, :-1], side="right"), share[np.newaxis],
        )  # fmt: skip
        made, good = sampled.solved(ticks, task.tick)
        excess = float(_excess(made, task.limits)[0]) if good[0] else 1.0
        if good[0] and excess <= 1.0 + WITHIN:
            return made
        length = max(length + 1, int(np.ceil(length * excess - ON_TICK)))
    return None


def _apart(shape: _Shape, place: Array) -> tuple[NDArray[np.int64], Array]:
    """Cells in which strokes of one profile begin, at whose ends it stands; and their shares.

    A stroke that begins in the cell in which the one before ends is no stroke of its own.
    """
    accelerates = (shape.begin[0] != 0.0) | (shape.end[0] != 0.0)
    starts, share, stood = [], [], -1
    for s in range(int(shape.stroke[0, -1]) + 1):
        own = np.flatnonzero(shape.stroke[0] == s)
        begins = int(place[own[0]] + ON_TICK)
        if begins >= stood:
            starts.append(begins)
            share.append(0.0)
        share[-1] += float(shape.share[0, s])
        stood = int(np.ceil(place[own[accelerates[own]][-1] + 1] - ON_TICK))
    return np.array(starts, dtype=np.int64), np.array(share)
