"""Promises of motion, over drawn profiles, limits and modes."""

import numpy as np
from hypothesis import Phase, assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from gcodejerk.motion import (
    Grid,
    SymmetricProfiles,
    conventional_profiles,
    knots_response,
    mode_poles,
    polyline_response,
    profiles_response,
    residual_acceleration,
    residual_displacement,
    round_positions,
    sample_profiles,
    sampled_response,
)

PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
drawn = settings(deadline=None, phases=PHASES, max_examples=100)

# Odd numbers on purpose: a period of exactly 1 or pi hides errors.
segment = st.floats(0.0007, 0.083)
absent = st.one_of(st.just(0.0), segment)
frequency = st.floats(1.3, 431.0)
damping = st.one_of(st.just(0.0), st.floats(0.0, 0.6))


@st.composite
def durations(draw):
    """T1, Ta, T2, Tv of a profile, trapezoids and cubics included."""
    T1, Ta, T2, Tv = (draw(absent) for _ in range(4))
    assume(T1 + Ta + T2 > 0.0)
    return T1, Ta, T2, Tv


def law_of(times):
    """One profile."""
    return SymmetricProfiles(*(np.array([t]) for t in times)).general()


def phases(times):
    """(duration, acceleration at its begin and at its end), for a peak of 1."""
    T1, Ta, T2, Tv = times
    half = [(T1, 0.0, 1.0), (Ta, 1.0, 1.0), (T2, 1.0, 0.0)]
    return [*half, (Tv, 0.0, 0.0), *((d, -end, -begin) for d, begin, end in reversed(half))]


def simulate(times, omega, zeta):
    """Envelope after a unit profile, by the transition matrices of the mode and its input.

    The matrix of a phase takes the mode's state, position and speed of the axis, and the
    acceleration with its rate from the phase's begin to its end.
    """
    system = np.zeros((6, 6))
    system[0, 1] = system[2, 3] = system[3, 4] = system[4, 5] = 1.0
    system[1, [0, 1, 4]] = -(omega**2), -2.0 * zeta * omega, -1.0
    state = np.zeros(6)
    for duration, begin, end in phases(times):
        if duration > 0.0:
            state[4:] = begin, (end - begin) / duration
            state = expm(system * duration) @ state
    x, v, length = state[:3]
    return np.hypot(x, (v + zeta * omega * x) / (omega * np.sqrt(1.0 - zeta**2))) / length


@given(durations(), frequency, damping)
@drawn
def test_residual_of_a_profile_is_that_of_a_simulated_mode(times, f, zeta):
    omega, pole = 2.0 * np.pi * f, mode_poles([f], [zeta])
    D = float(residual_displacement(profiles_response(law_of(times), pole), pole)[0, 0])
    # Of the size of the static deflection, a/omega^2: what is far below it is rounding.
    scale = float(law_of(times).peak_acceleration[0]) / omega**2
    np.testing.assert_allclose(D, simulate(times, omega, zeta), rtol=1e-6, atol=1e-9 * scale)


@given(segment, absent, segment, absent, frequency, damping)
@drawn
def test_residual_of_a_profile_is_that_of_its_jerk_steps(T1, Ta, T2, Tv, f, zeta):
    profile, pole = law_of((T1, Ta, T2, Tv)), mode_poles([f], [zeta])
    every = [(d, (end - begin) / d) for d, begin, end in phases((T1, Ta, T2, Tv)) if d > 0.0]
    times = np.cumsum([0.0, *(d for d, _ in every)])
    # The cube of the time left, a sixth of it for each step of the jerk, is the length.
    steps = np.diff([j for _, j in every], prepend=0.0, append=0.0)
    steps = steps / ((times[-1] - times) ** 3 @ steps / 6.0)
    A = float(residual_acceleration(times, steps, f, zeta))
    D = float(residual_displacement(profiles_response(profile, pole), pole)[0, 0])
    scale = float(profile.peak_acceleration[0])
    np.testing.assert_allclose(D * (2 * np.pi * f) ** 2, A, rtol=1e-6, atol=1e-8 * scale)


