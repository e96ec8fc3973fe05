"""A folder of subprograms: the texts of what programs call in other files.

Rule: all that the folder holds is read at once, so that a run, its proof and its stamp rest on the
same bytes. Which file a call means, the readers say, each by itself.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from gcodejerk.errors import MachineError, Place

MOST_FILES = 2_000
MOST_BYTES = 2_000_000
"""Of one file."""
MOST_TOGETHER = 64_000_000
"""Of all of them. [B]"""


@dataclass(frozen=True, slots=True)
class Subprograms:
    """The files of a folder, and of the folders in it."""

    folder: str
    """As the user names it."""
    files: Mapping[str, bytes] = field(hash=False, repr=False)
    """Name within the folder, with ``/`` -> its bytes."""
    digest: str = ""
    """Sum of all names and bytes."""


def sum_of(text: bytes) -> str:
    """Sum of one file, as reports name it."""
    return hashlib.blake2b(text, digest_size=8).hexdigest()


def load_subprograms(folder: str, within: Path | None = None) -> Subprograms:
    """Read a folder of subprograms.

    Parameters
    ----------
    folder : str
        Where they are; hidden files are left out.
    within : Path, optional
        Where a relative name begins.

    Raises
    ------
    MachineError
        It is no folder, cannot be read, or holds more than subprograms can be: `MOST_FILES`,
        `MOST_TOGETHER`, and `MOST_BYTES` in each.
    """
    root, place = (within or Path()) / folder, Place(folder)
    if not root.is_dir():
        raise MachineError(
            f"subprograms are to be in {folder!r}, which is no folder",
            "name the folder that holds the control's subprograms",
            place,
        )
    files: dict[str, bytes] = {}
    size, together = 0, hashlib.blake2b(digest_size=8)
    try:
        for path in sorted(path for path in root.rglob("*") if path.is_file()):
            name = path.relative_to(root).as_posix()
            if any(part.startswith(".") for part in path.relative_to(root).parts):
                continue
            if path.stat().st_size > MOST_BYTES:
                # Left out, a smaller file of the same number would be taken for the one called.
                raise MachineError(
                    f"{name!r} in the folder {folder!r} of subprograms has more than "
                    f"{MOST_BYTES // 1_000_000} MB",
                    "name a folder that holds nothing but subprograms",
                    place,
                )
            files[name] = data = path.read_bytes()
            size += len(data)
            together.update(b"%d %d " % (len(name), len(data)) + os.fsencode(name) + data)
            if len(files) > MOST_FILES or size > MOST_TOGETHER:
                raise MachineError(
                    f"folder {folder!r} of subprograms holds more than {MOST_FILES} files or "
                    f"{MOST_TOGETHER // 1_000_000} MB",
                    "name a folder that holds nothing but subprograms",
                    place,
                )
    except OSError as error:
        raise MachineError(
            f"subprograms in {folder!r} cannot be read: {error.strerror}",
            "see whether it is the right folder, and may be read",
            place,
        ) from error
    return Subprograms(folder, files, together.hexdigest())
