"""Resolutions that can be, and are probably not meant.

Points are whole multiples of the resolution, so a coarse one makes a stream of a few steps, each a
jump for the axis. Above `COARSEST` a file is refused (`loader`); above `COARSE` it is warned of.
"""

from __future__ import annotations

from gcodejerk.machine.model import Machine

COARSEST = 0.1
"""mm or deg."""
COARSE = 0.01


def resolution_warnings(machine: Machine) -> list[str]:
    """Say which resolutions are coarser than controls of machine tools have.

    Parameters
    ----------
    machine : Machine
        Of any kind.

    Returns
    -------
    list of str
        One for each such axis.
    """
    return [
        f"axes.{axis.name}.resolution is {axis.resolution:g} {'deg' if axis.rotary else 'mm'}: all "
        "points are whole multiples of it; least increments of controls are 0.001 or finer"
        for axis in machine.axes
        if axis.resolution > COARSE * (1.0 + 1e-9)
    ]
