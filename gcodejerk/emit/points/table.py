"""Controller `csv`, form `pvt`: rows of position and velocity as a table.

``block,t,X,X_velocity,...`` in s, mm and mm/s (degrees for rotary axes, radii where the program
gives diameters): one row for each boundary of a segment, the first at the start, the last at the
end, both at rest. The motion is the cubic Hermite between rows. An axis that stands still at a
position that the program does not tell has ``nan``. Nobody's facts are needed.
"""

from __future__ import annotations

from collections.abc import Sequence

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, decimal, same_step
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

TIME_PLACES, PLACES, SPEED_PLACES = 9, 9, 6
"""Decimals of times [s], positions [mm] and velocities [mm/s]."""
FINEST = RowFormat(10.0**-TIME_PLACES, same_step(10.0**-PLACES), same_step(10.0**-SPEED_PLACES))
"""For a reader that computes in doubles."""


class PvtTableController(PointsController):
    """Writes the table; `csv.CsvController` leads here."""

    name = "csv"
    suffix = ".csv"
    form = "pvt"
    forms = (
        Form("stream", "measured", "read back and compared by the project's tests"),
        Form("pvt", "measured", "read back and compared by the project's tests"),
    )

    def row_format(self, machine: Machine) -> RowFormat:
        """As fine as doubles."""
        return FINEST

    def header(self, machine: Machine) -> bytes:
        """Name the columns."""
        names = [name for axis in machine.axis_names for name in (axis, f"{axis}_velocity")]
        return ",".join(["block", "t", *names]).encode() + b"\n"

    def footer(self, digest: str) -> bytes:
        """A table has none."""
        return b""

    def render_rows(self, rows: Rows, rapids: Rapids, blocks: Sequence[bytes]) -> list[bytes]:
        """The rows of each move, without titles."""
        return [self.lines(rows, k, rapids) for k in range(len(rows))]

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """The rows of one move."""
        part = rows.rows_of(index)
        move = int(rows.moves[index])
        moving = rows.axes_of(index)
        columns = [
            [str(rapids.line[move])] * (part.stop - part.start),
            [decimal(t, TIME_PLACES) for t in rows.time[part].tolist()],
        ]
        for axis in rows.plans.machine.axis_names:
            k = AXES.index(axis)
            if k in moving:
                columns.append([decimal(x, PLACES) for x in rows.position[k][part].tolist()])
                columns.append([decimal(x, SPEED_PLACES) for x in rows.velocity[k][part].tolist()])
            else:
                columns.append([standing(float(rapids.start[move, k]))] * len(columns[0]))
                columns.append(["0"] * len(columns[0]))
        return "".join(",".join(row) + "\n" for row in zip(*columns, strict=True)).encode()


def standing(position: float) -> str:
    """Where an axis stands that does not move; nan where nobody knows.

    Examples
    --------
    >>> standing(12.5), standing(float("nan")), standing(-0.0), standing(25.4 * 0.3)
    ('12.5', 'nan', '0', '7.62')
    """
    text = f"{position:.12f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
