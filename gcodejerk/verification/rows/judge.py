"""Rows against the program and the machine: whether they may be, where they lead, and how.

Rule: what rounding explains is no violation, and nothing else is excused: the tolerance of every
check is what half a step of position and of velocity can do to it, and even that is no more than a
twentieth of a limit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.nc import CERTAIN, Rapids
from gcodejerk.verification.findings import Findings, Kind
from gcodejerk.verification.physics.dynamics import check_dynamics
from gcodejerk.verification.physics.independent import middle
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.own_rapids import (
    conventional_counts,
    left_by_rapids,
    longest_times,
    own_times,
    rapid_limits,
)
from gcodejerk.verification.physics.points import (
    STANDSTILL,
    TINY,
    Array,
    Index,
    Paths,
    check_line,
    check_rapids,
    resolutions,
)
from gcodejerk.verification.physics.residual import band_of
from gcodejerk.verification.rows.files import RowsFile
from gcodejerk.verification.rows.limits import WITHIN, passed_limits
from gcodejerk.verification.rows.motion import Pieces
from gcodejerk.verification.rows.moves import Move, Steps
from gcodejerk.verification.rows.readers import CYCLIC

ENDS_AT_ZEROS = "fanuc15"
"""Whose records of zeros end a stream: it has none where the motion begins and ends slowly."""
FIRST = 4
"""Frequencies of the band at which all moves are looked at."""
BATCH = 500
"""Moves that are judged at a time."""
MORE_TICKS = 2.5
"""Ticks that a move may last longer than whole intervals, or the ticks that those begin."""
STATED = 2e-3
"""Share by which the residual that a file states may be off: its digits, and float64."""
RELATIVE, SHORTEST = 0.02, 1.1
"""Share by which rows may leave more than today's rapid; times the tolerance, of `shortest`."""
UNJUDGED = "conventional"
"""A profile that is written whether or not it leaves less than today's rapid, which it is."""


def judge_rows(file: RowsFile, rapids: Rapids, machine: Machine, found: Findings) -> list[int]:
    """Judge a file of rows; indices of the rapids that it replaces."""
    replaced: list[int] = []
    moves = _matched(file, rapids, machine, found, replaced)
    while not found.full and (batch := list(islice(moves, BATCH))):
        if file.name in CYCLIC:
            _judge_points(batch, file, rapids, machine, found)
            continue
        _Judge([m for _, m in batch], [i for i, _ in batch], file, rapids, machine, found).run()
    return replaced


def _matched(
    file: RowsFile, rapids: Rapids, machine: Machine, found: Findings, replaced: list[int]
) -> Iterator[tuple[int, Move]]:
    """Moves with their rapids, complete with their start; what does not fit is told."""
    known = sum(1 << AXES.index(axis) for axis in machine.axis_names)
    at = 0
    for move in file.moves():
        i = int(np.searchsorted(rapids.line, move.rapid))
        problem = ""
        if i >= len(rapids) or rapids.line[i] != move.rapid:
            problem = f"line {move.rapid} of the program is no rapid"
        elif i < at:
            problem = f"rapid of line {move.rapid} is out of order"
        elif rapids.reason[i] != CERTAIN:
            problem = f"rapid of line {move.rapid} had to be left alone"
        elif int(rapids.words[i]) & ~known:
            problem = f"rapid of line {move.rapid} moves an axis that the machine does not have"
        if problem:
            found.add(Kind.TABLE, move.line, None, problem)
            continue
        at = i + 1
        whole = _framed(move, i, file, rapids, found)
        if whole is not None:
            replaced.append(i)
            yield i, whole


