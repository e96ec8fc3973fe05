"""Columns that grow with the program: in memory where they are few, on disk where they are many.

A column on disk is an ordinary array over a mapped temporary file. The file has no name from the
moment it is made, so that it is gone with the process, whatever ends it. What was looked at of it
stays in memory until `release`; so whoever goes through all rows goes window by window.

Rule: nothing depends on where a column is. Where there is no room on the disk, it is in memory.

Blocks of some megabytes that are worked on come and go with every chunk; that they are not given
back to the system in between is seen to here, too.
"""

from __future__ import annotations

import contextlib
import mmap
import tempfile
import weakref
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

MANY = 1 << 15
"""Rows from which a column is on disk."""
AT_ONCE = 1 << 14
"""Rows that are looked at at a time."""

_BLOCK = 1 << 23
# glibc gives a freed block back to the system at once where it is larger than any freed before, and
# what is free at the end of its heap beyond twice that. So each chunk's arrays would be new pages,
# which cost more than most that is done with them. One larger block, freed untouched, teaches it.
np.empty(_BLOCK, dtype=np.uint8)

_maps: weakref.WeakSet[mmap.mmap] = weakref.WeakSet()


def windows(count: int) -> Iterator[slice]:
    """Rows in parts; behind each, what was looked at of columns on disk leaves the memory.

    Examples
    --------
    >>> [(part.start, part.stop) for part in windows(20000)]
    [(0, 16384), (16384, 20000)]
    """
    for begin in range(0, count, AT_ONCE):
        yield slice(begin, min(begin + AT_ONCE, count))
        release()


def release() -> None:
    """Let go of what columns on disk hold in memory; they are read again where they are needed."""
    if not hasattr(mmap, "MADV_DONTNEED"):
        return
    for each in list(_maps):
        with contextlib.suppress(OSError, ValueError):
            each.madvise(mmap.MADV_DONTNEED)


def column(shape: int | tuple[int, ...], fill: Any, dtype: Any = np.float64) -> NDArray[Any]:
    """A column of one value throughout, to be written to.

    Examples
    --------
    >>> column((2, 3), 0.5).tolist()
    [[0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]
    """
    shape = (shape,) if isinstance(shape, int) else shape
    if shape[0] < MANY:
        return np.full(shape, fill, dtype=dtype)
    row = np.full((1, *shape[1:]), fill, dtype=dtype)
    return _stored(lambda part: np.repeat(row, part.stop - part.start, axis=0), shape, row.dtype)


def kept(values: NDArray[Any]) -> NDArray[Any]:
    """The same values, where columns of so many rows are kept; if all rows are one, that once."""
    if len(values) < MANY or not values.strides[0] or _is_mapped(values):
        return values
    return _stored(lambda part: values[part], values.shape, values.dtype)


def gathered(values: NDArray[Any], index: NDArray[np.integer]) -> NDArray[Any]:
    """Rows of a column, as `values[index]`.

    Examples
    --------
    >>> gathered(np.array([5, 7]), np.array([1, 1, 0])).tolist()
    [7, 7, 5]
    """
    if len(index) < MANY:
        out: NDArray[Any] = values[index]
        return out
    shape = (len(index), *values.shape[1:])
    return _stored(lambda part: values[index[part]], shape, values.dtype)


def made(
    part_of: Callable[[slice], NDArray[Any]], shape: tuple[int, ...], dtype: Any = np.float64
) -> NDArray[Any]:
    """A column of which a function makes the rows of each window.

    Examples
    --------
    >>> made(lambda part: np.arange(part.start, part.stop), (3,), np.int64).tolist()
    [0, 1, 2]
    """
    if shape[0] < MANY:
        return np.asarray(part_of(slice(0, shape[0])), dtype=dtype)
    return _stored(part_of, shape, np.dtype(dtype))


