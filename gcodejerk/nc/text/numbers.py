"""Decimal numbers out of bytes, thousands at a time.

Rule: the result is the double nearest to the decimal, as `float()` gives it. A number of up to 15
digits is an integer below 2**53 divided by a power of ten up to 10**22, both exact, so the one
rounding of the division is the correct one; `float()` itself reads longer ones. Whether there is a
number at all is not looked at here.

Eight characters are loaded as one 64-bit integer, the first in its lowest byte, and worked on
together (D. Lemire, "Quickly parsing eight digits", 2018, for the final three multiplications).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

U64 = NDArray[np.uint64]

LONGEST = 15
"""Characters of a number, sign apart, that are read together with those of others."""
AROUND = 16
"""Bytes that stand in front of the first number, and behind the last one."""


def _every_byte(value: int) -> np.uint64:
    return np.uint64(int.from_bytes(bytes([value]) * 8, "little"))


_ZEROS = _every_byte(ord("0"))
# Under XOR with '0' a dot alone keeps bit 4.
_NO_DIGIT = _every_byte(0x10)
_DOT = np.uint64(ord(".") ^ ord("0"))
_LAST = np.array([(1 << 64) - (1 << 8 * (8 - count)) for count in range(9)], dtype=np.uint64)
"""Masks of the last 0 to 8 characters."""
_BYTE, _WORD = np.uint64(8), np.uint64(64)
_PAIRS = np.uint64(0x000000FF000000FF)
_HIGH = np.uint64(100 + (1000000 << 32))
_LOW = np.uint64(1 + (10000 << 32))
# A dot in byte j of eight is 256**j, as a double 2**(8 j): j stands above its lowest 55 bits, with
# an eighth of the bias, 1023, beneath.
_EXPONENT = 55
_SCALE = np.ones((1023 >> 3) + 8)
_SCALE[1023 >> 3 :] = 10.0 ** np.arange(7, -1, -1)
"""By what a dot leaves above those bits: what the digits without it are to be divided by."""


def _loaded(words: U64, end: NDArray[np.int64]) -> U64:
    """Eight characters in front of each place; `words` are all of the text, one after the other."""
    begin = end - 8
    shift = ((begin & 7) << 3).view(np.uint64)
    word = begin >> 3
    out: U64 = words.take(word) >> shift
    # Of a shift by 64 bits nothing remains, here as in all of numpy.
    out |= words.take(word + 1) << (_WORD - shift)
    return out


def _squeezed(digits: U64) -> tuple[U64, U64]:
    """Take the dot out: digits, and a 1 in the lowest bit of the dot's byte."""
    dot = (digits & _NO_DIGIT) >> np.uint64(4)
    digits ^= dot * _DOT
    front = digits & (dot - (dot != 0))  # every bit in front of the dot; without one, none
    digits ^= front
    digits |= front << _BYTE
    return digits, dot


def _integer(digits: U64) -> NDArray[np.float64]:
    """Join eight digit values to the number that they spell."""
    pairs = digits * np.uint64(10)
    pairs += digits >> _BYTE
    joined = (pairs & _PAIRS) * _HIGH
    pairs >>= np.uint64(16)
    pairs &= _PAIRS
    joined += pairs * _LOW
    joined >>= np.uint64(32)
    return joined.view(np.int64).astype(np.float64)


def _scale(dot: U64) -> NDArray[np.float64]:
    """Ten to the number of digits behind the dot, one without a dot."""
    return _SCALE.take(dot.view(np.int64).astype(np.float64).view(np.int64) >> _EXPONENT)


def parse_numbers(
    source: NDArray[np.uint8], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Read the numbers source[begin:end].

    Parameters
    ----------
    source : ndarray of uint8
        At least `AROUND` bytes stand in front of the first number and behind the last one.
    begin, end : ndarray of int64, shape (n,)
        Spans that hold a sign or none, and then digits, with a dot among them or without one. What
        comes of any other of up to `LONGEST` characters has no meaning.

    Returns
    -------
    ndarray, shape (n,)
        The numbers. [-]

    Raises
    ------
    ValueError
        A longer one is no number.

    Examples
    --------
    >>> text = np.frombuffer(b" " * 16 + b"-1.25 .5 31" + b" " * 16, dtype=np.uint8)
    >>> parse_numbers(text, np.array([16, 22, 25]), np.array([21, 24, 27])).tolist()
    [-1.25, 0.5, 31.0]
    """
    words = source[: len(source) // 8 * 8].view("<u8")
    first = source.take(begin)
    negative = first == ord("-")
    count = end - begin
    count -= negative | (first == ord("+"))
    last = _loaded(words, end)
    last ^= _ZEROS
    last &= _LAST.take(count, mode="clip")
    digits, dot = _squeezed(last)
    value, scale = _integer(digits), _scale(dot)
    long = np.flatnonzero(count > 8)
    if len(long):
        front = _loaded(words, end[long] - 8) ^ _ZEROS
        front &= _LAST.take(count[long] - 8, mode="clip")
        digits, before = _squeezed(front)
        value[long] += _integer(digits) * np.where(dot[long] != 0, 1e7, 1e8)  # a dot took a place
        scale[long] = np.where(before != 0, _scale(before) * 1e8, scale[long])
    value /= scale
    value.view(np.uint64)[...] ^= negative.astype(np.uint64) << np.uint64(63)
    for k in long[count[long] > LONGEST].tolist():
        value[k] = float(source[begin[k] : end[k]].tobytes())
    return value
