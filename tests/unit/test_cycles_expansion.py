"""Drilling cycles written out: which, what becomes of them, and the way back to the original."""

import io
from dataclasses import replace

import numpy as np
import pytest

from gcodejerk.cycles.expansion import expand
from gcodejerk.errors import EmitError, ProgramError
from gcodejerk.nc import DIALECTS, Start, read_program
from gcodejerk.verification.cycles.expansion import check_expansion

HEAD = b"G21 G90 G64 P0.05 G98\nF100 M3 S500\nG0 X0 Y0 Z10\n"


def expanded(program, start=None, comments=False):
    """The result as lines behind HEAD, and what was found."""
    target = io.BytesIO()
    found = expand(
        io.BytesIO(program),
        target,
        start=Start(startup="G21") if start is None else start,
        comments=comments,
    )
    text = target.getvalue()
    return text.removeprefix(HEAD).decode().splitlines(), found


def test_a_series_ends_with_g80_and_everything_else_is_kept():
    lines, found = expanded(HEAD + b"G81 X1 Y1 Z-5 R2\nM8 (on)\nX3\nG80 \nG0 X9\nM2\n")
    assert lines == [
        *("G61", "G0 X1 Y1", "G0 Z2.", "G1 Z-5.", "G0 Z10.", "G64 P0.05"),
        "M8 (on)",
        *("G61", "G0 X3", "G0 Z2.", "G1 Z-5.", "G0 Z10.", "G64 P0.05"),
        *("G80 ", "G0 X9", "M2"),
    ]
    assert (found.holes, found.written, found.findings) == (2, 2, ())


def test_other_words_and_comments_of_a_block_stand_in_front_and_stops_behind():
    lines, _ = expanded(HEAD + b"N7 G99 G81 X1 (here) Z-5 R2 F80 M8 M1 ;end\nG80\nM2\n")
    assert lines[0].split() == ["N7", "G99", "(here)", "F80", "M8", ";end"]
    assert lines[1:-2] == ["G61", "G0 X1", "G0 Z2.", "G1 Z-5.", "G0 Z2.", "G64 P0.05", "M1"]


def test_a_comment_names_each_block_and_is_short():
    lines, _ = expanded(HEAD + b"G81 X1 Y1 Z-5 R2\nX3 Y2\nG80\nM2\n", comments=True)
    assert [x for x in lines if x[0] == "("] == [
        "(gcodejerk: G81 X1 Y1 Z-5 R2)",
        "(gcodejerk: X3 Y2)",
    ]
    long = b"G81 X" + b"0" * 80 + b"1 Z-5 R2\nG80\nM2\n"
    lines, _ = expanded(HEAD + long, comments=True)
    assert len(lines[0]) <= 69


@pytest.mark.parametrize("code", [b"g 0 8 1", b"G081.0", b"G+81", b"G 00 81."])
def test_a_cycle_is_found_however_it_is_spelled(code):
    lines, found = expanded(HEAD + code + b"X1 Z-5 R2\nG80\nM2\n")
    assert found.written == 1
    assert lines[1] == "G0 X1"


def test_increments_are_exact():
    lines, _ = expanded(HEAD + b"G91 G81 X0.1 Y.2 Z-5.1 R-7.3 L3\nG80\nM2\n")
    down = ["G0 Z-7.3", "G1 Z-5.1", "G0 Z12.4"]
    assert lines[2:-3] == ["G0 X0.1 Y.2", *down] * 3
    assert lines[:2] == ["G91", "G61"]


def test_inches_peck_by_a_hundredth_of_an_inch():
    program = b"G20 G90 G61 G99\nF10\nG0 X0 Y0 Z1\nG73 X1 Z-.5 R.1 Q.4\nG80\nM2\n"
    lines, _ = expanded(program)
    assert lines[3:-2] == ["G0 X1", "G0 Z0.1", "G1 Z-0.3", "G0 Z-0.29", "G1 Z-0.5", "G0 Z0.1"]


