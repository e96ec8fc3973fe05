"""The JSON report: plain dictionaries with the keys of the contract, in its order.

Rule: everything in a record is a Python number, string, list, dictionary or None. What is unknown
is None, so that the file is strict JSON: NaN has no place in it.
"""

from __future__ import annotations

import json
import math
from functools import cached_property
from typing import Any

import numpy as np

from gcodejerk._version import __version__
from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.machine.subprograms import sum_of
from gcodejerk.motion import whole_intervals
from gcodejerk.motion.profiles.profile import Array
from gcodejerk.nc import Rapids
from gcodejerk.planning.independent_axes import arrivals
from gcodejerk.planning.plans import Plans
from gcodejerk.planning.settling import Left, settling_times
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.rewrite.control_settings import ControlSettings
from gcodejerk.rewrite.result import Result
from gcodejerk.storage import windows

Record = dict[str, Any]
ROTARY = "ABC"
"""Letters of rotary axes, where no machine says it."""
DIGITS = 10
"""Significant digits of a number in a report."""


class Records:
    """Records of planned moves; what is computed for all of them at once is computed once."""

    def __init__(
        self,
        plans: Plans,
        residual: Array,
        conventional: Array,
        limit: Array | None = None,
        deviation: Array | None = None,
        rest: Left | None = None,
    ) -> None:
        self.plans, self.profiles = plans, plans.profiles
        self.deviation = np.zeros(len(plans)) if deviation is None else deviation
        self.limit = np.full(len(plans), np.nan) if limit is None else limit
        self.rest = rest
        self.oscillators = (residual, conventional)

    # The summary of a large program needs none of these.

    @cached_property
    def residual(self) -> Array:
        """Displacement amplitudes of the entries of modes, shape (n, g) [mm]."""
        return self.plans.modes.grouped(self.oscillators[0])

    @cached_property
    def conventional(self) -> Array:
        """The same of the control's own rapids."""
        return self.plans.modes.grouped(self.oscillators[1])

    @cached_property
    def extension(self) -> Array:
        """What each takes longer than the control's own, shape (n,) [s]."""
        return _extension(self.plans, slice(0, len(self.plans)))

    @cached_property
    def acceleration(self) -> Array:
        """Acceleration amplitudes of the entries of modes, shape (n, g) [mm/s^2]."""
        return self.plans.modes.accelerations(self.oscillators[0])

    @cached_property
    def conventional_acceleration(self) -> Array:
        """The same of the control's own rapids."""
        return self.plans.modes.accelerations(self.oscillators[1])

    @cached_property
    def peaks(self) -> tuple[Array, Array, Array]:
        """Peaks of velocity, acceleration and jerk of the unit profiles."""
        own = self.profiles
        return own.peak_velocity, own.peak_acceleration, own.peak_jerk

    def summary(self) -> Record:
        """The counts and totals of all moves."""
        plans, planned = self.plans, self.plans.planned
        now, today = self.oscillators
        codes, counts = np.unique(plans.reason[~planned], return_counts=True)
        order = np.argsort(-counts, kind="stable")
        return {
            "rapids": len(plans),
            "planned": int(np.count_nonzero(planned)),
            "left": int(np.count_nonzero(~planned)),
            "left_by_reason": {str(REASONS[codes[k]]): int(counts[k]) for k in order},
            "rapid_time": number(_sum(plans)),
            "conventional_time": number(float(plans.conventional_time[planned].sum())),
            "extended": sum(
                int(np.count_nonzero(_extension(plans, part))) for part in windows(len(plans))
            ),
            "worst_residual": _known(self._worst(now, np.fmax, np.nan)),
            "worst_conventional_residual": _known(self._worst(today, np.fmax, np.nan)),
            **self._everything(),
        }

    def _worst(self, amplitude: Array, larger: np.ufunc, initial: float) -> float:
        """The largest amplitude of an entry of modes that a planned move leaves [mm]."""
        found = initial
        for part in windows(len(self.plans)):
            each = self.plans.modes.grouped(amplitude[part])
            planned = (self.plans.reason[part] == CERTAIN)[:, np.newaxis]
            worst = larger.reduce(each, axis=None, where=planned, initial=initial)
            found = float(larger(found, worst))
        return found

    def _everything(self) -> Record:
        """What the whole program leaves and lasts, rapids left alone included; today beside it."""
        plans, planned, rest = self.plans, self.plans.planned, self.rest
        same = 0.0 if rest is None else float(rest.time.sum())
        modes, tolerance = plans.modes, plans.machine.design.tolerance
        motion, today = _sum(plans), float(plans.conventional_time[planned].sum())
        now, then = (self._worst(each, np.maximum, 0.0) for each in self.oscillators)
        out: Record = {
            "worst_residual_share": number(now / then) if then else None,
            **dict.fromkeys(("worst_residual_all", "worst_conventional_residual_all")),
            "left_unknown": 0 if rest is None else int(np.count_nonzero(rest.unknown)),
            "rapid_time_all": number(motion + same),
            "conventional_time_all": number(today + same),
        }
        for amplitude, name in zip(self.oscillators, ("", "conventional_"), strict=True):
            waiting, worst = np.zeros(len(plans)), [np.nan]
            for part in windows(len(plans)):
                left = np.nan if rest is None else rest.residual[part]
                each = np.where(planned[part, np.newaxis], amplitude[part], left)
                worst.append(float(np.fmax.reduce(modes.grouped(each), axis=None, initial=np.nan)))
                waiting[part] = settling_times(each, modes, tolerance)
            out[f"worst_{name}residual_all"] = _known(float(np.fmax.reduce(worst)))
            out[f"{name}settling_time"] = number(float(np.nansum(waiting)))
        return out | {"tolerance": number(tolerance)}

    def motion(self, row: int) -> Record:
        """Status, times, segments, peaks and residuals of one move."""
        plans = self.plans
        planned = bool(plans.planned[row])
        length, usual = plans.length[row], plans.conventional_time[row]
        if not planned and self.rest is not None:
            length, usual = self.rest.length[row], self.rest.time[row]
        record: Record = {
            "status": "planned" if planned else "left",
            "reason": None if planned else str(REASONS[plans.reason[row]]),
            "length": number(float(length)) or None,
            "time": None,
            "conventional_time": number(float(usual)) or None,
            "extension": None,
            "profile": None,
            "segments": None,
            "peak": None,
            "residual": None,
            "limit": None,
        }
        if planned:
            of_move = plans.profiles_of(row)
            record |= {
                "time": number(float(plans.times[row])),
                "extension": number(float(self.extension[row])),
                "profile": plans.designed,
                "segments": self._segments(row, of_move),
                "peak": self._peak(of_move),
                "residual": self._residual(row),
                "limit": self._limit(row),
            }
        if planned and plans.machine.positioning != "linear":
            each = arrivals(plans, row)
            record["arrival"] = {axis: number(time) for axis, (time, _) in each.items()}
            record["conventional_arrival"] = {axis: number(t) for axis, (_, t) in each.items()}
            record["path_deviation"] = number(float(self.deviation[row]))
        return record

    def _limit(self, row: int) -> float | None:
        """What the best profile would leave; never more than what this one leaves."""
        return number(float(np.minimum(self.limit[row], self.residual[row].max(initial=0.0))))

    def _segments(self, row: int, of_move: range) -> Any:
        """Segments of the common profile, or of each axis's."""
        plans = self.plans
        if plans.machine.positioning == "linear":
            total = float(plans.times[row])
            return scaled(self.profiles.segments(of_move.start), float(plans.length[row]), total)
        out: Record = {}
        for k in of_move:
            axis = int(np.argmax(plans.share[k] != 0.0))
            length, total = (
                abs(float(plans.share[k, axis])),
                float(plans.profile_times[k]),
            )
            out[AXES[axis]] = scaled(self.profiles.segments(k), length, total)
        return out

    def _peak(self, of_move: range) -> Record:
        """Peaks of each moving axis."""
        out: Record = {}
        for k in of_move:
            for axis in np.nonzero(self.plans.share[k])[0]:
                size = abs(float(self.plans.share[k, axis]))
                names = ("velocity", "acceleration", "jerk")
                out[AXES[axis]] = {
                    name: number(float(peak[k]) * size)
                    for name, peak in zip(names, self.peaks, strict=True)
                }
        return out

    def _residual(self, row: int) -> list[Record]:
        """Residual of every mode that the move excites."""
        out = []
        modes = self.plans.modes
        for m in self.plans.excited(row):
            label, mode = modes.labels[m], modes.modes[m]
            out.append(
                {
                    "axis": label,
                    "mode": mode.name,
                    "frequency": number(mode.frequency),
                    "damping": number(mode.damping),
                    "acceleration": number(float(self.acceleration[row, m])),
                    "displacement": number(float(self.residual[row, m])),
                    "conventional_acceleration": number(
                        float(self.conventional_acceleration[row, m])
                    ),
                    "conventional_displacement": number(float(self.conventional[row, m])),
                }
            )
        return out


