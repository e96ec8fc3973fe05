r"""The optimum of one move by planes, its blocks refined from round to round.

This module owns when a programme of `cutting` has said enough: for the next blocks, whose knots
`prices` says, or for good.

Few blocks are solved roughly, for where the jerk ought to change; so are the next ones, until they
might lose little. Those are solved to their end; and where their prices say then that they lose
more than was thought, so are the next ones.

Where what is allowed can be left, the least peak jerk is sought for it. Long blocks may need far
more than short ones, so blocks are refined there too, as long as that saves jerk.

Rule: where the solver gives up, nothing is said (None): who asked has other means.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.search.blocks import Blocks
from gcodejerk.motion.search.cutting import Cutting
from gcodejerk.motion.search.found import Found
from gcodejerk.motion.search.looked_at import Index, LookedAt
from gcodejerk.motion.search.prices import Priced, priced_knots
from gcodejerk.motion.search.programme import Problem

ROUNDS = 4
"""Programmes of ever shorter blocks at most."""
MOST_BLOCKS = 150
"""Blocks that are no images of others, at most."""
MOST_CUTS = 80
"""Steps of each programme at most."""
LITTLE, NOTHING = 3e-3, 1e-4
"""A plane is added where the residual is so much above what planes say: of that, and at least."""
ROUGH, NEARLY = 0.25, 0.2
"""Blocks that are refined need the least of theirs to this share only; and where planes say that
what is allowed is within reach, so much of it may be unknown."""
CUT = 0.99
"""A guarded frequency is cut where it keeps more than so much of what it may: what is interpolated
is wrong by less than the rest."""
FAR = 100.0
"""Nothing is known while a guarded frequency keeps more than so many times what it may."""
USED = 0.995
"""Share of what is allowed that is designed for: it is held everywhere."""
GAINED = 0.1
"""What shorter blocks gain at most, of what the prices say that long ones might lose."""
ENOUGH, OF_SLACK, AGAIN = 0.01, 0.2, 2.0
"""No shorter blocks are tried for less than this share of the residual, or this of the slack; nor,
once they were solved to their end, for less than so many times that."""
UNCUT = 0.2
"""Of what is not worth shorter blocks, what the blocks that are not cut may lose together."""
SMALL, EASIER = 0.05, 0.2
"""Peak jerk, as a share of its limit, that need not be less; and share of it that is worth shorter
blocks."""
GIVEN = 0.2
"""Of what a profile leaves less than the controller's own, what may be given for less jerk."""
LEAST_GIVEN = 2e-5
"""What is given where the residual alone counts."""
LESS = 0.9
"""What may be given is believed to have been this or more of what it was said to be."""


@dataclass(frozen=True, slots=True)
class Asked:
    """What is asked of an optimum; all over the measure of residuals.

    Attributes
    ----------
    allowed : float
        A residual that does not matter: the least peak jerk is asked for that. [-]
    settled : float
        Where no more than this can be left, no more is. [-]
    slack : float
        Else, what may be left above the least. [-]
    today : float
        What the controller's own profile leaves; only a part of what is gained is given. [-]
    """

    allowed: float
    settled: float = 0.0
    slack: float = 0.0
    today: float = 0.0

    @property
    def only(self) -> bool:
        """Whether nothing that leaves more than is allowed is of any use."""
        return self.allowed > 0.0 and not self.slack

    def given(self, least: float) -> float:
        """What may be left above the least, which is about `least`."""
        return max(min(self.slack, GIVEN * (self.today - least)), LEAST_GIVEN)


Programme = Callable[[Index], tuple[Blocks, Problem]]
"""The blocks between some knots, and their programme."""


def refined(looked_at: LookedAt, programme: Programme, knots: Index, asked: Asked) -> Found | None:
    """The optimum for blocks that are as short as they have to be.

    Parameters
    ----------
    looked_at : LookedAt
        The frequencies.
    programme : callable
        See `Programme`.
    knots : ndarray of int
        Of the first blocks. [intervals]
    asked : Asked
        What is asked.

    Returns
    -------
    Found or None
        None where the solver has given up.
    """
    sought, told, given = _Sought(looked_at, *programme(knots)), 0.0, 0.0
    rough = ROUGH
    for k in range(ROUNDS):
        given = asked.given(told)
        last = k == ROUNDS - 1 or bool(np.all(np.diff(knots) == 1))
        if not sought.decided(asked.allowed, given, 0.0 if last else rough):
            return None
        told = sought.cutting.told
        if last or sought.smooth:
            break
        enough = max(ENOUGH * told, OF_SLACK * given)
        priced = sought.priced(enough)
        if rough and _gained(priced, told) <= enough:
            if not sought.least(asked.allowed, given):
                return None
            told, rough = sought.cutting.told, 0.0
            priced = sought.priced(enough)
        if not rough and _gained(priced, told) <= AGAIN * enough:
            break
        knots, before = priced.knots, sought.cutting
        sought = _Sought(looked_at, *programme(knots))
        sought.cutting.begin(before)
    if sought.smooth:
        return _eased(sought, programme, asked.allowed).found()
    if asked.given(told) < LESS * given:
        # Less is gained than was thought.
        given = asked.given(told)
        if not sought.least(asked.allowed, given):
            return None
    found = sought.found()
    # What has been given for less jerk may be what is missing.
    missing = sought.cutting.told - given <= asked.settled < found.worst / USED
    if not missing or not sought.smoothed(asked.settled):
        return found
    return sought.found()


