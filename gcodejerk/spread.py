"""Work in pieces, and who does it: whoever computes hands pieces on, and does not know to whom.

`batch` owns processes and hands a `Spread` down; where nobody does, everything is done here.

Rule 1: where pieces are cut depends on the program alone, and what comes of a piece on the piece
alone. So results are the same to the bit, whoever computes them, and however many they are.
Rule 2: a function and its pieces can be pickled, and a piece is a window of the program.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import chain, islice
from typing import Protocol, TypeVar

In = TypeVar("In")
Out = TypeVar("Out")


class Spread(Protocol):
    """As `map`: applies a function to pieces, and gives the answers in their order."""

    def __call__(self, function: Callable[[In], Out], pieces: Iterable[In], /) -> Iterator[Out]:
        """Pieces may be asked for some way ahead of the answers."""


def here(function: Callable[[In], Out], pieces: Iterable[In]) -> Iterator[Out]:
    """One after the other, in this process.

    Examples
    --------
    >>> list(here(abs, [-1, 2]))
    [1, 2]
    """
    return map(function, pieces)


AHEAD = 2
"""Pieces that are begun before the answer to an earlier one is asked for."""


def ahead(function: Callable[[In], Out], pieces: Iterable[In]) -> Iterator[Out]:
    """One after the other, in a thread of this process, while the answers are made use of.

    That pays for work on arrays, in which the interpreter has no part. Pieces are asked for here,
    and a single one is done here.

    Examples
    --------
    >>> list(ahead(abs, [-1, 2, -3, 4]))
    [1, 2, 3, 4]
    """
    pieces = iter(pieces)
    first = list(islice(pieces, 2))
    if len(first) < 2:
        yield from map(function, first)
        return
    with ThreadPoolExecutor(1) as thread:
        waiting: deque[Future[Out]] = deque()
        for piece in chain(first, pieces):
            waiting.append(thread.submit(function, piece))
            if len(waiting) > AHEAD:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
