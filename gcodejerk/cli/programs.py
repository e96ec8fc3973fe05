"""The commands that take programs: `process` and `inspect`."""

from __future__ import annotations

import json
import os
import sys
from contextlib import closing
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from gcodejerk.cli.common import (
    ControllerOption,
    DialectOption,
    MachineOption,
    ProfileOption,
    console,
    load_machine,
    progress,
    refuse,
    said,
    say,
)
from gcodejerk.cli.rapid_feed import ClearanceOption, RapidFeedOption, counting
from gcodejerk.cli.subprograms import SubprogramsOption, calling
from gcodejerk.errors import GcodejerkError

if TYPE_CHECKING:
    from gcodejerk.batch.jobs import Done

WOULD_CHANGE = 3
"""Exit status of --check."""


def process(
    ctx: typer.Context,
    files: Annotated[
        list[str],
        typer.Argument(
            metavar="FILE...", help="programs, and folders of programs; - is standard input"
        ),
    ],
    machine: MachineOption = None,
    output: Annotated[
        str | None,
        typer.Option("-o", "--output", metavar="OUT", help="output file; - is standard output"),
    ] = None,
    output_dir: Annotated[
        str | None,
        typer.Option(
            metavar="DIR", help="write here under the same names; folders keep their tree"
        ),
    ] = None,
    in_place: Annotated[bool, typer.Option("--in-place", help="replace each program")] = False,
    controller: ControllerOption = None,
    form: Annotated[str, typer.Option("--as", help="one of the controller's forms")] = "stream",
    profile: ProfileOption = None,
    dialect: DialectOption = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="write drilling cycles out as explicit moves")
    ] = False,
    unroll: Annotated[
        bool, typer.Option("--unroll", help="write loops, branches and calls out")
    ] = False,
    rapid_feed: RapidFeedOption = None,
    rapid_clearance: ClearanceOption = None,
    subprograms: SubprogramsOption = None,
    report: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="write a report: .html to look at, .json(.gz) for programs, - on standard output; "
            "DIR/: one for each",
        ),
    ] = None,
    jobs: Annotated[
        int, typer.Option(min=1, help="processes at work, on many programs or on a large one")
    ] = 1,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict", help="refuse rapids left alone, and rapids that only one reader knows"
        ),
    ] = False,
    check: Annotated[
        bool, typer.Option("--check", help="write nothing; exit 3 if anything would change")
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
        bool,
        typer.Option("--force", help="accept a program processed before; replace any output file"),
    ] = False,
    backup: Annotated[
        bool, typer.Option("--backup", help="with --in-place: keep the original as FILE.orig")
    ] = False,
    revert: Annotated[
        bool, typer.Option("--revert", help="put the originals that --backup kept back")
    ] = False,
    if_changed: Annotated[
        bool,
        typer.Option(
            "--if-changed", help="skip programs whose output is newer and of these options"
        ),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="print a line of JSON for each program")
    ] = False,
    verbose: Annotated[
        bool, typer.Option("-v", "--verbose", help="print where rapids were left alone, and why")
    ] = False,
    quiet: Annotated[bool, typer.Option("-q", "--quiet", help="print errors and notes")] = False,
) -> None:
    """Rewrite every rapid that is certain; verify; write the result in one move."""
    from gcodejerk.batch.files import STANDARD
    from gcodejerk.batch.inputs import find_inputs
    from gcodejerk.batch.jobs import run_jobs
    from gcodejerk.cli.outputs import Outputs
    from gcodejerk.hosts.slicers import output_name
    from gcodejerk.rewrite.pipeline import Settings

    # A slicer gives the program a name for the time being, and says the user's.
    called = output_name() if in_place and len(files) == 1 else None
    outputs = Outputs(output, output_dir, in_place, report, backup, if_changed, called)
    if revert:
        _refuse_beside_revert(ctx)
        _revert(files, quiet)
        return
    mode = _mode(check=check, diff=diff)
    outputs.check(files, trial=_TRIALS.get(mode, ""), as_json=as_json)
    refuse((as_json and verbose, "--json has no lines of rapids: -v, or --report FILE.json"))
    found, problems = find_inputs(files, output_dir)
    many = len(found) + len(problems) > 1
    outputs.check_single(many or any(map(os.path.isdir, files)))
    settings = Settings(
        controller=controller,
        form=form,
        profile=profile,
        dialect=dialect,
        comments=not no_comments,
        verify=not no_verify,
        force=force,
        expand_cycles=expand_cycles,
        unroll=unroll,
    )
    described = counting(load_machine(machine, files), rapid_feed, rapid_clearance)
    described = calling(described, subprograms)
    batch = outputs.jobs(found, described, settings, mode=mode, strict=strict)
    held = (STANDARD in (job.output, job.report) for job in batch)
    aside = diff or (mode == "write" and any(held))
    tally = _Tally(mode, quiet, aside=aside, many=many, as_json=as_json, verbose=verbose)
    for problem in problems:
        tally.fail(str(problem))
    with progress(quiet) as show, closing(run_jobs(batch, described, settings, jobs, show)) as runs:
        for done in runs:
            if show is not None:
                show.clear()
            tally.add(done)
    if many and not as_json:
        tally.finish()
    if tally.failed:
        raise typer.Exit(1)
    if check and tally.changed:
        raise typer.Exit(WOULD_CHANGE)


