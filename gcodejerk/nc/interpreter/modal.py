"""The modal state of a program: every group, the position, and how words change them.

Rule 1: all modal state lives in `State`, and a word changes it here, in the modules that `Phases`
hands it to (`effects`, `frames`, `cycles`, `moves`, `mcodes`), or nowhere. A second place that
remembers G91 is a second opinion about where the tool is. (`runs.py` computes whole runs of plain
lines as arrays; a differential test holds it to this file on every column.)

Rule 2: this file knows no machine. It says what the program asked for.

Rule 3: what is not known for certain is unknown: None for a mode, NaN for a number. Unknown never
becomes known except by a word that states the value.

Rule 4: `FIELDS` is the one list of what a state holds. Starting, copying, forgetting, comparing and
joining go through it, so that a field that is added is forgotten and joined like the others.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LINEAR
from gcodejerk.nc.text.block import Line
from gcodejerk.reasons import Reason

NAN = math.nan
MOST_VARIABLES = 1000
"""Variables that are known at a time, so that a copy of the state stays cheap."""

GROUP_FIELDS = {
    "motion": "motion",
    "plane": "plane",
    "distance": "distance",
    "arc distance": "arc_distance",
    "compensation": "compensation",
    "retract": "retract",
}
"""Modal groups whose code simply becomes the value of a field."""

Kind = Literal[
    "mode",  # one value; None: unknown
    "number",  # NaN: unknown
    "axes",  # one number an axis; NaN: unknown
    "once",  # true as soon as the program did something somewhere; never taken back
    "named",  # name -> in force, None unknown; a name that is not there is not in force
    "lowest",  # name -> lowest number that may be in force, NaN unknown; not there: none is
    "table",  # key -> what is known of it; a key that is not there is unknown
    "constant",  # the same from the start to the end, or kept by whoever runs the blocks
    "note",  # for people: nothing is computed from it
]


@dataclass(frozen=True, slots=True)
class Field:
    """One field of the state, and how it is treated."""

    name: str
    kind: Kind
    start: Any = None
    """Before anything is known; empty containers are made anew."""
    together: str = ""
    """Fields with the same word here are known together or not at all: F and whether it was
    written without a decimal point; a path mode and its tolerances."""
    only_if: str = ""
    """It can only be unknown where this field of kind "once" is true: without a G7 in the program,
    X is a radius for certain."""


UNSTATED = 0
"""Path mode of a program that has not said any."""
_NAMED_LOST = ("compensation", "distance", "unit")
"""Modes of which `State.lost` says since when they are unknown."""


@dataclass(frozen=True, slots=True)
class Loss:
    """Why something is not known any more."""

    line: Line | None
    """Since which line; None: it has no number."""
    reason: Reason


FIELDS = (
    *(Field(name, "mode") for name in ("motion", "plane", "distance", "arc_distance", "unit")),
    Field("feed_mode", "mode", together="feed_mode"),
    Field("inverse", "mode", False, together="feed_mode"),
    *(Field(name, "mode") for name in ("feed_unit", "compensation", "retract", "system")),
    Field("path", "mode", together="path"),
    *(Field(name, "number", NAN, together="path") for name in ("path_p", "path_q")),
    Field("feed", "number", NAN, together="feed"),
    Field("feed_whole", "mode", False, together="feed"),
    Field("diameter", "mode", only_if="turns"),
    Field("rotated", "mode", False, only_if="rotates"),
    Field("spindle", "mode", 5),
    Field("cycle", "mode", together="cycle"),
    Field("cycle_level", "number", NAN),
    Field("modal_cycle", "mode"),
    *(Field(name, "axes") for name in ("position", "meant", "g5x", "g92", "tool", "home")),
    *(Field(name, "named") for name in ("transforms", "bars", "shifted")),
    Field("path_limits", "lowest"),
    Field("added", "mode", False),
    *(Field(name, "table") for name in ("offsets", "variables")),
    *(
        Field(name, "once", False)
        for name in ("distance_stated", "feed_mode_stated", "rotates", "turns", "restores")
    ),
    Field("system_stated", "mode", False),
    *(Field(name, "constant", start) for name, start in (("ended", False), ("touched", None))),
    Field("fixed", "constant", frozenset()),
    *(Field(name, "constant", (None,) * len(AXES)) for name in ("wraps", "slides")),
    Field("limits", "constant", MappingProxyType({})),
    Field("along", "constant", (math.inf,) * 3),
    Field("straight", "constant", True),
    *(Field(name, "note", start) for name, start in (("line", None), ("lost", {}))),
)
"""What a state holds."""
BY_NAME = {field.name: field for field in FIELDS}
_NO_GROUP = ("inverse", "feed_whole", "cycle", "modal_cycle", "system_stated", "added")
MODES = tuple(f.name for f in FIELDS if f.kind == "mode" and f.name not in _NO_GROUP)
"""Fields that hold one modal group each."""
_FRAME = ("g5x", "g92", "tool")
_HOLDERS = ("axes", "named", "lowest", "table")
"""Kinds whose values are containers, made anew for each state."""
_GROUPS = {
    word: tuple(field.name for field in FIELDS if field.together == word)
    for word in {field.together for field in FIELDS} - {""}
}
_LINEAR = tuple(axis in LINEAR for axis in AXES)


def _unknown(field: Field, value: Any) -> Any:
    """What a field holds where nothing is known of it."""
    if field.kind == "mode":
        return None
    if field.kind == "number":
        return NAN
    if field.kind == "axes":
        return [NAN] * len(AXES)
    if field.kind == "named":
        return dict.fromkeys(value)
    if field.kind == "table":
        return {}
    return True if field.kind == "once" else value


class State:
    """What is in force between two blocks."""

    __slots__ = tuple(field.name for field in FIELDS)

    motion: int | None
    plane: int | None
    distance: int | None
    arc_distance: int | None
    feed_mode: int | None
    inverse: bool | None
    """G93 is in force, where a control begins in G94: not all of the dialect's may do so."""
    unit: float | None
    """mm per unit of length."""
    feed_unit: float | None
    """mm per unit of length of F, where a dialect keeps the two apart; elsewhere that of `unit`."""
    compensation: int | None
    retract: int | None
    system: int | None
    path: int | None
    """UNSTATED: that which the control starts in, as no program has said another so far."""
    path_p: float
    path_q: float
    """P and Q of G64; NaN where `path` is known: none were given."""
    feed: float
    feed_whole: bool | None
    """F was written without a decimal point."""
    diameter: bool | None
    rotated: bool | None
    """The coordinate system is turned."""
    spindle: int | None
    """3, 4 or 5: the M code in force, where G0 may darken what M3 turns on."""
    cycle: tuple[int, float, float] | None
    """Code in force, its Z and R words."""
    cycle_level: float
    """Where the series of cycles began."""
    modal_cycle: tuple[float, bool] | None
    """Where the cycle behind MCALL comes back to, and whether it leaves F alone; None: there is
    none, or nobody knows."""
    position: list[float]
    meant: list[float]
    """Where the program says that axes stand which cutter compensation displaces, or may."""
    g5x: list[float]
    g92: list[float]
    tool: list[float]
    home: list[float]
    """Where G28 leads, in machine coordinates."""
    transforms: dict[str, bool | None]
    """Rotation, scaling, mirroring..."""
    bars: dict[str, bool | None]
    """What besides makes rapids ineligible while it is in force, by `eligibility.BARS`."""
    path_limits: dict[str, float]
    """Limits of the path that the program has set, by quantity. [mm/s, mm/s^2, mm/s^3]"""
    shifted: dict[str, bool | None]
    """Axes of which no absolute word has told the place since their frame was shifted, where that
    matters (`Dialect.shifts_travel`)."""
    added: bool | None
    """A shift was added to that of the program (ATRANS) since it began anew."""
    offsets: dict[int, list[float]]
    variables: dict[str, float]
    """Variables whose value is certain, by `expressions.variable_name`."""
    distance_stated: bool
    feed_mode_stated: bool
    system_stated: bool | None
    """The work system is in force because the program, or the machine file, has said so."""
    rotates: bool
    """The program turns a coordinate system somewhere, or may do so by a variable."""
    turns: bool
    """The program uses G7, so X may be a diameter."""
    restores: bool
    """The subprogram gives the modes of its caller back (M73)."""
    ended: bool
    touched: set[str | int] | None
    """What blocks have changed since somebody wanted to know."""
    fixed: frozenset[str]
    """Modes that no code of the dialect changes, so that nothing makes them unknown."""
    line: Line | None
    """That which is run."""
    lost: dict[str, Loss]
    """Mode that a block made unknown -> which block. Never changed, but made anew."""
    wraps: tuple[str | None, ...]
    slides: tuple[bool | None, ...]
    """How each axis turns (None: unknown), or slides: see `gcodejerk.start.Start`."""
    limits: Mapping[str, tuple[float, float, float]]
    along: tuple[float, float, float]
    straight: bool
    """What each axis may do, the path of all of them, and whether they go together: see there."""

    def __init__(self) -> None:
        for field in FIELDS:
            held: Any = [NAN] * len(AXES) if field.kind == "axes" else {}
            setattr(self, field.name, held if field.kind in _HOLDERS else field.start)

    def copy(self) -> State:
        """Make an independent copy."""
        other = State.__new__(State)
        for field in FIELDS:
            value = getattr(self, field.name)
            shared = field.kind not in _HOLDERS
            setattr(other, field.name, value if shared else value.copy())
        return other

    def put(self, field: str, value: object) -> None:
        """Set one field and remember that it was set."""
        setattr(self, field, value)
        if self.touched is not None:
            self.touched.add(field)

    def move(self, axis: int, value: float) -> None:
        """Set the position of one axis."""
        self.position[axis] = value
        if self.touched is not None:
            self.touched.add(axis)

    def set_variable(self, name: str, value: float) -> None:
        """Set a variable, or, with NaN, forget it; more than `MOST_VARIABLES` are not kept."""
        if value == value and (name in self.variables or len(self.variables) < MOST_VARIABLES):
            self.variables[name] = value
        else:
            self.variables.pop(name, None)
        if self.touched is not None:
            self.touched.add("#" + name)

    def forget_variables(self, but: Iterable[str] = ()) -> None:
        """Forget all variables but these."""
        self.variables = {name: self.variables[name] for name in but}
        if self.touched is not None:
            self.touched.add("#")

    def lose(self, name: str) -> None:
        """Make one field unknown, and those that are known with it."""
        if name in self.lost:
            self.lost = {n: loss for n, loss in self.lost.items() if n != name}
        field = BY_NAME[name]
        for each in _GROUPS.get(field.together, (name,)):
            self.put(each, _unknown(BY_NAME[each], getattr(self, each)))
        if name == "cycle":
            self.put("motion", None)  # a position may be a hole or a move

    def forget_positions(self, axes: Iterable[int] = range(len(AXES))) -> None:
        """Forget the positions of these axes."""
        for axis in axes:
            self.move(axis, NAN)

    def forget_modes(self) -> None:
        """Forget every modal group, and what lies between machine and program coordinates."""
        for field in FIELDS:
            name = field.name
            if field.kind in ("once", "table", "constant", "note") or name == "position":
                continue
            if name in self.fixed or (field.only_if and not getattr(self, field.only_if)):
                continue
            if field.kind not in ("named", "lowest") or getattr(self, name):
                self.put(name, _unknown(field, getattr(self, name)))

    def forget_frame(self) -> None:
        """Forget what lies between machine and program coordinates."""
        for name in (*_FRAME, "cycle_level"):
            self.lose(name)

    def forget(self, because: Reason = Reason.NOT_FOLLOWED) -> None:
        """Forget everything, for a reason that rapids are left alone with."""
        known = [name for name in _NAMED_LOST if getattr(self, name) is not None]
        self.forget_modes()
        lost = {n: Loss(self.line, because) for n in known if getattr(self, n) is None}
        self.lost = {**self.lost, **lost} if lost else self.lost
        self.forget_positions()
        self.forget_variables()
        self.offsets = {}

    def forget_silently(self) -> None:
        """Forget everything, though nothing was touched: the start of a body."""
        touched, self.touched = self.touched, None
        offsets = self.offsets
        self.forget()
        self.offsets, self.touched = offsets, touched

    def put_back(self, bars: Mapping[str, bool | None], path_limits: Mapping[str, float]) -> None:
        """Put back which bars and limits of the path a block may, or may not, have ended."""
        self.bars = {**{name: None for name, on in bars.items() if on is not False}, **self.bars}
        self.path_limits = _lowest(self.path_limits, path_limits)

    def forget_touched(self, touched: Iterable[str | int], because: Reason | None = None) -> None:
        """Forget fields and axes that may or may not have been changed, and name the reason."""
        touched = list(touched)
        named = [name for name in _NAMED_LOST if name in touched] if because else []
        for name in touched:
            if isinstance(name, int):
                self.move(name, NAN)
            elif name == "#":
                self.forget_variables()
            elif name.startswith("#"):
                self.set_variable(name[1:], NAN)
            else:
                self.lose(name)
        if because is not None:
            lost = {n: Loss(self.line, because) for n in named if getattr(self, n) is None}
            self.lost = {**self.lost, **lost}

    def unknown(self, mode: str) -> bool:
        """Whether a mode is not known."""
        return getattr(self, mode) is None

    @property
    def transformed(self) -> bool:
        """Whether a rotation, scaling, mirroring or polar frame is, or may be, in force."""
        return self.rotated is not False or any(on is not False for on in self.transforms.values())

    def shifts(self) -> list[float]:
        """Machine coordinate minus program coordinate of each axis [mm, deg]; NaN if unknown."""
        sums = [sum(offsets) for offsets in zip(self.g5x, self.g92, self.tool, strict=True)]
        if self.transformed:
            turned = 2 if self.rotated is not False else len(AXES)
            sums[:turned] = [NAN] * turned
        return sums

    def scale(self, axis: int) -> float:
        """Mm (or deg) per unit of an axis word; NaN if unknown."""
        if not _LINEAR[axis]:
            known = self.slides[axis] is None or (self.slides[axis] and self.unit == 1.0)
            return 1.0 if known else NAN
        if self.unit is None:
            return NAN
        if axis == 0 and self.diameter is not False:
            return NAN if self.diameter is None else self.unit / 2.0
        return self.unit