def _framed(move: Move, i: int, file: RowsFile, rapids: Rapids, found: Findings) -> Move | None:
    """Check axes, times and ends; the move with its start, None where it is beyond judging."""
    steps, axes = file.steps, list(move.axes)

    def complain(kind: Kind, problem: str) -> None:
        found.add(kind, move.line, int(rapids.line[i]), problem)

    if len(move.t) < 2 or move.position.shape != (len(move.t), len(axes)):
        complain(Kind.TABLE, "a motion has at least two rows")
        return None
    start, target = rapids.start[i], rapids.target[i]
    step = steps.position[axes]
    if np.isnan(start[axes]).any():
        complain(Kind.AXES, "an axis is named whose position nobody knows")
        return None
    begin, end = (np.rint(where[axes] / step) * step for where in (start, target))
    position = move.position.copy()
    if move.relative:
        position += begin
    elif np.isnan(position[0]).any():
        position[0] = begin
    if not np.isfinite(position).all() or not np.isfinite(move.velocity).all():
        complain(Kind.TABLE, "nan stands for what the program does not tell, and only for that")
        return None
    if not _timed(move, steps, complain):
        return None
    near = 1e-4 * step + 1e-12 * np.maximum(np.abs(begin), np.abs(end)) + 1e-13
    for what, kind, row, wanted, told in (
        ("begins", Kind.START, 0, begin, start),
        ("ends", Kind.END, -1, end, target),
    ):
        for k in np.flatnonzero(np.abs(position[row] - wanted) > near).tolist():
            at, said = position[row, k], told[axes[k]]
            complain(kind, f"{AXES[axes[k]]} {what} at {at:.12g}, the program says {said:.12g}")
        if move.velocity[row].any():
            complain(kind, "the motion is not at rest there: its velocity is not 0")
    moved = np.abs(np.rint(target / steps.position) - np.rint(start / steps.position)) > 0.0
    moved &= np.abs(target - start) > STANDSTILL
    for a in np.flatnonzero(moved).tolist():
        if a not in axes:
            complain(Kind.AXES, f"axis {AXES[a]} does not move, and the block moves it")
    strays = (np.ptp(position, axis=0) > near) | move.velocity.any(axis=0)
    for k in np.flatnonzero(strays & ~moved[axes])[:1].tolist():
        complain(Kind.AXES, f"axis {AXES[axes[k]]} moves, which the block does not move")
        return None
    return replace(move, position=position, relative=False)


def _timed(move: Move, steps: Steps, complain: Callable[[Kind, str], None]) -> bool:
    """Whether the times of a motion can be judged further: they rise from 0 in whole ticks."""
    gaps = np.diff(move.t)
    ticks = move.t / steps.tick
    # float64 of a decimal time in ticks of 1 ns
    slack = 1e-3 + 4e-16 * np.abs(ticks)
    if move.t[0] != 0.0 or (gaps <= 0.5 * steps.tick).any():
        complain(Kind.TIME, "the times of the rows do not rise from 0")
        return False
    if (np.abs(ticks - np.rint(ticks)) > slack).any():
        complain(Kind.TIME, f"a time is no whole number of ticks of {steps.tick:g} s")
    if (gaps > steps.longest * (1.0 + WITHIN)).any() or len(gaps) > steps.most:
        complain(Kind.TIME, "a segment is longer, or there are more, than the controller can take")
    return True


def _judge_points(
    batch: list[tuple[int, Move]], file: RowsFile, rapids: Rapids, machine: Machine, found: Findings
) -> None:
    """Judge points that are an interval apart like those of a stream."""
    moves = [move for _, move in batch]
    ends = _ends(np.array([i for i, _ in batch], dtype=np.int64), moves, rapids, machine)
    own = np.array([len(move.t) for move in moves], dtype=np.int64)
    missing = lead = np.zeros(len(own), dtype=np.int64)
    if file.name == ENDS_AT_ZEROS:
        missing = np.maximum(conventional_counts(ends, machine)[0] + 1 - own, 0)
        lead = _still_at_first(moves, ends, machine, missing)
    size = own + missing
    end = np.cumsum(size)
    step = file.steps.position
    start = np.rint(ends.start / step) * step
    named = np.zeros(start.shape, dtype=np.bool_)
    position = np.repeat(start, size, axis=0)
    for k, move in enumerate(moves):
        named[k, list(move.axes)] = True
        first, axes = end[k] - size[k] + lead[k], list(move.axes)
        position[first : first + own[k], axes] = move.position
        position[first + own[k] : end[k], axes] = move.position[-1]
    moved = np.rint((ends.start + ends.displacement) / step) * step - start
    paths = replace(
        ends,
        line=ends.line + 1,
        begin=end - size,
        end=end,
        position=position,
        feed=np.full(len(position), np.nan),
        start=start,
        displacement=np.where(named & (ends.displacement != 0.0), moved, 0.0),
        step=np.tile(step, (len(moves), 1)),
    )
    check_rapids(ends, rapids, machine, found)
    check_line(paths, machine, found)
    if (paths.displacement != 0.0).any(axis=1).all():
        # The control's own rapid lasts as long as the program's way does, not as that in steps.
        way = np.where(paths.displacement != 0.0, ends.displacement, 0.0)
        check_dynamics(replace(paths, displacement=way), machine, 1, found)


def _still_at_first(moves: list[Move], ends: Paths, machine: Machine, missing: Index) -> Index:
    """How many of the records that are missing stood in front of each motion, shape (moves,).

    The axes moved at the mean moments of their own rapids, which are half of their times.
    """
    if machine.positioning == "linear":
        return missing // 2
    usual, _ = own_times(ends, machine)
    early = np.zeros(len(moves))
    for k, move in enumerate(moves):
        way = move.position[-1] - move.position[0]
        goes = way != 0.0
        if not goes.any():
            continue
        left = (move.position[-1] - move.position)[:, goes] / way[goes]
        # The trapezoids of all intervals add up to the mean moment.
        mean = left.sum(axis=0) - 0.5
        own = 0.5 * usual[k, np.array(move.axes)[goes]] / machine.interval
        early[k] = np.mean(own - mean)
    return np.clip(np.rint(early).astype(np.int64), 0, missing)


