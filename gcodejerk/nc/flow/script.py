"""A program as a list of lines, with what each line of flow does: where it goes on, and when.

Both languages of flow (`macro_b`, `names`) are written down in these terms, and `following` runs
them.

Rule: a jump leads to a line that is known and that the control would find for certain; one into a
structure from outside, to a number that stands twice, or to nowhere, is `LOST`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from gcodejerk.nc.text.block import Line

LOST = -1
"""A target that nobody knows."""


@dataclass(frozen=True, slots=True)
class Op:
    """What a line of flow does; a line without one is a block, and the next line follows."""

    kind: Literal["jump", "computed", "set", "for", "endfor", "call", "return", "part", "restart"]
    condition: bytes | None = None
    """When; None: always. Of ``for`` and ``endfor``: the last value of the counter; of
    ``computed``: the number N to go to."""
    yes: int = LOST
    """Line that follows where the condition holds."""
    no: int = LOST
    """Line that follows where it does not."""
    name: str = ""
    """Of the counter, or of what is called; ``goto``: the jump is one to a label or number."""
    first: bytes = b""
    """First value of the counter."""
    arguments: tuple[tuple[str, bytes], ...] = ()
    """What a macro is given: name of the variable there, and what stands for it."""
    count: bytes = b"1"
    """How often a call or a part runs."""
    scoped: bool = True
    """What is called has variables of its own."""
    line: Line | None = None
    """Of ``set``: the assignments."""


@dataclass(slots=True)
class Unit:
    """A program or subprogram of the file: lines first:last."""

    first: int
    last: int
    name: str = ""
    main: bool = False
    runs: bool = True
    """It is a program at all, and not data."""
    parameters: tuple[tuple[str, str, bytes], ...] = ()
    """Name, type and default of what it is given."""
    followed: bool = True
    """It can be called from here: what it is given is understood."""
    saves: bool = False
    """It gives the modes of its caller back."""


@dataclass(slots=True)
class Script:
    """A file."""

    lines: list[Line]
    units: list[Unit] = field(default_factory=list)
    ops: dict[int, Op] = field(default_factory=dict)
    numbers: dict[tuple[int, int], int] = field(default_factory=dict)
    """First line of the unit, N -> its line; `LOST` where it stands twice."""
    _by_name: dict[str, Unit] = field(default_factory=dict)

    def called(self, name: str) -> Unit | None:
        """The subprogram of a name, if there is one and no more."""
        if not self._by_name:
            self._by_name = {unit.name: unit for unit in self.units if unit.name and not unit.main}
        return self._by_name.get(name)


@dataclass(slots=True)
class Structures:
    """Loops and branches around the lines of a unit."""

    around: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """Line -> lines that the structures around it begin in; a line that is not there has none."""
    open: list[tuple[str, str, int, int]] = field(default_factory=list)
    """Kind, name, first line, line of ``ELSE``."""

    def note(self, at: int) -> None:
        """Note what stands around a line."""
        if self.open:
            self.around[at] = tuple(begin for _, _, begin, _ in self.open)

    def reaches(self, source: int, target: int) -> bool:
        """Whether a jump leads into no structure that it does not come from."""
        inside, around = self.around.get(target, ()), self.around.get(source, ())
        return around[: len(inside)] == inside


def checked(ops: Mapping[int, Op], structures: Structures) -> dict[int, Op]:
    """Lose the jumps that lead into a structure from outside."""
    out = {}
    for at, op in ops.items():
        if op.name == "goto" and op.yes != LOST and not structures.reaches(at, op.yes):
            op = replace(op, yes=LOST)
        out[at] = op
    return out
