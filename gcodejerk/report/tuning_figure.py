"""The picture of a tuned control: what time buys, and how it holds where frequencies are off.

This module owns the page. matplotlib is an optional extra and is imported by `figures`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from gcodejerk.parameters import Tuning
from gcodejerk.parameters.groups import concerned
from gcodejerk.parameters.tuning import SPREAD
from gcodejerk.report.figures import PLANNED, TODAY, new_figure, save, shown_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LAW = "#8a8a8a"
UM = 1e3
IN_A_ROW, MOST_SWEPT, SMALL = 3, 9, 1.9
"""Settings beside each other, at most, and the height of their row. [inch]"""
FEW_DECADES = 12.0
"""Range over which every tick is named."""
LEAST = 1e-3
"""Residuals below this are drawn there. [um]"""


def plot_tuning(tuning: Tuning, file: BinaryIO, suffix: str) -> None:
    """Draw a tuning.

    Parameters
    ----------
    tuning : Tuning
        Of `parameters.tune`.
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    scheme = tuning.scheme
    swept = [
        k
        for k, setting in enumerate(scheme.settings)
        if not setting.names and len(concerned(scheme, tuning.moves, (k,)))
    ][:MOST_SWEPT]
    rows = math.ceil(len(swept) / IN_A_ROW)
    figure = new_figure(suffix, (7.2, 5.6 + SMALL * rows), 200)
    grid = figure.add_gridspec(2 + rows, IN_A_ROW, height_ratios=[2.8, 2.8, *[SMALL] * rows])
    wide = [figure.add_subplot(grid[k, :]) for k in range(2)]
    _time(wide[0], tuning)
    _robustness(wide[1], tuning)
    for place, k in enumerate(swept):
        small = figure.add_subplot(grid[2 + place // IN_A_ROW, place % IN_A_ROW])
        last = place % IN_A_ROW == IN_A_ROW - 1 or k == swept[-1]
        _sweep(small, tuning, k, place % IN_A_ROW == 0, last)
        wide.append(small)
    for axes in wide:
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.spines["top"].set_visible(False)
        axes.set_axisbelow(True)
    figure.suptitle(
        f"{tuning.scheme.controller}: {tuning.scheme.title}\n{shown_name(tuning.machine.name)}",
        fontsize=11,
    )
    save(figure, file, suffix)


def _sweep(axes: Axes, tuning: Tuning, setting: int, first: bool, last: bool) -> None:
    """Residual and time over one setting, the others as chosen."""
    own = tuning.scheme.settings[setting]
    numbers, totals, values = tuning.sweep(setting)
    axes.plot(numbers, np.maximum(UM * values, LEAST), color=PLANNED, linewidth=1.2)
    axes.axvline(tuning.written[setting], color=PLANNED, linewidth=0.8)
    if np.isfinite(tuning.before[setting]):
        axes.axvline(tuning.before[setting], color=TODAY, linewidth=0.8, linestyle="--")
    time = axes.twinx()
    time.plot(numbers, totals, color=LAW, linewidth=1.0, linestyle=":")
    time.spines["top"].set_visible(False)
    time.tick_params(labelsize=7, colors="0.45")
    axes.tick_params(labelsize=7)
    _log(axes)
    axes.set_xlabel(f"{own.key} [{own.unit}]", fontsize=8)
    if first:
        axes.set_ylabel("residual [µm]", fontsize=8)
    if last:
        time.set_ylabel("time [s] (dotted)", fontsize=7, color="0.45")


def _log(axes: Axes) -> None:
    """A logarithmic scale with numbers as people write them."""
    from matplotlib.ticker import FuncFormatter, NullFormatter

    axes.set_yscale("log")
    low, high = axes.get_ylim()
    plain = FuncFormatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_major_formatter(plain)
    axes.yaxis.set_minor_formatter(plain if high < FEW_DECADES * low else NullFormatter())
    axes.tick_params(which="minor", labelsize=7)


def _time(axes: Axes, tuning: Tuning) -> None:
    """What all rapids together take against what the worst leaves."""
    points = sorted(tuning.curve, key=lambda point: point.total)
    total = np.array([point.total for point in points])
    value = np.maximum([UM * point.value for point in points], LEAST)
    axes.plot(total, value, color=PLANNED, linewidth=1.2, marker="o", markersize=3.5,
              label="best settings for a time")  # fmt: skip
    marks = (
        (tuning.today, TODAY, "s", "today, as the machine file has it"),
        (tuning.as_set, LAW, "D", f"{tuning.scheme.controller} with today's settings"),
        (tuning.chosen, PLANNED, "*", "the choice"),
    )
    for outcome, colour, marker, label in marks:
        if outcome is tuning.as_set and math.isclose(outcome.value, tuning.today.value):
            continue
        size = 13 if marker == "*" else 6
        axes.plot(
            [outcome.total], [max(UM * outcome.value, LEAST)], color=colour, marker=marker,
            markersize=size, linestyle="none", label=label, markeredgecolor="white",
        )  # fmt: skip
    axes.axvline(tuning.today.total, color="0.6", linewidth=0.8, linestyle=":")
    _log(axes)
    axes.set_xlabel("time of all rapids [s]")
    axes.set_ylabel(f"{tuning.goal} residual [µm]")
    axes.legend(frameon=False, fontsize=8, loc="best")


def _robustness(axes: Axes, tuning: Tuning) -> None:
    """The residual where all frequencies are off by the same share."""
    names = ("today", f"{tuning.scheme.controller} with today's settings", "the choice")
    styles = ((TODAY, "-"), (LAW, "--"), (PLANNED, "-"))
    for row, name, (colour, style) in zip(tuning.spread, names, styles, strict=True):
        if style == "--" and np.allclose(row, tuning.spread[0]):
            continue
        axes.plot(100.0 * SPREAD, np.maximum(UM * row, LEAST), color=colour, linestyle=style,
                  linewidth=1.4, label=name)  # fmt: skip
    band = 100.0 * tuning.machine.design.band
    if band:
        axes.axvspan(-band, band, color="0.95", linewidth=0, label="band of the machine file")
    _log(axes)
    axes.set_xlabel("error of all frequencies [%]")
    axes.set_ylabel(f"{tuning.goal} residual [µm]")
    axes.legend(frameon=False, fontsize=8, loc="best")
