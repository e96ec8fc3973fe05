"""Controller `galil`: Galil DMC-40x0, 42x0 and 18x6, PVT mode.

    PVA=912,82444,34
    PVA=0,0,0
    BTA

- Each segment is a polynomial of third order; ``PVA=p,v,t`` has the distance in counts, relative,
  the speed at its end in counts/s and the time in samples; TM1000 has 1024 samples in a second;
  255 segments an axis; ``PVA=0,0,0`` ends, ``BTA`` or ``BTAB`` begins: M, galilmc.com servotrends
  10-09 (PVT mode), DMC-4040 manual p. 98. Not in -FAST firmware.
- The ranges of p, v and t: U. Segments longer than 2048 samples are split, which is never wrong;
  the numbers of a file are to be compared with the manual's ranges.

The letters of the axes are those of ``axis_names`` (X: A), the counts those of ``counts_per_unit``.
"""

from __future__ import annotations

import re

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import PointsController, counts_of, names_of
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Rapids
from gcodejerk.planning.pvt import Rows
from gcodejerk.planning.told import RowFormat

SAMPLES_PER_S = 1024.0
LONGEST = 2048
MOST = 255


class GalilController(PointsController):
    """Writes segments of PVT mode, axis by axis."""

    name = "galil"
    suffix = ".dmc"
    form = "pvt"
    comment = "REM "
    forms = (
        Form(
            "pvt",
            "documented",
            "DMC-40x0, 42x0, 18x6 at TM1000: counts and samples, at most 255 segments an axis; the "
            "ranges of the numbers are unverified",
        ),
    )
    facts = (
        "PVA=p,v,t: relative counts, counts/s, samples of 1/1024 s (TM1000): M",
        "ranges of p, v and t: U; at most 255 segments an axis: M",
    )
    unsure = True
    relative = True

    def require(self, machine: Machine) -> None:
        """Counts, and a letter for each axis."""
        counts_of(machine, self.name)
        for axis, letter in names_of(machine, self.name, "letter", "A").items():
            if not re.fullmatch("[A-H]", letter):
                raise EmitError(
                    f"controller_options.axis_names.{axis} is {letter!r}, expected a letter from "
                    "A to H",
                    "give the letter of the axis on the controller",
                )

    def row_format(self, machine: Machine) -> RowFormat:
        """Samples and counts."""
        count = 1.0 / counts_of(machine, self.name)
        return RowFormat(1.0 / SAMPLES_PER_S, count, count, LONGEST, MOST)

    def about(self, machine: Machine) -> list[str]:
        """Which letter is which axis, and its counts."""
        counts = machine.controller_options.counts_per_unit
        names = names_of(machine, self.name, "letter", "A")
        return [f"axis {names[a]} is {a}, {counts[a]:g} counts per unit" for a in names] + [
            "wait for the end of one rapid before the rows of the next"
        ]

    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """The segments of each axis, then the beginning of all."""
        part = rows.rows_of(index)
        names = rows.plans.machine.controller_options.axis_names
        out = []
        letters = ""
        for axis in rows.axes_of(index):
            letter = names[AXES[axis]]
            letters += letter
            position = rows.position[axis][part].tolist()
            velocity, time = rows.velocity[axis][part].tolist(), rows.time[part].tolist()
            for k in range(1, len(time)):
                p, t = position[k] - position[k - 1], time[k] - time[k - 1]
                out.append(f"PV{letter}={p},{velocity[k]},{t}")
            out.append(f"PV{letter}=0,0,0")
        out.append(f"BT{letters}")
        return "".join(f"{line}\n" for line in out).encode()
