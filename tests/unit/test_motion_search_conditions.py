"""Conditions I and II as designs, against a scan over T1."""

import numpy as np
import pytest

from gcodejerk.motion import Objective, mode_poles
from gcodejerk.motion.profiles.conditions import condition_profiles
from gcodejerk.motion.search.conditions import design_condition

MS = 0.001
FREE = np.full(1, np.inf)


@pytest.mark.parametrize(
    ("condition", "damping", "amplitude"),
    [("I", 0.0, 11777.1), ("II", 0.0, 12143.7), ("III", 0.0, 5696.8),
     ("I", 0.02, 10270.9), ("II", 0.02, 11097.0), ("III", 0.02, 5313.6)],
)  # fmt: skip
def test_the_best_of_each_condition_leaves_what_the_method_says(condition, damping, amplitude):
    objective = Objective.of_modes(mode_poles([30.0], [damping]), np.ones((1, 1)))
    total = np.array([0.04])
    profiles, worst = design_condition(condition, total, FREE, FREE, FREE, objective, MS)
    assert float(worst[0]) * (60 * np.pi) ** 2 == pytest.approx(amplitude, abs=0.06)
    assert objective.of(profiles) == pytest.approx(worst)


@pytest.mark.parametrize("condition", ["I", "II", "III"])
def test_profiles_of_conditions_are_their_triangles_of_acceleration(condition, four_segments):
    T1, total = np.array([0.003, 0.012]), 0.05
    profiles = condition_profiles(condition, T1, np.full(2, total))
    exact = four_segments(condition, T1, total, points=50_001)
    np.testing.assert_allclose(profiles.total, total)
    np.testing.assert_allclose(profiles.peak_velocity, exact.V, rtol=1e-6)
    np.testing.assert_allclose(profiles.peak_acceleration, exact.A, rtol=1e-6)
    np.testing.assert_allclose(profiles.peak_jerk, exact.J, rtol=1e-6)
    for k in range(2):
        one = profiles.take(np.array([k]))
        corners = np.append(one.begin, total)
        levels = np.append(one.acceleration, one.end_acceleration[-1])
        np.testing.assert_allclose(
            np.interp(exact.t, corners, levels), exact.a[k], atol=1e-6 * exact.A[k]
        )


@pytest.mark.parametrize("condition", ["I", "II"])
def test_no_T1_of_a_fine_scan_is_better_within_the_limits(condition, four_segments):  # noqa: N802
    rng = np.random.default_rng(11)
    for _ in range(5):
        total, f = rng.uniform(0.03, 0.12), rng.uniform(9.0, 80.0)
        A, J = rng.uniform(9, 40) / total**2, 600.0 / total**3
        objective = Objective.of_modes(mode_poles([f], [0.01]), np.ones((1, 1)))
        limits = (FREE, np.array([A]), np.array([J]))
        profiles, worst = design_condition(condition, np.array([total]), *limits, objective, MS)
        scan = four_segments(condition, np.linspace(MS, total / 2 - MS, 1500), total)
        left = scan.left(f, 0.01)[(scan.A <= A) & (scan.J <= J)]
        if not left.size:
            assert np.isinf(worst[0])
            continue
        assert float(worst[0]) <= left.min() * (1 + 1e-3) + 1e-8
        assert float(profiles.peak_acceleration[0]) <= A * (1 + 1e-6)
        assert float(profiles.peak_jerk[0]) <= J * (1 + 1e-6)
        T1 = profiles.duration[:1]
        own = four_segments(condition, T1, total, points=20_001).left(f, 0.01)
        np.testing.assert_allclose(worst, own, rtol=1e-4, atol=1e-9)
