r"""F of the blocks of streams for controls that hold it over a block.

Such a control moves along a block at one speed: F is its length, between its points as they are
written, over its time.

Rule 1: F counts along the axes that it refers to: the first of XYZ, UVW, ABC that moves.
Rule 2: equal blocks have equal F: none corrects what the digits of the one before left open. Half
of F's last digit is 1.7 nm in 2 ms (42 nm in inches), so that a block of one step of 0.0001 mm
lasts its 2 ms within 33 ns, and a faster one is nearer still. For finer steps and slower blocks F
has more decimals: every block lasts its time to 0.01 % in any case. What all blocks of a rapid add
up to is right to the same share, were all of them that slow, and mostly to nanoseconds.
Rule 3: no F has more digits than the control reads in a number: a fast one has fewer decimals.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc import Rapids
from gcodejerk.planning.batch import Batch
from gcodejerk.units import MM_PER_INCH, per_minute

FEED_DECIMALS = 4
"""Of F in units per minute, at least."""
STEP_KNOWN = 2e-4
"""Last digit of F at most, of the F of a block of one step."""
FEED_GROUPS = ("XYZ", "UVW", "ABC")
"""F is the speed along the first of these groups that moves (LinuxCNC, G94)."""


@dataclass(frozen=True, slots=True, eq=False)
class Feeds:
    """F of b streams of k moments each.

    Attributes
    ----------
    whole : ndarray of int, shape (b, k)
        F of the block that ends at each moment, in whole units of its last decimal.
    decimals : ndarray of int, shape (b,)
        Of each stream's F, in program units per minute.
    digits : int
        Most digits of F: decimals that are too many are zeros in `whole`.
    """

    whole: NDArray[np.int64]
    decimals: NDArray[np.int64]
    digits: int

    def of_end(self, row: int) -> Decimal:
        """F of the last block of a stream."""
        whole, decimals = int(self.whole[row, -1]), int(self.decimals[row])
        too_many = min(max(len(str(whole)) - self.digits, 0), decimals)
        return Decimal(whole // 10**too_many).scaleb(too_many - decimals)


def mean_feeds(batch: Batch, rapids: Rapids, digits: int = 15) -> Feeds:
    """F for controls that hold it over a block: its length over its time.

    A block without length, which takes no time, has the F of the next one, or of the last that has
    a length: nothing changes, and a control that refuses a tiny F has none to refuse.

    Parameters
    ----------
    batch : Batch
        b streams.
    rapids : Rapids
        The program's, for the unit of its F.
    digits : int, optional
        Most digits of a number that the control reads.

    Returns
    -------
    Feeds
    """
    inch = rapids.inch[batch.moves]
    length, unit = np.zeros(batch.times.shape), np.ones(batch.times.shape)
    for group in FEED_GROUPS:
        way = np.zeros(batch.times.shape)
        for axis in map(AXES.index, group):
            if axis in batch.written:
                q = batch.written[axis]
                way += np.diff(q, axis=1, prepend=q[:, :1]) ** 2
        first = (length == 0.0) & (way > 0.0)
        length = np.where(first, np.sqrt(way), length)
        own = np.where(inch & (group != "ABC"), MM_PER_INCH, 1.0)
        unit = np.where(first, own[:, np.newaxis], unit)
    time = np.maximum(batch.times, 1) * batch.grid.interval
    speed = np.where(batch.times > 0, length / time / unit, np.nan)
    decimals = _decimals(batch, inch, speed)
    # Backwards first: what is left without a length stands behind all motion.
    speed = _filled(_filled(speed[:, ::-1])[:, ::-1])
    return Feeds(_in_digits(speed, decimals, digits), decimals, digits)


def _in_digits(
    speed: NDArray[np.float64], decimals: NDArray[np.int64], digits: int
) -> NDArray[np.int64]:
    """Speeds per second as F, at least its last digit: F0 is an error, and so no block has it."""
    scale = (per_minute(1.0) * 10.0**decimals)[:, np.newaxis]
    feed = np.maximum(np.rint(scale * np.nan_to_num(speed)), 1.0)
    # What has a digit too many is rounded to the last that is left; 9999.99996 may be 10000.000.
    long = np.floor(np.log10(feed) + 1e-12) + 1.0
    for _ in range(2):
        last = 10.0 ** np.clip(long - digits, 0.0, decimals[:, np.newaxis])
        feed = np.where(last > 1.0, np.rint(scale * np.nan_to_num(speed) / last) * last, feed)
        long = np.floor(np.log10(feed) + 1e-12) + 1.0
    out: NDArray[np.int64] = feed.astype(np.int64)
    return out


def _decimals(
    batch: Batch, inch: NDArray[np.bool_], speed: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Decimals of each stream's F, by the coarsest step of the axes that move.

    And by its slowest block: a finely stepped axis may creep where a coarse one pauses.
    """
    moving = batch.plans.displacement[batch.moves] != 0.0
    step = np.where(moving, batch.number_format.step, 0.0).max(axis=1)
    block = np.maximum(batch.grid.knots[:, -1] - batch.grid.knots[:, -2], 1) * batch.grid.interval
    least = per_minute(1.0) * step / np.where(inch, MM_PER_INCH, 1.0) / block
    slowest = np.where(speed > 0.0, speed, np.inf).min(axis=1)
    least = np.minimum(least, per_minute(slowest))
    needed = np.ceil(-np.log10(STEP_KNOWN * least) - 1e-9).astype(np.int64)
    decimals: NDArray[np.int64] = np.maximum(needed, FEED_DECIMALS)
    return decimals


def _filled(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows with the last number before each gap in it."""
    columns = np.arange(values.shape[1])
    known = np.maximum.accumulate(np.where(np.isnan(values), 0, columns), axis=1)
    out: NDArray[np.float64] = np.take_along_axis(values, known, axis=1)
    return out
