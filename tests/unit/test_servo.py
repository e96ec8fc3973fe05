"""Blocks on servo periods: their ends, the speeds fitted to them, and LinuxCNC's filter."""

from dataclasses import replace

import numpy as np
import pytest

from gcodejerk import Machine, find_machine
from gcodejerk.motion import mode_poles
from gcodejerk.motion.servo.knots import aligned_knots, block_kinds, early_shift, passed
from gcodejerk.motion.servo.speed_fit import (
    ANY,
    EVEN,
    FASTER,
    SLOWER,
    STEPS,
    Wanted,
    _Fit,
    fit_speeds,
    response_rows,
    solve_tridiagonal,
)
from gcodejerk.motion.servo.spline_filter import filter_gain, filtered, unfiltered
from gcodejerk.rewrite.pipeline import process

DT = 0.001


def still(count):
    """Way and speed of a move that nothing has to brake, at every period."""
    return np.zeros((1, count + 1)), np.zeros((1, count + 1))


@pytest.mark.parametrize("interval", [0.0005, 0.001, 0.002, 0.01])
def test_blocks_are_whole_periods_neither_short_nor_long(interval):
    for count in range(6, 300, 7):
        for stride in (2, 3, 5):
            if stride > 2 and stride * interval > 0.0085:
                continue
            way, speed = still(count)
            knots, enough = aligned_knots(
                np.array([count]), stride, 45, way, speed, np.ones(1), interval
            )
            blocks = np.diff(knots[0])
            blocks = blocks[blocks > 0]
            assert enough.all()
            assert blocks.sum() == count
            assert blocks.min() >= 2
            assert min(blocks[0], blocks[-1]) >= 3
            assert blocks.max() * interval <= max(0.01, 5 * interval) + 1e-12


def test_within_the_look_ahead_every_speed_can_end():
    count, brake = 400, 500.0
    t = np.arange(count + 1) * DT
    speed = np.minimum(brake * t, brake * (count * DT - t))[np.newaxis]
    way = np.concatenate([[0.0], np.cumsum(0.5 * DT * (speed[0, 1:] + speed[0, :-1]))])[np.newaxis]
    for ahead in (25, 45, 90, 400):
        knots, enough = aligned_knots(
            np.array([count]), 2, ahead, way, speed, np.full(1, brake), DT
        )
        at = knots[0][knots[0].searchsorted(0, side="right") - 1 :]
        beyond = np.minimum(np.arange(len(at)) + ahead, len(at) - 1)
        needed = 0.5 * speed[0, at] ** 2 / brake
        kept = needed <= (way[0, at[beyond]] - way[0, at]) * (1 + 1e-6) + 1e-5
        assert kept.all() == enough[0]
        assert enough[0] == (ahead > 90)


def test_an_early_end_shifts_a_slow_start_more_than_a_fast_one():
    knots = np.arange(0, 201, 2)[np.newaxis]
    t = knots * DT
    rise = np.minimum(t, 0.2 - t)
    limit = np.full(1, 5000.0)
    slow, fast = 20.0 * (rise / 0.1) ** 3, 200.0 * np.sqrt(rise / 0.1)
    assert early_shift(knots, fast, limit, DT)[0] < 1e-6
    assert early_shift(knots, slow, limit, DT)[0] > 1e-3


def test_the_filter_and_its_inverse():
    rng = np.random.default_rng(1)
    x = np.zeros((3, 40))
    x[:, 5:35] = rng.normal(size=(3, 30))
    np.testing.assert_allclose(filtered(unfiltered(x))[:, 2:-2], x[:, 2:-2], atol=1e-12)
    np.testing.assert_allclose(filtered(x)[0], np.convolve(x[0], [1, 4, 1], "same") / 6, atol=1e-15)


def test_tridiagonal_systems():
    rng = np.random.default_rng(2)
    beside = rng.uniform(-1, 1, (4, 9))
    diagonal = 2.5 + rng.uniform(0, 1, (4, 10))
    right = rng.normal(size=(4, 10, 3))
    found = solve_tridiagonal(diagonal, beside, right)
    for k in range(4):
        matrix = np.diag(diagonal[k]) + np.diag(beside[k], 1) + np.diag(beside[k], -1)
        np.testing.assert_allclose(matrix @ found[k], right[k], atol=1e-10)


