"""What a whole program is looked through for before its second reading: ways back to earlier lines.

Each look begins where the file stands, and leaves it there.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import BinaryIO

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.verification.second_reading.reading import pieces

_JUMPS = re.compile(rb"(?:GOTO|DO)[ \t]*[0-9#\[]|WHILE[ \t]*\[", re.IGNORECASE)
_NAMED_JUMPS = re.compile(rb"\b(?:GOTO[FBCS]?|WHILE|REPEATB?|UNTIL|LOOP|FOR|CASE)\b", re.IGNORECASE)
"""What may lead back to a line that was read before."""
_TEXTS = re.compile(rb"\([ \t]*(?![ \t]*(?:GOTO|IF|CALL|RPT)\b)[^()\n]*\)|;.*", re.IGNORECASE)
_FLOW = re.compile(
    rb"\b(?:GOTO|IF|WHILE|REPEAT|RPT|LOOP|FOR|CASE|UNTIL|GOSUB|CALL)(?![A-Z_])", re.IGNORECASE
)
"""The same where the words of flow are not known, behind which comments are left out."""
_AGAIN = re.compile(rb"[Mm](?:[ \t]|0)*9[ \t]*9(?![0-9.])")
_REMARKS = re.compile(rb"\([^)\n]*\)|;[^\n]*")


def begins_again(file: BinaryIO, dialect: Dialect) -> bool:
    """Whether the last line may lead to the first one: M99 where O words are of flow."""
    return dialect.text.o_word == "flow" and _any(
        file, lambda data: bool(_AGAIN.search(data) and _AGAIN.search(_REMARKS.sub(b" ", data)))
    )


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
