"""Lines by which a program may set its control, read back: one table for each control.

Rule: what a line sets is read by an expression of this module; a line of another form sets nothing
that is known, and has no place in a program.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

_N = rb"([0-9]{1,9}(?:\.[0-9]{1,9})?)"
PATH = ""
"""In place of an axis: all of them."""
Key = tuple[str, str]
"""Of a setting: its number, its axis."""
Values = dict[Key, str]


@dataclass(frozen=True, slots=True)
class Control:
    """What may stand in a program of one control."""

    forms: tuple[tuple[re.Pattern[bytes], Callable[[re.Match[bytes]], Values]], ...]
    """A line, and what it sets."""
    acceleration: str = ""
    """The number that is an acceleration."""
    kind: str = ""
    frequency: str = ""
    damping: str = ""
    """Of a shaper."""
    shared: bool = False
    """The acceleration along the path is all that holds for the axes, but for Z."""
    several: bool = False
    """A line may hold several commands, all of which run."""


def _text(match: re.Match[bytes], group: int) -> str:
    return match[group].decode()


def _shaper(
    names: tuple[str, str, str], groups: tuple[int, int, int, int]
) -> Callable[..., Values]:
    """What a line says that turns a shaper on: axis, kind, frequency and damping by group."""

    def values(match: re.Match[bytes]) -> Values:
        axis = _text(match, groups[0]) if groups[0] else PATH
        kind = _text(match, groups[1]) if groups[1] else "ZV"
        return {
            (names[0], axis): kind,
            (names[1], axis): _text(match, groups[2]),
            (names[2], axis): _text(match, groups[3]),
        }

    return values


def _one(number: str) -> Callable[..., Values]:
    return lambda match: {(number, PATH): _text(match, 1)}


def _each_axis(match: re.Match[bytes]) -> Values:
    """Accelerations by axis, each once."""
    pairs = re.findall(rb"([XYZABCUVW])([0-9]+)", match[1])
    found = {("M204", axis.decode()): value.decode() for axis, value in pairs}
    return found if len(found) == len(pairs) else {}


_KLIPPER = ("SHAPER_TYPE", "SHAPER_FREQ", "DAMPING_RATIO")
_MARLIN = ("M593 kind", "M593 F", "M593 D")
_RRF = ("M593 P", "M593 F", "M593 S")
CONTROLS = {
    "klipper": Control(
        (
            (re.compile(rb"SET_VELOCITY_LIMIT ACCEL=" + _N), _one("ACCEL")),
            (re.compile(rb"SET_INPUT_SHAPER SHAPER_FREQ_([XYZ])=0"),
             lambda m: {("SHAPER_TYPE", _text(m, 1)): "off"}),
            (re.compile(rb"SET_INPUT_SHAPER SHAPER_TYPE_([XYZ])=([0-9a-z_]+) SHAPER_FREQ_\1=" + _N
                        + rb" DAMPING_RATIO_\1=" + _N), _shaper(_KLIPPER, (1, 2, 3, 4))),
        ),
        "ACCEL", *_KLIPPER, shared=True,
    ),
    "marlin": Control(
        (
            (re.compile(rb"M204 T" + _N), _one("M204 T")),
            (re.compile(rb"M593 ([XYZ]) F0"), lambda m: {("M593 kind", _text(m, 1)): "off"}),
            (re.compile(rb"M593 ([XYZ]) F" + _N + rb" D" + _N), _shaper(_MARLIN, (1, 0, 2, 3))),
        ),
        "M204 T", *_MARLIN,
    ),
    "rrf": Control(
        (
            (re.compile(rb"M204 T" + _N), _one("M204 T")),
            (re.compile(rb'M593 P"none"'), lambda m: {("M593 P", PATH): "off"}),
            (re.compile(rb'M593 P"([a-z0-9]+)" F' + _N + rb" S" + _N), _shaper(_RRF, (0, 1, 2, 3))),
        ),
        "M204 T", *_RRF, several=True,
    ),
    "smoothieware": Control(
        ((re.compile(rb"M204((?: [XYZABCUVW][0-9]+)+)"), _each_axis),), "M204", several=True
    ),
    "twincat": Control(
        (
            (re.compile(rb"G231=([0-9]{1,4})"), _one("G231")),
            (re.compile(rb"G233=([0-9]{1,4})"), _one("G233")),
        ),
    ),
}  # fmt: skip
