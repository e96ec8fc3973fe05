"""Many programs in one run: each on its own, so that one that fails stops none of the others.

This module owns what happens around `process_file` for one file: opening, the output's rename, the
report, `--check` and `--diff`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
from typing import BinaryIO

from gcodejerk.designs import known_limits
from gcodejerk.errors import EmitError, GcodejerkError
from gcodejerk.files import STANDARD, new_file, open_input, same_file
from gcodejerk.machine import Machine
from gcodejerk.pipeline import Progress, Result, Settings, process_file, silent
from gcodejerk.report.difference import difference
from gcodejerk.report.records import Record, dump, process_record, summary_of
from gcodejerk.report.tables import summary_line


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


@dataclass(frozen=True, slots=True)
class Done:
    """What became of one program; `error` is a message where it failed."""

    input: str
    changed: bool = False
    summary: str = ""
    notes: tuple[str, ...] = ()
    diff: bytes = b""
    error: str | None = None


def run_jobs(
    jobs: list[Job], machine: Machine, settings: Settings, workers: int, progress: Progress | None
) -> Iterator[Done]:
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
        How many are worked on at a time.
    progress : callable or None
        For a single worker.

    Yields
    ------
    Done
        One for each job.
    """
    if workers == 1 or len(jobs) == 1:
        for job in jobs:
            yield run_job(job, machine, settings, progress)
        return
    with ProcessPoolExecutor(max_workers=min(workers, len(jobs))) as pool:
        for future in [pool.submit(run_job, job, machine, settings, None) for job in jobs]:
            yield future.result()


def run_job(job: Job, machine: Machine, settings: Settings, progress: Progress | None) -> Done:
    """Process one program; a user's mistake becomes a message."""
    try:
        return _run(job, machine, settings, progress)
    except GcodejerkError as error:
        return Done(job.input, error=str(error))


def _run(job: Job, machine: Machine, settings: Settings, progress: Progress | None) -> Done:
    _refuse_overwriting(job)
    with ExitStack() as stack:
        source = stack.enter_context(open_input(job.input))
        # The outputs are renamed when the stack closes without an error, the report last.
        report = None
        if job.report is not None and job.mode == "write":
            report = stack.enter_context(new_file(job.report))
        if job.mode == "write":
            target: BinaryIO = stack.enter_context(new_file(job.output, like=job.input))
        else:
            target = stack.enter_context(tempfile.TemporaryFile())
        result = process_file(source, target, machine, settings, job.input, progress)
        summary = summary_line(job.input, summary_of(result))
        if job.strict and result.left:
            raise EmitError(summary, "--strict refuses this; `gcodejerk inspect` shows every rapid")
        if report is not None:
            report.write(dump(record_of(result, machine, job.output, source, progress)))
        diff = difference(source, target, result) if job.mode == "diff" else b""
    if job.mode == "write" and job.output != STANDARD:
        summary += f" -> {job.output}"
    written = 0 if result.expansion is None else result.expansion.written
    changed = result.planned > 0 or written > 0
    return Done(job.input, changed, summary, result.notes, diff)


def record_of(
    result: Result,
    machine: Machine,
    output: str | None,
    source: BinaryIO,
    progress: Progress | None = None,
    bounds: bool = True,
) -> Record:
    """The report on a result, with the text of each rapid's block read from the source.

    Parameters
    ----------
    result : Result
        Of `process_file`.
    machine : Machine
        What it was processed for.
    output : str or None
        Name of the file that was written.
    source : binary file
        The program.
    progress : callable, optional
        See `pipeline.Progress`.
    bounds : bool
        Whether to compute the limit of each rapid, which takes some 10 ms for each distinct one.

    Returns
    -------
    dict
        Section 4 of the contract.
    """
    rapids = result.program.rapids
    blocks = []
    for begin, end in zip(rapids.begin.tolist(), rapids.end.tolist(), strict=True):
        source.seek(begin)
        blocks.append(source.read(end - begin).decode("latin-1").strip())
    limit = None
    if bounds:
        report = progress or silent
        limit = known_limits(result.plans, lambda done, total: report("bounds", done, total))
    return process_record(result, machine, output, blocks, limit)


def _refuse_overwriting(job: Job) -> None:
    """An output or report that is the input, under whatever name."""
    for name in (None if job.in_place else job.output, job.report):
        if name is not None and job.mode == "write" and same_file(job.input, name):
            raise EmitError(
                f"{name} is the input itself",
                "choose another name, or say --in-place to replace the program",
            )
