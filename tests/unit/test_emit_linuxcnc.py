"""Controller `linuxcnc`: what stands around the points, and what the points add up to."""

import re
from decimal import Decimal
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from gcodejerk import Machine, plan_move, process
from gcodejerk.emit import linuxcnc
from gcodejerk.errors import EmitError
from gcodejerk.machine import find_machine

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
    modes: [{frequency: 30, damping: 0.02, participation: 1}]
program: {start: {X: 0, Z: 0, A: 0}}
"""
MACHINE = Machine.loads(TEXT)
HEAD = b"G21 G90 G94 G64 F250\n"


def output(program, **arguments):
    """The output without its stamp and the operator's line below it."""
    text = process(program, MACHINE, **arguments).output
    line = rb"\([^)]*\)(?:\r\n|\n|\r)"
    stamp, end = re.search(rb"(?=\(gcodejerk stamp )" + line + line, text).span()
    return text[:stamp] + text[end:]


def stream_of(program, **arguments):
    """Lines that took the place of the one rapid of a program, line ends split off."""
    result = process(program, MACHINE, **arguments)
    assert result.planned == 1
    begin, end, _ = result.edits[-1]
    return result.output[begin:end].splitlines()


def split(lines):
    """Lines in front, what leads in, the points with the end, and the lines behind."""
    points = [k for k, line in enumerate(lines) if re.match(rb"G1 .*F[0-9.]+$", line)]
    # A slow block between two tiny G0 is none of the points.
    slow = points[1] > points[0] + 1
    first = points[1] if slow else points[0]
    assert points[slow:] == list(range(first, points[-1] + 1))
    lead = first - (3 if slow else 1)
    assert lines[lead].startswith(b"G0 ")
    assert lines[points[-1] + 1].startswith(b"G0 ")
    end = points[-1] + 2
    return lines[:lead], lines[lead:first], lines[first:end], lines[end:]


def parts(lines):
    """Lines before the points, the points, and the lines behind them."""
    before, _, points, after = split(lines)
    return before, points, after


def words(lines, letter):
    """Numbers of an address, exactly as they are written."""
    return [
        Decimal(m[1]) for line in lines if (m := re.search(rf"{letter}([-.0-9]+)", line.decode()))
    ]


@pytest.mark.parametrize(
    ("block", "kept"),
    [
        (b"G0 X3", None),
        (b"G00 X3", None),
        (b"X3 G0", None),
        (b"N10 G0 X3", b"N10 G0"),
        (b"G0 X3 (go there)", b"G0  (go there)"),
        (b"G0 X3 ; go there", b"G0  ; go there"),
        (b"n10g0x3m8(a)z1(b)", b"n10g0m8(a)(b)"),
        (b"G0 M3 S1000 X3 T4 M8", b"G0 M3 S1000  T4 M8"),
        (b"G0 F99 X3", b"G0 F99"),
        (b"G0 X3 M1", None),
        (b"N5 G0 X3 M0 (stop)", b"N5 G0   (stop)"),
    ],
)
def test_the_rest_of_a_block_stands_before_its_stream(block, kept):
    before, _, _ = parts(stream_of(HEAD + block + b"\nM2\n", comments=False))
    assert before == ([] if kept is None else [kept])


@pytest.mark.parametrize("stop", [b"M0", b"M1", b"M60", b"M2", b"M30"])
def test_the_program_stops_after_the_stream(stop):
    program = HEAD + b"G0 X3 " + stop + b"\n"
    _, _, after = parts(stream_of(program))
    assert after == [b"F250.0", stop]


@pytest.mark.parametrize(
    ("codes", "before", "after"),
    [
        (b"G94 G64 F250", [], [b"F250.0"]),
        (b"G94 G64 P0.01 F250", [], [b"F250.0"]),
        (b"G94 G64 F.125", [], [b"F0.125"]),
        (b"G94 G64 F1234.56789", [], [b"F1234.56789"]),
        (b"G94 G61 F250", [b"G64"], [b"F250.0"]),
        (b"G94 G61.1 F250", [b"G64"], [b"F250.0"]),
        (b"G93 G64", [b"G94"], [b"G93"]),
        (b"G95 G64 F0.2", [b"G94"], [b"G95 F0.2"]),
        (b"G93 G61", [b"G94 G64"], [b"G93"]),
        (b"G64 F250", [b"G94"], [b"F250.0"]),
    ],
)
def test_modal_values_are_set_and_restored(codes, before, after):
    lines = stream_of(b"G21 G90 " + codes + b"\nG0 X3\nM2\n", comments=False)
    found_before, _, found_after = parts(lines)
    assert (found_before, found_after) == (before, after)


