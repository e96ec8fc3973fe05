"""Promises of reading, over drawn programs and over drawn bytes."""

import io
import itertools
import math
import re

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.nc import CERTAIN, DIALECTS, Start, parse_block, read_program, trace
from gcodejerk.nc.dialects.dialect import LINEAR
from gcodejerk.nc.text.gaps import closed_up
from gcodejerk.nc.text.numbers import AROUND, parse_numbers
from gcodejerk.start import RapidFeed
from gcodejerk.testing.programs import differences, programs

QUICK = settings(max_examples=40, deadline=None, suppress_health_check=list(HealthCheck))
KNOWN = Start(
    positions=dict.fromkeys(AXES, 1.0),
    offsets={"G54": dict.fromkeys(AXES, 2.0)},
    tool_lengths={1: 3.0},
    startup="G21",
    wraps={"A": "none", "B": "shortest", "C": "sign"},
)

# What real lines are made of, so that drawn lines come near to them.
PIECES = st.sampled_from(
    [
        *("G0", "G1", "G2", "G3", "X1", "Y-2.5", "Z.5", "A90", "I1", "J0", "K2", "R5", "F100"),
        *("G90", "G91", "G20", "G21", "G18", "G81", "G80", "G99", "M2", "M6", "T1", "S500", "G41"),
        *("(c)", "(", ")", ";x", "%", "/", "N5", "#1=2", "X#1", "X[1+2]", "X1.2.3", "Y--1", "Z"),
        *("o1 sub", "o1 endsub", "o2 if [1]", "o2 endif", "o3 call", " ", "\t", "\r", "E5", "@1"),
        *("G28", "G92", "G53", "G10", "L2", "P1", "G43", "H1", "G93", "G95", "G7", "X1e5", "Q"),
        *("X123456789012345678", "Y0.00000000000000001", "g01x+1y-1", "(py,x)", "G64P0.1"),
    ]
)
LINE = st.lists(PIECES, max_size=5).map("".join)
MESSY = st.lists(LINE, min_size=1, max_size=60).map(lambda lines: "\n".join(lines).encode())
# A state in which runs are taken, so that the quick way is really gone.
CALM = b"G21 G90 G94 G17 G40 G0 X0 Y0 Z0\n"


@QUICK
@given(programs(), st.sampled_from([Start(), KNOWN]))
def test_quick_and_careful_reading_of_a_drawn_program_agree(data, start):
    assert differences(data, start) == []


@QUICK
@given(programs(), st.integers(1, 4))
def test_quick_and_careful_reading_agree_where_runs_are_long(data, times):
    body = b"\n".join(
        line
        for line in data.replace(b"\r\n", b"\n").split(b"\n")
        if not line.strip() or line.strip() not in (b"%", b"M2", b"M30")
    )
    assert differences(CALM + (body + b"\n" + b"X1\nY2\n" * 20) * times, Start()) == []


@QUICK
@given(MESSY)
def test_quick_and_careful_reading_of_messy_lines_agree(data):
    assert differences(CALM + data + b"\n" + b"X1Y1\n" * 30 + data, Start()) == []


