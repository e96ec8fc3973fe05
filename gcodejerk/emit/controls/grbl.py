"""grbl: streams as G1 blocks, and the accelerations $120 to $122.

Trapezoids, no jerk (gnea/grbl bfb67f0, doc/markdown/settings.md).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    trapezoid_scheme,
    unmeasured,
)
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.emit.sheets import Sheets
from gcodejerk.machine import Machine
from gcodejerk.parameters import Scheme, Setting


class GrblController(Sheets, GcodeController):
    """grbl and its kin."""

    name = "grbl"
    forms = (
        unmeasured(
            "G1 blocks of 2 ms need a stream that keeps the planner's buffer full; its trapezoids "
            "ramp within blocks"
        ),
        Form("parameters", "documented", "$120 to $122: acceleration, there is no jerk"),
    )
    planner_limits = "$110 to $115 (mm/s here, mm/min there)", "$120 to $125"
    sheet_suffix = ".grbl-settings.txt"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Accelerations of the axes."""
        facts = ("S", "gnea/grbl bfb67f0, doc/markdown/settings.md", "sent while idle", "no")
        limits = (0.001, 0.001, 1e6)
        return trapezoid_scheme(self.name, machine, "${}", facts, "accelerations", limits)

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Settings as they are sent."""
        return [f"{s.number}={n}" for s, n in numbers]
