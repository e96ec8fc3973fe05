"""Damage to programs whose cycles were written out: every kind is noticed."""

import ast
import io
import re
from pathlib import Path

import pytest

import gcodejerk
from gcodejerk.axes import AXES
from gcodejerk.cycles.expansion import expand
from gcodejerk.nc import Start
from gcodejerk.nc.reader import Reader
from gcodejerk.verification import Kind
from gcodejerk.verification.cycles.expansion import check_expansion

PROGRAM = b"""\
%
G21 G90 G64 P0.05 G98 F100 (start)
M3 S500
G0 X0 Y0 Z10
N10 G81 X1 Y1 Z-5 R2 F150 M8
X3
G4 P.3
X5 Y7 R3
G80
G0 X0 Y0
G99 G83 X2 Y2 Z-6 R2 Q3
X4 L2
G98 G73 X6 Z-6 R2 Q3
G80
G91 G82 X1 Y1 Z-3 R-5 P.5 L2
G80 G90
G86 X9 Z-4 R1 P.2
G85 X11 Z-4 R1
G89 X12 Z-4 R1 P.2 M1
G0 Z20
M2
%
"""


def written(program=PROGRAM, comments=True, start=None):
    """The program with its cycles written out."""
    target = io.BytesIO()
    start = Start() if start is None else start
    assert expand(io.BytesIO(program), target, comments=comments, start=start).written
    return target.getvalue()


def check(damaged, program=PROGRAM):
    return check_expansion(io.BytesIO(program), io.BytesIO(damaged))


WRITTEN = written()


@pytest.mark.parametrize("comments", [True, False])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
@pytest.mark.parametrize("last", [True, False])
def test_what_was_written_out_is_accepted(comments, newline, last):
    program = PROGRAM.replace(b"\n", newline)
    program = program if last else program.rstrip()
    found = check(written(program, comments), program)
    assert found.ok, found.violations
    assert (found.rapids, found.rewritten) == (10, 10)


def test_a_program_that_is_left_as_it_is_is_accepted():
    found = check(PROGRAM)
    assert found.ok
    assert (found.rapids, found.rewritten) == (10, 0)


def once(old, new):
    """Replace the first of something, which has to be there."""

    def damage(text):
        assert old in text
        return text.replace(old, new, 1)

    return damage


def pattern(old, new):
    def damage(text):
        assert re.search(old, text, flags=re.MULTILINE)
        return re.sub(old, new, text, count=1, flags=re.MULTILINE)

    return damage


