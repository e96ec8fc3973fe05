"""Which moves LinuxCNC's streams can be made of, and whether their blocks end in time."""

from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.machine import STREAM_HEADROOM, Machine
from gcodejerk.motion.servo.knots import HAIR
from gcodejerk.planning.aligned import _followed
from gcodejerk.planning.batch import NumberFormat, Sampler
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.straight import StraightMoves
from gcodejerk.planning.written import LONGEST_TAIL, Written

STEP = 1e-6
MACHINE = """
interval: 0.001
positioning: linear
axes:
  X: {rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}, modes: [{frequency: 41}]}
  Y: {rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}}
  A: {rapid: {velocity: 500, acceleration: 4000, jerk: 2.0e+5}}
"""


def straight(rows, machine=MACHINE, profile=None):
    """Moves of X, Y and A, those that are planned."""
    displacement = np.zeros((len(rows), len(AXES)))
    displacement[:, [AXES.index(name) for name in "XYA"]] = rows
    number_format = NumberFormat(*(np.full(displacement.shape, x) for x in (0.0, STEP, 0.0)))
    plans = plan_moves(displacement, Machine.loads(machine), profile)
    return StraightMoves.of(Sampler(plans, np.unique(plans.move), number_format))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("steps", "possible"), [(0, True), (1, False), (2, False), (3, True)])
def test_an_axis_moves_by_more_than_two_steps_or_not_at_all(steps, possible, sign):
    assert straight([[30.0, sign * steps * STEP, 0.0]]).possible.tolist() == [possible]


def test_rotary_axes_and_moves_of_few_intervals_are_impossible():
    assert straight([[30.0, 4.0, 0.0], [30.0, 4.0, 7.0]]).possible.tolist() == [True, False]
    # A jerk that is over at once: five intervals, of which two blocks want six.
    quick = MACHINE.replace("2.0e+5", "4.0e+9").replace("4000", "4.0e+6")
    found = {}
    for length in np.geomspace(0.01, 60.0, 40):
        moves = straight([[length, 0.0, 0.0]], quick, "conventional")
        counts = moves.sampler.plans.counts[moves.sampler.moves]
        found.update(zip(counts.tolist(), moves.possible.tolist(), strict=True))
    assert {5, 6} <= found.keys()
    assert all(possible == (count >= 6) for count, possible in found.items())


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.8, 0.6), (0.6, 0.8)])
@pytest.mark.parametrize(("off", "possible"), [(0.999, False), (1.001, True)])
def test_the_control_can_accelerate_a_twentieth_more_than_the_profile(direction, off, possible):
    way = 40.0 * np.array([*direction, 0.0])
    planned = straight([way])
    # What each axis does, from the profile's segments: jerks are linear in between.
    profile = planned.profiles
    ends = profile.acceleration + profile.jerk * profile.duration
    peak = np.abs(np.concatenate([profile.acceleration, ends])).max()
    needed = STREAM_HEADROOM * peak * way
    used = zip("XY", needed[:2], strict=True)
    told = ", ".join(f"{name}: {off * value:.9g}" for name, value in used if value)
    text = MACHINE + f"controller: linuxcnc\ncontroller_options: {{max_acceleration: {{{told}}}}}\n"
    assert straight([way], text).possible.tolist() == [possible]


@pytest.fixture(scope="module")
def written():
    """One stream as it would be written, all of whose blocks end in time."""
    moves = straight([[40.0, 30.0, 0.0]])
    knots, speeds, enough = _followed(moves, 2)
    assert moves.possible.all()
    assert enough.all()
    out = Written.of(moves, knots, speeds)
    assert out.punctual().all()
    return out


def later(written, block, by):
    """The same with a block that takes so much longer, at the speeds that it has. [s]"""
    speed = written.speed[0]
    way = written.way.copy()
    way[0, block:] += 0.5 * (speed[block - 1] + speed[block]) * by
    return replace(written, way=way)


def rising(written):
    """A block in the middle of the way up: its speeds are those of its ends."""
    speed, knots = written.speed[0, :-1], written.grid.knots[0, :-1]
    runs = np.flatnonzero(np.diff(knots) > 0) + 1
    block = int(runs[len(runs) // 4])
    assert speed[block - 1] < speed[block] < speed[block + 1]
    return block


def test_a_block_that_ends_behind_its_period_is_seen(written):
    block = rising(written)
    assert later(written, block, 0.2 * HAIR).punctual().all()
    for by in (HAIR, 1e-9, 2e-5, 4e-5):
        assert not later(written, block, by).punctual().any()


def test_a_block_that_ends_too_soon_is_seen(written):
    block = rising(written)
    assert later(written, block, -1e-6).punctual().all()
    assert not later(written, block, -3e-6).punctual().any()


def test_a_tail_without_length_or_a_long_one_is_seen(written):
    for tail, slow in ((0.0, False), (0.5, True), (1.01, False)):
        way = written.way.copy()
        way[0, -1] = way[0, -2] + tail * LONGEST_TAIL * written.speed[0, -1]
        assert replace(written, way=way).punctual().tolist() == [slow]
