"""Programs whose drilling cycles are written out: their proof, and their way back to the original.

A program goes through the pipeline with its cycles written out (`cycles.expansion`); whoever reads
the results has the original in hand. This module owns what connects the two: the proof that both
make the same moves, and lines, rapids and differences in terms of the original.

Rule: how an expanded program came about proves nothing. `verification` compares it with the
original by means of its own, and the processed program with it.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from gcodejerk.cycles.expansion import Expansion, expand
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Program, Rapids
from gcodejerk.nc.line_map import LineMap
from gcodejerk.verification import Verification, Violation, require, verify_files
from gcodejerk.verification.cycles.expansion import check_expansion

SPOOL = 8 << 20
"""An expanded program is held in memory up to this size, then on disk. [bytes]"""
TERMINATOR_LENGTH = np.array([0, 1, 2, 1])
"""Bytes of a line end, by `Rapids.terminator`."""
_COMMENTS = (b"\n(gcodejerk: ", b"\n; gcodejerk: ")


@contextlib.contextmanager
def written_out(
    source: BinaryIO,
    machine: Machine,
    *,
    name: str,
    dialect: str | None,
    comments: bool,
    prove: bool,
) -> Iterator[tuple[BinaryIO, Expansion]]:
    """A program with its cycles written out, for as long as the block lasts.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable; read from its beginning.
    machine : Machine
        What it runs on.
    name : str
        What messages call it.
    dialect : str or None
        The machine's by default.
    comments : bool
        Name each block that is written out in a comment.
    prove : bool
        Compare the result with the program.

    Yields
    ------
    used : BinaryIO
        At its beginning; the source itself where no cycle can be written out.
    expansion : Expansion
        What was written out, and what was not.

    Raises
    ------
    EmitError
        There are subprograms in other files.
    VerifyError
        What was written is not right.
    """
    if machine.subprograms is not None:
        raise EmitError(
            "--expand-cycles and subprograms of other files are not possible together: a cycle may "
            "go on in a file that stays as it is",
            "leave one of them out (--subprograms, or program.subprograms of the machine file)",
        )
    with tempfile.SpooledTemporaryFile(max_size=SPOOL) as file:
        between = cast(BinaryIO, file)
        source.seek(0)
        expansion = expand(
            source,
            between,
            name=name,
            dialect=dialect or machine.dialect,
            start=machine.program_start(),
            comments=comments,
        )
        used = between if expansion.written else source
        if expansion.written and prove:
            names = (name, f"the output for {name}")
            require(prove_expansion(source, between, machine, names=names, dialect=dialect))
        used.seek(0)
        yield used, expansion


def prove_expansion(
    original: BinaryIO,
    expanded: BinaryIO,
    machine: Machine,
    *,
    names: tuple[str, str],
    dialect: str | None = None,
    most: int = 100,
) -> Verification:
    """Compare a program with the same program after its cycles were written out.

    Parameters
    ----------
    original, expanded : BinaryIO
        Seekable; read from their beginning, and left there.
    machine : Machine
        What the program runs on.
    names : tuple of str
        For messages.
    dialect : str, optional
        The machine's by default.
    most : int, optional
        Violations after which it stops.

    Returns
    -------
    Verification
        Without lines of the expanded program, which nobody else sees.
    """
    original.seek(0)
    expanded.seek(0)
    found = check_expansion(
        original,
        expanded,
        dialect=dialect or machine.dialect,
        start=machine.program_start(),
        names=names,
        most=most,
    )
    original.seek(0)
    expanded.seek(0)
    violations = (replace(violation, line=None) for violation in found.violations)
    return replace(found, violations=tuple(violations))


def verify_expanded(
    original: BinaryIO,
    processed: BinaryIO,
    machine: Machine,
    *,
    names: tuple[str, str] = ("<original>", "<processed>"),
    dialect: str | None = None,
    most: int = 100,
    beside: BinaryIO | None = None,
) -> tuple[Verification, int]:
    """Prove that a program is another one with its cycles written out and its rapids re-timed.

    The original's cycles are written out once more; then both steps are proven, from the original
    to that program and from that program to the processed one.

    Parameters
    ----------
    original, processed : BinaryIO
        Seekable, at their beginning.
    machine : Machine
        What the program was processed for.
    names : tuple of str, optional
        For messages.
    dialect : str, optional
        The machine's by default.
    most : int, optional
        Violations after which it stops.
    beside : BinaryIO, optional
        The file of samples beside the processed program.

    Returns
    -------
    verification : Verification
        Of both steps; lines are those of the processed and of the original program.
    written : int
        Blocks of cycles that are written out.
    """
    comments = _names_blocks(processed)
    with written_out(
        original, machine, name=names[0], dialect=dialect, comments=comments, prove=False
    ) as (between, expansion):
        first: tuple[Violation, ...] = ()
        if expansion.written:
            first = prove_expansion(
                original, between, machine, names=names, dialect=dialect, most=most
            ).violations
        found = verify_files(
            between, processed, machine, names=names, dialect=dialect, most=most, beside=beside
        )
    later = (_in_original(violation, expansion.map) for violation in found.violations)
    violations = (*first, *later)[:most]
    return replace(found, violations=violations), expansion.written


def _names_blocks(processed: BinaryIO) -> bool:
    """Whether blocks that were replaced are named in comments; back at the beginning."""
    found, tail = False, b"\n"
    while not found and (piece := processed.read(SPOOL)):
        data = tail + piece
        found, tail = any(comment in data for comment in _COMMENTS), data[-len(_COMMENTS[1]) :]
    processed.seek(0)
    return found


def _in_original(violation: Violation, lines: LineMap) -> Violation:
    """A violation with the line of the original."""
    return replace(violation, original_line=lines.line_of(violation.original_line))


def lines_in_original(verification: Verification, lines: LineMap | None) -> Verification:
    """A verification with the lines of the original, where there is a map to them."""
    if lines is None:
        return verification
    later = tuple(_in_original(violation, lines) for violation in verification.violations)
    return replace(verification, violations=later)


def in_original(program: Program, expansion: Expansion | None) -> Program:
    """A program as it was read, its rapids and findings with their lines in the original."""
    if expansion is None or not expansion.written:
        return program
    findings = (replace(f, line=expansion.map.line_of(f.line)) for f in program.findings)
    return replace(
        program,
        blocks=expansion.blocks,
        findings=tuple(findings),
        rapids=expansion.map.rapids_of(program.rapids),
    )


def hunks(
    edits: NDArray[np.int64], rapids: Rapids, insert_at: int, lines: LineMap | None
) -> NDArray[np.int64]:
    """Where an output differs from the original, and from what.

    Parameters
    ----------
    edits : ndarray of int, shape (k, 3)
        Of the program that was processed; see `result.Result`.
    rapids : Rapids
        Of that program.
    insert_at : int
        Where in it the stamp stands. [bytes]
    lines : LineMap or None
        From that program to the original, where they are not the same.

    Returns
    -------
    ndarray of int, shape (n, 5)
        Begin and end in the output [bytes]; line, begin and end in the original [bytes].
    """
    row = edits[:, 2]
    stamp = row < 0
    at = np.where(stamp, 0, row)
    if len(rapids):
        size = rapids.end + TERMINATOR_LENGTH[rapids.terminator] - rapids.begin
        begin = np.where(stamp, insert_at, rapids.begin[at])
        end = begin + np.where(stamp, 0, size[at])
    else:
        begin = end = np.full(len(edits), insert_at)
    first = 1 if insert_at else 0
    if lines is None or not len(lines):
        line = (
            np.where(stamp, first, rapids.line[at]) if len(rapids) else np.full(len(edits), first)
        )
        return np.stack([edits[:, 0], edits[:, 1], line, begin, end], axis=1)
    spans = lines.replaced
    grown = np.concatenate([[0], np.cumsum(edits[:, 1] - edits[:, 0] - (end - begin))])
    out = [
        place + grown[np.searchsorted(end, place, side="right")]
        for place in (spans.begin, spans.end)
    ]
    back = TERMINATOR_LENGTH[spans.original_terminator]
    blocks = [*out, spans.original_line, spans.original_begin, spans.original_end + back]
    k = np.searchsorted(spans.begin, begin, side="right") - 1
    alone = stamp | (k < 0) | (begin >= spans.end[k])
    mapped = lines.rapids_of(rapids)
    original = np.where(stamp, insert_at, mapped.begin[at])
    line = np.where(stamp, first, mapped.line[at])
    rest = [edits[:, 0], edits[:, 1], line, original, original + end - begin]
    table = np.concatenate([np.stack(blocks, axis=1), np.stack(rest, axis=1)[alone]]).astype(
        np.int64
    )
    return np.asarray(table[np.argsort(table[:, 0], kind="stable")])
