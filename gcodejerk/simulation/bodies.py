"""A structure as matrices: rigid bodies on springs, or what a file holds.

This module owns geometry: six coordinates for each body (three translations of its centre of mass,
three small rotations), and what a point of it then moves.

Source: linear kinematics of rigid bodies; the model of R. Sato, K. Shirase (Precision Engineering
71, 2021, section 2) is of this kind, with 5 bodies and 3 motors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.machine import Machine
from gcodejerk.machine.drives import GROUND, Matrices, Screw, Structure, Vector
from gcodejerk.motion.profiles.profile import Array

MM = 1e-3
PER_UM = 1e6
"""N/m of one N/um."""
PER_MM = 1e3
"""N s/m of one N s/mm."""
DIRECTION = {"X": 0, "Y": 1, "Z": 2}
"""Coordinate that a linear axis moves along."""
RIGID = 1e-6
"""A mode below this part of the highest frequency is none: the body is free to move there."""


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """A structure of n coordinates without its motors.

    Attributes
    ----------
    mass, damping, stiffness : ndarray, shape (n, n)
        [kg, kg m^2], [N s/m, ...], [N/m, ...]; without screws.
    ratio : float
        Damping ratio that every elastic mode has besides. [-]
    nut : dict of str to ndarray, shape (n,)
        Axis -> what its nut moves along the screw.
    torque : dict of str to ndarray, shape (n,)
        Axis -> what turns about the screw's axis with the motor's housing.
    tool : dict of str to ndarray, shape (n,)
        Direction -> what the tool moves against the workpiece.
    names : tuple of str, length n
        Of the coordinates.
    """

    mass: Array
    damping: Array
    stiffness: Array
    ratio: float
    nut: dict[str, Array]
    torque: dict[str, Array]
    tool: dict[str, Array]
    names: tuple[str, ...]


def frame_of(machine: Machine) -> Frame:
    """The structure of a machine that has one.

    Parameters
    ----------
    machine : Machine
        With `structure`.

    Returns
    -------
    Frame
    """
    structure = machine.structure
    assert structure is not None
    if structure.matrices is not None:
        return _given(structure.matrices)
    return _built(structure)


def _given(matrices: Matrices) -> Frame:
    mass, damping, stiffness = (
        np.array(m, dtype=float) for m in (matrices.mass, matrices.damping, matrices.stiffness)
    )
    nut = {axis: np.array(row, dtype=float) for axis, row in matrices.nut}
    return Frame(
        mass, damping, stiffness, 0.0, nut,
        {axis: np.zeros(len(mass)) for axis in nut},
        {axis: np.array(row, dtype=float) for axis, row in matrices.tool},
        tuple(f"q{k + 1}" for k in range(len(mass))),
    )  # fmt: skip


def _built(structure: Structure) -> Frame:
    count = 6 * len(structure.bodies)
    mass, damping, stiffness = (np.zeros((count, count)) for _ in range(3))
    for n, body in enumerate(structure.bodies):
        own = range(6 * n, 6 * n + 6)
        mass[own, own] = [body.mass] * 3 + list(body.inertia)
    for joint in structure.joints:
        for point in joint.points:
            apart = _moved(structure, joint.between[0], point)
            apart = apart - _moved(structure, joint.between[1], point)
            for row, k, c in zip(apart, joint.stiffness, joint.damping, strict=True):
                stiffness += PER_UM * k * np.outer(row, row)
                damping += PER_MM * c * np.outer(row, row)
    screws = {screw.axis: screw for screw in structure.screws}
    tool = _moved(structure, structure.tool, structure.at)
    tool = tool - _moved(structure, structure.workpiece, structure.at)
    return Frame(
        mass, damping, stiffness, structure.damping,
        {axis: _nut(structure, screw) for axis, screw in screws.items()},
        {axis: _turned(structure, screw) for axis, screw in screws.items()},
        {axis: tool[k] for axis, k in DIRECTION.items()},
        tuple(f"{b.name} {c}" for b in structure.bodies for c in ("x", "y", "z", "a", "b", "c")),
    )  # fmt: skip


def _moved(structure: Structure, name: str, point: Vector) -> Array:
    """What a point of a body moves for each coordinate, shape (3, n); nothing of the ground."""
    rows = np.zeros((3, 6 * len(structure.bodies)))
    if name == GROUND:
        return rows
    k = [body.name for body in structure.bodies].index(name)
    x, y, z = MM * (np.array(point) - np.array(structure.bodies[k].at))
    rows[:, 6 * k : 6 * k + 3] = np.eye(3)
    # A small rotation r moves the point by r x (x, y, z).
    rows[:, 6 * k + 3 : 6 * k + 6] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return rows


def _nut(structure: Structure, screw: Screw) -> Array:
    """What the nut moves along its screw."""
    moved = _moved(structure, screw.moves, screw.at) - _moved(structure, screw.carried_by, screw.at)
    row: Array = moved[DIRECTION[screw.axis]]
    return row


def _turned(structure: Structure, screw: Screw) -> Array:
    """What the motor's housing turns about the screw."""
    row = np.zeros(6 * len(structure.bodies))
    if screw.carried_by != GROUND:
        k = [body.name for body in structure.bodies].index(screw.carried_by)
        row[6 * k + 3 + DIRECTION[screw.axis]] = 1.0
    return row


def modal_damping(mass: Array, stiffness: Array, ratio: float) -> Array:
    """Damping that gives every elastic mode of masses and springs the same ratio.

    Parameters
    ----------
    mass, stiffness : ndarray, shape (n, n)
        Symmetric, `mass` positive definite.
    ratio : float
        Damping ratio. [-]

    Returns
    -------
    ndarray, shape (n, n)
        Of rigid motion it takes nothing.

    Examples
    --------
    >>> modal_damping(np.array([[2.0]]), np.array([[8.0]]), 0.1)
    array([[0.8]])
    """
    root = np.linalg.cholesky(mass)
    inverse = np.linalg.inv(root)
    square, shapes = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    omega = np.sqrt(np.clip(square, 0.0, None))
    omega[omega < RIGID * omega.max(initial=0.0)] = 0.0
    own = root @ shapes
    damping: Array = (own * (2.0 * ratio * omega)) @ own.T
    return damping
