"""A control's settings as lines of a program: those that set what was chosen, and the way back.

This module owns what has to be known before a program may carry settings: every fact sure or
confirmed, every old number known. A percentage of today's is 100 today; an acceleration is that of
the machine file's rapids; the kind, frequency and damping of an input shaper nobody knows but the
machine's owner, who states them (`controller_parameters`). A stated number always wins.

Rule: an old number is never guessed. What is missing is refused with the lines that state it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gcodejerk.emit.base import CONFIRM
from gcodejerk.emit.sheets import Change, Sheets, changes, confirmation
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.parameters import ALL, PATH, Setting, Tuning

KIND, FREQUENCY = "filter", "filter_for"
"""Quantities of the two settings that make a shaper."""
OFF = "off"
NONE = frozenset({OFF, "none", "0"})
"""What an owner may call a shaper that is off."""
_NUMBER = re.compile(r"[0-9]{1,9}(\.[0-9]{1,6})?")


@dataclass(frozen=True, slots=True)
class ProgramLines:
    """What a program gets.

    Attributes
    ----------
    prefix, restore : tuple of str
        Lines in the control's syntax, without line ends.
    changed : tuple of Change
        The settings behind them.
    """

    prefix: tuple[str, ...]
    restore: tuple[str, ...]
    changed: tuple[Change, ...]


def require_way(emitter: object, name: str) -> Sheets:
    """The controller as one that can be set from within a program; EmitError where it cannot."""
    if isinstance(emitter, Sheets) and emitter.program_way:
        return emitter
    raise EmitError(
        f"controller {name} cannot be set from within a program (--as parameters), or it is not "
        "known how",
        "`gcodejerk parameters FILE... --machine M -o SHEET` writes a setup sheet"
        if isinstance(emitter, Sheets)
        else "`gcodejerk controllers` shows which controls have settings",
    )


def program_lines(emitter: Sheets, tuning: Tuning) -> ProgramLines:
    """Lines for a tuning of the scheme `emitter.program_way`.

    Raises
    ------
    EmitError
        A fact is neither sure nor confirmed, or an old number is not known.
    """
    machine = tuning.machine
    changed = _with_known_units(changes(tuning))
    unsure = [c.setting.key for c in changed if not c.live]
    if unsure:
        raise EmitError(
            f"controller {emitter.name}: {', '.join(unsure)}: not verified, so not written into a "
            f"program ({CONFIRM})",
            "confirm them in the machine file (controller_parameters), or use the setup sheet of "
            "`gcodejerk parameters`",
        )
    kept = _that_change(changed)
    damping = _dampings(emitter, kept)
    _refuse_unknown([*kept, *damping], machine, emitter.program_damping)
    old: list[tuple[Setting, str]] = []
    for c in kept:
        old.append((c.setting, _old(c, machine)))
    old += [(setting, _stated(setting, machine) or "") for setting in damping]
    return ProgramLines(
        tuple(emitter.lines(machine, [(c.setting, c.new) for c in kept])),
        tuple(emitter.lines(machine, old)),
        tuple(_as_known(c) for c in kept),
    )


def _with_known_units(changed: Sequence[Change]) -> list[Change]:
    """The changes, refused where the machine file states another unit than that of the command."""
    for c in changed:
        if c.unit != c.setting.unit:
            raise EmitError(
                f"{c.setting.key} is stated in {c.unit}; the control's command takes "
                f"{c.setting.unit}",
                f"state it in {c.setting.unit}",
            )
    return list(changed)


def _that_change(changed: Sequence[Change]) -> list[Change]:
    """Without shapers that nothing is known of and that are not used: they stay as they are."""
    idle = {
        c.setting.axis
        for c in changed
        if c.setting.relation.quantity == KIND and c.new == OFF and _is_off(c)
    }
    return [
        c
        for c in changed
        if c.setting.axis not in idle or c.setting.relation.quantity not in (KIND, FREQUENCY)
    ]


def _is_off(change: Change) -> bool:
    return not change.stated or change.old.lower() in NONE


def _dampings(emitter: Sheets, kept: Sequence[Change]) -> list[Setting]:
    """The damping of each shaper that is on today: our lines change it with the frequency."""
    on = {c.setting.axis for c in kept if c.setting.relation.quantity == KIND and not _is_off(c)}
    return [
        replace(c.setting, number=emitter.program_damping, meaning="damping of the shaper",
                unit="-", lowest=0.0, highest=0.999)
        for c in kept
        if c.setting.relation.quantity == FREQUENCY and c.setting.axis in on
    ]  # fmt: skip


def _as_known(change: Change) -> Change:
    """Without an old frequency that nobody has stated, of a shaper that is off."""
    guessed = change.setting.relation.quantity == FREQUENCY and not change.stated
    return replace(change, old="") if guessed else change


def _stated(setting: Setting, machine: Machine) -> str | None:
    """The owner's word for an old number."""
    said = confirmation(machine, setting)
    return None if said is None else said.old


def _old(change: Change, machine: Machine) -> str:
    """The old number as it is written; that of a shaper which is off plays no part."""
    quantity = change.setting.relation.quantity
    if quantity == KIND:
        return OFF if change.old.lower() in NONE else change.old
    return change.old


def _refuse_unknown(wanted: Sequence[Change | Setting], machine: Machine, name: str) -> None:
    """Refuse old numbers that nobody has stated, or that are none."""
    missing: list[Setting] = []
    kinds = [c for c in wanted if isinstance(c, Change) and c.setting.relation.quantity == KIND]
    off = {c.setting.axis for c in kinds if c.stated and c.old.lower() in NONE}
    for one in wanted:
        setting = one.setting if isinstance(one, Change) else one
        quantity = setting.relation.quantity
        shaper = quantity in (KIND, FREQUENCY)
        if shaper and quantity == FREQUENCY and setting.axis in off:
            continue
        said = _stated(setting, machine)
        if said is None and (shaper or (isinstance(one, Change) and not one.old)):
            missing.append(setting)
        elif said is not None:
            _check_stated(setting, said)
    if missing:
        lines = ", ".join(_line_to_add(setting, name) for setting in missing)
        raise EmitError(
            f"{', '.join(s.key for s in missing)}: what the control is set to today is not known, "
            "so a program could not take its settings back",
            "state it in the machine file, as it is there (none for no shaper): "
            f"controller_parameters: [{lines}]",
        )


def _line_to_add(setting: Setting, damping: str) -> str:
    """An example of what the owner states; the damping with the frequency."""
    axis = "" if setting.axis in (ALL, PATH) else f", axis: {setting.axis}"
    quantity = setting.relation.quantity
    if quantity == KIND:
        return f"{{number: {setting.number}{axis}, old: {setting.names[1]}}}"
    if setting.number == damping:
        return f"{{number: {damping}{axis}, old: 0.1}}"
    more = f", {{number: {damping}{axis}, old: 0.1}}" if quantity == FREQUENCY and damping else ""
    return f"{{number: {setting.number}{axis}, old: 45}}{more}"


def _check_stated(setting: Setting, said: str) -> None:
    """Refuse an old value that the control would not take."""
    if setting.names:
        if said not in setting.names and said.lower() not in NONE:
            raise EmitError(
                f"{setting.key}: old is {said!r}, which is no kind of shaper that is known here",
                f"state one of: {', '.join(setting.names)}",
            )
    elif not _NUMBER.fullmatch(said) or not setting.lowest <= float(said) <= setting.highest:
        raise EmitError(
            f"{setting.key}: old is {said!r}, expected a number from {setting.lowest:g} to "
            f"{setting.highest:g} {setting.unit}",
            "state it as the control has it",
        )
