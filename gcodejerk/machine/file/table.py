"""Every key of a machine file: what it holds, in which unit, within which bounds, and why.

Rule: this table is the only place that knows a key. The checker, the conversion of units and the
JSON Schema for editors all read it, so a key that is added here exists everywhere.

Rule: defaults and bounds are in the package's own units (mm or deg, s, Hz). A unit that begins with
`mm` is a length's: it reads `inch` under `units: inch`, and `deg` on a rotary axis.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from gcodejerk.axes import AXES
from gcodejerk.machine.file.drive_keys import SERVO, STRUCTURE
from gcodejerk.machine.file.kinds import (
    Choice,
    Flag,
    Key,
    Kind,
    ListOf,
    Number,
    OrMapping,
    Pair,
    Section,
    Table,
    Text,
)
from gcodejerk.machine.parts import FILTERS, PLANNERS

SCHEMA_VERSION = 1

PROFILES = (
    "conventional", "condition1", "condition2", "condition3", "symmetric", "cascade", "optimal",
    "shortest",
    "zv", "zvd", "ei", "mzv", "fir", "posicast",
)  # fmt: skip

DIALECT_OF_CONTROLLER = {
    "csv": "linuxcnc",
    "linuxcnc": "linuxcnc",
    "linuxcnc-hal": "linuxcnc",
    "fanuc": "fanuc",
    "haas": "haas",
    "siemens": "siemens",
    "heidenhain": "heidenhain-iso",
    "grbl": "grbl",
    "mach": "mach",
    "marlin": "marlin",
    "klipper": "klipper",
    "kalico": "klipper",
    "rrf": "marlin",
    "smoothieware": "marlin",
    "grblhal": "grbl",
    "fluidnc": "grbl",
    "g2core": "grbl",
    "kflop": "mach",
    "fagor": "fagor",
    **dict.fromkeys(("acs", "csp", "elmo", "galil", "json", "pmac", "ros2"), "linuxcnc"),
    "fanuc15": "fanuc",
}
"""How programs are read where the file does not say; `auto` for a controller that is not here."""

CONFIRMABLE = ("acs-pvspline", "pmac-colon")
"""Facts that no manual at hand shows: see the emitters that ask for them."""


_NAME = Text(r"[^\x00-\x1f\x7f-\x9f\u2028\u2029]{1,200}", "a name of at most 200 characters")
_WORD = Text(r"[a-z][a-z0-9_.+-]*", "a name in lower case")
_FILE = Text(r"[^\x00-\x1f\x7f-\x9f\u2028\u2029]{1,1000}", "the name of a CSV file")
_LENGTH = Number("mm")
_LETTERS = f"[{AXES}]"
_AXIS_NAMES = f"an axis: {', '.join(AXES)}"
_POSITIONS = Table(((_LETTERS, _LENGTH),), _AXIS_NAMES, tuple(AXES))
_M_CODES = ListOf(Text(r"[Mm][0-9]{1,4}", "a code such as M8"), at_most=100)


_PLANNER = Key("planner", Choice(PLANNERS),
    "Which profile the control's own G0 follows. linuxcnc-2.9: trapezoidal velocity, with half of "
    "the acceleration (MAX_ACCELERATION) where no other motion follows; trapezoidal; jerk-limited; "
    "bell: a trapezoid of velocity averaged over acceleration/jerk; averaged-trapezoid: the same "
    "over second_average (Fanuc, constant acceleration); time-constants: two averages of fixed "
    "times (Fanuc, linear and bell); four-ramp: four jerks (TwinCAT, ISG); two-stage: two "
    "accelerations (TwinCAT without jerk limit); quintic (TinyG, g2core: velocity and jerk); "
    "poly5, poly6 (Marlin, M494); notch-ramp (Kalico). Left out: linuxcnc-2.9 with controller: "
    "linuxcnc and no jerk; else jerk-limited with a jerk, trapezoidal without.",
    example="jerk-limited")  # fmt: skip
_TIME = Number("s", at_least=0.0, at_most=10.0)
_ACCELERATION = Number("mm/s^2", above=0.0)
_LAW = (
    Key("first_average", _TIME,
        "time-constants: moving average of the commanded velocity (Fanuc 1620, linear).",
        example="0.1"),
    Key("second_average", _TIME,
        "time-constants, averaged-trapezoid: second moving average (Fanuc 1621, bell).",
        example="0.032"),
    Key("deceleration", _ACCELERATION,
        "four-ramp, two-stage: deceleration (P-AXIS-00002; 00281). Left out: as acceleration.",
        example="5000"),
    Key("rise", _TIME, "four-ramp: acceleration builds up (P-AXIS-00196).", example="0.01"),
    Key("fall", _TIME, "four-ramp: acceleration is released (P-AXIS-00195).", example="0.03"),
    Key("braking_rise", _TIME, "four-ramp: deceleration builds up (P-AXIS-00198).",
        example="0.03"),
    Key("braking_fall", _TIME, "four-ramp: deceleration is released (P-AXIS-00197).",
        example="0.01"),
    Key("changeover", Number("mm/s", above=0.0),
        "two-stage: speed between acceleration and upper_acceleration (P-AXIS-00211).",
        example="100"),
    Key("upper_acceleration", _ACCELERATION,
        "two-stage: acceleration above changeover (P-AXIS-00006).", example="3000"),
    Key("upper_deceleration", _ACCELERATION,
        "two-stage: deceleration above changeover (P-AXIS-00280). Left out: as "
        "upper_acceleration.", example="3000"),
    Key("overshoot", Number("-", at_least=1.0, at_most=2.0),
        "poly6: peak of the acceleration over the set one (M494 O).", example="1.5"),
    Key("notch", Number("Hz", above=0.0), "notch-ramp: the frequency that ramps leave alone.",
        example="30"),
)  # fmt: skip
"""What planners need besides, and nobody else."""
_FILTER = Key("filter", Section(
    (
        Key("type", Choice(FILTERS),
            "average, triangle (the average twice), or an input shaper: zv, zvd, mzv and ei as "
            "published; zvdd, zvddd, 2hei, 3hei, marlin-mzv (Marlin); klipper-ei, 2hump_ei, "
            "3hump_ei (Klipper); ei2, ei3 (RepRapFirmware).", required=True, example="average"),
        Key("time", Number("s", above=0.0, smallest=1e-5, at_most=10.0),
            "Of the average (Siemens MD32410).", example="0.032"),
        Key("frequency", Number("Hz", above=0.0), "That the shaper is made for.", example="30"),
        Key("damping", Number("-", at_least=0.0, below=1.0),
            "Damping ratio that the shaper is made for; most controls have 0.1 unless they are "
            "told.", example="0.05"),
    )),
    "What acts on the axis behind the planner: a moving average or an input shaper. The same for "
    "all axes under positioning: linear.",
    example="{type: average, time: 0.032}")  # fmt: skip


def _limits(required: bool, doc: str) -> Section:
    """Keys of `rapid` (required) and of `limit`, which falls back on it."""
    return Section(
        (
            Key("velocity", Number("mm/s", above=0.0), f"Velocity {doc}.", required,
                example="600"),
            Key("acceleration", Number("mm/s^2", above=0.0), f"Acceleration {doc}.", required,
                example="5000"),
            Key("jerk", Number("mm/s^3", above=0.0), f"Jerk {doc}. " + (
                "Left out: the controller moves with trapezoidal velocity." if required else
                "Left out: ten times that of rapid, or no limit where rapid has none."),
                example="5.0e+5"),
            *((_PLANNER, *_LAW, _FILTER) if required else ()),
        )
    )  # fmt: skip


def _mode(participation: Kind, doc: str, required: bool) -> Section:
    return Section(
        (
            Key("name", _NAME, "What reports call the mode. Left out: its frequency."),
            Key("frequency", Number("Hz", above=0.0),
                "Natural frequency, below half the sampling rate 1/interval.",
                required=True, example="30"),
            Key("damping", Number("-", at_least=0.0, below=1.0),
                "Damping ratio: 0 rings for ever, machine tools have 0.01 to 0.1.",
                default=0.0, example="0.02"),
            Key("participation", participation, doc, required,
                example="{Y: 0.4, Z: 1.0}" if required else "1.0"),
        )
    )  # fmt: skip


_SPECTRUM = Key("spectrum", OrMapping(_FILE, Section(
    (
        Key("file", _FILE, "The CSV file.", required=True, example="resonances_x.csv"),
        Key("participation", Number("-", at_least=0.0),
            "How strongly the axis excites what was measured.", default=1.0, example="1.0"),
    ))),
    "A measured spectrum in place of modes: Klipper's resonances or plain frequency [Hz] and PSD, "
    "a CSV file that is named from the folder of this one. For a participation other than 1: "
    "{file: FILE, participation: NUMBER}.",
    example="resonances_x.csv")  # fmt: skip

_AXIS = Section(
    (
        Key("type", Choice(("linear", "rotary")),
            "Whether the axis slides [mm] or turns [deg]. Left out: A, B and C turn. Rapids that "
            "move one of these which slides are rewritten in programs in mm alone, and with "
            "units: mm: in inches, controls differ in what their words mean."),
        Key("wrap", Choice(("none", "shortest", "sign")),
            "How a rotary axis goes to an absolute position: none, through all angles like a "
            "linear axis; shortest, the shorter way round (Fanuc 1008 and Haas with roll-over); "
            "sign, forwards to a positive number and backwards to a negative one (LinuxCNC's "
            "WRAPPED_ROTARY). Left out: unknown, and its absolute rapids are left alone.",
            example="none"),
        Key("diameter", Flag(), "Programs give diameters of this axis (a lathe's X). "
            "This file gives radii all the same.", default=False),
        Key("resolution", Number("mm", above=0.0), "The smallest step that is written.",
            default=1e-4, example="1.0e-4"),
        Key("rapid", _limits(True, "of the controller's own G0"),
            "What the controller's own G0 is set to today: with planner, the conventional time.",
            required=True, example="{velocity: 600, acceleration: 5000, jerk: 5.0e+5}"),
        Key("limit", _limits(False, "that a designed profile may use"),
            "What a designed profile may use; what is left out is as in rapid."),
        Key("travel", Pair(_LENGTH), "Lowest and highest machine coordinate.",
            example="[-400, 50]"),
        Key("modes", OrMapping(
            ListOf(
                _mode(
                    Number("-", at_least=0.0),
                    "How strongly the axis excites the mode: mm at the tool for each mm, or each "
                    "degree, of the axis. Left out: 1, but a rotary axis has to say it.",
                    False,
                ),
                at_most=100),
            Section((replace(_SPECTRUM, required=True),))),
            "Modes that this axis alone excites, as a list; or {spectrum: FILE}, which is the key "
            "spectrum."),
        _SPECTRUM,
        SERVO,
    )
)  # fmt: skip


def _along(doc: str) -> Section:
    """Keys of `path.rapid` and `path.limit`."""
    return Section(
        (
            Key("velocity", Number("mm/s", above=0.0), f"Velocity along the path {doc}.",
                example="300"),
            Key("acceleration", Number("mm/s^2", above=0.0), f"Acceleration along the path {doc}.",
                example="3000"),
        )
    )  # fmt: skip


_PATH = Section(
    (
        Key("rapid", _along("of the controller's own G0. Left out: not bounded"),
            "What the controller's own G0 is set to today.", required=True,
            example="{velocity: 300, acceleration: 3000}"),
        Key("limit", _along("that a designed profile may use. Left out: as in rapid"),
            "What a designed profile may use; what is left out is as in rapid."),
    )
)  # fmt: skip

_DESIGN = Section(
    (
        Key("profile", Choice(PROFILES), "How a rapid moves.", default="condition3"),
        Key("band", Number("-", at_least=0.0, below=1.0),
            "Relative frequency error to be robust to, for every profile; 0 where the modes are "
            "exact.", default=0.10, example="0.10"),
        Key("guard", Number("-", at_least=0.0),
            "What frequencies that the file does not name may keep after an optimal rapid, times "
            "what today's leaves there; 0: anything.", default=1.0, example="1"),
        Key("tolerance", Number("mm", above=0.0), "Residual that counts as settled.",
            default=0.001, example="0.001"),
        Key("minimum_length", Number("mm", at_least=0.0), "Shorter rapids are left alone.",
            default=0.05, example="0.05"),
        Key("max_extension", Number("-", at_least=0.0),
            "How much longer a move may take where the limits make its conventional time "
            "impossible, as a part of that time.", default=0.10, example="0.10"),
    )
)  # fmt: skip

_SETTING = Number("mm", at_least=0.0, at_most=1000.0)
_CYCLES = Section(
    (
        Key("chip_retract", _SETTING,
            "How far G73 goes back behind each peck (Fanuc parameter 5114, Haas setting 22). Left "
            "out: unknown, and G73 is not written out.", example="0.5"),
        Key("peck_clearance", _SETTING,
            "How far above its last depth G83 ends the rapid back down (Fanuc parameter 5115, Haas "
            "setting 22). Left out: unknown, and G83 is not written out.", example="0.5"),
        Key("clear_above_r", _SETTING,
            "How far above R G83 goes up between its pecks (Haas setting 52). Left out: unknown, "
            "and G83 of a Haas is not written out.", example="0"),
        Key("boring_out", Choice(("feed",)),
            "How G85 and G89 come out of the hole: feed, with the feed in force at 100 % (Fanuc: "
            "parameters 5104#1 and 5149 change that). Left out: unknown, and they are not written "
            "out.", example="feed"),
        Key("without_xy", Choice(("drills",)),
            "What a Haas does in a block that states a cycle without X and Y: drills, where the "
            "tool stands (setting 28 is on). Left out: unknown, and such blocks are not written "
            "out.", example="drills"),
    )
)  # fmt: skip

_PROGRAM = Section(
    (
        Key("start", _POSITIONS, "Where the axes are, in program coordinates.",
            example="{X: 0, Y: 0, Z: 100}"),
        Key("offsets", Table(
            (
                (r"G5[4-9](\.[1-9])?|G54\.1 ?P[1-9][0-9]{0,2}|G5(0[5-9]|[1-9][0-9])", _POSITIONS),
                (r"H[0-9]{1,4}", _LENGTH),
            ),
            "a work offset such as G54 or a tool length such as H1",
            ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3", "H1")),
            "Work offsets, and tool lengths, that are known. Where there are any, programs begin "
            "without G92 and, until they say so, without a tool length.",
            example="{G54: {X: 10}, H1: 87.2}"),
        Key("decimal_point", Choice(("calculator", "standard")),
            "What X100 without a decimal point is, where a parameter of the control decides (Fanuc "
            "3401, Haas setting 162): calculator 100 mm, standard 0.1 mm (100 least increments of "
            "0.001 mm or 0.0001 inch). Left out: unknown, and such rapids are left alone.",
            example="calculator"),
        Key("resume_after_stop", Choice(("same", "unknown")),
            "Where the axes stand when the program goes on behind M0 or M1: in the same place, or "
            "wherever somebody has moved them by hand. Left out: same for linuxcnc, unknown "
            "elsewhere.", example="unknown"),
        Key("harmless", ListOf(
            Text(r"[Gg][0-9]{1,3}(\.[0-9])?|[Mm][0-9]{1,4}", "a code such as M150 or G187"),
            at_most=200),
            "Codes of the machine's builder that move no axis and change no mode and no frame: "
            "lamps, doors, chip conveyors, counters. One that the dialect itself knows keeps its "
            "meaning.", example="[M62, M150, G187]"),
        Key("home", _POSITIONS,
            "Where G28 leads the axes, in machine coordinates (LinuxCNC: parameters 5161 to 5169).",
            example="{X: 0, Y: 0, Z: 0}"),
        Key("tool_change", _POSITIONS,
            "Where the axes stand behind M6, in machine coordinates; an axis that is not named has "
            "not moved, and T alone moves nothing; {} where a tool change moves nothing at all. "
            "Left out: nobody knows where the axes stand behind M6.",
            example="{Z: 0}"),
        Key("m_before", _M_CODES,
            "M codes that the control runs before the motion of their block, where the builder of "
            "the machine decides (Fanuc, Haas, Siemens).", example="[M3, M4]"),
        Key("m_after", _M_CODES,
            "M codes that it runs when the motion of their block has ended.",
            example="[M5, M9]"),
        Key("cycles", _CYCLES,
            "What settings of a Fanuc or Haas decide about its drilling cycles, for "
            "--expand-cycles."),
        Key("unrolled_lines", Number("lines", at_least=1, at_most=1e6),
            "Lines that --unroll may write a program's loops and calls out as, at most. Left out: "
            "100000.", example="20000"),
        Key("subprograms", Text(r".*\S.*", "a folder"),
            "Folder with the subprograms that programs call in other files, as the control has "
            "them (O1000.nc, L54.SPF, name.ngc); named from the folder of this file. Left out: "
            "behind such a call nothing is known.", example="subprograms"),
        Key("startup", Text(r"(\s*[A-Za-z][+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+))*\s*", "G-code words"),
            "The codes in force when a program starts (LinuxCNC: RS274NGC_STARTUP_CODE).",
            default="", example='"G17 G21 G40 G49 G54 G64 P0.01 G80 G90 G94"'),
    )
)  # fmt: skip

_CONTROLLER_PARAMETER = Section(
    (
        Key("number", Text(r"\S+( \S+)*", "the number or name of a setting"),
            "As the control calls it: 1620, MD32431, $120.", required=True, example="1620"),
        Key("axis", Choice(tuple(AXES)),
            "The axis that it belongs to. Left out: all of them.", example="X"),
        Key("unit", Text(r"\S+", "a unit such as ms, us, s, mm/s^2 or m/s^3"),
            "In which the control takes it. Left out: as the setup sheet says.", example="ms"),
        Key("meaning", Text(r".*", "text"), "For the reader.", default="",
            example="bell time of rapids"),
        Key("old", Text(r"\S+", "a number or a word of the control"), "What it is set to today.",
            example="100"),
    )
)  # fmt: skip

_CONTROLLER_OPTIONS = Section(
    (
        Key("version", Choice(("2.9", "2.10")),
            "Of LinuxCNC. Left out: unknown; streams were played on 2.9.", example="2.9"),
        Key("planner_type", Choice(("0", "1")),
            "LinuxCNC 2.10: [TRAJ] PLANNER_TYPE, 0 trapezoidal, 1 S-curves, which stop in every "
            "block of a stream.", example="0"),
        Key("servo_period", Number("s", above=0.0, smallest=1e-6, at_most=1.0),
            "LinuxCNC: what `halcmd show thread` says of the servo thread (with a BASE_PERIOD of "
            "30000 ns, 1 ms becomes 0.99 ms); interval has to be the same.", example="0.001"),
        Key("optimization_depth", Number("-", at_least=20.0, at_most=100000.0),
            "LinuxCNC: [TRAJ] ARC_BLEND_OPTIMIZATION_DEPTH, the blocks that it looks ahead.",
            default=50.0, example="50"),
        Key("max_acceleration", Table(
            ((_LETTERS, Number("mm/s^2", above=0.0)),), _AXIS_NAMES, tuple(AXES)),
            "LinuxCNC: MAX_ACCELERATION of axes when streams run, at least 1.05 times what "
            "profiles use. Left out: 1.05 times limit.acceleration.", example="{X: 5040, Z: 6300}"),
        Key("override_guard", Flag(),
            "LinuxCNC: run a stream at 100 % rapid and feed override only, else the original block "
            "(M66 E3, #5399, O-words: docs/linuxcnc-guard.md); needs the HAL lines of `gcodejerk "
            "install linuxcnc INI --form guard`.",
            default=False),
        Key("counts_per_unit", Table(
            ((_LETTERS, Number("counts per mm or degree", above=0.0)),), _AXIS_NAMES, tuple(AXES)),
            "Galil, Elmo, CSP, Fanuc 15i: counts (Fanuc: least increments) of each axis for 1 mm, "
            "or for 1 degree of a rotary axis, also under units: inch.",
            example="{X: 1000, Z: 1000}"),
        Key("axis_names", Table(
            ((_LETTERS, Text(r"[A-Za-z0-9_][A-Za-z0-9_./-]{0,59}", "a name of at most 60 "
            "characters")),), _AXIS_NAMES, tuple(AXES)),
            "What the controller calls each axis: a joint (ROS 2), a letter (Galil, PMAC), a "
            "number (ACS, Fanuc 15i: the place in the record, from 1).",
            example="{X: joint_x, Z: joint_z}"),
        Key("isx90", Number("ms", above=0.0), "PMAC: Isx90 of the coordinate system, the unit of "
            "time of velocities.", example="1000"),
        Key("fanuc_distance", Choice(("general", "special")),
            "Fanuc 15i: the format of distances in the remote buffer (parameter 7609#2, RDS).",
            example="general"),
        Key("confirmed", ListOf(Choice(CONFIRMABLE), at_most=len(CONFIRMABLE)),
            "Facts that nobody could verify for us, and you have with your manual: lines that rest "
            "on them are comments otherwise (docs/points.md).", example="[pmac-colon]"),
    )
)  # fmt: skip

MACHINE: Final = Section(
    (
        Key("schema", Choice((str(SCHEMA_VERSION),)), "Version of this format.",
            default=str(SCHEMA_VERSION), example="1"),
        Key("name", _NAME, "What reports call the machine. Left out: the name of the file."),
        Key("controller", _WORD, "What output is written for.", default="linuxcnc",
            example="linuxcnc"),
        Key("dialect", _WORD, "How programs are read: linuxcnc, fanuc, haas, siemens, "
            "heidenhain-iso, grbl, mach, marlin, klipper or auto. Left out: the controller's own.",
            example="linuxcnc"),
        Key("units", Choice(("mm", "inch")), "Unit of the lengths in this file.", default="mm"),
        Key("interval", Number("s", above=0.0, smallest=1e-6, at_most=1.0),
            "The control command interval.", required=True, example="0.001"),
        Key("positioning", Choice(("linear", "independent")),
            "linear: G0 is a straight line, all axes together; independent: each axis on its own.",
            required=True),
        Key("spindle", Choice(("mill", "laser", "plasma")),
            "What M3 turns on. A beam is dark in G0 and burns in G1, so with laser and plasma "
            "rapids are left alone while it is on. Left out: unknown where the dialect's controls "
            "drive beams too (grbl, mach, marlin, klipper), a mill elsewhere.", example="mill"),
        Key("path", _PATH,
            "What the control bounds along the path, of all linear axes together (Klipper's "
            "max_velocity and max_accel, M204 T of Marlin and RepRapFirmware, LinuxCNC's "
            "MAX_LINEAR_VELOCITY), with positioning: linear. Left out: axes are bounded one by "
            "one.", example="{rapid: {velocity: 300, acceleration: 3000}}"),
        Key("axes", Table(((_LETTERS, _AXIS),), _AXIS_NAMES, tuple(AXES), at_least=1),
            "The axes that the machine has.", required=True,
            example="{Z: {rapid: {velocity: 600, acceleration: 5000}}}"),
        Key("modes", ListOf(
            _mode(Table(((_LETTERS, Number("-")),), _AXIS_NAMES, tuple(AXES), at_least=1),
                  "How strongly each axis excites the mode.", True), at_most=100),
            "Structure modes, which several axes excite together."),
        STRUCTURE,
        Key("design", _DESIGN, "How profiles are chosen."),
        Key("controller_options", _CONTROLLER_OPTIONS,
            "What is set in the control and streams depend on; of LinuxCNC in this version."),
        Key("controller_parameters", ListOf(_CONTROLLER_PARAMETER, at_most=200),
            "Settings of the control that its owner has confirmed: what `gcodejerk parameters` "
            "knows from hearsay only, it writes for these alone."),
        Key("program", _PROGRAM, "What a program may assume when it starts."),
    )
)  # fmt: skip
