"""One move, as a user of the library sees it."""

import numpy as np
import pytest

from gcodejerk.errors import MachineError, PlanError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion import mode_poles, polyline_response
from gcodejerk.planning.move import plan_move

PAPER = Machine.load(find_machine("paper"))
VMC = Machine.load(find_machine("centre"))
ROUTER = Machine.load(find_machine("router"))
OMEGA = 2.0 * np.pi * 30.0

TWO = Machine.loads(
    """
interval: 0.001
positioning: independent
axes:
  Y: {resolution: 1.0e-5, rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}}
  Z: {resolution: 1.0e-5, rapid: {velocity: 600, acceleration: 3000, jerk: 2.0e+5}}
modes: [{frequency: 30, damping: 0.01, participation: {Y: 0.4, Z: 1.0}}]
"""
)


def test_the_paper_s_case_gives_the_paper_s_numbers():
    plan = plan_move({"Z": 1.0}, PAPER, T1=0.001)
    assert plan.time == plan.conventional_time == pytest.approx(0.040)
    assert plan.profile == "condition3"
    ((designed, conventional),) = plan.unsampled()
    assert designed == pytest.approx(5696.8, abs=0.05)
    assert conventional == pytest.approx(13209.3, abs=0.05)
    assert float(plan.residual[0, 0]) * OMEGA**2 == pytest.approx(5680, rel=2e-3)
    assert float(plan.conventional_residual[0, 0]) * OMEGA**2 == pytest.approx(13170, rel=2e-3)
    assert plan.profiles.segments(0)[0] == pytest.approx((0.001, 3846153.8))


def test_the_least_T1_is_the_best_for_the_paper_s_case():  # noqa: N802
    best, given = plan_move({"Z": 1.0}, PAPER), plan_move({"Z": 1.0}, PAPER, T1=0.001)
    np.testing.assert_array_equal(best.positions["Z"], given.positions["Z"])


def test_a_move_begins_at_zero_and_ends_exactly():
    for length in (1.0, -0.3333333333, 123.456789012345):
        plan = plan_move({"Z": length}, VMC)
        assert set(plan.positions) == {"X", "Y", "Z"}
        z = plan.positions["Z"]
        assert (z[0], z[-1]) == (0.0, length)
        assert not plan.positions["X"].any()
        np.testing.assert_allclose(plan.t, np.arange(len(z)) * 0.001, atol=1e-12)
        assert plan.t[-1] == pytest.approx(plan.time)
        assert (np.diff(z) * np.sign(length) >= 0).all()
        steps = z[1:-1] / 1e-4
        np.testing.assert_allclose(steps, np.rint(steps), atol=1e-5)


def test_axis_letters_may_be_small():
    assert plan_move({"z": 1.0}, PAPER).displacement == {"Z": 1.0}


def test_length_is_along_the_path():
    assert plan_move({"X": 3.0, "Y": -4.0, "Z": 12.0}, VMC).length == pytest.approx(13.0)


@pytest.mark.parametrize("machine", [TWO, VMC, ROUTER], ids=lambda m: m.name[:10])
def test_unsampled_amplitudes_are_those_of_finely_sampled_profiles(machine):
    row = {"Y": 3.7, "Z": -1.9}
    plan = plan_move(row, machine)
    modes = plan.plans.modes
    felt = [
        k for k, mode in enumerate(modes.modes) if any(mode.participation_of(a) for a in ("Y", "Z"))
    ]
    amplitudes = plan.unsampled()
    assert len(amplitudes) == len(felt)
    for k, (designed, conventional) in zip(felt, amplitudes, strict=True):
        pole = modes.poles[k : k + 1]
        for profiles, expected in (
            (plan.profiles, designed),
            (plan.plans.conventional, conventional),
        ):
            end = float(profiles.total.max())
            t = np.linspace(0.0, end, 20001)
            q = np.zeros_like(t)
            for n in range(len(profiles)):
                share = plan.plans.share[n] @ modes.participation[k]
                q += share * _position(profiles, n, t)
            found = np.abs(polyline_response(t, q, pole)[0]) / pole[0].imag * abs(pole[0]) ** 2
            assert found == pytest.approx(expected, rel=1e-3, abs=1e-3 * conventional + 1e-3)


