"""The quick reading of a chunk: every plain line at once, as arrays.

Rule: when in doubt a line is read with care. A plain line holds letters of a small vocabulary, each
directly followed by a decimal number, with blanks between words and comments anywhere; G0 to G3 are
its only codes. Whatever else stands on a line makes it one for the careful `tokenizer`.

Each byte is translated to a class; the bytes that are not part of a number (letters, blanks, line
ends) are the joints, and between a letter and the next joint stands its number.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.text.cursor import LARGEST
from gcodejerk.nc.text.numbers import parse_numbers
from gcodejerk.nc.text.words import BIT, PLAIN_LETTERS, Lines, Words

_NUMBER, _BLANK, _END, _CR, _OPEN, _CLOSE, _SEMICOLON, _OTHER = range(8)
_LETTERS = 64
"""Classes from here on are letters and equal their upper-case code."""

_PAD = 16
_IN_FRONT = 5
"""Digits in front of the point that make a long number one to be looked at."""
_ACTIVE = re.compile(rb"[(;][ \t]*py", re.IGNORECASE)


def _classes() -> bytes:
    """Make the table that translates a byte to its class."""
    table = bytearray([_OTHER] * 256)
    for byte in b"0123456789.+-":
        table[byte] = _NUMBER
    table[0x20] = table[0x09] = _BLANK
    table[0x0A], table[0x0D] = _END, _CR
    table[0x28], table[0x29], table[0x3B] = _OPEN, _CLOSE, _SEMICOLON
    for letter in PLAIN_LETTERS:
        table[ord(letter)] = table[ord(letter.lower())] = ord(letter)
    return bytes(table)


def _bits() -> NDArray[np.float64]:
    """Upper-case code to the letter's bit."""
    table = np.zeros(256)
    for letter, bit in BIT.items():
        table[ord(letter)] = bit
    return table


_CLASS = _classes()
_BIT_OF = _bits()
_ONES = np.array([bin(n).count("1") for n in range(1 << 9)], dtype=np.uint8)


def _blank_comments(classes: NDArray[np.uint8], text: bytes, semicolon: bool) -> NDArray[np.int64]:
    """Turn plain comments into blanks; the lines that hold any other."""
    at = np.flatnonzero((classes >= _END) & (classes <= _SEMICOLON) & (classes != _CR))
    kind = classes[at]
    following, previous = np.roll(kind, -1), np.roll(kind, 1)
    is_open, is_semicolon = kind == _OPEN, kind == _SEMICOLON
    bad = is_open & (following != _CLOSE)
    bad |= (kind == _CLOSE) & (previous != _OPEN)
    bad |= is_semicolon & ((following != _END) | (not semicolon))
    # A comment may run Python: (py,...)
    starts = np.flatnonzero(is_open | is_semicolon)
    source = np.frombuffer(text, dtype=np.uint8)
    after = source[at[starts] + 1]
    for index in starts[np.isin(after, np.frombuffer(b"pP \t", dtype=np.uint8))].tolist():
        bad[index] = bad[index] or _ACTIVE.match(text, int(at[index])) is not None
    good = starts[~bad[starts]]
    step = np.zeros(len(classes) + 1, dtype=np.int8)
    step[at[good]] = 1
    # the closing bracket belongs to the comment, the line end does not
    step[at[good + 1] + (kind[good + 1] == _CLOSE)] -= 1
    inside = np.add.accumulate(step[:-1], dtype=np.int8)
    classes[inside.view(np.bool_) & (classes != _CR)] = _BLANK  # where a line ends, none is inside
    line = np.cumsum(kind == _END) - (kind == _END)
    lines: NDArray[np.int64] = line[bad]
    return lines


