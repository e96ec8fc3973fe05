"""The settings that leave least: a search over all that a control can be set to, with a proof.

This module owns the search. All numbers that can be written, within what the machine allows, are
candidates. What one move leaves at one frequency is less than what the worst move leaves at its
worst frequency: so a few of these *cuts*, computed for all candidates at once, bound them all from
below. The candidate with the lowest bound is judged on all moves; where it turns out worse than its
bound, its worst move and frequency become a cut. When no bound is below the best that was judged,
the best is the best of all candidates, and only few were judged.

Rule: more candidates than `MOST` are thinned first, evenly in the logarithm, and every step of the
control is searched around the best of the thinned ones. Then the proof holds for those that were
searched; and, of many moves, as far as a sample tells within `SURE` which are too slow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.parameters.judge import Judge
from gcodejerk.parameters.moves import Moves
from gcodejerk.parameters.settings import Setting

MOST = 10000
"""Candidates that are searched at a time."""
MOST_MEAN = 1200
"""The same for a mean, which few cuts do not bound: a sample of the moves is judged for all."""
MOST_OF_ONE = 256
"""Numbers of one setting that are searched at a time."""
SAMPLE = 48
"""Moves that stand for all where candidates are sorted out."""
MOST_AHEAD = 256
"""Candidates of which the times of all moves are computed at once."""
SAME = 1.0 + 1e-6
"""Times that differ by less are the same. [-]"""
SURE = 0.03
"""How far the time of the sample may be off; candidates beyond are taken for too slow. [-]"""
FIRST_CUTS, ROUNDS, MEANS, BETTER_ONES, FINER = 8, 400, 3, 2, 12
WORST, MEAN = "worst", "mean"
GOALS = (WORST, MEAN)
"""What is made small: the worst rapid before a cut, or the mean of them."""
EQUAL = 1e-3
"""Settings that leave so little more than the best, relatively, are as good: the fastest wins."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True)
class Goal:
    """What is made small, and what may not grow."""

    kind: str
    budget: float
    """Time of all moves together, each as often as it occurs [s]."""


def goal_value(worst: Array, moves: Moves, kind: str) -> Array:
    """A goal's value of moves' residuals, (k, n) -> (k,) [mm]."""
    need = needs(moves)
    if kind == WORST:
        return np.asarray(np.where(need > 0.0, worst, 0.0).max(axis=-1))
    return np.asarray(worst @ need / need.sum())


