"""Candidates in single precision against the same profiles in double precision."""

import numpy as np
import pytest

from gcodejerk.motion import Objective, SymmetricProfiles, mode_poles
from gcodejerk.motion.profiles.boxes import box_profiles
from gcodejerk.motion.search import candidates
from gcodejerk.motion.search.candidates import cascade_worst, symmetric_worst

SINGLE = 1e-4
"""What single precision may cost: of what is left, and of what a step of jerk does to a mode."""


def drawn_objective(rng, n, damping, spectrum=False):
    """Modes of 8 to 250 Hz in a band, or the lines of spectra, some not excited by some moves."""
    m = int(rng.integers(1, 5))
    poles = mode_poles(rng.uniform(8, 250, m), np.full(m, damping))
    weights = rng.uniform(0.1, 50.0, (n, m)) * (rng.random((n, m)) < 0.8)
    objective = Objective.of_modes(poles, weights)
    if not spectrum:
        return objective.in_band(0.1, 0.2)
    lines = np.array([40, 3, 1][: rng.integers(1, 4)])
    poles = mode_poles(rng.uniform(8, 250, lines.sum()), np.full(lines.sum(), damping))
    weights = rng.uniform(0.1, 10.0, (n, lines.sum()))
    return Objective(poles, weights, np.repeat(np.arange(len(lines)), lines))


def largest_step(objective, jerk):
    """What the largest jerk step of each candidate alone leaves, of the mode that feels it most."""
    each = objective.weights / (objective.poles.imag * np.abs(objective.poles) ** 2)
    # Oscillators of a group add up.
    return jerk * each.sum(axis=1)


@pytest.fixture(params=[1 << 14, 300], ids=["blocks", "small blocks"])
def block(request, monkeypatch):
    """Few poles at a time: groups are carried from block to block."""
    monkeypatch.setattr(candidates, "BLOCK", request.param)


@pytest.mark.usefixtures("block")
@pytest.mark.parametrize("spectrum", [False, True], ids=["band", "spectrum"])
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.2])
def test_symmetric_candidates_leave_what_their_profiles_do(damping, spectrum):
    rng = np.random.default_rng(7)
    n, k = 4, 60
    for _ in range(8):
        objective = drawn_objective(rng, n, damping, spectrum)
        T1, T2 = (10 ** rng.uniform(-3, -1.2, (k, n)) for _ in range(2))
        Ta, Tv = (rng.uniform(0, 0.2, (k, n)) * (rng.random((k, n)) < 0.6) for _ in range(2))
        total = np.max(2 * (T1 + Ta + T2) + Tv, axis=0)
        # T_SUM is the move's: what is left of it is cruise.
        Tv = total - 2 * (T1 + Ta + T2)
        found = symmetric_worst(T1, Ta, T2, total, objective)
        assert found.dtype == np.float32
        flat = SymmetricProfiles(*(x.ravel() for x in (T1, Ta, T2, np.maximum(Tv, 0.0))))
        exact = objective.take(np.tile(np.arange(n), k)).of(flat.general()).reshape(k, n)
        step = largest_step(objective, flat.jerk.reshape(k, n))
        assert (np.abs(found - exact) <= SINGLE * (exact + step)).all()


@pytest.mark.usefixtures("block")
@pytest.mark.parametrize("spectrum", [False, True], ids=["band", "spectrum"])
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.2])
def test_cascades_of_candidates_leave_what_their_profiles_do(damping, spectrum):
    rng = np.random.default_rng(8)
    n, k = 4, 60
    for _ in range(8):
        objective = drawn_objective(rng, n, damping, spectrum)
        widths = tuple(10 ** rng.uniform(-3, -0.7, (k, n)) for _ in range(3))
        found = cascade_worst(widths, objective)
        assert found.dtype == np.float32
        profiles = box_profiles(*(w.ravel() for w in widths))
        exact = objective.take(np.tile(np.arange(n), k)).of(profiles).reshape(k, n)
        # No difference of nearly equal numbers: right to what a box does with its edges.
        edges = largest_step(objective, 1.0 / np.prod(widths, axis=0))
        assert (np.abs(found - exact) <= SINGLE * (exact + edges)).all()


def test_a_null_is_one_to_single_precision():
    f = 31.0
    objective = Objective.of_modes(mode_poles([f], [0.0]), np.full((1, 1), 10.0))
    w = np.array([[1.0 / f]])
    assert cascade_worst((2.3 * w, w, 0.4 * w), objective)[0, 0] < 1e-5
    # T1 = T2: the ramp is a box of the width T1 behind one of T1 + Ta, which is a period.
    half = 0.5 * w
    assert symmetric_worst(half, half, half, 8.3 * w[0], objective)[0, 0] < 1e-5
    assert symmetric_worst(half, 0.5 * half, half, 8.3 * w[0], objective)[0, 0] > 1e-2


def test_without_modes_nothing_is_left():
    objective = Objective.of_modes(mode_poles([], []), np.ones((2, 0)))
    one = np.ones((3, 2))
    assert (symmetric_worst(one, one, one, np.full(2, 8.0), objective) == 0.0).all()
    assert (cascade_worst((one, one, one), objective) == 0.0).all()


@pytest.mark.parametrize(("n", "gives_up"), [(7, 0.0), (100, 0.5)])
def test_a_bound_gives_up_what_is_beyond_it_and_changes_nothing_else(n, gives_up):
    """Of so few candidates that calls cost more, none is given up."""
    random = np.random.default_rng(15)
    k = 60
    T1, Ta, T2 = (random.uniform(0.002, 0.02, (k, n)) for _ in range(3))
    total = np.full(n, 0.2)
    poles = mode_poles(random.uniform(20.0, 200.0, 9), random.uniform(0.0, 0.05, 9))
    objective = Objective(poles, random.uniform(0.1, 1.0, (n, 9)), np.arange(9))
    free = symmetric_worst(T1, Ta, T2, total, objective)
    bound = np.median(free, axis=0) * np.ones((k, 1))
    bound[::11] = -1.0
    found = symmetric_worst(T1, Ta, T2, total, objective, bound)
    below = free <= bound
    assert (found[below] == free[below]).all()
    assert np.isinf(found[~below & (bound > 0.0)]).mean() >= gives_up
    assert np.isinf(found[::11]).all()


@pytest.mark.parametrize("group", [np.arange(9), np.array([0, 0, 0, 1, 2, 2, 3, 3, 3])])
def test_what_a_candidate_leaves_depends_on_none_beside_it(group):
    random = np.random.default_rng(16)
    n, k = 400, 50  # more than are evaluated at once for all poles
    T1, Ta, T2 = (random.uniform(0.002, 0.02, (k, n)) for _ in range(3))
    total = np.full(n, 0.2)
    poles = mode_poles(random.uniform(20.0, 200.0, 9), random.uniform(0.0, 0.05, 9))
    objective = Objective(poles, random.uniform(0.1, 1.0, (n, 9)), group)
    bound = np.full((k, n), np.median(symmetric_worst(T1, Ta, T2, total, objective)))
    bound[::11] = -1.0
    together = symmetric_worst(T1, Ta, T2, total, objective, bound)
    for row in range(0, n, 37):
        own = slice(row, row + 1)
        alone = symmetric_worst(
            T1[:, own], Ta[:, own], T2[:, own], total[own], objective.take(own), bound[:, own]
        )
        assert (alone[:, 0] == together[:, row]).all()
