"""Controller `linuxcnc-hal`: sample-exact rapids for a LinuxCNC with a few HAL components more.

The samples stand in a file of their own beside the program (`part.ngc.streams`). The program names
it by its sum, in front of everything that moves (M152), and asks for each rapid by its number; the
HAL files that are installed with `gcodejerk install linuxcnc` play that rapid and no other.

Form `adaptive-feed`: one G1 along the rapid at its peak speed, scaled in every servo period by
`motion.adaptive-feed`. LinuxCNC's planner stays in charge: limits, abort and feed hold act. ::

    G0 X0.000001                 three tiny blocks of two kinds, between which LinuxCNC stops,
    G1 X0.000002 F0.6            so that the last begins at rest whatever was in front
    M67 E3 Q12                   asks for rapid 12 when that one begins
    G0 X0.000003
    G1 X9.999999 F2307.69        the rapid
    G0 X10.                      the block's own words: the exact end, and G0 in force
    G0 F600.                     the modal values that the program relies on

Form `position`: LinuxCNC makes its own G0 unseen, the drives get the samples. ::

    G4 P0.005                    the filter behind the planner has come to rest
    M68 E3 Q[12+1000000*[ABS[#[5210+20*#5220]]+ABS[#5420-1]]]
                                 asks for rapid 12; for none that there is where the coordinate
                                 system is turned (R of G10 L2, which the control keeps), and
                                 where X is not where the rapid begins
    G0 X10.                      the block's own words
    M66 P3 L3 Q3600              waits until the drives have LinuxCNC's own command again

A file of streams has a head, `gcodejerk streams 1 FORM INTERVAL`, and for each rapid a line
`rapid NUMBER LINE SAMPLES X Y Z BRAKING` (displacement [mm], braking [1/s^2]) with as many samples
below: the share of the peak speed at the end of each interval, or the share of the way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.emit.base import Controller, Form, Options
from gcodejerk.emit.frame import Frame, Spelled, frame_of
from gcodejerk.emit.gcode import LINE_ENDS, GcodeController
from gcodejerk.emit.hal_words import ADAPTIVE, POSITION, check_words
from gcodejerk.emit.linuxcnc import LinuxcncController
from gcodejerk.emit.number_format import Column, format_lines
from gcodejerk.errors import EmitError
from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Dialect, Program, Rapids
from gcodejerk.planning.batch import Batch, NumberFormat
from gcodejerk.planning.lines import Play
from gcodejerk.planning.plans import Plans
from gcodejerk.storage import made
from gcodejerk.units import MM_PER_INCH

LONGEST = 59_000
"""Samples of one rapid; all of them have to be in the FIFO (depth 60,000) when it begins."""
TINY = 1e-6
"""Length of the blocks around a rapid [mm]."""
TINY_FEED = 0.6
"""Their F [mm/min]."""
REST = 5
"""Periods after which the filter behind the planner is at rest; it has three."""
UNTURNED = b"ABS[#[5210+20*#5220]]"
"""0 where the coordinate system in force is not turned: #5230 is R of G54, #5250 that of G55."""
WHERE = 5420
"""Parameter that has X where the program is, in its own unit; Y and Z are the next two."""
START_DECIMALS = 9
DECIMALS = 10
"""Of the points in between; LinuxCNC computes in doubles."""
FEED_DECIMALS = 8
SAMPLE_DECIMALS = 12
"""Of a share: of a way of 1 m, half of 1e-9 mm."""
FINEST = 1e-9
"""Steps in which the samples are counted, which are written finer than that [mm]."""


