"""The option by which programs go on in other files."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gcodejerk.machine import Machine

SubprogramsOption = Annotated[
    str | None,
    typer.Option(
        "--subprograms",
        metavar="DIR",
        help="follow calls into files of DIR (O1000.nc, L54.SPF, name.ngc), which stay as they are",
    ),
]


def calling(machine: Machine, folder: str | None) -> Machine:
    """The machine, with the subprograms that the user names in place of its own."""
    from gcodejerk.machine.subprograms import load_subprograms

    return machine if folder is None else replace(machine, subprograms=load_subprograms(folder))
