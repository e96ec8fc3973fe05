"""Simulated machines against tables, integrators and formulas that share no code with them."""

import io
import json
import math
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.signal import StateSpace, lsim
from typer.testing import CliRunner

from gcodejerk import Machine, PlanError, find_machine, plan_move
from gcodejerk.axes import AXES
from gcodejerk.cli import app
from gcodejerk.machine import MachineFileError, Spectrum, machine_yaml
from gcodejerk.machine.drives import Friction
from gcodejerk.motion import profiles_response
from gcodejerk.simulation.equations import Equations, Row, Rub, equations_of
from gcodejerk.simulation.friction import follow
from gcodejerk.simulation.moves import Watch
from gcodejerk.simulation.programs import planned_steps, today_steps, written_steps
from gcodejerk.simulation.reduction import reduce_machine
from gcodejerk.simulation.response import Response, Steps, polyline_steps
from gcodejerk.simulation.single import MoveSimulation

VMC33 = Machine.load(find_machine("vmc33"))
BENCH = """
interval: 0.001
positioning: linear
axes:
  Z:
    rapid: {{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}
    servo: {{kpp: {kpp}, velocity_bandwidth: {bandwidth}, integral: {integral}, current_lag: {lag},
            feedforward: {ff}, acceleration_feedforward: {aff}, feedback: {feedback}, mass: {mass},
            inertia: 0.03, lead: 10, stiffness: {stiffness}, damping: 8, guide_damping: 2}}
    modes: [{{name: a, frequency: 30, damping: 0.02}},
            {{name: b, frequency: 90, damping: 0.03, participation: 0.3}}]
"""
USUAL = {
    "kpp": 40, "bandwidth": 240, "integral": 60, "lag": 0.0005, "ff": 0, "aff": 0,
    "feedback": "motor", "mass": 250, "stiffness": 150,
}  # fmt: skip


def bench(**changed):
    return Machine.loads(BENCH.format(**(USUAL | changed)))


def four_segments(t1, time, length, axes=1, axis=0):
    """Condition III: jerks over t1, then the rest, mirrored."""
    t2 = time / 2.0 - t1
    jerks = [1.0 / t1, -1.0 / t2, -1.0 / t2, 1.0 / t1]
    ends = np.cumsum([t1, t2, t2, t1])
    x = v = a = 0.0
    for d, j in zip([t1, t2, t2, t1], jerks, strict=True):
        x, v, a = x + d * (v + d * (a / 2 + d * j / 6)), v + d * (a + d * j / 2), a + d * j
    size = np.zeros((5, 3, axes))
    size[:, 2, axis] = np.diff([0.0, *jerks, 0.0]) * length / x
    return Steps(np.array([0.0, *ends]), size, time)


TODAY, THREE = four_segments(0.010, 0.040, 1.0), four_segments(0.001, 0.040, 1.0)


def amplitude(watch, steps, frequency, row):
    """What the pole next to a frequency keeps in a row [um]."""
    poles = watch.response.poles
    k = np.argmin(np.abs(np.abs(poles) / (2 * np.pi) - frequency))
    return 1e3 * float(abs(watch.response.seen(row)[k] * watch.response.left(steps, steps.end)[k]))


# Worked out with another program, whose source is not here, for this axis; lag and residual in um.
@pytest.mark.parametrize(
    ("changed", "lags", "kept"),
    [
        ({"kpp": 16.7}, (807.2, 768.7), (35.607, 15.424)),
        ({}, (647.0, 574.5), (93.264, 40.399)),
        ({"ff": 0.7}, (223.8, 175.0), (319.683, 138.476)),
        ({"ff": 1}, (152.6, 126.4), (447.454, 193.822)),
        ({"kpp": 60, "bandwidth": 400, "ff": 1, "aff": 1}, (14.5, 15.6), (385.594, 167.027)),
    ],
)
def test_an_axis_follows_and_rings_as_in_the_reference_table(changed, lags, kept):
    watch = Watch(equations_of(bench(**changed)), 0.001)
    row = watch.equations.modes["Z a"]
    for steps, lag, left in zip((TODAY, THREE), lags, kept, strict=True):
        assert 1e3 * watch.outcome(steps).lag[0] == pytest.approx(lag, abs=0.06)
        assert amplitude(watch, steps, 30.0, row) == pytest.approx(left, abs=6e-4)


