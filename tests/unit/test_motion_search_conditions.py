"""Conditions I and II as designs, against a scan over T1."""

import numpy as np
import pytest

from gcodejerk.motion import Objective, mode_poles, residual_acceleration
from gcodejerk.motion.profiles.conditions import (
    condition_accelerations,
    condition_durations,
    condition_profiles,
)
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
def test_laws_are_the_closed_forms_segments(condition):
    T1, total = np.array([0.003, 0.012]), np.array([0.05, 0.05])
    profiles = condition_profiles(condition, T1, total)
    for k in range(2):
        durations = condition_durations(condition, T1[k], total[k])
        A1, A2 = condition_accelerations(condition, 1.0, T1[k], total[k])
        np.testing.assert_allclose([d for d, _ in profiles.segments(k)], durations)
        jerks = [A1 / durations[0], -A1 / durations[1], A2 / durations[2], -A2 / durations[3]]
        np.testing.assert_allclose([j for _, j in profiles.segments(k)], jerks)


@pytest.mark.parametrize("condition", ["I", "II"])
def test_no_T1_of_a_fine_scan_is_better_within_the_limits(condition):  # noqa: N802
    rng = np.random.default_rng(11)
    for _ in range(5):
        total, f = rng.uniform(0.03, 0.12), rng.uniform(9.0, 80.0)
        A, J = rng.uniform(9, 40) / total**2, 600.0 / total**3
        objective = Objective.of_modes(mode_poles([f], [0.01]), np.ones((1, 1)))
        limits = (FREE, np.array([A]), np.array([J]))
        profiles, worst = design_condition(condition, np.array([total]), *limits, objective, MS)
        best = np.inf
        for T1 in np.linspace(MS, total / 2 - MS, 1500):
            d = condition_durations(condition, T1, total)
            A1, A2 = (float(x) for x in condition_accelerations(condition, 1.0, T1, total))
            jerks = np.array([A1 / d[0], -A1 / d[1], A2 / d[2], -A2 / d[3]])
            if max(abs(A1), abs(A2)) > A or np.abs(jerks).max() > J:
                continue
            steps = np.diff(jerks, prepend=0.0, append=0.0)
            times = np.concatenate([[0.0], np.cumsum(d)])
            left = residual_acceleration(times, steps, f, 0.01)
            best = min(best, float(left) / (2 * np.pi * f) ** 2)
        assert (np.isinf(best) and np.isinf(worst[0])) or float(worst[0]) <= best * (
            1 + 1e-3
        ) + 1e-9
        if np.isfinite(worst[0]):
            assert float(profiles.peak_acceleration[0]) <= A * (1 + 1e-6)
            assert float(profiles.peak_jerk[0]) <= J * (1 + 1e-6)
