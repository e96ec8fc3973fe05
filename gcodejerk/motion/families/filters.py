r"""Filters behind the interpolation: moving averages and input shapers, each axis by itself.

This module owns what a control does to the motion that its planner has made: it averages it over
a time (Siemens MD32402 types 2 and 4, Heidenhain's average and triangle), or adds delayed copies of
it (Klipper, Marlin, RepRapFirmware). Both replace a motion x(t) by the integral of k(s) x(t - s),
with a kernel k whose area is 1 and by whose length S the move gets longer. So a mode's response,
taken at the filtered move's own end, is that of the move times one number, the *transfer*,

.. math:: \int_0^S k(s)\, e^{\lambda (S - s)} ds ,

and a search over the settings of a filter needs no profiles.

For a mode of damped period T_d = 1/(f sqrt(1 - zeta^2)), K = exp(-zeta pi/sqrt(1 - zeta^2)) and the
tolerated vibration V = 0.05; amplitudes before they are divided by their sum:

=========== ===================== ==================================================================
kind        delays                amplitudes
=========== ===================== ==================================================================
average     a time T              1/T from 0 to T
triangle    a time T              the same twice: a triangle from 0 to 2 T
zv          0, T_d/2              1, K
zvd         steps of T_d/2        1, 2 K, K^2
zvdd        steps of T_d/2        1, 3 K, 3 K^2, K^3
zvddd       steps of T_d/2        1, 4 K, 6 K^2, 4 K^3, K^4
mzv         steps of 3 T_d/8      1 - 1/sqrt 2, (sqrt 2 - 1) k, (1 - 1/sqrt 2) k^2, k = K^(3/4)
marlin-mzv  steps of 3 T_d/8      1, sqrt 2 K, K^2
ei          steps of T_d/2        (1 + V)/4, (1 - V) K/2, (1 + V) K^2/4
2hei, 3hei  steps of T_d/2        Marlin's, of V and K
klipper-ei  polynomials in zeta (and V), in units of T_d
2hump_ei    polynomials in zeta, in units of the undamped period 1/f
3hump_ei    polynomials in zeta, in units of the undamped period 1/f
ei2, ei3    the same polynomials, in units of T_d; the last amplitude is what is missing to 1
=========== ===================== ==================================================================

Sources: zv, zvd, Singer and Seering, J. Dyn. Sys. Meas. Control 112 (1990) 76-82; ei, Singhose,
Seering and Singer, J. Mech. Des. 116 (1994) 654-659; mzv, klipper-ei, 2hump_ei, 3hump_ei: Klipper,
klippy/extras/shaper_defs.py at 1819369; zvdd, zvddd, 2hei, 3hei, marlin-mzv: Marlin,
Marlin/src/module/ft_motion/shaping.cpp at 195278e; ei2, ei3: RepRapFirmware,
src/Movement/AxisShaper.cpp at 01e4284, whose zvdd, zvddd and mzv are those above.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex, mode_poles

TOLERATED = 0.05
"""Vibration that the shapers of the kind ei tolerate at their frequency, as a share."""
AVERAGE, TRIANGLE = "average", "triangle"
"""Kinds that are set by a time instead of a frequency."""


@dataclass(frozen=True, slots=True)
class Shaper:
    """How a shaper's impulses follow from a mode.

    Attributes
    ----------
    spacing : float
        Between impulses, as a part of the damped period; 0 if `impulses` gives the delays.
    impulses : callable
        From K and the damping ratio, shape (k,) each: amplitudes, shape (k, i), and, where there is
        no spacing, delays in damped periods.
    """

    spacing: float
    impulses: Callable[[Array, Array], tuple[Array, Array | None]]


def _powers(*factors: float) -> Callable[[Array, Array], tuple[Array, None]]:
    """Amplitudes that are factors of the powers of K: 1, K, K^2..."""

    def impulses(left: Array, damping: Array) -> tuple[Array, None]:
        return np.stack([c * left**i for i, c in enumerate(factors)], axis=-1), None

    return impulses


def _mzv(left: Array, damping: Array) -> tuple[Array, None]:
    edge, middle = 1.0 - np.sqrt(0.5), np.sqrt(2.0) - 1.0
    return np.stack([edge + 0.0 * left, middle * left**0.75, edge * left**1.5], axis=-1), None


def _two_humps(left: Array, damping: Array) -> tuple[Array, None]:
    squared = TOLERATED**2
    x = np.cbrt(squared * (np.sqrt(1.0 - squared) + 1.0))
    outer = float((3.0 * x * x + 2.0 * x + 3.0 * squared) / (16.0 * x))
    return _powers(outer, 0.5 - outer, 0.5 - outer, outer)(left, damping)


def _three_humps(left: Array, damping: Array) -> tuple[Array, None]:
    v = TOLERATED
    outer = (1.0 + 3.0 * v + 2.0 * np.sqrt(2.0 * (v + 1.0) * v)) / 16.0
    inner = 0.25 * (1.0 - v)
    return _powers(outer, inner, 0.5 * (1.0 + v) - 2.0 * outer, inner, outer)(left, damping)


def _klipper_ei(left: Array, damping: Array) -> tuple[Array, Array]:
    v, z = TOLERATED, damping
    first = 0.24968 + 0.24961 * v + (0.80008 + 1.23328 * v) * z + (0.49599 + 3.17316 * v) * z**2
    last = 0.25149 + 0.21474 * v + (-0.83249 + 1.41498 * v) * z + (0.85181 - 4.90094 * v) * z**2
    middle = (
        0.4999
        + (0.46159 + 8.57843 * v) * v * z
        + (4.26169 - 108.644 * v) * v * z**2
        + (1.75601 + 336.989 * v) * v * z**3
    )
    delays = np.stack([0.0 * z, middle, 1.0 + 0.0 * z], axis=-1)
    return np.stack([first, 1.0 - first - last, last], axis=-1), delays


# Rows of impulses, columns of the powers of the damping ratio; periods, then amplitudes.
TWO_HUMPS = (
    ((0.0, 0.0, 0.0, 0.0), (0.49890, 0.16270, -0.54262, 6.16180),
     (0.99748, 0.18382, -1.58270, 8.17120), (1.49920, -0.09297, -0.28338, 1.85710)),
    ((0.16054, 0.76699, 2.26560, -1.22750), (0.33911, 0.45081, -2.58080, 1.73650),
     (0.34089, -0.61533, -0.68765, 0.42261), (0.15997, -0.60246, 1.00280, -0.93145)),
)  # fmt: skip
THREE_HUMPS = (
    ((0.0, 0.0, 0.0, 0.0), (0.49974, 0.23834, 0.44559, 12.4720),
     (0.99849, 0.29808, -2.36460, 23.3990), (1.49870, 0.10306, -2.01390, 17.0320),
     (1.99960, -0.28231, 0.61536, 5.40450)),
    ((0.11275, 0.76632, 3.29160, -1.44380), (0.23698, 0.61164, -2.57850, 4.85220),
     (0.30008, -0.19062, -2.14560, 0.13744), (0.23775, -0.73297, 0.46885, -2.08650),
     (0.11244, -0.45439, 0.96382, -1.46000)),
)  # fmt: skip
Table = tuple[tuple[tuple[float, ...], ...], tuple[tuple[float, ...], ...]]


def _expansion(table: Table, *, undamped: bool) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Impulses by polynomials: of the undamped period and as they are, or of the damped one."""
    periods, shares = (np.array(part) for part in table)

    def impulses(left: Array, damping: Array) -> tuple[Array, Array]:
        powers = damping[..., np.newaxis] ** np.arange(4)
        delays, amplitudes = powers @ periods.T, powers @ shares.T
        if undamped:
            delays = delays * np.sqrt(1.0 - damping**2)[..., np.newaxis]
        else:
            amplitudes[..., -1] = 1.0 - amplitudes[..., :-1].sum(axis=-1)
        return amplitudes, delays

    return impulses


