"""What a machine consists of: axes, what they may do, the modes in which it shakes.

Rule: a description is complete and legal. Every default has been filled in, every number is in mm
(or deg), s and Hz, and whatever a machine cannot be was refused with its place in the file; so no
user of these classes checks anything again.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.drives import Servo, Structure
from gcodejerk.machine.subprograms import Subprograms
from gcodejerk.start import CycleSettings, RapidFeed

OSCILLATORS = 4
"""That a line of a spectrum stands for."""
LINUXCNC, TRAPEZOIDAL, JERK_LIMITED, BELL = (
    "linuxcnc-2.9", "trapezoidal", "jerk-limited", "bell",
)  # fmt: skip
LAWS: Mapping[str, tuple[str, ...]] = {
    "averaged-trapezoid": ("second_average",),
    "time-constants": ("first_average", "second_average"),
    "four-ramp": ("deceleration", "rise", "fall", "braking_rise", "braking_fall"),
    "two-stage": ("changeover", "upper_acceleration", "deceleration", "upper_deceleration"),
    "quintic": ("jerk",),
    "poly5": (),
    "poly6": ("overshoot",),
    "notch-ramp": ("notch",),
}
"""Families of rapids that need quantities of their own beside velocity and acceleration; `motion`
has their laws."""
PLANNERS = (LINUXCNC, TRAPEZOIDAL, JERK_LIMITED, BELL, *LAWS)
"""The profiles that a control's own rapid may follow (`Axis.conventional`)."""
FALLS_BACK = {"deceleration": "acceleration", "upper_deceleration": "upper_acceleration"}
"""Quantities that may be left out: they are then like another."""
SHARED = ("overshoot", "notch")
"""Quantities that a control has one of, whatever axis moves."""
AVERAGES = ("average", "triangle")
FILTERS = (
    *AVERAGES,
    *("zv", "zvd", "zvdd", "zvddd", "mzv", "marlin-mzv", "ei", "2hei", "3hei"),
    *("klipper-ei", "2hump_ei", "3hump_ei", "ei2", "ei3"),
)
"""What may act behind the planner; the first two are set by a time, the others by a mode."""
STREAM_HEADROOM = 1.05
"""MAX_ACCELERATION of LinuxCNC over what streams use, to be played as planned."""
LONE_SHARE = 0.5
"""Share of MAX_ACCELERATION that LinuxCNC 2.9 gives a lone G0.

Played (2.9, 1 ms): under G64 a G0 that nothing follows in the queue (a dwell, an M code, a change
of tool or offset, the program's end) has half, since half is kept back for a blend that never
comes. One that another motion follows, and every one under G61 and G61.1, has all of it.
"""


@dataclass(frozen=True, slots=True)
class Limits:
    """What one axis may do at most."""

    velocity: float
    """[mm/s] or [deg/s]"""
    acceleration: float
    """[mm/s^2] or [deg/s^2]"""
    jerk: float
    """[mm/s^3] or [deg/s^3]; infinite where no jerk limit is given"""


@dataclass(frozen=True, slots=True)
class Filter:
    """What a control does to the motion that its planner has made."""

    kind: str
    """One of `FILTERS`."""
    time: float = 0.0
    """Of an average; a triangle is twice as long. [s]"""
    frequency: float = 0.0
    """That a shaper is made for. [Hz]"""
    damping: float = 0.0
    """The same. [-]"""

    @property
    def setting(self) -> float:
        """Time of an average [s], frequency of a shaper [Hz]."""
        return self.time if self.kind in AVERAGES else self.frequency


@dataclass(frozen=True, slots=True)
class Mode:
    """One way in which the machine vibrates, as an oscillator driven by the axes' acceleration."""

    name: str
    frequency: float
    """Undamped natural frequency. [Hz]"""
    damping: float
    """Damping ratio, at least 0 and below 1. [-]"""
    participation: tuple[tuple[str, float], ...]
    """How strongly each axis excites it, pairs in the order of `AXES`. [-]"""

    @property
    def axes(self) -> tuple[str, ...]:
        """The axes that excite this mode."""
        return tuple(axis for axis, _ in self.participation)

    def participation_of(self, axis: str) -> float:
        """How strongly an axis excites this mode [-], 0 for an axis that does not."""
        return next((amount for name, amount in self.participation if name == axis), 0.0)