def test_the_machine_of_33_degrees_of_freedom_is_that_of_the_reference():
    watch = Watch(equations_of(VMC33), 0.005)
    assert len(watch.equations.A) == 72
    found = {round(one.mode.frequency, 2): one for one in reduce_machine(VMC33, 0.0)}
    table = [
        (29.96, 0.0345, 0.195), (50.64, 0.0473, 0.158), (63.48, 0.0498, 0.044),
        (89.33, 0.0204, 0.0117), (109.47, 0.0216, 0.0062),
    ]  # fmt: skip
    for frequency, damping, amount in table:
        one = found[frequency]
        part = abs(one.direction["Z"]) * abs(one.mode.participation_of("Z"))
        assert one.mode.damping == pytest.approx(damping, abs=6e-5)
        assert part == pytest.approx(amount, rel=0.02)
    today, three = (four_segments(t1, 0.040, 1.0, 3, 2) for t1 in (0.010, 0.001))
    row = watch.equations.table["Z"] + watch.equations.vibration["Z"]
    for frequency, before, after in [(29.955, 64.01, 28.10), (50.636, 2.271, 9.555),
                                     (63.476, 1.202, 0.571)]:  # fmt: skip
        assert amplitude(watch, today, frequency, row) == pytest.approx(before, abs=6e-3)
        assert amplitude(watch, three, frequency, row) == pytest.approx(after, abs=6e-3)
    end = np.linspace(0.0, 0.040, 4001)
    off = 1e3 * watch.record(today, end, [watch.equations.deviation("Z")])[0]
    assert np.abs(off).max() == pytest.approx(300.5, abs=0.06)
    assert off[-1] == pytest.approx(61.9, abs=0.06)
    off = 1e3 * watch.record(three, end, [watch.equations.deviation("Z")])[0]
    assert np.abs(off).max() == pytest.approx(224.2, abs=0.06)
    for tolerance, settled in [(0.005, (0.429, 0.296)), (0.001, (0.679, 0.547))]:
        at = Watch(watch.equations, tolerance)
        assert at.outcome(today).settling == pytest.approx(settled[0], abs=6e-4)
        assert at.outcome(three).settling == pytest.approx(settled[1], abs=6e-4)


servos = st.fixed_dictionaries(
    {
        "kpp": st.floats(5.0, 60.0), "bandwidth": st.floats(150.0, 500.0),
        "integral": st.one_of(st.just(0.0), st.floats(5.0, 80.0)),
        "lag": st.sampled_from([0.0, 2e-4, 8e-4]), "ff": st.floats(0.0, 1.0),
        "aff": st.sampled_from([0.0, 1.0]), "feedback": st.sampled_from(["motor", "table"]),
        "mass": st.floats(50.0, 600.0), "stiffness": st.floats(80.0, 400.0),
    }
)  # fmt: skip


def drawn(values):
    try:
        return equations_of(bench(**values))
    except PlanError:
        return None  # gains that shake by themselves: refused, see below


def test_the_ratio_of_planned_to_today_is_the_servos_business_in_no_way():
    ratios = []

    @settings(max_examples=25)
    @given(servos)
    def check(values):
        equations = drawn(values)
        if equations is None:
            return
        watch = Watch(equations, 0.001)
        row = equations.modes["Z a"]
        ratios.append(amplitude(watch, THREE, 30.0, row) / amplitude(watch, TODAY, 30.0, row))

    check()
    # Of the commands alone: 149.550 um and 345.248.
    assert len(ratios) > 5
    assert np.ptp(ratios) < 1e-7
    assert ratios[0] == pytest.approx(149.550 / 345.248, rel=1e-5)


