"""What differs between dialects, each difference on a program of a few lines."""

import io
import math
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk import Machine, ProgramError, find_machine, process
from gcodejerk.axes import AXES
from gcodejerk.nc import DIALECTS, Dialect, Start, find_dialect, parse_block, read_program
from gcodejerk.nc import trace as follow
from gcodejerk.nc.dialects import GROUP
from gcodejerk.reasons import CERTAIN, REASONS
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm

VMC = Machine.load(find_machine("vmc"))
KNOWN = Start(positions={"X": 0.0, "Y": 0.0, "Z": 0.0}, startup="G17 G21 G90 G94")
SIEMENS = Start(positions=KNOWN.positions, startup="G17 G71 G90 G94 G64")
PRINTER = Start(positions=KNOWN.positions, startup="G90 G21")
NOWHERE = math.nan
NUMBERED = "with a number of its own it may be no command: post the program without"


def end(program, dialect, start=KNOWN):
    """X, Y and Z after a program."""
    *_, last = follow(io.BytesIO(program), dialect=dialect, start=start)
    return last[1][:3]


def reasons(program, dialect, start=KNOWN):
    """What each rapid is left alone for; None where it is certain."""
    found = read_program(io.BytesIO(program), dialect=dialect, start=start).rapids.reason
    return [None if r == CERTAIN else str(REASONS[r]) for r in found.tolist()]


def same(a, b):
    return all(x == pytest.approx(y, nan_ok=True) for x, y in zip(a, b, strict=True))


@pytest.mark.parametrize("name", DIALECTS)
def test_a_dialect_names_its_sources_and_knows_what_its_tables_refer_to(name):
    dialect = DIALECTS[name]
    assert dialect.name == name
    assert dialect.sources
    assert dialect.title
    listed = {
        *dialect.effects, *dialect.harmless, *dialect.drilling.codes, *dialect.transforms,
        *dialect.redrawn, *dialect.contours,
    }  # fmt: skip
    assert listed <= set(dialect.groups), sorted(listed - set(dialect.groups))
    assert set(dialect.feed_modes) <= {c for c, g in dialect.groups.items() if g == "feed mode"} | {
        930, 940, 950,
    }  # fmt: skip
    assert 0 in dialect.groups
    assert dialect.groups[0] == "motion"


@pytest.mark.parametrize("name", [name for name in DIALECTS if name != "klartext"])
def test_every_dialect_moves_where_absolute_words_say(name):
    line_end = b"*\n" if name == "heidenhain-iso" else b"\n"
    start = Start(positions=KNOWN.positions)
    units = DIALECTS[name].units
    start = replace(start, startup=f"G{next(c for c in units if not units[c]) // 10}")
    states = b"G40" if name == "heidenhain-iso" else b""
    states += line_end if name == "fanuc-lathe-a" else b" G90" + line_end
    axes = b"X10. Z-3." if "lathe" in name else b"X10. Y5. Z-3."
    expected = (10.0, 0.0 if "lathe" in name else 5.0, -3.0)
    assert same(end(states + b"G0 " + axes + line_end, name, start), expected)