# Lines by variables of which runs are made, and lines that are doubtful in one way or the other:
# variables of the control, unknown ones, numbers that are not certain, and lines of any kind.
RUNS = [
    *("#1=5.", "#2=[#1*2.5]", "#3=[#3+1]", "#1=#2", "#100=-.5", "N10 #1=1.", "#1 = 2. (so)"),
    *("G0 X[#1+#2]", "G1 Y[#1*2.] F100.", "X#1 Z[-#1]", "G0 Z[5.0-#1]", "G0 X#100", "G0 X-#1"),
    *("G0 X1.5 Y#1", "G0 X5.", "G1 Z-3.25", "", "(rest)", "g0 x#1 (a) y2.", "G0 X 5. Y #1"),
    *("G1 Y[#1/2.] F200", "X3. F150"),
]
DOUBTS = [
    *("#4=#5221", "#2=[1/0]", "#0=1", "#[#1]=2", "#5221=1", "#3004=1", "#3003=0", "#4109=3"),
    *("#501=#501", "#1=1. #2=#1", "#1=1. G0 X1.", "#30=123456.789", "/#1=2", "#5=[#1/3]"),
    *("G1 X#100 F#4", "Y#9", "G0 X#30 Y[#30*1000]", "G0 X[#1/3]", "G0X[ROUND[#1]]", "G#1 X1."),
    *("G1 X1. F#4109", "F#1", "F-#1", "G0 A#1", "G0 X[#1] X1.", "G2 X#1 Y0. I[#1/2.] J0.", "M#1"),
    *("N#1 G0 X1.", "S#1", "R#1", "G0 X#<depth>", "#<depth>=4.", "G65 P9 A1.", "M6 T1", "G91"),
    *("G90", "G20", "G21", "M98 P1", "M30", "G92 X#1", "G0 X+#1 Y--#1", "G0 Y[#1 EQ 5.]"),
    *("G1 X5", "Z1E#1", "G0 X#3 Y#2", "G0 X1E9 Y#1", "U#1", "G53 Z#1", "G61", "G64", "G28 Z0."),
]
R_RUNS = [
    *("R1=5", "R2=R1*2.5", "R3=R3+1", "N10 R1=2", "R1=R2 ; so", "G0 X=R1", "G0 X=R1+R2 Y5"),
    *("G1 Y=(R1*2) F100", "G0 X=5", "G0 X5 Y7.5", "G1 Z-3", "", "; rest", "X=-R1"),
]
R_DOUBTS = [
    *("R5=R1/3", "R1=1 R2=R1", "R9=$AA_IM[X]", "R[R1]=2", "$P_UIFR[1,X,TR]=1", "DEPTH=5"),
    *("DEF REAL DEPTH=2", "R4=SET(1,2)", "X=IC(R1)", "G0 X=R5", "G0 Z=DEPTH", "F=R1", "G0 X1=R1"),
    *("S1=R1", "T=R1", "G0 X=AC(R1)", "G2 X=R1 Y0 I=R1/2 J0", "MCALL", "TRANS X=R1", "G0 X=R9"),
    *("G91", "G90", "G0 A=R1", "G0 X=R3", "ROT RPL=R1", "G70", "G71", "SUPA Z=R1"),
]
UNROUNDED = [
    *RUNS,
    *("G0 X[#1/3] Y[#2*0.7]", "G1 X[50*SIN[#1]] F100.", "Z[#2/7]", "G0 X[50*COS[90]] Y[1/3]"),
    *("X[1.51463*0.375] Y-[#1/9]", "G2 X[#1/3] Y0. I[#1/6] J[#2/3]"),
]
"""Numbers of as many digits as a double has, which a control takes that rounds none."""
BY_VARIABLES = [
    ("linuxcnc", UNROUNDED, DOUBTS),
    *((name, RUNS, DOUBTS) for name in ("fanuc", "haas", "mach", "fanuc-lathe-b")),
    ("siemens", R_RUNS, R_DOUBTS),
]


def begun(dialect):
    """Lines behind which runs can be taken."""
    begin = ["G21 G90 G94 G17 G40 G49 G80", "G0 X0. Y0. Z0.", "G1 X1. F100."]
    known = ["#1=5.", "#2=2.", "#3=1.", "#100=1."]
    if "lathe" in dialect:
        begin[0] = "G21 G90 G94 G40"
    elif dialect == "siemens":
        begin[0], known = "G71 G90 G94 G17 G40 G64 D1", ["R1=5", "R2=2", "R3=1"]
    return [*begin, *known]


@pytest.mark.parametrize(("dialect", "sure", "doubtful"), BY_VARIABLES)
def test_runs_by_variables_are_taken_at_once(dialect, sure, doubtful):
    data = "\n".join([*begun(dialect), *sure * 20, ""]).encode()
    steps = [
        read_program(io.BytesIO(data), dialect=dialect, fast=fast).steps for fast in (True, False)
    ]
    assert 3 * steps[0] < steps[1]


@QUICK
@pytest.mark.parametrize(("dialect", "sure", "doubtful"), BY_VARIABLES)
@given(data=st.data())
def test_quick_and_careful_reading_agree_of_programs_by_variables(dialect, sure, doubtful, data):
    run = st.lists(st.sampled_from(sure), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from(doubtful), max_size=2)
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    lines = [*begun(dialect), *(line for run, odd in parts for line in (*run, *odd))]
    end = data.draw(st.sampled_from(["\n", "\r\n"]))
    start = Start(decimal_point=data.draw(st.sampled_from([None, "calculator"])))
    assert differences(f"{end.join(lines)}{end}".encode(), start, dialect) == []


