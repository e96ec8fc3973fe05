"""The command that tunes a control's own settings: `parameters`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gcodejerk.cli.common import (
    ControllerOption,
    DialectOption,
    MachineOption,
    console,
    load_machine,
    progress,
    refuse,
)

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.parameters import Moves

FIGURES = (".png", ".svg", ".pdf")
LENGTHS = 60
"""Lengths between the two of --lengths."""
LONGEST = 300.0
"""Longest rapid that is reckoned with where nothing says how far an axis goes. [mm]"""


def parameters(
    machine: MachineOption = None,
    files: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[FILE...]", help="programs and folders whose rapids it is tuned for"
        ),
    ] = None,
    controller: ControllerOption = None,
    settings: Annotated[
        str | None,
        typer.Option("--settings", metavar="NAME", help="which of the control's settings, if it "
                     "has several ways"),
    ] = None,
    lengths: Annotated[
        str | None,
        typer.Option(metavar="FROM:TO", help="in place of programs: rapids of these lengths [mm] "
                     "on every axis with a mode; with neither, 1 mm to the longest travel"),
    ] = None,
    goal: Annotated[
        str,
        typer.Option(metavar="worst/mean", help="make the worst rapid before a cut small, or "
                     "their mean"),
    ] = "worst",
    time: Annotated[
        float,
        typer.Option(metavar="SHARE", min=0.1, max=10.0,
                     help="time of all rapids together, of today's"),
    ] = 1.0,
    tried: Annotated[
        list[str] | None,
        typer.Option("--try", metavar="KEY=NUMBER", help="also show what these numbers would do, "
                     "for example --try '1620 X=130'; may be repeated"),
    ] = None,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="FILE", help="write the setup sheet; - is standard "
                     "output"),
    ] = None,
    as_json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="write the figures; - is standard output"),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="draw what time buys, and robustness (.png, "
                     ".svg, .pdf)"),
    ] = None,
    no_curve: Annotated[
        bool,
        typer.Option("--no-curve", help="do not search what more or less time would buy: quicker"),
    ] = False,
    dialect: DialectOption = None,
) -> None:  # fmt: skip
    """Tune the control's own time constants, jerk limits and shapers for a shop's rapids."""
    from gcodejerk.batch.files import new_file, refuse_clashes
    from gcodejerk.emit import controller_of
    from gcodejerk.emit.sheets import Sheets
    from gcodejerk.errors import EmitError
    from gcodejerk.parameters import GOALS, tune
    from gcodejerk.report.records import dump
    from gcodejerk.report.tuning_record import tuning_record
    from gcodejerk.report.tuning_table import tuning_notes, tuning_tables

    own = _numbers(tried or [])
    written = _written(output, as_json, plot, no_curve=no_curve)
    refuse((goal not in GOALS, f"--goal {goal}: choose {' or '.join(GOALS)}"))
    _refuse_idle(files, lengths, dialect, own, written)
    programs = files or []
    described = load_machine(machine, programs)
    refuse_clashes(written, [described.source, *programs])
    emitter = controller_of(described, controller)
    if not isinstance(emitter, Sheets):
        raise EmitError(
            f"controller {emitter.name}: nothing is known that could be set in it",
            "`gcodejerk controllers` shows which have the form parameters",
        )
    with progress(False) as show:
        if show is not None:
            show.wait("reading")
        moves, of = _moves(programs, lengths, described, dialect)
        scheme = emitter.scheme(described, settings)
        scheme.checked(own)
        if show is not None:
            show.wait("searching")
        found = tune(
            scheme, moves, described, goal=goal, time=time, curve=not no_curve,
            progress=None if show is None else lambda done, total: show("searching", done, total),
        )  # fmt: skip
    sheet = emitter.sheet(found, of)
    way = settings or next(iter(emitter.schemes(described)))
    with ExitStack() as outputs:
        if output is not None:
            outputs.enter_context(new_file(output)).write(sheet)
        if as_json is not None:
            outputs.enter_context(new_file(as_json)).write(dump(tuning_record(found, way)))
        if plot is not None:
            from gcodejerk.report.tuning_figure import plot_tuning

            plot_tuning(found, outputs.enter_context(new_file(plot)), Path(plot).suffix)
    if "-" in written:
        return
    screen = console()
    for table in tuning_tables(found, own):
        screen.print(table)
    for note in tuning_notes(found):
        print(note)
    others = [name for name in emitter.schemes(described) if name != way]
    if others:
        print(f"settings of {emitter.name}: {way}; also --settings {', '.join(others)}")
    if output is None:
        print(f"the setup sheet, with the way back: -o NAME{emitter.sheet_suffix}")
    else:
        print(f"{output}: the setup sheet, with the way back")


def _written(
    output: str | None, as_json: str | None, plot: str | None, *, no_curve: bool
) -> list[str]:
    """The files that are asked for; those that cannot be made are refused."""
    if plot is not None and Path(plot).suffix.lower() not in FIGURES:
        raise typer.BadParameter(f"--plot {plot}: a figure is one of {', '.join(FIGURES)}")
    if plot is not None and no_curve:
        raise typer.BadParameter("--plot draws the curve: leave --no-curve out")
    written = [name for name in (output, as_json, plot) if name is not None]
    if len(set(written)) < len(written):
        raise typer.BadParameter("-o, --json and --plot are different files")
    return written


def _moves(
    files: list[str], lengths: str | None, machine: Machine, dialect: str | None
) -> tuple[Moves, str]:
    """The rapids that it is tuned for, and what they are called."""
    import numpy as np

    from gcodejerk.batch.files import open_input
    from gcodejerk.batch.inputs import find_inputs
    from gcodejerk.errors import ProgramError
    from gcodejerk.nc import dialect_of, read_program
    from gcodejerk.parameters import Moves, joined_moves, program_moves

    if not files:
        first, last = _travelled(machine) if lengths is None else _range(lengths)
        steps = np.unique(np.geomspace(first, last, LENGTHS).round(3))
        return Moves.of_lengths(steps.tolist(), machine), f"{first:g} to {last:g} mm on each axis"
    found, problems = find_inputs(files, None)
    if problems:
        raise ProgramError(str(problems[0]))
    parts = []
    for one in found:
        with open_input(one.path) as source:
            program = read_program(
                source, name=one.path, dialect=dialect_of(machine, dialect),
                start=machine.program_start(),
            )  # fmt: skip
            parts.append(program_moves(program.rapids, source, machine))
    name = Path(found[0].path).name if len(found) == 1 else f"{len(found)} programs"
    return joined_moves(parts, machine), name


def _refuse_idle(
    files: list[str] | None,
    lengths: str | None,
    dialect: str | None,
    own: dict[str, float],
    written: list[str],
) -> None:
    """Refuse options beside which others do nothing."""
    alone = not files and dialect is not None
    beside = "--try shows its numbers beside the others, where standard output is free"
    refuse(
        (
            files and lengths is not None,
            "programs say what lengths their rapids have: leave --lengths out",
        ),
        (alone, "--dialect is of programs, and there are none: leave --dialect out"),
        (own and "-" in written, f"{beside}: leave --try out, or name a file in place of -"),
    )


def _numbers(tried: list[str]) -> dict[str, float]:
    """`1620 X=130` as numbers by their keys."""
    out = {}
    for text in tried:
        key, equals, number = text.rpartition("=")
        try:
            out[key.strip()] = float(number)
        except ValueError:
            equals = ""
        if not equals or not key.strip():
            raise typer.BadParameter(f"--try {text}: give a setting and its number, KEY=NUMBER")
    return out


def _travelled(machine: Machine) -> tuple[float, float]:
    """Lengths of the rapids of a shop that names none: up to the longest travel."""
    travels = [axis.travel for axis in machine.axes if axis.travel is not None]
    last = max((high - low for low, high in travels), default=LONGEST)
    return min(1.0, last / 10.0), last


def _range(text: str) -> tuple[float, float]:
    """`1:500` as two lengths."""
    first, colon, last = text.partition(":")
    try:
        low, high = float(first), float(last)
    except ValueError:
        colon = ""
        low = high = 0.0
    if not colon or not 0.0 < low <= high < 1e6:
        raise typer.BadParameter(f"--lengths {text}: give two lengths in mm, for example 1:500")
    return low, high
