r"""Residual vibration: what a mode keeps after a move has ended.

A mode (frequency f, damping ratio zeta, participation p) driven by the commanded acceleration a(t),

.. math:: \ddot q + 2 \zeta \omega \dot q + \omega^2 q = -p\, a(t),

has after the move's end T the envelope

.. math:: D = \frac{p}{\omega_d} \left| \int_0^T a(t)\, e^{\lambda (T - t)} dt \right|,
          \qquad \lambda = -\zeta\omega + j\omega_d .

This module owns that integral, called the *response* [mm/s] (of a unit profile: [1/s]), for each
way in which a motion is given: jerk steps, profiles, polylines of samples. Everything is exact,
damping too.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gcodejerk.errors import PlanError
from gcodejerk.motion.profiles.profile import Array, Profiles
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles

Complex = NDArray[np.complex128]
STILL = 1e-9
"""Acceleration that is none, of the profile's peak. [-]"""
EVEN = 2e-15
"""Relative change of the distance of poles, up to which they are evenly spaced."""
LONGEST_RUN = 16
"""Of so many evenly spaced poles exponentials are products; the rounding is below 1e-14."""
AT_ONCE = 16000
"""Numbers of an array that stays in the processor's nearest memory."""


def mode_poles(frequency: ArrayLike, damping: ArrayLike) -> Complex:
    """Poles of modes: -zeta omega + j omega_d.

    Parameters
    ----------
    frequency, damping : array_like, shape (m,)
        Undamped natural frequency [Hz], above 0, and damping ratio [-], at least 0 and below 1.

    Returns
    -------
    ndarray of complex, shape (m,)
        [rad/s]

    Raises
    ------
    PlanError
        A frequency or damping ratio is not that of a mode that vibrates.
    """
    f, zeta = np.asarray(frequency, dtype=float), np.asarray(damping, dtype=float)
    if not np.all((zeta >= 0.0) & (zeta < 1.0)):
        raise PlanError(
            f"damping ratio is {damping!r}, outside 0 <= damping < 1",
            "give the ratio to critical damping, for example 0.02",
        )
    if not np.all((f > 0.0) & np.isfinite(f)):
        raise PlanError(f"frequency is {frequency!r}, expected a number above zero [Hz]")
    omega = 2.0 * np.pi * f
    poles: Complex = -zeta * omega + 1j * omega * np.sqrt(1.0 - zeta * zeta)
    return poles


def residual_acceleration(
    switch_times: ArrayLike, jerk_steps: ArrayLike, frequency: ArrayLike, damping: float
) -> Array:
    r"""Acceleration amplitude that a mode keeps after a rest-to-rest move.

    Parameters
    ----------
    switch_times : array_like, shape (n,)
        Moments at which the jerk changes, the last one the end of the move. [s]
    jerk_steps : array_like, shape (n,)
        Change of the jerk at each of them. [mm/s^3]
    frequency : array_like, shape (...)
        Undamped natural frequency of the mode. [Hz]
    damping : float
        Damping ratio of the mode, at least 0 and below 1. [-]

    Returns
    -------
    ndarray, shape (...)
        Envelope at the end of the move, for participation 1. [mm/s^2]

    Raises
    ------
    PlanError
        The damping ratio is not that of a mode that vibrates, or times and steps are those of no
        move.

    Notes
    -----
    With :math:`\lambda = -\zeta\omega + j\omega_d` and :math:`\omega_d = \omega\sqrt{1-\zeta^2}`,
    a move that ends at T with zero acceleration leaves

    .. math:: A = \frac{1}{\omega_d} \left| \sum_k \Delta J_k\, e^{\lambda (T - t_k)} \right|

    the undamped case of which is Eq. 28 of [1]_, as a modulus.

    References
    ----------
    .. [1] R. Sato and K. Shirase, Precision Engineering 71, 2021, pp. 47-56.

    Examples
    --------
    1 mm in 40 ms with T1 = T2 = T3 = T4 = 10 ms: a 30 Hz mode keeps much, a 50 Hz mode, whose
    period is T1 + T2, nothing:

    >>> J = 5e5
    >>> t, dJ = [0.0, 0.01, 0.02, 0.03, 0.04], [J, -2 * J, 0.0, 2 * J, -J]
    >>> residual_acceleration(t, dJ, [30.0, 50.0], damping=0.0).round(1)
    array([13209.3,     0. ])
    >>> float(residual_acceleration(t, dJ, 30.0, damping=0.02).round(1))
    12266.9
    """
    t, dJ = _changes(switch_times, jerk_steps)
    poles = mode_poles(frequency, damping)[..., np.newaxis]
    vibration = dJ * np.exp(poles * (t[-1] - t)) / poles.imag
    amplitude: Array = np.abs(vibration.sum(axis=-1))
    return amplitude


