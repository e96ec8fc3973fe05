"""Optimal profiles of many moves: each distinct problem once, on all cores, remembered on disk.

This module owns what makes optima affordable. A problem does not depend on the length of its move,
only on the number of intervals, on the limits relative to the length, on the poles and on the
weights relative to each other; so moves that differ in nothing else share a solution, and so do
programs.

Rule: a solution is used only after it has been checked (arrival, limits, no way back), whether it
comes from the solver or from the disk.
"""

from __future__ import annotations

import hashlib
import itertools
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gcodejerk._version import __version__
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.search.optimal import least_residual, near_least, smoothest_within
from gcodejerk.motion.search.socp import require_solver
from gcodejerk.motion.search.together import least_together
from gcodejerk.motion.search.unit_move import Move, Optimum, optimum_profiles
from gcodejerk.planning.solution_cache import cache_file, read_solutions, write_solutions

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

HELD = 1e-6
"""Relative tolerance on limits of a solution that is used."""
ARRIVED = 1e-9
"""Error of the end, for the unit length."""
FEW = 16
"""Fewer problems than this are solved in this process."""
GENERATION = 12
"""Counted on whenever the solver answers otherwise: answers of before are not taken."""
NONE = b"none"
"""In the cache: the problem has no solution."""
BATCH = 16
"""Solutions are written to the disk so many at a time: a run that is cut keeps what it has."""


@dataclass(frozen=True, slots=True, eq=False)
class Question:
    """What is asked about a move.

    Attributes
    ----------
    move : Move
        The move.
    reference : float
        Residual of the controller's own profile: the measure for what is small. [mm]
    allowed : float
        Above 0: the smoothest profile that leaves no more than this. [mm]
    slack : float
        Else, above 0: the smoothest of those that leave no more than this above the least; 0: the
        one that leaves least. [mm]
    settled : float
        But of those that leave no more than this, if there are any. [mm]
    beside : tuple of Move
        Moves that begin with it: what all leave together is asked about.
    until : int
        Above 0: what rings then, at the last arrival, is what counts, and weights are signed. What
        is `allowed` is then as good as none, and no smoothest profile is sought for it.
        [intervals]
    """

    move: Move
    reference: float
    allowed: float = 0.0
    slack: float = 0.0
    settled: float = 0.0
    beside: tuple[Move, ...] = ()
    until: int = 0

    @property
    def moves(self) -> tuple[Move, ...]:
        """All that move."""
        return (self.move, *self.beside)

    @property
    def scale(self) -> float:
        """The largest weight [mm], by which solutions are scaled."""
        largest = max(float(np.abs(move.weights).max(initial=0.0)) for move in self.moves)
        return largest or 1.0

    def key(self) -> bytes:
        """A digest that equal problems share."""
        scale = self.scale
        measures = (self.reference, self.allowed, self.slack, self.settled)
        numbers = [np.array([*(measure / scale for measure in measures), self.until])]
        for move in self.moves:
            T = move.count * move.interval
            limits = (move.velocity * T, move.acceleration * T**2, move.jerk * T**3)
            numbers += [
                np.array([move.count, *limits, move.band, move.interval, move.guard]),
                move.poles.real * T, move.poles.imag * T, move.weights / scale, move.group,
                *_columns(move.today, T),
            ]  # fmt: skip
        # Rounded: the same move computed in another order is the same problem.
        digits = (f"{x:.10g}" for x in np.concatenate(numbers))
        text = ",".join([__version__, str(GENERATION), *digits])
        return hashlib.blake2b(text.encode(), digest_size=16).digest()


def _columns(today: Profiles | None, T: float) -> list[Array]:
    """What tells one controller's profile from another, time in units of the move's."""
    if today is None:
        return []
    return [today.duration / T, today.acceleration * T**2, today.jerk * T**3]


Progress = Callable[[int, int], None]
"""Called with the number of problems that are solved, and of all."""


Answer = list[Optimum] | None
"""An optimum for each move of a question; None where no profiles keep the limits."""


