"""The rapids of a program as moves for the planner, and why some of them are none.

This module owns what stands between a program's rapids and `plan.plan_moves`: the axes, the travel
and the lengths of the machine file, and rapids that cannot gain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.shapers import SHAPERS
from gcodejerk.nc import Rapids
from gcodejerk.planning.optima import Progress
from gcodejerk.planning.plan import PROFILES, plan_moves, rule_out
from gcodejerk.planning.plans import STANDSTILL, Modes, Plans, path_length, same_rows
from gcodejerk.reasons import CERTAIN, REASONS, Reason
from gcodejerk.spread import Spread, here
from gcodejerk.storage import column, windows

FARTHEST = 1e8
"""Where no axis ever is [mm] or [deg]; what is farther away could not be written exactly."""


def plan_rapids(
    rapids: Rapids,
    machine: Machine,
    profile: str | None = None,
    progress: Progress | None = None,
    unblended: str = "",
    only_gains: bool = False,
    spread: Spread = here,
) -> Plans:
    """Plan the rapids of a program, all of them together.

    Parameters
    ----------
    rapids : Rapids
        As `nc.read_program` finds them.
    machine : Machine
        Limits, modes, travel and interval.
    profile : str, optional
        The machine's own by default.
    progress : callable, optional
        Called while optima are computed.
    unblended : str, optional
        Axes whose rapids are left alone, since the controller stops between their blocks.
    only_gains : bool, optional
        Leave all rapids alone where nothing is known to vibrate, so that nothing can be gained.
    spread : Spread, optional
        Who searches.

    Returns
    -------
    Plans
        Row i is rapid i.

    Raises
    ------
    PlanError
        The profile is unknown, or adds time.
    """
    profile = profile or machine.design.profile
    if profile in SHAPERS:
        raise PlanError(
            f"profile {profile!r} adds time to every rapid: it is there for comparison only",
            f"choose one of {', '.join(p for p in PROFILES if p not in SHAPERS)}",
        )
    reason = np.empty(len(rapids), dtype=np.uint8)
    displacement = column((len(rapids), len(AXES)), 0.0)
    # These keep the profile or save time; all others do nothing but keep modes still.
    saves = profile in ("conventional", "shortest")
    gains = not only_gains or saves or bool(Modes.of(machine).modes)
    for part in windows(len(rapids)):
        reason[part], displacement[part] = _moves(rapids.part(part), machine, unblended, gains)
    # Moves that agree in every bit of what planning looks at are planned once.
    first, like = same_rows(displacement, rapids.speed, reason, rapids.lone)
    plans = plan_moves(
        displacement[first], machine, profile, reason=reason[first], progress=progress,
        speed=rapids.speed[first], lone=rapids.lone[first], spread=spread,
    )  # fmt: skip
    return plans if len(first) == len(rapids) else plans.repeated(like)


def _moves(
    rapids: Rapids, machine: Machine, unblended: str, gains: bool
) -> tuple[NDArray[np.uint8], Array]:
    """Why rapids are no moves for the planner, and the displacements of those that are."""
    reason = rapids.reason.copy()
    known = sum(1 << AXES.index(name) for name in machine.axis_names)
    foreign = (rapids.words & ~np.uint16(known)) != 0
    # The machine file is what the user can mend, whatever the program leaves open besides.
    reason[foreign & (reason == REASONS.index(Reason.START_UNKNOWN))] = CERTAIN
    turning = reason == REASONS.index(Reason.ROTARY_WAY)
    reason[foreign & turning] = CERTAIN
    # Whatever way an axis turns: where its blocks are not blended, nobody needs to know it.
    stopping = sum(1 << AXES.index(axis) for axis in unblended)
    reason[turning & ((rapids.words & np.uint16(stopping)) != 0)] = REASONS.index(
        Reason.NO_BLENDING
    )
    rule_out(reason, foreign, Reason.AXIS_UNKNOWN)
    for axis in machine.axes:
        if axis.travel is None:
            continue
        k = AXES.index(axis.name)
        low, high = axis.travel[0] - axis.resolution, axis.travel[1] + axis.resolution
        # Unknown offsets give NaN, and NaN is beyond nothing.
        for position in (rapids.start[:, k], rapids.target[:, k]):
            where = position + rapids.offset[:, k]
            named = (rapids.words >> k & 1) != 0
            rule_out(reason, named & ((where < low) | (where > high)), Reason.BEYOND_TRAVEL)
    for position in (rapids.start, rapids.target):
        rule_out(
            reason, np.abs(np.nan_to_num(position)).max(axis=1) > FARTHEST, Reason.BEYOND_TRAVEL
        )
    displacement = np.where((reason == CERTAIN)[:, np.newaxis], rapids.target - rapids.start, 0.0)
    length = path_length(np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0), machine)
    rule_out(reason, length == 0.0, Reason.NO_MOTION)
    moves = np.abs(displacement) > STANDSTILL
    stops: NDArray[np.bool_] = moves & np.array([axis in unblended for axis in AXES])
    rule_out(reason, np.asarray(stops.any(axis=1)), Reason.NO_BLENDING)
    rule_out(reason, length < machine.design.minimum_length * (1.0 - 1e-9), Reason.TOO_SHORT)
    if not gains:
        rule_out(reason, length > 0.0, Reason.NO_MODE)
    return reason, displacement
