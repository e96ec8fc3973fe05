"""Input shapers: their impulses, the nulls that they make, and the time that they take."""

import numpy as np
import pytest

from gcodejerk.errors import PlanError
from gcodejerk.motion import SymmetricProfiles, conventional_profiles, mode_poles, profiles_response
from gcodejerk.motion.shapers import SHAPERS, shaped_profile, shaper_impulses

CONVENTIONAL = conventional_profiles([600.0], [5000.0], [5e5]).general()


def left(name, f, zeta, design=0.0, at=30.0):
    """Acceleration amplitude of a mode after 1 mm in 40 ms behind a shaper for 30 Hz."""
    pole = mode_poles([f], [zeta])
    profile = shaped_profile(CONVENTIONAL, name, at, design)
    D = np.abs(profiles_response(profile, pole))[0, 0] / pole[0].imag
    return float(D) * (2 * np.pi * f) ** 2


@pytest.mark.parametrize(
    ("name", "time", "damped", "tenth"),
    [("zv", 56.67, 373.5, 2059), ("zvd", 73.33, 11.4, 322), ("fir", 73.33, 230.6, 1438)],
)
def test_shapers_leave_what_the_method_says(name, time, damped, tenth):
    profile = shaped_profile(CONVENTIONAL, name, 30.0)
    assert float(profile.total[0]) * 1e3 == pytest.approx(time, abs=0.01)
    assert left(name, 30.0, 0.0) < 1e-6
    assert left(name, 30.0, 0.02) == pytest.approx(damped, rel=1e-3, abs=0.05)
    worst = max(left(name, f, 0.0) for f in np.linspace(27, 33, 25))
    assert worst == pytest.approx(tenth, rel=2e-3)


@pytest.mark.parametrize("name", SHAPERS)
def test_impulses_add_up_to_one_and_are_positive(name):
    delays, amplitudes = shaper_impulses(name, 42.0, 0.07)
    assert amplitudes.sum() == pytest.approx(1.0)
    assert (amplitudes > 0).all()
    assert delays[0] == 0.0
    assert (np.diff(delays) > 0).all()


@pytest.mark.parametrize("name", ["zv", "zvd", "posicast", "mzv"])
def test_made_for_its_damping_a_shaper_leaves_nothing(name):
    usual = left(name, 30.0, 0.08)
    assert left(name, 30.0, 0.08, design=0.08) < 1e-6 < usual


def test_ei_leaves_its_tolerance_at_its_frequency():
    pole = mode_poles([30.0], [0.0])
    plain = np.abs(profiles_response(CONVENTIONAL, pole))[0, 0] / pole[0].imag * (60 * np.pi) ** 2
    assert left("ei", 30.0, 0.0) == pytest.approx(0.05 * plain, rel=1e-9)


def test_a_derivative_shaper_is_flat_at_its_frequency():
    slope = [(left("zvd", 30.0 + d, 0.0) + left("zvd", 30.0 - d, 0.0)) / d for d in (0.1, 0.05)]
    assert slope[1] == pytest.approx(slope[0] / 2, rel=0.05)
    slope = [(left("zv", 30.0 + d, 0.0) + left("zv", 30.0 - d, 0.0)) / d for d in (0.1, 0.05)]
    assert slope[1] == pytest.approx(slope[0], rel=0.05)


@pytest.mark.parametrize("name", SHAPERS)
def test_a_shaped_profile_arrives_at_rest_within_the_limits_of_the_plain_one(name):
    profiles = [
        CONVENTIONAL,
        SymmetricProfiles(*(np.array([x]) for x in (0.0, 0.03, 0.0, 0.05))).general(),
    ]
    for plain in profiles:
        profile = shaped_profile(plain, name, 23.0, 0.03)
        d, j = profile.duration[-1], profile.jerk[-1]
        a, v, s = profile.acceleration[-1], profile.velocity[-1], profile.position[-1]
        assert s + v * d + a * d**2 / 2 + j * d**3 / 6 == pytest.approx(1.0)
        assert v + a * d + j * d**2 / 2 == pytest.approx(0.0, abs=1e-9)
        assert float(profile.peak_velocity[0]) <= float(plain.peak_velocity[0]) * (1 + 1e-9)
        assert float(profile.peak_acceleration[0]) <= float(plain.peak_acceleration[0]) * (1 + 1e-9)
        assert float(profile.greatest_jerk[0]) <= float(plain.greatest_jerk[0]) * (1 + 1e-9)


def test_an_unknown_shaper_is_refused_with_those_there_are():
    with pytest.raises(PlanError, match="no shaper 'zvdd'") as caught:
        shaper_impulses("zvdd", 30.0)
    assert "mzv" in caught.value.remedy
