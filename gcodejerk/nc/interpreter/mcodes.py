"""M codes: the spindle, tool changes, builders' programs, saved modes, calls that are not followed.

Rule: what a program of somebody else's does is not known; what those for tool changes are known to
leave changed is forgotten.
"""

from __future__ import annotations

from collections.abc import Mapping

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.gcodes import G91
from gcodejerk.nc.interpreter.eligibility import Step
from gcodejerk.nc.interpreter.frames import turn_spindle
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.moves import change_tool, lose_tool_length
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.variables import forget_shared

_CALLS = frozenset({46, 47, 96, 97, 98, 198})
"""M codes that go on elsewhere, or may, besides those of the group "macro"."""


def run_m_code(
    state: State,
    m: int,
    dialect: Dialect,
    step: Step,
    tool_change: Mapping[str, float] | None,
) -> bool:
    """Execute an M code, the end of the program and stops excepted.

    Parameters
    ----------
    state : State
        Changed.
    m : int
        The code.
    dialect : Dialect
        Of the program.
    step : Step
        What the block did so far.
    tool_change : mapping of str to float, or None
        Axis -> where it stands behind M6, in machine coordinates; None where that is not known.
        [mm, deg]

    Returns
    -------
    bool
        Whether programs run that are not followed.
    """
    group = dialect.m_groups.get(m)
    if m in (3, 4, 5) and group == "spindle":
        state.put("spindle", m)
    if group == "spindle":
        turn_spindle(state, dialect.spindle_turns)
    if group is None or m == 6 or group == "user":
        # A tool change may go anywhere, and so may a program of the user's.
        forget_shared(state, dialect.arithmetic)
        if dialect.other_m == "positions" or f"M{m}" in dialect.refused or dialect.macro_change:
            _behind_macro(state)
        change_tool(state, tool_change if m == 6 and group is not None else None)
    elif m in (70, 72, 73) and group == "state":
        step.feed_event = USES_FEED  # M70 and M73 keep F and the modes
        if m == 73:
            state.put("restores", True)  # where the subprogram ends
        elif m == 72:
            state.forget_modes()
            state.forget_positions()
    return group == "macro" or (group is not None and m in _CALLS and step.call is None)


def _behind_macro(state: State) -> None:
    """Forget what a builder's macro is known to leave changed.

    It retracts with G91 G28 and ends in G90, and it cancels the tool length. Were it to leave
    G91, G1 or another work system behind, no program would run on such a machine.
    """
    lose_tool_length(state)
    if state.cycle is not None:
        state.lose("cycle")
    if state.distance == G91 and "distance" not in state.fixed:
        state.lose("distance")
