"""The optimum of moves that begin together: axes that run each on its own.

The vibration of an axis that arrives early decays until the last one stops, and where several axes
excite the same mode, what one leaves can cancel what another does. So what no profiles can undercut
follows from one programme for all of them, judged at the last arrival. This module owns that
programme: each move has its own limits and its own blocks of jerk, and their rows add up.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.residual import grouped
from gcodejerk.motion.search.blocks import Blocks, Ringing
from gcodejerk.motion.search.exchange import USED, exchanged
from gcodejerk.motion.search.found import GUARDED, Found, better
from gcodejerk.motion.search.guard import guarded_response
from gcodejerk.motion.search.knots import (
    FEWEST_INTERVALS,
    MOST_REFINED,
    coarse_knots,
    first_knots,
    ramp_intervals,
    refined_knots,
)
from gcodejerk.motion.search.looked_at import Flags, LookedAt
from gcodejerk.motion.search.programme import Index, Solution
from gcodejerk.motion.search.refining import Asked
from gcodejerk.motion.search.socp import solve_together
from gcodejerk.motion.search.unit_move import Move, Optimum

OFF = 0.2
"""Relative error of how strongly each move excites a mode, to which what cancels is robust."""
MOST_GUARDED, MOST_OF_MANY = 220, 500
"""Blocks of all moves together at most, where frequencies are guarded, and where there are more
than `MANY`: programmes of twice as many would take ten seconds each."""
MANY = 50
"""Frequencies."""
ROUNDS = 10
"""Programmes at most, until all frequencies keep what they may: each move has its own."""


def least_together(
    moves: Sequence[Move], until: int, reference: float, allowed: float, slack: float = 0.0,
    settled: float = 0.0,
) -> list[Optimum] | None:  # fmt: skip
    """The profiles that together leave the least worst residual over the band.

    What cancels does so only as far as it is known how strongly each move excites a mode: where
    there is slack, which is where profiles are designed, that may be wrong by `OFF` for each of
    them.

    Parameters
    ----------
    moves : sequence of Move
        They begin together. Poles, groups, band and interval are those of all; weights have the
        sign of what adds up. Each keeps its own guard, for who knows what adds up of modes that
        nobody named.
    until : int
        When it is judged: at the last arrival, of these moves or of one that excites none of their
        modes. [intervals]
    reference : float
        Residual of the controller's own profiles, the measure for what is small, above 0. [mm]
    allowed : float
        A residual that is as good as none, above 0. [mm]
    slack, settled : float, optional
        As of `near_least`: what may be left above the least, for less peak jerk. [mm]

    Returns
    -------
    list of Optimum or None
        One for each move, its `worst` that of all, with what may be wrong; None where no profiles
        on the grid keep the limits and the guards.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    if min(move.count for move in moves) < FEWEST_INTERVALS:
        return None
    asked = Asked(allowed / reference, settled / reference, slack / reference, today=1.0)
    search = _Search(moves, until, reference, OFF if slack else 0.0)
    found = search.first(asked.allowed)
    # Shorter blocks cannot gain more than there is.
    if found is not None and not found.meets(max(asked.allowed, asked.slack)):
        finer = search.finer(found)
        found = better(found, search.least(finer, asked.allowed, found)) if finer else found
    if found is None or not found.guards:
        return None
    found = search.smoother(found, asked)
    return [
        Optimum(blocks.knots, solution.jerk / move.count**3, found.worst * reference)
        for move, blocks, solution in zip(moves, found.every, found.solutions, strict=True)
    ]


def _first_knots(move: Move) -> Index:
    """Ends of the first blocks of a move; where frequencies are guarded, which are many, few."""
    ramp = ramp_intervals(move)
    return coarse_knots(move, ramp) if move.guard else first_knots(move.count, ramp, False)


def mixed_signs(count: int) -> list[tuple[int, ...]]:
    """All ways to give so many numbers signs that are not all the same."""
    signs = itertools.product((1, -1), repeat=count)
    return [own for own in signs if len(set(own)) > 1]


