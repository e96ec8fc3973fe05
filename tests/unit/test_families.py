"""The laws by which controls move: against their description, stepped in time on its own."""

import numpy as np
import pytest
from scipy.integrate import trapezoid
from simulation import (
    DT,
    behind_averages,
    four_ramps,
    left_by,
    marlin,
    moved,
    quintic,
    two_stages,
)

from gcodejerk.axes import AXES
from gcodejerk.motion import mode_poles, profiles_response
from gcodejerk.motion.families import FAMILIES, Kind, unit_quantities
from gcodejerk.motion.profiles.conditions import condition_profiles

MODES = [(11.0, 0.0), (30.0, 0.02), (87.0, 0.07)]


def built(name, **values):
    """One profile of a family."""
    columns = {key: np.array([value]) for key, value in values.items()}
    return FAMILIES[name].build(**columns)


def agrees(profile, acceleration, dt=DT):
    """Whether a stepped law ends when and as a profile does, and leaves modes the same."""
    total, peak = float(profile.total[0]), float(profile.peak_velocity[0])
    assert len(acceleration) * dt == pytest.approx(total, abs=6 * dt)
    speed, way = moved(acceleration, dt)
    assert way == pytest.approx(1.0, abs=2e-3)
    assert speed == pytest.approx(0.0, abs=2e-3 * peak)
    for f, zeta in MODES:
        mine = abs(profiles_response(profile, mode_poles([f], [zeta]))[0, 0])
        assert mine == pytest.approx(left_by(acceleration, dt, f, zeta), abs=4e-3 * peak), f


def lies_at_the_end(profile):
    last = profile.first[1:] - 1
    d = profile.duration[last]
    v = profile.velocity[last] + (profile.acceleration[last] + profile.jerk[last] * d / 2) * d
    p = (
        profile.position[last]
        + (
            profile.velocity[last]
            + (profile.acceleration[last] / 2 + profile.jerk[last] * d / 6) * d
        )
        * d
    )
    assert p == pytest.approx(1.0, abs=1e-9)
    assert v == pytest.approx(0.0, abs=1e-9 * float(profile.peak_velocity.max()))


def test_time_constants_are_averages_of_the_commanded_speed():
    profile = built("time-constants", velocity=3.7, first_average=0.0642, second_average=0.0214)
    agrees(profile, behind_averages(3.7, 0.0642, 0.0214))
    assert float(profile.total[0]) == pytest.approx(1 / 3.7 + 0.0642 + 0.0214)


def test_a_second_average_of_zero_is_none():
    profile = built("time-constants", velocity=3.7, first_average=0.0642, second_average=0.0)
    agrees(profile, behind_averages(3.7, 0.0642))


@pytest.mark.parametrize("acceleration", [57.6, 9.3])
def test_averaged_trapezoids_take_longer_for_their_average(acceleration):
    """A long move, and one that does not reach its speed."""
    v = min(3.7, acceleration**0.5)
    profile = built(
        "averaged-trapezoid", velocity=3.7, acceleration=acceleration, second_average=0.0214
    )
    agrees(profile, behind_averages(v, v / acceleration, 0.0214))


def test_seven_segments_that_reach_their_limits_are_three_averages():
    profile = built("jerk-limited", velocity=3.7, acceleration=57.6, jerk=2690.0)
    agrees(profile, behind_averages(3.7, 3.7 / 57.6, 57.6 / 2690.0))


def test_the_table_of_300_mm():
    """V 500 mm/s, A 5000 mm/s^2, J 150000 mm/s^3: seven segments, as the controls play them."""
    V, A, J = 500 / 300, 5000 / 300, 150000 / 300
    profile = built("jerk-limited", velocity=V, acceleration=A, jerk=J)
    times = [0.0, 0.033333, 0.1, 0.133333, 0.6, 0.633333, 0.7, 0.733333]
    assert [*profile.begin, *profile.total] == pytest.approx(times, abs=1e-6)
    way = [0, 0.925926, 17.592593, 33.333333, 266.666667, 282.407407, 299.074074]
    assert 300 * profile.position == pytest.approx(way, abs=1e-6)
    same = built("time-constants", velocity=V, first_average=0.1, second_average=1 / 30)
    assert same.total == pytest.approx(profile.total)
    assert 300 * same.position == pytest.approx(way, abs=1e-6)


def test_what_an_undamped_mode_keeps_is_a_product_of_three():
    """displacement = D |sinc(f D/V) sinc(f V/A) sinc(f A/J)|"""
    V, A, J, f = 3.7, 57.6, 2690.0, np.array([7.3, 19.1, 44.0])
    profile = built("jerk-limited", velocity=V, acceleration=A, jerk=J)
    left = np.abs(profiles_response(profile, mode_poles(f, 0.0)))[0] / (2 * np.pi * f)
    assert left == pytest.approx(np.abs(np.sinc(f / V) * np.sinc(f * V / A) * np.sinc(f * A / J)))


