"""Firmwares' own interpreters beside our reading: they do what is certain of drawn programs.

What is drawn is what no one writes on purpose: words that a control has no use for, odd numbers,
codes of other controls, two commands on a line. `firmware.py` says which checkouts this needs.
"""

import io
import math
import re

import pytest
from firmware import run_fluidnc, run_grbl, run_grblhal, run_klipper, run_marlin
from hypothesis import given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.errors import GcodejerkError
from gcodejerk.nc import CERTAIN, Start, read_program, trace
from gcodejerk.units import MM_PER_INCH

MANY = settings(max_examples=1500)
NEAR = 2e-4
"""Firmwares count in 24 bits. [mm]"""

ENDS = re.compile(r"(?i)M\s*(2|30)\b")

number = st.one_of(
    st.integers(-30, 60).map(str),
    st.floats(-20.0, 50.0).map("{:.2f}".format),
    st.floats(-5.0, 5.0).map("{:.3f}".format),
    st.sampled_from(["5.", ".25", "+7", "-.5", "007", "", "1e1", "1.2.3", "- 3", "1 2"]),
)
rate = st.sampled_from(["100", "1200", "3000", "600.5", "60", "0", "-5"])
blank = st.sampled_from([" ", " ", " ", " ", "", "\t"])
tail = st.sampled_from([""] * 9 + [" ; c", " (X9)", " *5", "*71", " %", "; X99"])


@st.composite
def moves(draw, codes, others):
    """A line with some axes, perhaps F, perhaps a letter that may have no use there."""
    code, between = draw(st.sampled_from(codes)), draw(blank)
    letters = draw(st.lists(st.sampled_from("XYZ"), max_size=3, unique=True))
    words = [letter + draw(number) for letter in letters]
    if draw(st.integers(0, 3)) == 0:
        words.append("F" + draw(rate))
    if code in ("G2", "G3"):
        words += draw(st.sampled_from([["I3", "J2"], ["R9"], ["I5", "K1"], []]))
    elif draw(st.integers(0, 9)) == 0:
        words.append(draw(st.sampled_from(others)) + draw(number))
    return between.join([code, *draw(st.permutations(words))]) + draw(tail)


def parts(text):
    """What stands between strokes, and an empty one."""
    return ["", *(part.strip() for part in text.split("|"))]


def programs(heads, codes, others, lines):
    """Lines of programs."""
    line = st.one_of(moves(codes, others), moves(codes, others), st.sampled_from(lines))
    body = st.lists(line, min_size=2, max_size=12)
    return st.tuples(st.sampled_from(heads), body).map(lambda parts: [*parts[0], *parts[1]])


def start_of(known, **facts):
    limits = dict.fromkeys("XYZ", (300.0, 2500.0, 6e5))
    positions = dict.fromkeys("XYZ", 0.0) if known else {}
    return Start(positions=positions, limits=limits, resume="same", spindle="mill", **facts)


def contradicted(lines, dialect, start, ran):
    """What the firmware did otherwise than our reading says for certain."""
    data = "".join(f"{line}\n" for line in lines).encode("latin-1")
    try:
        rapids = read_program(io.BytesIO(data), dialect=dialect, start=start).rapids
    except GcodejerkError:
        return []
    wrong = []

    def hold(line, what, ours, theirs):
        scale = max(1.0, abs(theirs) / 50.0)
        if not math.isnan(ours) and not abs(ours - theirs) <= NEAR * scale:
            wrong.append(f"line {line}: {what} is {theirs:g}, not {ours:g}")

    for line, positions, _ in trace(io.BytesIO(data), dialect=dialect, start=start):
        for axis, place in zip(AXES, positions, strict=True):
            if line <= len(ran) and axis in ran[line - 1].end:
                hold(line, axis, place, ran[line - 1].end[axis])
    for i in [k for k, reason in enumerate(rapids.reason) if reason == CERTAIN]:
        line = int(rapids.line[i])
        done = ran[line - 1]
        if done.refused or done.motions != 1 or done.rapids not in (1, None):
            wrong.append(f"line {line}: no rapid")
        if ENDS.search(lines[line - 1]):
            continue  # M2 beside it puts other modes and another frame in force
        for k, axis in enumerate("XYZ"):
            hold(line, f"start of {axis}", rapids.start[i, k], done.start[axis])
            hold(line, f"end of {axis}", rapids.target[i, k], done.end[axis])
            hold(line, f"offset of {axis}", rapids.offset[i, k], done.offset[axis])
        if (rapids.incremental[i], rapids.inch[i]) != (done.incremental, done.inch):
            wrong.append(f"line {line}: another mode")
        if rapids.feed_mode[i] == 94:
            unit = MM_PER_INCH if done.inch else 1.0
            hold(line, "F", rapids.feed[i] * unit, done.feed)
        hold(line, "speed", rapids.speed[i] * 60.0, done.feed)
    return wrong


