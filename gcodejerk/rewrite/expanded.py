"""Programs with blocks written out in front of the eight steps: their proof, and their way back.

A program goes through the pipeline with its loops and calls (`unrolling`) and its drilling cycles
(`cycles`) written out; whoever reads the results has the original in hand. This module owns what
connects the two: the proof that both make the same moves, and lines, rapids and differences in
terms of the original.

Rule: how such a program came about proves nothing. `verification` compares it with the original by
means of its own, step by step, and the processed program with it.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from gcodejerk.cycles.expansion import Expansion, expand
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Program, Rapids, dialect_of
from gcodejerk.nc.interpreter.runner import Finding
from gcodejerk.nc.line_map import Chain, Lines
from gcodejerk.nc.program import read_as, told_dialect
from gcodejerk.start import Start
from gcodejerk.storage import made
from gcodejerk.unrolling.unrolling import Unrolling, unroll
from gcodejerk.verification import Verification, Violation, verify_files
from gcodejerk.verification.cycles.expansion import check_expansion
from gcodejerk.verification.unrolling.checking import NotFollowedError, check_unrolling

SPOOL = 8 << 20
"""A program with blocks written out is held in memory up to this size, then on disk. [bytes]"""
TERMINATOR_LENGTH = np.array([0, 1, 2, 1])
"""Bytes of a line end, by `Rapids.terminator`."""
_PART = re.compile(rb"(?<![A-Z])M97(?![0-9])", re.IGNORECASE)
_COMMENTS = (b"\n(gcodejerk: ", b"\n; gcodejerk: ")


@dataclass(frozen=True, slots=True)
class Front:
    """What is to be written out in front."""

    unroll: bool = False
    """Loops, branches and calls."""
    cycles: bool = False
    """Drilling cycles."""

    def __bool__(self) -> bool:
        return self.unroll or self.cycles

    @property
    def what(self) -> str:
        """Words for it."""
        wanted = [(self.unroll, "loops"), (self.cycles, "cycles")]
        return " or ".join(word for asked, word in wanted if asked)

    @property
    def options(self) -> str:
        """As the user has asked for it."""
        wanted = [(self.unroll, "--unroll"), (self.cycles, "--expand-cycles")]
        return " and ".join(option for asked, option in wanted if asked)


@dataclass(frozen=True, slots=True, eq=False)
class WrittenOut:
    """What was written out, and what was not."""

    unrolling: Unrolling | None
    expansion: Expansion | None
    """None: not asked for."""
    dialect: Dialect
    """In which the program is read."""
    why: str
    """How its text told that dialect; empty where it did not have to."""

    @property
    def map(self) -> Lines:
        """From the lines of the result to the original's."""
        steps = [step.map for step in (self.unrolling, self.expansion) if step is not None]
        return Chain(*steps) if len(steps) == 2 else steps[0]

    @property
    def blocks(self) -> int:
        """Of the original."""
        step = self.unrolling or self.expansion
        assert step is not None
        return step.blocks

    @property
    def written(self) -> int:
        """Structures and blocks that were written out."""
        return sum(step.written for step in (self.unrolling, self.expansion) if step is not None)

    @property
    def used(self) -> tuple[str, ...]:
        """Files whose subprograms were written out."""
        return () if self.unrolling is None else self.unrolling.used

    @property
    def told(self) -> str:
        """Words for it, in front of what else was done."""
        loops, cycles = self.unrolling, self.expansion
        text = ""
        if loops is not None:
            what = "loop or call" if loops.written == 1 else "loops and calls"
            text = f"{loops.written} {what} written out, "
        return text + ("" if cycles is None else f"{cycles.written} cycles written out, ")

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the user should know, with lines of the original."""
        first = () if self.unrolling is None else self.unrolling.findings
        later = () if self.expansion is None else self.expansion.findings
        if self.unrolling is not None:
            line_of = self.unrolling.map.line_of
            later = tuple(replace(f, line=line_of(f.line)) for f in later)
        told = (read_as(self.dialect, self.why),) if self.why else ()
        return (*told, *first, *later)


@contextlib.contextmanager
def written_out(
    source: BinaryIO,
    machine: Machine,
    front: Front,
    *,
    name: str,
    dialect: str | None,
    comments: bool,
    prove: Callable[[Verification], object] | None,
    most: int = 100,
) -> Iterator[tuple[BinaryIO, WrittenOut]]:
    """A program with its loops, calls and cycles written out, for as long as the block lasts.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable; read from its beginning.
    machine : Machine
        What it runs on.
    front : Front
        What is to be written out.
    name : str
        What messages call it.
    dialect : str or None
        The machine's by default.
    comments : bool
        Name what is written out in comments.
    prove : callable or None
        Takes what is found where a result is compared with what it was made of; None: nothing is.
    most : int, optional
        Violations after which a comparison stops.

    Yields
    ------
    used : BinaryIO
        At its beginning; the source itself where nothing can be written out.
    written : WrittenOut
        What was written out, and what was not.

    Raises
    ------
    EmitError
        There are subprograms in other files, whose cycles would stay.
    """
    names, start = (name, f"the output for {name}"), machine.program_start()
    source.seek(0)
    language, why = told_dialect(source, name, dialect_of(machine, dialect), start)
    chosen = Chosen(name, language, start, comments)
    with contextlib.ExitStack() as files:
        used, unrolling, expansion = source, None, None
        source.seek(0)
        if front.unroll:
            between = cast(
                BinaryIO, files.enter_context(tempfile.SpooledTemporaryFile(max_size=SPOOL))
            )
            unrolling = unroll(used, between, **chosen.options())
            if unrolling.written and prove is not None:
                try:
                    prove(_proven(check_unrolling, used, between, chosen, names, most))
                except NotFollowedError:
                    unrolling = unrolling.undone(_why_unproven(source))
            used = between if unrolling.written else used
            used.seek(0)
        if front.cycles:
            _require_own(machine, unrolling)
            after = cast(
                BinaryIO, files.enter_context(tempfile.SpooledTemporaryFile(max_size=SPOOL))
            )
            expansion = expand(used, after, **chosen.options())
            if expansion.written and prove is not None:
                found = _proven(check_expansion, used, after, chosen, names, most)
                prove(lines_in_original(found, None if unrolling is None else unrolling.map))
            used = after if expansion.written else used
        used.seek(0)
        yield used, WrittenOut(unrolling, expansion, language, why)


@dataclass(frozen=True, slots=True)
class Chosen:
    """How a program is read and written."""

    name: str
    dialect: Dialect
    start: Start
    comments: bool

    def options(self) -> dict[str, Any]:
        """As `expand` and `unroll` take it."""
        return {
            "name": self.name,
            "dialect": self.dialect,
            "start": self.start,
            "comments": self.comments,
        }


def _why_unproven(source: BinaryIO) -> str:
    """Say why nothing is written out that the unrolling could follow, and its proof could not."""
    source.seek(0)
    for number, line in enumerate(source, 1):
        if _PART.search(line.partition(b"(")[0]):
            return (
                f"M97 (line {number}) runs a part of the program, which the proof does not follow; "
                "make it a subprogram (M98)"
            )
    return "a second reading does not follow its flow"


def _require_own(machine: Machine, unrolling: Unrolling | None) -> None:
    """Refuse to write cycles out where a program goes on in other files."""
    if machine.subprograms is None or (unrolling is not None and unrolling.whole):
        return
    if unrolling is None:
        remedy = "add --unroll, which writes the calls out, or leave one of the two out"
    else:
        remedy = "leave --expand-cycles out: not all loops and calls could be written out"
    raise EmitError(
        "--expand-cycles and subprograms of other files are not possible together: a cycle may "
        "go on in a file that stays as it is",
        f"{remedy} (--subprograms, or program.subprograms of the machine file)",
    )


def _proven(
    check: Callable[..., Verification],
    original: BinaryIO,
    other: BinaryIO,
    chosen: Chosen,
    names: tuple[str, str],
    most: int,
) -> Verification:
    """Compare two files; both are left at their beginning."""
    original.seek(0)
    other.seek(0)
    found = check(
        original,
        other,
        dialect=chosen.dialect,
        start=chosen.start,
        names=names,
        most=most,
    )
    original.seek(0)
    other.seek(0)
    violations = (replace(violation, line=None) for violation in found.violations)
    return replace(found, violations=tuple(violations))


def verify_written(
    original: BinaryIO,
    processed: BinaryIO,
    machine: Machine,
    front: Front,
    *,
    names: tuple[str, str] = ("<original>", "<processed>"),
    dialect: str | None = None,
    most: int = 100,
    beside: BinaryIO | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Verification, WrittenOut]:
    """Prove that a program is another one with blocks written out and its rapids re-timed.

    The original's loops, calls and cycles are written out once more; then every step is proven,
    from the original to that program and from that program to the processed one.

    Parameters
    ----------
    original, processed : BinaryIO
        Seekable, at their beginning.
    machine : Machine
        What the program was processed for.
    front : Front
        What was written out.
    names : tuple of str, optional
        For messages.
    dialect : str, optional
        The machine's by default.
    most : int, optional
        Violations after which it stops.
    beside : BinaryIO, optional
        The file of samples beside the processed program.
    progress : callable, optional
        As `verify_files` has it.

    Returns
    -------
    verification : Verification
        Of both steps; lines are those of the processed and of the original program.
    written : WrittenOut
        What is written out.
    """
    comments = _names_blocks(processed)
    first: list[Violation] = []
    with written_out(
        original, machine, front, name=names[0], dialect=dialect, comments=comments,
        prove=lambda found: first.extend(found.violations), most=most,
    ) as (between, written):  # fmt: skip
        found = verify_files(
            between, processed, machine, names=names, dialect=written.dialect, most=most,
            beside=beside, progress=progress,
        )  # fmt: skip
    later = (_in_original(violation, written.map) for violation in found.violations)
    violations = (*first, *later)[:most]
    return replace(found, violations=violations), written


def verify_expanded(
    original: BinaryIO, processed: BinaryIO, machine: Machine, **options: Any
) -> tuple[Verification, int]:
    """`verify_written` for drilling cycles alone; how many of their blocks are written out."""
    front = Front(cycles=True)
    found, written = verify_written(original, processed, machine, front, **options)
    return found, written.written


def _names_blocks(processed: BinaryIO) -> bool:
    """Whether blocks that were replaced are named in comments; back at the beginning."""
    found, tail = False, b"\n"
    while not found and (piece := processed.read(SPOOL)):
        data = tail + piece
        found, tail = any(comment in data for comment in _COMMENTS), data[-len(_COMMENTS[1]) :]
    processed.seek(0)
    return found


def _in_original(violation: Violation, lines: Lines) -> Violation:
    """A violation with the line of the original."""
    return replace(violation, original_line=lines.line_of(violation.original_line))


def lines_in_original(verification: Verification, lines: Lines | None) -> Verification:
    """A verification with the lines of the original, where there is a map to them."""
    if lines is None:
        return verification
    later = tuple(_in_original(violation, lines) for violation in verification.violations)
    return replace(verification, violations=later)


def in_original(program: Program, written: WrittenOut | None) -> Program:
    """A program as it was read, its rapids and findings with their lines in the original."""
    if written is None or not written.written:
        return program
    findings = (replace(f, line=written.map.line_of(f.line)) for f in program.findings)
    return replace(
        program,
        blocks=written.blocks,
        findings=tuple(findings),
        rapids=written.map.rapids_of(program.rapids),
        subprograms=tuple(dict.fromkeys((*written.used, *program.subprograms))),
    )


def hunks(
    edits: NDArray[np.int64], rapids: Rapids, insert_at: int, lines: Lines | None
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
    if lines is None or not len(lines):
        return made(lambda part: _hunks(edits[part], rapids, insert_at), (len(edits), 5), np.int64)
    row = edits[:, 2]
    stamp = row < 0
    at = np.where(stamp, 0, row)
    _, _, _, begin, end = _hunks(edits, rapids, insert_at).T
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
    line = np.where(stamp, 1 if insert_at else 0, mapped.line[at])
    rest = [edits[:, 0], edits[:, 1], line, original, original + end - begin]
    table = np.concatenate([np.stack(blocks, axis=1), np.stack(rest, axis=1)[alone]]).astype(
        np.int64
    )
    return np.asarray(table[np.argsort(table[:, 0], kind="stable")])


def _hunks(edits: NDArray[np.int64], rapids: Rapids, insert_at: int) -> NDArray[np.int64]:
    """The same where nothing was written out."""
    row = edits[:, 2]
    stamp = row < 0
    first = np.full(len(edits), 1 if insert_at else 0)
    if not len(rapids):
        at = np.full(len(edits), insert_at)
        return np.stack([edits[:, 0], edits[:, 1], first, at, at], axis=1)
    at = np.where(stamp, 0, row)
    size = rapids.end[at] + TERMINATOR_LENGTH[rapids.terminator[at]] - rapids.begin[at]
    begin = np.where(stamp, insert_at, rapids.begin[at])
    end = begin + np.where(stamp, 0, size)
    line = np.where(stamp, first, rapids.line[at])
    return np.stack([edits[:, 0], edits[:, 1], line, begin, end], axis=1)