def _position(profiles, n, t):
    """A unit profile by adding up its acceleration twice."""
    profile = profiles.take(slice(n, n + 1))
    a = np.zeros_like(t)
    for begin, d, level, j in zip(
        profile.begin, profile.duration, profile.acceleration, profile.jerk, strict=True
    ):
        a = np.where((t >= begin) & (t < begin + d), level + j * (t - begin), a)
    v = np.concatenate([[0.0], np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(t))])
    q = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * np.diff(t))])
    return np.interp(t, t, q / q[-1])


def test_independent_axes_arrive_in_their_own_time():
    plan = plan_move({"Y": 1.0, "Z": -8.0}, TWO)
    y, z = plan.positions["Y"], plan.positions["Z"]
    alone = [plan_move({"Y": 1.0}, TWO), plan_move({"Z": -8.0}, TWO)]
    assert plan.time == alone[1].time > alone[0].time
    count = len(alone[0].t)
    np.testing.assert_allclose(y[:count], alone[0].positions["Y"], atol=2e-5)
    assert (y[count - 1 :] == 1.0).all()
    np.testing.assert_allclose(z, alone[1].positions["Z"], atol=2e-5)
    # A structure mode hears both, each at its own moment.
    pole = mode_poles([30.0], [0.01])
    D = np.abs(polyline_response(plan.t, 0.4 * y + z, pole)) / pole.imag
    assert float(plan.residual[0, 0]) == pytest.approx(float(D[0]), rel=1e-9)


def test_an_extended_move_says_how_long_the_controller_takes():
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n"
        "  X: {rapid: {velocity: 100, acceleration: 500}, limit: {jerk: 1.0e+5}, "
        "modes: [{frequency: 97, damping: 0}]}\n"
    )
    plan = plan_move({"X": 30.0}, machine)
    assert plan.planned
    assert plan.conventional_time == pytest.approx(0.5)
    # Acceleration rises and falls within 5 ms.
    assert plan.time == pytest.approx(0.505)


def test_a_kept_conventional_profile_says_so():
    plan = plan_move({"Z": 1.0}, PAPER, "conventional")
    assert (plan.planned, plan.profile) == (True, "conventional")
    # The copy's own, as rounded: not what the control itself leaves, but near.
    pole = mode_poles([30.0], [0.0])
    D = np.abs(polyline_response(plan.t, plan.positions["Z"], pole)) / pole.imag
    assert float(plan.residual[0, 0]) == pytest.approx(float(D[0]), rel=1e-9)
    np.testing.assert_allclose(plan.residual, plan.conventional_residual, rtol=1e-4)


@pytest.mark.parametrize(
    ("row", "arguments", "kind", "said"),
    [
        ({"Q": 1.0}, {}, MachineError, r"has no axis 'Q', it has Z"),
        ({"X": 1.0}, {}, MachineError, r"has no axis 'X', it has Z"),
        ({"Z": float("nan")}, {}, PlanError, r"Z moves by nan"),
        ({"Z": float("inf")}, {}, PlanError, r"Z moves by inf"),
        ({"Z": 0.0}, {}, PlanError, r"not planned: no axis moves"),
        ({}, {}, PlanError, r"not planned: no axis moves"),
        ({"Z": 1.0}, {"time": 0.0}, PlanError, r"the time is 0 s, expected more than zero"),
        ({"Z": 1.0}, {"time": -1.0}, PlanError, r"the time is -1 s"),
        ({"Z": 1.0}, {"time": float("nan")}, PlanError, r"the time is nan s"),
        ({"Z": 1.0}, {"time": float("inf")}, PlanError, r"the time is inf s"),
        ({"Z": 1.0}, {"time": 0.028}, PlanError, r"axis Z reaches .* in 0.028 s, above its limit"),
        ({"Z": 1.0}, {"T1": 0.03}, PlanError, r"T1 is 0.03 s, outside 0 < T1 < T_SUM/2 = 0.02 s"),
        ({"Z": 1.0}, {"T1": 0.016}, PlanError, r"axis Z reaches \S+ mm/s\^2 of acceleration"),
        ({"Z": 1.0}, {"profile": "best"}, PlanError, r"there is no profile 'best'"),
    ],
)
def test_a_move_that_cannot_be_planned_is_refused_with_its_reason(row, arguments, kind, said):
    with pytest.raises(kind, match=said) as caught:
        plan_move(row, PAPER, **arguments)
    assert caught.value.remedy