def test_the_rows_are_the_response_of_the_filtered_motion():
    rng = np.random.default_rng(3)
    knots = np.array([[0, 3, 5, 9, 11, 14]])
    speed = np.concatenate([[0.0], rng.uniform(0.2, 2.0, 4), [0.0]])
    poles = mode_poles(np.array([30.0, 90.0]), 0.02)
    rows = response_rows(knots, poles, DT)
    found = (rows[0] * speed[:, np.newaxis]).sum(axis=0)
    # Positions in every period, filtered, and the kicks of straight lines between them.
    at = np.arange(-4, 20)
    fine = np.interp(np.arange(-4, 20, 1e-3), knots[0], speed, left=0.0, right=0.0)
    x = np.concatenate([[0.0], np.cumsum(fine)])[::1000][: len(at)] * 1e-3 / 14
    p = np.convolve(x, [1, 4, 1], "full")[1:-1] / 6
    p[-1] = p[-2]
    kicks = np.diff(p, 2) / DT
    left = (14 - at[1:-1]) * DT
    wanted = (kicks[:, np.newaxis] * np.exp(poles * left[:, np.newaxis])).sum(axis=0) / poles.imag
    np.testing.assert_allclose(found, wanted, rtol=2e-3)
    assert abs(filter_gain(poles, DT)[1]) < abs(filter_gain(poles, DT)[0]) < 1.0


def fit_of(seed):
    """A fit with active limits: what is wanted, and what is found."""
    rng = np.random.default_rng(seed)
    knots = np.array([[0, 3, 5, 7, 9, 11, 13, 16]])
    speeds = np.sin(np.pi * (np.arange(16) + 0.5) / 16)[np.newaxis] * np.pi / 2
    speeds = speeds + 0.1 * rng.normal(size=speeds.shape)
    poles = mode_poles(np.array([40.0]), 0.02)
    near = 1.02 * np.sin(np.pi * knots[0] / 16) * np.pi / 2
    wanted = Wanted(
        knots=knots,
        speeds=speeds,
        length=np.array([1.0]),
        end_speed=np.array([0.01]),
        acceleration=np.array([0.32]),
        least=np.array([0.01]),
        most=np.array([2.0]),
        kind=np.array([[FASTER] * 3 + [ANY] + [SLOWER] * 3]),
        poles=poles,
        response=(response_rows(knots, poles, DT)[0].T @ near)[np.newaxis],
        weight=np.array([[1e6]]),
        rise=np.zeros((1, 7)),
        stiffness=0.0,
        interval=DT,
    )
    return wanted, fit_speeds(wanted)[0]


@pytest.mark.parametrize("seed", range(6))
def test_the_fit_is_that_of_scipy(seed):
    optimize = pytest.importorskip("scipy.optimize")
    wanted, found = fit_of(seed)
    knots, count = wanted.knots[0], wanted.knots.shape[1]
    # The unknowns are changes of speed, so that all limits but those of the speed are bounds.
    h = np.diff(knots)
    middle = np.arange(16) + 0.5
    interpolate = np.array([np.interp(middle, knots, row) for row in np.eye(count)]).T
    rows = response_rows(wanted.knots, wanted.poles, DT)[0]
    length = np.zeros(count)
    length[1:] += h / 2 / 16
    length[:-1] += h / 2 / 16
    stack = [interpolate, 1e5 * length[np.newaxis], 1e3 * rows.real.T, 1e3 * rows.imag.T]
    right = [wanted.speeds[0], [1e5], 1e3 * wanted.response[0].real, 1e3 * wanted.response[0].imag]
    to_speeds = np.vstack([np.zeros(count - 1), np.tril(np.ones((count - 1, count - 1)))])
    end = 1e5 * to_speeds[-1:]
    matrix = np.vstack([np.vstack(stack) @ to_speeds, end])
    low = np.where(wanted.kind[0] == FASTER, 0.0, -0.32 * h)
    high = np.where(wanted.kind[0] == SLOWER, 0.0, 0.32 * h)
    goal = np.concatenate([*right, [1e5 * 0.01]])
    best = optimize.lsq_linear(matrix, goal, bounds=(low, high), tol=1e-14)
    speeds = to_speeds @ best.x
    assert speeds.max() < 2.0
    assert (np.abs(found - speeds) < 5e-4).all(), np.abs(found - speeds).max()


def test_in_some_of_these_fits_limits_hold():
    held = []
    for seed in range(6):
        wanted, found = fit_of(seed)
        h = np.diff(wanted.knots[0])
        change = np.diff(found)
        even = np.isclose(change, 0.0, atol=1e-5)
        held.append(bool((even | np.isclose(np.abs(change), 0.32 * h, atol=1e-5)).any()))
    assert any(held)


