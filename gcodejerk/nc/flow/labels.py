"""Flow of Heidenhain: ``CALL LBL 1``, ``CALL LBL 1 REP 2``, ``FN 9``; in DIN/ISO ``L1,0``, ``D09``.

A label is called up to the next LBL 0 (G98 L0), or the part of the program behind it runs again, as
often as REP says, besides the first time. A jump leads to a label on a condition.

Sources: drunsinn/language-klartext: grammars/klartext.cson (the statements); programs in public and
what their authors say of them (``REP 3/3`` and ``REP 3``: four passes in all; subprograms behind
M30). That D09 to D12 take operands as D00 to D05 do (TNC 360 ISO manual p. 7-5) and then the label,
and that the 0 of ``L1,0`` is a call, is general knowledge.

Rule: what is not written so, has words or a ``/`` beside it, or stands where the sources do not say
what happens (an LBL 0 that nobody called, a part that begins behind its REP), is not followed
(`NotFollowedError`): then nothing of the file is.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.macro_b import NotFollowedError
from gcodejerk.nc.flow.script import LOST, Op, Script, Unit
from gcodejerk.nc.text.block import Block, Line
from gcodejerk.nc.text.q_parameters import OPERAND, bracketed, p_operands

_NAME = rb"([0-9]{1,5}|\"[^\"]*\")"
_LABEL = re.compile(rb"[ \t]+" + _NAME + rb"[ \t]*")
_CALL = re.compile(
    rb"[ \t]+" + _NAME + rb"[ \t]*(?:REP[ \t]*([0-9]{1,5})(?:/([0-9]{1,5}))?)?[ \t]*", re.IGNORECASE
)
_JUMP = re.compile(
    rb"[ \t]*IF[ \t]+(" + OPERAND + rb")[ \t]+(EQU|NE|GT|LT)[ \t]+(" + OPERAND + rb")"
    rb"[ \t]+GOTO[ \t]+LBL[ \t]+" + _NAME + rb"[ \t]*",
    re.IGNORECASE,
)
_COMPARED = {9: b"==", 10: b"<>", 11: b">", 12: b"<"}
_WRITTEN = {b"EQU": 9, b"NE": 10, b"GT": 11, b"LT": 12}
_END = b"0"
"""Label that ends what a call runs."""


def label_script(lines: list[Line], dialect: Dialect) -> Script:
    """Write a file down as a script.

    Parameters
    ----------
    lines : list of Line
        Of the file.
    dialect : Dialect
        Klartext or DIN/ISO.

    Raises
    ------
    NotFollowedError
    """
    closing = [k for k, line in enumerate(lines) if line.block.percent][1:]
    last = closing[0] if closing else len(lines)
    if last < len(lines) - 1:
        raise NotFollowedError  # another program behind the end of this one
    script = Script(lines, [Unit(0, last, main=True)])
    compiler = _Compiler(lines[:last], klartext=dialect.text.klartext)
    for at in range(last):
        op = compiler.op(at)
        if op is not None:
            script.ops[at] = op
    return script


class _Compiler:
    """Writes the lines of flow down."""

    def __init__(self, lines: list[Line], *, klartext: bool) -> None:
        self.lines, self.klartext = lines, klartext
        self.labels: dict[bytes, int] = {}
        """Label -> its line; `LOST` where it stands twice."""
        for at, line in enumerate(lines):
            label = self._label(line.block)
            if label is not None and label != _END:
                self.labels[label] = LOST if label in self.labels else at

    def op(self, at: int) -> Op | None:
        """What a line does; None for a block."""
        block = self.lines[at].block
        label = self._label(block)
        if label is None:
            op = self._named(at, block) if self.klartext else self._coded(at, block)
        else:
            op = Op("return") if label == _END else Op("jump", None, at + 1, at + 1)
        if op is not None and block.block_delete:
            raise NotFollowedError
        return op

    def _label(self, block: Block) -> bytes | None:
        """The label that a line is; None for another line."""
        if self.klartext:
            if not any(name.name == "LBL" for name in block.names):
                return None
            match = _LABEL.fullmatch(block.names[0].arguments)
            if match is None or not _is_alone(block):
                raise NotFollowedError
            return _key(match[1])
        if not any(word.letter == "G" and word.value == 98.0 for word in block.words):
            return None
        words = [word for word in block.words if word.letter != "N"]
        number = words[-1].value
        plain = [word.letter for word in words] == ["G", "L"] and b"," not in words[-1].text
        if not plain or number is None or not number.is_integer() or not _says_no_more(block):
            raise NotFollowedError
        return _key(b"%d" % int(number))

    def _named(self, at: int, block: Block) -> Op | None:
        """A line of Klartext."""
        name, text = block.names[0] if block.names else ("", b"")
        if name == "CALL LBL":
            match = _CALL.fullmatch(text)
            if match is None or not _is_alone(block) or (match[3] and match[3] != match[2]):
                raise NotFollowedError
            return self._call(at, match[1], int(match[2] or b"0"))
        if name in ("FN 9", "FN 10", "FN 11", "FN 12"):
            jump = _JUMP.fullmatch(text)
            if jump is None or not _is_alone(block) or _WRITTEN[jump[2].upper()] != int(name[3:]):
                raise NotFollowedError
            return self._go(at, int(name[3:]), jump[1], jump[3], jump[4])
        return None

    def _coded(self, at: int, block: Block) -> Op | None:
        """A line of DIN/ISO."""
        calls = [word for word in block.words if word.letter == "L"]
        if calls:
            label, _, times = calls[0].text[1:].partition(b",")
            others = any(word.letter not in "NL" for word in block.words) or len(calls) > 1
            if others or not times or not _says_no_more(block):
                raise NotFollowedError
            return self._call(at, label.strip(b" \t"), int(times))
        if block.names and block.names[0].name in ("D9", "D10", "D11", "D12"):
            operands = p_operands(block.names[0].arguments.strip(b" \t")) or []
            if len(operands) != 3 or not operands[2].isdigit() or not _is_alone(block):
                raise NotFollowedError
            return self._go(at, int(block.names[0].name[1:]), *operands)
        return None

    def _call(self, at: int, label: bytes, times: int) -> Op:
        """A call up to the end of what it calls, or so many passes more of the part in front."""
        target = self.labels.get(_key(label), LOST)
        if not times:
            return Op("part", None, at + 1, target, name="M97")
        if target > at:
            raise NotFollowedError
        return Op("part", None, at + 1, target, count=b"%d" % times, first=b"%d" % at)

    def _go(self, at: int, function: int, first: bytes, second: bytes, label: bytes) -> Op:
        """A jump on a condition."""
        condition = bracketed(first) + _COMPARED[function] + bracketed(second)
        return Op("jump", condition, self.labels.get(_key(label), LOST), at + 1, "goto")


def _key(label: bytes) -> bytes:
    """A label by itself: 05 is 5."""
    return b"%d" % int(label) if label.isdigit() else label


def _says_no_more(block: Block) -> bool:
    """Whether a block has nothing but its words."""
    return block.problem is None and not (block.names or block.assigns)


def _is_alone(block: Block) -> bool:
    """Whether a statement stands alone in its block."""
    words = any(word.letter != "N" for word in block.words)
    return len(block.names) == 1 and not (words or block.assigns or block.problem)
