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
from gcodejerk.nc.dialects.gcodes import G17, G90, G91, G99
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
    elsewhere = state.plane != G17 and code in rules.only_in_xy
    if state.plane is None or elsewhere or code in rules.unknown_ends:
        state.forget_positions()
        state.put("cycle", (code, NAN, NAN))
        state.put("cycle_level", NAN)
        return True
    plane = PLANES[state.plane]
    along = AXES.index(plane[2])
    cycle = _cycle_in_force(state, code, values, rules)
    repeats = _repeats(values, rules)
    beside = any(axis in values for axis in AXES if axis not in plane)
    if cycle is None or repeats <= 0 or beside:
        return False
    if state.cycle is None:
        state.put("cycle_level", state.position[along])
    state.put("cycle", cycle)
    r, bottom = _heights(state, along, cycle)
    if r < bottom:
        return False
    end = _end(state, r, rules)
    for letter in plane[:2]:
        if letter in values:
            _go_to_hole(state, AXES.index(letter), values[letter], repeats)
    state.move(along, end)
    return True


def _repeats(values: Mapping[str, float], rules: Drilling) -> float:
    """How often a block drills; NaN where it is not certain."""
    if any(letter in values for letter in rules.maybe_repeats):
        return NAN
    return next((values[letter] for letter in rules.repeats if letter in values), 1.0)


def _heights(state: State, along: int, cycle: tuple[int, float, float]) -> tuple[float, float]:
    """R and the bottom along the drilling axis, in mm."""
    scale = state.scale(along)
    r, bottom = cycle[2] * scale, cycle[1] * scale
    if along == 0 and state.diameter is not False:
        r = NAN  # X is a diameter; whether R is, too, differs: LinuxCNC takes it as it is
    if state.distance == G91:
        return r + state.cycle_level, r + state.cycle_level + bottom
    return (NAN, NAN) if state.distance is None else (r, bottom)


def _cycle_in_force(
    state: State, code: int, values: Mapping[str, float], rules: Drilling
) -> tuple[int, float, float] | None:
    """Code, depth and R behind a block, which may leave words out; None where it may not."""
    assert state.plane is not None
    along = PLANES[state.plane][2]
    if state.cycle is not None and state.cycle[0] == code:
        _, depth, clearance = state.cycle
    else:
        begins = state.cycle is not None or state.motion not in (code, None)
        if not ("R" in values and along in values) and begins and rules.missing == "error":
            return None
        depth = clearance = NAN  # else in force since somewhere that we could not follow
    return code, values.get(along, depth), values.get("R", clearance)


def _end(state: State, r: float, rules: Drilling) -> float:
    """Where the tool comes back to along the drilling axis: R, or the level of the series."""
    level = state.cycle_level
    # max() with a NaN would return either operand
    above = NAN if level != level or r != r else max(level, r)
    if rules.own_group and not r <= level:
        above = NAN  # not stated: where such a control returns to from an R above its level
    if above != r and state.retract is None:
        return NAN
    return r if state.retract == G99 else above


def _go_to_hole(state: State, axis: int, number: float, repeats: float) -> None:
    """Go to the last hole of a block along one axis of the plane."""
    value = number * state.scale(axis)
    if state.distance == G90:
        state.move(axis, value)
    elif state.distance == G91:
        state.move(axis, state.position[axis] + repeats * value)
    else:
        state.move(axis, NAN)
