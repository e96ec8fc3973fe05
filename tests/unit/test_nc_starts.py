"""What the machine file says of places: home, tool changes, work offsets; and of M codes.

The second reading has to confirm every rapid that is certain.
"""

import io
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk import Machine, process
from gcodejerk.machine.file.writer import machine_yaml
from gcodejerk.nc import Start, read_program
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

OFFSETS = {
    "G54": {"X": -100.0, "Y": -50.0, "Z": -200.0},
    "G55": {"X": 30.0, "Y": 20.0, "Z": -180.0},
}
HOME = {"X": 0.0, "Y": 0.0, "Z": 0.0}
STARTUP = "G17 G21 G90 G94 G40"
FRAME = "coordinate frame changes in the block"
UNKNOWN = "start unknown"


def read(text, dialect, **more):
    """What each rapid is left alone for, None where it is certain; and where it starts and ends."""
    facts = {"startup": STARTUP, "decimal_point": "calculator", "spindle": "mill", **more}
    start = Start(**facts)
    program = read_program(io.BytesIO(text), dialect=dialect, start=start)
    rapids = program.rapids
    reason = rapids.reason.tolist()
    sure = [i for i, r in enumerate(reason) if r == CERTAIN]
    found = Findings(9)
    confirmed = confirm(io.BytesIO(text), dialect, start, rapids, sure, found)
    assert not found.violations
    assert confirmed == len(sure)
    return [None if r == CERTAIN else str(REASONS[r]) for r in reason], rapids


# --- home ---


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "linuxcnc", "grbl", "mach"])
def test_behind_g28_the_axes_are_at_home(dialect):
    text, startup = b"G28 X0. Y0.\nG0 X1. Y2.\n", f"{STARTUP} G0"
    why, rapids = read(text, dialect, offsets=OFFSETS, home=HOME, startup=startup)
    assert why == [FRAME, None]
    np.testing.assert_allclose(rapids.start[1, :2], (100.0, 50.0))


@pytest.mark.parametrize(
    ("dialect", "known"), [("haas", True), ("linuxcnc", True), ("fanuc", False)]
)
def test_g28_alone_moves_all_axes_where_that_is_known(dialect, known):
    why, _ = read(b"G28\nG0 X1. Y2. Z3.\n", dialect, offsets=OFFSETS, home=HOME)
    assert why[-1] == (None if known else UNKNOWN)


@pytest.mark.parametrize(
    "more", [{"offsets": OFFSETS}, {"home": HOME}, {"offsets": {"G55": {"X": 1.0}}, "home": HOME}]
)
def test_home_has_no_name_without_its_offset(more):
    why, _ = read(b"G28 X0. Y0.\nG0 X1. Y2.\n", "fanuc", **more)
    assert why == [FRAME, UNKNOWN]


@pytest.mark.parametrize("spoils", [b"G28.1\n", b"#5161=30\n", b"#5162=#1\n"])
def test_home_is_unknown_once_the_program_has_stored_another(spoils):
    text = b"G0 X5 Y5 Z5\n" + spoils + b"G28 X0 Y0\nG54\nG0 X1 Y2\n"
    why, _ = read(text, "linuxcnc", offsets=OFFSETS, home=HOME, positions=HOME)
    assert why == [None, FRAME, UNKNOWN]


@pytest.mark.parametrize("line", [b"G30 X0. Y0.\n", b"G27 X0. Y0.\n"])
def test_other_stored_points_are_not_home(line):
    why, _ = read(line + b"G0 X1. Y2.\n", "fanuc", offsets=OFFSETS, home=HOME)
    assert why[-1] == UNKNOWN


def test_an_unknown_tool_length_hides_z_behind_g28_alone():
    text = b"G0 X5. Y5. Z5.\nG43 H7\nG28 X0. Y0. Z0.\nG0 X1. Y1.\nZ3.\n"
    facts = {"offsets": OFFSETS, "home": HOME, "positions": HOME}
    assert read(text, "haas", **facts)[0] == [None, FRAME, None, UNKNOWN]


def test_a_rotation_hides_home():
    text = b"G0 X5. Y5.\nG68 X0. Y0. R30.\nG28 X0. Y0.\nG69\nG0 X1. Y1.\n"
    assert read(text, "fanuc", offsets=OFFSETS, home=HOME, positions=HOME)[0][-1] == UNKNOWN


