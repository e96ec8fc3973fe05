"""Programs without a rapid to rewrite: whether feed moves stand in the place of rapids.

Slicers write travel as G1 without E. CAM systems under some licences write every rapid as a G1 at
one high feed. Neither is a G0, and nothing here makes it one: this module only finds words for it.

Rule: looked at is the beginning of a program, by its plain words. Behind what is not plain, places
are not known, and nothing is said of moves whose heights are not known.
"""

from __future__ import annotations

import io
import math
import re
from dataclasses import dataclass, field
from typing import BinaryIO

from gcodejerk.planning.plans import Plans

LOOKED_AT = 2 << 20
"""Bytes of a program that are looked at: a second or two."""
LEAST = 2
"""Fewer moves make no habit."""
_COMMENT = re.compile(rb"\([^()]*\)|;.*")
_PLAIN = re.compile(rb"(?:\s*[A-Za-z]\s*[-+]?(?:\d+(?:\.\d*)?|\.\d+))*\s*(?:\*\s*\d+\s*)?")
_WORD = re.compile(rb"([A-Za-z])\s*([-+]?(?:\d+(?:\.\d*)?|\.\d+))")
_FEED_PER_MINUTE = 94
_MOTION = {0, 1, 2, 3}


@dataclass(frozen=True, slots=True)
class Travel:
    """Travel of a slicer: G1 without E."""

    count: int
    shortest: float
    """Of the ways in X and Y. [program's unit]"""
    longest: float


@dataclass(frozen=True, slots=True)
class Alike:
    """Feed moves that look like rapids: all at one feed, and above all cutting."""

    count: int
    feed: float
    """The F word. [program's unit/min]"""
    above: float
    """No move in X or Y at this feed is known to be lower. [program's unit]"""


@dataclass(slots=True)
class _Feed:
    """What moves at one feed."""

    count: int = 0
    level: int = 0
    """Moves in X or Y whose heights are known."""
    lowest: float = math.inf
    """Of these. [program's unit]"""
    highest: float = -math.inf
    """Where any move begins, and where one in X or Y ends. [program's unit]"""


@dataclass(slots=True)
class _Path:
    """Where the program is, by its plain words."""

    at: dict[str, float] = field(default_factory=dict)
    motion: int = -1
    feed: float = math.nan
    incremental: bool = False
    per_minute: bool = True
    prints: bool = False
    travels: list[float] = field(default_factory=list)
    feeds: dict[float, _Feed] = field(default_factory=dict)

    def line(self, words: list[tuple[str, float]]) -> None:
        """Take one line."""
        for letter, code in words:
            if letter == "G" and self._code(code, words):
                return
        given = dict(words)
        self.feed = given.get("F", self.feed)
        moved = {axis: given[axis] for axis in "XYZ" if axis in given}
        if not moved or self.motion not in _MOTION:
            return
        before = dict(self.at)
        for axis, value in moved.items():
            if not self.incremental:
                self.at[axis] = value
            elif axis in self.at:
                self.at[axis] += value
        self._move(before, moved, "E" in given)

    def _code(self, code: float, words: list[tuple[str, float]]) -> bool:
        """Take a G code; whether the line is none of plain moves."""
        if code in _MOTION:
            self.motion = int(code)
        elif code in (90, 91):
            self.incremental = code == 91
        elif code in (93, 94, 95):
            self.per_minute = code == _FEED_PER_MINUTE
        elif code in (28, 30, 53, 92, 10, 52):
            # Other places, or another frame; of a printer's G92 E0 and G10 none.
            if code in (28, 30) or {"X", "Y", "Z", "P"} & {letter for letter, _ in words}:
                self.at.clear()
            return True
        elif 73 <= code <= 89 and code != 80:
            self.motion = -1
        elif 54 <= code < 60 or code in (43, 49):
            self.at.clear()
        return False

    def _move(self, before: dict[str, float], moved: dict[str, float], prints: bool) -> None:
        """Take one move."""
        self.prints |= prints
        if self.motion == 1 and not prints and {"X", "Y"} & set(moved):
            # An axis whose place is not known gives no way.
            known = [axis for axis in "XY" if axis in before]
            way = math.hypot(*(self.at[axis] - before[axis] for axis in known))
            if known and way > 0.0:
                self.travels.append(way)
        entry = self.feeds.setdefault(self.feed if self.per_minute else math.nan, _Feed())
        level = bool({"X", "Y"} & set(moved)) or self.motion != 1
        # A retract begins as low as it cuts; where it ends, nothing is cut.
        ends = [before.get("Z", math.nan), *([self.at.get("Z", math.nan)] if level else [])]
        entry.count += 1
        entry.highest = max(entry.highest, *(math.inf if math.isnan(z) else z for z in ends))
        if level and not any(map(math.isnan, ends)):
            entry.level += 1
            entry.lowest = min(entry.lowest, *ends) if self.motion == 1 else -math.inf


