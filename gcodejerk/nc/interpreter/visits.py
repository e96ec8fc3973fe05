"""Rapids on lines that run more than once, or from more than one place: one row for all passes.

Rule: a rapid in a loop, a branch or a subprogram can be rewritten in its place only if it is the
same rapid on every pass: certain, with the same start, end and modes. Where passes differ it is
left alone. What differs without mattering, as the position of an axis that does not move, is
unknown in its row.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.gcodes import G91
from gcodejerk.nc.interpreter.modal import NAN, State, same
from gcodejerk.reasons import CERTAIN, REASONS, Reason

EXACT = (61, 62)
"""Path modes (G61, G61.1) in which no motion blends with the next."""
LOST_PATH = 255
"""In the place of a path mode: something may have changed it (`rapids.RapidLog.stops`)."""
SUBPROGRAM = REASONS.index(Reason.SUBPROGRAM)
NEAR = 1e-9
"""Sums of increments differ in their last digits from pass to pass. [mm, deg]"""
_ALIKE = (
    *("reason", "words", "inch", "incremental", "diameter", "feed_mode"),
    *("path", "path_p", "path_q", "speed", "fed"),
)
"""What a stream relies on besides its start and end."""


@dataclass(slots=True)
class ModeColumns:
    """What the modal state alone says of a rapid, by the columns of `rapids.Rapids`."""

    inch: bool
    incremental: bool
    diameter: bool
    distance_stated: bool
    feed_mode: int
    feed_mode_stated: bool
    path: int
    path_p: float
    path_q: float
    lone: bool
    offset: list[float]
    feed_whole: bool
    beam: bool
    speed: float = NAN
    turned: int = 0
    queued: bool = False
    entered: bool = False
    fed: bool = False

    @classmethod
    def of(cls, state: State) -> Self:
        """Fill the columns in; what a block adds is set by whoever runs it."""
        return cls(
            inch=state.unit is not None and state.unit != 1.0,
            incremental=state.distance == G91,
            diameter=bool(state.diameter),
            distance_stated=state.distance_stated,
            feed_mode=state.feed_mode or 0,
            feed_mode_stated=state.feed_mode_stated,
            path=LOST_PATH if state.path is None else state.path,
            path_p=state.path_p,
            path_q=state.path_q,
            lone=state.path not in EXACT,
            offset=state.shifts(),
            feed_whole=bool(state.feed_whole),
            beam=state.spindle != 5,
        )

    def columns(self) -> dict[str, Any]:
        """Each by its name, and no copies of them."""
        return {field.name: getattr(self, field.name) for field in fields(ModeColumns)}


@dataclass(slots=True)
class Row(ModeColumns):
    """One rapid, by the columns of `rapids.Rapids`."""

    line: int = 0
    begin: int = 0
    end: int = 0
    terminator: int = 0
    start: list[float] = field(default_factory=list)
    target: list[float] = field(default_factory=list)
    words: int = 0
    reason: int = CERTAIN
    feed: float = NAN
    feed_needed: bool = False


class Visits:
    """The rows by line, merged pass by pass."""

    def __init__(self) -> None:
        self.rows: dict[int, Row | None] = {}
        """None: the line ran, and was no rapid."""
        self._waiting: list[int] = []
        self._spoiled: list[tuple[int, int]] = []

    def add(self, line: int, row: Row | None) -> None:
        """Take one pass over a line."""
        if line not in self.rows:
            self.rows[line] = row
        else:
            self.rows[line] = _merge(self.rows[line], row)
        if row is not None:
            self._waiting.append(line)

    def feed_event(self, needed: bool) -> None:
        """Settle the rapids that wait for a block that uses or replaces F."""
        if needed:
            for line in self._waiting:
                row = self.rows[line]
                if row is not None:
                    row.feed_needed = True
        self._waiting.clear()

    def spoil(self, first: int, last: int) -> None:
        """Leave the rapids of these lines alone: not every pass could be followed."""
        self._spoiled.append((first, last))

    def finish(self) -> list[Row]:
        """All rapids."""
        found = []
        spoiled = sorted(self._spoiled)
        at, until = 0, 0
        for line, row in sorted(self.rows.items()):
            while at < len(spoiled) and spoiled[at][0] <= line:
                until = max(until, spoiled[at][1])
                at += 1
            if row is not None:
                if row.reason == CERTAIN and line <= until:
                    row.reason = SUBPROGRAM
                found.append(row)
        return found


def _merge(a: Row | None, b: Row | None) -> Row | None:
    """Join what two passes say."""
    if a is None or b is None:
        row = a or b
        return None if row is None else replace(row, reason=SUBPROGRAM)
    row = replace(
        a,
        start=_near(a.start, b.start),
        target=_near(a.target, b.target),
        offset=_near(a.offset, b.offset),
        feed_needed=a.feed_needed or b.feed_needed,
        distance_stated=a.distance_stated and b.distance_stated,
        feed_mode_stated=a.feed_mode_stated and b.feed_mode_stated,
        feed_whole=a.feed_whole and b.feed_whole,
        turned=a.turned | b.turned,
        beam=a.beam or b.beam,
        entered=a.entered | b.entered,
    )
    if not same(a.feed, b.feed) or a.feed_whole != b.feed_whole:
        row.feed = NAN
    named = [axis for axis in range(len(AXES)) if row.words >> axis & 1]
    places = [place for axis in named for place in (row.start[axis], row.target[axis])]
    known = not any(map(math.isnan, places))
    alike = all(same(getattr(a, name), getattr(b, name)) for name in _ALIKE)
    if not alike or (a.reason == CERTAIN and not known):
        row.reason = SUBPROGRAM
    return row


def _near(a: list[float], b: list[float]) -> list[float]:
    """Keep the places that are the same; NaN for the others."""
    return [x if x == y or abs(x - y) < NEAR else NAN for x, y in zip(a, b, strict=True)]