def cruise(count, stride=2):
    """A move that gets to its limit of speed within a fifth of its time, and stays there."""
    knots = np.unique(np.r_[0, 3 : count - 3 : stride, count])[np.newaxis]
    t = np.arange(count + 1) / count
    shape = np.sin(np.pi / 2 * np.clip(np.minimum(t, 1.0 - t) / 0.2, 0.0, 1.0)) ** 2
    shape /= 0.5 * (shape[1:] + shape[:-1]).mean()
    at = shape[knots]
    poles = mode_poles(np.array([20.0, 43.0]), 0.02)
    kind = np.sign(np.round(np.diff(at), 9)).astype(np.int64)
    return Wanted(
        knots=knots,
        speeds=(0.5 * (shape[1:] + shape[:-1]))[np.newaxis],
        length=np.array([0.5 * (shape[1:] + shape[:-1]).mean() + 1e-7]),
        end_speed=np.array([1e-4]),
        acceleration=np.array([1.02 * np.diff(shape).max()]),
        least=np.array([1e-4]),
        most=np.array([(1.0 - 2e-5) * shape.max()]),
        kind=kind,
        poles=poles,
        response=np.einsum("bkm,bk->bm", response_rows(knots, poles, DT), at),
        weight=np.array([[1e5, 1e5]]),
        rise=np.diff(at),
        stiffness=25.0,
        interval=DT,
    )


def together(moves):
    """Moves as rows, aligned at their end."""

    def aligned(name):
        columns = [getattr(move, name) for move in moves]
        width = max(column.shape[1] for column in columns)
        return np.concatenate([np.pad(c, ((0, 0), (width - c.shape[1], 0))) for c in columns])

    alone = ("length", "end_speed", "acceleration", "least", "most", "response", "weight")
    return replace(
        moves[0],
        **{name: aligned(name) for name in ("knots", "speeds", "kind", "rise")},
        **{name: np.concatenate([getattr(move, name) for move in moves]) for name in alone},
    )


def test_moves_are_fitted_as_alone_whatever_is_beside_them():
    counts = np.random.default_rng(4).permutation(np.r_[20:60, 300:330, 700:704])
    moves = [cruise(int(count)) for count in counts]
    found = fit_speeds(together(moves))
    for row, move in zip(found, moves, strict=True):
        alone = fit_speeds(move)[0]
        assert (row[: len(row) - len(alone)] == 0.0).all()
        # Not to the last bits: the sum is so flat that these decide on 4e-5 of the mean speed.
        np.testing.assert_allclose(row[len(row) - len(alone) :], alone, rtol=0, atol=1e-4)


def test_a_long_cruise_at_the_limit_is_settled_soon(monkeypatch):
    steps = []
    step = _Fit._step
    monkeypatch.setattr(
        _Fit, "_step", lambda self, rows, *limits: steps.append(rows) or step(self, rows, *limits)
    )
    router = Machine.load(find_machine("router"))
    for here, there in (
        ("X-35.1 Y-26.2 Z-58.4", "X-133.7 Y-23 Z-182.1"),
        ("X-188.8 Y-84.2 Z-27.1", "X-181.3 Y-79.2 Z-198.1"),
        ("X-38.3 Y-156.4 Z-120.3", "X-35.5 Y-181.3 Z-4.8"),
    ):
        steps.clear()
        process(f"G21 G90 G94 G17 G40 G49 G64\nG0 {here}\nG0 {there}\nM2\n".encode(), router)
        assert 0 < len(steps) < STEPS / 2


def test_a_knot_slower_than_both_its_neighbours_gets_an_even_block():
    speed = np.array([[0.0, 4.0, 9.0, 5.0, 8.0, 3.0, 0.0], [0.0, 2.0, 5.0, 4.99, 5.0, 2.0, 0.0]])
    kinds = block_kinds(speed)
    assert kinds[0].tolist() == [FASTER, FASTER, SLOWER, EVEN, SLOWER, SLOWER]
    # What ripples by less than half a percent goes on.
    assert EVEN not in kinds[1]


def test_both_blocks_around_a_minimum_last_as_long_as_they_should():
    before, first, second, both = (np.array([v]) for v in (30.0, 0.0595, 0.0601, 0.004))
    between, behind, lasts = passed(before, first, second, both)
    total = 2 * first / (before + between) + 2 * second / (between + behind)
    assert total == pytest.approx(both, rel=1e-9)
    assert lasts == pytest.approx(2 * first / (before + between))
    # The control passes the knot at the smaller of the speeds around it.
    assert between == pytest.approx(min(before, behind))
