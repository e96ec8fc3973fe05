r"""The modes that planning needs, from a machine with its drives and its structure.

A closed loop's pole :math:`\lambda` answers a rest-to-rest command with
:math:`c\, S(\lambda)`, where S is the sum over the command's jerk steps. A mode of the machine file
of participation p answers with :math:`p S / (2 \omega_d \omega^2)`: so

.. math:: p = 2 |c| \omega_d \omega^2,

and what planning then says is left of a move is what the simulated machine does. For one pole the
tool's direction of motion is the same whichever axis strikes it (the residue has rank one); what is
left of one axis's blow against another's is the ratio of their participations, whose sign is kept.

This module owns that reduction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.machine import Machine, Mode
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.simulation.equations import equations_of
from gcodejerk.simulation.response import Response

WELL_DAMPED = 0.3
"""Poles of this damping ratio and more are the servos' own: gone before a mode has turned twice."""
FAINT = 1e-4
"""Participations below this part of the largest are left out."""
IN_PHASE = 25.0
"""Axes are said to strike a mode out of phase beyond this. [deg]"""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedMode:
    """One pole of a machine, as a mode.

    Attributes
    ----------
    mode : Mode
        For a machine file; the participation is signed, and 0 for an axis that hardly strikes it.
    direction : ndarray, shape (a,)
        Where the tool swings against the workpiece, a unit vector over the machine's axes.
    phase : dict of str to float
        How far each axis's blow is from being in phase, or in antiphase, with the strongest. [deg]
    """

    mode: Mode
    direction: Array
    phase: dict[str, float]


def reduce_machine(machine: Machine) -> list[ReducedMode]:
    """The lightly damped modes of a machine, the lowest frequency first.

    Parameters
    ----------
    machine : Machine
        With servos, a structure, or both.

    Returns
    -------
    list of ReducedMode

    Raises
    ------
    PlanError
        As `equations_of`.
    """
    equations = equations_of(machine)
    response = Response(equations)
    seen = np.array(
        [response.seen(equations.table[a] + equations.vibration[a]) for a in equations.axes]
    )
    found = []
    struck = response.struck[2]
    omega = np.abs(response.poles)
    size = 2.0 * np.linalg.norm(seen / 2.0, axis=0) * response.poles.imag * omega**2
    # What each axis leaves per mm/s^3: as much as a mode of this participation.
    amount = size[:, np.newaxis] * np.abs(struck)
    highest = 0.5 / machine.interval
    ratio = -response.poles.real / np.maximum(omega, 1e-300)
    light = (response.poles.imag > 0.0) & (ratio < WELL_DAMPED)
    for k in np.flatnonzero(light & (omega < 2.0 * np.pi * highest)):
        if amount[k].max() < FAINT * amount[light].max():
            continue
        strongest = int(np.argmax(amount[k]))
        turned = np.angle(struck[k] / struck[k, strongest], deg=True)
        sign = np.where(np.abs(turned) <= 90.0, 1.0, -1.0)
        shape = seen[:, k] / seen[np.argmax(np.abs(seen[:, k])), k]
        direction = shape.real / np.linalg.norm(shape.real)
        kept = amount[k] >= FAINT * amount[light].max()
        frequency = float(omega[k] / (2.0 * np.pi))
        phase = {
            axis: float(min(abs(turned[u]), 180.0 - abs(turned[u])))
            for u, axis in enumerate(equations.axes)
            if kept[u]
        }
        participation = tuple(
            (axis, float(sign[u] * amount[k, u]))
            for u, axis in enumerate(equations.axes)
            if kept[u]
        )
        mode = Mode(f"{frequency:.3g} Hz", frequency, float(ratio[k]), participation)
        found.append(ReducedMode(mode, direction, phase))
    return sorted(found, key=lambda one: one.mode.frequency)


def modes_yaml(found: list[ReducedMode]) -> str:
    """The key `modes` of a machine file, with a comment on each.

    Parameters
    ----------
    found : list of ReducedMode

    Returns
    -------
    str
    """
    lines = ["modes:" if found else "modes: []"]
    for one in found:
        mode = one.mode
        amounts = ", ".join(f"{axis}: {amount:.6g}" for axis, amount in mode.participation)
        late = [axis for axis, angle in one.phase.items() if angle > IN_PHASE]
        swings = ", ".join(
            f"{axis} {part:+.2f}"
            for (axis, part) in zip(one.phase, one.direction, strict=False)
        )
        lines.append(f"  # swings along {swings}" + _late(late, one.phase))
        lines.append(
            f"  - {{name: {mode.name.replace(' ', '')}, frequency: {mode.frequency:.7g}, "
            f"damping: {mode.damping:.6g}, participation: {{{amounts}}}}}"
        )
    return "\n".join([*lines, ""])


def _late(late: list[str], phase: dict[str, float]) -> str:
    if not late:
        return ""
    said = " and ".join(f"{axis} by {phase[axis]:.0f} deg" for axis in late)
    return f"; {said} out of phase: moves of several axes at once are not exactly these"
