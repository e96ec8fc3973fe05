"""Where a program stops and where it ends, for settings that are taken back there.

This module owns the places at which lines stand in front of a block or behind it: in front of every
end; in front of every stop and again behind it; at the end of a file that has no other end.

Rule: the places are right only in a program whose lines follow one another. Whatever jumps, calls,
loops, or may stop the program elsewhere is refused, with its line; nothing is followed and nothing
is guessed.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import BinaryIO

from gcodejerk.emit.sheets import Sheets
from gcodejerk.errors import EmitError, Place
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Program
from gcodejerk.nc.program import split_lines
from gcodejerk.nc.text.block import Block, Word
from gcodejerk.nc.text.chunks import BYTE_ORDER_MARK, read_chunks
from gcodejerk.nc.text.tokenizer import parse_line

SET, BACK = "set", "back"
"""What stands at a place: the lines that set, or those that take it back."""
STOPS, ENDS = frozenset({0, 1}), frozenset({2, 30})
PAUSES = frozenset({0, 1, 25, 226, 600, 601})
"""M codes of printers' firmwares that wait for a person."""
CALLS = frozenset({17, 29, 47, 96, 97, 98, 99})
CALLS_BY_G = frozenset({650, 660, 661})
"""Macro calls, whatever dialect the program is read in."""
FIRMWARE_CALLS = frozenset({23, 24, 28, 29, 32, 33, 98, 99, 808, *range(810, 820)})
"""M codes that run other files, markers or macros, or write a file."""
QUIET_M = frozenset({2, 3, 4, 5, 7, 8, 9, 18, 30, 73, 82, 83, 84, 204, *PAUSES})
"""M codes that are no macros in Klipper, besides those of the dialect's table."""
PAUSE = "PAUSE"
FLOW = ("flow", "modal cycle")
"""Effects of codes that lead elsewhere."""
_PLAIN = re.compile(
    rb"\s*(?:N[0-9]+\s*)?(?:G0*[0-3](?![0-9.])\s*)?(?:[XYZABCUVWIJKREF]\s*[-+]?[0-9.]+\s*)*"
)
"""Moves: most lines of most programs, which cannot be a stop."""
_COMMAND = re.compile(rb"\s*(?:N\s*[0-9]+\s*)?(?:#[A-Z]|V\.[A-Z]|G[0-9]+\s*=)", re.IGNORECASE)
"""Commands, variables and words of the ISG kernel that no dialect here reads, and that go on."""
_STOP_TEXT = re.compile(rb"M\s*0*(?:[012]|30)(?![0-9])", re.IGNORECASE)
_APART = re.compile(rb"(?<=[A-Z])[ \t]+(?=[0-9])")


@dataclass(frozen=True, slots=True)
class Stop:
    """One place at which lines are inserted."""

    offset: int
    """In the program. [bytes]"""
    line: int
    """Of the program, behind which they stand; 0: in front of all."""
    what: str
    """SET or BACK."""


def find_stops(
    source: BinaryIO, program: Program, emitter: Sheets, machine: Machine
) -> tuple[Stop, ...]:
    """Places of a program, in their order; the first is where it begins.

    Parameters
    ----------
    source : BinaryIO
        The program, seekable.
    program : Program
        As it was read.
    emitter : Sheets
        The control.
    machine : Machine
        Names macros that its owner has looked at (`controller_parameters`).

    Raises
    ------
    EmitError
        Lines could be skipped, or the program sets the same itself.
    """
    scan = _Scan(program, emitter, machine)
    source.seek(0)
    for chunk in read_chunks(source, program.name):
        for text, begin, number, terminator in split_lines(chunk):
            if number == 1 and text.startswith(BYTE_ORDER_MARK):
                text, begin = text[len(BYTE_ORDER_MARK) :], len(BYTE_ORDER_MARK)
            if scan.ended:
                break
            text_end = begin + len(text) + terminator
            scan.take(text.removesuffix(b"\r") if terminator else text, begin, text_end, number)
    return scan.finish()


