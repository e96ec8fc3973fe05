"""Outputs without a stamp: which files are copies that gcodejerk has written.

Where no rapid was rewritten the output is the program, byte for byte, and nothing in it says whose
it is. This module owns the memory of such outputs, by which a later run may replace one once its
program has changed: a line of hexadecimal digits for each, the digest of its place and of what was
written there, in a file of the user's cache directory.

Rule 1: the same bytes in another place may be the user's only ones, and are not ours.
Rule 2: what is not remembered is not ours. Without the file, or where it cannot be read or written,
everything works, and an output without a stamp is refused as a stranger's.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from pathlib import Path

from gcodejerk.batch.files import SPOOL, new_file
from gcodejerk.errors import GcodejerkError
from gcodejerk.planning.solution_cache import cache_folder

DIGEST = 16
"""BLAKE2b. [bytes]"""
MOST = 1 << 16
"""Lines of the file; beyond them the older half of the copies is forgotten: 2 MB at most."""


def remember_copy(path: str) -> None:
    """Remember that an output without a stamp is ours."""
    place = _file()
    if place is None:
        return
    with contextlib.suppress(OSError, GcodejerkError):
        line = _digest(path) + b"\n"
        place.parent.mkdir(parents=True, exist_ok=True)
        # One write at the end of the file: several runs may do so at a time.
        number = os.open(place, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        try:
            os.write(number, line)
            full = os.fstat(number).st_size > MOST * len(line)
        finally:
            os.close(number)
        if full:
            latest = [*dict.fromkeys(reversed(_known(place)))][: MOST // 2]
            with new_file(str(place), like=str(place)) as file:
                file.write(b"".join(reversed(latest)))


def is_copy(path: str) -> bool:
    """Whether a file holds what was written there as an output without a stamp."""
    place = _file()
    if place is None:
        return False
    with contextlib.suppress(OSError):
        known = _known(place)
        return bool(known) and _digest(path) + b"\n" in known
    return False


def _file() -> Path | None:
    folder = cache_folder()
    return None if folder is None else folder / "copies-1.txt"


def _known(place: Path) -> list[bytes]:
    """The lines of the file, the oldest first; none where there is no file."""
    try:
        text = place.read_bytes()
    except FileNotFoundError:
        return []
    return text.splitlines(keepends=True)


def _digest(path: str) -> bytes:
    digest = hashlib.blake2b(os.fsencode(os.path.realpath(path)) + b"\0", digest_size=DIGEST)
    with open(path, "rb") as file:
        while data := file.read(SPOOL):
            digest.update(data)
    return digest.hexdigest().encode()
