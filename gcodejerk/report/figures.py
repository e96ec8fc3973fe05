"""Figures: a planned move beside the conventional one.

matplotlib is an optional extra and is imported inside the functions that draw; where it is missing,
the error names the remedy.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import accumulate
from typing import TYPE_CHECKING, Any, BinaryIO
from unicodedata import east_asian_width

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.motion import sample_profiles
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.planning.move import Plan

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMATS = (".png", ".svg", ".pdf")
TODAY, PLANNED = "#c44e52", "#1f5fa8"
"""Colours that differ in print and for colour-blind eyes."""
HATCH = 0.6
"""Width of the lines of hatches. [pt]"""
LONGEST_NAME = 80
"""Letters of a name that the page has room for."""
PREFERRED = (1.0, 2.0, 5.0, 3.0, 7.0, 1.5, 4.0, 6.0, 8.0, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 9.0)
"""Frequencies that are named, times powers of ten, while there is room; the first ones first."""
FINE = 8
"""Points of a curve for each interval."""
PERIODS = 4.0
"""Periods of the slowest mode that are shown after arrival."""


def new_figure(suffix: str, size: tuple[float, float], dpi: int) -> Figure:
    """An empty figure, refused before anything is computed for it.

    Parameters
    ----------
    suffix : str
        Of the file that it is for.
    size : tuple of float
        Width and height [inch].
    dpi : int
        Pixels for each inch; in .svg and .pdf only of maps.

    Returns
    -------
    Figure
        Whose parts find their places by themselves.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    if suffix.lower() not in FORMATS:
        raise EmitError(
            f"a figure cannot be {suffix or 'without suffix'}", f"use {', '.join(FORMATS)}"
        )
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise EmitError(
            "figures need matplotlib, which is not installed",
            "install it with: pip install 'gcodejerk[figures]'",
        ) from None
    return Figure(figsize=size, dpi=dpi, layout="constrained")


def save(figure: Figure, file: BinaryIO, suffix: str) -> None:
    """Write a figure.

    Parameters
    ----------
    figure : Figure
        Of `new_figure`.
    file : binary file
        Where it goes.
    suffix : str
        Its format: .png, .svg or .pdf.
    """
    import matplotlib as mpl

    # Hatches with lines as thin as their neighbours'.
    with mpl.rc_context({"hatch.linewidth": HATCH}):
        figure.savefig(file, format=suffix.lower().removeprefix("."), dpi="figure")


def shown_name(name: str, most: int = LONGEST_NAME) -> str:
    """A name of the user's for a picture: no longer than there is room, and no mathematics.

    `most`: letters of an average width, of which W takes more room, and i no less.

    Examples
    --------
    >>> shown_name("rocking of the column", 14), shown_name("W" * 21, 14)
    ('rocking of th…', 'WWWWWWW…')
    """
    room = list(accumulate(map(_letters, name)))
    if room and room[-1] > most:
        kept = sum(width <= most - 1.0 for width in room)
        name = f"{name[:kept].rstrip()}…"
    return name.replace("$", r"\$")


def _letters(letter: str) -> float:
    """Width of a letter in DejaVu Sans, in letters of an average one."""
    if letter in "Wm@%Æ\N{EM DASH}" or east_asian_width(letter) in "WF":
        return 1.8
    if letter in "Mwæ":
        return 1.5
    return 1.2 if letter.isupper() else 1.0


def moved_words(displacement: Mapping[str, float], machine: Machine) -> str:
    """What moves, and how far: ``X 100 mm, B 90 deg``."""
    return ", ".join(
        f"{axis} {length:g} {'deg' if machine.axis(axis).rotary else 'mm'}"
        for axis, length in displacement.items()
    )


def name_frequencies(axes: Axes, spacing: float) -> None:
    """Name frequencies below a logarithmic scale, no closer than a share of its width.

    matplotlib names powers of ten; of less than a decade, every other step too, over each other.
    """
    low, high = axes.get_xlim()
    ticks: list[float] = []
    span = float(np.log(high / low))
    for step in PREFERRED:
        for tick in (step * 10.0**k for k in range(-1, 5)):
            away = [abs(np.log(tick / other)) >= spacing * span for other in ticks]
            if low <= tick <= high and all(away):
                ticks.append(tick)
    axes.set_xticks(sorted(ticks), [f"{tick:g}" for tick in sorted(ticks)])
    axes.set_xticks([], minor=True)