def _changes(switch_times: ArrayLike, jerk_steps: ArrayLike) -> tuple[Array, Array]:
    """Times and steps as arrays; refused where they are none of a move."""
    t, dJ = np.asarray(switch_times, dtype=float), np.asarray(jerk_steps, dtype=float)
    if t.ndim != 1 or t.shape != dJ.shape or not len(t):
        raise PlanError(
            f"switch_times of shape {t.shape} and jerk_steps of shape {dJ.shape}",
            "give one time for each change of the jerk, shape (n,) each",
        )
    if not (np.isfinite(t).all() and np.isfinite(dJ).all()):
        raise PlanError("a time or a change of the jerk is not finite", "give numbers alone")
    if t[-1] < t.max():
        raise PlanError(
            f"the last time is {t[-1]:g} s, and {t.max():g} s comes before it",
            "give the end of the move last",
        )
    return t, dJ


def residual_displacement(response: NDArray[np.complex128], poles: Complex) -> Array:
    """Displacement envelope D of a response, participation already in it: |response| / omega_d."""
    return np.abs(response) / poles.imag


def grouped(amplitude: Array, group: NDArray[np.int64]) -> Array:
    """Residuals of groups of modes: the root of the squares' sum of each.

    A mode is a group of its own; the lines of a measured spectrum are one group.

    Parameters
    ----------
    amplitude : ndarray, shape (..., m)
        Of each mode, weights already in it. [mm]
    group : ndarray of int, shape (m,)
        Group of each mode, counted from 0; those of a group stand side by side.

    Returns
    -------
    ndarray, shape (..., g)
        [mm]

    Examples
    --------
    >>> grouped(np.array([3.0, 4.0, 7.0]), np.array([0, 0, 1])).tolist()
    [5.0, 7.0]
    """
    starts = np.flatnonzero(np.diff(group, prepend=-1))
    if len(starts) == len(group):
        return amplitude
    together: Array = np.sqrt(np.add.reduceat(amplitude**2, starts, axis=-1))
    return together


def profiles_response(profiles: Profiles, poles: Complex) -> Complex:
    r"""Response of modes to unit profiles, exact.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    poles : ndarray of complex, shape (m,)
        From `mode_poles`. [rad/s]

    Returns
    -------
    ndarray of complex, shape (n, m)
        The integral of a(t) exp(lambda (T - t)). [1/s]

    Notes
    -----
    With the steps of acceleration and jerk at the moments :math:`t_k`,
    :math:`\sum_k (\Delta a_k/\lambda + \Delta j_k/\lambda^2)\, e^{\lambda (T - t_k)}`: what the
    integration leaves besides is zero where a profile ends at rest.
    """
    if not len(profiles):
        return np.empty((0, len(poles)), dtype=np.complex128)
    return _steps_response(profiles, poles, profiles.first[:-1] + np.arange(len(profiles)))


def halves_response(profiles: Profiles, poles: Complex) -> tuple[Complex, Complex, Array]:
    """The same in two parts: of what happens before the longest cruise, and of what follows it.

    Parameters
    ----------
    profiles : Profiles
        n profiles.
    poles : ndarray of complex, shape (m,)
        From `mode_poles`. [rad/s]

    Returns
    -------
    before, after : ndarray of complex, shape (n, m)
        Their sum is `profiles_response`. [1/s]
    cruise : ndarray, shape (n,)
        Between the two, at a constant speed; 0 where there is none, and all is before. [s]
    """
    peak = profiles.peak_acceleration[profiles.owner]
    still = np.maximum(np.abs(profiles.acceleration), np.abs(profiles.end_acceleration)) < (
        STILL * peak
    )
    long = np.where(still, profiles.duration, 0.0)
    cruise = np.maximum.reduceat(long, profiles.first[:-1])
    at = np.flatnonzero((long == cruise[profiles.owner]) & still)
    # The last of equals.
    last = np.full(len(profiles), -1)
    last[profiles.owner[at]] = at
    begin = profiles.first[:-1] + np.arange(len(profiles))
    after = np.where(last >= 0, last + np.arange(len(profiles)) + 1, begin)
    parts = _steps_response(profiles, poles, np.stack([begin, after], axis=1).ravel())
    before, behind = parts[0::2], parts[1::2]
    # Where nothing cruises both parts begin at the same step: the second one is all.
    alone = last < 0
    before[alone], behind[alone] = behind[alone], 0.0
    return before, behind, cruise


