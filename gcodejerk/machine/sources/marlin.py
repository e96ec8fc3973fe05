"""Marlin and RepRapFirmware: the answer to M503, or config.g.

Facts (Marlin's M503 report and G-code index; RepRapFirmware's G-code dictionary): M201 largest
acceleration of an axis [mm/s^2], M203 largest speed ([mm/s] in Marlin, [mm/min] in
RepRapFirmware), M204 T acceleration of travel moves, M208 travel (S0 the upper ends, S1 the lower
ones; RepRapFirmware 3 also X0:200), M593 input shaping, M493 S1 Marlin's FT motion, M584 R1 axes
that turn. M204 S is of all moves in reports without P: T there is that of retracts (Marlin 1.0,
Prusa-Firmware's ConfigurationStore.cpp, whose printers with TMC2130 report limits twice, for normal
and stealth mode). G20 changes units of what a report says: under inches it is refused.
"""

from __future__ import annotations

import re

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.sources.draft import Draft, Fact
from gcodejerk.units import SECONDS_PER_MINUTE

MARLIN, RRF = "Marlin M503", "RepRapFirmware config.g"
LETTERS, ROTARY = "XYZABCUVW", "ABC"
_CODE = re.compile(
    r"^[^\S\n]*(?:[^;\n]{0,80}(?:echo:|Recv:|[<>]))?[^\S\n]*(M\d+|G2[01])(?![\d.])\b([^;\n(]*)",
    re.I | re.M,
)
"""A terminal puts the time, Recv: or echo: in front. M201.1 is another code than M201."""
_WORD = re.compile(r'([A-Za-z])\s*("[^"]*"|\{[^}\n]*\}?|[+-]?[\d.:+-]+)')
_STEALTH = re.compile(r"^.*feedrates - stealth", re.I | re.M)
_CONDITION = re.compile(r"\s*(if|elif|else|while)\b", re.I)
_LIMITS = {"M201", "M203", "M204", "M208"}
_OF_RRF = re.compile(r"^\s*M(550|569|584|669|566|586|552|115)\b|\bM593\s+P\"", re.I | re.M)
_SHAPERS_OF_RRF = {"zvd", "zvdd", "zvddd", "mzv", "ei2", "ei3"}

Found = dict[str, list[tuple[dict[str, str], int]]]


def is_marlin(text: str) -> bool:
    """Whether speeds and accelerations are set in it."""
    codes = {match[1].upper() for match in _CODE.finditer(text)}
    return {"M201", "M203"} <= codes


def _codes(text: str, name: str) -> tuple[Found, bool]:
    """Every code with its words and line, and whether they are of RepRapFirmware."""
    found: Found = {}
    for match in _CODE.finditer(text):
        line = text.count("\n", 0, match.start(1)) + 1
        words = {letter.upper(): value for letter, value in _WORD.findall(match[2])}
        found.setdefault(match[1].upper(), []).append((words, line))
    if twice := _STEALTH.search(text):
        raise MachineError(
            "the report has limits twice, for normal and for stealth mode",
            "take the lines of the mode out in which the printer does not print",
            Place(name, text.count("\n", 0, twice.start()) + 1),
        )
    rrf = _OF_RRF.search(text) is not None
    if "G20" in found and not rrf:
        raise MachineError(
            "the report is in inches", "send G21, then M503 again",
            Place(name, found["G20"][0][1]),
        )  # fmt: skip
    return found, rrf


def read_marlin(text: str, name: str) -> Draft:
    """What a report or a config.g says; what comes twice counts as it came last.

    Raises
    ------
    MachineError
        A word is no number, the units are inches, or there are limits for two modes.
    """
    found, rrf = _codes(text, name)
    draft = Draft(RRF if rrf else MARLIN, controller="rrf" if rrf else "marlin")
    draft.name = "RepRapFirmware machine" if rrf else "Marlin machine"
    draft.positioning = "linear", "its G0 is a straight line"
    draft.planner = "trapezoidal", "it has no jerk limit (its jerk is a step of the speed)"
    per = SECONDS_PER_MINUTE if rrf else 1.0
    shared = _of_travel(found, rrf, name)
    if shared is not None:
        draft.path["acceleration"] = Fact(shared[0], f"{shared[1]}, of all travel")
    for letter in LETTERS:
        speed, own = _last(found, "M203", letter, name), _last(found, "M201", letter, name)
        if speed is None and own is None:
            continue
        if rrf and (other := _otherwise(found, letter)):
            draft.notes.append(other)
            continue
        axis = draft.axis(letter)
        if speed is not None:
            unit = "mm/min" if rrf else "mm/s"
            axis.velocity = Fact(speed[0] / per, f"M203 {letter}{speed[0]:g} {unit} ({speed[1]})")
        if own is not None:
            axis.acceleration = Fact(own[0], f"M201 {letter}{own[0]:g} ({own[1]})")
        if shared is not None and axis.acceleration and shared[0] < axis.acceleration.value:
            axis.acceleration = Fact(shared[0], f"{shared[1]}, of all travel")
        _travel(draft, letter, found, name)
    _shaper(draft, found, name)
    if rrf:
        _not_read(draft, text, found, name)
    else:
        draft.notes.append("an M503 report has no travel: add travel to each axis")
    return draft


def _number(text: str, what: str, place: Place) -> float:
    try:
        return float(text)
    except ValueError:
        raise MachineError(
            f"{what} is {text!r}, expected a number", "mend the line", place
        ) from None


