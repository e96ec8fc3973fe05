"""The picture of an amplitude map, after the paper's Fig. 8.

T1 to the right, T_SUM upwards, the amplitude as colour; over it what decides: where no profile
exists, where a limit binds, where the mode is left at rest, and the point that would be chosen.
matplotlib is an optional extra and is imported inside the functions that draw.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.report.figures import new_figure
from gcodejerk.studies.amplitude_map import Chosen, Survey

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]

MS, UM = 1e3, 1e3
COLOURS = "viridis"
"""Even steps for the eye, in print and for colour-blind readers; dark is still."""
LIMIT, NULL, POINT = "#d62728", "white", "#ff9d2e"
TEXT = 8.5
POINTS = 700
"""Of each axis of a picture."""
MOST_BRANCHES = 12
"""More null curves than these hide the map, whose valleys show them as well."""
SHORTEST_NAMED = 0.15
"""A line below this part of the picture's size has no room for its name."""
BRIGHTEST = 1.6
"""The colours end at this times what the controller's own G0 leaves."""


def plot_map(
    survey: Survey, file: BinaryIO, suffix: str, points: int = POINTS, longest: float | None = None
) -> None:
    """Draw the map of a survey.

    Parameters
    ----------
    survey : Survey
        The move, and the modes it is judged by.
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.
    points : int, optional
        Of each axis of the map.
    longest : float, optional
        End of T_SUM; by default the conventional time stands well inside. [s]

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    PlanError
        The longest time leaves no room.
    """
    figure = new_figure(suffix, (7.4, 5.6))
    T1, T = survey.axes(points, longest)
    axes = figure.subplots()
    drawing = _Drawing(survey, axes, T1, T)
    image = drawing.amplitudes()
    drawing.nothing_there()
    drawing.limits()
    drawing.nulls()
    drawing.conventional()
    drawing.chosen()
    bar = figure.colorbar(image, ax=axes, extend="max", pad=0.05)
    bar.set_label(drawing.quantity)
    bar.ax.annotate(
        "G0\ntoday", (0.0, drawing.scale * survey.conventional_value), (-11, 0),
        xycoords=("axes fraction", "data"), textcoords="offset points", ha="right", va="center",
        fontsize=7.5, arrowprops={"arrowstyle": "-|>", "facecolor": "black", "shrinkA": 0,
                                  "shrinkB": 0},
    )  # fmt: skip
    axes.set_title(drawing.title, fontsize=10.5, loc="left")
    axes.set_xlabel("T1 [ms]")
    axes.set_ylabel("T_SUM [ms]")
    axes.set_xlim(0.0, 0.5 * MS * T[-1])
    axes.set_ylim(MS * T[0], MS * T[-1])
    drawing.legend()
    figure.savefig(file, format=suffix.lower().removeprefix("."), dpi=160)


