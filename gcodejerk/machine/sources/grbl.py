"""grbl, grblHAL and FluidNC: the `$$` dump, or FluidNC's YAML.

Facts (grbl 1.1 settings.h; grblHAL core; FluidNC's machine configuration): $100 + axis steps/mm,
$110 mm/min, $120 mm/s^2, $130 mm of travel, in the order X Y Z A B C; $32 laser mode. Settings are
in mm whatever $13 says, which is for reports. grbl's machine coordinates go from minus the travel
to 0. grblHAL's jerk, $800 + axis, is in mm/s^3 and counts in builds with ENABLE_JERK_ACCELERATION
alone (builds before December 2024 have other numbers).
"""

from __future__ import annotations

import re
from typing import Any

import yaml

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.sources.draft import Draft, Fact
from gcodejerk.units import SECONDS_PER_MINUTE

GRBL, FLUIDNC = "grbl $$ dump", "FluidNC configuration"
LETTERS = "XYZABC"
NO_BEAM = (
    "if M3 turns a mill's spindle and no laser or plasma, add the line `spindle: mill`: until then "
    "rapids behind M3 are left alone"
)
_SETTING = re.compile(r"^[^$\n]{0,40}\$(\d{1,3})[ \t]*=[ \t]*([^\s(;]*)", re.MULTILINE)
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)")
OF_AXES = {base + k for base in (100, 110, 120, 130, 800) for k in range(6)}
_VERSION = re.compile(r"(grblhal|grbl)\s+(\d\S*)|\[VER:([^\]]*)\]", re.IGNORECASE)


def is_grbl(text: str) -> bool:
    """Whether it holds the answer to `$$`; noise around it does not matter."""
    numbers = {int(match[1]) for match in _SETTING.finditer(text)}
    return {110, 120} <= numbers


def _settings(text: str, name: str) -> dict[int, tuple[float, str]]:
    """Every setting's number, with what messages call it.

    Raises
    ------
    MachineError
        A limit of an axis is no number, or none above 0.
    """
    found: dict[int, tuple[float, str]] = {}
    places: dict[int, Place] = {}
    for match in _SETTING.finditer(text):
        place = Place(name, text.count("\n", 0, match.start(1)) + 1)
        if _NUMBER.fullmatch(match[2]):
            found[int(match[1])] = float(match[2]), f"${match[1]}={match[2]} ({place})"
            places[int(match[1])] = place
        elif int(match[1]) in OF_AXES:
            raise MachineError(
                f"${match[1]} is {match[2]!r}, expected a number as grbl reports it",
                f"write ${match[1]}=5000.000, with a point and without other marks",
                place,
            )
    for number, (value, _) in found.items():
        if 110 <= number < 130 and number in OF_AXES and value <= 0.0:
            raise MachineError(
                f"${number} is {value:g}, expected a number above 0",
                "send $$ again, or mend the dump",
                places[number],
            )
    return found


def read_grbl(text: str, name: str) -> Draft:
    """What a `$$` dump says; a setting that comes twice counts as it came last."""
    found = _settings(text, name)
    jerks = {k for k in range(len(LETTERS)) if 800 + k in found}
    version = " ".join(m[0] for m in _VERSION.finditer(text)).lower()
    is_hal = "grblhal" in version or bool(jerks) or max(found) >= 300
    draft = Draft(GRBL, controller="grblhal" if is_hal else "grbl")
    draft.name = "grblHAL machine" if is_hal else "grbl machine"
    draft.positioning = "linear", "grbl's G0 is a straight line"
    for k, letter in enumerate(LETTERS):
        if 110 + k not in found or 120 + k not in found:
            continue
        axis = draft.axis(letter)
        rate, origin = found[110 + k]
        axis.velocity = Fact(rate / SECONDS_PER_MINUTE, f"{origin}, per minute")
        axis.acceleration = Fact(*found[120 + k])
        if 800 + k in found and found[800 + k][0] > 0.0:
            axis.jerk = Fact(*found[800 + k])
        steps = found.get(100 + k)
        if steps and steps[0] > 0.0:
            axis.resolution = Fact(0.001, f"grbl reads 0.001; a step is {1.0 / steps[0]:.4g}")
        travel = found.get(130 + k)
        if travel and travel[0] > 0.0 and not axis.rotary:
            axis.travel = -travel[0], 0.0
            axis.travel_origin = f"{travel[1]}; grbl's machine coordinates end at 0"
    if jerks:
        draft.planner = "jerk-limited", "$800: ENABLE_JERK_ACCELERATION"
        draft.notes.append(
            "the jerk counts in builds of grblHAL with ENABLE_JERK_ACCELERATION: without it, take "
            "jerk out and write planner: trapezoidal"
        )
    else:
        draft.planner = "trapezoidal", "grbl has no jerk limit"
    _laser(draft, found)
    return draft


