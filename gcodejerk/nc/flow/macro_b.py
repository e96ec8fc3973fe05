"""Flow of Fanuc's custom macro B: ``IF [..] GOTO 100``, ``WHILE [..] DO1``, ``G65 P9000 A1.``.

Rule: what is not written as the manual has it, or has words beside it, is not followed
(`NotFollowedError`): then nothing of the file is.
"""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.script import LOST, Op, Script, Structures, Unit, checked
from gcodejerk.nc.text.block import Block, Line
from gcodejerk.nc.text.tokenizer import parse_line

_COMMENT = re.compile(rb"\([^)]*\)?|;.*")
_GOTO = re.compile(rb"GOTO(.*)")
_NUMBER = re.compile(rb"N?([0-9]+)")
_DO = re.compile(rb"DO([0-9]+)")
_THEN = re.compile(rb"THEN(#.*)")
_PACKED = 10_000
"""P31000 is O1000 three times, where a control packs the repeats into P."""
_SETS = "IJK"


class NotFollowedError(Exception):
    """The file cannot be followed."""


def macro_script(lines: list[Line], dialect: Dialect) -> Script:
    """Write a file down as a script.

    Parameters
    ----------
    lines : list of Line
        Of the file; a lone ``%`` left out.
    dialect : Dialect
        One with macro B.

    Raises
    ------
    NotFollowedError
    """
    script = Script(lines)
    begins = [k for k, line in enumerate(lines) if line.block.o_word == ""]
    edges = sorted({0, *begins, len(lines)})
    for first, last in pairwise(edges):
        name = _program_name(lines[first].block) if lines else ""
        script.units.append(Unit(first, last, name, main=first == 0))
    names = [_program_name(lines[k].block) for k in begins]
    for unit in script.units:
        if names.count(unit.name) > 1:
            unit.name = ""  # which of two is called, the control decides
        _compile(script, unit, dialect)
    return script


def _program_name(block: Block) -> str:
    """Number of a program; empty where there is none."""
    return str(int(block.o_name)) if block.o_word == "" and block.o_name.isdigit() else ""


def _compile(script: Script, unit: Unit, dialect: Dialect) -> None:
    """Write the lines of flow of one program down."""
    structures, ops = Structures(), dict[int, Op]()
    for at in range(unit.first, unit.last):
        for word in script.lines[at].block.words:
            if word.letter == "N" and word.value is not None:
                key = (unit.first, int(word.value))
                script.numbers[key] = LOST if key in script.numbers else at
    for at in range(unit.first, unit.last):
        line = script.lines[at]
        structures.note(at)
        op = _op(script, unit, at, line, structures, ops, dialect)
        if op is not None:
            ops[at] = op
    if structures.open:
        raise NotFollowedError
    script.ops.update(checked(ops, structures))


# Complex: one case for each form of a line.
def _op(
    script: Script,
    unit: Unit,
    at: int,
    line: Line,
    structures: Structures,
    ops: dict[int, Op],
    dialect: Dialect,
) -> Op | None:
    """What a line does."""
    block = line.block
    if not block.names:
        return _call(script, unit, at, block, dialect)
    name = block.names[0]
    text = _COMMENT.sub(b"", name.arguments).translate(None, b" \t").upper()
    if name.name in ("SETVN", "POPEN", "PCLOS", "DPRNT", "BPRNT"):
        return None
    if len(block.names) > 1 or any(w.letter != "N" for w in block.words) or block.assigns:
        raise NotFollowedError
    if name.name == "GOTO":
        return _goto(script, unit, text, None, at)
    if name.name == "IF":
        condition, rest = _bracket(text)
        if match := _GOTO.fullmatch(rest):
            return _goto(script, unit, match[1], condition, at)
        if match := _THEN.fullmatch(rest):
            then = line._replace(block=parse_line(match[1], dialect))
            if then.block.problem is None and then.block.assigns and not then.block.words:
                return Op("set", condition, at + 1, at + 1, line=then)
    if name.name in ("WHILE", "DO") and not block.block_delete:
        test, rest = _loop(name.name, text)
        if match := _DO.fullmatch(rest):
            structures.open.append(("DO", match[1].decode(), at, LOST))
            return Op("jump", test, at + 1, LOST)
    if name.name == "END" and not block.block_delete and structures.open:
        _, label, begin, _ = structures.open[-1]
        if text.decode("latin-1") == label:
            structures.open.pop()
            ops[begin] = replace(ops[begin], no=at + 1)
            return Op("jump", None, begin)
    raise NotFollowedError