def _last(found: Found, code: str, letter: str, name: str) -> tuple[float, str] | None:
    """The last value of a word, with its place."""
    for words, line in reversed(found.get(code, [])):
        if letter in words:
            place = Place(name, line)
            return _number(words[letter], f"{letter} of {code}", place), str(place)
    return None


def _of_travel(found: Found, rrf: bool, name: str) -> tuple[float, str] | None:
    """Acceleration of moves without extrusion, by the last M204 that has one."""
    for words, line in reversed(found.get("M204", [])):
        of_all = "S" in words and (rrf or "P" not in words)
        letter = "S" if of_all and not (rrf and "T" in words) else "T"
        if letter in words:
            place = Place(name, line)
            value = _number(words[letter], f"{letter} of M204", place)
            return value, f"M204 {letter}{value:g} ({place})"
    return None


def _turns(found: Found, letter: str) -> bool | None:
    """Whether M584 makes an axis one that turns; None where it does not say."""
    for words, _ in reversed(found.get("M584", [])):
        if letter in words and words.get("R") in {"0", "1"}:
            return words["R"] == "1"
    return None


def _otherwise(found: Found, letter: str) -> str:
    """A note where M584 makes an axis of another kind than its letter says; else empty."""
    turns = _turns(found, letter)
    if turns is None or turns == (letter in ROTARY):
        return ""
    return (
        f"{letter} {'turns' if turns else 'slides'} by M584, and a machine file has {letter} "
        f"{'in mm' if turns else 'in degrees'}: it is left out, and rapids that move it are left "
        "alone"
    )


def _not_read(draft: Draft, text: str, found: Found, name: str) -> None:
    """What of a config.g depends on other files, or on conditions."""
    for words, line in found.get("M98", []):
        called = words.get("P", "").strip('"')
        draft.notes.append(
            f"{Place(name, line)}: {called} is called, and not read: what it sets of M201, M203, "
            "M204 and M208 is missing here"
        )
    lines = text.split("\n")
    for code in sorted(_LIMITS & set(found)):
        for _, line in found[code]:
            if above := _condition_of(lines, line):
                draft.notes.append(
                    f"{Place(name, line)}: {code} stands below {lines[above - 1].strip()!r} of "
                    f"line {above}; it was taken as if it always ran"
                )


def _condition_of(lines: list[str], line: int) -> int | None:
    """Line of the condition that a line of RepRapFirmware stands under, by its indentation."""
    depth = _depth(lines[line - 1])
    for number in range(line - 1, 0, -1):
        text = lines[number - 1]
        if text.strip() and not text.strip().startswith(";") and _depth(text) < depth:
            if _CONDITION.match(text):
                return number
            depth = _depth(text)
    return None


def _depth(line: str) -> int:
    return len(line) - len(line.lstrip())


def _travel(draft: Draft, letter: str, found: Found, name: str) -> None:
    low = high = None
    origin = ""
    for words, line in found.get("M208", []):
        if letter not in words:
            continue
        place = Place(name, line)
        if "{" in words[letter]:
            draft.notes.append(
                f"{place}: {letter} of M208 is {words[letter]!r}, which is not known: travel of "
                f"{letter} is left out"
            )
            low = high = None
            break
        origin = f"M208 ({place})"
        ends = [_number(part, f"{letter} of M208", place) for part in words[letter].split(":")]
        if len(ends) == 2:
            low, high = ends
        elif words.get("S") == "1":
            low = ends[0]
        else:
            high = ends[0]
    axis = draft.axis(letter)
    if low is not None and high is not None and low < high:
        axis.travel, axis.travel_origin = (low, high), origin


def _shaper(draft: Draft, found: Found, name: str) -> None:
    """Input shaping, where it is one for all axes; else a note."""
    if any(words.get("S") == "1" for words, _ in found.get("M493", [])[-1:]):
        draft.notes.append(
            "M493 S1: FT motion is on, which plays its own trajectory (M494) behind its shapers; "
            "what this file calls today's rapid is the planner's trapezoid without both"
        )
    settings = [words for words, _ in found.get("M593", []) if _on(words)]
    if not settings:
        return
    if draft.kind == RRF:
        words = settings[-1]
        kind = words.get("P", "").strip('"').lower()
        damping = _last(found, "M593", "S", name)
        frequency = _last(found, "M593", "F", name)
        if kind in _SHAPERS_OF_RRF and frequency is not None:
            shaped: dict[str, str | float] = {
                "type": kind, "frequency": frequency[0], "damping": damping[0] if damping else 0.1,
            }  # fmt: skip
            for axis in draft.axes.values():
                axis.filter = shaped, f"M593 ({frequency[1]})"
        elif kind != "none":
            what = f"P {kind!r}" if kind else "no P (dynamic acceleration adjustment)"
            draft.notes.append(
                f"M593 has {what}, which a machine file cannot hold; it is left out, and what this "
                "file calls today's vibration is that without it"
            )
        return
    draft.notes.append(
        "M593 shapes X and Y today; a machine file has one filter for straight rapids of all axes, "
        "so it is left out, and what this file calls today's vibration is that without it"
    )


def _on(words: dict[str, str]) -> bool:
    """Whether M593 sets a shaper and does not switch it off."""
    return not re.fullmatch(r"0*\.?0*", words.get("F", "0"))