# Lines of which those of a shape differ in typed numbers alone, and numbers for them: what a
# control makes of a line may depend on how large one is, on its digits, on what stands beside it.
SHAPES = [
    *("G0 X[{}*#1+#2] Y[#2-{}]", "G1 X-{} Y[-{}*#1] F100.", "N{} G0 X[{}+#1]", "X[#1*{}] Z-{}"),
    *("G2 X[{}*#1] Y[#2/{}] I[-{}*#1] J[{}]", "G0 Z[{}]", "#1=[{}*2.]", "#2=[#1-{}]", "Y[[{}+#2]]"),
]
ODD_SHAPES = [
    *("G0 X[#[{}]]", "X[2**{}]", "X[{} {}]", "G0 X[{}{}]", "X[{}.{}]", "Z[50*SIN[{}]*{}]", "F[{}]"),
    *(
        "G0 X[#1-{}] (-{})",
        "G-{} X[#1]",
        "Y0X[-{}]",
        "Y-{}X[{}*#1]",
        "X1E[{}]",
        "M-{} X[{}*#1]",
        "T-{}",
    ),
    *("X[#1 MOD {}]", "X[#1 EQ {}]", "N{}X[{}]G0", "X{} Y[{}]", "G0 X[ATAN[{}]/[{}]]", "/{} X[{}]"),
    *("G1 X[{}*#<a-{}>]", "G0 X[{}+#<\0{}>]", "X-{}\0 Y[{}*#1]", "n{} x[{}*#1]", "S[{}]", "T-{}"),
]
TYPED = [
    *("0", "1", "2.5", "5.", ".5", "0.125", "00.5", "12.345", "1.0000000001", "123456789", "0.1"),
    *("12345678.5", "999999999", "99999999999", "0.1234567890123456789", "0.00001", "1.2.3", "-3"),
]


@settings(QUICK, max_examples=100)
@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "haas", "mach", "any-mill", "centroid"])
@given(data=st.data())
def test_quick_and_careful_reading_agree_of_lines_of_one_shape(dialect, data):
    run = st.lists(st.sampled_from(SHAPES), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from(ODD_SHAPES), max_size=2)
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    shapes = [line for run, odd in parts for line in (*run, *odd)]
    few = data.draw(st.sampled_from([TYPED, TYPED[:6]]))
    numbers = data.draw(st.lists(st.sampled_from(few), min_size=20, max_size=60))
    typed = itertools.cycle(numbers)
    lines = [shape.format(*itertools.islice(typed, shape.count("{}"))) for shape in shapes]
    text = "\n".join([*begun(dialect), *lines, *data.draw(st.permutations(lines)), ""])
    assert differences(text.encode(), Start(), dialect) == []


PLAIN = [
    *(
        "G0 X1. Y2.",
        "G0 Z5.",
        "X3.5",
        "Y-2.",
        "Z-.5",
        "X1. Y1. Z1.",
        "G1 X2. F90.",
        "G1 Y3.",
        "",
        "G1 X3. F80",
    ),
    *("G0X1.Y2.", "G1Z-1.", "G2 X3. Y1. I1. J0.", "G3 X0. Y0. R5.", "(rest)", "N7 G0 X4."),
    *("G1 X3. F80", "X3.5 F120", "G0 Z2. F70"),
    *("G0 X12.345678901234567 Y.00000000000000000125", "G1 X-0.3333333333333333148296 F100."),
]
WHOLE = ["X5 Y-7", "G1 Z3 F80", "N8 G0 X1 Y2", "G2 X3 Y1 I1 J0", "F0", "G0 X0 Z4"]
"""Taken at once where the owner says what a number without a decimal point is."""
ODD = [
    *("(expr, a=5)", "(_do ,1)", "(print, 1)", "X5. (expr, 1)", "F0", "F0.", "G1 F0", "F80", "C5."),
    *("X1. X2.", "G1 X2.Z3. Z4.", "U1.", "A-0", "G91", "G90", "G20", "M98 P1", "GOTO 5", "/X1."),
    *("E5.", "S5", "$1=2", "T1", "D1", "H1", "x1.", "X 1.5", "X1 .5", "G01", "G1.0", "X1E2"),
    *("G54", "G55", "G92 X5. Y1.", "G52 Z2.", "G92.1", "TRANS X5", "ATRANS Y1", "G54 G91", "G53"),
    *("L X+5 FMAX", "5 L X+5", "*5", "N1X1.", "M220 S50", "M117 hello", "//x", "G17", "R2", "S"),
]
"""What some controls take for a command, a word of their own, or a mistake."""


