"""LinuxCNC plays the streams of `linuxcnc-hal`, installed by `gcodejerk install linuxcnc`.

What the drives get is recorded in every servo period: it has to be the plan, and whatever happens
on the way (abort, hold, machine off, a missing or a wrong file, a feeder that dies), the machine
stops, and no step from one period to the next is larger than the limits allow.
"""

import os
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gcodejerk.hosts.linuxcnc.install import install
from gcodejerk.machine import Machine
from gcodejerk.motion import sample_profiles
from gcodejerk.rewrite.pipeline import process

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "linuxcnc"))
from playing import run_or_skip  # noqa: E402

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.playback,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC (linuxcnc-uspace) is absent"
    ),
]

DT = 0.001
VELOCITY, ACCELERATION = 500.0, 5250.0
"""LinuxCNC's limits of each axis; the machine file has 5000 mm/s^2."""
ADAPTIVE, POSITION = "adaptive-feed", "position"
AXIS = """  {axis}:
    resolution: 1.0e-4
    rapid: {{velocity: 500, acceleration: 5250}}
    limit: {{velocity: 500, acceleration: 5000, jerk: 5.0e+6}}
    modes:
{modes}"""
MODE = "      - {{name: m{0}, frequency: {0}, damping: 0.02, participation: 1.0}}\n"
MACHINE_TEXT = (
    "schema: 1\nname: played mill\ncontroller: linuxcnc-hal\nunits: mm\ninterval: 0.001\n"
    "positioning: linear\naxes:\n"
    + "".join(
        AXIS.format(axis=axis, modes="".join(MODE.format(f) for f in frequencies))
        for axis, frequencies in (("X", (30,)), ("Y", (50,)), ("Z", (30, 90)))
    )
)
MACHINE = Machine.loads(MACHINE_TEXT, "played.yaml")
MIXED = b"""G21 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G4 P0.1
G1 X2 F600
G0 Z1
G1 X4 F600
G0 X30 Y20
G0 X12 Y30 Z-9
G1 X13 F600
G91
G0 X-10 Z5
G0 Y-15
G90
G20
G1 X0.15 F20
G0 X0.5 Y0.2 Z0.3
G21
G1 X14 F600
M3 S100
G0 X100 Z0
G4 P0.05
G0 Z12.5
G4 P0.1
M2
"""
LONG = b"""G21 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G1 X1 F600
G0 X300 Y100 Z-20
G1 X299 F600
G0 X10 Y0 Z0
M2
"""
BETWEEN = {"axis": "X", "beyond": 100.0}
"""An event when LinuxCNC itself is at X100 of the first rapid of LONG."""


def play(
    data,
    form,
    *,
    events=None,
    change=None,
    timeout=30,
    acceleration=ACCELERATION,
    inch=False,
    machine=None,
):
    """Process a program, install the form, and play it; where the INI is in inches, too."""
    unit = 25.4 if inch else 1.0
    machine = machine or MACHINE
    result = process(data, machine, form=form)
    output, samples = result.output, result.beside

    def prepare(home):
        install(str(home / "sim.ini"), form)
        (home / "program.ngc.streams").write_bytes(samples)
        if change is not None:
            change(home)

    handle, path = tempfile.mkstemp(suffix=".ngc")
    with open(handle, "wb") as file:
        file.write(output)
    try:
        run = run_or_skip(
            path,
            acceleration=acceleration / unit,
            velocity=machine.axis("X").limit.velocity / unit,
            settings={
                "TRAJ": {
                    "MAX_LINEAR_VELOCITY": 1000 / unit,
                    "LINEAR_UNITS": "inch" if inch else "mm",
                }
            },
            timeout=timeout,
            events=events,
            prepare=prepare,
        )
    finally:
        os.unlink(path)
    rows = [(t, x * unit, y * unit, z * unit, *more) for t, x, y, z, *more in run.rows]
    return result, replace(run, rows=rows, position=tuple(unit * x for x in run.position))


def positions(run):
    return np.array([row[1:4] for row in run.rows])


