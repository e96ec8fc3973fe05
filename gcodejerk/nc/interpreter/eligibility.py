"""Whether a block is a rapid that can be rewritten, and why not.

Rule: the first reason in the order of `Reason` that applies is given; what nobody is sure of has
one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import (
    COMPENSATION,
    LEFT_OVER,
    LINEAR,
    MACHINE_WORDS,
    OVERRIDES,
    OVERRIDES_SET,
    Dialect,
    Effect,
)
from gcodejerk.nc.dialects.gcodes import G1, G40
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.limits import beyond_path
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.rapids import NO_FEED
from gcodejerk.nc.text.block import Block, Line
from gcodejerk.reasons import Reason

_FRAME_CHANGES: frozenset[Effect] = frozenset(
    {
        *(
            "return",
            "store",
            "machine",
            "system",
            "numbered system",
            "length",
            "set",
            "clear",
            "restore",
            "local",
        ),
        *("table", "frames", "home", "measure", "shift", "further shift", "turned frame"),
        "further turn",
    }
)
"""Effects that, in the block of a rapid, move the origin that its numbers refer to."""


_SELECTIONS: frozenset[Effect] = frozenset({"system", "numbered system"})

BARS = {
    "offsets written": Reason.SYSTEM_WRITTEN,  # until a work system is selected
    "tool data written": Reason.SYSTEM_WRITTEN,  # until a tool length is
    "parameters written": Reason.SYSTEM_WRITTEN,  # for good
    LEFT_OVER: Reason.CUTTER_COMPENSATION,  # until a move in its plane
    "look-ahead": Reason.LOOK_AHEAD,
    "compressor": Reason.COMPRESSED,
    "feed group": Reason.FEED_GROUP,
    "feed override": Reason.FEED_SCALED,
    OVERRIDES: Reason.OVERRIDES_OFF,
    OVERRIDES_SET: Reason.OVERRIDES_OFF,
    "another language": Reason.NOT_UNDERSTOOD,
    "mirror by M code": Reason.ROTATION,  # for good
    "rounded corner": Reason.START_UNKNOWN,  # until a move in its plane
    "rounded corners": Reason.START_UNKNOWN,  # until RNDM=0
    "exact path": Reason.PATH_UNKNOWN,
    "synchronized action": Reason.NOT_FOLLOWED,  # for good
    "unknown code": Reason.NOT_UNDERSTOOD,  # for good
}
"""What makes rapids unfit while it is, or may be, in force (`State.bars`), and the reason."""


def barred(state: State) -> Reason | None:
    """Say why rapids are unfit, if anything of that kind is, or may be, in force."""
    for name, on in state.bars.items():
        if on is not False:
            return BARS.get(name, Reason.LIMIT_SET)  # all that have no name of their own are limits
    # One of the path depends on the move, where its number is known.
    return Reason.LIMIT_SET if any(map(math.isnan, state.path_limits.values())) else None


@dataclass(frozen=True, slots=True)
class Call:
    """``M98 P1000 L3``."""

    m: int
    number: int
    """What P says."""
    repeats: int | None
    """What L says; None without it."""


@dataclass(slots=True)
class Step:
    """What a block did."""

    rapid: bool = False
    reason: Reason | None = None
    start: list[float] = field(default_factory=list)
    end: list[float] = field(default_factory=list)
    """Where the block's own motion ends, whatever a stop behind it leaves."""
    words: int = 0
    """Bit k set: a word for AXES[k]."""
    cycle: bool = False
    """The rapid is one of a canned cycle."""
    fed: bool = False
    """The rapid is a G1 that the user has said to be one."""
    feed_event: int = NO_FEED
    fault: bool = False
    unknown: str = ""
    """A code that the dialect does not know, as written."""
    refused: str = ""
    """A code that some of the dialect's controls refuse."""
    limits: bool = False
    """It sets a limit below what the machine file states, or may."""
    system_certain: bool = False
    """The work system that the block selects is in force already, or the machine file has it."""
    turned: int = 0
    """Bit k set: AXES[k] turns, and its word alone does not say which way."""
    way_unknown: bool = False
    """Nor does the machine file."""
    habit: bool = False
    outputs: bool = False
    """See `beams`."""
    beam: bool = False
    """What M3 turns on is, or may be, on in front of the block or behind it."""
    ends: bool = False
    """The program ends behind the block's motion."""
    call: Call | None = None
    """A subprogram of the file that runs behind the block."""
    since: Line | None = None
    """The line behind which nobody knows what is in force, where the rapid is left alone for it."""
    leaves: bool = False
    """Programs run that are not followed."""


def looks_rapid(
    block: Block, codes: Codes, step: Step, motion_before: int | None, dialect: Dialect
) -> bool:
    """Whether a block that is not understood was probably meant as a rapid."""
    stated = [word.value for word in block.words if word.letter == "G"]
    implied = "motion" not in codes.g and motion_before == dialect.rapid
    rest = block.rest.decode("latin-1").upper()
    axes = step.words or any(axis in rest for axis in AXES)
    return bool((dialect.rapid in stated or implied) and axes)


