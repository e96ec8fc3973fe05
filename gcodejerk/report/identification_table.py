"""What `identify` prints: tables and sentences, for people.

Rule: what was not identified says so, with why, in the place where its numbers would stand.
"""

from __future__ import annotations

from collections.abc import Sequence

from gcodejerk.identification import Identification, Peaks
from gcodejerk.report.identification_record import at_most
from gcodejerk.report.screen import ScreenTable


def identification_table(found: Identification) -> ScreenTable:
    """The modes of an axis.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    ScreenTable
    """
    table = ScreenTable(
        ("mode\n[Hz]", "right"), ("damping", "right"), ("participation", "right"),
        ("largest\n[mm/s²]", "right"), ("decays", "right"), ("", "left"),
        wrap=("",), drop=("largest\n[mm/s²]",),
    )  # fmt: skip
    for mode in found.modes:
        told = "not identified"
        if mode.participation is not None and mode.sd_participation is not None:
            told = _within(mode.participation, mode.sd_participation)
        seen = f"{mode.decays} of {mode.of}"
        size = f"{mode.amplitude:.3g}" if mode.amplitude < 1000.0 else f"{mode.amplitude:.0f}"
        if mode.problem:
            table.add_row(
                f"{mode.frequency:.1f}", "", "", size, seen, f"not identified: {mode.problem}"
            )
            continue
        table.add_row(
            _within(mode.frequency, mode.sd_frequency), _within(mode.damping, mode.sd_damping),
            told, size, seen,
        )  # fmt: skip
    return table


def identification_sentences(found: Identification) -> list[str]:
    """What was seen, and what was odd: lines below the table.

    Parameters
    ----------
    found : Identification

    Returns
    -------
    list of str
    """
    lines = []
    for record, search in found.searches:
        lines.append(
            f"{record.name}: {record.duration:.3g} s at {record.rate:.5g} Hz, {search.motions} "
            f"motion{'' if search.motions == 1 else 's'}, {len(search.decays)} with a free decay"
        )
        lines += [f"note: {note}" for note in (*record.notes, *search.notes)]
    lines += [f"note: {note}" for note in found.notes]
    held = len(found.held)
    lines.append(f"{held or 'no'} mode{'' if held == 1 else 's'} of {found.axis} identified")
    return lines


def peaks_table(found: Sequence[Peaks]) -> ScreenTable:
    """Peaks of spectra.

    Parameters
    ----------
    found : sequence of Peaks

    Returns
    -------
    ScreenTable
    """
    table = ScreenTable(
        ("spectrum", "left"), ("peak\n[Hz]", "right"), ("of the\nhighest", "right"),
        ("damping", "right"), ("less the\nwindow", "right"), drop=("of the\nhighest",),
    )  # fmt: skip
    for one in found:
        for k, peak in enumerate(one.peaks):
            less = "" if peak.without_window is None else f"{peak.without_window:.2g}"
            table.add_row(
                one.spectrum.name if k == 0 else "",
                f"{peak.frequency:.1f} ± {peak.uncertain:.1f}", f"{peak.share:.2f}",
                at_most(peak.most_damping), less,
            )  # fmt: skip
    return table


def peaks_sentences(found: Sequence[Peaks]) -> list[str]:
    """What a spectrum does not tell.

    Parameters
    ----------
    found : sequence of Peaks

    Returns
    -------
    list of str
    """
    lines = [f"note: {note}" for one in found for note in one.spectrum.notes]
    return [
        *lines,
        "a spectrum shows where an axis shakes; damping ratios cannot be identified from it: give "
        "the machine file the spectrum itself (below), or record rapids and their free decays",
    ]


def _within(value: float, sd: float) -> str:
    """A value with as many decimals as its uncertainty gives reason for."""
    decimals = 0
    while decimals < 5 and sd < 0.95 * 10.0 ** (1 - decimals):
        decimals += 1
    return f"{value:.{decimals}f} ± {sd:.{decimals}f}"