@pytest.mark.parametrize("code", [b"G61", b"G61.1"])
def test_an_exact_stop_in_force_stands_on_the_last_point(code):
    """Restored behind it, it would come too late: the end would be rounded into the next move."""
    lines = stream_of(b"G21 G90 G94 F250 " + code + b"\nG0 X3\nM2\n", comments=False)
    before, points, after = parts(lines)
    assert before == [b"G64"]
    assert points[-1] == b"G0 " + code + b" X3"
    assert after == [b"F250.0"]


def test_absolute_distance_is_stated_where_the_program_does_not():
    before, _, after = parts(stream_of(b"G21 G94 G64 F250\nG0 X3\nM2\n", comments=False))
    assert before == [b"G90"]
    assert after == [b"F250.0"]


@pytest.mark.parametrize("feed", ["0.1", "33.3", "1000000", "7.0000001", ".30000000000000004"])
def test_the_feed_comes_back_as_the_same_number(feed):
    program = f"G21 G90 G94 G64\nF{feed}\nG0 X3\nM2\n".encode()
    _, _, after = parts(stream_of(program))
    (restored,) = words(after, "F")
    assert float(restored) == float(feed)


def test_a_feed_in_the_rapid_s_own_block_is_the_one_that_comes_back():
    _, _, after = parts(stream_of(HEAD + b"G0 X3 F77\nM2\n"))
    assert after == [b"F77.0"]


def test_inches_come_back_in_inches():
    lines = stream_of(b"G20 G90 G94 G64\nF10\nG0 X.5\nM2\n", comments=False)
    _, points, after = parts(lines)
    assert points[-1].split()[1] == b"X.5"
    assert after == [b"F10.0"]
    x = words(points, "X")
    assert x == sorted(x)
    assert float(x[-1]) == 0.5
    # Eight decimals, whatever the resolution.
    assert all(-v.as_tuple().exponent == 8 for v in x[:-1])


@pytest.mark.parametrize("distance", ["G90", "G91"])
@pytest.mark.parametrize("start", ["0", "0.123456789", "-7.1234567"])
def test_every_motion_is_one_where_the_ini_is_in_inches(distance, start):
    """One of 1e-8 machine units or less is left out by LinuxCNC, and its stop with it."""
    by = Decimal("0.5")
    to = by if distance == "G91" else Decimal(start) + by
    program = f"G20 G90 G94 G64\nG1 X{start} F10\n{distance} G0 X{to}\nM2\n".encode()
    lines = stream_of(program, comments=False)
    x = words([line for line in lines if line[:1] == b"G"], "X")
    at = x if distance == "G90" else [Decimal(start) + sum(x[: k + 1]) for k in range(len(x))]
    assert at[-1] == Decimal(start) + by
    moved = [b - a for a, b in pairwise([Decimal(start), *at])]
    assert min(moved) > Decimal("1.1e-8")


def test_a_diameter_stays_a_diameter():
    lathe = Machine.loads(TEXT.replace("X:\n", "X:\n    diameter: true\n"))
    result = process(b"G21 G90 G94 G64 G7 F250\nG0 X30\nM2\n", lathe)
    begin, end, _ = result.edits[-1]
    _, points, _ = parts(result.output[begin:end].splitlines())
    x = words(points, "X")
    assert x[-1] == 30
    assert x == sorted(x)
    radius = process(b"G21 G90 G94 G64 F250\nG0 X15\nM2\n", MACHINE)
    begin, end, _ = radius.edits[-1]
    _, same, _ = parts(radius.output[begin:end].splitlines())
    assert [v / 2 for v in x] == words(same, "X")
    assert words(points, "F") == words(same, "F")


@pytest.mark.parametrize("line_end", [b"\n", b"\r\n"])
@pytest.mark.parametrize("last", [b"", b"line end"])
def test_line_ends_are_those_of_the_program(line_end, last):
    program = b"G21 G90 G94 G64 F250" + line_end + b"G0 X3" + (line_end if last else b"")
    text = process(program, MACHINE).output
    assert text.count(b"\n") == text.count(line_end)
    assert text.endswith(line_end) == bool(last)
    if not last:
        assert text.endswith(b"\nF250.0")