DAMAGE = {
    "a hole is shifted": (once(b"G0 X3\n", b"G0 X3.001\n"), Kind.CYCLE),
    "an axis of a hole is lost": (once(b"G0 X1 Y1\n", b"G0 X1\n"), Kind.CYCLE),
    "a hole is elsewhere in Y": (once(b"G0 X3\n", b"G0 X3 Y1.5\n"), Kind.CYCLE),
    "the depth is changed": (once(b"G1 Z-5.\n", b"G1 Z-5.01\n"), Kind.CYCLE),
    "the sign of the depth is lost": (once(b"G1 Z-5.\n", b"G1 Z5.\n"), Kind.CYCLE),
    "a peck is missing": (once(b"G1 Z-1.\nG0 Z2.\nG0 Z-0.746\n", b""), Kind.CYCLE),
    "a peck does not clear the hole": (once(b"G1 Z-1.\nG0 Z2.\n", b"G1 Z-1.\n"), Kind.CYCLE),
    "a peck returns to the bottom itself": (once(b"G0 Z-0.746\n", b"G0 Z-1.\n"), Kind.CYCLE),
    "a peck goes back by less": (once(b"G0 Z-0.746\nG1 Z-4", b"G0 Z-0.8\nG1 Z-4"), Kind.CYCLE),
    "a dwell is dropped": (once(b"G4 P0.5\n", b""), Kind.CYCLE),
    "a dwell is shorter": (once(b"G4 P0.5\n", b"G4 P0.05\n"), Kind.CYCLE),
    "a dwell stands above": (once(b"G4 P0.5\nG0 Z8.\n", b"G0 Z8.\nG4 P0.5\n"), Kind.CYCLE),
    "a rapid becomes a feed move": (once(b"G0 Z2.\n", b"G1 Z2.\n"), Kind.CYCLE),
    "a feed move becomes a rapid": (once(b"G1 Z-5.\n", b"G0 Z-5.\n"), Kind.CYCLE),
    "a reamer leaves rapidly": (pattern(rb"^G1 Z1\.\n", b"G0 Z1.\n"), Kind.CYCLE),
    "the retract stays too low": (once(b"G0 Z10.\n", b"G0 Z2.\n"), Kind.CYCLE),
    "the retract is left out": (once(b"G0 Z10.\n", b""), Kind.CYCLE),
    "R in place of where it began": (once(b"Z-5.\nG0 Z10.", b"Z-5.\nG0 Z2."), Kind.CYCLE),
    "an approach is left out": (once(b"G0 Z2.\nG1 Z-5.\n", b"G1 Z-5.\n"), Kind.CYCLE),
    "the order is changed": (once(b"G0 X1 Y1\nG0 Z2.\n", b"G0 Z2.\nG0 X1 Y1\n"), Kind.CYCLE),
    "a way goes aslant": (once(b"G0 X1 Y1\nG0 Z2.\n", b"G0 X1 Y1 Z2.\n"), Kind.CYCLE),
    "an increment is changed": (once(b"G0 X1 Y1\nG0 Z-5.", b"G0 X1 Y1.1\nG0 Z-5."), Kind.CYCLE),
    "a hole is doubled": (
        once(b"G0 Z2.\nG1 Z-5.\nG0 Z10.\n", b"G0 Z2.\nG1 Z-5.\nG0 Z10.\n" * 2),
        Kind.PATH,
    ),
    "a hole is dropped": (
        pattern(rb"^\(gcodejerk: X3\)\n(.*\n)*?G64 P0.05\n", b""),
        Kind.MODE,
    ),
    "a hole is left as it was": (
        pattern(rb"^\(gcodejerk: X3\)\n(.*\n)*?G64 P0.05\n", b"X3\n"),
        Kind.CYCLE,
    ),
    "the spindle is not stopped": (once(b"M5\n", b""), Kind.CYCLE),
    "the spindle turns the other way": (once(b"Z10.\nM3\n", b"Z10.\nM4\n"), Kind.CYCLE),
    "the feed is changed": (once(b"N10 F150", b"N10 F151"), Kind.HEAD),
    "a word of the block is lost": (once(b"N10 F150 M8", b"N10 F150"), Kind.HEAD),
    "the block number is lost": (once(b"N10 F150", b"F150"), Kind.HEAD),
    "G99 is lost": (once(b"G99\n", b""), Kind.HEAD),
    "a stop is lost": (once(b"M1\n", b""), Kind.STOP),
    "exact path mode is left out": (once(b"G61\n", b""), Kind.MODE),
    "the path mode does not return": (once(b"G64 P0.05\nG4 P.3", b"G4 P.3"), Kind.PATH),
    "another tolerance returns": (once(b"G0 Z10.\nG64 P0.05", b"G0 Z10.\nG64 P0.5"), Kind.PATH),
    "no tolerance returns": (once(b"G0 Z10.\nG64 P0.05", b"G0 Z10.\nG64"), Kind.PATH),
    "a kept line is changed": (once(b"G4 P.3\n", b"G4 P.4\n"), Kind.CHANGED),
    "a kept line is dropped": (once(b"G4 P.3\n", b""), Kind.CHANGED),
    "a kept line moves": (once(b"G80\nG0 X0 Y0\n", b"G0 X0 Y0\nG80\n"), Kind.CHANGED),
    "G80 is dropped": (once(b"G80\n", b""), Kind.CHANGED),
    "a kept rapid is changed": (once(b"G0 X0 Y0\n", b"G0 X0 Y0.1\n"), Kind.CHANGED),
    "a line end is changed": (once(b"G1 Z-5.\n", b"G1 Z-5.\r\n"), Kind.LINE_END),
    "a comment is not closed": (once(b"F150 M8)\n", b"F150 M8\n"), Kind.COMMENT),
    "a comment ends early": (once(b"(gcodejerk: X3)", b"(gcodejerk: X3) G0 Z0 (x)"), Kind.COMMENT),
    "a line is added": (once(b"G61\n", b"G61\nM9\n"), Kind.CYCLE),
    "a word is added": (once(b"G1 Z-5.\n", b"G1 Z-5. F9\n"), Kind.CYCLE),
    "a rotary word is added": (once(b"G0 X3\n", b"G0 X3 A5\n"), Kind.CYCLE),
    "the file is cut off": (lambda text: text[: text.index(b"G1 Z-6.")], Kind.CYCLE),
    "the end is cut off": (once(b"M2\n%\n", b""), Kind.MISSING),
    "something follows": (lambda text: text + b"G0 Z0\n", Kind.ADDED),
}  # fmt: skip


