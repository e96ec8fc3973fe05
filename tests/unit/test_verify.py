"""`verify` accepts streams written by hand, and refuses each damage for the right reason.

The streams here are written from the formulas of the paper, by a few lines of this file; neither
the planner nor an emitter takes part.
"""

from __future__ import annotations

import io

import numpy as np
import pytest

from gcodejerk.errors import VerifyError
from gcodejerk.machine import Machine
from gcodejerk.verification import Kind, require, verify, verify_files
from gcodejerk.verification.physics import points

TEXT = """
controller: mach
dialect: linuxcnc
interval: 0.001
positioning: linear
axes:
  X:
    resolution: 1.0e-4
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
    travel: [-50, 50]
  Z:
    resolution: 1.0e-4
    rapid: {velocity: 600, acceleration: 5000, jerk: 5.0e+5}
program:
  offsets: {G54: {X: 0, Z: 0}}
"""
MACHINE = Machine.loads(TEXT)


def profile(t, T=0.040, T1=0.001):
    """Position and speed of the paper's four segments over the length 1."""
    if t > T / 2:
        position, speed = profile(T - t, T, T1)
        return 1.0 - position, speed
    T2 = T / 2 - T1
    R = T2 / T1
    J = 6.0 / (T1**2 * T * (2 * R + 1))
    if t <= T1:
        return J * t**3 / 6, J * t**2 / 2
    u, A = t - T1, J * T1
    s1, v1 = J * T1**3 / 6, J * T1**2 / 2
    return s1 + v1 * u + A * u**2 / 2 - J / R * u**3 / 6, v1 + A * u - J / R * u**2 / 2


def stream(begin, end, line_end="\n", relative=False, decimals=4, scale=1.0):
    """Points of a move; begin and end are pairs of texts by axis, `scale` is of what F counts."""
    lines, at = [], {axis: float(begin[axis]) for axis in end}
    for k in range(1, 21):
        words, moved = [], []
        for axis in end:
            way = float(end[axis]) - float(begin[axis])
            now = round(float(begin[axis]) + way * profile(k * 0.002)[0], decimals)
            moved.append(now - at[axis])
            shown = f"{moved[-1] if relative else now:.{decimals}f}"
            words.append(axis + (end[axis] if k == 20 and not relative else shown))
            at[axis] = now
        feed = sum(x**2 for x in moved) ** 0.5 / 0.002 * 60 * scale
        lines.append(f"G1 {' '.join(words)} F{feed:.4f}{line_end}")
    return "".join(lines)


UP = stream({"Z": "0"}, {"Z": "1."})
ACROSS = stream({"X": "0", "Z": "1"}, {"X": "0.8", "Z": "1.6"})
BACK = stream({"Z": "0"}, {"Z": "-1"}, relative=True)

ORIGINAL = (
    "%\n(part 7)\nG21 G90 G94 G64 P0.01\nF600\nG0 X0 Z0\nN10 G0 Z1. M8 (up)\nX0.8 Z1.6\n"
    "G1 X2 (cut)\n#1=#90\nG0 X#1\nG0 X0\nG91 G0 Z-1\nG90 G1 Z0\nM2\n%\n"
)
PROCESSED = (
    "%\n(gcodejerk stamp 0.1.0 0123abcd Mill)\n(part 7)\nG21 G90 G94 G64 P0.01\nF600\nG0 X0 Z0\n"
    f"(gcodejerk: N10 G0 Z1. M8)\nN10 G0  M8 (up)\nG4 P0\n{UP}G0 F600.\n"
    f"(gcodejerk: X0.8 Z1.6)\n{ACROSS}G0 F600.0\n"
    "G1 X2 (cut)\n#1=#90\nG0 X#1\nG0 X0\n"
    f"(gcodejerk: G91 G0 Z-1)\nG91 G0\nG4 P0\n{BACK}G0 F600.\n"
    "G90 G1 Z0\nM2\n%\n"
)


