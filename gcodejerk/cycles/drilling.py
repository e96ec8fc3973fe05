"""What a drilling cycle does on the way: one call becomes its elementary moves.

This module owns the tables that say what each cycle is on each controller, and the one function
that plays a cycle. It knows no text and no modal state.

Rule 1: what differs between controllers stands in `DrillingRules`; a cycle that is not listed there
is not written out. Those are left to the controller that it alone can do right: tapping (G74, G84)
follows the spindle, G76 and G87 orient it, G88 waits for the operator.
Rule 2: numbers are decimals as programmed, so that nothing is rounded. Only the number of pecks is
counted as the controller counts it, in binary: ten pecks of 0.1 do not always end at 1.
"""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import Literal

from gcodejerk.nc.dialects.gcodes import G17, G18, G19
from gcodejerk.start import Start

MOST_MOVES = 20_000
"""Of one block; more is a slip of the pen (a Q far too small, an L far too large)."""


class Pecks(enum.Enum):
    """How a cycle comes to depth."""

    NONE = enum.auto()
    BREAK = enum.auto()
    """Back by the clearance after each peck, to break the chip."""
    CLEAR = enum.auto()
    """Up to R after each peck, and down again to the clearance above where it stopped."""


class Out(enum.Enum):
    """How a cycle leaves the hole."""

    RAPID = enum.auto()
    FEED = enum.auto()
    """With feed, all the way."""
    FEED_TO_R = enum.auto()
    """With feed to R, and rapidly from there."""
    STOPPED = enum.auto()
    """Rapidly, while the spindle stands; it is started again above."""


@dataclass(frozen=True, slots=True)
class Cycle:
    """One drilling cycle."""

    pecks: Pecks = Pecks.NONE
    dwells: bool = False
    out: Out = Out.RAPID


Distance = Mapping[bool, Decimal | None]
"""In mm (False) and inches (True); None where nobody has said what a parameter of the machine is,
or where it is no whole number of increments."""


@dataclass(frozen=True, slots=True)
class DrillingRules:
    """What the drilling cycles of one controller mean."""

    cycles: Mapping[int, Cycle]
    """By G code, times ten."""
    planes: frozenset[int]
    repeats: str
    """Address of the number of repeats."""
    peck: str
    """Address of the depth of a peck."""
    dwell: str
    """Address of the dwell, which `G4` takes in the same unit."""
    borrows_dwell: frozenset[int]
    """Cycles that, without a dwell of their own, take that of whichever cycle stated one last."""
    clearance: Distance
    """That G83 keeps above where it stopped, and G73 goes back where `break_back` is None."""
    break_back: Distance | None = None
    lift: Distance = field(default_factory=lambda: {False: Decimal(0), True: Decimal(0)})
    """How far above R pecks are cleared."""
    feed_out: bool = True
    """Cycles that come out with feed do so with the one in force."""
    own_group: bool = False
    """The cycles are a modal group beside G0 and G1, which hold on behind them. The ways between
    holes are then level, from where the tool stands, and an M code of a cycle's block acts with its
    first positioning."""
    unmeasured: bool = False
    """Nobody has watched the control: a series is certain only where R is not above the tool, which
    stands where the hole before has left it, and where G90 or G91 holds throughout."""
    plain_levels: bool = False
    """Where G98 leads behind a hole with G99, what R counts from in G91 there, and how G85 goes
    beyond R, the sources tell in two ways: such holes are left alone."""
    exact_stop: bytes = b""
    """What lets a feed move end in a standstill, in front of it; empty where a path mode does."""
    exact_pecks: bool = False
    """Pecks are counted in least increments, not in binary fractions."""
    needs_position: Literal["no", "unless stated", "yes"] = "no"
    """Which blocks without an axis of the plane may make a hole or none: no block; those that do
    not state their cycle; all."""
    pecks_dwell: bool = False
    """A dwell that another cycle of the series states also holds for those that peck."""
    dwell_form: Literal["any", "whole", "point"] = "any"
    """How a dwell has to be written for `G4` to read it in the same unit."""
    whole: Literal["any", "unknown", "calculator", "standard"] = "any"
    """What a length without a decimal point is: the number as it stands; nobody knows; the number,
    or least increments, as in `gcodejerk.start.Start`."""
    refused: Mapping[int, str] = field(default_factory=dict)
    """Cycles of which it is another reason that they are missing above."""


LINUXCNC = DrillingRules(
    # LinuxCNC 2.9, G-codes, "Canned cycles", and each of them as its interpreter plays it
    # (tests/clients/test_interpreter_cycles.py).
    cycles={
        730: Cycle(pecks=Pecks.BREAK),
        810: Cycle(),
        820: Cycle(dwells=True),
        830: Cycle(pecks=Pecks.CLEAR),
        850: Cycle(out=Out.FEED_TO_R),
        860: Cycle(dwells=True, out=Out.STOPPED),
        890: Cycle(dwells=True, out=Out.FEED),
    },
    # U, V and W as drilling axes are left alone: nobody has compared them.
    planes=frozenset({G17, G18, G19}),
    repeats="L",
    peck="Q",
    dwell="P",
    # Tapping keeps the P of an earlier cycle, G80 or not; all others must state theirs.
    borrows_dwell=frozenset({740, 840}),
    # "G83 rapids down to 0.010 inch above", whatever the unit of the program
    clearance={False: Decimal("0.254"), True: Decimal("0.010")},
)

