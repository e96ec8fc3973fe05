r"""The controller's own rapids by a law or a filter of its own, as verification judges them.

A ramp is sampled: speeds at `PARTS` + 1 moments, from the law as the control's manual or source
has it. Times and ways are closed forms, since whole intervals are counted by them; what modes keep,
and positions, follow from the samples. Laws that are averages of a step of the speed stay the boxes
that they are, as in `conventional`.

Rule: a move by one line has one law for all its axes: the least of what each axis may do over its
displacement, and the times of the axis whose acceleration that is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, LAWS, Filter, Machine
from gcodejerk.verification.physics.conventional import box_widths
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.points import Array, Index
from gcodejerk.verification.physics.shapers import Complex, impulses_of, lasts, passes

PARTS = 240
HALVINGS = 80
SHORTEST = 1e-6
"""An average that is shorter counts as this long: it is there, and changes nothing. [s]"""
TIMES = ("first_average", "second_average", "rise", "fall", "braking_rise", "braking_fall")
OF_CONTROL = ("overshoot", "notch")
BOXES = ("time-constants", "averaged-trapezoid", "notch-ramp")
ASYMMETRIC = ("four-ramp", "two-stage")


def has_law(machine: Machine) -> bool:
    """Whether limits alone do not say what the control's own rapids are."""
    return machine.planner in LAWS or any(axis.filter for axis in machine.axes)


def is_mirrored(machine: Machine) -> bool:
    """Whether the control's own rapids are their own mirror images."""
    filters = {axis.filter.kind for axis in machine.axes if axis.filter}
    return machine.planner not in ASYMMETRIC and filters <= {"average", "triangle"}


@dataclass(frozen=True, eq=False)
class Ramp:
    """From rest to speeds, shape (n,) each: how long, how far, and the speed in between."""

    time: Array
    """[s]"""
    way: Array
    """[-]"""
    speed: Callable[[Array], Array]
    """At moments of shape (n, k), from 0 to `time`. [1/s]"""

    @cached_property
    def samples(self) -> Array:
        """Speeds at moments as far apart, shape (n, PARTS + 1)."""
        return self.speed(self.time[:, np.newaxis] * np.linspace(0.0, 1.0, PARTS + 1))


@dataclass(frozen=True, slots=True, eq=False)
class Sampled:
    """Unit moves of two ramps, n of them."""

    up: Ramp
    down: Ramp
    """As it looks backwards from the end."""
    peak: Array

    @property
    def cruise(self) -> Array:
        """Time at the peak speed [s]."""
        return np.maximum(1.0 - self.up.way - self.down.way, 0.0) / self.peak

    @property
    def total(self) -> Array:
        """Duration of each [s]."""
        return self.up.time + self.cruise + self.down.time

    def response(self, pole: complex) -> Complex:
        """The integral of a(t) exp(lambda (T - t)), shape (n,) [1/s]."""
        out: Complex = np.zeros(len(self.peak), dtype=np.complex128)
        middle = (np.arange(PARTS) + 0.5) / PARTS
        for ramp, sign in ((self.up, 1.0), (self.down, -1.0)):
            if not len(self.peak):
                continue
            gained = np.diff(ramp.samples, axis=1)
            at = ramp.time[:, np.newaxis] * middle
            left = self.total[:, np.newaxis] - at if sign > 0.0 else at
            x = 0.5 * pole * ramp.time / PARTS
            safe = np.where(np.abs(x) < 1e-6, 1.0, x)
            spread = np.where(np.abs(x) < 1e-6, 1.0, np.sinh(safe) / safe)
            out += sign * spread * (gained * np.exp(pole * left)).sum(axis=1)
        return out

    def position(self, t: Array, owner: Index) -> Array:
        """Positions [-] of the moves `owner` at moments t."""
        total = self.total[owner]
        before = t < (self.up.time + 0.5 * self.cruise)[owner]
        first = _way(self.up, self.peak, np.maximum(t, 0.0), owner)
        last = 1.0 - _way(self.down, self.peak, np.maximum(total - t, 0.0), owner)
        return np.where(before, first, last)


