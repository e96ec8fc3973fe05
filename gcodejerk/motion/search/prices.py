r"""What another jerk in each interval would be worth, and where blocks of jerk have to be cut.

A programme of long blocks says with its multipliers what every plane and every limit is worth. What
a little more jerk in one interval, whose block it is not, would leave more or less follows from
them: the switching function of optimal control. Where it is positive the jerk ought to be at its
lower limit, where it is negative at its upper one. A block within which it changes its sign loses
something by being one block: at most the peak jerk times the integral of the function's modulus,
less the modulus of its integral. So blocks are cut where the sign changes, those that lose most
first, and knots between equal jerks are left out again (column generation, in terms of linear
programmes).

This module owns that function and the knots that follow from it.

Rule: knots are left out only where that changes nothing: the profile that was found remains one of
the next programme.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.blocks import Blocks
from gcodejerk.motion.search.cutting import Cutting, Weights
from gcodejerk.motion.search.knots import refined_knots
from gcodejerk.motion.search.looked_at import Index

FEWER = 120
"""Blocks at most that are cut where the jerk acts."""
SAME = 1e-3
"""Jerks whose difference is below this share of the peak are equal."""


@dataclass(frozen=True, slots=True, eq=False)
class Priced:
    """Knots for the next programme.

    Attributes
    ----------
    knots : ndarray of int
        Of the blocks that are no images of others. [intervals]
    lost : float
        What the blocks might lose at most by being no shorter, with these multipliers; 0 where
        there are no better knots. [-]
    """

    knots: Index
    lost: float


def priced_knots(blocks: Blocks, cutting: Cutting, enough: float, most: int) -> Priced:
    """Blocks cut where the switching function changes its sign within them.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    cutting : Cutting
        Their programme, solved.
    enough : float
        What blocks that stay as they are may lose. [-]
    most : int
        Blocks at most, images not counted.

    Returns
    -------
    Priced
    """
    within, along = switching_function(blocks, cutting.weights())
    own = _own_knots(blocks, len(within))
    jerk = cutting.jerk()[: len(own) - 1]
    peak = float(np.abs(jerk).max(initial=0.0)) / blocks.knots[-1]
    lost = peak * _lost(along, own)
    different = np.abs(np.diff(jerk)) > SAME * np.abs(jerk).max(initial=0.0)
    kept = own[np.concatenate([[True], different, [True]])]
    changes = np.flatnonzero(np.diff(np.sign(along))) + 1
    changes = np.setdiff1d(changes, own)
    loss = lost[np.searchsorted(own, changes, side="right") - 1]
    order = np.argsort(-loss, kind="stable")
    # Small losses are left as they are, as many as may be lost.
    sizes = np.sort(lost)
    small = sizes[np.cumsum(sizes) <= enough].max(initial=0.0)
    chosen = order[loss[order] > small]
    knots, room = own, most + 1 - len(kept)
    if len(chosen) > room:
        # Prices of far too few blocks say little: they are cut where the jerk acts.
        knots = refined_knots(own, jerk, False, FEWER)
    if np.array_equal(knots, own):
        knots = np.union1d(kept, changes[chosen[: max(room, 0)]])
    most_lost = 0.0 if np.array_equal(knots, own) else peak * float(_lost(within, own).sum())
    return Priced(knots, most_lost)


def _lost(switching: Array, own: Index) -> Array:
    """What each block might lose at most by being one block, for a unit jerk, shape (k,)."""
    positive = np.cumsum(np.append(0.0, np.maximum(switching, 0.0)))
    negative = np.cumsum(np.append(0.0, np.maximum(-switching, 0.0)))
    lost: Array = 2.0 * np.minimum(np.diff(positive[own]), np.diff(negative[own]))
    return lost


def switching_function(blocks: Blocks, weights: Weights) -> tuple[Array, Array]:
    """What is left more for a unit jerk of unit duration, in each interval.

    Of intervals whose block is no image of another, and together with those of the image.

    Parameters
    ----------
    blocks : Blocks
        The blocks.
    weights : Weights
        Of the limits and planes of their programme.

    Returns
    -------
    within : ndarray, shape (n,)
        In each block on the whole what its own limit says, as it is where the least is found.
    along : ndarray, shape (n,)
        The same on the whole only for all blocks: as steps have found it so far.
    """
    count = blocks.knots[-1]
    left = count * blocks.everywhere(weights.rows)
    own = _own_knots(blocks, len(left))
    ends, moment = own / count, (np.arange(len(left)) + 0.5) / count
    if blocks.mirrored:
        # The length of both halves, and of the cruise between them.
        last = ends[-1] if blocks.cruise else 0.5
        ahead = last - moment
        left += weights.ends[0] * (ahead**2 + (1.0 - 2.0 * last) * ahead)
    else:
        ahead = 1.0 - moment
        left += weights.ends[0] * 0.5 * ahead**2 + weights.ends[1] * ahead
    # A jerk acts on the accelerations behind it, on speeds with the time until then.
    speeds = blocks.knots[1 : len(weights.speeds) + 1] / count
    half = 0.5 * np.diff(blocks.knots)[1 : len(weights.controls) + 1] / count
    left += _behind(moment, ends[1 : len(weights.accelerations) + 1], weights.accelerations)
    left += _behind(moment, speeds, weights.speeds * speeds + weights.controls * (speeds + half))
    left -= moment * _behind(moment, speeds, weights.speeds + weights.controls)
    # At the least, a block's own jerk is worth what its limit is. It is not yet where steps still
    # go on, and up to what is the same for all intervals, for at the end there is rest.
    sizes = np.diff(own)
    of_jerks = weights.jerks[: len(sizes)]
    wrong = (np.add.reduceat(left, own[:-1]) + count * of_jerks) / sizes
    within: Array = left - np.repeat(wrong, sizes)
    along: Array = left - (wrong * sizes).sum() / sizes.sum()
    return within, along


def _behind(moment: Array, place: Array, weight: Array) -> Array:
    """Sum of the weights whose places, ascending, are behind each moment."""
    sums = np.append(np.cumsum(weight[::-1])[::-1], 0.0)
    behind: Array = sums[np.searchsorted(place, moment, side="right")]
    return behind


def _own_knots(blocks: Blocks, intervals: int) -> Index:
    """Ends of the blocks that are no images of others; of one in the middle, of its half."""
    own: Index = np.append(blocks.knots[blocks.knots < intervals], intervals)
    return own
