"""Blocks of a LinuxCNC subprogram as they run outside of it: its own variables as numbers.

Rule 1: a block that names no variable of the subprogram stays as it is written; any other is
written with the numbers, to the last digit that a double has.
Rule 2: what would set a variable of the subprogram's own is left out: outside, another one has its
name.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from gcodejerk.nc.dialects.arithmetic import Arithmetic
from gcodejerk.nc.interpreter.expressions import evaluate, variable_name
from gcodejerk.nc.interpreter.variables import is_local, number_text
from gcodejerk.nc.text.block import Line
from gcodejerk.unrolling.pieces import LeftAloneError

_VARIABLE = re.compile(rb"#[ \t]*(?:([0-9][0-9 \t]*)|(<[^<>]*>)|([#\[]))")
_SHOWS = re.compile(rb"[(;][ \t]*(?:PRINT|DEBUG|LOG|ABORT)[ \t]*,", re.IGNORECASE)
_SHOWN = re.compile(rb"#(?:([0-9]+)|(<[^<>]*>))")


def _own(text: bytes, rules: Arithmetic) -> bool:
    """Whether an expression reads a variable of the subprogram's own, or one that is computed."""
    return any(
        computed or is_local(variable_name(number or name), rules)
        for number, name, computed in _VARIABLE.findall(text)
    )


def spelled(line: Line, variables: Mapping[str, float], rules: Arithmetic) -> bytes | None:
    """A block of a subprogram, to be run outside of it.

    Parameters
    ----------
    line : Line
        The block.
    variables : mapping of str to float
        Those that are known in front of it.
    rules : Arithmetic
        LinuxCNC's.

    Returns
    -------
    bytes or None
        Without a line end; None where nothing is left of it.

    Raises
    ------
    LeftAloneError
        A number is not known.
    """
    text, block = line.text, line.block
    comments = [text[begin:end] for begin, end in block.comments]
    code, at = b"", 0
    for begin, end in block.comments:
        code, at = code + text[at:begin] + b" ", end
    code += text[at:]
    shows = any(_SHOWS.match(comment) and b"#" in comment for comment in comments)
    if not shows and not _own(code, rules):
        return text

    def value_of(expression: bytes, own: bool = False) -> bytes:
        if not (own or _own(expression, rules)):
            return expression
        value = evaluate(expression, variables, rules)
        if value != value:
            raise LeftAloneError("a number in a subprogram is not known", line.number)
        return number_text(value)

    parts = []
    for word in block.words:
        plain = word.value is not None or not _own(word.text, rules)
        parts.append(word.text if plain else word.letter.encode() + value_of(word.text[1:]))
    for target, expression in zip(block.assigns, block.assigned, strict=True):
        name = variable_name(target.encode("latin-1"))
        if not target:
            raise LeftAloneError("a subprogram sets a variable that is computed", line.number)
        if is_local(name, rules):
            # Left out: where LinuxCNC would stop with an error, nothing would tell any more.
            value_of(expression, own=True)
        else:
            parts.append(b"#" + target.encode("latin-1") + b"=" + value_of(expression))
    parts += [_shown(comment, line, variables, rules) for comment in comments]
    if not parts:
        return None
    return (b"/" if block.block_delete else b"") + b" ".join(parts)


def _shown(comment: bytes, line: Line, variables: Mapping[str, float], rules: Arithmetic) -> bytes:
    """A comment, with what LinuxCNC would show of the subprogram's own variables."""
    if not _SHOWS.match(comment):
        return comment
    if b"%" in comment:
        raise LeftAloneError("a subprogram shows a formatted variable", line.number)

    def show(match: re.Match[bytes]) -> bytes:
        name = variable_name(match[1] or match[2])
        if not is_local(name, rules):
            return match[0]
        value = variables.get(name)
        if value is None:
            raise LeftAloneError("a subprogram shows a variable that is not known", line.number)
        return b"%f" % value

    return _SHOWN.sub(show, comment)