def judge(processed, original=ORIGINAL, machine=MACHINE):
    return verify(
        original.encode("latin-1"),
        processed if isinstance(processed, bytes) else processed.encode("latin-1"),
        machine,
    )


def test_streams_written_by_hand_are_accepted():
    found = judge(PROCESSED)
    assert found.violations == ()
    assert (found.rapids, found.rewritten, found.kept) == (6, 3, 12)
    require(found)


def test_an_unchanged_file_is_accepted():
    assert judge(ORIGINAL).ok
    assert judge(ORIGINAL).kept == 15


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("last", ["\n", ""])
def test_line_ends_and_a_missing_last_one_are_those_of_the_original(ends, last):
    original = "G21 G90 G94\nF600\nG0 Z0\nG0 Z1." + last
    processed = f"G21 G90 G94\nF600\nG0 Z0\nG4 P0\n{UP}G0 F600." + last
    good = processed.replace("\n", ends)
    assert judge(good, original.replace("\n", ends)).violations == ()
    other = "\r\n" if ends == "\n" else "\n"
    found = judge(processed.replace("\n", other), original.replace("\n", ends))
    assert found.violations[0].kind == Kind.LINE_END
    wrong = good + ends if not last else good.removesuffix(ends)
    found = judge(wrong, original.replace("\n", ends))
    assert found.violations[0].kind in (Kind.LINE_END, Kind.ADDED, Kind.MISSING)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("(gcodejerk: N10 G0 Z1. M8)\n", ""),
        ("(gcodejerk stamp 0.1.0 0123abcd Mill)\n", ""),
        ("G0 F600.\n", "G0 F600\n"),
        ("G0 F600.\n", "F600 G0\n"),
        ("N10 G0  M8 (up)\n", "N10 G0  M8 (up)\n"),
        ("G1 Z1. F", "G01 Z1.00 F"),
        (f"(gcodejerk: X0.8 Z1.6)\n{ACROSS}G0 F600.0\n", "X0.8 Z1.6\n"),
    ],
)
def test_what_makes_no_difference_is_accepted(before, after):
    assert before in PROCESSED
    assert judge(PROCESSED.replace(before, after, 1)).violations == ()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("G4 P0\nG1 Z0.0", "G1 Z0.0"),
        ("G4 P0\n", "G90 G94\nG4 P0\n"),
        ("G4 P0\n", "G4 P0\nG94\n"),
        ("G4 P0\n", "G4 P0\nG4 P0\n"),
        ("G4 P0\n", "G4 P0.\n"),
        ("G4 P0\n", "G4 P0\nF-1\n"),
        ("G4 P0\n", "G4 P0\nF600\n"),
        ("G4 P0\n", "G4 P0\nG64 P5\n"),
        ("G0 F600.\n", "G0 G94 F600\n"),
        ("G0 F600.\n", "F600 G90 G0\n"),
        ("G0 F600.\n", "G0 F600." + "0" * 240 + "\n"),
        ("G1 Z1. F", "G1 G61 Z1. F"),
        ("G1 Z1. F", "G1 G9 Z1. F"),
        ("G1 Z1. F", "G1 Z1." + "0" * 240 + " F"),
    ],
)
def test_words_that_change_little_or_nothing_are_refused_all_the_same(before, after):
    assert before in PROCESSED
    assert not judge(PROCESSED.replace(before, after, 1)).ok


def _line(text, start):
    return next(line for line in text.splitlines(keepends=True) if line.startswith(start))


def _nth(text, n):
    return text.splitlines(keepends=True)[n]


def _feed(line, factor):
    head, _, feed = line.strip().rpartition("F")
    return f"{head}F{float(feed) * factor:.4f}\n"


def _move(line, steps, axis="Z"):
    words = line.split()
    return (
        " ".join(
            f"{axis}{float(w[1:]) + steps * 1e-4:.4f}" if w.startswith(axis) else w for w in words
        )
        + "\n"
    )


