"""Conditions I to III: the numbers that are printed for them, their nulls, and what is refused."""

import numpy as np
import pytest
from scipy.optimize import brentq

import gcodejerk
from gcodejerk.errors import PlanError
from gcodejerk.motion.amplitudes import (
    condition_amplitude,
    null_curve,
    residual,
    shortest_null_time,
    undamped_amplitude,
)
from gcodejerk.motion.profiles.conditions import (
    Condition,
    Peaks,
    condition_accelerations,
    condition_displacement,
    condition_durations,
    condition_peaks,
    condition_segments,
    feasible,
    limit_use,
)

# The worked example of Sato and Shirase: 1 mm in 40 ms, a mode at 30 Hz.
LENGTH, TOTAL, FREQUENCY = 1.0, 0.040, 30.0
MS = 1e-3
GRID = np.arange(1, 20) * MS
BAND = np.linspace(27.0, 33.0, 601)


@pytest.mark.parametrize(
    ("condition", "T1", "undamped", "damped", "worst"),
    [
        ("I", 1, 11777.1, 10270.9, 11778),
        ("II", 1, 12143.7, 11097.0, 12327),
        ("III", 1, 5696.8, 5313.6, 7382),
        ("III", 1e-9, 4898.3, 4576.0, 6715),
        ("III", 10, 13209.3, 12266.9, 13279),
    ],
)
def test_amplitudes_are_those_of_the_method(condition, T1, undamped, damped, worst):
    move = (condition, LENGTH, T1 * MS, TOTAL)
    assert float(condition_amplitude(*move, FREQUENCY)) == pytest.approx(undamped, abs=0.06)
    assert float(condition_amplitude(*move, FREQUENCY, 0.02)) == pytest.approx(damped, abs=0.06)
    assert condition_amplitude(*move, BAND).max() == pytest.approx(worst, abs=0.6)


@pytest.mark.parametrize("condition", list(Condition))
def test_the_best_T1_in_steps_of_1_ms_is_1_ms_without_damping(condition):  # noqa: N802
    # I and II mirror T1 and T_SUM/2 - T1: 19 ms leaves as much as 1 ms.
    kept = condition_amplitude(condition, LENGTH, GRID, TOTAL, FREQUENCY)
    assert kept.min() == pytest.approx(kept[0], rel=1e-12)
    assert (kept[-1] == pytest.approx(kept[0], rel=1e-12)) == (condition != "III")


@pytest.mark.parametrize("condition", list(Condition))
def test_with_four_equal_durations_every_condition_is_the_conventional_profile(condition):
    durations, jerks = condition_segments(condition, LENGTH, 0.010, TOTAL)
    np.testing.assert_allclose(durations, [0.010] * 4)
    np.testing.assert_allclose(jerks, [5e5, -5e5, -5e5, 5e5])
    kept = float(condition_amplitude(condition, LENGTH, 0.010, TOTAL, FREQUENCY))
    assert kept == pytest.approx(13209.3, abs=0.06)
    assert 1e3 * kept / (2 * np.pi * FREQUENCY) ** 2 == pytest.approx(371.77, abs=0.006)


def test_peak_accelerations_of_the_designs_differ_by_a_factor_of_thirteen():
    needed = {c: condition_accelerations(c, LENGTH, 0.001, TOTAL) for c in Condition}
    assert needed["I"] == pytest.approx((50000.0, -2631.58), abs=0.01)
    assert needed["II"] == pytest.approx((5000.0, -5000.0), abs=0.01)
    assert needed["III"] == pytest.approx((3846.15, -3846.15), abs=0.01)


@pytest.mark.parametrize("condition", list(Condition))
def test_shapes_broadcast_and_the_segments_come_last(condition):
    length, T1, T = np.array([[1.0], [2.5]]), np.array([1.0, 3.0, 7.0]) * MS, 0.031
    durations, jerks = condition_segments(condition, length, T1, T)
    assert durations.shape == jerks.shape == (2, 3, 4)
    assert condition_durations(condition, T1, T).shape == (3, 4)
    A1, A2 = condition_accelerations(condition, length, T1, T)
    assert A1.shape == A2.shape == (2, 3)
    np.testing.assert_allclose(condition_displacement(condition, A1, T1, T), length + 0 * T1)
    kept = condition_amplitude(condition, length, T1, T, 41.0, 0.03)
    assert kept.shape == (2, 3)
    np.testing.assert_allclose(kept[1], 2.5 * kept[0])
    np.testing.assert_allclose(undamped_amplitude(condition, length, T1, T, 41.0),
                               condition_amplitude(condition, length, T1, T, 41.0))  # fmt: skip


def test_a_move_the_other_way_has_the_other_signs_and_the_same_amplitude():
    there, back = (condition_segments("I", L, 0.003, TOTAL)[1] for L in (1.0, -1.0))
    np.testing.assert_array_equal(there, -back)
    assert condition_peaks("I", -1.0, 0.003, TOTAL) == condition_peaks("I", 1.0, 0.003, TOTAL)
    for amplitude in (condition_amplitude, undamped_amplitude):
        assert amplitude("I", -1.0, 0.003, TOTAL, 30.0) == amplitude("I", 1.0, 0.003, TOTAL, 30.0)


