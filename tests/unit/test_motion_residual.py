"""Residual vibration: printed numbers, closed forms, and modes simulated step by step."""

# ruff: noqa: N806  (J1 to J4, A1 and A2 are the paper's own symbols)

import itertools

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import brentq

from gcodejerk.errors import PlanError
from gcodejerk.motion import (
    Grid,
    SymmetricProfiles,
    knots_response,
    mode_poles,
    polyline_response,
    profiles_response,
    residual_acceleration,
    residual_displacement,
    sample_profiles,
    sampled_response,
)

# The worked example of Sato and Shirase: 1 mm in 40 ms, a mode at 30 Hz.
LENGTH, TOTAL, FREQUENCY = 1.0, 0.040, 30.0
OMEGA = 2.0 * np.pi * FREQUENCY
MS = 1e-3


def one(*durations):
    """One profile of given T1, Ta, T2, Tv."""
    return SymmetricProfiles(*(np.array([float(d)]) for d in durations)).general()


def condition3(T1, T=TOTAL, L=LENGTH):
    """Switch times and jerk steps of Condition III, from the table of the three conditions."""
    T2 = T / 2 - T1
    R = T2 / T1
    J1 = 6.0 * L / (T1**2 * T * (2.0 * R + 1.0))
    J2 = J1 / R
    return [0.0, T1, T / 2, T - T1, T], [J1, -J1 - J2, 0.0, J1 + J2, -J1]


def condition1(T1, T=TOTAL, L=LENGTH):
    """The same of Condition I: T1 = T2, T3 = T4."""
    T3 = T / 2 - T1
    A1 = 2.0 * L / (T1 * T)
    A2 = A1 * T1 / T3
    J, K = A1 / T1, A2 / T3
    return [0.0, T1, 2 * T1, 2 * T1 + T3, T], [J, -2 * J, J - K, 2 * K, -K]


def condition2(T1, T=TOTAL, L=LENGTH):
    """The same of Condition II: T1 = T3, T2 = T4."""
    T2 = T / 2 - T1
    R = T2 / T1
    A = L / (T1**2 * (0.5 + R + 0.5 * R**2))
    J, K = A / T1, A / T2
    return [0.0, T1, T1 + T2, 2 * T1 + T2, T], [J, -J - K, K - J, J + K, -K]


def simulate(durations, omega, zeta):
    """Envelope after a unit profile, the mode and its input stepped by a matrix exponential.

    The acceleration is built for a peak of 1 and scaled by the length it then covers.
    """
    T1, Ta, T2, Tv = durations
    half = [(T1, 0.0, 1.0), (Ta, 1.0, 1.0), (T2, 1.0, 0.0)]
    back = [(d, -end, -begin) for d, begin, end in reversed(half)]
    # q, q', position, velocity, acceleration, jerk
    system = np.zeros((6, 6))
    system[0, 1] = system[2, 3] = system[3, 4] = system[4, 5] = 1.0
    system[1, [0, 1, 4]] = -(omega**2), -2.0 * zeta * omega, -1.0
    state = np.zeros(6)
    for duration, begin, end in [*half, (Tv, 0.0, 0.0), *back]:
        if duration > 0.0:
            state[4:] = begin, (end - begin) / duration
            state = expm(system * duration) @ state
    x, v, length = state[:3]
    return np.hypot(x, (v + zeta * omega * x) / (omega * np.sqrt(1.0 - zeta**2))) / length


@pytest.mark.parametrize(
    ("T1", "damping", "printed"),
    [(10, 0.0, 13209.3), (10, 0.02, 12266.9), (1, 0.0, 5696.8), (1, 0.02, 5313.6)],
)
def test_profiles_leave_what_the_method_says(T1, damping, printed):
    A = residual_acceleration(*condition3(T1 * MS), FREQUENCY, damping)
    assert float(A) == pytest.approx(printed, abs=0.05)


@pytest.mark.parametrize(("damping", "printed"), [(0.0, 4898.3), (0.02, 4576.0)])
def test_a_cubic_position_is_the_limit_of_vanishing_T1(damping, printed):
    pole = mode_poles([FREQUENCY], [damping])
    D = residual_displacement(profiles_response(one(0.0, 0.0, TOTAL / 2, 0.0), pole), pole)
    assert float(D[0, 0]) * OMEGA**2 == pytest.approx(printed, abs=0.05)
    A = residual_acceleration(*condition3(1e-7), FREQUENCY, damping)
    assert float(A) == pytest.approx(printed, abs=0.1)