def test_the_example_of_heidenhain():
    """0.5 m/s and 70 m/s^3: 5.916 m/s^2 within 84.5 ms, full speed after two of them (p. 813)."""
    profile = built("jerk-limited", velocity=0.5, acceleration=99.0, jerk=70.0)
    assert profile.peak_acceleration[0] == pytest.approx(5.916, abs=5e-4)
    assert profile.duration[:2] == pytest.approx([0.0845, 0.0845], abs=5e-5)
    # The shortest way on which full speed is reached: 84.5 mm.
    shortest = 0.0845154
    unit = built("jerk-limited", velocity=0.5 / shortest, acceleration=1e3, jerk=70 / shortest)
    assert unit.peak_velocity[0] * shortest == pytest.approx(0.5, rel=1e-5)
    assert len(unit.begin) <= 5


# Limits of unit moves that reach everything, the acceleration alone, or neither.
REACHES = [(2.9, 31.0, 44.0), (40.0, 31.0, 44.0), (40.0, 200.0, 300.0), (2.9, 200.0, 44.0)]
TIMES = (0.0413, 0.0897, 0.0551, 0.0222)


@pytest.mark.parametrize("limits", REACHES)
def test_four_ramps_are_as_the_manual_says(limits):
    V, A, D = limits
    profile = built(
        "four-ramp", velocity=V, acceleration=A, deceleration=D,
        rise=TIMES[0], fall=TIMES[1], braking_rise=TIMES[2], braking_fall=TIMES[3],
    )  # fmt: skip
    lies_at_the_end(profile)
    agrees(profile, four_ramps(V, A, D, *TIMES))


def test_four_ramps_of_two_times_are_condition_iii():
    T_SUM, T1 = 0.0413, 0.0017
    T2 = T_SUM / 2 - T1
    A = 6.0 / (T_SUM * (T_SUM - T1))
    profile = built(
        "four-ramp", velocity=99.0, acceleration=A, deceleration=A,
        rise=T1, fall=T2, braking_rise=T2, braking_fall=T1,
    )  # fmt: skip
    want = condition_profiles("III", np.array([T1]), np.array([T_SUM]))
    assert profile.duration == pytest.approx(want.duration)
    assert profile.jerk == pytest.approx(want.jerk)


def test_four_ramps_of_one_time_are_seven_segments():
    for V, A in ((2.9, 31.0), (40.0, 31.0), (40.0, 900.0)):
        T = 0.0413
        ramps = dict.fromkeys(("rise", "fall", "braking_rise", "braking_fall"), T)
        profile = built("four-ramp", velocity=V, acceleration=A, deceleration=A, **ramps)
        want = built("jerk-limited", velocity=V, acceleration=A, jerk=A / T)
        assert profile.total == pytest.approx(want.total)
        assert profile.duration.sum() == pytest.approx(want.duration.sum())


def test_ramps_of_no_time_are_steps_of_the_acceleration():
    ramps = dict.fromkeys(("rise", "fall", "braking_rise", "braking_fall"), 0.0)
    profile = built("four-ramp", velocity=2.9, acceleration=31.0, deceleration=44.0, **ramps)
    assert profile.acceleration.tolist() == [31.0, 0.0, -44.0]


@pytest.mark.parametrize(
    ("V", "change"), [(2.9, 1.7), (40.0, 3.1), (40.0, 9.0), (2.9, 5.0)],
    ids=["cruise", "second stage", "first stage", "never in it"],
)  # fmt: skip
def test_two_stages_are_as_the_manual_says(V, change):
    values = (31.0, 22.0, 44.0, 15.0)
    names = ("acceleration", "upper_acceleration", "deceleration", "upper_deceleration")
    profile = built(
        "two-stage", velocity=V, changeover=change, **dict(zip(names, values, strict=True))
    )
    lies_at_the_end(profile)
    agrees(profile, two_stages(V, *values, change))


@pytest.mark.parametrize("limits", [(2.9, 31.0), (40.0, 31.0)])
def test_marlins_polynomials_are_those_of_its_source(limits):
    V, A = limits
    profile = built("poly5", velocity=V, acceleration=A)
    lies_at_the_end(profile)
    assert profile.peak_acceleration[0] == pytest.approx(1.5 * A, rel=3e-3)
    agrees(profile, marlin(V, A))
    for overshoot in (1.3, 1.875):
        profile = built("poly6", velocity=V, acceleration=A, overshoot=overshoot)
        lies_at_the_end(profile)
        assert profile.peak_acceleration[0] == pytest.approx(overshoot * A, rel=3e-3)
        agrees(profile, marlin(V, A, overshoot))


