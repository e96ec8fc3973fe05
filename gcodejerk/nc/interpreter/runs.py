"""Runs of plain lines as arrays: what `execute` would do to them one by one, all at once.

Rule: a run changes the motion mode (G0 to G3), the positions and F, and nothing else; every other
mode is the same for all of its lines. Where it is not sure of a line (an arc without a centre, a
word without a use, no F in G93), the run ends in front of it and the careful way takes over.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import ARC_CENTRES, LEFT_OVER, LINEAR, PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import G40, G90, G91
from gcodejerk.nc.interpreter.arcs import doubtful
from gcodejerk.nc.interpreter.eligibility import barred, why_compensated
from gcodejerk.nc.interpreter.limits import beyond_path
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.rapids import FEED_UNKNOWN, GIVES_FEED, USES_FEED, RapidLog
from gcodejerk.nc.interpreter.run_words import Run, axes_of, turning
from gcodejerk.nc.interpreter.visits import ModeColumns
from gcodejerk.nc.text.words import BIT, Lines
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.start import RapidFeed
from gcodejerk.units import SECONDS_PER_MINUTE

AXIS_BITS = (1 << len(AXES)) - 1
_ROTARY_BITS = sum(BIT[axis] for axis in AXES if axis not in LINEAR)
CENTRES = BIT["I"] | BIT["J"] | BIT["K"]
_ARC_WORDS = CENTRES | BIT["R"]
_INDEX = {reason: index for index, reason in enumerate(REASONS)}
_AFTER_END = [_INDEX[Reason.AFTER_END]]
_UNKNOWN_MODES = [_INDEX[Reason.DISTANCE_MODE_UNKNOWN], _INDEX[Reason.UNITS_UNKNOWN]]
_MOTIONS = (0, 10, 20, 30)
_BESIDE = "FSE"
"""Letters beside a straight move that some dialects have no use for."""


def _bits(axes: Iterable[str]) -> np.uint16:
    """The bits of some axes."""
    return np.uint16(sum(BIT[axis] for axis in axes if axis in AXES))


@dataclass(frozen=True, slots=True)
class Taken:
    """What was taken of a run of lines.

    Attributes
    ----------
    stop : int
        The first line that was not executed.
    certain : int or None
        Number, in the file, of the first certain rapid.
    unknown : int
        Rapids that are left alone for what `eligibility.unknown_since` asks about.
    """

    stop: int
    certain: int | None = None
    unknown: int = 0

    @classmethod
    def of(
        cls, stop: int, numbers: NDArray[np.int64], reason: NDArray[np.uint8], state: State
    ) -> Taken:
        """What holds of rapids with these line numbers and reasons."""
        certain = np.flatnonzero(reason == CERTAIN)
        compensated = state.compensation != G40
        unknown = np.isin(reason, _AFTER_END if compensated else _UNKNOWN_MODES, invert=compensated)
        first = int(numbers[certain[0]]) if len(certain) else None
        return cls(stop, first, int(np.count_nonzero(unknown)))


def can_run(state: State, dialect: Dialect) -> bool:
    """Whether the state is one that runs are computed in."""
    return (
        (state.motion in _MOTIONS or not dialect.modal_motion)
        and _plain_state(state, dialect)
        and state.touched is None
        and state.cycle is None
        and state.bars.get(LEFT_OVER, False) is False
        and not any(on is not False for on in state.transforms.values())
        # An increment may travel the shift of its axis, or not; absolute words say where it is.
        and (state.distance != G91 or not is_shifted(state))
    )


def is_shifted(state: State) -> bool:
    """Whether the frame of an axis was shifted, and no absolute word has told its place since."""
    return any(on is not False for on in state.shifted.values())


def _plain_state(state: State, dialect: Dialect) -> bool:
    """Whether plain lines say in these modes what they say in others."""
    if dialect.text.klartext:
        # Its arcs are no plain lines; and R0 on a plain one is not read.
        return state.compensation == G40
    return state.plane is None or state.plane in ARC_CENTRES


def _spread(
    at: NDArray[np.int64], values: NDArray[np.uint8], first: int, n: int
) -> NDArray[np.uint8]:
    """Hold each value from its line to the next one's."""
    edges = np.concatenate([[0], at, [n]])
    held = np.concatenate([np.array([first], dtype=np.uint8), values])
    return np.repeat(held, np.diff(edges))


