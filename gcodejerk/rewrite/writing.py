"""All streams of a program, window by window: made, judged by what they leave, and written.

Rule 1: streams that are the same text are made once (`same_streams`); `Rewriter` writes
them again.
Rule 2: where the text of a stream depends on whether the line in front has one, that is known
before it is written.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.motion.threads import one_thread
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.pvt import make_rows
from gcodejerk.planning.stream import Residuals, moves_of_windows
from gcodejerk.planning.told import RowFormat
from gcodejerk.reasons import CERTAIN
from gcodejerk.rewrite.pieces import Made, Maker, Piece
from gcodejerk.rewrite.rewriter import Rewriter
from gcodejerk.rewrite.same_streams import same_streams
from gcodejerk.spread import Spread, here
from gcodejerk.storage import column, gathered, kept, release


def write_streams(
    writer: Rewriter,
    plans: Plans,
    machine: Machine,
    report: Callable[[str, int, int], None],
    form: RowFormat | None,
    peaks: Array,
    spread: Spread = here,
) -> tuple[Residuals, Array]:
    """Make and write all streams.

    Parameters
    ----------
    writer : Rewriter
        Takes them.
    plans : Plans
        The moves; the reasons of those that are not written after all are noted here.
    machine : Machine
        With the profile that was chosen.
    report : callable
        Told how much is done.
    form : RowFormat or None
        For a controller that is told rows.
    peaks : ndarray, shape (3, n)
        Of the profiles, for such a controller.
    spread : Spread, optional
        Who makes them.

    Returns
    -------
    Residuals
        What the streams leave.
    deviation : ndarray, shape (n,)
        How far each path is from the control's own. [mm]
    """
    writer.write_header(machine)
    if form is None:
        streams = _Streams(writer, plans, machine, report)
        with one_thread():  # matrices are small
            streams.write(spread)
        return streams.collected, streams.deviation
    collected, deviation = Residuals(plans), column(len(plans), 0.0)
    planned, rapids = kept(np.flatnonzero(plans.planned)), writer.program.rapids
    for window in make_rows(plans, rapids, form, peaks):
        last = -1
        for rows in window:
            collected.note(rows.moves, rows.residual, rows.conventional_residual)
            deviation[rows.moves] = rows.deviation()
            if writer.target is not None:
                blocks = writer.blocks(rows.moves)
                writer.begin()
                writer.add(rows.moves, writer.emitter.render_rows(rows, rapids, blocks))
            last = max(last, int(rows.moves[-1]))
            del rows  # or it would stay while the next one is made
        writer.write()
        report("writing", int(np.searchsorted(planned, last, side="right")), len(planned))
        release()
    writer.finish()
    report("writing", len(planned), len(planned))
    return collected, deviation


class _Streams:
    """The streams of one program; `collected` and `deviation` as `write_streams` returns them."""

    def __init__(
        self,
        writer: Rewriter,
        plans: Plans,
        machine: Machine,
        report: Callable[[str, int, int], None],
    ) -> None:
        emitter, rapids = writer.emitter, writer.program.rapids
        self.writer, self.plans, self.report = writer, plans, report
        self.format = emitter.number_format(rapids, machine, writer.options.dialect)
        stride = emitter.stride(machine.interval)
        self.like: NDArray[np.int64] | None = None
        if emitter.repeats and not machine.controller_options.override_guard:
            self.like = same_streams(plans, rapids, self.format, writer.source, stride)
        if self.like is not None:
            writer.repeat(self.like)
        self.writes = writer.target is not None
        newline, options = writer.program.newline, writer.options
        self.make = Maker(emitter, stride, newline, options, self.writes)
        self.collected, self.deviation = Residuals(plans), column(len(plans), 0.0)
        self.reason = plans.reason.copy()
        """As it was before any stream was made: pieces depend on nothing that others find."""
        self.planned = kept(np.flatnonzero(plans.planned))
        self.waiting: deque[tuple[int, Piece]] = deque()
        """Pieces that were asked for and not taken, and the window of each."""

    def write(self, spread: Spread) -> None:
        """Make and write them."""
        spread = spread if self.make.emitter.apart else here
        window, taken = 0, list[tuple[Piece, Made]]()
        for made in spread(self.make, self._pieces()):
            number, piece = self.waiting.popleft()
            if number != window:
                self._end_window(taken)
                window, taken = number, []
            self._take(piece, made)
            # Batches take much room, and have served.
            taken.append((piece, replace(made, batch=None)))
        self._end_window(taken)
        self.writer.finish()
        self.report("writing", len(self.planned), len(self.planned))
        if self.like is not None:
            self.collected.repeat(self.like)
            self.deviation = gathered(self.deviation, self.like)

    def _pieces(self) -> Iterator[Piece]:
        """What there is to make, in order."""
        rapids = self.writer.program.rapids
        for number, window in enumerate(moves_of_windows(self.plans, self.like)):
            for moves in window:
                wants = self.writes and self.make.emitter.apart
                blocks = self.writer.blocks(moves) if wants else []
                piece = Piece.of(moves, self.plans, rapids, self.format, blocks, self.reason)
                self.waiting.append((number, piece))
                yield piece

    def _take(self, piece: Piece, made: Made) -> None:
        """Note what came of a piece."""
        moves, out = made.moves, made.reason != CERTAIN
        for why in np.unique(made.reason[out]):
            which = piece.rows[piece.moves[made.reason == why]]
            same = which if self.like is None else np.isin(self.like, which)
            self.plans.reason[same] = why
        self.collected.note(moves, made.residual, made.conventional)
        self.deviation[moves] = made.deviation
        if not self.writes or not len(moves):
            return
        writer, emitter = self.writer, self.make.emitter
        aside = None
        texts = made.texts
        if made.batch is not None:
            batch = replace(made.batch, moves=moves, plans=self.plans)
            rapids = writer.program.rapids
            blocks = writer.blocks(moves)
            texts = emitter.render(batch, rapids, blocks, self.make.newline, self.make.options)
            aside = None if writer.beside is None else emitter.render_beside(batch, rapids)
        writer.begin()
        writer.add(moves, texts, aside)

    def _end_window(self, taken: list[tuple[Piece, Made]]) -> None:
        """Write the streams of a window."""
        if self.make.emitter.joins and self.make.emitter.apart and self.writes:
            for piece, made in taken:
                self._mend(piece, made)
        last = max((int(made.moves[-1]) for _, made in taken if len(made.moves)), default=-1)
        self.writer.write()
        done = int(np.searchsorted(self.planned, last, side="right"))
        self.report("writing", done, len(self.planned))
        release()

    def _mend(self, piece: Piece, made: Made) -> None:
        """Make texts anew that rely on a stream in front which is not written after all."""
        before, line = made.moves - 1, self.writer.program.rapids.line
        wrong = (self.reason[before] == CERTAIN) & (self.plans.reason[before] != CERTAIN)
        wrong &= (before >= 0) & (line[before] + 1 == line[made.moves])
        if wrong.any():
            again = self.make(piece.behind(self.plans.reason))
            texts = [again.texts[k] for k in np.flatnonzero(wrong).tolist()]
            self.writer.add(made.moves[wrong], texts)
