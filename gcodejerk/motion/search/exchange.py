"""Programmes by cones for a few frequencies of a band, until no other one is worse.

This module owns which frequencies are added from one programme to the next, and how dear the jerk
is beside what is left. What is solved, one move or several that go together, says who asks.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gcodejerk.motion.search.found import KEPT, Kind, better
from gcodejerk.motion.search.looked_at import Flags

ROUNDS = 6
"""Programmes at most, until no frequency between the points is worse than these."""
WORSE = 1.012
"""A frequency is added where the residual is this much above that of the points."""
USED = 0.985
"""Share of what is allowed that is designed for: between the points it is larger."""
JERK_COST = 1e-3
"""What the full jerk costs beside a residual that matters: so much of that may be lost by it."""
LEAST_COST = 2e-5
"""The same where the residual alone counts."""
LOSS = 3e-3
"""What the jerk may then cost of the residual at most."""
CHEAPEST = 1e-9
"""Below it, the jerk's cost is lost in the solver's rounding."""
NULL = 1e-6
"""A residual below this share of the measure is as good as none."""


def exchanged(
    solved: Callable[[Flags, float], Kind | None],
    active: Flags,
    allowed: float,
    rounds: int = ROUNDS,
    only: bool = False,
) -> Kind | None:
    """The least residual, frequencies added until none between is worse.

    Parameters
    ----------
    solved : callable
        Solves the programme for groups of frequencies, (g,), and a cost of the full jerk; None
        where there is nothing to be had.
    active : ndarray of bool, shape (g,)
        The groups that the first programme knows.
    allowed : float
        Residual that costs nothing, over the measure. [-]
    rounds : int, optional
        Programmes at most.
    only : bool, optional
        Nothing that leaves more than is allowed is of any use.

    Returns
    -------
    Found or None
        The best of what was found.
    """
    cost = JERK_COST if allowed else LEAST_COST
    best: Kind | None = None
    while rounds > 0:
        rounds -= 1
        found = solved(active, cost)
        if found is None:
            return best
        solution, source = found.solution, found.looked_at.source
        # Little jerk has cost at most this; where that is too much, it is made cheaper.
        paid = cost * (1.0 - solution.peak)
        if not allowed and paid > LOSS * solution.worst > LOSS * NULL:
            cost *= 0.02
            rounds += cost > CHEAPEST
        best = better(best, found)
        if only and solution.worst > allowed:
            # Other frequencies can only add to that.
            break
        most = allowed if only else max(WORSE * solution.worst, allowed, NULL)
        missing = found.looked_at.exceeded(found.left, np.where(source < 0, KEPT, most)) & ~active
        if not missing.any():
            break
        active = active | missing
    return best
