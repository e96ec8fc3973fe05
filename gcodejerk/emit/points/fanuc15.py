"""Controller `fanuc15`: the remote buffer of Fanuc's Series 15i, binary records. Experimental.

The file is what is sent: lines of text, a block ``G05`` that switches to binary, the records of a
rapid, and a record of zeros that returns to text.

- A record has 2 bytes for each axis, high byte first, axis 1 first, and a check byte: the sum of
  the others, 8 bits. A value is the distance in one unit time. A record of zeros ends: M,
  B-63322EN-1/01 pages 60 and 62. No auxiliary function is sent (parameter 7609#3 = 0).
- The unit time is parameter 7618 (bits 0 to 2): M; its codes: U. It has to be `interval`.
- The bits of the distance: U. ``fanuc_distance: general`` is two's complement of 16 bits,
  ``special`` of 14 bits in 7 and 7, each byte shifted left by one (7609#2, RDS). The weight, the
  least input increment, is what ``counts_per_unit`` says: U.
- Whether the control still accelerates after interpolation: U. If it does, the rapid is distorted.

The places of the axes in a record are those of ``axis_names`` (X: "1").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Form
from gcodejerk.emit.points.base import CyclicController, counts_of, names_of
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.planning.lines import Play

UNIT_TIMES = (0.001, 0.002, 0.004, 0.008)
"""[s]"""
LARGEST = {"general": (1 << 15) - 1, "special": (1 << 13) - 1}
"""Increments in a unit time."""


class Fanuc15Controller(CyclicController):
    """Writes text and binary records as they are sent."""

    name = "fanuc15"
    suffix = ".bin"
    comment = "("
    play = Play.INCREMENTS
    forms = (
        Form(
            "stream",
            "unverified",
            "experimental: 15i remote buffer; the layout of records is documented, the bits of "
            "distances have to be stated (fanuc_distance)",
        ),
    )
    facts = (
        "EXPERIMENTAL: 15I REMOTE BUFFER, LAYOUT OF RECORDS M",
        "BITS OF DISTANCES, UNIT TIME CODES, INCREMENT U",
        "UNKNOWN: ACCELERATION AFTER INTERPOLATION",
    )
    unsure = True

    def require(self, machine: Machine) -> None:
        """Increments, places in the record, the format of distances, the unit time."""
        counts_of(machine, self.name, "least increments")
        names = names_of(machine, self.name, "place in the record", '"1"')
        if sorted(names.values()) != sorted(str(k + 1) for k in range(len(names))):
            raise EmitError(
                f"controller_options.axis_names is {names}, expected the places from 1 to "
                f"{len(names)}",
                'number the axes as the control does, in quotes: {X: "1", Y: "2"}',
            )
        if machine.controller_options.fanuc_distance is None:
            raise EmitError(
                "controller fanuc15 needs the format of distances, which no manual at hand shows",
                "read parameter 7609#2 (RDS) and add controller_options: {fanuc_distance: general} "
                "for 1, special for 0",
            )
        if not any(abs(machine.interval - unit) < 1e-9 for unit in UNIT_TIMES):
            raise EmitError(
                f"interval is {machine.interval:g} s, expected a unit time of the remote buffer: "
                "0.001, 0.002, 0.004 or 0.008",
                "set interval to what parameter 7618 says",
            )

    def about(self, machine: Machine) -> list[str]:
        """Record, unit time and increments."""
        options = machine.controller_options
        n = len(machine.axes)
        rate = (2 * n + 1) * 11.0 / machine.interval
        order = sorted(machine.axis_names, key=lambda a: int(options.axis_names[a]))
        return [
            f"distances {options.fanuc_distance}, records of {2 * n + 1} bytes, axes "
            f"{' '.join(order)}",
            f"unit time {1e3 * machine.interval:g} ms (7618), at least {rate:.0f} bit/s",
            *(f"{a}: {options.counts_per_unit[a]:g} increments per unit" for a in order),
        ]

    def commented(self, lines: list[str]) -> bytes:  # type: ignore[override]
        """Lines in parentheses and capitals, the first letters of a Fanuc's code."""
        text = super().commented([line.translate(_PLAIN) for line in lines]).decode()
        return "".join(f"{line})\n" for line in text.upper().splitlines()).encode()

    def points(self, machine: Machine, axes: list[int], counts: NDArray[np.int64]) -> bytes:
        """The switch to binary, the records, and the return."""
        options = machine.controller_options
        assert options.fanuc_distance is not None
        steps = np.zeros((len(counts) - 1, len(machine.axes)), dtype=np.int64)
        for column, axis in enumerate(axes):
            steps[:, int(options.axis_names[AXES[axis]]) - 1] = np.diff(counts[:, column])
        moved = np.flatnonzero(steps.any(axis=1))
        steps = steps[moved[0] : moved[-1] + 1]
        largest = LARGEST[options.fanuc_distance]
        if np.abs(steps).max() > largest:
            raise EmitError(
                f"an axis moves {np.abs(steps).max()} increments in a unit time, more than the "
                f"{largest} of format {options.fanuc_distance}",
                "check controller_options.counts_per_unit, or lower limit.velocity",
            )
        return b"G05\n" + records(steps, options.fanuc_distance) + bytes(2 * steps.shape[1] + 1)


_PLAIN = {ord("("): None, ord(")"): None, ord("'"): None}


def records(steps: NDArray[np.int64], form: str) -> bytes:
    """Records of increments, shape (k, axes).

    Examples
    --------
    >>> records(np.array([[100, -50, 0]]), "general").hex(" ").upper()
    '00 64 FF CE 00 00 31'
    >>> records(np.array([[100, -50, 0]]), "special").hex(" ").upper()
    '00 C8 FE 9C 00 00 62'
    """
    k, n = steps.shape
    out = np.zeros((k, 2 * n + 1), dtype=np.uint8)
    if form == "general":
        whole = steps & 0xFFFF
        out[:, 0:-1:2], out[:, 1:-1:2] = whole >> 8, whole & 0xFF
    else:
        whole = steps & 0x3FFF
        out[:, 0:-1:2], out[:, 1:-1:2] = (whole >> 7) << 1, (whole & 0x7F) << 1
    out[:, -1] = out[:, :-1].sum(axis=1, dtype=np.int64) & 0xFF
    return out.tobytes()
