"""A proof by sections: both files cut at the same places, so that several processes can judge.

Rule 1: where the cuts are is a hint of whoever wrote the output, and is not trusted. The sections
are all of both files, in their order; each is walked through and judged as a file is; and what one
takes for granted of the rapid in front of it, the one in front has to have found. So cuts in wrong
places prove nothing.
Rule 2: sections only ever find that nothing is wrong. Where one complains, or cannot end where the
next begins, nothing is said, and the files are judged as one, which finds what is to be told.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import BinaryIO, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Machine
from gcodejerk.nc import Program, Rapids
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.spread import Spread
from gcodejerk.verification.bytes.alignment import Alignment, Progress
from gcodejerk.verification.bytes.proven import Key
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.physics.aligned import Reported
from gcodejerk.verification.physics.alike import Alike
from gcodejerk.verification.physics.points import Reader
from gcodejerk.verification.streams import judge_streams

SECTION = 1 << 20
"""Text of a section, about. [bytes]"""
LONGEST = 1 << 24
"""Files with longer sections are judged as one. [bytes]"""
FEWEST = 4
"""So are those with fewer sections."""


@runtime_checkable
class Sliced(Protocol):
    """Reported profiles of which a part can be taken."""

    def between(self, first: int, last: int) -> Reported:
        """Those of some lines, both included."""


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A part of both files.

    Attributes
    ----------
    original, processed : bytes
        The part.
    at, line : int
        Where it begins in the original.
    end_line : int
        Lines of the original up to its end.
    first : int
        Index of the first of the rapids that it has with it.
    rapids : Rapids
        Those of its part, the one in front of it, and the one behind.
    begun : bool
        Something stands in front of it.
    follows : bool
        It takes for granted that the rapid in front of it has a stream.
    reported : mapping of int to array
        The profiles that its streams are held to.
    """

    original: bytes
    processed: bytes
    at: int
    line: int
    end_line: int
    first: int
    rapids: Rapids
    begun: bool
    follows: bool
    reported: Reported


@dataclass(frozen=True, slots=True, eq=False)
class Proof:
    """What was found of a section without a fault."""

    replaced: NDArray[np.int64]
    """Rapids that have a stream, counted in the program."""
    kept: int
    """Lines of the original that are there."""
    stamped: bool


@dataclass(slots=True, eq=False)
class Judge:
    """Judges sections; what it has found to be right it need not look at again."""

    program: Program
    machine: Machine
    alike: Alike | None = None
    known: dict[Key, bytes] = field(default_factory=dict)
    size: int = 0

    def __call__(self, section: Section) -> Proof | None:
        """Judge one; None where anything is wrong."""
        found = Findings(1)
        program = replace(self.program, rapids=section.rapids, lines=section.end_line)
        windows = Window(io.BytesIO(section.original)), Window(io.BytesIO(section.processed))
        reported = section.reported
        alignment = Alignment(*windows, program, self.machine, found, reported)
        if section.begun:
            alignment.begin_at(section.at, section.line, follows=section.follows)
        if self.alike is None:
            self.alike = Alike({})
        self.alike.reported = reported if alignment.aligned else {}
        if alignment.proven is not None:
            alignment.proven.known, alignment.proven.size = self.known, self.size
        reader = Reader(section.rapids, self.machine, found, program.language)
        judge_streams(alignment, reader, self.alike, self.machine, reported, found)
        if alignment.proven is not None:
            self.known, self.size = alignment.proven.known, alignment.proven.size
        if found.violations or not all(window.ended for window in windows):
            return None
        own = np.array(alignment.replaced, dtype=np.int64)[int(section.begun and section.follows) :]
        return Proof(own + section.first, alignment.kept, alignment.stamped)


