"""The picture of a tuned control: what time buys, and how it holds where frequencies are off.

This module owns the page. matplotlib is an optional extra and is imported by `figures`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from gcodejerk.parameters import Tuning
from gcodejerk.parameters.tuning import SPREAD
from gcodejerk.report.figures import PLANNED, TODAY, new_figure, save

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LAW = "#8a8a8a"
UM = 1e3
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
    figure = new_figure(suffix, (7.2, 6.4), 200)
    upper, lower = figure.subplots(2, 1)
    _time(upper, tuning)
    _robustness(lower, tuning)
    for axes in (upper, lower):
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
        axes.set_axisbelow(True)
    figure.suptitle(
        f"{tuning.scheme.title.capitalize()}\n{tuning.scheme.controller} on {tuning.machine.name}",
        fontsize=11,
    )
    save(figure, file, suffix)


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
        size = 13 if marker == "*" else 6
        axes.plot(
            [outcome.total], [max(UM * outcome.value, LEAST)], color=colour, marker=marker,
            markersize=size, linestyle="none", label=label, markeredgecolor="white",
        )  # fmt: skip
    axes.axvline(tuning.today.total, color="0.6", linewidth=0.8, linestyle=":")
    axes.set_yscale("log")
    axes.set_xlabel("time of all rapids [s]")
    axes.set_ylabel(f"{tuning.goal} residual [µm]")
    axes.legend(frameon=False, fontsize=8, loc="best")


def _robustness(axes: Axes, tuning: Tuning) -> None:
    """The residual where all frequencies are off by the same share."""
    names = ("today", f"{tuning.scheme.controller} with today's settings", "the choice")
    styles = ((TODAY, "-"), (LAW, "--"), (PLANNED, "-"))
    for row, name, (colour, style) in zip(tuning.spread, names, styles, strict=True):
        axes.plot(100.0 * SPREAD, np.maximum(UM * row, LEAST), color=colour, linestyle=style,
                  linewidth=1.4, label=name)  # fmt: skip
    band = 100.0 * tuning.machine.design.band
    if band:
        axes.axvspan(-band, band, color="0.95", linewidth=0, label="band of the machine file")
    axes.set_yscale("log")
    axes.set_xlabel("error of all frequencies [%]")
    axes.set_ylabel(f"{tuning.goal} residual [µm]")
    axes.legend(frameon=False, fontsize=8, loc="best")
