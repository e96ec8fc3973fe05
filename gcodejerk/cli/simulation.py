"""The commands about simulated machines: `simulate` and `machine reduce`."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, BinaryIO

import typer

from gcodejerk.cli.common import (
    ControllerOption,
    JsonOption,
    MachineOption,
    ProfileOption,
    console,
    known_dialect,
    load_machine,
    positive,
    progress,
    say,
    waiting,
)
from gcodejerk.cli.moves import FIGURES, displacement_of
from gcodejerk.errors import EmitError, PlanError

if TYPE_CHECKING:
    from gcodejerk.emit import Controller
    from gcodejerk.machine import Machine
    from gcodejerk.planning.batch import Batch
    from gcodejerk.planning.lines import Play
    from gcodejerk.rewrite.pipeline import Settings
    from gcodejerk.rewrite.result import Result

MOVE = re.compile(r"[A-Za-z]=.*")


def simulate(
    what: Annotated[
        list[str],
        typer.Argument(metavar="PROGRAM | AXIS=LENGTH...", help="a program, or one move: Z=1"),
    ],
    machine: MachineOption = None,
    profile: ProfileOption = None,
    time: Annotated[
        float | None,
        typer.Option(metavar="S", help="of a move: T_SUM; today's by default", callback=positive),
    ] = None,
    t1: Annotated[
        float | None,
        typer.Option(
            "--T1", metavar="S", help="of a move: T1 of a four-segment one", callback=positive
        ),
    ] = None,
    controller: ControllerOption = None,
    dialect: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="of a program: how it is read", callback=known_dialect),
    ] = None,
    as_written: Annotated[
        bool,
        typer.Option(
            "--as-written",
            help="simulate the streams as the controller plays them, in place of the profiles",
        ),
    ] = False,
    as_json: Annotated[
        str | None,
        typer.Option("--json", metavar="FILE", help="write all figures; - is standard output"),
    ] = None,
    csv: Annotated[
        str | None,
        typer.Option("--csv", metavar="FILE", help="of a move its course, of a program its rapids"),
    ] = None,
    plot: Annotated[
        str | None, typer.Option("--plot", metavar="FILE", help="draw (.png, .svg, .pdf)")
    ] = None,
) -> None:
    """Simulate drives and structure: each rapid as it moves today, and as planned."""
    from gcodejerk.batch.files import refuse_clashes
    from gcodejerk.rewrite.pipeline import Settings

    moves = [one for one in what if MOVE.fullmatch(one)]
    if plot is not None and Path(plot).suffix.lower() not in FIGURES:
        raise typer.BadParameter(f"--plot {plot}: a figure is one of {', '.join(FIGURES)}")
    outputs = [name for name in (as_json, csv, plot) if name is not None]
    if len(set(outputs)) < len(outputs):
        raise typer.BadParameter("--json, --csv and --plot are files of their own")
    if moves and len(moves) < len(what):
        raise typer.BadParameter("give a program or a move, not both")
    if not moves and len(what) > 1:
        raise typer.BadParameter("give one program; a move is AXIS=LENGTH, for example Z=1")
    if not moves and (time is not None or t1 is not None):
        raise typer.BadParameter("--time and --T1 are of a move")
    if moves and (controller is not None or dialect is not None):
        raise typer.BadParameter("--controller and --dialect are of a program")
    described = load_machine(machine, [] if moves else what)
    refuse_clashes(outputs, [described.source, *what])
    files = _Files(as_json, csv, plot)
    if moves:
        _move(described, moves, profile, time, t1, files, written=as_written)
    else:
        settings = Settings(controller=controller, profile=profile, dialect=dialect, force=True)
        _program(described, what[0], settings, files, written=as_written)


@dataclass(frozen=True, slots=True)
class _Files:
    """Where results go; None: nowhere."""

    as_json: str | None
    csv: str | None
    plot: str | None

    def write(
        self,
        record: Callable[[], dict[str, Any]],
        rows: Callable[[], Iterable[bytes]],
        draw: Callable[[BinaryIO, str], None],
    ) -> bool:
        """Write what was asked for; whether standard output is still free."""
        from gcodejerk.batch.files import new_file
        from gcodejerk.report.records import dump

        with ExitStack() as outputs:
            if self.csv is not None:
                outputs.enter_context(new_file(self.csv)).writelines(rows())
            if self.as_json is not None:
                outputs.enter_context(new_file(self.as_json)).write(dump(record()))
            if self.plot is not None:
                draw(outputs.enter_context(new_file(self.plot)), Path(self.plot).suffix)
        return "-" not in (self.as_json, self.csv, self.plot)


def _move(
    machine: Machine,
    moves: list[str],
    profile: str | None,
    time: float | None,
    t1: float | None,
    files: _Files,
    *,
    written: bool,
) -> None:
    """Simulate one move."""
    from gcodejerk.emit import controller_of
    from gcodejerk.planning.move import plan_move
    from gcodejerk.report.simulation_figure import plot_move_simulation
    from gcodejerk.report.simulation_record import move_simulation_csv, move_simulation_record
    from gcodejerk.report.simulation_table import move_sentence, move_tables
    from gcodejerk.simulation.single import MoveSimulation

    played: dict[str, Any] = {}
    if written:
        emitter = controller_of(machine)
        played = {"stride": emitter.stride(machine.interval), "play": _played(emitter)}
    move = displacement_of(moves)
    with waiting("simulating"):
        plan = plan_move(move, machine, profile, time=time, T1=t1, as_played=written, **played)
        found = MoveSimulation(plan, written=written)
    free = files.write(
        lambda: move_simulation_record(found),
        lambda: move_simulation_csv(found),
        lambda file, suffix: plot_move_simulation(found, file, suffix),
    )
    if not free:
        return
    screen = console()
    for table in move_tables(found):
        screen.print(table)
    print(move_sentence(found))
    if plan.reason is not None:
        print(f"the control's own rapid stays: {plan.reason}")


def _program(
    machine: Machine, name: str, settings: Settings, files: _Files, *, written: bool
) -> None:
    """Simulate the rapids of a program."""
    from gcodejerk.batch.files import open_input
    from gcodejerk.report.simulation_figure import plot_program_simulation
    from gcodejerk.report.simulation_record import (
        program_simulation_csv,
        program_simulation_record,
    )
    from gcodejerk.report.simulation_table import program_sentences, program_table
    from gcodejerk.rewrite.pipeline import process_file
    from gcodejerk.simulation.equations import equations_of
    from gcodejerk.simulation.moves import Watch
    from gcodejerk.simulation.programs import simulate_rapids

    tolerance = machine.design.tolerance
    watch = Watch(equations_of(machine), tolerance)
    with progress(False) as show, open_input(name) as source:
        result = process_file(source, None, machine, settings, name, show)
        batches = _batches(result, machine) if written else None
        found = simulate_rapids(
            result.plans, watch, batches,
            None if show is None else lambda done, total: show("simulating", done, total),
        )  # fmt: skip
    program = result.program
    free = files.write(
        lambda: program_simulation_record(found, program, machine),
        lambda: program_simulation_csv(found, program),
        lambda file, suffix: plot_program_simulation(found, program, tolerance, file, suffix),
    )
    if not free:
        return
    console().print(program_table(found, program))
    for line in program_sentences(found, program, tolerance):
        say(line)


def _batches(result: Result, machine: Machine) -> Iterator[Batch]:
    """The streams of a program as its controller is given them."""
    from gcodejerk.emit import load_controller
    from gcodejerk.planning.stream import make_streams

    emitter = load_controller(result.controller)
    rapids = result.program.rapids
    windows = make_streams(
        result.plans, emitter.number_format(rapids, machine, result.program.language),
        emitter.stride(machine.interval), _played(emitter),
    )  # fmt: skip
    for window in windows:
        yield from window


def _played(emitter: Controller) -> Play:
    """What the controller makes of points, refused where it is told cubics."""
    from gcodejerk.planning.lines import Play

    if emitter.play in (Play.CUBIC, Play.SCALED):
        raise EmitError(
            f"--as-written follows points; {emitter.name} is told something else",
            "leave it out: the profiles are simulated",
        )
    return emitter.play


def machine_reduce(
    machine: Annotated[str, typer.Argument(metavar="M", help="a machine with servo or structure")],
    faint: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1.0,
            metavar="SHARE",
            help="leave out modes that an axis moves by less than this part of its strongest",
        ),
    ] = 0.01,
    as_json: JsonOption = False,
) -> None:
    """Reduce drives and structure to the modes that planning needs, as the key `modes`."""
    from gcodejerk.report.simulation_record import reduction_record
    from gcodejerk.simulation.reduction import modes_yaml, reduce_machine

    described = load_machine(machine)
    if described.structure is None and all(axis.servo is None for axis in described.axes):
        raise PlanError(
            f"{described.name} has neither servo nor structure: its modes are what it has",
            "docs/simulate.md shows how a drive and a structure are described",
        )
    found = reduce_machine(described, faint)
    if as_json:
        print(json.dumps(reduction_record(found), indent=1, ensure_ascii=False))
        return
    print(modes_yaml(found), end="")
