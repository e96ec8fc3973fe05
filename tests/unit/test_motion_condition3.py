"""The design of Condition III against dense scans that know no map."""

import itertools

import numpy as np
import pytest
from jerk_sums import columns, displacement

from gcodejerk.motion import (
    Objective,
    SymmetricProfiles,
    design_four_segments,
    four_segment_range,
    mode_poles,
    residual_acceleration,
    symmetric_response,
)
from gcodejerk.motion.search.condition3 import TIE, _evenly

INTERVAL = 0.001


def column(*values):
    """Values as one column, as the planner gives them."""
    return np.array(values, dtype=float)


def designed(total, low, high, objective):
    """The design of four segments, and what its objective says that it leaves."""
    profiles = design_four_segments(total, low, high, objective)
    return profiles, objective.of(profiles)


def four_segment_peaks(T1, T):
    """Velocity, acceleration and larger jerk of the paper's table, row III, length 1."""
    T2 = T / 2 - T1
    R = T2 / T1
    J1 = 6.0 / (T1**2 * T * (2 * R + 1))  # noqa: N806
    return J1 * T1 * (T1 + T2) / 2, J1 * T1, J1 * max(1.0, 1.0 / R)


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
    profiles, worst = designed(
        *columns(total, INTERVAL, total / 2 - INTERVAL), Objective.of_modes(pole, np.ones((1, 1)))
    )
    assert float(worst[0]) < TIE
    assert any(float(profiles.T1[0]) == pytest.approx(null * 1e-3, abs=1e-6) for null in nulls)
    assert float(profiles.total[0]) == pytest.approx(total)


def test_the_design_of_the_paper_s_case_is_the_least_T1():
    pole = mode_poles([30.0], [0.0])
    low, high = four_segment_range(*columns(0.04, 600, 5000, 5e6), INTERVAL)
    profiles, worst = designed(
        columns(0.04)[0], low, high, Objective.of_modes(pole, np.ones((1, 1)))
    )
    assert float(profiles.T1[0]) == 0.001
    assert float(worst[0]) * (60 * np.pi) ** 2 == pytest.approx(5696.8, abs=0.05)


@pytest.mark.parametrize("band", [0.0, 0.1])
def test_no_profile_of_a_dense_scan_leaves_much_less_than_the_design(band):
    rng = np.random.default_rng(1)
    checked = 0
    for _ in range(60):
        T, m = 10 ** rng.uniform(-2.2, -0.5), rng.integers(1, 5)
        poles = mode_poles(10 ** rng.uniform(0.6, 2.6, m), rng.choice([0.0, 0.02, 0.1], m))
        weights = 10 ** rng.uniform(-2, 1, m)
        if T < 0.005:
            continue
        low, high = np.sort(rng.uniform(INTERVAL, T / 2 - INTERVAL, 2))
        objective = Objective.of_modes(poles, weights[np.newaxis]).in_band(band, T)
        profiles, worst = designed(*columns(T, low, high), objective)
        assert low <= float(profiles.T1[0]) <= high
        relative = np.linspace(1.0 - band, 1.0 + band, 21 if band else 1)
        around = np.outer(poles, relative).ravel(), np.repeat(weights, len(relative))
        T1 = np.linspace(low, high, 801 if band else 4001)
        zero = np.zeros_like(T1)
        every, _ = displacement(T1, zero, T / 2 - T1, zero, *around)
        middle, _ = displacement(*columns(T / 4, 0, T / 4, 0), *around)
        if not band:
            # The scan of a band looks between the frequencies of the design, and less closely.
            assert float(worst[0]) >= every.min() * 0.99 - TIE
        assert float(worst[0]) <= 1.1 * every.min() + 0.003 * float(middle[0]) + TIE
        checked += 1
    assert checked > 40


def test_the_reported_worst_is_that_of_the_reported_profile():
    poles = mode_poles([30.0, 90.0], [0.02, 0.0])
    weights = np.array([[1.0, 0.3], [0.0, 2.0], [5.0, 5.0]])
    T = column(0.04, 0.053, 0.2)
    profiles, worst = designed(
        T, T * 0 + INTERVAL, T / 2 - INTERVAL, Objective.of_modes(poles, weights)
    )
    for i in range(3):
        amplitudes = []
        T1, T2 = float(profiles.T1[i]), float(profiles.T2[i])
        J1 = 6.0 / (T1**2 * T[i] * (2 * T2 / T1 + 1))  # noqa: N806
        times = [0, T1, T1 + T2, T1 + 2 * T2, 2 * T1 + 2 * T2]
        K = J1 * T1 / T2
        steps = [J1, -J1 - K, 0.0, J1 + K, -J1]
        for f, zeta, weight in zip((30.0, 90.0), (0.02, 0.0), weights[i], strict=True):
            A = float(residual_acceleration(times, steps, f, zeta))
            amplitudes.append(weight * A / (2 * np.pi * f) ** 2)
        assert float(worst[i]) == pytest.approx(max(amplitudes), rel=1e-6, abs=1e-12)


def test_without_modes_four_segments_stay_symmetric():
    none = mode_poles([], [])
    T = column(0.04, 0.08)
    profiles, worst = designed(
        T, T * 0 + INTERVAL, T / 2 - INTERVAL, Objective.of_modes(none, np.ones((2, 0)))
    )
    np.testing.assert_allclose(profiles.T1, T / 4)
    assert worst.tolist() == [0.0, 0.0]


def test_modes_that_do_not_count_leave_the_lowest_jerk():
    pole = mode_poles([30.0], [0.0])
    profiles, _ = designed(*columns(0.04, 0.001, 0.019), Objective.of_modes(pole, np.zeros((1, 1))))
    assert float(profiles.T1[0]) == pytest.approx(0.01)
    # Symmetry out of reach: the nearest end of the range.
    profiles, _ = designed(*columns(0.04, 0.001, 0.007), Objective.of_modes(pole, np.zeros((1, 1))))
    assert float(profiles.T1[0]) == pytest.approx(0.007)


def test_residuals_too_small_to_matter_are_ties_and_leave_the_lowest_jerk():
    pole = mode_poles([30.0], [0.0])
    # All residuals of the map are below 0.1 nm, though some are ten times others.
    profiles, worst = designed(
        *columns(0.04, 0.001, 0.019), Objective.of_modes(pole, np.full((1, 1), 0.9 * TIE))
    )
    assert float(profiles.T1[0]) == pytest.approx(0.01)
    assert 0.0 < float(worst[0]) < TIE


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.3])
def test_a_map_of_four_segments_is_what_profiles_leave_one_by_one(damping):
    rng = np.random.default_rng(12)
    own = mode_poles([3.0, 20.0, 57.0, 400.0], [damping] * 4)
    weights = rng.uniform(0.1, 1.0, (3, 4))
    total = rng.uniform(0.02, 1.0, 3)
    T1 = total[:, np.newaxis] * np.linspace(0.03, 0.47, 41)
    found = _evenly(T1, total, Objective.of_modes(own, weights))
    for i, k in itertools.product(range(3), range(0, 41, 5)):
        durations = (T1[i, k], 0.0, 0.5 * total[i] - T1[i, k], 0.0)
        expected = displacement(*columns(*durations), own, weights[i])[0]
        assert found[i, k] == pytest.approx(float(expected[0]), rel=1e-7, abs=1e-12)
