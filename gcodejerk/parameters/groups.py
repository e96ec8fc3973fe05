"""Settings in groups: those of one axis together, and what the axes give each other of their time.

This module owns the search over a control's groups of settings. Those of an axis are searched
together and all others stand; the axes share the time of all rapids. Each axis first keeps to the
time of its own rapids; then time is moved to the axis that leaves most, as far as the others leave
no more than it.

Rule: within a group the best is proven (`search`). How the time is shared is searched in steps, and
nothing is proven of it.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.parameters.judge import FILTER, Judge, Rows
from gcodejerk.parameters.moves import Moves
from gcodejerk.parameters.search import SAME, Found, Search, goal_value, representatives
from gcodejerk.parameters.settings import ALL, PATH, Scheme

CYCLES, GAINED = 3, 0.01
"""How often the groups of settings are gone through at most, and the gain that counts. [-]"""
TIMES = np.geomspace(0.7, 1.9, 13)
"""Times of an axis's rapids, of today's, at which its best settings are looked for. [-]"""
FULL_SPEED = 5.0
"""A lone axis reaches its full speed in a rapid as long as it goes in this time at most [s]."""
HELD = 1.0 + 1e-9


def concerned(scheme: Scheme, moves: Moves, group: tuple[int, ...]) -> NDArray[np.intp]:
    """The moves that settings act on, by the positions of the settings."""
    axes = [scheme.settings[k].axis for k in group]
    if PATH in axes or ALL in axes:
        return np.arange(len(moves))
    columns = [AXES.index(axis) for axis in axes]
    return np.flatnonzero((moves.displacement[:, columns] != 0.0).any(axis=1))


class Groups:
    """The search over all groups of settings.

    Parameters
    ----------
    judge : Judge
        All moves.
    machine : Machine
        Its limits.
    start : ndarray, shape (s,)
        Today's numbers.
    ranges : ndarray, shape (s, 2)
        Between which numbers each setting is looked for.
    times : ndarray, shape (n,)
        What each move takes today. [s]
    goal : str
        One of `search.GOALS`.
    """

    def __init__(
        self, judge: Judge, machine: Machine, start: Array, ranges: Array, times: Array, goal: str
    ) -> None:
        self.judge, self.machine, self.start = judge, machine, start
        self.ranges, self.times, self.goal = ranges, times, goal
        self.judged = 0
        scheme, moves = judge.scheme, judge.moves
        self.groups = [g for g in scheme.groups if len(concerned(scheme, moves, g))]
        used = [k for g in self.groups for k in g]
        self.apart = len(self.groups) > 1 and len(set(used)) == len(used)

    def best(self, share: float) -> tuple[Array, bool] | None:
        """The best numbers within a share of today's time, and whether that is proven.

        Groups that share the time of all rapids may hinder each other: one that comes first and
        takes it all leaves none for the others. So there is more than one way to begin; None where
        no way is fast enough.
        """
        budget = share * float(self.times @ self.judge.moves.count)
        ways = [self._in_turn(start, share) for start in self._starts()]
        if self.apart:
            ways.append(self._balanced(budget))
        usable = []
        for way in ways:
            if way is not None:
                row = way[0][np.newaxis]
                total = float(self.judge.times(row)[0] @ self.judge.moves.count)
                value = float(goal_value(self.judge.worst(row), self.judge.moves, self.goal)[0])
                if total <= budget * SAME:
                    usable.append((value, total, way))
        if not usable:
            return None
        least = min(value for value, _, _ in usable) * (1.0 + GAINED)
        return min((one for one in usable if one[0] <= least), key=lambda one: one[1])[2]

    def _starts(self) -> list[Array]:
        """Today's numbers; and where several axes have filters, the first kind for all of them."""
        kinds = [
            k
            for k, s in enumerate(self.judge.scheme.settings)
            if s.relation.quantity == FILTER and s.axis != ALL
        ]
        if len(kinds) < 2:
            return [self.start]
        filtered = self.start.copy()
        filtered[kinds] = 1.0
        return [self.start, filtered]

    def _in_turn(self, start: Array, share: float) -> tuple[Array, bool] | None:
        """Group after group, each in the time of its own rapids, until none gains."""
        written = start
        values: dict[int, float] = {}
        proven = {}
        for _ in range(CYCLES if len(self.groups) > 1 else 1):
            gained = False
            for k, group in enumerate(self.groups):
                index = concerned(self.judge.scheme, self.judge.moves, group)
                budget = share * float(self.times[index] @ self.judge.moves.count[index])
                found = self._search(self.judge.take(index), written, group, budget)
                if found is None:
                    return None
                proven[k] = found.proven
                if found.value < values.get(k, np.inf) * (1.0 - GAINED):
                    values[k], written, gained = found.value, found.written, True
            if not gained:
                break
        return written, len(self.groups) == 1 and all(proven.values())

    @cached_property
    def _fronts(self) -> list[list[Found]]:
        """For each group what it can leave in more or less time, on some of its moves."""
        fronts = []
        for group in self.groups:
            index = concerned(self.judge.scheme, self.judge.moves, group)
            some = index[representatives(self.judge.moves.take(index))[0]]
            part = self.judge.take(some)
            today = float(self.times[some] @ part.moves.count)
            search = self._searched(part, self.start, group)
            found = [self._within(search, t * today) for t in TIMES.tolist()]
            fronts.append([one for one in found if one is not None])
        return fronts

    def _balanced(self, budget: float) -> tuple[Array, bool] | None:
        """Time moved between the axes until all leave alike, then to the one that leaves most."""
        if not all(self._fronts):
            return None
        values = sorted({one.value for front in self._fronts for one in front})
        combined = None
        low, high = 0, len(values)
        while low < high:
            middle = (low + high) // 2
            row = self._combined(values[middle])
            if row is not None and self._total(row) <= budget * SAME:
                combined, high = row, middle
            else:
                low = middle + 1
        if combined is None:
            return None
        written = combined
        for _ in range(CYCLES * len(self.groups)):
            k = self._worst(written)
            index = concerned(self.judge.scheme, self.judge.moves, self.groups[k])
            part = self.judge.take(index)
            others = self._total(written) - self._total(written, part)
            found = self._search(part, written, self.groups[k], budget - others)
            own = goal_value(part.worst(written[np.newaxis]), part.moves, self.goal)[0]
            # Time that buys nothing is not taken.
            if found is None or found.value > own * (1.0 - GAINED):
                break
            written = found.written
        return written, False

    def _combined(self, value: float) -> Array | None:
        """For each group the fastest settings that leave no more than a value."""
        row = self.start.copy()
        for group, front in zip(self.groups, self._fronts, strict=True):
            good = [one for one in front if one.value <= value]
            if not good:
                return None
            fastest = min(good, key=lambda one: one.total)
            row[list(group)] = fastest.written[list(group)]
        return row

    def _worst(self, written: Array) -> int:
        """The group whose moves leave most."""
        worst = self.judge.worst(written[np.newaxis])[0]
        scheme, moves = self.judge.scheme, self.judge.moves
        left = [worst[concerned(scheme, moves, group)].max() for group in self.groups]
        return int(np.argmax(left))

    def _total(self, written: Array, judge: Judge | None = None) -> float:
        """Time of all moves, or of some [s]."""
        one = judge or self.judge
        return float(one.times(written[np.newaxis])[0] @ one.moves.count)

    def _search(
        self, judge: Judge, start: Array, group: tuple[int, ...], budget: float
    ) -> Found | None:
        """The best of one group in a time."""
        return self._within(self._searched(judge, start, group), budget)

    def _searched(self, judge: Judge, start: Array, group: tuple[int, ...]) -> Search:
        """All that one group can be set to, in any time."""
        return Search(judge, start, group, self.ranges, self.goal, self._allowed)

    def _within(self, search: Search, budget: float) -> Found | None:
        """The best of a search in a time."""
        found = search.within(budget)
        self.judged += 0 if found is None else found.judged
        return found

    def _allowed(self, written: Array) -> NDArray[np.bool_]:
        """Settings that keep the machine's limits, or pass them no more than today's numbers do."""
        acceleration, jerk = self._peaks(written)
        most = self._most
        within = (acceleration <= most[0] * HELD) & (jerk <= most[1] * HELD)
        return np.asarray(within.all(axis=1))

    @cached_property
    def _most(self) -> list[Array]:
        """Largest acceleration and jerk of each axis: its limit's, or today's if that is more."""
        now = self._peaks(self.start[np.newaxis])
        return [
            np.maximum([getattr(axis.limit, name) for axis in self.machine.axes], today[0])
            for name, today in zip(("acceleration", "jerk"), now, strict=True)
        ]

    @cached_property
    def _alone(self) -> tuple[Judge, Array]:
        """Each axis alone at full speed, and how far it goes [mm or degrees]."""
        share = np.zeros((len(self.machine.axes), len(AXES)))
        for row, axis in enumerate(self.machine.axes):
            share[row, AXES.index(axis.name)] = FULL_SPEED * axis.rapid.velocity
        one_each = np.ones(len(share))
        moves = Moves(share, one_each, one_each, np.full(len(share), np.inf))
        return Judge(self.judge.scheme, Rows.of(moves, self.machine)), share.sum(axis=1)

    def _peaks(self, written: Array) -> tuple[Array, Array]:
        """Peak acceleration and jerk of each axis at full speed, shape (k, axes); steps aside."""
        judge, length = self._alone
        acceleration, jerk = judge.peaks(written)
        return acceleration * length, jerk * length
