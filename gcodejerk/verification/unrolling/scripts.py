"""Proof that a program of macro B or Siemens written out runs the blocks that it would run.

The second reading goes the ways of the original (`second_reading.walking`); here it may go only one
way at a time, and every block that it comes to has to be the next one of the other file: as it is
written, without an N or a label that nothing leads to any more, or word by word with the numbers of
a subprogram's own variables.

Rule: what is not known decides nothing, and what the second reading does not follow is not proven.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from gcodejerk.nc import Dialect, Start
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.second_reading.elsewhere import lines_elsewhere
from gcodejerk.verification.second_reading.reading import Text
from gcodejerk.verification.second_reading.routes import LostError, Part, Way
from gcodejerk.verification.second_reading.stepping import Stepper
from gcodejerk.verification.second_reading.tracking import Tracker
from gcodejerk.verification.second_reading.walking import Walker
from gcodejerk.verification.unrolling.blocks import StopError

_MARK = b"\xef\xbb\xbf"
_NUMBER = re.compile(rb"([ \t]*/?[0-9]?[ \t]*)N[ \t]*[0-9]+[ \t]*", re.IGNORECASE)
_LABEL = re.compile(rb"[A-Za-z_][A-Za-z_][A-Za-z0-9_]*[ \t]*:(?!=)[ \t]*")
_RETURN = re.compile(rb"(?:N[0-9]+)?M0*(?:99|17)|(?:N[0-9]+)?RET")
_LEADS = re.compile(rb"G0*66(?:\.1)?(?![0-9])|M0*(?:96|198|47)(?![0-9])")
_RETURNS = re.compile(rb"(?<![A-Z])M0*(?:99|17)(?![0-9])")
_ENDS = re.compile(rb"(?<![A-Z])M0*(?:2|30)(?![0-9])")
_DEF = re.compile(rb"(?:N[0-9]+)?DEF(?:REAL|INT|BOOL)")
_G = re.compile(rb"(?<![A-Z])G[ \t]*([0-9]+(?:\.[0-9]*)?)")
_HASH = re.compile(rb"#[ \t]*(?:([0-9]+)|[#\[])")
_NAME = re.compile(rb"(?<![A-Z0-9_$])[A-Z_][A-Z_][A-Z0-9_]*")
_WORD = re.compile(rb"([A-Z])([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))")
_SETS = re.compile(rb"#[ \t]*[0-9]+[ \t]*=.*")


class NotFollowedError(Exception):
    """The second reading does not follow the program."""


class FlowWalker(Walker):
    """Goes the one way of a program, and holds its blocks against another file."""

    def __init__(
        self,
        stepper: Stepper,
        begin: Callable[[], Tracker],
        lines: list[bytes],
        theirs: list[bytes],
    ) -> None:
        super().__init__(stepper, begin, lines)
        self.theirs = theirs
        self.most += 20 * len(theirs)
        self.k = 0
        """Line of the other file that comes next."""
        self.here = 0
        self._scopes: list[bool] = []
        """Calls that run, and whether each has variables of its own."""
        self.called: set[int] = set()
        """First lines of what was called."""
        self.ended = False
        """The main program has come to its end."""
        self.remarks = {line.strip(b" \t") for at, line in enumerate(lines) if not self._code(at)}
        """Lines of the original that say nothing to the control."""

    @property
    def closing(self) -> int:
        """Line of the original that closes the program."""
        named, lines = self.routes.named, self.routes.lines
        first = next((part.begin for part in self.routes.parts if part.main), 0) + 1
        marks = (at for at in range(first, len(lines)) if self._code(at) == b"%")
        return len(lines) if named else next(marks, len(lines))

    def _code(self, at: int) -> bytes:
        """A line without comments and blanks, in upper case."""
        return self.routes.lines[at].translate(None, b" \t\0;")

    def _upper(self, line: bytes) -> bytes:
        return self.stepper.upper(line).translate(None, b" \t\0;")

    def _line(
        self, part: Part, at: int, state: Tracker, back: list[Tracker], unsure: set[int]
    ) -> list[tuple[int, Tracker]]:
        self.here = at
        way = self.routes.ways.get(at)
        if way is not None and b"/" in self.routes.lines[at].lstrip(b" \t")[:1]:
            raise LostError
        if way is not None and way.what == "back" and not self._calls:
            self._expect(self.lines[at], self._code(at), state)
            self.ended = True
        return super()._line(part, at, state, back, unsure)

    def _blur(self, first: int, at: int, state: Tracker) -> list[tuple[int, Tracker]]:
        raise self._doubt("how it goes on is not known")

    def _go(self, at: int, way: Way, state: Tracker, unsure: set[int]) -> list[tuple[int, Tracker]]:
        found = super()._go(at, way, state, unsure)
        if len(found) != 1:
            raise self._doubt("how it goes on is not known")
        return found

    def _doubt(self, why: str) -> StopError:
        return StopError(Kind.FLOW, f"it was to stay as it is: {why}", self.here)

    def _then(self, way: Way, state: Tracker) -> Tracker:
        number = self._value(way.test, state)
        if number != number:
            raise self._doubt("a condition is not known")
        if number != 0.0:
            text = b" ".join([way.texts[0], *self._remarks(self.lines[self.here])])
            self._expect(text, way.texts[0].translate(None, b" \t"), state)
        return super()._then(way, state)

    def _count(
        self, at: int, way: Way, state: Tracker, unsure: set[int]
    ) -> list[tuple[int, Tracker]]:
        found = super()._count(at, way, state, unsure)
        name = f"R{int(way.name[1:])}" if way.name[1:].isdigit() else way.name
        value = state.variables.get(name)
        if value is None or len(found) != 1:
            raise self._doubt("a count is not known")
        if not (any(self._scopes) and self.stepper.computer.is_local(name)):
            theirs = self._upper(self._next()).partition(b"=")
            known = theirs[0].decode("latin-1") == name and _same_number(theirs[2], value)
            if not known:
                raise self._differs(f"{name}={value:g}".encode())
            self.k += 1
        return found

    def _call(self, at: int, way: Way, state: Tracker) -> list[tuple[int, Tracker]]:
        called = self.routes.called(way.name)
        computer = self.stepper.computer
        many = computer.named and called is not None and len(way.texts) > len(called.given)
        if called is None or not called.callable or called.data or many:
            if any(self._scopes):
                raise self._doubt("a macro calls a program that is not here")
            self._expect(self.lines[at], self._code(at), state)
            return super()._call(at, way, state)
        if called.saves:
            raise self._doubt("a subprogram gives modes back")
        self._scopes.append(way.own)
        self.called.add(called.begin)
        found = super()._call(at, way, state)
        self._scopes.pop()
        self.here = at
        return found

    # Complex: one case for each line that both files need not have alike.
    def _block(
        self, part: Part, at: int, state: Tracker, back: list[Tracker]
    ) -> list[tuple[int, Tracker]]:
        code = self._code(at)
        head = at == part.begin and code[:1] in (b"%", b"O", b":")
        main = not self._calls
        if head and main:
            self._keep(at)
        elif code == b"%" and main:
            if not state.begun:
                self._keep(at)
        elif not head and code not in (b"", b"%") and not (b"PROC" in code and self._calls):
            if not self.routes.named and _LEADS.search(code):
                raise self._doubt("it leads to a program at every move, or elsewhere")
            if main and self.routes.named:
                self._expect(self.lines[at], code, state)
            elif not _RETURN.fullmatch(code):
                if _RETURNS.search(code) is not None:
                    raise self._doubt("words stand beside a return")
                self._expect(self.lines[at], code, state)
            elif main and not self.routes.named:
                raise self._doubt("the program begins again")
        if _ENDS.search(code) and code.startswith(b"/"):
            raise self._doubt("the operator decides whether the program ends")
        found = super()._block(part, at, state, back)
        self.ended = self.ended or (not found and (state.ended or main))
        return found

    def _next(self) -> bytes:
        """The next line of the other file that says something."""
        while self.k < len(self.theirs):
            line = self.theirs[self.k]
            if self._upper(line) or line.strip(b" \t") not in self._spoken:
                return line
            self.k += 1
        raise StopError(Kind.MISSING, "the file ends where the original goes on", self.here)

    @property
    def _spoken(self) -> set[bytes]:
        """Remarks that may stand in the other file: those of the original, and one of ours."""
        line = self.theirs[self.k].strip(b" \t")
        ours = line.startswith((b"(gcodejerk: ", b"; gcodejerk: "))
        return self.remarks | ({line} if ours else set())

    def _keep(self, at: int) -> None:
        """A line that both files have."""
        if self._next() != self.lines[at]:
            raise self._differs(self.lines[at])
        self.k += 1

    def _differs(self, expected: bytes) -> StopError:
        mine = expected[:60].decode("latin-1")
        theirs = self.theirs[self.k][:60].decode("latin-1") if self.k < len(self.theirs) else ""
        problem = f"expected '{mine}' as the original runs, found '{theirs}'"
        return StopError(Kind.FLOW, problem, self.here)

    def _expect(self, line: bytes, code: bytes, state: Tracker) -> None:
        """A block has to be the next line of the other file."""
        if any(self._scopes) and _DEF.match(code):
            return
        if any(self._scopes) and self._names_own(self.stepper.upper(line)):
            self._expect_numbers(line, state)
            return
        bare, labelless = _bare(line, named=self.routes.named)
        wanted = {line.strip(b" \t"), bare.strip(b" \t"), labelless.strip(b" \t")}
        if b"" in wanted and (
            self.k >= len(self.theirs) or self._next().strip(b" \t") not in wanted
        ):
            return
        if self._next().strip(b" \t") not in wanted:
            raise self._differs(line)
        self.k += 1

    def _names_own(self, upper: bytes) -> bool:
        """Whether a block names variables of the subprogram's own."""
        computer = self.stepper.computer
        if computer.named:
            return any(name.decode() in computer.kinds for name in _NAME.findall(upper))
        return any(not n or computer.is_local(str(int(n))) for n in _HASH.findall(upper))

    def _remarks(self, line: bytes) -> list[bytes]:
        """The comments of a line: some are shown to the operator."""
        comments = self.stepper.text.comments
        return [] if comments is None else [match[0] for match in comments.finditer(line)]

    def _expect_numbers(self, line: bytes, state: Tracker) -> None:
        """The same for a block with variables of a subprogram's own: word by word."""
        if b"/" in line[:4]:
            raise self._doubt("the operator may skip a block that is written otherwise")
        upper = self.stepper.upper(line).replace(b"\0", b" ")
        upper = _NUMBER.sub(rb"\1", upper, count=1) if _NUMBER.match(upper) else upper
        inch = state.unit is not None and state.unit != 1.0
        mine = self._said(upper, state, inch)
        if letter := self._uncertain(upper, state):
            raise self._doubt(f"what a computed {letter} means is not certain")
        if mine is None:
            raise self._doubt("a number is not known")
        if not (mine[0] or mine[1]):
            return
        got = _NUMBER.sub(rb"\1", self.stepper.upper(self._next()).replace(b"\0", b" "), count=1)
        alike = self._said(got, state, inch) == mine
        if self._names_own(got) or not alike or self._remarks(line) != self._remarks(self._next()):
            raise self._differs(line)
        self.k += 1

    def _uncertain(self, upper: bytes, state: Tracker) -> str:
        """A computed count or dwell, which the control reads by how it is written."""
        dialect = self.stepper.dialect
        codes = {round(float(number) * 10.0) for number in _G.findall(upper)}
        cycles = bool(codes & dialect.cycles) or (state.cycle is not None and 800 not in codes)
        letters = dialect.drilling.repeats + "P" if cycles else "P" if 40 in codes else ""
        found = (
            letter for letter in letters if re.search(rb"%s[ \t]*-?[#\[]" % letter.encode(), upper)
        )
        return next(found, "")

    def _said(
        self, upper: bytes, state: Tracker, inch: bool
    ) -> tuple[list[tuple[bytes, float]], dict[str, float], dict[str, str]] | None:
        """Words, shared variables that are set, and how addresses count; None: not all is known."""
        computer = self.stepper.computer
        settings = computer.settings(upper, state.variables)
        if settings is None:
            return None
        shared = {n: round(v, 9) for n, v in settings.items() if not computer.is_local(n)}
        text, relative = computer.spelled(upper, state.variables, inch)
        if not computer.named:
            text = _SETS.sub(b"", text)
        words = _words(text)
        if words is None or any(value != value for value in shared.values()):
            return None
        return words, shared, relative


