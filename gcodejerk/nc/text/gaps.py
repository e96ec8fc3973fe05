"""Blanks in front of numbers, ``X  12.500``: they may as well stand behind them.

This module owns where such blanks stand in a chunk, and the same text with each letter in front of
its number. The text keeps its length, and its ends of lines their places.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]
Places = NDArray[np.int64]

_BLANK = np.array([byte in b" \t" for byte in range(256)])
_DIGIT = np.array([chr(byte) in "0123456789" for byte in range(256)])
_LETTER = np.array([byte < 128 and chr(byte).isalpha() for byte in range(256)])
_SIGN = np.array([byte in b"+-" for byte in range(256)])
_END = b"\n"
"""Put behind the text: a byte that is none of these."""


def closed_up(text: bytes) -> bytes:
    r"""Put the blanks between letters and their numbers behind the numbers.

    Parameters
    ----------
    text : bytes
        Of any kind.

    Returns
    -------
    bytes
        As many.

    Examples
    --------
    >>> closed_up(b"G0 X  12.500 Y -.5 (Z 3)\n")
    b'G0 X12.500   Y-.5  (Z3 )\n'
    """
    source = np.frombuffer(text + _END, dtype=np.uint8)
    blank = _BLANK.take(source)
    letter = np.flatnonzero(_LETTER.take(source[:-1]) & blank[1:])
    begin = _next(~blank, letter + 1)
    end = _behind_numbers(source, begin)
    found = end > begin
    letter, begin, end = letter[found], begin[found], end[found]
    # What is put in the place of each byte behind a letter: the number's, then the blanks'.
    first, whole, number = letter + 1, end - letter - 1, end - begin
    at = np.arange(int(whole.sum())) - np.repeat(np.cumsum(whole) - whole, whole)
    digits = at < np.repeat(number, whole)
    source_of = np.repeat(first, whole) + at
    taken = source_of + np.where(digits, np.repeat(begin - first, whole), -np.repeat(number, whole))
    out = source[:-1].copy()
    out[source_of] = source.take(taken)
    return out.tobytes()


def _next(kind: Flags, place: Places) -> Places:
    """The first byte of a kind at each place or behind it; the text's end is of any kind."""
    every = np.flatnonzero(kind)
    found: Places = every.take(np.searchsorted(every, place))
    return found


def _behind_numbers(source: NDArray[np.uint8], begin: Places) -> Places:
    """Where the number ends that begins at each place; the place itself where none does."""
    other = ~_DIGIT.take(source)
    first = begin + _SIGN.take(source.take(begin))
    end = _next(other, first)
    pointed = source.take(end) == ord(".")
    behind = _next(other, np.where(pointed, end + 1, end))
    digits = behind - first - pointed
    found: Places = np.where(digits > 0, behind, begin)
    return found
