"""Runs of lines whose numbers are computed: spelled with these numbers, they are plain lines.

In a program by variables hardly a line is plain, but most say no more than plain ones do:
``G0 X[#2+#1]``. This module owns which lines these are, what is put in the place of the variables,
and that a run of them is taken as `runs` takes plain ones. Lines that set variables of the program,
and say nothing else, are lines without words.

Of thousands of such lines most differ in typed numbers alone: ``G0 X[1.5*#10+#6]``. They have the
same shape, and what is known of one is known of all.

Rule: what is spelled says what `execute` would make of the line. Where a number is not certain, or
a line says anything more, the run ends in front of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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
_TYPED = re.compile(rb"((?<=[\[+\-*/])(?:[0-9]{1,8}(?:\.[0-9]*)?|\.[0-9]+)|(?<=^N)[0-9]{1,8})")
"""Numbers that lines of one shape may differ in: of expressions, behind a sign, and of a line. None
of them says which variable is meant; of more digits, the first ones."""
_SAYS_MORE = re.compile(rb"[(;<\0]")
"""Comments may be commands, and names are no numbers."""
REMEMBERED, LONGEST = 1 << 12, 120
"""Lines and shapes whose forms are remembered, and how long they are at most. [bytes]"""
MOST_TYPED = 32
"""Typed numbers of a line with a shape at most."""
_NAMES = [f"<\0{k}>" for k in range(MOST_TYPED)]
"""Typed numbers in a shape: as variables that no program can have."""


class Typed(NamedTuple):
    """A word of a shape with a typed number."""

    front: bytes
    number: int
    """Which of the typed numbers of the line."""


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """A line that a run may hold.

    Attributes
    ----------
    block : Block
        As written.
    words : tuple of bytes, Typed and Word
        As they are spelled: those with a number as they stand, others by what they compute.
    """

    block: Block
    words: tuple[bytes | Typed | Word, ...]

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


def typed_numbers(text: bytes, dialect: Dialect) -> tuple[bytes, list[bytes]]:
    """The shape of a line, and the typed numbers in which it differs from others of that shape.

    Lines of a shape are of one form: a control reads them alike, whatever the numbers. Where it
    may not, no number is taken out.
    """
    rules = dialect.text
    alike = rules.variables == "#" and not (
        rules.hexadecimal or rules.digits or rules.number_digits
    )
    if not alike or len(text) > rules.shortest or _SAYS_MORE.search(text):
        return text, []
    parts = _TYPED.split(text)
    return b"\0".join(parts[::2]), parts[1::2]


def shared_form(form: Form, count: int) -> Form | None:
    """The form of all lines of a shape, from that of one; None where that line has its own.

    Parameters
    ----------
    form : Form
        Of a line without assignments.
    count : int
        Its typed numbers.
    """
    words: list[bytes | Typed | Word] = []
    found = 0
    for word in form.words:
        assert not isinstance(word, Typed)
        parts = _TYPED.split(word if isinstance(word, bytes) else word.text)
        own = len(parts) // 2
        if found + own > MOST_TYPED:
            return None
        if isinstance(word, Word):
            parts[1::2] = [b"#" + name.encode() for name in _NAMES[found : found + own]]
            words.append(word._replace(text=b"".join(parts)))
        elif own == 1 and not parts[2]:
            words.append(Typed(parts[0], found))
        elif own:
            return None
        else:
            words.append(word)
        found += own
    return Form(form.block, tuple(words)) if found == count else None


class Forms:
    """What runs may make of the lines of a program, as it is remembered."""

    def __init__(self, dialect: Dialect, block_of: Callable[[bytes], Block]) -> None:
        self._dialect, self._block_of = dialect, block_of
        self._forms: dict[bytes, Form | None] = {}
        """Of lines, and of shapes."""
        self._unlike: set[bytes] = set()
        """Shapes of which every line has a form of its own."""

    def of(self, text: bytes) -> tuple[Form | None, list[bytes]]:
        """The form of a line, and the typed numbers that are put into it."""
        if text in self._forms:
            return self._forms[text], []
        shape, typed = typed_numbers(text, self._dialect)
        if typed and shape in self._forms:
            return self._forms[shape], typed
        form = form_of(self._block_of(text), self._dialect)
        if typed and shape not in self._unlike:
            shared = form and shared_form(form, len(typed))
            if form is None or shared is not None:
                self._remember(shape, shared)
                return shared, typed
            if len(self._unlike) >= REMEMBERED:
                self._unlike.clear()
            self._unlike.add(shape)
        self._remember(text, form)
        return form, []

    def set_apart(self, text: bytes) -> None:
        """Have a line run by itself, whatever its form."""
        self._remember(text, None)

    def _remember(self, said: bytes, form: Form | None) -> None:
        if len(said) > LONGEST:
            return
        if len(self._forms) >= REMEMBERED:
            self._forms.clear()
        self._forms[said] = form


class Computed:
    """Lines behind one another, with what they compute from the variables of a state.

    The state has the variables that are known behind the last of them. Of each line there are its
    form and, where that is shared, its typed numbers.
    """

    def __init__(
        self, lines: Sequence[tuple[Form, list[bytes]]], state: State, dialect: Dialect
    ) -> None:
        self._state, self._dialect, self._rules = state, dialect, dialect.arithmetic
        self._before = state.variables.copy()
        self._set: list[tuple[Block, list[float]]] = []
        self._spelled: list[bytes] = []
        inch = state.unit == MM_PER_INCH
        known = dict(state.variables)
        for form, typed in lines:
            block, values = form.block, list[float]()
            known.update(zip(_NAMES, map(float, typed), strict=False))
            spelled = []
            for word in form.words:
                if isinstance(word, Word):
                    spelled.append(self._spell(word, known, inch))
                elif isinstance(word, Typed):
                    spelled.append(word.front + typed[word.number])
                else:
                    spelled.append(word)
            if not all(spelled):
                break
            if block.assigns:
                values = assigned_values(block, state, self._rules)
                assign(block, values, state, self._rules)
                known = dict(state.variables)
            self._set.append((block, values))
            self._spelled.append(b" ".join(spelled))

    def _spell(self, word: Word, known: Mapping[str, float], inch: bool) -> bytes:
        """A word with its number; empty where that is not certain."""
        value = word_value(word, known, self._rules, inch)
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