def _way(ramp: Ramp, peak: Array, t: Array, owner: Index) -> Array:
    """Way [-] from rest at moments, through a ramp and on at its speed."""
    speed = ramp.samples
    h = np.maximum(ramp.time, 1e-12) / PARTS
    way = np.zeros_like(speed)
    way[:, 1:] = np.cumsum(0.5 * (speed[:, 1:] + speed[:, :-1]), axis=1) * h[:, np.newaxis]
    # The way of the whole ramp is known; the sums are a little off it.
    way *= (ramp.way / np.maximum(way[:, -1], 1e-300))[:, np.newaxis]
    u = t / h[owner]
    k = np.clip(u.astype(np.int64), 0, PARTS - 1)
    part = np.clip(u - k, 0.0, 1.0) * h[owner]
    v0, v1 = speed[owner, k], speed[owner, k + 1]
    within = way[owner, k] + part * (v0 + 0.5 * (v1 - v0) * part / h[owner])
    beyond = ramp.way[owner] + peak[owner] * (t - ramp.time[owner])
    return np.where(t >= ramp.time[owner], beyond, within)


class Boxes:
    """Unit moves that are a step behind three averages, n of them."""

    def __init__(self, widths: tuple[Array, Array, Array]) -> None:
        self.widths = tuple(np.maximum(width, 0.0) for width in widths)

    @property
    def total(self) -> Array:
        """Duration of each [s]."""
        out: Array = np.sum(self.widths, axis=0)
        return out

    def response(self, pole: complex) -> Complex:
        """As of `Sampled`."""
        out: Complex = np.full(len(self.widths[0]), pole, dtype=np.complex128)
        for width in self.widths:
            x = pole * width
            small = np.abs(x) < 1e-6
            safe = np.where(small, 1.0, x)
            out *= np.where(small, 1.0 + 0.5 * x, (np.exp(safe) - 1.0) / safe)
        return out

    def position(self, t: Array, owner: Index) -> Array:
        """As of `Sampled`: the third integral of the steps."""
        a, b, c = (np.maximum(width, SHORTEST)[owner] for width in self.widths)
        out = np.zeros(len(t))
        for late, sign in (
            *((0.0, 1), (a, -1), (b, -1), (c, -1)),
            *((a + b, 1), (a + c, 1), (b + c, 1), (a + b + c, -1)),
        ):
            out += sign * np.maximum(t - late, 0.0) ** 3
        return np.where(t >= a + b + c, 1.0, np.clip(out / (6.0 * a * b * c), 0.0, 1.0))


class OwnRapids:
    """The controller's own rapids of many streams, axis by axis.

    Parameters
    ----------
    displacement : ndarray, shape (moves, 9)
        [mm] or [deg]
    machine : Machine
        Its planner.
    limits : ndarray, shape (3, moves, 9)
        Of `own_rapids.rapid_limits`: what each axis may do over its displacement.
    """

    def __init__(self, displacement: Array, machine: Machine, limits: Array) -> None:
        self.machine, self.limits, self.displacement = machine, limits, displacement
        self.size = np.abs(displacement)
        self.moving = self.size > 0.0
        self.linear = machine.positioning == "linear"
        self.filters: dict[int, Filter | None] = {
            AXES.index(axis.name): axis.filter for axis in machine.axes
        }
        self._bases: dict[int, Boxes | Sampled] = {}

    def base(self, axis: int) -> Boxes | Sampled:
        """What the planner makes of each move for an axis; of axes that do not move, anything."""
        at = -1 if self.linear else axis
        if at not in self._bases:
            self._bases[at] = self._made(axis)
        return self._bases[at]

    def totals(self) -> Array:
        """Durations, shape (moves, 9); 0 where an axis does not move [s]."""
        out = np.zeros(self.size.shape)
        for a in np.flatnonzero(self.moving.any(axis=0)).tolist():
            out[:, a] = self.base(a).total + lasts(self.filters.get(a))
        return np.where(self.moving, out, 0.0)

    def response(self, axis: int, pole: complex) -> Complex:
        """What modes get of unit moves of an axis, at the axis's own arrival."""
        return self.base(axis).response(pole) * passes(self.filters.get(axis), pole)

    def left(self, modes: Oscillators) -> NDArray[np.complex128]:
        """Vibration when the last axis has arrived, shape (moves, m) [mm]."""
        ends = self.totals()
        out = np.zeros((len(ends), len(modes.poles)), dtype=np.complex128)
        rest = ends.max(axis=1, initial=0.0)[:, np.newaxis] - ends
        for m, pole in enumerate(modes.poles):
            for a in np.flatnonzero(self.moving.any(axis=0)).tolist():
                amount = modes.participation[m, a] * self.displacement[:, a]
                if amount.any():
                    left = np.exp(pole * rest[:, a]) / pole.imag
                    out[:, m] += amount * left * self.response(a, complex(pole))
        return out

    def position(self, axis: int, t: Array, owner: Index) -> Array:
        """Positions [-] of an axis at moments since the start."""
        behind, base = self.filters.get(axis), self.base(axis)
        if behind is None:
            return base.position(t, owner)
        delays, shares = impulses_of(behind)
        out = np.zeros(len(t))
        for delay, share in zip(delays.tolist(), shares.tolist(), strict=True):
            out += share * base.position(t - delay, owner)
        return out

    def _made(self, axis: int) -> Boxes | Sampled:
        planner = self.machine.planner
        if planner not in LAWS:
            limits = self.limits.min(axis=2) if self.linear else self.limits[:, :, axis]
            limits = np.where(np.isfinite(limits[1]), limits, 1.0)
            return Boxes(box_widths(*limits, bell=planner == BELL))
        q = _Quantities(self, axis)
        if planner in BOXES:
            return Boxes(_boxes(planner, q))
        return _sampled(planner, q)


