"""What codes and words with a name do besides the motion: frames, transforms, diameters, flow.

Rule: the table of the dialect names the effect; what an effect does stands here, or in `frames`,
and nowhere else.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect, Effect
from gcodejerk.nc.interpreter import frames
from gcodejerk.nc.interpreter.codes import Codes
from gcodejerk.nc.interpreter.eligibility import Step
from gcodejerk.nc.interpreter.flow_words import known_behind
from gcodejerk.nc.interpreter.modal import NAN, State
from gcodejerk.nc.interpreter.rapids import USES_FEED
from gcodejerk.nc.text.block import Name
from gcodejerk.nc.text.tokenizer import CHECKSUM
from gcodejerk.start import Start

_DECLARATION = re.compile(
    rb"[ \t]*(?:REAL|INT|BOOL|CHAR|STRING[ \t]*\[[ \t]*[0-9]+[ \t]*\])[ \t]+(.*)", re.IGNORECASE
)
_VALUES = re.compile(rb"\[[^\]]*\]|=[ \t]*(?:\"[^\"]*\"|[^,\"]*)")
"""Sizes of arrays, and what variables begin with."""


class Effects:
    """Does to a state what codes and names do besides the motion."""

    def __init__(self, dialect: Dialect, state: State, start: Start) -> None:
        self.dialect = dialect
        self.state = state
        self.lengths = dict(start.tool_lengths)
        self.declared: set[str] = set()
        """Variables with a name that the program has declared."""
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

    def _declare(self, names: list[Name]) -> None:
        """DEF REAL DEPTH, WIDTH=5: from here on these are variables."""
        for name in names:
            if self._named(name) != "declaration":
                continue
            match = _DECLARATION.fullmatch(name.arguments)
            if match is None:
                self.state.forget()
                return
            texts = _VALUES.sub(b"", match[1]).split(b",")
            self.declared |= {text.strip(b" \t").decode("latin-1").upper() for text in texts}

    def _swivel(self, names: list[Name], step: Step) -> None:
        """CYCLE800(..) turns the plane, CYCLE800() turns it back; where the axes go, it says."""
        for name in names:
            if self._named(name) == "swivel":
                on = bool(name.arguments.strip(b"() \t"))
                self.state.forget_frame()
                self._effect("cycle", 0, {}, step)
                self._transform("swivel", on=on)

    def _transform(self, name: str, on: bool) -> None:
        """Begin or end a rotation, scaling, mirroring or polar frame."""
        state = self.state
        if on or state.transforms.get(name, False) is not False:
            state.forget_positions()
        if on or name in state.transforms:
            state.put("transforms", {**state.transforms, name: on})

    def _modal_cycle(self, begins: bool) -> None:
        """Begin or end a cycle or macro that runs at every position."""
        state = self.state
        state.put("transforms", {**state.transforms, "modal macro": begins})
        state.forget_positions()

    def _feed_group(self, names: list[Name]) -> None:
        """FGROUP(X,Y): F is the speed of these axes alone; FGROUP() is all again."""
        group = [n.arguments.strip(b"() \t") for n in names if self._named(n) == "feed group"]
        self.state.put("bars", {**self.state.bars, "feed group": any(group)})

    def _leave(self, step: Step) -> None:
        """Run a program that is not followed."""
        self.state.forget()
        step.feed_event = USES_FEED
        step.leaves = True
