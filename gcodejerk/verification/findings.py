"""What verification finds: violations, each of one kind, and the verdict.

Rule: every check has a kind of its own, so that a test can say which check caught a damage and a
user which promise was broken.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

from gcodejerk.errors import Place, VerifyError


class Kind(enum.StrEnum):
    """What a violation is about."""

    CHANGED = "line changed"
    LINE_END = "line end changed"
    ADDED = "text added"
    MISSING = "text missing"
    NOT_CERTAIN = "rapid replaced that had to be left alone"
    STAMP = "stamp"
    COMMENT = "comment of the stream"
    HEAD = "words of the block lost or changed"
    FORM = "not the form of a stream"
    MODE = "mode during the stream"
    MOTION = "G0 not restored"
    DISTANCE = "distance mode not restored"
    FEED_MODE = "feed mode not restored"
    FEED_RESTORED = "F not restored"
    PATH = "path mode not restored"
    STOP = "stop of the block lost or changed"
    AXES = "axis that may not move"
    LENGTH = "shorter than minimum_length"
    TRAVEL = "beyond travel"
    START = "start of the stream"
    END = "end of the stream"
    LINE = "off the straight line"
    BACKWARDS = "backwards or past the end"
    VELOCITY = "velocity limit"
    ACCELERATION = "acceleration limit"
    JERK = "jerk limit"
    FEED = "feed of a block"
    TIME = "duration"
    RESIDUAL = "residual"
    PROFILE = "off the reported profile"
    TABLE = "table"
    SAMPLES = "samples"
    CYCLE = "moves of a cycle"
    READING = "second reading"
    SETTING = "settings of the control"
    FLOW = "blocks of a loop or call"
    SERIES = "cycle that had to be left to the controller"


@dataclass(frozen=True, slots=True)
class Violation:
    """One promise that the processed program breaks."""

    line: int | None
    """In the processed file, counted from 1."""
    original_line: int | None
    """Of the block that it belongs to, in the original."""
    kind: Kind
    problem: str
    remedy: str | None = None


@dataclass(frozen=True, slots=True)
class Verification:
    """What `verify` found."""

    rapids: int
    """Of the original."""
    rewritten: int
    kept: int
    """Lines of the original that are in the processed file as they were."""
    violations: tuple[Violation, ...]
    names: tuple[str, str] = ("<original>", "<processed>")
    confirmed: int = 0
    """Rewritten rapids of which a second reading of the original, which shares nothing with the
    first, says the same; of the others it does not know."""
    places: int = 0
    """At which lines set the control, or take that back."""

    @property
    def ok(self) -> bool:
        """Whether every promise is kept."""
        return not self.violations


@dataclass(slots=True)
class Findings:
    """Collects violations, up to a number."""

    most: int
    violations: list[Violation] = field(default_factory=list)

    @property
    def full(self) -> bool:
        """Whether no more are wanted."""
        return len(self.violations) >= self.most

    def add(
        self, kind: Kind, line: int | None, original: int | None, problem: str, remedy: str = ""
    ) -> None:
        """Note a violation."""
        if not self.full:
            self.violations.append(Violation(line, original, kind, problem, remedy or None))

    def sorted(self) -> tuple[Violation, ...]:
        """In the order of the processed file."""
        order = sorted(self.violations, key=lambda v: (v.line is None, v.line or 0))
        return tuple(order)


SHOWN = 5
"""Violations in the message of `require`."""


def require(verification: Verification) -> None:
    """Refuse what breaks a promise.

    Parameters
    ----------
    verification : Verification
        As `verify` returns it.

    Raises
    ------
    VerifyError
        There are violations; the message holds the first of them.
    """
    if verification.ok:
        return
    original, processed = verification.names
    violations = verification.violations
    first = violations[0]
    problem = first.problem
    for other in violations[1:SHOWN]:
        where = f"{processed}:{other.line}" if other.line else f"{original}:{other.original_line}"
        problem += f"\n{where}: {other.problem}"
    if len(violations) > SHOWN:
        problem += f"\n... and {len(violations) - SHOWN} more"
    line, file = (first.line, processed) if first.line else (first.original_line, original)
    remedy = first.remedy or "do not run this program; this is a bug of what wrote it"
    raise VerifyError(problem, remedy, Place(file, line))
