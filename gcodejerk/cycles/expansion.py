"""Drilling cycles written out: a program in, the same program with explicit moves out.

This module owns the walk through the file. Whether a series of cycles is certain, and what its
blocks become, is told by `series`; what a cycle does, by `drilling`; where the lines of the result
come from, by `nc.line_map`.

Rule 1: the file is walked twice, first to judge every series, then to write; so no series is held
in memory, however long it is.
Rule 2: what is not a block of a series that is certain is copied byte for byte.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from gcodejerk.cycles.blocks import write_block
from gcodejerk.cycles.called import JUMPS, CallExpander
from gcodejerk.cycles.drilling import DRILLING, rules_for
from gcodejerk.cycles.numbers import decimal
from gcodejerk.cycles.series import (
    LeftAlone,
    Moment,
    PathWords,
    Series,
    begin_series,
    call_of,
    cycle_in_force,
    doubt,
    drills,
    g_codes,
    passes,
    why_left_alone,
)
from gcodejerk.cycles.walk import Place, Verdict, Walker
from gcodejerk.errors import EmitError, ProgramError
from gcodejerk.errors import Place as FilePlace
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.dialects.gcodes import G61, G61_1, G64
from gcodejerk.nc.interpreter.runner import Finding
from gcodejerk.nc.line_map import LineMap
from gcodejerk.nc.text.block import Block
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.reasons import Reason
from gcodejerk.start import NOTHING_KNOWN, Start

# A cycle's code, blanks and zeros as the controller allows them; one that is computed is unknown.
_CYCLE = re.compile(rb"[gG][0+ \t]*[78]")
# What may change the spindle or the path mode.
_NOTED = re.compile(rb"[mMoO]|[gG][0+ \t]*6")
# What may lead to a block from elsewhere than the one in front of it, in macro B and its kin.
_JUMPS = re.compile(
    rb"GOTO|WHILE|IF[ \t]*\[|M[ \t]*0*9[67](?![0-9])|M[ \t]*0*99[^\n]*P|G[ \t]*0*6[56](?![0-9])",
    re.IGNORECASE,
)
ROOM = 16
"""Characters by which a line may become longer than the block: its code, blanks, a sign, a dot."""
_SHOWN = 20
"""Series left alone that get a finding of their own."""


@dataclass(frozen=True, slots=True, eq=False)
class Expansion:
    """What was written out, and what was not."""

    blocks: int
    """Of the original."""
    holes: int
    """Those of them that call a cycle."""
    written: int
    """Those of these that were written out."""
    findings: tuple[Finding, ...]
    """One for each series that was left to the controller, up to a number."""
    map: LineMap


def expand(
    source: BinaryIO,
    target: BinaryIO,
    *,
    name: str = "<program>",
    dialect: str | Dialect = "linuxcnc",
    start: Start = NOTHING_KNOWN,
    comments: bool = True,
) -> Expansion:
    r"""Write the drilling cycles of a program out as explicit moves.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable, at its beginning.
    target : BinaryIO
        Takes the result; nothing is written where no cycle is.
    name : str, optional
        For messages.
    dialect : str or Dialect, optional
        How the program is written.
    start : Start, optional
        What may be assumed when it starts.
    comments : bool, optional
        Name each block that is written out in a comment.

    Returns
    -------
    Expansion
        With `written` 0, and nothing in `target`, where no series is certain.

    Raises
    ------
    ProgramError
        The file cannot be an NC program, or nothing is known of the dialect's cycles.
    EmitError
        The file was changed between the two walks.

    Examples
    --------
    >>> import io
    >>> program = b"G21 G90 G64 G98 F100\nG0 X0 Y0 Z10\nG81 X5 Z-3 R2\nG80\nM2\n"
    >>> target = io.BytesIO()
    >>> expand(io.BytesIO(program), target, comments=False).written
    1
    >>> print(target.getvalue().decode().splitlines()[2:-2])
    ['G61', 'G0 X5', 'G0 Z2.', 'G1 Z-3.', 'G0 Z10.', 'G64']
    """
    chosen = find_dialect(dialect)
    called = bool(chosen.drilling.named)
    if chosen.name not in DRILLING and not called:
        known = ", ".join(sorted([*DRILLING, "siemens"]))
        raise ProgramError(
            f"the cycles of dialect '{chosen.name}' cannot be written out",
            "leave --expand-cycles out, or state the dialect of the program's own control "
            f"(--dialect); known are the cycles of: {known}",
            FilePlace(name),
        )
    begin = source.tell()
    expander = CallExpander if called else _Expander
    judging = expander(name, chosen, start, comments, None, None)
    if called or chosen.drilling.own_group:
        judging.jumps = _finds_jumps(source, JUMPS if called else _JUMPS)
        source.seek(begin)
    digest = judging.walk(source)
    if any(verdict.reason is None for verdict in judging.verdicts):
        source.seek(begin)
        writing = expander(name, chosen, start, comments, target, judging.verdicts)
        if writing.walk(source) != digest:
            raise EmitError(
                f"{name} was changed while it was being read",
                "run the command again when nothing writes to the file",
            )
        places, written = writing.places, writing.written
    else:
        places, written = array("q"), 0
    columns = np.array(places, dtype=np.int64).reshape(-1, 8).T
    findings = _findings(judging.verdicts)
    return Expansion(judging.blocks, judging.holes, written, findings, LineMap(*columns))


def _finds_jumps(source: BinaryIO, jumps: re.Pattern[bytes]) -> bool:
    """Whether a program may come to a block from elsewhere; read to its end."""
    tail = b""
    while piece := source.read(1 << 20):
        if jumps.search(tail + piece):
            return True
        tail = piece[-64:]
    return False


def _findings(verdicts: Sequence[Verdict]) -> tuple[Finding, ...]:
    """What the user should know of the series that were left alone."""
    left = [v for v in verdicts if v.reason is not None]
    found = []
    for verdict in left[:_SHOWN]:
        where = "" if verdict.at == verdict.line else f" (line {verdict.at})"
        text = f"cycles not written out from here on: {verdict.reason}{where}"
        found.append(Finding(verdict.line, text))
    if len(left) > _SHOWN:
        found.append(Finding(None, f"{len(left) - _SHOWN} more series of cycles not written out"))
    return tuple(found)


class _Expander(Walker):
    """Reads a program, and judges or writes its series on the way."""

    def __init__(
        self,
        name: str,
        dialect: Dialect,
        start: Start,
        comments: bool,
        target: BinaryIO | None,
        verdicts: list[Verdict] | None,
    ) -> None:
        super().__init__(name, dialect, start, comments, target, verdicts)
        self.rules = rules_for(dialect.name, start)
        self.series: Series | None = None
        self.dwell_series: list[int] = []
        """Series to be written out whose dwell a later cycle might take."""
        self.spindle: int | None = None
        self.path: PathWords | None = None
        if start.startup:
            startup = parse_line(start.startup.encode("latin-1", "replace"), dialect)
            self._note(startup, 0, sure=True)

    def finish_series(self) -> None:
        """The program ends: so does the series."""
        if self.series is not None:
            self._close(self.series)

    # Complex: what is known before a line acts has to be kept until it has acted.
    def read_line(self, text: bytes, begin: int, number: int, terminator: int) -> None:
        """Take one line; its cycles are noticed before and after it acts."""
        bare = text.removesuffix(b"\r")
        if self.series is None and not _CYCLE.search(bare):
            noted = _NOTED.search(bare) is not None
            faults, inside = self.problem_count, self.inside
            super().read_line(text, begin, number, terminator)
            if noted:
                sure = faults == self.problem_count and not inside
                self._note(parse_line(bare, self.dialect), number, sure=sure)
            return
        block = parse_line(bare, self.dialect)
        before, faults, inside = list(self.state.position), self.problem_count, self.inside
        ended, cycle = self.state.ended, cycle_in_force(self.state, self.dialect)
        super().read_line(text, begin, number, terminator)
        if ended:
            return
        why = str(Reason.NOT_UNDERSTOOD) if faults != self.problem_count else doubt(block)
        if inside or self.inside:
            why = str(Reason.SUBPROGRAM)
        if self.jumps:
            why = why or "the program jumps, and may come to a hole in another way"
        if self.collecting and self.series is None:
            # The structure runs once it is complete; what drills in it is left to the controller.
            if self.dialect.cycles & {*g_codes(block)}:
                self.verdicts.append(Verdict(number, why, number))
            return
        self._note(block, number, sure=why is None)
        if self.rules.borrows_dwell & {*g_codes(block)}:
            states = any(word.letter == self.rules.dwell for word in block.words)
            if not states and not (self.series is not None and self.series.dwells):
                self._borrow(number)
        now = cycle_in_force(self.state, self.dialect)
        moment = Moment(before, self.state, self.path, self.spindle, now)
        if self.series is None:
            if now is None:
                return
            self.series = begin_series(number, moment)
            if cycle is not None:
                why = str(Reason.START_UNKNOWN)  # a cycle from before the program
        place = Place(begin, begin + len(bare), number, len(text) - len(bare), terminator)
        self._follow(self.series, block, bare, moment, why, place)

    def _follow(
        self,
        series: Series,
        block: Block,
        text: bytes,
        moment: Moment,
        why: str | None,
        place: Place,
    ) -> None:
        """One line of a series."""
        if why is not None:
            self._give_up(series, why, place.number)
            if moment.cycle is None:
                self._close(series)
            return
        if self.state.ended:
            # M2 resets the motion, so whether its block makes a hole is not seen afterwards.
            if any(word.letter in "XYZABCUVW" for word in block.words):
                self._give_up(series, str(Reason.OTHER_WORDS), place.number)
            self._close(series)
        elif drills(block, moment, self.dialect):
            self.holes += 1
            series.dwells |= any(word.letter == self.rules.dwell for word in block.words)
            self._drill(series, block, text, moment, place)
        elif moment.cycle is None:
            groups = ("motion", "cycle")
            own = any(self.dialect.groups.get(code) in groups for code in g_codes(block))
            if not own:
                self._give_up(series, str(Reason.NOT_UNDERSTOOD), place.number)
            self._close(series)
        elif not passes(block, self.rules):
            series.broken = f"something else stands between the holes (line {place.number})"
            if self.rules.unmeasured:
                # It may run a program of the builder's, whose positions the cycle in force drills.
                self._give_up(series, "something else stands in the series", place.number)

    def _drill(
        self,
        series: Series,
        block: Block,
        text: bytes,
        moment: Moment,
        place: Place,
    ) -> None:
        """A block that makes a hole: judge it, or write what it was judged to be."""
        if series.reason is not None:
            return
        reason = why_left_alone(series, moment, block, self.rules)
        if len(text) > self.dialect.text.line_limit - ROOM:
            reason = reason or "the block is too long"
        if reason is not None:
            self._give_up(series, reason, place.number)
            return
        call = call_of(series, moment, block, self.rules)
        if isinstance(call, LeftAlone):
            self._give_up(series, call.reason, place.number)
            return
        if self.known is None or self.target is None:
            return
        verdict = self.known[len(self.verdicts)]
        if verdict.reason is not None or verdict.line != series.line:
            return
        lines = write_block(text, block, call, moment, self.rules, self.comments)
        self.replace(place, lines)

    def _give_up(self, series: Series, reason: str, line: int) -> None:
        """Leave a series to the controller; the first reason counts."""
        if series.reason is None:
            series.reason, self.reason_at = reason, line

    def _close(self, series: Series) -> None:
        """The series is over."""
        if series.dwells:
            # A dwell that the controller itself reads replaces those before it.
            self.dwell_series = (
                [*self.dwell_series, len(self.verdicts)] if series.reason is None else []
            )
        self.verdicts.append(Verdict(series.line, series.reason, self.reason_at))
        self.series = None

    def _borrow(self, line: int) -> None:
        """A cycle may take its dwell from those before it: the controller has to read them."""
        for index in self.dwell_series if self.rules.borrows_dwell else ():
            reason = "a later cycle takes its dwell from this one"
            self.verdicts[index] = Verdict(self.verdicts[index].line, reason, line)
        self.dwell_series = []

    def _note(self, block: Block, line: int, *, sure: bool) -> None:
        """Follow the spindle, the words of G64, and calls of what may hold any cycle."""
        sure = sure and doubt(block) is None
        if block.o_word is not None:
            self.spindle = None
        if block.o_word == "call" or any(w.letter == "M" and w.value == 98 for w in block.words):
            self._borrow(line)
        for word in block.words:
            if word.letter == "M" and word.value not in (0, 1, 7, 8, 9, 48, 49):
                self.spindle = int(word.value) if sure and word.value in (3.0, 4.0) else None
        if any(code in (G61, G61_1, G64) for code in g_codes(block)):
            self.path = self._path_words(block) if sure else None

    def _path_words(self, block: Block) -> PathWords | None:
        """The tolerances that a block states; None where it is not certain what they say."""
        words = tuple((w.letter, decimal(w)) for w in block.words if w.letter in "PQ")
        unit = self.state.unit
        if (unit is None and words) or any(number < 0 for _, number in words):
            return None
        return PathWords(words, unit)
