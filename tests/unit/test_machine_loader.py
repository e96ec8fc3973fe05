import math
import pickle

import pytest

from gcodejerk.errors import MachineError
from gcodejerk.machine import Limits, Machine, MachineFileError, machine_yaml

CONTRACT_EXAMPLE = """\
schema: 1
name: Small vertical machining centre, Z axis of the paper
controller: linuxcnc       # default emitter
dialect: linuxcnc          # how programs are read; default: the controller's own
units: mm                  # of this file
interval: 0.001            # s, the control command interval
positioning: linear        # linear: straight line; independent: each axis on its own (dogleg)
axes:
  Z:
    resolution: 1.0e-4     # mm, the smallest step that is written
    rapid:                 # what the controller's own G0 does today
      {velocity: 600, acceleration: 5000, jerk: 5.0e+5}      # mm/s, mm/s^2, mm/s^3
    limit:                 # what a designed profile may use
      {velocity: 600, acceleration: 5000, jerk: 5.0e+6}
    travel: [-400, 50]     # mm, machine coordinates, optional
    modes:                 # none: the axis is only kept within its limits
      - {name: rocking, frequency: 30, damping: 0.02, participation: 1.0}
      - {name: column, frequency: 90, damping: 0.03, participation: 0.3}
modes: []                  # optional: structure modes that several axes excite together,
design:                    # all optional
  profile: condition3      # see 3
  band: 0.05
  tolerance: 0.001         # mm, residual that counts as settled
  minimum_length: 0.05     # mm, shorter rapids are left alone
  max_extension: 0.10
program:                   # what a program may assume when it starts
  start: {X: 0, Y: 0, Z: 100}
  offsets: {}              # G54.. known offsets, tool lengths: {G54: {X: .., ...}, H1: 87.2}
"""

MILL = """\
interval: 0.001
positioning: linear
axes:
  X:
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
"""
VELOCITY = "axes.X.rapid.velocity"


def problems(text, name="mill.yaml"):
    with pytest.raises(MachineFileError) as caught:
        Machine.loads(text, name)
    return caught.value.problems


def lines(text):
    return [f"{problem.place}: {problem.problem}" for problem in problems(text)]


def the_line(text):
    (line,) = lines(text)
    return line


def with_velocity(value):
    return MILL.replace("velocity: 600", f"velocity: {value}")


def velocity_of(value):
    return Machine.loads(with_velocity(value)).axis("X").rapid.velocity


# What is read


def test_the_example_of_the_contract_is_read_as_it_stands():
    machine = Machine.loads(CONTRACT_EXAMPLE, "vmc.yaml")
    z = machine.axis("Z")
    assert (z.rapid, z.limit) == (Limits(600.0, 5000.0, 5e5), Limits(600.0, 5000.0, 5e6))
    assert (z.resolution, z.travel, z.rotary, z.diameter) == (1e-4, (-400.0, 50.0), False, False)
    assert [mode.frequency for mode in z.modes] == [30.0, 90.0]
    assert machine.program.start == {"X": 0.0, "Y": 0.0, "Z": 100.0}


def test_defaults_of_design_and_program_are_those_of_the_contract():
    machine = Machine.loads(MILL)
    design = machine.design
    assert (design.profile, design.band, design.tolerance) == ("condition3", 0.1, 0.001)
    assert (design.minimum_length, design.max_extension) == (0.05, 0.1)
    assert (machine.program.start, machine.program.offsets) == ({}, {})
    assert (machine.program.tool_lengths, machine.program.startup) == ({}, "")
    assert (machine.controller, machine.dialect, machine.inch) == ("linuxcnc", "linuxcnc", False)


def test_offsets_and_tool_lengths_are_told_apart():
    text = MILL + "program:\n  offsets: {G54: {X: 10}, G59.1: {}, G54.1 P3: {X: 1}, H1: 87.2}\n"
    program = Machine.loads(text).program
    assert program.offsets == {"G54": {"X": 10.0}, "G59.1": {}, "G54.1 P3": {"X": 1.0}}
    assert program.tool_lengths == {1: 87.2}


