"""Settings of controls: how numbers become profiles, what they leave, and the search for the best.

The second way for each: profiles are integrated in time on a fine grid with a mode by matrix
exponential; the search is held against every candidate one by one.
"""

import itertools

import numpy as np
import pytest
from scipy.linalg import expm

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion.families import FAMILIES
from gcodejerk.parameters import (
    Moves,
    Scheme,
    Setting,
    proportional,
    ramp_time,
    share_of_ramp,
    share_of_today,
    tune,
)
from gcodejerk.parameters.judge import Judge, Rows
from gcodejerk.parameters.search import Search, goal_value, needs, representatives

MACHINE = """
interval: 0.001
positioning: {positioning}
controller: fanuc
axes:
  X:
    rapid: {{velocity: 500, acceleration: 4000, jerk: 4.0e+5}}
    limit: {{acceleration: 8000}}
    modes: [{{frequency: 21, damping: 0.02}}, {{frequency: 55, damping: 0.04, participation: 0.4}}]
  Y:
    rapid: {{velocity: 400, acceleration: 3000, jerk: 3.0e+5}}
    modes: [{{frequency: 34, damping: 0.01}}]
modes: [{{frequency: 16, damping: 0.03, participation: {{X: 0.2, Y: 0.5}}}}]
design: {{band: {band}}}
"""


def machine_of(positioning="linear", band=0.0):
    return Machine.loads(MACHINE.format(positioning=positioning, band=band))


def row(**values):
    out = np.full(9, np.inf)
    for axis, value in values.items():
        out[AXES.index(axis)] = value
    return out


def setting(number, axis, relation, step=1.0, lowest=1.0, highest=400.0, **more):
    return Setting(
        number, axis, "ms", "", relation, step, lowest, highest, "M", "", "", "", **more
    )  # fmt: skip


def two_averages(machine, highest=400.0):
    """FT1 as the time to speed, FT2, both in whole ms, for every axis."""
    fixed = {
        "velocity": row(**{a.name: a.rapid.velocity for a in machine.axes}),
        "acceleration": row(**{a.name: a.rapid.acceleration for a in machine.axes}),
        "second_average": row(
            **{a.name: a.rapid.acceleration / a.rapid.jerk for a in machine.axes}
        ),
    }
    settings, groups = [], []
    for axis in machine.axis_names:
        groups.append((len(settings), len(settings) + 1))
        settings += [
            setting("FT1", axis, ramp_time("acceleration", "velocity", 1e-3), highest=highest),
            setting("FT2", axis, proportional("second_average", 1e-3), lowest=0.0, highest=200.0),
        ]
    return Scheme(
        "test", "two averages", FAMILIES["averaged-trapezoid"], fixed, tuple(settings),
        tuple(groups),
    )  # fmt: skip


def moves_of(machine, rows, cut=None):
    displacement = np.zeros((len(rows), 9))
    displacement[:, : len(rows[0])] = rows
    cut = np.ones(len(rows), dtype=bool) if cut is None else np.array(cut)
    return Moves.of(displacement, cut, np.full(len(rows), np.inf), machine)


def ringing(profile_positions, step, frequency, damping):
    """Envelope of a mode's displacement at the end of sampled positions, by matrix exponential."""
    omega = 2.0 * np.pi * frequency
    a = np.array([[0.0, 1.0, 0.0], [-(omega**2), -2.0 * damping * omega, -1.0], [0.0, 0.0, 0.0]])
    advance = expm(a * step)
    acceleration = np.gradient(np.gradient(profile_positions, step), step)
    state = np.zeros(3)
    for value in 0.5 * (acceleration[1:] + acceleration[:-1]):
        state[2] = value
        state = advance @ state
    q, v = state[0], state[1]
    wd = omega * np.sqrt(1.0 - damping**2)
    return np.hypot(q, (v + damping * omega * q) / wd)