def label_part(axes: Axes, title: str, x: str, y: str) -> None:
    """Give a part of a page its title and units, a light grid, and no box."""
    axes.set_title(title, fontsize=8.5, loc="left")
    axes.set_xlabel(x, fontsize=8)
    axes.set_ylabel(y, fontsize=8)
    axes.tick_params(which="both", labelsize=7.5)
    axes.grid(True, color="0.92", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def plot_move(plan: Plan, file: BinaryIO, suffix: str) -> None:
    """Draw acceleration, velocity, and the vibration of the worst mode, now and as planned.

    Parameters
    ----------
    plan : Plan
        The move.
    file : binary file
        Where the figure goes.
    suffix : str
        Its format: .png, .svg or .pdf.

    Raises
    ------
    EmitError
        The format is unknown, or matplotlib is not installed.
    """
    figure = new_figure(suffix, (7.2, 7.2), 150)
    shown = [_Curve("controller's own G0", TODAY, plan.plans.conventional, plan)]
    shown.append(_Curve(f"{plan.profile}, as written", PLANNED, plan.profiles, plan))
    upper, middle, lower = figure.subplots(3, 1, sharex=True)
    for curve in shown:
        curve.draw(upper, middle, lower)
    unit = "deg" if all(plan.machine.axis(axis).rotary for axis in plan.displacement) else "mm"
    figure.suptitle(
        f"{moved_words(plan.displacement, plan.machine)} in {plan.time * 1e3:g} ms\n"
        f"{shown_name(plan.machine.name)}",
        fontsize=11,
    )
    upper.set_ylabel(f"acceleration [{unit}/s²]")
    middle.set_ylabel(f"velocity [{unit}/s]")
    lower.set_ylabel("vibration of the tool [µm]")
    lower.set_xlabel("time [ms]")
    for axes in (upper, middle, lower):
        axes.axvline(plan.time * 1e3, color="0.6", linewidth=0.8, linestyle=":")
        axes.grid(True, color="0.92", linewidth=0.6)
        axes.spines[["top", "right"]].set_visible(False)
    lower.annotate(
        "arrival", (plan.time * 1e3, 1.0), (3, -3), xycoords=("data", "axes fraction"),
        textcoords="offset points", va="top", fontsize=8, color="0.4",
    )  # fmt: skip
    upper.legend(frameon=False, fontsize=9, loc="upper right")
    save(figure, file, suffix)


class _Curve:
    """One profile of the longest-moving axis, and the sum of what it does to the modes."""

    def __init__(self, label: str, colour: str, profiles: Profiles, plan: Plan) -> None:
        self.label, self.colour = label, colour
        modes, share = plan.plans.modes, plan.plans.share
        slowest = min((mode.frequency for mode in modes.modes), default=1.0 / plan.time)
        self.t = np.arange(0.0, plan.time + PERIODS / slowest, plan.machine.interval / FINE)
        axis = int(np.argmax(np.abs(plan.plans.displacement[0])))
        self.axis = AXES[axis]
        self.velocity, self.vibration = np.zeros_like(self.t), np.zeros_like(self.t)
        step = self.t[1]
        moments = np.arange(len(self.t), dtype=np.int64)[np.newaxis, :]
        for k in range(len(profiles)):
            _, v = sample_profiles(profiles.take(slice(k, k + 1)), moments, step)
            self.velocity += v[0] * share[k, axis]
            weights = modes.participation @ share[k]
            for pole, weight in zip(modes.poles, weights, strict=True):
                self.vibration += weight * _response(v[0], step, complex(pole))
            if share[k, axis]:
                t, a = acceleration_curve(profiles.take(slice(k, k + 1)))
                self.corners, self.acceleration = t, a * share[k, axis]

    def draw(self, upper: Axes, middle: Axes, lower: Axes) -> None:
        """Add the three curves."""
        style: dict[str, Any] = {"color": self.colour, "linewidth": 1.4, "label": self.label}
        ms = self.t * 1e3
        upper.plot(
            np.append(self.corners * 1e3, ms[-1]), np.append(self.acceleration, 0.0), **style
        )
        middle.plot(ms, self.velocity, **style)
        lower.plot(ms, self.vibration * 1e3, **style)


def acceleration_curve(profiles: Profiles) -> tuple[Array, Array]:
    """Corners of the acceleration of one unit profile; steps are vertical lines.

    Parameters
    ----------
    profiles : Profiles
        One profile of s segments.

    Returns
    -------
    t, a : ndarray, shape (2 s + 2,)
        [s], [1/s^2]
    """
    t = np.stack([profiles.begin, profiles.begin + profiles.duration], axis=1).ravel()
    a = np.stack([profiles.acceleration, profiles.end_acceleration], axis=1).ravel()
    return np.concatenate([[0.0], t, t[-1:]]), np.concatenate([[0.0], a, [0.0]])


def _response(velocity: Array, step: float, pole: complex) -> Array:
    """Displacement of a mode in time, driven by a velocity in straight pieces."""
    acceleration = np.diff(velocity) / step
    # Exact for a constant acceleration within each step.
    growth = np.exp(pole * step)
    gain = (growth - 1.0) / pole
    state = np.zeros(len(velocity), dtype=np.complex128)
    for k, a in enumerate(acceleration):
        state[k + 1] = state[k] * growth + a * gain
    out: Array = -state.imag / pole.imag
    return out