@pytest.mark.parametrize(
    ("dialect", "line", "problem"),
    [
        ("linuxcnc", b"G0 X1 (open", "comment is not closed"),
        ("fanuc", b"G0 X1. (open", None),
        ("fanuc", b"(PLUNGE (NESTED?) )", "')' has no meaning here"),
        ("grbl", b"(a (b)", None),
        ("linuxcnc", b"(a (b)", "comment within a comment"),
        ("siemens", b"G0 X1 (5)", "'(' has no meaning here"),
        ("siemens", b"G0 X1 ; (5", None),
        ("fanuc", b"G0 X1. ;", None),
        ("fanuc", b"G0 X1. ; G1", "another block behind the end of the block"),
        ("fanuc", b"G0 X1. ; to the corner", None),
        ("fanuc", b"; T1 10MM END MILL", None),
        ("fanuc", b"; #1=5", "another block behind the end of the block"),
        ("mach", b"G0 X1 // go", None),
        ("linuxcnc", b"G0 X1 // go", "'/' has no meaning here"),
        ("linuxcnc", b"g0x +0. 12 34y 7", None),
        ("grbl", b"G0X 1 2", None),
        ("fanuc", b"G0 X1 2", "'2' has no meaning here"),
        ("siemens", b"G0 X1 2", "'2' has no meaning here"),
        ("marlin", b"G1 X5*71", None),
        ("marlin", b"N10 G1 X5*71", NUMBERED),
        ("klipper", b"n10 G1 X5", NUMBERED),
        ("linuxcnc", b"N10 G1 X5*71", "'*' has no meaning here"),
        ("heidenhain-iso", b"N10 G00 X+5 Y-3*", None),
        ("grbl", b"%", "'%' has no meaning here"),
        ("grbl", b"$H", "'$' has no meaning here"),
        ("mach", b"%prog1", None),
        ("fanuc", b"%prog1", "text on the line of %"),
        ("siemens", b"%_N_PART_MPF", None),
        ("fanuc", b":1234(NAME)", None),
        ("siemens", b"MSG(\"T1 (ROUGH)\")", None),
        ("siemens", b"CYCLE81(10,0,2,-5)", None),
        ("siemens", b"CYCLE81(10,0", "parenthesis is not closed"),
        ("siemens", b"X1=5", "axis with a number: not known here"),
        ("klipper", b"SET_VELOCITY_LIMIT ACCEL=3000", None),
        ("klipper", b"G1 X1 (go)", "'(' has no meaning here"),
        ("fanuc", b"IF[#1GT10.]GOTO100", None),
    ],
)  # fmt: skip
def test_a_line_is_read_as_the_dialect_writes_it(dialect, line, problem):
    assert parse_block(line, dialect).problem == problem


@pytest.mark.parametrize(
    ("dialect", "line", "deleted"),
    [
        ("linuxcnc", b"/G0 X1", True),
        ("fanuc", b"N120/G0X1.", True),
        ("fanuc", b"/2 G0X1.", True),
        ("siemens", b"/1 N70 G0 X1", True),
        ("grbl", b"/G0X1", True),
        ("fanuc", b"G0X1.", False),
    ],
)
def test_block_delete_stands_where_the_dialect_has_it(dialect, line, deleted):
    block = parse_block(line, dialect)
    assert block.problem is None
    assert block.block_delete is deleted
    assert [word.text for word in block.words if word.letter == "X"] != []


def test_a_slash_behind_n_is_no_block_delete_for_linuxcnc():
    assert parse_block(b"N120/G0X1", "linuxcnc").problem == "'/' has no meaning here"


@pytest.mark.parametrize(
    ("meaning", "end_of_x"), [(None, NOWHERE), ("calculator", 100.0), ("standard", 0.1)]
)
def test_what_x100_is_only_the_machine_knows(meaning, end_of_x):
    start = Start(positions={"X": 0.0}, startup="G90 G21", decimal_point=meaning)
    program = b"G0 X100\n"
    assert same(end(program, "fanuc", start)[:1], (end_of_x,))
    why = "number without a decimal point"
    assert reasons(b"G94 " + program, "fanuc", start) == [None if meaning else why]
    assert reasons(b"G94 G0 X100.\n", "fanuc", start) == [None]
    assert same(end(program, "linuxcnc", start)[:1], (100.0,))


def test_a_whole_number_in_inches_is_a_ten_thousandth():
    start = Start(positions={"X": 0.0}, startup="G90 G21", decimal_point="standard")
    assert same(end(b"G20 G0 X5\n", "haas", start)[:1], (0.0005 * 25.4,))


def test_zero_needs_no_decimal_point():
    assert reasons(b"G0 X5.\nX0\n", "fanuc") == [None, None]


