"""Both files in step: what was kept, what was replaced, and nothing else.

Rule: the original leads. Up to each rapid that may be replaced the processed file must go on with
the very bytes of the original; there it either keeps the block or holds a stream. Where neither is
the case, that is a violation, and the walk goes on where both files agree again, so that every
violation is listed; where they do not within reach, it ends.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterator
from itertools import takewhile

import numpy as np

from gcodejerk.advice import STAMP_NOTES
from gcodejerk.machine import Machine
from gcodejerk.nc import CERTAIN, REASONS, Dialect, Program, Rapids
from gcodejerk.storage import kept, release
from gcodejerk.verification.bytes.aligned_form import AlignedReader
from gcodejerk.verification.bytes.allowed import decimals_of, line_limit
from gcodejerk.verification.bytes.form import LINE_ENDS, Stream, StreamReader
from gcodejerk.verification.bytes.guarded_form import GuardedReader
from gcodejerk.verification.bytes.proven import Key, Proven, Reported
from gcodejerk.verification.bytes.recognised import Recognised
from gcodejerk.verification.bytes.resumption import TRACES, pass_changed, pass_stream
from gcodejerk.verification.bytes.source import Window, skip_common
from gcodejerk.verification.bytes.states import States
from gcodejerk.verification.findings import Findings, Kind

_STAMPS = (b"(gcodejerk stamp", b"; gcodejerk stamp")
_TRACES = (*TRACES, b"G1 ", b"G4 P", b"M400", b"M6")
"""How a stream may begin."""
_LONGEST_TRACE = max(map(len, _TRACES))
AT_ONCE = 4096
"""Rapids of which plain lists are made."""
Progress = Callable[[int, int], None]
"""Called with the number of rapids that were passed, and of all that may be replaced."""
ALIGNED = ("linuxcnc",)
"""Controllers whose streams have blocks that end on servo periods."""


class Alignment:
    """One walk through an original and what was made of it."""

    remembers = True
    """Forms of replacements are read once, and replacements that are the same to the byte."""

    def __init__(
        self,
        original: Window,
        processed: Window,
        program: Program,
        machine: Machine,
        found: Findings,
        reported: Reported | None = None,
    ) -> None:
        self.original, self.processed = original, processed
        self.program, self.found = program, found
        self.at = 0
        """Place in the original, in bytes."""
        self.kept = 0
        self.replaced = array("q")
        """Indices of the rapids that have a stream."""
        self.block = b""
        """Text of the block whose stream was found last."""
        self._follows = False
        """The line in front of the rapid is one that has a stream: the machine then rests."""
        self.dialect = program.language
        self.decimals = decimals_of(machine)
        self.aligned = machine.controller in ALIGNED
        self.guarded = machine.controller_options.override_guard
        self.recognised: Recognised | None = None
        self.proven: Proven | None = None
        if self.remembers and not (self.aligned and self.guarded):
            states = States(program.rapids)
            self.recognised = Recognised(processed, program.rapids, self.dialect, states)
            held_to = (reported or {}) if self.aligned else {}
            self.proven = Proven(processed, program.rapids, states, held_to)
        self.progress: Progress | None = None
        self._key: Key = b"", b"", False, None, b""
        self._stamp_at: int | None = program.insert_at
        self._stamp_line: int | None = None

    def begin_at(self, at: int, line: int, *, follows: bool) -> None:
        """Begin within the files, behind the stamp, in front of the second of the rapids.

        Parameters
        ----------
        at, line : int
            Where the window of the original begins in the file.
        follows : bool
            The first rapid has a stream.
        """
        self.at = at
        self.original.begin_line(line)
        self._stamp_at = None
        if follows:
            self.replaced.append(0)

    @property
    def stamped(self) -> bool:
        """Whether a stamp was passed."""
        return self._stamp_line is not None

    @property
    def rewritten(self) -> int:
        """How many rapids have a stream."""
        return len(self.replaced)

    def streams(self) -> Iterator[Stream]:
        """Find the streams, in the order of the file."""
        replaced = self.replaced
        for i, begin, end, terminator, behind in self._certain():
            if self.found.full or not self._same(begin - self.at):
                return
            self._follows = behind and bool(replaced) and replaced[-1] == i - 1
            block = self.original.peek(end - begin + len(LINE_ENDS[terminator]))
            if self.processed.follows(block) and not self._goes_on(block):
                self.processed.skip(len(block))
                self.kept += 1
            elif not self._proven(i, block):
                text = block[: end - begin]
                tried = self.processed.peek(_LONGEST_TRACE).startswith(_TRACES)
                stream = self._read(i, block, text)
                if stream is not None or tried:
                    self.replaced.append(i)
                if stream is not None:
                    self.block = text
                    yield stream
                elif self.found.full or not pass_stream(self.original, self.processed, len(block)):
                    return
            self.original.skip(len(block))
            self.at += len(block)
        if self._same(None):
            self._end()

    def _certain(self) -> Iterator[tuple[int, int, int, int, bool]]:
        """Index, begin, end and terminator of each rapid that may be replaced.

        And whether it stands right behind the rapid in front of it.
        """
        rapids = self.program.rapids
        certain = kept(np.flatnonzero(rapids.reason == CERTAIN))
        for k in range(0, len(certain), AT_ONCE):
            if self.progress is not None:
                self.progress(k, len(certain))
            rows = certain[k : k + AT_ONCE]
            behind = (rapids.line[rows - 1] + 1 == rapids.line[rows]) & ~rapids.entered[rows]
            columns = (rows, rapids.begin[rows], rapids.end[rows], rapids.terminator[rows], behind)
            yield from zip(*(column.tolist() for column in columns), strict=True)
            release()

    def _proven(self, i: int, block: bytes) -> bool:
        """Pass a replacement that was proven before; whether one stands here."""
        if self.proven is None or not block.endswith(b"\n"):
            return False
        self._key = self.proven.key(i, block, self._follows)
        if not self.proven.passes(self._key):
            return False
        self.replaced.append(i)
        return True

    def judged(self, without_fault: bool) -> None:
        """All streams so far have been judged."""
        if self.proven is not None:
            self.proven.judged(without_fault and not self.found.violations)

    def _read(self, i: int, block: bytes, text: bytes) -> Stream | None:
        """Read what stands in the place of a rapid; None where the walk ends."""
        plain = self.recognised.plain(i, text) if self.recognised is not None else None
        before = len(self.found.violations)
        passed: list[bytes] | None = [] if self.proven is not None else None
        self.processed.passed = passed
        stream = None
        if plain is not None and self.recognised is not None:
            stream = self.recognised.read(i, plain, self._follows)
        known = stream is not None
        if stream is None:
            reader = self._reader(i, text)
            if self._is_stream(reader, block, i):
                stream = reader.read()
        self.processed.passed = None
        if stream is None or not passed or len(self.found.violations) > before:
            return stream
        new = b"".join(passed)
        if self.recognised is not None and plain and not known:
            self.recognised.learn(reader, stream, plain, self._follows, new)
        if self.proven is not None and block.endswith(b"\n"):
            self.proven.read(self._key, new)
        return stream

    def _reader(self, i: int, text: bytes) -> StreamReader:
        """What reads the stream of a rapid."""
        aligned = GuardedReader if self.guarded else AlignedReader
        form = aligned if self.aligned else StreamReader
        return form(*self._of_reader(i, text))

    def _of_reader(
        self, i: int, text: bytes
    ) -> tuple[Window, Rapids, int, bytes, bytes, Findings, Dialect, dict[str, int], bool]:
        """What it needs to know."""
        return (
            self.processed,
            self.program.rapids,
            i,
            text,
            self.program.newline,
            self.found,
            self.dialect,
            self.decimals,
            self._follows,
        )

    def _goes_on(self, block: bytes) -> bool:
        """Whether a last line without end is followed by more."""
        return not block.endswith(b"\n") and len(self.processed.peek(len(block) + 1)) > len(block)

    def _is_stream(self, reader: StreamReader, block: bytes, i: int) -> bool:
        """Whether what stands here can be meant as the stream of this rapid."""
        line = self.processed.peek_line()
        head = reader.peek()
        if line and block.rstrip(b"\r\n") == line.rstrip(b"\r\n"):
            self._different()
            return False
        ended = self.processed.ended
        if ended:
            self._different()
            return False
        return head is not None

    def _same(self, size: int | None) -> bool:
        """Pass this many bytes of the original, all the rest for None.

        Whether they were passed: what is not kept there is complained of.
        """
        if self._stamp_at is not None and (size is None or self._stamp_at <= self.at + size):
            first = self._stamp_at - self.at
            self._stamp_at = None
            if not self._same(first):
                return False
            self._stamp()
            size = None if size is None else size - first
        begin, left = self.original.passes, size
        while (lines := skip_common(self.original, self.processed, left)) is None:
            self._different()
            left = None if size is None else size - (self.original.passes - begin)
            if self.found.full or not pass_changed(self.original, self.processed, left):
                return False
            left = None if size is None else size - (self.original.passes - begin)
        self.kept += lines
        if size is None:
            self.kept += bool(self.program.lines > self.original.line - 1)
        else:
            self.at += size
        return True

    def _stamp(self) -> None:
        """Pass a stamp, which the original does not have here."""
        line = self.processed.peek_line()
        if not line.startswith(_STAMPS) or line == self.original.peek(len(line)):
            return
        body = line.rstrip(b"\r\n")
        self._stamp_line = self.processed.line
        writing = self.dialect.writing
        opens, closes = (b"", b"") if writing is None else writing.comment
        proper = body.startswith(opens + b"gcodejerk") and body.endswith(closes)
        proper = proper and not set(b"()") & set(body[len(opens) : len(body) - len(closes)])
        if not proper or not all(32 <= byte < 127 for byte in body):
            self._complain(Kind.STAMP, "stamp is not one comment of plain characters")
        if len(body) > line_limit(self.dialect):
            self._complain(Kind.STAMP, "stamp is longer than the lines that the control reads")
        if line[len(body) :] != self.program.newline:
            self._complain(Kind.STAMP, "stamp does not end as the lines of the original do")
        self.processed.skip(len(line))
        below = self.processed.peek_line()
        notes = [opens + note.encode() + closes + self.program.newline for note in STAMP_NOTES]
        if below in notes and below != self.original.peek(len(below)):
            self.processed.skip(len(below))

    def _different(self) -> None:
        """Say how the files differ where they stand."""
        mine, theirs = self.original.peek_line(), self.processed.peek_line()
        shown = _shown(mine, theirs)
        rapids = self.program.rapids
        at = int(np.searchsorted(rapids.line, self.original.line))
        left = at < len(rapids) and rapids.line[at] == self.original.line
        left = left and rapids.reason[at] != CERTAIN
        if not theirs:
            self._complain(Kind.MISSING, f"file ends where the original has '{shown[0]}'")
        elif not mine:
            self._complain(Kind.ADDED, f"the original ends, here follows '{shown[1]}'")
        elif mine.rstrip(b"\r\n") == theirs.rstrip(b"\r\n"):
            self._complain(Kind.LINE_END, "line does not end as in the original")
        elif left and theirs.startswith(_TRACES):
            why = REASONS[int(rapids.reason[at])]
            self._complain(Kind.NOT_CERTAIN, f"'{shown[0]}' had to be left alone: {why}")
        else:
            self._complain(
                Kind.CHANGED, f"expected '{shown[0]}' as in the original, found '{shown[1]}'"
            )

    def _end(self) -> None:
        if not self.processed.ended:
            self._different()
        elif self._stamp_line is not None and not self.rewritten:
            self.found.add(
                Kind.STAMP, self._stamp_line, None, "stamp, though nothing was rewritten"
            )

    def check_sum(self) -> None:
        """Compare the sum in the stamp with that of the file, once nothing else was found."""
        claimed, found = self.processed.claimed, self.processed.sum
        if (
            self._stamp_line is not None
            and claimed not in (None, found)
            and not self.found.violations
        ):
            problem = f"the file was changed after it was written: its sum is {found}"
            self.found.add(
                Kind.STAMP, self._stamp_line, None, f"{problem}, the stamp says {claimed}"
            )

    def _complain(self, kind: Kind, problem: str) -> None:
        line = None if self.original.ended else self.original.line
        self.found.add(kind, self.processed.line, line, problem)


def _shown(one: bytes, other: bytes) -> list[str]:
    """Lines as messages quote them: from somewhat in front of where they begin to differ."""
    alike = takewhile(lambda pair: pair[0] == pair[1], zip(one, other, strict=False))
    same = sum(1 for _ in alike)
    begin = same - 20 if same > 40 else 0
    cut = [line[begin : begin + 60].rstrip(b"\r\n").decode("latin-1") for line in (one, other)]
    return [f"...{part}" if begin else part for part in cut]
