"""What a search for an optimum has found for some blocks of jerk.

This module owns how that is judged: on the dense grid of frequencies, whatever few of them the
programme knew.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.blocks import Blocks
from gcodejerk.motion.search.looked_at import Flags, LookedAt
from gcodejerk.motion.search.programme import Solution

GUARDED, KEPT = 0.98, 1.005
"""Share of what guarded frequencies may keep that is designed for; and where they are found to keep
it: between the frequencies that are looked at it is a little more."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """A solution, and what it was found for.

    Attributes
    ----------
    looked_at : LookedAt
        The frequencies.
    blocks : Blocks
        The blocks of its jerk.
    active : ndarray of bool, shape (g,)
        The groups of frequencies that the programme knew.
    solution : Solution
        The jerk.
    left : ndarray, shape (g,)
        What each group is left with, over the measure. [-]
    """

    looked_at: LookedAt
    blocks: Blocks
    active: Flags
    solution: Solution
    left: Array

    @classmethod
    def of(cls, looked_at: LookedAt, blocks: Blocks, active: Flags, solution: Solution) -> Found:
        """What a solution leaves."""
        return cls(looked_at, blocks, active, solution, blocks.left(solution.jerk))

    @property
    def worst(self) -> float:
        """Largest residual of modes over the whole band, over the measure."""
        return float(self.left[self.looked_at.source >= 0].max(initial=0.0))

    def meets(self, allowed: float) -> bool:
        """Whether it leaves no more than is allowed, and keeps the guard."""
        return self.worst <= allowed and self.guards

    @property
    def excess(self) -> float:
        """What a guarded frequency keeps at most, times what it may; the least that counts is 1."""
        most = float(self.left[self.looked_at.source < 0].max(initial=0.0))
        return most if most > KEPT else 1.0

    @property
    def guards(self) -> bool:
        """Whether every guarded frequency keeps what it may at most."""
        return self.excess == 1.0


Kind = TypeVar("Kind", bound=Found)


def better(one: Kind | None, other: Kind | None) -> Kind | None:
    """The one that keeps the guard, or of two that do the one that leaves less."""
    if one is None or other is None:
        return one or other
    return other if (other.excess, other.worst) < (one.excess, one.worst) else one
