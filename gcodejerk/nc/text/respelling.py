"""Plain straight lines of Klartext in the words of G-code: ``12 L X+5 Y+2 R0 FMAX`` is G0 X+5 Y+2.

This module owns which lines of Klartext are plain, and their new spelling. Every byte keeps its
place: what is not needed becomes a blank. The number of a block and R0 say nothing where cutter
compensation is off, and in no other state are plain lines taken at once.

Rule: when in doubt a line is read with care, as it stands in the file: then `ODD` is put at its
beginning, with which no plain line begins.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Flags = NDArray[np.bool_]
Places = NDArray[np.int64]

ODD = ord("?")
_FRONT = 12
"""Bytes in front of L, at most: blanks, and the number of the block."""
_AROUND = 4
"""Line feeds around the text, so that neighbours of its bytes need no second look."""
_BLANKS = np.array([byte in b" \t" for byte in range(256)])
_ENDS = np.array([byte in b" \t\r\n;" for byte in range(256)])
_FOREIGN = np.array([chr(byte).isalpha() and byte not in b"XYZABCUVWFG" for byte in range(128)])
_FOREIGN = np.append(_FOREIGN, np.zeros(128, dtype=np.bool_))
"""Letters that a plain line does not have in its new spelling; other bytes the lexer knows."""
_LETTERS = np.array([byte in b"XYZABCUVWF" for byte in range(256)])


def respelled(data: bytes) -> bytes:
    r"""Spell the plain lines of a chunk as G0 and G1, byte for byte in their places.

    Parameters
    ----------
    data : bytes
        Whole lines; the last one may lack its end.

    Returns
    -------
    bytes
        As many, with the same ends of lines.

    Examples
    --------
    >>> respelled(b"7 L  X+5 R0 FMAX\n8 L Z-1 F90 M8\n9 LBL 1\n")
    b'  G0 X+5        \n? G1Z-1 F90 M8\n? LBL 1\n'
    """
    around = b"\n" * _AROUND
    original = np.frombuffer(around + data + around, dtype=np.uint8)
    text = original.copy()
    ends = np.flatnonzero(text == ord("\n"))[_AROUND - 1 : -(_AROUND - 1)]
    lines = _Lines(text, ends[:-1] + 1, ends[1:])
    odd = lines.take_heads()
    remark = lines.first(ord(";"))
    odd |= lines.blank_out(b"R0", remark) > 1
    fast = lines.blank_out(b"FMAX", remark)
    odd |= fast > 1

    letter, line = lines.words(_LETTERS, remark)
    odd[line[~_BLANKS.take(original.take(letter - 1))]] = True
    odd[line[(text.take(letter) == ord("F")) & (fast[line] > 0)]] = True
    odd[lines.words(_FOREIGN, remark)[1]] = True
    odd[lines.line_of(np.flatnonzero(text == ord("~")))] = True

    rapid = np.flatnonzero(~odd & (fast > 0))
    text[lines.head[rapid] + 1] = ord("0")
    marked = lines.begin[odd]
    text[marked[~np.isin(text.take(marked), (ord("\r"), ord("\n")))]] = ODD
    return text[_AROUND:-_AROUND].tobytes()


class _Lines:
    """The lines of a text: begin:end of each, without its line feed."""

    def __init__(self, text: Bytes, begin: Places, end: Places) -> None:
        self.text, self.begin, self.end = text, begin, end
        self.head = self.first(ord("L"))
        """Where L stands in each, or its end."""

    def line_of(self, place: Places) -> Places:
        """The lines that some bytes stand on."""
        lines: Places = np.searchsorted(self.end, place)
        return lines

    def first(self, byte: int) -> Places:
        """Where a byte stands first in each line; the line's end where it doesn't."""
        place = np.flatnonzero(self.text == byte)
        at = np.searchsorted(place, self.begin)
        found = np.append(place, len(self.text)).take(at)
        first: Places = np.minimum(found, self.end)
        return first

    def take_heads(self) -> Flags:
        """Spell ``12 L`` as G1; the lines that do not begin so."""
        text, begin, head = self.text, self.begin, self.head
        length = head - begin
        odd: Flags = (head == self.end) | (length > _FRONT) | ~_BLANKS.take(text.take(head + 1))
        odd |= (length > 0) & ~_BLANKS.take(text.take(head - 1))
        number, over = np.zeros(len(begin), dtype=np.bool_), np.zeros(len(begin), dtype=np.bool_)
        for k in range(min(_FRONT, int(length[~odd].max(initial=0)))):
            inside = k < length
            byte = text.take(begin + k, mode="clip")
            digit = (byte >= ord("0")) & (byte <= ord("9"))
            odd |= inside & ~(digit | _BLANKS.take(byte))
            odd |= inside & digit & over
            over |= number & ~digit
            number |= digit
        for k in range(min(_FRONT, int(length[~odd].max(initial=0)))):
            text[begin[~odd & (k < length)] + k] = ord(" ")
        text[head[~odd]], text[head[~odd] + 1] = ord("G"), ord("1")
        return odd

    def words(self, table: Flags, remark: Places) -> tuple[Places, Places]:
        """Where bytes of a kind stand in front of comments, and on which lines."""
        place = np.flatnonzero(table.take(self.text))
        line = self.line_of(place)
        inside = line < len(self.begin)
        place, line = place[inside], line[inside]
        before = place < remark.take(line)
        return place[before], line[before]

    def blank_out(self, word: bytes, remark: Places) -> Places:
        """Put blanks in the place of a word; how often it stood on each line."""
        text = self.text
        place = np.flatnonzero(text == word[-1])
        place = place[(place >= len(word)) & (place < len(text) - 1)] - (len(word) - 1)
        for k, byte in enumerate(word[:-1]):
            place = place[text.take(place + k) == byte]
        place = place[_BLANKS.take(text.take(place - 1)) & _ENDS.take(text.take(place + len(word)))]
        line = self.line_of(place)
        inside = line < len(self.begin)
        place, line = place[inside], line[inside]
        before = place < remark.take(line)
        for k in range(len(word)):
            text[place[before] + k] = ord(" ")
        count: Places = np.bincount(line[before], minlength=len(self.begin))
        return count