def stepped(equations, steps, times):
    """States by matrix exponentials from moment to moment; the command is part of the state."""
    n, a = len(equations.A), len(equations.axes)
    whole = np.zeros((n + 4 * a, n + 4 * a))
    whole[:n, :n] = equations.A
    for order in range(3):
        whole[:n, n + order * a : n + (order + 1) * a] = equations.B[order]
        place = n + order * a
        whole[place : place + a, place + a : place + 2 * a] = np.eye(a)
    state, out, now = np.zeros(n + 4 * a), [], 0.0
    moments = sorted({*times.tolist(), *steps.time.tolist()})
    for moment in moments:
        state = expm(whole * (moment - now)) @ state
        now = moment
        for k in np.flatnonzero(steps.time == moment):
            state[n + a :] += steps.size[k].ravel()
        if moment in times:
            out.append(state[:n].copy())
    return np.array(out)


@settings(max_examples=8, phases=(Phase.explicit, Phase.reuse, Phase.generate))
@given(servos, st.floats(0.0005, 0.02), st.floats(0.02, 0.3))
def test_it_is_what_matrix_exponentials_make_of_it(values, part, length):
    equations = drawn(values)
    if equations is None:
        return
    steps = four_segments(part * 0.9, 0.040, length)
    times = np.linspace(0.0, 0.1, 41)
    rows = [equations.lag("Z"), equations.modes["Z b"], equations.deviation("Z")]
    mine = Response(equations).watch(steps, times, rows)
    states = stepped(equations, steps, times)
    told = steps.command(times)
    other = [states @ row.state + row.command[0, 0] * told[0, :, 0] for row in rows]
    assert mine == pytest.approx(np.array(other), abs=2e-8 * length)


def test_it_is_what_an_integrator_makes_of_it():
    equations, steps = equations_of(bench(ff=0.7, aff=1)), THREE
    row = equations.modes["Z b"]

    def slope(t, z):
        x, v, a, _ = steps.command(np.array([t]))[:, 0, 0]
        return equations.A @ z + equations.B[:, :, 0].T @ [x, v, a]

    bounds = [*steps.time, 0.1]
    z = np.zeros(len(equations.A))
    for begin, end in pairwise(bounds):
        run = solve_ivp(slope, (begin, end), z, method="Radau", rtol=1e-7, atol=1e-11)
        z = run.y[:, -1]
    last = Response(equations).watch(steps, np.array([0.1]), [row])[0, 0]
    assert last == pytest.approx(z @ row.state, abs=1e-6)


def test_positions_in_a_table_are_followed_as_scipy_does_it():
    # Another's first-order hold; its feed-forward of velocity is left out, which jumps there.
    equations = equations_of(bench())
    times = np.arange(0.0, 0.2, 0.001)
    places = THREE.command(times)[0]
    steps = polyline_steps(times, places)
    row = equations.modes["Z a"]
    system = StateSpace(equations.A, equations.B[0], row.state[np.newaxis], np.zeros((1, 1)))
    _, other, _ = lsim(system, places[:, 0], times)
    mine = Response(equations).watch(steps, times, [row])[0]
    assert mine == pytest.approx(other, abs=1e-9)


def test_a_command_is_the_integral_of_its_steps():
    rng = np.random.default_rng(8)
    time = np.sort(rng.uniform(0.0, 0.2, 30))
    steps = Steps(time, rng.normal(size=(30, 3, 2)) * [[[30.0], [2e3], [1e5]]], 0.25)
    times = np.sort(np.append(rng.uniform(0.0, 0.25, 40), time[:3]))
    # Each step acts on its own from its moment on.
    since = np.maximum(times - time[:, np.newaxis], 0.0)[..., np.newaxis]
    begun = (times >= time[:, np.newaxis])[..., np.newaxis]
    v, a, j = (steps.size[:, np.newaxis, order] for order in range(3))
    own = [
        v * since + a * since**2 / 2 + j * since**3 / 6,
        begun * v + a * since + j * since**2 / 2,
        begun * a + j * since,
        begun * j + 0 * since,
    ]
    expected = np.sum(own, axis=1)
    expected[1:, times >= time[-1]] = 0.0  # behind the last step it stands
    found = steps.command(times)
    for order in range(4):
        scale = np.abs(expected[order]).max()
        np.testing.assert_allclose(found[order], expected[order], atol=1e-12 * scale)


