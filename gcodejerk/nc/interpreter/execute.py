"""What one block does to the modal state, and what is to be said of it.

`Phases` holds the order in which its words act; here a block is tried, doubted, or run.

Rule: a block that the controller would refuse changes nothing for certain: its words are tried
out, and whatever they touched is unknown afterwards.
"""

from __future__ import annotations

import re

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import OVERRIDES_SET, Dialect
from gcodejerk.nc.interpreter import frames
from gcodejerk.nc.interpreter.arcs import in_doubt, lacks_feed
from gcodejerk.nc.interpreter.beams import inline_power
from gcodejerk.nc.interpreter.codes import Codes, sort_words
from gcodejerk.nc.interpreter.eligibility import Call, Step, looks_rapid, why_left_alone
from gcodejerk.nc.interpreter.left_on import left_by
from gcodejerk.nc.interpreter.limits import LIMIT, set_by_setting
from gcodejerk.nc.interpreter.modal import NAN, State, join
from gcodejerk.nc.interpreter.phases import Phases
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.refusals import refused_by_some
from gcodejerk.nc.interpreter.rules import is_complete, takes_twice
from gcodejerk.nc.interpreter.variables import assign, assigned_values, reads_feed
from gcodejerk.nc.text.block import Block
from gcodejerk.reasons import Reason
from gcodejerk.start import Start
from gcodejerk.units import MM_PER_INCH

_CALL_WORDS = frozenset("MNPL")
_SHOWS_OR_SETS = re.compile(rb"\$[ \t]*(?:[$#GINXH]|N?[0-9]*[ \t]*=.*)?[ \t]*", re.IGNORECASE)


