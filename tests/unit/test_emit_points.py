"""Motion controllers: what each is written, in which units, and what has to be known first."""

import io
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from gcodejerk import Machine, process, verify
from gcodejerk.emit import controllers, load_controller
from gcodejerk.emit.points.base import decimal
from gcodejerk.emit.points.fanuc15 import records
from gcodejerk.errors import EmitError, MachineError
from gcodejerk.planning.records import advancing
from gcodejerk.verification.findings import Kind
from gcodejerk.verification.physics.oscillators import Oscillators
from gcodejerk.verification.physics.own_rapids import left_by_rapids, rapid_limits
from gcodejerk.verification.rows.files import rows_format

AXIS = "{rapid: {velocity: 500, acceleration: 5000, jerk: 150000}, limit: {jerk: 150000}, modes: [{frequency: 27, damping: 0.02}]}"  # noqa: E501
EXAMPLE = f"interval: 0.001\npositioning: linear\naxes:\n  X: {AXIS}\n"
TURNING = AXIS.replace("{rapid", "{wrap: none, rapid").replace("}]", ", participation: 1}]")
MOVE = b"G21 G90 G94 G17 G40 G49 G80 G54\nG1 X0. F100.\nG0 X300.\nM2\n"
OPTIONS = {
    "acs": "{axis_names: {X: '0'}}",
    "csp": "{counts_per_unit: {X: 1000}}",
    "elmo": "{counts_per_unit: {X: 1000}}",
    "fanuc15": "{counts_per_unit: {X: 1000}, axis_names: {X: '1'}, fanuc_distance: general}",
    "galil": "{counts_per_unit: {X: 1000}, axis_names: {X: A}}",
    "json": "{}",
    "pmac": "{confirmed: [pmac-colon], isx90: 1000}",
    "ros2": "{axis_names: {X: x}}",
}
MOTION = sorted(OPTIONS)


def machine(controller, options=None, text=EXAMPLE, **also):
    said = OPTIONS.get(controller, "{}") if options is None else options
    lines = f"controller: {controller}\n{text}"
    return Machine.loads(lines + (f"controller_options: {said}\n" if said != "{}" else ""))


def written(controller, options=None, program=MOVE, text=EXAMPLE, profile="conventional"):
    return process(program, machine(controller, options, text), profile=profile)


def rows(result, comment):
    lines = result.output.decode().splitlines()
    return [line for line in lines if not line.startswith(comment)]


def test_galil_is_told_the_worked_example():
    assert rows(written("galil"), "REM") == [
        *("PVA=912,82444,34", "PVA=16830,417068,69", "PVA=15673,499512,34"),
        *("PVA=233170,499512,478", "PVA=15673,417068,34", "PVA=16830,82444,69"),
        *("PVA=912,0,34", "PVA=0,0,0", "BTA"),
    ]


def test_elmo_is_told_the_worked_example():
    assert rows(written("elmo"), "#") == [
        *("X_position,X_velocity,time_ms", "963,85000,34", "17463,415000,66", "33500,500000,34"),
        *("266500,500000,466", "282537,415000,34", "299037,85000,66", "300000,0,34"),
    ]


def test_pmac_is_told_the_worked_example():
    found = rows(written("pmac"), "//")
    assert (found[0], found[-1]) == ("BLOCKSTART", "BLOCKSTOP")
    numbers = [tuple(map(float, re.findall(r"[0-9.]+", line))) for line in found[1:-1]]
    wanted = [
        (33.3335, 0.925935, 83.33375), (66.6665, 17.592560, 416.66625), (33.3335, 33.333375, 500),
        (466.6665, 266.666625, 500), (33.3335, 282.407440, 416.66625),
        (66.6665, 299.074065, 83.33375), (33.3335, 300, 0),
    ]  # fmt: skip
    assert np.array(numbers) == pytest.approx(np.array(wanted), abs=6e-7)


