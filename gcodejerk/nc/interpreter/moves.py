"""Where a straight move leads, and a return: the axis words of a block become positions.

Rule: a rotary axis goes the way that the machine file says; where it says none, the position is
known and the way is not.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LINEAR, PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import G28, G91
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.eligibility import Step
from gcodejerk.nc.interpreter.modal import NAN, State


def go_straight(state: State, codes: Codes, step: Step) -> None:
    """Go to where the axis words say."""
    values = codes.values
    for axis, letter in enumerate(AXES):
        if letter in codes.increments:
            by = codes.increments[letter] * state.scale(axis)
            state.move(axis, state.position[axis] + by)
        elif letter in values:
            value = values[letter] * state.scale(axis)
            function = codes.functions.get(letter)
            if function == "IC" or (function is None and state.distance == G91):
                value = _before_increment(state, axis) + value
            elif function in (None, "AC") and (function or state.distance is not None):
                if letter not in LINEAR:
                    value = _turn(state, axis, value, step)
                if letter in state.shifted:
                    state.put("shifted", {**state.shifted, letter: False})
            else:
                value = NAN  # the shortest way, or this way round: the machine decides
            state.move(axis, value)
    if "scaling" in codes.g:
        # Beside G51 they are its centre; beside G50 no manual has any.
        state.forget_positions(AXES.index(axis) for axis in codes.moved())


def _before_increment(state: State, axis: int) -> float:
    """Where an increment counts from: it may travel a shift of the frame, too, or not."""
    shifted = state.shifted.get(AXES[axis], False)
    return state.position[axis] if shifted is False else NAN


def _turn(state: State, axis: int, angle: float, step: Step) -> float:
    """Where a rotary axis stands behind an absolute word."""
    stands = state.position[axis]
    wrap = state.wraps[axis]
    step.way_unknown |= wrap is None and stands != angle
    if wrap == "none":
        return angle
    if wrap is None:
        # By its sign alone, some controls go backwards, to the positive angle.
        return NAN if math.copysign(1.0, angle) < 0.0 else angle
    end = way_round(stands, angle, wrap)
    step.way_unknown |= end != end
    step.turned |= _turns(stands, angle, end, wrap) << axis
    return end


def _turns(stands: float, angle: float, end: float, wrap: str) -> bool:
    """Whether the word alone does not say which way an axis goes that counts turns."""
    moves = end != stands and (wrap == "sign" or not 0.0 <= stands < 360.0)
    return moves or end != angle


def turn_by_turn(
    stands: float, angles: NDArray[np.float64], wrap: str | None
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Where a rotary axis stands behind each of many absolute words, as `go_straight` has it.

    Parameters
    ----------
    stands : float
        Where it stands in front of them. [deg]
    angles : ndarray, shape (n,)
        What they say. [deg]
    wrap : str or None
        ``shortest`` or ``sign`` (`way_round`); None: nobody says which way it goes.

    Returns
    -------
    ends : ndarray, shape (n,)
        NaN where nobody knows. [deg]
    turned : ndarray of bool, shape (n,)
        The word alone does not say which way.
    """
    if wrap is None:
        return np.where(np.signbit(angles), NAN, angles), np.zeros(len(angles), dtype=bool)
    ends, turned = np.empty(len(angles)), np.empty(len(angles), dtype=bool)
    for k, angle in enumerate(angles.tolist()):
        ends[k] = end = way_round(stands, angle, wrap)
        turned[k] = _turns(stands, angle, end, wrap)
        stands = end
    return ends, turned


def go_to_machine_position(state: State, values: dict[str, float], dialect: Dialect) -> None:
    """G53: the axis words are machine coordinates."""
    if dialect.tool_cancelled_by_return != "no":
        lose_tool_length(state, [k for k, axis in enumerate(AXES) if axis in values])
    for axis, letter in enumerate(AXES):
        if letter in values:
            at = _named_place(state, axis, values[letter] * state.scale(axis))
            state.move(axis, NAN if state.distance == G91 else at)
    if state.transformed:
        state.forget_positions(range(2))  # one axis of the machine is both of a turned frame