def summary_of(result: Result) -> Record:
    """The summary of a report, without the records of its rapids."""
    records = Records(
        result.plans,
        result.residual,
        result.conventional_residual,
        rest=result.rest,
    )
    summary = {"blocks": result.program.blocks} | records.summary()
    summary["read_once"] = result.read_once
    inch = result.program.rapids.inch
    summary["inch"] = bool(len(inch)) and bool(inch.all())
    if result.expansion is not None:
        summary["cycles"] = result.expansion.holes
        summary["cycles_expanded"] = result.expansion.written
    if result.unrolling is not None:
        summary["structures"] = result.unrolling.structures
        summary["structures_unrolled"] = result.unrolling.written
        summary["unrolled_lines"] = result.unrolling.lines
    if result.settings is not None:
        summary |= _of_settings(result.settings)
    return summary


def _of_settings(settings: ControlSettings) -> Record:
    """What the control's own settings gain, and at how many places of the program they stand."""
    out: Record = {"set_at": settings.places}
    if settings.tuning is not None and settings.changed:
        today, chosen = settings.tuning.today, settings.tuning.chosen
        out |= {
            "rapid_time": number(chosen.total),
            "conventional_time": number(today.total),
            "worst_residual": number(chosen.value),
            "worst_conventional_residual": number(today.value),
            "worst_residual_share": number(chosen.value / today.value) if today.value else None,
            # Those are of streams; what a control leaves rapid by rapid is not known here.
            **dict.fromkeys(("worst_residual_all", "rapid_time_all", "settling_time")),
        }
    return out