def test_ros2_is_told_the_message():
    """Of trajectory_msgs/msg/JointTrajectory and JointTrajectoryPoint (common_interfaces, rolling):
    header, joint_names, points; positions, velocities, accelerations, effort, time_from_start
    (builtin_interfaces/Duration: int32 sec, uint32 nanosec)."""
    trajectory = {"header", "joint_names", "points"}
    point = {"positions", "velocities", "accelerations", "effort", "time_from_start"}
    documents = list(yaml.safe_load_all(written("ros2").output))
    assert len(documents) == 1
    assert set(documents[0]) <= trajectory
    assert documents[0]["joint_names"] == ["x"]
    times = []
    for entry in documents[0]["points"]:
        assert set(entry) == point - {"accelerations", "effort"}
        assert all(isinstance(x, float) for x in entry["positions"] + entry["velocities"])
        duration = entry["time_from_start"]
        assert set(duration) == {"sec", "nanosec"}
        assert 0 <= duration["nanosec"] < 10**9
        times.append(duration["sec"] + 1e-9 * duration["nanosec"])
    assert times == pytest.approx([1 / 30, 0.1, 4 / 30, 0.6, 19 / 30, 0.7, 22 / 30], abs=2e-9)
    assert [p["positions"][0] for p in documents[0]["points"]] == pytest.approx(
        [0.000925926, 0.017592593, 0.033333333, 0.266666667, 0.282407407, 0.299074074, 0.3],
        abs=2e-9,
    )
    assert documents[0]["points"][-1]["velocities"] == [0.0]


def test_json_is_one_document_with_the_documented_keys():
    program = MOVE.replace(b"M2", b"G0 X5\nM2")
    document = json.loads(written("json", program=program).output)
    assert set(document) == {
        *("gcodejerk", "rows", "controller", "machine", "profile", "interpolation", "units"),
        *("rapids", "sum"),
    }
    assert [rapid["line"] for rapid in document["rapids"]] == [3, 4]
    for rapid in document["rapids"]:
        assert set(rapid) == {"line", "t", "X", "planned", "written", "residual"}
        assert len(rapid["t"]) == len(rapid["X"]["position"]) == len(rapid["X"]["velocity"]) == 8
    empty = json.loads(written("json", program=b"M2\n").output)
    assert empty["rapids"] == []


@pytest.mark.parametrize(
    ("form", "text"),
    [("general", "00 64 FF CE 00 00 31"), ("special", "00 C8 FE 9C 00 00 62")],
)
def test_fanuc_records_of_the_worked_example(form, text):
    assert records(np.array([[100, -50, 0]]), form).hex(" ").upper() == text


def test_fanuc_special_700_increments():
    assert records(np.array([[700]]), "special")[:2].hex(" ").upper() == "0A 78"


@pytest.mark.parametrize("form", ["general", "special"])
def test_fanuc_streams_have_no_record_of_zeros_but_the_last(form):
    options = f"{{counts_per_unit: {{X: 1000}}, axis_names: {{X: '1'}}, fanuc_distance: {form}}}"
    result = written("fanuc15", options)
    _, _, data = result.output.partition(b"G05\n")
    data = data[: data.rindex(b"(SUM")]
    found = [data[k : k + 3] for k in range(0, len(data), 3)]
    assert found[-1] == bytes(3)
    assert all(any(record) for record in found[:-1])
    if form == "general":
        steps = [int.from_bytes(record[:2], "big", signed=True) for record in found]
        assert sum(steps) == 300_000
        assert bytes.fromhex("01F4F5") in found


def test_counts_advance_from_the_middle_outwards():
    rng = np.random.default_rng(1)
    for _ in range(200):
        counts = np.cumsum(rng.integers(0, 4, 40)) * rng.choice([-1, 1])
        moved = np.diff(advancing(counts)) != 0
        first, last = np.flatnonzero(moved)[[0, -1]]
        inside = moved[first : last + 1]
        assert inside.all() or abs(counts[-1] - counts[0]) < len(inside)
        assert (advancing(counts)[[0, -1]] == counts[[0, -1]]).all()


@pytest.mark.parametrize("name", MOTION)
def test_files_are_told_apart_and_proven(name):
    result = written(name)
    assert rows_format(io.BytesIO(result.output)) == name
    assert result.verification.ok
    assert verify(MOVE, result.output, machine(name)).rewritten == 1