# Complex: one reason behind another, in the order in which they are told.
def why_left_alone(
    block: Block,
    codes: Codes,
    step: Step,
    state: State,
    dialect: Dialect,
    ended: bool,
    contour: bool,
) -> Reason | None:
    """Say why a rapid has to be left alone.

    Parameters
    ----------
    block, codes, step
        The block, its words, and what it did.
    state : State
        In force behind it.
    dialect : Dialect
        Of the program.
    ended : bool
        The program ended before it.
    contour : bool
        The block is part of a contour that a cycle runs by itself.

    Returns
    -------
    Reason or None
        None where it can be rewritten.
    """
    g = codes.g
    effects = {dialect.effect(code) for code in g.values()}
    effects |= {dialect.names.get(name.name, "none") for name in codes.names}
    if any(dialect.m_groups.get(m) == MACHINE_WORDS for m in codes.m):
        effects.add("machine")
    if ended:
        return Reason.AFTER_END
    if block.block_delete:
        return Reason.BLOCK_DELETE
    if step.fault or (codes.unknown and not codes.expression):
        return Reason.NOT_UNDERSTOOD
    if codes.expression:
        return Reason.EXPRESSION
    if codes.decimal:
        return Reason.DECIMAL_POINT
    if "return" in effects:
        return Reason.FRAME_CHANGE
    if step.cycle or contour or state.transforms.get("modal macro", False) is not False:
        return Reason.CANNED_CYCLE
    if step.system_certain:
        effects -= _SELECTIONS  # acts in front of the motion, and may stand in a block of its own
    if effects & _FRAME_CHANGES or not dialect.tool_frame.isdisjoint(codes.values):
        return Reason.FRAME_CHANGE
    if state.compensation != G40:
        step.since = unknown_since(state)
        return why_compensated(state)
    if state.transforms.get(COMPENSATION, False) is not False:
        return Reason.CUTTER_COMPENSATION
    if state.transformed:
        return Reason.ROTATION
    return barred(state) or _check_move(codes, step, state, dialect)


def why_compensated(state: State) -> Reason:
    """Say why cutter compensation is, or may be, in force."""
    loss = state.lost.get("compensation") if state.compensation is None else None
    return Reason.CUTTER_COMPENSATION if loss is None else loss.reason


def _check_move(codes: Codes, step: Step, state: State, dialect: Dialect) -> Reason | None:
    """Find the reasons that lie in the move itself."""
    named = [k for k in range(len(AXES)) if step.words >> k & 1]
    ends = [(step.start[k], step.end[k]) for k in named]
    unknown = any(math.isnan(a) or math.isnan(b) for a, b in ends)
    if not unknown and all(a == b for a, b in ends):
        return Reason.NO_MOTION
    if _beyond_path(step, state, named):
        return Reason.LIMIT_SET
    step.since = unknown_since(state)
    if state.distance is None:
        return Reason.DISTANCE_MODE_UNKNOWN
    if state.unit is None:
        return Reason.UNITS_UNKNOWN
    if unknown:
        return Reason.START_UNKNOWN
    mixed = len({AXES[k] in LINEAR for k in named if step.start[k] != step.end[k]}) > 1
    return _check_known_move(codes, step, state, dialect, mixed=mixed)


def unknown_since(state: State) -> Line | None:
    """The line that has made unknown what a move is left alone for.

    That is the compensation, or where none is in force the distance mode, or the unit.
    """
    modes = ("distance", "unit") if state.compensation == G40 else ("compensation",)
    losses = (state.lost.get(mode) for mode in modes if state.unknown(mode))
    return next((loss.line for loss in losses if loss is not None and loss.line is not None), None)


def _beyond_path(step: Step, state: State, named: list[int]) -> bool:
    """Whether a limit of the path that the program has set is in the way of a known move."""
    if not state.path_limits or any(math.isnan(step.end[k] - step.start[k]) for k in named):
        return False
    moved = np.zeros((1, len(AXES)))
    moved[0, named] = [step.end[k] - step.start[k] for k in named]
    return bool(beyond_path(state, moved)[0])


def _check_known_move(
    codes: Codes, step: Step, state: State, dialect: Dialect, *, mixed: bool
) -> Reason | None:
    """Find what forbids to replace a move of which both ends are known."""
    if dialect.lengths_only and state.feed_unit != state.unit:
        return Reason.FEED_UNIT
    if dialect.path_has_to_be_stated and not state.path:
        return Reason.PATH_UNKNOWN
    if step.way_unknown:
        return Reason.ROTARY_WAY
    if _other_words(codes, dialect, step):
        return Reason.OTHER_WORDS
    if mixed and not dialect.feed_of_mixed:
        return Reason.MIXED_AXES
    moved = {AXES[k] for k in range(len(AXES)) if step.words >> k & 1}
    moved = {axis for axis in moved if step.start[AXES.index(axis)] != step.end[AXES.index(axis)]}
    return Reason.APART if dialect.apart & moved and len(moved) > 1 else None


def _other_words(codes: Codes, dialect: Dialect, step: Step) -> bool:
    """Whether words stand in the block that act neither before nor after its motion for certain."""
    # Where the table does not say what a letter is for, nobody knows what it does to a rapid.
    others = set() if dialect.uses else set(codes.values) - set(AXES) - set("FST")
    others |= {"$"} & set(codes.values)  # which of the words it belongs to, no line says
    return (
        any(not _keeps_its_place(code, dialect, step) for code in codes.g.values())
        or not dialect.before_m | dialect.after_m >= set(codes.m)
        or bool(others or codes.names)
        or any(
            how not in ("IC", "AC") or axis not in LINEAR for axis, how in codes.functions.items()
        )
    )


def _keeps_its_place(code: int, dialect: Dialect, step: Step) -> bool:
    """Whether a G code does the same in front of the motion, or is that motion."""
    if code in dialect.harmless or (step.fed and code == G1):
        return True
    return step.system_certain and dialect.effect(code) in _SELECTIONS
