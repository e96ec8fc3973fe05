"""The keys of drives and structures: what `simulate` needs and nothing else looks at.

This module owns them; `table` puts them among the others.
"""

from __future__ import annotations

from gcodejerk.machine.drives import FEEDBACKS, TABLE
from gcodejerk.machine.file.kinds import Choice, Key, ListOf, Number, Section, Text

_POSITIVE = Number("kg", above=0.0)
_NAME = Text(r"[A-Za-z][A-Za-z0-9_ -]{0,59}", "a name of at most 60 letters, digits, - and _")
_FILE = Text(r"[^\x00-\x1f\x7f-\x9f\u2028\u2029]{1,1000}", "the name of an .npz file")
_POINT = ListOf(Number("mm"), at_most=3, exactly=True)
_PAIR = ListOf(_NAME, at_most=2, exactly=True)

_FRICTION = Section(
    (
        Key("coulomb", Number("N", at_least=0.0), "While the axis slides fast.", required=True,
            example="120"),
        Key("static", Number("N", at_least=0.0),
            "At which it breaks away. Left out: as coulomb.", example="180"),
        Key("stribeck", Number("mm/s", above=0.0),
            "Speed at which the difference of the two has fallen to 1/e. Left out: 2 mm/s.",
            example="2"),
        Key("at", Choice((TABLE, "motor")),
            "table: in the guides. motor: in screw, nut and bearings, as a force at the nut. Left "
            "out: table.", example="table"),
    )
)  # fmt: skip

SERVO = Key("servo", Section(
    (
        Key("kpp", Number("1/s", above=0.0), "Position loop gain; or kv.", example="40"),
        Key("kv", Number("m/min/mm", above=0.0),
            "The same in m/min for each mm of lag: 1 is a kpp of 16.67.", example="2.4"),
        Key("velocity_bandwidth", Number("rad/s", above=0.0),
            "Gain of the velocity loop over the inertia that it turns (motor, screw and mass).",
            required=True, example="240"),
        Key("integral", Number("1/s", at_least=0.0),
            "Integral gain of the velocity loop. Left out: none.", example="60"),
        Key("current_lag", Number("s", at_least=0.0, at_most=1.0),
            "Time constant of the current loop. Left out: none.", example="0.0005"),
        Key("feedforward", Number("-", at_least=0.0, at_most=2.0),
            "Share of the commanded velocity that is fed forward. Left out: none.", example="0.7"),
        Key("acceleration_feedforward", Number("-", at_least=0.0, at_most=2.0),
            "Share of the force for the commanded acceleration that is fed forward. Left out: "
            "none.",
            example="1"),
        Key("feedback", Choice(FEEDBACKS),
            "motor: an encoder on it (semi-closed). table: a scale (full-closed). Left out: motor.",
            example="motor"),
        Key("mass", _POSITIVE, "Of what the axis carries.", required=True, example="250"),
        Key("inertia", Number("kg m^2", above=0.0, smallest=1e-12),
            "Of motor, coupling and screw.", required=True, example="0.03"),
        Key("lead", Number("mm", above=0.0), "Of the screw, for one turn.", required=True,
            example="10"),
        Key("stiffness", Number("N/um", above=0.0),
            "Along the axis, of screw, nut, bearings and coupling together.", required=True,
            example="150"),
        Key("damping", Number("N s/mm", at_least=0.0), "Of the same. Left out: none.",
            example="8"),
        Key("guide_damping", Number("N s/mm", at_least=0.0),
            "Viscous friction of the guides. Left out: none.", example="2"),
        Key("motor_damping", Number("N m s/rad", at_least=0.0),
            "Viscous friction of the motor's shaft. Left out: none.", example="0.01"),
        Key("friction", _FRICTION,
            "Dry friction of the axis: simulation then goes in fine steps.",
            example="{coulomb: 120, static: 180}"),
    )),
    "The axis's drive, for `gcodejerk simulate`; planning does not look at it. Left out: the axis "
    "is where it is told to be.",
    example="{kpp: 40, velocity_bandwidth: 240, mass: 250, inertia: 0.03, lead: 10, "
    "stiffness: 150}")  # fmt: skip

_BODY = Section(
    (
        Key("name", _NAME, "What joints call it.", required=True, example="column"),
        Key("mass", _POSITIVE, "Of the body.", required=True, example="520"),
        Key("size", _POINT, "Of a box of the same inertia, along X, Y and Z; or inertia.",
            example="[600, 500, 1300]"),
        Key("inertia", ListOf(Number("kg m^2", above=0.0), at_most=3, exactly=True),
            "About X, Y and Z through the centre of mass.", example="[84, 89, 26]"),
        Key("at", _POINT, "Centre of mass.", required=True, example="[0, 600, 1400]"),
    )
)  # fmt: skip
_JOINT = Section(
    (
        Key("between", _PAIR, "Two bodies, or one and `ground`.", required=True,
            example="[column, bed]"),
        Key("points", ListOf(_POINT, at_most=1000), "Where its springs are.", required=True,
            example="[[-250, 400, 750], [250, 400, 750]]"),
        Key("stiffness", ListOf(Number("N/um", at_least=0.0), at_most=3, exactly=True),
            "Of each spring along X, Y and Z; 0 along a guide.", required=True,
            example="[132, 132, 189]"),
        Key("damping", ListOf(Number("N s/mm", at_least=0.0), at_most=3, exactly=True),
            "The same of each damper. Left out: none.", example="[1, 1, 1]"),
    )
)  # fmt: skip
_SCREW = Section(
    (
        Key("axis", Choice(("X", "Y", "Z")), "Whose servo turns it.", required=True, example="Z"),
        Key("moves", _NAME, "The body with the nut.", required=True, example="head"),
        Key("carried_by", _NAME, "The body with motor and bearings.", required=True,
            example="column"),
        Key("at", _POINT, "Where the nut pulls.", required=True, example="[0, 350, 1550]"),
    )
)  # fmt: skip
STRUCTURE = Key("structure", Section(
    (
        Key("bodies", ListOf(_BODY, at_most=100), "Rigid parts; each has six coordinates."),
        Key("joints", ListOf(_JOINT, at_most=1000), "Springs and dampers between them."),
        Key("screws", ListOf(_SCREW, at_most=3), "What the axes' servos pull at."),
        Key("damping", Number("-", at_least=0.0, below=1.0),
            "Damping ratio of every elastic mode of masses and springs. Left out: none.",
            example="0.02"),
        Key("tool", _NAME, "The body that holds the tool.", example="head"),
        Key("workpiece", _NAME, "The body that holds the workpiece.", example="table"),
        Key("at", _POINT, "Where tool and workpiece meet.", example="[0, -100, 1100]"),
        Key("file", _FILE,
            "In place of all this: M, K and perhaps C [SI], nut_X.. and tool_X.. for each axis, in "
            "an .npz file that is named from the folder of this one.", example="structure.npz"),
    )),
    "What the machine is built of, for `gcodejerk simulate` and `gcodejerk machine reduce`; every "
    "axis that moves a body of it needs its servo.",
    example="{file: structure.npz}")  # fmt: skip