@pytest.mark.parametrize("name", ["acs", "pmac"])
def test_unverified_lines_are_comments_until_confirmed(name):
    options = {"acs": "{axis_names: {X: '0'}}", "pmac": "{}"}[name]
    comment = {"acs": "! ", "pmac": "// "}[name]
    result = written(name, options)
    assert rows(result, comment) == []
    assert b"confirmed" in result.output
    said = {"acs": "{axis_names: {X: '0'}, confirmed: [acs-pvspline]}", "pmac": None}[name]
    assert len(rows(written(name, said), comment)) == 9


def test_pmac_needs_the_unit_of_time_too():
    assert rows(written("pmac", "{confirmed: [pmac-colon]}"), "// ") == []
    fast = rows(written("pmac", "{confirmed: [pmac-colon], isx90: 1}"), "// ")
    assert fast[3].endswith(":0.5")


@pytest.mark.parametrize(
    ("name", "options", "problem"),
    [
        ("galil", "{axis_names: {X: A}}", "needs the counts per mm or degree of axis X"),
        ("galil", "{counts_per_unit: {X: 10}}", "needs the letter of axis X"),
        ("galil", "{counts_per_unit: {X: 10}, axis_names: {X: J}}", "expected a letter from A"),
        ("elmo", "{}", "needs the counts"),
        ("csp", "{}", "needs the counts"),
        ("acs", "{axis_names: {X: first}}", "expected a whole number"),
        ("ros2", "{}", "needs the joint name"),
        ("fanuc15", "{counts_per_unit: {X: 10}, axis_names: {X: '1'}}", "format of distances"),
        (
            "fanuc15",
            "{counts_per_unit: {X: 10}, axis_names: {X: '2'}, fanuc_distance: general}",
            "expected the places from 1 to 1",
        ),
        (
            "fanuc15",
            "{counts_per_unit: {X: 1.0e+6}, axis_names: {X: '1'}, fanuc_distance: special}",
            "increments in a unit time",
        ),
    ],
)
def test_what_is_not_known_is_asked_for(name, options, problem):
    with pytest.raises(EmitError, match=problem) as error:
        written(name, options)
    assert error.value.remedy


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ("{counts_per_unit: {Q: 3}}", "not a known key"),
        ("{counts_per_unit: {X: 0}}", "above zero"),
        ("{confirmed: [pmac-colons]}", "did you mean 'pmac-colon'"),
        ("{fanuc_distance: both}", "general, special"),
        ("{axis_names: {X: ''}}", "a name of at most 60"),
        ("{isx90: -1}", "above zero"),
    ],
)
def test_wrong_options_are_refused_with_their_place(options, problem):
    with pytest.raises(MachineError, match=problem):
        machine("pmac", options)


def test_two_axes_of_one_name_are_refused():
    text = EXAMPLE + f"  Y: {AXIS}\n"
    with pytest.raises(EmitError, match="the same name"):
        written("ros2", "{axis_names: {X: j, Y: j}}", text=text)


def test_a_cycle_that_no_drive_can_be_told_is_refused():
    text = EXAMPLE.replace("0.001", "0.0009765625")
    with pytest.raises(EmitError, match="0x60C2"):
        written("csp", text=text)
    with pytest.raises(EmitError, match="unit time"):
        written("fanuc15", text=EXAMPLE.replace("0.001", "0.003"))


def test_options_come_back_from_what_is_written():
    text = "{counts_per_unit: {X: 1000}, axis_names: {X: j/1}, isx90: 10, confirmed: [pmac-colon]}"
    described = machine("pmac", text)
    from gcodejerk.machine.file.writer import machine_yaml

    assert Machine.loads(machine_yaml(described)) == described


def test_long_segments_are_split_where_the_controller_has_a_longest():
    slow = EXAMPLE.replace("velocity: 500", "velocity: 20")
    times = [int(line.split(",")[2]) for line in rows(written("galil", text=slow), "REM")[:-2]]
    assert max(times) <= 2048
    assert len(times) > 7
    first = rows(written("pmac", text=slow), "//")[1:-1]
    assert max(float(line.split()[0][3:]) for line in first) <= 4095.9998


