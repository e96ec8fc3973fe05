"""Programs of macro B and Siemens written out: the blocks of the main program as they run.

Rule 1: a program is written out whole or not at all, for a jump may lead anywhere in it. Up to its
first line of flow it stays as it is.
Rule 2: a block is written as it stands; where it names variables of a subprogram's own, `wording`
writes their numbers. A label is left out, and an N that has stood already: nothing leads to them
any more.
Rule 3: what a counting loop sets, an assignment sets in its place.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.elsewhere import Elsewhere
from gcodejerk.nc.flow.following import Follower, Ways
from gcodejerk.nc.flow.macro_b import NotFollowedError
from gcodejerk.nc.flow.script import LOST, Op, Script, Unit
from gcodejerk.nc.flow.subprograms import Calls
from gcodejerk.nc.following_reader import FollowingReader
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.runner import Runner
from gcodejerk.nc.interpreter.variables import is_local, number_text
from gcodejerk.nc.text.block import ELSEWHERE, Line
from gcodejerk.start import Start
from gcodejerk.unrolling.pieces import LeftAloneError, Piece, Written, named
from gcodejerk.unrolling.wording import worded

ROOM = 16
"""Characters by which a line may become longer afterwards."""
_STEPS = 10
"""Lines that may run, for each that may be written."""
NOT_KNOWN = "how it goes on depends on what is not known"
NOT_TAKEN = "what it calls does not take such arguments, or repeats"
NOT_HERE = "what it calls is neither in this file nor in --subprograms"
OPEN_END = "the main program has no end in front of the next one"
NOT_FOLLOWED = "it jumps, loops or calls in a way that is not followed (docs/flow.md)"
_LABEL = re.compile(rb"[A-Za-z_][A-Za-z_][A-Za-z0-9_]*[ \t]*:(?!=)[ \t]*")
_REMARK = re.compile(rb"\([^()]*\)?")
_RETURNS = (17.0, 99.0)
_MODAL_MACROS = frozenset((660, 661))


class ExactFollower(Follower):
    """Runs the main program of a file, and writes its blocks down; nothing may be in doubt."""

    def __init__(self, runner: Runner, script: Script, most: int) -> None:
        super().__init__(runner, script)
        self.most = most
        self.most_steps = _STEPS * most + len(script.lines)
        self.trace: list[Written] = []
        self._at = 1
        self._scopes = 0
        """Calls that run whose subprograms have variables of their own."""
        self._origin: Line | None = None
        self.called: set[int] = set()
        """First lines of the subprograms that have run."""
        self.reached: set[int] = set()
        """Lines of flow that have run."""
        self.stay: dict[int, LeftAloneError] = {}
        """Calls among them that stay: what they call is not here, or not called as it asks for."""
        self.open_end = False
        """The main program runs beyond its last line."""
        self._seen: set[float] = set()
        """N that stand already."""

    @property
    def lost(self) -> bool:
        """Whether programs run that are not followed."""
        return self._lost

    def write(self) -> Unit:
        """Write the main program down, in `trace`.

        Raises
        ------
        LeftAloneError
            Something is not certain.
        """
        mains = [unit for unit in self.script.units if unit.main and unit.runs]
        if len(mains) != 1:
            raise LeftAloneError("the file holds more than one main program, or none", 1)
        runner, unit = self.runner, mains[0]
        runner.executor.jumps_known = True
        runner.left = self._leave
        try:
            ways = self._run(unit, unit.first, unit.last, runner.state.copy())
        except NotFollowedError:
            raise LeftAloneError(NOT_FOLLOWED, self._at) from None
        self.open_end = ways.through is not None
        return unit

    def _same(self, before: State, behind: State) -> bool:
        return False

    def _split(self, ways: Ways, at: int, state: State) -> None:
        raise LeftAloneError(NOT_KNOWN, self._at)

    def _line(self, unit: Unit, at: int, state: State, ways: Ways) -> None:
        line = self.script.lines[at]
        self._at = line.number if line.number < ELSEWHERE else self._at
        if self._steps >= self.most_steps:
            raise LeftAloneError(f"it runs more than {self.most_steps} lines", self._at)
        if at in self.script.ops:
            self.reached.add(at)
        super()._line(unit, at, state, ways)

    def _go(self, at: int, target: int, state: State, ways: Ways) -> None:
        if target == LOST:
            raise NotFollowedError
        ways.go(target, state)

    def _set(self, at: int, op: Op, state: State, ways: Ways) -> None:
        value = self._value(op.condition, state)
        if value != value:
            raise LeftAloneError(NOT_KNOWN, self._at)
        if value != 0.0:
            assert op.line is not None
            block = op.line.block
            pairs = zip(block.assigns, block.assigned, strict=True)
            text = b" ".join(b"#" + name.encode() + b"=" + value for name, value in pairs)
            before = len(self.trace)
            self._take(Line(text, op.line.begin, op.line.number, op.line.terminator, block), state)
            remarks = _REMARK.findall(self.script.lines[at].text)
            if remarks and len(self.trace) > before:
                # #3000 and #3006 show theirs to the operator.
                last = self.trace[-1]
                self.trace[-1] = Written(b" ".join([last.text, *remarks]), last.line)
        super()._set(at, op, state, ways)

    def _count(self, at: int, op: Op, state: State, ways: Ways) -> None:
        super()._count(at, op, state, ways)
        value = state.variables.get(op.name)
        if value is None:
            raise LeftAloneError(NOT_KNOWN, self._at)
        if not (self._scopes and is_local(op.name, self.runner.dialect.arithmetic)):
            self._write(op.name.encode() + b"=" + number_text(value), self.script.lines[at])

    def _call(self, unit: Unit, at: int, op: Op, state: State, ways: Ways) -> None:
        line, sub = self.script.lines[at], self.script.called(op.name)
        if sub is not None and sub.saves:
            raise LeftAloneError("a subprogram gives back modes (SAVE)", self._at)
        if sub is not None:
            self.called.add(sub.first)
        before, scopes = self._origin, self._scopes
        if line.number < ELSEWHERE:
            self._origin = line
        self._scopes += op.scoped
        super()._call(unit, at, op, state, ways)
        self._origin, self._scopes = before, scopes

    def _block(self, unit: Unit, at: int, line: Line, state: State, ways: Ways) -> None:
        block, dialect = line.block, self.runner.dialect
        self._note_call(at, line)
        if block.problem is not None:
            raise LeftAloneError("a line is not understood", self._at)
        codes = {round((w.value or 0.0) * 10) for w in block.words if w.letter == "G"}
        if codes & _MODAL_MACROS:
            raise LeftAloneError("G66 calls a macro behind every move", self._at)
        if codes & dialect.contours:
            raise LeftAloneError("a cycle refers to blocks by their N", self._at)
        ends = self._is_named and not self._calls
        if any(w.letter == "M" and w.value in _RETURNS for w in block.words) and not ends:
            beside = any(word.letter not in "NM" for word in block.words)
            if beside or block.assigns or block.block_delete:
                raise LeftAloneError("words stand beside a return", self._at)
        else:
            self._take(line, state)
        super()._block(unit, at, line, state, ways)

    def _note_call(self, at: int, line: Line) -> None:
        """Note a call that stays, by its line of flow or, of Siemens, by an unknown name or L."""
        op = self.script.ops.get(at)
        if op is not None or (self._is_named and self._calls_elsewhere(line)):
            here = op is not None and self.script.called(op.name) is not None
            self.stay[at] = LeftAloneError(NOT_TAKEN if here else NOT_HERE, self._at)

    def _return(self, unit: Unit, at: int, state: State, ways: Ways) -> None:
        if not self._calls and not self._is_named:
            raise LeftAloneError("M99 begins the program again", self._at)
        if not self._calls and at in self.script.ops:
            self._take(self.script.lines[at], state)
        super()._return(unit, at, state, ways)

    def _take(self, line: Line, state: State) -> None:
        """Write a block."""
        text: bytes | None = line.text
        if self._scopes:
            if self.script.called(self._called(line)) is None and self._calls_by_number(line):
                raise LeftAloneError("a macro calls a program that is not here", self._at)
            text = worded(line, state, self.runner.dialect, self.runner.executor.declared)
        if text is not None:
            self._write(self._unnumbered(line, text), line)

    def _calls_by_number(self, line: Line) -> bool:
        """Whether a block calls a program, which may share the macro's variables."""
        codes = {(word.letter, word.value) for word in line.block.words}
        return bool(codes & {("M", 98.0), ("G", 65.0), ("M", 97.0)})

    def _called(self, line: Line) -> str:
        return next((f"{w.value:.0f}" for w in line.block.words if w.letter == "P" and w.value), "")

    def _unnumbered(self, line: Line, text: bytes) -> bytes:
        """Without what jumps have led to: its label, and its N where that has stood already."""
        lead, block = 0, line.block
        if block.words and block.words[0].letter == "N" and text.startswith(line.text[:1]):
            lead = len(text) - len(text.lstrip(b" \t/")) if text is not line.text else 0
            begin = text.upper().find(b"N")
            lead = begin + len(block.words[0].text)
            number = block.words[0].value or 0.0
            if number in self._seen:
                text = text[:begin] + text[lead:].lstrip(b" \t")
                lead = begin
            self._seen.add(number)
        if any(not name.name for name in block.names):
            at = lead + len(text[lead:]) - len(text[lead:].lstrip(b" \t"))
            match = _LABEL.match(text, at)
            text = text[:at] + text[match.end() :] if match else text
        return text

    def _write(self, text: bytes, line: Line) -> None:
        """Write a line."""
        if not text.strip(b" \t"):
            return
        if text is not line.text and len(text) > self.runner.dialect.text.line_limit - ROOM:
            raise LeftAloneError("with its numbers a block is too long", self._at)
        if len(self.trace) >= self.most:
            reason = f"more than {self.most} lines (program.unrolled_lines of the machine file)"
            raise LeftAloneError(reason, self._at)
        origin = line if line.number < ELSEWHERE or self._origin is None else self._origin
        self.trace.append(Written(text, origin))