class Executor(Phases):
    """Runs blocks against a state that it owns."""

    def __init__(self, dialect: Dialect, state: State, start: Start) -> None:
        super().__init__(dialect, state, start)
        self.decimal_point = start.decimal_point
        self.told_unfed = False
        """A feed move without F was named; there may be many."""
        self.calls_followed = False
        """Whoever runs the blocks runs what they call (`Step.call`)."""

    def run(self, block: Block) -> Step:
        """Execute a block that is not an O-word line."""
        state = self.state
        if not self.dialect.modal_motion:
            state.motion = None
        inch = state.unit == MM_PER_INCH
        codes = sort_words(block, self.dialect, inch, self.decimal_point, state.variables)
        step = self._begin(block, codes)
        before, ended = state.motion, state.ended
        self._execute(block, codes, step)
        state = self.state  # another one behind a code that some of the controls refuse
        if self.dialect.unknown_lasts and self._is_unknown(block, codes):
            state.put("bars", {**state.bars, "unknown code": True})
        step.beam |= state.spindle != 5
        step.habit |= block.problem is not None and inline_power(codes, block.rest)
        if reads_feed(block, self.dialect.arithmetic):
            step.feed_event = USES_FEED
        contour = self.contours.end is not None
        if contour:
            self.state = self.contours.take(self.state, block)
        elif codes.g.get("non-modal") in self.dialect.finishing:
            self.state = self.contours.finish(self.state, codes.values.get("Q", NAN))
        state = self.state
        step.end = step.end or state.position.copy()
        if step.fault or codes.unknown:
            step.rapid = step.rapid or looks_rapid(block, codes, step, before, self.dialect)
        if step.rapid:
            step.reason = why_left_alone(block, codes, step, state, self.dialect, ended, contour)
        return step

    def _is_unknown(self, block: Block, codes: Codes) -> bool:
        """Whether the block may do anything, for good."""
        jumps = self.dialect.text.keywords
        named = any(self._named(n) == "flow" and n.name not in jumps for n in codes.names)
        return codes.unknown or block.problem is not None or named

    def _begin(self, block: Block, codes: Codes) -> Step:
        """What is said of a block before it acts."""
        step = Step(start=self.state.position.copy(), beam=self.state.spindle != 5)
        for axis in codes.moved():
            step.words |= 1 << AXES.index(axis)
        step.unknown = codes.unknown_code if not codes.expression else ""
        if self.calls_followed and {w.letter for w in block.words} <= _CALL_WORDS:
            step.call = _call(codes, self.dialect)
        return step

    def _execute(self, block: Block, codes: Codes, step: Step) -> None:
        """Run a block, or doubt it; its values are read before any variable is set."""
        state, rules = self.state, self.dialect.arithmetic
        values = assigned_values(block, state, rules) if block.assigns else []
        for target in block.assigns:
            self._assign(target)
        if self._is_refused(block, codes):
            assign(block, [NAN] * len(block.assigns), state, rules)
            self._switch_overrides(block, [NAN] * len(block.assigns))
            self._doubt(block, codes, step)
            return
        if block.assigns:
            assign(block, values, state, rules)
            self._switch_overrides(block, values)
        code = refused_by_some(codes, state, self.dialect)
        doubt = self.dialect.arcs_refused and in_doubt(codes, state, self.dialect)
        slow = self.dialect.feed_needed and lacks_feed(codes, state, self.dialect)
        if code or slow or doubt is not False:
            what = "a feed move without F" if slow else "the arc"
            self._run_or_refuse(codes, step, code or what)
            told, self.told_unfed = self.told_unfed, self.told_unfed or slow
            if (told if slow else doubt is None) and not code:
                step.fault, step.refused = False, ""  # nothing is known against it
        else:
            self.act(codes, step)

    def _is_refused(self, block: Block, codes: Codes) -> bool:
        """Whether the control refuses the block, or may."""
        if codes.fault or block.problem is not None:
            return True
        if not is_complete(codes, self.state, self.dialect):
            return True
        # A block is a macro statement or an NC statement, says Fanuc: what is both may be neither.
        sets = bool(block.assigns) and self.dialect.text.open_expressions
        return sets and any(word.letter != "N" for word in block.words)

    def _run_or_refuse(self, codes: Codes, step: Step, code: str) -> None:
        """Run a block that some of the dialect's controls refuse: what both leave, is known."""
        before = self.state.copy()
        self.act(codes, step)
        if step.ends:
            self.state.forget(Reason.NOT_UNDERSTOOD)
            step.ends = False
        self.state = join(before, self.state)
        if not self.stays:
            self.state.forget_positions()  # who refuses, stops; and somebody goes on
        step.fault, step.refused = True, code
        if step.feed_event:
            step.feed_event = USES_FEED

    def _doubt(self, block: Block, codes: Codes, step: Step) -> None:
        """Forget what a block that is not understood may have changed."""
        state = self.state
        step.fault = True
        step.call = None
        before, state.touched, ended = state.touched, set(), state.ended
        bars, path_limits = state.bars, state.path_limits
        self.act(codes, step)
        state.put_back(bars, path_limits)
        if step.ends:
            state.forget(Reason.NOT_UNDERSTOOD)
            step.ends = False
        touched, state.touched = state.touched, before
        state.ended = ended
        state.forget_touched(touched, Reason.NOT_UNDERSTOOD)
        if block.problem is not None or not self.dialect.strict or takes_twice(codes, self.dialect):
            # A control that is not strict may run what we refuse, and move what it does not name.
            state.forget_positions()
        unread = self.dialect.feed_on_rapids or b"F" in block.rest.upper()
        if block.problem is not None and unread:
            state.put("feed", NAN)  # what is not read may hold an F, which rapids run at
        if block.problem is not None and _may_do_anything(block.rest):
            state.forget(Reason.NOT_UNDERSTOOD)
        if block.problem is not None:
            step.limits |= set_by_setting(state, block.rest, self.dialect, self.limits)
            left = left_by(block.rest, self.dialect)
            left.enter(state)
            step.limits |= LIMIT + "anything" in left.bars
        step.feed_event = USES_FEED

    def _assign(self, target: str) -> None:
        """Set a variable: one of the control's may hold offsets; an empty name may be any."""
        rules = self.dialect.arithmetic
        if not rules.offsets or (target and not target.isdigit()):
            return
        number = int(target) if target else rules.offsets
        if number < rules.offsets or number in rules.timers:
            return
        if rules.at_selection:
            self.state.offsets = {}
            self.state.put("rotates", True)  # one of them is the rotation
            self.state.lose("home")
        else:
            frames.data_written(self.state, self.lengths)

    def _switch_overrides(self, block: Block, values: list[float]) -> None:
        """Take what is written into the variable that switches overrides and feed hold."""
        for target, value in zip(block.assigns, values, strict=True):
            if target and target == self.dialect.arithmetic.overrides:
                self.state.put("bars", {**self.state.bars, OVERRIDES_SET: value != 0.0})

    def end(self) -> None:
        """End the program: what follows is not executed."""
        self.state.forget()
        self.state.put("motion", 10)
        self.state.ended = True


def _may_do_anything(rest: bytes) -> bool:
    """Whether text that is not understood may be a code, a variable, or a command of a control.

    Of the latter (``$SD/Run=part.nc``, ``$C``), those that show or set something are known.
    """
    if rest[:1] == b"$":
        return _SHOWS_OR_SETS.fullmatch(rest) is None
    return any(byte in b"GMOgmo#[\r" for byte in rest)


def _call(codes: Codes, dialect: Dialect) -> Call | None:
    """Take a call out of a block that holds nothing else."""
    number, repeats = codes.values.get("P", NAN), codes.values.get("L", 1.0)
    if len(codes.m) != 1 or codes.m[0] not in (97, 98) or codes.fault:
        return None
    if not (number > 0.0 and number.is_integer() and repeats > 0.0 and repeats.is_integer()):
        return None
    if dialect.m_groups.get(codes.m[0]) != "stop":
        return None
    return Call(codes.m[0], int(number), int(repeats) if "L" in codes.values else None)