_TRIALS = {"diff": "--diff", "check": "--check"}
"""Modes in which nothing is written, by their options."""


def _mode(*, check: bool, diff: bool) -> Literal["write", "check", "diff"]:
    """What becomes of what is made of a program."""
    return "diff" if diff else "check" if check else "write"


BESIDE_REVERT = ("files", "revert", "quiet")


def _refuse_beside_revert(ctx: typer.Context) -> None:
    """Refuse options that say what becomes of a program: originals are put back, no more."""
    for one in ctx.command.params:
        name = one.name or ""
        if said(ctx, name) and name not in BESIDE_REVERT:
            option = "-o" if name == "output" else max(one.opts, key=len)
            raise typer.BadParameter(f"--revert puts originals back: no {option} beside it")


def _revert(files: list[str], quiet: bool) -> None:
    """Put originals back in the place of what was made of them."""
    from gcodejerk.batch.originals import put_back

    failed = False
    for name in files:
        try:
            kept = put_back(name)
            if not quiet:
                print(f"{name}: the original is back, from {kept}")
        except GcodejerkError as error:
            failed = True
            print(error, file=sys.stderr)
    if failed:
        raise typer.Exit(1)


class _Tally:
    """Prints the outcome of each program, and counts."""

    def __init__(
        self, mode: str, quiet: bool, *, aside: bool, many: bool, as_json: bool, verbose: bool
    ) -> None:
        self.mode, self.quiet, self.many = mode, quiet, many
        self.as_json, self.verbose = as_json, verbose
        self.out = sys.stderr if aside else sys.stdout
        self.programs = self.planned = self.left = self.failed = self.set = self.current = 0
        self.changed = False

    def fail(self, error: str) -> None:
        """Tell and count a failure."""
        self.programs += 1
        self.failed += 1
        print(error, file=sys.stderr)

    def add(self, done: Done) -> None:
        """Tell and count one program."""
        if self.as_json:
            print(json.dumps(done.record(), ensure_ascii=False, allow_nan=False), file=self.out)
        if done.error is not None:
            self.fail(done.error)
            return
        self.programs += 1
        self.planned += done.planned
        self.left += done.left
        self.set += bool(done.set_at)
        self.current += done.current
        self.changed |= done.changed
        if done.diff:
            sys.stdout.flush()
            sys.stdout.buffer.write(done.diff)
        for note in done.notes:  # -q or not: they are about what the machine will do
            say(f"{done.input}: note: {note}", sys.stderr)
        if self.as_json:
            return
        if self.mode == "check" and done.changed:
            print(f"{done.input}: would be changed")
        elif not self.quiet:
            say(done.summary, self.out)
            # Of many programs each has one line.
            if done.whole and not self.many:
                say(done.whole, self.out)
        if self.verbose:
            for reason, lines, count in done.left_at:
                more = f" and {count - len(lines)} more" if count > len(lines) else ""
                say(f"  {reason}: line {', '.join(map(str, lines))}{more}", self.out)

    def finish(self) -> None:
        """Print the line for the whole run."""
        if self.quiet:
            return
        would = "" if self.mode == "write" else "would be "
        current = f"{self.current} up to date, " if self.current else ""
        control = f"control {would}set in {self.set}, " if self.set else ""
        print(
            f"{self.programs} programs: {current}{control}{self.planned} rapids {would}rewritten, "
            f"{self.left} left alone; {self.failed or 'none'} failed",
            file=self.out,
        )


def inspect(
    file: Annotated[str, typer.Argument(metavar="FILE", help="a program; - is standard input")],
    machine: MachineOption = None,
    profile: ProfileOption = None,
    dialect: DialectOption = None,
    expand_cycles: Annotated[
        bool, typer.Option("--expand-cycles", help="write drilling cycles out as explicit moves")
    ] = False,
    unroll: Annotated[
        bool, typer.Option("--unroll", help="write loops, branches and calls out")
    ] = False,
    rapid_feed: RapidFeedOption = None,
    rapid_clearance: ClearanceOption = None,
    subprograms: SubprogramsOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="print the report as JSON")] = False,
) -> None:
    """Show all rapids of a program: planned, or left alone and why."""
    from gcodejerk.batch.files import open_input
    from gcodejerk.batch.reports import record_of
    from gcodejerk.report.tables import rapids_table, summary_line, whole_line
    from gcodejerk.rewrite.pipeline import Settings, process_file

    described = counting(load_machine(machine, [file]), rapid_feed, rapid_clearance)
    described = calling(described, subprograms)
    settings = Settings(
        profile=profile, dialect=dialect, force=True, expand_cycles=expand_cycles, unroll=unroll
    )
    with open_input(file) as source, progress(as_json) as show:
        result = process_file(source, None, described, settings, file, show)
        record = record_of(result, described, None, source, show, bounds=as_json)
    if as_json:
        print(json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False))
        return
    console().print(rapids_table(record))
    for note in record["notes"]:
        say(f"note: {note}")
    say(summary_line(file, record["summary"]).replace(" rewritten", " would be rewritten"))
    if whole := whole_line(record["summary"]):
        say(whole)
