"""Marlin: streams as G1 blocks; travel acceleration and input shapers.

M204 T and M593 (MarlinDocumentation), FT motion's M493 (00317b4, M493.cpp): trapezoids in front of
the shaper.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    OFF,
    acceleration,
    no_shaper,
    shaped_scheme,
    unmeasured,
)
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.emit.sheets import Sheets
from gcodejerk.machine import Machine
from gcodejerk.parameters import PATH, Scheme, Setting


class MarlinController(Sheets, GcodeController):
    """Marlin."""

    name = "marlin"
    forms = (
        unmeasured("G1 blocks of 2 ms need a planner buffer that is fed fast enough"),
        Form("parameters", "documented", "M204 T, and M593 (ZV) or M493 (FT motion)"),
    )
    planner_limits = "M203", "M201"
    path_limits = "M204 T"
    sheet_suffix = ".marlin.g"
    program_way = "m593"
    program_damping = "M593 D"
    program_sets = r"M0*(?:20[14]|593|493|50[0-2])(?!\d)"
    program_inches = True
    acts_on = "M204 T acts on travel (G0) alone, M593 on all moves of the program"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """ZV by M593, or FT motion's shapers by M493."""
        facts = ("M", "MarlinDocumentation, M204, M593", "NC program", "no")
        limits = (1.0, 1.0, 1e6)
        first = acceleration("M204 T", PATH, "mm/s^2", 1.0, limits, facts, "travel acceleration")
        zv = shaped_scheme(
            self.name, machine, "travel acceleration and ZV shaping", first, {"zv": "ZV"}, facts,
            ("M593 kind", "M593 F"), "XY",
        )  # fmt: skip
        source = ("S", "Marlin 00317b4, M493.cpp", "NC program", "no")
        kinds = {
            **{"zv": "1", "zvd": "2", "zvdd": "3", "zvddd": "4", "ei": "5"},
            **{"2hei": "6", "3hei": "7", "marlin-mzv": "8"},
        }
        ft = shaped_scheme(self.name, machine, "travel acceleration and FT motion's shapers", first,
                     kinds, source, ("M493 C", "M493 A"))  # fmt: skip
        notes = ("M493 V has to answer: its letters are those of the current source",)
        return {"m593": zv, "ft": replace(ft, notes=(*ft.notes, *notes))}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """M codes."""
        out = [f"M204 T{n}" for s, n in numbers if s.axis == PATH]
        damping = no_shaper(machine)["filter_damping"]
        for axis in machine.axis_names:
            own = {s.number: n for s, n in numbers if s.axis == axis}
            zeta = own.get("M593 D", f"{damping[AXES.index(axis)]:g}")
            if "M593 F" in own:
                off = own["M593 kind"] == OFF
                out.append(f"M593 {axis} F0" if off else f"M593 {axis} F{own['M593 F']} D{zeta}")
            elif "M493 A" in own:
                off = own["M493 C"] == OFF
                text = "C0" if off else f"C{own['M493 C']} A{own['M493 A']} I{zeta}"
                out.append(f"M493 S1 {axis} {text}")
        return out
