"""Streams: whole steps, exact ends, and the residual of exactly what is written."""

from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import polyline_response, sample_profiles
from gcodejerk.planning import stream
from gcodejerk.planning.batch import NumberFormat
from gcodejerk.planning.move import plan_move
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.stream import FINE_DECIMALS, make_streams
from gcodejerk.reasons import CERTAIN, REASONS, Reason

MACHINE = Machine.loads(
    """
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 0.001
    rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}
    modes: [{frequency: 41, damping: 0.03, participation: 0.5}]
  Z:
    resolution: 0.001
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
    modes: [{frequency: 30, damping: 0.02}]
modes: [{frequency: 13, damping: 0.01, participation: {X: 0.2, Z: -0.3}}]
"""
)
INDEPENDENT = Machine.loads(
    "interval: 0.001\npositioning: independent\naxes:\n"
    "  X: {resolution: 0.001, rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}}\n"
    "  Z: {resolution: 0.001, rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}}\n"
    "modes: [{frequency: 33, damping: 0.01, participation: {X: 0.2, Z: -0.3}}]\n"
)
X, Z = AXES.index("X"), AXES.index("Z")


def drawn_moves(count, seed=1):
    """Displacements of X and Z, some of them of one axis only."""
    rng = np.random.default_rng(seed)
    out, resting = np.zeros((count, len(AXES))), rng.integers(0, 3, count)
    for k, axis in enumerate((X, Z)):
        size = 10 ** rng.uniform(-1, 2.3, count) * rng.choice([-1.0, 1.0], count)
        out[:, axis] = np.where(resting == k, 0.0, size)
    return out


def spelling_of(displacement, start=0.0, step=0.001, origin=0.0):
    """The same step and origin for all axes."""
    shape = displacement.shape
    return NumberFormat(
        *(np.broadcast_to(np.asarray(x, float), shape) for x in (start, step, origin))
    )


def by_move(batches):
    """The batch and row of each move."""
    return {int(move): (batch, k) for batch in batches for k, move in enumerate(batch.moves)}


def streams(displacement, machine=MACHINE, stride=1, profile=None, **number_format):
    """All batches of some moves."""
    plans = plan_moves(displacement, machine, profile)
    windows = make_streams(plans, spelling_of(displacement, **number_format), stride)
    return [batch for window in windows for batch in window]


def one_batch(displacement, machine=MACHINE, stride=1, profile=None, **number_format):
    """All planned moves in one batch, short ones behind much padding."""
    plans = plan_moves(displacement, machine, profile)
    moves = np.nonzero(plans.planned)[0]
    return stream.make_batch(plans, moves, spelling_of(displacement, **number_format), stride)


@pytest.mark.parametrize("machine", [MACHINE, INDEPENDENT], ids=["linear", "independent"])
@pytest.mark.parametrize("stride", [1, 2])
def test_points_are_whole_steps_between_exact_ends(machine, stride):
    displacement = drawn_moves(30)
    start = np.random.default_rng(2).uniform(-9, 9, displacement.shape)
    batch = one_batch(displacement, machine, stride, start=start)
    assert len(batch) > 20
    for row, move in enumerate(batch.moves):
        t, q = batch.positions(row)
        np.testing.assert_allclose(q[0], start[move], atol=0)
        np.testing.assert_allclose(q[-1], start[move] + displacement[move], atol=0)
        assert t[0] == 0.0
        assert t[-1] == pytest.approx(batch.plans.counts[move] * 0.001)
        assert np.diff(t).min() >= stride * 0.001 - 1e-9
        for axis in (X, Z):
            if displacement[move, axis] == 0.0:
                assert (q[:, axis] == start[move, axis]).all()
                continue
            steps = q[1:-1, axis] / 0.001
            np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)
            assert (np.diff(q[:, axis]) * np.sign(displacement[move, axis]) >= -1e-9).all()