def averaged_positions(length, speed, first, second, step):
    """A step of speed behind two discrete averages: positions on a grid, rest at both ends."""
    pulse = np.full(round(length / speed / step), speed)
    velocity = pulse
    for width in (first, second):
        n = round(width / step)
        if n > 1:
            velocity = np.convolve(velocity, np.full(n, 1.0 / n))
    velocity = np.concatenate([np.zeros(4), velocity, np.zeros(4)])
    return np.concatenate([[0.0], np.cumsum(velocity) * step])


def test_numbers_become_the_profile_of_a_fanuc_bell():
    """FT1 = V0/A and FT2 = A/J (worked example: 1420 = 30000, A 5000, 33 ms)."""
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
        "    rapid: {velocity: 500, acceleration: 5000, jerk: 1.515151515e+5}\n"
        "    modes: [{frequency: 30, damping: 0}]\ndesign: {band: 0}\n"
    )
    scheme = two_averages(machine)
    assert scheme.today().tolist() == [100.0, 33.0]
    judge = Judge(scheme, Rows.of(moves_of(machine, [[300.0], [20.0]]), machine))
    written = np.array([[100.0, 33.0]])
    times = judge.times(written)[0]
    assert times == pytest.approx([2 * np.sqrt(20 / 5000) + 0.033, 300 / 500 + 0.1 + 0.033])
    # D |sinc(f D/V) sinc(f V/A) sinc(f A/J)|; V/A and D/V are whole periods of 30 Hz for 300 mm.
    v = np.sqrt(20.0 * 5000.0)
    want = 20.0 * abs(np.sinc(30 * 20 / v) * np.sinc(30 * v / 5000) * np.sinc(30 * 0.033))
    assert judge.worst(written)[0, 0] == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("written", [(125.0, 20.0, 133.0, 30.0), (200.0, 48.0, 90.0, 0.0)])
def test_what_is_left_is_what_a_simulation_leaves(written):
    machine = machine_of()
    scheme = two_averages(machine)
    judge = Judge(scheme, Rows.of(moves_of(machine, [[150.0, 0.0]]), machine))
    left = judge.residuals(np.array([written]))[0, 0]
    step = 1e-5
    speed = min(500.0, np.sqrt(150.0 * 500.0 / (1e-3 * written[0])))
    first = speed / (500.0 / (1e-3 * written[0]))
    positions = averaged_positions(150.0, speed, first, 1e-3 * written[1], step)
    for k, (f, zeta, p) in enumerate(
        ((21, 0.02, 1.0), (55, 0.04, 0.4), (34, 0.01, 0.0), (16, 0.03, 0.2))
    ):
        want = p * ringing(positions, step, f, zeta)
        assert left[k] == pytest.approx(want, rel=2e-3, abs=2e-4)


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_both_axes_ring_together(positioning):
    """Structure modes see both axes; under independent positioning each in its own time."""
    machine = machine_of(positioning)
    scheme = two_averages(machine)
    judge = Judge(scheme, Rows.of(moves_of(machine, [[60.0, -25.0]]), machine))
    written = np.array([[125.0, 20.0, 133.0, 40.0]])
    left = judge.residuals(written)[0, 0]
    step = 1e-5
    ax, ay = 500.0 / 0.125, 400.0 / 0.133
    if positioning == "linear":
        unit = min(ax / 60.0, ay / 25.0)
        bell = 0.020 if ax / 60.0 <= ay / 25.0 else 0.040
        v = min(500.0 / 60.0, 400.0 / 25.0, np.sqrt(unit))
        one = averaged_positions(1.0, v, v / unit, bell, step)
        x, y = 60.0 * one, -25.0 * one
        assert judge.times(written)[0, 0] == pytest.approx(1.0 / v + v / unit + bell, rel=1e-9)
    else:
        vx, vy = min(500.0, np.sqrt(60.0 * ax)), min(400.0, np.sqrt(25.0 * ay))
        x = averaged_positions(60.0, vx, vx / ax, 0.020, step)
        y = -averaged_positions(25.0, vy, vy / ay, 0.040, step)
        size = max(len(x), len(y))
        x = np.concatenate([x, np.full(size - len(x), x[-1])])
        y = np.concatenate([y, np.full(size - len(y), y[-1])])
    want = ringing(0.2 * x + 0.5 * y, step, 16, 0.03)
    assert left[3] == pytest.approx(want, rel=3e-3, abs=2e-4)