class _Drawing:
    """What is drawn into the axes, layer by layer, in milliseconds."""

    def __init__(self, survey: Survey, axes: Axes, T1: Array, T: Array) -> None:
        self.survey, self.axes, self.T1, self.T = survey, axes, T1, T
        self.values = survey.values(T1, T)
        self.best = survey.choose()
        self.scale = 1.0 if survey.mode is not None else UM
        unit = "mm/s²" if survey.mode is not None else "µm"
        if survey.axis.rotary:
            unit = "deg/s²" if survey.mode is not None else "deg/1000"
        what = "acceleration amplitude" if survey.mode is not None else "worst displacement"
        self.quantity = f"{what} after the move [{unit}]"

    @property
    def title(self) -> str:
        """Axis, length, condition and mode."""
        survey = self.survey
        if survey.mode is not None:
            m = survey.mode
            judged = f"mode {m.name}, {m.frequency:g} Hz, damping {m.damping:g}"
            if m.name == f"{m.frequency:g} Hz":
                judged = f"mode of {m.frequency:g} Hz, damping {m.damping:g}"
        else:
            judged = f"all {len(survey.modes)} modes that {survey.axis.name} excites"
        moved = f"{survey.axis.name} {survey.length:g} {survey.unit}"
        return f"{moved}, Condition {survey.condition}, {judged}\n{survey.machine.name}"

    def amplitudes(self) -> Any:
        """The map itself."""
        from matplotlib.colors import PowerNorm

        shown = self.scale * self.values
        top = BRIGHTEST * self.scale * self.survey.conventional_value
        if not top > 0.0:
            top = float(np.nanmax(shown))
        # A root spreads the low amplitudes, where the valleys are.
        return self.axes.pcolormesh(
            MS * self.T1, MS * self.T, shown, norm=PowerNorm(0.5, 0.0, top), cmap=COLOURS,
            shading="nearest", rasterized=True,
        )  # fmt: skip

    def nothing_there(self) -> None:
        """T1 of T_SUM/2 and more."""
        end = 0.5 * MS * self.T[-1]
        low = MS * self.T[0]
        corner = [(0.5 * low, low), (end, MS * self.T[-1]), (end, low)]
        self.axes.fill(
            *zip(*corner, strict=True), facecolor="0.93", edgecolor="0.75", hatch="////",
            linewidth=0.0, zorder=2,
        )  # fmt: skip
        self.axes.plot([0.5 * low, end], [low, 2.0 * end], color="0.35", linewidth=0.9, zorder=4)
        self.axes.annotate(
            "no profile: T1 ≥ T_SUM/2", (0.97, 0.06), xycoords="axes fraction", ha="right",
            va="bottom", fontsize=TEXT, color="0.2", zorder=5,
            bbox={"facecolor": "0.93", "edgecolor": "none", "pad": 2.0},
        )  # fmt: skip

    def limits(self) -> None:
        """Where a limit is broken, and the edge of that with the limit's name."""
        use = self.survey.use(self.T1, self.T)
        worst = np.maximum.reduce(list(use))
        broken = np.where(worst > 1.0, 1.0, np.nan)
        if np.isfinite(broken).any():
            self.axes.contourf(
                MS * self.T1, MS * self.T, np.nan_to_num(worst), levels=[1.0, np.inf],
                colors=["white"], alpha=0.38, zorder=1,
            )  # fmt: skip
        ms = MS * self.T1, MS * self.T
        if not np.nanmin(worst) <= 1.0 <= np.nanmax(worst):
            return
        self.axes.contour(*ms, worst, levels=[1.0], colors=[LIMIT], linewidths=1.5, zorder=3)
        for name, part in zip(("velocity", "acceleration", "jerk"), use, strict=True):
            # The name stands where this limit is the one that binds.
            binding = np.where(part >= 0.995 * worst, part, np.nan)
            there = binding[np.isfinite(binding)]
            if not there.size or not there.min() <= 1.0 <= there.max():
                continue
            lines = self.axes.contour(*ms, binding, levels=[1.0], linewidths=0.0)
            paths = [
                np.asarray(line) for line in lines.get_paths()[0].to_polygons(closed_only=False)
            ]
            self._name(paths, f"{name} limit")

    def _seen(self, points: Array) -> Array:
        """Points as parts of the picture's width and height."""
        low, high = [0.0, MS * self.T[0]], [0.5 * MS * self.T[-1], MS * self.T[-1]]
        return np.asarray((points - low) / np.subtract(high, low))

    def _name(self, paths: list[Array], text: str) -> None:
        """Write a name along one of some lines, where it is farthest from all that is marked."""
        best, place, angle = 0.0, np.zeros(2), 0.0
        for path in paths:
            seen = self._seen(path)
            along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
            if along[-1] < SHORTEST_NAMED:
                continue
            for part in (0.2, 0.35, 0.5, 0.65, 0.8):
                # Straight pieces have no points between their ends.
                here = np.array([part - 0.1, part, part + 0.1]) * along[-1]
                points = np.stack([np.interp(here, along, path[:, k]) for k in (0, 1)], axis=1)
                room = self._room(points[1])
                if room > best:
                    best, place = room, points[1]
                    angle = float(np.degrees(np.arctan2(*(points[2] - points[0])[::-1])))
        if best > 0.0:
            # A line along the left border is named beside it.
            self.axes.text(
                max(place[0], 0.01 * MS * self.T[-1]), place[1], text,
                rotation=(angle + 90.0) % 180.0 - 90.0,
                transform_rotates_text=True, fontsize=TEXT, color=LIMIT, ha="center",
                va="center", zorder=5, rotation_mode="anchor", clip_on=True,
                bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1.0},
            )  # fmt: skip

    def _room(self, point: Array) -> float:
        """Distance from the borders and from the chosen point, as a part of the picture."""
        seen = self._seen(point)
        room = float(np.minimum(seen, 1.0 - seen).min())
        if self.best is not None:
            marked = self._seen(MS * np.array([self.best.T1, self.best.T_SUM]))
            room = min(room, float(np.hypot(*(seen - marked))))
        return room

    def nulls(self) -> None:
        """The analytic null curve of Condition III."""
        from matplotlib.patheffects import Normal, Stroke

        # Visible on dark colours and in the legend's white.
        outline = [Stroke(linewidth=2.3, foreground="black"), Normal()]
        mode = self.survey.dominant
        label = f"null of {mode.frequency:g} Hz (analytic, no damping)"
        fine = np.linspace(self.T[0], self.T[-1], 4 * len(self.T))
        branches = self.survey.nulls(fine)
        if len(branches) > MOST_BRANCHES:
            return
        for branch in branches:
            if np.isfinite(branch).any():
                self.axes.plot(
                    MS * branch, MS * fine, color=NULL, linewidth=1.3, linestyle=(0, (5, 2)),
                    label=label, zorder=3, path_effects=outline,
                )  # fmt: skip
                label = "_"

    def conventional(self) -> None:
        """T1 = T_SUM/4 and the time that the controller's own G0 takes."""
        T, own = MS * self.T, MS * self.survey.time
        self.axes.plot(
            0.25 * T, T, color="black", linewidth=1.0, linestyle=(0, (1, 1.5)),
            label="four equal segments, T1 = T_SUM/4", zorder=3,
        )  # fmt: skip
        self.axes.plot(
            [0.0, 0.5 * own], [own, own], color="black", linewidth=1.0, linestyle=(0, (6, 2, 1, 2)),
            label=f"conventional T_SUM, {own:.6g} ms", zorder=3,
        )  # fmt: skip

    def chosen(self) -> None:
        """The best point within the limits."""
        chosen = self.best
        if chosen is None or not self.T[0] <= chosen.T_SUM <= self.T[-1]:
            return
        self.axes.plot(
            MS * chosen.T1, MS * chosen.T_SUM, marker="o", markersize=8, color=POINT,
            markeredgecolor="black", markeredgewidth=1.0, linestyle="none", zorder=6,
            label=self._words(chosen), clip_on=False,
        )  # fmt: skip

    def _words(self, chosen: Chosen) -> str:
        """The chosen point and what it gains."""
        unit = self.quantity.partition("[")[2].rstrip("]")
        now, then = self.scale * self.survey.conventional_value, self.scale * chosen.value
        return (
            f"best within the limits, T1 ≥ {MS * self.survey.machine.interval:g} ms:\n"
            f"T1 {MS * chosen.T1:.4g} ms, T_SUM {MS * chosen.T_SUM:.6g} ms; "
            f"{_short(now)} (G0 today) → {_short(then)} {unit}"
        )

    def legend(self) -> None:
        """Below the axes, so that it hides nothing."""
        self.axes.figure.legend(
            *self.axes.get_legend_handles_labels(), loc="outside lower left", ncols=2,
            fontsize=TEXT, frameon=False, handlelength=3.0,
        )  # fmt: skip


def _short(value: float) -> str:
    """Four digits, without an exponent where the number is large."""
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.4g}"