@pytest.mark.parametrize("machine", [MACHINE, INDEPENDENT], ids=["linear", "independent"])
def test_the_residual_is_that_of_the_points_as_written(machine):
    displacement = drawn_moves(12, seed=5)
    batch = one_batch(displacement, machine, start=0.00037)
    modes = batch.plans.modes
    assert len(batch) > 8
    for row in range(len(batch)):
        t, q = batch.positions(row)
        driven = q @ modes.participation.T
        for m, pole in enumerate(modes.poles):
            D = abs(polyline_response(t, driven[:, m], modes.poles[m : m + 1])[0]) / pole.imag
            assert float(batch.residual[row, m]) == pytest.approx(float(D), rel=1e-7, abs=1e-9)


def test_the_conventional_residual_is_that_of_the_controller_s_samples():
    displacement = drawn_moves(12, seed=6)
    batch = one_batch(displacement, INDEPENDENT)
    plans, modes = batch.plans, batch.plans.modes
    assert len(batch) >= 6
    for row, move in enumerate(batch.moves):
        profiles = list(plans.profiles_of(move))
        counts = [int(np.ceil(plans.conventional.total[k] / 0.001 - 1e-6)) for k in profiles]
        moments = np.arange(max(counts) + 1)
        driven = np.zeros(len(moments))
        for k in profiles:
            unit, _ = sample_profiles(
                plans.conventional.take(slice(k, k + 1)), moments[np.newaxis], 1e-3
            )
            driven += unit[0] * (plans.share[k] @ modes.participation[0])
        D = np.abs(polyline_response(moments * 1e-3, driven, modes.poles)) / modes.poles.imag
        assert float(batch.conventional_residual[row, 0]) == pytest.approx(float(D[0]), rel=1e-7)


def test_velocities_are_those_of_the_profile():
    batch = one_batch(drawn_moves(10, seed=7))
    for axis, velocity in batch.velocity.items():
        for row in range(len(batch)):
            t, _ = batch.positions(row)
            n = len(t)
            q, v = batch.exact[axis][row, -n:], velocity[row, -n:]
            slope, mean = np.diff(q) / np.diff(t), 0.5 * (v[1:] + v[:-1])
            # The acceleration changes within an interval by no more than the jerk allows.
            np.testing.assert_allclose(slope, mean, atol=5e6 * 1e-6)


