r"""The parts of a comparison's picture over the frequency: spectra and the residual.

Spectra, after Figs. 10 and 12 of the paper, are exact, and not of samples: of the acceleration the
Fourier integral over the move, of the vibration that over a Hann window that begins on arrival, so
scaled that a vibration that does not decay has its amplitude at its frequency. A function draws its
part and returns its title.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gcodejerk.machine import Mode
from gcodejerk.motion import Profiles, mode_poles, profiles_response
from gcodejerk.motion.amplitudes import ramp_response
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.planning.arrival import arrival_response
from gcodejerk.report.compare_shown import MS, TEXT, UM, UNIT, Shown
from gcodejerk.report.figures import name_frequencies, shown_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FREQUENCIES = 1601
"""Points of a curve over the frequency."""
FLOOR = 1e-5
"""The residual's scale ends at this share of its largest: below is nothing."""
SPECTRUM_FLOOR = 1e-4
"""As `FLOOR`, of a spectrum."""
WINDOW = 12.0
"""Periods of the lowest mode that a spectrum of the vibration looks at."""
NOTABLE = 0.1
"""The scale ends where the lines of a spectrum stay below this share of the largest."""
NAMES = 15.0
"""Height of the names of the modes above their part. [pt]"""


def acceleration_spectrum(profiles: Profiles, length: float, frequency: ArrayLike) -> Array:
    r"""Spectrum of the acceleration of a move, :math:`|\int a(t) e^{-j 2 \pi f t} dt|`.

    Parameters
    ----------
    profiles : Profiles
        One unit profile.
    length : float
        What it is scaled by. [mm]
    frequency : array_like, shape (n,)
        Above zero. [Hz]

    Returns
    -------
    ndarray, shape (n,)
        [mm/s^2/Hz]
    """
    response = profiles_response(profiles, mode_poles(frequency, 0.0))
    return np.asarray(abs(length) * np.abs(response[0]), dtype=np.float64)


def vibration_spectrum(
    response: Complex, poles: Complex, window: float, frequency: ArrayLike
) -> Array:
    r"""Spectrum of a decaying vibration in a Hann window that begins with it.

    Parameters
    ----------
    response, poles : ndarray of complex, shape (m,)
        The vibration is :math:`-\sum_k \mathrm{Im}(r_k e^{p_k t})`. [mm], [rad/s]
    window : float
        Length of the window. [s]
    frequency : array_like, shape (n,)
        [Hz]

    Returns
    -------
    ndarray, shape (n,)
        Amplitudes; of a vibration without damping, much faster than the window is long, its own.
        [mm]
    """
    s = -2j * np.pi * np.asarray(frequency, dtype=float)[:, np.newaxis]
    turn = 2j * np.pi / window
    total = np.zeros(len(s), dtype=np.complex128)
    for rate, amplitude in ((poles, 0.5j * response), (poles.conj(), -0.5j * response.conj())):
        # 1 - cos(2 pi t/W), whose mean is 1, in three exponentials.
        parts = [
            weight * _mean_of_exponential((rate + s + k * turn) * window)
            for k, weight in ((0, 1.0), (1, -0.5), (-1, -0.5))
        ]
        total += (sum(parts) * amplitude).sum(axis=-1)
    return np.asarray(2.0 * np.abs(total), dtype=np.float64)


def _mean_of_exponential(x: Complex) -> Complex:
    """Mean of exp(x t) for t from 0 to 1; where x is 0, too."""
    return ramp_response(np.where(x == 0.0, 1e-12, x))


def draw_acceleration_spectrum(axes: Axes, shown: Shown, axis: str, part: str) -> str:
    """Spectrum of one axis's acceleration, whose part has that letter."""
    modes, lines = _excited(shown, range(len(shown.comparison.share)))
    frequency = _range([m.frequency for m, _ in modes], lines)
    curves = [
        (c, acceleration_spectrum(shown.profile(c, axis), shown.length(axis), frequency))
        for c in (*shown.others, *shown.shown)
    ]
    top = max(float(curve.max()) for _, curve in curves)
    for candidate, curve in curves:
        axes.plot(frequency, curve, **shown.style(candidate))
    _log_axes(axes, frequency, 0.5 * SPECTRUM_FLOOR * top, 2.0 * top, 0.17)
    _mark(axes, [m for m, _ in modes if m.participation_of(axis)])
    axes.set_ylabel(f"[{shown.unit(axis)}/s²/Hz]")
    return f"spectrum of ({part})"