class _Quantities:
    """Quantities of unit moves for one axis, or for one line of all axes; shape (moves,) each."""

    def __init__(self, own: OwnRapids, axis: int) -> None:
        self.own, self.axis = own, axis

    def of(self, name: str) -> Array:
        """One of them; 1 where the axis does not move."""
        own = self.own
        each = np.full(own.size.shape, np.inf)
        for a in own.machine.axes:
            law = dict(a.law)
            each[:, AXES.index(a.name)] = law[name] if name in law else getattr(a.rapid, name)
        if name in OF_CONTROL:
            return np.full(len(each), np.min(each))
        if name in TIMES:
            at = self._binding(each)
            picked = each[np.arange(len(each)), at]
            return np.where(np.isfinite(picked), picked, 1.0)
        if name in ("velocity", "acceleration"):
            each = own.limits[0 if name == "velocity" else 1]
        else:
            with np.errstate(divide="ignore", invalid="ignore"):
                each = np.where(own.moving, each / own.size, np.inf)
        unit = each.min(axis=1) if own.linear else each[:, self.axis]
        return np.where(np.isfinite(unit), unit, 1.0)

    def _binding(self, times: Array) -> NDArray[np.intp]:
        """The axis whose times count."""
        own = self.own
        if not own.linear:
            return np.full(len(times), self.axis)
        if own.machine.planner == "time-constants":
            out: NDArray[np.intp] = np.argmax(np.where(own.moving, times, -1.0), axis=1)
            return out
        acceleration = np.full(len(AXES), np.inf)
        for a in own.machine.axes:
            acceleration[AXES.index(a.name)] = a.rapid.acceleration
        with np.errstate(divide="ignore", invalid="ignore"):
            out = np.argmin(np.where(own.moving, acceleration / own.size, np.inf), axis=1)
        return out


def _boxes(planner: str, q: _Quantities) -> tuple[Array, Array, Array]:
    """Widths of laws that are averages."""
    V = q.of("velocity")
    if planner == "time-constants":
        return 1.0 / V, _kept(q.of("first_average")), _kept(q.of("second_average"))
    A = q.of("acceleration")
    if planner == "averaged-trapezoid":
        peak = np.minimum(V, np.sqrt(A))
        return 1.0 / peak, peak / A, _kept(q.of("second_average"))
    side = 1.0 / q.of("notch")
    # Each ramp covers half of v times its duration, and both together at most the whole.
    peak = _largest(V, lambda v: v * (side + np.maximum(side, v / A)))
    return 1.0 / peak, np.maximum(side, peak / A), side


def _kept(width: Array) -> Array:
    """A width of zero as the planner takes it."""
    return np.maximum(width, 1e-9)


