"""The dialects, one table per file, and how they are found.

A dialect of another package is one file with a `Dialect`, registered as an entry point of the
group `gcodejerk.dialects`; it cannot take the name of one of ours.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from importlib.metadata import entry_points
from typing import Protocol

from gcodejerk.errors import Place, ProgramError
from gcodejerk.nc.dialects.any_mill import ANY_MILL
from gcodejerk.nc.dialects.centroid import CENTROID
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.duet import DUET
from gcodejerk.nc.dialects.fagor import FAGOR
from gcodejerk.nc.dialects.fanuc import FANUC, FANUC_LATHE_A, FANUC_LATHE_B
from gcodejerk.nc.dialects.fanuc_relatives import MAZATROL_EIA, MITSUBISHI, SYNTEC
from gcodejerk.nc.dialects.grbl import GRBL
from gcodejerk.nc.dialects.haas import HAAS
from gcodejerk.nc.dialects.heidenhain_iso import HEIDENHAIN_ISO
from gcodejerk.nc.dialects.iso_mill import ISO_MILL
from gcodejerk.nc.dialects.klartext import KLARTEXT
from gcodejerk.nc.dialects.klipper import KLIPPER
from gcodejerk.nc.dialects.linuxcnc import LINUXCNC
from gcodejerk.nc.dialects.mach import MACH
from gcodejerk.nc.dialects.marlin import MARLIN
from gcodejerk.nc.dialects.okuma import OKUMA
from gcodejerk.nc.dialects.pc_controls import EDINGCNC, MASSO, PLANETCNC, UCCNC
from gcodejerk.nc.dialects.rs274 import RS274
from gcodejerk.nc.dialects.siemens import SIEMENS

GROUP = "gcodejerk.dialects"
AUTO = "auto"
"""In place of a name: the dialect is found from the program's text."""

DIALECTS: dict[str, Dialect] = {
    dialect.name: dialect
    for dialect in (
        *(LINUXCNC, FANUC, FANUC_LATHE_A, FANUC_LATHE_B, HAAS, SIEMENS, HEIDENHAIN_ISO),
        *(GRBL, MACH, MARLIN, KLIPPER, RS274, ISO_MILL, ANY_MILL),
        *(DUET, CENTROID, UCCNC, EDINGCNC, PLANETCNC, MASSO, MITSUBISHI, MAZATROL_EIA, SYNTEC),
        *(OKUMA, FAGOR, KLARTEXT),
    )
}
"""Ours, by name."""


def lathe_dialects() -> list[str]:
    """Names of those in which programs of lathes are written."""
    return [name for name, dialect in DIALECTS.items() if dialect.lathe != "no"]


class NamesDialect(Protocol):
    """A machine file: it names a dialect, somewhere."""

    @property
    def dialect(self) -> str:
        """The name, or `auto`."""

    @property
    def named_at(self) -> Mapping[str, Place]:
        """Key -> where what it says stands."""


def dialect_of(machine: NamesDialect, chosen: str | None = None) -> str:
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


def find_dialect(dialect: str | Dialect) -> Dialect:
    """Look a dialect up by its name.

    Parameters
    ----------
    dialect : str or Dialect
        One of ours, or one that an installed package adds.

    Returns
    -------
    Dialect

    Raises
    ------
    ProgramError
        There is none of that name, or it cannot be loaded.
    """
    if isinstance(dialect, Dialect):
        return dialect
    if dialect in DIALECTS:
        return DIALECTS[dialect]
    found = {entry.name: entry for entry in entry_points(group=GROUP)}
    if dialect not in found:
        known = sorted({*DIALECTS, *found})
        near = difflib.get_close_matches(dialect, known, n=1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise ProgramError(
            f"dialect '{dialect}' is not known", f"{hint}choose one of: {', '.join(known)}"
        )
    try:
        made = found[dialect].load()
    except Exception as error:
        raise ProgramError(
            f"dialect '{dialect}' of {found[dialect].value} cannot be loaded: {error}",
            "repair or remove that package",
        ) from error
    if not isinstance(made, Dialect):
        raise ProgramError(
            f"dialect '{dialect}' of {found[dialect].value} is no gcodejerk.nc.Dialect",
            "repair or remove that package",
        )
    return made
