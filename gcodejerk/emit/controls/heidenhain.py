"""Heidenhain iTNC 530 and TNC: acceleration and jerk along the path of rapids.

MP1061.1 [m/s^2] and MP1090.1 [m/s^3] hold for FMAX and F above MP1092; MP1086 is the jerk of an
axis that moves by itself (iTNC 530 HSCI manual p. 813-815). Machine parameters are the machine
builder's: no program sets them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import SettingsOnly, acceleration, jerk
from gcodejerk.emit.sheets import today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import PATH, Scheme, Setting

FACTS = ("M", "iTNC 530 HSCI manual p. 813-815", "machine parameters (builder's level)", "no (RUN)")


class HeidenhainController(SettingsOnly):
    """Heidenhain iTNC 530 and TNC."""

    name = "heidenhain"
    forms = (Form("parameters", "documented", "MP1061.1, MP1090.1: a setup sheet for the builder"),)
    sheet_suffix = ".heidenhain-setup.txt"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """The path's acceleration and jerk at rapid."""
        today = today_of(machine, "velocity", "acceleration", "jerk")
        settings = (
            acceleration("MP1061.1", PATH, "m/s^2", 1e3, (0.01, 0.01, 1000.0), FACTS),
            jerk("MP1090.1", PATH, "m/s^3", 1e3, (0.1, 0.1, 1e6), FACTS),
        )
        own = {axis.name: axis.rapid for axis in machine.axes if not axis.rotary}
        limits = own or {axis.name: axis.rapid for axis in machine.axes}
        least_jerk = min(limit.jerk for limit in limits.values())
        path = {
            "acceleration": max(limit.acceleration for limit in limits.values()),
            "jerk": least_jerk,
        }
        scheme = Scheme(
            self.name, "path acceleration and jerk of rapids", FAMILIES["jerk-limited"],
            today | {"jerk": np.full(len(AXES), np.inf)}, settings, ((0, 1),), path,
            notes=(
                "new names: maxPathJerkHi (201505); give MP1086 of every axis the same jerk",
                "the jerk has to be MP1060^2 x 60000 / MP1010 at least (SI, mm/min)",
            ),
            cannot=("a rise of the jerk unlike its fall", "a jerk of each axis in one move"),
        )  # fmt: skip
        return {"path": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """A list for whoever sets them."""
        return [f"{s.number} = {n}        {s.unit}   {s.meaning}" for s, n in numbers]
