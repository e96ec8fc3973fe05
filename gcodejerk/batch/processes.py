"""A process that hangs on a pipe: how one is started, and how it ends.

Rule: no such process outlives its owner. Where its pipe ends, so does it. Ctrl-C is the owner's
business, who ends it by SIGTERM.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator, Sequence

from gcodejerk.batch.signals import exit_on

# A fork would copy the locks of numpy's threads as they happen to stand.
CONTEXT = multiprocessing.get_context("spawn")
PATIENCE = 5.0
"""Time that a process has to put its things away. [s]"""


class Child:
    """A process, and our end of its pipe.

    Parameters
    ----------
    target : callable
        What it does, a function of a module; its end of the pipe is the first argument.
    *more : object
        The others. Can be pickled.
    """

    def __init__(self, target: Callable[..., None], *more: object) -> None:
        self.pipe, theirs = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=target, args=(theirs, *more), daemon=True)
        with _deaf_to_ctrl_c():
            self.process.start()
        theirs.close()

    def end(self) -> int | None:
        """Wait for its end; the exit status."""
        self.pipe.close()
        self.process.join(PATIENCE)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        return self.process.exitcode


def end_all(children: Sequence[Child]) -> None:
    """End some, all at once."""
    for child in children:
        child.process.terminate()
    for child in children:
        child.end()


def answer_signals() -> None:
    """In a process that begins: Ctrl-C is the owner's business, and by SIGTERM it puts all away."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    exit_on(signal.SIGTERM)


@contextlib.contextmanager
def _deaf_to_ctrl_c() -> Iterator[None]:
    """What is started here ignores SIGINT from its first moment on."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
