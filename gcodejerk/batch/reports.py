"""The JSON report on a program: the result, with the text of each rapid's block from the source."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

from gcodejerk.machine import Machine
from gcodejerk.planning.bounds import known_limits
from gcodejerk.report.columns import FEW, write_rapids
from gcodejerk.report.records import Record, dump, process_record
from gcodejerk.report.tuning_record import settings_record
from gcodejerk.rewrite.pipeline import Progress, silent
from gcodejerk.rewrite.result import Result
from gcodejerk.storage import windows


def write_report(
    file: BinaryIO,
    result: Result,
    machine: Machine,
    output: str | None,
    source: BinaryIO,
    progress: Progress | None = None,
) -> None:
    """Write the JSON report on a result; parameters as for `record_of`."""
    if len(result.plans) <= FEW:
        file.write(dump(record_of(result, machine, output, source, progress)))
        return
    report = progress or silent
    limit = known_limits(result.plans, lambda done, total: report("bounds", done, total))
    more = {} if result.settings is None else settings_record(result.settings)
    write_rapids(
        file, result, machine, output, _blocks(result, source), limit, more,
        lambda done, total: report("reporting", done, total),
    )  # fmt: skip


def _blocks(result: Result, source: BinaryIO) -> Iterator[str]:
    """The text of each rapid's block."""
    rapids = result.program.rapids
    for part in windows(len(rapids)):
        places = zip(rapids.begin[part].tolist(), rapids.end[part].tolist(), strict=True)
        for begin, end in places:
            source.seek(begin)
            yield source.read(end - begin).decode("latin-1").strip()


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
    blocks = list(_blocks(result, source))
    limit = None
    if bounds:
        report = progress or silent
        limit = known_limits(result.plans, lambda done, total: report("bounds", done, total))
    record = process_record(result, machine, output, blocks, limit)
    return record if result.settings is None else record | settings_record(result.settings)