@dataclass(frozen=True, slots=True)
class Spectrum:
    r"""How one axis shakes as it was measured: a line spectrum in place of modes.

    Every line stands for oscillators that the axis drives. With :math:`w_k` the share of
    line k in the energy (the PSD times the width that the line stands for, over the sum of all) and
    :math:`A_k = \omega_k^2 D_k` the acceleration amplitude that a move leaves in its oscillator,
    the residual of the move is

    .. math:: A = p \sqrt{\sum_k w_k A_k^2}, \qquad D = A / (2 \pi f_{peak})^2

    with the participation p: the spectrum-weighted mean, which is convex in the jerks. It is the
    acceleration that is weighted, since that is what the sensor measured: of the displacements the
    lines below 10 Hz, where it feels drift and the motion itself, would be most. A spectrum holds
    no phase, and damping only as the width of its peaks. So the planner takes several oscillators
    for a line, spread over its width, with the damping whose half-power width is the line's: they
    overlap, and no profile can hide between them (`oscillators`).
    """

    source: str = field(compare=False)
    """The file, as the machine file names it."""
    frequency: tuple[float, ...]
    """Frequency of each line, rising. [Hz]"""
    weight: tuple[float, ...]
    """Share of each line; all add up to 1. [-]"""
    peak: float
    """Frequency at which the measured PSD is largest. [Hz]"""
    participation: float = 1.0
    """How strongly the axis excites what was measured. [-]"""

    def oscillators(self) -> list[tuple[float, float, float]]:
        """Frequency [Hz], damping ratio [-] and share of the energy [-] of each oscillator."""
        f = self.frequency
        # The borders of the lines: half way between them.
        inner = [0.5 * (a + b) for a, b in itertools.pairwise(f)]
        first = f[0] - (inner[0] - f[0]) if inner else f[0]
        last = f[-1] + (f[-1] - inner[-1]) if inner else f[-1]
        borders = [first, *inner, last]
        out = []
        for (low, high), weight in zip(itertools.pairwise(borders), self.weight, strict=True):
            for part in range(OSCILLATORS):
                frequency = low + (high - low) * (part + 0.5) / OSCILLATORS
                damping = min(0.5 * (high - low) / frequency, 0.5)
                out.append((frequency, damping, weight / OSCILLATORS))
        return out


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis of a machine; lengths are degrees if it is rotary."""

    name: str
    rotary: bool
    diameter: bool
    """The program's numbers are diameters (a lathe's X); everything in here is of the radius."""
    resolution: float
    """The smallest step that is written. [mm] or [deg]"""
    rapid: Limits
    """What the controller's own G0 is set to; `conventional` is what it then does."""
    limit: Limits
    """What a designed profile may use."""
    travel: tuple[float, float] | None
    """Lowest and highest machine coordinate, where they are known. [mm] or [deg]"""
    modes: tuple[Mode, ...]
    """Modes that this axis alone excites; none where there is a spectrum."""
    spectrum: Spectrum | None = None
    """What was measured in place of modes."""
    wrap: str | None = None
    """How it goes to an absolute position, if it is rotary: ``none``, ``shortest`` or ``sign`` as
    `gcodejerk.nc.Start` has them; None where the file does not say."""
    planner: str = JERK_LIMITED
    """Which profile the controller's own G0 follows, one of `PLANNERS`; all axes' are alike."""
    law: tuple[tuple[str, float], ...] = ()
    """Quantities of `LAWS` that the planner needs. [mm or deg, s, Hz]"""
    filter: Filter | None = None
    """What acts behind it; the same for all axes of straight rapids."""
    servo: Servo | None = None
    """Its drive, for `gcodejerk.simulation`; None: it is where it is told to be."""

    def largest(self) -> tuple[float, float, float]:
        """Velocity, acceleration and jerk that its rapids and streams may reach."""
        a, b = self.rapid, self.limit
        return (
            max(a.velocity, b.velocity),
            max(a.acceleration, b.acceleration),
            max(a.jerk, b.jerk),
        )

    def conventional(self, lone: bool = True) -> Limits:
        """What the controller's own G0 does: this sets the conventional time.

        Parameters
        ----------
        lone : bool
            No other motion follows the rapid directly; only `linuxcnc-2.9` makes a difference.

        Returns
        -------
        Limits
            Under `bell`, the acceleration and the jerk of a ramp that is long enough for both. Of a
            planner of `LAWS` what it has besides is left out.
        """
        own = self.rapid
        share = LONE_SHARE if lone and self.planner == LINUXCNC else 1.0
        jerk = own.jerk if self.planner in (JERK_LIMITED, BELL) else math.inf
        return Limits(own.velocity, share * own.acceleration, jerk)