def _loop(name: str, text: bytes) -> tuple[bytes | None, bytes]:
    """Split the begin of a loop: its condition, and ``DO1``."""
    return _bracket(text) if name == "WHILE" else (None, b"DO" + text)


def _bracket(text: bytes) -> tuple[bytes, bytes]:
    """Split ``[..]GOTO1`` behind its bracket."""
    depth = 0
    for k, byte in enumerate(text):
        depth += (byte == 0x5B) - (byte == 0x5D)
        if depth == 0:
            if k == 0:
                break
            return text[: k + 1], text[k + 1 :]
    raise NotFollowedError


def _goto(script: Script, unit: Unit, text: bytes, condition: bytes | None, at: int) -> Op:
    """A jump to a number; to one that is computed only without a condition."""
    if match := _NUMBER.fullmatch(text):
        target = script.numbers.get((unit.first, int(match[1])), LOST)
        return Op("jump", condition, target, at + 1, "goto")
    if condition is None and text[:1] in (b"#", b"["):
        return Op("computed", text)
    raise NotFollowedError


# Complex: one case for each of three calls, which share their numbers.
def _call(script: Script, unit: Unit, at: int, block: Block, dialect: Dialect) -> Op | None:
    """``M98 P1000 L3``, ``M97 P100``, ``G65 P9000 A1.``; None for any other block."""
    codes = {(w.letter, w.value) for w in block.words if w.letter in "GM"}
    values = {w.letter: w.value for w in block.words}
    number, count = values.get("P"), values.get("L", 1.0)
    whole = number is not None and number > 0.0 and number.is_integer()
    whole = whole and count is not None and count.is_integer() and count >= 1.0
    if not whole or block.problem is not None or block.assigns or block.block_delete:
        return None
    assert number is not None
    assert count is not None
    times = b"%d" % int(count)
    if codes == {("G", 65.0)}:
        return Op(
            "call",
            None,
            at + 1,
            name=str(int(number)),
            arguments=_given(block, dialect),
            count=times,
        )
    if len(codes) != 1 or {w.letter for w in block.words} - set("MNPL"):
        return None
    if codes == {("M", 98.0)}:
        name = str(int(number))
        packed = dialect.packed_repeats and number >= _PACKED and "L" not in values
        if packed and not any(u.name == name for u in script.units):
            name, times = str(int(number) % _PACKED), b"%d" % (int(number) // _PACKED)
        return Op("call", None, at + 1, name=name, count=times, scoped=False)
    if codes == {("M", 97.0)} and dialect.m_groups.get(97) == "stop":
        target = script.numbers.get((unit.first, int(number)), LOST)
        return Op("part", None, at + 1, target, count=times, name="M97")
    return None


def _given(block: Block, dialect: Dialect) -> tuple[tuple[str, bytes], ...]:
    """Give the arguments of a macro the variables that they become: A is #1, I J K I is #4 to #7.

    What a number without a decimal point means is the control's own: it is not known.
    """
    letters = dialect.arithmetic.parameters
    given: dict[str, bytes] = {}
    turn, last = 0, -1
    for word in block.words:
        letter = word.letter
        if letter in "GPLN":
            continue
        value = b"#" if word.whole and word.value else word.text[1:]
        if letter in _SETS:
            turn += _SETS.index(letter) <= last
            last = _SETS.index(letter)
            given[str(4 + 3 * turn + last)] = value
        elif letter in letters:
            key = str(letters.index(letter) + 1)
            given[key] = b"#" if key in given else value
    return tuple(given.items())
