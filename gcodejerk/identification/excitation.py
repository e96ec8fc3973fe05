"""Which rapids make a machine ring at whatever frequency its modes have.

A rapid of one length leaves frequencies alone whose periods fit its ramps, so one length shows some
modes and hides others. The lengths are chosen so that at every frequency of the band at least one
of them leaves much of what the best length for it would: greedily, the worst frequency first, by
the law of the control's own rapid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import mode_poles
from gcodejerk.planning.conventional import conventional_limits, todays_profiles

BAND = (5.0, 150.0)
"""Frequencies that are to ring [Hz]."""
FREQUENCIES, LENGTHS = 120, 60
DAMPING = 0.02
SHORTEST = 1.0
"""Of the rapids to choose from. [mm] or [deg]"""


@dataclass(frozen=True, slots=True)
class Excitation:
    """The rapids of one axis."""

    axis: str
    length: tuple[float, ...]
    """Rising. [mm] or [deg]"""
    time: tuple[float, ...]
    """That the control's own rapids take. [s]"""
    least: float
    """At the worst frequency of the band, what the best of these lengths leaves, over what the best
    of all lengths would. [-]"""


def excitation(machine: Machine, axis: str, room: float, count: int) -> Excitation:
    """Lengths of rapids that together ring at every frequency of `BAND`.

    Parameters
    ----------
    machine : Machine
        Its own rapids.
    axis : str
        One of its axes.
    room : float
        The longest length. [mm] or [deg]
    count : int
        How many lengths.

    Returns
    -------
    Excitation
        Whole tenths of mm (or deg).

    Raises
    ------
    PlanError
        There is less room than the shortest rapid needs.
    """
    if room <= SHORTEST:
        raise PlanError(
            f"room of {room:g} is too little for axis {axis}", f"give more than {SHORTEST:g}"
        )
    lengths = np.unique(np.geomspace(SHORTEST, room, LENGTHS).round(1))
    lengths = lengths[lengths <= room]
    amplitude, times = _amplitudes(machine, axis, lengths)
    chosen: list[int] = []
    best = np.zeros(amplitude.shape[1])
    amplitude = amplitude / amplitude.max(axis=0)
    for _ in range(min(count, len(lengths))):
        reached = np.maximum(best, amplitude)
        # The worst frequency first; among equals the one that lifts the whole band.
        score = reached.min(axis=1) + 1e-3 * reached.mean(axis=1)
        score[chosen] = -1.0
        k = int(score.argmax())
        chosen.append(k)
        best = reached[k]
    order = sorted(chosen)
    return Excitation(
        axis,
        tuple(lengths[order].tolist()),
        tuple(times[order].tolist()),
        float(best.min()),
    )


def _amplitudes(machine: Machine, axis: str, lengths: Array) -> tuple[Array, Array]:
    """Acceleration amplitudes, shape (lengths, frequencies) [mm/s^2], and times [s]."""
    share = np.zeros((len(lengths), len(AXES)))
    share[:, AXES.index(axis)] = lengths
    lone = np.ones(len(lengths), dtype=np.bool_)
    _, profiles = todays_profiles(machine, conventional_limits(machine, share, lone), share)
    f = np.linspace(*BAND, FREQUENCIES)
    poles = mode_poles(f, np.full(len(f), DAMPING))
    response = np.abs(profiles_response(profiles, poles)) * lengths[:, np.newaxis]
    omega_d = poles.imag
    # Of the oscillator's displacement (response / omega_d), its acceleration.
    amplitude: Array = response / omega_d * (2.0 * np.pi * f) ** 2
    return amplitude, profiles.total
