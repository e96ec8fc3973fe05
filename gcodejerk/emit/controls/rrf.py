"""RepRapFirmware: travel acceleration and the one input shaper (fc1cd16, AxisShaper.cpp, M593)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    OFF,
    SettingsOnly,
    acceleration,
    no_shaper,
    path_acceleration,
    shaper_of,
)
from gcodejerk.emit.sheets import today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import ALL, PATH, Scheme, Setting


class RrfController(SettingsOnly):
    """RepRapFirmware."""

    name = "rrf"
    forms = (Form("parameters", "documented", "M204 T and M593: one shaper for all axes"),)
    sheet_suffix = ".rrf.g"
    program_way = "shaper"
    program_damping = "M593 S"
    program_sets = r"M0*(?:20[14]|593|50[0-2])(?!\d)"
    program_inches = True
    program_commands = True
    acts_on = "M204 T acts on travel (G0) alone, M593 on all moves of the program"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The acceleration of travel moves, and one shaper for all axes."""
        facts = ("S", "RepRapFirmware fc1cd16, AxisShaper.cpp", "NC program", "no")
        kinds = {k: k for k in ("zvd", "zvdd", "zvddd", "mzv", "ei2", "ei3")}
        settings = (
            acceleration("M204 T", PATH, "mm/s^2", 1.0, (1.0, 1.0, 1e6), facts,
                         "travel acceleration"),
            *shaper_of([OFF, *kinds], ALL, facts, ("M593 P", "M593 F"), (0.1, 8.0, 1000.0)),
        )  # fmt: skip
        fixed = today_of(machine, "velocity", "acceleration") | no_shaper(machine)
        own = fixed["filter_damping"]
        fixed["filter_damping"] = np.full(len(AXES), float(own.max()))
        scheme = Scheme(
            self.name, "travel acceleration and input shaping", FAMILIES["trapezoidal"], fixed,
            settings, ((0, 1, 2),), path_acceleration(machine), tuple(kinds),
            notes=("M593 waits for standstill",), cannot=("a jerk limit", "a shaper of each axis"),
        )  # fmt: skip
        return {"shaper": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """M codes."""
        by = {s.number: n for s, n in numbers}
        out = [f"M204 T{by['M204 T']}"] if "M204 T" in by else []
        if by.get("M593 P") == OFF:
            out.append('M593 P"none"')
        elif "M593 P" in by:
            damping = by.get("M593 S", f"{float(no_shaper(machine)['filter_damping'].max()):g}")
            out.append(f'M593 P"{by["M593 P"]}" F{by["M593 F"]} S{damping}')
        return out
