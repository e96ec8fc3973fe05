r"""The optimum: of all jerk sequences on the command grid, the one that leaves modes most still.

This module owns the two questions that the cone programme of `socp` leaves open for one
move:

* *which frequencies*. A mode is known to a relative band only; the residual is a smooth function
  of the frequency, which some points pin down. The programme is solved for a few; where the
  residual between them is larger, that frequency is added and it is solved again;
* *which blocks*. Short moves have a jerk of their own in every interval. In long ones most of the
  optimal jerk is zero, in cruise and at constant acceleration: a first programme with long blocks
  shows where it is not, and only there are the blocks cut into single intervals.

Rule: what is returned has been judged on a dense grid of frequencies, not on the points that it was
designed on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.search.objective import DENSE, FEWEST
from gcodejerk.motion.search.socp import (
    ACCURACY,
    Index,
    Problem,
    Solution,
    amplitudes,
    smoothest,
    solve,
)

FEWEST_INTERVALS = 3
"""Two cannot begin and end at rest."""
FULL_INTERVALS = 128
"""Moves of at most so many intervals have a jerk in each of them."""
LONG_INTERVALS = 600
"""Longer ones have none of single intervals."""
BLOCK = 4
"""Intervals of a block in the first programme of a longer move."""
ACTIVE = 0.02
"""A block counts where its jerk is above this share of the largest."""
IDLE = 0.5
"""A frequency below this share of the worst is not asked for again in a finer programme."""
SPACING = 1.0
"""Distance of frequencies, times T_SUM/2, at which a band is designed at first. [rad]"""
ROUNDS = 4
"""Programmes at most, until no frequency between the points is worse than these."""
WORSE = 1.012
"""A frequency is added where the residual is this much above that of the points."""
COARSE_ACCURACY = 1e-4
"""Relative accuracy of the programme that only shows where the jerk acts."""
SMOOTHNESS = 2e-5
"""What the full jerk costs, as a share of the reference residual."""
CHEAPEST = 1e-9
"""Below it, the jerk's cost is lost in the solver's rounding."""
LOSS = 3e-3
"""What smoothness may cost of the residual at most."""
NULL = 1e-6
"""A residual below this share of the reference is as good as none."""


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """One unit move, and what it must not shake.

    Attributes
    ----------
    count : int
        T_SUM. [intervals]
    velocity, acceleration, jerk : float
        Limits of the unit profile; the jerk may be infinite. [1/s], [1/s^2], [1/s^3]
    poles : ndarray of complex, shape (m,)
        Of the modes. [rad/s]
    weights : ndarray, shape (m,)
        Participation times displacement. [mm]
    group : ndarray of int, shape (m,)
        Poles of one group, side by side, count together: the root of their squares' sum.
    band : float
        Relative error of the frequencies of single modes; groups have no band. [-]
    interval : float
        [s]
    """

    count: int
    velocity: float
    acceleration: float
    jerk: float
    poles: Complex
    weights: Array
    group: Index
    band: float
    interval: float


@dataclass(frozen=True, slots=True, eq=False)
class Optimum:
    """An optimal unit profile: a jerk for each block of whole intervals.

    Attributes
    ----------
    knots : ndarray of int, shape (k + 1,)
        Ends of the blocks. [intervals]
    jerk : ndarray, shape (k,)
        [1/intervals^3]
    worst : float
        Largest residual displacement over all groups and the band. [mm]
    """

    knots: Index
    jerk: Array
    worst: float


def optimum_profiles(optima: list[Optimum], interval: float) -> Profiles:
    """The profiles of optima, a segment for each block.

    Parameters
    ----------
    optima : list of Optimum
        n of them.
    interval : float
        [s]

    Returns
    -------
    Profiles
        n profiles.
    """
    first = np.concatenate([[0], np.cumsum([len(optimum.jerk) for optimum in optima])])
    none = np.zeros(0)
    jerk = np.concatenate([none, *(optimum.jerk for optimum in optima)]) / interval**3
    duration = np.concatenate([none, *(np.diff(optimum.knots) for optimum in optima)]) * interval
    gained = np.insert(np.cumsum(jerk * duration), 0, 0.0)
    # Every profile begins at rest: what rounding has left of the profiles before it is not its own.
    acceleration = gained[:-1] - np.repeat(gained[first[:-1]], np.diff(first))
    return Profiles.of(first, duration, acceleration, jerk)


def least_residual(move: Move, reference: float) -> Optimum | None:
    """The profile of least worst residual; among equal ones the smoothest.

    Parameters
    ----------
    move : Move
        At least one pole has a weight above zero.
    reference : float
        Residual of the controller's own profile, the measure for what is small. [mm]

    Returns
    -------
    Optimum or None
        None where no profile on the grid keeps the limits.

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    return _Search(move, reference).least()


