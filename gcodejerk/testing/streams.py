"""Moves to draw, and the rules that every stream has to keep on a given machine.

The checks here look at the written numbers alone, times and positions; how they were planned plays
no part. They are what `gcodejerk`'s own property tests use.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from gcodejerk.machine import Axis, Machine

Array = NDArray[np.float64]


class Stream(Protocol):
    """What `assert_stream_valid` looks at; a `Plan` is one."""

    @property
    def t(self) -> Array:
        """Moments, shape (n,) [s]."""
        ...

    @property
    def positions(self) -> Mapping[str, Array]:
        """Position of each axis, shape (n,) each [mm] or [deg]."""
        ...


def moves(
    machine: Machine | None = None, shortest: float = 0.05, longest: float = 400.0
) -> st.SearchStrategy[dict[str, float]]:
    """Moves of one or more axes of a machine.

    Parameters
    ----------
    machine : Machine, optional
        Whose axes move; X, Y and Z where left out.
    shortest, longest : float
        Least and greatest displacement of an axis that moves. [mm] or [deg]

    Returns
    -------
    SearchStrategy
        Of mappings such as ``{"X": 12.5, "Z": -1.0}``, never empty.
    """
    size = st.floats(np.log(shortest), np.log(longest)).map(lambda x: round(float(np.exp(x)), 4))
    length = st.builds(lambda x, sign: x * sign, size, st.sampled_from((-1.0, 1.0)))
    names = ("X", "Y", "Z") if machine is None else machine.axis_names
    axes = st.sets(st.sampled_from(names), min_size=1)
    return axes.flatmap(lambda some: st.fixed_dictionaries({a: length for a in sorted(some)}))


def assert_stream_valid(stream: Stream, machine: Machine) -> None:
    """Check a stream against a machine: times, rest, line, monotony, limits.

    Parameters
    ----------
    stream : Stream
        From its exact start to its exact end.
    machine : Machine
        Whose resolution, interval and limits hold.

    Raises
    ------
    AssertionError
        With the axis, the moment and the number that is wrong.
    """
    t, positions = np.asarray(stream.t), stream.positions
    dt = machine.interval
    assert t[0] == 0.0, f"the stream starts at {t[0]} s, not at 0"
    assert np.allclose(t, np.arange(len(t)) * dt, atol=1e-9), "times are not whole intervals"
    unknown = set(positions) - set(machine.axis_names)
    assert not unknown, f"axes {sorted(unknown)} are not the machine's"
    for name, q in positions.items():
        _assert_axis(machine.axis(name), np.asarray(q), dt)
    if machine.positioning == "linear":
        _assert_straight({a: np.asarray(q) for a, q in positions.items()}, machine)
        _assert_path({a: np.asarray(q) for a, q in positions.items()}, machine)


def _assert_axis(axis: Axis, q: Array, dt: float) -> None:
    """One axis: it never turns back and keeps its limits, but for the rounding of positions."""
    moved = q[-1] - q[0]
    steps = np.diff(q) * np.sign(moved if moved else 1.0)
    # Between ends that are off the grid of the resolution a step may lie a little beyond an end.
    assert steps.min(initial=0.0) >= -1e-9, (
        f"axis {axis.name} turns back by {-steps.min():.3g} at sample {steps.argmin() + 1}"
    )
    limit = axis.limit
    error = 2.0 * axis.resolution
    velocity = np.abs(steps) / dt
    # Positions are rounded so that no interval has a whole step more than the limit gives it.
    assert velocity.max(initial=0.0) <= limit.velocity * (1 + 1e-6) + axis.resolution / dt, (
        f"axis {axis.name} reaches {velocity.max():.6g} of velocity, limit {limit.velocity:.6g}"
    )
    # A second difference of samples is a mean of the acceleration, so it keeps the same limit.
    acceleration = np.abs(np.diff(steps, prepend=0.0, append=0.0)) / dt**2
    allowed = limit.acceleration * (1 + 1e-6) + 2.0 * error / dt**2
    assert acceleration.max(initial=0.0) <= allowed, (
        f"axis {axis.name} reaches {acceleration.max():.6g} of acceleration, limit "
        f"{limit.acceleration:.6g}"
    )
    if np.isfinite(limit.jerk):
        jerk = np.abs(np.diff(steps, n=2, prepend=[0.0, 0.0], append=[0.0, 0.0])) / dt**3
        allowed = limit.jerk * (1 + 1e-6) + 4.0 * error / dt**3
        assert jerk.max(initial=0.0) <= allowed, (
            f"axis {axis.name} reaches {jerk.max():.6g} of jerk, limit {limit.jerk:.6g}"
        )


def _assert_path(positions: Mapping[str, Array], machine: Machine) -> None:
    """The linear axes together keep what bounds the path."""
    dt, most = machine.interval, machine.path.limit
    slides = [axis for axis in positions if not machine.axis(axis).rotary]
    steps = np.sqrt(sum((np.diff(positions[a]) ** 2 for a in slides), start=np.zeros(1)))
    error = 2.0 * sum(machine.axis(a).resolution for a in slides)
    velocity = steps.max(initial=0.0) / dt
    assert velocity <= most.velocity * (1 + 1e-6) + error / dt, (
        f"the path reaches {velocity:.6g} of velocity, limit {most.velocity:.6g}"
    )
    acceleration = np.abs(np.diff(steps, prepend=0.0, append=0.0)).max(initial=0.0) / dt**2
    assert acceleration <= most.acceleration * (1 + 1e-6) + 2.0 * error / dt**2, (
        f"the path reaches {acceleration:.6g} of acceleration, limit {most.acceleration:.6g}"
    )


def _assert_straight(positions: Mapping[str, Array], machine: Machine) -> None:
    """Every point lies on the line between the ends, within a step of each axis's resolution."""
    moved = {axis: float(q[-1] - q[0]) for axis, q in positions.items()}
    longest = max(moved, key=lambda axis: abs(moved[axis]))
    if moved[longest] == 0.0:
        return
    share = (positions[longest] - positions[longest][0]) / moved[longest]
    for axis, q in positions.items():
        slope = abs(moved[axis] / moved[longest])
        allowed = machine.axis(axis).resolution + slope * machine.axis(longest).resolution
        off = np.abs(q - q[0] - share * moved[axis])
        assert off.max() <= allowed * (1 + 1e-6) + 1e-9, (
            f"axis {axis} is {off.max():.3g} off the line at sample {off.argmax()}"
        )
