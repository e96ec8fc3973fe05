"""What a page says in words: one sentence, three figures, what stayed and what helps.

This module owns these texts, in the program's own unit. Numbers have three significant digits; a
length of vibration is in um, or in thousandths of an inch where the program is in inches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from gcodejerk.reasons import EXPLAINED, REASONS, Reason
from gcodejerk.report.page.text import escaped, with_code
from gcodejerk.rewrite.result import Result
from gcodejerk.units import MM_PER_INCH, percent

Record = dict[str, Any]
BYTES_PER_KB = 1000.0
NOTHING_LOST = [
    REASONS.index(reason) for reason in (Reason.AFTER_END, Reason.NO_MOTION, Reason.CONTROL_SET)
]
"""Reasons of rapids that do not run, do not move, or are served otherwise."""
WHOLE = 1000.0
"""From here on numbers have no decimals."""


@dataclass(frozen=True, slots=True)
class Unit:
    """The lengths of a page: of moves, and of what is small."""

    length: str
    per_mm: float
    small: str
    small_per_mm: float

    @classmethod
    def of(cls, summary: Record) -> Unit:
        """Inches where all rapids are in inches, else mm."""
        if summary["inch"]:
            return cls("in", 1.0 / MM_PER_INCH, "thou", 1000.0 / MM_PER_INCH)
        return cls("mm", 1.0, "µm", 1000.0)

    def vibration(self, millimetres: float | None) -> str:
        """A displacement, without its unit."""
        return "?" if millimetres is None else figure(millimetres * self.small_per_mm)


def figure(value: float) -> str:
    r"""A number with three significant digits, and never an exponent.

    Examples
    --------
    >>> [figure(x) for x in (469.02, 35.7, 0.04321, 999.6, 0.0)]
    ['469', '35.7', '0.0432', '1\u202f000', '0']
    """
    size = abs(value)
    if size == 0.0:
        return "0"
    if size >= WHOLE - 0.5:
        return grouped(round(value))
    decimals = min(max(2 - math.floor(math.log10(size * (1.0 + 1e-12))), 0), 6)
    text = f"{value:.{decimals}f}"
    return text.rstrip("0").rstrip(".") if decimals else text


def grouped(count: int) -> str:
    """A whole number with its thousands apart."""
    return f"{count:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def number_of(count: int, noun: str) -> str:
    """A count with its noun."""
    return f"{grouped(count)} {noun}" + ("" if count == 1 else "s")


def file_size(size: int) -> str:
    """A size in bytes, kB or MB.

    Examples
    --------
    >>> file_size(812), file_size(48_210), file_size(2_500_000)
    ('812 bytes', '48.2 kB', '2.5 MB')
    """
    if size < BYTES_PER_KB:
        return f"{size} bytes"
    if size < BYTES_PER_KB**2:
        return f"{figure(size / BYTES_PER_KB)} kB"
    return f"{figure(size / BYTES_PER_KB**2)} MB"


def sentence(summary: Record, unit: Unit) -> str:
    """What became of the program, in one sentence of plain text."""
    count, planned = summary["rapids"], summary["planned"]
    if not count:
        return "The program has no rapids (G0), so there was nothing to do."
    if summary.get("set_at"):
        return (
            f"The control is set at {number_of(summary['set_at'], 'place')} of the program for "
            f"its own {number_of(count, 'rapid')}: the worst vibration before a cut "
            f"{_change(summary, unit, 'worst_conventional_residual', 'worst_residual')}."
        )
    if not planned:
        none = (
            "Its only rapid was not" if count == 1 else f"None of the {grouped(count)} rapids was"
        )
        return f"{none} rewritten: the program stays as it was; below stands why, and what helps."
    text = f"{grouped(planned)} of {number_of(count, 'rapid')} "
    text += "was rewritten" if planned == 1 else "were rewritten"
    text += _extra(summary)
    if summary["worst_conventional_residual"] is None:
        return text + "."
    text += ": the worst vibration that one of them leaves "
    text += _change(summary, unit, "worst_conventional_residual", "worst_residual")
    saved = _saved(summary)
    if saved is not None and saved > 0.0:
        text += f", and {figure(saved)} s of waiting for it to settle are saved"
    return text + "."


def _extra(summary: Record) -> str:
    """Whether the rewritten rapids last longer."""
    more = 1e3 * (summary["rapid_time"] - summary["conventional_time"])
    if abs(more) < 0.5 * max(summary["planned"], 1):
        return " in the same time"
    size = f"{figure(abs(more))} ms" if abs(more) < 1e3 else f"{figure(1e-3 * abs(more))} s"
    return f" ({size} {'longer' if more > 0 else 'shorter'} in all)"


def _change(summary: Record, unit: Unit, before: str, after: str) -> str:
    """`falls from 469 to 30.9 um, to 6.6 %`."""
    now, then = summary[before], summary[after]
    if now is None or then is None:
        return "is not known"
    verb = "falls" if then < now else "stays" if then == now else "rises"
    if verb == "stays":
        return f"stays at {unit.vibration(now)} {unit.small}"
    text = f"{verb} from {unit.vibration(now)} to {unit.vibration(then)} {unit.small}"
    return text + (f" ({percent(then / now)} of today's)" if now else "")


def _saved(summary: Record) -> float | None:
    """Waiting time that is saved [s]; None where it is not known, or has no end."""
    now, then = summary["conventional_settling_time"], summary["settling_time"]
    return None if now is None or then is None else float(now - then)


def three_figures(
    summary: Record, unit: Unit, sizes: tuple[int, int], set_anew: bool
) -> list[tuple[str, str, str, str]]:
    """The three figures: a name, before, after, and what it means; plain text.

    Parameters
    ----------
    summary : dict
        Of `records.summary_of`.
    unit : Unit
        Of the page.
    sizes : (int, int)
        Of the program, and of what was written in its place. [bytes]
    set_anew : bool
        The control was set, and no rapid rewritten.

    Returns
    -------
    list of (str, str, str, str)
        After may be empty: there is one number only.
    """
    return [
        _vibration(summary, unit, set_anew),
        _waiting(summary, unit, set_anew),
        _size(sizes),
    ]


def _vibration(summary: Record, unit: Unit, set_anew: bool) -> tuple[str, str, str, str]:
    name = "Worst vibration left"
    if summary["planned"] or set_anew:
        now, then = summary["worst_conventional_residual"], summary["worst_residual"]
        of = "before a cut" if set_anew else f"of the {number_of(summary['planned'], 'rapid')}"
        says = of if set_anew else f"{of} rewritten"
    else:
        now = then = summary["worst_conventional_residual_all"]
        says = "of the rapids of which it is known; nothing was rewritten"
    if not summary["rapids"]:
        return name, "none", "", "there are no rapids"
    if now is None or then is None:
        return name, "not known", "", "nothing that vibrates is known of these rapids"
    everything = summary["worst_residual_all"]
    if summary["left"] and everything is not None and summary["planned"]:
        says += (
            f"; with those left alone, {unit.vibration(summary['worst_conventional_residual_all'])}"
            f" → {unit.vibration(everything)} {unit.small}"
        )
    if summary["left_unknown"]:
        says += f"; of {number_of(summary['left_unknown'], 'rapid')} it is not known"
    small = unit.small
    before = f"{unit.vibration(now)} {small}"
    return name, before, "" if now == then else f"{unit.vibration(then)} {small}", says


def _waiting(summary: Record, unit: Unit, set_anew: bool) -> tuple[str, str, str, str]:
    name = "Waiting for it to settle"
    within = f"{unit.vibration(summary['tolerance'])} {unit.small}"
    if set_anew:
        now, then = (f"{figure(summary[key])} s" for key in ("conventional_time", "rapid_time"))
        return "Rapids in motion", now, then, "settling is not known rapid by rapid here"
    waited, waits = summary["conventional_settling_time"], summary["settling_time"]
    if waits is None:
        return name, "without end", "", f"a mode without damping never comes within {within}"
    if not summary["rapids"]:
        return name, "none", "", "there are no rapids"
    if summary["worst_residual_all"] is None:
        return name, "not known", "", "nothing that vibrates is known of these rapids"
    says = f"until what is known is within {within}, all rapids together"
    if waited is None:
        return name, "without end", f"{figure(waits)} s", says
    saved = waited - waits
    if saved >= 0.0005:
        says = f"{figure(saved)} s saved: {says}"
    elif saved <= -0.0005:
        says = f"{figure(-saved)} s more: {says}"
    before = f"{figure(waited)} s"
    return name, before, "" if abs(saved) < 0.0005 else f"{figure(waits)} s", says


def _size(sizes: tuple[int, int]) -> tuple[str, str, str, str]:
    source, written = sizes
    if source == written:
        return "File size", file_size(source), "", "unchanged"
    share = written / source if source else math.inf
    many = f"{figure(float(f'{share:.2g}'))} times as large" if share >= 1.1 else "hardly changed"
    many = many if share > 0.9 else "a file of its own"
    return "File size", file_size(source), file_size(written), many


def reason_rows(result: Result) -> list[tuple[int, int]]:
    """Index and count of each reason for which rapids were left alone: most rapids lost first.

    Those of which nothing is lost come last.
    """
    reasons = result.plans.reason[~result.plans.planned]
    codes, counts = np.unique(reasons, return_counts=True)
    lost = np.where(np.isin(codes, NOTHING_LOST), 0, counts)
    return [(int(codes[k]), int(counts[k])) for k in np.lexsort((-counts, -lost))]


def reasons_html(result: Result) -> str:
    """Rows of a table: reason and meaning, how many rapids, what helps, and a button."""
    out = []
    for code, count in reason_rows(result):
        reason = REASONS[code]
        told = EXPLAINED[reason]
        out.append(
            f'<tr><th scope="row">{escaped(str(reason))}<small>{with_code(told.means)}</small>'
            f'</th><td class="n">{grouped(count)}</td><td>{with_code(told.remedy)}</td>'
            f'<td class="screen"><button type="button" class="show" data-reason="{code}" '
            f'aria-label="Show the rapids: {escaped(str(reason))}">Show</button></td></tr>'
        )
    return "\n".join(out)


def notes_html(notes: tuple[str, ...]) -> str:
    """The notes of a result, as items of a list."""
    return "\n".join(f"<li>{escaped(note)}</li>" for note in notes)