def test_harmless_codes_are_spelled_as_programs_are_read():
    machine = Machine.loads(MILL + "program: {harmless: [M62, m0150, G187, g10.9, M62]}\n")
    assert machine.program.harmless == ("G10.9", "G187", "M150", "M62")
    assert machine.program_start().harmless == {"G10.9", "G187", "M150", "M62"}
    assert Machine.loads(machine_yaml(machine)).program == machine.program
    assert Machine.loads(MILL).program.harmless == ()
    (found,) = lines(MILL + "program: {harmless: [M62 P1]}\n")
    assert "program.harmless[0] is 'M62 P1', expected a code such as M150 or G187" in found


def test_startup_codes_are_kept_as_written():
    codes = "G17 G21 G40 G49 G54 G64 P0.01 G80 G90 G94"
    assert Machine.loads(MILL + f'program: {{startup: "{codes}"}}\n').program.startup == codes


@pytest.mark.parametrize(
    ("controller", "dialect"),
    [("csv", "linuxcnc"), ("fanuc", "fanuc"), ("grbl", "grbl"), ("our-own", "auto")],
)
def test_dialect_defaults_to_that_of_the_controller(controller, dialect):
    assert Machine.loads(MILL + f"controller: {controller}\n").dialect == dialect


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5e2", 500.0),
        ("5E+2", 500.0),
        ("5.0e+2", 500.0),
        (".5", 0.5),
        ("5.", 5.0),
        ("+5", 5.0),
        ("1_000", 1000.0),
        ("0.5", 0.5),
        ("00.5", 0.5),
    ],
)
def test_a_decimal_number_is_read_however_it_is_written(text, value):
    assert velocity_of(text) == value


def test_a_key_whose_entries_are_all_commented_out_counts_as_left_out():
    machine = Machine.loads(MILL + "    modes:\n      # - {frequency: 30}\nprogram:\ndesign:\n")
    assert machine == Machine.loads(MILL)


def test_rotary_is_the_default_of_a_b_and_c_only():
    text = "interval: 0.001\npositioning: linear\naxes:\n" + "".join(
        f"  {axis}: {{rapid: {{velocity: 1, acceleration: 1}}}}\n" for axis in "WVUCBAZYX"
    )
    machine = Machine.loads(text)
    assert "".join(axis.name for axis in machine.axes if axis.rotary) == "ABC"
    assert "".join(machine.axis_names) == "XYZABCUVW"


def test_an_axis_can_share_another_ones_values_by_alias_and_by_merge_key():
    text = MILL.replace("  X:", "  X: &linear") + (
        "    resolution: 0.01\n  Y: *linear\n  Z:\n    <<: *linear\n    resolution: 0.02\n"
    )
    machine = Machine.loads(text)
    assert machine.axis("Y").rapid == machine.axis("Z").rapid == machine.axis("X").rapid
    assert [axis.resolution for axis in machine.axes] == [0.01, 0.01, 0.02]


def test_crlf_line_ends_and_a_byte_order_mark_are_read(tmp_path):
    path = tmp_path / "mill.yaml"
    path.write_bytes(b"\xef\xbb\xbf" + MILL.replace("\n", "\r\n").encode())
    assert Machine.load(path) == Machine.loads(MILL, "mill.yaml")
    assert Machine.load(path).source == str(path)


def test_lengths_of_an_inch_file_are_converted_once_and_degrees_never():
    text = """\
units: inch
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 1.0e-5
    rapid: {velocity: 10, acceleration: 100, jerk: 1000}
    travel: [-1, 2]
  A:
    rapid: {velocity: 10, acceleration: 100}
    travel: [-1, 2]
design: {tolerance: 0.001}
program: {start: {X: 1, Y: 1, A: 1, C: 1}, offsets: {G54: {X: 1, A: 1}, H1: 1}}
"""
    machine = Machine.loads(text)
    x, a = machine.axes
    assert machine.inch
    assert (x.resolution, x.travel) == (25.4 * 1e-5, (-25.4, 50.8))
    assert x.rapid == Limits(254.0, 2540.0, 25400.0)
    assert x.limit == Limits(254.0, 2540.0, 254000.0)
    assert (a.resolution, a.travel, a.rapid) == (1e-4, (-1.0, 2.0), Limits(10.0, 100.0, math.inf))
    assert (machine.design.tolerance, machine.design.minimum_length) == (0.0254, 0.05)
    assert machine.program.start == {"X": 25.4, "Y": 25.4, "A": 1.0, "C": 1.0}
    assert machine.program.offsets == {"G54": {"X": 25.4, "A": 1.0}}
    assert machine.program.tool_lengths == {1: 25.4}


