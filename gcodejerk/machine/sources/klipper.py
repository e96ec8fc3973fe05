"""Klipper and Kalico: printer.cfg with what it includes and what SAVE_CONFIG put at its end.

Facts (Klipper, Config_Reference.md, toolhead.py, configfile.py): max_velocity [mm/s] and max_accel
[mm/s^2] are of the tool head, whichever axes move; max_z_velocity and max_z_accel bound Z, with
Kalico's limited_ kinematics max_x_velocity and its kin the others; a trapezoid without jerk limit.
[input_shaper] acts behind it, per axis: mzv where nothing is said. Lines that begin with `#*#` are
SAVE_CONFIG's and count. What comes later counts, and an include stands where it is named; # begins
a comment anywhere in a line.
"""

from __future__ import annotations

import configparser
import glob
import re
from collections.abc import Iterator
from pathlib import Path

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.reading import read_file
from gcodejerk.machine.sources.draft import Draft, Fact

KIND = "Klipper printer.cfg"
MOST_BYTES, MOST_DEPTH = 1 << 20, 8
DEFAULT_SHAPER, DEFAULT_CRUISE = "mzv", 0.5
STRAIGHT = ("cartesian", "corexy", "corexz", "hybrid_corexy", "hybrid_corexz", "delta", "limited_")
_SAVED = re.compile(r"^#\*# ?", re.MULTILINE)
_INCLUDE = re.compile(r"\[include\s+([^\]]+)\]")


def is_klipper(text: str) -> bool:
    """Whether it is a printer.cfg."""
    return re.search(r"^\s*\[(printer|stepper_[xyz])\]", text, re.MULTILINE) is not None


def read_klipper(path: Path, text: str) -> Draft:
    """What a printer.cfg says.

    Parameters
    ----------
    path : Path
        The file; includes are looked for beside it.
    text : str
        Its text.

    Returns
    -------
    Draft
        The machine so far.

    Raises
    ------
    MachineError
        It cannot be read as a configuration, or a value is no number.
    """
    notes: list[str] = []
    config = configparser.RawConfigParser(strict=False, inline_comment_prefixes=(";", "#"))
    try:
        for part in _parts(path, text, notes, 0):
            config.read_string(part, path.name)
    except configparser.Error as error:
        raise MachineError(
            f"{path.name} is not as Klipper reads it: {str(error).splitlines()[0]}", "mend the file"
        ) from None
    values = _Config(config, path)
    draft = Draft(KIND, controller="klipper", name="Klipper printer", notes=notes)
    draft.positioning = "linear", "Klipper's G0 is a straight line"
    draft.planner = "trapezoidal", "Klipper has no jerk limit"
    kinematics = values.text("printer", "kinematics") or "none"
    if not kinematics.startswith(STRAIGHT):
        draft.notes.append(
            f"kinematics {kinematics}: the tool head's limits are taken; watch a first run"
        )
    speed = values.fact("printer", "max_velocity")
    acceleration = values.fact("printer", "max_accel")
    draft.path = {
        name: fact
        for name, fact in (("velocity", speed), ("acceleration", acceleration))
        if fact is not None
    }
    for letter in "XYZ":
        axis = draft.axis(letter)
        own = letter == "Z" or kinematics.startswith("limited_")
        key = f"max_{letter.lower()}_"
        axis.velocity = _lower(values.fact("printer", key + "velocity") if own else None, speed)
        axis.acceleration = _lower(
            values.fact("printer", key + "accel") if own else None, acceleration
        )
        low = values.number(f"stepper_{letter.lower()}", "position_min") or 0.0
        high = values.number(f"stepper_{letter.lower()}", "position_max")
        if high is not None and low < high and kinematics != "delta":
            axis.travel, axis.travel_origin = (
                (low, high),
                "position_min (0 unless said), position_max",
            )
    _shapers(draft, values)
    _cruise(draft, values)
    if config.has_section("printer") and config.has_option("printer", "unified_planner"):
        draft.controller = "kalico"
    return draft


def _lower(own: Fact | None, of_all: Fact | None) -> Fact | None:
    """What bounds an axis: its own limit, or that of the tool head."""
    known = [fact for fact in (own, of_all) if fact is not None]
    return min(known, key=lambda fact: fact.value, default=None)