def same(a: object, b: object) -> bool:
    """Whether two values of a field are one: NaN counts as equal to NaN."""
    return a == b or (a != a and b != b)


def alike(field: Field, a: Any, b: Any) -> bool:
    """Whether two states know the same of a field."""
    if field.kind == "axes":
        return all(map(same, a, b))
    if field.kind == "named":
        return all(a.get(name, False) == b.get(name, False) for name in a.keys() | b.keys())
    if field.kind == "lowest":
        return a.keys() == b.keys() and all(same(a[name], b[name]) for name in a)
    if field.name == "cycle" and a is not None and b is not None:
        return all(map(same, a, b))
    return same(a, b)


def agree(a: State, b: State) -> bool:
    """Whether two states know the same."""
    return all(
        alike(field, getattr(a, field.name), getattr(b, field.name))
        for field in FIELDS
        if field.name != "touched" and field.kind != "note"
    )


def join(before: State, after: State) -> State:
    """Keep what is known when it is unknown which of two states holds."""
    joined = before.copy()
    joined.touched = after.touched
    for field in FIELDS:
        a, b = getattr(before, field.name), getattr(after, field.name)
        if field.kind not in ("constant", "note") and not alike(field, a, b):
            _join(joined, field, a, b)
    losses = [(n, loss) for s in (after, before) for n, loss in s.lost.items() if s.unknown(n)]
    joined.lost = dict(losses)
    return joined


