"""Cubics between rows against the limits: of each axis by itself, and of the path they share.

The path is judged along the straight line of its linear axes, not by each axis's part in it:
rounded numbers move an axis of a small part by as much as any other, and the path hardly feels it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import FREE, Machine
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.physics.own_rapids import axis_limits, path_direction
from gcodejerk.verification.physics.points import Array, Index
from gcodejerk.verification.rows.motion import Pieces

WITHIN = 1e-8
"""Share by which a number may pass a limit: float64 of decimal numbers."""
MOST_BLUR = 0.05
"""Share of a limit of velocity or acceleration that rounding is an excuse for."""
_KINDS = (Kind.VELOCITY, Kind.ACCELERATION, Kind.JERK)


def passed_limits(
    pieces: Pieces, displacement: Array, machine: Machine
) -> Iterator[tuple[Kind, Index, str]]:
    """Which moves pass a limit by more than rounding explains.

    Parameters
    ----------
    pieces : Pieces
        Of b moves.
    displacement : ndarray, shape (b, 9)
        Of each axis; 0 where it stands. [mm] or [deg]
    machine : Machine
        Whose limits count.

    Yields
    ------
    tuple of Kind, ndarray of int and str
        What is passed, the moves that do so (once for each piece of theirs), and the problem.
    """
    moving = (displacement != 0.0)[pieces.owner]
    limits, blurs = axis_limits(machine), pieces.blur()
    for kind, value, limit, blur in zip(_KINDS, pieces.extremes(), limits, blurs, strict=True):
        bad = moving & ~(value <= _most(kind, limit, blur))
        for a in np.flatnonzero(bad.any(axis=0)).tolist():
            problem = f"{AXES[a]} passes its limit of {limit[a]:g} mm, s"
            yield kind, pieces.owner[bad[:, a]], problem
    if machine.path == FREE:
        return
    way = path_direction(displacement, machine)[pieces.owner]
    path = machine.path.limit
    along = pieces.along(way).extremes()
    for k, bound in enumerate((path.velocity, path.acceleration)):
        rounded = (np.abs(way) * blurs[k]).sum(axis=1)
        bad = ~(along[k][:, 0] <= _most(_KINDS[k], np.asarray(bound), rounded))
        yield _KINDS[k], pieces.owner[bad], f"the path passes its limit of {bound:g} mm, s"


def _most(kind: Kind, limit: Array, blur: Array) -> Array:
    """What a value may come to as written."""
    excuse = blur if kind is Kind.JERK else np.minimum(blur, MOST_BLUR * limit)
    return np.asarray(limit * (1.0 + WITHIN) + excuse)