def test_limits_are_used_in_part_or_broken():
    limit = Peaks(np.array(50.0), np.array(4000.0), np.array(np.inf))
    use = limit_use("III", LENGTH, [0.001, 0.010], TOTAL, limit)
    np.testing.assert_allclose(use.velocity, [38.4615 / 50.0, 1.0], rtol=1e-5)
    np.testing.assert_allclose(use.acceleration, [3846.15 / 4000.0, 1.25], rtol=1e-5)
    np.testing.assert_array_equal(use.jerk, [0.0, 0.0])


def test_feasible_is_between_nothing_and_half_of_the_time():
    T1 = [-0.001, 0.0, 1e-12, 0.0199, 0.020, 0.021, np.nan]
    assert feasible(T1, 0.040).tolist() == [False, False, True, True, False, False, False]
    assert not feasible(0.001, np.inf)


@pytest.mark.parametrize("T1", [0.0, -0.001, 0.020, 0.5, np.nan])
@pytest.mark.parametrize(
    "function",
    [
        lambda T1: condition_segments("III", LENGTH, [0.001, T1], TOTAL),
        lambda T1: condition_peaks("II", LENGTH, T1, TOTAL),
        lambda T1: condition_displacement("I", 5000.0, T1, TOTAL),
        lambda T1: condition_amplitude("III", LENGTH, T1, [TOTAL], FREQUENCY),
        lambda T1: undamped_amplitude("II", LENGTH, T1, TOTAL, FREQUENCY),
    ],
)
def test_a_T1_outside_its_range_is_refused_with_the_range(function, T1):  # noqa: N802
    with pytest.raises(PlanError, match=rf"T1 is {T1:g} s, outside 0 < T1 < T_SUM/2 = 0\.02 s"):
        function(T1)


@pytest.mark.parametrize("name", ["IV", "iii", "", "3"])
def test_a_condition_that_is_none_is_refused(name):
    with pytest.raises(PlanError, match="there is no condition") as refused:
        condition_segments(name, LENGTH, 0.001, TOTAL)
    assert refused.value.remedy == "choose I, II or III"


def test_a_mode_that_does_not_vibrate_is_refused():
    with pytest.raises(PlanError, match="damping ratio"):
        condition_amplitude("III", LENGTH, 0.001, TOTAL, FREQUENCY, 1.0)
    with pytest.raises(PlanError, match="frequency"):
        null_curve([TOTAL], -30.0)


@pytest.mark.parametrize(
    ("T", "printed"),
    [(50, [2.287]), (60, [11.349]), (200 / 3, [50 / 3]), (90, [29.802, 7.777]), (40, [])],
)
def test_nulls_are_where_the_method_says(T, printed):
    nulls = null_curve(T * MS, FREQUENCY)
    assert nulls.shape == (len(printed), 1)
    np.testing.assert_allclose(nulls[:, 0], np.array(printed) * MS, atol=5e-7)
    for T1 in nulls[:, 0]:
        assert condition_amplitude("III", LENGTH, T1, T * MS, FREQUENCY) < 1e-8


def test_a_null_curve_is_every_root_that_a_search_finds():
    T = np.linspace(0.013, 0.3101, 57)
    curve = null_curve(T, 23.7)
    found = 0
    for k, total in enumerate(T):
        T2 = np.linspace(1e-5, total / 2 * (1 - 1e-6), 4000)
        gap = np.sinc(2 * 23.7 * T2) - np.sinc(23.7 * total)
        at = np.flatnonzero(gap[:-1] * gap[1:] < 0.0)
        roots = [
            total / 2 - brentq(lambda x, t=total: np.sinc(2 * 23.7 * x) - np.sinc(23.7 * t), a, b)
            for a, b in zip(T2[at], T2[at + 1], strict=True)
        ]
        own = curve[:, k][np.isfinite(curve[:, k])]
        np.testing.assert_allclose(own, roots, atol=1e-9)
        found += len(roots)
    assert found > 100


def test_a_branch_of_the_null_curve_has_no_jumps():
    T = np.linspace(0.0480, 0.2, 4000)
    for branch in null_curve(T, 30.0):
        there = np.isfinite(branch)
        inner = np.flatnonzero(there)
        assert there[inner[0] : inner[-1]].mean() > 0.5
        steps = np.diff(branch)
        assert np.nanmax(np.abs(steps)) < 0.1 * (T[-1] / 2)


def test_the_shortest_time_with_a_null():
    assert float(shortest_null_time(1.0)) == pytest.approx(1.4303, abs=5e-5)
    assert float(shortest_null_time(30.0)) == pytest.approx(0.04768, abs=5e-6)
    for f, least in zip([17.3, 30.0], shortest_null_time([17.3, 30.0]), strict=True):
        assert null_curve(least * 0.9999, f).shape == (0, 1)
        below, above = null_curve([least * 0.9999, least * 1.0001], f)[0]
        assert np.isnan(below)
        assert 0.0 < above < 1e-3 * least


def test_no_times_and_times_that_are_none_have_no_null():
    assert null_curve([], 30.0).shape == (0, 0)
    nulls = null_curve([np.nan, 0.06, np.inf, -1.0, 0.0], 30.0)
    assert np.isfinite(nulls).tolist() == [[False, True, False, False, False]]


def test_the_public_residual_is_the_general_rule():
    times, steps = [0.0, 0.01, 0.02, 0.03, 0.04], [5e5, -1e6, 0.0, 1e6, -5e5]
    assert gcodejerk.residual is residual
    assert float(gcodejerk.residual(times, steps, 30.0).round(1)) == 13209.3
    assert float(gcodejerk.residual(times, steps, 30.0, 0.02).round(1)) == 12266.9