def smoothest_within(move: Move, worst: float, reference: float) -> Optimum | None:
    """The profile of least peak jerk that leaves at most `worst` in every mode, over the band.

    Parameters
    ----------
    move : Move
        The move.
    worst : float
        Residual allowed. [mm]
    reference : float
        As in `least_residual`. [mm]

    Returns
    -------
    Optimum or None
        None where no profile on the grid does that within the limits.

    Raises
    ------
    PlanError
        scipy or clarabel is not installed.
    """
    return _Search(move, reference).within(worst)


def quiet_enough(move: Move, worst: float, reference: float) -> Optimum | None:
    """Any profile that leaves at most `worst`; found sooner than the best or the smoothest.

    Takes, returns and raises what `smoothest_within` does; `worst` must be above zero, and so the
    weight of one pole at least.
    """
    search = _Search(move, reference)
    found = search.least(worst / search.scale)
    return found if found is not None and found.worst <= worst else None


class _Search:
    """One move: its frequencies and its blocks, as they are refined."""

    def __init__(self, move: Move, reference: float) -> None:
        self.move = move
        used = move.weights > 0.0
        self.poles, self.group = move.poles[used], move.group[used]
        self.scale = float(move.weights.max(initial=0.0)) or 1.0
        self.weights = move.weights[used] / self.scale
        self.reference = max(reference / self.scale, 1e-12)
        self.total = move.count * move.interval
        sizes = np.bincount(self.group, minlength=1)
        self.single = sizes[self.group] == 1
        # A very long move has so many freedoms that blocks of two intervals lose next to nothing.
        self.cut = 2 if move.count > LONG_INTERVALS else 1
        self.rounds = ROUNDS if self.cut == 1 else 2
        self.points = self._points(SPACING, 1)
        self.dense = self._points(DENSE, FEWEST)

    def _points(self, spacing: float, fewest: int) -> list[Array]:
        """Relative frequencies at which each pole is looked at, so many on each side at least."""
        out = []
        for pole, single in zip(self.poles, self.single, strict=True):
            band = self.move.band if single else 0.0
            half = int(np.ceil(0.5 * band * abs(pole) * self.total / spacing))
            half = max(half, fewest) if band else 0
            out.append(np.linspace(1.0 - band, 1.0 + band, 2 * half + 1) if half else np.ones(1))
        return out

    def _problem(self, knots: Index, points: list[Array]) -> Problem:
        """The programme for these blocks and frequencies."""
        move, T = self.move, self.total
        count = np.array([len(p) for p in points], dtype=np.int64)
        relative = np.concatenate(points) if points else np.zeros(0)
        single = np.repeat(self.single, count)
        # Each frequency of a single mode is a group of its own; a spectrum's lines stay together.
        group = np.cumsum(single | (np.diff(np.repeat(self.group, count), prepend=-1) != 0)) - 1
        jerk = min(move.jerk, move.acceleration / move.interval)
        return Problem(
            knots=knots,
            velocity=move.velocity * T,
            acceleration=move.acceleration * T**2,
            jerk=jerk * T**3,
            poles=np.repeat(self.poles, count) * relative * T,
            weights=np.repeat(self.weights, count),
            group=group,
        )

    def least(self, target: float = 0.0) -> Optimum | None:
        """Blocks and frequencies refined around the least residual, until it is below a target."""
        if self.move.count < FEWEST_INTERVALS:
            return None
        every = np.arange(self.move.count + 1)
        knots = every
        if self.move.count > FULL_INTERVALS:
            first = every[: len(every) // 2 + 1 : BLOCK]
            coarse = np.union1d(first, self.move.count - first)
            found = self._null(coarse) or self._exchanged(coarse, 2, target, COARSE_ACCURACY)
            if found is not None and self._amplitudes(coarse, found).max() <= target:
                return self._optimum(coarse, found)
            if found is not None:
                knots = self._refined(coarse, found)
                self._drop_idle(coarse, found)
        found = self._null(knots)
        if found is not None:
            return self._optimum(knots, found)
        found = self._exchanged(knots, self.rounds, target)
        if found is None and len(knots) < len(every):
            knots = every
            found = self._exchanged(knots, ROUNDS, target)
        if found is None:
            return None
        return self._optimum(knots, found)

    def _null(self, knots: Index) -> Solution | None:
        """The smoothest exact null, which a band of frequencies does not have."""
        if any(len(points) > 1 for points in self.points) or not self.single.all():
            return None
        return smoothest(self._problem(knots, self.points), 0.0)

    def _exchanged(
        self, knots: Index, rounds: int, target: float, accuracy: float = ACCURACY
    ) -> Solution | None:
        """The least residual for some blocks, frequencies added until none between is worse.

        Or until it is clear on which side of the target it lies.
        """
        cost = SMOOTHNESS
        best: Solution | None = None
        best_worst = np.inf
        while rounds > 0:
            rounds -= 1
            found = solve(self._problem(knots, self.points), self.reference, cost, accuracy)
            if found is None:
                return best
            # Smoothness has cost at most this; where that is too much, it is made cheaper.
            paid = cost * self.reference * (1.0 - found.peak)
            dear = paid > LOSS * found.worst > LOSS * NULL * self.reference
            if dear and accuracy == ACCURACY:
                cost *= 0.02
                rounds += cost > CHEAPEST
            worst, missing = self._missing(knots, found)
            if worst < best_worst:
                best, best_worst = found, worst
            if not missing or worst <= target or (target > 0.0 and found.worst - paid > target):
                break
        return best

    def _amplitudes(self, knots: Index, found: Solution) -> Array:
        """Residuals over the whole band."""
        return amplitudes(self._problem(knots, self.dense), found.jerk)

    def _missing(self, knots: Index, found: Solution) -> tuple[float, bool]:
        """The true worst residual; frequencies that are worse than the points become points."""
        amplitude = self._amplitudes(knots, found)
        worst = float(amplitude.max(initial=0.0))
        if worst <= max(WORSE * found.worst, NULL * self.reference):
            return worst, False
        group = self._problem(knots, self.dense).group
        by_pole = np.split(amplitude[group], np.cumsum([len(p) for p in self.dense])[:-1])
        for k, (dense, own) in enumerate(zip(self.dense, by_pole, strict=True)):
            peak = (own >= np.append(0.0, own[:-1])) & (own >= np.append(own[1:], 0.0))
            self.points[k] = np.union1d(self.points[k], dense[peak & (own > WORSE * found.worst)])
        return worst, True

    def _drop_idle(self, knots: Index, found: Solution) -> None:
        """Only frequencies near the worst stay, and the ends of each band."""
        amplitude = amplitudes(self._problem(knots, self.points), found.jerk)
        group = self._problem(knots, self.points).group
        ends = np.cumsum([len(p) for p in self.points])[:-1]
        for k, own in enumerate(np.split(amplitude[group], ends)):
            keep = own > IDLE * found.worst
            keep[[0, -1]] = True
            self.points[k] = self.points[k][keep]

    def _refined(self, knots: Index, found: Solution) -> Index:
        """Blocks cut into intervals where the jerk acts, and beside these."""
        size = np.abs(found.jerk)
        active = size > ACTIVE * size.max(initial=0.0)
        if not self.poles.real.any():
            # The jerk of an undamped optimum is even about the middle, and so are its blocks.
            active |= active[::-1].copy()
        active[[0, -1]] = True
        active[1:] |= active[:-1].copy()
        active[:-1] |= active[1:].copy()
        every = np.arange(knots[-1] + 1)
        block = np.searchsorted(knots, every, side="right") - 1
        keep = active[np.minimum(block, len(active) - 1)] & (every % self.cut == 0)
        return np.union1d(knots, every[keep])

    def within(self, worst: float) -> Optimum | None:
        """The least peak jerk under a residual, on the blocks that the least residual needs."""
        allowed = worst / self.scale
        least = self.least()
        if least is None or least.worst > worst:
            return None
        for _ in range(ROUNDS):
            found = smoothest(self._problem(least.knots, self.points), allowed)
            if found is None:
                break
            true, missing = self._missing(least.knots, found)
            if true <= worst / self.scale:
                return self._optimum(least.knots, found)
            # Between the points it is worse; with these added or a little less allowed it is not.
            allowed *= 1.0 if missing else 0.99
        return least

    def _optimum(self, knots: Index, found: Solution) -> Optimum:
        """The solution in the units of the move."""
        worst = float(self._amplitudes(knots, found).max(initial=0.0)) * self.scale
        return Optimum(knots, found.jerk / self.move.count**3, worst)
