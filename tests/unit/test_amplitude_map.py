"""Surveys: the modes they judge, what today's rapid leaves, the chosen point and the axes."""

import numpy as np
import pytest

from gcodejerk.errors import MachineError, PlanError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion.amplitudes import condition_amplitude
from gcodejerk.motion.residual import residual_acceleration
from gcodejerk.studies.amplitude_map import Survey

MS = 1e-3


def survey(machine, axis, length, **chosen):
    return Survey.of(Machine.load(find_machine(machine)), axis, length, **chosen)


def test_the_modes_are_the_axis_s_own_and_the_structure_s():
    assert [m.name for m in survey("router", "X", 20).modes] == ["carriage", "frame"]
    assert [m.name for m in survey("router", "z", 20).modes] == ["spindle"]
    assert survey("router", "X", 20).mode is None
    assert survey("router", "X", 20, mode="2").mode.name == "frame"
    assert survey("router", "X", 20, mode="carriage").counted_modes[0].frequency == 32


def test_what_todays_rapid_leaves_is_the_general_rule():
    # 1 mm: four equal segments of 10 ms; 8 mm: constant acceleration as well.
    short = survey("centre", "Z", 1, mode="1")
    times, steps = np.arange(5) * 10 * MS, [5e5, -1e6, 0.0, 1e6, -5e5]
    expected = float(residual_acceleration(times, steps, 30.0, 0.02))
    assert short.conventional_value == pytest.approx(expected, rel=1e-9)
    middle = survey("centre", "Z", -8, mode="column")
    constant = 0.5 * (np.sqrt(0.01**2 + 4 * 8 / 5000) - 0.03)
    ramps = [0.01, constant, 0.01, 0.01, constant, 0.01]
    jerks = np.array([1, 0, -1, -1, 0, 1]) * 5e5
    expected = float(
        residual_acceleration(
            np.concatenate([[0], np.cumsum(ramps)]), np.diff(jerks, prepend=0, append=0), 90.0, 0.03
        )
    )
    assert middle.conventional_time == pytest.approx(sum(ramps), rel=1e-9)
    assert middle.conventional_value == pytest.approx(expected, rel=1e-7)
    assert middle.conventional_peaks.acceleration == pytest.approx(5000.0)


def test_a_trapezoid_of_velocity_has_its_steps_of_acceleration():
    router = survey("router", "X", 20, mode="carriage")
    # Half of MAX_ACCELERATION, as LinuxCNC has it: 20 mm in two ramps, 100 mm/s is not reached.
    ramp = np.sqrt(20.0 / 300.0)
    ends, level = np.array([0.0, ramp, 2.0 * ramp]), np.array([300.0, -600.0, 300.0])
    pole = 2 * np.pi * 32.0 * (-0.04 + 1j * np.sqrt(1 - 0.04**2))
    response = abs((level * np.exp(pole * (ends[-1] - ends)) / pole).sum())
    assert router.conventional_value == pytest.approx(response * abs(pole) ** 2 / pole.imag)
    assert np.isinf(router.conventional_peaks.jerk)


def test_the_time_is_the_conventional_one_in_whole_intervals():
    assert survey("centre", "Z", 8).conventional_time == pytest.approx(0.0906226, abs=1e-7)
    assert survey("centre", "Z", 8).time == pytest.approx(0.091)
    assert survey("centre", "Z", 1).time == pytest.approx(0.040)


def test_the_papers_design_is_chosen():
    chosen = survey("paper", "Z", 1, mode="1").choose()
    assert (pytest.approx(1 * MS), pytest.approx(40 * MS)) == (chosen.T1, chosen.T_SUM)
    assert chosen.value == pytest.approx(5696.8, abs=0.06)


@pytest.mark.parametrize(
    ("machine", "axis", "length"),
    [
        ("centre", "Z", 1.7),
        ("centre", "X", 0.3),
        ("drill", "Y", 5),
        ("router", "X", 20),
        ("centre", "Z", 8),
    ],
)
@pytest.mark.parametrize("condition", ["I", "II", "III"])
def test_nothing_within_the_limits_is_much_better_than_the_choice(
    machine, axis, length, condition, four_segments
):
    made = survey(machine, axis, length, condition=condition)
    chosen, interval, limit = made.choose(), made.machine.interval, made.axis.limit
    T = chosen.T_SUM
    intervals = T / interval
    assert intervals == pytest.approx(round(intervals))
    assert made.conventional_time * (1 - 1e-9) <= chosen.T_SUM
    assert interval * (1 - 1e-9) <= chosen.T1 <= T / 2 - interval * (1 - 1e-9)
    # Where the limits need longer than today's rapid, no shorter time has any profile.
    shorter = [(T - interval, False)] if T - interval >= made.time * (1 - 1e-9) else []
    for total, exists in ((T, True), *shorter):
        T1 = np.random.default_rng(3).uniform(interval, total / 2 - interval, 1500)
        scan = four_segments(condition, T1, total)
        fits = (length * scan.V <= limit.velocity) & (length * scan.A <= limit.acceleration)
        fits &= length * scan.J <= limit.jerk
        if not exists:
            assert not fits.any()
            continue
        worst = np.zeros(len(T1))
        for m in made.modes:
            size = length * abs(m.participation_of(axis))
            worst = np.maximum(worst, size * scan.left(m.frequency, m.damping))
        if fits.any():
            assert chosen.value <= worst[fits].min() * (1 + 1e-4)


def test_the_next_null_is_a_null_on_the_interval():
    made = survey("paper", "Z", 1)
    T1, T = made.nearest_null(made.modes[0], 0.040)
    assert (pytest.approx(1.311, abs=5e-4), pytest.approx(0.049)) == (1e3 * T1, T)
    assert condition_amplitude("III", 1.0, T1, T, 30.0) < 1e-8
    later, same = made.nearest_null(made.modes[0], 0.090)
    assert (1e3 * later, same) == (pytest.approx(29.802, abs=5e-4), pytest.approx(0.090))
    assert survey("paper", "Z", 1, condition="I").nearest_null(made.modes[0], 0.04) is None


def test_axes_hold_the_conventional_time_well_inside():
    for machine, axis, length in (("centre", "Z", 1), ("drill", "X", 0.1), ("router", "Y", 300)):
        made = survey(machine, axis, length)
        T1, T = made.axes(50)
        assert len(T1) == len(T) == 50
        assert T[0] <= 0.6 * made.time < 2.1 * made.time < T[-1]
        assert 0 < T1[0] < T1[-1] < T[-1] / 2
        T1, T = made.interval_axes()
        for column in (T1, T):
            counts = column / made.machine.interval
            np.testing.assert_allclose(counts, np.round(counts), atol=1e-6)
        assert len(T) <= 1001


def test_what_cannot_be_surveyed_is_refused():
    with pytest.raises(MachineError, match="has no axis 'Q'"):
        survey("centre", "Q", 1)
    with pytest.raises(PlanError, match="moves by inf"):
        survey("centre", "Z", np.inf)
    with pytest.raises(PlanError, match="there is no condition"):
        survey("centre", "Z", 1, condition="V")
    with pytest.raises(PlanError, match="excites no mode 'sway'") as refused:
        survey("drill", "Y", 1, mode="sway")
    assert refused.value.remedy == (
        "choose a number or a name: 1 (table yaw), 2 (table pitch), 3 (bed); or all"
    )
    with pytest.raises(PlanError, match="before it begins"):
        survey("centre", "Z", 1).axes(10, longest=0.016)
