"""Promises of planned streams, over drawn machines and moves."""

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.motion import sample_profiles
from gcodejerk.planning.move import plan_move
from gcodejerk.testing import assert_stream_valid, machines, moves

# A machine is a large thing to shrink: minutes for a smaller example that says no more.
PHASES = (Phase.explicit, Phase.reuse, Phase.generate)
slow = settings(
    max_examples=9, deadline=None, phases=PHASES, suppress_health_check=list(HealthCheck)
)


@st.composite
def cases(draw, **kwargs):
    machine = draw(machines(**kwargs))
    return machine, draw(moves(machine))


def plan_or_skip(case, profile=None):
    machine, move = case
    try:
        plan = plan_move(move, machine, profile)
    except PlanError as error:
        assume("not planned" not in str(error) and "segments of at least" not in str(error))
        raise
    assume(plan.planned)
    return plan


def simulate(t, q, omega, zeta):
    """Envelope after arrival of q'' + 2 z w q' + w^2 q = -a, stepped through the samples.

    Shares no code with the package: the polyline's velocity steps kick a mode that is turned by
    its transition matrix from one sample to the next.
    """
    turn = expm(np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]]) * (t[1] - t[0]))
    state = np.zeros(2)
    velocity = np.diff(q) / (t[1] - t[0])
    for step in np.diff(velocity, prepend=0.0, append=0.0):
        state = turn @ state - np.array([0.0, step])
    x, v = state
    return np.hypot(x, (v + zeta * omega * x) / (omega * np.sqrt(1.0 - zeta**2)))


@given(cases(), st.sampled_from((None, "conventional")))
@slow
def test_every_stream_ends_exactly_and_keeps_line_direction_and_limits(case, profile):
    plan = plan_or_skip(case, profile)
    assert_stream_valid(plan, plan.machine)
    for axis, q in plan.positions.items():
        assert q[0] == 0.0
        assert q[-1] == pytest.approx(plan.displacement.get(axis, 0.0), abs=1e-12)


@given(cases())
@slow
def test_no_stream_takes_longer_than_the_conventional_time_but_where_limits_leave_no_room(case):
    plan = plan_or_skip(case)
    machine = plan.machine
    whole = np.ceil(plan.conventional_time / machine.interval - 1e-6) * machine.interval
    assert (
        plan.time <= plan.conventional_time * (1 + machine.design.max_extension) + machine.interval
    )
    jerk_limited = all(np.isfinite(axis.rapid.jerk) for axis in machine.axes)
    if jerk_limited:
        assert plan.time == pytest.approx(whole, abs=1e-9)


@given(cases())
@settings(slow, max_examples=6)
def test_residual_of_a_stream_is_that_of_a_simulated_mode(case):
    plan = plan_or_skip(case)
    modes = plan.plans.modes
    for m, mode in enumerate(modes.modes):
        driven = sum(
            q * modes.participation[m, AXES.index(axis)] for axis, q in plan.positions.items()
        )
        expected = simulate(plan.t, driven, 2 * np.pi * mode.frequency, mode.damping)
        size = np.abs(driven).max() + 1e-9
        assert plan.residual[0, m] == pytest.approx(expected, rel=1e-6, abs=1e-9 * size)


def worst_in_band(machine, positions, dt):
    """Largest residual displacement of straight lines between points, over the modes' bands."""
    velocity = np.diff(positions, axis=0) / dt
    kicks = np.diff(velocity, axis=0, prepend=0.0, append=0.0)
    left = np.arange(len(positions))[::-1] * dt
    band, largest = machine.design.band, 0.0
    for _, mode in machine.all_modes():
        driven = kicks @ [mode.participation_of(axis) for axis in AXES]
        for f in mode.frequency * np.linspace(1.0 - band, 1.0 + band, 101 if band else 1):
            omega = 2.0 * np.pi * f
            damped = omega * np.sqrt(1.0 - mode.damping**2)
            turned = np.exp(complex(-mode.damping * omega, damped) * left)
            largest = max(largest, abs(driven @ turned) / damped)
    return largest


@pytest.mark.parametrize("part", range(2))  # for as many cores
@given(case=cases(jerk_limited=True))
@settings(slow, max_examples=5)
def test_no_stream_leaves_more_than_the_conventional_one(part, case):
    plan = plan_or_skip(case)
    plans, dt = plan.plans, plan.machine.interval
    written = np.column_stack([plan.positions.get(axis, np.zeros(len(plan.t))) for axis in AXES])
    count = np.ceil(plans.conventional.total.max() / dt - 1e-6)
    moments = np.tile(np.arange(count + 1, dtype=np.int64), (len(plans.share), 1))
    unit, _ = sample_profiles(plans.conventional, moments, dt)
    left, today = (
        worst_in_band(plan.machine, positions, dt) for positions in (written, unit.T @ plans.share)
    )
    # Judged at other frequencies than these, to 0.5 %.
    assert left <= today * 1.005 + 1e-9


@pytest.fixture
def rewritten():
    """Moves with a profile of their own; that there were some is asserted at the end."""
    moves = []
    yield moves
    assert moves, "all drawn moves are left alone"


@pytest.mark.parametrize("part", range(2))  # for as many cores
@given(case=cases(jerk_limited=True, positioning="linear"))
@settings(slow, max_examples=5)
def test_segments_add_up_to_the_time_and_to_the_length(part, rewritten, case):
    plan = plan_or_skip(case)
    position = velocity = acceleration = 0.0
    total = 0.0
    rewritten.append(case)
    for d, j in plan.profiles.segments(0):
        position += velocity * d + acceleration * d**2 / 2 + j * d**3 / 6
        velocity += acceleration * d + j * d**2 / 2
        acceleration += j * d
        total += d
        assert d >= plan.machine.interval * (1 - 1e-9)
    assert position == pytest.approx(1.0, rel=1e-9)
    assert abs(velocity) * total < 1e-9
    assert abs(acceleration) * total**2 < 1e-8
    assert total <= plan.time + 1e-9
