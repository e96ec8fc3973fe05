"""Many programs in one run: each on its own, so that one that fails stops none of the others.

This module owns what happens around `process_file` for one file: opening, the output's rename, the
report, `--check` and `--diff`.

Rule: whatever happens to one program is told of that program, be it an error of the system, a bug
of ours or the death of the process that worked on it. Only for a single program a bug keeps its
traceback.
"""

from __future__ import annotations

import os
import tempfile
import traceback
from collections.abc import Callable, Generator
from contextlib import ExitStack, closing, nullcontext
from dataclasses import dataclass, field, replace
from functools import partial
from typing import BinaryIO

import numpy as np

from gcodejerk.batch.copies import is_copy, remember_copy
from gcodejerk.batch.current import is_current
from gcodejerk.batch.files import (
    STANDARD,
    is_ours,
    is_report,
    make_folder,
    new_file,
    open_input,
    same_content,
    same_file,
    version,
)
from gcodejerk.batch.originals import keep
from gcodejerk.batch.pool import LostError, Pool
from gcodejerk.batch.reports import write_report
from gcodejerk.batch.workers import map_jobs
from gcodejerk.errors import EmitError, GcodejerkError
from gcodejerk.machine import Machine
from gcodejerk.reasons import REASONS
from gcodejerk.report.columns import PACKED, packed
from gcodejerk.report.difference import difference
from gcodejerk.report.page.document import is_page, write_page
from gcodejerk.report.records import Record, summary_of
from gcodejerk.report.tables import summary_line, whole_line
from gcodejerk.rewrite.pipeline import Progress, Settings, process_file
from gcodejerk.rewrite.result import Result
from gcodejerk.rewrite.rewriter import changed_error
from gcodejerk.spread import Spread, here

FIRST_LINES = 12
"""Of rapids that were left alone, for each reason."""


@dataclass(frozen=True, slots=True)
class Job:
    """One program: where it comes from and where it goes."""

    input: str
    output: str
    report: str | None
    mode: str
    """write, check or diff"""
    in_place: bool
    """The output is meant to replace the input."""
    strict: bool
    new_folders: tuple[str, ...] = ()
    """Are made where they are missing."""
    beside: str | None = None
    """What belongs to the output, for controllers that write such a file."""
    backup: bool = False
    """The original is kept where it is replaced."""
    if_changed: bool = False
    """Leave an output as it is that stands for the program already."""
    name: str | None = None
    """What messages call the program; its own name where None."""

    @property
    def called(self) -> str:
        """What messages call the program."""
        return self.input if self.name is None else self.name


@dataclass(frozen=True, slots=True)
class Done:
    """The outcome of one program; `error` is a message where it failed."""

    input: str
    planned: int = 0
    """Rapids that were rewritten, and left alone."""
    left: int = 0
    written_out: int = 0
    """Blocks of drilling cycles that became explicit moves, loops and calls written out."""
    set_at: int = 0
    """Places at which lines set the control, or take that back."""
    summary: str = ""
    notes: tuple[str, ...] = ()
    diff: bytes = b""
    whole: str = ""
    """What the whole program leaves and lasts, where that is known."""
    error: str | None = None
    output: str | None = None
    figures: Record = field(default_factory=dict)
    """Summary of the report."""
    current: bool = False
    """The output was there, and stands for the program."""
    left_at: tuple[tuple[str, tuple[int, ...], int], ...] = ()
    """Reason, the first lines of rapids that were left alone for it, and how many there are."""

    def record(self) -> Record:
        """The same, for other programs."""
        return {
            "input": self.input,
            "output": self.output,
            "error": self.error,
            "changed": self.changed,
            "current": self.current,
            "summary": self.figures or None,
            "notes": list(self.notes),
        }

    @property
    def changed(self) -> bool:
        """Whether the output is not the input."""
        return self.planned > 0 or self.written_out > 0 or self.set_at > 0


def run_jobs(
    jobs: list[Job], machine: Machine, settings: Settings, workers: int, progress: Progress | None
) -> Generator[Done, None, None]:
    """Process programs, in their order.

    Parameters
    ----------
    jobs : list of Job
        The programs.
    machine : Machine
        What they run on.
    settings : Settings
        The user's choices.
    workers : int
        How many processes work at a time: on a program each, or all on one if that is alone.
    progress : callable or None
        See `pipeline.Progress`; where several work at a time, it counts the programs.

    Yields
    ------
    Done
        One for each job.
    """
    if len(jobs) == 1:
        with Pool(workers) as pool:
            spread = here if workers == 1 else pool.map
            yield run_job(jobs[0], machine, settings, progress, spread)
    elif workers == 1:
        for job in jobs:
            yield _run_whatever_happens(job, machine, settings, progress)
    else:
        work = partial(_run_whatever_happens, machine=machine, settings=settings, progress=None)
        with closing(map_jobs(work, jobs, workers, _lost)) as answers:
            for number, done in enumerate(answers, 1):
                yield done
                if progress is not None:
                    progress("programs", number, len(jobs))