SHAPER_KINDS = {
    "zv": Shaper(0.5, _powers(1.0, 1.0)),
    "zvd": Shaper(0.5, _powers(1.0, 2.0, 1.0)),
    "zvdd": Shaper(0.5, _powers(1.0, 3.0, 3.0, 1.0)),
    "zvddd": Shaper(0.5, _powers(1.0, 4.0, 6.0, 4.0, 1.0)),
    "mzv": Shaper(0.375, _mzv),
    "marlin-mzv": Shaper(0.375, _powers(1.0, np.sqrt(2.0), 1.0)),
    "ei": Shaper(0.5, _powers(1.0 + TOLERATED, 2.0 * (1.0 - TOLERATED), 1.0 + TOLERATED)),
    "2hei": Shaper(0.5, _two_humps),
    "3hei": Shaper(0.5, _three_humps),
    "klipper-ei": Shaper(0.0, _klipper_ei),
    "2hump_ei": Shaper(0.0, _expansion(TWO_HUMPS, undamped=True)),
    "3hump_ei": Shaper(0.0, _expansion(THREE_HUMPS, undamped=True)),
    "ei2": Shaper(0.0, _expansion(TWO_HUMPS, undamped=False)),
    "ei3": Shaper(0.0, _expansion(THREE_HUMPS, undamped=False)),
}
"""Shapers by their name."""
KINDS = (AVERAGE, TRIANGLE, *SHAPER_KINDS)
"""Every kind of filter."""


