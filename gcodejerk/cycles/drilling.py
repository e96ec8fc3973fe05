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
from dataclasses import dataclass
from decimal import Decimal

from gcodejerk.nc.dialects.gcodes import G17, G18, G19

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
    clearance: Mapping[bool, Decimal | None]
    """Distance that G83 and G73 keep above, or go back: in mm (False) and inches (True); None where
    a parameter of the machine decides."""


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

DRILLING: dict[str, DrillingRules] = {"linuxcnc": LINUXCNC}
"""By dialect; a dialect that is missing has cycles that nobody writes out."""


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
    dwell: Decimal = Decimal(0)
    """In the unit of G4."""
    binary: tuple[float, float] | None = None
    """R and bottom as the controller adds them up; the nearest to the decimals by default."""


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
        at = at if repeat == 0 and at > call.r else end_of(call)
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
                path.append(Move(Kind.RAPID, r))
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
    """Depths at which a peck ends above the bottom, counted in binary like the controller."""
    depth, bottom = call.binary or (float(call.r), float(call.bottom))
    peck = float(call.peck)
    done = 1
    while (depth := depth - peck) > bottom:
        yield call.r - done * call.peck
        done += 1
