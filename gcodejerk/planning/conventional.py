"""What a machine's control does today: the limits and the profiles of its own rapids.

Which profile that is the machine file says (`rapid.planner`) or its control: all that a design is
compared with, T_SUM and the conventional residual, comes from here. A rapid is taken from rest to
rest. Where LinuxCNC rounds the corner between two G0 (G64), it does not come to rest there; the
streams that replace them do, so what is compared is the same move.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, Limits, Machine
from gcodejerk.motion import Profiles, SymmetricProfiles, conventional_profiles
from gcodejerk.motion.profiles.bell import bell_profiles
from gcodejerk.motion.profiles.profile import Array


def todays_profiles(
    machine: Machine, limits: tuple[Array, Array, Array]
) -> tuple[SymmetricProfiles, Profiles]:
    """Profiles of the control's own rapids.

    Parameters
    ----------
    machine : Machine
        Its planner.
    limits : tuple of ndarray, shape (n,)
        Of `conventional_limits`. [1/s], [1/s^2], [1/s^3]

    Returns
    -------
    symmetric : SymmetricProfiles
        The fastest symmetric profiles within these limits: those of the control, but for a bell.
    conventional : Profiles
        Those of the control.
    """
    symmetric = conventional_profiles(*limits)
    return symmetric, bell_profiles(*limits) if machine.planner == BELL else symmetric.general()


def unit_limits(machine: Machine, share: Array) -> tuple[Array, Array, Array]:
    """Limits of unit profiles of a design: each axis's `limit`, divided by its displacement.

    Parameters
    ----------
    machine : Machine
        The machine.
    share : ndarray, shape (n, 9)
        Displacement of each axis. [mm] or [deg]

    Returns
    -------
    velocity, acceleration, jerk : ndarray, shape (n,)
        [1/s], [1/s^2], [1/s^3]
    """
    return _unit({axis.name: axis.limit for axis in machine.axes}, share)


def conventional_limits(
    machine: Machine, share: Array, lone: NDArray[np.bool_] | None = None
) -> tuple[Array, Array, Array]:
    """The same of the controller's own rapids: `Axis.conventional`, divided by the displacement.

    Parameters
    ----------
    machine, share
        As for `unit_limits`.
    lone : ndarray of bool, shape (n,), optional
        No other motion follows directly; all of them by default.
    """
    alone = np.ones(len(share), dtype=bool) if lone is None else lone
    with_all = _unit({axis.name: axis.conventional(lone=False) for axis in machine.axes}, share)
    halved = _unit({axis.name: axis.conventional(lone=True) for axis in machine.axes}, share)
    V, A, J = (np.where(alone, a, b) for a, b in zip(halved, with_all, strict=True))
    return V, A, J


def _unit(limits: Mapping[str, Limits], share: Array) -> tuple[Array, Array, Array]:
    """Limits of axes as those of unit profiles; axes that are not there have none."""
    columns = []
    for quantity in ("velocity", "acceleration", "jerk"):
        axes = np.array([getattr(limits[a], quantity) if a in limits else np.inf for a in AXES])
        with np.errstate(divide="ignore"):
            columns.append((axes / np.abs(share)).min(axis=1, initial=np.inf))
    return columns[0], columns[1], columns[2]


def least_time(displacement: Array, machine: Machine) -> Array:
    """What moves take at least: at full speed, and at full acceleration to the middle.

    Parameters
    ----------
    displacement : ndarray, shape (n, 9)
        Of each axis. [mm] or [deg]
    machine : Machine
        The machine.

    Returns
    -------
    ndarray, shape (n,)
        [s]
    """
    out = np.zeros(len(displacement))
    for axis in machine.axes:
        size = np.abs(displacement[:, AXES.index(axis.name)])
        own = axis.conventional(lone=False)
        out = np.maximum(out, size / own.velocity)
        out = np.maximum(out, 2.0 * np.sqrt(size / own.acceleration))
    return out