def test_more_segments_than_a_controller_has_leave_the_rapid_alone():
    # Over a narrow band and without a guard the optimum has a jerk in every interval, or nearly.
    text = EXAMPLE.replace("limit: {jerk: 150000}", "limit: {jerk: 1.5e+7}")
    text += "design: {band: 0.02, guard: 0}\n"
    options = "{counts_per_unit: {X: 1.0e+7}, axis_names: {X: A}}"
    result = written("galil", options, text=text, profile="optimal")
    assert [row.reason for row in result.rapids] == ["too long for a stream"]


def test_degrees_inches_and_diameters():
    text = (
        "interval: 0.001\npositioning: linear\naxes:\n"
        f"  X: {AXIS.replace('{rapid', '{diameter: true, rapid', 1)}\n"
        f"  A: {TURNING}\n"
    )
    program = b"G20 G90 G94 G7 G17 G40 G49 G80 G54\nG1 X0 A0 F9\nG0 X2\nG0 A-90\nM2\n"
    options = "{axis_names: {X: x, A: a}}"
    first, second = yaml.safe_load_all(written("ros2", options, program, text).output)
    assert first["points"][-1]["positions"][0] == pytest.approx(0.0254)
    assert second["points"][-1]["positions"][1] == pytest.approx(-np.pi / 2, abs=1e-11)
    counts = "{counts_per_unit: {X: 1000, A: 100}}"
    found = rows(written("elmo", counts, program, text), "#")
    assert [line.split(",")[0] for line in found if line.endswith(",0,34")] == ["25400", "-9000"]


def test_every_motion_controller_is_listed_with_its_confidence():
    for name in MOTION:
        assert name in controllers()
        (form,) = load_controller(name).forms
        assert form.confidence in ("measured", "documented", "unverified")
        assert load_controller(name).in_form("stream").name == name
        with pytest.raises(EmitError, match="cannot write --as parameters"):
            load_controller(name).in_form("parameters")


def test_decimals_are_written_without_zeros():
    assert [decimal(x, 3) for x in (0, 1, -1, 1000, -1250)] == [
        "0",
        "0.001",
        "-0.001",
        "1",
        "-1.25",
    ]


def test_programs_of_a_fanuc_are_read_by_the_remote_buffer_s_controller():
    described = machine("fanuc15")
    assert described.dialect == "fanuc"
    assert replace(described, name="x (y)").name == "x (y)"


LAWS = {
    "quintic": "planner: quintic",
    "two-stage": "planner: two-stage, changeover: 100, upper_acceleration: 1000",
    "time-constants": "planner: time-constants, first_average: 0.1, second_average: 0.03",
    "four-ramp": (
        "planner: four-ramp, rise: 0.01, fall: 0.03, braking_rise: 0.03, braking_fall: 0.01"
    ),
    "average": "filter: {type: average, time: 0.032}",
    "zvd": "filter: {type: zvd, frequency: 25, damping: 0.05}",
}


def of_law(law, positioning, more=""):
    """A machine whose own rapids follow a law; Z has no mode and keeps its own profile."""
    axes = {
        "X": "modes: [{frequency: 17, damping: 0.02}, {frequency: 44, damping: 0.01}]",
        "Y": "modes: [{frequency: 9, damping: 0.01}]",
        "Z": "modes: []",
    }
    rapid = "rapid: {velocity: 300, acceleration: 1500, jerk: 60000, %s}" % LAWS[law]  # noqa: UP031
    limit = "limit: {velocity: 1200, acceleration: 6000, jerk: 1.0e+6}"
    text = f"interval: 0.001\ncontroller: json\npositioning: {positioning}\n{more}axes:\n"
    return Machine.loads(
        text + "".join(f"  {a}: {{{rapid}, {limit}, {modes}}}\n" for a, modes in axes.items())
    )


QUIET = """
interval: 0.001
controller: json
positioning: independent
spindle: mill
design: {band: 0.3, tolerance: 0.0001}
axes:
  X:
    rapid: {velocity: 900, acceleration: 200, LAW}
    limit: {velocity: 1200, acceleration: 6000, jerk: 1.0e+6}
    modes: [{frequency: 89.42, damping: 0.03}]
  Y: {rapid: {velocity: 900, acceleration: 200, LAW}, modes: []}
  Z:
    rapid: {velocity: 900, acceleration: 200, LAW}
    modes:
    - {frequency: 75.48, damping: 0.1, participation: 0.3}
    - {frequency: 14.27, damping: 0.03, participation: 2}
"""
WAYS = (
    b"G21 G90 G94 G17 G40 G49 G80 G54\nG1 X0. Y0. Z0. F100.\nG0 X80. Y-5. Z3.\nG0 Y60.\n"
    b"G0 X4.03 Y-25. Z-9.26\nG0 X200. Z5.\nG0 Y300. Z-60.\nG0 X0. Y0. Z-57.7\nM2\n"
)


