"""What can be set in a control: its numbers, what each means for the law by which it moves.

This module owns a control's settings as numbers: their units, steps and ranges, how a written
number becomes a quantity of a family and back. It knows no control; each control's own table stands
with its emitter.

Rule: a number is stated as the control takes it. What comes back of the rounding to its step is
what is judged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.motion.families import Family
from gcodejerk.motion.profiles.profile import Array

PATH, ALL = "path", "all"
"""In place of an axis: what the control keeps along the path, whatever axes move; what holds for
each axis alike."""
MARKS = {
    "M": "the maker's manual",
    "S": "the source of the control's software",
    "E": "measured",
    "R": "a third party's page",
    "D": "derived",
    "U": "unverified",
}
"""How sure a fact is."""
LIVE = frozenset("MSE")
"""What may be written without the user's word for it."""
Quantities = dict[str, Array]
"""Name of a quantity -> its value on one axis in k settings, shape (k,)."""


@dataclass(frozen=True, slots=True)
class Relation:
    """How a written number and a quantity belong together.

    Attributes
    ----------
    quantity : str
        Of the family, or of the filter behind it.
    value : callable
        Written numbers (k,) and the quantities so far -> the quantity, (k,). [mm, s]
    written : callable
        Quantities -> the number, not rounded; NaN where the quantity has none (no jerk limit).
    """

    quantity: str
    value: Callable[[Array, Quantities], Array]
    written: Callable[[Quantities], Array]


def proportional(quantity: str, per_unit: float) -> Relation:
    """The number is the quantity, in another unit: `per_unit` of ours each."""
    return Relation(
        quantity,
        lambda x, q: x * per_unit,
        lambda q: np.where(np.isfinite(q[quantity]), q[quantity] / per_unit, np.nan),
    )


def ramp_time(quantity: str, of: str, seconds: float) -> Relation:
    """The number is the time in which `of` is reached: quantity = `of` / time."""
    return Relation(
        quantity,
        lambda x, q: q[of] / np.maximum(x * seconds, 1e-9),
        lambda q: q[of] / (q[quantity] * seconds),
    )


TODAY = "today_"
"""In front of a quantity's name: what it is today, for settings that are a share of it."""


def share_of_today(quantity: str, per_unit: float) -> Relation:
    """The number is a share of today's quantity: `per_unit` 0.01 for percent."""
    today = TODAY + quantity
    return Relation(
        quantity,
        lambda x, q: q[today] * x * per_unit,
        lambda q: q[quantity] / (q[today] * per_unit),
    )


def share_of_ramp(per_unit: float) -> Relation:
    """The number is a share of today's time in which the acceleration builds up."""

    def ramp(q: Quantities) -> Array:
        with np.errstate(invalid="ignore"):  # axes that the machine does not have
            return np.asarray(q[TODAY + "acceleration"] / q[TODAY + "jerk"])

    return Relation(
        "jerk",
        lambda x, q: q["acceleration"] / (ramp(q) * np.maximum(x, 1e-9) * per_unit),
        lambda q: q["acceleration"] / (q["jerk"] * ramp(q) * per_unit),
    )


