"""A series of drilling cycles, from its first block to G80 or another motion: certain or not.

While a cycle is in force every bare `X..` drills, so a series can be written out as a whole or not
at all. This module owns that judgement, and the text of one block that is written out::

    (gcodejerk: N120 G98 G81 X10. Y5. Z-6. R2. M8)   names the original
    N120 G98 M8                                      what else the block says
    G61                                              LinuxCNC runs cycles in exact path mode
    G0 X10. Y5.                                      the moves
    ...
    G64 P0.05                                        the path mode that the program has
    M0                                               what takes effect after motion

Where the program's path mode is not known, so that nothing could return to it, `G4 P0` follows
every move instead: the tool comes to rest where exact path mode would not have rounded the corner.

Rule 1: whatever might make a block something else than it seems makes the series uncertain: flow,
expressions, block delete, changes of frame, words that are not known to keep their order.
Rule 2: depths and increments are decimals, words in the plane are the program's own.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Context, Decimal

from gcodejerk.axes import AXES
from gcodejerk.cycles.drilling import (
    MOST_MOVES,
    Call,
    Cycle,
    DrillingRules,
    Kind,
    Out,
    Pecks,
    drill,
    end_of,
    most_moves,
)
from gcodejerk.nc.dialects.dialect import PLANES
from gcodejerk.nc.dialects.gcodes import (
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
from gcodejerk.nc.text.block import Block, Word
from gcodejerk.reasons import Reason

COMMENT_LENGTH = 69
"""Controllers and senders with short lines choke on longer comments."""
KNOWN_DECIMALS = 9
"""To which a position is a number of the program: far below any resolution."""
TOLERANCE = Context(prec=12)
"""Digits of a tolerance that has to be converted."""

_STOPS = frozenset({0, 1, 2, 30, 60})
_HARMLESS_M = frozenset({3, 4, 5, 7, 8, 9, 48, 49})
_HARMLESS_G = frozenset({G17, G18, G19, G20, G21, G40, G90, G91, G90_1, G91_1, G94, G95, G98, G99})
"""G codes that act before the motion of their block, and of which the state tells all."""
_TAKERS = frozenset({100, 280, 300, 520, 920})
"""G codes that the axis words of their block belong to, whatever motion is in force."""
_HARMLESS_LETTERS = frozenset("NFST")
_EXACT = frozenset({61, 62})


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


def begin_series(line: int, moment: Moment) -> Series:
    """A series that the block of this moment begins."""
    state = moment.state
    level = None
    if state.plane in PLANES and state.unit is not None:
        along = AXES.index(PLANES[state.plane][2])
        number = moment.before[along] / state.scale(along)
        if number == number:
            level = Decimal(repr(round(number, KNOWN_DECIMALS)))
    return Series(line, state.plane, state.unit, level, level)


def drills(block: Block, state: State, cycles: frozenset[int]) -> bool:
    """Whether a block makes a hole: a cycle is in force, and nothing else takes its axis words."""
    if state.motion not in cycles or not any(word.letter in AXES for word in block.words):
        return False
    return not _TAKERS & {*g_codes(block)}


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


def passes(block: Block) -> bool:
    """Whether a block without motion may stand between two holes."""
    for word in block.words:
        number = -1.0 if word.value is None else word.value
        if word.letter == "G":
            good = round(number * 10) in _HARMLESS_G | {40}
        elif word.letter == "M":
            good = number in _HARMLESS_M | {0, 1, 60}
        else:
            good = word.letter in _HARMLESS_LETTERS | {"P"}
        if not good:
            return False
    return True


def why_left_alone(
    series: Series, moment: Moment, block: Block, rules: DrillingRules
) -> str | None:
    """Why the modal state does not allow to write a block out; None where it does."""
    state = moment.state
    code = state.motion or 0
    if series.broken is not None:
        return series.broken
    if code not in rules.cycles:
        return f"G{code / 10:g} is a cycle that only the controller can do"
    reasons = [
        (state.compensation != G40, str(Reason.CUTTER_COMPENSATION)),
        (state.rotated is not False, str(Reason.ROTATION)),
        (state.distance is None, str(Reason.DISTANCE_MODE_UNKNOWN)),
        (state.unit is None, str(Reason.UNITS_UNKNOWN)),
        (state.plane not in rules.planes, "the plane is not one of G17, G18, G19"),
        (state.plane != series.plane, "the plane changes within the series"),
        (state.unit != series.unit, "the unit changes within the series"),
        (series.level is None, str(Reason.START_UNKNOWN)),
        (state.feed_mode not in (94, 95) or not state.feed > 0.0, str(Reason.FEED_UNKNOWN)),
        (_on_diameter(state), "the drilling axis is programmed as a diameter"),
    ]
    for applies, reason in reasons:
        if applies:
            return reason
    own = {PLANES[state.plane or G17][k] for k in range(3)} | {"R", rules.repeats}
    own |= {rules.peck} if rules.cycles[code].pecks is not Pecks.NONE else set()
    own |= {rules.dwell} if rules.cycles[code].dwells else set()
    for word in block.words:
        number = -1.0 if word.value is None else word.value
        if word.letter == "G":
            good = round(number * 10) in _HARMLESS_G | {code}
        elif word.letter == "M":
            good = number in _HARMLESS_M | _STOPS
        else:
            good = word.letter in _HARMLESS_LETTERS | own
        if not good:
            return str(Reason.OTHER_WORDS)
    return None


def _on_diameter(state: State) -> bool:
    """Whether cycles drill along an X that is a diameter: R would not be one."""
    return state.diameter is not False and state.plane == G19


def _stops(moment: Moment) -> bool:
    """Whether the path mode is not known well enough to be stated again."""
    return moment.state.path not in _EXACT and (moment.state.path != 64 or moment.path is None)


@dataclass(frozen=True, slots=True)
class LeftAlone:
    """A block of a cycle that the controller has to run itself."""

    reason: str


def call_of(series: Series, moment: Moment, block: Block, rules: DrillingRules) -> Call | LeftAlone:
    """One block of a series as a call of its cycle, or why it is none; the series goes on."""
    state = moment.state
    code = state.motion or 0
    cycle = rules.cycles[code]
    given = {w.letter: decimal(w) for w in block.words if w.letter not in "GMN"}
    before = series.sticky or {} if series.code == code else {}
    sticky = _sticky(before, given, PLANES[state.plane or G17][2], rules)
    repeats = given.get(rules.repeats, Decimal(1))
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
    clearance = rules.clearance[state.unit != 1.0]
    if clearance is None and cycle.pecks is not Pecks.NONE:
        return LeftAlone("the clearance of its pecks is a parameter of the machine")
    if bottom > r:
        return LeftAlone(str(Reason.NOT_UNDERSTOOD))
    missing = _not_stated(moment, cycle, lifts=series.level > r)
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
        clearance=clearance or Decimal(0),
        dwell=sticky.get("dwell", Decimal(0)),
        binary=binary,
    )
    if most_moves(call) > MOST_MOVES:
        return LeftAlone(f"one block makes more than {MOST_MOVES} moves")
    series.code, series.sticky, series.at = code, sticky, end_of(call)
    return call


def _not_stated(moment: Moment, cycle: Cycle, *, lifts: bool) -> str | None:
    """What the program has not said that the way out needs; `lifts`: G98 leads higher than R."""
    if moment.state.retract is None and lifts:
        return "G98 or G99 is not stated"
    if cycle.out is Out.STOPPED and moment.spindle is None:
        return "the direction of the spindle is not known"
    return None


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


def decimal(word: Word) -> Decimal:
    """The number of a word, exactly."""
    return Decimal(b"".join(word.text[1:].split()).decode())


def plain(number: Decimal) -> bytes:
    """A number without exponent, with a decimal point, and never minus zero."""
    text = format(number if number else abs(number), "f")
    return (text.rstrip("0") if "." in text else text + ".").encode()


def write_block(
    text: bytes, block: Block, call: Call, moment: Moment, comments: bool
) -> list[bytes]:
    """The lines that stand for a block, without line ends.

    Parameters
    ----------
    text : bytes
        The block, without its line end.
    block : Block
        Its words.
    call : Call
        What it makes.
    moment : Moment
        In which state.
    comments : bool
        Name the block in a comment.

    Returns
    -------
    list of bytes
        Empty where the block says nothing else and the tool is at the bottom already.
    """
    state = moment.state
    kept, stops, rest, begin = [], [], [], 0
    for word in block.words:
        stop = word.letter == "M" and word.value in _STOPS
        cycle = word.letter == "G" and round((word.value or 0.0) * 10) == state.motion
        if not (stop or cycle or word.letter not in _HARMLESS_LETTERS | {"G", "M"}):
            kept.append(word)
            continue
        rest.append(text[begin : word.begin].strip(b" \t"))
        begin = word.end
        if stop:
            stops.append(b"".join(word.text.split()))
    rest.append(text[begin:].strip(b" \t"))
    lines = [_comment(block)] if comments else []
    if kept or block.comments:
        lines.append(b" ".join(part for part in rest if part))
    moves = _moves(block, call, moment)
    if _stops(moment):
        lines += _with_stops(moves)
    elif state.path in _EXACT or moment.path is None:
        lines += moves
    else:
        lines += [b"G61", *moves, moment.path.text(state.unit)]
    return lines + ([b" ".join(stops)] if stops else [])


def _moves(block: Block, call: Call, moment: Moment) -> list[bytes]:
    """The moves of a call as blocks."""
    incremental = moment.state.distance == G91
    along = PLANES[moment.state.plane or G17][2].encode()
    hole_words, going = _to_hole(block, moment)
    lines, at = [], call.start
    for move in drill(call):
        if move.kind is Kind.DWELL:
            lines.append(b"G4 P" + plain(call.dwell))
        elif move.kind in (Kind.STOP, Kind.START):
            lines.append(b"M5" if move.kind is Kind.STOP else b"M%d" % (moment.spindle or 5))
        else:
            words = list(hole_words) if move.kind is Kind.HOLE and going else []
            if move.to != at:
                words.append(along + plain(move.to - at if incremental else move.to))
            if words:
                lines.append(b" ".join([b"G1" if move.kind is Kind.FEED else b"G0", *words]))
            if move.kind is Kind.HOLE:
                going = going and incremental  # absolute repeats stay where they are
        at = move.to
    return lines


def _to_hole(block: Block, moment: Moment) -> tuple[list[bytes], bool]:
    """The words of a block that lead to its hole, and whether they lead anywhere."""
    plane = PLANES[moment.state.plane or G17]
    hole = [w for w in block.words if w.letter in plane[:2]]
    words = [b"".join(w.text.split()).upper() for w in hole]
    if moment.state.distance == G91:
        return words, any(w.value for w in hole)
    # An unknown position is a NaN, which differs from everything.
    axes = [AXES.index(w.letter) for w in hole]
    return words, any(moment.before[axis] != moment.state.position[axis] for axis in axes)


def _with_stops(moves: list[bytes]) -> list[bytes]:
    """The moves, with a rest behind each that has none."""
    out = []
    for k, line in enumerate(moves):
        out.append(line)
        dwells = moves[k + 1 : k + 2] and moves[k + 1].startswith(b"G4")
        if line.startswith((b"G0", b"G1")) and not dwells:
            out.append(b"G4 P0")
    return out


def _comment(block: Block) -> bytes:
    """`(gcodejerk: ...)` with the words of the block, in at most COMMENT_LENGTH characters."""
    words = b" ".join(b"".join(w.text.split()) for w in block.words)
    shown = bytes(c if 32 <= c < 127 and c not in b"()" else ord("?") for c in words)
    room = COMMENT_LENGTH - len(b"(gcodejerk: )")
    if len(shown) > room:
        shown = shown[: room - 3] + b"..."
    return b"(gcodejerk: " + shown + b")"
