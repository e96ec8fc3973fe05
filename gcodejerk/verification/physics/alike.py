"""Streams that are alike are judged once.

Programs drill the same hole a thousand times: their streams differ in where they are and in nothing
else. What the physics of this room makes of a stream depends on how its points lie from its start,
on its F words, and on what the paths say of the rapid; never on the place. This module owns when
two streams are alike in all of that.

Rule: the key holds everything that enters the judgement, to the last digit that is judged: points
in units of their tenth decimal, F bit by bit. A stream is passed over only where one with the very
same key was found to be without fault; where anything is wrong, all are judged one by one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.physics.aligned import Reported
from gcodejerk.verification.physics.points import Array, Index, Paths

ALIKE_SCALE = 1e10
"""Units of positions in a mm or degree."""
MOST = 200_000
"""Keys that are remembered: some 20 MB."""
LAST_BITS = 12
"""Bits of a reported number that are its own rounding, of 52."""
Judge = Callable[[Paths, Findings], bool]
"""Looks at streams; whether it could look at everything."""


class Alike:
    """Remembers what was found to be without fault, from one batch of streams to the next."""

    def __init__(self, reported: Reported) -> None:
        self.reported = reported
        self.known: set[bytes] = set()

    def judge(self, paths: Paths, judge: Judge, found: Findings) -> bool:
        """Judge streams, of those that are alike the first.

        Parameters
        ----------
        paths : Paths
            The streams.
        judge : callable
            Judges streams, each by itself.
        found : Findings
            Takes what is wrong.

        Returns
        -------
        bool
            Whether everything was looked at, and nothing was wrong.
        """
        keys = self.keys(paths)
        fresh: dict[bytes, int] = {}
        for k, key in enumerate(keys):
            if key not in self.known:
                fresh.setdefault(key, k)
        if not fresh:
            return True
        first = Findings(1)
        whole = len(fresh) == len(keys)
        one_each = paths if whole else paths.take(np.array(list(fresh.values()), dtype=np.int64))
        complete = judge(one_each, first)
        if first.violations:
            open_ = [k for k, key in enumerate(keys) if key not in self.known]
            judge(paths.take(np.array(open_, dtype=np.int64)), found)
            return False
        if complete:
            if len(self.known) > MOST:
                self.known.clear()
            self.known.update(fresh)
        return complete

    def keys(self, paths: Paths) -> list[bytes]:
        """What the judgement of each stream depends on, as a hash."""
        owner = paths.owner
        moved = _whole(paths.position - paths.start[owner])
        axes = np.flatnonzero((moved != 0.0).any(axis=0))
        rows = np.column_stack([moved[:, axes], paths.feed])
        streams = np.column_stack(
            [
                _whole(paths.displacement),
                paths.unit,
                paths.speed,
                paths.step,
                paths.lone,
                paths.lead,
            ]
        )
        of_rows, of_streams = memoryview(rows.tobytes()), memoryview(streams.tobytes())
        wide, width = rows.itemsize * rows.shape[1], streams.itemsize * streams.shape[1]
        named = bytes(1 if k in axes else 0 for k in range(len(AXES)))
        said = self._reported(paths)
        out = []
        at = zip((wide * paths.begin).tolist(), (wide * paths.end).tolist(), strict=True)
        for k, (begin, end) in enumerate(at):
            own = of_streams[k * width : (k + 1) * width]
            key = b"".join((named, own, of_rows[begin:end], said[k]))
            out.append(hashlib.blake2b(key, digest_size=16).digest())
        return out

    def _reported(self, paths: Paths) -> list[bytes]:
        """What was reported of each stream, without its own rounding."""
        if not self.reported:
            return [b""] * len(paths.original_line)
        # Streams of one profile have one array: it is held here, or another could take its place.
        known: dict[int, tuple[Array, bytes]] = {}
        out = []
        for line in paths.original_line.tolist():
            profile = self.reported.get(line)
            if profile is None:
                out.append(b"none")
                continue
            if id(profile) not in known:
                known[id(profile)] = profile, _rounded(profile)
            out.append(known[id(profile)][1])
        return out


def _whole(distance: Array) -> Array:
    """Distances in units of their tenth decimal, without minus zero."""
    out: Array = np.rint(distance * ALIKE_SCALE) + 0.0
    return out


def _rounded(numbers: Array) -> bytes:
    """Numbers without their own rounding."""
    bits: NDArray[np.int64] = np.ascontiguousarray(numbers, dtype=np.float64).view(np.int64)
    rounded: Index = (bits + (1 << LAST_BITS - 1)) >> LAST_BITS
    return rounded.tobytes()
