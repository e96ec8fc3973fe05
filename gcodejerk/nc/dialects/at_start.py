"""The codes that a control starts with (`program.startup`), as readings of several take them.

The machine file states what its own control starts with. A program that could be of several is read
as what they read alike, and some of them lack a code that another starts with: G64 of LinuxCNC, G80
and G98 of Fanuc. This module owns how such a reading takes them.

Rule 1: that there are controls which refuse a code says nothing against a control that starts with
it. So none is refused for that (`dialect_at_start`).
Rule 2: what the reading does not have is left out where nothing is then known that is not so
(`Dialect.left_at_start`). What would hold something else (G95, G90.1) is left to whoever runs the
codes, and refused there.
"""

from __future__ import annotations

import re
from dataclasses import replace

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.refusals import Refusals

_WORD = re.compile(r"([A-Za-z])([+-]?[0-9.]+)")


def dialect_at_start(dialect: Dialect) -> Dialect:
    """The dialect in which the codes are run."""
    return replace(dialect, refused=frozenset(), refuses=Refusals(), feed_needed=False)


def codes_at_start(startup: str, dialect: Dialect) -> tuple[str, str]:
    """Which of a control's codes a reading takes, and which it leaves out.

    Parameters
    ----------
    startup : str
        Words, as `Start.startup` has them.
    dialect : Dialect
        How the program is read.

    Returns
    -------
    taken, left_out : str
        The words of either, in their order; all are taken where the dialect is one control's own.

    Examples
    --------
    >>> from gcodejerk.nc.dialects import find_dialect
    >>> codes_at_start("G21 G64 P0.01 G80 G90", find_dialect("any-mill"))
    ('G21 G64 P0.01 G90', 'G80')
    """
    if not dialect.left_at_start:
        return startup, ""
    words = [(letter.upper(), number) for letter, number in _WORD.findall(startup)]
    left_out = [word for word in words if f"{word[0]}{float(word[1]):g}" in dialect.left_at_start]
    taken = [word for word in words if word not in left_out]
    return " ".join(map("".join, taken)), " ".join(map("".join, left_out))
