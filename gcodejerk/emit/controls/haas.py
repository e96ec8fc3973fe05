"""Haas: streams as G1 blocks. No setting of jerk is known (industrialmonitordirect.com: none)."""

from __future__ import annotations

from gcodejerk.emit.controls.common import (
    unmeasured,
)
from gcodejerk.emit.gcode import GcodeController


class HaasController(GcodeController):
    """Haas mills."""

    name = "haas"
    highest_feed = "the machine's highest cutting feed"
    forms = (unmeasured("G1 blocks of 2 ms need high-speed machining (setting 191, G187)"),)
