"""What moves a machine and what it is built of: drives, bodies, joints.

This module owns what a machine file may say beyond its modes, for `gcodejerk.simulation` to make
equations of motion from; planning never looks at it.

Rule: lengths are mm, everything else is SI (kg, kg m^2, N, s, rad); stiffness is N/um, damping
N s/mm, as catalogues have them.
"""

from __future__ import annotations

from dataclasses import dataclass, field

GROUND = "ground"
"""What a machine stands on, in the place of a body."""
MOTOR, TABLE = "motor", "table"
FEEDBACKS = (MOTOR, TABLE)
"""Where position is measured: on the motor (semi-closed), or by a scale (full-closed)."""
Vector = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry friction that an axis moves against.

    .. math:: F(v) = F_c + (F_s - F_c) e^{-(v / v_s)^2}
    """

    coulomb: float
    """While it slides fast. [N]"""
    static: float
    """At which it breaks away, at least `coulomb`. [N]"""
    stribeck: float
    """Speed at which the difference of the two has fallen to 1/e. [mm/s]"""
    at: str = TABLE
    """`table`: in the guides; `motor`: in screw, nut and bearings, as a force at the nut."""


@dataclass(frozen=True, slots=True)
class Servo:
    """One axis's drive: P position, PI velocity, current lag, screw, table."""

    kpp: float
    """Position loop gain. [1/s]"""
    velocity_bandwidth: float
    """Velocity loop gain over the inertia that it turns. [rad/s]"""
    mass: float
    """Of what the axis carries. [kg]"""
    inertia: float
    """Of motor, coupling and screw. [kg m^2]"""
    lead: float
    """Of the screw, for one turn. [mm]"""
    stiffness: float
    """Of the screw, nut, bearings and coupling, along the axis. [N/um]"""
    damping: float = 0.0
    """Of the same. [N s/mm]"""
    guide_damping: float = 0.0
    """Viscous friction of the guides. [N s/mm]"""
    motor_damping: float = 0.0
    """Viscous friction of the motor's shaft. [N m s/rad]"""
    integral: float = 0.0
    """Integral gain of the velocity loop. [1/s]"""
    current_lag: float = 0.0
    """Time constant of the current loop; 0 for an ideal one. [s]"""
    feedforward: float = 0.0
    """Share of the commanded velocity that is fed forward. [-]"""
    acceleration_feedforward: float = 0.0
    """Share of the force for the commanded acceleration that is fed forward. [-]"""
    feedback: str = MOTOR
    """One of `FEEDBACKS`."""
    friction: Friction | None = None


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid part of the structure."""

    name: str
    mass: float
    """[kg]"""
    inertia: Vector
    """About x, y and z through the centre of mass. [kg m^2]"""
    at: Vector
    """Centre of mass. [mm]"""


@dataclass(frozen=True, slots=True)
class Joint:
    """Springs and dampers between two bodies, the same at several points."""

    between: tuple[str, str]
    """Names of bodies, or `GROUND`."""
    points: tuple[Vector, ...]
    """[mm]"""
    stiffness: Vector
    """Along x, y and z, at each point. [N/um]"""
    damping: Vector = (0.0, 0.0, 0.0)
    """The same. [N s/mm]"""


@dataclass(frozen=True, slots=True)
class Screw:
    """Where an axis's screw pulls."""

    axis: str
    moves: str
    """The body with the nut."""
    carried_by: str
    """The body with motor and bearings."""
    at: Vector
    """[mm]"""


@dataclass(frozen=True, slots=True)
class Matrices:
    """A structure from elsewhere: SI units, n coordinates, the motors' rotors not among them."""

    source: str = field(compare=False)
    """The file, as the machine file names it."""
    mass: tuple[tuple[float, ...], ...]
    stiffness: tuple[tuple[float, ...], ...]
    damping: tuple[tuple[float, ...], ...]
    nut: tuple[tuple[str, tuple[float, ...]], ...]
    """Axis -> what the nut moves along the axis, for each coordinate. [-]"""
    tool: tuple[tuple[str, tuple[float, ...]], ...]
    """Axis -> what the tool moves against the workpiece along it, for each coordinate. [-]"""


@dataclass(frozen=True, slots=True)
class Structure:
    """Bodies on joints, moved by the axes' screws; or matrices that stand for all of it."""

    bodies: tuple[Body, ...] = ()
    joints: tuple[Joint, ...] = ()
    screws: tuple[Screw, ...] = ()
    damping: float = 0.0
    """Damping ratio of every elastic mode of masses and springs, beside the joints' own. [-]"""
    tool: str = ""
    """The body that holds the tool."""
    workpiece: str = ""
    """The body that holds the workpiece."""
    at: Vector = (0.0, 0.0, 0.0)
    """Where they meet. [mm]"""
    matrices: Matrices | None = None
