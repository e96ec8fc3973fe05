"""What a file of rows says of one rapid, whatever the controller: the form in which it is judged.

Rule: a reader gives numbers as they are written, in mm (or deg) and s, with the least step that the
format can write of each; it judges nothing but whether the text is of its format.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """The rows of one rapid."""

    line: int
    """In the file, of its first line."""
    rapid: int
    """Line of the rapid in the program."""
    axes: tuple[int, ...]
    """Indices in `AXES` of the k axes that it names."""
    t: Array
    """Shape (r,), from 0. [s]"""
    position: Array
    """Shape (r, k); NaN in the first row where the format does not write it. [mm] or [deg]"""
    velocity: Array
    """Shape (r, k); 0 in the first row of such a format. [mm/s] or [deg/s]"""
    relative: bool = False
    """Positions are counted from the move's own start."""
    residual: float | None = None
    """What the file says that a mode keeps at most. [mm]"""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """The least that a format can write."""

    position: Array
    """Shape (9,). [mm] or [deg]"""
    velocity: Array
    """Shape (9,). [mm/s] or [deg/s]"""
    tick: float
    """Of times. [s]"""
    longest: float = np.inf
    """Longest segment. [s]"""
    most: float = np.inf
    """Segments of a move."""


class NoRowError(Exception):
    """A line that is not of the format; its argument says what was expected."""
