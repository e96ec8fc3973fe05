"""Runs of lines whose numbers are computed: spelled with these numbers, they are plain lines.

In a program by variables hardly a line is plain, but most say no more than plain ones do:
``G0 X[#2+#1]``. This module owns which lines these are, what is put in the place of the variables,
and that a run of them is taken as `runs` takes plain ones. Lines that set variables of the program,
and say nothing else, are lines without words.

Rule: what is spelled says what `execute` would make of the line. Where a number is not certain, or
a line says anything more, the run ends in front of it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.variables import (
    assign,
    assigned_values,
    is_own,
    number_text,
    reads_feed,
    word_value,
)
from gcodejerk.nc.text.block import Block, Word
from gcodejerk.nc.text.lexer import read_lines
from gcodejerk.nc.text.words import BIT, Lines
from gcodejerk.units import MM_PER_INCH

_NUMBER = re.compile(rb"[A-Za-z][-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_EXPRESSION = re.compile(rb"[A-Za-z][ \t]*[-+=#\[(]")
_NO_NUMBER = frozenset("GMN")
"""Words whose number says what they are."""


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """A line that a run may hold.

    Attributes
    ----------
    block : Block
        As written.
    words : tuple of bytes and of Word
        As they are spelled: those with a number as they stand, others by what they compute.
    """

    block: Block
    words: tuple[bytes | Word, ...]

    @property
    def computes(self) -> bool:
        """Whether it is no plain line."""
        return bool(self.block.assigns) or any(isinstance(word, Word) for word in self.words)


def form_of(block: Block, dialect: Dialect) -> Form | None:
    """What a run may make of a line; None where it has to be run by itself."""
    rules = dialect.arithmetic
    more = block.names or block.block_delete or block.percent or block.o_word is not None
    if block.problem is not None or more or reads_feed(block, rules):
        return None
    if block.assigns and not all(word.letter == "N" for word in block.words):
        return None
    if not all(is_own(target, rules) for target in block.assigns):
        return None
    words: list[bytes | Word] = []
    for word in block.words:
        if word.value is not None:
            if not _NUMBER.fullmatch(word.text):
                return None
            words.append(word.text)
        elif (
            word.letter not in BIT
            or word.letter in _NO_NUMBER
            or word.letter in dialect.calls
            or word.function
            or not _EXPRESSION.match(word.text)
        ):
            return None
        else:
            words.append(word)
    return Form(block, tuple(words))


class Computed:
    """Lines behind one another, with what they compute from the variables of a state.

    The state has the variables that are known behind the last of them.
    """

    def __init__(self, forms: Sequence[Form], state: State, dialect: Dialect) -> None:
        self._state, self._dialect, self._rules = state, dialect, dialect.arithmetic
        self._before = state.variables.copy()
        self._set: list[tuple[Block, list[float]]] = []
        self._spelled: list[bytes] = []
        inch = state.unit == MM_PER_INCH
        for form in forms:
            block, values = form.block, list[float]()
            spelled = [
                word if isinstance(word, bytes) else self._spell(word, inch) for word in form.words
            ]
            if not all(spelled):
                break
            if block.assigns:
                values = assigned_values(block, state, self._rules)
                assign(block, values, state, self._rules)
            self._set.append((block, values))
            self._spelled.append(b" ".join(spelled))

    def _spell(self, word: Word, inch: bool) -> bytes:
        """A word with its number; empty where that is not certain."""
        value = word_value(word, self._state.variables, self._rules, inch)
        if value != value:
            return b""
        number = number_text(value)
        # Without its point it may be another one.
        return word.letter.encode() + (number if b"." in number else number + b".")

    def __len__(self) -> int:
        return len(self._spelled)

    def lines(self, of: Lines, first: int) -> Lines:
        """These lines as plain ones, in the places of those from `first` on."""
        own = slice(first, first + len(self))
        lines = read_lines(b"\n".join([*self._spelled, b""]), self._dialect)
        place = {name: getattr(of, name)[own] for name in ("begin", "end", "terminator")}
        return replace(lines, **place)

    def take_back(self, stop: int) -> None:
        """Set the variables to what they are in front of one of the lines."""
        if stop < len(self):
            self._state.variables = self._before.copy()
            for block, values in self._set[:stop]:
                assign(block, values, self._state, self._rules)
