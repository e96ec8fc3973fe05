"""Profiles: peaks and lengths by plain integration, the conventional one's time by search."""

# ruff: noqa: N806  (J1 to J4, A1 and A2 are the paper's own symbols)

import numpy as np
import pytest
from scipy.interpolate import PPoly

from gcodejerk.motion import SymmetricProfiles, conventional_profiles

RNG = np.random.default_rng(20)


def one(*durations):
    """One profile of given T1, Ta, T2, Tv."""
    return SymmetricProfiles(*(np.array([float(d)]) for d in durations))


def integrated(durations):
    """Position, velocity and acceleration of a unit profile as piecewise polynomials.

    Integrated from an acceleration of peak 1, then scaled to the length 1.
    """
    T1, Ta, T2, Tv = durations
    half = [(T1, 0.0, 1.0), (Ta, 1.0, 1.0), (T2, 1.0, 0.0)]
    pieces = [*half, (Tv, 0.0, 0.0), *((d, -b, -a) for d, a, b in reversed(half))]
    pieces = [p for p in pieces if p[0] > 0.0]
    ends = np.concatenate([[0.0], np.cumsum([p[0] for p in pieces])])
    a = PPoly(np.array([[(high - low) / d, low] for d, low, high in pieces]).T, ends)
    length = float(a.antiderivative(2)(ends[-1]))
    a = PPoly(a.c / length, ends)
    return a.antiderivative(2), a.antiderivative(), a


SHAPES = [
    (0.0013, 0.0, 0.0171, 0.0),
    (0.0171, 0.0, 0.0013, 0.0),
    (0.0031, 0.0057, 0.0113, 0.0211),
    (0.0, 0.0173, 0.0, 0.0),
    (0.0, 0.0173, 0.0, 0.0091),
    (0.007, 0.0, 0.007, 0.031),
]


@pytest.mark.parametrize("durations", SHAPES)
def test_peaks_of_a_profile_are_those_of_its_integrated_acceleration(durations):
    q, v, a = integrated(durations)
    profile, T = one(*durations), 2 * sum(durations[:3]) + durations[3]
    t = np.linspace(0.0, T, 20001)
    assert float(profile.total[0]) == pytest.approx(T)
    assert float(q(T)) == pytest.approx(1.0)
    assert float(v(T)) == pytest.approx(0.0, abs=1e-9 / T)
    assert float(profile.velocity[0]) == pytest.approx(v(t).max(), rel=1e-6)
    assert float(profile.acceleration[0]) == pytest.approx(np.abs(a(t)).max(), rel=1e-3)
    ramps = [d for d in (durations[0], durations[2])]
    jerk = float(profile.acceleration[0]) / min(ramps) if min(ramps) else np.inf
    assert float(profile.jerk[0]) == pytest.approx(jerk)


@pytest.mark.parametrize("durations", SHAPES)
def test_length_is_velocity_times_what_the_centroids_leave_of_the_time(durations):
    _, v, a = integrated(durations)
    profile, ramp = one(*durations), sum(durations[:3])
    t = np.linspace(0.0, ramp, 40001)
    trapezoid = getattr(np, "trapezoid", None) or getattr(np, "trapz")  # noqa: B009 numpy 1
    centroid = trapezoid(a(t) * t, t) / trapezoid(a(t), t)
    assert float(profile.centroid[0]) == pytest.approx(centroid, rel=1e-4)
    assert float(profile.area[0]) == pytest.approx(float(v(ramp)) / float(profile.acceleration[0]))
    length = float(profile.velocity[0] * (profile.total[0] - 2.0 * profile.centroid[0]))
    assert length == pytest.approx(1.0)


def test_segments_are_the_phases_of_finite_jerk_in_order():
    profile = one(0.003, 0.005, 0.011, 0.021)
    durations, jerks = zip(*profile.general().segments(0), strict=True)
    assert durations == (0.003, 0.005, 0.011, 0.021, 0.011, 0.005, 0.003)
    J1, zero, J2, *rest = jerks
    A = float(profile.acceleration[0])
    np.testing.assert_allclose([J1 * 0.003, J2 * 0.011], [A, -A])
    assert [zero, *rest] == [0.0, 0.0, J2, 0.0, J1]


def test_segments_of_the_paper_have_the_paper_s_jerks():
    (d1, J1), (d2, J2), (d3, J3), (d4, J4) = one(0.001, 0.0, 0.019, 0.0).general().segments(0)
    assert (d1, d2, d3, d4) == (0.001, 0.019, 0.019, 0.001)
    np.testing.assert_allclose([J1, J4], 3846153.8, atol=0.1)
    np.testing.assert_allclose([J2, J3], -J1 / 19)


def test_a_trapezoid_has_no_jerk_in_its_segments_and_an_infinite_peak():
    profile = one(0.0, 0.02, 0.0, 0.01)
    assert profile.general().segments(0) == [(0.02, 0.0), (0.01, 0.0), (0.02, 0.0)]
    assert np.isinf(profile.jerk[0])


