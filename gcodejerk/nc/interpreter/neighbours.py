"""What stands in front of a rapid and behind it: a motion, or something that LinuxCNC waits for.

LinuxCNC 2.9 keeps half of a G0's acceleration back for the blend with its successor as long as it
knows none (tcGetOverallMaxAccel: a parabolic end). Played (2.9, G64 with and without P): where a
motion follows directly, be it a feed, another rapid or a cycle, the G0 has all of it; in front of
G4, M3 to M9, M64, S, G43, G49 and G92, and at the program's end it has half. G61 and G61.1 give all
of it always.

In front of a rapid, whatever LinuxCNC waits for leaves its queue of motions empty, and what follows
directly is planned with little look-ahead. A motion of some 20 ms in between fills it.

Rule: what is not understood counts as something that is waited for: the rapid is then taken for as
slow as it can be, its queue for empty, and no stream is held to a time that the control would not
keep.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.near_plain import NO, UNSAID, YES, Fast, are_followed, are_queued
from gcodejerk.nc.interpreter.rapids import Rapids
from gcodejerk.nc.text.chunks import Chunk, read_chunks
from gcodejerk.nc.text.lexer import read_lines
from gcodejerk.reasons import CERTAIN
from gcodejerk.storage import alike, release, windows
from gcodejerk.units import MM_PER_INCH

WINDOW = 512
"""Bytes behind a rapid that are looked at first, and how far at most. [bytes]"""
FARTHEST = 1 << 14
IN_FRONT = 512
"""Bytes in front of a rapid that are looked at. [bytes]"""
FEW = 8
"""Certain rapids of a chunk up to which each is looked at by itself."""
REMEMBERED = 1 << 12
"""Lines that are taken apart once: each is near some rapids."""
LONG_TIME, LONG_RAPID = 0.02, 2.0
"""A motion that fills the queue: of so long at F, or over such a way. [s], [mm]"""
_MEANING = frozenset({10, 20, 21, 28, 30, 52, 53, 54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3, 68, 69})
_MEANING |= {90, 91, 92, 92.1, 92.2, 92.3, 7, 8, 93, 95, 43, 43.1, 49}
"""G codes behind which a number means another place, or F another time."""
_COMMENT = re.compile(rb"\([^()\n]*\)|;[^\n]*")
_WORD = re.compile(rb"([A-Z])([+-]?[0-9.]+)?")
_COMPUTED = re.compile(rb"(N[0-9]+)?(G0?[0-3])?[XYZABCUVW]")
_STILL = frozenset(
    {17, 18, 19, 20, 21, 40, 54, 55, 56, 57, 58, 59, 59.1, 59.2, 59.3}
    | {61, 61.1, 64, 80, 90, 91, 90.1, 91.1, 93, 94, 98, 99}
)
"""G codes that neither move nor wait, played."""
_QUIET = frozenset({48, 49, 70, 71, 72})
"""M codes of which the same holds."""
_MOVES = frozenset({0, 1, 2, 3, 53, 73, 81, 82, 83, 85, 86, 89})
_MOVING = {bytes([c]) for c in b"XYZABCUVWIJK"}


def with_neighbours(
    file: BinaryIO, origin: int, rapids: Rapids, dialect: Dialect, name: str
) -> Rapids:
    """Say of each certain rapid whether it is alone.

    Parameters
    ----------
    file : BinaryIO
        The program, seekable.
    origin : int
        Where the program begins in it.
    rapids : Rapids
        Found in it.
    dialect : Dialect
        How it is written.
    name : str
        For messages.

    Returns
    -------
    Rapids
        The same; `lone` is false also where a motion follows, `queued` true where one precedes.
    """
    lone: NDArray[np.bool_] = rapids.lone.copy()
    queued: NDArray[np.bool_] = rapids.queued.copy()
    if dialect.quick:
        file.seek(origin)
        left = [
            _among_plain_lines(c, rapids, dialect, lone, queued) for c in read_chunks(file, name)
        ]
        unsaid: Iterable[NDArray[np.int64]] = left
    else:
        unsaid = (_certain(rapids, part) for part in windows(len(rapids)))
    for rows in unsaid:
        for i in rows.tolist():
            _look(file, origin, rapids, i, lone, queued)
    return replace(rapids, lone=alike(lone), queued=alike(queued))


def _certain(rapids: Rapids, part: slice) -> NDArray[np.int64]:
    """Indices of the certain rapids among some."""
    rows: NDArray[np.int64] = part.start + np.flatnonzero(rapids.reason[part] == CERTAIN)
    return rows


def _among_plain_lines(
    chunk: Chunk,
    rapids: Rapids,
    dialect: Dialect,
    lone: NDArray[np.bool_],
    queued: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """Say it of the rapids of a chunk, as far as the plain lines do; of which they don't."""
    ends = (chunk.offset, chunk.offset + len(chunk.data))
    rows = _certain(rapids, slice(*np.searchsorted(rapids.begin, ends).tolist()))
    if len(rows) < FEW:
        return rows
    lines = read_lines(chunk.data, dialect)
    at = np.searchsorted(lines.begin, rapids.begin[rows] - chunk.offset, side="right") - 1
    unit = np.where(rapids.inch[rows], MM_PER_INCH, 1.0)
    feed = np.where(rapids.feed_mode[rows] == 94, rapids.feed[rows] * unit, np.nan)
    how = Fast(rapids.incremental[rows], unit, feed, LONG_RAPID, LONG_TIME)
    follows = are_followed(lines, at, WINDOW)
    stands = are_queued(lines, at, chunk.offset, how, IN_FRONT)
    unsaid = (stands == UNSAID) | (lone[rows] & (follows == UNSAID))
    queued[rows[stands == YES]] = True
    lone[rows[~unsaid]] &= follows[~unsaid] == NO
    release()
    looked_at: NDArray[np.int64] = rows[unsaid]
    return looked_at


