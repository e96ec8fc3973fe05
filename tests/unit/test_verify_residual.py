"""What the proof takes for vibration, and what its points cannot show."""

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine
from gcodejerk.rewrite.pipeline import process
from gcodejerk.verification import Kind, verify
from gcodejerk.verification.physics import residual
from gcodejerk.verification.physics.own_rapids import rapid_limits
from gcodejerk.verification.physics.points import Paths
from gcodejerk.verification.physics.residual import leaves_more

MACHINE = """
interval: 0.0005
positioning: linear
axes:
  X:
    resolution: 1.0e-5
    rapid: {{velocity: 171.5, acceleration: 1025.0, jerk: 5.1250e+05, planner: bell}}
    limit: {{acceleration: 1025.0}}
    modes: [{{frequency: {frequency}, damping: 0.0, participation: 0.05}}]
program: {{start: {{X: 0}}, startup: G21 G90}}
spindle: mill
"""


@pytest.mark.parametrize(("frequency", "planned"), [(373.3, 0), (254.0, 2), (240.0, 2), (101.0, 2)])
def test_a_mode_faster_than_the_points_is_left_with_less_or_its_rapids_alone(frequency, planned):
    machine = Machine.loads(MACHINE.format(frequency=frequency))
    made = process(b"F300\nG0 X29\nX0\nM2\n", machine, controller="linuxcnc")
    assert (made.planned, made.verification.ok) == (planned, True)


NEIGHBOURS = """
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 1.0e-5
    rapid: {{velocity: 400, acceleration: 4000, jerk: 8.0e+5}}
    limit: {{acceleration: 6000, jerk: 8.0e+6}}
    modes: [{modes}]
design: {{minimum_length: 0.0001}}
program: {{start: {{X: 0}}, startup: G21 G90}}
spindle: mill
"""
SLOW, FAST = "{frequency: 30, damping: 0.0}", "{frequency: 125, damping: 0.0}"
BEYOND = "{frequency: 420, damping: 0.0}"


@pytest.mark.parametrize("modes", [FAST, f"{FAST}, {BEYOND}"], ids=["one", "one beyond"])
@pytest.mark.parametrize("short", ["", "G0 X0.002\nG0 X0\n", "G0 X0.0004\nG0 X0\n"])
def test_each_stream_is_judged_by_its_own_points_whatever_stands_beside_it(short, modes):
    """Designed for 30 Hz, held against 125 Hz: a rapid of 3 ms in one block changes nothing."""
    program = f"G64\nF300\nG0 X0\n{short}G0 X10\nG0 X0\nM2\n".encode()
    made = process(program, Machine.loads(NEIGHBOURS.format(modes=SLOW)), controller="linuxcnc")
    found = verify(program, made.output, Machine.loads(NEIGHBOURS.format(modes=modes)))
    first = 4 + short.count("\n")
    lines = [v.original_line for v in found.violations if v.kind == Kind.RESIDUAL]
    assert [line for line in lines if line >= first] == [first, first + 1]


def shaken(behind, profile="shortest"):
    """A machine, a stream at full speed at once with points behind its arrival; their moments."""
    machine = Machine.loads(
        "interval: 0.002\npositioning: linear\ndesign: {tolerance: 0.0001, "
        f"profile: {profile}}}\n"
        "axes:\n  Z:\n    rapid: {velocity: 50, acceleration: 500, jerk: 1.0e+4}\n"
        "    modes: [{frequency: 31, damping: 0.01}]\n"
    )
    z = AXES.index("Z")
    moment = np.append(np.arange(41), np.full(behind, 40))
    position, none = np.zeros((len(moment), len(AXES))), np.zeros((1, len(AXES)))
    position[:, z] = np.minimum(moment / 40.0, 1.0)
    displacement = none.copy()
    displacement[0, z] = 1.0
    one = np.ones(1, dtype=np.int64)
    paths = Paths(
        rapid=0 * one, original_line=one, line=one + np.arange(len(moment)), begin=0 * one,
        end=one * len(moment), position=position, feed=np.full(len(moment), np.nan), start=none,
        displacement=displacement, unit=np.ones(1), speed=np.full(1, np.inf),
        step=np.full((1, len(AXES)), 1e-4), lone=one > 0, lead=0 * one,
    )  # fmt: skip
    return paths, machine, moment


@pytest.mark.parametrize("behind", [0, 1, 2, 3])
def test_points_behind_the_arrival_hide_no_vibration(behind):
    """Where blocks without a way end a stream, several points have the moment of its arrival."""
    paths, machine, moment = shaken(behind)
    found = leaves_more(paths, machine, moment, rapid_limits(paths, machine))
    assert found.stream.tolist() == [0]
    assert found.left > found.allowed


@pytest.mark.parametrize("profile", ["shortest", "condition3"])
def test_what_is_not_a_number_is_no_excuse(monkeypatch, profile):
    def unknown(displacement, machine, limits):
        return lambda modes: np.full((len(displacement), len(modes.poles)), np.nan + 0j)

    monkeypatch.setattr(residual, "left_by_rapids", unknown)
    paths, machine, moment = shaken(1, profile)
    found = leaves_more(paths, machine, moment, rapid_limits(paths, machine))
    assert found.stream.tolist() == [0]
