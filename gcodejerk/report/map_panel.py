"""One amplitude map in its axes: colours, limits, nulls, times and the points that are marked.

T_1 to the right, T_SUM upwards, both in milliseconds, the amplitude as colour; over it what
decides. `map_figure` makes pages of one or three of these. matplotlib is imported inside the
functions that draw.

Rule: a line that needs a name has it where it is farthest from all that is already there; what is
drawn tells where it went (`_taken`), so that the next name keeps away from it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Mode
from gcodejerk.report.figures import shown_name
from gcodejerk.studies.amplitude_map import Chosen, Survey

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Normalize

Array = NDArray[np.float64]

MS, UM = 1e3, 1e3
COLOURS = "viridis"
"""Even steps for the eye, in print and for colour-blind readers; dark is still."""
LIMIT, NULL, POINT = "#c1121f", "white", "#ff9d2e"
DARK = "#3b2a63"
"""As the valleys that the nulls run through: under what is white in legends and names."""
TEXT, NAME = 8.5, 7.5
MOST_LISTED = 4
"""Modes whose frequencies are named in one entry of the legend."""
MOST_BRANCHES = 12
"""More null curves of a mode than these hide the map, whose valleys show them as well."""
DASHES: tuple[Any, ...] = ((0, (5, 2)), (0, (1.5, 1.2)), (0, (8, 1.5, 1.5, 1.5)), (0, (2.5, 3)))
"""Of the nulls of the first mode, the second and so on; then from the front."""
LETTER = 0.31
"""Half the width of a letter, of its size."""
OBSTACLES = 80
"""Points of a line that a name keeps away from."""
PLENTY = 40.0
"""A name with this distance to all else needs no better place. [pt]"""
BRIGHTEST = 1.6
"""The colours end at this times what the controller's own G0 leaves."""
T_1, T_SUM = "$T_1$", r"$T_\mathrm{SUM}$"


def colour_scale(survey: Survey, values: list[Array]) -> Normalize:
    """Colours for maps of a move; a root spreads the low amplitudes, where the valleys are."""
    from matplotlib.colors import PowerNorm

    top = BRIGHTEST * scale_of(survey) * survey.conventional_value
    if not top > 0.0:
        top = scale_of(survey) * max(float(np.nanmax(value)) for value in values)
    return PowerNorm(0.5, 0.0, top)


def scale_of(survey: Survey) -> float:
    """From what a survey says to what is shown."""
    return 1.0 if survey.mode is not None else UM


def unit_of(survey: Survey) -> str:
    """Unit of what is shown; a mode by itself has that of its axis, all together move the tool."""
    if survey.mode is None:
        return "µm"
    return "deg/s²" if survey.axis.rotary else "mm/s²"