@given(durations(), st.sampled_from([0.0005, 0.001, 0.0037]))
@drawn
def test_samples_go_from_0_to_1_and_their_speed_is_their_slope(times, interval):
    profile = law_of(times)
    count = int(np.ceil(profile.total[0] / interval))
    fine = 16
    q, v = sample_profiles(profile, np.arange(count * fine + 1)[np.newaxis], interval / fine)
    assert q[0, 0] == 0.0
    assert q[0, -1] == 1.0
    assert np.diff(q[0]).min() >= -1e-14
    # Within a step the speed changes by no more than the acceleration allows.
    slope = np.diff(q[0]) / (interval / fine)
    mean = 0.5 * (v[0, 1:] + v[0, :-1])
    steps = float(profile.peak_acceleration[0]) * interval / fine
    assert np.abs(slope - mean).max() <= steps * (1 + 1e-9) + 1e-9
    assert v.max() <= float(profile.peak_velocity[0]) * (1 + 1e-12)


@given(
    st.floats(0.1, 1e3), st.floats(1.0, 1e5), st.one_of(st.just(np.inf), st.floats(10.0, 1e8)),
    st.floats(1.01, 30.0),
)  # fmt: skip
@drawn
def test_conventional_profiles_scale_with_the_length(V, A, J, factor):
    """A longer move has smaller limits of its unit profile, takes longer, keeps the real ones."""
    short = conventional_profiles([V], [A], [J])
    long = conventional_profiles([V / factor], [A / factor], [J / factor])
    assert float(long.total[0]) >= float(short.total[0]) * (1 - 1e-12)
    for profile, scale in ((short, 1.0), (long, factor)):
        assert float(profile.velocity[0]) * scale <= V * (1 + 1e-9)
        assert float(profile.acceleration[0]) * scale <= A * (1 + 1e-9)
        assert float(profile.jerk[0]) * scale <= J * (1 + 1e-9) or np.isinf(J)
    # In a time unit of its own every profile is the same profile: all three limits scale by powers
    # of it.
    slow = conventional_profiles([V / 3.0], [A / 9.0], [J / 27.0])
    np.testing.assert_allclose(slow.total, 3.0 * short.total, rtol=1e-9)


@given(
    st.lists(st.integers(1, 90), min_size=1, max_size=6), st.integers(1, 5),
    st.integers(0, 2**32 - 1), st.lists(st.tuples(frequency, damping), min_size=1, max_size=3),
)  # fmt: skip
@drawn
def test_three_ways_to_a_sampled_residual_agree(counts, stride, seed, modes):
    interval = 0.00113
    poles = mode_poles(*zip(*modes, strict=True))
    grid = Grid.every(np.array(counts), stride, interval)
    q = np.random.default_rng(seed).uniform(0, 1, grid.knots.shape)
    q = np.where(grid.knots > 0, q, 0.0)
    response = knots_response(q, grid, poles)
    for row, blocks in enumerate(grid.blocks):
        knots, own = grid.knots[row, -blocks - 1 :], q[row, -blocks - 1 :]
        scale = np.abs(response[row]).max() + 1.0 / interval
        corners = polyline_response(knots * interval, own, poles)
        np.testing.assert_allclose(response[row], corners, rtol=1e-9, atol=1e-10 * scale)
        every = np.interp(np.arange(counts[row] + 1), knots, own)[np.newaxis]
        samples = sampled_response(every, interval, poles)[0]
        np.testing.assert_allclose(response[row], samples, rtol=1e-9, atol=1e-10 * scale)


@given(
    durations(), st.floats(-300.0, 300.0), st.floats(-50.0, 50.0),
    st.sampled_from([1e-4, 1e-3, 0.0025, 0.01]), st.integers(1, 3),
    st.lists(st.tuples(st.floats(1.3, 200.0), damping), max_size=3),
)  # fmt: skip
@drawn
def test_rounded_moves_stay_between_their_ends_and_within_a_step(
    times, length, start, step, stride, modes
):
    assume(abs(length) > 8 * step)
    profile, interval = law_of(times), 0.001
    count = int(np.ceil(profile.total[0] / interval))
    grid = Grid.every(np.array([count]), stride, interval)
    poles = mode_poles([f for f, _ in modes], [z for _, z in modes])
    exact = start + length * sample_profiles(profile, grid.knots, interval)[0]
    whole = round_positions(exact, grid, np.array([step]), np.zeros(1), poles, np.ones(len(modes)))
    written = whole * step
    inner = (grid.knots > 0) & (grid.knots < count)
    written = np.where(inner, written, exact)
    assert np.abs(written - exact).max() <= step * (1 + 1e-5)
    assert (np.diff(written[0, -grid.blocks[0] - 1 :]) * np.sign(length)).min() >= -2e-6 * step
