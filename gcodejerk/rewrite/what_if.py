"""Which entries of the machine file would make more rapids certain, and how many.

This module owns the question "what if". It is answered by reading the program again with entries
stated, so that the number holds whatever the reasons were: the values that are put in for them do
not matter for what is certain, and go nowhere else. Of all entries together those are named without
which it would be fewer. Of a long program the beginning is read, where what is missing shows.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import BinaryIO

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.nc import CERTAIN, Dialect, Program, Start, read_program
from gcodejerk.nc.dialects.gcodes import G40, G90

LONGEST = 200_000
"""Of programs of more bytes the beginning is read. [B]"""
MOST_STEPS = 2_000
"""So it is where more blocks are run one by one; with loops, which may take seconds, nothing is."""
BEGINNING = 1_000
"""Lines of a beginning."""
_SYSTEM = re.compile(rb"(?<![A-Z_])G(5[4-9](?:\.[1-3])?)(?![\d.])", re.IGNORECASE)
_TOOL_CHANGE = re.compile(rb"(?<![A-Z_])M0?6(?!\d)", re.IGNORECASE)
_STOP = re.compile(rb"(?<![A-Z_])M0?[01](?!\d)", re.IGNORECASE)
_RETURN = re.compile(rb"(?<![A-Z_])G28(?![\d.])", re.IGNORECASE)
_M_CODE = re.compile(rb"(?<![A-Z_])M0*(\d{1,3})(?!\d)", re.IGNORECASE)
_ZERO = dict.fromkeys(AXES, 0.0)
Change = Callable[[Start], Start]


def entry_notes(source: BinaryIO, program: Program, start: Start) -> list[str]:
    """Say which entries of the machine file would help, together and the best of them alone.

    Parameters
    ----------
    source : binary file
        The program, seekable.
    program : Program
        What was read of it.
    start : Start
        What it was read with.

    Returns
    -------
    list of str
        One note, or none where no entry helps or reading again takes long (loops of more than
        `MOST_STEPS` blocks).
    """
    of_what = ""
    if program.size > LONGEST or program.steps > MOST_STEPS:
        if program.steps > program.lines or not _left(program):
            return []
        source = _beginning(source)
        try:
            program = read_program(source, dialect=program.dialect, start=start)
        except ProgramError:
            return []
        of_what = f" of the first {program.lines} lines"
    if not _left(program):
        return []
    source.seek(0)
    text = source.read()
    known = len(program.rapids) - _left(program)

    def gain(entries: Mapping[str, Change]) -> int:
        stated = start
        for change in entries.values():
            stated = change(stated)
        source.seek(0)
        try:
            again = read_program(source, dialect=program.dialect, start=stated)
        except ProgramError:
            return 0
        return len(again.rapids) - _left(again) - known

    entries = dict(_entries(text, program, start))
    most = gain(entries) if entries else 0
    if most <= 0:
        return []
    for entry in reversed(list(entries)):
        fewer = {name: change for name, change in entries.items() if name != entry}
        if fewer and gain(fewer) >= most:
            entries = fewer
    more = ("1 more rapid" if most == 1 else f"{most} more rapids") + of_what
    note = f"stated in the machine file, {', '.join(entries)} would make {more} certain"
    if len(entries) == 1:
        return [note]
    alone = {entry: gain({entry: change}) for entry, change in entries.items()}
    best = max(alone, key=lambda entry: alone[entry])
    return [f"{note} ({best} alone: {alone[best]})" if alone[best] > 0 else note]


def _left(program: Program) -> int:
    """Rapids that are not certain."""
    return int(np.count_nonzero(program.rapids.reason != CERTAIN))


def _beginning(source: BinaryIO) -> BinaryIO:
    """The first lines of a program, whole ones."""
    source.seek(0)
    lines = source.read(LONGEST).split(b"\n", BEGINNING)
    return io.BytesIO(b"\n".join([*lines[:-1], b""]))


def _entries(text: bytes, program: Program, start: Start) -> Iterator[tuple[str, Change]]:
    """The entries that the program leaves room for, each with what it changes."""
    if not start.startup:
        codes = _startup(program.language)
        yield f"program.startup (such as {codes})", lambda s: replace(s, startup=codes)
    if program.language.whole_numbers == "machine" and start.decimal_point is None:
        yield "program.decimal_point", lambda s: replace(s, decimal_point="calculator")
    if start.spindle is None:
        yield "spindle: mill", lambda s: replace(s, spindle="mill")
    switches = frozenset(map(int, _M_CODE.findall(text))) - start.m_before - start.m_after
    if switches:
        yield (
            "program.m_before and program.m_after",
            lambda s: replace(s, m_after=s.m_after | switches),
        )
    yield from _places(text, start)


def _places(text: bytes, start: Start) -> Iterator[tuple[str, Change]]:
    """Entries that say where the axes stand."""
    if not start.positions:
        yield "program.start", lambda s: replace(s, positions=_ZERO)
    stated = {name.decode() for name in _SYSTEM.findall(text)}
    systems = [f"G{code}" for code in sorted(stated | {"54"}) if f"G{code}" not in start.offsets]
    if systems:
        offsets = {**start.offsets, **dict.fromkeys(systems, _ZERO)}
        yield (
            f"program.offsets of {' and '.join(systems)}",
            lambda s: replace(s, offsets=offsets),
        )
    if not start.home and _RETURN.search(text):
        yield "program.home", lambda s: replace(s, home=_ZERO)
    if start.tool_change is None and _TOOL_CHANGE.search(text):
        yield "program.tool_change", lambda s: replace(s, tool_change={})
    if start.resume is None and _STOP.search(text):
        yield "program.resume_after_stop: same", lambda s: replace(s, resume="same")


def _startup(language: Dialect) -> str:
    """Codes for the modes that rapids rest on."""
    mm = next((code for code, inch in language.units.items() if not inch), None)
    path = language.path_code(64) if language.path_has_to_be_stated else None
    codes = (mm, G90, G40, language.feed_code(94), path)
    return " ".join(f"G{c / 10:g}" for c in codes if c is not None and c in language.groups)
