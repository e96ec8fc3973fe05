"""Several processes at one program: pieces of its work go to whoever has room for them.

The process that owns the program is one of the pool: it computes pieces itself wherever no answer
is there yet. So nobody is started for a small program, where the work is done before it would pay.

Rule 1: answers come in the order of the pieces, and so does what goes wrong.
Rule 2: of pieces and answers only a few for each process are in memory.
"""

from __future__ import annotations

import contextlib
import pickle
import threading
import time
import traceback
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.connection import Connection, wait
from queue import SimpleQueue
from types import TracebackType
from typing import Any, NamedTuple

from gcodejerk.batch.processes import Child, answer_signals, end_all
from gcodejerk.errors import GcodejerkError
from gcodejerk.motion.threads import one_thread
from gcodejerk.spread import In, Out, here

PAYS = 0.5
"""Work in pieces after which others are called, about what it takes to start one [s]."""
IN_HAND = 2
"""Pieces that a worker has at a time, so that none waits for its owner."""
AHEAD = 4
"""Pieces, for each process, that are asked for ahead of the answers that were taken."""
NOT_PICKLED = pickle.PicklingError, AttributeError, TypeError
"""Raised for what cannot be pickled."""
GREETING = -1
"""In the place of a piece's index: the worker has imported what it needs."""


class LostError(GcodejerkError):
    """A process that worked on the program died."""

    def __init__(self, status: int | None) -> None:
        super().__init__("a process that worked on the program died")
        self.status = status


class _Answer(NamedTuple):
    """The value of a piece, or the error that it ended in."""

    value: Any
    error: Exception | None = None

    def taken(self) -> Any:
        """The value, or the error."""
        if self.error is not None:
            raise self.error
        return self.value


class Pool:
    """A process with others that it starts when they pay.

    Parameters
    ----------
    size : int
        How many processes work at a time, this one among them.
    pays : float, optional
        See `PAYS`.
    """

    def __init__(self, size: int, pays: float = PAYS) -> None:
        self.size, self.pays = size, pays
        self.workers: list[_Worker] = []
        self._round = 0
        self._spent = 0.0

    def __enter__(self) -> Pool:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        place: TracebackType | None,
    ) -> None:
        workers, self.workers = self.workers, []
        end_all(workers)

    def map(self, function: Callable[[In], Out], pieces: Iterable[In], /) -> Iterator[Out]:
        """See `Spread`; one map at a time."""
        return here(function, pieces) if self.size == 1 else self._map(function, pieces)

    def _map(self, function: Callable[[In], Out], pieces: Iterable[In]) -> Iterator[Out]:
        """Hand out what there is room for, give what is there, and else do the next piece."""
        self._round += 1
        answers: dict[int, _Answer] = {}
        waiting = enumerate(pieces)
        handed, given, more = 0, 0, True
        while True:
            self._collect(answers, 0.0)
            worker = self._free()
            if given in answers and (worker is None or not more):
                yield answers.pop(given).taken()
                given += 1
                continue
            if more and handed - given < AHEAD * self.size:
                try:
                    index, piece = next(waiting)
                except StopIteration:
                    more = False
                    continue
                except Exception as error:
                    answers[handed], more = _Answer(None, error), False
                    handed += 1
                    continue
                handed += 1
                if worker is None or not worker.give(self._round, index, function, piece):
                    answers[index] = self._done_here(function, piece)
            elif given in answers:
                yield answers.pop(given).taken()
                given += 1
            elif given == handed:
                return
            else:
                self._collect(answers, None)

    def _done_here(self, function: Callable[[In], Out], piece: In) -> _Answer:
        """Do a piece in this process; when it has done enough of them, call the others."""
        begin = time.process_time()
        answer = _tried(function, piece)
        self._spent += time.process_time() - begin
        if self._spent > self.pays and not self.workers and _can_be_pickled(function):
            self.call(function)
        return answer

    def call(self, function: Callable[[Any], Any]) -> None:
        """Start the others; they have pieces as soon as they know the function."""
        self.workers = [_Worker() for _ in range(self.size - 1)]
        for worker in self.workers:
            worker.give(self._round, GREETING, function, None)

    def wait_for_all(self) -> None:
        """Until everybody can work."""
        while any(worker.in_hand for worker in self.workers):
            self._collect({}, None)

    def _free(self) -> _Worker | None:
        """One who has room for a piece, the one with the most."""
        ready = [m for m in self.workers if m.ready and m.in_hand < IN_HAND]
        return min(ready, key=lambda m: m.in_hand, default=None)

    def _collect(self, answers: dict[int, _Answer], timeout: float | None) -> None:
        """Take the answers that are there."""
        by_pipe: dict[Any, _Worker] = {
            worker.pipe: worker for worker in self.workers if worker.in_hand
        }
        for pipe in wait(list(by_pipe), timeout) if by_pipe else ():
            number, index, answer = by_pipe[pipe].answer()
            if index != GREETING and number == self._round:
                answers[index] = answer