def draw_vibration_spectrum(axes: Axes, shown: Shown, part: str) -> str:
    """Spectrum of the vibration after arrival, whose part has that letter."""
    modes, lines = _excited(shown, range(len(shown.comparison.share)))
    frequency = _range([m.frequency for m, _ in modes], lines)
    poles = shown.comparison.modes.poles
    lowest = min([m.frequency for m, _ in modes] + [float(f[w.argmax()]) for f, w in lines])
    window = WINDOW / lowest
    curves = []
    for candidate in (*shown.others, *shown.shown):
        response = arrival_response(candidate.profiles, shown.weights, poles) / poles.imag
        curve = UM * vibration_spectrum(response, poles, window, frequency)
        curves.append((candidate, curve))
    top = max(float(curve.max()) for _, curve in curves) or 1.0
    for candidate, curve in curves:
        axes.plot(frequency, curve, **shown.style(candidate))
    tolerance = UM * shown.comparison.machine.design.tolerance
    low = max(SPECTRUM_FLOOR * top, min(0.1 * tolerance, 0.01 * top))
    _log_axes(axes, frequency, low, 2.0 * top, 0.11)
    _mark(axes, [m for m, _ in modes])
    axes.set_ylabel(f"amplitude [{UNIT}]")
    return f"spectrum of ({part}), Hann window of {MS * window:.0f} ms"


def draw_residual(axes: Axes, shown: Shown) -> str:
    """What a mode of any frequency would keep, and where the machine's own modes are."""
    axis, design = shown.longest, shown.comparison.machine.design
    length = abs(shown.length(axis))
    own, lines = _excited(shown, [shown.row(axis)])
    frequency = _range([m.frequency for m, _ in own], lines)
    poles = mode_poles(frequency, _damping(frequency, [m for m, _ in own]))
    top = 0.0
    for candidate in (*shown.others, *shown.shown):
        response = profiles_response(shown.profile(candidate, axis), poles)[0]
        D = UM * length * np.abs(response) / poles.imag
        top = max(top, float(D.max()))
        axes.plot(frequency, D, **shown.style(candidate))
    tolerance = UM * design.tolerance
    lowest = tolerance / max([1.0, *(weight for _, weight in own)])
    _log_axes(
        axes, frequency, max(FLOOR * top, min(0.1 * lowest, 0.1 * top)), 2.0 * top, 0.045
    )  # fmt: skip
    for mode, weight in own:
        low, high = (1.0 - design.band) * mode.frequency, (1.0 + design.band) * mode.frequency
        axes.axvspan(low, high, color="0.91", linewidth=0, zorder=0)
        gate = tolerance / weight
        axes.plot([low, high], [gate, gate], color="black", linewidth=1.6, zorder=6)
    _mark(axes, [m for m, _ in own])
    for f, weight in lines:
        axes.fill_between(
            f, 0.0, 0.5 * weight / weight.max(), transform=axes.get_xaxis_transform(),
            color="0.88", linewidth=0, zorder=0.5,
        )  # fmt: skip
    axes.set_xlabel("natural frequency [Hz]")
    axes.set_ylabel(f"residual [{UNIT}]")
    about = f"{axis} {shown.length(axis):g} {shown.unit(axis)}, participation 1"
    if not own:
        return f"residual of a mode of any frequency ({about}); grey: measured spectrum"
    marked = (
        f"grey: modes ±{100.0 * design.band:g} %, bar: settled" if design.band else "grey: modes"
    )
    return f"residual of a mode of any frequency ({about}); {marked}"


def name_modes(axes: Axes, shown: Shown) -> None:
    """Name the modes above the part of the residual; the axes have their place by now.

    Names that do not fit beside each other are frequencies only; where these do not fit either,
    the lines stand for themselves.
    """
    modes = sorted(
        (m for m, _ in _excited(shown, [shown.row(shown.longest)])[0]), key=lambda m: m.frequency
    )
    figure = axes.get_figure()
    assert figure is not None
    pixel = figure.dpi / 72.0
    width = axes.bbox.width / pixel
    low, high = np.log(axes.get_xlim())
    centres = np.array([(np.log(m.frequency) - low) / (high - low) * width for m in modes])
    full = [
        shown_name(m.name) + ("" if m.name.endswith("Hz") else f" {m.frequency:g} Hz")
        for m in modes
    ]
    for words in (
        full,
        [f"{m.frequency:g} Hz" for m in modes],
        [f"{m.frequency:g}" for m in modes],
    ):
        texts = [
            axes.annotate(
                word, (centre / width, 1.0), (0.0, NAMES - 3.0), xycoords="axes fraction",
                textcoords="offset points", ha="center", va="top", fontsize=TEXT - 1.5,
                color="0.2", in_layout=False, annotation_clip=False,
                arrowprops={"arrowstyle": "-", "color": "0.55", "linewidth": 0.6, "shrinkA": 0,
                            "shrinkB": 0, "relpos": (0.5, 0.0)},
            )
            for word, centre in zip(words, centres, strict=True)
        ]  # fmt: skip
        sizes = np.array([text.get_window_extent().width / pixel for text in texts])
        if sizes.sum() + 5.0 * len(sizes) <= width:
            for text, centre, place in zip(
                texts, centres, spread(centres, sizes, width), strict=True
            ):
                text.set_position((place - centre, NAMES - 3.0))
            return
        for text in texts:
            text.remove()


