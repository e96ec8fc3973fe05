"""What the words of a block do to the modal state, one phase after another.

Rule: the order is fixed and stands in `Phases.act`, top to bottom, whatever the order on the line
(LinuxCNC manual, "G-code order of execution"). Each phase says which words it takes, and why it
stands where it does.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import (
    CYCLE_CALL,
    LEFT_OVER,
    MACHINE_WORDS,
    PLANES,
    Dialect,
    Effect,
)
from gcodejerk.nc.dialects.gcodes import G1, G4, G40, G64, G80
from gcodejerk.nc.interpreter import frames, limits
from gcodejerk.nc.interpreter.beams import shows_habits, uses_outputs
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.contours import Contours
from gcodejerk.nc.interpreter.cycles import begin_cycle, run_cycle
from gcodejerk.nc.interpreter.effects import Effects
from gcodejerk.nc.interpreter.eligibility import Step
from gcodejerk.nc.interpreter.mcodes import run_m_code
from gcodejerk.nc.interpreter.modal import GROUP_FIELDS, NAN, State
from gcodejerk.nc.interpreter.moves import (
    displace,
    go_straight,
    go_to_machine_position,
    go_to_stored_point,
    leaves_offset,
    plane_axes,
)
from gcodejerk.nc.interpreter.named_cycles import drill_behind
from gcodejerk.nc.interpreter.rapids import GIVES_FEED, NO_FEED, USES_FEED
from gcodejerk.nc.interpreter.rules import (
    arc_words,
    counts_as_feed,
    moves_without_axes,
    takes_axes,
)
from gcodejerk.nc.interpreter.variables import forget_shared
from gcodejerk.reasons import Reason
from gcodejerk.start import Start
from gcodejerk.units import MM_PER_INCH

_TAKES_WORDS: frozenset[Effect] = frozenset(
    {"words", "cycle", "home", "measure", "flow", "modal cycle", "swivel"}
)
"""Effects of a code beside which the axis words of the block are no straight move."""
_NAME_TAKES_WORDS: frozenset[Effect] = (_TAKES_WORDS - {"flow"}) | {
    *("frames", "transform", "shift", "further shift", "turned frame", "further turn", "watch")
}
"""The same of a name; one of flow that goes on to the next block leaves the words to the motion."""
_TAKES_AXES: frozenset[Effect] = frozenset({"table", "local", "set", "frames", "data"})
"""Effects of a non-modal code that the axis words belong to."""
_ENDS = frozenset({2, 17, 30, 99})
_STOPS = frozenset({0, 1, 60})


class Phases(Effects):
    """Executes the words of blocks on a state."""

    def __init__(self, dialect: Dialect, state: State, start: Start) -> None:
        super().__init__(dialect, state, start)
        self.stays = start.resume == "same" or (start.resume is None and dialect.same_after_stop)
        """Behind M0 and M1 the axes stand where they stood."""
        self._tool_change = start.tool_change
        self.rapid_feed = start.rapid_feed
        """Feed moves that count as rapids."""
        self.contours = Contours()

    def act(self, codes: Codes, step: Step) -> None:
        """Execute the words of a block, in the fixed order."""
        understood = not codes.unknown
        if codes.unknown or not self._goes_on(codes, step):
            self.state.forget(Reason.NOT_FOLLOWED if understood else Reason.NOT_UNDERSTOOD)
            step.feed_event = USES_FEED
            return
        self._feed_mode(codes)
        self._feed(codes, step)
        self._m_codes(codes, step)
        self._tool_words(codes)
        self._modal_groups(codes)
        self._units(codes)
        self._g_effects(codes, step)
        self._names(codes, step)
        self._path(codes)
        self._motion(codes, step)
        self._corners(codes)
        self._beams(codes, step)
        step.end = self.state.position.copy()
        self._stop(codes, step)

    def _feed_mode(self, codes: Codes) -> None:
        """G93, G94, G95: in front of F, since another mode makes the old F meaningless."""
        state, code = self.state, codes.g.get("feed mode")
        if code is None:
            return
        mode = self.dialect.feed_modes.get(code)
        if mode != state.feed_mode:
            state.put("feed", NAN)
        state.put("feed_mode", mode)
        state.put("inverse", None if mode is None else mode == 93)
        state.put("feed_mode_stated", True)

    def _feed(self, codes: Codes, step: Step) -> None:
        """F, where it is a feed: in a dwell it may be a time."""
        if "F" not in codes.values:
            return
        counts = counts_as_feed(codes, self.dialect, taken=self._dwells(codes))
        if counts is False:
            return
        feed = codes.values["F"] if counts else NAN
        self.state.put("feed", feed)
        self.state.put("feed_whole", codes.feed_whole)
        if feed == feed:
            step.feed_event = GIVES_FEED

    def _m_codes(self, codes: Codes, step: Step) -> None:
        """M codes but stops: a program that is not followed leaves nothing of what stood before."""
        state, dialect = self.state, self.dialect
        for m in codes.m:
            if run_m_code(state, m, dialect, step, self._tool_change):
                self._leave(step)
            self._bar_by_code(m, codes.values, step)

    def _tool_words(self, codes: Codes) -> None:
        """T, D and the like where they move the tool or its frame; G43 comes with the codes."""
        state, dialect, values = self.state, self.dialect, codes.values
        if dialect.tool_word_moves and "T" in values and self._tool_change is None:
            state.forget_positions()
            state.put("cycle_level", NAN)
        if dialect.length_word in values and "tool length" not in codes.g:
            frames.tool_length(state, 0, values, {}, dialect)
        if dialect.tool_frame & {"T"} & set(values) and dialect.text.variables in ("R", "Q"):
            forget_shared(state, dialect.arithmetic)
        if not dialect.tool_frame.isdisjoint(values):
            state.lose("tool")
            state.forget_positions()
            frames.end_bar(state, "tool data written")

    def _modal_groups(self, codes: Codes) -> None:
        """G codes whose number is the mode, transforms and bars: before the words they change."""
        state, g, dialect = self.state, codes.g, self.dialect
        compensated = state.compensation != G40
        if state.cycle is not None and g.get("distance", state.distance) != state.distance:
            # R and Z that stay in force across G90/G91 are read anew in a way not documented
            self._lose_depths()
        if dialect.length_turns and g.get("plane", state.plane) != state.plane:
            frames.turn_length(state)
        for group, code in g.items():
            if (name := GROUP_FIELDS.get(group)) is not None and group != "motion":
                state.put(name, code)
            if code in dialect.transforms:
                turned, starts = dialect.transforms[code]
                for each in _mirrored(turned, codes) if group == "mirror" else [turned]:
                    self._transform(each, starts)
            if group == "mirror" and codes.moved():
                state.forget_positions()
            if code in dialect.bars:
                self._bar_by_g_code(code, codes, compensated)
        if "distance" in g:
            state.put("distance_stated", True)

    def _units(self, codes: Codes) -> None:
        """G20, G21: behind F, which was written in the unit of its own block."""
        state, code = self.state, codes.g.get("units")
        if code is None:
            return
        unit = MM_PER_INCH if self.dialect.units[code] else 1.0
        feed_unit = state.feed_unit if code in self.dialect.lengths_only else unit
        # G21 F100 at the top: the F is meant in mm. Should the control have started in inches and
        # read it so, restoring F100 is the slower of the two; with G20 F10 it would be the faster.
        slower = unit == 1.0 or not self.dialect.feed_before_units
        beside_feed = "F" in codes.values and state.feed_unit is None and slower
        if feed_unit != state.feed_unit and not beside_feed:
            state.put("feed", NAN)
        state.put("feed_unit", feed_unit)
        if unit != state.unit:
            for name in ("path_p", "path_q"):
                state.put(name, NAN)
            if state.cycle is not None:
                self._lose_depths()
            if state.unit is not None and self.dialect.units_once:
                self.lengths.clear()
                state.offsets = {}
                state.forget_frame()
                state.forget_positions()
        state.put("unit", unit)

    def _g_effects(self, codes: Codes, step: Step) -> None:
        """What G codes do besides: tool length, work system, diameters; in the unit just stated."""
        for code in codes.g.values():
            self._effect(self.dialect.effect(code), code, codes.values, step)

    def _names(self, codes: Codes, step: Step) -> None:
        """Words with a name (TRANS, MCALL, FGROUP): they change what the codes have selected."""
        if not codes.names:
            return
        self._declare(codes.names)
        self._assign_names(codes.names)
        self._swivel(codes.names, step)
        self._smooth(codes.names)
        step.limits |= limits.set_by_names(self.state, codes.names, self.dialect, self.limits)
        effects = [self._named(name) for name in codes.names]
        if "modal cycle" in effects:
            # MCALL with a cycle begins one, which runs later; MCALL alone ends it.
            self._call_modally(codes, step)
            return
        if effects == ["cycle"] and self._drill_by_name(codes, step):
            return
        for name, effect in zip(codes.names, effects, strict=True):
            if effect == "flow":
                continue
            if effect == "written":
                self._write_frame(name.arguments)
            if effect == "feed override":
                self.state.put("bars", {**self.state.bars, effect: True})
            if effect in ("shift", "further shift", "turned frame", "further turn"):
                self._program_frame(effect, codes)
            if effect == "feed group":
                self._feed_group(codes.names)
            self._effect(effect, 0, codes.values, step)

    def _path(self, codes: Codes) -> None:
        """G61, G64 P Q: behind the units, which forget tolerances."""
        state, code = self.state, codes.g.get("path")
        if code is None:
            return
        continuous = code == G64
        state.put("path", self.dialect.paths.get(code))
        state.put("path_p", codes.values.get("P", NAN) if continuous else NAN)
        state.put("path_q", codes.values.get("Q", NAN) if continuous else NAN)

    def _motion(self, codes: Codes, step: Step) -> None:
        """Axis words: a motion, unless a dwell, a cycle or a macro takes them for itself."""
        if not self._takes_words(codes):
            self._move(codes, step)
            return
        g, dialect = codes.g, self.dialect
        self._select_motion(codes)
        if g.get("non-modal") == G4:
            # X alone is a time; whether an axis moves beside the dwell, nobody says
            time = set() if "P" in codes.values or "motion" in g else {"X"}
            self.state.forget_positions(AXES.index(axis) for axis in codes.moved() - time)
        elif g.get("non-modal") in dialect.contours:
            self.contours.begin(codes.values)
        if dialect.one_command and not g and step.words and not codes.m:
            # Words without a command: a build may take them for one.
            self.state.forget_positions()

    def _beams(self, codes: Codes, step: Step) -> None:
        """Note what tells a laser from a mill, with the motion and the spindle as they are now."""
        feeds = bool(step.words) and self.state.motion != self.dialect.rapid
        step.habit = shows_habits(codes, self.state, feeds, self.dialect)
        step.outputs = uses_outputs(codes)

    def _stop(self, codes: Codes, step: Step) -> None:
        """M0, M2, M30 and their kin, and M99 of Heidenhain: behind the motion of their block."""
        for m in codes.m:
            if self.dialect.m_groups.get(m) == CYCLE_CALL:
                step.cycle = True
                self._effect("cycle", 0, codes.values, step)
            if self.dialect.m_groups.get(m) != "stop":
                continue
            if m in _ENDS:
                step.ends = True
            elif m in _STOPS and not self.stays:
                # Meanwhile somebody may have moved the axes by hand.
                self.state.forget_positions()
        if self._may_move(codes) and not self.dialect.strict:
            # In front of the block's own motion, or behind it? The builder says.
            returns = self.dialect.effect(codes.g.get("non-modal")) == "return"
            named = codes.moved() or (AXES if returns else ())
            self.state.forget_positions(AXES.index(axis) for axis in named)

    def _may_move(self, codes: Codes) -> bool:
        """Whether a tool change or a program of the builder's stands in the block."""
        dialect = self.dialect
        if any(m == 6 or dialect.m_groups.get(m) in (None, "user") for m in codes.m):
            return True
        return dialect.tool_word_moves and "T" in codes.values and self._tool_change is None

    def _dwells(self, codes: Codes) -> bool:
        """Whether a code takes all words of the block for itself, F among them."""
        dialect = self.dialect
        return any(dialect.effect(code) == "words" for code in codes.g.values()) or (
            dialect.one_command and not codes.g
        )

    def _takes_words(self, codes: Codes) -> bool:
        """Whether the axis words of the block are no straight move."""
        return (
            self._dwells(codes)
            or any(self.dialect.effect(code) in _TAKES_WORDS for code in codes.g.values())
            or any(self._named(name) in _NAME_TAKES_WORDS for name in codes.names)
        )

    def _lose_depths(self) -> None:
        """Forget Z, R and the level of the cycle in force."""
        assert self.state.cycle is not None
        self.state.put("cycle", (self.state.cycle[0], NAN, NAN))
        self.state.put("cycle_level", NAN)

    def _move(self, codes: Codes, step: Step) -> None:
        """Execute the motion, or what takes its axis words away."""
        state, dialect = self.state, self.dialect
        step.start = state.position.copy()  # behind a tool change or a new frame, before the move
        if not dialect.strict:
            self._select_motion(codes)
        if self._axes_taken(codes, step):
            return
        if dialect.strict:
            self._select_motion(codes)
        cycle = self._cycle(codes.g)
        if not step.words and not arc_words(codes.values, state):
            if state.motion in dialect.redrawn and moves_without_axes(codes.g, codes.values):
                state.forget_positions(plane_axes(state))
            if cycle is not None and "cycle" in codes.g:
                begin_cycle(state, cycle, codes.values)
            if cycle is not None and dialect.drilling.own_group and "R" in codes.values:
                self._drill_at_r(codes)
            return
        if state.motion in (None, G80) and cycle is None:
            state.forget_positions()
            state.put("cycle", None)
            step.feed_event = USES_FEED
            return
        at_feed = state.motion != dialect.rapid or dialect.feed_on_rapids or cycle is not None
        if at_feed and step.feed_event == NO_FEED:
            step.feed_event = USES_FEED
        if cycle is not None:
            self._drill(cycle, codes, step)
        else:
            self._go(codes, step)

    def _axes_taken(self, codes: Codes, step: Step) -> bool:
        """Execute a non-modal code; whether it, or G43.1, leaves no axis words to the motion."""
        effect = self.dialect.effect(codes.g.get("non-modal"))
        if effect == "return":
            step.rapid = True
            go_to_stored_point(self.state, codes, self.dialect)
            return True
        if effect == "set":
            frames.set_names(self.state, codes, self.dialect)
        else:
            frames.change(self.state, effect, codes.values, self.lengths)
        return effect in _TAKES_AXES or (step.words != 0 and takes_axes(codes))

    def _drill_at_r(self, codes: Codes) -> None:
        """A block with R and without an axis: it may make a hole, or only note R (Fanuc does)."""
        state = self.state
        assert state.cycle is not None
        state.put("cycle", (state.cycle[0], NAN, codes.values["R"]))
        state.forget_positions(
            [AXES.index(PLANES[state.plane][2])] if state.plane else range(len(AXES))
        )

    def _drill(self, cycle: int, codes: Codes, step: Step) -> None:
        """Run a canned cycle at the block's position."""
        state, drilling = self.state, self.dialect.drilling
        step.rapid = step.cycle = True
        beside = "cycle" in codes.g and "motion" in codes.g
        if beside or codes.increments or not run_cycle(state, cycle, codes.values, drilling):
            step.fault = True
            state.forget_positions()
            state.put("cycle", None)
            if drilling.own_group:
                state.lose("cycle")  # refused or not (K0): positions may drill from here on

    def _go(self, codes: Codes, step: Step) -> None:
        """Go to where the axis words say, as far as the frame tells where that is."""
        state, dialect, motion = self.state, self.dialect, self.state.motion
        step.rapid = motion == dialect.rapid
        if dialect.effect(codes.g.get("non-modal")) == "machine":
            go_to_machine_position(state, codes.values, dialect)
            if dialect.base_frames:
                state.forget_positions(AXES.index(axis) for axis in codes.moved())
        elif motion in dialect.redrawn or motion is None:
            state.forget_positions(plane_axes(state))
            state.forget_positions(AXES.index(axis) for axis in codes.moved())
        else:
            go_straight(state, codes, step)
            step.fed = motion == G1 and self._counts_as_rapid(step)
            step.rapid = step.rapid or step.fed
        if self._in_machine_words(codes):
            state.forget_positions(AXES.index(axis) for axis in codes.moved())
        if state.compensation != G40:
            displace(state, codes)
        elif motion in (dialect.rapid, G1) and state.bars.get(LEFT_OVER, False) is not False:
            if leaves_offset(state, codes):
                frames.end_bar(state, LEFT_OVER)
            elif _in_plane(codes, state):
                displace(state, codes)
        if any(on is not False for on in state.transforms.values()) and not (
            motion not in dialect.redrawn and drill_behind(state, step.start)
        ):
            state.forget_positions()

    def _in_machine_words(self, codes: Codes) -> bool:
        """Whether a name or an M code makes the axis words machine coordinates."""
        groups = (self.dialect.m_groups.get(m) for m in codes.m)
        named = (self._named(name) for name in codes.names)
        return "machine" in named or MACHINE_WORDS in groups

    def _counts_as_rapid(self, step: Step) -> bool:
        """Whether a straight feed move is one that the user has said to be a rapid."""
        state, wanted = self.state, self.rapid_feed
        if wanted is None or state.unit is None or state.feed_mode != 94:
            return False
        z = AXES.index("Z")
        return bool(wanted.covers(state.feed, step.start[z], state.position[z], state.unit))

    def _select_motion(self, codes: Codes) -> None:
        """Put the motion code of the block in force, if it states one."""
        code = codes.g.get("motion")
        if code is None:
            return
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


def _mirrored(name: str, codes: Codes) -> list[str]:
    """Names of the mirrors that G51.1 X0. Y0. begins, or G50.1 ends: one for each axis."""
    return [f"{name} {axis}" for axis in sorted(codes.moved())] or [name]


def _in_plane(codes: Codes, state: State) -> bool:
    """Whether a block moves an axis that cutter compensation may displace."""
    return not codes.moved().isdisjoint(AXES[axis] for axis in plane_axes(state))
