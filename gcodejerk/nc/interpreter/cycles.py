"""Where a canned cycle leaves the tool: G73, G74, G76 and G81 to G89.

Rule: only the end matters here; what a cycle does on the way down is told in `cycles.drilling`. As
in LinuxCNC, the tool goes to the hole, then to R, drills to Z, and comes back to R (G99) or to
where the series of cycles began, if that is higher (G98). In G91, R counts from where the series
began, Z from R, and every repeat (L) moves on by the same increments.
"""

from __future__ import annotations

from collections.abc import Mapping

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import PLANES, Drilling
from gcodejerk.nc.interpreter.modal import NAN, State


def begin_cycle(state: State, code: int, values: Mapping[str, float]) -> None:
    """Note a cycle that is stated without a position."""
    if state.cycle is None and state.plane is not None:
        state.put("cycle_level", state.position[AXES.index(PLANES[state.plane][2])])
    state.put("cycle", (code, NAN, values.get("R", NAN)))


def run_cycle(state: State, code: int, values: Mapping[str, float], rules: Drilling) -> bool:
    """Execute one block of a cycle.

    Parameters
    ----------
    state : State
        In force before the block; changed to what is in force behind it.
    code : int
        The cycle, times ten.
    values : mapping of str to float
        The block's numbers by letter.
    rules : Drilling
        The dialect's.

    Returns
    -------
    bool
        Whether the block is complete; False where the controller would refuse it.
    """
    elsewhere = state.plane != 170 and code in rules.only_in_xy
    if state.plane is None or elsewhere or code in rules.unknown_ends:
        state.forget_positions()
        state.put("cycle", (code, NAN, NAN))
        state.put("cycle_level", NAN)
        return True
    plane = PLANES[state.plane]
    first, second, along = (AXES.index(axis) for axis in plane)
    series = state.cycle is not None
    sticky = state.cycle if state.cycle is not None and state.cycle[0] == code else None
    if sticky is None and not ("R" in values and plane[2] in values):
        begins = state.cycle is not None or state.motion not in (code, None)
        if begins and rules.missing == "error":
            return False
        sticky = (code, NAN, NAN)  # in force since somewhere that we could not follow
    depth = values.get(plane[2], sticky[1] if sticky else NAN)
    clearance = values.get("R", sticky[2] if sticky else NAN)
    repeats = next((values[letter] for letter in rules.repeats if letter in values), 1.0)
    if repeats <= 0 or any(axis in values for axis in AXES if axis not in plane):
        return False
    state.put("cycle", (code, depth, clearance))

    if not series:
        state.put("cycle_level", state.position[along])
    level = state.cycle_level
    scale = state.scale(along)
    r, bottom = clearance * scale, depth * scale
    if state.distance == 910:
        r, bottom = r + level, r + level + bottom
    elif state.distance is None:
        r = bottom = NAN
    if r < bottom:
        return False
    # max() with a NaN would return either operand
    above = NAN if level != level or r != r else max(level, r)
    if rules.own_group and not r <= level:
        above = NAN  # not stated: where such a control returns to from an R above its level
    known = above == r or state.retract is not None
    end = NAN if not known else r if state.retract == 990 else above
    for axis in (first, second):
        if AXES[axis] in values:
            value = values[AXES[axis]] * state.scale(axis)
            if state.distance == 900:
                state.move(axis, value)
            elif state.distance == 910:
                state.move(axis, state.position[axis] + repeats * value)
            else:
                state.move(axis, NAN)
    state.move(along, end)
    return True