@pytest.mark.parametrize(
    ("condition", "damping", "printed"),
    [
        (condition1, 0.0, 11777.1),
        (condition1, 0.02, 10270.9),
        (condition2, 0.0, 12143.7),
        (condition2, 0.02, 11097.0),
    ],
)
def test_the_other_conditions_leave_what_the_method_says(condition, damping, printed):
    best = min(
        float(residual_acceleration(*condition(T1 * MS), FREQUENCY, damping)) for T1 in range(1, 20)
    )
    assert best == pytest.approx(printed, abs=0.05)


@pytest.mark.parametrize(("T1", "printed"), [(10, 13279), (1, 7382)])
def test_the_worst_within_ten_percent_is_what_the_method_says(T1, printed):
    band = np.linspace(27.0, 33.0, 601)
    worst = residual_acceleration(*condition3(T1 * MS), band, 0.0).max()
    assert float(worst) == pytest.approx(printed, abs=0.5)


@pytest.mark.parametrize(("T1", "printed"), [(10, 13170), (1, 5680)])
def test_streams_sampled_at_a_millisecond_leave_what_the_method_says(T1, printed):
    pole = mode_poles([FREQUENCY], [0.0])
    profile = one(T1 * MS, 0.0, TOTAL / 2 - T1 * MS, 0.0)
    q, _ = sample_profiles(profile, np.arange(41)[np.newaxis], MS)
    A = OMEGA**2 * residual_displacement(polyline_response(np.arange(41) * MS, q[0], pole), pole)
    assert float(A[0]) == pytest.approx(printed, rel=1e-3)


@pytest.mark.parametrize(
    ("total", "printed"),
    [(50, (2.287,)), (60, (11.349,)), (66.67, (16.667,)), (90, (29.802, 7.777))],
)
def test_the_closed_form_of_the_nulls_is_a_null(total, printed):
    T = total * MS if total != 66.67 else 2.0 / FREQUENCY
    target = np.sinc(FREQUENCY * T)  # numpy's sinc has pi in it: omega T/2 = pi f T
    grid = np.linspace(1e-6, T / 2 - 1e-6, 2000)
    gap = np.sinc(2.0 * FREQUENCY * (T / 2 - grid)) - target
    roots = [
        brentq(lambda T1: np.sinc(2.0 * FREQUENCY * (T / 2 - T1)) - target, a, b)
        for a, b, x, y in zip(grid, grid[1:], gap, gap[1:], strict=False)
        if x * y < 0.0
    ]
    for T1 in printed:
        root = min(roots, key=lambda r, T1=T1: abs(r - T1 * MS))
        assert root == pytest.approx(T1 * MS, abs=5e-7)
        still = float(residual_acceleration(*condition3(root, T), FREQUENCY, 0.0))
        assert still < 1e-6 * float(residual_acceleration(*condition3(T / 4, 0.04), FREQUENCY, 0.0))


def test_no_null_exists_in_a_shorter_time_than_the_method_says():
    least = 2.0 * 4.493409 / OMEGA
    assert least == pytest.approx(1.4303 / FREQUENCY, rel=1e-4)
    for T, exists in ((0.999 * least, False), (1.001 * least, True)):
        T1 = np.linspace(1e-6, T / 2 - 1e-6, 4000)
        gap = np.sinc(2.0 * FREQUENCY * (T / 2 - T1)) - np.sinc(FREQUENCY * T)
        assert ((gap > 0).any() and (gap < 0).any()) == exists


