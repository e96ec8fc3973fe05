"""Worker processes: each has one job at a time, and one that dies costs no more than that job.

Rule 1: answers come in the order of the jobs, whoever is done first.
Rule 2: where its pipe ends, a worker does so behind the job that it has in hand, whose output then
is complete. On SIGTERM it puts away what it had begun.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Generator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Any

from gcodejerk.batch.processes import Child, answer_signals, end_all
from gcodejerk.spread import In, Out


def map_jobs(
    function: Callable[[In], Out],
    jobs: Sequence[In],
    workers: int,
    lost: Callable[[In, int | None], Out],
) -> Generator[Out, None, None]:
    """Apply a function to jobs in processes of their own.

    Parameters
    ----------
    function : callable
        Can be pickled; takes a job and gives an answer. It has to return.
    jobs : sequence
        Can be pickled.
    workers : int
        How many are worked on at a time.
    lost : callable
        Gives the answer for a job whose process died, from the job and the exit status.

    Yields
    ------
    object
        The answers, in the order of the jobs.
    """
    pool = [Child(_work, function) for _ in range(min(workers, len(jobs)))]
    waiting = iter(range(len(jobs)))
    busy: dict[Any, tuple[int, int]] = {}
    answers: dict[int, Out] = {}

    def hand_out(place: int) -> None:
        index = next(waiting, None)
        if index is None:
            return
        # That a process dies of its job shows where the answer is waited for.
        try:
            pool[place].pipe.send(jobs[index])
        except OSError:  # it died of the last one, or since then
            pool[place].end()
            pool[place] = Child(_work, function)
            with contextlib.suppress(OSError):
                pool[place].pipe.send(jobs[index])
        busy[pool[place].pipe] = index, place

    try:
        for place in range(len(pool)):
            hand_out(place)
        for index in range(len(jobs)):
            while index not in answers:
                for pipe in wait(list(busy)):
                    number, place = busy.pop(pipe)
                    try:
                        answers[number] = pool[place].pipe.recv()
                    except (EOFError, OSError):
                        answers[number] = lost(jobs[number], pool[place].end())
                    hand_out(place)
            yield answers.pop(index)
    finally:
        end_all(pool)


def _work(pipe: Connection, function: Callable[[Any], Any]) -> None:
    """What a worker does."""
    answer_signals()
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(function(pipe.recv()))
