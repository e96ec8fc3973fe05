"""F of the blocks: the mean speed for controls that hold it, speeds at the ends for LinuxCNC."""

import io
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from gcodejerk import Machine, process
from gcodejerk.axes import AXES
from gcodejerk.emit import load_controller
from gcodejerk.emit.feeds import mean_feeds
from gcodejerk.planning.batch import NumberFormat
from gcodejerk.planning.plan import plan_moves
from gcodejerk.planning.stream import make_streams
from gcodejerk.verification import Kind, verify, verify_files

TEXT = """
interval: 0.002
positioning: linear
axes:
  X:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 22, damping: 0.02}]
  Z:
    resolution: 0.001
    rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 30, damping: 0.02}]
  A:
    wrap: none
    resolution: 0.01
    rapid: {velocity: 90, acceleration: 2000, jerk: 5.0e+4}
    modes: [{frequency: 30, damping: 0.02, participation: 1.0}]
program: {start: {X: 0, Z: 0, A: 0}}
"""
MACHINE = Machine.loads(TEXT)
HEAD = b"G21 G90 G94 G64 F250\n"
ROWS = [
    ({"X": 12.5}, "X"),
    ({"X": 12.5, "Z": -5.0}, "XZ"),
    ({"A": 40.0}, "A"),
    ({"X": 9.0, "A": 40.0}, "X"),
]
HEADS = {
    "siemens": b"G710 G90 G94 G64 F250\n",
    "grbl": b"G21 G90 G94 F250\n",
    **dict.fromkeys(("marlin", "klipper"), b"G21\nG90\nG0 F250\n"),
}
CONTROLS = ("fanuc", "haas", "siemens", "grbl", "mach", "marlin", "klipper")


def streams_of(text):
    """Points of the streams of an output: rows of F and words by letter."""
    found = []
    for line in text.decode().splitlines():
        if "gcodejerk: " in line:
            found.append([])
        elif found and re.match(r"G1 .*F[0-9.]+$", line) and found[-1] is not None:
            words = dict(re.findall(r"([A-Z])(-?[0-9.]+)", line))
            words.pop("G")
            found[-1].append({letter: float(number) for letter, number in words.items()})
    return found


def batch_of(displacement, machine=MACHINE, stride=1, step=0.001, start=0.0):
    """The stream of one move."""
    row = np.zeros((1, len(AXES)))
    for axis, size in displacement.items():
        row[0, AXES.index(axis)] = size
    shape = row.shape
    spelled = NumberFormat(*(np.full(shape, float(x)) for x in (start, step, 0.0)))
    ((batch,),) = make_streams(plan_moves(row, machine), spelled, stride)
    return batch


@pytest.mark.parametrize(("row", "axes"), ROWS)
def test_for_others_f_is_the_length_of_the_block_over_its_time(row, axes):
    block = " ".join(f"{axis}{value}" for axis, value in row.items()).encode()
    made = process(HEAD + b"G0 " + block + b"\nM2\n", MACHINE, controller="mach")
    (points,) = streams_of(made.output)
    at, feeds, way = dict.fromkeys(row, 0.0), [], []
    for point in points:
        feeds.append(point["F"])
        linear = sum((point[a] - at[a]) ** 2 for a in axes) ** 0.5
        # Before the linear axes have moved a step, F is that of the rotary one alone.
        way.append(linear or abs(point.get("A", 0.0) - at.get("A", 0.0)))
        at = point
    feeds, way = np.array(feeds), np.array(way)
    moves = np.flatnonzero(way > 1e-9)
    # Blocks without length take no time; within the motion the next one takes it.
    times = 0.002 * np.diff(np.concatenate([[moves[0] - 1], moves]))
    assert 60.0 * way[moves] / feeds[moves] == pytest.approx(times, rel=1e-4)
    fast = way > 0.1
    assert feeds[fast] == pytest.approx(60.0 * way[fast] / 0.002, abs=0.6e-4)


@pytest.mark.parametrize("name", CONTROLS)
def test_of_a_stream_is_said_what_was_not_measured_of_streams_alone(name):
    made = process(
        HEADS.get(name, HEAD) + b"G0 X12.\nM2\n",
        replace(MACHINE, spindle="mill"),
        controller=name,
        dialect=name,
    )
    assert made.planned == 1
    said = [note for note in made.notes if "were not measured on" in note]
    facts = {form.name: form for form in load_controller(name).forms}
    unverified = facts["stream"].confidence == "unverified"
    assert [facts["stream"].note in note for note in said if "in this form" in note] == (
        [True] * unverified
    )