def test_the_worst_in_a_band_is_that_of_many_frequencies():
    machine = machine_of(band=0.1)
    scheme = two_averages(machine)
    rows = Rows.of(
        moves_of(machine, [[3.0, 0.0], [40.0, 0.0], [180.0, 0.0], [480.0, 20.0]]), machine
    )
    written = np.array([[140.0, 31.0, 133.0, 40.0], [90.0, 10.0, 200.0, 0.0]])
    judged = Judge(scheme, rows.in_band(0.1, 0.4)).worst(written)
    dense = [
        Judge(scheme, rows.off_by(r)).worst(written) for r in np.linspace(-0.1, 0.1, 1201).tolist()
    ]
    want = np.max(dense, axis=0)
    assert judged == pytest.approx(want, rel=0.02)
    assert (judged >= want * (1.0 - 0.006)).all()


def brute_force(judge, ranges, kind, budget, allowed):
    """Every candidate, one by one."""
    scheme = judge.scheme
    choices = [
        s.choices(low, high, 10**9)
        for s, (low, high) in zip(scheme.settings, ranges.tolist(), strict=True)
    ]
    best = (np.inf, None)
    for numbers in itertools.product(*choices):
        one = np.array([numbers])
        if not allowed(one)[0] or judge.times(one)[0] @ judge.moves.count > budget:
            continue
        value = float(goal_value(judge.worst(one), judge.moves, kind)[0])
        best = min(best, (value, numbers))
    return best


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", ["worst", "mean"])
def test_the_search_finds_what_brute_force_finds(seed, kind):
    rng = np.random.default_rng(seed)
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
        f"    rapid: {{velocity: {rng.uniform(200, 800):.0f}, "
        f"acceleration: {rng.uniform(2e3, 9e3):.0f}, jerk: {rng.uniform(1e5, 1e6):.0f}}}\n"
        f"    modes: [{{frequency: {rng.uniform(12, 60):.1f}, "
        f"damping: {rng.uniform(0, 0.05):.3f}}}, {{frequency: {rng.uniform(60, 120):.1f}, "
        "damping: 0.02, participation: 0.5}]\n"
        "design: {band: 0.05}\n"
    )
    scheme = two_averages(machine, highest=120.0)
    moves = moves_of(machine, rng.uniform(1, 300, (7, 1)).round(2), rng.random(7) < 0.7)
    judge = Judge(scheme, Rows.of(moves, machine).in_band(0.05, 0.4))
    start = scheme.today()
    ranges = np.array([[40.0, 75.0], [0.0, 30.0]])
    budget = float(judge.times(start[np.newaxis])[0] @ moves.count) * rng.uniform(0.95, 1.3)

    def allowed(rows):
        return rows[:, 0] + rows[:, 1] != 60.0

    search = Search(judge, start, (0, 1), ranges, kind, allowed)
    search.within(rng.uniform(0.8, 1.2) * budget)  # what it learns there is of use, or of no harm
    found = search.within(budget)
    value, numbers = brute_force(judge, ranges, kind, budget, allowed)
    if numbers is None:
        assert found is None
        return
    assert found.value == pytest.approx(value, rel=1.1e-3)
    assert found.total <= budget * (1 + 1e-6)
    assert kind == "mean" or found.proven
    assert (found.written == np.round(found.written)).all()