@pytest.mark.parametrize("friction", [None, Friction(5.0, 8.0, 1.0)])
def test_what_is_told_of_a_command_keeps_nothing_else_alive(friction):
    # A program's outcomes are kept; what was seen at hundreds of moments of each is not.
    machine = bench()
    if friction is not None:
        axis = machine.axis("Z")
        servo = replace(axis.servo, friction=friction)
        machine = replace(machine, axes=(replace(axis, servo=servo),))
    outcome = Watch(equations_of(machine), 0.001).outcome(THREE)
    for field in fields(outcome):
        value = getattr(outcome, field.name)
        assert not isinstance(value, np.ndarray) or value.base is None, field.name


def test_two_poles_in_one_place_lose_no_digits():
    # Critically damped: position loop 40, velocity loop 160, nothing else.
    A = np.array([[0.0, 1.0], [-6400.0, -160.0]])
    B = np.zeros((3, 2, 1))
    B[0, 1] = 6400.0
    none = np.zeros((3, 1))
    seen = Row(np.array([1.0, 0.0]), none)
    equations = Equations(("Z",), A, B, {"Z": seen}, {"Z": Row(np.zeros(2), none)}, None, {})
    times = np.linspace(0.0, 0.1, 21)
    other = stepped(equations, THREE, times)[:, 0]
    mine = Response(equations).watch(THREE, times, [seen])[0]
    assert mine == pytest.approx(other, abs=1e-8)


def moved(name, move):
    machine = Machine.load(find_machine(name))
    return machine, plan_move(move, machine), Watch(equations_of(machine), 0.001)


@pytest.mark.parametrize(
    ("name", "move"),
    [("vmc", {"X": 20.0, "Z": -10.0}), ("paper", {"Z": 1.0}), ("router", {"Y": 9.0})],
)
def test_without_drives_a_machine_keeps_what_planning_says(name, move):
    _, plan, watch = moved(name, move)
    kept = watch.left(planned_steps(plan.plans, 0))
    modes = plan.plans.modes
    weights = plan.plans.share @ modes.participation.T
    wanted = np.abs(profiles_response(plan.plans.profiles, modes.poles) * weights).sum(axis=0)
    wanted /= modes.poles.imag
    order = np.argsort(modes.poles.imag)
    assert np.sort_complex(watch.response.poles) == pytest.approx(np.sort_complex(modes.poles))
    mine = kept[np.argsort(watch.response.poles.imag)]
    assert mine == pytest.approx(wanted[order], rel=1e-6, abs=1e-12)
    # The written stream, whose residual planning computes by sums over its points.
    left = watch.outcome(written_steps(plan.batch, 0)).residual
    assert left == pytest.approx(float(plan.residual.max()), rel=1e-9)


@pytest.mark.parametrize("move", [{"Z": 1.0}, {"Y": -7.5}, {"X": 30.0}])
def test_a_plan_for_the_reduced_modes_is_true_of_the_whole_machine(move):
    reduced = reduce_machine(VMC33, 0.0)
    modes = tuple(one.mode for one in reduced)
    plan = plan_move(move, replace(VMC33, modes=modes))
    watch = Watch(equations_of(VMC33), 0.001)
    weights = plan.plans.share @ plan.plans.modes.participation.T
    poles = plan.plans.modes.poles
    said = (
        np.abs((profiles_response(plan.plans.profiles, poles) * weights).sum(axis=0)) / poles.imag
    )
    kept = watch.left(planned_steps(plan.plans, 0))
    for pole, one in zip(poles, said, strict=True):
        k = np.argmin(np.abs(watch.response.poles - pole))
        assert kept[k] == pytest.approx(one, rel=1e-6, abs=1e-12)


