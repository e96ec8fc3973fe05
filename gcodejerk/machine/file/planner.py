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
from gcodejerk.machine.parts import (
    AVERAGES,
    BELL,
    FALLS_BACK,
    JERK_LIMITED,
    LAWS,
    LINUXCNC,
    SHARED,
    TRAPEZOIDAL,
    Filter,
)

WITHOUT_JERK = {
    "linuxcnc": (LINUXCNC, "LinuxCNC 2.9"),
    "linuxcnc-hal": (LINUXCNC, "LinuxCNC 2.9"),
    "grbl": (TRAPEZOIDAL, "grbl"),
}
"""Controls whose G0 has no jerk limit: their profile, and what messages call them."""
KEEP_JERK = tuple(law for law, names in LAWS.items() if "jerk" in names)
"""Planners of `LAWS` that have a jerk limit."""


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
        _check_law(a, rapids[a], chosen[a], checker)
    _check_alike(rapids, stated, checker)
    _check_shared(rapids, chosen, checker)
    _check_filters(values, rapids, checker)
    return chosen


def own_law(rapid: dict[str, Any], planner: str) -> tuple[tuple[str, float], ...]:
    """Quantities of a planner of `LAWS`, those that were left out filled in."""
    out: dict[str, float] = {}
    for name in LAWS.get(planner, ()):
        if name in ("acceleration", "jerk"):
            continue
        back = FALLS_BACK.get(name)
        known = rapid | out
        out[name] = float(known[name] if name in known else known[str(back)])
    return tuple(out.items())


def _check_law(axis: str, rapid: dict[str, Any], planner: str, checker: Checker) -> None:
    """Refuse a planner that lacks a quantity of its own."""
    for name in LAWS.get(planner, ()):
        if name not in rapid and name not in FALLS_BACK:
            checker.problems.add(
                checker.place(("axes", axis, "rapid", "planner")),
                f"axes.{axis}.rapid.planner is {planner!r}, which needs axes.{axis}.rapid.{name}",
                f"add {name}, or state another planner",
            )


def _check_shared(rapids: dict[str, Any], chosen: dict[str, str], checker: Checker) -> None:
    """Refuse what a control has one of, and axes have each their own."""
    for name in SHARED:
        own = {a: rapids[a][name] for a in AXES if a in rapids and name in LAWS.get(chosen[a], ())
               and name in rapids[a]}  # fmt: skip
        first = next(iter(own), None)
        for a, value in own.items():
            if first is not None and value != own[first]:
                checker.problems.add(
                    checker.place(("axes", a, "rapid", name)),
                    f"axes.{a}.rapid.{name} is {value:g}, that of {first} is {own[first]:g}: the "
                    "control has one for all axes",
                    "state the same for all axes",
                )


def _check_filters(values: dict[str, Any], rapids: dict[str, Any], checker: Checker) -> None:
    """Refuse filters without their number, and those by which a straight rapid is no longer one."""
    own: dict[str, Filter | None] = {}
    for a in (a for a in AXES if a in rapids):
        behind = rapids[a].get("filter") or {}
        kind = behind.get("type")
        if kind is None:
            own[a] = None
            continue
        needed = "time" if kind in AVERAGES else "frequency"
        for name in ("time", "frequency", "damping"):
            fits = name == "time" if kind in AVERAGES else name != "time"
            if name in behind and not fits:
                checker.problems.add(
                    checker.place(("axes", a, "rapid", "filter", name)),
                    f"axes.{a}.rapid.filter.{name} stands beside type: {kind}, which has none",
                    f"leave it out; {kind} is set by {needed}",
                )
        if needed not in behind:
            checker.problems.add(
                checker.place(("axes", a, "rapid", "filter")),
                f"axes.{a}.rapid.filter has no {needed}, which {kind} is set by",
                f"add {needed}",
            )
        own[a] = Filter(
            kind, *(float(behind.get(name, 0.0)) for name in ("time", "frequency", "damping"))
        )
    first = next(iter(own), None)
    for a, behind in own.items() if values.get("positioning") == "linear" else ():
        if first is not None and behind != own[first]:
            checker.problems.add(
                checker.place(("axes", a, "rapid")),
                f"axes.{a}.rapid.filter is not that of {first}: behind different filters a "
                "straight rapid is no longer straight, which is not reckoned with",
                "state the same filter for all axes, that of the axis that shakes most",
            )


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
    kinds = {LINUXCNC: "1", BELL: "2"} | {law: law for law in LAWS}
    first = next((a for a in AXES if a in stated), None)
    for a, planner in stated.items():
        if first is not None and kinds.get(planner) != kinds.get(stated[first]):
            checker.problems.add(
                checker.place(("axes", a, "rapid", "planner")),
                f"axes.{a}.rapid.planner is {planner!r}, that of {first} is {stated[first]!r}: "
                "one control makes the rapids of all axes",
                "state the same planner for all axes",
            )
        elif (planner == BELL or planner in LAWS) and set(rapids) - set(stated):
            other = min(set(rapids) - set(stated), key=AXES.index)
            checker.problems.add(
                checker.place(("axes", other, "rapid")),
                f"axes.{other}.rapid names no planner, axis {a} moves by {planner!r}",
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
        for name in dict.fromkeys(name for names in LAWS.values() for name in names):
            if name != "jerk" and name in rapid and name not in LAWS.get(planner, ()):
                out.append(
                    MachineError(
                        f"axes.{a}.rapid.{name} stands beside planner: {planner}, which has no use "
                        "for it",
                        "leave it out, or state the planner that it belongs to",
                        checker.place(("axes", a, "rapid", name)),
                    )
                )
        if "jerk" in rapid and planner not in (JERK_LIMITED, BELL, *KEEP_JERK):
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
