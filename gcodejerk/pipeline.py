"""The main job: a program in, the same program with its rapids re-timed out.

This module owns the order of the steps: read, plan, write, verify. Files, names and renames are in
`files.py`; here a program is an open binary file, whatever its size, and the output another.

Rule 1: what is not a planned rapid's block is copied from the source, byte for byte.
Rule 2: nothing is given back that `verify` has not accepted (unless the user switched it off).
"""

from __future__ import annotations

import hashlib
import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk import __version__
from gcodejerk.emit import Controller, Options, load_controller
from gcodejerk.errors import EmitError, Place, ProgramError, VerifyError
from gcodejerk.machine import Machine
from gcodejerk.motion.laws import Array
from gcodejerk.nc import Program, read_program
from gcodejerk.plan import plan_rapids
from gcodejerk.plans import Plans
from gcodejerk.start import program_start
from gcodejerk.stream import Batch, make_streams
from gcodejerk.verification import Verification, require, verify_csv, verify_files

TERMINATOR_LENGTH = np.array([0, 1, 2, 1])
"""Bytes of a line end, by `Rapids.terminator`."""
Progress = Callable[[str, int, int], None]
"""Called with a step's name, how much of it is done, and of how much."""
COPY_SIZE = 1 << 20
STAMP_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What a user may choose; what is None the machine file says."""

    controller: str | None = None
    form: str = "stream"
    profile: str | None = None
    dialect: str | None = None
    comments: bool = True
    verify: bool = True
    force: bool = False
    """Process a file that carries our stamp."""


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """What became of one program.

    Attributes
    ----------
    program : Program
        As it was read, with its rapids.
    plans : Plans
        Row i is rapid i.
    controller : str
        The emitter that wrote.
    residual, conventional_residual : ndarray, shape (n, m)
        Displacement envelopes of every rapid and mode, NaN where not planned. [mm]
    kept : ndarray of bool, shape (n,)
        The stream is the conventional law: nothing better was found.
    verification : Verification or None
        None where it was switched off, or where nothing was written.
    edits : ndarray of int, shape (k, 3)
        Begin and end in the output of everything that is not the source's, and the rapid that it
        replaces; -1 for the stamp. Empty where the output is a file of its own. [bytes]
    notes : tuple of str
        What the user has to know: of the program, and of the controller.
    output : bytes or None
        The output, where it was asked for in memory.
    """

    program: Program
    plans: Plans
    controller: str
    profile: str
    form: str
    residual: Array
    conventional_residual: Array
    kept: NDArray[np.bool_]
    verification: Verification | None
    edits: NDArray[np.int64]
    notes: tuple[str, ...]
    output: bytes | None = field(default=None, repr=False)

    @property
    def planned(self) -> int:
        """Number of rapids that were rewritten."""
        return int(np.count_nonzero(self.plans.planned))

    @property
    def left(self) -> int:
        """Number of rapids that were left alone."""
        return len(self.plans) - self.planned


def process(
    data: bytes,
    machine: Machine,
    *,
    controller: str | None = None,
    profile: str | None = None,
    dialect: str | None = None,
    comments: bool = True,
    verify: bool = True,
    force: bool = False,
    name: str = "<program>",
) -> Result:
    r"""Rewrite every rapid of a program that is certain.

    Parameters
    ----------
    data : bytes
        The program.
    machine : Machine
        What it runs on.
    controller, profile, dialect : str, optional
        In place of the machine file's.
    comments : bool
        Name each original block in a comment in front of its stream.
    verify : bool
        Read the output back and prove it.
    force : bool
        Accept a program that carries our stamp.
    name : str
        What messages call the program.

    Returns
    -------
    Result
        The output is in `output`.

    Raises
    ------
    ProgramError
        The program cannot be read, or was processed before.
    PlanError, EmitError
        The profile or the controller cannot do what is asked for.
    VerifyError
        What was written is not right: a bug of ours, which has written nothing.

    Examples
    --------
    >>> from gcodejerk.machine import Machine, find_machine
    >>> vmc = Machine.load(find_machine("vmc"))
    >>> result = process(b"G21 G90 G94 G64\nG0 X0 Y0 Z0\nG0 Z1.\nM2\n", vmc)
    >>> result.planned, result.left
    (1, 1)
    """
    settings = Settings(controller, "stream", profile, dialect, comments, verify, force)
    target = io.BytesIO()
    result = process_file(io.BytesIO(data), target, machine, settings, name)
    return _with_output(result, target.getvalue())


def process_file(
    source: BinaryIO,
    target: BinaryIO | None,
    machine: Machine,
    settings: Settings,
    name: str,
    progress: Progress | None = None,
) -> Result:
    """The same with open files, in bounded memory.

    Parameters
    ----------
    source : binary file
        Seekable.
    target : binary file or None
        Empty, seekable, readable; None to plan without writing.
    machine : Machine
        What the program runs on.
    settings : Settings
        The user's choices.
    name : str
        What messages call the program.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    Result
        Without `output`.
    """
    emitter = load_controller(settings.controller or machine.controller)
    _check_form(emitter, settings.form)
    report = progress or silent
    source.seek(0, io.SEEK_END)
    size = source.tell()
    source.seek(0)
    program = read_program(
        source,
        name=name,
        dialect=settings.dialect or machine.dialect,
        start=program_start(machine),
        progress=lambda done: report("reading", done, size),
    )
    if program.stamp is not None and not settings.force:
        raise ProgramError(
            "this program has been processed by gcodejerk before",
            "process the original, or add --force to process its remaining rapids",
            Place(name, program.stamp),
        )
    plans = plan_rapids(
        program.rapids,
        machine,
        settings.profile,
        lambda done, total: report("planning", done, total),
    )
    collected = _Residuals(plans)
    writer = _Writer(source, target, program, machine, emitter, settings)
    done = 0
    for window in make_streams(
        plans, emitter.spelling(program.rapids, machine), emitter.stride(machine.interval)
    ):
        for batch in window:
            collected.add(batch)
        writer.write(window)
        done += sum(map(len, window))
        report("writing", done, int(np.count_nonzero(plans.planned)))
    writer.finish()
    verification = None
    if target is not None and settings.verify:
        report("verifying", 0, 1)
        try:
            verification = _judged(source, target, machine, settings, name, emitter.in_place)
        except (ProgramError, VerifyError):
            if _digest(source) != program.digest:
                raise changed_error(name) from None
            raise
        report("verifying", 1, 1)
    notes = [_finding(finding.line, finding.message) for finding in program.findings]
    return Result(
        program=program,
        plans=plans,
        controller=emitter.name,
        profile=settings.profile or machine.design.profile,
        form=settings.form,
        residual=collected.residual,
        conventional_residual=collected.conventional,
        kept=collected.kept,
        verification=verification,
        edits=np.array(writer.edits, dtype=np.int64).reshape(-1, 3),
        notes=(*notes, *emitter.notes(program.rapids, plans)),
    )


def _judged(
    source: BinaryIO,
    target: BinaryIO,
    machine: Machine,
    settings: Settings,
    name: str,
    in_place: bool,
) -> Verification:
    """Read an output back; an error where it is not right."""
    source.seek(0)
    target.seek(0)
    judge = verify_files if in_place else verify_csv
    design = replace(machine.design, profile=settings.profile or machine.design.profile)
    verification = judge(
        source,
        target,
        replace(machine, design=design),
        names=(name, f"the output for {name}"),
        dialect=settings.dialect,
        start=program_start(machine),
    )
    require(verification)
    return verification


def _digest(source: BinaryIO) -> bytes:
    """What a file holds now, as `Program.digest` has it."""
    source.seek(0)
    digest = hashlib.blake2b(digest_size=16)
    while data := source.read(COPY_SIZE):
        digest.update(data)
    return digest.digest()


def stamp_comment(machine: Machine, settings: Settings, emitter: Controller) -> bytes:
    """The comment at the top of an output: version, machine and a hash of the settings."""
    chosen = (emitter.name, settings.form, settings.profile or machine.design.profile)
    text = " ".join((machine.settings_hash, *chosen)).encode()
    digest = hashlib.blake2b(text, digest_size=4).hexdigest()
    plain = "".join(
        c if c.isascii() and c.isprintable() and c not in "()" else "?" for c in machine.name
    )
    return f"{f'(gcodejerk stamp {__version__} {digest} {plain}'[: STAMP_LENGTH - 1]})".encode()


def _with_output(result: Result, output: bytes) -> Result:
    """The result with its output."""
    return replace(result, output=output)


def changed_error(name: str) -> EmitError:
    """The error for a program that somebody else has written to meanwhile."""
    return EmitError(
        f"{name} was changed while it was being processed",
        "run the command again when nothing writes to the file",
    )


def silent(step: str, done: int, total: int) -> None:
    """Progress that nobody watches."""


def _finding(line: int | None, message: str) -> str:
    """A finding as a line of text."""
    return message if line is None else f"line {line}: {message}"


def _check_form(emitter: Controller, form: str) -> None:
    """Refuse a form that the emitter does not have."""
    names = [f.name for f in emitter.forms]
    if form not in names:
        raise EmitError(
            f"controller {emitter.name} cannot write --as {form} in this version",
            f"it can write: {', '.join(names)}",
        )


class _Residuals:
    """Collects from batches what a report needs."""

    def __init__(self, plans: Plans) -> None:
        shape = (len(plans), len(plans.modes.poles))
        self.residual = np.full(shape, np.nan)
        self.conventional = np.full(shape, np.nan)
        self.kept = np.zeros(len(plans), dtype=bool)

    def add(self, batch: Batch) -> None:
        """Note one batch."""
        self.residual[batch.moves] = batch.residual
        self.conventional[batch.moves] = batch.conventional_residual
        self.kept[batch.moves] = batch.kept


class _Writer:
    """Copies the source and puts streams in the place of blocks, in one pass through the file."""

    def __init__(
        self,
        source: BinaryIO,
        target: BinaryIO | None,
        program: Program,
        machine: Machine,
        emitter: Controller,
        settings: Settings,
    ) -> None:
        self.source, self.target, self.program = source, target, program
        self.emitter = emitter
        self.options = Options(comments=settings.comments)
        self.stamp = stamp_comment(machine, settings, emitter) + program.newline
        self.digest = hashlib.blake2b(digest_size=16)
        self.at = 0
        self.edits: list[tuple[int, int, int]] = []
        source.seek(0)
        if target is not None:
            target.write(emitter.header(machine))

    def write(self, window: list[Batch]) -> None:
        """Write the streams of a window; windows come in the order of the file."""
        if self.target is None:
            return
        if self.emitter.in_place and not self.edits:
            self._copy(self.program.insert_at)
            self._put(self.stamp, -1)
        texts: dict[int, bytes] = {}
        rapids = self.program.rapids
        for batch in window:
            blocks = [self._block(move) for move in batch.moves]
            new = self.emitter.render(batch, rapids, blocks, self.program.newline, self.options)
            texts.update(zip(batch.moves.tolist(), new, strict=True))
        self.source.seek(self.at)
        for move in sorted(texts):
            self._copy(int(rapids.begin[move]))
            self._read(int(rapids.end[move] + TERMINATOR_LENGTH[rapids.terminator[move]]))
            self._put(texts[move], move)

    def _block(self, move: int) -> bytes:
        """The block of a rapid."""
        begin, end = int(self.program.rapids.begin[move]), int(self.program.rapids.end[move])
        self.source.seek(begin)
        return self.source.read(end - begin)

    def _put(self, text: bytes, move: int) -> None:
        """Write what is not the source's, and note where."""
        assert self.target is not None
        begin = self.target.tell()
        self.target.write(text)
        if self.emitter.in_place:
            self.edits.append((begin, begin + len(text), move))

    def finish(self) -> None:
        """Copy what follows the last stream, and see that the source is still what was planned."""
        if self.target is None:
            return
        self._copy(self.program.size)
        if self.source.read(1) or self.digest.digest() != self.program.digest:
            raise changed_error(self.program.name)
        self.target.flush()

    def _read(self, end: int) -> bytes:
        """The source's next bytes, up to an offset."""
        data = self.source.read(end - self.at)
        self.at = end
        self.digest.update(data)
        return data

    def _copy(self, end: int) -> None:
        """Copy the source up to an offset; only read it where the output is its own file."""
        while self.at < end:
            data = self._read(min(end, self.at + COPY_SIZE))
            if self.target is not None and self.emitter.in_place:
                self.target.write(data)