def test_taking_and_replacing_profiles_keeps_the_others():
    profiles = SymmetricProfiles(*(np.arange(4.0) + 10 * k for k in range(4)))
    few = profiles.take(np.array([2, 0]))
    assert [c.tolist() for c in few.columns()] == [[2, 0], [12, 10], [22, 20], [32, 30]]
    mixed = profiles.replaced(np.array([False, True, False, True]), few)
    assert mixed.T1.tolist() == [0, 2, 2, 0]
    assert mixed.Tv.tolist() == [30, 32, 32, 30]
    assert profiles.T1.tolist() == [0, 1, 2, 3]
    assert len(mixed) == 4


def limits(count):
    """Limits of unit profiles: accelerations after 1 to 100 ms, velocities that bind or not."""
    A = 10 ** RNG.uniform(0.5, 5.0, count)
    V = np.sqrt(A) * 10 ** RNG.uniform(-1.5, 1.0, count)
    J = A / 10 ** RNG.uniform(-3.0, -0.5, count)
    return V, A, J


def shortest_by_search(V, A, J):
    """Least time of a symmetric profile within limits: every shape on a grid of its phases."""
    size = max(1.0 / V, 2.0 / np.sqrt(A), (32.0 / J) ** (1 / 3))
    grid = np.concatenate([[0.0], np.geomspace(1e-5, 1.0, 700)]) * size
    tj, ta = np.meshgrid(grid[1:], grid, indexing="ij")
    a = np.minimum(np.minimum(A, J * tj), V / (tj + ta))
    v = a * (tj + ta)
    tv = np.maximum(1.0 / v - 2.0 * tj - ta, 0.0)
    return float((4.0 * tj + 2.0 * ta + tv).min())


def test_no_symmetric_profile_within_limits_is_faster_than_the_conventional_one():
    V, A, J = limits(40)
    profiles = conventional_profiles(V, A, J)
    for i in range(40):
        found = shortest_by_search(V[i], A[i], J[i])
        assert float(profiles.total[i]) <= found * (1 + 1e-9)
        assert float(profiles.total[i]) >= found * 0.97


def test_the_conventional_profile_keeps_its_limits_and_reaches_one_in_each_phase():
    V, A, J = limits(500)
    profiles = conventional_profiles(V, A, J)
    v, a, j = profiles.velocity / V, profiles.acceleration / A, profiles.jerk / J
    for share in (v, a, j):
        assert share.max() <= 1.0 + 1e-9
    assert (profiles.T1 == profiles.T2).all()
    np.testing.assert_allclose(j, 1.0, rtol=1e-9)
    np.testing.assert_allclose(a[profiles.Ta > 0.0], 1.0, rtol=1e-9)
    np.testing.assert_allclose(v[profiles.Tv > 0.0], 1.0, rtol=1e-9)
    four = (profiles.Ta == 0.0) & (profiles.Tv == 0.0)
    assert 10 < four.sum() < 490, "the drawn limits do not cover both kinds"


def test_the_conventional_profile_covers_the_length_by_its_own_limits():
    V, A, J = limits(50)
    profiles = conventional_profiles(V, A, J)
    for i in range(50):
        tj, ta, _, tv = (float(c[i]) for c in profiles.columns())
        jerk = PPoly(
            np.array([[J[i], 0.0, -J[i], 0.0, -J[i], 0.0, J[i]]]),
            np.cumsum([0.0, *(d + 1e-15 for d in (tj, ta, tj, tv, tj, ta, tj))]),
        )
        assert float(jerk.antiderivative(3)(4 * tj + 2 * ta + tv)) == pytest.approx(1.0, rel=1e-6)


def test_without_a_jerk_limit_the_conventional_profile_is_a_trapezoid():
    profiles = conventional_profiles([10.0, 1000.0], [400.0, 400.0], np.inf)
    assert profiles.T1.tolist() == profiles.T2.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(profiles.Ta, [10.0 / 400.0, 1.0 / np.sqrt(400.0)])
    np.testing.assert_allclose(profiles.Tv, [1 / 10.0 - 10.0 / 400.0, 0.0], atol=1e-12)


def test_a_shortest_ramp_lengthens_the_profile_only_where_the_jerk_would_allow_less():
    V, A, J = limits(300)
    free, held = conventional_profiles(V, A, J), conventional_profiles(V, A, J, 0.002)
    assert held.T1.min() >= 0.002
    short = free.T1 < 0.002
    assert short.any()
    assert not short.all()
    for free_column, held_column in zip(free.columns(), held.columns(), strict=True):
        np.testing.assert_array_equal(free_column[~short], held_column[~short])
    for share in (held.velocity / V, held.acceleration / A, held.jerk / J):
        assert share.max() <= 1.0 + 1e-9
    assert (held.total[short] >= free.total[short] * (1 - 1e-9)).all()
