"""Ctrl-C from the first moment on: while modules are imported there is nothing to say, either.

Rule: imported in front of all that takes its time, and taken back behind it. Whoever imports the
command line for its functions keeps their own answer to Ctrl-C.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType, TracebackType

from gcodejerk.batch.signals import exit_on


def _is_pythons() -> bool:
    """Whether Python itself would answer, and this is the thread that may ask for the signal."""
    return (
        threading.current_thread() is threading.main_thread()
        and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    )


class Quiet:
    """Until it is taken back, Ctrl-C ends the process with status 130, without a word."""

    def __init__(self) -> None:
        """Only where Python itself would answer."""
        self.hooks, self.mine = (sys.unraisablehook, sys.excepthook), _is_pythons()
        if self.mine:
            sys.excepthook = self._told
            exit_on(signal.SIGINT)

    def _told(
        self, kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        """An error of an import is told, unless Ctrl-C is behind it (see `Noted`)."""
        if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            os._exit(128 + signal.SIGINT)
        self.hooks[1](kind, error, trace)

    def back(self) -> None:
        """Give the signal back to Python, unless it has come."""
        if self.mine and signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            sys.unraisablehook, sys.excepthook = self.hooks


class Noted:
    """Ctrl-C as Python answers to it, and whether it came: what is imported may hide it.

    Up to 3.11, what is raised while a class is made becomes a RuntimeError, as numpy's classes are.
    """

    def __init__(self) -> None:
        """Only where Python itself would answer."""
        self.came, self.mine = False, _is_pythons()
        if self.mine:
            signal.signal(signal.SIGINT, self._answer)

    def _answer(self, number: int, frame: FrameType | None) -> None:
        self.came = True
        signal.default_int_handler(number, frame)

    def back(self) -> None:
        """Give the signal back to Python."""
        if self.mine:
            signal.signal(signal.SIGINT, signal.default_int_handler)


IMPORTING = Quiet()
