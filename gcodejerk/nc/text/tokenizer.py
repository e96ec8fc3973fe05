"""The careful reading of one line: every byte is accounted for, and what cannot be is named.

Rule: it never raises. A line that the controller would refuse becomes a block with a `problem`,
its column, and the words in front of it.
"""

from __future__ import annotations

import re

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.text.block import Block, Word
from gcodejerk.nc.text.careful import CarefulLine
from gcodejerk.nc.text.cursor import SyntaxProblem
from gcodejerk.nc.text.klartext import parse_klartext
from gcodejerk.nc.text.spelled import check_comments, check_line, is_too_long

_PLAIN = re.compile(
    rb"(?:N[0-9]{1,8} ?)?(?:G[0-9]{1,3} ?)?(?:[XYZ]-?[0-9]{1,6}(?:\.[0-9]{0,8})? ?){1,3}"
)
"""What dialects without names and hexadecimal numbers read alike: most of a program."""
_PLAIN_WORD = re.compile(rb"([NGXYZ])(-?[0-9.]+)")


def parse_line(text: bytes, dialect: Dialect) -> Block:
    """Read one line without its line end.

    Parameters
    ----------
    text : bytes
        The line.
    dialect : Dialect
        How it is written.

    Returns
    -------
    Block
        With a `problem` where the controller would refuse the line.
    """
    rules = dialect.text
    text = rules.unsaid(text.rstrip(b"\r"))  # CR CR LF: a transfer in text mode made it of CR LF
    if rules.klartext:
        return parse_klartext(text, dialect)
    if not (rules.names or rules.hexadecimal or rules.digits) and _PLAIN.fullmatch(text):
        return Block(
            tuple(
                Word(m[1].decode(), float(m[2]), m.start(), m.end(), m[0], b"." not in m[2])
                for m in _PLAIN_WORD.finditer(text)
            )
        )
    return _parse_carefully(text, dialect)


def _parse_carefully(text: bytes, dialect: Dialect) -> Block:
    """The same word by word, whatever the line holds."""
    line = CarefulLine(text, dialect)
    problem, column, rest, mark = None, None, b"", 0
    rules = dialect.text
    try:
        if is_too_long(rules, text):
            line.skip()
            raise SyntaxProblem(f"line is longer than {rules.line_limit} bytes", rules.line_limit)
        check_line(rules, text)
        while line.skip():
            mark = line.at
            line.rest()
        mark = len(text)  # nothing is left that was not read as a word
        if line.words or line.names:
            check_comments(rules, text, line.comments)
        if line.words and line.words[0].letter == "N" and not rules.numbered:
            raise SyntaxProblem(
                "with a number of its own it may be no command: post the program without",
                line.words[0].begin,
            )
    except SyntaxProblem as found:
        problem, column, rest = found.problem, found.at + 1, line.unread(line.words, mark)
    return Block(
        tuple(line.words),
        tuple(line.comments),
        line.delete,
        line.o_word,
        line.o_name,
        line.percent,
        tuple(line.assigns),
        tuple(line.assigned),
        tuple(line.o_arguments),
        rest,
        problem,
        column,
        tuple(line.names),
    )
