"""Profiles behind filters: what an axis does whose control averages or shapes its motion.

A shaper's profile is exact: copies of pieces of constant jerk are such pieces. So is the average of
a trapezoid of velocity. The average of a motion of finite jerk has a parabola for its acceleration;
three pieces stand for every interval of it (`pieces`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gcodejerk.motion.families.filters import AVERAGE, TRIANGLE, impulses
from gcodejerk.motion.families.pieces import POINTS, sampled_profiles
from gcodejerk.motion.profiles.profile import Array, Index, Profiles, joined

FINEST = 0.002
"""Intervals of an averaged motion are no longer than this where its acceleration is curved [s]."""
MOST = 6
"""How often a stretch between two steps is halved for that, at most."""
SHORTEST = 1e-6
"""An average shorter than this counts as this long [s]."""


def filtered(
    profiles: Profiles,
    kind: str,
    setting: ArrayLike,
    damping: ArrayLike = 0.0,
    tick: float = 0.0,
) -> Profiles:
    """Profiles behind a filter.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    kind : str
        One of `filters.KINDS`.
    setting, damping : array_like, shape (n,) or scalar
        Time of an average [s], frequency of a shaper [Hz]; its damping ratio [-].
    tick : float, optional
        As in `filters.impulses`. [s]

    Returns
    -------
    Profiles
        n, each longer by `filters.length`.

    Raises
    ------
    PlanError
        As `filters.impulses`.
    """
    n = len(profiles)
    x, zeta = (np.broadcast_to(np.asarray(y, dtype=float), (n,)) for y in (setting, damping))
    if kind == TRIANGLE:
        return averaged_profiles(profiles, x, x)
    if kind == AVERAGE:
        return averaged_profiles(profiles, x)
    return shaped_profiles(profiles, *impulses(kind, x, zeta, tick))


def shaped_profiles(profiles: Profiles, delays: Array, amplitudes: Array) -> Profiles:
    """Sums of delayed copies of profiles.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    delays, amplitudes : ndarray, shape (n, i)
        [s], and shares that add up to 1. [-]

    Returns
    -------
    Profiles
        n, each longer by its last delay.
    """
    n = len(profiles)
    at = _padded(profiles)
    times = (profiles.step_times()[at][:, np.newaxis, :] + delays[..., np.newaxis]).reshape(n, -1)
    order = np.argsort(times, axis=1, kind="stable")
    times = np.take_along_axis(times, order, axis=1)
    # A profile's last step stands in the places that it has not: those add nothing.
    real = np.arange(at.shape[1]) <= np.diff(profiles.first)[:, np.newaxis]
    steps = []
    for step in (profiles.acceleration_steps(), profiles.jerk_steps()):
        own = np.where(real, step[at], 0.0)
        each = (amplitudes[..., np.newaxis] * own[:, np.newaxis, :]).reshape(n, -1)
        steps.append(np.take_along_axis(each, order, axis=1))
    duration = np.diff(times, axis=1)
    jerk = np.cumsum(steps[1], axis=1)[:, :-1]
    # The acceleration at each begin: its own steps, and what the jerk has added before.
    gained = jerk * duration
    acceleration = np.cumsum(steps[0], axis=1)[:, :-1] + np.cumsum(gained, axis=1) - gained
    used = duration > 1e-12
    least = 1e-12 * np.abs(jerk).max(axis=1, initial=0.0, keepdims=True)
    jerk = np.where(np.abs(jerk) < least, 0.0, jerk)
    first = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return Profiles.of(first, duration[used], acceleration[used], jerk[used])


def averaged_profiles(profiles: Profiles, first: ArrayLike, second: ArrayLike = 0.0) -> Profiles:
    """Moving averages of profiles over one time each, or over one and then another.

    The acceleration is a difference of speeds or of positions, divided by the times: at the
    intervals' ends it is exact, and so are position and speed.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    first, second : array_like, shape (n,) or scalar
        Times of the averages; no second one if all are 0. Otherwise a time below a microsecond
        counts as one. [s]

    Returns
    -------
    Profiles
    """
    n = len(profiles)
    T1, T2 = (
        np.maximum(np.broadcast_to(np.asarray(x, dtype=float), (n,)), SHORTEST)[:, np.newaxis]
        for x in (first, second)
    )
    twice = bool(np.any(np.asarray(second) > 0.0))
    lates = (0.0 * T1, T1, T2, T1 + T2) if twice else (0.0 * T1, T1)
    steps = profiles.step_times()[_padded(profiles)]
    times = np.sort(np.concatenate([steps + late for late in lates], axis=1), axis=1)
    middle = 0.5 * (times[:, 1:] + times[:, :-1])
    states = [_state(profiles, middle - late) for late in lates]
    # Where a constant speed is averaged there is nothing to follow; nor, once, an acceleration.
    straight = np.all([s.jerk == 0.0 for s in states], axis=0)
    if twice:
        straight &= np.all([s.acceleration == 0.0 for s in states], axis=0)
    longest = np.where(straight, 0.0, np.diff(times, axis=1)).max(axis=1, initial=FINEST)
    # Twice averaged, an acceleration bends half as sharply.
    finest = 2.0 * FINEST if twice else FINEST
    doubled = np.maximum(np.ceil(np.log2(longest / finest) - 1e-9), 0.0).astype(np.int64)
    # As many parts as a profile needs, whatever other profiles are there beside it.
    parts = [int(p) for p in np.unique(np.minimum(doubled, MOST))]
    rows = [np.flatnonzero(np.minimum(doubled, MOST) == p) for p in parts]
    out = joined(
        [
            _averaged(profiles.take(row), times[row], [late[row] for late in lates], 2**p)
            for row, p in zip(rows, parts, strict=True)
        ]
    )
    return out.take(np.argsort(np.concatenate(rows)))


def _averaged(profiles: Profiles, times: Array, lates: list[Array], parts: int) -> Profiles:
    """The averages, every stretch between two of the times (n, k) in as many parts."""
    n = len(profiles)
    share = np.arange(parts) / parts
    ends = times[:, :-1, np.newaxis] + np.diff(times, axis=1)[..., np.newaxis] * share
    ends = np.concatenate([ends.reshape(n, -1), times[:, -1:]], axis=1)
    duration = np.diff(ends, axis=1)
    at = (ends[:, :-1, np.newaxis] + duration[..., np.newaxis] * POINTS).reshape(n, -1)
    states = [_state(profiles, at - late) for late in lates]
    if len(lates) == 4:
        position = [s.position for s in states]
        acceleration = (position[0] - position[1]) - (position[2] - position[3])
        acceleration /= lates[1] * lates[2]
    else:
        acceleration = (states[0].velocity - states[1].velocity) / lates[1]
    return sampled_profiles(duration, acceleration.reshape(*duration.shape, len(POINTS)))


def _padded(profiles: Profiles) -> Index:
    """Places of the steps, shape (n, most); a profile with fewer repeats its last."""
    count = np.diff(profiles.first)
    start = profiles.first[:-1] + np.arange(len(profiles))
    column = np.arange(int(count.max(initial=0)) + 1)
    at: Index = start[:, np.newaxis] + np.minimum(column, count[:, np.newaxis])
    return at


class _State(NamedTuple):
    position: Array
    velocity: Array
    acceleration: Array
    jerk: Array


def _state(profiles: Profiles, t: Array) -> _State:
    """Of every profile at moments of its own, shape (n, k); at rest before it and after it."""
    begins = profiles.step_times()[_padded(profiles)]
    segment = np.zeros(t.shape, dtype=np.int64)
    for column in begins.T[1:]:
        segment += t >= column[:, np.newaxis]
    last = np.diff(profiles.first)[:, np.newaxis] - 1
    at = profiles.first[:-1, np.newaxis] + np.minimum(segment, last)
    tau = t - profiles.begin[at]
    before, after = t <= 0.0, t >= profiles.total[:, np.newaxis]
    moving = ~(before | after)
    p, v, a, j = (c[at] for c in profiles._columns()[2:])
    return _State(
        np.where(moving, p + (v + (a / 2.0 + j * tau / 6.0) * tau) * tau, after),
        np.where(moving, v + (a + 0.5 * j * tau) * tau, 0.0),
        np.where(moving, a + j * tau, 0.0),
        np.where(moving, j, 0.0),
    )
