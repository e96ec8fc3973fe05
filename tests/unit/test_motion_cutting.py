"""The programme by planes, against the same one with its cones."""

import daqp
import numpy as np
import pytest
from test_motion_guard import MS, drawn, today_of

from gcodejerk.motion import grouped
from gcodejerk.motion.search import optimal
from gcodejerk.motion.search.blocks import Blocks
from gcodejerk.motion.search.cutting import Cutting
from gcodejerk.motion.search.looked_at import LookedAt
from gcodejerk.motion.search.optimal import least_residual, near_least
from gcodejerk.motion.search.programme import Problem
from gcodejerk.motion.search.socp import solve

ENOUGH, CLOSE, NOTHING, KEPT, EXPECTED, WEIGHT = 80, 3e-3, 1e-4, 3e-4, 0.015, 1e-6


def problem_of(move, knots=None, cap=None, velocity=None):
    """The programme of a move: its modes over the band; those of the second one with a cap."""
    T = move.count * MS
    unit = today_of(move)
    looked_at = LookedAt.of(move.poles, move.weights / unit, move.group, move.band, T)
    knots = np.arange(move.count + 1) if knots is None else knots
    blocks = Blocks.whole(looked_at, knots, MS)
    own = looked_at.source[blocks.owner]
    return Problem(
        knots, velocity or move.velocity * T, move.acceleration * T**2, move.jerk * T**3,
        blocks.rows, blocks.cone, np.where((own == 1) & (cap is not None), cap or 0.0, np.nan),
        blocks.near, blocks.share, blocks.mirrored,
    )  # fmt: skip


def left_by(problem, jerk):
    """What each group is left with by a jerk in each block."""
    return grouped(np.abs(problem.seen(problem.rows @ jerk)), problem.group)


def by_planes(problem, allowed, smooth, cutting=None):
    """Planes until no cone is exceeded by much."""
    cutting = cutting or Cutting(problem)
    for _ in range(ENOUGH):
        assert cutting.solve(allowed, np.inf if smooth else WEIGHT)
        most = cutting.told + max(CLOSE * cutting.told, NOTHING)
        most = np.where(np.isnan(problem.cap), most, (1.0 + KEPT) * problem.cap)
        if not cutting.cut(cutting.left > most) and cutting.settled:
            return cutting
    raise AssertionError("planes without an end")


def keeps_limits(problem, jerk):
    """Whether a profile arrives at rest and keeps its limits, between the knots, too."""
    h = np.diff(problem.knots) / problem.knots[-1]
    t = np.linspace(0.0, 1.0, 11)[:, np.newaxis] * h
    a = np.concatenate([[0.0], np.cumsum(jerk * h)])
    v = np.concatenate([[0.0], np.cumsum(a[:-1] * h + jerk * h**2 / 2)])
    s = np.sum(v[:-1] * h + a[:-1] * h**2 / 2 + jerk * h**3 / 6)
    between = v[:-1] + a[:-1] * t + jerk * t**2 / 2
    return (
        abs(s - 1.0) < 1e-9 and abs(a[-1]) < 1e-8 and abs(v[-1]) < 1e-9
        and np.abs(jerk).max() <= problem.jerk * (1.0 + 1e-6)
        and np.abs(a).max() <= problem.acceleration * (1.0 + 1e-6)
        and between.max() <= problem.velocity * (1.0 + 1e-6) and between.min() >= -1e-6
    )  # fmt: skip


def test_the_least_by_planes_is_that_of_the_cones():
    for move in drawn(10):
        problem = problem_of(move)
        cones = solve(problem, 0.0, 1e-9)
        cutting = by_planes(problem, 0.0, False)
        solution = cutting.solution()
        assert cutting.expected == pytest.approx(cones.worst, rel=EXPECTED, abs=2 * NOTHING)
        assert solution.worst == pytest.approx(cones.worst, rel=2 * CLOSE, abs=2 * NOTHING)
        assert solution.worst == pytest.approx(left_by(problem, solution.jerk).max())
        assert keeps_limits(problem, solution.jerk)


def test_so_is_the_least_jerk_for_what_is_allowed():
    for move in drawn(10, seed=8):
        problem = problem_of(move)
        least = solve(problem, 0.0, 1e-9).worst
        cones = solve(problem, least + 0.02, 1.0)
        solution = by_planes(problem, least + 0.02, True).solution()
        assert solution.worst <= (least + 0.02) * (1.0 + 2 * CLOSE)
        # Of the cones' programme some residual may pay for less jerk.
        assert solution.peak >= cones.peak - 1e-4
        if cones.worst <= least + 0.0201:
            assert solution.peak == pytest.approx(cones.peak, abs=1e-3)
        assert keeps_limits(problem, solution.jerk)


