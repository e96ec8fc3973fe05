"""The quick reading of a chunk: every plain line at once, as arrays.

Rule: when in doubt a line is read with care. A plain line holds letters of a small vocabulary, each
at most once and directly followed by a decimal number (or behind blanks, where these do not
matter), with blanks between words and comments anywhere; G0 to G3 are its only codes. Whatever
else stands on a line makes it one for the careful `tokenizer`.

Whether a line is plain shows in its `joints` and their distances: no number is read for that, but
where its value decides.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.text.gaps import closed_up
from gcodejerk.nc.text.joints import BLANK, CR, END, LETTERS, OPEN, OTHER, STAR, find_joints
from gcodejerk.nc.text.numbers import AROUND, parse_numbers
from gcodejerk.nc.text.respelling import respelled
from gcodejerk.nc.text.words import BIT, COMMENT, DOT, SIGN, Joints, Lines

Flags = NDArray[np.bool_]
Places = NDArray[np.int64]

_PAD = AROUND
_WHOLE_DIGITS = 9
"""Digits in front of the point up to which a number is surely not beyond any machine."""
_IN_FRONT = 5
"""Digits in front of the point that make a long number one to be looked at."""
_BITS = len(BIT)


def _weights() -> NDArray[np.int64]:
    """Class to the letter's bit, and above all bits one more, to count the letters."""
    table = np.zeros(256, dtype=np.int64)
    for letter, bit in BIT.items():
        table[ord(letter)] = bit + (1 << _BITS)
    return table


def _ones(bits: int) -> NDArray[np.uint8]:
    """How many bits are set, of every number of so many."""
    counts = np.zeros(1, dtype=np.uint8)
    for _ in range(bits):
        counts = np.concatenate([counts, counts + np.uint8(1)])
    return counts


_WEIGHT = _weights()
_ONES = _ones(_BITS)


def read_lines(data: bytes, dialect: Dialect) -> Lines:
    """Read the plain lines of a chunk.

    Parameters
    ----------
    data : bytes
        Whole lines; the last one may lack its end.
    dialect : Dialect
        One that has plain lines (`Dialect.quick`).

    Returns
    -------
    Lines
        With the words of the plain lines.
    """
    if dialect.text.klartext:
        data = respelled(data)
    complete = data.endswith(b"\n")
    # A line feed stands in front of the first line, and one behind the last.
    text = b"\n" * _PAD + data + (b"" if complete else b"\n") + b"\n" + b"0" * AROUND
    joint, kind, bad = find_joints(text, _PAD - 1, dialect.text)
    width = _widths(joint)
    if dialect.text.loose and _has_gaps(kind, width):
        text = closed_up(text)
        joint, kind, bad = find_joints(text, _PAD - 1, dialect.text)
        width = _widths(joint)
    joints = Joints(np.frombuffer(text, dtype=np.uint8), joint, kind)
    bad |= _misplaced(kind, width > 1)
    bad |= _doubtful_numbers(joints, width, dialect)
    if dialect.text.adjoining:
        bad |= _behind_comments(kind)

    # The first joint is the line end in front of all lines, the last one stands behind them.
    at = np.flatnonzero(kind == END)[:-1]
    ends = joint.take(at) - _PAD
    begin, end = ends[:-1] + 1, ends[1:]
    careful = end - begin > dialect.text.shortest
    careful[_lines_of(np.flatnonzero(bad[:-1]), at, kind)] = True
    crlf = joints.text.take(end + (_PAD - 1)) == ord("\r")
    crlf &= end > begin
    terminator = np.add(crlf, 1, dtype=np.uint8)
    if not complete:
        terminator[-1] = 0
        careful[-1] |= crlf[-1]
    weight = np.diff(np.cumsum(_WEIGHT.take(kind)).take(at))
    letters = (weight & ((1 << _BITS) - 1)).astype(np.uint32)
    # Bits add up to their union unless one occurs twice: then the sum has fewer ones than terms.
    careful |= _ONES.take(letters) != weight >> _BITS
    own = set(dialect.letters) - set(dialect.increments) | set("GN")
    own -= {dialect.text.variables, "" if dialect.extrudes else "E"}
    foreign = sum(bit for name, bit in BIT.items() if name not in own)
    careful |= letters & np.uint32(foreign) != 0
    if careful.any():
        letters[careful] = 0
        joints = Joints(joints.text, joint, _without(kind, at, np.flatnonzero(careful)))
    return Lines(begin, end - crlf, terminator, careful, letters, joints)


def _widths(joint: Places) -> Places:
    """How far the next joint is; 0 of the last one."""
    width = np.zeros_like(joint)
    np.subtract(joint[1:], joint[:-1], out=width[:-1])
    return width


def _has_gaps(kind: NDArray[np.uint8], width: Places) -> bool:
    """Whether a blank may stand between a letter and its number, as in ``X 12.5``."""
    return bool(((kind[:-1] >= LETTERS) & (kind[1:] == BLANK) & (width[:-1] == 1)).any())


def _next(flags: Flags, far: int = 1) -> Flags:
    """The same of the joint that follows; behind the last one follows nothing."""
    out = np.zeros_like(flags)
    out[:-far] = flags[far:]
    return out


def _before(flags: Flags) -> Flags:
    """The same of the joint in front; in front of the first one stands nothing."""
    out = np.zeros_like(flags)
    out[1:] = flags[:-1]
    return out


