"""Which language a program is read in: what was chosen, else the machine file's."""

from __future__ import annotations

from gcodejerk.errors import ProgramError
from gcodejerk.machine import Machine
from gcodejerk.nc import AUTO, find_dialect


def dialect_of(machine: Machine, chosen: str | None = None) -> str:
    """The name of a dialect that there is, or `auto`.

    Parameters
    ----------
    machine : Machine
        Names one.
    chosen : str, optional
        Instead of it.

    Returns
    -------
    str

    Raises
    ------
    ProgramError
        There is none of that name; with its place where the machine file names it.
    """
    name = chosen or machine.dialect
    try:
        if name != AUTO:
            find_dialect(name)
    except ProgramError as error:
        error.place = None if chosen else machine.named_at.get("dialect")
        raise
    return name
