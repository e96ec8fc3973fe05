"""Pictures of identifications: the record, a decay with its fit, what came back, the spectrum.

This module owns what is drawn where. matplotlib is an optional extra, imported where it draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from gcodejerk.identification import Decay, Identification, Peaks, Record
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.report.figures import PLANNED, TODAY, label_part, new_figure, save, shown_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_POINTS = 4000
"""Of a curve; more are drawn as the extremes of so many stretches."""
MM_S2 = 1e-3
"""Accelerations are drawn in m/s²."""
PADDED = 4
"""Spectra are drawn finer than the stretch resolves, so that curves are smooth."""
DEPTH = 3e-4
"""What of a spectrum is shown below its highest line."""


def plot_identification(
    found: Identification, band: tuple[float, float], file: BinaryIO, suffix: str
) -> None:
    """Draw the record with its decays, one decay with its fit, its stabilization and its spectrum.

    Parameters
    ----------
    found : Identification
    band : (float, float)
        That was looked at. [Hz]
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    record, search = max(found.searches, key=lambda one: len(one[1].decays))
    decay = max(search.decays, key=_shows, default=None)
    figure = new_figure(suffix, (7.2, 3.0 if decay is None else 8.0), 200)
    below: list[Any] = [] if decay is None else [["decay", "decay"], ["orders", "spectrum"]]
    parts = figure.subplot_mosaic(
        [["record", "record"], *below], height_ratios=[1.0, 1.1, 1.3][: 1 + len(below)]
    )
    c = 0
    if decay is not None:
        strength = [np.abs(ring.amplitude) for ring in decay.taken.rings]
        c = int(np.argmax(np.sum(strength, axis=0)))
    _record(parts["record"], record, c, search.decays, decay)
    channel = record.channels[c]
    count, all_of = len(search.decays), search.motions
    label_part(
        parts["record"], f"(a) {channel}: {count} decays behind {all_of} motions", "time [s]",
        "[m/s²]",
    )  # fmt: skip
    if decay is not None:
        _decay(parts["decay"], record, c, decay)
        _orders(parts["orders"], decay, found, band)
        _spectrum(parts["spectrum"], record, c, decay, found, band)
    held = len(found.held)
    modes = f"{held or 'no'} mode{'' if held == 1 else 's'} of {found.axis} identified"
    figure.suptitle(f"{shown_name(Path(record.name).name)}: {modes}", fontsize=10)
    save(figure, file, suffix)


def _shows(decay: Decay) -> tuple[int, float]:
    """The decay that shows most modes, and the strongest."""
    rings = decay.taken.rings
    return len(rings), max(float(np.abs(ring.amplitude).max()) for ring in rings)