class LinuxcncHalController(GcodeController):
    """Writes programs that ask for rapids by number, and the samples in a file beside them."""

    name = "linuxcnc-hal"
    unblended = "ABCUVW"
    beside = ".streams"
    longest = LONGEST
    forms = (
        Form(
            ADAPTIVE,
            "measured",
            "LinuxCNC 2.9: follows within 2 um, inside the planner; needs `gcodejerk install "
            "linuxcnc INI`, and MAX_ACCELERATION a little (5 %) above limit.acceleration",
        ),
        Form(
            POSITION,
            "measured",
            "LinuxCNC 2.9: the drives get the samples themselves; needs `gcodejerk install "
            "linuxcnc INI --form position`; feed hold waits for the end of the rapid",
        ),
    )

    def __init__(self, form: str = ADAPTIVE) -> None:
        self.form = form
        self.play = Play.SCALED if form == ADAPTIVE else Play.TABLE

    def in_form(self, form: str) -> Controller:
        """The emitter for one of its forms; `stream` is the first."""
        if form == "stream":
            return LinuxcncHalController()
        super().in_form(form)
        return LinuxcncHalController(form)

    def stride(self, interval: float) -> int:
        """Every interval is written."""
        return 1

    def check(self, machine: Machine, dialect: Dialect) -> None:
        """Refuse machines and programs that this form cannot serve."""
        if machine.positioning != "linear":
            raise EmitError(
                "controller linuxcnc-hal plays one law for all axes of a rapid, but the machine "
                "file says positioning: independent",
                "LinuxCNC moves in straight lines: say positioning: linear",
            )
        if dialect.name != "linuxcnc":
            raise EmitError(
                f"controller linuxcnc-hal asks for rapids in LinuxCNC's words (M67, M152), but the "
                f"program is read as {dialect.name}",
                "say --dialect linuxcnc, or choose another --controller",
            )

    def number_format(self, rapids: Rapids, machine: Machine, dialect: Dialect) -> NumberFormat:
        """As fine as a double, counted from the start."""
        self.check(machine, dialect)
        shape = rapids.start.shape
        origin = made(lambda part: np.nan_to_num(rapids.start[part]), shape)
        return NumberFormat(rapids.start, np.broadcast_to(FINEST, shape), origin)

    def unguardable(
        self, program: Program, source: BinaryIO, machine: Machine, dialect: Dialect
    ) -> NDArray[np.bool_]:
        """None; programs that say themselves what the form says are refused (`hal_words`)."""
        check_words(source, program.name, self.form)
        return super().unguardable(program, source, machine, dialect)

    def notes(self, rapids: Rapids, plans: Plans) -> list[str]:
        """What has to be installed, and how the form behaves at the machine."""
        if not plans.planned.any():
            return []
        notes = []
        if self.form == ADAPTIVE:
            notes += LinuxcncController().notes(rapids, plans)
            notes.append(
                "run it from its start: behind run-from-line the machine stands still at the first "
                "stream; streams are feed moves, rapid override does nothing to them; behind a "
                "feed hold, and at another feed override than 100 %, LinuxCNC's own trapezoid ends "
                "them"
            )
        else:
            notes.append(
                "run it from its start: behind run-from-line the machine stands still at the first "
                "stream; feed hold stops at the end of a rapid, abort in it, and then the machine "
                "has to be switched on again; overrides and the slider of the maximum velocity do "
                "nothing to a stream"
            )
        return notes

    def opening(self, newline: bytes, sums: tuple[int, int] = (0, 0)) -> bytes:
        """Lines in front of everything: nothing is asked for, the streams are checked and fed."""
        lines = [b"M68 E3 Q0", b"M152 P%08d Q%08d" % sums]
        lines += [b"M52 P1"] if self.form == ADAPTIVE else []
        return b"".join(line + newline for line in lines)

    def beside_header(self, machine: Machine) -> bytes:
        """Head of the file of streams."""
        return f"gcodejerk streams 1 {self.form} {machine.interval!r}\n".encode()

    def render_beside(self, batch: Batch, rapids: Rapids) -> list[bytes]:
        """Samples of each move."""
        out = []
        for row in range(len(batch)):
            law = _law(batch, row)
            samples = law.factors if self.form == ADAPTIVE else law.shares
            way = batch.plans.displacement[batch.moves[row]]
            limits = batch.plans.machine
            braking = min(
                axis.limit.acceleration / abs(way[AXES.index(axis.name)])
                for axis in limits.axes
                if way[AXES.index(axis.name)]
            )
            move = int(batch.moves[row])
            ways = " ".join(_number(value) for value in way[:3].tolist())
            head = (
                f"rapid {move + 1} {int(rapids.line[move])} {len(samples)} {ways} {braking:.12g}\n"
            )
            numbers = np.rint(samples * 10.0**SAMPLE_DECIMALS).astype(np.int64)
            text, _ = format_lines([Column(b"", numbers, SAMPLE_DECIMALS)], b"\n")
            out.append(head.encode() + text)
        return out

    def render(
        self,
        batch: Batch,
        rapids: Rapids,
        blocks: Sequence[bytes],
        newline: bytes,
        options: Options,
    ) -> list[bytes]:
        """Text of each move."""
        spelled, out = Spelled(rapids, options.dialect), []
        for row, move in enumerate(batch.moves.tolist()):
            last_end = LINE_ENDS[rapids.terminator[move]]
            line_end = newline if last_end in (b"", b"\r") else last_end
            frame = frame_of(spelled, move, blocks[row])
            adaptive = self.form == ADAPTIVE
            middle = self._adaptive(frame, batch, row) if adaptive else _position(frame, batch)
            lines = [*frame.head(options.comments), *middle]
            out.append(line_end.join(line for line in lines if line) + last_end)
        return out

    def _adaptive(self, frame: Frame, batch: Batch, row: int) -> list[bytes]:
        """The tiny blocks, the rapid, its own words."""
        law, points = _law(batch, row), _Points(frame, batch.plans.displacement)
        feed = law.peak * 60.0 / (MM_PER_INCH if frame.rapids.inch[frame.move] else 1.0)
        tiny = TINY_FEED / (MM_PER_INCH if frame.rapids.inch[frame.move] else 1.0)
        return [
            *frame.modes(),
            b"G0" + points.at(TINY),
            b"G1" + points.at(2.0 * TINY) + b" F%.4f" % tiny,
            b"M67 E3 Q%d" % (frame.move + 1),
            b"G0" + points.at(3.0 * TINY),
            b"G1" + points.at(law.length - TINY) + b" F%.*f" % (FEED_DECIMALS, feed),
            frame.last_point(points.reached, b"G0"),
            b" ".join([b"G0", *frame.restored()]),
            *frame.after(),
        ]