def needs(moves: Moves) -> Array:
    """How much each move counts: as often as a cut follows; all of them where none does."""
    return moves.cut if moves.cut.any() else moves.count


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The best of some candidates.

    Attributes
    ----------
    written : ndarray, shape (s,)
        Its numbers.
    value, total : float
        What it leaves, and how long all moves take. [mm], [s]
    runners_up : tuple of ndarray
        Others that were judged, best first.
    proven : bool
        No other candidate leaves less.
    judged : int
        How many were judged on all moves.
    """

    written: Array
    value: float
    total: float
    runners_up: tuple[Array, ...]
    proven: bool
    judged: int


class Candidates:
    """Settings side by side, what bounds them, and which of them may still be best.

    What was learned of them for one budget is used for the next.
    """

    def __init__(self, judge: Judge, rows: Array, start: Array) -> None:
        self.judge, self.rows = judge, rows
        self.moves = judge.moves
        index, weight = representatives(self.moves)
        sample = judge.take(index)
        self.estimated = sample.times(rows) @ weight
        self.exact = len(index) == len(self.moves)
        if not self.exact:
            # What the sample is off by changes little from one setting to the next.
            one = start[np.newaxis]
            whole = float(judge.times(one)[0] @ self.moves.count)
            self.estimated *= whole / float(sample.times(one)[0] @ weight)
        self.nobody = np.zeros(len(rows), dtype=bool)
        self.bound = np.zeros(len(rows))
        self.cuts: dict[tuple[int, int], NDArray[np.bool_]] = {}
        """Candidates that each move at each frequency has bounded."""
        self.needed = np.flatnonzero(needs(self.moves) > 0.0)
        self.sample = np.intersect1d(index, self.needed)
        if not len(self.sample):
            self.sample = self.needed
        self.totals: dict[int, float] = {}
        self.ahead = 1
        """For how many candidates times are computed at once: twice as many each time."""

    def total(self, k: int, alive: NDArray[np.bool_] | None = None) -> float:
        """Time of all moves at one candidate [s]; `alive`: those that are asked for next."""
        if self.exact:
            return float(self.estimated[k])
        if k not in self.totals:
            some = [k]
            if alive is not None:
                near = np.flatnonzero(alive)
                near = near[np.argsort(self.bound[near], kind="stable")]
                some += near[: self.ahead - 1].tolist()
                self.ahead = min(2 * self.ahead, MOST_AHEAD)
            times = self.judge.times(self.rows[some]) @ self.moves.count
            self.totals |= dict(zip(some, times.tolist(), strict=True))
        return self.totals[k]

    def residuals(self, k: int) -> Array:
        """What one candidate leaves after each move at each frequency, (n, g) [mm]."""
        return np.asarray(self.judge.residuals(self.rows[k : k + 1])[0])

    def largest(self, k: int, beaten: float = np.inf) -> tuple[float, int, int]:
        """The largest residual of one candidate, and its move and frequency.

        Some moves are judged first: where one of them leaves more than `beaten`, the others need
        not be known.
        """
        for index in (self.sample, self.needed):
            part = self.judge.take(index).residuals(self.rows[k : k + 1])[0]
            at, group = np.unravel_index(int(part.argmax()), part.shape)
            value = float(part[at, group])
            if value >= beaten or len(index) == len(self.needed):
                break
        return value, int(index[at]), int(group)

    def cut(self, move: int, groups: set[int], alive: NDArray[np.bool_]) -> None:
        """Bound all candidates that are alive by what one move leaves at some frequencies."""
        done = {group: self.cuts.get((move, group), self.nobody) for group in groups}
        new = {group for group in groups if (alive & ~done[group]).any()}
        if not new:
            return
        index = np.flatnonzero(alive & ~np.logical_and.reduce([done[group] for group in new]))
        self.cuts |= {(move, group): done[group] | alive for group in new}
        one = self.judge.take(np.array([move])).at(np.array(sorted(new)))
        self.bound[index] = np.maximum(self.bound[index], one.worst(self.rows[index])[:, 0])

    def worst_of(self, goal: Goal, start: int) -> Found | None:
        """The candidate whose worst move leaves least within the budget; None: there is none."""
        slack = SAME if self.exact else 1.0 + SURE
        alive = self.estimated <= goal.budget * slack
        if not alive.any():
            return None
        self._first_cuts(alive, start)
        best, best_value = -1, np.inf
        judged: dict[int, float] = {}
        proven = False
        rounds = 0
        while rounds < ROUNDS:
            alive &= self.bound < best_value * (1.0 - 1e-12)
            if not alive.any():
                proven = True
                break
            k = int(np.flatnonzero(alive)[self.bound[alive].argmin()])
            alive[k] = False
            if self.total(k, alive) > goal.budget * SAME:
                continue
            rounds += 1
            value, move, group = self.largest(k, best_value)
            self.sample = np.union1d(self.sample, [move])
            if value < best_value:
                best, best_value, judged[k] = k, value, value
            if value > self.bound[k] * (1.0 + 1e-9):
                self.cut(move, {group}, alive)
        return None if best < 0 else self._found(best, judged, proven)

    def mean_of(self, goal: Goal) -> Found | None:
        """The candidate whose moves leave least on average within the budget."""
        alive = np.flatnonzero(self.estimated <= goal.budget * (SAME if self.exact else 1.0 + SURE))
        if not len(alive):
            return None
        need = needs(self.moves)
        index, weight = representatives(self.moves, need)
        estimated = self.judge.take(index).worst(self.rows[alive]) @ weight
        order = np.argsort(estimated, kind="stable")
        judged: dict[int, float] = {}
        exact = len(index) == len(self.moves)
        for k in alive[order].tolist():
            if self.total(k) > goal.budget * SAME:
                continue
            judged[k] = float(self.residuals(k).max(axis=-1) @ need / need.sum())
            if exact or len(judged) >= MEANS:
                break
        if not judged:
            return None
        return self._found(min(judged, key=judged.__getitem__), judged, exact)

    def _first_cuts(self, alive: NDArray[np.bool_], start: int) -> None:
        """The worst moves of the settings that are today's, and of some others."""
        index = np.flatnonzero(alive)
        tried = [start] if start >= 0 else []
        tried += index[np.linspace(0, len(index) - 1, FIRST_CUTS).astype(int)].tolist()
        left = self.judge.take(self.sample).residuals(self.rows[list(dict.fromkeys(tried))])
        worst: dict[int, set[int]] = {}
        for each in left:
            at, group = np.unravel_index(int(each.argmax()), each.shape)
            worst.setdefault(int(self.sample[at]), set()).add(int(group))
        for move, groups in worst.items():
            self.cut(move, groups, alive)

    def _found(self, best: int, judged: dict[int, float], proven: bool) -> Found:
        """The best, or one as good as it that is faster."""
        good = judged[best] * (1.0 + EQUAL)
        best = min((k for k in judged if judged[k] <= good), key=lambda k: (self.total(k), k))
        others = sorted((k for k in judged if k != best), key=judged.__getitem__)
        return Found(
            self.rows[best], judged[best], self.total(best),
            tuple(self.rows[k] for k in others[:BETTER_ONES]), proven, len(judged),
        )  # fmt: skip


