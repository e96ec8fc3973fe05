"""The program that is run to record vibration: rapids there and back, and dwells behind each.

Rule: it is relative, begins and ends in the same place, and says how much room it takes; it starts
no spindle, changes no offset and no tool. What a control calls a dwell of seconds stands in one
table, with its source; dialects whose words nobody verified are refused.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from gcodejerk.errors import PlanError
from gcodejerk.identification.excitation import Excitation
from gcodejerk.machine import Machine
from gcodejerk.units import per_minute


@dataclass(frozen=True, slots=True)
class Words:
    """How a dialect says what the program needs."""

    dwell: str
    """With ``{s}`` seconds or ``{ms}`` milliseconds."""
    remark: tuple[str, str] = ("(", ")")
    first: tuple[str, ...] = ()
    metric: str = "G21"
    spindle_off: str | None = "M5"
    last: tuple[str, ...] = ("M2",)
    feed: bool = False
    """G0 goes at F [mm/min]: the rapid's speed is stated."""
    incremental: str | None = None
    """Addresses of increments, where no code makes X one."""
    note: str = ""


_FANUC = Words("G4 X{s}", first=("%", "O9001"), last=("M30", "%"))
DIALECTS: dict[str, Words] = {
    # linuxcnc.org, G-codes: G4 P seconds
    "linuxcnc": Words("G4 P{s}"),
    # Mach3 manual: P is seconds or ms, as Configuration, General Config has it
    "mach": Words("G4 P{s}", note="set G04 Dwell to seconds (General Config), or dwells are short"),
    # grbl wiki: G4 P seconds
    "grbl": Words("G4 P{s}"),
    # B-64484EN: G04 X seconds, with a decimal point
    "fanuc": _FANUC,
    "fanuc-lathe-b": _FANUC,
    # System A has no G91: U and W are increments
    "fanuc-lathe-a": Words("G4 X{s}", first=("%", "O9001"), last=("M30", "%"), incremental="UVW"),
    # Haas mill operator's manual: G04 P with a decimal point is seconds
    "haas": Words("G4 P{s}", first=("%", "O9001"), last=("M30", "%")),
    # SINUMERIK programming manual: G4 F seconds; G71 metric
    "siemens": Words("G4 F{s}", remark=("; ", ""), metric="G71", last=("M30",)),
    # marlinfw.org G004: P ms; G0 goes at F
    "marlin": Words("G4 P{ms}", remark=("; ", ""), spindle_off=None, last=("M400",), feed=True),
    # Klipper G-Codes.md: G4 P ms; G0 goes at F
    "klipper": Words(
        "G4 P{ms}", remark=("; ", ""), metric="", spindle_off=None, last=("M400",), feed=True
    ),
}  # fmt: skip


def rapids_program(
    machine: Machine, rapids: Sequence[Excitation], repeats: int, dwell: float
) -> str:
    """The text of the program.

    Parameters
    ----------
    machine : Machine
        Its dialect.
    rapids : sequence of Excitation
        Axis after axis.
    repeats : int
        How often each length goes there and back.
    dwell : float
        Behind every rapid. [s]

    Returns
    -------
    str
        Lines of ASCII.

    Raises
    ------
    PlanError
        No words are known for the dialect.
    """
    words = DIALECTS.get(machine.dialect)
    if words is None:
        raise PlanError(
            f"there is no test program in the dialect {machine.dialect}",
            f"it is written for {', '.join(DIALECTS)}; state another dialect in the machine file",
        )
    return "\n".join(_lines(machine, words, rapids, repeats, dwell)) + "\n"


def _lines(
    machine: Machine, words: Words, rapids: Sequence[Excitation], repeats: int, dwell: float
) -> Iterator[str]:
    yield from words.first
    for text in _instructions(machine, rapids, repeats, dwell):
        yield _remark(words, text)
    if words.note:
        yield _remark(words, words.note.upper())
    modes = [words.metric, "" if words.incremental else "G91"]
    yield " ".join(filter(None, modes))
    if words.spindle_off is not None:
        yield words.spindle_off
    pause = words.dwell.format(s=_number(dwell), ms=f"{dwell * 1000.0:.0f}")
    yield pause
    for one in rapids:
        axis = machine.axis(one.axis)
        letter, factor = one.axis, 2.0 if axis.diameter else 1.0
        if words.incremental is not None and letter in "XYZ":
            letter = words.incremental["XYZ".index(letter)]
        speed = f" F{per_minute(axis.rapid.velocity):.0f}" if words.feed else ""
        unit = "deg" if axis.rotary else "mm"
        for length, time in zip(one.length, one.time, strict=True):
            said = f"{one.axis} {length:g} {unit}, {time * 1000.0:.0f} ms, {repeats} times"
            yield _remark(words, said.upper())
            for _ in range(repeats):
                for way in (length, -length):
                    yield f"G0 {letter}{_number(factor * way)}{speed}"
                    yield pause
    if not words.incremental:
        yield "G90"
    yield from words.last


def _instructions(
    machine: Machine, rapids: Sequence[Excitation], repeats: int, dwell: float
) -> Iterator[str]:
    moves = sum(2 * repeats * len(one.length) for one in rapids)
    lasts = moves * dwell + sum(2 * repeats * sum(one.time) for one in rapids)
    yield "RAPIDS TO RECORD VIBRATION WITH, BY GCODEJERK"
    yield f"{moves} RAPIDS, ABOUT {lasts / 60.0:.1f} MIN. SPINDLE OFF, NO TOOL IN THE WORK"
    for one in rapids:
        unit = "DEG" if machine.axis(one.axis).rotary else "MM"
        yield f"FROM WHERE IT STARTS, {one.axis} GOES {one.length[-1]:g} {unit} TO PLUS AND BACK"
    yield "JOG TO WHERE THERE IS THAT ROOM, ALL OVERRIDES AT 100 %"


def _remark(words: Words, text: str) -> str:
    return f"{words.remark[0]}{text}{words.remark[1]}"


def _number(value: float) -> str:
    """Four decimals at most; whole numbers keep their point, which Fanuc needs."""
    return f"{value:.4f}".rstrip("0")
