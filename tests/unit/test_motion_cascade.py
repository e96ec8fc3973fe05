"""Cascades of moving averages: closed form, limits, nulls, and a search by brute force."""

import numpy as np
import pytest

from gcodejerk.motion import Objective, mode_poles, profiles_response
from gcodejerk.motion.search.cascade import design_cascade, leading_periods

MS = 0.001
FREE = np.full(1, np.inf)


def objective_of(frequencies, damping=0.0, weights=None):
    n = len(frequencies)
    poles = mode_poles(frequencies, np.broadcast_to(damping, n))
    return Objective.of_modes(poles, np.ones((1, n)) if weights is None else np.array([weights]))


def designed(total, velocity, acceleration, jerk, objective):
    """The cascades, and what they leave by the profiles themselves; infinite where none fits."""
    profiles, feasible = design_cascade(
        total, velocity, acceleration, jerk, objective, MS, leading_periods(objective)
    )
    return profiles, np.where(feasible, objective.of(profiles), np.inf)


def box_response(width, poles):
    """What a moving average leaves of oscillators, by its definition."""
    return (np.exp(poles * width) - 1.0) / (poles * width)


def widths(profiles):
    """The three boxes of a cascade, from the moments of its jerk steps."""
    times = profiles.step_times()
    w3 = times[1]
    area = 1.0 / profiles.jerk[0]  # w1 w2 w3
    total = float(profiles.total[0])
    both = total - w3
    root = np.sqrt(both**2 / 4 - area / w3)
    return both / 2 + root, both / 2 - root, w3


@pytest.mark.parametrize("damping", [0.0, 0.03, 0.2])
def test_what_a_cascade_leaves_is_the_product_of_its_boxes(damping):
    f = [17.0, 41.0, 90.0]
    objective = objective_of(f, damping)
    profiles, worst = designed(np.array([0.083]), FREE, FREE, FREE, objective)
    D = np.abs(profiles_response(profiles, objective.poles))[0] / objective.poles.imag
    assert float(worst[0]) == pytest.approx(D.max(), rel=1e-9)
    product = objective.poles.copy()
    for width in widths(profiles):
        product = product * box_response(np.array(width), objective.poles)
    np.testing.assert_allclose(np.abs(product) / objective.poles.imag, D, rtol=1e-6, atol=1e-12)
    if damping == 0.0:
        x = np.pi * np.outer(f, widths(profiles))
        np.testing.assert_allclose(np.abs(np.sinc(x / np.pi).prod(axis=1)), D, rtol=1e-6, atol=1e-9)


def test_three_modes_are_silenced_at_once_where_their_periods_fill_the_time():
    f = [30.0, 50.0, 90.0]
    periods = 1.0 / np.array(f)
    profiles, worst = designed(np.array([periods.sum()]), FREE, FREE, FREE, objective_of(f))
    assert float(worst[0]) < 1e-12
    np.testing.assert_allclose(sorted(widths(profiles)), sorted(periods), rtol=1e-6)


@pytest.mark.parametrize("total", [0.055, 0.08, 0.131])
def test_two_modes_are_silenced_where_there_is_room_for_two_periods(total):
    _, worst = designed(np.array([total]), FREE, FREE, FREE, objective_of([30.0, 90.0]))
    assert float(worst[0]) < 1e-6


def test_one_profile_for_each_move_within_its_limits():
    rng = np.random.default_rng(3)
    n = 60
    total = rng.uniform(0.02, 0.4, n)
    V, A, J = 1.5 / total, 6.5 / total**2, 300.0 / total**3
    poles = mode_poles([23.0, 61.0], [0.02, 0.0])
    objective = Objective.of_modes(poles, rng.uniform(0.1, 1.0, (n, 2)))
    profiles, worst = designed(total, V, A, J, objective)
    feasible = np.isfinite(worst)
    assert feasible.sum() > 40
    tolerance = 1 + 1e-6
    kept = profiles.take(feasible)
    np.testing.assert_allclose(kept.total, total[feasible])
    assert (kept.peak_velocity <= V[feasible] * tolerance).all()
    assert (kept.peak_acceleration <= A[feasible] * tolerance).all()
    assert (kept.peak_jerk <= J[feasible] * tolerance).all()
    assert (kept.least_velocity >= -1e-9 * V[feasible]).all()
    np.testing.assert_allclose(objective.take(feasible).of(kept), worst[feasible], rtol=1e-6)


def test_the_search_finds_what_brute_force_finds():
    rng = np.random.default_rng(5)
    for _ in range(6):
        total = rng.uniform(0.03, 0.15)
        f, w = rng.uniform(8, 120, 2), rng.uniform(0.2, 1, 2)
        A, J = 6.0 / total**2, 200.0 / total**3
        found = designed(
            np.array([total]), FREE, np.array([A]), np.array([J]), objective_of(f, 0.01, w)
        )[1]
        w3, w2 = np.meshgrid(*[np.linspace(MS, total / 2, 400)] * 2)
        w1 = total - w2 - w3
        with np.errstate(divide="ignore", invalid="ignore"):
            jerk = np.where(w1 < w2 + w3, 2.0, 1.0) / (w1 * w2 * w3)
            legal = (w1 >= w2) & (w2 >= w3) & (1 / (w1 * w2) <= A) & (jerk <= J)
        w1 = np.where(legal, w1, total)
        D = np.zeros(w2.shape)
        for pole, weight in zip(mode_poles(f, [0.01, 0.01]), w, strict=True):
            product = pole
            for width in (w1, w2, w3):
                product = product * (np.exp(pole * width) - 1) / (pole * width)
            D = np.maximum(D, weight * np.abs(product) / pole.imag)
        if not legal.any():
            assert np.isinf(found[0])
            continue
        # The valleys of the map are narrow; the search must not miss them by much.
        assert float(found[0]) <= D[legal].min() * 1.3 + 1e-3


def test_no_cascade_fits_a_time_that_the_limits_do_not_allow():
    _, worst = designed(np.array([0.02]), FREE, np.array([6.0]), FREE, objective_of([30.0]))
    assert np.isinf(worst[0])
