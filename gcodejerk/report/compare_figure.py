"""The picture of a comparison: one page, after Figs. 9, 10 and 12 of the paper.

For each axis its acceleration, position and the spectrum of the acceleration; then what is left
when each one has arrived, over time and frequency; below, what a mode of any frequency would keep.
This module owns the page: which part stands where, titles and the legend. The parts are
`compare_lanes`' and `compare_spectra`'s; `compare_shown` says who is shown how. matplotlib is an
optional extra and is imported inside the functions that draw.
"""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, BinaryIO

from gcodejerk.report import compare_lanes as lanes
from gcodejerk.report import compare_spectra as spectra
from gcodejerk.report.compare_shown import OTHERS, TEXT, UM, UNIT, Shown
from gcodejerk.report.figures import new_figure, save, shown_name
from gcodejerk.studies.comparison import Comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 300
WIDTH = 7.2
"""Two columns of a journal's page. [inch]"""
ONE_LANE, HEAD, SMALL, WIDE = 0.27, 0.25, 1.0, 1.5
"""Heights of a lane, of the room above the lanes, and of parts without lanes. [inch]"""
AROUND, ENDS = 0.5, 0.95
"""Heights of words around a row of parts, and of title and legend. [inch]"""
IN_A_ROW = 3
"""Axes beside each other."""
COLUMNS = 6
OTHERS_WIDTH = 36
"""Letters of a line of the legend's last entry."""


def plot_comparison(comparison: Comparison, file: BinaryIO, suffix: str) -> None:
    """Draw a comparison.

    Parameters
    ----------
    comparison : Comparison
        Of `compare_move`.
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    shown = Shown(comparison)
    figure = new_figure(suffix, page_size(shown), DPI)
    draw_comparison(figure, shown)
    save(figure, file, suffix)


def page_size(shown: Shown) -> tuple[float, float]:
    """Width and height of the page [inch]."""
    return WIDTH, sum(_heights(shown)) + AROUND * len(_heights(shown)) + ENDS


def draw_comparison(figure: Figure, shown: Shown) -> None:
    """Draw a comparison into an empty figure of `page_size`."""
    figure.set_layout_engine("constrained", w_pad=0.06, h_pad=0.05)
    grid = figure.add_gridspec(len(_heights(shown)), COLUMNS, height_ratios=_heights(shown))
    letters = iter("abcdefghijklmnopqrstuvwxyzABCDEFGHIJ")
    letter_of: dict[str, str] = {}

    def part(rows: Any, first: int, last: int, draw: Callable[..., str], *about: Any) -> Axes:
        axes = figure.add_subplot(grid[rows, first:last])
        letter = next(letters)
        if draw is lanes.draw_acceleration:
            letter_of[about[0]] = letter
        axes.set_title(f"({letter}) {draw(axes, shown, *about)}", fontsize=TEXT, loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=TEXT - 0.5)
        axes.xaxis.label.set_fontsize(TEXT)
        axes.yaxis.label.set_fontsize(TEXT)
        return axes

    row = 0
    for group in _groups(shown):
        count = len(group)
        each = COLUMNS // max(count, 2)
        places = [(k * each, (k + 1) * each) for k in range(count)]
        # An axis alone has its position and spectrum beside, not below.
        beside = count == 1
        rows = slice(row, row + 2) if beside else row
        bins = 12 // max(count, 2)
        for axis, (first, last) in zip(group, places, strict=True):
            axes = part(rows, first, last, lanes.draw_acceleration, axis, first == 0)
            axes.locator_params(axis="x", nbins=bins)
        row += 0 if beside else 1
        shift = each if beside else 0
        for axis, (first, last) in zip(group, places, strict=True):
            axes = part(row, first + shift, last + shift, lanes.draw_position, axis)
            axes.locator_params(axis="x", nbins=bins)
            axes.locator_params(axis="y", nbins=4)
        row += 1
        for axis, (first, last) in zip(group, places, strict=True):
            part(
                row, first + shift, last + shift, spectra.draw_acceleration_spectrum, axis,
                letter_of[axis],
            )  # fmt: skip
        row += 1
    vibration = part(row, 0, 3, lanes.draw_vibration)
    part(row, 3, 6, spectra.draw_vibration_spectrum, vibration.get_title(loc="left")[1])
    below = part(row + 1, 0, 6, spectra.draw_residual)
    below.set_title(below.get_title(loc="left"), fontsize=TEXT, loc="left", pad=6.0 + spectra.NAMES)
    figure.legend(
        *_legend(shown), loc="outside lower center", ncols=4, fontsize=TEXT - 0.5, frameon=False,
        handlelength=3.2, columnspacing=1.6,
    )  # fmt: skip
    tolerance = UM * shown.comparison.machine.design.tolerance
    figure.suptitle(
        f"{shown.moved} — {shown_name(shown.comparison.machine.name, 50)}; "
        f"settled: below {tolerance:g} {UNIT}",
        fontsize=TEXT + 0.5,
    )
    # Once more for what depends on where the first time put it.
    figure.draw_without_rendering()
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    spectra.name_modes(below, shown)


def _groups(shown: Shown) -> list[list[str]]:
    """The axes, row by row."""
    return [shown.axes[k : k + IN_A_ROW] for k in range(0, len(shown.axes), IN_A_ROW)]


def _heights(shown: Shown) -> list[float]:
    """Of the rows of parts [inch]."""
    tall = ONE_LANE * len(shown.shown) + HEAD
    heights = []
    for group in _groups(shown):
        heights += [0.5 * tall, 0.5 * tall] if len(group) == 1 else [tall, SMALL, SMALL]
    return [*heights, tall, WIDE]


def _legend(shown: Shown) -> tuple[list[Any], list[str]]:
    """Lines and names."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], **shown.style(candidate)) for candidate in shown.shown]
    words = [candidate.name for candidate in shown.shown]
    if shown.others:
        handles.append(Line2D([], [], **OTHERS))
        others = ", ".join(candidate.name for candidate in shown.others)
        words.append(textwrap.fill(f"all others: {others}", OTHERS_WIDTH))
    return handles, words
