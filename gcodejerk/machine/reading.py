"""The bytes of a file that somebody named, without waiting and without more than are wanted.

Rule: only a file is read. Opening a pipe would wait for whoever writes into it, and a device may
never end.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path


class NotAFileError(OSError):
    """A pipe, a device or a socket."""


def read_file(path: Path, most: int) -> bytes:
    """Read a file from its beginning.

    Parameters
    ----------
    path : Path
        The file.
    most : int
        Bytes to read at most.

    Returns
    -------
    bytes
        The whole file where it is not longer.

    Raises
    ------
    OSError
        It cannot be opened or read; `IsADirectoryError` and `NotAFileError` where it is no file.
    ValueError
        The path holds a NUL.
    """
    with open(path, "rb", opener=_without_waiting) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            raise NotAFileError("is not a file")
        return file.read(most)


def _without_waiting(path: str, flags: int) -> int:
    """Open a pipe, too, at once; it is looked at afterwards, so nothing can take its place."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
