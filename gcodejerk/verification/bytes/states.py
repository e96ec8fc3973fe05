"""What the columns of the rapids say of each, as bytes that can be compared.

Rule: everything that a rapid's replacement is judged by is in one of two: what it is, and where.
Columns that are added to `Rapids` are in the first without being named here.
"""

from __future__ import annotations

from dataclasses import fields
from typing import Any

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
        self._states: list[bytes] = []
        self._places: list[bytes] = []

    def state(self, i: int) -> bytes:
        """All that the columns say of a rapid but for its places."""
        row = self._row(i)
        return self._states[row]

    def state_and_place(self, i: int) -> tuple[bytes, bytes]:
        """All that the columns say: as `state`, and the places.

        These are where the axes begin and end that its block names, or that move, and in which
        frame.
        """
        row = self._row(i)
        return self._states[row], self._places[row]

    def _row(self, i: int) -> int:
        """Have the bytes of a rapid; which of those that are at hand it is."""
        if not self._begin <= i < self._begin + AT_ONCE:
            self._begin = i - i % AT_ONCE
            part = slice(self._begin, self._begin + AT_ONCE)
            # Most rapids of a program say the same: that is kept once.
            told: dict[bytes, bytes] = {}
            self._states = [told.setdefault(row, row) for row in _rows(_states(self.rapids, part))]
            self._places = _rows(_places(self.rapids, part))
        return i - self._begin


def _rows(values: NDArray[Any]) -> list[bytes]:
    """The bytes of each row."""
    data, wide = values.tobytes(), values.shape[1] * values.itemsize
    return [data[at : at + wide] for at in range(0, len(data), wide)]


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