@pytest.mark.parametrize("case", DAMAGE)
def test_every_damage_is_noticed(case):
    damage, kind = DAMAGE[case]
    damaged = damage(WRITTEN)
    assert damaged != WRITTEN
    found = check(damaged)
    assert not found.ok
    if kind is not None:
        assert found.violations[0].kind is kind, found.violations
    assert found.violations[0].line is not None


UNCERTAIN = {
    "block delete": (b"X3\n", b"/X3\n"),
    "deleted end": (b"G80\nM2", b"/G80\nM2"),
    "frame": (b"X3\n", b"G92 Z5\nX3\n"),
    "plane": (b"X3\n", b"G18\nX3\n"),
    "expression": (b"X3\n", b"X[1+2]\n"),
    "tapping": (b"G81", b"G84"),
    "start": (b"Z10\n", b"\n"),
    "return": (b" G98", b""),
    "feed": (b" F100", b""),
    "compensation": (b"G0 X0", b"G41 D1\nG0 X0"),
    "rotation": (b"G0 X0", b"G10 L2 P1 R30\nG0 X0"),
    "loop": (b"M3 S500\n", b"o1 repeat [2]\nM3 S500\n"),
}


@pytest.mark.parametrize("case", UNCERTAIN)
def test_a_series_that_is_not_certain_may_not_be_written_out(case):
    plain = b"G21 G90 G61 G98 F100\nM3 S500\nG0 X0 Y0 Z10\nG81 X1 Y1 Z-5 R2\nX3\nG80\nM2\n"
    hole = b"G0 Z2\nG1 Z-5\nG0 Z10\n"
    first, second = b"G81 X1 Y1 Z-5 R2\n", b"X3\n"
    good = plain.replace(first, b"G0 X1 Y1\n" + hole).replace(second, b"G0 X3\n" + hole)
    assert check(good, plain).ok
    old, new = UNCERTAIN[case]
    original = plain.replace(old, new, 1)
    assert original != plain
    bad = original
    for block, way in ((first.replace(old, new, 1), b"G0 X1 Y1\n"), (b"X3\n", b"G0 X3\n")):
        bad = bad.replace(block, way + hole, 1)
    assert not check(bad, original).ok


@pytest.mark.parametrize("code", [b"g 0 8 1", b"G081.0", b"G+81", b"G 00 81."])
def test_a_cycle_is_seen_however_it_is_spelled(code):
    plain = b"G21 G90 G61 G98 F100\nG0 X0 Y0 Z10\n" + code + b" X1 Z-5 R2\nG80\nM2\n"
    good = plain.replace(code + b" X1 Z-5 R2\n", b"G0 X1\nG0 Z2\nG1 Z-5\nG0 Z10\n")
    assert check(good, plain).ok
    assert check(good, plain).rewritten == 1


