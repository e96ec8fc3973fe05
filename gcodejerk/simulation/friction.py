r"""A machine with dry friction: fine steps, each solved for the friction that it needs.

Between two moments the linear machine is exact (`response`); of the friction force f one value
holds for a step. It is implicit, as stick and slip need it (J. J. Moreau's time stepping): with
:math:`v = v_0 + \gamma f` the velocity at the step's end,

- the axis sticks, :math:`v = 0`, where the force for that is at most the static friction;
- else it slides, against its motion, with Stribeck's law.

So there are no events to find, nothing chatters, and friction takes energy out and never brings any
in. The error is of the first order in the step: `follow` halves the step until what it sees changes
by less than a given tolerance.

This module owns that stepping.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.simulation.equations import Row, Rub
from gcodejerk.simulation.response import Response, Steps

FIRST_STEP = 40e-6
"""[s]"""
FINEST = 2.5e-6
"""[s]"""
SWEEPS = 4
"""Over several frictions that act on each other, in one step."""


def follow(
    response: Response, steps: Steps, times: Array, rows: Sequence[Row], tolerance: float
) -> tuple[Array, float]:
    """What some rows see of a machine with dry friction.

    Parameters
    ----------
    response : Response
        The machine.
    steps : Steps
        The command, from rest.
    times : ndarray, shape (k,)
        Evenly spaced from 0. [s]
    rows : sequence of Row, length r
    tolerance : float
        What the last halving of the step may change at most. [mm]

    Returns
    -------
    seen : ndarray, shape (r, k)
    change : float
        What the last halving changed. [mm]

    Raises
    ------
    PlanError
        The finest step is still too coarse.
    """
    spacing = float(times[1] - times[0])
    divisions = max(1, math.ceil(spacing / FIRST_STEP))
    before = _followed(response, steps, times, rows, divisions)
    while True:
        divisions *= 2
        now = _followed(response, steps, times, rows, divisions)
        change = float(np.abs(now - before).max(initial=0.0))
        if change <= tolerance:
            return now, change
        if spacing / divisions < FINEST:
            raise PlanError(
                f"with steps of {1e6 * spacing / divisions:.2g} us the friction still changes "
                f"what is seen by {1e3 * change:.3g} um",
                "a larger stribeck speed, or friction.static nearer to coulomb, is smoother",
            )
        before = now


def _followed(
    response: Response, steps: Steps, times: Array, rows: Sequence[Row], divisions: int
) -> Array:
    """The same with every spacing of the moments divided."""
    fine = np.linspace(times[0], times[-1], (len(times) - 1) * divisions + 1)
    h = float(fine[1] - fine[0])
    rubs = response.equations.rubs
    poles = response.poles
    linear = response.watch(steps, fine, [rub.velocity for rub in rubs])
    seen = np.array([response.seen(rub.velocity) for rub in rubs])
    decay = np.exp(poles * h)
    # A force of one N through one step, in the coordinates of the poles.
    push = np.array([(decay - 1.0) / poles * (response.inverse @ rub.force) for rub in rubs])
    gain = (seen @ push.T).real
    out_seen = np.array([response.seen(row) for row in rows])
    out = response.watch(steps, times, rows)
    state: NDArray[np.complex128] = np.zeros(len(poles), dtype=np.complex128)
    force = np.zeros(len(rubs))
    for k in range(1, len(fine)):
        state = state * decay
        free = linear[:, k] + (seen @ state).real
        force = _forces(rubs, free, gain, force)
        state = state + force @ push
        if k % divisions == 0:
            out[:, k // divisions] += (out_seen @ state).real
    return out


def _forces(rubs: tuple[Rub, ...], free: Array, gain: Array, force: Array) -> Array:
    """Friction forces of a step, as multiples of one N against the motion, shape (f,)."""
    force = force.copy()
    for _ in range(SWEEPS if len(rubs) > 1 else 1):
        for k, rub in enumerate(rubs):
            own = gain[k, k]
            alone = free[k] + gain[k] @ force - own * force[k]
            stick = -alone / own
            if abs(stick) <= rub.friction.static:
                force[k] = stick
                continue
            force[k] = math.copysign(_sliding(rub, abs(alone), -own), alone)
    return force


def _sliding(rub: Rub, speed: float, gain: float) -> float:
    """Friction of a slide whose speed it takes `gain` from for each N: the speed at the end [N]."""
    law = rub.friction
    f = law.coulomb
    for _ in range(30):
        v = max(speed - gain * f, 0.0)
        new = law.coulomb + (law.static - law.coulomb) * math.exp(-((v / law.stribeck) ** 2))
        if abs(new - f) <= 1e-9 * max(law.static, 1e-9):
            break
        f = new
    return f
