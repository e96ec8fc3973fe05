"""Asked to end by a signal, a process ends in order: temporary files are put away, nothing is said.

Rule: a signal becomes a SystemExit, so that everything that cleans up on the way out does so.
"""

from __future__ import annotations

import os
import signal
import sys
import threading

AGAIN = 0.02
"""After this time the signal is given once more, where it could not end the process. [s]"""


def exit_on(number: int) -> None:
    """End with the status 128 + number when the signal comes."""
    signal.signal(number, _exit)
    sys.unraisablehook = _ask_again


def _exit(number: int, frame: object) -> None:
    # A second one must not cut short what the first one puts away.
    signal.signal(number, signal.SIG_IGN)
    sys.exit(128 + number)


def _ask_again(unraisable: sys.UnraisableHookArgs) -> None:
    """Python drops what is raised within a destructor or a callback, an exit too, and says so."""
    error = unraisable.exc_value
    if isinstance(error, KeyboardInterrupt):  # SIGINT, which Python itself answers
        number = int(signal.SIGINT)
    elif isinstance(error, SystemExit):
        number = int(error.code or 0) - 128
        exit_on(number)
    else:
        sys.__unraisablehook__(unraisable)
        return
    again = threading.Timer(AGAIN, os.kill, (os.getpid(), number))
    again.daemon = True
    again.start()
