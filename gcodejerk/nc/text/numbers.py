"""Decimal numbers out of bytes, thousands at a time.

Rule: the result is the double nearest to the decimal, as `float()` gives it. A number of up to 15
digits is an integer below 2**53 divided by a power of ten up to 10**22, both exact, so the one
rounding of the division is the correct one. Longer numbers are left to `float()`.

Eight characters are loaded as one 64-bit integer, the first in its lowest byte, and worked on
together (D. Lemire, "Quickly parsing eight digits", 2018, for the final three multiplications).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

U64 = NDArray[np.uint64]

LONGEST = 15
"""Characters of a number, sign apart, that are read here."""


def _every_byte(value: int) -> np.uint64:
    return np.uint64(int.from_bytes(bytes([value]) * 8, "little"))


_ZEROS = _every_byte(ord("0"))
_NO_DIGIT = _every_byte(0x10)
# '.', '+' and '-' are the only other characters of a number; under XOR with '0' each keeps bit 4.
_DOT = np.uint64(ord(".") ^ ord("0"))
_POWERS = 10.0 ** np.arange(23)
_PAIRS = np.uint64(0x000000FF000000FF)
_HIGH = np.uint64(100 + (1000000 << 32))
_LOW = np.uint64(1 + (10000 << 32))


def _digits(loaded: U64, count: NDArray[np.int64]) -> U64:
    """Keep the last `count` (1 to 8) characters as digit values; in front of them zeros."""
    shift = ((8 - count) * 8).astype(np.uint64)
    return ((loaded ^ _ZEROS) >> shift) << shift


def _squeeze(digits: U64) -> tuple[U64, NDArray[np.int64], NDArray[np.bool_]]:
    """Take the dot out: digits, how many stand behind it (-1: no dot), whether all is well."""
    marks = digits & _NO_DIGIT
    dot = marks >> np.uint64(4)  # 1 in the lowest bit of the dot's byte
    has_dot = dot != 0
    below = dot - np.uint64(1)  # every bit in front of the dot; without one, every bit
    at_dot = dot * np.uint64(255)
    good = (marks & (marks - np.uint64(1))) == 0
    good &= (digits & at_dot) == dot * _DOT
    front = digits & below
    squeezed = np.where(has_dot, (front << np.uint64(8)) | (digits & ~(below | at_dot)), digits)
    # dot is 256**j, so its exponent as a double says j
    exponent = dot.astype(np.float64).view(np.int64) >> 52
    behind = np.where(has_dot, 7 - ((exponent - 1023) >> 3), -1)
    return squeezed, behind, good


def _integer(digits: U64) -> U64:
    """Join eight digit values to the number that they spell."""
    pairs = digits * np.uint64(10) + (digits >> np.uint64(8))
    joined = (pairs & _PAIRS) * _HIGH + ((pairs >> np.uint64(16)) & _PAIRS) * _LOW
    return joined >> np.uint64(32)


def parse_numbers(
    source: NDArray[np.uint8], begin: NDArray[np.int64], end: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Read the numbers source[begin:end].

    Parameters
    ----------
    source : ndarray of uint8
        At least 16 bytes stand in front of the first number.
    begin, end : ndarray of int64, shape (n,)
        Spans that hold nothing but digits, dots and signs, one character at least.

    Returns
    -------
    value : ndarray, shape (n,)
        The numbers; without meaning where not good. [-]
    good : ndarray of bool, shape (n,)
        False where it is no number or a longer one than is read here.

    Examples
    --------
    >>> text = np.frombuffer(b" " * 16 + b"-1.25 .5 3..1", dtype=np.uint8)
    >>> value, good = parse_numbers(text, np.array([16, 22, 25]), np.array([21, 24, 29]))
    >>> value[good].tolist(), good.tolist()
    ([-1.25, 0.5], [True, True, False])
    """
    first = source[begin]
    negative = first == ord("-")
    count = end - begin - (negative | (first == ord("+")))
    good = (count >= 1) & (count <= LONGEST)
    view = np.ndarray(shape=(len(source) - 7,), dtype="<u8", buffer=source, strides=(1,))
    back = view[end - 8]
    digits, behind, fine = _squeeze(_digits(back, np.clip(count, 1, 8)))
    good &= fine & (count > (behind >= 0))
    mantissa = _integer(digits).astype(np.float64)
    long = np.flatnonzero(good & (count > 8))
    if len(long):
        front = _digits(view[end[long] - 16], count[long] - 8)
        digits, before, fine = _squeeze(front)
        here = behind[long]
        good[long] &= fine & ((before < 0) | (here < 0))
        weight = np.where(here >= 0, 1e7, 1e8)  # the dot took one of the eight places
        mantissa[long] += _integer(digits).astype(np.float64) * weight
        behind[long] = np.where(before >= 0, before + 8, here)
    value = mantissa / _POWERS[np.maximum(behind, 0)]
    return np.where(negative, -value, value), good
