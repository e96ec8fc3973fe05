"""Subprograms in other files, for the second reading: found and put behind the program once more.

Rule: what the program defines itself is its own; a name with two meanings in the folder has none.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping

from gcodejerk.nc import Dialect, Start

MOST = 200_000
"""Lines of other files."""
_SPF = re.compile(rb"^[ \t]*%_N_([A-Z0-9_]+)_SPF[ \t]*$", re.IGNORECASE | re.MULTILINE)
_ANY = re.compile(rb"^[ \t]*%_N_[A-Z0-9_]+_[A-Z]+[ \t]*$", re.IGNORECASE | re.MULTILINE)
_O = re.compile(rb"^[ \t]*[O:][ \t]*([0-9]+)", re.IGNORECASE | re.MULTILINE)
_END = re.compile(rb"^[ \t]*%", re.MULTILINE)
_REST = re.compile(rb"\(.*?(?:\)|$)|;.*$", re.MULTILINE)
_BEHIND = re.compile(rb";.*$", re.MULTILINE)
_IN_FILE = re.compile(r"[op]?0*([1-9][0-9]*)(?:\..*)?", re.IGNORECASE)


def lines_behind(whole: bytes, dialect: Dialect, start: Start) -> list[bytes]:
    """Lines of other files that a program goes on in."""
    rules = dialect.text
    numbered = bool(rules.keywords) and rules.o_word == "program"
    if not start.subprograms or not (numbered or (rules.names and rules.variables == "R")):
        return []
    return lines_elsewhere(whole, start.subprograms, dialect)


def lines_elsewhere(program: bytes, files: Mapping[str, bytes], dialect: Dialect) -> list[bytes]:
    """Lines to stand behind those of a program, each subprogram under a head of its own.

    Parameters
    ----------
    program : bytes
        Its text.
    files : mapping of str to bytes
        Where the control finds what it calls.
    dialect : Dialect
        Of all.
    """
    by_names = dialect.text.names
    texts: dict[str, set[bytes]] = {}
    for file, text in files.items():
        if text != program:
            for name, body in _meanings(_plain(text), os.path.basename(file), by_names):
                texts.setdefault(name, set()).add(body)
    mine = {name for name, _ in _meanings(_plain(program), "", by_names)}
    out: list[bytes] = []
    asked, answered = _mentions(program, by_names), set[str]()
    while asked - answered:
        name = sorted(asked - answered)[0]
        answered.add(name)
        bodies = texts.get(name, set())
        if len(bodies) != 1 or name in mine or (by_names and name in dialect.names):
            continue
        (body,) = bodies
        rows = body.split(b"\n")
        if len(out) + len(rows) > MOST:
            continue
        out += [b"%%_N_%s_SPF" % name.encode() if by_names else b"O" + name.encode(), *rows]
        asked |= _mentions(body, by_names)
    return out


def _plain(text: bytes) -> bytes:
    """A text without its mark, and without carriage returns at line ends."""
    return text.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").rstrip(b"\r")


def _meanings(text: bytes, file: str, by_names: bool) -> list[tuple[str, bytes]]:
    """Name and text of each subprogram of a file."""
    heads = list((_ANY if by_names else _O).finditer(text))
    if by_names:
        if not heads and file.upper().endswith(".SPF"):
            return [(file[:-4].upper(), text)]
        ends = [*(head.start() for head in heads[1:]), len(text)]
        return [
            (spf[1].decode().upper(), text[head.end() + 1 : end])
            for head, end in zip(heads, ends, strict=False)
            if (spf := _SPF.fullmatch(head[0]))
        ]
    closed = [mark.start() for mark in _END.finditer(text)]
    if heads:
        last = next((at for at in closed if at > heads[0].start()), len(text))
        heads = [head for head in heads if head.start() < last]
        ends = [*(head.start() for head in heads[1:]), last]
        return [
            (str(int(head[1])), _behind_head(text[head.start() : end]))
            for head, end in zip(heads, ends, strict=True)
        ]
    name = _IN_FILE.fullmatch(file)
    if name is None:
        return []
    begin = text.find(b"\n", closed[0]) + 1 if closed else 0
    return [(name[1], text[begin : closed[1] if len(closed) > 1 else len(text)])]


def _behind_head(text: bytes) -> bytes:
    """What stands below the line of the number; all of it where words stand beside the number."""
    first, _, rest = text.partition(b"\n")
    return rest if _O.fullmatch(_REST.sub(b"", first).rstrip(b" \t;")) else text


def _mentions(text: bytes, by_names: bool) -> set[str]:
    """Names that may be calls."""
    if by_names:
        upper = _BEHIND.sub(b"", _plain(text)).upper()
        return {word.decode() for word in re.findall(rb"[A-Z_][A-Z0-9_]*", upper)}
    found = set[str]()
    for row in _REST.sub(b"", _plain(text)).upper().replace(b" ", b"").split(b"\n"):
        if re.search(rb"M0*98(?![0-9.])|G0*65(?![0-9.])", row):
            for number in re.findall(rb"P0*([0-9]+)", row):
                found |= {number.decode(), str(int(number) % 10_000)}
    return found
