"""What drilling cycles mean, told a second time: the places that the tool visits for each hole.

By this measure `expansion` beside it judges cycles that were written out. It follows what
`controls` says of each control and shares nothing with the room `gcodejerk.cycles`, which writes
them; the words of a block and what is in force there come from the reader, as
everywhere in this package.

Rule: every number is exact, and every place absolute where the program tells it; a place that it
does not tell has an origin of its own, so that increments can be compared all the same.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from gcodejerk.axes import AXES
from gcodejerk.nc import Block, Word
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import G17, G19, G40, G90, G91, G99
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.verification.cycles.controls import Control

CLOSE = Fraction(1, 10**8)
"""Numbers of a program that differ by less are the same; in its unit, far below a resolution."""

MOST_PECKS = 20_000
"""Of one block, repeats included."""

_MOVE = re.compile(rb"(G9 )?(G0|G1)((?: [XYZ][-+]?\d*(?:\.\d*)?)+)")
_DWELL = re.compile(rb"G4 P(\d*(?:\.\d*)?)")
QUIET_G = frozenset({17, 18, 19, 20, 21, 40, 90, 91, 90.1, 91.1, 94, 95, 98, 99})
QUIET_M = frozenset({3, 4, 5, 7, 8, 9, 48, 49})
STOPS = frozenset({0, 1, 2, 30, 60})
"""G and M codes that a block of a cycle may hold, as far as the control does before or after it
what they do."""

Height = tuple[str, Fraction]
"""Origin (empty: the program's zero; `?`: a place that is not known), and distance to it."""
Event = tuple[str, tuple[Height, ...] | Fraction]
"""rapid or feed and the place in the plane's three axes, dwell or spindle and its number."""


@dataclass(slots=True)
class Series:
    """A run of blocks in which a cycle is in force."""

    level: Height
    at: dict[str, Height]
    plane: int | None
    unit: float | None
    distance: int | None
    control: Control
    written: bool | None = None
    code: int = 0
    said: dict[str, Fraction] = field(default_factory=dict)
    """Words that stay in force: the depth (under `z`), R, P and Q."""
    doubt: str | None = None
    dwelt: bool = False
    """A block of it has stated a dwell."""


def begin_series(here: list[float], state: State, control: Control) -> Series:
    """The tool as a series finds it; `here` are the positions in front of its first block."""
    at: dict[str, Height] = {}
    for letter in "XYZ":
        axis = AXES.index(letter)
        number = here[axis] / state.scale(axis)
        at[letter] = ("?", Fraction(0)) if math.isnan(number) else ("", Fraction(number))
    along = PLANES[state.plane][2] if state.plane in PLANES else "Z"
    level = at.get(along, ("?", Fraction(0)))
    return Series(level, at, state.plane, state.unit, state.distance, control)


def doubt_of(series: Series, state: State, code: int | None, here: list[float]) -> str | None:
    """What is not certain of the state in which a hole is made; `here` is where the tool is."""
    control = series.control
    heights = control.heights.get(code or 0)
    if heights is None or set(heights) & control.leaves:
        return "only the controller can do this cycle"
    if state.plane != series.plane or state.unit != series.unit or series.unit is None:
        return "plane or unit change, or are not known"
    if state.plane not in control.planes or (state.plane == G19 and state.diameter is not False):
        return "nobody knows cycles in this plane"
    if state.compensation != G40 or state.transformed:
        return "cutter compensation or rotation"
    if state.distance not in (G90, G91) or state.feed_mode not in (94, 95):
        return "distance mode or feed mode"
    if not state.feed > 0.0:
        return "no feed"
    if series.level[0]:
        return "where it starts is not known"
    doubt = None if control.watched else _doubt_unwatched(series, state, here)
    return doubt or (_doubt_beside(series, state, heights) if control.beside else None)


def _doubt_unwatched(series: Series, state: State, here: list[float]) -> str | None:
    """What more is not certain of a control that nobody has watched."""
    z = Fraction(0) if math.isnan(here[2]) else Fraction(here[2]) / Fraction(str(state.unit))
    if math.isnan(here[2]) or abs(z - series.at["Z"][1]) > CLOSE:
        return "where the tool stands in front of the hole is not known"
    if state.distance != series.distance:
        return "G90 and G91 change"
    low = not series.control.levels and series.at["Z"] != series.level
    if low and (state.retract != G99 or state.distance == G91):
        return "G98 or G91 behind G99"
    return None


def _doubt_beside(series: Series, state: State, heights: str) -> str | None:
    """What more is not certain where a cycle leaves G0 or G1 in force."""
    if state.motion not in (0, 10) or state.path not in (61, 64):
        return "G0 or G1, or the path mode, is not known"
    if "P" in heights and state.feed_mode != 94:
        return "a dwell in G95"
    if series.control.carries and series.dwelt and "P" not in heights and heights[0] in "bc":
        return "a dwell of an earlier cycle"
    return None


def _belongs(word: Word, code: int, letters: set[str], switches: frozenset[int]) -> bool:
    """Whether a word may stand in a block of a cycle."""
    number = -1.0 if word.value is None else word.value
    if word.letter == "G":
        return number in QUIET_G or round(number * 10) == code
    return word.letter in letters or (word.letter == "M" and number in switches)


@dataclass(frozen=True, slots=True)
class Doubt:
    """Why nobody knows for certain what a block of a cycle does."""

    reason: str


def calls_for(
    series: Series, block: Block, state: State, code: int, turning: int
) -> list[list[Event]] | Doubt:
    """What a block calls for: its moves, for each count of pecks that may be meant."""
    control, along = series.control, PLANES[state.plane or G17]
    said = _said(series, block, state, code)
    if isinstance(said, Doubt):
        return said
    _remember(series, code, said, along[2])
    repeats = said.get(control.repeats, Fraction(1))
    needs = {"z", "R"} | _own_words(control.heights[code])
    if needs - series.said.keys() or repeats < 1 or repeats.denominator != 1:
        return Doubt("a word that it needs is missing")
    r, z = _heights(series, state)
    if doubt := _doubt_of(series, state, code, turning, r, z):
        return Doubt(doubt)
    level = series.level[1]
    top = r if state.retract == G99 else max(r, level)
    if not control.levels and "r" in control.heights[code] and top != r:
        return Doubt("how G85 goes beyond R")
    out = []
    for pecks in _pecks(series, code, r, z):
        if (pecks + 1) * repeats > MOST_PECKS:
            return Doubt(f"it pecks more than {MOST_PECKS} times")
        visits = [*_visits(series, code, (r, z, top), pecks, state, turning)]
        places = _places(series, said, visits, (r, top), int(repeats), state)
        out.append([*_moving(places, series, along)])
    return out


def _said(series: Series, block: Block, state: State, code: int) -> dict[str, Fraction] | Doubt:
    """The numbers of a block's words, by letter."""
    plane, control = PLANES[state.plane or G17], series.control
    letters = {*plane, "R", control.repeats, *control.letters} | _own_words(control.heights[code])
    said: dict[str, Fraction] = {}
    for word in block.words:
        if not _belongs(word, code, letters, control.switches):
            return Doubt(f"nobody knows when {word.text.decode('latin-1')} acts")
        if word.letter in "XYZRPQ" or word.letter == control.repeats:
            number = control.number(word.letter, word.text[1:], state.unit)
            if number is None:
                return Doubt("a number without a decimal point")
            said[word.letter] = number
        if word.letter == "P" and control.point not in (None, b"." in word.text):
            return Doubt("its dwell may be another one in G4")
    stated = any(w.letter == "G" and round((w.value or 0.0) * 10) == code for w in block.words)
    if control.xy and not set(plane[:2]) & said.keys() and not (control.stated and stated):
        return Doubt("it names neither X nor Y")
    return said


def _doubt_of(
    series: Series, state: State, code: int, turning: int, r: Fraction, z: Fraction
) -> str | None:
    """Why it is not certain what a complete cycle from R to the bottom does."""
    control = series.control
    if z > r or ("Q" in _own_words(control.heights[code]) and series.said["Q"] <= 0):
        return "the controller refuses it"
    along = PLANES[state.plane or G17][2]
    if not control.watched and (series.level[1] < r or series.at[along][1] < r):
        return "R is above the tool"
    if not _pecks_are_told(series, code, state):
        return "the machine file does not say how it pecks"
    if state.retract is None and series.level[1] > r:
        return "G98 or G99 is not known"
    if "S" in control.heights[code] and not turning:
        return "the spindle may stand"
    return None


def _own_words(heights: str) -> set[str]:
    """Letters that this cycle needs and others do not: P of a dwell, Q of pecks."""
    return {"P"} & set(heights) | ({"Q"} if heights[0] in "bc" else set())


def _pecks_are_told(series: Series, code: int, state: State) -> bool:
    """Whether it is known how far pecks go back, and less than they go down."""
    control, kind = series.control, series.control.heights[code][0]
    if kind not in "bc":
        return True
    back = control.distance(control.back[kind], state.unit)
    if back is None or (kind == "c" and control.distance(control.lift, state.unit) is None):
        return False
    return not control.beside or back < series.said["Q"]


def _remember(series: Series, code: int, said: dict[str, Fraction], along: str) -> None:
    """Put the words of a block in force; another cycle begins without any."""
    if series.code != code:
        series.code, series.said = code, {}
    if along in said:
        series.said["z"] = said[along]
    series.said |= {letter: said[letter] for letter in "RPQ" if letter in said}


def _heights(series: Series, state: State) -> tuple[Fraction, Fraction]:
    """R and the bottom along the drilling axis, in the program's unit."""
    r, z = series.said["R"], series.said["z"]
    if state.distance == G91:
        level = series.level[1]
        return level + r, level + r + z
    return r, z


def _pecks(series: Series, code: int, r: Fraction, z: Fraction) -> list[int]:
    """How many pecks end above the bottom; two counts where binary numbers decide."""
    if series.control.heights[code][0] == "z":
        return [0]
    steps = (r - z) / series.said["Q"]
    if series.control.beside:  # such a control counts its least increments
        return [max(math.ceil(steps) - 1, 0)]
    nearest = round(steps)
    if nearest > 0 and abs(steps - nearest) * series.said["Q"] < CLOSE:
        return [nearest - 1, nearest]
    return [math.floor(steps)]


def _visits(
    series: Series,
    code: int,
    heights: tuple[Fraction, Fraction, Fraction],
    pecks: int,
    state: State,
    turning: int,
) -> Iterator[tuple[str, Fraction]]:
    """What happens over a hole once the tool is at R: its kind, and the height or number."""
    r, z, top = heights
    control = series.control
    lift = control.distance(control.lift, state.unit) or Fraction(0)
    for step in control.heights[code]:
        if step in "bc":
            back = control.distance(control.back[step], state.unit) or Fraction(0)
            for k in range(1, pecks + 1):
                depth = r - k * series.said["Q"]
                yield "feed", depth
                if step == "c":
                    yield "rapid", r + lift
                yield "rapid", depth + back
        elif step in "zrt":
            yield "feed", {"z": z, "r": r, "t": top}[step]
        elif step == "T":
            yield "rapid", top
        elif step == "P":
            yield "dwell", series.said["P"]
        else:
            yield "spindle", Fraction(5 if step == "S" else turning)


def _places(
    series: Series,
    said: dict[str, Fraction],
    visits: list[tuple[str, Fraction]],
    heights: tuple[Fraction, Fraction],
    repeats: int,
    state: State,
) -> Iterator[Event]:
    """Every place of every hole, standing still included."""
    first, second, along = PLANES[state.plane or G17]
    r, top = heights
    a, b, c = series.at[first], series.at[second], series.at[along][1]
    if series.level[1] < r:
        c = r
        yield "rapid", (a, b, ("", c))
    for k in range(repeats):
        if state.distance == G91:
            a = (a[0], a[1] + said.get(first, Fraction(0)))
            b = (b[0], b[1] + said.get(second, Fraction(0)))
        else:
            a = ("", said[first]) if first in said else a
            b = ("", said[second]) if second in said else b
        # The manual's "preliminary motion": level where that is above R.
        c = c if series.control.beside or (k == 0 and c > r) else top
        yield "rapid", (a, b, ("", c))
        yield "rapid", (a, b, ("", r))
        for kind, value in visits:
            moves = kind in ("rapid", "feed")
            yield kind, (a, b, ("", value)) if moves else value
        c = top


def number_of(text: bytes) -> Fraction:
    """A decimal number, exactly."""
    return Fraction(b"".join(text.split()).decode() or "0")


def read_event(
    line: bytes,
    at: dict[str, Height],
    incremental: bool,
    plane: tuple[str, str, str],
    control: Control,
    unit: float | None,
) -> tuple[Event, dict[str, Height]] | None:
    """One line as what it does, and where it leaves the tool; None where it is none of ours."""
    if match := _MOVE.fullmatch(line):
        after, kind = dict(at), "rapid" if match[2] == b"G0" else "feed"
        for word in match[3].split():
            letter, number = word[:1].decode(), word[1:]
            if not number.strip(b"+-."):
                return None
            value = control.number(letter, number, unit)
            if value is None:
                return None
            after[letter] = (at[letter][0], at[letter][1] + value) if incremental else ("", value)
        if after.keys() != at.keys() or len(match[3].split()) > 3:
            return None
        if bool(match[1]) != (control.beside and kind == "feed"):
            return None  # a feed move of such a control has to end in a standstill
        return (kind, tuple(after[letter] for letter in plane)), after
    if (match := _DWELL.fullmatch(line)) and match[1].strip(b"."):
        if control.point not in (None, b"." in match[1]):
            return None
        return ("dwell", number_of(match[1])), at
    if line in (b"M3", b"M4", b"M5"):
        return ("spindle", number_of(line[1:])), at
    return None


def same(one: Event, other: Event) -> bool:
    """Whether two events are the same."""
    if one[0] != other[0]:
        return False
    if one[1] == other[1]:
        return True
    if isinstance(one[1], tuple) and isinstance(other[1], tuple):
        pairs = zip(one[1], other[1], strict=True)
        return all(a == b or (a[0] == b[0] and abs(a[1] - b[1]) < CLOSE) for a, b in pairs)
    return False


def _moving(
    events: Iterator[Event], series: Series, plane: tuple[str, str, str]
) -> Iterator[Event]:
    """The events but for moves that stand still."""
    at: Event = ("", tuple(series.at[letter] for letter in plane))
    for event in events:
        if event[0] not in ("rapid", "feed"):
            yield event
        elif not same((at[0], event[1]), at):
            at = ("", event[1])
            yield event


def told(event: Event, plane: tuple[str, str, str]) -> str:
    """An event in words."""
    kind, value = event
    if isinstance(value, tuple):
        words = (
            f"{letter}{float(number):.10g}"
            for letter, (origin, number) in zip(plane, value, strict=True)
            if not origin
        )
        return f"a {kind} to {' '.join(words)}"
    return f"{kind} {float(value):g}"


def with_rests(events: list[Event]) -> Iterator[Event]:
    """The events with a rest behind every move that no dwell follows."""
    for k, event in enumerate(events):
        yield event
        if event[0] in ("rapid", "feed") and [e[0] for e in events[k + 1 : k + 2]] != ["dwell"]:
            yield "dwell", Fraction(0)


def stays(after: dict[str, Height], before: dict[str, Height]) -> bool:
    """Whether a move goes by less than a number of the program can say, but not by nothing."""
    return after != before and same(("", (*after.values(),)), ("", (*before.values(),)))