@settings(QUICK, max_examples=150)
@given(st.sampled_from(sorted(DIALECTS)), st.data())
def test_quick_and_careful_reading_agree_in_every_dialect(dialect, data):
    point = data.draw(st.sampled_from([None, "calculator", "increment"]))
    plain = [*PLAIN, *WHOLE[: 6 * (point == "calculator")]]
    run = st.lists(st.sampled_from(plain), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from([*ODD, *WHOLE]), max_size=2)
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    lines = ["G21 G90 G94 G17 G40", "G0 X0. Y0. Z0.", "G1 X1. F100."]
    lines += [line for run, odd in parts for line in (*run, *odd)]
    start = Start(decimal_point=point)
    assert differences("\n".join([*lines, ""]).encode(), start, dialect) == []


SHIFTS = ["G54", "G54\nG55", "G92 X5. Y1.", "G52 X1.", "TRANS X5 Y2", "G54\nG65 P1", "M98 P7", ""]


@pytest.mark.parametrize("dialect", sorted(DIALECTS))
@pytest.mark.parametrize("shift", SHIFTS)
def test_quick_and_careful_reading_agree_behind_a_shift_of_the_frame(dialect, shift):
    begin = ["G21 G90 G94 G17 G40", "G0 X0. Y0. Z0.", "G1 X1. F100.", shift, "G0 Z5."]
    told = 30 * ["G0 X1.5", "G1 X2.5 F90."]
    by = ["G91", *30 * ["G0 X1. Y-1.", "G1 Z-1."], "G90", *30 * ["G0 Y1.5", "X2."]]
    for lines in ((*begin, *told, *by), (*begin, *by, *told), (*begin, "G53 G0 Z0", *by)):
        assert differences("\n".join([*lines, ""]).encode(), Start(), dialect) == []


@QUICK
@given(st.binary(max_size=400))
def test_any_bytes_are_read_or_refused_and_never_crash(data):
    try:
        program = read_program(io.BytesIO(data))
    except ProgramError:
        return
    assert program.size == len(data)
    assert differences(data) == []


@QUICK
@given(programs())
def test_a_rapids_span_is_its_line(data):
    program = read_program(io.BytesIO(data))
    rapids = program.rapids
    lines = data.split(b"\n")
    for i in range(len(rapids)):
        text = data[rapids.begin[i] : rapids.end[i]]
        end = [b"", b"\n", b"\r\n", b"\r"][rapids.terminator[i]]
        assert data[rapids.end[i] : rapids.end[i] + len(end)] == end
        assert lines[rapids.line[i] - 1].rstrip(b"\r") == text
    assert np.all(np.diff(rapids.line) > 0)


@QUICK
@given(programs())
def test_knowing_more_at_the_start_never_contradicts_knowing_less(data):
    """Unknown stays unknown: a position known without a start is the same with any start."""
    knowing = trace(io.BytesIO(data), start=KNOWN)
    for less, more in zip(trace(io.BytesIO(data)), knowing, strict=True):
        for axis, a, b in zip(AXES, less[1], more[1], strict=True):
            # Which turn a rotary axis is in, only the machine file tells: see `Start.wraps`.
            turns = axis not in LINEAR and abs(math.remainder(a - b, 360.0)) < 1e-6
            assert math.isnan(a) or a == b or turns or (math.isnan(b) and axis not in LINEAR)


@QUICK
@given(programs())
def test_a_certain_rapid_knows_every_axis_that_it_moves(data):
    rapids = read_program(io.BytesIO(data)).rapids
    for i in np.flatnonzero(rapids.reason == CERTAIN):
        for k in range(len(AXES)):
            if rapids.words[i] >> k & 1:
                assert np.isfinite(rapids.start[i, k])
                assert np.isfinite(rapids.target[i, k])
            else:
                np.testing.assert_equal(rapids.start[i, k], rapids.target[i, k])


@QUICK
@given(st.binary(max_size=80).filter(lambda b: b"\n" not in b))
def test_words_and_comments_of_a_block_are_where_they_say(text):
    block = parse_block(text)
    for word in block.words:
        assert text[word.begin : word.end] == word.text
        assert word.text[:1].decode().upper() == word.letter
    for begin, end in block.comments:
        assert text[begin : begin + 1] in (b"(", b";")
        assert end <= len(text)
    if block.problem is None and block.o_word is None and not block.percent:
        read = sum(w.end - w.begin for w in block.words)
        read += sum(end - begin for begin, end in block.comments)
        assert read <= len(text)


