"""TwinCAT CNC and the ISG kernel: acceleration and ramp time of rapids, by axis or from a program.

P-AXIS-00004 a_grenz [mm/s^2] and P-AXIS-00200 tr_grenz [us] make the rapids: one ramp time for all
four ramps. G231 and G233 scale both in percent for all axes, from within a program (infosys tf5200
206596619, 248714123). Four ramp times of their own exist on feed blocks only (P-AXIS-00196, 00195,
00198, 00197).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import SettingsOnly, acceleration, require_jerk
from gcodejerk.emit.sheets import axis_settings, today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import (
    ALL,
    TODAY,
    Scheme,
    Setting,
    ramp_time,
    share_of_ramp,
    share_of_today,
)

AXIS = (
    "M",
    "infosys tf5200, P-AXIS-00004, P-AXIS-00200",
    "axis parameters (MDS)",
    "no (not known)",
)
PROGRAM = ("M", "infosys tf5200 206596619 (G231, G233)", "NC program, modal", "no")


class TwincatController(SettingsOnly):
    """TwinCAT CNC and the ISG kernel."""

    name = "twincat"
    forms = (
        Form("parameters", "documented", "G231 and G233 in the program, or P-AXIS-00004 and 00200"),
    )
    sheet_suffix = ".twincat.nc"
    remark = ("(", ")")
    program_way = "program"
    program_sets = r"G23[13](?!\d)|SLOPE|MACHINE *DATA"
    acts_on = (
        "G231 and G233 act on G0 alone; they need the slope of trapezoids or sine squares that "
        "today's jerk stands for: the program does not choose one"
    )

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Percentages from the program, or the numbers of each axis."""
        require_jerk(machine, self.name)
        today = today_of(machine, "velocity", "acceleration", "jerk")
        fixed = today | {TODAY + name: today[name] for name in ("acceleration", "jerk")}
        settings = (
            Setting("G231", ALL, "%", "acceleration of rapids",
                    share_of_today("acceleration", 0.01), 1.0, 10.0, 1000.0, *PROGRAM),
            Setting("G233", ALL, "%", "ramp time of rapids", share_of_ramp(0.01),
                    1.0, 10.0, 1000.0, *PROGRAM),
        )  # fmt: skip
        cannot = ("asymmetric ramps on G0 (only on G1: P-AXIS-00195 to 00198)",)
        notes = ("bounded by P-AXIS-00008 a_max and P-AXIS-00201 tr_min",)
        program = Scheme(
            self.name, "scaling of rapids from the program", FAMILIES["jerk-limited"], fixed,
            settings, ((0, 1),), notes=notes, cannot=cannot,
        )  # fmt: skip

        def numbers(axis: str) -> list[Setting]:
            return [
                acceleration("P-AXIS-00004", axis, "mm/s^2", 1.0, (1.0, 1.0, 1e6), AXIS),
                Setting("P-AXIS-00200", axis, "us", "ramp time of rapids",
                        ramp_time("jerk", "acceleration", 1e-6), 1.0, 1.0, 1e7, *AXIS),
            ]  # fmt: skip

        own, groups = axis_settings(machine, numbers)
        axes = Scheme(
            self.name, "acceleration and ramp time of rapids", FAMILIES["jerk-limited"], fixed, own,
            groups, notes=(*notes, "ramps shorter than the CNC cycle are taken as none"),
            cannot=cannot,
        )  # fmt: skip
        return {"program": program, "axes": axes}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Words of a program, or a list of parameters as comments."""
        out = []
        for setting, number in numbers:
            if setting.axis == ALL:
                out.append(f"{setting.number}={number}")
            else:
                out.append(f"({setting.number} {setting.axis} = {number} {setting.unit})")
        return out

    def frame(self, lines: list[str]) -> list[str]:
        """The slope that has a ramp time."""
        return ["#SET SLOPE PROFIL[1]", *lines] if lines[0].startswith("G") else lines