def judge(result, run):
    """For each rapid: how far it is off its plan [mm], how long it took besides, its residuals."""
    plans, q, at, out = result.plans, positions(run), 0, []
    for row in np.flatnonzero(plans.planned).tolist():
        way = plans.displacement[row, :3]
        start, length = result.program.rapids.start[row, :3], np.linalg.norm(way)
        arrived = np.flatnonzero(np.linalg.norm(q[at:] - start - way, axis=1) < 1e-5)
        assert len(arrived), f"rapid {row} never arrives"
        end = at + arrived[0]
        begin = np.flatnonzero(np.linalg.norm(q[at:end] - start, axis=1) < 1e-5)[-1] + at
        progress = (q[begin : end + 1] - start) @ way / length
        aside = np.linalg.norm(
            q[begin : end + 1] - start - np.outer(progress / length, way), axis=1
        ).max()
        count = int(plans.counts[row])
        of_move = plans.profiles_of(row)
        profile = plans.profiles.take(slice(of_move.start, of_move.start + 1))
        plan = sample_profiles(profile, np.arange(count + 1)[np.newaxis], DT)[0][0] * length
        off = np.inf
        for shift in range(-4, 6):
            k = np.arange(len(progress)) - shift
            inside = (k >= 0) & (k <= count)
            wanted = np.interp(k, np.arange(count + 1), plan)
            off = min(off, np.abs(progress - wanted)[inside].max())
        kicks = np.diff(np.diff(np.clip(progress, 0.0, length), prepend=0.0, append=length)) / DT
        left = np.arange(len(kicks))[::-1] * DT
        poles = plans.modes.poles
        response = np.abs((kicks[:, np.newaxis] * np.exp(poles * left[:, np.newaxis])).sum(axis=0))
        felt = np.abs(plans.modes.participation[:, :3] @ way) / length
        out.append((off, aside, end - begin - count, response / poles.imag * felt))
        at = end
    return out


def steps(run):
    """The largest velocity and acceleration of any axis that the drives get."""
    velocity = np.diff(positions(run), axis=0) / DT
    return np.abs(velocity).max(), np.abs(np.diff(velocity, axis=0) / DT).max()


def assert_within_limits(run, *, braked=True):
    velocity, acceleration = steps(run)
    assert velocity <= VELOCITY * 1.001
    # LinuxCNC itself freezes the command when the machine is switched off: no jump, but no ramp.
    assert not braked or acceleration <= ACCELERATION * 1.01


@pytest.mark.parametrize("inch", [False, True])
@pytest.mark.parametrize(("form", "most"), [(ADAPTIVE, 2e-3), (POSITION, 1e-9)])
def test_what_is_played_is_the_plan(form, most, inch):
    result, run = play(MIXED, form, inch=inch)
    assert result.planned >= 8
    plans = result.plans
    tolerance = np.maximum(0.10 * result.residual, 0.03 * result.conventional_residual)
    rows = np.flatnonzero(plans.planned)
    for row, (off, aside, late, residual) in zip(rows, judge(result, run), strict=True):
        assert off <= most, (row, off)
        assert aside <= 1e-6
        assert abs(late) <= 5, (row, late)
        # The last sample that counts may be some periods behind the arrival.
        error = np.abs(residual - result.residual[row])
        assert (error <= tolerance[row] + 1e-9).all(), (row, residual, result.residual[row])
    assert_within_limits(run)
    assert run.position == pytest.approx((100.0, result.program.rapids.target[-1, 1], 12.5))


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_a_program_of_one_rapid_is_played(form):
    """Behind its lines stands one more, as many as it needs: what is next never came."""
    one = b"G21 G90 G17 G40 G94 G64\nG0 X0 Y0 Z0\nG1 X1 F600\nG0 X41\nG1 X40\nM2\n"
    result, run = play(one, form, events=[{"do": "wait", "idle": True}], timeout=10)
    assert result.planned == 1
    assert run.messages == []
    assert positions(run)[:, 0].max() == pytest.approx(41.0, abs=1e-5)