def impulses(
    kind: str, frequency: ArrayLike, damping: ArrayLike = 0.0, tick: float = 0.0
) -> tuple[Array, Array]:
    """Delays and amplitudes of a shaper, for k settings at once.

    Parameters
    ----------
    kind : str
        One of `SHAPER_KINDS`.
    frequency, damping : array_like, shape (k,)
        That it is made for. [Hz], [-]
    tick : float, optional
        The distance of equally spaced impulses is rounded to whole ticks, as Marlin does (FTM_FS:
        1 ms); 0 for none. [s]

    Returns
    -------
    delays, amplitudes : ndarray, shape (k, i)
        [s], and shares that add up to 1. [-]

    Raises
    ------
    PlanError
        There is no such shaper, or no such mode.

    Examples
    --------
    >>> delays, amplitudes = impulses("zvd", [50.0])
    >>> delays.tolist(), amplitudes.tolist()
    ([[0.0, 0.01, 0.02]], [[0.25, 0.5, 0.25]])
    """
    if kind not in SHAPER_KINDS:
        raise PlanError(f"there is no shaper {kind!r}", f"choose one of {', '.join(SHAPER_KINDS)}")
    f, zeta = np.broadcast_arrays(*(np.asarray(x, dtype=float) for x in (frequency, damping)))
    pole = mode_poles(f, zeta)
    period = (2.0 * np.pi / pole.imag)[..., np.newaxis]
    left = np.exp(0.5 * pole.real * period[..., 0])
    shaper = SHAPER_KINDS[kind]
    amplitudes, delays = shaper.impulses(left, zeta)
    if delays is None:
        step = shaper.spacing * period
        if tick:
            step = np.maximum(np.rint(step / tick), 1.0) * tick
        delays = np.arange(amplitudes.shape[-1]) * step
    else:
        delays = delays * period
    return delays, amplitudes / amplitudes.sum(axis=-1, keepdims=True)


def cumulative_impulses(shares: ArrayLike, durations: ArrayLike) -> tuple[Array, Array]:
    """Delays and amplitudes of RepRapFirmware's custom shaper, `M593 P"custom" H... T...`.

    Parameters
    ----------
    shares : array_like, shape (i,)
        H: how much has come through after each impulse but the last. [-]
    durations : array_like, shape (i,)
        T: from each impulse to the next. [s]

    Returns
    -------
    delays, amplitudes : ndarray, shape (i + 1,)
        [s], [-]

    Examples
    --------
    >>> delays, amplitudes = cumulative_impulses([0.25, 0.75], [0.01, 0.01])
    >>> delays.tolist(), amplitudes.tolist()
    ([0.0, 0.01, 0.02], [0.25, 0.5, 0.25])
    """
    so_far = np.concatenate([np.asarray(shares, dtype=float), [1.0]])
    steps = np.asarray(durations, dtype=float)
    return np.concatenate([[0.0], np.cumsum(steps)]), np.diff(so_far, prepend=0.0)


def length(kind: str, setting: ArrayLike, damping: ArrayLike = 0.0, tick: float = 0.0) -> Array:
    """How much longer a filter makes every move.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    setting : array_like, shape (k,)
        Time of an average [s], at least 0; frequency of a shaper [Hz].
    damping, tick
        As in `impulses`; an average has none.

    Returns
    -------
    ndarray, shape (k,)
        [s]

    Raises
    ------
    PlanError
        As `impulses`.

    Examples
    --------
    >>> length("triangle", [0.01]).tolist(), length("zv", [50.0]).tolist()
    ([0.02], [0.01])
    """
    if kind in (AVERAGE, TRIANGLE):
        time = np.asarray(setting, dtype=float)
        return 2.0 * time if kind == TRIANGLE else time
    last: Array = impulses(kind, setting, damping, tick)[0][..., -1]
    return last


def transfer(
    kind: str,
    setting: ArrayLike,
    damping: ArrayLike,
    poles: Complex,
    tick: float = 0.0,
) -> Complex:
    """By what a filter multiplies the response of modes, at the filtered move's own end.

    Parameters
    ----------
    kind, setting, damping, tick
        As in `length`; k settings.
    poles : ndarray of complex, shape (m,)
        From `mode_poles`. [rad/s]

    Returns
    -------
    ndarray of complex, shape (k, m)
        [-]

    Raises
    ------
    PlanError
        As `impulses`.

    Examples
    --------
    An average of 32 ms leaves 4.16 % of a mode of 30 Hz, one of 33 ms 1.01 %:

    >>> left = abs(transfer("average", [0.032, 0.033], 0.0, mode_poles([30.0], 0.0)))
    >>> left.ravel().round(4).tolist()
    [0.0416, 0.0101]
    """
    if kind in (AVERAGE, TRIANGLE):
        one = average_transfer(setting, poles)
        return one * one if kind == TRIANGLE else one
    return impulse_transfer(*impulses(kind, setting, damping, tick), poles)


def average_transfer(time: ArrayLike, poles: Complex) -> Complex:
    """`transfer` of averages of k lengths: (exp(lambda T) - 1)/(lambda T)."""
    x = np.asarray(time, dtype=float)[..., np.newaxis] * poles
    small = np.abs(x) < 1e-9
    with np.errstate(invalid="ignore", divide="ignore"):
        factor: Complex = np.where(small, 1.0 + 0.5 * x, np.expm1(x) / np.where(small, 1.0, x))
    return factor


def impulse_transfer(delays: Array, amplitudes: Array, poles: Complex) -> Complex:
    """`transfer` of k shapers given by their impulses, shape (k, i) each [s], [-]."""
    left = (delays[..., -1:] - delays)[..., np.newaxis] * poles
    factor: Complex = (amplitudes[..., np.newaxis] * np.exp(left)).sum(axis=-2)
    return factor
