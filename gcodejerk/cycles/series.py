"""A series of drilling cycles, from its first block to G80 or another motion: certain or not.

While a cycle is in force every bare `X..` drills, so a series can be written out as a whole or not
at all. This module owns that judgement; `blocks` owns the text that one block becomes.

Rule 1: whatever might make a block something else than it seems makes the series uncertain: flow,
expressions, block delete, changes of frame, words that are not known to keep their order.
Rule 2: depths and increments are decimals, words in the plane are the program's own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Context, Decimal

from gcodejerk.axes import AXES
from gcodejerk.cycles.drilling import (
    MOST_MOVES,
    Call,
    Cycle,
    DrillingRules,
    Out,
    Pecks,
    end_of,
    most_moves,
)
from gcodejerk.cycles.numbers import length, plain
from gcodejerk.nc.dialects.dialect import PLANES, Dialect
from gcodejerk.nc.dialects.gcodes import (
    G0,
    G1,
    G17,
    G18,
    G19,
    G20,
    G21,
    G40,
    G90,
    G90_1,
    G91,
    G91_1,
    G94,
    G95,
    G98,
    G99,
)
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.text.block import Block
from gcodejerk.reasons import Reason

KNOWN_DECIMALS = 9
"""To which a position is a number of the program: far below any resolution."""
TOLERANCE = Context(prec=12)
"""Digits of a tolerance that has to be converted."""

STOPS = frozenset({0, 1, 2, 30, 60})
_HARMLESS_M = frozenset({3, 4, 5, 7, 8, 9, 48, 49})
_HARMLESS_G = frozenset({G17, G18, G19, G20, G21, G40, G90, G91, G90_1, G91_1, G94, G95, G98, G99})
"""G codes that act before the motion of their block, and of which the state tells all."""
_SPINDLE_AND_COOLANT = frozenset({3, 4, 5, 7, 8, 9})
_TAKERS = frozenset({100, 280, 300, 520, 920})
"""G codes that the axis words of their block belong to, whatever motion is in force."""
HARMLESS_LETTERS = frozenset("NFST")
EXACT = frozenset({61, 62})


@dataclass(frozen=True, slots=True)
class PathWords:
    """The words of the G64 in force: tolerances, which keep their length when the unit changes."""

    words: tuple[tuple[str, Decimal], ...]
    """P and Q, as programmed."""
    unit: float | None
    """mm per unit of these words."""

    def text(self, unit: float | None) -> bytes:
        """The words in another unit."""
        out = []
        for letter, number in self.words:
            if unit != self.unit:
                number = TOLERANCE.create_decimal(number * Decimal(str(self.unit)))
                number = TOLERANCE.divide(number, Decimal(str(unit)))
            out.append(letter.encode() + plain(number))
        return b" ".join((b"G64", *out))


@dataclass(slots=True)
class Series:
    """What is in force from block to block of a series."""

    line: int
    """Of the first block."""
    plane: int | None
    unit: float | None
    level: Decimal | None
    """Where the tool stood along the drilling axis when the series began."""
    at: Decimal | None = None
    """Where it stands."""
    reason: str | None = None
    """Why the series is left to the controller."""
    broken: str | None = None
    """What stands in the series that a further hole must not follow."""
    code: int = 0
    sticky: dict[str, Decimal] | None = None
    distance: int | None = None
    """G90 or G91, as its first block has it."""
    dwells: bool = False
    """A block of it states a dwell."""


@dataclass(frozen=True, slots=True)
class Moment:
    """What a block of a series meets."""

    before: list[float]
    """Positions in front of it. [mm]"""
    state: State
    """After it."""
    path: PathWords | None
    spindle: int | None
    """M3 or M4; None where it stands or is not known to turn."""
    cycle: int | None
    """The cycle in force, times ten; None: none, or nobody knows."""


def begin_series(line: int, moment: Moment) -> Series:
    """A series that the block of this moment begins."""
    state = moment.state
    level = None
    if state.plane in PLANES and state.unit is not None:
        along = AXES.index(PLANES[state.plane][2])
        number = moment.before[along] / state.scale(along)
        if number == number:
            level = Decimal(repr(round(number, KNOWN_DECIMALS)))
    return Series(line, state.plane, state.unit, level, level, distance=state.distance)


def cycle_in_force(state: State, dialect: Dialect) -> int | None:
    """Code of the cycle in force; None where there is none, or nobody knows."""
    if dialect.drilling.own_group:
        return None if state.cycle is None else state.cycle[0]
    return state.motion if state.motion in dialect.cycles else None


def drills(block: Block, moment: Moment, dialect: Dialect) -> bool:
    """Whether a block makes a hole: a cycle is in force, and nothing else takes its axis words."""
    if moment.cycle is None or not any(word.letter in AXES for word in block.words):
        return False
    codes = g_codes(block)
    if dialect.drilling.own_group:
        return not any(dialect.groups.get(code) == "non-modal" for code in codes)
    return not _TAKERS & {*codes}


def g_codes(block: Block) -> list[int]:
    """G codes of a block, times ten."""
    return [round(w.value * 10) for w in block.words if w.letter == "G" and w.value is not None]


def doubt(block: Block) -> str | None:
    """Why what a block does is not certain, whatever the state."""
    if block.block_delete:
        return str(Reason.BLOCK_DELETE)
    if block.assigns or any(word.value is None for word in block.words):
        return str(Reason.EXPRESSION)
    if block.o_word is not None:
        return str(Reason.SUBPROGRAM)
    return None


def passes(block: Block, rules: DrillingRules) -> bool:
    """Whether a block without motion may stand between two holes."""
    # R makes a hole of its own there, and P may be the dwell of the next one.
    letters = HARMLESS_LETTERS - {"T"} if rules.own_group else HARMLESS_LETTERS | {"P"}
    for word in block.words:
        number = -1.0 if word.value is None else word.value
        if word.letter == "G":
            good = round(number * 10) in _HARMLESS_G | {40}
        elif word.letter == "M":
            good = number in _HARMLESS_M | {0, 1, 60}
        else:
            good = word.letter in letters
        if not good:
            return False
    return True


def why_left_alone(
    series: Series, moment: Moment, block: Block, rules: DrillingRules
) -> str | None:
    """Why the modal state does not allow to write a block out; None where it does."""
    state = moment.state
    code = moment.cycle or 0
    if series.broken is not None:
        return series.broken
    if code not in rules.cycles:
        alone = f"G{code / 10:g} is a cycle that only the controller can do"
        return rules.refused.get(code, alone)
    planes = "G17, G18, G19" if len(rules.planes) > 1 else "G17"
    reasons: list[tuple[bool, str]] = [
        (state.compensation != G40, str(Reason.CUTTER_COMPENSATION)),
        (state.transformed, str(Reason.ROTATION)),
        (state.distance is None, str(Reason.DISTANCE_MODE_UNKNOWN)),
        (state.unit is None, str(Reason.UNITS_UNKNOWN)),
        (state.plane not in rules.planes, f"the plane is not one of {planes}"),
        (state.plane != series.plane, "the plane changes within the series"),
        (state.unit != series.unit, "the unit changes within the series"),
        (series.level is None, str(Reason.START_UNKNOWN)),
        (state.feed_mode not in (94, 95) or not state.feed > 0.0, str(Reason.FEED_UNKNOWN)),
        (_on_diameter(state), "the drilling axis is programmed as a diameter"),
        *(_not_told(series, moment, rules) if rules.unmeasured else ()),
        *(_beside_motion(series, moment, block, rules) if rules.own_group else ()),
    ]
    for applies, reason in reasons:
        if applies:
            return reason
    return None if _words_are_known(code, block, state, rules) else str(Reason.OTHER_WORDS)


def _not_told(series: Series, moment: Moment, rules: DrillingRules) -> Iterator[tuple[bool, str]]:
    """What else has to be certain where nobody has watched the control."""
    state = moment.state
    yield state.distance != series.distance, "G90 and G91 change within the series"
    along = AXES.index(PLANES[G17][2])
    here = moment.before[along] / state.scale(along)
    # Somebody may have moved the axes meanwhile (M0).
    stands = series.at is not None and abs(here - float(series.at)) < 10.0**-KNOWN_DECIMALS
    yield not stands, str(Reason.START_UNKNOWN)
    fell = series.at != series.level and (state.retract != G99 or state.distance == G91)
    yield rules.plain_levels and fell, "what G98 or G91 means behind G99 is told in two ways"


def _beside_motion(
    series: Series, moment: Moment, block: Block, rules: DrillingRules
) -> Iterator[tuple[bool, str]]:
    """What else has to be certain where cycles are a modal group beside G0 and G1."""
    state, cycle = moment.state, rules.cycles[moment.cycle or 0]
    yield state.motion not in (G0, G1), "whether G0 or G1 is in force behind it is not known"
    yield state.path not in (61, 64), str(Reason.PATH_UNKNOWN)
    silent = not any(word.letter in PLANES[G17][:2] for word in block.words)
    told = "a setting decides whether it drills without X and Y (program.cycles.without_xy)"
    yield silent and rules.needs_position == "yes", told
    silent = silent and moment.cycle not in g_codes(block)
    told = "whether it drills without X, Y and its cycle's code is not known"
    yield silent and rules.needs_position == "unless stated", told
    yield cycle.dwells and state.feed_mode != 94, "a dwell may count revolutions in G95"
    lent = rules.pecks_dwell and series.dwells and not cycle.dwells
    yield lent and cycle.pecks is not Pecks.NONE, "the dwell of an earlier cycle holds in it"


def _words_are_known(code: int, block: Block, state: State, rules: DrillingRules) -> bool:
    """Whether every word of a block is its cycle's, or acts in front of it or behind it."""
    own = {PLANES[state.plane or G17][k] for k in range(3)} | {"R", rules.repeats}
    own |= {rules.peck} if rules.cycles[code].pecks is not Pecks.NONE else set()
    own |= {rules.dwell} if rules.cycles[code].dwells else set()
    own |= HARMLESS_LETTERS - ({"T"} if rules.own_group else set())
    # Behind a stop somebody may have moved the axes.
    switches = _SPINDLE_AND_COOLANT if rules.unmeasured else _HARMLESS_M | STOPS
    for word in block.words:
        number = -1.0 if word.value is None else word.value
        if word.letter == "G":
            good = round(number * 10) in _HARMLESS_G | {code}
        elif word.letter == "M":
            good = number in switches
        else:
            good = word.letter in own
        if not good:
            return False
    return True


