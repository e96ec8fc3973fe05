"""The commands about machine files and controllers: `machine check`, `machine schema` and so on."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from gcodejerk.cli.common import console, load_machine
from gcodejerk.errors import GcodejerkError


def machine_check(
    machine: Annotated[
        str, typer.Argument(metavar="M", help="machine file, or the name of a shipped machine")
    ],
) -> None:
    """Validate a machine file; every problem with its line and column."""
    described = load_machine(machine, None)
    axes = ", ".join(f"{axis.name} ({len(axis.modes)})" for axis in described.axes)
    structure = f", and {len(described.modes)} of the structure" if described.modes else ""
    for warning in described.warnings:
        place, text = str(warning.place), str(warning)
        print(text.replace(place, f"{place}: warning", 1))
    count = len(described.warnings)
    doubts = "" if not count else f"; {count} warning{'' if count == 1 else 's'}"
    print(f"{described.source}: {described.name}: good{doubts}; axes (modes): {axes}{structure}")


def machine_schema() -> None:
    """Print the JSON Schema of machine files, for editors."""
    from gcodejerk.machine import machine_schema as schema

    print(json.dumps(schema(), indent=1))


def controllers() -> None:
    """Show what each controller's emitter can write, and how far its facts can be trusted."""
    from gcodejerk.emit import controllers as installed
    from gcodejerk.emit import load_controller
    from gcodejerk.report.tables import controllers_table

    rows: list[tuple[str, str, str, str]] = []
    for name in sorted(installed()):
        try:
            forms = load_controller(name).forms
        except GcodejerkError as error:
            rows.append((name, "-", "broken", str(error)))
            continue
        rows += [
            (name if k == 0 else "", f.name, f.confidence, f.note) for k, f in enumerate(forms)
        ]
    console().print(controllers_table(rows))
