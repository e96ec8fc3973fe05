"""Programs that set their control: where the lines stand, what is refused, what verify finds."""

import io
import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gcodejerk import Machine, process, verify
from gcodejerk.cli import app
from gcodejerk.emit import load_controller
from gcodejerk.emit.program_lines import program_lines
from gcodejerk.errors import EmitError, ProgramError
from gcodejerk.machine import ControllerParameter
from gcodejerk.nc import read_program
from gcodejerk.parameters import Moves, tune
from gcodejerk.rewrite.stops import BACK, SET, find_stops
from gcodejerk.verification import Kind

GOLDEN = Path(__file__).parent.parent / "golden"
CONTROLS = ("klipper", "marlin", "rrf", "smoothieware", "twincat")
MACHINES = {name: Machine.load(GOLDEN / f"settings_{name}" / "machine.yaml") for name in CONTROLS}
KLIPPER, TWINCAT = MACHINES["klipper"], MACHINES["twincat"]


def golden(name):
    folder = GOLDEN / f"settings_{name}"
    return (folder / "in.ngc").read_bytes(), (folder / "out.ngc").read_bytes()


def stops_of(program, name="twincat", machine=None):
    """Where lines stand: the number of the line in front, and what."""
    machine = machine or MACHINES[name]
    found = read_program(io.BytesIO(program), dialect=machine.dialect)
    places = find_stops(io.BytesIO(program), found, load_controller(name), machine)
    lines = program.split(b"\n")
    for stop in places[1:]:
        begin = len(b"\n".join(lines[: stop.line])) + bool(stop.line)
        assert stop.offset == min(begin, len(program))
    return [(stop.line, stop.what) for stop in places]


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        (b"G0 X1\nM30\n", [(0, SET), (1, BACK)]),
        (b"G0 X1\nM2", [(0, SET), (1, BACK)]),
        (b"G0 X1", [(0, SET), (1, BACK)]),
        (b"%\nG0 X1\n%\n", [(1, SET), (2, BACK)]),
        (b"G0 X1\nM0\nM30\n", [(0, SET), (1, BACK), (2, SET), (2, BACK)]),
        (b"G0 X1\nG0 Z1 M00\nM30\n", [(0, SET), (1, BACK), (2, SET), (2, BACK)]),
        (b"M0\nM30\n", [(0, SET), (0, BACK), (1, SET), (1, BACK)]),
        (b"/M0\nM30\n", [(0, SET), (0, BACK), (1, SET), (1, BACK)]),
        (b"/M30\nG0 X1\nM30\n", [(0, SET), (0, BACK), (1, SET), (2, BACK)]),
        (b"M5 M30\n", [(0, SET), (0, BACK)]),
        (b"(M0)\nG0 X1 ; M30\nM 3 0\nM0\n", [(0, SET), (2, BACK)]),
        (b"M30\nM0\nGOTO 10\n", [(0, SET), (0, BACK)]),
        (b"#CONTOUR MODE [DEV]\nG130=50\nV.P.A = 2\nM30\n", [(0, SET), (3, BACK)]),
    ],
)
def test_lines_stand_in_front_of_ends_and_around_stops(program, expected):
    assert stops_of(program) == expected
    assert stops_of(program.replace(b"\n", b"\r\n")) == expected


def test_the_number_of_a_program_goes_first_and_a_second_one_is_refused():
    fanuc = replace(TWINCAT, dialect="fanuc")
    program = b"%\nO100\nG0 X1\nM30\nO200\n%\n"
    assert stops_of(program, "twincat", fanuc) == [(2, SET), (3, BACK)]
    with pytest.raises(EmitError, match="O word"):
        stops_of(program.replace(b"M30\n", b""), "twincat", fanuc)


@pytest.mark.parametrize(
    ("program", "expected"),
    [
        (b"G0 X1\nM30\nM84\n", [(0, SET), (3, BACK)]),
        (b"G0 X1\nM117 M0\n", [(0, SET), (2, BACK)]),
        (b"PAUSE\nM600\n", [(0, SET), (0, BACK), (1, SET), (1, BACK), (2, SET), (2, BACK)]),
        (b"N1 M25", [(0, SET), (0, BACK), (1, SET), (1, BACK)]),
    ],
)
def test_a_program_of_a_printer_ends_where_its_file_does(program, expected):
    assert stops_of(program, "klipper") == expected


