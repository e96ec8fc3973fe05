"""Drawn machines and their moves; what a motion leaves in their modes, and what today's rapid does.

Nothing here is ours: an oscillator follows a motion by its matrix exponential (scipy), piece by
piece, be it a staircase of velocity or cubics between rows, and today's rapid segment by segment of
constant jerk. What counts is the largest displacement that any mode keeps, wherever its frequency
is within the band.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, inf, isinf, pi, sqrt

import numpy as np
import yaml
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import expm

CALM = settings(
    deadline=None,
    max_examples=3,
    phases=(Phase.explicit, Phase.reuse, Phase.generate),
    suppress_health_check=list(HealthCheck),
)
BAND = 0.1


@st.composite
def cases(draw):
    """A machine as text, its numbers, and moves of one to three axes."""
    letters = "XYZ"[: draw(st.integers(1, 3))]
    dt = draw(st.sampled_from([0.0005, 0.001, 0.002]))
    between = lambda low, high: float(f"{low * (high / low) ** draw(st.floats(0, 1)):.4g}")  # noqa: E731
    axes, modes = {}, []
    jerk_limited = draw(st.booleans())
    positioning = draw(st.sampled_from(["linear", "independent"]))
    lines = [f"interval: {dt}", f"positioning: {positioning}"]
    if positioning == "linear" and draw(st.booleans()):
        V, A = between(200, 800), between(500, 10000)
        lines.append(f"path: {{rapid: {{velocity: {V}, acceleration: {A}}}}}")
    lines.append("axes:")
    for letter in letters:
        V, A = between(50, 800), between(500, 10000)
        J = A / between(0.004, 0.05)
        own = f", jerk: {J:.6e}" if jerk_limited else ""
        step = draw(st.sampled_from([1e-4, 1e-3]))
        axes[letter] = V, A, J if jerk_limited else inf, step
        limit = J * draw(st.floats(1.0, 20.0))
        lines += [f"  {letter}:", f"    resolution: {step}"]
        lines += [f"    rapid: {{velocity: {V}, acceleration: {A}{own}}}"]
        lines += [f"    limit: {{acceleration: {1.2 * A}, jerk: {limit:.6e}}}", "    modes:"]
        for _ in range(draw(st.integers(1, 2))):
            f, zeta = (
                between(8, min(250, 0.45 / dt)),
                draw(st.sampled_from([0.0, 0.005, 0.02, 0.1])),
            )
            p = between(0.1, 1.0)
            modes.append((f, zeta, {letter: p}))
            lines += [f"      - {{frequency: {f}, damping: {zeta}, participation: {p}}}"]
    if len(letters) > 1:
        f, zeta = between(8, min(250, 0.45 / dt)), draw(st.sampled_from([0.0, 0.02, 0.1]))
        share = {letter: draw(st.sampled_from([-1.0, 0.5, 1.0])) for letter in letters[:2]}
        modes.append((f, zeta, share))
        said = ", ".join(f"{a}: {p}" for a, p in share.items())
        lines += ["modes:", f"  - {{frequency: {f}, damping: {zeta}, participation: {{{said}}}}}"]
    lines += ["design:", f"  band: {BAND}", "  minimum_length: 0.05"]
    zero = ", ".join(f"{letter}: 0" for letter in letters)
    lines += ["program:", f"  start: {{{zero}}}", "  decimal_point: calculator", "spindle: mill"]
    at, moves = dict.fromkeys(letters, 0.0), []
    for _ in range(3):
        named = draw(st.lists(st.sampled_from(letters), min_size=1, unique=True))
        # Longer ones take long to integrate, and say no more.
        longest = {a: min(500.0, axes[a][0]) for a in named}
        to = {a: at[a] + draw(st.sampled_from([-1, 1])) * between(0.05, longest[a]) for a in named}
        to = {a: round(x, 3) for a, x in to.items()}
        if any(to[a] != at[a] for a in named):
            moves.append(({a: to[a] - at[a] for a in named}, to, dict(at)))
        at |= to
    return "\n".join(lines) + "\n", axes, modes, dt, moves


def known():
    """A case of which at most one rapid is left alone, whatever the controller and the profile."""
    axes = {"X": (400.0, 4000.0, 2e5, 1e-4), "Y": (300.0, 3000.0, 1e5, 1e-4)}
    modes = [(31.0, 0.01, {"X": 0.6}), (42.0, 0.02, {"Y": 0.8})]
    lines = ["interval: 0.001", "positioning: linear", "axes:"]
    for (letter, (V, A, J, step)), (f, zeta, share) in zip(axes.items(), modes, strict=True):
        lines += [f"  {letter}:", f"    resolution: {step}"]
        lines += [f"    rapid: {{velocity: {V}, acceleration: {A}, jerk: {J:.6e}}}"]
        lines += [f"    limit: {{jerk: {20 * J:.6e}}}", "    modes:"]
        lines += [f"      - {{frequency: {f}, damping: {zeta}, participation: {share[letter]}}}"]
    lines += ["design:", f"  band: {BAND}", "  minimum_length: 0.05"]
    lines += ["program:", "  start: {X: 0, Y: 0}", "  decimal_point: calculator", "spindle: mill"]
    at, moves = {"X": 0.0, "Y": 0.0}, []
    for to in ({"X": 180.0}, {"Y": -90.0}, {"X": 20.0, "Y": 30.0}):
        moves.append(({a: x - at[a] for a, x in to.items()}, to, dict(at)))
        at |= to
    return "\n".join(lines) + "\n", axes, modes, 0.001, moves


KNOWN = known()


@dataclass
class Staircase:
    """A motion of constant velocities, one after the other."""

    t: NDArray[np.float64]
    """How long each holds, shape (k,) [s]."""
    v: NDArray[np.float64]
    """Shape (k, axes) [mm/s]."""

    @property
    def total(self):
        return self.t.sum()

    @property
    def displacement(self):
        return self.t @ self.v

    def kept(self, p, f, zeta):
        """Envelope that oscillators keep of a staircase: each step of velocity is an impulse."""
        omega = 2.0 * pi * f
        system = np.zeros((len(f), 2, 2))
        system[:, 0, 1], system[:, 1, 0], system[:, 1, 1] = 1.0, -(omega**2), -2.0 * zeta * omega
        known = {}
        state = np.zeros((len(f), 2))
        before = 0.0
        for duration, velocity in zip(self.t, self.v @ p, strict=True):
            state[:, 1] -= velocity - before
            before = velocity
            key = round(duration, 9)
            if key not in known:
                known[key] = expm(system * key)
            state = (known[key] @ state[:, :, np.newaxis])[:, :, 0]
        state[:, 1] += before
        return envelope(state, omega, zeta)


@dataclass
class Rows:
    """A motion of cubics between rows of position and velocity."""

    t: NDArray[np.float64]
    """Of the rows, shape (k,) [s]."""
    q: NDArray[np.float64]
    """Shape (k, axes) [mm]."""
    v: NDArray[np.float64]
    """Shape (k, axes) [mm/s]."""

    @property
    def total(self):
        return self.t[-1] - self.t[0]

    @property
    def displacement(self):
        return self.q[-1] - self.q[0]

    def kept(self, p, f, zeta):
        """The same of cubics: acceleration and jerk begin anew with each of them."""
        system = driven(f, zeta)
        state = np.zeros((len(f), 4))
        for h, moved, v0, v1 in zip(
            np.diff(self.t), np.diff(self.q @ p), self.v[:-1] @ p, self.v[1:] @ p, strict=True
        ):
            # moved = v0 h + a h^2/2 + j h^3/6 and v1 - v0 = a h + j h^2/2
            a, j = np.linalg.solve([[h**2 / 2, h**3 / 6], [h, h**2 / 2]], [moved - v0 * h, v1 - v0])
            state[:, 2], state[:, 3] = a, j
            state = (expm(system * h) @ state[:, :, np.newaxis])[:, :, 0]
        return envelope(state, 2.0 * pi * f, zeta)


def driven(f, zeta):
    """Oscillators on what moves by acceleration and jerk: x, its speed, acceleration, jerk."""
    omega = 2.0 * pi * f
    system = np.zeros((len(f), 4, 4))
    system[:, 0, 1], system[:, 1, 0], system[:, 1, 1] = 1.0, -(omega**2), -2.0 * zeta * omega
    system[:, 1, 2], system[:, 2, 3] = -1.0, 1.0
    return system


def envelope(state, omega, zeta):
    damped = omega * sqrt(1.0 - zeta**2)
    return np.hypot(state[:, 0], (state[:, 1] + zeta * omega * state[:, 0]) / damped)


def todays(V, A, J):
    """The fastest symmetric rapid over a way of 1, as accelerations, jerks and durations."""
    if isinf(J):
        high = min(V, sqrt(A))
        ramp, cruise = high / A, 1.0 / high - high / A
        return [(A, 0.0, ramp), (0.0, 0.0, cruise), (-A, 0.0, ramp)]
    low, high = 0.0, V
    for _ in range(100):
        v = 0.5 * (low + high)
        ramp = v / A + A / J if v * J >= A * A else 2.0 * sqrt(v / J)
        low, high = (v, high) if v * ramp <= 1.0 else (low, v)
    rise = min(A / J, sqrt(high / J))
    flat = max(high / (J * rise) - rise, 0.0)
    cruise = max(1.0 / high - 2.0 * rise - flat, 0.0)
    most = J * rise
    ramp = [(0.0, J, rise), (most, 0.0, flat), (most, -J, rise)]
    return [*ramp, (0.0, 0.0, cruise), *((-a, -j, duration) for a, j, duration in ramp)]


def todays_rapids(case, k):
    """What the axes do today in one of the moves, as (their displacements, `todays`).

    All along one line, or each on its own.
    """
    text, axes, _, _, moves = case
    machine = yaml.safe_load(text)
    bounds = machine.get("path", {"rapid": {"velocity": inf, "acceleration": inf}})["rapid"]
    displacement = {a: d for a, d in moves[k][0].items() if d}

    def along(moved):
        size = np.array([*np.abs(list(moved.values())), np.linalg.norm(list(moved.values()))])
        path = (bounds["velocity"], bounds["acceleration"], inf)
        limits = np.array([*(axes[a][:3] for a in moved), path])
        return moved, todays(*(limits.T / size).min(axis=1))

    if machine["positioning"] == "independent":
        return [along({a: d}) for a, d in displacement.items()]
    return [along(displacement)]


def kept_today(rapids, share, f, zeta):
    """What oscillators keep of today's rapids when the last of them has arrived."""
    system = driven(f, zeta)
    last = max(sum(duration for *_, duration in segments) for _, segments in rapids)
    together = np.zeros((len(f), 4))
    for moved, segments in rapids:
        amount = sum(share.get(a, 0.0) * d for a, d in moved.items())
        state = np.zeros((len(f), 4))
        rest = last - sum(duration for *_, duration in segments)
        for acceleration, jerk, duration in [*segments, (0.0, 0.0, rest)]:
            state[:, 2], state[:, 3] = acceleration * amount, jerk * amount
            state = (expm(system * duration) @ state[:, :, np.newaxis])[:, :, 0]
        together += state
    return envelope(together, 2.0 * pi * f, zeta)


