"""The step in front that writes a program's flow out; what it gives back.

Rule: a file is read whole, up to `MOST_BYTES`, and judged before anything is written.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from gcodejerk.errors import EmitError, Place, ProgramError
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.elsewhere import find_elsewhere
from gcodejerk.nc.interpreter.runner import Finding
from gcodejerk.nc.line_map import LineMap
from gcodejerk.nc.program import follow
from gcodejerk.nc.text.chunks import read_chunks
from gcodejerk.start import NOTHING_KNOWN, Start
from gcodejerk.unrolling.o_words import OWordUnroller
from gcodejerk.unrolling.pieces import LeftAloneError, put_together
from gcodejerk.unrolling.scripts import ScriptUnroller

MOST_LINES = 100_000
"""Lines that are written, where the machine file says nothing else."""
MOST_BYTES = 16_000_000
"""Of a program."""
_SHOWN = 20
"""Structures left alone that get a finding of their own."""
_PLACE = re.compile(rb"<_(?:value|value_returned|call_level|remap_level|line)>")
"""Variables of LinuxCNC that say where in the flow it is."""

_FUNCTIONS = re.compile(rb"(?:A?(?:SIN|COS|TAN)|EXP|LN)\[|\*\*")
"""Of which two libraries may not give the same last digit."""


@dataclass(frozen=True, slots=True, eq=False)
class Unrolling:
    """What was written out, and what was not."""

    blocks: int
    """Of the original."""
    structures: int
    """Loops, branches and calls of the main program."""
    written: int
    """Those of them that were written out."""
    lines: int
    """That stand in their place."""
    whole: bool
    """Nothing of the flow is left."""
    findings: tuple[Finding, ...]
    map: LineMap
    used: tuple[str, ...] = ()
    """Files in which subprograms were found."""

    def undone(self, reason: str) -> Unrolling:
        """The same where nothing is written out after all."""
        told = Finding(None, f"loops and calls not written out: {reason}")
        none = LineMap(*np.zeros((8, 0), dtype=np.int64))
        return replace(self, written=0, lines=0, whole=False, findings=(told,), map=none, used=())


def unroll(
    source: BinaryIO,
    target: BinaryIO,
    *,
    name: str = "<program>",
    dialect: str | Dialect = "linuxcnc",
    start: Start = NOTHING_KNOWN,
    comments: bool = True,
) -> Unrolling:
    r"""Write loops, branches and calls out in the order in which their blocks run.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable, at its beginning.
    target : BinaryIO
        Takes the result; nothing is written where nothing can be written out.
    name : str, optional
        For messages.
    dialect : str or Dialect, optional
        How the program is written.
    start : Start, optional
        What may be assumed when it starts; `Start.unrolled_lines` is the bound.
    comments : bool, optional
        Name each structure that is written out in a comment.

    Returns
    -------
    Unrolling
        With `written` 0, and nothing in `target`, where nothing is certain.

    Raises
    ------
    ProgramError
        The file cannot be an NC program, or the dialect's flow cannot be written out.
    EmitError
        The file was changed meanwhile.

    Examples
    --------
    >>> import io
    >>> program = b"#1=0\no1 while [#1 LT 2]\nG0 X#1\n#1=[#1+1]\no1 endwhile\nM2\n"
    >>> target = io.BytesIO()
    >>> unroll(io.BytesIO(program), target, comments=False).lines
    4
    >>> target.getvalue().decode().split("\n")[:-1]
    ['#1=0', 'G0 X#1', '#1=[#1+1]', 'G0 X#1', '#1=[#1+1]', 'M2']
    """
    chosen = find_dialect(dialect)
    begin = source.tell()
    data = source.read(MOST_BYTES + 1)
    for jumps in (True, False):
        source.seek(begin)
        reader = _reader(name, chosen, start, comments, data, jumps=jumps)
        program = follow(read_chunks(source, name), reader, None, True)
        if not reader.jumped:
            break
    pieces = reader.pieces()
    left, whole = reader.left, reader.straight
    place = _place([data, *(start.subprograms[file] for file in reader.used)])
    if len(data) > MOST_BYTES:
        pieces, whole = [], False
        left = [(1, LeftAloneError(f"more than {MOST_BYTES // 10**6} MB", 1))]
    elif chosen.text.o_word == "flow" and place:
        pieces, whole = [], False
        left = [(1, LeftAloneError(f"the program reads #{place}", 1))]
    again = target if pieces else None
    source.seek(begin)
    lines = put_together(source, again, pieces, program.newline)
    source.seek(begin)
    if source.read(MOST_BYTES + 1) != data:
        raise EmitError(
            f"{name} was changed while it was being read",
            "run the command again when nothing writes to the file",
        )
    return Unrolling(
        program.blocks,
        reader.structures,
        reader.written(pieces),
        sum(len(piece.lines) for piece in pieces),
        whole,
        _findings(left),
        lines,
        reader.used if pieces else (),
    )


def _place(texts: Sequence[bytes]) -> str:
    """A variable that says where in the flow LinuxCNC is, which one of these texts reads."""
    found = (_PLACE.search(text.translate(None, b" \t").lower()) for text in texts)
    return next((match[0].decode() for match in found if match), "")


def has_flow(dialect: Dialect) -> bool:
    """Whether loops and calls of the language can be written out."""
    return dialect.text.o_word == "flow" or _has_scripts(dialect)


def _has_scripts(dialect: Dialect) -> bool:
    """Whether whole programs of the language are followed: Siemens, and macro B and its kin."""
    rules = dialect.text
    siemens = rules.names and rules.variables == "R"
    return siemens or (bool(rules.keywords) and rules.o_word == "program")


def _reader(
    name: str, dialect: Dialect, start: Start, comments: bool, data: bytes, *, jumps: bool
) -> OWordUnroller | ScriptUnroller:
    """Who reads a program of this language, and writes it out on the way."""
    most = start.unrolled_lines or MOST_LINES
    if dialect.text.o_word == "flow":
        if _FUNCTIONS.search(data.translate(None, b" \t").upper()):
            arithmetic = replace(dialect.arithmetic, careful=True)
            dialect = replace(dialect, arithmetic=arithmetic)
        return OWordUnroller(name, dialect, start, most, comments, jumps=jumps)
    if _has_scripts(dialect):
        elsewhere = find_elsewhere(data, start.subprograms, dialect)
        return ScriptUnroller(name, dialect, start, elsewhere, most, comments)
    raise ProgramError(
        f"loops and calls of dialect '{dialect.name}' cannot be written out",
        "leave --unroll out, or state the dialect of the program's own control (--dialect); known "
        "are those of LinuxCNC, Siemens, and of Fanuc, Haas and their kin",
        Place(name),
    )


def _findings(left: Sequence[tuple[int, LeftAloneError]]) -> tuple[Finding, ...]:
    """What the user should know of the structures that stay."""
    found = []
    for line, error in left[:_SHOWN]:
        where = "" if error.line == line else f" (line {error.line})"
        found.append(Finding(line, f"loop or call not written out: {error.reason}{where}"))
    if len(left) > _SHOWN:
        found.append(Finding(None, f"{len(left) - _SHOWN} more loops or calls not written out"))
    return tuple(found)