@pytest.mark.parametrize("zero", ["F0", "F0.", "F000", "F.0"])
@pytest.mark.parametrize("dialect", ["fanuc", "haas", "syntec"])
def test_an_f_of_zero_has_a_point_or_none_however_it_is_read(dialect, zero):
    program = (
        "G90 G94 G17\nG21\nG1 Z-2.85 F80\nG0 Z11.15\nZ21.15\n"
        f"{zero}\n\nZ11.15\nZ2.15\nG1 Z-2.85 F80.\nG0 Z11.15\nX6.\nX7.\nX8.\nX9.\nM30\n"
    ).encode()
    quick, careful = (
        read_program(io.BytesIO(program), dialect=dialect, fast=fast).rapids
        for fast in (True, False)
    )
    assert quick.feed_whole.tolist() == careful.feed_whole.tolist()
    assert quick.feed_whole[quick.feed == 0.0].tolist() == ["." not in zero] * 2
    result = process(program, VMC, dialect=dialect, controller="csv")
    assert result.verification.confirmed == result.verification.rewritten >= 4


def test_only_codes_that_a_dialect_states_are_assumed_at_the_start():
    unstated = Start(positions={"X": 0.0})
    program = b"G21 G0 X5.\n"
    assert reasons(b"G0 X5.\n", "linuxcnc", unstated) == ["units unknown"]
    assert reasons(program, "linuxcnc", unstated) == [None]
    assert reasons(b"G0 X5.\n", "klipper", unstated) == ["distance mode unknown"]
    assert reasons(program, "grbl", unstated) == [None]
    assert reasons(program, "fanuc", unstated) == ["distance mode unknown"]
    assert reasons(program, "mach", unstated) == ["distance mode unknown"]
    assert reasons(program, "fanuc-lathe-a", unstated)[0] in (None, "feed to restore unknown")


def test_after_a_cycle_of_its_own_group_g0_is_active_again():
    program = b"G0 X5. Z10.\nG98 G81 X10. Y5. Z-5. R2. F100.\nX20.\nG80\nX30. Y0\n"
    assert reasons(program, "fanuc") == [
        None, "rapid inside a canned cycle", "rapid inside a canned cycle", None,
    ]  # fmt: skip
    assert same(end(program, "fanuc"), (30.0, 0.0, 10.0))
    # For LinuxCNC axis words behind G80 are an error.
    assert end(b"G0 X5.\nG80\nX30.\n", "linuxcnc")[0] != 30.0


def test_g0_ends_a_cycle_that_g80_did_not():
    program = b"G0 Z10.\nG99 G81 X10. Y5. Z-5. R2. F100.\nG0 X30.\nX40.\n"
    assert reasons(program, "haas")[2:] == [None, None]
    assert same(end(program, "haas"), (40.0, 5.0, 2.0))


def test_the_number_of_repeats_has_the_letter_of_the_dialect():
    program = b"G0 Z10.\nG91 G99 G81 X10. Z-5. R-2. %c3 F100.\n"
    assert end(program % b"K", "fanuc")[0] == 30.0
    assert end(program % b"L", "linuxcnc")[0] == 30.0


def test_g28_leaves_only_the_named_axes_unknown():
    program = b"G0 X5. Y5. Z5.\nG91 G28 Z0.\n"
    for dialect in ("fanuc", "haas", "mach", "grbl"):
        assert same(end(program, dialect), (5.0, 5.0, NOWHERE)), dialect
        assert same(end(program + b"G90 X7. Y7.\n", dialect), (7.0, 7.0, NOWHERE)), dialect


def test_g28_of_haas_cancels_a_tool_length_that_may_have_been_that_of_any_axis():
    program = b"G0 X5. Y5. Z5.\nG91 G28 Z0.\n"
    start = replace(KNOWN, positions={}, offsets={}, startup="G90 G21")
    assert same(end(program, "fanuc", start), (5.0, 5.0, NOWHERE))
    assert same(end(program, "haas", start), (NOWHERE, NOWHERE, NOWHERE))


def test_g28_on_the_line_of_g0_is_fanucs_and_no_linuxcncs():
    line = b"G0G91G28Z0\n"
    assert reasons(line, "fanuc") == ["coordinate frame changes in the block"]
    assert reasons(line, "linuxcnc") == ["block not understood"]


