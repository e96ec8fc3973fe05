"""What codes and words with a name do besides the motion: frames, transforms, diameters, flow.

Rule: the table of the dialect names the effect; what an effect does stands here, or in `frames`,
and nowhere else.
"""

from __future__ import annotations

import re

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import (
    ANOTHER_LANGUAGE,
    LEFT_OVER,
    LINEAR,
    OVERRIDES,
    Dialect,
    Effect,
)
from gcodejerk.nc.interpreter import frames, limits
from gcodejerk.nc.interpreter.codes import Codes, switched
from gcodejerk.nc.interpreter.eligibility import Step
from gcodejerk.nc.interpreter.expressions import evaluate
from gcodejerk.nc.interpreter.flow_words import known_behind
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.moves import plane_axes
from gcodejerk.nc.interpreter.named_cycles import certain_call, come_back
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.interpreter.variables import converted, fills, named_assignment
from gcodejerk.nc.text.block import Name
from gcodejerk.nc.text.careful import CHECKSUM
from gcodejerk.reasons import Reason
from gcodejerk.start import Start

_DECLARATION = re.compile(
    rb"[ \t]*(REAL|INT|BOOL|CHAR|STRING[ \t]*\[[ \t]*[0-9]+[ \t]*\])[ \t]+(.*)", re.IGNORECASE
)
_DECLARED = re.compile(
    rb"[ \t]*([A-Z_][A-Z_][A-Z0-9_]*)[ \t]*(\[[^\]]*\])?[ \t]*"
    rb"(?:=((?:\"[^\"]*\"|\([^()]*\)|[^,\"()])*))?(?:,|$)",
    re.IGNORECASE,
)
"""A variable, the size of an array, and what it begins with."""
_FRAME_DATA = re.compile(rb"\$P_[A-Z0-9]*FR[A-Z]*(\[[^\]]*\])?=", re.IGNORECASE)
_SHIFT_ALONE = re.compile(
    rb"\$[A-Z0-9_]+(\[[^\]]*,(TR|FI)\]=|(\[[^\]]*\])?=C(TRANS|FINE)\([^()]*\)"
    rb"(:C(TRANS|FINE)\([^()]*\))*$)",
    re.IGNORECASE,
)
"""Frames of Siemens as data, and those that hold no rotation, scale or mirror for certain."""

MODAL_MACRO = "modal macro"
"""Name, among the transforms, of a cycle or macro that runs at every position."""
CONTINUOUS = 64
"""Path mode in which blocks blend."""


