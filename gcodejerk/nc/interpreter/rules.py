"""Which combinations of words the controller accepts.

Rule: when in doubt, not. A block that is wrongly refused here is left alone; one that is wrongly
accepted moves the tool somewhere else than we believe.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import ARC_CENTRES, PLANES, Dialect
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import State

_AXIS_USERS = frozenset({"return", "table", "local", "set"})
"""Effects that take the axis words of the block, so that no motion may be stated beside them."""
_OFF = frozenset({400, None})


def takes_axes(codes: Codes) -> bool:
    """Whether G43.1, or G43.2 without a tool, takes the axis words from the motion."""
    length = codes.g.get("tool length")
    return length == 431 or (length == 432 and "H" not in codes.values)


def is_complete(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether the controller accepts this combination of words."""
    if codes.unknown:
        return True
    values, g = codes.values, codes.g
    if values.get("F", 0.0) < 0.0 or values.get("S", 0.0) < 0.0:
        return False
    axes = bool(codes.moved())
    if dialect.strict:
        motion = _strict_motion(codes, state, dialect, axes)
        if motion is None:
            return False
        if motion < 0:
            motion = None
    else:
        # The block of a dwell, or of a return, may name a motion that it does not make.
        taken = any(dialect.effect(code) in ("words", "return", "set") for code in g.values())
        motion = None if taken else g.get("motion", state.motion)
        if dialect.effect(g.get("non-modal")) == "machine" and axes and motion not in (0, 10):
            return False
    drawn = dialect.strict or axes or arc_words(values, state)
    plane = g.get("plane", state.plane) if dialect.centres_of_plane else None
    if motion in dialect.arcs and drawn and not _arc_complete(values, plane):
        return False
    inverse = (
        dialect.feed_modes.get(g["feed mode"]) == 93 if "feed mode" in g else state.feed_mode == 93
    )
    if motion not in (None, 0, 800) and inverse and axes and "F" not in values:
        return False
    return _words_used(codes, motion, state, dialect)


def _strict_motion(codes: Codes, state: State, dialect: Dialect, axes: bool) -> int | None:
    """Motion code that the block's axis words are for, -1 for none, None where it is refused."""
    values, g = codes.values, codes.g
    motion, effect = g.get("motion"), dialect.effect(g.get("non-modal"))
    if effect in _AXIS_USERS or (axes and takes_axes(codes)):
        if motion not in (None, 800) or (effect in ("local", "set") and not axes):
            return None
        motion = None
    elif motion is None and (axes or arc_words(values, state)):
        motion = state.motion
        if motion == 800:
            return None
    elif (motion not in (None, 0, 10, *dialect.arcs, 800) and not axes) or (motion == 800 and axes):
        return None
    if effect == "machine" and not (
        axes
        and motion in (0, 10)
        and state.compensation in _OFF
        and g.get("distance", state.distance) != 910
    ):
        return None
    return -1 if motion is None else motion


def _words_used(codes: Codes, motion: int | None, state: State, dialect: Dialect) -> bool:
    """Whether every letter has a code that uses it."""
    in_force = None
    for letter in codes.values:
        if letter not in dialect.letters:
            return False
        users = dialect.uses.get(letter)
        if users is None:
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
    return state.motion in (20, 30) and ("I" in values or "J" in values or "K" in values)


def _arc_complete(values: dict[str, float], plane: int | None) -> bool:
    """Whether an arc has a centre or a radius, and no word of another plane, if that is given."""
    centres = [letter for letter in "IJK" if letter in values]
    if "R" in values:
        return not centres and (
            plane not in PLANES or any(axis in values for axis in PLANES[plane][:2])
        )
    if not centres or plane is None:
        return bool(centres)
    allowed = ARC_CENTRES.get(plane)
    return allowed is not None and all(letter in allowed for letter in centres)
