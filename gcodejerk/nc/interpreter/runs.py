"""Runs of plain lines as arrays: what `execute` would do to them one by one, all at once.

Rule: a run changes the motion mode (G0 to G3), the positions and F, and nothing else; every other
mode is the same for all of its lines. Where it is not sure of a line (an arc without a centre, a
word without a use, no F in G93), the run ends in front of it and the careful way takes over.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import ARC_CENTRES, LEFT_OVER, LINEAR, PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import G40, G90, G91
from gcodejerk.nc.interpreter.arcs import doubtful
from gcodejerk.nc.interpreter.eligibility import barred
from gcodejerk.nc.interpreter.limits import beyond_path
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.rapids import GIVES_FEED, USES_FEED, RapidLog
from gcodejerk.nc.interpreter.visits import ModeColumns
from gcodejerk.nc.text.words import BIT, Lines
from gcodejerk.reasons import CERTAIN, REASONS, Reason

AXIS_BITS = (1 << len(AXES)) - 1
CENTRES = BIT["I"] | BIT["J"] | BIT["K"]
_ARC_WORDS = CENTRES | BIT["R"]
_IS_LINEAR = np.array([axis in LINEAR for axis in AXES])
_INDEX = {reason: index for index, reason in enumerate(REASONS)}


def can_run(state: State) -> bool:
    """Whether the state is one that runs are computed in."""
    return (
        state.motion in (0, 10, 20, 30)
        and state.compensation == G40
        and state.distance is not None
        and state.diameter is not None
        and state.plane in ARC_CENTRES
        and state.feed_mode is not None
        and (state.unit is not None or not state.lost)
        and state.touched is None
        and state.cycle is None
        and state.bars.get(LEFT_OVER, False) is False
        and not any(on is not False for on in state.transforms.values())
    )


def _spread(
    at: NDArray[np.int64], values: NDArray[np.uint8], first: int, n: int
) -> NDArray[np.uint8]:
    """Hold each value from its line to the next one's."""
    edges = np.concatenate([[0], at, [n]])
    held = np.concatenate([np.array([first], dtype=np.uint8), values])
    return np.repeat(held, np.diff(edges))


def sure_lines(
    letters: NDArray[np.uint32], motion: NDArray[np.uint8], state: State
) -> NDArray[np.bool_]:
    """Which lines are complete beyond doubt."""
    arc_words = letters & _ARC_WORDS
    is_arc = motion >= 2
    sure: NDArray[np.bool_] = arc_words == 0
    if is_arc.any():
        assert state.plane is not None
        plane = PLANES[state.plane]
        allowed = sum(BIT[letter] for letter in ARC_CENTRES[state.plane])
        by_centre = (arc_words != 0) & (arc_words & ~np.uint32(allowed) == 0)
        in_plane = BIT[plane[0]] | BIT[plane[1]]
        by_radius = (arc_words == BIT["R"]) & (letters & in_plane != 0)
        silent = letters & (AXIS_BITS | _ARC_WORDS | BIT["G"]) == 0
        sure = np.where(is_arc, by_centre | by_radius | silent, sure)
    counting = sum(
        1 << k for k, wrap in enumerate(state.wraps) if AXES[k] not in LINEAR and wrap != "none"
    )
    if counting and state.distance == G90:
        sure = sure & (letters & np.uint32(counting) == 0)  # where they end, the way they go says
    if state.feed_mode == 93:
        sure = sure & ((motion == 0) | (letters & AXIS_BITS == 0) | (letters & BIT["F"] != 0))
    return sure


