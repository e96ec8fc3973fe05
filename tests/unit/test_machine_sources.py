"""Configurations of controls as machine files: what they say, and what they do not."""

import math
import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gcodejerk.errors import GcodejerkError, MachineError
from gcodejerk.machine import Machine
from gcodejerk.machine.sources import draft_of, recognise, stated_axis, stated_mode, text_of
from gcodejerk.machine.sources.draft import Draft
from gcodejerk.machine.sources.quantity import quantity

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs/sim")

INI = """\
[EMC]
MACHINE = Bench mill
[TRAJ]
COORDINATES = XYYZA
LINEAR_UNITS = inch
MAX_LINEAR_VELOCITY = 3.0
[KINS]
KINEMATICS = trivkins coordinates=XYYZA kinstype=BOTH
[EMCMOT]
BASE_PERIOD = 30000
SERVO_PERIOD = 1000000
[HAL]
HALFILE = core.hal
HALFILE = LIB:basic_sim.tcl
[RS274NGC]
RS274NGC_STARTUP_CODE = G17 G20 G40
[AXIS_X]
MIN_LIMIT = -10.0
MAX_LIMIT = 10
MAX_VELOCITY = 2.0  # tested
MAX_ACCELERATION = 20
[AXIS_Y]
MAX_VELOCITY = 5.0
MAX_ACCELERATION = 20
#INCLUDE z.inc
[AXIS_A]
MAX_VELOCITY = 90
MAX_ACCELERATION = 400
WRAPPED_ROTARY = 1
"""
Z = "[AXIS_Z]\nMAX_VELOCITY = 1\nMAX_ACCELERATION = 10\nMIN_LIMIT = -4\nMAX_LIMIT = 0.01\n"
HAL = """\
# loadrt motmod base_period_nsec=1
loadrt [EMCMOT]EMCMOT base_period_nsec=[EMCMOT]BASE_PERIOD servo_period_nsec=[EMCMOT]SERVO_PERIOD
setp ini.z.max_acceleration 12
"""
DUMP = """\
Grbl 1.1h ['$' for help]
>>> $$
[MSG:'$H'|'$X' to unlock]
$13=1
$32=1
$100=250.000 (x, step/mm)
$110=5000.000 (x max rate, mm/min)
$111=6000
$112=500.000
$120=300.000
$121=250
$122=50.000
$130=300.000
ok
"""
FLUIDNC = """\
name: "Router"
axes:
  x:
    steps_per_mm: 80
    max_rate_mm_per_min: 6000
    acceleration_mm_per_sec2: 400
    max_travel_mm: 300
    homing: {mpos_mm: 5, positive_direction: false}
  Z:
    max_rate_mm_per_min: 1200
    acceleration_mm_per_sec2: 100
Laser:
  pwm_hz: 5000
"""
PRINTER = """\
[include axes.cfg]
[printer]
kinematics: corexy
max_velocity: 300   # mm/s
max_accel = 3000
max_z_velocity: 15
max_z_accel: 100
[stepper_x]
position_max: 235
[gcode_macro START]
gcode:
    G28
    M104 S{params.T|default(200)}
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
#*# [input_shaper]
#*# shaper_type_x = ei
#*# shaper_freq_x = 52.6
"""
M503 = """\
Recv: echo:; Maximum feedrates (units/s):
echo:  M203 X500.00 Y400.00 Z5.00 E25.00
echo:; Maximum Acceleration (units/s2):
echo:  M201 X500.00 Y1500.00 Z100.00 E5000.00
echo:; Acceleration (units/s2) (P<print-accel> R<retract-accel> T<travel-accel>):
echo:  M204 P500.00 R500.00 T1000.00
echo:  G21    ; Units in mm
"""
CONFIG_G = """\
M550 P"Workbee" ; name
M203 X6000 Y6000 Z600 ; mm/min
M201 X800.00 Y700 Z100
M204 P1000 T600
M208 X0 Y0 Z-60 S1
M208 X750:760 Y700 Z0 S0
M593 P"ei2" F40.5 S0.05
"""
PUNCHED = """\
%
N01020A1P88A2P90
N01401P00000000
N01420 A1 P24000 A2 P18000
N1620A1P100A2P90
N01621 A1 P32 A2 P16
N01320A1P250.0A2P99999999
N01321A1P-10.0A2P-99999999
N14200A1P1
%
"""
SPECTRUM = "freq,psd_x,psd_y,psd_z,psd_xyz\n" + "".join(
    f"{f},{1 + (f == 40) * 50},0,0,{1 + (f == 40) * 50}\n" for f in range(0, 120, 4)
)