@pytest.mark.parametrize("name", ["rrf", "smoothieware"])
@pytest.mark.parametrize("line", [b"M5 M0", b"G1 X5 M0", b"N7 M9 M1", b"G91 M226 G90"])
def test_some_firmwares_run_every_command_of_a_line(name, line):
    found = stops_of(b"G0 X1\n" + line + b"\nG0 X2\n", name)
    assert found == [(0, SET), (1, BACK), (2, SET), (3, BACK)]
    assert stops_of(b"G0 X1\nM117 M0\nG0 X2\n", name) == [(0, SET), (3, BACK)]
    for other in (b'M9 M98 P"a.g"', b"G91 G20", b"M5 M500"):
        with pytest.raises(EmitError, match=r":2: "):
            stops_of(b"G0 X1\n" + other + b"\nG0 X2\n", name)


@pytest.mark.parametrize("name", ["rrf", "smoothieware"])
@pytest.mark.parametrize("dialect", ["grbl", "mach", "uccnc"])
@pytest.mark.parametrize("end", [b"", b"M2\n", b"M5 M30\n(more)\n"])
def test_programs_in_dialects_of_mills_are_set_and_proven(name, dialect, end):
    moves = b"G0 X3 Z0 F30000\nG1 X12 F600\nM0\nG0 X60 F30000\nG1 X61 F600\nG0 X10 Z2 F30000\n"
    made = process(b"G21\nG90\n" + moves + end, MACHINES[name], form="parameters", dialect=dialect)
    assert made.verification.ok
    assert made.settings.places == 4
    if end:
        assert b"M204" in made.output[: made.output.index(end)].splitlines()[-1]


@pytest.mark.parametrize("name", ["rrf", "smoothieware"])
def test_a_stop_behind_another_command_is_proven(name):
    program = golden(name)[0] + b"M5 M0\nG0 X7\n"
    made = process(program, MACHINES[name], form="parameters")
    assert made.verification.ok
    lines = made.output.splitlines(keepends=True)
    stop = lines.index(b"M5 M0\n")
    for moved in (lines[: stop - 1] + lines[stop:], lines[: stop + 1] + lines[stop + 2 :]):
        assert not verify(program, b"".join(moved), MACHINES[name]).ok


@pytest.mark.parametrize(
    "line",
    [
        b"GOTO 10", b"IF [#1 EQ 2] GOTO 10", b"M98 P100", b"M99", b"M97 P5", b"M17", b"$IF V.P.A",
        b"$GOTO N10", b"LL sub", b"L CYCLE [NAME=x]", b"o100 while [1]", b"o1 call", b"M#1",
        b"G65 P10", b"M[30]", b"M47", b"G231=50", b"G233 = 100", b"#SET SLOPE PROFIL[2]",
        b"#MACHINE DATA [AX=X]", b'#MSG ["M30"]', b"(half a comment",
    ],
)  # fmt: skip
def test_what_could_skip_a_line_is_refused(line):
    with pytest.raises(EmitError, match=r":2: "):
        stops_of(b"G0 X1\n" + line + b"\nM30\n")


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("klipper", b"START_PRINT BED=60"), ("klipper", b"M204 S500"), ("klipper", b"M808 L2"),
        ("klipper", b"SET_VELOCITY_LIMIT ACCEL=5"), ("klipper", b"SAVE_CONFIG"),
        ("klipper", b"M1234"), ("klipper", b"_UNKNOWN"), ("marlin", b"M500"),
        ("marlin", b"M593 F20"), ("marlin", b"m 204 T100"), ("marlin", b"G20"),
        ("marlin", b"M32 file.g"), ("marlin", b"%"), ("rrf", b'M98 P"a.g"'),
        ("rrf", b"if {move.axes[0].homed}"), ("rrf", b"while true"), ("smoothieware", b"M204 S9"),
    ],
)  # fmt: skip
def test_what_could_skip_a_line_is_refused_in_firmwares(name, line):
    with pytest.raises(EmitError, match=r":2: "):
        stops_of(b"G0 X1\n" + line + b"\nG0 X2\n", name)


def test_a_macro_that_its_owner_has_looked_at_may_stand():
    known = (*KLIPPER.controller_parameters, ControllerParameter("START_PRINT"))
    machine = replace(KLIPPER, controller_parameters=known)
    assert stops_of(b"START_PRINT BED=60\nG0 X1\n", "klipper", machine) == [(0, SET), (2, BACK)]


