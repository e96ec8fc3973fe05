"""Designs on machines: the shortest time, the bound, the band, and measured spectra."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.errors import PlanError
from gcodejerk.machine import Machine, find_machine
from gcodejerk.motion import mode_poles, profiles_response
from gcodejerk.motion.search.optimal import least_residual
from gcodejerk.motion.search.unit_move import Move
from gcodejerk.planning import designs
from gcodejerk.planning.bounds import bounds, known_limits, least_residuals
from gcodejerk.planning.move import plan_move
from gcodejerk.planning.plan import PROFILES, plan_moves
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.task import Task, worst_in_band
from gcodejerk.report.move_record import move_record

DATA = Path(__file__).parents[3] / "shared" / "data"
SAME_TIME = ("condition1", "condition2", "condition3", "symmetric", "cascade", "optimal")
VMC = Machine.load(find_machine("centre"))
PAPER = Machine.load(find_machine("paper"))


def moves(*rows):
    out = np.zeros((len(rows), len(AXES)))
    for row, displacement in zip(out, rows, strict=True):
        for axis, length in displacement.items():
            row[AXES.index(axis)] = length
    return out


def machine_of(axis_lines, more=""):
    text = f"interval: 0.001\npositioning: linear\n{more}axes:\n  Z:\n"
    return Machine.loads(text + "".join(f"    {line}\n" for line in axis_lines))


def task_of(machine, displacement):
    return Task.of(machine, Modes.of(machine), displacement)


@pytest.mark.parametrize("length", [0.3, 1.0, 7.0])
def test_the_shortest_time_is_the_first_in_which_the_tolerance_can_be_kept(length):
    plans = plan_moves(moves({"Z": length}), PAPER, "shortest")
    count, tolerance = int(plans.counts[0]), PAPER.design.tolerance
    task = task_of(PAPER, moves({"Z": length}))
    left = float(worst_in_band(task, plans.profiles)[0])
    assert left <= tolerance
    limits = (600 / length, 5000 / length, 5e6 / length)
    poles, weight = mode_poles([30.0], [0.0]), np.array([length])
    before = least_residual(
        Move(count - 1, *limits, poles, weight, np.arange(1), PAPER.design.band, 0.001), length
    )
    assert before is None or before.worst > 0.96 * tolerance
    assert float(plans.profiles.total[0]) == pytest.approx(count * 0.001)


def test_the_shortest_profile_is_settled_long_before_the_controllers_own_move():
    plan = plan_move({"Z": 1.0}, VMC, "shortest")
    assert plan.plans.modes.grouped(plan.residual).max() <= 1.1 * VMC.design.tolerance
    # 345 um at 30 Hz and 2 % need 1.5 s to fall to 1 um.
    settled = np.log(345.0 / 1.0) / (0.02 * 60 * np.pi)
    assert plan.time < 0.07 < 0.04 + settled


def test_where_nothing_vibrates_the_shortest_time_is_the_fastest():
    still = machine_of(["rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}"])
    plans = plan_moves(moves({"Z": 1.0}, {"Z": 80.0}), still, "shortest")
    assert plans.planned.all()
    assert (plans.counts < np.ceil(plans.conventional_time / 0.001)).all()


def test_where_nothing_vibrates_and_nothing_limits_the_jerk_a_short_way_has_a_shortest_time():
    """The least time that the limits allow is too short for segments of an interval or more."""
    limits = "limit: {acceleration: 11000}"
    still = machine_of(["rapid: {velocity: 260, acceleration: 3700}", limits])
    plans = plan_moves(moves({"Z": 0.04}, {"Z": 0.07}), still, "shortest")
    assert plans.planned.all()
    assert (plans.profiles.total <= plans.counts * 0.001 + 1e-12).all()
    assert (plans.counts <= np.ceil(plans.conventional_time / 0.001)).all()


def test_no_profile_of_the_same_time_leaves_less_than_the_bound():
    rng = np.random.default_rng(2)
    drawn = 10 ** rng.uniform(-1, 1.3, (12, 2))
    rows = [{"Z": float(z), "X": float(x)} for z, x in drawn]
    displacement = moves(*rows, {"Z": 1.0}, {"X": 5.0})
    for profile in SAME_TIME:
        plans = plan_moves(displacement, VMC, profile)
        assert plans.planned.any(), profile
        least = least_residuals(plans)[plans.move]
        task = task_of(VMC, plans.share).after(plans.profile_counts)
        left = task.objective.of(plans.profiles)
        # A profile with segments off the grid may gain a little over the best on it.
        assert (left >= least * 0.97 - 1e-6).all(), profile
    assert plans.planned.all()
    assert np.median(least / task.objective.of(task.conventional)) < 0.01


def test_an_optimum_is_taken_even_where_it_gains_less_than_rounding_may_add():
    # Coarse steps: 3 % of 29 um may be rounding. A rival gains about as much, and is taken.
    machine = machine_of(
        ["resolution: 0.01", "rapid: {velocity: 188.7, acceleration: 430.7, jerk: 173670}",
         "limit: {acceleration: 516.84, jerk: 1736700}",
         "modes:", "  - {frequency: 16.6, damping: 0, participation: 0.8499}",
         "  - {frequency: 49.44, damping: 0, participation: 0.3293}"],
        "design: {band: 0.1}\n",
    )  # fmt: skip
    displacement = moves({"Z": 0.0361472})
    task = task_of(machine, displacement)
    left = {}
    for profile in ("conventional", *SAME_TIME):
        plans = plan_moves(displacement, machine, profile)
        # What is left alone leaves what the control's own rapid leaves.
        left[profile] = (
            worst_in_band(task, plans.profiles)[0] if plans.planned[0] else left["conventional"]
        )
    assert left["optimal"] < 0.98 * left["conventional"]
    assert left["optimal"] <= min(left.values()) * 1.001


def test_the_bound_is_null_where_an_exact_null_exists():
    assert bounds(task_of(PAPER, moves({"Z": 1.0})))[0] < 1e-12
    # With the conventional jerk as limit only the conventional profile remains.
    tight = machine_of(
        ["rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}",
         "limit: {acceleration: 5000.01, jerk: 5.00001e+5}",
         "modes: [{frequency: 30, damping: 0}]"]
    )  # fmt: skip
    assert bounds(replace(task_of(tight, moves({"Z": 1.0})), band=0.0))[0] == pytest.approx(
        0.37177, rel=2e-3
    )


def test_axes_that_move_alone_have_the_bound_of_the_worst_of_them():
    text = "positioning: independent\ninterval: 0.001\naxes:\n" + "".join(
        f"  {axis}: {{rapid: {{velocity: 600, acceleration: 5000, jerk: 5.0e+5}}, "
        f"limit: {{jerk: 7.0e+5}}, modes: [{{frequency: {f}, damping: 0}}]}}\n"
        for axis, f in (("X", 23), ("Y", 31))
    )
    machine = Machine.loads(text)
    together = least_residuals(plan_moves(moves({"X": 2.0, "Y": 1.0}), machine))
    alone = [least_residuals(plan_moves(moves(row), machine)) for row in ({"X": 2.0}, {"Y": 1.0})]
    assert together[0] == pytest.approx(max(alone)[0])
    assert together[0] > 1e-3


def test_a_band_is_judged_where_it_is_worst():
    plans = plan_moves(moves({"Z": 1.0}, {"Z": 40.0}), VMC, "condition3")
    found = worst_in_band(task_of(VMC, plans.share).after(plans.counts), plans.profiles)
    relative = np.linspace(0.95, 1.05, 801)
    for k, length in enumerate((1.0, 40.0)):
        worst = 0.0
        for mode in VMC.axis("Z").modes:
            poles = mode_poles(mode.frequency * relative, np.full(801, mode.damping))
            D = np.abs(profiles_response(plans.profiles.take(np.array([k])), poles))[0] / poles.imag
            worst = max(worst, float(D.max()) * length * mode.participation_of("Z"))
        assert found[k] == pytest.approx(worst, rel=2e-3)


@pytest.mark.parametrize("profile", PROFILES)
def test_every_profile_can_be_planned_and_reported(profile):
    plan = plan_move({"Z": 2.0}, VMC, profile)
    record = move_record(plan)["rapids"][0]
    assert record["profile"] in (profile, "conventional")
    assert sum(s["duration"] for s in record["segments"]) == pytest.approx(plan.time, abs=1e-9)
    left = max(entry["displacement"] for entry in record["residual"])
    assert 0.0 <= record["limit"] <= left


@pytest.mark.parametrize("seed", range(3))
def test_no_move_is_designed_otherwise_because_of_what_stands_beside_it(seed, monkeypatch):
    machine = machine_of(
        (
            "resolution: 1.0e-4",
            "rapid: {velocity: 600, acceleration: 5000, jerk: 300000}",
            "modes: [{frequency: 105, damping: 0.02, participation: 0.5}]",
        )
    )
    displacement = moves(*({"Z": length} for length in np.geomspace(0.05, 300.0, 400)))
    designs._remembered.cache_clear()
    together = plan_moves(displacement, machine)
    random = np.random.default_rng(seed)
    order = random.permutation(len(displacement))[:100]
    monkeypatch.setattr(designs, "AT_ONCE", int(random.integers(1, 9)))
    designs._remembered.cache_clear()
    others = plan_moves(displacement[order], machine)
    np.testing.assert_array_equal(others.worst_in_band, together.worst_in_band[order])
    np.testing.assert_array_equal(others.planned, together.planned[order])


@pytest.mark.parametrize("profile", ["zv", "shortest"])
def test_a_profile_whose_time_is_its_result_takes_none(profile):
    with pytest.raises(PlanError, match="time") as caught:
        plan_move({"Z": 1.0}, VMC, profile, time=0.05)
    assert "--time" in caught.value.remedy


@pytest.mark.parametrize("profile", SAME_TIME)
def test_a_time_that_is_too_short_is_refused_with_the_least(profile):
    with pytest.raises(PlanError, match=r"in 0\.028 s, above its limit") as caught:
        plan_move({"Z": 1.0}, VMC, profile, time=0.028)
    assert "--time 0.0" in caught.value.remedy


def test_a_family_that_has_no_member_says_so():
    # 100 mm reach 600 mm/s: no four segments do that in any time near.
    with pytest.raises(PlanError, match=r"no profile condition1 of 0\.3 s keeps the limits"):
        plan_move({"Z": 100.0}, VMC, "condition1", time=0.3)


def test_without_the_solver_a_bound_is_unknown_and_the_plan_is_not(monkeypatch):
    def missing():
        raise PlanError("no solver", "install it")

    monkeypatch.setattr("gcodejerk.planning.bounds.require_solver", missing)
    plan = plan_move({"Z": 1.0}, VMC)
    assert known_limits(plan.plans) is None
    assert move_record(plan)["rapids"][0]["limit"] is None


def spectrum_of(peaks):
    """A spectrum as Klipper writes it, with resonances at these frequencies."""
    f = np.arange(0.0, 200.0, 1.5)
    psd = sum(1.0 / ((1 - (f / f0) ** 2) ** 2 + (2 * z * f / f0) ** 2) for f0, z in peaks)
    lines = [f"{x:.1f},{p:.3e},0,0,{p:.3e}" for x, p in zip(f, psd, strict=True)]
    return "freq,psd_x,psd_y,psd_z,psd_xyz\n" + "\n".join(lines) + "\n"


SPECTRAL = ["rapid: {velocity: 300, acceleration: 3000, jerk: 1.0e+5}",
            "limit: {acceleration: 5000, jerk: 3.0e+6}", "spectrum: measured.csv"]  # fmt: skip


def test_a_measured_spectrum_takes_the_place_of_modes(tmp_path):
    (tmp_path / "measured.csv").write_text(spectrum_of([(43.0, 0.05), (71.0, 0.08)]))
    text = "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
    file = tmp_path / "printer.yaml"
    file.write_text(text + "".join(f"    {line}\n" for line in SPECTRAL))
    machine = Machine.load(file)
    left = {}
    for profile in ("conventional", *SAME_TIME):
        plan = plan_move({"X": 20.0}, machine, profile)
        (entry,) = move_record(plan)["rapids"][0]["residual"]
        assert entry["mode"] == "spectrum measured.csv"
        assert entry["frequency"] == pytest.approx(43.0, abs=1.5)
        # The weighted mean over all lines, worked out line by line.
        spectrum = machine.axis("X").spectrum
        f, damping, share = np.array(spectrum.oscillators()).T
        assert share.sum() == pytest.approx(1.0)
        assert share @ f == pytest.approx(np.dot(spectrum.weight, spectrum.frequency), rel=0.02)
        poles = mode_poles(f, damping)
        D = np.abs(profiles_response(plan.profiles, poles))[0] / poles.imag * 20.0
        A = D * (2 * np.pi * f) ** 2
        mean = np.sqrt(np.sum(share * A**2)) / (2 * np.pi * spectrum.peak) ** 2
        assert entry["displacement"] == pytest.approx(mean, rel=0.02, abs=3e-4)
        left[profile] = mean
    assert left["optimal"] == min(left.values())
    assert left["optimal"] < 0.8 * left["conventional"]


def test_no_profile_hides_between_the_lines_of_a_spectrum(tmp_path):
    (tmp_path / "measured.csv").write_text(spectrum_of([(43.0, 0.05), (71.0, 0.08)]))
    text = "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
    file = tmp_path / "printer.yaml"
    file.write_text(text + "".join(f"    {line}\n" for line in SPECTRAL))
    machine = Machine.load(file)
    displacement = moves({"X": 20.0})
    best = plan_moves(displacement, machine, "optimal")
    usual = plan_moves(displacement, machine, "conventional")
    task = task_of(machine, displacement)
    for off in (0.99, 1.005, 1.02):
        moved = replace(task.objective, poles=task.objective.poles * off)
        assert moved.of(best.profiles)[0] < 0.85 * moved.of(usual.profiles)[0]


@pytest.mark.skipif(not DATA.is_dir(), reason="the measured spectra lie beside the project")
@pytest.mark.parametrize("name", sorted(p.name for p in DATA.glob("*.csv")))
def test_measured_spectra_go_through_every_design(name, tmp_path):
    text = "interval: 0.001\npositioning: linear\naxes:\n  X:\n"
    lines = [*SPECTRAL[:2], f"spectrum: {DATA / name}"]
    machine = Machine.loads(text + "".join(f"    {line}\n" for line in lines))
    displacement = moves({"X": 3.0}, {"X": 20.0}, {"X": 60.0})
    usual = plan_moves(displacement, machine, "conventional")
    task = task_of(machine, usual.share)
    today = task.objective.of(usual.profiles)

    def left_by(profile):
        """What a profile leaves; what is left alone leaves what the control's own rapid does."""
        plans, left = plan_moves(displacement, machine, profile), today.copy()
        left[plans.planned] = task.objective.take(plans.planned).of(plans.profiles)
        return left

    best = left_by("optimal")
    for profile in ("condition3", "symmetric", "cascade"):
        left = left_by(profile)
        assert (left <= today * (1 + 1e-6)).all()
        assert (best <= left * (1 + 1e-3)).all()
    assert (best < 0.7 * today).all()


def test_the_bound_over_a_band_is_that_of_the_programme_or_next_to_nothing():
    task = task_of(VMC, moves({"Z": 1.0}, {"X": 43.773}, {"X": 5.0, "Z": 2.0}))
    found, reference = bounds(task), task.objective.of(task.conventional)
    for k, (least, today) in enumerate(zip(found, reference, strict=True)):
        V, A, J = (float(limit[k]) for limit in task.limits)
        move = Move(
            int(task.counts[k]), V, A, J, task.objective.poles, task.objective.weights[k],
            task.objective.group, task.band, task.interval,
        )  # fmt: skip
        directly = least_residual(move, float(today)).worst
        if least:
            assert least == pytest.approx(directly, rel=0.02)
        else:
            assert directly <= 1e-3 * today
    assert found[0] > 0.0
    assert found[1] == 0.0
