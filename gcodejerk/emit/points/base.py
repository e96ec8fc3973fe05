"""What the emitters of rows share: the head of the file, the titles of rapids, numbers as text.

Rule: every file says which gcodejerk, machine, controller and profile it is from and how sure its
facts are; every rapid has a title with its line in the program, and its peaks before and after
rounding. No line of a head or title has 70 characters or more.
"""

from __future__ import annotations

import math
import textwrap
from abc import abstractmethod
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from gcodejerk._version import __version__
from gcodejerk.axes import AXES
from gcodejerk.emit.base import CONFIRM, ONE_FRAME, Controller, Options, WithoutStreams
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.nc import Dialect, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.pvt import Rows

Array = NDArray[np.float64]

WIDTH = 68
PEAKS = "V, A, J: velocity, acceleration, jerk along the way, mm (deg), s"
UM_PER_MM = 1e3
MS_PER_S = 1e3


class PointsFile(Controller):
    """A controller whose points are a file of its own: its head, its comments, its sum."""

    in_place = False
    comment = "# "
    """In front of a comment."""
    facts: tuple[str, ...] = ()
    """What the text rests on, each with its mark."""
    unsure = False
    """Some of them are U or R."""
    relative = False
    """Rows count from where the rapid begins."""

    def in_form(self, form: str) -> Controller:
        """The emitter for one of its forms; `stream`, which says nothing else, is the first."""
        return self if form == "stream" else super().in_form(form)

    def header(self, machine: Machine) -> bytes:
        """Head of the file."""
        return self.commented(
            [
                f"gcodejerk {__version__} rows for {self.name}",
                f"machine: {plain(machine.name)}",
                f"profile: {machine.design.profile}",
                *self.facts,
                *([CONFIRM] if self.unsure else []),
                *self.about(machine),
                *([PEAKS] if self.play is Play.CUBIC else []),
            ]
        )

    def inert(self, machine: Machine) -> bool:
        """Whether the rows are comments, since something was not confirmed."""
        return False

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """That nothing would move; and what absolute positions count from."""
        if not plans.planned.any():
            return []
        counted = [] if self.relative else [ONE_FRAME]
        if not self.inert(plans.machine):
            return counted
        return [
            *counted,
            f"the rows for {self.name} are comments: they rest on facts that nobody could verify; "
            "the head of the file says what to confirm (docs/points.md)",
        ]

    def about(self, machine: Machine) -> list[str]:
        """Lines of the head about this machine."""
        return []

    def commented(self, lines: Sequence[str]) -> bytes:
        """Lines as comments, each short enough."""
        width = WIDTH - len(self.comment)
        short = [part for line in lines for part in textwrap.wrap(line, width) or [""]]
        return "".join(f"{self.comment}{line}\n" for line in short).encode("ascii", "replace")

    def footer(self, digest: str) -> bytes:
        """The sum of all in front."""
        return self.commented([f"sum {digest}"])