_Whole = Literal["any", "unknown", "calculator", "standard"]
_WHOLE: dict[str | None, _Whole] = {"calculator": "calculator", "standard": "standard"}
UNSAID: Distance = {False: None, True: None}
_FEEDS_OUT = Cycle(out=Out.FEED_TO_R)
FANUC = DrillingRules(
    # 30i user's manual B-63944EN-2/02: p. 53 (G83: rapid to d above where the last drilling ended,
    # 5115; R counts from the initial level, Z from R), p. 62 (G85: cutting feed back to R; an M
    # code acts with the first positioning). 5114 is the d of G73 and P milliseconds, as in G4
    # (pages on Fanuc's cycles by users and by Weihong, whose cycles are the same). That the rapid
    # of G73, and what G82 and G89 do besides dwelling, is as everywhere, is general knowledge.
    # G86 is missing: no page was found that says how the spindle goes on.
    cycles={
        730: Cycle(pecks=Pecks.BREAK),
        810: Cycle(),
        820: Cycle(dwells=True),
        830: Cycle(pecks=Pecks.CLEAR),
        850: _FEEDS_OUT,
        890: Cycle(dwells=True, out=Out.FEED_TO_R),
    },
    # In other planes a parameter (5101#0) may keep Z as the drilling axis.
    planes=frozenset({G17}),
    repeats="K",
    peck="Q",
    dwell="P",
    borrows_dwell=frozenset(),  # G80 clears what a cycle was given
    clearance=UNSAID,
    break_back=UNSAID,
    feed_out=False,
    own_group=True,
    unmeasured=True,
    exact_stop=b"G9 ",
    exact_pecks=True,
    dwell_form="whole",
    whole="unknown",
    refused={860: "no source tells how G86 starts the spindle again"},
)
HAAS = replace(
    # VF operator's manual 96-8000: p. 182 (order of motions, G98 and G99, G17 only; a motion of X
    # or Y makes a hole), pp. 185, 191, 192 (G73 and G83: settings 22 and 52; P in seconds, which
    # holds until G80; I, J and K are other ways of pecking). P with a decimal point is seconds in
    # G4, too; without one, G4 would read milliseconds.
    FANUC,
    repeats="L",
    lift=UNSAID,
    needs_position="yes",
    pecks_dwell=True,
    dwell_form="point",
)
_UNTOLD = "no source tells {} of Mach"
MACH = DrillingRules(
    # NIST RS274/NGC, from which Mach's language comes (gcodes.net/rs274ngc-g81-cycle; Smithy manual
    # azmanual.top/manuals/787958 pp. 32, 33, 108, 117). How far its pecks go back, and whether its
    # dwells count as G4 does, which a setting decides, was not found.
    cycles={810: Cycle(), 850: Cycle(out=Out.FEED_TO_R)},
    planes=frozenset({G17}),
    repeats="L",
    peck="Q",
    dwell="P",
    borrows_dwell=frozenset(),
    clearance=UNSAID,
    unmeasured=True,
    plain_levels=True,
    refused={
        **dict.fromkeys((730, 830), _UNTOLD.format("the way back of the pecks")),
        **dict.fromkeys((820, 860, 890), _UNTOLD.format("the unit of a cycle's dwell")),
    },
)
DRILLING: dict[str, DrillingRules] = {
    "linuxcnc": LINUXCNC,
    "fanuc": FANUC,
    "haas": HAAS,
    "mach": MACH,
}
"""By dialect; a dialect that is missing has cycles that nobody writes out."""


def rules_for(name: str, start: Start) -> DrillingRules:
    """The cycles of a dialect, with what the machine file says of the control's settings.

    Parameters
    ----------
    name : str
        Of the dialect.
    start : Start
        Where the table leaves nothing to the machine, it changes nothing.

    Returns
    -------
    DrillingRules
    """
    rules, settings = DRILLING[name], start.cycles
    if not rules.own_group:
        return rules
    drills = settings.without_xy == "drills" and rules.needs_position == "yes"
    return replace(
        rules,
        clearance=_distance(settings.peck_clearance),
        break_back=_distance(settings.chip_retract),
        lift=_distance(settings.clear_above_r) if rules.lift is UNSAID else rules.lift,
        feed_out=settings.boring_out == "feed",
        needs_position="unless stated" if drills else rules.needs_position,
        whole=_WHOLE.get(start.decimal_point, "unknown"),
    )