def _bare(line: bytes, *, named: bool) -> tuple[bytes, bytes]:
    """A line without its N and its label, and one without its label alone."""
    match = _NUMBER.match(line)
    lead, rest = (line[: match.end()], line[match.end() :]) if match else (b"", line)
    blanks = rest[: len(rest) - len(rest.lstrip(b" \t"))]
    if named and (label := _LABEL.match(rest, len(blanks))):
        rest = blanks + rest[label.end() :]
    return (match[1] if match else b"") + rest, lead + rest


def _same_number(text: bytes, value: float) -> bool:
    try:
        return float(text) == value
    except ValueError:
        return False


def _words(text: bytes) -> list[tuple[bytes, float]] | None:
    """Letters and numbers of a line; None where it says something else."""
    flat = text.translate(None, b" \t\0;")
    found = _WORD.findall(flat)
    whole = b"".join(letter + number for letter, number in found) == flat
    return [(letter, round(float(number), 9)) for letter, number in found] if whole else None


# Complex: one thing that can be wrong behind the walk after another.
def check_script(
    original: bytes,
    other: bytes,
    dialect: Dialect,
    start: Start,
    begin: Callable[[Text], Tracker],
    found: Findings,
) -> int:
    """Walk through both files; the lines of the original that were kept.

    Raises
    ------
    NotFollowedError
    """
    dialect = dialect.set_up(start)
    decimals = dialect.whole_numbers == "machine" and start.decimal_point != "calculator"
    text = Text(dialect, decimals)
    mine = [line.rstrip(b"\r") for line in original.removeprefix(_MARK).split(b"\n")]
    theirs = [line.rstrip(b"\r") for line in other.removeprefix(_MARK).split(b"\n")]
    behind = lines_elsewhere(original, start.subprograms, dialect) if start.subprograms else []
    try:
        walker = FlowWalker(Stepper(text, dialect), lambda: begin(text), [*mine, *behind], theirs)
        mains = [part for part in walker.routes.parts if part.main and not part.data]
        if len(mains) != 1:
            raise LostError
        walker.walk()
    except LostError:
        raise NotFollowedError from None
    except StopError as stop:
        found.add(stop.kind, walker.k + 1, min(stop.at, len(mine) - 1) + 1, stop.problem)
        return 0
    rest = theirs[walker.k :]
    tail = mine[len(mine) - len(rest) :] if rest else []
    if rest != tail:
        told = "what stands behind the end is not that of the original"
        found.add(Kind.ADDED, walker.k + 1, len(mine), told)
    elif len(rest) < len(mine) - walker.closing:
        found.add(Kind.MISSING, walker.k + 1, walker.closing + 1, "the closing % is missing")
    elif walker.lost and len(rest) < len(mine) - mains[0].end:
        told = "a subprogram is left out that may still be called"
        found.add(Kind.FLOW, walker.k + 1, mains[0].end + 1, told)
    elif len(rest) < len(mine) - mains[0].end and any(
        mains[0].end <= part.begin < len(mine) and part.begin not in walker.called
        for part in walker.routes.parts
    ):
        told = "a program is left out that nothing here has called"
        found.add(Kind.FLOW, walker.k + 1, mains[0].end + 1, told)
    elif not walker.ended and any(walker.stepper.upper(line).strip(b" \t\0;%") for line in rest):
        found.add(
            Kind.FLOW, walker.k + 1, len(mine), "blocks follow that the original does not run"
        )
    ends, own = (
        {line.endswith(b"\r") for line in text.split(b"\n")[:-1]} for text in (other, original)
    )
    if ends - own:
        found.add(Kind.LINE_END, None, None, "lines do not end as in the original")
    return len(mine)