def sure_lines(
    letters: NDArray[np.uint32], motion: NDArray[np.uint8], state: State, dialect: Dialect
) -> NDArray[np.bool_]:
    """Which lines are complete beyond doubt."""
    arc_words = letters & _ARC_WORDS
    is_arc = motion >= 2
    sure: NDArray[np.bool_] = arc_words == 0
    if is_arc.any():
        # In a plane that is not known, any centre may be meant, and any axis.
        plane = state.plane
        allowed = sum(BIT[i] for i in ARC_CENTRES[plane]) if plane else CENTRES
        by_centre = (arc_words != 0) & (arc_words & ~np.uint32(allowed) == 0)
        in_plane = sum(BIT[i] for i in PLANES[plane][:2]) if plane else AXIS_BITS
        by_radius = (arc_words == BIT["R"]) & (letters & in_plane != 0)
        silent = letters & (AXIS_BITS | _ARC_WORDS | BIT["G"]) == 0
        sure = np.where(is_arc, by_centre | by_radius | silent, sure)
    if dialect.refuses.bare_centre:
        sure = sure & ((arc_words == 0) | (letters & AXIS_BITS != 0))
    sure = sure & (~is_arc | (letters & np.uint32(turning(state)) == 0))
    if state.feed_mode in (93, None):
        feeding = AXIS_BITS if state.feed_mode == 93 else 0
        refused = dialect.refuses.bare_inverse and state.inverse is not False
        feeding |= BIT["G"] if refused else 0
        sure = sure & ((motion == 0) | (letters & feeding == 0) | (letters & BIT["F"] != 0))
    if not dialect.modal_motion:
        sure = sure & ((letters & BIT["G"] != 0) | (letters & ~np.uint32(BIT["N"]) == 0))
    for letter in _BESIDE:
        if (users := dialect.uses.get(letter)) is not None:
            idle = np.array([f"G{code // 10}" not in users for code in _MOTIONS])
            sure = sure & ((letters & BIT[letter] == 0) | ~idle.take(motion))
    if not dialect.redrawn.isdisjoint(_MOTIONS):
        sure = sure & ~np.array([code in dialect.redrawn for code in _MOTIONS]).take(motion)
    return sure


