"""Pictures of amplitude maps, after the paper's Fig. 8: one map, or those of all three conditions.

This module owns the page: size, title, colour bar and legend. What stands in a map is
`map_panel`'s. matplotlib is an optional extra and is imported inside the functions that draw.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, BinaryIO

from gcodejerk.motion.profiles.conditions import Condition
from gcodejerk.report.figures import new_figure, save, shown_name
from gcodejerk.report.map_panel import (
    MS,
    T_SUM,
    TEXT,
    MapPanel,
    colour_scale,
    scale_of,
    short,
    unit_of,
)
from gcodejerk.studies.amplitude_map import Survey

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 200
POINTS = 700
"""Of each axis of a picture."""
ONE, THREE = (7.4, 6.0), (10.8, 5.2)
"""Width and height of a map and of three. [inch]"""


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
    figure = new_figure(suffix, ONE, DPI)
    draw_map(figure, survey, points, longest)
    save(figure, file, suffix)


def plot_conditions(
    survey: Survey, file: BinaryIO, suffix: str, points: int = POINTS, longest: float | None = None
) -> None:
    """Draw the maps of Conditions I, II and III side by side, with one scale of colours.

    Parameters
    ----------
    survey : Survey
        The move; its own condition does not matter.
    file, suffix, points, longest
        As for `plot_map`.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    PlanError
        The longest time leaves no room.
    """
    figure = new_figure(suffix, THREE, DPI)
    draw_conditions(figure, survey, points, longest)
    save(figure, file, suffix)


def draw_map(
    figure: Figure, survey: Survey, points: int = POINTS, longest: float | None = None
) -> None:
    """Draw the map of a survey into an empty figure; parameters as for `plot_map`."""
    T1, T = survey.axes(points, longest)
    axes = figure.subplots()
    values = survey.values(T1, T)
    panel = MapPanel(survey, axes, T1, T, values)
    image = panel.draw(colour_scale(survey, [values]))
    axes.set_ylabel(f"{T_SUM} [ms]")
    _colour_bar(figure, survey, image, axes, 0.04)
    axes.set_title(
        f"{_moved(survey)}, Condition {survey.condition}, {_judged(survey)}\n"
        f"{shown_name(survey.machine.name)}",
        fontsize=10.5, loc="left",
    )  # fmt: skip
    entries = dict(panel.entries)
    mark = entries.pop("best within the limits", None) or _nothing()
    entries[f"best within the limits, {_shortest_segment(survey)}:\n{panel.outcome()}"] = mark
    _legend(figure, entries, 2)
    _name_lines(figure, [panel])


def draw_conditions(
    figure: Figure, survey: Survey, points: int = POINTS, longest: float | None = None
) -> None:
    """Draw the maps of all conditions into an empty figure; parameters as for `plot_map`."""
    surveys = [replace(survey, condition=condition) for condition in Condition]
    T1, T = survey.axes(points, longest)
    values = [one.values(T1, T) for one in surveys]
    norm = colour_scale(survey, values)
    every = figure.subplots(1, len(surveys), sharey=True)
    entries: dict[str, Any] = {}
    panels: list[MapPanel] = []
    image = None
    for one, axes, value in zip(surveys, every, values, strict=True):
        panel = MapPanel(one, axes, T1, T, value)
        panels.append(panel)
        image = panel.draw(norm, free=True)
        said = f"Condition {one.condition}\n● {panel.outcome()}"
        if panel.free is not None and panel.free != panel.best:
            said += f"\n◇ {panel.words(panel.free)}"
        axes.set_title(said, fontsize=TEXT, loc="left")
        entries = {**panel.entries, **entries}
    every[0].set_ylabel(f"{T_SUM} [ms]")
    _colour_bar(figure, survey, image, list(every), 0.012)
    figure.suptitle(
        f"{_moved(survey)}, {_judged(survey)}; {_shortest_segment(survey)} — "
        f"{shown_name(survey.machine.name)}",
        fontsize=10.5,
        wrap=True,
    )
    _legend(figure, entries, 3)
    _name_lines(figure, panels)


def _colour_bar(figure: Figure, survey: Survey, image: Any, axes: Any, pad: float) -> None:
    """The colours' scale in words, and where the controller's own G0 stands on it."""
    bar = figure.colorbar(image, ax=axes, extend="max", aspect=25, pad=pad)
    what = "acceleration amplitude" if survey.mode is not None else "worst displacement"
    bar.set_label(
        f"{what} after the move [{unit_of(survey)}]\ncolours by the square root of it",
        fontsize=TEXT + 0.5,
    )
    now = scale_of(survey) * survey.conventional_value
    bar.ax.annotate(
        f"G0 today\n{short(now)}", (0.0, now), (-11, 0), xycoords=("axes fraction", "data"),
        textcoords="offset points", ha="right", va="center", fontsize=7.5,
        arrowprops={"arrowstyle": "-|>", "facecolor": "black", "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip


def _legend(figure: Figure, entries: dict[str, Any], columns: int) -> None:
    """Below the axes, so that it hides nothing; in fewer columns where the page is too narrow."""
    for count in range(columns, 0, -1):
        legend = figure.legend(
            list(entries.values()), list(entries), loc="outside lower left", ncols=count,
            fontsize=TEXT, frameon=False, handlelength=3.2, handleheight=1.1,
        )  # fmt: skip
        if count == 1 or legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def _name_lines(figure: Figure, panels: list[MapPanel]) -> None:
    """Names within the maps, when all else has found its place."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for panel in panels:
        panel.name_lines()


def _nothing() -> Any:
    """What a legend shows of something that is not on the map."""
    from matplotlib.patches import Patch

    return Patch(facecolor="none", edgecolor="none")


def _moved(survey: Survey) -> str:
    return f"{survey.axis.name} {survey.length:g} {survey.unit}"


def _shortest_segment(survey: Survey) -> str:
    return f"each segment at least {MS * survey.machine.interval:g} ms"


def _judged(survey: Survey) -> str:
    """By what the maps are judged."""
    mode = survey.mode
    if mode is None:
        return f"all {len(survey.modes)} modes that {survey.axis.name} excites"
    if mode.name == f"{mode.frequency:g} Hz":
        return f"mode of {mode.frequency:g} Hz, damping {mode.damping:g}"
    return f"mode {shown_name(mode.name, 30)}, {mode.frequency:g} Hz, damping {mode.damping:g}"
