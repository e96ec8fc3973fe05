"""Blocks of a macro or a subprogram of Siemens as they run outside of it: its variables as numbers.

Rule 1: a block that names no variable of the subprogram's own stays as it is written.
Rule 2: what would set such a variable, or declare it, is left out.
Rule 3: a number is written only where every control reads it as the same: axes with a decimal
point, codes and counts as whole numbers.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.expressions import evaluate, variable_name
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.nc.interpreter.operations import VACANT
from gcodejerk.nc.interpreter.variables import is_local, named_assignment, number_text, word_value
from gcodejerk.nc.text.block import Line, Word
from gcodejerk.units import MM_PER_INCH
from gcodejerk.unrolling.pieces import LeftAloneError

_HASH = re.compile(rb"#[ \t]*(?:([0-9]+)|[#\[])")
_NAME = re.compile(rb"(?<![A-Za-z0-9_$])[A-Za-z_][A-Za-z_][A-Za-z0-9_]*")
_WHOLE = frozenset("GMTHDNOSPL")
_POINTED = frozenset("XYZABCUVWIJKRFQ")
_DECIMALS = 6
_DWELL = 40
"""G4."""


def worded(line: Line, state: State, dialect: Dialect, declared: Mapping[str, str]) -> bytes | None:
    """A block of a subprogram, to be run outside of it.

    Parameters
    ----------
    line : Line
        The block.
    state : State
        In force in front of it.
    dialect : Dialect
        Its language.
    declared : mapping of str to str
        Variables of the subprogram that have names.

    Returns
    -------
    bytes or None
        Without a line end; None where nothing is left of it.

    Raises
    ------
    LeftAloneError
        A number is not known, or not one that is the same in every spelling.
    """
    text, block, rules = line.text, line.block, dialect.arithmetic
    if any(name.name == "DEF" for name in block.names):
        return None
    comments = [text[begin:end] for begin, end in block.comments]
    code, at = b"", 0
    for begin, end in block.comments:
        code, at = code + text[at:begin] + b" ", end
    code += text[at:]

    def own(part: bytes) -> bool:
        if rules.brackets == "()":
            return any(name.decode("latin-1").upper() in declared for name in _NAME.findall(part))
        return any(
            not number or is_local(str(int(number)), rules) for number in _HASH.findall(part)
        )

    if not own(code):
        return text
    if block.block_delete:
        raise LeftAloneError("the operator may skip a line of a macro", line.number)
    parts, inch = [], state.unit == MM_PER_INCH
    counted = _counted(line, state, dialect)
    for word in block.words:
        if word.value is not None:
            parts.append(word.text)
            continue
        value = word_value(word, state.variables, rules, inch)
        number = _word(word, value, line, dialect, counted if own(word.text) else "")
        parts.append(number if own(word.text) else word.text)
    for target, expression in zip(block.assigns, block.assigned, strict=True):
        name = variable_name(target.encode("latin-1"))
        if not target:
            raise LeftAloneError("a subprogram sets a variable that is computed", line.number)
        if is_local(name, rules):
            continue
        prefix = (b"" if rules.brackets == "()" else b"#") + target.encode("latin-1") + b"="
        if own(expression):
            expression = _short(evaluate(expression, state.variables, rules), line)
        parts.append(prefix + expression)
    for each in block.names:
        found = named_assignment(each)
        if found is None or found[0].partition("[")[0] not in declared:
            raise LeftAloneError("a line of a subprogram hangs on its variables", line.number)
    parts += comments
    if not parts:
        return None
    return b" ".join(parts)


def _short(value: float, line: Line) -> bytes:
    """A number with few decimals, which every control holds as it is written."""
    if value != value or value == VACANT or round(value, _DECIMALS) != value:
        raise LeftAloneError("a number in a subprogram is not known to its last digit", line.number)
    return number_text(value)


def _counted(line: Line, state: State, dialect: Dialect) -> str:
    """Letters whose numbers are no lengths in a block, and are read by how they are written.

    Haas takes P with a decimal point for seconds, and a K with one is an error on a Fanuc.
    """
    codes = {round(w.value * 10) for w in line.block.words if w.letter == "G" and w.value}
    if state.cycle is not None or codes & dialect.cycles:
        return dialect.drilling.repeats + "P"
    return "P" if _DWELL in codes else ""


def _word(word: Word, value: float, line: Line, dialect: Dialect, counted: str) -> bytes:
    """A word with its number."""
    letter = word.letter
    pointed = letter in _POINTED or letter in dialect.increments
    if letter in counted or not (pointed or letter in _WHOLE):
        raise LeftAloneError(f"what a computed {letter} means is not certain here", line.number)
    number = _short(value, line)
    if not pointed and b"." in number:
        raise LeftAloneError(f"{letter} is no whole number", line.number)
    if b"=" in word.text:
        head = word.text.partition(b"=")[0] + b"="
        return head + (word.function.encode() + b"(" + number + b")" if word.function else number)
    return letter.encode() + (number if b"." in number or not pointed else number + b".")
