"""The machine's modes as oscillators, for the residual of a stream.

This module owns what a machine file's modes and spectra come to as columns: a mode is one
oscillator; a measured spectrum is one undamped oscillator for each of its lines, which count
together as the root of their squares' sum.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.verification.physics.points import Array, Index


@dataclass(frozen=True, slots=True, eq=False)
class Oscillators:
    """Columns of m oscillators.

    Attributes
    ----------
    poles : ndarray of complex, shape (m,)
        -zeta omega + j omega_d. [rad/s]
    participation : ndarray, shape (m, 9)
        Of each axis; a spectrum's line has the root of its weight in it. [-]
    group : ndarray of int, shape (m,)
        Mode or spectrum that each belongs to, rising.
    banded : ndarray of bool, shape (m,)
        A mode, whose frequency is known within `design.band` only.
    """

    poles: NDArray[np.complex128]
    participation: Array
    group: Index
    banded: NDArray[np.bool_]

    @classmethod
    def of(cls, machine: Machine) -> Oscillators:
        """All of a machine."""
        rows: list[tuple[float, float, list[float], int, bool]] = []
        group = 0
        for _, mode in machine.all_modes():
            share = [mode.participation_of(axis) for axis in AXES]
            rows.append((mode.frequency, mode.damping, share, group, True))
            group += 1
        for axis in machine.axes:
            if axis.spectrum is None:
                continue
            lines = zip(axis.spectrum.frequency, axis.spectrum.weight, strict=True)
            for frequency, weight in lines:
                amount = axis.spectrum.participation * math.sqrt(weight)
                share = [amount * (name == axis.name) for name in AXES]
                rows.append((frequency, 0.0, share, group, False))
            group += 1
        omega = 2.0 * np.pi * np.array([row[0] for row in rows])
        zeta = np.array([row[1] for row in rows])
        return cls(
            poles=omega * (1j * np.sqrt(1.0 - zeta**2) - zeta),
            participation=np.array([row[2] for row in rows]).reshape(-1, len(AXES)),
            group=np.array([row[3] for row in rows], dtype=np.int64),
            banded=np.array([row[4] for row in rows], dtype=np.bool_),
        )

    def at(self, factor: float) -> Oscillators:
        """The same with the frequency of every mode multiplied, within the band."""
        poles = self.poles * np.where(self.banded, factor, 1.0)
        return Oscillators(poles, self.participation, self.group, self.banded)

    def largest(self, amplitude: Array) -> Array:
        """Largest over modes and spectra of amplitudes, (..., m) -> (...)."""
        if not len(self.group):
            return np.zeros(amplitude.shape[:-1])
        starts = np.flatnonzero(np.diff(self.group, prepend=-1))
        together = np.sqrt(np.add.reduceat(amplitude**2, starts, axis=-1))
        out: Array = together.max(axis=-1)
        return out
