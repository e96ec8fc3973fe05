"""LinuxCNC's loops, branches and calls written out, structure by structure.

Rule 1: a structure of the main program is written out whole, or stays as it is; one stays where
anything that decides its way is not known.
Rule 2: outside of subprograms every block is written as it stands, with its variables and what sets
them. In a subprogram, whose variables are its own, `spelling` writes the numbers.
Rule 3: what LinuxCNC keeps of a jump acts on later structures. Where some stay, those in which a
jump has run stay too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.o_words import END, NEXT, Exits, Passes, TooLongError
from gcodejerk.nc.flow.structures import Collector, Node, plain_name
from gcodejerk.nc.interpreter.expressions import variable_name
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.runner import Runner
from gcodejerk.nc.reader import Reader
from gcodejerk.nc.text.block import ELSEWHERE, Block, Line
from gcodejerk.start import Start
from gcodejerk.unrolling.pieces import LeftAloneError, Piece, Written, named
from gcodejerk.unrolling.spelling import spelled

ROOM = 16
"""Characters by which a line may become longer afterwards."""
_STEPS = 10
"""Lines of flow that may run, for each that may be written."""
_STATE = frozenset((70.0, 71.0, 72.0, 73.0))
"""M codes that save and restore modes, for each subprogram by itself."""
_FANUC = frozenset((97.0, 98.0, 99.0))
NOT_KNOWN = "how it goes on depends on what is not known"
JUMPED = "LinuxCNC keeps its break, continue or return for other loops, which stay as they are"


class _UnknownError(Exception):
    """A condition or a count is not known."""


@dataclass(slots=True)
class _Structure(Piece):
    """A structure of the main program."""

    jumped: bool = False
    """A break, continue or return has run in it."""


class ExactPasses(Passes):
    """Runs structures as the base does, or writes one out: then nothing may be in doubt."""

    comments = True

    def __init__(self, runner: Runner, files: Mapping[str, bytes], most: int) -> None:
        super().__init__(runner, files)
        self.jumps = True
        """Structures in which a jump runs may be written out."""
        self.most = self.left = most
        """Lines that may be written, and those of them that are left."""
        self.trace: list[Written] = []
        self.jumped = False
        self._exactly = False
        self._steps = 0
        self._loops: list[str] = []
        """Labels of the ``while`` and ``do`` of this subprogram that run now."""
        self._origin: Line | None = None
        """Line of the program that has called what stands in another file."""

    @property
    def lost(self) -> bool:
        """Whether programs run that are not followed."""
        return self._lost

    def write(self, node: Node) -> tuple[list[Written], bool]:
        """Write a structure or a call out; its lines, and whether the program ends in it.

        Raises
        ------
        LeftAloneError
            It cannot be; then what is kept of jumps is as it was, the runner's state is not.
        """
        kept = self._broken, self._continued, set(self._stale), set(self._dos), self._lost
        self.trace, self.jumped, self._exactly, self._steps = [], False, True, 0
        self._loops, self._origin = [], None
        left, self.runner.left = self.runner.left, self._leave
        try:
            exits = self._node(node, self.runner.state)
            after, ended = exits.pop(NEXT, None), exits.pop(END, None)
            state = after or ended
            if exits or state is None or (after is not None and ended is not None):
                raise LeftAloneError("it ends otherwise than by its end", node.line.number)
            self.jumped |= self._broken and not kept[0]
            if self.jumped and not self.jumps:
                raise LeftAloneError(JUMPED, node.line.number)
        except (LeftAloneError, TooLongError) as error:
            self._broken, self._continued, self._stale, self._dos, self._lost = kept
            self._depth = 0
            if isinstance(error, TooLongError):
                raise LeftAloneError("calls within calls, or M99", node.line.number) from None
            raise
        finally:
            self._exactly, self.runner.left = False, left
        self.runner.state = state
        self.left -= len(self.trace)
        return self.trace, after is None

    def doubt(self, node: Node) -> None:
        """Forget what a structure that stays may set, and take for run what jumps it has."""
        state, dialect = self.runner.state, self.runner.dialect
        if node.kind in ("call", "return", "break", "continue"):
            self._broken = self._continued = True
        names = {variable_name(name.encode("latin-1")) for name in node.line.block.assigns}
        codes = {word.value for word in node.line.block.words if word.letter == "M"}
        groups = {dialect.m_groups.get(int(code), "user") for code in codes if code is not None}
        if node.kind == "call" or "" in names or "user" in groups or codes & {6.0, None, *_FANUC}:
            state.forget_variables()
        state.forget_variables([name for name in state.variables if name not in names])
        for _, body in node.branches:
            for inner in body:
                self.doubt(inner)

    def _leave(self) -> None:
        raise LeftAloneError("a program runs that is not followed", self._at)

    @property
    def exhausted(self) -> bool:
        """Whether no more structures are followed."""
        return not self._exactly and super().exhausted

    def _same(self, before: State, behind: State) -> bool:
        return not self._exactly and super()._same(before, behind)

    def _count(self) -> None:
        if not self._exactly:
            super()._count()
            return
        self._steps += 1
        if self._steps > _STEPS * self.most:
            raise LeftAloneError(f"it runs more than {_STEPS * self.most} lines", self._at)

    def _uncertain(self) -> None:
        if self._exactly:
            raise LeftAloneError(NOT_KNOWN, self._at)
        super()._uncertain()

    def _known(self, condition: bytes | None, state: State) -> float | None:
        value = super()._known(condition, state)
        if self._exactly and value is None:
            raise _UnknownError
        return value

    def _node(self, node: Node, state: State) -> Exits:
        if not self._exactly:
            return super()._node(node, state)
        self._at = node.line.number
        if node.kind in ("return", "break", "continue"):
            self.jumped = True
            if not self.jumps:
                raise LeftAloneError(JUMPED, self._at)
            if node.kind != "return" and node.name not in self._loops:
                raise LeftAloneError(f"{node.kind} leads out of no while or do", self._at)
        loop = node.kind in ("while", "do")
        self._loops += [node.name] if loop else []
        try:
            return super()._node(node, state)
        except _UnknownError:
            raise LeftAloneError(NOT_KNOWN, node.line.number) from None
        finally:
            if loop:
                self._loops.pop()

    def _pass(self, node: Node, state: State, exits: Exits) -> tuple[State | None, State | None]:
        back, broken = super()._pass(node, state, exits)
        if self._exactly and back is not None and broken is not None:
            raise LeftAloneError("LinuxCNC may begin it again behind a continue", node.line.number)
        return back, broken

    def _line(self, node: Node, state: State) -> Exits:
        block = node.line.block
        silent = not (block.words or block.assigns or block.names or block.problem)
        if not self._exactly:
            return {NEXT: state} if silent else super()._line(node, state)
        self._count()
        self._refuse(block)
        self._take(node.line, state)
        if silent:
            return {NEXT: state}
        runner = self.runner
        runner.state = state
        ended = runner.run(node.line, visit=True)
        if ended is None:
            return {NEXT: runner.state}
        if runner.state is not ended:
            raise LeftAloneError("the operator decides whether the program ends", self._at)
        return {END: ended}

    def _refuse(self, block: Block) -> None:
        """Leave a structure alone for a block that is not the same in another place."""
        codes = {word.value for word in block.words if word.letter == "M"}
        if block.problem is not None:
            raise LeftAloneError("a line is not understood", self._at)
        if self._depth and codes & _STATE:
            raise LeftAloneError("a subprogram saves or restores modes (M70 to M73)", self._at)
        if codes & _FANUC:
            raise LeftAloneError("M97, M98 and M99 are not written out here", self._at)

    def _take(self, line: Line, state: State) -> None:
        """Write a block."""
        rules = self.runner.dialect
        text: bytes | None = line.text
        if self._depth:
            text = spelled(line, state.variables, rules.arithmetic)
        if text is None:
            return
        if text is not line.text and len(text) > rules.text.line_limit - ROOM:
            raise LeftAloneError("with its numbers a block is too long", self._at)
        if len(self.trace) >= self.left:
            raise LeftAloneError(
                f"more than {self.most} lines (program.unrolled_lines of the machine file)",
                self._at,
            )
        origin = line if line.number < ELSEWHERE or self._origin is None else self._origin
        self.trace.append(Written(text, origin))

    def _settle(self, node: Node, state: State, test_first: bool) -> Exits:
        if self._exactly:
            raise LeftAloneError("how often it runs is not certain", node.line.number)
        return super()._settle(node, state, test_first)

    def _call(self, node: Node, state: State) -> Exits:
        if not self._exactly:
            return super()._call(node, state)
        name = plain_name(node.line.block.o_name)
        if name is None or self._sub(name) is None:
            raise LeftAloneError(
                "the subprogram does not stand in front of it, in this file or that of its name in "
                "--subprograms",
                node.line.number,
            )
        loops, origin, self._loops = self._loops, self._origin, []
        if node.line.number < ELSEWHERE:
            self._origin = node.line
        try:
            return super()._call(node, state)
        finally:
            self._loops, self._origin = loops, origin


class OWordUnroller(Reader):
    """Reads a program, and writes its structures out on the way."""

    def __init__(
        self, name: str, dialect: Dialect, start: Start, most: int, comments: bool, *, jumps: bool
    ) -> None:
        super().__init__(name, dialect, start)
        self.passes: ExactPasses = ExactPasses(self.runner, start.subprograms, most)
        self.passes.jumps = jumps
        self.comments = comments
        self.structures = 0
        """Structures and calls of the main program."""
        self.left: list[tuple[int, LeftAloneError]] = []
        """Those that stay: their first line, and why."""
        self._pieces: list[_Structure] = []
        self._subs: list[Piece] = []
        self._kept = False
        """Lines of flow stay as they are that nobody follows."""
        self._structure = Collector(comments=True)
        self._first: Line | None = None

    @property
    def straight(self) -> bool:
        """Whether nothing stays that leads elsewhere."""
        return not (self.left or self._kept or self.passes.lost)

    @property
    def jumped(self) -> bool:
        """Whether jumps were written out, of which LinuxCNC keeps something for what stays."""
        return not self.straight and any(piece.jumped for piece in self._pieces)

    def pieces(self) -> list[Piece]:
        """What is to be replaced, in the order of the file; behind its end."""
        found: list[Piece] = [*self._pieces]
        if found and self.straight and not self.problem_count:
            # A code that nobody knows may call them: G71 Q100 runs o100.
            found += self._subs
        return sorted(found, key=lambda piece: piece.first.begin)

    def written(self, pieces: list[Piece]) -> int:
        """How many of these stand for structures, and not for definitions of subprograms."""
        return sum(isinstance(piece, _Structure) for piece in pieces)

    def _collect(self, line: Line, counted: bool = False) -> None:
        if not counted:
            self._count(line)
        if not self._structure:
            self._first = line
        try:
            node = self._structure.add(line)
        except ValueError:
            self._replay()
            return
        if node is None:
            return
        self._structure.take()
        assert self._first is not None
        if node.kind == "sub":
            self.passes.define(node)
            self._subs.append(Piece(self._first, line, self._name(self._first)))
        else:
            self._write(node, self._first, line)

    def _pass(self, node: Node) -> None:
        self._write(node, node.line, node.line)

    def _write(self, node: Node, first: Line, last: Line) -> None:
        """Write a structure out, or pass over it as the base does."""
        self.structures += 1
        before = self.runner.state.copy()
        try:
            lines, ended = self.passes.write(node)
        except LeftAloneError as error:
            self.left.append((first.number, error))
            self.runner.state = before
            super()._pass(node)
            self.passes.doubt(node)
            return
        jumped = self.passes.jumped
        self._pieces.append(_Structure(first, last, self._name(first) + lines, jumped))
        if ended:
            self.runner.executor.end()

    def _name(self, line: Line) -> list[Written]:
        return [Written(named(line.text, (b"(", b")")), line)] if self.comments else []

    def _o_word(self, line: Line, first: bool) -> None:
        told = self.structures
        super()._o_word(line, first)
        if told == self.structures and not (line.block.o_word == "" and first):
            self._kept = True
            self.state.forget_variables()

    def _replay(self) -> None:
        self._kept = True
        if self._first is not None:
            reason = "it is not nested as LinuxCNC demands, is too long, or has words beside O"
            self.left.append((self._first.number, LeftAloneError(reason, self._first.number)))
        super()._replay()
        self.state.forget_variables()
