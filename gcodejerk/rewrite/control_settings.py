"""Settings of the control into a program: tuned for its own rapids, taken back where it ends.

This module owns `process --as parameters`: the tuning for one program, the lines around its blocks,
and what is told of it. Where nothing is gained, the program stays as it is.

Rule: whole lines are inserted, and not a byte of the program is changed.
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.emit.program_lines import ProgramLines, program_lines
from gcodejerk.emit.sheets import Change, Sheets
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.nc import Program, find_dialect
from gcodejerk.parameters import Tuning, joined_moves, program_moves, tune
from gcodejerk.rewrite.rewriter import COPY_SIZE, changed_error
from gcodejerk.rewrite.stamp import SUM_DIGITS, SUM_MARK, SUM_UNKNOWN, SUM_WITHIN
from gcodejerk.rewrite.stops import SET, Stop, find_stops

PARAMETERS = "parameters"
"""The form of a controller in which its own settings are written."""


@dataclass(frozen=True, slots=True, eq=False)
class ControlSettings:
    """What became of one program.

    Attributes
    ----------
    tuning : Tuning or None
        None where no rapid can be tuned for.
    changed : tuple of Change
        The settings, old and new; empty where nothing is gained.
    places : int
        At which lines were inserted.
    notes : tuple of str
        For the user.
    """

    tuning: Tuning | None
    changed: tuple[Change, ...]
    places: int
    notes: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Inserted:
    """Lines at their places, and what was done."""

    settings: ControlSettings
    stops: tuple[Stop, ...]
    lines: ProgramLines | None


def plan_settings(
    source: BinaryIO, program: Program, machine: Machine, emitter: Sheets
) -> Inserted:
    """Tune a control for one program and find where its lines belong.

    Raises
    ------
    EmitError
        The control's old settings are not known, or the program could skip a line.
    """
    try:
        moves = joined_moves([program_moves(program.rapids, source, machine)], machine)
        scheme = emitter.scheme(machine, emitter.program_way)
        tuning = tune(scheme, moves, machine, curve=False)
    except PlanError as error:
        note = f"left as it is: {error.problem}"
        return Inserted(ControlSettings(None, (), 0, (note,)), (), None)
    if not tuning.gains:
        note = "left as it is: no settings of the control leave less than today's in no more time"
        return Inserted(ControlSettings(tuning, (), 0, (note,)), (), None)
    lines = program_lines(emitter, tuning)
    stops = find_stops(source, program, emitter, machine)
    notes = (
        emitter.acts_on,
        "taken back to: " + ", ".join(f"{c.setting.key} {c.old}" for c in lines.changed if c.old),
        *tuning.scheme.notes,
    )
    settings = ControlSettings(tuning, lines.changed, len(stops), notes)
    return Inserted(settings, stops, lines)


def write_settings(
    source: BinaryIO,
    target: BinaryIO,
    program: Program,
    inserted: Inserted,
    stamp: bytes,
    name: str,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Copy a program with the lines in their places.

    Parameters
    ----------
    source, target : BinaryIO
        The program; an empty file, seekable.
    program : Program
        As it was read.
    inserted : Inserted
        Of `plan_settings`.
    stamp : bytes
        Text of the stamp.
    name : str
        Of the control.

    Returns
    -------
    edits, hunks : ndarray of int, shapes (k, 3) and (k, 5)
        As in `Result`.
    """
    writer = _Writer(source, target, program)
    lines = inserted.lines
    for k, stop in enumerate(inserted.stops if lines is not None else ()):
        assert lines is not None
        texts = [text.encode() for text in (lines.prefix if stop.what == SET else lines.restore)]
        if k == 0:
            texts = [*_head(program, stamp, name), *texts]
        writer.insert(stop, texts, last=k == len(inserted.stops) - 1)
    writer.finish()
    table = np.array(writer.edits, dtype=np.int64).reshape(-1, 5)
    edits = np.column_stack([table[:, :2], np.full(len(table), -1)])
    return edits.astype(np.int64), table


def _head(program: Program, stamp: bytes, name: str) -> list[bytes]:
    """The stamp, and the line by which `verify` knows these settings."""
    writing = find_dialect(program.dialect).writing
    opens, closes = (b"; ", b"") if writing is None else writing.comment
    note = f"gcodejerk settings for {name}: taken back at each stop and end".encode()
    return [opens + text + closes for text in (stamp, note)]


class _Writer:
    """Copies the source and inserts lines, with the sum that the stamp carries."""

    def __init__(self, source: BinaryIO, target: BinaryIO, program: Program) -> None:
        self.source, self.target, self.program = source, target, program
        self.digest = hashlib.blake2b(digest_size=16)
        self.written = hashlib.blake2b(digest_size=SUM_DIGITS // 2)
        self.sum_at: int | None = None
        self.at = 0
        self.open_line = False
        self.edits: list[tuple[int, int, int, int, int]] = []
        source.seek(0)

    def insert(self, stop: Stop, lines: Sequence[bytes], last: bool) -> None:
        """Put lines at a place; those behind a last line without an end end the file so."""
        self._copy(stop.offset)
        newline = self.program.newline
        text = b"".join(line + newline for line in lines)
        if self.open_line:
            text = newline + text.removesuffix(newline)
        begin = self.target.tell()
        found = text.find(SUM_UNKNOWN)
        if found >= 0 and begin < SUM_WITHIN:
            self.sum_at = begin + found + len(SUM_MARK)
        elif found >= 0:
            text = text.replace(SUM_UNKNOWN, b"")
        self._put(text)
        self.edits.append((begin, begin + len(text), stop.line, stop.offset, stop.offset))

    def finish(self) -> None:
        """Copy the rest, see that the source is what was read, and write the sum."""
        self._copy(self.program.size)
        if self.source.read(1) or self.digest.digest() != self.program.digest:
            raise changed_error(self.program.name)
        if self.sum_at is not None:
            self.target.seek(self.sum_at)
            self.target.write(self.written.hexdigest().encode())
            self.target.seek(0, io.SEEK_END)
        self.target.flush()

    def _copy(self, end: int) -> None:
        while self.at < end:
            data = self.source.read(min(end - self.at, COPY_SIZE))
            if not data:
                raise changed_error(self.program.name)
            self.at += len(data)
            self.digest.update(data)
            self.open_line = not data.endswith(b"\n")
            if self.at <= 3:  # a byte order mark is no line
                self.open_line = self.open_line and data != b"\xef\xbb\xbf"
            self._put(data)

    def _put(self, data: bytes) -> None:
        self.target.write(data)
        self.written.update(data)
