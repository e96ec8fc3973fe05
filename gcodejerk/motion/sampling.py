"""Samples of profiles at the command interval, many profiles at once.

This module owns the layout of sampled moves: a matrix with one move a row, *aligned at its end*, so
that the last column is every move's arrival, the column before it one step earlier, and a short
move begins far to the right. What counts is the time that is left for a vibration until arrival,
and that is the same in a whole column: a residual is one product of matrices.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex

Counts = NDArray[np.int64]

FEW = 16
"""Modes of which every exponential is computed."""
CELLS = 1 << 20
"""Exponentials that are computed at a time, of moments at frequencies: 16 MB."""
SAMPLES = 1 << 16
"""Moments of profiles that are worked out together."""
AT_ONCE = 2048
"""Moves whose steps are worked out together: those of one do not depend on others."""
GRID_TOLERANCE = 1e-6
"""A time this little above a whole number of intervals is that number [intervals]."""


@dataclass(frozen=True, slots=True, eq=False)
class Grid:
    """The moments at which moves are written, as whole intervals since each move's start.

    Attributes
    ----------
    counts : ndarray of int, shape (n,)
        Duration of each move. [intervals]
    knots : ndarray of int, shape (n, k)
        Written moments, aligned at the end: ``knots[i, -1] == counts[i]``. A row with fewer than k
        moments has zeros in front: the move has not begun. [intervals]
    interval : float
        Command interval. [s]
    """

    counts: Counts
    knots: Counts
    interval: float

    @classmethod
    def every(cls, counts: Counts, stride: int, interval: float) -> Grid:
        """Moments `stride` intervals apart.

        What the division leaves over lengthens the block in the middle of the move, where the
        velocity is nearly constant.

        Examples
        --------
        >>> Grid.every(np.array([4, 7]), 2, 0.001).knots.tolist()
        [[0, 0, 2, 4], [0, 2, 5, 7]]
        """
        blocks = np.maximum(counts // stride, 1)
        rest = counts - blocks * stride
        width = int(blocks.max(initial=1)) + 1
        block = np.arange(width) - (width - 1) + blocks[:, np.newaxis]
        late = np.where(block > (blocks // 2)[:, np.newaxis], rest[:, np.newaxis], 0)
        knots = np.where(block > 0, block * stride + late, 0)
        return cls(counts, knots.astype(np.int64), interval)

    def take(self, rows: NDArray[np.int64]) -> Grid:
        """Those of some of the moves."""
        return Grid(self.counts[rows], self.knots[rows], self.interval)

    @property
    def blocks(self) -> Counts:
        """Number of written points of each move, the start not counted."""
        blocks: Counts = np.count_nonzero(self.knots, axis=1)
        return blocks


def whole_intervals(time: Array, interval: float) -> Counts:
    """A time rounded up to whole intervals.

    A time that is longer than a whole number by rounding errors alone is that number.

    Examples
    --------
    >>> whole_intervals(np.array([0.04 + 1e-12, 0.0401]), 0.001).tolist()
    [40, 41]
    """
    counts: Counts = np.ceil(time / interval - GRID_TOLERANCE).astype(np.int64)
    return counts


def sample_profiles(profiles: Profiles, moments: Counts, interval: float) -> tuple[Array, Array]:
    """Position and velocity of unit profiles at whole intervals.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    moments : ndarray of int, shape (n, k)
        Intervals since the start of each; the profile rests at 0 before it begins and at 1 after.
    interval : float
        Command interval. [s]

    Returns
    -------
    tuple of ndarray, shape (n, k)
        Position [-] and velocity [1/s]. The position is 1 exactly from the profile's end on.
    """
    n, k = moments.shape
    position, velocity = np.empty((n, k)), np.empty((n, k))
    # The segment of each moment: profiles one behind the other on a common clock.
    totals = profiles.total
    clock = float(totals.max(initial=0.0)) + 1.0
    begins = profiles.owner * clock + profiles.begin
    rows = max(1, SAMPLES // max(k, 1))
    for begin in range(0, n, rows):
        row = np.arange(begin, min(begin + rows, n))[:, np.newaxis]
        total = totals[row]
        t = np.clip(moments[row[:, 0]] * interval, 0.0, total)
        segment = np.searchsorted(begins, row * clock + t, side="right") - 1
        segment = np.clip(segment, profiles.first[row], profiles.first[row + 1] - 1)
        tau = t - profiles.begin[segment]
        a, j = profiles.acceleration[segment], profiles.jerk[segment]
        v = profiles.velocity[segment]
        s = profiles.position[segment] + (v + (0.5 * a + j * tau / 6.0) * tau) * tau
        arrived = t >= total - GRID_TOLERANCE * interval
        position[row[:, 0]] = np.where(arrived, 1.0, np.minimum(s, 1.0))
        velocity[row[:, 0]] = np.where(arrived, 0.0, v + (a + 0.5 * j * tau) * tau)
    return position, velocity


def sampled_response(positions: Array, interval: float, poles: Complex) -> Complex:
    """Response of modes to moves sampled at every interval, straight lines between the samples.

    Parameters
    ----------
    positions : ndarray, shape (n, k)
        Positions at every interval, aligned at the end; rest before the first column.
    interval : float
        Command interval. [s]
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]

    Returns
    -------
    ndarray of complex, shape (n, m)
        The same as `polyline_response` of each row.
    """
    k = positions.shape[1]
    velocity = np.diff(positions, axis=1, prepend=positions[:, :1], append=positions[:, -1:])
    steps = np.diff(velocity, axis=1) / interval
    left = np.arange(k - 1, -1, -1) * interval
    decay = np.exp(poles[np.newaxis, :] * left[:, np.newaxis])
    # Two real products are several times faster than one of mixed type.
    response: Complex = steps @ decay.real + 1j * (steps @ decay.imag)
    return response


def knots_response(values: Array, grid: Grid, poles: Complex) -> Complex:
    """Response of modes to moves given at the grid's knots, straight lines between them.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        Positions at the knots.
    grid : Grid
        The knots.
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]

    Returns
    -------
    ndarray of complex, shape (n, m)
    """
    every = knots_steps(values, grid)
    if len(poles) > FEW:
        return steps_response(every, grid.interval, poles)
    decay = np.exp(poles * (np.arange(every.shape[1]) * grid.interval)[:, np.newaxis])
    response: Complex = every @ decay.real + 1j * (every @ decay.imag)
    return response


def steps_response(steps: Array, interval: float, poles: Complex) -> Complex:
    r"""Response of many modes to changes of velocity, by the intervals that are left.

    Parameters
    ----------
    steps : ndarray, shape (n, k)
        Of `knots_steps`.
    interval : float
        [s]
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]

    Returns
    -------
    ndarray of complex, shape (n, m)

    Notes
    -----
    Exponentials cost most. The moments are therefore taken in blocks of :math:`b` intervals, each
    of which turns as the others do: with :math:`E = e^{\lambda b h}`, and :math:`B_i` the sum of
    block i by itself, :math:`B_0 + E (B_1 + E (B_2 + \dots))` needs :math:`b + 1` of them in place
    of k. Powers of E are at most 1, so that nothing is lost.
    """
    used = np.flatnonzero(steps.any(axis=0))
    response = np.zeros((len(steps), len(poles)), dtype=np.complex128)
    if not len(used):
        return response
    last = int(used[-1])
    block = math.isqrt(last) + 1
    edges = np.searchsorted(used, np.arange(0, last + block + 1, block))
    width = max(1, CELLS // (block + len(steps)))
    for first in range(0, len(poles), width):
        some = slice(first, first + width)
        decay = np.exp(poles[some] * (np.arange(block) * interval)[:, np.newaxis])
        real, imag = decay.real.copy(), decay.imag.copy()
        turn = np.exp(poles[some] * (block * interval))
        for k in range(len(edges) - 2, -1, -1):
            response[:, some] *= turn
            columns = used[edges[k] : edges[k + 1]]
            if len(columns):
                here, at = steps[:, columns], columns - k * block
                response.real[:, some] += here @ real[at]
                response.imag[:, some] += here @ imag[at]
    return response


def knots_steps(values: Array, grid: Grid) -> Array:
    """Changes of velocity of moves in straight lines between the knots, laid out at every interval.

    Parameters
    ----------
    values : ndarray, shape (n, k)
        Positions at the knots. [mm]
    grid : Grid
        The knots.

    Returns
    -------
    ndarray, shape (n, longest + 1)
        By the time that is left until arrival, so that all moves share the exponentials; 0 where
        nothing changes. [mm/s]
    """
    every = np.zeros((len(values), int(grid.counts.max(initial=0)) + 1))
    for row in range(0, len(values), AT_ONCE):
        part = slice(row, row + AT_ONCE)
        knots = grid.knots[part]
        duration = np.diff(knots, axis=1) * grid.interval
        with np.errstate(invalid="ignore", divide="ignore"):
            velocity = np.where(duration > 0.0, np.diff(values[part], axis=1) / duration, 0.0)
        steps = np.diff(velocity, axis=1, prepend=0.0, append=0.0)
        left = grid.counts[part, np.newaxis] - knots
        # Columns before a move has begun have no step.
        begun = steps != 0.0
        every[row + np.nonzero(begun)[0], left[begun]] = steps[begun]
    return every
