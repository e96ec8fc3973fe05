"""The guarded optimum with a jerk in every interval: cones that clarabel solves, for tests.

It shares nothing with the package: its own rows, its own envelope, its own exchange of frequencies.
"""

import clarabel
import numpy as np
from scipy import sparse

FINE, BEGIN, CLOSE, ENOUGH = 0.1, 0.8, 1e-3, 20


def pieces(profile, low, high):
    """Begin, end, acceleration and jerk of what a profile does in a stretch of time."""
    out = []
    columns = (profile.begin, profile.duration, profile.acceleration, profile.jerk)
    for t, d, a, j in zip(*columns, strict=True):
        begin, end = max(t, low), min(t + d, high)
        if end - begin > 1e-12:
            out.append((begin, end, a + j * (begin - t), j))
    return out


def spectrum(parts, omega):
    """Fourier transform of an acceleration in pieces of constant jerk."""
    z = -1j * omega
    out = np.zeros(len(omega), dtype=complex)
    for begin, end, a, j in parts:
        early, late = np.exp(z * begin), np.exp(z * end)
        out += ((a + j * (end - begin)) * late - a * early) / z - j * (late - early) / z**2
    return out


def envelope(today, omega):
    """The largest sum of the moduli of both halves of today's within 15 % of a frequency."""
    t = np.linspace(0.0, today.total[0], 20001)
    k = np.clip(np.searchsorted(today.begin, t, side="right") - 1, 0, len(today.begin) - 1)
    gained = today.acceleration * today.duration + 0.5 * today.jerk * today.duration**2
    v = np.insert(np.cumsum(gained), 0, 0.0)[k]
    past = t - today.begin[k]
    v = v + today.acceleration[k] * past + 0.5 * today.jerk[k] * past**2
    cut = t[np.argmax(v >= v.max() * (1 - 1e-9))]
    halves = pieces(today, 0.0, cut), pieces(today, cut, today.total[0])

    def largest(frequencies):
        return sum(np.abs(spectrum(half, frequencies)) for half in halves)

    every = np.linspace(0.85 * omega[0], 1.15 * omega[-1], 4000)
    response = largest(every)
    inside = [response[(every >= 0.85 * w) & (every <= 1.15 * w)].max(initial=0.0) for w in omega]
    return np.maximum(inside, np.maximum(largest(0.85 * omega), largest(1.15 * omega)))


def guarded(move):
    """Frequencies that a move's guard holds down, dense."""
    modes = np.abs(move.poles)
    low, high = 1.3 * modes, np.minimum(5.0 * modes, np.pi / 2 / move.interval)
    begin, end = low[high > low].min(), high.max()
    count = int((end - begin) * move.count * move.interval / 2 / FINE) + 50
    omega = np.linspace(begin, end, count)[:, np.newaxis]
    inside = ((omega >= low) & (omega <= high)).any(axis=1)
    known = (np.abs(omega / modes - 1.0) < move.band).any(axis=1)
    return omega[inside & ~known, 0]


def rows_of(move, unit):
    """What a unit jerk in each interval leaves of all modes over their bands, over `unit`.

    And of guarded frequencies, over what they may keep. Time in units of the move's.
    """
    T = move.count * move.interval
    left = np.linspace(1.0, 0.0, move.count + 1)
    modes, source = [], []
    for k, (pole, weight) in enumerate(zip(move.poles, move.weights, strict=True)):
        count = int(move.band * abs(pole) * T / FINE) + 17
        poles = pole * T * np.linspace(1 - move.band, 1 + move.band, count)[:, np.newaxis]
        ringing = -np.diff(np.exp(poles * left), axis=1)
        modes.append(ringing * (weight / unit) / poles**2 / poles.imag)
        source += [k] * count
    omega = guarded(move)
    phase = omega[:, np.newaxis] * T
    keeps = -np.diff(np.exp(-1j * phase * (1.0 - left)), axis=1) / phase**2
    keeps /= (move.guard * T * envelope(move.today, omega))[:, np.newaxis]
    return np.concatenate(modes), np.array(source), keeps