@pytest.mark.parametrize("limits", [(2.9, 800.0), (40.0, 800.0)])
def test_quintic_ramps_pass_the_length_that_g2core_reckons_with(limits):
    """2.40281 sqrt(dv/J) of a ramp: its speed 10 u^3 - 15 u^4 + 6 u^5 of the whole."""
    V, J = limits
    law = quintic(V, J)
    profile = built("quintic", velocity=V, jerk=J)
    lies_at_the_end(profile)
    assert float(np.abs(np.diff(law)).max()) / DT == pytest.approx(J, rel=5e-3)
    assert profile.greatest_jerk[0] == pytest.approx(J, rel=0.01)
    agrees(profile, law)


@pytest.mark.parametrize(
    ("V", "A"), [(2.9, 31.0), (2.9, 200.0), (40.0, 31.0), (40.0, 2000.0)],
    ids=["plateau", "triangle", "short, plateau", "short, triangle"],
)  # fmt: skip
def test_notch_ramps_are_averages_of_which_one_has_the_notch(V, A):
    f = 19.0
    profile = built("notch-ramp", velocity=V, acceleration=A, notch=f)
    lies_at_the_end(profile)
    v = float(profile.peak_velocity[0])
    agrees(profile, behind_averages(v, max(1 / f, v / A), 1 / f))
    assert profile.peak_acceleration[0] <= A * (1 + 1e-12)
    left = np.abs(profiles_response(profile, mode_poles([f], 0.0)))[0, 0]
    assert left < 1e-9 * v


def test_notch_ramps_of_kalicos_table():
    """55 Hz, 200 mm/s, nothing limits: 36.4 ms of ramp at 11000 mm/s^2; runway 7.27 mm for two."""
    profile = built("notch-ramp", velocity=200 / 400, acceleration=1e6 / 400, notch=55.0)
    assert profile.begin[2] == pytest.approx(0.03636, abs=1e-5)
    assert 400 * profile.peak_acceleration[0] == pytest.approx(11000.0)


def test_a_smooth_law_in_pieces_is_right_where_the_pieces_end():
    """What three pieces for each of 32 parts leave is within 1e-4 of the peak speed."""
    profile = built("quintic", velocity=2.9, jerk=800.0)
    fine = np.linspace(0.0, 1.0, 20001)
    T, v = float(profile.begin[96]), 2.9
    a = v / T * 30 * fine**2 * (1 - fine) ** 2
    for f, zeta in [*MODES, (211.0, 0.0)]:
        pole = mode_poles([f], [zeta])[0]
        up = trapezoid(a * np.exp(pole * (profile.total[0] - fine * T)), fine * T)
        down = trapezoid(-a * np.exp(pole * (T - fine * T)), fine * T)
        mine = profiles_response(profile, np.array([pole]))[0, 0]
        assert abs(mine - up - down) < (1e-4 if f > 100 else 3e-6) * v


def test_quantities_of_a_straight_rapid():
    """Limits by the axis that has least; times by the axis whose acceleration binds."""
    family = FAMILIES["averaged-trapezoid"]
    values = {name: np.zeros(9) for name in ("velocity", "acceleration", "second_average")}
    for axis, v, a, t in (("X", 500.0, 5000.0, 0.033), ("Y", 300.0, 4000.0, 0.041)):
        at = AXES.index(axis)
        values["velocity"][at], values["acceleration"][at] = v, a
        values["second_average"][at] = t
    share = np.zeros((3, 9))
    share[:, AXES.index("X")] = [100.0, 100.0, 0.0]
    share[:, AXES.index("Y")] = [0.0, -70.0, 50.0]
    unit = unit_quantities(family, values, share)
    assert unit["velocity"] == pytest.approx([5.0, 300 / 70, 6.0])
    assert unit["acceleration"] == pytest.approx([50.0, 50.0, 80.0])
    assert unit["second_average"] == pytest.approx([0.033, 0.033, 0.041])


def test_settings_as_rows_come_one_after_the_other():
    family = FAMILIES["notch-ramp"]
    per_axis = {q.name: np.full(9, 100.0) for q in family.quantities}
    per_axis["notch"] = np.stack([np.full(9, 20.0), np.full(9, 30.0)])
    share = np.zeros((2, 9))
    share[:, 0] = [10.0, 40.0]
    unit = unit_quantities(family, per_axis, share)
    assert unit["notch"].tolist() == [20.0, 20.0, 30.0, 30.0]
    assert unit["velocity"].tolist() == [10.0, 2.5, 10.0, 2.5]
    assert len(family.profiles(per_axis, share)) == 4


def test_every_family_says_what_it_is():
    for name, family in FAMILIES.items():
        assert family.name == name
        assert family.title
        assert family.source
        assert {q.kind for q in family.quantities} <= set(Kind)
        names = [q.name for q in family.quantities]
        assert len(set(names)) == len(names)