def process_record(
    result: Result,
    machine: Machine,
    output: str | None,
    blocks: list[str],
    limit: Array | None = None,
) -> Record:
    """The report on one processed program.

    Parameters
    ----------
    result : Result
        Of `process`.
    machine : Machine
        What it was processed for.
    output : str or None
        Name of the file that was written.
    blocks : list of str
        Text of each rapid's block.
    limit : ndarray, shape (n,), optional
        From `bounds.least_residuals`; unknown by default. [mm]

    Returns
    -------
    dict
        Section 4 of the contract.
    """
    plans = result.plans
    records = Records(
        plans,
        result.residual,
        result.conventional_residual,
        limit,
        result.deviation,
        result.rest,
    )
    rapids = result.program.rapids
    rows = [
        place_record(rapids, row, blocks[row]) | records.motion(row) for row in range(len(rapids))
    ]
    return process_head(result, machine, output) | {"rapids": rows}


def process_head(result: Result, machine: Machine, output: str | None) -> Record:
    """The report on one processed program, but for its rapids."""
    return report_head(machine, result.controller, result.form, result.profile) | {
        "input": result.program.name,
        "output": output,
        "dialect": result.program.dialect,
        "summary": summary_of(result),
        "notes": list(result.notes),
        **_subprograms(result, machine),
        "verified": None if result.verification is None else result.verification.ok,
    }


def _subprograms(result: Result, machine: Machine) -> Record:
    """Files of others that the program goes on in, with the sums of their bytes."""
    files = {} if machine.subprograms is None else machine.subprograms.files
    used = [
        {"file": name, "sum": sum_of(files[name])}
        for name in result.program.subprograms
        if name in files
    ]
    return {"subprograms": used} if used else {}


def place_record(rapids: Rapids, row: int, block: str) -> Record:
    """Where a rapid stands in its program, and from where to where it leads."""
    return {
        "line": int(rapids.line[row]),
        "block": block,
        "start": _positions(rapids, rapids.start[row], row),
        "end": _positions(rapids, rapids.target[row], row),
    }


def report_head(machine: Machine, controller: str, form: str, profile: str) -> Record:
    """What every report begins with."""
    return {
        "gcodejerk": __version__,
        "input": None,
        "output": None,
        "machine": machine.source,
        "controller": controller,
        "as": form,
        "profile": profile,
        "positioning": machine.positioning,
        "interval": machine.interval,
        "rotary": rotary_axes(machine),
    }


def rotary_axes(machine: Machine) -> list[str]:
    """Axes whose positions and lengths are degrees, in order."""
    return [axis for axis in AXES if machine.turns(axis)]


def number(value: float) -> float | None:
    """A number with the digits that mean something; None where it is not finite."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


def dump(record: Record) -> bytes:
    """A record as the text of a JSON file."""
    text = json.dumps(record, indent=1, ensure_ascii=False, allow_nan=False)
    # A file's name need not be UTF-8; what is not becomes the \\udc.. by which Python names it.
    return text.encode("utf-8", "backslashreplace") + b"\n"


def scaled(segments: list[tuple[float, float]], length: float, time: float) -> list[Record]:
    """Segments scaled to a length; a rest fills up the time of a profile that is shorter."""
    out = [{"duration": number(d), "jerk": number(j * length)} for d, j in segments]
    rest = time - sum(d for d, _ in segments)
    if rest > 1e-9:
        out.append({"duration": number(rest), "jerk": 0.0})
    return out


def _positions(rapids: Rapids, position: Any, row: int) -> Record:
    """Positions of the axes that the block names, None where unknown."""
    words = int(rapids.words[row])
    return {axis: number(float(position[k])) for k, axis in enumerate(AXES) if words >> k & 1}


def _sum(plans: Plans) -> float:
    """How long all planned moves last together [s]."""
    planned = plans.planned  # some are left alone behind their design
    if plans.lasting is not None:
        return float(plans.times[planned].sum())
    return float(plans.counts[planned].sum()) * plans.machine.interval


def _known(value: float) -> float | None:
    """A number, None for NaN."""
    return None if math.isnan(value) else number(value)


def _extension(plans: Plans, rows: slice) -> Array:
    """What some moves take longer than the control's own [s]."""
    interval, planned = plans.machine.interval, plans.reason[rows] == CERTAIN
    usual = whole_intervals(plans.conventional_time[rows], interval)
    if plans.lasting is not None:
        more = np.where(planned, plans.lasting[rows], 0.0) - usual * interval
        return np.where(planned & (more > 1e-9), more, 0.0)
    extra = np.where(planned, np.maximum(plans.counts[rows] - usual, 0), 0)
    extension: Array = extra * interval
    return extension