def machine(folder, text, name="config", **others):
    """The machine file of a configuration, read again, and its text."""
    for other, content in others.items():
        (folder / other.replace("__", ".")).write_text(content)
    (folder / name).write_text(text)
    draft = draft_of([str(folder / name)], folder)
    draft.settle()
    written = text_of(draft)
    return Machine.loads(written, str(folder / "new.yaml")), written, draft


def test_a_linuxcnc_ini(tmp_path):
    made, text, draft = machine(tmp_path, INI, "mill.ini", z__inc=Z, core__hal=HAL)
    assert (made.name, made.controller, "".join(made.axis_names)) == (
        "Bench mill",
        "linuxcnc",
        "XYZA",
    )
    x, y, z, a = made.axes
    assert (x.rapid.velocity, x.rapid.acceleration) == (50.8, 508.0)
    assert y.rapid.velocity == pytest.approx(76.2)  # by MAX_LINEAR_VELOCITY
    assert z.rapid.acceleration == pytest.approx(12 * 25.4)  # by HAL
    assert (a.rapid.velocity, a.wrap) == (90.0, "sign")
    assert x.travel == (-254.0, 254.0)
    assert y.travel is None
    assert x.planner == "linuxcnc-2.9"
    assert x.limit.acceleration * 1.05 == pytest.approx(508.0)
    # 33 base periods: what LinuxCNC's threads really run at.
    assert made.interval == pytest.approx(0.00099, rel=1e-9)
    assert made.program.startup == "G17 G20 G40"
    assert "MAX_VELOCITY = 2.0 inch (mill.ini:20)" in text
    assert any("halcmd show thread" in note for note in draft.notes)
    assert made.path.rapid.velocity == made.path.limit.velocity == pytest.approx(76.2)
    assert math.isinf(made.path.limit.acceleration)
    assert not made.warnings


def test_files_that_an_ini_names_and_are_not_there_are_said(tmp_path):
    with pytest.raises(MachineError, match=r"velocity of Z.*acceleration of Z") as refused:
        machine(tmp_path, INI, "mill.ini")
    assert "--axis 'Z" in refused.value.remedy
    draft = draft_of([str(tmp_path / "mill.ini")], tmp_path)
    said = " ".join(draft.notes)
    assert "mill.ini:25: z.inc was not found" in said
    assert "core.hal was not found" in said


def test_an_ini_that_includes_itself(tmp_path):
    with pytest.raises(MachineError, match="files deep"):
        machine(tmp_path, INI, "mill.ini", z__inc="#INCLUDE z.inc\n")


