"""The main job: a program in, the same program with its rapids re-timed out.

This module owns the order of the steps: read, plan, write, verify. Files, names and renames are in
`batch.files`; here a program is an open binary file, whatever its size, and the output another.

Rule 1: what is not a planned rapid's block is copied from the source, byte for byte.
Rule 2: nothing is given back that `verify` has not accepted (unless the user switched it off).
"""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.emit import Controller, Options, controller_of
from gcodejerk.emit.fits import reasons_to_leave
from gcodejerk.emit.program_lines import require_way
from gcodejerk.errors import EmitError, Place, ProgramError, VerifyError
from gcodejerk.machine import Machine
from gcodejerk.nc import Program, dialect_of, read_program
from gcodejerk.nc.line_map import Lines
from gcodejerk.planning.independent_axes import dogleg_notes
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.rapids import plan_rapids
from gcodejerk.planning.settling import left_alone
from gcodejerk.planning.told import in_steps, told_in
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.rewrite.control_settings import PARAMETERS
from gcodejerk.rewrite.expanded import (
    Front,
    WrittenOut,
    hunks,
    in_original,
    lines_in_original,
    written_out,
)
from gcodejerk.rewrite.feed_moves import instead_notes
from gcodejerk.rewrite.foreign import HEAD, refuse_foreign
from gcodejerk.rewrite.notes import band_notes, operator_notes, program_notes, tick_notes
from gcodejerk.rewrite.rapid_feed import check_dialect, check_rapid_feed
from gcodejerk.rewrite.result import ReportedProfiles, Result
from gcodejerk.rewrite.rewriter import Rewriter, changed_error, digest_of
from gcodejerk.rewrite.set_control import set_control
from gcodejerk.rewrite.stamp import ProcessedError, stamp_text
from gcodejerk.rewrite.what_if import entry_notes
from gcodejerk.rewrite.writing import write_streams
from gcodejerk.spread import Spread, here
from gcodejerk.verification import Verification, require, verify_files

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
    unroll: bool = False
    """Write loops, branches and calls out first."""

    @property
    def front(self) -> Front:
        """What is to be written out in front."""
        return Front(unroll=self.unroll, cycles=self.expand_cycles)


def process(
    data: bytes,
    machine: Machine,
    *,
    controller: str | None = None,
    form: str = "stream",
    profile: str | None = None,
    dialect: str | None = None,
    comments: bool = True,
    verify: bool = True,
    force: bool = False,
    expand_cycles: bool = False,
    unroll: bool = False,
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
    form : str
        One that the controller has; `stream` is its first.
    comments : bool
        Name each original block in a comment in front of its stream.
    verify : bool
        Read the output back and prove it.
    force : bool
        Accept a program that carries our stamp.
    expand_cycles : bool
        Write drilling cycles out as explicit moves, whose rapids can then be rewritten.
    unroll : bool
        Write loops, branches and calls out, so that every pass has rapids of its own.
    name : str
        What messages call the program.

    Returns
    -------
    Result
        The output is in `output`; what belongs beside it, for controllers that write such a file,
        is in `beside`.

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
        controller, form, profile, dialect, comments, verify, force, expand_cycles, unroll
    )
    target, beside = io.BytesIO(), io.BytesIO()
    result = process_file(io.BytesIO(data), target, machine, settings, name, beside=beside)
    return replace(result, output=target.getvalue(), beside=beside.getvalue() or None)