@QUICK
@given(
    st.lists(
        st.from_regex(r"[-+]?([0-9]{1,9}(\.[0-9]{0,25})?|\.[0-9]{1,25})", fullmatch=True),
        min_size=1,
        max_size=50,
    )
)
def test_numbers_read_many_at_a_time_are_those_of_float(numbers):
    text = " " * AROUND + " ".join(numbers) + " " * AROUND
    begins, at = [], AROUND
    for number in numbers:
        begins.append(at)
        at += len(number) + 1
    begin = np.array(begins, dtype=np.int64)
    end = begin + np.array([len(number) for number in numbers], dtype=np.int64)
    source = np.frombuffer(text.encode(), dtype=np.uint8)
    value = parse_numbers(source, begin, end)
    assert list(map(str, value.tolist())) == [str(float(number)) for number in numbers]


UNTOLD = [
    *((), ("G90",), ("G91",), ("G21",), ("G17 G90",), ("G90 G94",), ("G18 G94",), ("F100.",)),
    *(("G40 G90", "G21"), ("G17", "G94", "G20"), ("G90 G21 G40 G17", "G0 X1. Y2. Z3."), ("G93",)),
]
"""What a program may state; it depends on the control what is known of the rest."""
LOSSES = ["G999", "M428", "G41 D1", "G42 D1 X5. Y5.", "G40", "G40 X1.", "G0 G91", "X1 Y1 X2", "G18"]
MORE = ["G2 X3. Z1. I1. K0.", "G3 Y0. Z1. R5.", "I1. J1.", "G0 I2. J0.", "G2 I1.", "X0.", "R4."]


@settings(QUICK, max_examples=250)
@given(st.sampled_from(sorted(DIALECTS)), st.sampled_from(UNTOLD), st.booleans(), st.data())
def test_quick_and_careful_reading_agree_where_little_is_known(dialect, stated, known, data):
    run = st.lists(st.sampled_from([*PLAIN, *MORE]), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from([*LOSSES, *(line for told in UNTOLD for line in told)]))
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    lines = [*stated, *(line for run, odd in parts for line in (*run, *odd[:2]))]
    start = Start(
        positions={"X": 1.0, "Y": -2.0, "Z": 5.0} if known else {},
        rapid_feed=data.draw(st.sampled_from([None, RapidFeed(90.0, -1.0)])),
    )
    assert differences("\n".join([*lines, ""]).encode(), start, dialect) == []


@pytest.mark.parametrize(
    "dialect", ["fanuc", "haas", "fanuc-lathe-b", "linuxcnc", "mach", "siemens"]
)
@pytest.mark.parametrize("stated", ["", "G90", "G21", "G94 G21", "G90 G21 G40", "G41 D1", "M999"])
def test_runs_are_taken_at_once_whatever_is_not_known(dialect, stated):
    lines = [stated, "G0 X1. Z1.", "G1 X2. F90.", *["X3. Z2.", "G1 X4. Z-1.", "G0 X5."] * 500]
    data = "\n".join(lines).encode()
    assert read_program(io.BytesIO(data), dialect=dialect).steps < 60


TURNING = [
    *("G0 X1. A90.", "G1 X2. A-45. F90.", "A100.5", "A359.", "A-0.", "A-360.", "G0 A0.", "A720."),
    *("G0 A12.345", "X3. A12.345", "G1 A180.", "G0 A190.", "B30.", "G0 B-30. Y2.", "C15. Z1."),
    *("G1 X5.", "", "G0 X4. F80.", "A89.9999999999", "G0 A450.", "A-1.5 B2. C-3.", "G0 C0."),
]
WRAPS = [None, "none", "shortest", "sign"]


@settings(QUICK, max_examples=150)
@given(st.sampled_from(WRAPS), st.sampled_from(WRAPS), st.booleans(), st.data())
def test_quick_and_careful_reading_agree_where_rotary_axes_turn(wrap, other, known, data):
    dialect = data.draw(st.sampled_from(["linuxcnc", "fanuc", "haas", "mach", "grbl", "siemens"]))
    run = st.lists(st.sampled_from(TURNING), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from(["G91", "G90", "G2 X9. Y2. I4. A5.", "A#1", "M6", "F0.", "G93"]))
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    begin = begun(dialect)[:3] + (["A5. B-5.", "G0 C359."] if known else [])
    lines = [*begin, *(line for run, odd in parts for line in (*run, *odd[:2]))]
    wraps = {axis: wrap for axis, wrap in (("A", wrap), ("B", other)) if wrap is not None}
    start = Start(wraps=wraps, positions={"A": 725.0, "B": 0.0, "C": 0.0} if known else {})
    assert differences("\n".join([*lines, ""]).encode(), start, dialect) == []