def test_everything_else_is_the_program_s_own_bytes():
    before = b"\xff\xfe (caf\xe9)\t \nG21 G90  G94G64 F250 \n\n"
    between, after = b"g1 x4.\t(cut)\n", b"(end)\n%\n\ntrailing \x80 words"
    text = output(b"%\n" + before + b"G0 X3\n" + between + b"G0 X1\n" + after)
    assert text.startswith(b"%\n" + before)
    assert text.endswith(after)
    assert between in text


@pytest.mark.parametrize(
    "block",
    [
        b"G0 X3",
        b"N99999 G0 X3 Z4 M3 S10000 M8 T12",
        b"G0 X3.00000000000000000 Z4.0000000000000000 M8 T12 S100",
        b"G0 X3 (a comment with more than seventy characters that is not repeated in ours at all)",
        b"g 0 x 3 ; \xe9\xe8",
    ],
)
def test_the_comment_names_the_block_and_stays_short(block):
    result = process(HEAD + block + b"\nM2\n", MACHINE)
    if result.planned == 0:
        pytest.fail("the block was left alone")
    begin, end, _ = result.edits[-1]
    comment = result.output[begin:end].split(b"\n")[0]
    assert comment.startswith(b"(gcodejerk: ")
    assert comment.endswith(b")")
    assert len(comment) < 70
    assert all(32 <= c < 127 for c in comment)
    assert comment.count(b"(") == comment.count(b")") == 1
    first = re.sub(rb"\s", b"", block)[:2]
    assert comment[12:].replace(b" ", b"").startswith(first)


def test_comments_can_be_switched_off():
    assert b"gcodejerk:" not in output(HEAD + b"G0 X3\nM2\n", comments=False)
    assert b"gcodejerk:" in output(HEAD + b"G0 X3\nM2\n")


@pytest.mark.parametrize(
    ("block", "ending"),
    [
        (b"G0 X3.50 Z-.25", [b"X3.50", b"Z-.25"]),
        (b"G0 Z+1 X 3", [b"Z+1", b"X3"]),
        (b"G0 x3.123456789", [b"X3.123456789"]),
        (b"G0 X3 Z0", [b"X3", b"Z0"]),
    ],
)
def test_the_last_point_repeats_the_words_of_the_block(block, ending):
    _, points, _ = parts(stream_of(HEAD + block + b"\nM2\n"))
    assert points[-1].split()[1:] == ending


@pytest.mark.parametrize("unit", [b"G20", b"G21"])
@pytest.mark.parametrize(
    ("x", "z"), [("0.3", "-0.2"), ("-.333333333333", "0.7"), ("1.0000001", "0"), ("4", "-1.5")]
)
def test_increments_add_up_to_the_program_s_exactly(unit, x, z):
    program = unit + f" G91 G94 G64 F25\nG0 X{x} Z{z}\nM2\n".encode()
    _, lead, points, _ = split(stream_of(program))
    assert sum(words(lead + points, "X")) == Decimal(x)
    assert sum(words(lead + points, "Z")) == Decimal(z)
    # No increment goes back, and none is a point far from the others.
    steps = words(points, "X")
    assert min(step * (1 if float(x) > 0 else -1) for step in steps) >= 0
    assert max(abs(step) for step in steps) < Decimal("0.25") * abs(Decimal(x))


def test_absolute_points_are_the_planned_positions():
    # LinuxCNC does not blend A; the form is the same for controls that do.
    lines = stream_of(HEAD + b"G0 X12.5 Z-5 A3\nM2\n", controller="mach")
    points = [line for line in lines if line.startswith(b"G1 ")]
    plan = plan_move({"X": 12.5, "Z": -5.0, "A": 3.0}, MACHINE)
    assert len(points) == len(plan.t) - 1
    for axis in "XZA":
        found = [float(x) for x in words(points, axis)]
        assert found == pytest.approx(plan.positions[axis][1:].tolist(), abs=1e-9)


@pytest.mark.parametrize(("interval", "period"), [("0.0005", 4), ("0.001", 2), ("0.002", 2)])
def test_blocks_last_two_milliseconds_and_two_periods_at_least(interval, period):
    machine = Machine.loads(TEXT.replace("interval: 0.002", f"interval: {interval}"))
    result = process(HEAD + b"G0 X12.5\nM2\n", machine)
    begin, end, _ = result.edits[-1]
    _, points, _ = parts(result.output[begin:end].splitlines())
    blocks = len(points) - 2
    """Without the tail and the end."""
    # Where a start is slow they are longer.
    assert 0.4 * result.plans.counts[0] <= blocks * period + 2 <= result.plans.counts[0] + 2


