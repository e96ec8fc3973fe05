"""The proof: a processed program, or a table of its streams, held against the original.

Rule: files are read from their bytes and in bounded memory; what is judged where says the room's
own docstring (`gcodejerk.verification`).
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import VerifyError
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Program, Start, dialect_of, read_program
from gcodejerk.spread import Spread
from gcodejerk.verification.bytes.alignment import Alignment, Progress
from gcodejerk.verification.bytes.guarded_form import check_guarded
from gcodejerk.verification.bytes.hal import ADAPTIVE, CONTROLLER, Beside, HalAlignment, beginning
from gcodejerk.verification.bytes.hal_taken import check_taken
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.bytes.stamp import read_stamp
from gcodejerk.verification.findings import Findings, Kind, Verification
from gcodejerk.verification.physics.aligned import Reported
from gcodejerk.verification.physics.alike import Alike
from gcodejerk.verification.physics.dynamics import check_dynamics
from gcodejerk.verification.physics.points import Paths, Reader, check_line, check_rapids
from gcodejerk.verification.rows.files import RowsFile, rows_format, stated_profile
from gcodejerk.verification.rows.judge import judge_rows
from gcodejerk.verification.samples import SampleReader
from gcodejerk.verification.second_reading.agreement import confirm
from gcodejerk.verification.sections import judge_sections
from gcodejerk.verification.settings import check_settings, settings_note
from gcodejerk.verification.streams import BATCH_BYTES, batches, checked, judge_streams, moves
from gcodejerk.verification.table import TableReader, is_table

MOST = 100
"""Violations that are collected, unless asked otherwise."""
HAL_BYTES = 1 << 18
"""The same where the points stand in another file: some hundred rapids."""
NAMES = ("<original>", "<processed>")
BESIDE = ".streams"
"""Added to a program's name: its file of samples."""


def verify(
    original: bytes | str | Path,
    processed: bytes | str | Path,
    machine: Machine,
    *,
    dialect: str | Dialect | None = None,
    controller: str | None = None,
    beside: bytes | str | Path | None = None,
    most: int = MOST,
) -> Verification:
    r"""Compare a processed program with its original.

    Parameters
    ----------
    original, processed : bytes, str or Path
        The programs themselves, or the names of their files. A file is read in bounded memory.
    machine : Machine
        What the program was processed for. Profile and controller are those of the stamp, where
        there is one; the profile of a file of rows is the one that its head names.
    dialect : str or Dialect, optional
        How the original is written; the stamp's by default, or the machine's.
    controller : str, optional
        What the streams are for; the stamp's by default, or the machine's.
    beside : bytes, str or Path, optional
        The file of samples of a program for `linuxcnc-hal`; the one that stands beside it by
        default.
    most : int, optional
        Violations after which it stops.

    Returns
    -------
    Verification
        With every violation that was found, in the order of the processed file.

    Raises
    ------
    ProgramError
        The original cannot be a program.
    VerifyError
        A file cannot be read.

    Examples
    --------
    >>> from gcodejerk.machine import find_machine
    >>> vmc = Machine.load(find_machine("vmc"))
    >>> verify(b"G21 G90 G0 X1\nM2\n", b"G21 G90 G0 X1\nM2\n", vmc).ok
    True
    >>> found = verify(b"G21 G90 G0 X1\nM2\n", b"G21 G90 G0 X2\nM2\n", vmc)
    >>> str(found.violations[0].kind), found.violations[0].line
    ('line changed', 1)
    """
    with ExitStack() as stack:
        one, other = (stack.enter_context(_opened(given)) for given in (original, processed))
        names = (_name(original, NAMES[0]), _name(processed, NAMES[1]))
        stamp, profile = read_stamp(other, machine), stated_profile(other)
        if stamp is not None and stamp.known:
            profile = stamp.profile
            dialect, controller = dialect or stamp.dialect, controller or stamp.controller
        if profile is not None:
            machine = replace(machine, design=replace(machine.design, profile=profile))
        machine = replace(machine, controller=controller or machine.controller)
        samples = None
        if machine.controller == CONTROLLER:
            beside = beside_of(processed) if beside is None else beside
            samples = None if beside is None else stack.enter_context(_opened(beside))
        table = is_table(other) or rows_format(other) is not None
        return verify_files(
            one, other, machine, names=names, dialect=dialect, most=most, beside=samples,
            table=table,
        )  # fmt: skip


