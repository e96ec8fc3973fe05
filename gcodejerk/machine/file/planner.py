"""Which profile the control's own rapids follow: as the file states it, or as the control has it.

Rule: what the file states stands. A control that has no jerk limit cannot follow a `rapid.jerk`;
then the file contradicts itself, which is told at the jerk: nobody but the user knows whether the
number or the name of the control is wrong.
"""

from __future__ import annotations

from typing import Any

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError
from gcodejerk.machine.file.checker import Checker
from gcodejerk.machine.parts import BELL, JERK_LIMITED, LINUXCNC, TRAPEZOIDAL

WITHOUT_JERK = {
    "linuxcnc": (LINUXCNC, "LinuxCNC 2.9"),
    "linuxcnc-hal": (LINUXCNC, "LinuxCNC 2.9"),
    "grbl": (TRAPEZOIDAL, "grbl"),
}
"""Controls whose G0 has no jerk limit: their profile, and what messages call them."""


def choose_planners(values: dict[str, Any], checker: Checker) -> dict[str, str]:
    """The profile of each axis; refuses profiles that do not fit together or lack their jerk.

    Parameters
    ----------
    values : dict
        Of the whole file.
    checker : Checker
        Takes what is wrong.

    Returns
    -------
    dict of str to str
        Axis -> one of `PLANNERS`.
    """
    rapids = {a: axis["rapid"] for a, axis in values.get("axes", {}).items() if "rapid" in axis}
    stated = {a: rapid["planner"] for a, rapid in rapids.items() if "planner" in rapid}
    default = _default(values, rapids, stated, checker)
    chosen = {
        a: stated.get(a, default or (JERK_LIMITED if "jerk" in rapid else TRAPEZOIDAL))
        for a, rapid in rapids.items()
    }
    for a in stated:
        if chosen[a] in (JERK_LIMITED, BELL) and "jerk" not in rapids[a]:
            checker.problems.add(
                checker.place(("axes", a, "rapid", "planner")),
                f"axes.{a}.rapid.planner is {chosen[a]!r}, which needs axes.{a}.rapid.jerk",
                "add the jerk, or say planner: trapezoidal",
            )
    _check_alike(rapids, stated, checker)
    return chosen


def _default(
    values: dict[str, Any], rapids: dict[str, Any], stated: dict[str, str], checker: Checker
) -> str | None:
    """The profile of axes of which nothing is said; None: what their own limits say."""
    # One control moves all axes: what is said of one holds for those of which nothing is.
    if LINUXCNC in stated.values():
        return LINUXCNC
    # A control that the file does not name has no habits: the limits alone say what it does.
    own = WITHOUT_JERK.get(values.get("controller", "")) if checker.given(("controller",)) else None
    free = not stated and not any("jerk" in rapid for rapid in rapids.values())
    return own[0] if own is not None and free else None


def _check_alike(rapids: dict[str, Any], stated: dict[str, str], checker: Checker) -> None:
    """Refuse profiles that no single control makes."""
    kinds = {LINUXCNC: "1", BELL: "2"}
    first = next((a for a in AXES if a in stated), None)
    for a, planner in stated.items():
        if first is not None and kinds.get(planner) != kinds.get(stated[first]):
            checker.problems.add(
                checker.place(("axes", a, "rapid", "planner")),
                f"axes.{a}.rapid.planner is {planner!r}, that of {first} is {stated[first]!r}: "
                "one control makes the rapids of all axes",
                "state the same planner for all axes",
            )
        elif planner == BELL and set(rapids) - set(stated):
            other = min(set(rapids) - set(stated), key=AXES.index)
            checker.problems.add(
                checker.place(("axes", other, "rapid")),
                f"axes.{other}.rapid names no planner, axis {a} moves by {BELL!r}",
                "state the same planner for all axes",
            )


def planner_warnings(
    values: dict[str, Any], planners: dict[str, str], checker: Checker
) -> list[MachineError]:
    """Where the figures for today are not those of the control.

    Parameters
    ----------
    values : dict
        Of the whole file, all of it right.
    planners : dict of str to str
        Of `choose_planners`.
    checker : Checker
        Knows the places.

    Returns
    -------
    list of MachineError
    """
    out = []
    control = values["controller"]
    own = WITHOUT_JERK.get(control) if checker.given(("controller",)) else None
    for a, axis in values["axes"].items():
        rapid, planner = axis["rapid"], planners[a]
        stated = checker.given(("axes", a, "rapid", "planner"))
        jerk = ("axes", a, "rapid", "jerk")
        if "jerk" in rapid and planner not in (JERK_LIMITED, BELL):
            out.append(
                MachineError(
                    f"axes.{a}.rapid.jerk stands beside planner: {planner}, which has no jerk "
                    "limit: it is not used",
                    "leave it out, or state the planner that keeps it",
                    checker.place(jerk),
                )
            )
        elif "jerk" in rapid and own is not None and not stated:
            out.append(
                MachineError(
                    f"axes.{a}.rapid.jerk stands beside controller: {control}, and {own[1]} has no "
                    "jerk limit: what is said of today's rapids is not what that control does",
                    f"leave the jerk out (planner: {own[0]}), or state planner: {JERK_LIMITED} if "
                    "the control has one",
                    checker.place(jerk),
                )
            )
    return out
