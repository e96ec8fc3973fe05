"""Closed forms of Conditions I to III, and the general rule, against quadrature over drawn moves.

The reference shares no code with the formulas: the acceleration is built from its corners (slopes
that are the shape of the condition, a height that makes the position end at the length), and the
envelope of the mode is the convolution integral, by Gauss and Legendre in panels so short that
their error is rounding. 18,000 moves altogether, as arrays.

Differences are compared with 1e-9 of the amplitude itself and, near a null, where the amplitude is
what large terms leave of each other, with 1e-11 of the least of two bounds of it: every ramp of the
acceleration in phase (the sum of the moduli of the terms), or all of the velocity at once.
"""

import numpy as np
import pytest

from gcodejerk.motion.amplitudes import condition_amplitude, residual, undamped_amplitude
from gcodejerk.motion.maps import amplitude_map
from gcodejerk.motion.profiles.conditions import (
    condition_accelerations,
    condition_displacement,
    condition_peaks,
    condition_segments,
)

CASES = 5000
CONDITIONS = ("I", "II", "III")
NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANELS = 16


def drawn_moves(seed, cases=CASES):
    """Length, T1, T_SUM, frequency and damping; no number is round, T1 comes near both its ends."""
    random = np.random.default_rng(seed)
    length = 10.0 ** random.uniform(-2, 3, cases)
    T = 10.0 ** random.uniform(-2.3, 0.3, cases)
    part = random.uniform(0.0, 0.5, cases)
    near = 10.0 ** random.uniform(-7, -1, cases)
    ends = random.integers(0, 4, cases)
    part = np.where(ends == 0, 0.5 * near, np.where(ends == 1, 0.5 * (1.0 - near), part))
    frequency = 10.0 ** random.uniform(-1.5, 1.1, cases) / T
    damping = np.where(random.random(cases) < 0.3, 0.0, random.uniform(0.0, 0.4, cases))
    return length, part * T, T, frequency, damping


def by_corners(condition, length, T1, T):
    """Durations and corner accelerations, shapes (n, 4) and (n, 5), from areas alone."""
    rest = T / 2.0 - T1
    order = {"I": (T1, T1, rest, rest), "II": (T1, rest, T1, rest), "III": (T1, rest, rest, T1)}
    durations = np.stack(order[condition], axis=1)
    up, down = durations[:, :2].sum(axis=1), durations[:, 2:].sum(axis=1)
    corners = np.zeros((len(T1), 5))
    corners[:, 1], corners[:, 3] = 1.0 / up, -1.0 / down
    t, weight, a = nodes(durations, corners)
    # The end position is the integral of a(t) (T - t).
    reached = (weight * a * (durations.sum(axis=1)[:, np.newaxis] - t)).sum(axis=1)
    return durations, corners * (length / reached)[:, np.newaxis]


def nodes(durations, corners):
    """Moments, weights and accelerations for a quadrature over every segment, shapes (n, q)."""
    cases, count = durations.shape
    begin = np.cumsum(durations, axis=1) - durations
    place = (np.arange(PANELS)[:, np.newaxis] + (NODES + 1.0) / 2.0).ravel() / PANELS
    weight = np.tile(WEIGHTS / 2.0, PANELS) / PANELS
    t = begin[..., np.newaxis] + durations[..., np.newaxis] * place
    low, high = corners[:, :-1, np.newaxis], corners[:, 1:, np.newaxis]
    a = low + (high - low) * place
    w = durations[..., np.newaxis] * weight
    flat = (cases, count * len(place))
    return t.reshape(flat), w.reshape(flat), a.reshape(flat)


def integrated(durations, corners, frequency, damping):
    """Acceleration envelope of a mode at the end of the move, by quadrature."""
    t, weight, a = nodes(durations, corners)
    omega = 2.0 * np.pi * frequency
    own = omega * np.sqrt(1.0 - damping**2)
    left = durations.sum(axis=1)[:, np.newaxis] - t
    decayed = weight * a * np.exp(-(damping * omega)[:, np.newaxis] * left)
    phase = own[:, np.newaxis] * left
    real, imaginary = (decayed * np.cos(phase)).sum(axis=1), (decayed * np.sin(phase)).sum(axis=1)
    return omega**2 / own * np.hypot(real, imaginary)


def bound(durations, corners, frequency, damping):
    """The largest amplitude that accelerations of this size could leave."""
    omega = 2.0 * np.pi * frequency
    ramps = np.abs(np.diff(corners, axis=1)).sum(axis=1)
    area = (0.5 * np.abs(corners[:, :-1] + corners[:, 1:]) * durations).sum(axis=1)
    return np.minimum(ramps, omega * area) / np.sqrt(1.0 - damping**2)


def assert_same(found, expected, natural):
    """Within 1e-9 of the value, or 1e-11 of what it could be."""
    allowed = 1e-9 * expected + 1e-11 * natural
    worst = np.argmax(np.abs(found - expected) / allowed)
    assert (np.abs(found - expected) <= allowed).all(), (worst, found[worst], expected[worst])


