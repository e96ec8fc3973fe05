"""Steps downhill, and combinations of switching times, against profiles one by one."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from test_motion_candidates import drawn_objective

from gcodejerk.motion import Objective, SymmetricProfiles, mode_poles
from gcodejerk.motion.search.combinations import best_combinations
from gcodejerk.motion.search.newton import POWERS, proposed_steps, slopes
from gcodejerk.motion.search.ramps import _Search

INTERVAL = 0.001


def drawn_ramps(rng, n, k):
    """T1, Ta, T2 of shape (k, n) and T_SUM of shape (n,), with some cruise left."""
    total = rng.uniform(0.05, 0.4, n)
    parts = rng.dirichlet([2.0, 1.0, 2.0, 1.0], (k, n)) * 0.5 * total[:, np.newaxis]
    return parts[..., 0], parts[..., 1], parts[..., 2], total


def exact(T1, Ta, T2, total, objective):
    """Displacements of each mode in double precision, shape (k n, p)."""
    k, n = T1.shape
    Tv = total - 2 * (T1 + Ta + T2)
    flat = SymmetricProfiles(*(x.ravel() for x in (T1, Ta, T2, Tv))).general()
    apart = objective.take(np.tile(np.arange(n), k))
    each = [
        Objective.of_modes(apart.poles[m : m + 1], apart.weights[:, m : m + 1]).of(flat)
        for m in range(len(apart.poles))
    ]
    return np.stack(each, axis=1)


@pytest.mark.parametrize("damping", [0.0, 0.02, 0.1])
def test_what_is_left_and_its_slopes_are_those_of_profiles_a_little_longer(damping):
    rng = np.random.default_rng(5)
    poles = mode_poles(rng.uniform(8, 60, 3), np.full(3, damping))
    objective = Objective.of_modes(poles, rng.uniform(0.5, 2.0, (4, 3)))
    *ramp, total = drawn_ramps(rng, 4, 5)
    left, slope = slopes(*ramp, total, objective)
    size = np.sqrt((left.astype(float) ** 2).sum(axis=0))
    expected = exact(*ramp, total, objective).T
    np.testing.assert_allclose(size, expected, rtol=1e-3, atol=1e-4 * expected.max())
    # The square changes by twice what both parts change by.
    rate = 2.0 * (left[np.newaxis].astype(float) * slope).sum(axis=1)
    for which in range(3):
        little = 1e-5 * total
        squares = []
        for sign in (1.0, -1.0):
            moved = list(ramp)
            moved[which] = moved[which] + sign * little
            squares.append(exact(*moved, total, objective).T ** 2)
        numeric = (squares[0] - squares[1]) / (2.0 * np.tile(little, 5))
        scale = np.abs(numeric).max(axis=0)
        assert (np.abs(rate[which] - numeric) <= 2e-3 * scale + 1e-3 * np.abs(numeric)).all()


@pytest.mark.parametrize("spectrum", [False, True], ids=["band", "spectrum"])
def test_steps_lead_downhill(spectrum):
    rng = np.random.default_rng(6)
    fell = []
    for _ in range(20):
        objective = drawn_objective(rng, 3, 0.02, spectrum)
        objective = Objective(objective.poles, objective.weights + 0.1, objective.group)
        T1, Ta, T2, total = drawn_ramps(rng, 3, 4)
        left, slope = slopes(T1, Ta, T2, total, objective)
        free = np.zeros((2, 3, T1.size), dtype=bool)
        steps = proposed_steps(left, slope, objective, free)
        assert steps.shape == (3, len(POWERS), T1.size)

        def power_sum(parts, power, objective=objective):
            squares = (parts.astype(float) ** 2).sum(axis=0)
            starts = np.flatnonzero(np.diff(objective.group, prepend=-1))
            return (np.add.reduceat(squares, starts, axis=0) ** (power / 2)).sum(axis=0)

        for (power, _), step in zip(POWERS, np.moveaxis(steps, 1, 0), strict=True):
            # Residuals that change in proportion: a hundredth of the step lowers the sum of powers.
            moved = left + 0.01 * np.einsum("im,ixpm->xpm", step, slope)
            fell.append(power_sum(moved, power) < power_sum(left, power))
    assert np.mean(fell) > 0.99


def test_what_is_fixed_does_not_move_where_it_would_go_beyond():
    rng = np.random.default_rng(7)
    objective = Objective.of_modes(mode_poles([20.0, 35.0], [0.02, 0.02]), np.ones((5, 2)))
    *ramp, total = drawn_ramps(rng, 5, 6)
    left, slope = slopes(*ramp, total, objective)
    free = proposed_steps(left, slope, objective, np.zeros((2, 3, 30), dtype=bool))
    squares = (left * left).sum(axis=0)
    share = squares / squares.max(axis=0)
    for which, up in itertools.product(range(3), (False, True)):
        fixed = np.zeros((2, 3, 30), dtype=bool)
        fixed[int(up), which] = True
        held = proposed_steps(left, slope, objective, fixed)
        for k, (power, _) in enumerate(POWERS):
            of_each = (left * slope[which]).sum(axis=0) * share ** (power / 2 - 1)
            downhill = -of_each.sum(axis=0)
            outward = downhill > 0 if up else downhill < 0
            assert 0 < outward.sum() < 30
            assert (held[which, k, outward] == 0.0).all()
            assert (held[:, k, ~outward] == free[:, k, ~outward]).all()


@pytest.mark.parametrize("tiny", [0.0, 1e-22, 1e-19, 1e-17])
def test_a_mode_that_is_all_but_still_breaks_no_step(tiny):
    """Its square has no inverse in single precision."""
    rng = np.random.default_rng(9)
    objective = Objective.of_modes(mode_poles([20.0, 35.0], [0.02, 0.02]), np.ones((5, 2)))
    *ramp, total = drawn_ramps(rng, 5, 6)
    left, slope = slopes(*ramp, total, objective)
    left[:, 1] = tiny
    assert left.dtype == np.float32
    nothing_fixed = np.zeros((2, 3, 30), dtype=bool)
    steps = proposed_steps(left, slope, objective, nothing_fixed)
    assert np.isfinite(steps).all()
    left[:, 1] = 0.0
    np.testing.assert_allclose(steps, proposed_steps(left, slope, objective, nothing_fixed), 1e-3)


def test_a_move_of_two_intervals_without_a_limit_of_jerk_has_one_combination():
    """All its times are the same, so that a part of no length stands against no limit."""
    times, total = np.full((5, 1), INTERVAL), np.array([2.0 * INTERVAL])
    objective = drawn_objective(np.random.default_rng(3), 1, 0.02, False)
    limits = (4.0 / total, 20.0 / total**2, np.array([np.inf]))
    T1, Ta, T2 = best_combinations(times, total, limits, objective, INTERVAL)
    assert (T1 == INTERVAL).all()
    assert not Ta.any()
    assert not T2.any()


@pytest.mark.parametrize("damping", [0.0, 0.03])
@pytest.mark.parametrize("spectrum", [False, True], ids=["band", "spectrum"])
def test_combinations_are_the_best_of_all_profiles_with_these_times(damping, spectrum):
    rng = np.random.default_rng(8)
    for _ in range(2):
        n, k = 2, 7
        objective = drawn_objective(rng, n, damping, spectrum)
        objective = Objective(objective.poles, objective.weights + 0.1, objective.group)
        total = rng.uniform(0.05, 0.4, n)
        times = INTERVAL + np.sort(rng.uniform(0, 1, (k, n)), axis=0) * (0.5 * total - INTERVAL)
        times[-1] = 0.5 * total
        A, J = 12.0 / total**2, 200.0 / total**3
        found = best_combinations(times, total, (2.0 / total, A, J), objective, INTERVAL)
        for i, first in itertools.product(range(n), range(k - 1)):
            # By the sum of all squares, as of one group.
            one = replace(objective.take(slice(i, i + 1)), group=np.zeros_like(objective.group))
            T = total[i]
            best = np.inf
            for second, third in itertools.combinations(range(k), 2):
                if second < first:
                    continue
                T1, Ta, T2 = np.diff(np.append(0.0, times[[first, second, third], i]))
                profile = SymmetricProfiles(
                    *(np.array([x]) for x in (T1, Ta, T2, T - 2 * times[third, i]))
                )
                legal = profile.velocity[0] <= 2.0 / T and profile.acceleration[0] <= A[i]
                legal &= profile.jerk[0] <= J[i] and T2 >= INTERVAL
                legal &= all(x == 0.0 or x >= INTERVAL for x in (Ta, profile.Tv[0]))
                if legal:
                    best = min(best, float(one.of(profile.general())[0]))
            if np.isfinite(best):
                T1, Ta, T2 = (x[first : first + 1, i] for x in found)
                own = SymmetricProfiles(T1, Ta, T2, T - 2 * (T1 + Ta + T2)).general()
                assert float(one.of(own)[0]) <= best * (1 + 1e-3) + 1e-4 * one.weights.max()


def test_the_range_of_constant_acceleration_changes_as_differences_say():
    rng = np.random.default_rng(4)
    total = rng.uniform(0.1, 0.4, 6)
    objective = Objective.of_modes(mode_poles([20.0], [0.0]), np.ones((6, 1)))
    limits = 1.6 / total, np.linspace(6.0, 14.0, 6) / total**2, 1e4 / total**3
    search = _Search.of(total, *limits, objective, INTERVAL)
    T1, T2 = (rng.uniform(0.02, 0.3, (40, 6)) * total for _ in range(2))
    share = rng.uniform(0.0, 1.0, T1.shape)
    low, high, slope = search._slopes_of_Ta(T1, T2, share)
    assert (low > 0.0).any()
    assert (low == 0.0).any()
    there = low < high
    assert there.sum() > 40
    step = 1e-7
    for own, moved in zip(slope, ((step, 0.0), (0.0, step)), strict=True):
        ends = [
            (1.0 - share) * least + share * most
            for least, most in (
                search._range_of_Ta(T1 + sign * moved[0], T2 + sign * moved[1]) for sign in (-1, 1)
            )
        ]
        difference = (ends[1] - ends[0]) / (2.0 * step)
        near = there & (np.abs(difference) < 50.0)
        assert (np.abs(own - difference)[near] < 1e-3).mean() > 0.99
