"""Solved optima on disk: what has been computed once need not be computed again.

This module owns the cache: one SQLite file in the user's cache directory, a row for each problem
that was solved. SQLite keeps concurrent runs apart and a killed run's rows whole.

Rule 1: a cache is a convenience. Where it cannot be read or written (no disk, no rights, a file
that is something else), everything works without it.
Rule 2: what comes out is data like any other file's: whoever uses it checks it first.
"""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

VERSION = 1
"""Of the file's layout and of the meaning of keys; a new one begins a new file."""
VARIABLE = "GCODEJERK_CACHE"
"""Environment variable: another directory, or nothing at all where it is empty."""
PATIENCE = 10.0
"""Another run's write is waited for [s]."""
MOST_BYTES = 256 << 20
"""A larger file begins anew."""
AT_A_TIME = 500
"""Keys of one query: SQLite allows 999."""


def cache_folder() -> Path | None:
    """The user's cache directory, or None where the user wants none or none can be named."""
    folder = os.environ.get(VARIABLE)
    if folder is None:
        try:
            from platformdirs import user_cache_dir
        except ImportError:
            return None
        folder = user_cache_dir("gcodejerk", appauthor=False)
    return Path(folder) if folder else None


def cache_file() -> Path | None:
    """The file, or None where there is no such directory."""
    folder = cache_folder()
    return None if folder is None else folder / f"solutions-{VERSION}.sqlite"


def read_solutions(keys: Sequence[bytes], file: Path | None) -> dict[bytes, bytes]:
    """What is known of these problems.

    Parameters
    ----------
    keys : sequence of bytes
        Of the problems.
    file : Path or None
        From `cache_file`.

    Returns
    -------
    dict of bytes to bytes
        Solutions of those that are known.
    """
    known: dict[bytes, bytes] = {}
    if file is None or not file.exists():
        return known
    with contextlib.suppress(sqlite3.Error, OSError), _opened(file) as base:
        for begin in range(0, len(keys), AT_A_TIME):
            part = list(keys[begin : begin + AT_A_TIME])
            marks = ",".join("?" * len(part))
            known.update(
                base.execute(f"SELECT key, value FROM solutions WHERE key IN ({marks})", part)
            )
    return known


def write_solutions(solved: Mapping[bytes, bytes], file: Path | None) -> None:
    """Keep solutions for the next run.

    Parameters
    ----------
    solved : mapping of bytes to bytes
        Key and solution.
    file : Path or None
        From `cache_file`.
    """
    if file is None or not solved:
        return
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.exists() and file.stat().st_size > MOST_BYTES:
            file.unlink()
        with _opened(file) as base:
            base.execute(
                "CREATE TABLE IF NOT EXISTS solutions (key BLOB PRIMARY KEY, value BLOB NOT NULL)"
            )
            base.executemany("INSERT OR REPLACE INTO solutions VALUES (?, ?)", solved.items())
    except sqlite3.OperationalError:
        # Locked for too long, or no rights: the next run solves again.
        return
    except sqlite3.DatabaseError:
        # The file is no database, or a broken one. The next run begins anew.
        with contextlib.suppress(OSError):
            file.unlink()
    except OSError:
        return


@contextlib.contextmanager
def _opened(file: Path) -> Iterator[sqlite3.Connection]:
    """The file as a database, one transaction."""
    base = sqlite3.connect(file, timeout=PATIENCE)
    try:
        with base:
            yield base
    finally:
        base.close()
