"""The guarded optimum, against integration, HiGHS and brute force; nothing of the guard's own."""

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.signal import cont2discrete

from gcodejerk.motion import conventional_profiles, joined, mode_poles
from gcodejerk.motion.search.guard import (
    envelope,
    guarded_frequencies,
    keeps_guard,
    split_at_peak,
    undamped_response,
    with_narrows,
)
from gcodejerk.motion.search.optimal import least_residual, near_least, smoothest_within
from gcodejerk.motion.search.unit_move import Move, optimum_profiles

MS = 0.001


def acceleration(profile, rate):
    """The acceleration of one profile in the middle of many short steps [1/s^2]."""
    t = (np.arange(round(profile.total[0] * rate)) + 0.5) / rate
    k = np.searchsorted(profile.begin, t, side="right") - 1
    return t, profile.acceleration[k] + profile.jerk[k] * (t - profile.begin[k])


def oscillator(omega, a, dt):
    """What an undamped oscillator keeps of an acceleration in steps, times omega [1/s]."""
    system = np.array([[0.0, 1.0], [-(omega**2), 0.0]]), np.array([[0.0], [-1.0]])
    step, push, *_ = cont2discrete((*system, np.eye(2), np.zeros((2, 1))), dt)
    state = np.zeros(2)
    for value in a:
        state = step @ state + push[:, 0] * value
    return np.hypot(state[0], state[1] / omega) * omega


def drawn(count, seed=3):
    """Moves with a conventional profile that fits, and modes of all kinds."""
    random = np.random.default_rng(seed)
    while count:
        A = 10 ** random.uniform(2.5, 4.5)
        T = random.uniform(0.02, 0.09)
        V = A * T * random.uniform(0.15, 0.6)
        J = A / (T * random.uniform(0.05, 0.25))
        today = conventional_profiles([V], [A], [J])
        n = int(np.ceil(today.total[0] / MS - 1e-6))
        if not 16 <= n <= 90:
            continue
        count -= 1
        m = random.integers(1, 4)
        f = 10 ** random.uniform(1.1, 2.0, m)
        yield Move(
            n, V, 1.2 * A, 10 * J, mode_poles(f, np.full(m, random.choice([0.0, 0.02, 0.05]))),
            10 ** random.uniform(-1, 0, m), np.arange(m), random.choice([0.05, 0.1]), MS,
            today.general(), 1.0,
        )  # fmt: skip


def today_of(move):
    """What today's rapid leaves, over the band."""
    relative = np.linspace(1 - move.band, 1 + move.band, 101)
    poles = np.outer(relative, move.poles)
    p = move.today
    left = p.total[0] - p.step_times()
    steps = p.acceleration_steps() + p.jerk_steps() / poles[..., np.newaxis]
    response = (steps * np.exp(poles[..., np.newaxis] * left)).sum(axis=-1) / poles
    return float((np.abs(response) / poles.imag * move.weights).max())


def test_the_response_is_that_of_an_integrated_oscillator():
    for move in drawn(3):
        for omega in 2 * np.pi * np.array([17.0, 60.0, 151.0]):
            t, a = acceleration(move.today, 2e5)
            whole = undamped_response(move.today, np.array([omega]))[0]
            assert whole == pytest.approx(oscillator(omega, a, 5e-6), rel=1e-3, abs=1e-4)
            halves = split_at_peak(move.today)
            cut = halves[0].total[0]
            for half, part in zip(halves, (a[t < cut], a[t > cut]), strict=True):
                own = undamped_response(half, np.array([omega]))[0]
                assert own == pytest.approx(oscillator(omega, part, 5e-6), rel=1e-3, abs=1e-3)


def test_the_envelope_is_the_largest_sum_of_both_halves_nearby():
    for move in drawn(4, seed=5):
        omega = 2 * np.pi * np.linspace(25.0, 240.0, 40)
        found = envelope(move.today, omega)
        halves = split_at_peak(move.today)
        for w, value in zip(omega, found, strict=True):
            near = np.linspace(0.85 * w, 1.15 * w, 801)
            largest = sum(undamped_response(half, near) for half in halves).max()
            assert value == pytest.approx(largest, rel=0.01)
        assert np.all(undamped_response(move.today, omega) <= found * (1 + 1e-9))


