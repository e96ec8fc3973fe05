"""Limits of speed and acceleration that a program sets: too low, and no stream is made."""

import io
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.axes import AXES
from gcodejerk.machine import Machine, find_machine
from gcodejerk.nc import CERTAIN, Start, read_program
from gcodejerk.nc.dialects import find_dialect
from gcodejerk.nc.interpreter.limits import beyond_path, set_by_code
from gcodejerk.nc.interpreter.modal import State
from gcodejerk.reasons import REASONS, Reason
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading.agreement import confirm
from gcodejerk.verification.second_reading.limiting import too_fast

SET = Reason.LIMIT_SET
ALL = (300.0, 2500.0, 6e5)
STATED = {"X": ALL, "Y": ALL, "Z": (100.0, 500.0, 6e5)}
HEADS = {
    "marlin": b"G21\nG90\nG0 X0 Y0 Z50 F6000\n",
    "klipper": b"G90\nG0 X0 Y0 Z50 F6000\n",
    "duet": b"M453\nG17\nG21\nG90\nG94\nG0 X0 Y0 Z50\n",
    "grbl": b"G21 G90 G94 G17 G54 F100\nG0 X0 Y0 Z50\n",
    "rs274": b"G21 G90 G94 G17 G54 F100\nG0 X0\nG0 Y0\nG0 Z50\n",
    "siemens": b"G71 G90 G94 G17 G40 G64 F100\nG0 X0 Y0 Z50\n",
}
AGAIN = {
    "marlin": b"G21\nG90\nG1 X1 Y1 Z40 F6000\n",  # M204 T is taken for a tool, too
    "klipper": b"G90\nG1 X1 Y1 Z40 F6000\n",
    "duet": b"G21\nG90\nG94\nG1 X1 Y1 Z40 F600\n",
    "grbl": b"G21 G90 G94 G17 G40 G54 G49 G61\nG1 X1 Y1 Z40 F100\n",
    "rs274": b"G21 G90 G94 G17 G40 G49 G54 G64\nG1 X1 F100\nG1 Y1\nG1 Z40\n",
    "siemens": b"G500\nG71 G90 G94 G17 G40 G64 F100\nG1 X1 Y1 Z40\n",
}
LOWER = {
    "marlin": [
        *(b"M204 T500", b"M204 S500", b"M204 P3000 T2000", b"M201 X2000", b"M201 Z400"),
        *(b"M203 Y250", b"M203 X300 Y300 Z90", b"N3 M204 S100"),
    ],
    "klipper": [
        *(b"SET_VELOCITY_LIMIT ACCEL=500", b"set_velocity_limit accel=500 velocity=300"),
        *(b"SET_VELOCITY_LIMIT VELOCITY=90 ; slow", b"M204 S1000", b"M204 P900 T3000"),
        *(b"SET_VELOCITY_LIMIT ACCEL={accel}", b"SET_VELOCITY_LIMIT ACCEL = 500"),
    ],
    "duet": [b"M204 T500", b"M201 X2000 Y2000", b"M203 X9000"],
    "grbl": [
        *(b"$110=9000", b"$120=500", b"$ 122 = 50", b"$111=1e9", b"$RST=$", b"$800=100"),
        b"$/axes/x/acceleration_mm_per_sec2=200",
    ],
    "rs274": [b"$110=9000", b"$120=500.0"],
    "siemens": [
        *(b"ACC[X]=50", b"VELOLIM[Y]=99.5", b"JERKLIM[Z]=R1", b"N5 ACC[X]=100 ACC[Y]=60"),
        *(b"acc[X] = 50", b"G1 Y5 ACC[Y]=10"),
        *(b"DYNFINISH", b"N10 DYNROUGH SOFT", b"DynPos", b"DYNSEMIFIN ; DYNNORM", b"DRIVE"),
        *(b"CYCLE832(0.05,_FINISH,1)\nCOMPOF\nG64", b"SOFT\nDRIVE", b"DYNNORM\nDYNFINISH"),
        b'DRIVE MSG("BRISK")',
    ],
}
AS_STATED = {
    "marlin": [
        *(b"M204 T2500", b"M204 S3000", b"M204 P100 R100", b"M201 X2500 Y2500 Z500 E100"),
        *(b"M203 X300 Y300 Z100 E20", b"M205 X8 Y8 J0.01", b"M204 T500\nM204 T2500"),
    ],
    "klipper": [
        *(b"SET_VELOCITY_LIMIT ACCEL=2500 VELOCITY=300", b"M204 S2500"),
        *(b"SET_VELOCITY_LIMIT SQUARE_CORNER_VELOCITY=1",),
        b"SET_VELOCITY_LIMIT ACCEL=10\nSET_VELOCITY_LIMIT ACCEL=2500",
    ],
    "duet": [b"M204 T2500", b"M201 X2500", b"M203 X18000 Z6000", b"M566 X20"],
    "grbl": [b"$110=18000", b"$122=500", b"$10=1", b"$$"],
    "rs274": [b"$110=18000"],
    "siemens": [
        *(b"ACC[X]=100", b"ACC[X]=50\nACC[X]=100", b"VELOLIM[X]=120"),
        *(b"SOFT", b"BRISK", b"DYNNORM", b"DYNFINISH\nDYNNORM", b"DRIVE\nBRISK", b"DRIVE SOFT"),
        *(b'MSG("DRIVE")', b"CYCLE832(0.05,_FINISH,1)\nCOMPOF DYNNORM\nG64"),
        b"SOFT DYNNORM FFWON",
    ],
}