def test_u_and_w_are_increments_on_a_lathe_with_system_a():
    start = Start(positions={"X": 10.0, "Z": 5.0}, diameter=True, startup="G21 G99")
    at = end(b"G00 X40. Z2.\nU-4. W-1.\n", "fanuc-lathe-a", start)
    assert same((at[0], at[2]), (18.0, 1.0))  # radius, from a diameter of 36
    assert reasons(b"G00 X40. Z2.\nU-4. W-1.\n", "fanuc-lathe-a", start) == [None, None]


def test_g90_is_a_turning_cycle_on_a_lathe_with_system_a():
    start = Start(positions={"X": 20.0, "Z": 2.0}, diameter=True, startup="G21 G99")
    at = end(b"G00 X44. Z2.\nG90 X40. Z-20. F0.2\n", "fanuc-lathe-a", start)
    assert math.isnan(at[0])
    at = end(b"G90 G00 X44. Z2.\n", "fanuc-lathe-b", start)
    assert same((at[0], at[2]), (22.0, 2.0))


def test_blocks_of_a_contour_do_not_run_where_they_stand():
    start = Start(positions={"X": 20.0, "Z": 2.0}, diameter=True, startup="G21 G99 F0.1")
    program = (
        b"G00 X40. Z3.\nG71 U2. R0.5\nG71 P10 Q20 U0.4 W0.1 F0.25\n"
        b"N10 G00 X16.\nG00 Z1.\nN20 X44.\nG00 X60. Z5.\nX62.\n"
    )
    assert reasons(program, "fanuc-lathe-a", start) == [
        None, *["rapid inside a canned cycle"] * 2, "start unknown", None,
    ]  # fmt: skip


def test_a_tool_word_changes_the_frame_of_a_lathe_only():
    program = b"G0 X5. Z5.\nT0101\nX7. Z7.\nX8.\n"
    turned = Start(positions={"X": 0.0, "Z": 0.0}, startup="G21 G99")
    assert reasons(program, "fanuc-lathe-a", turned) == [None, "start unknown", None]
    assert reasons(program, "haas") == [None, None, None]


@pytest.mark.parametrize(
    ("dialect", "on", "off"),
    [
        ("fanuc", b"G68 X0 Y0 R30.", b"G69"),
        ("fanuc", b"G16", b"G15"),
        ("fanuc", b"G51.1 X0", b"G50.1 X0"),
        ("mach", b"G51 X2", b"G50"),
        ("haas", b"G107 A0 R5.", None),
    ],
)
def test_nothing_is_rewritten_in_a_frame_that_turns_scales_or_mirrors(dialect, on, off):
    program = b"G0 X1. Y1.\n%s\nX2. Y2.\nX3.\n" % on
    assert set(reasons(program, dialect)[1:]) == {"rotation, scaling, mirroring or polar active"}
    if off is not None:
        program += b"%s\nG0 X4. Y4.\nX5.\n" % off
        assert reasons(program, dialect)[-2:] == ["start unknown", None]


def test_a_builders_m_code_may_move_but_changes_no_mode():
    program = b"G0 X5. Y5.\nM10\nX6. Y6.\nX7.\n"
    assert reasons(program, "fanuc") == [None, "start unknown", None]
    assert reasons(program, "linuxcnc")[1:] != ["start unknown", None]


def test_every_line_of_marlin_states_its_own_motion():
    program = b"G90\nG0 X5 F6000\nX6\nG0 X7\nG0 X8\n"
    assert reasons(program, "marlin", PRINTER) == [None, "start unknown", None]


def test_rapids_of_marlin_and_klipper_run_at_f():
    for dialect in ("marlin", "klipper"):
        program = b"G90\nG0 X5\nG1 X6 F600\nG0 X7\nG0 X8 F1200\n"
        rapids = read_program(io.BytesIO(program), dialect=dialect, start=PRINTER).rapids
        assert reasons(program, dialect, PRINTER)[0] == "feed to restore unknown"
        assert rapids.speed.tolist()[1:] == [10.0, 20.0]
    rapids = read_program(io.BytesIO(b"G0 X5 F600\n"), dialect="linuxcnc", start=KNOWN).rapids
    assert math.isnan(rapids.speed[0])


