"""What the laws of other controls would make of a move, at the limits that this machine has.

This module owns the equivalence: a quantity that the machine file does not state is what makes the
same limits of it. An average is as long as the limits need (V/A, A/J), a ramp of the acceleration
lasts A/J, the deceleration is as the acceleration. Where there is no such thing (the change-over
speed of two stages) the law is left out.

Rule: laws only. What a machine has behind its planner acts behind none of them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import Profiles
from gcodejerk.motion.families import FAMILIES, Family
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.conventional import law_profiles

OVERSHOOT = 1.875
"""Of `poly6` where the file has none: a quintic ramp."""
EQUIVALENT = {
    "first_average": "V/A",
    "second_average": "A/J",
    "deceleration": "A",
    "rise": "A/J",
    "fall": "A/J",
    "braking_rise": "A/J",
    "braking_fall": "A/J",
    "overshoot": f"{OVERSHOOT:g}",
    "notch": "the frequency that shakes most",
}
"""What a quantity counts as that the machine file does not state."""


def family_profiles(
    machine: Machine, share: Array, frequency: Sequence[float | None]
) -> tuple[dict[str, Profiles], dict[str, str], dict[str, str]]:
    """Unit profiles of every law.

    Parameters
    ----------
    machine : Machine
        Its rapids' limits, and what it states of a law.
    share : ndarray, shape (l, 9)
        Displacement of each axis that each profile carries. [mm] or [deg]
    frequency : sequence of float or None, length l
        Mode that each of them shakes most. [Hz]

    Returns
    -------
    profiles, notes, absent : dict
        By the family's name: l profiles; the quantities that are equivalents; why there is none.
    """
    notch = np.full(len(AXES), float(next((f for f in frequency if f is not None), 0.0)))
    for row, f in zip(share, frequency, strict=True):
        if f is not None and np.count_nonzero(row) == 1:
            notch[int(np.argmax(row != 0.0))] = f
    moving = {AXES[k] for k in np.flatnonzero((share != 0.0).any(axis=0))}
    profiles, notes, absent = {}, {}, {}
    for name, family in FAMILIES.items():
        own, needs = _replaced_and_needed(machine, family, moving)
        if needs:
            absent[name] = f"needs {', '.join(needs)} (axes.?.rapid)"
            continue
        more = {q: notch if q == "notch" else _equivalents(machine, q) for q in own}
        profiles[name] = law_profiles(machine, family, share, None, more)
        said: dict[str, list[str]] = {}
        for q in own:
            said.setdefault(EQUIVALENT[q], []).append(q)
        notes[name] = "; ".join(f"{', '.join(names)} = {what}" for what, names in said.items())
    return profiles, notes, absent


def _replaced_and_needed(
    machine: Machine, family: Family, moving: set[str]
) -> tuple[list[str], list[str]]:
    """Quantities that are not stated: those with an equivalent, and those that nothing replaces."""
    missing = _missing(machine, family, moving)
    own = [q for q in missing if q in EQUIVALENT]
    needs = [q for q in missing if q not in EQUIVALENT]
    of_jerk = any("J" in EQUIVALENT[q] for q in own)
    if of_jerk and "jerk" not in needs and not _has_jerk(machine, moving):
        needs.append("jerk")
    return own, needs


def _missing(machine: Machine, family: Family, moving: set[str]) -> list[str]:
    """Quantities of a family that some moving axis does not state."""
    out = []
    for quantity in family.quantities:
        if quantity.name in ("velocity", "acceleration"):
            continue
        if quantity.name == "jerk":
            stated = _has_jerk(machine, moving)
        else:
            stated = all(quantity.name in dict(a.law) for a in machine.axes if a.name in moving)
        if not stated:
            out.append(quantity.name)
    return out


def _has_jerk(machine: Machine, moving: set[str]) -> bool:
    return all(np.isfinite(axis.rapid.jerk) for axis in machine.axes if axis.name in moving)


def _equivalents(machine: Machine, name: str) -> Array:
    """A quantity of each axis of `AXES` that the machine file does not state."""
    out = np.full(len(AXES), np.inf if name == "deceleration" else 0.0)
    for axis in machine.axes:
        own = axis.rapid
        value = {
            "V/A": own.velocity / own.acceleration,
            "A/J": own.acceleration / own.jerk,
            "A": own.acceleration,
        }.get(EQUIVALENT[name], OVERSHOOT)
        out[AXES.index(axis.name)] = value
    return out
