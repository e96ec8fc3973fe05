"""Smoothieware: accelerations by M204 (bb41e992, Robot.cpp)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    SettingsOnly,
    trapezoid_scheme,
)
from gcodejerk.machine import Machine
from gcodejerk.parameters import Scheme, Setting


class SmoothiewareController(SettingsOnly):
    """Smoothieware."""

    name = "smoothieware"
    forms = (Form("parameters", "documented", "M204 X Y Z: acceleration, there is no jerk"),)
    sheet_suffix = ".smoothieware.g"
    program_way = "acceleration"
    program_sets = r"M0*(?:204|50[0-2])(?!\d)"
    program_inches = True
    program_commands = True
    acts_on = "M204 acts on all moves of the program, cuts too"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Accelerations of the axes."""
        facts = ("S", "Smoothieware bb41e992, Robot.cpp (M204)", "NC program", "no")
        return trapezoid_scheme(
            self.name, machine, "M204", facts, "accelerations", (1.0, 1.0, 1e6)
        )  # fmt: skip

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """One M code for all axes."""
        return ["M204 " + " ".join(f"{s.axis}{n}" for s, n in numbers)]
