"""Why a move that a user asked for cannot be: the limit it breaks, and what would do.

This module owns the messages of a plan with a time or a T1 of the user's choice. Whether a plan is
possible, the planner decides.
"""

from __future__ import annotations

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine
from gcodejerk.motion import SymmetricProfiles, conventional_profiles, whole_intervals
from gcodejerk.motion.profiles.profile import Array


def _squeezed(fastest: SymmetricProfiles, total: float, interval: float) -> SymmetricProfiles:
    """One profile squeezed into a shorter time, its segments no shorter than the interval."""
    stretch = total / fastest.total
    ramp = np.clip(fastest.T1 * stretch, interval, 0.25 * total)
    Ta = np.clip(fastest.Ta * stretch, 0.0, 0.5 * total - 2.0 * ramp)
    return SymmetricProfiles(ramp, Ta, ramp, total - 4.0 * ramp - 2.0 * Ta)


def limit_error(machine: Machine, share: Array, profile: SymmetricProfiles, how: str) -> PlanError:
    """Which axis passes which limit, in the words of its unit.

    Parameters
    ----------
    machine : Machine
        Its limits.
    share : ndarray, shape (9,)
        Displacement of each axis. [mm] or [deg]
    profile : SymmetricProfiles
        The one profile that breaks a limit.
    how : str
        What the message begins with.

    Returns
    -------
    PlanError
    """
    total = float(profile.total[0])
    if float(np.minimum(profile.T1, profile.T2)[0]) < machine.interval * (1.0 - 1e-9):
        return PlanError(
            f"T1 = {float(profile.T1[0]):g} s leaves a segment shorter than the interval "
            f"of {machine.interval:g} s",
            f"give a T1 from {machine.interval:g} to {0.5 * total - machine.interval:g} s",
        )
    units = {"velocity": "/s", "acceleration": "/s^2", "jerk": "/s^3"}
    for quantity in ("velocity", "acceleration", "jerk"):
        for axis in machine.axes:
            peak = float(getattr(profile, quantity)[0] * abs(share[AXES.index(axis.name)]))
            limit = getattr(axis.limit, quantity)
            if peak > limit * (1.0 + 1e-9):
                unit = ("deg" if axis.rotary else "mm") + units[quantity]
                return PlanError(
                    f"{how}axis {axis.name} reaches {peak:.6g} {unit} of {quantity} "
                    f"in {total:.3f} s, above its limit of {limit:.6g} {unit}",
                    f"allow more time (--time), or raise axes.{axis.name}.limit.{quantity}",
                )
    way = np.abs(share[[not _turns(machine, a) for a in AXES]])
    for quantity in ("velocity", "acceleration"):
        peak = float(getattr(profile, quantity)[0] * np.sqrt((way**2).sum()))
        limit = getattr(machine.path.limit, quantity)
        if peak > limit * (1.0 + 1e-9):
            unit = "mm" + units[quantity]
            return PlanError(
                f"{how}the path reaches {peak:.6g} {unit} of {quantity} in {total:.3f} s, above "
                f"its limit of {limit:.6g} {unit}",
                f"allow more time (--time), or raise path.limit.{quantity}",
            )
    raise AssertionError("a profile outside its range keeps every limit")


def _turns(machine: Machine, axis: str) -> bool:
    """Whether a letter is no linear axis of the machine."""
    return axis not in machine.axis_names or machine.axis(axis).rotary


def time_error(
    machine: Machine,
    share: Array,
    limits: tuple[Array, ...],
    total: float,
    profile: str,
) -> PlanError:
    """A time too short for the limits, with the least that would do.

    Parameters
    ----------
    machine : Machine
        Its limits.
    share : ndarray, shape (9,)
        Displacement of each axis. [mm] or [deg]
    limits : tuple of ndarray, shape (1,)
        Velocity, acceleration and jerk of the unit profile.
    total : float
        The time that was asked for. [s]
    profile : str
        What was to be planned.

    Returns
    -------
    PlanError
    """
    V, A, J = limits
    fastest = conventional_profiles(V, A, J, machine.interval)
    least = float(whole_intervals(fastest.total, machine.interval)[0] * machine.interval)
    if total >= least * (1.0 - 1e-9):
        return PlanError(
            f"no profile {profile} of {total:g} s keeps the limits",
            "choose profile condition3 or optimal, or give another time (--time)",
        )
    if total >= 4.0 * machine.interval:
        squeezed = _squeezed(fastest, total, machine.interval)
        if bool((squeezed.velocity > V) | (squeezed.acceleration > A) | (squeezed.jerk > J)):
            error = limit_error(machine, share, squeezed, "")
            return PlanError(error.problem, f"allow at least {least:.6g} s (--time {least:.6g})")
    return PlanError(
        f"no profile of {total:g} s keeps the limits and has segments of at least "
        f"{machine.interval:g} s",
        f"allow at least {least:.6g} s (--time {least:.6g})",
    )
