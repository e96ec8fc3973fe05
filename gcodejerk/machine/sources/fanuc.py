"""Fanuc: parameters as text, punched by the control or typed.

Read are `N01420 A1 P24000 A2 P24000` (also with Q1 and L words), and lines such as
`1420 X24000 Y24000 Z18000` or `1420: X=24000`. Facts: 1420 rapid rate [mm/min] (IS-B, metric; role
M, unit U), 1620 time constant of rapids [ms] (A-63512EN p. 9: acceleration = rate/constant), 1621
bell time [ms] (U), 1401 bit 1 straight rapids (U), 1020 names of the axes (character codes), 1320
and 1321 stored stroke limits. That rapids have constant acceleration and not constant time (1603)
is assumed.
"""

from __future__ import annotations

import re

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.sources.draft import Draft, Fact
from gcodejerk.units import SECONDS_PER_MINUTE

KIND = "Fanuc parameters"
LETTERS = "XYZABCUVW"
ORDER = "XYZABC"
MS = 1e-3
_LINE = re.compile(
    r"^\s*(?:N0*|No\.?\s*)?(1020|1320|1321|1401|1420|1620|1621)(?!\d)[\s:=]*(.*)$", re.I | re.M
)
_PUNCHED = re.compile(r"A\s*(\d{1,2})\s*(?:Q\d+\s*)?P\s*(-?[\d.]+)", re.I)
_TYPED = re.compile(r"([XYZABCUVW])\s*[:=]?\s*(-?\d+(?:\.\d*)?)", re.I)
_SINGLE = re.compile(r"P?\s*(-?[\d.]+)\s*$", re.I)

Value = tuple[float, str]


def is_fanuc(text: str) -> bool:
    """Whether rapid rates and their time constants are in it."""
    numbers = {int(match[1]) for match in _LINE.finditer(text)}
    return 1420 in numbers


def read_fanuc(text: str, name: str) -> Draft:
    """What a list of parameters says.

    Raises
    ------
    MachineError
        A rapid rate stands for all axes, or no axis can be told.
    """
    found: dict[int, dict[str, Value]] = {}
    bits: dict[int, tuple[str, str]] = {}
    names = _names(text)
    for match in _LINE.finditer(text):
        number, rest = int(match[1]), match[2].strip()
        place = Place(name, text.count("\n", 0, match.start(1)) + 1)
        if number == 1401:
            if single := _SINGLE.search(rest):
                bits[number] = single[1], str(place)
        elif number != 1020:
            found.setdefault(number, {}).update(_values(number, rest, names, place))
    draft = Draft(KIND, controller="fanuc", name="Fanuc control")
    if not names and any(m for m in _PUNCHED.finditer(text)):
        draft.notes.append(
            "no 1020 says what the axes are called: axis 1 was taken for X, 2 for Y, 3 for Z (on a "
            "lathe, 2 is Z): check, and add 1020 to the list if it is otherwise"
        )
    draft.planner = (
        "averaged-trapezoid",
        "ASSUMED: constant acceleration, bell time behind it (1603)",
    )
    for letter, (rate, origin) in found.get(1420, {}).items():
        axis = draft.axis(letter)
        axis.velocity = Fact(rate / SECONDS_PER_MINUTE, f"1420 = {rate:g} mm/min ({origin})")
        constant = found.get(1620, {}).get(letter)
        if constant is not None and constant[0] > 0.0:
            axis.acceleration = Fact(
                axis.velocity.value / (constant[0] * MS),
                f"1420/1620, {constant[0]:g} ms ({constant[1]})",
            )
        bell = found.get(1621, {}).get(letter)
        seconds, said = (bell[0] * MS, f"1621 ({bell[1]})") if bell else (0.0, "")
        axis.law["second_average"] = (
            Fact(seconds, said) if bell else Fact(0.0, "no 1621 in the list", assumed=True)
        )
        low, high = found.get(1321, {}).get(letter), found.get(1320, {}).get(letter)
        if low and high and low[0] < high[0] and not axis.rotary and _plausible(low[0], high[0]):
            axis.travel, axis.travel_origin = (low[0], high[0]), "1321, 1320"
    _positioning(draft, bits)
    draft.interval = Fact(1e-3, "the usual interval of commands; blocks are 2 ms", assumed=True)
    draft.notes.append(
        "the rates were taken as mm/min (metric machine, increment system IS-B): look at the first "
        "rapid that `gcodejerk inspect` shows, and compare its time with the machine's"
    )
    return draft


def _positioning(draft: Draft, bits: dict[int, tuple[str, str]]) -> None:
    """Bit 1 of 1401, LRP."""
    if 1401 not in bits:
        draft.positioning = "independent", "ASSUMED: 1401#1 (LRP) is 0, each axis on its own"
        return
    text, origin = bits[1401]
    straight = text[-2] == "1" if re.fullmatch(r"[01]{8}", text) else bool(int(float(text)) & 2)
    kind = "linear" if straight else "independent"
    draft.positioning = kind, f"1401#1 (LRP) is {int(straight)} ({origin})"


def _plausible(low: float, high: float) -> bool:
    """Stroke limits that are set, not the widest numbers of the control."""
    return max(abs(low), abs(high)) < 99_999.0


def _names(text: str) -> dict[int, str]:
    """Axis number -> letter, from 1020."""
    out: dict[int, str] = {}
    for match in _LINE.finditer(text):
        if int(match[1]) == 1020:
            for number, code in _PUNCHED.findall(match[2]):
                letter = chr(int(float(code))) if 65 <= float(code) <= 90 else "?"
                if letter in LETTERS:
                    out[int(number)] = letter
    return out


def _values(number: int, rest: str, names: dict[int, str], place: Place) -> dict[str, Value]:
    """Letter -> value and place, of one line."""
    out: dict[str, Value] = {}
    punched = _PUNCHED.findall(rest)
    if punched:
        for index, value in punched:
            k = int(index)
            letter = names.get(k) if names else (ORDER[k - 1] if 1 <= k <= len(ORDER) else None)
            if letter is not None:
                out[letter] = float(value), str(place)
        return out
    for letter, value in _TYPED.findall(rest):
        out[letter.upper()] = float(value), str(place)
    if not out and rest:
        raise MachineError(
            f"{number} {rest!r} names no axis", f"write it as {number} X24000 Y24000 Z18000", place
        )
    return out
