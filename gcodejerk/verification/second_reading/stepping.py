"""One line at a time, for the second reading: its numbers computed, its words followed.

Rule: a variable that a line sets is known from the next line on, and only where it is certain that
the line runs.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.computing import Computer
from gcodejerk.verification.second_reading.known import Observation
from gcodejerk.verification.second_reading.lengths import is_cut
from gcodejerk.verification.second_reading.parameters import Parameters
from gcodejerk.verification.second_reading.reading import NAN, Line, Text
from gcodejerk.verification.second_reading.tracking import Tracker

_DECLARES = re.compile(rb"[ \t]*(?:N[0-9]+[ \t]*)?DEF[ \t]", re.IGNORECASE)


class Stepper:
    """Reads and runs lines, with what is computed in them."""

    def __init__(self, text: Text, dialect: Dialect) -> None:
        self.text, self.dialect = text, dialect
        self._parameters = Parameters(dialect) if dialect.text.variables == "Q" else None
        self.computer = self._parameters or Computer(dialect)
        self._computes = self.computer.computes

    def step(self, tracker: Tracker, bare: bytes) -> Observation:
        """Run one line.

        Parameters
        ----------
        tracker : Tracker
            What is known in front of it, and behind it afterwards.
        bare : bytes
            Without its end.
        """
        text, variables = self.text, tracker.variables
        if self._parameters is not None:
            return (
                self._step_with(self._parameters, tracker, bare)
                if b"Q" in bare.upper()
                else (tracker.follow(text.read(bare, not tracker.begun)))
            )
        if not self.computes(bare) or text.is_lost(bare):
            return tracker.follow(text.read(bare, not tracker.begun))
        upper = self.upper(bare)
        settings = self.computer.settings(upper, variables)
        spelled, relative = self.computer.spelled(upper, variables, tracker.inch)
        line = text.read(spelled, not tracker.begun)
        line.relative = relative
        seen = tracker.follow(line)
        self._set(tracker, line, settings, variables)
        if settings and line.words:
            seen.sure = False
        return seen

    def computes(self, bare: bytes) -> bool:
        """Whether a line may hold a variable, or a number that is computed by `computer`."""
        if self._parameters is not None or not self._computes:
            return False
        if self.computer.named:
            return b"=" in bare or b"[" in bare or _DECLARES.match(bare) is not None
        return b"#" in bare or b"[" in bare

    def is_silent(self, bare: bytes) -> bool:
        """Whether a line does nothing, but that it may set variables of the program."""
        text, relative = bare, dict[str, str]()
        if self.computes(bare):
            text, relative = self.computer.spelled(self.upper(bare), {}, inch=False)
        line = self.text.read(text, first=False)
        says = (
            *(line.effects, line.percent, line.deleted, line.offsets, line.limits, line.frame),
            *(line.group, line.cycle, relative, line.flow is not None, line.switched is not None),
        )
        return line.understood and not any(says) and all(word[0] == "N" for word in line.words)

    def _step_with(self, parameters: Parameters, tracker: Tracker, bare: bytes) -> Observation:
        """Run one line with Q parameters."""
        text, variables = self.text, tracker.variables
        said = self.upper(bare).replace(b"\0", b" ")
        found = None if is_cut(bare, self.dialect) else parameters.setting(said, variables)
        if found is None:
            spelled = parameters.in_words(said, variables, inch=tracker.inch)
            line = text.read(bare if is_cut(bare, self.dialect) else spelled, not tracker.begun)
            return tracker.follow(line)
        rest, settings = found
        line = text.read(rest, not tracker.begun)
        seen = tracker.follow(line)
        if settings is not None:
            settings = {n: v if parameters.lasting(n) else NAN for n, v in settings.items()}
        self._set(tracker, line, settings, variables)
        return seen

    @staticmethod
    def _set(
        tracker: Tracker,
        line: Line,
        settings: dict[str, float] | None,
        variables: dict[str, float],
    ) -> None:
        """Set what a line sets, from what was known in front of it; None: anything."""
        if settings is None:
            tracker.variables = {}
            return
        for name, value in settings.items():
            known = value == value and line.understood
            if known and (not line.deleted or variables.get(name) == value):
                tracker.variables[name] = value
            else:
                tracker.variables.pop(name, None)

    def upper(self, bare: bytes) -> bytes:
        """A line without its comments, in upper case."""
        comments = None if b"\r" in bare else self.text.comments
        return (bare if comments is None else comments.sub(b"\0", bare)).upper()