KLIPPER = programs(
    [["G90", "G21", "G0 F3000 X0 Y0 Z5"], ["G90"], []],
    parts(
        """G0 | G0 | G0 | G0 | G0 | G0 | G0 | G0 | G1 | G1 | G00 | g0 | G2 | G3 | G0.1 | G90 G0 |
        N5 G0 | M400 G0 | T0"""
    ),
    "EABCUVWIJKRSPQH",
    parts(
        """G90 | G91 | G92 X0 | G92 | G92 E0 | G92 A3 | G92 F5 | G92 X1 A2 | G28 | G28 X | G28 A |
        G20 | G21 | G4 P1 | M82 | M83 | M220 S50 | M220 S100 | M400 | M204 S9 | M117 G0 X5 |
        SET_GCODE_OFFSET X=1 | SET_GCODE_OFFSET Z_ADJUST=.1 MOVE=1 | SAVE_GCODE_STATE NAME=a |
        RESTORE_GCODE_STATE NAME=a | RESTORE_GCODE_STATE NAME=a MOVE=1 | FOO X=1 | G10 | G11 |
        G17 | G18 | G54 | T0 | T0 G91 | X5 G91 | F300 G0 X3 | G91 F100 | F60 | G90 X5 | X5 |
        G091 | N7G90 | G91*34 | (c) | ; c | G0 | G0 F900 | G0 E5 | G0 X | G0;X5 | G0X5Y3 |
        g1 f300 x2 | G0 X5 Y3 Q | M106 M400 | G1 F0 | G92 X1 F9"""
    ),
)


@MANY
@given(KLIPPER, st.booleans(), st.booleans())
def test_klipper_does_what_is_certain(lines, known, arcs):
    before = [] if known else ["G91", "G92 X3", "G1 X8 Y5 Z-2 F5400", "G92 Y1 Z4", "M83"]
    ran = run_klipper(lines, arcs, before)
    assert not contradicted(lines, "klipper", start_of(known), ran)


