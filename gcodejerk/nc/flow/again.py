"""Whether a program of LinuxCNC begins again, for ever: M99 where no subprogram runs.

Rule 1: a subprogram returns behind its call, so the main program is read from its first line on,
and what stands behind its certain end (M2, M30) runs in calls alone: M99 there only returns. The
end is certain where no structure of O-words is open, and no `/` can pass over it.

Rule 2: what is in doubt begins again. The number of an M code may be computed, and is rounded
(interp_read.cc of 2.9: M98.99995 is M99); O-words that are not nested as they should be, or have a
label twice, may pass over any line.
"""

from __future__ import annotations

import re
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.flow.structures import plain_name
from gcodejerk.nc.text.block import Block
from gcodejerk.nc.text.chunks import read_chunks
from gcodejerk.nc.text.tokenizer import parse_line

_MAY_BE_M99 = re.compile(rb"[Mm][ \t\r+0]*(?:9[ \t\r]*[89]|[^ \t\r+0-9])")
_LETTERS = re.compile(rb"[OoMm]")
_COMMENT = re.compile(rb"\([^)\n]*(?:\)|$)|;[^\n]*", re.MULTILINE)
_NAME = re.compile(rb"<[^<>\n]*>|MOD", re.IGNORECASE)
"""What has an M and is no M code."""
_NEAR = 0.1
"""How far a number is from 99 that cannot be meant."""
_OPENS = frozenset({"sub", "if", "while", "repeat", "do"})
_WITHIN = {
    "else": ("if",),
    "elseif": ("if",),
    "break": ("while", "do"),
    "continue": ("while", "do"),
    "return": ("sub",),
}
"""Words within a structure, and which."""


def begins_again(file: BinaryIO, name: str, dialect: Dialect) -> bool:
    """Whether a program with O-words may go back to its first line.

    Parameters
    ----------
    file : BinaryIO
        Seekable; left where it stands.
    name : str
        For messages.
    dialect : Dialect
        How it is written.

    Returns
    -------
    bool
    """
    begin = file.tell()
    found = any(_says_m99(chunk.data) for chunk in read_chunks(file, name))
    file.seek(begin)
    if found:
        found = _in_main(file, name, dialect)
        file.seek(begin)
    return found


def _says_m99(data: bytes) -> bool:
    """Whether what may be M99 stands in whole lines, outside of comments."""
    # Letter by letter: that is quick, and most programs have few.
    for letter in (b"M", b"m"):
        at = data.find(letter)
        while at >= 0:
            if _MAY_BE_M99.match(data, at):
                return _MAY_BE_M99.search(_NAME.sub(b"", _COMMENT.sub(b" ", data))) is not None
            at = data.find(letter, at + 1)
    return False


def _in_main(file: BinaryIO, name: str, dialect: Dialect) -> bool:
    """Whether M99 may be reached in front of the certain end of the main program."""
    main = _Main()
    for chunk in read_chunks(file, name):
        data = _COMMENT.sub(b" ", chunk.data)
        behind = -1
        for match in _LETTERS.finditer(data):
            at = match.start()
            if at < behind:
                continue
            behind = data.find(b"\n", at) % (len(data) + 1)
            text = data[data.rfind(b"\n", 0, at) + 1 : behind].removesuffix(b"\r")
            block = parse_line(text, dialect)
            if _is_m99(block, text):
                return True
            if main.ends(block):
                return False
    return False


def _is_m99(block: Block, text: bytes) -> bool:
    """Whether a block says M99, or may; one that is not understood by its text."""
    if block.problem is not None:
        return _MAY_BE_M99.search(_NAME.sub(b"", text)) is not None
    numbers = [word.value for word in block.words if word.letter == "M"]
    return any(number is None or abs(number - 99.0) < _NEAR for number in numbers)


class _Main:
    """The main program up to its end: which structures are open."""

    def __init__(self) -> None:
        self._open: list[tuple[str, str]] = []
        """Kind and label, one within another."""
        self._labels: set[str] = set()
        """All so far."""
        self._lost = False
        """Any line may be passed over from here on."""

    def ends(self, block: Block) -> bool:
        """Take a block; whether the main program ends with it for certain."""
        if block.problem is not None:
            # Lines with another letter than O do what they do, or are an error.
            self._lost |= block.o_word is not None or b"O" in block.rest.upper()
            return False
        if block.o_word is not None:
            self._take(block)
            return False
        ends = any(word.letter == "M" and word.value in (2.0, 30.0) for word in block.words)
        return ends and not (block.block_delete or self._open or self._lost)

    def _take(self, block: Block) -> None:
        """Take an O-word."""
        kind, label = block.o_word or "", plain_name(block.o_name)
        top = self._open[-1] if self._open else ("", None)
        if label is None or block.block_delete:
            self._lost = True
        elif kind in ("", "call"):
            pass  # the number of a program, or a subprogram that returns
        elif (kind, *top) == ("while", "do", label) or (kind == f"end{top[0]}" and top[1] == label):
            self._open.pop()
        elif kind in _OPENS and label not in self._labels:
            self._open.append((kind, label))
            self._labels.add(label)
        elif not any((each, label) in self._open for each in _WITHIN.get(kind, ())):
            self._lost = True
