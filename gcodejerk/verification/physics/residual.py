r"""Whether a stream leaves less vibration than the rapid that it replaces.

What a mode keeps after a motion that rests from T on is

.. math:: D = \frac{p}{\omega_d} \left| \int a(t)\, e^{\lambda (T - t)} dt \right|,
          \qquad \lambda = -\zeta\omega + j\omega_d .

The controller's own rapid is judged in closed form: its velocity is three boxes of unit area folded
with each other, of widths T - r (cruise and one ramp), r - r1 (a ramp less one of its ends) and r1
(the end of a ramp, A/J), so with :math:`\varphi(x) = (e^x - 1)/x` the integral is
:math:`L \lambda\, \varphi(\lambda w_1)\, \varphi(\lambda w_2)\, \varphi(\lambda w_3)`; r1 = 0 is a
trapezoid. The stream is judged by its points as they are written, straight lines between them: the
sum of its velocity steps, each times :math:`e^{\lambda (T - t)}`.

Rule: a stream is refused only if it leaves more than the controller's own rapid in every reading
that is fair: more than that rapid in closed form at the worst frequencies within the band, which is
what designs are judged by, and more than it through straight lines at the same moments, by more
than what rounding and the distance of the points may make of it. Of a mode of which points tell
less than two in a period, they tell nothing.

A control that moves in straight lines between the points leaves what these leave, of every mode:
then neither the distance of the points excuses anything, nor how few there are in a period.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, Machine
from gcodejerk.verification.physics.conventional import rapid_position
from gcodejerk.verification.physics.laws import OwnRapids, has_law
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.own_rapids import left_by_rapids
from gcodejerk.verification.physics.points import Array, Index, Paths

RELATIVE = 0.02
"""Share by which a stream may leave more: straight lines filter both motions nearly alike."""
SIGMAS = 3.0
"""Roundings of points add up at random, of up to a step each: so many of their deviations."""
BAND_POINTS, BAND_STEP = 9, 0.25
"""Frequencies at which a band is judged at least, and how far apart they are at most, times half of
the longest duration. [rad]"""
UNJUDGED = ("conventional", "shortest")
"""Profiles that are written whether or not their straight lines are better than today's rapid."""


@dataclass(frozen=True, slots=True, eq=False)
class Excess:
    """Streams that leave too much: which they are, what they leave, what they may leave, in mm."""

    stream: Index
    left: Array
    allowed: Array

    def columns(self) -> tuple[list[int], list[float], list[float]]:
        """The same as numbers."""
        return self.stream.tolist(), self.left.tolist(), self.allowed.tolist()


def leaves_more(paths: Paths, machine: Machine, moment: Index, limits: Array) -> Excess:
    """Find the streams that leave more vibration than the controller's own rapid.

    Parameters
    ----------
    paths : Paths
        The streams.
    machine : Machine
        Its modes.
    moment : ndarray of int, shape (rows,)
        When each point is reached, since the start of its stream. [intervals]
    limits : ndarray, shape (3, streams, 9)
        Of the controller's own rapid, over the displacement of each axis. [1/s], [1/s^2], [1/s^3]
    """
    straight = machine.design.profile not in UNJUDGED
    streams = _Streams(paths, machine, moment, limits, straight)
    modes = Oscillators.of(machine)
    none = Excess(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))
    if not len(modes.poles):
        return none
    left = streams.largest(modes, np.abs(streams.lines(modes, paths.position)))
    # Nearly every stream leaves less by far: only the others are looked at closely.
    rapid = streams.largest(modes, np.abs(streams.own(modes)))
    allowed = (1.0 + RELATIVE) * rapid + streams.noise(modes)
    if machine.design.profile == "shortest":
        allowed = np.maximum(allowed, machine.design.tolerance + streams.noise(modes))
    suspects = np.flatnonzero(~(left <= allowed))
    if not len(suspects):
        return none
    band = band_of(machine, modes, float(streams.t.max(initial=0.0)))
    rows = paths.rows_of(suspects)
    part, left, allowed = paths.take(suspects), left[suspects], allowed[suspects]
    streams = _Streams(part, machine, moment[rows], limits[:, suspects], straight)
    own = streams.lines(modes, streams.own_positions())
    sampled = streams.largest(modes, np.abs(own))
    allowed = np.maximum(allowed, (1.0 + RELATIVE) * sampled + streams.noise(modes))
    if not straight:
        allowed = allowed + streams.largest(modes, streams.coarseness(modes))
    for factor in band:
        if (left <= allowed).all():
            return none
        near = streams.largest(modes, np.abs(streams.own(modes.at(float(factor)))))
        allowed = np.maximum(allowed, (1.0 + RELATIVE) * near)
    bad = np.flatnonzero(~(left <= allowed))
    return Excess(suspects[bad].astype(np.int64), left[bad], allowed[bad])


