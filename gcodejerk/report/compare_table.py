"""A comparison for a terminal: one row for each candidate, and what has to be said about them.

Rule: the best of a column is bold among those that keep the limits; a figure that nobody could
have on this machine is no best.
"""

from __future__ import annotations

from collections.abc import Callable
from textwrap import wrap

from rich.text import Text

from gcodejerk.motion.shapers import SHAPERS
from gcodejerk.planning.arrival import BANDS
from gcodejerk.report.compare_record import axis_peaks
from gcodejerk.report.screen import ScreenTable
from gcodejerk.report.tables import MS_PER_S, UM_PER_MM
from gcodejerk.studies.comparison import DESIGNED, NEEDS_SOLVER, Candidate, Comparison

NEVER = "never"
UNKNOWN = "-"
SAME = 1.0 + 1e-6
"""Figures that differ by less are the same."""
WIDTH = 118
"""Of a terminal that a line of notes may fill."""


def compare_table(comparison: Comparison) -> ScreenTable:
    """Times, peaks and residuals, a row for each candidate.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_move`.

    Returns
    -------
    ScreenTable
    """
    axis = comparison.longest
    unit = "deg" if comparison.machine.axis(axis).rotary else "mm"
    table = ScreenTable(
        ("profile", "left"),
        ("time\n[ms]", "right"),
        ("settled\n[ms]", "right"),
        (f"{axis} velocity\n[{unit}/s]", "right"),
        (f"acceleration\n[{unit}/s^2]", "right"),
        (f"jerk\n[{unit}/s^3]", "right"),
        ("residual\n[um]", "right"),
        *((f"+-{100 * band:.0f} %\n[um]", "right") for band in BANDS),
        ("limit\n[um]", "right"),
        drop=(
            f"jerk\n[{unit}/s^3]",
            f"{axis} velocity\n[{unit}/s]",
            f"+-{100 * BANDS[0]:.0f} %\n[um]",
            f"acceleration\n[{unit}/s^2]",
            "limit\n[um]",
            f"+-{100 * BANDS[-1]:.0f} %\n[um]",
            "settled\n[ms]",
        ),
    )
    best = _Best(comparison)
    first_law = comparison.families[0] if comparison.families else None
    for candidate in (*comparison.candidates, *comparison.families):
        if candidate is first_law:
            for name in comparison.absent:
                table.add_row(f"{name} **", *[UNKNOWN] * (len(table.titles) - 1))
            table.add_row(*[""] * len(table.titles))
        peak = axis_peaks(comparison, candidate)[axis]
        table.add_row(
            candidate.name + ("" if candidate.within_limits else " *"),
            f"{candidate.time * MS_PER_S:.1f}",
            best.of(candidate, "settled", _settled(candidate)),
            f"{peak['velocity']:.2f}",
            f"{peak['acceleration']:.0f}",
            "step" if peak["jerk"] is None else f"{peak['jerk']:.3g}",
            best.of(candidate, "residual", _small(candidate.worst)),
            *(
                best.of(candidate, band, f"{worst * UM_PER_MM:.1f}")
                for band, worst in zip(BANDS, candidate.worst_band, strict=True)
            ),
            UNKNOWN if candidate.limit is None else _small(candidate.limit),
        )
    return table


def compare_notes(comparison: Comparison) -> list[str]:
    """What the table means, who is out of the ordinary, and what the user gains.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_move`.

    Returns
    -------
    list of str
        Lines; the last one or two say what is gained.
    """
    tolerance = comparison.machine.design.tolerance * UM_PER_MM
    lines = [
        f"residual: largest displacement of any mode; +-: at worst with every frequency off by "
        f"as much; settled: below {tolerance:g} um",
        "limit: the least that any profile of that time within the limits leaves; all of the "
        "profiles themselves, before sampling",
        _shapers(comparison),
        *_laws(comparison),
    ]
    if comparison.machine.positioning != "linear":
        lines.append("positioning: independent: each axis moves and arrives on its own")
    broken = [
        f"{c.name} ({', '.join(f'{name} {_times(use)}' for name, use in c.broken)})"
        for c in comparison.candidates
        if c.broken
    ]
    if broken:
        lines.append(f"* beyond the limits: {', '.join(broken)}")
    laws = [
        f"{c.name} ({', '.join(f'{name} {_times(use)}' for name, use in c.broken)})"
        for c in comparison.families
        if c.broken
    ]
    if laws:
        lines.append(f"* of the laws: {', '.join(laws)}")
    reasons: dict[str, list[str]] = {}
    for name, why in comparison.absent.items():
        reasons.setdefault(why, []).append(name)
    for why, names in reasons.items():
        remedy = f" and for the limit: pip install '{NEEDS_SOLVER.split()[-1]}'"
        lines.append(f"** {', '.join(names)}: {why}{remedy if why == NEEDS_SOLVER else ''}")
    lines += [f"{c.name}: {c.note}" for c in comparison.candidates if c.note]
    return [*lines, *_gains(comparison)]


