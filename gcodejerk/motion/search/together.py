"""The least that moves leave which begin together: axes that run each on its own.

The vibration of an axis that arrives early decays until the last one stops, and where several axes
excite the same mode, what one leaves can cancel what another does. So what no profiles can undercut
follows from one programme for all of them, judged at the last arrival. This module owns that
programme: each move has its own limits and its own blocks of jerk, and their rows add up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import grouped
from gcodejerk.motion.search.blocks import Blocks, Ringing
from gcodejerk.motion.search.exchange import USED, exchanged
from gcodejerk.motion.search.found import Found, better
from gcodejerk.motion.search.knots import (
    FEWEST_INTERVALS,
    MOST_REFINED,
    first_knots,
    ramp_intervals,
    refined_knots,
)
from gcodejerk.motion.search.looked_at import Flags, LookedAt
from gcodejerk.motion.search.programme import Index, Solution
from gcodejerk.motion.search.socp import solve_together
from gcodejerk.motion.search.unit_move import Move, Optimum


def least_together(
    moves: Sequence[Move], until: int, reference: float, allowed: float
) -> list[Optimum] | None:
    """The profiles that together leave the least worst residual over the band.

    Parameters
    ----------
    moves : sequence of Move
        They begin together. Poles, groups, band and interval are those of all; weights have the
        sign of what adds up; there is no guard.
    until : int
        When it is judged: at the last arrival, of these moves or of one that excites none of their
        modes. [intervals]
    reference : float
        Residual of the controller's own profiles, the measure for what is small, above 0. [mm]
    allowed : float
        A residual that is as good as none, above 0. [mm]

    Returns
    -------
    list of Optimum or None
        One for each move, its `worst` that of all; None where no profiles on the grid keep the
        limits.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    if min(move.count for move in moves) < FEWEST_INTERVALS:
        return None
    search = _Search(moves, until, reference, allowed / reference)
    knots = [first_knots(move.count, ramp_intervals(move), False) for move in moves]
    found = search.least(knots)
    if found is not None and found.worst > search.allowed:
        most = MOST_REFINED // len(moves)
        finer = [
            refined_knots(own, solution.jerk, False, max(most, len(own)))
            for own, solution in zip(knots, found.solutions, strict=True)
        ]
        if any(len(cut) > len(own) for cut, own in zip(finer, knots, strict=True)):
            found = better(found, search.least(finer, found.active))
    if found is None:
        return None
    return [
        Optimum(blocks.knots, solution.jerk / move.count**3, found.worst * reference)
        for move, blocks, solution in zip(moves, found.every, found.solutions, strict=True)
    ]


@dataclass(frozen=True, slots=True, eq=False)
class _Found(Found):
    """What was found for several moves: the blocks and the solution of each."""

    every: list[Blocks]
    solutions: list[Solution]


class _Search:
    """The moves, and the frequencies that they share."""

    def __init__(self, moves: Sequence[Move], until: int, reference: float, allowed: float) -> None:
        self.moves, self.allowed = moves, allowed
        weights: Array = np.stack([move.weights for move in moves]) / reference
        used = weights.any(axis=0)
        _, group = np.unique(moves[0].group[used], return_inverse=True)
        poles, band, interval = moves[0].poles[used], moves[0].band, moves[0].interval
        # The same frequencies for all, each move with its own weights.
        self.looked_at = [
            LookedAt.of(poles, own[used], group, band, until * interval) for own in weights
        ]
        self.ringing = Ringing.of(self.looked_at[0], 0, until, until, interval)
        self.curved = False

    def least(self, knots: list[Index], active: Flags | None = None) -> _Found | None:
        """The least residual for these blocks, from the frequencies that are active."""
        blocks = [
            Blocks.until(looked_at, own, move.interval, self.ringing)
            for looked_at, own, move in zip(self.looked_at, knots, self.moves, strict=True)
        ]
        first = self.looked_at[0]
        free = np.full(len(first.first), np.nan)

        def solved(active: Flags, cost: float) -> _Found | None:
            problems = [
                own.problem(move, active, free)
                for own, move in zip(blocks, self.moves, strict=True)
            ]
            cost /= len(problems)
            solutions = solve_together(problems, USED * self.allowed, cost, self.curved)
            if solutions is None:
                return None
            self.curved |= solutions[0].curved
            seen = np.zeros(len(blocks[0].cone))
            for own, solution in zip(blocks, solutions, strict=True):
                seen += own.seen(solution.jerk)
            left = grouped(np.abs(seen), blocks[0].cone)
            peak = float(np.mean([solution.peak for solution in solutions]))
            usual = replace(solutions[0], peak=peak)
            return _Found(first, blocks[0], active, usual, left, blocks, solutions)

        return exchanged(solved, first.first if active is None else active, self.allowed)
