r"""The guard: what frequencies that nobody named may keep of an optimum.

An optimum leaves the modes of the machine file still at the cost of all others: a mode that the
file does not name shook several times more than after today's rapid. This module owns

* which frequencies are guarded: from `ABOVE` to `BELOW` times every mode, as far as `CEILING`;
  those within the band of a mode are not, they have a better promise;
* what they may keep: `guard` times the local envelope of what today's rapid leaves there.

The envelope is that of a hidden mode without damping, in the worst phase of its two halves: the
response to today's acceleration and that to its braking are added as moduli, which removes the fine
fringes that the duration of the cruise makes. The nulls that are left, of the ramps, are luck too:
the largest value within `WINDOW` of a frequency counts.

Rule: the hidden mode is excited like the tool's other modes, along the line of the move; only its
response relative to today's counts, so participation and length drop out.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.residual import Complex
from gcodejerk.motion.search.unit_move import Move

ABOVE, BELOW = 1.3, 5.0
"""Guarded is from so many times the frequency of a mode to so many times it."""
CEILING = 0.25
"""Highest guarded frequency, times the interval: above it, four commands a period shape little."""
WINDOW = 0.15
"""Part of a frequency on each side of it in which today's largest response is its envelope."""
FINE, MOST = 0.15, 8000
"""Distance of frequencies, times the half of a duration, at which a response is looked at [rad],
and how many at most: a ramp of a second has more than it can be designed for."""
WIDEST = 1.5
"""Nothing more is kept back for frequencies farther apart than so much. [rad]"""
GAP, BETWEEN = 1.5, 4
"""Frequencies farther apart than so many times the usual have something else between them; into how
many parts the others are cut in search of a narrow."""
SAMPLED, FEWEST = 0.1, 200
"""The same distance for the envelope of today's, and how many frequencies at least."""


def guarded_frequencies(poles: Complex, band: float, interval: float, duration: float) -> Array:
    """The frequencies that are guarded, close enough for a profile of some duration.

    Parameters
    ----------
    poles : ndarray of complex, shape (m,)
        Of the modes that the move excites. [rad/s]
    band : float
        Relative error of their frequencies. [-]
    interval : float
        Of the commands. [s]
    duration : float
        Of what is to be looked at. [s]

    Returns
    -------
    ndarray, shape (k,)
        [rad/s]
    """
    modes = np.abs(poles)
    highest = np.minimum(BELOW * modes, 2.0 * np.pi * CEILING / interval)
    lowest = ABOVE * modes
    if not (highest > lowest).any():
        return np.zeros(0)
    begin, end = lowest[highest > lowest].min(), highest.max()
    count = min(int(np.ceil(0.5 * (end - begin) * duration / FINE)), MOST) + 1
    # The ends of what is known and of what is guarded are looked at as well.
    ends = [(1.0 - band) * modes, (1.0 + band) * modes, lowest, highest]
    omega = np.unique(np.concatenate([np.linspace(begin, end, count), *ends]))[:, np.newaxis]
    inside = ((omega >= lowest) & (omega <= highest)).any(axis=1)
    known = (np.abs(omega / modes - 1.0) < band * (1.0 - 1e-9)).any(axis=1)
    guarded: Array = omega[inside & ~known, 0]
    return guarded


def envelope(today: Profiles, omega: Array) -> Array:
    """The local envelope of the response to one profile.

    Parameters
    ----------
    today : Profiles
        One unit profile.
    omega : ndarray, shape (k,)
        Ascending. [rad/s]

    Returns
    -------
    ndarray, shape (k,)
        [1/s]
    """
    if not len(omega):
        return np.zeros(0)
    halves = split_at_peak(today)
    low, high = omega[0] * (1.0 - WINDOW), omega[-1] * (1.0 + WINDOW)
    longest = max(float(half.total[0]) for half in halves)
    count = max(int(np.ceil(0.5 * (high - low) * longest / SAMPLED)), FEWEST)
    every = np.linspace(low, high, count)
    response = np.add(*(undamped_response(half, every) for half in halves))
    # The largest within the window, or at its ends, which lie between these frequencies.
    ends = np.column_stack([omega * (1.0 - WINDOW), omega * (1.0 + WINDOW)])
    beside = np.interp(ends, every, response).max(axis=1)
    within = np.searchsorted(every, ends).ravel()
    inside = np.maximum.reduceat(np.append(response, 0.0), within)[::2]
    largest: Array = np.where(within[1::2] > within[::2], np.maximum(inside, beside), beside)
    return largest


