"""Which profile today's rapids follow, and what is said where the file contradicts its control."""

import dataclasses

import numpy as np
import pytest

from gcodejerk.machine import BELL, LINUXCNC, Machine, MachineFileError, machine_yaml
from gcodejerk.motion import mode_poles, profiles_response
from gcodejerk.planning.move import plan_move
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task
from gcodejerk.rewrite.pipeline import process

HEAD = "interval: 0.001\npositioning: linear\n"


def machine(rapid, head="", limit="{jerk: 5.0e+6}"):
    mode = "modes: [{frequency: 30, damping: 0.02}]"
    return Machine.loads(
        f"{head}{HEAD}axes:\n  Z:\n    rapid: {rapid}\n    limit: {limit}\n    {mode}\n"
    )


PLAIN = "{velocity: 600, acceleration: 5000}"
JERK = "{velocity: 600, acceleration: 5000, jerk: 5.0e+5}"


@pytest.mark.parametrize(
    ("head", "rapid", "planner"),
    [
        ("", PLAIN, "trapezoidal"),
        ("", JERK, "jerk-limited"),
        ("controller: linuxcnc\n", PLAIN, "linuxcnc-2.9"),
        ("controller: linuxcnc\n", JERK, "jerk-limited"),
        ("controller: grbl\n", PLAIN, "trapezoidal"),
        ("controller: csv\n", PLAIN, "trapezoidal"),
        ("controller: linuxcnc\n", PLAIN[:-1] + ", planner: trapezoidal}", "trapezoidal"),
        ("controller: fanuc\n", PLAIN[:-1] + ", planner: linuxcnc-2.9}", "linuxcnc-2.9"),
        ("controller: fanuc\n", JERK[:-1] + ", planner: bell}", "bell"),
    ],
)
def test_the_profile_is_the_stated_one_or_that_of_the_control(head, rapid, planner):
    made = machine(rapid, head)
    assert made.planner == planner == made.axis("Z").planner
    again = Machine.loads(machine_yaml(made))
    assert again == made
    assert again.settings_hash == made.settings_hash


@pytest.mark.parametrize(
    ("head", "rapid", "warns"),
    [
        ("controller: linuxcnc\n", JERK, "LinuxCNC 2.9 has no jerk limit"),
        ("controller: grbl\n", JERK, "grbl has no jerk limit"),
        ("controller: linuxcnc\n", JERK[:-1] + ", planner: linuxcnc-2.9}", "is not used"),
        ("", JERK[:-1] + ", planner: trapezoidal}", "is not used"),
        ("controller: linuxcnc\n", JERK[:-1] + ", planner: jerk-limited}", None),
        ("controller: linuxcnc\n", PLAIN, None),
        ("controller: fanuc\n", JERK, None),
    ],
)
def test_a_jerk_beside_a_control_without_one_is_told_at_its_place(head, rapid, warns):
    found = [str(w) for w in machine(rapid, head).warnings]
    assert len(found) == (warns is not None)
    if warns:
        assert warns in found[0]
        assert found[0].startswith("<machine>:")


def test_a_planner_that_needs_a_jerk_is_refused_without_one():
    for planner in ("jerk-limited", "bell"):
        with pytest.raises(MachineFileError, match=r"needs axes\.Z\.rapid\.jerk"):
            machine(PLAIN[:-1] + f", planner: {planner}}}")


def test_one_control_makes_the_rapids_of_all_axes():
    text = HEAD + (
        "axes:\n  X: {rapid: {velocity: 1, acceleration: 10, planner: linuxcnc-2.9}}\n"
        "  Y: {rapid: {velocity: 1, acceleration: 10, planner: trapezoidal}}\n"
    )
    with pytest.raises(MachineFileError, match="one control makes the rapids"):
        Machine.loads(text)
    # Of an axis that says nothing the same holds.
    one = Machine.loads(text.replace(", planner: trapezoidal", ""))
    assert [axis.planner for axis in one.axes] == [LINUXCNC, LINUXCNC]


