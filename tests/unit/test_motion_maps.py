"""Amplitude maps: their shape, their edges, and the digits that remain at the edges."""

import numpy as np
import pytest

import gcodejerk
from gcodejerk.errors import PlanError
from gcodejerk.motion.amplitudes import condition_amplitude, null_curve
from gcodejerk.motion.maps import BLOCK, amplitude_map, displacement_map

MS = 1e-3
CONDITIONS = ["I", "II", "III"]


def test_rows_are_times_and_columns_are_T1():
    found = gcodejerk.amplitude_map(1.0, [1 * MS, 10 * MS, 25 * MS], [40 * MS, 60 * MS], 30.0)
    assert found.shape == (2, 3)
    np.testing.assert_allclose(found[0], [5696.8, 13209.3, np.nan], atol=0.06)
    assert np.isfinite(found[1]).all()


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("damping", [0.0, 0.03])
def test_every_point_is_the_closed_form(condition, damping):
    T1, T = np.linspace(0.3, 70.0, 211) * MS, np.linspace(5.0, 120.0, 307) * MS
    assert len(T1) * len(T) > 2 * BLOCK
    found = amplitude_map(0.37, T1, T, 43.0, damping, condition)
    column, row = np.meshgrid(T1, T)
    there = column < row / 2
    assert 0.1 < there.mean() < 0.9
    np.testing.assert_array_equal(np.isnan(found), ~there)
    expected = condition_amplitude(condition, 0.37, column[there], row[there], 43.0, damping)
    np.testing.assert_allclose(found[there], expected, rtol=1e-10, atol=1e-9)