def _shapers(draft: Draft, values: _Config) -> None:
    """Input shaping of today, which a machine file cannot hold: Z has none, rapids are straight."""
    found = []
    for letter in "XY":
        key = letter.lower()
        frequency = values.number("input_shaper", f"shaper_freq_{key}")
        if frequency:
            own = values.text("input_shaper", f"shaper_type_{key}")
            kind = own or values.text("input_shaper", "shaper_type") or DEFAULT_SHAPER
            found.append(f"{letter} {kind} at {frequency:g} Hz")
    if found:
        draft.notes.append(
            f"[input_shaper] is on today ({', '.join(found)}). A machine file has one filter for "
            "straight rapids of all axes, so it is left out: what this file calls today's "
            "vibration is that without it"
        )


def _cruise(draft: Draft, values: _Config) -> None:
    """The part of every move without acceleration, which slows short rapids down.

    Until August 2025 (3ef760c) it could be stated as an acceleration, of which the ratio to
    max_accel counts (0105aa3); before, that acceleration itself did, with the same peak speed.
    """
    ratio = values.number("printer", "minimum_cruise_ratio")
    slower = values.number("printer", "max_accel_to_decel")
    most = values.number("printer", "max_accel")
    remedy = "0"
    if ratio is not None:
        said = f"minimum_cruise_ratio is {ratio:g}"
    elif slower is not None and most:
        ratio, said = 1.0 - min(1.0, slower / most), f"max_accel_to_decel is {slower:g}"
        remedy = f"max_accel (SET_VELOCITY_LIMIT ACCEL_TO_DECEL={most:g})"
    else:
        ratio, said = DEFAULT_CRUISE, f"minimum_cruise_ratio is {DEFAULT_CRUISE:g} (Klipper's own)"
    if 0.0 < ratio < 1.0:
        # A move that never reaches its speed peaks at sqrt((1 - r) d a), not at sqrt(d a).
        longer = 50.0 * (2.0 - ratio) / (1.0 - ratio) ** 0.5 - 100.0
        draft.notes.append(
            f"{said}: short rapids take up to {longer:.0f} % longer today than this file says, and "
            f"streams are played slower: set it to {remedy} while they run"
        )


def _parts(path: Path, text: str, notes: list[str], depth: int) -> Iterator[str]:
    """Texts in the order in which they count: includes where they stand; the saved last."""
    if depth > MOST_DEPTH:
        raise MachineError(
            f"{path.name} is included more than {MOST_DEPTH} deep", "does a file include itself?"
        )
    own: list[str] = []
    saved: list[str] = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#*#"):
            saved.append(_SAVED.sub("", line))
        elif match := _INCLUDE.match(line):
            yield "\n".join(own)
            own = []
            yield from _included(path, match[1].strip(), Place(path.name, number), notes, depth)
        else:
            own.append(line.partition("#")[0])
    yield "\n".join(own)
    first = next((k for k, line in enumerate(saved) if line.startswith("[")), len(saved))
    yield "\n".join(saved[first:])


def _included(path: Path, named: str, place: Place, notes: list[str], depth: int) -> Iterator[str]:
    """Texts of the files that an include names, in their order."""
    files = sorted(glob.glob(named, root_dir=path.parent))
    if not files:
        notes.append(f"{place}: {named} was not found, and not read")
    for name in files:
        inner = path.parent / name
        try:
            data = read_file(inner, MOST_BYTES)
        except OSError as error:
            notes.append(f"{place}: {named}: {error}")
            continue
        yield from _parts(inner, data.decode("utf-8", "replace"), notes, depth + 1)


class _Config:
    """Values as numbers, with what messages need."""

    def __init__(self, config: configparser.RawConfigParser, path: Path) -> None:
        self.config, self.path = config, path

    def text(self, section: str, key: str) -> str | None:
        """A value as it is written."""
        return self.config.get(section, key, fallback=None)

    def number(self, section: str, key: str) -> float | None:
        """A value as a number."""
        text = self.text(section, key)
        try:
            return None if text is None else float(text)
        except ValueError:
            raise MachineError(
                f"{self.path.name}: [{section}] {key} is {text!r}, expected a number",
                "mend the file",
            ) from None

    def fact(self, section: str, key: str) -> Fact | None:
        """A number with its origin."""
        value = self.number(section, key)
        return Fact(value, f"[{section}] {key}") if value and value > 0.0 else None
