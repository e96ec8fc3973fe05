"""The modal state of a program: every group, the position, and how words change them.

Rule 1: all modal state lives in `State`, and a word changes it here, in the modules that `Executor`
hands it to (`frames`, `cycles`, `flow`), or nowhere. A second place that remembers G91 is a second
opinion about where the tool is. (`runs.py` computes whole runs of plain lines as arrays; a
differential test holds it to this file on every column.)

Rule 2: this file knows no machine. It says what the program asked for.

Rule 3: what is not known for certain is unknown: None for a mode, NaN for a number. Unknown never
becomes known except by a word that states the value.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from gcodejerk.nc.dialect import AXES, LINEAR

NAN = math.nan
MODES = (
    *("motion", "plane", "distance", "arc_distance", "feed_mode", "unit", "compensation"),
    *("retract", "system", "path", "diameter"),
)
"""The fields of `State` that hold one modal group each."""
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

STICKY = ("distance_stated", "feed_mode_stated", "unit_stated", "rotates", "turns", "restores")
"""Fields that say that the program did something somewhere; never taken back."""

_LINEAR = tuple(axis in LINEAR for axis in AXES)


class State:
    """What is in force between two blocks."""

    __slots__ = (
        *MODES,
        "cycle",
        "cycle_level",
        "distance_stated",
        "ended",
        "feed",
        "feed_mode_stated",
        "feed_whole",
        "fixed",
        "g5x",
        "g92",
        "offsets",
        "path_p",
        "path_q",
        "position",
        "restores",
        "rotated",
        "rotates",
        "tool",
        "touched",
        "transforms",
        "turns",
        "unit_stated",
        "variables",
    )

    motion: int | None
    plane: int | None
    distance: int | None
    arc_distance: int | None
    feed_mode: int | None
    unit: float | None
    """mm per unit of length."""
    compensation: int | None
    retract: int | None
    system: int | None
    path: int | None
    diameter: bool | None

    def __init__(self) -> None:
        for name in MODES:
            setattr(self, name, None)
        self.position = [NAN] * len(AXES)
        self.g5x = [NAN] * len(AXES)
        self.g92 = [NAN] * len(AXES)
        self.tool = [NAN] * len(AXES)
        self.offsets: dict[int, list[float]] = {}
        self.feed = NAN
        self.feed_whole = False  # F was written without a decimal point
        self.path_p = NAN
        self.path_q = NAN
        self.distance_stated = False
        self.feed_mode_stated = False
        self.unit_stated = False
        self.ended = False
        self.fixed: frozenset[str] = frozenset()
        """Modes that no code of the dialect changes, so that nothing makes them unknown."""
        self.transforms: dict[str, bool | None] = {}
        """Name of a rotation, a scaling... -> in force, None where that is unknown; a name that
        the program never used is not in force."""
        self.rotated: bool | None = False  # the coordinate system is turned
        self.rotates = False  # the program turns a coordinate system somewhere
        self.turns = False  # the program uses G7, so X may be a diameter
        self.cycle: tuple[int, float, float] | None = None  # code in force, its Z and R words
        self.cycle_level = NAN  # where the series of cycles began
        self.restores = False  # the subprogram gives the modes of its caller back (M73)
        self.variables: dict[str, float] = {}
        """Variables whose value is certain, by `expressions.variable_name`."""
        self.touched: set[str | int] | None = None

    def copy(self) -> State:
        """Make an independent copy."""
        other = State.__new__(State)
        for name in State.__slots__:
            setattr(other, name, getattr(self, name))
        other.position = self.position.copy()
        other.g5x = self.g5x.copy()
        other.g92 = self.g92.copy()
        other.tool = self.tool.copy()
        other.offsets = dict(self.offsets)
        other.transforms = dict(self.transforms)
        other.variables = dict(self.variables)
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

    def lose_cycle(self) -> None:
        """No longer know whether a cycle is in force: a position may be a hole or a move."""
        self.put("cycle", None)
        self.put("motion", None)

    def forget_positions(self, axes: Iterable[int] = range(len(AXES))) -> None:
        """Forget the positions of these axes."""
        for axis in axes:
            self.move(axis, NAN)

    def forget_modes(self) -> None:
        """Forget every modal group."""
        for name in MODES:
            # Nothing but G7 makes X a diameter: in a program without it, radius is certain.
            if (name != "diameter" or self.turns) and name not in self.fixed:
                self.put(name, None)
        for name in ("feed", "path_p", "path_q", "cycle_level"):
            self.put(name, NAN)
        self.put("cycle", None)
        if self.rotates:
            self.put("rotated", None)
        if self.transforms:
            self.put("transforms", dict.fromkeys(self.transforms))
        self.forget_frame()

    def forget_frame(self) -> None:
        """Forget what lies between machine and program coordinates."""
        for name in ("g5x", "g92", "tool"):
            self.put(name, [NAN] * len(AXES))

    def forget(self) -> None:
        """Forget everything."""
        self.forget_modes()
        self.forget_positions()
        self.forget_variables()
        self.offsets = {}

    def forget_silently(self) -> None:
        """Forget everything, though nothing was touched: the start of a body."""
        touched, self.touched = self.touched, None
        offsets = self.offsets
        self.forget()
        self.offsets, self.touched = offsets, touched

    def forget_touched(self, touched: Iterable[str | int]) -> None:
        """Forget fields and axes that may or may not have been changed."""
        for name in touched:
            if isinstance(name, int):
                self.move(name, NAN)
            elif name in ("g5x", "g92", "tool"):
                self.put(name, [NAN] * len(AXES))
            elif name in ("feed", "path_p", "path_q", "cycle_level"):
                self.put(name, NAN)
            elif name in STICKY:
                self.put(name, True)
            elif name == "transforms":
                self.put(name, dict.fromkeys(self.transforms))
            elif name == "feed_whole":
                pass  # F itself is unknown
            elif name == "#":
                self.forget_variables()
            elif name.startswith("#"):
                self.set_variable(name[1:], NAN)
            elif name == "cycle":
                self.lose_cycle()
            else:
                self.put(name, None)

    @property
    def transformed(self) -> bool:
        """Whether a rotation, scaling, mirroring or polar frame is, or may be, in force."""
        return self.rotated is not False or any(on is not False for on in self.transforms.values())

    def shift(self, axis: int) -> float:
        """Machine coordinate minus program coordinate of an axis [mm, deg]; NaN if unknown."""
        if self.transformed and (axis < 2 or self.rotated is False):
            return NAN
        return self.g5x[axis] + self.g92[axis] + self.tool[axis]

    def scale(self, axis: int) -> float:
        """Mm (or deg) per unit of an axis word; NaN if unknown."""
        if not _LINEAR[axis]:
            return 1.0
        if self.unit is None:
            return NAN
        if axis == 0 and self.diameter is not False:
            return NAN if self.diameter is None else self.unit / 2.0
        return self.unit


def same(a: object, b: object) -> bool:
    """Whether two values of a field are one: NaN counts as equal to NaN."""
    return a == b or (a != a and b != b)


def agree(a: State, b: State) -> bool:
    """Whether two states know the same."""
    for name in State.__slots__:
        x, y = getattr(a, name), getattr(b, name)
        if name in ("position", "g5x", "g92", "tool"):
            if not all(map(same, x, y)):
                return False
        elif name != "touched" and not same(x, y):
            return False
    return True


def join(before: State, after: State) -> State:
    """Keep what is known when it is unknown which of two states holds."""
    joined = before.copy()
    joined.touched = after.touched
    for name in MODES:
        if getattr(before, name) != getattr(after, name):
            joined.put(name, None)
    for name in ("feed", "path_p", "path_q", "cycle_level"):
        if not same(getattr(before, name), getattr(after, name)):
            joined.put(name, NAN)
    for name in STICKY:
        joined.put(name, getattr(before, name) or getattr(after, name))
    if before.rotated != after.rotated:
        joined.put("rotated", None)
    if before.cycle != after.cycle:
        joined.lose_cycle()
    names = before.transforms.keys() | after.transforms.keys()
    both = {n: (before.transforms.get(n, False), after.transforms.get(n, False)) for n in names}
    joined.put("transforms", {n: a if a == b else None for n, (a, b) in both.items()})
    for name in ("g5x", "g92", "tool"):
        pairs = zip(getattr(before, name), getattr(after, name), strict=True)
        joined.put(name, [a if a == b else NAN for a, b in pairs])
    for axis, (a, b) in enumerate(zip(before.position, after.position, strict=True)):
        if not same(a, b):
            joined.move(axis, NAN)
    for variable in [n for n, v in before.variables.items() if after.variables.get(n) != v]:
        joined.set_variable(variable, NAN)
    if before.offsets != after.offsets:
        joined.offsets = {k: v for k, v in before.offsets.items() if after.offsets.get(k) == v}
    return joined
