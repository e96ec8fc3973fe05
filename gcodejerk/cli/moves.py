"""The commands that take a single move: `plan`, `map` and `compare`."""

from __future__ import annotations

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gcodejerk.cli.common import (
    JsonOption,
    MachineOption,
    ProfileOption,
    console,
    load_machine,
    positive,
    progress,
    waiting,
)

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.studies.amplitude_map import Survey

CONDITIONS = ("I", "II", "III")
TABLE = ".csv"
FIGURES = (".png", ".svg", ".pdf")
MAPS = (*FIGURES, TABLE)
OWN = "mode"
"""In place of a damping ratio: that of the mode."""


def plan(
    moves: Annotated[
        list[str], typer.Argument(metavar="AXIS=LENGTH...", help="for example Z=1 or X=20 Y=-5")
    ],
    machine: MachineOption = None,
    time: Annotated[
        float | None,
        typer.Option(
            metavar="S", help="T_SUM; the conventional time by default", callback=positive
        ),
    ] = None,
    t1: Annotated[
        float | None,
        typer.Option("--T1", metavar="S", help="T1 of a four-segment profile", callback=positive),
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
    from gcodejerk.batch.files import new_file, refuse_clashes
    from gcodejerk.emit import controller_of
    from gcodejerk.planning.lines import Play
    from gcodejerk.planning.move import not_planned, plan_move
    from gcodejerk.report.move_record import conventional_motion, move_record, stream_csv
    from gcodejerk.report.records import dump
    from gcodejerk.report.tables import move_limit, move_tables

    described = load_machine(machine)
    refuse_clashes([csv, as_json, plot], [described.source])
    emitter = controller_of(described)
    # LinuxCNC follows the profile between the points: judged at every interval, like a table.
    held = emitter.play is Play.HELD
    move = displacement_of(moves)
    with waiting("planning"):
        planned = plan_move(
            move,
            described,
            profile,
            time=time,
            T1=t1,
            stride=emitter.stride(described.interval) if held else 1,
            play=Play.HELD if held else Play.TABLE,
        )
        if not planned.planned:
            raise not_planned(planned.reason or "")
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
        if limit := move_limit(record, 100.0 * described.design.band):
            print(limit)
        for note in record["notes"]:
            print(note)


def map_amplitudes(
    axis: Annotated[str, typer.Option(metavar="AXIS", help="the axis that moves")],
    length: Annotated[float, typer.Option(metavar="L", help="how far it moves [mm or deg]")],
    machine: MachineOption = None,
    mode: Annotated[
        str | None,
        typer.Option(
            metavar="MODE",
            help="number or name of a mode that the axis excites, or all: the worst displacement "
            "(default: all; in a .csv the mode that the controller's own G0 moves most)",
        ),
    ] = None,
    condition: Annotated[
        str | None,
        typer.Option(metavar="I/II/III", help="which profiles", show_default="III"),
    ] = None,
    conditions: Annotated[
        bool, typer.Option("--conditions", help="draw the maps of all three side by side")
    ] = False,
    output: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="draw (.png, .svg, .pdf) or write a .csv; - is standard output",
        ),
    ] = None,
    points: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=5000,
            metavar="N",
            help="of each axis of the map; a .csv by default keeps to the command interval",
        ),
    ] = None,
    longest: Annotated[
        float | None, typer.Option(metavar="S", help="where T_SUM ends on the map")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Map what is left of vibration over T1 and T_SUM, for one move of one axis."""
    from gcodejerk.batch.files import STANDARD, new_file, refuse_clashes

    suffix = _suffix_of_map(output, condition, conditions=conditions)
    if length == 0.0:
        raise typer.BadParameter("--length 0 is no move: give another, for example --length 1")
    if as_json and output == STANDARD:
        raise typer.BadParameter("--json and -o - are both on standard output: choose one")
    if output is None and (points is not None or longest is not None):
        raise typer.BadParameter("--points and --longest are of a map that is written (-o FILE)")
    described = load_machine(machine)
    refuse_clashes([output], [described.source])
    survey = _survey(described, axis, length, (condition or "III").upper(), mode, suffix == TABLE)
    if as_json:
        from gcodejerk.report.map_record import map_record

        with waiting("mapping"):
            record = map_record(survey)
        print(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))
    elif output is None:
        from gcodejerk.report.tables import map_tables

        with waiting("mapping"):
            tables = map_tables(survey)
        screen = console()
        for table in tables:
            screen.print(table)
    if output is None:
        return
    with waiting("mapping", silent=output == STANDARD), new_file(output) as file:
        if suffix == TABLE:
            from gcodejerk.report.map_csv import map_csv

            grid = survey.axes(points, longest) if points else survey.interval_axes(longest)
            file.write(map_csv(survey, *grid))
        else:
            from gcodejerk.report.map_figure import POINTS, plot_conditions, plot_map

            plot = plot_conditions if conditions else plot_map
            plot(survey, file, Path(output).suffix, points or POINTS, longest)


def _suffix_of_map(output: str | None, condition: str | None, *, conditions: bool) -> str:
    """What kind of file a map goes to, empty for none; options that contradict it are refused."""
    from gcodejerk.batch.files import STANDARD

    if condition is not None and condition.upper() not in CONDITIONS:
        raise typer.BadParameter(f"--condition {condition}: choose I, II or III")
    if conditions and condition is not None:
        raise typer.BadParameter("--conditions draws all three: leave --condition out")
    if conditions and output is None:
        raise typer.BadParameter("--conditions is of maps that are drawn (-o FILE)")
    if output is None:
        return ""
    suffix = TABLE if output == STANDARD else Path(output).suffix.lower()
    if suffix not in MAPS:
        raise typer.BadParameter(
            f"-o {output}: a map is one of {', '.join(MAPS)}, or - for the table on standard output"
        )
    if conditions and suffix == TABLE:
        raise typer.BadParameter(
            f"-o {output}: --conditions draws {', '.join(FIGURES)}; a .csv is of one condition"
        )
    return suffix


def compare(
    moves: Annotated[
        list[str], typer.Argument(metavar="AXIS=LENGTH...", help="for example Z=1 or X=20 Y=-5")
    ],
    machine: MachineOption = None,
    time: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            callback=positive,
            help="T_SUM of the profiles that keep it; the conventional time by default",
        ),
    ] = None,
    shaper_damping: Annotated[
        str,
        typer.Option(
            metavar="RATIO", help="damping ratio that shapers are made for, or mode: that of theirs"
        ),
    ] = "0",
    as_json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="write the figures; - is standard output"),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option("--plot", metavar="FILE", help="draw the comparison (.png, .svg, .pdf)"),
    ] = None,
) -> None:
    """Compare every profile and shaper on one move: time, peaks, vibration, settling."""
    from gcodejerk.batch.files import new_file, refuse_clashes
    from gcodejerk.report.compare_record import compare_record
    from gcodejerk.report.compare_table import compare_notes, compare_table
    from gcodejerk.report.records import dump
    from gcodejerk.studies.comparison import compare_move

    damping = _damping(shaper_damping)
    if plot is not None and Path(plot).suffix.lower() not in FIGURES:
        raise typer.BadParameter(f"--plot {plot}: a figure is one of {', '.join(FIGURES)}")
    if as_json is not None and as_json == plot:
        raise typer.BadParameter("--json and --plot are two files")
    displacement = displacement_of(moves)
    described = load_machine(machine)
    refuse_clashes([as_json, plot], [described.source])
    with progress(False) as show:
        found = compare_move(
            displacement,
            described,
            time=time,
            shaper_damping=damping,
            progress=show,
        )
    with ExitStack() as outputs:
        if as_json is not None:
            outputs.enter_context(new_file(as_json)).write(dump(compare_record(found)))
        if plot is not None:
            from gcodejerk.report.compare_figure import plot_comparison

            plot_comparison(found, outputs.enter_context(new_file(plot)), Path(plot).suffix)
    if as_json != "-":
        console().print(compare_table(found))
        for line in compare_notes(found):
            print(line)


def _damping(text: str) -> float | None:
    """What shapers are made for; None: the mode's own damping."""
    if text == OWN:
        return None
    try:
        damping = float(text)
    except ValueError:
        damping = -1.0
    if not 0.0 <= damping < 1.0:
        raise typer.BadParameter(
            f"--shaper-damping {text}: give a ratio from 0 to below 1, or the word {OWN}"
        )
    return damping


def _survey(
    machine: Machine, axis: str, length: float, condition: str, mode: str | None, table: bool
) -> Survey:
    """The survey of the mode that was asked for, or of the one that the output is best made of."""
    from gcodejerk.studies.amplitude_map import ALL, Survey

    survey = Survey.of(machine, axis, length, condition, mode or ALL)
    if mode is not None or not (table or len(survey.modes) == 1):
        return survey
    chosen = survey.dominant
    if len(survey.modes) > 1:
        # Standard output may be the table itself, or JSON.
        print(
            f"mode {chosen.name}, {chosen.frequency:g} Hz; choose another one with --mode",
            file=sys.stderr,
        )
    return Survey.of(machine, axis, length, condition, chosen.name)


def displacement_of(moves: list[str]) -> dict[str, float]:
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
