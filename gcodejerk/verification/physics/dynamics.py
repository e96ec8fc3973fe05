"""How fast the points of a stream follow each other: time, limits, feeds.

The time between two points is not written; it follows from the machine's interval: every block
lasts `stride` intervals, and the remainder of the division lengthens one block in the middle. Where
the control holds F over a block, its F says so too (`held`).

Velocity, acceleration and jerk are divided differences of the points. Times a factorial, such a
difference is a weighted mean of the derivative, so exact points of a motion within its limits
never exceed them, however short or long the blocks are; only the rounding of the points needs a
tolerance. That of a velocity is one step for each block: the points are rounded so that none has
more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.held import MIRRORED, Blocks, check_held, check_mirror
from gcodejerk.verification.physics.independent import check_axes
from gcodejerk.verification.physics.own_rapids import (
    conventional_counts,
    limits_of,
    own_times,
    rapid_limits,
)
from gcodejerk.verification.physics.points import Array, Index, Paths
from gcodejerk.verification.physics.residual import leaves_more

BLOCK_TIME = 0.002
"""Of a G-code block. [s]"""
RELATIVE = 1e-9


def stride_of(machine: Machine) -> int:
    """Intervals of a block in G-code."""
    return max(1, round(BLOCK_TIME / machine.interval))


@dataclass(frozen=True, slots=True, eq=False)
class Clock:
    """A guess of when each row's point is reached: whole intervals since the start."""

    moment: Index

    @classmethod
    def of(cls, paths: Paths, count: Index, stride: int, late: Index) -> Clock:
        """Blocks of `stride` intervals, the remainder of `count` in block number `late` from 0."""
        block = np.arange(len(paths.position)) - paths.begin[paths.owner]
        rest = count - paths.count * stride
        moment = block * stride + np.where(block > late[paths.owner], rest[paths.owner], 0)
        return cls(moment.astype(np.int64))