def _whole(
    source: NDArray[np.uint8],
    letter: NDArray[np.uint8],
    begin: NDArray[np.int64],
    end: NDArray[np.int64],
    value: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Which words hold a number whose meaning hangs on a decimal point that it lacks."""
    points = np.add.accumulate(source == ord("."), dtype=np.int64)
    silent = (letter == ord("G")) | (letter == ord("N")) | (letter == ord("S"))
    plain: NDArray[np.bool_] = (points[end - 1] == points[begin]) & (value != 0.0) & ~silent
    return plain


def _many_digits(
    source: NDArray[np.uint8], begin: NDArray[np.int64], end: NDArray[np.int64], most: int
) -> NDArray[np.bool_]:
    """Which words hold a number of more digits than `most`, several in front of its point."""
    many = end - begin > most + 1
    long = np.flatnonzero(many)
    first = begin[long] + 1
    first += source[first] < ord(".")  # + and -
    for k in range(_IN_FRONT):
        many[long] &= (source[first + k] != ord(".")) & (first + k < end[long])
    return many


def read_lines(data: bytes, dialect: Dialect) -> Lines:
    """Read the plain lines of a chunk.

    Parameters
    ----------
    data : bytes
        Whole lines; the last one may lack its end.
    dialect : Dialect
        One whose plain lines mean what they mean in RS274/NGC (`Dialect.quick`).

    Returns
    -------
    Lines
        With the words of the plain lines.
    """
    complete = data.endswith(b"\n")
    text = b"\n" * _PAD + data + (b"" if complete else b"\n") + b"\n"
    translated = text.translate(_CLASS)
    classes = np.frombuffer(bytearray(translated), dtype=np.uint8)
    inner = classes[_PAD:-1]
    careful_lines = []
    if any(mark in translated for mark in (b"\x04", b"\x05", b"\x06")):
        semicolon = dialect.text.semicolon == "comment"
        careful_lines.append(_blank_comments(inner, text[_PAD:-1], semicolon))

    joint = np.flatnonzero(classes[:-1] != _NUMBER)[_PAD:]
    kind = classes[joint]
    width = np.empty_like(joint)  # of what stands between a joint and the next one
    np.subtract(joint[1:], joint[:-1], out=width[:-1])
    width[-1] = 1
    ends = kind == _END
    line_end = joint[ends] - _PAD
    line_begin = np.concatenate([[0], line_end[:-1] + 1])
    line = np.cumsum(ends) - ends
    is_letter = kind >= _LETTERS
    bad = is_letter != (width > 1)  # a letter without a number, or a number without a letter
    bad |= (kind >= _OPEN) & ~is_letter
    returns = kind == _CR
    if returns.any():
        bad[:-1] |= returns[:-1] & ~ends[1:]
    # A line end is a joint of its own line, but a number behind it stands on the next one.
    careful_lines.append((line + ends)[bad])
    if inner[0] == _NUMBER:
        careful_lines.append(line[:1])

    word = np.flatnonzero(is_letter & ~bad)
    letter, begin = kind[word], joint[word]
    end = begin + width[word]
    word_line = line[word]
    source = np.frombuffer(text, dtype=np.uint8)
    value, good = parse_numbers(source, begin + 1, end)
    good &= np.abs(value) <= LARGEST
    is_g = letter == ord("G")
    good &= ~is_g | (value == 0.0) | (value == 1.0) | (value == 2.0) | (value == 3.0)
    unsigned = (letter == ord("F")) | (letter == ord("S"))
    good &= ~(unsigned & (value < 0.0))
    if dialect.text.digits:
        good &= ~_many_digits(source, begin, end, dialect.text.digits)
    if dialect.whole_numbers == "machine":
        good &= ~_whole(source, letter, begin, end, value)
    numbers = np.flatnonzero(letter == ord("N"))
    if len(numbers):
        follows = begin[numbers] - _PAD != line_begin[word_line[numbers]]
        signed = source[begin[numbers] + 1] < ord(".")  # + and -
        dotted = source[begin[numbers] + 1] == ord(".")
        good[numbers] &= ~(follows | signed | dotted)
    careful_lines.append(word_line[~good])

    careful = np.zeros(len(line_end), dtype=np.bool_)
    for lines in careful_lines:
        careful[lines] = True
    careful |= line_end - line_begin > dialect.text.shortest
    # Bits add up to their union unless one occurs twice: then the sum has fewer ones than terms.
    total = np.bincount(word_line, weights=_BIT_OF[letter], minlength=len(careful)).astype(
        np.uint32
    )
    ones = _ONES[total & 511] + _ONES[(total >> 9) & 511]
    careful |= (ones != np.bincount(word_line, minlength=len(careful))) | (total >= 1 << 18)
    own = set(dialect.letters) - set(dialect.increments) | set("GN")
    foreign = sum(bit for name, bit in BIT.items() if name not in own)
    careful |= total & np.uint32(foreign) != 0
    crlf = source[line_end + (_PAD - 1)] == 0x0D
    crlf &= line_end > line_begin
    terminator = np.where(crlf, 2, 1).astype(np.uint8)
    if not complete:
        terminator[-1] = 0
        careful[-1] |= crlf[-1]
    total[careful] = 0
    kept = np.flatnonzero(~careful[word_line])
    return Lines(
        begin=line_begin,
        end=line_end - crlf,
        terminator=terminator,
        careful=careful,
        letters=total,
        words=Words(
            data, letter[kept], value[kept], begin[kept] - _PAD, end[kept] - _PAD, word_line[kept]
        ),
    )
