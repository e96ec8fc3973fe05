"""The commands that take programs: `process` and `inspect`."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gcodejerk.cli.common import MachineOption, ProfileOption, console, load_machine, progress

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.pipeline import Settings


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
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="write drilling cycles out as explicit moves")
    ] = False,
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
        expand_cycles=expand_cycles,
    )
    mode = "check" if check else "diff" if diff else "write"
    described = load_machine(machine, files[0])
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
    with progress(quiet or jobs > 1) as show:
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


def inspect(
    file: Annotated[str, typer.Argument(metavar="FILE", help="a program; - is standard input")],
    machine: MachineOption,
    profile: ProfileOption = None,
    dialect: Annotated[str | None, typer.Option(help="how the program is read")] = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="write drilling cycles out as explicit moves")
    ] = False,
    as_json: Annotated[bool, typer.Option("--json", help="print the report as JSON")] = False,
) -> None:
    """Show all rapids of a program: planned, or left alone and why."""
    from gcodejerk.batch import record_of
    from gcodejerk.files import open_input
    from gcodejerk.pipeline import Settings, process_file
    from gcodejerk.report.tables import rapids_table, summary_line

    described = load_machine(machine, file)
    settings = Settings(profile=profile, dialect=dialect, force=True, expand_cycles=expand_cycles)
    with open_input(file) as source, progress(as_json) as show:
        result = process_file(source, None, described, settings, file, show)
        record = record_of(result, described, None, source, show, bounds=as_json)
    if as_json:
        print(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))
        return
    console().print(rapids_table(record))
    for note in record["notes"]:
        print(f"note: {note}")
    print(summary_line(file, record["summary"]).replace(" rewritten", " would be rewritten"))


def verify(
    original: Annotated[str, typer.Argument(metavar="ORIGINAL", help="the program as it was")],
    processed: Annotated[
        str, typer.Argument(metavar="PROCESSED", help="the rewritten program, or its .csv table")
    ],
    machine: MachineOption,
    profile: ProfileOption = None,
    dialect: Annotated[str | None, typer.Option(help="how the program is read")] = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="the original's cycles are written out")
    ] = False,
    most: Annotated[int, typer.Option(min=1, help="stop after so many violations")] = 100,
) -> None:
    """Prove that a program is the original with only its rapids re-timed; list what it is not."""
    from gcodejerk.expanded import verify_expanded
    from gcodejerk.files import open_input
    from gcodejerk.start import program_start
    from gcodejerk.verification import verify_csv, verify_files

    if original == processed == "-":
        raise typer.BadParameter("only one of the two can be standard input")
    described = load_machine(machine, original)
    if profile is not None:
        described = replace(described, design=replace(described.design, profile=profile))
    table = processed.lower().endswith(".csv")
    if table and expand_cycles:
        raise typer.BadParameter("--expand-cycles: a table of streams has no cycles written out")
    written = 0
    with open_input(original) as one, open_input(processed) as other:
        names = (original, processed)
        if expand_cycles:
            found, written = verify_expanded(
                one, other, described, names=names, dialect=dialect, most=most
            )
        else:
            found = (verify_csv if table else verify_files)(
                one, other, described, names=names, dialect=dialect,
                start=program_start(described), most=most,
            )  # fmt: skip
    for violation in found.violations:
        file, line = (
            (processed, violation.line) if violation.line else (original, violation.original_line)
        )
        place = f"{file}:{line}" if line else file
        print(f"{place}: {violation.kind}: {violation.problem}")
    if found.ok:
        cycles = f"{written} cycles written out, " if expand_cycles else ""
        print(
            f"{processed}: is {original} with {cycles}{found.rewritten} of its {found.rapids} "
            "rapids re-timed and nothing else changed"
        )
        return
    more = " or more" if len(found.violations) >= most else ""
    print(f"{processed}: {len(found.violations)}{more} violations: do not run it")
    raise typer.Exit(1)


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
