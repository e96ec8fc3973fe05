"""A law of motion as a control runs it: stepped in time, with nothing of the package in it."""

import numpy as np
from scipy.linalg import expm


def left_by(acceleration, dt, frequency, damping):
    """What a mode keeps of an acceleration held for dt each: |response|, as `motion.residual`."""
    omega = 2 * np.pi * frequency
    A = np.array([[0.0, 1.0, 0.0], [-(omega**2), -2 * damping * omega, -1.0], [0.0, 0.0, 0.0]])
    step = expm(A * dt)
    drive, step = step[:2, 2], step[:2, :2]
    q, v = 0.0, 0.0
    (s00, s01), (s10, s11) = step.tolist()
    for a in acceleration.tolist():
        q, v = s00 * q + s01 * v + drive[0] * a, s10 * q + s11 * v + drive[1] * a
    pole = complex(-damping * omega, omega * np.sqrt(1 - damping**2))
    return abs(v - pole.conjugate() * q)


def averaged(acceleration, time, dt):
    """Behind a moving average of a whole number of steps."""
    count = round(time / dt)
    return np.convolve(acceleration, np.full(count, 1.0 / count))


def delayed(acceleration, delays, amplitudes, dt):
    """Behind a shaper whose delays are whole numbers of steps."""
    kernel = np.zeros(round(delays[-1] / dt) + 1)
    for delay, amplitude in zip(delays, amplitudes, strict=True):
        kernel[round(delay / dt)] += amplitude
    return np.convolve(acceleration, kernel)


def moved(acceleration, dt):
    """Speed and way at the end."""
    speed = np.cumsum(acceleration) * dt
    return speed[-1], np.sum(speed - 0.5 * acceleration * dt) * dt


def samples(profile, dt):
    """Acceleration of one profile in the middle of every step."""
    t = np.arange(dt / 2, float(profile.total[0]), dt)
    at = np.searchsorted(profile.begin, t, side="right") - 1
    return profile.acceleration[at] + profile.jerk[at] * (t - profile.begin[at])