@pytest.mark.parametrize(
    ("rapid", "length", "time"),
    [
        (PLAIN[:-1] + ", planner: linuxcnc-2.9}", 1.0, 2 * np.sqrt(1 / 2500)),
        (PLAIN[:-1] + ", planner: linuxcnc-2.9}", 200.0, 200 / 600 + 600 / 2500),
        (PLAIN[:-1] + ", planner: trapezoidal}", 1.0, 2 * np.sqrt(1 / 5000)),
        (JERK[:-1] + ", planner: trapezoidal}", 1.0, 2 * np.sqrt(1 / 5000)),
        (JERK, 1.0, 0.040),
        (JERK[:-1] + ", planner: bell}", 1.0, 2 * np.sqrt(1 / 5000) + 0.010),
        (JERK[:-1] + ", planner: bell}", 200.0, 200 / 600 + 600 / 5000 + 0.010),
    ],
)
def test_conventional_times_are_those_of_the_profile(rapid, length, time):
    plan = plan_move({"Z": length}, machine(rapid, limit="{acceleration: 9000, jerk: 5.0e+6}"))
    assert plan.conventional_time == pytest.approx(time, rel=1e-9)
    assert plan.time == pytest.approx(np.ceil(time / 0.001 - 1e-6) * 0.001, abs=1e-9)


def simulated(acceleration, dt, frequency, damping):
    """What an oscillator keeps, integrated step by step: acceleration constant within a step."""
    pole = mode_poles(frequency, damping)
    state = 0j
    for a in acceleration:
        state = state * np.exp(pole * dt) + a * (np.exp(pole * dt) - 1.0) / pole
    return abs(state) / pole.imag


@pytest.mark.parametrize("length", [0.05, 0.3, 1.0, 3.7, 40.0, 200.0])
def test_a_bell_is_a_trapezoid_behind_a_moving_average(length):
    made = machine("{velocity: 200, acceleration: 4000, jerk: 1.6e+5, planner: bell}")
    share = np.zeros((1, 9))
    share[0, 2] = length
    profile = Task.of(made, Modes.of(made), share).conventional
    dt, width = 2.5e-6, 0.025
    V, A = 200.0, 4000.0
    v = min(V, np.sqrt(length * A))
    t = np.arange(0, length / v + v / A + width, dt) + 0.5 * dt
    rise, end = v / A, length / v + v / A
    trapezoid = np.clip(np.minimum(t, end - t) * A, 0.0, v)
    boxes = round(width / dt)
    velocity = np.convolve(trapezoid, np.ones(boxes) / boxes)[: len(t)]
    assert rise > 0
    assert float(profile.total[0]) == pytest.approx(end + width, abs=1e-9)
    assert float(profile.peak_velocity[0]) * length == pytest.approx(velocity.max(), rel=1e-3)
    left = np.abs(profiles_response(profile, mode_poles([30.0], [0.02])))[0, 0] * length
    pole = mode_poles(30.0, 0.02)
    expected = simulated(np.diff(velocity, prepend=0.0) / dt, dt, 30.0, 0.02)
    decay = np.exp(pole.real * (float(profile.total[0]) - t[-1] - 0.5 * dt))
    assert left / pole.imag == pytest.approx(expected * decay, rel=5e-3, abs=1e-4 * length)


PROGRAM = (
    b"G21 G90 G94 G17 G64 P0.01\nG0 Z0\nG4 P1\nG0 Z12.5\nG4 P1\nG0 Z0\nG1 Z-1 F100\nG0 Z20 M9\n"
    b"(comment)\nF200\nG1 Z18\nG61\nG0 Z0\nM3 S100\nG64\nG0 Z9\nM2\n"
)


def test_a_lone_rapid_of_linuxcnc_has_half_of_the_acceleration():
    mill = machine(PLAIN, "controller: linuxcnc\n", "{acceleration: 9000, jerk: 5.0e+6}")
    result = process(PROGRAM, mill)
    planned = result.plans.planned
    rapids = result.program.rapids
    lone = dict(zip(rapids.line[planned].tolist(), rapids.lone[planned].tolist(), strict=True))
    assert lone == {4: True, 6: False, 8: False, 13: False, 16: True}
    for row in np.flatnonzero(planned):
        share = 0.5 if rapids.lone[row] else 1.0
        time = 2.0 * np.sqrt(result.plans.length[row] / (share * 5000.0))
        assert result.plans.conventional_time[row] == pytest.approx(time)
    assert result.verification.ok
    # Another control's planner knows no neighbours.
    other = dataclasses.replace(
        mill, axes=(dataclasses.replace(mill.axes[0], planner="trapezoidal"),)
    )
    times = process(PROGRAM, other).plans.conventional_time[planned]
    assert times == pytest.approx(2.0 * np.sqrt(result.plans.length[planned] / 5000.0))