MARLIN = programs(
    [["G90", "G21", "G0 F3000 X0 Y0 Z5"], ["G90"], ["G90", "G28"], []],
    parts(
        """G0 | G0 | G0 | G0 | G0 | G0 | G0 | G0 | G1 | G1 | G00 | g0 | G2 | G3 | G0.1 | G90 G0 |
        G5 |
        N5 G0 | M400 G0 | T0 | G+0 | G 0 | G0. | G28 | G92 | M204 | M82 G0 | G53 G0 | G53 | G54 |
        G92.1 | G28.1 | G60 | G61"""
    ),
    "EABCUVWIJKRSPQHLDT",
    [
        *parts(
            r"""G90 | G91 | G92 X0 | G92 | G92 E0 | G92 A3 | G92 F5 | G92 X1 A2 | G28 | G28 X |
            G28 A |
            G28 O | G28 R5 | G20 | G21 | G4 P1 | M82 | M83 | M220 S50 | M220 S100 | M220 | M220 B |
            M220 R | M400 | M204 S9 | M117 G0 X5 | M118 G0 X5 | G10 | G11 | G17 | G18 | G54 | G55 |
            G53
            | G59.1 | T0 | T1 | T0 G91 | X5 G91 | F300 G0 X3 | G91 F100 | F60 | G90 X5 | X5 | G091 |
            N7G90 | G91*34 | (c) | ; c | G0 | G0 F900 | G0 E5 | G0 X | G0;X5 | G0X5Y3 | N 5 G91 |
            N5 G91 | N-5 G91 | g1 f300 x2 | G0 X5 Y3 Q | M106 M400 | G1 F0 | G92 X1 F9 | M206 X3 |
            M428
            | M211 S1 | M211 S0 | M999 | M500 | M501 | M502 | G60 S0 | G61 S0 | G61 X | M114 | M17 |
            M18 | M84 X | M73 P5 | M75 | M201 X500 | M203 X500 | M205 X9 | M92 X80 | M92 X40 |
            M218 T1 X5 | M302 | G0X0x10 | G0Y0X10 | G0 X1E1 | G0 X1e1 | G0 X5 X6 | G0 X5,Y3 |
            G0 X5 (c) Y2 | (c) G0 X5 | G0 (X9) X5 | G1 X5 ;(c | G0 ( X3 | G0 X5 "c" Y3 | G0 F |
            G0 FX5
            | G0 X5 F | G0 X-.5 Y+.5 | G0 X--5 | G0 X5- | G0 X. | G0 Z | G0 XYZ5 | GO X5 | G0x5 |
            G0 X 5 | G0 X$5 | G0 /X5 | /G0 X5 | % | O1 | M2 | M30 | M3 S9 | M5 | M3 I | G1 X5 S9 |
            @pause | !G0 X3 | G0 X5! | G80 | G38.2 X5 | G27 | M24 | M26 | M808 | M810 G0X5 | M810 |
            M486 S1 | M486 P1 | M486 S-1 | D5 | U5 G91 | H | Y2 | E5 | S5 | P2 | I5 J2 | F-5 | F0 |
            G2 X5 Y0 I2.5 | G3 X1 I5 Z-2 | G2 I5 | G2 I5 X10 | G3 X5 Y5 R9 F80"""
        ),
        "G0 X5\tY3",
        "\tG0 X5",
        f"G0 Y1 {'Q1 ' * 40}X7",
    ],
)


@pytest.mark.parametrize("extras", [False, True])
@MANY
@given(MARLIN, st.booleans(), st.sampled_from(["file", "bare", "sent"]))
def test_marlin_does_what_is_certain(extras, lines, known, way):
    before = [] if known else ["G91", "G92 X3", "G1 X8 Y5 Z-2 F5400", "G92 Y1 Z4", "M83"]
    ran = run_marlin(lines, extras, way, before)
    assert not contradicted(lines, "marlin", start_of(known), ran)