def _on_diameter(state: State) -> bool:
    """Whether cycles drill along an X that is a diameter: R would not be one."""
    return state.diameter is not False and state.plane == G19


@dataclass(frozen=True, slots=True)
class LeftAlone:
    """A block of a cycle that the controller has to run itself."""

    reason: str


# Complex: one doubt behind another, in the order in which they are told.
def call_of(series: Series, moment: Moment, block: Block, rules: DrillingRules) -> Call | LeftAlone:
    """One block of a series as a call of its cycle, or why it is none; the series goes on."""
    state = moment.state
    code, inch = moment.cycle or 0, state.unit != 1.0
    cycle = rules.cycles[code]
    said = [(w.letter, length(w, rules, inch=inch)) for w in block.words if w.letter not in "GMN"]
    numbers = {letter: number for letter, number in said if number is not None}
    if any(number is None for _, number in said):
        return LeftAlone(str(Reason.DECIMAL_POINT))
    if not _dwell_is_that_of_g4(block, rules):
        return LeftAlone(f"{rules.dwell} may not count as in G4")
    before = series.sticky or {} if series.code == code else {}
    sticky = _sticky(before, numbers, PLANES[state.plane or G17][2], rules)
    repeats = numbers.get(rules.repeats, Decimal(1))
    if repeats != int(repeats) or repeats < 1 or not _is_complete(sticky, cycle):
        return LeftAlone(str(Reason.NOT_UNDERSTOOD))
    assert series.level is not None
    assert series.at is not None
    r, bottom = sticky["r"], sticky["bottom"]
    binary = float(r), float(bottom)
    if state.distance == G91:
        r += series.level
        bottom += r
        lifted = float(series.level) + binary[0]
        binary = lifted, lifted + binary[1]
    if bottom > r:
        return LeftAlone(str(Reason.NOT_UNDERSTOOD))
    missing = _not_stated(moment, cycle, rules, lifts=series.level > r)
    if missing is not None:
        return LeftAlone(missing)
    call = Call(
        cycle=cycle,
        start=series.at,
        level=series.level,
        r=r,
        bottom=bottom,
        back_to_r=state.retract == G99,
        repeats=int(repeats),
        peck=sticky.get("peck", Decimal(0)),
        clearance=_goes_back(cycle, rules, inch=inch) or Decimal(0),
        dwell=sticky.get("dwell", Decimal(0)),
        lift=rules.lift[inch] or Decimal(0),
        level_ways=rules.own_group,
        binary=binary,
        exact_pecks=rules.exact_pecks,
    )
    if doubt := _doubt_of(call, rules):
        return LeftAlone(doubt)
    series.code, series.sticky, series.at = code, sticky, end_of(call)
    return call


