"""Controllers whose programs take streams, and of which nobody has measured how they follow them.

The points are right whatever the control does: they lie on the rapid's own path and end at its end.
F is the mean speed of each block, so a control that holds it is in time. What was not verified is
whether it does: a control that reads blocks slower than one in 2 ms, smooths them, or ramps between
them moves later than planned, and shakes otherwise. Each form says so.
"""

from __future__ import annotations

from gcodejerk.emit.base import Form
from gcodejerk.emit.gcode import GcodeController


def _form(note: str) -> tuple[Form, ...]:
    return (Form("stream", "unverified", f"{note}; watch a first run without a workpiece"),)


class FanucController(GcodeController):
    """Fanuc mills and lathes."""

    name = "fanuc"
    forms = _form(
        "G1 blocks of 2 ms need look-ahead (AI contour control) and its block processing time"
    )


class HaasController(GcodeController):
    """Haas mills."""

    name = "haas"
    forms = _form("G1 blocks of 2 ms need high-speed machining (setting 191, G187)")


class SiemensController(GcodeController):
    """Siemens 840D sl, 828D, ONE."""

    name = "siemens"
    forms = _form("G1 blocks of 2 ms need the IPO cycle and look-ahead that keep up with them")


class GrblController(GcodeController):
    """grbl and its kin."""

    name = "grbl"
    forms = _form(
        "G1 blocks of 2 ms need a stream that keeps the planner's buffer full; its trapezoids "
        "ramp within blocks"
    )


class MachController(GcodeController):
    """Mach3, Mach4, UCCNC."""

    name = "mach"
    forms = _form("G1 blocks of 2 ms need constant velocity mode (G64)")


class MarlinController(GcodeController):
    """Marlin."""

    name = "marlin"
    forms = _form("G1 blocks of 2 ms need a planner buffer that is fed fast enough")


class KlipperController(GcodeController):
    """Klipper."""

    name = "klipper"
    forms = _form("Klipper slows down at corners and by max_accel; an input shaper adds to this")
