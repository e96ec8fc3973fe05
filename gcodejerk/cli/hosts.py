"""The commands for the programs that people post from and open files with: `filter`, `install`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from typing import Annotated

import typer

from gcodejerk.cli.common import JsonOption, MachineOption, ProfileOption, load_machine
from gcodejerk.cli.rapid_feed import ClearanceOption, RapidFeedOption, counting


def filter_program(
    file: Annotated[str, typer.Argument(metavar="FILE", help="the program that is opened")],
    machine: MachineOption = None,
    progress: Annotated[
        bool,
        typer.Option("--progress", help="tell progress; AXIS and GladeVCP ask for it themselves"),
    ] = False,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="see `gcodejerk controllers`")
    ] = None,
    profile: ProfileOption = None,
    dialect: Annotated[str | None, typer.Option(help="how the program is read")] = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="write drilling cycles out as explicit moves")
    ] = False,
    unroll: Annotated[
        bool, typer.Option("--unroll", help="write loops, branches and calls out")
    ] = False,
    rapid_feed: RapidFeedOption = None,
    rapid_clearance: ClearanceOption = None,
) -> None:
    """Rewrite a program on its way into a screen of LinuxCNC, which calls this by its [FILTER]."""
    from gcodejerk.hosts.linuxcnc.filter import filter_program as pass_on
    from gcodejerk.hosts.linuxcnc.filter import wants_progress
    from gcodejerk.rewrite.pipeline import Settings

    if file == "-":
        raise typer.BadParameter("a filter is given a file: it has no standard input")
    described = counting(load_machine(machine, [file]), rapid_feed, rapid_clearance)
    settings = Settings(
        controller=controller, profile=profile, dialect=dialect, expand_cycles=expand_cycles,
        unroll=unroll,
    )  # fmt: skip
    asked = progress or wants_progress()
    for line in pass_on(file, described, settings, progress=asked):
        print(line, file=sys.stderr)


def install(
    host: Annotated[
        str | None, typer.Argument(metavar="HOST", help="none: list them", show_default=False)
    ] = None,
    where: Annotated[
        str | None,
        typer.Argument(
            metavar="WHERE",
            help="linuxcnc: the configuration's .ini file; others: a folder, where it is not found",
            show_default=False,
        ),
    ] = None,
    machine: Annotated[
        str | None,
        typer.Option(
            "--machine", "-m", metavar="M", help="machine file, or the name of a shipped machine"
        ),
    ] = None,
    form: Annotated[
        str | None,
        typer.Option(
            metavar="FORM", help="linuxcnc: adaptive-feed (default), position, guard or filter"
        ),
    ] = None,
    base: Annotated[
        str | None, typer.Option(metavar="POST", help="freecad: the post in front (linuxcnc)")
    ] = None,
    remove: Annotated[
        bool, typer.Option("--remove", help="take out again what was installed")
    ] = False,
    linuxcnc_version: Annotated[
        str | None,
        typer.Option(metavar="V", help="where it cannot be told: that of the machine's LinuxCNC"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Install what a program needs to call gcodejerk, or take it out again; or say how."""
    from gcodejerk.hosts.catalogue import ALIASES, HOSTS, Request, host_lines

    told = (machine, form, base, remove or None, linuxcnc_version)
    if host is None and any(one is not None for one in told):
        raise typer.BadParameter("name the host: `gcodejerk install` alone lists them")
    if host is None:
        _print(host_lines(), as_json)
        return
    host = ALIASES.get(host, host)
    if host not in HOSTS:
        raise typer.BadParameter(f"{host}: choose one of {', '.join(HOSTS)}")
    request = Request(host, where, machine, form, base, remove, linuxcnc_version)
    if problem := request.problem():
        raise typer.BadParameter(problem)
    _print(HOSTS[host].install(request), as_json)


def _print(lines: Iterable[str], as_json: bool) -> None:
    """What was done, or is to be done."""
    if as_json:
        print(json.dumps({"lines": list(lines)}, indent=1, ensure_ascii=False))
        return
    for line in lines:
        print(line)