def test_equation_28_is_the_undamped_case():
    for T1 in (0.5, 1.0, 3.7, 10.0, 17.3):
        (times, steps), T2 = condition3(T1 * MS), TOTAL / 2 - T1 * MS
        R, J1 = T2 / (T1 * MS), steps[0]
        printed = 2 * J1 / OMEGA * abs((1 + 1 / R) * np.sin(OMEGA * T2) - np.sin(OMEGA * TOTAL / 2))
        A = residual_acceleration(times, steps, FREQUENCY, 0.0)
        assert float(A) == pytest.approx(printed, rel=1e-9)


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.3])
@pytest.mark.parametrize(
    "durations",
    [
        (0.0013, 0.0, 0.0171, 0.0),
        (0.0031, 0.0057, 0.0113, 0.0211),
        (0.0, 0.0173, 0.0, 0.0),
        (0.0, 0.0173, 0.0, 0.0091),
        (0.0, 0.0, 0.0237, 0.0019),
        (0.0119, 0.0023, 0.0, 0.0),
    ],
)
def test_the_response_to_a_profile_is_what_a_differential_equation_solver_finds(durations, damping):
    f = 41.3
    omega = 2.0 * np.pi * f
    T1, Ta, T2, Tv = durations
    ends = np.cumsum([0.0, T1, Ta, T2, Tv, T2, Ta, T1])
    levels = [(0, 1), (1, 1), (1, 0), (0, 0), (0, -1), (-1, -1), (-1, 0)]
    state = [0.0, 0.0, 0.0, 0.0]
    for (begin, end), (low, high) in zip(itertools.pairwise(ends), levels, strict=True):
        if end <= begin:
            continue

        def rates(t, y, begin=begin, end=end, low=low, high=high):
            a = low + (high - low) * (t - begin) / (end - begin)
            return [y[1], -(omega**2) * y[0] - 2 * damping * omega * y[1] - a, y[3], a]

        step = (end - begin) / 20
        state = solve_ivp(rates, (begin, end), state, rtol=1e-10, atol=1e-16, max_step=step).y[
            :, -1
        ]
    x, v, length, _ = state
    expected = np.hypot(x, (v + damping * omega * x) / (omega * np.sqrt(1 - damping**2))) / length
    pole = mode_poles([f], [damping])
    D = residual_displacement(profiles_response(one(*durations), pole), pole)
    assert float(D[0, 0]) == pytest.approx(expected, rel=1e-6)
    assert simulate(durations, omega, damping) == pytest.approx(expected, rel=1e-6)


def test_the_response_has_a_row_a_profile_and_a_column_a_mode():
    symmetric = SymmetricProfiles(*np.array([[1.0, 3, 0], [0, 5, 9], [9, 2, 0], [0, 7, 4]]) * MS)
    profiles = symmetric.general()
    poles = mode_poles([17.0, 61.0], [0.01, 0.0])
    together = residual_displacement(profiles_response(profiles, poles), poles)
    assert together.shape == (3, 2)
    for i, m in itertools.product(range(3), range(2)):
        durations = [float(c[i]) for c in symmetric.columns()]
        alone = simulate(durations, abs(poles[m]), -poles[m].real / abs(poles[m]))
        assert together[i, m] == pytest.approx(alone, rel=1e-9)


def test_three_ways_to_a_sampled_residual_agree():
    rng = np.random.default_rng(11)
    poles = mode_poles([13.7, 47.9, 211.0], [0.0, 0.03, 0.11])
    counts = np.array([5, 17, 30])
    grid = Grid.every(counts, 1, 0.0013)
    q = np.where(grid.knots > 0, rng.uniform(0, 1, grid.knots.shape), 0.0)
    by_samples = sampled_response(q, grid.interval, poles)
    np.testing.assert_allclose(by_samples, knots_response(q, grid, poles), rtol=1e-11)
    for row, count in enumerate(counts):
        t, own = np.arange(count + 1) * 0.0013, q[row, -count - 1 :]
        np.testing.assert_allclose(by_samples[row], polyline_response(t, own, poles), rtol=1e-11)


@pytest.mark.parametrize("stride", [2, 3, 7])
def test_a_residual_at_knots_is_that_of_the_same_corners(stride):
    rng = np.random.default_rng(stride)
    poles = mode_poles([13.7, 47.9], [0.0, 0.03])
    grid = Grid.every(np.array([1, 8, 29, 40]), stride, 0.0007)
    q = np.where(grid.knots > 0, rng.uniform(0, 1, grid.knots.shape), 0.0)
    response = knots_response(q, grid, poles)
    for row, blocks in enumerate(grid.blocks):
        t = grid.knots[row, -blocks - 1 :] * grid.interval
        own = polyline_response(t, q[row, -blocks - 1 :], poles)
        np.testing.assert_allclose(response[row], own, rtol=1e-11)


def test_a_polyline_response_keeps_the_shape_of_its_positions():
    rng = np.random.default_rng(3)
    t, q = np.array([0.0, 0.011, 0.013, 0.029]), rng.uniform(0, 1, (4, 2, 5))
    poles = mode_poles([31.0, 7.0, 80.0], [0.0, 0.1, 0.02])
    response = polyline_response(t, q, poles)
    assert response.shape == (2, 5, 3)
    np.testing.assert_allclose(response[1, 3], polyline_response(t, q[:, 1, 3], poles))


def test_one_step_of_velocity_rings_with_the_time_left():
    # 3 mm in 20 ms, then rest: steps of +150 and -150 mm/s.
    pole = mode_poles([25.0], [0.04])
    expected = 150.0 * (np.exp(pole[0] * 0.020) - 1.0)
    np.testing.assert_allclose(polyline_response([0.0, 0.02], [0.0, 3.0], pole), [expected])