def with_narrows(today: Profiles, omega: Array) -> tuple[Array, Array]:
    """Frequencies, those between them at which the envelope has a narrow, and the envelope of all.

    Where one of today's peaks leaves the window and the next one enters it, the envelope has a kink
    that is closer than frequencies are; what is held at both sides of it may exceed it there.

    Parameters
    ----------
    today : Profiles
        One unit profile.
    omega : ndarray, shape (k,)
        Ascending. [rad/s]

    Returns
    -------
    omega : ndarray, shape (k + n,)
        [rad/s]
    envelope : ndarray, shape (k + n,)
        [1/s]
    """
    if len(omega) < 2:
        return omega, envelope(today, omega)
    apart = np.diff(omega)
    # What lies between others is not guarded.
    close = np.flatnonzero(apart < GAP * np.median(apart))
    shares = np.arange(1, BETWEEN) / BETWEEN
    between = omega[close, np.newaxis] + shares * apart[close, np.newaxis]
    every = np.sort(np.concatenate([omega, between.ravel()]))
    bound = envelope(today, every)
    sides = np.pad(bound, 1, constant_values=np.inf)
    narrow = (bound < sides[:-2]) & (bound < sides[2:])
    narrow[np.searchsorted(every, omega)] = True
    return every[narrow], bound[narrow]


def guarded_response(move: Move, poles: Complex, duration: float) -> tuple[Array, Array] | None:
    """The frequencies that are guarded of a move, and the response that each of them may keep.

    Parameters
    ----------
    move : Move
        Its guard is 0, and nothing guarded, where anything may be left.
    poles : ndarray of complex
        Of the modes that it excites. [rad/s]
    duration : float
        Of the move, or of the part of it that is designed. [s]

    Returns
    -------
    omega, allowed : ndarray, shape (k,), or None
        [rad/s] and [1/s]
    """
    if move.today is None or not move.guard:
        return None
    omega = guarded_frequencies(poles, move.band, move.interval, duration)
    omega, bound = with_narrows(move.today, omega)
    return omega, move.guard * bound * share_between(omega, duration)


def share_between(omega: Array, duration: float) -> float:
    """What frequencies may keep, of what those between them may: a response has its peaks there.

    Of what lasts some time the response between two frequencies is at most the larger of theirs
    over the cosine of half their distance, times the half of the duration.
    """
    if len(omega) < 2:
        return 1.0
    apart = 0.5 * duration * float(np.median(np.diff(omega)))
    return float(np.cos(0.5 * min(apart, WIDEST)))


def undamped_response(profile: Profiles, omega: Array) -> Array:
    """Modulus of the response of undamped modes to one profile (`profiles_response`), shape (k,).

    Computed for all frequencies at once, as a profile has few segments or is looked at seldom.
    """
    phase = np.multiply.outer(omega, profile.step_times())
    cosine, sine = np.cos(phase), np.sin(phase)
    a, j = profile.acceleration_steps(), profile.jerk_steps()
    real = cosine @ a - (sine @ j) / omega
    response: Array = np.hypot(real, sine @ a + (cosine @ j) / omega) / omega
    return response


def split_at_peak(profile: Profiles) -> tuple[Profiles, Profiles]:
    """One profile cut where its velocity has become largest: acceleration; cruise and braking."""
    velocity = profile.turning_velocity
    k = int(np.argmax(velocity >= velocity.max() * (1.0 - 1e-9)))
    a, j = profile.acceleration, profile.jerk
    moment = -a[k] / j[k] if j[k] else 0.0
    if not 0.0 < moment < profile.duration[k]:
        moment = 0.0
    left = profile.duration[k] - moment
    at = a[k] + j[k] * moment
    before = np.append(profile.duration[:k], moment)
    keep = before > 0.0
    first = Profiles.of(
        np.array([0, int(keep.sum())]), before[keep], a[: k + 1][keep], j[: k + 1][keep]
    )
    second = Profiles.of(
        np.array([0, len(a) - k]),
        np.append(left, profile.duration[k + 1 :]),
        np.append(at, a[k + 1 :]),
        j[k:],
    )
    return first, second


def keeps_guard(
    profiles: Profiles, today: Profiles, poles: list[Complex], band: float, interval: float,
    guard: float,
) -> NDArray[np.bool_]:  # fmt: skip
    """Whether profiles leave guarded frequencies at most `guard` times today's envelope.

    Parameters
    ----------
    profiles, today : Profiles
        n unit profiles each.
    poles : list of ndarray of complex
        Of the modes that each move excites. [rad/s]
    band, interval, guard : float
        Of the machine. [-], [s], [-]

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    keeps = np.ones(len(profiles), dtype=bool)
    for k, own in enumerate(poles):
        profile = profiles.take(slice(k, k + 1))
        omega = guarded_frequencies(own, band, interval, float(profile.total[0]))
        allowed = guard * envelope(today.take(slice(k, k + 1)), omega)
        keeps[k] = np.all(undamped_response(profile, omega) <= allowed)
    return keeps
