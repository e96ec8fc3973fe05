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
from gcodejerk.simulation.equations import equations_of
from gcodejerk.simulation.moves import LIGHT
from gcodejerk.simulation.response import Response

FAINT = 0.01
"""Modes that an axis moves by less than this part of what it moves the strongest are left out."""
IN_PHASE = 25.0
"""Axes are said to strike a mode out of phase beyond this. [deg]"""


@dataclass(frozen=True, slots=True, eq=False)
class ReducedMode:
    """One pole of a machine, as a mode.

    Attributes
    ----------
    mode : Mode
        For a machine file; the participation is signed, and 0 for an axis that hardly strikes it.
    direction : dict of str to float
        Where the tool swings against the workpiece, a unit vector over the machine's axes.
    phase : dict of str to float
        How far each axis's blow is from being in phase, or in antiphase, with the strongest. [deg]
    """

    mode: Mode
    direction: dict[str, float]
    phase: dict[str, float]


def reduce_machine(machine: Machine, faint: float = FAINT) -> list[ReducedMode]:
    """The lightly damped modes of a machine, the lowest frequency first.

    Parameters
    ----------
    machine : Machine
        With servos, a structure, or both.
    faint : float
        What to leave out; 0: nothing. Compared is what is left of an acceleration, p / omega^2. [-]

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
    light = (response.poles.imag > 0.0) & (ratio < LIGHT)
    light &= omega < 2.0 * np.pi * highest
    weight = amount / omega[:, np.newaxis] ** 2
    kept = weight >= np.maximum(faint * weight[light].max(axis=0, initial=0.0), 1e-300)
    for k in np.flatnonzero(light & kept.any(axis=1)):
        strongest = int(np.argmax(np.where(kept[k], amount[k], 0.0)))
        turned = np.angle(struck[k] / struck[k, strongest], deg=True)
        sign = np.where(np.abs(turned) <= 90.0, 1.0, -1.0)
        shape = (seen[:, k] / seen[np.argmax(np.abs(seen[:, k])), k]).real
        frequency = float(omega[k] / (2.0 * np.pi))
        of = [(u, axis) for u, axis in enumerate(equations.axes) if kept[k, u]]
        participation = tuple((axis, float(sign[u] * amount[k, u])) for u, axis in of)
        found.append(
            ReducedMode(
                Mode(f"{frequency:.3g} Hz", frequency, float(ratio[k]), participation),
                dict(zip(equations.axes, (shape / np.linalg.norm(shape)).tolist(), strict=True)),
                {a: float(min(abs(turned[u]), 180.0 - abs(turned[u]))) for u, a in of},
            )
        )
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
            f"{axis} {part:+.2f}" for axis, part in one.direction.items() if abs(part) >= 0.01
        )
        lines.append(f"  # swings along {swings}" + _late(late, one.phase))
        lines.append(
            f"  - {{name: {mode.name}, frequency: {mode.frequency:.7g}, "
            f"damping: {mode.damping:.6g}, participation: {{{amounts}}}}}"
        )
    return "\n".join([*lines, ""])


def _late(late: list[str], phase: dict[str, float]) -> str:
    if not late:
        return ""
    said = " and ".join(f"{axis} by {phase[axis]:.0f} deg" for axis in late)
    return f"; {said} out of phase: moves of several axes at once are not exactly these"