def _laser(draft: Draft, found: dict[int, tuple[float, str]]) -> None:
    """What M3 turns on is known where a laser was set; a laser may run with $32=0, too."""
    mode = found.get(32)
    if mode is not None and mode[0] == 1.0:
        draft.spindle = "laser", mode[1]
    else:
        draft.notes.append(NO_BEAM)


def is_fluidnc(text: str) -> bool:
    """Whether it is FluidNC's YAML."""
    return "max_rate_mm_per_min" in text.lower() and "axes:" in text.lower()


def read_fluidnc(text: str, name: str) -> Draft:
    """What FluidNC's configuration says; its keys count in any case.

    Raises
    ------
    MachineError
        It is no YAML.
    """
    try:
        document = _lower(yaml.safe_load(text))
    except yaml.YAMLError as error:
        raise MachineError(
            f"{name} is no YAML: {str(error).splitlines()[0]}", "mend the file"
        ) from None
    axes = document.get("axes") if isinstance(document, dict) else None
    if not isinstance(axes, dict):
        raise MachineError(f"{name} has no axes", "name FluidNC's config.yaml")
    draft = Draft(
        FLUIDNC, controller="fluidnc", name=str(document.get("name") or "FluidNC machine")
    )
    draft.positioning = "linear", "FluidNC's G0 is a straight line"
    draft.planner = "trapezoidal", "FluidNC has no jerk limit"
    kinematics = document.get("kinematics")
    named = next(iter(kinematics), "") if isinstance(kinematics, dict) else kinematics
    if named and named != "cartesian":
        draft.notes.append(
            f"kinematics {named}: limits are taken as those of the axes; watch a first run"
        )
    for letter in LETTERS:
        values = axes.get(letter.lower())
        if not isinstance(values, dict):
            continue
        axis = draft.axis(letter)
        rate = _number(values, "max_rate_mm_per_min", letter, name)
        acceleration = _number(values, "acceleration_mm_per_sec2", letter, name)
        if rate:
            axis.velocity = Fact(rate / SECONDS_PER_MINUTE, f"max_rate_mm_per_min: {rate:g}")
        if acceleration:
            axis.acceleration = Fact(acceleration, "acceleration_mm_per_sec2")
        travel = _number(values, "max_travel_mm", letter, name)
        homing = values.get("homing")
        if travel and isinstance(homing, dict) and not axis.rotary:
            home = _number(homing, "mpos_mm", letter, name) or 0.0
            upwards = str(homing.get("positive_direction", "true")).lower() == "true"
            axis.travel = (home - travel, home) if upwards else (home, home + travel)
            axis.travel_origin = "max_travel_mm from homing's mpos_mm and positive_direction"
    if "laser" in document:
        draft.spindle = "laser", "it has a laser"
    else:
        draft.notes.append(NO_BEAM)
    return draft


def _lower(value: Any) -> Any:
    """The same with keys in lower case."""
    if isinstance(value, dict):
        return {str(key).lower(): _lower(inner) for key, inner in value.items()}
    return value


def _number(values: dict[str, Any], key: str, letter: str, name: str) -> float | None:
    if values.get(key) is None:
        return None
    try:
        return float(values[key])
    except (TypeError, ValueError):
        raise MachineError(
            f"{name}: {key} of {letter} is {values[key]!r}, expected a number", "mend the file"
        ) from None