def test_what_leads_in_depends_on_what_stands_in_front():
    program = HEAD + b"G4 P1\nG0 X3\nG1 X4\nG0 Z2\nX6\nM8\nG0 X9\nG0 X12 M9\nM2\n"
    result = process(program, MACHINE)
    streams = [result.output[a:b].splitlines() for a, b, row in result.edits.tolist() if row >= 0]
    assert len(streams) == 5
    # Behind a dwell and M8, and beside M9, the queue of motions is empty.
    assert [len(split(lines)[1]) for lines in streams] == [3, 1, 1, 3, 3]


def test_no_two_successive_feeds_are_equal():
    _, points, _ = parts(stream_of(HEAD + b"G0 X80\nM2\n"))
    feeds = words(points, "F")
    assert len(feeds) > 50
    assert all(a != b for a, b in pairwise(feeds))


def test_blocks_left_alone_stay_as_they_are():
    program = HEAD + b"/G0 X3\nG0 X#1\nG53 G0 X3\nG0 X0.001\nM2\n"
    assert output_or_itself(program) == program


def output_or_itself(program):
    """The output, which has no stamp where nothing was rewritten."""
    result = process(program, MACHINE)
    assert result.planned == 0
    return result.output


def test_the_stamp_is_the_first_line_after_the_percent_sign():
    text = process(b"%\n(part)\n" + HEAD + b"G0 X3\nM2\n%\n", MACHINE).output
    assert re.match(rb"%\n(\(part\)\n)?\(gcodejerk stamp 0\.\S+ [0-9a-f]{8} [^)]*\)\n", text)


def test_the_stamp_changes_with_machine_and_settings():
    other = Machine.loads(TEXT.replace("22", "23"))
    program = HEAD + b"G0 X3\nM2\n"
    found = {
        re.search(rb"stamp \S+ (\S+)", process(program, m, profile=p).output)[1]
        for m in (MACHINE, other)
        for p in ("condition3", "conventional")
    }
    assert len(found) == 4


OPTIONS = "controller_options: {%s}\n"


@pytest.mark.parametrize(
    ("options", "what"),
    [("version: 2.10, planner_type: 1", "planner_type is 1"), ("servo_period: 0.00099", "0.00099")],
)
def test_settings_under_which_streams_are_played_otherwise_are_refused(options, what):
    with pytest.raises(EmitError, match=what):
        process(HEAD + b"G0 X3\nM2\n", Machine.loads(TEXT + OPTIONS % options))


def test_a_machine_whose_acceleration_is_too_low_keeps_its_rapids():
    options = OPTIONS % "max_acceleration: {X: 500}"
    result = process(HEAD + b"G0 X3\nG1 X4\nG0 X4 Z2\nM2\n", Machine.loads(TEXT + options))
    reasons = [rapid.reason for rapid in result.rapids]
    assert reasons == ["the control would not play it as planned", None]


def test_an_axis_that_the_planner_does_not_blend_is_left_alone():
    result = process(HEAD + b"G0 A20\nG0 X3 A40\nM2\n", MACHINE)
    assert result.planned == 0


@pytest.mark.parametrize(
    "blocks",
    [
        b"G0 X30 Z-3.1234567\nG1 X31\nG0 X1 Z-4\n",
        b"G0 X0.7654321 Z-30.00000049\nG0 X30 Z-30.1\n",
        b"G20\nG0 X1.12345678 Z0.333333333\nG21\nG0 X50 Z8.4700001\n",
        b"G91\nG0 X0.1000004 Z30.00000051\nX5.5 Z-20.3333333\n",
    ],
)
def test_no_point_is_past_an_end_between_two_steps(blocks):
    result = process(HEAD + blocks + b"M2\n", MACHINE)
    assert result.planned == 2


def test_rapids_that_are_alike_have_the_same_speeds_wherever_they_begin():
    program = HEAD + b"G0 X10 Z-5\nG1 X11.1 Z-3.3\nG0 X21.1 Z-8.3\nG0 X11.1 Z-3.3\nM2\n"
    result = process(program, MACHINE)
    feeds = []
    for begin, end, row in result.edits.tolist():
        if row >= 0:
            _, _, points, _ = split(result.output[begin:end].splitlines())
            feeds.append([float(f) for f in words(points, "F")])
    assert len(feeds) == 3
    # Rounding alone makes them differ: by some thousandths of 1 mm/s.
    assert feeds[1] == pytest.approx(feeds[0], abs=1.0)


