"""What a control has to allow before streams run, where its own rapids have less today.

A planner in the control bounds every block, whatever F asks for: what profiles use beyond today's
settings is played slower, and the stream is then another motion than the one that was proven.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.machine import Axis, Limits
from gcodejerk.planning.plans import Plans
from gcodejerk.storage import windows

NEAR = 1.0 - 1e-6


def moving_axes(plans: Plans) -> list[Axis]:
    """Axes that planned moves move."""
    planned = plans.planned
    return [
        axis
        for axis in plans.machine.axes
        if any(
            bool((planned[part] & (plans.displacement[part, AXES.index(axis.name)] != 0.0)).any())
            for part in windows(len(plans))
        )
    ]


def has_to_rise(plans: Plans, names: tuple[str, str], along: str, control: str) -> list[str]:
    """A note that names every setting that profiles go beyond; none where they do not.

    Parameters
    ----------
    plans : Plans
        Planned moves.
    names : tuple of str
        What the control calls its limits of velocity and acceleration of an axis; empty where it
        knows those of the path alone.
    along : str
        What it calls those of the path; empty where it has none.
    control : str
        What messages call it.

    Returns
    -------
    list of str
        At most one.
    """
    moving = moving_axes(plans)
    raised = []
    for name, quantity in zip(names, ("velocity", "acceleration"), strict=True):
        more = [f"{a.name} {most}" for a in moving if (most := _more(a.rapid, a.limit, quantity))]
        raised += [f"{name} of {', '.join(more)}"] if name and more else []
    path = plans.machine.path
    for quantity in ("velocity", "acceleration"):
        most = _more(path.rapid, path.limit, quantity)
        if along and most and any(not axis.rotary for axis in moving):
            raised.append(f"{quantity} along the path ({along}) {most}")
    if not raised:
        return []
    return [
        "before this program runs, raise to what the machine file's limit has, where the control "
        f"has less: {'; '.join(raised)} (mm, s); or {control} plays the streams slower; rapids "
        "that were left alone then use it, too"
    ]


def _more(today: Limits, needed: Limits, quantity: str) -> str:
    """What has to be allowed; empty where today's is enough."""
    now, then = getattr(today, quantity), getattr(needed, quantity)
    return f"{then:g}" if now < then * NEAR else ""