class _Judge:
    """Some moves at once."""

    def __init__(
        self,
        moves: list[Move],
        index: list[int],
        file: RowsFile,
        rapids: Rapids,
        machine: Machine,
        found: Findings,
    ) -> None:
        self.moves, self.file, self.machine, self.found = moves, file, machine, found
        self.rapids = rapids
        self.pieces = Pieces.of(moves, file.steps)
        self.paths = _ends(np.array(index, dtype=np.int64), moves, rapids, machine)
        self.displacement = np.zeros((len(moves), len(AXES)))
        for k, move in enumerate(moves):
            self.displacement[k, list(move.axes)] = move.position[-1] - move.position[0]
        steps = 0.5 * file.steps.position
        self.displacement[np.abs(self.displacement) < steps] = 0.0
        self.moving = self.displacement != 0.0
        self.of_piece = self.moving[self.pieces.owner]

    def run(self) -> None:
        """Every check."""
        check_rapids(self.paths, self.rapids, self.machine, self.found)
        if not self.moving.any(axis=1).all():
            return
        self._check_duration()
        self._check_limits()
        self._check_steps()
        self._check_way()
        self._check_residual()

    def _complain(self, kind: Kind, moves: Index | NDArray[np.bool_], problem: str) -> None:
        """Note a violation for each of some moves."""
        index = np.flatnonzero(moves) if moves.dtype == np.bool_ else np.unique(moves)
        for k in index.tolist():
            self.found.add(kind, self.moves[k].line, self.moves[k].rapid, problem)

    def _check_duration(self) -> None:
        """No longer than the rapid may last; under independent positioning, no axis."""
        interval, tick = self.machine.interval, self.file.steps.tick
        most = longest_times(self.paths, self.machine)
        late = self.pieces.total > (np.ceil(most / tick - WITHIN) + MORE_TICKS) * tick
        self._complain(Kind.TIME, late, "the motion lasts longer than the rapid may")
        if self.machine.positioning == "linear":
            return
        usual, longest = own_times(self.paths, self.machine)
        pieces = self.pieces
        end = self.displacement[pieces.owner]
        size = np.where(self.of_piece, np.abs(end), 1.0)
        own = (longest + interval + MORE_TICKS * tick)[pieces.owner]
        left = np.abs(end - pieces.p1) * self.of_piece
        after = (pieces.begin + pieces.T)[:, np.newaxis] >= own
        step = self.file.steps.position
        off = after & (left > step + TINY)
        self._complain(
            Kind.TIME, pieces.owner[off.any(axis=1)], "an axis arrives later than its own rapid may"
        )
        # The mean moment of the motion moves with any delay.
        T = pieces.T[:, np.newaxis]
        mean = 0.5 * T * (pieces.p0 + pieces.p1) + T**2 * (pieces.v0 - pieces.v1) / 12.0
        area = np.add.reduceat((T * end - mean) / np.where(end != 0.0, end, 1.0) * self.of_piece,
                               pieces.first[:-1], axis=0)  # fmt: skip
        low, high = middle(self.machine)
        error = interval + MORE_TICKS * tick + (step / size[pieces.first[:-1]]) * longest
        wrong = (area < 0.5 * low * usual - error) | (area > 0.5 * high * longest + error)
        self._complain(
            Kind.TIME,
            (wrong & self.moving).any(axis=1),
            "an axis moves earlier or later than by its own profile",
        )

    def _check_limits(self) -> None:
        for kind, moves, problem in passed_limits(self.pieces, self.displacement, self.machine):
            self._complain(kind, moves, problem)

    def _check_steps(self) -> None:
        """The acceleration is continuous, and 0 at both ends."""
        pieces = self.pieces
        blur = pieces.blur()[1]
        begin, end = pieces.accelerations
        first = np.zeros(len(begin), dtype=np.bool_)
        first[pieces.first[:-1]] = True
        before = np.where(first[:, np.newaxis], 0.0, np.roll(end, 1, axis=0))
        excuse = blur + np.where(first[:, np.newaxis], 0.0, np.roll(blur, 1, axis=0))
        size = np.abs(begin).max(axis=0, initial=0.0)
        bad = (np.abs(begin - before) > excuse + WITHIN * size) & self.of_piece
        last = pieces.first[1:] - 1
        bad[last] |= (np.abs(end[last]) > blur[last] + WITHIN * size) & self.moving
        self._complain(Kind.JERK, pieces.owner[bad.any(axis=1)], "the acceleration steps at a row")

    def _check_way(self) -> None:
        """Forwards, not past the end, and straight where the axes move together."""
        pieces = self.pieces
        sign = np.sign(self.displacement)[pieces.owner]
        blur = pieces.blur()[0]
        low = np.minimum(
            pieces.velocity(pieces.turning()) * sign, np.minimum(pieces.v0 * sign, pieces.v1 * sign)
        )
        end = np.abs(self.displacement)[pieces.owner]
        step = self.file.steps.position
        past = (pieces.p1 * sign > end + step) | (pieces.p1 * sign < -step)
        back = ((low < -blur - WITHIN) | past) & self.of_piece
        problem = "the motion goes backwards or past the end"
        self._complain(Kind.BACKWARDS, pieces.owner[back.any(axis=1)], problem)
        if self.machine.positioning != "linear":
            return
        off, may = pieces.off_line(self.displacement)
        bad = (off > may + TINY) & self.of_piece
        self._complain(
            Kind.LINE, pieces.owner[bad.any(axis=1)], "the motion leaves the straight line"
        )

    def _check_residual(self) -> None:
        """No more than the file states, and no more than today's rapid leaves over the band."""
        modes = Oscillators.of(self.machine)
        if not len(modes.poles):
            return
        nominal = modes.largest(self.pieces.response(modes))
        for k, move in enumerate(self.moves):
            # Lines of a spectrum are other oscillators there than here.
            if move.residual is None or not modes.banded.all():
                continue
            most = STATED * max(move.residual, nominal[k]) + 1e-9
            if not abs(nominal[k] - move.residual) <= most:
                problem = (
                    f"leaves {1e3 * nominal[k]:.6g} um of vibration, the file says "
                    f"{1e3 * move.residual:.6g} um"
                )
                self.found.add(Kind.RESIDUAL, move.line, move.rapid, problem)
        if self.machine.design.profile == UNJUDGED:
            return
        band = band_of(self.machine, modes, float(self.pieces.total.max()))
        left = np.zeros(len(nominal))
        for factor in band.tolist():
            around = modes.at(factor)
            left = np.maximum(left, around.largest(self.pieces.response(around)))
        # Nearly every move leaves less by far: only the others are looked at closely.
        allowed = self._allowed(np.arange(len(left)), modes, band[:FIRST])
        suspects = np.flatnonzero(~(left <= allowed + TINY))
        if len(suspects):
            whole = self._allowed(suspects, modes, band[FIRST:])
            allowed[suspects] = np.maximum(allowed[suspects], whole)
        for k in np.flatnonzero(~(left <= allowed + TINY)).tolist():
            problem = (
                f"leaves {1e3 * left[k]:.3g} um of vibration, at most {1e3 * allowed[k]:.3g} um "
                "are left by the controller's own rapid"
            )
            self.found.add(Kind.RESIDUAL, self.moves[k].line, self.moves[k].rapid, problem)

    def _allowed(self, moves: Index, modes: Oscillators, band: Array) -> Array:
        """What some moves may leave, by the control's own rapids at these frequencies [mm]."""
        limits = rapid_limits(self.paths, self.machine)[:, moves]
        own = left_by_rapids(self.paths.displacement[moves], self.machine, limits)
        allowed = np.zeros(len(moves))
        for factor in band.tolist():
            around = modes.at(factor)
            allowed = np.maximum(allowed, around.largest(np.abs(own(around))))
        allowed *= 1.0 + RELATIVE
        if self.machine.design.profile == "shortest":
            allowed = np.maximum(allowed, SHORTEST * self.machine.design.tolerance)
        return allowed


def _ends(index: Index, moves: list[Move], rapids: Rapids, machine: Machine) -> Paths:
    """The ends of rapids, as the checks of streams have them."""
    start = np.nan_to_num(rapids.start[index])
    displacement = rapids.target[index] - rapids.start[index]
    displacement = np.where(np.abs(displacement) > STANDSTILL, displacement, 0.0)
    n = len(index)
    end = 2 * np.arange(1, n + 1)
    position = np.stack([start, start + displacement], axis=1).reshape(2 * n, len(AXES))
    return Paths(
        rapid=index,
        original_line=rapids.line[index],
        line=np.array([move.line for move in moves], dtype=np.int64),
        begin=end - 2,
        end=end,
        position=position,
        feed=np.full(2 * n, np.nan),
        start=start,
        displacement=displacement,
        unit=np.ones(n),
        speed=rapids.speed[index],
        step=np.tile(resolutions(machine), (n, 1)),
        lone=rapids.lone[index],
        lead=np.zeros(n, dtype=np.int64),
    )
