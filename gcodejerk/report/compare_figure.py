"""The picture of a comparison: profiles, vibration after arrival, residual against frequency.

After Figs. 9, 10 and 12 of the paper, sized for the two columns of a journal's page. Above, a lane
for each one who is shown, all to the same scale: its acceleration, and beside it what is left when
it has arrived. Below, what a mode of any frequency would keep. matplotlib is an optional extra and
is imported inside the functions that draw.

Rule: who is shown in colour has the same colour in all parts, in every picture; everyone else is
thin and grey in the lowest part alone, and the table names them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.machine import Mode
from gcodejerk.motion import mode_poles, profiles_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.shapers import SHAPERS
from gcodejerk.planning.arrival import arrival_response
from gcodejerk.report.figures import acceleration_curve, new_figure
from gcodejerk.studies.comparison import Candidate, Comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MS, UM = 1e3, 1e3
STYLES: dict[str, tuple[str, Any, float]] = {
    "conventional": ("#000000", "-", 1.2),
    "condition3": ("#0072b2", "-", 1.2),
    "cascade": ("#009e73", (0, (5, 1.2)), 1.2),
    "optimal": ("#d55e00", "-", 1.4),
    "shortest": ("#b3558f", (0, (4, 1, 1, 1)), 1.4),
}
"""Colour (after Okabe and Ito, Color Universal Design, 2008), line and width of the designs."""
SHAPER_STYLES: tuple[tuple[str, Any, float], ...] = (
    ("#c98500", (0, (1, 1)), 1.4),
    ("#3d9bd1", (0, (3, 1.2)), 1.2),
)
"""Of the two shapers that are shown: the fastest and the most robust."""
OTHERS: dict[str, Any] = {"color": "0.75", "linewidth": 0.6, "zorder": 1}
WIDTH, HEIGHT = 7.2, 7.0
"""Two columns of a journal's page. [inch]"""
TEXT = 8.0
LANE = 0.42
"""Half of a lane's curve, of the distance of lanes."""
FREQUENCIES = 1601
"""Points of a curve over the frequency."""
FLOOR = 1e-5
"""The residual's scale ends at this share of its largest: below is nothing."""
PERIODS = 5.0
"""Periods of the mode that is shaken most, shown after arrival."""
ROOM = 0.44
"""Beyond these, as a share of what is shown, for the words of the lanes."""
NOTABLE = 0.1
"""The scale ends where the lines of a spectrum stay below this share of the largest."""
CROWDED = 1.28
"""Modes whose frequencies differ by a smaller factor are named one above the other."""
TICKS = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0)
"""Frequencies that are named, times powers of ten."""


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
    figure = new_figure(suffix, (WIDTH, HEIGHT))
    figure.set_layout_engine("constrained", w_pad=0.07)
    places = figure.subplot_mosaic(
        [["a", "b"], ["c", "c"]], height_ratios=[1.45, 1.0], width_ratios=[1.0, 1.15]
    )
    drawing = _Drawing(comparison)
    for letter, axes, draw in (
        ("a", places["a"], drawing.profiles),
        ("b", places["b"], drawing.vibrations),
        ("c", places["c"], drawing.frequencies),
    ):
        title = draw(axes)
        axes.set_title(f"({letter}) {title}", fontsize=TEXT, loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        axes.tick_params(labelsize=TEXT)
        axes.xaxis.label.set_fontsize(TEXT)
        axes.yaxis.label.set_fontsize(TEXT)
    figure.legend(
        *drawing.legend(), loc="outside lower center", ncols=4, fontsize=TEXT, frameon=False,
        handlelength=3.2, columnspacing=1.8,
    )  # fmt: skip
    figure.suptitle(drawing.title, fontsize=TEXT + 1.0)
    figure.savefig(file, format=suffix.lower().removeprefix("."), dpi=300)


class _Drawing:
    """The parts of the picture, and who is shown how; a part returns its title."""

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self.styles = dict(STYLES)
        for name, style in zip(_best_shapers(comparison), SHAPER_STYLES, strict=False):
            self.styles[name] = style
        there = {c.name: c for c in comparison.candidates}
        self.shown = [there[name] for name in self.styles if name in there]
        self.others = [c for c in comparison.candidates if c.name not in self.styles]
        self.axis = comparison.longest
        column = comparison.share[:, AXES.index(self.axis)]
        self.profile = int(np.argmax(np.abs(column)))
        self.length = float(column[self.profile])
        rotary = comparison.machine.axis(self.axis).rotary
        self.unit, self.small = ("deg", "deg/1000") if rotary else ("mm", "µm")

    @property
    def moved(self) -> str:
        """The axis that moves farthest, and how far."""
        return f"{self.axis} {self.length:g} {self.unit}"

    @property
    def title(self) -> str:
        """The move and the machine."""
        moved = ", ".join(
            f"{axis} {length:g} {'deg' if self.comparison.machine.axis(axis).rotary else 'mm'}"
            for axis, length in self.comparison.displacement.items()
        )
        return f"{moved} — {self.comparison.machine.name}"

    def legend(self) -> tuple[list[Any], list[str]]:
        """Lines and names."""
        from matplotlib.lines import Line2D

        handles = [Line2D([], [], **self._style(candidate)) for candidate in self.shown]
        words = [candidate.name for candidate in self.shown]
        if self.others:
            handles.append(Line2D([], [], **OTHERS))
            words.append("all others")
        return handles, words

    def _style(self, candidate: Candidate) -> dict[str, Any]:
        colour, line, width = self.styles[candidate.name]
        return {"color": colour, "linestyle": line, "linewidth": width}

    def _lanes(self, axes: Axes, named: bool) -> None:
        """A line at zero for each lane; the names and times of who has it."""
        count = len(self.shown)
        for k in range(count):
            axes.axhline(-k, color="0.85", linewidth=0.6, zorder=0)
        axes.set_ylim(-count + 1 - 1.6 * LANE, 1.6 * LANE)
        axes.spines["left"].set_visible(False)
        words = [f"{c.name}\n{MS * c.time:.4g} ms" for c in self.shown] if named else []
        axes.set_yticks(-np.arange(count)[: len(words)], words)
        axes.tick_params(axis="y", length=0)
        for label, candidate in zip(axes.get_yticklabels(), self.shown, strict=False):
            label.set_color(self.styles[candidate.name][0])

    def _bar(self, axes: Axes, value: float, scale: float, unit: str) -> None:
        """How much a piece of the first lane is."""
        axes.plot(
            [1.012, 1.012], [0.0, LANE * value / scale], transform=axes.get_yaxis_transform(),
            color="0.3", linewidth=1.6, solid_capstyle="butt", clip_on=False,
        )  # fmt: skip
        axes.annotate(
            f"{value:g}\n{unit}", (1.012, 0.5 * LANE * value / scale), (3, 0),
            xycoords=axes.get_yaxis_transform(), textcoords="offset points", ha="left",
            va="center", fontsize=TEXT - 1.5, color="0.3",
        )  # fmt: skip

    def profiles(self, axes: Axes) -> str:
        """Acceleration of the axis that moves farthest."""
        curves = []
        for candidate in self.shown:
            t, a = acceleration_curve(
                candidate.profiles.take(slice(self.profile, self.profile + 1))
            )
            curves.append((t, self.length * a))
        scale = max(float(np.abs(a).max()) for _, a in curves)
        for k, (candidate, (t, a)) in enumerate(zip(self.shown, curves, strict=True)):
            colour = self.styles[candidate.name][0]
            axes.fill_between(MS * t, -k, LANE * a / scale - k, color=colour, alpha=0.15, lw=0)
            axes.plot(MS * t, LANE * a / scale - k, color=colour, linewidth=0.9)
        self._lanes(axes, named=True)
        self._bar(axes, _round_below(scale), scale, f"{self.unit}/s²")
        axes.set_xlim(0.0, MS * 1.02 * max(c.time for c in self.shown))
        axes.set_xlabel("time [ms]")
        return f"acceleration of {self.axis}"

    def vibrations(self, axes: Axes) -> str:
        """The tool's vibration from each one's arrival on."""
        comparison, modes = self.comparison, self.comparison.modes
        weights = comparison.share @ modes.participation.T
        strongest = int(np.argmax(comparison["conventional"].displacement))
        first, last = (f(c.time for c in self.shown) for f in (min, max))
        end = last + PERIODS / modes.modes[strongest].frequency
        fastest = float(modes.poles.imag.max()) / (2.0 * np.pi)
        curves = []
        for candidate in self.shown:
            count = int(np.clip(30.0 * fastest * (end - candidate.time), 400, 8000))
            t = np.linspace(0.0, end - candidate.time, count)
            response = arrival_response(candidate.profiles, weights, modes.poles) / modes.poles.imag
            swing = np.zeros(count)
            for pole, amplitude in zip(modes.poles, response, strict=True):
                swing -= (amplitude * np.exp(pole * t)).imag
            curves.append((candidate.time + t, swing))
        scale = max(float(np.abs(swing).max()) for _, swing in curves) or 1.0
        for k, (candidate, (t, swing)) in enumerate(zip(self.shown, curves, strict=True)):
            colour = self.styles[candidate.name][0]
            axes.plot(MS * t, LANE * swing / scale - k, color=colour, linewidth=0.9)
            axes.plot(MS * t[0], LANE * swing[0] / scale - k, "o", color=colour, markersize=3)
            axes.annotate(
                _settled(candidate), (1.0, 0.14 - k), xycoords=axes.get_yaxis_transform(),
                ha="right", va="center", fontsize=TEXT - 1.5, color=colour,
            )  # fmt: skip
        self._lanes(axes, named=False)
        self._bar(axes, _round_below(UM * scale), UM * scale, self.small)
        axes.set_xlim(MS * (first - 0.03 * (end - first)), MS * (end + ROOM * (end - first)))
        axes.set_xlabel("time since the start [ms]")
        tolerance = UM * comparison.machine.design.tolerance
        return f"vibration after arrival; settled: below {tolerance:g} {self.small}"

    def frequencies(self, axes: Axes) -> str:
        """What a mode of any frequency would keep, and where the machine's own modes are."""
        modes = self.comparison.modes
        weights = np.abs(modes.participation @ self.comparison.share[self.profile]) / abs(
            self.length
        )
        own: list[tuple[Mode, float]] = []
        lines: list[Array] = []
        for g in self.comparison.excited:
            here = modes.group == g
            if not weights[here].any():
                continue
            if np.count_nonzero(here) > 1:
                # Only an axis has a spectrum.
                spectrum = self.comparison.machine.axis(modes.labels[g]).spectrum
                assert spectrum is not None
                lines.append(np.array([spectrum.frequency, spectrum.weight]))
            else:
                own.append((modes.modes[g], float(weights[here][0])))
        frequency = _range([m.frequency for m, _ in own], lines)
        poles = mode_poles(frequency, _damping(frequency, [m for m, _ in own]))
        top = 0.0
        for candidate in (*self.others, *self.shown):
            profile = candidate.profiles.take(slice(self.profile, self.profile + 1))
            D = UM * abs(self.length) * np.abs(profiles_response(profile, poles)[0]) / poles.imag
            top = max(top, float(D.max()))
            style = OTHERS if candidate in self.others else self._style(candidate)
            axes.plot(frequency, D, **style)
        tolerance = UM * self.comparison.machine.design.tolerance
        lowest = tolerance / max([1.0, *(weight for _, weight in own)])
        axes.set_yscale("log")
        axes.set_xscale("log")
        axes.set_ylim(max(FLOOR * top, min(0.1 * lowest, 0.1 * top)), 2.0 * top)
        axes.set_xlim(frequency[0], frequency[-1])
        self._modes(axes, own, tolerance)
        for f, weight in lines:
            axes.fill_between(
                f, 0.0, 0.5 * weight / weight.max(), transform=axes.get_xaxis_transform(),
                color="0.88", linewidth=0, zorder=0.5,
            )  # fmt: skip
        ticks = [t * 10.0**k for k in range(-1, 5) for t in TICKS]
        ticks = [t for t in ticks if frequency[0] <= t <= frequency[-1]]
        axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
        axes.set_xticks([], minor=True)
        axes.grid(True, color="0.94", linewidth=0.5)
        axes.set_axisbelow(True)
        axes.set_xlabel("natural frequency [Hz]")
        axes.set_ylabel(f"residual displacement [{self.small}]")
        about = f"{self.moved}, participation 1"
        if own:
            band = 100.0 * self.comparison.machine.design.band
            return (
                f"residual of a mode of any frequency ({about}); grey: modes ±{band:g} %, "
                f"bar: settled"
            )
        return f"residual of a mode of any frequency ({about}); grey: measured spectrum"

    def _modes(self, axes: Axes, own: list[tuple[Mode, float]], tolerance: float) -> None:
        """The modes: line, name, the band of their error, and what counts as settled there."""
        band = self.comparison.machine.design.band
        raised, before = False, 0.0
        for mode, weight in sorted(own, key=lambda pair: pair[0].frequency):
            f = mode.frequency
            low, high = (1.0 - band) * f, (1.0 + band) * f
            axes.axvspan(low, high, color="0.91", linewidth=0, zorder=0)
            axes.axvline(f, color="0.55", linewidth=0.6, zorder=0.5)
            gate = tolerance / weight
            axes.plot([low, high], [gate, gate], color="black", linewidth=1.6, zorder=6)
            raised = not raised and f < CROWDED * before
            before = f
            named = mode.name if mode.name.endswith("Hz") else f"{mode.name} {f:g} Hz"
            axes.annotate(
                named, (f, 0.9 if raised else 0.985), xycoords=axes.get_xaxis_transform(),
                ha="center", va="top", fontsize=TEXT - 1.5, color="0.2", zorder=7,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8},
            )  # fmt: skip


