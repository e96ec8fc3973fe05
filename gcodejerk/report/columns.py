"""The JSON report of a large program, written as it is made.

A report has one record for each rapid; as Python objects a hundred thousand of them take gigabytes.
This module owns their way into the file: some thousand rapids at a time, those of one plan made
once, and each on a line of its own without blanks. What a reader of JSON gets is the same.

Rule: a report of few rapids is written as ever, for people to read.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.settling import Left
from gcodejerk.report.records import Record, Records, place_record, process_head
from gcodejerk.rewrite.result import Result
from gcodejerk.storage import release

FEW = 2000
"""Rapids up to which a report is written with blanks and line ends."""
AT_ONCE = 4096
"""Rapids whose records are made together."""
REMEMBERED = 4096
"""Records of plans that are kept, some kB each."""
PACKED = ".gz"
Progress = Callable[[int, int], None]


def write_rapids(
    file: BinaryIO,
    result: Result,
    machine: Machine,
    output: str | None,
    blocks: Iterator[str],
    limit: Array | None,
    more: Record,
    progress: Progress,
) -> None:
    """Write the report on a processed program.

    Parameters
    ----------
    file : binary file
        Takes it.
    result : Result
        Of `process`.
    machine : Machine
        What it was processed for.
    output : str or None
        Name of the file that was written.
    blocks : iterator of str
        Text of each rapid's block.
    limit : ndarray, shape (n,), or None
        As for `records.process_record`. [mm]
    more : dict
        What the report says besides.
    progress : callable
        Called with the number of rapids that are written, and of all.
    """
    head = _text(process_head(result, machine, output) | more)
    file.write(head[:-1] + b',\n"rapids":[')
    count, known = len(result.plans), dict[bytes, bytes]()
    for begin in range(0, count, AT_ONCE):
        rows = np.arange(begin, min(begin + AT_ONCE, count))
        motions = _motions(result, rows, limit, known)
        lines = []
        for row, motion in zip(rows.tolist(), motions, strict=True):
            place = _text(place_record(result.program.rapids, row, next(blocks)))
            lines.append(place[:-1] + b"," + motion[1:])
        file.write((b",\n" if begin else b"\n") + b",\n".join(lines))
        progress(begin + len(rows), count)
        release()
    file.write(b"]}\n")


@contextmanager
def packed(file: BinaryIO) -> Iterator[BinaryIO]:
    """What compresses into a file; the same text always gives the same bytes."""
    with gzip.GzipFile(filename="", mode="wb", fileobj=file, compresslevel=6, mtime=0) as into:
        yield cast(BinaryIO, into)


def _motions(
    result: Result, rows: NDArray[np.int64], limit: Array | None, known: dict[bytes, bytes]
) -> list[bytes]:
    """What was made of some rapids, as text; of those that have one plan, once."""
    plans, rest = result.plans.repeated(rows), result.rest.take(rows)
    records = Records(
        plans,
        result.residual[rows],
        result.conventional_residual[rows],
        None if limit is None else limit[rows],
        result.deviation[rows],
        rest,
    )
    out = []
    for row, key in enumerate(_keys(plans, records, rest)):
        text = known.get(key)
        if text is None:
            if len(known) >= REMEMBERED:
                known.clear()
            text = known[key] = _text(records.motion(row))
        out.append(text)
    return out


def _keys(plans: Plans, records: Records, rest: Left) -> list[bytes]:
    """All that the record of each move is made of."""
    columns = [
        plans.reason, plans.displacement, plans.length, plans.conventional_time, plans.counts,
        plans.times, records.residual, records.conventional, records.acceleration,
        records.conventional_acceleration, records.extension, records.limit, records.deviation,
        rest.length, rest.time,
    ]  # fmt: skip
    matrix = np.column_stack([np.asarray(c, dtype=np.float64) for c in columns])
    numbers = memoryview(np.ascontiguousarray(matrix).tobytes())
    width = 8 * matrix.shape[1]
    parts = [np.column_stack([plans.share, plans.profile_times])]
    # Equal indices are equal profiles: all of these are rows of the same plans.
    profiles = np.column_stack([_index(plans.profiles), _index(plans.conventional)])
    bounds = np.searchsorted(plans.move, np.arange(len(plans) + 1)).tolist()
    out = []
    for row in range(len(plans)):
        key = [bytes(numbers[row * width : (row + 1) * width])]
        begin, end = bounds[row], bounds[row + 1]
        if end > begin:
            key.append(parts[0][begin:end].tobytes())
            key.append(profiles[begin:end].tobytes())
        out.append(b"".join(key))
    return out


def _index(profiles: Profiles) -> NDArray[np.int64]:
    """Which of the different profiles each is."""
    assert isinstance(profiles, RepeatedProfiles)
    return profiles.like


def _text(record: Record) -> bytes:
    """A record without blanks; what is not UTF-8 as `records.dump` has it."""
    text = json.dumps(record, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", "backslashreplace")