def _with(n, change, text=UP):
    """One point of a stream, changed."""
    line = _nth(text, n)
    return (line, change(line))


DAMAGE = {
    "kept line changed": ("G1 X2 (cut)", "G1 X3 (cut)", Kind.CHANGED),
    "kept comment changed": ("(part 7)", "(part 8)", Kind.CHANGED),
    "kept blank added": ("G1 X2 (cut)", "G1 X2  (cut)", Kind.CHANGED),
    "kept line end changed": ("#1=#90\n", "#1=#90\r\n", Kind.LINE_END),
    "kept line dropped": ("#1=#90\n", "", Kind.CHANGED),
    "kept line doubled": ("#1=#90\n", "#1=#90\n#1=#90\n", Kind.CHANGED),
    "kept lines swapped": ("#1=#90\nG0 X#1\n", "G0 X#1\n#1=#90\n", Kind.CHANGED),
    "kept rapid changed": ("G0 X0\n(gc", "G0 X1\n(gc", Kind.CHANGED),
    "file cut at a line": ("M2\n%\n", "", Kind.MISSING),
    "file cut in a line": ("M2\n%\n", "M", Kind.CHANGED),
    "text behind the end": ("M2\n%\n", "M2\n%\nG0 Z5\n", Kind.ADDED),
    "last line end lost": ("M2\n%\n", "M2\n%", Kind.LINE_END),
    "stamp with a wrong end": ("Mill)\n", "Mill)\r\n", Kind.STAMP),
    "stamp with words": ("Mill)\n", "Mill) G0 X1\n", Kind.STAMP),
    "stamp twice": ("(part 7)", "(gcodejerk stamp 0.1.0 0123abcd Mill)\n(part 7)", Kind.CHANGED),
    "uncertain rapid replaced": (
        "G0 X#1\n",
        f"(gcodejerk: G0 X#1)\n{UP}G0 F600\n",
        Kind.NOT_CERTAIN,
    ),
    "comment of the stream changed": (
        "(gcodejerk: N10 G0 Z1.",
        "(gcodejerk: N10 G0 Z2.",
        Kind.COMMENT,
    ),
    "comment of the stream with words": ("M8)\nN10", "M8) G0 X1\nN10", Kind.COMMENT),
    "other words lost": ("N10 G0  M8 (up)\n", "", Kind.HEAD),
    "other word changed": ("G0  M8", "G0  M9", Kind.HEAD),
    "N word lost": ("N10 G0  M8", "G0  M8", Kind.HEAD),
    "line of another stream": ("G4 P0\n", "G4 P0\nM5\n", Kind.FORM),
    "dwell in front of the stream": ("G4 P0\n", "G4 P1\n", Kind.FORM),
    "stream in the other distance mode": ("G4 P0\n", "G91\nG4 P0\n", Kind.MODE),
    "stream in the other feed mode": ("G4 P0\n", "G93\nG4 P0\n", Kind.MODE),
    "stream under exact stop": ("G4 P0\n", "G61\nG4 P0\n", Kind.MODE),
    "G0 not restored": ("G0 F600.\n", "F600.\n", Kind.MOTION),
    "tail lost": ("G0 F600.0\n", "", Kind.FORM),
    "F not restored": ("G0 F600.0\n", "G0\n", Kind.FEED_RESTORED),
    "another F restored": ("G0 F600.0\n", "G0 F606\n", Kind.FEED_RESTORED),
    "distance mode changed": ("G0 F600.0\n", "G0 G91 F600\n", Kind.DISTANCE),
    "feed mode changed": ("G0 F600.0\n", "G0 G95 F600\n", Kind.FEED_MODE),
    "path mode changed": ("G0 F600.0\n", "G0 G61 F600\n", Kind.PATH),
    "path tolerance lost": ("G0 F600.0\n", "G0 G64 F600\n", Kind.PATH),
    "end shifted": ("G1 Z1. F", "G1 Z1.0001 F", Kind.END),
    "end beyond the last decimal": ("G1 Z1. F", "G1 Z1.0000000000000000001 F", Kind.END),
    "number of many digits": ("G1 Z1. F", f"G1 Z{'9' * 400} F", Kind.FORM),
    "increment shifted": (_nth(BACK, 5), _move(_nth(BACK, 5), 1), Kind.END),
    "point backwards": (*_with(5, lambda line: _move(line, -800)), Kind.BACKWARDS),
    "point beyond the end": (*_with(18, lambda line: _move(line, 100)), Kind.BACKWARDS),
    "points swapped": (_nth(UP, 3) + _nth(UP, 4), _nth(UP, 4) + _nth(UP, 3), Kind.BACKWARDS),
    "point doubled": (_nth(UP, 9), _nth(UP, 9) * 2, Kind.ACCELERATION),
    "wrong sign": (*_with(9, lambda line: line.replace("Z", "Z-")), Kind.BACKWARDS),
    "point off the line": (*_with(9, lambda line: _move(line, 3, "X"), ACROSS), Kind.LINE),
    "another axis moves": (*_with(9, lambda line: line.replace(" F", " X0 F")), Kind.AXES),
    "point in two axes more": ("G1 Z1. F", "G1 Z1. Y0 F", Kind.AXES),
    "point without F": (*_with(9, lambda line: line.split(" F")[0] + "\n"), Kind.FORM),
    "point with a code": (*_with(9, lambda line: line.replace(" F", " M9 F")), Kind.FORM),
    "point as a rapid": (*_with(9, lambda line: line.replace("G1", "G0")), Kind.FORM),
    "comment among the points": (*_with(9, lambda line: f"(x)\n{line}"), Kind.FORM),
    "line end of a point": (*_with(9, lambda line: line.strip() + "\r\n"), Kind.LINE_END),
    "F zero": (*_with(9, lambda line: line.split("F")[0] + "F0\n"), Kind.FEED),
    "F above": (*_with(9, lambda line: _feed(line, 1.01)), Kind.FEED),
    "F below": (*_with(9, lambda line: _feed(line, 0.99)), Kind.FEED),
    "F of the first block": (*_with(0, lambda line: _feed(line, 1.01)), Kind.FEED),
    "F of the last block": (*_with(19, lambda line: _feed(line, 0.99)), Kind.FEED),
    "F in another unit": (*_with(9, lambda line: _feed(line, 1 / 60)), Kind.FEED),
    "F beyond the limit": (*_with(9, lambda line: _feed(line, 20.0)), Kind.FEED),
}
LIMITS = {Kind.VELOCITY, Kind.ACCELERATION, Kind.JERK}


