"""Streams of a program that is walked through, judged some MB of text at a time."""

from __future__ import annotations

from collections.abc import Iterator

from gcodejerk.machine import Machine
from gcodejerk.storage import release
from gcodejerk.verification.bytes.alignment import Alignment
from gcodejerk.verification.bytes.form import Stream
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.physics.aligned import Reported, check_aligned, in_own_steps
from gcodejerk.verification.physics.alike import Alike
from gcodejerk.verification.physics.dynamics import check_dynamics, stride_of
from gcodejerk.verification.physics.points import Paths, Reader, check_line, check_rapids

BATCH_BYTES = 1 << 20
"""Text of streams that is judged at a time."""


def judge_streams(
    alignment: Alignment,
    reader: Reader,
    alike: Alike,
    machine: Machine,
    reported: Reported,
    found: Findings,
) -> None:
    """Walk through both files, and judge every stream on the way.

    Parameters
    ----------
    alignment : Alignment
        Where it begins.
    reader : Reader
        Of the same rapids.
    alike : Alike
        What was judged before.
    machine : Machine
        What the program was processed for.
    reported : mapping of int to array
        The profiles that streams for LinuxCNC are held to, by line.
    found : Findings
        Takes what is wrong.
    """
    stride = stride_of(machine)

    def judge(paths: Paths, found: Findings) -> bool:
        check_line(paths, machine, found)
        if alignment.aligned:
            check_aligned(paths, machine, found, reported)
        elif not moves(paths):
            return False
        else:
            check_dynamics(paths, machine, stride, found)
        return True

    for streams in batches(checked(alignment, reader)):
        paths = reader.paths(streams)
        if alignment.aligned:
            paths = in_own_steps(paths)
        check_rapids(paths, alignment.program.rapids, machine, found)
        alignment.judged(alike.judge(paths, judge, found))
        release()


def checked(alignment: Alignment, reader: Reader) -> Iterator[Stream]:
    """Streams whose axes are right."""
    for stream in alignment.streams():
        if reader.check_end(stream, alignment.block):
            yield stream


def batches(streams: Iterator[Stream], most: int = 0) -> Iterator[list[Stream]]:
    """Streams in lists, each of some MB of text."""
    batch: list[Stream] = []
    size = 0
    for stream in streams:
        batch.append(stream)
        size += len(stream.text) + 64 * len(stream.rest)
        if size > (most or BATCH_BYTES):
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def moves(paths: Paths) -> bool:
    """Whether every stream has a length: without one there is no time profile."""
    return bool((paths.displacement != 0.0).any(axis=1).all())
