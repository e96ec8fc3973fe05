"""Which rapids a recorded program makes: of each the axis and the length, in their order.

Rule: a length that depends on where the program starts is not known. So the program is read from
two places, and what differs is left out.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, replace

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import read_program

APART = 1000.0
"""The second place. [mm] or [deg]"""
SAME = 1e-6


@dataclass(frozen=True, slots=True)
class Commanded:
    """A rapid.

    Attributes
    ----------
    axis : str or None
        The one that moves; None where several do, or it is not known.
    length : float or None
        Signed; None where it is not known. [mm] or [deg]
    """

    axis: str | None
    length: float | None


def commanded_rapids(data: bytes, machine: Machine, name: str = "<program>") -> list[Commanded]:
    """The rapids of a program that move something.

    Parameters
    ----------
    data : bytes
        The program.
    machine : Machine
        Its dialect and start.
    name : str
        For messages.

    Returns
    -------
    list of Commanded
    """
    lengths = []
    for place in (0.0, APART):
        start = machine.program_start()
        positions = {axis.name: place for axis in machine.axes} | dict(start.positions)
        program = read_program(
            io.BytesIO(data), name=name, dialect=machine.dialect,
            start=replace(start, positions=positions),
        )  # fmt: skip
        lengths.append(program.rapids.target - program.rapids.start)
    one, other = lengths
    # An axis that the machine does not have is NaN in both.
    nowhere = np.isnan(one) & np.isnan(other)
    one[nowhere] = other[nowhere] = 0.0
    known = np.abs(one - other) < SAME
    rapids = []
    for row, sure in zip(one, known, strict=True):
        moving = np.flatnonzero(~sure | (np.abs(row) > SAME))
        if not len(moving):
            continue
        k = int(moving[0])
        alone = len(moving) == 1 and bool(sure[k])
        rapids.append(
            Commanded(AXES[k] if len(moving) == 1 else None, float(row[k]) if alone else None)
        )
    return rapids
