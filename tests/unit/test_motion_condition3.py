"""The design of Condition III against dense scans and a global optimiser that know no map."""

import inspect

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from gcodejerk.motion import (
    Objective,
    SymmetricProfiles,
    conventional_profiles,
    design_condition3,
    design_four_segments,
    four_segment_range,
    mode_poles,
    residual_acceleration,
    symmetric_response,
)
from gcodejerk.motion.search.condition3 import TIE

INTERVAL = 0.001
RNG = "rng" if "rng" in inspect.signature(differential_evolution).parameters else "seed"
"""What scipy calls its seed, before 1.15 and since."""
NOWHERE = 1e3
"""Cost of a profile that is not legal, in the search by scipy."""


def column(*values):
    """Values as one column, as the planner gives them."""
    return np.array(values, dtype=float)


def columns(*values):
    """One row of each."""
    return tuple(np.array([float(v)]) for v in values)


def four_segment_peaks(T1, T):
    """Velocity, acceleration and larger jerk of the paper's table, row III, length 1."""
    T2 = T / 2 - T1
    R = T2 / T1
    J1 = 6.0 / (T1**2 * T * (2 * R + 1))  # noqa: N806
    return J1 * T1 * (T1 + T2) / 2, J1 * T1, J1 * max(1.0, 1.0 / R)


def displacement(T1, Ta, T2, Tv, poles, weights):
    """Largest residual of unit profiles, and their peak acceleration, by sums over jerk steps."""
    ends = np.cumsum(np.broadcast_arrays(np.zeros_like(T1), T1, Ta, T2, Tv, T2, Ta, T1), axis=0)
    left = ends[-1] - ends
    rise, fall = 1.0 / T1, 1.0 / T2
    steps = np.stack([rise, -rise, -fall, fall, -fall, fall, rise, -rise])
    A = 6.0 / (steps * left**3).sum(axis=0)
    worst = np.zeros_like(A)
    for pole, weight in zip(poles, weights, strict=True):
        ringing = A * (steps * np.exp(pole * left)).sum(axis=0)
        worst = np.maximum(worst, weight * np.abs(ringing) / pole.imag / np.abs(pole) ** 2)
    return worst, A


def test_the_second_way_to_a_residual_is_right_itself():
    T1, Ta, T2, Tv = 0.0031, 0.0057, 0.0113, 0.0211
    profile = SymmetricProfiles(*columns(T1, Ta, T2, Tv))
    poles = mode_poles([30.0, 71.0], [0.02, 0.0])
    weights = np.array([1.0, 0.3])
    worst, A = displacement(*columns(T1, Ta, T2, Tv), poles, weights)
    by_profile = (np.abs(symmetric_response(profile, poles)) / poles.imag * weights).max()
    assert float(worst[0]) == pytest.approx(by_profile, rel=1e-9)
    assert float(A[0]) == pytest.approx(float(profile.acceleration[0]), rel=1e-12)


def test_the_interval_or_the_jerk_is_the_least_T1():
    assert float(four_segment_range(*columns(0.04, 600, 5000, 5e6), 1e-3)[0][0]) == 1e-3
    low = float(four_segment_range(*columns(0.04, 600, 5000, 2e6), 1e-3)[0][0])
    assert four_segment_peaks(low, 0.04)[2] == pytest.approx(2e6, rel=1e-6)


def test_each_end_of_the_range_is_where_one_limit_binds():
    rng = np.random.default_rng(7)
    n = 4000
    T = 10 ** rng.uniform(-2, 0, n)
    V = 10 ** rng.uniform(0.0, 0.6, n) * 1.5 / T
    A = 10 ** rng.uniform(0.0, 1.0, n) * 6.0 / T**2
    J = 10 ** rng.uniform(0.0, 3.0, n) * 20.0 / T**3
    low, high = four_segment_range(T, V, A, J, INTERVAL)

    def bound(T1, i):
        """How far a profile is beyond each of its limits: below 1 it keeps them all."""
        v, a, j = four_segment_peaks(T1, T[i])
        dt = INTERVAL / T1, INTERVAL / (T[i] / 2 - T1)
        return {"V": v / V[i], "A": a / A[i], "J": j / J[i], "T1": dt[0], "T2": dt[1]}

    met = set()
    for i in range(n):
        if low[i] > high[i]:
            middle = np.linspace(1e-6, 1 - 1e-6, 400) * T[i] / 2
            assert not any(max(bound(T1, i).values()) < 1 - 1e-6 for T1 in middle)
            continue
        for end, outwards in ((low[i], -1), (high[i], 1)):
            at = bound(end, i)
            assert max(at.values()) == pytest.approx(1.0, rel=1e-6)
            met.add((outwards, max(at, key=at.get)))
            beyond = end + outwards * 1e-5 * T[i]
            if 0 < beyond < T[i] / 2:
                assert max(bound(beyond, i).values()) > 1.0
        if high[i] - low[i] > 1e-6:
            for share in (0.001, 0.5, 0.999):
                assert max(bound(low[i] + share * (high[i] - low[i]), i).values()) < 1 + 1e-7
    assert {(-1, "T1"), (-1, "J"), (1, "V"), (1, "A"), (1, "J")} <= met
    assert (low > high).any()


