"""Moves that are easily shown to be perfectly still, against a linear programme of any profile."""

from dataclasses import replace

import numpy as np
import pytest
from test_motion_optimal import MS, by_linear_programme, drawn_cases, rows_of

from gcodejerk import Machine
from gcodejerk.machine import find_machine
from gcodejerk.motion import mode_poles
from gcodejerk.motion.search.nulls import easily_still, keep_limits
from gcodejerk.planning import bounds
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task


def is_still(count, V, A, J, frequencies, damping):
    """Of one move alone."""
    limits = (np.array([x]) for x in (V, A, J))
    poles = mode_poles(frequencies, np.array(damping))
    return bool(easily_still(np.array([count]), *limits, poles, MS)[0])


def test_what_is_still_can_be_found_by_a_linear_programme_too():
    found, possible = 0, 0
    for case in drawn_cases(60):
        *move, f, zeta, weights = case
        least = by_linear_programme(*move, rows_of(move[0], f, zeta, weights))
        null = least is not None and least < 1e-9
        still = is_still(*move, f, zeta)
        assert null or not still, case
        found, possible = found + still, possible + null
    assert found > 0.9 * possible > 9


@pytest.mark.parametrize(
    ("limits", "still"),
    [
        ((16.0, 3000.0, 1e6), True),
        ((12.0, 3000.0, 1e6), False),  # 1 mm takes more velocity than that
        ((40.0, 750.0, 1e6), True),
        ((40.0, 600.0, 1e6), False),  # and more acceleration
        ((40.0, 3000.0, 4e5), True),
        ((40.0, 3000.0, 6e4), False),  # and more jerk
    ],
)
def test_every_limit_counts(limits, still):
    # 1 mm in 80 ms, one undamped mode of 30 Hz
    assert is_still(80, *limits, [30.0], [0.0]) == still


@pytest.mark.parametrize(
    ("count", "frequencies", "damping", "still"),
    [
        (3, [8.2], [0.1], False),  # what comes nearest keeps all limits, and arrives elsewhere
        (4, [30.0], [0.0], False),
        (6, [20.0, 33.0, 47.0], [0.0, 0.02, 0.1], False),
        (60, [20.0, 33.0, 47.0], [0.0, 0.02, 0.1], True),
    ],
)
def test_few_intervals_cannot_meet_many_conditions(count, frequencies, damping, still):
    anything = 1e9, 1e12, np.inf
    assert is_still(count, *anything, frequencies, damping) == still


def test_limits_are_kept_between_intervals_too():
    rng = np.random.default_rng(6)
    acceleration = np.zeros((400, 9))
    # Few are far from the edge of what is allowed: forth and back, at most a little too far.
    acceleration[:, 1:-1] = rng.normal(size=(400, 7)) + np.array([3, 2, 1, 0, -1, -2, -3])
    acceleration[0] = [0, 1, -2, 2, 1, -1, -1, 1, 0]  # back and forth again within an interval
    fine = 2000
    at = np.arange(8 * fine + 1) / fine
    a = np.array([np.interp(at, np.arange(9), row) for row in acceleration])
    v = np.cumsum(0.5 * MS / fine * (a[:, 1:] + a[:, :-1]), axis=1)
    steepest = np.abs(np.diff(acceleration, axis=1)).max(axis=1) / MS
    peaks = v.max(axis=1), np.abs(a).max(axis=1), steepest
    forward = v.min(axis=1) >= -1e-6 * v.max(axis=1)
    assert 50 < forward.sum() < 350
    for share in (0.99999, 1.00001):
        for limited in range(3):
            limits = [peak * (share if k == limited else 2.0) for k, peak in enumerate(peaks)]
            kept = keep_limits(acceleration, tuple(limits), MS)
            assert kept.tolist() == (forward & (share > 1.0)).tolist()


def test_moves_beside_it_do_not_change_what_is_said_of_a_move():
    rng = np.random.default_rng(4)
    counts = rng.integers(12, 900, 80)
    time = counts * MS
    V, A = rng.uniform(1.05, 1.6, 80) / time, rng.uniform(4.0, 16.0, 80) / time**2
    J = rng.choice([np.inf, 300.0, 60.0], 80) / time**3
    poles = mode_poles([30.0, 55.0], np.array([0.02, 0.0]))
    together = easily_still(counts, V, A, J, poles, MS)
    alone = [is_still(*row, [30.0, 55.0], [0.02, 0.0]) for row in zip(counts, V, A, J, strict=True)]
    assert together.tolist() == alone
    assert 10 < sum(alone) < 70


def drawn_moves(count, name="vmc", positioning="linear", longest=200.0):
    """Moves of three axes of a shipped machine, and the machine."""
    machine = replace(Machine.load(find_machine(name)), positioning=positioning)
    rng = np.random.default_rng(5)
    displacement = np.zeros((count, 9))
    displacement[:, :3] = rng.uniform(0.1 * longest, longest, (count, 3))
    return machine, displacement


@pytest.mark.parametrize("name", ["vmc", "router"])
@pytest.mark.parametrize("longest", [20.0, 200.0])
def test_of_shipped_machines_nearly_all_limits_are_found_so(name, longest):
    # Longer rapids cruise at the limit of the velocity for most of their time.
    machine, displacement = drawn_moves(200, name, longest=longest)
    task = replace(Task.of(machine, Modes.of(machine), displacement), band=0.0)
    poles = task.objective.excited().poles
    assert easily_still(task.counts, *task.limits, poles, machine.interval).mean() > 0.95


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_the_limit_of_reports_is_what_the_programmes_say(positioning, monkeypatch):
    machine, displacement = drawn_moves(12, positioning=positioning)
    plans = plan_moves(displacement, machine)
    quick = bounds.least_residuals(plans)
    monkeypatch.setattr(
        bounds, "easily_still", lambda counts, *_: np.zeros(len(counts), dtype=bool)
    )
    slow = bounds.least_residuals(plans)
    assert (quick == 0.0).sum() > 6
    np.testing.assert_allclose(quick, slow, rtol=0.0, atol=1e-9)
