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

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.nc import Rapids
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.settling import Left
from gcodejerk.report.records import Record, Records, number, process_head
from gcodejerk.rewrite.result import Result
from gcodejerk.spread import ahead
from gcodejerk.storage import release

FEW = 2000
"""Rapids up to which a report is written with blanks and line ends."""
AT_ONCE = 1024
"""Rapids whose records are made together."""
REMEMBERED = 4096
"""Records of plans that are kept, some kB each."""
PACKED = ".gz"
_SPELL = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode
"""What is not ASCII stands as it is."""
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
    count, places, known = len(result.plans), _Places(result.program.rapids), dict[bytes, bytes]()

    def texts() -> Iterator[bytes]:
        for begin in range(0, count, AT_ONCE):
            rows = np.arange(begin, min(begin + AT_ONCE, count))
            motions = _motions(result, rows, limit, known)
            lines = map(bytes.__add__, places.texts(rows, blocks), motions)
            yield (b",\n" if begin else b"\n") + b",\n".join(lines)
            progress(begin + len(rows), count)
            release()

    # Most of the writing is packing, in which the interpreter has no part.
    for _ in ahead(file.write, texts()):
        pass
    file.write(b"]}\n")


@contextmanager
def packed(file: BinaryIO) -> Iterator[BinaryIO]:
    """What compresses into a file; the same text always gives the same bytes."""
    with gzip.GzipFile(filename="", mode="wb", fileobj=file, compresslevel=6, mtime=0) as into:
        yield cast(BinaryIO, into)


class _Places:
    """Where rapids stand, and from where to where they lead, as text; `place_record` has the keys.

    Numbers come again and again, and each is spelled once.
    """

    def __init__(self, rapids: Rapids) -> None:
        self.rapids = rapids
        self._spelled: dict[int, str] = {}
        self._axes: dict[int, list[tuple[int, str]]] = {}

    def texts(self, rows: NDArray[np.int64], blocks: Iterator[str]) -> list[bytes]:
        """The beginnings of their records, up to what was made of them."""
        rapids, out = self.rapids, []
        table = zip(
            rapids.line[rows].tolist(),
            rapids.words[rows].tolist(),
            rapids.start[rows].view(np.int64).tolist(),
            rapids.target[rows].view(np.int64).tolist(),
            blocks,
            strict=False,  # blocks go on behind these rows, and stand last: none is lost
        )
        for line, words, start, target, block in table:
            axes = self._axes_of(words)
            out.append(
                f'{{"line":{line},"block":{_SPELL(block)},'
                f'"start":{{{self._positions(axes, start)}}},'
                f'"end":{{{self._positions(axes, target)}}},'.encode("utf-8", "backslashreplace")
            )
        return out

    def _axes_of(self, words: int) -> list[tuple[int, str]]:
        """Index and key of each axis that a block names."""
        if words not in self._axes:
            named = [(k, f'"{axis}":') for k, axis in enumerate(AXES) if words >> k & 1]
            self._axes[words] = named
        return self._axes[words]

    def _positions(self, axes: list[tuple[int, str]], position: list[int]) -> str:
        """Positions of these axes, given by the bits of their numbers: 0.0 and -0.0 differ."""
        return ",".join([key + self._number(position[k]) for k, key in axes])

    def _number(self, bits: int) -> str:
        """How a number is written."""
        text = self._spelled.get(bits)
        if text is None:
            if len(self._spelled) >= REMEMBERED:
                self._spelled.clear()
            text = _SPELL(number(float(np.int64(bits).view(np.float64))))
            self._spelled[bits] = text
        return text


def _motions(
    result: Result, rows: NDArray[np.int64], limit: Array | None, known: dict[bytes, bytes]
) -> list[bytes]:
    """What was made of some rapids, as text without its bracket; of those of one plan, once."""
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
            text = known[key] = _text(records.motion(row))[1:]
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
    return _SPELL(record).encode("utf-8", "backslashreplace")
