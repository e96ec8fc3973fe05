"""How long the machine shakes: the closed form beside an envelope that is followed step by step."""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.planning.plan import SMALL_GAIN, plan_moves
from gcodejerk.planning.plans import Modes
from gcodejerk.planning.settling import settled, settling_times
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.report.records import summary_of
from gcodejerk.report.tables import summary_line, whole_line
from gcodejerk.rewrite.pipeline import process

VMC = Machine.load(find_machine("vmc"))
PROGRAM = b"""G21 G90 G94 G17 G64 P0.01
G0 X0 Y0 Z0
G0 Z12.5
G1 Z12 F200
G0 Z12.04
G1 Z12 F200
/G0 Z2
G0 Z20
G91 G28 Z0
G90
G0 X[#5]
M2
"""


def followed(residual, modes, tolerance, step=1e-5, longest=20.0):
    """When the last envelope passes the tolerance, looked for from behind on a fine grid."""
    t = np.arange(0.0, longest, step)
    late = 0.0
    for entry in range(len(modes.modes)):
        index = np.flatnonzero(modes.group == entry)
        square = sum((residual[k] * np.exp(modes.poles[k].real * t)) ** 2 for k in index)
        above = np.flatnonzero(np.sqrt(square) > tolerance)
        late = max(late, t[above[-1]] + step if len(above) else 0.0)
    return late


def test_settling_is_where_the_followed_envelope_stays_within_the_tolerance():
    modes, rng = Modes.of(VMC), np.random.default_rng(5)
    residual = 10.0 ** rng.uniform(-5.0, 0.0, (12, len(modes.poles)))
    found = settling_times(residual, modes, 0.001)
    for row in range(len(residual)):
        assert found[row] == pytest.approx(followed(residual[row], modes, 0.001), abs=2e-5)


def test_an_envelope_is_that_of_a_simulated_oscillator():
    # 30 Hz, damping 0.02, left alone with 0.3 mm: a step of 10 us, no closed form.
    omega, zeta, x, v, dt = 2 * np.pi * 30.0, 0.02, 0.3, 0.0, 1e-5
    last = 0.0
    for k in range(200_000):
        a = -2 * zeta * omega * v - omega**2 * x
        v += a * dt
        x += v * dt
        if abs(x) > 0.001:
            last = k * dt
    modes = Modes.of(VMC)
    residual = np.zeros((1, len(modes.poles)))
    residual[0, [mode.frequency for mode in modes.modes].index(30.0)] = 0.3
    # The last time that the swing itself passes is at most half a period before the envelope's.
    assert 0.0 <= float(settling_times(residual, modes, 0.001)[0]) - last <= 0.5 / 30.0


def test_lines_of_a_spectrum_settle_together(tmp_path):
    # Lines that stand for unlike widths are damped unlike.
    (tmp_path / "x.csv").write_text(
        "frequency,PSD\n" + "".join(f"{20.0 * 1.08**k},{40 - 3 * abs(k - 5)}\n" for k in range(11))
    )
    text = "interval: 0.001\npositioning: linear\naxes:\n  X:\n    spectrum: x.csv\n"
    text += "    rapid: {velocity: 300, acceleration: 3000, jerk: 1.0e+5}\n"
    (tmp_path / "m.yaml").write_text(text)
    modes = Modes.of(Machine.load(tmp_path / "m.yaml"))
    residual = np.random.default_rng(2).uniform(0.0, 0.2, (4, len(modes.poles)))
    found = settling_times(residual, modes, 0.001)
    for row in range(4):
        expected = followed(residual[row], modes, 0.001, longest=5.0)
        assert found[row] == pytest.approx(expected, abs=2e-5)


def test_a_mode_without_damping_never_settles_unless_it_keeps_too_little():
    paper = Machine.load(find_machine("paper"))
    residual = np.array([[0.3], [0.0005], [np.nan]])
    found = settling_times(residual, Modes.of(paper), 0.001)
    assert np.isinf(found[0])
    assert found[1] == 0.0
    assert np.isnan(found[2])
    summary = summary_of(process(b"G21 G90 G94 G64\nG0 Z0\nG0 Z1\nM2\n", paper))
    assert summary["conventional_settling_time"] is None
    assert "without end" in whole_line(summary)