@pytest.mark.skipif(shutil.which("inivar") is None, reason="inivar (linuxcnc-uspace) is absent")
@pytest.mark.linuxcnc
@pytest.mark.parametrize(
    "name", ["axis/axis_mm.ini", "axis/axis_9axis.ini", "axis/lathe.ini", "touchy/touchy.ini",
             "axis/wrapped_rotary/wrapped_rotary.ini", "gmoccapy/gmoccapy_4_axis.ini"],
)  # fmt: skip
def test_against_linuxcncs_own_reader_of_inis(name):
    path = SAMPLES / name
    if not path.exists():
        pytest.skip(f"{path} is absent")

    def value(section, key):
        call = ["inivar", "-ini", str(path), "-sec", section, "-var", key]
        done = subprocess.run(call, capture_output=True, text=True, check=False)
        return done.stdout.split()[0] if done.stdout.split() else None

    draft = draft_of([str(path)], path.parent)
    draft.settle()
    made = Machine.loads(text_of(draft))
    inch = value("TRAJ", "LINEAR_UNITS") == "inch"
    cap = float(value("TRAJ", "MAX_LINEAR_VELOCITY") or math.inf) * (25.4 if inch else 1.0)
    for axis in made.axes:
        unit = 25.4 if inch and not axis.rotary else 1.0
        speed = float(value(f"AXIS_{axis.name}", "MAX_VELOCITY")) * unit
        assert axis.rapid.velocity == pytest.approx(speed if axis.rotary else min(speed, cap))
        acceleration = float(value(f"AXIS_{axis.name}", "MAX_ACCELERATION")) * unit
        assert axis.rapid.acceleration == pytest.approx(acceleration)


def test_a_grbl_dump_with_noise(tmp_path):
    made, text, _ = machine(tmp_path, DUMP, "dump.txt")
    assert (made.controller, made.spindle) == ("grbl", "laser")
    x, y, z = made.axes
    assert x.rapid.velocity == pytest.approx(5000 / 60)
    assert (y.rapid.acceleration, z.rapid.acceleration) == (250.0, 50.0)
    assert (x.travel, y.travel) == ((-300.0, 0.0), None)
    assert x.planner == "trapezoidal"
    assert "$110=5000.000 (dump.txt:7)" in text


def test_a_spindle_that_nobody_named_stays_unknown(tmp_path):
    made, _, draft = machine(tmp_path, DUMP.replace("$32=1", "$32=0"), "dump.txt")
    assert made.spindle is None
    assert any("spindle: mill" in note for note in draft.notes)


def test_grblhal_has_jerks(tmp_path):
    made, *_ = machine(tmp_path, DUMP + "$800=5000\n$801=4000\n$802=900\n", "dump.txt")
    assert made.controller == "grblhal"
    assert [axis.rapid.jerk for axis in made.axes] == [5000.0, 4000.0, 900.0]
    assert made.planner == "jerk-limited"


def test_fluidnc(tmp_path):
    made, *_ = machine(tmp_path, FLUIDNC, "config.yaml")
    x, z = made.axes
    assert (made.name, made.controller, made.spindle) == ("Router", "fluidnc", "laser")
    assert (x.rapid.velocity, x.rapid.acceleration, x.travel) == (100.0, 400.0, (5.0, 305.0))
    assert z.rapid.velocity == 20.0


def test_klipper_with_an_include_and_a_saved_block(tmp_path):
    more = "[stepper_y]\nposition_min: -5\nposition_max: 220\n[printer]\nmax_accel: 1\n"
    made, _, draft = machine(tmp_path, PRINTER, "printer.cfg", axes__cfg=more)
    x, y, z = made.axes
    assert (made.controller, x.rapid.velocity, x.rapid.acceleration) == ("klipper", 300.0, 3000.0)
    assert (z.rapid.velocity, z.rapid.acceleration) == (15.0, 100.0)
    assert (x.travel, y.travel) == ((0.0, 235.0), (-5.0, 220.0))
    assert any("X ei at 52.6 Hz" in note for note in draft.notes)


def test_spectra_beside_a_configuration(tmp_path):
    (tmp_path / "resonances_x_20260101.csv").write_text(SPECTRUM)
    (tmp_path / "printer.cfg").write_text(PRINTER.replace("[include axes.cfg]\n", ""))
    files = [str(tmp_path / name) for name in ("printer.cfg", "resonances_x_20260101.csv")]
    draft = draft_of(files, tmp_path)
    draft.settle()
    made = Machine.loads(text_of(draft), str(tmp_path / "new.yaml"))
    assert made.axis("X").spectrum.peak == 40.0
    assert "resonances_x_20260101.csv" in text_of(draft)


