"""The rapids of a program as columns, and the log that they are collected in.

Rule: a rapid's F word matters only if a later block uses it before a new one is certain to come.
That is known only later, so the log keeps the rapids since the last such block waiting.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.interpreter.visits import LOST_PATH, Row, Visits
from gcodejerk.nc.text.block import ELSEWHERE
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.storage import Growing, alike, kept

_INDEX = {reason: index for index, reason in enumerate(REASONS)}
FEED_UNKNOWN = _INDEX[Reason.FEED_UNKNOWN]
NO_FEED, USES_FEED, GIVES_FEED = 0, 1, 2
"""What a block means for an F word in front of it: nothing, it may be used, it is replaced."""


@dataclass(frozen=True, slots=True, eq=False)
class Rapids:
    """The rapids of a program; entry i of every array is rapid i, in the order of the file."""

    line: NDArray[np.int64]
    """Of the block, counted from 1."""
    begin: NDArray[np.int64]
    """The block is the file's bytes begin:end, without its line end."""
    end: NDArray[np.int64]
    terminator: NDArray[np.uint8]
    """0 none (last line), 1 LF, 2 CR LF, 3 CR."""
    start: NDArray[np.float64]
    """Shape (n, 9), program coordinates [mm, deg]; NaN where unknown."""
    target: NDArray[np.float64]
    """Shape (n, 9), program coordinates [mm, deg]; the start's value where no axis moves."""
    words: NDArray[np.uint16]
    """Bit k set: a word for AXES[k] stands in the block."""
    reason: NDArray[np.uint8]
    """255 certain, else an index into tuple(Reason)."""
    inch: NDArray[np.bool_]
    incremental: NDArray[np.bool_]
    diameter: NDArray[np.bool_]
    distance_stated: NDArray[np.bool_]
    """G90 or G91 was stated, not taken from the dialect's default."""
    feed_mode: NDArray[np.uint8]
    """93, 94, 95, or 0 unknown; after the block's own words."""
    feed_mode_stated: NDArray[np.bool_]
    feed: NDArray[np.float64]
    """F in force after the block, in the program's own unit; NaN unknown."""
    feed_whole: NDArray[np.bool_]
    """F was written without a decimal point, which some controls read differently."""
    feed_needed: NDArray[np.bool_]
    """A later block may use F before a new one is certain to be given."""
    speed: NDArray[np.float64]
    """Of a rapid that runs at F [mm/s]; NaN where rapids run as fast as the axes allow."""
    path: NDArray[np.uint8]
    """61, 62 (G61.1), 64, or 0 unknown; after the block's own words."""
    path_p: NDArray[np.float64]
    """P and Q of G64 in the program's own unit, NaN absent."""
    path_q: NDArray[np.float64]
    lone: NDArray[np.bool_]
    """Under G64, or in a path mode that is not known; and nothing that moves follows directly,
    where `neighbours` has looked. LinuxCNC 2.9 gives such a rapid half of its acceleration."""
    queued: NDArray[np.bool_]
    """A motion of some length stands in front, and nothing that the control waits for in between,
    where `neighbours` has looked: LinuxCNC's queue of motions is then filled."""
    entered: NDArray[np.bool_]
    """A jump or a call leads to the block: in front of it runs not only the line above."""
    offset: NDArray[np.float64]
    """Shape (n, 9): machine = program + offset [mm, deg]; NaN where unknown."""
    turned: NDArray[np.uint16]
    """Bit k set: AXES[k] turns to where the machine file says, and a plain number written in the
    program would not lead it there."""
    beam: NDArray[np.bool_]
    """What M3 turns on is, or may be, on."""
    fed: NDArray[np.bool_]
    """A G1 that the user has said to be a rapid; G1 and its F are in force behind it."""

    def __len__(self) -> int:
        return len(self.line)

    def part(self, rows: slice | NDArray[np.int64]) -> Rapids:
        """Some of the rapids."""
        return Rapids(**{column.name: getattr(self, column.name)[rows] for column in fields(self)})

    def freeze(self) -> None:
        """Let nobody write to the columns any more: planning and proof may both read them."""
        for column in fields(self):
            getattr(self, column.name).flags.writeable = False


DIFFER = frozenset(("line", "begin", "end", "start", "target", "reason"))
"""Columns of which no two rows need be the same."""
_TYPES: dict[str, tuple[type, int]] = {
    **{name: (np.int64, 0) for name in ("line", "begin", "end")},
    **{name: (np.uint8, 0) for name in ("terminator", "reason", "feed_mode", "path")},
    **{name: (np.float64, len(AXES)) for name in ("start", "target", "offset")},
    **{name: (np.float64, 0) for name in ("feed", "path_p", "path_q", "speed")},
    **{name: (np.uint16, 0) for name in ("words", "turned")},
    **{
        name: (np.bool_, 0)
        for name in (
            *("inch", "incremental", "diameter", "distance_stated"),
            *("feed_mode_stated", "feed_needed", "feed_whole", "beam", "lone", "queued", "fed"),
            "entered",
        )
    },
}


def _column(rows: list[Row], name: str, dtype: type) -> NDArray[Any]:
    """Collect one column of rows."""
    return np.array([getattr(row, name) for row in rows], dtype=dtype)


