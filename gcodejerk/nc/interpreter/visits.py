"""Rapids on lines that run more than once, or from more than one place: one row for all passes.

Rule: a rapid in a loop, a branch or a subprogram can be rewritten in its place only if it is the
same rapid on every pass: certain, with the same start, end and modes. Where passes differ it is
left alone. What differs without mattering, as the position of an axis that does not move, is
unknown in its row.
"""

from __future__ import annotations

from typing import Any

from gcodejerk.axes import AXES
from gcodejerk.nc.interpreter.modal import NAN, same
from gcodejerk.reasons import CERTAIN, REASONS, Reason

Row = dict[str, Any]
SUBPROGRAM = REASONS.index(Reason.SUBPROGRAM)
NEAR = 1e-9
"""Sums of increments differ in their last digits from pass to pass. [mm, deg]"""
_ALIKE = ("words", "inch", "incremental", "diameter", "feed_mode", "path", "path_p", "path_q")
"""What a stream relies on besides its start and end."""
_STATED = ("distance_stated", "feed_mode_stated", "feed_whole")


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
                    row["feed_needed"] = True
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
                if row["reason"] == CERTAIN and line <= until:
                    row["reason"] = SUBPROGRAM
                found.append(row)
        return found


def _merge(a: Row | None, b: Row | None) -> Row | None:
    """Join what two passes say."""
    if a is None or b is None:
        row = a or b
        return None if row is None else {**row, "reason": SUBPROGRAM}
    row = dict(a)
    row["feed_needed"] = a["feed_needed"] or b["feed_needed"]
    alike = a["reason"] == b["reason"] and all(same(a[name], b[name]) for name in _ALIKE)
    alike &= same(a["speed"], b["speed"])
    for name in ("start", "target", "offset"):
        row[name] = [
            x if x == y or abs(x - y) < NEAR else NAN for x, y in zip(a[name], b[name], strict=True)
        ]
    for name in _STATED:
        row[name] = a[name] and b[name]
    row["turned"] |= b["turned"]
    row["beam"] = a["beam"] or b["beam"]
    if not same(a["feed"], b["feed"]) or a["feed_whole"] != b["feed_whole"]:
        row["feed"] = NAN
    known = all(
        row[name][axis] == row[name][axis]
        for name in ("start", "target")
        for axis in range(len(AXES))
        if row["words"] >> axis & 1
    )
    if not alike or (a["reason"] == CERTAIN and not known):
        row["reason"] = SUBPROGRAM
    return row
