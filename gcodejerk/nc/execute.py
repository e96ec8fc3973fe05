"""What one block does to the modal state, in the controller's own order of execution.

Rule 1: the order is fixed and stands in `_act`, top to bottom, whatever the order on the line
(LinuxCNC manual, "G-code order of execution").

Rule 2: a block that the controller would refuse changes nothing for certain: its words are tried
out, and whatever they touched is unknown afterwards.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from gcodejerk.nc import frames
from gcodejerk.nc.block import Block
from gcodejerk.nc.cycles import run_cycle
from gcodejerk.nc.dialect import AXES, PLANES, Dialect
from gcodejerk.nc.modal import GROUP_FIELDS, NAN, State
from gcodejerk.nc.rapids import GIVES_FEED, NO_FEED, USES_FEED
from gcodejerk.nc.rules import Codes, arc_words, is_complete, takes_axes
from gcodejerk.reasons import Reason
from gcodejerk.units import MM_PER_INCH

_RETURNS = frozenset({280, 300})
_REDRAWN = frozenset({331, 382, 383, 384, 385, 52, 53})
"""Motions whose end is not what their words say."""
_GROUPED_M = frozenset({"stop", "spindle", "coolant", "tool"})


@dataclass(slots=True)
class Step:
    """What a block did."""

    rapid: bool = False
    reason: Reason | None = None
    start: list[float] = field(default_factory=list)
    words: int = 0
    """Bit k set: a word for AXES[k]."""
    feed_event: int = NO_FEED
    fault: bool = False
    unknown: bool = False
    """A code that the dialect does not know."""
    ends: bool = False
    """The program ends behind the block's motion."""