def test_a_block_without_length_says_the_f_of_the_next():
    batch = batch_of({"X": 12.5}, step=0.01)
    made = mean_feeds(batch, SimpleNamespace(inch=np.array([False])))
    q, feeds = batch.written[AXES.index("X")][0], made.whole[0] / 10.0 ** made.decimals[0]
    moving = np.flatnonzero(np.diff(q) > 0.0) + 1
    first, last = moving[[0, -1]]
    assert first > 1
    assert last < len(q) - 1
    assert np.flatnonzero(batch.times[0]).tolist() == moving.tolist()
    assert (feeds[1:first] == feeds[first]).all()
    assert (feeds[last:] == feeds[last]).all()
    lasts = 60.0 * np.diff(q)[moving - 1] / feeds[moving]
    assert lasts == pytest.approx(0.002 * batch.times[0, moving], rel=1e-6)
    # Together: from the beginning of the first that moves to the end of the last.
    assert lasts.sum() == pytest.approx(0.002 * (last - first + 1), rel=1e-6)


@pytest.mark.parametrize("unit", ["G21", "G20"])
@pytest.mark.parametrize("resolution", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("interval", [0.0005, 0.001, 0.004])
def test_the_digits_of_f_never_let_the_time_drift(interval, resolution, unit):
    machine = Machine.loads(TEXT.replace("interval: 0.002", f"interval: {interval}"))
    axes = tuple(replace(axis, resolution=resolution) for axis in machine.axes)
    machine = replace(machine, axes=axes)
    scale = 25.4 if unit == "G20" else 1.0
    ends = (37.123456, -80.0, 8.7, 97.0)
    lines = [f"G0 X{x / scale:.4f}" for x in ends]
    program = "\n".join([f"{unit} G90 G94 F9", *lines, "M2"]).encode() + b"\n"
    made = process(program, machine, controller="grbl")
    streams = streams_of(made.output)
    assert len(streams) == 4
    block = max(1, round(0.002 / interval)) * interval
    start = 0.0
    for k, points in enumerate(streams):
        x = np.array([start, *(point["X"] for point in points)])
        way, feeds = np.abs(np.diff(x)), np.array([point["F"] for point in points])
        start, lasts = x[-1], 60.0 * way / feeds
        assert lasts[way == 0.0] == pytest.approx(0.0)
        # Blocks without length at both ends are all that may be missing.
        moves = np.flatnonzero(way)
        inner = slice(moves[0], moves[-1] + 1)
        planned = made.plans.counts[k] * interval
        planned -= block * (moves[0] + len(way) - 1 - moves[-1])
        whole = lasts[inner].sum()
        step = max(resolution / scale, way[moves].min())
        assert whole == pytest.approx(planned, abs=2e-4 * planned)
        # Half a digit of F is 0.5e-4/60 per second: less than so much in each block.
        most = np.minimum(0.5e-4 / 60.0 * block / np.maximum(way[moves], step) * 2.0, 1e-3) * block
        assert whole == pytest.approx(planned, abs=most.sum() + 1e-12)
        assert whole == pytest.approx(planned, abs=0.01 * interval)


@pytest.mark.parametrize("controller", CONTROLS)
def test_every_control_but_linuxcnc_holds_f(controller):
    machine = replace(
        MACHINE,
        dialect=controller,
        spindle="mill",
        program=replace(
            MACHINE.program,
            decimal_point="calculator",
            startup="G71" if controller == "siemens" else "",
        ),
    )
    head = {"siemens": b"G71 G90 G94 G64 F60\n", "marlin": b"G21\nG90\nG0 F90000\n"}
    head["klipper"] = head["marlin"]
    program = head.get(controller, b"G21 G90 G94 F60\n") + b"G0 X12.5 Z-5.\nM30\n"
    made = process(program, machine, controller=controller)
    (points,) = streams_of(made.output)
    at, way, feeds = {"X": 0.0, "Z": 0.0}, [], []
    for point in points:
        way.append(np.hypot(point["X"] - at["X"], point["Z"] - at["Z"]))
        feeds.append(point["F"])
        at = point
    way, feeds = np.array(way), np.array(feeds)
    fast = way > 0.01
    assert np.count_nonzero(fast) > 50
    assert 60.0 * way[fast] / feeds[fast] == pytest.approx(0.002, rel=1e-6)
    assert verify(program, made.output, machine).ok


def test_a_machine_that_runs_another_control_s_streams_would_run_them_otherwise():
    program = HEAD + b"G0 X12.5\nM2\n"
    held = process(program, MACHINE, controller="mach").output
    ended = process(program, MACHINE, controller="linuxcnc").output
    # The stamp says what they are for; for another machine file, that or the user does.
    assert verify(program, held, MACHINE).ok
    assert verify(program, ended, MACHINE).ok
    for text, own, other in ((held, "grbl", "linuxcnc"), (ended, "linuxcnc", "mach")):
        changed = replace(MACHINE, name="another", interval=0.002, controller=other)
        changed = replace(changed, design=replace(changed.design, tolerance=0.002))
        found = verify(program, text, changed)
        assert {v.kind for v in found.violations} <= {Kind.FEED, Kind.FORM}
        assert not found.ok
        assert verify(program, text, changed, controller=own).ok
        assert verify(program, text, replace(changed, controller=own)).ok


@pytest.mark.parametrize("controller", ["mach", "csv"])
def test_a_block_with_a_whole_step_more_than_the_limit_allows_is_refused(controller):
    # 600.6 steps in a block: 601 are rounding, 602 are not.
    machine = Machine.loads(TEXT.replace("velocity: 300", "velocity: 300.3"))
    program = HEAD + b"G0 X300\nM2\n"
    text = process(program, machine, controller=controller).output
    number = rb"(?m)^G1 X([0-9.]+) F.*$" if controller == "mach" else rb"(?m)^2,[0-9.]+,([0-9.]+),"
    found = [(float(m[1]), m.span(1)) for m in re.finditer(number, text)]
    steps = np.rint(np.diff([round(x * 1e3) for x, _ in found])).astype(int)
    assert set(steps[len(steps) // 2 - 20 : len(steps) // 2 + 20].tolist()) == {600, 601}
    assert steps.max() == 601
    k = len(steps) // 2 + int(np.argmax(steps[len(steps) // 2 :] == 601)) + 1
    x, (begin, end) = found[k]
    damaged = text[:begin] + b"%.3f" % (x + 1e-3) + text[end:]
    table = {"table": True} if controller == "csv" else {}
    own = replace(machine, controller=controller)
    good, bad = (
        verify_files(io.BytesIO(program), io.BytesIO(data), own, **table)
        for data in (text, damaged)
    )
    assert good.ok
    assert Kind.VELOCITY in {v.kind for v in bad.violations}


@pytest.mark.parametrize("name", CONTROLS)
@pytest.mark.parametrize(("unit", "length", "most"), [("G21", "200.", 18000), ("G20", "8.", 709)])
def test_where_g1_is_bounded_and_g0_is_not_the_fastest_block_is_told(name, unit, length, most):
    head = HEADS.get(name, HEAD).replace(b"G21", unit.encode())
    if unit == "G20":
        head = head.replace(b"G710", b"G700")
    made = process(
        head + f"G0 X{length}\nX0.\nM2\n".encode(),
        replace(MACHINE, spindle="mill"),
        controller=name,
        dialect=name,
    )
    said = [note for note in made.notes if "for G1" in note]
    if not made.planned or name not in ("fanuc", "haas"):
        assert not said
        return
    (note,) = said
    assert f"F{most} ({'in' if unit == 'G20' else 'mm'}/min)" in note
    assert "limit.velocity" in note


@pytest.mark.parametrize("positioning", ["linear", "independent"])
def test_a_lower_limit_keeps_streams_below_the_highest_cutting_feed(positioning):
    text = TEXT.replace("jerk: 5.0e+4}", "jerk: 5.0e+4}\n    limit: {velocity: 150}")
    machine = Machine.loads(text.replace("linear", positioning))
    slow = replace(machine, design=replace(machine.design, max_extension=2.0))
    data = HEAD + b"G0 X9. Z7.\nX12.\nX200. Z100.\nX20.\nM2\n"
    made = process(data, slow, controller="fanuc", dialect="fanuc")
    assert made.planned
    feeds = [float(f) for f in re.findall(rb"G1 .*F([0-9.]+)", made.output)]
    most = int(re.search(r"reach F(\d+)", " ".join(made.notes))[1])
    assert most <= 60 * 150 * 2**0.5 + 1
    assert max(feeds) <= most * 1.01


def test_rotary_streams_alone_are_in_degrees():
    # "F0 (mm/min)", where the blocks had F12000.
    axis = "rapid: {velocity: 200, acceleration: 2000, jerk: 5.0e+4}"
    machine = Machine.loads(
        "interval: 0.001\npositioning: linear\naxes:\n  X:\n    " + axis + "\n"
        "    modes: [{frequency: 30, damping: 0.02, participation: 1}]\n  A:\n    " + axis + "\n"
        "    wrap: none\n    modes: [{frequency: 25, damping: 0.02, participation: 0.5}]\n"
    )
    data = b"G21 G90 G94 G17 G40 G49 G80 G54 G64\nG0 A0.\nG0 A120.\nM30\n"
    made = process(data, machine, controller="fanuc", dialect="fanuc")
    assert made.planned == 1
    feeds = [float(f) for f in re.findall(rb"G1 .*F([0-9.]+)", made.output)]
    most = int(re.search(r"reach F(\d+) \(deg/min\)", " ".join(made.notes))[1])
    assert max(feeds) == pytest.approx(most, rel=0.01)


@pytest.mark.parametrize(("dialect", "mode"), [("fanuc", "G95"), ("fanuc-lathe-b", "G95")])
def test_no_dwell_counts_turns_of_a_spindle_that_may_stand(dialect, mode):
    head = f"G21 G18 G90 G40 {mode} G64 F0.2\nM5\nG1 X1. F0.2\n".encode()
    data = head + b"G0 X12.\nM30\n"
    made = process(data, MACHINE, controller="fanuc", dialect=dialect)
    assert made.planned == 1
    lines = made.output.splitlines()
    assert lines.index(b"G94") + 1 == lines.index(b"G4 P1")
    swapped = made.output.replace(b"G94\nG4 P1\n", b"G4 P1\nG94\n")
    assert not verify(data, swapped, MACHINE, controller="fanuc", dialect=dialect).ok


def test_a_creeping_axis_beside_a_coarser_one_keeps_its_time():
    machine = Machine.loads(
        "controller: grbl\ninterval: 0.001\npositioning: linear\naxes:\n"
        "  X: {resolution: 1.0e-5, rapid: {velocity: 212.3, acceleration: 608.3, jerk: 9.0e+4}, "
        "limit: {velocity: 254.8, acceleration: 1216.6, jerk: 4.4e+5}, "
        "modes: [{frequency: 7.182, damping: 0, participation: 0.3}]}\n"
        "  Y: {resolution: 1.0e-4, rapid: {velocity: 118.1, acceleration: 971.2, jerk: 7.7e+4}, "
        "limit: {velocity: 118.1, acceleration: 971.2, jerk: 2.9e+6}, "
        "modes: [{frequency: 174.6, damping: 0.15, participation: 0.1}]}\n"
        "design: {band: 0.05}\nspindle: mill\nprogram: {start: {X: 0, Y: 0}}\n"
    )
    program = b"G20 G90 G17 G94\nG0 X10.8268 Y1.7547\nG4 P0.1\nG0 X10.8165 Y1.7630\nM2\n"
    result = process(program, machine, profile="shortest")
    here, slowest = np.array([10.8268, 1.7547]), np.inf
    time = 0.0
    for row in streams_of(result.output)[1]:
        there = np.array([row.get("X", here[0]), row.get("Y", here[1])])
        time += np.hypot(*(there - here)) / (row["F"] / 60.0)
        here, slowest = there, min(slowest, row["F"])
    assert slowest < 0.005, "nothing creeps"
    assert time == pytest.approx(result.rapids[1].time, rel=1e-4)


def test_the_last_bit_of_a_sum_of_steps_is_no_way():
    """Beside a coarse V that ends off its step, X and Z have arrived but for rounding."""
    axis = (
        "{resolution: %s, rapid: {velocity: 300, acceleration: 2000, jerk: 5.0e+4},"
        " modes: [{frequency: 22, damping: 0.02}]}"
    )
    machine = Machine.loads(
        "interval: 0.002\npositioning: independent\nspindle: mill\naxes:\n"
        f"  X: {axis % '1.0e-4'}\n  Z: {axis % '1.0e-4'}\n  V: {axis % '0.01'}\n"
    )
    random = np.random.default_rng(8)
    ends = np.column_stack(
        [random.uniform(-50.0, 50.0, (30, 2)), random.uniform(90.0, 110.0, 30)]
    ).tolist()
    moves = [f"G0 X{x:.4f} Z{z:.3f} V{v * k % 200:.3f}" for k, (x, z, v) in enumerate(ends)]
    program = "\n".join(["G21 G90 G94 G17 G40 G64", "G1 X0. Z0. V0. F500.", *moves, "M30", ""])
    for name in ("haas", "grbl", "mach"):
        made = process(program.encode(), machine, controller=name, dialect="mach")
        assert made.planned > 20
        assert made.verification.ok
        feeds = [float(f) for f in re.findall(rb" F(\S+)", made.output)]
        assert min(feeds) > 0.0
        assert all(len(f) < 16 for f in re.findall(rb" F(\S+)", made.output))