def test_only_some_controls_can_be_set_from_a_program():
    for name in ("fanuc", "siemens", "linuxcnc", "kalico", "fagor", "csv"):
        with pytest.raises(EmitError, match=r"`gcodejerk (parameters|controllers)"):
            process(b"G0 X1\nM2\n", KLIPPER, controller=name, form="parameters", dialect="linuxcnc")
    with pytest.raises(EmitError, match="expand-cycles"):
        process(b"G0 X1\n", KLIPPER, form="parameters", expand_cycles=True)


def without(machine, *numbers):
    kept = [p for p in machine.controller_parameters if p.number not in numbers]
    return replace(machine, controller_parameters=tuple(kept))


@pytest.mark.parametrize(
    ("missing", "said"),
    [
        (("SHAPER_TYPE",), "number: SHAPER_TYPE, axis: X, old: zv"),
        (("SHAPER_FREQ",), "number: SHAPER_FREQ, axis: X, old: 45}, {number: DAMPING_RATIO"),
        (("DAMPING_RATIO",), "number: DAMPING_RATIO, axis: X, old: 0.1"),
    ],
)
def test_an_old_shaper_that_nobody_states_is_refused(missing, said):
    with pytest.raises(EmitError, match="not known") as error:
        process(golden("klipper")[0], without(KLIPPER, *missing), form="parameters")
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("number", "old"), [("SHAPER_TYPE", "M30"), ("SHAPER_FREQ", "fast"), ("ACCEL", "-4")]
)
def test_an_old_value_that_the_control_does_not_take_is_refused(number, old):
    stated = (ControllerParameter(number, old=old), *without(KLIPPER, number).controller_parameters)
    with pytest.raises(EmitError, match="old is"):
        process(
            golden("klipper")[0], replace(KLIPPER, controller_parameters=stated), form="parameters"
        )


def test_a_stated_old_value_wins():
    stated = ControllerParameter("ACCEL", old="3500")
    machine = replace(KLIPPER, controller_parameters=(stated, *KLIPPER.controller_parameters))
    moves = Moves.of_lengths([10.0, 50.0], machine)
    emitter = load_controller("klipper")
    found = program_lines(emitter, tune(emitter.scheme(machine), moves, machine, curve=False))
    assert found.restore[0] == "SET_VELOCITY_LIMIT ACCEL=3500"
    assert found.prefix[0] != found.restore[0]


def test_nothing_is_inserted_where_nothing_is_gained():
    for program in (b"G21 G90\nM30\n", b"G21\nG90\nG1 X5 F100\n"):
        result = process(program, TWINCAT, form="parameters")
        assert result.output == program
        assert result.settings.places == 0
        assert "left as it is" in "".join(result.notes)


def test_an_axis_that_is_too_slow_to_reach_its_acceleration_is_told_no_more_than_it_may():
    """G231 is of all axes, those too that the program's rapids do not move."""
    machine = Machine.loads(
        """schema: 1
name: slow beside
interval: 0.001
positioning: linear
axes:
  Y:
    resolution: 0.001
    rapid: {velocity: 650.0, acceleration: 3500.0, jerk: 1.2e+6, planner: jerk-limited}
    limit: {acceleration: 7000.0, jerk: 3.7e+6}
    modes: [{frequency: 46.57, damping: 0.002, participation: 0.05}]
  Z:
    resolution: 0.001
    rapid: {velocity: 18.0, acceleration: 6000.0, jerk: 1.4e+6, planner: jerk-limited}
    limit: {acceleration: 6000.0, jerk: 1.4e+7}
    modes: [{frequency: 82.43, damping: 0.004, participation: 0.09}]
"""
    )
    program = b"G21 G90 G94\nG0 Y2 Z3\nG0 Y-3.18\nG1 Y1 F500\nM30\n"
    output = process(program, machine, controller="twincat", form="parameters").output
    told = [float(line[5:]) for line in output.split(b"\n") if line.startswith(b"G231=")]
    assert told, output
    assert max(told) <= 100.0


def test_a_program_that_was_processed_is_refused():
    with pytest.raises(ProgramError, match="processed by gcodejerk before"):
        process(golden("twincat")[1], TWINCAT, form="parameters")


