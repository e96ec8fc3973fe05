"""A cursor over one line that takes it word by word; what no word begins with is a problem.

This module owns what a word, a name, an assignment and a mark may look like; the grammar is
RS274/NGC's: words of a letter and a number without exponent, in any case. What differs between
dialects (comments, block delete, blanks within numbers, names, ``X=5``) is asked of `Dialect.text`.

Rule: what the controller would refuse raises `SyntaxProblem`; what was taken before it is kept.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.text.block import Name, Word
from gcodejerk.nc.text.cursor import (
    BLANKS,
    CLOSED_NUMBER,
    LARGEST,
    SHAPE,
    Cursor,
    SyntaxProblem,
    shown,
)
from gcodejerk.nc.text.joints import LIVE
from gcodejerk.nc.text.q_parameters import Called, iso_statement
from gcodejerk.nc.text.spelled import check_word, keyword_pattern

CHECKSUM = "*"
"""Name of a checksum among the names of a block."""
_WORD = re.compile(rb"([A-Za-z])[ \t]*([-+]?[0-9.]+)[ \t]*(?![-+0-9. \t#\[=])")
_IDENTIFIER = re.compile(rb"[A-Za-z_][A-Za-z_][A-Za-z0-9_]*")
_INDEX = re.compile(rb"[0-9]*")
_R_ELEMENT = re.compile(rb"R[ \t]*\[", re.IGNORECASE)
_L_CALL = re.compile(rb"(L[0-9]+)[ \t]*\(", re.IGNORECASE)
_FUNCTION = re.compile(rb"(IC|AC|DC|ACP|ACN)[ \t]*\(", re.IGNORECASE)
_SPINDLE = re.compile(rb"\$[ \t]*(-?[0-9]+)\.?(?![-+0-9. \t#\[]*[-+0-9.#\[])")
_TO_BLANK = re.compile(rb"[^ \t;]*")
_TO_COMMENT = re.compile(rb"[^;]*")
_CHECKSUM = re.compile(rb"\*[ \t]*[0-9]{1,3}[ \t]*(?:;.*)?")
_KEYWORD = re.compile(rb"[A-Za-z]*")
_ACTIVE = re.compile(rb"[ \t]*py[ \t]*,", re.IGNORECASE)
_BLOCK = re.compile(
    rb"[ \t]*(?:[A-Z][ \t]*[-+]?[0-9.]+[ \t]*)+(?:[;(].*)?|.*[#=\[].*", re.IGNORECASE
)
"""Text that a control may run: words, or an assignment."""
_STRING = re.compile(rb'"[^"]*"')
_LEADER = re.compile(
    rb"[ \t]*%[ \t]*(?:[O:][ \t]*[0-9]{1,8})?[ \t]*(?:\([^()]*(?:\)[ \t]*)?)*;?[ \t]*",
    re.IGNORECASE,
)
_HEXADECIMAL = re.compile(rb"[A-Z][ \t]*[-+]?0[Xx]", re.IGNORECASE)
_EXPONENT = re.compile(rb"[A-Z][ \t]*[-+]?[0-9.]+E", re.IGNORECASE)


class CarefulLine(Cursor):
    """A cursor over one line."""

    __slots__ = (
        *("comments", "delete", "dialect", "names", "o_arguments", "o_name", "o_word", "percent"),
        "words",
    )

    def __init__(self, text: bytes, dialect: Dialect) -> None:
        super().__init__(text, dialect.text)
        self.dialect = dialect
        self.words: list[Word] = []
        self.comments: list[tuple[int, int]] = []
        self.o_arguments: list[bytes] = []
        self.names: list[Name] = []
        self.o_word: str | None = None
        self.o_name = ""
        self.delete = False
        self.percent = False

    def comment(self) -> None:
        """Pass over the comment that begins here."""
        begin, text = self.at, self.text
        if text[begin] == 0x28:  # (
            end = text.find(b")", begin)
            strict = self.rules.parentheses in ("comment", "lone comment")
            if end < 0 and strict:
                raise SyntaxProblem("comment is not closed", begin)
            if strict and text.find(b"(", begin + 1, end) >= 0:
                raise SyntaxProblem("comment within a comment", text.find(b"(", begin + 1))
            self.at = end + 1 if end >= 0 else len(text)
        else:
            self.at = len(text)
        if self.rules.python and _ACTIVE.match(text, begin + 1):
            raise SyntaxProblem("comment runs Python", begin)
        if self.rules.live_comments and LIVE.match(text, begin):
            raise SyntaxProblem("comment may be a command", begin)
        self.comments.append((begin, self.at))

    def flow(self) -> None:
        """Pass over an O-word: its name, its keyword, and whatever belongs to that."""
        self.at += 1
        begin = self.at
        self.skip()
        self.operand()
        self.o_name = self.text[begin : self.at].replace(b" ", b"").decode("latin-1").lower()
        self.skip()
        match = _KEYWORD.match(self.text, self.at)
        assert match is not None
        self.o_word = match[0].decode().lower()
        self.at = match.end()
        if self.o_word and self.rules.o_word == "program":
            raise SyntaxProblem("text after the number of a program", match.start())
        while byte := self.skip():
            if byte in b"(;":
                self.comment()
            elif byte == b"[":
                begin = self.at
                self.bracket()
                self.o_arguments.append(self.text[begin : self.at])
            else:
                raise SyntaxProblem("text after an O-word", self.at)

    # Complex: called for every word that is read the slow way; its usual case makes no call.
    def word(self) -> None:
        """Take one word."""
        begin = self.at
        letter = self.text[begin : begin + 1].decode().upper()
        if letter == "N" and (self.words or self.comments or self.names):
            raise SyntaxProblem("N stands behind something else", begin)
        match = _WORD.match(self.text, begin)
        function = ""
        if self.rules.hexadecimal and _HEXADECIMAL.match(self.text, begin):
            raise SyntaxProblem("0X begins a hexadecimal number", self.at)
        if self.rules.exponents and _EXPONENT.match(self.text, begin):
            raise SyntaxProblem("E begins an exponent", self.at)
        if match and SHAPE.fullmatch(match[2]):  # the usual case, made quick
            self.at = match.end(2)
            value: float | None = float(match[2])
            if not -LARGEST <= value <= LARGEST:  # type: ignore[operator]
                raise SyntaxProblem(f"'{match[2].decode()}' is beyond any machine", begin + 1)
        else:
            self.at = begin + 1
            if self.rules.equals and self._equals(letter):
                if letter == "R" and self.rules.variables == "R":
                    self.assigns.append(self.text[begin : self.at].split(b"=")[0].decode().upper())
                    at = self.at
                    self._value()
                    self.assigned.append(self.text[at : self.at])
                    return
                function = self._function()
                value = self._value()
                if function:
                    self._close()
            else:
                value = self.number()
        if letter == "R" and self.rules.variables == "R":
            raise SyntaxProblem("a parameter without =", begin)
        if letter == "N" and (value is None or not self.text[begin + 1 :].lstrip()[:1].isdigit()):
            raise SyntaxProblem("N without a plain number", begin)
        text = self.text[begin : self.at]
        if self.rules.capitals or not self.rules.padded or self.rules.digits:
            check_word(self.rules, text, begin)
        whole = value is not None and b"." not in text
        self.words.append(Word(letter, value, begin, self.at, text, whole, function))

    def _equals(self, letter: str) -> bool:
        """Pass over an index and ``=``, where that stands here: the 1 of ``T1=5``."""
        match = _INDEX.match(self.text, self.at)
        assert match is not None
        after = BLANKS.match(self.text, match.end()).end()  # type: ignore[union-attr]
        if self.text[after : after + 1] != b"=":
            return False
        if match[0] and letter not in "TSMDHR" and self.rules.variables == "R":
            raise SyntaxProblem("axis with a number: not known here", self.at)
        self.at = after + 1
        self.skip()
        return True

    def _function(self) -> str:
        """Pass over ``IC(`` or its kin; which it is."""
        match = _FUNCTION.match(self.text, self.at)
        if not match:
            return ""
        self.at = match.end()
        self.skip()
        return match[1].decode().upper()

    def _value(self) -> float | None:
        """Read what follows ``=``: a number, or an expression."""
        if self.rules.variables == "R":
            begin = self.at
            self.named_expression()
            text = self.text[begin : self.at]
            if not SHAPE.fullmatch(text):
                return None
            self.at = begin
            return self.number()
        match = CLOSED_NUMBER.match(self.text, self.at)
        assert match is not None
        after = self.text[match.end() : match.end() + 1]
        ends = not after or after in b" \t;)" or after.isalpha()
        if ends and SHAPE.fullmatch(match[0]):
            return self.number()
        if self.rules.strings and (match := _STRING.match(self.text, self.at)):
            self.at = match.end()
            return None
        match = _TO_BLANK.match(self.text, self.at)
        assert match is not None
        if not match[0]:
            raise SyntaxProblem("a value is missing", self.at)
        self.at = match.end() - (match[0].endswith(b")") and match[0].count(b"(") == 0)
        return None

    def _close(self) -> None:
        if self.skip() != b")":
            raise SyntaxProblem("parenthesis is not closed", self.at)
        self.at += 1

    def name(self) -> bool:
        """Take a word with a name, if one stands here."""
        match = _IDENTIFIER.match(self.text, self.at)
        if not match:
            return False
        self.at = match.end()
        name, begin = match[0].decode().upper(), self.at
        if self.dialect.one_command:
            if any(word.letter != "N" for word in self.words):
                raise SyntaxProblem("a name behind a command is no command", match.start())
            self.at = len(self.text)  # all that follows belongs to the command
        elif self.dialect.names.get(name) in ("flow", "declaration") and self.skip() != b":":
            self.at = _TO_COMMENT.match(self.text, self.at).end()  # type: ignore[union-attr]
        elif self.skip() == b"(":
            self.pair()
        elif self.rules.variables == "R" and self.text[self.at : self.at + 1] == b"[":
            self._element()
        elif self.text[self.at : self.at + 1] == b"=":
            self.at += 1
            self.skip()
            if name == "CR":  # the radius of an arc
                value = self._value()
                text = self.text[match.start() : self.at]
                self.words.append(Word("R", value, match.start(), self.at, text))
                return True
            self._value()
        elif self.text[self.at : self.at + 1] == b":":
            self.at += 1
            self.names.append(Name("", match[0]))  # a label: a place that jumps may lead to
            return True
        else:
            self.at = begin
        self.names.append(Name(name, self.text[begin : self.at]))
        return True

    def _element(self) -> None:
        """Pass over ``[2]``, or ``[2]=...``."""
        self.pair()
        if self.skip() == b"=":
            self.at += 1
            self.skip()
            self._value()

    def _indexed_parameter(self) -> bool:
        """Pass over ``R[2]=...``, if it stands here; an index that is computed may be any."""
        match = _R_ELEMENT.match(self.text, self.at)
        if not match:
            return False
        self.at = match.end() - 1
        begin = self.at + 1
        self.pair()
        index = self.text[begin : self.at - 1].strip(b" \t")
        if self.skip() != b"=":
            raise SyntaxProblem("assignment without =", self.at)
        self.at += 1
        self.skip()
        self.assigns.append(f"R{int(index)}" if index.isdigit() else "")
        at = self.at
        self._value()
        self.assigned.append(self.text[at : self.at])
        return True

    def _numbered_call(self) -> bool:
        """Take ``L10(5,6)``, a call like that of a name, if it stands here."""
        match = _L_CALL.match(self.text, self.at)
        if not match:
            return False
        self.at = match.end() - 1
        begin = self.at
        self.pair()
        self.names.append(Name(match[1].decode().upper(), self.text[begin : self.at]))
        return True

    def _q_statement(self) -> bool:
        """Take ``Q5 = Q1 + 2``, ``D01 Q5 P01 +Q1 P02 +2`` or ``L1,2``, if one stands here."""
        end = _TO_COMMENT.match(self.text, self.at).end()  # type: ignore[union-attr]
        whole = self.text[self.at : end].rstrip(b" \t").removesuffix(self.rules.end)
        beside = any(word.letter != "N" for word in self.words) or bool(self.assigns)
        said = iso_statement(whole, beside=beside)
        if said is None:
            return False
        begin, self.at = self.at, self.at + said.length
        if isinstance(said, Called):
            self.words.append(Word("L", said.label, begin, self.at, whole[: said.length]))
        elif said.function is not None:
            self.names.append(Name(said.function, said.text))
        else:
            self.assigns.append(said.name)
            self.assigned.append(said.text)
        return True

    def keyword(self) -> bool:
        """Take a keyword of program flow and all that follows it, if one stands here."""
        pattern = keyword_pattern(self.rules.keywords)
        match = pattern.match(self.text, self.at) if pattern else None
        if not match:
            return False
        self.names.append(Name(match[1].decode().upper(), self.text[match.end() :]))
        self.at = len(self.text)
        return True

    def delete_mark(self) -> bool:
        """Pass over a ``/`` and its level, if it stands where the dialect has it."""
        where = self.rules.delete
        behind = any(word.letter != "N" for word in self.words) or self.names or self.comments
        if where == "none" or behind or self.delete or (where == "first" and self.words):
            return False
        self.at += 1
        self.delete = True
        level = self.text[self.at : self.at + 1]
        if where == "numbered" and level.isdigit():
            self.at += 1
        return True

    def percent_mark(self) -> None:
        """Take a ``%``, with a name where the dialect gives it one."""
        rules, text = self.rules, self.text
        if rules.percent == "error":
            raise SyntaxProblem("'%' has no meaning here", self.at)
        if rules.percent in ("lone", "leader"):
            leader = rules.percent == "leader" and _LEADER.fullmatch(text)
            if text.strip(b" \t") != b"%" and not leader:
                raise SyntaxProblem("text on the line of %", self.at + 1)
            self.at = len(text)
        elif any(word.letter != "N" for word in self.words):
            raise SyntaxProblem("% behind other words", self.at)
        else:
            self.at = _TO_BLANK.match(text, self.at).end()  # type: ignore[union-attr]
        self.percent = True

    def rest(self) -> None:
        """Take what stands here, until nothing is left."""
        rules = self.rules
        byte = self.text[self.at : self.at + 1]
        if byte.isalpha() or (byte == b"_" and rules.names):
            self._letter(byte)
        elif self._comment_begins(byte):
            self.comment()
        elif byte == b";" and rules.semicolon == "end":
            self._block_end()
        elif byte == b"#" and rules.variables == "#":
            self.assignment()
        elif byte == b"/" and self.delete_mark():
            pass
        elif byte == b"%":
            self.percent_mark()
        elif not self._rare(byte):
            raise SyntaxProblem(f"{shown(byte)} has no meaning here", self.at)

    def _letter(self, byte: bytes) -> None:
        """Take an O-word, a keyword, a word with a name, or a word."""
        rules = self.rules
        leads = all(word.letter == "N" for word in self.words) and not self.names
        if byte in b"Oo" and leads and rules.o_word != "error":
            self.flow()
        elif (rules.variables == "R" and (self._indexed_parameter() or self._numbered_call())) or (
            rules.variables == "Q" and self._q_statement()
        ):
            pass
        elif not (rules.keywords and self.keyword()) and not (rules.names and self.name()):
            self.word()

    def _comment_begins(self, byte: bytes) -> bool:
        """Whether a comment begins here."""
        rules = self.rules
        return (
            (byte == b"(" and rules.parentheses != "code")
            or (byte == b";" and rules.semicolon == "comment")
            or (rules.slashes and self.text.startswith(b"//", self.at))
        )

    def _block_end(self) -> None:
        """Pass over a ``;`` that ends the block, and over text behind it that is none."""
        if _BLOCK.fullmatch(self.text, self.at + 1):
            raise SyntaxProblem("another block behind the end of the block", self.at + 1)
        self.comments.append((self.at, len(self.text)))
        self.at = len(self.text)

    def _rare(self, byte: bytes) -> bool:
        """Take what few dialects have: system data, ``:1000``, a checksum, an end of block."""
        rules, text = self.rules, self.text
        if byte == b"$" and "$" in self.dialect.names:
            end = _TO_COMMENT.match(text, self.at).end()  # type: ignore[union-attr]
            self.names.append(Name("$", text[self.at : end]))
            self.at = end
        elif "$" in self.dialect.letters and (match := _SPINDLE.match(text, self.at)):
            self.words.append(Word("$", float(match[1]), self.at, match.end(), match[0]))
            self.at = match.end()
        elif byte == b":" and rules.o_word == "program" and not self.words:
            self.flow()
        elif rules.checksum and _CHECKSUM.fullmatch(text, self.at):
            self.names.append(Name(CHECKSUM, text[self.at :]))
            self.at = len(text)
        elif rules.end and text.startswith(rules.end, self.at):
            self.at += len(rules.end)
            if self.skip() not in (b"", b";"):
                raise SyntaxProblem("text behind the end of the block", self.at)
        else:
            return False
        return True
