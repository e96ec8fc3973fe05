"""Promises of reading, over drawn programs and over drawn bytes."""

import io
import math

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gcodejerk.axes import AXES
from gcodejerk.errors import ProgramError
from gcodejerk.nc import CERTAIN, Start, parse_block, read_program, trace
from gcodejerk.nc.dialects.dialect import LINEAR
from gcodejerk.nc.text.numbers import AROUND, LONGEST, parse_numbers
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
        st.from_regex(r"[-+]?([0-9]{1,9}(\.[0-9]{0,6})?|\.[0-9]{1,9})", fullmatch=True),
        min_size=1,
        max_size=50,
    )
)
def test_numbers_read_many_at_a_time_are_those_of_float(numbers):
    numbers = [number for number in numbers if len(number.lstrip("+-")) <= LONGEST]
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
