r"""How a linear machine answers commands of piecewise constant jerk: exactly.

While the jerk j is constant, the state follows the command as a polynomial of it,

.. math:: z = P_0 x + P_1 \dot x + P_2 \ddot x + P_3 j + h, \qquad \dot h = A h

with :math:`A P_0 = -B_0`, :math:`A P_1 = P_0 - B_1`, :math:`A P_2 = P_1 - B_2`,
:math:`A P_3 = P_2`: what is left over, h, vibrates freely. Where the command's jerk steps by
:math:`\Delta j` or its acceleration by :math:`\Delta a`, z goes on and h steps by
:math:`-P_3 \Delta j` or :math:`-P_2 \Delta a`; where its velocity steps by :math:`\Delta v`, which
is a blow of the acceleration, h steps by :math:`(B_2 - P_1) \Delta v = -A P_2 \Delta v`. In the
coordinates of the poles

.. math:: h(t) = -\sum_k v_k \sum_i w_k (P_3 \Delta j_i + P_2 \Delta a_i + A P_2 \Delta v_i)
          e^{\lambda_k (t - t_i)}

There is no integration and so no error of integration. What is left after the last step is the sum
of section 2's theorem: machine constants times the sum that planning makes small.

This module owns that: `Response` for a machine, `Steps` for commands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex
from gcodejerk.simulation.equations import Equations, Row

WORST_CONDITION = 1e9
"""Of the shapes of motion; beyond it poles are so near each other that digits are lost."""
NUDGE = 1e-12
"""What such a machine's matrix is changed by, of its own size, to part them."""
ORDERS = 3
"""Of steps: velocity, acceleration, jerk."""


@dataclass(frozen=True, slots=True, eq=False)
class Steps:
    """A command of one or more axes from rest to rest, as the steps of its derivatives.

    Attributes
    ----------
    time : ndarray, shape (n,)
        When each happens, rising, from 0. [s]
    size : ndarray, shape (n, 3, a)
        Of velocity, acceleration and jerk of each axis. [mm/s], [mm/s^2], [mm/s^3]
    end : float
        When the last axis is told to stand still. [s]
    """

    time: Array
    size: Array
    end: float

    @property
    def displacement(self) -> Array:
        """What each axis is told to move, shape (a,) [mm]."""
        left = (self.end - self.time)[:, np.newaxis]
        v, a, j = (self.size[:, k] for k in range(ORDERS))
        out: Array = (v * left + a * left**2 / 2.0 + j * left**3 / 6.0).sum(axis=0)
        return out

    def command(self, times: Array) -> Array:
        """Position, velocity, acceleration and jerk at some moments, shape (4, k, a).

        Parameters
        ----------
        times : ndarray, shape (k,)
            Rising. [s]
        """
        begins = self._states()
        done = np.searchsorted(self.time, times, side="right")
        since = times - np.concatenate([[0.0], self.time])[done]
        out = _advanced(begins[:, done], since[:, np.newaxis])
        # Behind the last step it stands, whatever rounding makes of the sums.
        out[1:, done == len(self.time)] = 0.0
        return out

    def _states(self) -> Array:
        """Position to jerk behind each step, and before the first, shape (4, n + 1, a).

        Between two steps each is a polynomial: carried from step to step, as sums of what is added.
        """
        states = np.zeros((4, len(self.time) + 1, self.size.shape[2]))
        x, v, a, j = (state[1:] for state in states)
        v_before, a_before, j_before = (state[:-1] for state in states[1:])
        gap = np.diff(self.time, prepend=0.0)[:, np.newaxis]
        steps_v, steps_a, steps_j = self.size.transpose(1, 0, 2)
        np.cumsum(steps_j, axis=0, out=j)
        np.cumsum(gap * j_before + steps_a, axis=0, out=a)
        np.cumsum(gap * (a_before + gap * j_before / 2.0) + steps_v, axis=0, out=v)
        moved = v_before + gap * (a_before / 2.0 + gap * j_before / 6.0)
        np.cumsum(gap * moved, axis=0, out=x)
        return states


def _advanced(state: Array, time: Array | float) -> Array:
    """Position to jerk, shape (4, ...), some time later."""
    x, v, a, j = state
    t = time
    return np.array(
        [
            x + t * (v + t * (a / 2.0 + t * j / 6.0)),
            v + t * (a + t * j / 2.0),
            a + t * j,
            j + 0.0 * a,
        ]
    )


def profile_steps(profiles: Profiles, share: Array, axes: Sequence[int]) -> Steps:
    """The command of profiles that begin together.

    Parameters
    ----------
    profiles : Profiles
        One, or one for each moving axis.
    share : ndarray, shape (l, 9)
        Displacement of each axis that each carries. [mm]
    axes : sequence of int, length a
        The axes that the machine has, of `AXES`.

    Returns
    -------
    Steps
    """
    own = share[:, list(axes)]
    of = np.repeat(np.arange(len(profiles)), np.diff(profiles.first) + 1)
    size = np.zeros((len(of), ORDERS, len(axes)))
    size[:, 1] = profiles.acceleration_steps()[:, np.newaxis] * own[of]
    size[:, 2] = profiles.jerk_steps()[:, np.newaxis] * own[of]
    return _in_order(profiles.step_times(), size, float(profiles.total.max()))


def polyline_steps(times: Array, positions: Array) -> Steps:
    """The command of positions with straight lines between: a first-order hold.

    Parameters
    ----------
    times : ndarray, shape (k,)
        Rising, from 0. [s]
    positions : ndarray, shape (k, a)
        [mm]

    Returns
    -------
    Steps
        Of velocity only.
    """
    velocity = np.diff(positions, axis=0) / np.diff(times)[:, np.newaxis]
    size = np.zeros((len(times), ORDERS, positions.shape[1]))
    size[:, 0] = np.diff(velocity, axis=0, prepend=0.0, append=0.0)
    return _in_order(times, size, float(times[-1]))