@pytest.mark.parametrize("band", [0.0, 0.1])
def test_guarded_are_frequencies_beside_the_modes_and_not_the_modes(band):
    poles = mode_poles([30.0, 90.0], [0.02, 0.0])
    f = guarded_frequencies(poles, band, MS, 0.5) / (2 * np.pi)
    assert f.min() == pytest.approx(39.0, abs=0.2)
    assert f.max() == pytest.approx(250.0, abs=0.5)
    assert not np.any(np.abs(f / 90.0 - 1.0) < 0.999 * band)
    assert np.diff(f).max() < (0.2 * 90 if band else 0) + 0.6


def test_no_narrow_of_the_envelope_lies_between_guarded_frequencies():
    found = 0
    for move in drawn(12, seed=7):
        omega = guarded_frequencies(move.poles, move.band, MS, move.count * MS)
        every, bound = with_narrows(move.today, omega)
        assert np.isin(omega, every).all()
        assert np.allclose(bound, envelope(move.today, every), rtol=0.02)
        found += len(every) - len(omega)
        close = np.flatnonzero(np.diff(every) < 1.5 * np.median(np.diff(omega)))
        for k in close:
            between = envelope(move.today, np.linspace(every[k], every[k + 1], 9))
            assert between.min() >= 0.97 * bound[k : k + 2].min()
    assert found > 4


def test_a_mode_above_the_ceiling_guards_nothing():
    assert len(guarded_frequencies(mode_poles([240.0], [0.0]), 0.05, MS, 0.1)) == 0


def test_no_guarded_frequency_keeps_more_than_todays_envelope():
    gained = 0
    for move in drawn(12):
        reference = today_of(move)
        optimum = near_least(move, 0.01 * reference, reference, reference)
        free = near_least(
            Move(*(getattr(move, name) for name in Move.__slots__[:-1]), 0.0),
            0.01 * reference,
            reference,
            reference,
        )
        if optimum is None:
            continue
        profile = optimum_profiles([optimum], MS)
        f = np.abs(move.poles)[:, np.newaxis]
        omega = np.linspace(1.3 * f.min(), min(5 * f.max(), 2 * np.pi * 250), 150)
        beside = ((omega >= 1.3 * f) & (omega <= 5 * f)).any(axis=0)
        known = (np.abs(omega / f - 1.0) <= move.band).any(axis=0)
        omega = omega[beside & ~known]
        t, a = acceleration(profile, 1e4)
        kept = np.abs((a * np.exp(-1j * np.outer(omega, t))).sum(axis=1)) / 1e4
        halves = split_at_peak(move.today)
        for w, value in zip(omega, kept, strict=True):
            near = np.linspace(0.85 * w, 1.15 * w, 201)
            allowed = sum(undamped_response(half, near) for half in halves).max()
            assert value <= 1.02 * allowed + 1e-6
        assert keeps_guard(joined([profile]), move.today, [move.poles], move.band, MS, 1.01).all()
        # The guard costs something: it is no profile that is found without it.
        assert free.worst <= optimum.worst + 0.011 * reference
        gained += optimum.worst < 0.55 * reference
    assert gained > 2


@pytest.mark.parametrize(("length", "band"), [(60.0, 0.0), (150.0, 0.0), (51.0, 0.0), (20.0, 0.1)])
def test_a_long_move_without_damping_keeps_its_guard_whatever_lies_around_its_middle(length, band):
    # Its halves are guarded, of which one is looked at: a block around the middle is in both.
    today = conventional_profiles([600 / length], [5000 / length], [5e5 / length])
    n = int(np.ceil(today.total[0] / MS - 1e-6))
    move = Move(
        n, 600 / length, 5000 / length, 5e6 / length, mode_poles([30.0], [0.0]), np.array([length]),
        np.arange(1), band, MS, today.general(), 1.0,
    )  # fmt: skip
    reference = today_of(move)
    optimum = near_least(move, max(0.01 * reference, 1e-4), 1e-3, reference)
    profile = optimum_profiles([optimum], MS)
    t, a = acceleration(profile, 1e4)
    omega = 2 * np.pi * np.linspace(39.0, 150.0, 400)
    kept = np.abs((a * np.exp(-1j * np.outer(omega, t))).sum(axis=1)) / 1e4
    halves = split_at_peak(move.today)
    for w, value in zip(omega, kept, strict=True):
        near = np.linspace(0.85 * w, 1.15 * w, 201)
        allowed = sum(undamped_response(half, near) for half in halves).max()
        assert value <= 1.02 * allowed + 1e-6, w / (2 * np.pi)


