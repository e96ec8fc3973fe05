"""Which combinations of words the controller accepts.

Rule: when in doubt, not. A block that is wrongly refused here is left alone; one that is wrongly
accepted moves the tool somewhere else than we believe.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import ARC_CENTRES, PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import G4, G40, G80, G91
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import State

AXIS_USERS = frozenset({"return", "table", "local", "set"})
"""Effects that take the axis words of the block, so that no motion may be stated beside them."""
_OFF = frozenset({G40, None})
_OF_NO_MOTION = frozenset("FSTD")
_REFUSED = -1
"""In the place of a motion code: the control refuses the block."""


def takes_axes(codes: Codes) -> bool:
    """Whether G43.1, or G43.2 without a tool, takes the axis words from the motion."""
    length = codes.g.get("tool length")
    return length == 431 or (length == 432 and "H" not in codes.values)


def is_complete(codes: Codes, state: State, dialect: Dialect) -> bool:
    """Whether the controller accepts this combination of words."""
    if codes.unknown:
        return True
    values, g = codes.values, codes.g
    if _too_small(codes, dialect):
        return False
    motion = (_strict_motion if dialect.strict else _lenient_motion)(codes, state, dialect)
    if motion == _REFUSED:
        return False
    axes = bool(codes.moved())
    if motion in dialect.arcs and (dialect.strict or axes or arc_words(values, state)):
        plane = g.get("plane", state.plane) if dialect.centres_of_plane else None
        if not _arc_complete(values, plane):
            return False
    mode = dialect.feed_modes.get(g["feed mode"]) if "feed mode" in g else state.feed_mode
    if mode == 93 and motion not in (None, 0, G80) and axes and "F" not in values:
        return False
    return _cartesian(codes, motion, dialect) and _words_used(codes, motion, dialect)


def takes_twice(codes: Codes, dialect: Dialect) -> bool:
    """Whether a motion is stated beside what takes its axis words.

    FluidNC runs ``G92 G0 X1``, and moves all axes to where nobody says (gc_execute_line).
    """
    taken = dialect.effect(codes.g.get("non-modal")) in AXIS_USERS or takes_axes(codes)
    return taken and codes.g.get("motion") not in (None, G80)


def counts_as_feed(codes: Codes, dialect: Dialect, *, taken: bool) -> bool | None:
    """Whether the F of a block is the feed from there on; None: on some controls.

    Parameters
    ----------
    codes : Codes
        Of a block with an F.
    dialect : Dialect
        Of the program.
    taken : bool
        Something else than a motion takes the words of the block for itself: a dwell, a command.
    """
    motion = codes.g.get("motion")
    if dialect.one_command and not codes.g and not codes.m:
        # It may be a line of the motion before, as on Marlin with GCODE_MOTION_MODES.
        return None if dialect.feed_of_moves else False
    if taken:
        # Beside a dwell it is a time; else a feed, or for what takes the other words.
        return False if dialect.one_command or codes.g.get("non-modal") == G4 else None
    if not dialect.feed_of_moves or motion is None:
        return not dialect.feed_of_moves
    # A control that does not know the code passes its F over, too.
    return None if motion in dialect.redrawn else True


def _too_small(codes: Codes, dialect: Dialect) -> bool:
    """Whether F, S or T is less than the control takes."""
    still = dialect.feed_of_moves and "motion" in codes.g and codes.values.get("F") == 0.0
    return still or any(codes.values.get(letter, 0.0) < 0.0 for letter in "FST")


def _lenient_motion(codes: Codes, state: State, dialect: Dialect) -> int | None:
    """Motion code that the axis words are for on a control that is not strict; None for none."""
    effects = {dialect.effect(code) for code in codes.g.values()}
    # The block of a dwell, or of a return, may name a motion that it does not make.
    taken = not effects.isdisjoint(("words", "return", "set"))
    motion = None if taken else codes.g.get("motion", state.motion)
    machine = dialect.effect(codes.g.get("non-modal")) == "machine"
    return _REFUSED if machine and codes.moved() and motion not in (0, 10) else motion


def _strict_motion(codes: Codes, state: State, dialect: Dialect) -> int | None:
    """Motion code that the axis words are for on a strict control; None for none."""
    motion, axes = codes.g.get("motion"), bool(codes.moved())
    effect = dialect.effect(codes.g.get("non-modal"))
    if effect in AXIS_USERS or (axes and takes_axes(codes)):
        bare = effect in ("local", "set") and not axes
        motion = _REFUSED if bare or motion not in (None, G80) else None
    elif motion is None and (axes or arc_words(codes.values, state)):
        motion = _REFUSED if state.motion == G80 else state.motion
    elif motion == G80:
        motion = _REFUSED if axes else motion
    elif motion not in (None, 0, 10, *dialect.arcs) and not axes:
        motion = _REFUSED
    if effect == "machine" and not (axes and _takes_machine_position(codes, motion, state)):
        return _REFUSED
    return motion


def _takes_machine_position(codes: Codes, motion: int | None, state: State) -> bool:
    """Whether G53 may stand beside this motion, in these modes."""
    absolute = codes.g.get("distance", state.distance) != G91
    return motion in (0, 10) and state.compensation in _OFF and absolute


def _cartesian(codes: Codes, motion: int | None, dialect: Dialect) -> bool:
    """Whether axis words alone say where the block leads; a cycle has its words for itself."""
    if "cycle" in codes.g:
        return True
    radius = dialect.polar[-1:] if motion in dialect.arcs and codes.moved() else ""
    return not any(letter in codes.values and letter != radius for letter in dialect.polar)


def _words_used(codes: Codes, motion: int | None, dialect: Dialect) -> bool:
    """Whether every letter has a code that uses it, of those that are certainly in force."""
    in_force = None
    sets = dialect.set_letters and dialect.effect(codes.g.get("non-modal")) == "set"
    if sets and not codes.values.keys() <= set(dialect.set_letters):
        return False
    for letter in codes.values:
        if letter == "P" and codes.names and letter not in dialect.letters:
            continue  # NAME P3: called three times
        if letter not in dialect.letters:
            return False
        users = dialect.uses.get(letter)
        if users is None:
            continue
        if in_force is None:
            used = list(codes.g.values())
            if motion is not None:
                used.append(motion)
            in_force = {f"G{c / 10:g}" for c in used} | {f"M{m}" for m in codes.m}
        if not users & in_force:
            return False
    return True


def arc_words(values: dict[str, float], state: State) -> bool:
    """Whether centre words alone make an arc, one being in force."""
    return state.motion in (20, 30) and ("I" in values or "J" in values or "K" in values)


def moves_without_axes(g: dict[str, int], values: dict[str, float]) -> bool:
    """Whether a motion that is redrawn may run: ``G11 R30 H20`` in polar words names no axis."""
    return "motion" in g or not _OF_NO_MOTION.issuperset(values)


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