GRBL = programs(
    [
        ["G21 G90 G94", "G0 X0 Y0 Z5", "F300"],
        ["G21 G90 G94 G17 G54 G40 G49 G80", "G1 X1 Y1 Z1 F1000"],
        ["G90 G21"],
        [],
    ],
    parts(
        """G0 | G0 | G0 | G0 | G0 | G1 | G1 | G1 | G00 | g1 | G0.0 | G2 | G3 | G53 G0 | G91 G1 |
        G0 G91 | G20 G0 | G80 | G93 G1 | G0 T3 | /G0 | G55 G0 | G43.1 | G38.2 | G28 | G92 | G61.1 |
        G10 L2 P1 | G10 L20 P2 | G28.1 | G81 | G83 | G7 G0 | G51 | G64 P.1 G0 | G0 M3 S9"""
    ),
    "ABCUVWIJKRSHPQTDLE",
    parts(
        """G90 | G91 | G20 | G21 | G17 | G18 | G92 X0 | G92 | G92.1 | G92.2 | G28 | G28 X1 | G30 |
        G28.1 | G4 P.1 | G4 | G4 X3 | G4 P0 X3 | G54 | G55 | G56 X1 | G59.1 | G53 X1 | G43.1 Z3 |
        G43.1 X2 | G43 H1 | G49 | G49 X3 | G43.1 | G10 L2 P1 X1 | G10 L20 P1 X0 | G10 L2 P1 | G40 |
        G41 | G80 | G80 X3 | G98 | G99 | G93 | G94 | G95 | G61 | G64 | G7 | G8 | G50 | G51 X2 P3 |
        G65 P1 | G68 R30 | G69 | G15 | M0 | M2 | M30 | M3 S9 | M5 | M6 | M6 T2 | T1 | T300 | T-1 |
        T1.5 X2 | M7 | M9 | M62 P1 | M98 P1 | F200 | F0 | F-1 | X5 | X1 Y2 | I5 | R3 | P1 | H1 |
        L1 | A5 | U1 | (X5 | % | O100 | /X5 | #1=5 | X#1 | X[1] | $ | $X | G90 G91 | G0 G1 X1 |
        G0G80 | G2 X5 Y0 I2.5 | G2 X5 Y5 R9 F80 | G2 I5 | G1 X5 | G1 | G0 | G92 G0 X1 | G4 P0 G0 |
        G38.2 X3 F9 | G0 X1 M2 | G91 M30 | M3 M5 | G54 G55 | G81 X1 Z-1 R3 | X4 Y4 | G91 G1 |
        G1 F0 | G92 G0 X1 | G0 G92 X1 | G43.1 G0 Z3 | G28 G1 X3 | N99999999 G0 X2 | N-5 G0 X3 |
        G0 X5 / Y3 | N5 /G0 X3 | /N5 G91 | G0 (a;b) X5 | G1 X2 F100 (a ; b) G91 | (a;b) G20 |
        G0 X3 (a (b) c) | G0 X3 ) Y2 | (a (b) G0 X9 | G0 X1 (open | (c) (d) G0 X4 | G0 X0x10 |
        #<a>=2 | o1 if [1] | [ESP1] | G0 X[1+2] | M61 Q1 | M67 E1 Q3 | G38.6 X3 F9 | G5.1"""
    )
    + [f"G0 X7 ({'c' * n}) Y2" for n in (60, 90, 120, 300)]
    + [f"({'c' * n})" for n in (130, 300)],
)


@pytest.mark.parametrize("dialect", ["grbl", "rs274"])
@pytest.mark.parametrize("run", [run_grbl, run_grblhal, run_fluidnc])
@MANY
@given(GRBL, st.booleans(), st.booleans())
def test_grbl_does_what_is_certain(run, dialect, lines, known, offsets):
    before = ["G20", "G92 X3", "G10 L2 P1 X7 Y1", "G1 F77 X3 Y2", "G43.1 Z4", "G80"]
    facts = {"offsets": {"G54": dict.fromkeys("XYZ", 0.0)}} if known and offsets else {}
    start = start_of(known, startup="G21" if known else "", **facts)
    ran = run(lines, before=() if known else before)
    assert not contradicted(lines, dialect, start, ran)


@pytest.mark.parametrize(
    ("lines", "wrong"),
    [
        (["G90", "G0 F3000 X7 Y2 Z5", "G92 A3", "G0 X5"], "start of X"),
        (["G90", "G0 F3000 X7 Y2 Z5", "G0 Y1 F0"], "line 3: Y"),
        (["G90", "G0 F3000 X7 Y2 Z5", "T0 G91", "G0 X5 Y2 Z5", "G0 X5"], "another mode"),
    ],
)
def test_a_reading_that_is_wrong_of_a_firmware_is_found(lines, wrong):
    """That of another control, which takes these lines otherwise than Klipper does."""
    start = start_of(known=True, startup="G21")
    found = contradicted(lines, "linuxcnc", start, run_klipper(lines, arcs=False))
    assert any(wrong in said for said in found)