def run_job(
    job: Job,
    machine: Machine,
    settings: Settings,
    progress: Progress | None,
    spread: Spread = here,
) -> Done:
    """Process one program; a user's mistake, or the system's refusal, becomes a message."""
    try:
        return _run(job, machine, settings, progress, spread)
    except BrokenPipeError:
        raise
    except LostError as error:
        return _lost(job, error.status)
    except GcodejerkError as error:
        return Done(job.called, error=str(error))
    except MemoryError:
        problem = "there is not enough memory"
        return Done(job.called, error=str(EmitError(f"{job.input}: {problem}", "use fewer --jobs")))
    except OSError as error:
        return Done(job.called, error=f"{job.input}: {error}")


def _run_whatever_happens(
    job: Job, machine: Machine, settings: Settings, progress: Progress | None
) -> Done:
    """The same for one of many; a bug of ours is told and does not stop the others."""
    try:
        return run_job(job, machine, settings, progress)
    except Exception:
        bug = EmitError(
            f"{job.input}: failed by a bug of gcodejerk, please report it; nothing was written",
            traceback.format_exc(),
        )
        return Done(job.called, error=str(bug))


def _lost(job: Job, status: int | None) -> Done:
    """What to say of a job whose process died."""
    how = f"signal {-status}" if status is not None and status < 0 else f"status {status}"
    lost = EmitError(
        f"{job.input}: the process that worked on it died ({how})",
        "if memory was short, use fewer --jobs; otherwise please report it",
    )
    return Done(job.called, error=str(lost))


def _run(
    job: Job, machine: Machine, settings: Settings, progress: Progress | None, spread: Spread
) -> Done:
    _refuse_overwriting(job, machine)
    writes = job.mode == "write"
    if job.if_changed and writes and not job.strict:  # what is left alone, no stamp says
        others = [name for name in (job.report, job.beside) if name is not None]
        if is_current(job.input, job.output, others, machine, settings):
            summary = f"{job.called}: {job.output} is up to date"
            return Done(job.called, summary=summary, output=job.output, current=True)
    with ExitStack() as stack:
        before = version(job.input)
        source = stack.enter_context(open_input(job.input))
        # In place, the program is replaced only where something has changed.
        keeps = job.in_place and job.beside is None
        done: Done | None = None
        files = _opened(job, stack, lambda: done is None or done.changed or not keeps)
        result = process_file(
            source, files.target, machine, settings, job.called, progress, files.beside, spread
        )
        _refuse_if_strict(job, result)
        _write_report(job, files, result, machine, source, progress)
        if writes and not settings.force:
            if not job.in_place:
                _refuse_foreign(job, source, files.target)
            _refuse_foreign_beside(job)
        diff = difference(source, files.target, result) if job.mode == "diff" else b""
        if job.in_place and version(job.input) != before:
            raise changed_error(job.input)  # an edit of the user's would be lost
        done = _done(job, result, diff)
        if job.backup and writes and done.changed:
            keep(job.input, source)
    return _with_output(job, done, keeps=keeps)


@dataclass(frozen=True, slots=True)
class _Outputs:
    """Files that a program goes to, open."""

    target: BinaryIO
    beside: BinaryIO | None
    report: BinaryIO | None


def _opened(job: Job, stack: ExitStack, replaces: Callable[[], bool]) -> _Outputs:
    """Open the outputs; as the stack closes without an error they get their names, reports last."""
    beside: BinaryIO | None = None
    if job.mode != "write":
        target: BinaryIO = stack.enter_context(tempfile.TemporaryFile())  # noqa: SIM115
        if job.beside is not None:
            beside = stack.enter_context(tempfile.TemporaryFile())  # noqa: SIM115
        return _Outputs(target, beside, None)
    for name in job.new_folders:
        make_folder(name)
    report = None if job.report is None else stack.enter_context(new_file(job.report))
    target = stack.enter_context(new_file(job.output, job.input, replaces))
    if job.beside is not None:
        # It is in its place before the program, which names it by its sum.
        beside = stack.enter_context(new_file(job.beside, like=job.input))
    return _Outputs(target, beside, report)