def test_marlin(tmp_path):
    made, *_ = machine(tmp_path, M503, "m503.txt")
    x, y, z = made.axes
    assert (made.controller, x.rapid.velocity, x.rapid.acceleration) == ("marlin", 500.0, 500.0)
    assert (y.rapid.acceleration, z.rapid.acceleration) == (1000.0, 100.0)  # by M204 T


def test_marlin_in_inches_is_refused(tmp_path):
    with pytest.raises(MachineError, match="in inches"):
        machine(tmp_path, M503.replace("G21", "G20"), "m503.txt")


def test_reprapfirmware(tmp_path):
    made, *_ = machine(tmp_path, CONFIG_G, "config.g")
    x, _, z = made.axes
    assert (made.controller, x.rapid.velocity, x.rapid.acceleration) == ("rrf", 100.0, 600.0)
    assert (x.travel, z.travel) == ((750.0, 760.0), (-60.0, 0.0))
    assert (x.filter.kind, x.filter.frequency, x.filter.damping) == ("ei2", 40.5, 0.05)


def test_fanuc_parameters_as_punched(tmp_path):
    made, *_ = machine(tmp_path, PUNCHED, "cnc-para.txt")
    x, z = made.axes
    assert (made.controller, made.positioning) == ("fanuc", "independent")
    assert (x.rapid.velocity, x.rapid.acceleration) == (400.0, 4000.0)
    assert (z.name, z.rapid.velocity) == ("Z", 300.0)
    assert dict(z.law)["second_average"] == 0.016
    assert (x.travel, z.travel) == ((-10.0, 250.0), None)


def test_fanuc_parameters_as_typed(tmp_path):
    text = "1420: X=24000 Y=24000\n1620 X100 Y100\n1401 00000010\n"
    made, written, _ = machine(tmp_path, text, "p.txt")
    assert (made.positioning, made.axis("Y").rapid.acceleration) == ("linear", 4000.0)
    assert "ASSUMED: no 1621 in the list" in written


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("G0 X1\nM2\n", "no configuration"),
        ("", "no configuration"),
        ("\x00\x01binary", "no configuration"),
        ("interval: 0.001\npositioning: linear\naxes: {}\n", "machine file already"),
        ("[TRAJ]\nCOORDINATES = X\n[AXIS_X]\nMAX_VELOCITY = 1\n", "LINEAR_UNITS is missing"),
        (INI.replace("= 2.0", "= fast"), "MAX_VELOCITY is 'fast"),
        (INI.replace("= inch", "= yard"), "LINEAR_UNITS is 'yard'"),
        (INI.replace("MAX_VELOCITY = 2.0", "MAX_VELOCITY = 0"), "expected a number above 0"),
        (PRINTER.replace("max_accel = 3000", "max_accel = {x}"), "max_accel is '{x}'"),
        ("[printer\n[stepper_x]\nnonsense\n", "not as Klipper reads it"),
        (FLUIDNC.replace("6000", "quick"), "is 'quick'"),
        ("axes:\n  x: {max_rate_mm_per_min: 1\n", "no YAML"),
        ("1420 24000\n", "names no axis"),
        ("1420 X24000\n", "acceleration of X"),
        (CONFIG_G.replace("X6000", "X6:0:0"), "X of M203 is '6:0:0'"),
    ],
)
def test_what_is_refused(tmp_path, text, expected):
    with pytest.raises(GcodejerkError, match=expected):
        machine(tmp_path, text, "config", z__inc=Z)


def test_two_configurations_are_no_machine(tmp_path):
    (tmp_path / "a.txt").write_text(DUMP)
    (tmp_path / "b.txt").write_text(M503)
    with pytest.raises(MachineError, match="two configurations"):
        draft_of([str(tmp_path / "a.txt"), str(tmp_path / "b.txt")], tmp_path)


