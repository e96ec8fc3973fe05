"""The optimum, against a linear programme of its own that HiGHS solves, and against tables."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

from gcodejerk.motion import conventional_profiles, mode_poles, profiles_response
from gcodejerk.motion.search import optimal
from gcodejerk.motion.search.knots import refined_knots
from gcodejerk.motion.search.optimal import least_residual, near_least, smoothest_within
from gcodejerk.motion.search.unit_move import Move, optimum_profiles

MS = 0.001
FACETS = 64


def move_of(count, V, A, J, frequencies, damping=0.0, weights=None, band=0.0, group=None):
    """A unit move."""
    n = len(frequencies)
    return Move(
        count, V, A, J, mode_poles(frequencies, np.broadcast_to(damping, n)),
        np.ones(n) if weights is None else np.asarray(weights, dtype=float),
        np.arange(n) if group is None else np.asarray(group), band, MS,
    )  # fmt: skip


def matrices(count):
    """Acceleration, velocity and position at the knots for a unit jerk in each interval."""
    k, i = np.mgrid[1 : count + 1, 1 : count + 1]
    after = (k - i) * MS
    on = k >= i
    a = np.where(on, MS, 0.0)
    v = np.where(on, MS * after + MS**2 / 2, 0.0)
    s = np.where(on, MS * after**2 / 2 + MS**2 * after / 2 + MS**3 / 6, 0.0)
    return a, v, s


def rows_of(count, frequencies, damping, weights):
    """Displacement of every mode for a unit jerk in each interval, by quadrature."""
    nodes, share = np.polynomial.legendre.leggauss(12)
    rows = []
    T = count * MS
    for f, zeta, weight in zip(frequencies, damping, weights, strict=True):
        omega = 2 * np.pi * f
        damped = omega * np.sqrt(1 - zeta**2)
        # A mode's answer to a unit jerk that starts at t is the integral of that to a step of
        # acceleration, and so on: here simply a(t) times the impulse response, integrated.
        row = np.empty(count, dtype=complex)
        for i in range(count):
            total = 0.0
            for begin in (i * MS, (i + 1) * MS):
                end = (i + 1) * MS if begin == i * MS else T
                pieces = max(1, int(np.ceil((end - begin) * damped / 2)))
                edges = np.linspace(begin, end, pieces + 1)
                half = np.diff(edges) / 2
                t = ((edges[:-1] + half)[:, np.newaxis] + half[:, np.newaxis] * nodes).ravel()
                w = (half[:, np.newaxis] * share).ravel()
                a = np.minimum(t - i * MS, MS)
                total = total + np.sum(w * a * np.exp((-zeta * omega + 1j * damped) * (T - t)))
            row[i] = total * weight / damped
        rows.append(row)
    return rows


def by_linear_programme(count, V, A, J, rows):
    """Least worst residual: jerks within limits, the modulus as a polygon of facets."""
    a, v, s = matrices(count)
    scale = 1.0 / (A * MS)
    a, v, s = a / scale, v / scale, s / scale
    one = np.zeros((1, count + 1))
    one[0, -1] = 1.0
    facets = []
    # Numbers near 1: the solver takes very small ones for zero.
    unit = max(np.abs(row).max() for row in rows) / scale
    for row in rows:
        for angle in 2 * np.pi * np.arange(FACETS) / FACETS:
            facets.append(np.append((np.exp(-1j * angle) * row).real / (scale * unit), -1.0))
    column = np.zeros((count, 1))
    upper = [np.array(facets), *(np.hstack([sign * m / x, column]) for m, x in ((a, A), (v, V))
                                 for sign in (1, -1))]  # fmt: skip
    bounds = [np.zeros(len(facets)), *(np.ones(count) for _ in range(3)), np.zeros(count)]
    equal = np.hstack([np.stack([a[-1] / A, v[-1] / V, s[-1]]), np.zeros((3, 1))])
    found = linprog(
        one[0], A_ub=np.vstack(upper), b_ub=np.concatenate(bounds), A_eq=equal,
        b_eq=[0.0, 0.0, 1.0], bounds=[(-J * scale, J * scale)] * count + [(0, None)],
        method="highs",
    )  # fmt: skip
    return found.fun * unit if found.status == 0 else None


@pytest.mark.parametrize(
    ("J", "frequencies", "least"),
    [
        (1e6, [30.0], 4833), (2.5e6, [30.0], 0.0), (5e6, [30.0], 0.0),
        (1e6, [30.0, 90.0], 4833), (2.5e6, [30.0, 90.0], 0.0), (5e6, [30.0, 90.0], 0.0),
    ],
)  # fmt: skip
def test_the_least_amplitudes_of_the_worked_case(J, frequencies, least):
    # 1 mm in 40 ms with 50 mm/s and 5000 mm/s^2, the peaks of the conventional profile.
    weights = np.array(frequencies) ** 2 / 900.0
    optimum = least_residual(move_of(40, 50, 5000, J, frequencies, weights=weights), 0.37)
    assert optimum.worst * (60 * np.pi) ** 2 == pytest.approx(least, rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(("J", "least"), [(1e6, 7048), (2.5e6, 3488), (5e6, 3201)])
def test_the_least_worst_amplitudes_within_a_tenth(J, least):
    # As acceleration amplitudes: each frequency counts with its own omega squared.
    f = np.linspace(27.0, 33.0, 13)
    optimum = least_residual(move_of(40, 50, 5000, J, f, weights=(f / 30) ** 2), 0.37)
    assert optimum.worst * (60 * np.pi) ** 2 == pytest.approx(least, rel=4e-3)


def drawn_cases(count):
    """Moves whose conventional profile fits, with modes of all kinds."""
    rng = np.random.default_rng(7)
    while count:
        A = 10 ** rng.uniform(2.5, 4.5)
        T = rng.uniform(0.015, 0.07)
        V = A * T * rng.uniform(0.15, 0.6)
        J = A / (T * rng.uniform(0.02, 0.25))
        profile = conventional_profiles([V], [A], [J / rng.uniform(1.5, 10)])
        n = int(np.ceil(profile.total[0] / MS - 1e-6))
        if not 14 <= n <= 72:
            continue
        m = rng.integers(1, 4)
        f = 10 ** rng.uniform(0.9, 2.3, m)
        zeta = rng.choice([0.0, 0.02, 0.1], m)
        w = 10 ** rng.uniform(-1, 0, m)
        count -= 1
        yield n, V, A, J, f, zeta, w


def test_no_linear_programme_finds_less_and_none_finds_much_more():
    nulls = 0
    for n, V, A, J, f, zeta, w in drawn_cases(25):
        rows = rows_of(n, f, zeta, w)
        least = by_linear_programme(n, V, A, J, rows)
        profile = conventional_profiles([V], [A], [J])
        optimum = least_residual(move_of(n, V, A, J, f, zeta, w), 1.0)
        assert (optimum is None) == (least is None) or profile.total[0] > n * MS * (1 - 1e-4)
        if optimum is None:
            continue
        jerk = np.repeat(optimum.jerk, np.diff(optimum.knots)) / MS**3
        found = max(abs(row @ jerk) for row in rows)
        assert found == pytest.approx(optimum.worst, rel=1e-6, abs=1e-9)
        # The polygon is smaller than the circle by up to 0.12 %.
        assert optimum.worst <= least * 1.02 + 1e-7
        assert optimum.worst >= least * 0.998 - 1e-7
        if least < 1e-9:
            nulls += 1
            assert optimum.worst < 1e-12
    assert nulls > 3, "too few of the drawn cases have a null"


def test_where_no_jerk_is_limited_none_finds_less_either():
    for n, V, A, _, f, zeta, w in drawn_cases(8):
        rows = rows_of(n, f, zeta, w)
        # From one limit of the acceleration to the other within an interval.
        least = by_linear_programme(n, V, A, 2.0 * A / MS, rows)
        optimum = least_residual(move_of(n, V, A, np.inf, f, zeta, w), 1.0)
        assert (optimum is None) == (least is None)
        if optimum is not None:
            assert least * 0.998 - 1e-7 <= optimum.worst <= least * 1.02 + 1e-7


def test_over_a_band_the_worst_is_that_of_a_dense_scan():
    for n, V, A, J, f, zeta, w in drawn_cases(12):
        band = 0.06
        optimum = least_residual(move_of(n, V, A, J, f, zeta, w, band=band), 1.0)
        if optimum is None:
            continue
        relative = np.linspace(1 - band, 1 + band, 41)
        every = np.outer(relative, f).ravel()
        rows = rows_of(n, every, np.tile(zeta, 41), np.tile(w, 41))
        jerk = np.repeat(optimum.jerk, np.diff(optimum.knots)) / MS**3
        found = max(abs(row @ jerk) for row in rows)
        assert found == pytest.approx(optimum.worst, rel=0.01, abs=1e-9)
        some = [row for k, row in enumerate(rows) if k // len(f) % 4 == 0]
        few = by_linear_programme(n, V, A, J, some)
        # What is a millionth of the reference counts as nothing.
        assert optimum.worst <= few * 1.02 + 1e-6


def test_an_optimal_profile_arrives_at_rest_and_keeps_its_limits():
    for n, V, A, J, f, zeta, w in drawn_cases(25):
        optimum = least_residual(move_of(n, V, A, J, f, zeta, w, band=0.03), 1.0)
        if optimum is None:
            continue
        a, v, s = matrices(n)
        jerk = np.repeat(optimum.jerk, np.diff(optimum.knots)) / MS**3
        assert s[-1] @ jerk == pytest.approx(1.0, abs=1e-12)
        assert v[-1] @ jerk == pytest.approx(0.0, abs=1e-11 * V)
        assert a[-1] @ jerk == pytest.approx(0.0, abs=1e-11 * A)
        assert np.abs(jerk).max() <= J
        assert np.abs(a @ jerk).max() <= A
        assert (v @ jerk).max() <= V
        # Between two knots the velocity is a parabola; its control point bounds it.
        profile = optimum_profiles([optimum], MS)
        assert profile.least_velocity[0] >= -1e-6 * profile.peak_velocity[0]
        assert profile.peak_velocity[0] <= V * (1 + 1e-6)


def test_a_longer_move_is_still_close_to_the_programme_of_all_its_jerks():
    # 30 mm with a 30 and a 90 Hz mode: 166 intervals, most of them in long blocks.
    f, zeta = [30.0, 90.0], [0.02, 0.02]
    move = move_of(166, 20.0, 5000 / 30, 5e6 / 30, f, zeta, band=0.05)
    optimum = least_residual(move, 0.008)
    assert len(optimum.jerk) < 140
    relative = np.linspace(0.95, 1.05, 11)
    every = np.outer(relative, f).ravel()
    rows = rows_of(166, every, [0.02] * 22, [1.0] * 22)
    least = by_linear_programme(166, 20.0, 5000 / 30, 5e6 / 30, rows)
    assert optimum.worst == pytest.approx(least, rel=0.03)


def test_among_equal_optima_the_least_jerk_is_taken():
    # A null needs 3.25e5 of the allowed 5e6 less than a third.
    optimum = least_residual(move_of(40, 50, 5000, 5e6, [30.0]), 0.37)
    assert np.abs(optimum.jerk).max() / MS**3 == pytest.approx(0.3247 * 5e6, rel=1e-3)
    rows = rows_of(40, [30.0], [0.0], [1.0])
    # The linear programme agrees: a little less jerk leaves no null.
    peak = np.abs(optimum.jerk).max() / MS**3
    assert by_linear_programme(40, 50, 5000, peak * 1.001, rows) < 1e-8
    assert by_linear_programme(40, 50, 5000, peak * 0.99, rows) > 1e-6


def test_a_time_that_the_limits_do_not_allow_has_no_optimum():
    profile = conventional_profiles([50.0], [5000.0], [5e6])
    least = int(np.ceil(profile.total[0] / MS))
    assert least_residual(move_of(least - 1, 50, 5000, 5e6, [30.0]), 0.37) is None
    assert least_residual(move_of(least + 1, 50, 5000, 5e6, [30.0]), 0.37) is not None


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("damping", [0.0, 0.05])
def test_the_fewest_intervals_have_what_the_programme_has(count, damping):
    # With limits far away three intervals are the first that can begin and end at rest.
    move = move_of(count, 1e6, 1e9, 1e12, [30.0], damping)
    optimum = least_residual(move, 1.0)
    if count < 3:
        assert optimum is None
        return
    least = by_linear_programme(count, 1e6, 1e9, 1e12, rows_of(count, [30.0], [damping], [1.0]))
    # The control points of so few parabolas bound their velocity with a little to spare.
    assert optimum.worst == pytest.approx(least, rel=0.02, abs=1e-6)


def test_within_a_tolerance_the_smoothest_profile_is_taken():
    move = move_of(40, 50, 5000, 5e6, [30.0], band=0.05)
    least = least_residual(move, 0.37)
    assert smoothest_within(move, 0.9 * least.worst) is None
    smooth = smoothest_within(move, 3.0 * least.worst)
    assert smooth.worst <= 3.0 * least.worst
    assert np.abs(smooth.jerk).max() < 0.6 * np.abs(least.jerk).max()


def test_a_group_is_judged_by_the_root_of_its_squares():
    f, w = np.array([26.0, 29.0, 33.0, 38.0]), np.array([0.3, 0.6, 0.5, 0.2])
    together = least_residual(move_of(40, 50, 5000, 1e6, f, 0.0, w, 0.05, [0, 0, 0, 0]), 0.37)
    profile = optimum_profiles([together], MS)
    poles = mode_poles(f, np.zeros(4))
    D = np.abs(profiles_response(profile, poles))[0] / poles.imag * w
    assert together.worst == pytest.approx(np.sqrt((D**2).sum()), rel=1e-9)
    apart = least_residual(move_of(40, 50, 5000, 1e6, f, 0.0, w), 0.37)
    other = np.abs(profiles_response(optimum_profiles([apart], MS), poles))[0] / poles.imag * w
    assert np.sqrt((other**2).sum()) >= together.worst * (1 - 1e-3)
    assert D.max() >= apart.worst * (1 - 1e-3)


def test_a_long_cruise_may_slow_down_for_a_low_mode():
    # What is reported as the least that any profile can leave: long blocks left a sixth more.
    L, count = 5.0, 143
    V, A, J = 40 / L, 5000 / L, 5e6 / L
    move = replace(
        move_of(count, V, A, J, [25.0, 60.0], 0.02, [L, 0.5 * L]),
        today=conventional_profiles([V], [A], [0.1 * J]).general(),
    )
    found = least_residual(move, 0.3)
    least = by_linear_programme(
        count, V, A, J, rows_of(count, [25.0, 60.0], [0.02, 0.02], [L, 0.5 * L])
    )
    assert found.worst == pytest.approx(least, rel=0.015)


@pytest.mark.parametrize("damping", [0.0, 0.03])
@pytest.mark.parametrize("smooth", [False, True])
def test_a_move_of_many_seconds_asks_no_programme_that_takes_minutes(damping, smooth, monkeypatch):
    # Half a metre at 41 mm/s: 900 blocks by 800 frequencies took a minute, and ten of them were
    # asked for.
    sizes = []
    solve = optimal.solve

    def solved(problem, *rest):
        sizes.append(len(problem.group) * (len(problem.knots) - 1) ** 2)
        return solve(problem, *rest)

    monkeypatch.setattr(optimal, "solve", solved)
    L, V, A, J, count, band = 478.6, 41.4, 308.0, 38e3, 11720, 0.05
    today = conventional_profiles([V / L], [A / L], [J / L]).general()
    move = replace(
        move_of(count, V / L, A / L, 46e3 / L, [71.9, 149.1], damping, [157.0, 322.0], band),
        today=today,
    )
    before = worst_of(today, move)
    found = near_least(move, 0.01 * before, 0.001, before) if smooth else least_residual(move, 1.0)
    assert max(sizes, default=0) <= optimal.WORK
    assert worst_of(optimum_profiles([found], MS), move) == pytest.approx(found.worst, rel=0.01)
    assert found.worst < 0.6 * before


def worst_of(profiles, move):
    """What a profile leaves at frequencies side by side, over the band; by another rule."""
    relative = np.linspace(1.0 - move.band, 1.0 + move.band, 2001)
    poles = np.outer(move.poles, relative).ravel()
    left = np.abs(profiles_response(profiles, poles)[0]) / poles.imag
    return (left * np.repeat(move.weights, len(relative))).max()


@pytest.mark.parametrize("most", range(20, 61))
def test_a_block_and_its_image_are_cut_both_or_none(most):
    knots = np.arange(0, 121, 6)
    jerk = np.abs(np.linspace(-1.0, 1.0, 20)) + 0.1
    cut = refined_knots(knots, jerk, True, most)
    assert np.array_equal(cut, 120 - cut[::-1])
    assert len(cut) - 1 <= most
    assert len(cut) > 21 or most < 36
