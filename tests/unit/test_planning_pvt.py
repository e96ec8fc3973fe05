"""Rows of position and velocity, judged by a reader of its own: scipy's cubics, and oscillators.

The oscillator is integrated by matrix exponentials of its state and the acceleration's, piece by
piece: nothing is shared with the sums over jumps by which the planner computes residuals.
"""

import csv
import io

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.linalg import expm

from gcodejerk import Machine, process

MACHINE = """
interval: 0.001
positioning: {positioning}
axes:
  X:
    rapid: {{velocity: 500, acceleration: 4000, jerk: 120000}}
    limit: {{velocity: 500, acceleration: 4400, jerk: 1.5e+6}}
    modes: [{{frequency: 31.7, damping: 0.023}}]
  Y:
    rapid: {{velocity: 400, acceleration: 3000, jerk: 90000}}
    limit: {{velocity: 400, acceleration: 3300, jerk: 1.2e+6}}
    modes: [{{frequency: 44.1, damping: 0.017, participation: 0.7}}]
modes: [{{frequency: 23.3, damping: 0.031, participation: {{X: 0.4, Y: -0.8}}}}]
"""
PROGRAM = b"""G21 G90 G94 G17 G40 G49 G80 G54
G1 X0 Y0 F600
G0 X12.345678
G0 X211.1 Y-83.7
G0 Y-83.0
G0 X-0.25 Y0.5
G0 X1.2 Y40
"""


def machine(positioning="linear"):
    return Machine.loads(MACHINE.format(positioning=positioning))


def tables(result):
    """Line -> t, and position and velocity of each axis."""
    out = {}
    for row in csv.DictReader(io.StringIO(result.output.decode())):
        out.setdefault(int(row.pop("block")), []).append({k: float(v) for k, v in row.items()})
    return {
        line: {key: np.array([row[key] for row in rows]) for key in rows[0]}
        for line, rows in out.items()
    }


def residual(rows, frequency, damping, share):
    """Displacement envelope after a move, by the exact motion of state and acceleration."""
    omega = 2 * np.pi * frequency
    splines = {a: CubicHermiteSpline(rows["t"], rows[a], rows[f"{a}_velocity"]) for a in share}
    state = np.zeros(2)
    for t0, t1 in zip(rows["t"][:-1], rows["t"][1:], strict=True):
        h = t1 - t0
        begin, end = (
            sum(p * splines[a].derivative(2)(t) for a, p in share.items())
            for t in (t0 + 1e-6 * h, t1 - 1e-6 * h)
        )
        slope = (end - begin) / (h * (1 - 2e-6))
        force = begin - slope * 1e-6 * h
        system = np.zeros((4, 4))
        system[0, 1], system[1] = 1.0, (-(omega**2), -2 * damping * omega, -1.0, 0.0)
        system[2, 3] = 1.0
        state = (expm(system * h) @ np.array([*state, force, slope]))[:2]
    q, v = state
    damped = omega * np.sqrt(1 - damping**2)
    return np.hypot(q, (v + damping * omega * q) / damped)


@pytest.mark.parametrize("positioning", ["linear", "independent"])
@pytest.mark.parametrize("profile", ["condition3", "symmetric", "cascade", "conventional"])
def test_rows_leave_what_the_report_says_and_keep_the_limits(profile, positioning):
    described = machine(positioning)
    result = process(PROGRAM, described, controller="csv", form="pvt", profile=profile)
    found = tables(result)
    assert len(found) == result.planned >= 3
    modes = [(m.frequency, m.damping, dict(m.participation)) for _, m in described.all_modes()]
    for move, line in enumerate(result.program.rapids.line.tolist()):
        if line not in found:
            continue
        rows = found[line]
        largest = max(residual(rows, f, z, share) for f, z, share in modes)
        assert result.rapids[move].residual == pytest.approx(largest, rel=1e-3, abs=1e-9)
        assert result.rapids[move].time == pytest.approx(rows["t"][-1], abs=1e-12)
        for k, axis in enumerate("XY"):
            assert rows[axis][0] == result.program.rapids.start[move][k]
            assert rows[axis][-1] == result.program.rapids.target[move][k]
            assert (rows[f"{axis}_velocity"][[0, -1]] == 0.0).all()
            spline = CubicHermiteSpline(rows["t"], rows[axis], rows[f"{axis}_velocity"])
            t = np.linspace(0.0, rows["t"][-1], 20_001)
            limit = described.axis(axis).limit
            assert np.abs(spline(t, 1)).max() <= limit.velocity * (1 + 1e-6)
            assert np.abs(spline(t, 2)).max() <= limit.acceleration * (1 + 1e-4)
            assert np.abs(spline(t, 3)).max() <= limit.jerk * (1 + 1e-3)