class Effects:
    """Does to a state what codes and names do besides the motion."""

    def __init__(self, dialect: Dialect, state: State, start: Start) -> None:
        self.dialect = dialect
        self.state = state
        self.lengths = dict(start.tool_lengths)
        self.limits = start.limits
        self.declared: dict[str, str] = {}
        """Variables with a name that the program has declared, with their types."""
        self.jumps_known = False
        """Whoever runs the blocks forgets everything at the targets of jumps."""

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
        if name.name in self.declared and name.arguments.lstrip(b" \t")[:1] in (b"=", b"["):
            return "none"
        return self.dialect.names.get(name.name, "flow")

    # Complex: one case for each effect.
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
            self._select_system(0 if other else code, step)
        elif effect == "numbered system":
            number = values.get("P", NAN)
            self._select_system(frames.numbered_system(number), step)
        elif effect == "frames":
            if self.dialect.groups.get(code) == "system":
                frames.end_bar(state, "offsets written")
            state.forget_frame()
            state.forget_positions()
        elif effect == "watch":
            state.forget()
            state.put("bars", {**state.bars, "synchronized action": True})
        elif effect in ("written", "measure"):
            frames.data_written(state, self.lengths)
        elif effect == "data":
            frames.write_data(state, self.lengths, values)
        elif effect == "transform":
            self._transform("frame", on=True)
        elif effect == "modal cycle":
            self._leave(step)
            self._modal_cycle(begins=True)  # G67, which ends it, is among the transforms
        elif effect == "cycle":
            step.feed_event = USES_FEED
            state.forget_positions()
            state.put("motion", None)
            state.put("feed", NAN)
        elif effect == "home":
            state.forget_positions()
        elif effect == "turn":
            frames.turn_spindle(state)
        elif effect == "label":
            units = [(name, getattr(state, name)) for name in ("unit", "feed_unit")]
            state.forget()
            for name, unit in units:
                state.put(name, unit)
            step.feed_event = USES_FEED
        elif effect == "flow":
            self._leave(step)

    def _bar_by_g_code(self, code: int, codes: Codes, compensated: bool) -> None:
        """Begin or end what a G code bars rapids with; `compensated` in front of the block."""
        state = self.state
        name, begins = self.dialect.bars[code]
        on = codes.switched(begins)
        # G64 alone: who has never switched overrides off, does not in a call either.
        never = name == OVERRIDES and not on and name not in state.bars
        if never or (name == LEFT_OVER and not compensated):
            return
        if name == ANOTHER_LANGUAGE:
            state.forget(Reason.NOT_UNDERSTOOD)  # what its codes do and leave
        state.put("bars", {**state.bars, name: on})

    def _bar_by_code(self, m: int, values: dict[str, float], step: Step) -> None:
        """Begin or end what an M code bars rapids with."""
        state, dialect = self.state, self.dialect
        if m in dialect.m_bars:
            state.put("bars", {**state.bars, dialect.m_bars[m]: switched(values.get("P", 1.0))})
        if m in dialect.m_scales:
            scaled = values["S"] != 100.0 if "S" in values else None
            state.put("bars", {**state.bars, "feed override": scaled})
        step.limits |= limits.set_by_code(state, m, values, dialect, self.limits)

    def _select_system(self, code: int, step: Step) -> None:
        """Select a work system; whether the block's own rapid may rely on it, the step says."""
        state = self.state
        # That a default is in force, nobody has said; its offset, the machine file may have.
        stated = state.system == code and bool(state.system_stated)
        step.system_certain = bool(code) and (stated or code in state.offsets)
        before = state.g5x
        frames.select_system(state, code)
        if self.dialect.shifts_travel:
            frames.note_shift(state, before, state.g5x)
        state.put("system_stated", True)

    def _declare(self, names: list[Name]) -> None:
        """DEF REAL DEPTH, WIDTH=5: from here on these are variables, of 0 unless it says more."""
        rules = self.dialect.arithmetic
        for name in names:
            if self._named(name) != "declaration":
                continue
            match = _DECLARATION.fullmatch(name.arguments.rstrip(b" \t"))
            if match is None:
                self.state.forget()
                return
            kind = match[1].decode("latin-1").upper()[:6]
            at = 0
            while at < len(match[2]):
                found = _DECLARED.match(match[2], at)
                if found is None:
                    self.state.forget()
                    return
                at = found.end()
                variable = found[1].decode("latin-1").upper()
                self.declared[variable] = kind
                value = 0.0 if found[3] is None else evaluate(found[3], self.state.variables, rules)
                value = NAN if found[2] else value
                self.state.set_variable(variable, converted(value, kind))

    def _assign_names(self, names: list[Name]) -> None:
        """DEPTH=R1+2, of a variable that was declared; values are read before any is set."""
        rules, state = self.dialect.arithmetic, self.state
        found = [(n.name, parts) for n in names if (parts := named_assignment(n)) is not None]
        found = [(name, parts) for name, parts in found if name in self.declared]
        if any(fills(text) for _, (_, text) in found):
            state.forget_variables()
            return
        values = [evaluate(text, state.variables, rules) for _, (_, text) in found]
        for k, (name, (variable, _)) in enumerate(found):
            if variable.endswith("["):
                for element in [v for v in state.variables if v.startswith(variable)]:
                    state.set_variable(element, NAN)
                continue
            # Set one behind the other or together? Where one depends on another, nobody knows.
            value = converted(values[k], self.declared[name]) if len(found) == 1 else NAN
            if len(found) > 1 and not any(c.isalpha() for c in found[k][1][1].decode("latin-1")):
                twice = sum(other == variable for _, (other, _) in found) > 1
                value = NAN if twice else converted(values[k], self.declared[name])
            state.set_variable(variable, value)

    def _smooth(self, names: list[Name]) -> None:
        """CYCLE832(0.05,..) selects a continuous path; CYCLE832() whatever machine data say."""
        for name in names:
            effect = self._named(name)
            if effect in ("smoothing", "compressor", "no compressor"):
                bars = {**self.state.bars, "compressor": effect != "no compressor"}
                self.state.put("bars", bars)
            if effect == "smoothing":
                tolerance = name.arguments.strip(b"( \t)").partition(b",")[0].strip(b" \t")
                if self.state.path != CONTINUOUS or not tolerance.strip(b"0."):
                    self.state.lose("path")

    def _corners(self, codes: Codes) -> None:
        """RND=5, CHF=5, RNDM=5: the next block begins beside the end of this one."""
        state = self.state
        plane = (
            {AXES[axis] for axis in plane_axes(state)} if "rounded corner" in state.bars else set()
        )
        if not codes.names and not plane.isdisjoint(codes.moved()):
            frames.end_bar(state, "rounded corner")
        for name in codes.names:
            effect = self._named(name)
            if effect not in ("corner", "corners"):
                continue
            ends = effect == "corners" and not name.arguments.strip(b"= \t+-").strip(b"0.")
            bars = {} if effect == "corner" else {"rounded corners": not ends}
            state.put("bars", {**state.bars, **bars, "rounded corner": True})
            state.forget_positions(plane_axes(state))

    def _swivel(self, names: list[Name], step: Step) -> None:
        """CYCLE800(..) turns the plane, CYCLE800() turns it back; where the axes go, it says."""
        for name in names:
            if self._named(name) == "swivel":
                on = bool(name.arguments.strip(b"() \t"))
                self.state.forget_frame()
                self._effect("cycle", 0, {}, step)
                self._transform("swivel", on=on)

    # Complex: what TRANS, ATRANS and ROT have in common is nearly all.
    def _program_frame(self, effect: Effect, codes: Codes) -> None:
        """TRANS shifts the frame, ATRANS by more, ROT turns it; TRANS or ROT alone ends it all."""
        state, values = self.state, codes.values
        further = effect in ("further shift", "further turn")
        bare = len(codes.names) == 1 and not codes.moved() and not values
        known = len(codes.names) == 1 and set(values) <= LINEAR and not codes.functions
        known = known and not codes.g and not codes.m and not codes.unknown
        known = known and not (bare and further)
        bare = bare and not further
        ends = bare or effect == "shift"
        if not ends and effect in ("turned frame", "further turn"):
            self._transform("programmed frame", on=True)
            return
        if ends:
            self._transform("programmed frame", on=False)
        if not ends and state.transforms.get("programmed frame", False) is not False:
            known = False
        if not bare and not further and state.added is not False:
            known = False  # what ATRANS has added may stay
        shift = [0.0] * len(AXES) if ends else list(state.g92)
        for axis, letter in enumerate(AXES):
            if letter in values and not bare:
                shift[axis] += values[letter] * state.scale(axis)
        if state.diameter is not False and "X" in values:
            known = False  # a diameter, or no diameter?
        frames.shift_program(state, shift if known or bare else [NAN] * len(AXES))
        if bare or further:
            state.put("added", further)

    def _write_frame(self, text: bytes) -> None:
        """$P_PFRAME=CROT(Z,45) turns the program's frame, which TRANS ends; $P_UIFR another one."""
        text = text.translate(None, b" \t")
        if _FRAME_DATA.match(text) and not _SHIFT_ALONE.match(text):
            own = text[:9].upper() == b"$P_PFRAME"
            self._transform("programmed frame" if own else "written frame", on=True)

    def _transform(self, name: str, on: bool) -> None:
        """Begin or end a rotation, scaling, mirroring or polar frame."""
        state = self.state
        if name == MODAL_MACRO and state.transforms.get(name, False) is not False:
            state.forget()  # it has run behind every move, and left its modes each time
        if on or state.transforms.get(name, False) is not False:
            state.forget_positions()
        if on or name in state.transforms:
            state.put("transforms", {**state.transforms, name: on})

    def _drill_by_name(self, codes: Codes, step: Step) -> bool:
        """CYCLE81(..) alone in its block; whether it is certain."""
        call = None
        if not (codes.g or codes.m or codes.values or codes.unknown):
            call = certain_call(codes.names[0], self.state, self.dialect.drilling)
        if call is None:
            return False
        step.feed_event = USES_FEED
        come_back(self.state, call)
        return True

    def _call_modally(self, codes: Codes, step: Step) -> None:
        """MCALL CYCLE81(..) begins a cycle that runs behind every move, MCALL alone ends it."""
        state, names = self.state, codes.names
        alone = not (codes.g or codes.m or codes.values or codes.unknown)
        in_force, call = state.modal_cycle, None
        if len(names) == 2 and self._named(names[0]) == "modal cycle" and alone:
            call = certain_call(names[1], state, self.dialect.drilling)
        step.leaves = len(names) > 1 and call is None
        here = list(state.position)
        self._modal_cycle(begins=len(names) > 1)
        if call is not None or (len(names) == 1 and alone and in_force is not None):
            for axis, place in enumerate(here):
                state.move(axis, place)
        state.put("modal_cycle", call)

    def _modal_cycle(self, begins: bool) -> None:
        """Begin or end a cycle or macro that runs at every position."""
        state = self.state
        state.put("modal_cycle", None)
        state.put("transforms", {**state.transforms, MODAL_MACRO: begins})
        state.forget_positions()

    def _feed_group(self, names: list[Name]) -> None:
        """FGROUP(X,Y): F is the speed of these axes alone; FGROUP() is all again."""
        group = [n.arguments.strip(b"() \t") for n in names if self._named(n) == "feed group"]
        self.state.put("bars", {**self.state.bars, "feed group": any(group)})

    def _leave(self, step: Step) -> None:
        """Run a program that is not followed."""
        self.state.forget()
        self.lengths.clear()
        step.feed_event = USES_FEED
        step.leaves = True