def _misplaced(kind: NDArray[np.uint8], digits: Flags) -> Flags:
    """Joints that are no letter with its number, nor a part of one, nor what may stand between.

    `digits`: which have some right behind them.
    """
    # One joint of no class in front of all, two behind: neighbours are views, and no copies.
    n = len(kind)
    classes, wide = np.full(n + 3, COMMENT, dtype=np.uint8), np.zeros(n + 3, dtype=np.bool_)
    classes[1:-2], wide[1:-2] = kind, digits
    letters, dots, signs = classes >= LETTERS, classes == DOT, classes == SIGN
    numbers = wide.copy()
    numbers[:-1] |= dots[1:] & wide[1:]
    number = numbers[1:-2] | (signs[2:-1] & ~digits & numbers[2:-1])
    bad: Flags = letters[1:-2] & ~number
    bad |= signs[1:-2] & ~(letters[:-3] & ~wide[:-3])
    bad |= dots[1:-2] & ~(letters[:-3] | signs[:-3])
    bad |= (kind - np.uint8(BLANK) <= OTHER - BLANK) & digits
    odd = np.flatnonzero(kind - np.uint8(OPEN) <= OTHER - OPEN)
    if len(odd):
        following = classes.take(odd + 2)
        closes = (kind.take(odd) == STAR) & ((following == END) | (following == CR))
        bad[odd[~closes]] = True
    returns = np.flatnonzero(kind == CR)
    bad[returns[classes.take(returns + 2) != END]] = True
    return bad


def _behind_comments(kind: NDArray[np.uint8]) -> Flags:
    """What closes a comment in front of something."""
    bad: Flags = (kind == BLANK) & _before(kind == COMMENT)
    bad &= ~_next((kind == END) | (kind == CR) | (kind == COMMENT))
    return bad


def _doubtful_numbers(joints: Joints, width: Places, dialect: Dialect) -> Flags:
    """Letters whose number is not a plain one of theirs; or its sign, or its point."""
    place, kind, text = joints.place, joints.kind, joints.text
    sign, dot = kind == SIGN, kind == DOT
    is_n, is_g = kind == ord("N"), kind == ord("G")
    bad: Flags = (sign | dot) & _before(is_n | is_g)
    bad |= sign & _before((kind == ord("F")) | (kind == ord("S")))
    bad |= is_n & ~_before(kind == END) if dialect.text.numbered else is_n
    codes = np.flatnonzero(is_g)
    first, behind = place.take(codes) + 1, place.take(codes + 1)
    zeros = behind - first == 1
    if dialect.text.padded:
        zeros |= (behind - first == 2) & (text.take(first) == ord("0"))
    bad[codes] |= ~zeros | (text.take(behind - 1) > ord("3"))
    if dialect.one_command:
        bad[_behind_others(kind)] = True
    if dialect.text.hexadecimal:
        xs = np.flatnonzero(kind == ord("X"))
        bad[xs] |= text.take(place.take(xs) - 1) == ord("0")
    if dialect.text.exponents:
        es = np.flatnonzero(kind == ord("E"))
        bad[es] |= text.take(place.take(es) - 1) != ord(" ")

    bad |= ((kind >= LETTERS) | sign) & (width > _WHOLE_DIGITS + 1)
    if dialect.text.digits:
        bad |= _many_digits(joints, width, dialect.text.number_digits or dialect.text.digits)
    if dialect.whole_numbers == "machine":
        bad |= _whole(joints, dialect)
    return bad


def _behind_others(kind: NDArray[np.uint8]) -> Places:
    """G words in front of which another word of their line stands, but for its number."""
    word = np.flatnonzero((kind >= LETTERS) | (kind == END))
    letter = kind.take(word)
    in_front = (letter[:-1] != END) & (letter[:-1] != ord("N"))
    found: Places = word[1:][in_front & (letter[1:] == ord("G"))]
    return found


def _many_digits(joints: Joints, width: Places, most: int) -> Flags:
    """Which words hold a number of more digits than `most`, several in front of its point."""
    kind, text = joints.kind, joints.text
    some = width > most // 2
    word = np.flatnonzero((kind >= LETTERS) & (some | _next(some) | _next(some, 2)))
    first, end = joints.numbers(word)
    many = end - first > most
    first += kind.take(word + 1) == SIGN
    for k in range(_IN_FRONT):
        many &= (text.take(first + k) != ord(".")) & (first + k < end)
    bad = np.zeros(len(kind), dtype=np.bool_)
    bad[word[many]] = True
    return bad


def _whole(joints: Joints, dialect: Dialect) -> Flags:
    """Which words hold a number whose meaning hangs on a decimal point that it lacks.

    Not F, which means the same and is restored as it was written; but F0 is odd.
    """
    kind = joints.kind
    word = np.flatnonzero(kind == ord("F") if dialect.calculator else kind >= LETTERS)
    word = word[~np.isin(kind.take(word), np.frombuffer(b"GNS", dtype=np.uint8))]
    word = word[joints.pointless(word)]
    value = parse_numbers(joints.text, *joints.numbers(word))
    bad = np.zeros(len(kind), dtype=np.bool_)
    bad[word[(value != 0.0) != (kind.take(word) == ord("F"))]] = True
    return bad


def _lines_of(joint: Places, at: Places, kind: NDArray[np.uint8]) -> Places:
    """The lines that joints belong to; digits behind a line end stand on the line that follows."""
    lines: Places = np.searchsorted(at, joint) - 1 + (kind.take(joint) == END)
    return lines


def _without(kind: NDArray[np.uint8], at: Places, lines: Places) -> NDArray[np.uint8]:
    """The classes, with nothing but comments on some lines."""
    first = at.take(lines) + 1
    count = at.take(lines + 1) - first
    place = np.arange(count.sum()) + np.repeat(first - np.cumsum(count) + count, count)
    out = kind.copy()
    out[place] = COMMENT
    return out
