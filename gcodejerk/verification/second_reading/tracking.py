"""A second opinion on where a program goes: what its lines do, one after another.

It is written from the dialects' tables alone, knows nothing of how `nc` follows a program, and
follows less. What is in force and where the axes stand is in `known`.

Rule: what is not followed (flow, calls, cycles in increments, names) makes unknown all that it
might have changed.
"""

from __future__ import annotations

from typing import Any

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import LEFT_OVER, LINEAR, Effect
from gcodejerk.nc.dialects.gcodes import G1, G40, G43, G49, G80, G90, G91
from gcodejerk.units import MM_PER_INCH as INCH
from gcodejerk.units import SECONDS_PER_MINUTE
from gcodejerk.verification.second_reading.circling import Circling
from gcodejerk.verification.second_reading.coding import QUIET, SELECTIONS
from gcodejerk.verification.second_reading.known import NEAR, Observation
from gcodejerk.verification.second_reading.limiting import too_fast
from gcodejerk.verification.second_reading.reading import NAN, Line
from gcodejerk.verification.second_reading.sorting import Sorted
from gcodejerk.verification.second_reading.unread import may_begin, says_bare_i

_FRAMES: frozenset[Effect] = frozenset(
    {
        *("return", "store", "machine", "system", "numbered system", "length", "set", "clear"),
        *("restore", "local", "table", "frames", "home", "transform", "modal cycle", "data"),
        "measure",
    }
)
_MOVES: frozenset[Effect] = frozenset(("words", "cycle", "home", "measure", "flow"))
"""Effects beside which the axis words are no straight move."""
_SHIFTS = frozenset[Effect](("shift", "further shift", "turned frame", "further turn"))
_SMOOTH = frozenset[Effect](("smoothing", "compressor", "no compressor"))
_READ = QUIET | _SHIFTS | _SMOOTH | frozenset[Effect](("frames", "swivel", "machine", "limit"))
"""Effects of names that are followed."""
_WRITES: frozenset[Effect] = frozenset(("written", "feed group"))
_STOPS = (0, 1, 60)


