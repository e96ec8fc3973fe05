"""What the columns of the rapids say of each, as bytes that can be compared.

Rule: everything that a rapid's replacement is judged by is in one of two: what it is, and where.
Columns that are added to `Rapids` are in the first without being named here.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc import Rapids
from gcodejerk.verification.bytes.allowed import STANDSTILL

PLACES = ("line", "begin", "end", "start", "target", "offset")
"""Columns that say where, and nothing else that the form of a stream depends on."""
AT_ONCE = 4096
"""Rapids whose bytes are made together, and kept until others are asked for."""


class States:
    """The columns of rapids as bytes, asked for in the order of the file."""

    def __init__(self, rapids: Rapids) -> None:
        self.rapids = rapids
        self._begin = -AT_ONCE
        self._states = self._places = memoryview(b"")
        self._wide = self._far = 0

    def state(self, i: int) -> bytes:
        """All that the columns say of a rapid but for its places."""
        k = self._row(i)
        return bytes(self._states[k * self._wide : (k + 1) * self._wide])

    def place(self, i: int) -> bytes:
        """Where the axes begin and end that its block names, or that move, and in which frame."""
        k = self._row(i)
        return bytes(self._places[k * self._far : (k + 1) * self._far])

    def _row(self, i: int) -> int:
        """Have the bytes of a rapid; which of those that are at hand it is."""
        if not self._begin <= i < self._begin + AT_ONCE:
            self._begin = i - i % AT_ONCE
            part = slice(self._begin, self._begin + AT_ONCE)
            states, places = _states(self.rapids, part), _places(self.rapids, part)
            self._wide, self._far = states.shape[1], places.shape[1] * places.itemsize
            self._states, self._places = (memoryview(m.tobytes()) for m in (states, places))
        return i - self._begin


def _states(rapids: Rapids, part: slice) -> NDArray[np.uint8]:
    """All but the places, shape (n, bytes)."""
    step = np.abs(rapids.target[part] - rapids.start[part])
    columns = [np.packbits(step > STANDSTILL, axis=1), np.isnan(step).any(axis=1)]
    columns += [getattr(rapids, f.name)[part] for f in fields(rapids) if f.name not in PLACES]
    parts = [np.ascontiguousarray(c).view(np.uint8).reshape(len(step), -1) for c in columns]
    return np.ascontiguousarray(np.concatenate(parts, axis=1))


def _places(rapids: Rapids, part: slice) -> NDArray[np.float64]:
    """Start, end and offset of the axes that matter, 0 for the others, shape (n, 27)."""
    start, target = rapids.start[part], rapids.target[part]
    used = (rapids.words[part, np.newaxis] >> np.arange(start.shape[1]) & 1) != 0
    # What is not known is not itself, so that an axis of which either is unknown counts as used.
    used |= start != target
    return np.hstack([np.where(used, p, 0.0) for p in (start, target, rapids.offset[part])])
