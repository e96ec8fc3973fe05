"""Fanuc: parameters as text, punched by the control or typed.

Read are `N01420 A1 P24000 A2 P24000` (also with Q1 and L words), and lines such as
`1420 X24000 Y24000 Z18000` or `1420: X=24000`. In place of P, 15i and 30i punch M in front of
lengths and feedrates in mm, I in front of those in inch, whatever the machine is (B-63330EN/03
p. 21 and 25, B-63950EN/02 p. 8). Facts: 1420 rapid rate [mm/min] (IS-B, metric; role M, unit U),
1620 time constant of rapids [ms] (A-63512EN p. 9: acceleration = rate/constant), 1621 bell time
[ms] (U), 1001 bit 0 a machine in inch, whose P are inch (U), 1401 bit 1 straight rapids (U), 1020
names of the axes (character codes), 1320 and 1321 stored stroke limits. That rapids have constant
acceleration and not constant time (1603) is assumed.
"""

from __future__ import annotations

import re

from gcodejerk.errors import MachineError, Place
from gcodejerk.machine.sources.draft import Draft, Fact
from gcodejerk.units import MM_PER_INCH, SECONDS_PER_MINUTE

KIND = "Fanuc parameters"
LETTERS = "XYZABCUVW"
ORDER = "XYZABC"
MS = 1e-3
_LINE = re.compile(
    r"^\s*(?:N0*|No\.?\s*)?(1001|1020|1320|1321|1401|1420|1620|1621)(?!\d)[\s:=]*(.*)$", re.I | re.M
)
_PUNCHED = re.compile(r"A\s*(\d{1,2})\s*(?:Q\d+\s*)?([PMI])\s*([^A;%\s]*)", re.I)
_TYPED = re.compile(r"([XYZABCUVW])\s*[:=]?\s*([-+.\d][^\sXYZABCUVW;]*)", re.I)
_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)")
OF_LENGTH = (1320, 1321, 1420)
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
        if number in (1001, 1401):
            if (single := _SINGLE.search(rest)) and _NUMBER.fullmatch(single[1]):
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
    _refuse_inch(text, bits, name)
    _positioning(draft, bits)
    draft.interval = Fact(1e-3, "the usual interval of commands; blocks are 2 ms", assumed=True)
    draft.notes.append(
        "the rates were taken as mm/min (metric machine, increment system IS-B): look at the first "
        "rapid that `gcodejerk inspect` shows, and compare its time with the machine's"
    )
    return draft


def _refuse_inch(text: str, bits: dict[int, tuple[str, str]], name: str) -> None:
    """Numbers behind P are in the unit of the machine, which bit 0 of 1001 says."""
    said = bits.get(1001, ("0", ""))[0]
    inch = said[-1] == "1" if re.fullmatch(r"[01]{8}", said) else bool(int(float(said)) & 1)
    rates = [m for m in _LINE.finditer(text) if int(m[1]) == 1420]
    kinds = {kind.upper() for m in rates for _, kind, _ in _PUNCHED.findall(m[2])} or {"P"}
    if inch and "P" in kinds:
        raise MachineError(
            "1001#0 (INM) is 1: the machine counts in inch, and so do its rates",
            "in place of the list, state --controller fanuc and each axis: --axis 'X "
            "velocity=945in/min acceleration=0.3g'",
            Place(name, text.count("\n", 0, rates[0].start(1)) + 1),
        )


def _value(text: str, number: int, letter: str, place: Place) -> float:
    """A number as it is punched or typed."""
    if not _NUMBER.fullmatch(text):
        raise MachineError(
            f"{number} of {letter} is {text!r}, expected a number",
            f"write {number} {letter}24000, with a point and without other marks",
            place,
        )
    return float(text)


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
            for number, _, text in _PUNCHED.findall(match[2]):
                code = float(text) if _NUMBER.fullmatch(text) else 0.0
                letter = chr(int(code)) if 65 <= code <= 90 else "?"
                if letter in LETTERS:
                    out[int(number)] = letter
    return out


def _values(number: int, rest: str, names: dict[int, str], place: Place) -> dict[str, Value]:
    """Letter -> value and place, of one line."""
    out: dict[str, Value] = {}
    punched = _PUNCHED.findall(rest)
    if punched:
        for index, kind, value in punched:
            k = int(index)
            letter = names.get(k) if names else (ORDER[k - 1] if 1 <= k <= len(ORDER) else None)
            if letter is not None:
                inch = kind.upper() == "I" and number in OF_LENGTH and letter not in "ABC"
                told = f"{value} inch, {place}" if inch else str(place)
                scale = MM_PER_INCH if inch else 1.0
                out[letter] = scale * _value(value, number, letter, place), told
        return out
    for letter, value in _TYPED.findall(rest):
        out[letter.upper()] = _value(value, number, letter.upper(), place), str(place)
    if not out and rest:
        raise MachineError(
            f"{number} {rest!r} names no axis", f"write it as {number} X24000 Y24000 Z18000", place
        )
    return out