@pytest.mark.parametrize(
    ("dialect", "line", "speed"),
    [
        # F belongs to the command of its line, and only a move has a use for it.
        ("klipper", b"G91 F60", 50.0),
        ("marlin", b"G90 F60", 50.0),
        ("marlin", b"G92 X0 F60", 50.0),
        ("klipper", b"G1 F60", 1.0),
        # Behind a code that not every control knows, and behind F0, nobody knows which F holds.
        ("klipper", b"G3 X5 I3 F60", NOWHERE),
        ("marlin", b"G5 X5 I3 J1 P1 Q1 F60", NOWHERE),
        ("marlin", b"G0 X5 F0", NOWHERE),
        ("klipper", b"G1 F0", NOWHERE),
        # Nor where the motion before may still be in force.
        ("marlin", b"F60", NOWHERE),
        ("marlin", b"M104 F60", 50.0),
    ],
)
def test_f_counts_beside_a_move_alone(dialect, line, speed):
    program = b"G90\nG0 X5 F3000\n" + line + b"\nG90\nG0 X0 Y0 Z0\nG0 X8\n"
    rapids = read_program(io.BytesIO(program), dialect=dialect, start=PRINTER).rapids
    assert rapids.speed[-1] == pytest.approx(speed, nan_ok=True)
    rows, found = np.arange(len(rapids) - 1, len(rapids)), Findings(100)
    assert confirm(io.BytesIO(program), dialect, PRINTER, rapids, rows, found)
    assert not found.violations
    for other in {1.0, 50.0} - {speed}:  # of the F of the line, and of the one before
        wrong = replace(rapids, speed=np.full(len(rapids), other))
        assert not confirm(io.BytesIO(program), dialect, PRINTER, wrong, rows, found)


@pytest.mark.parametrize("code", [b"G61.1", b"G15", b"G69", b"G64"])
def test_where_one_of_three_controls_refuses_a_block_nobody_knows_where_it_leads(code):
    start = replace(KNOWN, resume="same")
    found = end(b"G0 X1 Y1 Z1\n" + code + b" X5 Z1\n", "rs274", start)
    assert same(found, (NOWHERE, 1.0, 1.0))


def test_a_rapid_that_feeds_plastic_is_left_alone():
    assert reasons(b"G90\nG0 X5 F600 E1\n", "marlin", PRINTER) == [
        "other words of the block cannot keep their order"
    ]


def test_a_checksum_forbids_inserting_lines():
    assert reasons(b"G90*20\nG0 X5 F600*30\n", "marlin", PRINTER) == [
        "other words of the block cannot keep their order"
    ]


def test_axis_letters_of_other_commands_move_nothing():
    program = b"G90\nG0 X5 Y5 F600\nM204 X500 Y500\nM92 X80\nG0 X6 F600\n"
    assert reasons(program, "marlin", PRINTER) == [None, None]


def test_siemens_words_with_names():
    at = end(b"G90\nG0 X10 Y5 Z3\nG0 X=IC(5) Y=AC(7)\n", "siemens", SIEMENS)
    assert same(at, (15.0, 7.0, 3.0))
    assert end(b"G90\nG0 X10\nTRANS X5\n", "siemens", SIEMENS)[0] == 5.0
    assert math.isnan(end(b"G90\nG0 X10\nROT Z5\n", "siemens", SIEMENS)[0])
    assert math.isnan(end(b"G90\nG0 X10\nMYSUB(3)\n", "siemens", SIEMENS)[0])
    assert end(b'G90\nG0 X10\nMSG("G0 X5")\n', "siemens", SIEMENS)[0] == 10.0
    turned = Start(positions={"X": 0.0, "Z": 0.0}, startup="G71 G90")
    assert end(b"DIAMON\nG0 X10\n", "siemens", turned)[0] == 5.0
    assert end(b"DIAMOF\nG0 X10\n", "siemens", turned)[0] == 10.0


