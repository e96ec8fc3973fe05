r"""The optimum: of all jerk sequences on the command grid, the one that leaves modes most still.

This module owns the questions that the cone programme of `socp` leaves open for one move:

* *which frequencies*. A mode is known to a relative band only; the residual is a smooth function
  of the frequency, which some points pin down. The programme is solved for a few; where the
  residual between them is larger, that frequency is added and it is solved again. The same for
  what `guard` holds down;
* *which blocks*. Short moves have a jerk of their own in every interval. In long ones most of the
  optimal jerk is zero, in cruise and at constant acceleration: a first programme with long blocks
  shows where it is not, and only there are the blocks cut into single intervals. A move with a
  long cruise is accelerated and braked alike, and only one of the two is designed: what both leave
  in the worst phase is held down, and frequencies need to be no closer than for one;
* *how good is good enough*. A null of nanometres costs the full jerk; within a residual that does
  not matter the smoothest profile is taken.

Rule: what is returned has been judged on a dense grid of frequencies, not on the points that it was
designed on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.guard import envelope, guarded_frequencies, split_at_peak
from gcodejerk.motion.search.looked_at import Blocks, LookedAt
from gcodejerk.motion.search.socp import (
    Index,
    Problem,
    Solution,
    smoothest_null,
    solve,
)
from gcodejerk.motion.search.unit_move import Move, Optimum

Flags = NDArray[np.bool_]

FEWEST_INTERVALS = 3
"""Two cannot begin and end at rest."""
FULL_INTERVALS = 128
"""Moves of at most so many intervals have a jerk in each of them."""
BLOCK = 4
"""Intervals of a block in the first programme of a longer move, at least."""
MOST_BLOCKS = 120
"""Blocks of a half of a move, or of a ramp, in a first programme at most."""
HALVES = 128
"""Of moves of more intervals, guarded frequencies see acceleration and braking apart."""
CRUISE_BLOCKS = 16
"""Blocks of a cruise at most, where acceleration and braking are not taken alike."""
MOST_REFINED, MOST_GUARDED = 1000, 110
"""Blocks of a refined programme at most, and of one with guarded frequencies, which are many: those
of longer moves stay long."""
RAMP = 2.0
"""Time that a move with a cruise may take to accelerate, times what it does today."""
ACTIVE = 0.02
"""A block counts where its jerk is above this share of the largest."""
IDLE = 0.5
"""A frequency below this share of the worst is not asked for again in a finer programme."""
ROUNDS, COARSE_ROUNDS = 6, 3
"""Programmes at most, until no frequency between the points is worse than these; and of long blocks
that are cut afterwards, where there is a guard."""
WORSE = 1.012
"""A frequency is added where the residual is this much above that of the points."""
USED = 0.985
"""Share of what is allowed that is designed for: between the points it is larger."""
GUARDED, KEPT = 0.98, 1.005
"""The same of what guarded frequencies may keep; and where these are found to keep it."""
JERK_COST = 1e-3
"""What the full jerk costs beside a residual that matters: so much of that may be lost by it."""
LEAST_COST = 2e-5
"""The same where the residual alone counts."""
LOSS = 3e-3
"""What the jerk may then cost of the residual at most."""
CHEAPEST = 1e-9
"""Below it, the jerk's cost is lost in the solver's rounding."""
NULL = 1e-6
"""A residual below this share of the measure is as good as none."""


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
        scipy or clarabel is not installed.
    """
    search = _Search(move, reference)
    return search.optimum(search.null() or search.least(0.0))


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
        As in `least_residual`. [mm]

    Returns
    -------
    Optimum or None
        As of `least_residual`.

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    search = _Search(move, reference)
    most = settled / search.unit
    allowed = min(slack / search.unit, 0.5 * most)
    found = search.least(allowed)
    if found is not None and found.guards and found.worst > allowed:
        allowed = found.worst + slack / search.unit
        allowed = min(allowed, most) if found.worst <= USED * most else allowed
        found = search.smoother(found, allowed)
    return search.optimum(found)


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
        scipy or clarabel is not installed.
    """
    search = _Search(move, worst)
    allowed = worst / search.unit
    found = search.least(allowed)
    return search.optimum(found) if found is not None and found.meets(allowed) else None


@dataclass(frozen=True, slots=True, eq=False)
class _Found:
    """A solution, and what it was found for.

    Attributes
    ----------
    looked_at : LookedAt
        The frequencies.
    blocks : Blocks
        The blocks of its jerk.
    active : ndarray of bool, shape (g,)
        The groups of frequencies that the programme knew.
    solution : Solution
        The jerk.
    left : ndarray, shape (g,)
        What each group is left with, over the measure. [-]
    """

    looked_at: LookedAt
    blocks: Blocks
    active: Flags
    solution: Solution
    left: Array

    @property
    def worst(self) -> float:
        """Largest residual of modes over the whole band, over the measure."""
        return float(self.left[self.looked_at.source >= 0].max(initial=0.0))

    def meets(self, allowed: float) -> bool:
        """Whether it leaves no more than is allowed, and keeps the guard."""
        return self.worst <= allowed and self.guards

    @property
    def excess(self) -> float:
        """What a guarded frequency keeps at most, times what it may; the least that counts is 1."""
        most = float(self.left[self.looked_at.source < 0].max(initial=0.0))
        return most if most > KEPT else 1.0

    @property
    def guards(self) -> bool:
        """Whether every guarded frequency keeps what it may at most."""
        return self.excess == 1.0


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
        self.ramp = self._ramp()
        self.halves = move.count > HALVES

    def null(self) -> _Found | None:
        """The smoothest exact null: a band of frequencies does not have one, nor has a spectrum."""
        move = self.move
        alone = len(np.unique(self.group)) == len(self.group)
        if move.band or move.guard or not alone or move.count < FEWEST_INTERVALS:
            return None
        looked_at = self._looked_at(move.count)
        knots = self._first_knots()
        tried = [self._ramps(looked_at)] if self.ramp else []
        tried.append(self._whole(looked_at, knots))
        if len(knots) <= move.count <= MOST_REFINED:
            tried.append(self._whole(looked_at, np.arange(move.count + 1)))
        for blocks in tried:
            found = smoothest_null(self._problem(looked_at, blocks, looked_at.first))
            if found is not None:
                return _Found(looked_at, blocks, looked_at.first, found, blocks.left(found.jerk))
        return None

    def least(self, allowed: float) -> _Found | None:
        """The least residual above what is allowed; blocks are refined until that is met."""
        move = self.move
        best: _Found | None = None
        if move.count < FEWEST_INTERVALS:
            return best
        if self.ramp and allowed:
            # The phases of a short cruise can be made use of: what is found counts if it is enough.
            looked_at = self._looked_at(self.ramp)
            best = self._exchanged(looked_at, self._ramps(looked_at), allowed, enough=True)
            if best is not None and best.meets(allowed):
                return best
        looked_at = self._looked_at(move.count)
        knots = self._first_knots()
        finest = len(knots) > move.count
        rounds = ROUNDS if finest or not move.guard else COARSE_ROUNDS
        blocks = self._whole(looked_at, knots)
        first = self._exchanged(looked_at, blocks, allowed, rounds=rounds)
        best = _better(best, first)
        if finest or (best is not None and best.meets(allowed)):
            return best
        if first is not None:
            finer = self._whole(looked_at, self._refined(first))
            found = self._exchanged(looked_at, finer, allowed, _needed(first))
            return _better(best, found)
        if move.count > self._most():
            return best
        every = self._whole(looked_at, np.arange(move.count + 1))
        return _better(best, self._exchanged(looked_at, every, allowed))

    def smoother(self, found: _Found, allowed: float) -> _Found:
        """Less jerk on the same blocks, where something is allowed."""
        other = self._exchanged(found.looked_at, found.blocks, allowed, found.active)
        return other if other is not None and other.meets(allowed) else found

    def optimum(self, found: _Found | None) -> Optimum | None:
        """What was found, in the units of the move."""
        if found is None or not found.guards:
            return None
        jerk = found.solution.jerk / self.move.count**3
        return Optimum(found.blocks.knots, jerk, found.worst * self.unit)

    def _looked_at(self, intervals: int) -> LookedAt:
        """The frequencies that count for a profile, or a ramp, of so many intervals."""
        move, duration = self.move, intervals * self.move.interval
        looked_at = LookedAt.of(self.poles, self.weights, self.group, move.band, duration)
        if move.today is None or not move.guard:
            return looked_at
        if self.halves:
            # Of a whole move its halves are guarded, in which little acts but the ramps.
            duration = min(duration, (self.ramp or 0.5 * move.count) * move.interval)
        omega = guarded_frequencies(self.poles, move.band, move.interval, duration)
        return looked_at.guarded(omega, move.guard * envelope(move.today, omega))

    def _problem(self, looked_at: LookedAt, blocks: Blocks, active: Flags) -> Problem:
        """The programme for these blocks and groups of frequencies."""
        move, T = self.move, self.total
        used = active[blocks.group]
        cone, group = blocks.cone[used], blocks.group[used]
        own = group[np.diff(cone, prepend=-1) != 0]
        return Problem(
            knots=blocks.knots,
            velocity=move.velocity * T,
            acceleration=move.acceleration * T**2,
            jerk=min(move.jerk, move.acceleration / move.interval) * T**3,
            rows=blocks.rows[used],
            group=cone,
            cap=np.where(looked_at.source[own] < 0, GUARDED, np.nan),
            mirrored=blocks.mirrored,
            cruise=blocks.cruise,
        )

    def _exchanged(
        self, looked_at: LookedAt, blocks: Blocks, allowed: float, active: Flags | None = None,
        rounds: int = ROUNDS, enough: bool = False,
    ) -> _Found | None:  # fmt: skip
        """The least residual for some blocks, frequencies added until none between is worse.

        `enough`: or until it is clear that more than what is allowed is left.
        """
        active = looked_at.first if active is None else active
        cost = JERK_COST if allowed else LEAST_COST
        best: _Found | None = None
        while rounds > 0:
            rounds -= 1
            problem = self._problem(looked_at, blocks, active)
            solution = solve(problem, USED * allowed, cost, self.curved)
            self.curved |= solution is not None and solution.curved
            if solution is None or (enough and solution.worst > allowed):
                return best
            # Little jerk has cost at most this; where that is too much, it is made cheaper.
            paid = cost * (1.0 - solution.peak)
            if not allowed and paid > LOSS * solution.worst > LOSS * NULL:
                cost *= 0.02
                rounds += cost > CHEAPEST
            found = _Found(looked_at, blocks, active, solution, blocks.left(solution.jerk))
            best = _better(best, found)
            most = max(WORSE * solution.worst, allowed, NULL)
            guarded = looked_at.source < 0
            over = found.left > np.where(guarded, KEPT, most)
            missing = over & ~active & (looked_at.peaks(found.left) | (guarded & looked_at.sparse))
            if not missing.any():
                break
            active = active | missing
        return best

    def _ramp(self) -> int:
        """Intervals in which a move with a long cruise accelerates; 0 for others."""
        move = self.move
        if move.today is None or move.count <= FULL_INTERVALS:
            return 0
        today = float(split_at_peak(move.today)[0].total[0])
        ramp = int(np.ceil(RAMP * today / move.interval))
        return ramp if 3 * ramp <= move.count else 0

    def _ramps(self, looked_at: LookedAt) -> Blocks:
        """Blocks of the ramps of a move with a long cruise."""
        block = -(-self.ramp // MOST_BLOCKS)
        ramp = np.union1d(np.arange(0, self.ramp, block), self.ramp)
        return Blocks.ramps(looked_at, ramp, self.move.count, self.move.interval)

    def _whole(self, looked_at: LookedAt, knots: Index) -> Blocks:
        """Blocks of the whole move."""
        return Blocks.whole(looked_at, knots, self.move.interval, self.halves)

    def _first_knots(self) -> Index:
        """Ends of the blocks of the first programme: all intervals of a short move."""
        count = self.move.count
        if count <= FULL_INTERVALS:
            return np.arange(count + 1)
        half = self.ramp or count // 2
        block = max(BLOCK, -(-half // MOST_BLOCKS))
        first = np.arange(0, half + 1, block)
        cruise = np.zeros(0, dtype=np.int64)
        if self.ramp:
            cruise = np.linspace(half, count // 2, CRUISE_BLOCKS // 2 + 1).astype(np.int64)
        first = np.union1d(first, cruise)
        return np.union1d(first, count - first)

    def _most(self) -> int:
        """Blocks of a refined programme at most."""
        return MOST_GUARDED if self.move.guard else MOST_REFINED

    def _refined(self, first: _Found) -> Index:
        """Blocks cut into intervals where the jerk acts, and beside these."""
        knots, size = first.blocks.knots, np.abs(first.solution.jerk)
        if first.blocks.mirrored:
            size = np.maximum(size, size[::-1])
        beside = np.pad(size, 1)
        size = np.maximum(size, np.maximum(beside[:-2], beside[2:]))
        size[[0, -1]] = np.inf
        # The largest first, as many as there may be.
        order = np.argsort(-size, kind="stable")
        order = order[size[order] > ACTIVE * np.abs(first.solution.jerk).max(initial=0.0)]
        gained = np.cumsum(np.diff(knots)[order] - 1)
        cut = order[gained + len(size) <= self._most()]
        return np.unique(np.concatenate([knots, *(np.arange(knots[k], knots[k + 1]) for k in cut)]))


def _better(one: _Found | None, other: _Found | None) -> _Found | None:
    """The one that keeps the guard, or of two that do the one that leaves less."""
    if one is None or other is None:
        return one or other
    return other if (other.excess, other.worst) < (one.excess, one.worst) else one


def _needed(found: _Found) -> Flags:
    """The groups that a finer programme begins with: near their limit, and the ends of bands."""
    source = found.looked_at.source
    ends = (np.diff(source, prepend=-2) != 0) | (np.diff(source, append=-2) != 0)
    close = found.left > IDLE * np.where(source < 0, 1.0, found.worst)
    needed: Flags = found.active & (close | (ends & (source >= 0)))
    return needed