# --- tool changes ---


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "linuxcnc", "mach"])
def test_behind_a_tool_change_the_axes_stand_where_it_is_stated(dialect):
    text = b"G0 X5. Y6. Z7.\nT1\nM6\nG0 X1. Y2.\n"
    facts = {"offsets": OFFSETS, "positions": HOME}
    assert read(text, dialect, **facts)[0] == [None, UNKNOWN]
    why, rapids = read(text, dialect, **facts, tool_change={"Z": 0.0})
    assert why == [None, None]
    np.testing.assert_allclose(rapids.start[1, :2], (5.0, 6.0))
    why, rapids = read(text, dialect, **facts, tool_change={"X": -20.0, "Z": 0.0})
    assert why == [None, None]
    np.testing.assert_allclose(rapids.start[1, :2], (80.0, 6.0))


@pytest.mark.parametrize("dialect", ["fanuc", "haas"])
def test_lengths_that_the_program_cancels_are_no_longer_lost_at_a_tool_change(dialect):
    # The builder's macro may cancel the length; G49 in the program has done so along all axes.
    text = b"G90 G17 G21 G40 G54 G94 F9.\nG49\nG0 X1. Y1. Z1.\nT2 M6\nG0 X5. Y5.\nZ5.\n"
    assert read(text, dialect, tool_change={})[0][-2:] == [None, None]
    assert read(text.replace(b"G49\n", b""), dialect, tool_change={})[0][-2:] == [UNKNOWN, UNKNOWN]


def test_behind_a_tool_change_z_has_a_name_where_the_tool_length_is_known():
    text = b"G0 X5. Y6. Z7.\nT1 M6\nG0 Z3.\n"
    facts = {"offsets": OFFSETS, "positions": HOME, "tool_change": {"Z": 0.0}}
    why, rapids = read(text, "linuxcnc", **facts)
    assert why == [None, None]
    assert rapids.start[1, 2] == 200.0
    facts["tool_lengths"] = {1: 80.0}
    # The program of the builder may cancel the length.
    assert read(b"G43 H1\n" + text, "haas", **facts)[0][-1] == UNKNOWN


def test_programs_of_the_builder_are_no_tool_change():
    facts = {"offsets": OFFSETS, "positions": HOME, "tool_change": {}}
    assert read(b"G0 X5. Y6.\nM16\nG0 X1. Y2.\n", "fanuc", **facts)[0] == [None, UNKNOWN]


# --- work systems beside a rapid ---


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "linuxcnc", "grbl", "mach"])
def test_a_system_that_was_stated_may_be_stated_again_beside_a_rapid(dialect):
    text = b"G54\nG0 X5. Y6. Z7.\nG54 G0 X1. Y2.\nG90 G0 G54 Z3.\n"
    assert read(text, dialect)[0] == [UNKNOWN, None, None]


@pytest.mark.parametrize("dialect", ["fanuc", "haas", "linuxcnc", "grbl", "mach"])
def test_the_default_system_is_stated_by_nobody(dialect):
    text = b"G0 X5. Y6. Z7.\nG54 G0 X1. Y2.\nG54 G0 X5. Y6.\n"
    assert read(text, dialect)[0] == [UNKNOWN, FRAME, None]


def test_another_system_beside_a_rapid_needs_both_offsets():
    text = b"G54\nG0 X5. Y6. Z7.\nG55 G0 X1. Y2.\nG54 G0 X5. Y6.\n"
    why, rapids = read(text, "haas", offsets=OFFSETS, positions=HOME)
    assert why == [None, None, None]
    np.testing.assert_allclose(rapids.start[1, :2], (5.0 - 130.0, 6.0 - 70.0))
    assert read(text, "haas", positions=HOME)[0] == [None, FRAME, FRAME]
    half = {"G54": OFFSETS["G54"]}
    assert read(text, "haas", offsets=half, positions=HOME)[0] == [None, FRAME, UNKNOWN]


@pytest.mark.parametrize(
    "between", [b"G10 L2 P1 X5.\n", b"#5221=3.\n", b"/G55\n", b"M98 P100\n", b"G65 P9000\n"]
)
def test_a_system_that_may_have_changed_is_not_stated(between):
    text = b"G54\nG0 X5. Y6. Z7.\n" + between + b"G90 G0 G54 X1. Y2.\n"
    assert read(text, "fanuc", positions=HOME)[0][-1] is not None


