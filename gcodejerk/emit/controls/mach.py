"""Mach3, Mach4, UCCNC: streams as G1 blocks. No setting of jerk is known."""

from __future__ import annotations

from gcodejerk.emit.controls.common import (
    unmeasured,
)
from gcodejerk.emit.gcode import GcodeController


class MachController(GcodeController):
    """Mach3, Mach4, UCCNC."""

    name = "mach"
    forms = (unmeasured("G1 blocks of 2 ms need constant velocity mode (G64)"),)