def judge_sections(
    original: BinaryIO,
    processed: BinaryIO,
    program: Program,
    machine: Machine,
    reported: Reported,
    edits: NDArray[np.int64],
    progress: Progress | None,
    spread: Spread,
) -> tuple[NDArray[np.int64], int] | None:
    """Judge files by sections.

    Parameters
    ----------
    original, processed : BinaryIO
        Opened for reading bytes, at their beginning; they are left anywhere.
    program : Program
        The original.
    machine : Machine
        What the program was processed for.
    reported : mapping of int to array
        The profiles that streams are held to.
    edits : ndarray of int, shape (k, 3)
        The hint: begin and end of each stream in the processed file, and its rapid, rising.
    progress : callable or None
        See `Alignment`.
    spread : Spread
        Who judges.

    Returns
    -------
    (ndarray of int, int) or None
        Which rapids were replaced, and how many lines were kept; None where nothing can be said.
    """
    cuts = _cuts(edits, program)
    if len(cuts) < FEWEST:
        return None
    windows = Window(original), Window(processed)
    empty = replace(program, rapids=program.rapids.part(slice(0)))
    sections = _sections(*windows, program, reported, cuts)
    replaced, kept, stamped = list[NDArray[np.int64]](), 0, False
    last = -1
    for number, proof in enumerate(spread(Judge(empty, machine), sections)):
        if proof is None:
            return None
        follows, before = bool(cuts[number, 2]), int(cuts[number, 0]) - 1
        if number and follows != (last == before):
            return None
        last = int(proof.replaced[-1]) if len(proof.replaced) else last
        replaced.append(proof.replaced)
        kept += proof.kept
        stamped |= proof.stamped
        if progress is not None:
            progress(last + 1, len(program.rapids))
    if not all(window.ended for window in windows) or last < 0:
        return None
    if stamped and windows[1].claimed not in (None, windows[1].sum):
        return None
    return np.concatenate(replaced), kept


def _cuts(edits: NDArray[np.int64], program: Program) -> NDArray[np.int64]:
    """The first rapid of each section, where it begins in the processed file, what it follows.

    Shape (k, 3), the last number 1 where the rapid in front has a stream; none where a section
    would be too long.
    """
    rows = np.flatnonzero(edits[:, 2] >= 0)
    begin, rapid = edits[rows, 0], edits[rows, 2]
    none = np.zeros((0, 3), dtype=np.int64)
    if len(rows) < 2 or (np.diff(begin) <= 0).any() or (np.diff(rapid) <= 0).any():
        return none
    if begin[0] < 0 or rapid[-1] >= len(program.rapids):
        return none
    chosen = np.flatnonzero(np.diff(begin // SECTION, prepend=0))
    chosen = chosen[chosen > 0]
    follows = rapid[chosen] - rapid[chosen - 1] == 1
    cuts = np.column_stack([rapid[chosen], begin[chosen], follows])
    cuts = np.concatenate([np.zeros((1, 3), dtype=np.int64), cuts])
    places = np.concatenate([[0], program.rapids.begin[cuts[1:, 0]], [program.size]])
    sizes = np.concatenate([np.diff(cuts[:, 1]), np.diff(places)])
    return none if (sizes <= 0).any() or (sizes > LONGEST).any() else cuts


def _sections(
    original: Window,
    processed: Window,
    program: Program,
    reported: Reported,
    cuts: NDArray[np.int64],
) -> Iterator[Section]:
    """All of both files."""
    rapids = program.rapids
    for k, (first, at, follows) in enumerate(cuts.tolist()):
        final = k + 1 == len(cuts)
        behind = len(rapids) if final else int(cuts[k + 1, 0])
        begin = int(rapids.begin[first]) if k else 0
        end = program.size if final else int(rapids.begin[behind])
        rows = np.arange(max(first - 1, 0), min(behind + 1, len(rapids)))
        own = rapids.part(rows)
        inside = (rows >= first) & (rows < behind)
        own.reason[~inside & (own.reason == CERTAIN)] = REASONS.index(Reason.AFTER_END)
        lines = rapids.line[first], rapids.line[behind - 1]
        yield Section(
            original=original.take(end - begin),
            processed=processed.take(LONGEST if final else int(cuts[k + 1, 1]) - at),
            at=begin,
            line=int(rapids.line[first]) if k else 1,
            end_line=program.lines if final else int(rapids.line[behind]) - 1,
            first=int(rows[0]),
            rapids=own,
            begun=k > 0,
            follows=bool(follows),
            reported=_between(reported, int(lines[0]), int(lines[1])),
        )


def _between(reported: Reported, first: int, last: int) -> Reported:
    """Reported profiles of some lines."""
    if isinstance(reported, Sliced):
        return reported.between(first, last)
    return {line: profile for line, profile in reported.items() if first <= line <= last}
