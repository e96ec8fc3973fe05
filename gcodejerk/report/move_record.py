"""The report on one planned move, and its stream as a table.

This module owns what `plan` writes: the record of a move in the form of a program's report, the
conventional motion beside it, and the points as CSV.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gcodejerk.axes import AXES
from gcodejerk.planning.bounds import known_limits
from gcodejerk.planning.independent_axes import dogleg_notes, path_deviation
from gcodejerk.planning.move import Plan
from gcodejerk.report.records import Record, Records, number, report_head, scaled


def _within_band(plan: Plan) -> Record:
    """What one planned move leaves over the band of its machine, and could leave at best."""
    worst = float(plan.plans.worst_in_band[0])
    least = known_limits(plan.plans, band=plan.machine.design.band)
    if least is None or not np.isfinite(worst):
        return {}
    return {
        "worst_in_band": number(worst),
        "limit_in_band": number(float(np.fmin(least[0], worst))),
    }


def move_record(plan: Plan) -> Record:
    """The report on one planned move, in the same form."""
    limit = known_limits(plan.plans)
    deviation = path_deviation(plan.batch)
    records = Records(
        plan.plans,
        plan.residual,
        plan.conventional_residual,
        limit,
        deviation,
    )
    end = {axis: number(length) for axis, length in plan.displacement.items()}
    row: Record = {
        "line": None,
        "block": None,
        "start": dict.fromkeys(end, 0.0),
        "end": end,
    } | records.motion(0)
    for entry, (own, usual) in zip(row["residual"], plan.unsampled(), strict=True):
        entry["profile_acceleration"] = number(own)
        entry["conventional_profile_acceleration"] = number(usual)
    if row["limit"] is not None:
        row |= _within_band(plan)
    return report_head(plan.machine, "csv", "stream", plan.profile) | {
        "input": None,
        "output": None,
        "dialect": None,
        "summary": {"blocks": 0} | records.summary(),
        "notes": dogleg_notes(plan.plans, deviation),
        "verified": None,
        "rapids": [row],
    }


def conventional_motion(plan: Plan) -> Record:
    """Time, segments and peaks of the controller's own G0, as the `motion` of a record has them."""
    plans = plan.plans
    usual = replace(plans, profiles=plans.conventional)
    records = Records(usual, plan.residual, plan.conventional_residual)
    motion = records.motion(0) | {"time": number(plan.conventional_time)}
    if isinstance(motion["segments"], list):
        motion["segments"] = scaled(plans.conventional.segments(0), plan.length, 0.0)
    else:
        for k in plans.profiles_of(0):
            axis = AXES[int(np.argmax(plans.share[k] != 0.0))]
            motion["segments"][axis] = scaled(plans.conventional.segments(k), 1.0, 0.0)
    return motion


def stream_csv(plan: Plan) -> bytes:
    """The stream of a plan as a table: t and every axis of the machine, in mm and degrees."""
    positions = plan.positions
    lines = [",".join(["t", *positions])]
    for row, t in enumerate(plan.t):
        lines.append(",".join([f"{t:.10g}", *(f"{q[row]:.10g}" for q in positions.values())]))
    return "\n".join(lines).encode() + b"\n"
