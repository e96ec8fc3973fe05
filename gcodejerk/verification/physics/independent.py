r"""Axes that run on their own: each held to its own start, arrival and profile.

Under `positioning: independent` the path follows from when each axis moves, so a stream in which
one axis is late is another path, though every point of it is between the ends. This module owns:

- an axis stands at its end from the longest time on that its own rapid may take;
- the mean moment of its motion, :math:`\int (1 - x/D)\,dt`, which any delay moves by itself, is
  half of its own time where the profile is symmetric, and in the middle half where not.

Rule: times are those of each axis alone, from the limits of its rapid.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.physics.laws import is_mirrored
from gcodejerk.verification.physics.points import TINY, Array, Paths

Rows = NDArray[np.bool_]
SYMMETRIC = ("conventional", "condition3", "symmetric", "cascade")
"""Profiles whose profiles are their own mirror image."""
MIDDLE = (0.5, 1.5)
"""Share of half the time in which the mean moment of any other profile lies."""


def middle(machine: Machine) -> tuple[float, float]:
    """Where the mean moment of an axis's motion may lie, in halves of its own time."""
    # An axis that would not gain keeps the control's own profile, whatever the others get.
    mirrored = machine.design.profile in SYMMETRIC and is_mirrored(machine)
    low, high = (1.0, 1.0) if mirrored else MIDDLE
    # The shortest profile may take far less than the control's own rapid.
    return (0.0 if machine.design.profile == "shortest" else low), high


def check_axes(
    paths: Paths, machine: Machine, t: Array, usual: Array, most: Array
) -> list[tuple[Kind, Rows, str]]:
    """Judge when each axis moves.

    Parameters
    ----------
    paths : Paths
        The streams.
    machine : Machine
        Its interval and profile.
    t : ndarray, shape (rows,)
        When each point is reached. [s]
    usual, most : ndarray, shape (streams, 9)
        What each axis takes by itself: conventionally, and at most. [s]

    Returns
    -------
    list of tuple
        Kind, rows that break it, and the problem.
    """
    owner = paths.owner
    h = np.diff(t, prepend=t[:1])
    h[paths.begin] = 0.0
    low, high = middle(machine)
    out = []
    for a in np.flatnonzero((paths.displacement != 0.0).any(axis=0)).tolist():
        D = np.abs(paths.displacement[:, a])
        moves = D > 0.0
        size = np.where(moves, D, 1.0)
        step = paths.step[:, a]
        left = np.abs(paths.position[:, a] - (paths.start + paths.displacement)[owner, a])
        own = most[owner, a]
        late = moves[owner] & (t >= own - TINY) & (left > (step + TINY)[owner])
        out.append((Kind.TIME, late, f"{AXES[a]} arrives later than its own rapid may"))
        # Rest at both ends: the trapezoids of all blocks add up to the integral. What an end that
        # is no whole step leaves for the last block belongs to no time of the axis.
        before = np.roll(left, 1)
        area = np.where(t <= own + TINY, 0.5 * (left + before) * h, 0.0)
        mean = np.add.reduceat(area, paths.begin) / size
        error = machine.interval + step / size * most[:, a]
        off = (mean < 0.5 * low * usual[:, a] - error) | (mean > 0.5 * high * most[:, a] + error)
        rows = np.zeros(len(t), dtype=np.bool_)
        rows[paths.begin[moves & off] + 1] = True
        out.append((Kind.TIME, rows, f"{AXES[a]} moves earlier or later than by its own profile"))
    return out
