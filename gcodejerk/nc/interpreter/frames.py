"""Coordinate frames: G43/G49, G54 to G59.3, G92 and its kin, G52 and G10.

Rule: program = machine - (system + G92 + tool length). A change of one of the three moves no axis
but renames where it stands, by exactly the change; where the change is not known, neither is the
new name.
"""

from __future__ import annotations

from collections.abc import Mapping

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect, Effect
from gcodejerk.nc.dialects.gcodes import G17, G43, G49, G90
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.reasons import Reason

Values = Mapping[str, float]
"""Letter -> value of the words of a block; NaN for an expression."""


def _rename(state: State, field: str, after: list[float]) -> None:
    """Give one of the three offsets new values and every axis its new name."""
    before = getattr(state, field)
    state.put(field, after)
    if any(old != new for old, new in zip(before, after, strict=True)):  # NaN differs from itself
        state.put("cycle_level", NAN)  # where G98 comes back to, under the old name or the new
    for axis, (old, new) in enumerate(zip(before, after, strict=True)):
        if old != new:
            state.move(axis, state.position[axis] + (old - new))


def shift_program(state: State, shift: list[float]) -> None:
    """Shift the frame by so much from the work system, TRANS and its kin. [mm]."""
    before = state.g92
    _rename(state, "g92", shift)
    note_shift(state, before, shift)


def note_shift(state: State, before: list[float], after: list[float]) -> None:
    """Note which axes have not been told an absolute place since the frame was shifted."""
    shifted = [k for k, (old, new) in enumerate(zip(before, after, strict=True)) if old != new]
    if shifted:
        state.put("shifted", {**state.shifted, **{AXES[k]: True for k in shifted}})


def tool_length(
    state: State, code: int, values: Values, lengths: Mapping[int, float], dialect: Dialect
) -> None:
    """G43, G43.1, G43.2 and G49; a code of 0 for a length that nobody knows.

    Parameters
    ----------
    state : State
        Changed.
    code : int
        Times ten.
    values : mapping of str to float
        The block's numbers.
    lengths : mapping of int to float
        H number -> length along Z. [mm]
    dialect : Dialect
        Says which axes a length may shift in G17 (elsewhere, or where the block names another, all
        may), and whether the control itself may move. G49 cancels what any axis has.
    """
    axes = dialect.length_axes
    end_bar(state, "tool data written")
    if state.plane != G17 or any(axis in values for axis in AXES if axis not in axes):
        if axes != AXES:
            lengths = {}  # along which axis, nobody knows
        axes = AXES
    others = [k for k, axis in enumerate(AXES) if axis not in axes]
    kept = [] if code == G49 else [(k, state.tool[k], state.position[k]) for k in others]
    _shift_tool(state, code, values, lengths)
    for k, offset, place in kept:
        state.tool[k] = offset
        state.move(k, place)
    if dialect.length_moves:
        state.forget_positions(k for k in range(len(AXES)) if k not in others)


def _shift_tool(state: State, code: int, values: Values, lengths: Mapping[int, float]) -> None:
    """Shift all axes by a tool length."""
    unknown = [NAN] * len(AXES)
    if code == G49:
        _rename(state, "tool", [0.0] * len(AXES))
    elif code == G43:
        number = values.get("H", NAN)
        length = lengths.get(int(number)) if number == number else None
        # A table may hold offsets of every axis; a length that the user states is all there is.
        after = unknown if length is None else [0.0] * len(AXES)
        if length is not None:
            after[AXES.index("Z")] = length
        _rename(state, "tool", after)
    else:
        _rename(state, "tool", unknown)


def turn_length(state: State) -> None:
    """The tool's length comes to lie along other axes."""
    if any(length != 0.0 for length in state.tool):
        state.lose("tool")
        state.forget_positions()


def turn_spindle(state: State, axes: str = "ABC") -> None:
    """A spindle turns, which may be one of these rotary axes as well."""
    state.forget_positions(AXES.index(axis) for axis in axes)


def numbered_system(number: float) -> int:
    """Key of the system that ``G54.1 P`` selects; 0 for one that nobody knows."""
    return 541_000 + int(number) if number > 0.0 else 0


def system_key(name: str) -> int:
    """Key of a system by its name in a machine file, for example ``G54`` or ``G54.1 P3``."""
    code, _, number = name.upper().partition("P")
    if number:
        return numbered_system(float(number))
    return round(float(code.strip().removeprefix("G")) * 10.0)


def select_system(state: State, code: int) -> None:
    """G54 to G59.3, and those with a number."""
    end_bar(state, "offsets written")
    if state.system == code and code:
        return
    state.put("system", code)
    if state.rotates:
        state.put("rotated", None)
        state.forget_positions()
    _rename(state, "g5x", state.offsets.get(code, [NAN] * len(AXES)))