# What is refused: values


def test_message_shows_place_path_value_unit_line_and_remedy():
    text = MILL.replace("jerk: 5.0e+5", "jerk: fast")
    with pytest.raises(MachineError) as caught:
        Machine.loads(text, "mill.yaml")
    assert str(caught.value) == (
        "mill.yaml:5:54: axes.X.rapid.jerk is 'fast', expected a number above zero [mm/s^3]\n"
        "        rapid: {velocity: 600, acceleration: 5000, jerk: fast}\n"
        "                                                         ^\n"
        "  write a plain decimal number without its unit, for example 5.0e+5"
    )


@pytest.mark.parametrize(
    ("value", "shown", "remedy"),
    [
        ("fast", "'fast'", "plain decimal number"),
        ('"5"', "'5'", "leave the quotes out"),
        ("'5e6'", "'5e6'", "leave the quotes out"),
        ("true", "true", "plain decimal number"),
        (".nan", ".nan", "write the number"),
        (".inf", ".inf", "leave the key out"),
        ("1e999", "1e999", "a number that a machine can have"),
        ("-600", "-600", "for example velocity: 600"),
        ("0", "0", "for example velocity: 600"),
        ("5 mm", "'5 mm'", "without its unit"),
        ("0600", "0600", "leading zero"),
        ("0x10", "0x10", "plain decimal number"),
        ("1:30", "1:30", "plain decimal number"),
        ("\u0665", "'\u0665'", "plain decimal number"),
        ("2001-01-01", "2001-01-01", "plain decimal number"),
        ("[600]", "[600]", "for example velocity: 600"),
        ("{a: 1}", "a mapping", "for example velocity: 600"),
        ("", "empty", "write the number after the colon"),
    ],
)
def test_what_is_not_a_number_above_zero_is_refused(value, shown, remedy):
    (problem,) = problems(with_velocity(value))
    assert problem.problem == f"{VELOCITY} is {shown}, expected a number above zero [mm/s]"
    assert (problem.place.line, problem.place.column) == (5, 23)
    assert remedy in problem.remedy


def test_a_decimal_comma_is_recognised():
    text = MILL.replace("{velocity: 600, ", "\n      velocity: 1,5\n      ").replace(
        "acceleration: 5000, jerk: 5.0e+5}", "acceleration: 5000"
    )
    (problem,) = problems(text)
    assert str(problem.place) == "mill.yaml:6:17"
    assert problem.remedy == "write a decimal point"


def test_a_number_beyond_all_machines_is_taken_for_a_slip():
    assert the_line(with_velocity("1e20")) == (
        f"mill.yaml:5:23: {VELOCITY} is 1e20, expected at most 1e+15 [mm/s]"
    )
    assert the_line(with_velocity("1e-12")) == (
        f"mill.yaml:5:23: {VELOCITY} is 1e-12, expected at least 1e-09 [mm/s]"
    )
    assert the_line(MILL.replace("0.001", "5")) == (
        "mill.yaml:1:11: interval is 5, expected at most 1 [s]"
    )


def test_units_in_messages_are_those_of_the_file_and_the_axis():
    inch = the_line("units: inch\n" + with_velocity("-1"))
    assert inch.endswith("expected a number above zero [inch/s]")
    rotary = the_line(with_velocity("-1").replace("X:", "A:"))
    assert rotary.endswith("axes.A.rapid.velocity is -1, expected a number above zero [deg/s]")


