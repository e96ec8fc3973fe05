"""All streams of a program, window by window: made, judged by what they leave, and written.

Rule: streams that are the same text are made once (`same_streams`); `Rewriter` writes
them again.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from gcodejerk.machine import Machine
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.planning.batch import Batch
from gcodejerk.planning.independent_axes import path_deviation
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.pvt import Rows, make_rows
from gcodejerk.planning.stream import Residuals, stream_windows
from gcodejerk.planning.told import RowFormat
from gcodejerk.rewrite.rewriter import Rewriter
from gcodejerk.rewrite.same_streams import same_streams
from gcodejerk.storage import column, gathered, kept, release


def write_streams(
    writer: Rewriter,
    plans: Plans,
    machine: Machine,
    report: Callable[[str, int, int], None],
    form: RowFormat | None,
    peaks: Array,
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

    Returns
    -------
    Residuals
        What the streams leave.
    deviation : ndarray, shape (n,)
        How far each path is from the control's own. [mm]
    """
    emitter, dialect = writer.emitter, writer.options.dialect
    collected = Residuals(plans)
    deviation = column(len(plans), 0.0)
    writer.write_header(machine)
    planned, like = kept(np.flatnonzero(plans.planned)), None
    windows: Iterator[Iterator[Batch]] | Iterator[list[Rows]]
    if form is not None:
        windows = make_rows(plans, writer.program.rapids, form, peaks)
    else:
        spelled = emitter.number_format(writer.program.rapids, machine, dialect)
        stride = emitter.stride(machine.interval)
        if emitter.repeats and not machine.controller_options.override_guard:
            like = same_streams(plans, writer.program.rapids, spelled, writer.source, stride)
        windows = stream_windows(plans, spelled, stride, emitter.play, like)
        if like is not None:
            writer.repeat(like)
    for window in windows:
        last = -1
        for batch in window:
            collected.add(batch)
            deviation[batch.moves] = (
                batch.deviation() if isinstance(batch, Rows) else path_deviation(batch)
            )
            writer.add(batch)
            last = max(last, int(batch.moves[-1]))
            del batch  # or it would stay while the next one is made
        writer.write()
        report("writing", int(np.searchsorted(planned, last, side="right")), len(planned))
        release()
    writer.finish()
    report("writing", len(planned), len(planned))
    if like is not None:
        collected.repeat(like)
        deviation = gathered(deviation, like)
    return collected, deviation
