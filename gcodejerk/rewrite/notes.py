"""What the user has to be told of one program: the machine, the figures, the program itself."""

from __future__ import annotations

import numpy as np

from gcodejerk.advice import ABSOLUTE, NO_MODES, at_the_machine
from gcodejerk.emit import Controller
from gcodejerk.machine import DIALECT_OF_CONTROLLER, Machine
from gcodejerk.nc import Program
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import Residuals
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.rewrite.expanded import WrittenOut
from gcodejerk.storage import windows
from gcodejerk.unrolling.unrolling import has_flow

_NAMED = 8
"""Files that are named."""

LONGER = 1e-6
"""A rapid that lasts so much longer is worth a word. [s]"""


def operator_notes(emitter: Controller, machine: Machine, plans: Plans) -> list[str]:
    """What comes first: for whoever stands at the machine, then for whoever reads the figures."""
    notes = []
    if emitter.in_place and plans.planned.any():
        guarded = machine.controller_options.override_guard
        notes.append(at_the_machine(emitter.name, guarded))
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


def subprogram_notes(program: Program, machine: Machine) -> list[str]:
    """That rapids rest on what stands in other files, by their names."""
    if not program.subprograms:
        return []
    count = len(program.subprograms)
    named = ", ".join(program.subprograms[:_NAMED]) + (", .." if count > _NAMED else "")
    folder = "" if machine.subprograms is None else machine.subprograms.folder
    return [
        f"followed into {count} {'file' if count == 1 else 'files'} of {folder} ({named}): the "
        "control has to have the same there; process again when one of them changes"
    ]


def loop_notes(program: Program, written: WrittenOut | None) -> list[str]:
    """That rapids stand in loops and subprograms which could be written out."""
    asked = written is not None and written.unrolling is not None
    inside = program.rapids.reason == REASONS.index(Reason.SUBPROGRAM)
    count = int(np.count_nonzero(inside))
    if asked or not count or not has_flow(program.language):
        return []
    rapids = "1 rapid left alone stands" if count == 1 else f"{count} rapids left alone stand"
    return [
        f"{rapids} in loops, branches or subprograms: --unroll writes out those "
        "whose way is known (docs/unroll.md)"
    ]


def frame_notes(program: Program, machine: Machine) -> list[str]:
    """That a control may keep what lies between machine and work system from the program before."""
    lasting = "tool length" in program.language.groups.values()
    if not machine.program.offsets or not lasting or not (program.rapids.reason == CERTAIN).any():
        return []
    return [
        "program.offsets is taken to mean, too, that this program begins without G92 and without "
        "a tool length: where the control keeps them from another program, clear them in front "
        "(G49, G92.1)"
    ]


def program_notes(
    program: Program, written: WrittenOut | None, emitter: Controller, machine: Machine
) -> list[str]:
    """What was found in the program, and what its dialect means for the control."""
    findings = (*program.findings, *(() if written is None else written.findings))
    notes = [_finding(finding.line, finding.message) for finding in findings]
    notes += subprogram_notes(program, machine)
    notes += loop_notes(program, written)
    notes += frame_notes(program, machine)
    home = DIALECT_OF_CONTROLLER.get(emitter.name)
    if emitter.in_place and home is not None and not program.dialect.startswith(home):
        notes.append(
            f"the program is read as {program.dialect}, controller {emitter.name} reads {home}: "
            "how the program's control follows its streams was not measured"
        )
    return notes


def band_notes(plans: Plans, residuals: Residuals) -> list[str]:
    """That some rapids leave more at the file's own frequencies, where today's are lucky there."""
    if not plans.has_to_gain:
        return []
    count = 0
    for part in windows(len(plans)):
        own, today = (
            plans.modes.grouped(each[part]).max(axis=1, initial=0.0)
            for each in (residuals.residual, residuals.conventional)
        )
        with np.errstate(invalid="ignore"):
            count += int(np.count_nonzero((plans.reason[part] == CERTAIN) & (own > today)))
    if not count:
        return []
    rapids = "1 rapid leaves" if count == 1 else f"{count} rapids leave"
    band = f"{100.0 * plans.machine.design.band:.3g} %"
    return [
        f"{rapids} more than today's at exactly the file's frequencies, and less at the worst "
        f"within {band} of them, which all are designed for (design.band)"
    ]


def tick_notes(plans: Plans) -> list[str]:
    """That some rapids last longer than whole intervals, since the control counts in ticks."""
    if plans.lasting is None:
        return []
    more = plans.lasting - plans.counts * plans.machine.interval
    longer = plans.planned & (more > LONGER)
    count = int(np.count_nonzero(longer))
    if not count:
        return []
    rapids = "1 rapid lasts" if count == 1 else f"{count} rapids last"
    most = 1e3 * float(more[longer].max())
    return [f"{rapids} up to {most:.3g} ms longer than planned, in whole ticks of the control"]


def _finding(line: int | None, message: str) -> str:
    """A finding as a line of text."""
    return message if line is None else f"line {line}: {message}"
