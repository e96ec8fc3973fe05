"""Plain lines that the second reader takes at once: as it takes them one by one, and no others."""

import io
import random
from dataclasses import fields, replace

import numpy as np
import pytest

from gcodejerk.nc import DIALECTS, Start, read_program
from gcodejerk.verification.findings import Findings
from gcodejerk.verification.second_reading import agreement
from gcodejerk.verification.second_reading.ahead import Ahead
from gcodejerk.verification.second_reading.computing import Computer
from gcodejerk.verification.second_reading.reading import Text
from gcodejerk.verification.second_reading.straight import PlainLines, Straight, follow
from gcodejerk.verification.second_reading.walking import Stepper

PLAIN = [
    *("G0 X%.3f Y%.3f", "G0 Z%.2f", "G1 Z-%.1f F%d.5", "X%.1f", "G00 Y.5 Z%.4f"),
    "G01X%.2fY-%.2fF%d",
    *("N12 G0 X%.3f Y%.3f Z%.3f", "N13 G1 X%.2f", "G0X%.1f F%d.", "G1 X%.2f Y%.2f Z-%.2f F%d"),
]  # fmt: skip
GAPS = ["G0 X %.3f Y\t%.3f", "G1 Z  -%.1f F%d.5", "X %.1fY  -%.2f ", "N12 G0 Z +.5 X %.2f"]
"""Blanks in front of numbers."""
ODD_GAPS = [
    *("G0 X - %.1f", "G0 X %.1f 5", "G1 X 1 %.1f", "G 0 X%.1f", "G1 Z . 5", "F %d", "G0 X", "N 5"),
]
ODD = [
    *("G91", "G90", "(text)", "G20", "G21", "M3 S100", "M5", "G54", "G55", "G0", "F%d", ""),
    "G4 P1",
    *("G81 X%.1f Z-2. R1. F50", "G80", "/G0 X%.1f", "G41 D1", "G40", "G92 X%.1f", "G68 X0 Y0 R9"),
    *("G69", "M6 T1", "G2 X%.1f Y1 I1 J0", "G0 X%.1f X1", "G0 X1..2", "g0 x%.1f", "G53 G0 Z0"),
    *("G94", "G95", "G0 A%.1f", "#1=%d", "G0 X#1", "M98 P1", "G64", "G0 X%.1f Y1 (a)", "G17"),
]  # fmt: skip


STATEMENTS = [
    *("3 L X%+.3f Y%-.3f R0 FMAX", "L  Z%+.2f FMAX", "12 L Z%+.1f F%d", "L X%+.1f R0", "L Y5 F%d"),
    *("7 L  X%+.1f  Y%.2f  Z%+.3f", " 8  L X+.5 FMAX ", "L Z5. F1.5"),
]
ODD_STATEMENTS = [
    *("L FMAX", "L X%+.1f RL", "L X%+.1f R0", "L IX%+.1f FMAX", "L X+Q1 FMAX", "L X+1,5", "L F%d"),
    *("L Y%+.1f X%+.1f FMAX", "L X%+.1f F300 FMAX", "L X%+.1f FMAX M8", "L X%+.1f FMAX M91", "L"),
    *("l x%+.1f fmax", "/ L X%+.1f", "L X%+.1f FMAX ;x", "L X%+.1f A+5 FMAX", "L X+1Y+2", "LBL 1"),
    *("TOOL CALL 5 Z S100", "L Z%+.1f R0 FMAX", "Q1 = %d", "CC X+1 Y+2", "C X+1 Y+2 DR+", "*", ""),
    *("L M140 MB MAX", "L X%+.1f FMAX F5", "L X%+.1f R0 R0", "L X%+.1f ~", "L X%+.1f F-5", "9"),
]


def filled(form, rng):
    return form % tuple(rng.uniform(1, 90) for _ in range(form.count("%")))


def drawn(rng, odd, klartext=False, gaps=False):
    lines = ["G90 G94 G17 G40 G49", "G21", "G0 X0. Y0. Z5.", "F100."]
    plain_forms, odd_forms = (PLAIN + GAPS, ODD + ODD_GAPS) if gaps else (PLAIN, ODD)
    if klartext:
        lines = ["0 BEGIN PGM PART MM", "1 L X+0 Y+0 Z+5 R0 F100"]
        plain_forms, odd_forms = STATEMENTS, ODD_STATEMENTS
    for _ in range(60):
        form = rng.choice(odd_forms if rng.random() < odd else plain_forms)
        lines += [filled(form, rng)]
        lines += [filled(rng.choice(plain_forms), rng) for _ in range(rng.choice((0, 10)))]
    return "\n".join([*lines, ""]).encode()


