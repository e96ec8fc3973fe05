"""Profiles as segments of constant jerk: integrated, put together, taken apart."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

from gcodejerk.motion import Profiles, SymmetricProfiles, joined, mode_poles, profiles_response

RNG = np.random.default_rng(31)


def drawn(count):
    """Profiles of random segments, with steps of the acceleration here and there."""
    sizes = RNG.integers(1, 9, count)
    first = np.concatenate([[0], np.cumsum(sizes)])
    s = first[-1]
    return Profiles.of(
        first, RNG.uniform(0.001, 0.1, s), RNG.normal(0, 9, s), RNG.normal(0, 300, s)
    )


def polynomial(profiles, k):
    """Acceleration, velocity and position of one profile, integrated by scipy."""
    part = slice(profiles.first[k], profiles.first[k + 1])
    ends = np.concatenate([[0.0], np.cumsum(profiles.duration[part])])
    a = PPoly(np.array([profiles.jerk[part], profiles.acceleration[part]]), ends)
    return a, a.antiderivative(), a.antiderivative(2)


def test_segments_are_integrated_from_rest():
    profiles = drawn(40)
    for k in range(len(profiles)):
        part = slice(profiles.first[k], profiles.first[k + 1])
        _, v, s = polynomial(profiles, k)
        t = profiles.begin[part]
        np.testing.assert_allclose(t, v.x[:-1], atol=1e-15)
        np.testing.assert_allclose(profiles.velocity[part], v(t), atol=1e-12)
        np.testing.assert_allclose(profiles.position[part], s(t), atol=1e-12)
        assert float(profiles.total[k]) == pytest.approx(v.x[-1])


def test_peaks_are_those_of_a_dense_scan():
    profiles = drawn(40)
    for k in range(len(profiles)):
        a, v, _ = polynomial(profiles, k)
        t = np.linspace(0.0, v.x[-1], 20001)
        values = v(t)
        room = np.abs(a(t)).max() * (t[1] - t[0])
        # A profile need not end at rest here; the peaks are those up to the begin of the last
        # segment and within it.
        assert float(profiles.peak_velocity[k]) <= values.max() + room
        assert float(profiles.least_velocity[k]) >= values.min() - room
        inner = values[t <= profiles.begin[profiles.first[k + 1] - 1]]
        assert float(profiles.peak_velocity[k]) >= inner.max(initial=0.0) - room
        assert float(profiles.least_velocity[k]) <= inner.min(initial=0.0) + room
        part = slice(profiles.first[k], profiles.first[k + 1])
        ends = np.concatenate([profiles.acceleration[part], profiles.end_acceleration[part]])
        assert float(profiles.peak_acceleration[k]) == np.abs(ends).max()
        assert float(profiles.greatest_jerk[k]) == np.abs(profiles.jerk[part]).max()
        steps = len(ends) > 2 or np.abs(ends).max() > 0
        assert np.isinf(profiles.peak_jerk[k]) == steps


def test_steps_add_up_to_the_acceleration():
    profiles = drawn(20)
    times, jumps, kinks = (
        profiles.step_times(),
        profiles.acceleration_steps(),
        profiles.jerk_steps(),
    )
    at = profiles.first + np.arange(len(profiles) + 1)
    for k in range(len(profiles)):
        t, jumped, kinked = (x[at[k] : at[k + 1]] for x in (times, jumps, kinks))
        assert kinked.sum() == pytest.approx(0.0, abs=1e-9)
        a, _, _ = polynomial(profiles, k)
        for moment in RNG.uniform(0, t[-1], 5):
            before = t <= moment
            found = (jumped + kinked * (moment - t))[before].sum()
            assert found == pytest.approx(float(a(moment)), abs=1e-9)


def test_profiles_taken_replaced_and_joined_are_the_same_profiles():
    profiles, others = drawn(12), drawn(3)
    both = joined([profiles, others])
    assert len(both) == 15
    assert [both.segments(k) for k in range(12, 15)] == [others.segments(k) for k in range(3)]
    index = np.array([7, 0, 7, 11])
    some = profiles.take(index)
    assert [some.segments(k) for k in range(4)] == [profiles.segments(k) for k in index]
    np.testing.assert_array_equal(some.total, profiles.total[index])
    where = np.zeros(12, dtype=bool)
    where[[2, 5, 6]] = True
    new = profiles.replaced(where, others)
    expected = [profiles.segments(k) for k in range(12)]
    expected[2], expected[5], expected[6] = (others.segments(k) for k in range(3))
    assert [new.segments(k) for k in range(12)] == expected
    assert len(profiles.take(np.zeros(12, dtype=bool))) == 0


def test_no_profiles_have_no_peaks():
    none = drawn(3).take(np.zeros(0, dtype=np.int64))
    for column in (none.total, none.peak_velocity, none.peak_jerk, none.least_velocity):
        assert column.shape == (0,)
    assert profiles_response(none, mode_poles([30.0], [0.0])).shape == (0, 1)


def test_a_symmetric_profile_as_segments_ends_at_one_and_at_rest():
    columns = (np.array([0.003, 0.0]), np.array([0.005, 0.02]), np.array([0.011, 0.0]),
               np.array([0.021, 0.0]))  # fmt: skip
    symmetric = SymmetricProfiles(*columns)
    profiles = symmetric.general()
    np.testing.assert_allclose(profiles.peak_velocity, symmetric.velocity)
    np.testing.assert_allclose(profiles.peak_acceleration, symmetric.acceleration)
    np.testing.assert_allclose(profiles.peak_jerk, symmetric.jerk)
    for k in range(2):
        _, v, s = polynomial(profiles, k)
        assert float(s(v.x[-1])) == pytest.approx(1.0)
        assert float(v(v.x[-1])) == pytest.approx(0.0, abs=1e-12)
