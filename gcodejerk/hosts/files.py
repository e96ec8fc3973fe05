"""Files of ours in the folder of a host: put there, recognised, and taken away again.

Rule: the first line says what a file is and carries the sum of the rest. A file without that line
is somebody else's, one with another sum was edited, one of another host serves that: all are left
alone.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from gcodejerk.batch.files import new_file
from gcodejerk.errors import EmitError
from gcodejerk.hosts.linuxcnc.ini import is_writable

_OWN = re.compile(rb"(?:\W{1,3}|@rem) gcodejerk install ([a-z0-9-]+) sum:([0-9a-f]{16})\n")


def signed(host: str, body: str, comment: str = "#") -> bytes:
    """A file with its first line."""
    data = body.encode()
    return f"{comment} gcodejerk install {host} sum:{_sum(data)}\n".encode() + data


def put(path: Path, data: bytes) -> str:
    """Put a signed file in its place.

    Parameters
    ----------
    path : Path
        Its place; the folder is there.
    data : bytes
        Of `signed`.

    Returns
    -------
    str
        What was done.

    Raises
    ------
    EmitError
        Something else is there, or the folder cannot be written to; nothing was changed.
    """
    old, host = _read(path), _host(data)
    if old == data:
        return f"{path}: is installed already; nothing was changed"
    if old is not None:
        _check_ours(path, old)
        if _host(old) != host:
            raise EmitError(
                f"{path} was installed for {_host(old)}",
                f"put that for {host} into another folder, or take the other one out first",
            )
    if not is_writable(path.parent):
        raise EmitError(f"{path.parent} cannot be written to", "change its permissions")
    with new_file(str(path)) as file:
        file.write(data)
    return f"{path}: {'written' if old is None else 'written anew'}"


def take(path: Path, host: str) -> str | None:
    """Take the signed file of a host away; None where there is none.

    Raises
    ------
    EmitError
        It is not ours, or was edited.
    """
    old = _read(path)
    if old is None or _host(old) not in (host, None):
        return None
    _check_ours(path, old)
    try:
        path.unlink()
    except OSError as error:
        raise EmitError(
            f"{path} cannot be removed: {error.strerror}", "change the folder's permissions"
        ) from error
    return f"{path}: removed"


def _read(path: Path) -> bytes | None:
    """What a file holds, None where there is none."""
    try:
        return path.read_bytes()
    except FileNotFoundError:
        return None
    except OSError as error:
        raise EmitError(f"{path} cannot be read: {error.strerror}", "look at it") from error


def _check_ours(path: Path, data: bytes) -> None:
    """Refuse a file that is not as we wrote it."""
    found = _OWN.match(data)
    if found is None:
        raise EmitError(
            f"{path} exists and was not written by gcodejerk", "rename or remove it first"
        )
    if _sum(data[found.end() :]) != found[2].decode():
        raise EmitError(
            f"{path} was edited after it was installed",
            "keep a copy under another name, then remove it",
        )


def _host(data: bytes) -> str | None:
    """What a file was signed for, None where nobody signed it."""
    found = _OWN.match(data)
    return None if found is None else found[1].decode()


def _sum(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=8).hexdigest()
