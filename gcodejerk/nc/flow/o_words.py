"""Following LinuxCNC's O-words: loops, branches and subprograms, pass by pass.

Rule 1: a condition whose value is known is followed exactly. Where it is not known, both ways run,
and what they do not share is unknown; a loop of unknown length runs until its passes bring nothing
new (what differs between them is then unknown), which takes a few passes, since from the third
on nothing is taken as known.

Rule 2: work is bounded for the whole program (`EXACT`, `ALL` executed lines). What is beyond is not
followed: everything behind it is unknown, and the rapids in it are left alone.
"""

from __future__ import annotations

from collections.abc import Mapping

from gcodejerk.nc.flow.elsewhere import find_o_word
from gcodejerk.nc.flow.structures import Node, plain_name
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.nc.interpreter.modal import State, agree, join
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.runner import Runner
from gcodejerk.nc.interpreter.variables import is_local, reads_feed
from gcodejerk.nc.text.block import ELSEWHERE

EXACT = 50_000
"""Executed lines, over the whole program, up to which conditions are followed."""
ALL = 100_000
"""Executed lines at all."""
MOST_KEPT = 100_000
"""Lines of subprograms that are kept."""
MOST_CALLS = 9
"""Calls within calls; LinuxCNC has ten levels."""
PASSES = 3
"""Passes through a loop of unknown length before everything in it is taken for unknown."""
_PARAMETERS = 30

NEXT, RETURN, END = "next", "return", "end"
Exits = dict[str, State]
"""Ways out of a piece of program -> what is in force there: to the next line, back from the
subprogram, the end of the program, or ``break 100``, ``continue 100``."""


class TooLongError(Exception):
    """The bounds are reached."""


def _either(a: State | None, b: State | None) -> State | None:
    """Keep what is known where one of two ways leads to, or the only one."""
    return b if a is None else a if b is None else join(a, b)


def _add(exits: Exits, more: Exits) -> None:
    for way, state in more.items():
        joined = _either(exits.get(way), state)
        assert joined is not None
        exits[way] = joined


def _holds_break(loop: Node, inner: Node | None = None) -> bool:
    """Whether a ``break`` out of a loop stands in it."""
    node = loop if inner is None else inner
    return (node.kind == "break" and node.name == loop.name) or any(
        _holds_break(loop, each) for _, body in node.branches for each in body
    )


