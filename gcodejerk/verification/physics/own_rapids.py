"""The controller's own rapids as verification judges them: their limits, and how long they take.

Rule: times are whole intervals, the designs' and the own ones alike; who takes longer than the
machine file allows is refused elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import BELL, FREE, LINUXCNC, LONE_SHARE, Machine
from gcodejerk.verification.physics.conventional import Boxes, rapid_time
from gcodejerk.verification.physics.laws import OwnRapids, has_law
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.points import LINEAR, Array, Index, Paths

ON_GRID = 1e-6
"""A time this little off a whole number of intervals is that number. [intervals]"""


def rapid_limits(paths: Paths, machine: Machine) -> Array:
    """Limits of the controller's own rapid over the displacement, shape (3, moves, 9)."""
    rapid = np.full((3, len(AXES)), np.inf)
    for axis in machine.axes:
        own = axis.conventional(lone=False)
        rapid[:, AXES.index(axis.name)] = own.velocity, own.acceleration, own.jerk
    with np.errstate(divide="ignore"):
        out: Array = rapid[:, np.newaxis, :] / np.abs(paths.displacement)
        if machine.planner == LINUXCNC:
            out[1] *= np.where(paths.lone, LONE_SHARE, 1.0)[:, np.newaxis]
        # A rapid that runs at F does so along its path, in which all axes share.
        length = np.sqrt((paths.displacement[:, LINEAR] ** 2).sum(axis=1))
        out[0] = np.fmin(out[0], (paths.speed / length)[:, np.newaxis])
        halved = np.where(paths.lone & (machine.planner == LINUXCNC), LONE_SHARE, 1.0)
        way, most = path_way(paths.displacement, machine), machine.path.rapid
        out[0] = np.minimum(out[0], (most.velocity / way)[:, np.newaxis])
        out[1] = np.minimum(out[1], (halved * most.acceleration / way)[:, np.newaxis])
    return out


def path_way(displacement: Array, machine: Machine) -> Array:
    """Way along which the control bounds the path, shape (moves,) [mm]: of the linear axes."""
    slides = [axis.name for axis in machine.axes if not axis.rotary]
    squares = sum((displacement[:, AXES.index(name)] ** 2 for name in slides), start=np.zeros(1))
    way: Array = np.sqrt(np.broadcast_to(squares, len(displacement)))
    return way


def path_direction(displacement: Array, machine: Machine) -> Array:
    """Unit vectors of the path that the control bounds, shape (moves, 9); 0 where it bounds none.

    Of the linear axes.
    """
    slides = np.array([a in machine.axis_names and not machine.axis(a).rotary for a in AXES])
    way = path_way(displacement, machine)[:, np.newaxis]
    moves = way > 0.0
    out: Array = np.where(moves & slides, displacement / np.where(moves, way, 1.0), 0.0)
    return out


def limits_of(displacement: Array, machine: Machine) -> Array:
    """Velocity, acceleration and jerk that a design may use of each axis, shape (3, moves, 9).

    Infinite without axis, and the jerk of one without a limit of it: its acceleration alone is
    bounded. On a straight line an axis has its part of what bounds the path.
    """
    each: Array = np.repeat(axis_limits(machine)[:, np.newaxis, :], len(displacement), axis=1)
    if machine.path != FREE:
        most = machine.path.limit
        part = np.abs(path_direction(displacement, machine))
        part = np.where(part > 0.0, part, np.inf)
        each[0] = np.minimum(each[0], part * most.velocity)
        each[1] = np.minimum(each[1], part * most.acceleration)
    return each


def axis_limits(machine: Machine) -> Array:
    """The limits of each axis by itself, shape (3, 9); infinite without axis."""
    out = np.full((3, len(AXES)), np.inf)
    for axis in machine.axes:
        limit = axis.limit
        out[:, AXES.index(axis.name)] = limit.velocity, limit.acceleration, limit.jerk
    return out


def conventional_counts(paths: Paths, machine: Machine) -> tuple[Index, Index]:
    """Whole intervals that rapids take conventionally, and those that they may take at most."""
    return _whole_counts(_own_time(paths, machine), paths, machine)


def longest_times(paths: Paths, machine: Machine) -> Array:
    """What rapids may take at most that need not end with an interval, shape (moves,) [s]."""
    total = _own_time(paths, machine)
    _, most = _whole_counts(total, paths, machine)
    longer = (1.0 + machine.design.max_extension) * total
    return np.asarray(np.maximum(most * machine.interval, longer))


