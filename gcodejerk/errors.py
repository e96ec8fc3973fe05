"""Every exception of the package, and the place in a file that one is about.

Rule: an error message answers three questions, in this order: where (file:line:column), what is
wrong (with the offending value), and what to do about it. Whoever raises knows all three.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a file: its name, and line and column counted from 1 where they are known."""

    file: str
    line: int | None = None
    column: int | None = None
    text: str | None = None
    """The line itself, without its end; shown under the message with a caret."""

    def __str__(self) -> str:
        parts = (self.file, self.line, self.column)
        return ":".join(str(part) for part in parts if part is not None)


class GcodejerkError(Exception):
    """Something that the user can put right.

    Parameters
    ----------
    problem : str
        What is wrong, with the offending value.
    remedy : str, optional
        What to do about it.
    place : Place, optional
        Where it was found.
    """

    def __init__(self, problem: str, remedy: str | None = None, place: Place | None = None) -> None:
        super().__init__(problem)
        self.problem = problem
        self.remedy = remedy
        self.place = place

    def __str__(self) -> str:
        lines = [f"{self.place}: {self.problem}" if self.place else self.problem]
        if self.place is not None and self.place.text is not None:
            lines += _excerpt(self.place.text, self.place.column)
        if self.remedy:
            lines.append(f"  {self.remedy}")
        return "\n".join(lines)


class ProgramError(GcodejerkError):
    """The NC program cannot be read or must not be rewritten."""


class MachineError(GcodejerkError):
    """The machine file is wrong."""


class PlanError(GcodejerkError):
    """No profile can do what is asked for."""


class EmitError(GcodejerkError):
    """The plan cannot be written in the chosen form, or the output cannot be placed."""


class VerifyError(GcodejerkError):
    """What was written is not what was planned or not what the original says."""


def _excerpt(text: str, column: int | None, width: int = 76) -> list[str]:
    """The offending line and a caret below it, cut to a window around the column."""
    if column is not None and column > len(text) + 1:
        return []
    begin = 0
    if column is not None and column > width - 10:
        begin = column - width // 2
    window = text[begin : begin + width].expandtabs(1)
    shown = "".join(c if c.isprintable() else "?" for c in window)
    lines = [f"    {shown}"]
    if column is not None:
        lines.append(" " * (4 + column - 1 - begin) + "^")
    return lines