def _record(
    axes: Axes, record: Record, c: int, decays: Sequence[Decay], shown: Decay | None
) -> None:
    """The whole record, its decays shaded, what was not used marked."""
    times = record.begin + np.arange(record.values.shape[1]) / record.rate
    values = MM_S2 * record.values[c]
    by = max(1, 2 * len(times) // MOST_POINTS)
    count = len(times) // by
    cut = values[: count * by].reshape(count, by)
    axes.fill_between(
        times[: count * by : by], cut.min(axis=1), cut.max(axis=1), color="0.35", linewidth=0.4
    )
    for decay in decays:
        colour = PLANNED if decay is shown else "#7aa6d6"
        axes.axvspan(decay.begin, decay.end, color=colour, alpha=0.35, linewidth=0.0, zorder=0)
    if shown is not None:
        top = float(np.abs(values).max())
        axes.annotate(
            "(b)", (0.5 * (shown.begin + shown.end), 0.92 * top), ha="center", va="top",
            fontsize=8, color=PLANNED,
        )  # fmt: skip
    broken = np.flatnonzero(record.broken)
    axes.plot(times[broken], values[broken], linestyle="", marker="x", markersize=3.0, color=TODAY)
    axes.set_xlim(times[0], times[-1])


def _decay(axes: Axes, record: Record, c: int, decay: Decay) -> None:
    """One decay as it was measured, its fit, and the motion in front of it."""
    before = 0.12
    first = max(0, int((decay.begin - before - record.begin) * record.rate))
    last = int((decay.end - record.begin) * record.rate)
    times = record.begin + np.arange(first, last) / record.rate - decay.begin
    values = MM_S2 * record.values[c, first:last]
    fit = decay.taken.fit
    fitted = np.arange(fit.shape[1]) / fit.shape[1] * (decay.end - decay.begin)
    axes.plot(times, values, color="0.55", linewidth=0.9, label="measured")
    axes.plot(
        fitted, MM_S2 * fit[c], color=PLANNED, linewidth=1.3, linestyle=(0, (4, 1.2)),
        label=f"modes, {100.0 * decay.taken.unexplained:.2g} % of the energy left",
    )  # fmt: skip
    size = 1.25 * MM_S2 * float(np.abs(fit[c]).max())
    axes.set_ylim(-size, size)
    axes.set_xlim(times[0], times[-1])
    axes.axvline(0.0, color=TODAY, linewidth=0.9, linestyle=":")
    axes.annotate(
        "free from here", (0.0, -size), (4, 4), textcoords="offset points", fontsize=7.5,
        color=TODAY,
    )  # fmt: skip
    axes.legend(frameon=False, fontsize=8, loc="upper right")
    label_part(axes, f"(b) the decay at {decay.begin:.2f} s", "time from its begin [s]", "[m/s²]")


def _orders(axes: Axes, decay: Decay, found: Identification, band: tuple[float, float]) -> None:
    """Poles of every order: a mode comes back in order after order."""
    poles = np.array(decay.taken.stabilization).reshape(-1, 3)
    poles = poles[(poles[:, 1] >= band[0]) & (poles[:, 1] <= band[1])]
    stable = np.zeros(len(poles), dtype=np.bool_)
    for ring in decay.taken.rings:
        near = np.abs(poles[:, 1] / ring.frequency - 1.0) < 0.01
        stable |= near & np.isin(poles[:, 0], ring.orders)
    axes.plot(
        poles[~stable, 1], poles[~stable, 0], linestyle="", marker="o", markersize=3.2,
        markerfacecolor="none", markeredgecolor="0.6", label="not taken",
    )  # fmt: skip
    axes.plot(
        poles[stable, 1], poles[stable, 0], linestyle="", marker="o", markersize=3.6,
        color=PLANNED, label="a mode",
    )  # fmt: skip
    _lines(axes, found)
    axes.set_xlim(*_shown(found, band))
    axes.set_ylim(0.0, float(poles[:, 0].max(initial=1.0)) + 6.0)
    axes.legend(frameon=False, fontsize=7.5, loc="upper right", ncols=2)
    label_part(axes, "(c) its poles, order by order", "frequency [Hz]", "order")


def _spectrum(
    axes: Axes,
    record: Record,
    c: int,
    decay: Decay,
    found: Identification,
    band: tuple[float, float],
) -> None:
    """Spectra of the decay and of its fit, the modes named."""
    first = int((decay.begin - record.begin) * record.rate)
    last = int((decay.end - record.begin) * record.rate)
    measured = record.values[c, first:last]
    fit = decay.taken.fit[c]
    low, high = _shown(found, band)
    top = 0.0
    for values, rate, style in (
        (measured, record.rate, {"color": "0.45", "linewidth": 1.1, "label": "measured"}),
        (
            fit,
            len(fit) / (decay.end - decay.begin),
            {"color": PLANNED, "linewidth": 1.2, "linestyle": (0, (4, 1.2)), "label": "modes"},
        ),
    ):
        f, size = _amplitudes(values, rate)
        inside = (f >= low) & (f <= high)
        axes.semilogy(f[inside], size[inside], **style)
        top = max(top, float(size[inside].max(initial=0.0)))
    _lines(axes, found)
    axes.set_xlim(low, high)
    axes.set_ylim(DEPTH * top, 6.0 * top)
    for mode in found.held:
        if low <= mode.frequency <= high:
            axes.annotate(
                f"{mode.frequency:.1f} Hz\n{100.0 * mode.damping:.1f} %",
                (mode.frequency, 2.0 * top), (2, 0), textcoords="offset points", fontsize=7.0,
                color=TODAY,
            )  # fmt: skip
    axes.legend(frameon=False, fontsize=7.5, loc="lower left")
    label_part(axes, "(d) its spectrum, and the modes identified", "frequency [Hz]", "[mm/s]")


def _amplitudes(values: Array, rate: float) -> tuple[Array, Array]:
    """Frequencies [Hz], and what is at them [mm/s]; half a window, since a decay ends by itself."""
    window = np.cos(0.5 * np.pi * np.arange(len(values)) / len(values)) ** 2
    count = PADDED * 2 ** int(np.ceil(np.log2(max(len(values), 2))))
    size: Array = np.abs(np.fft.rfft((values - values.mean()) * window, count)) / rate
    f: Array = np.fft.rfftfreq(count, 1.0 / rate).astype(np.float64)
    return f, size


def _shown(found: Identification, band: tuple[float, float]) -> tuple[float, float]:
    """Frequencies to draw: not much more than there are modes at."""
    highest = max((mode.frequency for mode in found.modes), default=band[1])
    return band[0], min(band[1], max(1.6 * highest, 60.0))


def _lines(axes: Axes, found: Identification) -> None:
    for mode in found.modes:
        colour = "0.75" if mode.problem else TODAY
        axes.axvline(mode.frequency, color=colour, linewidth=0.9, linestyle=":", zorder=0)


def plot_peaks(
    found: Sequence[Peaks], band: tuple[float, float], file: BinaryIO, suffix: str
) -> None:
    """Draw spectra, their peaks named.

    Parameters
    ----------
    found : sequence of Peaks
    band : (float, float)
        That was looked at. [Hz]
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    figure = new_figure(suffix, (7.2, 1.2 + 2.4 * len(found)), 200)
    rows = figure.subplots(len(found), 1, squeeze=False)[:, 0]
    for axes, one in zip(rows, found, strict=True):
        f = one.spectrum.frequency
        inside = (f >= band[0]) & (f <= band[1])
        for name, values in zip(one.spectrum.channels, one.spectrum.values, strict=True):
            if len(one.spectrum.channels) > 1:
                axes.plot(
                    f[inside], values[inside], linewidth=0.8, label=shown_name(name), alpha=0.75
                )
        axes.plot(f[inside], one.total[inside], color=PLANNED, linewidth=1.4, label="together")
        for peak in one.peaks:
            k = int(np.argmin(np.abs(f - peak.frequency)))
            axes.annotate(
                f"{peak.frequency:.0f}", (peak.frequency, one.total[k]), (0, 3),
                textcoords="offset points", ha="center", fontsize=7.5, color=TODAY,
            )  # fmt: skip
        axes.set_xlim(*band)
        axes.set_ylim(bottom=0.0, top=1.12 * float(one.total[inside].max()))
        axes.legend(frameon=False, fontsize=7.5)
        axes.ticklabel_format(axis="y", style="plain")
        axes.set_yticks([])
        label_part(
            axes, shown_name(Path(one.spectrum.name).name), "frequency [Hz]", "power density"
        )
    save(figure, file, suffix)
