"""Controller `csv`: the streams as a table, for whatever plays samples or looks at them.

One row per interval: the rapid's line in the program, the time since its start, and the position of
every axis of the machine in program coordinates, in mm and degrees (a radius where the program
gives diameters). The first row is the exact start, the last the exact end. An axis that stands
still at a position that the program does not tell has `nan`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import ONE_FRAME, Controller, Options, decimal_step, step_sizes
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.emit.points.table import PvtTableController
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.stream import FINE_DECIMALS


class CsvController(Controller):
    """Writes ``block,t,X,Y,Z`` (contract: one row per interval)."""

    name = "csv"
    in_place = False
    joins = False
    apart = True
    suffix = ".csv"
    forms = PvtTableController.forms

    def in_form(self, form: str) -> Controller:
        """The emitter for points, or that for rows."""
        return PvtTableController() if form == "pvt" else super().in_form(form)

    def stride(self, interval: float) -> int:
        """Every interval is written."""
        return 1

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Multiples of the resolution, whatever the program's unit."""
        step = np.broadcast_to(step_sizes(machine, inch=False), rapids.start.shape)
        return NumberFormat(rapids.start, step, np.broadcast_to(0.0, rapids.start.shape))

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """What absolute positions count from."""
        return [ONE_FRAME] if plans.planned.any() else []

    def header(self, machine: Machine) -> bytes:
        """Name the columns."""
        return ",".join(["block", "t", *machine.axis_names]).encode() + b"\n"

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """Rows of each move."""
        return [
            self._rows(batch, row, int(rapids.line[batch.moves[row]])) for row in range(len(batch))
        ]

    def _rows(self, batch: Batch, row: int, line: int) -> bytes:
        """The rows of one move: the exact start, the rounded points, the exact end."""
        machine = batch.plans.machine
        t, positions = batch.positions(row)
        count = len(t) - 1
        interval, time_decimals = decimal_step(machine.interval)
        columns = [
            Column(b"", np.full(count - 1, line), 0),
            Column(b",", np.arange(1, count) * interval, time_decimals),
        ]
        moves = batch.plans.displacement[batch.moves[row]]
        for axis in machine.axes:
            k = AXES.index(axis.name)
            whole, decimals = decimal_step(axis.resolution)
            if moves[k]:
                decimals += FINE_DECIMALS if batch.fine[row, k] else 0
                columns.append(Column(b",", batch.whole[k][row, -count:-1] * whole, decimals))
            else:
                columns.append(Column(b"," + _exact(positions[0, k], decimals), None, 0))
        first = self._exact_row(machine, line, b"0", positions[0])
        last = self._exact_row(
            machine, line, _exact(count * machine.interval, time_decimals), positions[-1]
        )
        return first + (format_lines(columns, b"\n")[0] if count > 1 else b"") + last

    def _exact_row(
        self, machine: Machine, line: int, t: bytes, position: NDArray[np.float64]
    ) -> bytes:
        """One row in full precision."""
        fields = [b"%d" % line, t]
        for axis in machine.axes:
            fields.append(_exact(position[AXES.index(axis.name)], decimal_step(axis.resolution)[1]))
        return b",".join(fields) + b"\n"


def _exact(value: float, decimals: int) -> bytes:
    """A number with at least `decimals` decimals and as many more as it needs, up to twelve."""
    text = f"{value:.12f}"
    whole, _, fraction = text.partition(".")
    if not fraction:
        return text.encode()
    fraction = fraction[:decimals] + fraction[decimals:].rstrip("0")
    text = f"{whole}.{fraction}" if fraction else whole
    return (text[1:] if text.startswith("-") and not text.strip("-0.") else text).encode()
