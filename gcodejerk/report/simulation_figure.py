"""Pictures of simulations, after Figs. 2, 4 and 9 to 12 of the paper, fit for print.

This module owns what is drawn where. matplotlib is an optional extra, imported where it draws.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Program
from gcodejerk.report.figures import (
    PLANNED,
    TODAY,
    label_part,
    moved_words,
    name_frequencies,
    new_figure,
    save,
    shown_name,
)
from gcodejerk.simulation.programs import Simulation
from gcodejerk.simulation.single import MoveSimulation

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

STYLE = {
    "today": {"color": TODAY, "linewidth": 1.3, "label": "controller's own G0"},
    "planned": {"color": PLANNED, "linewidth": 1.3, "label": "planned", "linestyle": (0, (5, 1.5))},
}
MOVE = (7.2, 8.4)
"""Size of the page of a move. [inch]"""
UM, MS = 1e3, 1e3
LINES = 1500
"""Points of a curve over frequency."""
MOST_NAMES = 6
"""Peaks that are named."""
BESIDE = 0.28
"""Two peaks nearer than this share of their frequency get one name."""


def plot_move_simulation(found: MoveSimulation, file: BinaryIO, suffix: str) -> None:
    """Draw a move: command, lag, vibration, and what their spectra and the machine's peaks are.

    Parameters
    ----------
    found : MoveSimulation
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    figure = new_figure(suffix, MOVE, 200)
    draw_move_simulation(figure, found)
    save(figure, file, suffix)


def draw_move_simulation(figure: Figure, found: MoveSimulation) -> None:
    """Draw a move into an empty figure; as `plot_move_simulation`."""
    times = found.times()
    axis = max(found.moving, key=lambda name: abs(found.plan.displacement[name]))
    u = found.watch.equations.axes.index(axis)
    rotary = found.machine.axis(axis).rotary
    unit, thousandth = ("deg", "deg/1000") if rotary else ("mm", "µm")
    parts = figure.subplots(3, 2)
    command, lag, tool = parts[:, 0]
    told, left, machine = parts[:, 1]
    off = {way: found.deviation(way, times) for way in STYLE}
    strongest = int(np.argmax(np.abs(off["today"]).max(axis=1)))
    for way, style in STYLE.items():
        # The end is exact: the last step of the jerk may be one of the acceleration.
        command.plot(MS * times, found.command(way, times)[2][:, u], **style)
        lag.plot(MS * times, UM * found.lag(way, times)[u], **style)
        behind = times >= found.steps[way].end
        tool.plot(MS * times[behind], UM * off[way][strongest][behind], **style)
    frequency = _frequencies(found)
    for way, style in STYLE.items():
        told.semilogx(frequency, found.command_spectrum(way, frequency, axis), **style)
        thin = style | {"linewidth": 0.6, "linestyle": "-", "label": None}
        told.semilogx(frequency, found.table_spectrum(way, frequency, axis), **thin)
        left.loglog(frequency, UM * found.tool_spectrum(way, frequency), **style)
    _machine(machine, found, frequency, axis)
    label_part(command, f"(a) acceleration told to {axis}", "time [ms]", f"[{unit}/s²]")
    label_part(
        told, "(b) its spectrum; thin: what the table makes of it", "frequency [Hz]", f"[{unit}/s]"
    )
    label_part(lag, f"(c) lag of {axis}'s table", "time [ms]", f"[{thousandth}]")
    label_part(left, "(d) spectrum of the tool behind the move", "frequency [Hz]", "[µm s]")
    label_part(tool, "(e) tool from its place, behind the move", "time [ms]", "[µm]")
    density = left.get_ylim()[1]
    left.set_ylim(1e-5 * density, density)
    tolerance = UM * found.machine.design.tolerance
    tool.axhspan(-tolerance, tolerance, color="0.85", zorder=0)
    for axes in (told, left, machine):
        axes.set_xlim(frequency[0], frequency[-1])
        name_frequencies(axes, 0.1)
    for axes in (command, lag, tool):
        axes.axvline(MS * found.steps["planned"].end, color="0.6", linewidth=0.8, linestyle=":")
        axes.set_xlim(0.0, MS * times[-1])
    figure.suptitle(
        f"{moved_words(found.plan.displacement, found.machine)}, simulated\n"
        f"{shown_name(found.machine.name)}",
        fontsize=10,
    )
    handles, labels = command.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=8.5)


