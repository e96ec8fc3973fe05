"""Where the outputs and reports of a run go, as the user said it: `process` only."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path, PurePath

import typer

from gcodejerk.batch.files import STANDARD
from gcodejerk.batch.inputs import (
    Input,
    NameClashError,
    check_names,
    output_name,
    report_name,
)
from gcodejerk.batch.jobs import Job
from gcodejerk.emit import controller_of
from gcodejerk.machine import Machine
from gcodejerk.report.page import SUFFIX
from gcodejerk.rewrite.control_settings import PARAMETERS
from gcodejerk.rewrite.pipeline import Settings


@dataclass(frozen=True, slots=True)
class Outputs:
    """The options -o, --output-dir, --in-place and --report of one command."""

    output: str | None
    output_dir: str | None
    in_place: bool
    report: str | None
    backup: bool = False
    if_changed: bool = False
    called: str | None = None
    """What messages and reports call the program, where that is not its own name."""

    @property
    def report_dir(self) -> str | None:
        """The folder of the reports, where one was named."""
        return self.report if self.report is not None and self.report.endswith("/") else None

    def check(self, files: list[str], *, trial: str = "", as_json: bool = False) -> None:
        """Refuse options that contradict each other or the inputs, as wrong usage.

        `trial`: the option by which nothing is written, empty where there is none. It may be added
        to any run: the other options say which run that is.
        """
        piped = self.output == STANDARD or (self.output is None and STANDARD in files)
        self._check_standard(piped and not trial, trial == "--diff", as_json)
        if sum(map(bool, (self.output, self.output_dir, self.in_place))) > 1:
            raise typer.BadParameter("choose one of -o, --output-dir and --in-place")
        if "-" in files and len(files) > 1:
            raise typer.BadParameter("standard input (-) is one program: give it alone")
        if "-" in files and self.output_dir is not None:
            raise typer.BadParameter("standard input has no name to keep in a folder: say -o FILE")
        if self.if_changed and (self.in_place or piped):
            raise typer.BadParameter("--if-changed compares a program with its output: name one")
        if self.if_changed and self.report == STANDARD:
            raise typer.BadParameter(
                "--if-changed compares a program with its files: name a report"
            )
        if self.backup and not self.in_place:
            raise typer.BadParameter("--backup is of --in-place: elsewhere the original stays")
        if self.in_place and "-" in files:
            raise typer.BadParameter("--in-place needs a file, not standard input")

    def _check_standard(self, program: bool, difference: bool, as_json: bool) -> None:
        """Refuse two things on standard output, one of which is the program or the difference."""
        if self.report == STANDARD and (difference or as_json):
            raise typer.BadParameter("--report - has standard output to itself: no --diff, --json")
        if as_json and difference:
            raise typer.BadParameter("standard output holds one: the difference or --json")
        if as_json and program:
            raise typer.BadParameter(
                "standard output holds one: the program or --json; name a file with -o"
            )

    def check_single(self, many: bool) -> None:
        """Refuse names of single files where many programs are given, and reports of no name."""
        one_report = self.report if self.report_dir is None else None
        if many and (self.output is not None or one_report is not None):
            raise typer.BadParameter(
                "-o and --report FILE take one program; use --output-dir and --report DIR/"
            )
        kinds = (".json", ".json.gz", SUFFIX)
        if one_report not in (None, STANDARD) and not str(one_report).lower().endswith(kinds):
            raise typer.BadParameter(
                f"--report {one_report}: a report is a file .json.gz or .json, a page .html to "
                "look at, or - for JSON on standard output"
            )

    def jobs(
        self, found: list[Input], machine: Machine, settings: Settings, *, mode: str, strict: bool
    ) -> list[Job]:
        """One job for each program; two outputs of one name are wrong usage."""
        emitter = controller_of(machine, settings.controller)
        suffix, beside = emitter.suffix, emitter.beside
        if settings.form == PARAMETERS and settings.profile is not None:
            raise typer.BadParameter(
                "--as parameters sets the control, whose own rapids have no profile of ours: leave "
                "--profile out"
            )
        if suffix and self.in_place:
            raise typer.BadParameter(
                "--in-place: this controller's streams are a file of their own"
            )
        if mode == "diff" and not emitter.in_place:
            raise typer.BadParameter(
                f"--diff shows what changes in the program: controller {emitter.name} writes "
                "a file of its own"
            )
        outputs = [self._output(program, suffix) for program in found]
        if self.report == STANDARD and mode == "write" and STANDARD in outputs:
            raise typer.BadParameter(
                "standard output holds one: the program (-o -) or its report (--report -)"
            )
        if beside and mode == "write" and STANDARD in outputs:
            raise typer.BadParameter(
                f"controller {emitter.name} writes two files, the program and its {beside}: "
                "standard output holds one; name a file with -o"
            )
        try:
            check_names([program.path for program in found], outputs)
        except NameClashError as error:
            raise typer.BadParameter(f"{error.problem}; {error.remedy}") from None
        reports = [self._report(program) for program in found]
        return [
            Job(
                input=program.path,
                output=output,
                report=report,
                mode=mode,
                in_place=self.in_place,
                backup=self.backup,
                if_changed=self.if_changed,
                strict=strict,
                beside=output + beside if beside else None,
                name=self.called,
                new_folders=(
                    *_folder(output, self.output_dir),
                    *_folder(report, self.report_dir),
                ),
            )
            for program, output, report in zip(found, outputs, reports, strict=True)
        ]

    def _output(self, program: Input, suffix: str) -> str:
        """Where the result of a program goes."""
        if self.in_place:
            return program.path
        if self.output is not None:
            return self.output
        return "-" if program.path == "-" else output_name(program, self.output_dir, suffix)

    def _report(self, program: Input) -> str | None:
        """Where the report on a program goes."""
        if self.called is not None:
            program = Input(program.path, PurePath(self.called).name)
        return self.report if self.report_dir is None else report_name(program, self.report_dir)


def _folder(name: str | None, wanted: str | None) -> tuple[str, ...]:
    """The folder of an output, where it was named as one that may be made."""
    return () if name is None or wanted is None else (str(Path(name).parent),)