class ScriptUnroller(FollowingReader):
    """Collects a program, and writes it out."""

    def __init__(
        self,
        name: str,
        dialect: Dialect,
        start: Start,
        elsewhere: Elsewhere,
        most: int,
        comments: bool,
    ) -> None:
        super().__init__(name, dialect, start, _no_calls, elsewhere)
        self.most, self.comments = most, comments
        self.left: list[tuple[int, LeftAloneError]] = []
        self.structures = self._calls_left = 0
        self.straight = True
        """Nothing stays that leads to what is here."""
        self.jumped = False
        self._piece: Piece | None = None

    def pieces(self) -> list[Piece]:
        """What is to be replaced; behind the file's end."""
        return [] if self._piece is None else [self._piece]

    def written(self, pieces: list[Piece]) -> int:
        """How many loops, branches, jumps and calls these pieces stand for."""
        return self.structures - self._calls_left if pieces else 0

    def finish(self) -> None:
        """Write everything out."""
        self.runner.elsewhere = self._elsewhere.places
        try:
            script = self.script()
            self.structures = sum(_decides(op) for op in script.ops.values())
            exact = ExactFollower(self.runner, script, self.most)
            if self.structures:
                unit = exact.write()
                self.structures = sum(_decides(script.ops[at]) for at in exact.reached)
                self.structures += len(exact.stay.keys() - script.ops.keys())
                self._calls_left = len(exact.stay)
                if self.structures > self._calls_left:
                    self._piece = self._made(script, unit, exact)
                self.left += [(error.line, error) for error in exact.stay.values()]
                self.straight = all(error.reason == NOT_HERE for _, error in self.left)
        except NotFollowedError:
            self._stays(LeftAloneError(NOT_FOLLOWED, 1))
        except LeftAloneError as error:
            self._stays(error)
        self._finish_log()

    def _stays(self, error: LeftAloneError) -> None:
        """Leave the program as it is."""
        self.straight = False
        self.left.append((error.line, error))

    def _made(self, script: Script, unit: Unit, exact: ExactFollower) -> Piece | None:
        """What stands in the place of the program behind its first blocks."""
        done = 0
        for at in range(unit.first, unit.last):
            line = script.lines[at]
            head = line.block.percent or line.block.o_word is not None
            if at not in script.ops and head:
                continue
            plain = at not in script.ops or at in exact.stay
            same = plain and done < len(exact.trace)
            if not (same and exact.trace[done].text is line.text):
                break
            done += 1
        else:
            return None
        end = unit.last if self._keeps(script, unit, exact) else len(script.lines)
        last = [each for each in script.lines[at:end] if each.number < ELSEWHERE][-1]
        writing = self.dialect.writing
        marks = (b"(", b")") if writing is None else writing.comment
        note = [Written(named(line.text, marks), line)] if self.comments else []
        return Piece(line, last, note + exact.trace[done:])

    @staticmethod
    def _keeps(script: Script, unit: Unit, exact: ExactFollower) -> bool:
        """Whether what stands behind the main program stays: something there may be called yet."""
        behind = [
            each.first
            for each in script.units
            if each.first >= unit.last and script.lines[each.first].number < ELSEWHERE
        ]
        kept = exact.lost or not exact.called.issuperset(behind)
        if kept and behind and exact.open_end:
            raise LeftAloneError(OPEN_END, script.lines[unit.last - 1].number)
        return kept


def _decides(op: Op) -> bool:
    """Whether a line of flow is one that a user would count: a loop, a branch, a jump, a call."""
    return op.kind not in ("jump", "endfor") or op.condition is not None or op.name == "goto"


def _no_calls(runner: Runner) -> Calls:
    """Nothing is read line after line here."""
    raise NotFollowedError