def beside_of(processed: bytes | str | Path) -> str | None:
    """Name of the file of samples that stands beside a program; None where there is none."""
    name = "" if isinstance(processed, bytes) else f"{processed}{BESIDE}"
    return name if name and Path(name).is_file() else None


def _name(given: bytes | str | Path, instead: str) -> str:
    """Name a file for messages."""
    return instead if isinstance(given, bytes) else str(given)


def _opened(given: bytes | str | Path) -> BinaryIO:
    """Open a file for reading."""
    if isinstance(given, bytes):
        return io.BytesIO(given)
    try:
        return open(given, "rb")
    except OSError as error:
        raise VerifyError(
            f"cannot read '{given}': {error.strerror}", "give the name of a file that can be read"
        ) from error


def verify_files(
    original: BinaryIO,
    processed: BinaryIO,
    machine: Machine,
    *,
    names: tuple[str, str] = NAMES,
    dialect: str | Dialect | None = None,
    start: Start | None = None,
    most: int = MOST,
    table: bool = False,
    reported: Reported | None = None,
    beside: BinaryIO | None = None,
    program: Program | None = None,
    progress: Progress | None = None,
    spread: Spread | None = None,
    edits: NDArray[np.int64] | None = None,
) -> Verification:
    """Compare open files; see `verify`.

    Parameters
    ----------
    original, processed : BinaryIO
        Opened for reading bytes, at their beginning; the original is read twice, so it is seekable.
    machine : Machine
        What the program was processed for; its controller is that of the streams.
    names : tuple of str, optional
        For messages.
    dialect : str or Dialect, optional
        The machine's by default.
    start : Start, optional
        What the original may assume; the machine's `program` by default.
    most : int, optional
        Violations after which it stops.
    table : bool, optional
        What was processed is a file of its own, a table of the streams (controller `csv`) or of
        rows: lines of violations are those of the file, and no line counts as kept.
    reported : mapping of int to array, optional
        Of the line of each rapid: the profile that was reported, as rows of duration [s] and jerk
        along the path [mm/s^3]; streams for LinuxCNC are held to it.
    beside : BinaryIO, optional
        The file of samples that stands beside the processed program (controller `linuxcnc-hal`).
    program : Program, optional
        The original as `nc` reads it with the same dialect, start and machine, for who has just
        read it; taken if the file still has its digest, and read anew if not.
    progress : callable, optional
        Called with how many rapids were looked at, and how many there are, of streams in place.
    spread : Spread, optional
        Who judges sections of the files, where there are `edits`.
    edits : ndarray of int, shape (k, 3), optional
        Begin and end of each stream in the processed file, and the rapid that it replaces: a hint
        of where the files may be cut. Nothing is taken on trust (`sections`).

    Returns
    -------
    Verification
        With every violation that was found.

    Raises
    ------
    ProgramError
        The original cannot be a program.
    """
    start = replace(machine.program_start() if start is None else start, restores=not table)
    begin = original.tell()
    if program is None or _digest(original) != program.digest:
        program = _read(original, machine, names[0], dialect, start)
    found = Findings(most)
    control = None if table else settings_note(processed)
    if control is not None:
        windows = Window(original), Window(processed)
        kept, places = check_settings(*windows, program, machine, control, found)
        return Verification(len(program.rapids), 0, kept, found.sorted(), names, places=places)
    replaced: Sequence[int] | NDArray[np.int64]
    if table:
        replaced, kept = _judge_table(processed, program, machine, found), 0
    elif machine.controller == CONTROLLER:
        replaced, kept = _judge_pair(original, processed, beside, program, machine, found, progress)
    else:
        files, held_to = (original, processed), reported or {}
        by_sections = None
        if spread is not None and edits is not None and not _is_guarded(machine):
            stood = [file.tell() for file in files]
            by_sections = judge_sections(*files, program, machine, held_to, edits, progress, spread)
            for file, place in zip(files, stood, strict=True):
                file.seek(place)
        replaced, kept = by_sections or _judge_program(
            *files, program, machine, found, held_to, progress
        )
    original.seek(begin)
    confirmed = confirm(original, program.dialect, start, program.rapids, replaced, found)
    rapids = len(program.rapids)
    return Verification(rapids, len(replaced), kept, found.sorted(), names, confirmed)


