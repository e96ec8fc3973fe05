"""Dynomotion KFLOP with KMotionCNC: acceleration and jerk of G0.

G0 is third order with Velocity, Accel and Jerk of each axis in the board, in counts (dynomotion.com
wiki); the path of G1 is second order.
"""

from __future__ import annotations

from collections.abc import Sequence

from gcodejerk.emit.base import Form
from gcodejerk.emit.controls.common import (
    AxisJerks,
)
from gcodejerk.machine import Machine
from gcodejerk.parameters import Setting


class KflopController(AxisJerks):
    """Dynomotion KFLOP with KMotionCNC."""

    name = "kflop"
    forms = (Form("parameters", "documented", "Accel and Jerk of the axes, for G0 alone"),)
    facts = ("M", "dynomotion.com wiki; counts per mm are yours", "KMotion axis screen", "no")
    called = ("Accel", "Jerk")
    sheet_suffix = ".kflop-setup.txt"
    remark = ("// ", "")
    notes_for_user = (
        "the board counts in counts/s^2 and counts/s^3: multiply by your counts per mm",
        "G1 is second order here: streams of G1 would not be followed as planned",
    )

    def lines(self, machine: Machine, numbers: Sequence[tuple[Setting, str]]) -> list[str]:
        """Comments: the board wants counts."""
        return [f"// {s.axis}: {s.number} = {n} {s.unit} x counts/mm" for s, n in numbers]