class Passes:
    """Runs structures and subprograms; keeps the subprograms of the file."""

    comments = False
    """Lines with comments alone are run, too."""

    def __init__(self, runner: Runner, files: Mapping[str, bytes] | None = None) -> None:
        self.runner, self._files = runner, files or {}
        self.used: dict[str, None] = {}
        """Files in which subprograms were found."""
        self._subs: dict[str, Node | None] = {}
        self._spent = self._kept = 0
        self._depth = 0
        self._lost = False
        self._broken = False
        """A ``break`` has run: LinuxCNC 2.9 then ends a later ``do`` after its first pass. One that
        a ``while`` passes over on its way to its end counts, too."""
        self._dos: set[str] = set()
        """Labels of the ``do`` that have run."""
        self._continued = False
        """A ``continue`` of a ``do`` has run: LinuxCNC 2.9 then begins a later ``repeat`` again at
        its end, and a later ``while`` that is left by a ``break``."""
        self._repeats: list[Node] = []
        """The ``repeat`` that run now, one within another."""
        self._stale: set[int] = set()
        """Those that were left in the middle: LinuxCNC 2.9 goes on with their count later."""

    @property
    def exhausted(self) -> bool:
        """Whether no more structures are followed."""
        return self._spent >= EXACT

    def define(self, sub: Node) -> None:
        """Keep a subprogram; a second one of its name is an error of the program."""
        self._kept += sub.last - sub.line.number
        known = sub.name in self._subs or self._kept > MOST_KEPT
        self._subs[sub.name] = None if known else sub
        if self._lost:
            self.runner.log.visits.spoil(sub.line.number, sub.last)

    def lose(self) -> None:
        """Some subprogram may run without being followed: those of the file may be among them."""
        if not self._lost:
            for sub in self._subs.values():
                if sub is not None:
                    self.runner.log.visits.spoil(sub.line.number, sub.last)
        self._lost = True

    def run(self, node: Node) -> bool:
        """Run a structure or a call of the main program; whether the program goes on behind it."""
        runner, state = self.runner, self.runner.state
        try:
            exits = self._node(node, state)
        except TooLongError:
            runner.log.visits.spoil(node.line.number, max(node.last, node.line.number))
            self.lose()
            runner.log.feed_event(USES_FEED)
            exits = {NEXT: state, RETURN: state}
        after = exits.pop(NEXT, None)
        ended = exits.pop(END, None)
        if after is None and ended is not None and not exits:
            runner.state = ended
            return False
        runner.state = state if after is None else after
        if after is None or exits:
            runner.state.forget()  # LinuxCNC refuses a return from the main program
        return True

    def _memory(self) -> tuple[bool, bool, int]:
        """What LinuxCNC keeps of the jumps so far: a pass may run otherwise once it has changed."""
        return self._broken, self._continued, len(self._stale)

    def _same(self, before: State, behind: State) -> bool:
        """Whether a pass has changed nothing, so that every further pass is the same."""
        return agree(before, behind)

    def _count(self) -> None:
        self._spent += 1
        if self._spent > ALL:
            raise TooLongError

    def _uncertain(self) -> None:
        """Pass a place from where it is not known how the program goes on: F may be used."""
        self.runner.log.feed_event(USES_FEED)

    def _known(self, condition: bytes | None, state: State) -> float | None:
        """Compute a condition or count; None where it is not known."""
        self._count()
        if condition is None or self.exhausted:
            return None
        value = evaluate(condition, state.variables, self.runner.dialect.arithmetic)
        return value if value == value else None

    def _sequence(self, nodes: list[Node], state: State) -> Exits:
        """Run one after another."""
        exits: Exits = {}
        for node in nodes:
            out = self._node(node, state)
            after = out.pop(NEXT, None)
            _add(exits, out)
            if after is None:
                return exits
            state = after
        exits[NEXT] = state
        return exits

    def _node(self, node: Node, state: State) -> Exits:
        """Run a structure or a line."""
        if node.kind == "line":
            return self._line(node, state)
        state.line = node.line  # since which what it loses is unknown
        if reads_feed(node.line.block, self.runner.dialect.arithmetic):
            self.runner.log.feed_event(USES_FEED)
        if node.kind == "endsub":
            return {NEXT: state}
        if node.kind == "if":
            return self._branches(node, state)
        if node.kind == "call":
            return self._call(node, state)
        if node.kind in ("return", "break", "continue"):
            self._stale.update(map(id, self._repeats))
        if node.kind == "return":
            self._count()
            return {RETURN: state}
        if node.kind in ("break", "continue"):
            self._count()
            self._broken |= node.kind == "break"
            self._continued |= node.kind == "continue" and node.name in self._dos
            return {f"{node.kind} {node.name}": state}
        if node.kind == "repeat":
            self._repeats.append(node)
            try:
                return self._repeat(node, state)
            finally:
                self._repeats.pop()
        return self._loop(node, state)

    def _line(self, node: Node, state: State) -> Exits:
        """Run a block."""
        self._count()
        runner = self.runner
        if any(word.letter == "M" and word.value == 99.0 for word in node.line.block.words):
            raise TooLongError  # Fanuc's way to return: not followed here
        runner.state = state
        ended = runner.run(node.line, visit=True)
        if ended is None:
            return {NEXT: runner.state}
        return {END: ended} if runner.state is ended else {END: ended, NEXT: runner.state}

    def _branches(self, node: Node, state: State) -> Exits:
        """Run ``if``: the branch that is taken, or all that may be."""
        exits: Exits = {}
        open_end = True
        for condition, body in node.branches:
            value = None
            if condition is not None:
                value = self._known(condition, state)
                if value == 0.0:
                    continue
            certain = condition is None or value is not None
            if not certain:
                # Whether these lines run at all is not known: nothing is rewritten in them.
                self.runner.log.visits.spoil(node.line.number, node.last)
                self._uncertain()
            _add(exits, self._sequence(body, state if certain else state.copy()))
            if not certain:
                self._uncertain()
            if certain:
                open_end = False
                break
        if open_end:
            _add(exits, {NEXT: state})
        if len(exits) > 1:
            self._uncertain()
        return exits

    def _repeat(self, node: Node, state: State) -> Exits:
        """Run ``repeat``."""
        count = self._known(node.condition, state)
        again = self._continued or id(node) in self._stale
        if count is None or not count.is_integer() or again:
            return self._settle(node, state, test_first=True)
        exits: Exits = {}
        leave: State | None = None
        left = count
        current: State | None = state
        while current is not None and left > 0:
            self._count()
            if self.exhausted:
                _add(exits, self._settle(node, current, test_first=True))
                current = exits.pop(NEXT, None)
                break
            left -= 1
            before, memory = current.copy(), self._memory()
            current, broken = self._pass(node, current, exits)
            leave = _either(leave, broken)
            same = current is not None and self._same(before, current)
            if same and broken is None and memory == self._memory():
                break  # every further pass is the same
        if current is not None and self._continued:
            _add(exits, self._settle(node, current, test_first=True))
            current = exits.pop(NEXT, None)
        return self._left(exits, _either(current, leave))

    def _loop(self, node: Node, state: State) -> Exits:
        """Run ``while``, or ``do`` with its ``while`` at the end."""
        test_first = node.kind == "while"
        if not test_first:
            self._dos.add(node.name)
        exits: Exits = {}
        leave: State | None = None
        current: State | None = state
        while current is not None:
            if test_first:
                value = self._known(node.condition, current)
                if value == 0.0:
                    self._broken = self._broken or _holds_break(node)
                    break
                if value is None:
                    _add(exits, self._settle(node, current, test_first))
                    current = exits.pop(NEXT, None)
                    break
            elif self.exhausted:
                _add(exits, self._settle(node, current, test_first))
                current = exits.pop(NEXT, None)
                break
            before, memory = current.copy(), self._memory()
            current, broken = self._pass(node, current, exits)
            leave = _either(leave, broken)
            if not test_first and current is not None:
                value = self._known(node.condition, current)
                if value == 0.0:
                    break
                if value is None or self._broken:
                    leave = _either(leave, current.copy())
                    _add(exits, self._settle(node, current, test_first))
                    current = exits.pop(NEXT, None)
                    break
            same = current is not None and self._same(before, current)
            if same and memory == self._memory():
                current = None  # endless
        return self._left(exits, _either(current, leave))

    def _pass(self, node: Node, state: State, exits: Exits) -> tuple[State | None, State | None]:
        """Run a loop's body once: where the next pass begins, and where a break leads."""
        out = self._sequence(node.body, state)
        back = _either(out.pop(NEXT, None), out.pop(f"continue {node.name}", None))
        broken = out.pop(f"break {node.name}", None)
        if broken is not None and self._continued and node.kind == "while":
            back = _either(back, broken.copy())
        _add(exits, out)
        return back, broken

    @staticmethod
    def _left(exits: Exits, after: State | None) -> Exits:
        """Add the way out at the end of a loop."""
        if after is not None:
            _add(exits, {NEXT: after})
        return exits

    def _settle(self, node: Node, state: State, test_first: bool) -> Exits:
        """Run a loop that may run any number of times, until another pass changes nothing."""
        exits: Exits = {}
        leave: State | None = None
        entry = state.copy()
        self._broken = self._broken or (node.kind == "while" and _holds_break(node))
        for k in range(PASSES + 6):
            self._count()
            if k == PASSES:
                entry.forget()
            if test_first:
                leave = _either(leave, entry.copy())
            self._uncertain()
            memory = self._memory()
            back, broken = self._pass(node, entry.copy(), exits)
            self._uncertain()
            leave = _either(leave, broken)
            if back is None:
                return self._left(exits, leave)
            if not test_first:
                leave = _either(leave, back.copy())
            wider = join(entry, back)
            if agree(wider, entry) and memory == self._memory():
                return self._left(exits, leave)
            entry = wider
        raise TooLongError

    def _call(self, node: Node, state: State) -> Exits:
        """Run a subprogram with variables of its own."""
        self._count()
        name = plain_name(node.line.block.o_name)
        sub = None if name is None else self._sub(name)
        if sub is None:
            self.runner.log.stops = True
            self.lose()
            self._uncertain()
            state.forget()
            return {NEXT: state}
        if self._depth >= MOST_CALLS:
            raise TooLongError
        rules = self.runner.dialect.arithmetic
        given = [evaluate(a, state.variables, rules) for a in node.line.block.o_arguments]
        given += [0.0] * (_PARAMETERS - len(given))
        kept = {n: v for n, v in state.variables.items() if is_local(n, rules)}
        self._replace_locals(state, {str(k): v for k, v in enumerate(given[:_PARAMETERS], 1)})
        self._depth += 1
        try:
            out = self._sequence(sub.body, state)
        finally:
            self._depth -= 1
        back = _either(out.pop(NEXT, None), out.pop(RETURN, None))
        exits = {END: out.pop(END)} if END in out else {}
        if back is not None:
            self._replace_locals(back, kept)
            if back.restores:  # M73: the modes are the caller's again
                back.forget_modes()
                back.forget_positions()
            if out:
                back.forget()  # a break out of the subprogram: LinuxCNC refuses it
            exits[NEXT] = back
        return exits

    def _sub(self, name: str) -> Node | None:
        """The subprogram of a name: of this file, if it stands in front, or of one of its own."""
        if name in self._subs or not self._files:
            return self._subs.get(name)
        runner = self.runner
        first = ELSEWHERE * (1 + len(self.used))
        found = find_o_word(name, self._files, runner.dialect, first, self.comments)
        if found is None:
            return None
        file, sub = found
        self.used[file] = None
        runner.elsewhere.append((first, file, 1))
        self._kept += sub.last - sub.line.number
        self._subs[name] = None if self._kept > MOST_KEPT else sub
        return self._subs[name]

    def _replace_locals(self, state: State, values: dict[str, float]) -> None:
        """Give a state other variables of the subprogram's own."""
        rules = self.runner.dialect.arithmetic
        shared = [name for name in state.variables if not is_local(name, rules)]
        state.forget_variables(shared)
        for name, value in values.items():
            state.set_variable(name, value)
