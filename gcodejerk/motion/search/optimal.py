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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.cutting import Cutting
from gcodejerk.motion.search.guard import guarded_frequencies, with_narrows
from gcodejerk.motion.search.knots import (
    MOST_REFINED,
    first_knots,
    most_blocks,
    ramp_intervals,
    ramp_knots,
    refined_knots,
)
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
HALVES = 128
"""Of moves of more intervals, guarded frequencies see acceleration and braking apart."""
ROUNDS = 6
"""Programmes with cones at most, until no frequency between the points is worse than these."""
MOST_CUTS = 80
"""Programmes with planes at most."""
WORSE = 1.012
"""A frequency is added where the residual is this much above that of the points."""
LITTLE, NOTHING = 3e-3, 1e-4
"""A plane is added where the residual is so much above what planes say: of that, and at least."""
ROUGH = 0.1
"""Blocks that are refined need the least of theirs to this share only."""
USED, USED_BY_PLANES = 0.985, 0.995
"""Share of what is allowed that is designed for: between the points it is larger; and of planes,
which are made until that is held everywhere."""
GUARDED, KEPT = 0.98, 1.005
"""The same of what guarded frequencies may keep; and where these are found to keep it."""
GIVEN = 0.2
"""Of what a profile leaves less than the controller's own, what may be given for less jerk."""
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
        scipy, clarabel or daqp is not installed.
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
    most = settled / search.unit
    allowed = min(slack / search.unit, 0.5 * most)
    found = search.least(allowed)
    if found is not None and found.guards and found.worst > allowed:
        gained = max(reference / search.unit - found.worst, 0.0)
        allowed = found.worst + min(slack / search.unit, GIVEN * gained)
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
        scipy, clarabel or daqp is not installed.
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
    cutting : Cutting, optional
        The programme by planes that it was found by.
    """

    looked_at: LookedAt
    blocks: Blocks
    active: Flags
    solution: Solution
    left: Array
    cutting: Cutting | None = None

    @classmethod
    def by_planes(cls, looked_at: LookedAt, blocks: Blocks, cutting: Cutting) -> _Found:
        """The last solution of a programme by planes."""
        active = looked_at.first.copy()
        active[blocks.owner[cutting.cones]] = True
        solution = cutting.solution()
        return cls(looked_at, blocks, active, solution, blocks.left(solution.jerk), cutting)

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
        self.ramp = ramp_intervals(move)
        self.halves = move.count > HALVES

    def null(self) -> _Found | None:
        """The smoothest exact null: a band of frequencies does not have one, nor has a spectrum."""
        move = self.move
        alone = len(np.unique(self.group)) == len(self.group)
        if move.band or move.guard or not alone or move.count < FEWEST_INTERVALS:
            return None
        looked_at = self._looked_at(move.count)
        knots = first_knots(move.count, self.ramp, move.guard > 0.0)
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
            best = self._exchanged(looked_at, self._ramps(looked_at), allowed, rough=np.inf)
            if best is not None and best.meets(allowed):
                return best
        looked_at = self._looked_at(move.count)
        knots = first_knots(move.count, self.ramp, move.guard > 0.0)
        finest = len(knots) > move.count
        rough = 0.0 if finest else ROUGH
        first = self._exchanged(looked_at, self._whole(looked_at, knots), allowed, rough=rough)
        best = _better(best, first)
        if finest or (best is not None and best.meets(allowed)):
            return best
        if first is not None:
            coarse, jerk = first.blocks, first.solution.jerk
            cut = refined_knots(coarse.knots, jerk, coarse.mirrored, most_blocks(move))
            finer = self._whole(looked_at, cut)
            return _better(best, self._exchanged(looked_at, finer, allowed, first))
        if move.count > most_blocks(move):
            return best
        every = self._whole(looked_at, np.arange(move.count + 1))
        return _better(best, self._exchanged(looked_at, every, allowed))

    def smoother(self, found: _Found, allowed: float) -> _Found:
        """Less jerk on the same blocks, where something is allowed."""
        other = self._exchanged(found.looked_at, found.blocks, allowed, found)
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
        omega, bound = with_narrows(move.today, omega)
        return looked_at.guarded(omega, move.guard * bound)

    def _problem(self, looked_at: LookedAt, blocks: Blocks, active: Flags) -> Problem:
        """The programme for these blocks and groups of frequencies."""
        move, T = self.move, self.total
        # All of them as they are: a copy of the rows is a few megabytes.
        used = slice(None) if active.all() else active[blocks.group]
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
        self, looked_at: LookedAt, blocks: Blocks, allowed: float, start: _Found | None = None,
        rough: float = 0.0,
    ) -> _Found | None:  # fmt: skip
        """The least residual for some blocks, frequencies added until none between is worse.

        `start`: what was found before, of these blocks or of longer ones. `rough`: or until more
        than what is allowed is left, and how much is known to this share.
        """
        if (looked_at.source < 0).any():
            found = self._cut(looked_at, blocks, allowed, start, rough)
            if found is not None:
                return found
        active = looked_at.first if start is None else start.active
        rounds = ROUNDS
        cost = JERK_COST if allowed else LEAST_COST
        best: _Found | None = None
        while rounds > 0:
            rounds -= 1
            problem = self._problem(looked_at, blocks, active)
            solution = solve(problem, USED * allowed, cost, self.curved)
            self.curved |= solution is not None and solution.curved
            if solution is None or (np.isinf(rough) and solution.worst > allowed):
                return best
            # Little jerk has cost at most this; where that is too much, it is made cheaper.
            paid = cost * (1.0 - solution.peak)
            if not allowed and paid > LOSS * solution.worst > LOSS * NULL:
                cost *= 0.02
                rounds += cost > CHEAPEST
            found = _Found(looked_at, blocks, active, solution, blocks.left(solution.jerk))
            best = _better(best, found)
            most = max(WORSE * solution.worst, allowed, NULL)
            most_each = np.where(looked_at.source < 0, KEPT, most)
            missing = looked_at.exceeded(found.left, most_each) & ~active
            if not missing.any():
                break
            active = active | missing
        return best

    def _cut(
        self, looked_at: LookedAt, blocks: Blocks, allowed: float, start: _Found | None,
        rough: float,
    ) -> _Found | None:  # fmt: skip
        """The same by planes, and then the least jerk for what is allowed, if that is within reach.

        None where the solver gives up. `start` of the same blocks: the jerk is all that is sought.
        """
        before = start.cutting if start is not None else None
        if start is not None and before is not None and start.blocks is blocks:
            return _smoothed(start, before, allowed)
        every = np.ones(len(looked_at.source), dtype=bool)
        cutting = Cutting(self._problem(looked_at, blocks, every))
        if before is not None:
            cutting.begin(before)
        found = _least_by_planes(looked_at, blocks, cutting, allowed, rough)
        if found is None or (cutting.expected > allowed and (rough or allowed)):
            return found
        return _smoothed(found, cutting, allowed or (1.0 + LOSS) * max(found.worst, NULL))

    def _ramps(self, looked_at: LookedAt) -> Blocks:
        """Blocks of the ramps of a move with a long cruise."""
        knots = ramp_knots(self.ramp)
        return Blocks.ramps(looked_at, knots, self.move.count, self.move.interval)

    def _whole(self, looked_at: LookedAt, knots: Index) -> Blocks:
        """Blocks of the whole move."""
        return Blocks.whole(looked_at, knots, self.move.interval, self.halves)


def _least_by_planes(
    looked_at: LookedAt, blocks: Blocks, cutting: Cutting, allowed: float, rough: float
) -> _Found | None:
    """The least residual above what is allowed; None where the solver gives up."""
    modes = looked_at.source >= 0
    for _ in range(MOST_CUTS):
        if not cutting.solve(USED_BY_PLANES * allowed, smooth=False):
            return None
        left, reached = blocks.largest(cutting.left), cutting.expected <= allowed
        most = allowed if reached else cutting.told + max(LITTLE * cutting.told, NOTHING)
        going = _cut_where(looked_at, blocks, cutting, most) or not (cutting.settled or reached)
        known = not reached and left[modes].max() <= (1.0 + rough) * cutting.expected
        if not going or (rough and known):
            return _Found.by_planes(looked_at, blocks, cutting)
    return None


def _smoothed(found: _Found, cutting: Cutting, allowed: float) -> _Found:
    """The least jerk for what is allowed, on the same blocks; what was found where none is."""
    goal = max(USED_BY_PLANES * allowed, found.worst)
    for _ in range(MOST_CUTS):
        if not cutting.solve(goal, smooth=True):
            break
        going = _cut_where(found.looked_at, found.blocks, cutting, allowed)
        if not going and cutting.settled:
            return _Found.by_planes(found.looked_at, found.blocks, cutting)
    return found


def _cut_where(looked_at: LookedAt, blocks: Blocks, cutting: Cutting, most: float) -> bool:
    """Cut what is left with more than this, or guarded with more than it may; whether any was."""
    guarded = looked_at.source < 0
    missing = looked_at.exceeded(blocks.largest(cutting.left), np.where(guarded, KEPT, most))
    return cutting.cut(missing[blocks.owner])


def _better(one: _Found | None, other: _Found | None) -> _Found | None:
    """The one that keeps the guard, or of two that do the one that leaves less."""
    if one is None or other is None:
        return one or other
    return other if (other.excess, other.worst) < (one.excess, one.worst) else one