def test_a_system_selected_in_a_branch_is_not_stated():
    text = b"G0 X5 Y6 Z7\no1 if [#1 GT 0]\nG54\no1 endif\nG0 G54 X1 Y2\n"
    assert read(text, "linuxcnc")[0][-1] == FRAME


# --- M codes beside a rapid ---


def test_m_codes_beside_a_rapid_run_when_the_machine_file_says():
    text = b"G0 X5. Y6. Z7.\nG0 Z1. M9\nG0 Z3. M8\nG0 Z5. M5\nG0 Z7. M150\n"
    other = "other words of the block cannot keep their order"
    assert read(text, "haas", positions=HOME)[0][1:4] == [other] * 3
    why, _ = read(
        text, "haas", positions=HOME, m_before=frozenset({8}), m_after=frozenset({9, 5, 150})
    )
    assert why[:4] == [None] * 4
    assert why[4] is not None  # whatever the builder's own code does


MACHINE = """
interval: 0.001
positioning: linear
controller: haas
axes:
  X: &axis
    rapid: {velocity: 500, acceleration: 3000, jerk: 100000}
    modes: [{name: bed, frequency: 30, damping: 0.02, participation: 1.0}]
  Y: *axis
  Z: *axis
program:
  offsets: {G54: {X: -100, Y: -50, Z: -200}}
  start: {X: 100, Y: 50, Z: 200}
  startup: "G17 G21 G90 G94 G40 G49"
  decimal_point: calculator
  home: {X: 0, Y: 0, Z: 0}
  tool_change: {Z: 0}
  m_before: [M3, M8]
  m_after: [M9, M05]
"""
PROGRAM = b"""%
O100
G17 G40 G49 G80
G28
T1 M6
G0 G90 G54 X10. Y20. M3 S500
G43 H1 Z50. M8
G1 Z-5. F200.
G0 Z50. M9
X60. Y40. M5
M30
%
"""


def test_a_program_of_a_haas_is_rewritten_around_its_words():
    result = process(PROGRAM, Machine.loads(MACHINE))
    assert result.planned == 3
    assert result.verification.confirmed == 3
    lines = result.output.split(b"\n")
    at = lines.index(b"G0 G90 G54   M3 S500")
    assert lines[at + 1].startswith(b"G4") or lines[at + 1].startswith(b"G1 ")
    assert lines[lines.index(b"M9") - 1].startswith(b"G0 F")
    assert lines[lines.index(b"M5") - 1].startswith(b"G0")


def test_an_m_code_runs_before_its_motion_or_behind_it_and_not_both():
    text = MACHINE.replace("m_after: [M9, M05]", "m_after: [M9, M08]")
    with pytest.raises(Exception, match=r"m_after.* holds M08, which program\.m_before holds"):
        Machine.loads(text)


def test_the_keys_are_written_back():
    machine = Machine.loads(MACHINE)
    assert Machine.loads(machine_yaml(machine)).program == machine.program
    assert machine.program.m_after == ("M5", "M9")


# --- programs that begin again ---