def test_moves_of_several_axes_add_with_their_sign():
    # The two axes strike the 30 Hz mode in antiphase of some degrees: less together than the sum.
    watch = Watch(equations_of(VMC33), 0.001)
    y, z = (four_segments(0.005, 0.060, 3.0, 3, u) for u in (1, 2))
    both = Steps(y.time, y.size + z.size, y.end)
    k = np.argmin(np.abs(np.abs(watch.response.poles) - 2 * np.pi * 29.955))
    alone = [watch.left(one)[k] for one in (y, z)]
    assert watch.left(both)[k] == pytest.approx(sum(alone), rel=1e-2)
    assert watch.left(both)[k] < sum(alone)


# -- dry friction ------------------------------------------------------------------------------


def oscillator(friction, mass=2.0, stiffness=8e3):
    """A mass on a spring whose other end is commanded; friction against the ground."""
    A = np.array([[0.0, 1.0], [-stiffness / mass, 0.0]])
    B = np.zeros((3, 2, 1))
    B[0, 1] = stiffness / mass
    none = np.zeros((3, 1))
    place, speed = (Row(np.eye(2)[k], none) for k in range(2))
    rub = Rub("Z", friction, speed, np.array([0.0, -1e3 / mass]))
    equations = Equations(
        ("Z",), A, B, {"Z": place}, {"Z": Row(np.zeros(2), none)}, None, {}, (rub,)
    )
    return Response(equations), place


def test_a_rubbing_spring_loses_the_same_length_in_every_swing():
    # Coulomb: every half swing ends 2 F / k nearer (J. P. den Hartog, Mechanical Vibrations, 1931).
    force, stiffness, pulled = 3.0, 8e3, 5.0
    response, place = oscillator(Friction(force, force, 1.0), stiffness=stiffness)
    jump = 1e-4
    steps = polyline_steps(np.array([0.0, jump]), np.array([[0.0], [pulled]]))
    times = np.arange(0.0, 0.5, 1e-4)
    seen, _ = follow(response, steps, times, [place], 2e-3)
    off = seen[0] - pulled
    period = 2 * np.pi * math.sqrt(2.0 / stiffness)
    for swing in range(1, 5):
        at = jump + swing * period / 2.0
        wanted = (-1) ** (swing + 1) * (pulled - swing * 2.0 * 1e3 * force / stiffness)
        assert np.interp(at, times, off) == pytest.approx(wanted, abs=0.02)
    # At last it sticks, within F / k of the middle.
    assert np.ptp(off[-500:]) < 1e-9
    assert abs(off[-1]) <= 1e3 * force / stiffness + 1e-6


def test_static_friction_holds_until_it_is_overcome():
    law = Friction(coulomb=2.0, static=6.0, stribeck=5.0)
    response, place = oscillator(law)
    steps = polyline_steps(np.array([0.0, 1.0]), np.array([[0.0], [1.5]]))
    times = np.arange(0.0, 1.0, 1e-3)
    seen, _ = follow(response, steps, times, [place], 5e-3)
    # The spring needs 6 N / 8 N/mm to break loose: at 0.5 s.
    assert np.abs(seen[0][times < 0.499]).max() < 1e-6
    assert seen[0][times > 0.56].min() > 0.2


def test_friction_that_vanishes_changes_nothing_and_more_of_it_takes_energy():
    def with_friction(newtons):
        axes = tuple(
            replace(a, servo=replace(a.servo, friction=Friction(newtons, newtons, 2.0)))
            for a in bench(ff=0.7).axes
        )
        machine = replace(bench(ff=0.7), axes=axes)
        return Watch(equations_of(machine), 0.02)

    without = Watch(equations_of(bench(ff=0.7)), 0.02).outcome(THREE)
    assert with_friction(1e-6).outcome(THREE).vibration == pytest.approx(
        without.vibration, rel=5e-3
    )
    assert with_friction(300.0).outcome(THREE).lag[0] > 1.02 * without.lag[0]


def test_nothing_is_lost_or_won_where_nothing_damps():
    response, place = oscillator(Friction(0.0, 0.0, 1.0))
    speed = response.equations.rubs[0].velocity
    times = np.linspace(0.05, 3.0, 500)
    x, v = response.watch(four_segments(0.004, 0.04, 3.0), times, [place, speed])
    energy = 0.5 * 2.0 * v**2 + 0.5 * 8e3 * (x - 3.0) ** 2
    assert energy[0] > 1.0
    assert energy == pytest.approx(energy[0], rel=1e-9)


