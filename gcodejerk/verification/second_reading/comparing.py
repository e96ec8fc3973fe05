"""What two readings say of the same rapids, held against each other: of one, or of many as columns.

Rule: where the second reading knows, it must agree; what it does not know is no disagreement, and
no confirmation either.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gcodejerk.axes import AXES
from gcodejerk.nc import Rapids
from gcodejerk.storage import gathered
from gcodejerk.units import MM_PER_INCH, SECONDS_PER_MINUTE
from gcodejerk.verification.second_reading.known import NEAR, Observation
from gcodejerk.verification.second_reading.straight import Column, Straight
from gcodejerk.verification.second_reading.tracking import Tracker


class Columns:
    """Compares rapids in plain lines, many at once."""

    def __init__(self, rapids: Rapids, index: NDArray[np.int64]) -> None:
        self.rapids, self.index = rapids, index
        self.line = gathered(rapids.line, index)
        self.confirmed = 0

    def agrees(self, run: Straight, number: NDArray[np.int64], tracker: Tracker) -> bool:
        """Compare those of some lines; whether the two readings agree in every one of them.

        Parameters
        ----------
        run : Straight
            The lines.
        number : ndarray of int
            Of each of them in the file, from 1, ascending; on others between them nothing moves.
        tracker : Tracker
            What is in force in them.
        """
        first, last = np.searchsorted(self.line, [number[0], number[-1] + 1])
        i = self.index[first:last]
        at = np.searchsorted(number, self.line[first:last])
        if not np.array_equal(number[at], self.line[first:last]):
            return False
        rapids, axes = self.rapids, run.axes[at]
        good = run.rapid[at] & (axes == rapids.words[i])
        known = np.ones(len(i), dtype=np.bool_)
        for mine, theirs in ((run.start[at], rapids.start), (run.end[at], rapids.target)):
            for k in range(mine.shape[1]):
                used, place = axes >> k & 1 != 0, mine[:, k]
                off = np.abs(place - theirs[i, k])
                good &= ~(used & (off > NEAR * np.maximum(1.0, np.abs(place) / 1e3)))
                known &= ~used | ~np.isnan(place)
        force = tracker.in_force() | {
            "F": run.feed[at],
            "speed": run.feed[at] * (tracker.unit or math.nan) / SECONDS_PER_MINUTE,
            "F without a point": np.where(np.isnan(run.feed[at]), np.nan, run.whole[at]),
            "motion": 0,
        }
        for name, told in _told_columns(rapids, i).items():
            value = force[name]
            a = np.broadcast_to(np.nan if value is None else np.asarray(value, float), told.shape)
            same = np.abs(a - told) <= 1e-12 * np.maximum(np.abs(a), np.abs(told))
            good &= same | np.isnan(a) | np.isnan(told)
            known &= np.isnan(told) | ~np.isnan(a)
        if tracker.path:
            for own, column in ((tracker.p, rapids.path_p), (tracker.q, rapids.path_q)):
                told = column[i]
                none = np.isnan(told) & (own != own)
                good &= (told == own) | none | (rapids.path[i] == 0)
        if not good.all():
            return False
        self.confirmed += int(np.count_nonzero(known))
        return True


def disagreement(seen: Observation, rapids: Rapids, i: int, follows: bool) -> str:
    """In what the two readings differ, of a rapid that follows a stream or not; else empty."""
    if seen.against:
        return f"this rapid had to be left alone, since {seen.against}"
    if seen.entered and follows and not rapids.entered[i]:
        return "a jump or a call leads to it, and its stream begins without a standstill"
    if not seen.modes:
        return ""
    if seen.sure and seen.axes != int(rapids.words[i]):
        return f"the block names {_names(seen.axes)}, not {_names(int(rapids.words[i]))}"
    for what, places, other in (
        ("starts", seen.start, rapids.start[i]),
        ("ends", seen.end, rapids.target[i]),
    ):
        for k, place in enumerate(places):
            if seen.axes >> k & 1 and abs(place - other[k]) > NEAR * max(1.0, abs(place) / 1e3):
                return f"{AXES[k]} {what} at {place:.6g}, not at {float(other[k]):.6g} [mm or deg]"
    for name, told in _told(rapids, i).items():
        mine = seen.modes[name]
        known = mine is not None and mine == mine and told is not None and told == told
        if known and not math.isclose(mine, told, rel_tol=1e-12):
            return f"{name} is {mine:g}, not {told:g}"
    return _tolerances(seen, rapids, i)


def _told_columns(rapids: Rapids, i: NDArray[np.int64]) -> dict[str, Column]:
    """The same of many rapids; NaN where it does not know."""
    feed, words = rapids.feed[i], rapids.words[i]
    return {
        "unit": np.where(rapids.inch[i], MM_PER_INCH, 1.0),
        "incremental": rapids.incremental[i].astype(np.float64),
        "diameter": np.where(words & 1 != 0, rapids.diameter[i], np.nan),
        "feed mode": np.where(rapids.feed_mode[i] == 0, np.nan, rapids.feed_mode[i]),
        "F": feed,
        "F without a point": np.where(np.isnan(feed), np.nan, rapids.feed_whole[i]),
        "path": np.where(rapids.path[i] == 0, np.nan, rapids.path[i]),
        "speed": rapids.speed[i],
        "motion": rapids.fed[i].astype(np.float64),
    }


def _tolerances(seen: Observation, rapids: Rapids, i: int) -> str:
    """P and Q of G64, which may be absent."""
    if seen.modes["path"] is None or not rapids.path[i]:
        return ""
    for letter, told in (("P", float(rapids.path_p[i])), ("Q", float(rapids.path_q[i]))):
        mine = seen.modes[letter]
        if mine != told and (mine == mine or told == told):
            return f"G64 has {letter} {mine:g}, not {told:g}"
    return ""


def _told(rapids: Rapids, i: int) -> dict[str, Any]:
    """What `nc` says is in force behind a rapid; None and NaN where it does not know."""
    feed = float(rapids.feed[i])
    return {
        "unit": MM_PER_INCH if rapids.inch[i] else 1.0,
        "incremental": bool(rapids.incremental[i]),
        "diameter": bool(rapids.diameter[i]) if int(rapids.words[i]) & 1 else None,
        "feed mode": int(rapids.feed_mode[i]) or None,
        "F": feed,
        "F without a point": bool(rapids.feed_whole[i]) if feed == feed else None,
        "path": int(rapids.path[i]) or None,
        "speed": float(rapids.speed[i]),
        "motion": 1 if rapids.fed[i] else 0,
    }


def is_known(seen: Observation, rapids: Rapids, i: int) -> bool:
    """Whether the second reading knows all that `nc` says of a rapid."""
    if not seen.sure:
        return False
    named = [k for k in range(len(AXES)) if seen.axes >> k & 1]
    if any(math.isnan(seen.start[k]) or math.isnan(seen.end[k]) for k in named):
        return False
    for name, told in _told(rapids, i).items():
        mine = seen.modes[name]
        if told is not None and told == told and (mine is None or mine != mine):
            return False
    return True


def _names(axes: int) -> str:
    return ", ".join(axis for k, axis in enumerate(AXES) if axes >> k & 1) or "no axis"
