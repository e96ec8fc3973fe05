"""The words that may stand in the place of a rapid, line by line, and how they may be spelled.

What a word would do is not enough to let it pass: G641 blends like G64 and is another mode; F-1 in
front of the points does nothing, and does not belong there. So this module lists, from the rapid
and the dialect's table alone, which words each line of a replacement may hold.

Rule: nothing else may stand there, and of what may stand, all that changes a mode has to.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import Block, Dialect, Rapids
from gcodejerk.nc.dialects.gcodes import G0, G1, G90

FINER = 3
"""Decimals more than the resolution's, where the control computes in doubles."""
INCH_FINER = 2
"""Decimals more in inches: a thousandth of a millimetre is some 0.00004 in."""
MOST_DECIMALS = 12
STANDSTILL = 1e-9
"""An axis that moves less does not move. [mm] or [deg]"""
FEED_DIGITS, FEED_DECIMALS = 9, 8
Words = list[tuple[str, Decimal]]


def decimals_of(machine: Machine) -> dict[str, int]:
    """Decimals of each axis's resolution."""
    out = {}
    for axis in machine.axes:
        exponent = Decimal(repr(axis.resolution)).normalize().as_tuple().exponent
        out[axis.name] = min(max(1, -int(exponent)), MOST_DECIMALS)
    return out


def line_limit(dialect: Dialect) -> int:
    """Longest line that may be written, in bytes, its end not counted."""
    own = 0 if dialect.writing is None else dialect.writing.line_limit
    return own or dialect.text.line_limit


@dataclass(frozen=True, slots=True)
class Allowed:
    """What may stand in the place of one rapid."""

    standstill: bool
    """A block that waits until the machine stands comes first."""
    setup: frozenset[int]
    """G codes in front of the points; that those stand which change a mode, the modes tell."""
    ending: int | None
    """G code on the last point."""
    tail: frozenset[int]
    feed: bool
    """F stands in the tail."""
    behind: tuple[tuple[str, float], ...]
    """M words behind it all."""
    unknown_m: tuple[float, ...]
    """M words of the block that have no place in front of the points nor behind."""
    axes: frozenset[str]
    """Axes of the points but the last: those that move."""
    limit: int

    @classmethod
    def of(cls, rapids: Rapids, i: int, block: Block, dialect: Dialect, follows: bool) -> Allowed:
        """List it for rapid i; `follows` says that the line before is a stream too."""
        mode = int(rapids.feed_mode[i])
        exact = int(rapids.path[i]) in (61, 62)
        code = dialect.feed_code(mode)
        step = rapids.target[i] - rapids.start[i]
        m_words = [word for word in block.words if word.letter == "M"]
        return cls(
            standstill=not (follows or exact),
            setup=_setup_codes(rapids, i, dialect, exact=exact),
            ending=_ending_code(rapids, i, block, dialect, exact=exact),
            tail=frozenset(
                {_motion(rapids, i)} | ({code} if mode != 94 and code is not None else set())
            ),
            feed=mode != 93 and not math.isnan(float(rapids.feed[i])),
            behind=tuple(("M", float(w.value)) for w in m_words if w.value in dialect.after_m),
            unknown_m=tuple(
                float("nan" if w.value is None else w.value)
                for w in m_words
                if w.value not in dialect.before_m | dialect.after_m
            ),
            axes=frozenset(AXES[k] for k in range(len(AXES)) if abs(step[k]) > STANDSTILL),
            limit=line_limit(dialect),
        )

    def setup_problem(self, words: Words) -> str | None:
        """What is wrong with the words of the line in front of the points."""
        codes = _codes(words)
        others = [letter for letter, _ in words if letter != "G"]
        if others:
            return f"word {others[0]} has no place in front of the points"
        if not codes <= self.setup:
            return f"G{min(codes - self.setup) / 10:g} has no place in front of the points"
        return None

    def tail_problem(self, words: Words) -> str | None:
        """What is wrong with the words of the line behind the points."""
        codes = _codes(words)
        others = sorted(letter for letter, _ in words if letter != "G")
        if codes != self.tail or len(codes) != len(words) - len(others):
            wanted = " ".join(f"G{code / 10:g}" for code in sorted(self.tail))
            return f"behind the points stand {wanted} and no other code"
        if others != (["F"] if self.feed else []):
            return "F stands behind the points where it is known, and nothing else does"
        return None


