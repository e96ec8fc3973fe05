"""Going the ways of a file, for the second reading: what its lines do wherever they run.

Rule 1: a line that runs twice is seen once: what its passes have in common. What is certain and
differs speaks against it.

Rule 2: where it is not known which of two lines follows, the later one waits, and what is known
there is what both ways share. A loop that runs nobody knows how often leaves nothing known, and
nothing is said of its lines.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from gcodejerk.verification.second_reading.known import NEAR, Observation
from gcodejerk.verification.second_reading.labelled import LabelledRoutes
from gcodejerk.verification.second_reading.operating import VACANT
from gcodejerk.verification.second_reading.reading import NAN
from gcodejerk.verification.second_reading.routes import LostError, Part, Routes, Way
from gcodejerk.verification.second_reading.stepping import Stepper
from gcodejerk.verification.second_reading.tracking import Tracker

MOST = 100_000
"""Lines that are run."""
_DEEPEST = 9
_RETURNS = re.compile(rb"(?<![A-Z])M[ \t]*0*(?:99|17)(?![0-9])")
_ALONE = re.compile(rb"[ \t\0]*(?:N[ \t]*[0-9]+)?[ \t\0]*M[ \t]*0*(?:99|17)[ \t\0;]*")
_NUMBER = re.compile(rb"N?[0-9]+")
_LABEL = re.compile(rb"([ \t]*(?:N[0-9]+[ \t]*)?)[A-Za-z_][A-Za-z_][A-Za-z0-9_]*[ \t]*:(?!=)")


class Walker:
    """Runs a file along its ways."""

    def __init__(self, stepper: Stepper, begin: Callable[[], Tracker], lines: list[bytes]) -> None:
        self.stepper, self._begin, self.lines = stepper, begin, lines
        routes = LabelledRoutes if stepper.dialect.text.variables == "Q" else Routes
        self.routes = routes([stepper.upper(line) for line in lines], stepper.dialect)
        self.seen: dict[int, Observation] = {}
        self._unsaid: list[tuple[int, int]] = []
        """Lines of which nothing is said."""
        self._entered: set[int] = set()
        """Lines to which something leads besides the line above."""
        self.most = MOST
        self._steps = 0
        self._calls: list[Part] = []
        self.lost = False
        """Programs have run that are not followed."""

    def walk(self) -> dict[int, Observation]:
        """Run every program of the file; what was seen, by line from 0.

        Raises
        ------
        LostError
        """
        for part in self.routes.parts:
            if part.main:
                self._run(part, part.begin, part.end, part.begin, self._begin())
        if self.lost:
            self._unsaid += [(part.begin, part.end) for part in self.routes.parts if not part.main]
        for first, last in self._unsaid:
            for at in range(first, last):
                self.seen.pop(at, None)
        for at in self._entered & self.seen.keys():
            self.seen[at].entered = True
        return self.seen

    def _run(
        self, part: Part, first: int, last: int, begin: int, tracker: Tracker
    ) -> tuple[Tracker | None, Tracker | None]:
        """Run lines first:last of a part; what is known behind them, and where it returns."""
        waiting: dict[int, Tracker] = {begin: tracker}
        self._entered.add(begin)
        through: Tracker | None = None
        back: list[Tracker] = []
        unsure: set[int] = set()
        while waiting:
            at = min(waiting)
            state = waiting.pop(at)
            if at == last:
                through = _joined(through, state)
                continue
            if not first <= at < last:
                raise LostError
            self._steps += 1
            if self._steps > self.most:
                raise LostError
            for target, after in self._line(part, at, state, back, unsure):
                if target != at + 1:
                    self._entered.add(target)
                waiting[target] = _joined(waiting.get(target), after)
        returned: Tracker | None = None
        for state in back:
            returned = _joined(returned, state)
        return through, returned

    def _line(
        self, part: Part, at: int, state: Tracker, back: list[Tracker], unsure: set[int]
    ) -> list[tuple[int, Tracker]]:
        """Run a line: the lines that may follow, with what is known there."""
        way = self.routes.ways.get(at)
        if way is None:
            return self._block(part, at, state, back)
        if way.what == "go":
            return self._go(at, way, state, unsure)
        if way.what == "pick":
            number = self._value(way.test, state)
            target = part.labels.get(f"N{int(number)}") if number == number else None
            if target is None or target < at:
                raise LostError
            return [(target, state)]
        if way.what == "then":
            return [(at + 1, self._then(way, state))]
        if way.what in ("count", "recount"):
            return self._count(at, way, state, unsure)
        if way.what == "again":
            return self._again(part, at, way, state)
        if way.what == "call":
            return self._call(at, way, state)
        if way.what == "sub":
            return self._sub(part, at, way, state)
        return self._return(state, back)

    def _value(self, text: bytes | None, state: Tracker) -> float:
        number = NAN if text is None else self.stepper.computer.value(text, state.variables)
        return NAN if number == VACANT else number

    def _go(self, at: int, way: Way, state: Tracker, unsure: set[int]) -> list[tuple[int, Tracker]]:
        """Go where the condition says, or both ways."""
        other = at + 1 if way.other is None else way.other
        target = way.to
        if target is None or target < 0:
            raise LostError
        number = 1.0 if way.test is None else self._value(way.test, state)
        if number == number:
            chosen = target if number != 0.0 else other
            if chosen <= at and chosen in unsure:
                return self._blur(chosen, at, state)
            return [(chosen, state)]
        back = min(target, other)
        if back <= at:
            return self._blur(back, at, state)
        unsure.add(at)  # the head of a loop, or a branch, to which nothing leads back
        return [(target, state), (other, state.copy())]

    def _blur(self, first: int, at: int, state: Tracker) -> list[tuple[int, Tracker]]:
        """Leave a loop that runs nobody knows how often."""
        for line in range(first, at):
            way = self.routes.ways.get(line)
            if way is None:
                continue
            inside = [t for t in (way.to, way.other) if t is not None]
            if way.what in ("call", "pick", "back") or any(
                not first <= t <= at + 1 for t in inside
            ):
                raise LostError
        self._unsaid.append((first, at + 1))
        state.stray()
        return [(at + 1, state)]

    def _then(self, way: Way, state: Tracker) -> Tracker:
        """``IF [..] THEN #1=2``."""
        number = self._value(way.test, state)
        if number == 0.0:
            return state
        before = state.copy()
        self.stepper.step(state, way.texts[0])
        if number != number:
            state.join(before)
        return state

    def _count(
        self, at: int, way: Way, state: Tracker, unsure: set[int]
    ) -> list[tuple[int, Tracker]]:
        """Count a loop's variable."""
        assert way.to is not None
        assert way.other is not None
        name = way.name
        if name[:1] == "R" and name[1:].isdigit():
            name = f"R{int(name[1:])}"
        elif self.stepper.computer.kinds.get(name) not in ("INT", "REAL"):
            raise LostError
        if way.what == "count":
            number = self._value(way.texts[0], state)
        else:
            number = state.variables.get(name, NAN) + 1.0
        state.variables.pop(name, None)
        last = self._value(way.test, state)
        if number.is_integer() and last.is_integer():
            state.variables[name] = number
            last = self._value(way.test, state)
            return [(way.to if number <= last else way.other, state)]
        if way.what == "recount" or at in unsure:
            return self._blur(way.to - 1, at, state)
        raise LostError

    def _again(self, part: Part, at: int, way: Way, state: Tracker) -> list[tuple[int, Tracker]]:
        """``REPEAT LABEL P=3``."""
        assert way.to is not None
        assert way.other is not None
        if way.to < 0 or not way.to < way.other <= at:
            raise LostError
        self._enter(part)
        current: Tracker | None = state
        for _ in range(int(way.times)):
            if current is not None:
                current, back = self._run(part, way.to, way.other, way.to, current)
                if back is not None:
                    raise LostError
        self._calls.pop()
        return [] if current is None else [(at + 1, current)]

    def _sub(self, part: Part, at: int, way: Way, state: Tracker) -> list[tuple[int, Tracker]]:
        """``CALL LBL 1``."""
        if way.to is None or way.to < 0:
            raise LostError
        self._enter(part)
        through, back = self._run(part, part.begin, part.end, way.to, state)
        if through is not None:
            raise LostError
        self._calls.pop()
        return [] if back is None else [(at + 1, back)]

    def _enter(self, part: Part) -> None:
        self._calls.append(part)
        if len(self._calls) > _DEEPEST:
            raise LostError

    # Complex: what a call keeps, gives and gives back is one thing on every pass.
    def _call(self, at: int, way: Way, state: Tracker) -> list[tuple[int, Tracker]]:
        """Run a subprogram of the file; of another, nothing is known behind it."""
        called = self.routes.called(way.name)
        computer = self.stepper.computer
        many = computer.named and called is not None and len(way.texts) > len(called.given)
        if called is None or not called.callable or called.data or many:
            self.lost = True
            state.begun = state.started = True
            state.stray()
            return [(at + 1, state)]
        kept = {n: v for n, v in state.variables.items() if computer.is_local(n)}
        kinds = computer.kinds
        given = self._given(called, way, state) if way.own else kept
        if called in self._calls or called.begin <= at < called.end:
            raise LostError
        self._enter(called)
        for _ in range(int(float(way.times))):
            shared = {n: v for n, v in state.variables.items() if not computer.is_local(n)}
            state.variables = {**shared, **{n: v for n, v in given.items() if v == v}}
            computer.kinds = {name: kind for name, kind, _ in called.given}
            through, back = self._run(called, called.begin, called.end, called.begin, state)
            if through is not None:
                raise LostError
            if back is None:
                self._calls.pop()
                computer.kinds = kinds
                return []
            state = back
            if way.own:
                shared = {n: v for n, v in state.variables.items() if not computer.is_local(n)}
                state.variables = {**shared, **kept}
            else:
                given = {n: v for n, v in state.variables.items() if computer.is_local(n)}
            if called.saves:
                variables = state.variables
                state.stray()
                state.variables = variables
        self._calls.pop()
        computer.kinds = kinds
        return [(at + 1, state)]

    def _given(self, called: Part, way: Way, state: Tracker) -> dict[str, float]:
        """What a subprogram begins with."""
        computer = self.stepper.computer
        if computer.named:
            found = {}
            for k, (name, kind, default) in enumerate(called.given):
                text = way.texts[k] if k < len(way.texts) and way.texts[k] else default
                value = self._value(text, state)
                found[name] = value if kind == "REAL" or value.is_integer() else NAN
            return found
        local = {str(k): VACANT for k in range(1, computer.rules.local + 1)}
        letters = computer.rules.parameters
        turn, last, stated = 0, -1, set[str]()
        for word in way.texts:
            letter, text = word[:1].decode(), word[1:]
            plain = text.lstrip(b"+-").isdigit() and float(text) != 0.0
            value = NAN if plain else computer.value(text, state.variables)
            if letter in "IJK":
                place = "IJK".index(letter)
                turn += place <= last
                last = place
                local[str(4 + 3 * turn + place)] = value
            elif letter in letters:
                local[str(letters.index(letter) + 1)] = NAN if letter in stated else value
                stated.add(letter)
        return local

    def _block(
        self, part: Part, at: int, state: Tracker, back: list[Tracker]
    ) -> list[tuple[int, Tracker]]:
        """Run a block."""
        bare = self.lines[at]
        upper = self.routes.lines[at]
        head = upper.strip(b" \t\0")
        if at == part.begin and self.routes.by_code and head[:1] in (b"%", b"O", b":"):
            state.started = True
            if head[:1] == b"%":
                state.opened = True  # the name of the file may stand behind it
            else:
                state.begun = True
            return [(at + 1, state)]
        if head == b"%":
            return [(at + 1, state)] if not (state.begun or state.opened) else []
        if b"PROC" in head.split() and self._calls:
            return [(at + 1, state)]
        if self.routes.named:
            bare = _LABEL.sub(rb"\1", bare, count=1)
        state.ended = False
        # Where variables are numbers, a block ends by an M code or %: no other is looked back at.
        may_end = self.stepper.dialect.text.variables != "#" or b"M" in upper or b"%" in upper
        before = state.copy() if may_end else None
        seen = self.stepper.step(state, bare)
        self.lost = self.lost or state.strayed
        self.seen[at] = seen if at not in self.seen else _common(self.seen[at], seen)
        if not state.ended:
            return [(at + 1, state)]
        if before is None:
            raise LostError
        return self._ended(upper, before, back)

    def _ended(
        self, upper: bytes, before: Tracker, back: list[Tracker]
    ) -> list[tuple[int, Tracker]]:
        """Go where a block leads that ends its program, from what was known in front of it."""
        returns = self.routes.by_code and _RETURNS.search(upper) is not None
        if self.routes.named and self._calls and not returns:
            raise LostError  # M2 and M30 of a subprogram go back to its caller on some controls
        if returns and self._calls:
            if _ALONE.fullmatch(upper) is None:
                before.stray()
            return self._return(before, back)
        if returns and not self.routes.named:
            raise LostError  # the program begins again
        return []

    def _return(self, state: Tracker, back: list[Tracker]) -> list[tuple[int, Tracker]]:
        """Go back to the caller."""
        if self._calls:
            back.append(state)
        elif not self.routes.by_code:
            raise LostError  # an LBL 0 that nobody called
        return []


