"""The options by which feed moves count as rapids: never by themselves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from gcodejerk.machine import Machine

RapidFeedOption = Annotated[
    float | None,
    typer.Option(
        "--rapid-feed",
        metavar="F",
        help="G1 at exactly this F counts as a rapid, with both ends at --rapid-clearance or above",
    ),
]
ClearanceOption = Annotated[
    float | None,
    typer.Option("--rapid-clearance", metavar="Z", help="of --rapid-feed, in the program's unit"),
]


def counting(machine: Machine, feed: float | None, clearance: float | None) -> Machine:
    """The machine, with what the user says of feed moves."""
    from gcodejerk.start import RapidFeed

    if feed is None and clearance is None:
        return machine
    if feed is None or clearance is None:
        raise typer.BadParameter(
            "--rapid-feed F and --rapid-clearance Z belong together: no move below Z, where the "
            "tool may cut, counts as a rapid"
        )
    if not (0.0 < feed < math.inf and math.isfinite(clearance)):
        raise typer.BadParameter("--rapid-feed is above 0, and both are plain numbers")
    return replace(machine, rapid_feed=RapidFeed(feed, clearance))
