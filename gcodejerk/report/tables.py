"""Tables and lines for a terminal: what a person sees of a result.

Rule: a table says what the JSON report says, in fewer digits. Lengths are mm (or deg), residuals
um.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich.text import Text

from gcodejerk.reasons import Reason
from gcodejerk.report.records import ROTARY
from gcodejerk.report.screen import ScreenTable
from gcodejerk.units import MM_PER_INCH, percent

if TYPE_CHECKING:
    from gcodejerk.machine import Machine
    from gcodejerk.motion.profiles.conditions import Peaks
    from gcodejerk.studies.amplitude_map import Survey

UM_PER_MM = 1000.0
MS_PER_S = 1000.0
MOST_SEGMENTS = 9
"""More are counted, not listed."""
Record = dict[str, Any]


def rapids_table(record: Record) -> ScreenTable:
    """All rapids of a program: line, from, to, length, times, residual, and why one is left alone.

    Parameters
    ----------
    record : dict
        From `records.process_record`.

    Returns
    -------
    ScreenTable
    """
    unit, rotary = _Unit.of(record["summary"]), _rotary(record)
    length = f"length\n[{unit.length}]"
    table = ScreenTable(
        ("line", "right"),
        ("from", "left"),
        ("to", "left"),
        (length, "right"),
        ("conventional\n[ms]", "right"),
        ("planned\n[ms]", "right"),
        (f"residual [{unit.residual}]\nnow -> planned", "right"),
        ("status", "left"),
        wrap=("status",),
        drop=("conventional\n[ms]", "from", length, "to", "planned\n[ms]"),
    )
    for row in record["rapids"]:
        planned = row["status"] == "planned"
        status = row["profile"] if planned else f"left alone: {row['reason']}"
        table.add_row(
            str(row["line"]),
            _position(row["start"], unit, rotary),
            _position(row["end"], unit, rotary),
            _length(row, unit, rotary),
            _ms(row["conventional_time"], ".1f"),
            _ms(row["time"], ".0f"),
            _worst(row["residual"], unit) if planned else "",
            Text(status, style="" if planned else "yellow"),
        )
    return table


def _rotary(record: Record) -> frozenset[str]:
    """Axes in degrees: what the machine file says, or their letter in reports of before."""
    return frozenset(record.get("rotary", ROTARY))


def _length(row: Record, unit: _Unit, rotary: frozenset[str]) -> str:
    """How long a rapid is: in degrees where only rotary axes move."""
    if row["length"] is None:
        return ""
    moved = [a for a, end in row["end"].items() if end is not None and end != row["start"].get(a)]
    if moved and rotary.issuperset(moved):
        return f"{row['length']:.3f} deg"
    return f"{row['length'] / unit.mm:{unit.digits}}"


def summary_line(name: str, summary: Record) -> str:
    """One line: how many rapids were rewritten, what that gains, what was left alone and why."""
    rapids = _count(summary["rapids"], "rapid")
    if not summary["rapids"]:
        return f"{name}: 0 rapids found, nothing to do"
    if summary.get("set_at") is not None:
        return f"{name}: {rapids}; {_set_line(summary)}"
    parts = [f"{name}: {rapids}, {summary['planned']} rewritten"]
    if summary.get("cycles"):
        of = f" of {summary['cycles']}" if summary["cycles_expanded"] != summary["cycles"] else ""
        parts.append(f"{summary['cycles_expanded']}{of} cycles written out")
    if summary.get("structures"):
        done, among = summary["structures_unrolled"], summary["structures"]
        of = f" of {among}" if done != among else ""
        what = "loop or call" if among == 1 else "loops and calls"
        parts.append(f"{done}{of} {what} written out")
    if summary["planned"] and summary["worst_conventional_residual"]:
        unit = _Unit.of(summary)
        now, then = (
            unit.small(summary[key]) for key in ("worst_conventional_residual", "worst_residual")
        )
        share = percent(summary["worst_residual_share"])
        parts.append(f"worst residual {share} of today's ({now} -> {then} {unit.residual})")
    if summary["extended"]:
        extra = (summary["rapid_time"] - summary["conventional_time"]) * MS_PER_S
        parts.append(f"{summary['extended']} longer than today, {extra:.0f} ms in all")
    if summary.get("read_once"):
        parts.append(f"{summary['read_once']} of them rest on one reading of the program alone")
    if summary["left"]:
        why = ", ".join(f"{count} {reason}" for reason, count in summary["left_by_reason"].items())
        parts.append(f"{summary['left']} left alone ({why})")
    return "; ".join(parts)


def _set_line(summary: Record) -> str:
    """What setting the control gains."""
    if not summary["set_at"]:
        return "the control is not set, the program stays as it is"
    then, now = (
        summary[key] * UM_PER_MM for key in ("worst_conventional_residual", "worst_residual")
    )
    time = [f"{summary[key]:.2f}" for key in ("conventional_time", "rapid_time")]
    share = (
        ""
        if summary["worst_residual_share"] is None
        else f"{percent(summary['worst_residual_share'])} of today's "
    )
    others = [
        f"{count} {reason}"
        for reason, count in summary["left_by_reason"].items()
        if reason != Reason.CONTROL_SET
    ]
    return (
        f"the control is set at {summary['set_at']} places: worst residual before a cut "
        f"{share}({then:.1f} -> {now:.1f} um), rapids {time[0]} -> {time[1]} s"
        + (f"; not tuned for: {', '.join(others)}" if others else "")
    )


def whole_line(summary: Record) -> str:
    """One line on the whole program: what stays, and the time that a shop pays for."""
    if not summary["planned"] or summary["worst_residual_all"] is None:
        return ""
    unit = _Unit.of(summary)
    worst = [
        unit.small(summary[key])
        for key in ("worst_conventional_residual_all", "worst_residual_all")
    ]
    motion = [f"{summary[key]:.2f}" for key in ("conventional_time_all", "rapid_time_all")]
    waiting = [
        "without end" if summary[key] is None else f"{summary[key]:.2f}"
        for key in ("conventional_settling_time", "settling_time")
    ]
    unknown = f", {summary['left_unknown']} not known" if summary["left_unknown"] else ""
    return (
        f"  all rapids, those left alone too{unknown}: worst {worst[0]} -> {worst[1]} "
        f"{unit.residual}; in motion {motion[0]} -> {motion[1]} s; then until all is within "
        f"{summary['tolerance'] * unit.per_mm:.3g} {unit.residual} {waiting[0]} -> {waiting[1]} s"
    )


def move_tables(record: Record, conventional: Record) -> list[ScreenTable]:
    """One planned move beside the conventional one: times and peaks, then residuals.

    Parameters
    ----------
    record, conventional : dict
        From `records.move_record`, of the design and of the conventional profile (which may be
        a record whose rapid has no stream: its motion alone is shown).

    Returns
    -------
    list of ScreenTable
    """
    row, usual = record["rapids"][0], conventional
    rotary = _rotary(record)
    turning = [axis in rotary for axis in row["peak"]]
    unit = "deg" if all(turning) else "mm or deg" if any(turning) else "mm"
    table = ScreenTable(
        ("profile", "left"),
        ("T_SUM\n[ms]", "right"),
        ("segments\n[ms]", "left"),
        ("axis", "left"),
        (f"velocity\n[{unit}/s]", "right"),
        (f"acceleration\n[{unit}/s^2]", "right"),
        (f"jerk\n[{unit}/s^3]", "right"),
        wrap=("segments\n[ms]",),
        drop=(f"jerk\n[{unit}/s^3]", f"velocity\n[{unit}/s]", "segments\n[ms]"),
    )
    for name, motion in ((row["profile"], row), ("conventional today", usual)):
        for k, (axis, peak) in enumerate(motion["peak"].items()):
            segments = motion["segments"]
            if isinstance(segments, dict):
                segments = segments[axis]
            table.add_row(
                name if k == 0 else "",
                _ms(motion["time"], ".4g") if k == 0 else "",
                _segments(segments) if k == 0 or isinstance(motion["segments"], dict) else "",
                axis,
                _number(peak["velocity"], ".2f"),
                _number(peak["acceleration"], ".1f"),
                "step" if peak["jerk"] is None else _number(peak["jerk"], ".4g"),
            )
    return [table, _residual_table(row["residual"])]


def move_limit(record: Record, band: float) -> str:
    """How far a planned move is from the least that any profile could leave; `band` in percent."""
    row = record["rapids"][0]
    if row["limit"] is None or not row["residual"]:
        return ""
    worst = max(entry["displacement"] for entry in row["residual"]) * UM_PER_MM
    least = row["limit"] * UM_PER_MM
    line = (
        f"the worst mode keeps {worst:.2f} um; at exactly these frequencies no profile of this "
        f"time can leave less than {least:.2f} um"
    )
    if "limit_in_band" not in row:
        return line
    worst, least = (row[key] * UM_PER_MM for key in ("worst_in_band", "limit_in_band"))
    return f"{line}\nwithin {band:.3g} % of them: {worst:.2f} um, and no less than {least:.2f} um"


def _segments(segments: Sequence[Record]) -> str:
    """Durations of the segments; how many there are where they are many."""
    times = [s["duration"] * MS_PER_S for s in segments]
    if len(times) > MOST_SEGMENTS:
        shortest, longest = f"{min(times):.4g}", f"{max(times):.4g}"
        return f"{len(times)} of {shortest}" + f" to {longest}" * (longest != shortest)
    return " / ".join(f"{t:.4g}" for t in times)


def _residual_table(residual: Sequence[Record]) -> ScreenTable:
    """What each mode keeps: of the profiles, and of the streams as sampled and written."""
    table = ScreenTable(
        ("axis", "left"),
        ("mode", "left"),
        ("frequency\n[Hz]", "right"),
        ("damping\n[-]", "right"),
        ("profile [mm/s^2]\ntoday -> planned", "right"),
        ("stream [mm/s^2]\ntoday -> planned", "right"),
        ("stream [um]\ntoday -> planned", "right"),
        wrap=("mode",),
        drop=(
            "profile [mm/s^2]\ntoday -> planned",
            "damping\n[-]",
            "stream [mm/s^2]\ntoday -> planned",
        ),
    )
    for entry in residual:
        pairs = (
            (entry["conventional_profile_acceleration"], entry["profile_acceleration"], ".1f"),
            (entry["conventional_acceleration"], entry["acceleration"], ".1f"),
            (
                entry["conventional_displacement"] * UM_PER_MM,
                entry["displacement"] * UM_PER_MM,
                ".2f",
            ),
        )
        table.add_row(
            entry["axis"],
            entry["mode"],
            f"{entry['frequency']:g}",
            f"{entry['damping']:g}",
            *(f"{now:{form}} -> {then:{form}}" for now, then, form in pairs),
        )
    return table


def map_tables(survey: Survey) -> list[ScreenTable]:
    """A survey in figures: the profile it would choose, and what each mode keeps of it.

    Parameters
    ----------
    survey : Survey
        The move, and the modes it is judged by.

    Returns
    -------
    list of ScreenTable
        One of the profile beside the limits, one of the modes; the first alone says so where no
        time is long enough for the limits.
    """
    chosen, unit = survey.choose(), survey.unit
    move = ScreenTable(
        (f"{survey.axis.name} {survey.length:g} {unit}", "left"),
        ("T_SUM\n[ms]", "right"),
        ("T1\n[ms]", "right"),
        (f"velocity\n[{unit}/s]", "right"),
        (f"acceleration\n[{unit}/s^2]", "right"),
        (f"jerk\n[{unit}/s^3]", "right"),
        drop=(f"jerk\n[{unit}/s^3]", f"velocity\n[{unit}/s]"),
    )
    move.add_row("limit", "", "", *_peaks(survey.limit, "none"))
    usual = _peaks(survey.conventional_peaks, "step")
    move.add_row("conventional today", f"{survey.conventional_time * MS_PER_S:.6g}", "", *usual)
    if chosen is None:
        move.add_row(f"Condition {survey.condition}: in no time within the limits")
        return [move]
    move.add_row(
        f"Condition {survey.condition}, best",
        f"{chosen.T_SUM * MS_PER_S:.6g}",
        f"{chosen.T1 * MS_PER_S:.4g}",
        *_peaks(survey.peaks(chosen), "step"),
    )
    amplitude = f"amplitude [{unit}/s^2]\ntoday -> best"
    modes = ScreenTable(
        ("mode", "left"),
        ("frequency\n[Hz]", "right"),
        ("damping\n[-]", "right"),
        (amplitude, "right"),
        ("displacement [um]\ntoday -> best", "right"),
        ("next null [ms]\nT_SUM (T1)", "right"),
        wrap=("mode",),
        drop=("damping\n[-]", amplitude, "next null [ms]\nT_SUM (T1)"),
    )
    for mode in survey.counted_modes:
        now = survey.conventional_amplitude(mode)
        then = survey.amplitude(mode, chosen.T1, chosen.T_SUM)
        moved = [survey.displacement(mode, a) * UM_PER_MM for a in (now, then)]
        null = survey.nearest_null(mode, survey.time)
        modes.add_row(
            mode.name,
            f"{mode.frequency:g}",
            f"{mode.damping:g}",
            f"{now:.1f} -> {then:.1f}",
            f"{moved[0]:.2f} -> {moved[1]:.2f}",
            f"{null[1] * MS_PER_S:.6g} ({null[0] * MS_PER_S:.4g})" if null else "-",
        )
    return [move, modes]


def _peaks(peaks: Peaks, infinite: str) -> tuple[str, str, str]:
    """Velocity, acceleration and jerk, with a word for a jerk that is infinite."""
    jerk = float(peaks.jerk)
    return (
        f"{float(peaks.velocity):.2f}",
        f"{float(peaks.acceleration):.1f}",
        f"{jerk:.4g}" if jerk < math.inf else infinite,
    )


def machines_table(machines: Mapping[str, Machine]) -> ScreenTable:
    """Machine files by name: what each is, and what it has."""
    table = ScreenTable(
        ("machine", "left"), ("axes", "left"), ("modes", "right"), ("what", "left"), wrap=("what",)
    )
    for name, one in machines.items():
        modes = len(one.all_modes())
        table.add_row(name, "".join(one.axis_names), str(modes), one.name)
    return table


def controllers_table(rows: Sequence[tuple[str, str, str, str]]) -> ScreenTable:
    """Emitters: name, what each can write, and how far its facts can be trusted."""
    table = ScreenTable(
        ("controller", "left"), ("form", "left"), ("confidence", "left"), ("note", "left"),
        wrap=("note",), drop=("confidence",),
    )  # fmt: skip
    last = ""
    for name, *rest in rows:
        table.add_row(name if name != last else "", *rest)
        last = name
    return table


@dataclass(frozen=True, slots=True)
class _Unit:
    """Units in which a program is shown: those in which it is written."""

    length: str
    mm: float
    """In one of them."""
    digits: str
    residual: str
    per_mm: float
    """Of the unit of residuals."""
    decimals: int

    @classmethod
    def of(cls, summary: Record) -> _Unit:
        """Inches where all rapids are in inches."""
        return _INCH if summary.get("inch") else _METRIC

    def small(self, length: float) -> str:
        """A residual of so many mm."""
        return f"{length * self.per_mm:.{self.decimals}f}"


_METRIC = _Unit("mm", 1.0, ".3f", "um", UM_PER_MM, 1)
_INCH = _Unit("inch", MM_PER_INCH, ".4f", "thou", UM_PER_MM / MM_PER_INCH, 2)


def _position(position: dict[str, float | None], unit: _Unit, rotary: frozenset[str]) -> str:
    """`X1.5 Z?` with a question mark for what is unknown."""
    return " ".join(
        f"{axis}?" if x is None else f"{axis}{x / (1.0 if axis in rotary else unit.mm):.6g}"
        for axis, x in position.items()
    )


def _number(value: float | None, form: str) -> str:
    return "" if value is None else f"{value:{form}}"


def _ms(value: float | None, form: str) -> str:
    return "" if value is None else f"{value * MS_PER_S:{form}}"


def _worst(residual: Sequence[Record], unit: _Unit) -> str:
    """The largest residual displacement now and as planned."""
    if not residual:
        return "no modes"
    now, then = (
        max(entry[key] for entry in residual) * unit.per_mm
        for key in ("conventional_displacement", "displacement")
    )
    return f"{now:.2f} -> {then:.2f}"


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