def test_poles_have_the_frequency_and_damping_they_were_made_of():
    poles = mode_poles([3.0, 77.0], [0.0, 0.6])
    np.testing.assert_allclose(np.abs(poles), 2 * np.pi * np.array([3.0, 77.0]))
    np.testing.assert_allclose(-poles.real / np.abs(poles), [0.0, 0.6], atol=1e-15)
    assert (poles.imag > 0).all()


@pytest.mark.parametrize("damping", [-0.01, 1.0, 2.0, np.nan])
def test_a_mode_that_does_not_vibrate_is_refused_with_its_damping(damping):
    with pytest.raises(PlanError, match=r"damping ratio is .*outside 0 <= damping < 1"):
        mode_poles(30.0, damping)


@pytest.mark.parametrize("frequency", [0.0, -5.0, np.inf, np.nan])
def test_a_frequency_that_is_none_is_refused(frequency):
    with pytest.raises(PlanError, match=r"frequency is .*above zero"):
        residual_acceleration([0.0, 1.0], [1.0, -1.0], frequency, 0.0)


def test_evenly_spaced_modes_are_as_right_as_modes_by_themselves():
    """They are computed as products; here one mode after the other, and so alone."""
    band = np.linspace(0.8, 1.2, 401)
    own = mode_poles([3.0, 70.0], [0.3, 0.001])
    poles = np.concatenate([own[0] * band, own[1] * band[:7], [1j, 2j, 4j, -50.0 + 900.0j]])
    durations = (np.array([x]) for x in (0.02, 0.013, 0.08, 3.0))
    profile = SymmetricProfiles(*durations).general()
    together = profiles_response(profile, poles)[0]
    alone = np.concatenate([profiles_response(profile, poles[k : k + 1])[0] for k in range(412)])
    assert len(poles) == 412
    # Steps that nearly cancel: what is left is small beside each of them.
    scale = np.abs(profile.jerk).max() / np.abs(poles) ** 2
    np.testing.assert_allclose(np.abs(together - alone) / scale, 0.0, atol=1e-12)
    assert np.abs(alone / scale).max() > 1e-3


def test_what_a_profile_does_is_the_same_to_the_bit_whatever_stands_beside_it():
    rng = np.random.default_rng(8)
    columns = rng.uniform(0.001, 0.1, (4, 3000))
    poles = mode_poles(np.concatenate([30.0 * np.linspace(0.9, 1.1, 21), [50.0, 51.0, 80.0]]), 0.02)
    together = profiles_response(SymmetricProfiles(*columns).general(), poles)
    for some in (slice(0, 1), slice(7, 8), slice(100, 140)):
        alone = profiles_response(SymmetricProfiles(*columns[:, some]).general(), poles)
        np.testing.assert_array_equal(alone, together[some])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("behind", [[], [5.0]])
def test_a_mode_that_dies_soon_costs_the_next_nothing(behind):
    """From one to the next, exponentials as products would be nothing times infinity."""
    frequency = np.array([100.0, 30.0, 20.0, 10.0, *behind])
    poles = mode_poles(frequency, np.where(frequency > 50.0, 0.5, 0.0))
    decaying = np.array([-900.0, -600.0, -300.0, 0.0]) + 200.0j
    poles = np.concatenate([poles, decaying])
    profile = one(0.02, 3.0, 0.02, 2.0)
    alone = np.array([profiles_response(profile, pole[np.newaxis])[0, 0] for pole in poles])
    together = profiles_response(profile, poles)[0]
    scale = np.abs(profile.jerk).max() / np.abs(poles) ** 2
    np.testing.assert_allclose(np.abs(together - alone) / scale, 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("times", "steps", "said"),
    [
        ([], [], "shape"),
        ([0.0, 0.01, 0.02], [1.0, -1.0], "shape"),
        ([[0.0, 0.01]], [[1.0, -1.0]], "shape"),
        ([0.0, np.nan], [1.0, -1.0], "not finite"),
        ([0.0, 0.01], [1.0, np.inf], "not finite"),
        ([0.02, 0.0], [1.0, -1.0], "the last time is 0 s, and 0.02 s"),
    ],
)
def test_times_and_steps_of_no_move_are_refused(times, steps, said):
    with pytest.raises(PlanError, match=said):
        residual_acceleration(times, steps, 30.0, 0.0)