@pytest.mark.parametrize(
    ("word", "reason"),
    [
        ("X=IC(5)", None),
        ("X=AC(5)", None),
        ("A=IC(5)", "other words of the block cannot keep their order"),
        ("A=AC(5)", "a rotary axis may turn another way"),
        ("A=DC(5)", "start unknown"),
        ("X=ACN(5)", "start unknown"),
    ],
)
def test_siemens_words_that_are_increments_or_ways_round(word, reason):
    start = replace(SIEMENS, startup="G17 G710 G40 G90 G64 G94")
    axes = replace(start, positions=dict.fromkeys(AXES, 1.0))
    assert reasons(f"F100\nG0 {word}\nG1 X9\n".encode(), "siemens", axes) == [reason]


def test_positions_behind_mcall_are_holes():
    program = b"G90\nG0 X1 Z5\nMCALL CYCLE81(10,0,2,-5)\nX5\nX6\nMCALL\nG0 X7 Z9\nX8\n"
    assert reasons(program, "siemens", SIEMENS) == [
        None, *["rapid inside a canned cycle"] * 2, None, None,
    ]  # fmt: skip
    uncertain = program.replace(b"CYCLE81", b"CYCLE86")
    assert reasons(uncertain, "siemens", SIEMENS)[3] == "start unknown"


def test_a_program_is_not_started_by_what_stands_in_front_of_it():
    program = b"(LEADER)\n%\nO1000(PART)\nG0 X5.\n"
    read = read_program(io.BytesIO(program), dialect="fanuc", start=KNOWN)
    assert reasons(program, "fanuc") == [None]
    assert program[: read.insert_at].endswith(b"O1000(PART)\n")
    named = b"%\npart-1.nc (from CAM)\nG0 X5.\n"
    assert reasons(named, "fanuc") == [None]


def test_offsets_make_g53_known():
    start = Start(
        positions={"X": 0.0, "Y": 0.0, "Z": 0.0},
        offsets={"G54": {"X": -100.0, "Y": -50.0, "Z": -200.0}, "G54.1 P3": {"X": 10.0}},
        startup="G21 G90",
    )
    assert same(end(b"G54 G0 X1. Y1. Z1.\nG53 G0 Z0.\n", "fanuc", start), (1.0, 1.0, 200.0))
    assert same(end(b"G54 G0 X1.\nG54.1 P3\n", "fanuc", start)[:1], (-109.0,))
    assert math.isnan(end(b"G54 G0 X1.\nG54.1 P4\n", "fanuc", start)[0])


def test_linear_and_rotary_axes_together_need_a_known_feed():
    start = Start(positions=dict.fromkeys(AXES, 0.0), startup="G21 G90 G94", wraps={"B": "none"})
    assert reasons(b"G0 X5. B90.\n", "fanuc", start) == ["linear and rotary axes move together"]
    assert reasons(b"G0 X5. B90.\n", "linuxcnc", start) == [None]
    assert reasons(b"G0 B90.\n", "fanuc", start) == [None]


class Entry:
    """An installed package's entry point."""

    name, value = "mine", "mine.dialect:MINE"

    def __init__(self, made):
        self.made = made

    def load(self):
        if isinstance(self.made, Exception):
            raise self.made
        return self.made


def test_a_package_adds_a_dialect(monkeypatch):
    grbl = DIALECTS["grbl"]
    mine = Dialect(
        "mine", "Mine", ("me",), grbl.text, grbl.groups, grbl.m_groups, defaults=grbl.defaults
    )
    monkeypatch.setattr(
        "gcodejerk.nc.dialects.entry_points", lambda group: [Entry(mine)] if group == GROUP else []
    )
    assert find_dialect("mine") is mine
    assert reasons(b"G0 X5\n", "mine") == [None]


@pytest.mark.parametrize(
    ("made", "words"),
    [(ValueError("broken"), "cannot be loaded: broken"), (5, "is no gcodejerk.nc.Dialect")],
)
def test_a_broken_dialect_of_a_package_is_named(monkeypatch, made, words):
    monkeypatch.setattr("gcodejerk.nc.dialects.entry_points", lambda group: [Entry(made)])
    with pytest.raises(ProgramError, match=words):
        find_dialect("mine")


