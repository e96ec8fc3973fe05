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

    @property
    def sparse(self) -> NDArray[np.bool_]:
        """Some of the groups: guarded frequencies side by side say nearly the same, shape (g,)."""
        stride = max(8, int(np.count_nonzero(self.source < 0)) // 48)
        sparse: NDArray[np.bool_] = np.arange(len(self.source)) % stride == 0
        return sparse

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
        together = looked_at.where(~split)
        if mirrored:
            rows = _displacements(together, T, 0.5 - knots / count).imag
            group = together.group
        else:
            rows = _parts(_displacements(together, T, 1.0 - knots / count))
            group = np.repeat(together.group, 2)
        cone = 2 * group
        if split.any():
            middle = int(np.searchsorted(knots, 0.5 * count))
            apart, owner = _halves(looked_at.where(split), knots, T, middle, middle, mirrored)
            rows, cone = np.concatenate([rows, apart]), np.concatenate([cone, owner])
        return cls(knots, rows, cone, cone // 2, mirrored, False)

    @classmethod
    def ramps(cls, looked_at: LookedAt, ramp: Index, count: int, interval: float) -> Blocks:
        """Blocks of the acceleration, ends at `ramp`, and of its image; between them the cruise."""
        knots = np.concatenate([ramp, count - ramp[::-1]])
        undamped = not looked_at.poles.real.any()
        last = len(ramp) - 1
        rows, cone = _halves(looked_at, knots, count * interval, last, last + 1, undamped)
        return cls(knots, rows, cone, cone // 2, True, True)

    def left(self, jerk: Array) -> Array:
        """What each group is left with by a jerk in each block, shape (g,)."""
        cones = grouped(np.abs(self.rows @ jerk), self.cone)
        own = self.group[np.diff(self.cone, prepend=-1) != 0]
        left: Array = np.maximum.reduceat(cones, np.flatnonzero(np.diff(own, prepend=-1)))
        return left


def _halves(
    looked_at: LookedAt, knots: Index, T: float, end: int, begin: int, alike: bool
) -> tuple[Array, Index]:
    """Rows of the blocks up to a knot and of those from a knot on, two cones for each group.

    Both are times what makes them the sum of both, if they leave the same. `alike`: they do, and
    one of them is enough.
    """
    count, blocks = knots[-1], len(knots) - 1
    group = np.repeat(looked_at.group, 2)
    both = 1.0 + np.exp(looked_at.poles.real * T * (1.0 - knots[end] / count))[:, np.newaxis]
    late = _parts(_displacements(looked_at, T, 1.0 - knots[begin:] / count) * both)
    late = np.pad(late, ((0, 0), (begin, 0)))
    if alike:
        return late, 2 * group
    early = _parts(_displacements(looked_at, T, (knots[end] - knots[: end + 1]) / count) * both)
    early = np.pad(early, ((0, 0), (0, blocks - end)))
    cone = np.concatenate([2 * group, 2 * group + 1])
    order = np.argsort(cone, kind="stable")
    return np.concatenate([early, late])[order], cone[order]


def _displacements(looked_at: LookedAt, T: float, left: Array) -> Complex:
    """What a unit jerk in each block leaves, the times until then as shares of T, (q, k)."""
    pole = looked_at.poles[:, np.newaxis] * T
    ringing = np.exp(pole * left)
    gain = looked_at.weights[:, np.newaxis] / (pole**2 * pole.imag)
    rows: Complex = (ringing[:, :-1] - ringing[:, 1:]) * gain
    return rows


def _parts(rows: Complex) -> Array:
    """Complex rows as twice as many real ones: real part, imaginary part."""
    parts: Array = np.stack([rows.real, rows.imag], axis=1).reshape(-1, rows.shape[-1])
    return parts
