"""Frequencies at which an optimum is looked at, and the nodes between which they are interpolated.

This module owns, for one move, the dense grid of frequencies: every mode over its band, then those
that `guard` holds down. What `blocks` of jerk leave there is computed at few of them only, the
nodes: seen from the middle of a profile, it changes no faster with the frequency than the profile
is long, and a cubic through four nodes says what lies between them.

Rule: whatever is looked at is in units of a measure that is common to all; of guarded frequencies
it is what they may keep.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]

DENSE, FEWEST = 0.1, 8
"""Distance of the frequencies of a band, times the half of a duration, at which it is looked
at [rad], and how many on each side of its own at least."""
SPACING = 1.0
"""Distance of frequencies, times the half of a duration, at which a design begins. [rad]"""
APART, BREAK = 0.5, 4.0
"""Distance of nodes, times the half of a duration [rad]: a cubic is then wrong by 0.2 % of what is
left around; and of guarded frequencies that have no nodes between them."""
WIDEST = 0.1
"""Distance of nodes at most, as a part of the frequency."""


@dataclass(frozen=True, slots=True, eq=False)
class LookedAt:
    """Frequencies, as columns of q, and n nodes.

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
    nodes : ndarray of complex, shape (n,)
        [rad/s]
    near, share : ndarray of int and of float, shape (q, 4)
        The nodes around each frequency, and how much each of them has of what is left there.
    sparse : ndarray of bool, shape (g,)
        Some of the groups that are guarded: side by side they say nearly the same.
    same : ndarray of bool, shape (g - 1,)
        Groups whose successor has the same source.
    """

    poles: Complex
    weights: Array
    group: Index
    source: Index
    first: Flags
    nodes: Complex
    near: Index
    share: Array
    sparse: Flags
    same: Flags

    @classmethod
    def of(
        cls, poles: Complex, weights: Array, group: Index, band: float, duration: float,
        guarded: tuple[Array, Array] | None = None,
    ) -> LookedAt:  # fmt: skip
        """Modes over a relative band, for profiles (or ramps) of some duration [s].

        `weights`, shape (m,), are over the measure; groups of several modes, which are spectra,
        have no band. `guarded`: frequencies [rad/s] and the response that each may keep [1/s],
        ascending, or one such stretch behind another.
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
        every, weight = poles[mode] * np.concatenate(relative), weights[mode]
        groups, source, first = np.cumsum(new) - 1, group[mode[new]], np.concatenate(begins)
        if guarded is not None:
            omega, allowed = guarded
            count_guarded = len(omega)
            every = np.concatenate([every, 1j * omega])
            weight = np.concatenate([weight, omega / allowed])
            groups = np.concatenate([groups, len(source) + np.arange(count_guarded)])
            source = np.concatenate([source, np.full(count_guarded, -1)])
            first = np.concatenate([first, np.zeros(count_guarded, dtype=bool)])
        guards = source < 0
        stride = max(8, int(np.count_nonzero(guards)) // 48)
        sparse = guards & (np.arange(len(guards)) % stride == 0)
        nodes = _nodes(every, groups, source, duration)
        return cls(every, weight, groups, source, first, *nodes, sparse, np.diff(source) == 0)

    def exceeded(self, left: Array, most: Array) -> Flags:
        """Groups that are left with too much: peaks, and some of those that are guarded, (g,).

        `left`, `most`, shape (g,): what each is left with, and what it may be.
        """
        exceeded: Flags = (left > most) & (self.peaks(left) | self.sparse)
        return exceeded

    def peaks(self, left: Array) -> Flags:
        """Groups that are left with no less than their neighbours of the same source, (g,)."""
        rises = left[1:] > left[:-1]
        falls = left[1:] < left[:-1]
        peaks = np.ones(len(left), dtype=bool)
        peaks[:-1] &= ~(self.same & rises)
        peaks[1:] &= ~(self.same & falls)
        return peaks


def _nodes(
    poles: Complex, group: Index, source: Index, duration: float
) -> tuple[Complex, Index, Array]:
    """Nodes for frequencies, and of each those around it and their shares.

    Guarded ones that follow each other closely have nodes in common. Those of modes are nodes
    themselves: what is left there may be a null of high order, which no cubic follows.
    """
    size, modes = np.abs(poles), int(np.count_nonzero(source[group] >= 0))
    near, share = np.zeros((len(poles), 4), dtype=np.int64), np.zeros((len(poles), 4))
    near[:modes], share[:modes, 0] = np.arange(modes)[:, np.newaxis], 1.0
    nodes, total = [poles[:modes]], modes
    apart = 0.5 * duration * np.diff(size[modes:])
    gaps = np.flatnonzero((apart > BREAK) | (apart < 0.0))
    begins = modes + np.concatenate([[0], gaps + 1, [len(poles) - modes]])
    for begin, end in itertools.pairwise(begins if modes < len(poles) else []):
        some = slice(begin, end)
        low, wide = size[begin], size[end - 1] - size[begin]
        cells = max(int(np.ceil(max(0.5 * duration / APART, 1.0 / (WIDEST * low)) * wide)), 1)
        if end - begin <= cells + 3:
            nodes.append(poles[some])
            near[some] = total + np.arange(end - begin)[:, np.newaxis]
            share[some, 0] = 1.0
        else:
            apart = wide / cells
            nodes.append(poles[begin] / low * (low + apart * np.arange(-1, cells + 2)))
            place = (size[some] - low) / apart
            cell = np.minimum(place.astype(np.int64), cells - 1)
            t = place - cell
            near[some] = total + cell[:, np.newaxis] + np.arange(4)
            share[some] = np.column_stack(
                [
                    -t * (t - 1.0) * (t - 2.0) / 6.0, (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
                    -(t + 1.0) * t * (t - 2.0) / 2.0, (t + 1.0) * t * (t - 1.0) / 6.0,
                ]
            )  # fmt: skip
        total += len(nodes[-1])
    return np.concatenate(nodes), near, share
