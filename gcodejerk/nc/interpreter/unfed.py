"""Runs of plain lines in front of any F, on controls that refuse feed moves there, as arrays.

A feed move without F is refused, or runs with the feed of the job before (`arcs`): what both leave
is known. So a feed move to where an axis stands leaves it there, any other leaves nobody knows
where; a G1 beside one that was not in force before is in force, or is not.

Rule: as in `runs`, what `execute` would do to the lines one by one, and it ends in front of the
first line that is not sure, as one with an F is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.gcodes import G40, G90
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.rapids import USES_FEED, RapidLog
from gcodejerk.nc.interpreter.run_words import turning
from gcodejerk.nc.interpreter.runs import (
    AXIS_BITS,
    CENTRES,
    Taken,
    can_run,
    is_shifted,
    reasons,
    sure_lines,
)
from gcodejerk.nc.interpreter.visits import ModeColumns
from gcodejerk.nc.text.words import BIT, Lines

_NOBODY_KNOWS = -1


def can_run_unfed(state: State, dialect: Dialect) -> bool:
    """Whether the state is one that such runs are computed in."""
    plain = state.distance == G90 and state.compensation == G40 and not is_shifted(state)
    return plain and (can_run(state, dialect) or _without_motion(state, dialect))


def _without_motion(state: State, dialect: Dialect) -> bool:
    """Whether the motion that is in force is all that is missing."""
    if state.motion is not None:
        return False
    state.motion = 0
    able = can_run(state, dialect)
    state.motion = None
    return able


def run_unfed(
    state: State,
    log: RapidLog,
    lines: Lines,
    first: int,
    last: int,
    place: tuple[int, int],
    dialect: Dialect,
    stays: bool,
) -> Taken:
    """Execute the plain lines first:last of a chunk, or as many of them as are sure.

    Parameters
    ----------
    state : State
        One that `can_run_unfed`, without F; changed to what is in force afterwards.
    log, lines, first, last, place, dialect
        As for `runs.run_plain`.
    stays : bool
        The axes stay where they are when the control stops at a line that it refuses.

    Returns
    -------
    Taken
        As of `runs.run_plain`.
    """
    letters = lines.letters[first:last]
    codes = lines.words("G", first, last)
    at = codes.line
    stated = np.full(len(letters), _NOBODY_KNOWS)
    stated[at] = codes.codes()
    moves, centred = letters & AXIS_BITS != 0, letters & CENTRES != 0
    may_be_refused = (stated >= 1) & (moves | ((stated >= 2) & centred))
    before = _NOBODY_KNOWS if state.motion is None else state.motion // 10
    after = _settled(float(before), stated[at].astype(float), ~may_be_refused[at])
    after = np.nan_to_num(after, nan=_NOBODY_KNOWS)
    held = np.concatenate([[before], after]).astype(np.int64)
    motion = held[np.searchsorted(at, np.arange(len(letters)), side="right")]
    does = np.where(stated >= 0, stated, motion)
    sure = sure_lines(letters, np.maximum(does, 0).astype(np.uint8), state, dialect)
    sure &= letters & np.uint32(turning(state)) == 0
    # Nor where G1 is stated and nothing moves, or G80 may be in force.
    sure &= (letters & BIT["F"] == 0) & np.where(moves, does >= 0, stated < 1)
    stop = len(sure) if sure.all() else int(np.argmin(sure))
    if stop == 0:
        return Taken(first)
    letters, does, moves, centred = letters[:stop], does[:stop], moves[:stop], centred[:stop]
    doubted = (does >= 1) & (moves | ((does >= 2) & centred))
    lost = np.zeros_like(doubted) if stays else doubted
    rapid = np.flatnonzero(moves & (does == 0))
    start, target = _positions(state, lines, first, rapid, doubted, lost)
    named = (letters & AXIS_BITS).astype(np.uint16)[rapid]
    row = rapid + first
    columns = ModeColumns.of(state).columns()
    columns.update(
        line=row + place[0],
        begin=lines.begin[row] + place[1],
        end=lines.end[row] + place[1],
        terminator=lines.terminator[row],
        start=start,
        target=target,
        words=named,
        feed=state.feed,
        reason=reasons(state, letters[rapid], start, target, dialect),
    )
    events = np.where(moves & (does != 0) | doubted, np.uint8(USES_FEED), np.uint8(0))
    log.add_many(columns, np.zeros_like(events) if state.ended else events, rapid)
    if dialect.dark_rapids and state.spindle != 5 and not state.ended:
        log.habits |= bool((moves & (does >= 1) & (letters & BIT["S"] != 0)).any())
    state.motion = None if motion[stop - 1] < 0 else int(motion[stop - 1]) * 10
    return Taken.of(first + stop, row + place[0], columns["reason"], state)


def _positions(
    state: State,
    lines: Lines,
    first: int,
    rapid: NDArray[np.intp],
    doubted: NDArray[np.bool_],
    lost: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where each rapid starts and ends; the state is moved to the end."""
    start = np.empty((len(rapid), len(AXES)))
    target = np.empty_like(start)
    for axis, letter in enumerate(AXES):
        words = lines.words(letter, first, first + len(lost))
        at = words.line
        said = np.full(len(lost), NAN)
        said[at] = words.values() * state.scale(axis)
        said[lost] = NAN
        told = np.zeros(len(lost), dtype=np.bool_)
        told[at] = True
        at = np.flatnonzero(told | lost)
        known = _settled(state.position[axis], said[at], ~(doubted | lost)[at])
        history = np.concatenate([[state.position[axis]], known])
        start[:, axis] = history[np.searchsorted(at, rapid, side="left")]
        target[:, axis] = history[np.searchsorted(at, rapid, side="right")]
        state.position[axis] = float(history[-1])
    return start, target


def _settled(
    before: float, said: NDArray[np.float64], sure: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """What holds behind each of some words, of which those that are not sure may be left out.

    Parameters
    ----------
    before : float
        Holds in front of them; NaN, as in `said`: nobody knows.
    said : ndarray, shape (n,)
    sure : ndarray of bool, shape (n,)

    Returns
    -------
    ndarray, shape (n,)
        NaN where nobody knows.

    Examples
    --------
    >>> _settled(1.0, np.array([1.0, 2.0, 2.0, 3.0]), np.array([False, False, False, True]))
    array([ 1., nan, nan,  3.])
    """
    place = np.arange(1, len(said) + 1)
    last = np.maximum.accumulate(np.where(sure, place, 0))
    value = np.concatenate([[before], said])[last]
    off = np.maximum.accumulate(np.where(~sure & ~(said == value), place, 0))
    out: NDArray[np.float64] = np.where(off > last, NAN, value)
    return out
