"""Controller `json`: the same rows as one JSON document, for programs of one's own.

    {"gcodejerk": "0.1.0", "rows": 1, "controller": "json", "machine": "...", "profile": "...",
     "interpolation": "cubic Hermite", "units": {"t": "s", "X": "mm", "A": "deg"}, "rapids": [
      {"line": 4, "t": [0, 0.01], "X": {"position": [0, 1], "velocity": [0, 0]},
       "planned": {"velocity": 1, "acceleration": 1, "jerk": 1, "time": 0.01}, "written": {...}}]}

`sum` is the BLAKE2b (8 bytes) of all in front of the line that it stands on, line end left out.
`rows` is the version of this layout. A rapid has the axes that move, and no others. `planned` and
`written` are its peaks along the way, before and after rounding, in mm (or degrees) and s;
`residual` is the largest displacement that a mode keeps, in mm. A rapid
stands on a line of its own. Nobody's facts are needed.
"""

from __future__ import annotations

import json
from collections.abc import Sequence

from gcodejerk._version import __version__
from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, decimal, duration, left
from gcodejerk.emit.points.table import FINEST, PLACES, SPEED_PLACES, TIME_PLACES
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat


class JsonController(PointsController):
    """Writes the document."""

    name = "json"
    suffix = ".json"
    form = "pvt"
    forms = (Form("pvt", "measured", "read back and compared by the project's tests"),)
    between = b",\n"

    def row_format(self, machine: Machine) -> RowFormat:
        """As fine as doubles."""
        return FINEST

    def header(self, machine: Machine) -> bytes:
        """All but the rapids."""
        units = {axis.name: "deg" if axis.rotary else "mm" for axis in machine.axes}
        head = {
            "gcodejerk": __version__,
            "rows": 1,
            "controller": self.name,
            "machine": machine.name,
            "profile": machine.design.profile,
            "interpolation": "cubic Hermite",
            "units": {"t": "s", **units},
        }
        return json.dumps(head)[:-1].encode() + b', "rapids": [\n'

    def footer(self, digest: str) -> bytes:
        """The end of the document."""
        return b'\n], "sum": "%s"}\n' % digest.encode()

    def render_rows(self, rows: Rows, rapids: Rapids, blocks: Sequence[bytes]) -> list[bytes]:
        """The rows of each move, without titles."""
        return [self.lines(rows, k, rapids) for k in range(len(rows))]

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """One rapid as an object."""
        part, move = rows.rows_of(index), int(rows.moves[index])
        fields = [f'"line": {rapids.line[move]}']
        fields.append(f'"t": {_numbers(rows.time[part].tolist(), TIME_PLACES)}')
        for axis in rows.axes_of(index):
            position = _numbers(rows.position[axis][part].tolist(), PLACES)
            velocity = _numbers(rows.velocity[axis][part].tolist(), SPEED_PLACES)
            fields.append(f'"{AXES[axis]}": {{"position": {position}, "velocity": {velocity}}}')
        planned = float(rows.plans.counts[move] * rows.plans.machine.interval)
        for word, peaks, time in zip(
            ("planned", "written"), rows.peaks, (planned, duration(rows, index)), strict=True
        ):
            names = ("velocity", "acceleration", "jerk")
            values = dict(zip(names, peaks[:, index].tolist(), strict=True)) | {"time": time}
            rounded = {name: float(f"{value:.9g}") for name, value in values.items()}
            fields.append(f'"{word}": {json.dumps(rounded)}')
        fields.append(f'"residual": {left(rows, index)[0]:.6g}')
        return b"{" + ", ".join(fields).encode() + b"}"


def _numbers(values: list[int], places: int) -> str:
    """A list of numbers."""
    return "[" + ", ".join(decimal(value, places) for value in values) + "]"