@pytest.mark.parametrize("profile", ["condition3", "symmetric", "cascade"])
@pytest.mark.parametrize("positioning", ["linear", "independent"])
@pytest.mark.parametrize("law", LAWS)
def test_rows_are_proven_whatever_the_controls_own_rapids_follow(law, positioning, profile):
    made = process(WAYS, of_law(law, positioning), profile=profile)
    assert made.verification.ok
    assert made.planned > (0 if law in ("zvd", "average") else 3)


@pytest.mark.parametrize("law", ["time-constants", "zvd"])
def test_rows_of_axes_that_move_in_far_less_than_their_own_time_are_proven(law):
    program = b"\n".join([*WAYS.split(b"\n")[:3], b"G0 Y60.", b"M2", b""])
    made = process(program, of_law(law, "independent"), profile="shortest")
    assert made.verification.ok
    assert made.planned > 0


@pytest.mark.parametrize("law", LAWS)
def test_rows_are_held_to_what_the_controls_own_rapids_leave(law):
    """Two ways that share no code: what planning says of today's rapids, and the proof."""
    machine = of_law(law, "independent")
    made = process(WAYS, machine, profile="conventional")
    rapids, rows = made.program.rapids, np.flatnonzero(made.plans.planned)
    displacement = np.nan_to_num(rapids.target - rapids.start)[rows]
    paths = SimpleNamespace(
        displacement=displacement, speed=rapids.speed[rows], lone=np.zeros(len(rows), dtype=bool)
    )
    left = left_by_rapids(displacement, machine, rapid_limits(paths, machine))
    modes = Oscillators.of(machine)
    assert modes.largest(np.abs(left(modes))) == pytest.approx(
        made.conventional_residual[rows].max(axis=1), rel=2e-3, abs=1e-7
    )


@pytest.mark.parametrize("law", [LAWS["two-stage"], f"jerk: 2.0e+6, {LAWS['quintic']}"])
def test_a_law_that_leaves_more_than_limits_tell_is_todays_rapid(law):
    text = QUIET.replace("LAW", law)
    program = WAYS.replace(b"G0 X200. Z5.", b"G91 G0 X-548.877 Y96.324 Z-90.\nG90")
    for profile in ("condition3", "cascade"):
        made = process(program, Machine.loads(text), profile=profile)
        assert made.verification.ok


def test_an_axis_with_a_small_part_in_a_way_may_be_rounded_as_others_are():
    machine = of_law("average", "linear", "path: {rapid: {velocity: 100, acceleration: 3000}}\n")
    coarse = [replace(axis, resolution=1e-3) for axis in machine.axes]
    machine = replace(machine, axes=tuple(coarse))
    program = WAYS.replace(b"X80. Y-5. Z3.", b"X1. Y2. Z-50.").replace(b"X200. Z5.", b"X283.8 Z.58")
    made = process(program, machine, profile="symmetric")
    assert made.verification.ok
    assert made.planned > 0


def test_whole_ticks_may_take_what_the_machine_file_allows_the_shortest_profile_too():
    """Galil's ticks are 1/1024 s and common to all rows: some 3 % more than whole intervals."""
    text = (
        "interval: 0.002\npositioning: independent\naxes:\n  X: {resolution: 1.0e-4, rapid: "
        "{velocity: 100, acceleration: 200}, modes: [{frequency: 117.4, damping: 0}, "
        "{frequency: 110.8, damping: 0.03, participation: 2}]}\n"
    )
    program = b"G21 G90 G94 G17 G40 G49\nG1 X0. F100.\nG0 X-62.67\nG0 X-188.014\nG0 X9.\nM2\n"
    made = process(program, machine("galil", text=text), profile="shortest")
    assert made.verification.ok
    assert made.planned == 3


