"""Following ``M98 P1000 L3`` and ``M97 P100`` to the subprograms of the same file.

Rule: a subprogram runs from its first line to its M99, as often as it is called, from what is known
there. Its jumps are not followed (`jumps`): behind a target, only what the code states is known,
so its lines run in the order written. A call that cannot be followed leaves nothing known, and the
rapids of all subprograms alone, since it may lead to them.
"""

from __future__ import annotations

from collections.abc import Callable

from gcodejerk.nc.flow.jumps import is_target
from gcodejerk.nc.flow.outline import Mark, Outline
from gcodejerk.nc.interpreter.eligibility import Call
from gcodejerk.nc.interpreter.modal import State, agree, join
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.runner import Runner
from gcodejerk.nc.text.block import Line

ALL = 100_000
"""Executed lines of subprograms, over the whole program; also lines of them that are kept."""
MOST_CALLS = 4
"""Calls within calls."""
_PACKED = 10_000
"""P31000 is O1000 three times, where a control packs the repeats into P."""


class Calls:
    """Runs the subprograms of a file."""

    def __init__(
        self, runner: Runner, outline: Outline, read: Callable[[Mark], list[Line] | None]
    ) -> None:
        self.runner, self.outline, self._read = runner, outline, read
        self._bodies: dict[int, list[Line] | None] = {}
        """By the line that they begin in."""
        self._spent = self._kept = 0
        self._depth = 0
        self._lost = False
        self.main_line = 0
        """That the main program has come to."""

    @property
    def bodies(self) -> list[list[Line]]:
        """Those that were run."""
        return [body for body in self._bodies.values() if body]

    def lose(self) -> None:
        """Some subprogram may run without being followed."""
        self._lost = True

    def finish(self) -> None:
        """Leave alone what may have run otherwise."""
        for body in self.bodies:
            if self._lost:
                self.runner.log.visits.spoil(body[0].number, body[-1].number)

    def call(self, call: Call, line: Line) -> bool:
        """Run what a block calls; whether the program goes on behind it."""
        runner = self.runner
        found = self._find(call)
        body = None if found is None else self._body(found[0])
        if found is None or body is None or self._depth >= MOST_CALLS or self._lost_way(call, body):
            self.lose()
            runner.log.stops = True
            runner.log.feed_event(USES_FEED)
            runner.state.forget()
            runner.executor.lengths.clear()
            return True
        if call.m == 97:
            # It may also be run into from the line in front of it, which then is at rest or not.
            runner.log.visits.spoil(body[0].number, body[0].number)
        self._depth += 1
        goes_on = self._repeat(body, found[1])
        self._depth -= 1
        return goes_on

    def _lost_way(self, call: Call, body: list[Line]) -> bool:
        """Whether the main program runs through the lines that it calls."""
        first = body[0].number
        return self._spent >= ALL or (call.m == 97 and self._depth == 0 and first <= self.main_line)

    def _find(self, call: Call) -> tuple[Mark, int] | None:
        """Where the subprogram begins, and how often it runs; None where that is not certain."""
        if call.m == 97:
            mark = self.outline.numbers.get(call.number)
            return None if mark is None else (mark, call.repeats or 1)
        programs = self.outline.programs
        if (mark := programs.get(call.number)) is not None:
            return mark, call.repeats or 1
        if call.number in programs or call.repeats is not None or call.number < _PACKED:
            return None
        if not self.runner.dialect.packed_repeats:
            return None
        mark = programs.get(call.number % _PACKED)
        return None if mark is None else (mark, call.number // _PACKED)

    def _body(self, mark: Mark) -> list[Line] | None:
        """Lines of a subprogram."""
        if mark.line not in self._bodies:
            body = self._read(mark) if self._kept < ALL else None
            self._kept += len(body or ())
            self._bodies[mark.line] = body
        return self._bodies[mark.line]

    def _repeat(self, body: list[Line], count: int) -> bool:
        """Run a subprogram so often; whether it came back."""
        runner = self.runner
        for _ in range(count):
            before = runner.state.copy()
            exits = self._run(body)
            if exits is None:
                self.lose()
                runner.log.feed_event(USES_FEED)
                runner.state = before
                before.forget()
                return True
            if not exits:
                return False
            state = exits[0]
            for other in exits[1:]:
                state = join(state, other)
            runner.state = state
            if agree(before, state):
                break  # every further pass is the same
        return True

    def _run(self, body: list[Line]) -> list[State] | None:
        """Run it once: the states with which it returns; None where that was too much."""
        runner, targets = self.runner, self.outline.targets
        exits: list[State] = []
        alive = True
        for k, line in enumerate(body):
            block = line.block
            if targets is not None and is_target(block, targets):
                runner.log.feed_event(USES_FEED)
                runner.state = runner.state.copy()
                runner.state.forget()
                alive = True
            if not alive or (k == 0 and block.o_word is not None and block.problem is None):
                continue
            self._spent += 1
            if self._spent > ALL:
                return None
            ended = runner.run(line, visit=True)
            if ended is None:
                continue
            alive = runner.state is not ended
            if targets is not None:
                runner.log.feed_event(USES_FEED)
            stops = {word.value for word in block.words if word.letter == "M"}
            if 99.0 in stops:
                if any(word.letter not in "NM" for word in block.words):
                    ended = ended.copy()
                    ended.forget()  # M99 P: it goes on somewhere else
                exits.append(ended)
        if alive:
            return None  # without M99: what follows runs too
        return exits
