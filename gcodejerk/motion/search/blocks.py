r"""Blocks of constant jerk, and what a unit jerk in each of them leaves.

This module owns the rows of the cone programme for blocks of jerk: of the whole move, or of its two
ramps where a long cruise lies between them. They are computed at the nodes of `looked_at`, and
what lies between follows from these.

Rule: whatever is looked at has one row or two for each frequency, whose squares add up.

Notes
-----
A unit jerk in a block from :math:`t_0` to :math:`t_1` leaves a mode with weight p the displacement
:math:`\frac{p}{\lambda^2 \omega_d} (e^{\lambda (T - t_0)} - e^{\lambda (T - t_1)})`, of which the
modulus counts.

The ramps of a move with a long cruise are alike: one is the other in reverse. What the first
leaves decays until the end of the move by a factor d, and meets what the second leaves in some
phase, which the cruise makes change fast with the frequency. In the worst phase both add up; held
down are both parts times 1 + d: an upper bound, and the exact one where both leave the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex, grouped
from gcodejerk.motion.search.looked_at import Flags, Index, LookedAt
from gcodejerk.motion.search.programme import Problem
from gcodejerk.motion.search.unit_move import Move

AT_ONCE = 64
"""Poles whose responses are computed together."""
MOST_KNOWN = 1 << 20
"""Numbers of what rings at the ends of all intervals that are kept, at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Ringing:
    """What rings at the end of a stretch of a move of what happens before.

    It is not divided by what is the same for all blocks, which weights are. Phases are those in the
    middle of the stretch, where they change least with the frequency.

    Attributes
    ----------
    poles : ndarray of complex, shape (p,)
        Of the nodes, in units of the duration of the whole move.
    first, last, count : int
        The stretch, and the whole move. [intervals]
    known : tuple of ndarray, each of shape (last - first + 1, p), optional
        Its real and its imaginary part at the ends of all intervals, where they are not too many.
    """

    poles: Complex
    first: int
    last: int
    count: int
    known: tuple[Array, Array] | None = None

    @classmethod
    def of(cls, looked_at: LookedAt, first: int, last: int, count: int, interval: float) -> Ringing:
        """For the nodes of what is looked at."""
        poles = looked_at.nodes * (count * interval)
        rings = cls(poles, first, last, count)
        if len(poles) * (last - first + 1) > MOST_KNOWN:
            return rings
        return cls(poles, first, last, count, rings._everywhere())

    def left(self, knots: Index, parts: int) -> Array:
        """What a unit jerk in each block leaves, shape (parts * p, k).

        `parts`: rows of the real and the imaginary part of each pole, or of the latter alone: of
        blocks whose images leave the same there.
        """
        blocks = len(knots) - 1
        rows = np.empty((len(self.poles), parts, blocks))
        # Those that have an image behind them, or are their own, are computed.
        own = blocks if parts > 1 else (blocks + 1) // 2
        if self.known is not None:
            for part, every in enumerate(self.known[-parts:]):
                there = every[knots[: own + 1] - self.first]
                rows[:, part, :own] = (there[:-1] - there[1:]).T
        # A few poles at a time: they stay in the processor's cache.
        for begin in range(0, len(self.poles) if self.known is None else 0, AT_ONCE):
            some = slice(begin, begin + AT_ONCE)
            left = np.diff(self._at(knots[: own + 1], some), axis=1)
            np.negative(left.imag, out=rows[some, -1, :own])
            if parts > 1:
                np.negative(left.real, out=rows[some, 0, :own])
        if own < blocks:
            rows[:, :, own:] = rows[:, :, blocks - own - 1 :: -1]
        return rows.reshape(-1, blocks)

    def sums(self, weights: Array, parts: int) -> Array:
        """The sum of these rows for each interval, times weights of shape (parts * p,)."""
        of_pole = weights.reshape(-1, parts)
        if self.known is not None:
            of_parts = zip(self.known[-parts:], of_pole.T, strict=True)
            return -np.diff(sum((every @ own for every, own in of_parts), start=np.zeros(1)))
        used: Flags = np.any(of_pole != 0.0, axis=1)
        # Of a complex number, times its conjugate: the real part is that of the products.
        of_each = (of_pole[used, 0] if parts > 1 else 0.0) - 1j * of_pole[used, -1]
        every = np.arange(self.first, self.last + 1)
        sums: Array = -np.diff((of_each @ self._at(every, used)).real)
        return sums

    def _everywhere(self) -> tuple[Array, Array]:
        """What rings from the ends of all intervals, shape (last - first + 1, p): two parts.

        A power of what an interval does is that of a few intervals times that of many: both are
        short lists.
        """
        ends = self.last - self.first + 1
        few = int(np.ceil(np.sqrt(ends)))
        rate = self.poles / self.count
        centre = 1j * self.poles.imag * (0.5 * (self.first + self.last) - self.last) / self.count
        near = np.exp(np.arange(few)[:, np.newaxis] * rate)
        far = np.exp(few * np.arange(-(-ends // few))[:, np.newaxis] * rate + centre)
        every = (far[:, np.newaxis] * near).reshape(-1, len(rate))[ends - 1 :: -1]
        return np.ascontiguousarray(every.real), np.ascontiguousarray(every.imag)

    def _at(self, knots: Index, some: slice | Flags = slice(None)) -> Complex:
        """What rings from each knot, of some poles, shape (q, k + 1)."""
        pole = self.poles[some, np.newaxis]
        middle = 0.5 * (self.first + self.last)
        phase = pole.real * (self.last - knots[-1]) + 1j * pole.imag * (middle - knots[-1])
        # Blocks have few sizes: what rings from a knot is what does from the next one, and a block.
        sizes, block = np.unique(np.diff(knots), return_inverse=True)
        ringing = np.empty((len(pole), len(knots)), dtype=np.complex128)
        ringing[:, :1] = np.exp(phase / self.count)
        ringing[:, 1:] = np.exp(pole * (sizes / self.count))[:, block[::-1]]
        np.cumprod(ringing, axis=1, out=ringing)
        return ringing[:, ::-1]


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks of a move, and what a unit jerk in each of them leaves at every frequency.

    Attributes
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks. [intervals]
    rows : ndarray, shape (n, k)
        Of the nodes, for the unit length in the unit of time.
    near, share : ndarray of int and of float, shape (r, 4)
        Four of these rows say, times shares, what a row of a frequency does.
    cone : ndarray of int, shape (r,)
        Of these rows, those that count together stand side by side.
    owner : ndarray of int, shape (c,)
        The group of each cone, of those of `LookedAt`: of one or two cones.
    ringing : tuple of Ringing
        What the rows are made of, those of each stretch of the move behind those of the other.
    mirrored, cruise : bool
        As of `programme.Problem`.
    """

    knots: Index
    rows: Array
    near: Index
    share: Array
    cone: Index
    owner: Index
    ringing: tuple[Ringing, ...]
    mirrored: bool
    cruise: bool

    @classmethod
    def whole(cls, looked_at: LookedAt, knots: Index, interval: float) -> Blocks:
        """Blocks of a whole move.

        Without damping a profile and its mirror image in time (braking first, reversed) leave the
        same, and half of both no more: the optimum can be odd about its middle. Seen from there,
        its response is imaginary.
        """
        count, T = int(knots[-1]), knots[-1] * interval
        ringing = Ringing.of(looked_at, 0, count, count, interval)
        undamped = not looked_at.poles.real.any()
        mirrored = undamped and bool(np.all(knots + knots[::-1] == count))
        parts = 1 if mirrored else 2
        between = _between(looked_at, [looked_at.weights], parts, T)
        return cls(knots, ringing.left(knots, parts), *between, (ringing,), mirrored, False)

    @classmethod
    def until(cls, looked_at: LookedAt, knots: Index, interval: float, ringing: Ringing) -> Blocks:
        """Blocks of a move that others begin with, and what rings when the last of them has ended.

        `ringing` is that of the one that lasts longest: phases of all are seen from its middle.
        """
        between = _between(looked_at, [looked_at.weights], 2, knots[-1] * interval)
        return cls(knots, ringing.left(knots, 2), *between, (ringing,), False, False)

    @classmethod
    def ramps(cls, looked_at: LookedAt, ramp: Index, count: int, interval: float) -> Blocks:
        """Blocks of the acceleration, ends at `ramp`, and of its image; between them the cruise."""
        knots = np.concatenate([ramp, count - ramp[::-1]])
        T, last = count * interval, len(ramp) - 1
        weights = looked_at.weights * (
            1.0 + np.exp(looked_at.poles.real * T * (1.0 - ramp[-1] / count))
        )
        # Both halves are looked at where damping tells them from each other.
        stretches = [(count - int(ramp[-1]), count, last + 1)]
        if looked_at.poles.real.any():
            stretches.append((0, int(ramp[-1]), 0))
        ringing = tuple(Ringing.of(looked_at, a, b, count, interval) for a, b, _ in stretches)
        halves = np.zeros((len(ringing), 2 * len(looked_at.nodes), len(knots) - 1))
        for own, rings, (*_, first) in zip(halves, ringing, stretches, strict=True):
            part = slice(first, first + last)
            own[:, part] = rings.left(knots[first : first + last + 1], 2)
        rows = halves.reshape(-1, len(knots) - 1)
        between = _between(looked_at, [weights] * len(ringing), 2, T)
        return cls(knots, rows, *between, ringing, True, True)

    def cut(self, knots: Index) -> Blocks:
        """Other blocks of the same whole move, which have images if these have."""
        if knots is self.knots:
            return self
        (ringing,) = self.ringing
        return replace(self, knots=knots, rows=ringing.left(knots, 1 if self.mirrored else 2))

    @property
    def leads(self) -> Index:
        """The first row of each cone."""
        leads: Index = np.flatnonzero(np.diff(self.cone, prepend=-1))
        return leads

    def largest(self, left: Array) -> Array:
        """Of what each cone is left with, what each group is, shape (g,)."""
        if len(self.owner) == self.owner[-1] + 1:
            return left
        largest: Array = np.maximum.reduceat(left, np.flatnonzero(np.diff(self.owner, prepend=-1)))
        return largest

    def everywhere(self, weights: Array) -> Array:
        """Sum of what a unit jerk in each interval leaves in every row, times its weight, (n,).

        Of intervals whose block is no image of another, and together with those of the image.
        `weights`, shape (r,): of the rows of all frequencies.
        """
        shares = (weights[:, np.newaxis] * self.share).ravel()
        of_rows = np.bincount(self.near.ravel(), shares, len(self.rows)).astype(np.float64)
        parts = len(self.rows) // sum(len(rings.poles) for rings in self.ringing)
        sums = [
            rings.sums(own, parts)
            for rings, own in zip(self.ringing, np.split(of_rows, len(self.ringing)), strict=True)
        ]
        if self.cruise:
            # Of the second ramp, which is an image, and of the first where it is looked at.
            total: Array = sum(sums[1:], sums[0][::-1])
            return total
        if self.mirrored:
            return (sums[0] + sums[0][::-1])[: (len(sums[0]) + 1) // 2]
        return sums[0]

    def problem(self, move: Move, active: Flags, cap: Array) -> Problem:
        """The programme of a move for these blocks, and for the groups that are active, (g,).

        `cap`, (g,): what each may keep, NaN where it is to be least.
        """
        T = move.count * move.interval
        used = active[self.owner]
        rows: Flags | slice = slice(None)
        if not used.all():
            rows = np.repeat(used, np.diff(self.leads, append=len(self.cone)))
        return Problem(
            knots=self.knots,
            velocity=move.velocity * T,
            acceleration=move.acceleration * T**2,
            # From one limit of the acceleration to the other within an interval: no more matters.
            jerk=min(move.jerk, 2.0 * move.acceleration / move.interval) * T**3,
            rows=self.rows,
            group=self.cone[rows],
            cap=cap[self.owner[used]],
            near=self.near[rows],
            share=self.share[rows],
            mirrored=self.mirrored,
            cruise=self.cruise,
        )

    def seen(self, jerk: Array) -> Array:
        """What a jerk in each block leaves in the rows of all frequencies, shape (r,)."""
        seen: Array = (self.share * (self.rows @ jerk)[self.near]).sum(axis=1)
        return seen

    def left(self, jerk: Array) -> Array:
        """What each group is left with by a jerk in each block, shape (g,)."""
        return self.largest(grouped(np.abs(self.seen(jerk)), self.cone))


def _between(
    looked_at: LookedAt, weights: list[Array], parts: int, T: float
) -> tuple[Index, Array, Index, Index]:
    """Of the rows of every frequency: those of nodes around each, their shares; cone; its group.

    `weights`: of what is looked at apart, of one half or of both; the rows of a half follow those
    of another.
    """
    poles = looked_at.poles * T
    gain = 1.0 / (np.abs(poles) ** 2 * poles.imag)
    halves, part = len(weights), np.arange(parts)[:, np.newaxis]
    shape = (len(poles), halves, parts, 4)
    near, share = np.empty(shape, dtype=np.int64), np.empty(shape)
    for half, own in enumerate(weights):
        begin = half * parts * len(looked_at.nodes)
        near[:, half] = begin + parts * looked_at.near[:, np.newaxis] + part
        share[:, half] = (looked_at.share * (own * gain)[:, np.newaxis])[:, np.newaxis]
    cone = np.broadcast_to(
        halves * looked_at.group[:, np.newaxis, np.newaxis] + np.arange(halves)[:, np.newaxis],
        shape[:3],
    ).ravel()
    owner: Index = np.unique(cone) // halves
    if halves == 1 or len(looked_at.source) == len(poles):
        return near.reshape(-1, 4), share.reshape(-1, 4), cone, owner
    # Of frequencies that count together, all of one half and then of the other.
    order = np.argsort(cone, kind="stable")
    return near.reshape(-1, 4)[order], share.reshape(-1, 4)[order], cone[order], owner
