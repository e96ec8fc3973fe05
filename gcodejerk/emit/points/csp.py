"""Controller `csp`: set-points for drives in CiA 402's cyclic synchronous position mode.

    cycle,X
    0,0
    1,0
    2,1

- 0x6060 = 8 is CSP, 0x607A the target position, a signed number of 32 bits; 0x60C2:01 and :02 are
  the cycle, a whole number to 255 times a power of ten of seconds; 0x60C0 = 0 interpolates in
  straight lines: M, Beckhoff infosys, AX8000 and AX5000.
- The file is a table of our own: whatever sends the set-points reads a row in each cycle.

The cycle is the machine's `interval`, the counts are those of ``counts_per_unit`` from the
program's zero: the drive's zero may be another, and no set-point may jump.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.emit.points.base import CyclicController, counts_of
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine

LARGEST = (1 << 31) - 1
MOST_VALUE = 255


class CspController(CyclicController):
    """Writes a table for each rapid, a row for each cycle."""

    name = "csp"
    suffix = ".csv"
    forms = (
        Form(
            "stream",
            "documented",
            "CiA 402 target positions (0x607A) in counts, one a cycle; the layout of the file is "
            "ours",
        ),
    )
    facts = (
        "0x6060 = 8 (CSP), 0x607A target position, I32: M",
        "0x60C0 = 0: straight lines between set-points: M",
        "layout of the file: ours; one row a cycle, counts",
    )

    def require(self, machine: Machine) -> None:
        """Counts, and a cycle that a drive can be told."""
        counts_of(machine, self.name)
        cycle(machine)

    def about(self, machine: Machine) -> list[str]:
        """The cycle and the counts."""
        value, power = cycle(machine)
        counts = machine.controller_options.counts_per_unit
        return [
            f"cycle {machine.interval:g} s: 0x60C2:01 = {value}, 0x60C2:02 = {power}",
            *(f"{a}: {counts[a]:g} counts per unit" for a in machine.axis_names),
            "counts are from the program's zero: add the drive's own",
        ]

    def points(self, machine: Machine, axes: list[int], counts: NDArray[np.int64]) -> bytes:
        """The names of the columns, and a row for each cycle from the start on."""
        if np.abs(counts).max() > LARGEST:
            raise EmitError(
                f"a position is {np.abs(counts).max()} counts, more than 32 bits hold",
                "check controller_options.counts_per_unit",
            )
        head = ",".join(["cycle", *(AXES[a] for a in axes)]).encode() + b"\n"
        columns = [Column(b"", np.arange(len(counts)), 0)]
        columns += [Column(b",", counts[:, k], 0) for k in range(len(axes))]
        return head + format_lines(columns, b"\n")[0]


def cycle(machine: Machine) -> tuple[int, int]:
    """The machine's interval as a number to 255 and a power of ten.

    Raises
    ------
    EmitError
        It is none.
    """
    for power in range(0, -7, -1):
        value = machine.interval * 10.0**-power
        if 1.0 - 1e-9 <= value <= MOST_VALUE + 0.5 and abs(value - round(value)) < 1e-6:
            return round(value), power
    raise EmitError(
        f"interval is {machine.interval:g} s, which no drive can be told: 0x60C2 holds a whole "
        "number to 255 times a power of ten",
        "set interval to the cycle of the bus, for example 0.001",
    )