def test_few_candidates_are_judged_on_all_moves():
    machine = machine_of(band=0.05)
    scheme = two_averages(machine)
    rng = np.random.default_rng(5)
    moves = moves_of(machine, np.stack([rng.uniform(1, 400, 300), np.zeros(300)], axis=1))
    found = tune(scheme, moves, machine, curve=False)
    assert found.proven
    assert found.fits
    assert found.judged < 60
    assert found.chosen.total <= found.today.total * (1 + 1e-6)
    assert found.chosen.value < found.today.value


def test_today_is_what_the_machine_file_says():
    """The law of the control with today's numbers is today, where it is the same law."""
    machine = machine_of(band=0.05)
    fixed = {
        q: row(**{a.name: getattr(a.rapid, q) for a in machine.axes})
        for q in ("velocity", "acceleration", "jerk")
    }
    settings = (setting("J", "X", proportional("jerk", 1e3), highest=1e6),)
    scheme = Scheme("test", "", FAMILIES["jerk-limited"], fixed, settings, ((0,),))
    moves = moves_of(machine, [[5.0, 0.0], [70.0, 3.0], [300.0, -200.0]])
    found = tune(scheme, moves, machine, curve=False)
    assert found.as_set.times == pytest.approx(found.today.times, rel=1e-9)
    assert found.as_set.worst == pytest.approx(found.today.worst, rel=1e-9)
    assert found.before.tolist() == [400.0]


def test_settings_that_share_todays():
    """Percent of acceleration and of ramp time, as TwinCAT's G231 and G233 scale them."""
    fixed = {
        "velocity": row(X=500.0), "acceleration": row(X=5000.0), "jerk": row(X=225000.0),
        "today_acceleration": row(X=5000.0), "today_jerk": row(X=225000.0),
    }  # fmt: skip
    settings = (
        setting("G231", "all", share_of_today("acceleration", 0.01)),
        setting("G233", "all", share_of_ramp(0.01), highest=1000.0),
    )
    scheme = Scheme("test", "", FAMILIES["jerk-limited"], fixed, settings, ((0, 1),))
    assert scheme.today().tolist() == [100.0, 100.0]
    axes, _ = scheme.values(np.array([[100.0, 150.0], [50.0, 100.0]]))
    # 22222 us at 100 %: G233 = 150 makes 33333 us of it, the worked example of the facts.
    assert axes["acceleration"][:, 0] == pytest.approx([5000.0, 2500.0])
    assert axes["acceleration"][:, 0] / axes["jerk"][:, 0] == pytest.approx(
        [0.033333, 0.022222], 1e-4
    )


def test_numbers_that_cannot_be_set_are_refused_with_the_nearest():
    scheme = two_averages(machine_of())
    with pytest.raises(PlanError, match=r"FT1 X = 125.4 cannot be set.*steps of 1"):
        scheme.checked({"FT1 X": 125.4})
    with pytest.raises(PlanError) as error:
        scheme.checked({"FT1 X": 4000.0})
    assert "the nearest is 400" in str(error.value)
    with pytest.raises(PlanError, match="has no setting 'FT9'"):
        scheme.checked({"FT9": 1.0})
    assert scheme.checked({"FT2 Y": 12.0})[3] == 12.0


@pytest.mark.parametrize(
    ("lowest", "highest", "step", "most"),
    [(0.0, 1000.0, 1.0, 50), (0.1, 1e6, 0.1, 40), (1.0, 12.0, 1.0, 50), (0.05, 10.0, 0.01, 30)],
)
def test_choices_are_numbers_that_can_be_set(lowest, highest, step, most):
    one = setting("N", "X", proportional("jerk", 1.0), step, lowest, highest)
    numbers = one.choices(lowest, highest, most)
    assert len(numbers) <= most + 1
    assert numbers[0] == pytest.approx(lowest)
    assert numbers[-1] == pytest.approx(highest)
    assert np.allclose(numbers / step, np.round(numbers / step), atol=1e-6)
    assert (np.diff(numbers) > 0).all()