def _either(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, bool | None]:
    """What is in force where either of two is, by name; None where they differ."""
    both = {name: (a.get(name, False), b.get(name, False)) for name in a.keys() | b.keys()}
    return {name: x if x == y else None for name, (x, y) in both.items()}


def _lowest(a: Mapping[str, float], b: Mapping[str, float]) -> dict[str, float]:
    """The lowest number that one of two says, by name; NaN is lower than any."""
    lower = {n: x if x != x or x <= b.get(n, math.inf) else b[n] for n, x in a.items()}
    return {**b, **lower}


def _join(joined: State, field: Field, a: Any, b: Any) -> None:
    """Keep of one field what two states have in common; they differ in it."""
    if field.kind == "once":
        joined.put(field.name, a or b)
    elif field.kind in ("named", "lowest"):
        joined.put(field.name, _either(a, b) if field.kind == "named" else _lowest(a, b))
    elif field.name == "position":
        for axis, (x, y) in enumerate(zip(a, b, strict=True)):
            if not same(x, y):
                joined.move(axis, NAN)
    elif field.kind == "axes":
        joined.put(field.name, [x if x == y else NAN for x, y in zip(a, b, strict=True)])
    elif field.name == "variables":
        for name in [name for name, value in a.items() if b.get(name) != value]:
            joined.set_variable(name, NAN)
    elif field.kind == "table":
        joined.offsets = {key: x for key, x in a.items() if b.get(key) == x}
    else:
        joined.lose(field.name)