@pytest.mark.parametrize(("form", "way"), [(ADAPTIVE, 60.0), (POSITION, 110.0)])
def test_abort_in_a_stream_stops_on_the_line_within_the_limits(form, way):
    _, run = play(LONG, form, events=[{"do": "abort", **BETWEEN}])
    assert_within_limits(run)
    end = positions(run)[-1]
    assert 100.0 < end[0] < 100.0 + way
    assert end[1:] - np.array([100.0, -20.0]) * (end[0] - 1.0) / 299.0 == pytest.approx(0, abs=1e-5)
    assert run.position == pytest.approx(tuple(end), abs=1e-6)
    # With samples of its own the machine is switched off, so that LinuxCNC takes its place.
    assert run.enabled == (form == ADAPTIVE)


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_mdi_at_once_behind_an_abort_moves_nothing_by_a_jump(form):
    """The feeder sees no rest between both: what it loaded in a stream took the drives back."""
    events = [
        {"do": "abort", **BETWEEN},
        {"do": "mdi", "text": "G1 X200 F6000", "after": 0.0},
        {"do": "wait", "after": 1.0},
        {"do": "wait", "idle": True},
    ]
    _, run = play(LONG, form, events=events)
    assert_within_limits(run)
    assert run.position == pytest.approx(tuple(positions(run)[-1]), abs=1e-6)


def test_a_run_at_once_behind_an_abort_leaves_the_next_one_whole():
    """The new run ends the feeder that is braking the rapid, whatever it was about to do."""
    events = [
        {"do": "abort", **BETWEEN},
        {"do": "run", "after": 0.0},
        {"do": "wait", "after": 2.0},
        {"do": "on", "after": 0.0},
        {"do": "run", "after": 0.3},
        {"do": "wait", "after": 1.0},
        {"do": "wait", "idle": True},
    ]
    _, run = play(LONG, POSITION, events=events)
    assert_within_limits(run)
    assert run.position == pytest.approx((10.0, 0.0, 0.0))


def test_an_abort_early_in_a_long_rapid_stops_the_drives_once():
    """Five seconds later the feeder loads what comes next: the drives are where they stopped."""
    slow = Machine.loads(MACHINE_TEXT.replace("velocity: 500", "velocity: 100"), "slow.yaml")
    far = b"G21 G90 G17 G40 G94 G64\nG0 X0 Y0 Z0\nG1 X1 F600\nG0 X901\nG1 X900\nM2\n"
    events = [{"do": "abort", **BETWEEN}, {"do": "wait", "after": 11.0}]
    _, run = play(far, POSITION, events=events, machine=slow)
    assert_within_limits(run)
    assert 100.0 < positions(run)[-1][0] < 120.0
    assert run.position == pytest.approx(tuple(positions(run)[-1]), abs=1e-6)


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_behind_an_abort_the_program_runs_from_its_start(form):
    events = [
        {"do": "abort", **BETWEEN},
        {"do": "on", "after": 0.5},
        {"do": "run", "after": 0.2},
        {"do": "wait", "after": 0.5},
        {"do": "wait", "idle": True},
    ]
    _, run = play(LONG, form, events=events)
    assert_within_limits(run)
    assert run.position == pytest.approx((10.0, 0.0, 0.0))
    assert positions(run)[:, 0].max() == pytest.approx(300.0)


@pytest.mark.parametrize(
    ("form", "off"), [(ADAPTIVE, "off"), (POSITION, "off"), (POSITION, "estop")]
)
def test_a_machine_that_is_switched_off_in_a_stream_stays_where_it_stops(form, off):
    events = [{"do": off, **BETWEEN}, {"do": "reset", "after": 0.4}, {"do": "on", "after": 0.2}]
    events += [{"do": "wait", "after": 0.3}]
    _, run = play(LONG, form, events=events if off == "estop" else [events[0], *events[2:]])
    assert_within_limits(run, braked=form == POSITION)
    end = positions(run)[-1]
    assert 100.0 < end[0] < 220.0
    assert run.position == pytest.approx(tuple(end), abs=1e-6)
    assert run.enabled


