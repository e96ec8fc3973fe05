r"""The optimum: of all jerk sequences on the command grid, the one that leaves modes most still.

This module owns the questions that the cone programme of `socp` leaves open for one move:

* *which frequencies*. A mode is known to a relative band only; the residual is a smooth function
  of the frequency, which some points pin down. The programme is solved for a few; where the
  residual between them is larger, that frequency is added and it is solved again. What `guard`
  holds down are hundreds of frequencies: there `cutting` adds planes, not cones, and cones are
  asked only where its solver gives up;
* *which blocks* (`knots`). A move with a long cruise is accelerated and braked alike, and only one
  of the two is designed: what both leave in the worst phase is held down, and frequencies need to
  be no closer than for one;
* *how good is good enough*. A null of nanometres costs the full jerk; within a residual that does
  not matter the smoothest profile is taken.

Rule: what is returned has been judged on a dense grid of frequencies, not on the points that it was
designed on.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gcodejerk.motion.search.blocks import Blocks
from gcodejerk.motion.search.exchange import USED, exchanged
from gcodejerk.motion.search.found import GUARDED, Found, better
from gcodejerk.motion.search.guard import guarded_response
from gcodejerk.motion.search.knots import (
    FEWEST_INTERVALS,
    MOST_REFINED,
    coarse_knots,
    coarse_ramp,
    first_knots,
    most_blocks,
    ramp_intervals,
    ramp_knots,
    refined_knots,
)
from gcodejerk.motion.search.looked_at import Flags, LookedAt
from gcodejerk.motion.search.programme import Index, Problem
from gcodejerk.motion.search.refining import Asked, refined, within
from gcodejerk.motion.search.socp import smoothest_null, solve
from gcodejerk.motion.search.unit_move import Move, Optimum

NEARLY = 1.5
"""Where a whole move leaves no more than so many times what is allowed, its ramps may leave less:
their blocks are shorter. So may cones, where they can have a block for each interval."""
MATTERS = 0.5
"""Share of what the worst frequency leaves, from which on others matter."""
WORK = 1e7
"""Rows of cones times the square of blocks, up to which a programme takes a third of a second.
Where as many blocks as there ought to be are more work, planes are cut."""


def least_residual(move: Move, reference: float) -> Optimum | None:
    """The profile of least worst residual, whatever its jerk within the limit.

    Parameters
    ----------
    move : Move
        At least one pole has a weight above zero.
    reference : float
        Residual of the controller's own profile, the measure for what is small. [mm]

    Returns
    -------
    Optimum or None
        None where no profile on the grid keeps the limits, and the guard.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    search = _Search(move, reference)
    return search.optimum(search.null() or search.least(Asked(0.0)))


def near_least(move: Move, slack: float, settled: float, reference: float) -> Optimum | None:
    """Of the profiles that leave hardly more than the least, the one of least peak jerk.

    Parameters
    ----------
    move : Move
        At least one pole has a weight above zero.
    slack : float
        What may be left above the least: a residual that does not matter, above zero. [mm]
    settled : float
        Where the least is no more than this, what is found leaves no more either. [mm]
    reference : float
        As in `least_residual`; of what is gained on it, only a part is given for less jerk. [mm]

    Returns
    -------
    Optimum or None
        As of `least_residual`.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    search = _Search(move, reference)
    most, slack, today = (size / search.unit for size in (settled, slack, reference))
    asked = Asked(min(slack, 0.5 * most), most, slack, today)
    return search.optimum(search.least(asked))


def smoothest_within(move: Move, worst: float) -> Optimum | None:
    """The profile of least peak jerk that leaves at most `worst` in every mode, over the band.

    Parameters
    ----------
    move : Move
        At least one pole has a weight above zero.
    worst : float
        Residual allowed, above zero. [mm]

    Returns
    -------
    Optimum or None
        None where no profile on the grid does that within the limits, and the guard.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    search = _Search(move, worst)
    asked = Asked(worst / search.unit)
    found = search.least(asked)
    return search.optimum(found) if found is not None and found.meets(asked.allowed) else None


