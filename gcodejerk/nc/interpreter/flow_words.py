"""Flow words of a block: what one may have changed where the program simply goes on behind it."""

from __future__ import annotations

import re

from gcodejerk.nc.interpreter.expressions import variable_name
from gcodejerk.nc.text.block import Name

GOTO = re.compile(
    rb"GOTO[BFCS]?[ \t]*(N?[ \t]*[0-9]+(?![0-9.])|[A-Z_][A-Z_][A-Z0-9_]*|)", re.IGNORECASE
)
_THEN = re.compile(rb"THEN(.*)", re.IGNORECASE)
_TARGET = re.compile(rb"(#[ \t]*[0-9]+[ \t]*=)|(#[^=]*=)")
_SILENT = frozenset({"SETVN", "POPEN", "PCLOS", "DPRNT", "BPRNT"})
"""They write to somewhere else."""


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
    return [] if GOTO.search(name.arguments) else None