@pytest.mark.parametrize(
    ("extra", "line"),
    [
        (
            "    travel: [5, -5]\n",
            "6:13: axes.X.travel is [5, -5], expected a list of two numbers, the lower first [mm]",
        ),
        (
            "    travel: [5, 5]\n",
            "6:13: axes.X.travel is [5, 5], expected a list of two numbers, the lower first [mm]",
        ),
        (
            "    travel: 5\n",
            "6:13: axes.X.travel is 5, expected a list of two numbers, the lower first [mm]",
        ),
        ("    travel: [0, .inf]\n", "6:17: axes.X.travel[1] is .inf, expected a number [mm]"),
        (
            "    modes: [{frequency: 0}]\n",
            "6:25: axes.X.modes[0].frequency is 0, expected a number above zero [Hz]",
        ),
        (
            "    modes: [{frequency: 30}, {frequency: 500}]\n",
            "6:42: axes.X.modes[1].frequency is 500, expected a number below 500 [Hz], "
            "half the sampling rate 1/interval",
        ),
        (
            "    modes: [{frequency: 30, damping: 1}]\n",
            "6:38: axes.X.modes[0].damping is 1, expected a number of at least 0 and below 1 [-]",
        ),
        (
            "    modes: [{frequency: 30, damping: -0.1}]\n",
            "6:38: axes.X.modes[0].damping is -0.1, "
            "expected a number of at least 0 and below 1 [-]",
        ),
        (
            "    modes: [{frequency: 30, participation: -1}]\n",
            "6:44: axes.X.modes[0].participation is -1, expected a number of at least 0 [-]",
        ),
        (
            "    modes: [{damping: 0.02}]\n",
            "6:13: axes.X.modes[0].frequency is missing, expected a number above zero [Hz]",
        ),
        (
            "    modes: {frequency: 30}\n",
            "6:12: axes.X.modes is a mapping, expected a list of at most 100 entries, "
            "each in braces or after a dash",
        ),
        (
            "    type: rotary\n",
            "6:11: axes.X.type is 'rotary', expected linear: X is measured in mm",
        ),
        (
            "  A: {rapid: {velocity: 9, acceleration: 90}, modes: [{frequency: 30}]}\n",
            "6:55: axes.A.modes[0] has no participation, but A is a rotary axis: 1 would be 1 mm "
            "at the tool for each degree",
        ),
        ("    type: rotory\n", "6:11: axes.X.type is 'rotory', expected one of linear, rotary"),
        ("    diameter: perhaps\n", "6:15: axes.X.diameter is 'perhaps', expected true or false"),
        (
            "modes: [{frequency: 9, participation: {X: 1, Y: 1}}]\n",
            "6:46: modes[0].participation.Y is about axis Y, which the machine does not have; "
            "it has X",
        ),
        (
            "modes: [{frequency: 9}]\n",
            "6:9: modes[0].participation is missing, expected a mapping",
        ),
        (
            "modes: [{frequency: 9, participation: 1}]\n",
            "6:39: modes[0].participation is 1, expected a mapping; its keys: "
            "an axis: X, Y, Z, A, B, C, U, V, W",
        ),
        ("schema: 2\n", "6:9: schema is 2, expected 1"),
        ("units: inches\n", "6:8: units is 'inches', expected one of mm, inch"),
        ("name: ''\n", "6:7: name is '', expected a name of at most 200 characters"),
        ('name: "a\\nb"\n', "6:7: name is 'a\\nb', expected a name of at most 200 characters"),
        (
            "controller: Linux CNC\n",
            "6:13: controller is 'Linux CNC', expected a name in lower case",
        ),
        (
            "design: {band: 1}\n",
            "6:16: design.band is 1, expected a number of at least 0 and below 1 [-]",
        ),
        (
            "design: {tolerance: 0}\n",
            "6:21: design.tolerance is 0, expected a number above zero [mm]",
        ),
        (
            "program: {startup: 'do it'}\n",
            "6:20: program.startup is 'do it', expected G-code words",
        ),
        (
            "program: {offsets: {H1: {X: 1}}}\n",
            "6:25: program.offsets.H1 is a mapping, expected a number [mm]",
        ),
    ],
)  # fmt: skip
def test_a_wrong_value_is_refused_at_its_place(extra, line):
    assert the_line(MILL + extra) == f"mill.yaml:{line}"


def test_a_mode_just_below_half_the_sampling_rate_is_accepted():
    machine = Machine.loads(MILL + "    modes: [{frequency: 499.999}]\n")
    assert machine.axis("X").modes[0].damping == 0.0


def test_a_diameter_is_only_x_s():
    text = MILL.replace("X:", "Z:") + "    diameter: true\n"
    assert the_line(text).startswith("mill.yaml:6:15: axes.Z.diameter is true")
    assert Machine.loads(MILL + "    diameter: true\n").axis("X").diameter


def test_an_unknown_profile_is_refused_with_the_nearest():
    (problem,) = problems(MILL + "design: {profile: condition4}\n")
    assert problem.problem.startswith(
        "design.profile is 'condition4', expected one of conventional"
    )
    assert problem.remedy in {f"did you mean 'condition{n}'?" for n in (1, 2, 3)}