def test_a_way_counts_what_slides_whatever_its_letter_says():
    """B slides here: a short X beside it makes no short rapid."""
    sliding = AXIS.replace("{rapid", "{type: linear, rapid")
    text = f"{EXAMPLE}  B: {sliding}\ndesign: {{minimum_length: 2}}\n"
    program = MOVE.replace(b"X0. F100.\nG0 X300.", b"X0. B0. F100.\nG0 X.68 B148.9\nG0 X1.3 B150.")
    made = process(program, machine("json", text=text))
    assert made.verification.ok
    assert made.planned == 1


def test_records_that_a_stream_cannot_begin_or_end_with_are_no_missing_time():
    """Coarse increments: the axis stands for some records while the motion begins and ends."""
    law = f"rapid: {{velocity: 600, acceleration: 500, jerk: 2.0e+4, {LAWS['time-constants']}}}"
    text = (
        "interval: 0.001\npositioning: independent\nspindle: mill\naxes:\n"
        f"  X: {{{law}, modes: [{{frequency: 24.65, damping: 0.01, participation: 2}}]}}\n"
    )
    program = MOVE.replace(b"G0 X300.", b"G0 X.92\nG0 X6.3\nG0 X5.\nG0 X90.")
    options = OPTIONS["fanuc15"].replace("1000", "400")
    coarse = machine("fanuc15", options, text)
    made = process(program, coarse)
    assert made.verification.ok
    assert made.planned == 2
    farther = made.output.replace(b"G05\n", b"G05\n" + 3 * records(np.array([[1]]), "general"), 1)
    assert not verify(program, farther, coarse).ok


def test_axes_of_which_one_begins_at_once_and_another_ends_slowly_are_no_later_than_they_are():
    """Whose records are missing cannot be read: half of them in front made X seem late."""
    slow = "planner: time-constants, first_average: 0.42, second_average: 0.4"
    text = (
        "interval: 0.002\npositioning: independent\nspindle: mill\naxes:\n"
        "  X: {rapid: {velocity: 8, acceleration: 4000, planner: time-constants, "
        "first_average: 0.002, second_average: 0.003}}\n"
        f"  U: {{type: linear, rapid: {{velocity: 95, acceleration: 250, {slow}}}, "
        "modes: [{frequency: 12, damping: 0.02, participation: 1}]}\n"
    )
    options = (
        "{counts_per_unit: {X: 12000, U: 4000}, axis_names: {X: '1', U: '2'}, "
        "fanuc_distance: general}"
    )
    both = machine("fanuc15", options, text)
    program = b"G21 G90 G94 G64\nG0 X0 U0\nG0 X1. U5.\nM2\n"
    made = process(program, both)
    assert made.verification.ok
    assert made.planned == 1
    begin, end = made.output.index(b"G05\n") + len(b"G05\n"), made.output.index(bytes(5) + b"(SUM")
    stream = np.frombuffer(made.output[begin:end], dtype=np.uint8).reshape(-1, 5)
    steps = np.ascontiguousarray(stream[:, :-1]).view(">i2").astype(np.int64)
    late = steps.copy()
    late[[20, 150], 0] += [-100, 100]
    for changed, kind in ((late, Kind.TIME), (np.array([[1, 1], [-1, -1]]), Kind.END)):
        output = made.output[:begin] + records(changed, "general") + made.output[end:]
        found = verify(program, output, both)
        assert {violation.kind for violation in found.violations} >= {Kind.STAMP, kind}


