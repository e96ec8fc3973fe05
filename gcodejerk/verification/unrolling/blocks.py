"""Blocks of a program and of the same program written out, side by side, for the proof.

Whatever block runs next has to be the next one of the other file: byte for byte, or, in a
subprogram, word by word with the values that its own variables have there.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from gcodejerk.nc import Dialect, Start
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.unrolling.structures import Table
from gcodejerk.verification.unrolling.values import Parts, Said, Values, code_of, comments_of

_READS_PLACE = re.compile(rb"<_(?:VALUE|VALUE_RETURNED|CALL_LEVEL|REMAP_LEVEL|LINE)>")
_ACTIVE = re.compile(rb"[(;][ \t]*PY", re.IGNORECASE)
_SHOWS = re.compile(rb"[(;][ \t]*(?:PRINT|DEBUG|LOG|ABORT)[ \t]*,", re.IGNORECASE)
_SHOWN = re.compile(rb"#([0-9]+|<[^<>]*>)")
_CODE = re.compile(rb"([GM])([0-9]+(?:\.[0-9]*)?)")
_LIBRARY = re.compile(rb"(?:SIN|COS|TAN|EXP|LN)\[|\*\*")
_SAVES = frozenset((70.0, 71.0, 72.0, 73.0))
_QUIET_M = frozenset((*range(6), *range(7, 10), 19, 30, *range(48, 54), 60, 61, *range(62, 74)))
"""M codes behind which variables are what they were."""


class StopError(Exception):
    """The walk cannot go on; what is wrong, and where in the original."""

    def __init__(self, kind: Kind, problem: str, at: int) -> None:
        super().__init__(problem)
        self.kind, self.problem, self.at = kind, problem, at


@dataclass(slots=True)
class Call:
    """A subprogram that runs."""

    back: int
    """Line of the call."""
    end: int
    variables: dict[str, float]
    """Of the caller's own."""
    repeats: dict[int, float] = field(default_factory=dict)
    """First line of a ``repeat`` -> passes that are left."""
    loops: list[int] = field(default_factory=list)
    """First lines of the loops that run now."""


