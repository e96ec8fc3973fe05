"""Which block runs next: the main program in the order of the file, and what it enters.

Rule: the file is read once, forwards. What may run more than once, or from elsewhere, is followed
by `flow.o_words` (LinuxCNC's structures, which are collected until they are complete) or
`flow.subprograms` (those that stand somewhere else in the file); where that is not possible,
`flow.branches` forgets.
"""

from __future__ import annotations

import re

import numpy as np

from gcodejerk.nc.dialects.dialect import Dialect, code_name
from gcodejerk.nc.flow.branches import Flow
from gcodejerk.nc.flow.jumps import is_target
from gcodejerk.nc.flow.o_words import Passes
from gcodejerk.nc.flow.structures import Collector, Node
from gcodejerk.nc.flow.subprograms import Calls
from gcodejerk.nc.interpreter.beams import darkness
from gcodejerk.nc.interpreter.computed import Computed, Form, Forms
from gcodejerk.nc.interpreter.left_on import LeftOn
from gcodejerk.nc.interpreter.modal import FIELDS, GROUP_FIELDS, MODES, State
from gcodejerk.nc.interpreter.rapids import USES_FEED, RapidLog, Rapids
from gcodejerk.nc.interpreter.runner import Finding, Runner
from gcodejerk.nc.interpreter.runs import can_run, run_plain
from gcodejerk.nc.interpreter.unfed import can_run_unfed, run_unfed
from gcodejerk.nc.text.block import Block, Line
from gcodejerk.nc.text.chunks import BYTE_ORDER_MARK
from gcodejerk.nc.text.tokenizer import parse_line
from gcodejerk.nc.text.words import Lines
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.start import Start

_FILE_NAME = re.compile(
    rb"[ \t]*(?:\$[\w-]*|[A-Za-z_][\w-]*)\.[A-Za-z]{1,5}%?[ \t]*(?:\([^()]*\)[ \t]*)?"
)

REMEMBERED, SHORT = 1 << 12, 80
"""Lines that are remembered in parts, and how long they are at most. [bytes]"""
SHORT_RUN = 24
"""Fewer plain lines than this between careful ones go the careful way; arrays would not pay."""
FEWEST_COMPUTED, MOST_COMPUTED = 12, 1 << 12
"""Lines of a run whose numbers are computed: fewer go the careful way, more are another run."""


