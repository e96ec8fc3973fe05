"""Independent positioning: arrivals of each axis, and how far the path leaves the control's own."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from gcodejerk import Machine, plan_move, process
from gcodejerk.motion import sample_profiles
from gcodejerk.planning.independent_axes import arrivals, path_deviation
from gcodejerk.report.move_record import move_record

TEXT = """
interval: 0.001
positioning: {positioning}
axes:
  X:
    rapid: {{velocity: 500, acceleration: 3000, jerk: 60000}}
    modes: [{{frequency: 11, damping: 0.02, participation: 1.0}}]
  Y: {{rapid: {{velocity: 300, acceleration: 4000, jerk: 100000}}}}
program: {{start: {{X: 0, Y: 0}}, startup: "G64"}}
"""
DOGLEG = Machine.loads(TEXT.format(positioning="independent"))
STRAIGHT = Machine.loads(TEXT.format(positioning="linear"))


def control_path(length, velocity, acceleration, jerk, t):
    """Position of the controller's own rapid at moments t, by integrating its jerk."""
    v = min(velocity, np.sqrt(length * acceleration), (length**2 * jerk / 4.0) ** (1 / 3))
    low, high = 0.0, velocity
    for _ in range(80):
        v = 0.5 * (low + high)
        ramp = v / acceleration + acceleration / jerk
        ramp = ramp if v * jerk >= acceleration**2 else 2.0 * np.sqrt(v / jerk)
        low, high = (v, high) if v * ramp <= length else (low, v)
    ramp = v / acceleration + acceleration / jerk
    ramp = ramp if v * jerk >= acceleration**2 else 2.0 * np.sqrt(v / jerk)
    rise = min(acceleration, np.sqrt(v * jerk)) / jerk
    cruise = max(length - v * ramp, 0.0) / v
    edges = np.cumsum([rise, ramp - 2 * rise, rise, cruise, rise, ramp - 2 * rise, rise])
    signs = np.array([1, 0, -1, 0, -1, 0, 1, 0])
    fine = np.linspace(0.0, t[-1], 200_001)
    q = signs[np.searchsorted(edges, fine, side="right")] * jerk
    for _ in range(3):
        steps = 0.5 * (q[1:] + q[:-1]) * np.diff(fine)
        q = np.concatenate([[0.0], np.cumsum(steps)])
    return np.interp(t, fine, q)


def test_the_deviation_bounds_the_distance_from_the_path_of_an_integrated_dogleg():
    plan = plan_move({"X": 200.0, "Y": 60.0}, DOGLEG)
    t = np.linspace(0.0, plan.time + 0.05, 20_001)
    own = np.stack(
        [control_path(200.0, 500, 3000, 60000, t), control_path(60.0, 300, 4000, 100000, t)], axis=1
    )
    points = np.stack([plan.positions["X"], plan.positions["Y"]], axis=1)
    true = max(np.linalg.norm(own - point, axis=1).min() for point in points)
    (bound,) = path_deviation(plan.batch)
    assert true > 0.05  # the paths do differ
    assert true <= bound + 0.02
    assert bound <= 1.1 * true + 0.02


FASTER = Machine.loads(
    TEXT.format(positioning="independent")
    .replace("  Y:", "    limit: {velocity: 600, acceleration: 6000, jerk: 3.0e+6}\n  Y:")
    .replace("velocity: 500", "velocity: 100")
)
"""Its limits let the planned profile run far ahead of today's, and behind it."""


@pytest.mark.parametrize("seed", range(6))
def test_the_deviation_is_that_of_paths_and_not_of_moments(seed):
    random = np.random.default_rng(seed)
    x, y = random.uniform(50.0, 300.0), random.uniform(50.0, 400.0)
    plan = plan_move({"X": x, "Y": y}, FASTER)
    t = np.linspace(0.0, plan.time + 0.05, 20_001)
    own = np.stack(
        [control_path(x, 100, 3000, 60000, t), control_path(y, 300, 4000, 100000, t)], axis=1
    )
    points = np.stack([plan.positions["X"], plan.positions["Y"]], axis=1)
    true = max(np.linalg.norm(own - point, axis=1).min() for point in points)
    (bound,) = path_deviation(plan.batch)
    # The integral's own error: of half a metre a few tenths.
    assert bound == pytest.approx(true, rel=0.05, abs=0.1)


def test_what_one_axis_does_leaves_no_path_whatever_stands_beside_it():
    blocks = b"G0 X118.861\nX0\nX200. Y60.\nY0\nX31.7 Y9.3\nX300.\n"
    program = b"G21 G90 F10\n" + blocks + b"M2\n"
    result = process(program, FASTER, controller="mach", dialect="linuxcnc")
    assert result.planned == 5  # the first begins anywhere
    moving = (result.program.rapids.start != result.program.rapids.target)[:, :2].sum(axis=1)
    assert (result.deviation[moving == 1] == 0.0).all()
    alone = [path_deviation(plan_move({"X": 200.0, "Y": 60.0}, FASTER).batch)[0]]
    alone += [path_deviation(plan_move({"X": -168.3, "Y": 9.3}, FASTER).batch)[0]]
    assert result.deviation[moving == 2] == pytest.approx(alone, rel=1e-3, abs=1e-3)


