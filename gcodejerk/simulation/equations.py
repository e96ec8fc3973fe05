r"""The equations of motion of a machine with its servo loops closed.

This module owns the linear system

.. math:: \dot z = A z + B_0 x + B_1 \dot x + B_2 \ddot x

of a machine that is told to be at x (one command for each axis), and the rows that tell what it
does. Dry friction is the only thing that is left out; where it acts is kept for `friction`.

Rule: everything is linear, so commands in mm make states in mm, forces in mN and angles in mrad.

States: coordinates and their velocities; for each servo its motor's force (where the current loop
lags) and its integral; for each mode of the machine file its displacement and velocity. An axis
without `servo` is where it is told to be, and excites the modes by its commanded acceleration, as
planning assumes.

Source: the usual model of feed drives (P position, PI velocity, two masses), as in Y. Altintas,
Manufacturing Automation, ch. 6; modes as in `motion.residual`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gcodejerk.errors import PlanError
from gcodejerk.machine import Axis, Machine
from gcodejerk.machine.drives import TABLE, Friction, Servo
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.simulation.bodies import MM, PER_MM, PER_UM, Frame, frame_of, modal_damping

FOLLOWS = 1e-6
"""What a tool may stay away from where its axis is told to be, of the way. [-]"""


@dataclass(frozen=True, slots=True, eq=False)
class Row:
    """Something to be seen: what each state and each command gives to it.

    Attributes
    ----------
    state : ndarray, shape (s,)
    command : ndarray, shape (3, a)
        For position, velocity and acceleration of every axis's command.
    """

    state: Array
    command: Array

    def __add__(self, other: Row) -> Row:
        return Row(self.state + other.state, self.command + other.command)

    def __sub__(self, other: Row) -> Row:
        return Row(self.state - other.state, self.command - other.command)

    def scaled(self, by: float) -> Row:
        """The same, `by` times."""
        return Row(by * self.state, by * self.command)


@dataclass(frozen=True, slots=True, eq=False)
class Rub:
    """Dry friction on one axis.

    Attributes
    ----------
    axis : str
    friction : Friction
    velocity : Row
        Of what slides. [mm/s]
    force : ndarray, shape (s,)
        What one N against it does to the states' derivatives.
    """

    axis: str
    friction: Friction
    velocity: Row
    force: Array


@dataclass(frozen=True, slots=True, eq=False)
class Equations:
    """A machine's linear system: s states, a axes.

    Attributes
    ----------
    axes : tuple of str, length a
        In the order of the commands.
    A : ndarray, shape (s, s)
    B : ndarray, shape (3, s, a)
        For position, velocity and acceleration of the commands.
    table : dict of str to Row
        Where each axis's table is: its nut against its carrier. [mm]
    vibration : dict of str to Row
        What the tool moves along each axis against the workpiece beside what the table does. [mm]
    structure : Row or None
        Sum of the displacements of modes that several axes excite and that have no direction. [mm]
    modes : dict of str to Row
        Displacement of each mode of the machine file, by label and name. [mm]
    rubs : tuple of Rub
    pushed : dict of str to ndarray, shape (s,)
        Direction -> what one N between tool and workpiece does to the states' derivatives; of a
        structure only.
    names : tuple of str
        Of the states.
    """

    axes: tuple[str, ...]
    A: Array
    B: Array
    table: dict[str, Row]
    vibration: dict[str, Row]
    structure: Row | None
    modes: dict[str, Row]
    rubs: tuple[Rub, ...] = ()
    pushed: dict[str, Array] = field(default_factory=dict)
    names: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<Equations: {len(self.A)} states, axes {' '.join(self.axes)}>"

    def command(self, axis: str) -> Row:
        """Where an axis is told to be."""
        row = np.zeros((3, len(self.axes)))
        row[0, self.axes.index(axis)] = 1.0
        return Row(np.zeros(len(self.A)), row)

    def lag(self, axis: str) -> Row:
        """How far a table is behind its command [mm]."""
        return self.command(axis) - self.table[axis]

    def deviation(self, axis: str) -> Row:
        """How far the tool is from where it should be along an axis [mm]."""
        return self.table[axis] + self.vibration[axis] - self.command(axis)


def equations_of(machine: Machine) -> Equations:
    """The equations of motion of a machine.

    Parameters
    ----------
    machine : Machine
        Without `servo` an axis is ideal; without `structure` its tables are masses on screws.

    Returns
    -------
    Equations

    Raises
    ------
    PlanError
        An axis is measured instead of modelled (`spectrum`), or a servo is unstable.

    Examples
    --------
    >>> from gcodejerk.machine import find_machine
    >>> equations_of(Machine.load(find_machine("paper")))
    <Equations: 2 states, axes Z>
    """
    for axis in machine.axes:
        if axis.spectrum is not None:
            raise PlanError(
                f"axis {axis.name} has a spectrum, which has no phase and no damping to simulate",
                "give it modes (`gcodejerk identify` finds them in a record of free vibration)",
            )
    made = _Assembly(machine).equations()
    _require_stable(made)
    return made


class _Assembly:
    """The system while it is put together: coordinates first, then what is added to them."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.axes = machine.axis_names
        self.driven = [axis for axis in machine.axes if axis.servo is not None]
        self.frame: Frame | None = None if machine.structure is None else frame_of(machine)
        if self.frame is None:
            self._masses()
        else:
            self._bodies(self.frame)

    # -- coordinates -----------------------------------------------------------------------------

    def _masses(self) -> None:
        """For each driven axis two: motor as seen at the nut, and table."""
        count = 2 * len(self.driven)
        self.M, self.C, self.K = (np.zeros((count, count)) for _ in range(3))
        self.motor: dict[str, Array] = {}
        self.nut: dict[str, Array] = {}
        self.drive: dict[str, Array] = {}
        for k, axis in enumerate(self.driven):
            servo = _servo(axis)
            m, t = np.eye(count)[2 * k], np.eye(count)[2 * k + 1]
            radius = _radius(servo)
            self.M += np.outer(m, m) * servo.inertia / radius**2 + np.outer(t, t) * servo.mass
            self.K += np.outer(m - t, m - t) * servo.stiffness * PER_UM
            self.C += np.outer(m - t, m - t) * servo.damping * PER_MM
            self.C += np.outer(m, m) * servo.motor_damping / radius**2
            self.C += np.outer(t, t) * servo.guide_damping * PER_MM
            self.motor[axis.name], self.nut[axis.name], self.drive[axis.name] = m, t, m
        self.coordinates = [f"{a.name} {what}" for a in self.driven for what in ("motor", "table")]

    def _bodies(self, frame: Frame) -> None:
        """Those of the structure, then the angle of each rotor."""
        n, count = len(frame.mass), len(frame.mass) + len(self.driven)
        self.M, self.C, self.K = (np.zeros((count, count)) for _ in range(3))
        self.M[:n, :n], self.C[:n, :n], self.K[:n, :n] = frame.mass, frame.damping, frame.stiffness
        self.motor, self.nut, self.drive = {}, {}, {}
        for k, axis in enumerate(self.driven):
            servo = _servo(axis)
            radius = _radius(servo)
            rotor = np.eye(count)[n + k]
            nut, housing = (np.zeros(count) for _ in range(2))
            nut[:n], housing[:n] = frame.nut[axis.name], frame.torque[axis.name]
            pulled = radius * rotor - nut
            self.M += np.outer(rotor, rotor) * servo.inertia
            self.K += np.outer(pulled, pulled) * servo.stiffness * PER_UM
            self.C += np.outer(pulled, pulled) * servo.damping * PER_MM
            self.C += np.outer(nut, nut) * servo.guide_damping * PER_MM
            self.motor[axis.name], self.nut[axis.name] = radius * rotor, nut
            self.drive[axis.name] = radius * (rotor - housing)
        self.C += modal_damping(self.M, self.K, frame.ratio)
        for k, axis in enumerate(self.driven):
            self.C[n + k, n + k] += _servo(axis).motor_damping
        self.coordinates = [*frame.names, *(f"{axis.name} rotor" for axis in self.driven)]

    # -- the system ------------------------------------------------------------------------------

    def equations(self) -> Equations:
        """Everything together."""
        n = len(self.M)
        lagging = [a for a in self.driven if _servo(a).current_lag > 0.0]
        whole = [a for a in self.driven if _servo(a).integral > 0.0]
        # A structure's own modes are what the file's are: they would count twice.
        modes = () if self.frame is not None else self.machine.all_modes()
        names = [
            *self.coordinates, *(f"{name}'" for name in self.coordinates),
            *(f"{a.name} force" for a in lagging), *(f"{a.name} integral" for a in whole),
            *(f"{label} {mode.name}{dot}" for label, mode in modes for dot in ("", "'")),
        ]  # fmt: skip
        size = len(names)
        A, B = np.zeros((size, size)), np.zeros((3, size, len(self.axes)))
        force = {a.name: 2 * n + k for k, a in enumerate(lagging)}
        integral = {a.name: 2 * n + len(lagging) + k for k, a in enumerate(whole)}
        inverse: Array = np.linalg.inv(self.M).astype(np.float64)
        A[:n, n : 2 * n] = np.eye(n)
        A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -inverse @ self.K, -inverse @ self.C
        for axis in self.driven:
            self._close(axis, A, B, inverse, force.get(axis.name), integral.get(axis.name))
        table = {axis.name: self._table(axis, size) for axis in self.machine.axes}
        displaced = self._excite(modes, A, B, 2 * n + len(lagging) + len(whole))
        vibration, structure = self._vibration(displaced, table, A, B)
        return Equations(
            self.axes, A, B, table, vibration, structure,
            {f"{axis} {m.name}": row for (axis, m), row in zip(modes, displaced, strict=True)},
            tuple(self._rubs(size, inverse)), self._pushed(size, inverse), tuple(names),
        )  # fmt: skip

    def _close(
        self,
        axis: Axis,
        A: Array,
        B: Array,
        inverse: Array,
        force: int | None,
        integral: int | None,
    ) -> None:
        """Close the servo loop of an axis: what it asks of its motor, and what that does."""
        servo, name = _servo(axis), axis.name
        n, u = len(self.M), self.axes.index(name)
        turned = servo.inertia / _radius(servo) ** 2 + servo.mass
        gain = turned * servo.velocity_bandwidth
        measured = self.nut[name] if servo.feedback == TABLE else self.motor[name]
        # The error of the velocity, as a row of states and of commands.
        error, told = np.zeros(len(A)), np.zeros(3)
        error[:n] = -servo.kpp * measured
        error[n : 2 * n] = -self.motor[name]
        told[0], told[1] = servo.kpp, servo.feedforward
        asked, asked_told = gain * error, gain * told
        asked_told[2] += servo.acceleration_feedforward * turned
        if integral is not None:
            asked[integral] += gain * servo.integral
            A[integral] = error
            B[:, integral, u] = told
        moved = inverse @ self.drive[name]
        if force is None:
            A[n : 2 * n] += np.outer(moved, asked)
            B[:, n : 2 * n, u] += np.outer(asked_told, moved)
            return
        A[n : 2 * n, force] += moved
        A[force] = asked / servo.current_lag
        A[force, force] -= 1.0 / servo.current_lag
        B[:, force, u] = asked_told / servo.current_lag

    def _table(self, axis: Axis, size: int) -> Row:
        row = Row(np.zeros(size), np.zeros((3, len(self.axes))))
        if axis.servo is None:
            row.command[0, self.axes.index(axis.name)] = 1.0
        else:
            row.state[: len(self.M)] = self.nut[axis.name]
        return row

    def _excite(self, modes: Any, A: Array, B: Array, first: int) -> list[Row]:
        """Add the modes of the file, driven by what the tables really do."""
        n, rows = len(self.M), []
        for k, (_, mode) in enumerate(modes):
            q = first + 2 * k
            omega = 2.0 * np.pi * mode.frequency
            A[q, q + 1] = 1.0
            A[q + 1, q], A[q + 1, q + 1] = -(omega**2), -2.0 * mode.damping * omega
            for name, amount in mode.participation:
                u = self.axes.index(name)
                if name in self.nut:
                    A[q + 1] -= amount * self.nut[name] @ A[n : 2 * n]
                    B[:, q + 1] -= amount * np.einsum("n,jnu->ju", self.nut[name], B[:, n : 2 * n])
                else:
                    B[2, q + 1, u] -= amount
            state = np.zeros(len(A))
            state[q] = 1.0
            rows.append(Row(state, np.zeros((3, len(self.axes)))))
        return rows

    def _vibration(
        self, displaced: list[Row], table: dict[str, Row], A: Array, B: Array
    ) -> tuple[dict[str, Row], Row | None]:
        """What the tool does beside the tables, along each axis, and in no direction."""
        none = Row(np.zeros(len(A)), np.zeros((3, len(self.axes))))
        out, begin = {}, 0
        if self.frame is not None:
            at_rest = -np.linalg.solve(A, B[0])
            for u, name in enumerate(self.axes):
                out[name] = none  # an axis that moves no body: a rotary one
                if name not in self.nut:
                    continue
                row = np.zeros(len(A))
                row[: len(self.frame.mass)] = self.frame.tool[name]
                # A table moves the workpiece: the tool goes the other way against it.
                way = float(row @ at_rest[:, u])
                if abs(abs(way) - 1.0) > FOLLOWS:
                    raise PlanError(
                        f"the structure does not take the tool along {name}: told to go 1 mm, it "
                        f"moves by {way:.6g} mm against the workpiece",
                        f"check the screw of {name}, and which bodies it moves",
                    )
                out[name] = Row(np.sign(way) * row, none.command) - table[name]
            return out, None
        for axis in self.machine.axes:
            out[axis.name] = sum(displaced[begin : begin + len(axis.modes)], none)
            begin += len(axis.modes)
        shared = displaced[begin:]
        return out, sum(shared, none) if shared else None

    def _rubs(self, size: int, inverse: Array) -> list[Rub]:
        """Where dry friction acts."""
        n, rubs = len(self.M), []
        for axis in self.driven:
            friction = _servo(axis).friction
            if friction is None:
                continue
            row = self.nut[axis.name] if friction.at == TABLE else self.motor[axis.name]
            velocity, force = np.zeros(size), np.zeros(size)
            velocity[n : 2 * n] = row
            # mN, as everything here.
            force[n : 2 * n] = -1e3 * inverse @ row
            seen = Row(velocity, np.zeros((3, len(self.axes))))
            rubs.append(Rub(axis.name, friction, seen, force))
        return rubs

    def _pushed(self, size: int, inverse: Array) -> dict[str, Array]:
        """What a force between tool and workpiece does."""
        if self.frame is None:
            return {}
        n, out = len(self.M), {}
        for direction, row in self.frame.tool.items():
            out[direction] = np.zeros(size)
            whole = np.zeros(n)
            whole[: len(row)] = row
            out[direction][n : 2 * n] = 1e3 * inverse @ whole
        return out


def _servo(axis: Axis) -> Servo:
    assert axis.servo is not None
    return axis.servo


def _radius(servo: Servo) -> float:
    """What the nut moves for a radian [m]."""
    return MM * servo.lead / (2.0 * np.pi)


def _require_stable(equations: Equations) -> None:
    """Refuse a machine that shakes by itself."""
    poles = np.linalg.eigvals(equations.A)
    if len(poles) and poles.real.max() > 1e-9 * np.abs(poles).max():
        worst = poles[np.argmax(poles.real)]
        frequency = abs(worst) / (2.0 * np.pi)
        raise PlanError(
            f"the machine is unstable with these servo gains: {frequency:.3g} Hz grows by itself",
            "lower kpp, velocity_bandwidth or integral of the axis that is too stiff for its screw",
        )
