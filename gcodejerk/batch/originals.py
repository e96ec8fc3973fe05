"""Originals of programs that are replaced in place: kept beside them, and put back.

Rule: an original is never lost. A copy that is there already is not written over unless it holds
the same bytes, and only what carries our stamp gives way to it.
"""

from __future__ import annotations

import os
import shutil
from typing import BinaryIO

from gcodejerk.batch.files import is_ours, new_file, open_input, same_content
from gcodejerk.errors import EmitError

SUFFIX = ".orig"


def keep(path: str, source: BinaryIO) -> str:
    """Copy a program that is about to be replaced.

    Parameters
    ----------
    path : str
        The program.
    source : binary file
        What it holds; is left anywhere.

    Returns
    -------
    str
        Name of the copy.

    Raises
    ------
    EmitError
        Another file has that name.
    """
    kept = path + SUFFIX
    if os.path.lexists(kept):
        if os.path.isfile(kept) and same_content(kept, source):
            return kept
        raise EmitError(
            f"{kept} exists and is not this program: an original would be lost",
            "put it back with --revert, or move it elsewhere",
        )
    with new_file(kept, like=path) as copy:
        source.seek(0)
        shutil.copyfileobj(source, copy)
    return kept


def put_back(path: str) -> str:
    """Replace an output by the original that was kept, in one move.

    Parameters
    ----------
    path : str
        The output, with our stamp.

    Returns
    -------
    str
        Name of the copy that it came from, which is gone.

    Raises
    ------
    EmitError
        There is no copy, or the file is not an output of ours, or it cannot be replaced.
    """
    kept = path + SUFFIX
    if not os.path.isfile(kept):
        raise EmitError(
            f"{path}: there is no {kept} to put back",
            "originals are kept by `process --in-place --backup`",
        )
    if os.path.lexists(path) and not is_ours(path):
        raise EmitError(
            f"{path} carries no stamp of gcodejerk: it is not what was made of {kept}",
            f"compare the two; to take the original, move {kept} by hand",
        )
    with open_input(kept) as source, new_file(path, like=kept) as target:
        shutil.copyfileobj(source, target)
    os.unlink(kept)
    return kept
