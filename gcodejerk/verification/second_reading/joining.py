"""What two states of the second reading have in common, field by field.

Rule: where they differ, nothing is known; what forbids to rewrite may be in force.
"""

from __future__ import annotations

from typing import Any

from gcodejerk.verification.second_reading.reading import NAN


def common(kind: str, mine: Any, theirs: Any) -> Any:
    """What two values of one field have in common."""
    if kind in ("modes", "frames"):
        none = None if kind == "modes" else False
        both = {k: (mine.get(k, none), theirs.get(k, none)) for k in mine.keys() | theirs.keys()}
        return {k: a if a == b else None for k, (a, b) in both.items()}
    if kind == "axes":
        return [a if a == b else NAN for a, b in zip(mine, theirs, strict=True)]
    if kind == "least":
        return {k: min(mine.get(k, v), theirs.get(k, v)) for k, v in (mine | theirs).items()}
    if kind == "table":
        return {k: v for k, v in mine.items() if theirs.get(k) == v}
    if kind == "number":
        return mine if mine == theirs else NAN
    if kind == "ever":
        return mine or theirs
    return None if kind == "mode" and mine != theirs else mine