class _Worker(Child):
    """Another process, and what it has in hand."""

    def __init__(self) -> None:
        super().__init__(_work)
        self.in_hand = 0
        self.ready = False
        self._function: Callable[[Any], Any] | None = None

    def give(self, number: int, index: int, function: Callable[[Any], Any], piece: object) -> bool:
        """Hand it a piece, and the function where it is another one; whether these can travel."""
        new = None if function is self._function else function
        try:
            self.pipe.send((number, index, new, piece))
        except OSError:
            raise LostError(self.end()) from None
        except NOT_PICKLED:
            return False
        self._function = function
        self.in_hand += 1
        return True

    def answer(self) -> tuple[int, int, _Answer]:
        """Take an answer."""
        try:
            number, index, answer = self.pipe.recv()
        except (EOFError, OSError):
            raise LostError(self.end()) from None
        self.in_hand -= 1
        self.ready = True
        return number, index, answer


def _can_be_pickled(function: Callable[[Any], Any]) -> bool:
    """Whether other processes can be told of a function; somebody else's emitter may say no."""
    try:
        pickle.dumps(function)
    except NOT_PICKLED:
        return False
    return True


def _tried(function: Callable[[Any], Any], piece: object) -> _Answer:
    """Do a piece; what goes wrong is told where the answer is taken."""
    try:
        return _Answer(function(piece))
    except Exception as error:
        return _Answer(None, error)


def _work(pipe: Connection) -> None:
    """What a worker does."""
    answer_signals()
    inbox: SimpleQueue[Any] = SimpleQueue()
    # The owner is never kept waiting while it sends, so that both cannot wait for each other.
    threading.Thread(target=_receive, args=(pipe, inbox), daemon=True).start()
    function: Callable[[Any], Any] = _nothing
    with one_thread(), contextlib.suppress(EOFError, OSError):
        while (message := inbox.get()) is not None:
            number, index, new, piece = message
            function = function if new is None else new
            answer = _Answer(None) if index == GREETING else _portable(_tried(function, piece))
            del message, piece
            pipe.send((number, index, answer))


def _nothing(piece: object) -> None:
    """What is done before anything is asked for."""


def _receive(pipe: Connection, inbox: SimpleQueue[Any]) -> None:
    """Take what the owner sends; nothing more comes where its pipe ends."""
    try:
        with contextlib.suppress(EOFError, OSError):
            while True:
                inbox.put(pipe.recv())
    finally:
        inbox.put(None)


def _portable(answer: _Answer) -> _Answer:
    """An error that survives the way, with the place where it was raised if it is a bug."""
    error = answer.error
    if error is None:
        return answer
    told = "".join(traceback.format_exception(error))
    try:
        error = pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(told)
    if not isinstance(error, GcodejerkError):
        error.add_note(f"in another process:\n{told}")
    return _Answer(None, error)
