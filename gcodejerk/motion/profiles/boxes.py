"""Profiles that are a step of position behind three moving averages, in closed form."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles


def box_profiles(w1: Array, w2: Array, w3: Array) -> Profiles:
    """Profiles of boxes: a step of the jerk, up or down, at the sum of every subset of the widths.

    Parameters
    ----------
    w1, w2, w3 : ndarray, shape (n,)
        Widths, in any order. [s]

    Returns
    -------
    Profiles
    """
    chosen = np.array(list(itertools.product((0, 1), repeat=3)))
    widths = np.stack([w1, w2, w3], axis=1)
    times = widths @ chosen.T
    steps = (-1.0) ** chosen.sum(axis=1) / widths.prod(axis=1)[:, np.newaxis]
    order = np.argsort(times, axis=1, kind="stable")
    times, steps = (np.take_along_axis(x, order, axis=1) for x in (times, steps))
    duration = np.diff(times, axis=1)
    jerk = np.cumsum(steps, axis=1)[:, :-1]
    used: NDArray[np.bool_] = duration > 1e-12
    acceleration = np.cumsum(jerk * duration, axis=1) - jerk * duration
    first = np.concatenate([[0], np.cumsum(used.sum(axis=1))])
    return Profiles.of(first, duration[used], acceleration[used], jerk[used])