def test_a_range_of_a_single_profile_survives_rounding():
    # At the conventional limits and time there is one profile, T1 = T_SUM/4.
    J = 5e5
    T = 4.0 * np.cbrt(0.5 / J)
    low, high = four_segment_range(*columns(T, 1e9, 2.0 / np.cbrt(0.5 / J) ** 2 / 4, J), 1e-3)
    assert float(low[0]) <= float(high[0])
    assert float(low[0]) == pytest.approx(T / 4, rel=1e-4)


@pytest.mark.parametrize(
    ("total", "nulls"), [(0.05, [2.287]), (0.06, [11.349]), (0.09, [29.802, 7.777])]
)
def test_the_design_finds_the_nulls_of_the_map(total, nulls):
    pole = mode_poles([30.0], [0.0])
    profiles, worst = design_four_segments(
        *columns(total, INTERVAL, total / 2 - INTERVAL), Objective.of_modes(pole, np.ones((1, 1)))
    )
    assert float(worst[0]) < TIE
    assert any(float(profiles.T1[0]) == pytest.approx(null * 1e-3, abs=1e-6) for null in nulls)
    assert float(profiles.total[0]) == pytest.approx(total)


def test_the_design_of_the_paper_s_case_is_the_least_T1():
    pole = mode_poles([30.0], [0.0])
    low, high = four_segment_range(*columns(0.04, 600, 5000, 5e6), INTERVAL)
    profiles, worst = design_four_segments(
        columns(0.04)[0], low, high, Objective.of_modes(pole, np.ones((1, 1)))
    )
    assert float(profiles.T1[0]) == 0.001
    assert float(worst[0]) * (60 * np.pi) ** 2 == pytest.approx(5696.8, abs=0.05)


def test_no_profile_of_a_dense_scan_leaves_much_less_than_the_design():
    rng = np.random.default_rng(1)
    checked = 0
    for _ in range(60):
        T, m = 10 ** rng.uniform(-2.2, -0.5), rng.integers(1, 5)
        poles = mode_poles(10 ** rng.uniform(0.6, 2.6, m), rng.choice([0.0, 0.02, 0.1], m))
        weights = 10 ** rng.uniform(-2, 1, m)
        if T < 0.005:
            continue
        low, high = np.sort(rng.uniform(INTERVAL, T / 2 - INTERVAL, 2))
        profiles, worst = design_four_segments(
            *columns(T, low, high), Objective.of_modes(poles, weights[np.newaxis])
        )
        assert low <= float(profiles.T1[0]) <= high
        T1 = np.linspace(low, high, 4001)
        zero = np.zeros_like(T1)
        every, _ = displacement(T1, zero, T / 2 - T1, zero, poles, weights)
        middle, _ = displacement(*columns(T / 4, 0, T / 4, 0), poles, weights)
        assert float(worst[0]) >= every.min() * 0.99 - TIE
        assert float(worst[0]) <= 1.1 * every.min() + 0.003 * float(middle[0]) + TIE
        checked += 1
    assert checked > 40


def test_the_reported_worst_is_that_of_the_reported_profile():
    poles = mode_poles([30.0, 90.0], [0.02, 0.0])
    weights = np.array([[1.0, 0.3], [0.0, 2.0], [5.0, 5.0]])
    T = column(0.04, 0.053, 0.2)
    profiles, worst = design_four_segments(
        T, T * 0 + INTERVAL, T / 2 - INTERVAL, Objective.of_modes(poles, weights)
    )
    for i in range(3):
        amplitudes = []
        T1, T2 = float(profiles.T1[i]), float(profiles.T2[i])
        J1 = 6.0 / (T1**2 * T[i] * (2 * T2 / T1 + 1))  # noqa: N806
        times = [0, T1, T1 + T2, T1 + 2 * T2, 2 * T1 + 2 * T2]
        K = J1 * T1 / T2  # noqa: N806
        steps = [J1, -J1 - K, 0.0, J1 + K, -J1]
        for f, zeta, weight in zip((30.0, 90.0), (0.02, 0.0), weights[i], strict=True):
            A = float(residual_acceleration(times, steps, f, zeta))
            amplitudes.append(weight * A / (2 * np.pi * f) ** 2)
        assert float(worst[i]) == pytest.approx(max(amplitudes), rel=1e-6, abs=1e-12)