def reasons(dialect, line, stated=STATED, head=None, rapid=b"G0 X9", straight=True):
    """Why rapids behind a line are left alone; the second reading has to have seen it, too."""
    head = HEADS[dialect] if head is None else head
    text = head + line + b"\n" + AGAIN.get(dialect, b"") + rapid + b"\n"
    startup = "G71" if dialect == "siemens" else ""
    facts = {"limits": stated, "straight": straight, "wraps": {"A": "none"}}
    start = Start(startup=startup, spindle="mill", **facts)
    rapids = read_program(io.BytesIO(text), dialect=dialect, start=start).rapids
    last = REASONS[rapids.reason[-1]] if rapids.reason[-1] != CERTAIN else None
    found = Findings(100)
    believed = replace(rapids, reason=rapids.reason * 0 + CERTAIN)
    confirmed = confirm(io.BytesIO(text), dialect, start, believed, [len(rapids) - 1], found)
    # What no control reads makes all unknown to the second reading; rs274 has no way back from it.
    assert dialect == "rs274" or confirmed == (last is None), found.violations
    return last


@pytest.mark.parametrize(("dialect", "line"), [(d, one) for d in LOWER for one in LOWER[d]])
def test_a_limit_below_what_the_machine_file_states_keeps_rapids_as_they_are(dialect, line):
    assert reasons(dialect, line) == SET


@pytest.mark.parametrize(("dialect", "line"), [(d, one) for d in AS_STATED for one in AS_STATED[d]])
def test_a_limit_that_the_machine_file_states_changes_nothing(dialect, line):
    assert reasons(dialect, line) is None


@pytest.mark.parametrize(
    ("dialect", "lines"),
    [
        ("marlin", b"M204 T500\nM204 T5000 @"),
        ("marlin", b"M201 X2000\nM201 X5000 @"),
        ("klipper", b"M204 S500\nM204 S9000 %"),
        ("siemens", b"ACC[X]=50\nACC[X]=100 )"),
        ("siemens", b"DRIVE\nBRISK @"),
    ],
)
def test_a_block_that_is_not_understood_ends_no_limit(dialect, lines):
    assert reasons(dialect, lines) in (SET, Reason.NOT_UNDERSTOOD)


@pytest.mark.parametrize(
    ("dialect", "line", "reason"),
    [
        ("marlin", b"N3 M204 S100", SET),
        ("marlin", b"m201 x100", SET),
        ("marlin", b"M204 S100 (slowly)", SET),
        ("klipper", b"N3 M204 S100", SET),
        ("klipper", b"N3 SET_VELOCITY_LIMIT ACCEL=100", SET),
        ("marlin", b"N3 M220 S50", Reason.FEED_SCALED),
        ("marlin", b"m220 s50", Reason.FEED_SCALED),
        ("grbl", b"G51 X2 P3 ~", Reason.ROTATION),
    ],
)
def test_a_block_that_is_not_understood_may_begin_what_lasts(dialect, line, reason):
    """Small letters, comments and numbers are passed over by some of these controls."""
    assert reasons(dialect, line) == reason


@pytest.mark.parametrize("line", [b"N3 M220 S50", b"m220 s50"])
def test_what_it_may_have_begun_is_ended_by_a_word_that_is_read(line):
    assert reasons("marlin", line + b"\nM220 S100") is None


def test_grbl_may_refuse_to_set_it_back():
    assert reasons("grbl", b"$120=500\n$120=2500") == SET


def test_a_macro_behind_a_limit_that_is_enough_bars_nothing():
    again = b"\nG90\nG21\nG1 X1 Y1 Z1 F600"
    assert reasons("klipper", b"SET_VELOCITY_LIMIT ACCEL=2500\nBED=1" + again) is None
    assert reasons("klipper", b"SET_VELOCITY_LIMIT ACCEL=2400\nBED=1" + again) == SET


def test_without_a_machine_no_limit_is_known_to_be_enough():
    assert reasons("marlin", b"M204 T99999", stated={}) == SET


def test_an_axis_that_the_machine_does_not_have_matters_to_nobody():
    assert reasons("marlin", b"M201 Z1", stated={"X": ALL, "Y": ALL}) is None