class Sides:
    """Both files, and what is known of the variables."""

    def __init__(self, original: bytes, other: bytes, dialect: Dialect, start: Start) -> None:
        self.dialect = dialect.set_up(start)
        self.values = Values(dialect)
        self.mine = original.split(b"\n")
        self.theirs = other.split(b"\n")
        self.table = Table()
        self.table.add(self.mine)
        self.values.careful = any(_LIBRARY.search(code) for code in self.table.code)
        self.size = len(self.mine)
        self.crlf = self.mine[0].endswith(b"\r") and self.size > 1
        self.k = 0
        """Line of the other file that comes next, from 0."""
        self.variables: dict[str, float] = {}
        self._frames = [Call(0, 0, {})]
        """What runs: the main program, and what it has called."""
        self.ended = self.opened = False
        self.kept = 0
        self.lost: int | None = None
        """A line that may run subprograms nobody follows."""
        self._foreign: dict[bytes, bool] = {}

    def _reads_place(self) -> int | None:
        """A line that reads where in the flow it is, which is elsewhere in the other file."""
        for at, text in enumerate(self.table.text):
            if b"_" in text and _READS_PLACE.search(text.translate(None, b" \t").upper()):
                return at
        return None

    def _is_next(self, at: int) -> bool:
        return self.k < len(self.theirs) and self.theirs[self.k] == self.mine[at]

    def _same(self, at: int) -> None:
        """A line that both files have."""
        if not self._is_next(at):
            raise self._differs(at, self.mine[at])
        self.k += 1
        self.kept += 1

    def _differs(self, at: int, expected: bytes) -> StopError:
        mine = expected[:60].decode("latin-1").rstrip()
        if self.k >= len(self.theirs):
            return StopError(Kind.MISSING, f"file ends where '{mine}' follows", at)
        theirs = self.theirs[self.k][:60].decode("latin-1").rstrip()
        kind = Kind.FLOW if at >= self.size or self._called_now else Kind.CHANGED
        return StopError(kind, f"expected '{mine}' as the original runs, found '{theirs}'", at)

    def _comment(self) -> None:
        """Pass over the comment that names what is written out."""
        line = self.theirs[self.k] if self.k < len(self.theirs) else b""
        bare = line.removesuffix(b"\r")
        if bare.startswith(b"(gcodejerk: "):
            if not (bare.endswith(b")") and bare.count(b"(") == bare.count(b")") == 1):
                raise StopError(Kind.COMMENT, "not one closed comment", self.size - 1)
            self._take(self.size - 1)

    @property
    def _called_now(self) -> bool:
        """Whether a subprogram runs."""
        return len(self._frames) > 1

    def _forget(self) -> None:
        self.variables = {}

    def _doubt(self, at: int, why: str) -> StopError:
        return StopError(Kind.FLOW, f"it was to stay as it is: {why}", at)

    def _block(self, at: int, at_top: bool) -> None:
        """A block: what it does to variables, and what has to stand for it."""
        code, text = self.table.code[at], self.table.text[at]
        if self.ended:
            return
        if code in (b"", b"/"):
            if not at_top and comments_of(text):
                self._shown(at, text, None)
            return
        if code == b"%":
            self.ended, self.opened = self.opened, True
            return
        if not at_top and _ACTIVE.search(text):
            raise self._doubt(at, "a comment runs Python")
        if self._is_foreign(code):
            self.lost = at
        plain = not (b"#" in code or b"M" in code or b"/" in code)
        if at_top and plain and not _ACTIVE.search(text):
            return
        parts = None if plain and not self._called_now else self.values.parts(code, self.variables)
        if not at_top:
            self._shown(at, text, parts)
        if parts is not None:
            self._act(at, parts, at_top)

    def _is_foreign(self, code: bytes) -> bool:
        """Whether a block has a code that may do anything, run a subprogram by its number too."""
        if code not in self._foreign:
            tables = {b"G": self.dialect.groups, b"M": self.dialect.m_groups}
            self._foreign[code] = any(
                round(float(number) * (10.0 if letter == b"G" else 1.0)) not in tables[letter]
                for letter, number in _CODE.findall(code)
            )
        return self._foreign[code]

    def _act(self, at: int, parts: Parts, at_top: bool) -> None:
        """What a block does to variables, and to the program."""
        codes = {word.value for word in parts.words if word.name == "M"}
        if not parts.understood:
            self._forget()
            self.lost = at
            return
        if not at_top and codes & {97.0, 98.0, 99.0}:
            raise self._doubt(at, "M97, M98 and M99 lead elsewhere")
        if self._called_now and codes & _SAVES:
            raise self._doubt(at, "it saves or restores modes of the subprogram")
        if codes - _QUIET_M:
            # A builder's program may set what all programs share.
            own = {n: v for n, v in self.variables.items() if self.values.is_local(n)}
            self.variables = own
        if codes & {97.0, 98.0, 99.0}:
            self._forget()
            self.lost = at
        for each in parts.sets:
            self._set(each.name, each.value, parts.deleted)
        if codes & {2.0, 30.0}:
            if parts.deleted and not at_top:
                raise self._doubt(at, "the operator decides whether the program ends")
            self.ended = not parts.deleted

    def _set(self, name: str, number: float, deleted: bool) -> None:
        """Set a variable; one that nobody can tell may be any."""
        if not name:
            self._forget()
            return
        system = name.isdigit() and (int(name) >= self.values.system or int(name) == 0)
        known = number == number and not system
        if known and not (deleted and self.variables.get(name) != number):
            self.variables[name] = number
        else:
            self.variables.pop(name, None)

    def _lose(self, at: int) -> bool:
        """Lose what a block may set that nobody follows; False where that may be anything."""
        code = self.table.code[at]
        if b"#" not in code and b"M" not in code:
            return True
        parts = self.values.parts(code, {})
        codes = {word.value for word in parts.words if word.name == "M"}
        for each in parts.sets:
            self.variables.pop(each.name, None)
        return parts.understood and not codes - _QUIET_M and all(each.name for each in parts.sets)

    def _shown(self, at: int, text: bytes, parts: Parts | None) -> None:
        """The block has to be the next line of the other file, as it is or with its values."""
        own = self._called_now and self._names_own(at, text)
        theirs = self.theirs[self.k] if self.k < len(self.theirs) else None
        if not own:
            if theirs is None or theirs.removesuffix(b"\r") != text:
                raise self._differs(at, text)
            self._take(at)
            return
        code = self.table.code[at]
        parts = self.values.parts(code, self.variables) if parts is None else parts
        words, sets, comments = parts.words, self._shared(at, parts), self._comments(at, text)
        if not (words or sets or comments):
            return
        if theirs is None or not parts.understood:
            raise self._differs(at, text)
        got_code = code_of(theirs)
        if b"#" in got_code and self.values.reads_local(got_code):
            raise StopError(Kind.FLOW, "it names a variable of the subprogram's own", at)
        got = self.values.parts(got_code, self.variables)
        same = got.understood and got.deleted == parts.deleted
        same = same and _alike(words, got.words) and _alike(sets, got.sets)
        if not same or comments_of(theirs) != comments:
            raise self._differs(at, text)
        self._take(at)

    def _take(self, at: int) -> None:
        """Take a line of the other file, which ends as lines do there."""
        last = self.k == len(self.theirs) - 1
        if not last and self.theirs[self.k].endswith(b"\r") is not self.crlf:
            raise StopError(Kind.LINE_END, "lines do not end as in the original", at)
        self.k += 1

    def _names_own(self, at: int, text: bytes) -> bool:
        """Whether a block of a subprogram hangs on variables of its own."""
        shows = any(_SHOWS.match(comment) for comment in comments_of(text))
        return (shows and b"#" in text) or self.values.reads_local(self.table.code[at])

    def _shared(self, at: int, parts: Parts) -> list[Said]:
        """Of what a block sets, that which others see."""
        found = [each for each in parts.sets if not (each.name and self.values.is_local(each.name))]
        if len(found) < len(parts.sets) and any(each.value != each.value for each in parts.sets):
            # The rest is left out, where LinuxCNC might have stopped with an error.
            raise self._doubt(at, "a variable of a subprogram is set to what is not known")
        return found

    def _comments(self, at: int, text: bytes) -> list[bytes]:
        """The comments of a block, with what LinuxCNC shows of the subprogram's own variables."""
        found = []
        for comment in comments_of(text):
            if _SHOWS.match(comment) and b"#" in comment:
                if b"%" in comment:
                    raise self._doubt(at, "it shows a formatted variable")
                comment = _SHOWN.sub(lambda match: self._text_of(at, match), comment)
            found.append(comment)
        return found

    def _text_of(self, at: int, match: re.Match[bytes]) -> bytes:
        name = match[1].translate(None, b" \t").upper().decode("latin-1")
        name = str(int(name)) if name.isdigit() else name
        if not self.values.is_local(name):
            return match[0]
        if name not in self.variables:
            raise self._doubt(at, "it shows what is not known")
        return b"%f" % self.variables[name]


def _alike(a: list[Said], b: list[Said]) -> bool:
    """Whether two lists say the same."""
    return len(a) == len(b) and all(x.same(y) for x, y in zip(a, b, strict=True))
