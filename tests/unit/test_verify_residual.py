"""What the proof takes for vibration, and what its points cannot show."""

import pytest

from gcodejerk.machine import Machine
from gcodejerk.pipeline import process

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


@pytest.mark.parametrize("frequency", [373.3, 251.0, 240.0, 101.0])
def test_points_two_milliseconds_apart_say_nothing_of_a_mode_that_is_faster(frequency):
    machine = Machine.loads(MACHINE.format(frequency=frequency))
    made = process(b"F300\nG0 X29\nX0\nM2\n", machine, controller="linuxcnc")
    assert (made.planned, made.verification.ok) == (2, True)
