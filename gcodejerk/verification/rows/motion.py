r"""The motion between rows: one cubic for each piece and axis, and everything about it exactly.

In a piece of length T from p0, v0 to p1, v1, with the share u of it that has passed, the cubic is
that of Hermite; this module has its second derivative at both ends from

.. math:: \ddot p(u) = \frac{(12u - 6)(p_0 - p_1)}{T^2} + \frac{(6u - 4) v_0 + (6u - 2) v_1}{T} .

Numbers that are rounded by half a step e and half a step of velocity w move an acceleration by at
most 12 e/T^2 + 6 w/T, a jerk by 24 e/T^3 + 12 w/T^2 and a velocity by 3 e/T + w.

Rule: columns hold the moves of a batch side by side; pieces never reach from one to the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.points import Index
from gcodejerk.verification.rows.moves import Array, Move, Steps

CELLS = 1 << 20
"""Exponentials computed at a time."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The pieces of b moves, s in all; columns of all nine axes."""

    first: Index
    """Shape (b + 1,): move i has the pieces first[i] to first[i + 1]."""
    owner: Index
    """Shape (s,)."""
    begin: Array
    """Shape (s,), since the move's start. [s]"""
    T: Array
    """Length, shape (s,). [s]"""
    p0: Array
    """Shape (s, 9), from the move's start on. [mm]"""
    p1: Array
    v0: Array
    v1: Array
    steps: Steps

    @classmethod
    def of(cls, moves: Sequence[Move], steps: Steps) -> Pieces:
        """Of moves whose first rows stand at the start."""
        count = np.array([len(move.t) - 1 for move in moves], dtype=np.int64)
        first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        columns = [np.zeros((first[-1], len(AXES))) for _ in range(4)]
        begin, length = np.zeros(first[-1]), np.zeros(first[-1])
        for k, move in enumerate(moves):
            part = slice(first[k], first[k + 1])
            begin[part], length[part] = move.t[:-1], np.diff(move.t)
            away = move.position - move.position[0]
            axes = list(move.axes)
            for column, values in zip(
                columns, (away[:-1], away[1:], move.velocity[:-1], move.velocity[1:]), strict=True
            ):
                column[part, axes] = values
        owner = np.repeat(np.arange(len(moves)), count)
        p0, p1, v0, v1 = columns
        return cls(first, owner, begin, length, p0, p1, v0, v1, steps)

    @property
    def total(self) -> Array:
        """Duration of each move, shape (b,) [s]."""
        last = self.first[1:] - 1
        return np.asarray(self.begin[last] + self.T[last])

    @cached_property
    def moving(self) -> NDArray[np.bool_]:
        """Axes that any piece moves, shape (9,)."""
        return np.asarray(self.p1.any(axis=0) | self.v1.any(axis=0))

    @cached_property
    def accelerations(self) -> tuple[Array, Array]:
        """At the begin and at the end of each piece, shape (s, 9)."""
        T = self.T[:, np.newaxis]
        even = 6.0 * (self.p1 - self.p0) / T**2
        return (
            np.asarray(even - (4.0 * self.v0 + 2.0 * self.v1) / T),
            np.asarray((2.0 * self.v0 + 4.0 * self.v1) / T - even),
        )

    @cached_property
    def jerk(self) -> Array:
        """Of each piece, shape (s, 9)."""
        a, b = self.accelerations
        return np.asarray((b - a) / self.T[:, np.newaxis])

    def velocity(self, u: Array) -> Array:
        """At shares of each piece, shape (s, 9)."""
        T = self.T[:, np.newaxis]
        return np.asarray(
            6.0 * u * (1.0 - u) * (self.p1 - self.p0) / T
            + (1.0 - u) * (1.0 - 3.0 * u) * self.v0
            + u * (3.0 * u - 2.0) * self.v1
        )

    def turning(self) -> Array:
        """Share at which the acceleration is 0 within a piece; 0 where it is not."""
        a, b = self.accelerations
        with np.errstate(divide="ignore", invalid="ignore"):
            u = a / (a - b)
        return np.asarray(np.where((u > 0.0) & (u < 1.0), u, 0.0))

    def extremes(self) -> tuple[Array, Array, Array]:
        """Largest velocity, acceleration and jerk in each piece, each of shape (s, 9)."""
        ends = np.maximum(np.abs(self.v0), np.abs(self.v1))
        return (
            np.maximum(np.abs(self.velocity(self.turning())), ends),
            np.maximum(*np.abs(self.accelerations)),
            np.abs(self.jerk),
        )

    def along(self, way: Array) -> Pieces:
        """Of the path, by the unit vector of each piece (s, 9): one column in place of nine."""
        p0, p1, v0, v1 = (
            (column * way).sum(axis=1, keepdims=True)
            for column in (self.p0, self.p1, self.v0, self.v1)
        )
        return replace(self, p0=p0, p1=p1, v0=v0, v1=v1)

    def blur(self) -> tuple[Array, Array, Array]:
        """What rounding may make of velocity, acceleration and jerk, each of shape (s, 9)."""
        T = self.T[:, np.newaxis]
        e, w = 0.5 * self.steps.position, 0.5 * self.steps.velocity
        # A clock in ticks is exact; as a decimal number it is rounded, as float64 too.
        return (
            3.0 * e / T + w,
            12.0 * e / T**2 + 6.0 * w / T,
            24.0 * e / T**3 + 12.0 * w / T**2,
        )

    def off_line(self, displacement: Array) -> tuple[Array, Array]:
        """How far each axis is off the straight line, and how far rounding explains, (s, 9) [mm].

        Measured against the axis that moves farthest: the difference is a cubic too, whose extremes
        are roots of a quadratic.
        """
        rows = np.arange(len(self.owner))
        main = np.argmax(np.abs(displacement), axis=1)
        size = displacement[np.arange(len(main)), main]
        ratio = (displacement / size[:, np.newaxis])[self.owner]
        main = main[self.owner]
        T = self.T[:, np.newaxis]

        def against(values: Array) -> Array:
            return np.asarray(values - ratio * values[rows, main][:, np.newaxis])

        q0, q1, w0, w1 = (against(x) for x in (self.p0, self.p1, self.v0, self.v1))
        w0, w1 = w0 * T, w1 * T
        c2, c3 = 3.0 * (q1 - q0) - 2.0 * w0 - w1, 2.0 * (q0 - q1) + w0 + w1
        worst = np.maximum(np.abs(q0), np.abs(q1))
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(c2**2 - 3.0 * c3 * w0)
            for u in ((-c2 + root) / (3.0 * c3), (-c2 - root) / (3.0 * c3), -w0 / (2.0 * c2)):
                inside = np.isfinite(u) & (u > 0.0) & (u < 1.0)
                u = np.where(inside, u, 0.0)
                worst = np.maximum(worst, np.abs(q0 + u * (w0 + u * (c2 + u * c3))))
        e, w = self.steps.position, self.steps.velocity
        share = np.abs(ratio)
        # The start is rounded too, which every position is counted from.
        may = e + share * e[main][:, np.newaxis]
        may = may + 0.125 * T * (w + share * w[main][:, np.newaxis])
        return worst, np.asarray(may)

    def response(self, modes: Oscillators) -> Array:
        """Displacement amplitude of every oscillator after each move, shape (b, m) [mm]."""
        left = (self.total[self.owner] - self.begin)[:, np.newaxis]
        last = self.first[1:] - 1
        axes = np.flatnonzero(self.moving)
        a, b, j = (x[:, axes] for x in (*self.accelerations, self.jerk))
        out = np.zeros((len(last), len(modes.poles)), dtype=np.complex128)
        width = max(1, CELLS // max(len(left), 1))
        for at in range(0, len(modes.poles), width):
            part = slice(at, at + width)
            pole, share = modes.poles[part], modes.participation[part, axes].T
            # The integral of (a + j s) exp(pole (left - s)) over a piece, by parts; where a piece
            # ends, the next one begins.
            early = np.exp(pole * left)
            late = np.roll(early, -1, axis=0)
            late[last] = 1.0
            slope = (j @ share) / pole
            each = (a @ share + slope) * early - (b @ share + slope) * late
            out[:, part] = np.add.reduceat(each / pole, self.first[:-1], axis=0)
        return np.asarray(np.abs(out) / modes.poles.imag)
