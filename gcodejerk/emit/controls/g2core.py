"""TinyG and g2core: $xjm in millions of mm/min^3, ramps of quintic speed (1fb5940)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    SettingsOnly,
    jerk,
)
from gcodejerk.emit.sheets import axis_settings, today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import Scheme, Setting


class G2coreController(SettingsOnly):
    """TinyG and g2core."""

    name = "g2core"
    forms = (Form("parameters", "documented", "$xjm: jerk of ramps of quintic speed"),)
    sheet_suffix = ".g2core-settings.txt"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The jerk of the axes: ramps have no other number."""
        facts = ("S", "synthetos/g2 1fb5940, plan_zoid.cpp", "sent while idle", "no")

        def one(axis: str) -> list[Setting]:
            return [
                jerk(f"${axis.lower()}jm", axis, "1e6 mm/min^3", 1e6 / 216e3, (0.01, 0.01, 1e6),
                     facts)
            ]  # fmt: skip

        today = today_of(machine, "velocity", "acceleration", "jerk")
        with np.errstate(invalid="ignore"):  # axes that the machine does not have
            ramp = today["acceleration"] ** 2 / today["velocity"]
        today["jerk"] = np.where(np.isinf(today["jerk"]), 4.0 * ramp, today["jerk"])
        settings, groups = axis_settings(machine, one)
        scheme = Scheme(
            self.name, "jerk of the axes", FAMILIES["quintic"], today, settings, groups,
            notes=("the firmware moves in segments of 0.75 to 5 ms: a little more is left",),
            cannot=("an acceleration limit", "a rise of the jerk unlike its fall"),
        )  # fmt: skip
        return {"jerk": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Settings as they are sent."""
        return [f"{s.number}={n}" for s, n in numbers]