@pytest.mark.parametrize("profile", ["condition3", "conventional", "cascade"])
def test_verify_holds_streams_to_a_bell(profile):
    made = machine(
        JERK[:-1] + ", planner: bell}",
        "controller: linuxcnc\n",
        "{acceleration: 6000, jerk: 5.0e+6}",
    )
    assert made.planner == BELL
    result = process(PROGRAM, made, profile=profile)
    assert result.planned == 5
    assert result.verification.ok


LAW_KEYS = {
    "averaged-trapezoid": "second_average: 0.02",
    "time-constants": "first_average: 0.1, second_average: 0.02",
    "four-ramp": "rise: 0.01, fall: 0.02, braking_rise: 0.03, braking_fall: 0.04",
    "two-stage": "changeover: 100, upper_acceleration: 2000",
    "quintic": "jerk: 5.0e+5",
    "poly6": "overshoot: 1.5",
    "notch-ramp": "notch: 30",
}


@pytest.mark.parametrize("planner", LAW_KEYS)
def test_a_law_lacks_none_of_its_quantities(planner):
    said = f"{PLAIN[:-1]}, planner: {planner}, {LAW_KEYS[planner]}}}"
    assert machine(said).planner == planner
    for part in LAW_KEYS[planner].split(", "):
        less = said.replace(f", {part}", "")
        with pytest.raises(MachineFileError, match=f"needs axes.Z.rapid.{part.split(':')[0]}"):
            machine(less)


def test_what_is_left_out_is_like_another_quantity():
    law = dict(
        machine(f"{PLAIN[:-1]}, planner: two-stage, {LAW_KEYS['two-stage']}}}").axis("Z").law
    )
    assert law["deceleration"] == 5000
    assert law["upper_deceleration"] == 2000


def test_a_quantity_that_the_planner_has_no_use_for_is_warned_of():
    made = machine(PLAIN[:-1] + ", planner: trapezoidal, notch: 30}")
    assert any("no use for it" in str(warning) for warning in made.warnings)


def two(first, second, positioning="linear"):
    plain = "velocity: 100, acceleration: 1000"
    return Machine.loads(
        f"interval: 0.001\npositioning: {positioning}\naxes:\n"
        f"  X: {{rapid: {{{plain}, {first}}}}}\n  Y: {{rapid: {{{plain}, {second}}}}}\n"
    )


def test_a_control_has_one_law_and_one_notch():
    with pytest.raises(MachineFileError, match="one control makes the rapids of all axes"):
        two("planner: poly5", "planner: notch-ramp, notch: 30")
    with pytest.raises(MachineFileError, match="the control has one for all axes"):
        two("planner: notch-ramp, notch: 20", "planner: notch-ramp, notch: 30")


def test_straight_rapids_are_straight_behind_one_filter_only():
    average, longer = "filter: {type: average, time: 0.02}", "filter: {type: average, time: 0.03}"
    with pytest.raises(MachineFileError, match="no longer straight"):
        two(average, longer)
    assert two(average, average).axis("Y").filter.time == 0.02
    assert two(average, longer, "independent").axis("Y").filter.time == 0.03


@pytest.mark.parametrize(
    ("behind", "problem"),
    [
        ("{type: average}", "has no time"),
        ("{type: zv}", "has no frequency"),
        ("{type: zv, frequency: 30, time: 0.1}", "which has none"),
        ("{type: median, time: 0.1}", "expected one of"),
        ("{time: 0.1}", "type is missing"),
    ],
)
def test_a_filter_needs_its_number(behind, problem):
    with pytest.raises(MachineFileError, match=problem):
        machine(PLAIN[:-1] + f", filter: {behind}}}")


def test_times_and_frequencies_are_no_lengths():
    text = (
        "units: inch\ninterval: 0.001\npositioning: linear\naxes:\n  Z:\n    rapid: {velocity: 10, "
        "acceleration: 100, planner: two-stage, changeover: 2, upper_acceleration: 50,\n"
        "            filter: {type: average, time: 0.02}}\n"
    )
    axis = Machine.loads(text).axis("Z")
    assert dict(axis.law)["changeover"] == pytest.approx(50.8)
    assert axis.filter.time == 0.02