def _range(modes: list[float], lines: list[Array]) -> Array:
    """From half the lowest mode to twice the highest, and all notable lines, the modes exactly."""
    wide = [factor * f for f in modes for factor in (0.5, 2.0)]
    every = np.concatenate([np.array(wide), *(f[w > NOTABLE * w.max()] for f, w in lines)])
    even = np.geomspace(every.min(), every.max(), FREQUENCIES)
    return np.unique(np.concatenate([even, modes]))


def _damping(frequency: Array, modes: list[Mode]) -> Array:
    """Damping interpolated between modes, exact at each; none where there are none."""
    order = sorted(modes, key=lambda m: m.frequency)
    if not order:
        return np.zeros(len(frequency))
    return np.interp(frequency, [m.frequency for m in order], [m.damping for m in order])


def _round_below(value: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * 1.001))


def _settled(candidate: Candidate) -> str:
    """When all is still, in the words of a lane."""
    if candidate.settling is None:
        return "never settles"
    ms = MS * candidate.settling
    return f"settled at {ms:.0f} ms" if ms >= 100.0 else f"settled at {ms:.3g} ms"


def _best_shapers(comparison: Comparison) -> list[str]:
    """The shaper that lets the machine settle first, and the one that bears most error."""
    shapers = [c for c in comparison.candidates if c.name in SHAPERS]
    settled = min(shapers, key=lambda c: (c.settling is None, c.settling or 0.0, c.time))
    robust = min(shapers, key=lambda c: c.worst_band[-1])
    if robust is settled:
        robust = min((c for c in shapers if c is not settled), key=lambda c: c.worst_band[-1])
    return [settled.name, robust.name]
