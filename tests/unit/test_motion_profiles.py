"""Laws as segments of constant jerk: integrated, put together, taken apart."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

from gcodejerk.motion import Laws, SymmetricLaws, joined, laws_response, mode_poles

RNG = np.random.default_rng(31)


def drawn(count):
    """Laws of random segments, with steps of the acceleration here and there."""
    sizes = RNG.integers(1, 9, count)
    first = np.concatenate([[0], np.cumsum(sizes)])
    s = first[-1]
    return Laws.of(first, RNG.uniform(0.001, 0.1, s), RNG.normal(0, 9, s), RNG.normal(0, 300, s))


def polynomial(laws, k):
    """Acceleration, velocity and position of one law, integrated by scipy."""
    part = slice(laws.first[k], laws.first[k + 1])
    ends = np.concatenate([[0.0], np.cumsum(laws.duration[part])])
    a = PPoly(np.array([laws.jerk[part], laws.acceleration[part]]), ends)
    return a, a.antiderivative(), a.antiderivative(2)


def test_segments_are_integrated_from_rest():
    laws = drawn(40)
    for k in range(len(laws)):
        part = slice(laws.first[k], laws.first[k + 1])
        _, v, s = polynomial(laws, k)
        t = laws.begin[part]
        np.testing.assert_allclose(t, v.x[:-1], atol=1e-15)
        np.testing.assert_allclose(laws.velocity[part], v(t), atol=1e-12)
        np.testing.assert_allclose(laws.position[part], s(t), atol=1e-12)
        assert float(laws.total[k]) == pytest.approx(v.x[-1])


def test_peaks_are_those_of_a_dense_scan():
    laws = drawn(40)
    for k in range(len(laws)):
        a, v, _ = polynomial(laws, k)
        t = np.linspace(0.0, v.x[-1], 20001)
        values = v(t)
        room = np.abs(a(t)).max() * (t[1] - t[0])
        # A law need not end at rest here; the peaks are those up to the begin of the last segment
        # and within it.
        assert float(laws.peak_velocity[k]) <= values.max() + room
        assert float(laws.least_velocity[k]) >= values.min() - room
        inner = values[t <= laws.begin[laws.first[k + 1] - 1]]
        assert float(laws.peak_velocity[k]) >= inner.max(initial=0.0) - room
        assert float(laws.least_velocity[k]) <= inner.min(initial=0.0) + room
        part = slice(laws.first[k], laws.first[k + 1])
        ends = np.concatenate([laws.acceleration[part], laws.end_acceleration[part]])
        assert float(laws.peak_acceleration[k]) == np.abs(ends).max()
        assert float(laws.greatest_jerk[k]) == np.abs(laws.jerk[part]).max()
        steps = len(ends) > 2 or np.abs(ends).max() > 0
        assert np.isinf(laws.peak_jerk[k]) == steps


def test_steps_add_up_to_the_acceleration():
    laws = drawn(20)
    times, jumps, kinks = laws.step_times(), laws.acceleration_steps(), laws.jerk_steps()
    at = laws.first + np.arange(len(laws) + 1)
    for k in range(len(laws)):
        t, jumped, kinked = (x[at[k] : at[k + 1]] for x in (times, jumps, kinks))
        assert kinked.sum() == pytest.approx(0.0, abs=1e-9)
        a, _, _ = polynomial(laws, k)
        for moment in RNG.uniform(0, t[-1], 5):
            before = t <= moment
            found = (jumped + kinked * (moment - t))[before].sum()
            assert found == pytest.approx(float(a(moment)), abs=1e-9)


def test_laws_taken_replaced_and_joined_are_the_same_laws():
    laws, others = drawn(12), drawn(3)
    both = joined([laws, others])
    assert len(both) == 15
    assert [both.segments(k) for k in range(12, 15)] == [others.segments(k) for k in range(3)]
    index = np.array([7, 0, 7, 11])
    some = laws.take(index)
    assert [some.segments(k) for k in range(4)] == [laws.segments(k) for k in index]
    np.testing.assert_array_equal(some.total, laws.total[index])
    where = np.zeros(12, dtype=bool)
    where[[2, 5, 6]] = True
    new = laws.replaced(where, others)
    expected = [laws.segments(k) for k in range(12)]
    expected[2], expected[5], expected[6] = (others.segments(k) for k in range(3))
    assert [new.segments(k) for k in range(12)] == expected
    assert len(laws.take(np.zeros(12, dtype=bool))) == 0


def test_no_laws_have_no_peaks():
    none = drawn(3).take(np.zeros(0, dtype=np.int64))
    for column in (none.total, none.peak_velocity, none.peak_jerk, none.least_velocity):
        assert column.shape == (0,)
    assert laws_response(none, mode_poles([30.0], [0.0])).shape == (0, 1)


def test_a_symmetric_law_as_segments_ends_at_one_and_at_rest():
    columns = (np.array([0.003, 0.0]), np.array([0.005, 0.02]), np.array([0.011, 0.0]),
               np.array([0.021, 0.0]))  # fmt: skip
    symmetric = SymmetricLaws(*columns)
    laws = symmetric.general()
    np.testing.assert_allclose(laws.peak_velocity, symmetric.velocity)
    np.testing.assert_allclose(laws.peak_acceleration, symmetric.acceleration)
    np.testing.assert_allclose(laws.peak_jerk, symmetric.jerk)
    for k in range(2):
        _, v, s = polynomial(laws, k)
        assert float(s(v.x[-1])) == pytest.approx(1.0)
        assert float(v(v.x[-1])) == pytest.approx(0.0, abs=1e-12)