class Tracker(Circling):
    """Follows lines."""

    def follow(self, line: Line) -> Observation:
        """Execute a line, and tell what it was."""
        if line.percent:
            self._percent(line)
            if not line.words:
                return Observation()
        if line.flow is not None:
            self._flow(line.flow)
            return Observation()
        if line.offsets and self.dialect.arithmetic.at_selection:
            self.systems, self.home, self.rewritten = {}, {}, True
        elif line.offsets:
            self.written()
        if line.switched is not None:
            known = line.switched == line.switched and line.understood and not line.deleted
            self.bars["feed hold is off"] = line.switched != 0.0 if known else None
        if line.understood and not line.words and not line.effects:
            self.started = self.started or not line.blank
            return Observation()
        self.begun = self.started = True
        if not line.deleted:
            seen = self._execute(line)
            self.limit(line.limits)
            return seen
        before = self.copy()
        self._execute(line)
        self.limit(line.limits)
        if self.ended and not before.ended:
            vars(self).update(vars(before))
        else:
            self.join(before)
        return Observation(against="the operator may skip it")

    def _percent(self, line: Line) -> None:
        if self.dialect.text.percent == "error":
            self.begun = self.started = True
            self.lose()  # refused as a block of its own; who refuses, waits for somebody
        elif not line.understood:
            self.forget()
        elif not self.begun and not self.opened:
            self.opened = self.started = True
        elif self.opened:
            self.ended = True
        else:
            self.forget()
            self.doubt = True

    def _flow(self, keyword: str) -> None:
        first, self.begun, self.started = not self.begun, True, True
        if not keyword:
            if not first:
                self.doubt = True
                self.forget()
            return
        if keyword in ("SUB", "IF", "WHILE", "REPEAT", "DO"):
            self.depth += 1
        elif keyword in ("ENDSUB", "ENDIF", "ENDWHILE", "ENDREPEAT"):
            self.depth -= 1
        elif keyword == "JUMP":
            self.doubt = True
        # `do` is closed by `while`: told apart by nobody here, so what follows stays in doubt.
        self.doubt = self.doubt or keyword == "DO" or self.depth < 0
        self.unknown_call()

    # Complex: one kind of line behind another, in the order in which they are told apart.
    def _execute(self, line: Line) -> Observation:
        """Execute words, the modal ones in front of the motion."""
        dialect = self.dialect
        if line.understood and line.effects and _WRITES.issuperset(line.effects):
            for effect in line.effects:
                self.write(effect, line)
            return Observation()
        if line.understood and self.is_statement(line):
            return self.statement(line)
        here, modes = list(self.at), self.in_force()
        if self.drill_by_name(line):
            return Observation("it calls a cycle", start=here, modes=modes)
        if not line.understood or any(effect not in _READ for effect in line.effects):
            return self._lost(line)
        if _SHIFTS.issuperset(line.effects) and line.effects:
            return self.program_shift(line)
        if not {"frames", "swivel"}.isdisjoint(line.effects):
            return self._new_frame(line)
        if self.contour is not None:
            self.in_contour(line)
            return Observation()
        block = Sorted()
        told = self.unit == INCH, self.facts.decimal_point, self.g.get("motion")
        if not block.sort(line, dialect, *told) or self.takes_twice(block):
            return self._lost(line)
        if not dialect.modal_motion:
            self.g["motion"] = None
        for effect in line.effects:
            if effect in QUIET:
                self.turning(effect)
            elif effect in _SMOOTH:
                self.smooth(effect, line)
        if self.may_be_refused(block):
            return self._run_or_refused(block)
        seen = self._run_block(block)
        seen = self.end_elsewhere(line, block) or seen
        if line.effects and seen.sure:
            seen.sure = False
        return seen

    def _new_frame(self, line: Line) -> Observation:
        """A frame that is not known, and a way to it that is not."""
        if any(letter != "N" for letter, _, _ in line.words):
            return self._lost(line)
        self.lose_offsets()
        self.lose()
        self.g["motion"], self.feed = None, NAN
        if "swivel" in line.effects and (line.swivelled or "swivel" in self.frames):
            self.frames["swivel"] = line.swivelled
        return Observation()

    def _run_or_refused(self, block: Sorted) -> Observation:
        """A block that does something on some of the controls, and nothing on others."""
        before = self.copy()
        self._run_block(block)
        if self.ended and not before.ended:
            self.forget()
            self.ended = False
        self.join(before)
        if not self.stays():
            self.lose()
        if before.g.get("motion") is None and "motion" not in block.g:
            return Observation()  # here it is not known what they would do
        return Observation(against="some of the controls refuse it")

    def _lost(self, line: Line) -> Observation:
        """A line that is not understood."""
        fires = any(letter == "M" and number in (3, 4) for letter, number, _ in line.words)
        self.habits = self.habits or (fires and says_bare_i(line.unread))
        self.forget()
        frames, bars = may_begin(line.unread, line.effects, self.dialect)
        self.frames |= dict.fromkeys(frames)
        self.bars |= bars
        self.bar_for_good(any(self.is_unknown(letter, n) for letter, n, _ in line.words))
        self.strayed = True
        return Observation()

    def _run_block(self, block: Sorted) -> Observation:
        """Execute a block: its modal words, then its motion, then what stops or ends."""
        effects = {code: self.dialect.effect(code) for code in block.g.values()}
        kinds = set(effects.values())
        burnt = self.spindle != 5
        sure = self.sure_of_systems(effects, block.values)
        doubted = not sure and self.strayed  # the other reader may know what was lost here
        certain = SELECTIONS if sure or doubted else frozenset[Effect]()
        seen = Observation(self._ban(kinds - certain), axes=block.axes)
        self._set_feed(block, kinds)
        ends = self.machine_codes(block)
        self._set_tool(block, seen)
        self.modes(block.g, block.values)
        for code, effect in effects.items():
            self.effect(effect, code, block.values)
        self._use_axes(block, kinds, seen)
        seen.end = list(self.at)
        seen.modes = self.in_force()
        burns = self.beam(block, burnt)
        seen.sure = seen.sure and burns is False and not doubted
        if burns:
            seen.against = seen.against or "a beam may be on"
        self._stop(block, ends=ends)
        return seen

    def _set_feed(self, block: Sorted, kinds: set[Effect]) -> None:
        """Put the feed mode in force, then F, unless a dwell takes it."""
        g, values = block.g, block.values
        if "feed mode" in g:
            mode = self.mode_of(g["feed mode"])
            if mode != self.feed_mode:
                self.feed = NAN
            self.feed_mode = mode
            self.inverse = None if mode is None else mode == 93
        taken = "words" in kinds or (self.dialect.one_command and not g)
        if "F" in values and taken and self.may_be_feed(block):
            self.feed = NAN
        if "F" in values and not taken and (counts := self.counts_feed(g)) is not False:
            self.feed = values["F"] if counts else NAN
            self.feed_whole = self.matters(block.feed_whole)

    def _set_tool(self, block: Sorted, seen: Observation) -> None:
        """Execute the words, other than codes, that move the tool or its frame."""
        dialect, values = self.dialect, block.values
        if dialect.tool_word_moves and "T" in values and self.facts.tool_change is None:
            self.lose()
            self.level = NAN
        if dialect.length_word in values and "tool length" not in block.g:
            self.lengthen(0, NAN, block.axes)
        if not dialect.tool_frame.isdisjoint(values):
            self.lose_tool(by_t="T" in values)
            seen.against = seen.against or "it changes the tool's offset"

    def _use_axes(self, block: Sorted, kinds: set[Effect], seen: Observation) -> None:
        """Give the axis words to the motion, or to the code that takes them for itself."""
        dialect, g = self.dialect, block.g
        if kinds & _MOVES or (dialect.one_command and not g and not block.m):
            self._motion(block)
            if dialect.one_command and not g and block.axes:
                self.lose()
            if "cycle" in kinds and "non-modal" in g and g["non-modal"] in dialect.contours:
                self.contour = block.values.get("Q", NAN) if "P" in block.values else None
            self.dwell(block)
            seen.against = seen.against or "its words are for something else than a move"
        elif block.axes or "motion" in g or "cycle" in g or kinds & _FRAMES:
            self._move(block, kinds, seen)
        else:
            self.turn_polar(block)
            seen.against = seen.against or "it names no axis"

    def _stop(self, block: Sorted, *, ends: bool) -> None:
        """Stop or end behind the motion."""
        if not self.stays():
            stops = [m for m in block.m if m in _STOPS and self.dialect.m_groups.get(m) == "stop"]
            self.lose(AXES if stops else "")
        if self.tool_moves(block) and not self.dialect.strict:
            home = any(self.dialect.effect(code) == "return" for code in block.g.values())
            self.lose(AXES if home and not block.axes else _letters(block.axes))
        if ends:
            self.forget()
            self.ended = self.depth == 0  # in a branch it may not run

    def in_force(self) -> dict[str, Any]:
        """What is in force, by the names of `Observation.modes`."""
        distance = self.g.get("distance")
        return {
            "unit": self.unit,
            "speed": self.feed * (self.unit or NAN) / SECONDS_PER_MINUTE,
            "incremental": None if distance is None else distance == G91,
            "diameter": self.diameter,
            "feed mode": self.feed_mode,
            "F": self.feed,
            "F without a point": self.feed_whole if self.feed == self.feed else None,
            "plane": self.g.get("plane"),
            "retract": self.g.get("retract"),
            "path": self.path or None,
            "motion": None if (motion := self.g.get("motion")) is None else motion // 10,
            "P": self.p,
            "Q": self.q,
        }

    def _ban(self, kinds: set[Effect]) -> str | None:
        """Why no rapid may be rewritten here, whatever the block says."""
        if self.ended:
            return "the program has ended before it"
        if kinds & _FRAMES:
            return "a coordinate frame changes in it"
        return None

    def _motion(self, block: Sorted) -> None:
        """Put the motion code of the block in force, if it states one."""
        code = block.g.get("motion")
        if code is None:
            return
        self.g["motion"] = code
        if code not in self.dialect.cycles:
            self.cycle = None

    def _move(self, block: Sorted, kinds: set[Effect], seen: Observation) -> None:
        """Move the axes, or whatever the block makes of its axis words."""
        seen.start = list(self.at)
        self._motion(block)
        if self._taken(block, kinds):
            return
        code = self._cycle_of(block)
        if code is not None:
            seen.against = seen.against or "it belongs to a canned cycle"
            self._drill(code, block)
            return
        motion = self.g.get("motion")
        if not block.axes:
            self.turn_polar(block)
            seen.against = seen.against or "it names no axis"
            return
        if motion is None or motion == G80:
            self.lose()
            return
        elsewhere = "machine" in kinds or motion in self.dialect.redrawn
        if "machine" in kinds:
            self.go_to_machine_position(block)
        elif motion in self.dialect.redrawn:
            self.lose(self.in_plane())
            self.lose(_letters(block.axes))
        else:
            self._go(block)
        counts = motion == self.dialect.rapid or self._said_to_be_rapid(motion, seen)
        if counts is False or (elsewhere and motion != self.dialect.rapid):
            seen.against = seen.against or f"it moves with G{motion // 10}"
        self._why_not(block, seen)
        seen.sure = seen.sure and counts is not None

    def _said_to_be_rapid(self, motion: int, seen: Observation) -> bool | None:
        """Whether the user counts a feed move as a rapid, at that F and nowhere too low."""
        if self.facts.rapid_feed is None or motion != G1 or self.feed_mode not in (None, 94):
            return False
        feed, least = self.facts.rapid_feed
        heights = [z / self.scale("Z") for z in (seen.start[2], self.at[2])]
        # What is not known is neither: a comparison with it is false.
        if self.feed < feed or self.feed > feed or any(z < least - NEAR for z in heights):
            return False
        return (self.feed_mode == 94 and all(z == z for z in (self.feed, *heights))) or None

    def _taken(self, block: Sorted, kinds: set[Effect]) -> bool:
        """Execute what takes the axis words from the motion: G28, G92, G10, G43.1."""
        if "return" in kinds:
            self.go_home(block)
            return True
        if "store" in kinds:
            self.home = {}
        if kinds & {"set", "clear", "restore", "local", "table"}:
            self.shift(kinds, block.values, block.increments)
            return not (kinds & {"clear", "restore"} and block.axes)
        frames = self.dialect.effect(block.g.get("non-modal")) == "frames"
        return frames or (block.axes != 0 and block.g.get("tool length") not in (None, G43, G49))

    def _go(self, block: Sorted) -> None:
        """To where the words say."""
        distance = self.g.get("distance")
        for k, axis in enumerate(AXES):
            if axis in block.increments:
                self.at[k] += block.increments[axis] * self.scale(axis)
            elif axis in block.values:
                there = block.values[axis] * self.scale(axis)
                how = block.relative.get(axis)
                if how == "IC" or (how is None and distance == G91):
                    there += self.stepping_from(k)
                elif how is not None or distance is not None:
                    there = self.absolutely(k, there)
                self.at[k] = NAN if distance is None and how is None else there
        self.lose(_letters(block.axes) if "scaling" in block.g else "")

    def _why_not(self, block: Sorted, seen: Observation) -> None:
        """Whether the move was a rapid in a known frame."""
        compensated = self.g.get("compensation") != G40
        if compensated:
            self.displaced(_letters(block.axes))
        elif self.bars.get(LEFT_OVER, False) is not False:
            self._leave_offset(block)
        if self.turned() and not self.drilled_behind(seen):
            self.lose()
        seen.against = seen.against or self._barred(block, seen)
        known = not (compensated or self.turned() or self.depth or self.doubt)
        known = known and all(on is False for on in self.bars.values())
        known = known and not self.may_stop()
        known = known and (self.feed_unit is not None or not self.dialect.lengths_only)
        seen.sure = known and seen.against is None
        if self.depth or self.doubt:
            seen.against = None

    def _leave_offset(self, block: Sorted) -> None:
        """A straight move with a length takes back what G40 has left, one without may not."""
        if self.g.get("motion") not in (0, G1):
            return
        if self._has_length(block):
            self.end_bar(LEFT_OVER)
        elif set(self.in_plane()) & set(_letters(block.axes)):
            self.displaced(_letters(block.axes))

    def _has_length(self, block: Sorted) -> bool:
        """Whether the program moves in the plane: then G40 has done its work."""
        ways = [block.increments.get(axis, 0.0) for axis in self.in_plane()]
        for axis in self.in_plane():
            if axis in block.values and self.g.get("distance") == G91:
                ways.append(block.values[axis])
            elif axis in block.values:
                ways.append(self.at[AXES.index(axis)] - self.meant[AXES.index(axis)])
        return any(way != 0.0 for way in ways)

    def _barred(self, block: Sorted, seen: Observation) -> str | None:
        """What else speaks against rewriting the move."""
        if self.g.get("compensation") not in (G40, None):
            return "cutter compensation is active"
        if True in self.frames.values():
            return "a rotation, scaling or mirroring is active"
        for name, on in self.bars.items():
            if on:
                return f"rapids have to stay as they are ({name})"
        if self.slow and self._too_fast(seen):
            return "the program bounds the path"
        for k, axis in enumerate(AXES):
            stated = axis in LINEAR or axis in self.facts.wraps
            if stated or axis not in block.values or self.g.get("distance") != G90:
                continue
            if seen.start[k] != self.at[k] and seen.start[k] == seen.start[k]:
                return f"nobody says which way {axis} turns"
        if len(seen.moved(self.at)) > 1 and seen.moved(self.at) & self.dialect.apart:
            return "its axes do not move together"
        if self.dialect.lengths_only and None not in (self.unit, self.feed_unit):
            return "F is not in the unit of lengths" if self.unit != self.feed_unit else None
        return None

    def _too_fast(self, seen: Observation) -> bool:
        """Whether a limit of the path is certainly in the way."""
        moved = {axis: self.at[k] - seen.start[k] for k, axis in enumerate(AXES)}
        moved = {a: way for k, (a, way) in enumerate(moved.items()) if seen.axes >> k & 1 and way}
        facts, known = self.facts, all(way == way for way in moved.values())
        return known and too_fast(self.slow, moved, facts.limits, facts.straight, facts.along)


def _letters(axes: int) -> str:
    """Axes by their bits."""
    return "".join(axis for k, axis in enumerate(AXES) if axes >> k & 1)