def test_the_spectrum_of_a_table_is_that_of_its_course():
    found = MoveSimulation(plan_move({"Z": 1.0}, VMC33))
    t = np.arange(0.0, 3.0, 1e-4)
    place = found.watch.record(found.steps["today"], t, [found.watch.equations.table["Z"]])[0]
    a = np.gradient(np.gradient(place, t), t)
    for f in (12.0, 30.0, 70.0):
        wanted = abs((a * np.exp(-2j * np.pi * f * t)).sum() * 1e-4)
        (mine,) = found.table_spectrum("today", np.array([f]), "Z")
        assert mine == pytest.approx(wanted, rel=5e-3)


# -- files and the command ---------------------------------------------------------------------


def test_a_machine_with_a_structure_reads_back_as_itself():
    assert Machine.loads(machine_yaml(VMC33)) == VMC33
    other = replace(VMC33, structure=replace(VMC33.structure, damping=0.03))
    assert other.settings_hash != VMC33.settings_hash


def test_matrices_of_a_file_stand_for_bodies(tmp_path):
    from gcodejerk.simulation.bodies import frame_of

    frame = frame_of(VMC33)
    arrays = {f"nut_{a}": frame.nut[a] for a in "XYZ"} | {f"tool_{a}": frame.tool[a] for a in "XYZ"}
    np.savez(tmp_path / "s.npz", M=frame.mass, K=frame.stiffness, **arrays)
    text = machine_yaml(replace(VMC33, structure=None)) + "structure: {file: s.npz}\n"
    from_file = Machine.loads(text, str(tmp_path / "m.yaml"))
    undamped = replace(VMC33, structure=replace(VMC33.structure, damping=0.0))
    a, b = equations_of(from_file), equations_of(undamped)
    # The motor's torque turns a body back; matrices do not say which.
    assert a.A.shape == b.A.shape
    free = [np.sort(np.abs(np.linalg.eigvals(one.A).imag))[-20:] for one in (a, b)]
    assert free[0] == pytest.approx(free[1], rel=1e-3)
    assert from_file.settings_hash == Machine.loads(text, str(tmp_path / "n.yaml")).settings_hash


WRONG = [
    ("kpp: 40,", "", "has neither kpp nor kv"),
    ("kpp: 40,", "kpp: 40, kv: 2.4,", "has both kpp and kv"),
    ("mass: 250,", "mass: 0,", "above zero"),
    ("mass: 250,", "mass: 250, friction: {coulomb: 9, static: 4},", "at least coulomb, 9"),
    ("lead: 10,", "", "lead is missing"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG)
def test_a_servo_that_cannot_be_is_refused_with_its_place(old, new, said):
    text = BENCH.format(**USUAL)
    assert old in text
    with pytest.raises(MachineFileError, match=said) as caught:
        Machine.loads(text.replace(old, new), "m.yaml")
    assert str(caught.value).startswith("m.yaml:")


STRUCTURES = [
    ("tool: head\n", "tool: haed\n", "'haed', which is no body"),
    ("moves: head,", "moves: arm,", "'arm', which is no body"),
    ("between: [column, bed]", "between: [column]", "a list of 2 names"),
    ("at: [0, -100, 1100]", "at: [0, -100]", "a list of 3 numbers"),
    ("{name: head, ", "{name: bed, ", "that of another body"),
    ("    - {axis: Z, moves: head,   carried_by: column, at: [0, 350, 1550]}   # made up\n", "",
     "turns no screw"),
    ("size: [350, 800, 600],", "", "needs size or inertia"),
    ("  screws:", "  # screws:", "turns no screw"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), STRUCTURES)
def test_a_structure_that_cannot_be_is_refused_with_its_place(old, new, said):
    text = find_machine("vmc33").read_text()
    assert old in text
    with pytest.raises(MachineFileError, match=said):
        Machine.loads(text.replace(old, new, 1), "m.yaml")


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"K": np.eye(2)}, "it has no M"),
        ({"M": np.eye(2), "K": np.eye(3)}, "has the shape"),
        ({"M": np.eye(2), "K": np.array([[1.0, 2.0], [0.0, 1.0]])}, "not symmetric"),
        ({"M": -np.eye(2), "K": np.eye(2)}, "not positive definite"),
        ({"M": np.eye(2), "K": np.full((2, 2), np.nan)}, "what is no number"),
        ({"M": np.eye(2), "K": np.eye(2), "nut_Z": np.ones(2)}, "both nut_ and tool_"),
        ({"M": np.eye(2), "K": np.eye(2), "hat": np.ones(2)}, "hat is not one of"),
    ],
)
def test_matrices_that_are_none_are_refused(tmp_path, arrays, said):
    np.savez(tmp_path / "s.npz", **arrays)
    text = BENCH.format(**USUAL) + "structure: {file: s.npz}\n"
    with pytest.raises(MachineFileError, match=said):
        Machine.loads(text, str(tmp_path / "m.yaml"))