def check_dynamics(paths: Paths, machine: Machine, stride: int, found: Findings) -> None:
    """Duration, limits and feeds of streams of straight lines; feeds only where these have them."""
    usual, most = conventional_counts(paths, machine)
    blocks = paths.count
    fewest = np.where(blocks > 1, blocks * stride, 1)
    for k in np.flatnonzero(fewest > most).tolist():
        ms = 1e3 * machine.interval
        problem = f"stream lasts {fewest[k] * ms:g} ms, the rapid may last {most[k] * ms:g} ms"
        found.add(Kind.TIME, int(paths.line[k]), int(paths.original_line[k]), problem)
    highest = np.maximum(np.minimum(blocks * stride + stride - 1, most), fewest)
    count = np.clip(usual, fewest, highest)
    clock = Clock.of(paths, count, stride, blocks // 2)
    best: list[Complaint | None] = _check_points(paths, machine, clock)
    # Another duration may fit where the usual one does not: nothing says which was meant.
    for other in range(stride if stride > 1 else 0):
        for late in (blocks // 2, (blocks - 1) // 2):
            open_ = [k for k, c in enumerate(best) if c is not None]
            bad = np.array(open_, dtype=np.int64)
            guess = np.where(blocks > 1, blocks * stride + other, 1 + other)
            bad = bad[(guess[bad] >= fewest[bad]) & (guess[bad] <= highest[bad])]
            if not len(bad):
                continue
            part = paths.take(bad)
            clock = Clock.of(part, guess[bad], stride, late[bad])
            judged = _check_points(part, machine, clock)
            for k, complaint in zip(bad.tolist(), judged, strict=True):
                if complaint is None:
                    best[k] = None
    for k, complaint in enumerate(best):
        if complaint is not None:
            line = int(paths.line[k]) + max(complaint.block, 0)
            found.add(complaint.kind, line, int(paths.original_line[k]), complaint.problem)


@dataclass(frozen=True, slots=True)
class Complaint:
    """The first thing that is wrong with a stream, in block `block` from 0."""

    kind: Kind
    block: int
    problem: str


def _check_points(paths: Paths, machine: Machine, clock: Clock) -> list[Complaint | None]:
    """Look at each stream under one guess of its times."""
    out: list[Complaint | None] = [None] * len(paths.begin)
    t: Array = np.asarray(clock.moment * machine.interval, dtype=np.float64)
    independent = machine.positioning != "linear"
    has_feeds = bool(np.isfinite(paths.feed).any())
    feeds = check_held(paths, machine.interval, clock.moment) if has_feeds else []
    if has_feeds and not independent and machine.design.profile in MIRRORED:
        feeds.append(check_mirror(paths, clock.moment))
    for kind, rows, problem in (
        *(check_axes(paths, machine, t, *own_times(paths, machine)) if independent else ()),
        *_limits(paths, machine, t),
        *feeds,
    ):
        bad = np.flatnonzero(rows)
        owner = paths.owner[bad]
        for at in np.unique(owner, return_index=True)[1].tolist():
            k = int(owner[at])
            if out[k] is None:
                out[k] = Complaint(kind, int(bad[at] - paths.begin[k]) - 1, problem)
    own = rapid_limits(paths, machine)
    played, moment = paths, clock.moment
    if has_feeds:
        blocks = Blocks(paths, moment)
        played, moment = blocks.played(), blocks.arrivals()
    excess = leaves_more(played, machine, moment, own)
    for k, left, allowed in zip(*excess.columns(), strict=True):
        if out[k] is None:
            problem = (
                f"leaves {1e3 * left:.3g} um of vibration, at most {1e3 * allowed:.3g} um are "
                "left by the controller's own rapid"
            )
            out[k] = Complaint(Kind.RESIDUAL, 0, problem)
    return out


PAD = 2
"""Moments of rest in front of and behind a stream that differences reach into."""


@dataclass(frozen=True, slots=True, eq=False)
class Padded:
    """Rows of all streams with rest in front and behind."""

    row: Index
    """Row of the paths that each padded row repeats."""
    owner: Index
    t: Array

    @classmethod
    def of(cls, paths: Paths, t: Array) -> Padded:
        """Pad every stream; rest is as far apart as the first and the last block are long."""
        size = paths.end - paths.begin + 2 * PAD
        owner = np.repeat(np.arange(len(size)), size)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(size) - size, size) - PAD
        inner = np.clip(place, 0, (paths.end - paths.begin - 1)[owner])
        row = paths.begin[owner] + inner
        h = t[paths.begin + 1] - t[paths.begin]
        beyond = (place - inner) * h[owner]
        return cls(row, owner, t[row] + beyond)

    def differences(self, values: Array, order: int) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Divided differences times the factorial of their order.

        Returns
        -------
        tuple of ndarray, shape (rows - order,)
            The differences; what an error of 1 in every value may add to each; and whether each
            lies within one stream.
        """
        out, error, t = values, np.ones(len(values)), self.t
        with np.errstate(divide="ignore", invalid="ignore"):
            for k in range(1, order + 1):
                span = (t[k:] - t[:-k]) / k
                out = np.diff(out) / span
                error = (error[1:] + error[:-1]) / span
        return out, error, self.owner[order:] == self.owner[:-order]

    def rows_of(self, order: int, bad: NDArray[np.bool_], rows: int) -> NDArray[np.bool_]:
        """Mark the last row that takes part in each bad difference."""
        marked = np.zeros(rows, dtype=np.bool_)
        marked[self.row[order // 2 + 1 :][: len(bad)][bad]] = True
        return marked


_ORDERS = ((1, Kind.VELOCITY, "s"), (2, Kind.ACCELERATION, "s^2"), (3, Kind.JERK, "s^3"))


def _limits(paths: Paths, machine: Machine, t: Array) -> list[tuple[Kind, NDArray[np.bool_], str]]:
    """Compare every moving axis with what designs may use."""
    padded = Padded.of(paths, t)
    limits = limits_of(paths.displacement, machine)
    out = []
    for a in np.flatnonzero((paths.displacement != 0.0).any(axis=0)).tolist():
        x = (paths.position[:, a] - paths.start[paths.owner, a])[padded.row]
        for order, kind, unit in _ORDERS:
            value, error, inside = padded.differences(x, order)
            limit = limits[order - 1, padded.owner[: len(value)], a]
            step = paths.step[padded.owner[: len(value)], a]
            if order == 1:
                step = 0.5 * step
            bad = inside & (np.abs(value) > limit * (1.0 + RELATIVE) + error * step)
            if bad.any():
                problem = f"{AXES[a]} passes its limit of {limit[bad][0]:g} mm/{unit}"
                out.append((kind, padded.rows_of(order, bad, len(t)), problem))
    return out
