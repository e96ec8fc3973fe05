r"""F of a control that holds it over a block: the block's length over its time.

Straight lines at one speed each: whatever the control was planned to do, the points and F words say
when it is where. This module owns what follows:

- F of each block is its length over the time between its points, to the last digit of F;
- a block without length takes no time, and says the F of the next block that has a length, or of
  the last one that has; in the middle of the motion the next block takes its time as well;
- all blocks together last as long as the rapid, less what is lost in front of the motion and behind
  it to blocks without length;
- of a profile that is its own mirror image the points are too, up to their rounding: two increments
  that changed places with their F words are a motion, but not that one.

Rule: the length is that between the points as they are written, never that of a profile.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.units import SECONDS_PER_MINUTE
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.physics.points import TINY, Array, Index, Paths

Rows = NDArray[np.bool_]

FEED_DIGIT = 1.05e-4
"""Last digit of F, with its own rounding. [units/min]"""
DIGIT = 1.05
"""The same of an F that has no more digits than the control reads. [last digits]"""
FLOAT = 4e-12
"""Rounding of float64 in a length. [mm] or [deg]"""
NO_LENGTH = 1e-5
"""A block in which no axis moves this share of a step has no length. [steps]"""
MIRRORED = ("condition3", "symmetric", "cascade")
"""Profiles that are their own mirror image, over the whole time of the rapid."""
DRIFT = 0.5
"""What the digits of all F words together may make of the time. [intervals]"""


class Blocks:
    """Blocks of streams as a control that holds F runs them; a row is the block that ends there."""

    def __init__(self, paths: Paths, moment: Index) -> None:
        self.paths, self.moment = paths, moment
        owner = self.owner = paths.owner
        self.first = np.zeros(len(owner), dtype=np.bool_)
        self.first[paths.begin] = True
        delta = np.abs(np.diff(paths.position, axis=0, prepend=paths.position[:1]))
        delta = np.where(self.first[:, np.newaxis], 0.0, delta)
        self.moves: Rows = np.any(delta > NO_LENGTH * paths.step[owner], axis=1)
        self.length, self.unit = _lengths(delta, paths.unit[owner])
        rows = np.arange(len(owner))
        before = np.maximum.accumulate(np.where(self.moves, rows, -1))
        before = np.concatenate([[-1], before[:-1]])
        in_front = before <= paths.begin[owner]
        begun = np.where(in_front, np.maximum(rows - 1, 0), before)
        self.time: Index = np.where(self.moves, moment - moment[begun], 0)
        """Of each block; 0 without length. [intervals]"""
        after = np.where(self.moves, rows, len(rows))[::-1]
        self.next = np.minimum.accumulate(after)[::-1]
        """Row of the next block with a length, this one included."""
        self.next = np.where(self.next < paths.end[owner], self.next, before)

    def arrivals(self) -> Index:
        """The moments of the rows, none of them behind the end of the last block with a length."""
        reached = np.where(self.moves, self.moment, 0)
        return np.minimum(self.moment, np.maximum.reduceat(reached, self.paths.begin)[self.owner])

    def played(self) -> Paths:
        """The paths with their points where they are at these moments."""
        paths, to = self.paths, self.next
        whole = self.time[to]
        left = self.moment[to] - self.moment
        within = ~self.moves & (left > 0) & (left < whole)
        if not within.any():
            return paths
        share = np.where(within, left / np.maximum(whole, 1), 0.0)[:, np.newaxis]
        ahead = np.where(within[:, np.newaxis], paths.position[to], paths.position)
        return replace(paths, position=ahead + share * (paths.position - ahead))


def _lengths(delta: Array, unit: Array) -> tuple[Array, Array]:
    """Length of each block along what F refers to [mm], and mm per unit of it."""
    length, per_unit = np.zeros(len(delta)), np.ones(len(delta))
    for axes in (slice(0, 3), slice(6, 9), slice(3, 6)):
        way = np.sqrt((delta[:, axes] ** 2).sum(axis=1))
        first = (length == 0.0) & (way > 0.0)
        length = np.where(first, way, length)
        per_unit = np.where(first & (axes.start != 3), unit, per_unit)
    return length, per_unit


def check_held(paths: Paths, interval: float, moment: Index) -> list[tuple[Kind, Rows, str]]:
    """Judge the F words of streams for controls that hold F over a block.

    Parameters
    ----------
    paths : Paths
        The streams.
    interval : float
        Of the machine. [s]
    moment : ndarray of int, shape (rows,)
        When each point is reached. [intervals]

    Returns
    -------
    list of tuple
        Kind, rows that break it, and the problem.
    """
    blocks = Blocks(paths, moment)
    moves, owner, unit = blocks.moves, blocks.owner, blocks.unit / SECONDS_PER_MINUTE
    feed = np.where(blocks.first, 0.0, np.nan_to_num(paths.feed)) * unit
    time = np.maximum(blocks.time, 1) * interval
    # An end that no six decimals write is read as these have it.
    short = paths.position[paths.end - 1] - (paths.start + paths.displacement)
    error = np.full(len(owner), FLOAT)
    error[paths.end - 1] += np.sqrt((short**2).sum(axis=1))
    whole = np.floor(np.log10(np.maximum(np.nan_to_num(paths.feed), 1.0)) + 1e-12) + 1.0
    digit = np.maximum(FEED_DIGIT, DIGIT * 10.0 ** (whole - paths.digits)) * unit
    off = moves & (np.abs(feed - blocks.length / time) > digit + error / time)
    said = paths.feed[np.clip(blocks.next, 0, len(owner) - 1)]
    silent = ~moves & ~blocks.first
    out = [
        (Kind.FEED, off, "F is not the length of its block over its time"),
        (Kind.FEED, silent & (paths.feed != said), "F of a block without length is not its own"),
    ]
    with np.errstate(divide="ignore", invalid="ignore"):
        lasts = np.where(moves, blocks.length / feed, 0.0)
        known = np.where(moves, time * np.minimum(digit / feed, 1.0), 0.0)
    begin = paths.begin
    excess = np.abs(np.add.reduceat(np.where(moves, lasts - time, 0.0), begin))
    late = np.zeros(len(owner), dtype=np.bool_)
    late[paths.end - 1] = ~(excess <= DRIFT * interval + np.add.reduceat(known, begin))
    return [*out, (Kind.TIME, late, "the blocks do not add up to the time of the rapid")]


def check_mirror(paths: Paths, moment: Index) -> tuple[Kind, Rows, str]:
    """Compare the points of streams with their mirror images, where there is a point at that time.

    Parameters
    ----------
    paths : Paths
        The streams, of straight lines with a profile of `MIRRORED`.
    moment : ndarray of int, shape (rows,)
        When each point is reached, rising within each stream. [intervals]
    """
    owner = paths.owner
    total = moment[paths.end - 1]
    # All streams on one clock, on which none meets another.
    clock = np.cumsum(total + 1) - total - 1
    wanted = (clock + total)[owner] - moment
    at = np.minimum(np.searchsorted(clock[owner] + moment, wanted), len(owner) - 1)
    known = (clock[owner] + moment)[at] == wanted
    moved = paths.position - paths.start[owner]
    left = paths.displacement[owner] - moved[at]
    steps = 2.0 * paths.step[owner] + TINY
    bad: Rows = known & np.any(np.abs(moved - left) > steps, axis=1)
    return Kind.FEED, bad, "the points are not those of a profile that is its own mirror image"
