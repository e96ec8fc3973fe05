"""The command line: arguments, files, printing, exit codes. It decides nothing.

Exit status: 0 done, 1 refused or failed (with a message, and nothing half-written), 2 wrong usage.
Heavy modules are imported inside the commands, so that `--help` answers at once.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gcodejerk import __version__
from gcodejerk.errors import GcodejerkError

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.pipeline import Settings

app = typer.Typer(
    help="Rapids that do not shake the machine: re-times the G0 moves of an NC program.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
machine_app = typer.Typer(help="Check machine files.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(machine_app, name="machine")

MachineOption = Annotated[
    str,
    typer.Option(
        "--machine", "-m", metavar="M", help="machine file, or the name of a shipped machine"
    ),
]
ProfileOption = Annotated[str | None, typer.Option(help="condition3 (default) or conventional")]


def main() -> None:
    """Run the command line; every mistake of a user is a message, every other one a traceback."""
    try:
        app(standalone_mode=True)
    except GcodejerkError as error:
        sys.stdout.flush()
        print(error, file=sys.stderr)
        sys.exit(1)
    except BrokenPipeError:
        # Whoever read our output has enough. Nothing more can be printed, not even at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def _version(value: bool) -> None:
    if value:
        print(f"gcodejerk {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="show the version")
    ] = False,
) -> None:
    """Options of all commands."""


@app.command()
def process(
    files: Annotated[
        list[str], typer.Argument(metavar="FILE...", help="programs; - is standard input")
    ],
    machine: MachineOption,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="OUT", help="output file; - is standard output"),
    ] = None,
    output_dir: Annotated[
        str | None, typer.Option(metavar="DIR", help="write each program under its own name here")
    ] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="replace each program")] = False,
    controller: Annotated[
        str | None, typer.Option(metavar="NAME", help="see `gcodejerk controllers`")
    ] = None,
    form: Annotated[str, typer.Option("--as", help="stream, pvt or parameters")] = "stream",
    profile: ProfileOption = None,
    dialect: Annotated[str | None, typer.Option(help="how the program is read")] = None,
    report: Annotated[str | None, typer.Option(metavar="FILE.json", help="write a report")] = None,
    jobs: Annotated[int, typer.Option(min=1, help="programs worked on at a time")] = 1,
    strict: Annotated[
        bool, typer.Option("--strict", help="refuse a program with rapids left alone")
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="write nothing; exit 1 if anything would change")
    ] = False,
    diff: Annotated[
        bool, typer.Option("--diff", help="write nothing; print what would change")
    ] = False,
    no_verify: Annotated[
        bool, typer.Option("--no-verify", help="do not read the output back")
    ] = False,
    no_comments: Annotated[
        bool, typer.Option("--no-comments", help="do not name replaced blocks")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="accept a program processed before")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print errors only")] = False,
) -> None:
    """Rewrite every rapid that is certain; verify; write the result in one move."""
    from gcodejerk.batch import Job, run_jobs
    from gcodejerk.files import make_folder
    from gcodejerk.pipeline import Settings

    if sum(map(bool, (output, output_dir, in_place))) > 1:
        raise typer.BadParameter("choose one of -o, --output-dir and --in-place")
    if len(files) > 1 and (output is not None or report is not None):
        raise typer.BadParameter("-o and --report take one program; use --output-dir for several")
    if report is not None and not report.endswith(".json"):
        raise typer.BadParameter(f"--report {report}: a report is a .json file in this version")
    if in_place and "-" in files:
        raise typer.BadParameter("--in-place needs a file, not standard input")
    settings = Settings(
        controller=controller,
        form=form,
        profile=profile,
        dialect=dialect,
        comments=not no_comments,
        verify=not no_verify,
        force=force,
    )
    mode = "check" if check else "diff" if diff else "write"
    described = _machine(machine, files[0])
    jobs_list = [
        Job(
            file,
            _output(file, output, output_dir, in_place, described, settings),
            report,
            mode,
            in_place,
            strict,
        )
        for file in files
    ]
    if output_dir is not None and mode == "write":
        make_folder(output_dir)
    to_stdout = diff or any(job.output == "-" for job in jobs_list)
    failed = changed = False
    with _progress(quiet or jobs > 1) as show:
        for done in run_jobs(jobs_list, described, settings, jobs, show):
            if done.error is not None:
                print(done.error, file=sys.stderr)
                failed = True
                continue
            changed |= done.changed
            if done.diff:
                sys.stdout.flush()
                sys.stdout.buffer.write(done.diff)
            for note in () if quiet else done.notes:
                print(f"{done.input}: note: {note}", file=sys.stderr)
            if check and done.changed:
                print(f"{done.input}: would be changed", file=sys.stdout)
            elif not quiet:
                print(done.summary, file=sys.stderr if to_stdout else sys.stdout)
    if failed or (check and changed):
        raise typer.Exit(1)


@app.command()
def inspect(
    file: Annotated[str, typer.Argument(metavar="FILE", help="a program; - is standard input")],
    machine: MachineOption,
    profile: ProfileOption = None,
    dialect: Annotated[str | None, typer.Option(help="how the program is read")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the report as JSON")] = False,
) -> None:
    """Show all rapids of a program: planned, or left alone and why."""
    from gcodejerk.batch import record_of
    from gcodejerk.files import open_input
    from gcodejerk.pipeline import Settings, process_file
    from gcodejerk.report.tables import rapids_table, summary_line

    described = _machine(machine, file)
    settings = Settings(profile=profile, dialect=dialect, force=True)
    with open_input(file) as source, _progress(as_json) as show:
        result = process_file(source, None, described, settings, file, show)
        record = record_of(result, described, None, source)
    if as_json:
        print(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))
        return
    console = _console()
    console.print(rapids_table(record))
    for note in record["notes"]:
        print(f"note: {note}")
    print(summary_line(file, record["summary"]).replace(" rewritten", " would be rewritten"))


@app.command()
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

    described = _machine(machine, None)
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
        console = _console()
        for table in move_tables(record, conventional_motion(planned)):
            console.print(table)


@machine_app.command("check")
def machine_check(
    machine: Annotated[
        str, typer.Argument(metavar="M", help="machine file, or the name of a shipped machine")
    ],
) -> None:
    """Validate a machine file; every problem with its line and column."""
    described = _machine(machine, None)
    axes = ", ".join(f"{axis.name} ({len(axis.modes)})" for axis in described.axes)
    structure = f", and {len(described.modes)} of the structure" if described.modes else ""
    print(f"{described.source}: {described.name}: good; axes (modes): {axes}{structure}")


@machine_app.command("schema")
def machine_schema() -> None:
    """Print the JSON Schema of machine files, for editors."""
    from gcodejerk.machine import machine_schema as schema

    print(json.dumps(schema(), indent=1))


@app.command()
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
    _console().print(controllers_table(rows))


def _machine(name: str, program: str | None) -> Machine:
    """The machine that the user named: a shipped one, or a file, also beside the program."""
    from gcodejerk.machine import Machine, find_machine

    beside = None if program is None or program == "-" else Path(program).parent / name
    if beside is not None and not Path(name).exists() and beside.is_file():
        return Machine.load(beside)
    found = find_machine(name)
    described = Machine.load(found)
    # A shipped machine is called by its file's name, wherever it is installed.
    return described if str(found) == name else replace(described, source=found.name)


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


def _output(
    file: str,
    output: str | None,
    output_dir: str | None,
    in_place: bool,
    machine: Machine,
    settings: Settings,
) -> str:
    """Where the result of a program goes."""
    from gcodejerk.emit import load_controller

    suffix = load_controller(settings.controller or machine.controller).suffix
    if in_place:
        if suffix:
            raise typer.BadParameter(
                "--in-place: this controller's streams are a file of their own"
            )
        return file
    if output is not None:
        return output
    if file == "-":
        return "-"
    path = Path(file)
    if output_dir is not None:
        return str(Path(output_dir) / (path.stem + suffix if suffix else path.name))
    return str(path.parent / f"{path.stem}.jerk{suffix or path.suffix}")


def _console() -> Any:
    """A rich console for tables; wide where nobody's screen sets the width."""
    from rich.console import Console

    if sys.stdout.isatty() or "COLUMNS" in os.environ:
        return Console(highlight=False, soft_wrap=False)
    return Console(highlight=False, width=120)


@contextmanager
def _progress(silent: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """A progress bar on standard error, if that is a terminal."""
    if silent or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description:>10}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=None)

        def show(step: str, done: int, total: int) -> None:
            bar.update(task, description=step, completed=done, total=max(total, 1))

        yield show


if __name__ == "__main__":
    main()
