"""Controller `linuxcnc`: the form that was played by the controller and compared.

It was measured to follow a profile best (LinuxCNC 2.9, servo period 1 ms): blocks of 2 ms, each
with F = the larger of the profile's speeds at the block's two ends, since LinuxCNC reaches F at the
end of a servo period, and ends a block with the smaller of its own F and the next one's. Blocks of
1 ms would be stretched by 2 % (TP_MIN_SEGMENT_CYCLES).

LinuxCNC 2.9 blends blocks of X, Y and Z alone: where A, B, C, U, V or W moves, it stops after every
block, and a stream of 112 ms was played in 515 ms (A and U alike).
"""

from __future__ import annotations

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.feeds import Feeds, end_feeds
from gcodejerk.emit.gcode import GcodeController
from gcodejerk.machine import LINUXCNC
from gcodejerk.nc import Rapids
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import Batch

STREAMS_NEED = 1.05
"""MAX_ACCELERATION over the largest acceleration of a stream, played: 1.05 to 4 times."""


class LinuxcncController(GcodeController):
    """Writes G1 blocks of 2 ms with end-point speeds."""

    name = "linuxcnc"
    play = Play.PROFILE
    unblended = "ABCUVW"
    forms = (
        Form(
            "stream",
            "measured",
            "LinuxCNC 2.9: follows within 0.02 mm and 3 ms; needs G64, ARC_BLEND_ENABLE = 1 and "
            "MAX_ACCELERATION a little (5 %) above the axis's limit.acceleration",
        ),
    )

    def feeds(self, batch: Batch, rapids: Rapids) -> Feeds:
        """The larger of the speeds at the ends of each block."""
        return end_feeds(batch, rapids)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """Where the machine file contradicts how LinuxCNC moves; what the program leaves open."""
        notes = []
        if plans.machine.positioning != "linear":
            notes.append(
                "LinuxCNC itself moves G0 in a straight line, but the machine file says "
                "positioning: independent; rapids of several axes are written as its dogleg"
            )
        notes += _too_slow(plans)
        open_mode = plans.planned & (rapids.path == 0)
        if open_mode.any():
            line = int(rapids.line[np.argmax(open_mode)])
            notes.append(
                f"line {line}: no G61 or G64 before this rapid: streams rely on G64, in which "
                "LinuxCNC usually starts; state it in the program, or in the machine file's "
                "program.startup"
            )
        return notes


def _too_slow(plans: Plans) -> list[str]:
    """What the INI file has to allow before streams run, where today's rapids have less."""
    raised = []
    for axis in plans.machine.axes:
        today, needed = axis.rapid.acceleration, STREAMS_NEED * axis.limit.acceleration
        moves = plans.planned & (plans.displacement[:, AXES.index(axis.name)] != 0.0)
        if axis.planner == LINUXCNC and today < needed * (1.0 - 1e-6) and moves.any():
            raised.append(f"{axis.name} from {today:g} to {needed:g}")
    if not raised:
        return []
    return [
        f"before this program runs, raise MAX_ACCELERATION of {', '.join(raised)} (1.05 times "
        "limit.acceleration), or LinuxCNC plays the streams slower; rapids that were left alone "
        "then use it, too"
    ]