def answers(questions: list[Question], progress: Progress | None = None) -> list[Optimum | None]:
    """The same as `joint_answers`, of questions about one move each."""
    every = joint_answers(questions, progress)
    return [None if found is None else found[0] for found in every]


def joint_answers(questions: list[Question], progress: Progress | None = None) -> list[Answer]:
    """Solve problems, each distinct one once.

    Parameters
    ----------
    questions : list of Question
        n of them.
    progress : callable, optional
        See `Progress`.

    Returns
    -------
    list of Answer
        n answers.

    Raises
    ------
    PlanError
        scipy, clarabel or daqp is not installed.
    """
    require_solver()
    keys = [question.key() for question in questions]
    distinct = dict(zip(keys, questions, strict=True))
    file = cache_file()
    found: dict[bytes, Answer] = {}
    kept = read_solutions(list(distinct), file)
    # That there is no solution is worth knowing, too; were it wrong, a move would lose, not break.
    found.update((key, None) for key, value in kept.items() if value == NONE)
    known = {key: _decoded(value) for key, value in kept.items() if value != NONE}
    good = _answering(list(known.values()), [distinct[key] for key in known])
    found.update((key, known[key]) for key, holds in zip(known, good, strict=True) if holds)
    missing = [key for key in distinct if key not in found]
    done = len(found)
    with _workers(len(missing)) as solve_all:
        solved = zip(missing, solve_all([distinct[key] for key in missing]), strict=True)
        while part := dict(itertools.islice(solved, BATCH)):
            write_solutions({key: _encoded(x) for key, x in part.items()}, file)
            found.update(part)
            done += len(part)
            if progress is not None:
                progress(done, len(distinct))
    out: list[Answer] = []
    for key, question in zip(keys, questions, strict=True):
        own, scale = found[key], question.scale
        whole = own and [replace(optimum, worst=optimum.worst * scale) for optimum in own]
        out.append(whole)
    return out


@contextmanager
def _workers(problems: int) -> Iterator[Callable[[list[Question]], Iterator[Answer]]]:
    """What solves problems one by one: all cores where that pays, this process otherwise.

    The solver keeps Python's lock, so threads would not help. Processes are forked: other ways of
    starting them would run the user's own script again. Where this process is itself one of several
    workers, the other cores have work of their own.
    """
    cores = 1 if multiprocessing.parent_process() else os.cpu_count() or 1
    if problems < FEW or cores == 1 or "fork" not in multiprocessing.get_all_start_methods():
        yield lambda questions: map(_answer, questions)
        return
    context = multiprocessing.get_context("fork")
    pool = ProcessPoolExecutor(min(cores, problems), mp_context=context, initializer=_follow_master)
    try:
        yield lambda questions: pool.map(_answer, questions)
    finally:
        # Who stops waits for no more than what is being solved.
        pool.shutdown(cancel_futures=True)


def _follow_master() -> None:
    """In a worker: Ctrl-C is the master's business, and with the master it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)

    def follow() -> None:
        master = multiprocessing.parent_process()
        if master is not None:
            master.join()
            os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


@cache
def _linear_algebra() -> ThreadpoolController:
    """What limits the threads of numpy's linear algebra; finding the libraries takes a while."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _answer(question: Question) -> Answer:
    """Solve one problem, for a largest weight of 1."""
    # The matrices are small: several threads, and one set for each process, only wait for each
    # other.
    with _linear_algebra().limit(limits=1):
        return _solved(question)


def _solved(question: Question) -> Answer:
    """The same with as many threads as there are."""
    scale = question.scale
    moves = [replace(move, weights=move.weights / scale) for move in question.moves]
    reference, allowed, slack, settled = (
        size / scale
        for size in (question.reference, question.allowed, question.slack, question.settled)
    )
    found: Answer = None
    if question.until:
        found = least_together(moves, question.until, reference, allowed, slack, settled)
    else:
        if allowed:
            one = smoothest_within(moves[0], allowed)
        elif slack:
            one = near_least(moves[0], slack, settled, reference)
        else:
            one = least_residual(moves[0], reference)
        found = None if one is None else [one]
    return found if found is not None and _answering([found], [question])[0] else None