@pytest.mark.parametrize("name", DAMAGE)
def test_damage_is_refused_for_the_right_reason(name):
    before, after, kind = DAMAGE[name]
    assert before in PROCESSED
    found = judge(PROCESSED.replace(before, after, 1))
    assert not found.ok
    assert kind in {v.kind for v in found.violations}, found.violations


@pytest.mark.parametrize("n", range(1, 19))
def test_a_point_that_is_dropped_or_off_by_much_breaks_the_limits(n):
    dropped = judge(PROCESSED.replace(_nth(UP, n), "", 1))
    assert {v.kind for v in dropped.violations} & (LIMITS | {Kind.FEED})
    moved = judge(PROCESSED.replace(_nth(UP, n), _move(_nth(UP, n), 60), 1))
    assert {v.kind for v in moved.violations} & (LIMITS | {Kind.FEED, Kind.BACKWARDS})


@pytest.mark.parametrize("n", range(20))
@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_a_feed_changed_by_one_percent_is_noticed_in_every_block(n, factor):
    found = judge(PROCESSED.replace(_nth(UP, n), _feed(_nth(UP, n), factor), 1))
    assert [v.kind for v in found.violations] == [Kind.FEED]


def test_violations_name_both_lines():
    found = judge(PROCESSED.replace("G1 Z1. F", "G1 Z1.5 F"))
    end = next(v for v in found.violations if v.kind == Kind.END)
    line = PROCESSED[: PROCESSED.index("G1 Z1. F")].count("\n") + 1
    assert (end.line, end.original_line) == (line, 6)