def test_a_tolerance_in_the_other_unit_is_restored_as_the_same_length():
    start = Start(startup="G17 G21 G64 P0.01 G90")
    lines, _ = expanded(b"G20 G99\nF10\nG0 Z1\nG81 X1 Z-.5 R.1\nG80\nM2\n", start)
    assert lines[-3].startswith("G64 P0.00039370078740")


def test_a_spindle_that_the_cycle_stops_turns_on_as_it_did():
    lines, _ = expanded(HEAD + b"M4\nG86 X1 Z-5 R2 P.5\nG80\nM2\n")
    assert lines[2:-3] == ["G0 X1", "G0 Z2.", "G1 Z-5.", "G4 P0.5", "M5", "G0 Z10.", "M4"]


def test_without_a_known_path_mode_every_move_comes_to_rest():
    lines, found = expanded(b"G21 G90 G98 F100\nG0 X0 Y0 Z10\nG82 X1 Z-5 R2 P1\nG80\nM2\n")
    assert found.written == 1
    assert lines[2:-2] == ["G0 X1", "G4 P0", "G0 Z2.", "G4 P0", "G1 Z-5.", "G4 P1.", "G0 Z10.",
                           "G4 P0"]  # fmt: skip


@pytest.mark.parametrize("mode", [b"G61", b"G61.1"])
def test_in_exact_path_mode_the_path_mode_is_not_touched(mode):
    program = HEAD.replace(b"G64 P0.05", mode) + b"G81 X1 Z-5 R2\nG80\nM2\n"
    lines, _ = expanded(program)
    assert not [line for line in lines[3:] if line.startswith("G6")]


def test_line_ends_and_a_missing_last_one_are_kept():
    program = HEAD.replace(b"\n", b"\r\n") + b"G81 X1 Y1 Z-5 R2\r\nX3"
    target = io.BytesIO()
    assert expand(io.BytesIO(program), target).written == 2
    text = target.getvalue()
    assert text.endswith(b"\r\nG64 P0.05")
    assert text.count(b"\n") == text.count(b"\r\n")