def look(source: BinaryIO) -> Travel | Alike | None:
    r"""Find feed moves that stand in the place of rapids, in a program that has none.

    Parameters
    ----------
    source : binary file
        Seekable; read from its beginning.

    Returns
    -------
    Travel, Alike or None

    Examples
    --------
    >>> import io
    >>> look(io.BytesIO(b"G1 Z5 F5000\nX9 Y9\nZ-1 F300\nX0\nZ5 F5000\nX30\nZ-1 F300\nY3"))
    Alike(count=4, feed=5000.0, above=5.0)
    """
    source.seek(0)
    path = _Path()
    lines = source.read(LOOKED_AT).splitlines()
    if source.read(1):
        del lines[-1:]  # perhaps not all of it
    for line in lines:
        text = _COMMENT.sub(b"", line).strip(b" \t%")
        if text.startswith((b"/", b"O", b"o")) or not _PLAIN.fullmatch(text):
            path.at.clear()  # macros, variables, other languages
            continue
        words = [(m[1].decode().upper(), float(m[2])) for m in _WORD.finditer(text)]
        if words:
            path.line(words)
    if path.prints:
        ways = path.travels
        return Travel(len(ways), min(ways), max(ways)) if len(ways) >= LEAST else None
    return _alike(path.feeds)


def _alike(feeds: dict[float, _Feed]) -> Alike | None:
    """The fastest feed, where nothing at it is as low as what moves at another one."""
    known = [feed for feed in feeds if not math.isnan(feed)]
    if len(feeds) < 2 or len(known) != len(feeds):
        return None
    fastest = max(known)
    moves = feeds[fastest]
    cutting = max(entry.highest for feed, entry in feeds.items() if feed != fastest)
    if moves.level < LEAST or not moves.lowest >= cutting or not math.isfinite(moves.lowest):
        return None
    return Alike(moves.count, fastest, moves.lowest)


def instead_notes(source: BinaryIO, plans: Plans, controller: str) -> list[str]:
    """What to say where no rapid is rewritten."""
    if plans.planned.any():
        return []
    return feed_move_notes(source, plans.machine.source, controller, len(plans))


def feed_move_notes(source: BinaryIO, machine: str, controller: str, rapids: int) -> list[str]:
    """What to say of a program of which no rapid is rewritten.

    Parameters
    ----------
    source : binary file
        The program.
    machine : str
        What the user calls the machine file.
    controller : str
        What output is written for.
    rapids : int
        How many it has, returns to a reference point among them.

    Returns
    -------
    list of str
        One line, or none; none where rapids are no fewer than what looks like them.
    """
    found = look(source)
    if found is None or found.count <= rapids:
        return []
    counted = f"{rapids} rapid{'' if rapids == 1 else 's'} found"
    counted += ", none to be rewritten" if rapids else ""
    source.seek(0, io.SEEK_END)
    of = "" if source.tell() <= LOOKED_AT else f" of the first {LOOKED_AT >> 20} MB"
    if isinstance(found, Travel):
        printer = controller if controller in PRINTERS else PRINTERS[0]
        ways = f"{_number(found.shortest)}:{_number(found.longest)}"
        return [
            f"{counted}: the {found.count} travel moves{of} are G1, as slicers write them, "
            "and streams stand in the place of G0, so there is nothing to rewrite; what helps a "
            f"printer are its own settings: `gcodejerk parameters --machine {machine} "
            f"--controller {printer} --lengths {ways}` (docs/slicers.md)"
        ]
    return [
        f"{counted}; {found.count} moves{of} at F{found.feed:g} without cutting look like "
        f"rapids (none of them in X or Y below Z{found.above:g}), as some licences of CAM systems "
        f"write them; --rapid-feed {found.feed:g} --rapid-clearance {found.above:g} treats them as "
        "rapids, see docs/cam.md"
    ]


PRINTERS = ("klipper", "marlin", "rrf", "smoothieware", "kalico")
"""Controllers of printers whose own settings `parameters` tunes."""


def _number(length: float) -> str:
    return f"{max(length, 0.1):.3g}"
