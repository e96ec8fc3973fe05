"""Feed moves that a control refuses, while whoever sends it the program goes on: arcs, mostly.

grbl refuses an arc whose ends lie on no circle about its centre, or farther apart than its radius
reaches (gnea/grbl, grbl/gcode.c: error 33 and 34), one without an axis word, and one without a word
of its plane; nothing of the block is done then, its F included. Senders went on all the same
(grbl/grbl issue 817; softsolder.com, "GRBL Error 33": the next arc begins where the refused one
would have), so that whatever follows begins elsewhere. A feed move before any F is error 22.

Rule: an arc of which that is not certain counts as refused or not. The limits are grbl's, less what
its numbers of 24 bits may add within some metres.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import ARC_CENTRES, LINEAR, PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import G1, G91
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.rules import AXIS_USERS, takes_axes
from gcodejerk.nc.text.words import BIT, Lines
from gcodejerk.units import MM_PER_INCH

_GAP = 0.0048
"""By how much the radii at both ends may differ anyway: 0.005. [mm]"""
_WIDEST = 0.49
"""By how much at most, however large they are: 0.5. [mm]"""
_SHARE = 0.00098
"""By how much of the radius in between: 0.001."""
_REACH = 2e-4
"""Of a radius beyond half the way, and of that way. [mm]"""
_MODES = frozenset({"motion", "plane", "distance", "arc distance", "feed mode", "units"})
"""Groups beside which the way of an arc is known from where the block begins."""
_CENTRES = {"X": "I", "Y": "J", "Z": "K"}
_TAKES = AXIS_USERS | {"words"}


def in_doubt(codes: Codes, state: State, dialect: Dialect) -> bool | None:
    """Whether a block is an arc that may be refused; None where too little is known to say."""
    unit = state.unit
    if "units" in codes.g:
        unit = MM_PER_INCH if dialect.units[codes.g["units"]] else 1.0
    if not _is_arc(codes, state, dialect):
        return False
    values, moved = codes.values, codes.moved()
    if unit is None:
        return False if moved <= LINEAR else None  # of the linear ones nothing is known anyway
    plane = codes.g.get("plane", state.plane)
    if plane not in ARC_CENTRES or not _MODES.issuperset(codes.g) or state.diameter is not False:
        return None
    axes = PLANES[plane][:2]
    if moved.isdisjoint(axes):
        return True
    incremental = codes.g.get("distance", state.distance) == G91
    ways = []
    for axis in axes:
        way = values[axis] * unit if axis in values else 0.0
        if axis in values and not incremental:
            way -= state.position[AXES.index(axis)]
        ways.append(way)
    centre = [values.get(_CENTRES[axis], 0.0) * unit for axis in axes]
    radius = values["R"] * unit if "R" in values else NAN
    numbers = [*ways, *centre, values.get("R", 0.0)]
    if any(number != number for number in numbers):
        return None
    return bool(_misses(*(np.array(number) for number in (*ways, *centre, radius))))


def lacks_feed(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether a block is a feed move for which no F is certain: 0 until one is given, error 22."""
    motion = codes.g.get("motion", state.motion)
    if "F" in codes.values:
        feed = codes.values["F"]
    else:
        mode = dialect.feed_modes.get(codes.g.get("feed mode", -1), state.feed_mode)
        feed = state.feed if mode == state.feed_mode else NAN
    if feed > 0.0 or codes.unknown or motion not in (G1, *dialect.arcs, *dialect.redrawn):
        return False
    if dialect.effect(codes.g.get("non-modal")) in _TAKES or takes_axes(codes):
        return False
    if "motion" in codes.g or codes.moved():
        return True  # one that is stated is refused though nothing moves
    return motion != G1 and not codes.values.keys().isdisjoint("IJK")


def _is_arc(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether the words of a block say an arc."""
    if codes.g.get("motion", state.motion) not in dialect.arcs or codes.unknown:
        return False
    if dialect.effect(codes.g.get("non-modal")) in _TAKES or takes_axes(codes):
        return False
    return bool(codes.moved()) or not codes.values.keys().isdisjoint("IJKR")


def _misses(
    first: NDArray[np.float64],
    second: NDArray[np.float64],
    centre1: NDArray[np.float64],
    centre2: NDArray[np.float64],
    radius: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Which arcs may be refused, by their ways in the plane, and centre or radius (else NaN)."""
    way = np.hypot(first, second)
    begins = np.hypot(centre1, centre2)
    gap = np.abs(np.hypot(first - centre1, second - centre2) - begins)
    meets = (gap <= _GAP) | ((gap <= _WIDEST) & (gap <= _SHARE * begins))
    reaches = (2.0 * np.abs(radius) - way > _REACH) & (way > _REACH)
    missed: NDArray[np.bool_] = ~np.where(np.isnan(radius), meets, reaches)
    return missed


def doubtful(
    state: State, lines: Lines, letters: NDArray[np.uint32], rows: NDArray[np.intp], first: int
) -> NDArray[np.bool_]:
    """Which arcs of a run of plain lines may be refused, or are not known well enough.

    Parameters
    ----------
    state : State
        In front of the run; the unit and the plane are known.
    lines : Lines
        Of the chunk.
    letters : ndarray
        Of the lines of the run.
    rows : ndarray
        Those of the run that are arcs.
    first : int
        The run's first line.

    Returns
    -------
    ndarray of bool
        One for each of `rows`.
    """
    assert state.plane is not None
    axes, last = PLANES[state.plane][:2], first + len(letters)
    columns: list[Any] = [_ways(state, lines, axis, rows, (first, last)) for axis in axes]
    for letter in (*(_CENTRES[axis] for axis in axes), "R"):
        whole = np.full(len(letters), NAN if letter == "R" else 0.0)
        words = lines.words(letter, first, last)
        whole[words.line] = words.values() * (state.unit or NAN)
        columns.append(whole[rows])
    in_plane = np.uint32(BIT[axes[0]] | BIT[axes[1]])
    found: NDArray[np.bool_] = _misses(*columns) | (letters[rows] & in_plane == 0)
    return found


def _ways(
    state: State, lines: Lines, axis: str, rows: NDArray[np.intp], run: tuple[int, int]
) -> NDArray[np.float64]:
    """How far an axis goes in each of these lines of a run."""
    k = AXES.index(axis)
    words = lines.words(axis, *run)
    at, value = words.line, words.values() * state.scale(k)
    before, behind = (np.searchsorted(at, rows, side=side) for side in ("left", "right"))
    named = behind > before
    if state.distance == G91:
        return np.where(named, np.append(value, 0.0)[before], 0.0)
    history = np.concatenate([[state.position[k]], value])
    return np.where(named, history[behind] - history[before], 0.0)