class Reader:
    """Follows a program line by line."""

    def __init__(self, name: str, dialect: Dialect, start: Start) -> None:
        self.name = name
        self.dialect = dialect = dialect.set_up(start)
        self.runner = Runner(name, dialect, start)
        self._spindle = start.spindle
        self.flow = Flow()
        self.passes = Passes(self.runner, start.subprograms)
        self.calls: Calls | None = None
        self.blocks = 0
        self.percent: int | None = None
        """The line of the opening ``%``."""
        self.insert_at = 0
        self.started = False
        """A line that is not blank has been read."""
        self._structure = Collector()
        self._parsed: dict[bytes, Block] = {}
        self._forms = Forms(dialect, self._block)
        self._by_hand, self._patience = 0, FEWEST_COMPUTED
        """Up to this line no numbers are computed ahead; and for how many lines then."""
        self._targets: frozenset[int] | None = None
        self._plain = True

    @property
    def state(self) -> State:
        """The state in force."""
        return self.runner.state

    @property
    def used(self) -> tuple[str, ...]:
        """Files in which subprograms were found."""
        return tuple(self.passes.used)

    @property
    def log(self) -> RapidLog:
        """The rapids so far."""
        return self.runner.log

    @property
    def problem_count(self) -> int:
        """Lines so far that were not understood."""
        return self.runner.problem_count

    @property
    def inside(self) -> bool:
        """Whether the line belongs to a structure or a subprogram."""
        return self.flow.inside or self.collecting

    @property
    def collecting(self) -> bool:
        """Whether lines wait for the end of their structure."""
        return bool(self._structure)

    def refer(self, calls: Calls) -> None:
        """Follow the jumps and calls that the file was found to make."""
        outline = calls.outline
        self.calls = calls
        self._targets = outline.targets
        self._plain = outline.plain
        self.runner.executor.jumps_known = True
        self.runner.call = calls.call
        if outline.repeats:
            self.forget_start(outline.groups, outline.left_on)

    def forget_start(self, groups: frozenset[str] | None, left: LeftOn) -> None:
        """Forget what the last line may leave to the first one, where the program repeats."""
        state = self.state
        kept = [field for field in FIELDS if field.name in MODES or field.together in MODES]
        values = [getattr(state, field.name) for field in kept]
        state.forget()
        if groups is not None:
            stated = {GROUP_FIELDS.get(group, group.replace(" ", "_")) for group in groups}
            stated |= {"unit"} if "units" in groups else set()
            for field, value in zip(kept, values, strict=True):
                if stated.isdisjoint((field.name, field.together)):
                    state.put(field.name, value)
        left.enter(state)

    def read_line(self, text: bytes, begin: int, number: int, terminator: int) -> None:
        """Take one line the careful way; text without its LF."""
        if begin == 0 and text.startswith(BYTE_ORDER_MARK):
            begin = self.insert_at = len(BYTE_ORDER_MARK)
            text = text[begin:]
        if text.endswith(b"\r"):
            text = text[:-1]
            terminator = 2 if terminator else 3
        block = self._block(text)
        line = Line(text, begin, number, terminator, block)
        if self._structure:
            self._collect(line)
        elif block.percent:
            self._percent(line)
        elif (
            block.words or block.assigns or block.names or block.problem or block.o_word is not None
        ):
            self._read_block(line)
        else:
            if text.startswith(b";$") and not self.blocks and terminator:
                # ;$PATH= belongs to the head of a Siemens program
                self.insert_at = line.end
            self.started = self.started or bool(block.comments)

    def _block(self, text: bytes) -> Block:
        """Take a line apart, and remember it: in programs by variables many are the same."""
        if block := self._parsed.get(text):
            return block
        block = parse_line(text, self.dialect)
        if len(text) <= SHORT:
            if len(self._parsed) >= REMEMBERED:
                self._parsed.clear()
            self._parsed[text] = block
        return block

    def _read_block(self, line: Line) -> None:
        """Take a line that says something."""
        block = line.block
        first = not self.blocks
        self.started = True
        if block.problem is not None and self._is_name(line.text):
            return
        if first and block.o_word == "" and line.terminator:
            self.insert_at = line.end  # the number of a program goes first
        self._count(line)
        follows = self.dialect.text.o_word == "flow" and not self.passes.exhausted
        if follows and Collector.opens(block) and not self.flow.inside and not self.state.ended:
            self._collect(line, counted=True)
        else:
            self._run(line, first)

    def _count(self, line: Line) -> None:
        block = line.block
        self.blocks += bool(block.words or block.names or block.o_word is not None)
        if block.problem is not None:
            self.runner.add_problem(line, block.problem, block.column)

    def _is_name(self, text: bytes) -> bool:
        """Whether the first line is the name of the file."""
        leader = self.dialect.text.leader and not self.blocks
        return leader and _FILE_NAME.fullmatch(text) is not None

    def can_run(self) -> bool:
        """Whether the lines that follow may be taken as a run."""
        alone = self._plain and not self.flow.inside and not self._structure
        if not (self.dialect.quick and self.started and alone):
            return False
        if self._unfed:
            return self.runner.executor.told_unfed and can_run_unfed(self.state, self.dialect)
        return can_run(self.state, self.dialect)

    @property
    def _unfed(self) -> bool:
        """Whether the control refuses feed moves, since there is no F."""
        return self.dialect.feed_needed and not self.state.feed > 0.0

    def read_run(self, lines: Lines, first: int, last: int, place: tuple[int, int]) -> int:
        """Take plain lines of a chunk as arrays; the first that was not taken."""
        what = (self.state, self.log, lines, first, last, place, self.dialect)
        executor = self.runner.executor
        if self._unfed:
            taken = run_unfed(*what, executor.stays)
        else:
            taken = run_plain(*what, executor.rapid_feed)
        self.blocks += int(np.count_nonzero(lines.letters[first : taken.stop]))
        self.runner.took(taken)
        return taken.stop

    def read_computed(self, data: bytes, lines: Lines, first: int, place: tuple[int, int]) -> int:
        """Take lines of a chunk whose numbers are computed; the first that was not taken."""
        number = place[0] + first
        if number < self._by_hand or self.dialect.text.klartext or not self.can_run():
            return first
        said, seen = self._computable(data, lines, first)
        if len(said) < FEWEST_COMPUTED:
            self._by_hand = number + seen
            return first
        computed = Computed([(form, typed) for _, form, typed in said], self.state, self.dialect)
        spelled = computed.lines(lines, first)
        last = len(spelled)
        if spelled.careful.any():
            last = int(np.argmax(spelled.careful))
            self._forms.set_apart(said[last][0])
        stop = self.read_run(spelled, 0, last, (number, place[1])) if last else 0
        computed.take_back(stop)
        if stop < FEWEST_COMPUTED:
            # In vain, as at every other line that is not sure: look ahead ever less often.
            self._by_hand = number + stop + self._patience
            self._patience *= 2
        else:
            self._patience = FEWEST_COMPUTED
        return first + stop

    def _computable(
        self, data: bytes, lines: Lines, first: int
    ) -> tuple[list[tuple[bytes, Form, list[bytes]]], int]:
        """Lines that a run may hold, up to where many plain ones follow; and how many were seen."""
        last = min(first + MOST_COMPUTED, len(lines))
        places = zip(lines.begin[first:last].tolist(), lines.end[first:last].tolist(), strict=True)
        said: list[tuple[bytes, Form, list[bytes]]] = []
        plain = 0
        for begin, end in places:
            text = data[begin:end]
            form, typed = self._forms.of(text)
            if form is None:
                return said, len(said) + 1
            said.append((text, form, typed))
            plain = 0 if form.computes else plain + 1
            if plain == SHORT_RUN:
                return said[:-plain], len(said)
        return said, len(said)

    def _run(self, line: Line, first: bool = False) -> None:
        """Execute a line of the main program."""
        runner, block = self.runner, line.block
        if block.o_word is not None and block.problem is None:
            self._o_word(line, first)
            return
        inside = self.flow.inside
        if self.calls is not None:
            self._follow_jumps(line)
        executed = not runner.state.ended and (not inside or self.calls is None)
        runner.left = self._leave if executed else _nothing
        ended = runner.run(line, uncertain=inside)
        if executed and self.calls is not None and line.number in self.log.visits.rows:
            self.log.visits.spoil(line.number, line.number)
        if ended is not None:
            if ended is runner.state:
                runner.executor.end()
            self.flow.end_of_subprogram()
        elif runner.state.ended:
            self.flow.end_of_subprogram()

    def _follow_jumps(self, line: Line) -> None:
        """Forget everything where a jump may lead to; follow calls where the line runs."""
        assert self.calls is not None
        runner = self.runner
        if self._targets is not None and is_target(line.block, self._targets):
            runner.log.feed_event(USES_FEED)
            runner.state.line = line
            runner.state.forget()
            runner.state.ended = False
        self.calls.main_line = line.number
        runs = not runner.state.ended and not self.flow.inside
        runner.executor.calls_followed = runs

    def _leave(self) -> None:
        """Programs run that are not followed."""
        self.passes.lose()
        if self.calls is not None:
            self.calls.lose()

    def _percent(self, line: Line) -> None:
        """Take a lone %: the first one opens the program, the second one ends it."""
        self.state.line = line
        if not self.blocks and self.percent is None:
            first = not self.started or self.dialect.text.leader
            if not first and not self.dialect.text.leader:
                self.runner.add_problem(line, "this control reads a % on its first line only", 1)
            self.started = True
            self.percent = line.number
            self.insert_at = line.end
        elif self.percent is not None:
            self.runner.executor.end()
        else:
            self.runner.add_problem(
                line, "% in the middle of a program that did not begin with one", 1
            )
            self.state.forget(Reason.NOT_UNDERSTOOD)
            self.log.feed_event(USES_FEED)
        if any(word.letter == "G" for word in line.block.words):
            self._read_block(line)  # %NAME G71 * of Heidenhain

    def _o_word(self, line: Line, first: bool) -> None:
        """Take a line of program flow that stands alone."""
        block = line.block
        assert block.o_word is not None
        calls = block.o_word == "call" and not self.state.ended
        words = any(word.letter != "N" for word in block.words)
        beside = words or block.assigns or block.block_delete
        if calls and not beside and not self.flow.inside and not self.passes.exhausted:
            self._pass(Node("call", "", line))
            return
        self.state.line = line
        self.log.feed_event(USES_FEED)
        if calls:
            self.passes.lose()
        for target in block.assigns:
            if not target or target.isdigit():
                self.state.offsets = {}
        if block.assigns:
            self.state.forget_variables()
        self.runner.state = self.flow.apply(self.state, block.o_word, block.o_name, first)
        self.log.stops |= self.flow.leads_elsewhere
        if block.o_word == "" and not first:
            self.state.ended = False  # what stands here may be called

    def _collect(self, line: Line, counted: bool = False) -> None:
        """Take a line of a structure; run the structure when it is complete."""
        if not counted:
            self._count(line)
        try:
            node = self._structure.add(line)
        except ValueError:
            self._replay()
            return
        if node is None:
            return
        lines = self._structure.take()
        if node.kind == "sub":
            self.passes.define(node)
        else:
            self._pass(node)
        self.runner.enter_unreached(lines)

    def _pass(self, node: Node) -> None:
        """Run a structure, or a call."""
        if not self.passes.run(node):
            self.runner.executor.end()

    def _replay(self) -> None:
        """Take the lines of a structure that cannot be followed."""
        for line in self._structure.take():
            if line.block.percent:
                self._percent(line)
            elif line.block.o_word is not None or _says(line):
                self._run(line)

    def finish(self) -> None:
        """Take the end of the file."""
        self._finish_log()
        if self._structure:
            self._replay()
        if self.calls is not None:
            self.calls.finish()

    def _finish_log(self) -> None:
        """Say what only the whole program tells."""
        log = self.log
        log.dark = darkness(self.dialect, self._spindle, log.habits, log.outputs)

    def findings(self, rapids: Rapids) -> tuple[Finding, ...]:
        """Collect what the user should know."""
        runner = self.runner
        found = list(runner.syntax_problems)
        if runner.problem_count > len(found):
            found.append(
                Finding(None, f"{runner.problem_count - len(found)} more lines not understood")
            )
        lines = rapids.line[rapids.reason == REASONS.index(Reason.UNITS_UNKNOWN)]
        if len(lines):
            codes = _unit_codes(self.dialect)
            found.append(
                Finding(
                    int(lines[0]),
                    f"nobody says whether lengths are mm or inches: put {codes} in front of it, or "
                    "what the control starts with into program.startup of the machine file",
                )
            )
        for line, codes, assumed in (
            (runner.asked_distance, "G90 or G91", "G90"),
            (runner.asked_feed_mode, "G93, G94 or G95", "G94"),
        ):
            if line is not None:
                found.append(
                    Finding(line, f"no {codes} before the first rapid: {assumed} is assumed")
                )
        found += runner.losses()
        if (rapids.reason == REASONS.index(Reason.LIMIT_SET)).any():
            found += runner.too_low()
        if not self.state.ended:
            found.append(Finding(None, "program ends without M2, M30 or a closing %"))
        return tuple(found)


def _says(line: Line) -> bool:
    """Whether a line holds more than comments."""
    block = line.block
    return bool(block.words or block.assigns or block.names or block.problem)


def _unit_codes(dialect: Dialect) -> str:
    """The codes for mm and for inches."""
    codes = {inch: code_name(code).decode() for code, inch in dialect.units.items()}
    return " or ".join(codes[inch] for inch in (False, True) if inch in codes)


def _nothing() -> None:
    """Nothing runs here."""