def test_the_machine_tells_what_its_streams_may_use():
    machine = Machine.load(find_machine("vmc"))
    limits = machine.program_start().limits
    for axis in machine.axes:
        assert limits[axis.name][1] == max(axis.rapid.acceleration, axis.limit.acceleration)


def test_the_first_line_that_sets_one_is_named():
    text = HEADS["klipper"] + b"SET_VELOCITY_LIMIT ACCEL=500\nM204 S400\nG0 X9\n"
    found = read_program(io.BytesIO(text), dialect="klipper", start=Start(limits=STATED)).findings
    (note,) = [one for one in found if "limit" in one.message]
    assert note.line == 3


DIAGONAL = [
    ("marlin", b"M204 T2500", b"G0 X9 Y10"),
    ("marlin", b"M204 T3000", b"G0 X9 Y10"),
    ("marlin", b"M204 T2500", b"G0 X9 Z40.1"),
    ("klipper", b"SET_VELOCITY_LIMIT ACCEL=2500", b"G0 X9 Y10"),
    ("klipper", b"SET_VELOCITY_LIMIT VELOCITY=300", b"G0 X9 Y10"),
    ("klipper", b"SET_VELOCITY_LIMIT ACCEL=9000\nSET_VELOCITY_LIMIT ACCEL=2500", b"G0 X9 Y10"),
    ("duet", b"M204 T2500", b"G0 X9 Y10"),
]
IN_REACH = [
    ("marlin", b"M204 T3540", b"G0 X9 Y9"),
    ("marlin", b"M204 T3000", b"G0 X9 Y4"),
    ("marlin", b"M204 T500", b"G0 Z30"),
    ("marlin", b"M204 T600", b"G0 X1.1 Z30"),
    ("marlin", b"M204 T2500\nM204 T4000", b"G0 X9 Y9"),
    ("klipper", b"SET_VELOCITY_LIMIT ACCEL=3600 VELOCITY=430", b"G0 X9 Y9 Z30"),
    ("klipper", b"M204 S2500\nBED=1", b"G90\nG1 X1 Y1 Z1 F600\nG0 X9"),
    ("duet", b"M204 T3000", b"G0 X9 Y4"),
]


@pytest.mark.parametrize(("dialect", "line", "rapid"), DIAGONAL)
def test_a_limit_of_the_path_bounds_diagonals_more_than_single_axes(dialect, line, rapid):
    """Each axis at its own limit: together they are faster than that, by up to sqrt(3)."""
    assert reasons(dialect, line, rapid=rapid) == SET


@pytest.mark.parametrize(("dialect", "line", "rapid"), IN_REACH)
def test_a_limit_of_the_path_that_the_direction_does_not_reach_changes_nothing(
    dialect, line, rapid
):
    assert reasons(dialect, line, rapid=rapid) is None


def test_behind_a_macro_the_limit_of_the_path_may_still_hold():
    again = b"\nG90\nG21\nG1 X1 Y1 Z1 F600"
    line = b"SET_VELOCITY_LIMIT ACCEL=2500\nBED=1" + again
    assert reasons("klipper", line) is None
    assert reasons("klipper", line, rapid=b"G0 X9 Y9") == SET


def test_axes_that_run_on_their_own_may_all_be_fastest_at_once():
    assert reasons("marlin", b"M204 T3000", rapid=b"G0 X9 Y4", straight=False) == SET
    assert reasons("marlin", b"M204 T3600", rapid=b"G0 X9 Y4", straight=False) is None


def test_soft_is_a_limit_where_the_machine_file_has_no_jerk():
    free = {axis: (*limits[:2], float("inf")) for axis, limits in STATED.items()}
    assert reasons("siemens", b"SOFT", stated=free) == SET
    assert reasons("siemens", b"SOFT\nBRISK", stated=free) is None
    assert reasons("siemens", b"BRISK", stated=free) is None


@pytest.mark.parametrize("dialect", ["marlin", "duet"])
def test_a_rotary_axis_alone_is_held_to_its_own_limit(dialect):
    stated = {**STATED, "A": (400.0, 3000.0, 6e5)}
    turned = b"\nG1 X1 Y1 Z1 A1 F600"
    assert reasons(dialect, b"M204 T3000" + turned, stated=stated, rapid=b"G0 A5") is None
    assert reasons(dialect, b"M204 T2999" + turned, stated=stated, rapid=b"G0 A5") == SET


def test_of_linear_and_rotary_axes_together_all_limits_count():
    stated = {**STATED, "A": (400.0, 3000.0, 6e5)}
    state = State()
    state.limits = stated
    moved = np.zeros((1, len(AXES)))
    moved[0, [0, 3]] = 9.0, 5.0
    ways = {"X": 9.0, "A": 5.0}
    for limit, low in ((4600.0, True), (4700.0, False)):
        set_by_code(state, 204, {"T": limit}, find_dialect("marlin"), stated)
        assert beyond_path(state, moved).tolist() == [low]
        assert too_fast({"acceleration": limit}, ways, stated, together=True) == low
