"""The modal state that a program starts in.

Rule: without a word from the user only the dialect's documented modes are assumed, and no position.
The unit is no such mode: whether 1 is a millimetre or an inch, the program says, or the user.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.dialects.at_start import codes_at_start, dialect_at_start
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.execute import Executor
from gcodejerk.nc.interpreter.frames import system_key
from gcodejerk.nc.interpreter.modal import GROUP_FIELDS, NAN, UNSTATED, State
from gcodejerk.nc.text.block import Block
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.start import Start
from gcodejerk.units import MM_PER_INCH


def initial_state(dialect: Dialect, start: Start) -> State:
    """Make the state in which a program starts."""
    state = State()
    _set_defaults(state, dialect)
    _set_frames(state, dialect, start)
    if start.startup and not dialect.text.klartext:  # which has no codes, and says its modes
        _run_startup(state, dialect, start)
    for axis, letter in enumerate(AXES):
        state.position[axis] = start.positions.get(letter, NAN)
    return state


def _set_defaults(state: State, dialect: Dialect) -> None:
    """Put the dialect's documented modes in force."""
    for group, code in dialect.defaults.items():
        if (name := GROUP_FIELDS.get(group)) is not None:
            setattr(state, name, code)
    state.system = dialect.defaults.get("system")
    mode = dialect.defaults.get("feed mode")
    state.feed_mode = None if mode is None else dialect.feed_modes.get(mode, mode // 10)
    path = dialect.defaults.get("path")
    state.path = UNSTATED if path is None else dialect.paths[path]
    state.fixed = _fixed(dialect)
    units = dialect.defaults.get("units")
    state.unit = None if units is None else MM_PER_INCH if dialect.units[units] else 1.0


def _fixed(dialect: Dialect) -> frozenset[str]:
    """List the fields that no code of the dialect changes: its one code is in force already."""
    changed = {
        group for code, group in dialect.groups.items() if dialect.defaults.get(group) != code
    }
    fixed = {group for group in dialect.defaults if group not in changed}
    fields = {GROUP_FIELDS.get(group, group.replace(" ", "_")) for group in fixed}
    if "units" in fixed:
        fields |= {"unit", "feed_unit"}
    if dialect.diameter_fixed:
        fields.add("diameter")
    return frozenset(fields)


def _set_frames(state: State, dialect: Dialect, start: Start) -> None:
    """Take what the machine file says of axes and work systems."""
    state.wraps = tuple(start.wraps.get(axis) for axis in AXES)
    # Degrees that may be converted are known where those of a slide are.
    turning = True if dialect.inches_turn else None
    state.slides = tuple(start.linear.get(axis, turning) for axis in AXES)
    state.limits, state.along, state.straight = start.limits, start.along, start.straight
    state.diameter = state.turns = start.diameter
    for system, offsets in start.offsets.items():
        state.offsets[system_key(system)] = [offsets.get(axis, NAN) for axis in AXES]
    state.home = [start.home.get(axis, NAN) for axis in AXES]
    if start.positions or start.offsets:
        # Who states where the axes are, states it for the modes that the dialect starts in: no
        # tool length and no G92, which would otherwise outlive the program before this one.
        state.tool = [0.0] * len(AXES)
        state.g92 = [0.0] * len(AXES)
    if state.system is not None:
        state.g5x = list(state.offsets.get(state.system, state.g5x))


def check_start(dialect: str | Dialect, start: Start) -> None:
    """Look whether programs can start so.

    Parameters
    ----------
    dialect : str or Dialect
        How they are read.
    start : Start
        What the machine file says.

    Raises
    ------
    ProgramError
        The dialect refuses the codes in force, or there is no such dialect.
    """
    initial_state(find_dialect(dialect).set_up(start), start)


def _run_startup(state: State, dialect: Dialect, start: Start) -> None:
    """Execute the codes that the machine file says are in force when a program starts."""
    taken, _ = codes_at_start(start.startup, dialect)
    block = parse_line(taken.encode("latin-1", "replace"), dialect)
    if block.problem is not None:
        raise ProgramError(
            f"program.startup: {block.problem} in {taken!r}",
            "give G and M codes, for example G17 G21 G40 G49 G54 G64 P0.01 G90",
            start.startup_at,
        )
    executor = Executor(dialect_at_start(dialect), state, start)
    each = [Block(words=(word,)) for word in block.words]
    steps = [executor.run(line) for line in (each if dialect.one_command else [block])]
    if any(step.fault or step.unknown for step in steps):
        unknown = _unknown_codes(block, dialect, start)
        which = f"{', '.join(unknown)} of {taken!r}" if unknown else repr(taken)
        raise ProgramError(
            f"program.startup: the dialect {dialect.name} refuses {which}",
            "give codes that it has, and that may stand together; or state the dialect of the "
            "control that starts so (--dialect, or dialect in the machine file)",
            start.startup_at,
        )
    state.feed_unit = state.unit  # what holds at the start is the control's own unit
    if "tool length" in _groups_of(block, dialect):
        state.tool = [0.0] * len(AXES)


def _unknown_codes(block: Block, dialect: Dialect, start: Start) -> list[str]:
    """List the codes of a block that the dialect does not have, each by itself, as written."""
    each = [Block(words=(word,)) for word in block.words if word.letter in "GM"]
    steps = [Executor(dialect_at_start(dialect), State(), start).run(one) for one in each]
    return [step.unknown for step in steps if step.unknown]


def _groups_of(block: Block, dialect: Dialect) -> set[str]:
    """List the modal groups whose codes stand in a block."""
    codes = [round(w.value * 10) for w in block.words if w.letter == "G" and w.value is not None]
    return {dialect.groups[code] for code in codes if code in dialect.groups}