class PointsController(WithoutStreams, PointsFile):
    """A controller that is told rows of position, velocity and time."""

    play = Play.CUBIC

    def render_rows(self, rows: Rows, rapids: Rapids, blocks: Sequence[bytes]) -> list[bytes]:
        """A title and the rows of each move."""
        return [self.title(rows, k, rapids) + self.lines(rows, k, rapids) for k in range(len(rows))]

    def title(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """What stands in front of a move."""
        move = int(rows.moves[index])
        ways = [way(rapids, move, a) for a in rows.axes_of(index)]
        lines = [f"rapid at line {rapids.line[move]}: {', '.join(ways)}"]
        planned = float(rows.plans.counts[move] * rows.plans.machine.interval)
        times = (planned, duration(rows, index))
        for word, peaks, time in zip(("planned", "written"), rows.peaks, times, strict=True):
            V, A, J = peaks[:, index].tolist()
            lines.append(f"{word} V {V:.6g} A {A:.6g} J {J:.6g} in {time * MS_PER_S:.8g} ms")
        own, today = (f"{UM_PER_MM * amount:.6g}" for amount in left(rows, index))
        lines += in_band(rows.plans, move, float(rows.worst_in_band[index]))
        lines.append(f"leaves {own} um, today's rapid {today} um")
        return self.commented(lines)

    @abstractmethod
    def lines(self, rows: Rows, index: int, rapids: Rapids) -> bytes:
        """The rows of one move."""


class CyclicController(PointsFile):
    """A controller that is given a position in every cycle: whole counts, one interval apart."""

    play = Play.TABLE

    def end_steps(self, machine: Machine) -> Array:
        """Counts."""
        return 1.0 / counts_of(machine, self.name)

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """Counts from the program's zero, the ends too."""
        step = np.broadcast_to(self.end_steps(machine), rapids.start.shape)
        start = np.rint(rapids.start / step) * step
        return NumberFormat(start, step, np.zeros_like(start), finer=False)

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """A title and the counts of each move."""
        out = []
        for row, move in enumerate(batch.moves.tolist()):
            axes = np.flatnonzero(batch.plans.displacement[move]).tolist()
            first = batch.grid.knots.shape[1] - 1 - int(batch.grid.counts[row])
            counts = np.stack([batch.whole[a][row, first:] for a in axes], axis=1)
            ways = [way(rapids, move, a) for a in axes]
            modes = batch.plans.modes
            own, today = (
                UM_PER_MM * float(modes.grouped(each[row]).max(initial=0.0))
                for each in (batch.residual, batch.conventional_residual)
            )
            title = self.commented(
                [
                    f"rapid at line {rapids.line[move]}: {', '.join(ways)}",
                    *in_band(batch.plans, move, float(batch.worst_in_band[row])),
                    f"leaves {own:.6g} um, today's rapid {today:.6g} um",
                ]
            )
            out.append(title + self.points(batch.plans.machine, axes, counts))
        return out

    @abstractmethod
    def points(self, machine: Machine, axes: list[int], counts: NDArray[np.int64]) -> bytes:
        """The counts (k, axes) of a move as text."""


def in_band(plans: Plans, move: int, worst: float) -> list[str]:
    """What is left at worst where the modes are not where the machine file says."""
    today = float(plans.most_in_band[move])
    if not (math.isfinite(today) and math.isfinite(worst)) or not plans.has_to_gain:
        return []
    band = 100.0 * plans.machine.design.band
    own, today = UM_PER_MM * worst, UM_PER_MM * today
    return [f"at worst within {band:.3g} % of the modes {own:.6g} um, today's {today:.6g} um"]


def way(rapids: Rapids, move: int, axis: int) -> str:
    """From where to where an axis moves."""
    return f"{AXES[axis]} {rapids.start[move, axis]:.10g} to {rapids.target[move, axis]:.10g}"


def duration(rows: Rows, index: int) -> float:
    """How long a move lasts as written [s]."""
    return float(rows.time[rows.rows_of(index).stop - 1]) * rows.form.tick


def left(rows: Rows, index: int) -> tuple[float, float]:
    """The largest displacement that a mode keeps, and today's [mm]."""
    modes = rows.plans.modes
    own, today = (
        float(modes.grouped(each[index]).max(initial=0.0))
        for each in (rows.residual, rows.conventional_residual)
    )
    return own, today


def decimal(whole: int, places: int) -> str:
    """A whole number of the last place as text, without zeros at the end.

    Examples
    --------
    >>> decimal(-12500, 4), decimal(7, 3), decimal(0, 2), decimal(30, 0)
    ('-1.25', '0.007', '0', '30')
    """
    if not places:
        return str(whole)
    sign = "-" if whole < 0 else ""
    text = f"{abs(whole):0{places + 1}d}"
    digits = f"{text[:-places]}.{text[-places:]}".rstrip("0").rstrip(".")
    return f"{sign}{digits}"


def same_step(step: float) -> Array:
    """One step for all axes, shape (9,)."""
    return np.full(len(AXES), step)


def plain(text: str) -> str:
    """Text without what a comment cannot hold."""
    return "".join(c if c.isascii() and c.isprintable() and c not in "()" else "?" for c in text)


def counts_of(machine: Machine, controller: str, unit: str = "counts") -> Array:
    """Counts of every axis for 1 mm or 1 degree, shape (9,); 1 for letters without an axis.

    Raises
    ------
    EmitError
        The machine file does not say them of an axis.
    """
    given = machine.controller_options.counts_per_unit
    _known(given, machine, controller, f"{unit} per mm or degree", "counts_per_unit", "1000")
    return np.array([given.get(a, 1.0) if a in machine.axis_names else 1.0 for a in AXES])


def names_of(machine: Machine, controller: str, what: str, example: str) -> dict[str, str]:
    """What the controller calls every axis.

    Raises
    ------
    EmitError
        The machine file does not say it of an axis, or says the same of two.
    """
    given = machine.controller_options.axis_names
    _known(given, machine, controller, what, "axis_names", example)
    names = {axis: given[axis] for axis in machine.axis_names}
    if len(set(names.values())) < len(names):
        raise EmitError(
            f"controller_options.axis_names gives two axes the same name: {names}",
            f"give each axis its own {what}",
        )
    return names


def _known(
    given: Mapping[str, object],
    machine: Machine,
    controller: str,
    what: str,
    key: str,
    example: str,
) -> None:
    """Refuse a machine file that lacks something of an axis."""
    missing = [axis for axis in machine.axis_names if axis not in given]
    if missing:
        entries = ", ".join(f"{axis}: {example}" for axis in missing)
        raise EmitError(
            f"controller {controller} needs the {what} of axis {', '.join(missing)}, which the "
            "machine file does not say",
            f"add controller_options: {{{key}: {{{entries}}}}} to it, with your own values",
        )
