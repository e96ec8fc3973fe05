"""The rapids of a shop's programs, as what settings are chosen for: distinct moves, their weight.

This module owns what counts as one and the same rapid (axes that move as far, either way), how
often it occurs, and how often a cut follows it: a rapid that another rapid follows at once may
shake.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Rapids
from gcodejerk.planning.plans import STANDSTILL, path_length
from gcodejerk.reasons import CERTAIN

BETWEEN = 256
"""Bytes between two rapids that are looked at; what is farther apart has something between. [bytes]
"""
_NOTHING = re.compile(rb"\([^()\n]*\)|;[^\n]*|\bN[0-9]+|\s+|%")


@dataclass(frozen=True, slots=True, eq=False)
class Moves:
    """Distinct rapids.

    Attributes
    ----------
    displacement : ndarray, shape (n, 9)
        [mm] or [deg]
    count : ndarray, shape (n,)
        How often it occurs.
    cut : ndarray, shape (n,)
        How often it is not followed by another rapid at once.
    speed : ndarray, shape (n,)
        That the program states for it; infinite where rapids run as fast as the axes allow. [mm/s]
    """

    displacement: Array
    count: Array
    cut: Array
    speed: Array

    def __len__(self) -> int:
        return len(self.displacement)

    def take(self, index: NDArray[np.intp]) -> Moves:
        """Some of the moves."""
        return Moves(
            self.displacement[index], self.count[index], self.cut[index], self.speed[index]
        )

    @classmethod
    def of(
        cls, displacement: Array, cut: NDArray[np.bool_], speed: Array, machine: Machine
    ) -> Moves:
        """Distinct moves among n, shapes (n, 9), (n,) and (n,).

        Raises
        ------
        PlanError
            Nothing moves.
        """
        step = np.ones(len(AXES))
        for axis in machine.axes:
            step[AXES.index(axis.name)] = axis.resolution
        whole = np.round(displacement / step).astype(np.int64)
        # Backwards is the same move: the first axis that moves goes forwards.
        leading = whole[np.arange(len(whole)), (whole != 0).argmax(axis=1)]
        signed = whole * np.where(leading < 0, -1, 1)[:, np.newaxis]
        length = path_length(signed * step, machine)
        used = (whole != 0).any(axis=1)
        used &= length >= machine.design.minimum_length * (1.0 - 1e-9)
        if not used.any():
            raise PlanError(
                "there is no rapid whose way is known: nothing to tune for",
                "give programs with rapids (`gcodejerk inspect FILE` shows why they are left "
                "alone), or lengths: --lengths 1:500",
            )
        rows = np.column_stack([signed * step, speed])[used]
        distinct, which = np.unique(rows, axis=0, return_inverse=True)
        weight = cut[used].astype(np.float64)
        count = np.bincount(which.ravel(), minlength=len(distinct)).astype(np.float64)
        needed = np.bincount(which.ravel(), weights=weight, minlength=len(distinct))
        needed = needed.astype(np.float64)
        return cls(distinct[:, :-1], count, np.asarray(needed), distinct[:, -1])

    @classmethod
    def of_lengths(cls, lengths: Sequence[float], machine: Machine) -> Moves:
        """The same lengths on every axis that has a mode."""
        shaken = sorted({axis for _, mode in machine.all_modes() for axis in mode.axes})
        shaken += [axis.name for axis in machine.axes if axis.spectrum is not None]
        rows = np.zeros((len(shaken) * len(lengths), len(AXES)))
        for k, axis in enumerate(shaken):
            rows[k * len(lengths) : (k + 1) * len(lengths), AXES.index(axis)] = lengths
        if not shaken:
            raise PlanError(
                f"{machine.source} describes no mode: there is nothing to tune against",
                "describe modes in the machine file (axes.?.modes, or modes of the structure)",
            )
        return cls.of(rows, np.ones(len(rows), dtype=bool), np.full(len(rows), np.inf), machine)


Part = tuple[Array, NDArray[np.bool_], Array]
"""Displacements, whether a cut follows, and speeds of one program's rapids."""


def program_moves(rapids: Rapids, source: BinaryIO, machine: Machine) -> Part:
    """What the rapids of one program move, and whether something else than a rapid follows.

    Parameters
    ----------
    rapids : Rapids
        Of the program.
    source : BinaryIO
        The program, seekable.
    machine : Machine
        Axes that it does not have are not looked at.

    Returns
    -------
    displacement : ndarray, shape (n, 9)
        Of the certain ones. [mm] or [deg]
    cut : ndarray of bool, shape (n,)
    speed : ndarray, shape (n,)
        As in `Moves`. [mm/s]
    """
    known = np.array([axis in machine.axis_names for axis in AXES])
    named = (rapids.words[:, np.newaxis] >> np.arange(len(AXES))) & 1 != 0
    moved = np.where(named & known, rapids.target - rapids.start, 0.0)
    usable = (rapids.reason == CERTAIN) & np.isfinite(moved).all(axis=1)
    usable &= (np.abs(moved) > STANDSTILL).any(axis=1)
    cut = np.ones(len(rapids), dtype=bool)
    gap = rapids.begin[1:] - rapids.end[:-1]
    for i in np.flatnonzero(usable[:-1] & (gap >= 0) & (gap <= BETWEEN)).tolist():
        source.seek(int(rapids.end[i]))
        between = source.read(int(gap[i]))
        cut[i] = bool(_NOTHING.sub(b"", between))
    speed = np.where(np.isnan(rapids.speed), np.inf, rapids.speed)
    return moved[usable], cut[usable], speed[usable]


def joined_moves(parts: Iterable[Part], machine: Machine) -> Moves:
    """The distinct moves of several programs; PlanError where there are none."""
    nothing = (np.zeros((1, len(AXES))), np.zeros(1, dtype=bool), np.full(1, np.inf))
    moved, cut, speed = (np.concatenate(column) for column in zip(nothing, *parts, strict=True))
    return Moves.of(moved, cut, speed, machine)
