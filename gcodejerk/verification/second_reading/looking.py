"""What a whole program is looked through for before its second reading: ways back to earlier lines.

Each look begins where the file stands, and leaves it there.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.reading import pieces

_JUMPS = re.compile(rb"(?:GOTO|DO)[ \t]*[0-9#\[]|WHILE[ \t]*\[|M[ \t]*0*46(?![0-9])", re.IGNORECASE)
_NAMED_JUMPS = re.compile(rb"\b(?:GOTO[FBCS]?|WHILE|REPEATB?|UNTIL|LOOP|FOR|CASE)\b", re.IGNORECASE)
"""What may lead back to a line that was read before."""
_TEXTS = re.compile(rb"\([ \t]*(?![ \t]*(?:GOTO|IF|CALL|RPT)\b)[^()\n]*\)|;.*", re.IGNORECASE)
_FLOW = re.compile(
    rb"\b(?:GOTO|IF|WHILE|REPEAT|RPT|LOOP|FOR|CASE|UNTIL|GOSUB|CALL)(?![A-Z_])", re.IGNORECASE
)
"""The same where the words of flow are not known, behind which comments are left out."""
_AGAIN = re.compile(
    rb"M(?:\+?0*(?:99(?:\.0[0-9]*|\.?(?![0-9.]))|98\.9)|[-+]?(?!OD)[^-+.0-9]|[-+]{2})"
)
"""M99, or what may be: computed, or rounded to it. Behind `_said`."""
_AGAIN_PERHAPS = re.compile(rb"[Mm][ \t\r0+]*(?:9[ \t\r]*[89]|[^ \t\r0-9+])")
"""The same in a piece of a file, comments and all."""
_REMARKS = re.compile(rb"\([^)\n]*\)?|;[^\n]*")
_WITH_CODE = re.compile(rb"^[^\nMmOo]*[MmOo][^\n]*", re.MULTILINE)
_BLANKS = re.compile(rb"[ \t\r]+")
_NAMED = re.compile(rb"<[^<>]*>")
_END = re.compile(rb"(?!/|(?:N[0-9.]+)?O).*?M\+?0*(?:2|30)(?:\.0*)?(?![0-9.])")
"""The end of a program, on a line that is always read and has no O-word."""
_O_LINE = re.compile(rb"(/?)(?:N[0-9.]+)?O(?:(<[^<>]*>|[0-9]+)(?![0-9.]))?([A-Z]*)")
_OPENING = {b"SUB", b"IF", b"WHILE", b"REPEAT", b"DO"}
_INNER = {
    **{b"ELSE": {b"IF"}, b"ELSEIF": {b"IF"}, b"RETURN": {b"SUB"}},
    **{b"BREAK": {b"WHILE", b"DO"}, b"CONTINUE": {b"WHILE", b"DO"}},
}


def begins_again(file: BinaryIO, dialect: Dialect) -> bool:
    """Whether a line of the main program may lead to the first one: M99 where O words are of flow.

    Behind M2 or M30 it only ends subprograms, unless something may pass over that end.
    """
    if dialect.text.o_word != "flow" or not _any(file, _perhaps):
        return False
    begin = file.tell()
    found = _before_the_end(line for piece in pieces(file) for line in _said(piece))
    file.seek(begin)
    return found


def _perhaps(data: bytes) -> bool:
    """Whether M99 may stand in a piece, in front of its end or behind it."""
    if b"M" not in data and b"m" not in data:
        return False
    return _AGAIN_PERHAPS.search(_NAMED.sub(b"", _REMARKS.sub(b" ", data))) is not None


def _said(piece: bytes) -> Iterator[bytes]:
    """What a control with O words of flow reads of the lines that have an O or an M."""
    for line in _WITH_CODE.findall(_REMARKS.sub(b"", piece)):
        yield _BLANKS.sub(b"", line).upper()


def _before_the_end(lines: Iterator[bytes]) -> bool:
    """Whether M99 comes before an end that nothing passes over."""
    inside: list[tuple[bytes, bytes]] = []
    had: set[bytes] = set()
    sure = True
    for line in lines:
        plain = _NAMED.sub(b"<>", line)
        if _AGAIN.search(plain):
            return True
        if sure and not inside and _END.match(plain):
            return False
        word = _O_LINE.match(line)
        sure = sure and (word is None or _nested(word, inside, had))
    return False


def _nested(word: re.Match[bytes], inside: list[tuple[bytes, bytes]], had: set[bytes]) -> bool:
    """Take an O-word; False where it is not nested as it should be."""
    said = word[3]
    if word[1] or word[2] is None:
        return False
    if not said or said == b"CALL":
        return True
    label = word[2] if word[2].startswith(b"<") else word[2].lstrip(b"0")
    if inside and inside[-1] in ((said.removeprefix(b"END"), label), (b"DO", label)):
        kind = inside[-1][0]
        if said == (b"WHILE" if kind == b"DO" else b"END" + kind):
            inside.pop()
            return True
    if said in _OPENING and label not in had:
        inside.append((said, label))
        had.add(label)
        return True
    return any((kind, label) in inside for kind in _INNER.get(said, ()))


def jumps_back(file: BinaryIO, dialect: Dialect) -> bool:
    """Whether a program may come to a line twice, by a jump rather than by an O word."""
    named = dialect.text.names and dialect.text.variables == "R"
    if dialect.unknown_lasts and dialect.text.names and not dialect.one_command:
        return _any(file, lambda data: _FLOW.search(_TEXTS.sub(b"", data)) is not None)
    if not dialect.text.keywords and not named:
        return False
    jumps = _NAMED_JUMPS if named else _JUMPS
    return _any(file, lambda data: jumps.search(data) is not None)


def _any(file: BinaryIO, says: Callable[[bytes], bool]) -> bool:
    """Whether any piece of the rest of a file does."""
    begin = file.tell()
    found = any(map(says, pieces(file)))
    file.seek(begin)
    return found
