"""Jumps within a program: ``IF [..] GOTO 100``, ``WHILE``, ``GOTOF LABEL``, ``M99 P``.

Rule: jumps are not followed. Wherever one may lead to, nothing is known, so that what is known
behind such a place is what the code behind it states, and holds on every pass. A line that jumps
only under a condition, and goes on, leaves what is known as it was.
"""

from __future__ import annotations

import re

from gcodejerk.nc.block import Block, Name
from gcodejerk.nc.dialect import Dialect
from gcodejerk.nc.expressions import variable_name

_GOTO = re.compile(
    rb"GOTO[BFCS]?[ \t]*(N?[ \t]*[0-9]+(?![0-9.])|[A-Z_][A-Z_][A-Z0-9_]*|)", re.IGNORECASE
)
_THEN = re.compile(rb"THEN(.*)", re.IGNORECASE)
_TARGET = re.compile(rb"(#[ \t]*[0-9]+[ \t]*=)|(#[^=]*=)")
_SILENT = frozenset({"SETVN", "POPEN", "PCLOS", "DPRNT", "BPRNT"})
"""They write to somewhere else."""
_JUMP_NAMES = frozenset({"GOTO", "GOTOF", "GOTOB", "GOTOC", "GOTOS", "CASE", "REPEAT", "REPEATB"})
EVERYWHERE = frozenset({-1})
"""Targets of jumps that are computed: every line with a number."""


def jumps_of(block: Block, dialect: Dialect) -> frozenset[int] | None:
    """Numbers N that a line may jump to.

    Returns
    -------
    frozenset of int or None
        Empty where it jumps to labels; None where it jumps nowhere.
    """
    found: set[int] = set()
    jumps = False
    words = {word.letter: word.value for word in block.words}
    returns = any(w.letter == "M" and w.value in (96, 99) for w in block.words)
    if returns and "P" in words:
        jumps = True
        value = words["P"]
        found |= EVERYWHERE if value is None else {int(value)}
    for name in block.names:
        text = name.name.encode() + b" " + name.arguments
        if name.name not in _JUMP_NAMES and not (name.name == "IF" and _GOTO.search(text)):
            continue
        jumps = True
        for target in _GOTO.findall(text):
            number = target.upper().lstrip(b"N").strip()
            if number.isdigit():
                found.add(int(number))
            elif not target or not dialect.text.names:
                found |= EVERYWHERE
    return frozenset(found) if jumps else None


def is_target(block: Block, targets: frozenset[int]) -> bool:
    """Whether a jump may lead to this line."""
    for word in block.words:
        if word.letter == "N":
            return targets >= EVERYWHERE or word.value in targets
    return any(not name.name for name in block.names)


def known_behind(name: Name) -> list[str] | None:
    """List the variables that a flow word may have changed; None where anything may have.

    A condition without anything else than a jump changes nothing.
    """
    if not name.name or name.name in _SILENT or name.name == "CASE":
        return []
    if name.name != "IF":
        return None
    if then := _THEN.search(name.arguments):
        targets = _TARGET.findall(then[1])
        if not targets or any(computed for _, computed in targets):
            return None
        return [variable_name(plain.strip(b"#= \t")) for plain, _ in targets]
    return [] if _GOTO.search(name.arguments) else None