def test_streams_on_each_others_rapids_are_refused():
    swapped = PROCESSED.replace(UP, "@").replace(ACROSS, UP).replace("@", ACROSS)
    assert Kind.AXES in {v.kind for v in judge(swapped).violations}


def test_a_stream_longer_than_the_conventional_time_is_refused():
    quick = Machine.loads(TEXT.replace("jerk: 5.0e+5", "jerk: 5.0e+6"))
    assert Kind.TIME in {v.kind for v in judge(PROCESSED, machine=quick).violations}


@pytest.mark.parametrize(
    ("limit", "kind"),
    [
        ("velocity: 30", Kind.VELOCITY),
        ("acceleration: 3000", Kind.ACCELERATION),
        ("jerk: 1.0e+6", Kind.JERK),
    ],
)
def test_limits_are_those_of_the_machine(limit, kind):
    before, after = TEXT.split("program:")
    machine = Machine.loads(f"{before.rstrip()}\n    limit: {{{limit}}}\nprogram:{after}")
    assert kind in {v.kind for v in judge(PROCESSED, machine=machine).violations}


def test_short_and_far_rapids_must_be_left_alone():
    short = Machine.loads(TEXT + "design: {minimum_length: 3}\n")
    assert Kind.LENGTH in {v.kind for v in judge(PROCESSED, machine=short).violations}
    near = Machine.loads(TEXT.replace("[-50, 50]", "[-0.5, 0.5]"))
    assert Kind.TRAVEL in {v.kind for v in judge(PROCESSED, machine=near).violations}


def test_a_stamp_without_any_stream_is_refused():
    original = "G21 G90\nG1 X1 F100\nM2\n"
    found = judge("(gcodejerk stamp 0.1.0 0123abcd Mill)\n" + original, original)
    assert [v.kind for v in found.violations] == [Kind.STAMP]


def test_stops_of_the_block_follow_the_stream():
    original = "G21 G90 G94 F600\nG0 Z0\nG0 Z1. M0\nM2\n"
    good = f"G21 G90 G94 F600\nG0 Z0\nG4 P0\n{UP}G0 F600\nM0\nM2\n"
    assert judge(good, original).violations == ()
    for wrong in (
        good.replace("M0\n", ""),
        good.replace("M0", "M1"),
        good.replace("M0\n", "M0\nM0\n"),
    ):
        assert not judge(wrong, original).ok


def test_exact_path_and_inverse_time_are_restored():
    original = "G21 G90 G93 G61\nG0 Z0\nG0 Z1.\nM2\n"
    points = UP.replace("G1 Z1. F", "G1 G61 Z1. F")
    good = f"G21 G90 G93 G61\nG0 Z0\nG94 G64\n{points}G0 G93\nM2\n"
    assert judge(good, original).violations == ()
    late = good.replace(points, UP).replace("G0 G93\n", "G0 G93 G61\n")
    assert Kind.PATH in {v.kind for v in judge(late, original).violations}
    lost = good.replace(points, UP).replace("G0 G93\n", "G0\n")
    kinds = {v.kind for v in judge(lost, original).violations}
    assert kinds == {Kind.FEED_MODE, Kind.PATH}


def test_an_f_that_is_unknown_must_not_be_needed():
    original = "G21 G90 G94\nG0 Z0\nG0 Z1.\nG1 Z2\nM2\n"
    processed = original.replace("G0 Z1.\n", f"G4 P0\n{UP}G0\n")
    assert not judge(processed, original).ok
    fine = original.replace("G1 Z2", "G1 Z2 F100")
    assert judge(processed.replace("G1 Z2", "G1 Z2 F100"), fine).ok