def test_what_the_machine_file_says_of_the_control_is_not_asked_for_again():
    limit = "}\n    limit: {acceleration: 2400, jerk: 5.0e+5}"
    text = "controller: linuxcnc" + TEXT.replace(", jerk: 5.0e+4}", limit)
    program = HEAD + b"G0 X30\nM2\n"
    raised = [
        any("raise MAX_ACCELERATION" in note for note in process(program, machine).notes)
        for machine in map(Machine.loads, (text, text + OPTIONS % "max_acceleration: {X: 2520}"))
    ]
    assert raised == [True, False]


@pytest.mark.parametrize("speed", [20.0, 600.0, 1023.9, 1031.506, 2060.1, 9000.0])
@pytest.mark.parametrize("inch", [False, True])
def test_blocks_of_one_speed_have_feeds_that_are_two_speeds_for_the_control(speed, inch):
    knots = np.array([[0, 0, 2, 4, 6, 8]])
    batch = SimpleNamespace(
        path_speed=np.full((1, 6), speed), grid=SimpleNamespace(knots=knots), moves=np.array([0])
    )
    feed = linuxcnc._feeds(batch, SimpleNamespace(inch=np.array([inch])))[0, 2:]
    decimals = linuxcnc.INCH_FEED_DECIMALS if inch else linuxcnc.FEED_DECIMALS
    told = [float(str(Decimal(int(f)).scaleb(-decimals))) for f in feed]
    speeds = [f * (25.4 if inch else 1.0) / 60.0 for f in told]
    assert all(a != b for a, b in pairwise(speeds))
    assert speeds == pytest.approx([speed] * 4, abs=1e-9)


@pytest.mark.parametrize("unit", ["G21", "G20"])
def test_the_tail_goes_along_the_line(unit):
    """A tail 7 degrees off the line made LinuxCNC stop in front of it, 3.8 did not (played)."""
    scale = 25.4 if unit == "G20" else 1.0
    ways = [(25.4, 12.7, 0.0), (60.0, 7.0, 0.0), (31.0, -17.0, 11.0), (5.0, 4.0, -40.0)]
    for way in ways:
        words = " ".join(f"{a}{x / scale:.4f}" for a, x in zip("XYZ", way, strict=True) if x)
        program = f"{unit} G91 G94 F30\nG90 G0 X0 Y0 Z0\nG91\nG1 X-0.1\nG0 {words}\nM2\n".encode()
        made = process(program, Machine.load(find_machine("vmc")), controller="linuxcnc")
        points = re.findall(rb"^G1 ((?:[XYZ]\S+ )+)F\S+$", made.output, re.MULTILINE)
        tail = dict.fromkeys("XYZ", 0.0)
        tail |= {word[:1].decode(): float(word[1:]) for word in points[-1].split()}
        step, line = np.array([tail[a] for a in "XYZ"]), np.array(way)
        cosine = step @ line / np.linalg.norm(step) / np.linalg.norm(line)
        assert np.linalg.norm(step) * scale == pytest.approx(2e-5, rel=0.1)
        assert np.degrees(np.arccos(min(cosine, 1.0))) < 3.8, (way, tail)


def test_axes_that_move_alike_but_for_a_last_bit_have_one_leading_axis():
    # In mm -38.099999999999994 + 12.7 and -31.75 + 6.35: as directions they are equal.
    data = b"G20 G90 G94 G17 G40 G64\nG0 X-.5 Y-.25 Z0\nG1 Z-.3 F20\nG0 X-1.5 Y-1.25\nM2\n"
    result = process(data, Machine.load(find_machine("vmc")), controller="linuxcnc")
    assert result.planned == 1
    assert result.verification.ok


@pytest.mark.parametrize("unit", ["G20", "G21"])
@pytest.mark.parametrize("last", ["0.0000000000004", "0.000000000005", "0.00000000002", "1/3"])
def test_increments_that_are_computed_are_written_as_they_are_proven(unit, last):
    program = f"{unit} G90 G94 G64 F250\nG0 X0\nG91\nG0 X[1+{last}]\nM2\n".encode()
    result = process(program, MACHINE, dialect="linuxcnc")
    assert result.planned == 1