def _scaled(weights: Array, off: float) -> tuple[Index, Array, Index]:
    """Every mode, and those that several moves excite also with weights that are wrong by `off`.

    Of what adds up the largest is at such corners; who is wrong alike for all is nothing new.

    Parameters
    ----------
    weights : ndarray, shape (r, m)
        Of r moves.
    off : float
        Relative error. [-]

    Returns
    -------
    mode : ndarray of int, shape (q,)
    factor : ndarray, shape (r, q)
        By which the weights of each are multiplied.
    which : ndarray of int, shape (q,)
        Counts those of one mode.
    """
    modes, factors, which = [], [], []
    for mode in np.flatnonzero(weights.any(axis=0)).tolist():
        moving = np.flatnonzero(weights[:, mode])
        for k, signs in enumerate([(0,) * len(moving), *(mixed_signs(len(moving)) if off else [])]):
            factor = np.ones(len(weights))
            factor[moving] += off * np.array(signs)
            modes.append(mode)
            factors.append(factor)
            which.append(k)
    return np.array(modes), np.stack(factors, axis=1), np.array(which)


@dataclass(frozen=True, slots=True, eq=False)
class _Found(Found):
    """What was found for several moves: the blocks and the solution of each."""

    every: list[Blocks]
    solutions: list[Solution]


class _Search:
    """The moves, and the frequencies that they share."""

    def __init__(self, moves: Sequence[Move], until: int, reference: float, off: float) -> None:
        self.moves = moves
        weights: Array = np.stack([move.weights for move in moves]) / reference
        mode, factor, which = _scaled(weights, off)
        _, group = np.unique([moves[0].group[mode], which], axis=1, return_inverse=True)
        group, weights = group.reshape(-1), weights[:, mode] * factor
        poles, band, interval = moves[0].poles[mode], moves[0].band, moves[0].interval
        # The same frequencies for all: every move has its own weights, and its own guard.
        guards = [
            guarded_response(move, move.poles[move.weights != 0.0], move.count * interval)
            or (np.zeros(0), np.zeros(0))
            for move in moves
        ]
        omega, allowed = (np.concatenate(part) for part in zip(*guards, strict=True))
        guarded = np.repeat(np.arange(len(moves)), [len(own) for own, _ in guards])
        self.looked_at = [
            LookedAt.of(
                poles, own, group, band, until * interval,
                (omega, np.where(guarded == k, allowed, np.inf)),
            )
            for k, own in enumerate(weights)
        ]  # fmt: skip
        self.cap = np.where(self.looked_at[0].source < 0, GUARDED, np.nan)
        self.ringing = Ringing.of(self.looked_at[0], 0, until, until, interval)
        self.curved = False
        many = np.count_nonzero(self.looked_at[0].first) > MANY
        self.most = MOST_GUARDED if guarded.size else MOST_OF_MANY if many else MOST_REFINED

    def first(self, allowed: float) -> _Found | None:
        """The least residual for the first blocks; None where none keep the limits."""
        found = self.least([_first_knots(move) for move in self.moves], allowed)
        if found is not None or any(move.guard for move in self.moves):
            return found
        # Where a velocity or acceleration is just enough, long blocks can be what is in the way.
        if sum(move.count for move in self.moves) > self.most:
            return None
        return self.least([np.arange(move.count + 1) for move in self.moves], allowed)

    def least(
        self, knots: list[Index], allowed: float, start: _Found | None = None
    ) -> _Found | None:
        """The least residual for these blocks, from the frequencies that were active."""
        blocks = [
            Blocks.until(looked_at, own, move.interval, self.ringing)
            for looked_at, own, move in zip(self.looked_at, knots, self.moves, strict=True)
        ]
        first = self.looked_at[0]

        def solved(active: Flags, cost: float) -> _Found | None:
            problems = [
                own.problem(move, active, self.cap)
                for own, move in zip(blocks, self.moves, strict=True)
            ]
            cost /= len(problems)
            solutions = solve_together(problems, USED * allowed, cost, self.curved)
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

        active = first.first if start is None else start.active
        return exchanged(solved, active, allowed, ROUNDS)

    def smoother(self, found: _Found, asked: Asked) -> _Found:
        """With less peak jerk, for what may be left above the least."""
        if found.worst <= asked.allowed or not asked.slack:
            return found
        enough = found.worst + asked.given(found.worst)
        if found.worst <= USED * asked.settled:
            enough = min(enough, asked.settled)
        smooth = self.least([own.knots for own in found.every], enough, found)
        return smooth if smooth is not None and smooth.meets(enough) else found

    def finer(self, found: _Found) -> list[Index] | None:
        """Ends of shorter blocks where the jerk acts; None where there are none."""
        knots = [own.knots for own in found.every]
        most = self.most // len(self.moves)
        cut = [
            refined_knots(own, solution.jerk, False, max(most, len(own)))
            for own, solution in zip(knots, found.solutions, strict=True)
        ]
        return cut if sum(map(len, cut)) > sum(map(len, knots)) else None
