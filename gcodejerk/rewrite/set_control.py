"""The result of a program that sets its control: no rapid is rewritten, each keeps a reason.

This module owns what a `Result` is there; what is set and where owns `control_settings`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import BinaryIO

import numpy as np

from gcodejerk.emit import Controller
from gcodejerk.emit.sheets import Sheets
from gcodejerk.machine import Machine
from gcodejerk.nc import Program
from gcodejerk.planning.rapids import plan_rapids
from gcodejerk.planning.settling import left_alone
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.rewrite.control_settings import PARAMETERS, plan_settings, write_settings
from gcodejerk.rewrite.notes import operator_notes, program_notes
from gcodejerk.rewrite.result import Result
from gcodejerk.rewrite.stamp import stamp_text


def set_control(
    source: BinaryIO,
    target: BinaryIO | None,
    program: Program,
    machine: Machine,
    emitter: Controller,
    sheets: Sheets,
    chosen: Sequence[str],
) -> Result:
    """Tune a control for a program, and write the program with the lines that set it.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable.
    target : BinaryIO or None
        Empty and seekable; None to write nothing.
    program : Program
        As it was read.
    machine : Machine
        What it runs on.
    emitter, sheets : Controller, Sheets
        The control: one and the same.
    chosen : sequence of str
        The user's choices, for the stamp: controller, form, profile, and more.

    Returns
    -------
    Result
        Not yet verified.
    """
    inserted = plan_settings(source, program, machine, sheets)
    kept = REASONS.index(Reason.CONTROL_SET if inserted.lines else Reason.NOT_BETTER)
    before = program.rapids.reason
    still = replace(program.rapids, reason=np.where(before == CERTAIN, kept, before))
    plans = plan_rapids(still, machine, only_gains=True)
    plans.reason[plans.planned] = kept
    edits, differences = np.empty((0, 3), dtype=np.int64), np.empty((0, 5), dtype=np.int64)
    if target is not None:
        stamp = stamp_text(machine, chosen)
        edits, differences = write_settings(source, target, program, inserted, stamp, emitter.name)
    residual = np.full((len(plans), len(plans.modes.poles)), np.nan)
    return Result(
        program=program,
        plans=plans,
        controller=emitter.name,
        profile=chosen[2],
        form=PARAMETERS,
        residual=residual,
        conventional_residual=residual,
        deviation=np.zeros(len(plans)),
        rest=left_alone(program.rapids, plans),
        verification=None,
        edits=edits,
        hunks=differences,
        expansion=None,
        notes=(
            *operator_notes(emitter, machine, plans),
            *inserted.settings.notes,
            *program_notes(program, None, emitter, machine),
        ),
        settings=inserted.settings,
    )