@pytest.mark.parametrize("machine", [MACHINE, INDEPENDENT], ids=["linear", "independent"])
@pytest.mark.parametrize("samples", [1, 500, 2000])
def test_many_small_batches_are_the_same_as_one(machine, samples, monkeypatch):
    displacement = drawn_moves(25, seed=3)
    displacement[4] = 0.0
    whole = by_move(streams(displacement, machine, 2))
    monkeypatch.setattr(stream, "WINDOW_SAMPLES", samples)
    parts = streams(displacement, machine, 2)
    assert len(parts) > 3
    assert samples > 1 or {len(part) for part in parts} == {1}
    made = by_move(parts)
    assert sorted(made) == sorted(whole)
    assert len(made) > 15
    assert 4 not in made
    for move, (part, k) in made.items():
        other, row = whole[move]
        (t, q), (expected_t, expected_q) = part.positions(k), other.positions(row)
        np.testing.assert_array_equal(t, expected_t)
        np.testing.assert_array_equal(q, expected_q)
        np.testing.assert_allclose(part.residual[k], other.residual[row], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(
            part.conventional_residual[k], other.conventional_residual[row], rtol=1e-6
        )
        assert part.worst_in_band[k] == pytest.approx(other.worst_in_band[row], rel=1e-6)


def test_a_window_holds_about_as_many_samples_as_it_may(monkeypatch):
    monkeypatch.setattr(stream, "WINDOW_SAMPLES", 3000)
    displacement = drawn_moves(60, seed=8)
    plans = plan_moves(displacement, MACHINE)
    last = -1
    for window in make_streams(plans, spelling_of(displacement), 1):
        moves = np.sort(np.concatenate([batch.moves for batch in window]))
        assert len(moves) == 1 or plans.counts[moves].sum() <= 3000
        assert moves[0] > last, "windows come in the order of the moves"
        last = moves[-1]
        for batch in window:
            counts = plans.counts[batch.moves]
            assert counts.max() < 2 * counts.min(), "a batch is a matrix of little padding"


def test_moves_that_are_not_planned_have_no_stream():
    displacement = drawn_moves(4)
    reason = np.full(4, CERTAIN, np.uint8)
    reason[[0, 2]] = REASONS.index(Reason.EXPRESSION)
    plans = plan_moves(displacement, MACHINE, reason=reason)
    windows = list(make_streams(plans, spelling_of(displacement), 1))
    assert sorted(m for (*batches,) in windows for b in batches for m in b.moves) == [1, 3]
    reason[:] = REASONS.index(Reason.EXPRESSION)
    plans = plan_moves(displacement, MACHINE, reason=reason)
    assert list(make_streams(plans, spelling_of(displacement), 1)) == []


def test_an_axis_that_moves_a_few_steps_is_written_finer():
    displacement = np.zeros((2, len(AXES)))
    displacement[:, X], displacement[:, Z] = 20.0, (0.0079, 0.0081)
    batch = one_batch(displacement)
    assert batch.fine[:, Z].tolist() == [True, False]
    assert not batch.fine[:, X].any()
    step = 0.001 / 10**FINE_DECIMALS
    _, q = batch.positions(0)
    np.testing.assert_allclose(q[1:-1, Z] / step, np.rint(q[1:-1, Z] / step), atol=1e-5)
    assert len(np.unique(q[:, Z])) > 20
    assert len(np.unique(batch.positions(1)[1][:, Z])) <= 10


def test_increments_are_counted_from_the_start():
    displacement = drawn_moves(5, seed=9)
    start = np.full(displacement.shape, 1.23456)
    batch = one_batch(displacement, start=start, origin=start)
    assert len(batch) > 2
    for row in range(len(batch)):
        _, q = batch.positions(row)
        for axis in (X, Z):
            steps = (q[1:-1, axis] - 1.23456) / 0.001
            np.testing.assert_allclose(steps, np.rint(steps), atol=1e-6)


def test_an_axis_that_stands_at_an_unknown_place_spoils_nothing():
    displacement = np.zeros((2, len(AXES)))
    displacement[0, X], displacement[1, Z] = 5.0, -3.0
    start = np.zeros(displacement.shape)
    start[0, Z] = start[1, X] = np.nan
    batch = one_batch(displacement, start=start)
    assert np.isfinite(batch.residual).all()
    _, q = batch.positions(0)
    assert np.isfinite(q[:, X]).all()
    assert np.isnan(q[:, Z]).all()


def test_a_move_that_rounding_spoils_is_taken_out_of_the_plan():
    # Steps of 1 mm: whatever was designed, the rounding decides, and never for the worse.
    displacement = np.zeros((40, len(AXES)))
    displacement[:, Z] = np.linspace(9.0, 60.0, 40)
    plans = plan_moves(displacement, MACHINE)
    assert plans.planned.all()
    (batches,) = make_streams(plans, spelling_of(displacement, step=1.0), 1)
    written = np.concatenate([batch.moves for batch in batches])
    assert 0 < len(written) < 40
    assert sorted(written) == np.flatnonzero(plans.planned).tolist()
    assert {REASONS[r] for r in plans.reason[~plans.planned]} == {Reason.NOT_BETTER}
    for batch in batches:
        assert (batch.worst_in_band <= plans.most_in_band[batch.moves]).all()


@pytest.mark.parametrize("machine", [MACHINE, INDEPENDENT], ids=["linear", "independent"])
def test_what_is_written_is_better_at_every_frequency_of_the_band(machine):
    displacement = drawn_moves(20, seed=11)
    for batch in streams(displacement, machine):
        modes = batch.plans.modes
        for row, move in enumerate(batch.moves):
            t, q = batch.positions(row)
            driven = (q - q[0]) @ modes.participation.T
            rows = list(batch.plans.profiles_of(move))
            today = batch.plans.conventional.take(np.array(rows))
            end = np.ceil(today.total.max() / 0.001 - 1e-6)
            unit, _ = sample_profiles(
                today, np.tile(np.arange(end + 1, dtype=np.int64), (len(rows), 1)), 1e-3
            )
            usual = unit.T @ batch.plans.share[rows] @ modes.participation.T
            left = np.zeros((2, len(modes.poles)))
            for m, pole in enumerate(modes.poles):
                around = pole * np.linspace(0.9, 1.1, 401)
                for k, (moments, moved) in enumerate(
                    ((t, driven), (np.arange(end + 1) * 1e-3, usual))
                ):
                    response = polyline_response(moments, moved[:, m], around)
                    left[k, m] = (np.abs(response) / around.imag).max()
            assert left[0].max() < left[1].max(), displacement[move]
            assert left[0].max() <= 1.02 * batch.worst_in_band[row] + 1e-5
            assert left[1].max() == pytest.approx(batch.plans.most_in_band[move], rel=0.03)


def test_a_conventional_profile_reaches_its_end_before_the_last_interval_has_passed():
    displacement = np.zeros((1, len(AXES)))
    displacement[0, Z] = 1.07
    batch = one_batch(displacement, profile="conventional")
    t, q = batch.positions(0)
    assert t[-1] == pytest.approx(np.ceil(float(batch.plans.conventional_time[0]) * 1e3) / 1e3)
    assert q[-1, Z] == 1.07


def test_of_independent_axes_one_may_keep_what_it_has_while_another_gains():
    axis = "rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}"
    machine = Machine.loads(
        "interval: 0.001\npositioning: independent\naxes:\n"
        f"  X: {{{axis}}}\n"
        f"  Z: {{{axis}, modes: [{{frequency: 30, damping: 0.02}}]}}\n"
    )
    plan = plan_move({"X": 5.0, "Z": 1.0}, machine)
    # X shakes nothing and keeps its profile; Z does not.
    designed, usual = plan.plans.profiles, plan.plans.conventional
    assert [designed.segments(k) == usual.segments(k) for k in range(2)] == [True, False]
    assert plan.profile == "condition3"
    assert plan.residual.max() < 0.5 * plan.conventional_residual.max()


def test_a_conventional_profile_that_does_not_fit_the_time_is_never_written():
    # Steps of 0.3 mm spoil the design; the conventional profile takes 58 ms and would be cut off.
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  Z: {resolution: 0.1, "
        "rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}, limit: {acceleration: 20000}, "
        "modes: [{frequency: 170, damping: 0.0}]}\n"
    )
    # Such steps are refused in a file.
    machine = replace(machine, axes=(replace(machine.axes[0], resolution=0.3),))
    plan = plan_move({"Z": 3.0}, machine, time=0.045)
    assert plan.residual.max() > plan.conventional_residual.max()
    assert plan.profile == "condition3"
    t, q = plan.t, plan.positions["Z"]
    assert t[-1] == pytest.approx(0.045)
    assert np.abs(np.diff(q)).max() < 0.7


def test_shortest_is_written_only_where_rounding_leaves_it_within_the_tolerance():
    machine = replace(
        MACHINE, design=replace(MACHINE.design, tolerance=0.002),
        axes=tuple(replace(axis, resolution=0.01) for axis in MACHINE.axes),
    )  # fmt: skip
    displacement = drawn_moves(4, seed=4)
    plans = plan_moves(displacement, machine, "shortest")
    planned = plans.planned.copy()
    written = [batch for window in make_streams(plans, spelling_of(displacement, step=0.01), 1)
               for batch in window]  # fmt: skip
    assert {REASONS[r] for r in plans.reason[planned & ~plans.planned]} == {Reason.NOT_BETTER}
    modes = plans.modes
    for batch in written:
        for row in range(len(batch.moves)):
            t, q = batch.positions(row)
            driven = (q - q[0]) @ modes.participation.T
            for m, pole in enumerate(modes.poles):
                response = polyline_response(t, driven[:, m], pole * np.linspace(0.9, 1.1, 201))
                left = np.abs(response) / (pole.imag * np.linspace(0.9, 1.1, 201))
                assert left.max() <= 1.1 * 0.002 * 1.01
