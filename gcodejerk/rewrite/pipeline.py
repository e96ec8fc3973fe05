"""The main job: a program in, the same program with its rapids re-timed out.

This module owns the order of the steps: read, plan, write, verify. Files, names and renames are in
`batch.files`; here a program is an open binary file, whatever its size, and the output another.

Rule 1: what is not a planned rapid's block is copied from the source, byte for byte.
Rule 2: nothing is given back that `verify` has not accepted (unless the user switched it off).
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.advice import ABSOLUTE, NO_MODES, at_the_machine
from gcodejerk.cycles.expansion import Expansion
from gcodejerk.emit import Controller, Options, load_controller
from gcodejerk.emit.fits import reasons_to_leave
from gcodejerk.errors import EmitError, Place, ProgramError, VerifyError
from gcodejerk.machine import DIALECT_OF_CONTROLLER, LINUXCNC, Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Program, find_dialect, read_program
from gcodejerk.planning.independent_axes import dogleg_notes, path_deviation
from gcodejerk.planning.plan import plan_rapids
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.settling import Left, left_alone
from gcodejerk.planning.stream import Residuals, make_streams
from gcodejerk.rewrite.expanded import (
    hunks,
    in_original,
    lines_in_original,
    written_out,
)
from gcodejerk.rewrite.foreign import HEAD, refuse_foreign
from gcodejerk.rewrite.rapid_result import RapidResult, rapid_results
from gcodejerk.rewrite.rewriter import Rewriter, changed_error, digest_of
from gcodejerk.rewrite.stamp import stamp_text
from gcodejerk.verification import Verification, require, verify_csv, verify_files

Progress = Callable[[str, int, int], None]
"""Called with a step's name, how much of it is done, and of how much."""


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
    expand_cycles: bool = False
    """Write drilling cycles out as explicit moves first."""


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """The outcome of one program.

    Attributes
    ----------
    program : Program
        As it was read, with its rapids. Those of cycles that were written out carry the line and
        the place of the cycle's block; several of them share one.
    plans : Plans
        Row i is rapid i.
    controller : str
        The emitter that wrote.
    residual, conventional_residual : ndarray, shape (n, m)
        Displacement envelopes of every rapid and mode, NaN where not planned. [mm]
    stays_conventional : ndarray of bool, shape (n,)
        The stream is the conventional profile: nothing better was found.
    deviation : ndarray, shape (n,)
        Under independent positioning, how far the path leaves the control's own, at most. [mm]
    rest : Left
        What rapids leave today that were left alone.
    verification : Verification or None
        None where it was switched off, or where nothing was written.
    edits : ndarray of int, shape (k, 3)
        Begin and end in the output of every stream, and the rapid that it replaces; -1 for the
        stamp. Empty where the output is a file of its own. [bytes]
    hunks : ndarray of int, shape (n, 5)
        All that is not the source's, cycles included: see `expanded.hunks`.
    expansion : Expansion or None
        The outcome for the cycles; None where they were not to be written out.
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
    stays_conventional: NDArray[np.bool_]
    deviation: Array
    rest: Left
    verification: Verification | None
    edits: NDArray[np.int64]
    hunks: NDArray[np.int64]
    expansion: Expansion | None
    notes: tuple[str, ...]
    output: bytes | None = field(default=None, repr=False)

    def __repr__(self) -> str:
        return f"<Result {self.program.name}: {self.planned} of {len(self.plans)} rapids rewritten>"

    @property
    def rapids(self) -> tuple[RapidResult, ...]:
        """Every rapid of the program, one record each, in the order of the file."""
        return rapid_results(
            self.program, self.plans, self.stays_conventional, self.residual,
            self.conventional_residual,
        )  # fmt: skip

    @property
    def planned(self) -> int:
        """Number of rapids that were rewritten."""
        return int(np.count_nonzero(self.plans.planned))

    @property
    def left(self) -> int:
        """Number of rapids that were left alone."""
        return len(self.plans) - self.planned

    @property
    def read_once(self) -> int:
        """Rewritten rapids of which the second reading of the program does not know all."""
        found = self.verification
        return 0 if found is None else found.rewritten - found.confirmed


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
    expand_cycles: bool = False,
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
    expand_cycles : bool
        Write drilling cycles out as explicit moves, whose rapids can then be rewritten.
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
    settings = Settings(
        controller, "stream", profile, dialect, comments, verify, force, expand_cycles
    )
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
    if not settings.expand_cycles:
        return _process(source, target, machine, settings, name, emitter, progress or silent, None)
    if target is not None and not emitter.in_place:
        raise EmitError(
            f"--expand-cycles needs streams within the program, those of controller {emitter.name} "
            "are a file of their own",
            "choose another --controller, or leave --expand-cycles out",
        )
    with written_out(
        source,
        machine,
        name=name,
        dialect=settings.dialect,
        comments=settings.comments,
        prove=target is not None and settings.verify,
    ) as (used, expansion):
        return _process(
            used, target, machine, settings, name, emitter, progress or silent, expansion
        )


def _process(
    source: BinaryIO,
    target: BinaryIO | None,
    machine: Machine,
    settings: Settings,
    name: str,
    emitter: Controller,
    report: Progress,
    expansion: Expansion | None,
) -> Result:
    """Process a program; the source is that with its cycles written out, if they are."""
    lines = None if expansion is None else expansion.map
    source.seek(0, io.SEEK_END)
    size = source.tell()
    source.seek(0)
    refuse_foreign(source.read(HEAD), name)
    source.seek(0)
    program = read_program(
        source,
        name=name,
        dialect=settings.dialect or machine.dialect,
        start=machine.program_start(),
        progress=lambda done: report("reading", done, size),
        neighbours=machine.planner == LINUXCNC,
    )
    if program.stamp is not None and not settings.force:
        raise ProgramError(
            "this program has been processed by gcodejerk before",
            "process the original, or add --force to process its remaining rapids",
            Place(name, program.stamp if lines is None else lines.line_of(program.stamp)),
        )
    rapids = program.rapids
    if emitter.in_place:
        dialect = find_dialect(program.dialect)
        rapids = replace(rapids, reason=reasons_to_leave(program, source, machine, dialect))
    plans = plan_rapids(
        rapids,
        machine,
        settings.profile,
        lambda done, total: report("planning", done, total),
        emitter.unblended if emitter.in_place else "",
        only_gains=True,
    )
    collected = Residuals(plans)
    deviation = np.zeros(len(plans))
    chosen = [emitter.name, settings.form, settings.profile or machine.design.profile]
    chosen += ["expand-cycles"] if settings.expand_cycles else []
    chosen += [f"dialect {settings.dialect}"] if settings.dialect is not None else []
    options = Options(settings.comments, find_dialect(program.dialect))
    writer = Rewriter(source, target, program, emitter, options, stamp_text(machine, chosen))
    writer.write_header(machine)
    done = 0
    for window in make_streams(
        plans,
        emitter.number_format(program.rapids, machine, options.dialect),
        emitter.stride(machine.interval),
    ):
        for batch in window:
            collected.add(batch)
            deviation[batch.moves] = path_deviation(batch)
        writer.write(window)
        done += sum(map(len, window))
        report("writing", done, int(np.count_nonzero(plans.planned)))
    writer.finish()
    verification = None
    if target is not None and settings.verify:
        report("verifying", 0, 1)
        try:
            verification = _verified(source, target, machine, settings, program, emitter.in_place)
            require(lines_in_original(verification, lines))
        except (ProgramError, VerifyError):
            if digest_of(source) != program.digest:
                raise changed_error(name) from None
            raise
        report("verifying", 1, 1)
    edits = np.array(writer.edits, dtype=np.int64).reshape(-1, 3)
    differences = hunks(edits, program.rapids, program.insert_at, lines)
    program = in_original(program, expansion)
    findings = (*program.findings, *(() if expansion is None else expansion.findings))
    notes = [_finding(finding.line, finding.message) for finding in findings]
    home = DIALECT_OF_CONTROLLER.get(emitter.name)
    if emitter.in_place and home is not None and not program.dialect.startswith(home):
        notes.append(
            f"the program is read as {program.dialect}, controller {emitter.name} reads {home}: "
            "how the program's control follows its streams was not measured"
        )
    notes += dogleg_notes(plans, deviation)
    return Result(
        program=program,
        plans=plans,
        controller=emitter.name,
        profile=settings.profile or machine.design.profile,
        form=settings.form,
        residual=collected.residual,
        conventional_residual=collected.conventional,
        stays_conventional=collected.stays_conventional,
        deviation=deviation,
        rest=left_alone(program.rapids, plans),
        verification=verification,
        edits=edits,
        hunks=differences,
        expansion=expansion,
        notes=(
            *_operator_notes(emitter, machine, plans),
            *notes,
            *emitter.notes(program.rapids, plans),
        ),
    )


def _operator_notes(emitter: Controller, machine: Machine, plans: Plans) -> list[str]:
    """What comes first: for whoever stands at the machine, then for whoever reads the figures."""
    notes = []
    if emitter.in_place and plans.planned.any():
        notes.append(at_the_machine(emitter.name))
    if not plans.modes.modes:
        notes.append(NO_MODES)
    elif plans.planned.any():
        notes.append(ABSOLUTE)
    if machine.warnings:
        first = machine.warnings[0]
        more = f", and {len(machine.warnings) - 1} more" if len(machine.warnings) > 1 else ""
        notes.append(
            f"the machine file is doubtful: {first.place}: {first.problem}{more}; see "
            "`gcodejerk machine check`"
        )
    return notes


def _verified(
    source: BinaryIO,
    target: BinaryIO,
    machine: Machine,
    settings: Settings,
    program: Program,
    in_place: bool,
) -> Verification:
    """Read an output back."""
    source.seek(0)
    target.seek(0)
    prove = verify_files if in_place else verify_csv
    design = replace(machine.design, profile=settings.profile or machine.design.profile)
    return prove(
        source,
        target,
        replace(machine, design=design),
        names=(program.name, f"the output for {program.name}"),
        dialect=program.dialect,
        start=machine.program_start(),
    )


def _with_output(result: Result, output: bytes) -> Result:
    """The result with its output."""
    return replace(result, output=output)


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