def _gained(priced: Priced, told: float) -> float:
    """What shorter blocks gain at most: no more than there is."""
    return min(GAINED * priced.lost, told)


def within(looked_at: LookedAt, programme: Programme, knots: Index, asked: Asked) -> Found | None:
    """The least jerk for what is allowed; None where the first blocks leave more.

    Parameters
    ----------
    looked_at : LookedAt
        The frequencies.
    programme : callable
        See `Programme`.
    knots : ndarray of int
        Of the first blocks. [intervals]
    asked : Asked
        What is asked.

    Returns
    -------
    Found or None
    """
    sought = _Sought(looked_at, *programme(knots))
    if not sought.within(asked.allowed, asked.given(0.0)):
        return None
    return _eased(sought, programme, asked.allowed).found()


def _eased(sought: _Sought, programme: Programme, allowed: float) -> _Sought:
    """The same with blocks as short as they have to be, where the least jerk is large for that."""
    for _ in range(ROUNDS):
        peak = sought.cutting.peak
        if peak <= SMALL:
            break
        enough = EASIER * peak
        priced = sought.priced(enough)
        if GAINED * priced.lost <= enough:
            break
        finer = _Sought(sought.looked_at, *programme(priced.knots))
        finer.cutting.begin(sought.cutting)
        if not finer.smoothed(allowed) or finer.cutting.peak > (1.0 - EASIER) * peak:
            break
        sought = finer
    return sought


class _Sought:
    """A programme by planes on its way to a solution.

    Attributes
    ----------
    smooth : bool
        What is allowed is left, with the least jerk.
    """

    def __init__(self, looked_at: LookedAt, blocks: Blocks, problem: Problem) -> None:
        self.looked_at, self.blocks, self.cutting = looked_at, blocks, Cutting(problem)
        self.modes, self.smooth = looked_at.source >= 0, False

    def decided(self, allowed: float, given: float, rough: float) -> bool:
        """The least jerk for what is allowed, or the least residual; False: the solver gives up."""
        if not self.least(allowed, given, rough, through=False):
            return False
        if not self.reaches(allowed):
            return True
        self.smooth = self.smoothed(allowed)
        return self.smooth or self.least(allowed, given, rough)

    def within(self, allowed: float, given: float) -> bool:
        """The least jerk for what is allowed; False where that is not soon within reach."""
        if self.least(allowed, given, ROUGH, through=False) and self.reaches(allowed):
            self.smooth = self.smoothed(allowed)
        return self.smooth

    def least(self, allowed: float, given: float, rough: float = 0.0, through: bool = True) -> bool:
        """The least residual above what is allowed; False: the solver gives up.

        `rough`: it need not be known better than to this share. `through`: not only until what is
        allowed seems to be within reach.
        """
        cutting = self.cutting
        for _ in range(MOST_CUTS):
            if not cutting.solve(USED * allowed, given):
                return False
            left, reached = self.blocks.largest(cutting.left), self.reaches(allowed)
            most = allowed if reached else cutting.told + max(LITTLE * cutting.told, NOTHING)
            going = self._cut(left, most) or not (cutting.settled or reached)
            known = (
                left[self.modes].max() <= (1.0 + rough) * cutting.expected
                and left[~self.modes].max(initial=0.0) <= FAR
            )
            if not going or (reached and not through) or (rough and known):
                return True
        return False

    def reaches(self, allowed: float) -> bool:
        """Whether planes say that what is allowed can be left, and nearly know."""
        cutting = self.cutting
        return cutting.told <= allowed <= cutting.expected + NEARLY * allowed

    def smoothed(self, allowed: float) -> bool:
        """The least jerk for what is allowed, on the same blocks; whether there is one."""
        cutting = self.cutting
        for _ in range(MOST_CUTS):
            if not cutting.solve(USED * allowed):
                return False
            if not self._cut(self.blocks.largest(cutting.left), allowed) and cutting.settled:
                return True
        return False

    def priced(self, enough: float) -> Priced:
        """Shorter blocks, where less than enough would be gained by still shorter ones."""
        most = UNCUT * enough / GAINED
        return priced_knots(self.blocks, self.cutting, most, MOST_BLOCKS)

    def found(self) -> Found:
        """The last solution."""
        every = np.ones(len(self.modes), dtype=bool)
        return Found.of(self.looked_at, self.blocks, every, self.cutting.solution())

    def _cut(self, left: Array, most: float) -> bool:
        """Cut what is left with more, or guarded with more than it may; whether any was."""
        missing = self.looked_at.exceeded(left, np.where(self.modes, most, CUT))
        return self.cutting.cut(missing[self.blocks.owner])