def test_a_move_that_no_profile_improves_stays_as_it_is_today_and_says_why():
    # 2.9 s of cruise and 0.2 s of ramps are whole periods of 17 Hz together: the trapezoid's null.
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  X: {rapid: {velocity: 100, "
        "acceleration: 500}, limit: {acceleration: 1000}, modes: [{frequency: 17, damping: 0}]}\n"
        "design: {band: 0}\n"
    )
    plan = plan_move({"X": 300.0}, machine)
    assert (plan.planned, plan.reason) == (False, "no profile within the limits is better")
    assert (plan.profile, plan.conventional_time) == ("conventional", pytest.approx(3.2))
    assert plan.time == pytest.approx(3.2)
    # A trapezoid: 0.2 s up at 500 mm/s^2, 2.8 s at 100 mm/s, 0.2 s down.
    t = plan.t
    up, down = 250.0 * np.minimum(t, 0.2) ** 2, 250.0 * np.clip(t - 3.0, 0.0, 0.2) ** 2
    exact = up + 100.0 * np.clip(t - 0.2, 0.0, 3.0) - down
    np.testing.assert_allclose(plan.positions["X"], exact, atol=0.00051)
    assert repr(plan) == (
        "<Plan X300: conventional (no profile within the limits is better), 3.2 s on '<machine>'>"
    )


def test_a_move_that_the_limits_leave_no_room_for_stays_as_it_is_today():
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  X: {rapid: {velocity: 100, "
        "acceleration: 500}, limit: {jerk: 1000}, modes: [{frequency: 17, damping: 0}]}\n"
    )
    plan = plan_move({"X": 10.0}, machine)
    assert (plan.planned, plan.reason) == (False, "limits cannot be met")
    assert plan.profile == "conventional"
    np.testing.assert_array_equal(plan.residual, plan.conventional_residual)


def test_a_machine_without_modes_is_the_reason_by_its_name():
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n"
        "  X: {rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}, modes: []}\n"
    )
    plan = plan_move({"X": 20.0}, machine)
    assert (plan.planned, plan.reason) == (False, "no modes in the machine file")


@pytest.mark.parametrize("profile", ["optimal", "cascade", "shortest"])
def test_a_given_t1_is_that_of_condition_three(profile):
    with pytest.raises(PlanError, match="condition3, and no"):
        plan_move({"Z": 1.0}, PAPER, profile, T1=0.001)
    assert plan_move({"Z": 1.0}, PAPER, T1=0.001).profile == "condition3"


@pytest.mark.parametrize("length", [0.02, 0.05, 0.0566, 0.06, 0.0872])
def test_what_is_as_short_as_an_interval_is_not_planned(length):
    machine = Machine.loads(
        "interval: 0.004\npositioning: linear\naxes:\n  X: {resolution: 0.001, rapid: {velocity: "
        "350, acceleration: 15000, planner: trapezoidal}, limit: {velocity: 420, acceleration: "
        "60000, jerk: 5.0e+5}, modes: [{frequency: 1.7, damping: 0.02, participation: 1}]}\n"
        "design: {tolerance: 0.001}\n"
    )
    assert not plan_move({"X": length}, machine, "shortest").planned