@dataclass(frozen=True, slots=True)
class PathLimits:
    """What a control bounds along the path, of all linear axes together; infinite where nothing.

    An axis alone is a path, too: no axis is faster than this.
    """

    rapid: Limits
    """Of the control's own rapids."""
    limit: Limits
    """That designed profiles may use."""

    def largest(self) -> tuple[float, float, float]:
        """Velocity, acceleration and jerk that rapids and streams may reach."""
        a, b = self.rapid, self.limit
        return max(a.velocity, b.velocity), max(a.acceleration, b.acceleration), math.inf

    def of_rapid(self, lone: bool, planner: str) -> Limits:
        """What the control's own G0 does, by the rule of `Axis.conventional`."""
        share = LONE_SHARE if lone and planner == LINUXCNC else 1.0
        return Limits(self.rapid.velocity, share * self.rapid.acceleration, math.inf)


UNBOUNDED = Limits(math.inf, math.inf, math.inf)
FREE = PathLimits(UNBOUNDED, UNBOUNDED)
"""Limits of a control that knows those of single axes alone."""


@dataclass(frozen=True, slots=True)
class Design:
    """How profiles are chosen, unless the command line says otherwise."""

    profile: str
    band: float
    """Relative frequency error to be robust to. [-]"""
    guard: float
    """What frequencies that the file does not name may keep after an optimal rapid, times the
    envelope of what today's leaves; 0: anything. [-]"""
    tolerance: float
    """Residual displacement that counts as settled. [mm]"""
    minimum_length: float
    """Shorter rapids are left alone. [mm]"""
    max_extension: float
    """How much longer a move may take where the limits do not allow its conventional time. [-]"""


@dataclass(frozen=True, slots=True)
class ProgramStart:
    """What a program may assume when it starts; all of it unknown unless the file says so."""

    start: Mapping[str, float] = field(hash=False)
    """Axis -> position in program coordinates. [mm] or [deg]"""
    offsets: Mapping[str, Mapping[str, float]] = field(hash=False)
    """Work offset (`G54`) -> axis -> its value. [mm] or [deg]"""
    tool_lengths: Mapping[int, float] = field(hash=False)
    """Number of the length offset (1 for `H1`) -> its value. [mm]"""
    startup: str
    """The codes in force, as a line of G-code; empty for the dialect's own."""
    decimal_point: str | None = None
    """What a number without a decimal point is: ``calculator``, ``standard``, None unknown."""
    resume_after_stop: str | None = None
    """Where the axes stand behind M0 and M1: ``same``, ``unknown``, None: as usual there."""
    harmless: tuple[str, ...] = ()
    """Codes (``M62``, ``G187``) that move nothing and change nothing that a rapid rests on."""
    home: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Axis -> where G28 leads it, in machine coordinates. [mm] or [deg]"""
    tool_change: Mapping[str, float] | None = field(default=None, hash=False)
    """Axis -> where it stands behind M6, in machine coordinates; None unknown. [mm] or [deg]"""
    m_before: tuple[str, ...] = ()
    m_after: tuple[str, ...] = ()
    """Codes (``M8``) that the control runs before the motion of their block, and behind it."""
    cycles: CycleSettings = field(default_factory=CycleSettings)
    """What settings of the control decide about drilling cycles."""
    unrolled_lines: int | None = None
    """Lines that loops and calls may be written out as, at most; None: as many as usual."""


@dataclass(frozen=True, slots=True)
class ControllerOptions:
    """What streams depend on that is set in the control, not on the machine."""

    version: str | None = None
    """Of the control; None unknown."""
    planner_type: int | None = None
    """LinuxCNC 2.10's [TRAJ] PLANNER_TYPE; None unknown."""
    servo_period: float | None = None
    """What the control's motion really runs at, where the machine says so. [s]"""
    optimization_depth: int = 50
    """Blocks that LinuxCNC looks ahead, [TRAJ] ARC_BLEND_OPTIMIZATION_DEPTH."""
    max_acceleration: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Axis -> its MAX_ACCELERATION when streams run. [mm/s^2] or [deg/s^2]"""
    override_guard: bool = False
    """Streams run at 100 % of all overrides only."""
    counts_per_unit: Mapping[str, float] = field(default_factory=dict, hash=False)
    """Axis -> counts of its drive. [1/mm] or [1/deg]"""
    axis_names: Mapping[str, str] = field(default_factory=dict, hash=False)
    """Axis -> what the controller calls it."""
    isx90: float | None = None
    """PMAC: unit of time of its velocities. [ms]"""
    fanuc_distance: str | None = None
    """Fanuc 15i: ``general`` or ``special``."""
    confirmed: tuple[str, ...] = ()
    """Unverified facts that the user has seen in a manual."""


@dataclass(frozen=True, slots=True)
class ControllerParameter:
    """One setting of the control that its owner has confirmed."""

    number: str
    """As the control calls it."""
    axis: str | None = None
    """The axis that it belongs to; None: all of them."""
    unit: str | None = None
    """In which the control takes it; None: as the control's table has it."""
    meaning: str = ""
    old: str | None = None
    """What it is set to today, as the control has it; None unknown."""


@dataclass(frozen=True, slots=True)
class Description:
    """What a machine file says, in mm (or deg), s and Hz.

    `source` and `inch` tell how it was written and take no part in comparisons: the same machine
    in inches is the same machine.
    """

    name: str
    controller: str
    """Name of the emitter that is used by default."""
    dialect: str
    """How programs are read."""
    interval: float
    """Time from one commanded position to the next. [s]"""
    positioning: str
    """`linear`: G0 is a straight line; `independent`: every axis runs on its own."""
    axes: tuple[Axis, ...]
    """In the order of `AXES`."""
    modes: tuple[Mode, ...]
    """Structure modes, which several axes excite together."""
    design: Design
    program: ProgramStart
    controller_options: ControllerOptions = field(default_factory=ControllerOptions)
    controller_parameters: tuple[ControllerParameter, ...] = ()
    spindle: str | None = None
    """What M3 turns on: ``mill``, ``laser`` or ``plasma``; None where the file does not say."""
    path: PathLimits = FREE
    """What bounds all linear axes together."""
    rapid_feed: RapidFeed | None = None
    """Feed moves that count as rapids in one run; no machine file says so."""
    subprograms: Subprograms | None = None
    """What programs call in other files, in one run."""
    structure: Structure | None = None
    """What it is built of, for `gcodejerk.simulation`."""
    inch: bool = field(default=False, compare=False)
    """The file's lengths are inches."""
    source: str = field(default="<machine>", compare=False)
    """The file, as it was named."""
    warnings: tuple[MachineError, ...] = field(default=(), compare=False, repr=False)
    """What the file says that is possible, but hardly meant; each with its place."""
    named_at: Mapping[str, Place] = field(default_factory=dict, compare=False, repr=False)
    """Where the file names what only a program shows to be wrong: `controller`, `dialect` and
    `program.startup`."""

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Letters of the axes, in the order of `AXES`."""
        return tuple(axis.name for axis in self.axes)

    @property
    def planner(self) -> str:
        """Which profile the control's own rapids follow; `jerk-limited` where any axis has a jerk.

        `trapezoidal` is `jerk-limited` without a jerk, so that axes of both may move together.
        """
        found = {axis.planner for axis in self.axes}
        if len(found) == 1:
            return found.pop()
        return min(found, key=(JERK_LIMITED, TRAPEZOIDAL, LINUXCNC, BELL).index)

    @property
    def neighbours_matter(self) -> bool:
        """Whether what stands around a rapid changes how the control moves, or what is written."""
        return self.planner == LINUXCNC or self.controller == "linuxcnc"

    def turns(self, name: str) -> bool:
        """Whether an axis turns; one that the machine lacks is what its letter says."""
        return self.axis(name).rotary if name in self.axis_names else name in "ABC"

    def axis(self, name: str) -> Axis:
        """Find the axis of that letter.

        Parameters
        ----------
        name : str
            One of the machine's axes.

        Returns
        -------
        Axis
            That axis.

        Raises
        ------
        MachineError
            The machine has no such axis.
        """
        for axis in self.axes:
            if axis.name == name:
                return axis
        raise MachineError(
            f"machine {self.name!r} has no axis {name!r}, it has {', '.join(self.axis_names)}",
            "name one of these, or describe the axis in the machine file",
        )

    def all_modes(self) -> tuple[tuple[str, Mode], ...]:
        """Every mode with the axes that excite it as a label: `Z`, or `Y+Z` for the structure's.

        Spectra are not among them.
        """
        own = tuple((axis.name, mode) for axis in self.axes for mode in axis.modes)
        return own + tuple(("+".join(mode.axes), mode) for mode in self.modes)
