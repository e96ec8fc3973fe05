"""Which outputs need not be made again: those that were made of this program, for these choices.

Rule: as make has it, an output is current if it is newer than its program; beyond that its stamp
has to be of this version, machine file and options, and its sum that of the bytes that are there.
A program that was put in its place since, with the date that it had, is proven to be the one that
the output was made of. Whatever is in doubt is made again.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace

from gcodejerk._version import __version__
from gcodejerk.emit import controller_of
from gcodejerk.errors import GcodejerkError
from gcodejerk.machine import Machine
from gcodejerk.rewrite.pipeline import Settings
from gcodejerk.rewrite.stamp import is_unchanged
from gcodejerk.verification import verify_files
from gcodejerk.verification.bytes.stamp import PARAMETERS, choices_hash, read_stamp


def is_current(
    source: str, output: str, others: Sequence[str], machine: Machine, settings: Settings
) -> bool:
    """Whether an output stands for its program as it is now.

    Parameters
    ----------
    source, output : str
        Names of the two files.
    others : sequence of str
        What belongs to the output, such as a report: older than the program, nothing is current.
    machine : Machine
        What it runs on.
    settings : Settings
        The user's choices.

    Returns
    -------
    bool
        False where anything is missing or in doubt.
    """
    if not settings.comments or not settings.verify:
        # Whether there were comments, and whether it was proven, no stamp says.
        return False
    try:
        status = os.stat(source)
        written = min(os.stat(name).st_mtime_ns for name in (output, *others))
        if written <= status.st_mtime_ns:
            return False
        with open(output, "rb") as file:
            stamp = read_stamp(file, machine)
            if stamp is None or stamp.hash != _hash(machine, settings):
                return False
            file.seek(0)
            head = file.read(1 << 20)
            same_version = f"gcodejerk stamp {__version__} {stamp.hash}".encode() in head
            current = same_version and is_unchanged(file) is True
        if not current or status.st_ctime_ns < written:
            return current
        return len(others) == 0 and _is_of(source, output, machine, settings)
    except (OSError, ValueError, GcodejerkError):
        return False


def _is_of(source: str, output: str, machine: Machine, settings: Settings) -> bool:
    """Whether an output is proven to be a program with its rapids re-timed."""
    if settings.unroll or settings.expand_cycles:
        return False
    described = replace(machine, controller=settings.controller or machine.controller)
    with open(source, "rb") as original, open(output, "rb") as processed:
        return verify_files(original, processed, described, dialect=settings.dialect).ok


def _hash(machine: Machine, settings: Settings) -> str:
    """What the stamp would hold."""
    emitter = controller_of(machine, settings.controller)
    form = settings.form if settings.form == PARAMETERS else emitter.in_form(settings.form).form
    return choices_hash(
        machine.settings_hash,
        emitter.name,
        settings.profile or machine.design.profile,
        settings.expand_cycles,
        settings.dialect,
        form,
        "" if machine.rapid_feed is None else machine.rapid_feed.text,
        unroll=settings.unroll,
    )
