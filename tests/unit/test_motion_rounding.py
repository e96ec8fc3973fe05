"""Rounding of positions: never wrong by a step, never backwards, and quiet at the modes."""

import numpy as np
import pytest

from gcodejerk.motion import (
    Grid,
    SymmetricProfiles,
    mode_poles,
    polyline_response,
    residual_displacement,
    round_positions,
    sample_profiles,
)

INTERVAL = 0.001
PAPER = SymmetricProfiles(*(np.array([d]) for d in (0.001, 0.0, 0.019, 0.0))).general()


def positions_of(profile, length, start, count):
    """Samples of one profile from each start, one move a row."""
    unit, _ = sample_profiles(profile, np.arange(count + 1)[np.newaxis], INTERVAL)
    return np.asarray(start)[:, np.newaxis] + length * unit


def rounded(exact, step, poles, weights=None, origin=0.0, stride=1, counts=None):
    """Positions in mm after rounding, and the grid."""
    n = len(exact)
    counts = np.full(n, exact.shape[1] - 1) if counts is None else counts
    grid = Grid.every(counts, stride, INTERVAL)
    poles = np.asarray(poles)
    weights = np.ones(len(poles)) if weights is None else np.asarray(weights)
    steps, origins = np.full(n, float(step)), np.full(n, float(origin))
    taken = np.take_along_axis(exact, grid.knots, axis=1)
    whole = round_positions(taken, grid, steps, origins, poles, weights)
    assert whole.dtype == np.int64
    return origin + whole * step, taken, grid


def noise(errors, frequency, damping=0.0):
    """Displacement that errors of samples leave in a mode, one row a move."""
    pole = mode_poles([frequency], [damping])
    t = np.arange(errors.shape[1]) * INTERVAL
    return residual_displacement(polyline_response(t, errors.T, pole), pole)[:, 0]


def test_noise_at_the_mode_is_far_below_that_of_plain_rounding():
    # The case of method.md: 1 mm in 40 ms, 1 um, 30 Hz; 0.3 um rms plain, 0.07 um shaped.
    start = np.arange(500) * 1e-3 / 500 + 3.0
    exact = positions_of(PAPER, 1.0, start, 40)
    written, _, _ = rounded(exact, 1e-3, mode_poles([30.0], [0.0]))
    shaped_error, plain_error = written - exact, np.rint(exact / 1e-3) * 1e-3 - exact
    for error in (shaped_error, plain_error):
        error[:, [0, -1]] = 0.0  # the ends are written as the program has them
    shaped, plain = (
        float(np.sqrt(np.mean(noise(e, 30.0) ** 2))) for e in (shaped_error, plain_error)
    )
    assert 0.2e-3 < plain < 0.45e-3
    assert shaped < 0.1e-3
    assert shaped < 0.3 * plain


@pytest.mark.parametrize("frequencies", [(23.7,), (30.0, 90.0), (17.0, 51.0, 140.0)])
def test_noise_is_below_that_of_plain_rounding_at_every_mode_that_counts(frequencies):
    rng = np.random.default_rng(len(frequencies))
    profile = SymmetricProfiles(*(np.array([d]) for d in (0.0031, 0.0, 0.0269, 0.0))).general()
    exact = positions_of(profile, 3.7, rng.uniform(0, 1, 400), 60)
    damping = [0.01] * len(frequencies)
    written, _, _ = rounded(exact, 1e-3, mode_poles(frequencies, damping))
    plain = np.rint(exact / 1e-3) * 1e-3
    total = []
    for positions in (written, plain):
        error = positions - exact
        error[:, [0, -1]] = 0.0
        total.append(np.sqrt(sum(np.mean(noise(error, f, 0.01) ** 2) for f in frequencies)))
    assert total[0] < 0.6 * total[1]


@pytest.mark.parametrize("stride", [1, 2, 3])
@pytest.mark.parametrize("frequencies", [(), (30.0,), (23.7, 90.0, 180.0)])
def test_no_block_is_a_step_faster_than_the_highest_speed(frequencies, stride):
    # Cruise at 37.3 steps per interval, and the same backwards.
    ramp = SymmetricProfiles(*(np.array([d]) for d in (0.004, 0.003, 0.004, 0.2))).general()
    V = float(ramp.peak_velocity[0])
    exact = np.concatenate(
        [positions_of(ramp, sign * 37.3e-3 / INTERVAL / V, [0.1237], 222) for sign in (1.0, -1.0)]
    )
    counts = np.full(2, 222)
    grid = Grid.every(counts, stride, INTERVAL)
    taken = np.take_along_axis(exact, grid.knots, axis=1)
    poles = mode_poles(frequencies, np.zeros(len(frequencies)))
    arguments = (taken, grid, np.full(2, 1e-3), np.zeros(2), poles, np.ones(len(poles)))
    bound = round_positions(*arguments, np.full(2, 37.3e-3 / INTERVAL))
    free = round_positions(*arguments)
    steps, exact_steps = np.abs(np.diff(bound, axis=1)), 37.3 * np.diff(grid.knots, axis=1)
    assert (steps <= np.ceil(exact_steps)).all()
    # Still one of the two neighbours, and nowhere backwards.
    assert (np.abs(bound - taken / 1e-3)[:, 1:-1] < 1.0 + 1e-6).all()
    if len(poles) > 1 and stride == 1:
        assert (np.abs(np.diff(free, axis=1)) > np.ceil(exact_steps)).any()
    if not len(poles):
        np.testing.assert_array_equal(bound, free)