def simulated(condition, length, T1, T, frequency, damping, steps=400):
    """Amplitude that an oscillator has after the move, stepped through it by Runge and Kutta.

    Shares no code with the package: both halves of the move are triangles of acceleration that
    change the speed by 1, and all is scaled by the way that this makes.
    """
    other = T / 2 - T1
    t1, t2, t3, t4 = {"I": (T1, T1, other, other), "II": (T1, other, T1, other)}.get(
        condition, (T1, other, other, T1)
    )
    heights = (0.0, 2 / (t1 + t2), 0.0, -2 / (t3 + t4), 0.0)
    omega = 2 * np.pi * frequency
    way = speed = x = v = np.zeros_like(T1)

    def change(x, v, a):
        return v, -a - 2 * damping * omega * v - omega**2 * x

    for k, duration in enumerate((t1, t2, t3, t4)):
        begin, end, h = heights[k], heights[k + 1], duration / steps
        for n in range(steps):
            a, b, c = (begin + (end - begin) * (n + part) / steps for part in (0.0, 0.5, 1.0))
            x1, v1 = change(x, v, a)
            x2, v2 = change(x + h / 2 * x1, v + h / 2 * v1, b)
            x3, v3 = change(x + h / 2 * x2, v + h / 2 * v2, b)
            x4, v4 = change(x + h * x3, v + h * v3, c)
            x, v = x + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4), v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
            way, speed = way + h * speed + h**2 * (2 * a + c) / 6, speed + h * (a + c) / 2
    x, v = x * length / way, v * length / way
    damped = omega * np.sqrt(1 - damping**2)
    return omega**2 * np.hypot(x, (v + damping * omega * x) / damped)


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("damping", [0.0, 0.03])
def test_a_point_is_what_a_simulated_oscillator_keeps(condition, damping):
    T1, T = np.array([0.7, 3.0, 8.0, 11.0, 17.0]) * MS, np.array([37.0, 52.0, 90.0]) * MS
    found = amplitude_map(0.37, T1, T, 43.0, damping, condition)
    column, row = (part.ravel() for part in np.meshgrid(T1, T))
    expected = simulated(condition, 0.37, column, row, 43.0, damping)
    np.testing.assert_allclose(found.ravel(), expected, rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_the_order_of_the_axes_is_the_users(condition):
    T1, T = np.array([7.0, 1.0, 3.0]) * MS, np.array([50.0, 20.0, 35.0]) * MS
    found = amplitude_map(1.0, T1, T, 30.0, 0.02, condition)
    sorted_axes = amplitude_map(1.0, np.sort(T1), np.sort(T), 30.0, 0.02, condition)
    np.testing.assert_allclose(found[1:][:, [1, 2, 0]], sorted_axes[:2])


def test_outside_the_range_of_T1_there_is_nothing():  # noqa: N802
    found = amplitude_map(1.0, [-MS, 0.0, 20 * MS, np.nan, np.inf, 19 * MS], [40 * MS], 30.0)
    assert np.isnan(found[0]).tolist() == [True] * 5 + [False]
    assert np.isnan(amplitude_map(1.0, [MS], [np.nan, np.inf, 0.0, -0.04], 30.0)).all()


@pytest.mark.parametrize("condition", CONDITIONS)
@pytest.mark.parametrize("damping", [0.0, 0.02, 0.5])
def test_digits_remain_where_a_segment_vanishes(condition, damping):
    T = 0.040
    short = np.array([1e-14, 1e-11, 1e-8, 1e-5])
    found = amplitude_map(1.0, short, [T], 30.0, damping, condition)[0]
    # Towards T1 = 0 the amplitude has a limit and a slope of at most 1e6 mm/s^3.
    np.testing.assert_allclose(found[:2], found[0], rtol=1e-12, atol=1e6 * 1e-11)
    np.testing.assert_allclose(found, found[0], atol=1e6 * 1e-5)
    late = T / 2 - short[1:]
    found = amplitude_map(1.0, late, [T], 30.0, damping, condition)[0]
    expected = condition_amplitude(condition, 1.0, late, T, 30.0, damping)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    np.testing.assert_allclose(found, found[0], atol=2e6 * 1e-5)


def test_a_mode_that_dies_out_during_the_move_leaves_no_overflow():
    with np.errstate(all="raise", under="ignore"):
        found = amplitude_map(1.0, [0.1, 2.0, 4.9], [1.0, 10.0], 900.0, 0.9)
    assert np.isfinite(found[1]).all()
    expected = condition_amplitude("III", 1.0, [0.1, 2.0, 4.9], 10.0, 900.0, 0.9)
    np.testing.assert_allclose(found[1], expected, rtol=1e-9)


def test_the_map_is_null_on_the_null_curve():
    T = np.linspace(50.0, 130.0, 9) * MS
    for branch in null_curve(T, 30.0):
        for total, T1 in zip(T, branch, strict=True):
            if np.isfinite(T1):
                assert amplitude_map(1.0, [T1], [total], 30.0)[0, 0] < 1e-8


def test_a_map_scales_with_the_length_whatever_its_sign():
    T1, T = [MS, 3 * MS], [30 * MS, 40 * MS]
    np.testing.assert_allclose(amplitude_map(-2.5, T1, T, 30.0), 2.5 * amplitude_map(1, T1, T, 30))


def test_the_worst_displacement_is_the_largest_of_the_modes():
    T1, T = np.linspace(0.5, 18.0, 40) * MS, [37 * MS, 61 * MS]
    modes = [(30.0, 0.02, 1.0), (90.0, 0.03, -40.0)]
    each = [
        abs(p) * amplitude_map(1.0, T1, T, f, z, "II") / (2 * np.pi * f) ** 2 for f, z, p in modes
    ]
    worst = displacement_map(1.0, T1, T, *zip(*modes, strict=True), condition="II")
    np.testing.assert_allclose(worst, np.maximum(*each))
    assert 0.1 < (worst == each[0])[0].mean() < 0.9


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((1.0, [MS], [0.04], 30.0, 0.0, "IV"), "there is no condition 'IV'"),
        ((np.nan, [MS], [0.04], 30.0), "the length is nan"),
        ((1.0, [MS], [0.04], 0.0), "frequency"),
        ((1.0, [MS], [0.04], 30.0, 1.0), "damping ratio"),
        ((1.0, [[MS]], [0.04], 30.0), "axes of a map"),
    ],
)
def test_what_has_no_map_is_refused(arguments, message):
    with pytest.raises(PlanError, match=message):
        amplitude_map(*arguments)


def test_no_modes_have_no_map():
    with pytest.raises(PlanError, match="there is no mode"):
        displacement_map(1.0, [MS], [0.04], [], [], [])


def test_an_empty_axis_makes_an_empty_map():
    assert amplitude_map(1.0, [], [0.04], 30.0).shape == (1, 0)
    assert amplitude_map(1.0, [MS], [], 30.0).shape == (0, 1)
