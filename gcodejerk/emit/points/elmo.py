"""Controller `elmo`: Elmo SimplIQ and Gold drives, PVT tables.

    X_position,X_velocity,time_ms
    963,85000,34

- Each row is the cubic from the row before; absolute counts, counts/s, and the time in ms since the
  row before: M, Harmonica manual p. 143, SimplIQ p. 151.
- The tables' names in the drive (QP, QV, QT) and the layout of files: U. The layout is ours; the
  rows go into the drive's tables by whatever the drive's own tool offers.

Counts are those of ``counts_per_unit``, from the program's zero: the drive's zero may be another.
"""

from __future__ import annotations

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, counts_of
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

TICK = 1e-3


class ElmoController(PointsController):
    """Writes a table for each rapid."""

    name = "elmo"
    suffix = ".csv"
    form = "pvt"
    forms = (
        Form(
            "pvt",
            "documented",
            "absolute counts, counts/s, relative ms; the layout of the file is ours, its way into "
            "QP, QV and QT unverified",
        ),
    )
    facts = (
        "cubic, absolute counts, counts/s, ms since the row before: M",
        "layout of the file: ours; names of the drive's tables (QP, QV, QT): U",
    )
    unsure = True

    def require(self, machine: Machine) -> None:
        """Counts."""
        counts_of(machine, self.name)

    def row_format(self, machine: Machine) -> RowFormat:
        """Milliseconds and counts."""
        count = 1.0 / counts_of(machine, self.name)
        return RowFormat(TICK, count, count)

    def about(self, machine: Machine) -> list[str]:
        """The counts."""
        counts = machine.controller_options.counts_per_unit
        return [f"{a}: {counts[a]:g} counts per unit" for a in machine.axis_names] + [
            "counts are from the program's zero: add the drive's own"
        ]

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """The names of the columns and the rows; the first is where the first segment ends."""
        part = rows.rows_of(index)
        axes = rows.axes_of(index)
        out = [",".join([f"{AXES[a]}_{what}" for a in axes for what in ("position", "velocity")])]
        out[0] += ",time_ms"
        for row in range(part.start + 1, part.stop):
            cells = [f"{rows.position[a][row]},{rows.velocity[a][row]}" for a in axes]
            out.append(",".join([*cells, str(rows.time[row] - rows.time[row - 1])]))
        return "".join(f"{line}\n" for line in out).encode()