def test_inches_and_diameters_are_those_of_the_program():
    inch = "G4 P0\n" + stream({"Z": "0"}, {"Z": "0.04"}, decimals=6)
    original = "G20 G90 G94\nF20\nG0 Z0\nG0 Z0.04\nM2\n"
    assert judge(original.replace("G0 Z0.04\n", f"{inch}G0 F20\n"), original).violations == ()
    lines = stream({"X": "0"}, {"X": "2"}).splitlines()
    turned = "G4 P0\n" + "".join(_feed(line, 0.5) for line in lines)
    original = "G21 G7 G90 G94 F200\nG0 X0\nG0 X2\nM2\n"
    assert judge(original.replace("G0 X2\n", f"{turned}G0 F200\n"), original).violations == ()


def table(rows=None, line=3):
    rows = rows or [(k, profile(k * 0.001)[0]) for k in range(41)]
    text = "".join(f"{line},{k * 0.001:.3f},nan,{z:.4f}\n" for k, z in rows)
    return "block,t,X,Z\n" + text


CSV_ORIGINAL = b"G21 G90 G94 F600\nG0 Z0\nG0 Z1.\nG0 Z#1\nM2\n"


def judge_table(text):
    return verify_files(io.BytesIO(CSV_ORIGINAL), io.BytesIO(text.encode()), MACHINE, table=True)


def test_a_table_is_accepted():
    found = judge_table(table())
    assert found.violations == ()
    assert (found.rapids, found.rewritten) == (3, 1)


@pytest.mark.parametrize(
    ("before", "after", "kind"),
    [
        ("block,t", "block,time", Kind.TABLE),
        ("3,0.005,", "3;0.005,", Kind.TABLE),
        ("3,0.005,", "3,0.006,", Kind.TIME),
        ("3,0.000,nan,0.0000\n", "3,0.000,nan,0.0001\n", Kind.START),
        ("nan,1.0000\n", "nan,1.0001\n", Kind.END),
        ("3,", "4,", Kind.TABLE),
        ("3,", "1,", Kind.TABLE),
        ("3,0.020,nan,0.5000", "3,0.020,nan,0.9000", Kind.BACKWARDS),
        ("3,0.020,nan,0.5000", "3,0.020,nan,0.4950", Kind.ACCELERATION),
        ("3,0.010,nan,", "3,0.010,1.0,", Kind.TABLE),
    ],
)
def test_a_damaged_table_is_refused(before, after, kind):
    assert before in table()
    count = -1 if before == "3," else 1
    found = judge_table(table().replace(before, after, count))
    assert kind in {v.kind for v in found.violations}, found.violations


def test_increments_add_up_without_rounding():
    count = 100_000
    increments = np.full((count + 1, 1), 0.1)
    increments[0] = np.nan
    total = points.sum_up(increments, np.array([0]), np.array([count + 1]))
    assert (total[:, 0] == np.arange(count + 1) / 10).all()


def test_require_names_place_problem_and_remedy():
    with pytest.raises(VerifyError) as caught:
        require(judge(PROCESSED.replace("G1 X2 (cut)", "G1 X3 (cut)")))
    assert str(caught.value).startswith("<processed>:")
    assert "expected 'G1 X2 (cut)'" in str(caught.value)


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(VerifyError, match=r"missing\.nc"):
        verify(tmp_path / "missing.nc", b"", MACHINE)


def test_files_are_compared_as_bytes_are(tmp_path):
    (tmp_path / "a.nc").write_bytes(ORIGINAL.encode())
    (tmp_path / "b.nc").write_bytes(PROCESSED.encode())
    assert verify(tmp_path / "a.nc", str(tmp_path / "b.nc"), MACHINE).ok