def test_axes_arrive_when_their_own_profiles_end():
    plan = plan_move({"X": 200.0, "Y": 60.0}, DOGLEG)
    times = arrivals(plan.plans, 0)
    assert set(times) == {"X", "Y"}
    assert max(planned for planned, _ in times.values()) == pytest.approx(plan.time)
    for axis, (planned, own) in times.items():
        done = np.abs(plan.positions[axis] - plan.positions[axis][-1]) < 1e-9
        assert plan.t[np.argmax(done)] <= planned + 1e-9
        assert own <= planned + 1e-12 < own + 0.0011


def test_a_straight_rapid_leaves_no_path():
    plan = plan_move({"X": 200.0, "Y": 60.0}, STRAIGHT)
    assert path_deviation(plan.batch).tolist() == [0.0]
    assert "arrival" not in move_record(plan)["rapids"][0]
    assert path_deviation(plan_move({"X": 200.0}, DOGLEG).batch).tolist() == [0.0]


def test_every_report_says_so():
    record = move_record(plan_move({"X": 200.0, "Y": 60.0}, DOGLEG))
    (row,) = record["rapids"]
    assert set(row["arrival"]) == set(row["conventional_arrival"]) == {"X", "Y"}
    assert row["path_deviation"] > 0.05
    assert "independent" in record["notes"][0]
    program = b"G21 G90\nG0 X200. Y60.\nM2\n"
    result = process(program, DOGLEG, controller="mach", dialect="linuxcnc")
    assert result.deviation[0] == pytest.approx(row["path_deviation"], rel=0.05)
    assert any("each axis moves and arrives on its own" in note for note in result.notes)
    assert not any("independent" in note for note in process(b"G0 X200.\nM2\n", STRAIGHT).notes)


def test_axes_that_are_quiet_enough_alone_may_be_too_loud_together():
    machine = Machine.loads(
        "interval: 0.0005\npositioning: independent\naxes:\n"
        "  X: {resolution: 0.002, rapid: {velocity: 6.469, acceleration: 29490, jerk: 9739100},"
        " limit: {acceleration: 35388}}\n"
        "  Z: {resolution: 0.001, rapid: {velocity: 10.02, acceleration: 126.3},"
        " limit: {acceleration: 252.6}}\n"
        "modes: [{frequency: 8.092, damping: 0, participation: {X: -0.0742, Z: 0.496}}]\n"
        "design: {band: 0.02, tolerance: 0.1}\n"
        'program: {start: {X: 0, Z: 0}, startup: "G64"}\n'
    )
    blocks = "G91 G0 X-0.62 Z0.82\nX-0.58 Z0.29\nX0.89 Z0.78\nX0.3 Z0.5\nZ0.4\n"
    program = f"G21 G94 F10\n{blocks}M2\n".encode()
    # What is written is proved: no mode keeps more than the tolerance, or than today's rapid.
    made = process(program, machine, profile="shortest", controller="mach", dialect="linuxcnc")
    left = {rapid.reason for rapid in made.rapids if not rapid.rewritten}
    assert left == {"no profile within the limits is better"}
    assert made.planned > 0
    for rapid in made.rapids:
        if rapid.rewritten:
            assert rapid.residual <= max(0.102, rapid.conventional_residual)


WAITING = """
interval: 0.004
positioning: independent
spindle: mill
axes:
  X:
    rapid: {velocity: 27.91, acceleration: 2009, planner: time-constants, first_average: 0.01746,
      second_average: 0.003904}
    limit: {jerk: 301350}
    modes: [{frequency: 6.152, damping: 0.00129, participation: 0.1159}]
  Y:
    rapid: {velocity: 154.9, acceleration: 904, planner: time-constants, first_average: 0.3324,
      second_average: 0.002376}
    limit: {acceleration: 2712}
    modes: [{frequency: 8.646, damping: 0.009916, participation: 0.2195}]
modes:
  - {frequency: 58.5, damping: 0, participation: {X: -0.06841, Y: 0.167}}
  - {frequency: 13.08, damping: 0.2, participation: {X: -1.467, Y: -0.06285}}
design: {profile: optimal, band: 0, guard: 0, tolerance: 0.0006871, max_extension: 0}
"""


def test_no_axis_waits_and_hurries_where_that_would_cancel_what_another_leaves():
    """Y has 0.34 s for 1 mm: at the very end of them it would leave least, by another path."""
    program = b"G21 G90 G94 G64\nG0 X1. Y2.\nG0 X9.6496 Y1.001\nM30\n"
    made = process(program, Machine.loads(WAITING), controller="csv", form="stream")
    assert made.verification.ok
    assert made.planned == 1
    profiles = made.plans.profiles
    t = np.linspace(0.0, profiles.total.max(), 20_001)[np.newaxis].repeat(2, axis=0)
    place, _ = sample_profiles(profiles, t / 0.004, 0.004)
    mean = trapezoid(1.0 - np.clip(place, 0.0, 1.0), t, axis=1)
    assert profiles.mean_moment == pytest.approx(mean, rel=1e-4)
    assert (0.25 * profiles.total < mean).all()
    assert (0.75 * profiles.total > mean).all()
