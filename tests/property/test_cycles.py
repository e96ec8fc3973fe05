"""Cycles written out, over drawn programs: always accepted, and any change of a number noticed."""

import io
import re

from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from gcodejerk.cycles.expansion import expand
from gcodejerk.nc import read_program
from gcodejerk.testing.cycles import cycle_programs
from gcodejerk.testing.programs import programs
from gcodejerk.verification.cycles.expansion import check_expansion

CALM = settings(deadline=None, max_examples=60, suppress_health_check=list(HealthCheck))


def written(program, comments):
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target, comments=comments)
    return (target.getvalue() if found.written else program), found


def check(program, text):
    return check_expansion(io.BytesIO(program), io.BytesIO(text))


@CALM
@given(cycle_programs(), st.booleans())
def test_every_series_is_written_out_and_accepted(program, comments):
    text, found = written(program, comments)
    assert found.written == found.holes
    judged = check(program, text)
    assert judged.ok, (judged.violations, program, text)
    assert (judged.rewritten, judged.rapids) == (found.written, found.holes)


@CALM
@given(programs())
def test_programs_of_all_kinds_are_written_out_as_accepted(program):
    text, found = written(program, True)
    judged = check(program, text)
    assert judged.ok, (judged.violations, program, text)
    assert judged.rewritten == found.written


ODD_LINES = [
    *("G92 Z1", "G92.1", "G43.1 Z2", "G49", "G55", "G54", "G28 Z5", "G53 G0 Z1", "G10 L2 P1 X3"),
    *("G52 X1", "/X3", "/G80", "#1=3", "X[1+2]", "o1 if [1]", "o1 endif", "o2 call", "M98 P2"),
    *("G84 X1 Z-3 R2", "G84 X1 Z-3 R2 P1", "G88 X1 Z-3 R2 P1", "X3 G92.1", "X3 G54", "X3 M6 T1"),
    *("G20", "G21 F100", "G18", "G17", "G90", "G91", "G93", "G94 F50", "G95 F.3", "G7", "G8"),
    *(
        "G41 D1",
        "G40",
        "M2",
        "%",
        "M70",
        "M72",
        "M6 T1",
        "M19",
        "M5",
        "M3",
        "M4",
        "M62 P1",
        "M90 M3",
    ),
    *("G61", "G64 P.2", "G64 P-1", "G64 P#1", "G61.1", "R1", "R1 X2", "L0 X2", "X2 A3", "G81"),
    *("G81 X1 Z5 R1", "G38.2 Z-3 F10", "G33 Z-1 K1", "G0 X4..2", "G2 X3 I1", "X1" + 240 * "0"),
]


@CALM
@given(cycle_programs(), st.lists(st.sampled_from(ODD_LINES), max_size=3), st.data())
def test_whatever_stands_among_cycles_what_is_written_out_is_accepted(program, odd, data):
    lines = program.splitlines(keepends=True)
    for line in odd:
        lines.insert(data.draw(st.integers(0, len(lines) - 1)), line.encode() + b"\n")
    program = b"".join(lines)
    text, found = written(program, data.draw(st.booleans()))
    judged = check(program, text)
    assert judged.ok, (judged.violations, program, text)
    assert judged.rewritten == found.written


@CALM
@given(cycle_programs(), st.data())
def test_any_changed_number_is_noticed(program, data):
    text, _ = written(program, False)
    lines = text.split(b"\n")
    moves = [k for k, line in enumerate(lines) if re.match(rb"G[01] .*\d", line)]
    assume(moves and lines != program.split(b"\n"))
    k = data.draw(st.sampled_from(moves))
    numbers = list(re.finditer(rb"(?<=[XYZ])-?[\d.]+", lines[k]))
    at = data.draw(st.sampled_from(numbers))
    step = data.draw(st.sampled_from([-1.0, -0.001, 0.001, 0.25]))
    changed = b"%.4f" % (float(at[0]) + step)
    lines[k] = lines[k][: at.start()] + changed + lines[k][at.end() :]
    assert not check(program, b"\n".join(lines)).ok


@CALM
@given(cycle_programs(), st.data())
def test_any_lost_doubled_or_exchanged_move_is_noticed(program, data):
    text, _ = written(program, False)
    lines = text.split(b"\n")
    moves = [k for k, line in enumerate(lines) if re.match(rb"G[01] [XYZ]", line)]
    moves = [k for k in moves if lines[k] not in program.split(b"\n")]
    assume(moves)
    k = data.draw(st.sampled_from(moves))
    kind = data.draw(st.sampled_from(["lost", "doubled", "exchanged", "rapid and feed"]))
    if kind == "lost":
        del lines[k]
    elif kind == "doubled":
        lines.insert(k, lines[k])
    elif kind == "exchanged":
        assume(lines[k] != lines[k + 1])
        lines[k], lines[k + 1] = lines[k + 1], lines[k]
    else:
        lines[k] = lines[k][:2].translate(bytes.maketrans(b"01", b"10")) + lines[k][2:]
    assert not check(program, b"\n".join(lines)).ok, (kind, k)


@CALM
@given(cycle_programs())
def test_lines_lead_back_to_the_blocks_that_they_come_from(program):
    text, found = written(program, True)
    original = program.replace(b"\r", b"").split(b"\n")
    rapids = found.map.rapids_of(read_program(io.BytesIO(text)).rapids)
    for begin, end, line in zip(rapids.begin, rapids.end, rapids.line, strict=True):
        assert program[begin:end] == original[line - 1]