def test_without_modes_four_segments_stay_symmetric():
    none = mode_poles([], [])
    T = column(0.04, 0.08)
    profiles, worst = design_four_segments(
        T, T * 0 + INTERVAL, T / 2 - INTERVAL, Objective.of_modes(none, np.ones((2, 0)))
    )
    np.testing.assert_allclose(profiles.T1, T / 4)
    assert worst.tolist() == [0.0, 0.0]


def test_modes_that_do_not_count_leave_the_lowest_jerk():
    pole = mode_poles([30.0], [0.0])
    profiles, _ = design_four_segments(
        *columns(0.04, 0.001, 0.019), Objective.of_modes(pole, np.zeros((1, 1)))
    )
    assert float(profiles.T1[0]) == pytest.approx(0.01)
    # Symmetry out of reach: the nearest end of the range.
    profiles, _ = design_four_segments(
        *columns(0.04, 0.001, 0.007), Objective.of_modes(pole, np.zeros((1, 1)))
    )
    assert float(profiles.T1[0]) == pytest.approx(0.007)


def test_residuals_too_small_to_matter_are_ties_and_leave_the_lowest_jerk():
    pole = mode_poles([30.0], [0.0])
    # All residuals of the map are below 0.1 nm, though some are ten times others.
    profiles, worst = design_four_segments(
        *columns(0.04, 0.001, 0.019), Objective.of_modes(pole, np.full((1, 1), 0.9 * TIE))
    )
    assert float(profiles.T1[0]) == pytest.approx(0.01)
    assert 0.0 < float(worst[0]) < TIE


def drawn_long_moves(seed, count):
    """Limits and modes of moves whose conventional profile has more than four segments."""
    rng = np.random.default_rng(seed)
    while count:
        A = 10 ** rng.uniform(0.5, 4)
        V, J = np.sqrt(A) * 10 ** rng.uniform(-1.3, 0.3), A / 10 ** rng.uniform(-2.3, -1)
        conventional = conventional_profiles([V], [A], [J])
        if conventional.Ta[0] == 0.0 and conventional.Tv[0] == 0.0:
            continue
        m = rng.integers(1, 4)
        poles = mode_poles(10 ** rng.uniform(0.8, 2.3, m), rng.choice([0, 0.02, 0.1], m))
        total = np.ceil(conventional.total[0] / INTERVAL) * INTERVAL
        count -= 1
        yield total, V, A, 10.0 * J, poles, 10 ** rng.uniform(-1, 1, m), conventional


def design(total, V, A, J, poles, weights, conventional):
    """One profile of the general design."""
    return design_condition3(
        *columns(total, V, A, J),
        Objective.of_modes(poles, weights[np.newaxis]),
        INTERVAL,
        conventional,
    )


def test_general_designs_are_legal_and_never_worse_than_the_stretched_conventional_profile():
    better = 0
    for case in drawn_long_moves(3, 150):
        total, V, A, J, poles, weights, conventional = case
        profiles, worst, feasible = design(*case)
        assert feasible[0]
        T1, Ta, T2, Tv = (float(c[0]) for c in profiles.columns())
        least = INTERVAL * (1 - 1e-8)
        assert min(T1, T2) >= least
        assert all(x == 0.0 or x >= least for x in (Ta, Tv))
        assert 2 * (T1 + Ta + T2) + Tv == pytest.approx(total, rel=1e-9)
        by_hand, peak = displacement(*columns(T1, Ta, T2, Tv), poles, weights)
        assert float(worst[0]) == pytest.approx(float(by_hand[0]), rel=1e-6, abs=1e-12)
        assert float(peak[0]) <= A * (1 + 1e-8)
        assert float(peak[0]) * (Ta + (T1 + T2) / 2) <= V * (1 + 1e-8)
        assert float(peak[0]) / min(T1, T2) <= J * (1 + 1e-8)
        if conventional.T1[0] < INTERVAL:
            continue
        stretch = total / conventional.total[0]
        durations = [c * stretch for c in conventional.columns()]
        if all(float(d[0]) == 0 or float(d[0]) >= INTERVAL for d in durations):
            reference = float(displacement(*durations, poles, weights)[0][0])
            assert float(worst[0]) <= reference * (1 + 1e-6) + TIE
            better += float(worst[0]) < 0.5 * reference
    assert better > 20