def readers(name):
    dialect = DIALECTS[name].set_up(Start())
    decimals = dialect.whole_numbers == "machine"
    text = Text(dialect, decimals)
    tracker = agreement._begin(text, dialect, Start())
    return Stepper(text, dialect), PlainLines(dialect, decimals), tracker


def same(a, b):
    return repr(a) == repr(b)


@pytest.mark.parametrize("gaps", [False, True])
@pytest.mark.parametrize("name", ["linuxcnc", "grbl", "fanuc", "haas", "mach", "klartext"])
def test_lines_taken_at_once_do_what_they_do_one_by_one(name, gaps):
    rng, taken = random.Random(name), 0
    for odd in (0.0, 0.1, 0.4):
        data = drawn(rng, odd, name == "klartext", gaps)
        stepper, plain, tracker = readers(name)
        at = 0
        while at < len(data):
            run = plain.take(data, at, tracker) if plain.ready(tracker) else None
            ends = run[1] if run else data.index(b"\n", at) + 1
            lines = data[at:ends].decode().splitlines()
            ahead = tracker.copy()
            if run:
                follow(ahead, run[0])
                taken += len(run[0])
            for k, line in enumerate(lines):
                seen = stepper.step(tracker, line.encode())
                if run:
                    assert same(seen.start[:3], run[0].start[k].tolist()), line
                    assert same(seen.end[:3], run[0].end[k].tolist()), line
                    assert seen.axes == run[0].axes[k]
                    assert (seen.against is None) == run[0].rapid[k] == seen.sure
                    assert same(seen.modes["F"], float(run[0].feed[k]))
            if run:
                assert {k: repr(v) for k, v in vars(ahead).items()} == {
                    k: repr(v) for k, v in vars(tracker).items()
                }
            at = ends
    assert taken > 100


def test_plain_lines_behind_a_shift_of_the_frame_tell_where_their_axes_are():
    begin = ["G71 G90 G94 G17 G40 G64", "G0 X0. Y0. Z5.", "G1 X1. F100.", "TRANS X5 Y2 Z1"]
    data = b"G0 X2.5\nG1 Z3.\n" * 8
    stepper, plain, tracker = readers("siemens")
    for line in begin:
        stepper.step(tracker, line.encode())
    before = tracker.untold.copy()
    assert before.keys() >= {"X", "Y", "Z"}
    run, end = plain.take(data, 0, tracker)
    assert (end, len(run)) == (len(data), 16)
    follow(tracker, run)
    assert before.keys() - tracker.untold.keys() == {"X", "Z"}


PROGRAM = b"G21 G90 G94 G17 G40 G64\nG0 X0 Y0 Z5\nF100\n" + b"".join(
    b"G0 X%d.5 Y%d\nG1 Z-3\nG0 Z5\n" % (k, k % 3) for k in range(40)
)


def compared(rapids, found=None):
    found = Findings(100) if found is None else found
    index = np.flatnonzero(rapids.reason == 255)
    count = agreement.confirm(io.BytesIO(PROGRAM), "linuxcnc", Start(), rapids, index, found)
    return count, found.violations


@pytest.fixture
def rapids():
    return read_program(io.BytesIO(PROGRAM), name="x.nc", dialect="linuxcnc").rapids


def test_what_is_taken_at_once_is_confirmed_as_one_by_one(rapids, monkeypatch):
    count, violations = compared(rapids)
    assert count > 70
    assert not violations
    seen = []
    monkeypatch.setattr(agreement, "disagreement", lambda *a: seen.append(a) or "")
    compared(rapids)
    assert len(seen) < 3
    monkeypatch.setattr(PlainLines, "ready", lambda *a: False)
    assert compared(rapids)[0] == count
    assert len(seen) > 70


@pytest.mark.parametrize(
    "column",
    [
        "start",
        "target",
        "words",
        "inch",
        "incremental",
        "feed_mode",
        "feed",
        "path",
        "path_p",
        "speed",
        "fed",
    ],
)
def test_what_differs_in_one_rapid_is_found_among_plain_lines(rapids, column, monkeypatch):
    assert column in {f.name for f in fields(rapids)}
    values = np.array(getattr(rapids, column))
    k = 50
    at = (k, 2) if values.ndim == 2 else k
    if values.dtype == bool:
        values[at] = not values[at]
    else:
        values[at] = {"words": 1, "feed_mode": 93, "path": 61}.get(column, 7.25)
    wrong = replace(rapids, **{column: values})
    count, violations = compared(wrong)
    assert [v.original_line for v in violations] == [int(rapids.line[k])]
    monkeypatch.setattr(PlainLines, "ready", lambda *a: False)
    assert compared(wrong) == (count, violations)