class _Scan:
    """One walk through the lines of a program."""

    def __init__(self, program: Program, emitter: Sheets, machine: Machine) -> None:
        self.program, self.emitter = program, emitter
        # A line with a number is run or refused: settings may stand around it either way.
        text = replace(program.language.text, numbered=True)
        self.dialect: Dialect = replace(program.language, text=text)
        self.firmware = self.dialect.one_command
        self.waits = PAUSES if emitter.program_commands else STOPS
        self.own = re.compile(emitter.program_sets.encode(), re.IGNORECASE)
        self.harmless = {one.number.upper() for one in machine.controller_parameters}
        self.stops: list[Stop] = []
        self.head = 0
        self.ended = False
        self.begun = False
        self.named = False
        self.lines = 0

    def take(self, text: bytes, begin: int, end: int, number: int) -> None:
        """Look at a line."""
        self.lines = number
        if begin < self.program.insert_at:
            self.head = number
        if _PLAIN.fullmatch(text):
            self.begun |= bool(text.strip())
            return
        block = parse_line(text, self.dialect)
        code = _without(text, block.comments)
        if not code.strip():
            return
        if not self.firmware and (block.percent or code.strip().startswith(b"%")):
            if self.begun:  # what follows is not read
                self.stops.append(Stop(begin, number - 1, BACK))
                self.ended = True
            return
        stop, finish = self._kind(block, code, number)
        if stop or finish:
            if begin < self.program.insert_at:
                self._refuse(number, "the program stops where its settings would begin")
            self.stops.append(Stop(begin, number - 1, BACK))
            if finish and not block.block_delete:
                self.ended = True
            else:
                self.stops.append(Stop(end, number, SET))
        self.begun = True

    def finish(self) -> tuple[Stop, ...]:
        """All places, the end of the file among them where the program has no other end."""
        if not self.ended:
            self.stops.append(Stop(self.program.size, self.lines, BACK))
        return (Stop(self.program.insert_at, self.head, SET), *self.stops)

    def _kind(self, block: Block, code: bytes, number: int) -> tuple[bool, bool]:
        """Whether a block stops the program, and whether it ends it."""
        if own := self.own.search(_APART.sub(b"", code.upper())):
            self._refuse(
                number,
                f"the program sets this itself ({own[0].decode('latin-1')}), or stores it",
                "take that out of the program, or use the setup sheet of `gcodejerk parameters`",
            )
        if self.firmware:
            return self._firmware(block, number), False
        m = [word.value for word in block.words if word.letter == "M"]
        if block.problem is not None:
            if not _COMMAND.match(code) or _STOP_TEXT.search(code):
                self._refuse(number, "the line is not understood: it may jump, call or stop")
            return False, False
        self._refuse_flow(block, number)
        if None in m or CALLS.intersection(int(v) for v in m if v is not None):
            self._refuse(number, "an M code is computed, calls another program or goes back")
        return bool(self.waits.intersection(m)), bool(ENDS.intersection(m))

    def _refuse_flow(self, block: Block, number: int) -> None:
        """Refuse jumps, loops, branches and calls; and programs in inches where that counts."""
        dialect = self.dialect
        if block.o_word or (
            block.o_word is not None and (self.named or dialect.text.o_word == "flow")
        ):
            self._refuse(number, "an O word begins another program, a loop or a branch")
        self.named |= block.o_word is not None
        for name in block.names:
            if dialect.names.get(name.name) != "none":
                self._refuse(number, f"{name.name} may jump, call or stop")
        for word in block.words:
            code = round(word.value * 10.0) if word.value is not None else None
            if word.letter == "G":
                if code is None or code in CALLS_BY_G or dialect.effect(code) in FLOW:
                    self._refuse(number, "a G code is computed, or calls another program")
                else:
                    self._refuse_inches(code, number)
            elif word.letter in dialect.calls:
                self._refuse(number, f"{word.letter} calls another program")

    def _refuse_inches(self, code: int, number: int) -> None:
        if self.emitter.program_inches and self.dialect.units.get(code):
            self._refuse(
                number,
                "the program counts in inches, and whether the control then takes accelerations "
                "in inches is not known",
                "post the program in mm",
            )

    def _firmware(self, block: Block, number: int) -> bool:
        """The same where the first G or M of a line is its command, or a name is."""
        commands = [word for word in block.words if word.letter in "GM"]
        if not commands:
            if block.problem is not None:
                self._refuse(number, "the line is not understood: it may jump, call or stop")
            return self._macro(block.names[0].name, number) if block.names else False
        several = self.emitter.program_commands
        return any([self._command(one, number) for one in commands[: None if several else 1]])

    def _command(self, command: Word, number: int) -> bool:
        """Whether a command of a firmware stops the program."""
        if command.value is None:
            self._refuse(number, "a code is computed")
            return False
        value = int(command.value)
        if command.letter == "G":
            self._refuse_inches(round(command.value * 10.0), number)
            return False
        if value in FIRMWARE_CALLS:
            self._refuse(number, f"M{value} runs or writes another file, or goes back")
        known = value in self.dialect.m_groups or value in QUIET_M
        if self.dialect.text.names and not known:
            self._macro(f"M{value}", number)
        return value in PAUSES

    def _macro(self, name: str, number: int) -> bool:
        """Whether a named command stops the program; refused where that is not known."""
        if name == PAUSE:
            return True
        if self.dialect.names.get(name) != "none" and name not in self.harmless:
            self._refuse(
                number,
                f"{name} is a macro: whether it stops or ends the program, or sets the same, is "
                "not known",
                "where it does neither, say so in the machine file: controller_parameters: "
                f"[{{number: {name}, meaning: neither stops nor sets accelerations or shapers}}]",
            )
        return False

    def _refuse(self, line: int, problem: str, remedy: str = "") -> None:
        raise EmitError(
            f"{problem}; settings could then stay in force, so --as parameters is refused",
            remedy
            or "use the setup sheet of `gcodejerk parameters`, or post the program without "
            "jumps and calls",
            Place(self.program.name, line),
        )


def _without(text: bytes, comments: tuple[tuple[int, int], ...]) -> bytes:
    """A line without its comments."""
    for begin, end in reversed(comments):
        text = text[:begin] + b" " + text[end:]
    return text
