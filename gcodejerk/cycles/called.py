"""Drilling cycles with a name, called at once or behind MCALL, written out (Siemens).

::

    N50 MCALL CYCLE82(40,0,2,-5,,0.5)      N50
    N60 X12 Y5                             N60 X12 Y5
                                           G4 F0.001        at rest over the hole
                                           G9 G0 Z2         the reference plane and its clearance
                                           G9 G1 Z-5        the depth
                                           G4 F0.5
                                           G9 G0 Z40        the retraction plane
    N70 MCALL                              N70

Rule: from one MCALL to the next every block that moves drills, so they are written out together or
not at all; where G1 is in force, it stands behind the moves again.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Decimal

from gcodejerk.axes import AXES
from gcodejerk.cycles.blocks import COMMENT_LENGTH
from gcodejerk.cycles.series import doubt
from gcodejerk.cycles.walk import Place, Verdict, Walker
from gcodejerk.nc.dialects.gcodes import G0, G1, G90
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.named_cycles import arguments_of, certain_call
from gcodejerk.nc.text.block import Block, Name
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.reasons import Reason

CALLED = re.compile(rb"MCALL|CYCLE8", re.IGNORECASE)
JUMPS = re.compile(
    rb"(?<![A-Z0-9_])(?:GOTO[A-Z]?|REPEATB?|FOR|WHILE|LOOP|CASE|IF|PROC)(?![A-Z0-9_])"
    rb"|%_N_[^\n]*\n(?:[^\n]*\n)*?%_N_",
    re.IGNORECASE,
)
"""What may lead to a block from elsewhere than the one in front of it."""
WRITTEN_OUT = frozenset({"CYCLE81", "CYCLE82"})
_POSITION = re.compile(rb"N[0-9]+|G0*[01]|[XYF]=?[-+]?[0-9.]+", re.IGNORECASE)
_STILL = re.compile(rb"N[0-9]+|[FS]=?[0-9.]+|M0*[345789]", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Hole:
    """What a call makes wherever it runs; all along Z, in the program's numbers."""

    top: Decimal
    start: Decimal
    bottom: Decimal
    dwell: Decimal


@dataclass(slots=True)
class _Series:
    """What is in force from MCALL to MCALL."""

    line: int
    hole: Hole | None
    reason: str | None = None


class CallExpander(Walker):
    """Judges or writes calls of cycles."""

    series: _Series | None = None

    def read_line(self, text: bytes, begin: int, number: int, terminator: int) -> None:
        """Take one line; its cycles are noticed before and after it acts."""
        bare = text.removesuffix(b"\r")
        if self.series is None and not CALLED.search(bare):
            super().read_line(text, begin, number, terminator)
            return
        block = parse_line(bare, self.dialect)
        before, faults, inside = self.state.copy(), self.problem_count, self.inside
        super().read_line(text, begin, number, terminator)
        if before.ended:
            return
        why = str(Reason.NOT_UNDERSTOOD) if faults != self.problem_count else doubt(block)
        if inside or self.inside:
            why = str(Reason.SUBPROGRAM)
        if self.jumps:
            why = why or "the program jumps, and may come to a hole in another way"
        place = _place(bare, text, begin, number, terminator)
        self._take(block, bare, before, why, place)

    def finish_series(self) -> None:
        """The program ends without the MCALL that ends the series."""
        if self.series is not None:
            self._give_up(str(Reason.NOT_UNDERSTOOD), self.series.line)
            self._close()

    def _take(
        self, block: Block, text: bytes, before: State, why: str | None, place: Place
    ) -> None:
        """One line that calls a cycle, or stands between two MCALL."""
        effects = [self.dialect.names.get(name.name, "flow") for name in block.names]
        modal = "modal cycle" in effects
        ends = modal and len(effects) == 1 and _is_bare(block)
        if self.series is not None and ends and why is None:
            self._write(place, _head(text, block, self.comments), hole=False)
            self._close()
        elif modal:
            if self.series is not None:
                # Where one of two is left to the control, its end would be missing.
                why = why or "another cycle is called before MCALL alone"
                self._give_up(why, place.number)
                self._close()
            if len(effects) > 1:
                self._begin(block, text, before, why, place)
        elif self.series is not None:
            self._within(self.series, block, text, before, why, place)
        elif "cycle" in effects:
            self._once(block, text, before, why, place)

    def _begin(
        self, block: Block, text: bytes, before: State, why: str | None, place: Place
    ) -> None:
        """MCALL CYCLE81(..): nothing moves yet."""
        found = self._hole_of(block, block.names[-1], before)
        if len(block.names) != 2:
            found = str(Reason.NOT_UNDERSTOOD)
        hole = found if isinstance(found, Hole) else None
        self.series = _Series(place.number, hole)
        why = why or (found if isinstance(found, str) else None)
        if why is not None:
            self._give_up(why, place.number)
        self._write(place, _head(text, block, self.comments), hole=False)

    def _within(
        self,
        series: _Series,
        block: Block,
        text: bytes,
        before: State,
        why: str | None,
        place: Place,
    ) -> None:
        """A block between two MCALL: a hole, or one that moves nothing."""
        moves = any(word.letter in AXES for word in block.words)
        self.holes += moves
        why = why or (str(Reason.OTHER_WORDS) if self.state.ended else None)
        if why is None and moves:
            why = _no_hole(block, before, self.state)
        elif why is None and not _moves_nothing(block):
            why = "something else stands between the holes"
        if why is not None:
            self._give_up(why, place.number)
        if moves and series.hole is not None and series.reason is None:
            self._write(place, [text, *self._drilled(series.hole, self.state)])
        if self.state.ended:
            self._close()

    def _once(
        self, block: Block, text: bytes, before: State, why: str | None, place: Place
    ) -> None:
        """CYCLE81(..) in a block of its own."""
        self.holes += 1
        found = self._hole_of(block, block.names[0], before)
        if len(block.names) != 1:
            found = str(Reason.OTHER_WORDS)
        why = why or (found if isinstance(found, str) else None) or _modes(before)
        if why is None and isinstance(found, Hole):
            self._write(place, [*_head(text, block, self.comments), *self._drilled(found, before)])
        self.verdicts.append(Verdict(place.number, why, place.number))

    def _hole_of(self, block: Block, name: Name, before: State) -> Hole | str:
        """What a call makes, or why that is not certain."""
        rules = self.dialect.drilling
        if name.name not in WRITTEN_OUT:
            return f"not every motion of {name.name} is known"
        if not _is_bare(block):
            return str(Reason.OTHER_WORDS)
        values = arguments_of(name, rules)
        if values is None or certain_call(name, before, rules) is None:
            return "its arguments, plane or frame are not certain"
        told = {key: Decimal(repr(value)) for key, value in values.items()}
        zero = Decimal(0)
        if told.get("DTB", zero) < 0:
            return "its dwell counts revolutions"
        surface = told["RFP"]
        bottom = surface - told["DPR"] if told.get("DPR") else told["DP"]
        start = surface + told.get("SDIS", zero)
        return Hole(told["RTP"], start, bottom, told.get("DTB", zero))

    def _drilled(self, hole: Hole, state: State) -> Iterator[bytes]:
        """The lines of a hole where the tool stands."""
        assert self.dialect.writing is not None
        yield self.dialect.writing.standstill
        yield b"G9 G0 Z" + _text(hole.start)
        yield b"G9 G1 Z" + _text(hole.bottom)
        if hole.dwell:
            yield b"G4 F" + _text(hole.dwell)
        yield b"G9 G0 Z" + _text(hole.top)
        if state.motion == G1:
            yield b"G1"

    def _write(self, place: Place, lines: list[bytes], *, hole: bool = True) -> None:
        """Replace a block, where the first walk has found its series certain."""
        if self.known is None or self.target is None:
            return
        if self.known[len(self.verdicts)].reason is None:
            self.replace(place, lines, hole=hole)

    def _give_up(self, reason: str, line: int) -> None:
        """Leave a series to the controller; the first reason counts."""
        if self.series is not None and self.series.reason is None:
            self.series.reason, self.reason_at = reason, line

    def _close(self) -> None:
        """The series is over."""
        assert self.series is not None
        self.verdicts.append(Verdict(self.series.line, self.series.reason, self.reason_at))
        self.series = None