@pytest.mark.parametrize("wrap", WRAPS)
def test_runs_are_taken_at_once_where_rotary_axes_turn(wrap):
    begin = [*begun("linuxcnc")[:3], *["G1 X1. A5.", "X2. A-6.", "X3. A7."] * 500]
    start = Start(wraps={} if wrap is None else {"A": wrap})
    read = read_program(io.BytesIO("\n".join(begin).encode()), dialect="linuxcnc", start=start)
    assert read.steps < 50


GAPS = [
    *(
        "G0 X  5.000 Y -2.5",
        "G1 Z   -1.500",
        "X 3.",
        "G 1 X5. F 90",
        "N 7 G0 X1.",
        "(X 5)",
        "Y\t2.",
    ),
    *("G0 Z  15.", "G2 X 3. Y 1. I 1. J0.", "X 0", "G1X 1.Y 2.", "z 4.", "G0 A 5. (and B 6)"),
]
BAD_GAPS = [
    *(
        "X 1 2.5",
        "X - 5.",
        "X . 5",
        "G 0 1",
        "X  5. X 4.",
        "Z 5 5",
        "(print, X 5)",
        "X 5 (a",
        "N X 5",
    ),
    *(
        "E 5.",
        "X #1",
        "G1 2",
        "S 5",
        "T 1",
        "F 0",
        "X 0X 5",
        "M 30 X 5",
        "X 5. 0",
        "X 123456789012",
    ),
]


@settings(QUICK, max_examples=200)
@given(st.sampled_from(sorted(DIALECTS)), st.data())
def test_quick_and_careful_reading_agree_where_blanks_stand_in_front_of_numbers(dialect, data):
    run = st.lists(st.sampled_from([*GAPS, *PLAIN]), min_size=8, max_size=40)
    odd = st.lists(st.sampled_from(BAD_GAPS), max_size=2)
    parts = data.draw(st.lists(st.tuples(run, odd), min_size=1, max_size=4))
    lines = ["G21 G90 G94 G17 G40", "G0 X0. Y0. Z0.", "G1 X1. F100."]
    lines += [line for run, odd in parts for line in (*run, *odd)]
    assert differences("\n".join([*lines, ""]).encode(), Start(), dialect) == []


GAP = re.compile(rb"([A-Za-z])([ \t]+)([-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+))")


@settings(QUICK, max_examples=500)
@given(st.lists(st.sampled_from(b"XYg  \t..-+0159\n\r(;#[\xc4"), max_size=60).map(bytes))
def test_blanks_in_front_of_numbers_are_put_behind_them(text):
    assert closed_up(text) == GAP.sub(rb"\1\3\2", text)


@pytest.mark.parametrize(
    "dialect",
    [
        *("linuxcnc", "grbl", "mach", "rs274", "fanuc", "haas", "fanuc-lathe-a", "any-mill"),
        *("mitsubishi", "centroid", "uccnc", "heidenhain-iso"),
    ],
)
def test_runs_are_taken_at_once_where_blanks_stand_in_front_of_numbers(dialect):
    lines = ["G21 G90 G94 G17 G40", *["G0 X  1.000 Y  5.500", "G1 X 2.5 F  90"] * 500, ""]
    assert read_program(io.BytesIO("\n".join(lines).encode()), dialect=dialect).steps < 60


@pytest.mark.parametrize("plane", ["G17", "G18", "G19"])
@pytest.mark.parametrize("distance", ["G90", "G91"])
def test_feed_moves_that_count_as_rapids_are_the_same_under_compensation(plane, distance):
    lines = [f"G21 G94 G90 {plane} G40", "G0 X0. Y0. Z5.", "G1 X1. F90.", f"G41 D1 {distance}"]
    lines += ["X2. Y1.", "Z6.", "X3. Y0.", "Z5. X4."] * 10
    start = Start(rapid_feed=RapidFeed(90.0, 1.0))
    assert differences("\n".join([*lines, ""]).encode(), start, "linuxcnc") == []
