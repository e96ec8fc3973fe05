"""Which line follows which, for the second reading: jumps, loops and calls of macro B and Siemens.

A line of flow is told by one expression over the whole line, and becomes a `Way`; every other line
is a block. `walking` goes these ways.

Rule: what is not written exactly as it stands here is not followed (`LostError`).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from gcodejerk.nc.dialects.dialect import Dialect

_FLOW_NAMED = (b"GOTO", b"FOR", b"WHILE", b"LOOP", b"REPEAT", b"IF", b"PROC")
_FLOW_WORD = re.compile(
    rb"(?<![A-Z0-9_])(?:GOTO[FBC]?|FOR|WHILE|LOOP|REPEATB?|IF|PROC)(?![A-Z0-9_])"
)
_FLOW_LABELLED = re.compile(rb"LBL(?![A-Z0-9_])(?<![A-Z0-9_]LBL)")
_FLOW_CODED = re.compile(rb"G[ \t]*98(?![0-9.])")
_FLOW_MACRO = re.compile(rb"GOTO|WHILE|DO[ \t]*[0-9]|G[ \t]*65(?![0-9.])|IF[ \t]*\[")


_CALLS = re.compile(rb"M[ \t]*0*98(?![0-9])", re.IGNORECASE)


def flows(data: bytes, dialect: Dialect) -> bool:
    """Whether a file holds flow that is followed here."""
    rules, data = dialect.text, data.upper()
    if rules.names and rules.variables == "R":
        if b"%_N_" in data:
            return True
        return any(word in data for word in _FLOW_NAMED) and _FLOW_WORD.search(data) is not None
    if rules.variables == "Q":
        return (_FLOW_LABELLED if rules.klartext else _FLOW_CODED).search(data) is not None
    programs = bool(rules.keywords) and rules.o_word == "program"
    return programs and _FLOW_MACRO.search(data) is not None


def _cut(text: bytes) -> tuple[bytes, ...]:
    """Cut arguments at the commas outside of brackets."""
    if not text.strip():
        return ()
    flat = text
    while (shorter := _INSIDE.sub(lambda m: b"." * len(m[0]), flat)) != flat:
        flat = shorter
    if b"(" in flat or b")" in flat:
        raise LostError
    cuts = [k for k, byte in enumerate(flat) if byte == 0x2C]
    edges = [-1, *cuts, len(flat)]
    return tuple(text[a + 1 : b].strip() for a, b in zip(edges, edges[1:], strict=False))  # noqa: RUF007


def calls(data: bytes, dialect: Dialect) -> bool:
    """Whether a file calls subprograms by M98, without any other flow."""
    rules = dialect.text
    return rules.o_word == "program" and _CALLS.search(data) is not None


class LostError(Exception):
    """The file is not followed."""


@dataclass(slots=True)
class Way:
    """What a line of flow does."""

    what: str
    """``go``, ``then``, ``count``, ``recount``, ``again``, ``sub``, ``call``, ``back``."""
    test: bytes | None = None
    """Condition; None where there is none."""
    to: int | None = None
    """Line to go to where it holds."""
    other: int | None = None
    """Line to go to where it does not; None: the next."""
    name: str = ""
    texts: tuple[bytes, ...] = ()
    times: bytes = b"1"
    own: bool = True
    """The called program has variables of its own."""


@dataclass(slots=True)
class Part:
    """A program or subprogram: lines begin:end."""

    begin: int
    end: int
    name: str = ""
    main: bool = False
    data: bool = False
    given: tuple[tuple[str, str, bytes], ...] = ()
    callable: bool = True
    saves: bool = False
    labels: dict[str, int | None] = field(default_factory=dict)


_LEAD = re.compile(rb"[ \t]*(?:/[0-9]?[ \t]*)?(?:N[ \t]*([0-9]+)[ \t]*)?(?:/[0-9]?[ \t]*)?")
_PROGRAM = re.compile(rb"[ \t]*[O:][ \t]*([0-9]+)[ \t]*")
_HEADER = re.compile(rb"[ \t]*%_N_([A-Z0-9_]+)_([A-Z]+)[ \t]*")
_MACRO = tuple(
    (what, re.compile(pattern))
    for what, pattern in (
        ("if", rb"IF(\[.*\])GOTON?([0-9]+)"),
        ("then", rb"IF(\[.*\])THEN(#[0-9]+=.*)"),
        ("goto", rb"GOTON?([0-9]+)"),
        ("computed", rb"GOTO([#\[].*)"),
        ("while", rb"WHILE(\[.*\])DO([0-9]+)"),
        ("do", rb"DO([0-9]+)"),
        ("end", rb"END([0-9]+)"),
        ("m98", rb"M98P([0-9]+)\.?(?:L([0-9]+)\.?)?"),
        ("m98", rb"M98L([0-9]+)\.?P([0-9]+)\.?"),
        ("g65", rb"G65P([0-9]+)\.?((?:[A-FH-KMQ-Z][^A-Z]*(?:[A-Z]{2,}\[[^A-Z]*)*|L[0-9.]+)*)"),
        ("silent", rb"(?:SETVN|POPEN|PCLOS|DPRNT|BPRNT).*"),
    )
)
_NAME = rb"[A-Z_][A-Z_][A-Z0-9_]*"
_NAMED = tuple(
    (what, re.compile(rb"[ \t]*" + pattern + rb"[ \t]*"))
    for what, pattern in (
        ("if", rb"IF(?![A-Z0-9_])(.*?)(?<![A-Z0-9_])(GOTO[FBC]?)[ \t]+([A-Z0-9_]+)"),
        ("goto", rb"(GOTO[FBC]?)[ \t]+([A-Z0-9_]+)"),
        ("IF", rb"IF(?![A-Z0-9_])(.*)"),
        ("ELSE", rb"ELSE()"),
        ("ENDIF", rb"ENDIF()"),
        ("WHILE", rb"WHILE(?![A-Z0-9_])(.*)"),
        ("ENDWHILE", rb"ENDWHILE()"),
        ("LOOP", rb"LOOP()"),
        ("ENDLOOP", rb"ENDLOOP()"),
        ("REPEAT", rb"REPEAT()"),
        ("UNTIL", rb"UNTIL(?![A-Z0-9_])(.*)"),
        ("FOR", rb"FOR[ \t]+([^=]+)=(.*?)(?<![A-Z0-9_])TO(?![A-Z0-9_])(.*)"),
        ("ENDFOR", rb"ENDFOR()"),
        ("part", rb"REPEAT[ \t]+(" + _NAME + rb")()(?:[ \t]+P[ \t]*=?[ \t]*([0-9]+))?"),
        ("part", rb"REPEAT[ \t]+(%s)[ \t]+(%s)(?:[ \t]+P[ \t]*=?[ \t]*([0-9]+))?" % (_NAME, _NAME)),
        ("line", rb"REPEATB[ \t]+(" + _NAME + rb")(?:[ \t]+P[ \t]*=?[ \t]*([0-9]+))?"),
        ("RET", rb"RET()"),
    )
)
_KEYWORD = re.compile(
    rb"(?<![A-Z0-9_])(?:GOTO[FBCS]?|FOR|ENDFOR|WHILE|ENDWHILE|LOOP|ENDLOOP|REPEATB?|UNTIL|IF|ELSE|ENDIF"
    rb"|CASE|CALL|PCALL|SETINT|ISOCALL|EXECSTRING|RET)(?![A-Z0-9_])"
)
_MACRO_WORD = re.compile(rb"GOTO|WHILE|IF\[|THEN|DO[0-9]|END[0-9]|M0*9[67](?![0-9])")
_LABEL = re.compile(rb"[ \t]*(" + _NAME + rb")[ \t]*:(?!=)")
_CALLED = re.compile(
    rb"[ \t]*(L[0-9]+|"
    + _NAME
    + rb")[ \t]*(?:\(([^\"]*)\))?[ \t]*(?:P[ \t]*=?[ \t]*([0-9]+))?[ \t]*"
)
_INSIDE = re.compile(rb"\([^()]*\)")
_PROC = re.compile(
    rb"[ \t]*PROC[ \t]+(L[0-9]+|" + _NAME + rb")[ \t]*(?:\(([^()]*)\))?((?:[ \t]+[A-Z]+)*)[ \t]*"
)
_GIVEN = re.compile(rb"[ \t]*(REAL|INT|BOOL)[ \t]+(" + _NAME + rb")[ \t]*(?:=(.*))?")
_ARGUMENT = re.compile(rb"([A-Z])([^A-Z]*(?:[A-Z]{2,}\[[^A-Z]*)*)")


class Routes:
    """The ways of a file."""

    by_code = True
    """Programs have a head, and M codes return from them."""

    def __init__(self, lines: list[bytes], dialect: Dialect) -> None:
        """Find them.

        Parameters
        ----------
        lines : list of bytes
            In upper case, without comments.
        dialect : Dialect
            Its table.
        """
        self.lines, self.dialect = lines, dialect
        self.named = dialect.text.names
        self.ways: dict[int, Way] = {}
        self.parts = self._parts()
        self._names = {part.name for part in self.parts if part.name}
        self._called: dict[str, Part | None] = {}
        self._around: dict[int, tuple[int, ...]] = {}
        for part in self.parts:
            if not part.data:
                self._find_labels(part)
                self._find_ways(part)

    def _parts(self) -> list[Part]:
        """Cut the file into programs."""
        pattern = _HEADER if self.named else _PROGRAM
        begins = [k for k, text in enumerate(self.lines) if pattern.match(text)]
        if self.named and any(
            t.lstrip().startswith(b"%") and not _HEADER.fullmatch(t) for t in self.lines
        ):
            raise LostError
        cuts = sorted({0, *begins, len(self.lines)})
        parts = []
        for begin, end in zip(cuts, cuts[1:], strict=False):  # noqa: RUF007
            part = Part(begin, end, main=begin == 0)
            match = pattern.match(self.lines[begin])
            if match and self.named:
                part.name = match[1].decode()
                part.main = match[2] == b"MPF" or (begin == 0 and match[2] == b"SPF")
                part.data = match[2] not in (b"MPF", b"SPF")
            elif match:
                part.name = str(int(match[1]))
            parts.append(part)
        for part in parts[:1]:
            if not self.named and len(parts) > 1 and not part.name and not self._says(part):
                part.data, parts[1].main = True, True
        return parts

    def _says(self, part: Part) -> bool:
        """Whether a part holds anything."""
        return any(t.strip(b" \t\0%") for t in self.lines[part.begin : part.end])

    def called(self, name: str) -> Part | None:
        """The subprogram of a name, if there is one."""
        if name not in self._called:
            found = [part for part in self.parts if part.name == name]
            alone = len(found) == 1 and not found[0].main
            self._called[name] = found[0] if alone else None
        return self._called[name]

    def _find_labels(self, part: Part) -> None:
        for at in range(part.begin, part.end):
            text = self.lines[at]
            lead = _LEAD.match(text)
            assert lead is not None
            names = [f"N{int(lead[1])}"] if lead[1] else []
            if self.named and (label := _LABEL.match(text, lead.end())):
                names.append(label[1].decode())
            for name in names:
                part.labels[name] = None if name in part.labels else at

    def _find_ways(self, part: Part) -> None:
        opened: list[tuple[str, int, int | None]] = []
        for at in range(part.begin, part.end):
            self._around[at] = tuple(begin for _, begin, _ in opened)
            text = self.lines[at]
            lead = _LEAD.match(text)
            assert lead is not None
            bare = text[lead.end() :].replace(b"\0", b" ").strip(b" \t")
            if self.named:
                if label := _LABEL.match(bare):
                    bare = bare[label.end() :].strip(b" \t")
                self._named_way(part, at, bare, opened)
            else:
                self._macro_way(part, at, bare.translate(None, b" \t;"), opened)
            if at in self.ways and b"/" in text[: lead.end()]:
                raise LostError
        if opened:
            raise LostError
        for at in range(part.begin, part.end):
            way = self.ways.get(at)
            if way is not None and way.name == "goto" and way.to is not None:
                inner = self._around.get(way.to, ())
                if self._around[at][: len(inner)] != inner:
                    raise LostError

    # Complex: one case for each form of a line of macro B that leads somewhere.
    def _macro_way(
        self, part: Part, at: int, text: bytes, opened: list[tuple[str, int, int | None]]
    ) -> None:
        """Tell a line of macro B."""
        if text.startswith(b"/"):
            raise LostError
        for what, pattern in _MACRO:
            match = pattern.fullmatch(text)
            if match is None:
                continue
            if what == "if":
                target = self._target(part, b"N" + match[2], at, b"")
                self.ways[at] = Way("go", match[1], target, name="goto")
            elif what == "goto":
                target = self._target(part, b"N" + match[1], at, b"")
                self.ways[at] = Way("go", None, target, name="goto")
            elif what == "computed":
                self.ways[at] = Way("pick", match[1])
            elif what == "then":
                self.ways[at] = Way("then", match[1], texts=(match[2],))
            elif what in ("while", "do"):
                label = match[match.re.groups].decode()
                opened.append((label, at, None))
                self.ways[at] = Way("go", match[1] if what == "while" else None, at + 1)
            elif what == "end":
                if not opened or opened[-1][0] != match[1].decode():
                    raise LostError
                _, begin, _ = opened.pop()
                self.ways[begin].other = at + 1
                self.ways[at] = Way("go", None, begin)
            elif what == "m98":
                swapped = pattern.pattern.startswith(b"M98L")
                number, times = (match[2], match[1]) if swapped else (match[1], match[2])
                name, times = str(int(number)), times or b"1"
                packed = self.dialect.packed_repeats and int(number) >= 10000 and not match[2]
                if packed and self.called(name) is None:
                    name, times = str(int(number) % 10000), b"%d" % (int(number) // 10000)
                self.ways[at] = Way("call", name=name, times=times, own=False)
            elif what == "g65":
                words = _ARGUMENT.findall(match[2])
                times = next((value for letter, value in words if letter == b"L"), b"1")
                texts = tuple(letter + value for letter, value in words if letter != b"L")
                self.ways[at] = Way("call", name=str(int(match[1])), texts=texts, times=times)
            return
        if _MACRO_WORD.search(text):
            raise LostError

    # Complex: one case for each form of a line of Siemens that leads somewhere.
    def _named_way(
        self, part: Part, at: int, text: bytes, opened: list[tuple[str, int, int | None]]
    ) -> None:
        """Tell a line of Siemens."""
        if b"PROC" in text and (match := _PROC.fullmatch(text)):
            self._proc(part, match)
            return
        for what, pattern in _NAMED:
            match = pattern.fullmatch(text)
            if match is None or (what == "IF" and b"GOTO" in text):
                continue
            if what in ("if", "goto"):
                how, name = match[match.re.groups - 1], match[match.re.groups]
                test = match[1] if what == "if" else None
                self.ways[at] = Way("go", test, self._target(part, name, at, how), name="goto")
            elif what in ("part", "line"):
                first = self._target(part, match[1], at, b"GOTOB")
                last = at
                if what == "part" and match[2]:
                    last = self._target(part, match[2], at, b"GOTOB") + 1
                if what == "line":
                    last = first + 1
                if "ENDLABEL" in part.labels or self._around.get(first, ()) != self._around[at]:
                    raise LostError
                times = match[match.re.groups] or b"1"
                self.ways[at] = Way("again", to=first, other=last, times=times)
            elif what == "RET":
                self.ways[at] = Way("back")
            else:
                self._structure(at, what, match, opened)
            return
        if _KEYWORD.search(re.sub(rb'"[^"]*"', b"", text)):
            raise LostError
        match = _CALLED.fullmatch(text)
        name = "" if match is None else match[1].decode()
        if match is not None and name in self._names and name != part.name:
            texts = _cut(match[2] or b"")
            self.ways[at] = Way("call", name=name, texts=texts, times=match[3] or b"1")

    def _structure(
        self,
        at: int,
        what: str,
        match: re.Match[bytes],
        opened: list[tuple[str, int, int | None]],
    ) -> None:
        """Tell where a loop or a branch of Siemens begins, and where it ends."""
        ways = self.ways
        if what in ("IF", "WHILE", "LOOP", "REPEAT", "FOR"):
            opened.append((what, at, None))
            if what == "FOR":
                name = match[1].strip(b" \t").decode("latin-1")
                ways[at] = Way("count", match[3], at + 1, name=name, texts=(match[2],))
            else:
                ways[at] = Way("go", match[1] if what in ("IF", "WHILE") else None, at + 1)
            return
        opener = "REPEAT" if what == "UNTIL" else "IF" if what == "ELSE" else what[3:]
        if not opened or opened[-1][0] != opener:
            raise LostError
        _, begin, between = opened.pop()
        if what == "ELSE":
            if between is not None:
                raise LostError
            ways[begin].other = at + 1
            ways[at] = Way("go")
            opened.append(("IF", begin, at))
        elif what == "ENDIF":
            if between is None:
                ways[begin].other = at + 1
            else:
                ways[between].to = at + 1
            ways[at] = Way("go", None, at + 1)
        elif what == "UNTIL":
            ways[at] = Way("go", match[1], at + 1, begin + 1)
        elif what == "ENDLOOP":
            ways[at] = Way("go", None, begin + 1)
        else:
            ways[begin].other = at + 1
            if what == "ENDWHILE":
                ways[at] = Way("go", None, begin)
            else:
                head = ways[begin]
                ways[at] = Way("recount", head.test, begin + 1, at + 1, head.name)

    def _target(self, part: Part, name: bytes, at: int, how: bytes) -> int:
        """Line of a label or a number."""
        key = name.decode("latin-1")
        key = f"N{int(key)}" if key.isdigit() else key
        if key[:1] == "N" and key[1:].isdigit():
            key = f"N{int(key[1:])}"
        line = part.labels.get(key)
        if line is None or (how == b"GOTOF" and line <= at) or (how == b"GOTOB" and line > at):
            return -1
        return line

    def _proc(self, part: Part, match: re.Match[bytes]) -> None:
        """``PROC NAME(REAL DEPTH=5) SAVE``."""
        part.name = part.name or match[1].decode()
        part.saves = b"SAVE" in (match[3] or b"")
        given = []
        for text in match[2].split(b",") if (match[2] or b"").strip() else ():
            found = _GIVEN.fullmatch(text)
            if found is None:
                part.callable = False
                return
            given.append((found[2].decode(), found[1].decode(), (found[3] or b"0").strip()))
        part.given = tuple(given)