class _Search:
    """One move: its frequencies and its blocks, as they are refined. Residuals are over `unit`."""

    def __init__(self, move: Move, unit: float) -> None:
        self.move = move
        used = move.weights > 0.0
        weights = move.weights[used]
        self.poles = move.poles[used]
        _, self.group = np.unique(move.group[used], return_inverse=True)
        self.unit = max(unit, 1e-12 * float(weights.max(initial=0.0)))
        self.weights = weights / self.unit
        self.total = move.count * move.interval
        # Where one programme had to hold the velocity between its knots, the next will have to.
        self.curved = False
        self.ramp = ramp_intervals(move)
        self._known: dict[int, LookedAt] = {}

    def null(self) -> Found | None:
        """The smoothest exact null: a band of frequencies does not have one, nor has a spectrum."""
        move = self.move
        alone = len(np.unique(self.group)) == len(self.group)
        if move.band or move.guard or not alone or move.count < FEWEST_INTERVALS:
            return None
        looked_at = self._looked_at(move.count)
        knots = self._first_knots
        tried = [self._ramps(looked_at, ramp_knots(self.ramp))] if self.ramp else []
        tried.append(self._whole(looked_at, knots))
        if len(knots) <= move.count <= MOST_REFINED:
            tried.append(self._whole(looked_at, np.arange(move.count + 1)))
        for blocks in tried:
            found = smoothest_null(self._problem(looked_at, blocks, looked_at.first))
            if found is not None:
                return Found.of(looked_at, blocks, looked_at.first, found)
        return None

    def least(self, asked: Asked) -> Found | None:
        """What is asked, by planes where frequencies are guarded or cones too many, or by cones.

        By both, where the least itself is asked for and cones can have their first blocks: where
        they cannot, planes are a tenth to a fortieth of the work. By planes first, where only what
        is allowed is of use: they soon know that it can be had, or by far cannot.
        """
        move = self.move
        if move.count < FEWEST_INTERVALS:
            return None
        many = self._most_blocks < min(most_blocks(move), move.count)
        planes = many or asked.only or self._guarded or not self._few
        found = self._by_planes(asked) if planes else None
        exact = many and not (self._guarded or asked.allowed) and self._few
        if exact or found is None:
            return better(found, self._by_cones(asked))
        if many or self._guarded or not asked.allowed < found.worst <= NEARLY * asked.allowed:
            return found
        return better(found, self._whole_by_cones(found, asked))

    def optimum(self, found: Found | None) -> Optimum | None:
        """What was found, in the units of the move."""
        if found is None or not found.guards:
            return None
        jerk = found.solution.jerk / self.move.count**3
        return Optimum(found.blocks.knots, jerk, found.worst * self.unit)

    def _by_planes(self, asked: Asked) -> Found | None:
        """The ramps of a move with a long cruise, or the whole move where they do not suffice.

        None where the solver gives up.
        """
        move, looked_at = self.move, self._looked_at(self.ramp or self.move.count)
        if not self.ramp:
            return self._whole_by_planes(looked_at, asked)
        knots = coarse_ramp(move, self.ramp)
        every = np.ones(len(looked_at.source), dtype=bool)

        def programme(knots: Index) -> tuple[Blocks, Problem]:
            blocks = self._ramps(looked_at, knots)
            return blocks, self._problem(looked_at, blocks, every)

        found = within(looked_at, programme, knots, asked) if asked.allowed else None
        found = found or self._whole_by_planes(self._looked_at(move.count), asked)
        if found is None and not self._guarded and self._few:
            found = self._by_cones(asked)
        if found is not None and not asked.allowed < found.worst <= NEARLY * asked.allowed:
            return found
        return better(found, refined(looked_at, programme, knots, asked))

    def _whole_by_planes(self, looked_at: LookedAt, asked: Asked) -> Found | None:
        """The same for the whole move."""
        move, every = self.move, np.ones(len(looked_at.source), dtype=bool)
        first = coarse_knots(move, self.ramp)
        whole = self._whole(looked_at, first)

        def programme(knots: Index) -> tuple[Blocks, Problem]:
            if knots[-1] < move.count:
                # Those behind the middle are images of these.
                knots = np.union1d(knots, move.count - knots)
            blocks = whole.cut(knots)
            return blocks, self._problem(looked_at, blocks, every)

        return refined(looked_at, programme, first, asked)

    def _by_cones(self, asked: Asked) -> Found | None:
        """The same by cones: the least residual, and then less jerk on the same blocks."""
        found = self._least_by_cones(asked)
        if found is None or not found.guards or found.worst <= asked.allowed or not asked.slack:
            return found
        allowed = found.worst + asked.given(found.worst)
        if found.worst <= USED * asked.settled:
            allowed = min(allowed, asked.settled)
        other = self._exchanged(found.looked_at, found.blocks, allowed, found)
        return other if other is not None and other.meets(allowed) else found

    def _whole_by_cones(self, found: Found, asked: Asked) -> Found | None:
        """What planes have nearly found, with a block for each interval.

        Cones begin with the frequencies that mattered.
        """
        looked_at = self._looked_at(self.move.count)
        if found.looked_at is not looked_at:
            return self._by_cones(asked)
        matter = looked_at.peaks(found.left) & (found.left > MATTERS * found.worst)
        every = self._whole(looked_at, np.arange(self.move.count + 1))
        start = replace(found, active=matter)
        return self._exchanged(looked_at, every, asked.allowed, start, asked.only)

    def _least_by_cones(self, asked: Asked) -> Found | None:
        """The least residual above what is allowed; blocks are refined until that is met."""
        move, allowed, only = self.move, asked.allowed, asked.only
        best: Found | None = None
        if self.ramp and allowed:
            # The phases of a short cruise can be made use of: what is found counts if it is enough.
            looked_at = self._looked_at(self.ramp)
            ramps = self._ramps(looked_at, ramp_knots(self.ramp))
            best = self._exchanged(looked_at, ramps, allowed, only=True)
            if best is not None and best.meets(allowed):
                return best
        looked_at = self._looked_at(move.count)
        knots = self._first_knots
        first = self._exchanged(looked_at, self._whole(looked_at, knots), allowed, only=only)
        best = better(best, first)
        if len(knots) > move.count or (best is not None and best.meets(allowed)):
            return best
        if first is not None:
            coarse, jerk = first.blocks, first.solution.jerk
            cut = refined_knots(coarse.knots, jerk, coarse.mirrored, self._most_blocks)
            if len(cut) == len(knots):
                return best
            finer = self._whole(looked_at, cut)
            return better(best, self._exchanged(looked_at, finer, allowed, first, only))
        if move.count > self._most_blocks:
            return best
        every = self._whole(looked_at, np.arange(move.count + 1))
        return better(best, self._exchanged(looked_at, every, allowed, only=only))

    @property
    def _first_knots(self) -> Index:
        """Ends of the blocks of a first programme of cones, of the whole move."""
        return first_knots(self.move.count, self.ramp, self.move.guard > 0.0)

    @property
    def _few(self) -> bool:
        """Whether cones can have their first blocks."""
        return len(self._first_knots) <= self._most_blocks

    @property
    def _most_blocks(self) -> int:
        """Blocks of a programme of cones at most."""
        rows = 2 * np.count_nonzero(self._looked_at(self.move.count).first)
        return min(most_blocks(self.move), int(np.sqrt(WORK / rows)))

    @property
    def _guarded(self) -> bool:
        """Whether frequencies are guarded."""
        return bool((self._looked_at(self.move.count).source < 0).any())

    def _looked_at(self, intervals: int) -> LookedAt:
        """The frequencies that count for a profile, or a ramp, of so many intervals."""
        if intervals not in self._known:
            move, duration = self.move, intervals * self.move.interval
            guarded = guarded_response(move, self.poles, duration)
            self._known[intervals] = LookedAt.of(
                self.poles, self.weights, self.group, move.band, duration, guarded
            )
        return self._known[intervals]

    def _problem(self, looked_at: LookedAt, blocks: Blocks, active: Flags) -> Problem:
        """The programme for these blocks and groups of frequencies."""
        return blocks.problem(self.move, active, np.where(looked_at.source < 0, GUARDED, np.nan))

    def _exchanged(
        self, looked_at: LookedAt, blocks: Blocks, allowed: float, start: Found | None = None,
        only: bool = False,
    ) -> Found | None:  # fmt: skip
        """The least residual for some blocks, frequencies added until none between is worse.

        `start`: what was found before, of these blocks or of longer ones. `only`: whatever leaves
        more than is allowed is of no use.
        """

        def solved(active: Flags, cost: float) -> Found | None:
            problem = self._problem(looked_at, blocks, active)
            solution = solve(problem, USED * allowed, cost, self.curved)
            self.curved |= solution is not None and solution.curved
            if solution is None:
                return None
            return Found.of(looked_at, blocks, active, solution)

        active = looked_at.first if start is None else start.active
        return exchanged(solved, active, allowed, only=only)

    def _ramps(self, looked_at: LookedAt, knots: Index) -> Blocks:
        """Blocks of the ramps of a move with a long cruise."""
        return Blocks.ramps(looked_at, knots, self.move.count, self.move.interval)

    def _whole(self, looked_at: LookedAt, knots: Index) -> Blocks:
        """Blocks of the whole move."""
        return Blocks.whole(looked_at, knots, self.move.interval)
