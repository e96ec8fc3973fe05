"""What a control bounds along the path, whichever axes move: planned, written, verified."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gcodejerk import plan_move
from gcodejerk.emit import load_controller
from gcodejerk.errors import PlanError
from gcodejerk.machine import (
    FREE,
    PLANNERS,
    Limits,
    Machine,
    MachineFileError,
    PathLimits,
    machine_yaml,
)
from gcodejerk.machine.sources import draft_of, text_of
from gcodejerk.parameters import Moves
from gcodejerk.parameters.judge import Judge, Rows
from gcodejerk.rewrite.pipeline import process
from gcodejerk.testing import assert_stream_valid
from gcodejerk.testing.machines import machines
from gcodejerk.verification import Kind, verify

GOLDEN = Path(__file__).parent.parent / "golden"
AXIS = """
    resolution: 0.0001
    rapid: {velocity: 500, acceleration: 3000, planner: trapezoidal}
    limit: {acceleration: 6000}
    modes: [{frequency: 30, damping: 0.02}]"""
AXES = f"""
interval: 0.001
positioning: linear
controller: marlin
dialect: marlin
spindle: mill
axes:
  X:{AXIS}
  Y:{AXIS}
  Z:{AXIS}
program: {{start: {{X: 0, Y: 0, Z: 0}}}}
"""
PATH = AXES + "path: {rapid: {velocity: 300, acceleration: 3000}, limit: {acceleration: 6000}}\n"
BOUNDED, SINGLE = Machine.loads(PATH), Machine.loads(AXES)
DIAGONAL = b"G21\nG90\nG0 X0 Y0 Z0 F60000\nG0 X60 Y80\nG1 X61 F600\n"


def refused(text):
    with pytest.raises(MachineFileError) as error:
        Machine.loads(text, "m.yaml")
    return str(error.value)


def test_a_diagonal_takes_the_time_of_one_axis_that_goes_as_far():
    own = plan_move({"X": 60.0, "Y": 80.0}, BOUNDED, profile="conventional")
    alone = plan_move({"X": 100.0}, BOUNDED, profile="conventional")
    assert own.conventional_time == pytest.approx(alone.conventional_time, rel=1e-12)
    # 100 mm at 300 mm/s and 3000 mm/s^2: 100/300 s, and 300/3000 s for both ramps.
    assert own.conventional_time == pytest.approx(100 / 300 + 0.1)
    free = plan_move({"X": 60.0, "Y": 80.0}, SINGLE, profile="conventional")
    assert free.conventional_time < own.conventional_time


@pytest.mark.parametrize("profile", ["condition3", "optimal", "cascade"])
def test_designs_keep_what_bounds_the_path(profile):
    plan = plan_move({"X": 60.0, "Y": 80.0}, BOUNDED, profile=profile)
    assert_stream_valid(plan, BOUNDED)
    steps = np.hypot(np.diff(plan.positions["X"]), np.diff(plan.positions["Y"])) / BOUNDED.interval
    assert steps.max() <= 300.0 * (1.0 + 1e-6) + 1.0


def test_an_axis_alone_is_a_path():
    assert BOUNDED.axis("X").rapid.velocity == 300.0
    assert BOUNDED.axis("X").limit.velocity == 300.0
    assert any("above path.rapid.velocity 300" in str(warning) for warning in BOUNDED.warnings)


def test_what_the_limit_of_the_path_leaves_out_is_as_in_its_rapid():
    path = BOUNDED.path
    assert (path.limit.velocity, path.limit.acceleration) == (300.0, 6000.0)
    assert (SINGLE.path, SINGLE.path.rapid.velocity) == (FREE, math.inf)


def test_a_machine_with_a_path_is_written_and_read_as_the_same():
    again = Machine.loads(machine_yaml(BOUNDED), BOUNDED.source)
    assert again == BOUNDED
    assert again.settings_hash == BOUNDED.settings_hash != SINGLE.settings_hash


def test_in_inches_the_path_is_in_inches():
    text = PATH.replace("interval", "units: inch\ninterval", 1)
    assert Machine.loads(text).path.rapid.velocity == pytest.approx(300 * 25.4)


def test_axes_that_run_on_their_own_have_no_path():
    said = refused(PATH.replace("positioning: linear", "positioning: independent"))
    assert "m.yaml:24:" in said
    assert "every axis runs on its own" in said


def test_axes_that_turn_have_no_path():
    text = (
        "interval: 0.001\npositioning: linear\npath: {rapid: {velocity: 3}}\n"
        "axes: {A: {rapid: {velocity: 90, acceleration: 900}}}\n"
    )
    assert "the machine has none" in refused(text)


def test_a_path_without_a_rapid_and_a_jerk_of_it_are_refused():
    assert "rapid" in refused(AXES + "path: {limit: {velocity: 3}}\n")
    assert "jerk" in refused(AXES + "path: {rapid: {jerk: 3000}}\n")


def test_a_time_that_the_path_does_not_allow_names_its_limit():
    with pytest.raises(PlanError, match=r"the path reaches .* above its limit of 300 mm/s"):
        plan_move({"X": 60.0, "Y": 80.0}, BOUNDED, profile="condition3", time=0.36)


def test_streams_beyond_the_path_are_refused():
    """Planned for axes one by one, a diagonal goes at 375 mm/s; played, it would take longer."""
    fast = process(DIAGONAL, SINGLE)
    assert fast.plans.planned.sum() == 1
    found = verify(DIAGONAL, fast.output, BOUNDED)
    kinds = {violation.kind for violation in found.violations}
    assert kinds & {Kind.VELOCITY, Kind.ACCELERATION, Kind.TIME}


def test_a_limit_of_the_program_that_is_the_paths_own_keeps_nothing():
    program = b"M204 T6000\n" + DIAGONAL
    assert process(program, BOUNDED).plans.planned.sum() == 1
    assert process(program, SINGLE).plans.planned.sum() == 0
    assert process(program.replace(b"6000", b"5900"), BOUNDED).plans.planned.sum() == 0


@pytest.mark.parametrize("planner", [p for p in PLANNERS if p != "linuxcnc-2.9"])
@settings(max_examples=5, deadline=None)
@given(data=st.data())
def test_verify_accepts_what_is_planned_by_every_law(planner, data):
    machine = data.draw(
        machines(axes="XYA", positioning="linear", planner=planner, path=True, modes=(1, 2))
    )
    text = machine_yaml(machine).replace(
        "start: {}", "start: {X: 0, Y: 0, A: 0}"
    ).replace("startup: \"\"", "startup: G21")  # fmt: skip
    machine = Machine.loads(text)
    program = b"G90 G94 F100\nG0 X30 Y40\nG1 X31\nG0 X0 A9\nM2\n"
    process(program, machine, controller="csv")


@settings(max_examples=10, deadline=None)
@given(machine=machines(axes="XYZ", positioning="linear", path=True, modes=(1, 3)))
def test_every_stream_keeps_the_path(machine):
    plan = plan_move({"X": 30.0, "Y": -40.0, "Z": 1.0}, machine, profile="conventional")
    if math.isfinite(min(axis.rapid.jerk for axis in machine.axes)):
        assert_stream_valid(plan, machine)


def made(folder, name, text, headroom=None):
    (folder / name).write_text(text)
    draft = draft_of([str(folder / name)], folder)
    draft.settle(headroom)
    return Machine.loads(text_of(draft), str(folder / "new.yaml"))


def test_klippers_limits_are_those_of_the_path(tmp_path):
    text = "[printer]\nkinematics: corexy\nmax_velocity: 300\nmax_accel: 4000\nmax_z_accel: 100\n"
    machine = made(tmp_path, "printer.cfg", text, 1.5)
    assert (machine.path.rapid.velocity, machine.path.rapid.acceleration) == (300.0, 4000.0)
    assert (machine.path.limit.velocity, machine.path.limit.acceleration) == (300.0, 6000.0)
    assert machine.axis("Z").rapid.acceleration == 100.0


@pytest.mark.parametrize(
    ("front", "name"), [("", "m503.txt"), ("M550 P\"Duet\"\nM569 P0 S1\n", "config.g")]
)  # fmt: skip
def test_m204_t_is_that_of_the_path(tmp_path, front, name):
    text = front + "M203 X300 Y300 Z5\nM201 X3000 Y800 Z100\nM204 P500 T1000\n"
    machine = made(tmp_path, name, text)
    assert machine.path.rapid.acceleration == 1000.0
    assert math.isinf(machine.path.rapid.velocity)
    assert [axis.rapid.acceleration for axis in machine.axes] == [1000.0, 800.0, 100.0]


def test_what_a_control_has_to_allow_before_streams_run_is_said():
    said = " ".join(process(DIAGONAL, BOUNDED).notes)
    assert "M201 of X 6000, Y 6000; acceleration along the path (M204 T) 6000 (mm, s)" in said
    assert "M203" not in said


def test_nothing_is_said_where_streams_use_what_rapids_have_today():
    text = PATH.replace("limit: {acceleration: 6000}", "limit: {acceleration: 3000}")
    same = process(DIAGONAL, Machine.loads(text))
    assert "before this program runs" not in " ".join(same.notes)


def test_grbl_names_its_own_settings():
    machine = Machine.loads(AXES.replace("marlin", "grbl"))
    said = " ".join(process(DIAGONAL + b"M2\n", machine).notes)
    assert "$120 to $125 of X 6000, Y 6000 (mm, s)" in said


LOOSE = PATH.replace("{velocity: 500,", "{velocity: 200,").replace(
    "path: {rapid: {velocity: 300, acceleration: 3000}, limit: {acceleration: 6000}}",
    "path: {rapid: {acceleration: 4000}, limit: {acceleration: 8000}}",
)
"""M204 T above M201 of every axis, below both together."""


@pytest.mark.parametrize("controller", ["marlin", "rrf"])
def test_settings_as_today_are_todays_rapids_on_diagonals_too(controller):
    machine = Machine.loads(LOOSE)
    scheme = load_controller(controller).scheme(machine)
    assert scheme.path["acceleration"] == 4000.0
    moves = Moves(np.array([[70.0, 70.0, *[0.0] * 7]]), np.ones(1), np.ones(1), np.full(1, np.inf))
    judge = Judge(scheme, Rows.of(moves, machine))
    today = plan_move({"X": 70.0, "Y": 70.0}, machine, profile="conventional").conventional_time
    assert judge.times(scheme.today()[np.newaxis]).ravel()[0] == pytest.approx(today)


@pytest.mark.parametrize("controller", ["marlin", "klipper"])
def test_settings_in_a_program_go_back_to_the_paths_own(controller):
    case = GOLDEN / f"settings_{controller}"
    machine = Machine.load(case / "machine.yaml")
    own = 1.1 * max(axis.rapid.acceleration for axis in machine.axes)
    limits = Limits(math.inf, own, math.inf)
    machine = replace(machine, path=PathLimits(limits, replace(limits, acceleration=2.0 * own)))
    program = (case / "in.ngc").read_bytes()
    written = process(program, machine, form="parameters").output
    assert verify(program, written, machine).violations == ()
    assert f"{own:.0f}".encode() in written
    assert f"{own:.0f}".encode() not in (case / "out.ngc").read_bytes()
