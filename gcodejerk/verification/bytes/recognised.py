"""Replacements whose lines are those of one that was read before, but for the numbers.

Reading a replacement line by line asks what each word would do. The answer depends on the words, on
the dialect, and on what the columns of the rapids say; where all of that is as it was, and only
numbers of axes and of F differ, the answer is known. This module owns when that is so: the block is
plain axis words, in the same order; every column of the rapid, but for its places, is the same; the
lines around the points are the same to the byte; and the points are spelled as the pattern of
`form` has it, which they have to match as ever.

Rule: what is not recognised is read line by line, as if this module were not there. What was
complained of is never learned.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from decimal import Decimal
from functools import lru_cache

from gcodejerk.nc import Dialect, Rapids
from gcodejerk.verification.bytes.allowed import feed_pattern
from gcodejerk.verification.bytes.form import COMMENT_LENGTH, LINE_ENDS, Stream, StreamReader
from gcodejerk.verification.bytes.source import Window
from gcodejerk.verification.bytes.states import States

MOST = 500
"""Forms that are remembered."""
LONGEST_BLOCK = 60
AHEAD = 1 << 15
"""Text in which the end of a stream is looked for. [bytes]"""
_BLOCK = re.compile(rb"(?:N[0-9]{1,9} ?)?(?:G0?0 ?)?((?:[XYZABCUVW]-?[0-9]{0,9}\.?[0-9]{0,12} ?)+)")
_AXIS = re.compile(rb"([XYZABCUVW])(-?(?:[0-9]{1,9}\.?[0-9]{0,12}|\.[0-9]{1,12}))(?= |[A-Z]|$)")
_PLACE = rb"([XYZABCUVW])(-?[0-9]{1,9}\.[0-9]{0,12})"
_USUAL = re.compile(rb"(G0?0) " + _PLACE + (rb"(?: " + _PLACE + rb")?") * 2)
"""The most usual block: G0 and up to three places, one blank between them."""
_NUMBERS = b"-.0123456789"
"""What stands behind each letter of a plain block, and nowhere else."""
_WORD = re.compile(rb"(?<=[NGXYZABCUVW0-9.])(?=[A-Z])| +")
_LEAD = re.compile(
    rb"(G[01]) ([XYZABCUVW])(-?[0-9]{1,9}\.?[0-9]{0,12})(?: (F)([0-9]{1,9}\.[0-9]{1,12}))?"
)
_END = re.compile(
    rb"(G[01](?: G[0-9]{1,3}(?:\.[0-9])?)?)((?: [XYZABCUVW]-?[0-9]{0,9}\.?[0-9]{0,12})+)"
    rb"(?: F([0-9]{1,9}\.[0-9]{1,12}))?"
)
_NUMBER = rb"(-?[0-9]{1,9}\.?[0-9]{0,12})"
_FEED = rb"([0-9]{1,9}\.[0-9]{1,12})"


@dataclass(frozen=True, slots=True)
class Plain:
    """A block of nothing but its number, G0 and axis words."""

    key: bytes
    """The block without its numbers."""
    head: bytes
    """The block without its axis words."""
    axes: tuple[tuple[bytes, bytes], ...]
    """Letters and numbers, as written."""
    comment: bytes
    """What names it, without the brackets."""
    text: bytes
    line_end: bytes

    @classmethod
    def of(cls, text: bytes, line_end: bytes) -> Plain | None:
        """Take a block apart; None where it is another."""
        if len(text) > LONGEST_BLOCK:
            return None
        if usual := _USUAL.fullmatch(text):
            code, *places = usual.groups()
            letters = [letter for letter in places[::2] if letter is not None]
            if len(set(letters)) < len(letters):
                return None
            named = tuple(zip(letters, places[1::2], strict=False))
            return cls(b"usual " + b"".join(letters), code + b" ", named, text, text, line_end)
        match = _BLOCK.fullmatch(text)
        if match is None:
            return None
        words = match[1]
        axes = _AXIS.findall(words)
        blanks = words.count(b" ")
        if len({letter for letter, _ in axes}) < len(axes):
            return None
        if len(axes) + sum(len(number) for _, number in axes) + blanks != len(words):
            return None
        head = text[: match.start(1)]
        return cls(
            text.translate(None, _NUMBERS) + bytes(b"." in number for _, number in axes),
            head + b" " * blanks,
            tuple(axes),
            b" ".join([*_words(head), *(letter + number for letter, number in axes)]),
            text,
            line_end,
        )


@lru_cache(maxsize=256)
def _words(head: bytes) -> list[bytes]:
    """The words in front of the axes, as a comment has them."""
    return _WORD.sub(b" ", head).split()


@dataclass(frozen=True, slots=True)
class _Form:
    """Lines of replacements, with holes where numbers stand."""

    commented: bool
    head: int
    """0 without the block's other words, 1 as they stand, 2 without blanks at the end."""
    pattern: re.Pattern[bytes]
    """Of all behind these."""
    letters: str
    lines: int
    """How many stand between these and the first number."""
    lead: tuple[tuple[str, ...], ...]
    """Letters of the numbers in each line in front of the points."""
    last: tuple[str, ...]
    """Letters of the axes in the last point."""
    fed: bool
    """F stands there."""
    limit: int
    """Longest line of points, if their pattern allows longer ones; else 0."""