def peaks(left, source):
    """Local maxima among neighbours of the same source."""
    same = np.diff(source) == 0
    out = np.ones(len(left), dtype=bool)
    out[1:] &= ~same | (left[1:] >= left[:-1])
    out[:-1] &= ~same | (left[:-1] >= left[1:])
    return out


def least(move, unit):
    """The least worst residual over `unit` of a move that keeps its guard; None where none does."""
    n, T = move.count, move.count * move.interval
    h, a = 1.0 / n, n - 1
    modes, source, keeps = rows_of(move, unit)
    V, A = move.velocity * T, move.acceleration * T**2
    J = min(move.jerk, move.acceleration / move.interval) * T**3
    none = sparse.csc_matrix
    jerk = sparse.diags([1 / h, -1 / h], [0, -1], shape=(n, a)).tocsc()
    mean = sparse.diags([h / 2, h / 2], [0, -1], shape=(n, a)).tocsc()
    step = sparse.diags([1.0, -1.0], [0, -1], shape=(n, a)).tocsc()
    length = np.concatenate([np.full(a, h**2 / 2), np.full(a, h), [0.0]])
    one, empty, last = sparse.eye(a), none((a, a)), none((a, 1))
    fixed = [
        sparse.hstack([mean, -step, none((n, 1))]), none(length[np.newaxis]),
        *(sparse.hstack([sign * jerk / J, none((n, a + 1))]) for sign in (1, -1)),
        *(sparse.hstack([sign * one / A, empty, last]) for sign in (1, -1)),
        sparse.hstack([empty, one / V, last]), sparse.hstack([empty, -one, last]),
    ]  # fmt: skip
    bounds = [np.zeros(n), [1.0], np.ones(2 * n), np.ones(2 * a), np.ones(a), np.zeros(a)]
    spread = max(int(BEGIN / FINE), 1)
    known = (np.arange(len(modes)) % spread == 0) | (np.diff(source, append=-1) != 0)
    known_keeps = np.arange(len(keeps)) % max(len(keeps) // 30, 1) == 0
    cost = np.append(np.zeros(2 * a), 1.0)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    for _ in range(ENOUGH):
        own = np.concatenate([modes[known], keeps[known_keeps]]) @ jerk.toarray()
        blocks = np.zeros((len(own), 3, 2 * a + 1))
        blocks[:, 1, :a], blocks[:, 2, :a] = own.real, own.imag
        counts = np.arange(len(own)) < known.sum()
        blocks[counts, 0, -1] = -1.0
        most = np.zeros((len(own), 3))
        most[~counts, 0] = 1.0
        cones = [clarabel.ZeroConeT(n + 1), clarabel.NonnegativeConeT(2 * n + 4 * a)]
        cones += [clarabel.SecondOrderConeT(3)] * len(own)
        rows = none(sparse.vstack([*fixed, none(blocks.reshape(-1, 2 * a + 1))]))
        bound = np.concatenate([*bounds, most.ravel()])
        square = none((2 * a + 1, 2 * a + 1))
        found = clarabel.DefaultSolver(square, cost, rows, bound, cones, settings).solve()
        if str(found.status) not in ("Solved", "AlmostSolved"):
            return None
        x = np.array(found.x)
        j = jerk @ x[:a]
        left, kept = np.abs(modes @ j), np.abs(keeps @ j)
        if left.max() <= x[-1] * (1 + CLOSE) + 1e-6 and kept.max() <= 1 + CLOSE:
            return x[-1]
        known |= (left > x[-1] * (1 + CLOSE / 2)) & peaks(left, source)
        known_keeps |= (kept > 1 + CLOSE / 2) & peaks(kept, np.zeros(len(kept)))
    raise AssertionError("frequencies without an end")
