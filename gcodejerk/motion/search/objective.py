"""What a design is judged by: the largest residual displacement of the tool.

This module owns the objective of many moves at once: the machine's modes, how strongly each move
excites each of them, and which of them count together.

Rule: what is compared is the displacement of the tool, so each mode has a weight: its
participation times the displacement of the axes that excite it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles
from gcodejerk.motion.residual import Complex, grouped, profiles_response, symmetric_response

DENSE = 0.06
"""Distance of frequencies, times T_SUM/2, at which a band is judged at most: the largest residual
between two of them is larger by less than 0.1 % of the largest there is anywhere. [rad]"""
FEWEST = 10
"""Frequencies on each side of a mode's own at least."""
JUDGED, JUDGED_FEWEST = 0.2, 4
"""The same two for judging a plan: right to 0.5 % of the largest residual anywhere."""


@dataclass(frozen=True, slots=True, eq=False)
class Objective:
    """The largest residual displacement, for n moves and m modes.

    Attributes
    ----------
    poles : ndarray of complex, shape (m,)
        Of the modes, from `mode_poles`. [rad/s]
    weights : ndarray, shape (n, m)
        Participation times displacement. [mm]
    group : ndarray of int, shape (m,)
        As in `grouped`.
    first_look : ndarray of bool, shape (m,), or None
        Those that a search may begin with; None for all.
    """

    poles: Complex
    weights: Array
    group: NDArray[np.int64]
    first_look: NDArray[np.bool_] | None = None

    @classmethod
    def of_modes(cls, poles: Complex, weights: Array) -> Objective:
        """Every mode a group of its own."""
        return cls(poles, weights, np.arange(len(poles)))

    def __len__(self) -> int:
        return len(self.weights)

    def take(self, index: NDArray[np.integer] | NDArray[np.bool_] | slice) -> Objective:
        """Some of the moves; one may stand several times."""
        return Objective(self.poles, self.weights[index], self.group, self.first_look)

    def excited(self) -> Objective:
        """The same moves, without the modes that none of them excites."""
        used = self.weights.any(axis=0)
        _, group = np.unique(self.group[used], return_inverse=True)
        return Objective(self.poles[used], self.weights[:, used], group)

    def rough(self) -> Objective:
        """The same moves, where a first look is enough."""
        if self.first_look is None:
            return self
        some = self.first_look
        _, group = np.unique(self.group[some], return_inverse=True)
        return Objective(self.poles[some], self.weights[:, some], group)

    def in_band(
        self, band: float, total: float, dense: float = DENSE, fewest: int = FEWEST
    ) -> Objective:
        """The same moves, every mode at many frequencies within a relative band.

        Parameters
        ----------
        band : float
            Relative error of the frequencies. [-]
        total : float
            Duration of the longest move: residuals of longer moves change faster with the
            frequency. [s]
        dense : float
            Distance of the frequencies at most, times T_SUM/2. [rad]
        fewest : int
            Frequencies on each side of a mode's own at least.

        Returns
        -------
        Objective
            Groups of several modes have no band: they are spectra, which are broad by themselves.
            A first look is at every second frequency of a band, both ends among them.
        """
        size = np.bincount(self.group, minlength=1)[self.group]
        half = np.ceil(0.5 * band * np.abs(self.poles) * total / dense).astype(np.int64)
        half = np.where((size == 1) & (band > 0.0), np.maximum(half, fewest), 0)
        count = 2 * half + 1
        relative = [np.linspace(1.0 - band, 1.0 + band, n) if n > 1 else np.ones(1) for n in count]
        index = np.repeat(np.arange(len(self.poles)), count)
        new = np.diff(np.repeat(self.group, count), prepend=-1) != 0
        return Objective(
            self.poles[index] * np.concatenate([np.zeros(0), *relative]),
            self.weights[:, index],
            np.cumsum(new | (size[index] == 1)) - 1,
            np.concatenate([np.zeros(0, dtype=bool), *(np.arange(n) % 2 == 0 for n in count)]),
        )

    def worst(self, displacement: Array) -> Array:
        """Largest over the groups, of envelopes for weight 1.

        Parameters
        ----------
        displacement : ndarray, shape (n, ..., m)
            Envelope of each mode for a weight of 1. [-]

        Returns
        -------
        ndarray, shape (n, ...)
            [mm]
        """
        between = tuple(range(1, displacement.ndim - 1))
        weighted = displacement * np.expand_dims(self.weights, between)
        worst: Array = grouped(weighted, self.group).max(axis=-1, initial=0.0)
        return worst

    def dominant(self, profiles: Profiles) -> NDArray[np.intp]:
        """The mode whose residual displacement is largest, for each of n profiles, shape (n,)."""
        displacement = np.abs(profiles_response(profiles, self.poles)) / self.poles.imag
        mode: NDArray[np.intp] = np.argmax(displacement * self.weights, axis=1)
        return mode

    def of(self, profiles: Profiles | SymmetricProfiles) -> Array:
        """Largest residual displacement of n unit profiles, one for each move, shape (n,) [mm]."""
        if isinstance(profiles, Profiles):
            response = profiles_response(profiles, self.poles)
        else:
            response = symmetric_response(profiles, self.poles)
        return self.worst(np.abs(response) / self.poles.imag)
