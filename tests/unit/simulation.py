"""A law of motion as a control runs it: stepped in time, with nothing of the package in it."""

import numpy as np
from scipy.linalg import expm

DT = 2e-5
"""Step. [s]"""


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


def steps(duration, value=1.0, dt=DT):
    """A constant for a time."""
    return np.full(max(round(duration / dt), 0), value)


def behind_averages(velocity, *times):
    """Acceleration of a speed held for 1/velocity, behind averages."""
    speed = steps(1.0 / velocity, velocity)
    for time in times:
        speed = averaged(speed, time, DT)
    return np.diff(np.concatenate([[0.0], speed, [0.0]])) / DT


def four_ramps(V, A, D, rise, fall, braking_rise, braking_fall):
    """Acceleration in time: each ramp the least of its three lines, found by its length."""

    def ramp(length, limit, up, down):
        t = np.arange(DT / 2, length, DT)
        return np.minimum(limit, np.minimum(t * limit / up, (length - t) * limit / down))

    def to(speed, limit, up, down):
        least, most = 0.0, 3.0 * (up + down) + speed / limit
        for _ in range(40):
            middle = 0.5 * (least + most)
            if np.sum(ramp(middle, limit, up, down)) * DT > speed:
                most = middle
            else:
                least = middle
        return ramp(most, limit, up, down)

    def both(speed):
        up = to(speed, A, rise, fall)
        down = to(speed, D, braking_fall, braking_rise)
        way = sum(np.sum(np.cumsum(r) * DT) * DT for r in (up, down))
        return up, -down[::-1], way

    least, most = 0.0, V
    if both(V)[2] > 1.0:
        for _ in range(30):
            middle = 0.5 * (least + most)
            least, most = (least, middle) if both(middle)[2] > 1.0 else (middle, most)
    up, down, way = both(most)
    return np.concatenate([up, steps((1.0 - way) / most, 0.0), down])


def two_stages(V, low, high, low_brake, high_brake, change):
    """Speed stepped from both ends until both ways make the whole."""

    def run(below, above):
        v, out = 0.0, []
        while v < V:
            out.append(below if v < change else above)
            v += out[-1] * DT
        return np.array(out)

    up, down = run(low, high), run(low_brake, high_brake)
    speeds = [np.cumsum(r) * DT for r in (up, down)]
    ways = [np.cumsum(v) * DT for v in speeds]
    if ways[0][-1] + ways[1][-1] < 1.0:
        cruise = steps((1.0 - ways[0][-1] - ways[1][-1]) / V, 0.0)
        return np.concatenate([up, cruise, -down[::-1]])
    at = [np.searchsorted(v, speeds[0]) for v in speeds]
    met = np.flatnonzero(ways[0] + ways[1][np.minimum(at[1], len(down) - 1)] >= 1.0)[0]
    return np.concatenate([up[: met + 1], -down[: at[1][met] + 1][::-1]])


def marlin(V, A, overshoot=None):
    """Positions by Marlin's coefficients c3 to c6 of a ramp from rest, then their differences."""
    v = min(V, A**0.5)
    T = v / A
    d1 = 0.5 * v * T
    c3, c4, c5 = 10 * d1 - 4 * v * T, -15 * d1 + 7 * v * T, 6 * d1 - 3 * v * T
    c6 = 0.0
    if overshoot is not None:
        middle = 6 * 0.5 * c3 + 12 * 0.25 * c4 + 20 * 0.125 * c5
        c6 = (overshoot * A * T * T - middle) / (6 * 0.5 - 36 * 0.25 + 60 * 0.125 - 30 * 0.0625)
    u = np.linspace(0.0, 1.0, round(T / DT) + 1)
    s = c3 * u**3 + c4 * u**4 + c5 * u**5 + c6 * u**3 * (1 - u) ** 3
    speed = np.diff(s) / (T / (len(u) - 1))
    up = np.diff(np.concatenate([[0.0], speed, [v]])) / DT
    return np.concatenate([up, steps(1 / v - T, 0.0), -up[::-1]])


def quintic(V, J):
    """Speed 10 u^3 - 15 u^4 + 6 u^5 of ramps as long as g2core reckons: 2.40281 sqrt(dv/J)."""
    v = min(V, (J**0.5 / 2.40281142) ** (2 / 3))
    T = 2 * 1.201405707067378 * (v / J) ** 0.5
    u = np.linspace(0.0, 1.0, round(T / DT) + 1)
    up = np.diff(v * (10 * u**3 - 15 * u**4 + 6 * u**5)) / DT
    return np.concatenate([up, steps(1 / v - T, 0.0), -up[::-1]])
