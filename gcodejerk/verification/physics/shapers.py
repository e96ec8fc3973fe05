"""What acts behind a control's planner, as verification knows it: averages and input shapers.

Rule: built by other means than the package's own: a shaper of zeros is a product of its zeros, and
the one whose zeros are given by conditions solves them. Only the polynomials that controls have
fitted stand here as their numbers.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Filter

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

TOLERATED = 0.05
"""Vibration that the kinds of ei tolerate."""
NODES = 32
"""Parts of an average of which its mean is taken."""
# Klipper's shaper_defs.py and RepRapFirmware's AxisShaper.cpp: rows of impulses; the powers of the
# damping ratio. Delays in periods, then amplitudes.
HUMPS = {
    2: (
        "0 0 0 0; .49890 .16270 -.54262 6.16180; .99748 .18382 -1.58270 8.17120; "
        "1.49920 -.09297 -.28338 1.85710",
        ".16054 .76699 2.26560 -1.22750; .33911 .45081 -2.58080 1.73650; "
        ".34089 -.61533 -.68765 .42261; .15997 -.60246 1.00280 -.93145",
    ),
    3: (
        "0 0 0 0; .49974 .23834 .44559 12.4720; .99849 .29808 -2.36460 23.3990; "
        "1.49870 .10306 -2.01390 17.0320; 1.99960 -.28231 .61536 5.40450",
        ".11275 .76632 3.29160 -1.44380; .23698 .61164 -2.57850 4.85220; "
        ".30008 -.19062 -2.14560 .13744; .23775 -.73297 .46885 -2.08650; "
        ".11244 -.45439 .96382 -1.46000",
    ),
}


def impulses_of(behind: Filter) -> tuple[Array, Array]:
    """Delays [s] and shares of what a filter adds up; an average in so many equal parts."""
    if behind.kind in ("average", "triangle"):
        # The trapezoid rule over one average; a triangle is folded with itself.
        share = np.full(NODES + 1, 1.0 / NODES)
        share[[0, -1]] *= 0.5
        if behind.kind == "triangle":
            share = np.convolve(share, share)
        return np.arange(len(share)) * behind.time / NODES, share
    f, zeta = behind.frequency, behind.damping
    damped = float(np.sqrt(1.0 - zeta * zeta))
    left = float(np.exp(-np.pi * zeta / damped))
    delays, shares = _impulses(behind.kind, left, zeta, damped)
    return np.asarray(delays) / (f * damped), np.asarray(shares) / np.sum(shares)


def _impulses(kind: str, left: float, zeta: float, damped: float) -> tuple[Any, Any]:
    """The same in damped periods, and shares before they add up to 1."""
    v = TOLERATED
    if kind in ("zv", "zvd", "zvdd", "zvddd"):
        # As many zeros at the mode as there are impulses behind the first.
        zeros = [np.array([1.0, left])] * (len(kind) - 1)
        shares = reduce(np.convolve, zeros)
        return 0.5 * np.arange(len(shares)), shares
    if kind == "marlin-mzv":
        # A zero at the mode, 3/8 of a period apart, and its mirror image.
        turn = np.exp(0.75j * np.pi)
        shares = np.convolve([1.0, -turn * left], [1.0, -np.conj(turn) * left]).real
        return 0.375 * np.arange(3), shares
    if kind == "mzv":
        # Undamped: zeros at the mode and at 5/3 of it, three impulses that add up to 1.
        at = 0.375 * np.arange(3)
        turns = 2j * np.pi * np.outer([1.0, 5.0 / 3.0], at)
        rows = np.vstack([np.ones(3), np.exp(turns).real, np.exp(turns).imag])
        shares = np.linalg.lstsq(rows, np.array([1.0, 0, 0, 0, 0]), rcond=None)[0]
        return at, shares * left ** (2.0 * at)
    if kind in ("ei", "2hei", "3hei"):
        flat = {"ei": _ei, "2hei": _two, "3hei": _three}[kind](v)
        return 0.5 * np.arange(len(flat)), flat * left ** np.arange(len(flat))
    if kind == "klipper-ei":
        first = np.polyval([0.49599 + 3.17316 * v, 0.80008 + 1.23328 * v, 0.24968 + 0.24961 * v],
                           zeta)  # fmt: skip
        last = np.polyval([0.85181 - 4.90094 * v, -0.83249 + 1.41498 * v, 0.25149 + 0.21474 * v],
                          zeta)  # fmt: skip
        terms = [(1.75601 + 336.989 * v) * v, (4.26169 - 108.644 * v) * v,
                 (0.46159 + 8.57843 * v) * v, 0.4999]  # fmt: skip
        middle = float(np.polyval(terms, zeta))
        return np.array([0.0, middle, 1.0]), np.array([first, 1.0 - first - last, last])
    humps = 2 if "2" in kind else 3
    times, shares = (
        np.array([np.polyval([float(x) for x in reversed(row.split())], zeta)
                  for row in text.split(";")])
        for text in HUMPS[humps]
    )  # fmt: skip
    if kind.endswith("hump_ei"):
        return times * damped, shares
    return times, np.append(shares[:-1], 1.0 - shares[:-1].sum())


def _ei(v: float) -> Array:
    return np.array([1.0 + v, 2.0 - 2.0 * v, 1.0 + v])


def _two(v: float) -> Array:
    x = float(np.cbrt(v * v * (1.0 + np.sqrt(1.0 - v * v))))
    end = (3.0 * x + 2.0 + 3.0 * v * v / x) / 16.0
    return np.array([end, 0.5 - end, 0.5 - end, end])


def _three(v: float) -> Array:
    end = (1.0 + 3.0 * v + np.sqrt(8.0 * v * (v + 1.0))) / 16.0
    return np.array([end, (1.0 - v) / 4.0, (1.0 + v) / 2.0 - 2.0 * end, (1.0 - v) / 4.0, end])


def lasts(behind: Filter | None) -> float:
    """How much longer a filter makes a move [s]."""
    if behind is None:
        return 0.0
    if behind.kind in ("average", "triangle"):
        return behind.time * (2.0 if behind.kind == "triangle" else 1.0)
    return float(impulses_of(behind)[0][-1])


def passes(behind: Filter | None, pole: complex) -> complex:
    """By what a filter multiplies the vibration of a mode, at the end of the longer move."""
    if behind is None:
        return 1.0 + 0j
    if behind.kind in ("average", "triangle"):
        x = pole * behind.time
        once = 1.0 + 0.5 * x if abs(x) < 1e-6 else (np.exp(x) - 1.0) / x
        return complex(once * once if behind.kind == "triangle" else once)
    delays, shares = impulses_of(behind)
    return complex(np.sum(shares * np.exp(pole * (delays[-1] - delays))))