def _position(frame: Frame, batch: Batch) -> list[bytes]:
    """LinuxCNC's own rapid, between asking and waiting."""
    way = batch.plans.displacement[frame.move]
    elsewhere = b"+".join([UNTURNED, *_from_start(frame, way)])
    return [
        b"G4 P%g" % (REST * batch.grid.interval),
        b"M68 E3 Q[%d+1000000*[%b]]" % (frame.move + 1, elsewhere),
        frame.last_point({}, b"G0"),
        b"M66 P3 L3 Q3600",
        *frame.after(),
    ]


def _from_start(frame: Frame, way: Array) -> list[bytes]:
    """How far each axis that moves is from where the rapid begins; none in increments.

    The samples are ways from where the drives stand. Where that is not what was relied on (a wrong
    `program.start`), they would lead along the rapid's line, but beside it.
    """
    rapids, move = frame.rapids, frame.move
    if rapids.incremental[move]:
        return []
    unit = MM_PER_INCH if rapids.inch[move] else 1.0
    out = []
    for k in np.flatnonzero(way[:3]).tolist():
        # Where the program has diameters (G7), the parameter has the radius still.
        start = round(float(rapids.start[move, k]) / unit, START_DECIMALS)
        less = f"{-Decimal(repr(start)).normalize():+f}" if start else ""
        out.append(b"ABS[#%d%s]" % (WHERE + k, less.encode()))
    return out


def _number(value: float) -> str:
    """A length as it was meant."""
    return repr(round(value, 12) + 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Law:
    """How one move goes along its line: a sample at the end of each interval."""

    length: float
    """Of the way in X, Y and Z. [mm]"""
    shares: Array
    """Of the way, the last one 1. [-]"""
    factors: Array
    """Speed, of its peak, the last one 0. [-]"""
    peak: float
    """[mm/s]"""


def _law(batch: Batch, row: int) -> _Law:
    """The law of one move of a batch, from its longest axis."""
    way = batch.plans.displacement[batch.moves[row]]
    axis = int(np.argmax(np.abs(way)))
    count, dt = int(batch.grid.counts[row]), batch.grid.interval
    start = batch.number_format.start[row, axis]
    shares = (batch.exact[axis][row, -count:] - start) / way[axis]
    shares = np.clip(np.maximum.accumulate(shares), 0.0, 1.0)
    shares[-1] = 1.0
    length = float(np.linalg.norm(way[:3]))
    speed = np.maximum(batch.velocity[axis][row, -count:] / way[axis] * length, 0.0)
    speed[-1] = 0.0
    # LinuxCNC adds up the mean of the speeds at the ends of each period.
    inner = length - 4.0 * TINY
    speed *= inner / (dt * float(speed.sum()))
    peak = float(speed.max())
    return _Law(length, shares, speed / peak, peak)


class _Points:
    """Points along a rapid, as words in the program's own unit and distance mode."""

    def __init__(self, frame: Frame, displacement: Array) -> None:
        rapids, move = frame.rapids, frame.move
        self.way: NDArray[np.float64] = displacement[move]
        self.length = float(np.linalg.norm(self.way[:3]))
        self.unit = MM_PER_INCH if rapids.inch[move] else 1.0
        self.start, self.incremental = rapids.start[move], bool(rapids.incremental[move])
        self.diameter = bool(rapids.diameter[move])
        self.reached: dict[int, Decimal] = {}
        """How far each axis is from the start, in the program's unit."""

    def at(self, distance: float) -> bytes:
        """Axis words of the point this far from the start [mm]."""
        out = b""
        for k in np.flatnonzero(self.way).tolist():
            scale = (2.0 if self.diameter and AXES[k] == "X" else 1.0) / self.unit
            from_start = self.way[k] * distance / self.length
            value = from_start if self.incremental else self.start[k] + from_start
            number = Decimal(repr(round(float(value * scale), DECIMALS)))
            step = number - self.reached.get(k, Decimal(0)) if self.incremental else number
            self.reached[k] = number
            out += f" {AXES[k]}{step:.{DECIMALS}f}".encode()
        return out
