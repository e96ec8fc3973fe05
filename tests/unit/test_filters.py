"""Filters behind the interpolation: against the controls' own formulas and a stepped simulation."""

import numpy as np
import pytest
from simulation import averaged, delayed, left_by, samples

from gcodejerk.errors import PlanError
from gcodejerk.motion import conventional_profiles, mode_poles, profiles_response
from gcodejerk.motion.families.filtered import averaged_profiles, filtered
from gcodejerk.motion.families.filters import (
    KINDS,
    SHAPER_KINDS,
    cumulative_impulses,
    impulse_transfer,
    impulses,
    length,
    transfer,
)

PROFILES = conventional_profiles(
    [600.0, 5.0, 3.1, 0.9], [5000.0, 60.0, 80.0, 1.7], [5e5, 900.0, np.inf, np.inf]
).general()

# For 30 Hz and a damping ratio of 0.1: delays [ms] and amplitudes, worked out from the formulas in
# the controls' sources (named in `filters`) on their own.
IMPULSES = {
    "zv": ([0.0, 16.75063], [0.57828618, 0.42171382]),
    "zvd": ([0.0, 16.75063, 33.501261], [0.33441491, 0.48774255, 0.17784254]),
    "zvdd": ([0.0, 16.75063, 33.501261, 50.251891],
             [0.19338752, 0.42308216, 0.30853166, 0.07499866]),
    "zvddd": ([0.0, 16.75063, 33.501261, 50.251891, 67.002521],
              [0.11183333, 0.32621676, 0.35683919, 0.17348275, 0.03162797]),
    "mzv": ([0.0, 12.562973, 25.125945], [0.36512789, 0.40748935, 0.22738276]),
    "marlin-mzv": ([0.0, 12.562973, 25.125945], [0.39015043, 0.40236676, 0.20748281]),
    "ei": ([0.0, 16.75063, 33.501261], [0.35070578, 0.46278816, 0.18650606]),
    "2hei": ([0.0, 16.75063, 33.501261, 50.251891],
             [0.24554657, 0.38122169, 0.278005, 0.09522674]),
    "3hei": ([0.0, 16.75063, 33.501261, 50.251891, 67.002521],
             [0.19745751, 0.30431594, 0.28054706, 0.16183585, 0.05584364]),
    "klipper-ei": ([0.0, 16.908005, 33.501261], [0.35488138, 0.45299809, 0.19212053]),
    "2hump_ei": ([0.0, 17.196853, 33.606873, 49.630877],
                 [0.25853548, 0.3599357, 0.27276382, 0.10876501]),
    "ei2": ([0.0, 17.283488, 33.776179, 49.880908],
            [0.2586675, 0.3601195, 0.27290311, 0.10830989]),
    "3hump_ei": ([0.0, 18.01673, 34.268367, 50.196633, 66.09757],
                 [0.22085441, 0.27721147, 0.25969969, 0.16705516, 0.07517927]),
    "ei3": ([0.0, 18.107495, 34.441004, 50.449515, 66.430557],
            [0.2208542, 0.2772112, 0.25969944, 0.167055, 0.07518016]),
}  # fmt: skip


def test_every_shaper_has_numbers_of_its_own_source():
    assert set(IMPULSES) == set(SHAPER_KINDS)


@pytest.mark.parametrize("kind", IMPULSES)
def test_impulses_are_those_of_the_source(kind):
    delays, amplitudes = impulses(kind, 30.0, 0.1)
    assert delays * 1e3 == pytest.approx(IMPULSES[kind][0], abs=1e-6)
    assert amplitudes == pytest.approx(IMPULSES[kind][1], abs=1e-8)


@pytest.mark.parametrize("kind", SHAPER_KINDS)
def test_settings_at_once_are_those_one_by_one(kind):
    f, zeta = np.array([11.0, 30.0, 77.0]), np.array([0.0, 0.07, 0.15])
    together = impulses(kind, f, zeta)
    for i in range(3):
        for all_of_them, one in zip(together, impulses(kind, f[i], zeta[i]), strict=True):
            assert all_of_them[i] == pytest.approx(one)


def test_marlin_rounds_the_distance_of_impulses_to_its_tick():
    delays, _ = impulses("zvd", [30.0, 41.0], 0.1, tick=0.001)
    assert delays * 1e3 == pytest.approx(np.array([[0.0, 17.0, 34.0], [0.0, 12.0, 24.0]]))


def test_a_custom_shaper_of_reprapfirmware_is_cumulative():
    """The same ZV as `M593 P"custom" H0.53924 T0.0166875`: 30 Hz, damping 0.05."""
    delays, amplitudes = cumulative_impulses([0.53924], [0.0166875])
    want = impulses("zv", 30.0, 0.05)
    assert delays == pytest.approx(want[0], abs=1e-7)
    assert amplitudes == pytest.approx(want[1], abs=1e-5)
    left = np.abs(impulse_transfer(delays, amplitudes, mode_poles([30.0], [0.05])))
    assert float(left[0]) < 1e-4


