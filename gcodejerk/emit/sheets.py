"""Setup sheets: a control's settings as text that a machinist reads, sets, and can take back.

This module owns what all sheets have in common: the header, the table of old and new numbers with
how sure each fact is, the lines in the control's own syntax, and the way back. Each control's own
settings and syntax stand in its file in `emit.controls`.

Rule: what is not sure (`settings.LIVE`) and not confirmed by the machine file
(`controller_parameters`) is never a live line: it is written as a comment that asks.
"""

from __future__ import annotations

import math
import textwrap
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gcodejerk._version import __version__
from gcodejerk.axes import AXES
from gcodejerk.emit.base import CONFIRM
from gcodejerk.errors import EmitError
from gcodejerk.machine import ControllerParameter, Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.parameters import LIVE, MARKS, Scheme, Setting, Tuning

WIDTH = 69
"""Characters of a line at most."""
UNITS = {
    **{"s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6)},
    **{"mm/s^2": ("mm/s^2", 1.0), "m/s^2": ("mm/s^2", 1e3), "mm/min^2": ("mm/s^2", 1 / 3600.0)},
    **{"mm/s^3": ("mm/s^3", 1.0), "m/s^3": ("mm/s^3", 1e3), "mm/min^3": ("mm/s^3", 1 / 216e3)},
}
"""Units that the user may state for a number in place of ours: of what, and how much of it."""


@dataclass(frozen=True, slots=True)
class Change:
    """One setting as it is and as it is to be.

    Attributes
    ----------
    setting : Setting
        What is set.
    old, new : str
        Numbers as the control reads them; old empty where it is not known.
    number : float
        The new one, in the unit of the setting.
    unit : str
        In which both are written.
    live : bool
        It may be written as a line that does something.
    stated : bool
        The old number is the user's word, not what today's rapids come from.
    """

    setting: Setting
    old: str
    new: str
    number: float
    unit: str
    live: bool
    stated: bool


class Sheets:
    """What a controller has that can be tuned. A controller class derives from it, too."""

    sheet_suffix: str = ".setup.txt"
    """Of the sheet's name."""
    remark: tuple[str, str] = ("; ", "")
    """What stands in front of a comment in the control's language, and behind it."""
    upper: bool = False
    """Comments are upper case letters."""
    program_way: str = ""
    """The one of its ways that lines of a program can set (`--as parameters`); empty: none."""
    program_damping: str = ""
    """What it calls the damping of a shaper, which its lines set with the frequency."""
    program_sets: str = ""
    """Regular expression of what in a program sets the same, or keeps what is set for good."""
    program_inches: bool = False
    """Its numbers may be inches where a program counts in inches."""
    program_commands: bool = False
    """It runs all commands of a line, one behind the other, where its kin take the first."""
    acts_on: str = ""
    """Which moves of a program the settings change."""
    name: str

    @abstractmethod
    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """What can be set, by the name of each way; the first is the usual one."""

    @abstractmethod
    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Lines that set numbers, in the control's syntax."""

    def scheme(self, machine: Machine, way: str | None = None) -> Scheme:
        """One way of setting it.

        Raises
        ------
        EmitError
            There is none of that name.
        """
        known = self.schemes(machine)
        way = next(iter(known)) if way is None else way
        if way not in known:
            raise EmitError(
                f"controller {self.name} has no settings {way!r}",
                f"it has: {', '.join(known)}",
            )
        return _on_path(known[way], machine)

    def frame(self, lines: list[str]) -> list[str]:
        """Live lines with what has to stand around them."""
        return lines

    def sheet(self, tuning: Tuning, of: str) -> bytes:
        """The whole sheet; `of` says of what rapids."""
        changed = changes(tuning)
        out = [*self._comment(sheet_header(tuning, of))]
        out += ["", *self._comment(setting_table(changed)), ""]
        out += self._block(tuning.machine, changed, [c.new for c in changed])
        out += ["", *self._comment(["to go back:"])]
        out += self._block(tuning.machine, changed, [c.old for c in changed])
        return ("\n".join(out) + "\n").encode()

    def _block(
        self, machine: Machine, changed: Sequence[Change], numbers: Sequence[str]
    ) -> list[str]:
        """Live lines, and those that only ask; numbers that are not known are left to the user."""
        known = [(c, n) for c, n in zip(changed, numbers, strict=True) if n]
        missing = [c for c, n in zip(changed, numbers, strict=True) if not n]
        sure, unsure = (
            [(c.setting, n) for c, n in known if c.live is wanted] for wanted in (True, False)
        )
        live = self.lines(machine, sure) if sure else []
        asked = self.lines(machine, unsure) if unsure else []
        out = self.frame(live) if live else []
        if asked:
            out += self._comment([f"not verified, {CONFIRM}:"])
            out += self._comment(self.frame(asked), wrap=False)
        if missing:
            keys = ", ".join(c.setting.key for c in missing)
            out += self._comment([f"{keys}: note what it is before you change it"])
        return out

    def _comment(self, lines: Iterable[str], wrap: bool = True) -> list[str]:
        """Lines as comments of the control's language."""
        before, behind = self.remark
        room = WIDTH - len(before) - len(behind)
        out = []
        for line in lines:
            text = line.upper() if self.upper else line
            if behind:  # no parentheses within parentheses
                text = text.replace("(", "[").replace(")", "]")
            parts = textwrap.wrap(
                text, room, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False
            )
            for part in (parts or [""]) if wrap else [text]:
                out.append(
                    f"{before}{part}{behind}".rstrip() if not behind else before + part + behind
                )
        return out


def changes(tuning: Tuning) -> list[Change]:
    """Old and new numbers of every setting."""
    out = []
    for k, setting in enumerate(tuning.scheme.settings):
        said = confirmation(tuning.machine, setting)
        unit, scale = setting.unit, 1.0
        if said is not None and said.unit is not None and said.unit != setting.unit:
            unit, scale = said.unit, _ratio(setting, said, tuning.machine)
        new = float(tuning.written[k])
        old = float(tuning.before[k])
        stated = said is not None and said.old is not None
        if stated and said is not None and said.old is not None:
            old_text = said.old
        else:
            old_text = "" if math.isnan(old) else _text(setting, old, scale)
        out.append(
            Change(
                setting, old_text, _text(setting, new, scale), new, unit,
                said is not None or setting.mark in LIVE, stated,
            )
        )  # fmt: skip
    return out


def _text(setting: Setting, number: float, scale: float) -> str:
    """A number as it is written, in the user's unit where that differs."""
    return setting.text(number) if scale == 1.0 else f"{number * scale:.6g}"


def confirmation(machine: Machine, setting: Setting) -> ControllerParameter | None:
    """What the machine file says of a setting."""
    for one in machine.controller_parameters:
        if one.number == setting.number and one.axis in (None, setting.axis):
            return one
    return None


def _ratio(setting: Setting, said: ControllerParameter, machine: Machine) -> float:
    """How many of the user's units one of ours is."""
    ours, theirs = UNITS.get(setting.unit), UNITS.get(said.unit or "")
    if ours is None or theirs is None or ours[0] != theirs[0]:
        raise EmitError(
            f"{machine.source} states {said.number} in {said.unit}, which is no unit of "
            f"{setting.meaning} ({setting.unit})",
            "state the unit as the control has it, or leave it out",
        )
    return ours[1] / theirs[1]


def sheet_header(tuning: Tuning, of: str) -> list[str]:
    """First lines of a sheet: what it is for, before and after."""
    machine, scheme = tuning.machine, tuning.scheme
    band = 100.0 * machine.design.band
    marks = sorted({s.mark for s in scheme.settings}, key=list(MARKS).index)
    out = [
        f"gcodejerk {__version__}  {scheme.title}",
        f"machine: {machine.name}",
        f"controller: {scheme.controller}",
        f"law: {scheme.family.title}",
        f"for {len(tuning.moves)} distinct rapids of {of}",
        f"judged: {GOAL_TEXT[tuning.goal]}, frequencies within {band:g} %",
        f"today:  {tuning.today.total:.3f} s, {_um(tuning.today.value)} um",
        f"as set: {tuning.chosen.total:.3f} s, {_um(tuning.chosen.value)} um",
        *(f"facts {mark}: {MARKS[mark]}" for mark in marks),
    ]
    if not tuning.gains:
        out.append("NO GAIN: this leaves no less than today; do not set it")
    out += list(scheme.notes)
    out += [f"not possible on this control: {text}" for text in scheme.cannot]
    if any(mark not in LIVE for mark in marks):
        out.append(CONFIRM)
    return out


GOAL_TEXT = {"worst": "worst rapid before a cut", "mean": "mean of the rapids before a cut"}


def setting_table(changed: Sequence[Change]) -> list[str]:
    """Old and new numbers, and for each kind of setting where it is set and how sure that is."""
    rows = [("setting", "unit", "today", "new", "facts")]
    rows += [
        (c.setting.key, c.unit, (c.old or "-") + ("*" if c.stated else ""), c.new, c.setting.mark)
        for c in changed
    ]
    widths = [max(len(row[k]) for row in rows) for k in range(5)]
    out = []
    for row in rows:
        cells = [row[0].ljust(widths[0]), row[1].ljust(widths[1])]
        cells += [row[k].rjust(widths[k]) for k in (2, 3)]
        out.append("  ".join([*cells, row[4]]).rstrip())
    if any(c.stated for c in changed):
        out.append("* as the machine file states it")
    said: dict[str, None] = {}
    for c in changed:
        s = c.setting
        said[f"{s.number}: {s.meaning}; {s.where}; restart: {s.restart}; {s.source}"] = None
    return [*out, *said]


def _um(value: float) -> str:
    """A residual with three digits [um]."""
    return f"{1e3 * value:.3g}"


def today_of(machine: Machine, *names: str) -> dict[str, Array]:
    """Quantities of each axis's rapids as a control is set today, shape (9,) each."""
    out = {}
    for name in names:
        row = np.full(len(AXES), np.inf)
        for axis in machine.axes:
            row[AXES.index(axis.name)] = getattr(axis.rapid, name)
        out[name] = row
    return out


def axis_settings(
    machine: Machine, make: Callable[[str], Sequence[Setting]]
) -> tuple[tuple[Setting, ...], tuple[tuple[int, ...], ...]]:
    """Settings of every axis, and those of one axis as a group; parameters as for a `Scheme`."""
    settings: list[Setting] = []
    groups = []
    for axis in machine.axis_names:
        own = make(axis)
        groups.append(tuple(range(len(settings), len(settings) + len(own))))
        settings += own
    return tuple(settings), tuple(groups)


def _on_path(scheme: Scheme, machine: Machine) -> Scheme:
    """A way of setting a control, within what it bounds along the path besides."""
    own = machine.path.rapid
    stated = {"velocity": own.velocity, "acceleration": own.acceleration}
    known = {q.name for q in scheme.family.quantities}
    more = {name: x for name, x in stated.items() if math.isfinite(x) and name in known}
    return replace(scheme, path={**more, **scheme.path}) if more else scheme
