"""Files in and out: an output appears in one move, or not at all.

Rule 1: an output is written beside its place under a hidden name, and renamed when it is complete
and verified. Killed at any moment, a run leaves the old file or the new one; at worst a hidden
`.~gcodejerk-` file stays, which nothing reads.
Rule 2: an input is never opened for writing.
Rule 3: whatever the system refuses, in whichever step, becomes an error that names the file.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import secrets
import shutil
import stat
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO

from gcodejerk.errors import EmitError, ProgramError

STANDARD = "-"
"""Name of standard input and output."""
PREFIX = ".~gcodejerk-"
STAMP_WITHIN = 1 << 20
"""A stamp that stands farther from the top is not looked for. [bytes]"""
_STAMP = re.compile(rb"^[(;] ?gcodejerk stamp [0-9]", re.MULTILINE)
_PACKED = b"\x1f\x8b"
_REPORT = re.compile(rb'\s*\{\s*"gcodejerk"\s*:|<!doctype html>\n<!-- gcodejerk report ')
SPOOL = 8 << 20
"""Standard input and output are held in memory up to this size, then on disk."""


@contextlib.contextmanager
def open_input(path: str) -> Iterator[BinaryIO]:
    """Open a program for reading, seekable.

    Parameters
    ----------
    path : str
        A file's name, or `-` for standard input.

    Yields
    ------
    binary file

    Raises
    ------
    ProgramError
        There is no such file, or it cannot be read.
    """
    if path == STANDARD:
        with tempfile.SpooledTemporaryFile(max_size=SPOOL) as spool:
            shutil.copyfileobj(sys.stdin.buffer, spool)
            spool.seek(0)
            yield spool  # type: ignore[misc]
        return
    try:
        raw = _Input(path)
    except FileNotFoundError:
        raise ProgramError(f"there is no file {path}", "check the name and the folder") from None
    except IsADirectoryError:
        raise ProgramError(f"{path} is a folder", "name the program in it") from None
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    with io.BufferedReader(raw) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
            with tempfile.SpooledTemporaryFile(max_size=SPOOL) as spool:
                shutil.copyfileobj(file, spool)
                spool.seek(0)
                yield spool  # type: ignore[misc]
            return
        yield file


@contextlib.contextmanager
def new_file(
    path: str, like: str | None = None, wanted: Callable[[], bool] = lambda: True
) -> Iterator[BinaryIO]:
    """A file that appears under its name when the block ends without an error.

    Parameters
    ----------
    path : str
        Where it is to appear, or `-` for standard output.
    like : str, optional
        A file whose permissions it gets.
    wanted : callable, optional
        Asked at the end: without it the place stays as it is. Not for standard output.

    Yields
    ------
    binary file
        Empty, for writing and reading back.

    Raises
    ------
    EmitError
        It cannot be written: a full disk, a folder that is missing or read-only.
    """
    if path == STANDARD or _is_special(path):
        with tempfile.SpooledTemporaryFile(max_size=SPOOL) as spool:
            yield spool  # type: ignore[misc]
            spool.seek(0)
            _pass_on(spool, path)
        return
    place = _place(path)
    # The name is known before the file is there: interrupted between the two, it is removed, too.
    temporary = place.parent / f"{PREFIX}{secrets.token_hex(8)}"
    try:
        try:
            raw = _Output(temporary, path)
        except (OSError, ValueError) as error:
            raise _unwritable(path, error) from error
        with io.BufferedRandom(raw) as file:
            yield file
            if not wanted():
                return
            file.flush()
            with _naming(path):
                os.fsync(file.fileno())
        with _naming(path):
            os.chmod(temporary, _mode(like))
            os.replace(temporary, place)
    finally:
        with contextlib.suppress(OSError, ValueError):
            os.unlink(temporary)


def _is_special(path: str) -> bool:
    """Whether this is a pipe or a device: it is written to, as only a file can be replaced."""
    try:
        mode = os.stat(path).st_mode
    except (OSError, ValueError):
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _place(path: str) -> Path:
    """Where a file of a name is to be: a link stays a link, and what it points to is replaced."""
    try:
        place = Path(os.path.realpath(path)) if os.path.islink(path) else Path(path)
        mode = place.lstat().st_mode
    except FileNotFoundError:
        return place
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from error
    if stat.S_ISLNK(mode):
        raise EmitError(f"{path} cannot be written: it is a link to itself", "remove the link")
    if stat.S_ISDIR(mode):
        raise EmitError(f"{path} is a folder", "name a file in it (-o), or use --output-dir")
    return place


class _Input(io.FileIO):
    """A file to read from, whose failures are errors of ours."""

    def __init__(self, path: str) -> None:
        super().__init__(path, "rb")
        self.path = path

    def readinto(self, buffer: Any) -> int | None:
        try:
            return super().readinto(buffer)
        except OSError as error:
            raise _unreadable(self.path, error) from error


class _Output(io.FileIO):
    """A new file to write to, whose failures are errors of ours, in the name of its final place."""

    def __init__(self, temporary: Path, path: str) -> None:
        super().__init__(temporary, "x+b", opener=_for_us_alone)
        self.path = path

    def write(self, data: Any) -> Any:
        with _naming(self.path):
            return super().write(data)


def _for_us_alone(path: str, flags: int) -> int:
    """Open a file that nobody else may read before it has its final permissions."""
    return os.open(path, flags, 0o600)


def _unreadable(path: str, error: Exception) -> ProgramError:
    reason = getattr(error, "strerror", None) or error
    return ProgramError(f"{path} cannot be read: {reason}", "check its name and permissions")


def _unwritable(path: str, error: Exception) -> EmitError:
    return EmitError(
        f"{path} cannot be written: {getattr(error, 'strerror', None) or error}",
        "it was left as it was; check the folder, its permissions and the space on the disk",
    )


@contextlib.contextmanager
def _naming(path: str) -> Iterator[None]:
    """Failures of the system in here are about a file."""
    try:
        yield
    except OSError as error:
        raise _unwritable(path, error) from error


def _pass_on(spool: IO[bytes], path: str) -> None:
    """Copy a finished output to standard output, a pipe or a device."""
    if path == STANDARD and sys.__stdout__ is None:  # closed by whoever has called us
        raise EmitError(
            "standard output cannot be written: it is closed", "open it, or name a file (-o FILE)"
        )
    try:
        if path == STANDARD:
            shutil.copyfileobj(spool, sys.stdout.buffer)
            sys.stdout.buffer.flush()
        else:
            with open(path, "wb") as file:
                shutil.copyfileobj(spool, file)
    except BrokenPipeError:
        raise
    except OSError as error:
        name = "standard output" if path == STANDARD else path
        raise EmitError(
            f"{name} cannot be written: {error.strerror}", "what was written of it is incomplete"
        ) from error


def version(path: str) -> tuple[int, ...] | None:
    """What tells one version of a file from the next, None where there is none."""
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return None
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def make_folder(path: str) -> None:
    """Make a folder for outputs, and those above it, where they are missing."""
    try:
        os.makedirs(path, exist_ok=True)
    except (OSError, ValueError) as error:
        raise EmitError(
            f"{path} cannot be made a folder: {getattr(error, 'strerror', None) or error}",
            "choose another --output-dir",
        ) from error


def same_file(one: str, other: str) -> bool:
    """Whether two names are the same file."""
    if STANDARD in (one, other):
        return False
    try:
        return os.path.samefile(one, other)
    except (OSError, ValueError):
        return os.path.abspath(one) == os.path.abspath(other)


def refuse_clashes(outputs: Iterable[str | None], inputs: Iterable[str | None] | None) -> None:
    """Refuse to write over what is read, or twice to one place.

    Parameters
    ----------
    outputs, inputs : iterable of str
        Names of the files of one command; None: nothing is asked for.

    Raises
    ------
    EmitError
        An output is one of the inputs, or another output, under whatever name.
    """
    written: list[str] = []
    read = [name for name in inputs or () if name is not None]
    for name in outputs:
        if name is None:
            continue
        if any(same_file(name, other) for other in read):
            raise EmitError(f"{name} is a file that this command reads", "choose another name")
        if any(name == other or same_file(name, other) for other in written):
            raise EmitError(f"{name} would hold two results", "choose another name for one")
        if not _is_special(name):
            written.append(name)


_ROWS = re.compile(
    rb'(?:(?://|REM|#|!|\() ?gcodejerk \S+ rows for |\{"gcodejerk": "[^"]+", "rows": )',
    re.IGNORECASE,
)


def is_ours(path: str) -> bool:
    """Whether a file carries gcodejerk's stamp, or is a table, or a file of rows or samples."""
    head = _head(path)
    tables = (b"block,t,", b"gcodejerk streams ")
    ours = head.startswith(tables) or _ROWS.match(head) or _STAMP.search(head)
    return bool(ours)


def is_report(path: str) -> bool:
    """Whether a file is a report of gcodejerk's."""
    head = _head(path)
    if head.startswith(_PACKED):
        try:
            head = zlib.decompressobj(wbits=31).decompress(head, len(head))
        except zlib.error:
            return False
    return _REPORT.match(head) is not None


def same_content(path: str, file: BinaryIO) -> bool:
    """Whether a file holds the bytes of an open one; leaves that anywhere."""
    file.seek(0)
    try:
        with open(path, "rb") as other:
            while True:
                one, two = file.read(SPOOL), other.read(SPOOL)
                if one != two:
                    return False
                if not one:
                    return True
    except OSError as error:
        raise _unwritable(path, error) from None


def _head(path: str) -> bytes:
    """The first bytes of an output that is there already."""
    try:
        with open(path, "rb") as file:
            return file.read(STAMP_WITHIN)
    except OSError as error:
        raise _unwritable(path, error) from None


def _mode(like: str | None) -> int:
    """Permissions of a new file: those of another, or what the umask leaves."""
    if like is not None and like != STANDARD:
        with contextlib.suppress(OSError):
            return stat.S_IMODE(os.stat(like).st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask
