"""What the second reading knows between two lines, and how it forgets.

Rule 1: a NaN, or None, is "not known", and it spreads.

Rule 2: three offsets lie between machine and program: that of the work system, that of G92 or G52,
that of the tool. A change of one renames where an axis stands by as much.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LINEAR, PLANES, Dialect, Effect
from gcodejerk.nc.dialects.gcodes import G17, G43, G49, G54_1, G90
from gcodejerk.units import MM_PER_INCH as INCH
from gcodejerk.verification.second_reading.computing import is_local
from gcodejerk.verification.second_reading.joining import common
from gcodejerk.verification.second_reading.reading import NAN

KINDS = {
    "g": "modes",
    **dict.fromkeys(("frames", "bars", "untold"), "frames"),
    **dict.fromkeys(("at", "meant", "system", "g92", "tool"), "axes"),
    **dict.fromkeys(("systems", "lengths", "home", "variables"), "table"),
    "slow": "least",
    **dict.fromkeys(("feed", "level", "r"), "number"),
    **dict.fromkeys(("p", "q"), "tolerance"),
    **dict.fromkeys(("doubt", "turns", "habits", "strayed", "rewritten", "exact"), "ever"),
    **dict.fromkeys(("feed_mode", "inverse", "path", "unit", "feed_unit", "diameter"), "mode"),
    **dict.fromkeys(("selected", "told", "added"), "mode"),
    **dict.fromkeys(("cycle", "modal", "feed_whole", "spindle"), "mode"),
    **dict.fromkeys(("dialect", "facts", "fixed", "dark", "burns"), "given"),
    # where in the file the reading is; a line that may be skipped changes none of these for good
    **dict.fromkeys(("ended", "opened", "begun", "started", "depth", "contour"), "place"),
    **dict.fromkeys(("contours", "says"), "place"),
}
"""Every field of `Known`, and how two states of it are joined."""


@dataclass(frozen=True, slots=True)
class Facts:
    """What the machine file says of how programs start."""

    positions: Mapping[str, float] = field(default_factory=dict)
    offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tool_lengths: Mapping[int, float] = field(default_factory=dict)
    diameter: bool = False
    decimal_point: str | None = None
    wraps: Mapping[str, str] = field(default_factory=dict)
    home: Mapping[str, float] = field(default_factory=dict)
    tool_change: Mapping[str, float] | None = None
    resume: str | None = None
    spindle: str | None = None
    limits: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    along: tuple[float, float, float] = (math.inf, math.inf, math.inf)
    straight: bool = True
    linear: Mapping[str, bool] = field(default_factory=dict)
    rapid_feed: tuple[float, float] | None = None
    """F and least Z of feed moves that count as rapids. [program's units]"""


NEAR = 1e-6
"""Two sums of the same numbers may differ by this much. [mm] or [deg]"""


@dataclass(slots=True)
class Observation:
    """A line as the second reading sees it; None and NaN where it does not know."""

    against: str | None = None
    """Why the line is certainly no rapid that may be rewritten."""
    sure: bool = False
    """It is a rapid, by itself and in a known frame."""
    start: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    axes: int = 0
    """Bit k: a word for AXES[k]."""
    modes: dict[str, Any] = field(default_factory=dict)
    """In force behind it."""
    entered: bool = False
    """Something leads to it besides the line above."""

    def moved(self, end: list[float]) -> set[str]:
        """List the axes of its words that certainly move."""
        ends = [(axis, a, b) for axis, a, b in zip(AXES, self.start, end, strict=True)]
        return {axis for axis, a, b in ends if self.axes >> AXES.index(axis) & 1 and abs(a - b) > 0}


class Known:
    """The state of the second reading."""

    def __init__(self, dialect: Dialect, facts: Facts) -> None:
        self.dialect, self.facts = dialect, facts
        modes = dict(dialect.defaults)
        self.fixed = {group: code for group, code in modes.items() if _lone(dialect, group, code)}
        """Groups of which the dialect has no other code."""
        self.g: dict[str, int | None] = dict(modes)
        """Modal group -> code in force."""
        self.feed_mode: int | None = self.mode_of(modes.get("feed mode"))
        self.inverse: bool | None = False  # G93, on controls that begin in G94
        self.path: int | None = dialect.paths.get(modes.get("path", -1), 0)
        self.p = self.q = self.feed = NAN
        self.exact = False
        """G61 was seen, or a program has run that is not followed."""
        self.feed_whole: bool | None = False
        self.unit: float | None = None
        if "units" in modes:
            self.unit = INCH if dialect.units[modes["units"]] else 1.0
        self.feed_unit = self.unit
        self.spindle: int | None = 5
        self.habits = False
        """The program was seen to behave like one for a laser."""
        self.burns = facts.spindle in ("laser", "plasma")
        """The machine file says that it has a beam, which other outputs may fire too."""
        self.dark = self.burns or (dialect.dark_rapids and facts.spindle is None)
        """Rapids have to stay G0 while M3 or M4 is on."""
        self.diameter: bool | None = facts.diameter
        self.turns = facts.diameter
        self.at, self.meant, self.system = ([NAN] * len(AXES) for _ in range(3))
        told = bool(facts.positions or facts.offsets)
        self.g92 = [0.0 if told else NAN] * len(AXES)
        self.tool = list(self.g92)
        self.systems = {_system(name): values for name, values in facts.offsets.items()}
        self.lengths = dict(facts.tool_lengths)
        self.home = dict(facts.home)
        self.rewritten = False
        """Variables that hold offsets were set: the next work system takes over a rotation, too."""
        self.told: tuple[int, int] | None = None
        """The work system that a block, or the startup codes, have selected last."""
        self.selected: tuple[int, int] | None = None
        if "system" in modes:
            self.selected = (modes["system"], 0)
            self.system = self.offsets_of(self.selected)
        self.cycle: int | None = None
        self.level = self.r = NAN
        self.modal: tuple[float, bool] | None = None
        """Where a cycle behind MCALL retracts to, and whether F outlives it."""
        self.frames: dict[str, bool | None] = {}
        """Rotations and their kin: whether in force."""
        self.bars: dict[str, bool | None] = {}
        """What else forbids to rewrite rapids."""
        self.slow: dict[str, float] = {}
        """Limits of the path that the program has set, and that may hold: quantity -> number."""
        self.untold: dict[str, bool | None] = {}
        """Axes whose frame was shifted since an absolute word, where that matters."""
        self.added: bool | None = False
        """ATRANS has added to the program's shift."""
        self.ended = self.opened = False
        """The program has; a ``%`` began it."""
        self.begun = self.started = False
        """A block has been read; so has a line that is not blank."""
        self.depth = 0
        self.doubt = False
        """Nothing can be confirmed any more: subprograms, jumps."""
        self.contour: float | None = None
        self.contours, self.says = list[float](), dict[str, int]()
        """The N that contours end with, and the last codes that their blocks have, by group."""
        self.variables: dict[str, float] = {}
        """Those that the program has set, on every way that leads here."""
        self.strayed = False
        """A program has run that is not followed."""

    @property
    def inch(self) -> bool:
        """Whether lengths are known to be inches."""
        return self.unit is not None and self.unit != 1.0

    def mode_of(self, code: int | None) -> int | None:
        """93, 94 or 95 by its code."""
        return None if code is None else self.dialect.feed_modes.get(code, code // 10)

    def offsets_of(self, selected: tuple[int, int]) -> list[float]:
        """What the machine file says of a work system."""
        known = self.systems.get(selected)
        return [NAN] * len(AXES) if known is None else [known.get(a, NAN) for a in AXES]

    def place(self) -> None:
        """Stand where the machine file says programs start; after the startup codes."""
        if self.g.get("tool length") is not None:
            self.tool = [0.0] * len(AXES)
        self.feed_unit = self.unit
        self.at = [self.facts.positions.get(axis, NAN) for axis in AXES]
        self.begun = self.started = False

    def copy(self) -> Self:
        """Make an independent copy."""
        other = object.__new__(type(self))
        for name, value in vars(self).items():
            setattr(other, name, value.copy() if isinstance(value, dict | list) else value)
        return other

    def join(self, other: Known) -> None:
        """Keep what both agree on: either may hold."""
        in_doubt = self.cycle != other.cycle
        for name, theirs in vars(other).items():
            mine = getattr(self, name)
            if KINDS[name] != "tolerance":
                setattr(self, name, common(KINDS[name], mine, theirs))
            elif mine != theirs and (mine == mine or theirs == theirs):
                self.path = None
        if self.feed_whole is None:
            self.feed = NAN  # a cutting feed that may have to be written either way
        if in_doubt:
            self.g["motion"] = None

    def lose(self, axes: str = AXES) -> None:
        """Lose positions."""
        for axis in axes:
            self.at[AXES.index(axis)] = NAN

    def forget(self) -> None:
        """Lose everything but what no code can change."""
        self.lose()
        self.meant = [NAN] * len(AXES)
        self.g = {**dict.fromkeys(self.g), **self.fixed}
        if "feed mode" not in self.fixed:
            self.feed_mode = self.inverse = None
        if "path" not in self.fixed:
            self.path = None
        self.p = self.q = self.feed = self.level = self.r = NAN
        self.selected = self.cycle = self.spindle = None
        if "units" not in self.fixed:
            self.unit = self.feed_unit = None
        if self.turns and not self.dialect.diameter_fixed:
            self.diameter = None
        self.lose_offsets()
        self.systems, self.lengths, self.home, self.variables = {}, {}, {}, {}
        self.told = self.added = None
        self.untold = dict.fromkeys(self.untold)
        self.frames, self.bars = dict.fromkeys(self.frames), dict.fromkeys(self.bars)

    def forget_shared(self) -> None:
        """Lose the variables that a program of the builder's can have set."""
        rules = self.dialect.arithmetic
        self.variables = {n: v for n, v in self.variables.items() if is_local(n, rules)}

    def lose_offsets(self) -> None:
        """Lose what lies between machine and program coordinates."""
        size, self.level = len(AXES), NAN
        self.system, self.g92, self.tool = [NAN] * size, [NAN] * size, [NAN] * size

    def scale(self, axis: str) -> float:
        """Mm or deg for 1 of an axis word."""
        if axis not in LINEAR:
            slides = self.facts.linear.get(axis)
            converted = slides is not None or self.dialect.inches_turn
            return 1.0 if slides is not False and (self.unit == 1.0 or not converted) else NAN
        if self.unit is None or (axis == "X" and self.diameter is None):
            return NAN
        return self.unit / 2.0 if axis == "X" and self.diameter else self.unit

    def rename(self, before: list[float], after: list[float]) -> list[float]:
        """Give where the axes stand its name under another offset."""
        for k, (old, new) in enumerate(zip(before, after, strict=True)):
            if old != new:
                self.at[k] += old - new
                if self.dialect.shifts_travel:
                    self.untold[AXES[k]] = True
                self.level = NAN
        return after

    def stepping_from(self, k: int) -> float:
        """Where an increment counts from; behind a shift, setting data say."""
        return NAN if self.untold.get(AXES[k], False) is not False else self.at[k]

    def absolutely(self, k: int, there: float) -> float:
        """Where an axis ends that was told a place."""
        self.untold.pop(AXES[k], None)
        return there if AXES[k] in LINEAR else self.turn(k, there)

    def lengthen(self, code: int, number: float, named: int) -> None:
        """Put a tool length in force: that of the machine file under an H number, or none."""
        length = self.lengths.get(int(number), NAN) if number == number else NAN
        only = self.g.get("plane") == G17 and named & ~_bits(self.dialect.length_axes) == 0
        axes = self.dialect.length_axes if only else AXES
        sure = code == G43 and axes == self.dialect.length_axes
        length = 0.0 if code == G49 else length if sure else NAN
        after = list(self.tool)
        for k, axis in enumerate(AXES):
            if axis in (AXES if code == G49 else axes):
                after[k] = NAN if length != length else length if axis == "Z" else 0.0
        self.tool = self.rename(self.tool, after)
        self.end_bar("tool data")
        if self.dialect.length_moves:
            self.lose(axes)

    def bar_for_good(self, sure: bool) -> None:
        """Something that the table does not name may last, where the dialect says so."""
        if self.dialect.unknown_lasts:
            self.bars["unknown code"] = sure or self.bars.get("unknown code") or None

    def is_unknown(self, letter: str, number: float) -> bool:
        """Whether a word is a code that the table certainly does not have."""
        if number != number or letter not in "GM":
            return False
        if letter == "M":
            return number not in self.dialect.m_groups
        return round(number * 10.0) not in self.dialect.groups

    def end_bar(self, name: str) -> None:
        """End what forbade to rewrite."""
        if name in self.bars:
            self.bars[name] = False

    def written(self) -> None:
        """Data of the control have been set that may hold offsets."""
        self.lose()
        self.lose_offsets()
        self.systems, self.lengths, self.selected, self.told = {}, {}, None, None
        self.home = {}
        self.bars.update({"offsets": True, "tool data": True})

    # Complex: one case for each way in which controls wrap an axis.
    def turn(self, k: int, angle: float) -> float:
        """Where a rotary axis ends that was told an absolute angle."""
        wrap, here = self.facts.wraps.get(AXES[k]), self.at[k]
        if wrap is None and math.copysign(1.0, angle) < 0.0:
            return NAN
        if wrap not in ("shortest", "sign") or (here != here and wrap == "shortest"):
            return angle
        if here != here or angle != angle or (wrap == "sign" and not -360.0 < angle < 360.0):
            return NAN
        turns = math.floor((here - angle) / 360.0)
        ends = [angle + 360.0 * (turns + n) for n in (-1, 0, 1, 2)]
        if wrap == "sign":
            ends = [abs(angle) + 360.0 * (math.floor(here / 360.0) + n) for n in (-1, 0, 1)]
            if here not in ends and min(abs(end - here) for end in ends) < 1e-6:
                return NAN
            back = math.copysign(1.0, angle) < 0.0
            return max(e for e in ends if e <= here) if back else min(e for e in ends if e >= here)
        ends.sort(key=lambda end: abs(end - here))
        return NAN if abs(abs(ends[0] - here) - abs(ends[1] - here)) < 1e-6 else ends[0]

    def end_run(self, k: int, there: float) -> None:
        """An axis ends a run of which only its last word is known, not how many turns it made."""
        self.at[k] = there
        self.untold.pop(AXES[k], None)
        if AXES[k] not in LINEAR:
            counts = self.facts.wraps.get(AXES[k]) in ("shortest", "sign")
            self.at[k] = NAN if counts else self.turn(k, there)

    def sure_of(self, selected: tuple[int, int] | None) -> bool:
        """Whether a work system was selected before, or the machine file has it."""
        again = selected == self.told == self.selected
        return selected is not None and (again or selected in self.systems)

    def select(self, selected: tuple[int, int] | None) -> None:
        """Select a work system."""
        self.end_bar("offsets")
        if selected is None or selected != self.selected:
            if self.rewritten:
                self.frames["rotation"] = None
            known = [NAN] * len(AXES) if selected is None else self.offsets_of(selected)
            self.system = self.rename(self.system, known)
        self.selected = self.told = selected

    def stand(self, k: int, place: float) -> float:
        """The program's name of a machine coordinate of an axis."""
        counts = AXES[k] not in LINEAR and self.facts.wraps.get(AXES[k]) in ("shortest", "sign")
        return (
            NAN if counts or self.turned() else place - self.system[k] - self.g92[k] - self.tool[k]
        )

    def turn_tool(self) -> None:
        """Another plane: a tool that has a length, or may have one, reaches elsewhere."""
        if self.tool != [0.0] * len(AXES):
            self.tool = [NAN] * len(AXES)
            self.lose()

    def lose_tool(self, *, by_t: bool) -> None:
        """Another tool, or another offset of it; T may run a cycle of the builder's."""
        if by_t and self.dialect.text.variables in ("R", "Q"):
            self.forget_shared()
        self.tool = [NAN] * len(AXES)
        self.lose()
        self.end_bar("tool data")

    def cancel_length(self, named: int = 0) -> None:
        """The tool length may have been cancelled, along the axes named, or along all."""
        for k, length in enumerate(self.tool):
            if length != 0.0 and (not named or named >> k & 1):
                self.tool[k] = self.at[k] = NAN

    def shift(
        self, kinds: set[Effect], values: Mapping[str, float], increments: Mapping[str, float]
    ) -> None:
        """G92 and its kin, G52, G10."""
        if "set" in kinds:
            dialect, self.level = self.dialect, NAN
            if not values and not increments and dialect.bare_set == "zero":
                values = dict.fromkeys(dialect.set_letters, 0.0)
            elif not values and not increments and dialect.bare_set == "unknown":
                self.lose()
                self.g92 = [NAN] * len(AXES)
            sure = dialect.incremental_set or self.g.get("distance") == G90
            for k, axis in enumerate(AXES):
                if axis in increments or (axis in values and not sure):
                    self.at[k] = self.g92[k] = NAN
                elif axis in values:
                    named = values[axis] * self.scale(axis)
                    self.g92[k] += self.at[k] - named
                    self.at[k] = named
            if dialect.shift_may_end:
                self.selected, self.system, self.g92 = None, [NAN] * len(AXES), [NAN] * len(AXES)
            if self.frames:
                self.lose()
        elif "clear" in kinds:
            self.g92 = self.rename(self.g92, [0.0] * len(AXES))
        else:
            self.lose()
            self.g92 = [NAN] * len(AXES)
            if "table" in kinds:
                self.systems, self.lengths = {}, {}
                self.lose_offsets()
                if "R" in values or self.rewritten:
                    self.frames["rotation"] = None

    def turned(self) -> bool:
        """Whether a rotation or its kin is, or may be, in force."""
        return any(on is not False for on in self.frames.values())

    def may_stop(self) -> bool:
        """Whether G61 may be in force: it has to be denied, or something may have left it."""
        if self.dialect.path_has_to_be_stated:
            return not self.path
        return self.path is None and self.exact

    def in_plane(self) -> str:
        """Axes that cutter compensation may displace; nothing here knows Heidenhain's G20."""
        plane = self.g.get("plane")
        return "".join(PLANES[plane][:2]) if plane in PLANES else "XYZUVW"


def _lone(dialect: Dialect, group: str, code: int) -> bool:
    """Whether a group has no code but this one."""
    return {code}.issuperset(c for c, name in dialect.groups.items() if name == group)


def _bits(axes: str) -> int:
    return sum(1 << AXES.index(axis) for axis in axes)


def _system(name: str) -> tuple[int, int]:
    """Key of a work system by its name in a machine file: ``G54``, ``G54.1 P3``."""
    code, _, number = name.upper().partition("P")
    return (G54_1, int(number)) if number else (round(float(code.strip()[1:]) * 10), 0)
