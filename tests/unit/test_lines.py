"""Straight lines between written points: what modes keep of them, by another way."""

import numpy as np
import pytest
from scipy.linalg import expm

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.motion import Grid
from gcodejerk.planning.batch import NumberFormat
from gcodejerk.planning.lines import Play, block_times, missing_times, played_positions
from gcodejerk.planning.move import plan_move
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.stream import make_streams

MACHINE = Machine.loads(
    """
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 0.001
    rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}
    modes: [{frequency: 41, damping: 0.03, participation: 0.5}, {frequency: 240, damping: 0.0}]
  Z:
    resolution: 0.001
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
    modes: [{frequency: 30, damping: 0.1}]
modes: [{frequency: 13, damping: 0.01, participation: {X: 0.2, Z: -0.3}}]
"""
)
X, Z = AXES.index("X"), AXES.index("Z")


def batches(rows, play, stride=2, step=0.001, machine=MACHINE):
    """Streams of moves of X and Z."""
    displacement = np.zeros((len(rows), len(AXES)))
    displacement[:, [X, Z]] = rows
    spelled = NumberFormat(*(np.full(displacement.shape, x) for x in (0.0, step, 0.0)))
    plans = plan_moves(displacement, machine)
    return [b for window in make_streams(plans, spelled, stride, play) for b in window]


def kept(velocity, durations, frequency, damping):
    """Envelope of an oscillator behind a staircase of velocity, step by step by expm."""
    omega = 2.0 * np.pi * frequency
    system = np.array([[0.0, 1.0], [-(omega**2), -2.0 * damping * omega]])
    state, before = np.zeros(2), 0.0
    for v, duration in zip(velocity, durations, strict=True):
        state[1] -= v - before
        state, before = expm(system * duration) @ state, v
    state[1] += before
    damped = omega * np.sqrt(1.0 - damping**2)
    return float(np.hypot(state[0], (state[1] + damping * omega * state[0]) / damped))


def played(batch, row):
    """Durations and velocities of the blocks of one stream as a control runs it that holds F."""
    t, q = batch.positions(row)
    way = np.diff(q[:, [X, Z]], axis=0)
    moves = np.flatnonzero(np.abs(way).any(axis=1))
    durations = np.diff(np.concatenate([[t[moves[0]]], t[moves + 1]]))
    return durations, way[moves] / durations[:, np.newaxis]


@pytest.mark.parametrize("step", [1e-4, 1e-3, 0.05])
def test_what_is_left_is_what_an_oscillator_keeps_of_the_staircase(step):
    rng = np.random.default_rng(4)
    rows = 10 ** rng.uniform(-0.5, 2, (12, 2)) * rng.choice(
        [-1.0, 0.0, 1.0], (12, 2), p=[0.4, 0.2, 0.4]
    )
    seen = 0
    for batch in batches(rows[(rows != 0.0).any(axis=1)], Play.HELD, step=step):
        modes = [mode for _, mode in MACHINE.all_modes()]
        for row in range(len(batch)):
            durations, velocity = played(batch, row)
            seen += 1
            worst = 0.0
            for m, mode in enumerate(modes):
                share = np.array([mode.participation_of(a) for a in "XZ"])
                left = kept(velocity @ share, durations, mode.frequency, mode.damping)
                assert float(batch.residual[row, m]) == pytest.approx(left, rel=1e-6, abs=1e-9)
                around = mode.frequency * np.linspace(0.9, 1.1, 7)
                worst = max(
                    worst, *(kept(velocity @ share, durations, f, mode.damping) for f in around)
                )
            # The band is judged to 0.5 %, and at more frequencies than these.
            assert worst <= 1.005 * batch.worst_in_band[row] + 1e-9
            assert batch.worst_in_band[row] <= batch.plans.most_in_band[batch.moves[row]]
    assert seen >= 5


def test_blocks_without_length_are_skipped_at_the_ends_and_made_up_for_in_the_middle():
    grid = Grid.every(np.array([12, 4]), 2, 0.001)
    q = np.array([[0.0, 0.0, 1.0, 1.0, 3.0, 4.0, 4.0], [0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0]])
    moved = np.diff(q, axis=1, prepend=0.0) > 0.0
    times = block_times(moved, grid)
    assert times.tolist() == [[0, 0, 2, 0, 4, 2, 0], [0, 0, 0, 0, 0, 2, 2]]
    assert missing_times(times, grid).tolist() == [2, 0]
    assert played_positions(q, times, grid)[0].tolist() == [0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 4.0]
    assert played_positions(q, times, grid)[1].tolist() == q[1].tolist()


def test_a_plan_is_judged_in_the_form_of_its_control_and_has_a_point_for_every_interval():
    move = {"X": 40.0, "Z": -20.0}
    table = plan_move(move, MACHINE)
    held = plan_move(move, MACHINE, stride=2, play=Play.HELD)
    assert held.planned
    np.testing.assert_array_equal(held.t, table.t)
    np.testing.assert_array_equal(held.positions["X"], table.positions["X"])
    (batch,) = batches([[40.0, -20.0]], Play.HELD)
    np.testing.assert_array_equal(held.residual, batch.residual)
    assert abs(held.residual[0, 1] - table.residual[0, 1]) > 5e-4
