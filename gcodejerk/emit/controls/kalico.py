"""Kalico: the notch frequency of its unified planner, which is in pull request 939 only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    SettingsOnly,
    acceleration,
    no_shaper,
    shared_acceleration,
)
from gcodejerk.emit.sheets import today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import ALL, PATH, Relation, Scheme, Setting


class KalicoController(SettingsOnly):
    """Kalico with its unified planner."""

    name = "kalico"
    forms = (Form("parameters", "unverified", "SET_UNIFIED: in pull request 939 only"),)
    sheet_suffix = ".kalico.cfg.txt"
    remark = ("# ", "")

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """One notch frequency for all moves, and their acceleration."""
        facts = ("U", "Kalico pull request 939, docs/Jerk_Limiting.md", "NC program", "no")
        notch = Relation("notch", lambda x, q: x, lambda q: q["notch"])
        settings = (
            acceleration("ACCEL", PATH, "mm/s^2", 1.0, (1.0, 1.0, 1e6), facts,
                         "acceleration of moves"),
            Setting("NOTCH_FREQ", ALL, "Hz", "frequency that ramps leave alone", notch, 0.1, 5.0,
                    500.0, *facts),
        )  # fmt: skip
        fixed = today_of(machine, "velocity", "acceleration")
        path = shared_acceleration(machine, fixed)
        fixed["notch"] = np.full(len(AXES), 2.0 * float(no_shaper(machine)["filter_for"].max()))
        scheme = Scheme(
            self.name, "notch frequency", FAMILIES["notch-ramp"], fixed, settings, ((0, 1),),
            path, cannot=("two modes", "a notch of each axis"),
        )  # fmt: skip
        return {"notch": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Kalico's own commands."""
        by = {s.number: n for s, n in numbers}
        out = [f"SET_VELOCITY_LIMIT ACCEL={by['ACCEL']}"] if "ACCEL" in by else []
        if "NOTCH_FREQ" in by:
            out.append(f"SET_UNIFIED ENABLE=1 NOTCH_FREQ={by['NOTCH_FREQ']}")
        return out
