"""Candidates of many moves at once, a row of them for each move.

This module owns what every search does with its rows: it takes them in parts that the processor's
cache holds, and it finds the best candidate of each.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array

CELLS = 1 << 16
"""Candidates evaluated at a time: arrays that stay in the processor's cache."""
ROUNDING = 1e-9
"""Relative tolerance on limits, for the rounding of floating-point numbers."""


def parts(n: int, width: int, cells: int = CELLS) -> list[slice]:
    """Rows of `width` candidates each, cut into parts of about so many candidates."""
    rows = max(1, cells // max(width, 1))
    return [slice(begin, min(begin + rows, n)) for begin in range(0, n, rows)]


def best_in_rows(value: Array, *columns: Array) -> tuple[Array, ...]:
    """The columns where each row's value is least, the first among equals; all of shape (n, k)."""
    return pick_in_rows(np.argmin(value, axis=1), *columns)


def pick_in_rows(chosen: NDArray[np.intp], *columns: Array) -> tuple[Array, ...]:
    """One entry of each row of the columns, of shape (n, k)."""
    row = np.arange(len(chosen))
    return tuple(column[row, chosen] for column in columns)