def test_a_machine_that_is_switched_off_as_a_rapid_slows_down_jumps_nowhere():
    """Braked as the plan brakes, the drives rest as the rapid ends; they jumped back to its start.

    One period decided, so it is switched off again and again.
    """
    back = b"G21 G90 G17 G40 G94 G64\nG0 X0 Y0 Z0\nG1 X62 F30000\nG0 X10\nG1 X11\nM2\n"
    events = []
    for after in (0.095, 0.1, 0.105):
        events += [
            {"do": "wait", "axis": "X", "beyond": 61.9},
            {"do": "off", "after": after},
            {"do": "on", "after": 0.3},
            {"do": "run", "after": 0.1},
        ]
    _, run = play(back, POSITION, events=[*events[:-1], {"do": "wait", "after": 0.3}])
    assert_within_limits(run)
    offs = [told["position"][0] for told in run.told if told["do"] == "off"]
    assert len(offs) == 3
    assert all(10.1 < x < 60.0 for x in offs), offs
    assert run.position == pytest.approx(tuple(positions(run)[-1]), abs=1e-6)


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_feed_hold_and_override_keep_the_limits_and_the_ends(form):
    events = [
        {"do": "pause", **BETWEEN},
        {"do": "feed", "to": 0.5, "after": 0.5},
        {"do": "resume", "after": 0.1},
        {"do": "wait", "idle": True},
    ]
    _, run = play(LONG, form, events=events)
    assert_within_limits(run)
    assert run.position == pytest.approx((10.0, 0.0, 0.0))
    held = run.told[1]["position"]
    assert 100.0 < held[0] < 300.0


def test_above_100_percent_feed_override_nothing_crawls_behind_a_stream():
    """A rapid that ends before its stream waits for it: the next one stood still for ever."""
    chained = LONG.replace(b"G1 X299 F600\n", b"")
    assert process(chained, MACHINE, form=ADAPTIVE).planned == 2
    events = [{"do": "feed", "to": 1.2, "after": 0.0}, {"do": "wait", "idle": True}]
    _, run = play(chained, ADAPTIVE, events=events, acceleration=20000.0, timeout=20)
    assert run.messages == []
    assert run.position == pytest.approx((10.0, 0.0, 0.0))