def test_an_optimum_of_many_segments_is_rows_too():
    described = machine()
    result = process(PROGRAM, described, controller="csv", form="pvt", profile="optimal")
    assert result.planned >= 3
    found = tables(result)
    assert max(len(rows["t"]) for rows in found.values()) > 20
    modes = [(m.frequency, m.damping, dict(m.participation)) for _, m in described.all_modes()]
    for row, line in zip(result.rapids, result.program.rapids.line.tolist(), strict=True):
        if line in found:
            largest = max(residual(found[line], f, z, share) for f, z, share in modes)
            assert row.residual == pytest.approx(largest, rel=1e-3, abs=1e-8)


def test_axes_that_run_on_their_own_have_the_rows_of_both():
    result = process(PROGRAM, machine("independent"), controller="csv", form="pvt")
    rows = tables(result)[4]
    for axis in "XY":
        spline = CubicHermiteSpline(rows["t"], rows[axis], rows[f"{axis}_velocity"])
        jumps = spline(rows["t"][1:-1] + 1e-9, 2) - spline(rows["t"][1:-1] - 1e-9, 2)
        assert np.abs(jumps).max() < 10.0
    # The shorter axis arrives first, and stands.
    arrived = np.flatnonzero(rows["Y"] == -83.7)
    assert len(arrived) > 1
    assert (rows["Y_velocity"][arrived] == 0.0).all()


def test_ends_are_those_of_the_program_in_counts_and_never_drift():
    options = {"counts_per_unit": {"X": 37.0, "Y": 41.0}}
    values = Machine.loads(MACHINE.format(positioning="linear"))
    from dataclasses import replace

    described = replace(values, controller_options=replace(values.controller_options, **options))
    program = b"G21 G90 G94 G17 G40 G49 G80 G54\nG1 X0.013 Y0 F600\n" + b"".join(
        b"G0 X%.4f\n" % (10.0137 * k) for k in range(1, 9)
    )
    result = process(program, described, controller="elmo")
    ends = [
        int(block.split("\n# ")[0].strip().splitlines()[-1].split(",")[0])
        for block in result.output.decode().split("time_ms\n")[1:]
    ]
    kept = [k for k, row in enumerate(result.rapids) if row.rewritten]
    assert ends == [round(10.0137 * (k + 1) * 37.0) for k in kept]


@pytest.mark.parametrize("controller", ["csv", "json"])
@pytest.mark.parametrize(
    ("begin", "end"), [(2000, 0), (4000, 0), (1900, 0), (0, 4000), (-3999.9, 1)]
)
def test_far_starts_are_judged_by_their_own_digits(controller, begin, end):
    program = f"G21 G90 G94 G17 G40 G49 G80 G54\nG1 X{begin} F600\nG0 X{end}\nM2\n".encode()
    form = "pvt" if controller == "csv" else "stream"
    assert process(program, machine(), controller=controller, form=form).planned == 1


@pytest.mark.parametrize(
    ("text", "planned"),
    [(b"M2\n", 0), (b"G21 G90 G94\nG1 X0 Y0 F9\nG0 X0\nG0 X0.0000000001\nM2\n", 0)],
)
def test_nothing_to_do_is_a_head_alone(text, planned):
    result = process(text, machine(), controller="csv", form="pvt")
    assert result.planned == planned
    assert result.output == b"block,t,X,X_velocity,Y,Y_velocity\n"


def test_axes_on_their_own_may_take_far_less_than_today():
    described = Machine.loads(
        "interval: 0.001\npositioning: independent\naxes:\n  X: {resolution: 1.0e-4, rapid: "
        "{velocity: 150, acceleration: 1400, jerk: 1.0e+4}, limit: {velocity: 150, acceleration: "
        "1400, jerk: 8.0e+5}, modes: [{frequency: 120, damping: 0.02, participation: 0.1}]}\n"
        "program: {start: {X: 0}}\nspindle: mill\n"
    )
    program = b"G21 G90 G94 G64\nG0 X0.5\nG4 P0.1\nG0 X3\nG4 P0.1\nG0 X5\nM2\n"
    assert process(program, described, controller="csv", profile="shortest").planned == 3