@dataclass(frozen=True, slots=True)
class Setting:
    """One number that can be set.

    Attributes
    ----------
    number : str
        What the control calls it: `1620`, `$120`, `MD32431`.
    axis : str
        The axis that it belongs to, or `PATH`, or `ALL`.
    unit, meaning : str
        As the control has them.
    relation : Relation
        What it sets.
    step, lowest, highest : float
        Of the written number.
    mark, source : str
        How sure the facts are (`MARKS`), and where they stand.
    where : str
        How it is set: a page of parameters, a line of a program.
    restart : str
        Whether the control has to be started anew: yes, no, or what is known.
    names : tuple of str
        For a setting that is one of several words: they are counted from 0.
    """

    number: str
    axis: str
    unit: str
    meaning: str
    relation: Relation
    step: float
    lowest: float
    highest: float
    mark: str
    source: str
    where: str
    restart: str
    names: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Number and axis: what tells it from all others of the control."""
        return self.number if self.axis in (PATH, ALL) else f"{self.number} {self.axis}"

    def rounded(self, written: Array) -> Array:
        """The nearest numbers that can be written."""
        steps = np.round((np.asarray(written, dtype=np.float64) - self._origin) / self.step)
        numbers: Array = np.clip(self._origin + steps * self.step, self.lowest, self._last)
        return numbers

    @property
    def _origin(self) -> float:
        """Where the steps are counted from: 0 but where the range does not begin on a step."""
        return (
            0.0 if math.isclose(self.lowest / self.step % 1.0, 0.0, abs_tol=1e-9) else self.lowest
        )

    @property
    def _last(self) -> float:
        steps = math.floor((self.highest - self._origin) / self.step + 1e-9)
        return self._origin + steps * self.step

    def choices(self, low: float, high: float, most: int) -> Array:
        """Numbers between two, `most` of them at most.

        Where the steps are more than that, they are thinned: evenly in the logarithm.
        """
        low, high = (float(self.rounded(np.array(x))) for x in (low, high))
        count = round((high - low) / self.step) + 1
        if count <= most:
            return low + self.step * np.arange(count, dtype=np.float64)
        first = low if low > 0.0 else self.step
        numbers = self.rounded(np.geomspace(first, high, most - (low <= 0.0)))
        return np.unique(np.append(numbers, low))

    def text(self, written: float) -> str:
        """The number as the control reads it."""
        if self.names:
            return self.names[round(written)]
        decimals = max(0, math.ceil(-math.log10(self.step) - 1e-9))
        return f"{written:.{decimals}f}"


@dataclass(frozen=True, slots=True)
class Scheme:
    """All that can be set in a control against vibration of rapids, on one machine.

    Attributes
    ----------
    controller : str
        Its name.
    title : str
        What is set, in a few words.
    family : Family
        The law by which it moves.
    fixed : dict of str to ndarray, shape (9,)
        Quantities of each axis that stay, and those of today for the settings.
    path : dict of str to float
        Limits along the path, of today; none: infinite.
    settings : tuple of Setting
        What is chosen; a setting may use the quantities of those before it.
    groups : tuple of tuple of int
        Settings that are chosen together, by their positions.
    shaped : tuple of str
        Kinds of filters of the axes (`motion.families.filters`): the quantity `filter` of an axis
        counts through them from 1; 0 is none.
    notes : tuple of str
        What a user has to know.
    cannot : tuple of str
        What this control cannot express.
    """

    controller: str
    title: str
    family: Family
    fixed: Mapping[str, Array]
    settings: tuple[Setting, ...]
    groups: tuple[tuple[int, ...], ...]
    path: Mapping[str, float] = field(default_factory=dict)
    shaped: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    cannot: tuple[str, ...] = ()

    def values(self, written: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """Quantities that settings make.

        Parameters
        ----------
        written : ndarray, shape (k, s)
            k times all s numbers; NaN: as today.

        Returns
        -------
        axes : dict of str to ndarray, shape (k, 9)
        path : dict of str to ndarray, shape (k,)
        """
        k = len(written)
        axes = {name: np.tile(value, (k, 1)) for name, value in self.fixed.items()}
        path = {name: np.full(k, value) for name, value in self.path.items()}
        for column, setting in enumerate(self.settings):
            x = written[:, column]
            name = setting.relation.quantity
            if setting.axis == PATH:
                own = setting.relation.value(x, path)
                path[name] = np.where(np.isnan(x), path[name], own)
            else:
                columns = range(len(AXES)) if setting.axis == ALL else [AXES.index(setting.axis)]
                for at in columns:
                    quantities = {q: value[:, at] for q, value in axes.items()}
                    own = setting.relation.value(x, quantities)
                    axes[name][:, at] = np.where(np.isnan(x), axes[name][:, at], own)
        return axes, path

    def column(self, setting: Setting) -> int:
        """The axis that a setting's today is taken from: its own, or the first that moves."""
        if setting.axis != ALL:
            return AXES.index(setting.axis)
        return int(np.isfinite(self.fixed["velocity"]).argmax())

    def today(self) -> Array:
        """The numbers that make today's quantities, as they can be written, shape (s,)."""
        axes, path = self.values(np.full((1, len(self.settings)), np.nan))
        out = []
        for setting in self.settings:
            if setting.axis == PATH:
                quantities = path
            else:
                at = self.column(setting)
                quantities = {q: value[:, at] for q, value in axes.items()}
            wanted = setting.relation.written(quantities)
            out.append(float(setting.rounded(wanted)[0]) if np.isfinite(wanted[0]) else np.nan)
        return np.array(out)

    def checked(self, numbers: Mapping[str, float]) -> Array:
        """Numbers by their keys as a row; refuses those that the control does not take.

        Raises
        ------
        PlanError
            A setting is unknown, or its number outside the range or between two steps.
        """
        row = self.today()
        keys = [s.key for s in self.settings]
        for key, number in numbers.items():
            if key not in keys:
                raise PlanError(
                    f"{self.controller} has no setting {key!r}", f"it has: {', '.join(keys)}"
                )
            setting = self.settings[keys.index(key)]
            near = float(setting.rounded(np.array(number)))
            if abs(near - number) > 1e-9 * max(1.0, abs(near)):
                raise PlanError(
                    f"{key} = {number:g} cannot be set: {setting.lowest:g} to "
                    f"{setting.highest:g} {setting.unit} in steps of {setting.step:g}",
                    f"the nearest is {setting.text(near)}",
                )
            row[keys.index(key)] = near
        return row
