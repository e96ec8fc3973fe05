"""FluidNC: acceleration_mm_per_sec2 of each axis, in its YAML (e952f33, Machine/Axis.cpp)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    SettingsOnly,
    trapezoid_scheme,
)
from gcodejerk.machine import Machine
from gcodejerk.parameters import Scheme, Setting


class FluidncController(SettingsOnly):
    """FluidNC."""

    name = "fluidnc"
    forms = (Form("parameters", "documented", "acceleration_mm_per_sec2 in its YAML; no jerk"),)
    sheet_suffix = ".fluidnc.yaml.txt"
    remark = ("# ", "")

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Accelerations of the axes."""
        facts = ("S", "bdring/FluidNC e952f33, Machine/Axis.cpp", "the board's YAML file", "yes")
        return trapezoid_scheme(
            self.name, machine, "acceleration_mm_per_sec2", facts, "accelerations",
            (0.001, 0.001, 1e5),
        )  # fmt: skip

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """An excerpt of its file."""
        out = ["axes:"]
        for setting, number in numbers:
            out += [f"  {setting.axis.lower()}:", f"    {setting.number}: {number}"]
        return out
