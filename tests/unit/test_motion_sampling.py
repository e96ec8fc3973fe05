"""Samples of profiles: exact where theory gives them, aligned at their end."""

import numpy as np
import pytest
from scipy.interpolate import PPoly

from gcodejerk.motion import Grid, SymmetricProfiles, sample_profiles, sampling, steps_response
from gcodejerk.motion.residual import mode_poles

INTERVAL = 0.0005
SHAPES = {
    "four segments": (7, 0, 23, 0),
    "steep": (1, 0, 37, 0),
    "seven segments": (6, 11, 19, 41),
    "no cruise": (9, 14, 5, 0),
    "no constant acceleration": (9, 0, 5, 33),
    "trapezoid": (0, 35, 0, 12),
    "triangle": (0, 35, 0, 0),
    "cubic": (0, 0, 35, 0),
    "off the grid": (6.37, 11.61, 19.02, 40.0),
}


def law_of(name):
    """One profile of the table, durations in intervals."""
    return SymmetricProfiles(*(np.array([d * INTERVAL]) for d in SHAPES[name])).general()


def integrated(name):
    """Position and velocity of the same profile from its acceleration, scaled to the length 1."""
    T1, Ta, T2, Tv = (d * INTERVAL for d in SHAPES[name])
    half = [(T1, 0.0, 1.0), (Ta, 1.0, 1.0), (T2, 1.0, 0.0)]
    pieces = [*half, (Tv, 0.0, 0.0), *((d, -b, -a) for d, a, b in reversed(half))]
    pieces = [p for p in pieces if p[0] > 0.0]
    ends = np.concatenate([[0.0], np.cumsum([p[0] for p in pieces])])
    a = PPoly(np.array([[(high - low) / d, low] for d, low, high in pieces]).T, ends)
    q = a.antiderivative(2)
    length = float(q(ends[-1]))
    return lambda t: q(t) / length, lambda t: a.antiderivative()(t) / length


def every(profile):
    """All whole intervals of a profile."""
    return np.arange(int(np.ceil(profile.total[0] / INTERVAL - 1e-6)) + 1)


