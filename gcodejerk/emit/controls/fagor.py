"""Fagor 8070 and 8065: acceleration and jerk of ramps in percent, from within a program.

G130/G131 scale accelerations, G132/G133 the jerks (8070 manual REF 1709 p. 415). Whether they act
on G0 is not said: unverified, so what is written asks.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import SettingsOnly, require_jerk
from gcodejerk.emit.sheets import today_of
from gcodejerk.machine import Machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import ALL, TODAY, Scheme, Setting, share_of_today

FACTS = ("U", "8070 manual REF 1709 p. 415; on G0 not verified", "NC program", "no")


class FagorController(SettingsOnly):
    """Fagor 8070 and 8065."""

    name = "fagor"
    forms = (Form("parameters", "unverified", "G131, G133; whether they act on G0 is not known"),)
    sheet_suffix = ".fagor.nc"

    def schemes(self, machine: Machine) -> Mapping[str, Scheme]:
        """Percentages of all axes."""
        require_jerk(machine, self.name)
        today = today_of(machine, "velocity", "acceleration", "jerk")
        fixed = today | {TODAY + name: today[name] for name in ("acceleration", "jerk")}
        settings = (
            Setting("G131", ALL, "%", "acceleration of all axes",
                    share_of_today("acceleration", 0.01), 1.0, 1.0, 100.0, *FACTS),
            Setting("G133", ALL, "%", "jerk of all axes", share_of_today("jerk", 0.01),
                    1.0, 1.0, 100.0, *FACTS),
        )  # fmt: skip
        scheme = Scheme(
            self.name, "acceleration and jerk in percent", FAMILIES["jerk-limited"], fixed,
            settings, ((0, 1),), notes=("SLOPETYPE has to be trapezoidal or square sine",),
            cannot=("a rise of the jerk unlike its fall",),
        )  # fmt: skip
        return {"program": scheme}

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """One block for each."""
        return [f"{s.number} {n}" for s, n in numbers]