class RapidLog:
    """Collects rapids in the order of the file.

    Parameters
    ----------
    stoppable : bool
        A path mode that something may have changed may be an exact stop.
    restores : bool
        F and its mode have to be known behind a rapid that is rewritten.
    """

    def __init__(self, stoppable: bool = False, restores: bool = True) -> None:
        self._parts = {
            name: Growing(dtype, width, once=name not in DIFFER)
            for name, (dtype, width) in _TYPES.items()
        }
        self._rows: list[Row] = []
        self._waiting = 0
        self.count = 0
        self.habits = self.outputs = False
        """Blocks were seen that do what `beams` looks for."""
        self.dark = ""
        """See `beams.Dark`."""
        self.stops = False
        """The program has exact stops (G61), or runs others that may."""
        self.stoppable, self.restores = stoppable, restores
        self.visits = Visits()
        """Rapids of lines that may run more than once."""

    def feed_event(self, event: int) -> None:
        """Settle the rapids that wait for a block that uses or replaces F."""
        if event:
            self.visits.feed_event(event == USES_FEED)
        if event and self._waiting:
            needed = np.broadcast_to(np.bool_(event == USES_FEED), self._waiting)
            self._parts["feed_needed"].extend(needed)
            self._waiting = 0

    def add(self, reason: Reason | None, row: Row) -> None:
        """Add one rapid."""
        row.reason = CERTAIN if reason is None else _INDEX[reason]
        self._rows.append(row)
        self._waiting += 1
        self.count += 1
        if len(self._rows) >= 4096:
            self._flush()

    def visit(self, line: int, reason: Reason | None, row: Row) -> None:
        """Take one pass over the block of a rapid that may run more than once."""
        row.reason = CERTAIN if reason is None else _INDEX[reason]
        self.visits.add(line, row)

    def add_many(
        self, columns: dict[str, object], events: NDArray[np.uint8], lines: NDArray[np.intp]
    ) -> None:
        """Add the rapids of a run of lines.

        Parameters
        ----------
        columns : dict
            Per column an array, or one value for all.
        events : ndarray
            What each line of the run means for F.
        lines : ndarray
            Index into the run of each rapid.
        """
        at = np.flatnonzero(events)
        if len(at):
            self.feed_event(int(events[at[0]]))
            following = np.cumsum(events != NO_FEED).take(lines)
            settled = following[following < len(at)]
            self._parts["feed_needed"].extend(events[at[settled]] == USES_FEED)
            self._waiting = len(lines) - len(settled)
        else:
            self._waiting += len(lines)
        if not len(lines):
            return
        self.count += len(lines)
        self._flush()
        for name, value in columns.items():
            dtype, width = _TYPES[name]
            shape = (len(lines), width) if width else (len(lines),)
            self._parts[name].extend(np.broadcast_to(np.asarray(value, dtype=dtype), shape))

    def _flush(self) -> None:
        if not self._rows:
            return
        for name in self._parts:
            if name != "feed_needed":
                dtype, _ = _TYPES[name]
                self._parts[name].extend(_column(self._rows, name, dtype))
        self._rows = []

    def _merge_visits(self, columns: dict[str, NDArray[Any]]) -> None:
        """Put the rapids of lines that were followed in the place of those that were not."""
        if not self.visits.rows:
            return
        kept = ~np.isin(columns["line"], np.array(list(self.visits.rows), dtype=np.int64))
        rows = self.visits.finish()
        for name, (dtype, width) in _TYPES.items():
            visited: NDArray[Any] = _column(rows, name, dtype)
            if width:
                visited = visited.reshape(len(rows), width)
            columns[name] = np.concatenate([columns[name][kept], visited])
        order = np.argsort(columns["line"], kind="stable")
        for name in columns:
            columns[name] = columns[name][order]

    def finish(self) -> Rapids:
        """All rapids, with what only the whole program tells."""
        self._flush()
        self._parts["feed_needed"].extend(np.zeros(self._waiting, dtype=np.bool_))
        columns = {name: self._parts.pop(name).finish() for name in _TYPES}
        self._merge_visits(columns)
        own = columns["line"] < ELSEWHERE
        if not own.all():
            columns = {name: column[own] for name, column in columns.items()}
        # In G93 every feed move carries its own F.
        mode, feed = columns["feed_mode"], columns["feed"]
        unknown = (mode == 0) | ((mode != 93) & columns["feed_needed"] & np.isnan(feed))
        reason = columns["reason"]
        reason[(reason == CERTAIN) & unknown & self.restores] = FEED_UNKNOWN
        lost = columns["path"] == LOST_PATH
        if lost.any():
            columns["path"] = np.where(lost, np.uint8(0), columns["path"])
            stops = self.stops and self.stoppable
            reason[(reason == CERTAIN) & lost & stops] = _INDEX[Reason.PATH_UNKNOWN]
        if self.dark:
            burns = columns["beam"] | (self.dark == "always")
            reason[(reason == CERTAIN) & burns] = _INDEX[Reason.BEAM]
        for name in columns.keys() - DIFFER:
            columns[name] = alike(columns[name])
        columns = {name: kept(column) for name, column in columns.items()}
        assert set(columns) == {f.name for f in fields(Rapids)}
        return Rapids(**columns)