def test_a_file_that_is_no_npz_is_refused(tmp_path):
    (tmp_path / "s.npz").write_bytes(b"no")
    text = BENCH.format(**USUAL) + "structure: {file: s.npz}\n"
    with pytest.raises(MachineFileError, match=r"no \.npz file"):
        Machine.loads(text, str(tmp_path / "m.yaml"))


def test_an_axis_beside_the_structure_is_where_it_is_told_to_be():
    rotary = "  A: {rapid: {velocity: 90, acceleration: 900, jerk: 9.0e+4}, wrap: none}\n"
    text = find_machine("vmc33").read_text()
    machine = Machine.loads(text.replace("axes:\n", "axes:\n" + rotary, 1))
    found = MoveSimulation(plan_move({"A": 30.0, "Z": 1.0}, machine))
    alone = MoveSimulation(plan_move({"Z": 1.0}, VMC33))
    assert found.outcomes["today"].lag[found.watch.equations.axes.index("A")] == 0.0
    assert len(found.watch.equations.A) == len(alone.watch.equations.A)


def test_what_cannot_be_simulated_says_so():
    measured = Spectrum("x.csv", (30.0, 31.0), (0.5, 0.5), 30.0)
    axes = (*VMC33.axes[:2], replace(VMC33.axes[2], spectrum=measured))
    with pytest.raises(PlanError, match="has a spectrum"):
        equations_of(replace(VMC33, axes=axes))
    with pytest.raises(PlanError, match="unstable"):
        equations_of(bench(kpp=3000, bandwidth=900))


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def test_a_move_is_shown_and_written(tmp_path):
    record, course = tmp_path / "z.json", tmp_path / "z.csv"
    done = run("simulate", "Z=1", "-m", "vmc33", "--json", record, "--csv", course)
    assert done.exit_code == 0, done.output
    found = json.loads(record.read_text())
    assert found["states"] == 72
    assert found["planned"]["residual"] < 0.5 * found["today"]["residual"]
    assert found["planned"]["waiting"] == pytest.approx(
        found["planned"]["settling"] - found["planned"]["time"]
    )
    rows = np.genfromtxt(io.BytesIO(course.read_bytes()), delimiter=",", names=True)
    assert rows["planned_Z_command"][-1] == pytest.approx(1.0)
    assert 1e3 * rows["today_Z_lag"].max() == pytest.approx(1e3 * found["today"]["lag"]["Z"], 1e-3)
    assert f"{1e3 * found['today']['residual']:.3g}" in done.output


