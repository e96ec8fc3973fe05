"""LinuxCNC: the INI with what it includes, and the HAL files that it names.

Facts (2.9): the planner of coordinated motion takes MAX_VELOCITY and MAX_ACCELERATION of [AXIS_L],
in LINEAR_UNITS and degrees; those of [JOINT_n] count for single joints alone. [TRAJ]
MAX_LINEAR_VELOCITY bounds the speed along the path. Where HAL makes a base thread, the servo thread
runs at a whole multiple of its period: 1000000 ns on 30000 ns are 33 periods, 0.99 ms. A stream
needs MAX_ACCELERATION 1.05 times what profiles use (`docs/linuxcnc.md`), so profiles get the 1/1.05
of what the INI has: nothing has to be changed before it runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from gcodejerk.axes import AXES
from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.parts import LINUXCNC, STREAM_HEADROOM
from gcodejerk.machine.reading import read_file
from gcodejerk.machine.sources.draft import Draft, DraftAxis, Fact
from gcodejerk.units import MM_PER_INCH

KIND = "LinuxCNC INI"
MOST_BYTES, MOST_DEPTH = 1 << 20, 8
FOREVER = 1e9
"""Ends of travel beyond which there is none: LinuxCNC's default is 1e99."""
LINEAR_RESOLUTION, ROTARY_RESOLUTION = 1e-4, 1e-3
_SECTION = re.compile(r"\s*\[\s*(\w+)\s*\]")
_PAIR = re.compile(r"\s*([A-Za-z_]\w*)\s*=\s*(.*?)\s*$")
_INCLUDE = re.compile(r"#INCLUDE\s+(\S.*?)\s*$")
_INCLUDES = re.compile(r"^#INCLUDE[ \t]+\S", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?")
_STARTUP = re.compile(r"(\s*[A-Za-z][+-]?([0-9]+(?:\.[0-9]*)?|\.[0-9]+))*\s*")
_SETP = re.compile(
    r"\s*setp\s+ini[._]([a-z])[._]max[._-](velocity|acceleration|jerk)\s+(\S+)", re.I
)
_COMMENT = ("#", ";")


@dataclass(slots=True)
class _Values:
    """(section, key) -> every value with its place, in the order in which LinuxCNC sees them."""

    entries: dict[tuple[str, str], list[tuple[str, Place]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def text(self, section: str, key: str) -> tuple[str, Place] | None:
        """The first value, which counts."""
        found = self.entries.get((section, key))
        return found[0] if found else None

    def number(self, section: str, key: str) -> tuple[float, str, Place] | None:
        """The first value as a number, its text and place."""
        found = self.text(section, key)
        if found is None:
            return None
        text, place = found
        match = _NUMBER.match(text)
        if match is None:
            raise MachineError(
                f"[{section}] {key} is {text!r}, expected a number", "mend the INI", place
            )
        return float(match[0]), match[0], place


def is_linuxcnc(text: str) -> bool:
    """Whether it is the INI of a configuration; all that matters may stand in what it includes."""
    if _INCLUDES.search(text):
        return True
    sections = {match[1] for line in text.splitlines() if (match := _SECTION.match(line))}
    return bool(sections & {"EMC", "EMCMOT", "TRAJ", "KINS"}) and bool(
        sections & {"AXIS_X", "JOINT_0", "AXIS_0", "TRAJ"}
    )


def read_linuxcnc(path: Path, text: str) -> Draft:
    """What a configuration says.

    Parameters
    ----------
    path : Path
        The INI; includes and HAL files are looked for beside it.
    text : str
        Its text.

    Returns
    -------
    Draft
        The machine so far.

    Raises
    ------
    MachineError
        A value is none, or something is missing that it needs.
    """
    values = _Values()
    for section, key, value, place in _entries(path, text, values, 0):
        values.entries.setdefault((section, key), []).append((value, place))
    draft = Draft(KIND, controller="linuxcnc", notes=values.notes)
    name = values.text("EMC", "MACHINE")
    draft.name = name[0] if name and name[0] else path.stem
    unit = _unit(values)
    hal = list(_hal_lines(path, values))
    _interval(draft, values, hal)
    draft.positioning = "linear", "LinuxCNC's G0 is a straight line, all axes arrive together"
    draft.planner = LINUXCNC, "trapezoids of velocity; half of the acceleration for a lone G0"
    letters = _letters(values)
    _refuse_old(values, letters)
    for letter in letters:
        _axis(draft, letter, values, 1.0 if letter in "ABC" else unit, hal)
    _trajectory(draft, values, unit)
    _startup(draft, values)
    if any("qtplasmac" in line.lower() for line, _ in hal):
        draft.spindle = "plasma", "the HAL files speak of qtplasmac"
    return draft


def _entries(
    path: Path, text: str, values: _Values, depth: int, section: str = ""
) -> Iterator[tuple[str, str, str, Place]]:
    """Section, key, value and place of every pair; an include stands where it is named."""
    for number, line in enumerate(text.splitlines(), 1):
        if match := _INCLUDE.match(line):
            beside = path.parent / Path(match[1]).expanduser()
            if depth >= MOST_DEPTH:
                raise MachineError(
                    f"#INCLUDE {match[1]} is more than {MOST_DEPTH} files deep",
                    "does a file include itself?", Place(str(path), number),
                )  # fmt: skip
            inner = _text_of(beside)
            if inner is None:
                values.notes.append(f"{path.name}:{number}: {match[1]} was not found, and not read")
                continue
            last = section
            for entry in _entries(beside, inner, values, depth + 1, section):
                last = entry[0]
                yield entry
            section = last
        elif line.lstrip().startswith(_COMMENT):
            continue
        elif match := _SECTION.match(line):
            section = match[1].upper()
        elif match := _PAIR.match(line):
            yield section, match[1].upper(), match[2], Place(str(path), number)


def _text_of(path: Path) -> str | None:
    try:
        data = read_file(path, MOST_BYTES + 1)
    except (OSError, ValueError):
        return None
    return None if len(data) > MOST_BYTES else data.decode("utf-8", "replace")


def _unit(values: _Values) -> float:
    """Millimetres in one unit of the INI."""
    found = values.text("TRAJ", "LINEAR_UNITS")
    if found is None:
        raise MachineError(
            "[TRAJ] LINEAR_UNITS is missing, so no length in here has a unit",
            "add LINEAR_UNITS = mm or inch",
        )
    text, place = found
    word = text.split()[0].lower() if text.split() else ""
    if word in {"mm", "metric"}:
        return 1.0
    if word in {"in", "inch", "imperial"}:
        return MM_PER_INCH
    try:
        # A number is how many units are in 1 mm.
        return 1.0 / float(word)
    except (ValueError, ZeroDivisionError):
        raise MachineError(
            f"[TRAJ] LINEAR_UNITS is {text!r}, expected mm or inch", "mend the INI", place
        ) from None


def _letters(values: _Values) -> list[str]:
    """Axes, as [TRAJ] COORDINATES or the kinematics name them."""
    found = values.text("TRAJ", "COORDINATES")
    kins = values.text("KINS", "KINEMATICS")
    named = found[0] if found else ""
    if not named and kins and (match := re.search(r"coordinates=(\w+)", kins[0], re.I)):
        named = match[1]
    if kins and not kins[0].lower().startswith(("trivkins", "corexykins")):
        values.notes.append(
            f"{kins[0].split()[0]}: joints are not axes here; limits of single joints are not "
            "known to gcodejerk, so watch a first run"
        )
    letters = [letter for letter in dict.fromkeys(named.upper()) if letter in AXES]
    if not letters:
        raise MachineError(
            "neither [TRAJ] COORDINATES nor [KINS] KINEMATICS name the axes",
            "add COORDINATES = X Y Z",
        )
    return letters


def _refuse_old(values: _Values, letters: list[str]) -> None:
    """Up to LinuxCNC 2.7 the sections of axes had numbers."""
    old = values.text("AXIS_0", "MAX_VELOCITY")
    if old is not None and all(values.text(f"AXIS_{a}", "MAX_VELOCITY") is None for a in letters):
        raise MachineError(
            "the limits stand in [AXIS_0] and on, as LinuxCNC 2.7 had them",
            "convert the INI with LinuxCNC's own update_ini: later ones read [AXIS_X], [JOINT_0]",
            old[1],
        )


def _axis(
    draft: Draft, letter: str, values: _Values, unit: float, hal: list[tuple[str, Place]]
) -> None:
    """Limits and travel of one axis."""
    axis, section = draft.axis(letter), f"AXIS_{letter}"
    axis.velocity = _limit(values, section, "MAX_VELOCITY", unit)
    axis.acceleration = _limit(values, section, "MAX_ACCELERATION", unit)
    for line, place in hal:
        match = _SETP.match(line)
        if match is None or match[1].upper() != letter:
            continue
        if _NUMBER.fullmatch(match[3]):
            fact = Fact(float(match[3]) * unit, f"{line.strip()} ({_where(place)})")
            setattr(axis, match[2].lower(), fact)
    rotary = axis.rotary
    _travel(axis, values, section, unit)
    wrapped = values.text(section, "WRAPPED_ROTARY")
    if rotary:
        axis.wrap = "sign" if wrapped and wrapped[0].split()[:1] == ["1"] else "none"
    axis.resolution = Fact(
        ROTARY_RESOLUTION if rotary else LINEAR_RESOLUTION,
        "the step that is written; LinuxCNC reads any number of decimals", assumed=True,
    )  # fmt: skip
    if axis.acceleration is not None:
        axis.limit_acceleration = Fact(
            axis.acceleration.value / STREAM_HEADROOM,
            f"MAX_ACCELERATION/{STREAM_HEADROOM:g}, so that streams run with the INI as it is",
        )


def _limit(values: _Values, section: str, key: str, unit: float) -> Fact | None:
    found = values.number(section, key)
    if found is None:
        return None
    value, text, place = found
    if value <= 0.0:
        raise MachineError(
            f"[{section}] {key} is {text}, expected a number above 0", "mend the INI", place
        )
    inch = "" if unit == 1.0 else " inch"
    return Fact(value * unit, f"{key} = {text}{inch} ({_where(place)})")


def _travel(axis: DraftAxis, values: _Values, section: str, unit: float) -> None:
    low, high = values.number(section, "MIN_LIMIT"), values.number(section, "MAX_LIMIT")
    if low is None or high is None or max(abs(low[0]), abs(high[0])) * unit >= FOREVER:
        return
    if low[0] < high[0] and axis.wrap != "sign":
        axis.travel = low[0] * unit, high[0] * unit
        axis.travel_origin = f"MIN_LIMIT, MAX_LIMIT ({_where(low[2])})"


def _trajectory(draft: Draft, values: _Values, unit: float) -> None:
    """What bounds the path as a whole, and how the planner is set."""
    cap = values.number("TRAJ", "MAX_LINEAR_VELOCITY")
    lengths = [axis for axis in draft.axes.values() if axis.velocity and not axis.rotary]
    if cap is not None and cap[0] > 0.0:
        speed, origin = cap[0] * unit, f"[TRAJ] MAX_LINEAR_VELOCITY = {cap[1]} ({_where(cap[2])})"
        for axis in lengths:
            if axis.velocity is not None and axis.velocity.value > speed:
                axis.velocity = Fact(speed, f"{origin}, below the axis's own")
        together = sum(axis.velocity.value**2 for axis in lengths if axis.velocity) ** 0.5
        if together > speed * (1.0 + 1e-9):
            draft.path["velocity"] = Fact(speed, origin)
    blend = values.number("TRAJ", "ARC_BLEND_ENABLE")
    if blend is not None and blend[0] == 0.0:
        draft.notes.append("[TRAJ] ARC_BLEND_ENABLE is 0; streams need 1")
    if depth := values.number("TRAJ", "ARC_BLEND_OPTIMIZATION_DEPTH"):
        draft.options["optimization_depth"] = f"{depth[0]:g}", _where(depth[2])
    if (planner := values.number("TRAJ", "PLANNER_TYPE")) and planner[0] in (0.0, 1.0):
        draft.options["planner_type"] = f"{planner[0]:g}", f"PLANNER_TYPE ({_where(planner[2])})"
        if planner[0] == 1.0:
            _s_curves(draft, values, unit)


def _s_curves(draft: Draft, values: _Values, unit: float) -> None:
    """LinuxCNC 2.10's planner with a jerk."""
    draft.planner = "jerk-limited", "PLANNER_TYPE = 1"
    general = values.number("TRAJ", "MAX_LINEAR_JERK")
    for axis in draft.axes.values():
        own = _limit(values, f"AXIS_{axis.name}", "MAX_JERK", 1.0 if axis.rotary else unit)
        if own is None and general is not None and not axis.rotary:
            own = Fact(general[0] * unit, f"MAX_LINEAR_JERK = {general[1]} ({_where(general[2])})")
        axis.jerk = own
    draft.notes.append(
        "PLANNER_TYPE is 1: streams stop in every block; set 0 before you use them, or use "
        "`gcodejerk parameters`"
    )


def _interval(draft: Draft, values: _Values, hal: list[tuple[str, Place]]) -> None:
    """The servo period, as the threads really run."""
    servo = values.number("EMCMOT", "SERVO_PERIOD")
    if servo is None or servo[0] <= 0.0:
        draft.interval = Fact(1e-3, "LinuxCNC's usual SERVO_PERIOD", assumed=True)
        return
    base = values.number("EMCMOT", "BASE_PERIOD")
    threaded = any("base_period_nsec" in line for line, _ in hal)
    origin = f"SERVO_PERIOD = {servo[1]} ns ({_where(servo[2])})"
    if base is None or not threaded or not 0.0 < base[0] < servo[0]:
        draft.interval = Fact(servo[0] * 1e-9, origin)
        return
    periods = int(servo[0] / base[0] + 0.5)
    real = periods * base[0] * 1e-9
    draft.interval = Fact(real, f"{periods} times BASE_PERIOD = {base[1]} ns; {origin}")
    if abs(real / (servo[0] * 1e-9) - 1.0) > 1e-9:
        draft.notes.append(
            f"HAL runs a base thread, so the servo thread has {real * 1e3:.6g} ms: compare with "
            "`halcmd show thread` while LinuxCNC runs, and mend interval if it says another"
        )


def _startup(draft: Draft, values: _Values) -> None:
    found = values.text("RS274NGC", "RS274NGC_STARTUP_CODE")
    if found is None or not found[0]:
        return
    text, place = found
    if _STARTUP.fullmatch(text):
        draft.startup = text, f"RS274NGC_STARTUP_CODE ({_where(place)})"
    else:
        draft.notes.append(
            f"{_where(place)}: RS274NGC_STARTUP_CODE {text!r} is more than words; state its effect "
            "as program.startup if you need it"
        )


def _hal_lines(path: Path, values: _Values) -> Iterator[tuple[str, Place]]:
    """Lines of the HAL files beside the INI; a comment is none."""
    for value, place in values.entries.get(("HAL", "HALFILE"), []):
        name = value.split()[0] if value.split() else ""
        if not name or name.startswith("LIB:"):
            continue
        text = _text_of(path.parent / Path(name).expanduser())
        if text is None:
            values.notes.append(f"{_where(place)}: {name} was not found, and not read")
            continue
        for number, line in enumerate(text.splitlines(), 1):
            if not line.lstrip().startswith("#"):
                yield line, Place(name, number)


def _where(place: Place) -> str:
    """File and line, without its folder."""
    return f"{Path(place.file).name}:{place.line}"