def _motion(rapids: Rapids, i: int) -> int:
    """G code of the motion that is in force behind a block."""
    return G1 if rapids.fed[i] else G0


def _setup_codes(rapids: Rapids, i: int, dialect: Dialect, *, exact: bool) -> frozenset[int]:
    """G codes that may stand in front of the points: G94, G64 and G90 where a stream needs them."""
    may: set[int | None] = set()
    if rapids.feed_mode[i] != 94 or not rapids.feed_mode_stated[i]:
        may.add(dialect.feed_code(94))
    if exact:
        may.add(dialect.path_code(64))
    if not rapids.distance_stated[i] and dialect.groups.get(G90) == "distance":
        may.add(G90)
    return frozenset(code for code in may if code is not None)


def _ending_code(
    rapids: Rapids, i: int, block: Block, dialect: Dialect, *, exact: bool
) -> int | None:
    """G code that ends the last point in a standstill, where the rapid ended in one."""
    stop = dialect.exact_stop
    ending = dialect.path_code(int(rapids.path[i])) if exact else None
    stated = stop is not None and any(
        word.letter == "G" and word.value == stop / 10 for word in block.words
    )
    return stop if ending is None and (stated or dialect.stops_after_rapid) else ending


def _codes(words: Words) -> set[int]:
    """G codes, times ten."""
    return {int(value * 10) for letter, value in words if letter == "G"}


def point_pattern(letters: str, decimals: Mapping[str, int], dialect: Dialect, inch: bool) -> bytes:
    """Pattern of one point with these axes and F, as it may be spelled."""
    digits = 15 if dialect.writing is None else dialect.writing.digits
    finer = FINER if dialect.writing is not None and dialect.writing.doubles else 0
    words = []
    for letter in letters:
        most = decimals.get(letter, 1) + finer + (INCH_FINER if inch and letter not in "ABC" else 0)
        words.append(
            rb" %c(?=-?[0-9.]{1,%d}(?![0-9.]))" % (ord(letter), digits + 1)
            + rb"-?(?:0|[1-9][0-9]{0,8})\.[0-9]{1,%d}(?![0-9.])" % min(most, MOST_DECIMALS)
        )
    return b"G1" + b"".join(words) + b" F" + feed_pattern(dialect)


def feed_pattern(dialect: Dialect) -> bytes:
    """Pattern of F of any point, without its letter."""
    digits = 15 if dialect.writing is None else dialect.writing.digits
    number = rb"(?=[0-9.]{1,%d}(?![0-9.]))(?:0|[1-9][0-9]{0,%d})\.[0-9]{1,%d}(?![0-9.])"
    return number % (digits + 1, FEED_DIGITS - 1, FEED_DECIMALS)


_LONG = re.compile(rb"[A-Z][-+]?[0.]*[1-9][0-9.]{24}")


def too_long(line: bytes, block: bytes) -> str | None:
    """What is wrong with a number of a line that is longer than any, and not the block's own."""
    match = _LONG.search(line)
    own = b"".join(block.split()).upper()
    if match is None or match[0] in own:
        return None
    return f"{match[0][:20].decode()}... has more digits than any word"


def point_problem(line: bytes, block: bytes, dialect: Dialect) -> str | None:
    """What is wrong with the numbers of a point that has the block's own words."""
    problem = too_long(line, block)
    if problem is None and re.search(b" F" + feed_pattern(dialect) + rb"\Z", line) is None:
        problem = "F of the last point is not written as the others are"
    return problem