def test_a_byte_order_mark_stays_in_front():
    program = b"\xef\xbb\xbf" + golden("smoothieware")[0].removesuffix(b"\n\n")
    result = process(program, MACHINES["smoothieware"], form="parameters")
    assert result.output.startswith(b"\xef\xbb\xbf; gcodejerk stamp")
    assert not result.output.endswith(b"\n")
    assert result.verification.ok


def damages(name):
    """Each inserted line but those of the stamp: changed, dropped, doubled, moved down."""
    program, output = golden(name)
    lines = output.splitlines(keepends=True)
    kept = program.splitlines(keepends=True)
    inserted, at = [], 0
    for k, line in enumerate(lines):
        if at < len(kept) and line.rstrip() == kept[at].rstrip():
            at += 1
        elif b"gcodejerk" not in line:
            inserted.append(k)
    for k in inserted:
        line = lines[k]
        digit = max(j for j, byte in enumerate(line) if chr(byte).isdigit())
        other = bytes([line[digit] + (1 if line[digit : digit + 1] != b"9" else -1)])
        yield (
            f"{k}: a number",
            [*lines[:k], line[:digit] + other + line[digit + 1 :], *lines[k + 1 :]],
        )
        yield f"{k}: dropped", [*lines[:k], *lines[k + 1 :]]
        yield f"{k}: doubled", [*lines[:k], line, *lines[k:]]
        if k + 1 < len(lines) and lines[k + 1] != line:
            yield f"{k}: moved", [*lines[:k], lines[k + 1], line, *lines[k + 2 :]]
        yield f"{k}: more", [*lines[:k], b"M3 S100\n", *lines[k:]]


@pytest.mark.parametrize("name", CONTROLS)
def test_every_damage_to_an_inserted_line_is_found(name):
    program, output = golden(name)
    machine = MACHINES[name]
    assert verify(program, output, machine).ok
    count = 0
    for what, lines in damages(name):
        damaged = b"".join(lines)
        if damaged == output:
            continue
        found = verify(program, damaged, machine)
        assert not found.ok, what
        count += 1
    assert count > 15


def test_damage_is_found_without_the_sum_of_the_stamp():
    """A number of the old settings that is changed everywhere, and one beyond the limits."""
    program, output = golden("twincat")
    bare = output.replace(output[output.index(b" sum:") :][:21], b"")
    assert verify(program, bare, TWINCAT).ok
    for a, b, said in (
        (b"G231=100", b"G231=101", "goes back to"),
        (b"G231=129", b"G231=900", "beyond"),
        (b"G233=43\n", b"G233=4\n", "beyond"),
        (b"G233=43\n", b"", "as in the original"),
        (b"G231=129", b"G231=1.5", ""),
    ):
        found = verify(program, bare.replace(a, b), TWINCAT)
        assert {v.kind for v in found.violations} <= {Kind.SETTING, Kind.CHANGED}
        assert said in str(found.violations[0].problem)


def test_lines_of_the_program_itself_stay_as_they_are():
    program, output = golden("marlin")
    for a, b in ((b"G1 X12", b"G1 X13"), (b"G90\r\n", b""), (b"M117", b"M118")):
        assert not verify(program, output.replace(a, b), MACHINES["marlin"]).ok
    assert not verify(program, output, KLIPPER).ok


def test_the_commands_write_check_report_and_verify(tmp_path):
    machine = str(GOLDEN / "settings_twincat" / "machine.yaml")
    part, report = tmp_path / "part.nc", tmp_path / "r.json"
    program, output = golden("twincat")
    part.write_bytes(program)
    run = CliRunner().invoke
    options = [str(part), "--machine", machine, "--as", "parameters"]
    checked = run(app, ["process", *options, "--check"])
    assert checked.exit_code == 3
    assert part.read_bytes() == program
    assert b"G231=" in run(app, ["process", *options, "--diff"]).stdout_bytes
    done = run(app, ["process", *options, "--report", str(report)])
    assert "the control is set at 10 places" in done.stdout
    written = tmp_path / "part.jerk.nc"
    assert written.read_bytes() == output
    record = json.loads(report.read_text())
    assert record["as"] == "parameters"
    assert {one["number"]: one["old"] for one in record["settings"]} == {
        "G231": "100", "G233": "100"
    }  # fmt: skip
    found = run(app, ["verify", str(part), str(written), "--machine", machine])
    assert found.exit_code == 0
    assert "set and restored at 10 places" in found.stdout
    assert run(app, ["process", *options, "--in-place"]).exit_code == 0
    assert part.read_bytes() == output
