"""What an INI was before lines of gcodejerk were put into it: kept beside it, gone with the lines.

Rule: a file that is there already may be somebody's own. It is never replaced, and removed only
where the INI is that again, byte for byte.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gcodejerk.batch.files import new_file
from gcodejerk.errors import EmitError

Strip = Callable[[bytes], bytes]
"""Takes out lines of gcodejerk of every kind; may raise `EmitError`."""
HAL, FILTER = ".before-gcodejerk", ".before-gcodejerk-filter"
"""Ends of their names: in front of the HAL forms, and of the filter."""


def backup_of(ini: Path, suffix: str, data: bytes, without_ours: Strip) -> Path:
    """Where the bytes of an INI are kept, or going to be.

    Raises
    ------
    EmitError
        Something else stands there than this INI, be it with lines of gcodejerk or without.
    """
    backup = Path(f"{ini}{suffix}")
    kept = backup.read_bytes() if backup.is_file() else b""
    if backup.exists() and (
        not backup.is_file() or _bare(kept, without_ours) != without_ours(data)
    ):
        raise EmitError(
            f"{backup} exists and is not what would be kept there", "rename or remove it first"
        )
    return backup


def keep(backup: Path, data: bytes) -> None:
    """Keep the bytes of an INI, unless they are."""
    if not backup.exists():
        write(backup, data)


def write(path: Path, data: bytes) -> None:
    """Write a file in one move."""
    with new_file(str(path), like=str(path) if path.exists() else None) as file:
        file.write(data)


def drop_backups(ini: Path, data: bytes, suffix: str, without_ours: Strip) -> list[str]:
    """Remove what is no longer needed, now that lines were taken out.

    Parameters
    ----------
    ini : Path
        The INI.
    data : bytes
        What it holds now.
    suffix : str
        Of what was taken out; the other one goes with the last lines of gcodejerk.
    without_ours : Strip

    Returns
    -------
    list of str
        What was done, for the user.
    """
    now = without_ours(data)
    none_left = now == data
    done = []
    for each in (HAL, FILTER):
        backup = Path(f"{ini}{each}")
        if not backup.is_file() or (each != suffix and not none_left):
            continue
        kept = backup.read_bytes()
        bare = _bare(kept, without_ours)
        if kept == data or (none_left and bare == data):
            backup.unlink()
            done.append(f"{backup}: removed, the INI is that again byte for byte")
        elif each == suffix:
            why = "has other lines of gcodejerk" if bare == now else "was edited since"
            done.append(f"{backup}: kept, the INI {why}")
    return done


def _bare(kept: bytes, without_ours: Strip) -> bytes | None:
    """What is kept, without lines of gcodejerk; None where these are not whole."""
    try:
        return without_ours(kept)
    except EmitError:
        return None