def _whole_counts(total: Array, paths: Paths, machine: Machine) -> tuple[Index, Index]:
    """`conventional_counts` of what the control's own rapids take."""
    usual = np.maximum(np.ceil(total / machine.interval - ON_GRID), 1.0)
    longest = np.floor(total * (1.0 + machine.design.max_extension) / machine.interval + ON_GRID)
    if machine.design.profile == "shortest":
        longest = np.maximum(longest, _longest(total, paths.displacement, machine))
    most = np.maximum(usual, longest)
    return usual.astype(np.int64), most.astype(np.int64)


def _own_time(paths: Paths, machine: Machine) -> Array:
    """What the control's own rapids take, until the last axis arrives, shape (moves,) [s]."""
    displacement = paths.displacement
    limits = rapid_limits(paths, machine)
    if has_law(machine):
        each = OwnRapids(displacement, machine, limits).totals()
        return np.asarray(each.max(axis=1, initial=0.0))
    return _move_time(limits, displacement, machine, machine.planner == BELL)


def _move_time(limits: Array, displacement: Array, machine: Machine, bell: bool = False) -> Array:
    """Duration [s] of the fastest symmetric moves within limits, shape (3, moves, 9)."""
    if machine.positioning == "linear":
        return rapid_time(*limits.min(axis=2), bell=bell)
    total: Array = _axis_times(limits, displacement, bell).max(axis=1, initial=0.0)
    return total


def _axis_times(limits: Array, displacement: Array, bell: bool = False) -> Array:
    """The same for each axis by itself, shape (moves, 9)."""
    moving = displacement != 0.0
    each = np.zeros(displacement.shape)
    each[moving] = rapid_time(*limits[:, moving], bell=bell)
    return each


def own_times(paths: Paths, machine: Machine) -> tuple[Array, Array]:
    """What each axis takes by itself [s], shape (moves, 9): conventionally, and at most."""
    dt, displacement = machine.interval, paths.displacement
    limits = rapid_limits(paths, machine)
    if has_law(machine):
        each = OwnRapids(displacement, machine, limits).totals()
    else:
        each = _axis_times(limits, displacement, machine.planner == BELL)
    usual = np.ceil(each / dt - ON_GRID)
    longest = np.floor(each * (1.0 + machine.design.max_extension) / dt + ON_GRID)
    if machine.design.profile == "shortest":
        alone = _axis_times(_own_limits(displacement, machine), displacement)
        settled = np.ceil((np.maximum(each, alone) + 2.0 * _periods(machine)) / dt)
        longest = np.maximum(longest, settled)
    return usual * dt, np.maximum(usual, longest) * dt


def left_by_rapids(
    displacement: Array, machine: Machine, limits: Array
) -> Callable[[Oscillators], NDArray[np.complex128]]:
    """What the controller's own rapids leave of modes, exactly.

    Parameters
    ----------
    displacement : ndarray, shape (moves, 9)
        [mm] or [deg]
    machine : Machine
        Its planner, its filters, and whether its axes move together.
    limits : ndarray, shape (3, moves, 9)
        Of `rapid_limits`.

    Returns
    -------
    callable
        Oscillators -> complex vibration, shape (moves, m). [mm]
    """
    if has_law(machine):
        return OwnRapids(displacement, machine, limits).left
    if machine.positioning == "linear":
        limits = np.repeat(limits.min(axis=2)[:, :, np.newaxis], len(AXES), axis=2)
    return Boxes.of(displacement, limits, bell=machine.planner == BELL).response


def _own_limits(displacement: Array, machine: Machine) -> Array:
    """Limits of designs over the displacement, shape (3, moves, 9)."""
    with np.errstate(divide="ignore"):
        V, A, J = limits_of(displacement, machine) / np.abs(displacement)
    # A design's acceleration rises for an interval at least.
    return np.stack([V, A, np.minimum(J, A / machine.interval)])


def _periods(machine: Machine) -> float:
    """One period of every mode, one behind the other, in s."""
    return float((2.0 * np.pi / Oscillators.of(machine).poles.imag).sum())


def _longest(total: Array, displacement: Array, machine: Machine) -> Array:
    """Intervals after which a rapid of the profile `shortest` is settled in any case.

    Two periods of every mode are enough to leave it at rest, whatever it does before; the time
    itself is that of the controller, or the least that the limits allow where that is longer.
    """
    fastest = _move_time(_own_limits(displacement, machine), displacement, machine)
    time = np.maximum(total, fastest) + 2.0 * _periods(machine)
    longest: Array = np.ceil(time / machine.interval)
    return longest
