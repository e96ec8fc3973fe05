"""What a screen of LinuxCNC calls to open a program: the protocol of [FILTER].

A screen runs the command of the INI by `sh -c`, the file last, standard input closed. What comes on
standard output is loaded; a line `FILTER_PROGRESS=n` on standard error moves its bar, every other
line there is shown; with an exit status other than 0 nothing is loaded.

Rule: standard output gets the whole program or nothing, after it was proven.
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import time
from typing import BinaryIO, TextIO

from gcodejerk.batch.files import STANDARD, new_file, open_input
from gcodejerk.emit import controller_of
from gcodejerk.errors import EmitError, Place
from gcodejerk.machine import Machine
from gcodejerk.report.records import summary_of
from gcodejerk.report.tables import summary_line
from gcodejerk.rewrite.pipeline import Settings, process_file
from gcodejerk.rewrite.stamp import ProcessedError, is_unchanged
from gcodejerk.verification.bytes.stamp import read_stamp

BAR = "AXIS_PROGRESS_BAR"
"""AXIS and GladeVCP set this variable where they show progress; QtVCP sets nothing."""
LEAST_PAUSE = 0.1
"""AXIS takes one line in this time: more of them would make it late. [s]"""
SHARES = {"reading": (0, 20), "planning": (20, 60), "writing": (60, 75), "verifying": (75, 99)}
"""What each step is of the whole. [%]"""


class Bar:
    """Tells progress as screens read it; whole numbers that never fall, one line each."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.shown = -1
        self._at = -LEAST_PAUSE

    def show(self, step: str, done: int, total: int) -> None:
        """Take how much of a step is done (`pipeline.Progress`)."""
        low, high = SHARES.get(step, (self.shown, self.shown))
        percent = low + (high - low) * min(done, total) // max(total, 1)
        now = time.monotonic()
        if percent > self.shown and now - self._at >= LEAST_PAUSE:
            self._write(percent)
            self._at = now

    def finish(self) -> None:
        """All is done."""
        self._write(100)

    def _write(self, percent: int) -> None:
        self.shown = percent
        print(f"FILTER_PROGRESS={percent}", file=self.stream, flush=True)


def wants_progress() -> bool:
    """Whether the screen has asked for progress."""
    return os.environ.get(BAR, "") not in ("", "0")


def filter_program(
    path: str, machine: Machine, settings: Settings, *, progress: bool = False
) -> list[str]:
    """Write a program to standard output, rewritten, or as it is where that was done before.

    Parameters
    ----------
    path : str
        The program.
    machine : Machine
        What it runs on.
    settings : Settings
        The user's choices.
    progress : bool, optional
        Tell progress on standard error.

    Returns
    -------
    list of str
        What to say on standard error.

    Raises
    ------
    GcodejerkError
        The program cannot be processed; nothing was written.
    """
    emitter = controller_of(machine, settings.controller)
    if not emitter.in_place or emitter.beside:
        raise EmitError(
            f"controller {emitter.name} writes a file beside the program or in its place, and a "
            "screen takes one program",
            "name another --controller, or process the program and open what was written",
        )
    bar = Bar(sys.stderr) if progress else None
    with open_input(path) as source, new_file(STANDARD) as target:
        try:
            show = None if bar is None else bar.show
            result = process_file(source, target, machine, settings, path, show)
        except ProcessedError as error:
            source.seek(0)
            target.seek(0)
            target.truncate()
            shutil.copyfileobj(source, target)
            says = [f"{error.place or Place(path)}: note: {text}" for text in _old(source, machine)]
        else:
            says = [f"{path}: note: {note}" for note in result.notes]
            says.append(summary_line(path, summary_of(result)))
    if bar is not None:
        bar.finish()
    # A line that looked like progress would be swallowed.
    return [re.sub(r"^FILTER_PROGRESS=", "FILTER PROGRESS ", line) for line in says]


def _old(source: BinaryIO, machine: Machine) -> list[str]:
    """What to say of a program that was processed before, and is passed on as it is."""
    says = ["processed before; passed on unchanged"]
    if is_unchanged(source) is False:
        says.append("it was edited after it was processed: its sum is not the stamp's")
    source.seek(0)
    stamp = read_stamp(source, machine)
    if stamp is None or not stamp.known:
        says.append(
            f"it was processed for another machine file than {machine.source}, or with options "
            "that are not known here: to be sure, open the original"
        )
    return says
