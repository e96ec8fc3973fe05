"""Controller `acs`: ACS SPiiPlus, PVSPLINE.

    PVSPLINE (0,1)
    POINT (0,1), 0.925935, 1.5, 83.33375, 10, 34
    ENDS (0,1)

- PVSPLINE ... ENDS with POINT or MPOINT is cubic through positions and velocities: R, the index of
  an ACS manual, pages 164 and 171.
- The arguments (all positions, all velocities, the time in ms since the point before): U. The lines
  are comments until the machine file has ``confirmed: [acs-pvspline]``.

The numbers of the axes are those of ``axis_names`` (X: 0). Positions are mm and degrees.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, decimal, names_of, same_step
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

TICK = 1e-3
PLACES, SPEED_PLACES = 7, 5
CONFIRMED = "acs-pvspline"


class AcsController(PointsController):
    """Writes a spline for each rapid."""

    name = "acs"
    suffix = ".prg"
    form = "pvt"
    comment = "! "
    forms = (
        Form(
            "pvt",
            "unverified",
            "PVSPLINE is cubic; its arguments have to be confirmed: comments until then",
        ),
    )
    facts = (
        "PVSPLINE is cubic through positions and velocities: R",
        "arguments of PVSPLINE and POINT, time in ms: U",
    )
    unsure = True

    def require(self, machine: Machine) -> None:
        """A number for each axis."""
        for axis, number in names_of(machine, self.name, "number", '"0"').items():
            if not number.isdecimal():
                raise EmitError(
                    f"controller_options.axis_names.{axis} is {number!r}, expected a whole number",
                    "give the number of the axis on the controller, in quotes",
                )

    def row_format(self, machine: Machine) -> RowFormat:
        """Milliseconds."""
        return RowFormat(TICK, same_step(10.0**-PLACES), same_step(10.0**-SPEED_PLACES))

    def about(self, machine: Machine) -> list[str]:
        """Which number is which axis, and what is missing for live lines."""
        names = machine.controller_options.axis_names
        lines = [f"axis {names[a]} is {a}" for a in machine.axis_names]
        if CONFIRMED not in machine.controller_options.confirmed:
            lines.append(
                f"the lines are comments until controller_options has confirmed: [{CONFIRMED}]"
            )
        return lines

    def inert(self, machine: Machine) -> bool:
        """Until the arguments are confirmed."""
        return CONFIRMED not in machine.controller_options.confirmed

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """A spline."""
        part = rows.rows_of(index)
        options = rows.plans.machine.controller_options
        axes = rows.axes_of(index)
        group = "(" + ",".join(options.axis_names[AXES[a]] for a in axes) + ")"
        out = [f"PVSPLINE {group}"]
        for row in range(part.start + 1, part.stop):
            numbers = [
                *(decimal(int(rows.position[a][row]), PLACES) for a in axes),
                *(decimal(int(rows.velocity[a][row]), SPEED_PLACES) for a in axes),
                str(rows.time[row] - rows.time[row - 1]),
            ]
            out.append(f"POINT {group}, {', '.join(numbers)}")
        out.append(f"ENDS {group}")
        mark = "" if CONFIRMED in options.confirmed else self.comment
        return "".join(f"{mark}{line}\n" for line in out).encode()
