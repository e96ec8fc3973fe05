"""Where a drilling cycle with a name leaves the tool: ``CYCLE81(RTP, RFP, SDIS, DP, DPR)``.

The cycle goes to the reference plane brought forward by the safety clearance, drills, and comes
back to the retraction plane RTP; behind MCALL it does so behind every block that moves. What G
codes have in force it leaves.

Rule: a call is certain only where all its arguments are numbers that fit together, in the plane XY
of an unturned frame and in millimetres; of what else a control may be given, nothing is known.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Drilling
from gcodejerk.nc.dialects.gcodes import G17, G40
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.text.block import Name

_NUMBER = re.compile(rb"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_Z = 2


def arguments_of(name: Name, rules: Drilling) -> dict[str, float] | None:
    """The arguments of a call by their names, those left out missing; None where one is unknown.

    Parameters
    ----------
    name : Name
        As the block has it.
    rules : Drilling
        The dialect's.
    """
    cycle = rules.named.get(name.name)
    text = name.arguments.strip(b" \t")
    if cycle is None or not (text.startswith(b"(") and text.endswith(b")")):
        return None
    values: dict[str, float] = {}
    for k, argument in enumerate(text[1:-1].split(b",")):
        number = argument.strip(b" \t")
        if not number:
            continue
        if _NUMBER.fullmatch(number) is None:
            return None
        if k < len(cycle.parameters):
            values[cycle.parameters[k]] = float(number)
        elif float(number):
            return None  # planes, technologies, meanings: nothing of it is known
    return values


def certain_call(name: Name, state: State, rules: Drilling) -> tuple[float, bool] | None:
    """Height to which a call comes back, and whether it leaves F alone; None where not certain.

    Parameters
    ----------
    name : Name
        As the block has it.
    state : State
        In force in front of it.
    rules : Drilling
        The dialect's.
    """
    values = arguments_of(name, rules)
    if values is None or not {"RTP", "RFP"} <= values.keys():
        return None
    top, surface, clearance = values["RTP"], values["RFP"], values.get("SDIS", 0.0)
    bottom = surface - values["DPR"] if values.get("DPR") else values.get("DP", surface)
    fits = clearance >= 0.0 and values.get("DPR", 0.0) >= 0.0
    if not fits or top < surface + clearance or not bottom < surface:
        return None
    if state.plane != G17 or state.unit != 1.0 or state.compensation != G40 or state.transformed:
        return None
    return top, rules.named[name.name].keeps_feed


def come_back(state: State, call: tuple[float, bool]) -> None:
    """Leave a hole that was drilled where the tool stands."""
    top, keeps_feed = call
    state.move(_Z, top)
    if not keeps_feed:
        state.put("feed", float("nan"))


def drill_behind(state: State, start: list[float]) -> bool:
    """Behind a block that moves while a modal cycle is in force; whether all of it is certain."""
    call = state.modal_cycle
    turned = {name for name, on in state.transforms.items() if on is not False}
    if call is None or state.motion not in (0, 10) or state.rotated is not False:
        return False
    if turned != {"modal macro"} or state.compensation != G40:
        return False
    end = state.position
    moved = any(a != b and a == a and b == b for a, b in zip(start, end, strict=True))
    if not moved and end[_Z] != call[0]:
        end[_Z] = float("nan")  # whether a way of no length drills, nobody has told
    come_back(state, (call[0] if moved else end[_Z], call[1]))
    return True