def _frequencies(found: MoveSimulation) -> Array:
    """Frequencies to draw over, the peaks among them, shape (f,) [Hz]."""
    peaks = [pole.frequency for pole in found.poles()]
    low = 0.3 * min(peaks, default=30.0)
    high = min(3.0 * max(peaks, default=100.0), 0.5 / found.machine.interval)
    spread = np.geomspace(max(low, 1.0), max(high, 2.0 * low), LINES)
    return np.unique(np.concatenate([spread, [p for p in peaks if spread[0] <= p <= spread[-1]]]))


def _machine(axes: Axes, found: MoveSimulation, frequency: Array, axis: str) -> None:
    """The machine's own frequency response, its peaks named."""
    response = np.abs(found.frequency_response(frequency, axis))
    force = bool(found.watch.equations.pushed)
    axes.loglog(frequency, UM * response, color="0.25", linewidth=1.1)
    inner = (response[1:-1] > response[:-2]) & (response[1:-1] > response[2:])
    peaks = np.array([k for k in np.flatnonzero(inner) + 1 if _stands_out(response, int(k))], int)
    named: list[float] = []
    for k in peaks[np.argsort(-response[peaks])]:
        f = float(frequency[k])
        if len(named) == MOST_NAMES or any(abs(f / g - 1.0) < BESIDE for g in named):
            continue
        named.append(f)
        axes.annotate(
            f"{f:.0f}", (f, UM * float(response[k])), (0, 3), textcoords="offset points",
            ha="center", va="bottom", fontsize=7.5,
        )  # fmt: skip
    low, high = axes.get_ylim()
    axes.set_ylim(low, high * 2.0)
    unit = "deg" if found.machine.axis(axis).rotary else "mm"
    of = f"force to tool, along {axis}" if force else f"acceleration told to {axis}, to tool"
    label_part(axes, f"(f) {of}", "frequency [Hz]", "[µm/N]" if force else f"[µm/({unit}/s²)]")


def _stands_out(response: Array, k: int) -> bool:
    """Whether a curve falls by a third on both sides of a peak before it rises above it."""
    for side in (response[k::-1], response[k:]):
        higher = np.flatnonzero(side > response[k])
        valley = side[: higher[0]].min() if len(higher) else side.min()
        if valley > response[k] / 1.5:
            return False
    return True


def plot_program_simulation(
    found: Simulation, program: Program, tolerance: float, file: BinaryIO, suffix: str
) -> None:
    """Draw the rapids of a program: how far the tool is off when each has ended, and the waiting.

    Parameters
    ----------
    found : Simulation
    program : Program
    tolerance : float
        That counts as settled. [mm]
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    figure = new_figure(suffix, (7.2, 6.2), 200)
    upper, middle, lower = figure.subplots(3, 1)
    line = program.rapids.line[found.move]
    marks: dict[str, Any] = {"linestyle": "", "markersize": 3.2}
    for way, mark in (("today", "o"), ("planned", "s")):
        rapids, colour = getattr(found, way), STYLE[way]["color"]
        label = STYLE[way]["label"]
        floor = 1e-3 * tolerance
        shaken = UM * np.maximum(rapids.residual, floor)
        upper.semilogy(line, shaken, marker=mark, color=colour, label=label, **marks)
        waiting = np.where(np.isfinite(rapids.settling), rapids.waiting, np.nan)
        middle.plot(line, MS * waiting, marker=mark, color=colour, **marks)
        ranked = np.sort(np.nan_to_num(waiting))[::-1]
        lower.step(
            np.arange(len(ranked) + 1), MS * np.append(ranked, ranked[-1]), where="post",
            color=colour, linewidth=1.3,
        )  # fmt: skip
    upper.axhline(UM * tolerance, color="0.5", linewidth=0.8, linestyle=":")
    label_part(
        upper,
        "(a) what the strongest mode keeps when a rapid has ended",
        "line of the program",
        "[µm]",
    )
    label_part(middle, "(b) waiting until the tool is in its place", "line of the program", "[ms]")
    label_part(lower, "(c) the same, the longest first", "rapids", "[ms]")
    for axes in (middle, lower):
        axes.set_ylim(bottom=0.0)
    lower.set_xlim(0, len(found))
    lower.locator_params(axis="x", integer=True)
    figure.suptitle(
        f"{shown_name(program.name)}: {len(found)} rapids simulated, {found.saved:.3g} s of "
        "waiting saved",
        fontsize=10,
    )
    handles, labels = upper.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False, fontsize=8.5)
    save(figure, file, suffix)
