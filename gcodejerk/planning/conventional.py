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
from gcodejerk.machine import BELL, LAWS, Limits, Machine
from gcodejerk.motion import Profiles, SymmetricProfiles, conventional_profiles
from gcodejerk.motion.families import FAMILIES, Family, Kind, unit_quantities
from gcodejerk.motion.families.family import ACCELERATION, VELOCITY
from gcodejerk.motion.families.filtered import filtered
from gcodejerk.motion.profiles.bell import bell_profiles
from gcodejerk.motion.profiles.profile import Array


def todays_profiles(
    machine: Machine,
    limits: tuple[Array, Array, Array],
    share: Array,
    speed: Array | None = None,
) -> tuple[SymmetricProfiles, Profiles]:
    """Profiles of the control's own rapids.

    Parameters
    ----------
    machine : Machine
        Its planner, and what acts behind it.
    limits : tuple of ndarray, shape (n,)
        Of `conventional_limits`, the speed of the program in them. [1/s], [1/s^2], [1/s^3]
    share : ndarray, shape (n, 9)
        Displacement of each axis. [mm] or [deg]
    speed : ndarray, shape (n,), optional
        Speed that the program states; NaN for none. [1/s]

    Returns
    -------
    symmetric : SymmetricProfiles
        The fastest symmetric profiles within these limits: those of the control, unless it has a
        law or a filter of its own.
    conventional : Profiles
        Those of the control.
    """
    symmetric = conventional_profiles(*limits)
    if machine.planner == BELL:
        conventional = bell_profiles(*limits)
    elif machine.planner in LAWS:
        conventional = law_profiles(machine, FAMILIES[machine.planner], share, speed)
    else:
        conventional = symmetric.general()
    return symmetric, behind_filters(machine, conventional, share)


def law_profiles(
    machine: Machine,
    family: Family,
    share: Array,
    speed: Array | None = None,
    more: Mapping[str, Array] | None = None,
) -> Profiles:
    """Profiles of straight rapids by one law.

    Parameters
    ----------
    machine : Machine
        What its axes' rapids are set to.
    family : Family
        The law.
    share, speed
        As for `todays_profiles`.
    more : mapping of str to ndarray, shape (9,), optional
        Quantities of each axis that the machine file does not state.
    """
    values = {} if more is None else dict(more)
    for quantity in family.quantities:
        if quantity.name not in values:
            values[quantity.name] = _of_axes(machine, quantity.name, quantity.kind)
    unit = unit_quantities(family, values, share)
    along = _over(machine.path.rapid, _way(machine, share))
    for name, limit in zip((VELOCITY.name, ACCELERATION.name), along, strict=False):
        if name in unit:
            unit[name] = np.minimum(unit[name], limit)
    if speed is not None:
        unit[VELOCITY.name] = np.fmin(unit[VELOCITY.name], speed)
    return family.build(**unit)


def _of_axes(machine: Machine, name: str, kind: Kind) -> Array:
    """A quantity of each axis of `AXES`; no limit, or no time, where there is no such axis."""
    out = np.full(len(AXES), np.inf if kind is Kind.LIMIT else 0.0)
    for axis in machine.axes:
        own = dict(axis.law)
        out[AXES.index(axis.name)] = own[name] if name in own else getattr(axis.rapid, name)
    return out


def behind_filters(machine: Machine, profiles: Profiles, share: Array) -> Profiles:
    """Profiles behind the filters of the axes that make them, shape (n, 9) of displacements.

    Axes that move along one line have the same filter: the machine file is held to that.
    """
    own = {axis.name: axis.filter for axis in machine.axes}
    if not any(own.values()):
        return profiles
    first = np.argmax(share != 0.0, axis=1)
    for k in np.unique(first):
        behind = own.get(AXES[k])
        rows = np.flatnonzero(first == k)
        if behind is None:
            continue
        shaped = filtered(profiles.take(rows), behind.kind, behind.setting, behind.damping)
        profiles = profiles.replaced(rows, shaped)
    return profiles


def unit_limits(machine: Machine, share: Array) -> tuple[Array, Array, Array]:
    """Limits of unit profiles of a design: each axis's `limit`, divided by its displacement.

    What bounds the path counts likewise, divided by its length.

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
    own = _unit({axis.name: axis.limit for axis in machine.axes}, share)
    return _least(own, _over(machine.path.limit, _way(machine, share)))


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
    way = _way(machine, share)
    each = []
    for halved in (True, False):
        own = _unit({axis.name: axis.conventional(halved) for axis in machine.axes}, share)
        along = machine.path.of_rapid(halved, machine.planner)
        each.append(_least(own, _over(along, way)))
    V, A, J = (np.where(alone, a, b) for a, b in zip(*each, strict=True))
    return V, A, J


def path_direction(machine: Machine, share: Array) -> Array:
    """Unit vectors of the ways that `path` bounds, shape (n, 9): of the linear axes together.

    0 where only rotary axes move.
    """
    way = _way(machine, share)[:, np.newaxis]
    out: Array = np.where(way > 0.0, _linear(machine) * share / np.where(way > 0.0, way, 1.0), 0.0)
    return out


def _linear(machine: Machine) -> NDArray[np.bool_]:
    """Which of `AXES` the machine has as linear ones, shape (9,)."""
    return np.array([a in machine.axis_names and not machine.axis(a).rotary for a in AXES])


def _way(machine: Machine, share: Array) -> Array:
    """Way of the linear axes together, shape (n,) [mm]."""
    out: Array = np.sqrt((share[:, _linear(machine)] ** 2).sum(axis=1))
    return out


def _over(limits: Limits, way: Array) -> tuple[Array, Array, Array]:
    """Limits of the path as those of unit profiles."""
    with np.errstate(divide="ignore"):
        return limits.velocity / way, limits.acceleration / way, limits.jerk / way


def _least(
    a: tuple[Array, Array, Array], b: tuple[Array, Array, Array]
) -> tuple[Array, Array, Array]:
    V, A, J = (np.minimum(p, q) for p, q in zip(a, b, strict=True))
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