def go_to_stored_point(state: State, codes: Codes, dialect: Dialect) -> None:
    """G28 and G30: to a stored point that the program does not tell, but the machine file may."""
    named = codes.moved() or AXES
    state.put("cycle_level", NAN)
    if dialect.tool_cancelled_by_return != "no":
        every = dialect.tool_cancelled_by_return == "all"
        lose_tool_length(state, [k for k, axis in enumerate(AXES) if every or axis in named])
    known = codes.g.get("non-modal") == G28 and (codes.moved() or dialect.bare_return)
    home = state.home if known else [NAN] * len(AXES)
    for axis, letter in enumerate(AXES):
        if letter in named:
            state.move(axis, _named_place(state, axis, home[axis]))
    if state.transformed:
        state.forget_positions()


def _named_place(state: State, axis: int, machine: float) -> float:
    """The name of a machine coordinate; of an axis that counts turns, it says the angle alone."""
    turns = AXES[axis] not in LINEAR and state.wraps[axis] in ("shortest", "sign")
    return NAN if turns else machine - state.shifts()[axis]


def lose_tool_length(state: State, axes: Iterable[int] = range(len(AXES))) -> None:
    """Forget the tool length along these axes, and where those stand that it may shift."""
    shifted = [axis for axis in axes if state.tool[axis] != 0.0]
    state.put("tool", [NAN if k in shifted else length for k, length in enumerate(state.tool)])
    state.forget_positions(shifted)


def change_tool(state: State, places: Mapping[str, float] | None) -> None:
    """M6: the axes go to where the machine file says that tools are changed, or who knows where.

    Parameters
    ----------
    state : State
        Changed.
    places : mapping of str to float, or None
        Axis -> where it stands behind M6, in machine coordinates; the others have not moved. None:
        not known of any. [mm, deg]
    """
    if places is None or state.transformed:
        state.forget_positions()
        return
    for letter, place in places.items():
        axis = AXES.index(letter)
        state.move(axis, _named_place(state, axis, place))


def plane_axes(state: State) -> list[int]:
    """List the axes that cutter compensation may displace."""
    plane = state.plane
    # Heidenhain's G20 is a plane that nothing here knows.
    letters = PLANES[plane][:2] if plane in PLANES else "XYZUVW"
    return [AXES.index(letter) for letter in letters]


def displace(state: State, codes: Codes) -> None:
    """Note where a compensated move leads by the program; where it does, the tool's radius says."""
    axes = plane_axes(state)
    named = {AXES.index(axis) for axis in codes.moved()}
    meant = list(state.meant)
    for axis in named.intersection(axes):
        meant[axis] = state.position[axis]
    state.put("meant", meant)
    state.forget_positions(axes)


def leaves_offset(state: State, codes: Codes) -> bool:
    """Whether a straight move has a length in the plane: one without leaves G40 as it is."""
    for axis in plane_axes(state):
        letter = AXES[axis]
        if letter in codes.increments or (letter in codes.values and state.distance == G91):
            by = codes.increments.get(letter, codes.values.get(letter, 0.0))
            if by != 0.0:
                return True
        elif letter in codes.values and state.position[axis] != state.meant[axis]:
            return True
    return False


def way_round(stands: float, angle: float, wrap: str) -> float:
    """Where a rotary axis ends that counts turns, behind an absolute word.

    Parameters
    ----------
    stands : float
        Where it stands. [deg]
    angle : float
        What the word says. [deg]
    wrap : str
        ``shortest``, or ``sign``: LinuxCNC's WRAPPED_ROTARY, which goes forwards to a positive
        number and backwards to a negative one (interp_convert.cc, unwrap_rotary).

    Returns
    -------
    float
        NaN where half a turn has no shorter way round, where the last digit decides between no
        turn and a whole one, or where the number is not an angle. [deg]
    """
    if stands != stands:
        # Somewhere on this angle; how many turns have been counted, nobody knows.
        return angle if wrap == "shortest" else NAN
    if wrap == "shortest":
        way = (angle - stands + 180.0) % 360.0 - 180.0
        if abs(abs(way) - 180.0) < 1e-6:
            return NAN
        return angle if abs(stands + way - angle) < 1e-9 else stands + way
    if abs(angle) >= 360.0:
        return NAN
    backwards = math.copysign(1.0, angle) < 0.0
    end = abs(angle) + math.floor(stands / 360.0) * 360.0
    if end != stands and abs(math.remainder(end - stands, 360.0)) < 1e-6:
        return NAN
    if backwards and end > stands:
        return end - 360.0
    return end + 360.0 if not backwards and end < stands else end
