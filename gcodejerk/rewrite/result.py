"""The outcome of one program: what was written, what it leaves, and each rapid as a record."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.cycles.expansion import Expansion
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.nc import Program
from gcodejerk.planning.batch import SIDES
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.settling import Left
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.rewrite.control_settings import ControlSettings
from gcodejerk.storage import Growing, windows
from gcodejerk.unrolling.unrolling import Unrolling
from gcodejerk.verification import Verification

REMEMBERED = 2000
"""Reported profiles that are kept."""
AT_HAND = 1024
"""Lines of which it is at hand which profile is theirs."""


@dataclass(frozen=True, slots=True)
class RapidResult:
    """What was done with one rapid."""

    line: int
    """Of its block in the program, counted from 1."""
    rewritten: bool
    reason: str | None
    """Why it was left alone; None where it was rewritten."""
    displacement: dict[str, float]
    """What each axis moves; empty where that is not known. [mm] or [deg]"""
    profile: str | None
    """Name of the profile that is written; None where it was left alone."""
    time: float | None
    """T_SUM, None where it was left alone. [s]"""
    conventional_time: float | None
    """What the controller's own G0 takes, None where that is not known. [s]"""
    residual: float | None
    """The largest displacement that a mode keeps, None where it was left alone. [mm]"""
    conventional_residual: float | None
    """The same of the controller's own G0. [mm]"""


def rapid_results(
    program: Program,
    plans: Plans,
    residual: Array,
    conventional: Array,
) -> tuple[RapidResult, ...]:
    """Every rapid of a program, in the order of the file.

    Parameters
    ----------
    program : Program
        n rapids.
    plans : Plans
        Row i is rapid i.
    residual, conventional : ndarray, shape (n, m)
        Displacement of each mode, NaN where not planned. [mm]

    Returns
    -------
    tuple of RapidResult, length n
    """
    times = plans.times
    # A spectrum's oscillators count together, as in reports.
    worst, today = (
        np.max(plans.modes.grouped(each), axis=1, initial=0.0) for each in (residual, conventional)
    )
    out = []
    for row, line in enumerate(program.rapids.line.tolist()):
        rewritten = bool(plans.reason[row] == CERTAIN)
        usual = float(plans.conventional_time[row])
        moved = np.flatnonzero(plans.displacement[row]).tolist()
        out.append(
            RapidResult(
                line=line,
                rewritten=rewritten,
                reason=None if rewritten else str(REASONS[plans.reason[row]]),
                displacement={AXES[k]: float(plans.displacement[row, k]) for k in moved},
                profile=plans.designed if rewritten else None,
                time=float(times[row]) if rewritten else None,
                conventional_time=usual if usual > 0.0 else None,
                residual=float(worst[row]) if rewritten else None,
                conventional_residual=float(today[row]) if rewritten else None,
            )
        )
    return tuple(out)