def end_bar(state: State, name: str) -> None:
    """End one of `State.bars`, if it was there."""
    if name in state.bars:
        state.put("bars", {**state.bars, name: False})


def data_written(state: State, lengths: dict[int, float]) -> None:
    """Offsets or tool data of the control have been written, nobody knows which.

    When they take effect differs: at once, in the next block, where a work system is selected. So
    what absolute words say is not certain before one is, nor before a tool length is.
    """
    lengths.clear()
    state.offsets = {}
    state.lose("home")
    state.put("system", None)
    state.forget_frame()
    state.forget_positions()
    state.put("bars", {**state.bars, "offsets written": True, "tool data written": True})


_OFFSETS, _TOOLS = frozenset({2.0, 20.0}), frozenset({1.0, 3.0, 10.0, 11.0, 12.0, 13.0})
"""L of G10 for data of work systems, and of tools (Fanuc, Haas; Mach has 1 and 2 of these)."""


def write_data(state: State, lengths: dict[int, float], values: Values) -> None:
    """G10 with an L: offsets, tool data, or parameters, which may change everything."""
    kind = values.get("L", NAN)
    data_written(state, lengths)
    if kind in _OFFSETS:
        end_bar(state, "tool data written")
    elif "L" in values and kind not in _TOOLS:
        state.forget(Reason.SYSTEM_WRITTEN)
        state.put("bars", {**state.bars, "parameters written": True})


def change(state: State, effect: Effect, values: Values, lengths: dict[int, float]) -> None:
    """Do what a non-modal code does to the frames: G28.1, G92.1 and its kin, G52, G10."""
    if effect == "store":
        state.lose("home")
    elif effect == "clear":
        _rename(state, "g92", [0.0] * len(AXES))
    elif effect == "restore":
        _rename(state, "g92", [NAN] * len(AXES))
    elif effect == "local":
        _set_local(state, values)
    elif effect == "table":
        _write_table(state, values, lengths)


def set_names(state: State, codes: Codes, dialect: Dialect) -> None:
    """G92: the axis words are the new names of where the axes stand.

    What increments mean beside it (G50 U5., G91 G92 X5.) is not known but where the table says so:
    then where the axes stand has no name any more.
    """
    values: Values = codes.values
    if not values and not codes.increments:
        if dialect.bare_set == "zero":
            values = dict.fromkeys(dialect.set_letters, 0.0)
        elif dialect.bare_set == "unknown":
            state.forget_positions()
            state.lose("g92")
    after = list(state.g92)
    state.put("cycle_level", NAN)
    unknown = state.distance != G90 and not dialect.incremental_set
    for axis, letter in enumerate(AXES):
        if letter in codes.increments or (unknown and letter in values):
            after[axis] = NAN
            state.move(axis, NAN)
        elif letter in values:
            named = values[letter] * state.scale(axis)
            after[axis] += state.position[axis] - named
            state.move(axis, named)
    state.put("g92", after)
    if dialect.shift_may_end:
        for name in ("system", "g5x", "g92"):
            state.lose(name)  # the next system that is selected may leave the names as they are
    if state.rotates or state.transforms:
        state.forget_positions()


def _set_local(state: State, values: Values) -> None:
    """G52: an offset given outright, kept where G92 keeps its own."""
    after = list(state.g92)
    for axis, letter in enumerate(AXES):
        if letter in values:
            after[axis] = values[letter] * state.scale(axis)
            if state.g92[axis] != state.g92[axis]:
                state.move(axis, NAN)
    _rename(state, "g92", after)
    if state.rotates:
        state.forget_positions()


def _write_table(state: State, values: Values, lengths: dict[int, float]) -> None:
    """G10: data of a tool or of a coordinate system."""
    kind, number = values.get("L", NAN), values.get("P", NAN)
    if kind in (1, 10, 11):
        lengths.clear()
        return
    code = 530 + int(number) * 10 if 1 <= number <= 6 else 584 + int(number) if number >= 7 else 0
    if code:
        state.offsets.pop(code, None)
    else:
        state.offsets = {}
    if code and state.system is not None and code != state.system:
        if "R" in values:
            state.put("rotates", True)
        return
    # What a variable has been set to is taken over, too, of every axis.
    state.put("g5x", [NAN] * len(AXES))
    state.forget_positions(
        range(len(AXES))
        if "R" in values or state.rotates or kind not in (2, 20)
        else [axis for axis, letter in enumerate(AXES) if letter in values]
    )
    if "R" in values:
        state.put("rotates", True)
        state.put("rotated", False if values["R"] == 0 and kind == 2 else None)
    elif state.rotates:
        state.put("rotated", None)