CYCLE = b"G81 X1 Y1 Z-5 R2\n"
LEFT = {
    "tapping": (b"G84 X1 Z-5 R2\nG80\n", "only the controller"),
    "operator": (b"G88 X1 Z-5 R2 P1\nG80\n", "only the controller"),
    "one of two": (CYCLE + b"G84 X1 Z-5 R2\nG80\n", "only the controller"),
    "block delete": (CYCLE + b"/X3\nG80\n", "block delete"),
    "deleted end": (CYCLE + b"/G80\nG0 X3\n", "block delete"),
    "expression": (CYCLE + b"X[1+2]\nG80\n", "expression"),
    "assignment": (CYCLE + b"#1=3\nX3\nG80\n", "expression"),
    "subprogram": (b"o1 sub\n" + CYCLE + b"G80\no1 endsub\no1 call\n", "subprogram"),
    "call": (CYCLE + b"o1 call\nG80\n", "subprogram"),
    "borrowed dwell": (b"G82 X1 Z-5 R2 P1\nG80\nG84 X2 Z-5 R2\nG80\n", "takes its dwell"),
    "dwell that may be borrowed": (b"G82 X1 Z-5 R2 P1\nG80\no<tap> call\n", "takes its dwell"),
    "loop": (b"o1 repeat [2]\n" + CYCLE + b"G80\no1 endrepeat\n", "subprogram"),
    "frame": (CYCLE + b"G92 Z5\nX3\nG80\n", "something else stands between"),
    "offset": (CYCLE + b"G55\nX3\nG80\n", "something else stands between"),
    "tool": (CYCLE + b"T2 M6\nX3\nG80\n", "something else stands between"),
    "home": (CYCLE + b"G28 Z5\nX3\nG80\n", "something else stands between"),
    "in the block": (b"G54 " + CYCLE + b"G80\n", "order"),
    "in the last block": (CYCLE + b"X3 G92.1\nG80\n", "order"),
    "length in the block": (CYCLE + b"X3 G43 H1\nG80\n", "order"),
    "user code": (CYCLE.replace(b"\n", b" M101\n") + b"G80\n", "order"),
    "plane": (CYCLE + b"G18\nX3\nG80\n", "plane"),
    "unit": (CYCLE + b"G20 F9\nX3\nG80\n", "unit"),
    "rotary word": (b"G81 X1 A5 Z-5 R2\nG80\n", "not understood"),
    "R below Z": (b"G81 X1 Z-5 R-6\nG80\n", "not understood"),
    "no R": (b"G81 X1 Z-5\nG80\n", None),
    "no dwell": (b"G82 X1 Z-5 R2\nG80\n", "not understood"),
    "no peck": (b"G83 X1 Z-5 R2\nG80\n", "not understood"),
    "peck of nothing": (b"G83 X1 Z-5 R2 Q0\nG80\n", "not understood"),
    "half a repeat": (b"G81 X1 Z-5 R2 L1.5\nG80\n", "not understood"),
    "foreign word": (b"G81 X1 Z-5 R2 Q5\nG80\n", None),
    "too many": (b"G81 X1 Z-5 R2 L999999999\nG80\n", "more than 20000 moves"),
    "tiny pecks": (b"G83 X1 Z-5 R2 Q.00001\nG80\n", "more than 20000 moves"),
    "compensation": (b"G41 D1 G1 X2\n" + CYCLE + b"G80\n", None),
    "diameter": (b"G7 G19 G81 X-5 Y1 R2\nG80\n", "diameter"),
    "uvw": (b"G17.1 G0 W10\nG81 U1 W-5 R2\nG80\n", "plane"),
    "inverse time": (b"G93 G81 X1 Z-5 R2 F1\nG80\n", None),
    "end in the block": (b"G81 X1 Y1 Z-5 R2 M2\n", None),
    "end in a later block": (CYCLE + b"X3 M2\n", "order"),
    "long": (b"G81 X" + b"0" * 230 + b"1 Z-5 R2\nG80\n", "too long"),
    "rotated": (b"G10 L2 P1 R30\nG0 X0 Y0 Z10\n" + CYCLE + b"G80\n", "rotation"),
    "unknown code": (CYCLE + b"G77\nX3\nG80\n", "not understood"),
}


@pytest.mark.parametrize("case", LEFT)
def test_a_series_that_is_not_certain_is_left_whole(case):
    program, reason = LEFT[case]
    lines, found = expanded(HEAD + program + b"M2\n")
    assert found.written == 0
    assert lines == []
    if reason is not None:
        assert any(reason in f.message for f in found.findings), found.findings


@pytest.mark.parametrize(
    ("program", "reason"),
    [
        (b"G21 G90 G64 G98 F100\nG81 X1 Z-5 R2\nG80\nM2\n", "start unknown"),
        (b"G21 G90 G64 F100\nG0 Z10\nG81 X1 Z-5 R2\nG80\nM2\n", "G98 or G99"),
        (b"G21 G90 G64 G98\nG0 Z10\nG81 X1 Z-5 R2\nG80\nM2\n", "feed"),
        (b"G21 G90 G64 G98 F9\nG0 Z10\nG86 X1 Z-5 R2 P1\nG80\nM2\n", "spindle"),
    ],
)
def test_what_the_program_has_not_said_is_not_guessed(program, reason):
    _, found = expanded(program)
    assert found.written == 0
    assert reason in found.findings[0].message


def test_the_start_may_be_unknown_in_the_plane():
    lines, found = expanded(b"G21 G90 G61 G98 F9\nG0 Z10\nG81 X1 Z-5 R2\nY3\nG80\nM2\n")
    assert found.written == 2
    assert "G0 X1" in lines
    assert "G0 Y3" in lines


def test_a_hole_where_the_tool_stands_needs_no_way():
    lines, _ = expanded(HEAD + b"G81 X0 Y0 Z-5 R2\nG80\nM2\n")
    assert lines[1:-3] == ["G0 Z2.", "G1 Z-5.", "G0 Z10."]