@pytest.mark.parametrize(
    ("controller", "planner", "shaper", "length"),
    [
        ("elmo", "planner: poly5", "mzv, frequency: 15", 0.3),
        ("galil", "jerk: 3.0e+5", "zv, frequency: 15", 0.05),
        ("galil", "planner: poly5", "klipper-ei, frequency: 20, damping: 0.1", 0.11),
        ("pmac", "jerk: 3.0e+5", "zvd, frequency: 12, damping: 0.05", 0.3),
    ],
)
def test_an_axis_that_a_shaper_lets_stand_on_its_way_stands_there(
    controller, planner, shaper, length
):
    """A short way of an axis without modes, beside a long one: it crept back in between."""
    rapid = "velocity: 300, acceleration: 4000, %s, filter: {type: %s}" % (planner, shaper)  # noqa: UP031
    limit = "limit: {acceleration: 8000, jerk: 1.0e+7}"
    text = (
        f"interval: {'0.0009765625' if controller == 'galil' else '0.001'}\n"
        "positioning: independent\nspindle: mill\naxes:\n"
        f"  X: {{rapid: {{{rapid}}}, {limit}, modes: [{{frequency: 27, damping: 0.02}}]}}\n"
        f"  Y: {{rapid: {{{rapid}}}, {limit}}}\n"
    )
    options = {
        "elmo": "{counts_per_unit: {X: 10000, Y: 10000}}",
        "galil": "{counts_per_unit: {X: 10000, Y: 10000}, axis_names: {X: A, Y: B}}",
        "pmac": "{isx90: 1000, axis_names: {X: X, Y: Y}, confirmed: [pmac-colon]}",
    }
    program = b"G21 G90 G94\nG0 X0 Y0\nG0 X30 Y%g\nM2\n" % length
    made = process(program, machine(controller, options[controller], text))
    assert made.planned == 1
    assert made.verification.ok


def test_a_move_may_last_the_ticks_that_its_intervals_begin_and_two_more():
    """0.977 ms are a little more than a tick of 1/1024 s: 824 intervals begin the 825th tick."""
    rapid = (
        "{velocity: 300, acceleration: 5000, planner: trapezoidal, filter: {type: ei, "
        "frequency: 25}}"
    )
    text = (
        "interval: 0.000977\npositioning: linear\nspindle: mill\n"
        "design: {tolerance: 0.0001, max_extension: 0}\n"
        f"axes:\n  Y:\n    resolution: 1.0e-4\n    rapid: {rapid}\n    modes:\n"
        "    - {frequency: 157.5, damping: 0, participation: 2}\n"
        "    - {frequency: 192.4, damping: 0.1, participation: 2}\n"
        "    - {frequency: 9.491, damping: 0, participation: 0.3}\n"
        f"  Z:\n    resolution: 0.01\n    rapid: {rapid}\n    limit: {{acceleration: 6000}}\n"
        "    modes: [{frequency: 28.92, damping: 0.01, participation: 1}]\n"
    )
    options = "{counts_per_unit: {Y: 4096, Z: 1000}, axis_names: {Y: B, Z: C}}"
    program = b"G21 G90 G94\nG0 Y-212. Z156.62\nG0 Y-.715 Z5.\nM2\n"
    made = process(program, machine("galil", options, text))
    assert made.planned == 1
    assert made.verification.ok


@pytest.mark.parametrize("controller", ["acs", "pmac"])
def test_an_axis_without_a_limit_of_jerk_ramps_within_ticks(controller):
    """Its own rapid does, in 2.1 ms; an interval of 4 ms says nothing about that."""
    law = "planner: averaged-trapezoid, second_average: 0.0021"
    text = (
        "interval: 0.004\npositioning: independent\nspindle: mill\naxes:\n"
        f"  X:\n    rapid: {{velocity: 130, acceleration: 150, {law}}}\n"
        "    limit: {acceleration: 180}\n"
        f"  Y:\n    rapid: {{velocity: 140, acceleration: 650, {law}}}\n"
        "    limit: {acceleration: 1300}\n    modes: [{frequency: 5.6, damping: 0.004}]\n"
    )
    options = {
        "acs": "{axis_names: {X: '0', Y: '1'}}",
        "pmac": "{isx90: 1000, axis_names: {X: X, Y: Y}, confirmed: [pmac-colon]}",
    }
    program = b"G21 G90 G94\nG0 X0 Y0\nG0 X3. Y33.\nM2\n"
    limited = text.replace("limit: {acceleration: 180}", "limit: {acceleration: 180, jerk: 30000}")
    made = process(program, machine(controller, options[controller], text))
    assert made.planned == 1
    assert made.verification.ok
    found = verify(program, made.output, machine(controller, options[controller], limited))
    assert any(violation.kind is Kind.JERK for violation in found.violations)