def test_columns_of_a_run_are_as_long_as_its_lines(rapids):
    stepper, plain, tracker = readers("linuxcnc")
    at = 0
    for _ in range(3):
        ends = PROGRAM.index(b"\n", at)
        stepper.step(tracker, PROGRAM[at:ends])
        at = ends + 1
    run, end = plain.take(PROGRAM, at, tracker)
    assert end == len(PROGRAM)
    assert all(len(getattr(run, f.name)) == 120 for f in fields(Straight) if f.name != "feeds")


COMPUTED = [
    *("G1 X[%.3f*#10+#6] Y[%.2f*#10]", "G2 X[%.3f*#10] Y[%.2f+#7] I[#11] J[-%.1f*#10]"),
    *("N7 G1 Z[-%.3f*#11+#8] F[#20*%.1f]", "Y[#7+%.1f]", "X[%.2f-#6]", "G3 X#6 Y#7 R[%.1f*#11]"),
    *("", "#7=[%.1f*#10]", "G1 X-%.2f Y[%.2f]", "G01 X[#[%d]]", "Z5.", "; said", "(text)"),
]
ODD_COMPUTED = [
    *("G0 X[%.2f*#10]", "G0 Z#8", "X[#99*%.1f]", "G91", "G90", "#[#7]=%.1f", "#6=#99", "M3 S[#20]"),
    *("G1 X[1/0]", "G1 X[#6] X[#7]", "G1 F[0*%.1f] X[#6]", "/X[%.1f*#10]", "G20", "G21", "G1 A#6"),
    *("X[%.1f*#10] (py,1)", "X[#6] (py, b=1)", "G1 X[ROUND[%.3f]]", "X[#6]" + 300 * " " + "Y1."),
    *("G41 D1", "G40", "M98 P1", "G53 G1 X[#6]", "G1 X[%.1f] Y[", "#6=[%.1f] G1 X#6", "G28 X[#6]"),
]


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc", "haas", "mach"])
def test_feed_moves_whose_numbers_are_computed_do_what_they_do_one_by_one(name):
    rng, taken = random.Random(name), 0
    for odd in ODD_COMPUTED:
        lines = ["G21 G90 G94 G17 G40 G49 G80", "G0 X0. Y0. Z5.", rng.choice(("F100.", ""))]
        lines += ["#6=5.", "#7=2.5", "#8=0.", "#10=0.375", "#11=2.", "#20=100.", "#99=#5221"]
        for _ in range(4):
            lines += [*rng.choices(COMPUTED, k=rng.choice((2, 12))), odd]
        data = "\n".join([*(filled(form, rng) for form in lines), ""]).encode()
        stepper, plain, tracker = readers(name)
        at = 0
        while at < len(data):
            before = tracker.copy()
            run = Ahead(stepper, tracker, plain, None).take_run(data, at)
            ends = run[1] if run else data.index(b"\n", at) + 1
            if run:
                tracker.run(run[0])
                taken += run[0].lines
            for bare in data[at:ends].splitlines():
                seen = stepper.step(before, bare)
                assert not (run and seen.sure), bare
            if run:
                assert run[0].lines == data.count(b"\n", at, ends)
                assert {k: repr(v) for k, v in vars(before).items()} == {
                    k: repr(v) for k, v in vars(tracker).items()
                }
            tracker, at = before, ends
    assert taken > 100


@pytest.mark.parametrize("line", ["G1 X[#6+1] (py,1)", "G1 X[#6+1]" + 300 * " " + "(long)"])
def test_a_computed_line_that_is_cut_or_runs_python_is_not_understood(line):
    stepper, _, tracker = readers("linuxcnc")
    for known in ("G21 G90 G94 G17 G40", "#6=5.", "G0 X0. Y0. Z5.", "G1 X[#6+1] F9. (text)"):
        stepper.step(tracker, known.encode())
    assert tracker.at[:3] == [6.0, 0.0, 5.0]
    stepper.step(tracker, line.encode())
    assert np.isnan(tracker.at[:3]).all()


@pytest.mark.parametrize("run", [["G1 X[#1+1]"] * 4, ["G0 X[#1+1]", *["G1 Y[#1]"] * 8]])
@pytest.mark.parametrize("often", [1, 100])
def test_what_is_looked_at_ahead_is_soon_taken(monkeypatch, run, often):
    looked = []
    spelled = Computer.spelled

    def counted(self, text, variables, inch):
        looked.append(text)
        return spelled(self, text, variables, inch)

    monkeypatch.setattr(Computer, "spelled", counted)
    lines = ["G21 G90 G94 G17 G40 G64", "G0 X0 Y0 Z5", "F100", "#1=5"]
    for _ in range(3000 // (often * len(run) + 1)):
        lines += [*run * often, "M8"]
    program = "\n".join([*lines, "G0 Z9", ""]).encode()
    monkeypatch.setattr(f"{__name__}.PROGRAM", program)
    assert not compared(read_program(io.BytesIO(program)).rapids)[1]
    assert len(lines) < 2 * len(looked) < 10 * len(lines)
