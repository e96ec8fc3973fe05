"""Running one block: the modal state moves on, and a rapid is entered with its reason.

Rule: whoever decides which block runs next (`nc.reader`, `nc.flow`) hands it over here, so
that a block does the same wherever it is run from.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from gcodejerk.errors import Place
from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.eligibility import Call, Step, unknown_since
from gcodejerk.nc.interpreter.execute import Executor
from gcodejerk.nc.interpreter.initial import initial_state
from gcodejerk.nc.interpreter.modal import NAN, State, join
from gcodejerk.nc.interpreter.rapids import GIVES_FEED, USES_FEED, RapidLog
from gcodejerk.nc.interpreter.runs import Taken
from gcodejerk.nc.interpreter.visits import EXACT, Row
from gcodejerk.nc.text.block import Line
from gcodejerk.nc.text.chunks import Chunk
from gcodejerk.reasons import Reason
from gcodejerk.start import Start
from gcodejerk.units import SECONDS_PER_MINUTE

_SHOWN = 20
"""Lines not understood that get a finding of their own."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something in a program that the user can live with."""

    line: int | None
    message: str
    place: Place | None = None


class Runner:
    """Runs blocks one by one against the state that it owns."""

    def __init__(self, name: str, dialect: Dialect, start: Start) -> None:
        self.name = name
        self.dialect = dialect
        stoppable = "path" in dialect.groups.values() and not dialect.path_has_to_be_stated
        self.log = RapidLog(stoppable=stoppable, restores=start.restores)
        state = initial_state(dialect, start)
        self.executor = Executor(dialect, state, start)
        self.syntax_problems: list[Finding] = []
        self.steps = 0
        """Blocks run one by one so far, passes of loops among them."""
        self.problem_count = 0
        self.limited: Line | None = None
        """The first line that sets a limit too low."""
        self._lost: dict[int, tuple[Line, int]] = {}
        self._instant = False
        """Line behind which what is in force is unknown -> it, and rapids left alone for that."""
        self.asked_distance: int | None = None
        self.asked_feed_mode: int | None = None
        self.entered = False
        """A jump or a call leads to the block that is run."""
        self.call: Callable[[Call, Line], bool] | None = None
        """Runs a subprogram; whether the program goes on behind it."""
        self.left: Callable[[], None] = lambda: None
        """Called where programs run that are not followed."""
        self.observe: Callable[[Line, State], None] | None = None
        """Called behind every line that may run more than once."""
        self.elsewhere: list[tuple[int, str, int]] = []
        """Of lines in other files: number of the first, the file, its number there; ascending."""

    @property
    def state(self) -> State:
        """The state in force."""
        return self.executor.state

    @state.setter
    def state(self, state: State) -> None:
        self.executor.state = state

    def run(self, line: Line, *, uncertain: bool = False, visit: bool = False) -> State | None:
        """Execute a block and enter what it did.

        Parameters
        ----------
        line : Line
            The block.
        uncertain : bool
            Whether it runs is not known, nor how often.
        visit : bool
            It is one pass of several; what the passes have in common counts.

        Returns
        -------
        State or None
            Where the block ends the program, or returns from it: the state behind it. It is not
            the one in force if the block may be skipped.
        """
        executor, block = self.executor, line.block
        self.steps += 1
        executor.state.line = line
        before = executor.state.copy() if block.block_delete else None
        ended = executor.state.ended
        step = executor.run(block)
        if not (visit and line.number in self.log.visits.rows):  # else said on the first pass
            self._name_problem(step, line)
        if not ended:
            self._feed_event(step.feed_event, surely=before is None and not uncertain)
        self.log.habits |= step.habit
        self.log.outputs |= step.outputs
        if step.limits and self.limited is None:
            self.limited = line
        self.log.stops |= step.leaves or executor.state.path in EXACT
        if step.leaves:
            self.left()
        if step.rapid:
            self._rapid(step, line, uncertain=uncertain, visit=visit)
        elif visit:
            self.log.visits.add(line.number, None)
        goes_on = self._call(step, line, may_skip=before is not None) and not step.ends
        after = executor.state
        if self.observe is not None and visit:
            self.observe(line, after if before is None else join(before, after))
        if before is not None:
            executor.state = join(before, after) if goes_on else before
        return None if goes_on else after

    def _feed_event(self, event: int, *, surely: bool) -> None:
        """Enter what a block does with F; one that may not run replaces none."""
        if surely or event != GIVES_FEED:
            self.log.feed_event(event)

    def _name_problem(self, step: Step, line: Line) -> None:
        """Tell the user of a block that the control refuses, or of a code nobody knows."""
        if step.refused:
            name = self.dialect.name
            what = f"some controls of the dialect {name} refuse {step.refused}, and then the block"
            self.add_problem(line, f"{what} does nothing")
        elif step.fault and line.block.problem is None:
            self.add_problem(line, "the controller would refuse this combination of words")
        elif step.unknown:
            name = self.dialect.name
            self.add_problem(
                line, f"{step.unknown} is a code that the dialect {name} does not know"
            )

    def _call(self, step: Step, line: Line, *, may_skip: bool) -> bool:
        """Run what the block calls; whether the program goes on."""
        if step.call is None:
            return True
        assert self.call is not None
        if may_skip:
            self.log.feed_event(USES_FEED)
        goes_on = self.call(step.call, line)
        if may_skip:
            self.log.feed_event(USES_FEED)
        return goes_on

    def _rapid(self, step: Step, line: Line, *, uncertain: bool, visit: bool) -> None:
        """Enter a rapid."""
        state, reason = self.state, step.reason
        if not uncertain:
            self._count_lost(step.since, 1)
        if uncertain and reason not in (Reason.AFTER_END, Reason.BLOCK_DELETE):
            reason = Reason.SUBPROGRAM
        speed = NAN
        if self.dialect.feed_on_rapids or step.fed:
            speed = state.feed * (state.unit or NAN) / SECONDS_PER_MINUTE
            if reason is None and not speed > 0.0:
                reason = Reason.FEED_UNKNOWN
        if reason is None:
            self.ask(line.number)
        row = Row.of(state)
        row.line, row.terminator = line.number, line.terminator
        row.begin, row.end = line.begin, line.begin + len(line.text)
        row.start, row.target = step.start, step.end
        row.turned, row.words = step.turned, step.words
        row.beam, row.fed, row.entered = step.beam, step.fed, self.entered
        row.feed, row.speed = NAN if self.dialect.feed_lost else state.feed, speed
        if visit:
            self.log.visit(line.number, reason, row)
        else:
            self.log.add(reason, row)

    def took(self, taken: Taken) -> None:
        """Note what a run of lines, taken at once, has said."""
        if taken.certain is not None:
            self.ask(taken.certain)
        self._count_lost(unknown_since(self.state), taken.unknown)

    def _count_lost(self, since: Line | None, rapids: int) -> None:
        """Count rapids that are left alone for what is not known since a line."""
        if since is not None and rapids:
            _, before = self._lost.get(since.number, (since, 0))
            self._lost[since.number] = since, before + rapids

    def enter_unreached(self, lines: Iterable[Line]) -> None:
        """Enter rapids that no pass has come to, as far as they can be told."""
        kept, self.state = self.state, self.state.copy()
        lengths, self.executor.lengths = self.executor.lengths, {}
        self.state.forget()
        self.state.ended = False
        for line in lines:
            if line.number not in self.log.visits.rows and line.block.o_word is None:
                step = self.executor.run(line.block)
                self.log.stops |= step.leaves or self.state.path in EXACT
                if step.rapid:
                    self._rapid(step, line, uncertain=True, visit=False)
        self.state, self.executor.lengths = kept, lengths

    def ask(self, number: int) -> None:
        """Note the first certain rapid that rests on an assumed distance or feed mode."""
        state = self.state
        fixed = "distance" in state.fixed
        if not (fixed or state.distance_stated) and self.asked_distance is None:
            self.asked_distance = number
        fixed = "feed_mode" in state.fixed or state.feed_mode is None  # of that nothing is assumed
        if not (fixed or state.feed_mode_stated) and self.asked_feed_mode is None:
            self.asked_feed_mode = number

    def losses(self) -> list[Finding]:
        """Name the lines behind which it is not known what is in force."""
        found = []
        for number, (line, count) in sorted(self._lost.items())[:_SHOWN]:
            text = line.text.strip()[:40].decode("latin-1")
            rapids = "1 rapid" if count == 1 else f"{count} rapids"
            name, at = self._place(number)
            since = "this line" if name == self.name else f"line {at} of {name}"
            found.append(
                Finding(
                    number if name == self.name else None,
                    f"what is in force is unknown since {since} ({text}): {rapids} left "
                    "alone; state the modes again behind it (G40, G90, G21 and their kin)",
                )
            )
        return found

    def too_low(self) -> list[Finding]:
        """Name the first line that sets a limit too low."""
        if self.limited is None:
            return []
        name, at = self._place(self.limited.number)
        text = self.limited.text.strip()[:40].decode("latin-1")
        there = "" if name == self.name else f"line {at} of {name}: "
        return [
            Finding(
                None if there else self.limited.number,
                f"{there}this sets a limit of speed, acceleration or jerk ({text}) that is not "
                "known to be what the machine file states: rapids that may be beyond it are left "
                "alone",
            )
        ]

    def look_for_instant(self, chunk: Chunk) -> None:
        """Name the first byte that the control does not leave to the line in which it stands."""
        instant = self.dialect.text.instant
        if not instant or self._instant:
            return
        if len(chunk.data.translate(None, instant)) == len(chunk.data):
            return
        self._instant = True
        at = min(place for byte in instant if (place := chunk.data.find(byte)) >= 0)
        byte = chunk.data[at]
        told = f"'{byte:c}'" if byte in b"!~" else f"byte 0x{byte:02X}"
        told += " (of a letter?)" if byte >= 0x80 else ""
        self.syntax_problems.append(
            Finding(
                chunk.line + chunk.data.count(b"\n", 0, at),
                f"{told} is a command when it arrives (hold, override, macro), in a comment too: "
                "write it otherwise, or let the sender leave comments out",
            )
        )

    def add_problem(self, line: Line, problem: str, column: int | None = None) -> None:
        """Note a line that is not understood."""
        self.problem_count += 1
        if len(self.syntax_problems) < _SHOWN:
            name, number = self._place(line.number)
            place = Place(name, number, column, line.text[:200].decode("latin-1"))
            there = "" if name == self.name else f"line {number} of {name}: "
            self.syntax_problems.append(
                Finding(None if there else number, f"{there}block not understood: {problem}", place)
            )

    def _place(self, number: int) -> tuple[str, int]:
        """File and number of a line, which may stand in another file."""
        found = self.name, number
        for first, name, there in self.elsewhere:
            if first <= number:
                found = name, there + number - first
        return found
