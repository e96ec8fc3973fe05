"""A second reading of a program's text, for the proof alone: lines into words, cuts into runs.

What `nc` says of a rapid is what everything else rests on, so somebody has to read the program
once more, by other means. This module is regular expressions over lines and over pieces of a file;
`tracking` follows what the words do, `agreement` compares. Of `nc` it knows the dialects' tables.

Rule 1: what does not match is not understood, and says so. Nothing is repaired or guessed.

Rule 2: a run is text of which only the last word of each axis counts: feed moves in absolute
coordinates, one behind the other. It is passed in one match, however long it is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

from gcodejerk.axes import AXES
from gcodejerk.nc.dialects.dialect import Dialect, Effect
from gcodejerk.verification.second_reading.klartext import read_statement
from gcodejerk.verification.second_reading.lengths import (
    assigns_alone,
    is_cut,
    is_loose,
    is_one_number,
    is_too_much,
    unsaid,
    written_frame,
)
from gcodejerk.verification.second_reading.limiting import Said, take_limits

PIECE = 1 << 20
"""Bytes in memory at a time."""
NAN = math.nan
_BLANKS = b" \t"
_NUMBER = rb"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?![0-9.])"
_WORD = re.compile(rb"([A-Z])[ \t]*(" + _NUMBER + rb"|[-+]?#)[ \t]*")
_INDEX = rb"(?:[ \t]*[0-9]+|[ \t]*<[^<>]*>)"
_VARIABLE = re.compile(rb"#(?:[ \t]*#)*" + _INDEX)
_INNERMOST = re.compile(rb"\[[^\[\]]*\]")
_SETTINGS = re.compile(rb"#[ \t]*([0-9]+)[ \t]*=[ \t]*([0-9]+\.?(?![0-9])(?=[ \t]*(?:$|[#\0])))?")
_CALL = re.compile(rb"[A-Z]{2,6}[ \t]*#0?(?:[ \t]*/[ \t]*#0?)?")
_TARGET = re.compile(rb"#[ \t]*([0-9]+|<[^<>]*>)[ \t]*=")
_SETTING = re.compile(rb"#+(?:[0-9]+|<[^<>]*>)=[-+]*(?:#+(?:[0-9]+|<[^<>]*>)|" + _NUMBER + rb")")
"""An assignment of one operand, behind which words may follow; without blanks."""
_COMPUTED = re.compile(rb"[ \t]*(?:N[ \t]*[0-9]+)?[ \t]*#[ \t]*[#\[].*=")
_PERCENT = re.compile(rb"[ \t]*(?:N[0-9]+[ \t]*)?%")
_HEAD_WITH_UNIT = re.compile(rb"(?:N[0-9]+[ \t]*)?%[^ \t]+[ \t]+G[ \t]*(7[01])[ \t\0]*")
"""``%PART G71`` of Heidenhain."""
_LEADER = re.compile(rb"%[ \t]*(?:[O:][ \t]*[0-9]{1,8})?[ \t\0]*")
_DEF = re.compile(
    rb"(?:N[0-9]+[ \t]*)?DEF[ \t]+(?:REAL|INT|BOOL|CHAR|STRING[ \t]*\[[0-9]+\])[ \t]+"
)
_DECLARED = re.compile(rb"(?:^|,)[ \t]*([A-Z_][A-Z_][A-Z0-9_]*)")
_O_WORD = re.compile(rb"[ \t]*(?:N[ \t]*[0-9]+[ \t]*)?[O:][ \t]*(<[^<>]*>|[0-9]+)[ \t]*([A-Z0-9]*)")
_FILE_NAME = re.compile(rb"(?:\$[\w-]*|[A-Z_][\w-]*)\.[A-Z]{1,5}%?")
_CHECKSUM = re.compile(rb"\*[ \t]*[0-9]{1,3}[ \t]*$")
_NAME = re.compile(rb"([A-Z_][A-Z_][A-Z0-9_]*)([ \t]*\((?:[^()\"]|\"[^\"]*\")*\))?")
_PARAMETER = re.compile(rb"R[0-9]*[ \t]*=[^ \t;]*|R[ \t]*\[[^\]]*\][ \t]*=[^ \t;]*")
_PADDED = re.compile(rb"(?<![A-Z_])[GM](?:[ \t]|0[0-9])", re.IGNORECASE)
_NUMBERED = re.compile(rb"[ \t]*N[-+ 0-9]", re.IGNORECASE)
_SYSTEM_DATA = re.compile(rb"(?:N[0-9]+[ \t]*)?\$[A-Z]")
_SPINDLE = re.compile(rb"\$(-?[0-9]+)\.?(?![-+0-9.#\[])")
_STRING = re.compile(rb"([A-Z])[ \t]*=[ \t]*\"[^\"]*\"")
RUN_LINES = 512
"""Lines of a run in one match."""


@dataclass(slots=True)
class Line:
    """One line, as far as it is understood."""

    words: list[tuple[str, float, bool]] = field(default_factory=list)
    """Letter, number (NaN where it is computed), and whether it has no decimal point."""
    deleted: bool = False
    """The operator may skip it."""
    understood: bool = True
    unread: bytes = b""
    """All of it, in capitals, where it is not understood."""
    effects: list[Effect] = field(default_factory=list)
    """Of named words, the ones without any left out."""
    percent: bool = False
    flow: str | None = None
    """Keyword of an O word, empty behind a bare number."""
    blank: bool = False
    offsets: bool = False
    """An assignment that may change offsets."""
    switched: float | None = None
    """What is written into the variable that switches overrides; NaN where it is computed."""
    frame: str = ""
    """Which frame may turn, scale or mirror from here on, being written as data."""
    swivelled: bool = False
    """The plane is turned from here on."""
    smoothed: bool = False
    """A tolerance is given for the path from here on."""
    group: bool = False
    """F is from here on the speed of some axes only."""
    cycle: tuple[str, bytes] | None = None
    """Name and arguments of a cycle."""
    limits: list[Said] = field(default_factory=list)
    relative: dict[str, str] = field(default_factory=dict)
    """Address -> ``IC`` or ``AC``, whatever G90 or G91 says."""


@dataclass(slots=True)
class Run:
    """Feed moves one behind the other."""

    lines: int
    last: dict[str, float]
    """Last number of each axis, and of F."""
    feed_whole: bool
    code: int | None
    """The last motion code stated, times ten."""
    stated: tuple[int, ...] = ()
    """All of them, in a run that may be refused."""


class Text:
    """How a dialect's lines are read."""

    def __init__(self, dialect: Dialect, decimals_matter: bool) -> None:
        """Begin.

        Parameters
        ----------
        dialect : Dialect
            Its table.
        decimals_matter : bool
            A number without a decimal point is not what it says.
        """
        self.dialect = dialect
        rules = dialect.text
        parts = []
        if rules.parentheses in ("comment", "lone comment"):
            parts.append(rb"\([^()]*\)")
        elif rules.parentheses == "open comment":
            parts.append(rb"\([^)]*(?:\)|$)")
        if rules.semicolon == "comment":
            parts.append(rb";.*")
        elif rules.semicolon == "end":
            # what stands behind the end of a block may be text, but no block
            parts.append(rb";(?![ \t]*(?:[A-Z][ \t]*[-+]?[0-9.]+[ \t]*)+(?:[;(]|$))[^#=\[]*$")
        if rules.slashes:
            parts.append(rb"//.*")
        if rules.end:
            parts.append(re.escape(rules.end) + rb"[ \t]*$")
        self.comments = re.compile(b"|".join(parts), re.IGNORECASE) if parts else None
        self.python = re.compile(rb"[(;][ \t]*py[ \t]*,", re.IGNORECASE) if rules.python else None
        level = rb"[0-9]?" if rules.delete == "numbered" else b""
        number = rb"(?:N[0-9]+[ \t]*)?" if rules.delete == "numbered" else b""
        self.delete = re.compile(rb"[ \t]*" + number + rb"/" + level)
        self.declared: set[bytes] = set()
        """Variables with a name."""
        self.tried = -1, -1
        """Begin and end of a run that was not taken."""
        self.run, self.run_stated, self.run_on = self._runs(decimals_matter)

    def _runs(self, decimals_matter: bool) -> tuple[re.Pattern[bytes], ...]:
        """Patterns of the begin of a run of feed moves, and of what may follow.

        Of the second, the first line states its code. Nothing in them matches in two ways, so that
        a line that does not match costs its length, and a repeat, which remembers every turn that
        it could still take back, is bounded.
        """
        rules, dialect = self.dialect.text, self.dialect
        number = rb"[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?![0-9.])" if decimals_matter else _NUMBER
        if rules.digits:
            number = number.replace(b"[0-9]+", b"[0-9]{1,4}", 1)
        letters = "".join(a for a in AXES if a in dialect.letters and a not in dialect.increments)
        letters = "".join(a for a in letters if a not in dialect.tool_frame)
        extra = "E" if dialect.one_command else "IJK" if dialect.polar else "IJKR"
        word = rb"(?:[" + (letters + extra).encode() + rb"][ \t]*" + number + rb"[ \t]*)"
        feed = rb"(?:F[ \t]*" + _NUMBER + rb"[ \t]*)?"
        line_number = rb"[ \t]*" + (rb"(?:N[ \t]*[0-9]+[ \t]*)?" if rules.numbered else b"")
        told = sorted({20, 30} & dialect.arcs - dialect.redrawn)
        arcs = b"".join(b"%d" % (code // 10) for code in told)
        code = rb"G" + (rb"0?" if rules.padded else rb"") + rb"[1" + arcs + rb"](?![0-9.])[ \t]*"
        acts = rb"[A-Za-z_]+[ \t]*," if rules.live_comments else rb"[pP][yY]"
        comment = rb"(?:\((?![ \t]*" + acts + rb")[^()\r\n]*\)[ \t]*)?"
        comment = b"" if rules.parentheses in ("code", "lone comment") else comment
        rest = word + rb"+" + feed + comment + rb"\r?\n"
        free = code if not dialect.modal_motion else rb"(?:" + code + rb")?"
        lines = rb"(?:" + line_number + free + rest + rb")"
        stated = line_number + code + rest
        most = rb"%d}" % RUN_LINES
        if rules.tight:
            lines, stated = (part.replace(rb"[ \t]*", b" *") for part in (lines, stated))
        return (
            re.compile(lines + rb"{4," + most),
            re.compile(stated + lines + rb"{3," + most),
            re.compile(lines + rb"{1," + most),
        )

    def take_run(self, data: bytes, at: int, stated: bool) -> tuple[Run, int] | None:
        """Take a run, if one begins here.

        Parameters
        ----------
        data : bytes
            Whole lines.
        at : int
            Begin of one of them.
        stated : bool
            The motion in force is no feed move, so the first line has to state one.
        """
        match = (self.run_stated if stated else self.run).match(data, at)
        if match is None:
            return None
        end = match.end()
        while more := self.run_on.match(data, end):
            end = more.end()
        text = data[at:end]
        lines = text.count(b"\n")
        most = self.dialect.text.characters
        too_long = most and max(map(len, text.split(b"\n"))) > most
        if too_long or is_one_number(text, self.dialect):
            return None
        text = re.sub(rb"\([^()]*\)", b"", text) if b"(" in text else text
        last: dict[str, float] = {}
        whole = False
        for letter in AXES + "F":
            if (place := text.rfind(letter.encode())) >= 0:
                number = _WORD.match(text, place)
                assert number is not None
                last[letter] = float(number[2])
                whole = whole or (letter == "F" and b"." not in number[2])
        place = text.rfind(b"G")
        code = None if place < 0 else int(text[place + 1 : place + 3].lstrip(b"0")[:1]) * 10
        return Run(lines, last, whole, code), end

    def read(self, text: bytes, first: bool) -> Line:
        """Read one line.

        Parameters
        ----------
        text : bytes
            Without its line end.
        first : bool
            No block stands in front of it.
        """
        line = Line(blank=not text.strip())
        self._take(text, first, line)
        line.unread = b"" if line.understood else text.upper()
        return line

    def _take(self, text: bytes, first: bool, line: Line) -> None:
        """Take what stands in one line."""
        rules = self.dialect.text
        if rules.klartext:
            said = read_statement(text, self.dialect)
            line.words, line.relative, line.deleted = said.words, said.relative, said.deleted
            line.effects, line.understood = said.effects, said.understood
            return
        line.understood = not self.is_lost(text)
        if not line.understood:
            return
        text = unsaid(text, self.dialect)
        beside = b"(" in text.partition(b";")[0]
        if self.comments is not None:
            text = self.comments.sub(b"\0", text)
        text = text.strip(b" \0" if rules.tight else b" \t\0")
        if text and self._misspelled(text, beside):
            line.understood = False
            return
        text = text.upper()
        if first and rules.leader and _FILE_NAME.fullmatch(text):
            return
        text = self._mark(text, line)
        if rules.checksum:
            text = _CHECKSUM.sub(b"", text)
        if self._no_words(text, line):
            return
        text = self._blanked(text, line)
        if line.flow is None:
            if rules.blanks == "anywhere":
                text = text.translate(None, _BLANKS)
            if "$" in self.dialect.letters and b"$" in text:
                line.words += [("$", float(n), False) for n in _SPINDLE.findall(text)]
                text = _SPINDLE.sub(b"\0", text)
            self._words(text.replace(b"\0", b" "), line)

    def is_lost(self, text: bytes) -> bool:
        """Whether a line is cut, or a comment of it is, or may be, a command."""
        runs_python = self.python is not None and self.python.search(text) is not None
        return runs_python or _runs(text, self.dialect) or is_cut(text, self.dialect)

    def _misspelled(self, text: bytes, beside: bool) -> bool:
        """Whether the control may see other words than stand here; `beside` parentheses."""
        rules = self.dialect.text
        return (
            (beside and rules.parentheses == "lone comment")
            or is_loose(text, self.dialect)
            or (not rules.numbered and _NUMBERED.match(text) is not None)
            or (rules.capitals and text != text.upper())
            or (not rules.padded and _PADDED.search(text) is not None)
        )

    def _mark(self, text: bytes, line: Line) -> bytes:
        """Take out the mark of block delete."""
        rules = self.dialect.text
        if b"/" in text and rules.delete != "none" and (mark := self.delete.match(text)):
            line.deleted = True
            return text[mark.end() :]
        return text

    def _no_words(self, text: bytes, line: Line) -> bool:
        """Take a line that is no block of words: ``%``, an O word, system data, another base."""
        rules = self.dialect.text
        if _PERCENT.match(text) and (rules.percent != "error" or text == b"%"):
            line.percent = True
            line.understood = text == b"%" or (rules.percent == "named" and b" " not in text)
            leader = rules.percent == "leader" and _LEADER.fullmatch(text)
            line.understood = line.understood or bool(leader)
            if rules.variables == "Q" and (unit := _HEAD_WITH_UNIT.fullmatch(text)):
                line.understood, line.words = True, [("G", float(unit[1]), True)]
        elif rules.o_word != "error" and (match := _O_WORD.match(text)):
            line.flow = match[2].decode()
        elif is_one_number(text, self.dialect) or is_too_much(text, self.dialect):
            line.understood = False
        elif rules.names and "$" in self.dialect.names and _SYSTEM_DATA.match(text):
            line.effects.append("written")
            line.frame = written_frame(text)
        else:
            return False
        return True

    def _blanked(self, text: bytes, line: Line) -> bytes:
        """Take out names, and put a mark in the place of what is computed."""
        rules = self.dialect.text
        if self.dialect.limits:
            text, line.limits = take_limits(text, self.dialect)
            if line.limits and not self.dialect.one_command:
                line.effects.append("limit")
        if rules.strings:
            text = _STRING.sub(rb"\1#", text)
        if rules.names:
            text = self._names(text, line)
        elif rules.keywords and any(word.encode() in text for word in rules.keywords):
            line.flow = "JUMP"
            return b""
        if rules.variables == "#" and (b"#" in text or b"[" in text):
            text = self._expressions(text, line)
        elif rules.variables == "R" and b"=" in text:
            text = _PARAMETER.sub(b" ", text)
            text = re.sub(rb"([A-Z])=(?=[-+]?[0-9.]+(?:[ \t]|$))", rb"\1", text)
        return text

    @staticmethod
    def _words(text: bytes, line: Line) -> None:
        """Split what is left into words; blanks that were comments separate them."""
        at, size = 0, len(text)
        while at < size and text[at] in _BLANKS:
            at += 1
        while at < size:
            match = _WORD.match(text, at)
            if match is None:
                line.understood = False
                return
            number = match[2]
            value = NAN if number.endswith(b"#") else float(number)
            line.words.append((match[1].decode(), value, b"." not in number))
            at = match.end()

    def _expressions(self, text: bytes, line: Line) -> bytes:
        """Put ``#`` in the place of everything that is computed."""
        targets = _TARGET.findall(text)
        rules = self.dialect.arithmetic
        numbers = [int(t) for t in targets if t.isdigit()]
        for target, value in _SETTINGS.findall(text) if rules.overrides else ():
            if target.decode() == rules.overrides:
                line.switched = float(value) if value else NAN
        line.offsets = bool(rules.offsets) and (
            any(n >= rules.offsets and n not in rules.timers for n in numbers)
            or _COMPUTED.match(text) is not None
        )
        for _ in range(len(text)):
            text, count = _INNERMOST.subn(b"#0", text)
            text, calls = _CALL.subn(b"#0", text) if b"[" not in text else (text, 0)
            if not count + calls:
                break
        if b"=" in text and not self.dialect.text.open_expressions and not line.offsets:
            text = _SETTING.sub(b"\0", text.translate(None, _BLANKS))
            line.understood = b"=" not in text
            return _VARIABLE.sub(b"#", text) if line.understood else b""
        if b"=" in text:
            # Values of a line are read before any is set: what follows an = belongs to it.
            line.understood = assigns_alone(text) and text.count(b"=") == len(targets)
            return b""
        return _VARIABLE.sub(b"#", text)

    def _names(self, text: bytes, line: Line) -> bytes:
        """Take out words that have names."""
        if self.dialect.names.get("DEF") == "declaration" and (match := _DEF.match(text)):
            rest = re.sub(rb'"[^"]*"', b"", text[match.end() :])
            self.declared |= set(_DECLARED.findall(rest))
            return b""
        for name in self.declared if b"=" in text else ():
            if name in text:
                text = re.sub(_assignment(name), b" ", text)

        def take(match: re.Match[bytes]) -> bytes:
            effect = self.dialect.names.get(match[1].decode(), "flow")
            if effect == "feed group":
                line.group = (match[2] or b"").strip(b"() \t") != b""
            if effect == "cycle":
                line.cycle = match[1].decode(), match[2] or b""
            if effect == "smoothing":
                first = (match[2] or b"").strip(b"() \t").split(b",")[0]
                line.smoothed = first.strip(b" \t0.") != b""
            if effect == "swivel":
                line.swivelled = (match[2] or b"").strip(b"() \t") != b""
            if effect != "none":
                line.effects.append(effect)
            return b" "

        if self.dialect.one_command:
            if (match := _NAME.match(text)) is None:
                return text
            take(match)
            return b""
        return _NAME.sub(take, text)


def _runs(text: bytes, dialect: Dialect) -> bool:
    """Whether a comment of a line begins with a word and a comma, and is no text to be shown."""
    words = re.findall(rb"\([ \t]*([A-Za-z_]+)[ \t]*,", text) if dialect.text.live_comments else []
    return any(word.upper() not in (b"MSG", b"PRINT", b"DEBUG") for word in words)


def _assignment(name: bytes) -> bytes:
    """Pattern of what sets a variable."""
    return rb"(?<![A-Z0-9_$])" + name + rb"[ \t]*(?:\[[^\]]*\])?[ \t]*=[ \t]*[^ \t;]*"


def pieces(file: BinaryIO) -> Iterator[bytes]:
    """Whole lines of a file, some MB at a time; the last may lack its end."""
    rest = b""
    while piece := file.read(PIECE):
        cut = piece.rfind(b"\n") + 1
        if cut:
            yield rest + piece[:cut]
            rest = piece[cut:]
        else:
            rest += piece
    if rest:
        yield rest