def _doubt_of(call: Call, rules: DrillingRules) -> str | None:
    """Why it is not certain what a complete call does, or why it is too long."""
    if rules.unmeasured and min(call.start, call.level) < call.r:
        return "R is above where the tool stands"
    if rules.plain_levels and call.cycle.out is Out.FEED_TO_R and end_of(call) != call.r:
        return "how it goes beyond R is told in two ways"
    if rules.own_group and call.cycle.pecks is not Pecks.NONE and call.clearance >= call.peck:
        return "its pecks are not longer than the way back"
    if most_moves(call) > MOST_MOVES:
        return f"one block makes more than {MOST_MOVES} moves"
    return None


def _dwell_is_that_of_g4(block: Block, rules: DrillingRules) -> bool:
    """Whether a dwell of the block is written so that G4 reads it in the same unit."""
    forms = {"any": (True, False), "whole": (True,), "point": (False,)}[rules.dwell_form]
    return all(word.whole in forms for word in block.words if word.letter == rules.dwell)


def _goes_back(cycle: Cycle, rules: DrillingRules, *, inch: bool) -> Decimal | None:
    """How far a cycle that pecks goes back, or how near to its last depth it comes down."""
    breaks = cycle.pecks is Pecks.BREAK and rules.break_back is not None
    return (rules.break_back if breaks and rules.break_back else rules.clearance)[inch]