def _sampled(planner: str, q: _Quantities) -> Sampled:
    """Laws that are sampled."""
    V = q.of("velocity")
    up, down = _ramps(planner, q)
    peak = _largest(V, lambda v: up(v).way + down(v).way)
    return Sampled(up(peak), down(peak), peak)


def _largest(most: Array, way: Callable[[Array], Array]) -> Array:
    """Highest speeds up to `most` that need no more than the whole way, by bisection."""
    low, high = np.zeros_like(most), most.copy()
    fits = way(most) <= 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        short = way(np.maximum(middle, 1e-300)) <= 1.0
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.where(fits, most, high)


Law = Callable[[Array], Ramp]


def _ramps(planner: str, q: _Quantities) -> tuple[Law, Law]:
    """The ramps of a law, to a speed each."""
    if planner == "four-ramp":
        faster, slower = q.of("acceleration"), q.of("deceleration")
        rise, fall, braking, release = (q.of(name) for name in TIMES[2:])
        return (
            lambda v: _of_two_jerks(v, faster, rise, fall),
            lambda v: _of_two_jerks(v, slower, release, braking),
        )
    if planner == "two-stage":
        change = q.of("changeover")
        up = q.of("acceleration"), q.of("upper_acceleration")
        down = q.of("deceleration"), q.of("upper_deceleration")
        return (lambda v: _of_stages(v, change, *up), lambda v: _of_stages(v, change, *down))
    if planner == "quintic":
        J = q.of("jerk")
        # Jerk 60 u (1 - u)(1 - 2 u) v/T^2: its largest is 60/6/sqrt(3).
        own = lambda v: _smooth(v, np.sqrt(10.0 / np.sqrt(3.0) * v / J), 1.875)  # noqa: E731
        return own, own
    A = q.of("acceleration")
    peak = 1.5 if planner == "poly5" else q.of("overshoot")
    own = lambda v: _smooth(v, v / A, peak)  # noqa: E731
    return own, own


def _of_stages(v: Array, change: Array, lower: Array, upper: Array) -> Ramp:
    v1 = np.minimum(v, change)
    t1, t2 = v1 / lower, (v - v1) / upper

    def speed(t: Array) -> Array:
        first, second = lower[:, np.newaxis] * t, upper[:, np.newaxis] * (t - t1[:, np.newaxis])
        return np.where(t <= t1[:, np.newaxis], first, v1[:, np.newaxis] + second)

    return Ramp(t1 + t2, 0.5 * v1 * t1 + 0.5 * (v1 + v) * t2, speed)


def _of_two_jerks(v: Array, most: Array, rise: Array, fall: Array) -> Ramp:
    # The time to full acceleration and back is `rise` and `fall`; with less of it, less.
    part = np.minimum(1.0, np.sqrt(2.0 * v / np.maximum(most * (rise + fall), 1e-300)))
    A, r1, r2 = part * most, part * rise, part * fall
    stay = np.maximum(v / A - 0.5 * (r1 + r2), 0.0)
    time = r1 + stay + r2
    way = A * r1**2 / 6.0 + 0.5 * (v + 0.5 * A * (r1 - r2)) * stay + v * r2 - A * r2**2 / 6.0

    def speed(t: Array) -> Array:
        vv, aa, b, c, end = (x[:, np.newaxis] for x in (v, A, r1, r2, time))
        rising = 0.5 * aa * t**2 / np.maximum(b, 1e-300)
        falling = vv - 0.5 * aa * (end - t) ** 2 / np.maximum(c, 1e-300)
        straight = aa * (t - 0.5 * b)
        return np.where(t < b, rising, np.where(t > end - c, falling, straight))

    return Ramp(time, way, speed)


def _smooth(v: Array, time: Array, overshoot: Array | float) -> Ramp:
    o = np.broadcast_to(np.asarray(overshoot), v.shape)[:, np.newaxis]

    def speed(t: Array) -> Array:
        u = t / np.maximum(time, 1e-300)[:, np.newaxis]
        # Between smoothstep, whose acceleration peaks at 1.5, and the quintic, at 1.875.
        quintic = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        cubic = u**2 * (3.0 - 2.0 * u)
        return v[:, np.newaxis] * (cubic + (o - 1.5) / 0.375 * (quintic - cubic))

    return Ramp(time, 0.5 * v * time, speed)