def run_plain(
    state: State,
    log: RapidLog,
    lines: Lines,
    first: int,
    last: int,
    place: tuple[int, int],
    dialect: Dialect,
    rapid_feed: RapidFeed | None,
) -> Taken:
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
    rapid_feed : RapidFeed, optional
        Feed moves that count as rapids.

    Returns
    -------
    Taken
        How many of them, and what the rapids among them are left alone for.
    """
    letters = lines.letters[first:last]
    codes = lines.words("G", first, last)
    motion = _spread(codes.line, codes.codes(), (state.motion or 0) // 10, last - first)
    sure = sure_lines(letters, motion, state, dialect)
    if dialect.arcs_refused:
        _doubt_arcs(sure, lines, letters, motion, state, first)
    if dialect.feed_needed or dialect.feed_of_moves:
        given = lines.words("F", first, last)
        sure[given.line[given.values() == 0.0]] = False
    if not sure.all():
        last = first + int(np.argmin(sure))
        letters, motion = letters[: last - first], motion[: last - first]
    if last == first:
        return Taken(first)

    named = (letters & AXIS_BITS).astype(np.uint16)
    moves = (named != 0) | ((motion >= 2) & (letters & CENTRES != 0))
    events = np.where(
        moves & ((motion != 0) | dialect.feed_on_rapids), np.uint8(USES_FEED), np.uint8(0)
    )
    fast = (named != 0) & (motion == 0)
    run = Run(state, lines, letters, first, np.flatnonzero(moves))
    fed = run.counted((named != 0) & (motion == 1), rapid_feed)
    fast[fed] = True
    rapid = np.flatnonzero(fast)
    feeds = run.history("F", rapid)
    events[feeds.words.line] = GIVES_FEED
    matters = dialect.whole_numbers == "machine"
    whole = np.append(bool(state.feed_whole), feeds.words.whole() & matters)
    start, target, turned, feed = run.told(feeds, rapid)
    row = rapid + first
    said = letters.take(rapid)
    columns = ModeColumns.of(state).columns()
    columns.update(
        line=row + place[0],
        begin=lines.begin.take(row) + place[1],
        end=lines.end.take(row) + place[1],
        terminator=lines.terminator.take(row),
        start=start,
        target=target,
        words=named.take(rapid),
        turned=turned,
        feed=NAN if dialect.feed_lost else feed,
        feed_whole=whole.take(feeds.behind),
        reason=reasons(state, said, start, target, dialect),
        fed=np.isin(rapid, fed, assume_unique=True),
    )
    if dialect.feed_on_rapids or len(fed):
        speed = np.broadcast_to(feed * (state.unit or NAN) / SECONDS_PER_MINUTE, rapid.shape)
        runs_at_f = columns["fed"] | dialect.feed_on_rapids
        columns["speed"] = np.where(runs_at_f, speed, NAN)
        unknown = runs_at_f & ~(speed > 0.0) & (columns["reason"] == CERTAIN)
        columns["reason"][unknown] = FEED_UNKNOWN
    # What stands behind the end of the program uses no F.
    log.add_many(columns, np.zeros_like(events) if state.ended else events, rapid)
    if dialect.dark_rapids and state.spindle != 5 and not state.ended:
        feeding = (named != 0) & (motion != 0)
        log.habits |= bool((feeding & (letters & BIT["S"] != 0)).any())
    state.motion = _motion_behind(letters, motion, state, dialect)
    state.feed_whole = bool(whole[-1])
    if state.shifted and state.distance == G90:
        told = {AXES[axis] for axis in axes_of(int(np.bitwise_or.reduce(named)))}
        state.shifted = {a: on if a not in told else False for a, on in state.shifted.items()}
    return Taken.of(last, row + place[0], columns["reason"], state)


def _doubt_arcs(
    sure: NDArray[np.bool_],
    lines: Lines,
    letters: NDArray[np.uint32],
    motion: NDArray[np.uint8],
    state: State,
    first: int,
) -> None:
    """Mark arcs that the control may refuse, since they do not meet their end."""
    arcs = np.flatnonzero(sure & (motion >= 2) & (letters & (AXIS_BITS | _ARC_WORDS) != 0))
    if state.unit is None:
        sure[arcs] = letters[arcs] & _ROTARY_BITS == 0
    elif state.plane is None:
        sure[arcs] = False
    else:
        sure[arcs] = ~doubtful(state, lines, letters, arcs, first)


def _motion_behind(
    letters: NDArray[np.uint32], motion: NDArray[np.uint8], state: State, dialect: Dialect
) -> int | None:
    """The motion code in force behind a run; where every block has its own, that of the last."""
    if dialect.modal_motion:
        return int(motion[-1]) * 10
    blocks = np.flatnonzero(letters)
    if not len(blocks):
        return state.motion
    return int(motion[blocks[-1]]) * 10 if letters[blocks[-1]] & BIT["G"] else None


def reasons(
    state: State,
    letters: NDArray[np.uint32],
    start: NDArray[np.float64],
    target: NDArray[np.float64],
    dialect: Dialect,
) -> NDArray[np.uint8]:
    """Why each rapid has to be left alone, as `execute` would decide, by what its line names."""
    named = (letters & AXIS_BITS).astype(np.uint16)
    if state.ended:
        return np.full(len(named), _INDEX[Reason.AFTER_END], dtype=np.uint8)
    if state.compensation != G40:
        return np.full(len(named), _INDEX[why_compensated(state)], dtype=np.uint8)
    if state.transformed:
        return np.full(len(named), _INDEX[Reason.ROTATION], dtype=np.uint8)
    bar = barred(state)
    if bar is not None:
        return np.full(len(named), _INDEX[bar], dtype=np.uint8)
    unknown, moving = (np.zeros(len(named), dtype=np.uint16) for _ in range(2))
    for axis in axes_of(int(np.bitwise_or.reduce(named, initial=0))):
        way, bit = target[:, axis] - start[:, axis], np.uint16(1 << axis)
        unknown |= np.isnan(way) * bit
        moving |= (way != 0.0) * bit
    unknown, moving = unknown & named != 0, moving & named
    moves = moving != 0
    reason = np.full(len(named), CERTAIN, dtype=np.uint8)
    apart = moving & _bits(dialect.apart)
    reason[(apart != 0) & (moving != apart)] = _INDEX[Reason.APART]
    reason[apart & (apart - np.uint16(1)) != 0] = _INDEX[Reason.APART]
    if not dialect.feed_of_mixed:
        linear = moving & _bits(LINEAR)
        reason[(linear != 0) & (moving != linear)] = _INDEX[Reason.MIXED_AXES]
    if dialect.extrudes and not dialect.uses:
        reason[letters & BIT["E"] != 0] = _INDEX[Reason.OTHER_WORDS]
    if ways := turning(state, unstated=True):
        reason[moving & np.uint16(ways) != 0] = _INDEX[Reason.ROTARY_WAY]
    if dialect.path_has_to_be_stated and not state.path:
        reason[:] = _INDEX[Reason.PATH_UNKNOWN]
    if dialect.lengths_only and state.feed_unit != state.unit:
        reason[:] = _INDEX[Reason.FEED_UNIT]
    if state.path_limits:
        is_named = (named[:, np.newaxis] >> np.arange(len(AXES), dtype=np.uint16)) & 1 == 1
        limited = beyond_path(state, np.where(is_named, target - start, 0.0))
        reason[limited] = _INDEX[Reason.LIMIT_SET]
    reason[~moves] = _INDEX[Reason.NO_MOTION]
    reason[unknown] = _INDEX[Reason.START_UNKNOWN]
    if state.unit is None:
        reason[moves | unknown] = _INDEX[Reason.UNITS_UNKNOWN]
    if state.distance is None:
        reason[moves | unknown] = _INDEX[Reason.DISTANCE_MODE_UNKNOWN]
    return reason
