"""What is wrong with a machine file: all of it at once, each problem at its place.

Rule: a file is read to its end before it is refused, so that one run shows everything there is to
put right. Only what makes the rest unreadable (no YAML, too large) ends the reading early.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from gcodejerk.errors import MachineError, Place

# A file that is no machine file at all (a 1 MiB table with colons) would give a hundred thousand
# messages; after this many nobody reads on.
MOST_PROBLEMS = 100


class MachineFileError(MachineError):
    """Everything that is wrong with one machine file.

    `problem`, `remedy` and `place` are those of the first problem in the file, `problems` has them
    all; the text lists them one after another.

    Parameters
    ----------
    problems : iterable of MachineError
        At least one.
    """

    def __init__(self, problems: Iterable[MachineError]) -> None:
        self.problems = tuple(sorted(problems, key=place_order))
        first = self.problems[0]
        super().__init__(first.problem, first.remedy, first.place)

    def __str__(self) -> str:
        return "\n".join(str(problem) for problem in self.problems)

    def __reduce__(self) -> tuple[type[MachineFileError], tuple[tuple[MachineError, ...]]]:
        # Errors cross process borders when many files are processed at once.
        return type(self), (self.problems,)


class Problems:
    """Collects problems while a file is read."""

    def __init__(self) -> None:
        self.found: list[MachineError] = []

    def add(self, place: Place, problem: str, remedy: str | None = None) -> None:
        """Keep a problem; the reading goes on, unless there are too many already."""
        self.found.append(MachineError(problem, remedy, place))
        if len(self.found) >= MOST_PROBLEMS:
            self.raise_any()

    def raise_any(self) -> None:
        """End the reading if anything was found.

        Raises
        ------
        MachineFileError
            Something was.
        """
        if self.found:
            raise MachineFileError(self.found)


def refusal(place: Place, problem: str, remedy: str) -> MachineFileError:
    """Error for a file that cannot be read any further."""
    return MachineFileError([MachineError(problem, remedy, place)])


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Known word that looks most like a misspelt one, if any does."""
    by_folded = {name.casefold(): name for name in known}
    close = difflib.get_close_matches(word[:80].casefold(), by_folded, n=1, cutoff=0.5)
    return by_folded[close[0]] if close else None


def place_order(problem: MachineError) -> tuple[int, int]:
    """Line and column of a problem, to list problems in the order of the file."""
    place = problem.place or Place("")
    return place.line or 0, place.column or 0