def _judge_program(
    original: BinaryIO,
    processed: BinaryIO,
    program: Program,
    machine: Machine,
    found: Findings,
    reported: Reported,
    progress: Progress | None,
) -> tuple[Sequence[int], int]:
    """Compare programs; which rapids were replaced, and how many lines were kept."""
    windows = Window(original), Window(processed)
    alignment = Alignment(*windows, program, machine, found, reported)
    alignment.progress = progress
    reader = Reader(program.rapids, machine, found, program.language)
    alike = Alike(reported if alignment.aligned else {})
    judge_streams(alignment, reader, alike, machine, reported, found)
    if alignment.guarded and alignment.aligned:
        lines = program.rapids.line[np.array(alignment.replaced)].tolist()
        check_guarded(original, program.dialect, lines, found)
    alignment.check_sum()
    return alignment.replaced, alignment.kept


def _is_guarded(machine: Machine) -> bool:
    """Whether streams stand in structures that are judged over the whole file."""
    return machine.controller_options.override_guard


def _judge_pair(
    original: BinaryIO,
    processed: BinaryIO,
    beside: BinaryIO | None,
    program: Program,
    machine: Machine,
    found: Findings,
    progress: Progress | None,
) -> tuple[Sequence[int], int]:
    """Compare a program and its file of samples; which rapids were replaced, and lines kept."""
    if beside is None:
        found.add(
            Kind.SAMPLES, None, None, "there is no file of samples beside the program",
            "keep both files together: part.nc and part.nc.streams",
        )  # fmt: skip
        return [], 0
    about = Beside.of(beside)
    if about is None:
        found.add(
            Kind.SAMPLES, None, None,
            f"what stands beside the program is no file of samples: {beginning(beside)}",
            "process the program again, and copy both files byte for byte",
        )  # fmt: skip
        return [], 0
    if abs(about.interval - machine.interval) > 1e-9 * machine.interval:
        said = f"{about.interval:g} s, the machine has {machine.interval:g} s"
        found.add(Kind.SAMPLES, None, None, f"the file of samples is for an interval of {said}")
        return [], 0
    alignment = HalAlignment(Window(original), Window(processed), program, machine, found)
    alignment.beside = about
    alignment.progress = progress
    reader = Reader(program.rapids, machine, found, program.language)
    samples = SampleReader(beside, about, program.rapids, machine, found)
    for streams in batches(checked(alignment, reader), HAL_BYTES):
        written = reader.paths(streams)
        check_line(written, machine, found)
        for played in samples.paths(streams, written):
            _check_lines(played, program, machine, found)
            if moves(played):
                check_dynamics(played, machine, 1, found)
    samples.finish()
    alignment.check_opening()
    if alignment.replaced:
        check_taken(original, about.form == ADAPTIVE, found)
    alignment.check_sum()
    return alignment.replaced, alignment.kept


def _judge_table(table: BinaryIO, program: Program, machine: Machine, found: Findings) -> list[int]:
    """Compare a table with its program; which rapids it replaces."""
    name = rows_format(table)
    if name is not None:
        return judge_rows(RowsFile(table, name, machine, found), program.rapids, machine, found)
    reader = TableReader(table, program.rapids, machine, found)
    for paths in reader.paths():
        _check_lines(paths, program, machine, found)
        if moves(paths):
            check_dynamics(paths, machine, 1, found)
    return reader.replaced


def _read(
    original: BinaryIO,
    machine: Machine,
    name: str,
    dialect: str | Dialect | None,
    start: Start,
) -> Program:
    """Read the original, then go back to its beginning."""
    begin = original.tell()
    program = read_program(
        original,
        name=name,
        dialect=dialect if isinstance(dialect, Dialect) else dialect_of(machine, dialect),
        start=start,
        neighbours=machine.neighbours_matter,
    )
    original.seek(begin)
    return program.written_for(machine.controller)


def _digest(original: BinaryIO) -> bytes:
    """What the rest of a file holds, as `Program.digest` has it; it stands where it stood."""
    begin = original.tell()
    digest = hashlib.blake2b(digest_size=16)
    while data := original.read(BATCH_BYTES):
        digest.update(data)
    original.seek(begin)
    return digest.digest()


def _check_lines(paths: Paths, program: Program, machine: Machine, found: Findings) -> None:
    """Where the points are, and whether there may be any."""
    check_rapids(paths, program.rapids, machine, found)
    check_line(paths, machine, found)