def _place(bare: bytes, text: bytes, begin: int, number: int, terminator: int) -> Place:
    """Where a line stands."""
    return Place(begin, begin + len(bare), number, len(text) - len(bare), terminator)


def _is_bare(block: Block) -> bool:
    """Whether a block holds nothing beside its names and its number."""
    return all(word.letter == "N" for word in block.words)


def _moves_nothing(block: Block) -> bool:
    """Whether a block changes nothing that a hole rests on: F, S, spindle and coolant."""
    return not block.names and all(_STILL.fullmatch(word.text) for word in block.words)


def _modes(state: State) -> str | None:
    """Why a hole could not be told in blocks of G0 and G1."""
    if state.distance != G90:
        return "G91, or the distance mode is not known"
    if state.motion not in (G0, G1):
        return "whether G0 or G1 is in force behind it is not known"
    if state.path not in (61, 64):
        return str(Reason.PATH_UNKNOWN)
    return None if state.feed_mode in (94, 95) and state.feed > 0.0 else str(Reason.FEED_UNKNOWN)


def _no_hole(block: Block, before: State, after: State) -> str | None:
    """Why it is not certain that a block goes to a hole and drills it."""
    if block.names or not all(_POSITION.fullmatch(word.text) for word in block.words):
        return str(Reason.OTHER_WORDS)
    if before.modal_cycle is None or after.modal_cycle is None:
        return str(Reason.NOT_UNDERSTOOD)
    ways = [(before.position[k], after.position[k]) for k in range(2)]
    if not any(a == a and b == b and a != b for a, b in ways):
        return "whether a block that may not move drills is not known"
    return _modes(after)


def _head(text: bytes, block: Block, comments: bool) -> list[bytes]:
    """The number of a block and its comment; and a line that names it."""
    kept = [word.text for word in block.words]
    kept += [text[begin:end] for begin, end in block.comments]
    head = [b" ".join(kept)] if kept else []
    if not comments:
        return head
    shown = b" ".join(text[: block.comments[0][0] if block.comments else None].split())
    shown = bytes(c if 32 <= c < 127 else ord("?") for c in shown)
    return [(b"; gcodejerk: " + shown)[:COMMENT_LENGTH], *head]


def _text(number: Decimal) -> bytes:
    """A number without exponent."""
    text = format(number if number else abs(number), "f")
    return (text.rstrip("0").rstrip(".") if "." in text else text).encode()