def test_what_has_a_cap_keeps_it():
    capped = 0
    for move in drawn(12, seed=4):
        if len(move.poles) < 2:
            continue
        least = solve(problem_of(move), 0.0, 1e-9).worst
        problem = problem_of(move, cap=1.05 * least + 0.01)
        cones = solve(problem, 0.0, 1e-9)
        cutting = by_planes(problem, 0.0, False)
        left = left_by(problem, cutting.solution().jerk)
        has = ~np.isnan(problem.cap)
        assert np.all(left[has] <= problem.cap[has] * (1.0 + 2 * KEPT))
        assert left[~has].max() == pytest.approx(cones.worst, rel=2 * CLOSE, abs=2 * NOTHING)
        capped += 1
    assert capped > 3


def test_a_speed_that_is_in_the_way_is_held_between_the_knots_too():
    held = 0
    for move in drawn(8, seed=12):
        free = by_planes(problem_of(move, velocity=1e6), 0.0, False).solution()
        h = np.diff(np.arange(move.count + 1)) / move.count
        fastest = np.cumsum(np.concatenate([[0.0], np.cumsum(free.jerk * h)[:-1]]) * h).max()
        problem = problem_of(move, velocity=max(0.9 * fastest, 1.2))
        cones = solve(problem, 0.0, 1e-9)
        if cones is None:
            continue
        solution = by_planes(problem, 0.0, False).solution()
        assert keeps_limits(problem, solution.jerk)
        assert solution.worst == pytest.approx(cones.worst, rel=2 * CLOSE, abs=2 * NOTHING)
        held += problem.velocity < fastest
    assert held > 4


def test_where_it_begins_does_not_matter():
    for move in drawn(5, seed=6):
        problem = problem_of(move)
        longer = np.union1d(np.arange(0, move.count, 3), move.count)
        if not np.array_equal(longer + longer[::-1], np.full(len(longer), move.count)):
            longer = np.arange(move.count + 1)
        begun = Cutting(problem)
        begun.begin(by_planes(problem_of(move, longer), 0.0, False))
        cold = by_planes(problem, 0.0, False).solution().worst
        warm = by_planes(problem, 0.0, False, begun).solution().worst
        assert warm == pytest.approx(cold, rel=2 * CLOSE, abs=2 * NOTHING)


def test_where_the_solver_gives_up_cones_are_asked(monkeypatch):
    moves = list(drawn(3, seed=9))
    by_cuts = [near_least(m, 0.01 * today_of(m), today_of(m), today_of(m)) for m in moves]
    real = daqp.solve
    monkeypatch.setattr(daqp, "solve", lambda *a, **k: (*real(*a, **k)[:2], -2, {}))
    for move, planes in zip(moves, by_cuts, strict=True):
        today = today_of(move)
        cones = near_least(move, 0.01 * today, today, today)
        assert cones.worst == pytest.approx(planes.worst, abs=0.015 * today)


def test_where_it_gives_up_on_less_jerk_what_leaves_the_least_is_kept(monkeypatch):
    real = daqp.solve

    def no_smoothing(square, cost, rows, most, *rest, **more):
        x, least, status, info = real(square, cost, rows, most, *rest, **more)
        # The last unknown but one is the residual, which is none where the jerk alone is sought.
        return x, least, -2 if most[len(square) - 2] == 0.0 else status, info

    move = next(drawn(1, seed=9))
    least = least_residual(move, today_of(move))
    monkeypatch.setattr(daqp, "solve", no_smoothing)
    monkeypatch.setattr(optimal, "solve", None)  # cones are not asked
    kept = least_residual(move, today_of(move))
    assert kept.worst == pytest.approx(least.worst, rel=0.02)


def test_a_solution_that_has_lost_rows_is_none(monkeypatch):
    real = daqp.solve

    def losing(*given, **more):
        x, least, status, info = real(*given, **more)
        return np.array(x) * (1.0 + 1e-5), least, status, info

    cutting = Cutting(problem_of(next(drawn(1, seed=4))))
    assert cutting.solve(0.0, WEIGHT)
    monkeypatch.setattr(daqp, "solve", losing)
    assert not cutting.solve(0.0, WEIGHT)


def test_modes_that_count_together_are_cut_together():
    move = next(drawn(1, seed=2))
    poles = np.concatenate([move.poles[:1], move.poles[:1] * 1.3, move.poles[:1] * 1.7])
    T = move.count * MS
    looked_at = LookedAt.of(poles, np.array([1.0, 0.7, 0.4]), np.array([0, 0, 1]), 0.05, T)
    blocks = Blocks.whole(looked_at, np.arange(move.count + 1), MS)
    rows = np.einsum("rk,rkn->rn", blocks.share, blocks.rows[blocks.near])
    problem = Problem(
        blocks.knots, move.velocity * T, move.acceleration * T**2, move.jerk * T**3,
        rows / np.abs(rows).max(), blocks.cone,
        np.full(len(np.unique(blocks.cone)), np.nan), mirrored=blocks.mirrored,
    )  # fmt: skip
    assert len(np.unique(np.bincount(problem.group)[np.unique(problem.group)])) > 1
    cones = solve(problem, 0.0, 1e-9)
    left = by_planes(problem, 0.0, False).solution().worst
    assert left == pytest.approx(cones.worst, rel=2 * CLOSE, abs=2 * NOTHING)
