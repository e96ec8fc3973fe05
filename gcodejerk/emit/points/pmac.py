"""Controller `pmac`: Delta Tau Turbo PMAC, PVT moves of a motion program.

    PVT33.3335
    X0.925935:83.33375

- A PVT move is the unique cubic through position and velocity at both ends: M, Turbo PMAC2 PCI
  reference p. 463; PMAC user manual p. 200.
- With I42 = 0, the default, the time is 0 to 4095.9998 ms in steps of 1/4 us; TS, TA and F are not
  looked at; the moves stand between BLOCKSTART and BLOCKSTOP, the last velocity is 0: M, the same.
- Positions in user units, taken as mm and degrees here, absolute: the program has to be in ABS.
- ``X<position>:<velocity>`` and Isx90, the unit of time of velocities in ms: U. The lines are
  comments until the machine file has ``confirmed: [pmac-colon]`` and ``isx90``.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, decimal, same_step
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

TICK = 0.25e-6
"""Of I42 = 0. [s]"""
LONGEST = 16_383_999
"""4095.9998 ms. [ticks]"""
PLACES, SPEED_PLACES = 7, 5
"""Decimals of positions and velocities."""
ISX90 = 1000.0
"""Velocities per second, where the machine file says nothing. [ms]"""
COLON = "pmac-colon"


class PmacController(PointsController):
    """Writes blocks of PVT moves."""

    name = "pmac"
    suffix = ".pmc"
    form = "pvt"
    comment = "// "
    forms = (
        Form(
            "pvt",
            "unverified",
            "cubic PVT, times and limits as in the manual; the form X1:2 and Isx90 have to be "
            "confirmed: comments until then",
        ),
    )
    facts = (
        "PVT is cubic, 1/4 us, at most 4095.9998 ms: M (I42 = 0, ABS)",
        "X<position>:<velocity> and Isx90: U",
    )
    unsure = True

    def row_format(self, machine: Machine) -> RowFormat:
        """Quarters of a microsecond."""
        per_second = 1000.0 / (machine.controller_options.isx90 or ISX90)
        speed = same_step(per_second * 10.0**-SPEED_PLACES)
        return RowFormat(TICK, same_step(10.0**-PLACES), speed, longest=LONGEST)

    def about(self, machine: Machine) -> list[str]:
        """The units, and what is missing for live lines."""
        options = machine.controller_options
        said = options.isx90 or ISX90
        lines = [f"user units are mm and degrees; velocities per {said:g} ms (Isx90)"]
        if not _live(machine):
            lines.append(
                f"the lines are comments until controller_options has confirmed: [{COLON}] and "
                "isx90"
            )
        return lines

    def inert(self, machine: Machine) -> bool:
        """Until the colon form and Isx90 are confirmed."""
        return not _live(machine)

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """A block of moves."""
        part = rows.rows_of(index)
        axes = rows.axes_of(index)
        out = ["BLOCKSTART"]
        for row in range(part.start + 1, part.stop):
            ticks = int(rows.time[row] - rows.time[row - 1])
            words = [
                f"{AXES[a]}{decimal(int(rows.position[a][row]), PLACES)}:"
                f"{decimal(int(rows.velocity[a][row]), SPEED_PLACES)}"
                for a in axes
            ]
            out.append(f"PVT{decimal(25 * ticks, 5)} {' '.join(words)}")
        out.append("BLOCKSTOP")
        mark = "" if _live(rows.plans.machine) else self.comment
        return "".join(f"{mark}{line}\n" for line in out).encode()


def _live(machine: Machine) -> bool:
    """Whether everything unverified was confirmed."""
    options = machine.controller_options
    return COLON in options.confirmed and options.isx90 is not None