class Recognised:
    """What was read before, and what is like it."""

    def __init__(self, window: Window, rapids: Rapids, dialect: Dialect, states: States) -> None:
        self.window, self.rapids, self.dialect = window, rapids, dialect
        self.forms: dict[tuple[bytes, bytes, bool], _Form] = {}
        self.states = states
        writing = dialect.writing
        self.comment = (b"", b"") if writing is None else writing.comment
        self.opens = self.comment[0] + b"gcodejerk: "
        self.usable = writing is not None

    def _key(self, i: int, plain: Plain, follows: bool) -> tuple[bytes, bytes, bool]:
        """What the form of a replacement depends on, but for its own text."""
        return self.states.state(i), plain.key, follows

    def plain(self, i: int, text: bytes) -> Plain | None:
        """The block of a rapid, if it is one that this module knows about."""
        line_end = LINE_ENDS[int(self.rapids.terminator[i])]
        if not self.usable or not line_end.endswith(b"\n"):
            return None
        plain = Plain.of(text, line_end)
        if plain is None:
            return None
        turned = self.dialect.increments
        if turned and any(letter.decode() in turned for letter, _ in plain.axes):
            return None
        if self._points_needed and not all(b"." in number for _, number in plain.axes):
            return None
        return plain

    def read(self, i: int, plain: Plain, follows: bool) -> Stream | None:
        """Read a replacement; None, with nothing passed, where it is not recognised."""
        form = self.forms.get(self._key(i, plain, follows))
        if form is None:
            return None
        window, line_end = self.window, plain.line_end
        have = window.fill(AHEAD)
        data, at = window.data, window.at
        if data.startswith(plain.text, at):
            return None
        opening = b""
        if form.commented:
            opening = self.opens + plain.comment + self.comment[1]
            if len(opening) > COMMENT_LENGTH:
                return None
            opening += line_end
        if form.head:
            opening += (plain.head if form.head == 1 else plain.head.rstrip()) + line_end
        if not data.startswith(opening, at):
            return None
        match = form.pattern.match(data, at + len(opening), at + have)
        if match is None:
            return None
        groups = match.groups()
        lead, k = [], 0
        for letters in form.lead:
            lead.append({a: Decimal(groups[k + j].decode()) for j, a in enumerate(letters)})
            k += len(letters)
        text, numbers = groups[k], groups[k + 1 :]
        if form.limit and max(map(len, text.splitlines())) > form.limit:
            return None
        rest = {a: Decimal(n.decode()) for a, n in zip(form.last, numbers, strict=False)}
        if form.fed:
            rest["F"] = Decimal(numbers[len(form.last)].decode())
        own = [number for _, number in plain.axes]
        line = window.line + form.commented + bool(form.head) + form.lines
        ends = list(numbers[: len(own)]) == own and not self.rapids.incremental[i]
        stream = Stream(i, int(self.rapids.line[i]), line, form.letters, text, [rest], lead)
        window.skip(match.end() - at)
        stream.own_end = ends
        return stream

    def learn(
        self, reader: StreamReader, stream: Stream, plain: Plain, follows: bool, text: bytes
    ) -> None:
        """Remember the form of a replacement that was read without complaint.

        Parameters
        ----------
        reader : StreamReader
            It has read it.
        stream : Stream
            What it read.
        plain : Plain
            The block.
        follows : bool
            As for `read`.
        text : bytes
            All of the replacement.
        """
        form = self._form(reader, stream, plain, text)
        if form is None:
            return
        if len(self.forms) >= MOST:
            self.forms.clear()
        self.forms[self._key(stream.rapid, plain, follows)] = form

    # Complex: each line asks for one more thing that a simple form has.
    def _form(
        self, reader: StreamReader, stream: Stream, plain: Plain, text: bytes
    ) -> _Form | None:
        """Make holes where the numbers stand."""
        end = reader.line_end
        points = stream.text
        if not stream.rest:
            # The last point is spelled as the others are.
            points = points[: points.rstrip(b"\r\n").rfind(b"\n") + 1]
        words = [w.letter for w in reader.block.words if w.letter not in "NG"]
        simple = words == [a.decode() for a, _ in plain.axes] and not reader.block.comments
        if not simple or not points or len(stream.rest) > 1 or text.count(points) != 1:
            return None
        before, _, behind = text.partition(points)
        front, back = before.split(end)[:-1], behind.split(end)[:-1]
        opened = self._opened(front, plain)
        if opened is None:
            return None
        commented, head, front = opened
        cut = len(front) - len(stream.lead)
        setup = front[:cut]
        lead = [found for line in front[cut:] if (found := _LEAD.fullmatch(line))]
        last = _END.fullmatch(back[0]) if back else None
        if last is None or len(lead) < len(front) - cut or any(b"gcodejerk" in x for x in setup):
            return None
        letters = [word[:1] for word in last[2].split()]
        moving = set(stream.letters).union(*stream.lead) - {"F"}
        if letters != [a for a, _ in plain.axes] or not moving <= set(words):
            return None
        run = reader.run(stream.letters).pattern
        widest = 25 * len(stream.letters) + 40
        return _Form(
            commented,
            head,
            self._pattern(setup, lead, run, last, back[1:], end),
            stream.letters,
            len(setup),
            tuple((one[2].decode(), *("F" if one[4] else "")) for one in lead),
            tuple(letter.decode() for letter in letters),
            bool(last[3]),
            0 if reader.allowed.limit >= widest else reader.allowed.limit,
        )

    def _opened(self, front: list[bytes], plain: Plain) -> tuple[bool, int, list[bytes]] | None:
        """Whether a comment names the block, how its head stands, and the lines behind these."""
        commented = front[:1] == [self.opens + plain.comment + self.comment[1]]
        front = front[commented:]
        if plain.head.strip() in (b"", b"G0", b"G00"):
            return commented, 0, front
        head = 1 if front[:1] == [plain.head] else 2
        if front[:1] != [plain.head if head == 1 else plain.head.rstrip()]:
            return None
        return commented, head, front[1:]

    def _pattern(
        self,
        setup: list[bytes],
        lead: list[re.Match[bytes]],
        run: bytes,
        last: re.Match[bytes],
        behind: list[bytes],
        end: bytes,
    ) -> re.Pattern[bytes]:
        """The lines of a replacement, with holes for its numbers."""
        number = _NUMBER.replace(rb"\.?", rb"\.") if self._points_needed else _NUMBER
        pattern = b"".join(re.escape(line + end) for line in setup)
        for one in lead:
            pattern += re.escape(one[1] + b" " + one[2]) + _NUMBER
            pattern += (b" F" + _FEED if one[4] else b"") + re.escape(end)
        pattern += rb"(" + run + rb")" + re.escape(last[1])
        pattern += b"".join(b" " + word[:1] + number for word in last[2].split())
        feed = b" F(" + feed_pattern(self.dialect) + b")"
        pattern += (feed if last[3] else b"") + re.escape(end)
        pattern += b"".join(re.escape(line + end) for line in behind)
        return re.compile(pattern)

    @property
    def _points_needed(self) -> bool:
        """Whether every number has to have its decimal point."""
        return self.dialect.whole_numbers == "machine"