class Growing:
    """A column that becomes longer as the program is read.

    Examples
    --------
    >>> rows = Growing(np.int64)
    >>> rows.extend(np.array([4, 5]))
    >>> rows.extend(np.array([6]))
    >>> len(rows), rows.finish().tolist()
    (3, [4, 5, 6])
    """

    def __init__(self, dtype: Any, width: int = 0, once: bool = False) -> None:
        """Begin.

        Parameters
        ----------
        dtype : type
            Of the numbers.
        width : int, optional
            Numbers in a row; 0 for a column of numbers.
        once : bool, optional
            Rows that are all the same to the bit become one row, which cannot be written to.
        """
        self.dtype, self.width, self.once = np.dtype(dtype), width, once
        self._first: NDArray[Any] | None = None
        """The row that all are like so far."""
        self._parts: list[NDArray[Any]] = []
        self._waiting = 0
        self._file: Any = None
        self._count = 0
        """Rows that wait no more."""
        self._in_memory = False

    def __len__(self) -> int:
        return self._count + self._waiting

    def extend(self, values: NDArray[Any]) -> None:
        """Take more rows; they are not written to behind our back."""
        if len(values):
            self._parts.append(np.asarray(values, dtype=self.dtype))
            self._waiting += len(values)
            if self._waiting >= AT_ONCE and len(self) >= MANY and not self._in_memory:
                self._settle()

    def finish(self) -> NDArray[Any]:
        """All rows; nothing is taken any more."""
        if self._count and self._waiting:
            self._settle()
        if self._file is not None:
            with self._file as file:
                return _mapped(file, self._shape(len(self)), self.dtype)
        if self._first is not None:
            return np.broadcast_to(self._first, self._shape(len(self)))
        out = self._joined()
        return alike(out) if self.once else out

    def _shape(self, rows: int) -> tuple[int, ...]:
        return (rows, self.width) if self.width else (rows,)

    def _joined(self) -> NDArray[Any]:
        """The rows that wait."""
        return np.concatenate([np.empty(self._shape(0), self.dtype), *self._parts])

    def _settle(self) -> None:
        """Put the rows that wait where they stay."""
        if self._file is None and self.once and (self._first is not None or not self._count):
            first = self._parts[0][0].copy() if self._first is None else self._first
            self._first = first
            if all(_same_bits(part, first) for part in self._parts):
                self._count += self._waiting
                self._parts, self._waiting = [], 0
                return
        rows = self._parts[0] if len(self._parts) == 1 else self._joined()
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 (lives on)
                for part in windows(self._count):
                    assert self._first is not None
                    shape = self._shape(part.stop - part.start)
                    _write(self._file, np.broadcast_to(self._first, shape))
            self._first = None
            _write(self._file, rows)
        except OSError:
            self._into_memory()
            return
        self._count += len(rows)
        self._parts, self._waiting = [], 0

    def _into_memory(self) -> None:
        """Keep everything in memory, where the disk has no room."""
        earlier = np.empty(self._shape(self._count), self.dtype)
        if self._first is not None:
            earlier[:] = self._first
        elif self._file is not None:
            self._file.seek(0)
            _read(self._file, earlier)
        if self._file is not None:
            self._file.close()
        self._parts, self._waiting = [earlier, *self._parts], len(self)
        self._count, self._first, self._file, self._in_memory = 0, None, None, True


def _is_mapped(values: NDArray[Any]) -> bool:
    """Whether an array is on disk already."""
    base: Any = values
    while isinstance(base, np.ndarray | memoryview):
        base = base.base if isinstance(base, np.ndarray) else base.obj
    return isinstance(base, mmap.mmap)


def _same_bits(rows: NDArray[Any], first: NDArray[Any]) -> bool:
    """Whether all rows are the first to the bit."""
    rows = rows if rows.strides[0] else rows[:1]
    kind = f"u{rows.itemsize}"
    return bool((rows.view(kind) == np.asarray(first).view(kind)).all())


def alike(rows: NDArray[Any]) -> NDArray[Any]:
    """Rows that are all the same to the bit as one row, and no memory for the others."""
    if len(rows) < 2:
        return rows
    first = rows[0].copy()
    return np.broadcast_to(first, rows.shape) if _same_bits(rows, first) else rows


def _stored(
    part_of: Callable[[slice], NDArray[Any]], shape: tuple[int, ...], dtype: np.dtype[Any]
) -> NDArray[Any]:
    """A column from its parts, on disk; in memory where the disk has no room."""
    try:
        with tempfile.TemporaryFile(buffering=0) as file:
            for part in windows(shape[0]):
                _write(file, np.asarray(part_of(part), dtype=dtype))
            return _mapped(file, shape, dtype)
    except OSError:
        out = np.empty(shape, dtype)
        for part in windows(shape[0]):
            out[part] = part_of(part)
        return out


def _write(file: Any, values: NDArray[Any]) -> None:
    """Write all of an array; a file without a buffer may take less at a time."""
    data = np.ascontiguousarray(values).data.cast("B")
    while data:
        data = data[file.write(data) :]


def _read(file: Any, values: NDArray[Any]) -> None:
    """Fill an array with what was written."""
    data = values.data.cast("B")
    while data and (size := file.readinto(data)):
        data = data[size:]


def _mapped(file: Any, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[Any]:
    """What was written to a file as an array; the file lives as long as that does."""
    place = mmap.mmap(file.fileno(), 0)
    _maps.add(place)
    return np.frombuffer(place, dtype=dtype).reshape(shape)
