"""Worker processes: each has one job at a time, and one that dies costs no more than that job.

Rule 1: answers come in the order of the jobs, whoever is done first.
Rule 2: no worker outlives its master. Each hangs on a pipe of its own, and where that ends, so does
the worker: behind the job that it has in hand, whose output then is complete.
Rule 3: Ctrl-C is the master's business. It ends its workers by SIGTERM, on which they put away
what they had begun.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

from gcodejerk.batch.signals import exit_on

In = TypeVar("In")
Out = TypeVar("Out")

# A fork would copy the locks of numpy's threads as they happen to stand.
CONTEXT = multiprocessing.get_context("spawn")
PATIENCE = 5.0
"""Time that a worker has to put its things away. [s]"""


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
    pool = [_Worker(function) for _ in range(min(workers, len(jobs)))]
    waiting = iter(range(len(jobs)))
    busy: dict[Any, tuple[int, _Worker[In, Out]]] = {}
    answers: dict[int, Out] = {}

    def hand_out(worker: _Worker[In, Out]) -> None:
        index = next(waiting, None)
        if index is not None:
            worker.start(jobs[index])
            busy[worker.pipe] = index, worker

    try:
        for worker in pool:
            hand_out(worker)
        for index in range(len(jobs)):
            while index not in answers:
                for pipe in wait(list(busy)):
                    number, worker = busy.pop(pipe)
                    try:
                        answers[number] = worker.pipe.recv()
                    except (EOFError, OSError):
                        answers[number] = lost(jobs[number], worker.end())
                    hand_out(worker)
            yield answers.pop(index)
    finally:
        for worker in pool:
            worker.process.terminate()
        for worker in pool:
            worker.end()


class _Worker(Generic[In, Out]):
    """A process and our end of its pipe."""

    def __init__(self, function: Callable[[In], Out]) -> None:
        self.function = function
        self._start_process()

    def _start_process(self) -> None:
        """Start the process, or another one in the place of a dead one."""
        self.pipe, theirs = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=_work, args=(theirs, self.function), daemon=True)
        with deaf_to_ctrl_c():
            self.process.start()
        theirs.close()

    def start(self, job: In) -> None:
        """Give it a job. That the process dies of it shows where the answer is waited for."""
        try:
            self.pipe.send(job)
        except OSError:  # it died of the last one, or since then
            self.end()
            self._start_process()
            with contextlib.suppress(OSError):
                self.pipe.send(job)

    def end(self) -> int | None:
        """Wait for its end; the exit status."""
        self.pipe.close()
        self.process.join(PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        return self.process.exitcode


@contextlib.contextmanager
def deaf_to_ctrl_c() -> Iterator[None]:
    """What is started here ignores SIGINT from its first moment on."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _work(pipe: Connection, function: Callable[[Any], Any]) -> None:
    """What a worker does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    exit_on(signal.SIGTERM)
    with contextlib.suppress(EOFError, OSError):
        while True:
            pipe.send(function(pipe.recv()))
