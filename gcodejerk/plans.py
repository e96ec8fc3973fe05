"""Plans: what was decided for many moves at once, as columns of moves and of laws.

A move along a straight line has one law, which every axis follows in proportion to its
displacement. Under `positioning: independent` each axis has a law of its own. Both are the same
thing here: a law has a *share*, the displacement of every axis that it carries.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import AXES, Machine, Mode
from gcodejerk.motion import Laws, mode_poles
from gcodejerk.motion.laws import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.reasons import CERTAIN


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """A machine's modes as columns.

    Attributes
    ----------
    labels : tuple of str
        The axes that excite each: `Z`, or `Y+Z`.
    modes : tuple of Mode
        The modes themselves.
    poles : ndarray of complex, shape (m,)
        [rad/s]
    participation : ndarray, shape (m, 9)
        Of each axis of `AXES`. [-]
    """

    labels: tuple[str, ...]
    modes: tuple[Mode, ...]
    poles: Complex
    participation: Array

    @classmethod
    def of(cls, machine: Machine) -> Modes:
        """The modes of a machine."""
        pairs = machine.all_modes()
        modes = tuple(mode for _, mode in pairs)
        poles = mode_poles([mode.frequency for mode in modes], [mode.damping for mode in modes])
        participation = np.array(
            [[mode.participation_of(axis) for axis in AXES] for mode in modes], dtype=float
        ).reshape(len(modes), len(AXES))
        return cls(tuple(label for label, _ in pairs), modes, poles, participation)


@dataclass(frozen=True, slots=True, eq=False)
class Plans:
    """Planned moves: columns of n moves, and of the l laws that they follow.

    Attributes
    ----------
    machine : Machine
        What they were planned for.
    modes : Modes
        Its modes.
    reason : ndarray of uint8, shape (n,)
        CERTAIN, or the index in `REASONS` of why the move is not planned; it then has no law.
    displacement : ndarray, shape (n, 9)
        Of each axis. [mm] or [deg]
    length : ndarray, shape (n,)
        Along the path. [mm], or [deg] where only rotary axes move
    conventional_time : ndarray, shape (n,)
        What the controller's own G0 takes. [s]
    counts : ndarray of int, shape (n,)
        T_SUM; 0 where the move is not planned. [intervals]
    move : ndarray of int, shape (l,)
        The move of each law, ascending.
    share : ndarray, shape (l, 9)
        Displacement of each axis that the law carries. [mm] or [deg]
    laws, conventional : Laws
        The designed laws, and those of the controller's own G0.
    law_counts : ndarray of int, shape (l,)
        T_SUM of each law. [intervals]
    kept : ndarray of bool, shape (l,)
        The law is the conventional one, because none is better.
    """

    machine: Machine
    modes: Modes
    reason: NDArray[np.uint8]
    displacement: Array
    length: Array
    conventional_time: Array
    counts: NDArray[np.int64]
    move: NDArray[np.int64]
    share: Array
    laws: Laws
    conventional: Laws
    law_counts: NDArray[np.int64]
    kept: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.reason)

    @property
    def planned(self) -> NDArray[np.bool_]:
        """Which moves are planned, shape (n,)."""
        planned: NDArray[np.bool_] = self.reason == CERTAIN
        return planned

    def profile(self, law: int) -> str:
        """Name of the profile that a law follows."""
        return "conventional" if self.kept[law] else "condition3"

    def laws_of(self, move: int) -> range:
        """The laws of a move."""
        begin, end = np.searchsorted(self.move, [move, move + 1])
        return range(int(begin), int(end))