def test_a_rest_behind_every_move_is_needed_where_the_path_mode_is_not_known():
    program = PROGRAM.replace(b" G64 P0.05", b"")
    good = written(program)
    assert check(good, program).ok
    for k in range(good.count(b"G4 P0\n")):
        parts = good.split(b"G4 P0\n")
        bad = b"G4 P0\n".join(parts[: k + 1]) + b"G4 P0\n".join([b"", *parts[k + 1 :]])[6:]
        assert len(bad) == len(good) - 6
        assert not check(bad, program).ok, k


@pytest.mark.parametrize("later", [b"G84 X2 Z-3 R2\n", b"o<tap> call\n", b"M98 P5\n"])
def test_a_dwell_that_a_later_cycle_takes_may_not_be_written_out(later):
    plain = b"G21 G90 G61 G98 F100\nM3\nG0 X0 Y0 Z10\nG82 X1 Z-5 R2 P1\nG80\n"
    hole = b"G0 X1\nG0 Z2\nG1 Z-5\nG4 P1\nG0 Z10\n"
    good = plain.replace(b"G82 X1 Z-5 R2 P1\n", hole)
    assert check(good + b"M2\n", plain + b"M2\n").ok
    tapping = b"G84 X2 Z-3 R2 P.5\nG80\n"
    assert check(good + tapping + b"M2\n", plain + tapping + b"M2\n").ok
    found = check(good + later + b"G80\nM2\n", plain + later + b"G80\nM2\n")
    assert [v.kind for v in found.violations] == [Kind.SERIES]


def test_binary_numbers_may_peck_once_more_but_not_twice():
    program = b"G21 G90 G61 G99 F100\nG0 X0 Y0 Z10\nG73 X1 Z-1 R0 Q.1\nG80\nM2\n"
    good = written(program)
    assert check(good, program).ok
    once_more = b"G1 Z-1.\nG0 Z-0.746\n"
    other = good.replace(once_more, b"") if once_more in good else good.replace(
        b"G1 Z-1.\n", once_more + b"G1 Z-1.\n"
    )  # fmt: skip
    assert check(other, program).ok
    assert not check(good.replace(b"G1 Z-1.\n", b"G1 Z-1.\n" + once_more * 2, 1), program).ok


def test_the_judge_shares_nothing_with_those_it_judges():
    room = Path(gcodejerk.__file__).parent / "verification" / "cycles"
    modules = sorted(room.glob("*.py"))
    assert {"holes.py", "expansion.py"} <= {path.name for path in modules}
    for path in modules:
        tree = ast.parse(path.read_bytes())
        names = {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
        assert not any(name.startswith("gcodejerk.cycles") for name in names), path


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("position", 15.0, "Z stands at 10"),
        ("unit", 25.4, "unit is 1"),
        ("retract", 990, "retract is 980"),
        ("plane", 180, "plane is 170"),
        ("distance", 910, "incremental is 0"),
        ("feed", 90.0, "F is 100"),
        ("path", 64, "path is 61"),
    ],
)
def test_what_is_in_force_in_front_of_a_cycle_has_to_be_read_twice(monkeypatch, field, value, told):
    """A mistake of the first reading, which whoever writes and whoever proves would share."""

    class Mistaken(Reader):
        def read_line(self, text, begin, number, terminator):
            super().read_line(text, begin, number, terminator)
            if number == 2 and field == "position":
                self.state.position[AXES.index("Z")] = value
            elif number == 2:
                setattr(self.state, field, value)

    program = b"G21 G90 G61 G98 F100\nG0 X0 Y0 Z10\nG81 X5 Z-3 R2\nG80\nM2\n"
    right = b"G0 X5\nG0 Z2\nG1 Z-3\nG0 Z10\n"
    written = program.replace(b"G81 X5 Z-3 R2\n", right)
    assert check_expansion(io.BytesIO(program), io.BytesIO(written)).confirmed == 1
    monkeypatch.setattr("gcodejerk.verification.cycles.expansion.Reader", Mistaken)
    found = check_expansion(io.BytesIO(program), io.BytesIO(written))
    assert any(v.kind is Kind.READING and told in v.problem for v in found.violations)