@pytest.mark.parametrize("length", [0.0213, -0.0213, 1.0, -7.7, 113.0])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 0.0025, 0.01])
@pytest.mark.parametrize("stride", [1, 2, 5])
def test_rounding_errs_by_less_than_a_step_and_never_turns_back(length, step, stride):
    rng = np.random.default_rng(5)
    start = rng.uniform(-20, 20, 40)
    exact = positions_of(PAPER, length, start, 43)
    poles = mode_poles([30.0, 110.0], [0.0, 0.03])
    written, taken, grid = rounded(exact, step, poles, [1.0, 0.2], stride=stride)
    inner = (grid.knots > 0) & (grid.knots < grid.counts[:, np.newaxis])
    assert np.abs(written - taken)[inner].max() < step * (1 + 1e-5)
    assert np.abs(written - taken)[~inner].max() <= 0.5 * step * (1 + 1e-9)
    full = written.copy()
    full[:, 0], full[:, -1] = taken[:, 0], taken[:, -1]
    room = np.abs(taken[:, -1] - taken[:, 0]) >= 4 * step
    assert (np.diff(full[room], axis=1) * np.sign(length)).min(initial=0.0) >= -1e-6 * step


def test_an_origin_between_steps_is_kept():
    exact = positions_of(PAPER, 2.0, [0.00037], 40)
    written, _, _ = rounded(exact, 1e-3, mode_poles([30.0], [0.0]), origin=0.00037)
    assert written[0, 0] == 0.00037
    np.testing.assert_allclose((written[0] - 0.00037) / 1e-3 % 1, 0.0, atol=1e-6)


def test_without_modes_rounding_is_to_the_nearest():
    exact = positions_of(PAPER, 1.0, np.linspace(0.0001, 0.0099, 50), 40)
    written, _, _ = rounded(exact, 1e-3, mode_poles([], []))
    inner = slice(1, -1)
    assert np.abs(written - exact)[:, inner].max() <= 0.5e-3 * (1 + 1e-6)


def test_positions_on_the_grid_stay_there():
    exact = np.array([[0.0, 1.0, 3.0, 6.0, 10.0, 15.0]]) * 1e-3
    written, _, _ = rounded(exact, 1e-3, mode_poles([30.0], [0.0]))
    np.testing.assert_allclose(written, exact, atol=1e-12)


def test_moves_of_different_lengths_are_rounded_together_as_alone():
    rng = np.random.default_rng(6)
    counts = np.array([40, 3, 17, 40, 9, 28])
    poles = mode_poles([30.0, 90.0], [0.01, 0.02])
    grid = Grid.every(counts, 2, INTERVAL)
    share = grid.knots / counts[:, np.newaxis]
    exact = rng.uniform(-5, 5, 6)[:, np.newaxis] + (3 * share**2 - 2 * share**3) * np.array(
        [[1.0], [-0.3], [2.2], [-4.0], [0.7], [0.01]]
    )
    step, zero = np.array([1e-3, 1e-4, 1e-3, 0.01, 2e-3, 1e-4]), np.zeros(6)
    weights = np.array([1.0, 0.3])
    together = round_positions(exact, grid, step, zero, poles, weights)
    for row, count in enumerate(counts):
        own = Grid.every(counts[row : row + 1], 2, INTERVAL)
        own_exact = exact[row : row + 1, -own.knots.shape[1] :]
        alone = round_positions(own_exact, own, step[row : row + 1], zero[:1], poles, weights)
        assert alone[0].tolist() == together[row, -own.knots.shape[1] :].tolist(), count


def test_a_mode_with_more_say_gets_less_noise():
    rng = np.random.default_rng(8)
    profile = SymmetricProfiles(*(np.array([d]) for d in (0.005, 0.0, 0.035, 0.0))).general()
    exact = positions_of(profile, 2.0, rng.uniform(0, 1, 400), 80)
    poles = mode_poles([25.0, 61.0], [0.0, 0.0])
    rms = {}
    for weights in ((1.0, 0.01), (0.01, 1.0)):
        written, _, _ = rounded(exact, 1e-3, poles, weights)
        error = written - exact
        error[:, [0, -1]] = 0.0
        rms[weights] = [float(np.sqrt(np.mean(noise(error, f) ** 2))) for f in (25.0, 61.0)]
    assert rms[1.0, 0.01][0] < rms[0.01, 1.0][0]
    assert rms[0.01, 1.0][1] < rms[1.0, 0.01][1]