def representatives(moves: Moves, weight: Array | None = None) -> tuple[NDArray[np.intp], Array]:
    """Some of the moves, and for how many each stands; all of them where they are few.

    Moves of the same axes stand together, in the order of their lengths: the time and the residual
    change little from one to the next.
    """
    count = moves.count if weight is None else weight
    if len(moves) <= SAMPLE:
        return np.arange(len(moves)), count if weight is None else count / count.sum()
    size = np.sqrt((moves.displacement**2).sum(axis=1))
    kind = (moves.displacement != 0.0) @ (2 ** np.arange(moves.displacement.shape[1]))
    order = np.lexsort([size, kind])
    share = np.cumsum(count[order]) / count.sum()
    which = np.minimum((share * SAMPLE - 1e-9).astype(int), SAMPLE - 1)
    index, weights = [], []
    for part in range(SAMPLE):
        inside = order[which == part]
        if len(inside) and count[inside].any():
            index.append(inside[len(inside) // 2])
            weights.append(count[inside].sum())
    rising = np.argsort(index)
    out = np.array(weights)[rising]
    return np.array(index)[rising], out if weight is None else out / out.sum()


class Search:
    """The best numbers of one group of settings, all others as they are, in one time or several.

    Parameters
    ----------
    judge : Judge
        The moves that the group concerns.
    start : ndarray, shape (s,)
        Numbers of all settings.
    group : tuple of int
        Those that are chosen.
    ranges : ndarray, shape (s, 2)
        Between which numbers.
    kind : str
        One of `GOALS`.
    allowed : callable
        Settings (k, s) -> which of them the machine allows.
    """

    def __init__(
        self,
        judge: Judge,
        start: Array,
        group: tuple[int, ...],
        ranges: Array,
        kind: str,
        allowed: Callable[[Array], NDArray[np.bool_]],
    ) -> None:
        self.judge, self.start, self.group, self.kind = judge, start, group, kind
        self.allowed = allowed
        self.settings = [judge.scheme.settings[s] for s in group]
        most = MOST if kind == WORST else MOST_MEAN
        whole = [max(len(s.names), 1) for s in self.settings]
        free = max(sum(1 for s in self.settings if not s.names), 1)
        self.each = min(max(int((most / np.prod(whole)) ** (1.0 / free)), 3), MOST_OF_ONE)
        self.choices = [
            np.arange(len(s.names), dtype=float)
            if s.names
            else s.choices(float(ranges[k, 0]), float(ranges[k, 1]), self.each)
            for s, k in zip(self.settings, group, strict=True)
        ]
        self.first = self._candidates(_mesh(start, group, self.choices), start)

    def within(self, budget: float) -> Found | None:
        """The best whose moves take no longer [s]; None: nothing that is allowed is fast enough."""
        goal = Goal(self.kind, budget)
        choices, found = self.choices, _best(self.first, goal, self.start)
        for _ in range(FINER):
            if found is None or all(
                _complete(s, c, found.written[k])
                for s, c, k in zip(self.settings, choices, self.group, strict=True)
            ):
                break
            parts, merged = [found.written[np.newaxis]], choices
            for near in (found.written, *found.runners_up):
                own = [
                    _between(s, c, near[k], max(self.each // 4, 5))
                    for s, c, k in zip(self.settings, choices, self.group, strict=True)
                ]
                parts.append(_mesh(self.start, self.group, own))
                merged = [np.union1d(m, o) for m, o in zip(merged, own, strict=True)]
            choices = merged
            rows = np.unique(np.concatenate(parts), axis=0)
            closer = self._candidates(rows, found.written)
            found = _better(found, _best(closer, goal, found.written))
        return found

    def _candidates(self, rows: Array, start: Array) -> Candidates | None:
        """Those settings that the machine allows; None: it allows none."""
        rows = rows[self.allowed(rows)]
        return Candidates(self.judge, rows, start) if len(rows) else None


def _better(found: Found, again: Found | None) -> Found:
    """The better of two searches, the second of which has looked closer."""
    if again is None or again.value > found.value:
        return found
    return replace(again, proven=again.proven and found.proven, judged=again.judged + found.judged)


def _best(candidates: Candidates | None, goal: Goal, start: Array) -> Found | None:
    """The best of candidates."""
    if candidates is None:
        return None
    if goal.kind == MEAN:
        return candidates.mean_of(goal)
    same = np.flatnonzero((candidates.rows == start).all(axis=1))
    return candidates.worst_of(goal, int(same[0]) if len(same) else -1)


def _mesh(start: Array, group: tuple[int, ...], choices: list[Array]) -> Array:
    """Every combination of the choices, the other settings as they are, shape (k, s)."""
    mesh = np.stack([m.ravel() for m in np.meshgrid(*choices, indexing="ij")], axis=1)
    rows = np.tile(start, (len(mesh), 1))
    rows[:, list(group)] = mesh
    return rows


def _between(setting: Setting, choices: Array, here: float, most: int) -> Array:
    """Numbers between the neighbours of one among choices, every step if they are few."""
    if setting.names or len(choices) < 2:
        return np.array([here])
    low, high = _neighbours(choices, here)
    return np.union1d(setting.choices(low, high, most), [here])


def _complete(setting: Setting, choices: Array, here: float) -> bool:
    """Whether no number of the control lies between one and its neighbours among choices."""
    if setting.names or len(choices) < 2:
        return True
    low, high = _neighbours(choices, here)
    return high - here <= setting.step * 1.000001 and here - low <= setting.step * 1.000001


def _neighbours(choices: Array, here: float) -> tuple[float, float]:
    """The choices on both sides of one of them."""
    at = int(np.abs(choices - here).argmin())
    return float(choices[max(at - 1, 0)]), float(choices[min(at + 1, len(choices) - 1)])
