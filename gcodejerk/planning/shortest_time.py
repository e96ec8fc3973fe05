"""The shortest time: how soon each move can arrive with nothing left but what is tolerated.

This module owns the search for the least number of intervals in which the limits and the tolerance
can both be kept. Whether they can be in a given time, `symmetric` answers quickly for some moves
and a programme for each of the others (`optima`), so the search asks as seldom as it can:

* what a profile needs of the jerk's limit says how much time is too much. Ramps of acceleration
  take the time A/J; with the share p of the limit, 1/p times that. So about A/J (1/p - 1) can be
  saved until the full jerk is needed;
* moves that differ in their length alone know of each other. A profile that keeps the limits and
  the tolerance does so for every shorter move, too, and what cannot be done for one cannot be done
  for a longer one. They are asked by turns: the longest, then one in the middle, and so on;
* what the first moves take above what the limits allow says where to begin with the others.

Rule 1: a profile is known for the time that is returned, and for the interval before it none was
found. So there is none in less: a move can rest for an interval, and do the same in n + 1 as in n.
Rule 2: no move's profile depends on the others, which only share what is known of times; but where
the programme finds none in a time that a longer move's profile shows to do, that one is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion import Profiles, conventional_profiles, whole_intervals
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.designs import answered, question_of, symmetric
from gcodejerk.planning.optima import answers
from gcodejerk.planning.task import Task, worst_in_band

ALLOWED = 0.97
"""Share of the tolerance that a profile may use; rounding to the resolution needs some, too."""
FIRST = 16
"""So many moves are asked first, of those that are like no other."""
STEP = 32
"""They begin at such a part of all times that come into question."""
NEAR, FAR, MUCH = 0.75, 0.6, 10.0
"""Of the time that the jerk says can be saved: a little too much time is known to do, and says
more. So much where the jerk could be so many times as high, and less where it could be more."""
CLOSER = 4
"""Where it says that all can be saved, though not all can: such a part of what is in question."""
BISECTED = 8
"""Times that a move is asked about before halves are taken, which always come to an end."""
PARTS = 5
"""Of what is to be done for a move, as a bar shows it: it is asked about four times, and has its
own profile then."""


def shortest(task: Task) -> tuple[Profiles, Array, NDArray[np.int64]]:
    """The least time in which no mode is left with more than the tolerance, over the band.

    Parameters
    ----------
    task : Task
        The moves; their own time does not count.

    Returns
    -------
    profiles, worst : Profiles and ndarray, shape (n,)
        As of a `Design`.
    counts : ndarray of int, shape (n,)
        T_SUM of each. [intervals]
    """
    fastest = conventional_profiles(*task.limits, task.interval).total
    # What the controller's own move and two periods of every mode take is always enough.
    slack = 2.0 * float((2.0 * np.pi / task.objective.poles.imag).sum())
    longest = whole_intervals(np.maximum(fastest, task.conventional.total) + slack, task.interval)
    least = task.after(whole_intervals(fastest, task.interval))
    search = _Search(replace(least, tolerance=ALLOWED * task.tolerance), longest)
    for turn in range(int(search.turn.max(initial=-1)) + 1):
        while len(rows := np.flatnonzero(search.open & (search.turn <= turn))):
            search.ask(rows)
    return search.result()


class _Search:
    """What is known of each move's least time, shape (n,) each.

    Attributes
    ----------
    low, high : ndarray of int
        The most that is known not to do, and the least that is known to do; above the longest where
        none is. [intervals]
    hard : ndarray of int
        The most that is known not to do for symmetric profiles. [intervals]
    source : ndarray of int
        The move whose profile does, maybe a longer one.
    worst : ndarray
        What its own profile leaves of each. [mm]
    plain : ndarray of bool
        Its own profile is symmetric: it may not be the smoothest.
    turn : ndarray of int
        When a move is asked about.
    """

    def __init__(self, task: Task, longest: NDArray[np.int64]) -> None:
        self.task, self.longest = task, longest
        self.reference = task.objective.of(task.conventional)
        self.vibrates = np.any(task.objective.weights > 0.0, axis=1)
        self.start = task.counts - 1
        self.low, self.high = self.start.copy(), longest + 1
        self.profiles, self.worst = task.conventional, np.full(len(task), np.inf)
        self.source, self.plain = np.arange(len(task)), np.zeros(len(task), dtype=bool)
        self.asked, self.hard = np.zeros((2, len(task)), dtype=np.int64)
        _, A, J = task.limits
        # From one limit of the acceleration to the other within an interval.
        self.jerk = np.fmin(J, 2.0 * A / task.interval)
        self.ramp = A / (self.jerk * task.interval)
        kind, length = task.proportional()
        # Where nothing vibrates, nothing dear is asked: each of them is found by itself.
        kind = np.where(self.vibrates, kind, len(task) + np.arange(len(task)))
        order = np.lexsort((-length, kind))
        alike = np.split(order, np.flatnonzero(np.diff(kind[order])) + 1)
        self.families = [rows for rows in alike if len(rows) > 1]
        alone = np.array([rows[0] for rows in alike if len(rows) == 1], dtype=np.intp)
        self.turn = np.zeros(len(task), dtype=np.int64)
        self.turn[alone] = np.arange(len(alone)) % max(len(alone) // FIRST, 1) > 0
        for rows in self.families:
            self.turn[rows] = _turns(len(rows))

    @property
    def open(self) -> NDArray[np.bool_]:
        """Moves whose least time is not known yet."""
        unknown: NDArray[np.bool_] = (self.high - self.low > 1) & (self.low < self.longest)
        return unknown

    def ask(self, rows: NDArray[np.intp]) -> None:
        """Learn whether these moves can do in another time each."""
        counts = self._next()[rows]
        task = self.task.take(rows).after(counts)
        profiles, worst = task.conventional, np.full(len(rows), np.inf)
        easy = np.nonzero(counts > self.hard[rows])[0]
        found, left = symmetric(task.take(easy))
        does = left <= task.tolerance
        self.hard[rows[easy[~does]]] = counts[easy[~does]]
        profiles = profiles.replaced(easy[does], found.take(does))
        worst[easy[does]] = left[does]
        plain = np.isfinite(worst)
        # Where nothing vibrates, there is nothing to ask.
        others = np.nonzero(~plain & self.vibrates[rows])[0]
        profiles, worst = self._smoothest(task, rows, others, profiles, worst)
        can = np.isfinite(worst)
        self.asked[rows] += 1
        self.low[rows[~can]] = counts[~can]
        self.high[rows[can]], self.source[rows[can]] = counts[can], rows[can]
        self.plain[rows[can]], self.worst[rows[can]] = plain[can], worst[can]
        self.profiles = self.profiles.replaced(rows[can], profiles.take(can))
        self._share()

    def result(self) -> tuple[Profiles, Array, NDArray[np.int64]]:
        """Profiles, what they leave, and their time; infinite where there is none.

        Within the tolerance all are equal: the smoothest is taken.
        """
        others = self.source != np.arange(len(self.task))
        profiles, worst = self.profiles.take(self.source), self.worst
        worst[others] = worst_in_band(self.task.take(others), profiles.take(others))
        possible, every = np.isfinite(worst), np.arange(len(self.task))
        counts = np.where(possible, self.high, self.longest)
        rows = np.nonzero(possible & self.vibrates & (others | self.plain))[0]
        profiles, worst = self._smoothest(self.task.after(counts), every, rows, profiles, worst)
        return profiles, worst, counts

    def _smoothest(
        self, task: Task, rows: NDArray[np.intp], asked: NDArray[np.intp], profiles: Profiles,
        worst: Array,
    ) -> tuple[Profiles, Array]:  # fmt: skip
        """Profiles and residuals with those of least jerk of some of these moves."""
        questions = [
            question_of(task, k, float(self.reference[rows[k]]), task.tolerance) for k in asked
        ]
        parts = np.where(self.open, np.minimum(self.asked, PARTS - 1), PARTS - 1)
        before, most = parts.sum(), PARTS * len(self.task)
        more = np.count_nonzero(~self.open[rows[asked]] | (parts[rows[asked]] < PARTS - 1))

        def tell(done: int, total: int) -> None:
            if task.progress is not None:
                task.progress(int(before + done * more // total), most)

        return answered(task, asked, answers(questions, tell), profiles, worst)

    def _share(self) -> None:
        """What is known of moves follows for others that differ in their length alone."""
        for family in self.families:
            high = self.high[family]
            least = np.minimum.accumulate(high)
            better = least < high
            # Of those that are longer, the last one that has the least time.
            best = np.maximum.accumulate(np.where(better, 0, np.arange(len(family))))
            self.source[family[better]] = self.source[family[best[better]]]
            self.high[family] = least
            self.low[family] = np.maximum.accumulate(self.low[family][::-1])[::-1]

    def _next(self) -> NDArray[np.int64]:
        """The time to ask about next."""
        low, high, start = self.low, self.high, self.start
        up = np.where(low > start, 2 * low - start, start + self._first())
        with np.errstate(divide="ignore", invalid="ignore"):
            more = self.jerk / self.profiles.greatest_jerk[self.source] - 1.0
        saved = np.where(more > MUCH, FAR, NEAR) * self.ramp * more
        down = high - np.ceil(np.clip(saved, 1.0, high - low)).astype(np.int64)
        down = np.where(down > low, down, low + np.maximum((high - low) // CLOSER, 1))
        halves = self.plain[self.source] | (self.asked >= BISECTED)
        down = np.where(halves, (low + high) // 2, down)
        tried: NDArray[np.int64] = np.where(high > self.longest, np.minimum(up, self.longest), down)
        return tried

    def _first(self) -> NDArray[np.int64]:
        """What is added to the time that the limits allow, at first."""
        first = np.maximum((self.longest - self.start) // STEP, 1)
        known = self.vibrates & ~self.open & (self.high <= self.longest)
        if known.any():
            first[:] = np.median((self.high - self.start)[known])
        return np.where(self.vibrates, np.maximum(first, 1), 1)


def _turns(count: int) -> NDArray[np.int64]:
    """When each of so many moves is asked: the first, one in the middle, those between."""
    index = np.arange(count)
    # How often an index can be halved says how late it is: 4, then 2 and 6, then 1, 3, 5 and 7.
    halvings = np.log2(np.maximum(index & -index, 1)).astype(np.int64)
    return np.where(index > 0, halvings.max(initial=0) + 1 - halvings, 0)
