"""The joints of a chunk: the bytes that are no digits, and what each of them is.

What stands between two joints are digits and nothing else, so a program is its joints and their
distances. They are fewer than half of its bytes, and a byte's class is looked up for them alone.

Rule: what stands within a plain comment is `COMMENT`, whatever it is.
"""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.dialects.spelling import Text
from gcodejerk.nc.text.words import DOT, PLAIN_LETTERS, SIGN

BLANK, END, CR, OPEN, CLOSE, SEMICOLON, STAR, OTHER = range(SIGN + 1, SIGN + 9)
LETTERS = 64
"""Classes from here on are letters and equal their upper-case code."""

LIVE = re.compile(rb"\([ \t]*(?!(?:msg|print|debug)[ \t]*,)[a-z_]+[ \t]*,", re.IGNORECASE)
"""A comment that `Text.live_comments` is about."""
_PYTHON = re.compile(rb"[(;][ \t]*py", re.IGNORECASE)
_REMARKS = tuple(bytes([kind]) for kind in (OPEN, CLOSE, SEMICOLON))
_MAY_BE_LIVE = np.array([bytes([byte]).isalpha() or byte in b"_ \t" for byte in range(256)])
_MAY_BE_PYTHON = np.array([byte in b"pP \t" for byte in range(256)])
"""Whether such a byte behind its opening may begin one."""


@lru_cache(maxsize=32)
def _classes(rules: Text) -> bytes:
    """Make the table that translates a byte to its class."""
    table = bytearray([OTHER] * 256)
    table[ord(".")] = DOT
    table[ord("+")] = table[ord("-")] = SIGN
    table[ord(" ")] = BLANK
    table[ord("\t")] = OTHER if rules.tight else BLANK
    table[ord("\n")], table[ord("\r")] = END, CR
    if rules.parentheses in ("comment", "open comment"):
        table[ord("(")], table[ord(")")] = OPEN, CLOSE
    if rules.semicolon == "comment":
        table[ord(";")] = SEMICOLON
    if rules.end:
        table[ord(rules.end)] = STAR
    for letter in PLAIN_LETTERS:
        table[ord(letter)] = ord(letter)
        table[ord(letter.lower())] = OTHER if rules.capitals else ord(letter)
    return bytes(table)


def find_joints(
    text: bytes, begin: int, rules: Text
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.bool_]]:
    r"""Find the joints of a text, and what they are.

    Parameters
    ----------
    text : bytes
        Begins and ends with a line feed.
    begin : int
        Where the line feed in front of the first line stands.
    rules : Text
        Of the dialect: what begins a comment, and what is a byte of its own.

    Returns
    -------
    joint : ndarray of int64, shape (k,)
        Their places, from `begin` on.
    kind : ndarray of uint8, shape (k,)
        Their classes; `COMMENT` from what opens one to what closes it.
    wrong : ndarray of bool, shape (k,)
        A bracket, or a semicolon, of what is no plain comment.

    Examples
    --------
    >>> from gcodejerk.nc.text.words import COMMENT
    >>> joint, kind, wrong = find_joints(b"\nX5(1 a)\nY2.(\n", 0, Text())
    >>> joint.tolist(), (kind == COMMENT).nonzero()[0].tolist(), wrong.nonzero()[0].tolist()
    ([0, 1, 3, 5, 6, 7, 8, 9, 11, 12, 13], [2, 3, 4], [9])
    """
    source = np.frombuffer(text, dtype=np.uint8)[begin:]
    # '0' to '9' alone are below 10 when 48 is taken from a byte, modulo 256
    joint = np.flatnonzero(source - np.uint8(ord("0")) > 9)
    classes = source.take(joint).tobytes().translate(_classes(rules))
    kind = np.frombuffer(classes, dtype=np.uint8)
    joint += begin
    if not any(mark in classes for mark in _REMARKS):
        return joint, kind, np.zeros(len(joint), dtype=np.bool_)
    return joint, *_comments(text, joint, kind, live=rules.live_comments)


def _comments(
    text: bytes, joint: NDArray[np.int64], kind: NDArray[np.uint8], *, live: bool
) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """The classes with `COMMENT` throughout plain comments; what opens or closes any other."""
    at = _marks(kind)
    what = kind.take(at)
    following, previous = np.roll(what, -1), np.roll(what, 1)
    is_open, is_semicolon = what == OPEN, what == SEMICOLON
    bad = is_open & (following != CLOSE)
    bad |= (what == CLOSE) & (previous != OPEN)
    # A comment may run Python: (py,...); or anything, where there are live ones: (expr,...)
    active, may_be = (LIVE, _MAY_BE_LIVE) if live else (_PYTHON, _MAY_BE_PYTHON)
    opens = np.flatnonzero(is_open | is_semicolon)
    source = np.frombuffer(text, dtype=np.uint8)
    behind = source.take(joint.take(at.take(opens)) + 1)
    for index in opens[may_be.take(behind)].tolist():
        bad[index] = bad[index] or active.match(text, int(joint[at[index]])) is not None
    opens = opens[~bad.take(opens)]
    last = at.take(opens + 1)
    # Comments do not overlap; sums of these are many times as fast as sums of bytes.
    inside = np.zeros(len(kind), dtype=np.int32)
    inside[at.take(opens)], inside[last] = 1, -1
    np.add.accumulate(inside, out=inside)
    # A carriage return within a comment may end the line, so it is not passed over.
    outside = inside == 0
    outside |= kind == CR
    kind = kind * outside  # COMMENT is 0
    # The bracket that closes a comment is a blank; the end of a line stays what it is.
    kind[last[kind.take(last) == CLOSE]] = BLANK
    wrong = np.zeros(len(kind), dtype=np.bool_)
    wrong[at[bad]] = True
    return kind, wrong


def _marks(kind: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Which joints open or close comments, or end lines; none behind the semicolon of its line."""
    # Of what is below END, the difference is far above, modulo 256.
    at = np.flatnonzero(kind - np.uint8(END) <= SEMICOLON - END)
    what = kind.take(at)
    if (what == CR).any():
        at = at[what != CR]
        what = kind.take(at)
    if not (what == SEMICOLON).any():
        return at
    count = np.cumsum(what == SEMICOLON)
    ends = np.flatnonzero(what == END)
    # So many stand in front of the line that each mark is on.
    before = np.repeat(np.append(0, count[ends]), np.diff(ends, prepend=-1, append=len(what) - 1))
    open_ = (what == END) | (count - (what == SEMICOLON) == before)
    marks: NDArray[np.int64] = at[open_]
    return marks
