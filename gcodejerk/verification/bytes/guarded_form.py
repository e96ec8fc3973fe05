"""Streams behind an override guard, read back; and programs in which none may stand.

Between the block's other words and what runs behind the motion stand, exactly: the line that reads
the guard's input, an O-word, the stream with all that leads into it, an O-word, the rapid of the
original block word by word, an O-word.

Rule: a stream without its guard, and a guard that reads something else, are violations alike.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import BinaryIO

from gcodejerk.axes import AXES
from gcodejerk.verification.bytes.aligned_form import AlignedReader
from gcodejerk.verification.findings import Findings, Kind

INPUT = b"M66 E3 L0"
"""Reads `motion.analog-in-03` into #5399."""
_READ_BY_PEOPLE = re.compile(rb"\((?!\s*(?:ABORT|DEBUG|PRINT|LOG|PY))[^)]*\)|;(?!\s*PY).*")
_LABEL = re.compile(rb"(?:/[0-9]?)?(?:N[0-9.]+)?O(<[^>]*>|[0-9]*)")
_TAKEN = (
    (re.compile(rb"#\s*0*5399(?![0-9])"), "the program uses #5399, which the guard overwrites"),
    (re.compile(rb"#\s*[#\[]"), "the program computes the number of a parameter: #5399 perhaps"),
    (re.compile(rb"(?<![A-Z_])M\s*0*66(?![0-9])"), "the program uses M66, as the guard does"),
    (re.compile(rb"^[^<]*O\s*<\s*GCODEJERK-"), "the program has an O-word of the guard's name"),
)


class GuardedReader(AlignedReader):
    """Reads one replacement with its guard."""

    inside = True
    """More lines of the guard follow."""

    @property
    def _name(self) -> bytes:
        return b"o<gcodejerk-%d>" % self.original_line

    def last(self, more: bool) -> None:
        """Pass the end of a line; within the guard none is the last."""
        super().last(more or self.inside)

    def _setup(self) -> bool:
        """Pass the lines that open the guard, then those in front of the points."""
        opened = self.exactly(INPUT) and self.exactly(self._name + b" if [#5399 GT 0.5]")
        return opened and super()._setup()

    def _lead(self) -> tuple[int, ...]:
        """Motion codes of what leads into the points: nothing is in the queue behind M66."""
        return 0, 1, 0

    def _stops(self) -> bool:
        """Pass the other branch, the end of the guard, and what runs behind the motion."""
        if not self.exactly(self._name + b" else"):
            return False
        words = [w for w in self.block.words if w.letter in AXES]
        own = b" ".join([b"G0", *(w.letter.encode() + b"".join(w.text[1:].split()) for w in words)])
        if self.peek() != own:
            shown = self.peek()[:60].decode("latin-1")
            self.complain(
                Kind.END, f"the other branch has '{shown}', the rapid is '{own.decode()}'"
            )
            return False
        self.next()
        self.inside = False
        closed = self.exactly(self._name + b" endif", more=bool(self.allowed.behind))
        return closed and super()._stops()


def check_guarded(
    original: BinaryIO, dialect: str, replaced: Sequence[int], found: Findings
) -> None:
    """See that guards may stand where they stand.

    Parameters
    ----------
    original : BinaryIO
        The whole program; seekable.
    dialect : str
        Its dialect.
    replaced : sequence of int
        Lines of the rapids that were replaced, ascending.
    found : Findings
        Where what is wrong goes.
    """
    if not replaced:
        return
    if dialect != "linuxcnc":
        found.add(Kind.NOT_CERTAIN, None, None, f"no guard can stand in a program for {dialect}")
    first: dict[bytes, int] = {}
    last: dict[bytes, int] = {}
    original.seek(0)
    for number, text in enumerate(original, 1):
        line = _READ_BY_PEOPLE.sub(b" ", text.upper().rstrip())
        for pattern, problem in _TAKEN:
            if pattern.search(line):
                found.add(Kind.NOT_CERTAIN, None, number, problem)
        if match := _LABEL.match(b"".join(line.split())):
            first.setdefault(match[1], number)
            last[match[1]] = number
    for line_of_rapid in replaced:
        if any(begun < line_of_rapid < last[label] for label, begun in first.items()):
            problem = "a guard stands within an O-word structure of the program"
            found.add(Kind.NOT_CERTAIN, None, line_of_rapid, problem)
