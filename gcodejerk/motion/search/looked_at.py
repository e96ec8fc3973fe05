r"""Frequencies at which an optimum is looked at, and what blocks of jerk leave there.

This module owns, for one move, the dense grid of frequencies (every mode over its band, then those
that `guard` holds down), and the rows of the cone programme for blocks of jerk: of the whole move,
or of its two ramps where a long cruise lies between them.

Rule: whatever is looked at has one row or two for each frequency, in units of a measure that is
common to all; of guarded ones it is what they may keep.

Notes
-----
A unit jerk in a block from :math:`t_0` to :math:`t_1` leaves a mode with weight p the displacement
:math:`\frac{p}{\lambda^2 \omega_d} (e^{\lambda (T - t_0)} - e^{\lambda (T - t_1)})`.

The ramps of a move with a long cruise are alike: one is the other in reverse. What the first
leaves decays until the end of the move by a factor d, and meets what the second leaves in some
phase, which the cruise makes change fast with the frequency. In the worst phase both add up; held
down are both parts times 1 + d: an upper bound, and the exact one where both leave the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex, grouped

Index = NDArray[np.int64]

DENSE, FEWEST = 0.1, 8
"""Distance of the frequencies of a band, times the half of a duration, at which it is looked
at [rad], and how many on each side of its own at least."""
SPACING = 1.0
"""Distance of frequencies, times the half of a duration, at which a design begins. [rad]"""
AT_ONCE = 64
"""Poles whose responses are computed together."""


@dataclass(frozen=True, slots=True, eq=False)
class LookedAt:
    """Frequencies, as columns of q.

    Attributes
    ----------
    poles : ndarray of complex, shape (q,)
        [rad/s]
    weights : ndarray, shape (q,)
        Displacement of the tool for that of a unit mode, over the measure.
    group : ndarray of int, shape (q,)
        Those of a group, side by side, count together.
    source : ndarray of int, shape (g,)
        The mode of each group, -1 where it is guarded: neighbours with the same source are
        neighbouring frequencies.
    first : ndarray of bool, shape (g,)
        The groups that a design begins with.
    """

    poles: Complex
    weights: Array
    group: Index
    source: Index
    first: NDArray[np.bool_]

    @classmethod
    def of(
        cls, poles: Complex, weights: Array, group: Index, band: float, duration: float
    ) -> LookedAt:
        """Modes over a relative band, for profiles (or ramps) of some duration [s].

        `weights`, shape (m,), are over the measure; groups of several modes, which are spectra,
        have no band.
        """
        single = np.bincount(group, minlength=1)[group] == 1
        half = 0.5 * band * np.abs(poles) * duration
        sides = np.where(single & (band > 0.0), np.maximum(np.ceil(half / DENSE), FEWEST), 0)
        count = 2 * sides.astype(np.int64) + 1
        relative = [np.linspace(1.0 - band, 1.0 + band, n) if n > 1 else np.ones(1) for n in count]
        mode = np.repeat(np.arange(len(poles)), count)
        new = (np.diff(group[mode], prepend=-1) != 0) | single[mode]
        begins = []
        leads = np.diff(group, prepend=-1) != 0
        for n, wide in zip(count[leads], half[leads], strict=True):
            few = 2 * max(int(np.ceil(wide / SPACING)), 1) + 1
            begin = np.zeros(n, dtype=bool)
            begin[np.rint(np.linspace(0, n - 1, min(few, n))).astype(np.int64)] = True
            begins.append(begin)
        return cls(
            poles[mode] * np.concatenate(relative),
            weights[mode],
            np.cumsum(new) - 1,
            group[mode[new]],
            np.concatenate(begins),
        )

    def guarded(self, omega: Array, allowed: Array) -> LookedAt:
        """The same, and guarded frequencies [rad/s] with the response that each may keep [1/s]."""
        count = len(omega)
        last = self.group[-1] + 1 if len(self.group) else 0
        return LookedAt(
            np.concatenate([self.poles, 1j * omega]),
            np.concatenate([self.weights, omega / allowed]),
            np.concatenate([self.group, last + np.arange(count)]),
            np.concatenate([self.source, np.full(count, -1)]),
            np.concatenate([self.first, np.zeros(count, dtype=bool)]),
        )

    def where(self, chosen: NDArray[np.bool_]) -> LookedAt:
        """Some of the groups, which keep their numbers."""
        own = chosen[self.group]
        return LookedAt(
            self.poles[own], self.weights[own], self.group[own], self.source, self.first
        )

    def exceeded(self, left: Array, most: Array) -> NDArray[np.bool_]:
        """Groups that are left with too much: peaks, and some of those that are guarded, (g,).

        `left`, `most`, shape (g,): what each is left with, and what it may be.
        """
        guarded = self.source < 0
        # Guarded frequencies side by side say nearly the same.
        stride = max(8, int(np.count_nonzero(guarded)) // 48)
        sparse = guarded & (np.arange(len(guarded)) % stride == 0)
        exceeded: NDArray[np.bool_] = (left > most) & (self.peaks(left) | sparse)
        return exceeded

    def peaks(self, left: Array) -> NDArray[np.bool_]:
        """Groups that are left with no less than their neighbours of the same source, (g,)."""
        same = np.diff(self.source) == 0
        before = np.append(0.0, np.where(same, left[:-1], 0.0))
        behind = np.append(np.where(same, left[1:], 0.0), 0.0)
        peaks: NDArray[np.bool_] = (left >= before) & (left >= behind)
        return peaks


@dataclass(frozen=True, slots=True, eq=False)
class Blocks:
    """Blocks of a move, and what a unit jerk in each of them leaves at every frequency.

    Attributes
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks. [intervals]
    rows : ndarray, shape (r, k)
        For the unit length in the unit of time.
    cone : ndarray of int, shape (r,)
        Rows that count together, side by side.
    group : ndarray of int, shape (r,)
        The group of each row, of those of `LookedAt`: of one or two cones.
    mirrored, cruise : bool
        As of `socp.Problem`.
    """

    knots: Index
    rows: Array
    cone: Index
    group: Index
    mirrored: bool
    cruise: bool

    @classmethod
    def whole(cls, looked_at: LookedAt, knots: Index, interval: float, halves: bool) -> Blocks:
        """Blocks of a whole move; `halves`: guarded frequencies see its halves in the worst phase.

        Without damping a profile and its mirror image in time (braking first, reversed) leave the
        same, and half of both no more: the optimum can be odd about its middle. Seen from there,
        its response is imaginary.
        """
        count = knots[-1]
        T = count * interval
        undamped = not looked_at.poles.real.any()
        mirrored = undamped and bool(np.all(knots + knots[::-1] == count))
        split = (looked_at.source < 0) & halves
        together, apart = looked_at.where(~split), looked_at.where(split)
        parts = 1 if mirrored else 2
        cone = np.repeat(2 * together.group, parts)
        at = np.arange(len(cone)).reshape(-1, parts)
        early, late, cone_apart = _both_halves(apart, mirrored, len(cone))
        cone = np.concatenate([cone, cone_apart])
        rows = np.zeros((len(cone), len(knots) - 1))
        # Of an odd acceleration, seen from the middle, the imaginary part is all.
        seen = 0.5 * count if mirrored else count
        _write(rows, at, 0, together.poles * T, together.weights, knots, seen, count)
        middle, ends = int(np.searchsorted(knots, 0.5 * count)), knots
        if mirrored and knots[middle] > 0.5 * count:
            # Of a block around the middle each half has its part, and one half is all that is seen.
            middle -= 1
            ends = np.where(np.arange(len(knots)) == middle, 0.5 * count, knots)
        _write_halves(rows, early, late, apart, ends, T, middle, middle)
        return cls(knots, rows, cone, cone // 2, mirrored, False)

    @classmethod
    def ramps(cls, looked_at: LookedAt, ramp: Index, count: int, interval: float) -> Blocks:
        """Blocks of the acceleration, ends at `ramp`, and of its image; between them the cruise."""
        knots = np.concatenate([ramp, count - ramp[::-1]])
        undamped = not looked_at.poles.real.any()
        last = len(ramp) - 1
        early, late, cone = _both_halves(looked_at, undamped, 0)
        rows = np.zeros((len(cone), len(knots) - 1))
        _write_halves(rows, early, late, looked_at, knots, count * interval, last, last + 1)
        return cls(knots, rows, cone, cone // 2, True, True)

    @property
    def owner(self) -> Index:
        """The group of each cone."""
        owner: Index = self.group[np.diff(self.cone, prepend=-1) != 0]
        return owner

    def largest(self, left: Array) -> Array:
        """Of what each cone is left with, what each group is, shape (g,)."""
        largest: Array = np.maximum.reduceat(left, np.flatnonzero(np.diff(self.owner, prepend=-1)))
        return largest

    def left(self, jerk: Array) -> Array:
        """What each group is left with by a jerk in each block, shape (g,)."""
        return self.largest(grouped(np.abs(self.rows @ jerk), self.cone))


def _both_halves(looked_at: LookedAt, alike: bool, first: int) -> tuple[Index, Index, Index]:
    """Rows for both halves of a move, two cones for each group, from row `first` on.

    `alike`: both leave the same, and one of them is enough.

    Returns
    -------
    early, late : ndarray of int, shape (q, 2)
        Rows of the real and the imaginary part of every pole; of `early` none where one is enough.
    cone : ndarray of int, shape (r,)
        Of these rows.
    """
    group = np.repeat(looked_at.group, 2)
    cone = 2 * group if alike else np.concatenate([2 * group, 2 * group + 1])
    order = np.argsort(cone, kind="stable")
    at = np.empty_like(order)
    at[order] = first + np.arange(len(order))
    at = at.reshape(-1, 2)
    early = len(at) - len(looked_at.poles)
    return at[:early], at[early:], cone[order]


def _write_halves(
    rows: Array, early: Index, late: Index, looked_at: LookedAt, knots: Index, T: float,
    end: int, begin: int,
) -> None:  # fmt: skip
    """Write what blocks up to a knot leave then, and at the end those from a knot on.

    Both are times what makes them the sum of both, if they leave the same.
    """
    count, poles = knots[-1], looked_at.poles * T
    weights = looked_at.weights * (1.0 + np.exp(poles.real * (1.0 - knots[end] / count)))
    _write(rows, late, begin, poles, weights, knots[begin:], count, count)
    if len(early):
        _write(rows, early, 0, poles, weights, knots[: end + 1], knots[end], count)


def _write(
    rows: Array, at: Index, begin: int, poles: Complex, weights: Array, knots: Index,
    seen: float, count: int,
) -> None:  # fmt: skip
    """Write what a unit jerk in each block leaves, from column `begin` on.

    `at`, shape (q, 1) or (q, 2): the rows of each pole, for the imaginary part or for both. `knots`
    are the ends of these blocks, and `seen` when it is looked at, of `count` intervals. Poles are
    in units of the move's duration.
    """
    columns = slice(begin, begin + len(knots) - 1)
    sizes, block = np.unique(np.diff(knots), return_inverse=True)
    # A few poles at a time: they stay in the processor's cache.
    for first in range(0, len(poles), AT_ONCE):
        some = slice(first, first + AT_ONCE)
        pole = poles[some, np.newaxis]
        # Blocks have few sizes: what rings from a knot is what does from the next one, and a block.
        ringing = np.empty((len(pole), len(knots)), dtype=np.complex128)
        ringing[:, :1] = np.exp(pole * ((seen - knots[-1]) / count))
        ringing[:, 1:] = np.exp(pole * (sizes / count))[:, block[::-1]]
        np.cumprod(ringing, axis=1, out=ringing)
        gain = weights[some, np.newaxis] / (pole**2 * pole.imag)
        left = np.diff(ringing, axis=1)[:, ::-1] * gain
        rows[at[some, -1], columns] = left.imag
        if at.shape[1] > 1:
            rows[at[some, 0], columns] = left.real