def spread(centres: Array, sizes: Array, width: float, gap: float = 5.0) -> Array:
    """Places near the centres, in their order, where things of these sizes do not overlap.

    Parameters
    ----------
    centres, sizes : ndarray, shape (n,)
        Where each would like to be, rising, and how wide it is.
    width : float
        From 0 to here there is room, which has to be enough.
    gap : float, optional
        Between neighbours.

    Returns
    -------
    ndarray, shape (n,)

    Examples
    --------
    >>> spread(np.array([10.0, 12.0, 80.0]), np.array([20.0, 20.0, 10.0]), 100.0).tolist()
    [10.0, 35.0, 80.0]
    """
    places = np.array(centres, dtype=float)
    edge = -gap
    for k, size in enumerate(sizes):
        places[k] = max(places[k], edge + gap + 0.5 * size)
        edge = places[k] + 0.5 * size
    edge = width + gap
    for k in range(len(sizes) - 1, -1, -1):
        places[k] = min(places[k], edge - gap - 0.5 * sizes[k])
        edge = places[k] - 0.5 * sizes[k]
    return places


def _excited(shown: Shown, rows: Iterable[int]) -> tuple[list[tuple[Mode, float]], list[Array]]:
    """Modes that some of the profiles excite and the lines of spectra.

    A mode's weight is what it is excited by, for each mm of the axis that moves farthest.
    """
    modes = shown.comparison.modes
    length = abs(shown.length(shown.longest))
    weights = np.abs(shown.weights[list(rows)]).max(axis=0) / length
    own: list[tuple[Mode, float]] = []
    lines: list[Array] = []
    for g in shown.comparison.excited:
        here = modes.group == g
        if not weights[here].any():
            continue
        if np.count_nonzero(here) > 1:
            # Only an axis has a spectrum.
            spectrum = shown.comparison.machine.axis(modes.labels[g]).spectrum
            assert spectrum is not None
            lines.append(np.array([spectrum.frequency, spectrum.weight]))
        else:
            own.append((modes.modes[g], float(weights[here][0])))
    return own, lines


def _mark(axes: Axes, modes: list[Mode]) -> None:
    """A line at each mode."""
    for mode in modes:
        axes.axvline(mode.frequency, color="0.55", linewidth=0.6, zorder=0.5)


def _log_axes(axes: Axes, frequency: Array, low: float, high: float, spacing: float) -> None:
    """Both scales logarithmic, frequencies named no closer than a share of the width."""
    axes.set_yscale("log")
    axes.set_xscale("log")
    axes.set_ylim(low, high)
    axes.set_xlim(frequency[0], frequency[-1])
    name_frequencies(axes, spacing)
    axes.set_yticks([], minor=True)
    axes.grid(True, color="0.94", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.set_xlabel("frequency [Hz]")


def _range(modes: list[float], lines: list[Array]) -> Array:
    """From half the lowest mode to twice the highest, and all notable lines, the modes exactly."""
    wide = [factor * f for f in modes for factor in (0.5, 2.0)]
    for f, weight in lines:
        notable = f[weight > NOTABLE * weight.max()]
        # One line alone is to be seen with what stands around it.
        wide += [0.7 * float(notable.min()), 1.4 * float(notable.max())]
    even = np.geomspace(min(wide), max(wide), FREQUENCIES)
    return np.unique(np.concatenate([even, modes]))


def _damping(frequency: Array, modes: list[Mode]) -> Array:
    """Damping interpolated between modes, exact at each; none where there are none."""
    order = sorted(modes, key=lambda m: m.frequency)
    if not order:
        return np.zeros(len(frequency))
    return np.interp(frequency, [m.frequency for m in order], [m.damping for m in order])
