"""The rapids of a page as compact columns: numbers as base64, text as lists.

This module owns which rapids a page shows, and the shape in which their numbers travel. The script
of the page unpacks each column into a typed array and draws from it.

Rule: bounded. A page has `MOST_RAPIDS` at most, those that leave the most; curves take
`CURVE_BYTES` at most, and the rapids that leave the least go without.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass, fields
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.motion import Profiles
from gcodejerk.motion.profiles.profile import Array, joined
from gcodejerk.motion.profiles.repeated import RepeatedProfiles
from gcodejerk.nc import Rapids
from gcodejerk.planning.settling import known_moves, settling_times, todays_rapids
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.report.page.text import visible
from gcodejerk.rewrite.result import Result
from gcodejerk.storage import Growing, windows

Record = dict[str, Any]
Rows = NDArray[np.int64]
MOST_RAPIDS = 20_000
CURVE_BYTES = 1_600_000
"""Of all profiles, as they are packed."""
EXACT_BYTES = 800_000
"""Profiles that take more are packed in single precision."""
LONGEST_TEXT = 80
"""Characters of a block that are shown."""
LONGEST_BLOCK = 1000
"""Bytes of a block that are read."""
ALL_AXES = 255


def packed(values: NDArray[Any], kind: str) -> Record:
    """A column: its type as numpy names it, and its bytes, little-endian, in base64.

    Examples
    --------
    >>> packed(np.array([1, 2]), "u1")
    {'type': 'u1', 'data': 'AQI='}
    """
    data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"type": kind, "data": base64.b64encode(data).decode("ascii")}


@dataclass(frozen=True, slots=True, eq=False)
class Figures:
    """What each rapid leaves and waits for, columns of n; NaN where it is not known.

    Attributes
    ----------
    before, after : ndarray, shape (n,)
        Largest displacement that a mode keeps, of today's rapid and as written. [mm]
    waited, waits : ndarray, shape (n,)
        Until all modes are within the tolerance, likewise; may be infinite. [s]
    mode : ndarray of int, shape (n,)
        Mode that more is left of than of any other, before or after; 0 where that is not known.
    time, usual : ndarray, shape (n,)
        How long it lasts as written, and today. [s]
    """

    before: Array
    after: Array
    waited: Array
    waits: Array
    mode: Rows
    time: Array
    usual: Array

    @classmethod
    def of(cls, result: Result) -> Figures:
        """The figures of a result."""
        parts = [Growing(np.int64 if f.name == "mode" else np.float64) for f in fields(cls)]
        for rows in windows(len(result.plans)):
            of_rows = cls._of(result, rows)
            for part, f in zip(parts, fields(cls), strict=True):
                part.extend(getattr(of_rows, f.name))
        return cls(*(part.finish() for part in parts))

    @classmethod
    def _of(cls, result: Result, rows: slice) -> Figures:
        """Those of some rapids."""
        plans, rest, rest_time = result.plans, result.rest, result.rest.time[rows]
        planned = plans.reason[rows] == CERTAIN
        each, left = planned[:, np.newaxis], rest.residual[rows]
        now = np.where(each, result.conventional_residual[rows], left)
        then = np.where(each, result.residual[rows], left)
        times = plans.counts[rows] * plans.machine.interval
        if plans.lasting is not None:
            times = np.where(planned, plans.lasting[rows], 0.0)
        tolerance, modes = plans.machine.design.tolerance, plans.modes
        before, after = modes.grouped(now), modes.grouped(then)
        known = np.isfinite(before).all(axis=1) & (planned | (rest_time > 0.0))
        usual = np.where(planned, plans.conventional_time[rows], rest_time)
        set_anew = result.settings is not None and bool(result.settings.changed)
        unknown = ~known | (set_anew & ~planned)
        nothing = np.full(len(planned), np.nan)
        if not len(modes.modes):
            return cls(nothing, nothing, nothing, nothing, np.zeros(len(planned), np.int64),
                       np.where(planned, times, usual), usual)  # fmt: skip
        return cls(
            before=np.where(known, before.max(axis=1), np.nan),
            after=np.where(unknown, np.nan, after.max(axis=1)),
            waited=np.where(known, settling_times(now, modes, tolerance), np.nan),
            waits=np.where(unknown, np.nan, settling_times(then, modes, tolerance)),
            mode=np.nan_to_num(np.fmax(before, after)).argmax(axis=1).astype(np.int64),
            time=np.where(planned, times, np.where(unknown, np.nan, rest_time)),
            usual=np.where(usual > 0.0, usual, np.nan),
        )


def chosen_rapids(figures: Figures, most: int) -> Rows:
    """The rapids that a page shows, in the order of the file: all, or those that leave the most."""
    leaves = np.where(np.isnan(figures.after), figures.before, figures.after)
    if len(leaves) <= most:
        return np.arange(len(leaves))
    order = np.argsort(-np.nan_to_num(leaves, nan=-1.0), kind="stable")
    return np.sort(order[:most])


def rapid_columns(result: Result, source: BinaryIO, figures: Figures, rows: Rows) -> Record:
    """The columns of some rapids.

    Parameters
    ----------
    result : Result
        Of `process`.
    source : binary file
        The program, for the text of the blocks.
    figures : Figures
        Of all rapids.
    rows : ndarray of int, shape (r,)
        Which of them.

    Returns
    -------
    dict
        Columns of r, but `first` of the curves.
    """
    rapids, plans = result.program.rapids, result.plans
    named = np.bitwise_or.reduce(rapids.words[rows], initial=0)
    axes = [k for k in range(len(AXES)) if int(named) >> k & 1 or k < 3]
    leaves = np.nan_to_num(figures.after[rows], nan=0.0)
    return {
        "axes": [AXES[k] for k in axes],
        "count": len(rows),
        "line": packed(rapids.line[rows], "i4"),
        "reason": packed(plans.reason[rows], "u1"),
        "words": packed(rapids.words[rows], "u2"),
        "start": [packed(rapids.start[rows, k], "f8") for k in axes],
        "end": [packed(rapids.target[rows, k], "f8") for k in axes],
        "mode": packed(figures.mode[rows], "u2"),
        **{
            name: packed(getattr(figures, name)[rows], "f4")
            for name in ("before", "after", "waited", "waits", "time", "usual")
        },
        "block": _blocks(rapids, source, rows),
        "curves": _curves(result, rows, np.argsort(-leaves, kind="stable")),
    }


def _blocks(rapids: Rapids, source: BinaryIO, rows: Rows) -> list[str]:
    """The text of blocks."""
    out = []
    for begin, end in zip(rapids.begin[rows].tolist(), rapids.end[rows].tolist(), strict=True):
        source.seek(begin)
        text = visible(source.read(min(end - begin, LONGEST_BLOCK)))
        out.append(text if len(text) <= LONGEST_TEXT else text[: LONGEST_TEXT - 1] + "…")
    return out


def _curves(result: Result, rows: Rows, order: Rows) -> Record:
    """The profiles of rapids, each different one once; what they carry follows from the ends.

    Of rapid i these are the entries ``first[i]`` to ``first[i + 1]`` of `before`, `after` and
    `axis`: one, or under independent positioning one for each axis that moves.
    """
    plans, rapids = result.plans, result.program.rapids
    moved = known_moves(rapids, plans, rows)
    planned = plans.planned[rows]
    left = np.flatnonzero(~planned & np.isfinite(moved).all(axis=1))
    own, of_left, share = todays_rapids(plans, moved[left], rapids.lone[rows[left]])
    begin, end = (np.searchsorted(plans.move, rows, side=side) for side in _SIDES)
    counts = np.where(planned, end - begin, 0)
    ends = np.cumsum(counts)
    used = np.repeat(begin - (ends - counts), counts) + np.arange(counts.sum())
    store = _Store([_few(plans.profiles, used), _few(plans.conventional, used), own])
    designed, beside = len(used), 2 * len(used)
    entries: list[list[tuple[int, int, int]]] = [[] for _ in rows]
    independent = plans.machine.positioning != "linear"
    place = dict(zip(left.tolist(), range(len(left)), strict=True))
    for i in order.tolist():
        if planned[i]:
            shown = range(int(ends[i] - counts[i]), int(ends[i]))
            each = [(k, designed + k, plans.share[used[k]]) for k in shown]
        elif i in place:
            first, last = np.searchsorted(of_left, [place[i], place[i] + 1]).tolist()
            each = [(beside + k, beside + k, share[k]) for k in range(first, last)]
        else:
            continue
        for then, now, carried in each:
            axis = int(np.argmax(carried != 0.0)) if independent else ALL_AXES
            found = store.index(now), store.index(then)
            if min(found) >= 0:
                entries[i].append((*found, axis))
    flat = np.array([entry for own in entries for entry in own], dtype=np.int64).reshape(-1, 3)
    return {
        "first": packed(np.cumsum([0, *map(len, entries)]), "i4"),
        "before": packed(flat[:, 0], "i4"),
        "after": packed(flat[:, 1], "i4"),
        "axis": packed(flat[:, 2], "u1"),
        "profiles": store.packed(),
        "full": store.full,
    }


_SIDES: tuple[Any, ...] = ("left", "right")


def _few(profiles: Profiles, rows: Rows) -> RepeatedProfiles:
    """Some profiles, each different one once."""
    like = profiles.like[rows] if isinstance(profiles, RepeatedProfiles) else rows
    distinct = profiles.distinct if isinstance(profiles, RepeatedProfiles) else profiles
    used, of_used = np.unique(like, return_inverse=True)
    return RepeatedProfiles(distinct.take(used), of_used.reshape(-1))


class _Store:
    """Different profiles, as many as there is room for."""

    def __init__(self, parts: list[Profiles]) -> None:
        """Begin; profiles are counted through all parts."""
        distinct = [p.distinct if isinstance(p, RepeatedProfiles) else p for p in parts]
        before = np.cumsum([0, *map(len, distinct)])
        like = [p.like if isinstance(p, RepeatedProfiles) else np.arange(len(p)) for p in parts]
        self.like = np.concatenate([own + k for own, k in zip(like, before[:-1], strict=True)])
        self.profiles = joined(distinct)
        self.taken: list[int] = []
        self.known: dict[bytes, int] = {}
        self.segments = 0
        self.full = False

    def index(self, profile: int) -> int:
        """Where a profile is kept; -1 where there is no room."""
        profile = int(self.like[profile])
        first, last = self.profiles.first[profile : profile + 2].tolist()
        columns = (self.profiles.duration, self.profiles.acceleration, self.profiles.jerk)
        key = b"".join(column[first:last].tobytes() for column in columns)
        if key in self.known:
            return self.known[key]
        if (self.segments + last - first) * 3 * np.dtype(np.float32).itemsize > CURVE_BYTES:
            self.full = True
            return -1
        self.segments += last - first
        self.known[key] = len(self.taken)
        self.taken.append(profile)
        return self.known[key]

    def packed(self) -> Record:
        """What is kept, as columns of segments."""
        kept = self.profiles.take(np.array(self.taken, dtype=np.int64))
        exact = 3 * kept.duration.nbytes <= EXACT_BYTES
        kind = "f8" if exact else "f4"
        return {
            "first": packed(kept.first, "i4"),
            "duration": packed(kept.duration, kind),
            "acceleration": packed(kept.acceleration, kind),
            "jerk": packed(kept.jerk, kind),
        }


def mode_columns(result: Result) -> Record:
    """The modes, and the oscillators that they stand for."""
    modes = result.plans.modes
    return {
        "name": [visible(mode.name) for mode in modes.modes],
        "axes": list(modes.labels),
        "frequency": [float(f"{mode.frequency:.10g}") for mode in modes.modes],
        "group": packed(modes.group, "u2"),
        "decay": packed(modes.poles.real, "f8"),
        "omega": packed(modes.poles.imag, "f8"),
        "participation": packed(modes.participation, "f8"),
    }


def reason_names() -> list[str]:
    """The texts of all reasons, by index."""
    return [str(reason) for reason in REASONS]