@pytest.mark.parametrize("condition", CONDITIONS)
def test_jerks_bring_the_axis_to_rest_at_the_length(condition):
    length, T1, T, _, _ = drawn_moves(1)
    durations, jerks = condition_segments(condition, length, T1, T)
    s = v = a = np.zeros(CASES)
    fastest = strongest = np.zeros(CASES)
    for d, j in zip(durations.T, jerks.T, strict=True):
        s, v, a = s + d * (v + d * (a / 2 + d * j / 6)), v + d * (a + d * j / 2), a + d * j
        fastest, strongest = np.maximum(fastest, np.abs(v)), np.maximum(strongest, np.abs(a))
    np.testing.assert_allclose(durations.sum(axis=1), T, rtol=1e-14)
    np.testing.assert_allclose(s, length, rtol=1e-9)
    assert (np.abs(v) <= 1e-12 * fastest).all()
    assert (np.abs(a) <= 1e-12 * strongest).all()
    peaks = condition_peaks(condition, length, T1, T)
    np.testing.assert_allclose(peaks.velocity, fastest, rtol=1e-12)
    np.testing.assert_allclose(peaks.acceleration, strongest, rtol=1e-12)
    np.testing.assert_array_equal(peaks.jerk, np.abs(jerks).max(axis=1))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_accelerations_and_displacements_are_those_of_the_shape(condition):
    length, T1, T, _, _ = drawn_moves(2)
    _, corners = by_corners(condition, length, T1, T)
    A1, A2 = condition_accelerations(condition, length, T1, T)
    np.testing.assert_allclose(A1, corners[:, 1], rtol=1e-9)
    np.testing.assert_allclose(A2, corners[:, 3], rtol=1e-9)
    again = condition_displacement(condition, corners[:, 1], T1, T)
    np.testing.assert_allclose(again, length, rtol=1e-9)


@pytest.mark.parametrize("condition", CONDITIONS)
def test_amplitudes_are_those_of_the_integrated_mode(condition):
    length, T1, T, f, damping = drawn_moves(3)
    profile = by_corners(condition, length, T1, T)
    expected = integrated(*profile, f, damping)
    found = condition_amplitude(condition, length, T1, T, f, damping)
    assert_same(found, expected, bound(*profile, f, damping))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_undamped_closed_forms_are_those_of_the_integrated_mode(condition):
    length, T1, T, f, _ = drawn_moves(4)
    # The printed forms lose digits where a jerk is large; the others keep them.
    fine = np.minimum(T1, T / 2 - T1) > 1e-2 * np.minimum(T, 1.0 / f)
    length, T1, T, f = (x[fine] for x in (length, T1, T, f))
    profile = by_corners(condition, length, T1, T)
    none = np.zeros(len(f))
    expected = integrated(*profile, f, none)
    # A square root of a difference has half of its digits near a null: hence not assert_same.
    natural = bound(*profile, f, none)
    found = undamped_amplitude(condition, length, T1, T, f)
    clear = expected > 1e-2 * natural
    assert clear.mean() > 0.5
    np.testing.assert_allclose(found[clear], expected[clear], rtol=1e-9)
    np.testing.assert_allclose(found, expected, atol=1e-6 * float(natural.max()))


@pytest.mark.parametrize("condition", CONDITIONS)
def test_a_map_is_the_closed_form_at_every_point(condition):
    for seed in range(40):
        random = np.random.default_rng(seed)
        f, damping = 10.0 ** random.uniform(-1, 3), random.choice([0.0, random.uniform(0, 0.9)])
        T = np.sort(10.0 ** random.uniform(-2.5, 1.0, 12))
        T1 = np.sort(np.concatenate([10.0 ** random.uniform(-9, 1.0, 12), T[:4] / 2 * (1 - 1e-9)]))
        found = amplitude_map(2.7, T1, T, f, damping, condition)
        there = T[:, np.newaxis] / 2 > T1
        np.testing.assert_array_equal(np.isfinite(found), there)
        row, column = np.nonzero(there)
        closed = condition_amplitude(condition, 2.7, T1[column], T[row], f, damping)
        peaks = condition_peaks(condition, 2.7, T1[column], T[row])
        natural = np.minimum(4 * peaks.acceleration, 4 * np.pi * f * peaks.velocity)
        natural /= np.sqrt(1 - damping**2)
        assert_same(found[there], closed, natural)


def test_the_general_rule_holds_for_any_jerk():
    random = np.random.default_rng(5)
    cases, count = 3000, 7
    durations = 10.0 ** random.uniform(-4, -1.5, (cases, count))
    jerks = random.normal(size=(cases, count)) * 10.0 ** random.uniform(3, 6, (cases, 1))
    # The last segment ends the acceleration; the move need not end at rest for the rule to hold.
    jerks[:, -1] = -(durations * jerks)[:, :-1].sum(axis=1) / durations[:, -1]
    corners = np.zeros((cases, count + 1))
    corners[:, 1:-1] = np.cumsum(durations * jerks, axis=1)[:, :-1]
    f = 10.0 ** random.uniform(-1.0, 1.1, cases) / durations.sum(axis=1)
    damping = np.where(random.random(cases) < 0.3, 0.0, random.uniform(0.0, 0.4, cases))
    expected = integrated(durations, corners, f, damping)
    times = np.concatenate([np.zeros((cases, 1)), np.cumsum(durations, axis=1)], axis=1)
    steps = np.diff(jerks, axis=1, prepend=0.0, append=0.0)
    found = np.array([float(residual(t, dJ, *m)) for t, dJ, *m in zip(times, steps, f, damping,
                                                                      strict=True)])  # fmt: skip
    # Here the terms are the jerk steps themselves.
    terms = np.abs(steps).sum(axis=1) / (2 * np.pi * f * np.sqrt(1.0 - damping**2))
    assert (np.abs(found - expected) <= 1e-9 * expected + 1e-12 * terms).all()
    assert np.median(expected / terms) > 1e-3
