"""Where LinuxCNC's loops, branches and subprograms begin and end, for the proof.

Rule: a table over the lines of a file, filled by one look ahead for each structure; what is not
nested as LinuxCNC demands has no end here, and is nobody's structure.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from gcodejerk.verification.unrolling.values import code_of

_O = re.compile(
    rb"(?:N[0-9]+)?O(<[^<>]*>|[0-9]+)"
    rb"(SUB|ENDSUB|IF|ELSEIF|ELSE|ENDIF|WHILE|ENDWHILE|DO|REPEAT|ENDREPEAT|CALL|RETURN|BREAK"
    rb"|CONTINUE)?((?:\[.*\])?)"
)
_MAYBE = re.compile(rb"(?:N[0-9]+)?/?O", re.IGNORECASE)
_OPENS = frozenset((b"SUB", b"IF", b"WHILE", b"DO", b"REPEAT"))
_JUMPS = frozenset((b"CALL", b"RETURN", b"BREAK", b"CONTINUE"))
_DEEPEST = 12


@dataclass(frozen=True, slots=True)
class OWord:
    """A line of flow."""

    word: bytes
    """Its keyword; empty where it is not understood."""
    label: bytes
    arguments: tuple[bytes, ...]


@dataclass(slots=True)
class Table:
    """The lines of a file, and what is known of their structures."""

    code: list[bytes] = field(default_factory=list)
    """As `values.code_of` gives it."""
    text: list[bytes] = field(default_factory=list)
    """Without line ends."""
    end: dict[int, int] = field(default_factory=dict)
    """First line of a structure -> its last."""
    begin: dict[int, int] = field(default_factory=dict)
    """The other way round."""
    next: dict[int, int] = field(default_factory=dict)
    """Of an ``if``: from each of its lines to the next, ``endif`` last."""
    around: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """A ``break`` or ``continue`` -> the structures that it stands in, innermost first."""

    def add(self, lines: Sequence[bytes]) -> int:
        """Put lines behind the others; the number of the first, from 0."""
        first = len(self.text)
        self.text += [line.removesuffix(b"\r") for line in lines]
        self.code += [code_of(line) for line in lines]
        return first

    def o_word(self, at: int) -> OWord | None:
        """The flow of a line; None where it has none."""
        code = self.code[at]
        if not _MAYBE.match(code):
            return None
        match = _O.fullmatch(code)
        arguments = None if match is None else _cut(match[3])
        if match is None or arguments is None or match[2] is None:
            return OWord(b"", b"", ())
        label = match[1] if match[1][:1] == b"<" else b"%d" % int(match[1])
        return OWord(match[2], label, arguments)

    # Complex: one case for each O-word, which opens, divides or closes what is open.
    def find(self, first: int) -> int | None:
        """Find the last line of the structure that begins here; None where it is none."""
        head = self.o_word(first)
        if head is None or head.word not in _OPENS:
            return None
        opened: list[tuple[bytes, bytes, int, list[int]]] = []
        for at in range(first, len(self.code)):
            if self.code[at] == b"%":
                return None
            line = self.o_word(at)
            if line is None:
                continue
            top = opened[-1] if opened else (b"", b"", -1, [])
            same = top[1] == line.label
            if line.word in _JUMPS:
                if line.word in (b"BREAK", b"CONTINUE"):
                    self.around[at] = tuple(each[2] for each in reversed(opened))
            elif line.word in (b"ELSE", b"ELSEIF") and same and top[0] == b"IF":
                top[3].append(at)
            elif same and (
                line.word == b"END" + top[0] or (line.word == b"WHILE" and top[0] == b"DO")
            ):
                opened.pop()
                self.end[top[2]], self.begin[at] = at, top[2]
                chain = [top[2], *top[3], at]
                self.next.update(zip(chain, chain[1:], strict=False))  # noqa: RUF007
                if not opened:
                    return at
            elif line.word in _OPENS and not (line.word == b"SUB" and opened):
                opened.append((line.word, line.label, at, []))
                if len(opened) > _DEEPEST:
                    return None
            else:
                return None
        return None


def _cut(text: bytes) -> tuple[bytes, ...] | None:
    """Split ``[1][2*[3]]``; None where brackets do not pair, or other text stands there."""
    parts, depth, begin = [], 0, 0
    for k, byte in enumerate(text):
        if depth == 0 and byte != 0x5B:
            return None
        depth += (byte == 0x5B) - (byte == 0x5D)
        if depth == 0:
            parts.append(text[begin : k + 1])
            begin = k + 1
    return tuple(parts) if depth == 0 else None
