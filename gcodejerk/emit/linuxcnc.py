"""Controller `linuxcnc`: the form that was played by the controller and compared."""

from __future__ import annotations

import numpy as np

from gcodejerk.emit.base import Form
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.nc import Rapids
from gcodejerk.plans import Plans


class LinuxcncController(GcodeController):
    """Writes G1 blocks of 2 ms with end-point speeds."""

    name = "linuxcnc"
    forms = (
        Form(
            "stream",
            "measured",
            "LinuxCNC 2.9: follows within 0.02 mm and 3 ms; needs G64, ARC_BLEND_ENABLE = 1 and "
            "MAX_ACCELERATION a little (5 %) above the axis's limit.acceleration",
        ),
    )

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """Where the machine file contradicts how LinuxCNC moves; what the program leaves open."""
        notes = []
        if plans.machine.positioning != "linear":
            notes.append(
                "LinuxCNC itself moves G0 in a straight line, but the machine file says "
                "positioning: independent; rapids of several axes are written as its dogleg"
            )
        open_mode = plans.planned & (rapids.path == 0)
        if open_mode.any():
            line = int(rapids.line[np.argmax(open_mode)])
            notes.append(
                f"line {line}: no G61 or G64 before this rapid: streams rely on G64, in which "
                "LinuxCNC usually starts; state it in the program, or in the machine file's "
                "program.startup"
            )
        return notes