def run_plain(
    state: State,
    log: RapidLog,
    lines: Lines,
    first: int,
    last: int,
    place: tuple[int, int],
    dialect: Dialect,
) -> tuple[int, int | None]:
    """Execute the plain lines first:last of a chunk, or as many of them as are sure.

    Parameters
    ----------
    state : State
        One that `can_run`; changed to what is in force afterwards.
    log : RapidLog
        Takes the rapids.
    lines : Lines
        Of the chunk.
    first, last : int
        The run; no line of it is odd.
    place : tuple of int
        Number of the chunk's first line and offset of its first byte, in the file.
    dialect : Dialect
        Of the program.

    Returns
    -------
    stop : int
        The first line that was not executed.
    certain : int or None
        Number, in the file, of the first certain rapid.
    """
    assert state.motion is not None
    letters = lines.letters[first:last]
    codes, code_values = lines.cut("G", first, last)
    motion = _spread(codes, code_values.astype(np.uint8), state.motion // 10, last - first)
    sure = sure_lines(letters, motion, state)
    if dialect.arcs_refused and state.unit is not None:
        arcs = np.flatnonzero(sure & (motion >= 2) & (letters & (AXIS_BITS | _ARC_WORDS) != 0))
        sure[arcs] = ~doubtful(state, lines, letters, arcs, first)
    if dialect.arcs_refused:
        feeds, feed_values = lines.cut("F", first, last)
        sure[feeds[feed_values == 0.0]] = False
    if not sure.all():
        last = first + int(np.argmin(sure))
        letters, motion = letters[: last - first], motion[: last - first]
    if last == first:
        return first, None

    named = (letters & AXIS_BITS).astype(np.uint16)
    moves = (named != 0) | ((motion >= 2) & (letters & CENTRES != 0))
    events = np.where(moves & (motion != 0), np.uint8(USES_FEED), np.uint8(0))
    feeds, feed_values = lines.cut("F", first, last)
    events[feeds] = GIVES_FEED
    rapid = np.flatnonzero((named != 0) & (motion == 0))

    start, target = _positions(state, lines, first, last, rapid)
    history = np.concatenate([[state.feed], feed_values])
    columns: dict[str, Any] = asdict(ModeColumns.of(state))
    row = rapid + first
    columns.update(
        line=row + place[0],
        begin=lines.begin[row] + place[1],
        end=lines.end[row] + place[1],
        terminator=lines.terminator[row],
        start=start,
        target=target,
        words=named[rapid],
        feed=history[np.searchsorted(feeds, rapid, side="right")],
        # A whole number that matters would have made its line odd.
        feed_whole=np.searchsorted(feeds, rapid, side="right") == 0 if state.feed_whole else False,
        reason=reasons(state, named[rapid], start, target, dialect),
    )
    # What stands behind the end of the program uses no F.
    log.add_many(columns, np.zeros_like(events) if state.ended else events, rapid)
    if dialect.dark_rapids and state.spindle != 5 and not state.ended:
        log.habits |= bool(((events == USES_FEED) & (letters & BIT["S"] != 0)).any())
    state.motion = int(motion[-1]) * 10
    state.feed = float(history[-1])
    state.feed_whole = bool(state.feed_whole) and not len(feeds)
    certain = np.flatnonzero(columns["reason"] == CERTAIN)
    return last, int(row[certain[0]]) + place[0] if len(certain) else None


def _positions(
    state: State, lines: Lines, first: int, last: int, rapid: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where each rapid of the run starts and ends; the state is moved to the run's end."""
    start = np.empty((len(rapid), len(AXES)))
    target = np.empty_like(start)
    for axis, letter in enumerate(AXES):
        at, value = lines.cut(letter, first, last)
        history = np.concatenate([[state.position[axis]], value * state.scale(axis)])
        if state.distance == G91:
            history = np.add.accumulate(history)
        start[:, axis] = history[np.searchsorted(at, rapid, side="left")]
        target[:, axis] = history[np.searchsorted(at, rapid, side="right")]
        state.position[axis] = float(history[-1])
    return start, target


def reasons(
    state: State,
    named: NDArray[np.uint16],
    start: NDArray[np.float64],
    target: NDArray[np.float64],
    dialect: Dialect,
) -> NDArray[np.uint8]:
    """Why each rapid has to be left alone, as `execute` would decide."""
    if state.ended:
        return np.full(len(named), _INDEX[Reason.AFTER_END], dtype=np.uint8)
    if state.transformed:
        return np.full(len(named), _INDEX[Reason.ROTATION], dtype=np.uint8)
    bar = barred(state)
    if bar is not None:
        return np.full(len(named), _INDEX[bar], dtype=np.uint8)
    is_named = (named[:, np.newaxis] >> np.arange(len(AXES), dtype=np.uint16)) & 1 == 1
    unknown = (is_named & (np.isnan(start) | np.isnan(target))).any(axis=1)
    moving = is_named & (start != target)
    moves = moving.any(axis=1)
    reason = np.full(len(named), CERTAIN, dtype=np.uint8)
    apart = np.array([axis in dialect.apart for axis in AXES])
    reason[moving[:, apart].any(axis=1) & moving[:, ~apart].any(axis=1)] = _INDEX[Reason.APART]
    reason[(moving & apart).sum(axis=1) > 1] = _INDEX[Reason.APART]
    if not dialect.feed_of_mixed:
        both = moving[:, _IS_LINEAR].any(axis=1) & moving[:, ~_IS_LINEAR].any(axis=1)
        reason[both] = _INDEX[Reason.MIXED_AXES]
    if state.path_limits:
        limited = beyond_path(state, np.where(is_named, target - start, 0.0))
        reason[limited] = _INDEX[Reason.LIMIT_SET]
    reason[~moves] = _INDEX[Reason.NO_MOTION]
    reason[unknown] = _INDEX[Reason.START_UNKNOWN]
    if state.unit is None:
        reason[moves | unknown] = _INDEX[Reason.UNITS_UNKNOWN]
    return reason