def _gains(comparison: Comparison) -> list[str]:
    """What the best designs would bring, beside the controller's own G0."""
    usual = comparison["conventional"]
    designed = [c for c in comparison.candidates if c.name in DESIGNED and c.within_limits]
    lines = []
    settled = [c for c in designed if c.settling is not None]
    if settled:
        first = min(settled, key=lambda c: c.settling or 0.0)
        now = (
            "never settles"
            if usual.settling is None
            else f"is settled after {_time(usual.settling)}"
        )
        lines.append(
            f"{first.name} is settled {_time(first.settling or 0.0)} after the start; "
            f"the controller's own G0 {now}"
        )
    same = [c for c in designed if c.time <= comparison.time * SAME and c.name != "shortest"]
    if same:
        stillest = min(same, key=lambda c: c.worst)
        if stillest.worst < usual.worst:
            lines.append(
                f"in {_time(comparison.time)}, {stillest.name} leaves "
                f"{_small(stillest.worst)} um; the controller's own G0 leaves "
                f"{_small(usual.worst)} um after {_time(usual.time)}"
            )
    return lines


def _shapers(comparison: Comparison) -> str:
    """What the shapers act on, and what they were made for."""
    made = dict.fromkeys(
        f"{frequency:.4g} Hz with damping {damping:.3g}" for frequency, damping in comparison.shaped
    )
    return (
        f"{SHAPERS[0]} to {SHAPERS[-1]}: today's G0 behind a shaper made for {', '.join(made)} "
        "(--shaper-damping), what shakes most"
    )


def _laws(comparison: Comparison) -> list[str]:
    """What the laws of controls are taken at."""
    if not comparison.families:
        return []
    names = [candidate.name for candidate in comparison.families]
    said: dict[str, list[str]] = {}
    for candidate in comparison.families:
        for part in filter(None, candidate.note.split("; ")):
            quantities, _, what = part.partition(" = ")
            said.setdefault(what, []).extend(quantities.split(", "))
    equal = "; ".join(f"{what} for {', '.join(dict.fromkeys(q))}" for what, q in said.items())
    out = [f"{names[0]} to {names[-1]}: laws of other controls at the limits of axes.?.rapid"]
    out += wrap(f"where the file states none: {equal}", WIDTH) if equal else []
    reasons: dict[str, list[str]] = {}
    for name, why in comparison.families_absent.items():
        reasons.setdefault(why, []).append(name)
    return [*out, *(f"not {', '.join(names)}: {why}" for why, names in reasons.items())]


class _Best:
    """The best figure of each column, among those who keep the limits."""

    def __init__(self, comparison: Comparison) -> None:
        figures: dict[object, Callable[[Candidate], float]] = {
            "settled": lambda c: float("inf") if c.settling is None else c.settling,
            "residual": lambda c: c.worst,
        }
        for k, band in enumerate(BANDS):
            figures[band] = lambda c, k=k: c.worst_band[k]  # type: ignore[misc]
        self.figures = figures
        self.judged = comparison.candidates
        fair = [c for c in comparison.candidates if c.within_limits]
        self.least = {
            column: min((figure(c) for c in fair), default=float("inf"))
            for column, figure in figures.items()
        }

    def of(self, candidate: Candidate, column: object, text: str) -> Text:
        """A figure, bold where it is the best of its column."""
        value = self.figures[column](candidate)
        best = (
            candidate in self.judged
            and candidate.within_limits
            and value < float("inf")
            and value <= max(self.least[column] * SAME, 0.5e-5)
        )
        return Text(text, style="bold" if best else "")


def _settled(candidate: Candidate) -> str:
    return NEVER if candidate.settling is None else f"{candidate.settling * MS_PER_S:.1f}"


def _small(value: float) -> str:
    return f"{value * UM_PER_MM:.2f}"


def _times(use: float) -> str:
    """How many times over a limit; a step of the acceleration is infinite jerk."""
    return f"{use:.3g} x" if use < float("inf") else "steps"


def _time(seconds: float) -> str:
    """A time in the unit that is easiest to read."""
    return f"{seconds:.2g} s" if seconds >= 1.0 else f"{seconds * MS_PER_S:.3g} ms"
