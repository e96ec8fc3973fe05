"""Lines taken many at a time, for the second reading, where all rapids among them are confirmed.

Plain lines are taken as they stand (`straight`). Where lines compute their numbers, those that
follow are spelled with these numbers first, as `stepping` would spell each of them; what is then a
plain line is taken as one, and so are runs of feed moves. Lines that only set variables, or say
nothing, have no place among them.

Rule: nothing is taken of which the two readings do not agree in every rapid: such lines are
followed one by one, and the first that differs is named.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.verification.second_reading.reading import Run
from gcodejerk.verification.second_reading.stepping import Stepper
from gcodejerk.verification.second_reading.straight import FEWEST, PlainLines, Straight, follow
from gcodejerk.verification.second_reading.tracking import Tracker

Numbers = NDArray[np.int64]
Agrees = Callable[[Straight, Numbers, Tracker], bool]
"""Whether the two readings agree in plain lines, which stand at these places, in this state."""

MOST, AT_FIRST = 1 << 10, 16
"""Lines that are spelled at a time at most; then twice as many as were taken."""
_RAPID = re.compile(rb"[ \t]*(?:N[0-9]+[ \t]*)?G0?0(?![0-9.])")
"""How plain lines begin that are taken together."""
_FEED = re.compile(rb"[ \t]*(?:N[0-9]+[ \t]*)?G0?[23](?![0-9.])")
"""How lines begin that are none of them."""
PATIENCE = 1 << 10
"""After lines that could not be taken, so many bytes are followed line by line; then twice as
many."""


@dataclass(slots=True)
class _Spelled:
    """Lines in front of a place, spelled with their numbers."""

    lines: list[bytes] = field(default_factory=list)
    """Those that say something."""
    places: list[tuple[int, int]] = field(default_factory=list)
    """Of each of them: how many lines stand in front of it, and where it begins."""
    settings: list[tuple[int, dict[str, float]]] = field(default_factory=list)
    """What is set, in front of how many of them."""
    behind: tuple[int, int] = (0, 0)
    """The place behind all lines."""


class Ahead:
    """Takes lines of one program ahead of the tracker, which then stands behind them."""

    def __init__(
        self, stepper: Stepper, tracker: Tracker, plain: PlainLines, agrees: Agrees | None
    ) -> None:
        """Begin; nothing is taken where nobody says whether the readings agree."""
        self._stepper, self._tracker, self._plain, self._agrees = stepper, tracker, plain, agrees
        self._silent: dict[bytes, bool] = {}
        self._by_hand, self._patience = 0, PATIENCE
        self._feeds_by_hand = 0
        self._reach = AT_FIRST

    def begin(self) -> None:
        """Other data follow."""
        self._by_hand = self._feeds_by_hand = 0

    def take(self, data: bytes, at: int, number: int) -> tuple[int, int] | None:
        """Take the lines that begin here, as many as can be.

        Parameters
        ----------
        data : bytes
            Whole lines.
        at : int
            Begin of one of them.
        number : int
            Of that line in the file, from 1.

        Returns
        -------
        tuple of int, or None
            Number and begin of the line behind them; None: this one has to be followed by itself.
        """
        tracker = self._tracker
        if self._agrees is None or at < self._by_hand or not self._plain.ready(tracker):
            return None
        taken = self._plain.take(data, at, tracker)
        if taken is None:
            return self._computed(data, at, number, self._agrees)
        run, end = taken
        if not self._agrees(run, number + np.arange(len(run)), tracker):
            self._by_hand = end
            return None
        follow(tracker, run)
        return number + len(run), end

    def _computed(
        self, data: bytes, at: int, number: int, agrees: Agrees
    ) -> tuple[int, int] | None:
        """The same of lines whose numbers are computed."""
        tracker, stepper = self._tracker, self._stepper
        if stepper.computer.named or not _RAPID.match(data, at):
            return None
        if not stepper.computes(_line(data, at)[0]):
            return None
        spelled = self._spelled(data, at, _FEED)
        if len(spelled.lines) < FEWEST:
            self._by_hand = spelled.behind[1]
            return None
        taken = self._plain.take(b"\n".join([*spelled.lines, b""]), 0, tracker)
        if taken is None:
            self._by_hand = at + self._patience
            self._patience *= 2
            return None
        run = taken[0]
        numbers = np.array([before for before, _ in spelled.places[: len(run)]])
        if not agrees(run, number + numbers, tracker):
            self._by_hand = spelled.behind[1]
            return None
        self._patience = PATIENCE
        follow(tracker, run)
        count, end = self._leave(spelled, len(run))
        return number + count, end

    def take_run(self, data: bytes, at: int) -> tuple[Run, int] | None:
        """Take feed moves whose numbers are computed, if a run of them begins here.

        Parameters
        ----------
        data : bytes
            Whole lines.
        at : int
            Begin of one of them.

        Returns
        -------
        tuple, or None
            The run, which is still to be followed, and where the line behind it begins.
        """
        tracker, stepper = self._tracker, self._stepper
        if at < self._feeds_by_hand or stepper.computer.named:
            return None
        if not (tracker.may_run and stepper.computes(_line(data, at)[0])):
            return None
        spelled, text = self._spelled(data, at, _RAPID), stepper.text
        tried = text.tried
        taken = tracker.take_run(text, b"\n".join([*spelled.lines, b""]), 0)
        text.tried = tried
        if taken is None:
            self._feeds_by_hand = spelled.behind[1]
            return None
        run = taken[0]
        count, end = self._leave(spelled, run.lines)
        return replace(run, lines=count), end

    def _leave(self, spelled: _Spelled, used: int) -> tuple[int, int]:
        """Set what is set among so many lines; how many that were as they stand, and their end."""
        self._reach = min(max(2 * used, AT_FIRST), MOST)
        whole = used == len(spelled.lines)
        for before, settings in spelled.settings:
            if whole or before <= used:
                _set(self._tracker.variables, settings)
        return spelled.behind if whole else spelled.places[used]

    def _spelled(self, data: bytes, at: int, others: re.Pattern[bytes]) -> _Spelled:
        """Spell lines from a place on, up to one that says more than plain ones, or others."""
        stepper, computer, out = self._stepper, self._stepper.computer, _Spelled()
        variables, inch = dict(self._tracker.variables), self._tracker.inch
        count = 0
        while count < self._reach and at < len(data):
            bare, end = _line(data, at)
            computes = stepper.computes(bare)
            if others.match(bare) or (computes and stepper.text.is_lost(bare)):
                break
            text = bare
            settings: dict[str, float] | None = None
            if computes:
                upper = stepper.upper(bare)
                settings = computer.settings(upper, variables)
                if settings is None or (settings and not self._is_silent(bare)):
                    break
                if not settings:
                    text, relative = computer.spelled(upper, variables, inch)
                    if relative or b"#" in text:
                        break
                    text = text.replace(b"\0", b" ").strip()
            if settings:
                _set(variables, settings)
                out.settings.append((len(out.lines), settings))
            elif bare[:1] not in (b"", b"(", b";") or not self._is_silent(bare):
                out.lines.append(text)
                out.places.append((count, at))
            count, at = count + 1, end
        out.behind = count, at
        return out

    def _is_silent(self, bare: bytes) -> bool:
        """Whether a line sets variables of the program at most, whatever they are."""
        if bare not in self._silent:
            if len(self._silent) >= MOST:
                self._silent.clear()
            self._silent[bare] = self._stepper.is_silent(bare)
        return self._silent[bare]


def _line(data: bytes, at: int) -> tuple[bytes, int]:
    """The line that begins here, without its end, and where the next one begins."""
    end = data.find(b"\n", at)
    end = len(data) if end < 0 else end
    return data[at:end].rstrip(b"\r"), end + 1


def _set(variables: dict[str, float], settings: dict[str, float]) -> None:
    """Set variables of which a line is known to run; NaN: nothing is known of one any more."""
    for name, value in settings.items():
        if value == value:
            variables[name] = value
        else:
            variables.pop(name, None)