def test_a_program_is_simulated_rapid_by_rapid(tmp_path):
    program = tmp_path / "part.ngc"
    program.write_text(
        "G21 G90 G94 G64 G17 G40 G54\nG0 X0 Y0 Z0\nG0 Z-9\nG0 X-20\nG0 Z0\nG0 X0\nM2\n"
    )
    record, rapids = tmp_path / "r.json", tmp_path / "r.csv"
    done = run("simulate", program, "-m", "vmc", "--json", record, "--csv", rapids)
    assert done.exit_code == 0, done.output
    found = json.loads(record.read_text())
    summary = found["summary"]
    assert summary["simulated"] + summary["left_alone"] == summary["rapids"]
    assert [row["line"] for row in found["rapids"]] == [3, 4, 5, 6]
    # There and back are alike; the last rapid, which nothing follows, is slower on this control.
    assert summary["distinct"] == 3
    waits = [row["today"]["waiting"] - row["planned"]["waiting"] for row in found["rapids"]]
    times = [row["today"]["time"] - row["planned"]["time"] for row in found["rapids"]]
    assert summary["time_saved"] == pytest.approx(sum(waits) + sum(times))
    assert summary["planned"]["residual_largest"] < summary["today"]["residual_largest"]
    assert len(rapids.read_text().splitlines()) == 5
    played = run("simulate", program, "-m", "vmc", "--as-written", "--json", "-")
    assert played.exit_code == 0, played.output
    again = json.loads(played.output)["rapids"]
    for row, other in zip(again, found["rapids"], strict=True):
        assert row["planned"]["residual"] < other["today"]["residual"]
        kept = other["planned"]["residual"]
        assert row["planned"]["residual"] == pytest.approx(kept, abs=2e-3)


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("Z=1", "part.ngc"), 2, "not both"),
        (("a.ngc", "b.ngc"), 2, "one program"),
        (("part.ngc", "--time", "0.1"), 2, "are of a move"),
        (("Z=1", "--dialect", "fanuc"), 2, "are of a program"),
        (("Z=1", "--plot", "x.txt"), 2, "a figure is one of"),
        (("Z=1", "--json", "x", "--csv", "x"), 2, "files of their own"),
        (("W=1",), 1, "no axis 'W'"),
        (("nowhere.ngc",), 1, "nowhere.ngc"),
    ],
)
def test_wrong_usage_is_told(arguments, status, said):
    done = run("simulate", *arguments, "-m", "vmc33")
    assert done.exit_code == status
    assert said in " ".join((done.output + str(done.exception)).split())


def test_machine_reduce_prints_what_a_machine_file_takes():
    done = run("machine", "reduce", "vmc33")
    assert done.exit_code == 0
    text = find_machine("vmc33").read_text()
    head = text[: text.index("\nmodes:")]
    # The design stays; the structure's servos are there once.
    again = Machine.loads(head + "\n" + done.output, "m.yaml")
    assert again.modes == VMC33.modes
    assert len(json.loads(run("machine", "reduce", "vmc33", "--json").output)) == len(VMC33.modes)
    without = run("machine", "reduce", "vmc")
    assert without.exit_code == 1
    assert "neither servo nor structure" in str(without.exception)


@pytest.mark.parametrize("what", [("Z=1",), ("samples/plate.ngc",)])
def test_pictures_are_drawn(tmp_path, what):
    done = run("simulate", *what, "-m", "vmc33", "--plot", tmp_path / "a.svg")
    assert done.exit_code == 0, done.output
    text = (tmp_path / "a.svg").read_text()
    assert text.count("<path") > 30


def test_the_spectrum_of_a_command_is_that_of_its_samples():
    found = MoveSimulation(plan_move({"Z": 1.0}, VMC33))
    frequency = np.array([12.0, 30.0, 77.0])
    t = np.arange(0.0, 0.0410001, 1e-6)
    a = found.command("planned", t)[2][:, 2]
    sums = [abs((a * np.exp(-2j * np.pi * f * t)).sum() * 1e-6) for f in frequency]
    assert found.command_spectrum("planned", frequency, "Z") == pytest.approx(sums, rel=2e-3)


def test_the_ways_of_a_move_are_told_apart():
    plan = plan_move({"Z": 1.0}, VMC33)
    assert today_steps(plan.plans, 0).displacement == pytest.approx([0.0, 0.0, 1.0])
    assert planned_steps(plan.plans, 0).displacement == pytest.approx([0.0, 0.0, 1.0])
    assert AXES.index("Z") == 2
