"""The parts of a comparison's picture over time: acceleration and vibration in lanes, position.

A lane for each one who is shown, all of a part to one scale, which a bar above the first lane
states. Words stand beside the lanes, never in them. A function draws its part and returns its
title.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.planning.arrival import arrival_response
from gcodejerk.report.compare_shown import MS, TEXT, UM, UNIT, Shown, round_below
from gcodejerk.report.figures import acceleration_curve
from gcodejerk.studies.comparison import Candidate

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LANE = 0.42
"""Half of a lane's curve, of the distance of lanes."""
HEAD = 1.0
"""Where the part ends above the first lane; the scale's bar stands there."""
PERIODS = 5.0
"""Periods of the mode that is shaken most, shown after arrival."""
FINE = 600
"""Points of a position's curve."""


def draw_acceleration(axes: Axes, shown: Shown, axis: str, named: bool) -> str:
    """Acceleration of one axis; the names beside the lanes where they are wanted."""
    length, unit = shown.length(axis), shown.unit(axis)
    curves = []
    for candidate in shown.shown:
        t, a = acceleration_curve(shown.profile(candidate, axis))
        curves.append((t, length * a))
    scale = max(float(np.abs(a).max()) for _, a in curves)
    for k, (candidate, (t, a)) in enumerate(zip(shown.shown, curves, strict=True)):
        colour = shown.colour(candidate)
        axes.fill_between(MS * t, -k, LANE * a / scale - k, color=colour, alpha=0.15, lw=0)
        axes.plot(MS * t, LANE * a / scale - k, color=colour, linewidth=0.9)
    _lanes(axes, shown)
    if named:
        _names(axes, shown, [f"{c.name}\n{MS * c.time:.4g} ms" for c in shown.shown])
    _bar(axes, round_below(scale), scale, f"{unit}/s²")
    axes.set_xlim(0.0, MS * 1.02 * max(c.time for c in shown.shown))
    axes.set_xlabel("time [ms]")
    return f"acceleration of {axis}"


def draw_position(axes: Axes, shown: Shown, axis: str) -> str:
    """Position of one axis."""
    last = max(c.time for c in shown.shown)
    for candidate in shown.shown:
        t, q = position_curve(shown.profile(candidate, axis), 1.02 * last)
        axes.plot(MS * t, shown.length(axis) * q, **shown.style(candidate))
    axes.set_xlim(0.0, MS * 1.02 * last)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel(f"{axis} [{shown.unit(axis)}]")
    axes.grid(True, color="0.94", linewidth=0.5)
    return f"position of {axis}"


def draw_vibration(axes: Axes, shown: Shown) -> str:
    """The tool's vibration from each one's arrival on."""
    comparison, modes = shown.comparison, shown.comparison.modes
    strongest = int(np.argmax(comparison["conventional"].displacement))
    first, last = (f(c.time for c in shown.shown) for f in (min, max))
    end = last + PERIODS / modes.modes[strongest].frequency
    fastest = float(modes.poles.imag.max()) / (2.0 * np.pi)
    curves = []
    for candidate in shown.shown:
        count = int(np.clip(30.0 * fastest * (end - candidate.time), 400, 8000))
        t = np.linspace(0.0, end - candidate.time, count)
        response = arrival_response(candidate.profiles, shown.weights, modes.poles)
        swing = np.zeros(count)
        for pole, amplitude in zip(modes.poles, response / modes.poles.imag, strict=True):
            swing -= (amplitude * np.exp(pole * t)).imag
        curves.append((candidate.time + t, swing))
    scale = max(float(np.abs(swing).max()) for _, swing in curves) or 1.0
    for k, (candidate, (t, swing)) in enumerate(zip(shown.shown, curves, strict=True)):
        colour = shown.colour(candidate)
        axes.plot(MS * t, LANE * swing / scale - k, color=colour, linewidth=0.9)
        axes.plot(MS * t[0], LANE * swing[0] / scale - k, "o", color=colour, markersize=3)
    _lanes(axes, shown)
    _names(axes, shown, [f"{c.name}\n{_settled(c)}" for c in shown.shown])
    _bar(axes, round_below(UM * scale), UM * scale, UNIT)
    axes.set_xlim(MS * (first - 0.03 * (end - first)), MS * end)
    axes.set_xlabel("time since the start [ms]")
    return "vibration after arrival"


def position_curve(profiles: Profiles, end: float) -> tuple[Array, Array]:
    """Position of one unit profile, at rest after its end.

    Parameters
    ----------
    profiles : Profiles
        One profile.
    end : float
        Of the curve. [s]

    Returns
    -------
    t, q : ndarray, shape (n,)
        [s], [-]
    """
    t = np.linspace(0.0, end, FINE)
    k = np.searchsorted(profiles.begin, t, side="right") - 1
    d = np.minimum(t - profiles.begin[k], profiles.duration[k])
    a, j = profiles.acceleration[k], profiles.jerk[k]
    return t, profiles.position[k] + d * (profiles.velocity[k] + d * (0.5 * a + d * j / 6.0))


def _lanes(axes: Axes, shown: Shown) -> None:
    """A line at zero for each lane."""
    count = len(shown.shown)
    for k in range(count):
        axes.axhline(-k, color="0.85", linewidth=0.6, zorder=0)
    axes.set_ylim(-count + 1 - 1.6 * LANE, HEAD)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)


def _names(axes: Axes, shown: Shown, words: list[str]) -> None:
    """Words to the left of the lanes."""
    axes.set_yticks(-np.arange(len(words)), words, linespacing=1.05)
    axes.tick_params(axis="y", length=0)
    for label, candidate in zip(axes.get_yticklabels(), shown.shown, strict=True):
        label.set_color(shown.colour(candidate))


def _bar(axes: Axes, value: float, scale: float, unit: str) -> None:
    """How much a piece of the lanes' height is, above the first."""
    high = LANE * value / scale
    axes.plot(
        [0.985, 0.985], [HEAD - high, HEAD], transform=axes.get_yaxis_transform(), color="0.3",
        linewidth=1.8, solid_capstyle="butt", clip_on=False,
    )  # fmt: skip
    axes.annotate(
        f"{value:g} {unit}", (0.985, HEAD - 0.5 * high), (-4, 0), ha="right", va="center",
        xycoords=axes.get_yaxis_transform(), textcoords="offset points", color="0.3",
        fontsize=TEXT - 1.5,
    )  # fmt: skip


def _settled(candidate: Candidate) -> str:
    """When all is still, in the words of a lane."""
    if candidate.settling is None:
        return "never settles"
    ms = MS * candidate.settling
    return f"settled at {ms:.0f} ms" if ms >= 100.0 else f"settled at {ms:.3g} ms"
