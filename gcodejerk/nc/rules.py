"""Which combinations of words the controller accepts.

Rule: when in doubt, not. A block that is wrongly refused here is left alone; one that is wrongly
accepted moves the tool somewhere else than we believe.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from gcodejerk.nc.dialect import ARC_CENTRES, AXES, PLANES, Dialect
from gcodejerk.nc.modal import State

_ARCS = frozenset({20, 30})
_AXIS_USERS = frozenset({100, 280, 300, 520, 920})
"""Codes that take the axis words of the block, so that no motion may be stated beside them."""
_OFF = frozenset({400, None})


@dataclass(slots=True)
class Codes:
    """The words of a block, sorted."""

    g: dict[str, int] = field(default_factory=dict)
    """Modal group -> G code."""
    m: list[int] = field(default_factory=list)
    values: dict[str, float] = field(default_factory=dict)
    """Letter -> number, NaN for an expression; G, M and N left out."""
    unknown: bool = False
    """A code that is computed or that the dialect does not know."""
    fault: bool = False
    """The controller refuses the block."""
    expression: bool = False


def takes_axes(codes: Codes) -> bool:
    """Whether G43.1, or G43.2 without a tool, takes the axis words from the motion."""
    length = codes.g.get("tool length")
    return length == 431 or (length == 432 and "H" not in codes.values)


def is_complete(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether the controller accepts this combination of words."""
    if codes.unknown:
        return True
    values, g = codes.values, codes.g
    motion, user = g.get("motion"), g.get("non-modal")
    axes = any(axis in values for axis in AXES)
    if user in _AXIS_USERS or (axes and takes_axes(codes)):
        if motion not in (None, 800) or (user in (520, 920) and not axes):
            return False
        motion = None
    elif motion is None and (axes or arc_words(values, state)):
        motion = state.motion
        if motion == 800:
            return False
    elif (motion not in (None, 0, 10, 20, 30, 800) and not axes) or (motion == 800 and axes):
        return False
    if user == 530 and not (
        axes
        and motion in (0, 10)
        and state.compensation in _OFF
        and g.get("distance", state.distance) != 910
    ):
        return False
    if values.get("F", 0.0) < 0.0 or values.get("S", 0.0) < 0.0:
        return False
    if motion in _ARCS and not _arc_complete(values, g.get("plane", state.plane)):
        return False
    if (
        motion is not None
        and motion not in (0, 800)
        and (g["feed mode"] == 930 if "feed mode" in g else state.feed_mode == 93)
        and axes
        and "F" not in values
    ):
        return False
    return _words_used(codes, motion, state, dialect)


def _words_used(codes: Codes, motion: int | None, state: State, dialect: Dialect) -> bool:
    """Whether every letter has a code that uses it."""
    in_force = None
    for letter in codes.values:
        users = dialect.uses.get(letter)
        if users is None:
            if letter not in "FSTXYZABCUVW":
                return False
            continue
        if in_force is None:
            used = list(codes.g.values())
            if motion is not None:
                used.append(motion)
            elif state.motion is None:
                return True
            in_force = {f"G{c / 10:g}" for c in used} | {f"M{m}" for m in codes.m}
        if not users & in_force:
            return False
    return True


def arc_words(values: dict[str, float], state: State) -> bool:
    """Whether centre words alone make an arc, one being in force."""
    return state.motion in _ARCS and ("I" in values or "J" in values or "K" in values)


def _arc_complete(values: dict[str, float], plane: int | None) -> bool:
    """Whether an arc has a centre or a radius, and no word of another plane."""
    centres = [letter for letter in "IJK" if letter in values]
    if "R" in values:
        return not centres and (plane is None or any(axis in values for axis in PLANES[plane][:2]))
    if not centres or plane is None:
        return bool(centres)
    allowed = ARC_CENTRES.get(plane)
    return allowed is not None and all(letter in allowed for letter in centres)
