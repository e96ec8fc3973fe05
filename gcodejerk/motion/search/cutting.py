r"""The cone programme of `socp` by planes: many frequencies, few blocks.

A guarded optimum has hundreds of cones, of which some tens matter, and it is not known which. This
module owns a programme in which each cone that was found to be exceeded is cut by the plane that
touches it where it was: one more row for each. Neither frequencies nor phases that do not matter
cost anything, while an interior-point solver begins anew whenever one is added.

The least of a linear programme jumps from corner to corner of the planes that there are. So every
step costs its square, too (a proximal bundle method: Kiwiel, Mathematical Programming 46, 1990):
nearer steps need fewer planes and far fewer changes of what is held. Once the planes say well what
a step leaves, or nothing is exceeded, longer steps are let.

The solver is daqp, whose dual active set begins with the rows that were held before. It works on
dense matrices, so this is for few blocks: some hundred take about 10 microseconds a change.

Rule 1: how good a profile is says what it leaves, not the programme (`optimal` measures it).
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
"""Of accelerations as the solver sees them: what a step costs is its square in this unit."""
FIRST, THEN, LAST = 1e-4, 3e-5, 1e-6
"""What a step costs at first, over half of its square; where the jerk is sought then; at least."""
GOOD, LONGER = 1.5, 0.3
"""Where cones are left with no more than this times what planes say, steps cost so much less."""
LONG = 0.1
"""And so much less where nothing is exceeded, but steps still gain."""
SETTLED = 3e-3
"""Steps that can gain no more than this share of what is made least are not taken any more."""
REACH = 0.1
"""How far away the least is thought to be at most, as a share of the accelerations."""
NEAR = 0.2
"""Planes that are neither held nor within this share of what they allow are left out again."""
EXACT = 1e-7
"""Rows that are not held are kept to this much of their length."""
DAMPINGS = (1.0, 10.0, 100.0)
"""Of what steps cost: where the solver goes round in circles, shorter ones are asked for."""
SMALLEST, STILL = 1e-3, 0.1
"""Peak jerk below which steps cost no less; residual below which their least cost does not fall."""
FREE = 1e30
"""What the solver takes for no bound."""
EQUALITY = 5
"""What the solver calls one."""
SOLVED = 1


class Cutting:
    """A programme whose cones are cut by planes, as many as were asked for.

    Attributes
    ----------
    expected : float
        What the cones without a cap are thought to be left with at least: with the planes that
        there are, and if steps go on gaining as the last one did. [-]
    told : float
        What they are left with according to the planes that there are. [-]
    settled : bool
        Another step would hardly gain anything, with the planes that there are.
    left : ndarray, shape (g,)
        What each cone is left with by the last solution. [-]
    """

    def __init__(self, problem: Problem) -> None:
        require_solver()
        self.problem = problem
        self.unknowns = unknowns = Unknowns(problem)
        self.expected, self.told, self.settled = 0.0, 0.0, False
        h, count = unknowns.h, len(unknowns.a)
        # Acceleration and velocity at the knots, jerk of the blocks, for each unknown.
        at = unknowns.at_a
        a = np.zeros((len(h) + 1, count))
        used = np.flatnonzero(at >= 0)
        a[used, at[used] - unknowns.speeds] = UNIT * unknowns.sign[used]
        before, behind, step = a[:-1], a[1:], h[:, np.newaxis]
        v = np.insert(np.cumsum(0.5 * step * (before + behind), axis=0), 0, 0.0, axis=0)
        length = (step * v[:-1] + step**2 / 6.0 * (2.0 * before + behind)).sum(axis=0)
        self._ends = np.stack([length] if unknowns.odd else [length, v[-1]])
        self._shares = ((behind - before) / step)[unknowns.own] / problem.jerk
        self._usable = 1.0 - MARGIN
        # v and the control points of its parabolas; they and accelerations are held where they
        # have to be.
        control = v[:-1] + 0.5 * step * before
        inner = slice(1, unknowns.speeds + 1)
        speeds = np.concatenate([v[inner], control[inner]])
        strengths = UNIT * np.eye(count)
        self._limits = np.concatenate([-speeds, speeds, -strengths, strengths])
        fastest = problem.velocity * self._usable if problem.fast else FREE
        strongest = min(problem.acceleration * self._usable, FREE)
        self._most = np.repeat(
            [0.0, fastest, strongest, strongest], [len(speeds), len(speeds), count, count]
        )
        self._response = unknowns.responses(UNIT)
        self._starts = np.flatnonzero(np.diff(problem.group, prepend=-1))
        self._sizes = np.diff(np.append(self._starts, len(problem.group)))
        self._held = np.zeros(0, dtype=np.int64)
        self._cone = np.zeros(0, dtype=np.int64)
        self._direction = np.zeros((0, self._sizes.max(initial=1)))
        self._planes = np.zeros((0, count))
        self.left = self._caps = self._responded = np.zeros(0)
        # The accelerations, and the residual above what is allowed or the peak jerk.
        self._x, self._last = np.zeros(count), 0.0
        # What steps cost, and at least: where the solver has given up, no less.
        self._smooth, self._cost, self._least = False, FIRST, 0.0
        # Which of the rows of `_shares`, of the limits and of the planes are held, and how much.
        self._of_shares = np.zeros(len(self._shares))
        self._of_limits = self._of_planes = np.zeros(0)

    def begin(self, other: Cutting) -> None:
        """Begin where another programme has ended, and with its planes; blocks may differ."""
        ends = np.insert(np.cumsum(other.unknowns.h), 0, 0.0)
        there = other.unknowns.accelerations(other._full())
        here = np.interp(np.insert(np.cumsum(self.unknowns.h), 0, 0.0), ends, there)
        used = np.flatnonzero((self.unknowns.at_a >= 0) & (self.unknowns.sign > 0))
        self._x[self.unknowns.at_a[used] - self.unknowns.speeds] = here[used] / UNIT
        if np.array_equal(self.problem.group, other.problem.group):
            self._cone, self._direction = other._cone, other._direction
            self._of_planes = other._of_planes
            self._planes = self._rows_of(self._cone, self._direction)

    def solve(self, allowed: float, smooth: bool) -> bool:
        """A step to the least residual, or to the least peak jerk that leaves what is allowed.

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

        if smooth != self._smooth:
            self._smooth, self._cost, self._least = smooth, THEN if smooth else FIRST, 0.0
            self._last = float(np.abs(self._shares @ self._x).max())
        caps = self.problem.cap[self._cone]
        free = np.isnan(caps)
        caps = np.where(free, allowed, caps)
        matrix, lower, upper, kind, multipliers = self._programme(caps, free)
        start = np.append(self._x, self._last)
        one = np.eye(len(start))
        for damping in DAMPINGS:
            cost = self._cost * damping * (max(self._last, SMALLEST) if smooth else 1.0)
            linear = -start
            linear[-1] += 1.0 / cost
            x, _, status, info = daqp.solve(
                one, linear, matrix, upper, lower, kind,
                primal_tol=EXACT, dual_start=multipliers,
            )  # fmt: skip
            if status == SOLVED:
                break
        if status != SOLVED:
            return False
        if damping > 1.0:
            # Where it went round in circles once, it would again.
            self._cost *= damping
            self._least = LONGER * self._cost
        x = np.array(x)
        # The planes allow no more than this to who goes so far.
        gain = REACH * cost * float(np.linalg.norm(x - start) * np.linalg.norm(x))
        self._x, self._last = x[:-1], float(x[-1])
        self._keep(np.array(info["lam"]))
        self.told = most = allowed if smooth else allowed + self._last
        self.expected = self.expected if smooth else max(most - gain, 0.0)
        self._responded = self._response @ self._x
        self.left = np.sqrt(np.add.reduceat(self._responded**2, self._starts))
        self._caps = np.where(np.isnan(self.problem.cap), most, self.problem.cap)
        self.settled = (
            gain <= SETTLED * (self._last if smooth else most) or self._cost <= self._lowest
        )
        if np.all(self.left <= GOOD * self._caps):
            self._cost = max(LONGER * self._cost, self._lowest)
        self._prune(np.where(free, most, caps) - self._planes @ self._x)
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
            Whether anything was cut, or a limit has to be held that was not.
        """
        cut = np.flatnonzero(cones & (self.left > self._caps))
        rows = self._starts[cut, np.newaxis] + np.arange(self._direction.shape[1])
        own = rows < self._starts[cut, np.newaxis] + self._sizes[cut, np.newaxis]
        direction = np.where(own, self._responded[np.where(own, rows, 0)], 0.0)
        direction /= self.left[cut, np.newaxis]
        reached = self._limits @ self._x
        speeds = len(reached) - 2 * len(self._x)
        allowance = 0.5 * MARGIN * self._most
        allowance[:speeds] = 0.5 * MARGIN * np.abs(reached[:speeds]).max(initial=0.0)
        beyond = reached > self._most + allowance
        beyond[self._held] = False
        held = np.flatnonzero(beyond)
        self._held = np.append(self._held, held)
        self._of_limits = np.append(self._of_limits, np.zeros(len(held)))
        self._cone = np.append(self._cone, cut)
        self._direction = np.concatenate([self._direction, direction])
        self._planes = np.concatenate([self._planes, self._rows_of(cut, direction)])
        self._of_planes = np.append(self._of_planes, np.zeros(len(cut)))
        if len(cut) or len(held):
            return True
        self._cost = max(LONG * self._cost, self._lowest)
        return False

    def solution(self) -> Solution:
        """The last solution, mended where it must be exact."""
        return self.unknowns.solution(self._full(), curved=True, null=False)

    @property
    def cones(self) -> NDArray[np.int64]:
        """Those that there are planes of, one for each."""
        return self._cone

    @property
    def _lowest(self) -> float:
        """What steps cost at least."""
        return max(self._least, LAST if self._smooth else LAST * max(self._last, STILL))

    def _full(self) -> Array:
        """The last solution in the columns of `Unknowns`."""
        x = np.zeros(self.unknowns.above + 1)
        x[self.unknowns.a] = UNIT * self._x
        x[self.unknowns.peak] = np.abs(self._shares @ self._x).max()
        return x

    def _programme(
        self, caps: Array, free: Flags
    ) -> tuple[Array, Array, Array, NDArray[np.int32], Array]:
        """Rows, their bounds and kinds, and the multipliers, with those of the unknowns in front.

        For the least peak jerk, jerks are held by it: two rows each.
        """
        count, ends = len(self._x), len(self._ends)
        limits, first, none = self._limits[self._held], np.eye(ends)[0], np.full(count, FREE)
        if self._smooth:
            shares = [self._shares, -self._shares]
            least, most = np.full(2 * len(self._shares), -FREE), np.zeros(2 * len(self._shares))
            of_shares = np.maximum([self._of_shares, -self._of_shares], 0.0).ravel()
        else:
            shares = [self._shares]
            most = np.full(len(self._shares), self._usable)
            least, of_shares = -most, self._of_shares
        matrix = np.zeros((ends + len(most) + len(limits) + len(caps), count + 1))
        np.concatenate([self._ends, *shares, limits, self._planes], out=matrix[:, :-1])
        if self._smooth:
            matrix[ends : ends + len(most), -1] = -1.0
        else:
            matrix[len(matrix) - len(caps) :, -1] = np.where(free, -1.0, 0.0)
        highest = self._usable if self._smooth else FREE
        upper = np.concatenate([none, [highest], first, most, self._most[self._held], caps])
        open_ = np.full(len(limits) + len(caps), -FREE)
        lower = np.concatenate([-none, [0.0], first, least, open_])
        kind = np.zeros(len(upper), dtype=np.int32)
        kind[count + 1 : count + 1 + ends] = EQUALITY
        unheld = np.zeros(count + 1 + ends)
        multipliers = np.concatenate([unheld, of_shares, self._of_limits, self._of_planes])
        return matrix, lower, upper, kind, multipliers

    def _keep(self, multipliers: Array) -> None:
        """What the next programme begins with, of the multipliers of the last one."""
        jerks = len(self._shares) * (1 + self._smooth)
        at = np.cumsum([len(self._x) + 1 + len(self._ends), jerks, len(self._held)])
        _, of_shares, self._of_limits, self._of_planes = np.split(multipliers, at)
        if self._smooth:
            up, down = np.split(of_shares, 2)
            of_shares = up - down
        self._of_shares = of_shares

    def _rows_of(self, cone: NDArray[np.int64], direction: Array) -> Array:
        """Rows of the planes that touch cones in these directions."""
        planes = np.zeros((len(cone), len(self._x)))
        for k, part in enumerate(direction.T):
            row = np.minimum(self._starts[cone] + k, len(self._response) - 1)
            planes += part[:, np.newaxis] * self._response[row]
        return planes

    def _prune(self, slack: Array) -> None:
        """Leave out the planes that are far away, each by its slack."""
        kept = (self._of_planes != 0.0) | (slack < NEAR * self._caps[self._cone])
        if not kept.all():
            self._cone, self._direction = self._cone[kept], self._direction[kept]
            self._planes, self._of_planes = self._planes[kept], self._of_planes[kept]