def _steps_response(profiles: Profiles, poles: Complex, starts: NDArray[np.int64]) -> Complex:
    """Sums over the steps of profiles, from each start to the next, shape (len(starts), m)."""
    response = np.empty((len(starts), len(poles)), dtype=np.complex128)
    left = np.repeat(profiles.total, np.diff(profiles.first) + 1) - profiles.step_times()
    a, j = profiles.acceleration_steps(), profiles.jerk_steps()
    # Some poles at once: of few steps, a pole by itself is mostly calls. Runs stay whole, so that
    # what is computed of a profile does not depend on how many stand beside it.
    some = max(1, AT_ONCE // max(len(left), 1))
    runs: list[slice] = []
    for run in _even_runs(poles):
        runs.append(run)
        first = runs[0].start
        if run.stop - first >= some or run.stop == len(poles):
            inverse = 1.0 / poles[first : run.stop, np.newaxis]
            each = np.concatenate([_exponentials(poles[one], left) for one in runs])
            each *= (a + j * inverse) * inverse
            response[:, first : run.stop] = np.add.reduceat(each, starts, axis=1).T
            runs = []
    return response


def symmetric_response(profiles: SymmetricProfiles, poles: Complex) -> Complex:
    r"""The same for symmetric profiles, from their four durations: what searches evaluate.

    Notes
    -----
    A ramp of acceleration from 0 to A within T1 contributes
    :math:`(A/\lambda)\, e^{\lambda (T - t)} \varphi(\lambda T_1)`, where t is its beginning and
    :math:`\varphi(x) = (1 - e^{-x})/x`, which is 1 for a step of the acceleration: a trapezoid of
    velocity needs no case of its own. The four ramps of a profile share the powers of its segments.
    """
    A = profiles.acceleration
    response = np.empty((len(profiles), len(poles)), dtype=np.complex128)
    for m, pole in enumerate(poles):
        E1, Ea, E2, Ev = (_exponential(pole, duration) for duration in profiles.columns())
        up, down = _ramp(pole, profiles.T1, E1), _ramp(pole, profiles.T2, E2)
        first = E1 * Ea
        cruise_end = first * E2 * Ev
        response[:, m] = up * (1.0 + cruise_end * Ea * E2) - down * (cruise_end + first)
        response[:, m] *= A / pole
    return response


def _even_runs(poles: Complex) -> Iterator[slice]:
    """Poles next to each other that are evenly spaced, a few at a time; others by themselves.

    None decays more slowly than the one in front: behind one that has died, the product would be
    nothing times infinity.
    """
    step = np.diff(poles)
    even = (np.abs(np.diff(step)) <= EVEN * np.abs(poles[1:-1])) & (step[1:].real <= 0.0)
    begin = 0
    while begin < len(poles):
        run = even[begin : begin + LONGEST_RUN - 2]
        length = len(run) if run.all() else int(np.argmin(run))
        end = begin + (length + 2 if length else 1)
        yield slice(begin, end)
        begin = end


def _exponentials(poles: Complex, duration: Array) -> Complex:
    """exp(pole t) of evenly spaced poles, shape (m, k): as products, by doubling."""
    out = np.empty((len(poles), len(duration)), dtype=np.complex128)
    out[0] = _exponential(poles[0], duration)
    if len(poles) > 1:
        step = _exponential((poles[-1] - poles[0]) / (len(poles) - 1), duration)
        done = 1
        while done < len(poles):
            more = min(done, len(poles) - done)
            np.multiply(out[:more], step, out=out[done : done + more])
            done += more
            step = step * step
    return out


def _exponential(pole: complex | Complex, duration: Array) -> Complex:
    """exp(pole t), by real functions: numpy's complex one takes twice the time."""
    if not duration.any():
        return np.ones(1, dtype=np.complex128)
    phase = pole.imag * duration
    power = np.empty(phase.shape, dtype=np.complex128)
    np.cos(phase, out=power.real)
    np.sin(phase, out=power.imag)
    if np.any(pole.real):
        power *= np.exp(pole.real * duration)
    return power


def _ramp(pole: complex, duration: Array, power: Complex) -> Complex:
    """What a ramp of the acceleration does, seen from its end: (exp(x) - 1)/x, 1 for a step."""
    x = pole * duration
    step = duration == 0.0
    if step.any():
        x = np.where(step, 1.0, x)
        power = np.where(step, 2.0, power)
    factor: Complex = (power - 1.0) / x
    return factor


def polyline_response(times: ArrayLike, positions: ArrayLike, poles: Complex) -> Complex:
    r"""Response of modes to a motion in straight pieces, as a controller plays samples.

    Parameters
    ----------
    times : array_like, shape (k,)
        Moments of the corners; the motion rests before the first and after the last. [s]
    positions : array_like, shape (k, ...)
        Positions at these moments. [mm]
    poles : ndarray of complex, shape (m,)
        From `mode_poles`. [rad/s]

    Returns
    -------
    ndarray of complex, shape (..., m)
        Sum of the velocity steps, each times exp(lambda (T - t)); exact. [mm/s]
    """
    t, q = np.asarray(times, dtype=float), np.asarray(positions, dtype=float)
    flat = q.reshape(len(t), -1)
    velocity = np.diff(flat, axis=0) / np.diff(t)[:, np.newaxis]
    steps = np.diff(velocity, axis=0, prepend=0.0, append=0.0)
    decay = np.exp(poles[np.newaxis, :] * (t[-1] - t)[:, np.newaxis])
    response: Complex = (steps.T @ decay).reshape(*q.shape[1:], len(poles))
    return response