class Executor:
    """Runs blocks against a state that it owns."""

    def __init__(self, dialect: Dialect, state: State, lengths: dict[int, float]) -> None:
        self.dialect = dialect
        self.state = state
        self.lengths = lengths

    def run(self, block: Block) -> Step:
        """Execute a block that is not an O-word line."""
        state = self.state
        codes = self.sort(block)
        step = Step(start=state.position.copy())
        for bit, axis in enumerate(AXES):
            if axis in codes.values:
                step.words |= 1 << bit
        for target in block.assigns:
            self._assign(target)
        step.unknown = codes.unknown and not codes.expression
        before = state.motion
        ended = state.ended
        if (
            codes.fault
            or block.problem is not None
            or not is_complete(codes, self.state, self.dialect)
        ):
            self._doubt(block, codes, step)
        else:
            self._act(codes, step)
        self._judge(block, codes, step, before, ended)
        return step

    def sort(self, block: Block) -> Codes:
        """Sort the words of a block into codes and values."""
        codes = Codes()
        values, dialect = codes.values, self.dialect
        for word in block.words:
            value = word.value
            if value is None:
                codes.expression = True
                if word.letter in "GM":
                    codes.unknown = True
                    continue
                value = NAN
            letter = word.letter
            if letter == "G":
                code = round(value * 10.0)
                group = dialect.groups.get(code) if abs(value * 10.0 - code) < 1e-3 else None
                if group is None:
                    codes.unknown = True
                elif group not in codes.g:
                    codes.g[group] = code
                elif 800 in (code, codes.g[group]):
                    codes.g[group] = max(codes.g[group], code) if code != 800 else codes.g[group]
                    if codes.g[group] == 800:
                        codes.g[group] = code
                else:
                    codes.fault = True
                    codes.g[group] = code
            elif letter == "M":
                number = round(value)
                m_group = dialect.m_groups.get(number) if number == value else None
                if m_group is None:
                    codes.unknown = True
                elif m_group in _GROUPED_M and m_group in map(dialect.m_groups.get, codes.m):
                    codes.fault = True
                codes.m.append(number)
            elif letter != "N":
                if letter in values:
                    codes.fault = True
                    value = NAN
                values[letter] = value
        if block.assigns:
            codes.expression = True
        return codes

    def _doubt(self, block: Block, codes: Codes, step: Step) -> None:
        """Forget what a block that is not understood may have changed."""
        state = self.state
        step.fault = True
        before, state.touched, ended = state.touched, set(), state.ended
        self._act(codes, step)
        if step.ends:
            state.forget()
            step.ends = False
        touched, state.touched = state.touched, before
        state.ended = ended
        state.forget_touched(touched)
        if block.problem is not None:
            state.forget_positions()
            if any(byte in b"GMOgmo#[" for byte in block.rest):
                state.forget()
        step.feed_event = USES_FEED

    def _assign(self, target: str) -> None:
        """Parameters from 5161 on hold reference points and offsets; an empty name may be any."""
        if not target or (target.isdigit() and int(target) >= 5161):
            self.state.offsets = {}

    def _act(self, codes: Codes, step: Step) -> None:
        """Execute, in the fixed order."""
        state, g, values = self.state, codes.g, codes.values
        if codes.unknown:
            state.forget()
            step.feed_event = USES_FEED
            return
        if "feed mode" in g:
            mode = g["feed mode"] // 10
            if mode != state.feed_mode:
                state.put("feed", NAN)
            state.put("feed_mode", mode)
            state.put("feed_mode_stated", True)
        if "F" in values:
            state.put("feed", values["F"])
            if values["F"] == values["F"]:
                step.feed_event = GIVES_FEED
        for m in codes.m:
            self._miscellaneous(m, step)
        if state.cycle is not None and g.get("distance", state.distance) != state.distance:
            # R and Z that stay in force across G90/G91 are read anew in a way not documented
            state.put("cycle", (state.cycle[0], NAN, NAN))
            state.put("cycle_level", NAN)
        for group, code in g.items():
            if (name := GROUP_FIELDS.get(group)) is not None and group != "motion":
                state.put(name, code)
        if "diameter" in g:
            state.put("turns", state.turns or g["diameter"] == 70)
            state.put("diameter", g["diameter"] == 70)
        if "units" in g:
            unit = MM_PER_INCH if g["units"] == 200 else 1.0
            if unit != state.unit:
                for name in ("feed", "path_p", "path_q"):
                    state.put(name, NAN)
                state.put("cycle", None)
            state.put("unit", unit)
            state.put("unit_stated", True)
        if "tool length" in g:
            frames.tool_length(state, g["tool length"], values, self.lengths)
        if "system" in g:
            frames.select_system(state, g["system"])
        if "path" in g:
            code = g["path"]
            state.put("path", 62 if code == 611 else code // 10)
            state.put("path_p", values.get("P", NAN) if code == 640 else NAN)
            state.put("path_q", values.get("Q", NAN) if code == 640 else NAN)
        if "distance" in g:
            state.put("distance_stated", True)
        self._move(codes, step)
        for m in codes.m:
            if m in (2, 30, 99) and self.dialect.m_groups[m] == "stop":
                step.ends = True

    def _miscellaneous(self, m: int, step: Step) -> None:
        """Execute an M code, the end of the program excepted."""
        state = self.state
        group = self.dialect.m_groups[m]
        if m == 6 or group == "user":
            # A tool change may go anywhere, and so may a program of the user's.
            state.forget_positions()
        elif m == 72:
            state.forget_modes()
            state.forget_positions()
        elif m == 98:
            state.forget()
            step.feed_event = USES_FEED

    def end(self) -> None:
        """End the program: what follows is not executed."""
        self.state.forget()
        self.state.put("motion", 10)
        self.state.ended = True

    def _move(self, codes: Codes, step: Step) -> None:
        """Execute the motion, or what takes its axis words away."""
        state, g, values = self.state, codes.g, codes.values
        user = g.get("non-modal")
        step.start = state.position.copy()  # behind a tool change or a new frame, before the move
        if user in _RETURNS:
            self._return(values, step)
            return
        if user == 100:
            frames.write_table(state, values, self.lengths)
            return
        if user == 520:
            frames.set_local(state, values)
            return
        if user in (920, 921, 922, 923):
            frames.set_g92(state, user, values)
            if user == 920:
                return
        if step.words and takes_axes(codes):
            return
        if "motion" in g:
            state.put("motion", g["motion"])
            if g["motion"] not in self.dialect.cycles:
                state.put("cycle", None)
        if not step.words and not arc_words(values, self.state):
            return
        motion = state.motion
        if motion is None:
            state.forget_positions()
            state.put("cycle", None)
            step.feed_event = USES_FEED
            return
        if motion != self.dialect.rapid and step.feed_event == NO_FEED:
            step.feed_event = USES_FEED
        if motion in self.dialect.cycles:
            step.rapid = True
            if not run_cycle(state, motion, values):
                step.fault = True
                state.forget_positions()
                state.put("cycle", None)
            return
        step.rapid = motion == self.dialect.rapid
        if user == 530:
            self._machine_move(values)
        elif motion in _REDRAWN:
            state.forget_positions(self._plane_axes())
            state.forget_positions(k for k, axis in enumerate(AXES) if axis in values)
        else:
            self._straight(values)
        if state.compensation != 400:
            state.forget_positions(self._plane_axes())

    def _straight(self, values: dict[str, float]) -> None:
        """Go to where the axis words say."""
        state = self.state
        for axis, letter in enumerate(AXES):
            if letter in values:
                value = values[letter] * state.scale(axis)
                if state.distance == 910:
                    value = state.position[axis] + value
                elif state.distance is None:
                    value = NAN
                state.move(axis, value)

    def _machine_move(self, values: dict[str, float]) -> None:
        """G53: the axis words are machine coordinates."""
        state = self.state
        for axis, letter in enumerate(AXES):
            if letter in values:
                state.move(axis, values[letter] * state.scale(axis) - state.shift(axis))

    def _return(self, values: dict[str, float], step: Step) -> None:
        """G28 and G30: to a stored point that the program does not tell."""
        step.rapid = True
        named = [k for k, axis in enumerate(AXES) if axis in values]
        self.state.forget_positions(named or range(len(AXES)))
        if self.state.rotated is not False:
            self.state.forget_positions()

    def _plane_axes(self) -> list[int]:
        """List the axes that cutter compensation may displace."""
        plane = self.state.plane
        letters = "XYZUVW" if plane is None else PLANES[plane][:2]
        return [AXES.index(letter) for letter in letters]

    def _judge(
        self, block: Block, codes: Codes, step: Step, motion_before: int | None, ended: bool
    ) -> None:
        """Decide whether this is a rapid, and why it would have to be left alone."""
        rapid = self.dialect.rapid
        if step.fault or codes.unknown:
            stated = [word.value for word in block.words if word.letter == "G"]
            looks = rapid in stated or ("motion" not in codes.g and motion_before == rapid)
            axes = step.words or any(axis in block.rest.decode("latin-1").upper() for axis in AXES)
            step.rapid = step.rapid or bool(looks and axes)
        if not step.rapid:
            return
        g = codes.g
        if ended:
            step.reason = Reason.AFTER_END
        elif block.block_delete:
            step.reason = Reason.BLOCK_DELETE
        elif step.fault or (codes.unknown and not codes.expression):
            step.reason = Reason.NOT_UNDERSTOOD
        elif codes.expression:
            step.reason = Reason.EXPRESSION
        elif g.get("non-modal") in (280, 300):
            step.reason = Reason.FRAME_CHANGE
        elif self.state.motion in self.dialect.cycles:
            step.reason = Reason.CANNED_CYCLE
        elif any(code in self.dialect.frame_changes for code in g.values()):
            step.reason = Reason.FRAME_CHANGE
        elif self.state.compensation != 400:
            step.reason = Reason.CUTTER_COMPENSATION
        elif self.state.rotated is not False:
            step.reason = Reason.ROTATION
        else:
            step.reason = self._judge_move(block, codes, step)

    def _judge_move(self, block: Block, codes: Codes, step: Step) -> Reason | None:
        """Find the reasons that lie in the move itself."""
        state = self.state
        named = [k for k in range(len(AXES)) if step.words >> k & 1]
        moves = unknown = False
        for axis in named:
            a, b = step.start[axis], state.position[axis]
            if math.isnan(a) or math.isnan(b):
                unknown = True
            elif a != b:
                moves = True
        if not moves and not unknown:
            return Reason.NO_MOTION
        if state.distance is None:
            return Reason.DISTANCE_MODE_UNKNOWN
        if state.unit is None:
            return Reason.UNITS_UNKNOWN
        if unknown:
            return Reason.START_UNKNOWN
        dialect = self.dialect
        if any(code not in dialect.harmless for code in codes.g.values()) or any(
            m not in dialect.harmless_m for m in codes.m
        ):
            return Reason.OTHER_WORDS
        return None