def _answering(solved: list[list[Optimum]], questions: list[Question]) -> list[bool]:
    """Whether solutions are profiles of all moves of their questions, and of no more."""
    whole = [len(x) == len(q.moves) for x, q in zip(solved, questions, strict=True)]
    chosen = list(itertools.compress(zip(solved, questions, strict=True), whole))
    optima = [optimum for found, _ in chosen for optimum in found]
    moves = [move for _, question in chosen for move in question.moves]
    each = iter(_holding(optima, moves).tolist())
    return [
        as_many and all(list(itertools.islice(each, len(question.moves))))
        for as_many, question in zip(whole, questions, strict=True)
    ]


def _holding(optima: list[Optimum], moves: list[Move]) -> NDArray[np.bool_]:
    """Whether optima are profiles of these moves: their grid, their end, limits, no way back."""
    sound = np.array([_sound(o, move) for o, move in zip(optima, moves, strict=True)], dtype=bool)
    rows = np.nonzero(sound)[0]
    if not len(rows):
        return sound
    interval = moves[0].interval
    profiles = optimum_profiles([optima[k] for k in rows], interval)
    V = np.array([moves[k].velocity for k in rows])
    A = np.array([moves[k].acceleration for k in rows])
    # From one limit of the acceleration to the other within an interval.
    J = np.minimum([moves[k].jerk for k in rows], 2.0 * A / interval)
    last = profiles.first[1:] - 1
    d, j = profiles.duration[last], profiles.jerk[last]
    a, v, s = profiles.acceleration[last], profiles.velocity[last], profiles.position[last]
    peak, steepest = profiles.peak_velocity, profiles.peak_acceleration
    sound[rows] = (
        (np.abs(s + (v + (0.5 * a + j * d / 6.0) * d) * d - 1.0) <= ARRIVED)
        & (np.abs(v + (a + 0.5 * j * d) * d) <= ARRIVED * peak)
        & (np.abs(a + j * d) <= ARRIVED * steepest)
        & (peak <= V * (1.0 + HELD))
        & (profiles.least_velocity >= -HELD * peak)
        & (steepest <= A * (1.0 + HELD))
        & (profiles.greatest_jerk <= J * (1.0 + HELD))
    )
    return sound


def _sound(optimum: Optimum, move: Move) -> bool:
    """Whether a solution has the form of one: blocks that fill the move, and finite numbers."""
    knots, jerk = optimum.knots, optimum.jerk
    return bool(
        len(knots) == len(jerk) + 1 >= 2
        and knots[0] == 0
        and knots[-1] == move.count
        and np.all(np.diff(knots) > 0)
        and np.isfinite(jerk).all()
        and np.isfinite(optimum.worst)
    )


def _encoded(answer: Answer) -> bytes:
    """A solution as bytes: of each move how many blocks, what is left, knots and jerks."""
    if answer is None:
        return NONE
    numbers: Array = np.concatenate(
        [[len(x.jerk), x.worst, *x.knots, *x.jerk] for x in answer], dtype=np.float64
    )
    return numbers.astype("<f8").tobytes()


def _decoded(value: bytes) -> list[Optimum]:
    """A solution from bytes; where they are something else it does not hold."""
    numbers: NDArray[np.float64] = np.frombuffer(value[: len(value) // 8 * 8], "<f8")
    optima: list[Optimum] = []
    while len(numbers) and 1.0 <= numbers[0] <= 0.5 * (len(numbers) - 3):
        middle = int(numbers[0]) + 3
        own, numbers = numbers[: 2 * middle - 3], numbers[2 * middle - 3 :]
        with np.errstate(invalid="ignore"):
            knots = own[2:middle].astype(np.int64)
        optima.append(Optimum(knots, own[middle:], float(own[1])))
    return [] if len(numbers) else optima