@pytest.mark.parametrize("name", SHAPES)
def test_samples_are_those_of_the_integrated_acceleration(name):
    profile = law_of(name)
    moments = every(profile)
    position, velocity = sample_profiles(profile, moments[np.newaxis], INTERVAL)
    q, v = integrated(name)
    t = np.minimum(moments * INTERVAL, profile.total[0])
    np.testing.assert_allclose(position[0], q(t), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(velocity[0], v(t), rtol=1e-9, atol=1e-9 * velocity.max())


@pytest.mark.parametrize("name", SHAPES)
def test_samples_are_antisymmetric_and_monotone_with_exact_ends(name):
    profile = law_of(name)
    total = float(profile.total[0])
    count = round(total / INTERVAL)
    position, velocity = sample_profiles(profile, every(profile)[np.newaxis], INTERVAL)
    assert position[0, 0] == 0.0
    assert position[0, -1] == 1.0
    assert velocity[0, 0] == 0.0
    assert velocity[0, -1] == 0.0
    assert (np.diff(position[0]) > 0.0).all()
    if count * INTERVAL == pytest.approx(total, rel=1e-12):
        np.testing.assert_allclose(position[0] + position[0, ::-1], 1.0, atol=1e-14)
        np.testing.assert_allclose(velocity[0], velocity[0, ::-1], rtol=1e-9, atol=1e-9)


def test_a_profile_rests_before_it_begins_and_after_it_has_ended():
    profile = law_of("four segments")
    position, velocity = sample_profiles(profile, np.array([[-7, 0, 60, 61, 500]]), INTERVAL)
    assert position.tolist() == [[0.0, 0.0, 1.0, 1.0, 1.0]]
    assert velocity.tolist() == [[0.0] * 5]


def test_the_paper_s_profile_has_the_paper_s_first_sample():
    # J1 T1^3 / 6 with 3.846e6 mm/s^3 and 1 ms.
    profile = SymmetricProfiles(*(np.array([d]) for d in (0.001, 0.0, 0.019, 0.0))).general()
    position, _ = sample_profiles(profile, np.array([[1]]), 0.001)
    assert float(position[0, 0]) == pytest.approx(3846153.846 * 1e-9 / 6, rel=1e-9)


def test_profiles_of_different_kinds_are_sampled_together_as_alone():
    profiles = SymmetricProfiles(
        *(np.array(c) * INTERVAL for c in zip(*SHAPES.values(), strict=True))
    ).general()
    moments = np.tile(np.arange(0, 200, 3), (len(SHAPES), 1))
    position, velocity = sample_profiles(profiles, moments, INTERVAL)
    for row, name in enumerate(SHAPES):
        alone = sample_profiles(law_of(name), moments[:1], INTERVAL)
        np.testing.assert_allclose(position[row], alone[0][0], atol=1e-14)
        np.testing.assert_allclose(velocity[row], alone[1][0], atol=1e-12)


@pytest.mark.parametrize("at_once", [1, 100, 140, 10_000])
def test_how_many_are_sampled_at_once_changes_no_bit(at_once, monkeypatch):
    shapes = [*SHAPES.values()] * 3
    profiles = SymmetricProfiles(
        *(np.array(c) * INTERVAL for c in zip(*shapes, strict=True))
    ).general()
    moments = np.arange(len(shapes))[:, np.newaxis] + np.arange(0, 140, 2)
    expected = sample_profiles(profiles, moments, INTERVAL)
    monkeypatch.setattr(sampling, "SAMPLES", at_once)
    for found, other in zip(sample_profiles(profiles, moments, INTERVAL), expected, strict=True):
        assert found.tobytes() == other.tobytes()


@pytest.mark.parametrize("stride", [1, 2, 3, 4, 7, 50])
def test_a_grid_reaches_from_start_to_end_in_blocks_of_the_stride(stride):
    counts = np.arange(1, 90)
    grid = Grid.every(counts, stride, INTERVAL)
    for count, knots, blocks in zip(counts, grid.knots, grid.blocks, strict=True):
        own = knots[len(knots) - 1 - blocks :]
        assert own[0] == 0
        assert own[-1] == count
        assert not knots[: len(knots) - blocks].any()
        lengths = np.diff(own)
        assert len(lengths) == max(count // stride, 1)
        usual, longer = min(stride, count), np.nonzero(lengths != min(stride, count))[0]
        assert len(longer) <= 1
        assert (np.delete(lengths, longer) == usual).all()
        if count >= stride:
            rest = count % stride
            assert lengths[longer].tolist() == ([usual + rest] if rest else [])
            # The longer block is the one around the middle.
            for k in longer:
                assert own[k] <= (count + stride) / 2
                assert own[k + 1] >= (count - stride) / 2


def test_a_grid_is_aligned_at_the_end():
    grid = Grid.every(np.array([4, 7, 1]), 2, 0.001)
    assert grid.knots.tolist() == [[0, 0, 2, 4], [0, 2, 5, 7], [0, 0, 0, 1]]
    assert grid.blocks.tolist() == [2, 3, 1]


def test_a_grid_of_no_moves_has_no_rows():
    grid = Grid.every(np.zeros(0, dtype=np.int64), 2, 0.001)
    assert len(grid.knots) == len(grid.blocks) == 0


@pytest.mark.parametrize("last", [*range(40), 143, 144, 145, 1000])
def test_many_modes_answer_to_steps_as_each_of_them_alone(last):
    rng = np.random.default_rng(last)
    steps = np.zeros((3, last + 7))
    steps[:, rng.permutation(last + 1)[: last // 2 + 1]] = rng.normal(size=(3, last // 2 + 1))
    steps[1, last] = 1.0
    poles = mode_poles(rng.uniform(5.0, 450.0, 30), rng.uniform(0.0, 0.1, 30))
    expected = [
        [sum(row[k] * np.exp(pole * k * 1e-3) for k in range(last + 7)) for pole in poles]
        for row in steps
    ]
    found = steps_response(steps, 1e-3, poles)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


def test_without_a_step_nothing_answers():
    found = steps_response(np.zeros((2, 5)), 1e-3, mode_poles([30.0], [0.02]))
    assert found.tolist() == [[0.0], [0.0]]
