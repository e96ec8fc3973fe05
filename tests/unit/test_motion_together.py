"""What axes that run each on its own can leave at least, against one linear programme of them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.signal import cont2discrete
from test_motion_guard import acceleration, oscillator
from test_motion_optimal import FACETS, MS, matrices, rows_of

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import conventional_profiles, mode_poles
from gcodejerk.motion.search.guard import (
    guarded_frequencies,
    split_at_peak,
    undamped_response,
)
from gcodejerk.motion.search.optimal import least_residual
from gcodejerk.motion.search.together import least_together
from gcodejerk.motion.search.unit_move import Move, optimum_profiles
from gcodejerk.planning.bounds import least_residuals
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.task import worst_at_arrival


def rows_until(until, count, frequencies, damping, weights):
    """What a unit jerk in each interval leaves when the last axis arrives."""
    poles = mode_poles(frequencies, np.array(damping))
    later = np.exp(poles * (until - count) * MS)
    return [
        row * factor
        for row, factor in zip(rows_of(count, frequencies, damping, weights), later, strict=True)
    ]


def by_linear_programme(moves, rows):
    """Least worst sum of residuals: (count, V, A, J) of each move, and its rows of each mode."""
    counts = [count for count, *_ in moves]
    width = sum(counts) + 1
    begins = np.cumsum([0, *counts])
    unit = max(np.abs(own).max() * J for own, (*_, J) in zip(rows, moves, strict=True))
    upper, most, equal, ends, bounds = [], [], [], [], []
    for angle in 2 * np.pi * np.arange(FACETS) / FACETS:
        for mode in range(len(rows[0])):
            facet = np.full(width, -1.0)
            for begin, own, (count, _, _, J) in zip(begins, rows, moves, strict=False):
                facet[begin : begin + count] = (np.exp(-1j * angle) * own[mode]).real * J / unit
            upper.append(facet[np.newaxis])
            most.append([0.0])
    for begin, (count, V, A, J) in zip(begins, moves, strict=False):
        a, v, s = (m * J for m in matrices(count))
        for m, x in ((a, A), (v, V)):
            for sign in (1, -1):
                block = np.zeros((count, width))
                block[:, begin : begin + count] = sign * m / x
                upper.append(block)
                most.append(np.ones(count) if m is a or sign == 1 else np.zeros(count))
        block = np.zeros((3, width))
        block[:, begin : begin + count] = np.stack([a[-1] / A, v[-1] / V, s[-1]])
        equal.append(block)
        ends += [0.0, 0.0, 1.0]
        bounds += [(-1.0, 1.0)] * count
    cost = np.zeros(width)
    cost[-1] = 1.0
    found = linprog(
        cost, A_ub=np.vstack(upper), b_ub=np.concatenate(most), A_eq=np.vstack(equal), b_eq=ends,
        bounds=[*bounds, (0, None)], method="highs",
    )  # fmt: skip
    return found.fun * unit if found.status == 0 else None


def drawn(count):
    """Two or three axes, modes that several of them excite in either direction."""
    rng = np.random.default_rng(11)
    while count:
        moves = []
        for _ in range(rng.integers(2, 4)):
            A, T = 10 ** rng.uniform(2.5, 4.0), rng.uniform(0.02, 0.05)
            V, J = A * T * rng.uniform(0.2, 0.6), A / (T * rng.uniform(0.05, 0.25))
            today = conventional_profiles([V], [A], [J / rng.uniform(1.5, 6)])
            moves.append((int(np.ceil(today.total[0] / MS)), V, A, J))
        if not all(14 <= n <= 48 for n, *_ in moves):
            continue
        m = rng.integers(1, 3)
        f, zeta = 10 ** rng.uniform(0.9, 2.0, m), rng.choice([0.0, 0.03, 0.1], m)
        weights = rng.uniform(-1, 1, (len(moves), m))
        until = max(n for n, *_ in moves) + int(rng.choice([0, 0, 25]))
        count -= 1
        yield moves, f, zeta, weights, until


def unit_moves(moves, f, zeta, weights, band=0.0):
    """The same as the search gets them."""
    return [
        Move(n, V, A, J, mode_poles(f, zeta), own, np.arange(len(f)), band, MS)
        for (n, V, A, J), own in zip(moves, weights, strict=True)
    ]


def left_by(optima, moves, f, zeta, weights, until):
    """What the optima leave together of each mode, by quadrature."""
    left = np.zeros(len(f), dtype=complex)
    for optimum, (count, *_), own in zip(optima, moves, weights, strict=True):
        jerk = np.repeat(optimum.jerk, np.diff(optimum.knots)) / MS**3
        left += [row @ jerk for row in rows_until(until, count, f, zeta, own)]
    return np.abs(left)


def test_no_linear_programme_of_all_axes_finds_less_and_none_finds_much_more():
    above_nothing, cancelled = 0, 0
    for moves, f, zeta, weights, until in drawn(20):
        rows = [
            rows_until(until, n, f, zeta, own) for (n, *_), own in zip(moves, weights, strict=True)
        ]
        least = by_linear_programme(moves, rows)
        optima = least_together(unit_moves(moves, f, zeta, weights), until, 1e-3, 1e-9)
        assert (optima is None) == (least is None)
        if optima is None:
            continue
        found = left_by(optima, moves, f, zeta, weights, until).max()
        assert found == pytest.approx(optima[0].worst, rel=1e-6, abs=1e-11)
        assert optima[0].worst <= least * 1.02 + 1e-8
        assert optima[0].worst >= least * 0.998 - 1e-8
        above_nothing += least > 1e-6
        alone = [
            least_residual(one, 1e-3).worst for one in unit_moves(moves, f, zeta, np.abs(weights))
        ]
        cancelled += optima[0].worst < 0.9 * max(alone)
    assert above_nothing > 5, "too few of the drawn cases leave anything"
    assert cancelled > 2, "no axes that cancel what others leave"


def test_over_a_band_the_worst_is_that_of_a_dense_scan():
    band = 0.08
    for moves, f, zeta, weights, until in drawn(8):
        optima = least_together(unit_moves(moves, f, zeta, weights, band), until, 1e-3, 1e-7)
        if optima is None:
            continue
        every = np.linspace(1 - band, 1 + band, 33)
        left = [left_by(optima, moves, f * r, zeta, weights, until).max() for r in every]
        assert max(left) == pytest.approx(optima[0].worst, rel=0.01, abs=2e-9)


def corners(weights):
    """Weights as they are, and where each move excites the modes that it shares otherwise."""
    excites = weights != 0.0
    for signs in itertools.product((-1, 1), repeat=len(weights)):
        sign = np.array(signs)[:, np.newaxis]
        # Who excites it more and who less; all alike would be another mode.
        mixed = (excites & (sign > 0)).any(axis=0) & (excites & (sign < 0)).any(axis=0)
        yield np.where(mixed, weights * (1.0 + 0.2 * sign), weights)
    yield weights


def test_what_is_designed_is_judged_where_modes_are_excited_otherwise():
    more = 0
    for moves, f, zeta, weights, until in drawn(20):
        weights[0, 0] = 0.0  # of two moves, this one excites one mode alone
        given = unit_moves(moves, f, zeta, weights)
        designed = least_together(given, until, 1e-3, 1e-6, 1e-6, 1e-6)
        if designed is None:
            continue
        left = [left_by(designed, moves, f, zeta, own, until).max() for own in corners(weights)]
        assert max(left) == pytest.approx(designed[0].worst, rel=1e-3, abs=2e-6)
        bound = least_together(given, until, 1e-3, 1e-6)
        assert left[-1] >= bound[0].worst * 0.99 - 2e-6
        # What takes the file at its word leaves more there.
        others = [left_by(bound, moves, f, zeta, own, until).max() for own in corners(weights)]
        assert max(others) >= designed[0].worst * 0.98 - 3e-6
        more += max(others) > 1.1 * designed[0].worst + 1e-5
    assert more > 2, "no case where it matters"


MODES = {
    "an axis that arrives early": [{"X": 1.0}, {"Y": 0.8}],
    "a mode of both": [{"X": 1.0, "Y": -0.7}],
    "modes of both and of one": [{"X": 0.4, "Y": 1.0}, {"X": 1.0}],
}
AXIS_LIMITS = (
    "axes:\n"
    "  X: {{rapid: {{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}, limit: {{jerk: {0}e+5}}}}\n"
    "  Y: {{rapid: {{velocity: 400, acceleration: 3000, jerk: 3.0e+5}}, limit: {{jerk: {1}e+6}}}}\n"
)


def machine_of(modes, band, jerk=(7.0, 1.0)):
    """A machine whose X and Y run each on its own."""
    lines = "".join(
        f"  - {{frequency: {f}, damping: {zeta}, participation: {participation}}}\n"
        for f, zeta, participation in zip((19, 41), (0.05, 0.02), modes, strict=False)
    ).replace("'", "")
    design = f"design: {{band: {band}}}\n"
    return Machine.loads(
        f"positioning: independent\ninterval: 0.001\n{design}modes:\n{lines}"
        + AXIS_LIMITS.format(*jerk)
    )


@pytest.mark.parametrize("kind", MODES)
@pytest.mark.parametrize("band", [0.0, 0.05])
def test_no_profile_leaves_less_at_the_last_arrival_than_is_stated(kind, band):
    machine = machine_of(MODES[kind], band)
    rng = np.random.default_rng(5)
    displacement = np.zeros((10, len(AXES)))
    displacement[:, :2] = 10 ** rng.uniform(-1, 2, (10, 2)) * rng.choice([-1, 1], (10, 2))
    stated = 0
    for profile in ("conventional", "condition3", "cascade", "optimal"):
        plans = plan_moves(displacement, machine, profile)
        least = least_residuals(plans, band=band)
        left = worst_at_arrival(plans.modes, band, plans.move, plans.share, plans.profiles)
        planned = np.flatnonzero(plans.planned)
        assert len(planned)
        # A profile with segments off the grid may gain a little over the best on it.
        assert (left[planned] >= 0.97 * least[planned] - 1e-6).all(), profile
        stated += np.count_nonzero(least[planned] > 1e-4)
    assert stated, "no move with anything to be left"


def test_what_is_off_counts_in_modes_that_are_shared():
    machine = machine_of(MODES["modes of both and of one"], 0.0)
    displacement = np.zeros((3, len(AXES)))
    displacement[:, :2] = [(3.0, -5.0), (0.0, 4.0), (2.0, 1.0)]
    plans = plan_moves(displacement, machine, "conventional")
    given = plans.modes, 0.0, plans.move

    def left_with(modes, factors, off=0.0):
        share = plans.share * np.array(factors)
        return worst_at_arrival(
            replace(plans.modes, **modes), *given[1:], share, plans.profiles, off
        )

    one, both = ({"participation": plans.modes.participation[[k]], "poles": plans.modes.poles[[k]],
                  "group": np.arange(1)} for k in (1, 0))  # fmt: skip
    x = np.ones(len(AXES))
    x[0] = 1.1 / 0.9
    corner = [0.9 * left_with(both, x), 1.1 * left_with(both, 1.0 / x)]
    most = np.maximum(np.max(corner, axis=0), left_with(both, 1.0))
    # The second move is one of Y alone, and the second mode one of X alone.
    most[1] = left_with(both, 1.0)[1]
    expected = np.maximum(most, left_with(one, 1.0))
    np.testing.assert_allclose(left_with({}, 1.0, 0.1), expected, rtol=1e-9)
    assert (left_with({}, 1.0, 0.1) > 1.02 * left_with({}, 1.0)).any()


def test_every_axis_arrives_at_rest_within_its_limits():
    for moves, f, zeta, weights, until in drawn(10):
        optima = least_together(unit_moves(moves, f, zeta, weights), until, 1e-3, 1e-9)
        for optimum, (count, V, A, J) in zip(optima or [], moves, strict=False):
            a, v, s = (m @ np.repeat(optimum.jerk, np.diff(optimum.knots)) / MS**3
                       for m in matrices(count))  # fmt: skip
            assert s[-1] == pytest.approx(1.0, abs=1e-9)
            assert abs(v[-1]) < 1e-9 * V
            assert abs(a[-1]) < 1e-9 * A
            profile = optimum_profiles([optimum], MS)
            assert profile.peak_velocity[0] <= V * (1 + 1e-6)
            assert profile.least_velocity[0] >= -1e-6 * V
            assert profile.peak_acceleration[0] <= A * (1 + 1e-6)
            assert profile.greatest_jerk[0] <= min(J, A / MS) * (1 + 1e-6)


def test_every_axis_keeps_its_own_guard():
    # Of modes that nobody named nobody knows how axes add up: each keeps to its own rapid of today.
    gained, broken = 0, 0
    for moves, f, zeta, weights, until in drawn(10):
        todays = [conventional_profiles([V], [A], [J]).general() for _, V, A, J in moves]
        counts = [int(np.ceil(today.total[0] / MS - 1e-6)) for today in todays]
        until = max(until, *counts)
        guarded = [
            replace(move, count=n, jerk=8 * move.jerk, today=today, guard=1.0)
            for move, n, today in zip(
                unit_moves(moves, f, zeta, weights, 0.05), counts, todays, strict=True
            )
        ]
        reference = 1e-3
        optima = least_together(guarded, until, reference, 1e-5, 1e-5, 1e-5)
        free = least_together(
            [replace(m, guard=0.0) for m in guarded], until, reference, 1e-5, 1e-5, 1e-5
        )
        if optima is None:
            continue
        # Slack and tolerances of the search beside it.
        assert free[0].worst <= optima[0].worst * 1.02 + 2e-5
        for move, own, loose, signed in zip(guarded, optima, free, weights, strict=True):
            omega = guarded_frequencies(move.poles[signed != 0.0], 0.05, MS, move.count * MS)
            for w in omega[:: max(1, len(omega) // 12)]:
                near = np.linspace(0.85 * w, 1.15 * w, 201)
                halves = split_at_peak(move.today)
                most = sum(undamped_response(half, near) for half in halves).max()
                kept, unguarded = (
                    oscillator(w, acceleration(optimum_profiles([x], MS), 1e4)[1], 1e-4)
                    for x in (own, loose)
                )
                assert kept <= 1.02 * most
                broken += unguarded > 1.05 * most
        gained += 1
    assert gained > 4, "too few of the drawn cases have a guarded optimum"
    assert broken > 10, "no guard that costs anything"


def test_axes_that_share_a_mode_are_designed_together(monkeypatch):
    machine = machine_of(MODES["a mode of both"], 0.05, (40.0, 3.0))
    rng = np.random.default_rng(8)
    displacement = np.zeros((6, len(AXES)))
    displacement[:, :2] = 10 ** rng.uniform(-0.5, 1, (6, 2)) * rng.choice([-1, 1], (6, 2))
    together = plan_moves(displacement, machine, "optimal")
    monkeypatch.setattr("gcodejerk.planning.plan.joint_optima", lambda *given: (given[4], given[5]))
    apart = plan_moves(displacement, machine, "optimal")
    assert together.planned.all()
    np.testing.assert_array_equal(together.counts, apart.counts)
    left = {}
    # As the file has it; and where X excites the mode less, or more, than it says.
    for factor in (1.0, 0.8, 1.2):
        for name, plans in (("together", together), ("apart", apart)):
            left[name, factor] = np.full(len(displacement), np.nan)
            left[name, factor][np.unique(plans.move)] = [
                max(left_at_arrival(plans, move, scale, factor) for scale in (0.95, 1.0, 1.05))
                for move in np.unique(plans.move)
            ]
        known = np.isfinite(left["apart", factor])
        ratio = left["together", factor][known] / left["apart", factor][known]
        assert np.median(ratio) < 0.7
        assert ratio.max() <= (1.01 if factor == 1.0 else 1.05)
    np.testing.assert_allclose(
        left["together", 1.0], together.worst_in_band, rtol=0.03, atol=1e-6
    )  # fmt: skip


def left_at_arrival(plans, move, scale, factor):
    """What a move leaves of the one mode when its last axis has arrived, by integration.

    `scale`: of the mode's frequency; `factor`: of how strongly X excites it.
    """
    rows = plans.profiles_of(move)
    dt, total = 1e-5, plans.counts[move] * MS
    a = np.zeros(round(total / dt))
    for row in rows:
        own = acceleration(plans.profiles.take(np.array([row])), 1 / dt)[1]
        weights = plans.share[row] * plans.modes.participation[0]
        a[: len(own)] += own * float(weights[0] * factor + weights[1:].sum())
    pole = plans.modes.poles[0] * scale
    # x'' + 2 zeta w x' + w^2 x = -a, by its own exponential.
    omega = abs(pole)
    system = np.array([[0.0, 1.0], [-(omega**2), 2 * pole.real]]), np.array([[0.0], [-1.0]])
    step, push, *_ = cont2discrete((*system, np.eye(2), np.zeros((2, 1))), dt)
    state = np.zeros(2)
    for value in a:
        state = step @ state + push[:, 0] * value
    return float(abs(state[1] - np.conj(pole) * state[0]) / pole.imag)


@pytest.mark.parametrize("band", [0.0, 0.03])
def test_long_blocks_do_not_hide_that_there_is_a_bound(band):
    # At nearly the least acceleration that arrives in time no long block fits the turning point.
    machine = Machine.loads(
        "positioning: independent\ninterval: 0.002\ndesign: {guard: 0}\nmodes:\n"
        "  - {frequency: 18.678, damping: 0.0, participation: {Y: 0.244, Z: -0.424}}\naxes:\n"
        "  Y: {rapid: {velocity: 478.2, acceleration: 4075.8, jerk: 1116226.8}, "
        "limit: {jerk: 4871764.1}}\n"
        "  Z: {rapid: {velocity: 94.7, acceleration: 1689.5, jerk: 350313.7}, "
        "limit: {jerk: 2196670.4}}\n"
    )
    displacement = np.zeros((1, len(AXES)))
    displacement[0, [AXES.index("Y"), AXES.index("Z")]] = 1.14565594, -26.12927806
    plans = plan_moves(displacement, machine, "condition3")
    least = least_residuals(plans, band=band)
    assert np.isfinite(least).all()
    left = worst_at_arrival(plans.modes, band, plans.move, plans.share, plans.profiles)
    assert (least <= left).all()