def _in_order(time: Array, size: Array, end: float) -> Steps:
    """Steps in time's order, those of one moment together, those that are none left out."""
    moments, of = np.unique(time, return_inverse=True)
    summed = np.zeros((len(moments), *size.shape[1:]))
    np.add.at(summed, of, size)
    kept = (summed != 0.0).any(axis=(1, 2))
    return Steps(moments[kept], summed[kept], end)


class Response:
    """A machine's answer, in the coordinates of its poles.

    Parameters
    ----------
    equations : Equations
        The machine.

    Attributes
    ----------
    poles : ndarray of complex, shape (m,)
        Of each conjugate pair the upper one; real poles as they are. [rad/s]
    shapes : ndarray of complex, shape (s, m)
        Right eigenvectors; those of pairs stand for both, by their real part, twice.
    struck : ndarray of complex, shape (3, m, a)
        What a step of velocity, acceleration and jerk of each axis adds to h.
    follows : ndarray, shape (4, s, a)
        P0 to P3.

    Raises
    ------
    PlanError
        The machine has coordinates that nothing holds.
    """

    def __init__(self, equations: Equations) -> None:
        self.equations = equations
        A, B = equations.A, equations.B
        self.poles, self.shapes, self.inverse = _modal(A)
        follows = [_solved(A, -B[0])]
        for given in (B[1], B[2], np.zeros_like(B[0])):
            follows.append(_solved(A, follows[-1] - given))
        self.follows: Array = np.array(follows)
        # A step of the velocity is a blow of the acceleration, which acts on its own.
        jumps = np.array([A @ self.follows[2], self.follows[2], self.follows[3]])
        self.struck: Complex = -np.einsum("ms,jsa->jma", self.inverse, jumps)

    def __repr__(self) -> str:
        return f"<Response: {len(self.poles)} poles, axes {' '.join(self.equations.axes)}>"

    def seen(self, row: Row) -> Complex:
        """What a row sees of each pole, shape (m,): real part of it times h."""
        out: Complex = (row.state @ self.shapes) * np.where(self.poles.imag > 0.0, 2.0, 1.0)
        return out

    def static(self, row: Row) -> Array:
        """What a row sees of position, velocity, acceleration and jerk, shape (4, a)."""
        out: Array = np.einsum("s,jsa->ja", row.state, self.follows)
        out[:3] += row.command
        return out

    def left(self, steps: Steps, time: float) -> Complex:
        """What vibrates at a moment not before the last step, shape (m,)."""
        out: Complex = np.zeros(len(self.poles), dtype=np.complex128)
        if len(steps.time):
            decay = np.exp(self.poles * (time - steps.time)[:, np.newaxis])
            hit = np.einsum("nja,jma->nm", steps.size, self.struck)
            out = (decay * hit).sum(axis=0)
        return out

    def watch(self, steps: Steps, times: Array, rows: Sequence[Row]) -> Array:
        """What some rows see at some moments.

        Parameters
        ----------
        steps : Steps
            The command.
        times : ndarray, shape (k,)
            Rising, from 0. [s]
        rows : sequence of Row, length r

        Returns
        -------
        ndarray, shape (r, k)
            [mm] or what the rows are of.
        """
        seen = np.array([self.seen(row) for row in rows])
        static = np.array([self.static(row) for row in rows])
        command = steps.command(times)
        out: Array = np.einsum("rja,jka->rk", static, command)
        return out + (seen @ self.free(steps, times)).real

    def free(self, steps: Steps, times: Array) -> Complex:
        """What vibrates at some moments, shape (m, k)."""
        hit = np.einsum("nja,jma->nm", steps.size, self.struck)
        begins = np.zeros((len(steps.time) + 1, len(self.poles)), dtype=np.complex128)
        decay = np.exp(np.multiply.outer(np.diff(steps.time, prepend=0.0), self.poles))
        for k in range(len(decay)):
            begins[k + 1] = begins[k] * decay[k] + hit[k]
        done = np.searchsorted(steps.time, times, side="right")
        since = times - np.concatenate([[0.0], steps.time])[done]
        out: Complex = begins[done].T * np.exp(np.outer(self.poles, since))
        return out


def _modal(A: Array) -> tuple[Complex, Complex, Complex]:
    """Poles, right and left eigenvectors; of each conjugate pair the upper pole only."""
    nudged = A
    for attempt in range(3):
        poles, shapes = np.linalg.eig(nudged)
        if _condition(shapes) < WORST_CONDITION:
            break
        # Poles that fall together (a critically damped loop): parted by what nobody can measure.
        rng = np.random.default_rng(attempt)
        nudged = A * (1.0 + NUDGE * rng.uniform(-1.0, 1.0, A.shape))
    inverse = np.linalg.inv(shapes)
    upper = poles.imag >= 0.0
    return (
        np.asarray(poles[upper], dtype=np.complex128),
        np.asarray(shapes[:, upper], dtype=np.complex128),
        np.asarray(inverse[upper], dtype=np.complex128),
    )


def _condition(shapes: Complex) -> float:
    """Condition number, whatever the states' units."""
    if not len(shapes):
        return 1.0
    return float(np.linalg.cond(shapes / np.linalg.norm(shapes, axis=1, keepdims=True)))


def _solved(A: Array, right: Array) -> Array:
    try:
        out: Array = np.linalg.solve(A, right).astype(np.float64)
    except np.linalg.LinAlgError:
        raise PlanError(
            "the machine has a coordinate that nothing holds in its place",
            "give every body joints, and every axis that moves one a servo",
        ) from None
    return out
