"""What one block does to the modal state, in the controller's own order of execution.

Rule 1: the order is fixed and stands in `_act`, top to bottom, whatever the order on the line
(LinuxCNC manual, "G-code order of execution").

Rule 2: a block that the controller would refuse changes nothing for certain: its words are tried
out, and whatever they touched is unknown afterwards.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect, Effect
from gcodejerk.nc.interpreter import frames
from gcodejerk.nc.interpreter.beams import inline_power, shows_habits, uses_outputs
from gcodejerk.nc.interpreter.codes import Codes, sort_words
from gcodejerk.nc.interpreter.cycles import begin_cycle, run_cycle
from gcodejerk.nc.interpreter.eligibility import Call, Step, looks_rapid, why_left_alone
from gcodejerk.nc.interpreter.flow_words import known_behind
from gcodejerk.nc.interpreter.mcodes import run_m_code
from gcodejerk.nc.interpreter.modal import GROUP_FIELDS, NAN, State
from gcodejerk.nc.interpreter.moves import (
    go_straight,
    go_to_machine_position,
    go_to_stored_point,
    plane_axes,
)
from gcodejerk.nc.interpreter.rapids import GIVES_FEED, NO_FEED, USES_FEED
from gcodejerk.nc.interpreter.rules import arc_words, is_complete, takes_axes
from gcodejerk.nc.interpreter.variables import assign, assigned_values, reads_feed
from gcodejerk.nc.text.block import Block, Name
from gcodejerk.nc.text.tokenizer import CHECKSUM
from gcodejerk.start import Start
from gcodejerk.units import MM_PER_INCH

_TAKES_WORDS: frozenset[Effect] = frozenset({"words", "cycle", "home", "flow", "modal cycle"})
"""Effects beside which the axis words of the block are no straight move."""
_ENDS = frozenset({2, 17, 30, 99})
_STOPS = frozenset({0, 1, 60})
_CALL_WORDS = frozenset("MNPL")


class Executor:
    """Runs blocks against a state that it owns."""

    def __init__(self, dialect: Dialect, state: State, start: Start) -> None:
        self.dialect = dialect
        self.state = state
        self.lengths = dict(start.tool_lengths)
        self.decimal_point = start.decimal_point
        self._stays = start.resume == "same" or (start.resume is None and dialect.same_after_stop)
        """Behind M0 and M1 the axes stand where they stood."""
        self._contour: float | None = None
        """N of the block that ends a contour, which a cycle runs by itself."""
        self.jumps_known = False
        """Whoever runs the blocks forgets everything at the targets of jumps."""
        self.calls_followed = False
        """Whoever runs the blocks runs what they call (`Step.call`)."""

    def run(self, block: Block) -> Step:
        """Execute a block that is not an O-word line."""
        state = self.state
        if not self.dialect.modal_motion:
            state.motion = None
        inch = state.unit == MM_PER_INCH
        rules = self.dialect.arithmetic
        codes = sort_words(block, self.dialect, inch, self.decimal_point, state.variables)
        step = Step(start=state.position.copy(), beam=state.spindle != 5)
        for axis in codes.moved():
            step.words |= 1 << AXES.index(axis)
        values = assigned_values(block, state, rules) if block.assigns else []
        for target in block.assigns:
            self._assign(target)
        step.unknown = codes.unknown_code if not codes.expression else ""
        before = state.motion
        ended = state.ended
        if self.calls_followed and {w.letter for w in block.words} <= _CALL_WORDS:
            step.call = _call(codes, self.dialect)
        if (
            codes.fault
            or block.problem is not None
            or not is_complete(codes, self.state, self.dialect)
        ):
            assign(block, [NAN] * len(block.assigns), state, rules)
            self._doubt(block, codes, step)
        else:
            if block.assigns:
                assign(block, values, state, rules)
            self._act(codes, step)
        step.beam |= state.spindle != 5
        step.habit |= block.problem is not None and inline_power(codes, block.rest)
        if reads_feed(block, rules):
            step.feed_event = USES_FEED
        contour = self._contour is not None
        if contour:
            self._leave_contour(block)
        step.end = step.end or state.position.copy()
        if step.fault or codes.unknown:
            step.rapid = step.rapid or looks_rapid(block, codes, step, before, self.dialect)
        if step.rapid:
            step.reason = why_left_alone(block, codes, step, state, self.dialect, ended, contour)
        return step

    def _leave_contour(self, block: Block) -> None:
        """Forget what a block of a contour said: it did not run here."""
        self.state.forget_positions()
        self.state.put("motion", None)
        self.state.put("feed", NAN)
        if any(word.letter == "N" and word.value == self._contour for word in block.words):
            self._contour = None

    def _doubt(self, block: Block, codes: Codes, step: Step) -> None:
        """Forget what a block that is not understood may have changed."""
        state = self.state
        step.fault = True
        step.call = None
        before, state.touched, ended = state.touched, set(), state.ended
        self._act(codes, step)
        if step.ends:
            state.forget()
            step.ends = False
        touched, state.touched = state.touched, before
        state.ended = ended
        state.forget_touched(touched)
        if block.problem is not None or not self.dialect.strict:
            # A control that is not strict may run what we refuse, and move what it does not name.
            state.forget_positions()
        if block.problem is not None and any(byte in b"GMOgmo#[" for byte in block.rest):
            state.forget()
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
        else:
            frames.data_written(self.state, self.lengths)

    def _act(self, codes: Codes, step: Step) -> None:
        """Execute, in the fixed order."""
        state, g, values, dialect = self.state, codes.g, codes.values, self.dialect
        if codes.unknown or not self._goes_on(codes, step):
            state.forget()
            step.feed_event = USES_FEED
            return
        if "feed mode" in g:
            mode = dialect.feed_modes.get(g["feed mode"])
            if mode != state.feed_mode:
                state.put("feed", NAN)
            state.put("feed_mode", mode)
            state.put("feed_mode_stated", True)
        words_taken = any(dialect.effect(code) == "words" for code in g.values()) or (
            dialect.one_command and not g
        )
        if "F" in values and not words_taken:
            state.put("feed", values["F"])
            state.put("feed_whole", codes.feed_whole)
            if values["F"] == values["F"]:
                step.feed_event = GIVES_FEED
        for m in codes.m:
            if run_m_code(state, m, dialect, step):
                self._leave(step)
            if m in dialect.m_bars:
                p = values.get("P", 1.0)
                state.put("bars", {**state.bars, dialect.m_bars[m]: None if p != p else p != 0.0})
        if dialect.tool_word_moves and "T" in values:
            state.forget_positions()
        if dialect.length_word in values and "tool length" not in g:
            frames.tool_length(state, 0, values, {}, dialect)
        if not dialect.tool_frame.isdisjoint(values):
            state.lose("tool")
            state.forget_positions()
            frames.end_bar(state, "tool data written")
        if state.cycle is not None and g.get("distance", state.distance) != state.distance:
            # R and Z that stay in force across G90/G91 are read anew in a way not documented
            state.put("cycle", (state.cycle[0], NAN, NAN))
            state.put("cycle_level", NAN)
        for group, code in g.items():
            if (name := GROUP_FIELDS.get(group)) is not None and group != "motion":
                state.put(name, code)
            if code in dialect.transforms:
                self._transform(*dialect.transforms[code])
            if code in dialect.bars:
                name, on = dialect.bars[code]
                p = values.get("P", 0.0)
                begins = (None if p != p else p != 0.0) if on == "P" else on
                state.put("bars", {**state.bars, name: begins})
        if "units" in g:
            unit = MM_PER_INCH if dialect.units[g["units"]] else 1.0
            own = g["units"] not in dialect.lengths_only
            self._units(unit, unit if own else state.feed_unit, "F" in values)
        for code in g.values():
            self._effect(dialect.effect(code), code, values, step)
        effects = [self._named(name) for name in codes.names]
        if "modal cycle" in effects:
            # MCALL with a cycle begins one, which runs later; MCALL alone ends it.
            step.leaves = len(effects) > 1
            self._modal_cycle(begins=step.leaves)
            words_taken = True
        else:
            for effect in effects:
                if effect == "flow":
                    continue
                if effect == "feed override":
                    state.put("bars", {**state.bars, effect: True})
                if effect == "feed group":
                    self._feed_group(codes.names)
                self._effect(effect, 0, values, step)
                words_taken |= effect in _TAKES_WORDS or effect in ("frames", "transform")
        if "path" in g:
            code = g["path"]
            continuous = code == 640
            state.put("path", dialect.paths.get(code))
            state.put("path_p", values.get("P", NAN) if continuous else NAN)
            state.put("path_q", values.get("Q", NAN) if continuous else NAN)
        if "distance" in g:
            state.put("distance_stated", True)
        if words_taken or any(dialect.effect(code) in _TAKES_WORDS for code in g.values()):
            if "motion" in g:
                self._select_motion(g["motion"])
            self._contour = values.get("Q") if g.get("non-modal") in dialect.contours else None
            if dialect.one_command and not g and step.words and not codes.m:
                state.forget_positions()  # words without a command: a build may take them for one
        else:
            self._move(codes, step)
        feeds = bool(step.words) and state.motion != dialect.rapid
        step.habit = shows_habits(codes, state, feeds, dialect)
        step.outputs = uses_outputs(codes)
        step.end = state.position.copy()
        for m in codes.m:
            if self.dialect.m_groups.get(m) != "stop":
                continue
            if m in _ENDS:
                step.ends = True
            elif m in _STOPS and not self._stays:
                state.forget_positions()  # meanwhile somebody may have moved them by hand

    def _goes_on(self, codes: Codes, step: Step) -> bool:
        """Whether the block leads to the next one, and what it leaves known is certain."""
        for name in codes.names:
            if self._named(name) != "flow":
                continue
            step.feed_event = USES_FEED
            changed = known_behind(name) if self.jumps_known else None
            beside = name.name and (codes.g or codes.m or codes.values or len(codes.names) > 1)
            if changed is None or beside:
                return False
            for variable in changed:
                self.state.set_variable(variable, NAN)
        return True

    def _named(self, name: Name) -> Effect:
        """What a named word does; one that is not known may do anything."""
        if name.name == CHECKSUM:
            return "none"
        if name.name in self.dialect.text.keywords:
            return "flow"
        return self.dialect.names.get(name.name, "flow")

    def _feed_group(self, names: list[Name]) -> None:
        """FGROUP(X,Y): F is the speed of these axes alone; FGROUP() is all again."""
        group = [n.arguments.strip(b"() \t") for n in names if self._named(n) == "feed group"]
        self.state.put("bars", {**self.state.bars, "feed group": any(group)})

    def _units(self, unit: float, feed_unit: float | None, beside_feed: bool) -> None:
        """Take a new unit of lengths, and of F."""
        state = self.state
        # G21 F100 at the top: the F is meant in mm. Should the control have started in inches and
        # read it so, restoring F100 is the slower of the two; with G20 F10 it would be the faster.
        slower = unit == 1.0 or not self.dialect.feed_before_units
        if feed_unit != state.feed_unit and not (
            beside_feed and state.feed_unit is None and slower
        ):
            state.put("feed", NAN)
        state.put("feed_unit", feed_unit)
        if unit != state.unit:
            for name in ("path_p", "path_q"):
                state.put(name, NAN)
            if state.cycle is not None:
                state.put("cycle", (state.cycle[0], NAN, NAN))
                state.put("cycle_level", NAN)
        state.put("unit", unit)
        state.put("unit_stated", True)

    def _transform(self, name: str, on: bool) -> None:
        """Begin or end a rotation, scaling, mirroring or polar frame."""
        state = self.state
        if on or state.transforms.get(name, False) is not False:
            state.forget_positions()
        if on or name in state.transforms:
            state.put("transforms", {**state.transforms, name: on})

    def _effect(self, effect: Effect, code: int, values: dict[str, float], step: Step) -> None:
        """Do what a code outside the non-modal group, or a name, does besides."""
        state = self.state
        if effect in ("diameter", "radius"):
            state.put("turns", state.turns or effect == "diameter")
            state.put("diameter", effect == "diameter")
        elif effect == "either":
            state.put("turns", True)
            state.put("diameter", None)
        elif effect == "length":
            frames.tool_length(state, code, values, self.lengths, self.dialect)
        elif effect == "system":
            other = "P" in values and code in self.dialect.p_selects
            frames.select_system(state, 0 if other else code)
        elif effect == "numbered system":
            number = values.get("P", NAN)
            frames.select_system(state, frames.numbered_system(number))
        elif effect == "frames":
            state.forget_frame()
            state.forget_positions()
        elif effect == "written":
            frames.data_written(state, self.lengths)
        elif effect == "data":
            frames.write_data(state, self.lengths, values)
        elif effect == "transform":
            self._transform("frame", on=True)
        elif effect == "modal cycle":
            step.leaves = True
            self._modal_cycle(begins=True)  # G67, which ends it, is among the transforms
        elif effect == "cycle":
            step.feed_event = USES_FEED
            state.forget_positions()
            state.put("motion", None)
            state.put("feed", NAN)
        elif effect == "home":
            state.forget_positions()
        elif effect == "flow":
            self._leave(step)

    def _modal_cycle(self, begins: bool) -> None:
        """Begin or end a cycle or macro that runs at every position."""
        state = self.state
        state.put("transforms", {**state.transforms, "modal macro": begins})
        state.forget_positions()

    def _leave(self, step: Step) -> None:
        """Run a program that is not followed."""
        self.state.forget()
        step.feed_event = USES_FEED
        step.leaves = True

    def end(self) -> None:
        """End the program: what follows is not executed."""
        self.state.forget()
        self.state.put("motion", 10)
        self.state.ended = True

    def _move(self, codes: Codes, step: Step) -> None:
        """Execute the motion, or what takes its axis words away."""
        state, g, values, dialect = self.state, codes.g, codes.values, self.dialect
        user = g.get("non-modal")
        effect = dialect.effect(user)
        step.start = state.position.copy()  # behind a tool change or a new frame, before the move
        if not dialect.strict and "motion" in g:
            self._select_motion(g["motion"])
        if effect == "return":
            step.rapid = True
            go_to_stored_point(state, codes, dialect)
            return
        if effect == "set":
            frames.set_names(state, codes, dialect)
        else:
            frames.change(state, effect, values, self.lengths)
        if effect in ("table", "local", "set", "frames", "data"):
            return
        if step.words and takes_axes(codes):
            return
        if dialect.strict and "motion" in g:
            self._select_motion(g["motion"])
        cycle = self._cycle(g)
        if not step.words and not arc_words(values, self.state):
            if cycle is not None and "cycle" in g:
                begin_cycle(state, cycle, values)
            return
        motion = state.motion
        if motion is None and cycle is None:
            state.forget_positions()
            state.put("cycle", None)
            step.feed_event = USES_FEED
            return
        runs_at_feed = motion != dialect.rapid or dialect.feed_on_rapids
        if (runs_at_feed or cycle is not None) and step.feed_event == NO_FEED:
            step.feed_event = USES_FEED
        if cycle is not None:
            step.rapid = step.cycle = True
            beside = "cycle" in g and "motion" in g
            if beside or codes.increments or not run_cycle(state, cycle, values, dialect.drilling):
                step.fault = True
                state.forget_positions()
                state.put("cycle", None)
                if dialect.drilling.own_group:
                    state.lose("cycle")  # refused or not (K0): positions may drill from here on
            return
        step.rapid = motion == dialect.rapid
        if effect == "machine":
            go_to_machine_position(state, values)
        elif motion in dialect.redrawn or motion is None:
            state.forget_positions(plane_axes(state))
            state.forget_positions(AXES.index(axis) for axis in codes.moved())
        else:
            go_straight(state, codes, step)
        if state.compensation != 400:
            state.forget_positions(plane_axes(state))
        if any(on is not False for on in state.transforms.values()):
            state.forget_positions()

    def _select_motion(self, code: int) -> None:
        self.state.put("motion", code)
        if code not in self.dialect.cycles:
            self.state.put("cycle", None)

    def _cycle(self, g: dict[str, int]) -> int | None:
        """Code of the canned cycle that the block's positions belong to."""
        state, drilling = self.state, self.dialect.drilling
        if not drilling.own_group:
            return state.motion if state.motion in drilling.codes else None
        code = g.get("cycle")
        if code is None:
            return None if state.cycle is None else state.cycle[0]
        if code in drilling.codes:
            return code
        state.put("cycle", None)
        return None


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
