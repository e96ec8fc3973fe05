"""Proof that a program of LinuxCNC with its flow written out runs the blocks that it would run.

A counter goes over the lines of the original as the interpreter would, jumping where its O-words
say so; `blocks` holds every block that it comes to against the other file.

Rule 1: a structure of the main program is written out whole, or stands there as it did.
Rule 2: what is not known decides nothing: a way that hangs on it was not to be written out.
"""

from __future__ import annotations

from gcodejerk.nc import Dialect, Start
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.unrolling.blocks import Call, Sides, StopError
from gcodejerk.verification.unrolling.structures import OWord

_PARAMETERS = 30
_DEEPEST = 9
_LEAVES = frozenset((b"CALL", b"RETURN", b"BREAK", b"CONTINUE"))
"""What may leave jumps behind that LinuxCNC keeps in mind."""


class FlowProof(Sides):
    """Side by side through both files."""

    def __init__(
        self, original: bytes, other: bytes, dialect: Dialect, start: Start, found: Findings
    ) -> None:
        super().__init__(original, other, dialect, start)
        self.files, self.found = start.subprograms, found
        self.subs: dict[bytes, int | None] = {}
        self.written = 0
        self.dropped: int | None = None
        """A line of a subprogram that is left out."""
        self.stays: int | None = None
        """A line of flow that stays."""
        self.jumped: int | None = None
        """A jump that was written out."""
        self._broken = self._continued = False
        self._stale: set[int] = set()
        self._dos: set[bytes] = set()
        self._steps = 0

    def run(self) -> None:
        """Walk through both files; whatever is wrong is among the findings."""
        at = 0
        try:
            while at < self.size:
                at = self._top(at)
            self._end()
        except StopError as stop:
            line = min(self.k, len(self.theirs)) + 1
            self.found.add(stop.kind, line, min(stop.at, self.size - 1) + 1, stop.problem)

    def _end(self) -> None:
        rest = self.theirs[self.k :]
        if rest not in ([], [b""]):
            told = rest[0][:60].decode("latin-1")
            raise StopError(Kind.ADDED, f"the original ends, here follows '{told}'", self.size - 1)
        stays = self.stays if self.stays is not None else self.lost
        if self.dropped is not None and stays is not None:
            raise StopError(Kind.FLOW, "a subprogram is left out that may still be called", stays)
        if self.written and (place := self._reads_place()) is not None:
            raise self._doubt(place, "a line reads where in the flow it is")
        if self.jumped is not None and stays is not None:
            told = "a jump was written out, and LinuxCNC keeps it for what stays"
            raise StopError(Kind.FLOW, told, self.jumped)

    # --- the main program ---

    def _top(self, at: int) -> int:
        """Take a line of the main program, or the structure that begins there; the next line."""
        line = None if self.ended else self.table.o_word(at)
        if line is None:
            self._same(at)
            self._block(at, at_top=True)
            return at + 1
        if line.word == b"SUB" and (last := self.table.find(at)) is not None:
            self.subs[line.label] = None if line.label in self.subs else at
            self._sub(at, last)
            return last + 1
        alone = line.word == b"CALL"
        last = at if alone else self.table.find(at) if line.word else None
        if last is None:
            first = at == 0 or not any(self.table.code[:at])
            if not (line.word == b"" and first):
                self.stays = at
            self._same(at)
            self._forget()
            return at + 1
        if self._is_next(at):
            for each in range(at, last + 1):
                self._same(each)
            self._stay(at, last)
            return last + 1
        self.written += 1
        self._comment()
        self._execute(at, last)
        return last + 1

    def _sub(self, at: int, last: int) -> None:
        """A subprogram: it stays where it is, or is left out."""
        if self._is_next(at):
            for each in range(at, last + 1):
                self._same(each)
        else:
            self.dropped = at
            self._comment()

    def _stay(self, first: int, last: int) -> None:
        """A structure that stays: it may do anything that its lines say, and call others."""
        self.stays = first
        words = [self.table.o_word(at) for at in range(first, last + 1)]
        if any(line is not None and line.word in _LEAVES for line in words):
            self._broken = self._continued = True
        calls = any(line is not None and line.word == b"CALL" for line in words)
        for at in range(first, last + 1):
            if calls or (words[at - first] is None and not self._lose(at)):
                self._forget()
                break

    # --- what is written out ---

    def _execute(self, first: int, last: int) -> None:
        """Run a structure or a call, block by block."""
        at: int | None = first
        self._frames = [Call(first, last, {})]
        while at is not None and not (len(self._frames) == 1 and at > last):
            self._steps += 1
            if self._steps > 20 * len(self.theirs) + 2_000_000:
                raise StopError(Kind.FLOW, "it runs without an end", first)
            at = self._step(at)

    def _step(self, at: int) -> int | None:
        """Run a line; the one that follows."""
        line = self.table.o_word(at)
        if line is None:
            self._block(at, at_top=False)
            return None if self.ended else at + 1
        frame, table = self._frames[-1], self.table
        if line.word == b"IF":
            return self._branch(at, line)
        if line.word in (b"ELSE", b"ELSEIF"):
            while at in table.next:
                at = table.next[at]
            return at + 1
        if line.word in (b"WHILE", b"DO", b"ENDWHILE"):
            return self._loop(at, line)
        if line.word == b"REPEAT":
            return self._repeat(at, line)
        if line.word == b"ENDREPEAT":
            begin = table.begin[at]
            if self._continued:
                raise self._doubt(at, "behind a continue LinuxCNC counts a repeat again")
            frame.repeats[begin] -= 1.0
            if frame.repeats[begin] > 0.0:
                return begin + 1
            frame.loops.remove(begin)
            return at + 1
        if line.word in (b"BREAK", b"CONTINUE"):
            return self._jump(at, line)
        if line.word == b"CALL":
            return self._call(at, line)
        if line.word in (b"RETURN", b"ENDSUB"):
            return self._return(at, line)
        return at + 1  # endif

    def _number(self, at: int, line: OWord, which: int = 0) -> float:
        """The value of a condition or a count."""
        if len(line.arguments) <= which:
            raise self._doubt(at, "a condition is missing")
        number = self.values.value(line.arguments[which], self.variables)
        if number != number:
            raise self._doubt(at, "a condition or a count is not known")
        return number

    def _branch(self, at: int, line: OWord) -> int:
        """Go to the branch that is taken."""
        while True:
            if self._number(at, line) != 0.0:
                return at + 1
            at = self.table.next[at]
            following = self.table.o_word(at)
            assert following is not None
            line = following
            if line.word != b"ELSEIF":
                return at + 1

    def _loop(self, at: int, line: OWord) -> int:
        """Pass the head or the end of a ``while`` or ``do``."""
        frame, table = self._frames[-1], self.table
        if line.word == b"DO":
            self._dos.add(line.label)
            frame.loops.append(at)
            return at + 1
        if line.word == b"ENDWHILE":
            return table.begin[at]
        goes_on = self._number(at, line) != 0.0
        if at in table.begin:  # the end of a do
            begin = table.begin[at]
            if goes_on and self._broken:
                raise self._doubt(at, "behind a break LinuxCNC ends a do after its first pass")
            if not goes_on:
                frame.loops.remove(begin)
            return begin + 1 if goes_on else at + 1
        if at not in frame.loops:
            frame.loops.append(at)
        if goes_on:
            return at + 1
        frame.loops.remove(at)
        # On its way to the end, LinuxCNC takes a break that it passes over for one that it runs.
        passed = (
            inner
            for inner, begins in table.around.items()
            if at in begins and self._is_break(inner, line.label)
        )
        if (inner := next(passed, None)) is not None and not self._broken:
            self._broken = True
            self.jumped = inner if self.jumped is None else self.jumped
        return table.end[at] + 1

    def _is_break(self, at: int, label: bytes) -> bool:
        line = self.table.o_word(at)
        return line is not None and line.word == b"BREAK" and line.label == label

    def _repeat(self, at: int, line: OWord) -> int:
        """Begin to count."""
        count, frame = self._number(at, line), self._frames[-1]
        if not count.is_integer() or self._continued or at in self._stale:
            raise self._doubt(at, "how often it runs is not certain")
        if count <= 0.0:
            return self.table.end[at] + 1
        frame.repeats[at] = count
        frame.loops.append(at)
        return at + 1

    def _jump(self, at: int, line: OWord) -> int:
        """``break`` and ``continue``."""
        self._note_jump(at)
        frame, table = self._frames[-1], self.table
        for begin in table.around[at]:
            head = table.o_word(begin)
            assert head is not None
            if head.word in (b"WHILE", b"DO") and head.label == line.label:
                break
        else:
            raise self._doubt(at, "it leads out of no while or do")
        for inner in [each for each in frame.loops if begin < each <= table.end[begin]]:
            frame.loops.remove(inner)
        if line.word == b"CONTINUE":
            self._continued |= line.label in self._dos
            return table.end[begin]
        self._broken = True
        if self._continued and head.word == b"WHILE":
            raise self._doubt(at, "behind a continue LinuxCNC begins the loop again")
        frame.loops.remove(begin)
        return table.end[begin] + 1

    def _note_jump(self, at: int) -> None:
        """LinuxCNC keeps a jump in mind for the counts that it leaves."""
        self.jumped = at if self.jumped is None else self.jumped
        for frame in self._frames:
            self._stale.update(begin for begin in frame.loops if begin in frame.repeats)

    def _call(self, at: int, line: OWord) -> int:
        """Begin a subprogram."""
        first = self._called(line.label)
        if first is None:
            raise self._doubt(at, "what it calls is not known")
        if len(self._frames) > _DEEPEST:
            raise self._doubt(at, "calls within calls")
        given = [self.values.value(text, self.variables) for text in line.arguments]
        given += [0.0] * (_PARAMETERS - len(given))
        own = {n: v for n, v in self.variables.items() if self.values.is_local(n)}
        self._set_own({str(k): v for k, v in enumerate(given[:_PARAMETERS], 1) if v == v})
        self._frames.append(Call(at, self.table.end[first], own))
        return first + 1

    def _called(self, label: bytes) -> int | None:
        """First line of a subprogram: of this file, or of the one of its name."""
        if label not in self.subs:
            name = label.decode("latin-1").strip("<>").lower() + ".ngc"
            texts = {t for path, t in self.files.items() if path.split("/")[-1] == name}
            self.subs[label] = self._found(label, texts.pop()) if len(texts) == 1 else None
        return self.subs[label]

    def _found(self, label: bytes, text: bytes) -> int | None:
        """First line of a subprogram in another file, whose lines are put behind all others."""
        table = self.table
        first = table.add(text.removeprefix(b"\xef\xbb\xbf").split(b"\n"))
        for at in range(first, len(table.code)):
            line = table.o_word(at)
            if line is not None and line.word == b"SUB" and line.label == label:
                return at if table.find(at) is not None else None
        return None

    def _set_own(self, own: dict[str, float]) -> None:
        """Other variables of the subprogram's own."""
        shared = {n: v for n, v in self.variables.items() if not self.values.is_local(n)}
        self.variables = {**shared, **own}

    def _return(self, at: int, line: OWord) -> int:
        """End a subprogram."""
        if len(self._frames) == 1:
            raise self._doubt(at, "it returns from the main program")
        if line.word == b"RETURN":
            self._note_jump(at)
        frame = self._frames.pop()
        self._set_own(frame.variables)
        return frame.back + 1