@pytest.mark.parametrize("name", ["missing.ini", ".", "large"])
def test_files_that_cannot_be_read(tmp_path, name):
    (tmp_path / "large").write_bytes(b"[EMC]\n" * (1 << 20))
    with pytest.raises(MachineError, match=r"no such file|is a folder|larger"):
        draft_of([str(tmp_path / name)], tmp_path)


def test_other_encodings_and_line_ends(tmp_path):
    (tmp_path / "d.txt").write_bytes(DUMP.replace("\n", "\r\n").encode("utf-16"))
    assert draft_of([str(tmp_path / "d.txt")], tmp_path).controller == "grbl"


@pytest.mark.parametrize(
    ("text", "kind", "expected"),
    [
        ("36 m/min", "velocity", 600.0),
        ("36000mm/min", "velocity", 600.0),
        ("1417.3228346 ipm", "velocity", 600.0),
        ("0.5g", "acceleration", 4903.325),
        ("5 m/s2", "acceleration", 5000.0),
        ("5 m/s²", "acceleration", 5000.0),
        ("50 m/s^3", "jerk", 50000.0),
        ("-2 in", "length", -50.8),
        ("7", "length", 7.0),
        ("0.5 ms", "time", 0.0005),
    ],
)
def test_quantities(text, kind, expected):
    assert quantity(text, kind, "it") == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("text", ["", "fast", "36", "36 km/h", "1e999 mm/s", "1 2 mm/s"])
def test_speeds_without_a_unit_are_not_guessed(text):
    with pytest.raises(MachineError, match=r"unit|expected"):
        quantity(text, "velocity", "it")


@pytest.mark.parametrize(
    "words",
    ["X speed=1m/s", "X velocity", "Q velocity=1m/s", "", "X travel=5:1", "X travel=5",
     "X velocity=-1m/s", "X 'velocity=1m/s", "C velocity=1m/s", "X wrap=often"],
)  # fmt: skip
def test_words_of_an_axis_that_are_refused(words):
    with pytest.raises(MachineError):
        stated_axis(Draft(""), words)


numbers = st.floats(1e-3, 1e5)


@settings(max_examples=40)
@given(
    st.dictionaries(st.sampled_from("XYZABCUVW"), st.tuples(numbers, numbers, numbers), min_size=1),
    st.text(max_size=30), st.floats(2.0, 200.0), st.text("\x00\n#:'\"{}[]*&!%@`ab", max_size=12),
)  # fmt: skip
def test_whatever_is_drafted_is_read_back(axes, name, frequency, origin):
    draft = Draft("", name=name)
    for letter, (speed, acceleration, jerk) in axes.items():
        unit = "deg" if letter in "ABC" else "mm"
        stated_axis(
            draft,
            f"{letter} velocity={speed!r}{unit}/s acceleration={acceleration!r}{unit}/s^2 "
            f"jerk={jerk!r}{unit}/s^3",
        )
        stated_mode(draft, f"{letter} frequency={frequency!r}")
    draft.notes.append(origin)
    draft.settle()
    made = Machine.loads(text_of(draft))
    for letter, (speed, acceleration, _) in axes.items():
        assert made.axis(letter).rapid.velocity == pytest.approx(speed, rel=1e-8)
        assert made.axis(letter).rapid.acceleration == pytest.approx(acceleration, rel=1e-8)
        assert made.axis(letter).modes[0].frequency == pytest.approx(frequency, rel=1e-8)


@settings(max_examples=100)
@given(st.text(max_size=200))
def test_no_text_is_too_strange_to_be_told_apart(text):
    assert recognise(text) in {
        "", "linuxcnc", "klipper", "fluidnc", "grbl", "marlin", "fanuc", "machine", "spectrum",
    }  # fmt: skip