def _distance(mm: float | None) -> Distance:
    """A setting of the control in both units, in increments of 0.001 mm or 0.0001 inch."""
    if mm is None:
        return UNSAID
    out: dict[bool, Decimal | None] = {}
    for inch, scale, places in ((False, 1.0, 3), (True, 25.4, 4)):
        nearest = round(mm / scale, places)
        near = abs(nearest - mm / scale) < 1e-9
        out[inch] = Decimal(repr(nearest)) if near else None
    return out


class Kind(enum.Enum):
    """What an elementary move is."""

    HOLE = enum.auto()
    """Rapid to where the block says the hole is, in the plane or aslant."""
    RAPID = enum.auto()
    """Along the drilling axis, like FEED."""
    FEED = enum.auto()
    DWELL = enum.auto()
    STOP = enum.auto()
    START = enum.auto()
    """The spindle turns again as it did before."""


@dataclass(frozen=True, slots=True)
class Move:
    """One elementary move; `to` is its end along the drilling axis."""

    kind: Kind
    to: Decimal


@dataclass(frozen=True, slots=True)
class Call:
    """One block of a cycle, in the program's unit and coordinates, along the drilling axis."""

    cycle: Cycle
    start: Decimal
    """Where the tool stands."""
    level: Decimal
    """Where it stood when the series of cycles began."""
    r: Decimal
    bottom: Decimal
    back_to_r: bool
    """G99."""
    repeats: int = 1
    peck: Decimal = Decimal(0)
    clearance: Decimal = Decimal(0)
    lift: Decimal = Decimal(0)
    """How far above R pecks are cleared."""
    level_ways: bool = False
    """The way to every hole is level; otherwise it leads to where the tool will come back to."""
    dwell: Decimal = Decimal(0)
    """In the unit of G4."""
    binary: tuple[float, float] | None = None
    """R and bottom as the controller adds them up; the nearest to the decimals by default."""
    exact_pecks: bool = False
    """The controller counts pecks in least increments."""


def end_of(call: Call) -> Decimal:
    """Where a call leaves the tool along the drilling axis."""
    return call.r if call.back_to_r else max(call.level, call.r)


def drill(call: Call) -> Iterator[Move]:
    """Play one call of a cycle.

    Parameters
    ----------
    call : Call
        What the block says; the bottom is not above R, and a peck is above zero where it pecks.

    Yields
    ------
    Move
        In their order; HOLE once for each repeat, whether it moves or not, the others only where
        they move.

    Examples
    --------
    >>> ten, two, deep = Decimal(10), Decimal(2), Decimal(-3)
    >>> call = Call(Cycle(), ten, ten, two, deep, back_to_r=True)
    >>> [(move.kind.name, str(move.to)) for move in drill(call)]
    [('HOLE', '10'), ('RAPID', '2'), ('FEED', '-3'), ('RAPID', '2')]
    """
    at = call.start
    path = _one_hole(call)
    if call.level < call.r and at != call.r:
        at = call.r
        yield Move(Kind.RAPID, at)
    for repeat in range(call.repeats):
        # From above R the first way is level; any other goes to where the tool will come back to.
        at = at if call.level_ways or (repeat == 0 and at > call.r) else end_of(call)
        yield Move(Kind.HOLE, at)
        for move in path:
            if move.kind not in (Kind.RAPID, Kind.FEED) or move.to != at:
                at = move.to
                yield move


def most_moves(call: Call) -> int:
    """How many moves a call has at the most, without playing it."""
    pecks = 0
    if call.cycle.pecks is not Pecks.NONE:
        pecks = int((call.r - call.bottom) / call.peck) + 1
    return call.repeats * (3 * pecks + 8)


def _one_hole(call: Call) -> list[Move]:
    """From above R to the bottom and out."""
    cycle, r, bottom, top = call.cycle, call.r, call.bottom, end_of(call)
    path = [Move(Kind.RAPID, r)]
    if cycle.pecks is not Pecks.NONE:
        for depth in _pecks(call):
            path.append(Move(Kind.FEED, depth))
            if cycle.pecks is Pecks.CLEAR:
                path.append(Move(Kind.RAPID, r + call.lift))
            path.append(Move(Kind.RAPID, depth + call.clearance))
    path.append(Move(Kind.FEED, bottom))
    if cycle.dwells:
        path.append(Move(Kind.DWELL, bottom))
    if cycle.out is Out.STOPPED:
        return [*path, Move(Kind.STOP, bottom), Move(Kind.RAPID, top), Move(Kind.START, top)]
    if cycle.out is Out.FEED:
        return [*path, Move(Kind.FEED, top)]
    if cycle.out is Out.FEED_TO_R:
        path.append(Move(Kind.FEED, r))
    return [*path, Move(Kind.RAPID, top)]


def _pecks(call: Call) -> Iterator[Decimal]:
    """Depths at which a peck ends above the bottom, counted as the controller counts."""
    if call.exact_pecks:
        place = call.r
        while (place := place - call.peck) > call.bottom:
            yield place
        return
    depth, bottom = call.binary or (float(call.r), float(call.bottom))
    peck = float(call.peck)
    done = 1
    while (depth := depth - peck) > bottom:
        yield call.r - done * call.peck
        done += 1
