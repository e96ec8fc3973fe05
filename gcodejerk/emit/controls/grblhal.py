"""grblHAL: acceleration $120 and jerk $800 of each axis.

Needs a build with ENABLE_JERK_ACCELERATION (grblHAL core f80fc34, settings.h, settings.c); its
ramps are seven segments but for the step of its stepper segments.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    SettingsOnly,
    acceleration,
    jerk,
)
from gcodejerk.emit.sheets import axis_settings, today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import Scheme, Setting


class GrblhalController(SettingsOnly):
    """grblHAL with ENABLE_JERK_ACCELERATION."""

    name = "grblhal"
    forms = (Form("parameters", "documented", "$120.., $800..: needs ENABLE_JERK_ACCELERATION"),)
    sheet_suffix = ".grblhal-settings.txt"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Acceleration and jerk of the axes."""
        facts = ("S", "grblHAL core f80fc34, settings.h, settings.c", "sent while idle", "no")

        def both(axis: str) -> list[Setting]:
            k = AXES.index(axis)
            limits = (0.001, 0.001, 1e9)
            return [
                acceleration(f"${120 + k}", axis, "mm/s^2", 1.0, limits, facts),
                jerk(f"${800 + k}", axis, "mm/s^3", 1.0, (1.0, 1.0, 1e9), facts),
            ]

        today = today_of(machine, "velocity", "acceleration", "jerk")
        today["jerk"] = np.where(
            np.isinf(today["jerk"]), 10.0 * today["acceleration"], today["jerk"]
        )
        settings, groups = axis_settings(machine, both)
        scheme = Scheme(
            self.name, "acceleration and jerk", FAMILIES["jerk-limited"], today, settings, groups,
            notes=(
                "ask $$ for the number of the jerk first: builds before December 2024 have another",
                "its ramps are seven segments but for the steps of its stepper segments",
            ),
            cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip
        return {"jerk": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Settings as they are sent."""
        return [f"{s.number}={n}" for s, n in numbers]