@pytest.mark.parametrize("seed", [31, 34, 36, 42, 43, 46])
def test_general_designs_are_near_the_best_that_a_global_search_finds(seed):
    case = next(drawn_long_moves(seed, 1))
    total, V, A, J, poles, weights, conventional = case

    def cost(points):
        T1, T2 = INTERVAL * np.exp(points[0]), INTERVAL * np.exp(points[1])
        room = total / 2 - T1 - T2
        Ta = np.maximum(points[2] * room, 0.0)
        Tv = 2 * (room - Ta)
        worst, peak = displacement(T1, Ta, T2, np.maximum(Tv, 0.0), poles, weights)
        excess = np.maximum(peak / A, peak * (Ta + 0.5 * (T1 + T2)) / V)
        excess = np.maximum(excess, peak / np.minimum(T1, T2) / J)
        illegal = (room < 0) | (excess > 1 + 1e-9)
        return np.where(illegal, NOWHERE * (1 + np.abs(room) / total + excess), worst)

    longest = np.log(total / 2 / INTERVAL)
    found = differential_evolution(
        cost, [(0, longest), (0, longest), (0, 1)], popsize=40, maxiter=250, **{RNG: seed},
        vectorized=True, updating="deferred", polish=False,
    )  # fmt: skip
    assert found.fun < NOWHERE, "the search found no legal profile to compare with"
    _, worst, _ = design(*case)
    reference = float(displacement(*conventional.columns(), poles, weights)[0][0])
    assert float(worst[0]) <= 1.3 * found.fun + 0.02 * reference
    assert float(worst[0]) < reference


def test_rows_do_not_know_each_other():
    cases = list(drawn_long_moves(9, 7))
    poles = mode_poles([22.0, 57.0], [0.01, 0.05])
    rng = np.random.default_rng(9)
    weights = rng.uniform(0, 1, (7, 2))
    numbers = [np.array(c) for c in zip(*((t, V, A, J) for t, V, A, J, *_ in cases), strict=True)]
    conventional = SymmetricProfiles(
        *(np.concatenate(c) for c in zip(*(case[-1].columns() for case in cases), strict=True))
    )
    together, worst, _ = design_condition3(
        *numbers, Objective.of_modes(poles, weights), INTERVAL, conventional
    )
    for i in range(7):
        row = slice(i, i + 1)
        alone, own, _ = design_condition3(
            *(x[row] for x in numbers),
            Objective.of_modes(poles, weights[row]),
            INTERVAL,
            conventional.take(row),
        )
        np.testing.assert_allclose(own, worst[row], rtol=1e-9)
        for a, b in zip(alone.columns(), together.columns(), strict=True):
            np.testing.assert_allclose(a, b[row], rtol=1e-9)


def test_a_time_that_the_limits_do_not_allow_is_not_feasible():
    V, A, J = 10.0, 400.0, 8000.0
    fastest = conventional_profiles([V], [A], [J])
    pole = mode_poles([30.0], [0.0])
    total = 0.97 * float(fastest.total[0])
    _, worst, feasible = design(total, V, A, J, pole, np.ones(1), fastest)
    assert not feasible[0]
    assert np.isinf(worst[0])


def test_a_trapezoid_without_reserve_has_no_design_and_with_it_has():
    V, A, infinite = 10.0, 400.0, np.inf
    conventional = conventional_profiles([V], [A], [infinite])
    pole = mode_poles([30.0], [0.0])
    total = float(conventional.total[0])
    _, _, feasible = design(total, V, A, infinite, pole, np.ones(1), conventional)
    assert not feasible[0]
    profiles, _, feasible = design(total, V, 2 * A, infinite, pole, np.ones(1), conventional)
    assert feasible[0]
    assert min(float(profiles.T1[0]), float(profiles.T2[0])) >= INTERVAL * (1 - 1e-8)
    assert float(profiles.velocity[0]) <= V * (1 + 1e-8)


def test_without_modes_general_designs_have_low_jerk():
    V, A, J = 10.0, 400.0, 1e6
    conventional = conventional_profiles([V], [A], [J / 10])
    none = mode_poles([], [])
    total = float(np.ceil(conventional.total[0] / INTERVAL)) * INTERVAL
    profiles, worst, feasible = design(total, V, A, J, none, np.ones(0), conventional)
    assert feasible[0]
    assert worst.tolist() == [0.0]
    stretch = total / float(conventional.total[0])
    assert float(profiles.jerk[0]) <= J / 10 / stretch**3 * (1 + 1e-6)
