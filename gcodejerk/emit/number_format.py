"""Numbers to text, a million lines at a time.

This module owns the way from columns of whole numbers to lines such as ``G1 X1.2500 F340.0810``:
every line is a row of a matrix of bytes, wide enough for the largest number; bytes that a line does
not use are zero and fall out when the matrix is flattened. Numbers are integers with an implied
decimal point, so nothing is rounded here, and minus zero cannot occur.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int64]
Bytes = NDArray[np.uint8]

ROWS = 4096
"""Lines that are made at a time: a matrix that stays in the processor's cache."""

_FOUR_DIGITS = np.frombuffer(b"".join(b"%04d" % i for i in range(10_000)), np.uint32)
"""Four decimal digits as text, packed into one number."""


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One word of each line: an address and a number with a fixed count of decimals.

    Without values the prefix stands alone; at least one column has values. Decimals for which there
    are too many digits in front of the point are left out: their places hold zeros.
    """

    prefix: bytes
    values: Whole | None
    decimals: int
    digits: int = 18
    """Most digits of a number."""


def format_lines(columns: list[Column], line_end: bytes) -> tuple[bytes, Whole]:
    r"""Lines of text from columns of numbers.

    Parameters
    ----------
    columns : list of Column
        In the order in which they are written, each of n numbers.
    line_end : bytes
        Written after each line.

    Returns
    -------
    text : bytes
        n lines.
    ends : ndarray of int, shape (n,)
        Where each line ends in the text, line end included.

    Examples
    --------
    >>> x, f = np.array([-5, 12345]), np.array([600, 10])
    >>> text, ends = format_lines([Column(b"G1 X", x, 3), Column(b" F", f, 0)], b"\n")
    >>> text, ends.tolist()
    (b'G1 X-0.005 F600\nG1 X12.345 F10\n', [16, 31])
    """
    count = next(len(column.values) for column in columns if column.values is not None)
    widths = [_digits_shown(column) for column in columns]
    texts, lengths = [], []
    for begin in range(0, count, ROWS):
        part = slice(begin, min(begin + ROWS, count))
        text, length = _format_rows(columns, widths, line_end, part)
        texts.append(text)
        lengths.append(length)
    return b"".join(texts), np.cumsum(np.concatenate(lengths) if lengths else np.zeros(0, int))


def _digits_shown(column: Column) -> int:
    """Digits of the longest number of a column, at least one in front of the decimals."""
    if column.values is None:
        return 0
    longest = int(np.abs(column.values).max(initial=0))
    return max(len(str(longest)), column.decimals + 1)


def _format_rows(
    columns: list[Column], widths: list[int], line_end: bytes, part: slice
) -> tuple[bytes, Whole]:
    """Some of the lines, and the length of each."""
    total = sum(
        len(c.prefix) + (0 if c.values is None else w + 1 + (c.decimals > 0))
        for c, w in zip(columns, widths, strict=True)
    )
    lines = np.empty((part.stop - part.start, total + len(line_end)), dtype=np.uint8)
    at = 0
    for column, width in zip(columns, widths, strict=True):
        at = _put(lines, at, column.prefix)
        if column.values is not None:
            at = _put_number(lines, at, column.values[part], width, column)
    _put(lines, at, line_end)
    used = lines != 0
    return lines[used].tobytes(), np.count_nonzero(used, axis=1)


def _put(lines: Bytes, at: int, text: bytes) -> int:
    """The same bytes in every line; the column behind them."""
    lines[:, at : at + len(text)] = np.frombuffer(text, np.uint8)
    return at + len(text)


def _put_number(lines: Bytes, at: int, values: Whole, width: int, column: Column) -> int:
    """Sign, whole part, point and decimals; the column behind them."""
    decimals = column.decimals
    lines[:, at] = np.where(values < 0, ord("-"), 0)
    digits = _digits(np.abs(values), width)
    # Leading zeros vanish, but for the one in front of the point.
    leading = width - decimals - 1
    if leading > 0:
        significant = np.logical_or.accumulate(digits[:, :leading] != ord("0"), axis=1)
        digits[:, :leading] *= significant
    at += 1
    lines[:, at : at + width - decimals] = digits[:, : width - decimals]
    at += width - decimals
    if decimals:
        at = _put(lines, at, b".")
        lines[:, at : at + decimals] = digits[:, width - decimals :]
        for left_out in range(1, min(width - column.digits, decimals) + 1):
            too_long = np.abs(values) >= 10 ** (column.digits + left_out - 1)
            lines[too_long, at + decimals - left_out] = 0
    return at + decimals


def _digits(size: Whole, width: int) -> Bytes:
    """The last `width` decimal digits as text, leading zeros included."""
    groups = -(-width // 4)
    out = np.empty((len(size), groups), dtype=np.uint32)
    rest = size.astype(np.uint32) if width <= 9 else size
    for group in range(groups - 1, 0, -1):
        above = rest // 10_000
        out[:, group] = _FOUR_DIGITS[rest - above * 10_000]
        rest = above
    out[:, 0] = _FOUR_DIGITS[rest]
    return out.view(np.uint8)[:, 4 * groups - width :]