SUB = b"O100\nG1 X1 F50\nM99\n"
CALLED = b"M98 P100\nM2\n" + SUB
AGAIN = {
    "an end": (b"M2", None),
    "M99 for an end": (b"M99", UNKNOWN),
    "blanks and zeros": (b"m0 99 (again)", UNKNOWN),
    "a comment": (b"M2 (M99)", None),
    "a comment to the end of the line": (b"M2 ; M99", None),
    "another number": (b"M990", None),
    "a carriage return within": (b"M\r99", UNKNOWN),
    "a decimal point": (b"M99.0", UNKNOWN),
    "a sign": (b"M+99", UNKNOWN),
    "what is rounded": (b"M98.99995", UNKNOWN),
    "what is computed": (b"M[90+9]", UNKNOWN),
    "a variable": (b"#1=99\nM#1", UNKNOWN),
    "a function": (b"M ABS[-99]", UNKNOWN),
    "a sign in front of what is computed": (b"M-[-99]", UNKNOWN),
    "names with an M": (b"#<_move>=[5 MOD 2] (M)\nM2", None),
    "a subprogram": (CALLED, None),
    "a pallet": (CALLED.replace(b"M2", b"N5 m 0 30 (end)"), None),
    "line ends of Windows": (CALLED.replace(b"\n", b"\r\n"), None),
    "nothing in front of the subprogram": (b"M98 P100\n" + SUB, UNKNOWN),
    "an end behind the subprogram": (b"M98 P100\n" + SUB + b"M2\n", UNKNOWN),
    "a subprogram that calls": (
        b"M98 P100 L3\nM30\nO100\nM98 P200\nM99\nO200\nG1 X2 F9\nM99\n",
        None,
    ),
    "an end in the subprogram": (b"M98 P100\nO100\nM2\nM99\n", None),
    "M99 P behind the end": (CALLED.replace(b"M99", b"M99 P10"), None),
    "M99 P": (b"N10 M99 P10", UNKNOWN),
    "an end that may be passed over": (CALLED.replace(b"M2", b"/M2"), UNKNOWN),
    "an end and M99": (b"M2 M99", UNKNOWN),
    "an end within a condition": (
        b"o1 if [#1]\n" + CALLED.replace(SUB, b"o1 endif\n" + SUB),
        UNKNOWN,
    ),
    "an end within a loop": (b"o1 while [0]\nM2\no1 endwhile\nM99\n", UNKNOWN),
    "an end within another subprogram": (b"o1 sub\nM2\no1 endsub\nM99\n", UNKNOWN),
    "an end of another label": (b"o1 if [0]\no2 endif\nM2\no1 endif\nM99\n", UNKNOWN),
    "the same label, written twice": (b"o1 if [0]\no<1> endif\nM2\no1 endif\nM99\n", UNKNOWN),
    "crossed structures": (
        b"o1 if [0]\no2 while [0]\no1 endif\no2 endwhile\n" + CALLED,
        UNKNOWN,
    ),
    "a computed label": (b"o[#1] if [0]\nM2\nM99\n", UNKNOWN),
    "two computed labels": (
        b"o[#1] if [0]\no[#2] endif\nM2\no[#1] endif\nM99\n",
        UNKNOWN,
    ),
    "a label with a point": (b"o1.0 if [0]\nM2\no1 endif\nM99\n", UNKNOWN),
    "a beginning that may be passed over": (
        b"o1 if [1]\n/o1 endif\nM2\no1 endif\nM99\n",
        UNKNOWN,
    ),
    "a way out of what has ended": (
        b"o1 while [0]\no1 endwhile\no1 break\nM2\no1 endwhile\nM99\n",
        UNKNOWN,
    ),
    "structures that have ended": (
        b"o1 sub\no2 if [0]\no1 return\no2 endif\no1 endsub\no3 do\no4 repeat [2]\no3 continue\n"
        b"o4 endrepeat\no3 while [0]\no<a> if [1]\no<A> else\no<a> endif\no1 call\n" + CALLED,
        None,
    ),
    "a label that comes twice": (
        b"o1 if [0]\no1 endif\no1 if [0]\no1 endif\n" + CALLED,
        UNKNOWN,
    ),
}


@pytest.mark.parametrize("case", AGAIN)
def test_a_program_of_linuxcnc_that_begins_again_begins_nowhere_known(case):
    end, first = AGAIN[case]
    text = b"G21 G90 G17 G40 G94 G54 G49 G64\nG0 X5\nG1 X6 F100\nG0 X9\n" + end + b"\n"
    known = {"positions": HOME, "offsets": OFFSETS}
    why, rapids = read(text, "linuxcnc", **known)
    assert why == [first, None]
    # The second reading says so by itself.
    start = Start(startup=STARTUP, spindle="mill", **known)
    believed = replace(rapids, reason=rapids.reason * 0 + CERTAIN)
    found = Findings(9)
    assert confirm(io.BytesIO(text), "linuxcnc", start, believed, [0], found) == (first is None)


def test_offsets_are_said_to_mean_that_nothing_else_lies_between():
    # LinuxCNC and others keep G92 and G43 behind the end of a program.
    said = "without G92 and without a tool length"
    assert any(said in note for note in process(PROGRAM, Machine.loads(MACHINE)).notes)
    without = MACHINE.replace("  offsets: {G54: {X: -100, Y: -50, Z: -200}}\n", "")
    assert not any(said in note for note in process(PROGRAM, Machine.loads(without)).notes)