def test_hardly_more_than_the_least_is_left_and_no_profile_does_that_with_less_jerk():
    for move in drawn(6, seed=11):
        free = Move(*(getattr(move, name) for name in Move.__slots__[:-1]), 0.0)
        reference = today_of(move)
        slack = 0.02 * reference
        least, near = least_residual(free, reference), near_least(free, slack, reference, reference)
        assert near.worst <= max(slack, least.worst + slack) * 1.001
        peak = np.abs(near.jerk).max()
        assert peak <= np.abs(least.jerk).max() * 1.001
        assert peak <= 1.03 * least_jerk(free, max(near.worst, slack)) + 1e-12
        within = smoothest_within(free, 1.2 * max(near.worst, slack))
        assert within.worst <= 1.2 * max(near.worst, slack)
        assert np.abs(within.jerk).max() <= peak * 1.001


def least_jerk(move, worst):
    """The least peak jerk that leaves no more, by HiGHS: for the rows of undamped quadrature."""
    n = move.count
    k, i = np.mgrid[1 : n + 1, 1 : n + 1]
    on, after = k >= i, (k - i) * MS
    a = np.where(on, MS, 0.0)
    v = np.where(on, MS * after + MS**2 / 2, 0.0)
    s = np.where(on[-1], MS * after[-1] ** 2 / 2 + MS**2 * after[-1] / 2 + MS**3 / 6, 0.0)
    left = MS * np.arange(n, -1, -1.0)
    facets, scale = [], move.acceleration / MS
    for pole, weight in zip(move.poles, move.weights, strict=True):
        for relative in np.linspace(1 - move.band, 1 + move.band, 9):
            p = pole * relative
            # The response to a unit jerk that begins at t and ends never is e^(p t)/p^2.
            row = -np.diff(np.exp(p * left)) / p**2 / p.imag * weight
            for angle in 2 * np.pi * np.arange(48) / 48:
                facets.append((np.exp(-1j * angle) * row).real * scale / worst)
    facets = np.array(facets)
    column = np.full((n, 1), -1.0)
    none = np.zeros((n, 1))
    upper = np.vstack(
        [
            np.hstack([facets, np.zeros((len(facets), 1))]),
            *(np.hstack([sign * m * scale / x, none])
              for m, x in ((a, move.acceleration), (v, move.velocity)) for sign in (1, -1)),
            np.hstack([np.eye(n), column]), np.hstack([-np.eye(n), column]),
        ]
    )  # fmt: skip
    bounds = np.concatenate(
        [np.ones(len(facets)), np.ones(n), np.ones(n), np.ones(n), np.zeros(n), np.zeros(2 * n)]
    )
    equal = np.hstack(
        [np.stack([a[-1] / move.acceleration, v[-1] / move.velocity, s]) * scale, np.zeros((3, 1))]
    )
    found = linprog(
        np.append(np.zeros(n), 1.0), A_ub=upper, b_ub=bounds, A_eq=equal, b_eq=[0.0, 0.0, 1.0],
        bounds=[(None, None)] * n + [(0, move.jerk / scale)], method="highs",
    )  # fmt: skip
    assert found.status == 0, found.message
    return found.fun * scale * MS**3


def test_a_move_with_a_long_cruise_is_one_ramp_and_its_image():
    # 300 mm at 100 mm/s: a third of a second of acceleration in 3.3 s.
    today = conventional_profiles([1 / 3.0], [1.0], [40.0])
    n = int(np.ceil(today.total[0] / MS - 1e-6))
    poles = mode_poles([9.0, 32.0], [0.05, 0.04])
    move = Move(
        n, 1 / 3.0, 4.0, np.inf, poles, np.array([120.0, 180.0]), np.arange(2), 0.1, MS,
        today.general(), 1.0,
    )  # fmt: skip
    reference = today_of(move)
    optimum = near_least(move, 0.01 * reference, reference, reference)
    assert len(optimum.jerk) < 500
    profile = optimum_profiles([optimum], MS)
    relative = np.linspace(0.9, 1.1, 801)
    grid = np.outer(relative, poles)[..., np.newaxis]
    steps = profile.jerk_steps() / grid
    response = (steps * np.exp(grid * (n * MS - profile.step_times()))).sum(axis=-1) / grid[..., 0]
    true = (np.abs(response) / grid[..., 0].imag * move.weights).max()
    # What was found is for the worst phase, and never less than what is true.
    assert true <= optimum.worst * 1.001 <= 0.01 * reference * 1.001
    assert profile.peak_velocity[0] <= move.velocity * (1 + 1e-6)
    assert profile.total[0] == pytest.approx(n * MS)
