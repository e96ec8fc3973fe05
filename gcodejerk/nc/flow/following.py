"""Running a `Script`: line after line, pass by pass, as far as every decision is known.

Rule 1: as long as one line follows for certain, the program runs as the control would run it. Where
it is not known which of two lines follows, both ways run, the earlier lines first; where they meet
again, what they do not share is unknown.

Rule 2: while more than one way is open, a line that is reached again with something new runs with
what both times have in common; the `PASSES`-th time, with nothing known. So it ends.

Rule 3: what costs too much (`MOST_STEPS`), jumps to a place that nobody knows, or leaves a
subprogram otherwise than by its end, is not followed, and then nothing of the file is:
`NotFollowedError`.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass, field

from gcodejerk.nc.flow.macro_b import NotFollowedError
from gcodejerk.nc.flow.script import LOST, Op, Script, Unit
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.nc.interpreter.modal import NAN, State, agree, join
from gcodejerk.nc.interpreter.operations import VACANT
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.runner import Runner
from gcodejerk.nc.interpreter.variables import converted, is_local, reads_feed
from gcodejerk.nc.text.block import Block, Line

MOST_STEPS = 50_000
"""Lines that are run more than once, over the whole file."""
MOST_CALLS = 8
"""Calls within calls."""
PASSES = 3
_RETURNS = (17.0, 99.0)
_ENDS = (2.0, 17.0, 30.0, 99.0)


@dataclass(slots=True)
class Ways:
    """Where states wait: by the line that follows, and at the ways out."""

    waiting: dict[int, State] = field(default_factory=dict)
    order: list[int] = field(default_factory=list)
    seen: dict[int, tuple[State, int]] = field(default_factory=dict)
    """Line -> what was known when it last ran while more than one way was open; how often."""
    stood: dict[int, State] = field(default_factory=dict)
    """Line -> what was known when a jump back last led to it."""
    returned: State | None = None
    through: State | None = None
    """Behind the last line of a part."""

    def go(self, at: int, state: State) -> None:
        """Let a state wait in front of a line."""
        if at in self.waiting:
            self.waiting[at] = join(self.waiting[at], state)
        else:
            self.waiting[at] = state
            heapq.heappush(self.order, at)

    def take(self) -> tuple[int, State]:
        """Go on with the earliest line."""
        at = heapq.heappop(self.order)
        return at, self.waiting.pop(at)


def _entered(script: Script) -> frozenset[int]:
    """Lines that something leads to besides the line above."""
    units = {unit.first for unit in script.units}
    ways = {to for at, op in script.ops.items() for to in (op.yes, op.no) if to != at + 1}
    computed = any(op.kind == "computed" for op in script.ops.values())
    return frozenset(units | ways | set(script.numbers.values() if computed else ()))


def _heads(script: Script) -> frozenset[int]:
    """Lines that something leads back to: who goes round comes through one of them."""
    heads = {unit.first for unit in script.units}
    for at, op in script.ops.items():
        if op.kind == "computed":
            heads.update(script.numbers.values())
        heads.update(target for target in (op.yes, op.no) if LOST < target <= at)
    return frozenset(heads)


def _only_names(block: Block) -> bool:
    """Whether the first line of a program does no more; ``%PART G71`` of Heidenhain does."""
    says = any(word.letter == "G" for word in block.words)
    return block.o_word is not None or (block.percent and not says)


def _begins(block: Block) -> bool:
    """Whether a line says what a subprogram is given."""
    return any(name.name == "PROC" for name in block.names)


class Follower:
    """Runs the programs of a file."""

    def __init__(self, runner: Runner, script: Script) -> None:
        self.runner, self.script = runner, script
        self.most_steps = MOST_STEPS + len(script.lines)
        self._steps = 0
        self._lost = False
        """Programs have run that are not followed, which may call those of the file."""
        self._calls: list[Unit] = []
        self._heads = _heads(script)
        self._entered = _entered(script)
        self.ended: State | None = None
        self.spoiled: list[tuple[int, int]] = []
        """Lines of which not every pass is known."""

    def follow(self) -> None:
        """Run all programs of the file, each from the start.

        Raises
        ------
        NotFollowedError
        """
        runner = self.runner
        runner.executor.jumps_known = True
        runner.left = self._leave
        start = behind = runner.state.copy()
        for k, unit in enumerate(unit for unit in self.script.units if unit.main):
            runner.log.feed_event(USES_FEED)
            ways = self._run(unit, unit.first, unit.last, start.copy())
            if k == 0 and ways.through is not None:
                behind = ways.through
        runner.log.feed_event(USES_FEED)
        runner.state = behind
        if self._lost:
            self.spoiled = [
                (self.script.lines[unit.first].number, self.script.lines[unit.last - 1].number)
                for unit in self.script.units
                if not unit.main
            ]
            for first, last in self.spoiled:
                runner.log.visits.spoil(first, last)

    def _leave(self) -> None:
        self._lost = True

    def _run(self, unit: Unit, first: int, last: int, state: State, begin: int = LOST) -> Ways:
        """Run lines first:last of a unit, from `begin` or the first, until nothing is left to run.

        A jump out of them is not followed.
        """
        ways = Ways()
        ways.go(first if begin == LOST else begin, state)
        while ways.order:
            at, state = ways.take()
            if at == last:
                ways.through = state if ways.through is None else join(ways.through, state)
                continue
            if not first <= at < last:
                raise NotFollowedError
            if ways.order or at in ways.seen:
                self.runner.log.feed_event(USES_FEED)
                known = self._widened(ways, at, state) if at in self._heads else state
                if known is None:
                    continue
                state = known
            if not ways.order:
                ways.seen.clear()  # what is known now holds on every way that is left
            self._line(unit, at, state, ways)
        return ways

    def _widened(self, ways: Ways, at: int, state: State) -> State | None:
        """What is known in front of a line on all ways; None where nothing about it is new."""
        if at not in ways.seen:
            ways.seen[at] = (state.copy(), 1)
            return state
        before, times = ways.seen[at]
        wider = join(before, state)
        if agree(wider, before):
            return None
        if times >= PASSES:
            wider.forget()
            if agree(wider, before):
                return None
        ways.seen[at] = (wider.copy(), times + 1)
        return wider

    def _line(self, unit: Unit, at: int, state: State, ways: Ways) -> None:
        """Run one line, and see where it leads."""
        self._steps += 1
        if self._steps > self.most_steps:
            raise NotFollowedError
        line, op = self.script.lines[at], self.script.ops.get(at)
        block = line.block
        if op is None:
            if (at == unit.first and _only_names(block)) or (self._calls and _begins(block)):
                ways.go(at + 1, state)
            else:
                self._block(unit, at, line, state, ways)
            return
        self.runner.log.visits.add(line.number, None)
        if reads_feed(block, self.runner.dialect.arithmetic):
            self.runner.log.feed_event(USES_FEED)
        if block.block_delete and op.kind != "call":
            self._split(ways, at + 1, state.copy())
        if op.kind == "jump":
            self._jump(at, op, state, ways)
        elif op.kind == "computed":
            number = self._value(op.condition, state)
            target = LOST
            if number == number and number.is_integer():
                target = self.script.numbers.get((unit.first, int(number)), LOST)
            self._go(at, target, state, ways)
        elif op.kind == "set":
            self._set(at, op, state, ways)
        elif op.kind in ("for", "endfor"):
            self._count(at, op, state, ways)
        elif op.kind == "part":
            self._part(unit, at, op, state, ways)
        elif op.kind == "call":
            self._call(unit, at, op, state, ways)
        else:
            self._return(unit, at, state, ways)

    def _same(self, before: State, behind: State) -> bool:
        """Whether a pass has changed nothing, so that every further pass is the same."""
        return agree(before, behind)

    def _split(self, ways: Ways, at: int, state: State) -> None:
        """Open another way."""
        self.runner.log.feed_event(USES_FEED)
        ways.go(at, state)

    def _value(self, text: bytes | None, state: State) -> float:
        """Compute a number; NaN where it is not known."""
        if text is None:
            return NAN
        value = evaluate(text, state.variables, self.runner.dialect.arithmetic)
        return NAN if value == VACANT else value

    def _go(self, at: int, target: int, state: State, ways: Ways) -> None:
        """Go to a line; endless is what comes back to it with nothing changed."""
        if target == LOST:
            raise NotFollowedError
        if target <= at and not ways.order:
            if target in ways.stood and agree(ways.stood[target], state):
                return
            ways.stood[target] = state.copy()
        ways.go(target, state)

    def _jump(self, at: int, op: Op, state: State, ways: Ways) -> None:
        """Follow a jump, both ways where its condition is not known."""
        if op.condition is None:
            self._go(at, op.yes, state, ways)
            return
        value = self._value(op.condition, state)
        if value == value:
            self._go(at, op.yes if value != 0.0 else op.no, state, ways)
            return
        if LOST in (op.yes, op.no):
            raise NotFollowedError
        self._split(ways, op.no, state.copy())
        ways.go(op.yes, state)

    def _set(self, at: int, op: Op, state: State, ways: Ways) -> None:
        """``IF [..] THEN #1=2``."""
        value = self._value(op.condition, state)
        if value != 0.0:
            before = state.copy()
            assert op.line is not None
            runner = self.runner
            runner.state = state
            runner.run(op.line, visit=True)
            state = runner.state if value == value else join(before, runner.state)
        elif self.runner.observe is not None:
            self.runner.observe(self.script.lines[at], state)
        ways.go(at + 1, state)

    def _count(self, at: int, op: Op, state: State, ways: Ways) -> None:
        """Begin a counting loop, or go on with it: up to its last value, by one."""
        variables = state.variables
        declared = self.runner.executor.declared.get(
            op.name, "REAL" if op.name[1:].isdigit() else ""
        )
        if op.kind == "for":
            value = converted(self._value(op.first, state), declared)
        else:
            value = variables.get(op.name, NAN) + 1.0
        state.set_variable(op.name, value)
        last = self._value(op.condition, state)
        if value != value or last != last or not (value.is_integer() and last.is_integer()):
            self._split(ways, op.no, state.copy())
            ways.go(op.yes, state)
            return
        self._go(at, op.yes if value <= last else op.no, state, ways)

    def _part(self, unit: Unit, at: int, op: Op, state: State, ways: Ways) -> None:
        """Run a part of the program again: ``REPEAT LABEL P=3``, or up to M99 for M97."""
        count = self._value(op.count, state)
        if op.no == LOST or not (count == count and count.is_integer() and 0.0 < count < 1e6):
            raise NotFollowedError
        self._calls.append(unit)
        if len(self._calls) > MOST_CALLS:
            raise NotFollowedError
        current: State | None = state
        for _ in range(int(count)):
            if current is None:
                break
            before = current.copy()
            by_return = op.name == "M97"
            first, last = (unit.first, unit.last) if by_return else (op.no, int(op.first))
            inner = self._run(unit, first, last, current, op.no)
            current, other = inner.returned, inner.through
            if not by_return:
                current, other = other, current
            if other is not None:
                raise NotFollowedError
            if current is not None and self._same(before, current):
                break  # every further pass is the same
        self._calls.pop()
        if current is not None:
            ways.go(op.yes, current)

    # Complex: what a call keeps, gives and gives back is one thing on every pass.
    def _call(self, unit: Unit, at: int, op: Op, state: State, ways: Ways) -> None:
        """Call a subprogram of the file; another one is not followed, and leaves nothing known."""
        line = self.script.lines[at]
        sub = self.script.called(op.name)
        count = self._value(op.count, state)
        recursive = sub in self._calls or sub is unit or len(self._calls) >= MOST_CALLS
        bad = sub is None or not sub.followed or not sub.runs or not 0.0 < count < 1e6
        if bad or len(op.arguments) > (99 if not self._is_named else len(sub.parameters)):  # type: ignore[union-attr]
            self._block(unit, at, line, state, ways)
            self._lost = True
            return
        assert sub is not None
        if recursive:
            raise NotFollowedError
        executor, rules = self.runner.executor, self.runner.dialect.arithmetic
        kept = {n: v for n, v in state.variables.items() if is_local(n, rules)}
        declared = executor.declared
        given = self._given(sub, op, state) if op.scoped else kept
        self._calls.append(sub)
        current: State | None = state
        for _ in range(int(count)):
            if current is None:
                break
            before = current.copy()
            executor.declared = {name: kind for name, kind, _ in sub.parameters}
            self._replace(current, given)
            out = self._run(sub, sub.first, sub.last, current)
            if out.through is not None:
                raise NotFollowedError  # without an end of its own
            current = out.returned
            if current is not None:
                if op.scoped:
                    self._replace(current, kept)
                else:
                    kept = given = {
                        n: v for n, v in current.variables.items() if is_local(n, rules)
                    }
                if sub.saves:
                    current.forget_modes()
                    current.forget_positions()
                if self._same(before, current):
                    break
        self._calls.pop()
        executor.declared = declared
        if current is not None:
            ways.go(at + 1, current)

    @property
    def _is_named(self) -> bool:
        return self.runner.dialect.text.names

    def _given(self, sub: Unit, op: Op, state: State) -> dict[str, float]:
        """Values that a subprogram begins with."""
        if not self._is_named:
            rules = self.runner.dialect.arithmetic
            values = {str(k): VACANT for k in range(1, rules.local + 1)}
            for name, text in op.arguments:
                values[name] = evaluate(text, state.variables, rules)
            return values
        given = {}
        for k, (name, kind, default) in enumerate(sub.parameters):
            text = op.arguments[k][1] if k < len(op.arguments) else b""
            given[name] = converted(self._value(text or default, state), kind)
        return given

    def _replace(self, state: State, values: dict[str, float]) -> None:
        """Give a state other variables of the subprogram's own."""
        rules = self.runner.dialect.arithmetic
        state.forget_variables([name for name in state.variables if not is_local(name, rules)])
        for name, value in values.items():
            state.set_variable(name, value)

    def _block(self, unit: Unit, at: int, line: Line, state: State, ways: Ways) -> None:
        """Run a block, which may end the program."""
        runner = self.runner
        if self._leads_elsewhere(line):
            raise NotFollowedError
        runner.state = state
        self._lost |= self._calls_elsewhere(line)
        runner.entered = at in self._entered
        ended = runner.run(line, visit=True)
        runner.entered = False
        if ended is None:
            ways.go(at + 1, runner.state)
            return
        codes = {word.value for word in line.block.words if word.letter == "M"}
        if self._is_named and self._calls and not codes & {*_RETURNS}:
            # A SINUMERIK 802D goes back to the caller at M2; others end the program.
            raise NotFollowedError
        if runner.state is not ended:
            self._split(ways, at + 1, runner.state)
        if codes & {*_RETURNS}:
            self._return(unit, at, ended, ways)
        else:
            self._end(ended)

    def _calls_elsewhere(self, line: Line) -> bool:
        """Whether a block runs a program that is not here, by its name or its number."""
        declared, dialect = self.runner.executor.declared, self.runner.dialect
        unknown = [name.name for name in line.block.names if name.name not in declared]
        named = any(name and dialect.names.get(name, "flow") == "flow" for name in unknown)
        return named or any(word.letter in dialect.calls for word in line.block.words)

    @staticmethod
    def _leads_elsewhere(line: Line) -> bool:
        """Whether M99 goes on at a number, or a jump stands where none is known."""
        letters = {word.letter for word in line.block.words}
        m99 = any(w.letter == "M" and w.value in (96.0, 99.0) for w in line.block.words)
        return m99 and "P" in letters

    def _return(self, unit: Unit, at: int, state: State, ways: Ways) -> None:
        """Return to the caller; the main program of macro B begins again."""
        if self._calls:
            ways.returned = state if ways.returned is None else join(ways.returned, state)
        elif self._is_named:
            self._end(state)
        elif self.runner.dialect.text.variables == "Q":
            raise NotFollowedError  # an LBL 0 that nobody called
        else:
            self._go(at, unit.first, state, ways)

    def _end(self, state: State) -> None:
        self.ended = state
