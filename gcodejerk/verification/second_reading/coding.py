"""What the codes of a line do before anything moves, for the second reading.

Rule: as in `tracking`, what is not followed makes unknown all that it might have changed.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import (
    ANOTHER_LANGUAGE,
    CYCLE_CALL,
    LEFT_OVER,
    LINEAR,
    MACHINE_WORDS,
    OVERRIDES,
    Effect,
)
from gcodejerk.nc.dialects.gcodes import G4, G28, G40, G54_1, G64, G91
from gcodejerk.units import MM_PER_INCH as INCH
from gcodejerk.verification.second_reading.known import Known, Observation
from gcodejerk.verification.second_reading.limiting import Said, along_path, too_low
from gcodejerk.verification.second_reading.reading import NAN, Line
from gcodejerk.verification.second_reading.sorting import Sorted

SELECTIONS: frozenset[Effect] = frozenset(("system", "numbered system"))
QUIET: frozenset[Effect] = frozenset(("diameter", "radius", "either"))
STATEMENTS: frozenset[Effect] = frozenset(("home", "cycle", "label"))
"""Effects of statements of Klartext."""
_CALLS = (46, 47, 96, 97, 98, 198)
_ENDS = (2, 17, 30, 99)
_OUTPUTS = (*range(62, 69), *range(100, 200))


class Codes(Known):
    """Executes codes."""

    def stray(self) -> None:
        """Lose everything where a program runs that is not followed."""
        self.forget()
        self.strayed = True

    def unknown_call(self) -> None:
        """Whatever a program does that is not followed."""
        self.stray()
        self.exact = self.exact or "path" in self.dialect.groups.values()
        if self.dialect.diameter_codes:
            self.diameter = None

    # Complex: what TRANS, ATRANS, ROT and AROT have in common is nearly all.
    def program_shift(self, line: Line) -> Observation:
        """TRANS X5, ATRANS X5, ROT Z30; alone, each of them ends all that went before."""
        words = [(letter, number) for letter, number, _ in line.words if letter != "N"]
        first = line.effects[0]
        further = first in ("further shift", "further turn")
        shift = len(line.effects) == 1 and first in ("shift", "further shift")
        turned = self.frames.get("a programmed frame", False) is not False
        if not words and len(line.effects) == 1 and not further:
            self.frames["a programmed frame"] = self.added = False
            self.g92 = self.rename(self.g92, [0.0] * len(AXES))
            if turned:
                self.lose()
            return Observation()
        letters = [letter for letter, _ in words]
        plain = shift and set(letters) <= LINEAR and len(set(letters)) == len(letters)
        plain = plain and not line.relative and not ("X" in letters and self.diameter is not False)
        plain = plain and bool(words) and (further or self.added is False)
        self.added = True if first == "further shift" else self.added
        replaces = first == "shift"
        if not plain or (turned and not replaces):
            self.frames["a programmed frame"] = None if further else not shift
            self.g92 = self.rename(self.g92, [NAN] * len(AXES))
            self.lose()
            return Observation()
        if turned:
            self.lose()
        self.frames["a programmed frame"] = False
        after = [0.0] * len(AXES) if replaces else list(self.g92)
        for letter, number in words:
            after[AXES.index(letter)] += number * self.scale(letter)
        self.g92 = self.rename(self.g92, after)
        return Observation()

    def is_statement(self, line: Line) -> bool:
        """Whether a line is a statement of Klartext that is no straight line."""
        stated = bool(line.effects) and STATEMENTS.issuperset(line.effects)
        return stated and self.dialect.text.klartext

    def statement(self, line: Line) -> Observation:
        """A statement of Klartext that is no straight line: what it moves and forgets."""
        if "label" in line.effects:
            self.come_to_label()
            return Observation()
        self.lose()
        self.g["motion"] = None
        for letter, number, _ in line.words:
            if letter == "F":
                self.feed = number
            elif letter == "G" and 40 <= number <= 42:
                self.g["compensation"] = round(number * 10.0)
            elif letter == "T":
                self.tool = [NAN] * len(AXES)
                self.forget_shared()  # T may run a cycle of the builder's
            elif letter == "M" and number in (3, 4, 5, 13, 14):
                self.spindle = None
            elif letter == "M":
                self.stray()
                self.bar_for_good(sure=False)
        if "cycle" in line.effects:
            self.feed = NAN
        return Observation()

    def come_to_label(self) -> None:
        """Anything may hold that another way here leaves, but for the unit of the program."""
        unit, feed_unit = self.unit, self.feed_unit
        self.forget()
        self.unit, self.feed_unit = unit, feed_unit
        self.ended = False

    def end_elsewhere(self, line: Line, block: Sorted) -> Observation | None:
        """A block that did not end where its words say, if that is so."""
        groups = {self.dialect.m_groups.get(m) for m in block.m}
        if CYCLE_CALL in groups:
            self.lose()
            self.g["motion"], self.feed = None, NAN
            return Observation(against="a cycle runs in it")
        codes = {self.dialect.effect(code) for code in block.g.values()}
        suppressed = self.dialect.base_frames and "machine" in codes
        if "machine" in line.effects or MACHINE_WORDS in groups or suppressed:
            # SUPA, M91, G153: its words are no program coordinates
            self.lose("".join(axis for k, axis in enumerate(AXES) if block.axes >> k & 1))
            return Observation(against="a coordinate frame changes in it")
        return None

    def turning(self, effect: Effect) -> None:
        """Take X as a diameter, or not."""
        self.turns = True
        self.diameter = None if effect == "either" else effect == "diameter"

    def write(self, effect: Effect, line: Line) -> None:
        """A line that only writes data, or says which axes F is for."""
        if any(letter != "N" for letter, _, _ in line.words):
            self.forget()
        if effect == "written":
            self.written()
            if line.frame:
                self.frames[line.frame] = True
        else:
            self.bars["feed group"] = line.group

    def smooth(self, effect: Effect, line: Line) -> None:
        """A compressor of blocks begins or ends; CYCLE832 also says how blocks are joined."""
        self.bars["compressor"] = effect != "no compressor"
        if effect == "smoothing" and not (line.smoothed and self.path == 64):
            self.path, self.p, self.q = None, NAN, NAN

    def beam(self, block: Sorted, burnt: bool) -> bool | None:
        """Whether G1 would burn where G0 does not; None where that is not known."""
        # what an M code that nobody knows makes of its block is no feed move with S
        feeds = block.axes and self.g.get("motion") != self.dialect.rapid
        feeds = feeds and not any(self.is_unknown("M", m) for m in block.m)
        on = burnt or self.spindle != 5
        self.habits = (
            self.habits
            or bool(feeds and "S" in block.values and self.spindle != 5)
            or not self.dialect.beam_codes.isdisjoint(block.m)
            or ("I" in block.values and (3 in block.m or 4 in block.m))
        )
        if self.burns and any(m in _OUTPUTS for m in block.m):
            self.bars["outputs"] = True
        if not (self.dark and on):
            return False
        return True if self.spindle in (3, 4) and not self.depth and not self.doubt else None

    def machine_codes(self, block: Sorted) -> bool:
        """Execute M codes; whether the program ends behind the block."""
        ends = self._m_groups(block)
        for m in block.m:
            if m in self.dialect.m_bars:
                self.bars[self.dialect.m_bars[m]] = _switched(block.values.get("P", 1.0))
            if m in self.dialect.m_scales:
                percent = block.values.get("S", NAN)
                self.bars["F is scaled"] = None if percent != percent else percent != 100.0
            if f"M{m}" in self.dialect.limits:
                self.limit([(f"M{m}", *word) for word in block.values.items()])
        return ends

    # Complex: one case for each group of M codes.
    def _m_groups(self, block: Sorted) -> bool:
        """Do what the groups of M codes say; whether the program ends behind the block."""
        ends = False
        for m in block.m:
            group = self.dialect.m_groups.get(m)
            if group == "spindle" and m in (3, 4, 5):
                self.spindle = m
            if group == "spindle":
                self.lose(self.dialect.spindle_turns)
            if group == "stop" and m in _ENDS:
                ends = True
            elif group == "macro" or (m in _CALLS and group is not None):
                self.unknown_call()
            elif group is None and self.dialect.other_m == "unknown":
                self.forget()
                self.bar_for_good(True)
            elif group in (None, "tool", "user"):
                places = self.facts.tool_change if m == 6 and group is not None else None
                if places is None or self.turned():
                    self.lose()
                self.forget_shared()
                may_be_macro = self.dialect.other_m == "positions" or self.dialect.macro_change
                if may_be_macro or f"M{m}" in self.dialect.refused:
                    self.cancel_length()
                    if self.cycle is not None:
                        self.g["motion"], self.cycle = None, None
                    if self.g.get("distance") == G91 and "distance" not in self.fixed:
                        self.g["distance"] = None
                for axis, place in (places or {}).items():
                    self.at[AXES.index(axis)] = self.stand(AXES.index(axis), place)
            elif group == "state":
                self.forget()
        return ends

    def limit(self, said: list[Said]) -> None:
        """Take limits of speed and acceleration."""
        found = too_low(said, self.dialect, self.facts.limits) if said else {}
        for thing, low in found.items():
            self.bars.pop(f"limit of {thing}", None)
            if low:
                self.bars[f"limit of {thing}"] = True
        self.slow |= along_path(said, self.dialect) if said else {}

    def dwell(self, block: Sorted) -> None:
        """Lose the axes that may move beside G4; X alone is its time."""
        if G4 in block.g.values():
            timed = "P" not in block.values and "motion" not in block.g
            named = [axis for k, axis in enumerate(AXES) if block.axes >> k & 1]
            self.lose("".join(axis for axis in named if axis != "X" or not timed))

    def turn_polar(self, block: Sorted) -> None:
        """Without a word of an axis, an angle and a radius may say where a motion leads."""
        redrawn = self.g.get("motion") in self.dialect.redrawn
        if redrawn and ("motion" in block.g or set(block.values) - set("FSTD")):
            self.lose(self.in_plane())

    def modes(self, g: dict[str, int], values: dict[str, float]) -> None:
        """Execute modal codes."""
        dialect = self.dialect
        if dialect.length_turns and "plane" in g and g["plane"] != self.g.get("plane"):
            self.turn_tool()
        if "distance" in g and self.g.get("distance") != g["distance"]:
            self.level = self.r = NAN
        before = self.g.get("compensation")
        for group, code in g.items():
            if group not in ("motion", "non-modal", "cycle"):
                self.g[group] = code
            if code in dialect.transforms:
                self._transform(*dialect.transforms[code], group == "mirror", values)
            name, begins = dialect.bars.get(code, ("", False))
            if name and not (name == LEFT_OVER and before == G40):
                self._bar(name, begins, values)
            if name == LEFT_OVER and before is None:
                self.bars[name] = None  # there may have been none to end
        if "units" in g:
            self._units(g["units"], beside_feed="F" in values)
        if "path" in g:
            self.path = dialect.paths.get(g["path"])
            self.exact = self.exact or self.path in (61, 62)
            self.p = values.get("P", NAN) if g["path"] == G64 else NAN
            self.q = values.get("Q", NAN) if g["path"] == G64 else NAN

    def run_contours(self) -> None:
        """Doubt what contours say: it may have come to hold, or not."""
        other = self.copy()
        other.modes(self.says, {})
        if "feed mode" in self.says:
            other.feed_mode = other.mode_of(self.says["feed mode"])
        self.join(other)

    def _transform(self, name: str, on: bool, by_axis: bool, values: dict[str, float]) -> None:
        """Turn, scale or mirror what follows, or no longer."""
        if by_axis:
            self._mirror(name, on, values)
            return
        if on or self.frames.get(name, False) is not False:
            self.lose()
        if name == "modal macro" and self.frames.get(name, False) is not False:
            self.forget()  # whatever the macro has left at the last position
        if on or name in self.frames:
            self.frames[name] = on

    def _bar(self, name: str, begins: bool | str, values: dict[str, float]) -> None:
        """Begin or end what forbids to rewrite; what another language leaves is not known."""
        if name == ANOTHER_LANGUAGE:
            self.forget()
        if name == OVERRIDES and not begins and name not in self.bars:
            return  # never off so far
        if begins == "Q":
            self.bars[name] = values.get("Q", NAN) not in (0.0, 1.0)
            return
        self.bars[name] = _switched(values.get("P", 0.0)) if begins == "P" else bool(begins)

    def _mirror(self, name: str, on: bool, values: dict[str, float]) -> None:
        """Mirror the axes named, or no longer; without any, nobody knows which."""
        axes = [axis for axis in AXES if axis in values]
        if axes or on or name in self.frames:
            self.lose()
        for axis in axes:
            self.frames[f"{name} along {axis}"] = on
        if not axes and (on or name in self.frames):
            self.frames[name] = on

    def _units(self, code: int, *, beside_feed: bool) -> None:
        """Take a unit of lengths, and of F where the dialect does not keep the two apart."""
        dialect = self.dialect
        unit = INCH if dialect.units[code] else 1.0
        if unit != self.unit:
            self.p = self.q = self.level = self.r = NAN
            if dialect.units_once and self.unit is not None:
                self.lose()
                self.lose_offsets()
                self.systems, self.lengths = {}, {}
        if code not in dialect.lengths_only:
            sure = unit == 1.0 or not dialect.feed_before_units
            if unit != self.feed_unit and not (self.feed_unit is None and beside_feed and sure):
                self.feed = NAN
            self.feed_unit = unit
        self.unit = unit

    def effect(self, effect: Effect, code: int, values: dict[str, float]) -> None:
        """What a code does besides, before anything moves."""
        if effect in QUIET:
            self.turning(effect)
        elif effect == "length":
            self.lengthen(code, values.get("H", NAN), _axes(values))
        elif effect in SELECTIONS:
            self.select(self.selection(effect, code, values))
        elif effect == "frames":
            if self.dialect.groups.get(code) == "system":
                self.end_bar("offsets")
            self.lose_offsets()
            self.lose()
        elif effect == "modal cycle":
            # G67 ends it, under the name that the table of transforms gives it
            self.unknown_call()
            self.frames["modal macro"] = True
        elif effect == "transform":
            self.frames["a frame"] = True
            self.lose()
        elif effect == "cycle":
            self.lose()
            self.g["motion"], self.feed = None, NAN
            if code in self.dialect.finishing and values.get("Q") in self.contours:
                self.run_contours()
            elif code in self.dialect.finishing:
                self.forget()
        elif effect == "home":
            self.lose()
        elif effect == "measure":
            self.written()
        elif effect == "data":
            self._data(values)
        elif effect == "label":
            self.come_to_label()
        elif effect == "flow":
            self.unknown_call()

    def sure_of_systems(self, effects: dict[int, Effect], values: dict[str, float]) -> bool:
        """Whether all work systems that codes select are certain in front of the block's motion."""
        return all(
            self.sure_of(self.selection(effect, code, values))
            for code, effect in effects.items()
            if effect in SELECTIONS
        )

    def selection(
        self, effect: Effect, code: int, values: dict[str, float]
    ) -> tuple[int, int] | None:
        """Which work system a code selects; None where that is not known."""
        number = values.get("P", NAN) if effect == "numbered system" else 0.0
        if number != number or ("P" in values and code in self.dialect.p_selects):
            return None
        return code if effect == "system" else G54_1, int(number)

    def go_home(self, block: Sorted) -> None:
        """G28 leads to where the machine file says, G30 and its kin to an unknown place."""
        self.level = NAN
        cancels = self.dialect.tool_cancelled_by_return
        if cancels != "no":
            self.cancel_length(block.axes if cancels == "named" else 0)
        knows = G28 in block.g.values() and (block.axes or self.dialect.bare_return)
        for k, axis in enumerate(AXES):
            if block.axes and not block.axes >> k & 1:
                continue
            self.at[k] = self.stand(k, self.home.get(axis, NAN)) if knows else NAN
        if self.turned():
            self.lose()

    def tool_moves(self, block: Sorted) -> bool:
        """Whether something of the builder's moves, in front of the block's motion or behind it."""
        groups = [self.dialect.m_groups.get(m) for m in block.m]
        chosen = "T" in block.values and self.facts.tool_change is None
        called = chosen and self.dialect.tool_word_moves
        return called or 6 in block.m or None in groups or "user" in groups

    def go_to_machine_position(self, block: Sorted) -> None:
        """G53: the words are machine coordinates."""
        for k, axis in enumerate(AXES):
            if axis in block.values:
                if self.dialect.tool_cancelled_by_return != "no" and self.tool[k] != 0.0:
                    self.tool[k] = NAN
                there = block.values[axis] * self.scale(axis)
                there -= self.system[k] + self.g92[k] + self.tool[k]
                known = self.g.get("distance") != G91 and not self.turned()
                self.at[k] = there if known else NAN

    def _data(self, values: dict[str, float]) -> None:
        """G10: offsets (L2, L20), tool data (L1, L3, L10 to L13), or parameters."""
        kind = values.get("L")
        self.written()
        if kind in (2.0, 20.0):
            self.end_bar("tool data")
        elif kind is not None and kind not in (1.0, 3.0, 10.0, 11.0, 12.0, 13.0):
            self.forget()
            self.bars["parameters"] = True


def _switched(number: float) -> bool | None:
    """Whether a P that switches something turns it on; None where P is not known."""
    return None if number != number else number != 0.0


def _axes(values: dict[str, float]) -> int:
    """Bit k: a word for AXES[k]."""
    return sum(1 << k for k, axis in enumerate(AXES) if axis in values)
