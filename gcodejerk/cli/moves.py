"""The commands that take a single move: `plan`."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer

from gcodejerk.cli.common import MachineOption, ProfileOption, console, load_machine


def plan(
    moves: Annotated[
        list[str], typer.Argument(metavar="AXIS=LENGTH...", help="for example Z=1 or X=20 Y=-5")
    ],
    machine: MachineOption,
    time: Annotated[
        float | None, typer.Option(metavar="S", help="T_SUM; the conventional time by default")
    ] = None,
    t1: Annotated[
        float | None, typer.Option("--T1", metavar="S", help="T1 of a four-segment profile")
    ] = None,
    profile: ProfileOption = None,
    as_json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="write the report; - is standard output"),
    ] = None,
    csv: Annotated[
        str | None, typer.Option("--csv", metavar="FILE", help="write the stream")
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot", metavar="FILE", help="draw profile and vibration (.png, .svg, .pdf)"
        ),
    ] = None,
) -> None:
    """Plan one move: its profile, peaks and residuals, the conventional ones beside it."""
    from gcodejerk.files import new_file
    from gcodejerk.move import plan_move
    from gcodejerk.report.records import conventional_motion, dump, move_record, stream_csv
    from gcodejerk.report.tables import move_tables

    described = load_machine(machine, None)
    planned = plan_move(_displacement(moves), described, profile, time=time, T1=t1)
    record = move_record(planned)
    with ExitStack() as outputs:
        if csv is not None:
            outputs.enter_context(new_file(csv)).write(stream_csv(planned))
        if as_json is not None:
            outputs.enter_context(new_file(as_json)).write(dump(record))
        if plot is not None:
            from gcodejerk.report.figures import plot_move

            plot_move(planned, outputs.enter_context(new_file(plot)), Path(plot).suffix)
    if "-" not in (csv, as_json, plot):
        screen = console()
        for table in move_tables(record, conventional_motion(planned)):
            screen.print(table)


def _displacement(moves: list[str]) -> dict[str, float]:
    """`Z=1 X=-5` as lengths."""
    out: dict[str, float] = {}
    for move in moves:
        axis, equals, text = move.partition("=")
        try:
            length = float(text)
        except ValueError:
            equals = ""
            length = 0.0
        if not equals or len(axis) != 1:
            raise typer.BadParameter(f"{move!r} is not AXIS=LENGTH, for example Z=1.5")
        if axis.upper() in out:
            raise typer.BadParameter(f"axis {axis.upper()} stands twice")
        out[axis.upper()] = length
    return out
