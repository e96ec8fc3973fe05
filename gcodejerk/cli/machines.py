"""The commands about machine files: `machine check`, `list`, `show`, `schema`, `test-program`."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from gcodejerk.cli.common import JsonOption, MachineOption, console, load_machine

if TYPE_CHECKING:
    from gcodejerk.errors import MachineError
    from gcodejerk.identification import Excitation
    from gcodejerk.machine import Machine

DEFAULT_ROOM, DEFAULT_LENGTHS, DEFAULT_REPEATS, DEFAULT_DWELL = 50.0, 4, 3, 2.0


def machine_check(
    machine: Annotated[
        str,
        typer.Argument(
            metavar="M", help="machine file, or the name of a shipped machine; - is standard input"
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Validate a machine file; every problem with its line and column."""
    described = _piped() if machine == "-" else load_machine(machine)
    described = replace(described, warnings=(*described.warnings, *_refused_later(described)))
    axes = ", ".join(f"{axis.name} ({len(axis.modes)})" for axis in described.axes)
    structure = f", and {len(described.modes)} of the structure" if described.modes else ""
    if as_json:
        print(json.dumps(_summary(described), indent=1, ensure_ascii=False))
        return
    for warning in described.warnings:
        place, text = str(warning.place), str(warning)
        print(text.replace(place, f"{place}: warning", 1))
    count = len(described.warnings)
    doubts = "" if not count else f"; {count} warning{'' if count == 1 else 's'}"
    print(f"{described.source}: {described.name}: good{doubts}; axes (modes): {axes}{structure}")


def _piped() -> Machine:
    """The machine that standard input describes."""
    from gcodejerk.machine import Machine
    from gcodejerk.machine.file.document import MOST_BYTES, decode

    name = "<stdin>"
    return Machine.loads(decode(sys.stdin.buffer.read(MOST_BYTES + 1), name), name)


def _refused_later(described: Machine) -> list[MachineError]:
    """What no program can be processed with: names of what is not installed, a wrong start."""
    from gcodejerk.emit import controller_of
    from gcodejerk.errors import GcodejerkError, MachineError, Place
    from gcodejerk.nc import AUTO, check_start, dialect_of

    def start_of(described: Machine) -> None:
        name = dialect_of(described)
        if name != AUTO:
            check_start(name, described.program_start())

    found: list[MachineError] = []
    for key, load in (("controller: ", controller_of), ("dialect: ", dialect_of), ("", start_of)):
        try:
            load(described)
        except GcodejerkError as error:
            place = error.place or Place(described.source)
            # A dialect that there is not has no codes to start with, either.
            if all(one.place != place for one in found):
                found.append(MachineError(f"{key}{error.problem}", error.remedy, place))
    return found


def machine_schema() -> None:
    """Print the JSON Schema of machine files, for editors."""
    from gcodejerk.machine import machine_schema as schema

    print(json.dumps(schema(), indent=1))


def machine_list(as_json: JsonOption = False) -> None:
    """List the shipped machines."""
    from gcodejerk.machine import Machine
    from gcodejerk.machine.find import shipped_machines
    from gcodejerk.report.tables import machines_table

    found = {name: Machine.load(path) for name, path in shipped_machines().items()}
    if as_json:
        rows = [{"machine": name} | _summary(one) for name, one in found.items()]
        print(json.dumps(rows, indent=1, ensure_ascii=False))
        return
    console().print(machines_table(found))


def machine_show(
    machine: Annotated[str, typer.Argument(metavar="M", help="name of a machine, or a file")],
    as_json: JsonOption = False,
) -> None:
    """Print a machine file as it is, with its comments: a place to begin your own."""
    from gcodejerk.machine import find_machine
    from gcodejerk.machine.file.document import read_text

    if as_json:
        print(json.dumps(_summary(load_machine(machine)), indent=1, ensure_ascii=False))
        return
    print(read_text(find_machine(machine)), end="")


def machine_test_program(
    machine: MachineOption = None,
    axis: Annotated[
        list[str] | None,
        typer.Option("--axis", metavar="AXIS", help="only this axis; may be given again"),
    ] = None,
    room: Annotated[
        float, typer.Option(metavar="L", min=0.0, help="room to the plus side [mm or deg]")
    ] = DEFAULT_ROOM,
    lengths: Annotated[
        int, typer.Option(min=1, max=20, help="how many lengths for each axis")
    ] = DEFAULT_LENGTHS,
    repeats: Annotated[
        int, typer.Option(min=1, max=100, help="there and back of each length")
    ] = DEFAULT_REPEATS,
    dwell: Annotated[
        float, typer.Option(metavar="S", min=0.1, max=60.0, help="behind every rapid")
    ] = DEFAULT_DWELL,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="standard output (-) by default"),
    ] = None,
    as_json: Annotated[
        bool,
        typer.Option("--json", help="print the lengths, as JSON; the program with -o FILE only"),
    ] = False,
) -> None:
    """Write a program of rapids and dwells, to record the machine's vibration with."""
    from gcodejerk.batch.files import new_file, refuse_clashes
    from gcodejerk.errors import MachineError
    from gcodejerk.identification import excitation, rapids_program

    if as_json and output == "-":
        raise typer.BadParameter(
            "standard output holds one: the program or --json; name a file with -o"
        )
    described = load_machine(machine)
    refuse_clashes([output], [described.source])
    chosen = [name.upper() for name in axis or ()] or [
        one.name for one in described.axes if not one.rotary
    ]
    if not chosen:
        raise MachineError(
            f"{described.source or described.name} has no linear axis to record",
            f"name the axes that are to move: --axis {described.axes[0].name}",
        )
    rapids = [
        excitation(described, described.axis(name).name, room, lengths)
        for name in dict.fromkeys(chosen)
    ]
    if output is not None or not as_json:
        with new_file(output or "-") as file:
            program = rapids_program(described, rapids, repeats, dwell)
            file.write(program.encode("ascii", "replace"))
    if as_json:
        rows = [
            {
                "axis": one.axis,
                "length": one.length,
                "conventional_time": one.time,
                "coverage": one.least,
            }
            for one in rapids
        ]
        record = {
            "machine": described.source,
            "program": output,
            "repeats": repeats,
            "dwell": dwell,
            "rapids": rows,
        }
        print(json.dumps(record, indent=1))
    elif output not in (None, "-"):
        print(
            f"{output}: {', '.join(_said(one) for one in rapids)}; {repeats} times there and back"
        )


def _said(one: Excitation) -> str:
    return f"{one.axis} {' '.join(f'{length:g}' for length in one.length)}"


def _summary(machine: Machine) -> dict[str, object]:
    """What a list of machines says of one."""
    return {
        "file": machine.source,
        "name": machine.name,
        "controller": machine.controller,
        "dialect": machine.dialect,
        "interval": machine.interval,
        "positioning": machine.positioning,
        "axes": {axis.name: len(axis.modes) for axis in machine.axes},
        "spectra": [axis.name for axis in machine.axes if axis.spectrum is not None],
        "structure_modes": len(machine.modes),
        "warnings": [str(warning) for warning in machine.warnings],
    }