def test_a_hold_in_front_of_a_stream_and_no_rapid_override_keep_it_waiting():
    """The drives stay where they are as long as LinuxCNC's own G0 may not begin."""
    events = [
        {"do": "rapid", "to": 0.0, "after": 0.0},
        {"do": "wait", "after": 2.5},  # of which the way to the stream takes a part
        {"do": "pause", "after": 0.0},
        {"do": "rapid", "to": 1.0, "after": 0.1},
        {"do": "wait", "after": 0.4},
        {"do": "resume", "after": 0.0},
        {"do": "wait", "idle": True},
    ]
    _, run = play(LONG, POSITION, events=events)
    assert_within_limits(run)
    q = positions(run)[:, 0]
    stood = np.flatnonzero(np.abs(q - 1.0) < 1e-6)
    assert stood[-1] - stood[0] > 1500
    assert run.position == pytest.approx((10.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("form", "damage", "says"),
    [
        (ADAPTIVE, None, "cannot read"),
        (POSITION, None, "cannot read"),
        (ADAPTIVE, b"\n0.0", "is not the file that was written"),
    ],
)
def test_without_its_file_of_samples_nothing_moves(form, damage, says):
    def change(home):
        path = home / "program.ngc.streams"
        data = path.read_bytes()
        path.unlink()
        if damage is not None:
            path.write_bytes(data.replace(b"\n0.", damage, 1))

    events = [{"do": "wait", "after": 0.4}, {"do": "wait", "idle": True}]
    _, run = play(LONG, form, events=events, change=change)
    assert np.abs(positions(run)).max() == 0.0
    assert any(says in message for message in run.messages), run.messages


def operator(text):
    """Sets something by hand before the program runs from its start."""
    return [
        {"do": "abort", "after": 0.0},
        {"do": "mdi", "text": text, "after": 0.3},
        {"do": "run", "after": 0.5},
        {"do": "wait", "after": 1.5},
        {"do": "abort", "after": 0.0},
        {"do": "wait", "after": 0.3},
    ]


def test_in_a_turned_coordinate_system_nothing_moves():
    """The samples are ways of X, Y and Z: the drives went along the unturned line."""
    _, run = play(LONG, POSITION, events=operator("G10 L2 P1 R45"))
    assert np.abs(positions(run)).max() == 0.0
    assert any("turned by 45 degrees" in message for message in run.messages), run.messages


def test_a_coordinate_system_that_turns_out_to_be_turned_stops_in_front_of_the_rapid():
    selects = LONG.replace(b"G0 X0", b"G55\nG0 X0")
    _, run = play(selects, POSITION, events=operator("G54 G10 L2 P2 R90"))
    assert_within_limits(run)
    assert any("is turned" in message for message in run.messages), run.messages
    assert run.told[3]["position"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    assert np.abs(positions(run)).max() <= 1.0 + 1e-6


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_a_feeder_that_dies_stops_the_machine_in_front_of_the_next_rapid(form):
    def shallow(home):
        path = home / "gcodejerk.hal"
        path.write_text(path.read_text().replace("depth=60000", "depth=800"))

    events = [
        {"do": "kill", **BETWEEN},
        {"do": "wait", "after": 1.5},
        {"do": "abort", "after": 0.0},
        {"do": "mdi", "text": "M152", "after": 0.1},
        {"do": "mdi", "text": "G0 X280", "after": 0.8},
        {"do": "wait", "after": 0.5},
    ]
    _, run = play(LONG, form, events=events, change=shallow)
    assert_within_limits(run)
    assert run.told[1]["position"] == pytest.approx([299.0, 100.0, -20.0], abs=1e-4)
    assert run.position == pytest.approx((280.0, 100.0, -20.0), abs=1e-4)


def stopped_in_front(form, events, program=LONG):
    """A run that stops in front of a rapid with its message; behind an abort MDI moves all else."""
    leaves = [
        {"do": "abort", "after": 0.0},
        {"do": "mdi", "text": "G0 X-5", "after": 0.3},
        {"do": "wait", "after": 0.4},
    ]
    _, run = play(program, form, events=[*events, *leaves])
    assert_within_limits(run)
    assert any("does not come next" in message for message in run.messages), run.messages
    assert run.position[0] == pytest.approx(-5.0)
    return run


@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_behind_run_from_line_the_machine_stands_at_the_first_stream(form):
    lines = process(LONG, MACHINE, form=form).output.splitlines()
    line = lines.index(b"G1 X299 F600") + 2
    events = [
        {"do": "abort", "after": 0.0},
        {"do": "run", "line": line, "after": 0.4},
        {"do": "wait", "after": 1.5},
    ]
    run = stopped_in_front(form, events)
    assert run.told[2]["position"] == pytest.approx(run.told[3]["position"], abs=1e-9)


FAR_DOWN = b"(%b)\n" % (b"-" * 240) * 300 + b"O1\n"
"""A head behind which the words that ask for rapids stand more than 64 kB from the beginning."""


@pytest.mark.parametrize(
    ("form", "head"),
    [
        pytest.param(ADAPTIVE, b"", marks=pytest.mark.repeats),
        (POSITION, b""),
        pytest.param(POSITION, FAR_DOWN, marks=pytest.mark.repeats),
    ],
)
def test_run_from_line_at_the_rapid_of_the_abort_stands_there_too(form, head):
    """It was asked for last: it counted as done, and LinuxCNC's own trapezoid ran to its end.

    M152's feeder sees the run some 30 ms after its start, and stops it then.
    """
    program = head + LONG
    lines = process(program, MACHINE, form=form).output.splitlines()
    line = lines.index(b"(gcodejerk: G0 X300 Y100 Z-20)") + 1
    events = [
        {"do": "abort", **BETWEEN},
        {"do": "on", "after": 0.4},
        {"do": "mdi", "text": "G0 X1 Y0 Z0", "after": 0.2},
        {"do": "run", "line": line, "after": 1.0},
        {"do": "wait", "after": 1.2},
    ]
    run = stopped_in_front(form, events, program)
    assert run.told[5]["position"] == pytest.approx([1.0, 0.0, 0.0], abs=20.0)


def test_samples_are_not_played_from_elsewhere_than_where_they_begin():
    """The machine file says where programs start; behind a jog the drives went beside the line."""
    starts = "program: {start: {X: 0, Y: 0, Z: 0}, offsets: {G54: {X: 0, Y: 0, Z: 0}}}\n"
    machine = Machine.loads(MACHINE_TEXT + starts, "starts.yaml")
    program = b"G21 G90 G17 G40 G94 G64 G54 G49\nG0 X100 Y50\nG1 X101 F600\nM2\n"
    _, run = play(program, POSITION, events=operator("G0 X-30"), machine=machine)
    assert_within_limits(run)
    assert any("not where the next rapid begins" in message for message in run.messages)
    assert run.position == pytest.approx((-30.0, 0.0, 0.0))
    assert positions(run)[:, 1].max() == 0.0


def test_a_program_that_begins_again_for_ever_relies_on_no_start():
    """M99 in LinuxCNC's main program; the second pass went back to where the first had begun."""
    starts = "program: {start: {X: 0, Y: 0, Z: 0}, offsets: {G54: {X: 0, Y: 0, Z: 0}}}\n"
    machine = Machine.loads(MACHINE_TEXT + starts, "starts.yaml")
    program = b"G21 G90 G17 G40 G94 G64 G54 G49\nG0 X50\nG1 X51 F6000\nG0 X30\nG1 X31\nM99\n"
    events = [{"do": "abort", "after": 2.5}, {"do": "wait", "after": 0.3}]
    result, run = play(program, ADAPTIVE, events=events, machine=machine)
    assert result.planned == 1
    q = positions(run)[:, 0]
    first = int(np.argmax(q > 50.9))
    assert ((q[first:-1] < 45.0) & (q[first + 1 :] >= 45.0)).sum() >= 2
    assert q[first:].min() > 29.9


@pytest.mark.parametrize(("form", "fastest"), [(ADAPTIVE, 60.0), (POSITION, 500.0)])
def test_the_slider_of_the_maximum_velocity_acts_as_the_page_says(form, fastest):
    events = [{"do": "maxvel", "to": 60.0, "after": 0.0}, {"do": "wait", "idle": True}]
    program = b"G21 G90 G17 G40 G94 G64\nG0 X0 Y0 Z0\nG1 X1 F6000\nG0 X81\nG1 X80\nM2\n"
    _, run = play(program, form, events=events)
    assert_within_limits(run)
    highest = steps(run)[0]
    assert 0.8 * fastest < highest <= 1.001 * fastest
    assert run.position == pytest.approx((80.0, 0.0, 0.0))


STOPS = b"""G21 G90 G17 G40 G94 G64
G0 X0 Y0 Z0
G1 X1 F600
G0 X30 Y10
M0
G0 X0 Y5
M1
G0 X20
M60
G0 X0 Y0 Z-3
G1 X1 F600
M30
"""


@pytest.mark.repeats
@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_streams_behind_stops_are_played_as_planned(form):
    events = [{"do": "optional_stop", "to": 1, "after": 0.0}]
    events += [{"do": "resume", "after": 0.8}] * 3
    result, run = play(STOPS, form, events=[*events, {"do": "wait", "idle": True}])
    assert result.planned == 4
    assert_within_limits(run)
    assert all(off <= 2e-3 for off, *_ in judge(result, run))


@pytest.mark.repeats
@pytest.mark.parametrize("form", [ADAPTIVE, POSITION])
def test_single_step_goes_through_a_stream_as_the_page_says(form):
    """In the form adaptive-feed it may be slower; in both it ends where it has to."""
    events = [{"do": "pause", "after": 0.0}]
    events += [{"do": "step", "after": 0.3} for _ in range(6)]
    events += [{"do": "resume", "after": 0.2}, {"do": "wait", "idle": True}]
    program = b"G21 G90 G17 G40 G94 G64\nG0 X0 Y0 Z0\nG1 X1 F6000\nG0 X31 Y10\nG1 X30\nM2\n"
    result, run = play(program, form, events=events)
    assert_within_limits(run)
    assert run.position == pytest.approx((30.0, 10.0, 0.0))
    if form == POSITION:
        assert all(off <= 1e-9 for off, *_ in judge(result, run))
