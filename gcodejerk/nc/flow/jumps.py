"""Jumps within a program: ``IF [..] GOTO 100``, ``WHILE``, ``GOTOF LABEL``, ``M99 P``.

Rule: jumps are not followed. Wherever one may lead to, nothing is known, so that what is known
behind such a place is what the code behind it states, and holds on every pass. A line that jumps
only under a condition, and goes on, leaves what is known as it was.
"""

from __future__ import annotations

from gcodejerk.nc.dialects.dialect import Dialect
from gcodejerk.nc.interpreter.flow_words import GOTO
from gcodejerk.nc.text.block import Block

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
    returns = any(w.letter == "M" and w.value in (46, 96, 99) for w in block.words)
    if returns and "P" in words:
        jumps = True
        value = words["P"]
        found |= EVERYWHERE if value is None else {int(value)}
    for name in block.names:
        text = name.name.encode() + b" " + name.arguments
        if name.name not in _JUMP_NAMES and not (name.name == "IF" and GOTO.search(text)):
            continue
        jumps = True
        for target in GOTO.findall(text):
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
