"""Words of a line, and the modal words that a stream may touch: a small machine that runs them.

Rule: what it cannot read it does not guess: the line is none of a stream.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal

from gcodejerk.nc import Dialect, Rapids
from gcodejerk.nc.dialects.gcodes import G0, G1, G64, G90, G91

# No axis needs more digits; numbers without bounds would be a way to stall the reading.
_NUMBER = rb"[-+]?(?:[0-9]{1,9}(?:\.[0-9]{0,250})?|\.[0-9]{1,250})(?![0-9.])"
WORD = re.compile(rb"[ \t]*([A-Z])[ \t]*(" + _NUMBER + rb")")
_WORDS = re.compile(rb"(?:[ \t]*[A-Z][ \t]*" + _NUMBER + rb")+[ \t]*")


def read_words(line: bytes) -> list[tuple[str, Decimal]] | None:
    """Read the words of a line that holds nothing else; None where it does."""
    if not _WORDS.fullmatch(line):
        return None
    return [(letter.decode(), Decimal(text.decode())) for letter, text in WORD.findall(line)]


@dataclass(slots=True)
class Modes:
    """The modal words that a stream may touch."""

    motion: int | None
    distance: int
    feed_mode: int
    feed: Decimal | None
    path: int
    p: float
    q: float

    @classmethod
    def after(cls, rapids: Rapids, i: int) -> Modes:
        """List what the original has in force after the block of rapid i."""
        feed = float(rapids.feed[i])
        return cls(
            1 if rapids.fed[i] else 0,
            91 if rapids.incremental[i] else 90,
            int(rapids.feed_mode[i]),
            None if math.isnan(feed) else Decimal(repr(feed)),
            int(rapids.path[i]),
            float(rapids.path_p[i]),
            float(rapids.path_q[i]),
        )

    def apply(self, words: list[tuple[str, Decimal]], dialect: Dialect) -> str | None:
        """Execute a line without motion; what is wrong with it."""
        writing = dialect.writing
        if writing is not None and words == read_words(writing.standstill):
            return None
        seen = [letter + str(value) if letter == "G" else letter for letter, value in words]
        if len(set(seen)) < len(seen):
            return "a word stands twice"
        codes = {int(value * 10) for letter, value in words if letter == "G" and not value * 10 % 1}
        if len(codes) < sum(letter == "G" for letter, _ in words):
            return "a code that is none"
        values = {letter: value for letter, value in words if letter != "G"}
        problem = _out_of_place(codes, values, dialect)
        if problem is None:
            self._set(codes, values, dialect)
        return problem

    def _set(self, codes: set[int], values: dict[str, Decimal], dialect: Dialect) -> None:
        """Change what the words say, the feed mode before the feed."""
        for code in codes:
            if code in (G0, G1):
                self.motion = code // 10
            elif code in dialect.feed_modes:
                mode = dialect.feed_modes[code]
                if mode != self.feed_mode:
                    self.feed_mode, self.feed = mode, None
            elif code in (G90, G91):
                self.distance = code // 10
            else:
                self.path = dialect.paths[code]
                self.p = float(values.get("P", math.nan)) if code == G64 else math.nan
                self.q = float(values.get("Q", math.nan)) if code == G64 else math.nan
        if "F" in values:
            self.feed = values["F"]


def _out_of_place(codes: set[int], values: dict[str, Decimal], dialect: Dialect) -> str | None:
    """What has no place in a line of modal words."""
    if not set(values) <= {"F", "P", "Q"}:
        return f"word {min(set(values) - {'F', 'P', 'Q'})} has no place here"
    groups = [dialect.groups.get(code) for code in codes]
    if len(set(groups)) < len(groups):
        return "two codes of one modal group"
    known = {G0, G1, *dialect.feed_modes, *dialect.paths}
    known |= {code for code in (G90, G91) if dialect.groups.get(code) == "distance"}
    if not codes <= known:
        return f"G{min(codes - known) / 10:g} has no place here"
    if ("P" in values or "Q" in values) and G64 not in codes:
        return "P or Q without G64"
    return None