@pytest.mark.parametrize("mode", [b"G64 P0.05", b"G61", b""])
@pytest.mark.parametrize("comments", [True, False])
def test_a_hole_without_depth_where_the_tool_stands_is_nothing(mode, comments):
    program = HEAD.replace(b"G64 P0.05", mode) + b"G81 X0 Y0 Z10 R10\nX3\nX3\nG80\nG0 X5\nM2\n"
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target, comments=comments)
    assert found.written == 3
    text = target.getvalue()
    assert check_expansion(io.BytesIO(program), io.BytesIO(text)).ok
    rapids = found.map.rapids_of(read_program(io.BytesIO(text)).rapids)
    assert rapids.line.tolist() == [3, 5, 8]
    assert found.map.line_of(len(text.splitlines())) == 9


def test_an_uncertain_series_does_not_keep_another_from_being_written():
    lines, found = expanded(
        HEAD + b"G84 X1 Z-5 R2\nX2\nG80\nG81 X3 Z-5 R2\nX4\nG80\nG88 X5 Z-5 R2 P1\nG80\nM2\n"
    )
    assert (found.holes, found.written) == (5, 2)
    assert lines[:3] == ["G84 X1 Z-5 R2", "X2", "G80"]
    assert [f.line for f in found.findings] == [4, 10]


def test_tapping_that_states_its_dwell_borrows_none():
    program = HEAD + b"G82 X1 Z-5 R2 P1\nG80\nG84 X2 Z-5 R2 P0.5\nG80\nG84 X3 Z-5 R2\nG80\nM2\n"
    _, found = expanded(program)
    assert (found.holes, found.written) == (3, 1)


def test_a_series_runs_on_over_chunks_of_the_file():
    holes = b"".join(b"X%d.125 (%s)\n" % (k % 977, b"-" * 190) for k in range(6_000))
    target = io.BytesIO()
    found = expand(io.BytesIO(HEAD + b"G81 Y3 Z-5 R2\n" + holes + b"G80\nM2\n"), target)
    assert found.written == 6_001
    assert target.getvalue().count(b"G1 Z-5.\n") == 6_001


def test_lines_rapids_and_bytes_lead_back_to_the_original():
    program = HEAD + b"(a)\nG81 X1 Y1 Z-5 R2\nX3\nG80\nG0 X9\nG0 Z20\nM2\n"
    target = io.BytesIO()
    found = expand(io.BytesIO(program), target)
    target.seek(0)
    rapids = found.map.rapids_of(read_program(target).rapids)
    blocks = [program[a:b] for a, b in zip(rapids.begin, rapids.end, strict=True)]
    lines = program.split(b"\n")
    assert blocks == [lines[n - 1] for n in rapids.line]
    assert blocks[1:7] == [b"G81 X1 Y1 Z-5 R2"] * 3 + [b"X3"] * 3
    assert blocks[7:] == [b"G0 X9", b"G0 Z20"]
    last = len(target.getvalue().splitlines())
    assert found.map.line_of(last) == len(program.splitlines())
    every = found.map.lines_of(np.arange(1, last + 1))
    assert (np.diff(every) >= 0).all()


def test_nothing_is_written_where_no_cycle_is():
    lines, found = expanded(HEAD + b"G0 X5\nM2\n")
    assert (lines, found.holes, len(found.map)) == ([], 0, 0)


def test_a_dialect_without_a_table_is_refused():
    other = replace(DIALECTS["linuxcnc"], name="other")
    with pytest.raises(ProgramError, match="cycles of dialect 'other'"):
        expand(io.BytesIO(HEAD), io.BytesIO(), dialect=other)


class Changing(io.BytesIO):
    """A file whose second reading finds something else."""

    def seek(self, *given):
        data = self.getvalue().replace(b"Z-5", b"Z-6")
        super().seek(0)
        self.write(data)
        return super().seek(*given)


def test_a_program_that_changes_while_it_is_read_is_refused():
    source = Changing(HEAD + b"G81 X1 Z-5 R2\nG80\nM2\n")
    with pytest.raises(EmitError, match="changed while"):
        expand(source, io.BytesIO())