def band_of(machine: Machine, modes: Oscillators, longest: float) -> Array:
    """Frequencies of the band, relative to the modes' own, its ends first.

    A null that a rapid has at the mode's own frequency is farthest from them. They stand so close
    that what a motion of the longest time [s] leaves cannot rise and fall in between.
    """
    band = machine.design.band
    if not band:
        return np.ones(1)
    phase = band * 0.5 * longest * float(np.abs(modes.poles).max(initial=0.0))
    half = max(BAND_POINTS // 2, int(np.ceil(phase / BAND_STEP)))
    factors = np.linspace(1.0 - band, 1.0 + band, 2 * half + 1)
    return factors[np.argsort(-np.abs(factors - 1.0), kind="stable")]


class _Streams:
    """The motions of many streams, and of the rapids that they replace."""

    def __init__(
        self, paths: Paths, machine: Machine, moment: Index, limits: Array, straight: bool
    ) -> None:
        self.paths, self.machine, self.straight = paths, machine, straight
        self.own = left_by_rapids(paths.displacement, machine, limits)
        self.owner = paths.owner
        self.left = (moment[paths.end - 1][self.owner] - moment).astype(np.int64)
        """Until arrival, row by row. [intervals]"""
        self.t = moment * machine.interval
        self.count = moment[paths.end - 1]
        self.axes = np.flatnonzero((paths.displacement != 0.0).any(axis=0)).tolist()
        if machine.positioning == "linear":
            limits = np.repeat(limits.min(axis=2)[:, :, np.newaxis], len(AXES), axis=2)
        self.limits = limits
        self.begins = np.zeros(len(self.t), dtype=np.bool_)
        self.begins[paths.begin] = True

    @property
    def spacing(self) -> Array:
        """Mean time from point to point of each stream, shape (streams,), in s."""
        return np.asarray(self.count * self.machine.interval / np.maximum(self.paths.count, 1))

    def largest(self, modes: Oscillators, amplitude: Array) -> Array:
        """Largest over the modes that each stream's own points can show, shape (streams,)."""
        if self.straight:
            return modes.largest(amplitude)
        shown = np.abs(modes.poles) * self.spacing[:, np.newaxis] < np.pi
        return modes.largest(np.where(shown, amplitude, 0.0))

    def lines(self, modes: Oscillators, position: Array) -> NDArray[np.complex128]:
        """Vibration left by straight lines through positions, shape (streams, m) [mm]."""
        h = np.diff(self.t, prepend=0.0)
        h = np.where(self.begins | (h <= 0.0), 1.0, h)
        out = np.zeros((len(self.count), len(modes.poles)), dtype=np.complex128)
        clock = np.arange(int(self.left.max(initial=0)) + 1) * self.machine.interval
        steps = {}
        for a in self.axes:
            x = position[:, a]
            v = np.where(self.begins, 0.0, np.diff(x, prepend=0.0) / h)
            after = np.where(np.roll(self.begins, -1), 0.0, np.roll(v, -1))
            steps[a] = after - v
        for m, pole in enumerate(modes.poles):
            parts = [modes.participation[m, a] * steps[a] for a in self.axes]
            driven = np.sum(parts, axis=0) * np.exp(pole * clock)[self.left]
            out[:, m] = np.add.reduceat(driven, self.paths.begin) / pole.imag
        return out

    def own_positions(self) -> Array:
        """Positions of the controller's own rapid at the moments of the points."""
        out = np.array(self.paths.position)
        t = self.t - self.t[self.paths.begin][self.owner]
        laws = None
        if has_law(self.machine):
            laws = OwnRapids(self.paths.displacement, self.machine, self.limits)
        for a in self.axes:
            D = self.paths.displacement[:, a]
            V, A, J = (np.where(D != 0.0, limit[:, a], 1.0) for limit in self.limits)
            if laws is not None:
                share = laws.position(a, t, self.owner)
                out[:, a] = self.paths.start[self.owner, a] + share * D[self.owner]
                continue
            bell = self.machine.planner == BELL
            share = rapid_position(t, V, A, J, bell=bell, owner=self.owner)
            out[:, a] = self.paths.start[self.owner, a] + share * D[self.owner]
        return out

    def noise(self, modes: Oscillators) -> Array:
        """What rounding to steps may add, shape (streams,) [mm]."""
        step = np.where(self.paths.displacement != 0.0, self.paths.step, 0.0)
        blocks = np.maximum(self.paths.count, 1)
        h = self.spacing[:, np.newaxis]
        omega = np.abs(modes.poles)
        # An error of one point is a second difference of the velocity: 2 - 2 cos(omega h).
        each = (2.0 - 2.0 * np.cos(np.minimum(omega * h, np.pi))) / h / modes.poles.imag
        each = each * (step @ np.abs(modes.participation).T)
        return self.largest(modes, each * (SIGMAS * np.sqrt(blocks / 3.0) + 1.0)[:, np.newaxis])

    def coarseness(self, modes: Oscillators) -> Array:
        """What reading the points differently changes, shape (streams, m) [mm].

        The other reading leaves out every second point: errors of straight lines grow with the
        square of their length, so the points themselves are wrong by a third of the difference.
        """
        position = np.array(self.paths.position)
        place = np.arange(len(position)) - self.paths.begin[self.owner]
        odd = (place % 2 == 1) & (np.arange(len(position)) != (self.paths.end - 1)[self.owner])
        k = np.flatnonzero(odd)
        # Points behind the arrival have its moment: they are where it is.
        both = self.t[k + 1] - self.t[k - 1]
        share = (self.t[k] - self.t[k - 1]) / np.where(both > 0.0, both, 1.0)
        middle = position[k - 1] + share[:, np.newaxis] * (position[k + 1] - position[k - 1])
        fine = self.lines(modes, position)
        position[k] = middle
        out: Array = np.abs(self.lines(modes, position) - fine) / 3.0
        return out