def test_the_summary_counts_what_stays_and_the_time_of_the_whole_program():
    result = process(PROGRAM, VMC)
    plans, summary = result.plans, summary_of(result)
    left = {
        int(line): (
            bool(np.isfinite(result.rest.residual[row]).all()),
            bool(result.rest.unknown[row]),
        )
        for row, line in enumerate(result.program.rapids.line.tolist())
        if not plans.planned[row]
    }
    # Of line 5 (too short) and 7 (block delete) all is known, of homing and of #5 nothing.
    assert left[5] == (True, False)
    assert left[7] == (True, False)
    assert left[9] == (False, True)
    assert summary["left_unknown"] == sum(unknown for _, unknown in left.values())
    today = np.nanmax(result.conventional_residual[plans.planned])
    stays = np.nanmax(result.rest.residual)
    assert summary["worst_residual_all"] == pytest.approx(
        max(stays, np.nanmax(result.residual[plans.planned]))
    )
    assert summary["worst_conventional_residual_all"] == pytest.approx(max(today, stays))
    short = 2.0 * np.sqrt(0.04 / 5000.0)
    row = result.program.rapids.line.tolist().index(5)
    assert result.rest.time[row] == pytest.approx(short)
    assert summary["conventional_time_all"] == pytest.approx(
        summary["conventional_time"] + result.rest.time.sum()
    )
    known = np.where(plans.planned[:, None], result.conventional_residual, result.rest.residual)
    waiting = np.nansum(settling_times(known, plans.modes, VMC.design.tolerance))
    assert summary["conventional_settling_time"] == pytest.approx(waiting)
    assert summary["settling_time"] < summary["conventional_settling_time"]
    line = summary_line("p.nc", summary)
    share = 100 * summary["worst_residual"] / summary["worst_conventional_residual"]
    assert f"worst residual {share:.2g} % of today's (" in line


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_what_stays_leaves_what_its_stream_would_have_replaced(positioning):
    # The same rapid, once planned and once too short to be: today's residual is the same.
    machine = dataclasses.replace(VMC, positioning=positioning, controller="mach")
    design = dataclasses.replace(VMC.design, minimum_length=100.0)
    shy = dataclasses.replace(machine, design=design)
    text = b"G21 G90 G94 G17 G64 P0.01\nG0 X0 Y0 Z0\nG0 X3 Y9 Z12.5\nG1 Z12 F200\nM2\n"
    done, left = process(text, machine), process(text, shy)
    assert done.planned == 1
    assert left.planned == 0
    # That of the stream is of samples, which end at a whole interval: fast modes decay till then.
    worst = left.rest.residual[1].max()
    assert worst == pytest.approx(done.conventional_residual[1].max(), rel=0.02)
    assert left.rest.time[1] == pytest.approx(done.plans.conventional_time[1])


def integrated(profiles, row, pole, rest):
    """What an oscillator keeps of a unit profile when that has rested for a while."""
    omega, zeta = abs(pole), -pole.real / abs(pole)
    system = np.zeros((4, 4))
    system[0, 1], system[1], system[2, 3] = 1.0, (-(omega**2), -2.0 * zeta * omega, -1.0, 0.0), 1.0
    state = np.zeros(4)
    own = slice(profiles.first[row], profiles.first[row + 1])
    segments = (profiles.duration[own], profiles.acceleration[own], profiles.jerk[own])
    for duration, acceleration, jerk in [*zip(*segments, strict=True), (rest, 0.0, 0.0)]:
        state[2:] = acceleration, jerk
        state = expm(system * duration) @ state
    return state[:2]


def kept(plans, rows, pole, participation):
    """What a mode keeps of the profiles of a move, when the last of them has ended: integrated."""
    total = plans.profiles.total[rows]
    state = sum(
        integrated(plans.profiles, row, pole, total.max() - plans.profiles.total[row])
        * (plans.share[row] @ participation)
        for row in rows
    )
    return np.hypot(state[0], (state[1] - pole.real * state[0]) / abs(pole.imag))