class ReportedProfiles(Mapping[int, Array]):
    """The profiles as reports say them: durations and jerks along the path, by line.

    Each is made when it is asked for: of a hundred thousand moves no copies are kept but a few.
    """

    def __init__(self, program: Program, plans: Plans) -> None:
        # Moves of one length along one profile have one array.
        own = plans.profiles
        like = own.like if isinstance(own, RepeatedProfiles) else np.arange(len(own))
        self.profiles = own.distinct if isinstance(own, RepeatedProfiles) else own
        lines, lengths, rows = Growing(np.int64), Growing(np.float64), Growing(np.int64)
        for part in windows(len(plans)):
            planned = part.start + np.flatnonzero(plans.reason[part] == CERTAIN)
            begin, end = (np.searchsorted(plans.move, planned, side=side) for side in SIDES)
            single = end - begin == 1
            moves = planned[single]
            lines.extend(program.rapids.line[moves])
            lengths.extend(plans.length[moves])
            rows.extend(like[begin[single]])
        self.lines, self.length, self.row = lines.finish(), lengths.finish(), rows.finish()
        self.made: dict[tuple[int, float], Array] = {}
        self._near: dict[int, tuple[int, float]] = {}
        """Of the lines around the one that was asked for last: row of the profile, and length."""

    def between(self, first: int, last: int) -> ReportedProfiles:
        """Those of some lines, both included, with their own profiles alone."""
        part = slice(*np.searchsorted(self.lines, [first, last + 1]).tolist())
        rows, row = np.unique(self.row[part], return_inverse=True)
        own = copy(self)
        own.profiles, own.row = self.profiles.take(rows), row.reshape(-1)
        own.lines, own.length, own.made = self.lines[part].copy(), self.length[part].copy(), {}
        own._near = {}
        return own

    def __len__(self) -> int:
        return len(self.lines)

    def __iter__(self) -> Iterator[int]:
        return iter(self.lines.tolist())

    def __getitem__(self, line: int) -> Array:
        made: Array | None = self.get(line)
        if made is None:
            raise KeyError(line)
        return made

    def get(self, line: int, default: Any = None) -> Any:
        """The profile of a line, or another where it has none."""
        key = self._near.get(line)
        if key is None:
            key = self._looked_up(line)
            if key is None:
                return default
        made = self.made.get(key)
        if made is None:
            profiles, (row, length) = self.profiles, key
            segments = slice(int(profiles.first[row]), int(profiles.first[row + 1]))
            jerk = profiles.jerk[segments] * length
            made = np.stack([profiles.duration[segments], jerk], axis=1)
            if len(self.made) >= REMEMBERED:
                self.made.clear()
            self.made[key] = made
        return made

    def _looked_up(self, line: int) -> tuple[int, float] | None:
        """Have a line and those behind it at hand; they are asked for in the order of the file."""
        begin = int(np.searchsorted(self.lines, line))
        last = self.lines[begin : begin + AT_HAND][-1:]
        # Of several on one line it is the last that counts.
        near = slice(begin, int(np.searchsorted(self.lines, last, side="right").sum()))
        rows = zip(self.row[near].tolist(), self.length[near].tolist(), strict=True)
        self._near = dict(zip(self.lines[near].tolist(), rows, strict=True))
        return self._near.get(line)


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """The outcome of one program.

    Attributes
    ----------
    program : Program
        As it was read, with its rapids. Those of cycles that were written out carry the line and
        the place of the cycle's block; several of them share one.
    plans : Plans
        Row i is rapid i.
    controller : str
        The emitter that wrote.
    residual, conventional_residual : ndarray, shape (n, m)
        Displacement envelopes of every rapid and mode, NaN where not planned. [mm]
    deviation : ndarray, shape (n,)
        Under independent positioning, how far the path leaves the control's own, at most. [mm]
    rest : Left
        What rapids leave today that were left alone.
    verification : Verification or None
        None where it was switched off, or where nothing was written.
    edits : ndarray of int, shape (k, 3)
        Begin and end in the output of every stream, and the rapid that it replaces; -1 for the
        stamp. Empty where the output is a file of its own. [bytes]
    hunks : ndarray of int, shape (n, 5)
        All that is not the source's, what was written out included: see `expanded.hunks`.
    expansion : Expansion or None
        The outcome for the cycles; None where they were not to be written out.
    unrolling : Unrolling or None
        The same for loops, branches and calls.
    settings : ControlSettings or None
        What the control is set to, where it was to be (form `parameters`); every rapid then stays
        as it is.
    notes : tuple of str
        What the user has to know: of the program, and of the controller.
    output : bytes or None
        The output, where it was asked for in memory.
    beside : bytes or None
        The file that belongs beside it, for controllers that write one.
    """

    program: Program
    plans: Plans
    controller: str
    profile: str
    form: str
    residual: Array
    conventional_residual: Array
    deviation: Array
    rest: Left
    verification: Verification | None
    edits: NDArray[np.int64]
    hunks: NDArray[np.int64]
    expansion: Expansion | None
    notes: tuple[str, ...]
    output: bytes | None = field(default=None, repr=False)
    beside: bytes | None = field(default=None, repr=False)
    settings: ControlSettings | None = None
    unrolling: Unrolling | None = None

    def __repr__(self) -> str:
        return f"<Result {self.program.name}: {self.planned} of {len(self.plans)} rapids rewritten>"

    @property
    def rapids(self) -> tuple[RapidResult, ...]:
        """Every rapid of the program, one record each, in the order of the file."""
        return rapid_results(self.program, self.plans, self.residual, self.conventional_residual)

    @property
    def planned(self) -> int:
        """Number of rapids that were rewritten."""
        return int(np.count_nonzero(self.plans.planned))

    @property
    def left(self) -> int:
        """Number of rapids that were left alone."""
        return len(self.plans) - self.planned

    @property
    def unserved(self) -> int:
        """Rapids for which nothing was done: left alone, and the control not set for them."""
        served = self.plans.reason == REASONS.index(Reason.CONTROL_SET)
        return self.left - int(np.count_nonzero(served))

    @property
    def read_once(self) -> int:
        """Rewritten rapids of which the second reading of the program does not know all."""
        found = self.verification
        return 0 if found is None else found.rewritten - found.confirmed