def frequencies(f, total):
    """The band, dense enough for a motion of this duration."""
    return f * np.linspace(1.0 - BAND, 1.0 + BAND, 2 * ceil(max(10, 6 * BAND * f * total)) + 1)


def hold_to_today(case, result, motions, slack, reported=True):
    """What each rewritten rapid leaves against today's, by a share of that and an absolute part.

    And against what the report says of it.
    """
    _, axes, modes, _, moves = case
    for k, motion in motions.items():
        displacement = moves[k][0]
        rapids = todays_rapids(case, k)
        left = today = 0.0
        for m, (f, zeta, share) in enumerate(modes):
            p = np.array([share.get(a, 0.0) for a in axes])
            if not any(displacement.get(a, 0.0) * x for a, x in share.items()):
                continue
            around = frequencies(f, motion.total)
            left = max(left, motion.kept(p, around, zeta).max())
            if reported:
                said = result.residual[k, m]
                own = motion.kept(p, np.array([f]), zeta)[0]
                # Of F, and of what is computed here, times are rounded: by 3e-8 s at most together.
                rounded = 1e-6 + 3e-8 * np.abs(motion.v @ p).max()
                assert abs(own - said) <= 1e-4 * own + rounded, "the report says what is left"
            today = max(today, kept_today(rapids, share, around, zeta).max())
        assert left <= today + slack[0] * today + slack[1], (k, left, today)
