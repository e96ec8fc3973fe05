"""The command that installs what our output needs where it runs: `install`."""

from __future__ import annotations

from typing import Annotated

import typer

HOSTS = ("linuxcnc",)


def install(
    host: Annotated[str, typer.Argument(metavar="HOST", help="linuxcnc")],
    where: Annotated[str, typer.Argument(metavar="INI", help="the configuration's .ini file")],
    form: Annotated[
        str | None, typer.Option(metavar="FORM", help="adaptive-feed (default), position or guard")
    ] = None,
    remove: Annotated[
        bool, typer.Option("--remove", help="take out again what was installed")
    ] = False,
    linuxcnc_version: Annotated[
        str | None,
        typer.Option(metavar="V", help="where it cannot be told: that of the machine's LinuxCNC"),
    ] = None,
) -> None:
    """Install what linuxcnc-hal or an override guard need into a LinuxCNC, or take it out again."""
    from gcodejerk.hosts.linuxcnc.hal_files import FORMS, GUARD
    from gcodejerk.hosts.linuxcnc.install import install as add
    from gcodejerk.hosts.linuxcnc.install import remove as take_out

    if host not in HOSTS:
        raise typer.BadParameter(f"{host}: in this version there is {', '.join(HOSTS)}")
    if remove and form is not None:
        raise typer.BadParameter("--remove takes out whichever form is there: leave --form out")
    if form is not None and form not in (*FORMS, GUARD):
        raise typer.BadParameter(f"--form {form}: choose one of {', '.join((*FORMS, GUARD))}")
    done = take_out(where) if remove else add(where, form or FORMS[0], linuxcnc_version)
    for line in done:
        print(line)
