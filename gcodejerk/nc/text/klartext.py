"""One line of Heidenhain Klartext: a statement becomes a block, as the table of the dialect says.

Rule 1: straight lines become words (``L X+10 FMAX R0 M3`` is G0 X10 G40 M3), everything else the
name of its statement. What is not of the grammar is a problem, as in `tokenizer`; it never raises.

Rule 2: each line is read by itself. A line that ``~`` continues is one of a cycle's parameters, and
so is one that begins with ``Q``.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.text.block import Block, Name, Word
from gcodejerk.nc.text.q_parameters import formula, klartext_function

_HEAD = re.compile(rb"[ \t]*(/[ \t]*)?(?:([0-9]+)(?:[ \t]+|$))?(/[ \t]*)?")
_STATEMENTS = (
    *("BEGIN PGM", "END PGM", "BLK FORM", "TOOL CALL", "TOOL DEF", "CYCL CALL"),
    *("CALL LBL", "STOP", "LBL", "APPR", "DEP", "RND", "CHF", "CTP", "FCT", "FLT", "FPOL", "CC"),
    *("CP", "CR", "CT", "LP", "FL", "FC", "C", "L"),
)
_STATEMENT = re.compile(
    rb"(?:(CYCL)[ \t]+DEF[ \t]+([0-9]+)(?:\.[0-9]+)?(?![0-9])|(FN)[ \t]*([0-9]+)[ \t]*:|("
    + b"|".join(name.encode().replace(b" ", rb"[ \t]+") for name in _STATEMENTS)
    + rb")(?=[ \t;~]|$))",
    re.IGNORECASE,
)
_NUMBER = rb"[-+]?(?:[0-9]+(?:[.,][0-9]*)?|[.,][0-9]+)"
_PARAMETER = rb"[-+]?Q[LR]?[0-9]+"
_AXIS = re.compile(rb"(I?)([XYZABCUVW])(?:(" + _NUMBER + rb")|" + _PARAMETER + rb")", re.IGNORECASE)
_FEED = re.compile(
    rb"(?<![A-Za-z0-9])F[ \t]*(?:(MAX)|AUTO|(" + _NUMBER + rb")|" + _PARAMETER + rb")",
    re.IGNORECASE,
)
_RADIUS = re.compile(rb"R([0LR])(?![A-Za-z0-9.,+-])", re.IGNORECASE)
_M = re.compile(rb"M[ \t]*([0-9]{1,3})", re.IGNORECASE)
_RETREAT = re.compile(
    rb"L(?:[ \t]+R0)?(?:[ \t]+FMAX)?[ \t]+M140[ \t]+MB[ \t]*(?:MAX|" + _NUMBER + rb")"
    rb"(?:[ \t]+F(?:MAX|" + _NUMBER + rb"))?",
    re.IGNORECASE,
)
"""Away along the axis of the tool, as far as it goes, or so far; nothing else moves."""
_END = re.compile(rb"(?=[ \t;]|$)")
_ASSIGNED = re.compile(rb"Q[LRS]?[0-9]+[ \t]*=", re.IGNORECASE)
_STRING = re.compile(rb"QS", re.IGNORECASE)
_SETTING = frozenset(("FN 18", *(f"FN {n}" for n in (*range(9), 13))))
"""Functions that set a parameter."""
_UNITS = re.compile(rb".*[ \t](MM|INCH)[ \t]*", re.IGNORECASE)
_TOOL = re.compile(rb"[ \t]+(?:([0-9]+)(?:\.[0-9]+)?(?![0-9])|\"[^\"]*\"|Q)", re.IGNORECASE)
_SIDES = {b"0": 40.0, b"L": 41.0, b"R": 42.0}
_CALL = 99
"""M function that calls the cycle defined last, behind the motion of its block."""
_MACHINE = (91, 92)


class _ProblemError(Exception):
    """What is wrong, and where."""


class _Line:
    """A cursor over one line."""

    def __init__(self, text: bytes, dialect: Dialect) -> None:
        self.text, self.at, self.dialect = text, 0, dialect
        self.words: list[Word] = []
        self.names: list[Name] = []
        self.assigns: list[str] = []
        self.assigned: list[bytes] = []
        self.comments: list[tuple[int, int]] = []
        self.delete = False

    def read(self) -> None:
        """Take the line."""
        head = _HEAD.match(self.text)
        assert head is not None
        self.delete = bool(head[1] or head[3])
        if head[2]:
            begin = head.start(2)
            self._word("N", float(head[2]), begin, head.end(2))
        self.at = head.end()
        if self.text.startswith(b"*", self.at):  # a heading
            self.comments.append((self.at, len(self.text)))
            return
        end = self.text.find(b";", self.at)
        if end >= 0:
            self.comments.append((end, len(self.text)))
        self.statement(len(self.text) if end < 0 else end)

    def statement(self, end: int) -> None:
        """Take what stands in front of the comment."""
        while end > self.at and self.text[end - 1] in b" \t":
            end -= 1
        goes_on = self.text.rstrip(b" \t").endswith(b"~")
        if end == self.at:
            return
        match = _STATEMENT.match(self.text, self.at, end)
        if not goes_on and _RETREAT.fullmatch(self.text, self.at, end):
            self.names.append(Name("M140", b""))
            return
        if match is None:
            self._rest(end, goes_on)
            return
        if match[1] or match[3]:
            name = f"CYCL DEF {int(match[2])}" if match[1] else f"FN {int(match[4])}"
        else:
            name = b" ".join(match[5].split()).decode().upper()
        if goes_on and not match[1]:
            raise _ProblemError("a statement that goes on in the next line")
        self.at = match.end()
        if name == "L":
            self._straight(end)
        elif name == "BEGIN PGM":
            self._units(end)
        elif name == "END PGM":
            self._word("M", 30.0, match.start(), end)
        elif name == "STOP":
            self._word("M", 0.0, match.start(), match.end())
            self._functions(end, but=0)  # STOP M0 is one stop
        else:
            self._other(name, end)

    def _rest(self, end: int, goes_on: bool) -> None:
        """Take parameters, or M functions that stand alone; nothing else has no name."""
        if _ASSIGNED.match(self.text, self.at, end):
            said = self.text[self.at : end]
            self.names.append(Name("Q", said))
            if not _STRING.match(said):
                self._assign(formula(said))
        elif goes_on or not _M.match(self.text, self.at, end):
            raise _ProblemError("statement is not known")
        else:
            self._functions(end)

    def _units(self, end: int) -> None:
        """``BEGIN PGM NAME MM``."""
        match = _UNITS.fullmatch(self.text, self.at, end)
        if match is None:
            raise _ProblemError("MM or INCH is missing")
        inch = match[1].upper() == b"INCH"
        self._word("G", 70.0 if inch else 71.0, match.start(1), match.end(1))

    def _straight(self, end: int) -> None:
        """Take ``L`` and its words."""
        rapid, begin = False, self.at - 1
        seen: set[str] = set()
        while self._blank(end):
            for pattern in (_AXIS, _RADIUS, _FEED, _M):
                match = pattern.match(self.text, self.at, end)
                if match is not None and _END.match(self.text, match.end()):
                    break
            else:
                raise _ProblemError("word is not known")
            self.at = match.end()
            if pattern is _AXIS:
                self._axis(match)
            elif pattern is _RADIUS:
                self._word("G", _SIDES[match[1].upper()], match.start(), match.end())
            elif pattern is _FEED and match[1]:
                rapid = True
            elif pattern is _FEED:
                self._word("F", _number(match[2]), match.start(), match.end())
            else:
                self._function(match)
            key = match[2].decode().upper() if pattern is _AXIS else ""
            key = key or {_RADIUS: "R", _FEED: "F"}.get(pattern, "")
            if key and key in seen:
                raise _ProblemError(f"{key} stands twice")
            seen.add(key)
        number = int(bool(self.words) and self.words[0].letter == "N")
        self.words.insert(number, Word("G", 0.0 if rapid else 1.0, begin, begin + 1, b"L"))

    def _axis(self, match: re.Match[bytes]) -> None:
        """Take an axis word; an I in front of it says that it is an increment."""
        letter = match[2].decode().upper()
        function = "IC" if match[1] else ""
        self._word(letter, _number(match[3]), match.start(), match.end(), function)

    def _function(self, match: re.Match[bytes]) -> None:
        """Take an M function."""
        number = int(match[1])
        if number == _CALL:
            self.names.append(Name("CYCL CALL", b""))
        elif number in _MACHINE:
            self.names.append(Name("M91", b""))
        else:
            self._word("M", float(number), match.start(), match.end())

    def _functions(self, end: int, but: int | None = None) -> None:
        """Take M functions, and nothing else; but this one, which was taken before."""
        while self._blank(end):
            match = _M.match(self.text, self.at, end)
            if match is None or not _END.match(self.text, match.end()):
                raise _ProblemError("word is not known")
            self.at = match.end()
            if int(match[1]) != but:
                self._function(match)

    def _other(self, name: str, end: int) -> None:
        """Take a statement that the table has by its name."""
        rest = self.text[self.at : end]
        if name in _SETTING:
            self._assign(klartext_function(int(name[3:]), rest))
        if name == "TOOL CALL" and (tool := _TOOL.match(self.text, self.at, end)):
            self._word("T", _number(tool[1]), tool.start(), tool.end())
        for match in _RADIUS.finditer(rest):
            if rest[match.start() - 1 : match.start()] in (b" ", b"\t"):
                side = _SIDES[match[1].upper()]
                self._word("G", side, self.at + match.start(), self.at + match.end())
        for match in _M.finditer(rest) if name != "TOOL CALL" else ():
            if rest[match.start() - 1 : match.start()] in (b" ", b"\t"):
                self._function(match)
        feed = _FEED.search(rest) if self.dialect.names.get(name) == "home" else None
        if feed is not None and not feed[1]:
            begin = self.at + feed.start()
            self._word("F", _number(feed[2]), begin, self.at + feed.end())
        self.names.append(Name(name, rest))

    def _assign(self, found: tuple[str, bytes] | None) -> None:
        """Set a parameter; which one, and to what, may not be known."""
        name, said = found or ("", b"")
        self.assigns.append(name)
        self.assigned.append(said)

    def _blank(self, end: int) -> bool:
        """Pass over blanks; whether something follows."""
        while self.at < end and self.text[self.at] in b" \t":
            self.at += 1
        return self.at < end

    def _word(
        self, letter: str, value: float | None, begin: int, end: int, function: str = ""
    ) -> None:
        text = self.text[begin:end]
        self.words.append(Word(letter, value, begin, end, text, b"." not in text, function))


def _number(text: bytes | None) -> float | None:
    """A number with a point or a comma; None for a Q parameter."""
    return None if text is None else float(text.replace(b",", b"."))


def parse_klartext(text: bytes, dialect: Dialect) -> Block:
    """Read one line without its line end.

    Parameters
    ----------
    text : bytes
        The line.
    dialect : Dialect
        Whose table has the statements.

    Returns
    -------
    Block
        With a `problem` where it is not of the grammar.
    """
    line = _Line(text, dialect)
    problem, column, rest = None, None, b""
    try:
        if len(text) > dialect.text.line_limit:
            raise _ProblemError(f"line is longer than {dialect.text.line_limit} bytes")
        line.read()
    except _ProblemError as found:
        # whatever it is, it may be anything: G says so to those who ask for the rest
        problem, column, rest = str(found), line.at + 1, b"G" + text[line.at :]
    return Block(
        words=tuple(line.words),
        comments=tuple(line.comments),
        block_delete=line.delete,
        assigns=tuple(line.assigns),
        assigned=tuple(line.assigned),
        rest=rest,
        problem=problem,
        column=column,
        names=tuple(line.names),
    )