def given_up(lines: list[bytes]) -> dict[int, Observation] | None:
    """What is seen in a file that is not followed, if anything: REPEATB N10 runs a single block."""
    places = (line.partition(b";")[0].upper().split() for line in lines)
    if not any(
        word in (b"REPEAT", b"REPEATB") and any(map(_NUMBER.fullmatch, words[k + 1 : k + 3]))
        for words in places
        for k, word in enumerate(words)
    ):
        return None
    why = "the program repeats blocks by their numbers"
    return {at: Observation(against=why) for at in range(len(lines))}


def _joined(a: Tracker | None, b: Tracker) -> Tracker:
    """What is known where two ways meet."""
    if a is not None:
        b.join(a)
    return b


def _common(a: Observation, b: Observation) -> Observation:
    """What two passes over a line have in common."""
    out = Observation(against=a.against or b.against, sure=a.sure and b.sure, axes=a.axes)
    if a.axes != b.axes or not a.modes or not b.modes:
        return Observation(against=out.against)
    for mine, other, here in ((a.start, b.start, out.start), (a.end, b.end, out.end)):
        for k, (x, y) in enumerate(zip(mine, other, strict=False)):
            differ = abs(x - y) > NEAR
            here.append(NAN if differ or x != x or y != y else x)
            if differ and a.axes >> k & 1 and a.sure and b.sure:
                out.against = out.against or "it is not the same on every pass"
    out.modes = {name: _same(mode, b.modes.get(name)) for name, mode in a.modes.items()}
    if a.modes.get("path") is None or _differs(a.modes["P"], b.modes["P"]):
        out.modes["path"] = None
    return out


def _differs(a: float, b: float) -> bool:
    return a != b and (a == a or b == b)


def _same(a: Any, b: Any) -> Any:
    """What two passes have in force; None or NaN where they differ."""
    return a if a == b else NAN if isinstance(a, float) else None
