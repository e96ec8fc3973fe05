"""Streams of a program that are the same text, so that they are made once.

Programs retract by the same way thousands of times, and come back to the same places. This module
owns when two streams are the same to the byte: the blocks are, the control is in the same modes,
and the axes that move go the same way from the same place.

Rule: what is compared are bits. A stream that is not known to be the same is made by itself.
"""

from __future__ import annotations

import hashlib
import heapq
from collections.abc import Iterator
from dataclasses import fields
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc import Rapids
from gcodejerk.planning.batch import NumberFormat
from gcodejerk.planning.plans import Plans, same_rows, sorted_rows
from gcodejerk.storage import column, gathered, kept, windows

PLACES = ("line", "begin", "end", "start", "target", "offset", "reason")
"""Columns of rapids that the text of a stream does not depend on, or on some axes of them only."""
KEPT_BYTES = 1 << 24
"""Text that is kept for the streams that are still to come, about."""
POINT_BYTES = 40
"""Of a point, about."""


def same_streams(
    plans: Plans, rapids: Rapids, number_format: NumberFormat, source: BinaryIO, stride: int
) -> NDArray[np.int64] | None:
    """The first move that has the very stream of each.

    Parameters
    ----------
    plans : Plans
        n moves.
    rapids : Rapids
        Row i of the plans is rapid i.
    number_format : NumberFormat
        How their numbers are written.
    source : binary file
        The program; seekable.
    stride : int
        Intervals from one point to the next.

    Returns
    -------
    ndarray of int, shape (n,), or None
        A move itself where it has a stream of its own, or none. None where all are so.
    """
    moves = kept(np.flatnonzero(plans.planned))
    first, like = _ways(plans, rapids, number_format, moves)
    if len(first) == len(moves):
        return None
    # Whether a machine rests in front of a stream depends on whether one stands right there.
    behind = column(len(moves), -1, np.int64)
    for part in windows(len(moves)):
        here = moves[part]
        before = np.searchsorted(moves, here - 1)
        follows = (moves[before] == here - 1) & (rapids.line[here - 1] + 1 == rapids.line[here])
        follows &= ~rapids.entered[here]
        behind[part] = np.where(follows, like[before], -1)
    blocks = _digests(rapids, moves, source)
    first, like = same_rows(like, behind, blocks)
    own = np.arange(len(plans))
    own[moves] = moves[_kept(first, like, gathered(plans.counts, moves) // stride)]
    return kept(own) if (own[moves] != moves).any() else None


def _ways(
    plans: Plans, rapids: Rapids, number_format: NumberFormat, moves: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sorts of moves that go the same way in the same modes, as `same_rows` has them."""
    return sorted_rows(lambda: _columns(plans, rapids, number_format, moves), len(moves))


def _columns(
    plans: Plans, rapids: Rapids, number_format: NumberFormat, moves: NDArray[np.int64]
) -> Iterator[NDArray[np.generic]]:
    """What they have in common, one column at a time: all together are half a kB a move."""
    for name in ("counts", "length", "conventional_time", "worst_in_band", "most_in_band"):
        yield _taken(getattr(plans, name), moves)
    for each in fields(rapids):
        if each.name not in PLACES:
            yield _taken(getattr(rapids, each.name), moves)
    for k in range(len(AXES)):
        way = _taken(plans.displacement, moves, k)
        yield way
        named = (_taken(rapids.words, moves) >> k & 1) != 0
        for place in (rapids.start, rapids.target):
            yield np.where(named | (way != 0.0), _taken(place, moves, k), 0.0)
        for numbers in (number_format.start, number_format.step, number_format.origin):
            yield np.where(way != 0.0, _taken(numbers, moves, k), 0.0)


def _taken(values: NDArray[Any], moves: NDArray[np.int64], axis: int | None = None) -> NDArray[Any]:
    """Rows of a column, of one axis if it has several; of one value, that value once."""
    values = values if axis is None else values[:, axis]
    if not any(values.strides) and len(values):
        return np.broadcast_to(values[0], len(moves))
    out = np.empty(len(moves), dtype=values.dtype)
    for part in windows(len(moves)):
        out[part] = values[moves[part]]
    return out


def _digests(rapids: Rapids, moves: NDArray[np.int64], source: BinaryIO) -> NDArray[np.uint64]:
    """A digest of the block of each move, shape (n, 2)."""
    out = column((len(moves), 2), 0, np.uint64)
    for rows in windows(len(moves)):
        part = moves[rows]
        digests = []
        for at, behind in zip(rapids.begin[part].tolist(), rapids.end[part].tolist(), strict=True):
            source.seek(at)
            digests.append(hashlib.blake2b(source.read(behind - at), digest_size=16).digest())
        out[rows] = np.frombuffer(b"".join(digests), np.uint64).reshape(-1, 2)
    return out


def _kept(
    first: NDArray[np.int64], like: NDArray[np.int64], points: NDArray[np.int64]
) -> NDArray[np.int64]:
    """The move whose text each takes, if texts are kept in the room that there is."""
    last = np.zeros(len(first), dtype=np.int64)
    for part in windows(len(like)):
        np.maximum.at(last, like[part], np.arange(part.start, part.stop))
    size = points[first] * POINT_BYTES
    again = last > first
    if int(size[again].sum()) <= KEPT_BYTES:
        return first[like]
    kept = np.zeros(len(first), dtype=np.bool_)
    held, ends = 0, list[tuple[int, int]]()
    for sort in np.flatnonzero(again).tolist():
        while ends and ends[0][0] < first[sort]:
            held -= heapq.heappop(ends)[1]
        if held + size[sort] <= KEPT_BYTES:
            kept[sort] = True
            held += int(size[sort])
            heapq.heappush(ends, (int(last[sort]), int(size[sort])))
    return np.where(kept[like], first[like], np.arange(len(like)))
