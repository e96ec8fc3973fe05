"""Guarded optima of long moves, against a programme with a jerk in every interval."""

from dataclasses import replace

import numpy as np
import pytest
from fine_programme import least
from test_motion_guard import MS, today_of

from gcodejerk.motion import conventional_profiles, mode_poles
from gcodejerk.motion.profiles.profile import Profiles
from gcodejerk.motion.search.optimal import least_residual, near_least
from gcodejerk.motion.search.unit_move import Move, optimum_profiles

LONGEST = 240


def drawn(count, seed, jerk=(1.0, 20.0)):
    """Moves of more intervals than are solved in every one at once, that cannot be left still."""
    random = np.random.default_rng(seed)
    while count:
        A = 10 ** random.uniform(2.5, 4.5)
        T = random.uniform(0.06, 0.2)
        V = A * T * random.uniform(0.1, 0.5)
        J = A / (T * random.uniform(0.05, 0.25))
        today = conventional_profiles([V], [A], [J])
        n = int(np.ceil(today.total[0] / MS - 1e-6))
        if not 129 <= n <= LONGEST:
            continue
        m = random.integers(1, 4)
        f = 10 ** random.uniform(0.9, 2.0, m)
        zeta = random.choice([0.0, 0.01, 0.03], m)
        move = Move(
            n, V, random.choice([1.0, 1.2]) * A, J * random.uniform(*jerk),
            mode_poles(f, zeta), 10 ** random.uniform(-1, 0, m), np.arange(m),
            random.choice([0.05, 0.1]), MS, today.general(), 1.0,
        )  # fmt: skip
        free = least_residual(replace(move, guard=0.0), today_of(move))
        if free is None or free.worst < 0.02 * today_of(move):
            continue
        count -= 1
        yield move


@pytest.mark.parametrize("part", range(6))
def test_a_long_move_is_left_with_no_more_than_jerks_in_every_interval_leave(part):
    for move in drawn(2, seed=part):
        today = today_of(move)
        slack = 0.01 * today
        optimum = near_least(move, slack, 1e-4 * today, today)
        finest = least(move, today)
        # The guard is kept to a percent, so a little less may be left than by who keeps it.
        assert optimum.worst >= (0.97 * finest) * today
        # Guarded frequencies are cut at 0.99 of what they may keep, and long blocks lose some, too.
        assert optimum.worst <= 1.09 * finest * today + slack, (move.count, len(optimum.jerk))


def trapezoid(ramp, cruise):
    """A unit profile of constant accelerations."""
    a = 1.0 / (ramp * (ramp + cruise))
    acceleration = np.array([a, 0.0, -a])
    return Profiles.of(
        np.array([0, 3]), np.array([ramp, cruise, ramp]), acceleration, np.zeros(3)
    )  # fmt: skip


def test_a_residual_that_does_not_matter_is_not_paid_for_with_jerk_that_short_blocks_save():
    today = trapezoid(0.3, 0.4718366666666666)
    J = 8637.406014225808
    move = Move(
        1072, 1.2956109021338713, 10.36488721707097, J, mode_poles([55.0], [0.03]), np.ones(1),
        np.arange(1), 0.05, MS, today, 1.0,
    )  # fmt: skip
    allowed = 4.318703007112904e-07
    optimum = near_least(move, allowed, 10.0 * allowed, 4.116559465323134e-05)
    assert optimum.worst <= allowed
    # What short blocks need; as long as the first ones are, they need 0.6.
    assert np.abs(optimum.jerk).max() <= 0.01 * J * MS**3


def test_where_the_velocity_binds_and_little_jerk_is_needed_it_is_not_exceeded():
    today = trapezoid(0.24, 0.26007333333333333)
    V = 1.99970670968258
    f, zeta = [55.0, 42.0, 30.0, 50.0, 90.0, 110.0], [0.03, 0.02, 0.02, 0.02, 0.03, 0.03]
    weights = np.array([1.4664515871e-4, 2.1750809881e-2, 1.0, 0.15, 0.3, 0.2])
    move = Move(
        741, V, 10.0 * V, 16664.222580688165, mode_poles(f, zeta), weights, np.arange(6), 0.05, MS,
        today, 1.0,
    )  # fmt: skip
    optimum = near_least(
        move, 3.442575643556342e-06, 3.3328445161376333e-06, 3.4425756435563416e-4
    )  # fmt: skip
    profile = optimum_profiles([optimum], MS)
    assert profile.peak_velocity[0] <= V * (1.0 + 1e-6)