def test_an_unknown_dialect_is_refused_with_the_nearest_one():
    with pytest.raises(ProgramError, match="did you mean fanuc"):
        find_dialect("fanuk")


def test_a_tool_axis_that_is_no_plane_is_read():
    # Found by fuzzing: G20 is a tool axis for Heidenhain, and G42 asked for its plane.
    start = Start(positions=KNOWN.positions)
    assert math.isnan(end(b"N1 G20*\nN2 G42 G01 X5*\nN3 G40*\n", "heidenhain-iso", start)[0])


def test_an_angle_of_direct_drawing_moves_axes_that_it_does_not_name():
    # G01 X20. A45. computes Z: a block that is not understood leaves no position known.
    start = Start(positions={"X": 10.0, "Z": 5.0}, diameter=True, startup="G21 G99 F0.1")
    at = end(b"G00 X40. Z2.\nG01 X20. A45.\n", "fanuc-lathe-a", start)
    assert math.isnan(at[0])
    assert math.isnan(at[2])


def test_where_a_back_boring_cycle_ends_is_not_known():
    program = b"G0 X0. Y0. Z50.\nG99 G87 X5. Y5. Z-10. R-12. Q1. F50.\nG80\nG0 X9.\n"
    assert math.isnan(end(program, "fanuc")[2])
    above = b"G0 X0. Y0. Z5.\nG98 G81 X5. Z-10. R8. F50.\n"
    assert math.isnan(end(above, "fanuc")[2])
    assert end(above, "linuxcnc")[2] == 8.0


def test_a_rounded_corner_ends_where_it_is_programmed():
    rounded = b"G90\nG1 X10 Y5 RND=2 F100\n"
    assert all(map(math.isnan, end(rounded, "siemens", SIEMENS)[:2]))
    assert same(end(rounded + b"X9 Y3\n", "siemens", SIEMENS)[:2], (9.0, 3.0))
    assert math.isnan(end(b"G90\nG1 X10 ANG=30 F100\n", "siemens", SIEMENS)[1])


def test_a_tool_length_of_a_mill_shifts_z_alone():
    program = b"G0 X5. Y6. Z7.\nG43 H1 Z50.\nX8.\n"
    assert reasons(program, "fanuc")[-1] is None
    assert same(end(b"G0 X5. Y6. Z7.\nG43 H1\n", "fanuc"), (5.0, 6.0, NOWHERE))
    # Named, any axis may be the one that is meant; in another plane it is not Z.
    assert math.isnan(end(b"G0 X5. Y6. Z7.\nG43 H1 Z50. Y1.\n", "fanuc")[0])
    assert math.isnan(end(b"G18 G0 X5. Y6. Z7.\nG43 H1\n", "fanuc")[1])
    assert math.isnan(end(b"G0 X5. Y6. Z7.\nG43 H1\n", "linuxcnc")[0])


@pytest.mark.parametrize(
    ("text", "line", "byte"),
    [
        ("G21\n(STOP!)\nG0 X5 (~)\n", 2, "'!'"),
        ("G21\nG0 X5 ; Öl\n", 2, "byte 0x96 (of a letter?)"),
        ("G21 (ö)\nG0 X5\n", 1, "byte 0xB6 (of a letter?)"),
        ("G21 (ü, why?)\nG0 X5\n", None, ""),
    ],
)
def test_bytes_that_grbl_takes_out_of_any_line_are_named(text, line, byte):
    """Its serial port does, whatever line they stand in (grbl/serial.c); grblHAL has more."""
    found = read_program(io.BytesIO(text.encode()), dialect="grbl", start=KNOWN).findings
    told = [one for one in found if "when it arrives" in one.message]
    assert [one.line for one in told] == ([line] if line else [])
    assert all(one.message.startswith(byte) for one in told)
    others = read_program(io.BytesIO(text.encode()), dialect="linuxcnc", start=KNOWN).findings
    assert not any("when it arrives" in one.message for one in others)