@pytest.mark.parametrize("positioning", ["linear", "independent"])
@pytest.mark.parametrize("at_once", [1, 1 << 18])
def test_rapids_that_are_left_alone_leave_what_is_integrated(positioning, at_once, monkeypatch):
    monkeypatch.setattr("gcodejerk.planning.settling.AT_ONCE", at_once)
    design = dataclasses.replace(VMC.design, minimum_length=500.0)
    machine = dataclasses.replace(VMC, positioning=positioning, design=design, controller="grbl")
    program = b"G21 G90 G94 G17\nG0 X0 Y0 Z0\n"
    program += b"G0 X30 Y-7\nG0 Z12\nG0 X30 Y-7\nG0 X-3 Y55 Z-4\nM2\n"
    result = process(program, machine)
    found, lone = result.rest, result.program.rapids.lone[[1, 2, 4]]
    moved = np.zeros((3, len(AXES)))
    moved[:, :3] = [[30.0, -7.0, 0.0], [0.0, 0.0, 12.0], [-33.0, 62.0, -16.0]]
    plans = plan_moves(moved, machine, "conventional", as_today=True, lone=lone)
    modes = plans.modes
    assert found.unknown.tolist() == [True, False, False, False, False]
    for rapid, move in ((1, 0), (2, 1), (4, 2)):
        rows = np.flatnonzero(plans.move == move)
        each = zip(modes.poles, modes.participation, strict=True)
        wanted = [kept(plans, rows, *mode) for mode in each]
        np.testing.assert_allclose(found.residual[rapid], wanted, atol=1e-9)
        assert found.time[rapid] == pytest.approx(plans.profiles.total[rows].max())
    assert found.time[3] == 0.0, "nothing moves"


@pytest.mark.parametrize("positioning", ["linear", "independent"])
@pytest.mark.parametrize("at_once", [1, 1 << 18])
def test_settled_is_the_mean_of_what_is_integrated_over_the_band(positioning, at_once, monkeypatch):
    monkeypatch.setattr("gcodejerk.planning.settling.AT_ONCE", at_once)
    design = dataclasses.replace(VMC.design, band=0.05, tolerance=0.002)
    machine = dataclasses.replace(VMC, positioning=positioning, design=design)
    displacement = np.zeros((3, len(AXES)))
    displacement[:, :3] = [[30.0, -7.0, 0.0], [0.0, 0.0, 12.0], [2.0, 55.0, -4.0]]
    plans = plan_moves(displacement, machine, "conventional", as_today=True)
    modes, band = plans.modes, design.band
    found = settled(modes, machine, plans.move, plans.share, plans.profiles)
    assert len(plans.move) == (3 if positioning == "linear" else 6)
    for move in range(3):
        rows = np.flatnonzero(plans.move == move)
        arrival = plans.profiles.total[rows].max()
        late = []
        for factor in np.linspace(1.0 - band, 1.0 + band, 21):
            off = dataclasses.replace(modes, poles=modes.poles * factor)
            residual = []
            for mode in zip(off.poles, modes.participation, strict=True):
                residual.append(kept(plans, rows, *mode))
            late.append(followed(np.array(residual), off, 0.002, step=1e-4, longest=4.0))
        assert found[move] == pytest.approx(arrival + np.mean(late), abs=2e-4)


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_a_rapid_that_gains_little_and_settles_later_stays(positioning):
    machine = dataclasses.replace(VMC, positioning=positioning, controller="mach")
    displacement = np.zeros((150, len(AXES)))
    displacement[:, AXES.index("Z")] = np.geomspace(1.0, 60.0, len(displacement))
    queued = np.zeros(len(displacement), dtype=bool)
    deaf = dataclasses.replace(machine.design, tolerance=1.0)  # to which all is settled at once
    plans, every = (
        plan_moves(displacement, dataclasses.replace(machine, design=design), lone=queued)
        for design in (machine.design, deaf)
    )
    stays = every.planned & ~plans.planned
    assert stays.any()
    assert {REASONS[k] for k in plans.reason[stays]} == {Reason.LATER}
    share = every.worst_in_band / every.most_in_band
    assert share[stays].min() > 1.0 - SMALL_GAIN
    what = (every.modes, machine, np.arange(len(every.share)), every.share)
    today, planned = (settled(*what, own) for own in (every.conventional, every.profiles))
    later = np.zeros(len(displacement), dtype=bool)
    later[every.move] = planned / today > 1.0 / share[every.move]
    assert (later & (share > 1.0 - SMALL_GAIN))[every.planned].tolist() == stays[
        every.planned
    ].tolist()
    assert (later & ~stays)[every.planned].any(), "a large gain is worth the waiting"
