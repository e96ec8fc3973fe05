r"""Rounding of positions to the machine's resolution, without shaking it.

Plain rounding adds noise of all frequencies, the modes' own among them. Here each rounding error is
fed back: a running sum per mode says how the errors made so far will still ring at this moment, and
the next position is rounded so that the sum shrinks. It is a noise shaper whose loop filter is the
modes themselves, so it has its zeros at their poles, damping included, for any number of modes.

Rule 1: a rounded position is one of the two neighbours of the exact one: the error stays below one
step, whatever the modes.
Rule 2: a rounded move never goes backwards and never passes its end.
Rule 3: where the points set the speed, no block is faster than the highest speed by a step or more.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.sampling import Counts, Grid

WHOLE = 1e-6
"""What is so near a whole step is one. [steps]"""


def round_positions(
    positions: Array,
    grid: Grid,
    step: Array,
    origin: Array,
    poles: Complex,
    weights: Array,
    highest: Array | None = None,
) -> Counts:
    r"""Positions as whole steps from an origin, their noise kept away from the modes.

    Parameters
    ----------
    positions : ndarray, shape (n, k)
        Exact positions of one axis at the grid's knots, monotone in each row. [mm]
    grid : Grid
        When they are written.
    step : ndarray, shape (n,)
        The smallest step that is written. [mm]
    origin : ndarray, shape (n,)
        Where the steps are counted from. [mm]
    poles : ndarray of complex, shape (m,)
        Of the modes that the axis excites. [rad/s]
    weights : ndarray, shape (m,)
        Their participation. [-]
    highest : ndarray, shape (n,), optional
        Speed that the exact positions never exceed. A block then has at most as many steps as that
        speed rounded up to whole steps per block; two errors of rounding are up to two steps too
        many otherwise. [mm/s]

    Returns
    -------
    ndarray of int, shape (n, k)
        Whole steps. The first and last column are the nearest to the exact ends, which are
        written as the program gave them, not from here.

    Notes
    -----
    With :math:`z = e^{\lambda \tau}` for the time :math:`\tau` between two knots and e the errors,
    a mode keeps :math:`R = \sum_i e_i z^{k-i}`, times a constant. Choosing between the two
    neighbours the one with the smaller weighted sum of :math:`|R|^2` is rounding of :math:`x -
    \mathrm{Re}\,\overline{z R}`.

    The lower neighbour is always within `highest`: with :math:`x_i \le x_{i-1} + V\tau`,
    :math:`\lfloor x_i \rfloor \le \lfloor x_{i-1} \rfloor + \lceil V\tau \rceil`.
    """
    n, k = positions.shape
    # Rows in order of length, so that those under way in a column are the first ones.
    order = np.argsort(-grid.blocks, kind="stable")
    direction = np.where(positions[order, -1] >= positions[order, 0], 1.0, -1.0)
    scale = direction / step[order]
    x = (positions[order] - origin[order, np.newaxis]) * scale[:, np.newaxis]
    last = np.floor(x[:, -1] + WHOLE)
    previous = np.minimum(np.ceil(x[:, 0] - WHOLE), last)
    # One row for each knot from here on.
    exact = np.ascontiguousarray(x.T)
    below = np.floor(exact + WHOLE)
    above = np.minimum(np.ceil(exact - WHOLE), last)
    half = exact + 0.5
    out = np.rint(exact)
    blocks = grid.blocks[order]
    duration = np.diff(grid.knots, axis=1)[order]
    most = None if highest is None else _most_steps(highest[order] / step[order], duration, grid)
    if not len(poles):  # nothing to feed back: all knots at once, and never a step too many
        begun = np.arange(1, k - 1)[:, np.newaxis] >= k - blocks
        nearest = np.minimum(np.maximum(np.floor(half), below), above)[1:-1]
        nearest = np.maximum.accumulate(np.where(begun, nearest, previous), axis=0)
        out[1:-1] = np.where(begun, np.maximum(nearest, previous), out[1:-1])
        return _in_order(out, direction, order)
    under_way = np.searchsorted(-blocks, -np.arange(k - 1, 0, -1), side="right")
    share = _shares(poles, weights)
    running = np.zeros((n, len(poles)), dtype=np.complex128)
    usual = int(np.median(duration[:, -1])) if n else 1
    step_phase = np.exp(poles * usual * grid.interval)
    differs = (duration != usual) & (np.arange(n)[:, np.newaxis] < under_way)
    some_differ = differs.any(axis=0)
    begin, together = (int(np.searchsorted(under_way[:-1], m)) for m in (1, 2))
    if begin < together:
        knots = slice(1 + begin, 1 + together)
        longer = np.where(differs[0], duration[0] - usual, 0)[begin:together]
        reach = np.full(together - begin, np.inf) if most is None else most[begin:together, 0]
        columns = (exact[knots, 0], half[knots, 0], below[knots, 0], above[knots, 0], longer, reach)
        out[knots, 0] = _alone(columns, previous, running, share, step_phase, poles, grid.interval)
    for knot, m in enumerate(under_way[together:-1].tolist(), 1 + together):
        ringing, before = running[:m], previous[:m]
        ringing *= step_phase
        if some_differ[knot - 1]:
            long = differs[:m, knot - 1]
            phase = poles * (duration[:m, knot - 1][long, np.newaxis] - usual) * grid.interval
            ringing[long] *= np.exp(phase)
        rounded = np.floor(half[knot, :m] - ringing.real @ share)
        np.maximum(rounded, below[knot, :m], out=rounded)
        np.minimum(rounded, above[knot, :m], out=rounded)
        if most is not None:
            np.minimum(rounded, before + most[knot - 1, :m], out=rounded)
        np.maximum(rounded, before, out=before)
        out[knot, :m] = before
        ringing += (before - exact[knot, :m])[:, np.newaxis]
    return _in_order(out, direction, order)


def has_step(start: Array, end: Array, step: Array) -> NDArray[np.bool_]:
    """Whether moves have a whole step on their way, their ends among it; else none can be rounded.

    Parameters
    ----------
    start, end : ndarray, shape (n,)
        Counted from where the steps are. [mm]
    step : ndarray, shape (n,)
        [mm]

    Examples
    --------
    >>> has_step(np.array([1.56, 1.56]), np.array([1.54, 1.5]), np.array([0.1, 0.1])).tolist()
    [False, True]
    """
    low, high = np.minimum(start, end) / step, np.maximum(start, end) / step
    has: NDArray[np.bool_] = np.ceil(low - WHOLE) <= np.floor(high + WHOLE)
    return has


def _most_steps(speed: Array, duration: Counts, grid: Grid) -> Array:
    """Steps of each block at most, a row for each block, from steps per second, shape (n,)."""
    exact = speed[:, np.newaxis] * (duration * grid.interval)
    most: Array = np.ascontiguousarray(np.ceil(exact - 1e-9).T)
    return most


def _alone(
    columns: tuple[NDArray[Any], ...], previous: Array, running: Complex, share: Array,
    step_phase: Complex, poles: Complex, interval: float,
) -> list[float]:  # fmt: skip
    """The knots at which the longest move alone is under way: without arrays of a single number.

    What has been rounded last, and what rings of it, stays in the first rows of `previous` and
    `running`. The columns are the exact positions, those plus 0.5, the neighbours below and above,
    how much longer than usual the block before each is [intervals], and its steps at most.
    """
    ringing, before = running[:1], float(previous[0])
    written = []
    for exact, half, below, above, longer, reach in zip(
        *(c.tolist() for c in columns), strict=True
    ):
        ringing *= step_phase
        if longer:
            ringing *= np.exp(poles * longer * interval)
        nearest = float(math.floor(half - (ringing.real @ share).item()))
        before = max(min(max(nearest, below), above, before + reach), before)
        written.append(before)
        ringing += before - exact
    previous[0] = before
    return written


def _in_order(out: Array, direction: Array, order: NDArray[np.intp]) -> Counts:
    """Whole steps as the caller has them: one row a move, signed, in the moves' own order."""
    whole = np.empty(out.shape[::-1], dtype=np.int64)
    whole[order] = (out * direction).T.astype(np.int64)
    return whole


def _shares(poles: Complex, weights: Array) -> Array:
    """What each mode has to say, as shares of 1: the square of what an error does to it.

    An error of the position is a second difference of the acceleration's integral, so it moves a
    mode by a part that grows with the frequency.
    """
    say: Array = (np.abs(weights) * np.abs(poles)) ** 2
    total = say.sum()
    return say / total if total > 0.0 else say