def _look(
    file: BinaryIO,
    origin: int,
    rapids: Rapids,
    i: int,
    lone: NDArray[np.bool_],
    queued: NDArray[np.bool_],
) -> None:
    """Say it of one rapid, line by line."""
    unit = MM_PER_INCH if rapids.inch[i] else 1.0
    begin, end = origin + int(rapids.begin[i]), origin + int(rapids.end[i])
    file.seek(max(begin - IN_FRONT, origin))
    text = file.read(end - file.tell())
    before, block = text[: len(text) - (end - begin)], text[len(text) - (end - begin) :]
    whole = len(before) < IN_FRONT
    lines = before.split(b"\n")[0 if whole else 1 : -1]
    feed = float(rapids.feed[i]) * unit if rapids.feed_mode[i] == 94 else np.nan
    if _kind(block):
        queued[i] = _long_motion(lines, bool(rapids.incremental[i]), unit, feed)
    if lone[i]:
        lone[i] = not _followed(file, begin, end)


def _long_motion(lines: list[bytes], incremental: bool, unit: float, feed: float) -> bool:
    """Whether the last motion of these lines, or one directly before it, lasts some time.

    The way of one axis is the least that a motion can be long. A line that is not understood, or
    that changes what lengths mean, ends the search.
    """
    for at in range(len(lines) - 1, -1, -1):
        kind, words = _kind(lines[at]), _words(lines[at])
        if kind is False or not _MEANING.isdisjoint(words.get("G", ())):
            return False
        if kind and not words and _hides_modes(lines[at]):
            return False
        if not words or (kind is None and not words.keys() & {"G", "F"}):
            continue  # computed, or neither a motion nor a mode
        fast = bool({0, 53} & set(words.get("G", ())))
        least = LONG_RAPID if fast or not feed > 0.0 else min(LONG_RAPID, feed * LONG_TIME / 60.0)
        for axis in "XYZ":
            if axis in words:
                way = words[axis][0]
                if not incremental:
                    way -= _value_before(lines[:at], axis)
                if abs(way) * unit >= least:
                    return True
        if "F" in words:
            feed = np.nan
    return False


def _value_before(lines: list[bytes], axis: str) -> float:
    """The last position of an axis that these lines state; NaN where none does for certain."""
    for line in reversed(lines):
        if _ends_search(line):
            return float("nan")
        words = _words(line)
        if axis in words:
            return words[axis][0]
    return float("nan")


@lru_cache(maxsize=REMEMBERED)
def _hides_modes(line: bytes) -> bool:
    """Whether a motion by an expression may state F, or a code beside its motion's."""
    text = _plain(line)
    motion = _COMPUTED.match(text)
    return motion is None or not {*b"FG"}.isdisjoint(text[motion.end() :])


@lru_cache(maxsize=REMEMBERED)
def _ends_search(line: bytes) -> bool:
    """Whether a line is not understood, or changes what lengths mean."""
    words = _words(line)
    return (not words and _plain(line) != b"") or not _MEANING.isdisjoint(words.get("G", ()))


@lru_cache(maxsize=REMEMBERED)
def _words(line: bytes) -> Mapping[str, tuple[float, ...]]:
    """The numbers of a line by letter; empty where it holds anything but words with numbers."""
    text = _plain(line)
    found = _WORD.findall(text)
    if b"".join(letter + value for letter, value in found) != text:
        return {}
    out: dict[str, tuple[float, ...]] = {}
    for letter, value in found:
        number = _number(value)
        if number is None:
            return {}
        out[letter.decode()] = (*out.get(letter.decode(), ()), number)
    return out


def _followed(file: BinaryIO, begin: int, end: int) -> bool:
    """Whether the motion of the block at begin:end is followed by another one directly."""
    size = WINDOW
    while True:
        file.seek(begin)
        text = file.read(end - begin + size)
        block, behind = text[: end - begin], text[end - begin :]
        if _waits(block):
            return False
        whole = len(text) < end - begin + size
        lines = behind.split(b"\n")[1:]
        for line in lines if whole else lines[:-1]:
            found = _kind(line)
            if found is not None:
                return found
        if whole or size >= FARTHEST:
            return False
        size *= 8


def _waits(block: bytes) -> bool:
    """Whether a block stops the program behind its own motion."""
    words = _WORD.findall(_plain(block))
    return any(letter == b"M" and _number(value) in (0, 1, 2, 30, 60) for letter, value in words)


@lru_cache(maxsize=REMEMBERED)
def _kind(line: bytes) -> bool | None:
    """True: moves; False: waits, or is not understood; None: neither."""
    text = _plain(line)
    if not text or text.startswith(b"#"):
        return None
    if text[:1] in b"/%O":
        return False
    if b"#" in text or b"[" in text:
        # A motion by an expression is one all the same; what else is computed may be anything.
        return _COMPUTED.match(text) is not None
    words = _WORD.findall(text)
    if b"".join(letter + value for letter, value in words) != text:
        return False
    letters = {letter for letter, _ in words}
    codes = {_number(value) for letter, value in words if letter == b"G"}
    orders = {_number(value) for letter, value in words if letter == b"M"}
    if letters & {b"T", b"S", b"H", b"D"} or not orders <= _QUIET or not codes <= _STILL | _MOVES:
        return False
    if letters & _MOVING:
        return True
    return None


def _plain(line: bytes) -> bytes:
    """A line without comments and blanks, in upper case."""
    return b"".join(_COMMENT.sub(b"", line).split()).upper()


def _number(value: bytes) -> float | None:
    try:
        return float(value)
    except ValueError:
        return None