def test_a_rapid_lasts_as_long_as_its_own_way_does_and_not_as_that_in_counts():
    """40.0001 mm take 125.0003 intervals, the 40 mm that are told in counts 125."""
    text = (
        "interval: 0.004\npositioning: linear\nspindle: mill\ndesign: {max_extension: 0}\naxes:\n"
        "  Y:\n    resolution: 1.0e-5\n    rapid: {velocity: 100, acceleration: 1000}\n"
        "    limit: {velocity: 200, acceleration: 4000}\n"
        "    modes: [{frequency: 9, damping: 0.01}]\n"
    )
    program = b"G21 G90 G94\nG0 Y0.\nG0 Y40.0001\nM2\n"
    made = process(program, machine("csp", "{counts_per_unit: {Y: 4096}}", text))
    assert made.planned == 1
    assert made.plans.counts[1] == 126
    assert made.verification.ok


BOUNDED = """
interval: 0.0005
positioning: linear
spindle: mill
path: {rapid: {acceleration: 691.4}}
axes:
  X:
    resolution: 1.0e-4
    rapid: {velocity: 30, acceleration: 100.6, jerk: 50300}
    limit: {jerk: 503000}
  Z:
    resolution: 1.0e-4
    rapid: {velocity: 31.65, acceleration: 691.4, jerk: 197150}
    limit: {jerk: 1971500}
    modes: [{frequency: 60, damping: 0.01}]
  A:
    wrap: none
    resolution: 1.0e-3
    rapid: {velocity: 300, acceleration: 3000, jerk: 150000}
    limit: {jerk: 600000}
    modes: [{frequency: 27, damping: 0.02, participation: 0.01}]
controller: pmac
controller_options: {isx90: 1, axis_names: {X: X, Z: Z, A: A}, confirmed: [pmac-colon]}
"""


def test_what_bounds_the_path_is_no_limit_of_the_rounding_of_one_axis():
    """X has 52 mm/s^2 of the path's 691; its velocities in steps of 0.01 mm/s make 60 of them."""
    program = b"G21 G90 G94\nG0 X.5 Z2. A0\nG0 X.2853 Z-.8488\nM2\n"
    made = process(program, Machine.loads(BOUNDED))
    assert made.planned == 1
    assert made.verification.ok
    slower = BOUNDED.replace(
        "path: {rapid: {acceleration: 691.4", "path: {rapid: {acceleration: 620"
    )
    found = verify(program, made.output, Machine.loads(slower))
    assert "the path passes its limit of 620 mm, s" in {v.problem for v in found.violations}


def test_what_bounds_the_path_bounds_no_axis_that_turns():
    program = b"G21 G90 G94\nG0 X.5 Z2. A0\nG0 A90.\nM2\n"
    made = process(program, Machine.loads(BOUNDED))
    assert made.planned == 1
    assert made.verification.ok


def test_a_rapid_that_needs_more_time_may_end_between_two_intervals():
    """X needs a tick more than 30 ms in whole ticks; the file allows it 31.8."""
    text = (
        "interval: 0.002\npositioning: independent\nspindle: mill\naxes:\n"
        "  X:\n    resolution: 0.001\n"
        "    rapid: {velocity: 176.4, acceleration: 1062, jerk: 265500}\n"
        "    limit: {jerk: 504450}\n    modes:\n"
        "    - {frequency: 36.48, damping: 0.02, participation: 0.3018}\n"
        "    - {frequency: 14.18, damping: 0, participation: 0.3018}\n"
        "  Y:\n    resolution: 0.001\n"
        "    rapid: {velocity: 50, acceleration: 1388, jerk: 131439.4}\n"
        "    limit: {jerk: 666322}\n"
        "    modes: [{frequency: 49.82, damping: 0.1, participation: 0.5616}]\n"
        "modes: [{frequency: 35.55, damping: 0, participation: {X: 0.5, Y: 0.5}}]\n"
    )
    program = b"G21 G90 G94\nG0 X0. Y0.\nG0 X-.16 Y-.05\nM2\n"
    made = process(program, machine("json", text=text))
    assert made.planned == 1
    assert 0.030 < made.rapids[1].time < 0.0318
    shorter = machine("json", text=text + "design: {max_extension: 0.03}\n")
    found = verify(program, made.output, shorter)
    assert any(violation.kind is Kind.TIME for violation in found.violations)