def test_a_rapid_that_a_rapid_follows_may_shake():
    machine = machine_of()
    moves = moves_of(machine, [[100.0, 0.0], [7.0, 0.0]], [False, True])
    assert needs(moves).tolist() == [1.0, 0.0]  # the shorter one comes first
    assert goal_value(np.array([[0.5, 9.0]]), moves, "worst").tolist() == [0.5]
    assert goal_value(np.array([[0.5, 9.0]]), moves, "mean").tolist() == [0.5]
    none = moves_of(machine, [[100.0, 0.0], [7.0, 0.0]], [False, False])
    assert needs(none).tolist() == [1.0, 1.0]


def test_distinct_moves_count_both_ways():
    machine = machine_of()
    moves = moves_of(machine, [[5.0, -2.0], [-5.0, 2.0], [5.0, 2.0], [0.001, 0.0]], [True] * 4)
    assert len(moves) == 2
    assert moves.count.tolist() == [2.0, 1.0]


def test_a_sample_stands_for_all():
    rng = np.random.default_rng(3)
    machine = machine_of()
    moves = moves_of(machine, np.stack([rng.uniform(1, 400, 900), np.zeros(900)], axis=1))
    index, weight = representatives(moves)
    assert len(index) <= 48
    assert (np.diff(index) > 0).all()
    assert weight.sum() == pytest.approx(moves.count.sum())
    judge = Judge(two_averages(machine), Rows.of(moves, machine))
    written = np.array([[125.0, 20.0, 133.0, 30.0], [300.0, 20.0, 133.0, 30.0]])
    whole = judge.times(written) @ moves.count
    some = judge.take(index).times(written) @ weight
    assert some == pytest.approx(whole, rel=0.005)
    left = judge.take(index).worst(written)
    assert left.tolist() == judge.worst(written)[:, index].tolist()


def test_nothing_to_tune_is_said():
    machine = machine_of()
    with pytest.raises(PlanError, match="no rapid whose way is known"):
        moves_of(machine, [[0.0, 0.0]])
    still = Machine.loads(
        "interval: 0.001\npositioning: linear\n"
        "axes:\n  X: {rapid: {velocity: 500, acceleration: 5000}}\n"
    )
    with pytest.raises(PlanError, match="describes no mode"):
        Moves.of_lengths([1.0], still)
    paper = Machine.load(find_machine("paper"))
    moves = moves_of(machine, [[3.0, 0.0]])
    with pytest.raises(PlanError, match="excites a mode"):
        tune(two_averages(paper), moves, paper)


def test_axes_give_each_other_time():
    """An axis that leaves little gives its time to the one that leaves most."""
    machine = machine_of(band=0.0)
    scheme = two_averages(machine)
    moves = moves_of(machine, [[300.0, 0.0], [40.0, 0.0], [0.0, 200.0], [0.0, 30.0]])
    found = tune(scheme, moves, machine, curve=False)
    alone = []
    for axis in (0, 1):
        own = moves_of(
            machine,
            np.eye(2)[axis] * [[300.0], [40.0]] if axis == 0 else np.eye(2)[1] * [[200.0], [30.0]],
        )
        alone.append(tune(scheme, own, machine, curve=False).chosen.value)
    assert found.chosen.total <= found.today.total * (1 + 1e-6)
    assert found.chosen.value <= max(alone) * (1 + 1e-6)
    assert not found.proven


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_a_rapid_that_goes_nowhere_is_no_move_however_short_moves_may_be(positioning):
    machine = machine_of(positioning, "0.1, minimum_length: 0")
    moves = moves_of(machine, [[0.0, 0.0], [12.5, 0.0], [0.0, 1e-9]])
    assert len(moves) == 1
    assert tune(two_averages(machine), moves, machine, curve=False).gains