# What is refused: keys


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "    rapid",
            "    limt: {}\n    rapid",
            "5:5: axes.X.limt is not a known key, the nearest known key is 'limit'",
        ),
        (
            "  X:",
            "  x:",
            "4:3: axes.x is not a known key, the nearest known key is 'X'",
        ),
        (
            "positioning",
            "positionning",
            "2:1: positionning is not a known key, the nearest known key is 'positioning'",
        ),
        (
            "velocity",
            "velocitiy",
            "5:13: axes.X.rapid.velocitiy is not a known key, the nearest known key is 'velocity'",
        ),
        ("interval", "qqq: 1\ninterval", "1:1: qqq is not a known key"),
        (
            "interval",
            "program: {offsets: {G60: {}}}\ninterval",
            "1:21: program.offsets.G60 is not a known key, the nearest known key is 'G59'",
        ),
    ],
)
def test_an_unknown_key_is_refused_with_the_nearest_known_one(old, new, line):
    (problem,) = problems(MILL.replace(old, new, 1))
    start = f"mill.yaml:{line}"
    text = f"{problem.place}: {problem.problem}"
    # G54 to G59 are as near to G60 as one another.
    assert text == start or ("G60" in text and text[:-2] == start[:-2])
    assert problem.remedy.startswith(("known keys: ", "expected "))


def test_a_key_given_twice_is_refused_with_both_places():
    assert the_line(MILL + "interval: 0.002\n") == (
        "mill.yaml:6:1: interval is given twice, first at mill.yaml:1:1"
    )
    twice = MILL.replace("velocity: 600,", "velocity: 600, velocity: 500,")
    assert the_line(twice) == (
        "mill.yaml:5:28: axes.X.rapid.velocity is given twice, first at mill.yaml:5:13"
    )


def test_a_key_that_is_not_a_word_is_refused():
    assert the_line(MILL + "? [a, b]\n: 1\n") == "mill.yaml:6:3: a key of the file is not a word"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            MILL.replace("interval: 0.001\n", ""),
            "1:1: interval is missing, expected a number above zero [s]",
        ),
        (
            MILL.replace("positioning: linear\n", ""),
            "1:1: positioning is missing, expected one of linear, independent",
        ),
        (MILL[: MILL.index("axes")], "1:1: axes is missing, expected a mapping"),
        (
            MILL[: MILL.index("  X")] + "  {}\n",
            "4:3: axes is an empty mapping, expected at least one key: "
            "an axis: X, Y, Z, A, B, C, U, V, W",
        ),
        (
            MILL.replace("rapid: {velocity: 600, ", "rapid: {"),
            "5:12: axes.X.rapid.velocity is missing, expected a number above zero [mm/s]",
        ),
        (
            MILL[: MILL.index("    rapid")],
            "4:5: axes.X is empty, expected a mapping with the keys "
            "type, wrap, diameter, resolution, rapid, limit, travel, modes, spectrum, servo",
        ),
    ],
)
def test_a_missing_key_is_named_with_what_it_should_hold(text, line):
    assert the_line(text) == f"mill.yaml:{line}"


def test_everything_that_is_wrong_is_shown_at_once_in_the_order_of_the_file():
    text = MILL.replace("0.001", ".nan").replace("600", "-600") + "travle: 3\nmodes: 4\n"
    with pytest.raises(MachineFileError) as caught:
        Machine.loads(text, "mill.yaml")
    error = caught.value
    assert [problem.place.line for problem in error.problems] == [1, 5, 6, 7]
    assert error.place == error.problems[0].place
    assert str(error) == "\n".join(str(problem) for problem in error.problems)


def test_error_crosses_a_process_border():
    with pytest.raises(MachineFileError) as caught:
        Machine.loads("interval: 1", "mill.yaml")
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_a_rotary_axis_says_what_its_spectrum_moves(tmp_path):
    (tmp_path / "a.csv").write_text("".join(f"{f},1\n" for f in range(10, 30)))
    text = MILL.replace("  X:", "  A:") + "    spectrum: %s\n"
    with pytest.raises(MachineFileError) as refused:
        Machine.loads(text % "a.csv", str(tmp_path / "m.yaml"))
    assert "axes.A.spectrum has no participation, but A is a rotary" in str(refused.value)
    stated = text % "{file: a.csv, participation: 1.75}"
    assert Machine.loads(stated, str(tmp_path / "m.yaml")).axis("A").spectrum.participation == 1.75