class MapPanel:
    """What is drawn into one pair of axes, layer by layer.

    Attributes
    ----------
    survey : Survey
        The move.
    best, free : Chosen or None
        The best point within the limits, and that of the conventional time without them.
    entries : dict of str to handle
        Lines and patches for a legend, by their words.
    """

    def __init__(self, survey: Survey, axes: Axes, T1: Array, T: Array, values: Array) -> None:
        self.survey, self.axes, self.T1, self.T, self.values = survey, axes, T1, T, values
        self.best, self.free = survey.choose(), survey.choose_freely()
        self.entries: dict[str, Any] = {}
        self._taken: list[Array] = []
        self._named: list[tuple[list[Array], str, str]] = []
        self._marks = MS * np.array(
            [[c.T1, c.T_SUM] for c in (self.best, self.free) if c is not None]
        ).reshape(-1, 2)

    def draw(self, norm: Normalize, *, free: bool = False) -> Any:
        """Draw all layers.

        Parameters
        ----------
        norm : Normalize
            Of the colours.
        free : bool, optional
            Whether the best point of the conventional time without limits is marked too.

        Returns
        -------
        QuadMesh
            For the colour bar.
        """
        image = self.axes.pcolormesh(
            MS * self.T1, MS * self.T, scale_of(self.survey) * self.values, norm=norm,
            cmap=COLOURS, shading="nearest", rasterized=True,
        )  # fmt: skip
        self._nothing_there()
        self._conventional()
        self._limits()
        self._nulls()
        self._points(free)
        self.axes.set_xlim(0.0, 0.5 * MS * self.T[-1])
        self.axes.set_ylim(MS * self.T[0], MS * self.T[-1])
        self.axes.set_xlabel(f"{T_1} [ms]")
        return image

    def _nothing_there(self) -> None:
        """T1 of T_SUM/2 and more."""
        end, low = 0.5 * MS * self.T[-1], MS * self.T[0]
        corner = [(0.5 * low, low), (end, MS * self.T[-1]), (end, low)]
        self.axes.fill(*zip(*corner, strict=True), facecolor="0.93", linewidth=0.0, zorder=2)
        self.axes.plot([0.5 * low, end], [low, 2.0 * end], color="0.35", linewidth=0.9, zorder=4)
        self.axes.annotate(
            f"no profile:\n{T_1} ≥ {T_SUM}/2", (0.97, 0.04), xycoords="axes fraction", ha="right",
            va="bottom", fontsize=TEXT, color="0.2", zorder=5,
        )  # fmt: skip

    def _conventional(self) -> None:
        """T1 = T_SUM/4 and the time that the controller's own G0 takes."""
        T, own = MS * self.T, MS * self.survey.time
        (line,) = self.axes.plot(
            0.25 * T, T, color="black", linewidth=1.1, linestyle=(0, (1, 1.5)), zorder=3
        )
        self.entries[f"four equal segments, {T_1} = {T_SUM}/4"] = line
        self._take(np.stack([0.25 * T, T], axis=1))
        (line,) = self.axes.plot(
            [0.0, 0.5 * own], [own, own], color="black", linewidth=1.1,
            linestyle=(0, (6, 2, 1, 2)), zorder=3,
        )  # fmt: skip
        self.entries[f"conventional {T_SUM}, {own:.6g} ms"] = line
        part = np.linspace(0.0, 0.5 * own, 50)
        self._take(np.stack([part, np.full(50, own)], axis=1))

    def _limits(self) -> None:
        """Where a limit is broken, and the edges of that with the limits' names."""
        from matplotlib.patches import Patch

        use = self.survey.use(self.T1, self.T)
        worst = np.maximum.reduce(list(use))
        ms = MS * self.T1, MS * self.T
        if not np.nanmax(worst) > 1.0:
            return
        # Whitened, and hatched: white on bright yellow alone is not seen.
        self.axes.contourf(
            *ms, np.nan_to_num(worst), levels=[1.0, np.inf], colors=["white"], alpha=0.38, zorder=1
        )
        hatched = self.axes.contourf(
            *ms, np.nan_to_num(worst), levels=[1.0, np.inf], colors=["none"], hatches=["///"],
            zorder=1.1,
        )  # fmt: skip
        hatched.set_edgecolor(LIMIT)
        hatched.set_linewidth(0.0)
        self.entries["beyond a limit of the axis"] = Patch(
            facecolor="#fdf5b5", edgecolor=LIMIT, hatch="///", linewidth=1.2
        )
        if np.nanmin(worst) > 1.0:
            return
        self.axes.contour(*ms, worst, levels=[1.0], colors=[LIMIT], linewidths=1.5, zorder=3)
        for name, part in zip(("velocity", "acceleration", "jerk"), use, strict=True):
            # The name stands where this limit is the one that binds.
            binding = np.where(part >= 0.995 * worst, part, np.nan)
            there = binding[np.isfinite(binding)]
            if not there.size or not there.min() <= 1.0 <= there.max():
                continue
            lines = self.axes.contour(*ms, binding, levels=[1.0], linewidths=0.0)
            for line in lines.get_paths()[0].to_polygons(closed_only=False):
                # Each piece: the limits of long and of short T1 look like different ones.
                points = np.asarray(line)
                self._named.append(([points], f"{name} limit", LIMIT))
                self._take(points)

    def _nulls(self) -> None:
        """Where each mode, were it without damping, is left at rest."""
        from matplotlib.patches import Patch

        fine = np.linspace(self.T[0], self.T[-1], 4 * len(self.T))
        crowded = []
        for k, mode in enumerate(sorted(self.survey.counted_modes, key=lambda m: m.frequency)):
            # A few of the times tell whether there are too many to draw: finding all is dear.
            few = len(self.survey.nulls(self.T[::16], mode)) <= MOST_BRANCHES
            curves = self._null_curves(mode, fine) if few else []
            if not few or len(curves) > MOST_BRANCHES:
                crowded.append(f"{mode.frequency:g}")
                continue
            if not curves:
                continue
            # The mode that matters most stands out, the others are there to be found.
            first = mode is self.survey.dominant
            style: dict[str, Any] = {"linewidth": 1.5, "path_effects": _outline(1.5)}
            if not first:
                style = {"linewidth": 0.8}
            for curve in curves:
                (line,) = self.axes.plot(
                    *curve.T, color=NULL, linestyle=DASHES[k % len(DASHES)],
                    zorder=3 if first else 2.5, **style,
                )  # fmt: skip
            own = mode.name == f"{mode.frequency:g} Hz"
            named = mode.name if own else f"{shown_name(mode.name, 24)}, {mode.frequency:g} Hz"
            # On the colour that it has in the map, where white is seen.
            patch = Patch(facecolor=DARK, edgecolor="none")
            self.entries[f"null of {named} (without damping)"] = (patch, line)
            self._named.append((curves, f"{mode.frequency:g} Hz", NULL))
        if crowded:
            listed = ", ".join(crowded)
            if len(crowded) > MOST_LISTED:
                listed = f"{len(crowded)} modes, {crowded[0]} to {crowded[-1]}"
            self.entries[
                f"nulls of {listed} Hz\n(Condition {self.survey.condition}): too many to be drawn"
            ] = Patch(facecolor="none", edgecolor="none")

    def _null_curves(self, mode: Mode, fine: Array) -> list[Array]:
        """Points of each curve that is seen, shape (k, 2), and their room is taken."""
        curves = []
        for branch in self.survey.nulls(fine, mode):
            there = np.isfinite(branch)
            if there.any():
                curves.append(MS * np.stack([branch[there], fine[there]], axis=1))
        for T in self.survey.null_times(self.T[-1], mode):
            if self.T[0] <= T:
                part = np.linspace(0.0, 0.5 * T, 100)
                curves.append(MS * np.stack([part, np.full(100, T)], axis=1))
        if len(curves) <= MOST_BRANCHES:
            for curve in curves:
                self._take(curve)
        return curves

    def _points(self, free: bool) -> None:
        """The best points, and how far a longer T_SUM is from the conventional one."""
        style: dict[str, Any] = {
            "markeredgecolor": "black", "linestyle": "none", "zorder": 6, "clip_on": False
        }  # fmt: skip
        best, own = self.best, self.survey.time
        if free and self.free is not None and self.free != best and self._shown(self.free):
            (mark,) = self.axes.plot(
                MS * self.free.T1, MS * self.free.T_SUM, marker="D", markersize=7,
                color="white", markeredgewidth=1.4, **style,
            )  # fmt: skip
            self.entries[f"best at the conventional {T_SUM}, limits left aside"] = mark
        if best is None or not self._shown(best):
            return
        if self.is_longer:
            self.axes.annotate(
                "", (MS * best.T1, MS * best.T_SUM), (MS * best.T1, MS * own),
                arrowprops={"arrowstyle": "-|>", "color": "black", "linewidth": 1.2,
                            "shrinkA": 0, "shrinkB": 5}, zorder=5,
            )  # fmt: skip
        (mark,) = self.axes.plot(
            MS * best.T1, MS * best.T_SUM, marker="o", markersize=8, color=POINT,
            markeredgewidth=1.0, **style,
        )  # fmt: skip
        self.entries["best within the limits"] = mark

    @property
    def is_longer(self) -> bool:
        """Whether the best point takes longer than the conventional profile."""
        own = self.survey.time
        return self.best is not None and own * (1.0 + 1e-9) < self.best.T_SUM

    def words(self, chosen: Chosen) -> str:
        """A point in words, and what it leaves."""
        return (
            f"{T_1} = {MS * chosen.T1:.4g} ms, {T_SUM} = {MS * chosen.T_SUM:.6g} ms: "
            f"{short(scale_of(self.survey) * chosen.value)} {unit_of(self.survey)}"
        )

    def outcome(self) -> str:
        """What is best within the limits, and a T_SUM that is not the conventional one."""
        if self.best is None:
            return "no profile keeps the limits, in whatever time"
        said = self.words(self.best)
        if self.is_longer:
            more = MS * (self.best.T_SUM - self.survey.time)
            said += f"\n({T_SUM} is {more:.4g} ms above the conventional)"
        if not self._shown(self.best):
            said += "\n(not on this map)"
        return said

    def _shown(self, chosen: Chosen) -> bool:
        return bool(self.T[0] <= chosen.T_SUM <= self.T[-1])

    def name_lines(self) -> None:
        """Write the names along limits and nulls; the axes have their place on the page by now."""
        for paths, text, colour in self._named:
            self._name(paths, text, colour)

    def _seen(self, points: Array) -> Array:
        """Where points are in the picture, from its lower left corner [pt]."""
        seen = np.asarray(self.axes.transData.transform(points)) - np.asarray(self.axes.bbox.p0)
        return np.asarray(seen / self._pixel)

    @property
    def _pixel(self) -> float:
        """Pixels of a point."""
        figure = self.axes.get_figure()
        assert figure is not None
        return figure.dpi / 72.0

    def _take(self, points: Array) -> None:
        """Names keep away from these points, if they can."""
        self._taken.append(points)

    def _name(self, paths: list[Array], text: str, colour: str) -> None:
        """Write a name along one of some lines, where it is farthest from all that is marked."""
        best: tuple[float, Array, float] | None = None
        # Where no piece is as long as the name, it may stand beside the middle of one.
        for long in (1.2, 0.0):
            for path in paths:
                # A mode's name keeps away from the mode's other curves too.
                others = [
                    taken[:: max(len(taken) // OBSTACLES, 1)]
                    for taken in self._taken
                    if taken is not path
                ]
                rest = self._seen(np.concatenate(others))
                for room, line, slope in self._places(self._seen(path), len(text), long, rest):
                    if best is None or room > best[0]:
                        best = room, line, slope
            if best is not None:
                break
        if best is None:
            return
        _, line, slope = best
        place, scale = line[len(line) // 2], self._pixel
        back = self.axes.transAxes.inverted().transform(
            np.asarray(self.axes.bbox.p0) + place * scale
        )
        self.axes.text(
            float(back[0]), float(back[1]), text, transform=self.axes.transAxes,
            rotation=(slope + 80.0) % 180.0 - 80.0, rotation_mode="anchor", ha="center",
            va="center", fontsize=NAME, color=colour, zorder=5, clip_on=True, in_layout=False,
            bbox={"facecolor": "white" if colour == LIMIT else DARK, "edgecolor": "none",
                  "alpha": 0.85, "pad": 1.0},
        )  # fmt: skip
        pixels = np.asarray(self.axes.bbox.p0) + line * scale
        self._marks = np.concatenate(
            [self._marks, self.axes.transData.inverted().transform(pixels)]
        )

    def _places(
        self, seen: Array, letters: int, long: float, others: Array
    ) -> Iterator[tuple[float, Array, float]]:
        """Where a name may stand along a line: its distance to others, its own line, its slope."""
        width, height = self._seen(
            np.array([[self.axes.get_xlim()[1], self.axes.get_ylim()[1]]])
        )[0]  # fmt: skip
        marks = self._seen(self._marks)
        half = LETTER * NAME * letters + 2.0
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
        if along[-1] < max(long * half, 4.0 * NAME):
            return
        for part in np.linspace(0.05, 0.95, 37):
            # Straight pieces have no points between their ends.
            here = part * along[-1] + np.array([-8.0, 0.0, 8.0])
            x, y = (np.interp(here, along, seen[:, k]) for k in (0, 1))
            angle = float(np.arctan2(y[2] - y[0], x[2] - x[0]))
            reach = np.array([np.cos(angle), np.sin(angle)]) * half
            # A line along the left border is named beside it.
            least = 0.5 * NAME + 3.0 + (0.0 if long else abs(reach[0]))
            middle = np.array([max(x[1], least), y[1]])
            line = middle + np.outer(np.linspace(-1.0, 1.0, 9), reach)
            if np.minimum(line, [width, height] - line).min() < 0.5 * NAME:
                continue
            if np.hypot(*(marks[:, np.newaxis] - line).T).min(initial=np.inf) < 1.5 * NAME:
                continue
            room = float(np.hypot(*(others[:, np.newaxis] - line).T).min())
            yield min(room, PLENTY), line, float(np.degrees(angle))


def _outline(width: float) -> list[Any]:
    """Dark edges of a white line, which is seen on bright colours then."""
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=width + 1.0, foreground="black"), Normal()]


def short(value: float) -> str:
    """Four digits, without an exponent where the number is large."""
    return f"{value:.0f}" if value >= 1000.0 else f"{value:.4g}"