def process_file(
    source: BinaryIO,
    target: BinaryIO | None,
    machine: Machine,
    settings: Settings,
    name: str,
    progress: Progress | None = None,
    beside: BinaryIO | None = None,
    spread: Spread = here,
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
    beside : binary file, optional
        Empty, seekable, readable: takes what the controller writes beside the program
        (`Controller.beside`). Such a controller needs it where there is a target.
    spread : Spread, optional
        Who does what takes long; the result is the same.

    Returns
    -------
    Result
        Without `output` and `beside`.
    """
    emitter = controller_of(machine, settings.controller)
    check_rapid_feed(machine, emitter, form=settings.form, cycles=settings.expand_cycles)
    if settings.form == PARAMETERS:
        return _set(source, target, machine, settings, name, emitter, progress or silent)
    emitter = emitter.in_form(settings.form)
    emitter.require(machine)
    if emitter.beside and target is not None and beside is None:
        raise EmitError(
            f"controller {emitter.name} writes two files: the program and its {emitter.beside}",
            "give it a file for each",
        )
    front = settings.front
    if not front:
        return _process(
            source, target, machine, settings, name, emitter, progress or silent, None, beside,
            spread,
        )  # fmt: skip
    if target is not None and not emitter.in_place:
        raise EmitError(
            f"{front.options} needs streams within the program, those of controller {emitter.name} "
            "are a file of their own",
            f"choose another --controller, or leave {front.options} out",
        )
    with written_out(
        source,
        replace(machine, controller=emitter.name),
        front,
        name=name,
        dialect=settings.dialect,
        comments=settings.comments,
        prove=require if target is not None and settings.verify else None,
    ) as (used, written):
        return _process(
            used, target, machine, settings, name, emitter, progress or silent, written, beside,
            spread,
        )  # fmt: skip


def _process(
    source: BinaryIO,
    target: BinaryIO | None,
    machine: Machine,
    settings: Settings,
    name: str,
    emitter: Controller,
    report: Progress,
    written: WrittenOut | None,
    beside: BinaryIO | None,
    spread: Spread,
) -> Result:
    """Process a program; the source is that with its flow and cycles written out, if they are."""
    lines = None if written is None else written.map
    program = _read(source, machine, settings, name, emitter, report, written)
    check_dialect(machine, program)
    plans = _plan(source, program, machine, settings, emitter, report, spread)
    peaks = np.zeros((3, len(plans)))
    form = emitter.row_format(machine) if emitter.play is Play.CUBIC else None
    steps = emitter.end_steps(machine)
    if steps is not None:
        plans = in_steps(plans, program.rapids, steps)
    if form is not None:
        plans, peaks = told_in(plans, program.rapids, form)
    writer = Rewriter(
        source, target, program, emitter,
        Options(settings.comments, program.language),
        stamp_text(machine, _chosen(machine, settings, emitter.name, emitter.form)),
        beside,
        guarded=machine.controller_options.override_guard,
    )  # fmt: skip
    design = replace(machine.design, profile=settings.profile or machine.design.profile)
    designed = replace(machine, design=design)
    collected, deviation = write_streams(writer, plans, designed, report, form, peaks, spread)
    edits = writer.edits.finish()
    verification = None
    if target is not None and settings.verify:
        report("verifying", 0, 1)
        verification = _verified(
            source, target, machine, settings, program, plans, emitter, lines, beside, report,
            spread, edits,
        )  # fmt: skip
        report("verifying", 1, 1)
    what_if = entry_notes(source, program, emitter.start(machine))
    differences = hunks(edits, program.rapids, program.insert_at, lines)
    program = in_original(program, written)
    return Result(
        program=program,
        plans=plans,
        controller=emitter.name,
        profile=settings.profile or machine.design.profile,
        form=emitter.form,
        residual=collected.residual,
        conventional_residual=collected.conventional,
        deviation=deviation,
        rest=left_alone(program.rapids, plans),
        verification=verification,
        edits=edits,
        hunks=differences,
        expansion=None if written is None else written.expansion,
        unrolling=None if written is None else written.unrolling,
        notes=(
            *operator_notes(emitter, machine, plans),
            *program_notes(program, written, emitter, machine),
            *what_if,
            *instead_notes(source, plans, emitter.name),
            *dogleg_notes(plans, deviation),
            *tick_notes(plans),
            *band_notes(plans, collected),
            *emitter.notes(program.rapids, plans),
        ),
    )


def _set(
    source: BinaryIO,
    target: BinaryIO | None,
    machine: Machine,
    settings: Settings,
    name: str,
    emitter: Controller,
    report: Progress,
) -> Result:
    """Tune the control for a program, and put the lines that set it into it."""
    sheets = require_way(emitter, emitter.name)
    if settings.front:
        raise EmitError(
            f"{settings.front.options} has nothing to do with --as parameters: no block is "
            "rewritten",
            f"leave {settings.front.options} out",
        )
    program = _read(source, machine, settings, name, emitter, report, None)
    chosen = _chosen(machine, settings, emitter.name, PARAMETERS)
    result = set_control(source, target, program, machine, emitter, sheets, chosen)
    if target is None or not settings.verify:
        return result
    plans = result.plans
    found = _verified(
        source, target, machine, settings, program, plans, emitter, None, None, report
    )
    return replace(result, verification=found)


def _read(
    source: BinaryIO,
    machine: Machine,
    settings: Settings,
    name: str,
    emitter: Controller,
    report: Progress,
    written: WrittenOut | None,
) -> Program:
    """The program, refused where it is none, or one that was processed before."""
    source.seek(0, io.SEEK_END)
    size = source.tell()
    source.seek(0)
    refuse_foreign(source.read(HEAD), name)
    source.seek(0)
    program = read_program(
        source,
        name=name,
        dialect=dialect_of(machine, settings.dialect) if written is None else written.dialect,
        start=emitter.start(machine),
        progress=lambda done: report("reading", done, size),
        neighbours=replace(machine, controller=emitter.name).neighbours_matter,
    )
    program.rapids.freeze()
    if program.stamp is not None and not settings.force:
        raise ProcessedError(
            "this program has been processed by gcodejerk before",
            "process the original, or add --force to process its remaining rapids",
            Place(name, program.stamp if written is None else written.map.line_of(program.stamp)),
        )
    return program.written_for(emitter.name)


def _plan(
    source: BinaryIO,
    program: Program,
    machine: Machine,
    settings: Settings,
    emitter: Controller,
    report: Progress,
    spread: Spread,
) -> Plans:
    """All rapids of the program that are certain, and that the control could read as streams."""
    rapids = program.rapids
    if emitter.in_place:
        reason = reasons_to_leave(program, source, machine, program.language)
        unguardable = emitter.unguardable(program, source, machine, program.language)
        reason[unguardable & (reason == CERTAIN)] = REASONS.index(Reason.SUBPROGRAM)
        rapids = replace(rapids, reason=reason)
    plans = plan_rapids(
        rapids,
        machine,
        settings.profile,
        lambda done, total: report("planning", done, total),
        emitter.unblended if emitter.in_place else "",
        only_gains=True,
        spread=spread,
    )
    if emitter.longest is not None:
        too_long = plans.planned & (plans.counts > emitter.longest)
        plans.reason[too_long] = REASONS.index(Reason.TOO_LONG)
    return plans


def _chosen(machine: Machine, settings: Settings, name: str, form: str) -> list[str]:
    """The user's choices that shape the output, for the stamp."""
    chosen = [name, form, settings.profile or machine.design.profile]
    chosen += ["expand-cycles"] if settings.expand_cycles else []
    chosen += ["unroll"] if settings.unroll else []
    chosen += [machine.rapid_feed.text] if machine.rapid_feed is not None else []
    return chosen + ([f"dialect {settings.dialect}"] if settings.dialect is not None else [])


def _verified(
    source: BinaryIO,
    target: BinaryIO,
    machine: Machine,
    settings: Settings,
    program: Program,
    plans: Plans,
    emitter: Controller,
    lines: Lines | None,
    beside: BinaryIO | None,
    report: Progress,
    spread: Spread = here,
    edits: NDArray[np.int64] | None = None,
) -> Verification:
    """Read an output back; whatever is wrong with it is raised, in lines of the original."""
    source.seek(0)
    target.seek(0)
    design = replace(machine.design, profile=settings.profile or machine.design.profile)
    try:
        found = verify_files(
            source,
            target,
            replace(machine, design=design, controller=emitter.name),
            names=(program.name, f"the output for {program.name}"),
            dialect=program.dialect,
            table=not emitter.in_place,
            reported=ReportedProfiles(program, plans) if emitter.play is Play.ALIGNED else None,
            beside=beside if emitter.beside else None,
            program=program,
            progress=lambda done, total: report("verifying", done, total),
            # One process reads the files as a whole: that is the plainer proof.
            spread=None if spread is here else spread,
            edits=edits,
        )
        require(lines_in_original(found, lines))
    except (ProgramError, VerifyError):
        if digest_of(source) != program.digest:
            raise changed_error(program.name) from None
        raise
    return found


def silent(step: str, done: int, total: int) -> None:
    """Progress that nobody watches."""
