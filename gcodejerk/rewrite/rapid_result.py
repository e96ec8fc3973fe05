"""One rapid of a result, for whoever uses the library: plain values, one record a rapid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Program
from gcodejerk.planning.plans import Plans
from gcodejerk.reasons import CERTAIN, REASONS


@dataclass(frozen=True, slots=True)
class RapidResult:
    """What was done with one rapid."""

    line: int
    """Of its block in the program, counted from 1."""
    rewritten: bool
    reason: str | None
    """Why it was left alone; None where it was rewritten."""
    displacement: dict[str, float]
    """What each axis moves; empty where that is not known. [mm] or [deg]"""
    profile: str | None
    """Name of the profile that is written; None where it was left alone."""
    time: float | None
    """T_SUM, None where it was left alone. [s]"""
    conventional_time: float | None
    """What the controller's own G0 takes, None where that is not known. [s]"""
    residual: float | None
    """The largest displacement that a mode keeps, None where it was left alone. [mm]"""
    conventional_residual: float | None
    """The same of the controller's own G0. [mm]"""


def rapid_results(
    program: Program,
    plans: Plans,
    stays_conventional: NDArray[np.bool_],
    residual: Array,
    conventional: Array,
) -> tuple[RapidResult, ...]:
    """Every rapid of a program, in the order of the file.

    Parameters
    ----------
    program : Program
        n rapids.
    plans : Plans
        Row i is rapid i.
    stays_conventional : ndarray of bool, shape (n,)
        The stream is the conventional profile.
    residual, conventional : ndarray, shape (n, m)
        Displacement of each mode, NaN where not planned. [mm]

    Returns
    -------
    tuple of RapidResult, length n
    """
    interval = plans.machine.interval
    # A spectrum's oscillators count together, as in reports.
    worst, today = (
        np.max(plans.modes.grouped(each), axis=1, initial=0.0) for each in (residual, conventional)
    )
    out = []
    for row, line in enumerate(program.rapids.line.tolist()):
        rewritten = bool(plans.reason[row] == CERTAIN)
        usual = float(plans.conventional_time[row])
        moved = np.flatnonzero(plans.displacement[row]).tolist()
        stays = bool(stays_conventional[row])
        out.append(
            RapidResult(
                line=line,
                rewritten=rewritten,
                reason=None if rewritten else str(REASONS[plans.reason[row]]),
                displacement={AXES[k]: float(plans.displacement[row, k]) for k in moved},
                profile=("conventional" if stays else plans.designed) if rewritten else None,
                time=float(plans.counts[row]) * interval if rewritten else None,
                conventional_time=usual if usual > 0.0 else None,
                residual=float(worst[row]) if rewritten else None,
                conventional_residual=float(today[row]) if rewritten else None,
            )
        )
    return tuple(out)
