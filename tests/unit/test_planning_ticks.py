"""Profiles in whole ticks: the times of the worked examples, exact ends, limits held."""

import numpy as np
import pytest

from gcodejerk.motion import Profiles, conventional_profiles
from gcodejerk.motion.profiles.symmetric import SymmetricProfiles
from gcodejerk.planning.ticks import TickTask, in_ticks

D, V, A, J = 300.0, 500.0, 5000.0, 150_000.0
NO_MODES = np.zeros(0, complex)


def column(*numbers):
    return tuple(np.array([x]) for x in numbers)


def told(profiles, limits, tick, least=1, most=10**12):
    n = len(profiles)
    wide = tuple(np.broadcast_to(limit, n) for limit in limits)
    whole = np.full(n, least), np.full(n, most)
    return in_ticks(TickTask(profiles, wide, *whole, NO_MODES, np.zeros((n, 0)), tick))


def seven_segments():
    return conventional_profiles(*column(V / D, A / D, J / D), 0.001).general()


@pytest.mark.parametrize(
    ("tick", "ticks", "peaks"),
    [
        (1e-3, [34, 66, 34, 466, 34, 66, 34], (500.0, 5000.0, 147_058.8)),
        (1 / 1024, [34, 69, 34, 478, 34, 69, 34], (499.512, 4966.02, 149_565.0)),
        (
            0.25e-6,
            [133334, 266666, 133334, 1866666, 133334, 266666, 133334],
            (500.0, 5000.0, 149_999.3),
        ),
    ],
)
def test_the_worked_example_in_three_ticks(tick, ticks, peaks):
    profiles, found = told(seven_segments(), column(V / D, A / D, J / D), tick)
    assert found.all()
    assert np.rint(profiles.duration / tick).astype(int).tolist() == ticks
    own = (profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk)
    assert [float(peak[0]) * D for peak in own] == pytest.approx(peaks, rel=1e-6)


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("tick", [1e-9, 0.25e-6, 1 / 1024, 1e-3])
def test_drawn_profiles_end_exactly_at_rest_within_their_limits(seed, tick):
    rng = np.random.default_rng(seed)
    T1, Ta, T2, Tv = rng.uniform(0.003, 0.08, (4, 3)) * np.array([1, 0.5, 1.2, 3])[:, None]
    Ta, Tv = Ta * rng.integers(0, 2, 3), Tv * rng.integers(0, 2, 3)
    profiles = SymmetricProfiles(T1, Ta, T2, Tv).general()
    slack = rng.choice([1.0, 1.1])
    limits = profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk
    limits = tuple(limit * slack for limit in limits)
    made, found = told(profiles, limits, tick)
    assert found.all()
    ticks = made.duration / tick
    assert np.abs(ticks - np.rint(ticks)).max() < 1e-4
    last = made.first[1:] - 1
    d, a, j = made.duration[last], made.acceleration[last], made.jerk[last]
    end = made.position[last] + made.velocity[last] * d + a * d**2 / 2 + j * d**3 / 6
    assert end == pytest.approx(np.ones(3), abs=1e-12)
    assert made.velocity[last] + a * d + j * d**2 / 2 == pytest.approx(np.zeros(3), abs=1e-10)
    assert np.abs(made.acceleration_steps()).max() < 1e-9 * made.peak_acceleration.max()
    for peak, limit in zip(
        (made.peak_velocity, made.peak_acceleration, made.peak_jerk), limits, strict=True
    ):
        assert (peak <= limit * (1 + 1e-8)).all()


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("tick", [1e-9, 20e-6, 1 / 1024, 1e-3])
def test_what_stands_on_its_way_stands_there_in_ticks_too(seed, tick):
    """Strokes like those of a short move behind an input shaper, of which the times are rounded."""
    rng = np.random.default_rng(seed)
    mirrored = seed % 4 == 0
    strokes = 2 if mirrored else rng.integers(2, 5)
    share = np.ones(strokes) if mirrored else rng.uniform(0.2, 1.0, strokes)
    share /= share.sum()
    t = np.full(2, 0.0113) if mirrored else rng.uniform(0.003, 0.02, strokes)
    # The braking takes so many times as long as the accelerating.
    slope = np.ones(2) if mirrored else rng.uniform(0.5, 2.0, strokes)
    peak = share / (t * t * (1.0 + slope))
    rest, none = rng.uniform(0.003, 0.03, strokes), np.zeros(strokes)
    d = np.stack([t, t, slope * t, slope * t, rest], axis=1).ravel()[:-1]
    a = np.stack([none, peak, none, -peak / slope, none], axis=1).ravel()[:-1]
    up, down = peak / t, peak / (slope**2 * t)
    j = np.stack([up, -up, -down, down, none], axis=1).ravel()[:-1]
    profiles = Profiles.of(np.array([0, len(d)]), d, a, j)
    limits = profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk
    made, found = told(profiles, tuple(1.5 * limit for limit in limits), tick)
    assert found.all()
    rests = (made.acceleration == 0.0) & (made.jerk == 0.0) & (made.velocity < 1e-6)
    rests[0] = False
    assert rests.sum() >= strokes - 1
    assert np.abs(made.velocity[rests]).max() < 1e-12 * made.peak_velocity[0]
    stands = np.unique(made.position[rests].round(9))
    assert stands == pytest.approx(np.cumsum(share)[:-1], abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("tick", [20e-6, 1 / 1024, 1e-3])
def test_what_creeps_on_its_way_is_told_nothing_that_goes_backwards(seed, tick):
    """A profile that all but stands, as a solver has it: no stroke of its own."""
    rng = np.random.default_rng(seed)
    t, rest, creeps = rng.uniform(0.004, 0.02, 2), rng.uniform(0.01, 0.03), 1e-5
    up, down = np.array([1.0, 0.7]), np.array([1.0 - creeps, 0.7 + creeps * t[0] / t[1]])
    none = np.zeros(2)
    d = np.stack([t, t, t, t, [rest, 0.0]], axis=1).ravel()[:-1]
    a = np.stack([none, up, none, -down, none], axis=1).ravel()[:-1]
    j = (np.append(a[1:], 0.0) - a) / d
    way = Profiles.of(np.array([0, 9]), d, a, j)
    end = way.position[-1] + (way.velocity[-1] + (a[-1] / 2 + j[-1] * d[-1] / 6) * d[-1]) * d[-1]
    profiles = Profiles.of(np.array([0, 9]), d, a / end, j / end)
    limits = profiles.peak_velocity, profiles.peak_acceleration, profiles.peak_jerk
    made, found = told(profiles, tuple(1.5 * limit for limit in limits), tick, 2, 10**4)
    assert found.all()
    assert made.least_velocity[0] >= -1e-9 * made.peak_velocity[0]


def test_a_trapezoid_keeps_its_steps():
    first, d = np.array([0, 3]), np.array([0.1, 0.25, 0.1]) + 1e-4 / 3
    a = np.array([1.0, 0.0, -1.0]) / (d[0] * (d[0] + d[1]))
    trapezoid = Profiles.of(first, d, a, np.zeros(3))
    assert trapezoid.total[0] == pytest.approx(0.4501)
    limits = trapezoid.peak_velocity, trapezoid.peak_acceleration, np.array([np.inf])
    made, found = told(trapezoid, limits, 1e-3)
    assert found.all()
    assert made.jerk.tolist() == [0.0, 0.0, 0.0]
    assert np.rint(made.duration * 1e3).tolist() == [101, 250, 101] or made.total[0] < 0.455
    assert made.position[-1] + made.velocity[-1] * made.duration[-1] / 2 == pytest.approx(1.0)


def test_short_segments_are_run_together_where_rows_have_to_be_apart():
    T1, Ta, T2, Tv = column(0.001, 0.0, 0.019, 0.0)
    profiles = SymmetricProfiles(T1, Ta, T2, Tv).general()
    limits = profiles.peak_velocity, profiles.peak_acceleration * 1.5, np.array([np.inf])
    made, found = told(profiles, limits, 1e-3, least=4)
    assert found.all()
    assert made.duration.min() >= 0.004 - 1e-9


def test_what_no_ticks_can_tell_is_said_to_be_not_found():
    profiles = seven_segments()
    made, found = told(profiles, column(V / D / 2, A / D, J / D), 1e-3, most=740)
    assert not found.any()
    assert made.duration.tolist() == profiles.duration.tolist()
