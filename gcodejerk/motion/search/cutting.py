r"""The cone programme of `socp` by planes: many frequencies, few blocks.

A guarded optimum has hundreds of cones, of which some tens matter, and it is not known which. This
module owns a programme in which each cone that was found to be exceeded is cut by the plane that
touches it where it was: one more row for each. Neither frequencies nor phases that do not matter
cost anything, while an interior-point solver begins anew whenever one is added. Limits of jerk and
velocity are rows where they were exceeded, too; those of the acceleration are bounds of unknowns.

Made least is the residual t above what is allowed, with a part of the peak jerk p (a share of its
limit): :math:`t - s \ln(1 - p)`. So less jerk costs no more than s of the residual: where t, which
is convex in p, falls with :math:`s/(1 - p)`, it falls by no more than s until p = 1. Or the peak
jerk alone is made least, for what is allowed.

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

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.programme import (
    MARGIN,
    Index,
    Problem,
    Solution,
    Unknowns,
    solutions,
)
from gcodejerk.motion.search.socp import require_solver

Flags = NDArray[np.bool_]

UNIT = 0.05
"""Of accelerations as the solver sees them, as a share of what is needed at least: what a step
costs is its square in this unit."""
FIRST, THEN, LAST = 3e-4, 3e-5, 3e-7
"""What a step costs at first, over half of its square; where the jerk is sought then; at least."""
GOOD, LONGER = 1.5, 0.3
"""Where cones are left with no more than this times what planes say, steps cost so much less."""
LONG = 0.1
"""And so much less where nothing is exceeded, but steps still gain."""
SETTLED, SMOOTHED = 1e-3, 3e-3
"""Steps that can gain no more than this share of the residual, or of the peak jerk where that is
made least, are not taken any more."""
REACH = 0.1
"""How far away the least is thought to be at most, as a share of the accelerations."""
NEAR, IDLE = 0.1, 0.3
"""Planes that are neither held nor within this share of what they allow are left out again, and so
are rows of jerks that are so much below the peak."""
EXACT = 1e-7
"""Rows that are not held are kept to this much of their length."""
SMALL_PIVOT = 1e-9
"""For less, held rows are put into another order, which costs as much as beginning anew: at the
solver's own 1e-8, every change does where the jerk has no limit, or next to none."""
UNEVEN, CLOSE = 1e-3, 1e-3
"""A jerk may exceed the peak by so much of it, within the limit; and speeds that are so close to
theirs where another programme has ended are held from the beginning."""
STEEPEST, LIGHT = 0.9, 0.01
"""Above this peak jerk what it costs rises no faster; what its own steps cost, beside those of
accelerations."""
TRIES = ((1.0, EXACT), (1.0, 0.01 * EXACT), (10.0, EXACT), (100.0, EXACT))
"""Times of what steps cost, and how well rows are kept: where some are lost, they are looked at
closer; where the solver goes round in circles, steps are shorter."""
SMALLEST, STILL = 1e-3, 0.1
"""Peak jerk below which steps cost no less; residual below which their least cost does not fall."""
FREE, EQUALITY, SOLVED = 1e30, 5, 1
"""What the solver takes for no bound, and what it calls an equation, and solved."""
LOST, TINY = 1e-6, 1e-12
"""What is solved keeps every row to this much of its length; and length of a row at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """What would be left less for each limit that were higher, and what planes weigh.

    Attributes
    ----------
    rows : ndarray, shape (r,)
        On every row of a cone.
    ends : ndarray, shape (1,) or (2,)
        On the length, and the velocity at the end where that is not left to symmetry.
    jerks : ndarray, shape (k,)
        On the jerk of each block that is no image of another, in their order.
    accelerations : ndarray, shape (a,)
        On each unknown acceleration, in the order of the knots.
    speeds, controls : ndarray, shape (s,)
        On the velocity at inner knots, and on the control point of the parabola behind each.
    """

    rows: Array
    ends: Array
    jerks: Array
    accelerations: Array
    speeds: Array
    controls: Array


class Cutting:
    """A programme whose cones are cut by planes, as many as were asked for.

    Attributes
    ----------
    expected : float
        What the cones without a cap are thought to be left with at least: with the planes that
        there are, and if steps go on gaining as the last one did. [-]
    told : float
        What they are left with according to the planes that there are. [-]
    peak : float
        The peak jerk according to the rows that there are, as a share of its limit. [-]
    settled : bool
        Another step would hardly gain anything, with the planes that there are.
    left : ndarray, shape (g,)
        What each cone is left with by the last solution. [-]
    """

    def __init__(self, problem: Problem) -> None:
        require_solver()
        self.problem = problem
        self.unknowns = unknowns = Unknowns(problem)
        self.expected, self.told, self.peak, self.settled = 0.0, 0.0, 0.0, False
        h, count = unknowns.h, len(unknowns.a)
        self._unit = UNIT * needed_acceleration(problem.velocity)
        # Acceleration and velocity at the knots, jerk of the blocks, for each unknown.
        at = unknowns.at_a
        a = np.zeros((len(h) + 1, count))
        used = np.flatnonzero(at >= 0)
        a[used, at[used] - unknowns.speeds] = self._unit * unknowns.sign[used]
        before, behind, step = a[:-1], a[1:], h[:, np.newaxis]
        v = np.insert(np.cumsum(0.5 * step * (before + behind), axis=0), 0, 0.0, axis=0)
        length = (step * v[:-1] + step**2 / 6.0 * (2.0 * before + behind)).sum(axis=0)
        self._ends = np.stack([length] if unknowns.odd else [length, v[-1]])
        shares = ((behind - before) / step)[unknowns.own] / problem.jerk
        # v and the control points of its parabolas.
        control = v[:-1] + 0.5 * step * before
        inner = slice(1, unknowns.speeds + 1)
        self._limits = np.concatenate([shares, v[inner], control[inner]])
        self._jerks = len(shares)
        self._usable = 1.0 - MARGIN
        self._fastest = problem.velocity * self._usable if problem.fast else FREE
        self._strongest = min(problem.acceleration * self._usable / self._unit, FREE)
        self._responses = unknowns.responses(self._unit)
        self._starts = np.flatnonzero(np.diff(problem.group, prepend=-1))
        self._sizes = np.diff(np.append(self._starts, len(problem.group)))
        # Limits that are held: row k from above, row k + len(_limits) from below.
        self._held = np.zeros(0, dtype=np.int64)
        self._cone = np.zeros(0, dtype=np.int64)
        self._direction = np.zeros((0, self._sizes.max(initial=1)))
        self._planes = np.zeros((0, count))
        self.left = self._caps = self._responded = np.zeros(0)
        # The accelerations, the residual above what is allowed and the peak jerk.
        self._x, self._above = np.zeros(count), 0.0
        # What steps cost, and at least: where the solver has given up, no less.
        self._smooth, self._cost, self._least = False, FIRST, 0.0
        # How much accelerations and these rows are held.
        self._of_bounds, self._of_ends = np.zeros(count), np.zeros(len(self._ends))
        self._of_held = self._of_planes = np.zeros(0)

    def begin(self, other: Cutting) -> None:
        """Begin where another programme has ended, and with its planes; blocks may differ."""
        here, there = (c.problem.knots / c.problem.knots[-1] for c in (self, other))
        known = other.unknowns.accelerations(other._full())
        used = np.flatnonzero((self.unknowns.at_a >= 0) & (self.unknowns.sign > 0))
        own = self.unknowns.at_a[used] - self.unknowns.speeds
        self._x[own] = np.interp(here[used], there, known) / self._unit
        self._above, self.peak = other._above, other.peak
        # Where the solver starts is a guess, of which only the sign counts: accelerations at their
        # limit, and planes. Of jerks it finds sooner itself which are held in other blocks.
        most = self._strongest * (1.0 - EXACT)
        self._of_bounds = np.sign(self._x) * (np.abs(self._x) >= most)
        reached = self._limits @ self._x
        jerk = np.arange(len(reached)) < self._jerks
        steep, fast = (1.0 - UNEVEN) * self.peak, np.abs(reached[~jerk]).max(initial=0.0)
        above = reached > np.where(jerk, steep, (1.0 - CLOSE) * self._fastest)
        below = reached < np.where(jerk, -steep, CLOSE * fast)
        self._held = np.flatnonzero(np.concatenate([above, below]))
        self._of_held = np.zeros(len(self._held))
        if np.array_equal(self.problem.group, other.problem.group):
            self._cone, self._direction = other._cone, other._direction
            self._of_planes = other._of_planes
            self._planes = self._rows_of(self._cone, self._direction)

    def solve(self, allowed: float, given: float = np.inf) -> bool:
        """A step to the least residual, or to the least peak jerk that leaves what is allowed.

        Parameters
        ----------
        allowed : float
            A residual that is as good as none. [-]
        given : float, optional
            What less jerk may cost of the residual that is above; infinite, as it is by default:
            nothing is above, and the least peak jerk is sought. [-]

        Returns
        -------
        bool
            False: the solver has found nothing.
        """
        import daqp

        smooth = bool(np.isinf(given))
        if smooth != self._smooth:
            self._smooth, self._cost, self._least = smooth, THEN if smooth else FIRST, 0.0
            if smooth:
                self._hold_jerks()
        caps = self.problem.cap[self._cone]
        free = np.isnan(caps)
        caps = np.where(free, allowed, caps)
        matrix, lower, upper, kind, multipliers = self._programme(caps, free)
        start = np.concatenate([self._x, [0.0 if smooth else self._above, self.peak]])
        # The jerk's cost is a parabola around the last peak.
        last = min(self.peak, STEEPEST)
        curvature = 0.0 if smooth else given / (1.0 - last) ** 2
        slope = 1.0 if smooth else given / (1.0 - last) - curvature * last
        squares, linear = np.eye(len(start)), np.append(-start[:-2], [0.0, 0.0])
        for damping, exact in TRIES:
            cost = self._cost * damping * (max(self.peak, SMALLEST) if smooth else 1.0)
            squares[-1, -1] = LIGHT + curvature / cost
            linear[-2:] = (0.0 if smooth else 1.0 / cost) - start[-2], slope / cost
            linear[-1] -= LIGHT * self.peak
            x, _, status, info = daqp.solve(
                squares, linear, matrix, upper, lower, kind,
                primal_tol=exact, pivot_tol=SMALL_PIVOT, dual_start=multipliers,
            )  # fmt: skip
            solved = status == SOLVED and _kept(x, matrix, lower, upper)
            if solved:
                break
        if not solved:
            return False
        if damping > 1.0:
            # Where it went round in circles once, it would again.
            self._cost *= damping
            self._least = LONGER * self._cost
        x = np.array(x)
        # The planes allow no more than this to who goes so far.
        gain = REACH * cost * float(np.linalg.norm(x - start) * np.linalg.norm(x))
        self._x, self._above, self.peak = x[:-2], float(x[-2]), float(x[-1])
        self._keep(np.array(info["lam"]))
        self.told = most = allowed + self._above
        self.expected = self.expected if smooth else max(most - gain, 0.0)
        self._responded = self.problem.seen(self._responses.of(self._x))
        self.left = np.sqrt(np.add.reduceat(self._responded**2, self._starts))
        self._caps = np.where(np.isnan(self.problem.cap), most, self.problem.cap)
        self.settled = (
            gain <= (SMOOTHED * self.peak if smooth else SETTLED * most)
            or self._cost <= self._lowest
        )
        if np.all(self.left <= GOOD * self._caps):
            self._cost = max(LONGER * self._cost, self._lowest)
        self._paid = cost
        self._weighed_by = (
            self._cone, self._direction, self._of_planes, self._held, self._of_held,
        )  # fmt: skip
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
        beyond = self._beyond()
        if len(cut):
            self._cone = np.concatenate([self._cone, cut])
            self._direction = np.concatenate([self._direction, direction])
            self._planes = np.concatenate([self._planes, self._rows_of(cut, direction)])
            self._of_planes = np.concatenate([self._of_planes, np.zeros(len(cut))])
        if len(beyond):
            self._held = np.concatenate([self._held, beyond])
            self._of_held = np.concatenate([self._of_held, np.zeros(len(beyond))])
        if len(cut) or len(beyond):
            return True
        self._cost = max(LONG * self._cost, self._lowest)
        return False

    def jerk(self) -> Array:
        """The last solution's jerk in each block that is no image of another, shape (k,)."""
        jerk: Array = self.problem.jerk * (self._limits[: self._jerks] @ self._x)
        return jerk

    def solution(self) -> Solution:
        """The last solution, mended where it must be exact."""
        return solutions([self.unknowns], self._full(), curved=True, null=False)[0]

    @property
    def cones(self) -> Index:
        """Those that there are planes of, one for each."""
        return self._cone

    @property
    def _lowest(self) -> float:
        """What steps cost at least."""
        return max(self._least, LAST if self._smooth else LAST * max(self.told, STILL))

    def _full(self) -> Array:
        """The last solution in the columns of `Unknowns`."""
        x = np.zeros(self.unknowns.end)
        x[self.unknowns.a] = self._unit * self._x
        x[self.unknowns.peak] = np.abs(self._limits[: self._jerks] @ self._x).max()
        return x

    def _hold_jerks(self) -> None:
        """Hold the jerk of every block by the peak, which is theirs."""
        jerk = self._limits[: self._jerks] @ self._x
        row = np.arange(self._jerks)
        new = np.setdiff1d(np.concatenate([row, row + len(self._limits)]), self._held)
        self._held = np.append(self._held, new)
        self._of_held = np.append(self._of_held, np.zeros(len(new)))
        self.peak = float(np.abs(jerk).max(initial=0.0))

    def _beyond(self) -> Index:
        """Limits that are exceeded and not held."""
        reached = self._limits @ self._x
        steep = min((1.0 + UNEVEN) * self.peak, self._usable * (1.0 + 0.5 * MARGIN))
        speeds = reached[self._jerks :]
        most, least = np.full(len(reached), steep), np.full(len(reached), -steep)
        most[self._jerks :] = self._fastest * (1.0 + 0.5 * MARGIN)
        least[self._jerks :] = -0.5 * MARGIN * np.abs(speeds).max(initial=0.0)
        beyond = np.concatenate([reached > most, reached < least])
        beyond[self._held] = False
        return np.flatnonzero(beyond)

    def _programme(
        self, caps: Array, free: Flags
    ) -> tuple[Array, Array, Array, NDArray[np.int32], Array]:
        """Rows, their bounds and kinds, the multipliers; those of the unknowns are in front."""
        count, ends, held, planes = (
            len(part) for part in (self._x, self._ends, self._held, self._planes)
        )
        row, low = self._held % len(self._limits), self._held >= len(self._limits)
        jerks = row < self._jerks
        matrix = np.zeros((ends + held + planes, count + 2))
        limits = np.where(low, -1.0, 1.0)[:, np.newaxis] * self._limits[row]
        np.concatenate([self._ends, limits, self._planes], out=matrix[:, :-2])
        matrix[ends : ends + held, -1] = np.where(jerks, -1.0, 0.0)
        matrix[ends + held :, -2] = np.where(free, -1.0, 0.0)
        first = np.eye(ends)[0]
        bounds = np.append(np.full(count, self._strongest), 0.0 if self._smooth else FREE)
        most = np.concatenate(
            [bounds, [self._usable], first, np.where(jerks | low, 0.0, self._fastest), caps]
        )
        least = np.full(len(most), -FREE)
        least[: count + 2 + ends] = np.concatenate([-bounds[:-1], [0.0, 0.0], first])
        kind = np.zeros(len(most), dtype=np.int32)
        kind[count + 2 : count + 2 + ends] = EQUALITY
        if self._smooth:
            kind[count] = EQUALITY
        none = np.zeros(2 + ends)
        multipliers = np.concatenate([self._of_bounds, none, self._of_held, self._of_planes])
        return matrix, least, most, kind, multipliers

    def _keep(self, multipliers: Array) -> None:
        """What the next programme begins with, of the multipliers of the last one."""
        ends = len(self._x) + 2
        held = ends + len(self._ends)
        planes = held + len(self._held)
        self._of_bounds, self._of_ends = multipliers[: ends - 2], multipliers[ends:held]
        self._of_held, self._of_planes = multipliers[held:planes], multipliers[planes:]

    def _rows_of(self, cone: Index, direction: Array) -> Array:
        """Rows of the planes that touch cones in these directions."""
        if not len(cone):
            return np.zeros((0, len(self._x)))
        # Of cones of fewer rows than others the last directions are 0.
        row = self._starts[cone, np.newaxis] + np.arange(direction.shape[1])
        row = np.minimum(row, len(self.problem.group) - 1)
        near, share = self.problem.near, self.problem.share
        if near is None or share is None:
            return self._responses.to(np.einsum("ck,ckn->cn", direction, self._responses.rows[row]))
        shares = (direction[..., np.newaxis] * share[row]).reshape(len(cone), -1)
        nodes = near[row].reshape(len(cone), -1)
        planes = np.matmul(shares[:, np.newaxis], self._responses.rows[nodes])[:, 0]
        return self._responses.to(planes)

    def _prune(self, slack: Array) -> None:
        """Leave out the planes that are far away, each by its slack, and idle rows of jerks."""
        kept = (self._of_planes != 0.0) | (slack < NEAR * self._caps[self._cone])
        if not kept.all():
            self._cone, self._direction = self._cone[kept], self._direction[kept]
            self._planes, self._of_planes = self._planes[kept], self._of_planes[kept]
        row = self._held % len(self._limits)
        idle = (row < self._jerks) & (self._of_held == 0.0) & (not self._smooth)
        idle[idle] = np.abs(self._limits[row[idle]] @ self._x) < (1.0 - IDLE) * self.peak
        if idle.any():
            self._held, self._of_held = self._held[~idle], self._of_held[~idle]

    def weights(self) -> Weights:
        """What the last step has found every limit and plane to be worth."""
        cone, direction, of_planes, held, of_held = self._weighed_by
        rows = self._starts[cone, np.newaxis] + np.arange(direction.shape[1])
        own = rows < (self._starts + self._sizes)[cone, np.newaxis]
        weighed: Array = (direction * of_planes[:, np.newaxis])[own]
        of_rows = np.bincount(rows[own], weighed, len(self.problem.group)).astype(np.float64)
        row, low = held % len(self._limits), held >= len(self._limits)
        of_limits = np.zeros(len(self._limits))
        np.add.at(of_limits, row, np.where(low, -of_held, of_held))
        jerks, speeds, controls = np.split(
            self._paid * of_limits, [self._jerks, self._jerks + self.unknowns.speeds]
        )
        return Weights(
            self._paid * of_rows,
            self._paid * self._of_ends,
            jerks / self.problem.jerk,
            self._paid * self._of_bounds / self._unit,
            speeds,
            controls,
        )


def _kept(x: Array, matrix: Array, lower: Array, upper: Array) -> bool:
    """Whether a solution keeps all: with multipliers of 1e7 daqp has lost rows, and said solved."""
    reached = np.concatenate([x, matrix @ x])
    lost = np.maximum(reached - upper, lower - reached)
    sizes = np.sqrt(np.einsum("rn,rn->r", matrix, matrix))
    lost[len(x) :] /= np.maximum(sizes, TINY)
    return bool(lost.max() <= LOST)


def needed_acceleration(velocity: float) -> float:
    """Least acceleration of the unit length in the unit of time, for a velocity above 1."""
    return velocity**2 / (velocity - 1.0) if 1.0 < velocity < 2.0 else 4.0