def test_averages_leave_what_the_table_of_lengths_says():
    left = transfer("average", [0.032, 0.033, 1 / 30, 0.034], 0.0, mode_poles([27, 30, 33], 0.0))
    table = [[15.3, 4.16, 5.28], [12.0, 1.01, 8.07], [10.9, 0.0, 8.94], [8.83, 1.96, 10.6]]
    for row, want in zip(100.0 * np.abs(left), table, strict=True):
        assert row == pytest.approx(want, rel=5e-3, abs=1e-9)


def test_an_average_of_no_length_changes_nothing():
    assert np.allclose(transfer("average", [0.0, 1e-15], 0.0, mode_poles([30.0], 0.02)), 1.0)
    assert length("average", [0.0]).tolist() == [0.0]


@pytest.mark.parametrize("kind", KINDS)
def test_profiles_behind_a_filter_leave_what_the_transfer_says(kind):
    poles = mode_poles([7.0, 30.0, 173.0], [0.0, 0.03, 0.11])
    f, zeta = np.array([31.0, 13.0, 55.0, 91.0]), np.array([0.0, 0.03, 0.05, 0.12])
    x = 1.0 / f if kind in ("average", "triangle") else f
    behind = filtered(PROFILES, kind, x, zeta)
    assert behind.total == pytest.approx(PROFILES.total + length(kind, x, zeta), abs=1e-12)
    last = behind.first[1:] - 1
    d = behind.duration[last]
    end = (
        behind.position[last]
        + (behind.velocity[last] + (behind.acceleration[last] / 2 + behind.jerk[last] * d / 6) * d)
        * d
    )
    assert end == pytest.approx(1.0, abs=1e-10)
    want = profiles_response(PROFILES, poles) * transfer(kind, x, zeta, poles)
    peak = behind.peak_velocity[:, np.newaxis]
    assert np.abs(profiles_response(behind, poles) - want).max(axis=1) == pytest.approx(
        0.0, abs=1e-4 * float(peak.min())
    )


@pytest.mark.parametrize("kind", ["average", "triangle", "zv", "mzv", "zvdd"])
@pytest.mark.parametrize("row", range(4))
def test_a_stepped_simulation_leaves_as_much(kind, row):
    """The base move sampled and convolved on a grid of 20 us, the mode by matrix exponentials."""
    dt, zeta = 2e-5, 0.03
    base = PROFILES.take([row])
    a = samples(base, dt)
    if kind in ("average", "triangle"):
        x = 0.0271
        a = averaged(a, x, dt)
        if kind == "triangle":
            a = averaged(a, x, dt)
    else:
        x = 31.7
        a = delayed(a, *(y[0] for y in impulses(kind, [x], [0.02])), dt)
    behind = filtered(base, kind, x, 0.02)
    for f in (9.0, 23.0, 44.0):
        mine = np.abs(profiles_response(behind, mode_poles([f], [zeta])))[0, 0]
        # Delays and lengths are off by up to half a step.
        assert mine == pytest.approx(
            left_by(a, dt, f, zeta), abs=3e-3 * float(base.peak_velocity[0])
        )


def test_two_averages_of_different_lengths_are_one_after_the_other():
    both = averaged_profiles(PROFILES, 0.021, 0.008)
    poles = mode_poles([19.0, 60.0], 0.02)
    want = averaged_profiles(averaged_profiles(PROFILES, 0.021), 0.008)
    assert both.total == pytest.approx(want.total)
    off = np.abs(profiles_response(both, poles) - profiles_response(want, poles)).max(axis=1)
    assert (off < 1e-4 * both.peak_velocity).all()


def test_an_averaged_profile_does_not_depend_on_those_beside_it():
    together = averaged_profiles(PROFILES, 0.021)
    for i in range(len(PROFILES)):
        alone = averaged_profiles(PROFILES.take([i]), 0.021)
        assert np.array_equal(together.take([i]).jerk, alone.jerk)


def test_an_averaged_trapezoid_is_a_trapezoid_of_acceleration():
    """1 in steps of speed over 0.2 s, 5 1/s^2: 0.4 s of ramps; the average is exact."""
    profile = averaged_profiles(conventional_profiles([1.0], [5.0], [np.inf]).general(), 0.05)
    assert float(profile.total[0]) == pytest.approx(1.0 + 0.2 + 0.05)
    assert float(profile.peak_acceleration[0]) == pytest.approx(5.0)
    assert float(profile.greatest_jerk[0]) == pytest.approx(100.0)


def test_an_unknown_kind_is_refused():
    with pytest.raises(PlanError, match="there is no shaper 'zvx'"):
        transfer("zvx", 30.0, 0.0, mode_poles([30.0], 0.0))