def _write_report(
    job: Job,
    files: _Outputs,
    result: Result,
    machine: Machine,
    source: BinaryIO,
    progress: Progress | None,
) -> None:
    """Write the report that is asked for, as a page or as JSON."""
    report, name = files.report, job.report or ""
    if report is None:
        return
    if is_page(name):
        written = sum(f.seek(0, 2) for f in (files.target, files.beside) if f is not None)
        write_page(report, result, machine, job.output, source, written)
    else:
        packs = name.lower().endswith(PACKED)
        with packed(report) if packs else nullcontext(report) as file:
            write_report(file, result, machine, job.output, source, progress)
    report.flush()  # a full disk shows here, and not when the output is in its place


def _done(job: Job, result: Result, diff: bytes) -> Done:
    """What became of a program."""
    steps = (result.expansion, result.unrolling)
    written = sum(step.written for step in steps if step is not None)
    places = 0 if result.settings is None else result.settings.places
    left = result.left if result.settings is None else result.unserved
    figures = summary_of(result)
    return Done(
        job.called, result.planned, left, written, places, summary_line(job.called, figures),
        result.notes, diff, whole_line(figures), figures=figures, left_at=_left_at(result),
    )  # fmt: skip


def _refuse_if_strict(job: Job, result: Result) -> None:
    """Refuse what --strict does: rapids that were left alone, or that one reading alone knows."""
    if job.strict and (result.unserved or result.read_once):
        summary = summary_line(job.called, summary_of(result))
        raise EmitError(summary, "--strict refuses this; `gcodejerk inspect` shows every rapid")


def _with_output(job: Job, done: Done, *, keeps: bool) -> Done:
    """The same with the name of what was written."""
    if job.mode != "write" or job.output == STANDARD:
        return done
    if keeps and not done.changed:
        return replace(done, summary=f"{done.summary}; the file is as it was")
    if (
        not (job.in_place or done.changed)
        and os.path.isfile(job.output)
        and not is_ours(job.output)
    ):
        remember_copy(job.output)
    to = job.called if job.in_place else job.output
    more = f" and {job.beside}" if job.beside else ""
    return replace(done, summary=f"{done.summary} -> {to}{more}", output=to)


def _left_at(result: Result) -> tuple[tuple[str, tuple[int, ...], int], ...]:
    """Where rapids were left alone, by reason, the most frequent first."""
    reason, line = result.plans.reason, result.program.rapids.line
    codes, counts = np.unique(reason[~result.plans.planned], return_counts=True)
    return tuple(
        (
            str(REASONS[codes[k]]),
            tuple(line[np.flatnonzero(reason == codes[k])[:FIRST_LINES]].tolist()),
            int(counts[k]),
        )
        for k in np.argsort(-counts, kind="stable").tolist()
    )


def _refuse_overwriting(job: Job, machine: Machine) -> None:
    """An output or report that is the input or the machine file, under whatever name."""
    for name in (None if job.in_place else job.output, job.report, job.beside):
        if name is None or job.mode != "write":
            continue
        if same_file(job.input, name):
            raise EmitError(
                f"{name} is the input itself",
                "choose another name, or say --in-place to replace the program",
            )
        if same_file(machine.source, name):
            raise EmitError(f"{name} is the machine file", "choose another name")
    report, others = job.report, (name for name in (job.output, job.beside) if name is not None)
    if report is not None and job.mode == "write" and any(same_file(report, n) for n in others):
        raise EmitError(f"{report} would hold the output and the report", "choose another name")


def _refuse_foreign_beside(job: Job) -> None:
    """A file in the place of the samples that gcodejerk has not written."""
    name = job.beside
    if name is not None and os.path.isfile(name) and not is_ours(name):
        raise EmitError(
            f"{name} exists and was not written by gcodejerk",
            "choose another name for the output, or remove the file",
        )


def _refuse_foreign(job: Job, source: BinaryIO, target: BinaryIO) -> None:
    """An output or report that is there already, and that gcodejerk has not written.

    What holds the very bytes of the program, those that are about to be written, or those of an
    earlier run, may be replaced: nothing is lost.
    """
    for name, own in ((job.output, is_ours), (job.report, is_report)):
        if name is None or name == STANDARD or not os.path.isfile(name) or own(name):
            continue
        if name == job.output and (
            same_content(name, source) or same_content(name, target) or is_copy(name)
        ):
            continue
        raise EmitError(
            f"{name} exists and was not written by gcodejerk: it carries no stamp",
            "choose another name, remove the file, or add --force to replace it",
        )
