r"""The cone programme of `socp` by planes: many frequencies, few blocks.

A guarded optimum has hundreds of cones, of which some tens matter, and it is not known which. This
module owns a linear programme in which each cone that was found to be exceeded is cut by the plane
that touches it where it was: one more row for each, the solution before it being where the next one
begins. Neither frequencies nor phases that do not matter cost anything, while an interior-point
solver begins anew whenever one is added.

The solver is daqp, whose dual active set takes rows that are added to a solved programme as its
next steps. It works on dense matrices, so this is for few blocks: some hundred take about 30
microseconds a step.

Rule 1: the least of the programme with planes is a lower bound of that with cones; how good a
profile is says what it leaves, not the programme (`optimal` measures it).
Rule 2: whatever the solver does not call solved is no solution, and says nothing else: who asked
goes to the solver for cones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.socp import MARGIN, Problem, Solution, Unknowns, require_solver

Flags = NDArray[np.bool_]

UNIT = 0.2
"""Of accelerations as the solver sees them: how many steps it takes depends on it, by a third."""
NEAR = 0.1
"""Planes that are neither held nor within this share of what they allow are left out again."""
EXACT = 1e-9
"""Rows that are not held are kept to this much of their length."""
DAMPINGS = (-1e-6, -1e-5)
"""Weight of squares that the solver takes for a linear programme: its own, and where it goes round
in circles, a larger one. Negative: only where it finds that it needs one."""
FREE = 1e30
"""What the solver takes for no bound."""
EQUALITY = 5
"""What the solver calls one."""
SOLVED = 1


class Cutting:
    """A programme whose cones are cut by planes, as many as were asked for.

    Attributes
    ----------
    bound : float
        What the cones without a cap are left with at least, by the last that was sought. [-]
    left : ndarray, shape (g,)
        What each cone is left with by the last solution. [-]
    """

    def __init__(self, problem: Problem) -> None:
        require_solver()
        self.problem = problem
        self.unknowns = unknowns = Unknowns(problem)
        self.bound = 0.0
        h, own = unknowns.h, unknowns.own
        slopes = len(unknowns.a)
        self.peak, self.above, self.width = slopes, slopes + 1, slopes + 2
        # Acceleration and velocity at the knots, jerk of the blocks, for each unknown.
        at = unknowns.at_a
        a = np.zeros((len(h) + 1, self.width))
        used = np.flatnonzero(at >= 0)
        a[used, at[used] - unknowns.speeds] = UNIT * unknowns.sign[used]
        before, behind, step = a[:-1], a[1:], h[:, np.newaxis]
        v = np.insert(np.cumsum(0.5 * step * (before + behind), axis=0), 0, 0.0, axis=0)
        length = (step * v[:-1] + step**2 / 6.0 * (2.0 * before + behind)).sum(axis=0)
        jerk = (behind - before) / step
        self._response = problem.rows @ jerk
        self._starts = np.flatnonzero(np.diff(problem.group, prepend=-1))
        self._sizes = np.diff(np.append(self._starts, len(problem.group)))
        share = jerk[own] / problem.jerk
        share, most = np.concatenate([share, -share]), np.zeros(self.width)
        most[self.peak] = 1.0
        ends = [length] if unknowns.odd else [length, v[-1]]
        self._rows = np.concatenate([ends, share - most])
        self._exact = len(ends)
        usable = 1.0 - MARGIN
        limit = min(problem.acceleration * usable / UNIT, FREE)
        self._most = np.append(np.full(slopes, limit), [usable, FREE])
        self._least = np.append(np.full(slopes, -limit), [0.0, 0.0])
        # v and the control points of its parabolas, which are held where they have to be.
        control = v[:-1] + 0.5 * step * before
        self._speeds = np.concatenate(
            [v[1 : unknowns.speeds + 1], control[1 : unknowns.speeds + 1]]
        )
        self._fastest = problem.velocity * usable if problem.fast else FREE
        self._held = np.zeros(0, dtype=np.int64)
        self._cone = np.zeros(0, dtype=np.int64)
        self._direction = np.zeros((0, self._sizes.max(initial=1)))
        self.left = self._caps = self._responded = np.zeros(0)
        self._x: Array | None = None
        self._multipliers = np.zeros(0)

    def begin(self, other: Cutting) -> None:
        """Begin where another programme has ended, and with its planes; blocks may differ."""
        if other._x is None:
            return
        ends = np.insert(np.cumsum(other.unknowns.h), 0, 0.0)
        there = other.unknowns.accelerations(other._full())
        here = np.interp(np.insert(np.cumsum(self.unknowns.h), 0, 0.0), ends, there)
        used = np.flatnonzero((self.unknowns.at_a >= 0) & (self.unknowns.sign > 0))
        self._x = np.append(np.zeros(self.peak), other._x[other.peak :])
        self._x[self.unknowns.at_a[used] - self.unknowns.speeds] = here[used] / UNIT
        if np.array_equal(self.problem.group, other.problem.group):
            self._cone, self._direction = other._cone, other._direction

    def solve(self, allowed: float, smooth: bool) -> bool:
        """Find the least residual, or what leaves no more than is allowed with the least peak jerk.

        Parameters
        ----------
        allowed : float
            A residual that is as good as none. [-]
        smooth : bool
            The least peak jerk is sought.

        Returns
        -------
        bool
            False: the solver has found nothing.
        """
        import daqp

        planes, caps = self._planes(allowed)
        speeds = self._speeds[self._held]
        rows = np.concatenate([self._rows, speeds, planes])
        first = np.zeros(len(self._rows))
        first[0] = 1.0
        least = np.where(np.arange(len(first)) < self._exact, first, -FREE)
        fastest, none = np.full(len(speeds), self._fastest), np.full(len(caps), -FREE)
        upper = np.concatenate([self._most, first, fastest, caps])
        lower = np.concatenate([self._least, least, np.zeros(len(speeds)), none])
        kind = np.zeros(len(upper), dtype=np.int32)
        kind[self.width : self.width + self._exact] = EQUALITY
        cost = np.zeros(self.width)
        cost[self.peak if smooth else self.above] = 1.0
        upper[self.above] = 0.0 if smooth else FREE
        start = {}
        if self._x is not None:
            start["primal_start"] = self._x.copy()
            if len(self._multipliers) == len(upper):
                start["dual_start"] = self._multipliers
        square = np.zeros((self.width, self.width))
        for damping in DAMPINGS:
            x, _, status, info = daqp.solve(
                square, cost, rows, upper, lower, kind,
                primal_tol=EXACT, eps_prox=damping, **start,
            )  # fmt: skip
            if status == SOLVED:
                break
        if status != SOLVED:
            return False
        self._x, self._multipliers = np.array(x), np.array(info["lam"])
        most = allowed + float(self._x[self.above])
        self.bound = self.bound if smooth else most
        self._responded = self._response @ self._x
        self.left = np.sqrt(np.add.reduceat(self._responded**2, self._starts))
        self._caps = np.where(np.isnan(self.problem.cap), most, self.problem.cap)
        self._prune(caps - planes @ self._x)
        return True

    def cut(self, cones: Flags) -> bool:
        """Cut cones by the planes that touch them where the solution exceeds them.

        Parameters
        ----------
        cones : ndarray of bool, shape (g,)
            Those that may be cut: those of them are that the solution exceeds.

        Returns
        -------
        bool
            Whether anything was cut, or a speed is held that was not.
        """
        cut = np.flatnonzero(cones & (self.left > self._caps))
        rows = self._starts[cut, np.newaxis] + np.arange(self._direction.shape[1])
        own = rows < self._starts[cut, np.newaxis] + self._sizes[cut, np.newaxis]
        direction = np.where(own, self._responded[np.where(own, rows, 0)], 0.0)
        speed = self._speeds @ self._x
        small = 0.5 * MARGIN * np.abs(speed).max(initial=0.0)
        beyond = (speed < -small) | (speed > self._fastest + small)
        beyond[self._held] = False
        held = np.flatnonzero(beyond)
        at = self.width + len(self._rows) + len(self._held)
        before, behind = np.split(self._multipliers, [at])
        self._multipliers = np.concatenate(
            [before, np.zeros(len(held)), behind, np.zeros(len(cut))]
        )
        self._held = np.append(self._held, held)
        self._cone = np.append(self._cone, cut)
        self._direction = np.concatenate([self._direction, direction / self.left[cut, np.newaxis]])
        return bool(len(cut) or len(held))

    def solution(self) -> Solution:
        """The last solution, mended where it must be exact."""
        return self.unknowns.solution(self._full(), curved=True, null=False)

    def _full(self) -> Array:
        """The last solution in the columns of `Unknowns`, which has speeds in front."""
        assert self._x is not None
        x = np.concatenate([np.zeros(self.unknowns.speeds), self._x])
        x[self.unknowns.a] *= UNIT
        return x

    def _planes(self, allowed: float) -> tuple[Array, Array]:
        """The rows of the planes, and what each may be at most."""
        planes = np.zeros((len(self._cone), self.width))
        for k, direction in enumerate(self._direction.T):
            row = np.minimum(self._starts[self._cone] + k, len(self._response) - 1)
            planes += direction[:, np.newaxis] * self._response[row]
        caps = self.problem.cap[self._cone]
        free = np.isnan(caps)
        planes[free, self.above] -= 1.0
        return planes, np.where(free, allowed, caps)

    def _prune(self, slack: Array) -> None:
        """Leave out the planes that are far away, each by its slack."""
        held, multipliers = np.split(self._multipliers, [len(self._multipliers) - len(slack)])
        kept = (multipliers != 0.0) | (slack < NEAR * self._caps[self._cone])
        self._cone, self._direction = self._cone[kept], self._direction[kept]
        self._multipliers = np.concatenate([held, multipliers[kept]])
