"""Who is shown how in the picture of a comparison, and what of the move a part of it needs.

Rule: who is shown in colour has the same colour in all parts, in every picture; everyone else is
thin and grey, in the parts over the frequency alone, and the legend names them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.shapers import SHAPERS
from gcodejerk.studies.comparison import Candidate, Comparison

MS, UM = 1e3, 1e3
UNIT = "µm"
"""Unit of what is left of vibration: at the tool, whatever moves."""
TEXT = 8.0
STYLES: dict[str, tuple[str, Any, float]] = {
    "conventional": ("#000000", "-", 1.2),
    "condition3": ("#0072b2", "-", 1.2),
    "cascade": ("#009e73", (0, (4, 2)), 1.3),
    "optimal": ("#d55e00", (0, (9, 1.5)), 1.4),
    "shortest": ("#b3558f", (0, (4, 1, 1, 1)), 1.4),
}
"""Colour (after Okabe and Ito, Color Universal Design, 2008), line and width of the designs."""
SHAPER_STYLES: tuple[tuple[str, Any, float], ...] = (
    ("#c98500", (0, (1, 1)), 1.4),
    ("#3d9bd1", (0, (3, 1.2)), 1.2),
)
"""Of the two shapers that are shown: the fastest and the most robust."""
OTHERS: dict[str, Any] = {"color": "0.75", "linewidth": 0.6, "zorder": 1}


class Shown:
    """Those who are shown, and the others.

    Attributes
    ----------
    comparison : Comparison
        All of them.
    shown, others : list of Candidate
        In colour, and in grey.
    axes : list of str
        The moving axes, in the order of `AXES`.
    longest : str
        That which moves farthest.
    """

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self._styles = dict(STYLES)
        for name, style in zip(_best_shapers(comparison), SHAPER_STYLES, strict=False):
            self._styles[name] = style
        there = {c.name: c for c in comparison.candidates}
        self.shown = [there[name] for name in self._styles if name in there]
        self.others = [c for c in comparison.candidates if c.name not in self._styles]
        moving = (comparison.share != 0.0).any(axis=0)
        self.axes = [axis for axis, moves in zip(AXES, moving, strict=True) if moves]
        self.longest = comparison.longest

    def colour(self, candidate: Candidate) -> str:
        """Of one who is shown."""
        return self._styles[candidate.name][0]

    def style(self, candidate: Candidate) -> dict[str, Any]:
        """Of anyone's line over the frequency."""
        if candidate.name not in self._styles:
            return OTHERS
        colour, line, width = self._styles[candidate.name]
        return {"color": colour, "linestyle": line, "linewidth": width}

    def row(self, axis: str) -> int:
        """The profile that an axis makes."""
        return int(np.argmax(np.abs(self.comparison.share[:, AXES.index(axis)])))

    def profile(self, candidate: Candidate, axis: str) -> Profiles:
        """The unit profile that an axis makes."""
        row = self.row(axis)
        return candidate.profiles.take(slice(row, row + 1))

    def length(self, axis: str) -> float:
        """What an axis moves, with its sign; [mm] or [deg]."""
        return float(self.comparison.share[self.row(axis), AXES.index(axis)])

    def unit(self, axis: str) -> str:
        """Unit of lengths of an axis."""
        return "deg" if self.comparison.machine.axis(axis).rotary else "mm"

    @property
    def weights(self) -> Array:
        """Participation times displacement of each profile and oscillator, shape (l, m)."""
        weights: Array = self.comparison.share @ self.comparison.modes.participation.T
        return weights

    @property
    def moved(self) -> str:
        """Every axis, and how far."""
        return ", ".join(
            f"{axis} {length:g} {self.unit(axis)}"
            for axis, length in self.comparison.displacement.items()
        )


def round_below(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * 1.001))


def _best_shapers(comparison: Comparison) -> list[str]:
    """The shaper that lets the machine settle first, and the one that bears most error."""
    shapers = [c for c in comparison.candidates if c.name in SHAPERS]
    settled = min(shapers, key=lambda c: (c.settling is None, c.settling or 0.0, c.time))
    robust = min(shapers, key=lambda c: c.worst_band[-1])
    if robust is settled:
        robust = min((c for c in shapers if c is not settled), key=lambda c: c.worst_band[-1])
    return [settled.name, robust.name]