def _not_stated(moment: Moment, cycle: Cycle, rules: DrillingRules, *, lifts: bool) -> str | None:
    """What nobody has said that a cycle needs; `lifts`: G98 leads higher than R."""
    inch = moment.state.unit != 1.0
    pecks = cycle.pecks is not Pecks.NONE
    key = "chip_retract" if cycle.pecks is Pecks.BREAK else "peck_clearance"
    clears = cycle.pecks is Pecks.CLEAR
    feeds_out = cycle.out in (Out.FEED, Out.FEED_TO_R)
    if moment.state.retract is None and lifts:
        return "G98 or G99 is not stated"
    if cycle.out is Out.STOPPED and moment.spindle is None:
        return "the direction of the spindle is not known"
    if pecks and _goes_back(cycle, rules, inch=inch) is None:
        return _setting(key)
    if clears and rules.lift[inch] is None:
        return _setting("clear_above_r")
    return _setting("boring_out") if feeds_out and not rules.feed_out else None


def _setting(key: str) -> str:
    """What to say of a setting that is missing."""
    return f"the machine file states no program.cycles.{key}, or none in whole increments"


def _sticky(
    before: dict[str, Decimal], given: dict[str, Decimal], along: str, rules: DrillingRules
) -> dict[str, Decimal]:
    """What is in force of a cycle: its first block states everything, later ones what changes."""
    letters = {"bottom": along, "r": "R", "peck": rules.peck, "dwell": rules.dwell}
    return before | {key: given[letter] for key, letter in letters.items() if letter in given}


def _is_complete(sticky: dict[str, Decimal], cycle: Cycle) -> bool:
    """Whether everything that a cycle needs is stated, and can be meant."""
    pecks = cycle.pecks is not Pecks.NONE
    applies = {"bottom": True, "r": True, "dwell": cycle.dwells, "peck": pecks}
    needed = {key for key, is_needed in applies.items() if is_needed}
    if needed - sticky.keys() or sticky.get("dwell", Decimal(0)) < 0:
        return False
    return not pecks or sticky["peck"] > 0
